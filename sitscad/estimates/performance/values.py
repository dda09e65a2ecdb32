"""What a sensor feels at a working point, as values and as the contract's JSON."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from sitscad.arrays import Array
from sitscad.record import record, replace
from sitscad.units import show

AXES = ("normal", "shear_x", "shear_y")

Loads = tuple[float, float, float]
Table = Mapping[str, Mapping[str, float]]


def along(load: Array | Loads, axis: str, forces: Array) -> Array:
    """A load (3; N) with (n,) forces on one axis: (n, 3)."""
    found = np.tile(np.asarray(load, dtype=float), (len(forces), 1))
    found[:, AXES.index(axis)] = forces
    return found


PASSING = ("before", "without")  # Words in the causes of errors that a calibration or a tare takes away


@record
class AxisPerformance:
    """One axis at a working point: range (N) and what ends it, full scale (N: what is asked), sensitivity of every coil
    (Hz/N), resolution (N, one sigma of noise at the scan rate), nonlinearity (of the full scale, by the best straight
    line), and one sigma of errors (N) by cause.
    """

    range: float
    limited_by: str
    full_scale: float
    sensitivity: tuple[float, ...]
    resolution: float
    nonlinearity: float
    errors: Mapping[str, float] = field(default_factory=dict)

    def document(self) -> dict[str, object]:
        """The figures as the contract's JSON has them."""
        return {
            "range_N": self.range,
            "limited_by": self.limited_by,
            "full_scale_N": self.full_scale,
            "sensitivity_Hz_per_N": list(self.sensitivity),
            "resolution_N": _finite(self.resolution),
            "nonlinearity": self.nonlinearity,
            "errors_N": {cause: _finite(error) for cause, error in self.errors.items()},
        }


@record
class Performance:
    """The sensor at a working point `at` (rest, half, full) under `load` (N).

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
            return dict(zip(AXES, load, strict=True))

        return {
            "at": self.at,
            "load_N": by_axis(self.load),
            "axes": {name: axis.document() for name, axis in self.axes.items()},
            "crosstalk": self.crosstalk,
            "straight_crosstalk": self.straight_crosstalk,
            "tilt_error_N_per_rad": self.tilt_slope,
            "tilt_rad": self.tilt,
            "tilt_error_N": self.tilt_error,
            "contact_error_N_per_mm": self.contact_error,
            "temperature_error_N_per_K": dict(self.temperature_error),
            "temperature_causes_N_per_K": self.temperature_causes,
            "friction_error": None if self.friction_error is None else _finite(self.friction_error),
            "friction_causes": {cause: _finite(error) for cause, error in self.friction_causes.items()},
            "bandwidth_Hz": self.bandwidth,
            "bandwidth_by": self.bandwidth_by,
            "resonance_Hz": dict(self.resonance),
            "condition_number": self.condition_number,
            "invertible": self.invertible,
            "ambiguous_N": None if self.ambiguous is None else [by_axis(load) for load in self.ambiguous],
            "overload_N": self.overload,
            "free_overload_N": self.free_overload,
            "map_degree": self.map_degree,
            "production": self.production,
            "notes": list(self.notes),
        }


def _finite(value: float) -> float | None:
    """A figure; None of one that is infinite, as of the noise on an axis that no reading tells."""
    return value if math.isfinite(value) else None


def worst_of(each: Sequence[Performance]) -> Performance:
    """One working point of several cells, every figure that of the cell which is worst in it; coils are those of a cell
    by their places in it, and of ``production`` all.
    """
    first, least = each[0], min(each, key=lambda one: one.load)
    # what ends a range is said of the one that ends first, and what differs by a figure alone once
    notes = [note for one in sorted(each, key=lambda one: one.axes["normal"].range) for note in one.notes]
    said = {re.sub(r"[0-9.]+", "", note): note for note in reversed(notes)}
    frees = [one.free_overload for one in each if one.free_overload is not None]
    frictions = [one.friction_error for one in each if one.friction_error is not None]
    slow = min(each, key=lambda one: one.bandwidth)

    def largest(name: str) -> Any:
        return _largest([getattr(one, name) for one in each])

    tables = ("crosstalk", "straight_crosstalk", "tilt_slope", "tilt_error", "contact_error", "temperature_error",
              "temperature_causes", "friction_causes", "production", "condition_number", "map_degree")
    return replace(
        first, load=least.load, axes={name: _worst_axis([one.axes[name] for one in each]) for name in first.axes},
        friction_error=max(frictions, default=None), bandwidth=slow.bandwidth, bandwidth_by=slow.bandwidth_by,
        resonance={name: min(one.resonance[name] for one in each) for name in first.resonance},
        invertible=all(one.invertible for one in each), overload=min(one.overload for one in each),
        ambiguous=next((one.ambiguous for one in each if one.ambiguous is not None), None),
        free_overload=min(frees, default=None),
        notes=tuple(note for note in dict.fromkeys(notes) if note in said.values()),
        **{name: largest(name) for name in tables},
    )


def _worst_axis(each: Sequence[AxisPerformance]) -> AxisPerformance:
    least, told = min(each, key=lambda one: one.range), zip(*(one.sensitivity for one in each), strict=True)
    return AxisPerformance(
        least.range, least.limited_by, min(one.full_scale for one in each),
        tuple(min(coil, key=abs) for coil in told), max(one.resolution for one in each),
        max(one.nonlinearity for one in each), _largest([one.errors for one in each]),
    )


def _largest(each: Sequence[Any]) -> Any:
    """Of numbers that which is farthest from zero, of tables all their rows so."""
    if not isinstance(each[0], Mapping):
        return max(each, key=abs)
    names = dict.fromkeys(name for one in each for name in one)
    return {name: _largest([one[name] for one in each if name in one]) for name in names}


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


def of_full_scale(error: float, full: float) -> str:
    """An error (N) in words, with its share of full scale (N)."""
    if error > SENSELESS * full:
        return f"more than {SENSELESS:.0f} times full scale"
    share = error / full
    return f"{error:.2g} N ({100.0 * share:.0f} %)" if share >= 0.1 else f"{error:.2g} N ({100.0 * share:.2g} %)"
