"""Capacitance of stacked and neighbouring tracks, and of a winding between its terminals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import EPSILON0
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings

CELLS = 4
"""Cells across each face of a strip, crowded to its edges."""

HARMONICS = 48
"""Spatial harmonics of the pitch that are summed."""

OFFSETS = ((0.1127016654, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.8872983346, 5.0 / 18.0))
"""Gauss points and weights over half a pitch: how far crossing tracks of two layers are shifted, all shifts alike."""


def stacked_strips(width: float, distance: float, relative_permittivity: float) -> float:
    """Capacitance per length (F/m) of two equal thin strips face to face, widths and distance of the faces in metres.
    Half of a microstrip's over the plane of symmetry: Hammerstad and Jensen (IEEE MTT-S 1980), stated to 0.2 % for
    width over half the distance from 0.01 to 100. The permittivity is that between the strips and all round; thickness
    of the strips is not in it (adds 3 to 10 %).
    """
    u = 2.0 * width / distance
    shape = 6.0 + (2.0 * math.pi - 6.0) * math.exp(-((30.666 / u) ** 0.7528))
    return EPSILON0 * relative_permittivity * math.pi / math.log(shape / u + math.sqrt(1.0 + (2.0 / u) ** 2))


def coplanar_strips(width: float, spacing: float, relative_permittivity: float) -> float:
    """Capacitance per length (F/m) of two equal thin strips side by side: eps K(k') / K(k), k = s / (s + 2 w). Exact
    (conformal map; Smythe 1950) for thin strips in one dielectric. `relative_permittivity` is the effective one: half
    of dielectric and air for a board thick against the spacing.
    """
    k = spacing / (spacing + 2.0 * width)
    complement = math.sqrt(1.0 - k * k)
    return EPSILON0 * relative_permittivity * _mean(1.0, complement) / _mean(1.0, k)


@record
class Slab:
    """One layer of a stack from top to bottom: thickness (m), relative permittivity, whether it carries strips. For
    strips the permittivity is that of what fills the space between them.
    """

    thickness: float
    permittivity: float
    is_copper: bool = False


def strip_layers(slabs: Sequence[Slab], width: float, pitch: float, reach: float) -> Array:
    """Maxwell's capacitance matrix per area (F/m2) of layers of parallel strips, every strip of a layer at one voltage.

    Strips of `width` (m) stand a `pitch` (m) apart on every copper slab; neighbouring layers are shifted against each
    other, averaged over all shifts, because the tracks of crossing spirals are. Charges lie on cells of both faces of
    the strips (side walls follow from these); their fields are summed over the harmonics of the pitch with the Green's
    function of the layered stack, air above and below. `reach` (m) is the size of the coil, over which a net charge's
    field dies out. Derived here from Poisson's equation for one harmonic k (1/m) at a time, in which a slab of
    thickness d is a chain link of eps k coth(k d) and eps k / sinh(k d). Within 2 % of finer cells for strips and gaps
    of comparable size.
    """
    number = np.arange(HARMONICS + 1, dtype=np.float64)
    harmonics: Array = 2.0 * math.pi * number / pitch
    waves = harmonics.copy()
    waves[0] = 1.0 / reach
    # Potential at interface i of a unit charge wave at interface j: inverse of the chain of slabs, for every wave.
    count = len(slabs) + 1
    chain = np.zeros((waves.size, count, count))
    for k, slab in enumerate(slabs):
        decay = np.exp(-2.0 * waves * slab.thickness)
        own = EPSILON0 * slab.permittivity * waves * (1.0 + decay) / (1.0 - decay)
        across = EPSILON0 * slab.permittivity * waves * 2.0 * np.sqrt(decay) / (1.0 - decay)
        chain[:, k, k] += own
        chain[:, k + 1, k + 1] += own
        chain[:, k, k + 1] -= across
        chain[:, k + 1, k] -= across
    chain[:, 0, 0] += EPSILON0 * waves
    chain[:, -1, -1] += EPSILON0 * waves
    green = np.asarray(np.linalg.inv(chain), dtype=np.float64)
    faces = [node for k, slab in enumerate(slabs) if slab.is_copper for node in (k, k + 1)]
    green = green[:, faces][:, :, faces] * np.where(number == 0, 1.0, 2.0)[:, None, None] / pitch
    edges = -0.5 * width * np.cos(math.pi * np.arange(CELLS + 1) / CELLS)
    middle: Array = 0.5 * (edges[1:] + edges[:-1])
    size = np.diff(edges)
    form = np.sinc(np.outer(number / pitch, size))
    count = len(faces) // 2
    total = np.zeros((count, count))
    for share, weight in OFFSETS:
        shift: Array = 0.5 * pitch * share * (np.arange(count, dtype=np.float64) % 2)
        total += weight * _shifted(green, form, middle, harmonics, shift) / pitch
    return total


def _shifted(green: Array, form: Array, middle: Array, waves: Array, shift: Array) -> Array:
    """Charges per length (F/m) of layers at 1 V, (layers, layers), by Galerkin's method with even charges on the cells.
    `green` (waves, faces, faces) in m/F is the potential of a charge wave, `form` (waves, cells) a wave's mean over
    each cell, `middle` (cells; m) the cells' places, `waves` in 1/m and `shift` (layers; m).
    """
    count = shift.size
    place = (np.repeat(shift, 2)[:, None] + middle).ravel()
    cosine, sine = np.cos(np.outer(waves, place)), np.sin(np.outer(waves, place))
    tiled = np.tile(form, 2 * count)
    cosine, sine = cosine * tiled, sine * tiled
    spread = np.repeat(np.repeat(green, CELLS, axis=1), CELLS, axis=2)
    influence = np.einsum("na,nab,nb->ab", cosine, spread, cosine) + np.einsum("na,nab,nb->ab", sine, spread, sine)
    layer = np.kron(np.eye(count), np.ones((2 * CELLS, 1)))
    return np.asarray(layer.T @ np.linalg.solve(influence, layer), dtype=np.float64)


def winding_voltages(
    radii: Array, heights: Sequence[float], inward: Sequence[bool], size: Array, turns: Array
) -> Array:
    """Voltage along the layers of a series winding, -1/2 to 1/2 from end to end: (layers, radii), in parts of the
    whole. Every radius (m, from the outside in) stands for `turns` (layers, radii) of a layer, none where it ends
    farther out. Derived here from Faraday's law: a turn adds the voltage that its share of the flux of all turns
    induces (Maxwell's rings, `size` (radii; m) their own geometric mean distance).
    """
    layers, count = len(heights), radii.size
    r = np.tile(radii, layers)
    z = np.repeat(np.asarray(heights, dtype=float), count)
    square = (r[:, None] - r[None, :]) ** 2 + (z[:, None] - z[None, :]) ** 2
    square += np.tile(size, layers) ** 2
    flux = turns * (coaxial_rings(r[:, None], r[None, :], square) @ turns.ravel()).reshape(layers, count)
    voltages = np.empty((layers, count))
    reached = 0.0
    for k in range(layers):
        steps = flux[k] if inward[k] else flux[k][::-1]
        along = reached + np.cumsum(steps) - 0.5 * steps
        voltages[k] = along if inward[k] else along[::-1]
        reached += float(steps.sum())
    return np.asarray(voltages / reached - 0.5, dtype=np.float64)


def winding_capacitance(per_area: Array, voltages: Array, areas: Array) -> float:
    """Capacitance (F) between a winding's ends, twice its electric energy at one volt: derived here from W = C V^2 / 2
    (textbook). `per_area` (layers, layers) in F/m2, `voltages` (layers, places) from end to end, `areas` (m2) of the
    places.
    """
    return float(np.einsum("ki,kl,li,i->", voltages, per_area, voltages, areas))


def turn_capacitance(
    lengths: Array, voltages: Array, shares: Array, width: float, spacing: float, thickness: float, permittivity: float
) -> float:
    """Capacitance (F) that neighbouring turns of a layer add between the winding's ends. Lengths (m) of the turns at
    the places, their voltages and the turns that each place stands for; the pair's capacitance is that of coplanar
    strips and of the side walls as plates. What a turn adds to the voltage is that between places on both sides, each
    place for itself, so that one that stands for next to nothing adds nothing. Derived here from the pairs' electric
    energy, as `winding_capacitance` is.
    """
    turns = float(shares.sum())
    if turns <= 1.0 or shares.size < 2:
        return 0.0
    pair = coplanar_strips(width, spacing, permittivity) + EPSILON0 * permittivity * thickness / spacing
    middle = np.cumsum(shares) - 0.5 * shares
    between = np.gradient(voltages, middle) ** 2
    # so many turns have one pair of neighbours fewer
    return pair * float(np.sum(between * lengths * shares)) * (turns - 1.0) / turns


def series_permittivity(thicknesses: Sequence[float], permittivities: Sequence[float]) -> float:
    """Relative permittivity (no unit) of layers one over the other: total thickness over the sum of thickness (m) over
    permittivity, as capacitors in series have it (textbook).
    """
    return math.fsum(thicknesses) / math.fsum(t / e for t, e in zip(thicknesses, permittivities, strict=True))


def _mean(a: float, b: float) -> float:
    """Arithmetic-geometric mean of two numbers, no unit; K(k) is pi / 2 over that of 1 and k' (Abramowitz and Stegun
    17.6).
    """
    for _ in range(12):
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return a
