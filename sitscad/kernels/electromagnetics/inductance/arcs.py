"""Neumann's integral of circular arcs of tracks with each other and with straight sides.

Neumann's integral is the double integral of t1.t2 / distance along two conductors with unit tangents t1 and t2. With a
straight side, the inner integral has a closed form, and the arc is summed at Gauss points. Two concentric arcs need one
integral over their difference of azimuth, all other arcs two.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from sitscad.basics.arrays import Array, Flags, slices
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.inductance.track_strands import FLOOR, Pairs, StrandPairs, Track, directions
from sitscad.kernels.electromagnetics.special_functions import gauss

Rule = tuple[Array, Array]
"""Quadrature rule on [0, 1]: points and weights (no unit)."""
Method = Callable[..., float]
"""Function that returns the integral of t1.t2 / distance (m) over pairs of arcs."""

FAR = 4.0
"""Distance of an arc's middle from another piece, divided by the arc's half length, above which `POINTS` are enough.

At this distance the relative error of the pair is 4e-6. It is 1e-7 of the sum over all pairs, because most pairs are
farther apart.
"""

POINTS = ((50.0, 3), (100.0, 4), (360.0, 5))
"""Rows (largest angle of an arc in degrees, number of Gauss points) for arcs far from the other piece.

The error is 1e-7 up to this angle. The current's direction turns along the arc, so the number grows with the angle.
"""

MIDDLING = 1.5
"""Least distance of an arc's middle from another piece, divided by the arc's half length, for `MIDDLING_POINTS`.

At shorter distances, points crowd at the arc's ends.
"""

MIDDLING_POINTS = 8
"""Number of Gauss points on an arc whose distance from the other piece is between `MIDDLING` and `FAR`."""

APART = 0.7
"""Least distance between two arcs, divided by the longer half length, at which `MIDDLING_POINTS` on each are enough.

With the limits APART, SPACED and BESIDE, the relative error of the total is 1e-7.
"""

SPACED = 0.36
"""Least distance between two arcs, divided by the longer half length, at which `SPACED_POINTS` on each are enough."""

BESIDE = 0.07
"""Least distance between two arcs, divided by the longer half length, at which 16 points crowded at the ends suffice.

These are the points of the outer integral. The inner integral has its own points, graded towards the nearest place. For
nearer arcs, the outer integral has 20 points.
"""

SPACED_POINTS = 12
"""Number of Gauss points on each of two arcs whose distance is between `SPACED` and `APART`."""

SAMPLES = 9
"""Number of points on each arc from which the least distance of two arcs is estimated."""

CLEAR = 5.0
"""Distance of two pieces, in track widths, above which the clearance of their strands is constant.

A clearance is the term that is added to the squared distance of strands (`mean_distance.strand_clearance`). The
distance is the last row of the table of clearances (`mean_distance.clearance_table`).
"""


def _points_near_ends(count: int) -> Rule:
    """Return points in [0, 1] and weights (count; no unit), crowded towards both ends.

    They are Gauss points t, moved to t^2 (3 - 2 t). At an end, the next piece of the track causes a logarithmic
    singularity.
    """
    nodes, weights = gauss(count)
    t = 0.5 * (1.0 + nodes)
    return t * t * (3.0 - 2.0 * t), 3.0 * weights * t * (1.0 - t)


def _gauss_points(count: int) -> Rule:
    """Return the Gauss points of [0, 1] and their weights (count; no unit)."""
    nodes, weights = gauss(count)
    return 0.5 * (1.0 + nodes), 0.5 * weights


def _arc_points(arcs: Array, offsets: Array, rule: Rule) -> tuple[Array, Array, Array]:
    """Return points (m, k, p, 2; m), unit tangents (m, 1, p, 2) and line elements (m, k, p; m) on m arcs.

    `arcs` (m, 6) have the columns of `Track.arcs`. The k strands lie at `offsets` (m) to the left, and the quadrature
    rule has p points along each arc.
    """
    t, weights = rule
    radius = arcs[:, 2, None] - arcs[:, 4, None] * offsets
    azimuth = arcs[:, 3, None] + (arcs[:, 4] * arcs[:, 5])[:, None] * t
    outward = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=2)[:, None]
    tangent = arcs[:, 4, None, None, None] * np.stack([-outward[..., 1], outward[..., 0]], axis=3)
    where = arcs[:, None, None, :2] + radius[..., None, None] * outward
    return where, tangent, (radius * arcs[:, 5, None])[..., None] * weights


def _dot(a: Array, b: Array) -> Array:
    """Return scalar products (...) of two arrays of vectors (..., 2), in the product of their units."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def arc_half_lengths(arcs: Array) -> Array:
    """Return half the length (n; m) of arcs (n, 6; columns of `Track.arcs`): radius times half the angle."""
    return np.asarray(0.5 * arcs[:, 2] * arcs[:, 5])


def middles(arcs: Array) -> Array:
    """Return the middle points (n, 2; m) of arcs (n, 6; m; columns of `Track.arcs`)."""
    azimuth = arcs[:, 3] + 0.5 * arcs[:, 4] * arcs[:, 5]
    return np.asarray(arcs[:, :2] + arcs[:, 2:3] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1))


def _far_rule(arcs: Array) -> Rule:
    """Return the quadrature rule for arcs far from other pieces. The largest angle sets the number of points."""
    turn = math.degrees(float(arcs[:, 5].max()))
    return _gauss_points(next(number for most, number in POINTS if turn <= most))


def arc_distances(first: Track, second: Track, pairs: Pairs) -> Array:
    """Return lower bounds (n; m) of the distance in the plane between arcs of two tracks, for each of the `pairs`.

    The bound is the distance of their middles minus both half lengths. It is negative if they may touch.
    """
    a, b = first.arcs, second.arcs
    offset = middles(a)[pairs.first] - middles(b)[pairs.second]
    return np.asarray(np.hypot(*offset.T) - arc_half_lengths(a)[pairs.first] - arc_half_lengths(b)[pairs.second])


def arc_side_distances(first: Track, second: Track, pairs: Pairs) -> Array:
    """Return lower bounds (n; m) of the distance between arcs of the first track and sides of the second track."""
    arcs = first.arcs
    return np.asarray(_middle_distances(first, second, pairs) - arc_half_lengths(arcs)[pairs.first])


def _middle_distances(first: Track, second: Track, pairs: Pairs) -> Array:
    """Return the distances (n; m) of arcs' middles (first track) from straight sides (second track)."""
    start, end = second.starts[pairs.second], second.ends[pairs.second]
    t = directions(end - start)
    offset = middles(first.arcs)[pairs.first] - start
    beyond = np.clip(_dot(offset, t), 0.0, _dot(end - start, t))
    return np.asarray(np.hypot(*(offset - beyond[:, None] * t).T))


def sum_arcs_with_sides(first: Track, second: Track, pairs: Pairs, strands: StrandPairs) -> float:
    """Return the sum of t1.t2 / distance (m; Neumann's integral) over pairs of an arc and a straight side.

    Arcs belong to the first track, sides to the second. `strands` are the filaments that replace both tracks. Arcs are
    summed at Gauss points in the closed potential of the sides.
    """
    if not pairs.first.size:
        return 0.0
    apart, half = _middle_distances(first, second, pairs), arc_half_lengths(first.arcs)[pairs.first]
    distant = (apart >= FAR * half) & (apart - half >= CLEAR * max(first.width, second.width))
    middling = ~distant & (apart >= MIDDLING * half)
    rules = (distant, _far_rule(first.arcs)), (middling, _gauss_points(MIDDLING_POINTS)), (~distant & ~middling,
                                                                                           _points_near_ends(14))
    return math.fsum(
        _sum_arcs_with_sides_by_rule(first.arcs, second, pairs.select(chosen).select(part), strands, rule)
        for chosen, rule in rules for part in strands.blocks(int(np.sum(chosen)), rule[0].size)
    )


def _sum_arcs_with_sides_by_rule(arcs: Array, other: Track, pairs: Pairs, strands: StrandPairs, rule: Rule) -> float:
    """Return the sum of t1.t2 / distance (m; Neumann's integral) over pairs of an arc and a straight side.

    `arcs` (n, 6) belong to the first track, sides to the track `other`. `strands` are the filaments that replace both
    tracks. `rule` holds the points and weights along every arc.

    Notes
    -----
    Neumann's inner integral over the side is asinh(a / rho) + asinh(b / rho). Here a and b are the distances to its
    ends along the side, and rho is the distance from its line (Grover 1946, chapter 6).
    """
    where, tangent, length = _arc_points(arcs[pairs.first], strands.offsets[0], rule)
    start, end = strands.ends(other, pairs.second, 1)
    t = directions(other.ends[pairs.second] - other.starts[pairs.second])[:, None, :]
    reach = _dot(end - start, t)[..., None]
    offset = where - start[:, :, None, :]
    parallel, lateral = _dot(offset, t[:, :, None]), offset[..., 0] * t[..., 1:] - offset[..., 1] * t[..., :1]
    moved = strands.offsets[0] - strands.offsets[1]
    ends = np.minimum(np.abs(lateral[..., 0] + moved), np.abs(lateral[..., -1] + moved))
    square = lateral**2 + strands.clearance(ends)[..., None]
    beyond, times = reach - parallel, strands.multiplicities_at_heights(pairs.times)
    share = _dot(tangent, t[:, :, None]) * length * strands.weights[:, None]
    total = 0.0
    for k, height in enumerate(strands.heights):
        rho = np.sqrt(np.maximum(square + height * height, FLOOR))
        potential = np.arcsinh(beyond / rho) + np.arcsinh(parallel / rho)
        total += float(np.einsum("nkp,nkp->n", potential, share) @ times[:, k])
    return total


def sum_arcs_with_arcs(first: Track, second: Track, pairs: Pairs, strands: StrandPairs) -> float:
    """Return the sum of t1.t2 / distance (m; Neumann's integral) over pairs of an arc of each of two tracks.

    `strands` are the filaments that replace both tracks. The distance of each pair sets the method and the number of
    points.
    """
    if not pairs.first.size:
        return 0.0
    rule = _far_rule(np.concatenate([first.arcs, second.arcs]))
    methods: tuple[tuple[Method, int], ...] = ((partial(_sum_opposite_arcs, rule=rule), rule[0].size ** 2), *METHODS)
    total = 0.0
    for chosen, (method, points) in zip(_pairs_by_method(first, second, pairs), methods, strict=True):
        some = pairs.select(chosen)
        for part in strands.blocks(some.first.size, points):
            times = strands.multiplicities_at_heights(some.times[part])
            total += method(first.arcs[some.first[part]], second.arcs[some.second[part]], strands, times)
    return total


def _pairs_by_method(first: Track, second: Track, pairs: Pairs) -> tuple[Flags, ...]:
    """Return flags (n) of the pairs of arcs that each method handles: far pairs first, then each entry of METHODS.

    Every pair has exactly one method.
    """
    a, b = first.arcs[pairs.first], second.arcs[pairs.second]
    apart = np.hypot(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1])
    low, other_low = (np.where(arcs[:, 4] > 0, arcs[:, 3], arcs[:, 3] - arcs[:, 5]) for arcs in (a, b))
    turn = np.abs(np.remainder(low - other_low + math.pi, 2.0 * math.pi) - math.pi)
    concentric = (apart < 1e-9) & (turn < 1e-9) & (np.abs(a[:, 5] - b[:, 5]) < 1e-9)
    width, half, other_half = max(first.width, second.width), arc_half_lengths(a), arc_half_lengths(b)
    between = np.hypot(*(middles(a) - middles(b)).T)
    ratio = np.minimum((between - other_half) / half, (between - half) / other_half)
    distant = ~concentric & (ratio >= FAR) & (between - half - other_half >= CLEAR * width)
    middling = ~concentric & ~distant & (ratio >= MIDDLING)
    rest = ~(concentric | distant | middling)
    spaces = np.full(rest.shape, np.inf)
    spaces[rest] = _distances(a[rest], b[rest]) / np.maximum(half, other_half)[rest]
    middling |= rest & (spaces >= APART)
    beside = (first.z != second.z) & (apart < a[:, 2] + b[:, 2] + width)
    opposite = rest & ~middling & (apart > 0.3 * np.maximum(a[:, 2], b[:, 2])) & ~beside
    rest &= ~middling & ~opposite
    spaced = rest & (spaces >= SPACED)
    clear = rest & ~spaced & (spaces >= BESIDE)
    return distant, concentric, middling, opposite, spaced, clear, rest & ~spaced & ~clear


def _distances(a: Array, b: Array) -> Array:
    """Return the least distances (n; m) of pairs of arcs (n, 6), estimated from `SAMPLES` points on each."""
    points, other_points = (_arc_points(arcs, np.zeros(1), SAMPLED)[0][:, 0] for arcs in (a, b))
    least = np.empty(len(a))
    for part in slices(len(a), 500):
        offset = points[part, :, None] - other_points[part, None, :]
        least[part] = np.sqrt(np.min(_dot(offset, offset), axis=(1, 2)))
    return least


def _sum_opposite_arcs(a: Array, b: Array, strands: StrandPairs, times: Array, rule: Rule) -> float:
    """Return the sum of t1.t2 / distance (m; Neumann's integral) over pairs of arcs whose centres are not close.

    `a` and `b` (n, 6) are the arcs, `times` (n, heights) the multiplicities, `strands` the filaments that replace both
    tracks. The double integral uses `rule` for each arc, with points crowded at the ends if the arcs may meet.
    """
    middle = np.zeros(1)
    p, q = _arc_points(a, middle, rule)[0], _arc_points(b, middle, rule)[0]
    x, y = (p[:, :, :, None, k] - q[:, :, None, :, k] for k in (0, 1))
    clearance = strands.clearance(np.sqrt(np.min(x * x + y * y, axis=(1, 2, 3))))
    p, t, elements = _arc_points(a, strands.offsets[0], rule)
    q, u, other_elements = _arc_points(b, strands.offsets[1], rule)
    x, y = (p[:, :, :, None, k] - q[:, :, None, :, k] for k in (0, 1))
    apart = x * x
    y *= y
    apart += y
    apart += clearance[:, None, None, None]
    # products of the line elements: all strands share the tangents
    dot = (t[..., 0, None] * u[:, :, None, :, 0] + t[..., 1, None] * u[:, :, None, :, 1])[:, 0]
    total = 0.0
    for k, height in enumerate(strands.heights):
        np.maximum(np.add(apart, height * height, out=x), FLOOR, out=x)
        np.divide(1.0, np.sqrt(x, out=x), out=x)
        x *= dot[:, None]
        inner = np.sum(np.matmul(x, other_elements[..., None])[..., 0] * elements, axis=2)
        total += float(times[:, k] @ (inner @ strands.weights))
    return total


def _sum_concentric_arcs(a: Array, b: Array, strands: StrandPairs, times: Array) -> float:
    """Return the sum of t1.t2 / distance (m; Neumann's integral) over pairs of concentric arcs with equal angle.

    `a` and `b` (n, 6) are the arcs, `times` (n, heights) the multiplicities, `strands` the filaments that replace both
    tracks.

    Notes
    -----
    Derived here. Only the difference v of azimuths matters. So, for arcs of angle a, Neumann's integral is the integral
    of 2 (a - v) r1 r2 cos v / distance over v from 0 to a. Points are graded by v = scale sinh(t) about the peak at 0.
    """
    r1 = a[:, 2, None] - a[:, 4, None] * strands.offsets[0]
    r2 = b[:, 2, None] - b[:, 4, None] * strands.offsets[1]
    angle = a[:, 5, None, None]
    least = (r1 - r2) ** 2 + strands.clearance(np.abs(a[:, 2] - b[:, 2]))[:, None]
    product = (r1 * r2)[..., None]
    nodes, weights = gauss(14)
    total = 0.0
    for k, height in enumerate(strands.heights):
        apart = np.maximum(least + height * height, FLOOR)[..., None]
        scale = np.sqrt(apart / product)
        reach = np.arcsinh(angle / scale)
        v = scale * np.sinh(0.5 * reach * (1.0 + nodes))
        jacobian = 0.5 * reach * weights * np.sqrt(v * v + scale * scale)
        kernel = product * np.cos(v) / np.sqrt(apart + 4.0 * product * np.sin(0.5 * v) ** 2)
        values = np.sum(2.0 * jacobian * (angle - v) * kernel, axis=2) @ strands.weights
        total += float((times[:, k] * a[:, 4] * b[:, 4]) @ values)
    return total


def _sum_other_arcs(a: Array, b: Array, strands: StrandPairs, times: Array, rule: Rule) -> float:
    """Return the sum of t1.t2 / distance (m; Neumann's integral) over near pairs of arcs that are not concentric.

    `a` and `b` (n, 6) are the arcs, `times` (n, heights) the multiplicities, `strands` the filaments that replace both
    tracks. The outer integral is over the points of `rule` on the first arc. The inner integral over the second arc has
    points graded about the azimuth nearest to the outer point (`_TurnedTangents`).
    """
    where, tangent, length = _arc_points(a, strands.offsets[0], rule)
    b = b[:, :, None, None]
    radius = b[:, 2] - b[:, 4] * strands.offsets[1][:, None]
    separation = where - np.moveaxis(b[:, :2], 1, 3)
    distance = np.hypot(separation[..., 0], separation[..., 1])
    offset = b[:, 4] * (np.arctan2(separation[..., 1], separation[..., 0]) - b[:, 3]) % (2.0 * math.pi)
    span = b[:, 5]
    nearest = np.where(offset <= span, offset, np.where(offset - span < 2.0 * math.pi - offset, span, 0.0))
    product = distance * radius
    least = (distance - radius) ** 2 + strands.clearance(np.abs(distance - radius))
    way = 4.0 * product * np.sin(0.5 * (offset - nearest)) ** 2
    heading = np.arctan2(tangent[..., 1], tangent[..., 0])
    # angle between both tangents at the foot; elsewhere it follows from the tangent of half the angle from there
    lean = b[:, 4] * (heading - b[:, 3]) - offset
    turned = _TurnedTangents(np.sin(lean)[..., None], np.cos(lean)[..., None], (offset - nearest)[..., None])
    four, share = 4.0 * product[..., None], radius * length * strands.weights[:, None]
    total = 0.0
    for k, height in enumerate(strands.heights):
        gap = least + height * height
        scale = np.sqrt(np.maximum(gap + way, FLOOR)) / radius
        inner = sum(turned.integral((edge - nearest)[..., None], scale[..., None], gap[..., None], four)
                    for edge in (0.0, span))
        total += float(np.einsum("nkp,nkp->n", inner, share) @ times[:, k])
    return total


@record(eq=False)
class _TurnedTangents:
    """Direction of an arc's tangents relative to the tangent at a point of another arc.

    The foot is the place on the arc in the direction of the other arc's point. `sine` and `cosine` belong to the angle
    between the tangents at the foot and at the point. `angle` (rad) is the azimuth from the arc's nearest place to the
    foot.
    """

    sine: Array
    cosine: Array
    angle: Array

    def integral(self, edge: Array, scale: Array, gap: Array, four: Array) -> Array:
        """Return the integral (1/m) of the tangents' product / distance, from the nearest azimuth to an edge (rad).

        Points are graded by v = `scale` sinh(t) (rad).

        Notes
        -----
        Derived here. With h the tangent of half the angle from the foot, the squared distance (m2) is gap + four h^2 /
        (1 + h^2). Cosine and sine are rational in h.
        """
        nodes, weights = gauss(8)
        reach = np.arcsinh(edge / scale)
        v = scale * np.sinh(0.5 * reach * (1.0 + nodes))
        jacobian = 0.5 * np.abs(reach) * weights * np.sqrt(v * v + scale * scale)
        half = np.tan(0.5 * (self.angle - v))
        square = half * half
        double = 1.0 / (1.0 + square)
        dot = (self.sine * (1.0 - square) + 2.0 * self.cosine * half) * double
        return np.asarray(np.sum(jacobian * dot / np.sqrt(np.maximum(gap + four * square * double, FLOOR)), axis=3))


SAMPLED: Rule = (np.linspace(0.0, 1.0, SAMPLES), np.ones(SAMPLES))
"""Equally spaced places along an arc (0 start, 1 end), with weights 1, for the estimate of distances."""

METHODS: tuple[tuple[Method, int], ...] = (
    (_sum_concentric_arcs, 14),
    (partial(_sum_opposite_arcs, rule=_gauss_points(MIDDLING_POINTS)), MIDDLING_POINTS**2),
    (partial(_sum_opposite_arcs, rule=_points_near_ends(10)), 100),
    (partial(_sum_opposite_arcs, rule=_gauss_points(SPACED_POINTS)), SPACED_POINTS**2),
    (partial(_sum_other_arcs, rule=_points_near_ends(16)), 128),
    (partial(_sum_other_arcs, rule=_points_near_ends(20)), 160),
)
"""Functions that sum the pairs of arcs that are not far, with the number of points per pair.

The order is the order of the flags that `_pairs_by_method` returns.
"""
