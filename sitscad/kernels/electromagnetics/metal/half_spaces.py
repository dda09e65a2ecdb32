"""Conductors in front of and behind a flat coil: layered half-spaces after Dodd and Deeds (J. Appl. Phys. 39, 1968).

The coil's current is resolved into waves exp(i k . r). A stack of plates reflects each with a factor that depends on k,
frequency, conductivity and permeability; what comes back changes inductance and resistance. Plates are endless.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.metal.current_spectrum import CurrentSpectrum


@record
class MetalLayer:
    """One layer of a reflector: conductivity (S/m), relative permeability, thickness in metres (inf: a half-space)."""

    conductivity: float
    permeability: float = 1.0
    thickness: float = math.inf


@record
class Reflector:
    """Plates in the order met from the coil, and the distance (m) of the first face from the plane z = 0."""

    distance: float
    plates: tuple[MetalLayer, ...]


def reflection(wave_numbers: Array, frequency: float | Array, plates: Sequence[MetalLayer]) -> ComplexArray:
    """Reflection factor of a stack of plates for each wave number (1/m): -1 for a perfect conductor, 0 for nothing, no
    unit. At one frequency (Hz), or at (n, 1) of them and then (n, wave numbers). Transmission-line recursion of the
    surface admittance alpha / mu_r with alpha^2 = k^2 + i omega mu sigma (Dodd and Deeds 1968, for two layers; any
    number derived here from the same continuity), from the last plate (vacuum behind it unless it is a half-space) to
    the first; a plate of `OPAQUE` depths or more is a half-space. The result cannot be written to.
    """
    k, at = np.asarray(wave_numbers, dtype=float), np.asarray(frequency, dtype=float)
    solve = _reflection if k.size * at.size <= KEPT else _reflection.__wrapped__
    return solve(k.tobytes(), k.shape, at.tobytes(), at.shape, tuple(plates))


KEPT = 1 << 13
"""Factors of one stack up to which they are kept: states, tanks and poses ask again and again for one metal's."""


OPAQUE = 18.0
"""Decay lengths of a plate beyond which nothing behind it is seen: exp(-2 x 18) is less than a rounding error."""


@lru_cache(maxsize=64)
def _reflection(
    wave_numbers: bytes, row: tuple[int, ...], frequencies: bytes, shape: tuple[int, ...],
    plates: tuple[MetalLayer, ...],
) -> ComplexArray:
    """`reflection` (no unit) of the numbers of arrays and their shapes."""
    k, frequency = np.frombuffer(wave_numbers).reshape(row), np.frombuffer(frequencies).reshape(shape)
    # From the farthest plate to the nearest, each before what lies behind it like a line before its load; by decays and
    # not by hyperbolic functions, which overflow in thick plates.
    admittance = k.astype(complex)
    for plate in reversed(plates):
        alpha = np.sqrt(k * k + 2j * math.pi * frequency * MU0 * plate.permeability * plate.conductivity)
        own = alpha / plate.permeability
        if math.isinf(plate.thickness) or (alpha.size and float(alpha.real.min()) * plate.thickness > OPAQUE):
            admittance = own
            continue
        decay = np.exp(-2.0 * alpha * plate.thickness)
        tanh = (1.0 - decay) / (1.0 + decay)
        admittance = own * (admittance + own * tanh) / (own + admittance * tanh)
    found = np.asarray((k - admittance) / (k + admittance))
    found.setflags(write=False)
    return found


def returned_waves(
    wave_numbers: Array, frequencies: Array, above: Reflector | None, below: Reflector | None,
    levels: tuple[float, float], raised: Array | float = 0.0
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """What comes back of every wave (1/m) at every frequency (Hz), with the multiple reflection between both sides
    summed exactly (a geometric series, derived here): (frequencies, wave numbers), no unit. `levels` (m) are the lowest
    and the highest height of the current. A wave that decays as exp(-k (highest - z)), or as exp(-k (z - lowest)), is
    reflected into such ones: coefficients up to up, up to down, and down to down. What is above may be farther by
    `raised` (m), or at one frequency by each of (n, 1) and then (n, wave numbers).
    """
    k, (low, high) = wave_numbers, levels
    top, bottom = (
        np.zeros((frequencies.size, k.size), dtype=complex)
        if side is None
        else reflection(k, frequencies[:, None], side.plates)
        for side in (above, below)
    )
    to_roof = np.exp(-k * ((above.distance if above is not None else high + 1.0) - high + raised))
    to_floor = np.exp(-k * (low + (below.distance if below is not None else 1.0 - low)))
    across = np.exp(-k * (high - low))
    # the geometric series of what goes to and fro between both sides
    again = 1.0 / (1.0 - top * bottom * (to_roof * to_floor * across) ** 2)
    twice = top * bottom * (to_roof * to_floor) ** 2 * across
    return top * to_roof**2 * again, twice * again, bottom * to_floor**2 * again


def reflected_impedance(
    spectrum: CurrentSpectrum, frequency: float, above: Reflector | None, below: Reflector | None
) -> tuple[float, float]:
    """Change of inductance (H) and of resistance (ohm) at a frequency (Hz) by reflectors above (z > 0) and below (z <
    0), both acting: see `reflected_inductances`. Distances count from z = 0 outwards.
    """
    change = complex(reflected_inductances(spectrum, np.array([frequency]), above, below, (0.0,))[0, 0])
    return change.real, -2.0 * math.pi * frequency * change.imag


def reflected_inductances(
    spectrum: CurrentSpectrum, frequencies: Array, above: Reflector | None, below: Reflector | None,
    distances: Sequence[float]
) -> ComplexArray:
    """What the reflectors add to the mutual inductance (frequencies, distances; H, complex) of two alike coils side by
    side: mu0 pi times the weighted sum of power times the waves returned (Dodd and Deeds 1968). One value for each
    frequency (Hz) and distance (m) of their centres, 0 for the coil itself; the imaginary part times -omega is a
    resistance. J0 (k d) is the mean over directions of the shift, exact for round coils.
    """
    key = frequencies.tobytes(), above, below, tuple(distances)
    if key not in spectrum.returned:
        waves = spectrum.weights * _returned_power(spectrum, frequencies, above, below)
        shift = np.array([spectrum.shift(distance) for distance in distances])
        spectrum.returned[key] = np.asarray(MU0 * math.pi * (waves @ shift.T))
    return spectrum.returned[key].copy()


def raised_inductances(
    spectrum: CurrentSpectrum, frequency: float, above: Reflector, below: Reflector | None, raised: Array
) -> ComplexArray:
    """What the reflectors add to a coil's inductance (n,; H, complex) at a frequency (Hz), that above being farther by
    each of (n,) lengths (m): as `reflected_inductances`.
    """
    power = _returned_power(spectrum, np.array([frequency]), above, below, raised[:, None])
    return np.asarray(MU0 * math.pi * (power @ spectrum.weights))


def _returned_power(
    spectrum: CurrentSpectrum, frequencies: Array, above: Reflector | None, below: Reflector | None,
    raised: Array | float = 0.0
) -> ComplexArray:
    """Power (frequencies, wave numbers; m2, complex) of a coil's waves with what comes back of them
    (`returned_waves`).
    """
    (up, cross, down), z = spectrum.sums, spectrum.heights
    levels = float(z.min()), float(z.max())
    both, mixed, other = returned_waves(spectrum.wave_numbers, frequencies, above, below, levels, raised)
    return np.asarray(both * up + 2.0 * mixed * cross + other * down)


def distance_derivative(spectrum: CurrentSpectrum, heights: Sequence[float]) -> Array:
    """Change of the mutual inductance of every two layers with their distance (layers, layers; H/m), 0 on the diagonal.
    The slope of mu0 pi times the sum of S_i S_j exp(-k h) (`CurrentSpectrum`): dM/dh = -mu0 pi times the sum of k S_i
    S_j exp(-k h) for layers at `heights` (m) whose currents circulate alike; S are those of the spectrum's layers, or
    of its only one where all are alike, its `nearest` no more than the least of the distances, or a small part of the
    winding's radial width.
    """
    k, z = spectrum.wave_numbers, np.asarray(heights, dtype=np.float64)
    distance = np.abs(z[:, None] - z[None, :])
    share = (spectrum.weights * k)[:, None, None] * spectrum.power
    slope = -MU0 * math.pi * np.sum(share * np.exp(-k[:, None, None] * distance), axis=0)
    return np.asarray(slope * (1.0 - np.eye(z.size)), dtype=np.float64)
