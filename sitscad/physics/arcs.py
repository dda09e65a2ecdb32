"""Circular arcs of tracks with each other and with straight sides.

An arc meets the closed potential of a straight strand at Gauss points; concentric arcs need one integral over their
difference of azimuth, all other arcs two.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.legendre import gauss
from sitscad.physics.mean_distance import level_heights
from sitscad.physics.track_strands import (
    BLOCK,
    FLOOR,
    Track,
    clearance_table,
    common_levels,
    directions,
    strand_pairs,
)
from sitscad.record import record

Array = NDArray[np.float64]
Index = NDArray[np.intp]

CHUNK = 400
"""Pairs of arcs that are worked on at once."""


@record
class Strands:
    """A pair of strands: how far each lies to the left of its centre line (m), the height between them (m), and the
    clearance (m2) over the distance (m) across that the pair keeps.
    """

    left: float
    other_left: float
    height: float
    table: tuple[Array, Array]

    def swapped(self) -> Strands:
        """The same pair for the tracks in the other order."""
        return Strands(self.other_left, self.left, self.height, self.table)

    def clearance(self, across: Array) -> Array:
        """The clearance (m2) of tracks at distances (m) across."""
        return np.interp(across, *self.table)


def pairs_with_arcs(one: Track, other: Track, count: int) -> float:
    """Integral of t1.t2 / distance (m) over all pairs of pieces with at least one arc, `count` strands a track."""
    levels = common_levels(one, other, count)
    table = clearance_table(one, other, count, levels)
    heights = level_heights(one.z - other.z, (one.thickness, other.thickness), levels)
    total = 0.0
    for x1, x2, share in strand_pairs(one.width, other.width, count, one is other):
        for height in heights:
            pair = Strands(x1, x2, height, table)
            value = _arcs_with_arcs(one, other, pair) + _arcs_with_sides(one, other, pair)
            total += share / levels * (value + _arcs_with_sides(other, one, pair.swapped()))
    return total


def _crowded(count: int) -> tuple[Array, Array]:
    # Gauss points of [0, 1] crowded towards both ends, where a piece that continues this one has a logarithm.
    nodes, weights = gauss(count)
    t = 0.5 * (1.0 + nodes)
    return t * t * (3.0 - 2.0 * t), 3.0 * weights * t * (1.0 - t)


def _arc_points(arcs: Array, offset: float, count: int) -> tuple[Array, Array, Array]:
    # Points (m, count, 2), unit tangents, and arc length per point.
    t, weights = _crowded(count)
    radius = arcs[:, 2] - arcs[:, 4] * offset
    azimuth = arcs[:, 3, None] + (arcs[:, 4] * arcs[:, 5])[:, None] * t
    outward = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=2)
    tangent = arcs[:, 4, None, None] * np.stack([-outward[..., 1], outward[..., 0]], axis=2)
    return arcs[:, None, :2] + radius[:, None, None] * outward, tangent, (radius * arcs[:, 5])[:, None] * weights


def _arcs_with_sides(one: Track, other: Track, pair: Strands, points: int = 14) -> float:
    # Arcs of one at Gauss points in the closed potential of the sides of the other.
    if not len(one.arcs) or not len(other.starts):
        return 0.0
    rows = max(1, BLOCK // (points * len(other.starts)))
    return math.fsum(
        _arc_rows_with_sides(one.arcs[k : k + rows], other, pair, points) for k in range(0, len(one.arcs), rows)
    )


def _arc_rows_with_sides(arcs: Array, other: Track, pair: Strands, points: int) -> float:
    where, tangent, length = _arc_points(arcs, pair.left, points)
    start, end = other.strand(pair.other_left)
    t = directions(end - start)
    reach = np.sum((end - start) * t, axis=1)
    dx, dy = where[:, :, :1] - start[:, 0], where[:, :, 1:] - start[:, 1]
    along = dx * t[:, 0] + dy * t[:, 1]
    across = dx * t[:, 1] - dy * t[:, 0]
    moved = pair.left - pair.other_left
    ends = np.minimum(np.abs(across[:, 0] + moved), np.abs(across[:, -1] + moved))
    rho = np.sqrt(np.maximum(across**2 + pair.height**2 + pair.clearance(ends)[:, None, :], FLOOR))
    potential = np.arcsinh((reach - along) / rho) + np.arcsinh(along / rho)
    return float(np.sum(potential * (tangent @ t.T) * length[:, :, None]))


def _arcs_with_arcs(one: Track, other: Track, pair: Strands) -> float:
    if not len(one.arcs) or not len(other.arcs):
        return 0.0
    a, b = one.arcs, other.arcs
    apart = np.hypot(a[:, None, 0] - b[:, 0], a[:, None, 1] - b[:, 1])
    low = np.where(a[:, 4] > 0, a[:, 3], a[:, 3] - a[:, 5])
    other_low = np.where(b[:, 4] > 0, b[:, 3], b[:, 3] - b[:, 5])
    turn = np.abs(np.remainder(low[:, None] - other_low + math.pi, 2.0 * math.pi) - math.pi)
    concentric = (apart < 1e-9) & (turn < 1e-9) & (np.abs(a[:, None, 5] - b[:, 5]) < 1e-9)
    total = _concentric_arcs(one, other, np.nonzero(concentric), pair)
    opposite = apart > 0.3 * np.maximum(a[:, None, 2], b[:, 2])
    for method, chosen in ((_opposite_arcs, opposite), (_other_arcs, ~concentric & ~opposite)):
        i, j = np.nonzero(chosen)
        for k in range(0, i.size, CHUNK):
            part = slice(k, k + CHUNK)
            total += method(one, other, (i[part], j[part]), pair)
    return total


def _opposite_arcs(one: Track, other: Track, pairs: tuple[Index, ...], pair: Strands, points: int = 10) -> float:
    # Arcs about centres well apart meet at most at their ends: points crowded there on both.
    i, j = pairs
    p, t, along = _arc_points(one.arcs, pair.left, points)
    q, u, other_along = _arc_points(other.arcs, pair.other_left, points)
    square = (p[i, :, None, 0] - q[j, None, :, 0]) ** 2 + (p[i, :, None, 1] - q[j, None, :, 1]) ** 2
    extra = pair.height**2 + pair.table[1][0]
    dot = np.einsum("kna,kma->knm", t[i], u[j])
    value = dot / np.sqrt(np.maximum(square + extra, FLOOR))
    return float(np.einsum("knm,kn,km->", value, along[i], other_along[j]))


def _concentric_arcs(one: Track, other: Track, pairs: tuple[Index, ...], pair: Strands, points: int = 14) -> float:
    # Only the difference of azimuth v matters: (angle - v) is how much of the arcs has it.
    i, j = pairs
    if not i.size:
        return 0.0
    a, b = one.arcs[i], other.arcs[j]
    r1, r2, angle = a[:, 2] - a[:, 4] * pair.left, b[:, 2] - b[:, 4] * pair.other_left, a[:, 5, None]
    clearance = pair.clearance(np.abs(a[:, 2] - b[:, 2]))
    square = np.maximum((r1 - r2) ** 2 + pair.height**2 + clearance, FLOOR)[:, None]
    product = (r1 * r2)[:, None]
    nodes, weights = gauss(points)
    scale = np.sqrt(square / product)
    reach = np.arcsinh(angle / scale)
    v = scale * np.sinh(0.5 * reach * (1.0 + nodes))
    jacobian = 0.5 * reach * weights * np.sqrt(v * v + scale * scale)
    kernel = product * np.cos(v) / np.sqrt(square + 4.0 * product * np.sin(0.5 * v) ** 2)
    return float(np.sum((a[:, 4] * b[:, 4])[:, None] * 2.0 * jacobian * (angle - v) * kernel))


def _other_arcs(one: Track, other: Track, pairs: tuple[Index, ...], pair: Strands, points: int = 20) -> float:
    i, j = pairs
    if not i.size:
        return 0.0
    where, tangent, length = _arc_points(one.arcs, pair.left, points)
    b = other.arcs[j]
    radius = (b[:, 2] - b[:, 4] * pair.other_left)[:, None]
    away = where[i] - b[:, None, :2]
    distance = np.hypot(away[..., 0], away[..., 1])
    offset = b[:, 4, None] * (np.arctan2(away[..., 1], away[..., 0]) - b[:, 3, None]) % (2.0 * math.pi)
    span = b[:, 5, None]
    nearest = np.where(offset <= span, offset, np.where(offset - span < 2.0 * math.pi - offset, span, 0.0))
    extra = pair.height**2 + pair.clearance(np.abs(distance - radius))
    product = distance * radius
    gap = (distance - radius) ** 2 + extra
    scale = np.sqrt(np.maximum(gap + 4.0 * product * np.sin(0.5 * (offset - nearest)) ** 2, FLOOR)) / radius
    nodes, weights = gauss(8)
    heading = np.arctan2(tangent[i][..., 1], tangent[i][..., 0])
    total = 0.0
    for edge in (0.0, span):
        reach = np.arcsinh((edge - nearest) / scale)[..., None]
        v = scale[..., None] * np.sinh(0.5 * reach * (1.0 + nodes))
        jacobian = 0.5 * np.abs(reach) * weights * np.sqrt(v * v + scale[..., None] ** 2)
        tau = nearest[..., None] + v
        square = gap[..., None] + 4.0 * product[..., None] * np.sin(0.5 * (offset[..., None] - tau)) ** 2
        azimuth = b[:, 3, None, None] + b[:, 4, None, None] * tau
        dot = b[:, 4, None, None] * np.sin(heading[..., None] - azimuth)
        inner = np.sum(jacobian * dot / np.sqrt(np.maximum(square, FLOOR)), axis=2)
        total += float(np.sum(inner * radius * length[i]))
    return total
