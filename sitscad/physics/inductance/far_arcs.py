"""Arcs far from other pieces: a few Gauss points a strand, all pairs of pieces at once."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.inductance.track_strands import FLOOR, Bundle, Track, directions
from sitscad.physics.special.legendre import gauss

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FAR = 4.0
"""Distance of an arc's middle from another piece, in its half lengths, from which few points are right to 4e-6 of the
pair and, as most are farther, to 1e-7 of all."""

POINTS = ((50.0, 3), (100.0, 4), (360.0, 5))
"""Angles (degrees) up to which an arc's current, whose direction turns, is right to 1e-7 with so many points."""

AT_ONCE = 20_000
"""Pairs of points that are worked on at once: as many as stay near the processor."""


def half_lengths(arcs: Array) -> Array:
    """Half the length (m) of arcs (n, 6)."""
    return np.asarray(0.5 * arcs[:, 2] * arcs[:, 5])


def middles(arcs: Array) -> Array:
    """Middle points (n, 2) of arcs (n, 6)."""
    azimuth = arcs[:, 3] + 0.5 * arcs[:, 4] * arcs[:, 5]
    return np.asarray(arcs[:, :2] + arcs[:, 2:3] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1))


def _points(arcs: Array, width: float, count: int) -> tuple[Array, Array, int]:
    # Places and elements (2, n) of all arcs' points, strand by strand, and how many an arc has.
    turn = math.degrees(float(arcs[:, 5].max()))
    nodes, weights = gauss(next(number for most, number in POINTS if turn <= most))
    across, shares = gauss(count)
    offset = np.repeat(0.5 * width * across, nodes.size)
    t, weight = np.tile(0.5 * (1.0 + nodes), count), np.outer(0.5 * shares, 0.5 * weights).ravel()
    centre, radius, way = arcs[:, :2].T[:, :, None], arcs[:, 2:3] - arcs[:, 4:5] * offset, arcs[:, 4:5]
    azimuth = arcs[:, 3:4] + way * arcs[:, 5:6] * t
    outward = np.stack([np.cos(azimuth), np.sin(azimuth)])
    forward = way * np.stack([-outward[1], outward[0]])
    return ((centre + radius * outward).reshape(2, -1),
            (radius * arcs[:, 5:6] * weight * forward).reshape(2, -1), t.size)  # fmt: skip


def far_arcs(one: Track, other: Track, strands: Bundle, clearance: float, far: Flags, count: int) -> float:
    """Integral of t1.t2 / distance (m) over pairs of arcs that `far` (arcs, arcs) names, `count` strands a track."""
    p, dp, each = _points(one.arcs, one.width, count)
    q, dq, others = _points(other.arcs, other.width, count)
    left = np.stack([-2.0 * p[0], -2.0 * p[1], np.sum(p * p, axis=0), np.ones(p.shape[1])], axis=1)
    right = np.stack([q[0], q[1], np.ones(q.shape[1]), np.sum(q * q, axis=0)])
    total = 0.0
    for rows, columns in _blocks(len(one.arcs), len(other.arcs), each, others, one is other):
        here, there = slice(rows.start * each, rows.stop * each), slice(columns.start * others, columns.stop * others)
        square, dot = left[here] @ right[:, there], dp[:, here].T @ dq[:, there]
        near = np.nonzero(~far[rows, columns])
        dot.reshape(-1, each, dot.shape[1] // others, others)[near[0], :, near[1], :] = 0.0
        twice = 2.0 if one is other and columns.start > rows.start else 1.0
        for height in strands.heights:
            apart = np.maximum(square + (height * height + clearance), FLOOR)
            total += twice * float(np.vdot(dot, 1.0 / np.sqrt(apart, out=apart)))
    return total / strands.heights.size


def _blocks(rows: int, columns: int, each: int, others: int, same: bool) -> Iterator[tuple[slice, slice]]:
    # Parts of all pairs of pieces; of the same track those on and right of the diagonal.
    size = max(1, math.isqrt(AT_ONCE // (each * others)))
    for k in range(0, rows, size):
        for j in range(k if same else 0, columns, size):
            yield slice(k, min(k + size, rows)), slice(j, min(j + size, columns))


def far_sides(one: Track, other: Track, strands: Bundle, clearance: float, far: Flags, count: int) -> float:
    """The same over pairs of the arcs of one and the sides of the other that `far` (arcs, sides) names."""
    p, dp, each = _points(one.arcs, one.width, count)
    t = directions(other.ends - other.starts).T
    across, shares = gauss(count)
    lines = [_line(other, t, 0.5 * other.width * x) for x in across]
    total = 0.0
    size = max(1, AT_ONCE // (each * len(other.starts)))
    for k in range(0, len(one.arcs), size):
        here = slice(k * each, (k + size) * each)
        along, lateral, dot = t.T @ p[:, here], np.stack([-t[1], t[0]]).T @ p[:, here], t.T @ dp[:, here]
        near = np.nonzero(~far[k : k + size].T)
        dot.reshape(dot.shape[0], -1, each)[near] = 0.0
        for (start, end, level), share in zip(lines, shares, strict=True):
            square = (lateral - level) ** 2 + clearance
            for height in strands.heights:
                rho = 1.0 / np.sqrt(np.maximum(square + height * height, FLOOR))
                potential = np.arcsinh((end - along) * rho) + np.arcsinh((along - start) * rho)
                total += 0.5 * share * float(np.vdot(dot, potential))
    return total / strands.heights.size


def _line(track: Track, t: Array, offset: float) -> tuple[Array, Array, Array]:
    # Where the strands of all sides begin and end along them, and how far to the left they lie (n, 1).
    starts, ends = (track.starts + offset * track.before).T, (track.ends + offset * track.after).T
    left = np.stack([-t[1], t[0]])
    return (
        np.sum(starts * t, axis=0)[:, None],
        np.sum(ends * t, axis=0)[:, None],
        np.sum(starts * left, axis=0)[:, None],
    )
