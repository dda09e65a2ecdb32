"""From readings to forces: the map, as a function of arrays and as a document; and a small correction of it by what the
model leaves of measured forces, where the points say that it serves.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from sitscad.arguments import checked_arguments
from sitscad.arrays import Array, Flags
from sitscad.estimates.performance.values import unit_of
from sitscad.physics.polynomials import Exponents, monomials
from sitscad.record import record

LEAST = 1e-6  # What is left of a target's change of L, over that at rest, at least: its logarithm is taken
BEYOND = 0.1  # By how much of full scale a reading may lie outside what the map was made for


@record(eq=False)
class MapForm:
    """The arrays of an `InverseMap` that make forces, over their full scales, of readings over their tare."""

    gain: Array
    logarithmic: bool
    mix: Array
    powers: Exponents
    numerator: Array
    denominator: Array
    denominator_powers: Exponents
    low: Array
    high: Array
    knots: Array
    spline_powers: Exponents

    def mixed(self, readings: Array, tare: Array) -> Array:
        """About the force on every axis over its full scale, v (n, axes), of readings (n, coils) after a tare."""
        return np.asarray(changes(readings, tare, self.gain, self.logarithmic) @ self.mix.T)

    def quotient(self, mixed: Array) -> tuple[Array, Array]:
        """What the force over full scale is a quotient of, (n, axes) each, however far v is beyond `low` and `high`."""
        top = terms(mixed, self.powers, self.knots, self.spline_powers) @ self.numerator.T
        return top, 1.0 + monomials(mixed, self.denominator_powers) @ self.denominator.T


@record(eq=False)
class InverseMap(MapForm):
    """Readings to forces (N), and to moments (N m) where some of its axes are those. With n0 the tare (counts or
    frequencies at rest), n a reading and s = (n0/n)^2 - 1, which is L/L(rest) - 1, every coil gives u = ln(1 - gain s),
    the logarithm of the target's change over that at rest (or u = -s where the map is not `logarithmic`). v = `mix` u
    is about the force on every axis over its full scale, and force = full_scale x (numerator . terms of v) / (1 +
    denominator . terms of v); no reading, no force.

    Terms are products of v to the `powers`, then those to `spline_powers` times (v[0] - knot)^3 beyond every knot.
    `low` and `high` are the v that it was made for: v beyond them by more than `BEYOND` counts as no farther, because
    out there the terms run to thousands of full scales. `error` (N) is what forces are off by on every axis, rms over
    the loads: one sigma of sensors for a map that was drawn, what 95 % of them stay below for one that was measured;
    `rest` are the counts to be expected at rest.
    """

    sensor: str
    revision: str
    coils: tuple[str, ...]
    axes: tuple[str, ...]
    full_scale: Array
    error: Array
    rest: Array

    def __repr__(self) -> str:
        """A line with the sensor, the coils and the full scale of each axis."""
        axes = (f"{name} to {full:.3g} N" for name, full in zip(self.axes, self.full_scale, strict=True))
        return f"<InverseMap of {self.sensor}: {', '.join(self.coils)} to {', '.join(axes)}>"

    def __call__(self, readings: ArrayLike, tare: ArrayLike) -> Array:
        """Forces (n, axes; N) of readings (n, coils) after a tare (coils): counts or frequencies, both of one kind. Of
        readings beyond what the map was made for (`holds`) it is the force where it ends. Raises ValueError for other
        shapes, and for readings that are not positive.
        """
        return self.forces_at(np.clip(self.checked(readings, tare), self.low - BEYOND, self.high + BEYOND))

    @property
    def end(self) -> float:
        """The normal force (N), alone, beyond which readings give no more of it."""
        ends = np.where(np.arange(len(self.high)) == 0, self.high + BEYOND, 0.0)
        return float(self.forces_at(ends[None])[0, 0])

    def checked(self, readings: ArrayLike, tare: ArrayLike) -> Array:
        """What `mixed` gives of readings and tare that a map can take; raises ValueError for others."""
        given, rest = np.atleast_2d(np.asarray(readings, dtype=float)), np.asarray(tare, dtype=float)
        if given.shape[1:] != (len(self.coils),) or rest.shape != (len(self.coils),):
            raise ValueError(f"readings of {len(self.coils)} coils, and one tare for each, are wanted")
        if not (np.all(given > 0.0) and np.all(rest > 0.0)):
            raise ValueError("readings and tare are positive numbers")
        return self.mixed(given, rest)

    def forces_at(self, mixed: Array) -> Array:
        """Forces (n, axes; N) at what `mixed` gives, however far beyond what the map was made for."""
        top, bottom = self.quotient(mixed)
        return np.asarray(self.full_scale * top / bottom)

    def holds(self, readings: ArrayLike, tare: ArrayLike) -> Flags:
        """Whether readings (n, coils) are such as the map was made for, (n,)."""
        mixed = self.checked(readings, tare)
        return np.all((mixed >= self.low - BEYOND) & (mixed <= self.high + BEYOND), axis=1)

    def document(self) -> dict[str, Any]:
        """The map as plain values for JSON; `map_of` reads them."""
        return {
            "sensor": self.sensor, "revision": self.revision, "coils": list(self.coils), "axes": list(self.axes),
            "unit": "N", "units": [unit_of(axis) for axis in self.axes], "logarithmic": self.logarithmic,
            **{name: getattr(self, name).tolist() for name in ARRAYS},
        }


WHOLE = ("powers", "denominator_powers", "spline_powers")
ARRAYS = ("full_scale", "error", "rest", "gain", "mix", "low", "high", *WHOLE[:1], "numerator", *WHOLE[1:2],
          "denominator", *WHOLE[2:], "knots")
"""The arrays of a document, in its order; those of whole numbers."""


@checked_arguments
def map_of(document: Mapping[str, Any] | str | Path) -> InverseMap:
    """The map of a calibration.json: its path, or what it holds (also as part of the whole document). Raises ValueError
    for what is no such document.
    """
    if not isinstance(document, Mapping):
        try:
            document = json.loads(Path(document).read_text(encoding="utf-8"))
        except RecursionError as error:
            raise ValueError("not a map from readings to forces: the JSON document is nested too deeply") from error
    try:
        known = cast(Mapping[str, Any], document).get("map", document)
        axes = len(known["axes"])
        arrays: dict[str, Any] = {
            name: np.asarray(known[name], dtype=np.int64 if name in WHOLE else float) for name in ARRAYS
        }
        for name in WHOLE:
            arrays[name] = arrays[name].reshape(-1, axes)
        arrays["denominator"] = arrays["denominator"].reshape(axes, -1)
        words: dict[str, Any] = {name: str(known[name]) for name in ("sensor", "revision")}
        words |= {name: tuple(known[name]) for name in ("coils", "axes")}
        return InverseMap(**words, **arrays, logarithmic=bool(known["logarithmic"]))
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"no map from readings to forces: {error} is missing or wrong") from error


def changes(readings: Array, rest: Array, gain: Array, logarithmic: bool) -> Array:
    """What every coil gives (n, coils): u of a `MapForm`."""
    share = (rest - readings) / readings
    change = share * (2.0 + share)
    return np.log(np.maximum(1.0 - gain * change, LEAST)) if logarithmic else -change


def terms(mixed: Array, powers: Exponents, knots: Array, spline_powers: Exponents) -> Array:
    """Values (n, terms) of a map's terms."""
    plain = monomials(mixed, powers)
    if not len(knots):
        return plain
    others = monomials(mixed, spline_powers)
    beyond = np.maximum(mixed[:, :1] - knots, 0.0) ** 3
    return np.hstack([plain, (beyond[:, :, None] * others[:, None, :]).reshape(len(mixed), -1)])


WEIGHTS = (1e-3, 1e-2, 1e-1, 1.0, 10.0)  # How firmly a correction is held small: of its columns' mean square
DEGREES = (1, 2)  # Degrees of corrections that are tried

SERVES, MEASURED_A_TERM = 0.8, 3
"""A correction is taken where it leaves less than this of the errors, every point foretold by the others, and where
there are so many points for each of its terms."""


@record(eq=False)
class Correction:
    """The map with what was added (`degree` 0: nothing), and the errors (n, axes; N) as other points foretell."""

    map: InverseMap
    degree: int
    before: Array
    after: Array


def ridge(columns: Array, wanted: Array, weight: float) -> tuple[Array, Array]:
    """Coefficients (terms, outputs) that take columns (n, terms) to what is wanted (n, outputs), held small by `weight`
    of the columns' mean square; and what is left of every row when it is foretold by the others alone (n, outputs).
    """
    size = np.sqrt(np.mean(columns**2, axis=0)) + 1e-300
    scaled = columns / size
    left, singular, right = np.linalg.svd(scaled, full_matrices=False)
    shrunk = singular / (singular**2 + weight * len(columns))
    found = (right.T * shrunk) @ (left.T @ wanted)
    hat = np.sum(left**2 * (singular * shrunk), axis=1)
    alone = (wanted - scaled @ found) / np.maximum(1.0 - hat, 1e-9)[:, None]
    return found / size[:, None], alone


def correct(given: InverseMap, readings: Array, tare: Array, forces: Array) -> Correction:
    """The correction of a map by readings (n, coils) and forces (n, axes; N), the tare left out."""
    mixed = given.mixed(readings, tare)
    top, bottom = given.quotient(mixed)
    before = forces - given.full_scale * top / bottom
    found = Correction(given, 0, before, before)
    for degree in DEGREES:
        chosen = np.flatnonzero(given.powers.sum(axis=1) <= degree)
        columns = monomials(mixed, given.powers[chosen])
        for weight in WEIGHTS if len(before) >= MEASURED_A_TERM * len(chosen) else ():
            numerator, alone = given.numerator.copy(), np.empty_like(before)
            for k, scale in enumerate(given.full_scale):
                added, left = ridge(columns / bottom[:, k : k + 1], before[:, k : k + 1] / scale, weight)
                numerator[k, chosen] += added[:, 0]
                alone[:, k] = left[:, 0] * scale
            share = np.linalg.norm(alone / given.full_scale) / np.linalg.norm(found.after / given.full_scale)
            if share < SERVES:
                found = Correction(replace(given, numerator=numerator), degree, before, alone)
    return found
