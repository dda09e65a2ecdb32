"""One layer's track of straight sides and circular arcs, cut into strands at the Gauss points of its width.

Strands are mitred where sides meet at a corner; pairs of them keep the mean distances of the tracks' rectangles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from sitscad.arrays import Array, Flags, Index
from sitscad.physics.inductance.mean_distance import level_heights, strand_clearance
from sitscad.physics.special_functions import gauss
from sitscad.record import record

FLOOR = 1e-24
"""Least squared distance over the squared size of the tracks: strands that meet do so without a division by zero."""

THICK = 0.25
"""Thickness over width from which pieces on two layers are taken at two heights."""

BLOCK = 60_000
"""Pairs of pieces that are worked on at once: what a processor's cache holds."""


@record(eq=False)
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
        """The track with every length (m) multiplied."""
        arcs = self.arcs * np.array([factor, factor, factor, 1.0, 1.0, 1.0])
        return Track(self.starts * factor, self.ends * factor, self.before, self.after, arcs, self.turnings,
                     self.width * factor, self.thickness * factor, self.z * factor)  # fmt: skip


@record(eq=False)
class Pairs:
    """Pairs of pieces: the first's and the second's numbers (n), and how often each counts (n, 1), or (n, heights) at
    every height between them.
    """

    first: Index
    second: Index
    times: Array

    def where(self, chosen: Flags | slice) -> Pairs:
        """Some of the pairs (numbers, no unit)."""
        return Pairs(self.first[chosen], self.second[chosen], self.times[chosen])

    def parts(self, size: int) -> list[Pairs]:
        """All pairs (numbers, no unit), so many at a time."""
        return [self.where(slice(k, k + size)) for k in range(0, len(self.first), size)]

    def at(self, columns: Sequence[int]) -> Pairs:
        """The pairs that occur in some columns of `times`, and only these columns (numbers, no unit)."""
        times = self.times[:, columns]
        return Pairs(self.first, self.second, times).where(np.any(times != 0.0, axis=1))


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


@record(eq=False)
class Bundle:
    """All pairs of strands of two tracks: offsets (m) and shares (k) of the pairs, heights (m) between them.
    `clearances` are distances (m) and what squared distances are longer by there (m2).
    """

    offsets: tuple[Array, Array]
    shares: Array
    heights: Array
    clearances: tuple[Array, Array]

    def clearance(self, apart: Array) -> Array:
        """What squared distances (m2) of pieces `apart` (m) are longer by."""
        return np.asarray(np.interp(apart, *self.clearances))

    def blocks(self, count: int, points: int = 3) -> list[slice]:
        """So many pairs of pieces, each of so many points, in parts that a processor's cache holds."""
        rows = max(1, BLOCK // (points * self.shares.size * self.heights.size))
        return [slice(k, k + rows) for k in range(0, count, rows)]

    def ends(self, track: Track, sides: Index, which: int) -> tuple[Array, Array]:
        """Starts and ends (n, k, 2) of the strands of some sides of the first (0) or the second (1) track."""
        offset = self.offsets[which][:, None]
        starts = track.starts[sides, None, :] + offset * track.before[sides, None, :]
        return starts, track.ends[sides, None, :] + offset * track.after[sides, None, :]

    def total(self, values: Array, times: Array) -> float:
        """The sum of values (n, k, heights), in their unit, by how often pairs count and the strands' shares."""
        weighed = np.matmul(values, self.at_heights(times)[:, :, None])
        return float(np.sum(weighed[..., 0], axis=0) @ self.shares)

    def at_heights(self, times: Array) -> Array:
        """How often pairs count at every height, (n, heights), no unit: all alike where one number is given (n, 1)."""
        heights = self.heights.size
        return times if times.shape[1] == heights else np.repeat(times / heights, heights, axis=1)


def bundle(one: Track, other: Track, count: int, levels: int) -> Bundle:
    """All pairs of `count` strands a track, at the Gauss points of its width (m), at so many heights (m)."""
    heights = level_heights(one.z - other.z, (one.thickness, other.thickness), levels)
    return Bundle(*_strands(one.width, other.width, count), np.array(heights),
                  clearance_table(one, other, count, levels))  # fmt: skip


def distant_bundle(width: float, count: int, squares: Array) -> Bundle:
    """The same for pieces so far apart that the squares of heights (m2) hold all that the thickness does."""
    less = width**2 / 6.0 if count == 1 else 0.0
    return Bundle(*_strands(width, width, count), np.sqrt(np.maximum(squares, 0.0)),
                  (np.zeros(1), np.full(1, -less)))  # fmt: skip


def _strands(width: float, other: float, count: int) -> tuple[tuple[Array, Array], Array]:
    nodes, weights = gauss(count)
    a, b = np.divmod(np.arange(count * count), count)
    return (0.5 * width * nodes[a], 0.5 * other * nodes[b]), 0.25 * weights[a] * weights[b]


@lru_cache(maxsize=256)
def _table(
    height: float, widths: tuple[float, float], thicknesses: tuple[float, float], strands: int, levels: int
) -> tuple[Array, Array]:
    across = 5.0 * max(widths) * np.linspace(0.0, 1.0, 101) ** 1.5
    return across, strand_clearance(across, height, widths, thicknesses, strands, levels)


def clearance_table(one: Track, other: Track, strands: int, levels: int = 1) -> tuple[Array, Array]:
    """Distances (m) and the clearances (m2) of strands at these distances (`strand_clearance`), kept."""
    return _table(abs(one.z - other.z), (one.width, other.width), (one.thickness, other.thickness), strands, levels)


def common_levels(one: Track, other: Track, count: int) -> int:
    """Heights (m) at which strands of two layers are taken: two where the copper is thick, else one."""
    thick = max(one.thickness, other.thickness) > THICK * min(one.width, other.width)
    return 2 if one.z != other.z and count > 1 and thick else 1


def directions(steps: Array) -> Array:
    """Unit vectors (n, 2; no unit) along steps (m)."""
    return np.asarray(steps / np.hypot(steps[:, 0], steps[:, 1])[:, None])
