"""What a sensor feels at a working point, as values and as the contract's JSON."""

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
MOMENTS = ("moment_x", "moment_y")
AXES = (*FORCES, *MOMENTS)
"""What stands in a load, in this order; loads without a moment may end after the forces."""

AXIS_WORDS = {"normal": "normal", "shear_x": "shear along x", "shear_y": "shear along y", "moment_x": "moment about x",
              "moment_y": "moment about y"}


def load_words(axes: Iterable[str]) -> str:
    """Forces and moments by their names: ``normal force, shear force along x and moment about y``."""
    words = (AXIS_WORDS[name] for name in axes)
    *others, last = (each.replace("normal", "normal force").replace("shear", "shear force") for each in words)
    return f"{', '.join(others)} and {last}" if others else last


INSTABILITY = "instability"
"""End of an axis if no shape of the pad bears the load: it gives way sideways."""

Loads = tuple[float, ...]
Table = Mapping[str, Mapping[str, float]]


def unit_of(axis: str) -> str:
    """The SI unit of an axis."""
    return "N m" if axis in MOMENTS else "N"


SHOWN = {"N": (1.0, "N"), "N m": (1e3, "N mm")}
"""Factor and unit in which tables and plots have forces and moments, by their SI unit."""


def shown_scales(axes: Sequence[str]) -> Array:
    """What loads (N, N m) on some axes are multiplied with for a table: moments stand there in newton millimetres."""
    return np.array([SHOWN[unit_of(axis.rpartition(".")[2])][0] for axis in axes])


def by_unit(before: str, after: str, table: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables by axis as parts of a document: forces under `before` N `after`, moments, if any, with Nm."""
    parts = {"N": {name: row for name, row in table.items() if name not in MOMENTS},
             "Nm": {name: row for name, row in table.items() if name in MOMENTS}}
    return {f"{before}{unit}{after}": part for unit, part in parts.items() if part or unit == "N"}


def along(load: Array | Loads, axis: str, forces: Array) -> Array:
    """A load (3 or 5; N, N m) with (n,) forces or moments on one axis: (n, 3 or 5)."""
    found = np.tile(np.asarray(load, dtype=float), (len(forces), 1))
    found[:, AXES.index(axis)] = forces
    return found


PASSING = ("before", "without")  # Words in the causes of errors that a calibration or a tare takes away


@record
class AxisPerformance:
    """One axis at a working point: range (N) and what ends it, full scale (N: what is asked), sensitivity of every coil
    (Hz/N), resolution (N, one sigma of noise at the scan rate), nonlinearity (of the full scale, by the best straight
    line), and one sigma of errors (N) by cause. Of a moment N is N m; `unit` says which.
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
        """The figures as the contract's JSON has them."""
        unit = self.unit.replace(" ", "")
        return {
            f"range_{unit}": self.range,
            "limited_by": self.limited_by,
            f"full_scale_{unit}": self.full_scale,
            f"sensitivity_Hz_per_{unit}": list(self.sensitivity),
            f"resolution_{unit}": _finite(self.resolution),
            "nonlinearity": self.nonlinearity,
            f"errors_{unit}": {cause: _finite(error) for cause, error in self.errors.items()},
        }


@record
class Performance:
    """The sensor at a working point `at` (`WORKING_POINTS`: rest, half, full) under `load` (N).

    Figures of moments are in N m in place of N. `tilt_stiffness` (N m/rad) by the turn (rx, ry) is how the pad holds a
    target that is free to move against a moment on its outermost face, NaN if the pad gives way;
    `tilt_stiffness_error` is one sigma of that by the pad's law, relative, without the scatter of the modulus.

    `crosstalk[a][b]` is the error of axis a while b goes over its full scale, over a's full scale: of the polynomial
    that fits the design best, and of the straight map at this point (`straight_crosstalk`). `tilt_error` (N) by axis
    and angle (rx, ry) of a contact that is tilted by `tilt` (rad: the required one, else a degree), the worse of both
    ways; `tilt_slope` (N/rad) is that of small angles, which leaves out all that grows with their square;
    `contact_error` (N/mm) by axis and direction in which the force stands beside the middle, the target tilting as it
    likes; `temperature_error` (N/K, one sigma) with its causes (N/K, signed where the sign is known);
    `friction_error` that of shear over normal (None without shear or at rest) with its causes; `bandwidth` (Hz)
    is the least of half the scan rate and `resonance`, that of target and pad by axis with nothing on them
    (`bandwidth_by` says which; a silicone's lag by rate is in no data); `overload` (N), ranges and all that no other
    target is named for are of one that is kept level, and `free_overload` (N) is where the pad gives way sideways under
    one that is free to tilt (None: not before the overload); `ambiguous` are two loads (N) of one reading,
    None where the map can be inverted.
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

    def __repr__(self) -> str:
        """A line with the resolution and the full scale of each axis."""
        axes = (f"{name} {show(one.resolution, 'N', 2)} of {show(one.full_scale, 'N', 3)}"
                for name, one in self.axes.items())
        return f"<Performance at {self.at}: {', '.join(axes)}>"

    def document(self) -> dict[str, object]:
        """The figures as the contract's JSON has them."""

        def by_axis(load: Loads) -> dict[str, float]:
            return dict(zip(FORCES, load[: len(FORCES)], strict=True))

        def moments(load: Loads) -> dict[str, float]:
            return dict(zip(MOMENTS, load[len(FORCES) :], strict=True))

        alike = {} if self.ambiguous is None or len(self.ambiguous[0]) == len(FORCES) else {
            "ambiguous_Nm": [moments(load) for load in self.ambiguous]}
        return {
            "at": self.at,
            "load_N": by_axis(self.load),
            "axes": {name: axis.document() for name, axis in self.axes.items()},
            "crosstalk": self.crosstalk,
            "straight_crosstalk": self.straight_crosstalk,
            **by_unit("tilt_error_", "_per_rad", self.tilt_slope),
            "tilt_rad": self.tilt,
            **by_unit("tilt_error_", "", self.tilt_error),
            "tilt_stiffness_Nm_per_rad": {turn: _finite(value) for turn, value in self.tilt_stiffness.items()},
            "tilt_stiffness_error": {turn: _finite(value) for turn, value in self.tilt_stiffness_error.items()},
            **by_unit("contact_error_", "_per_mm", self.contact_error),
            **by_unit("temperature_error_", "_per_K", self.temperature_error),
            **self._causes(),
            "friction_error": None if self.friction_error is None else _finite(self.friction_error),
            "friction_causes": {cause: _finite(error) for cause, error in self.friction_causes.items()},
            "bandwidth_Hz": self.bandwidth,
            "bandwidth_by": self.bandwidth_by,
            "resonance_Hz": dict(self.resonance),
            "condition_number": self.condition_number,
            "invertible": self.invertible,
            "ambiguous_N": None if self.ambiguous is None else [by_axis(load) for load in self.ambiguous],
            **alike,
            "overload_N": self.overload,
            "free_overload_N": self.free_overload,
            "map_degree": self.map_degree,
            "production": self.production,
            "notes": list(self.notes),
        }


    def _causes(self) -> dict[str, object]:
        """What temperature does by its causes: of forces, and of moments where there are some."""
        found: dict[str, dict[str, object]] = {}
        for cause, row in self.temperature_causes.items():
            for name, part in by_unit("temperature_causes_", "_per_K", row).items():
                found.setdefault(name, {})[cause] = part
        return dict(found)


def _finite(value: float) -> float | None:
    """A figure; None of one that is infinite, as of the noise on an axis that no reading tells."""
    return value if math.isfinite(value) else None


def worst_of(each: Sequence[Performance]) -> Performance:
    """One working point of several cells, each figure the worst of them; coils of different cells count by their place
    in the cell.
    """
    # what ends a range is said of the one that ends first, and what differs by a figure alone once
    notes = [note for one in sorted(each, key=lambda one: one.axes["normal"].range) for note in one.notes]
    said = {re.sub(r"[0-9.]+", "", note): note for note in reversed(notes)}
    slow = min(each, key=lambda one: one.bandwidth)
    figures = {name: _worst([getattr(one, name) for one in each], pick)
               for pick, names in ((min, LEAST_IS_WORST), (_farthest, LARGEST_IS_WORST)) for name in names}
    return replace(
        slow, axes={name: _worst_axis([one.axes[name] for one in each]) for name in slow.axes},
        ambiguous=next((one.ambiguous for one in each if one.ambiguous is not None), None),
        notes=tuple(note for note in dict.fromkeys(notes) if note in said.values()), **figures,
    )


LEAST_IS_WORST = ("load", "resonance", "invertible", "overload", "free_overload", "tilt_stiffness")
LARGEST_IS_WORST = (
    "crosstalk", "straight_crosstalk", "tilt_slope", "tilt_error", "tilt_stiffness_error", "contact_error",
    "temperature_error", "temperature_causes", "friction_error", "friction_causes", "production", "condition_number",
    "map_degree",
)


def _worst_axis(each: Sequence[AxisPerformance]) -> AxisPerformance:
    least, told = min(each, key=lambda one: one.range), zip(*(one.sensitivity for one in each), strict=True)
    return AxisPerformance(
        least.range, least.limited_by, min(one.full_scale for one in each),
        tuple(min(coil, key=abs) for coil in told), max(one.resolution for one in each),
        max(one.nonlinearity for one in each), _worst([one.errors for one in each], _farthest), least.unit,
    )


def _worst(each: Sequence[Any], pick: Callable[[Sequence[Any]], Any]) -> Any:
    """The worst of some figures, of tables row by row; None if all are None."""
    known = [one for one in each if one is not None]
    if not known or not isinstance(known[0], Mapping):
        return pick(known) if known else None
    names = dict.fromkeys(name for one in known for name in one)
    return {name: _worst([one[name] for one in known if name in one], pick) for name in names}


def _farthest(numbers: Sequence[float]) -> float:
    """The number farthest from zero."""
    return max(numbers, key=abs)


OTHER_JAW_CAUSES = tuple(f"other jaw's metal with {what} in the jaws, without a tare there"
                         for what in ("nothing", "1 mm", "2 mm"))
"""Names of what the other jaw's metal is read as, by what lies between it and the sensor (`other_jaw.GRASPED`)."""

UNMEASURED = "at full scale, which is not measured"
"""What causes of errors say of axes of force that the array does not tell."""


def lasts_tared(cause: str) -> bool:
    """Whether an error by that cause lasts in a calibrated unit, tared before each grasp, without unmeasured loads."""
    is_drift, is_tared = "drift" in cause, "with a tare" in cause
    return is_tared if is_drift else not any(word in cause for word in (*PASSING, "not measured", "manufacture"))


def combined_error(errors: Mapping[str, float]) -> float:
    """Root of the squares of the errors (N, N m) that `lasts_tared` counts: causes are taken as independent."""
    return math.hypot(*(error for cause, error in errors.items() if lasts_tared(cause)))


def largest_lasting(errors: Mapping[str, float | None]) -> tuple[float, str]:
    """The largest error (N) that neither calibration nor tare takes away, and its cause; infinite on an axis that no
    reading tells, whose errors a document has as None.
    """
    lasting = {
        cause: math.inf if error is None else error
        for cause, error in errors.items()
        if not any(word in cause for word in PASSING)
    }
    cause = max(lasting, key=lambda one: lasting[one])
    return lasting[cause], cause


SENSELESS = 10.0
"""Full scales from which on an error, found to first order, is told as that alone: its digits mean nothing."""


def of_full_scale(error: float, full: float, axis: str = "normal") -> str:
    """An error (N, N m) of an axis in words, with its share of full scale."""
    if error > SENSELESS * full:
        return f"more than {SENSELESS:.0f} times full scale"
    share, said = error / full, amount_text(error, axis, 2)
    return f"{said} ({100.0 * share:.0f} %)" if share >= 0.1 else f"{said} ({100.0 * share:.2g} %)"


def amount_text(value: float, axis: str, digits: int = 3) -> str:
    """A force in newtons, or a moment in newton millimetres, in words."""
    return f"{1e3 * value:.{digits}g} N mm" if axis in MOMENTS else f"{value:.{digits}g} N"
