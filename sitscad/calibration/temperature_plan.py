"""Rows of a calibration plan at further temperatures, and the requirement that needs them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.calibration.points import Plan
from sitscad.estimates.performance.compensation import pad_lag, root_sum_square
from sitscad.estimates.performance.points import SensingAnalysis
from sitscad.estimates.performance.warming import WARMER
from sitscad.estimates.performance_values import FORCES, MOMENTS, load_unit
from sitscad.spec.thermistor import CALIBRATED, DESIGN

SAME_TEMPERATURE = 1.0
"""Largest difference (K) from the first row up to which rows count as at one temperature."""

LEAST_SOAK, SOAK_LEFT = 60.0, 0.05
"""Least wait (s) after a temperature is reached, and temperature (K) by which the pad may then still lag behind."""

WARM_SHARES = (0.0, 1.0, 0.0)
"""Normal forces (full scales) of the rows at each further temperature."""


@record(eq=False)
class TemperaturePlan:
    """Rows of a calibration plan at further temperatures.

    `base` (degrees Celsius) is the temperature of all other rows, and `others` are the further temperatures. `loads`
    (n, 3 or 5; N, N m) are applied at each temperature. `soak` (s) is the wait after a temperature is reached. `reason`
    is the text of the requirement that needs these rows. `reference` is the name of the reference coil that measures
    the temperature in use; empty if a separate temperature sensor measures it. `left` holds two drifts (axes; N, N m)
    that remain at full load: with the coefficients of the design, and with measured coefficients.
    """

    base: float
    others: tuple[float, ...]
    loads: Array
    soak: float
    reason: str
    reference: str
    left: tuple[Array, Array]

    def rows(self, plan: Plan) -> tuple[Array, Array]:
        """Return all loads (n, 3 or 5; N, N m) and their temperatures (n; degrees Celsius).

        The base temperature has the rows of `plan`, and also each load of the further temperatures.
        """
        base = plan.rows
        missing = [load for load in np.unique(self.loads, axis=0) if not np.any(np.all(base == load, axis=1))]
        loads = np.vstack([np.insert(base, len(base) - 1, missing, axis=0) if missing else base,
                           *([self.loads] * len(self.others))])
        count = len(base) + len(missing)
        return loads, np.concatenate([np.full(count, self.base), np.repeat(self.others, len(self.loads))])


def temperature_plan(sensing: SensingAnalysis, reference: str) -> TemperaturePlan | None:
    """Return the rows at further temperatures that a requirement or the spec needs. None if there is no such need.

    `reference` is the name of the reference coil; empty if there is none.
    """
    spec, reason = sensing.bench.spec, _measurement_reason(sensing)
    if not reason or spec.elastomer is None or spec.target is None:
        return None
    needs, scope = spec.requirements, sensing.bench.range
    ends = needs.temperature_range or (needs.temperature + WARMER,)
    others = tuple(end for end in ends if abs(end - needs.temperature) > SAME_TEMPERATURE)
    if not others:
        return None
    farthest = max(abs(end - needs.temperature) for end in others)
    settling = pad_lag(spec.elastomer.thickness, spec.elastomer.material.density, spec.target.thickness, 1.0)
    soak = max(LEAST_SOAK, settling * math.log(farthest / SOAK_LEFT))
    loads = np.array([scope.normal_load(share * scope.normal) for share in WARM_SHARES])
    left, drifts = sensing.warmed[-1].drift_left, sensing.drift_coefficients
    is_by_coil = drifts is not None and drifts.reference is not None
    return TemperaturePlan(needs.temperature, others, loads, soak, reason, reference if is_by_coil else "",
                           (root_sum_square(left[DESIGN]), root_sum_square(left[CALIBRATED])))


def _measurement_reason(sensing: SensingAnalysis) -> str:
    """Return why coefficients of drift have to be measured. Empty if there is no reason.

    A requirement is a reason if the remaining drift violates it with the coefficients of the design, and meets it with
    measured coefficients.
    """
    needs, settings = sensing.bench.spec.requirements, sensing.bench.spec.readout.compensation
    if settings is None or not all(sensing.is_pad_stable) or not sensing.warmed[-1].drift_left:
        return ""
    if settings.coefficients == CALIBRATED:
        return "readout.compensation.coefficients: calibrated"
    full, axes = sensing.warmed[-1], sensing.bench.range.axes
    drift, tared = ({source: root_sum_square(parts) for source, parts in left.items()}
                    for left in (full.drift_left, full.tared_drift_left))
    others = [error for cause, error in sensing.lasting_errors.items() if "drift" not in cause]
    combined = {source: np.sqrt(np.sum(np.square([*others, error]), axis=0)) for source, error in tared.items()}
    limits: list[tuple[str, float | None, Sequence[str], Mapping[str, Array]]] = [
        ("temperature_error", needs.temperature_error, FORCES, drift)]
    kinds: dict[str, Sequence[str]] = {"normal": FORCES[:1], "shear": FORCES[1:], "moment": MOMENTS}
    for kind, names in kinds.items():
        key = f"{kind}_{'error' if getattr(needs, f'{kind}_error') is not None else 'resolution'}"
        limits.append((key, getattr(needs, key), names, combined))
    for key, limit, names, errors in limits:
        measured = [k for k, name in enumerate(axes) if name in names]
        if limit is None or not measured:
            continue
        by_design, by_calibration = (float(errors[source][measured].max()) for source in (DESIGN, CALIBRATED))
        if by_calibration <= limit < by_design:
            values = (show(value, load_unit(axes[measured[0]]), 3) for value in (limit, by_design, by_calibration))
            return "requirements.{} is {}: {} with coefficients of the design, {} with measured ones".format(
                key, *values)
    return ""
