"""`lay_out`: puts coils, vias, leads and tail together on one board, and says what found no room."""

from __future__ import annotations

import math

from sitscad.finding import Shortfall
from sitscad.geometry.path import Point, Segment
from sitscad.layout import shortfalls as room
from sitscad.layout.axis import about_axis, placed
from sitscad.layout.board import Capacitor, Coil, Layout
from sitscad.layout.clearance import Hole, Obstacles, Track
from sitscad.layout.outline import Body, body_of, far_end, outline
from sitscad.layout.pieces import Role, Trace, Via
from sitscad.layout.routing.escape import Escape
from sitscad.layout.routing.lanes import Bus, bus_for
from sitscad.layout.routing.routes import (
    Routing,
    boards,
    body_frame,
    front_of,
    in_line,
    reaching_ahead,
    route_freely,
    route_in_line,
)
from sitscad.layout.routing.search_limit import SearchLimit
from sitscad.layout.tail.frame import CORNER_RADIUS, TailFrame, first_via, turn_begin
from sitscad.layout.tail.openings import chip_openings, contact_openings
from sitscad.layout.tail.stiffening import stiffener
from sitscad.layout.tail.tracks import Run, unused_contacts
from sitscad.layout.tail.turn import course, turned
from sitscad.layout.winding.wound_coils import WoundCoil, wind_all
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec


def arrange(spec: SensorSpec, searches: SearchLimit | None = None) -> Layout:
    """Lay out the whole board.

    Never raises for want of room: what found none is missing from the layout and named in `Layout.shortfalls`. Coils
    that could not be led out are still wound, so that they can be estimated. What is tried counts against `searches`,
    where it is given, else against a limit of its own.
    """
    level = about_axis(spec)
    found = _attempt(level, searches or SearchLimit())
    return placed(_assemble(level, found, found.shortfalls), spec)


@record
class _Attempt:
    # The coils wound, and how they are led out if they are.
    wound: tuple[WoundCoil, ...]
    routing: Routing | None
    bus: Bus
    tail: TailFrame
    body: Body
    shortfalls: tuple[Shortfall, ...]


def _attempt(spec: SensorSpec, searches: SearchLimit) -> _Attempt:
    """Windings, routing, tail and body as far as there is room, and what found none."""
    bus = bus_for(spec)
    wound = wind_all(spec, bus)
    shortfalls = list(wound[0].shortfalls)
    if not in_line(spec) and not bus.is_stacked:
        shortfalls.append(room.not_in_line(spec))
    front = front_of(spec, bus)
    routing = None
    if not shortfalls:
        routing = (route_in_line if in_line(spec) else route_freely)(spec, bus, wound, front, searches)
        if routing is None:
            shortfalls.append(room.no_way_for_leads())
        elif not _tail_is_clear(spec, routing):
            shortfalls.append(room.no_tail_room(spec, routing.tail))
            routing = None
    if routing is None:
        far, breadth = far_end(spec, (), ()), boards(spec, bus)[0][1]
        tail = reaching_ahead(spec, far, body_frame(spec, bus, front, breadth))
        return _Attempt(wound, None, bus, tail, body_of(spec, far, breadth, tail), tuple(shortfalls))
    body = body_of(spec, routing.far, routing.breadth, routing.tail)
    return _Attempt(wound, routing, routing.bus, routing.tail, body, tuple(shortfalls))


def _tail_is_clear(spec: SensorSpec, routing: Routing) -> bool:
    """Whether the conductors from the funnel to the contacts keep their distance from those of other coils."""
    board = Obstacles(spec.fpc.rules, routing.bus.spacing)
    for both in routing.ends:
        for run in both:
            tracks = [piece for piece in run.pieces if isinstance(piece, Track)]
            holes = [piece for piece in run.pieces if isinstance(piece, Hole)]
            if not board.admits(tracks, holes):
                return False
            board.add(tracks, holes)
    return True


def _assemble(spec: SensorSpec, found: _Attempt, shortfalls: tuple[Shortfall, ...]) -> Layout:
    """The layout of what was found, its tail turned where the spec asks for it."""
    bus, wound, routing, tail, body = found.bus, found.wound, found.routing, found.tail, found.body
    coils: list[Coil] = []
    pads, capacitors = [], []
    for index, (placement, coil) in enumerate(zip(spec.array.placements, wound, strict=True)):
        way = routing.escapes[index] if routing else None
        ends = routing.ends[index] if routing else None
        series = _series(spec, placement.name, coil, way, ends)
        coils.append(Coil(placement, placement.name, coil.windings, series, way is not None))
        pads += [run.pad for run in ends] if ends else []
        if ends and ends[0].chip_pad and ends[1].chip_pad and tail.chip:
            both = (ends[0].chip_pad, ends[1].chip_pad)
            capacitors.append(Capacitor(both[0].reference, placement.name, tail.chip.name, both))
    pieces = [piece for coil in coils for piece in coil.series]
    traces = tuple(piece for piece in pieces if isinstance(piece, Trace))
    vias = tuple(piece for piece in pieces if isinstance(piece, Via))
    contacts = tuple(sorted([*pads, *unused_contacts(tail)] if pads else [], key=lambda pad: pad.number))
    copper = _copper_points(traces, vias, body.start + CORNER_RADIUS)
    plate = stiffener(spec, tail)
    begin = turn_begin(spec, bus, tail)
    straight = Layout(
        spec=spec,
        coils=tuple(coils),
        traces=traces,
        vias=vias,
        pads=contacts,
        outline=outline(body, tail, copper, spec.fpc.rules.copper_to_edge),
        body=(body.start, body.low, body.end, body.high),
        top_openings=(*contact_openings(spec, tail, contacts), *(r for c in capacitors for r in chip_openings(c.pads))),
        bottom_openings=(),
        stiffener=plate,
        bend_zone=_bend_zone(spec, tail, begin if tail.turn else math.inf),
        shortfalls=shortfalls,
        capacitors=tuple(capacitors),
        tail_length=tail.end - tail.body_end,
    )
    line = course(spec.fpc.tail, tail.half_width, begin)
    return turned(straight, line) if line else straight


def _at_least(segment: Segment) -> float:
    # No point of a segment has a smaller x: cheaper than where it really ends.
    return min(segment.start.x, segment.end.x) - segment.length


def _copper_points(traces: tuple[Trace, ...], vias: tuple[Via, ...], before: float) -> list[tuple[Point, float]]:
    """Points of the copper with its half width there (m): ends of all pieces, middles of the windings' arcs, vias.

    Pieces that lie beyond x = `before` (m) are left out.
    """
    points = [(via.centre, via.pad / 2) for via in vias]
    for trace in traces:
        points.append((trace.path.start, trace.width / 2))
        for segment in trace.path:
            if _at_least(segment) < before:
                points += [(segment.at(fraction), trace.width / 2) for fraction in (0.25, 0.5, 0.75, 1.0)]
    return points


def _bend_zone(spec: SensorSpec, tail: TailFrame, limit: float) -> tuple[float, float] | None:
    """Where the tail may bend: its sides straight, up to the stiffener or its turn at the limit (m), free of vias."""
    if spec.fpc.tail is None or spec.fpc.tail.bend == "none":
        return None
    end = min(tail.end - tail.connector.stiffener_length, first_via(spec, tail), limit)
    start = tail.start + tail.taper.reach_beyond
    return (start, end) if end > start else None


def _series(
    spec: SensorSpec, net: str, coil: WoundCoil, way: Escape | None, ends: tuple[Run, Run] | None
) -> tuple[Trace | Via, ...]:
    """Every conductor of a coil in the order of the current, from contact A to contact B."""
    series: list[Trace | Via] = []
    if way and ends:
        series += _backwards(_run_pieces(spec, net, ends[0]))
        series += _backwards(_pieces(net, way.lead_a.pieces, Role.LEAD))
    for index, winding in enumerate(coil.windings):
        series.append(Trace(winding.path, spec.coil.trace_width, winding.layer, net, Role.WINDING))
        if winding.inward:
            series += _inner_pieces(spec, net, coil, index // 2)
        elif way and index + 1 < len(coil.windings):
            series += _pieces(net, way.joins[index // 2].pieces, Role.STUB)
    if way and ends:
        series += _pieces(net, way.lead_b.pieces, Role.LEAD)
        series += _run_pieces(spec, net, ends[1])
    return tuple(series)


def _inner_pieces(spec: SensorSpec, net: str, coil: WoundCoil, join: int) -> list[Trace | Via]:
    """Via and stubs that join two layers inside a coil; none where there is no such join."""
    if join >= len(coil.inner):
        return []
    inner = coil.inner[join]
    width = spec.coil.trace_width
    layer, path = inner.stubs[0]
    pieces: list[Trace | Via] = [Trace(path, width, layer, net, Role.STUB)]
    pieces.append(Via(inner.hole.centre, inner.hole.drill, inner.hole.pad, net))
    for layer, path in inner.stubs[1:]:
        pieces.append(Trace(path.reversed(), width, layer, net, Role.STUB))
    return pieces


def _run_pieces(spec: SensorSpec, net: str, run: Run) -> list[Trace | Via]:
    """A conductor from the funnel to its contact; the holes of a tail of fewer layers end with these."""
    tail, copper = spec.fpc.tail, len(spec.fpc.stackup.copper)
    lowest = tail.layers if tail is not None and tail.layers < copper else None
    return [*_pieces(net, (run.neck,), Role.LEAD), *_pieces(net, run.lane, Role.TAIL, lowest)]


def _pieces(net: str, pieces: tuple[Track | Hole, ...], role: Role, lowest: int | None = None) -> list[Trace | Via]:
    """Tracks and holes with their net and what they are for; `lowest` is the last layer that the holes go through."""
    named: list[Trace | Via] = []
    for piece in pieces:
        if isinstance(piece, Hole):
            named.append(Via(piece.centre, piece.drill, piece.pad, net, lowest))
        elif piece.path.segments:
            named.append(Trace(piece.path, piece.width, piece.layer, net, role))
    return named


def _backwards(pieces: list[Trace | Via]) -> list[Trace | Via]:
    return [
        Trace(p.path.reversed(), p.width, p.layer, p.net, p.role) if isinstance(p, Trace) else p
        for p in reversed(pieces)
    ]
