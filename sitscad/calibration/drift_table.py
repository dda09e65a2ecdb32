"""Drift of one sensor from a table of measured points: temperatures that are refused, and notes on the fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Flags
from sitscad.calibration.bench_data import TEMPERATURE, BenchError, BenchTable
from sitscad.calibration.calibration import Calibration
from sitscad.calibration.drift_fit import DriftFit, DriftModel, fit_drift, reference_coefficient
from sitscad.calibration.misfit import ODD, UNUSUAL
from sitscad.calibration.model_fit import SUSPECT
from sitscad.calibration.points import Points
from sitscad.calibration.refusals import WORST
from sitscad.calibration.temperature_plan import SAME_TEMPERATURE
from sitscad.calibration.unknowns import SURELY
from sitscad.estimates.performance.compensation import CALIBRATED_MARGIN, CAPACITORS, DriftCoefficients
from sitscad.estimates.performance.points import SensingAnalysis
from sitscad.estimates.performance.warming import farthest_temperature, warming

MAX_OUTSIDE = 15.0
"""Largest difference (K) of a row's temperature from the required range. Beyond it, another unit is assumed."""

LEAST_REFERENCE_RATIO = 0.25
"""Least ratio of a reference coil's measured drift to its drift by the design. The largest ratio is the inverse."""


def fit_table_drift(
    sensing: SensingAnalysis, calibration: Calibration, table: BenchTable, points: Points, reference: str
) -> Calibration:
    """Return a calibration with the coefficients of drift from the rows of a table at further temperatures.

    `points` are all rows of the `table`, and `reference` is the name of the reference coil; empty if there is none. If
    all rows are at one temperature, the map has the coefficients of the design. Raises BenchError.
    """
    drifts = sensing.drift_coefficients
    column = table.column(TEMPERATURE)
    if drifts is None or calibration.fit is None:
        raise BenchError(f"{table.path}:1:{column.number} temperatures: the spec has no readout.compensation, so "
                         "nothing reads the temperature in use. Add a sensor, or leave this column out")
    celsius = table.numbers(column)
    needs = sensing.bench.spec.requirements
    require_temperatures(table, (needs.temperature, farthest_temperature(needs), *(needs.temperature_range or ())))
    is_base = rows_at_base(table)
    if is_base.all():
        note = ("all rows are at one temperature: the coefficients of drift are those of the design. Measure "
                f"{farthest_temperature(needs):.3g} degC, too")
        return replace(calibration, remarks=(*calibration.remarks, note))
    coefficient = None if drifts.reference is None else measured_reference(table, points, is_base, drifts, reference)
    model = DriftModel(sensing, calibration.sensors, calibration.fit.errors)
    drift = fit_drift(model, calibration.map, points, celsius, is_base, table.lines, coefficient)
    require_drift(table, drift)
    return replace(calibration, map=replace(calibration.map, drifts=drift.coefficients), drift=drift,
                   remarks=(*calibration.remarks, *drift_notes(table, drift, warming(needs))))


def rows_at_base(table: BenchTable) -> Flags:
    """Return flags (n): the rows at the temperature of the first row. All, if the table has no temperatures."""
    if table.column_index(TEMPERATURE) is None:
        return np.ones(len(table.values), dtype=bool)
    celsius = table.numbers(table.column(TEMPERATURE))
    return np.abs(celsius - celsius[:1]) <= SAME_TEMPERATURE


def require_temperatures(table: BenchTable, required: Sequence[float]) -> None:
    """Raise BenchError for a temperature far from the `required` temperatures (degrees Celsius)."""
    column = table.column(TEMPERATURE)
    celsius = table.numbers(column)
    low, high = min(required) - MAX_OUTSIDE, max(required) + MAX_OUTSIDE
    outside = (celsius < low) | (celsius > high)
    if outside.any():
        row = int(np.argmax(outside))
        raise BenchError(f"{table.position(row, column)} temperature {celsius[row]:.4g} degC, required {low:.3g} to "
                         f"{high:.3g} degC. Write degrees Celsius, or change requirements.temperature_range")


def measured_reference(
    table: BenchTable, points: Points, is_base: Flags, drifts: DriftCoefficients, reference: str
) -> float:
    """Return the measured drift (per K) of the reference coil. Raises BenchError without its column."""
    if table.column_index(reference) is None:
        raise BenchError(f"{table.path}:1:1 no column for the reference coil {reference}, which measures the "
                         f"temperature in use. Write {reference}_counts")
    column = table.column(reference)
    values = table.numbers(column)
    if np.any(values <= 0.0):
        raise BenchError(f"{table.position(int(np.argmax(values <= 0.0)), column)} {reference}: a reading is above 0")
    if not np.any(points.at_rest & ~is_base):
        raise BenchError(f"{table.path}:{table.lines[-1]}:1 no row without load at a further temperature: the "
                         f"reference coil {reference} is read at rest")
    drift = reference_coefficient((-0.5 if column.kind == "H" else 1.0) * np.log(values),
                                  table.numbers(table.column(TEMPERATURE)), is_base, points.at_rest)
    design = drifts.reference
    assert design is not None
    if not LEAST_REFERENCE_RATIO < drift / design < 1.0 / LEAST_REFERENCE_RATIO:
        raise BenchError(f"{table.path}:1:{column.number} the reference coil {reference} drifts by {1e6 * drift:.3g} "
                         f"ppm/K, and by the design {1e6 * design:.3g} ppm/K: another coil, or a wrong temperature")
    return drift


def require_drift(table: BenchTable, drift: DriftFit) -> None:
    """Raise BenchError if the rows at further temperatures contradict the design or each other."""
    where = f"{table.path}:{drift.lines[drift.worst]}:1"
    odd = drift.disagreement[drift.worst]
    if drift.excess > WORST:
        raise BenchError(f"{where} the drift disagrees by {drift.excess:.0f} times what is expected, this row most "
                         f"({odd:.1f} sigma): a wrong temperature, load or reading?")
    for name, (value, _, before) in drift.moved.items():
        moved = _moved_sigmas(name, value, before)
        if abs(moved) > SURELY:
            raise BenchError(f"{where} {name}: {moved:+.1f} sigma from the design. No sensor of this design drifts "
                             "so: wrong temperatures (degrees Celsius), or another material?")


def _moved_sigmas(name: str, value: float, before: float) -> float:
    """Return the difference of an unknown `name` of the drift from its design value, in prior standard deviations.

    `value` is its fitted value, and `before` its prior standard deviation.
    """
    return (value - (0.0 if name.startswith(CAPACITORS) else 1.0)) / before


def drift_notes(table: BenchTable, drift: DriftFit, required: float) -> Iterator[str]:
    """Yield notes on a fit of the drift. `required` (K) is the temperature change of the design."""
    axes, full, worst = drift.coefficients, drift.error(required), drift.worst
    odd = float(drift.disagreement[worst])
    if drift.span * CALIBRATED_MARGIN < required:
        yield (f"temperatures of the rows are {drift.span:.3g} K apart, and {required:.3g} K are required: forces are "
               f"compensated up to {axes.largest_change:.3g} K. Over {required:.3g} K the coefficients would leave "
               f"{full[0]:.2g} N of the normal force")
    if drift.excess > SUSPECT or odd > ODD:
        yield (f"{table.path}:{drift.lines[worst]}:1 rows at further temperatures are off by {drift.excess:.1f} times "
               f"what is expected, and this row most, by {odd:.1f} sigma: read it again after a longer wait")
    for name, (value, _, before) in drift.moved.items():
        moved = _moved_sigmas(name, value, before)
        if abs(moved) > UNUSUAL:
            yield f"unusual drift by {name}: {moved:+.1f} sigma from the design. Are the temperatures right?"
