"""Straight sides of tracks with straight sides: filament pairs in closed form, their mean distances kept.

Strands and heights are as many as a pair's distance asks for. What the nearest still miss at open ends and at corners
is alike at every size, so it is a table.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.constants import MU0
from sitscad.physics.inductance.filaments import inclined_integral, parallel_filaments
from sitscad.physics.inductance.track_strands import (
    BLOCK,
    FLOOR,
    Track,
    bundle,
    clearance_table,
    common_levels,
    directions,
)

Array = NDArray[np.float64]
Index = NDArray[np.intp]

NEAR = 3.0
"""Distance, in widths, up to which a pair of straight strands gets the finer set of strands."""

ENDS_AND_CORNERS = np.array([
    (0.001, -0.00111, -0.00062, -0.00559, -0.0101, -0.02437), (0.002, -0.00121, -0.00069, -0.00562, -0.01016, -0.02452),
    (0.005, -0.00149, -0.00089, -0.00571, -0.01033, -0.02495), (0.01, -0.00192, -0.0012, -0.00585, -0.01058, -0.02558),
    (0.02, -0.00270, -0.00172, -0.00607, -0.01099, -0.02661), (0.035, -0.00369, -0.00234, -0.00631, -0.01142, -0.0277),
    (0.05, -0.00449, -0.00279, -0.00644, -0.01167, -0.02835), (0.075, -0.00550, -0.00322, -0.00649, -0.01177, -0.02865),
    (0.1, -0.00615, -0.00334, -0.00637, -0.01155, -0.02817), (0.15, -0.00662, -0.00285, -0.00573, -0.01040, -0.02544),
    (0.2, -0.00621, -0.00163, -0.00471, -0.00857, -0.02100), (0.27, -0.00455, 0.00094, -0.00288, -0.00527, -0.01296),
    (0.35, -0.00151, 0.00468, -0.00045, -0.00088, -0.00222), (0.5, 0.00635, 0.01299, 0.00451, 0.00803, 0.01968),
    (0.7, 0.01925, 0.02526, 0.01119, 0.02000, 0.04911), (1.0, 0.04080, 0.04487, 0.02101, 0.03738, 0.09168),
    (1.5, 0.07873, 0.08012, 0.03784, 0.06658, 0.16214), (2.0, 0.11804, 0.11816, 0.05621, 0.09776, 0.23573),
    (3.0, 0.19998, 0.19950, 0.09781, 0.16633, 0.39275),
])  # fmt: skip
"""What strands miss, over thickness / width: two at one open end, three at one end and one corner of 45, 60, 90 deg.

In units of mu0/(4 pi) times the width: a corner is alike at every size. Own volume integral over a straight bar and two
arms of sixteen widths (tests/validation); positive where the strands read low.
"""

FAR = 150.0
"""Distance, in widths, from which one filament stands for a straight track: what is left falls with its square."""

EVEN = 1300.0
"""Squared distance, in the height between two layers times the spread of the heights through their copper, from which
both heights of thick tracks are taken as one."""

WIDE = ((1.0, 4), (6.0, 6), (20.0, 8))
"""Width over layer distance, and how many strands near sides above each other get from there on."""

_TURNINGS = np.radians((0.0, 45.0, 60.0, 90.0))


def sides_with_sides(one: Track, other: Track, strands: tuple[int, int], smooth: bool = False) -> float:
    """Integral of t1.t2 / distance (m) over all sides of two tracks, half of it counted twice for the same object.

    `strands` across the width: for distant pairs of sides, and for those that nearly touch. In a `smooth` track, whose
    sides continue in arcs, all have the first number, and one height as the arcs have.
    """
    if not len(one.starts) or not len(other.starts):
        return 0.0
    rows = max(1, BLOCK // len(other.starts))
    same = one is other
    return math.fsum(
        _block(_rows(one, k, k + rows), _rows(other, k if same else 0, None), strands, same, smooth)
        for k in range(0, len(one.starts), rows)
    )


def _levels(one: Track, other: Track, count: int, smooth: bool) -> int:
    # Ends and corners of tracks above each other need both heights; smooth joints with arcs need all pieces alike.
    if count > 2 and not smooth:
        return 1 if one.z == other.z else 2
    return common_levels(one, other, count)


def _rows(whole: Track, first: int, end: int | None) -> Track:
    part = slice(first, end)
    return Track(whole.starts[part], whole.ends[part], whole.before[part], whole.after[part], whole.arcs[:0],
                 whole.turnings[:0], whole.width, whole.thickness, whole.z)  # fmt: skip


def _block(one: Track, other: Track, strands: tuple[int, int], same: bool, smooth: bool) -> float:
    t1, t2 = directions(one.ends - one.starts), directions(other.ends - other.starts)
    cosine = t1 @ t2.T
    sine = t1[:, :1] * t2[:, 1] - t1[:, 1:] * t2[:, 0]
    double = np.ones_like(cosine)
    if same:
        double = np.triu(2.0 * double, 1) + np.eye(*cosine.shape)
    parallel = np.abs(sine) < 1e-9
    inclined = ~parallel & (np.abs(cosine) > 1e-9)
    apart = _side_distances(one, other, t1, t2)
    near, far = apart < NEAR * max(one.width, other.width), apart > FAR * max(one.width, other.width)
    # Both heights of two layers act as one, that of their mean square, where that is right to a millionth.
    usual, spread = _levels(one, other, strands[0], smooth), (one.thickness**2 + other.thickness**2) / 12.0
    is_even = smooth and usual == 2
    even = ~near & ~far & (apart**2 > EVEN * abs(one.z - other.z) * math.sqrt(spread)) & is_even
    total = 0.0
    for chosen, count, share, levels, more in (
        *((near, count, share, _levels(one, other, count, smooth), 0.0)
          for count, share in _near_strands(one, other, strands, smooth)),
        (~near & ~far & ~even, strands[0], 1.0, usual, 0.0),
        (even, strands[0], 1.0, 1, spread),
        (far, 1, 1.0, _levels(one, other, 1, smooth), 0.0),
    ):  # fmt: skip
        chosen = chosen & (double > 0.0)
        value = _parallel_sides(one, other, t1, double, np.nonzero(chosen & parallel), count, levels)
        pairs = np.nonzero(chosen & inclined)
        direction = double * cosine, sine
        value += _inclined_sides(one, other, direction, apart[pairs], pairs, count, levels, count < strands[0], more)
        total += share * value
    return total


def _near_strands(one: Track, other: Track, strands: tuple[int, int], smooth: bool) -> tuple[tuple[int, float], ...]:
    # Corners above each other: each strand more lessens what is missed where the tracks are wide against their
    # distance, so twice the finer sum less the coarser one goes to the limit.
    wide = max(one.width, other.width) / max(abs(one.z - other.z), FLOOR)
    enough = [strands for least, strands in WIDE if wide >= least]
    if smooth or strands[1] < 3 or one.z == other.z or not enough:
        return ((strands[0] if smooth else strands[1], 1.0),)
    return ((enough[-1] + 1, 2.0), (enough[-1], -1.0))


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
    away = other.starts[j] - one.starts[i]
    lateral = np.abs(t1[i, 0] * away[:, 1] - t1[i, 1] * away[:, 0])
    clearance = np.interp(lateral, *clearance_table(one, other, count, levels))[:, None, None]
    strands = bundle(one, other, count, levels)
    total = 0.0
    for part in strands.blocks(i.size):
        (p0, p1), (q0, q1) = strands.ends(one, i[part], 0), strands.ends(other, j[part], 1)
        axis = t1[i[part], None, :]
        to_start, to_end = q0 - p0, q1 - p0
        length, start, end = (np.sum(axis * x, axis=2)[..., None] for x in (p1 - p0, to_start, to_end))
        gap = (axis[..., 0] * to_start[..., 1] - axis[..., 1] * to_start[..., 0])[..., None]
        square = np.maximum(gap**2 + strands.heights**2 + clearance[part], FLOOR)
        value = parallel_filaments(length, start, end, square)
        total += strands.mean(value, double[i[part], j[part]])
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
    more: float,
) -> float:
    # `more` (m2) is what the square of the height lacks of the mean square.
    i, j = pairs
    own, others = directions(one.ends - one.starts), directions(other.ends - other.starts)
    # Where tracks of two layers cross, the mean over their thicknesses leaves 1/distance as it is (to fourth order).
    extra = np.zeros(i.size) if one.z != other.z else np.interp(apart, *clearance_table(one, other, count))
    if far:
        # Far apart, the mean over both sections of the harmonic 1/distance: what lies along a side cancels at corners.
        extra[:] = (one.thickness**2 + other.thickness**2 - one.width**2 - other.width**2) / 12.0
    extra += more
    strands = bundle(one, other, count, levels)
    total = 0.0
    for part in strands.blocks(i.size):
        (p0, p1), (q0, q1) = strands.ends(one, i[part], 0), strands.ends(other, j[part], 1)
        t1, t2 = own[i[part], None, :], others[j[part], None, :]
        c, s = np.sum(t1 * t2, axis=2), direction[1][i[part], j[part]][:, None]
        away = q0 - p0
        # distances along both axes, from the point where the two lines cross
        u0 = -(away[..., 0] * t2[..., 1] - away[..., 1] * t2[..., 0]) / s
        v0 = -(away[..., 0] * t1[..., 1] - away[..., 1] * t1[..., 0]) / s
        u1, v1 = u0 + np.sum(t1 * (p1 - p0), axis=2), v0 + np.sum(t2 * (q1 - q0), axis=2)
        square = np.maximum(strands.heights**2 + extra[part, None, None], FLOOR)
        u0, u1, v0, v1, c, s = (x[..., None] for x in (u0, u1, v0, v1, c, np.abs(s)))
        value = inclined_integral(u0, u1, v0, v1, c, s, square)
        total += strands.mean(value, direction[0][i[part], j[part]])
    return total


def ends_and_corners(one: Track, strands: int) -> float:
    """What two or three strands miss of a track's own integral (m) at its open ends, three also at its corners."""
    row = ENDS_AND_CORNERS
    at = [float(np.interp(one.thickness / one.width, row[:, 0], row[:, k])) for k in range(1, 6)]
    corners = np.interp(one.turnings, _TURNINGS, [0.0, *at[2:]]) if strands == 3 else 0.0
    return one.width * (2.0 * at[strands - 2] + float(np.sum(corners)))
