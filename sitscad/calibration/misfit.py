"""Notes on disagreements between a table of measured points and the fitted model.

They report the row that agrees least with the others, unusual values of unknowns, and noise at rest. A further note
reports that the target probably tilted although the fit assumes a level target, or the reverse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from sitscad.assembly.places.motions import ROTATIONS
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.calibration.bench_data import BenchTable
from sitscad.calibration.inverse_map import InverseMap
from sitscad.calibration.map_fit import FITTED_LOADS, TEST_LOADS
from sitscad.calibration.model_fit import SUSPECT, ModelFit, NoFit, fit_model
from sitscad.calibration.points import Points, load_slopes
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual_value
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.performance_values import amount_text

UNUSUAL = 3.0
"""Limit for a fitted unknown, in manufacturing standard deviations from nominal. Larger values are reported.

Simulated sensors stay within 2 standard deviations.
"""

LIKELIER = 12.0
"""Least difference of `ModelFit.cost` at which a note reports that the other rotation of the target is more likely.

The cost is minus twice the logarithm of the likelihood. At this difference, the odds are 400 to 1.
"""

ODD = 3.7
"""Limit for `ModelFit.disagreement` of a row, in standard deviations. Rows with a larger value are reported."""

NOISY = 0.5
"""Limit for the ratio of two errors, above which a note is given.

The first is the force error by noise, as a fraction of full scale. The second is the error of the applied loads, as a
fraction of the load (`usual("force")`).
"""

CAUSES = {
    "gap": "a pad of another thickness (elastomer.thickness), or another glue line",
    "glue": "another glue line, or a pad that is not bonded",
    "offset": "a target that lies beside its place (target.offset)",
    "tilt": "a target or pad that was glued on askew",
    "twist": "a target that is turned (target.rotation)",
    "modulus": "another silicone or mix (elastomer.material), or normal loads in another unit (g, kgf)",
    "shear_modulus": "shear loads of another size than the table says (a thread that pulls askew or rubs, another "
                     "unit), or a target that turns otherwise (--rotation)",
    "pad_curve": "a pad that stiffens otherwise than its law, or the largest normal loads are not what the table says",
    "softening": "a target that turns otherwise (--rotation), or shear that was read without the normal force of its "
                 "row",
    "shear_curve": "a pad that stiffens in shear otherwise than its law, or the largest shear loads are not what the "
                   "table says",
    "inductance": "coils of another spec",
    "target_change": "a target of another size or metal, or metal behind the coils that the spec does not have",
    "capacitor": "another capacitor, another reference clock (readout.clock), or coils of another spec",
}
"""Possible causes of an unusual value of an unknown, by the unknown's name without coil or direction."""


def cause_text(name: str) -> str:
    """Return the text with the possible cause of an unusual value of the unknown `name`."""
    first = name.partition(".")[0]
    return CAUSES.get(first) or CAUSES[first.rpartition("_")[0]]


def unusual_unknowns(sensors: Sensors, fit: ModelFit) -> Iterator[str]:
    """Yield a note on each unknown that exceeds `UNUSUAL` standard deviations, the largest first."""
    for k in np.argsort(-np.abs(fit.moved), kind="stable"):
        unknown, deviation = sensors.unknowns[k], float(fit.moved[k])
        if abs(deviation) > UNUSUAL:
            amount = f"{fit.errors[k]:.3g} {'relative' if unknown.unit == '1' else unknown.unit}"
            yield (f"unusual: {unknown.name} is {deviation:+.1f} sigma of manufacture off ({amount}): "
                   f"{cause_text(unknown.name)}? The forces are right for the loads of the table only if those are "
                   f"right")


def worst_row(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> tuple[str, str, float, float]:
    """Return the row that agrees least with the other rows: (place, text, standard deviations, error).

    The place is path:line:1. The standard deviations are `ModelFit.disagreement`. The error is the row's largest
    difference from the force that the other rows predict, in full scales; 0 for poses.
    """
    row = int(np.argmax(np.where(points.at_rest, -np.inf, fit.disagreement)))
    text, share = f"by {fit.disagreement[row]:.1f} sigma of what the others scatter", 0.0
    if fit.force_errors is not None:
        off = np.nan_to_num(np.abs(fit.force_errors[row]) / sensors.range.full_scales)
        axis = int(np.argmax(off))
        name, share = sensors.range.axes[axis], float(off[axis])
        text = f"the others foretell {name} {amount_text(share * sensors.range.full_scales[axis], name)} off, {text}"
    return f"{table.path}:{table.lines[row]}:1", text, float(fit.disagreement[row]), share


def disagreement_note(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> str:
    """Return a note if the total error exceeds the expected errors too much, or if one row contradicts the others.

    Empty otherwise. The note names the row that agrees least.
    """
    where, text, odd, _ = worst_row(table, points, sensors, fit)
    if fit.excess <= SUSPECT and odd <= ODD:
        return ""
    return (f"{where} loads and model are off by {fit.excess:.1f} times what is expected, and this row most: {text}: "
            "noise, hysteresis, creep, a slip, or another load than the row says? Read that row again")


def noise_force_sigma(points: Points, sensors: Sensors, fit: ModelFit) -> float:
    """Return the largest standard deviation, of all axes, of a force near rest by noise, in full scales.

    The noise is the noise of a reading and of its tare together.
    """
    slopes = load_slopes(sensors, fit.errors, sensors.range.normal_load(0.0)[None])[0]
    noise = math.sqrt(2.0) * points.noise_ratio * sensors.mean_noise(int(usual_value("readings")))
    return float(np.sqrt(np.sum((np.linalg.pinv(slopes) * noise) ** 2, axis=1)).max())


def noise_text(table: BenchTable, points: Points, share: float) -> str:
    """Return a text on the scatter of rows without load, with the worst row.

    `share` is the result of `noise_force_sigma`.
    """
    tare = int(np.argmax(np.abs(points.rest_noise).max(axis=1))) if len(points.rest_noise) else 0
    return (f"{table.path}:{table.lines[int(np.flatnonzero(points.at_rest)[tare])]}:1 rows without load scatter by "
            f"{points.noise_ratio:.0f} times the converter's noise (drift along the rows taken out), "
            f"{100.0 * share:.2g} % "
            "of full scale on a force, this one most: a slip, noise of supply or cable, a target that was touched, or "
            "drift that goes up and down?")


def noise_note(table: BenchTable, points: Points, sensors: Sensors, fit: ModelFit) -> str:
    """Return a note if rows without load scatter more than the converter's noise, beyond `NOISY`. Empty otherwise."""
    share = noise_force_sigma(points, sensors, fit)
    if points.noise_ratio <= 1.0 or share < NOISY * usual_value("force"):
        return ""
    return f"{noise_text(table, points, share)} In use noise comes on top of the stated error"


@record(eq=False)
class OppositeRotationFit:
    """Fit of the same points with the opposite assumption on the target's rotation (kept level, or free to tilt).

    `sensors` are the simulated sensors with this rotation. `cost_advantage` is the `cost` of the original fit minus the
    `cost` of this `fit`. It is positive if this fit is better.
    """

    cost_advantage: float
    sensors: Sensors
    fit: ModelFit

    @property
    def note(self) -> str:
        """Note on the target's rotation. Empty if this fit is not better by `LIKELIER`."""
        if self.cost_advantage < LIKELIER:
            return ""
        rotation = self.sensors.rotation
        (this,) = (each for each in ROTATIONS if each != rotation)
        return (f"the readings are those of a target that is {ROTATIONS[rotation]}, not {ROTATIONS[this]}, as far "
                f"as the model knows (there they are {self.fit.excess:.1f} times as far off as is expected): was it "
                f"calibrated so? Then `--rotation {rotation}`, and the map is for such use")

    def error(self, fitted: InverseMap) -> Array:
        """Return the rms force error (axes; N) of the map `fitted` if the target has this rotation.

        0 unless this fit is better by `LIKELIER`.
        """
        if self.cost_advantage < LIKELIER:
            return np.zeros(len(fitted.axes))
        loads = np.vstack([np.zeros((1, 3)), self.sensors.range.evenly_spread_loads(TEST_LOADS // 2, FITTED_LOADS)])
        frequency = self.sensors.frequencies_under(self.fit.errors, loads)
        borne = np.all(np.isfinite(frequency), axis=1)
        off = fitted(frequency[borne], frequency[0]) - loads[borne][:, self.sensors.range.columns]
        return np.asarray(np.sqrt(np.mean(off**2, axis=0)))


def fit_opposite_rotation(
    sensors: Sensors, other: Callable[[], Sensors], points: Points, fit: ModelFit
) -> OppositeRotationFit | None:
    """Return the fit of the same loads with the opposite rotation. `other` returns the sensors with that rotation.

    None for poses, and for loads without shear, because their readings do not depend on the rotation. Also None if the
    fit does not converge or the pad fails sideways.
    """
    if points.loads is None or not np.any(points.loads[:, [k for k in sensors.range.columns if k]]):
        return None
    try:
        turned = fit_model(other(), points)
    except (NoFit, NoResponse):
        return None
    return OppositeRotationFit(fit.cost - turned.cost, other(), turned)
