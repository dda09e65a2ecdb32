"""Sensing performance at a working point: values in newtons, and their JSON document."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.basics.units import show

FORCES = ("normal", "shear_x", "shear_y")
"""Force components of a load, in their order."""
MOMENTS = ("moment_x", "moment_y")
"""Moment components of a load, in their order."""
AXES = (*FORCES, *MOMENTS)
"""Components of a load in their order: forces (N), then moments (N m). A load without moments has three components."""

AXIS_WORDS = {"normal": "normal", "shear_x": "shear along x", "shear_y": "shear along y", "moment_x": "moment about x",
              "moment_y": "moment about y"}


def axis_names_text(axes: Iterable[str]) -> str:
    """Return the names of forces and moments: ``normal force, shear force along x and moment about y``."""
    names = (AXIS_WORDS[name] for name in axes)
    *first, last = (each.replace("normal", "normal force").replace("shear", "shear force") for each in names)
    return f"{', '.join(first)} and {last}" if first else last


INSTABILITY = "instability"
"""Name of an axis limit beyond which no stable shape of the pad carries the load: the pad buckles sideways."""

Loads = tuple[float, ...]
"""Components of a load (N, N m) in the order of `AXES`: three, or five with moments."""
Table = Mapping[str, Mapping[str, float]]
"""Table of numbers by row name and column name."""


def load_unit(axis: str) -> str:
    """Return the SI unit of a load component: N for forces, N m for moments."""
    return "N m" if axis in MOMENTS else "N"


SHOWN = {"N": (1.0, "N"), "N m": (1e3, "N mm")}
"""Display units: factor from the SI unit, and the unit in tables and plots, by SI unit of forces and moments."""


def display_factors(axes: Sequence[str]) -> Array:
    """Return the factors from SI units (N, N m) to display units (N, N mm), one for each axis.

    An axis may have a prefix that ends with a dot.
    """
    return np.array([SHOWN[load_unit(axis.rpartition(".")[2])][0] for axis in axes])


def split_by_unit(before: str, after: str, table: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return a table by axis as parts of a document, split into forces and moments.

    Forces are under the key `before` + "N" + `after`. Moments, if there are any, are under a key with "Nm" in place of
    "N".
    """
    parts = {"N": {name: row for name, row in table.items() if name not in MOMENTS},
             "Nm": {name: row for name, row in table.items() if name in MOMENTS}}
    return {f"{before}{unit}{after}": part for unit, part in parts.items() if part or unit == "N"}


def loads_on_axis(load: Array | Loads, axis: str, forces: Array) -> Array:
    """Return loads (n, 3 or 5; N, N m): `load` with one component replaced by each of the (n) `forces`."""
    loads = np.tile(np.asarray(load, dtype=float), (len(forces), 1))
    loads[:, AXES.index(axis)] = forces
    return loads


PASSING = ("before", "without")  # Words in the causes of errors that calibration or tare removes


@record
class AxisPerformance:
    """Sensing performance of one axis at a working point. For moments, read N m for N; `unit` states the unit.

    `range` (N) is the largest load, and `limited_by` names its limit. `full_scale` (N) is the required load.
    `sensitivity` (Hz/N) has one value per coil. `resolution` (N) is one sigma of noise at the scan rate. `nonlinearity`
    is the deviation from the best straight line, relative to full scale. `errors` maps each cause to its standard
    deviation (N).
    """

    range: float
    limited_by: str
    full_scale: float
    sensitivity: tuple[float, ...]
    resolution: float
    nonlinearity: float
    errors: Mapping[str, float] = field(default_factory=dict)
    unit: str = "N"

    def document(self) -> dict[str, object]:
        """Return the figures as JSON."""
        unit = self.unit.replace(" ", "")
        return {
            f"range_{unit}": self.range,
            "limited_by": self.limited_by,
            f"full_scale_{unit}": self.full_scale,
            f"sensitivity_Hz_per_{unit}": list(self.sensitivity),
            f"resolution_{unit}": _finite_or_none(self.resolution),
            "nonlinearity": self.nonlinearity,
            f"errors_{unit}": {cause: _finite_or_none(error) for cause, error in self.errors.items()},
        }


@record
class Performance:
    """Sensing performance at a working point `at` (`WORKING_POINTS`: rest, half, full) under `load` (N).

    Figures of moments are in N m in place of N. Except where stated, the target is kept level.

    Tilt stiffness: `tilt_stiffness` (N m/rad), by turn (rx, ry), is the pad's stiffness against a moment on the
    outermost face of a free target; NaN if the pad buckles. `tilt_stiffness_error` is its relative sigma by the pad's
    law, without the scatter of the modulus.

    Crosstalk: `crosstalk[a][b]` is the error of axis a, relative to its full scale, while b covers its full scale. It
    is for the polynomial that fits the design best. `straight_crosstalk` is for the linear map at this point.

    Tilt: `tilt_error` (N), by axis and angle (rx, ry), is for a contact tilted by `tilt` (rad: the required angle, or a
    degree); it is the worse of both directions. `tilt_slope` (N/rad) is for small angles, without terms of higher
    order. `contact_error` (N/mm), by axis and direction, is for a force beside the middle on a target that is free to
    tilt.

    `compensation` describes the compensation of drift by temperature: the sensor and its settings. `drift_left` (N) is
    the drift that it leaves, by source of the coefficients, part and axis. Both are empty without a temperature sensor.

    `temperature_error` (N/K) is one sigma; its causes (N/K) have signs if these are known. `friction_error` is the
    error of the ratio of shear to normal force, with its causes; None at rest, or if there is no shear.

    `bandwidth` (Hz) is the smaller of half the scan rate and the least `resonance`, and `bandwidth_by` names the limit.
    `resonance` (Hz), by axis, is for target and pad without anything on them. No data covers a silicone's lag by rate.

    `free_overload` (N) is the load at which the pad buckles under a target that is free to tilt; None if this is not
    before `overload` (N). `ambiguous` are two loads (N) with equal readings; None if the map can be inverted.
    """

    at: str
    load: Loads
    axes: Mapping[str, AxisPerformance]
    crosstalk: Table
    straight_crosstalk: Table
    tilt_slope: Table
    tilt: float
    tilt_error: Table
    tilt_stiffness: Mapping[str, float]
    tilt_stiffness_error: Mapping[str, float]
    contact_error: Table
    temperature_error: Mapping[str, float]
    temperature_causes: Table
    friction_error: float | None
    friction_causes: Mapping[str, float]
    bandwidth: float
    bandwidth_by: str
    resonance: Mapping[str, float]
    condition_number: float
    invertible: bool
    ambiguous: tuple[Loads, Loads] | None
    overload: float
    free_overload: float | None
    map_degree: int
    production: Table
    notes: tuple[str, ...] = ()
    compensation: Mapping[str, Any] = field(default_factory=dict)
    drift_left: Mapping[str, Table] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return a line with the resolution and the full scale of each axis."""
        axes = (f"{name} {show(axis.resolution, 'N', 2)} of {show(axis.full_scale, 'N', 3)}"
                for name, axis in self.axes.items())
        return f"<Performance at {self.at}: {', '.join(axes)}>"

    def document(self) -> dict[str, object]:
        """Return the figures as JSON."""

        def by_axis(load: Loads) -> dict[str, float]:
            return dict(zip(FORCES, load[: len(FORCES)], strict=True))

        def moments(load: Loads) -> dict[str, float]:
            return dict(zip(MOMENTS, load[len(FORCES) :], strict=True))

        moments_of_ambiguous = {} if self.ambiguous is None or len(self.ambiguous[0]) == len(FORCES) else {
            "ambiguous_Nm": [moments(load) for load in self.ambiguous]}
        return {
            "at": self.at,
            "load_N": by_axis(self.load),
            "axes": {name: axis.document() for name, axis in self.axes.items()},
            "crosstalk": self.crosstalk,
            "straight_crosstalk": self.straight_crosstalk,
            **split_by_unit("tilt_error_", "_per_rad", self.tilt_slope),
            "tilt_rad": self.tilt,
            **split_by_unit("tilt_error_", "", self.tilt_error),
            "tilt_stiffness_Nm_per_rad": {turn: _finite_or_none(value) for turn, value in self.tilt_stiffness.items()},
            "tilt_stiffness_error": {turn: _finite_or_none(value) for turn, value in self.tilt_stiffness_error.items()},
            **split_by_unit("contact_error_", "_per_mm", self.contact_error),
            **split_by_unit("temperature_error_", "_per_K", self.temperature_error),
            **self._causes(),
            **self._drift_left(),
            "friction_error": None if self.friction_error is None else _finite_or_none(self.friction_error),
            "friction_causes": {cause: _finite_or_none(error) for cause, error in self.friction_causes.items()},
            "bandwidth_Hz": self.bandwidth,
            "bandwidth_by": self.bandwidth_by,
            "resonance_Hz": dict(self.resonance),
            "condition_number": self.condition_number,
            "invertible": self.invertible,
            "ambiguous_N": None if self.ambiguous is None else [by_axis(load) for load in self.ambiguous],
            **moments_of_ambiguous,
            "overload_N": self.overload,
            "free_overload_N": self.free_overload,
            "map_degree": self.map_degree,
            "production": self.production,
            "notes": list(self.notes),
        }


    def _drift_left(self) -> dict[str, object]:
        """Return the drift that remains after temperature compensation. Empty without a compensation.

        It is sorted by source of the coefficients, part and axis.
        """
        if not self.drift_left:
            return {}
        parts = {source: {part: split_by_unit("drift_", "", row) for part, row in table.items()}
                 for source, table in self.drift_left.items()}
        return {"compensation": {**self.compensation, "left": parts}}

    def _causes(self) -> dict[str, object]:
        """Return the temperature errors (per K) by cause for JSON: forces and, if there are any, moments."""
        tables: dict[str, dict[str, object]] = {}
        for cause, row in self.temperature_causes.items():
            for name, part in split_by_unit("temperature_causes_", "_per_K", row).items():
                tables.setdefault(name, {})[cause] = part
        return dict(tables)


def _finite_or_none(value: float) -> float | None:
    """Return a finite number unchanged. None if it is infinite, such as the resolution of an axis without a signal."""
    return value if math.isfinite(value) else None


def worst_performance(each: Sequence[Performance]) -> Performance:
    """Return the worst value of several cells for each quantity, all at one working point.

    Coils of different cells are matched by their place in the cell.
    """
    # the note on a range's limit is from the shortest range; notes that differ by numbers alone appear once
    notes = [note for cell in sorted(each, key=lambda cell: cell.axes["normal"].range) for note in cell.notes]
    distinct = {re.sub(r"[0-9.]+", "", note): note for note in reversed(notes)}
    slow = min(each, key=lambda cell: cell.bandwidth)
    figures = {name: _worst([getattr(cell, name) for cell in each], pick)
               for pick, names in ((min, LEAST_IS_WORST), (_largest_magnitude, LARGEST_IS_WORST)) for name in names}
    return replace(
        slow, axes={name: _worst_axis([cell.axes[name] for cell in each]) for name in slow.axes},
        ambiguous=next((cell.ambiguous for cell in each if cell.ambiguous is not None), None),
        notes=tuple(note for note in dict.fromkeys(notes) if note in distinct.values()), **figures,
    )


LEAST_IS_WORST = ("load", "resonance", "invertible", "overload", "free_overload", "tilt_stiffness")
"""Attributes of `Performance` whose smallest value is the worst."""
LARGEST_IS_WORST = (
    "crosstalk", "straight_crosstalk", "tilt_slope", "tilt_error", "tilt_stiffness_error", "contact_error",
    "temperature_error", "temperature_causes", "drift_left", "friction_error", "friction_causes", "production",
    "condition_number", "map_degree",
)


def _worst_axis(each: Sequence[AxisPerformance]) -> AxisPerformance:
    least = min(each, key=lambda cell: cell.range)
    sensitivities = zip(*(cell.sensitivity for cell in each), strict=True)
    return AxisPerformance(
        least.range, least.limited_by, min(cell.full_scale for cell in each),
        tuple(min(coil, key=abs) for coil in sensitivities), max(cell.resolution for cell in each),
        max(cell.nonlinearity for cell in each), _worst([cell.errors for cell in each], _largest_magnitude), least.unit,
    )


def _worst(each: Sequence[Any], pick: Callable[[Sequence[Any]], Any]) -> Any:
    """Return the worst of several values; tables are compared entry by entry. None if all values are None.

    `pick` returns the worst number of a sequence.
    """
    values = [value for value in each if value is not None]
    if not values or not isinstance(values[0], Mapping):
        return pick(values) if values else None
    names = dict.fromkeys(name for value in values for name in value)
    return {name: _worst([value[name] for value in values if name in value], pick) for name in names}


def _largest_magnitude(numbers: Sequence[float]) -> float:
    """Return the number with the largest magnitude."""
    return max(numbers, key=abs)


OTHER_JAW_CAUSES = tuple(f"other jaw's metal with {what} in the jaws, without a tare there"
                         for what in ("nothing", "1 mm", "2 mm"))
"""Names of errors by the other jaw's metal, one for each grasped thickness in `other_jaw.GRASPED`."""

UNMEASURED = "at full scale, which is not measured"
"""Suffix of an error's name if the cause is a full-scale force on an axis that the coils cannot measure."""

UNCOMPENSATED = "without compensation"
"""Suffix of the name of a drift without temperature compensation. The compensated sensor does not have this drift."""

TILTED = "tilt of "
"""Prefix of the name of an error by a tilted contact, before the angle."""


def lasts_after_tare(cause: str) -> bool:
    """Return whether an error remains in a calibrated unit that is tared before each grasp. `cause` is its name.

    Errors by loads on axes that the sensor does not measure (`UNMEASURED`) do not count.
    """
    is_drift, is_tared = "drift" in cause, "with a tare" in cause
    is_tared = is_tared and not cause.endswith(UNCOMPENSATED)
    return is_tared if is_drift else not any(word in cause for word in (*PASSING, "not measured", "manufacture"))


def combined_error(errors: Mapping[str, float]) -> float:
    """Return the root sum of squares of the errors (N, N m) that remain after calibration and tare.

    `errors` are by cause; `lasts_after_tare` selects them. The causes are taken as independent.
    """
    return math.hypot(*(error for cause, error in errors.items() if lasts_after_tare(cause)))


def largest_lasting_error(errors: Mapping[str, float | None]) -> tuple[float, str]:
    """Return the largest error (N, N m) that neither calibration nor tare removes, and its cause.

    It is infinite for an axis without a signal. In a JSON document, infinite values are None.
    """
    lasting = {
        cause: math.inf if error is None else error
        for cause, error in errors.items()
        if not any(word in cause for word in PASSING)
    }
    cause = max(lasting, key=lambda name: lasting[name])
    return lasting[cause], cause


SENSELESS = 10.0
"""Largest error that is shown as a number, divided by the axis's full scale.

A larger result of the first-order calculation is meaningless.
"""


def full_scale_text(error: float, full: float, axis: str = "normal") -> str:
    """Return an error (N, N m) of an axis as text, with its percentage of the full scale `full` (N, N m)."""
    if error > SENSELESS * full:
        return f"more than {SENSELESS:.0f} times full scale"
    share, text = error / full, amount_text(error, axis, 2)
    return f"{text} ({100.0 * share:.0f} %)" if share >= 0.1 else f"{text} ({100.0 * share:.2g} %)"


def amount_text(value: float, axis: str, digits: int = 3) -> str:
    """Return a force (N) as text in newtons, or a moment (N m) as text in newton millimetres."""
    return f"{1e3 * value:.{digits}g} N mm" if axis in MOMENTS else f"{value:.{digits}g} N"
