"""SIT120 to SIT122 and SIT125: acute corners, slivers, closed loops and loose ends of the drawn copper.

The copper is a graph over all layers, independent of the names of nets.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.basics.finding import Place
from sitscad.basics.record import record
from sitscad.checks.board.clearances import ALLOWED_SHORTFALL, cached_copper
from sitscad.checks.board.fabrication import minimum_gap_source
from sitscad.checks.fixes.moves import moved_layer_ends
from sitscad.checks.rules import Rule, Verdict, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design, cached_per_board
from sitscad.kernels.geometry.path import Point, winding_number
from sitscad.kernels.geometry.primitives import distances_to_points, from_rows, nearest_pairs, path_rows
from sitscad.layout.board import Layout, Pad, Trace
from sitscad.layout.gaps import Copper, conductor_notches, name_of, pair_in_words

CHORD = 10e-6
"""Largest distance (m) between an arc and the chords that replace it, when the area of a loop is computed."""

_GRID = 1e-8

Node = tuple[int, int, int]


def _grid_cell(point: Point) -> tuple[int, int]:
    return round(point.x / _GRID), round(point.y / _GRID)


@record
class ConductorLoop:
    """A closed path along tracks and vias of all layers, seen from above.

    ``points`` (m) are its corners. They begin on the track with which the path closes, on copper layer ``layer``.
    ``nets`` are the names of the nets of its tracks.
    """

    points: tuple[Point, ...]
    nets: tuple[str, ...]
    layer: int

    @property
    def area(self) -> float:
        """Enclosed area (m2). If the loop surrounds an area several times, the area counts several times."""
        return abs(sum(a.x * b.y - b.x * a.y for a, b in pairwise((*self.points, self.points[0])))) / 2

    def turns_round(self, centre: Point) -> float:
        """Return the number of turns of the loop around a point, counter-clockwise positive."""
        return winding_number((*self.points, self.points[0]), centre)


@record
class _Edge:
    """Part of the track `trace` between the nodes `one` and `other` of the graph.

    `first` and `last` are the distances (m) from the track's start at which the part begins and ends.
    """

    one: Node
    other: Node
    trace: Trace
    first: float
    last: float

    @property
    def points(self) -> tuple[Point, ...]:
        points, way = [], 0.0
        for segment in self.trace.path:
            flat = segment.flattened(CHORD)
            for k, point in enumerate(flat):
                at = way + segment.length * k / (len(flat) - 1)
                if self.first - _GRID <= at <= self.last + _GRID:
                    points.append(point)
            way += segment.length
        return tuple(points) or (self.trace.path.start,)


@record
class TrackGraph:
    """Graph of the drawn tracks. Edges are parts of tracks; nodes are the points at which tracks connect.

    Nodes are ends of tracks, places where another track ends on a track, vias and contacts.
    """

    layout: Layout

    @cached_property
    def vias(self) -> dict[tuple[int, int], int]:
        """Index of each via in the layout, by its place (rounded to a grid)."""
        return {_grid_cell(via.centre): i for i, via in enumerate(self.layout.vias)}

    def node_of(self, point: Point, layer: int) -> Node:
        """Return the node at a point on a copper layer: a via or contact at this point, otherwise the point itself."""
        cell = _grid_cell(point)
        if cell in self.vias:
            return (0, self.vias[cell], 0)
        for i, pad in enumerate(self.layout.all_pads):
            (x, y), (width, height) = pad.centre, pad.size
            if pad.layer == layer and abs(point.x - x) <= width / 2 and abs(point.y - y) <= height / 2:
                return (-1, i, 0)
        return (layer, *cell)

    @cached_property
    def edges(self) -> tuple[_Edge, ...]:
        """Tracks, divided at the nodes that they touch."""
        meetings, edges = _track_meetings(self.layout.copper_layers, self.layout.traces), list[_Edge]()
        for index, trace in enumerate(self.layout.traces):
            cuts = [(0.0, self.node_of(trace.path.start, trace.layer)),
                    (trace.path.length, self.node_of(trace.path.end, trace.layer))]
            cuts += [(way, self.node_of(point, trace.layer)) for way, point in meetings[index]]
            edges += [_Edge(start, end, trace, way, further) for (way, start), (further, end) in pairwise(sorted(cuts))]
        return tuple(edges)


def closed_loops(graph: TrackGraph) -> Iterator[ConductorLoop]:
    """Yield a loop for each part of a track that connects two nodes which other tracks connect already."""
    tree: dict[Node, list[tuple[Node, _Edge]]] = defaultdict(list)
    parts = _NodeGroups()
    for edge in graph.edges:
        if parts.join(edge.one, edge.other):
            tree[edge.one].append((edge.other, edge))
            tree[edge.other].append((edge.one, edge))
        else:
            yield _loop_closed_by(tree, edge)


def loose_ends(graph: TrackGraph) -> Iterator[tuple[Point, int, str]]:
    """Yield (place, copper layer, net) for each unconnected end of a track, and for each via that connects nothing.

    The end of a track is unconnected if nothing on its layer touches it.
    """
    layout = graph.layout
    count = Counter(node for edge in graph.edges for node in (edge.one, edge.other))
    for trace in layout.traces:
        for point in (trace.path.start, trace.path.end):
            node = graph.node_of(point, trace.layer)
            if node[0] > 0 and count[node] < 2 and not any(  # and it does not run into another track of its layer
                other is not trace and other.path.distance(point) < other.width / 2
                for other in layout.on_layer(trace.layer)
            ):
                yield point, trace.layer, trace.net
    for number, via in enumerate(layout.vias):
        if count[0, number, 0] < 2:
            yield via.centre, 1, via.net


def open_nets(graph: TrackGraph) -> Iterator[tuple[Pad, Pad]]:
    """Yield pairs of contacts that have the same net, but no copper between them.

    Contacts that copper connects form a group. Each pair has a contact of the net's first group and a contact of
    another group.
    """
    parts = _NodeGroups()
    for edge in graph.edges:
        parts.join(edge.one, edge.other)
    for net in dict.fromkeys(pad.net for pad in graph.layout.all_pads if not pad.is_unused):
        pads = [(i, pad) for i, pad in enumerate(graph.layout.all_pads) if pad.net == net]
        roots = {parts.root((-1, i, 0)): pad for i, pad in reversed(pads)}
        first = pads[0][1]
        yield from ((first, pad) for pad in roots.values() if pad is not first)


def _track_meetings(copper_layers: int, traces: tuple[Trace, ...]) -> dict[int, list[tuple[float, Point]]]:
    """Return for each track the ends of other tracks that touch it between its own ends.

    Keys are the indices of the tracks. Each end is (distance from the track's start in m, place).
    """
    meetings: dict[int, list[tuple[float, Point]]] = defaultdict(list)
    for layer in range(1, copper_layers + 1):
        tracks = [(i, trace) for i, trace in enumerate(traces) if trace.layer == layer]
        rows, whose, starts = [], [], []
        for i, trace in tracks:
            way = 0.0
            for row, size in path_rows(trace.path):
                rows.append(row)
                whose.append(i)
                starts.append(way)
                way += size
        if not rows:
            continue
        pieces = from_rows(rows)
        ends = [(i, point, trace.width) for i, trace in tracks for point in (trace.path.start, trace.path.end)]
        spots = np.array([point for _, point, _ in ends])
        half = np.array([traces[i].width / 2 for i in whose])
        near = nearest_pairs(np.hstack([spots, spots]), np.array([w / 2 for *_, w in ends]), pieces.boxes, half)
        near = near[[whose[j] != ends[e][0] for e, j in near.tolist()]] if len(near) else near
        gaps = distances_to_points(pieces.take(near[:, 1]), spots[near[:, 0]]) - half[near[:, 1]]
        for (e, j), gap in zip(near.tolist(), gaps.tolist(), strict=True):
            trace, point = traces[whose[j]], ends[e][1]
            apart = min(point.distance(trace.path.start), point.distance(trace.path.end))
            if gap < 0.0 and apart > trace.width:
                segment = trace.path.segments[j - whose.index(whose[j])]
                nearest = min((point.distance(segment.at(k / 32)), k) for k in range(33))[1]
                meetings[whose[j]].append((starts[j] + nearest / 32 * segment.length, point))
    # one meeting per point, although an end can touch two pieces of a track
    return {i: list({_grid_cell(point): (way, point) for way, point in meetings[i]}.values())
            for i in range(len(traces))}


def _loop_closed_by(tree: dict[Node, list[tuple[Node, _Edge]]], closing: _Edge) -> ConductorLoop:
    """Return the loop that consists of the edge `closing` and the path through the tree between its nodes."""
    way = _path_between(tree, closing.other, closing.one)
    points, nets = list(closing.points), {closing.trace.net}
    for edge in way:
        stretch = edge.points
        forward = points[-1].distance(stretch[0]) <= points[-1].distance(stretch[-1])
        points += stretch if forward else stretch[::-1]
        nets.add(edge.trace.net)
    return ConductorLoop(tuple(points), tuple(sorted(nets)), closing.trace.layer)


def _path_between(tree: dict[Node, list[tuple[Node, _Edge]]], start: Node, goal: Node) -> Sequence[_Edge]:
    """Return the edges of the path through a tree from one node to another. Empty if there is no path."""
    stack: list[tuple[Node, tuple[_Edge, ...]]] = [(start, ())]
    visited = {start}
    while stack:
        node, way = stack.pop()
        if node == goal:
            return way
        for there, edge in tree[node]:
            if there not in visited:
                visited.add(there)
                stack.append((there, (*way, edge)))
    return ()


class _NodeGroups:
    """Groups of connected nodes (union-find)."""

    def __init__(self) -> None:
        self._above: dict[Node, Node] = {}

    def root(self, node: Node) -> Node:
        while (above := self._above.get(node, node)) != node:
            node = above
        return node

    def join(self, first: Node, second: Node) -> bool:
        """Connect two nodes. Return False if they were connected already."""
        a, b = self.root(first), self.root(second)
        self._above[a] = b
        return a != b


ACUTE = math.radians(59.9)
"""Angle (rad) between two tracks, below which there is a finding.

Etchant stays in sharper corners and erodes the tracks (unverified: workshop practice). Stubs drawn by sitscad meet
their spirals at 75 degrees or more.
"""

_SAME_PLACE = 1e-8

def acute_angle(design: Design) -> Iterator[Verdict]:
    """Yield findings on tracks that meet at an acute angle, without a pad over the corner."""
    copper = cached_copper(design)
    pairs: set[tuple[int, int]] = set()
    for first, second, (x, y), angle in _acute_corners(copper):
        a, b = copper.items[copper.item[first]], copper.items[copper.item[second]]
        pair, layer = (int(copper.item[first]), int(copper.item[second])), int(copper.layer[first])
        is_covered = any(math.hypot(via.centre.x - x, via.centre.y - y) < _SAME_PLACE for via in design.layout.vias)
        is_covered = is_covered or any(
            pad.layer == layer and abs(pad.centre.x - x) <= pad.size[0] / 2 and abs(pad.centre.y - y) <= pad.size[1] / 2
            for pad in design.layout.all_pads
        )
        if a.net != b.net or pair in pairs or is_covered:
            continue
        pairs.add(pair)
        yield violation_of(
            "acute", "coil", math.degrees(angle), math.degrees(ACUTE), "degrees", place=Place(x, y, layer, (a.net,)),
            fixes=(lambda: moved_layer_ends(design.spec),), tracks=[name_of(a), name_of(b)], layer=layer,
        )


def sliver(design: Design) -> Iterator[Verdict]:
    """Yield findings on gaps between two parts of a conductor that turns back, if they are below the minimum spacing.

    The minimum is the smaller of the fabricator's spacing and the spec's spacing of turns.
    """
    minimum = min(design.spec.fpc.rules.trace_spacing, design.spec.coil.trace_spacing,
                  design.spec.reference_coil.trace_spacing)
    holder, source = minimum_gap_source(design.spec.fpc.rules, minimum)
    for near in conductor_notches(cached_copper(design), minimum - ALLOWED_SHORTFALL):
        yield violation_of(
            "notch", "coil", near.gap, minimum, "m", source=source, fixes=(lambda: moved_layer_ends(design.spec),),
            place=Place(near.x, near.y, near.layer, (near.one.net,)), pair=pair_in_words(near), layer=near.layer,
            house=holder,
        )


def shorted_turn(design: Design) -> Iterator[Verdict]:
    """Yield findings on closed conducting loops of any net, with the coils that they run around."""
    for loop in closed_loops(_track_graph(design)):
        coils = [coil.name for coil in design.layout.coils if abs(loop.turns_round(coil.centre)) > 0.5]
        yield violation_of("shorted-turn" if coils else "closed-loop", "coil", hint="shorted-turn",
                           place=Place(*loop.points[0], loop.layer, loop.nets), nets=loop.nets, area=loop.area,
                           coils=coils)


def unconnected(design: Design) -> Iterator[Verdict]:
    """Yield findings on unconnected ends and vias, and on contacts of the same net that no copper connects.

    A layout that is not complete is not checked.
    """
    layout = design.layout
    if layout.shortfalls:
        yield not_checked("incomplete-layout")
        return
    for point, layer, net in loose_ends(_track_graph(design)):
        yield violation_of("loose-end", "coil", place=Place(*point, layer, (net,)), net=net, layer=layer)
    for first, second in open_nets(_track_graph(design)):
        yield violation_of("open-net", "coil", place=Place(*second.centre, second.layer, (first.net,)),
                           pins=(first.pin, second.pin), net=first.net)


def _track_graph(design: Design) -> TrackGraph:
    return cached_per_board(design, "track graph", lambda: TrackGraph(design.layout))


# ------------------------------------------------------------------------------------------------------------- corners


def _acute_corners(copper: Copper) -> Iterator[tuple[int, int, tuple[float, float], float]]:
    """Yield (number, number, place in m, angle in rad) for two pieces of track that meet at an angle below `ACUTE`.

    The numbers are indices of the pieces in `copper`.
    """
    tracks = np.flatnonzero(np.array([isinstance(copper.items[k], Trace) for k in copper.item], dtype=bool))
    pieces = copper.pieces.take(tracks)
    points = np.concatenate([pieces.start, pieces.end])
    heading, arriving = pieces.tangents
    out = np.concatenate([heading, -arriving])
    number = np.concatenate([tracks, tracks])
    keys = np.column_stack([copper.layer[number], np.round(points / _SAME_PLACE).astype(np.int64)])
    order = np.lexsort(keys.T)
    for step in (1, 2, 3):  # neighbours in this order; at most four ends meet in one point
        a, b = order[:-step], order[step:]
        same = (keys[a] == keys[b]).all(axis=1)
        cosine = (out[a] * out[b]).sum(axis=1)
        for k in np.flatnonzero(same & (cosine > math.cos(ACUTE)) & (number[a] != number[b])):
            angle, (x, y) = math.acos(min(1.0, float(cosine[k]))), points[a[k]].tolist()
            yield int(number[a[k]]), int(number[b[k]]), (x, y), angle


RULES: tuple[Rule, ...] = (
    rule_of("SIT120", acute_angle), rule_of("SIT121", sliver), rule_of("SIT122", shorted_turn),
    rule_of("SIT125", unconnected),
)
