"""Gaps between all pieces of copper of a layout: between turns of one coil and between coils.

Pieces are exact lines and arcs, and their positions along each coil's conductor are known. Joined pieces have no gap.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING

import numpy as np

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Point
from sitscad.kernels.geometry.primitives import (
    Primitives,
    Row,
    distances,
    distances_to_points,
    from_rows,
    line_row,
    nearest_pairs,
    path_rows,
)
from sitscad.layout.board import Layout, Pad, Role, Teardrop, Trace, Via
from sitscad.layout.clearance import ALONG

if TYPE_CHECKING:
    from sitscad.basics.arrays import Array, Flags, Index

ROUNDING = 1e-9
"""Difference (m) below which two lengths count as equal."""

DETOUR = 1.5
"""Smallest ratio, for two pieces of one conductor between which it turns back.

The ratio is the distance along the conductor divided by the direct distance. It is 1.41 for a right angle and 1.57 for
a half circle.
"""

_SPLITS = 4

Item = Trace | Via | Pad | Teardrop


@record
class Copper:
    """All copper as arrays with one element per piece and layer. A via has a piece on each layer.

    `half` (m) is half the piece's width, and `chain` the number of its conductor. `first` and `last` (m) are the
    positions of its ends along this conductor. `item` is the index into `items` of the track, via, pad or teardrop with
    this piece. Copper of one conductor counts as joined up to a certain distance along it, to which `reach` (m) is
    added. It is half the diagonal of a contact, and 0 for tracks.
    """

    layer: Index
    pieces: Primitives
    half: Array
    chain: Index
    first: Array
    last: Array
    reach: Array
    item: Index
    items: tuple[Item, ...]


@record
class Nearness:
    """A narrow place between two pieces of copper on copper layer `layer`.

    `one` and `other` are the two tracks, vias, pads or teardrops. `distance` (m) is the distance of their centre lines,
    and `half_one` and `half_other` (m) are half their widths. `x` and `y` (m) give the position. `asked` (m) is the
    minimum gap with which the gap is compared.
    """

    one: Item
    other: Item
    layer: int
    distance: float
    half_one: float
    half_other: float
    x: float
    y: float
    asked: float

    @property
    def gap(self) -> float:
        """Gap (m) between the copper edges. Negative if the pieces overlap."""
        return self.distance - self.half_one - self.half_other

    @property
    def nets(self) -> tuple[str, ...]:
        """Nets of the two items, without repetition."""
        return tuple(sorted({self.one.net, self.other.net}))


@record
class _Stand:
    """Position of an item on its conductor.

    `chain` is the conductor's number. `at` is the distance (m) along the conductor to the item's start.
    """

    chain: int
    at: float


def name_of(item: Item) -> str:
    """Return a text for a track, via, contact or teardrop with its net."""
    if isinstance(item, Via):
        return f"a via of {item.net}"
    if isinstance(item, Pad):
        return f"contact {item.name}"
    if isinstance(item, Teardrop):
        return f"a teardrop of {item.net}"
    return f"the {item.role.value} of {item.net}"


def pair_in_words(near: Nearness) -> str:
    """Return a text for the two pieces of copper at a narrow place."""
    first, second = name_of(near.one), name_of(near.other)
    return f"two parts of {first}" if near.one is near.other else f"{first} and {second}"


def copper_of(layout: Layout) -> Copper:
    """Return all copper of a layout as arrays."""
    positions = dict(_conductor_positions(layout))
    items: tuple[Item, ...] = (*layout.traces, *layout.vias, *layout.all_pads, *layout.teardrops)
    rows: list[Row] = []
    columns: list[tuple[int, float, int, float, float, float, int]] = []
    for index, item in enumerate(items):
        position = positions.get(id(item), _Stand(-1 - index, 0.0))
        layers = range(1, layout.lowest_layer(item) + 1) if isinstance(item, Via) else (item.layer,)
        for row, half, start, length, reach in _pieces(item):
            at = position.at + start
            for layer in layers:
                rows.append(row)
                columns.append((layer, half, position.chain, at, at + length, reach, index))
    table = np.array(columns, dtype=float).reshape(-1, 7)
    layer_of, chain, item_of = (table[:, k].astype(np.intp) for k in (0, 2, 6))
    half_width, first, last, reached = (table[:, k] for k in (1, 3, 4, 5))
    return Copper(layer_of, from_rows(rows), half_width, chain, first, last, reached, item_of, items)


def too_near(copper: Copper, spacing: float, winding_spacing: float) -> Iterator[Nearness]:
    """Yield pairs of items that are not joined and whose gap on a layer is smaller than `spacing` (m).

    `winding_spacing` (m) is the minimum between two tracks of one coil if at least one is a turn. For each pair of
    items and each layer, only the narrowest place is yielded.
    """
    track = np.array([isinstance(item, Trace) for item in copper.items], dtype=bool)
    turn = np.array([isinstance(item, Trace) and item.role is Role.WINDING for item in copper.items], dtype=bool)
    i, j = _pairs(copper, spacing)
    keep = track[copper.item[i]] | (copper.item[i] != copper.item[j])
    i, j = i[keep], j[keep]
    first, second = copper.item[i], copper.item[j]
    # pairs of tracks of one conductor of which one at least is a turn
    is_turn_gap = track[first] & track[second] & (turn[first] | turn[second]) & (copper.chain[i] == copper.chain[j])
    spacings = np.where(is_turn_gap, winding_spacing, spacing)
    gap = _gaps(copper, i, j, spacings)
    bad = np.flatnonzero(gap < spacings - ROUNDING)
    yield from _worst_by_items(copper, i[bad], j[bad], gap[bad], copper.half, spacings[bad])


def smallest_gaps(layout: Layout) -> dict[int, Nearness]:
    """Return the smallest gap between two pieces of copper on each copper layer, by the layer's number.

    Layers with a single piece of copper are left out. Successive pieces of one conductor count only if the conductor
    turns back.
    """
    copper, smallest = copper_of(layout), dict[int, Nearness]()
    layers, reach = set(copper.layer.tolist()), 2.0 * layout.spec.coil.trace_spacing
    widest = 2.0 * max(layout.size)
    while layers - smallest.keys() and reach < widest:
        for near in chain(too_near(copper, reach, reach), conductor_notches(copper, reach)):
            if near.layer not in smallest or near.gap < smallest[near.layer].gap - ROUNDING:
                smallest[near.layer] = near
        reach *= 4.0
    return dict(sorted(smallest.items()))


def drill_nearness(copper: Copper, clearance: float) -> Iterator[Nearness]:
    """Yield each via whose drilled hole is closer than `clearance` (m) to copper that is not joined to the via.

    Copper on all layers is compared. In the `Nearness`, the via's half width (`half_one` or `half_other`) is the
    radius of its hole, not of its pad.
    """
    radius = np.array([item.drill / 2.0 if isinstance(item, Via) else np.nan for item in copper.items])
    drilled = radius[copper.item] if len(radius) else np.empty(0)
    half = np.where(np.isnan(drilled), copper.half, drilled)
    i, j = _pairs(copper, clearance, ~np.isnan(drilled))
    gap = _gaps(copper, i, j, np.full(len(i), clearance), half)
    bad = np.flatnonzero(gap < clearance - ROUNDING)
    yield from _worst_by_items(copper, i[bad], j[bad], gap[bad], half, np.full(len(bad), clearance))


def conductor_notches(copper: Copper, spacing: float) -> Iterator[Nearness]:
    """Yield places at which one conductor turns back and leaves a gap of less than `spacing` (m).

    Two pieces belong to a turn back if their distance along the conductor is at least `DETOUR` times the direct centre
    distance. Two straight tracks that meet in a corner are never reported, at any angle.
    """
    i, j = _pairs(copper, spacing)
    i, j = np.where(copper.first[i] <= copper.first[j], (i, j), (j, i))
    heading, arriving = copper.pieces.tangents
    back = (heading[i] * arriving[j]).sum(axis=1) < 0.0
    track = np.array([isinstance(item, Trace) for item in copper.items], dtype=bool)[copper.item]
    keep = (
        track[i]
        & track[j]
        & (copper.chain[i] == copper.chain[j])
        & (copper.first[j] > copper.last[i] + ROUNDING)
        & back
    )
    i, j = i[keep], j[keep]
    spacings = np.full(len(i), spacing)
    gap = _gaps(copper, i, j, spacings, factor=DETOUR)
    bad = np.flatnonzero((gap > ROUNDING) & (gap < spacing - ROUNDING))
    bad = bad[_gaps(copper, i[bad], j[bad], spacings[bad]) >= spacing - ROUNDING]  # the rest has a clearance
    yield from _worst_by_items(copper, i[bad], j[bad], gap[bad], copper.half, spacings[bad])


def _pairs(copper: Copper, clearance: float, chosen: Flags | None = None) -> tuple[Index, Index]:
    # Index pairs of pieces on one layer whose boxes come within the clearance of one another; with `chosen` those of a
    # chosen piece and one that is not.
    boxes, reach = copper.pieces.boxes, copper.half + clearance / 2.0
    index_pairs = [np.empty((0, 2), dtype=np.intp)]
    for layer in sorted(set(copper.layer.tolist())):
        members = np.flatnonzero(copper.layer == layer)
        if chosen is None:
            index_pairs.append(members[nearest_pairs(boxes[members], reach[members])])
            continue
        these, those = members[chosen[members]], members[~chosen[members]]
        pairs = nearest_pairs(boxes[these], reach[these], boxes[those], reach[those])
        index_pairs.append(np.sort(np.column_stack([these[pairs[:, 0]], those[pairs[:, 1]]]), axis=1))
    pairs = np.concatenate(index_pairs)
    return pairs[:, 0], pairs[:, 1]


def _gaps(
    copper: Copper, i: Index, j: Index, spacings: Array, half: Array | None = None, factor: float = ALONG
) -> Array:
    """Return the gap (m) between the pieces `i` and `j` of each pair. Infinite if both pieces are joined completely.

    Parts of one conductor count as joined if their distance along the conductor is less than `factor` times the needed
    centre distance. Joined parts are left out. `spacings` (m) are the needed gaps of the pairs. `half` (m) replaces
    `copper.half` if it is given.
    """
    half = copper.half if half is None else half
    widths = half[i] + half[j]
    gap = np.full(len(i), np.inf)
    in_order = (copper.first[i] + copper.last[i]) <= (copper.first[j] + copper.last[j])
    earlier, later = np.where(in_order, i, j), np.where(in_order, j, i)
    way = np.maximum(0.0, copper.first[later] - copper.last[earlier])
    joined = factor * (spacings + copper.half[i] + copper.half[j]) + copper.reach[i] + copper.reach[j]
    joined = np.where(copper.chain[i] == copper.chain[j], joined, 0.0)
    apart = np.flatnonzero(way >= joined)
    gap[apart] = distances(copper.pieces.take(i[apart]), copper.pieces.take(j[apart])) - widths[apart]
    # What is joined is cut off the facing ends, so that as much way lies between the rest as counts as joined. The cut
    # may fall on either end, so it is shared out between both in `_SPLITS` steps, and the nearest of all counts.
    near = np.flatnonzero(way < joined)
    if near.size:
        fractions = np.linspace(0.0, 1.0, _SPLITS + 1)
        excess = np.outer(fractions, joined[near] - way[near])
        count = len(fractions)
        trimmed = _trimmed(copper, np.tile(earlier[near], count), np.tile(later[near], count), excess.ravel(),
                           excess[::-1].ravel())
        gap[near] = trimmed.reshape(count, -1).min(axis=0) - widths[near]
    return gap


def _trimmed(copper: Copper, earlier: Index, later: Index, cut: Array, other_cut: Array) -> Array:
    # Distance between pieces with `cut` (m) taken off the end of the earlier, `other_cut` off the start of the later;
    # infinite where nothing is left of one.
    length = copper.last[earlier] - copper.first[earlier]
    other_length = copper.last[later] - copper.first[later]
    result = np.full(len(earlier), np.inf)
    kept_rows = np.flatnonzero((cut <= length) & (other_cut <= other_length))
    if kept_rows.size:
        last = 1.0 - cut[kept_rows] / np.where(length[kept_rows] > 0.0, length[kept_rows], 1.0)
        first = other_cut[kept_rows] / np.where(other_length[kept_rows] > 0.0, other_length[kept_rows], 1.0)
        first_pieces = copper.pieces.take(earlier[kept_rows]).trimmed(np.zeros(len(kept_rows)), last)
        second_pieces = copper.pieces.take(later[kept_rows]).trimmed(first, np.ones(len(kept_rows)))
        result[kept_rows] = distances(first_pieces, second_pieces)
    return result


def _worst_by_items(copper: Copper, i: Index, j: Index, gap: Array, half: Array, spacings: Array) -> Iterator[Nearness]:
    """Yield the narrowest place of each pair of items on each layer, the smallest gap first.

    `i` and `j` are the pieces of each pair, `gap` (m) is their gap, and `spacings` (m) the needed gap. `half` (m) is
    half the width of each piece.
    """
    reported: set[tuple[int, int, int]] = set()
    gap = np.round(gap, 12)  # picometres: rounding noise must not decide which of two equal places is named
    for k in np.lexsort((j, i, gap)):
        a, b = int(i[k]), int(j[k])
        layer, first, second = int(copper.layer[a]), int(copper.item[a]), int(copper.item[b])
        if (layer, first, second) in reported:
            continue
        reported.add((layer, first, second))
        x, y = _place(copper, a, b)
        distance = float(gap[k] + half[a] + half[b])
        yield Nearness(copper.items[first], copper.items[second], layer, distance, float(half[a]), float(half[b]), x, y,
                       float(spacings[k]))


def _place(copper: Copper, a: int, b: int) -> tuple[float, float]:
    """Return x and y (m) of a place at which two pieces are closest.

    It is the nearest of 33 points on the shorter piece.
    """
    if float(copper.last[a] - copper.first[a]) > float(copper.last[b] - copper.first[b]):
        a, b = b, a
    fractions = np.linspace(0.0, 1.0, 33)
    points = copper.pieces.take(np.full(33, a)).trimmed(fractions, fractions).start
    nearest = int(np.argmin(distances_to_points(copper.pieces.take(np.full(33, b)), points)))
    return float(points[nearest, 0]), float(points[nearest, 1])


# ------------------------------------------------------------------------------------------------ pieces and chains


def _pieces(item: Item) -> Iterator[tuple[Row, float, float, float, float]]:
    """Yield the pieces of an item as (row, half width, distance from the item's start, length, reach), in metres.

    `row` is the line or arc of the piece. `reach` is added to the distance along the conductor within which copper
    counts as joined.
    """
    if isinstance(item, Via):
        yield line_row(*item.centre, *item.centre), item.pad / 2.0, 0.0, 0.0, 0.0
    elif isinstance(item, Pad):
        (x, y), (width, height), reach = item.centre, item.size, float(np.hypot(*item.size)) / 2.0
        x0, y0, x1, y1 = x - width / 2.0, y - height / 2.0, x + width / 2.0, y + height / 2.0
        for edge in ((x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)):
            yield line_row(*edge), 0.0, 0.0, 0.0, reach
        # along its middle the widest track that fits in it, so that its inside counts
        half = min(width, height) / 2.0
        dx, dy = max(0.0, width / 2.0 - half), max(0.0, height / 2.0 - half)
        yield line_row(x - dx, y - dy, x + dx, y + dy), half, 0.0, 0.0, reach
    elif isinstance(item, Teardrop):
        corners = item.outline.flattened(1e-6)
        reach = max(item.origin.distance(corner) for corner in corners)
        for row, _ in path_rows(item.outline):
            yield row, 0.0, 0.0, 0.0, reach
    else:
        way = 0.0
        for row, length in path_rows(item.path):
            yield row, item.width / 2.0, way, length, 0.0
            way += length


def _conductor_positions(layout: Layout) -> Iterator[tuple[int, _Stand]]:
    """Yield (identity, position along its conductor) for each item of the layout."""
    positions: dict[tuple[object, ...], _Stand] = {}
    for number, (net, series) in enumerate(layout.conductors):
        station = 0.0
        for element in series:
            positions[_key(element)] = _Stand(number, station)
            station += element.path.length if isinstance(element, Trace) else 0.0
        yield from _contact_stands(layout.all_pads, net, series, number, station)
    items: tuple[Trace | Via, ...] = (*layout.traces, *layout.vias)
    items_by_key = {_key(item): item for item in items}
    yield from ((id(items_by_key[key]), position) for key, position in positions.items() if key in items_by_key)
    # a teardrop stands where its track begins or ends
    for drop in layout.teardrops:
        track = layout.traces[drop.track]
        position = positions.get(_key(track))
        if position is not None:
            yield id(drop), _Stand(position.chain, position.at + (0.0 if drop.at_start else track.path.length))


def _contact_stands(
    pads: Sequence[Pad], net: str, series: Sequence[Trace | Via], number: int, length: float
) -> Iterator[tuple[int, _Stand]]:
    """Yield (identity, position along the conductor) for each pad of a conductor.

    `series` are the conductor's tracks and vias in order, `number` is its number, and `length` (m) its total length.
    """
    traces = [element for element in series if isinstance(element, Trace)]
    if not traces:
        return
    ends: list[tuple[Point, float]] = [(traces[0].path.start, 0.0), (traces[-1].path.end, length)]
    # where tracks of one layer follow each other, too, and how far along the conductor (m): pads may stand there
    station = 0.0
    for piece, following in pairwise(series):
        station += piece.path.length if isinstance(piece, Trace) else 0.0
        if isinstance(piece, Trace) and isinstance(following, Trace) and piece.layer == following.layer:
            ends.append((piece.path.end, station))
    for pad in pads:
        (x, y), dx, dy = pad.centre, pad.size[0] / 2.0 + ROUNDING, pad.size[1] / 2.0 + ROUNDING
        for point, at in ends:
            if pad.net == net and abs(point.x - x) <= dx and abs(point.y - y) <= dy:
                yield id(pad), _Stand(number, at)
                break


def _key(item: Trace | Via) -> tuple[object, ...]:
    """Return a key that identifies a track or via of a layout. It is cheaper than comparing whole paths."""
    if isinstance(item, Via):
        return ("via", item.centre, item.net)
    return ("trace", item.layer, item.path.start, item.path.end, len(item.path.segments), item.net)
