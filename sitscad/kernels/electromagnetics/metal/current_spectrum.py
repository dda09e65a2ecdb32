"""A flat coil's current as a sum of waves exp(i k . r), which conductors on both sides of the coil reflect.

Rings follow Dodd and Deeds (J. Appl. Phys. 39, 1968). A spiral's harmonics about its axis are integrals over the radius
with closed integrands. Polygons are in `polyline_spectrum`.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import field
from functools import cached_property

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.inductance.rings import mean_rings
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.special_functions import bessel_orders, gauss, j0, j1

LEAST_HARMONICS, MOST_HARMONICS = 3, 8
"""Smallest and largest value of a spiral's highest harmonic about its axis.

Values above the smallest are used only for metal nearer than some pitches.
"""


AT_ONCE = 100_000
"""Number of pairs of waves and radii processed together. A single block of all waves took a gigabyte near metal."""


@record(eq=False)
class CurrentSpectrum:
    """Spectrum of a coil's current over wave vectors in the plane, from which the effect of reflectors follows.

    `wave_numbers` and `weights` (k; 1/m) are nodes and weights of the integral over wave numbers. `heights` (layers; m)
    are the mid-planes. `power[n, i, j]` (k, layers, layers; m2) is the mean, over directions, of the product of the
    waves of layers i and j. The mutual inductance of two layers is mu0 pi times the weighted sum of power times exp(-k
    d), with the distance d of their mid-planes (Dodd and Deeds 1968, for rings). `shifts` caches the results of
    `shift`.
    """

    wave_numbers: Array
    weights: Array
    heights: Array
    power: Array
    shifts: dict[float, Array] = field(default_factory=dict)
    returned: dict[Hashable, ComplexArray] = field(default_factory=dict)
    """Cache of reflected inductances (see `half_spaces.reflected_inductances`)."""

    def shift(self, distance: float) -> Array:
        """Return J0(k d) (k; no unit): the mean over directions of waves shifted by a `distance` d (m).

        There is one value for each wave number k. The result is cached. Bessel's integral (Abramowitz and Stegun
        9.1.18).
        """
        if distance not in self.shifts:
            self.shifts[distance] = j0(self.wave_numbers * distance)
        return self.shifts[distance]

    @cached_property
    def sums(self) -> tuple[Array, Array, Array]:
        """Power (k; m2) of all layers together, as three sums over pairs of layers.

        The first sum is for products of two waves exp(-k (highest - z)), the last for products of two waves exp(-k (z -
        lowest)). The middle sum is for products of one wave of each kind.
        """
        k, z, power = self.wave_numbers[:, None], self.heights, self.power
        up, down = np.exp(-k * (float(z.max()) - z)), np.exp(-k * (z - float(z.min())))
        up_power = np.einsum("ki,kij,kj->k", up, power, up)
        cross = np.einsum("ki,kij,kj->k", up, power, down)
        two = np.einsum("ki,kij,kj->k", down, power, down)
        return up_power, cross, two


def wave_numbers(outer: float, nearest: float, is_rough: bool = False) -> tuple[Array, Array]:
    """Return nodes and weights (n; 1/m) of the integral over the wave number k for a coil.

    Parameters
    ----------
    outer : float
        radius of the coil (m)
    nearest : float
        least distance of a reflector (m)
    is_rough : bool, optional
        whether a third of the nodes is enough, up to exp(-2 k nearest) = 2e-4

    Notes
    -----
    Gauss panels, chosen here by comparison. They end at exp(-2 k nearest) = 6e-6, and they resolve products of two
    waves of the coil's size.
    """
    top = (4.2 if is_rough else 6.0) / max(nearest, 1e-3 * outer)
    panels = 1 + math.ceil(top * outer / 18.0) if is_rough else 3 + math.ceil(top * outer / 12.0)
    nodes, share = gauss(16)
    k = top * (np.arange(panels)[:, None] + 0.5 * (1.0 + nodes)) / panels
    return k.ravel(), np.tile(0.5 * top * share, panels) / panels


def spiral_spectrum(layers: Sequence[SpiralLayer], nearest: float, harmonics: int | None = None) -> CurrentSpectrum:
    """Return the current spectrum of coaxial spiral layers, for reflectors at least `nearest` from any mid-plane.

    Parameters
    ----------
    layers : sequence of SpiralLayer
        layers of the coil
    nearest : float
        least distance of a reflector (m)
    harmonics : int or None, optional
        highest harmonic about the axis, or None to choose it from the distance

    Notes
    -----
    A spiral passes every radius once, at the angle phi(r). So harmonic m of its current is exp(-i m phi(r)) / pitch
    from the inner to the outer radius. Across the wave this gives 1/p times the integral of exp(-i m phi) r J_m'(k r)
    dr. Along the wave it gives m / (k r) J_m instead. The spiral's slope contributes to both. Harmonic 0 is the current
    sheet, the others are ends and single turns.

    The part along the wave vanishes for a closed circuit. With it, the result is the Neumann integral with the images
    of the open path, as for the inductance in free air (Sommerfeld's horizontal potential).

    The uniform current in the track's cross-section enters as a mean over it: sinc(k w / 2) across, with a correction
    for the bend, and sinh(k t / 2) / (k t / 2) through the thickness.
    """
    k, weights = wave_numbers(max(layer.radius for layer in layers), nearest)
    # The lowest harmonics hold the slope and the two ends. Harmonic m has waves from 2 pi m / pitch on.
    needed = math.ceil(0.65 * max(layer.pitch for layer in layers) / nearest)
    highest = min(MOST_HARMONICS, max(LEAST_HARMONICS, needed)) if harmonics is None else harmonics
    radii = {_size(layer): _radii(layer, float(k[-1]), highest) for layer in layers}
    twice = np.where(np.arange(highest + 1) > 0, 2.0, 1.0)
    power = np.empty((k.size, len(layers), len(layers)))
    for some in slices(k.size, AT_ONCE // max(r.size for r, _ in radii.values())):
        # layers of equal size differ by angle, sense and current direction alone
        samples = {size: _RadialSamples(r, share, *_bessel_slopes(k[some, None] * r, highest))
                 for size, (r, share) in radii.items()}
        values = np.array([_spiral_waves(layer, k[some], samples[_size(layer)]) for layer in layers])
        power[some] = np.einsum("idmk,jdmk,m->kij", values, values.conj(), twice).real
    return CurrentSpectrum(k, weights, np.array([layer.z for layer in layers]), power)


def ring_spectrum(layers: Sequence[SpiralLayer], nearest: float) -> CurrentSpectrum:
    """Return the current spectrum (m2) of layers with one ring for every turn, at the turn's mean radius.

    Reflectors are at least `nearest` (m) away. Ends and slopes of the spirals are neglected. A ring of radius r has r
    J1(k r) (Dodd and Deeds 1968).
    """
    k, weights = wave_numbers(max(layer.radius for layer in layers), nearest, True)
    waves_by_size: dict[tuple[float, ...], Array] = {}
    for layer in layers:
        if _size(layer) not in waves_by_size:
            rings = mean_rings([layer])
            across = np.sinc(k * layer.width / (2.0 * math.pi))
            waves_by_size[_size(layer)] = across * (j1(k[:, None] * rings.radii) @ (rings.parts * rings.radii))
    waves = np.array([waves_by_size[_size(layer)] * layer.circulation for layer in layers]).T
    return CurrentSpectrum(k, weights, np.array([layer.z for layer in layers]), waves[:, :, None] * waves[:, None, :])


def _size(layer: SpiralLayer) -> tuple[float, ...]:
    """Return outer radius, pitch (m) and turns of a layer.

    Layers with equal sizes differ only by angle, sense and current direction.
    """
    return layer.radius, layer.pitch, layer.turns


@record(eq=False)
class _RadialSamples:
    """Quadrature points along the radius of a spiral, and Bessel functions at each wave number and radius.

    `radii` (r; m) and `weights` (r; m) are the points. `values` are J_m(k r) and `slopes` are J_m'(k r) (m, k, r), for
    harmonics m from 0.
    """

    radii: Array
    weights: Array
    values: Array
    slopes: Array


def _radii(layer: SpiralLayer, top: float, highest: int) -> tuple[Array, Array]:
    """Return radii between a spiral's ends (r; m) that resolve waves up to `top` (1/m), and their weights (r; m).

    `highest` is the highest harmonic about the axis.
    """
    low = layer.inner_radius
    half = 0.5 * (layer.radius - low)
    nodes, share = gauss(12 + math.ceil(0.6 * (half * top + math.pi * highest * layer.turns)))
    return low + half * (1.0 + nodes), share * half


def _spiral_waves(layer: SpiralLayer, k: Array, radial_part: _RadialSamples) -> ComplexArray:
    """Return the harmonics of one layer's current across and along the waves (2, highest + 1, k; m).

    The integrals are in the notes of `spiral_spectrum`.
    """
    r, values, slopes = radial_part.radii, radial_part.values, radial_part.slopes
    angle = layer.angle + layer.sense * 2.0 * math.pi * (layer.radius - r) / layer.pitch
    m = np.arange(len(values))[:, None]
    turn = np.exp(-1j * m * angle) * (radial_part.weights / layer.pitch)
    radial = -layer.sense * layer.pitch / (2.0 * math.pi) * turn
    around, inwards = (np.einsum("mkr,mr->mk", slopes, part) for part in (turn * r, radial))
    plain, beside = (np.einsum("mkr,mr->mk", values, part) for part in (turn, radial / r))
    # The mean of cos(k x) over the width, and half the mean of x sin(k x). r J_m'(k r) is r times a wave, so its
    # mean over the width differs from a wave's mean. It obeys y'' + k^2 y = -k J_m, which gives the difference in
    # terms of J_m.
    half = 0.5 * k * layer.width
    even = np.sinc(half / math.pi)
    across, bent = np.asarray(even), np.asarray(0.5 * (even - np.cos(half)) / k)
    order = m * across / k
    waves = np.stack([1j * (around * across - plain * bent) - beside * order, 1j * inwards * across + plain * order])
    return np.asarray(layer.circulation * waves * thickness_waves(k, layer.thickness))


def thickness_waves(k: Array, thickness: float) -> Array:
    """Return the mean over a track's thickness of waves, divided by their value in the middle (k; no unit).

    The waves decay with height. `k` are wave numbers (1/m), `thickness` is in m. The mean is sinh(x) / x with x = k t /
    2 (by integration).
    """
    up = np.maximum(0.5 * k * thickness, 1e-9)
    return np.asarray(np.sinh(up) / up)


def _bessel_slopes(x: Array, highest: int) -> tuple[Array, Array]:
    """Return J_m(x) and J_m'(x) (highest + 1, ...; no unit) for m = 0 to `highest`.

    Upward recursion from J0 and J1 if x is large enough (Abramowitz and Stegun 9.1.27).
    """
    orders = np.empty((highest + 2, *x.shape))
    orders[0], orders[1] = j0(x), j1(x)
    inverse = 2.0 / np.maximum(x, 1e-9)
    for n in range(1, highest + 1):
        orders[n + 1] = n * inverse * orders[n] - orders[n - 1]
    small = x < highest + 2.0
    orders[:, small] = bessel_orders(x[small], highest + 1)
    return orders[:-1], np.concatenate([-orders[1:2], 0.5 * (orders[:-2] - orders[2:])])
