"""Normal field of a path of straight filaments at points of tracks, with distant filaments by interpolation.

The points lie along a line in a plane that crosses the tracks, at the heights of the layers. If a filament is farther
away than the size of a box of points, its field is nearly a polynomial in the box. So it is evaluated at a few nodes.
For nearer filaments, the box is halved (Fong and Darve, J. Comput. Phys. 228, 2009).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, Flags, Index, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.polynomials import barycentric_weights, chebyshev_points, node_counts

Single = NDArray[np.float32]
"""Array in single precision."""

AT_ONCE = 60_000
"""Number of pairs of points and filaments evaluated at once: these fit into the processor's cache."""

APART = 1.0
"""Least distance of a filament from a box of points, divided by the box's half side, for interpolation."""

ORDER = 5
"""Number of interpolation nodes along the longest side of a box.

With `APART`, the error is 1e-3 of the field of the nearest filaments that are interpolated.
"""

LINE = 5
"""Number of points on the middle line of a box from which the distances of filaments are measured."""

LEAST_POINTS_PER_NODE = 3.0
"""Least number of points in a box, divided by its number of nodes, at which interpolation saves time."""

LEAST = 100_000
"""Largest number of pairs of points and filaments that are summed directly, without boxes."""


@record(eq=False)
class Filaments:
    """Straight filaments of a path, in metres.

    `start` and `end` are (n, 2), `height` (n). `clearance` (n; m2) is the squared least distance that a point is
    assumed to have from each filament. `owner` has, for each track in the plane of the points, the number of the
    filament to which the track belongs. `block` (n) is the number of the block of arcs to which each filament belongs,
    or -1.
    """

    start: Array
    end: Array
    height: Array
    clearance: Array
    owner: Index
    block: Index

    def select(self, chosen: Flags) -> Filaments:
        """Return the chosen filaments only. The result has an empty `owner`."""
        return Filaments(self.start[chosen], self.end[chosen], self.height[chosen], self.clearance[chosen],
                         np.zeros(0, dtype=np.intp), self.block[chosen])


def path_field(filaments: Filaments, point: Array, level: Array, ratio: Array, block: Index) -> Array:
    """Return the normal field per ampere (tracks, nodes; 1/m), without the factor mu0 / (4 pi) of Biot and Savart.

    Parameters
    ----------
    filaments : Filaments
        all filaments of the path
    point : array (tracks, nodes, 2)
        positions at which the field is evaluated (m)
    level : array (tracks,)
        heights of the tracks (m)
    ratio : array (tracks, own)
            factor for each filament in `filaments.owner`. The field of an infinite straight filament in its place,
        multiplied by 2 `ratio`, is subtracted.
    block : array (tracks,)
        block of arcs of each track. The field at a track excludes the filaments of its block.

    Notes
    -----
    Distant filaments by interpolation (Fong and Darve 2009).
    """
    nodes = point.shape[1]
    where = np.column_stack([point.reshape(-1, 2), np.repeat(level, nodes)])
    near = np.isin(filaments.block, block) if filaments.block[0] >= 0 else np.zeros(len(filaments.block), dtype=bool)
    near[filaments.owner] = True
    own_numbers = np.cumsum(near)[filaments.owner] - 1
    near_filaments = replace(filaments.select(near), owner=own_numbers)
    twice = np.repeat(2.0 * ratio, nodes, axis=0).astype(np.float32)
    blocks = np.repeat(block, nodes) if filaments.block[0] >= 0 else None
    total = _total_field(near_filaments, where, twice, blocks)
    _add_field(filaments.select(~near), where, np.arange(len(where)), total)
    return total.reshape(point.shape[:2])


def _add_field(filaments: Filaments, where: Array, index: Index, total: Array) -> None:
    """Add the field (1/m) of filaments to `total` at the points with numbers `index`.

    `where` (n, 3; m) are the positions of all points.
    """
    points = where[index]
    count = len(filaments.block)
    if not count:
        return
    if count * len(points) > LEAST:
        box = box_around_points(points)
        if LEAST_POINTS_PER_NODE * math.prod(box.counts) <= len(points):
            distant = box.distance(filaments.start, filaments.end) >= APART * box.half[0]
            total[index] += box.weights(points) @ _total_field(filaments.select(distant), box.nodes)
            is_left = (points - box.centre) @ box.axes[0] < 0.0
            rest = filaments.select(~distant)
            _add_field(rest, where, index[is_left], total)
            _add_field(rest, where, index[~is_left], total)
            return
    total[index] += _total_field(filaments, points)


@record(eq=False)
class PointBox:
    """Box around points: `centre` (3; m), unit vectors of the `axes` as rows (3, 3), and half sides `half` (3; m).

    The first axis is the points' longest direction in the plane, the last axis is the height.
    """

    centre: Array
    axes: Array
    half: Array

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Numbers of interpolation nodes along the three axes (no unit)."""
        return node_counts(self.half.tolist(), float(self.half[0]), ORDER, APART)

    @property
    def nodes(self) -> Array:
        """Chebyshev nodes of the box (n, 3; m), at which fields are evaluated for interpolation."""
        axes = [chebyshev_points(-1.0, 1.0, count) for count in self.counts]
        local = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return np.asarray(self.centre + (local.reshape(-1, 3) * self.half) @ self.axes)

    def weights(self, points: Array) -> Array:
        """Return the weights (n, nodes; no unit) that interpolate from the nodes to points (n, 3; m)."""
        at = (points - self.centre) @ self.axes.T / np.maximum(self.half, 1e-300)
        x, y, z = (barycentric_weights(chebyshev_points(-1.0, 1.0, count), at[:, k]) for k,
                   count in enumerate(self.counts))
        return np.asarray(np.einsum("na,nb,nc->nabc", x, y, z).reshape(len(at), -1))

    def distance(self, start: Array, end: Array) -> Array:
        """Return a lower bound (n; m) of the distance in the plane between filaments and the middle line of the box.

        `start` and `end` (n, 2; m) are the ends of the filaments.
        """
        lean, half = self.axes[0, :2], float(self.half[0])
        first, last = start - self.centre[:2], end - self.centre[:2]
        span = last - first
        square = np.maximum(np.sum(span * span, axis=1), 1e-300)
        distances = np.full(len(start), np.inf)
        for place in np.linspace(-half, half, LINE)[:, None] * lean:  # of points on the line from the filaments
            part = np.clip(np.sum((place - first) * span, axis=1) / square, 0.0, 1.0)
            offset = place - first - part[:, None] * span
            np.minimum(distances, np.hypot(offset[:, 0], offset[:, 1]), out=distances)
        return distances


def box_around_points(points: Array) -> PointBox:
    """Return the box around points (n, 3 or 2; m). Its first axis is the points' longest direction in the plane."""
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    offsets = points[:, :2] - points[:, :2].mean(axis=0)
    (xx, xy), (_, yy) = offsets.T @ offsets
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    c, s = math.cos(angle), math.sin(angle)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    at = points @ axes.T
    low, high = at.min(axis=0), at.max(axis=0)
    return PointBox(0.5 * (low + high) @ axes, axes, 0.5 * (high - low))


def _total_field(filaments: Filaments, where: Array, twice: Single | None = None, block: Index | None = None) -> Array:
    """Return the field (n; 1/m) of all filaments at points (n, 3; m), by Biot and Savart's law for each filament.

    The field of a filament is the point's distance to its right divided by the squared distance, times the difference
    of the cosines at both ends. To the right of the current the field points down. For filaments in `owner`, the field
    of an infinite filament is subtracted, multiplied by `twice` (n, own). The field at a point excludes filaments with
    the point's `block` number.
    """
    # Where they lie to the points in double precision, the rest in single.
    axis = (filaments.end - filaments.start).T
    length = np.hypot(*axis)
    axis = axis / length
    normal = np.stack([-axis[1], axis[0]])
    parallel, offset = np.sum(filaments.start.T * axis, axis=0), np.sum(filaments.start.T * normal, axis=0)
    clear, long = filaments.clearance.astype(np.float32), length.astype(np.float32)
    sums = np.empty(len(where))
    for part in slices(len(where), AT_ONCE // max(len(length), 1)):
        flat = where[part, :2]
        lateral = (offset - flat @ normal).astype(np.float32)
        x = (parallel - flat @ axis).astype(np.float32)
        square = (where[part, 2:] - filaments.height).astype(np.float32)
        square *= square
        square += clear
        field = lateral * lateral
        square += field
        near = x * x
        near += square
        np.divide(x, np.sqrt(near, out=near), out=near)
        x += long
        np.multiply(x, x, out=field)
        field += square
        np.divide(x, np.sqrt(field, out=field), out=field)
        field -= near
        if twice is not None:
            field[:, filaments.owner] -= twice[part]
        lateral /= square
        field *= lateral
        if block is not None:
            field[block[part, None] == filaments.block] = 0.0
        sums[part] = field.sum(axis=1, dtype=np.float64)
    return sums
