"""Inductance of tracks of straight sides and circular arcs: every filament pair closed or by a few Gauss points.

What a track is stands in `track_strands`, the pairs of pieces in `sides` and `arcs`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from sitscad.arrays import Array
from sitscad.physics.constants import MU0
from sitscad.physics.inductance.arcs import CLEAR, arc_distances, arc_side_distances, arcs_with_arcs, arcs_with_sides
from sitscad.physics.inductance.heights import height_nodes, nodes_enough
from sitscad.physics.inductance.mean_distance import level_heights
from sitscad.physics.inductance.repeats import distinct_pairs, kinds, pool
from sitscad.physics.inductance.sides import distant_sides, ends_and_corners, side_distances, sides_with_sides
from sitscad.physics.inductance.track_strands import (
    Bend,
    Pairs,
    Side,
    Track,
    bundle,
    common_levels,
    distant_bundle,
    track,
)
from sitscad.record import record

__all__ = ["Bend", "Side", "Track", "track", "tracks_mutual_inductance", "winding_inductance"]

Layers = tuple[int, int, float]
"""Numbers of two layers, and how often their pair counts."""

DISTANT = 3.0
"""Distance of pieces, in the height of all layers, from which few heights stand for all that layers differ in."""

FEW = 24
"""Pieces up to which the ends of a track with arcs weigh so much that more strands are worth their cost."""

OWN = ((8, 5), (48, 3))
"""Pieces, and how many strands a track with arcs of so many pieces or fewer gets for its own inductance."""

BENT = ((1.0, 3), (8.0, 4))
"""Width over layer distance, and how many strands a track with arcs gets from there on."""

FEW_CORNERS = (3.0, 3)
"""Width over layer distance from which a track of few pieces with rounded corners gets so many strands more."""


def winding_inductance(tracks: Sequence[Track], strands: tuple[int, int] = (2, 3)) -> float:
    """Inductance (H) of layers of equal width in series about a common centre, uniform current. `strands` across the
    width: for distant pairs of pieces, and for straight ones that nearly touch. Two or more: as many as tracks with
    arcs need, which have one number for all their pieces.
    """
    layers = [(i, j, 1.0 if i == j else 2.0) for i in range(len(tracks)) for j in range(i, len(tracks))]
    return _neumann(tracks, layers, strands)


def tracks_mutual_inductance(first: Track, second: Track, strands: tuple[int, int] = (2, 3)) -> float:
    """Mutual inductance (H) of two tracks of equal width (the self one for the same object), as above."""
    if first is second:
        return winding_inductance([first], strands)
    return _neumann([first, second], [(0, 1, 1.0)], strands)


def _neumann(tracks: Sequence[Track], layers: Sequence[Layers], strands: tuple[int, int]) -> float:
    """The whole stack's inductance (H) by Neumann's formula, with what ends and corners add."""
    size = max(float(np.max(np.abs(x), initial=0.0)) for t in tracks for x in (t.starts, t.ends, t.arcs[:, :3]))
    scaled = [track.scaled(1.0 / size) for track in tracks]
    total = math.fsum(_sums(_stack(scaled, layers, strands)))
    if strands[1] in (2, 3):
        total += math.fsum(times * ends_and_corners(scaled[i], strands[1]) for i, j, times in layers if i == j)
    return MU0 / (4.0 * math.pi) * size * total


@record(eq=False)
class _Stack:
    # Layers sorted by how two lie above each other: `relations` are lists of pairs of layers that lie alike, `examples`
    # the first of each. All their pieces as one are `whole`. `squares` (m2) are all squared heights, with both levels
    # of the copper's thickness; `spread` (relations, squares) is which of them, and how often, each relation has.
    tracks: Sequence[Track]
    relations: Sequence[Sequence[Layers]]
    whole: Track
    strands: tuple[int, int]
    squares: Array
    spread: Array

    @property
    def examples(self) -> list[tuple[Track, Track]]:
        return [(self.tracks[layers[0][0]], self.tracks[layers[0][1]]) for layers in self.relations]

    @property
    def distant(self) -> float:
        """Distance (m) from which on layers differ by their heights alone."""
        return max(CLEAR * self.whole.width, DISTANT * max(abs(one.z - other.z) for one, other in self.examples))

    @property
    def is_smooth(self) -> bool:
        return len(self.whole.arcs) > 0

    def pieces(self) -> Iterator[tuple[Track, Track, tuple[int, int]]]:
        """For every relation all pieces (m) at the heights of its layers, and their strands."""
        for one, other in self.examples:
            strands = self.strands
            if self.is_smooth and strands[0] > 1:
                strands = (_bent_strands(one, other),) * 2
            yield (replace(self.whole, z=one.z, thickness=one.thickness),
                   replace(self.whole, z=other.z, thickness=other.thickness), strands)  # fmt: skip


def _stack(tracks: Sequence[Track], layers: Sequence[Layers], strands: tuple[int, int]) -> _Stack:
    """The relations of layers that are alike, each once, with the heights (m) between them."""
    found: dict[tuple[float, ...], list[Layers]] = {}
    for i, j, times in layers:
        one, other = tracks[i], tracks[j]
        key = round(abs(one.z - other.z) / one.width, 9), *sorted((one.thickness, other.thickness))
        found.setdefault(key, []).append((i, j, times))
    relations = list(found.values())
    heights = [level_heights(tracks[i].z - tracks[j].z, (tracks[i].thickness, tracks[j].thickness), 2)
               for (i, j, _), *_ in relations]  # fmt: skip
    squares, which = np.unique(np.square(heights), return_inverse=True)
    spread = np.zeros((len(relations), squares.size))
    np.add.at(spread, (np.arange(len(relations))[:, None], which.reshape(-1, 2)), 0.5)
    return _Stack(tracks, relations, pool(tracks), strands, squares, spread)


def _sums(stack: _Stack) -> Iterator[float]:
    """Of t1.t2 / distance (m): sides with sides, arcs with arcs, arcs with sides."""
    sides, arcs, turns = kinds(stack.tracks)
    smooth = stack.is_smooth
    if len(stack.whole.starts):
        pairs = distinct_pairs(sides, sides, turns, stack.relations)
        apart = side_distances(stack.whole, stack.whole, pairs)
        for (one, other, strands), some in zip(stack.pieces(), _near(stack, pairs, apart), strict=True):
            yield sides_with_sides(one, other, some, strands, smooth)
        for some, away, squares in _distant(stack, pairs, apart):
            yield distant_sides(stack.whole, some, away, min(stack.strands[0], 2), squares)
    if smooth:
        pairs = distinct_pairs(arcs, arcs, turns, stack.relations)
        yield from _by_points(stack, pairs, arc_distances(stack.whole, stack.whole, pairs), arcs_with_arcs)
    if smooth and len(stack.whole.starts):
        both = [[*layers, *((j, i, times) for i, j, times in layers)] for layers in stack.relations]
        pairs = distinct_pairs(arcs, sides, turns, both)
        yield from _by_points(stack, pairs, arc_side_distances(stack.whole, stack.whole, pairs), arcs_with_sides)


def _by_points(stack: _Stack, pairs: Pairs, apart: Array, summed: Callable[..., float]) -> Iterator[float]:
    for (one, other, strands), some in zip(stack.pieces(), _near(stack, pairs, apart), strict=True):
        yield summed(one, other, some, bundle(one, other, strands[0], common_levels(one, other, strands[0])))
    for some, _, squares in _distant(stack, pairs, apart):
        yield summed(stack.whole, stack.whole, some,
                     distant_bundle(stack.whole.width, min(stack.strands[0], 2), squares))  # fmt: skip


def _near(stack: _Stack, pairs: Pairs, apart: Array) -> Iterator[Pairs]:
    # For every relation those of its pairs that are not distant.
    near = pairs.where(apart < stack.distant)
    for k in range(len(stack.relations)):
        yield near.at([k])


def _distant(stack: _Stack, pairs: Pairs, apart: Array) -> Iterator[tuple[Pairs, Array, Array]]:
    """The distant ones, with how often they count at as few heights as their distance allows, their distances (m), and
    the squares of those heights (m2).
    """
    beyond = apart >= stack.distant
    enough = np.where(beyond, nodes_enough(stack.squares, apart), 0)
    for count in np.unique(enough[beyond]).tolist():
        chosen = enough == count
        squares, shares = height_nodes(stack.squares, count)
        times = pairs.times[chosen] @ (stack.spread @ shares)
        yield Pairs(pairs.first[chosen], pairs.second[chosen], times), apart[chosen], squares


def _bent_strands(one: Track, other: Track) -> int:
    """How many strands (no unit) the tracks of two layers get where they bend."""
    pieces = len(one.starts) + len(one.arcs)
    if one.z == other.z:
        return next((strands for most, strands in OWN if one is other and pieces <= most), 2)
    wide = max(one.width, other.width) / abs(one.z - other.z)
    count = max([2, *(strands for least, strands in BENT if wide >= least)])
    # half circles are none: strands of two layers cross far from their ends, and more would need more points
    rounded = len(one.arcs) and float(np.max(one.arcs[:, 5])) < 0.9 * math.pi
    return count + (FEW_CORNERS[1] if pieces <= FEW and rounded and wide >= FEW_CORNERS[0] else 0)
