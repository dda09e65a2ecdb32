"""Tables of sensing performance, for texts, pages and data sheets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from sitscad.basics.quantities import Table
from sitscad.basics.record import record
from sitscad.basics.units import DASH, show
from sitscad.estimates.loads.working_range import validated_shear, working_range
from sitscad.estimates.performance_values import (
    AXIS_WORDS,
    FORCES,
    INSTABILITY,
    MOMENTS,
    OTHER_JAW_CAUSES,
    TILTED,
    UNMEASURED,
    Performance,
    combined_error,
    largest_lasting_error,
    load_unit,
)
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.thermistor import CALIBRATED, DESIGN


@record(eq=False)
class MapFigures:
    """Range and crosstalk of the map from readings to newtons.

    ``end`` (N) is the largest normal force of the map without shear. ``crosstalk`` holds the error of each axis by each
    other axis, relative to full scale.
    """

    end: float
    crosstalk: Mapping[str, Mapping[str, float]]


@record(eq=False)
class PerformanceReport:
    """Performance of a sensor at its working points (rest, half, full load), from which all tables are made.

    ``points`` is empty if the sensor cannot respond. ``map`` is None if the map to newtons is unknown.
    """

    points: Sequence[Performance]
    spec: SensorSpec
    """Spec of the sensor."""
    map: MapFigures | None = None

    def documents(self) -> list[dict[str, object]]:
        """Return the performance at each working point as JSON."""
        return [point.document() for point in self.points]

    def tables(self) -> list[Table]:
        """Return the tables of performance: axes, whole sensor, errors by cause, drift by cause, compensation.

        Empty if the sensor cannot respond.
        """
        if not self.points:
            return []
        whole = Table(("sensor", ""), list(sensor_rows(self.documents())))
        return [axis_table(self), whole, error_table(self.points), drift_table(self.points),
                *compensation_tables(self.points)]


def axis_table(report: PerformanceReport) -> Table:
    """Return the table of performance of every axis, with the range of the map to newtons if it is known."""
    head = "characteristic", *(AXIS_WORDS[name] for name in report.points[-1].axes)
    return Table(head, [*_range_rows(report), *_error_rows(report)])


def _range_rows(report: PerformanceReport) -> Iterator[tuple[str, ...]]:
    """Yield the rows on full scale and range of each axis: as required, as the pad permits, as calibrated."""
    axes, newtons, together = report.points[-1].axes, report.map, working_range(report.spec)
    names, valid_shear = list(axes), validated_shear(report.spec)
    yield "full scale", *(load_text(axis.full_scale, name) for name, axis in axes.items())
    if together.has_circular_shear:
        limit = f"{_newtons(together.shear)} ({_newtons(together.shear / math.sqrt(2.0))} each)"
        yield "calibrated for a resultant shear up to", *(DASH if name == "normal" else limit for name in names)
    turns = "free to tilt" if any(name in MOMENTS for name in names) else "kept level"
    yield (f"range of the pad, {turns}, and its first limit",
           *(f"{load_text(axis.range, name)}, {axis.limited_by}" for name, axis in axes.items()))
    if newtons is not None:
        yield (f"calibrated range: the map to newtons ends at{', least signal' if report.spec.cells else ''}",
               *(f"{_newtons(newtons.end)}, pressed alone" if name == "normal" else DASH for name in names))
    shears = [name for name in names if name in FORCES[1:]]
    if any(max(axes[name].full_scale, axes[name].range) > valid_shear for name in shears):
        yield ("extrapolated by the pad's law beyond",
               *(_newtons(valid_shear) if name in shears else DASH for name in names))


def _error_rows(report: PerformanceReport) -> Iterator[tuple[str, ...]]:
    """Yield the rows on resolution, errors, sensitivity and crosstalk of each axis."""
    points, newtons = report.points, report.map
    rest, full, half = points[0], points[-1], next(point for point in points if point.at == "half")
    axes, names = full.axes, list(full.axes)
    for point in points:
        yield (f"resolution {point.at}: the noise alone",
               *(load_text(axis.resolution, name) for name, axis in point.axes.items()))
    lasting = {name: largest_lasting_error(axis.errors) for name, axis in axes.items()}
    yield ("largest error by one cause, full load, one tare at the start",
           *(f"{load_text(error, name)}, {cause.replace(UNMEASURED, 'not told')}"
             for name, (error, cause) in lasting.items()))
    yield ("errors together, full load, a tare before each grasp",
           *(load_text(combined_error(axis.errors), name) for name, axis in axes.items()))
    causes = axes[names[0]].errors
    if any(UNMEASURED in cause for cause in causes):
        yield ("these, and full scale of each axis that is not measured",
               *(load_text(math.hypot(combined_error(axis.errors),
                                      *(error for cause, error in axis.errors.items() if UNMEASURED in cause)), name)
                 for name, axis in axes.items()))
    for point, cause in product((rest, full), [cause for cause in causes if cause in OTHER_JAW_CAUSES]):
        yield f"{cause}, {point.at}", *(load_text(point.axes[name].errors[cause], name) for name in names)
    for cause, point in ((temperature_errors(rest)[0], rest), *((cause, full) for cause in temperature_errors(full))):
        yield _cause_text(cause), *(load_text(point.axes[name].errors[cause], name) for name in names)
    yield (f"largest sensitivity of a coil{' in the least sensitive cell' if report.spec.cells else ''}, half load",
           *(f"{show(1e-3 * value, 'Hz', 3)}/(N mm)" if name in MOMENTS else f"{show(value, 'Hz', 3)}/N"
             for name, value in ((name, max(map(abs, half.axes[name].sensitivity))) for name in names)))
    yield "nonlinearity, straight map, half load", *(share_text(half.axes[name].nonlinearity) for name in names)
    yield "crosstalk, straight map, half load", *(_crosstalk_text([half.straight_crosstalk], name) for name in names)
    yield ("crosstalk, best polynomial, design as drawn, worst load",
           *(_crosstalk_text([point.crosstalk for point in points], name) for name in names))
    if newtons is not None:
        yield (f"crosstalk, map to newtons, design as drawn, half load{', least signal' if report.spec.cells else ''}",
               *(_crosstalk_text([newtons.crosstalk], name) for name in names))
    degrees = f"{math.degrees(full.tilt):.3g}"
    tilt = "one degree" if degrees == "1" else f"{degrees} degrees"
    for angle in ("rx", "ry"):
        yield (f"error by {tilt} of {angle} alone, either way, full load",
               *(load_text(full.tilt_error[name][angle], name) for name in names))
    yield "error by a force 0.1 mm beside", *(load_text(axis.errors[BESIDE], name) for name, axis in axes.items())
    yield ("drift at full load, a kelvin after the one tare",
           *(load_text(full.temperature_error[name], name) for name in names))


def temperature_errors(point: Performance) -> list[str]:
    """Return the names of the errors by temperature at a working point.

    They are the drift after one tare, and the drift with a tare before each grasp.
    """
    return [cause for cause in next(iter(point.axes.values())).errors if "drift" in cause]


def _cause_text(cause: str) -> str:
    """Return the name of an error for tables. For a drift, it includes the start of the temperature change."""
    if "drift" not in cause:
        return cause
    return f"{cause} after the {'calibration' if 'with a tare' in cause else 'one tare'}"




LEAST_TOLD = 1e-4  # Crosstalk of a noiseless map below which digits are meaningless

FROM_UNIT_TO_UNIT = ("modulus, before calibration", "manufacture, before calibration", "manufacture, after calibration")
"""Causes of error that differ between units. `error_table` leaves them out."""

BESIDE = "contact 0.1 mm beside the middle"
"""Name of the error by a force 0.1 mm beside the target's middle."""


def error_table(points: Sequence[Performance]) -> Table:
    """Return the table of standard deviations of error at full load, by causes that do not differ between units."""
    full = points[-1]
    names = list(full.axes)
    head = "one sigma of error at full load, any unit, by cause", *(AXIS_WORDS[name] for name in names)
    causes = (cause for cause in full.axes[names[0]].errors if cause not in FROM_UNIT_TO_UNIT)
    rows = [(f"{cause}, rx and ry (root of squares)" if cause.startswith(TILTED) else _cause_text(cause),
             *(load_text(full.axes[name].errors[cause], name) for name in names)) for cause in causes]
    return Table(head, rows)


def drift_table(points: Sequence[Performance]) -> Table:
    """Return the table of drift at full load for a temperature change by one kelvin, by the part that becomes warmer.

    Signs are shown if they are known.
    """
    full = points[-1]
    names = list(full.axes)
    rows = []
    for cause, row in full.temperature_causes.items():
        sign = "+-" if cause == "capacitors" else ""
        rows.append((cause, *(sign + load_text(row[name], name) for name in names)))
    return Table(("by a kelvin after the one tare", *(AXIS_WORDS[name] for name in names)), rows)


COEFFICIENTS = {DESIGN: "design coefficients", CALIBRATED: "calibrated at two temperatures"}
"""Description of each source of a compensation's coefficients, for tables."""


def compensation_tables(points: Sequence[Performance]) -> list[Table]:
    """Return a table of the drift that remains after temperature compensation at full load, by its parts.

    Empty if the sensor has no compensation.
    """
    full = points[-1]
    rows = []
    for source, parts in full.drift_left.items():
        whole = {name: math.hypot(*(part[name] for part in parts.values())) for name in full.axes}
        for what, row in {"root sum of squares": whole, **parts}.items():
            rows.append((f"{COEFFICIENTS[source]}: {what}", *(load_text(row[name], name) for name in full.axes)))
    if not rows:
        return []
    head = f"left by a compensation after {full.compensation['warming_K']:.3g} K, by {full.compensation['by']}"
    return [Table((head, *(AXIS_WORDS[name] for name in full.axes)), rows)]


SIDEWAYS = "the pad gives way sideways"  # Limit of a normal force before the pad's largest strain


def sensor_rows(points: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    """Yield name and value, as texts, of the quantities that belong to the sensor as a whole.

    `points` are documents of `Performance`, from rest to full load.
    """
    first, full = points[0], points[-1]
    ends = SIDEWAYS if full["axes"]["normal"]["limited_by"] == INSTABILITY else "30 % strain of the pad"
    free = full["free_overload_N"]
    yield f"overload{', kept level' if free is not None else ''} ({ends})", show(full["overload_N"], "N", 3)
    if free is not None:
        yield f"overload, free to tilt ({SIDEWAYS})", show(free, "N", 3)
    for point in (first, full):
        yield f"stiffness against a tilt, {point['at']}", _stiffness_text(point)
    friction = full["friction_error"]
    ratio = DASH if friction is None else f"+-{friction:.2g} (one sigma)"
    yield "error of the ratio of shear to normal force, full load", ratio
    slowest = min(points, key=lambda point: float(point["bandwidth_Hz"]))
    yield f"bandwidth ({slowest['bandwidth_by']})", show(slowest["bandwidth_Hz"], "Hz", 3)
    resonances = (f"{show(value, 'Hz', 2)} {AXIS_WORDS[name]}" for name, value in first["resonance_Hz"].items())
    yield "resonance of target and pad at rest, nothing on it", ", ".join(resonances) or DASH
    yield ("condition number, rest to full load",
           f"{first['condition_number']:.2g} to {full['condition_number']:.2g}")
    yield "each reading means one load", "yes" if full["invertible"] else "NO: see the notes"


def _stiffness_text(point: Mapping[str, Any]) -> str:
    """Return the stiffness (N m/rad) against tilts rx and ry at a working point as text, with its relative sigma.

    The moment acts on the target's outermost face. The sigma is the error of the pad's law.
    """
    texts = []
    for turn, value in point["tilt_stiffness_Nm_per_rad"].items():
        error = point["tilt_stiffness_error"][turn]
        is_known = value is not None and error is not None and error < 1.0
        texts.append(f"{turn} {show(value, 'N m', 3)}/rad +- {100.0 * error:.0f} %" if is_known
                     else f"{turn}: not known")
    return ", ".join(dict.fromkeys(texts))


def _newtons(force: float) -> str:
    return load_text(force, "normal")


def load_text(value: float, name: str) -> str:
    """Return a force (N) or a moment (N m) on the axis `name` as text."""
    if math.isinf(value):
        return "no reading tells it"
    unit, least = load_unit(name), LEAST_MOMENT if name in MOMENTS else LEAST_FORCE
    return show(value, unit, 3) if abs(value) >= least else f"0 {'N mm' if name in MOMENTS else unit}"


LEAST_FORCE, LEAST_MOMENT = 1e-6, 1e-9  # Least force (N) and moment (N m) that tables show


def share_text(part: float) -> str:
    """Return a fraction as text in per cent: two digits, or whole per cents from 10 % on."""
    return f"{100.0 * part:.0f} %" if part >= 0.1 else f"{100.0 * part:.2g} %"


def _crosstalk_text(tables: Iterable[Mapping[str, Mapping[str, float]]], name: str) -> str:
    """Return the largest crosstalk of the axis `name` in some tables, as text."""
    fractions = [fraction for table in tables for fraction in table[name].values()]
    if not fractions:
        return DASH
    worst = max(fractions)
    return share_text(worst) if worst >= LEAST_TOLD else f"below {share_text(LEAST_TOLD)}"
