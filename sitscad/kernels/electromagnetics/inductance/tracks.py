"""Inductance of tracks of straight sides and circular arcs.

Tracks are replaced by strands (parallel filaments). Neumann's integral of every pair of strands is in closed form or by
a few Gauss points. Partial inductances follow Ruehli (IBM J. Res. Dev. 16, 1972) and are summed over all pairs of
pieces.

Tracks are defined in `track_strands`, pairs with arcs in `arcs`. For straight sides, the distance of a pair sets the
numbers of strands and heights. The nearest pairs, at open ends and corners, keep an error in proportion to the width.
It is corrected by a table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.arcs import (
    CLEAR,
    arc_distances,
    arc_side_distances,
    sum_arcs_with_arcs,
    sum_arcs_with_sides,
)
from sitscad.kernels.electromagnetics.inductance.filaments import inclined_integral, parallel_filaments
from sitscad.kernels.electromagnetics.inductance.mean_distance import (
    height_nodes,
    level_heights,
    sufficient_node_counts,
)
from sitscad.kernels.electromagnetics.inductance.track_strands import (
    BLOCK,
    FLOOR,
    Pairs,
    StrandPairs,
    Track,
    common_height_count,
    directions,
    distant_strand_pairs,
    distinct_pairs,
    piece_kinds,
    pool_tracks,
    strand_pairs,
)

NEAR = 3.0
"""Distance between two straight pieces, divided by the width, below which the pair gets more strands."""

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
])
"""Error of Neumann's integral with strands, at open ends and corners of a track.

The first column is thickness divided by width. The next two are the error at an open end, with two and with three
strands. The last three are the error with three strands at corners of 45, 60 and 90 degrees. The unit of an error is
mu0/(4 pi) times the width, because a corner has one shape at every size. A positive error means that the strands give
too small a value. Source: a volume integral of this project over a straight bar and two arms of sixteen widths
(tests/validation).
"""

FAR = 150.0
"""Distance of two straight pieces, divided by the width, above which a single filament represents each track.

The error falls with the square of the distance.
"""

WIDE = ((1.0, 4), (6.0, 6), (20.0, 8))
"""Rows (least track width divided by layer distance, number of strands) for near sides of two layers."""

_TURNINGS = np.radians((0.0, 45.0, 60.0, 90.0))
"""Turning angles (rad) of the corners in `ENDS_AND_CORNERS`, and zero."""


def distant_sides(track: Track, pairs: Pairs, apart: Array, count: int, squares: Array) -> float:
    """Return Neumann's integral (m) over pairs of a track's sides that are far apart.

    `apart` (n; m) are the distances of the pairs, `count` is the number of strands. At these distances, pairs of layers
    differ only by their squared height difference `squares` (m2). `pairs` have a multiplicity for each of these.
    """
    is_distant = apart > FAR * track.width
    return math.fsum(
        _sum_sides(track, track, part, distant_strand_pairs(track.width, strands, squares))
        for chosen, strands in ((~is_distant, count), (is_distant, 1))
        for part in pairs.select(chosen).parts(BLOCK)
    )


def _height_count(first: Track, second: Track, count: int, smooth: bool) -> int:
    """Return the number of heights (1 or 2; no unit) that represent the distance of two layers' strands.

    Ends and corners of tracks above each other need two heights. If sides and arcs join smoothly (`smooth`), all pieces
    need the same number.
    """
    if count > 2 and not smooth:
        return 1 if first.z == second.z else 2
    return common_height_count(first, second, count)


def _side_integral(first: Track, second: Track, pairs: Pairs, strands: tuple[int, int], smooth: bool) -> float:
    """Return the sum of t1.t2 / distance (m; Neumann's integral) over pairs of sides of two tracks.

    `strands` are the numbers of strands for distant pairs and for near pairs. `smooth` is true if sides and arcs join
    smoothly.
    """
    near = side_distances(first, second, pairs) < NEAR * max(first.width, second.width)
    usual = _sum_sides(
        first, second, pairs.select(~near), strand_pairs(first, second, strands[0],
                                                        _height_count(first, second, strands[0], smooth))
    )
    return usual + math.fsum(
        share * _sum_sides(first, second, pairs.select(near),
                     strand_pairs(first, second, count, _height_count(first, second, count, smooth)))
        for count, share in _near_strands(first, second, strands, smooth)
    )


def _sum_sides(first: Track, second: Track, pairs: Pairs, strands: StrandPairs) -> float:
    """Return the sum (m) of Neumann's integrals over pairs of sides, for given pairs of strands.

    Parallel and inclined sides are summed separately. Sides at right angles contribute nothing.
    """
    t1, t2 = directions(first.ends - first.starts)[pairs.first], directions(second.ends - second.starts)[pairs.second]
    sine, cosine = t1[:, 0] * t2[:, 1] - t1[:, 1] * t2[:, 0], np.sum(t1 * t2, axis=1)
    parallel = np.abs(sine) < 1e-9
    total = _parallel_sides(first, second, pairs.select(parallel), t1[parallel], strands)
    inclined = ~parallel & (np.abs(cosine) > 1e-9)
    return total + _inclined_sides(first, second, pairs.select(inclined), (t1[inclined], t2[inclined]), strands)


def _near_strands(first: Track, second: Track, strands: tuple[int, int], smooth: bool) -> tuple[tuple[int, float], ...]:
    """Return (number of strands, weight without unit) of each sum whose weighted total is used for near pairs.

    `strands` are the numbers of strands for distant and near pairs. `smooth` is true if sides and arcs join smoothly.

    Notes
    -----
    At corners above each other, each extra strand reduces the error if tracks are wide compared with their distance.
    Twice the finer sum minus the coarser sum approaches the limit (Richardson extrapolation; its order was found here
    by comparison).
    """
    wide = max(first.width, second.width) / max(abs(first.z - second.z), FLOOR)
    enough = [strands for least, strands in WIDE if wide >= least]
    if smooth or strands[1] < 3 or first.z == second.z or not enough:
        return ((strands[0] if smooth else strands[1], 1.0),)
    return ((enough[-1] + 1, 2.0), (enough[-1], -1.0))


def side_distances(first: Track, second: Track, pairs: Pairs) -> Array:
    """Return the distances (n; m) in the plane of pairs of straight sides.

    Notes
    -----
    Derived here: if two sides do not cross, an end of one side is nearest to the other side. If they cross, the
    distance of a middle from the other side is used.
    """
    i, j = pairs.first, pairs.second
    p, q = (first.starts[i], first.ends[i]), (second.starts[j], second.ends[j])
    return np.asarray(np.sqrt(np.minimum(_points_to_sides(*p, *q), _points_to_sides(*q, *p))))


def _points_to_sides(start: Array, end: Array, other_start: Array, other_end: Array) -> Array:
    """Return least squared distances (n; m2) of the ends and the middle of one side from another side.

    `start` and `end` (n, 2; m) belong to the first side, `other_start` and `other_end` to the other side.
    """
    step = other_end - other_start
    length = np.hypot(step[:, 0], step[:, 1])
    tx, ty = step[:, 0] / length, step[:, 1] / length
    least = np.full(len(start), np.inf)
    for points in (start, end, 0.5 * (start + end)):
        dx, dy = points[:, 0] - other_start[:, 0], points[:, 1] - other_start[:, 1]
        parallel = dx * tx + dy * ty
        across = dx * ty - dy * tx
        beyond = np.maximum(np.maximum(-parallel, parallel - length), 0.0)
        least = np.minimum(least, across * across + beyond * beyond)
    return least


def _parallel_sides(first: Track, second: Track, pairs: Pairs, tangents: Array, strands: StrandPairs) -> float:
    """Return the sum of t1.t2 / distance (m) over pairs of parallel sides, by the closed form of `parallel_filaments`.

    `tangents` (n, 2) are the unit vectors along the first sides, `strands` the filaments that replace both tracks.
    """
    offset = second.starts[pairs.second] - first.starts[pairs.first]
    lateral = np.abs(tangents[:, 0] * offset[:, 1] - tangents[:, 1] * offset[:, 0])
    clearance = strands.clearance(lateral)[:, None, None]
    total = 0.0
    for part in strands.blocks(len(tangents)):
        p0, p1 = strands.ends(first, pairs.first[part], 0)
        q0, q1 = strands.ends(second, pairs.second[part], 1)
        axis = tangents[part, None, :]
        to_start, to_end = q0 - p0, q1 - p0
        length, start, end = (np.sum(axis * x, axis=2)[..., None] for x in (p1 - p0, to_start, to_end))
        gap = (axis[..., 0] * to_start[..., 1] - axis[..., 1] * to_start[..., 0])[..., None]
        square = np.maximum(gap**2 + strands.heights**2 + clearance[part], FLOOR)
        total += strands.weighted_sum(parallel_filaments(length, start, end, square), pairs.times[part])
    return total * 4.0 * math.pi / MU0


def _inclined_sides(
    first: Track, second: Track, pairs: Pairs, directions: tuple[Array, Array], strands: StrandPairs
) -> float:
    """Return the sum of t1.t2 / distance (m) over pairs of inclined sides, by the closed form of `inclined_integral`.

    `directions` (n, 2 each) are unit vectors along both sides, `strands` the filaments that replace both tracks. For
    tracks that cross above each other, the mean of 1/distance needs no second height (to 4th order).
    """
    is_level = first.z == second.z
    extra = strands.clearance(side_distances(first, second, pairs)) if is_level else np.zeros(pairs.first.size)
    total = 0.0
    for part in strands.blocks(extra.size):
        p0, p1 = strands.ends(first, pairs.first[part], 0)
        q0, q1 = strands.ends(second, pairs.second[part], 1)
        t1, t2 = (t[part, None, :] for t in directions)
        c, s = np.sum(t1 * t2, axis=2), t1[..., 0] * t2[..., 1] - t1[..., 1] * t2[..., 0]
        offset = q0 - p0
        # distances along both axes, from the point where the two lines cross
        u0 = -(offset[..., 0] * t2[..., 1] - offset[..., 1] * t2[..., 0]) / s
        v0 = -(offset[..., 0] * t1[..., 1] - offset[..., 1] * t1[..., 0]) / s
        u1, v1 = u0 + np.sum(t1 * (p1 - p0), axis=2), v0 + np.sum(t2 * (q1 - q0), axis=2)
        square = np.maximum(strands.heights**2 + extra[part, None, None], FLOOR)
        u0, u1, v0, v1, c, s = (x[..., None] for x in (u0, u1, v0, v1, c, np.abs(s)))
        total += strands.weighted_sum(inclined_integral(u0, u1, v0, v1, c, s, square) * c, pairs.times[part])
    return total


def ends_and_corners(track: Track, strands: int) -> float:
    """Return the error (m) of Neumann's integral of a track with itself, with two or three strands.

    The error is proportional to the width and comes from the table `ENDS_AND_CORNERS`. It includes the two open ends.
    For three strands it also includes the corners.
    """
    row = ENDS_AND_CORNERS
    at = [float(np.interp(track.thickness / track.width, row[:, 0], row[:, k])) for k in range(1, 6)]
    corners = np.interp(track.turnings, _TURNINGS, [0.0, *at[2:]]) if strands == 3 else 0.0
    return track.width * (2.0 * at[strands - 2] + float(np.sum(corners)))


Layers = tuple[int, int, float]
"""Number of the first layer, number of the second layer, and how often this pair of layers counts."""

DISTANT = 3.0
"""Least distance of two pieces that count as distant, divided by the largest height difference of layers.

For distant pieces, a sum over a few interpolated heights replaces the sum over all pairs of layers.
"""

FEW = 24
"""Largest number of pieces of a track with arcs that gets the extra strands of `FEW_CORNERS`.

The ends of a short track contribute so much that more strands are worth their cost.
"""

OWN = ((8, 5), (48, 3))
"""Rows (largest number of pieces, number of strands) for the self-inductance of a layer with arcs.

With up to 8 pieces 5 strands, with up to 48 pieces 3, with more pieces 2.
"""

BENT = ((1.0, 3), (8.0, 4))
"""Rows (least track width divided by layer distance, number of strands) for two layers with arcs.

Narrower tracks have 2 strands.
"""

FEW_CORNERS = (3.0, 3)
"""Least track width divided by layer distance, and number of extra strands, for two layers with rounded corners.

Only tracks of at most `FEW` pieces get the extra strands.
"""


def winding_inductance(tracks: Sequence[Track], strands: tuple[int, int] = (2, 3)) -> float:
    """Return the inductance (H) of layers of equal width in series about a common centre, with uniform current.

    Parameters
    ----------
    tracks : sequence of Track
        layers of the winding
    strands : tuple[int, int], optional
            numbers of strands that replace a track: for distant pairs of pieces, and for straight pieces that nearly
        touch. For tracks with arcs, values of two or more are replaced by a single number for all pieces.

    Notes
    -----
    Neumann's integral over strands. The distances of strands have a correction, so that they have the geometric mean
    distance of the tracks (Grover 1946).
    """
    layers = [(i, j, 1.0 if i == j else 2.0) for i in range(len(tracks)) for j in range(i, len(tracks))]
    return _neumann(tracks, layers, strands)


def tracks_mutual_inductance(first: Track, second: Track, strands: tuple[int, int] = (2, 3)) -> float:
    """Return the mutual inductance (H) of two tracks of equal width. For one object twice, return its self-inductance.

    See `winding_inductance`.
    """
    if first is second:
        return winding_inductance([first], strands)
    return _neumann([first, second], [(0, 1, 1.0)], strands)


def _neumann(tracks: Sequence[Track], layers: Sequence[Layers], strands: tuple[int, int]) -> float:
    """Return the inductance (H) of the pairs of layers that `layers` lists.

    It is mu0 / (4 pi) times Neumann's integral in units of the tracks' size, corrected at ends and corners.
    """
    size = max(float(np.max(np.abs(x), initial=0.0)) for t in tracks for x in (t.starts, t.ends, t.arcs[:, :3]))
    scaled = [track.scaled(1.0 / size) for track in tracks]
    # distinct relations of layers, with the heights (m) between them
    groups: dict[tuple[float, ...], list[Layers]] = {}
    for i, j, times in layers:
        first, second = scaled[i], scaled[j]
        key = round(abs(first.z - second.z) / first.width, 9), *sorted((first.thickness, second.thickness))
        groups.setdefault(key, []).append((i, j, times))
    relations = list(groups.values())
    heights = [level_heights(scaled[i].z - scaled[j].z, (scaled[i].thickness, scaled[j].thickness), 2)
               for (i, j, _), *_ in relations]
    squares, which = np.unique(np.square(heights), return_inverse=True)
    square_weights = np.zeros((len(relations), squares.size))
    np.add.at(square_weights, (np.arange(len(relations))[:, None], which.reshape(-1, 2)), 0.5)
    total = math.fsum(_integral_parts(_Stack(scaled, relations, pool_tracks(scaled), strands, squares, square_weights)))
    if strands[1] in (2, 3):
        total += math.fsum(times * ends_and_corners(scaled[i], strands[1]) for i, j, times in layers if i == j)
    return MU0 / (4.0 * math.pi) * size * total


@record(eq=False)
class _Stack:
    """Layers of a winding, with pairs of layers grouped by height difference and thicknesses.

    `tracks` are the layers. Each of the `relations` is a list of the pairs of layers with one height difference and
    equal thicknesses. `whole` is a single track of all pieces. `strands` are the numbers of strands for distant and
    near pairs.

    `squares` (n; m2) are all squared heights between layers. Each height difference has two because of the copper's
    thickness. `spread` (relations, squares) is the multiplicity of each squared height in each relation.
    """

    tracks: Sequence[Track]
    relations: Sequence[Sequence[Layers]]
    whole: Track
    strands: tuple[int, int]
    squares: Array
    spread: Array

    @property
    def example_pairs(self) -> list[tuple[Track, Track]]:
        """First pair of tracks of each relation."""
        return [(self.tracks[layers[0][0]], self.tracks[layers[0][1]]) for layers in self.relations]

    @property
    def least_distance(self) -> float:
        """Least distance (m) of two pieces at which layers differ only by their heights."""
        highest = max(abs(first.z - second.z) for first, second in self.example_pairs)
        return max(CLEAR * self.whole.width, DISTANT * highest)

    @property
    def is_smooth(self) -> bool:
        """Whether the winding has arcs, so that straight sides continue smoothly."""
        return len(self.whole.arcs) > 0

    def pieces(self) -> Iterator[tuple[Track, Track, tuple[int, int]]]:
        """Yield, for each relation of layers, two tracks of all pieces at two heights, and the numbers of strands.

        The two heights (m) have the relation's height difference.
        """
        for first, second in self.example_pairs:
            strands = self.strands
            if self.is_smooth and strands[0] > 1:
                strands = (_bent_strands(first, second),) * 2
            yield (replace(self.whole, z=first.z, thickness=first.thickness),
                   replace(self.whole, z=second.z, thickness=second.thickness), strands)


def _integral_parts(stack: _Stack) -> Iterator[float]:
    """Yield the parts of Neumann's integral of t1.t2 / distance (m) over all pieces.

    The parts are sides with sides, arcs with arcs, and arcs with sides.
    """
    sides, arcs, turns = piece_kinds(stack.tracks)
    smooth = stack.is_smooth
    if len(stack.whole.starts):
        pairs = distinct_pairs(sides, sides, turns, stack.relations)
        apart = side_distances(stack.whole, stack.whole, pairs)
        for (first, second, strands), some in zip(stack.pieces(), _near_pairs(stack, pairs, apart), strict=True):
            # `strands` across the width: for distant pairs of sides, and for pairs that nearly touch. In a `smooth`
            # track, whose sides continue in arcs, all sides have the first number and a single height, like arcs
            yield math.fsum(_side_integral(first, second, part, strands, smooth) for part in some.parts(BLOCK))
        for some, distances, squares in _distant_pairs(stack, pairs, apart):
            yield distant_sides(stack.whole, some, distances, min(stack.strands[0], 2), squares)
    if smooth:
        pairs = distinct_pairs(arcs, arcs, turns, stack.relations)
        yield from _arc_integrals(stack, pairs, arc_distances(stack.whole, stack.whole, pairs), sum_arcs_with_arcs)
    if smooth and len(stack.whole.starts):
        directed = [[*layers, *((j, i, times) for i, j, times in layers)] for layers in stack.relations]
        pairs = distinct_pairs(arcs, sides, turns, directed)
        apart = arc_side_distances(stack.whole, stack.whole, pairs)
        yield from _arc_integrals(stack, pairs, apart, sum_arcs_with_sides)


def _arc_integrals(stack: _Stack, pairs: Pairs, apart: Array, summed: Callable[..., float]) -> Iterator[float]:
    """Yield the parts of Neumann's integral (m) over pairs that include arcs.

    `apart` (n; m) are the distances of the pairs. `summed` integrates the near pairs of each relation, and then the
    distant pairs of all layers together.
    """
    for (first, second, strands), some in zip(stack.pieces(), _near_pairs(stack, pairs, apart), strict=True):
        yield summed(first, second, some, strand_pairs(first, second, strands[0],
                                                       common_height_count(first, second, strands[0])))
    for some, _, squares in _distant_pairs(stack, pairs, apart):
        yield summed(stack.whole, stack.whole, some,
                     distant_strand_pairs(stack.whole.width, min(stack.strands[0], 2), squares))


def _near_pairs(stack: _Stack, pairs: Pairs, apart: Array) -> Iterator[Pairs]:
    """Yield the pairs (numbers, no unit) of every relation that are not distant. `apart` (n; m) are their distances."""
    near = pairs.select(apart < stack.least_distance)
    for k in range(len(stack.relations)):
        yield near.in_columns([k])


def _distant_pairs(stack: _Stack, pairs: Pairs, apart: Array) -> Iterator[tuple[Pairs, Array, Array]]:
    """Yield distant pairs, their distances (m), and the squared heights (m2) that represent all layers for them.

    The number of heights is as small as the distance allows. The multiplicities (no unit) of the pairs are for these
    heights.
    """
    beyond = apart >= stack.least_distance
    enough = np.where(beyond, sufficient_node_counts(stack.squares, apart), 0)
    for count in np.unique(enough[beyond]).tolist():
        chosen = enough == count
        squares, node_weights = height_nodes(stack.squares, count)
        times = pairs.times[chosen] @ (stack.spread @ node_weights)
        yield Pairs(pairs.first[chosen], pairs.second[chosen], times), apart[chosen], squares


def _bent_strands(first: Track, second: Track) -> int:
    """Return the number of strands (no unit) of two layers' tracks with arcs."""
    pieces = len(first.starts) + len(first.arcs)
    if first.z == second.z:
        return next((strands for most, strands in OWN if first is second and pieces <= most), 2)
    wide = max(first.width, second.width) / abs(first.z - second.z)
    count = max([2, *(strands for least, strands in BENT if wide >= least)])
    # half circles do not count: strands of two layers cross far from their ends, and more strands need more points
    rounded = len(first.arcs) and float(np.max(first.arcs[:, 5])) < 0.9 * math.pi
    return count + (FEW_CORNERS[1] if pieces <= FEW and rounded and wide >= FEW_CORNERS[0] else 0)
