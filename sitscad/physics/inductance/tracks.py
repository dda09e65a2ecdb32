"""Inductance of tracks of straight sides and circular arcs: every filament pair closed or by a few Gauss points.

What a track is stands in `track_strands`, the pairs of pieces in `sides` and `arcs`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.constants import MU0
from sitscad.physics.inductance.arcs import pairs_with_arcs
from sitscad.physics.inductance.sides import ends_and_corners, sides_with_sides
from sitscad.physics.inductance.track_strands import Bend, Side, Track, track

__all__ = ["Bend", "Side", "Track", "track", "track_inductance_matrix", "tracks_mutual_inductance"]

Array = NDArray[np.float64]

FEW = 24
"""Pieces up to which the ends of a track with arcs weigh so much that more strands are worth their cost."""

OWN = ((8, 5), (48, 3))
"""Pieces, and how many strands a track with arcs of so many pieces or fewer gets for its own inductance."""

BENT = ((1.0, 3), (8.0, 4))
"""Width over layer distance, and how many strands a track with arcs gets from there on."""

FEW_CORNERS = (3.0, 3)
"""Width over layer distance from which a track of few pieces with rounded corners gets so many strands more."""


def tracks_mutual_inductance(first: Track, second: Track, strands: tuple[int, int] = (2, 3)) -> float:
    """Mutual inductance (H) of two tracks of equal width (the self one for the same object), uniform current.

    `strands` across the width: for distant pairs of pieces, and for straight ones that nearly touch. Two or more: as
    many as tracks with arcs need, which have one number for all their pieces.
    """
    size = max(float(np.max(np.abs(x), initial=0.0)) for x in (first.starts, first.ends, first.arcs[:, :3]))
    one = first.scaled(1.0 / size)
    other = one if first is second else second.scaled(1.0 / size)
    smooth = bool(len(one.arcs) or len(other.arcs))
    if smooth and strands[0] > 1:
        strands = (_bent_strands(one, other),) * 2
    total = sides_with_sides(one, other, strands, smooth)
    if one is other and strands[1] in (2, 3):
        total += ends_and_corners(one, strands[1])
    if smooth:
        total += pairs_with_arcs(one, other, strands[0])
    return MU0 / (4.0 * math.pi) * size * total


def _bent_strands(one: Track, other: Track) -> int:
    pieces = len(one.starts) + len(one.arcs)
    if one.z == other.z:
        return next((strands for most, strands in OWN if one is other and pieces <= most), 2)
    wide = max(one.width, other.width) / abs(one.z - other.z)
    count = max([2, *(strands for least, strands in BENT if wide >= least)])
    # half circles are none: strands of two layers cross far from their ends, and more would need more points
    rounded = len(one.arcs) and float(np.max(one.arcs[:, 5])) < 0.9 * math.pi
    return count + (FEW_CORNERS[1] if pieces <= FEW and rounded and wide >= FEW_CORNERS[0] else 0)


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
    """Pairs that a motion or a mirror turns into each other have one inductance, whichever is the first and whichever
    way each is walked: every layer of two lies over the next but one, and is the mirror image of the next.
    """
    apart = round(abs(one.z - other.z) / one.width, 9)
    if one is other:
        return apart, one.thickness, _outline([one])
    pairs = ((one, other), (other, one))
    return apart, *min((a.thickness, b.thickness, _outline([a, b])) for a, b in pairs)


def _outline(tracks: Sequence[Track]) -> bytes:
    # What tracks are in the plane but for motions and mirrors: the distances of all their points, in widths, from three
    # points of the first (its first, the one farthest from it, and from the line through both), and all arcs' turns.
    tables = [_points(track) for track in tracks]
    points = np.concatenate([table for table, _ in tables])
    away = tables[0][0] - points[0]
    second = int(np.argmax(np.sum(away * away, axis=1)))
    third = int(np.argmax(np.abs(away[:, 0] * away[second, 1] - away[:, 1] * away[second, 0])))
    distances = [np.hypot(*(points - points[k]).T) for k in (0, second, third)]
    turns = np.concatenate([turn for _, turn in tables])
    sizes = np.array([float(len(track.starts)) for track in tracks])
    return b"".join(np.round(x, 7).tobytes() for x in (*np.array(distances) / tracks[0].width, turns, sizes))


def _points(one: Track) -> tuple[Array, Array]:
    # Ends of all sides, centres and ends of all arcs, and the arcs' turns, from the end that lies farther out.
    arcs = one.arcs
    ends = [arcs[:, :2] + arcs[:, 2:3] * np.stack([np.cos(a), np.sin(a)], axis=1)
            for a in (arcs[:, 3], arcs[:, 3] + arcs[:, 4] * arcs[:, 5])]  # fmt: skip
    tables, turns = [one.starts, one.ends, arcs[:, :2], *ends], arcs[:, 5]
    middle = np.mean(np.concatenate(tables[:2] + tables[3:]), axis=0)
    way = tables[0] if len(one.starts) else ends[0]
    if np.hypot(*(way[0] - middle)) < np.hypot(*(way[-1] - middle)):
        tables = [table[::-1] for table in (one.ends, one.starts, arcs[:, :2], ends[1], ends[0])]
        turns = turns[::-1]
    return np.concatenate(tables), turns
