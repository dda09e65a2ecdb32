"""`lay_out`: puts coils, vias, leads and tail together on one board, and says what found no room."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice

from sitscad.finding import Finding
from sitscad.geometry.path import Point, bounding_box
from sitscad.geometry.spiral import outer_boundary
from sitscad.layout import room
from sitscad.layout.board import Coil, Layout, Role, Trace, Via, Winding
from sitscad.layout.clearance import Hole, Obstacles, Track, hole_keep_out
from sitscad.layout.escape import Escape, OuterEnd, Patience, Surroundings, escape, outer_ends
from sitscad.layout.inner_vias import InnerJoin, place_inner_vias
from sitscad.layout.lanes import Bus, Exit, Lane, assign_lanes, bus_for, exits, lane_height, rows_of_lanes
from sitscad.layout.maze import Ground, Maze
from sitscad.layout.outline import Body, outline
from sitscad.layout.ring import Ring
from sitscad.layout.tail import Run, TailFrame, connector_of, frame, opening, pair_height, runs, stiffener
from sitscad.layout.windings import inner_clear_radius, wind_coil
from sitscad.spec.presets import connector
from sitscad.spec.sensor import SensorSpec


@dataclass(frozen=True)
class _WoundCoil:
    """A coil before it is led out: its windings, the joins inside, and what could not be placed."""

    windings: tuple[Winding, ...]
    inner: tuple[InnerJoin, ...]
    way_out_layer: int | None
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class _Routing:
    """One complete answer of the search: an escape for every coil, on a board of some half width."""

    bus: Bus
    lanes: tuple[Lane, ...]
    escapes: tuple[Escape, ...]
    half_width: float
    free: bool = False


def lay_out(spec: SensorSpec) -> Layout:
    """Lay out the whole board.

    Never raises for want of room: what found none is missing from the layout and named in `Layout.findings`, with the
    missing length. Coils that could not be led out are still wound, so that they can be estimated.
    """
    bus = bus_for(spec)
    wound = _wind(spec, bus)
    findings = list(wound[0].findings)
    if not _in_line(spec) and not bus.is_stacked:
        findings.append(room.not_in_line(spec))
    front = _front(spec, bus)
    routing = None if findings else (_route if _in_line(spec) else _route_freely)(spec, bus, wound, front)
    if not findings and routing is None:
        findings.append(room.no_way_for_leads(spec, bus))
    bus = routing.bus if routing else bus
    half_width = routing.half_width if routing else _boards(spec, bus)[0][1]
    free = routing is not None and routing.free
    tail = (
        _free_frame(spec, bus, front, half_width)
        if free
        else frame(spec, bus, connector_of(spec, connector("solder-pads")), front, half_width)
    )
    if routing and not _tail_is_clear(spec, routing, tail):
        findings.append(room.no_tail_room(spec, tail))
    return _assemble(spec, bus, wound, routing, tail, half_width, tuple(findings))


def _in_line(spec: SensorSpec) -> bool:
    """Whether all coils stand on the jaw's axis, so that lanes along it serve them."""
    return all(abs(placement.centre[1]) < 1e-9 and not placement.rotation for placement in spec.array.placements)


def _tail_is_clear(spec: SensorSpec, routing: _Routing, tail: TailFrame) -> bool:
    """Whether the conductors from the funnel to the contacts keep their distance from those of other coils."""
    board = Obstacles(spec.fpc.rules, routing.bus.spacing)
    for way, lane in zip(routing.escapes, routing.lanes, strict=True):
        for run in runs(spec, routing.bus, tail, lane, _entries(way)):
            tracks = [piece for piece in run.pieces if isinstance(piece, Track)]
            holes = [piece for piece in run.pieces if isinstance(piece, Hole)]
            if not board.admits(tracks, holes):
                return False
            board.add(tracks, holes)
    return True


def _wind(spec: SensorSpec, bus: Bus) -> tuple[_WoundCoil, ...]:
    """Every coil wound and joined inside; the search for the vias is done once, on the first coil, and shifted."""
    first = spec.array.placements[0]
    windings = wind_coil(spec, first)
    centre = Point(*first.centre)
    spare = _way_out_layer(spec)
    findings: list[Finding] = []
    joins: tuple[InnerJoin, ...] = ()
    if len(windings) % 2 and spare is None:
        findings.append(room.no_way_out(spec))
    if len(windings) > 1 or spare is not None:
        coil = spec.coil
        clear = inner_clear_radius(coil, windings, centre)
        found = place_inner_vias(windings, coil.turns, centre, coil.trace_width, clear, spec.fpc.rules, bus.spacing)
        joins = found or ()
        if found is None:
            findings.append(room.no_inner_room(spec, bus, clear, (len(windings) + 1) // 2))
    model = _WoundCoil(windings, joins, spare, tuple(findings))
    return tuple(
        model if placement is first else _moved(model, wind_coil(spec, placement), first.centre, placement.centre)
        for placement in spec.array.placements
    )


def _moved(
    model: _WoundCoil, windings: tuple[Winding, ...], origin: tuple[float, float], centre: tuple[float, float]
) -> _WoundCoil:
    dx, dy = centre[0] - origin[0], centre[1] - origin[1]
    inner = tuple(
        InnerJoin(
            Hole(join.hole.centre.shifted(dx, dy), join.hole.pad, join.hole.drill),
            tuple((layer, path.shifted(dx, dy)) for layer, path in join.stubs),
        )
        for join in model.inner
    )
    return _WoundCoil(windings, inner, model.way_out_layer, model.findings)


def _way_out_layer(spec: SensorSpec) -> int | None:
    """The copper layer on which a coil with an odd number of layers comes out from under its turns."""
    if len(spec.coil.layers) % 2 == 0:
        return None
    free = [layer.number for layer in spec.fpc.stackup.copper if layer.number not in spec.coil.layers]
    return next((number for number in free if number == 2), free[0] if free else None)


def _front(spec: SensorSpec, bus: Bus) -> float:
    """Where along x all coils, their vias and leads lie behind: from here on only lanes run."""
    rules = spec.fpc.rules
    hole = Hole(Point(0.0, 0.0), rules.via_pad, rules.via_drill)
    reach = spec.coil.size[0] / 2 + hole_keep_out(hole, rules, bus.spacing) + rules.via_pad / 2
    lanes = (len(spec.array.placements) - 1) // 2 + 1
    return max(p.centre[0] for p in spec.array.placements) + reach + lanes * bus.pitch


def _boards(spec: SensorSpec, bus: Bus) -> list[tuple[Bus, float]]:
    """Boards to try, narrow first: the lanes' base and the body's half width.

    Lanes close to the coils; with a track's room between; with a via's room between; and in each case no more room
    beside the coils than the lanes take, room for a track, or room for a via.
    """
    rules = spec.fpc.rules
    hole = Hole(Point(0.0, 0.0), rules.via_pad, rules.via_drill)
    via_room = hole_keep_out(hole, rules, bus.spacing) + rules.via_pad / 2
    passing = len(spec.array.placements) // 2
    boards = []
    for base in (0.0, bus.pitch, via_room) if passing else (0.0,):
        raised = replace(bus, base=base)
        lanes = lane_height(raised, passing - 1, 1) + bus.width / 2 if passing else bus.reach
        for beside in (0.0, bus.spacing + bus.width, via_room):
            boards.append((raised, round(max(lanes, bus.reach + beside) + rules.copper_to_edge, 9)))
    return sorted(set(boards), key=lambda board: (board[1], board[0].base))


def _route(spec: SensorSpec, bus: Bus, wound: tuple[_WoundCoil, ...], front: float) -> _Routing | None:
    """The narrowest board with room, the first lane on the side where the far coil begins, else on the other."""
    begins = wound[0].windings[0].path.start.y - spec.array.placements[0].centre[1]
    sides = (1, -1) if begins >= -1e-9 else (-1, 1)
    patience = Patience()
    for raised, half_width in _boards(spec, bus):
        for side in sides[: len(wound)]:
            routing = _route_by(spec, raised, wound, front, half_width, side, patience)
            if routing is not None:
                return routing
    return None


def _route_by(
    spec: SensorSpec,
    bus: Bus,
    wound: tuple[_WoundCoil, ...],
    front: float,
    half_width: float,
    side: int,
    patience: Patience,
) -> _Routing | None:
    lanes = assign_lanes(spec.array.placements, side)
    board = Obstacles(spec.fpc.rules, bus.spacing, half_width)
    escapes: dict[int, Escape] = {}
    for index in sorted(range(len(wound)), key=lambda i: spec.array.placements[i].centre[0]):
        choices = exits(spec, bus, lanes[index], front)
        found = _lead_out(
            Surroundings(spec, bus, lanes[index].placement, half_width), wound, index, choices, board, patience
        )
        if found is None:
            return None
        for branch in found.branches:
            board.add(branch.tracks, branch.holes)
        escapes[index] = found
    return _Routing(bus, lanes, tuple(escapes[i] for i in range(len(wound))), half_width)


def _lead_out(
    around: Surroundings,
    wound: tuple[_WoundCoil, ...],
    index: int,
    choices: list[tuple[Exit, Exit]],
    board: Obstacles,
    patience: Patience,
) -> Escape | None:
    """One coil's escape among the other coils and what is on the board already."""
    obstacles = board.copy()
    obstacles.add(_other_coils(around.spec, index), _inner_holes(wound[index]))
    start, joins, end = _ends(wound[index])
    return escape(around, joins, (start, end), choices, obstacles, patience)


def _route_freely(spec: SensorSpec, bus: Bus, wound: tuple[_WoundCoil, ...], front: float) -> _Routing | None:
    """Routing for coils that do not stand in one line: near ones first, each by the shortest way that is left."""
    patience = Patience()
    half_widths = sorted({width for _, width in _boards(spec, bus)})
    lanes = rows_of_lanes(spec.array.placements)
    via_room = Surroundings(spec, bus, lanes[0].placement, 0.0).keep_out + spec.fpc.rules.via_pad / 2
    for base in (0.0, bus.pitch, via_room):
        for half_width in half_widths[-2:]:
            raised = replace(bus, base=base)
            routing = _route_through(spec, raised, wound, lanes, front, half_width, patience)
            if routing is not None:
                return routing
    return None


def _route_through(
    spec: SensorSpec,
    bus: Bus,
    wound: tuple[_WoundCoil, ...],
    lanes: tuple[Lane, ...],
    front: float,
    half_width: float,
    patience: Patience,
) -> _Routing | None:
    tail = _free_frame(spec, bus, front, half_width)
    start = min(p.centre[0] - Ring(spec.coil, p, 0.0).half_size[0] for p in spec.array.placements)
    board = Obstacles(spec.fpc.rules, bus.spacing, half_width)
    maze = Maze(spec, bus, Ground(start, front, tail.funnel, half_width, tail.half_width))
    escapes: dict[int, Escape] = {}
    for index in sorted(range(len(wound)), key=lambda i: -spec.array.placements[i].centre[0]):
        lane = lanes[index]
        entry = Point(tail.funnel, pair_height(spec, tail, lane))
        around = Surroundings(spec, bus, lane.placement, half_width)
        for choice in islice(maze.exits(lane.placement, entry), TRIED):
            found = _lead_out(around, wound, index, [choice], board, patience)
            if found is not None:
                break
        else:
            return None
        for branch in found.branches:
            board.add(branch.tracks, branch.holes)
            maze.tracks.extend(branch.tracks)
            maze.holes.extend(branch.holes)
        escapes[index] = found
    return _Routing(bus, lanes, tuple(escapes[i] for i in range(len(wound))), half_width, free=True)


def _free_frame(spec: SensorSpec, bus: Bus, front: float, half_width: float) -> TailFrame:
    """The tail of an array not in line: the taper is room for the pairs to come together, their lanes begin behind it."""
    tail = frame(spec, bus, connector_of(spec, connector("solder-pads")), front, half_width)
    gather = max(tail.start, front + 0.3e-3 * len(spec.array.placements))
    return replace(tail, start=gather, funnel=gather)


TRIED = 8
"""Exits of a coil that are tried in an array not in line, shortest way first."""


def _other_coils(spec: SensorSpec, index: int) -> list[Track]:
    """The outermost copper of all coils but one, on every layer that they are wound on."""
    boundary = outer_boundary(spec.coil.shape, spec.coil.size, -spec.coil.trace_width / 2)
    return [
        Track(boundary.rotated(placement.rotation).shifted(*placement.centre), spec.coil.trace_width, layer)
        for i, placement in enumerate(spec.array.placements)
        for layer in spec.coil.layers
        if i != index
    ]


def _inner_holes(coil: _WoundCoil) -> list[Hole]:
    """The vias inside a winding that a lead coming out from under the turns must pass: all but the one it begins at."""
    if coil.way_out_layer is None:
        return []
    return [join.hole for join in coil.inner[:-1]]


def _ends(coil: _WoundCoil) -> tuple[OuterEnd, list[tuple[OuterEnd, OuterEnd]], OuterEnd | None]:
    start, joins, end = outer_ends(coil.windings)
    if end is None and coil.way_out_layer is not None:
        end = OuterEnd(coil.inner[-1].hole.centre, coil.way_out_layer, from_inside=True)
    return start, joins, end


def _assemble(
    spec: SensorSpec,
    bus: Bus,
    wound: tuple[_WoundCoil, ...],
    routing: _Routing | None,
    tail: TailFrame,
    half_width: float,
    findings: tuple[Finding, ...],
) -> Layout:
    coils: list[Coil] = []
    pads = []
    for index, (placement, coil) in enumerate(zip(spec.array.placements, wound, strict=True)):
        way = routing.escapes[index] if routing else None
        ends = runs(spec, bus, tail, routing.lanes[index], _entries(way)) if routing and way else None
        series = _series(spec, placement.name, coil, way, ends)
        coils.append(Coil(placement, placement.name, coil.windings, series, way is not None and way.lead_b is not None))
        pads += [run.pad for run in ends] if ends else []
    pieces = [piece for coil in coils for piece in coil.series]
    traces = tuple(piece for piece in pieces if isinstance(piece, Trace))
    vias = tuple(piece for piece in pieces if isinstance(piece, Via))
    body = _body(spec, traces, vias, half_width, tail)
    plate = stiffener(spec, tail)
    return Layout(
        spec=spec,
        coils=tuple(coils),
        traces=traces,
        vias=vias,
        pads=tuple(sorted(pads, key=lambda pad: pad.number)),
        outline=outline(body, tail, _copper_points(traces, vias), spec.fpc.rules.copper_to_edge),
        body=(body.start, -body.half_width, body.end, body.half_width),
        top_openings=(opening(spec, tail),),
        bottom_openings=(),
        stiffener=plate,
        bend_zone=_bend_zone(spec, tail),
        findings=findings,
    )


def _entries(way: Escape) -> tuple[Point, Point]:
    lead_b = way.lead_b or way.lead_a
    return way.lead_a.tracks[-1].path.end, lead_b.tracks[-1].path.end


def _body(
    spec: SensorSpec, traces: tuple[Trace, ...], vias: tuple[Via, ...], half_width: float, tail: TailFrame
) -> Body:
    """The body reaches from the farthest copper to where the tail begins to narrow."""
    edge = spec.fpc.rules.copper_to_edge
    left = [bounding_box([trace.path])[0] - trace.width / 2 for trace in traces]
    left += [via.centre.x - via.pad / 2 for via in vias]
    left += [p.centre[0] - Ring(spec.coil, p, 0.0).half_size[0] for p in spec.array.placements]
    return Body(min(left) - edge, tail.body_end, half_width)


def _copper_points(traces: tuple[Trace, ...], vias: tuple[Via, ...]) -> list[tuple[Point, float]]:
    """Points of the copper with its half width there (m): ends of all pieces, middles of the windings' arcs, vias."""
    points = [(via.centre, via.pad / 2) for via in vias]
    for trace in traces:
        points.append((trace.path.start, trace.width / 2))
        for segment in trace.path:
            points += [(segment.at(fraction), trace.width / 2) for fraction in (0.25, 0.5, 0.75, 1.0)]
    return points


def _bend_zone(spec: SensorSpec, tail: TailFrame) -> tuple[float, float] | None:
    """Where the tail may be bent: between the taper and the stiffener, free of vias."""
    if spec.fpc.tail is None or spec.fpc.tail.bend == "none":
        return None
    end = tail.end - tail.connector.stiffener_length
    return (tail.start, end) if end > tail.start else None


def _series(
    spec: SensorSpec, net: str, coil: _WoundCoil, way: Escape | None, ends: tuple[Run, Run] | None
) -> tuple[Trace | Via, ...]:
    """Every conductor of a coil in the order of the current, from contact A to contact B."""
    series: list[Trace | Via] = []
    if way and ends:
        series += _backwards(_pieces(net, ends[0].pieces, spec.coil.trace_width))
        series += _backwards(_pieces(net, way.lead_a.pieces, 0.0))
    for index, winding in enumerate(coil.windings):
        series.append(Trace(winding.path, spec.coil.trace_width, winding.layer, net, Role.WINDING))
        if winding.inward:
            series += _inner_pieces(spec, net, coil, index // 2)
        elif way and index + 1 < len(coil.windings):
            series += _pieces(net, way.joins[index // 2].pieces, 0.0, Role.STUB)
    if way and ends and way.lead_b:
        series += _pieces(net, way.lead_b.pieces, 0.0)
        series += _pieces(net, ends[1].pieces, spec.coil.trace_width)
    return tuple(series)


def _inner_pieces(spec: SensorSpec, net: str, coil: _WoundCoil, join: int) -> list[Trace | Via]:
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


def _pieces(
    net: str, pieces: tuple[Track | Hole, ...], neck_width: float, role: Role | None = None
) -> list[Trace | Via]:
    """Tracks and holes with their net; a track wider than the neck is the tail's."""
    named: list[Trace | Via] = []
    for piece in pieces:
        if isinstance(piece, Hole):
            named.append(Via(piece.centre, piece.drill, piece.pad, net))
        elif piece.path.segments:
            part = Role.TAIL if 0.0 < neck_width < piece.width else Role.LEAD
            named.append(Trace(piece.path, piece.width, piece.layer, net, role or part))
    return named


def _backwards(pieces: list[Trace | Via]) -> list[Trace | Via]:
    return [
        Trace(p.path.reversed(), p.width, p.layer, p.net, p.role) if isinstance(p, Trace) else p
        for p in reversed(pieces)
    ]
