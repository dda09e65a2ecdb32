"""One layer's track of straight sides and circular arcs, divided into strands at the Gauss points of its width.

Strands are mitred at corners. Pairs of strands keep the mean distances of the tracks' rectangles.

Most turns of a coil are repeated: rotated about its centre, mirrored, or on another layer. Each piece is described in
the frame of its own direction, so that a rotation about the centre changes its direction alone. A mirror image and a
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
"""Least squared distance of strands, over the squared size of the tracks.

It avoids a division by zero if strands meet.
"""

THICK = 0.25
"""Least thickness over width of tracks at which two heights represent the thickness of each pair of layers."""

BLOCK = 60_000
"""Number of pairs of pieces processed at once, which fit a processor's cache."""


@record(eq=False)
class Track:
    """One layer's conductor along its current, in metres and radians.

    Straight sides: `starts`, `ends` (n, 2) and the mitres `before`, `after` (n, 2), which are the shifts of the ends
    per metre of offset to the left. Arcs (m, 6): centre x, y, radius, azimuth of the start, direction (+1
    counter-clockwise), angle. `turnings` (k) are the angles by which the track turns at its mitred corners.
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
        """Return the track moved by (dx, dy) metres."""
        step = np.array([dx, dy])
        arcs = self.arcs + np.array([dx, dy, 0.0, 0.0, 0.0, 0.0])
        return replace(self, starts=self.starts + step, ends=self.ends + step, arcs=arcs)

    def scaled(self, factor: float) -> Track:
        """Return the track with every length (m) multiplied."""
        arcs = self.arcs * np.array([factor, factor, factor, 1.0, 1.0, 1.0])
        return replace(self, starts=self.starts * factor, ends=self.ends * factor, arcs=arcs, width=self.width * factor,
                       thickness=self.thickness * factor, z=self.z * factor)


@record(eq=False)
class Pairs:
    """Pairs of pieces: numbers (n) of the first and of the second piece, and multiplicities.

    `times` is (n, 1), or (n, heights) with a multiplicity for each height between the pieces.
    """

    first: Index
    second: Index
    times: Array

    def where(self, chosen: Flags | slice) -> Pairs:
        """Return the chosen pairs (numbers, no unit)."""
        return Pairs(self.first[chosen], self.second[chosen], self.times[chosen])

    def parts(self, size: int) -> list[Pairs]:
        """Return all pairs (numbers, no unit) in blocks of `size`."""
        return [self.where(part) for part in slices(len(self.first), size)]

    def at(self, columns: Sequence[int]) -> Pairs:
        """Return the pairs that occur in some columns of `times`, with these columns only (numbers, no unit)."""
        times = self.times[:, columns]
        return Pairs(self.first, self.second, times).where(np.any(times != 0.0, axis=1))


Side = tuple[tuple[float, float], tuple[float, float]]
BentPiece = tuple[tuple[float, float], float, float, float, float]
"""An arc: centre, radius, azimuth of the start, direction (+1 counter-clockwise), angle."""


def track(pieces: Sequence[Side | BentPiece], width: float, thickness: float, z: float) -> Track:
    """Return a track from its pieces in the current's order.

    A piece is (start, end) of a side or a `BentPiece`. Arcs continue their neighbours smoothly.
    """
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
                 np.array(turnings, dtype=float), width, thickness, z)


def _tangent(side: Side | BentPiece) -> Array:
    """Return the unit vector (2,) along a side."""
    step = np.subtract(side[1], side[0])
    return np.asarray(step / np.hypot(*step))


def _mitre(incoming: Array, outgoing: Array) -> Array:
    """Return the shift (2,; m per metre of offset to the left) of the joint of sides along two unit vectors.

    It is the sum of both normals over 1 + their product (derived here).
    """
    incoming_normal, outgoing_normal = np.array([-incoming[1], incoming[0]]), np.array([-outgoing[1], outgoing[0]])
    return np.asarray((incoming_normal + outgoing_normal) / (1.0 + incoming_normal @ outgoing_normal))


@record(eq=False)
class StrandPairs:
    """All pairs of strands of two tracks.

    `offsets` (m) and `weights` (k; weights) are by pair of strands, `heights` (m) are between the tracks. `clearances`
    is a table of distances (m) and of the terms to add to squared distances there (m2).
    """

    offsets: tuple[Array, Array]
    weights: Array
    heights: Array
    clearances: tuple[Array, Array]

    def clearance(self, apart: Array) -> Array:
        """Return the term (m2) to add to the squared distances of pieces `apart` (m)."""
        return np.asarray(np.interp(apart, *self.clearances))

    def blocks(self, count: int, points: int = 3) -> list[slice]:
        """Return slices of `count` pairs of pieces, each with `points` points.

        A slice fits a processor's cache.
        """
        return slices(count, BLOCK // (points * self.weights.size * self.heights.size))

    def ends(self, track: Track, sides: Index, which: int) -> tuple[Array, Array]:
        """Return starts and ends (n, k, 2; m) of the strands of some sides of the first (0) or the second (1) track."""
        offset = self.offsets[which][:, None]
        starts = track.starts[sides, None, :] + offset * track.before[sides, None, :]
        return starts, track.ends[sides, None, :] + offset * track.after[sides, None, :]

    def total(self, values: Array, times: Array) -> float:
        """Return the sum of values (n, k, heights), in their unit.

        Each value is multiplied by the multiplicity of its pair and the weight of its strands.
        """
        weighed = np.matmul(values, self.at_heights(times)[:, :, None])
        return float(np.sum(weighed[..., 0], axis=0) @ self.weights)

    def at_heights(self, times: Array) -> Array:
        """Return multiplicities (n, heights; no unit) at every height.

        A single column (n, 1) is divided equally among the heights.
        """
        heights = self.heights.size
        return times if times.shape[1] == heights else np.repeat(times / heights, heights, axis=1)


def strand_pairs(first: Track, second: Track, count: int, levels: int) -> StrandPairs:
    """Return all pairs of `count` strands per track, at the Gauss points of its width (m).

    The pairs are at `levels` heights (m), with clearances from `mean_distance.strand_clearance`.
    """
    heights = level_heights(first.z - second.z, (first.thickness, second.thickness), levels)
    widths, thicknesses = (first.width, second.width), (first.thickness, second.thickness)
    clearances = clearance_table(abs(first.z - second.z), widths, thicknesses, count, levels)
    return StrandPairs(*_strands(*widths, count), np.array(heights), clearances)


def distant_strand_pairs(width: float, count: int, squares: Array) -> StrandPairs:
    """Return the pairs of strands of distant pieces, for which squared heights (m2) represent the thickness completely.

    For one filament per track, the width's second moments, w^2 / 12 each, are subtracted: the first term of the mean
    logarithm (`mean_distance`).
    """
    less = width**2 / 6.0 if count == 1 else 0.0
    return StrandPairs(*_strands(width, width, count), np.sqrt(np.maximum(squares, 0.0)),
                       (np.zeros(1), np.full(1, -less)))


def _strands(width: float, other: float, count: int) -> tuple[tuple[Array, Array], Array]:
    """Return offsets (m) and weights of all pairs of `count` strands per track.

    Strands lie at the Gauss points of both widths (m).
    """
    nodes, weights = gauss(count)
    a, b = np.divmod(np.arange(count * count), count)
    return (0.5 * width * nodes[a], 0.5 * other * nodes[b]), 0.25 * weights[a] * weights[b]


def common_levels(first: Track, second: Track, count: int) -> int:
    """Return the number of heights (m) of the strands of two layers: two if the copper is thick, else one."""
    thick = max(first.thickness, second.thickness) > THICK * min(first.width, second.width)
    return 2 if first.z != second.z and count > 1 and thick else 1


def directions(steps: Array) -> Array:
    """Return unit vectors (n, 2; no unit) along steps (m)."""
    return np.asarray(steps / np.hypot(steps[:, 0], steps[:, 1])[:, None])


DIGITS = 9
"""Number of decimal places to which the coordinates of equal pieces agree, in units of the coil's size."""

CIRCLE = 720_720_000
"""Number of parts of a circle. Directions are rounded to whole numbers of parts.

Directions of regular polygons with up to 16 sides are exact.
"""

SPACE = 3_000_000
"""Largest number of possible pair codes at which pairs are counted in a table. If there are more, codes are sorted."""

AT_ONCE = 500_000
"""Number of pairs of pieces numbered at once."""


@record(eq=False)
class PieceKinds:
    """Numbers (n) that describe each piece: kind, kind of the mirror image, direction and layer.

    Pieces of one kind are equal up to a rotation about the centre.
    """

    number: Index
    mirrored: Index
    heading: Index
    owner: Index

    @property
    def count(self) -> int:
        """Number of kinds, with mirror images (no unit)."""
        return 1 + int(max(self.number.max(), self.mirrored.max()))


@record(eq=False)
class Turns:
    """Numbers of the angles between directions (n, n), and the number of each angle's opposite."""

    between: Index
    opposite: Index


def pool_tracks(tracks: Sequence[Track]) -> Track:
    """Return all pieces of tracks (m) as a single track in one plane, about their common origin."""
    first = tracks[0]
    starts, ends, before, after, arcs, turnings = (
        np.concatenate([getattr(track, name) for track in tracks])
        for name in ("starts", "ends", "before", "after", "arcs", "turnings")
    )
    return Track(starts, ends, before, after, arcs, turnings, first.width, first.thickness, 0.0)


def piece_kinds(tracks: Sequence[Track]) -> tuple[PieceKinds, PieceKinds, Turns]:
    """Return the kinds of all sides and of all arcs of tracks about their common centre.

    Lengths are relative to the tracks' size (no unit). The third result holds the turns between directions.
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
    """Return rows (n, 5) of sides, rows of their mirror images, and directions (n; rad).

    A row is start and end along the side, lateral coordinate, and the mitres at start and end. Coordinates refer to the
    direction of the side, so equal sides rotated about the centre have equal rows.
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
    """Return rows (n, 5) of arcs, rows of their mirror images, and directions (n; rad) at the arcs' middles.

    A row is outward coordinate, lateral coordinate, radius, sense (1 or -1) and angle (rad). Coordinates refer to the
    direction from the centre to the arc's middle, so equal arcs rotated about the centre have equal rows.
    """
    x, y, radius, start, way, angle = track.arcs.T
    middle = start + 0.5 * way * angle
    cosine, sine = np.cos(middle), np.sin(middle)
    out, lateral = x * cosine + y * sine, y * cosine - x * sine
    # as for a counter-clockwise arc: the direction has its own column
    return (np.stack([out, lateral, radius, way, angle], axis=1), np.stack([out, -lateral, radius, way, angle], axis=1),
            middle + 0.5 * math.pi)


def _number_kinds(tables: Sequence[tuple[Array, Array, Array]], headings: Index) -> PieceKinds:
    """Return the kinds of pieces: rows (n, 5) that agree to DIGITS places have one kind.

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
    kinds, other_kinds : Kinds
        kinds of both sets of pieces
    turns : Turns
        angles between directions
    relations : sequence of Sequence[tuple[int, int, float]]
        lists of layer numbers (first, second) with a multiplicity. The result has a column of `times` for each list
    """
    layers_in_all = 1 + max(max(i, j) for layers in relations for i, j, _ in layers)
    plans, other_plans = _plans(kinds, layers_in_all), _plans(other_kinds, layers_in_all)
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


def _plans(kinds: PieceKinds, count: int) -> list[int]:
    """Return, for each of `count` layers, the number of the first layer with the same pieces.

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
    """Yield codes (no unit) of the distinct pairs of two layers' pieces, their places and their multiplicities.

    A place is an index into the table of all pairs. Each step handles some rows.
    """
    rows, columns = np.nonzero(kinds.owner == first)[0], np.nonzero(other_kinds.owner == second)[0]
    for part in slices(rows.size, AT_ONCE // max(1, columns.size)):
        here = rows[part, None]
        where = (here * len(other_kinds.number) + columns).ravel()
        codes, space = _codes(kinds, other_kinds, turns, here, columns)
        distinct, index, counts = _tally_codes(codes.ravel(), space)
        yield distinct, where[index], counts.astype(float)


def _codes(kinds: PieceKinds, other_kinds: PieceKinds, turns: Turns, i: Index, j: Index) -> tuple[Index, int]:
    """Return codes that equivalent pairs share, and the number of possible codes.

    A code is the least number of the pair, its mirror image, and both with the pieces exchanged.
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
