"""One layer's track of straight sides and circular arcs, divided into strands at the Gauss points of its width.

A strand is a filament that stands for a part of the width. Strands are mitred at corners. A correction to the distances
of strands preserves the geometric mean distance of the tracks' rectangular cross-sections.

Most turns of a coil are repeated: rotated about its centre, mirrored, or on another layer. Each piece is described in
the frame of its own direction, so that a rotation about the centre changes only its direction. A mirror image and a
piece with reversed current are equivalent. A pair of pieces is defined by both kinds and the angle between their
directions. Each distinct pair is computed once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from sitscad.basics.arrays import Array, Flags, Index, slices
from sitscad.basics.record import record, replace
from sitscad.kernels.electromagnetics.inductance.mean_distance import clearance_table, level_heights
from sitscad.kernels.electromagnetics.special_functions import gauss

FLOOR = 1e-24
"""Least squared distance of strands, divided by the squared size of the tracks.

It avoids a division by zero if strands meet.
"""

THICK = 0.25
"""Least thickness of tracks, divided by their width, at which two heights represent each pair of layers."""

BLOCK = 60_000
"""Number of pairs of pieces processed at once, which fit a processor's cache."""


@record(eq=False)
class Track:
    """One layer's conductor along its current, in metres and radians.

    Straight sides: `starts`, `ends` (n, 2), and the mitres `before` (at the start) and `after` (at the end; n, 2). A
    mitre is the shift of the end per metre of offset to the left. Columns of `arcs` (m, 6): centre x, y, radius,
    azimuth of the start, direction (+1 counter-clockwise), angle. `turnings` (k) are the angles by which the track
    turns at its mitred corners. `width` and `thickness` are the cross-section, `z` is the height of the mid-plane.
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
        """Return the track shifted by `dx` and `dy` (m)."""
        step = np.array([dx, dy])
        arcs = self.arcs + np.array([dx, dy, 0.0, 0.0, 0.0, 0.0])
        return replace(self, starts=self.starts + step, ends=self.ends + step, arcs=arcs)

    def scaled(self, factor: float) -> Track:
        """Return the track with every length (m) multiplied by `factor`."""
        arcs = self.arcs * np.array([factor, factor, factor, 1.0, 1.0, 1.0])
        return replace(self, starts=self.starts * factor, ends=self.ends * factor, arcs=arcs, width=self.width * factor,
                       thickness=self.thickness * factor, z=self.z * factor)


@record(eq=False)
class Pairs:
    """Pairs of pieces: number of the `first` and of the `second` piece (n each), and multiplicities `times`.

    A multiplicity is the number of equal pairs that one pair represents. `times` is (n, 1), or (n, columns) with one
    column for each height difference of layers, or for each relation. A relation is a set of pairs of layers with equal
    height difference.
    """

    first: Index
    second: Index
    times: Array

    def select(self, chosen: Flags | slice) -> Pairs:
        """Return only the chosen pairs (numbers, no unit)."""
        return Pairs(self.first[chosen], self.second[chosen], self.times[chosen])

    def parts(self, size: int) -> list[Pairs]:
        """Return the pairs (numbers, no unit) in blocks of at most `size` pairs."""
        return [self.select(part) for part in slices(len(self.first), size)]

    def in_columns(self, columns: Sequence[int]) -> Pairs:
        """Return only the pairs (numbers, no unit) that occur in some `columns` of `times`, with these columns."""
        times = self.times[:, columns]
        return Pairs(self.first, self.second, times).select(np.any(times != 0.0, axis=1))


Side = tuple[tuple[float, float], tuple[float, float]]
"""Straight side: (x, y) of the start and of the end (m)."""
BentPiece = tuple[tuple[float, float], float, float, float, float]
"""Arc: centre (x, y), radius, azimuth of the start, direction (+1 counter-clockwise), angle (m, rad)."""


def track(pieces: Sequence[Side | BentPiece], width: float, thickness: float, z: float) -> Track:
    """Return a track from its pieces in the order of the current.

    A piece is (start, end) of a straight side, or a `BentPiece`. Arcs must continue their neighbours smoothly.
    """
    arcs = [[*piece[0], *piece[1:]] for piece in pieces if len(piece) == 5]
    number = np.array([k for k, piece in enumerate(pieces) if len(piece) == 2], dtype=np.intp)
    sides = np.array([pieces[k] for k in number], dtype=float).reshape(-1, 2, 2)
    starts, ends = sides[:, 0], sides[:, 1]
    tangents = (ends - starts) / np.hypot(*(ends - starts).T)[:, None]
    is_corner = np.diff(number) == 1  # between a side and the next side, without an arc between them
    before, after = tangents.copy(), tangents.copy()
    before[1:][is_corner], after[:-1][is_corner] = tangents[:-1][is_corner], tangents[1:][is_corner]
    turnings = np.arccos(np.clip(np.sum(tangents * after, axis=1)[:-1][is_corner], -1.0, 1.0))
    return Track(starts, ends, _mitres(before, tangents), _mitres(tangents, after),
                 np.array(arcs, dtype=float).reshape(-1, 6), turnings, width, thickness, z)


def _mitres(incoming: Array, outgoing: Array) -> Array:
    """Return the shifts (n, 2; m per metre of offset to the left) of the joints of sides along unit vectors (n, 2).

    A shift is the sum of both normals divided by 1 + their scalar product (derived here).
    """
    normals = np.stack([-incoming[:, 1] - outgoing[:, 1], incoming[:, 0] + outgoing[:, 0]], axis=1)
    return np.asarray(normals / (1.0 + np.sum(incoming * outgoing, axis=1))[:, None])


@record(eq=False)
class StrandPairs:
    """All pairs of a strand of one track with a strand of another track.

    `offsets` are the strands' offsets to the left of each centre line (two arrays (k); m), `weights` (k; no unit) their
    quadrature weights. `heights` (m) are the heights that represent the distance of the layers. `clearances` is a table
    of distances (m) and of terms to add to squared distances (m2), which keep the mean distance.
    """

    offsets: tuple[Array, Array]
    weights: Array
    heights: Array
    clearances: tuple[Array, Array]

    def clearance(self, apart: Array) -> Array:
        """Return the term (m2) to add to the squared distances of strands, for pieces at distances `apart` (m)."""
        return np.asarray(np.interp(apart, *self.clearances))

    def blocks(self, count: int, points: int = 3) -> list[slice]:
        """Return slices of `count` pairs of pieces with `points` points each. A slice fits a processor's cache."""
        return slices(count, BLOCK // (points * self.weights.size * self.heights.size))

    def ends(self, track: Track, sides: Index, which: int) -> tuple[Array, Array]:
        """Return starts and ends (n, k, 2; m) of the k strands of some sides (n numbers).

        `which` is 0 if `track` is the first track, 1 if it is the second.
        """
        offset = self.offsets[which][:, None]
        starts = track.starts[sides, None, :] + offset * track.before[sides, None, :]
        return starts, track.ends[sides, None, :] + offset * track.after[sides, None, :]

    def weighted_sum(self, values: Array, times: Array) -> float:
        """Return the weighted sum of values (n, k, heights), in their unit.

        Each value is multiplied by the multiplicity of its pair (`times`) and the weight of its strands.
        """
        weighed = np.matmul(values, self.multiplicities_at_heights(times)[:, :, None])
        return float(np.sum(weighed[..., 0], axis=0) @ self.weights)

    def multiplicities_at_heights(self, times: Array) -> Array:
        """Return the multiplicities (n, heights; no unit) at every height.

        A single column `times` (n, 1) is divided equally among the heights.
        """
        heights = self.heights.size
        return times if times.shape[1] == heights else np.repeat(times / heights, heights, axis=1)


def strand_pairs(first: Track, second: Track, count: int, levels: int) -> StrandPairs:
    """Return all pairs of `count` strands per track, at the Gauss points of each width (m).

    The layers' distance is represented by `levels` heights (m). Clearances are from `mean_distance.strand_clearance`.
    """
    heights = level_heights(first.z - second.z, (first.thickness, second.thickness), levels)
    widths, thicknesses = (first.width, second.width), (first.thickness, second.thickness)
    clearances = clearance_table(abs(first.z - second.z), widths, thicknesses, count, levels)
    return StrandPairs(*_strand_offsets(*widths, count), np.array(heights), clearances)


def distant_strand_pairs(width: float, count: int, squares: Array) -> StrandPairs:
    """Return the pairs of strands of distant pieces, for given squared heights (m2) between the layers.

    At these distances, the squared heights represent the thickness completely. With one filament per track, the second
    moments of the widths, w^2 / 12 each, are subtracted. They are the first term of the mean logarithm
    (`mean_distance`).
    """
    less = width**2 / 6.0 if count == 1 else 0.0
    return StrandPairs(*_strand_offsets(width, width, count), np.sqrt(np.maximum(squares, 0.0)),
                       (np.zeros(1), np.full(1, -less)))


def _strand_offsets(width: float, other: float, count: int) -> tuple[tuple[Array, Array], Array]:
    """Return the offsets (m) and weights (no unit) of all pairs of `count` strands per track.

    Strands lie at the Gauss points of both widths `width` and `other` (m).
    """
    nodes, weights = gauss(count)
    a, b = np.divmod(np.arange(count * count), count)
    return (0.5 * width * nodes[a], 0.5 * other * nodes[b]), 0.25 * weights[a] * weights[b]


def common_height_count(first: Track, second: Track, count: int) -> int:
    """Return the number of heights (m) that represent the distance of two layers: two for thick copper, else one."""
    thick = max(first.thickness, second.thickness) > THICK * min(first.width, second.width)
    return 2 if first.z != second.z and count > 1 and thick else 1


def directions(steps: Array) -> Array:
    """Return the unit vectors (n, 2; no unit) along steps (n, 2; m)."""
    return np.asarray(steps / np.hypot(steps[:, 0], steps[:, 1])[:, None])


DIGITS = 9
"""Number of decimal places to which the coordinates of equal pieces agree, relative to the coil's size."""

CIRCLE = 720_720_000
"""Number of steps into which the full circle is divided. Directions are rounded to whole steps.

Directions of regular polygons with up to 16 sides are exact.
"""

SPACE = 3_000_000
"""Largest number of possible pair codes for which pairs are counted in a table. If there are more, codes are sorted."""

AT_ONCE = 500_000
"""Number of pairs of pieces whose codes are computed together."""


@record(eq=False)
class PieceKinds:
    """Numbers (n) that describe each piece: kind, kind of the mirror image, direction and layer.

    Fields in this order: `number`, `mirrored`, `heading`, `owner`. Pieces of one kind are equal up to a rotation about
    the centre.
    """

    number: Index
    mirrored: Index
    heading: Index
    owner: Index

    @property
    def count(self) -> int:
        """Number of kinds (no unit), mirror images included."""
        return 1 + int(max(self.number.max(), self.mirrored.max()))


@record(eq=False)
class Turns:
    """Numbers of the angles between any two directions.

    `between` (n, n) is the number of the angle from one direction to another, `opposite` the number of each angle's
    negative.
    """

    between: Index
    opposite: Index


def pool_tracks(tracks: Sequence[Track]) -> Track:
    """Return all pieces of several tracks (m) as one track in one plane, about their common origin."""
    first = tracks[0]
    starts, ends, before, after, arcs, turnings = (
        np.concatenate([getattr(track, name) for track in tracks])
        for name in ("starts", "ends", "before", "after", "arcs", "turnings")
    )
    return Track(starts, ends, before, after, arcs, turnings, first.width, first.thickness, 0.0)


def piece_kinds(tracks: Sequence[Track]) -> tuple[PieceKinds, PieceKinds, Turns]:
    """Return the kinds of all sides, the kinds of all arcs, and the angles between directions.

    Lengths of the tracks are relative to the tracks' size (no unit), about their common centre.
    """
    sides = [_sides(track) for track in tracks]
    arcs = [_arcs(track) for track in tracks]
    # number of each angle's direction (rad), and the turns between directions
    angles = np.concatenate([angle for _, _, angle in (*sides, *arcs)])
    whole = np.round(angles * (CIRCLE / math.tau)).astype(np.int64) % CIRCLE
    some, headings = np.unique(whole, return_inverse=True)
    turn, between = np.unique((some[None, :] - some[:, None]) % CIRCLE, return_inverse=True)
    turns = Turns(between.reshape(some.size, some.size), np.searchsorted(turn, (CIRCLE - turn) % CIRCLE))
    split = sum(len(angle) for _, _, angle in sides)
    return _number_kinds(sides, headings[:split]), _number_kinds(arcs, headings[split:]), turns


def _sides(track: Track) -> tuple[Array, Array, Array]:
    """Return rows (n, 5) that describe sides, rows that describe their mirror images, and directions (n; rad).

    Columns: start and end along the side, lateral coordinate, component along the side of the mitres at start and end.
    Coordinates refer to the direction of the side, so equal sides rotated about the centre have equal rows.
    """
    step = track.ends - track.starts
    tangents = step / np.hypot(step[:, 0], step[:, 1])[:, None]
    normals = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)

    def seen(points: Array, axis: Array = tangents) -> Array:
        return np.asarray(np.sum(points * axis, axis=1))

    start, end, lateral = seen(track.starts), seen(track.ends), seen(track.starts, normals)
    before, after = seen(track.before), seen(track.after)
    rows, mirrored = (start, end, lateral, before, after), (-end, -start, lateral, -after, -before)
    return np.stack(rows, axis=1), np.stack(mirrored, axis=1), np.arctan2(tangents[:, 1], tangents[:, 0])


def _arcs(track: Track) -> tuple[Array, Array, Array]:
    """Return rows (n, 5) that describe arcs, rows that describe their mirror images, and directions (n; rad).

    Columns: outward coordinate of the centre, lateral coordinate of the centre, radius, sense (1 or -1), angle (rad).
    Coordinates refer to the direction from the origin to the arc's middle, so equal arcs rotated about the origin have
    equal rows. The returned direction is the tangent at the middle.
    """
    x, y, radius, start, way, angle = track.arcs.T
    middle = start + 0.5 * way * angle
    cosine, sine = np.cos(middle), np.sin(middle)
    out, lateral = x * cosine + y * sine, y * cosine - x * sine
    # as for a counter-clockwise arc: the direction has its own column
    return (np.stack([out, lateral, radius, way, angle], axis=1), np.stack([out, -lateral, radius, way, angle], axis=1),
            middle + 0.5 * math.pi)


def _number_kinds(tables: Sequence[tuple[Array, Array, Array]], headings: Index) -> PieceKinds:
    """Return the kinds of pieces: rows (n, 5) that agree to `DIGITS` places have one kind.

    `tables` are the results of `_sides` or `_arcs` for each track, `headings` the numbers of the directions.
    """
    rows, mirrored = (np.concatenate([part[k] for part in tables]) for k in (0, 1))
    all_rows = np.round(np.concatenate([rows, mirrored]), DIGITS) + 0.0
    number = np.unique(all_rows, axis=0, return_inverse=True)[1].reshape(-1)
    owner = np.repeat(np.arange(len(tables)), [len(part[0]) for part in tables])
    return PieceKinds(number[: len(rows)], number[len(rows) :], headings, owner)


def distinct_pairs(
    kinds: PieceKinds, other_kinds: PieceKinds, turns: Turns, relations: Sequence[Sequence[tuple[int, int, float]]]
) -> Pairs:
    """Return the distinct pairs of a piece of the first set and a piece of the second set, with their multiplicities.

    Parameters
    ----------
    kinds, other_kinds : PieceKinds
        kinds of the pieces of both sets
    turns : Turns
        angles between directions
    relations : sequence of Sequence[tuple[int, int, float]]
        lists of (first layer, second layer, multiplicity). The result has a column of `times` for each list.
    """
    layers_in_all = 1 + max(max(i, j) for layers in relations for i, j, _ in layers)
    plans, other_plans = _first_equal_layers(kinds, layers_in_all), _first_equal_layers(other_kinds, layers_in_all)
    tallied: list[dict[tuple[int, int], float]] = [{} for _ in relations]
    for layers, count in zip(relations, tallied, strict=True):
        for i, j, often in layers:
            count[plans[i], other_plans[j]] = count.get((plans[i], other_plans[j]), 0.0) + often
    plan_pairs = dict.fromkeys(pair for count in tallied for pair in count)
    tallies = {pair: list(_count_pairs(kinds, other_kinds, turns, *pair)) for pair in plan_pairs}
    entries = [(codes, where, often * counts, column) for column, count in enumerate(tallied)
             for pair, often in count.items() for codes, where, counts in tallies[pair]]
    codes, where, times = (np.concatenate([part[k] for part in entries]) for k in range(3))
    column = np.repeat([part[3] for part in entries], [len(part[0]) for part in entries])
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    table = np.bincount(which * len(relations) + column, times, first.size * len(relations)).astype(float)
    rows, columns = np.divmod(where[first], len(other_kinds.number))
    return Pairs(rows, columns, table.reshape(first.size, len(relations)))


def _first_equal_layers(kinds: PieceKinds, count: int) -> list[int]:
    """Return, for each of `count` layers, the number of the first layer with equal pieces.

    Many coils repeat every other layer. Layers may have no pieces of the kind, such as arcs in a track that leads to a
    pad.
    """
    numbers: dict[tuple[bytes, ...], int] = {}
    layers = [kinds.owner == layer for layer in range(count)]
    tables = kinds.number, kinds.mirrored, kinds.heading
    return [numbers.setdefault(tuple(table[members].tobytes() for table in tables), k)
            for k, members in enumerate(layers)]


def _count_pairs(
    kinds: PieceKinds, other_kinds: PieceKinds, turns: Turns, first: int, second: int
) -> Iterator[tuple[Index, Index, Array]]:
    """Yield the distinct pairs of two layers' pieces: codes (no unit), an index of each pair, and its multiplicity.

    The index refers to the table of all pairs. Each step handles some pieces of the first layer.
    """
    rows, columns = np.nonzero(kinds.owner == first)[0], np.nonzero(other_kinds.owner == second)[0]
    for part in slices(rows.size, AT_ONCE // max(1, columns.size)):
        here = rows[part, None]
        where = (here * len(other_kinds.number) + columns).ravel()
        codes, space = _codes(kinds, other_kinds, turns, here, columns)
        distinct, index, counts = _tally_codes(codes.ravel(), space)
        yield distinct, where[index], counts.astype(float)


def _codes(kinds: PieceKinds, other_kinds: PieceKinds, turns: Turns, i: Index, j: Index) -> tuple[Index, int]:
    """Return a code for each pair, which is equal for equivalent pairs, and the number of possible codes.

    A pair is equivalent to its mirror image, and to both with their pieces exchanged. The code is the least of the four
    numbers.
    """
    angles = turns.opposite.size
    turn = turns.between[kinds.heading[i], other_kinds.heading[j]]
    back = turns.opposite[turn]
    a, b, c, d = kinds.number[i], other_kinds.number[j], kinds.mirrored[i], other_kinds.mirrored[j]
    count, other_count = kinds.count, other_kinds.count
    codes = np.minimum((a * other_count + b) * angles + turn, (c * other_count + d) * angles + back)
    if kinds is other_kinds:
        np.minimum(codes, (b * other_count + a) * angles + back, out=codes)
        np.minimum(codes, (d * other_count + c) * angles + turn, out=codes)
    return codes, count * other_count * angles


def _tally_codes(codes: Index, space: int) -> tuple[Index, Index, Index]:
    """Return the distinct codes, the index of one occurrence of each in `codes`, and their counts (no unit).

    `space` is the number of possible codes.
    """
    if space > SPACE:
        return np.unique(codes, return_index=True, return_counts=True)
    counts: Index = np.bincount(codes, minlength=space)
    index = np.empty(space, dtype=np.intp)
    index[codes] = np.arange(codes.size)
    distinct = np.nonzero(counts)[0]
    return distinct, index[distinct], counts[distinct]
