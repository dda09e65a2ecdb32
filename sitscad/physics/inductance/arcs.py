"""Circular arcs of tracks with each other and with straight sides.

An arc meets the closed potential of a straight strand at Gauss points; concentric arcs need one integral over their
difference of azimuth, all other arcs two.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.inductance.far_arcs import FAR, far_arcs, far_sides, half_lengths, middles
from sitscad.physics.inductance.track_strands import (
    FLOOR,
    Bundle,
    Track,
    bundle,
    clearance_table,
    common_levels,
    directions,
)
from sitscad.physics.special.legendre import gauss

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Rule = tuple[Array, Array]
Table = tuple[Array, Array]
Method = Callable[..., Array]

MIDDLING, MIDDLING_POINTS = 1.5, 8
"""Distance of an arc's middle from another piece, in its half lengths, from which it is summed at so many points."""

APART, SPACED, BESIDE = 0.7, 0.36, 0.07
"""Distances of two arcs, in half lengths of the longer one, from which on each needs MIDDLING_POINTS; SPACED_POINTS;
and 16 crowded ones outside the closed inner integral. So all together is right to 1e-7."""

SPACED_POINTS = 12

SAMPLES = 9
"""Points of each arc by which their distance is told."""

CLEAR = 5.0
"""Distance, in widths, from which on strands' clearances no longer change: that of the table's last row."""


def pairs_with_arcs(one: Track, other: Track, count: int) -> float:
    """Integral of t1.t2 / distance (m) over all pairs of pieces with at least one arc, `count` strands a track."""
    levels = common_levels(one, other, count)
    strands = bundle(one, other, count, levels)
    table = clearance_table(one, other, count, levels)
    total = _arcs_with_arcs(one, other, strands, table, count)
    beside = _arcs_with_sides(one, other, strands, table, count)
    if one is other:
        return total + 2.0 * beside
    return total + beside + _arcs_with_sides(other, one, strands.swapped(), table, count)


def _crowded(count: int) -> Rule:
    # Gauss points of [0, 1] crowded towards both ends, where a piece that continues this one has a logarithm.
    nodes, weights = gauss(count)
    t = 0.5 * (1.0 + nodes)
    return t * t * (3.0 - 2.0 * t), 3.0 * weights * t * (1.0 - t)


def _plain(count: int) -> Rule:
    nodes, weights = gauss(count)
    return 0.5 * (1.0 + nodes), 0.5 * weights


def _arc_points(arcs: Array, offsets: Array, rule: Rule) -> tuple[Array, Array, Array]:
    # At a rule's p shares of m arcs, for k strands: points (m, k, p, 2), unit tangents (m, 1, p, 2), lengths (m, k, p).
    t, weights = rule
    radius = arcs[:, 2, None] - arcs[:, 4, None] * offsets
    azimuth = arcs[:, 3, None] + (arcs[:, 4] * arcs[:, 5])[:, None] * t
    outward = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=2)[:, None]
    tangent = arcs[:, 4, None, None, None] * np.stack([-outward[..., 1], outward[..., 0]], axis=3)
    where = arcs[:, None, None, :2] + radius[..., None, None] * outward
    return where, tangent, (radius * arcs[:, 5, None])[..., None] * weights


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def _arcs_with_sides(one: Track, other: Track, strands: Bundle, table: Table, count: int) -> float:
    # Arcs of one at Gauss points in the closed potential of the sides of the other.
    if not len(one.arcs) or not len(other.starts):
        return 0.0
    arcs, half = one.arcs, half_lengths(one.arcs)[:, None]
    t = directions(other.ends - other.starts)
    reach = _dot(other.ends - other.starts, t)
    away = middles(arcs)[:, None] - other.starts
    beyond = np.clip(_dot(away, t), 0.0, reach)[..., None]
    apart = np.hypot(*np.moveaxis(away - beyond * t, 2, 0))
    far = (apart >= FAR * half) & (apart - half >= CLEAR * max(one.width, other.width))
    middling = ~far & (apart >= MIDDLING * half)
    total = far_sides(one, other, strands, float(table[1][-1]), far, count)
    for chosen, rule in ((middling, _plain(MIDDLING_POINTS)), (~far & ~middling, _crowded(14))):
        i, j = np.nonzero(chosen)
        for part in strands.blocks(i.size, rule[0].size):
            total += _some_arcs_with_sides(arcs[i[part]], other, j[part], strands, table, rule)
    return total


def _some_arcs_with_sides(arcs: Array, other: Track, sides: Index, strands: Bundle, table: Table, rule: Rule) -> float:
    where, tangent, length = _arc_points(arcs, strands.offsets[0], rule)
    start, end = strands.ends(other, sides, 1)
    t = directions(other.ends[sides] - other.starts[sides])[:, None, :]
    reach = _dot(end - start, t)[..., None]
    away = where - start[:, :, None, :]
    along, across = _dot(away, t[:, :, None]), away[..., 0] * t[..., 1:] - away[..., 1] * t[..., :1]
    moved = strands.offsets[0] - strands.offsets[1]
    ends = np.minimum(np.abs(across[..., 0] + moved), np.abs(across[..., -1] + moved))
    square = across**2 + np.interp(ends, *table)[..., None]
    share = _dot(tangent, t[:, :, None]) * length
    total = 0.0
    for height in strands.heights:
        rho = np.sqrt(np.maximum(square + height * height, FLOOR))
        potential = np.arcsinh((reach - along) / rho) + np.arcsinh(along / rho)
        total += float(np.sum(potential * share, axis=(0, 2)) @ strands.shares)
    return total / strands.heights.size


def _arcs_with_arcs(one: Track, other: Track, strands: Bundle, table: Table, count: int) -> float:
    if not len(one.arcs) or not len(other.arcs):
        return 0.0
    a, b = one.arcs, other.arcs
    kinds = _kinds(one, other)
    total = far_arcs(one, other, strands, float(table[1][-1]), kinds[0], count)
    # of the same track, every pair once and twice over
    every = np.ones(kinds[0].shape, dtype=bool)
    shares = ((np.triu(every, 1), 2.0), (np.eye(len(a), dtype=bool), 1.0)) if one is other else ((every, 1.0),)
    for chosen, (method, points) in zip(kinds[1:], METHODS, strict=True):
        for wanted, times in shares:
            i, j = np.nonzero(chosen & wanted)
            for part in strands.blocks(i.size, points):
                for height in strands.heights:
                    values = method(a[i[part]], b[j[part]], strands, height * height, table)
                    total += times * float(values @ strands.shares) / strands.heights.size
    return total


def _kinds(one: Track, other: Track) -> tuple[NDArray[np.bool_], ...]:
    # Which pairs of arcs go to `far_arcs`, and to which one of METHODS.
    a, b = one.arcs, other.arcs
    apart = np.hypot(a[:, None, 0] - b[:, 0], a[:, None, 1] - b[:, 1])
    low = np.where(a[:, 4] > 0, a[:, 3], a[:, 3] - a[:, 5])
    other_low = np.where(b[:, 4] > 0, b[:, 3], b[:, 3] - b[:, 5])
    turn = np.abs(np.remainder(low[:, None] - other_low + math.pi, 2.0 * math.pi) - math.pi)
    concentric = (apart < 1e-9) & (turn < 1e-9) & (np.abs(a[:, None, 5] - b[:, 5]) < 1e-9)
    width, half, other_half = max(one.width, other.width), half_lengths(a)[:, None], half_lengths(b)
    p, q = middles(a), middles(b)
    between = np.hypot(p[:, None, 0] - q[:, 0], p[:, None, 1] - q[:, 1])
    ratio = np.minimum((between - other_half) / half, (between - half) / other_half)
    far = ~concentric & (ratio >= FAR) & (between - half - other_half >= CLEAR * width)
    middling = ~concentric & ~far & (ratio >= MIDDLING)
    rest = ~(concentric | far | middling)
    spaces = np.full(rest.shape, np.inf)
    i, j = np.nonzero(rest)
    spaces[i, j] = _distances(a[i], b[j]) / np.maximum(half[i, 0], other_half[j])
    middling |= rest & (spaces >= APART)
    beside = one.z != other.z and apart < a[:, None, 2] + b[:, 2] + width
    opposite = rest & ~middling & (apart > 0.3 * np.maximum(a[:, None, 2], b[:, 2])) & ~np.asarray(beside)
    rest &= ~middling & ~opposite
    spaced = rest & (spaces >= SPACED)
    clear = rest & ~spaced & (spaces >= BESIDE)
    return far, concentric, middling, opposite, spaced, clear, rest & ~spaced & ~clear


def _distances(a: Array, b: Array) -> Array:
    # Least distances (m) of pairs of arcs (n, 6), as their samples have it.
    one, other = (_arc_points(arcs, np.zeros(1), SAMPLED)[0][:, 0] for arcs in (a, b))
    found = np.empty(len(a))
    for k in range(0, len(a), 500):
        away = one[k : k + 500, :, None] - other[k : k + 500, None, :]
        found[k : k + 500] = np.sqrt(np.min(_dot(away, away), axis=(1, 2)))
    return found


def _opposite_arcs(a: Array, b: Array, strands: Bundle, square: float, table: Table, rule: Rule | None = None) -> Array:
    # Arcs about centres well apart, on one layer: they meet at most at their ends, where points are crowded on both.
    rule, middle = rule or _crowded(10), np.zeros(1)
    away = _arc_points(a, middle, rule)[0][:, :, :, None, :] - _arc_points(b, middle, rule)[0][:, :, None, :, :]
    nearest = np.sqrt(np.min(_dot(away, away), axis=(1, 2, 3)))
    p, t, along = _arc_points(a, strands.offsets[0], rule)
    q, u, other_along = _arc_points(b, strands.offsets[1], rule)
    away = p[:, :, :, None, :] - q[:, :, None, :, :]
    dot = _dot(t[:, :, :, None, :], u[:, :, None, :, :])
    apart = _dot(away, away) + square + np.interp(nearest, *table)[:, None, None, None]
    value = dot / np.sqrt(np.maximum(apart, FLOOR))
    return np.asarray(np.sum(np.matmul(value, other_along[..., None])[..., 0] * along, axis=(0, 2)))


def _concentric_arcs(a: Array, b: Array, strands: Bundle, square: float, table: Table) -> Array:
    # Only the difference of azimuth v matters: (angle - v) is how much of the arcs has it.
    r1 = a[:, 2, None] - a[:, 4, None] * strands.offsets[0]
    r2 = b[:, 2, None] - b[:, 4, None] * strands.offsets[1]
    angle = a[:, 5, None, None]
    clearance = np.interp(np.abs(a[:, 2] - b[:, 2]), *table)[:, None]
    apart = np.maximum((r1 - r2) ** 2 + square + clearance, FLOOR)[..., None]
    product = (r1 * r2)[..., None]
    nodes, weights = gauss(14)
    scale = np.sqrt(apart / product)
    reach = np.arcsinh(angle / scale)
    v = scale * np.sinh(0.5 * reach * (1.0 + nodes))
    jacobian = 0.5 * reach * weights * np.sqrt(v * v + scale * scale)
    kernel = product * np.cos(v) / np.sqrt(apart + 4.0 * product * np.sin(0.5 * v) ** 2)
    way = (a[:, 4] * b[:, 4])[:, None, None]
    return np.asarray(np.sum(way * 2.0 * jacobian * (angle - v) * kernel, axis=(0, 2)))


def _other_arcs(a: Array, b: Array, strands: Bundle, square: float, table: Table, rule: Rule | None = None) -> Array:
    where, tangent, length = _arc_points(a, strands.offsets[0], rule or _crowded(20))
    b = b[:, :, None, None]
    radius = b[:, 2] - b[:, 4] * strands.offsets[1][:, None]
    away = where - np.moveaxis(b[:, :2], 1, 3)
    distance = np.hypot(away[..., 0], away[..., 1])
    offset = b[:, 4] * (np.arctan2(away[..., 1], away[..., 0]) - b[:, 3]) % (2.0 * math.pi)
    span = b[:, 5]
    nearest = np.where(offset <= span, offset, np.where(offset - span < 2.0 * math.pi - offset, span, 0.0))
    product = distance * radius
    gap = (distance - radius) ** 2 + square + np.interp(np.abs(distance - radius), *table)
    scale = np.sqrt(np.maximum(gap + 4.0 * product * np.sin(0.5 * (offset - nearest)) ** 2, FLOOR)) / radius
    nodes, weights = gauss(8)
    heading = np.arctan2(tangent[..., 1], tangent[..., 0])
    # the angle between both tangents where b is nearest: what it is elsewhere follows from the tangent of half the way
    lean = b[:, 4] * (heading - b[:, 3]) - offset
    sine, cosine = (turn[..., None] for turn in (np.sin(lean), np.cos(lean)))
    gap, four, scale = gap[..., None], 4.0 * product[..., None], scale[..., None]
    total = np.zeros(strands.shares.size)
    for edge in (0.0, span):
        reach = np.arcsinh((edge - nearest)[..., None] / scale)
        v = scale * np.sinh(0.5 * reach * (1.0 + nodes))
        jacobian = 0.5 * np.abs(reach) * weights * np.sqrt(v * v + scale * scale)
        half = np.tan(0.5 * ((offset - nearest)[..., None] - v))
        square = half * half
        both = 1.0 / (1.0 + square)
        dot = (sine * (1.0 - square) + 2.0 * cosine * half) * both
        inner = np.sum(jacobian * dot / np.sqrt(np.maximum(gap + four * square * both, FLOOR)), axis=3)
        total += np.sum(inner * radius * length, axis=(0, 2))
    return total


def _by(method: Method, rule: Rule) -> Method:
    return lambda a, b, strands, square, table: method(a, b, strands, square, table, rule)


SAMPLED: Rule = (np.linspace(0.0, 1.0, SAMPLES), np.ones(SAMPLES))

METHODS: tuple[tuple[Method, int], ...] = (
    (_concentric_arcs, 14),
    (_by(_opposite_arcs, _plain(MIDDLING_POINTS)), MIDDLING_POINTS**2),
    (_opposite_arcs, 100),
    (_by(_opposite_arcs, _plain(SPACED_POINTS)), SPACED_POINTS**2),
    (_by(_other_arcs, _crowded(16)), 128),
    (_other_arcs, 160),
)
"""How the kinds of pairs of arcs that are not far are summed, and at how many points at once."""
