"""Conductors in front of and behind a flat coil: layered half-spaces after Dodd and Deeds (J. Appl. Phys. 39, 1968).

The coil's current is resolved into waves exp(i k . r). A stack of plates reflects each with a factor that depends on k,
frequency, conductivity and permeability; what comes back changes inductance and resistance. Plates are endless.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.bessel import j0, j1
from sitscad.physics.constants import MU0
from sitscad.physics.filaments import PolylineTrack
from sitscad.physics.mean_distance import gauss
from sitscad.physics.spirals import SpiralLayer

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Plate:
    """One layer of a reflector: conductivity (S/m), relative permeability, thickness in metres (inf: a half-space)."""

    conductivity: float
    permeability: float = 1.0
    thickness: float = math.inf


@dataclass(frozen=True)
class Reflector:
    """Plates in the order met from the coil, and the distance (m) of the first face from the plane z = 0."""

    distance: float
    plates: tuple[Plate, ...]


@dataclass(frozen=True, eq=False)
class CurrentSpectrum:
    """What reflection needs of a coil: wave numbers (1/m), weights, heights (m) and power spectra of its layers.

    `power[n, i, j]` is the mean over directions of the product of layers i and j, scaled so that the mutual inductance
    is mu0 pi times the weighted sum of power times exp(-k distance).
    """

    wave_numbers: Array
    weights: Array
    heights: Array
    power: Array


def reflection(wave_numbers: Array, frequency: float, plates: Sequence[Plate]) -> ComplexArray:
    """Reflection factor of a stack of plates for each wave number (1/m): -1 for a perfect conductor, 0 for nothing.

    Transmission-line recursion of the surface admittance alpha / mu_r with alpha^2 = k^2 + i omega mu sigma, from the
    last plate (vacuum behind it unless it is a half-space) to the first.
    """
    k = np.asarray(wave_numbers, dtype=float)
    admittance = k.astype(complex)
    for plate in reversed(plates):
        alpha = np.sqrt(k * k + 2j * math.pi * frequency * MU0 * plate.permeability * plate.conductivity)
        own = alpha / plate.permeability
        if math.isinf(plate.thickness):
            admittance = own
            continue
        decay = np.exp(-2.0 * alpha * plate.thickness)
        tanh = (1.0 - decay) / (1.0 + decay)
        admittance = own * (admittance + own * tanh) / (own + admittance * tanh)
    return (k - admittance) / (k + admittance)


def reflected_impedance(
    spectrum: CurrentSpectrum, frequency: float, above: Reflector | None, below: Reflector | None
) -> tuple[float, float]:
    """Change of inductance (H) and of resistance (ohm) by reflectors above (z > 0) and below (z < 0), both acting.

    Distances count from z = 0 outwards; the multiple reflection between the two is summed exactly.
    """
    change = complex(reflected_inductances(spectrum, frequency, above, below, (0.0,))[0])
    return change.real, -2.0 * math.pi * frequency * change.imag


def reflected_inductances(
    spectrum: CurrentSpectrum,
    frequency: float,
    above: Reflector | None,
    below: Reflector | None,
    distances: Sequence[float],
) -> ComplexArray:
    """What the reflectors add to the mutual inductance (H, complex) of two alike coils side by side.

    One value for each distance (m) of their centres, 0 for the coil itself; the imaginary part times -omega is a
    resistance. J0 (k d) is the mean over directions of the shift, exact for round coils.
    """
    k, z = spectrum.wave_numbers, spectrum.heights
    nothing = np.zeros_like(k, dtype=complex)
    top = nothing if above is None else reflection(k, frequency, above.plates)
    bottom = nothing if below is None else reflection(k, frequency, below.plates)
    roof = above.distance if above is not None else float(z.max()) + 1.0
    floor = -below.distance if below is not None else float(z.min()) - 1.0
    up = np.exp(-k[:, None] * (roof - z))
    down = np.exp(-k[:, None] * (z - floor))
    through = np.exp(-2.0 * k * (roof - floor))
    around = (top * bottom * through)[:, None, None]
    # Both there-and-back terms with their exponents joined: apart, one of them overflows for far layers
    apart, gap = np.abs(z[:, None] - z[None, :]), 2.0 * (roof - floor)
    echo = np.exp(-k[:, None, None] * (gap + apart)) + np.exp(-k[:, None, None] * (gap - apart))
    returned = top[:, None, None] * up[:, :, None] * up[:, None, :]
    returned = returned + bottom[:, None, None] * down[:, :, None] * down[:, None, :]
    returned = (returned + (top * bottom)[:, None, None] * echo) / (1.0 - around)
    waves = spectrum.weights * (spectrum.power * returned).sum(axis=(1, 2))
    shift = np.array([j0(k * distance) for distance in distances])
    return np.asarray(MU0 * math.pi * (shift @ waves))


def spiral_spectrum(layers: Sequence[SpiralLayer], nearest: float, count: int = 128) -> CurrentSpectrum:
    """Spectrum of coaxial spiral layers, for reflectors no nearer than `nearest` (m) to any layer's mid-plane.

    The average of a spiral over directions is a current sheet from its inner to its outer radius, exactly:
    S(k) = 1/p times the integral of r J1(k r) dr; the track's width enters as sinc(k w / 2).
    """
    outer = max(layer.radius for layer in layers)
    k, weights = _wave_numbers(outer, nearest, count)
    values = np.empty((k.size, len(layers)))
    for i, layer in enumerate(layers):
        low = layer.inner_radius
        nodes, share = gauss(16 if k[-1] * (layer.radius - low) < 30.0 else 40)
        half = 0.5 * (layer.radius - low)
        r = low + half * (1.0 + nodes)
        sheet = (j1(k[:, None] * r) * (r * share)).sum(axis=1) * half / layer.pitch
        values[:, i] = layer.circulation * sheet * np.sinc(k * layer.width / (2.0 * math.pi))
    return CurrentSpectrum(k, weights, np.array([layer.z for layer in layers]), values[:, :, None] * values[:, None, :])


def polyline_spectrum(
    tracks: Sequence[PolylineTrack], nearest: float, count: int = 64, directions: int = 32
) -> CurrentSpectrum:
    """The same for tracks along straight sides (every layer of a polygonal coil), by their closed Fourier transforms.

    Only the part of the current across the wave's direction is reflected. Layers after the first are taken to lie
    exactly over it, which changes the answer by less than the turns' pitch over the distance.
    """
    corners = tracks[0].corners - 0.5 * (tracks[0].corners.min(axis=0) + tracks[0].corners.max(axis=0))
    k, weights = _wave_numbers(float(np.abs(corners).max()), nearest, count)
    angle = math.pi * (np.arange(directions) + 0.5) / directions
    along, across = np.cos(angle), np.sin(angle)
    sides, middles = np.diff(corners, axis=0), 0.5 * (corners[1:] + corners[:-1])
    crosswise = sides[:, 1][:, None] * along - sides[:, 0][:, None] * across
    stretch = sides[:, 0][:, None] * along + sides[:, 1][:, None] * across
    place = middles[:, 0][:, None] * along + middles[:, 1][:, None] * across
    power = np.empty(k.size)
    for n, number in enumerate(k):
        wave = crosswise * np.sinc(number * stretch / (2.0 * math.pi)) * np.exp(-1j * number * place)
        power[n] = np.mean(np.abs(wave.sum(axis=0)) ** 2) / (4.0 * math.pi**2)
    power *= np.sinc(k * tracks[0].width / (2.0 * math.pi)) ** 2
    layers = len(tracks)
    return CurrentSpectrum(
        k, weights, np.array([t.z for t in tracks]), np.tile(power[:, None, None], (1, layers, layers))
    )


def distance_derivative(spectrum: CurrentSpectrum, heights: Sequence[float]) -> Array:
    """Change of the mutual inductance of every two alike layers with their distance (H/m), 0 on the diagonal.

    dM/dh = -mu0 pi times the sum of k S^2 exp(-k h) for layers at `heights` (m) whose currents circulate alike; S is
    that of the spectrum's first layer, its `nearest` no more than the least of the distances.
    """
    k, z = spectrum.wave_numbers, np.asarray(heights, dtype=np.float64)
    distance = np.abs(z[:, None] - z[None, :])
    share = spectrum.weights * spectrum.power[:, 0, 0] * k
    slope = -MU0 * math.pi * np.tensordot(share, np.exp(-k[:, None, None] * distance), axes=1)
    return np.asarray(slope * (1.0 - np.eye(z.size)), dtype=np.float64)


def _wave_numbers(outer: float, nearest: float, count: int) -> tuple[Array, Array]:
    # k = top t^2: dense where the coil's own size lies, up to where exp(-2 k nearest) has died out.
    top = 11.0 / max(nearest, 1e-3 * outer)
    nodes, share = gauss(16)
    panels = max(1, round(count / 16))
    t = ((np.arange(panels)[:, None] + 0.5 * (1.0 + nodes)) / panels).ravel()
    return top * t * t, top * t * np.tile(share, panels) / panels
