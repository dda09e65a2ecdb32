"""Maps from readings to forces: functions of arrays, stored as JSON documents."""

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
from sitscad.estimates.performance.compensation import DriftCoefficients
from sitscad.estimates.performance_values import load_unit
from sitscad.kernels.electromagnetics.polynomials import Exponents, monomials

LEAST = 1e-6  # Least ratio of a target's change of L to the change at rest, for its logarithm
"""Least value of 1 - gain s in the logarithm of a map's input u (see `InverseMap`)."""
BEYOND = 0.1  # Allowed distance of a reading from the map's range (full scales)
"""Distance (full scales) beyond the map's range up to which readings are used unchanged."""


@record(eq=False)
class InverseMap:
    """A map from readings to forces (N), and to moments (N m) if some of its axes are moments.

    `low` and `high` are the range of v that the map was made for. Values of v beyond it by more than `BEYOND` are
    limited, because the terms grow to thousands of full scales there. `error` (N) is the error of forces by axis, rms
    over the loads. For a map of the drawn sensor it is one standard deviation over sensors. For a map of a measured
    sensor, 95 % of sensors stay below it. `rest` are the expected counts at rest. `drifts` are the coefficients of the
    compensation by temperature; None if nothing measures the temperature.

    Notes
    -----
    n0 is the tare (counts or frequencies at rest), n a reading, and s = (n0/n)^2 - 1 = L/L(rest) - 1. Every coil gives
    u = ln(1 - gain s). v = `mix` u is approximately the force on every axis over its full scale. The force is
    full_scale x coefficients . terms, with products of v to the `powers` as terms. Without a change of readings, the
    force is zero.
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
    drifts: DriftCoefficients | None = None

    @property
    def form(self) -> str:
        """Text of the map's form."""
        return f"polynomial of degree {int(self.powers.sum(axis=1).max())} in ln(1 - gain (L/L0 - 1))"

    def mixed(self, readings: Array, tare: Array) -> Array:
        """Return v (n, axes), the approximate force over full scale, from readings (n, coils) and a tare."""
        return np.asarray(map_inputs(readings, tare, self.gain) @ self.mix.T)

    def __repr__(self) -> str:
        """Return a line with the sensor, the coils and the full scale of each axis."""
        axes = (f"{name} to {full:.3g} N" for name, full in zip(self.axes, self.full_scale, strict=True))
        return f"<InverseMap of {self.sensor}: {', '.join(self.coils)} to {', '.join(axes)}>"

    def __call__(self, readings: ArrayLike, tare: ArrayLike) -> Array:
        """Return forces (n, axes; N) from readings (n, coils) and a tare (coils), both counts or both frequencies.

        Readings beyond the map's range (`holds`) give the force at the end of the range. Raises ValueError for other
        shapes, and for readings that are not positive.
        """
        return self.forces_at(np.clip(self.checked(readings, tare), self.low - BEYOND, self.high + BEYOND))

    def compensated(self, readings: ArrayLike, tare: ArrayLike, kelvin: float) -> Array:
        """Return forces (n, axes; N) without the drift by `kelvin` (K), the temperature change since the tare.

        `readings` (n, coils) and `tare` (coils) are both counts or both frequencies. The drift depends on the force, so
        it is computed several times, each time with the improved force. Raises ValueError if the map has no
        coefficients of drift, or if the change is beyond their range.
        """
        drifts = self.drifts
        if drifts is None:
            raise ValueError("the map has no coefficients of drift: its spec has no readout.compensation")
        if not abs(kelvin) <= drifts.largest_change:
            raise ValueError(f"{kelvin:.3g} K since the tare: forces are compensated up to "
                             f"{drifts.largest_change:.3g} K, and not beyond")
        values, forces = np.atleast_2d(np.asarray(readings, dtype=float)), self(readings, tare)
        for _ in range(COMPENSATION_PASSES):
            share = np.clip(forces[:, [self.axes.index("normal")]] / drifts.load, 0.0, 1.0)
            drift = drifts.at_rest + share * (drifts.loaded - drifts.at_rest)
            forces = self(values * (1.0 - kelvin * drift), tare) * (1.0 + drifts.stiffening * kelvin)
        return forces

    @property
    def end(self) -> float:
        """Largest normal force (N), without other forces, that the map can give."""
        ends = np.where(np.arange(len(self.high)) == 0, self.high + BEYOND, 0.0)
        return float(self.forces_at(ends[None])[0, 0])

    def checked(self, readings: ArrayLike, tare: ArrayLike) -> Array:
        """Return `mixed` of readings and a tare. Raises ValueError if a map cannot take them."""
        values, rest = np.atleast_2d(np.asarray(readings, dtype=float)), np.asarray(tare, dtype=float)
        if values.shape[1:] != (len(self.coils),) or rest.shape != (len(self.coils),):
            raise ValueError(f"readings of {len(self.coils)} coils, and one tare for each, are wanted")
        if not (np.all(values > 0.0) and np.all(rest > 0.0)):
            raise ValueError("readings and tare are positive numbers")
        return self.mixed(values, rest)

    def forces_at(self, mixed: Array) -> Array:
        """Return forces (n, axes; N) from the map's inputs (n, axes), which `mixed` computes from readings.

        The inputs are not clipped to the range of the map.
        """
        return np.asarray(self.full_scale * (monomials(mixed, self.powers) @ self.coefficients.T))

    def holds(self, readings: ArrayLike, tare: ArrayLike) -> Flags:
        """Return flags (n,): whether readings (n, coils) lie within the map's range."""
        mixed = self.checked(readings, tare)
        return np.all((mixed >= self.low - BEYOND) & (mixed <= self.high + BEYOND), axis=1)

    def document(self) -> dict[str, Any]:
        """Return the map as plain values for JSON, which `map_of` reads."""
        return {
            "sensor": self.sensor, "revision": self.revision, "coils": list(self.coils), "axes": list(self.axes),
            "unit": "N", "units": [load_unit(axis) for axis in self.axes],
            **{name: getattr(self, name).tolist() for name in ARRAYS},
            **({} if self.drifts is None else {"drift": self.drifts.document()}),
        }


COMPENSATION_PASSES = 3
"""Number of passes of `InverseMap.compensated`, and of the C function. The error of the drift is then negligible."""

ARRAYS = "full_scale", "error", "rest", "gain", "mix", "low", "high", "powers", "coefficients"
"""Names of the arrays in a map's document, in its order."""


@checked_arguments
def map_of(document: Mapping[str, Any] | str | Path) -> InverseMap:
    """Return the map of a calibration.json.

    Parameters
    ----------
    document
        Path of the file, or its content, or the part of the content that describes the map.

    Returns
    -------
    InverseMap
        A function of counts and tare counts that returns forces (N).

    Raises
    ------
    ValueError
        if it is no such document, or is of an earlier version with another form of map
    OSError
        if the file cannot be read
    """
    if not isinstance(document, Mapping):
        try:
            document = json.loads(Path(document).read_text(encoding="utf-8"))
        except RecursionError as error:
            raise ValueError("not a map from readings to forces: the JSON document is nested too deeply") from error
    try:
        entries = cast(Mapping[str, Any], document).get("map", document)
        if "numerator" in entries and "coefficients" not in entries:
            raise ValueError("a map of an earlier version, in a form that is no longer read: calibrate again with the "
                             "same table")
        arrays: dict[str, Any] = {name: np.asarray(entries[name], dtype=float) for name in ARRAYS}
        arrays["powers"] = np.asarray(entries["powers"], dtype=np.int64).reshape(-1, len(entries["axes"]))
        texts: dict[str, Any] = {name: str(entries[name]) for name in ("sensor", "revision")}
        texts |= {name: tuple(entries[name]) for name in ("coils", "axes")}
        return InverseMap(**texts, **arrays, drifts=_drifts_from_document(entries.get("drift")))
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"no map from readings to forces: {error} is missing or wrong") from error


def _drifts_from_document(values: Mapping[str, Any] | None) -> DriftCoefficients | None:
    """Return the coefficients of drift in a map's document. None if it has none."""
    if values is None:
        return None
    at_rest, loaded = (np.asarray(values[name], dtype=float) for name in ("at_rest", "loaded"))
    load, stiffening, warming = (float(values[name]) for name in ("load_N", "stiffening", "warming_K"))
    calibrated = values["calibrated_degC"]
    return DriftCoefficients(at_rest, loaded, load, stiffening, warming, values["reference"],
                             calibrated=None if calibrated is None else (calibrated[0], calibrated[1]))


def map_inputs(readings: Array, rest: Array, gain: Array) -> Array:
    """Return the inputs u of an `InverseMap` for each coil (n, coils): u = ln(1 - gain s), s = (rest/reading)^2 - 1."""
    share = (rest - readings) / readings
    return np.asarray(np.log(np.maximum(1.0 - gain * share * (2.0 + share), LEAST)))
