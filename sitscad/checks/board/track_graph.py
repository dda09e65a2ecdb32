"""The copper as drawn as a graph over all layers, whatever net it is said to have: its closed loops and loose ends."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.geometry.path import Path, Point, Segment
from sitscad.geometry.primitives import from_rows, nearest_pairs, path_rows, to_points
from sitscad.layout.board import Layout, Pad, Trace
from sitscad.record import record

CHORD = 10e-6
"""Arcs are followed within this distance (m), where a loop's area is concerned."""

_GRID = 1e-8

Node = tuple[int, int, int]


@record
class Loop:
    """A closed way along conductors, seen from above; ``layer`` is that of the track that closes it."""

    points: tuple[Point, ...]
    nets: tuple[str, ...]
    layer: int

    @property
    def place(self) -> tuple[float, float]:
        """Where the loop closes (m)."""
        return self.points[0].x, self.points[0].y

    @property
    def area(self) -> float:
        """Enclosed area (m2), counted as often as the loop runs round it."""
        return abs(sum(a.x * b.y - b.x * a.y for a, b in pairwise((*self.points, self.points[0])))) / 2

    def turns_round(self, centre: Point) -> float:
        """How often the loop runs round a point, counter-clockwise positive."""
        angles = [math.atan2(p.y - centre.y, p.x - centre.x) for p in (*self.points, self.points[0])]
        return sum(math.remainder(b - a, 2 * math.pi) for a, b in pairwise(angles)) / (2 * math.pi)


@record
class _Edge:
    """A stretch of a track between two nodes, from one way along it (m) to another."""

    one: Node
    other: Node
    trace: Trace
    first: float
    last: float

    @property
    def points(self) -> tuple[Point, ...]:
        """The stretch as a polyline."""
        return _between(self.trace.path, self.first, self.last)


@record
class TrackGraph:
    """A layout's tracks between the nodes where they meet: ends, ends that run into another track, vias and pads."""

    layout: Layout

    @cached_property
    def node_of(self) -> Callable[[Point, int], Node]:
        """The node of a point on a layer."""
        return _nodes(self.layout)

    @cached_property
    def edges(self) -> tuple[_Edge, ...]:
        """The stretches of track between nodes."""
        return tuple(_edges(self.layout, self.node_of))


def closed_loops(graph: TrackGraph) -> Iterator[Loop]:
    """Every loop that a track closes."""
    tree: dict[Node, list[tuple[Node, _Edge]]] = defaultdict(list)
    parts = _Parts()
    for edge in graph.edges:
        if parts.join(edge.one, edge.other):
            tree[edge.one].append((edge.other, edge))
            tree[edge.other].append((edge.one, edge))
        else:
            yield _loop(tree, edge)


def loose_ends(graph: TrackGraph) -> Iterator[tuple[Point, int, str]]:
    """Ends of tracks that meet nothing on their layer, and vias that join nothing: where, copper layer, net."""
    layout = graph.layout
    count = Counter(node for edge in graph.edges for node in (edge.one, edge.other))
    for trace in layout.traces:
        for point in (trace.path.start, trace.path.end):
            node = graph.node_of(point, trace.layer)
            if node[0] > 0 and count[node] < 2 and not _runs_into(layout, trace, point):
                yield point, trace.layer, trace.net
    for number, via in enumerate(layout.vias):
        if count[0, number, 0] < 2:
            yield via.centre, 1, via.net


def open_nets(graph: TrackGraph) -> Iterator[tuple[Pad, Pad]]:
    """Contacts of one net that no copper joins: one of the net's first part, and one of each other part."""
    parts = _Parts()
    for edge in graph.edges:
        parts.join(edge.one, edge.other)
    for net in dict.fromkeys(pad.net for pad in graph.layout.all_pads if not pad.is_unused):
        pads = [(i, pad) for i, pad in enumerate(graph.layout.all_pads) if pad.net == net]
        roots = {parts.root((-1, i, 0)): pad for i, pad in reversed(pads)}
        first = pads[0][1]
        yield from ((first, pad) for pad in roots.values() if pad is not first)


def _runs_into(layout: Layout, trace: Trace, point: Point) -> bool:
    """Whether an end lies on another track of its layer, away from that one's ends."""
    return any(
        other is not trace and other.path.distance(point) < other.width / 2 for other in layout.on_layer(trace.layer)
    )


def _edges(layout: Layout, node_of: Callable[[Point, int], Node]) -> Iterator[_Edge]:
    """The tracks between the nodes that they touch."""
    meetings = _meetings(layout)
    for index, trace in enumerate(layout.traces):
        cuts = [(0.0, node_of(trace.path.start, trace.layer)),
                (trace.path.length, node_of(trace.path.end, trace.layer))]
        cuts += [(way, node_of(point, trace.layer)) for way, point in meetings[index]]
        for (way, one), (further, other) in pairwise(sorted(cuts)):
            yield _Edge(one, other, trace, way, further)


def _nodes(layout: Layout) -> Callable[[Point, int], Node]:
    """The node of a track's end: its place on its layer, the via that it meets, or the contact that it lies on."""
    vias = {_cell(via.centre): i for i, via in enumerate(layout.vias)}

    def node(point: Point, layer: int) -> Node:
        """The node of a point on a layer: a via, a contact, or the place itself."""
        cell = _cell(point)
        if cell in vias:
            return (0, vias[cell], 0)
        for i, pad in enumerate(layout.all_pads):
            (x, y), (width, height) = pad.centre, pad.size
            if pad.layer == layer and abs(point.x - x) <= width / 2 and abs(point.y - y) <= height / 2:
                return (-1, i, 0)
        return (layer, *cell)

    return node


def _meetings(layout: Layout) -> dict[int, list[tuple[float, Point]]]:
    """For each track the ends of others that run into it, away from its own ends: the way along it (m), and where."""
    found: dict[int, list[tuple[float, Point]]] = defaultdict(list)
    for layer in range(1, layout.copper_layers + 1):
        own = [(i, trace) for i, trace in enumerate(layout.traces) if trace.layer == layer]
        rows, whose, ways = [], [], []
        for i, trace in own:
            way = 0.0
            for row, size in path_rows(trace.path):
                rows.append(row)
                whose.append(i)
                ways.append(way)
                way += size
        if not rows:
            continue
        pieces = from_rows(rows)
        ends = [(i, point, trace.width) for i, trace in own for point in (trace.path.start, trace.path.end)]
        spots = np.array([point for _, point, _ in ends])
        half = np.array([layout.traces[i].width / 2 for i in whose])
        near = nearest_pairs(np.hstack([spots, spots]), np.array([w / 2 for *_, w in ends]), pieces.boxes, half)
        near = near[[whose[j] != ends[e][0] for e, j in near.tolist()]] if len(near) else near
        gaps = to_points(pieces.take(near[:, 1]), spots[near[:, 0]]) - half[near[:, 1]]
        for (e, j), gap in zip(near.tolist(), gaps.tolist(), strict=True):
            trace, point = layout.traces[whose[j]], ends[e][1]
            apart = min(point.distance(trace.path.start), point.distance(trace.path.end))
            if gap < 0.0 and apart > trace.width:
                segment = trace.path.segments[j - whose.index(whose[j])]
                found[whose[j]].append((ways[j] + _along(segment, point), point))
    return {i: _once(found[i]) for i in range(len(layout.traces))}


def _along(segment: Segment, point: Point) -> float:
    """The way (m) along a segment to its place nearest to a point, within a thirty-second of its length."""
    share = min((point.distance(segment.at(k / 32)), k) for k in range(33))[1] / 32
    return float(share * segment.length)


def _once(meetings: list[tuple[float, Point]]) -> list[tuple[float, Point]]:
    """One meeting a point, although an end can touch two pieces of a track."""
    return list({_cell(point): (way, point) for way, point in meetings}.values())


def _between(path: Path, first: float, last: float) -> tuple[Point, ...]:
    """The points of a path from one length along it (m) to another."""
    points, way = [], 0.0
    for segment in path:
        flat = segment.flattened(CHORD)
        for k, point in enumerate(flat):
            at = way + segment.length * k / (len(flat) - 1)
            if first - _GRID <= at <= last + _GRID:
                points.append(point)
        way += segment.length
    return tuple(points) or (path.start,)


def _loop(tree: dict[Node, list[tuple[Node, _Edge]]], closing: _Edge) -> Loop:
    """The loop of a closing edge and the way back through the tree."""
    way = _way_back(tree, closing.other, closing.one)
    points, nets = list(closing.points), {closing.trace.net}
    for edge in way:
        stretch = edge.points
        forward = points[-1].distance(stretch[0]) <= points[-1].distance(stretch[-1])
        points += stretch if forward else stretch[::-1]
        nets.add(edge.trace.net)
    return Loop(tuple(points), tuple(sorted(nets)), closing.trace.layer)


def _way_back(tree: dict[Node, list[tuple[Node, _Edge]]], start: Node, goal: Node) -> Sequence[_Edge]:
    """The edges of the way through a tree from one node to another; none where there is none."""
    stack: list[tuple[Node, tuple[_Edge, ...]]] = [(start, ())]
    seen = {start}
    while stack:
        node, way = stack.pop()
        if node == goal:
            return way
        for there, edge in tree[node]:
            if there not in seen:
                seen.add(there)
                stack.append((there, (*way, edge)))
    return ()


class _Parts:
    """Nodes that are joined (union-find)."""

    def __init__(self) -> None:
        self._above: dict[Node, Node] = {}

    def root(self, node: Node) -> Node:
        """The node that stands for the whole part."""
        while (above := self._above.get(node, node)) != node:
            node = above
        return node

    def join(self, one: Node, other: Node) -> bool:
        """Join two nodes; False where they were joined already."""
        a, b = self.root(one), self.root(other)
        self._above[a] = b
        return a != b


def _cell(point: Point) -> tuple[int, int]:
    return round(point.x / _GRID), round(point.y / _GRID)
