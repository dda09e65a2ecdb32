"""The normal field of a path of straight filaments at tracks that a cut meets: far parts by Chebyshev interpolation.

The points of a cut lie along a line of its plane, at the heights of the layers. Seen from a filament that is farther
than they are spread, its field is a polynomial in their places: it is worked out at a few nodes of their box. The rest
is passed on to the halves of the box (Fong and Darve, J. Comput. Phys. 228, 2009).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, Flags, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.polynomials import chebyshev_points, node_counts, shares

Single = NDArray[np.float32]

AT_ONCE = 60_000
"""Points and filaments that are worked on at once: as many as stay near the processor."""

APART = 1.0
"""Distance of a filament from a box of points, in the box's half side, from which on it is seen at the nodes."""

ORDER = 5
"""Nodes along a box's longest side: with APART, the field is right to 1e-3 of the nearest such filaments' part."""

LINE = 5
"""Points of a box's middle line from which distances are told."""

WORTH = 3.0
"""Points for every node from which on interpolation pays."""

LEAST = 100_000
"""Points times filaments up to which all are summed."""


@record(eq=False)
class Filaments:
    """Straight filaments: starts and ends (n, 2), heights (m); the square (m2) of the least distance from each; which
    of them are a cut's own tracks, and the blocks of arcs that they belong to (-1: none).
    """

    start: Array
    end: Array
    height: Array
    clear: Array
    own: Index
    block: Index

    def some(self, chosen: Flags) -> Filaments:
        """Some of them (no unit), none of which is a cut's own."""
        return Filaments(self.start[chosen], self.end[chosen], self.height[chosen], self.clear[chosen],
                         np.zeros(0, dtype=np.intp), self.block[chosen])


def path_field(filaments: Filaments, point: Array, level: Array, ratio: Array, block: Index) -> Array:
    """Normal field per ampere (tracks, nodes; 1/m, without the factor of Biot and Savart) of straight filaments at
    points (tracks, nodes, 2; m) of heights (tracks; m), far ones by interpolation (Fong and Darve 2009). Less 2 `ratio`
    (tracks, own) straight ones without end for the cut's own tracks; nothing of filaments of the tracks' own `block`
    (tracks).
    """
    nodes = point.shape[1]
    where = np.column_stack([point.reshape(-1, 2), np.repeat(level, nodes)])
    near = np.isin(filaments.block, block) if filaments.block[0] >= 0 else np.zeros(len(filaments.block), dtype=bool)
    near[filaments.own] = True
    kept = np.cumsum(near)[filaments.own] - 1
    own = replace(filaments.some(near), own=kept)
    twice = np.repeat(2.0 * ratio, nodes, axis=0).astype(np.float32)
    blocks = np.repeat(block, nodes) if filaments.block[0] >= 0 else None
    total = _summed(own, where, twice, blocks)
    _spread(filaments.some(~near), where, np.arange(len(where)), total)
    return total.reshape(point.shape[:2])


def _spread(filaments: Filaments, where: Array, index: Index, total: Array) -> None:
    """Add the field (1/m) of filaments to that of some of the points (n, 3; m)."""
    points = where[index]
    count = len(filaments.block)
    if not count:
        return
    if count * len(points) > LEAST:
        box = box_of(points)
        if WORTH * math.prod(box.counts) <= len(points):
            far = box.distance(filaments.start, filaments.end) >= APART * box.half[0]
            total[index] += box.weights(points) @ _summed(filaments.some(far), box.nodes)
            left = (points - box.centre) @ box.axes[0] < 0.0
            rest = filaments.some(~far)
            _spread(rest, where, index[left], total)
            _spread(rest, where, index[~left], total)
            return
    total[index] += _summed(filaments, points)


@record(eq=False)
class PointBox:
    """A box of points: centre (m), axes from the longest one (rows, no unit), heights last, half sides (m)."""

    centre: Array
    axes: Array
    half: Array

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Nodes along every axis (no unit): `node_counts`."""
        return node_counts(self.half.tolist(), float(self.half[0]), ORDER, APART)

    @property
    def nodes(self) -> Array:
        """Chebyshev's, (n, 3; m)."""
        axes = [chebyshev_points(-1.0, 1.0, count) for count in self.counts]
        local = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return np.asarray(self.centre + (local.reshape(-1, 3) * self.half) @ self.axes)

    def weights(self, points: Array) -> Array:
        """What the nodes weigh at points (n, 3; m): (n, nodes), no unit."""
        at = (points - self.centre) @ self.axes.T / np.maximum(self.half, 1e-300)
        x, y, z = (shares(chebyshev_points(-1.0, 1.0, count), at[:, k]) for k, count in enumerate(self.counts))
        return np.asarray(np.einsum("na,nb,nc->nabc", x, y, z).reshape(len(at), -1))

    def distance(self, start: Array, end: Array) -> Array:
        """Distances (n; m) in the plane of straight filaments (n, 2; m) from the box's middle line, at least."""
        lean, half = self.axes[0, :2], float(self.half[0])
        first, last = start - self.centre[:2], end - self.centre[:2]
        span = last - first
        square = np.maximum(np.sum(span * span, axis=1), 1e-300)
        found = np.full(len(start), np.inf)
        for place in np.linspace(-half, half, LINE)[:, None] * lean:  # of points on the line from the filaments
            along = np.clip(np.sum((place - first) * span, axis=1) / square, 0.0, 1.0)
            away = place - first - along[:, None] * span
            np.minimum(found, np.hypot(away[:, 0], away[:, 1]), out=found)
        return found


def box_of(points: Array) -> PointBox:
    """The box of points (n, 3; m), or (n, 2), along their longest direction in the plane."""
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    away = points[:, :2] - points[:, :2].mean(axis=0)
    (xx, xy), (_, yy) = away.T @ away
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    c, s = math.cos(angle), math.sin(angle)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    at = points @ axes.T
    low, high = at.min(axis=0), at.max(axis=0)
    return PointBox(0.5 * (low + high) @ axes, axes, 0.5 * (high - low))


def _summed(filaments: Filaments, where: Array, twice: Single | None = None, block: Index | None = None) -> Array:
    """The field (n; 1/m) at points (n, 3; m), of all filaments: Biot and Savart, integrated along each. For each its
    distance to the right, where the field points down (the current's own normal is to the right), over the squared
    distance, times the difference of the cosines at its ends.
    """
    # Where they lie to the points in double precision, the rest in single.
    axis = (filaments.end - filaments.start).T
    length = np.hypot(*axis)
    axis = axis / length
    left = np.stack([-axis[1], axis[0]])
    along, aside = np.sum(filaments.start.T * axis, axis=0), np.sum(filaments.start.T * left, axis=0)
    clear, long = filaments.clear.astype(np.float32), length.astype(np.float32)
    found = np.empty(len(where))
    for part in slices(len(where), AT_ONCE // max(len(length), 1)):
        flat = where[part, :2]
        lateral = (aside - flat @ left).astype(np.float32)
        x = (along - flat @ axis).astype(np.float32)
        square = (where[part, 2:] - filaments.height).astype(np.float32)
        square *= square
        square += clear
        far = lateral * lateral
        square += far
        near = x * x
        near += square
        np.divide(x, np.sqrt(near, out=near), out=near)
        x += long
        np.multiply(x, x, out=far)
        far += square
        np.divide(x, np.sqrt(far, out=far), out=far)
        far -= near
        if twice is not None:
            far[:, filaments.own] -= twice[part]
        lateral /= square
        far *= lateral
        if block is not None:
            far[block[part, None] == filaments.block] = 0.0
        found[part] = far.sum(axis=1, dtype=np.float64)
    return found
