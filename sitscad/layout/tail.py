"""The tail: from the end of the body to the contacts; the pairs' tracks and vias."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

from sitscad.geometry.path import Path, Point, polyline, rounded
from sitscad.layout.board import Pad
from sitscad.layout.clearance import Hole, Track, hole_keep_out
from sitscad.layout.lanes import STAGGER, Bus, Lane, lane_height
from sitscad.layout.taper import SAME, Taper
from sitscad.layout.turn import turn_length
from sitscad.record import record
from sitscad.spec.sensor import Chip, Connector, SensorSpec

TAIL_TRACE_WIDTH = 0.2e-3
"""Tracks widen to this outside the jaw, for their resistance (m)."""

BARE_LENGTH = 2.0e-3
"""Length of the strip with solder pads where the spec asks for no tail: pads, vias and a little to hold (m)."""

END_GAP = 0.2e-3
"""Between the contacts and the end of the board (m); solder pads keep the fabricator's edge distance."""

CHIP_ROOM = 0.3e-3
"""Between a capacitor's pads and the vias behind and the bends before them (m), at least."""

CHIP_OPENING = 0.05e-3
"""How far the coverlay's opening over a capacitor's pad reaches beyond the pad (m)."""

CORNER_RADIUS = 0.5e-3
"""Corners are rounded: what touches tissue has no sharp edge, and inner corners of a flex tear (m). Inner ones have the
fabricator's radius where that is larger."""

CAP = 0.25e-3
"""Straight copper left between the bends and the vias at the contacts (m)."""


@record
class TailFrame:
    """Where the tail lies (m), before it is turned: its start and end along x, its half width, its connector.

    ``turn`` is how much of its length its turn takes, which lies before the stiffener and before the pairs part.
    ``fan_pitch`` is that of the tracks in the tail, up to the vias: wider than the contacts' where vias or capacitors
    (``chip``) need more; ``outer_contact`` is the height of the outermost contact's middle.
    """

    connector: Connector
    body_end: float
    funnel: float
    start: float
    end: float
    body_half_width: float
    half_width: float
    plug_half_width: float
    outer_contact: float
    inner_radius: float
    end_gap: float
    trace_width: float
    neck_width: float
    fan_pitch: float
    edge: float
    chip: Chip | None = None
    turn: float = 0.0
    outermost: float = 0.0
    """How far from the axis (m) the outermost of the pairs enters the funnel that part in it."""
    covered: float = 0.0
    """How far (m) a via at the contacts keeps from an opening of the coverlay, beyond `CAP`."""
    chip_room: float = CHIP_ROOM
    """Between a capacitor's pads and the vias behind and the bends before them (m)."""

    @property
    def pad_start(self) -> float:
        """Where the contacts begin."""
        return self.end - self.end_gap - self.connector.contact_length

    @property
    def shoulder(self) -> float:
        """How much wider the tail is, on each side, than what is plugged in: room for the outer vias' edge distance."""
        return self.half_width - self.plug_half_width

    @property
    def taper(self) -> Taper:
        """From the body to the tail; where its first corner is the outer one, a lead bends there and keeps its distance
        from the rounding.
        """
        shoulder = self.edge + self.neck_width / 2
        return Taper(self.body_end, self.start, self.body_half_width, self.half_width, self.inner_radius, shoulder)

    @cached_property
    def plug_taper(self) -> Taper:
        """From the tail to what is plugged in, which has its own width from the contacts on."""
        widths = (self.half_width, self.plug_half_width, self.inner_radius, 0.0)
        corners = Taper(0.0, self.shoulder, *widths)
        end = self.pad_start - corners.reach_beyond
        begin = end - corners.length
        return Taper(begin, begin + self.shoulder, *widths)

    @property
    def squeeze(self) -> float:
        """By how much a contact's track is farther from the axis at its via than at the contact, for the first one."""
        return self.outer_contact * (self.fan_pitch / self.connector.pitch - 1.0)

    @property
    def squeeze_start(self) -> float:
        """Where tracks at the vias' pitch begin to draw together, so that all are straight again before the contacts.

        Drawing in at 45 degrees beside the shoulder, the outermost keeps its distance from the edge.
        """
        plug_begin = self.plug_taper.begin + self.shoulder
        beside = math.sqrt(2.0) * (self.edge + self.trace_width / 2) - (self.plug_half_width - self.outer_contact)
        beside += self.pad_start - plug_begin
        return self.pad_start - max(beside, 1.5 * self.connector.contact_width) - self.squeeze

    @property
    def fan_end(self) -> float:
        """Up to where the vias stand; behind them are the capacitors, if any."""
        if self.chip:
            return self.chip_end - self.chip.pad_across - 2.0 * self.chip_room
        return min(self.chip_end, self.pad_start - self.covered)

    @property
    def chip_end(self) -> float:
        """Up to where capacitors may stand, and the tail has its whole width; what stands at its edge keeps its
        distance from the shoulder too.
        """
        shoulder = self.plug_taper.begin
        if self.shoulder > SAME:
            shoulder -= max(0.0, (math.sqrt(2.0) - 1.0) * self.edge - CAP)
        return min(shoulder, self.squeeze_start) if self.squeeze > 1e-9 else shoulder

    @property
    def chip_centre(self) -> float:
        """Where along x the capacitors stand."""
        return (self.fan_end + self.chip_end) / 2

    def strip(self, start: float) -> Path:
        """The closed outline of the tail from `start` to its end, with the shoulders before the contacts."""
        end = [(Point(self.end, -self.plug_half_width), 0.0)]
        lower = [(Point(start, -self.half_width), 0.0), *self.plug_taper.corners(), *end]
        return both_edges(lower)


def both_edges(lower: list[tuple[Point, float]]) -> Path:
    """The closed path whose lower edge has these corners, with their radii (m), and whose upper edge mirrors it."""
    corners = lower + [(Point(point.x, -point.y), radius) for point, radius in reversed(lower)]
    return rounded([point for point, _ in corners], [radius for _, radius in corners])


@record
class Run:
    """One conductor from the funnel to its contact, in that direction: the lead's last track, down to its lane in the
    tail; the tail's own tracks and holes; the contact; a capacitor's pad.
    """

    neck: Track
    lane: tuple[Track | Hole, ...]
    pad: Pad
    chip_pad: Pad | None = None

    @property
    def pieces(self) -> tuple[Track | Hole, ...]:
        """All tracks and holes."""
        return (self.neck, *self.lane)


def connector_of(spec: SensorSpec, solder_pads: Connector) -> Connector:
    """The tail's connector, or plain solder pads at the outline where there is no tail."""
    return spec.fpc.tail.connector if spec.fpc.tail else solder_pads


def frame(spec: SensorSpec, bus: Bus, connector: Connector, front: float, body_half_width: float) -> TailFrame:
    """Lay the tail's outline: `front` is where the coils' leads have come together, from there on lanes run along x."""
    edge = spec.fpc.rules.copper_to_edge
    contacts = 2 * len(spec.array.placements)
    outer_contact, plug = contact_height(connector.pitch, contacts, 1), connector.width(contacts) / 2
    if connector.kind == "pads":  # nothing is plugged in that asks for a width
        plug = max(plug, outer_contact + connector.contact_width / 2 + edge)
    fan = fan_pitch(spec, bus, connector)
    half_width = max(plug, contact_height(fan, contacts, 1) + _to_edge(spec, bus, connector))
    end_gap = max(END_GAP, edge) if connector.kind == "pads" else END_GAP
    slack = STAGGER * (edge + bus.width / 2)
    stagger = STAGGER * (lane_height(bus, (len(spec.array.placements) - 2) // 2, 1) - lane_height(bus, 0))
    narrows = half_width < body_half_width
    body_end = front + slack + max(0.0, stagger) if narrows else front
    funnel = front if narrows else front + slack
    inner, outer = max(CORNER_RADIUS, spec.fpc.rules.inside_radius), edge + bus.width / 2
    taper = Taper(body_end, body_end + abs(body_half_width - half_width), body_half_width, half_width, inner, outer)
    start = body_end + taper.length if narrows else taper.end
    width = _tail_trace_width(spec, bus, connector)
    turn = turn_length(spec.fpc.tail, half_width)
    laid = TailFrame(
        connector, body_end, funnel, start, start, body_half_width, half_width, plug, outer_contact, inner, end_gap,
        width, bus.width, fan, edge, chip_of(spec, bus), turn, 0.0, _covered(spec), _chip_room(spec),
    )  # fmt: skip
    needed = _fan_length(spec, bus, connector) + laid.end - laid.fan_end
    if turn:
        needed = max(needed, connector.stiffener_length) + turn + CAP + taper.reach_beyond
    needed = max(needed, taper.reach_beyond + laid.end - laid.plug_taper.begin)
    length = (
        max(spec.fpc.tail.length, start - body_end + needed)
        if spec.fpc.tail
        else start - body_end + needed + BARE_LENGTH
    )
    return replace(laid, end=body_end + length)


def fan_pitch(spec: SensorSpec, bus: Bus, connector: Connector) -> float:
    """Pitch (m) of the tracks where a via stands beside every other one: the contacts', or what such a row needs."""
    if not bus.is_stacked:
        return connector.pitch
    chip = chip_of(spec, bus)
    return max(connector.pitch, _beside_via(spec, bus) + spec.fpc.rules.trace_width / 2, chip.pitch if chip else 0.0)


def chip_of(spec: SensorSpec, bus: Bus) -> Chip | None:
    """What stands across every pair before its contacts; nothing without a tail, or where pairs lie side by side."""
    return spec.readout.chip if spec.fpc.tail is not None and bus.is_stacked else None


def _covered(spec: SensorSpec) -> float:
    """What a via, with `CAP` behind its pad, still lacks of the distance to an opening of the coverlay (m)."""
    return max(0.0, spec.fpc.rules.coverlay_opening_to_trace - CAP)


def _chip_room(spec: SensorSpec) -> float:
    """Room before and behind capacitors' pads (m): their opening keeps its web and its distance from the vias."""
    return max(CHIP_ROOM, CHIP_OPENING + max(_covered(spec), spec.fpc.rules.coverlay_web))


def _beside_via(spec: SensorSpec, bus: Bus) -> float:
    """From a via's centre to the nearest edge of a track beside it (m)."""
    rules = spec.fpc.rules
    return hole_keep_out(Hole(Point(0, 0), rules.via_pad, rules.via_drill), rules, bus.spacing)


def _to_edge(spec: SensorSpec, bus: Bus, connector: Connector) -> float:
    """From the middle of an outermost track to the tail's edge (m): copper keeps its distance from the edge, and the
    coverlay its web beside a capacitor's opening.
    """
    rules, chip = spec.fpc.rules, chip_of(spec, bus)
    copper = max(_tail_trace_width(spec, bus, connector), rules.via_pad if bus.is_stacked else 0.0)
    if chip is None:
        return copper / 2 + rules.copper_to_edge
    copper = max(copper, chip.pad_along)
    return max(copper / 2 + rules.copper_to_edge, chip.pad_along / 2 + CHIP_OPENING + rules.coverlay_web)


def _tail_trace_width(spec: SensorSpec, bus: Bus, connector: Connector) -> float:
    """As wide as a via beside it allows, at most `TAIL_TRACE_WIDTH`; tracks that draw together run at 45 degrees."""
    fan = fan_pitch(spec, bus, connector)
    widest = min(TAIL_TRACE_WIDTH, 2.0 * (fan - _beside_via(spec, bus)), connector.contact_width)
    if fan > connector.pitch:
        widest = min(widest, fan / math.sqrt(2.0) - bus.spacing, connector.pitch - bus.spacing)
    return max(spec.fpc.rules.trace_width, widest)


def _fan_length(spec: SensorSpec, bus: Bus, connector: Connector) -> float:
    """Length (m) in which a stacked pair parts, changes layer and reaches the contacts, or a flat pair widens."""
    pad, pitch = spec.fpc.rules.via_pad, fan_pitch(spec, bus, connector)
    return pitch + CAP + (pitch / 2 + CAP + pad if bus.is_stacked else 0.0)


def contact_height(pitch: float, contacts: int, number: int) -> float:
    """Height (m) above the axis of a contact, or of its track in the tail, number 1 at the top."""
    return pitch * ((contacts - 1) / 2 - (number - 1))


def pair_height(spec: SensorSpec, tail: TailFrame, lane: Lane) -> float:
    """Height (m) above the axis of the middle between a coil's two contacts, where its stacked pair runs."""
    contacts = 2 * len(spec.array.placements)
    first = contact_height(tail.fan_pitch, contacts, 2 * lane.rank + 1)
    return (first + contact_height(tail.fan_pitch, contacts, 2 * lane.rank + 2)) / 2


def _parting(spec: SensorSpec, bus: Bus, tail: TailFrame) -> float:
    """Where along x the two tracks of a stacked pair part, or a flat pair must have reached its lanes."""
    if not bus.is_stacked:
        return tail.pad_start - CAP
    return tail.fan_end - spec.fpc.rules.via_pad - 2.0 * CAP - tail.fan_pitch / 2


def turn_begin(spec: SensorSpec, bus: Bus, tail: TailFrame) -> float:
    """Where along x the turn begins; on a straight tail, where the pairs must have come down to their lanes."""
    parting = _parting(spec, bus, tail)
    if not tail.turn:
        return parting
    return min(parting, tail.end - tail.connector.stiffener_length) - CAP - tail.turn


def stretched(
    spec: SensorSpec, bus: Bus, tail: TailFrame, lanes: tuple[Lane, ...], entries: list[tuple[Point, Point]]
) -> TailFrame:
    """The tail, made longer where the pairs, entering at these points, would come down to their lanes too late."""
    heights = [abs(pair_height(spec, tail, lane)) for lane in lanes]
    outwards = [abs(e.y) for ends, height in zip(entries, heights, strict=True) for e in ends if abs(e.y) <= height]
    tail = replace(tail, outermost=max(outwards, default=0.0))
    limit = turn_begin(spec, bus, tail)
    late = max(0.0, tail.start + tail.taper.reach_beyond - limit) if tail.turn else 0.0
    for lane, ends in zip(lanes, entries, strict=True):
        for entry in ends:
            _, foot = _descent(bus, tail, entry, pair_height(spec, tail, lane))
            late = max(late, foot.x + tail.fan_pitch / 2 - limit)
    return replace(tail, end=tail.end + late)


def runs(spec: SensorSpec, bus: Bus, tail: TailFrame, lane: Lane, entries: tuple[Point, Point]) -> tuple[Run, Run]:
    """Both conductors (A, B) of one coil from where they enter the funnel to their contacts."""
    contacts = 2 * len(spec.array.placements)
    first = 2 * lane.rank + 1
    heights = (contact_height(tail.fan_pitch, contacts, first), contact_height(tail.fan_pitch, contacts, first + 1))
    if bus.is_stacked:
        middle = (heights[0] + heights[1]) / 2
        return (
            _stacked_run(spec, bus, tail, lane, entries[0], middle, heights[0], first, "A"),
            _stacked_run(spec, bus, tail, lane, entries[1], middle, heights[1], first + 1, "B"),
        )
    upper_is_a = entries[0].y >= entries[1].y
    numbers = (first, first + 1) if upper_is_a else (first + 1, first)
    return (
        _flat_run(spec, bus, tail, lane, entries[0], numbers[0], "A"),
        _flat_run(spec, bus, tail, lane, entries[1], numbers[1], "B"),
    )


def _descent(bus: Bus, tail: TailFrame, entry: Point, height: float) -> tuple[Path, Point]:
    """The neck from the funnel's beginning to where its track may widen on the tail lane.

    Bends are staggered so that neighbours keep their distance, and a track widens only where its neighbour has gone.
    """
    inwards = abs(height) < abs(entry.y)
    behind = abs(entry.y) - lane_height(bus, 0) if inwards else tail.outermost - abs(entry.y)
    bend = Point(tail.funnel + STAGGER * max(0.0, behind), entry.y)
    foot = Point(bend.x + abs(height - entry.y), height)
    widens = foot.shifted(tail.fan_pitch, 0.0)
    return polyline([entry, bend, foot, widens]), widens


def _stacked_run(
    spec: SensorSpec,
    bus: Bus,
    tail: TailFrame,
    lane: Lane,
    entry: Point,
    middle: float,
    height: float,
    number: int,
    end: str,
) -> Run:
    neck, foot = _descent(bus, tail, entry, middle)
    contacts = 2 * len(spec.array.placements)
    pad = _contact(spec, tail, lane, contact_height(tail.connector.pitch, contacts, number), number, end)
    via_x = tail.fan_end - spec.fpc.rules.via_pad / 2 - CAP
    part = Point(_parting(spec, bus, tail), middle)
    joint = Point(part.x + abs(height - middle), height)
    layer = bus.layers[0] if end == "A" else bus.layers[1]
    lead = Track(neck, bus.width, layer)
    chip_pad = _chip_pad(tail, lane, height, end)
    if end == "A":
        pieces = _past_chip(tail, layer, [foot, part, joint], chip_pad, _squeezed(tail, height, pad))
        return Run(lead, tuple(pieces), pad, chip_pad)
    hole = Hole(Point(via_x, height), spec.fpc.rules.via_pad, spec.fpc.rules.via_drill)
    pieces = [
        Track(polyline([foot, part, joint, hole.centre]), tail.trace_width, layer),
        hole,
        *_past_chip(tail, pad.layer, [hole.centre], chip_pad, _squeezed(tail, height, pad)),
    ]
    return Run(lead, tuple(pieces), pad, chip_pad)


def _past_chip(
    tail: TailFrame, layer: int, before: list[Point], pad: Pad | None, after: list[Point]
) -> list[Track | Hole]:
    """A track, broken in the middle of the capacitor's pad that it passes, if there is one."""
    if pad is None:
        return [Track(polyline([*before, *after]), tail.trace_width, layer)]
    ways = ([*before, pad.centre], [pad.centre, *after])
    return [Track(polyline(way), tail.trace_width, layer) for way in ways]


def _chip_pad(tail: TailFrame, lane: Lane, height: float, end: str) -> Pad | None:
    """The capacitor's pad on a track that comes along at a height."""
    if tail.chip is None:
        return None
    reference, number = f"CT{lane.placement.name.removeprefix('C')}", 1 if end == "A" else 2
    size, centre = (tail.chip.pad_across, tail.chip.pad_along), Point(tail.chip_centre, height)
    return Pad(centre, size, 1, lane.placement.name, f"{reference}.{number}", number, reference)


def _squeezed(tail: TailFrame, height: float, pad: Pad) -> list[Point]:
    """The rest of a track that comes along at a height: to its contact, drawn together with the others if need be."""
    aside = abs(height - pad.centre.y)
    if aside < 1e-9:
        return [pad.centre]
    begin = Point(tail.squeeze_start, height)
    return [begin, Point(begin.x + aside, pad.centre.y), pad.centre]


def _flat_run(spec: SensorSpec, bus: Bus, tail: TailFrame, lane: Lane, entry: Point, number: int, end: str) -> Run:
    contacts = 2 * len(spec.array.placements)
    height = contact_height(tail.connector.pitch, contacts, number)
    neck, foot = _descent(bus, tail, entry, height)
    pad = _contact(spec, tail, lane, height, number, end)
    wide = Track(polyline([foot, pad.centre]), tail.trace_width, bus.layers[0])
    return Run(Track(neck, bus.width, bus.layers[0]), (wide,), pad)


def _contact(spec: SensorSpec, tail: TailFrame, lane: Lane, height: float, number: int, end: str) -> Pad:
    size = (tail.connector.contact_length, tail.connector.contact_width)
    centre = Point(tail.pad_start + size[0] / 2, height)
    name = lane.placement.name
    return Pad(centre, size, 1, name, f"{name}.{end}", number)


def first_via(spec: SensorSpec, tail: TailFrame) -> float:
    """Where along x the vias at the contacts begin: up to there the tail may be bent."""
    return tail.fan_end - spec.fpc.rules.via_pad - 2.0 * CAP
