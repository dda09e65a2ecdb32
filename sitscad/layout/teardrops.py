"""Teardrops: copper that widens a track towards the via or contact where it ends, where all distances leave room.

The joint of a thin track and a pad is where a flexible circuit cracks first, and where a drill that is out of register
breaks the track off. A via's teardrop is the hull of its pad and of the track's width some way off; a contact's is the
trapezoid from the contact's edge to the track.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from sitscad.geometry.path import Line, Path, Point, Segment, closed_polygon
from sitscad.geometry.primitives import (
    Floats,
    Indices,
    Primitives,
    Row,
    distances,
    from_rows,
    line_row,
    nearest_pairs,
    path_rows,
    to_points,
)
from sitscad.layout.clearance import ALONG
from sitscad.layout.pieces import Pad, Teardrop, Trace, Via
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec

REACHES = (1.5, 1.2, 0.9, 0.75)
"""Lengths that are tried, in diameters of the pad from its centre, or in widths of the contact from its edge."""

INSIDE = 10e-6
"""How far (m) a contact's teardrop reaches into the contact, so that rounding leaves no slit."""

CHORD = 1e-6

SLACK = 1e-9


class Drawn(Protocol):
    """What teardrops are drawn on: tracks, holes and contacts within an outline (a `Layout`)."""

    @property
    def spec(self) -> SensorSpec:
        """The spec, with the fabricator's rules."""

    @property
    def traces(self) -> tuple[Trace, ...]:
        """The tracks."""

    @property
    def vias(self) -> tuple[Via, ...]:
        """The plated holes."""

    @property
    def pads(self) -> tuple[Pad, ...]:
        """The contacts."""

    @property
    def all_pads(self) -> tuple[Pad, ...]:
        """The contacts, and the capacitors' pads."""

    @property
    def outline(self) -> Path:
        """The board's edge."""

    def lowest_layer(self, via: Via) -> int:
        """The last copper layer, from the top, that a hole goes through."""

    def vias_on(self, number: int) -> tuple[Via, ...]:
        """The holes that go through one copper layer."""


def teardrops(layout: Drawn) -> tuple[Teardrop, ...]:
    """The teardrops of a layout, those that keep the fabricator's distances from all copper, holes and the edge."""
    if layout.spec.fpc.teardrops == "none":
        return ()
    tried = list(_tries(layout))
    roomy: set[int] = set()
    for layer in {layout.traces[one.track].layer for one in tried}:
        there = [k for k, one in enumerate(tried) if layout.traces[one.track].layer == layer]
        room = _Surroundings(layout, layer).leave_room([tried[k] for k in there])
        roomy.update(k for k, free in zip(there, room, strict=True) if free)
    found: dict[tuple[int, bool], Teardrop] = {}
    for k, one in enumerate(tried):
        if k in roomy:
            trace = layout.traces[one.track]
            drop = Teardrop(one.outline, trace.layer, trace.net, one.track, one.at_start, one.leg.start)
            found.setdefault((one.track, one.at_start), drop)
    return tuple(found.values())


@record
class _Try:
    # An outline at one end of a track (its index), whose leg leaves there.
    outline: Path
    track: int
    at_start: bool
    leg: Segment


def _tries(layout: Drawn) -> Iterator[_Try]:
    """All outlines at all ends, long ones first at each."""
    for index, trace in enumerate(layout.traces):
        for at_start in (True, False):
            leg = trace.path.segments[0] if at_start else trace.path.segments[-1].reversed()
            for outline, _ in _outlines(layout, trace, leg):
                yield _Try(outline, index, at_start, leg)


def _outlines(layout: Drawn, trace: Trace, leg: Segment) -> Iterator[tuple[Path, float]]:
    """Outlines for a track's straight leg that leaves a via or a contact, long ones first, each with its length (m)."""
    if not isinstance(leg, Line):
        return
    vias = (via for via in layout.vias_on(trace.layer) if via.net == trace.net)
    via = next((via for via in vias if via.centre.distance(leg.start) < SLACK), None)
    if via is not None:
        yield from _of_via(via, leg, trace.width)
        return
    for pad in layout.pads:
        if pad.layer == trace.layer and pad.net == trace.net and pad.holds(leg.start):
            yield from _of_contact(pad, leg, trace.width)


def _of_via(via: Via, leg: Line, width: float) -> Iterator[tuple[Path, float]]:
    """The tangents from a pad to a circle as wide as the track, some way along it."""
    large, small = via.pad / 2, width / 2
    if small >= large:
        return
    ux, uy = (leg.end.x - leg.start.x) / leg.length, (leg.end.y - leg.start.y) / leg.length
    for reach in (factor * via.pad for factor in REACHES):
        if reach > leg.length:
            continue
        cos = (large - small) / reach
        sin = math.sqrt(1.0 - cos * cos)
        sides = [(ux * cos - side * uy * sin, uy * cos + side * ux * sin) for side in (1.0, -1.0)]
        far = via.centre.shifted(reach * ux, reach * uy)
        near = [via.centre.shifted(large * x, large * y) for x, y in sides]
        ends = [far.shifted(small * x, small * y) for x, y in sides]
        yield closed_polygon([near[0], near[1], ends[1], ends[0]]), reach


def _of_contact(pad: Pad, leg: Line, width: float) -> Iterator[tuple[Path, float]]:
    """The trapezoid from the edge of a contact to a track that leaves it square."""
    if abs(leg.end.x - leg.start.x) < SLACK < abs(leg.end.y - leg.start.y):
        across = replace(pad, centre=_exchanged(pad.centre), size=pad.size[::-1])
        lying = Line(_exchanged(leg.start), _exchanged(leg.end))
        for outline, reach in _of_contact(across, lying, width):
            yield outline.mapped(_exchanged, flips=True).reversed(), reach
        return
    height = pad.size[1]
    if abs(leg.end.y - leg.start.y) > SLACK or width >= height:
        return
    side = math.copysign(1.0, leg.end.x - leg.start.x)
    edge = pad.centre.x + side * pad.size[0] / 2
    for reach in (factor * height for factor in REACHES):
        if (leg.end.x - edge) * side < reach:
            continue
        base, far, y = edge - side * INSIDE, edge + side * reach, leg.start.y
        low, high = pad.centre.y - height / 2, pad.centre.y + height / 2
        corners = [Point(base, low), Point(edge, low), Point(far, y - width / 2), Point(far, y + width / 2)]
        yield closed_polygon([*corners, Point(edge, high), Point(base, high)]), reach


def _exchanged(point: Point) -> Point:
    return Point(point.y, point.x)


class _Surroundings:
    """The copper of a layer, the holes and the edge, with the distance that a teardrop must keep from each piece."""

    def __init__(self, layout: Drawn, layer: int) -> None:
        self._layout = layout
        rules = layout.spec.fpc.rules
        rows: list[Row] = []
        keep: list[float] = []
        ways: dict[int, tuple[float, float]] = {}
        self._owner: list[tuple[str, int]] = []
        self._net: list[str] = []

        def add(row: Row, distance: float, owner: tuple[str, int], net: str) -> None:
            rows.append(row)
            keep.append(distance)
            self._owner.append(owner)
            self._net.append(net)

        spacing = rules.trace_spacing
        for i, trace in enumerate(layout.traces):
            if trace.layer == layer:
                way = 0.0
                for row, length in path_rows(trace.path):
                    ways[len(rows)] = way, way + length
                    add(row, spacing + trace.width / 2, ("trace", i), trace.net)
                    way += length
        for i, via in enumerate(layout.vias):
            if layer > layout.lowest_layer(via):
                continue
            away = max(via.pad / 2 + spacing, via.drill / 2 + rules.drill_to_copper)
            add(line_row(*via.centre, *via.centre), away, ("via", i), via.net)
        for i, pad in enumerate(layout.all_pads):
            if pad.layer == layer:
                (x, y), half = pad.centre, min(pad.size) / 2
                dx, dy = (side / 2 - half for side in pad.size)
                add(line_row(x - dx, y - dy, x + dx, y + dy), spacing + half, ("pad", i), pad.net)
        for row, _ in path_rows(layout.outline):
            add(row, rules.copper_to_edge, ("edge", 0), "")
        self._pieces: Primitives = from_rows(rows)
        self._boxes = self._pieces.boxes
        self._keep = np.array(keep)
        self._ways = ways

    def leave_room(self, tries: Sequence[_Try]) -> list[bool]:
        """Whether outlines keep their distance from everything but the track there, what it ends at, and its next."""
        rows = [(row, k) for k, one in enumerate(tries) for row, _ in path_rows(one.outline)]
        edges, owner = from_rows([row for row, _ in rows]), [k for _, k in rows]
        pairs = nearest_pairs(edges.boxes, np.zeros(len(edges)), self._boxes, self._keep)
        first, last = self._farther_on(tries, np.array(owner, dtype=np.intp)[pairs[:, 0]], pairs[:, 1])
        left = first < last
        pairs, first, last = pairs[left], first[left], last[left]
        gaps = distances(edges.take(pairs[:, 0]), self._pieces.take(pairs[:, 1]).trimmed(first, last))
        close = pairs[gaps < self._keep[pairs[:, 1]] - SLACK]
        met = {(owner[edge], piece) for edge, piece in close.tolist()}
        short = {k for k, piece in met if not self._is_joined(piece, tries[k].track, tries[k].leg)}
        return [k not in short for k in range(len(tries))]

    def _farther_on(self, tries: Sequence[_Try], tried: Indices, pieces: Indices) -> tuple[Floats, Floats]:
        """Which part (two fractions) of each piece counts: all of it, but of the outline's own track only what lies
        so far along it that it has come back, not bent.
        """
        first, last = np.zeros(len(pieces)), np.ones(len(pieces))
        for at, (k, piece) in enumerate(zip(tried.tolist(), pieces.tolist(), strict=True)):
            one, (kind, number) = tries[k], self._owner[piece]
            if kind != "trace" or number != one.track:
                continue
            start, end = self._ways[piece]
            reach = max(one.leg.start.distance(corner) for corner in one.outline.flattened(CHORD))
            bend = reach + ALONG * float(self._keep[piece])
            if one.at_start:
                first[at] = min(1.0, max(0.0, (bend - start) / (end - start)))
            else:
                way = self._layout.traces[number].path.length - bend
                last[at] = min(1.0, max(0.0, (way - start) / (end - start)))
        return first, last

    def _is_joined(self, piece: int, index: int, leg: Segment) -> bool:
        """Whether a piece of copper is joined to the track at that leg, and so may be touched."""
        (kind, number), trace = self._owner[piece], self._layout.traces[index]
        if kind == "edge" or self._net[piece] != trace.net:
            return False
        if kind == "via":
            return self._layout.vias[number].centre.distance(leg.start) < SLACK
        if kind == "pad":
            return self._layout.all_pads[number].holds(leg.start)
        if number == index:
            return False  # what is left of it lies farther along it
        other = self._layout.traces[number].path
        if min(p.distance(leg.start) for p in (other.start, other.end)) < SLACK:
            return True
        follows = min(p.distance(leg.end) for p in (other.start, other.end)) < SLACK
        there = np.array([leg.end])
        return follows and float(to_points(self._pieces.take(np.array([piece])), there)[0]) < trace.width
