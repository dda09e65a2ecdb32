"""Conductors in front of and behind a flat coil: layered half-spaces (Dodd and Deeds, J. Appl. Phys. 39, 1968).

The coil's current is written as a sum of waves exp(i k . r). A stack of infinite plates reflects each wave by a factor
that depends on k, frequency, conductivity and permeability. The reflected waves change inductance and resistance.
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
    """One plate of a reflector: conductivity (S/m), relative permeability, thickness (m; inf for a half-space)."""

    conductivity: float
    permeability: float = 1.0
    thickness: float = math.inf


@record
class Reflector:
    """Infinite plates on one side of a coil.

    `distance` (m) is from the plane z = 0 to the first face. `plates` are in order from the coil.
    """

    distance: float
    plates: tuple[MetalLayer, ...]


def reflection(wave_numbers: Array, frequency: float | Array, plates: Sequence[MetalLayer]) -> ComplexArray:
    """Return the reflection factor (no unit) of a stack of plates: -1 for a perfect conductor, 0 for no plate.

    Parameters
    ----------
    wave_numbers : array
        wave numbers (1/m)
    frequency : float or array
        a frequency (Hz), or an array (n, 1) of frequencies
    plates : sequence of MetalLayer
        plates, nearest to the coil first

    Returns
    -------
    complex array
        (wave numbers,) or (n, wave numbers). The array is read-only.

    Notes
    -----
    Transmission-line recursion of the surface admittance alpha / mu_r with alpha^2 = k^2 + i omega mu sigma (Dodd and
    Deeds 1968 for two layers; any number derived here from the same continuity). It runs from the last plate to the
    first. Behind the last plate is vacuum, unless the plate is a half-space. A plate with a thickness above `OPAQUE`
    decay lengths counts as a half-space.
    """
    k, at = np.asarray(wave_numbers, dtype=float), np.asarray(frequency, dtype=float)
    solve = _reflection if k.size * at.size <= MAX_CACHED_FACTORS else _reflection.__wrapped__
    return solve(k.tobytes(), k.shape, at.tobytes(), at.shape, tuple(plates))


MAX_CACHED_FACTORS = 1 << 13
"""Largest number of reflection factors in a result that is cached.

States, tanks and poses need equal results repeatedly.
"""


OPAQUE = 18.0
"""Thickness of a plate, divided by the decay length, above which layers behind it have no effect.

exp(-2 x 18) is below a rounding error.
"""


@lru_cache(maxsize=64)
def _reflection(
    wave_numbers: bytes, row: tuple[int, ...], frequencies: bytes, shape: tuple[int, ...],
    plates: tuple[MetalLayer, ...],
) -> ComplexArray:
    """Return the reflection factor (no unit) of a stack of plates, from the bytes and shapes of the arrays.

    Equal arguments are cached.
    """
    k, frequency = np.frombuffer(wave_numbers).reshape(row), np.frombuffer(frequencies).reshape(shape)
    # From the farthest plate to the nearest, each like a transmission line with a load. Exponentials of the decay
    # replace hyperbolic functions, which overflow in thick plates.
    admittance = k.astype(complex)
    for plate in reversed(plates):
        alpha = np.sqrt(k * k + 2j * math.pi * frequency * MU0 * plate.permeability * plate.conductivity)
        bulk = alpha / plate.permeability
        if math.isinf(plate.thickness) or (alpha.size and float(alpha.real.min()) * plate.thickness > OPAQUE):
            admittance = bulk
            continue
        decay = np.exp(-2.0 * alpha * plate.thickness)
        tanh = (1.0 - decay) / (1.0 + decay)
        admittance = bulk * (admittance + bulk * tanh) / (bulk + admittance * tanh)
    factor = np.asarray((k - admittance) / (k + admittance))
    factor.setflags(write=False)
    return factor


def reflection_coefficients(
    wave_numbers: Array, frequencies: Array, above: Reflector | None, below: Reflector | None,
    levels: tuple[float, float], raised: Array | float = 0.0
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return the reflection coefficients (no unit) of every wave at every frequency, with plates on both sides.

    Parameters
    ----------
    wave_numbers : array
        wave numbers (1/m)
    frequencies : array
        frequencies (Hz)
    above, below : Reflector or None
        reflectors on both sides, if any
    levels : tuple[float, float]
        lowest and highest height of the current (m)
    raised : array or float, optional
        extra distance of the upper reflector (m); at one frequency also an array (n, 1)

    Returns
    -------
    three complex arrays
        coefficients (frequencies, wave numbers) from up to up waves, from up to down waves, and from down to down waves

    Notes
    -----
    An up wave decays as exp(-k (highest - z)), a down wave as exp(-k (z - lowest)). Multiple reflections between both
    sides form a geometric series, which is summed exactly (derived here). With an array `raised`, results are (n, wave
    numbers).
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
    # geometric series of the repeated reflections between both sides
    again = 1.0 / (1.0 - top * bottom * (to_roof * to_floor * across) ** 2)
    twice = top * bottom * (to_roof * to_floor) ** 2 * across
    return top * to_roof**2 * again, twice * again, bottom * to_floor**2 * again


def reflected_inductances(
    spectrum: CurrentSpectrum, frequencies: Array, above: Reflector | None, below: Reflector | None,
    distances: Sequence[float]
) -> ComplexArray:
    """Return the reflectors' contribution to the mutual inductance of two equal coils side by side.

    Parameters
    ----------
    spectrum : CurrentSpectrum
        current spectrum of the coil
    frequencies : array
        frequencies (Hz)
    above, below : Reflector or None
        reflectors on both sides, if any
    distances : sequence of float
        distances of the coils' centres (m); 0 for the self-inductance of one coil

    Returns
    -------
    complex array
        (frequencies, distances), in H. The imaginary part times -omega is a resistance

    Notes
    -----
    The inductance is mu0 pi times the weighted sum of power times the reflected waves (Dodd and Deeds 1968). J0(k d) is
    the mean over directions of a wave shifted by d, which is exact for round coils.
    """
    key = frequencies.tobytes(), above, below, tuple(distances)
    if key not in spectrum.returned:
        waves = spectrum.weights * _reflected_power(spectrum, frequencies, above, below)
        shift = np.array([spectrum.shift(distance) for distance in distances])
        spectrum.returned[key] = np.asarray(MU0 * math.pi * (waves @ shift.T))
    return spectrum.returned[key].copy()


def raised_inductances(
    spectrum: CurrentSpectrum, frequency: float, above: Reflector, below: Reflector | None, raised: Array
) -> ComplexArray:
    """Return the reflectors' contribution (n; H, complex) to a coil's inductance, for several upper distances.

    `above` and `below` are the reflectors on both sides, the `frequency` is in Hz. The upper reflector is farther away
    by each of the lengths `raised` (n; m). See `reflected_inductances`.
    """
    power = _reflected_power(spectrum, np.array([frequency]), above, below, raised[:, None])
    return np.asarray(MU0 * math.pi * (power @ spectrum.weights))


def _reflected_power(
    spectrum: CurrentSpectrum, frequencies: Array, above: Reflector | None, below: Reflector | None,
    raised: Array | float = 0.0
) -> ComplexArray:
    """Return the power (frequencies, wave numbers; m2, complex) of a coil's waves, multiplied by their reflection.

    `raised` (m) is the extra distance of the upper reflector (see `reflection_coefficients`).
    """
    (up, cross, down), z = spectrum.sums, spectrum.heights
    levels = float(z.min()), float(z.max())
    up_to_up, mixed, down_to_down = reflection_coefficients(spectrum.wave_numbers, frequencies, above, below, levels,
                                                            raised)
    return np.asarray(up_to_up * up + 2.0 * mixed * cross + down_to_down * down)


def distance_derivative(spectrum: CurrentSpectrum, heights: Sequence[float]) -> Array:
    """Return the derivative of the mutual inductance of every two layers by their distance (layers, layers; H/m).

    The diagonal is 0.

    Parameters
    ----------
    spectrum : CurrentSpectrum
            spectrum of the layers, or of a single layer if all are equal. It must resolve the least distance of layers,
        or a small part of the winding's radial width.
    heights : sequence of float
        heights of the layers (m). All currents circulate in one direction.

    Notes
    -----
    M is mu0 pi times the sum of S_i S_j exp(-k h) (`CurrentSpectrum`). So dM/dh is -mu0 pi times the sum of k S_i S_j
    exp(-k h).
    """
    k, z = spectrum.wave_numbers, np.asarray(heights, dtype=np.float64)
    distance = np.abs(z[:, None] - z[None, :])
    share = (spectrum.weights * k)[:, None, None] * spectrum.power
    slope = -MU0 * math.pi * np.sum(share * np.exp(-k[:, None, None] * distance), axis=0)
    return np.asarray(slope * (1.0 - np.eye(z.size)), dtype=np.float64)
