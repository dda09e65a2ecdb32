"""Layout of the board from a spec: coils, vias, leads, tail, contacts and outline.

`Layout.shortfalls` lists where room is lacking, with the available and the needed size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Missing, Shortfall
from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.path import Path, Point, Region, bounding_box
from sitscad.kernels.geometry.shapes import SKETCHED
from sitscad.layout.bending import stiffener
from sitscad.layout.board import (
    Capacitor,
    Coil,
    Layout,
    LeadPair,
    Pad,
    Role,
    SolderedThermistor,
    Stiffener,
    Trace,
    Via,
    Winding,
)
from sitscad.layout.clearance import SLACK, Breadth, Obstacles, TrackToPlace, ViaToPlace
from sitscad.layout.drawn_board import drawn_layout
from sitscad.layout.lanes import Bus, bus_for, lead_spacings
from sitscad.layout.outline import BodyExtent, body_of, far_end, lack, least_x, openings, outline
from sitscad.layout.routing.escape import Escape, SearchLimit
from sitscad.layout.routing.routes import (
    Routing,
    boards,
    body_frame,
    front_of,
    reaching_ahead,
    route_freely,
    route_in_line,
)
from sitscad.layout.tail.frame import CORNER_RADIUS, TailFrame, course, first_via, turn_begin
from sitscad.layout.tail.thermistor import ThermistorRun
from sitscad.layout.tail.tracks import Run, unused_contacts
from sitscad.layout.windings import WoundCoil, wind_all, wind_coil
from sitscad.spec.circuit import FpcSpec
from sitscad.spec.coil import ArraySpec, CoilPlacement, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.resolver.validity import refuse_unusable
from sitscad.spec.sensor import ArtworkSpec, SensorSpec

__all__ = ["Coil", "Layout", "Pad", "Role", "Stiffener", "Trace", "Via", "Winding", "lay_out"]


@checked_arguments
def lay_out(spec: SensorSpec) -> Layout:
    """Lay out the sensor of a spec.

    Pieces without room are missing from the layout and named in `Layout.shortfalls`. They raise no error.

    Parameters
    ----------
    spec
        The spec of a sensor.

    Returns
    -------
    Layout
        Coils, leads, tail, outline and all other artwork, in metres.

    Raises
    ------
    SpecError
        if the spec was built in Python and has values that no spec file could contain

    Examples
    --------
    >>> import sitscad
    >>> coil = {"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...         "trace_width": "100 um", "trace_spacing": "100 um"}
    >>> spec = sitscad.SensorSpec.from_mapping(name="bench", coil=coil)
    >>> layout = sitscad.lay_out(spec)
    >>> len(layout.coils), layout.shortfalls
    (1, ())
    """
    refuse_unusable(spec)
    return arrange(spec)


def arrange(spec: SensorSpec, searches: SearchLimit | None = None) -> Layout:
    """Return the layout of the whole board. A lack of room raises no error.

    Pieces without room are missing from the layout, and `Layout.shortfalls` lists the missing room. Coils without leads
    still have their turns, so that their inductance can be estimated. `searches` limits the number of search trials for
    leads. None: a new limit of the default size.
    """
    if spec.coil.copper is not None:
        return replace(drawn_layout(_with_all_coils(spec), spec.coil.copper), spec=spec)
    level = _about_axis(_with_all_coils(spec))
    attempt = _attempt(level.artwork, searches or SearchLimit())
    return replace(_placed(_assemble(level, attempt), _with_all_coils(spec)), spec=spec)


def sketch(spec: SensorSpec, wider: int = 0) -> Layout:
    """Return an approximate layout without routing, at a hundredth of the cost of `arrange`.

    Coils are spirals of straight segments, with the tolerance `SKETCHED`. Leads and inner vias are not drawn;
    `Coil.undrawn` holds the estimated lengths of the missing leads. All windings have the origin as centre, because the
    coils differ only in their positions. If `wider` is 0, the board has the smallest sufficient width. Otherwise it is
    wider by this number of steps, and its leads have their widest spacing.
    """
    if spec.coil.copper is not None:
        return replace(drawn_layout(_with_all_coils(spec), spec.coil.copper), spec=spec)
    level = _about_axis(_with_all_coils(spec))
    artwork = level.artwork
    bus = bus_for(artwork, lead_spacings(level.coil.trace_spacing, level.fpc.rules.trace_spacing)[0] if wider else None)
    layers = {(p.own, p.rotation): wind_coil(artwork, replace(p, centre=(0.0, 0.0)), SKETCHED)
              for p in level.array.placements}
    round_it, _ = _goes_on(spec.coil, bus)
    none = tuple(WoundCoil((), (), None, ()) for _ in level.array.placements)
    # a lead round a single coil needs room beside it; lanes past several coils already have it
    breadths = list(dict.fromkeys(breadth for _, breadth in boards(artwork, bus)))
    ground = breadths[: 1 + int(bool(round_it) and len(none) == 1) + wider][-1]
    unplaced = _assemble(level, _unrouted(artwork, bus, none, (), ground))
    pairs, layout = _undrawn(artwork, bus, unplaced.coils, unplaced.body[2]), _placed(unplaced, _with_all_coils(spec))
    coils = tuple(
        replace(coil, windings=layers[coil.placement.own, coil.placement.rotation], undrawn=pair,
                goes_on=_goes_on(coil.placement.own or spec.coil, bus))
        for coil, pair in zip(layout.coils, pairs, strict=True)
    )
    return replace(layout, spec=spec, coils=coils)


def _goes_on(coil: CoilSpec, bus: Bus) -> tuple[float, float]:
    """Return the turns of a sketched coil's lead around the coil, and the lead's distance (m) from the coil's centre.

    The lead runs around the coil, the shorter way, so that both ends of the coil come together.
    """
    turns = -(math.fsum(coil.layer_turns) % 1.0)
    return turns + (turns <= -0.5 + 1e-9), 0.5 * max(coil.size) + bus.ring_offset


FRONTMOST, ROUND, ROUND_FREE = 2e-3, 0.8, 0.3
"""Constants of the estimated lead lengths in a sketch.

The estimates differ by at most 2 mm from the drawn leads of the templates (tests/validation/screen_level.py).

`FRONTMOST` (m) is the lead length of the coil next to the tail, if the coils lie in line. Leads of other coils are
longer than the distance from the coil's middle to the body's end. This excess length, divided by the coil's size along
the board, is `ROUND` for coils in line and `ROUND_FREE` otherwise.
"""

PARTED = 4e-3  # Length (m) at the end of a tail over which both leads run apart to their contacts
"""Length (m) at the tail's end over which the two leads of a pair diverge to their contacts."""


def _undrawn(artwork: ArtworkSpec, bus: Bus, coils: tuple[Coil, ...], body_end: float) -> list[tuple[LeadPair, ...]]:
    """Estimate the leads of each coil: the part beside the coils and the part in the tail.

    The tail begins at x = `body_end` (m).
    """
    tail = body_frame(artwork, bus, front_of(artwork, bus), boards(artwork, bus)[0][1])
    lined = artwork.array.is_in_line
    length, width = max(tail.end - tail.body_end - PARTED, 0.0), tail.lane_width
    down = LeadPair(length, width, bus.layers, width + bus.spacing)
    frontmost = max(p.centre[0] for p in artwork.array.placements)
    pairs: list[tuple[LeadPair, ...]] = []
    for coil in coils:
        is_next = lined and coil.centre.x >= frontmost - 1e-9
        longer = (ROUND if lined else ROUND_FREE) * (coil.placement.own or artwork.coil).size[0]
        beside = FRONTMOST if is_next else body_end - coil.centre.x + longer
        pairs.append((LeadPair(beside, bus.width, bus.layers, bus.pitch), down))
    return pairs


@record
class _Attempt:
    """Result of one attempt to lay out the board with a given gap between leads.

    `wound` holds the coils with their inner vias, and `bus` the widths and gaps of the leads. `routing` is None if the
    leads found no room. `shortfalls` lists the missing room.
    """

    wound: tuple[WoundCoil, ...]
    routing: Routing | None
    bus: Bus
    tail: TailFrame
    body: BodyExtent
    shortfalls: tuple[Shortfall, ...]


def _attempt(artwork: ArtworkSpec, searches: SearchLimit) -> _Attempt:
    """Lay out coils, leads, tail and body with the widest gap between leads for which the board has room.

    If no gap above the fabricator's minimum fits, the minimum is used. The shortfalls then list the missing room.
    """
    windings = wind_all(artwork)
    *wider, least = lead_spacings(artwork.coil.trace_spacing, artwork.fpc.rules.trace_spacing)
    before = searches.left
    for spacing in wider:
        bus = bus_for(artwork, spacing)
        largest = _largest_body(artwork, spacing - least)
        if bus.coils.high - bus.coils.low + 2.0 * artwork.fpc.rules.copper_to_edge > largest[1]:
            continue
        with searches.at_most(WIDE_TRIALS):
            attempt = _spaced(artwork, windings, bus, searches)
        searches.left = before
        size = attempt.body.end - attempt.body.start, attempt.body.high - attempt.body.low
        if not attempt.shortfalls and all(side <= most + SLACK for side, most in zip(size, largest, strict=True)):
            return attempt
    return _spaced(artwork, windings, bus_for(artwork), searches)


WIDE_TRIALS = 1_500
"""Largest number of search trials for each tried gap between leads that exceeds the fabricator's minimum."""

UNSEEN = 0.1
"""Excess of a lead gap over the fabricator's minimum gap, divided by the outline tolerance.

Up to this ratio, the board may be as wide as the jaw. Above it, `ROOMY` limits the board's width.
"""

ROOMY = 0.9
"""Largest board width divided by jaw width, in attempts with lead gaps above the fabricator's minimum (see `UNSEEN`).

A wider board may project beyond the port.
"""


def _largest_body(artwork: ArtworkSpec, wider: float) -> tuple[float, float]:
    """Return the largest permitted length and width (m) of a body. Infinite without a limit.

    `wider` (m) is the excess of the lead gaps over the fabricator's minimum gap.
    """
    length = width = math.inf
    if (jaw := artwork.jaw) is not None:
        room = 1.0 if wider <= UNSEEN * artwork.fpc.rules.outline_tolerance else ROOMY
        length, width = jaw.length - 2.0 * artwork.fpc.rules.outline_tolerance, room * jaw.width
    if artwork.fpc.largest is not None:
        x0, y0, x1, y1 = bounding_box([artwork.fpc.largest.edge])
        length, width = min(length, x1 - x0), min(width, y1 - y0)
    return length, width


def _spaced(artwork: ArtworkSpec, windings: tuple[WoundCoil, ...], bus: Bus, searches: SearchLimit) -> _Attempt:
    """Route the leads with the gaps and layers of `bus`, and lay out tail and body. Shortfalls list missing room."""
    shortfalls = [*windings[0].shortfalls]
    if (last := artwork.array.placements[-1]).own is not None:
        shortfalls += [replace(lack, facts=(*lack.facts, ("own", last.name))) for lack in windings[-1].shortfalls]
    if not artwork.array.is_in_line and not bus.is_stacked:
        # side by side on one layer, pairs are led along the jaw only
        shortfalls.append(Shortfall(Missing.TAIL_LAYERS, facts=(("pattern", artwork.array.pattern),)))
    front = front_of(artwork, bus)
    if (lacking := lack(artwork, body_frame(artwork, bus, front, bus.coils))) is not None:
        shortfalls.append(lacking)
    routing = None
    if not shortfalls:
        routing = (route_in_line if artwork.array.is_in_line else route_freely)(artwork, bus, windings, front, searches)
        if routing is None and artwork.fpc.body is not None and artwork.array.is_in_line and bus.is_stacked:
            # lanes run straight beside the coils, where a given outline may curve in: through a maze they need not
            routing = route_freely(artwork, bus, windings, front, searches)
        if routing is None:  # only trials show the room for leads or outer vias beside or between the coils
            names = tuple(placement.name for placement in artwork.array.placements)
            stuck = names if searches.stuck is None else (names[searches.stuck],)
            shortfalls.append(Shortfall(Missing.LEAD_ROOM, facts=(("coils", stuck),)))
        elif not _tail_is_clear(artwork.fpc.rules, routing):
            shortfalls.append(_no_tail_room(artwork.array.placements, artwork.fpc.rules, routing.tail))
            routing = None
    if routing is not None and isinstance(routing.thermistor, Shortfall):
        shortfalls.append(routing.thermistor)
    if routing is None:
        return _unrouted(artwork, bus, windings, tuple(shortfalls), boards(artwork, bus)[0][1])
    body = body_of(artwork, routing.far, routing.breadth, routing.tail)
    return _Attempt(windings, routing, routing.bus, routing.tail, body, tuple(shortfalls))


def _unrouted(
    artwork: ArtworkSpec, bus: Bus, windings: tuple[WoundCoil, ...], shortfalls: tuple[Shortfall, ...], breadth: Breadth
) -> _Attempt:
    """Return an attempt without leads: tail and body of a board with the y range `breadth`."""
    start = far_end(artwork.array.placements, artwork.coil, artwork.fpc.rules.copper_to_edge, (), ())
    tail = reaching_ahead(artwork, start, body_frame(artwork, bus, front_of(artwork, bus), breadth))
    return _Attempt(windings, None, bus, tail, body_of(artwork, start, breadth, tail), shortfalls)


def _tail_is_clear(rules: DesignRules, routing: Routing) -> bool:
    """Whether the conductors from the body's end to the contacts keep their clearance to conductors of other coils."""
    board = Obstacles(rules, rules.trace_spacing)
    for run in (run for ends in routing.ends for run in ends):
        tracks = [piece for piece in run.pieces if isinstance(piece, TrackToPlace)]
        holes = [piece for piece in run.pieces if isinstance(piece, ViaToPlace)]
        if not board.admits(tracks, holes):
            return False
        board.add(tracks, holes)
    if isinstance(routing.thermistor, ThermistorRun):
        for number in (0, 1):
            tracks = [track for pad, track in (*routing.thermistor.leads, *routing.thermistor.lanes) if pad == number]
            if not board.admits(tracks, []):
                return False
            board.add(tracks, [])
    return True


def _no_tail_room(placements: tuple[CoilPlacement, ...], rules: DesignRules, tail: TailFrame) -> Shortfall:
    """Return the shortfall for tail tracks that lie too close together at the contacts.

    It compares the contacts' pitch with the sum of track width and track gap. The needed size is None if this sum does
    not exceed the pitch.
    """
    contacts = tail.connector
    needed = rules.trace_width + rules.trace_spacing
    facts = (
        ("coils", len(placements)),
        ("connector", contacts.name),
        ("tail", tail.end - tail.start),
        ("house", rules.name),
    )
    return Shortfall(Missing.TAIL_ROOM, contacts.pitch, needed if needed > contacts.pitch else None, "m", facts=facts)


def _assemble(spec: SensorSpec, attempt: _Attempt) -> Layout:
    """Return the layout of an attempt. If the spec has a tail turn, the tail is bent in the board's plane."""
    bus, windings, routing, tail, body = attempt.bus, attempt.wound, attempt.routing, attempt.tail, attempt.body
    coils: list[Coil] = []
    pads, capacitors = [], []
    for index, (placement, coil) in enumerate(zip(spec.array.placements, windings, strict=True)):
        way = routing.escapes[index] if routing else None
        ends = routing.ends[index] if routing else None
        series = _series(spec.fpc, (placement.own or spec.coil).trace_width, placement.name, coil, way, ends)
        coils.append(Coil(placement, placement.name, coil.windings, series, way is not None))
        pads += [run.pad for run in ends] if ends else []
        if ends and ends[0].chip_pad and ends[1].chip_pad and tail.chip:
            chip_pads = (ends[0].chip_pad, ends[1].chip_pad)
            capacitors.append(Capacitor(chip_pads[0].reference, placement.name, tail.chip.name, chip_pads))
    sensor = _thermistor(routing)
    if sensor is not None and routing is not None and isinstance(routing.thermistor, ThermistorRun):
        pads += routing.thermistor.contacts
    pieces = [piece for coil in coils for piece in coil.series]
    traces = (*(piece for piece in pieces if isinstance(piece, Trace)), *(sensor.traces if sensor else ()))
    vias = tuple(piece for piece in pieces if isinstance(piece, Via))
    contacts = tuple(sorted([*pads, *unused_contacts(tail)] if pads else [], key=lambda pad: pad.number))
    begin = turn_begin(spec.fpc.rules, bus, tail)
    # the tail may bend where its sides are straight, up to the stiffener or its turn, free of vias
    bend_start = tail.start + tail.taper.reach_beyond
    before = tail.stiff_start, begin if tail.turn else math.inf
    bend_end = min(first_via(spec.fpc.rules, tail), *before)
    bends = spec.fpc.tail is not None and spec.fpc.tail.bend != "none" and bend_end > bend_start
    copper = _copper_points(traces, vias, body.start + CORNER_RADIUS)
    straight = Layout(
        spec=spec, coils=tuple(coils), traces=traces, vias=vias, pads=contacts,
        outline=outline(body, tail, copper, spec.fpc.rules.copper_to_edge),
        body=(body.start, body.low, body.end, body.high),
        top_openings=openings(spec.fpc.rules, tail, contacts, (pad for each in capacitors for pad in each.pads),
                              sensor.pads if sensor else ()),
        bottom_openings=(), stiffener=None, bend_zone=(bend_start, bend_end) if bends else None,
        shortfalls=attempt.shortfalls, capacitors=tuple(capacitors), thermistor=sensor,
        tail_length=tail.end - tail.body_end,
    )
    straight = replace(straight, stiffener=stiffener(straight, tail))
    line = course(spec.fpc.tail, tail.half_width, begin)
    if line is None:
        return straight
    if routing is not None:
        return _mapped(straight, line.path, line.place, line.is_across)
    # coils without leads have no copper in the tail; those beyond a body that is too small may stand beside its turn
    unwound = _mapped(replace(straight, coils=()), line.path, line.place, line.is_across)
    return replace(unwound, coils=straight.coils, traces=straight.traces, vias=straight.vias)


def _thermistor(routing: Routing | None) -> SolderedThermistor | None:
    """Return the soldered thermistor with its tracks. None if there is none, or no room for it."""
    if routing is None or routing.tail.thermistor is None or not isinstance(routing.thermistor, ThermistorRun):
        return None
    run, chip = routing.thermistor, routing.tail.thermistor.chip
    nets = [pad.net for pad in run.pads]
    traces = [Trace(track.path, track.width, track.layer, nets[number], role)
              for role, tracks in ((Role.LEAD, run.leads), (Role.TAIL, run.lanes)) for number, track in tracks]
    return SolderedThermistor(run.pads[0].reference, chip.name, run.pads, tuple(traces))


def _copper_points(traces: tuple[Trace, ...], vias: tuple[Via, ...], before: float) -> list[tuple[Point, float]]:
    """Return points on the copper, each with half the width (m) of its track or via pad.

    The points are the vias, the starts of all tracks, and the quarter points of track segments that reach below x =
    `before` (m).
    """
    points = [(via.centre, via.pad / 2) for via in vias]
    for trace in traces:
        points.append((trace.path.start, trace.width / 2))
        for segment in trace.path:
            if least_x(segment) < before:
                points += [(segment.at(fraction), trace.width / 2) for fraction in (0.25, 0.5, 0.75, 1.0)]
    return points


def _series(
    fpc: FpcSpec, width: float, net: str, coil: WoundCoil, way: Escape | None, ends: tuple[Run, Run] | None
) -> tuple[Trace | Via, ...]:
    """Return all tracks and vias of a coil's circuit in the order of the current, from contact A to contact B.

    `width` (m) is the width of the coil's tracks. `way` holds the two leads in the body, and `ends` their continuations
    in the tail. Both are None if the coil has no leads.
    """
    # holes of a tail of fewer layers than the body has end with these
    lowest = fpc.tail_copper if fpc.tail_copper < len(fpc.stackup.copper) else None
    series: list[Trace | Via] = []

    def add(pieces: Sequence[TrackToPlace | ViaToPlace], role: Role, lowest: int | None = None) -> None:
        for piece in pieces:
            if isinstance(piece, ViaToPlace):
                series.append(Via(piece.centre, piece.drill, piece.pad, net, lowest))
            elif piece.path.segments:
                series.append(Trace(piece.path, piece.width, piece.layer, net, role))

    if way and ends:
        add(way.lead_a.pieces, Role.LEAD)
        add((ends[0].neck,), Role.LEAD)
        add(ends[0].lane, Role.TAIL, lowest)
        series = [replace(p, path=p.path.reversed()) if isinstance(p, Trace) else p for p in reversed(series)]
    for index, winding in enumerate(coil.windings):
        series.append(Trace(winding.path, width, winding.layer, net, Role.WINDING))
        if winding.inward and index // 2 < len(coil.inner):
            inner = coil.inner[index // 2]
            stubs = [TrackToPlace(path, width, layer) for layer, path in inner.stubs]
            onward = [TrackToPlace(stub.path.reversed(), width, stub.layer) for stub in stubs[1:]]
            series.append(Trace(stubs[0].path, width, stubs[0].layer, net, Role.STUB))
            series.append(Via(inner.hole.centre, inner.hole.drill, inner.hole.pad, net))
            series += [Trace(stub.path, width, stub.layer, net, Role.STUB) for stub in onward]
        elif not winding.inward and way and index + 1 < len(coil.windings):
            add(way.joins[index // 2].pieces, Role.STUB)
    if way and ends:
        add(way.lead_b.pieces, Role.LEAD)
        add((ends[1].neck,), Role.LEAD)
        add(ends[1].lane, Role.TAIL, lowest)
    return tuple(series)


def _mapped(
    layout: Layout, path: Callable[[Path], Path], place: Callable[[Point], Point], is_across: bool = False
) -> Layout:
    """Return the layout with all pieces moved, except the windings.

    The function `path` moves a path, and `place` a point. If the tail ends at a right angle to its beginning,
    `is_across` is True: length and width of the moved contacts are then exchanged.
    """

    def piece(item: Trace | Via) -> Trace | Via:
        if isinstance(item, Trace):
            return replace(item, path=path(item.path))
        return replace(item, centre=place(item.centre))

    def pad(contact: Pad) -> Pad:
        centre, (x, y) = place(contact.centre), contact.size
        size = (y, x) if is_across and centre != contact.centre else contact.size
        return replace(contact, centre=centre, size=size)

    def region(area: Region) -> Region:
        return Region(path(area.outline), tuple(map(path, area.holes)))

    coils = tuple(replace(coil, series=tuple(map(piece, coil.series))) for coil in layout.coils)
    pieces, plate, sensor = [item for coil in coils for item in coil.series], layout.stiffener, layout.thermistor
    if sensor is not None:
        tracks = tuple(replace(trace, path=path(trace.path)) for trace in sensor.traces)
        sensor = replace(sensor, pads=(pad(sensor.pads[0]), pad(sensor.pads[1])), traces=tracks)
        pieces += tracks
    return replace(
        layout, coils=coils, traces=tuple(item for item in pieces if isinstance(item, Trace)), thermistor=sensor,
        vias=tuple(item for item in pieces if isinstance(item, Via)), pads=tuple(map(pad, layout.pads)),
        capacitors=tuple(replace(c, pads=(pad(c.pads[0]), pad(c.pads[1]))) for c in layout.capacitors),
        outline=path(layout.outline), top_openings=tuple(map(region, layout.top_openings)),
        bottom_openings=tuple(map(region, layout.bottom_openings)),
        stiffener=replace(plate, outline=region(plate.outline)) if plate else None,
    )


def _with_all_coils(spec: SensorSpec) -> SensorSpec:
    """Return the spec with the reference coil as the last coil of its array.

    Without a reference coil: the spec itself.
    """
    return spec if spec.array.reference is None else replace(spec, array=spec.artwork.array)


def _about_axis(spec: SensorSpec) -> SensorSpec:
    """Return the spec with the coils shifted across the board, so that their mean y is 0.

    The tail's axis is at y = 0, so the layout does not depend on the spec's origin.
    """
    if not (height := _axis_height(spec.array)):
        return spec
    placements = tuple(replace(p, centre=(p.centre[0], p.centre[1] - height)) for p in spec.array.placements)
    return replace(spec, array=replace(spec.array, placements=placements))


def _axis_height(array: ArraySpec) -> float:
    height = array.middle[1]
    return height if abs(height) > 1e-9 else 0.0  # smaller values are rounding errors of a sum


def _placed(layout: Layout, spec: SensorSpec) -> Layout:
    """Return the layout of `_about_axis(spec)`, moved to the coil positions of the spec."""
    if not (height := _axis_height(spec.array)):
        return layout
    placements = {placement.name: placement for placement in spec.array.placements}
    coils = tuple(
        replace(
            coil,
            placement=placements[coil.name],
            windings=tuple(replace(w, path=w.path.shifted(0.0, height)) for w in coil.windings),
        )
        for coil in layout.coils
    )
    x0, y0, x1, y1 = layout.body
    level = replace(layout, spec=spec, coils=coils, body=(x0, y0 + height, x1, y1 + height))
    return _mapped(level, lambda path: path.shifted(0.0, height), lambda point: point.shifted(0.0, height))
