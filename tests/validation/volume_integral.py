"""A slow integral over the volumes of the conductors: the yardstick of every fast method, for lines, arcs and spirals.

Uniform current density over the real, rectangular cross-section: the sum over all pairs of filaments (offsets across
the width and through the thickness) of Neumann's integral along them. Filaments run parallel to the centre line along
its normal and are mitred at corners. Nothing comes from the fast methods: no mean distance, no closed form for pairs of
segments, no elliptic integral. Only the vector potential of one straight filament is closed (two asinh); everything
else is Gauss points, crowded where pieces come near. `fine` multiplies every number of points: convergence is shown by
raising it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from sheet_integral import sides_mutual

MU0_4PI = 1e-7

LEAST_CROWDING = 1e-2
"""Angle (rad) about a curved filament's nearest point within which its points are not crowded further."""


@dataclass(frozen=True)
class Conductor:
    """Pieces of one track along its current; all arrays have one row a piece.

    Straight ones: `starts`, `ends` (n, 2) and mitres `before`, `after` (n, 2), by which an end moves per metre of
    offset to the left. Curved ones: `polar` (m, 7) = centre x, y, radius at the start, fall of the radius per radian,
    azimuth at the start, direction (+1 counter-clockwise), angle run through.
    """

    starts: np.ndarray
    ends: np.ndarray
    before: np.ndarray
    after: np.ndarray
    polar: np.ndarray
    width: float
    thickness: float
    z: float


@lru_cache(maxsize=64)
def rule(count):
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (1.0 + nodes), 0.5 * weights


def crowded(count):
    """Gauss points of [0, 1] crowded towards both ends by x = t^3 (10 - 15 t + 6 t^2), exact for polynomials."""
    t, weights = rule(count)
    return t**3 * (10.0 - 15.0 * t + 6.0 * t * t), weights * 30.0 * (t * (1.0 - t)) ** 2


def conductor(segments, width, thickness, z):
    """From ("line", start, end) and ("arc", centre, radius, azimuth, direction, angle[, fall]), along the current."""
    ends = [_tangents(segment) for segment in segments]
    starts, stops, before, after, polar = [], [], [], [], []
    for k, segment in enumerate(segments):
        if segment[0] == "arc":
            centre, radius, azimuth, direction, angle, *fall = segment[1:]
            polar.append([*centre, radius, fall[0] if fall else 0.0, azimuth, direction, angle])
            continue
        here = ends[k][0]
        starts.append(segment[1])
        stops.append(segment[2])
        before.append(_mitre(ends[k - 1][1] if k else here, here))
        after.append(_mitre(here, ends[k + 1][0] if k + 1 < len(segments) else here))
    rows = [np.array(x, dtype=float).reshape(-1, 2) for x in (starts, stops, before, after)]
    return Conductor(*rows, np.array(polar, dtype=float).reshape(-1, 7), width, thickness, z)


def _tangents(segment):
    if segment[0] == "line":
        t = np.subtract(segment[2], segment[1])
        t = t / np.hypot(*t)
        return t, t
    _, _, radius, azimuth, direction, angle, *fall = segment
    fall = fall[0] if fall else 0.0
    result = []
    for a, r in ((azimuth, radius), (azimuth + direction * angle, radius - fall * angle)):
        t = np.array(
            [-fall * math.cos(a) - direction * r * math.sin(a), -fall * math.sin(a) + direction * r * math.cos(a)]
        )
        result.append(t / np.hypot(*t))
    return result[0], result[1]


def _mitre(one, other):
    n1, n2 = np.array([-one[1], one[0]]), np.array([-other[1], other[0]])
    return (n1 + n2) / (1.0 + float(n1 @ n2))


def spiral(layer, pieces=4):
    """A SpiralLayer as pieces of 1/`pieces` of a turn, walked in the current's direction."""
    count = max(2, math.ceil(pieces * layer.turns - 1e-9))
    step, fall = layer.span / count, layer.pitch / (2.0 * math.pi)
    segments = []
    for k in range(count):
        if layer.inward:
            theta = k * step
            segments.append(("arc", (0.0, 0.0), layer.radius - fall * theta, layer.angle + layer.sense * theta,
                             layer.sense, step, fall))
        else:
            theta = layer.span - k * step
            segments.append(("arc", (0.0, 0.0), layer.radius - fall * theta, layer.angle + layer.sense * theta,
                             -layer.sense, step, -fall))
    return conductor(segments, layer.width, layer.thickness, layer.z)


def _line_points(c, index, offset, s):
    """Points (k, n, 2) and elements at fractions s (k, n) of the pieces `index` (k)."""
    p = c.starts[index] + offset[:, None] * c.before[index]
    step = c.ends[index] + offset[:, None] * c.after[index] - p
    return p[:, None, :] + s[..., None] * step[:, None, :], np.broadcast_to(step[:, None, :], (*s.shape, 2))


def _polar_points(rows, offset, tau):
    """Points and derivatives (k, n, 2) at angles tau (k, n) of curved pieces (k, 7), `offset` (k) to the left."""
    offset = offset[:, None]
    cx, cy, radius, fall, azimuth, direction = (rows[:, i, None] for i in range(6))
    r, a = radius - fall * tau, azimuth + direction * tau
    cosine, sine = np.cos(a), np.sin(a)
    tx, ty = -fall * cosine - direction * r * sine, -fall * sine + direction * r * cosine
    speed = np.sqrt(fall * fall + r * r)
    shrink = 1.0 - offset * direction * (r * r + 2.0 * fall * fall) / speed**3
    x = cx + r * cosine - offset * ty / speed
    y = cy + r * sine + offset * tx / speed
    return np.stack([x, y], -1), np.stack([tx * shrink, ty * shrink], -1)


def _points(c, index, offset, s):
    """Pieces are numbered straight ones first."""
    lines = len(c.starts)
    point, element = np.empty((*s.shape, 2)), np.empty((*s.shape, 2))
    straight = index < lines
    if straight.any():
        point[straight], element[straight] = _line_points(c, index[straight], offset[straight], s[straight])
    if not straight.all():
        rows = c.polar[index[~straight] - lines]
        span = rows[:, 6, None]
        point[~straight], element[~straight] = _polar_points(rows, offset[~straight], s[~straight] * span)
        element[~straight] *= span[..., None]
    return point, element


def _potential(c, index, offset, point, dz, count):
    """Vector potential (k, n, 2) over mu0/(4 pi) of the filament of piece index[k] at points (k, n, 2), dz above."""
    lines = len(c.starts)
    result = np.empty_like(point)
    straight = index < lines
    if straight.any():
        p, q, x, h = index[straight], point[straight], offset[straight, None], dz[straight, None]
        a = c.starts[p] + x * c.before[p]
        b = c.ends[p] + x * c.after[p]
        t = b - a
        length = np.hypot(t[:, 0], t[:, 1])
        t = t / length[:, None]
        away = q - a[:, None, :]
        along = np.sum(away * t[:, None, :], -1)
        across = away[..., 1] * t[:, None, 0] - away[..., 0] * t[:, None, 1]
        rho = np.sqrt(across**2 + h * h + 1e-40)
        value = np.arcsinh((length[:, None] - along) / rho) + np.arcsinh(along / rho)
        result[straight] = value[..., None] * t[:, None, :]
    if not straight.all():
        rows = c.polar[index[~straight] - lines]
        result[~straight] = _curved_potential(rows, offset[~straight], point[~straight], dz[~straight], count)
    return result


def _curved_potential(rows, offset, point, dz, count):
    """As `_potential` for curved pieces: the straight filament that touches closed, the difference by points."""
    dx, dy = point[..., 0] - rows[:, None, 0], point[..., 1] - rows[:, None, 1]
    span = rows[:, 6, None]
    before = 0.5 * (2.0 * math.pi - span)
    foot = (rows[:, 5, None] * (np.arctan2(dy, dx) - rows[:, 4, None]) + before) % (2.0 * math.pi) - before
    for _ in range(2):
        nearest, tangent = _polar_points(rows, offset, foot)
        square = np.sum(tangent * tangent, -1)
        step = np.sum((point - nearest) * tangent, -1) / square
        foot = foot + np.where(np.abs(step) < 0.1, step, 0.0)
    nearest, tangent = _polar_points(rows, offset, foot)
    speed = np.sqrt(np.sum(tangent * tangent, -1))
    scale = np.sqrt(np.sum((nearest - point) ** 2, -1) + dz[:, None] ** 2 + 1e-30) / speed
    closed = (np.arcsinh((span - foot) / scale) + np.arcsinh(foot / scale)) / speed
    total = closed[..., None] * tangent
    t, weights = rule(count)
    split = np.clip(foot, 0.0, span)
    # crowded about the nearest point by a sinh, for what is left goes as distance / angle^2 away from it
    crowding = np.maximum(scale, LEAST_CROWDING)[..., None]
    for edge in (np.zeros_like(foot), np.broadcast_to(span, foot.shape)):
        reach = np.arcsinh((edge - split)[..., None] / crowding)
        tau = split[..., None] + crowding * np.sinh(reach * t)
        jacobian = np.abs(reach) * crowding * np.cosh(reach * t) * weights
        where, element = _polar_points(rows, offset, tau.reshape(len(rows), -1))
        where, element = where.reshape(*tau.shape, 2), element.reshape(*tau.shape, 2)
        distance = np.sqrt(np.sum((where - point[..., None, :]) ** 2, -1) + dz[:, None, None] ** 2 + 1e-30)
        straight = speed[..., None] * np.hypot(tau - foot[..., None], scale[..., None])
        total += np.sum(
            jacobian[..., None] * (element / distance[..., None] - tangent[..., None, :] / straight[..., None]), -2
        )
    return total


def _crossing(a, i, x1, b, j, x2):
    """Fraction of piece i of a at which piece j of b crosses it; 0 where it does not, or one alone is curved."""
    s = np.zeros(i.shape)
    curved = (i >= len(a.starts)) & (j >= len(b.starts))
    if curved.any():
        item, other = a.polar[i[curved] - len(a.starts)], b.polar[j[curved] - len(b.starts)]
        s[curved] = _curves_cross(item, x1[curved], other, x2[curved])
    both = (i < len(a.starts)) & (j < len(b.starts))
    p, q = i[both], j[both]
    d, e = a.ends[p] - a.starts[p], b.ends[q] - b.starts[q]
    away = b.starts[q] - a.starts[p]
    cross = d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]
    wide = np.abs(cross) > 1e-6 * np.hypot(*d.T) * np.hypot(*e.T)
    s[both] = np.where(wide, (away[:, 0] * e[:, 1] - away[:, 1] * e[:, 0]) / np.where(wide, cross, 1.0), 0.0)
    return s


def _curves_cross(one, x1, other, x2, samples=9):
    """Fraction of each curved piece at which its strand's distance from the other's strand changes sign; 0 if never."""
    s = np.linspace(0.0, 1.0, samples)
    where, _ = _polar_points(one, x1, one[:, 6, None] * s)
    dx, dy = where[..., 0] - other[:, None, 0], where[..., 1] - other[:, None, 1]
    span = other[:, 6, None]
    before = 0.5 * (2.0 * math.pi - span)
    tau = (other[:, 5, None] * (np.arctan2(dy, dx) - other[:, 4, None]) + before) % (2.0 * math.pi) - before
    gap = np.hypot(dx, dy) - (other[:, 2, None] - other[:, 3, None] * tau - other[:, 5, None] * x2[:, None])
    changes = (gap[:, 1:] * gap[:, :-1] < 0.0) & (tau[:, 1:] > -0.2) & (tau[:, 1:] < span + 0.2)
    first = np.argmax(changes, axis=1)
    row = np.arange(len(one))
    low, high = gap[row, first], gap[row, first + 1]
    at = (first + low / np.where(low == high, 1.0, low - high)) / (samples - 1)
    return np.where(changes.any(axis=1), at, 0.0)


def _foot(a, i, point):
    """Fraction (k) of piece i of a at which it passes the points (k, 2), beyond 0 and 1 where it does not."""
    s, lines = np.zeros(i.shape), len(a.starts)
    straight = i < lines
    start, step = a.starts[i[straight]], a.ends[i[straight]] - a.starts[i[straight]]
    s[straight] = np.sum((point[straight] - start) * step, -1) / np.sum(step * step, -1)
    rows = a.polar[i[~straight] - lines]
    away = point[~straight] - rows[:, :2]
    s[~straight] = rows[:, 5] * (np.arctan2(away[:, 1], away[:, 0]) - rows[:, 4]) % (2.0 * math.pi) / rows[:, 6]
    return s


def _graded_sum(a, i, b, j, section, outer, inner, chunk=60_000):
    """Sum over pairs (i, j) and the filaments of `section` of Neumann's integral, the inner one for every point.

    The outer one is cut where it passes an end of the inner piece or crosses it, and crowded towards every cut.
    """
    rows = max(1, chunk // (4 * outer * (1 if not len(b.polar) else 8)))
    x1, x2, dz, weight = (np.tile(column, len(i)) for column in np.array(section).T)
    i, j = np.repeat(i, len(section)), np.repeat(j, len(section))
    total = 0.0
    for k in range(0, len(i), rows):
        part = slice(k, k + rows)
        total += _graded_part(a, i[part], b, j[part], x1[part], x2[part], dz[part], weight[part], outer, inner)
    return total


def _graded_part(a, i, b, j, x1, x2, dz, weight, outer, inner):
    t, weights = crowded(outer)
    ends, _ = _points(b, j, x2, np.broadcast_to(np.array([0.0, 1.0]), (len(j), 2)))
    cuts = np.stack([_foot(a, i, ends[:, 0]), _foot(a, i, ends[:, 1]), _crossing(a, i, x1, b, j, x2)], axis=1)
    edges = np.sort(np.clip(cuts, 0.0, 1.0), axis=1)
    edges = np.concatenate([np.zeros((len(i), 1)), edges, np.ones((len(i), 1))], axis=1)
    low, high = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    stored = high - low > 1e-12
    pair = np.repeat(np.arange(len(i)), 4)[stored]
    low, step = low[stored, None], (high - low)[stored, None]
    point, element = _points(a, i[pair], x1[pair], low + step * t)
    potential = _potential(b, j[pair], x2[pair], point, dz[pair], inner)
    return float(np.sum(weight[pair, None] * step * weights * np.sum(element * potential, -1)))


def _plain_sum(a, b, far, x1, x2, dz, count):
    """Sum over the pairs of `far` (na, nb) of plain Gauss points on both pieces."""
    t, weights = rule(count)
    na, nb = far.shape
    item, d1 = _points(a, np.arange(na), np.full(na, x1), np.broadcast_to(t, (na, count)))
    two, d2 = _points(b, np.arange(nb), np.full(nb, x2), np.broadcast_to(t, (nb, count)))
    d1, d2 = d1 * weights[:, None], d2 * weights[:, None]
    two, d2 = two.reshape(-1, 2), d2.reshape(-1, 2)
    total = 0.0
    for k in range(na):
        columns = np.repeat(far[k], count)
        if columns.any():
            q, e = two[columns], d2[columns]
            square = (item[k][:, None, 0] - q[:, 0]) ** 2 + (item[k][:, None, 1] - q[:, 1]) ** 2 + dz * dz
            total += float(np.sum((d1[k] @ e.T) / np.sqrt(square)))
    return total


def _distances(a, b, samples=25):
    """Roughly the least distance of every two pieces (never above it by much), and the longer one's length."""
    s = np.linspace(0.0, 1.0, samples)
    na, nb = len(a.starts) + len(a.polar), len(b.starts) + len(b.polar)
    item, d1 = _points(a, np.arange(na), np.zeros(na), np.broadcast_to(s, (na, samples)))
    two, d2 = _points(b, np.arange(nb), np.zeros(nb), np.broadcast_to(s, (nb, samples)))
    long1, long2 = np.hypot(d1[:, 0, 0], d1[:, 0, 1]), np.hypot(d2[:, 0, 0], d2[:, 0, 1])
    flat = two.reshape(-1, 2)
    least = np.empty((na, nb))
    for k in range(na):
        square = (item[k][:, None, 0] - flat[:, 0]) ** 2 + (item[k][:, None, 1] - flat[:, 1]) ** 2
        least[k] = np.sqrt(square.reshape(samples, nb, samples).min(axis=(0, 2)))
    slack = 0.5 / (samples - 1) * np.minimum(long1[:, None], long2[None, :])
    # along parallel pieces a sample stands beside a piece of the other: at most half a step away along it
    true = np.sqrt(np.maximum(least**2 - slack**2, 0.0)) if samples > 2 else least
    return true, np.maximum(long1[:, None], long2[None, :])


def _section(width, t1, t2, dz, across, through, mean):
    """(offset 1, offset 2, height, weight) of the filament pairs of two rectangles; weights sum to 1."""
    x, wx = rule(mean)
    if dz == 0.0 and t1 == t2 and t1 > 0.0:
        apart = _touching(width, t1, across, through)
    else:
        # over each other, the mean bends where the filaments have moved aside by about their distance; two heights do
        least = max(dz - 0.5 * (t1 + t2), 0.02 * max(dz, t1, t2))
        reach = math.asinh(width / least)
        s, ws = rule(across + round(reach))
        aside, slope = least * np.sinh(reach * s) / width, least * np.cosh(reach * s) * reach / width
        heights = _heights(t1, t2, dz, 2)
        apart = [
            (width * u, h, 2.0 * (1.0 - u) * w1 * w2)
            for u, w1 in zip(aside, slope * ws, strict=True)
            for h, w2 in heights
        ]
    result = []
    for d, h, w1 in apart:
        for side in (-1.0, 1.0):
            for m, w2 in zip(x, wx, strict=True):
                middle = (m - 0.5) * (width - d)
                result.append((middle + 0.5 * side * d, middle - 0.5 * side * d, h, 0.5 * w1 * w2))
    return result


def _touching(width, thickness, across, through):
    """(distance across, height, weight) for one rectangle with itself: two triangles that meet where both vanish."""
    s, ws = rule(across)
    v, wv = rule(through)
    reach = math.asinh(width / thickness)
    x, wx = rule(through + math.ceil(reach))
    sloped, wsloped = thickness / width * np.sinh(reach * x), wx * reach * thickness / width * np.cosh(reach * x)
    result = []
    for u, w1 in zip(s * s, 2.0 * s * ws, strict=True):
        points = [(u, u * y, w) for y, w in zip(v, wv, strict=True)]
        points += [(u * y, u, w) for y, w in zip(sloped, wsloped, strict=True)]
        result += [(width * d, thickness * z, 4.0 * (1.0 - d) * (1.0 - z) * u * w1 * w) for d, z, w in points]
    return result


def _heights(t1, t2, dz, count):
    """Heights between filaments of two rectangles, with weights: the density of a difference is a trapezium."""
    outer, inner = 0.5 * (t1 + t2), 0.5 * abs(t1 - t2)
    if outer == 0.0:
        return [(abs(dz), 1.0)]
    s, ws = rule(count)
    result = []
    if dz == 0.0 and inner < 1e-12 * outer:
        return [(outer * u**3, 3.0 * u * u * w * 2.0 * (1.0 - u**3)) for u, w in zip(s, ws, strict=True)]
    edges = [-outer, -inner, inner, outer]
    for low, high in pairwise(edges):
        if high - low > 1e-12 * outer:
            for u, w in zip(s, ws, strict=True):
                zeta = low + (high - low) * u
                density = min(1.0, (outer - abs(zeta)) / (outer - inner)) if outer > inner else 1.0
                result.append((abs(dz + zeta), w * (high - low) * density / (outer + inner)))
    return result


def _strands(a, b, count, through):
    s, w = rule(count)
    heights = _heights_gauss(a.thickness, b.thickness, a.z - b.z, through)
    return [
        ((s[p] - 0.5) * a.width, (s[q] - 0.5) * b.width, h, w[p] * w[q] * share)
        for p in range(count)
        for q in range(count)
        for h, share in heights
    ]


def _heights_gauss(t1, t2, dz, count):
    """Product Gauss points through both thicknesses, equal heights joined."""
    s, w = rule(count)
    joined = {}
    for p in range(count):
        for q in range(count):
            h = abs(dz + (s[p] - 0.5) * t1 - (s[q] - 0.5) * t2)
            key = round(h / (abs(dz) + t1 + t2 + 1e-30), 12)
            joined[key] = (h, joined.get(key, (h, 0.0))[1] + w[p] * w[q])
    return list(joined.values())


@dataclass(frozen=True)
class Points:
    """Numbers of Gauss points. Pairs of pieces are far (plain points on both), mid (graded along, few filaments) or
    near; near straight ones are integrated around their outlines (`outline` points an edge and panel, `levels`
    heights), of curved ones those beside each other with `beside` filaments, the others over the whole section."""

    far: int = 6
    along: int = 12
    inner: int = 9
    filaments: int = 3
    beside: int = 4
    across: int = 9
    through: int = 3
    mean: int = 2
    outline: int = 16
    levels: int = 6


def mutual(a: Conductor, b: Conductor, n: Points = Points()) -> float:
    """Mutual inductance (H) of two conductors by integration over their volumes; the self one for a with itself."""
    flat, longest = _distances(a, b)
    every = np.ones(flat.shape, dtype=bool)
    if a is not b:
        return MU0_4PI * _pairs(a, b, every, flat, longest, n)
    return MU0_4PI * (2.0 * _pairs(a, a, np.triu(every, 1), flat, longest, n)
                      + _pairs(a, a, np.eye(len(flat), dtype=bool), flat, longest, n))


def _pairs(a, b, chosen, flat, longest, n):
    dz, size = abs(a.z - b.z), max(a.width, b.width, a.thickness, b.thickness)
    apart = np.hypot(flat, dz)
    far = (apart > 1.0 * longest) & (apart > 4.0 * size)
    near = ~far & (apart <= 4.0 * size) & chosen
    mid, far = ~far & (apart > 4.0 * size) & chosen, far & chosen
    straight = np.zeros_like(near)
    straight[: len(a.starts), : len(b.starts)] = True
    beside = near & ~straight & (apart > 1.2 * size)
    total = _straight_pairs(a, b, near & straight, dz, n)
    few, distant = _strands(a, b, n.filaments, 2), far & (apart > 20.0 * size)
    for pairs, section in ((far & ~distant, few), (distant, _strands(a, b, n.filaments - 1, 2))):
        for x1, x2, h, weight in section if pairs.any() else ():
            total += weight * _plain_sum(a, b, pairs, x1, x2, h, n.far)
    for selected, section in (
        (mid, few),
        (beside, _strands(a, b, n.beside, 2)),
        (near & ~straight & ~beside, _section(a.width, a.thickness, b.thickness, dz, n.across, n.through, n.mean)),
    ):
        # points along the arc where the other piece is straight, for that one's potential is closed
        turned = selected & (np.arange(len(flat))[:, None] < len(a.starts))
        i, j = np.nonzero(selected & ~turned)
        total += _graded_sum(a, i, b, j, section, n.along, n.inner)
        i, j = np.nonzero(turned)
        total += _graded_sum(b, j, a, i, [(x2, x1, h, w) for x1, x2, h, w in section], n.along, n.inner)
    return total


def _straight_pairs(a, b, selected, dz, n):
    i, j = np.nonzero(selected)
    if not i.size:
        return 0.0
    heights = _heights(a.thickness, b.thickness, dz, n.levels if dz == 0.0 else 3)
    (p, t), (q, u) = _outlines(a), _outlines(b)
    return sides_mutual((p[i], t[i], a.width), (q[j], u[j], b.width), heights, n.outline, crowded)


def _outlines(c):
    """Corners (n, 4, 2) of the straight pieces, counter-clockwise from the right start, and their directions (n, 2)."""
    half, t = 0.5 * c.width, c.ends - c.starts
    corners = [c.starts - half * c.before, c.ends - half * c.after, c.ends + half * c.after, c.starts + half * c.before]
    return np.stack(corners, axis=1), t / np.hypot(*t.T)[:, None]


def winding(conductors: list[Conductor], n: Points = Points()) -> float:
    """Inductance (H) of conductors in series."""
    return sum(
        (1.0 if i == j else 2.0) * mutual(conductors[i], conductors[j], n)
        for i in range(len(conductors))
        for j in range(i + 1)
    )
