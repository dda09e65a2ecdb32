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
"""Number of cells with uniform charge across each face of a strip. The cells are narrower at its edges."""

HARMONICS = 48
"""Number of spatial harmonics of the strips' pitch over which the electric fields are summed."""

OFFSETS = ((0.1127016654, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.8872983346, 5.0 / 18.0))
"""Lateral shifts between tracks of two crossing layers, divided by half a pitch, and their weights (no unit).

They are Gauss points, because the shift is uniformly distributed from 0 to half a pitch.
"""


def stacked_strips(width: float, distance: float, relative_permittivity: float) -> float:
    """Return the capacitance per length (F/m) of two equal thin strips face to face.

    Parameters
    ----------
    width : float
        width of the strips (m)
    distance : float
        distance of the faces (m)
    relative_permittivity : float
        permittivity between the strips and all round

    Notes
    -----
    By symmetry it is half the capacitance of a microstrip over a ground plane at half the distance: Hammerstad and
    Jensen (IEEE MTT-S 1980). Their error is 0.2 % if the width divided by half the distance is 0.01 to 100. The
    thickness of the strips is neglected (it adds 3 to 10 %).
    """
    u = 2.0 * width / distance
    shape = 6.0 + (2.0 * math.pi - 6.0) * math.exp(-((30.666 / u) ** 0.7528))
    return EPSILON0 * relative_permittivity * math.pi / math.log(shape / u + math.sqrt(1.0 + (2.0 / u) ** 2))


def coplanar_strips(width: float, spacing: float, relative_permittivity: float) -> float:
    """Return the capacitance per length (F/m) of two equal thin strips side by side.

    Parameters
    ----------
    width : float
        width of the strips (m)
    spacing : float
        gap between the strips (m)
    relative_permittivity : float
        effective permittivity: the mean of dielectric and air if the board is thick compared with the spacing

    Notes
    -----
    eps K(k') / K(k) with k = s / (s + 2 w): exact (conformal map; Smythe 1950) for thin strips in a uniform dielectric.
    """
    k = spacing / (spacing + 2.0 * width)
    complement = math.sqrt(1.0 - k * k)
    return EPSILON0 * relative_permittivity * _mean(1.0, complement) / _mean(1.0, k)


@record
class Slab:
    """One layer of a board.

    `thickness` is in m, `permittivity` relative. `is_copper` is true for a layer of copper strips. Its permittivity is
    for the material between the strips.
    """

    thickness: float
    permittivity: float
    is_copper: bool = False


def strip_layers(slabs: Sequence[Slab], width: float, pitch: float, reach: float) -> Array:
    """Return Maxwell's capacitance matrix per area (layers, layers; F/m2) of layers of parallel strips.

    All strips of a layer have one voltage. For strips and gaps of comparable size, the matrix is within 2 % of the
    result with finer cells.

    Parameters
    ----------
    slabs : sequence of Slab
        layers of the board from top to bottom
    width : float
        width of the strips (m)
    pitch : float
        distance of the strips' centre lines on every copper slab (m)
    reach : float
        size of the coil (m), the distance over which the field of a net charge decays

    Notes
    -----
    Neighbouring layers are shifted against each other. The result is the mean over all shifts, because the tracks of
    crossing spirals have all shifts. Charges lie on cells of both faces of the strips, from which side walls follow.
    Their fields are summed over the harmonics of the pitch with the Green's function of the layered stack, with air
    above and below.

    Derived here from Poisson's equation for each harmonic k (1/m): a slab of thickness d is a chain link of eps k
    coth(k d) and eps k / sinh(k d).
    """
    number = np.arange(HARMONICS + 1, dtype=np.float64)
    harmonics: Array = 2.0 * math.pi * number / pitch
    waves = harmonics.copy()
    waves[0] = 1.0 / reach
    # potential at interface i of a unit charge wave at interface j: inverse of the chain of slabs, for every wave
    count = len(slabs) + 1
    chain = np.zeros((waves.size, count, count))
    for k, slab in enumerate(slabs):
        decay = np.exp(-2.0 * waves * slab.thickness)
        diagonal = EPSILON0 * slab.permittivity * waves * (1.0 + decay) / (1.0 - decay)
        across = EPSILON0 * slab.permittivity * waves * 2.0 * np.sqrt(decay) / (1.0 - decay)
        chain[:, k, k] += diagonal
        chain[:, k + 1, k + 1] += diagonal
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
        total += weight * _charges_at_offset(green, form, middle, harmonics, shift) / pitch
    return total


def _charges_at_offset(green: Array, form: Array, middle: Array, waves: Array, shift: Array) -> Array:
    """Return the charges per length (layers, layers; F/m) on each layer (rows) if one layer (columns) has 1 V.

    Method: Galerkin, with a uniform charge on each cell. `green` (waves, faces, faces; m/F) is the potential on one
    face of a charge wave on another face. `form` (waves, cells) is the mean of a wave over each cell. `middle` (cells;
    m) are the middles of the cells across a strip. `waves` is in 1/m, `shift` (layers; m) is the lateral shift of each
    layer's strips.
    """
    count = shift.size
    place = (np.repeat(shift, 2)[:, None] + middle).ravel()
    cosine, sine = np.cos(np.outer(waves, place)), np.sin(np.outer(waves, place))
    tiled = np.tile(form, 2 * count)
    cosine, sine = cosine * tiled, sine * tiled
    strips = np.repeat(np.repeat(green, CELLS, axis=1), CELLS, axis=2)
    influence = np.einsum("na,nab,nb->ab", cosine, strips, cosine) + np.einsum("na,nab,nb->ab", sine, strips, sine)
    layer = np.kron(np.eye(count), np.ones((2 * CELLS, 1)))
    return np.asarray(layer.T @ np.linalg.solve(influence, layer), dtype=np.float64)


def winding_voltages(
    radii: Array, heights: Sequence[float], inward: Sequence[bool], size: Array, turns: Array
) -> Array:
    """Return the voltage at each turn of a series winding (layers, radii), divided by the voltage between its ends.

    The voltage runs from -1/2 at the start to 1/2 at the end.

    Parameters
    ----------
    radii : array
        radii of the turns from the outside to the inside (m)
    heights : sequence of float
        height of each layer (m)
    inward : sequence of bool
        whether the current runs inwards in each layer
    size : array
        geometric mean distance of each ring from itself (radii; m)
    turns : array
        number of turns at each radius (layers, radii); 0 inside a layer's inner end

    Notes
    -----
    Derived here from Faraday's law. The magnetic flux of all turns induces a voltage in each turn. The voltages of the
    turns up to a place add up to the voltage there. The mutual inductances of the turns are from Maxwell's rings.
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
        outwards = reached + np.cumsum(steps) - 0.5 * steps
        voltages[k] = outwards if inward[k] else outwards[::-1]
        reached += float(steps.sum())
    return np.asarray(voltages / reached - 0.5, dtype=np.float64)


def winding_capacitance(per_area: Array, voltages: Array, areas: Array) -> float:
    """Return the capacitance (F) between a winding's ends that results from the fields between its layers.

    Parameters
    ----------
    per_area : array
        Maxwell's capacitance matrix (layers, layers; F/m2)
    voltages : array
        voltages, divided by the voltage between the ends (layers, places)
    areas : array
        copper area of each place (places; m2)

    Notes
    -----
    It is twice the electric energy at 1 V between the ends, by W = C V^2 / 2 (textbook; derived here).
    """
    return float(np.einsum("ki,kl,li,i->", voltages, per_area, voltages, areas))


def turn_capacitance(
    lengths: Array, voltages: Array, parts: Array, width: float, spacing: float, thickness: float, permittivity: float
) -> float:
    """Return the capacitance (F) that neighbouring turns of a layer add between the winding's ends.

    Parameters
    ----------
    lengths : array
        length of a turn at each place (m)
    voltages : array
        voltage at each place, divided by the voltage between the ends
    parts : array
        number of turns that each place represents
    width : float
        track width (m)
    spacing : float
        gap between turns (m)
    thickness : float
        track thickness (m)
    permittivity : float
        relative permittivity

    Notes
    -----
    A pair of turns has the capacitance of coplanar strips, plus the side walls as plates. The voltage between two turns
    is the voltage gradient at each place, so a place that represents few turns adds little. Derived here from the
    pairs' electric energy, as in `winding_capacitance`.
    """
    turns = float(parts.sum())
    if turns <= 1.0 or parts.size < 2:
        return 0.0
    pair = coplanar_strips(width, spacing, permittivity) + EPSILON0 * permittivity * thickness / spacing
    middle = np.cumsum(parts) - 0.5 * parts
    between = np.gradient(voltages, middle) ** 2
    # n turns have n - 1 pairs of neighbours
    return pair * float(np.sum(between * lengths * parts)) * (turns - 1.0) / turns


def series_permittivity(thicknesses: Sequence[float], permittivities: Sequence[float]) -> float:
    """Return the effective relative permittivity (no unit) of layers above each other, as for capacitors in series.

    It is the total thickness (m), divided by the sum of each thickness divided by its permittivity (textbook).
    """
    return math.fsum(thicknesses) / math.fsum(t / e for t, e in zip(thicknesses, permittivities, strict=True))


def _mean(a: float, b: float) -> float:
    """Return the arithmetic-geometric mean of two numbers (no unit).

    K(k) is pi / 2 divided by the mean of 1 and k' (Abramowitz and Stegun 17.6).
    """
    for _ in range(12):
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return a
