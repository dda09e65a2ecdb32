"""Follow the conductor of a drawn coil from terminal to terminal, through tracks, vias and pads.

The conductor is found in a graph with tracks as edges and their ends as nodes. All ends on the copper of a via or pad
are a single node. Dead ends are removed. The remaining tracks must form a chain: a branch or a loop is an error, and
its place is reported.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Arc, Line, Path, Point, Segment, segment_part, winding_number
from sitscad.kernels.geometry.primitives import distances, from_rows, nearest_pairs, path_rows
from sitscad.spec.drawn.copper import DrawnCoilError, DrawnCopper, DrawnPad, DrawnTrack, place_text

MOST_TRACKS = 20_000
"""Largest number of tracks in a net."""

JOINED = 1e-6
"""Largest distance (m) between two track ends that count as the same point. Files round to 1 um or finer."""

OVERLAP = 0.5
"""Largest distance between two track ends that count as joined, divided by the width of the track that is added.

KiCad, too, joins an end to a track whose copper covers the end.
"""


@record
class DrawnRun:
    """A part of the conductor on one layer: its path along the current, and the width (m) of each segment."""

    layer: str
    path: Path
    widths: tuple[float, ...]


@record
class DrawnConductor:
    """The conductor of a drawn coil: its runs in series, and the vias between them. A run lies on one layer.

    `stubs` are texts that describe the removed dead ends. `ends` are the names of the two terminals, and `terminals`
    their pads. The pad is None if the terminal is the bare end of a track.
    """

    runs: tuple[DrawnRun, ...]
    vias: tuple[DrawnPad, ...]
    stubs: tuple[str, ...]
    ends: tuple[str, str]
    terminals: tuple[DrawnPad | None, DrawnPad | None] = (None, None)

    @property
    def length(self) -> float:
        """Length (m) of all runs."""
        return math.fsum(run.path.length for run in self.runs)

    @property
    def width(self) -> float:
        """The track width (m) with the largest total length in the conductor."""
        lengths: dict[float, float] = defaultdict(float)
        for run in self.runs:
            for segment, width in zip(run.path, run.widths, strict=True):
                lengths[width] += segment.length
        return max(lengths, key=lambda width: (lengths[width], -width))

    @cached_property
    def winding_circle(self) -> tuple[Point, float]:
        """Centre and radius (m) of a circle that encloses the turns. Leads can extend beyond the circle.

        The centre is computed from the runs that bend by at least `LEAST_BEND`. If they are mostly curved, it is the
        median of their centres of curvature, weighted by length. If they are mostly straight, it is the centroid of the
        area that they enclose, with area inside several turns counted once for each turn. The radius is 1.2 times the
        distance from the centre within which nine tenths of the track length lies. Tracks farther away than twice the
        median distance are left out.
        """
        all_paths = [run.path for run in self.runs]
        paths = [path for path in all_paths if abs(_total_turning(path)) >= LEAST_BEND] or all_paths
        bends = [bend for path in paths for bend in _curvature_centres(path)]
        if math.fsum(length for length, _ in bends) > 0.5 * math.fsum(path.length for path in paths):
            centre = Point(_quantile(sorted((at.x, length) for length, at in bends), 0.5),
                           _quantile(sorted((at.y, length) for length, at in bends), 0.5))
        else:
            areas = [_area_and_centroid(path.flattened(SAMPLED)) for path in paths]
            total = math.fsum(area for area, _ in areas) or 1.0
            centre = Point(math.fsum(area * at.x for area, at in areas) / total,
                           math.fsum(area * at.y for area, at in areas) / total)
        pieces = sorted((centre.distance(Point((a.x + b.x) / 2, (a.y + b.y) / 2)), a.distance(b)) for run in self.runs
                        for a, b in pairwise(run.path.flattened(SAMPLED)))
        near = 2.0 * _quantile(pieces, 0.5)
        return centre, 1.2 * _quantile([piece for piece in pieces if piece[0] <= near], 0.9)

    @property
    def centre(self) -> Point:
        """Centre (m) of the turns."""
        return self.winding_circle[0]

    def turns(self) -> list[tuple[str, float]]:
        """Return (layer, number of turns about the coil's centre) for each run, in the order of the current.

        Counter-clockwise turns are positive.
        """
        polylines = [run.path.flattened(SAMPLED) for run in self.runs]
        # the median of the turns of a wedge lies outside of its inner turns
        inner = [_innermost_centroid(points) for points in polylines]
        counts = [[winding_number(points, centre) for points in polylines] for centre in (self.centre, *inner)]
        best = max(counts, key=lambda each: (round(abs(math.fsum(each))), -counts.index(each)))
        return [(run.layer, number) for run, number in zip(self.runs, best, strict=True)]


SAMPLED = 10e-6
"""Largest distance (m) between an arc and the chords that replace it in the count of turns."""


def _innermost_centroid(points: Sequence[Point]) -> Point:
    """Return the centroid of the first or last turn of a polyline, whichever encloses less area."""
    turns = []
    for way in (points, points[::-1]):
        bend = 0.0
        for k in range(1, len(way) - 1):
            (ax, ay), (bx, by) = way[k] - way[k - 1], way[k + 1] - way[k]
            bend += math.atan2(ax * by - ay * bx, ax * bx + ay * by)
            if abs(bend) >= math.tau:
                break
        turns.append(_area_and_centroid(way[: k + 2]) if len(way) > 2 else (math.inf, way[0]))
    return min(turns)[1]


LEAST_BEND = 1.5 * math.pi
"""Smallest total change of direction (rad) of a run that counts as a part of the winding."""


def _total_turning(path: Path) -> float:
    """Return the total change of direction (rad) of a path from its start to its end, positive to the left."""
    points = path.flattened(SAMPLED)
    headings = [math.atan2(b.y - a.y, b.x - a.x) for a, b in pairwise(points) if a.distance(b) > 1e-9]
    return math.fsum(math.remainder(b - a, 2.0 * math.pi) for a, b in pairwise(headings))


def _curvature_centres(path: Path) -> Iterator[tuple[float, Point]]:
    """Yield length (m) and centre of curvature of each arc, and of each chord of an approximated arc.

    A chord counts as such if it deviates by less than `GENTLE` from the direction of the chord before.
    """
    before: Segment | None = None
    for segment in path:
        if isinstance(segment, Arc):
            yield segment.length, segment.centre
        elif isinstance(before, Line):
            (ax, ay), (bx, by) = before.end - before.start, segment.end - segment.start
            turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
            if 1e-4 < abs(turn) < GENTLE:
                radius = segment.length / (2.0 * math.tan(turn / 2.0)) / segment.length
                middle = segment.at(0.5)
                yield segment.length, middle.shifted(-by * radius, bx * radius)
        before = segment


GENTLE = math.radians(16.0)
"""Largest change of direction (rad) between two successive chords that count as parts of an approximated arc."""


def _area_and_centroid(points: Sequence[Point]) -> tuple[float, Point]:
    """Return the area (m2) that a closed polyline encloses, and the centroid of this area (Green's theorem).

    Area inside several turns counts once for each turn.
    """
    origin = points[0]
    area = x = y = 0.0
    for a, b in pairwise([*points, origin]):
        (ax, ay), (bx, by) = a - origin, b - origin
        cross = ax * by - bx * ay
        area, x, y = area + cross / 2.0, x + cross * (ax + bx) / 6.0, y + cross * (ay + by) / 6.0
    return abs(area), origin.shifted(x / area, y / area) if area else origin


def _quantile(pieces: Sequence[tuple[float, float]], part: float) -> float:
    """Return the distance up to which the pieces contain the fraction `part` of their total length.

    `pieces` are pairs (distance, length of the piece), sorted by distance.
    """
    threshold, within = part * math.fsum(length for _, length in pieces), 0.0
    for distance, length in pieces:
        within += length
        if within >= threshold:
            return distance
    return pieces[-1][0]


Edge = tuple[int, int, DrawnTrack]


def find_conductor(copper: DrawnCopper, net: str = "", start: str = "", end: str = "") -> DrawnConductor:
    """Return the conductor of a net. Without a net, return the conductor between the pads `start` and `end`.

    For a footprint, net and pads can all be empty. Raises DrawnCoilError as `follow_conductor` does, and if a board has
    neither a net nor both pads.
    """
    if not copper.is_footprint and not net and not (start and end):
        nets = sorted({track.net for track in copper.tracks if track.net})
        raise DrawnCoilError("a board has many nets: name the coil's net, or the two pads between which it lies "
                             f"(from, to); nets with tracks: {', '.join(nets[:MOST_NAMED]) or 'none'}")
    return follow_conductor(copper.of_net(net) if net else copper, start, end)


def follow_conductor(copper: DrawnCopper, start: str = "", end: str = "") -> DrawnConductor:
    """Return the conductor between two terminals.

    Parameters
    ----------
    copper : DrawnCopper
        copper of one net, or of all nets that the coil joins
    start, end : str
        names of pads, like ``J1.1``. If they are left out, the two pads of the copper are the terminals (of a footprint
        pads 1 and 2), or the two free ends of its tracks

    Raises
    ------
    DrawnCoilError
        if there are no two terminals, or the copper between them has a gap, branch, loop, short or zone
    """
    if len(copper.tracks) > MOST_TRACKS:
        raise DrawnCoilError(f"the copper has {len(copper.tracks)} tracks; at most {MOST_TRACKS} are followed")
    graph = _Graph(copper)
    first, last = graph.terminals(start, end)
    graph.require_connected(first, last)
    stubs = graph.remove_dead_ends(first, last)
    chain = graph.tracks_in_series(first, last)
    if not chain:
        raise DrawnCoilError("there is no track between the two terminals")
    conductor = replace(_conductor(graph, chain, tuple(stubs), (graph.name(first), graph.name(last))),
                        terminals=(graph.pad(first), graph.pad(last)))
    _require_no_zone(copper, chain)
    _require_no_short(graph, chain)
    return conductor


class _Graph:
    """Graph with tracks as edges. Nodes are pads, vias, and joined ends of tracks."""

    def __init__(self, copper: DrawnCopper) -> None:
        self.pads = list(copper.pads)
        self.is_footprint = copper.is_footprint
        self.places: list[tuple[Point, str]] = [(pad.centre, "") for pad in self.pads]
        self.owner = self._joined_pads()
        self.layered: dict[str, list[int]] = defaultdict(list)
        for number, pad in enumerate(self.pads):
            for layer in pad.layers:
                self.layered[layer].append(number)
        self.cells: dict[tuple[str, int, int], list[int]] = defaultdict(list)
        self.edges: dict[int, Edge] = {}
        self.at: dict[int, set[int]] = defaultdict(set)
        for track in _without_copies(copper.tracks):
            self._add(track)
        self._join_ends_on_tracks()

    def _joined_pads(self) -> list[int]:
        """Return, for each pad, the index of the first pad that touches it. An example is a via inside a pad."""
        owner = list(range(len(self.pads)))
        by_place = sorted(range(len(self.pads)), key=lambda k: self.pads[k].centre.x)
        for position, k in enumerate(by_place):
            for other in by_place[position + 1 :]:
                first, second = self.pads[k], self.pads[other]
                if second.centre.x - first.centre.x > max(*first.size, *second.size):
                    break
                is_over = first.distance(second.centre) <= 0.0 or second.distance(first.centre) <= 0.0
                if first.layers & second.layers and is_over:
                    old, new = owner[other], owner[k]
                    owner = [new if each == old else each for each in owner]
        return owner

    def _node(self, point: Point, layer: str, width: float) -> int:
        """Return the node at a track's end `point`: a pad under the end, a joined end, or a new node.

        `width` (m) is the track's width, which determines the distance within which ends are joined.
        """
        for number in self.layered[layer]:
            if self.pads[number].distance(point) <= JOINED:
                return self.owner[number]
        reach = max(JOINED, OVERLAP * width)
        column, row = math.floor(point.x / CELL), math.floor(point.y / CELL)
        nearest, least = -1, reach
        for i in (column - 1, column, column + 1):
            for j in (row - 1, row, row + 1):
                for node in self.cells[layer, i, j]:
                    distance = self.places[node][0].distance(point)
                    if distance <= least:
                        nearest, least = node, distance
        if nearest >= 0:
            return nearest
        self.places.append((point, layer))
        self.cells[layer, column, row].append(len(self.places) - 1)
        return len(self.places) - 1

    def _add(self, track: DrawnTrack) -> None:
        a, b = (self._node(point, track.layer, track.width) for point in (track.line.start, track.line.end))
        if a == b and track.line.length <= 2.0 * track.width:
            return  # within a pad, or shorter than wide
        number = len(self.edges) + 1
        while number in self.edges:
            number += 1
        self.edges[number] = a, b, track
        self.at[a].add(number)
        self.at[b].add(number)

    def _remove(self, number: int) -> Edge:
        a, b, track = self.edges.pop(number)
        self.at[a].discard(number)
        self.at[b].discard(number)
        return a, b, track

    def _join_ends_on_tracks(self) -> None:
        """Join each loose end of a track to the nearest other track whose copper touches it."""
        for node in [node for node, edges in self.at.items() if len(edges) == 1 and node >= len(self.pads)]:
            if len(self.at[node]) != 1:  # another end was joined to it
                continue
            (own_edge,) = self.at[node]
            point, layer = self.places[node]
            own = self.edges[own_edge]
            nearest, least = 0, 0.0
            for number, (a, b, track) in self.edges.items():
                if track.layer != layer or {a, b} & set(own[:2]):
                    continue
                reach = (track.width + own[2].width) / 2 - JOINED
                x0, y0, x1, y1 = track.line.box
                if not (x0 - reach <= point.x <= x1 + reach and y0 - reach <= point.y <= y1 + reach):
                    continue
                distance = track.line.distance(point)
                if distance <= reach and (not nearest or distance < least):
                    nearest, least = number, distance
            if nearest:
                self._split(nearest, node, point)

    def _split(self, number: int, node: int, point: Point) -> None:
        """Join `node` to the track with index `number`, at the track's position nearest to `point`.

        If this position is an end of the track, the two nodes are merged. Otherwise the track is divided there.
        """
        a, b, track = self.edges[number]
        near = _nearest_point(track.line, point)
        for other, end in ((a, track.line.start), (b, track.line.end)):
            if near.distance(end) <= 1e-9:
                return self._merge(node, other)
        self._remove(number)
        for first, last, start, end in ((a, node, track.line.start, near), (node, b, near, track.line.end)):
            new = max(self.edges, default=0) + 1
            self.edges[new] = first, last, replace(track, line=segment_part(track.line, start, end))
            self.at[first].add(new)
            self.at[last].add(new)

    def _merge(self, node: int, other: int) -> None:
        """Attach the tracks of `node` to the node `other`, whose copper covers it."""
        for number in self.at.pop(node):
            a, b, track = self.edges[number]
            self.edges[number] = other if a == node else a, other if b == node else b, track
            self.at[other].add(number)

    def pad(self, node: int) -> DrawnPad | None:
        """Return the pad or via of a node. None for joined ends of tracks."""
        return self.pads[node] if node < len(self.pads) else None

    def name(self, node: int) -> str:
        """Return the name of a node for messages: the pad's name, or the place if it is not a pad with a name."""
        if node < len(self.pads) and self.pads[node].name:
            return f"pad {self.pads[node].name}"
        return place_text(*self.places[node])

    def terminals(self, start: str, end: str) -> tuple[int, int]:
        """Return the nodes of the two terminals. Raises DrawnCoilError if there are not two terminals."""
        named = {pad.name: self.owner[k] for k, pad in reversed(list(enumerate(self.pads))) if pad.name}
        if start or end:
            for name in (start, end):
                if name not in named:
                    some = ", ".join(sorted(named)[:MOST_NAMED])
                    raise DrawnCoilError(f"there is no pad {name!r}; pads: {some or 'none'}")
            return named[start], named[end]
        if self.is_footprint and {"1", "2"} <= named.keys():
            return named["1"], named["2"]
        pads = sorted({node for node in named.values() if self.at[node]})
        if len(pads) == 2:
            return pads[0], pads[1]
        free = sorted(node for node, edges in self.at.items() if len(edges) == 1 and node not in pads)
        if not pads and len(free) == 2:
            return free[0], free[1]
        if len(pads) == 1 and len(free) == 1:
            return pads[0], free[0]
        names = [self.name(node) for node in (*pads, *free)][:MOST_NAMED]
        raise DrawnCoilError(f"the coil's two terminals are not plain: {', '.join(names) or 'there are no ends'}; name "
                             "two pads (from, to)")

    def _connected_nodes(self, first: int) -> set[int]:
        reached, todo = {first}, [first]
        while todo:
            for number in self.at[todo.pop()]:
                for node in self.edges[number][:2]:
                    if node not in reached:
                        reached.add(node)
                        todo.append(node)
        return reached

    def require_connected(self, first: int, last: int) -> None:
        """Raise DrawnCoilError with the place of the gap if no copper joins the terminals."""
        reached = self._connected_nodes(first)
        if last in reached:
            return
        ends = [node for node in reached if len(self.at[node]) <= 1 and node != first] or [first]
        unreached = [node for node, edges in self.at.items() if edges and node not in reached] or [last]
        here, there = min(((a, b) for a in ends for b in unreached),
                          key=lambda pair: self.places[pair[0]][0].distance(self.places[pair[1]][0]))
        (point, layer), (other, other_layer) = self.places[here], self.places[there]
        gap = point.distance(other)
        what = f"the nearest other copper is {gap * 1e3:.3g} mm away, at {place_text(other, other_layer)}"
        if gap <= JOINED and layer != other_layer:
            what = f"a track of {other_layer} ends there, too: a via is missing"
        raise DrawnCoilError(f"the copper from {self.name(first)} ends at {place_text(point, layer)}; {what}")

    def remove_dead_ends(self, first: int, last: int) -> Iterator[str]:
        """Remove dead ends. Return a text for each removed dead end: its length, and the place of its free end.

        `first` and `last` are the nodes of the terminals. Tracks without a connection to `first` are removed as well,
        but have no text.
        """
        reached, stubs = self._connected_nodes(first), []
        for number in [n for n, (a, _, _) in self.edges.items() if a not in reached]:
            self._remove(number)
        todo = [node for node, edges in self.at.items() if len(edges) == 1 and node not in (first, last)]
        lengths: dict[int, tuple[float, int]] = {}
        while todo:
            node = todo.pop()
            if len(self.at[node]) != 1 or node in (first, last):
                continue
            (number,) = self.at[node]
            a, b, track = self._remove(number)
            on = b if a == node else a
            length, begin = lengths.pop(node, (0.0, node))
            lengths[on] = length + track.line.length, begin
            todo.append(on)
        for length, begin in lengths.values():
            stubs.append(f"{length * 1e3:.3g} mm ending at {place_text(*self.places[begin])}")
        return iter(stubs)

    def tracks_in_series(self, first: int, last: int) -> list[tuple[int, int, DrawnTrack]]:
        """Return (start node, end node, track) for each track from terminal to terminal, in the order of the current.

        Raises DrawnCoilError if the copper branches.
        """
        edges, node, before = [], first, 0
        while node != last:
            onwards = sorted(self.at[node] - {before})
            if len(onwards) > 1:
                raise DrawnCoilError(f"the copper branches at {self.name(node)}: branches in parallel, and loops, are "
                                     "not computed")
            if not onwards:
                raise DrawnCoilError(f"the copper ends at {self.name(node)}")
            (before,) = onwards
            a, b, track = self.edges[before]
            if b == node:
                a, b, track = b, a, replace(track, line=track.line.reversed())
            edges.append((a, b, track))
            node = b
        if self.at[last] - {before}:
            raise DrawnCoilError(f"the copper branches at {self.name(last)}: branches in parallel, and loops, are "
                                 "not computed")
        return edges


CELL = 0.2e-3
"""Side (m) of the grid squares in the search for track ends. Joined ends lie in the same or in neighbouring squares."""

MOST_NAMED = 12
"""Largest number of pads that a message lists."""


def _without_copies(tracks: Sequence[DrawnTrack]) -> Iterator[DrawnTrack]:
    """Yield each track once, even if it is drawn twice."""
    keys = set()
    for track in tracks:
        middle = track.line.at(0.5)
        key = (track.layer, *sorted((round(p.x, 8), round(p.y, 8)) for p in (track.line.start, track.line.end)),
               round(middle.x, 8), round(middle.y, 8))
        if key not in keys:
            keys.add(key)
            yield track


def _nearest_point(line: Segment, point: Point) -> Point:
    """Return the point on a segment that is nearest to another point, among 201 points at equal distances."""
    return min((line.at(k / 200.0) for k in range(201)), key=point.distance)


def _conductor(graph: _Graph, chain: Sequence[Edge], stubs: tuple[str, ...], ends: tuple[str, str]) -> DrawnConductor:
    """Return the conductor that a chain of tracks forms. Straight pieces join the track ends inside pads and vias."""
    runs: list[tuple[str, list[Segment], list[float]]] = []
    vias = []
    for before, (a, _, track) in zip((None, *chain), chain, strict=False):
        if before is None or before[2].layer != track.layer:
            if before is not None:
                hub = graph.pads[a] if a < len(graph.pads) else None
                if hub is None:
                    raise DrawnCoilError(f"tracks of two layers meet at {graph.name(a)} without a via")
                _extend_to_point(runs[-1], hub.centre, before[2].width)
                vias.append(hub)
                runs.append((track.layer, [], []))
                if hub.centre.distance(track.line.start) > JOINED:
                    runs[-1][1].append(Line(hub.centre, track.line.start))
                    runs[-1][2].append(track.width)
            else:
                runs.append((track.layer, [], []))
        else:
            _extend_to_point(runs[-1], track.line.start, track.width)
        runs[-1][1].append(track.line)
        runs[-1][2].append(track.width)
    whole = tuple(DrawnRun(layer, Path(tuple(lines)), tuple(widths)) for layer, lines, widths in runs if lines)
    return DrawnConductor(whole, tuple(vias), stubs, ends)


def _extend_to_point(run: tuple[str, list[Segment], list[float]], point: Point, width: float) -> None:
    """Add a straight piece from the end of a run to `point`, unless they coincide.

    If the last piece of the run extends past `point`, it is first cut off at the place nearest to `point`.
    """
    _, pieces, widths = run
    if not pieces:
        return
    near = _nearest_point(pieces[-1], point)
    if min(near.distance(pieces[-1].start), near.distance(pieces[-1].end)) > JOINED:
        pieces[-1] = segment_part(pieces[-1], pieces[-1].start, near)
    if pieces[-1].end.distance(point) > JOINED:
        pieces.append(Line(pieces[-1].end, point))
        widths.append(width)


def _require_no_zone(copper: DrawnCopper, chain: Sequence[Edge]) -> None:
    nets, layers = {track.net for _, _, track in chain}, {track.layer for _, _, track in chain}
    for zone in copper.zones:
        if zone.net in nets and zone.net and zone.layers & layers:
            raise DrawnCoilError(f"the zone at {place_text(zone.corner, min(zone.layers & layers))} has the coil's net "
                                 f"{zone.net}: current in an area is not computed")


def _require_no_short(graph: _Graph, chain: Sequence[Edge]) -> None:
    """Raise DrawnCoilError if two distant parts of the conductor touch each other.

    Their distance along the conductor is compared with `NEIGHBOURS`.
    """
    by_layer: dict[str, list[int]] = defaultdict(list)
    for k, (_, _, track) in enumerate(chain):
        by_layer[track.layer].append(k)
    stations = np.cumsum([0.0, *(track.line.length for _, _, track in chain)])
    for layer, numbers in by_layer.items():
        pieces = from_rows([row for k in numbers for row, _ in path_rows([chain[k][2].line])])
        half = np.array([chain[k][2].width / 2 for k in numbers])
        pairs = nearest_pairs(pieces.boxes, half)
        if not len(pairs):
            continue
        first, second = np.array(numbers)[pairs[:, 0]], np.array(numbers)[pairs[:, 1]]
        reach = half[pairs[:, 0]] + half[pairs[:, 1]]
        between = stations[second] - stations[first + 1]
        chosen = between > NEIGHBOURS * reach
        apart = distances(pieces.take(pairs[chosen, 0]), pieces.take(pairs[chosen, 1]))
        touching = np.flatnonzero(apart < reach[chosen] - JOINED)
        if touching.size:
            line, later = (chain[index[chosen][touching[0]]][2].line for index in (first, second))
            place = min((line.at(k / 50.0) for k in range(51)), key=later.distance)
            raise DrawnCoilError(f"turns touch at {place_text(place, layer)}: the current takes a short way there")
    for k, (a, _, _) in enumerate(chain):
        if a >= len(graph.pads):
            continue
        pad = graph.pads[a]
        for later, (_, _, track) in enumerate(chain):
            separation = abs(stations[later] - stations[k]) if later >= k else abs(stations[later + 1] - stations[k])
            if track.layer in pad.layers and separation > NEIGHBOURS * max(pad.size):
                x0, y0, x1, y1 = track.line.box
                reach = max(pad.size) + track.width
                if not (x0 - reach <= pad.centre.x <= x1 + reach and y0 - reach <= pad.centre.y <= y1 + reach):
                    continue
                nearest = _nearest_point(track.line, pad.centre)
                if pad.distance(nearest) < track.width / 2 - JOINED:
                    raise DrawnCoilError(f"a turn touches {graph.name(a)} at {place_text(nearest, track.layer)}: the "
                                         "current takes a short way there")


NEIGHBOURS = 2.0
"""Largest distance along the conductor between two of its pieces that may touch without being a short circuit.

The distance is divided by the mean width of the two pieces. For a pad and a piece, it is divided by the pad's size.
"""
