"""Interaction matrix of current modes in parallel tracks: mean logarithm of the distance for each pair of tracks.

Modes without net current have short-range fields, so distant tracks interact only by their lowest modes. The matrix of
many tracks therefore has full blocks for neighbours, and blocks of the lowest modes for other pairs. Because turns have
one pitch, many pairs of tracks have equal relative positions. Each relative position is computed once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, Flags, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.loss.track_modes import (
    Cut,
    ModeSet,
    gauss_point_positions,
    mode_conductances,
    projection,
)
from sitscad.kernels.electromagnetics.special_functions import gauss, legendre

AT_ONCE = 16_000
"""Number of distances evaluated together: these fit into the processor's cache."""

MANY = 60
"""Least number of tracks in a cut at which distant pairs of tracks interact by their lowest modes only."""

REACH = 6.0
"""Largest distance between two tracks' centres, divided by the larger cross-section's diagonal, for all modes.

Pairs at larger distances interact by their lowest modes.
"""

LOW = 2
"""Highest order of the modes by which distant tracks interact: order across plus order through the track."""

FAR_POINTS = 3
"""Number of Gauss points across a distant track, and largest number through it. It is exact for the orders of `LOW`."""


SAME = 9
"""Number of decimal places to which equal relative positions agree, in units of the narrowest track width."""

REPEATED = 8
"""Least mean number of pairs per relative position at which pairs of equal position share one block of the matrix."""


@record(eq=False)
class Neighbourhood:
    """Tracks of one height, with the relative positions of their neighbours.

    `tracks` (n,) are track numbers. `neighbours` (n, m) holds, for each track, the number of its neighbour at each of m
    relative positions. If a track has no neighbour at a position, the entry is the total number of tracks, which is no
    valid track number. `blocks` (m modes, modes) are the matrix blocks of the m positions, one below the other.
    """

    tracks: Index
    neighbours: Index
    blocks: Array


@record(eq=False)
class NearAndFar:
    """Symmetric matrix of current modes in many tracks, for products with vectors (n modes) or (n modes, k).

    `near` holds the full blocks of near pairs; each track belongs to exactly one of its groups. `far` (n low, n low;
    single precision) holds the lowest modes of all other pairs. `low` are the numbers of the lowest modes. Both
    matrices are multiplied by `scale` (n, modes) on either side.
    """

    near: tuple[Neighbourhood, ...]
    low: Index
    far: NDArray[np.float32]
    scale: Array

    def __matmul__(self, vector: Array) -> Array:
        count, modes = self.scale.shape
        columns = vector.reshape(count, modes, -1)
        table = np.zeros((columns.shape[2], count + 1, modes))  # the last row stands for missing neighbours
        np.multiply(np.moveaxis(columns, 2, 0), self.scale, out=table[:, :-1])
        product = np.empty((len(table), count, modes))
        for group in self.near:
            near = np.take(table, group.neighbours, axis=1).reshape(len(table), group.tracks.size, -1)
            product[:, group.tracks] = near @ group.blocks
        lowest = table[:, :-1, self.low].astype(np.float32).reshape(len(table), -1)
        product[:, :, self.low] += (self.far @ lowest.T).T.reshape(len(table), count, -1)
        product *= self.scale
        return np.asarray(np.moveaxis(product, 0, 2).reshape(vector.shape))


def mode_matrix(cut: Cut, conductivity: float, modes: ModeSet) -> Array | NearAndFar:
    """Return the relaxation times (n modes, n modes; s) of all modes of n tracks with each other.

    They are mutual inductances per metre, scaled by the modes' resistances.

    Notes
    -----
    Partial inductances of straight parallel currents, -mu0 / (2 pi) <P_m ln(distance) P_n> (Ruehli 1974; Jackson,
    Classical Electrodynamics, chapter 5, for an infinite wire). Modes without net current have no other inductance.
    """
    scale = mode_conductances(cut, conductivity, modes)
    if len(scale) >= MANY:
        return _near_and_far(cut, modes, scale)
    flat = scale.ravel()
    first, second = np.triu_indices(len(scale), 1)
    mutual = np.empty((len(scale), *scale.shape, scale.shape[1]))  # (tracks, tracks, modes, modes)
    examples, way = _relative_positions(cut, first, second)
    for part, block in _blocks_by_pair(_mutual_logs(cut, modes, first[examples], second[examples]), way):
        i, j = first[part], second[part]
        mutual[i, j] = block
        mutual[j, i] = np.swapaxes(block, 1, 2)
    tracks = np.arange(len(scale))
    mutual[tracks, tracks] = _own_logs(cut, modes)
    matrix = np.swapaxes(mutual, 1, 2).reshape(flat.size, flat.size)
    matrix *= (-MU0 / (2.0 * math.pi) * flat)[:, None]
    matrix *= flat
    return matrix


def _near_and_far(cut: Cut, modes: ModeSet, scale: Array) -> NearAndFar:
    """Return the matrix of modes (s) as full blocks of near pairs and blocks of the lowest modes of all other pairs.

    `scale` (tracks, modes) is the square root of each mode's conductance.
    """
    count = len(scale)
    size = np.hypot(cut.width, cut.thickness)
    apart = np.hypot(cut.across[:, None] - cut.across, cut.height[:, None] - cut.height)
    near = apart < REACH * np.maximum(size[:, None], size)
    few = replace(modes, points=(FAR_POINTS, min(FAR_POINTS, modes.through + 1)))
    low = np.array([k for k, (a, b) in enumerate(modes.orders) if a + b <= LOW], dtype=np.intp)
    coarse = np.zeros((count, low.size, count, low.size), dtype=np.float32)
    i, j = np.nonzero(np.triu(~near, 1))
    examples, way = _relative_positions(cut, i, j)
    for part, block in _blocks_by_pair(_mutual_logs(cut, few, i[examples], j[examples], low), way):
        coarse[i[part], :, j[part], :] = block
        coarse[j[part], :, i[part], :] = np.swapaxes(block, 1, 2)
    root = math.sqrt(MU0 / (2.0 * math.pi))
    return NearAndFar(_neighbourhoods(cut, modes, near), low, -coarse.reshape(count * low.size, -1), root * scale)


def _neighbourhoods(cut: Cut, modes: ModeSet, near: Flags) -> tuple[Neighbourhood, ...]:
    """Return the negative matrix blocks of near pairs of tracks, and of each track with itself.

    Tracks of one height share the blocks of all relative positions. If few positions repeat (`REPEATED`), each track
    has its own blocks. `near` (tracks, tracks) flags the near pairs.
    """
    i, j = np.nonzero(np.triu(near, 1))
    examples, way = _relative_positions(cut, i, j)
    numbers = np.arange(len(near))
    alone, section = _relative_positions(cut, numbers, numbers)
    groups = np.unique(np.round(cut.height / cut.width.min(), SAME), return_inverse=True)[1]
    if REPEATED * len(examples) > len(i):
        examples, way, alone, section, groups = np.arange(len(i)), np.arange(len(i)), numbers, numbers, numbers
    blocks = _mutual_logs(cut, modes, i[examples], j[examples])
    blocks = np.concatenate([np.swapaxes(blocks, 1, 2), blocks, _own_logs(cut, modes)[alone]])
    first, second = np.concatenate([i, j, numbers]), np.concatenate([j, i, numbers])
    position = np.concatenate([way, len(examples) + way, 2 * len(examples) + section])
    neighbourhoods = []
    for group in range(groups.max() + 1):
        tracks, pairs = np.flatnonzero(groups == group), np.flatnonzero(groups[first] == group)
        positions, column = np.unique(position[pairs], return_inverse=True)
        neighbours = np.full((tracks.size, positions.size), len(near))
        neighbours[np.searchsorted(tracks, first[pairs]), column] = second[pairs]
        neighbourhoods.append(Neighbourhood(tracks, neighbours, -blocks[positions].reshape(-1, blocks.shape[2])))
    return tuple(neighbourhoods)


def _relative_positions(cut: Cut, i: Index, j: Index) -> tuple[Index, Index]:
    """Return an example pair for each distinct relative position, and the position number of each pair of tracks.

    Pair number p consists of the tracks `i[p]` and `j[p]`. The examples are pair numbers.
    """
    size = float(cut.width.min())
    sections = np.round(np.stack([cut.width, cut.thickness]) / size, SAME)
    _, section = np.unique(sections, axis=1, return_inverse=True)
    code = section[i] * (section.max() + 1) + section[j]
    for place in (cut.across, cut.height):
        distinct, number = np.unique(np.round((place[i] - place[j]) / size, SAME) + 0.0, return_inverse=True)
        code = code * max(distinct.size, 1) + number
    _, examples, way = np.unique(code, return_index=True, return_inverse=True)
    return examples, way


def _blocks_by_pair(blocks: Array, way: Index) -> Iterator[tuple[slice, Array]]:
    """Yield a slice of the pairs, and the matrix blocks (pairs, modes, modes) of these pairs.

    `blocks` (positions, modes, modes) has a block for each relative position. `way` is the position number of each
    pair.
    """
    for part in slices(way.size, AT_ONCE // max(blocks[0].size, 1) if len(blocks) else 1):
        yield part, blocks[way[part]]


def _mutual_logs(cut: Cut, modes: ModeSet, i: Index, j: Index, selected: Index | None = None) -> Array:
    """Return the means <P_m ln(distance / unit) P_n> over pairs of tracks (pairs, modes, modes; no unit).

    `i` and `j` are the track numbers. Both means are sums over Gauss points. If given, only the modes `selected` are
    used.
    """
    x, z = (table / cut.unit for table in gauss_point_positions(cut, modes))
    weights = projection(modes) if selected is None else projection(modes)[selected]
    points = x.shape[1]
    means = np.empty((i.size, len(weights), len(weights)))
    for part in slices(i.size, AT_ONCE // points**2):
        first, second = i[part], j[part]
        squared = np.square(x[first][:, :, None] - x[second][:, None, :])
        squared += np.square(z[first][:, :, None] - z[second][:, None, :])
        np.log(np.maximum(squared, 1e-30, out=squared), out=squared)
        half = squared.reshape(-1, points) @ (0.5 * weights.T)
        means[part] = weights @ half.reshape(first.size, points, -1)
    return means


def _own_logs(cut: Cut, modes: ModeSet) -> Array:
    """Return the means <P_m ln(distance / unit) P_n> within each track (tracks, modes, modes; no unit).

    The unit of length is `cut.unit`. Method: `log_block`.
    """
    means = np.empty((cut.across.size, len(modes.orders), len(modes.orders)))
    for width, thickness in {(float(w), float(t)) for w, t in zip(cut.width, cut.thickness, strict=True)}:
        block = log_block(thickness / width, replace(modes, points=(1, 1))).copy()
        block[0, 0] += math.log(width / cut.unit)
        means[(cut.width == width) & (cut.thickness == thickness)] = block
    return means


@lru_cache(maxsize=32)
def log_block(aspect: float, modes: ModeSet) -> Array:
    """Return the means of mode times ln(distance / width) times mode over one rectangle (modes, modes; no unit).

    `aspect` is thickness divided by width.

    Notes
    -----
    Derived here. The quadruple integral becomes a double integral over the differences of both coordinates, whose
    densities are polynomials. Points crowd towards difference zero, where the logarithm is singular. The result is
    within 2e-6 of the closed mean distance. The numbers of points of the mode set are not used.
    """
    nodes, weights = gauss(16 + modes.through)
    t = 0.5 * (1.0 + nodes)
    dz, wz = 2.0 * t**3, weights * 3.0 * t**2
    nodes, weights = gauss(18 + 2 * modes.across)
    t = 0.5 * (1.0 + nodes)
    scale = np.maximum(aspect * dz, 1e-9)[:, None]
    top = np.arcsinh(2.0 / scale)
    u = top * t
    dx, wx = scale * np.sinh(u), 0.5 * weights * top * scale * np.cosh(u)
    kernel = 0.5 * np.log(0.25 * (dx**2 + (aspect * dz[:, None]) ** 2)) * wx * wz[:, None]
    through = _difference_density(dz, modes.through)
    across = _difference_density(dx.ravel(), modes.across)
    half = np.einsum("zbd,zx->bdzx", through, kernel).reshape(-1, kernel.size)
    table = (half @ across.reshape(kernel.size, -1)).reshape(*through.shape[1:], *across.shape[1:])
    a, b = np.array(modes.orders).T
    return np.asarray(table[b[:, None], b[None, :], a[:, None], a[None, :]])


def _difference_density(gap: Array, order: int) -> Array:
    """Return the mean of P_a(x) P_c(x') over pairs on [-1, 1] with |x - x'| = `gap` (gaps, a, c; no unit).

    Both signs of the difference are added. Gauss points make the mean exact.
    """
    nodes, weights = gauss(order + 1)
    half = 1.0 - 0.5 * gap[:, None]
    low, high = legendre(order, half * nodes - 0.5 * gap[:, None]), legendre(order, half * nodes + 0.5 * gap[:, None])
    half_density = np.swapaxes(low * (0.25 * half * weights)[..., None], 1, 2) @ high
    return np.asarray(half_density + np.swapaxes(half_density, 1, 2))
