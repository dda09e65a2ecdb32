"""Tracks of straight sides and circular arcs: every filament pair closed or by a few Gauss points, mean distances kept.

A track is cut into strands at the Gauss points of its width; strands are mitred where sides meet at a corner. Pairs
of straight strands are closed (parallel and inclined), an arc meets the closed potential of a straight strand at Gauss
points, concentric arcs need one integral over their difference of azimuth, all other arcs two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.constants import MU0
from sitscad.physics.filaments import inclined_integral, parallel_filaments
from sitscad.physics.mean_distance import gauss, level_heights, strand_clearance

Array = NDArray[np.float64]
Index = NDArray[np.intp]

NEAR = 3.0
"""Distance, in widths, up to which a pair of straight strands gets the finer set of strands."""

ENDS_AND_CORNERS = np.array([
    (0.001, -0.00111, -0.00062, -0.00559, -0.01010, -0.02437), (0.002, -0.00121, -0.00069, -0.00562, -0.01016, -0.02452),
    (0.005, -0.00149, -0.00089, -0.00571, -0.01033, -0.02495), (0.01, -0.00192, -0.00120, -0.00585, -0.01058, -0.02558),
    (0.02, -0.00270, -0.00172, -0.00607, -0.01099, -0.02661), (0.035, -0.00369, -0.00234, -0.00631, -0.01142, -0.02770),
    (0.05, -0.00449, -0.00279, -0.00644, -0.01167, -0.02835), (0.075, -0.00550, -0.00322, -0.00649, -0.01177, -0.02865),
    (0.1, -0.00615, -0.00334, -0.00637, -0.01155, -0.02817), (0.15, -0.00662, -0.00285, -0.00573, -0.01040, -0.02544),
    (0.2, -0.00621, -0.00163, -0.00471, -0.00857, -0.02100), (0.27, -0.00455, 0.00094, -0.00288, -0.00527, -0.01296),
    (0.35, -0.00151, 0.00468, -0.00045, -0.00088, -0.00222), (0.5, 0.00635, 0.01299, 0.00451, 0.00803, 0.01968),
    (0.7, 0.01925, 0.02526, 0.01119, 0.02000, 0.04911), (1.0, 0.04080, 0.04487, 0.02101, 0.03738, 0.09168),
    (1.5, 0.07873, 0.08012, 0.03784, 0.06658, 0.16214), (2.0, 0.11804, 0.11816, 0.05621, 0.09776, 0.23573),
    (3.0, 0.19998, 0.19950, 0.09781, 0.16633, 0.39275),
])  # fmt: skip
"""What strands miss, over thickness / width: two strands at one open end, three at one end and one corner of 45, 60, 90 deg.

In units of mu0/(4 pi) times the width: a corner is alike at every size. Own volume integral over a straight bar and two
arms of sixteen widths (tests/validation); positive where the strands read low.
"""

FAR = 150.0
"""Distance, in widths, from which one filament stands for a straight track: what is left falls with its square."""

THICK = 0.25
"""Thickness over width from which distant sides on two layers are taken at two heights too."""

WIDE = ((1.0, 4), (6.0, 6), (20.0, 8))
"""Width over layer distance, and how many strands near sides above each other get from there on."""

CHUNK = 400
"""Pairs of arcs that are worked on at once."""

BLOCK = 60_000
"""Pairs of sides that are worked on at once: what a processor's cache holds."""

_TURNINGS = np.radians((0.0, 45.0, 60.0, 90.0))

FLOOR = 1e-24
"""Least squared distance over the squared size of the tracks: strands that meet do so without a division by zero."""


@dataclass(frozen=True, eq=False)
class Track:
    """One layer's conductor along its current. Metres and radians.

    Straight sides: `starts`, `ends` (n, 2) and the mitres `before`, `after` (n, 2): how far an end moves per metre of
    offset to the left. Arcs (m, 6): centre x, y, radius, azimuth of the start, direction (+1 counter-clockwise), angle.
    `turnings` (k): the angles by which the track turns at its mitred corners.
    """

    starts: Array
    ends: Array
    before: Array
    after: Array
    arcs: Array
    turnings: Array
    width: float
    thickness: float
    z: float

    def shifted(self, dx: float, dy: float) -> Track:
        """The track moved by (dx, dy) metres."""
        step = np.array([dx, dy])
        arcs = self.arcs + np.array([dx, dy, 0.0, 0.0, 0.0, 0.0])
        return Track(self.starts + step, self.ends + step, self.before, self.after, arcs, self.turnings, self.width,
                     self.thickness, self.z)  # fmt: skip

    def scaled(self, factor: float) -> Track:
        """The track with every length multiplied."""
        arcs = self.arcs * np.array([factor, factor, factor, 1.0, 1.0, 1.0])
        return Track(self.starts * factor, self.ends * factor, self.before, self.after, arcs, self.turnings,
                     self.width * factor, self.thickness * factor, self.z * factor)  # fmt: skip

    def strand(self, offset: float) -> tuple[Array, Array]:
        """Starts and ends (n, 2) of the straight sides moved `offset` metres to the left."""
        return self.starts + offset * self.before, self.ends + offset * self.after


Side = tuple[tuple[float, float], tuple[float, float]]
Bend = tuple[tuple[float, float], float, float, float, float]
"""An arc: centre, radius, azimuth of the start, direction (+1 counter-clockwise), angle."""


def track(pieces: Sequence[Side | Bend], width: float, thickness: float, z: float) -> Track:
    """A track from its pieces in the current's order: (start, end) of a side, or a `Bend`, joined smoothly."""
    sides, arcs, turnings = [], [], []
    for k, piece in enumerate(pieces):
        if len(piece) == 5:
            arcs.append([*piece[0], *piece[1:]])
            continue
        tangent = _tangent(piece)
        previous = pieces[k - 1] if k else piece
        following = pieces[k + 1] if k + 1 < len(pieces) else piece
        before = _tangent(previous) if len(previous) == 2 else tangent
        after = _tangent(following) if len(following) == 2 else tangent
        sides.append([*piece, _mitre(before, tangent), _mitre(tangent, after)])
        if len(following) == 2 and following is not piece:
            turnings.append(math.acos(max(-1.0, min(1.0, float(tangent @ after)))))
    table = np.array(sides, dtype=float).reshape(-1, 4, 2)
    return Track(table[:, 0], table[:, 1], table[:, 2], table[:, 3], np.array(arcs, dtype=float).reshape(-1, 6),
                 np.array(turnings, dtype=float), width, thickness, z)  # fmt: skip


def _tangent(side: Side | Bend) -> Array:
    step = np.subtract(side[1], side[0])
    return np.asarray(step / np.hypot(*step))


def _mitre(one: Array, other: Array) -> Array:
    left, right = np.array([-one[1], one[0]]), np.array([-other[1], other[0]])
    return np.asarray((left + right) / (1.0 + left @ right))


def tracks_mutual_inductance(first: Track, second: Track, strands: tuple[int, int] = (2, 3)) -> float:
    """Mutual inductance (H) of two tracks of equal width (the self one for the same object), uniform current.

    `strands` across the width: for distant pairs of pieces, and for straight ones that nearly touch.
    """
    size = max(float(np.max(np.abs(x), initial=0.0)) for x in (first.starts, first.ends, first.arcs[:, :3]))
    one = first.scaled(1.0 / size)
    other = one if first is second else second.scaled(1.0 / size)
    if len(one.arcs) or len(other.arcs):
        strands = (strands[0], min(strands))
    total = _sides_with_sides(one, other, strands)
    if one is other and strands[1] == 3:
        total += _ends_and_corners(one)
    if len(one.arcs) or len(other.arcs):
        total += _with_arcs(one, other, strands[0])
    return MU0 / (4.0 * math.pi) * size * total


def track_inductance_matrix(tracks: Sequence[Track], strands: tuple[int, int] = (2, 3)) -> Array:
    """Inductance matrix (H) of layers in series; pairs that are alike (same place, or congruent) are computed once."""
    count = len(tracks)
    matrix = np.empty((count, count))
    known: dict[tuple[object, ...], float] = {}
    for i in range(count):
        for j in range(i + 1):
            key = _likeness(tracks[i], tracks[j])
            if key not in known:
                known[key] = tracks_mutual_inductance(tracks[i], tracks[j], strands)
            matrix[i, j] = matrix[j, i] = known[key]
    return matrix


def _likeness(one: Track, other: Track) -> tuple[object, ...]:
    if one is other:
        return (*_shape(one), one.thickness)
    first, second = sorted(((_place(one), one.thickness), (_place(other), other.thickness)))
    return first, second, round(abs(one.z - other.z) / one.width, 9)


def _shape(one: Track) -> tuple[object, ...]:
    # Sides of these lengths at these corners are one track or its mirror image, whichever end they are walked from.
    if len(one.arcs):
        return (_place(one),)
    lengths = np.hypot(*(one.ends - one.starts).T)
    order = slice(None) if lengths[0] >= lengths[-1] else slice(None, None, -1)
    return tuple(np.round(lengths[order] / one.width, 7)), tuple(np.round(one.turnings[order], 9))


def _place(one: Track) -> bytes:
    table = (one.starts, one.ends, one.arcs[:, :3], one.arcs[:, 5:] * one.arcs[:, 4:5] * one.width)
    return b"".join(np.round(x / one.width, 7).tobytes() for x in table)


def _ends_and_corners(one: Track) -> float:
    row = ENDS_AND_CORNERS
    at = [float(np.interp(one.thickness / one.width, row[:, 0], row[:, k])) for k in range(2, 6)]
    corners = np.interp(one.turnings, _TURNINGS, [0.0, *at[1:]])
    return one.width * (2.0 * at[0] * (len(one.starts) > 0) + float(np.sum(corners)))


def _with_arcs(one: Track, other: Track, strands: int) -> float:
    total = 0.0
    for x1, x2, share in _strand_pairs(one.width, other.width, strands, one is other):
        total += share * _arcs_with_arcs(one, other, x1, x2, strands)
        total += share * _arcs_with_sides(one, other, x1, x2, strands)
        total += share * _arcs_with_sides(other, one, x2, x1, strands)
    return total


def _strand_pairs(w1: float, w2: float, count: int, same: bool) -> list[tuple[float, float, float]]:
    nodes, weights = gauss(count)
    return [
        (0.5 * w1 * nodes[a], 0.5 * w2 * nodes[b], 0.25 * weights[a] * weights[b] * (2.0 if same and a != b else 1.0))
        for a in range(count)
        for b in range(a + 1 if same else count)
    ]


@lru_cache(maxsize=256)
def _table(
    height: float, widths: tuple[float, float], thicknesses: tuple[float, float], strands: int, levels: int
) -> tuple[Array, Array]:
    across = 5.0 * max(widths) * np.linspace(0.0, 1.0, 101) ** 1.5
    return across, strand_clearance(across, height, widths, thicknesses, strands, levels)


def _clearance(one: Track, other: Track, strands: int, levels: int = 1) -> tuple[Array, Array]:
    return _table(abs(one.z - other.z), (one.width, other.width), (one.thickness, other.thickness), strands, levels)


# Straight sides


def _sides_with_sides(one: Track, other: Track, strands: tuple[int, int]) -> float:
    if not len(one.starts) or not len(other.starts):
        return 0.0
    rows = max(1, BLOCK // len(other.starts))
    same = one is other
    return math.fsum(
        _block(_rows(one, k, k + rows), _rows(other, k if same else 0, None), strands, same)
        for k in range(0, len(one.starts), rows)
    )


def _levels(one: Track, other: Track, count: int, smooth: bool) -> int:
    # Ends and corners of tracks above each other need both heights; smooth joints with arcs need all pieces alike.
    if one.z == other.z or smooth or count == 1:
        return 1
    return 2 if count > 2 or max(one.thickness, other.thickness) > THICK * min(one.width, other.width) else 1


def _rows(whole: Track, first: int, end: int | None) -> Track:
    part = slice(first, end)
    return Track(whole.starts[part], whole.ends[part], whole.before[part], whole.after[part], whole.arcs[:0],
                 whole.turnings[:0], whole.width, whole.thickness, whole.z)  # fmt: skip


def _block(one: Track, other: Track, strands: tuple[int, int], same: bool) -> float:
    t1, t2 = _unit(one.ends - one.starts), _unit(other.ends - other.starts)
    cosine = t1 @ t2.T
    sine = t1[:, :1] * t2[:, 1] - t1[:, 1:] * t2[:, 0]
    double = np.ones_like(cosine)
    if same:
        double = np.triu(2.0 * double, 1) + np.eye(*cosine.shape)
    parallel = np.abs(sine) < 1e-9
    inclined = ~parallel & (np.abs(cosine) > 1e-9)
    apart = _side_distances(one, other, t1, t2)
    near, far = apart < NEAR * max(one.width, other.width), apart > FAR * max(one.width, other.width)
    total = 0.0
    smooth = strands[1] < 3
    for chosen, count, share in (
        *((near, count, share) for count, share in _near_strands(one, other, strands[1])),
        (~near & ~far, strands[0], 1.0),
        (far, 1, 1.0),
    ):
        chosen = chosen & (double > 0.0)
        levels = _levels(one, other, count, smooth)
        value = _parallel_sides(one, other, t1, double, np.nonzero(chosen & parallel), count, levels)
        pairs = np.nonzero(chosen & inclined)
        direction = double * cosine, sine
        value += _inclined_sides(one, other, direction, apart[pairs], pairs, count, levels, count < strands[0])
        total += share * value
    return total


def _near_strands(one: Track, other: Track, count: int) -> tuple[tuple[int, float], ...]:
    # Corners above each other: each strand more lessens what is missed where the tracks are wide against their distance,
    # so twice the finer sum less the coarser one goes to the limit.
    wide = max(one.width, other.width) / max(abs(one.z - other.z), FLOOR)
    enough = [strands for least, strands in WIDE if wide >= least]
    if count < 3 or one.z == other.z or not enough:
        return ((count, 1.0),)
    return ((enough[-1] + 1, 2.0), (enough[-1], -1.0))


def _unit(steps: Array) -> Array:
    return np.asarray(steps / np.hypot(steps[:, 0], steps[:, 1])[:, None])


def _side_distances(one: Track, other: Track, t1: Array, t2: Array) -> Array:
    # Of two sides that do not cross, one has an end that is nearest; the middles stand for those that do.
    return np.minimum(_points_to_sides(one, other, t2), _points_to_sides(other, one, t1).T)


def _points_to_sides(one: Track, other: Track, t2: Array) -> Array:
    length = np.hypot(*(other.ends - other.starts).T)
    least = np.full((len(one.starts), len(other.starts)), np.inf)
    for points in (one.starts, one.ends, 0.5 * (one.starts + one.ends)):
        dx, dy = points[:, :1] - other.starts[:, 0], points[:, 1:] - other.starts[:, 1]
        along = dx * t2[:, 0] + dy * t2[:, 1]
        across = dx * t2[:, 1] - dy * t2[:, 0]
        beyond = np.maximum(np.maximum(-along, along - length), 0.0)
        least = np.minimum(least, across * across + beyond * beyond)
    return np.sqrt(least)


def _parallel_sides(
    one: Track, other: Track, t1: Array, double: Array, pairs: tuple[Index, ...], count: int, levels: int
) -> float:
    i, j = pairs
    if not i.size:
        return 0.0
    axis, height = t1[i], one.z - other.z
    away = other.starts[j] - one.starts[i]
    lateral = np.abs(axis[:, 0] * away[:, 1] - axis[:, 1] * away[:, 0])
    clearance = np.interp(lateral, *_clearance(one, other, count, levels))
    heights = level_heights(height, (one.thickness, other.thickness), levels)
    total = 0.0
    for x1, x2, share in _strand_pairs(one.width, other.width, count, False):
        (p0, p1), (q0, q1) = one.strand(x1), other.strand(x2)
        to_start, to_end = q0[j] - p0[i], q1[j] - p0[i]
        length = np.sum(axis * (p1 - p0)[i], axis=1)
        start, end = np.sum(axis * to_start, axis=1), np.sum(axis * to_end, axis=1)
        gap = axis[:, 0] * to_start[:, 1] - axis[:, 1] * to_start[:, 0]
        for h in heights:
            value = parallel_filaments(length, start, end, np.maximum(gap**2 + h * h + clearance, FLOOR))
            total += share / levels * float(np.sum(double[i, j] * value))
    return total * 4.0 * math.pi / MU0


def _inclined_sides(
    one: Track,
    other: Track,
    direction: tuple[Array, Array],
    apart: Array,
    pairs: tuple[Index, ...],
    count: int,
    levels: int,
    far: bool,
) -> float:
    i, j = pairs
    if not i.size:
        return 0.0
    t1, t2 = _unit(one.ends - one.starts)[i], _unit(other.ends - other.starts)[j]
    c, s, weight = np.sum(t1 * t2, axis=1), direction[1][i, j], direction[0][i, j]
    # Where tracks of two layers cross, the mean over their thicknesses leaves 1/distance as it is (to fourth order).
    height = abs(one.z - other.z)
    heights = level_heights(height, (one.thickness, other.thickness), levels)
    extra: Array | float = 0.0 if height else np.interp(apart, *_clearance(one, other, count))
    if far:
        # Far apart, the mean over both sections of the harmonic 1/distance: what lies along a side cancels at corners.
        extra = (one.thickness**2 + other.thickness**2 - one.width**2 - other.width**2) / 12.0
    total = 0.0
    for x1, x2, share in _strand_pairs(one.width, other.width, count, False):
        (p0, p1), (q0, q1) = one.strand(x1), other.strand(x2)
        away = q0[j] - p0[i]
        # distances along both axes, from the point where the two lines cross
        u0 = -(away[:, 0] * t2[:, 1] - away[:, 1] * t2[:, 0]) / s
        v0 = -(away[:, 0] * t1[:, 1] - away[:, 1] * t1[:, 0]) / s
        u1 = u0 + np.sum(t1 * (p1 - p0)[i], axis=1)
        v1 = v0 + np.sum(t2 * (q1 - q0)[j], axis=1)
        for h in heights:
            value = inclined_integral(u0, u1, v0, v1, c, np.abs(s), np.maximum(h * h + extra, FLOOR))
            total += share / len(heights) * float(np.sum(weight * value))
    return total


# Arcs


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


def _arcs_with_sides(one: Track, other: Track, x1: float, x2: float, strands: int, points: int = 14) -> float:
    # Arcs of one at Gauss points in the closed potential of the sides of the other.
    if not len(one.arcs) or not len(other.starts):
        return 0.0
    rows = max(1, BLOCK // (points * len(other.starts)))
    return math.fsum(
        _arc_rows_with_sides(one, one.arcs[k : k + rows], other, x1, x2, strands, points)
        for k in range(0, len(one.arcs), rows)
    )


def _arc_rows_with_sides(
    one: Track, arcs: Array, other: Track, x1: float, x2: float, strands: int, points: int
) -> float:
    where, tangent, length = _arc_points(arcs, x1, points)
    start, end = other.strand(x2)
    t = _unit(end - start)
    reach = np.sum((end - start) * t, axis=1)
    dx, dy = where[:, :, :1] - start[:, 0], where[:, :, 1:] - start[:, 1]
    along = dx * t[:, 0] + dy * t[:, 1]
    across = dx * t[:, 1] - dy * t[:, 0]
    ends = np.minimum(np.abs(across[:, 0] + x1 - x2), np.abs(across[:, -1] + x1 - x2))
    clearance = np.interp(ends, *_clearance(one, other, strands))[:, None, :]
    rho = np.sqrt(np.maximum(across**2 + (one.z - other.z) ** 2 + clearance, FLOOR))
    potential = np.arcsinh((reach - along) / rho) + np.arcsinh(along / rho)
    return float(np.sum(potential * (tangent @ t.T) * length[:, :, None]))


def _arcs_with_arcs(one: Track, other: Track, x1: float, x2: float, strands: int) -> float:
    if not len(one.arcs) or not len(other.arcs):
        return 0.0
    a, b = one.arcs, other.arcs
    apart = np.hypot(a[:, None, 0] - b[:, 0], a[:, None, 1] - b[:, 1])
    low = np.where(a[:, 4] > 0, a[:, 3], a[:, 3] - a[:, 5])
    other_low = np.where(b[:, 4] > 0, b[:, 3], b[:, 3] - b[:, 5])
    turn = np.abs(np.remainder(low[:, None] - other_low + math.pi, 2.0 * math.pi) - math.pi)
    concentric = (apart < 1e-9) & (turn < 1e-9) & (np.abs(a[:, None, 5] - b[:, 5]) < 1e-9)
    total = _concentric_arcs(one, other, np.nonzero(concentric), x1, x2, strands)
    opposite = apart > 0.3 * np.maximum(a[:, None, 2], b[:, 2])
    for method, chosen in ((_opposite_arcs, opposite), (_other_arcs, ~concentric & ~opposite)):
        i, j = np.nonzero(chosen)
        for k in range(0, i.size, CHUNK):
            part = slice(k, k + CHUNK)
            total += method(one, other, (i[part], j[part]), x1, x2, strands)
    return total


def _opposite_arcs(
    one: Track, other: Track, pairs: tuple[Index, ...], x1: float, x2: float, strands: int, points: int = 10
) -> float:
    # Arcs about centres well apart meet at most at their ends: points crowded there on both.
    i, j = pairs
    p, t, along = _arc_points(one.arcs, x1, points)
    q, u, other_along = _arc_points(other.arcs, x2, points)
    square = (p[i, :, None, 0] - q[j, None, :, 0]) ** 2 + (p[i, :, None, 1] - q[j, None, :, 1]) ** 2
    height, beside = one.z - other.z, _clearance(one, other, strands)[1][0]
    dot = np.einsum("kna,kma->knm", t[i], u[j])
    value = dot / np.sqrt(np.maximum(square + height * height + beside, FLOOR))
    return float(np.einsum("knm,kn,km->", value, along[i], other_along[j]))


def _concentric_arcs(
    one: Track, other: Track, pairs: tuple[Index, ...], x1: float, x2: float, strands: int, points: int = 14
) -> float:
    # Only the difference of azimuth v matters: (angle - v) is how much of the arcs has it.
    i, j = pairs
    if not i.size:
        return 0.0
    a, b = one.arcs[i], other.arcs[j]
    r1, r2, angle = a[:, 2] - a[:, 4] * x1, b[:, 2] - b[:, 4] * x2, a[:, 5, None]
    clearance = np.interp(np.abs(a[:, 2] - b[:, 2]), *_clearance(one, other, strands))
    square = np.maximum((r1 - r2) ** 2 + (one.z - other.z) ** 2 + clearance, FLOOR)[:, None]
    product = (r1 * r2)[:, None]
    nodes, weights = gauss(points)
    scale = np.sqrt(square / product)
    reach = np.arcsinh(angle / scale)
    v = scale * np.sinh(0.5 * reach * (1.0 + nodes))
    jacobian = 0.5 * reach * weights * np.sqrt(v * v + scale * scale)
    kernel = product * np.cos(v) / np.sqrt(square + 4.0 * product * np.sin(0.5 * v) ** 2)
    return float(np.sum((a[:, 4] * b[:, 4])[:, None] * 2.0 * jacobian * (angle - v) * kernel))


def _other_arcs(
    one: Track, other: Track, pairs: tuple[Index, ...], x1: float, x2: float, strands: int, points: int = 20
) -> float:
    i, j = pairs
    if not i.size:
        return 0.0
    where, tangent, length = _arc_points(one.arcs, x1, points)
    b = other.arcs[j]
    height, radius = one.z - other.z, (b[:, 2] - b[:, 4] * x2)[:, None]
    away = where[i] - b[:, None, :2]
    distance = np.hypot(away[..., 0], away[..., 1])
    offset = b[:, 4, None] * (np.arctan2(away[..., 1], away[..., 0]) - b[:, 3, None]) % (2.0 * math.pi)
    span = b[:, 5, None]
    nearest = np.where(offset <= span, offset, np.where(offset - span < 2.0 * math.pi - offset, span, 0.0))
    clearance = np.interp(np.abs(distance - radius), *_clearance(one, other, strands))
    extra = height**2 + clearance
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
