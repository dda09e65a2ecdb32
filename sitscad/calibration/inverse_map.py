"""From readings to forces: the map, as a function of arrays and as a document."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.estimates.performance_values import unit_of
from sitscad.kernels.electromagnetics.polynomials import Exponents, monomials

LEAST = 1e-6  # What is left of a target's change of L, over that at rest, at least: its logarithm is taken
BEYOND = 0.1  # By how much of full scale a reading may lie outside what the map was made for


@record(eq=False)
class InverseMap:
    """Readings to forces (N), and to moments (N m) where some of its axes are those. With n0 the tare (counts or
    frequencies at rest), n a reading and s = (n0/n)^2 - 1, which is L/L(rest) - 1, every coil gives u = ln(1 - gain s).
    v = `mix` u is about the force on every axis over its full scale, and force = full_scale x coefficients . terms, the
    terms being products of v to the `powers`; no reading, no force.

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
    gain: Array
    mix: Array
    low: Array
    high: Array
    powers: Exponents
    coefficients: Array

    @property
    def form(self) -> str:
        """The form in words."""
        return f"polynomial of degree {int(self.powers.sum(axis=1).max())} in ln(1 - gain (L/L0 - 1))"

    def mixed(self, readings: Array, tare: Array) -> Array:
        """About the force on every axis over its full scale, v (n, axes), of readings (n, coils) after a tare."""
        return np.asarray(changes(readings, tare, self.gain) @ self.mix.T)

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
        return np.asarray(self.full_scale * (monomials(mixed, self.powers) @ self.coefficients.T))

    def holds(self, readings: ArrayLike, tare: ArrayLike) -> Flags:
        """Whether readings (n, coils) are such as the map was made for, (n,)."""
        mixed = self.checked(readings, tare)
        return np.all((mixed >= self.low - BEYOND) & (mixed <= self.high + BEYOND), axis=1)

    def document(self) -> dict[str, Any]:
        """The map as plain values for JSON; `map_of` reads them."""
        return {
            "sensor": self.sensor, "revision": self.revision, "coils": list(self.coils), "axes": list(self.axes),
            "unit": "N", "units": [unit_of(axis) for axis in self.axes],
            **{name: getattr(self, name).tolist() for name in ARRAYS},
        }


ARRAYS = "full_scale", "error", "rest", "gain", "mix", "low", "high", "powers", "coefficients"
"""The arrays of a document, in its order."""


@checked_arguments
def map_of(document: Mapping[str, Any] | str | Path) -> InverseMap:
    """The map of a calibration.json: its path, or what it holds (also as part of the whole document). Raises ValueError
    for what is no such document, and for one of an earlier version, whose maps had other forms.
    """
    if not isinstance(document, Mapping):
        try:
            document = json.loads(Path(document).read_text(encoding="utf-8"))
        except RecursionError as error:
            raise ValueError("not a map from readings to forces: the JSON document is nested too deeply") from error
    try:
        known = cast(Mapping[str, Any], document).get("map", document)
        if "numerator" in known and "coefficients" not in known:
            raise ValueError("a map of an earlier version, in a form that is no longer read: calibrate again with the "
                             "same table")
        arrays: dict[str, Any] = {name: np.asarray(known[name], dtype=float) for name in ARRAYS}
        arrays["powers"] = np.asarray(known["powers"], dtype=np.int64).reshape(-1, len(known["axes"]))
        words: dict[str, Any] = {name: str(known[name]) for name in ("sensor", "revision")}
        words |= {name: tuple(known[name]) for name in ("coils", "axes")}
        return InverseMap(**words, **arrays)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"no map from readings to forces: {error} is missing or wrong") from error


def changes(readings: Array, rest: Array, gain: Array) -> Array:
    """What every coil gives (n, coils): u of an `InverseMap`."""
    share = (rest - readings) / readings
    return np.asarray(np.log(np.maximum(1.0 - gain * share * (2.0 + share), LEAST)))
