"""Geometry of the tail: taper at the body's end, vias, bends and contacts, and the tail's turn in its own plane.

The board is first laid out straight, with the tail's axis at y = 0. Within a turn, only tracks and edges parallel to
the axis are permitted. They become concentric arcs, so tracks keep their widths and their distances from each other and
from the edge. Beyond the turn, all pieces are moved rigidly.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise

from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.path import Arc, Line, Path, Point, Segment, rounded_polygon
from sitscad.layout.clearance import hole_keep_out, joined_hole
from sitscad.layout.lanes import STAGGER, Bus, Lane, lane_height
from sitscad.layout.tail.chips import ThermistorRoom, ThermistorSpot, chip_opening, thermistor_room
from sitscad.layout.tail.taper import SAME, Taper
from sitscad.spec.circuit import Chip, Connector, FpcSpec, Tail
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.sensor import ArtworkSpec

TAIL_TRACE_WIDTH = 0.2e-3  # Tracks widen to this outside the jaw, for their resistance (m)
"""Largest width (m) of tracks in the tail outside the jaw. Wide tracks reduce the resistance."""

BARE_LENGTH = 2.0e-3
"""Length (m) of the strip with solder pads that replaces the tail in a spec without a tail.

It has room for the pads, the vias and a part to grip.
"""

END_GAP = 0.2e-3  # Between the contacts and the end of the board (m); solder pads keep the fabricator's edge distance
"""Distance (m) between plug contacts and the end of the board.

Solder pads keep the fabricator's edge distance instead.
"""
CHIP_ROOM = 0.3e-3  # Between a capacitor's pads and the vias behind and the bends before them (m), at least
"""Smallest distance (m) of a capacitor's pads from the vias on one side and the track bends on the other side."""

CORNER_RADIUS = 0.5e-3
"""Radius (m) of rounded corners.

Sharp convex corners hurt tissue, and sharp concave corners of a flexible circuit tear. Concave corners have the
fabricator's smallest radius if it is larger.
"""

CAP = 0.25e-3  # Straight copper left between the bends and the vias at the contacts (m)
"""Length (m) of straight track between the bends and the vias near the contacts."""


@record
class Row:
    """The row of contacts at the tail's end, numbered from 1 at the top.

    `pitch` (m) is the centre distance of neighbours, and `count` the number of contacts. Coils use the contacts `first`
    to `first` + `used` - 1. Unused contacts are divided equally between top and bottom. If their number is odd, the
    extra contact is at the bottom.
    """

    pitch: float
    count: int
    used: int

    @property
    def first(self) -> int:
        """Number of the uppermost contact that a coil uses."""
        return (self.count - self.used) // 2 + 1

    @property
    def offset(self) -> float:
        """Height (m) of the middle of the used contacts above the tail's axis.

        It is half a pitch if the number of unused contacts is odd, because the extra contact is at the bottom.
        Otherwise it is 0.
        """
        return self.pitch * ((self.count - self.used) % 2) / 2

    def height(self, number: int) -> float:
        """Return the height (m) of contact number `number` above the tail's axis. Number 1 is at the top."""
        return contact_height(self.pitch, self.count, number)


@record
class TailFrame:
    """Dimensions of the tail in metres, before it is bent in its plane.

    The axis is y = 0, and x points to the contacts. A height is a y position. The funnel is the area at the body's end
    in which leads change from their heights beside the coils to their heights in the tail. A lane is the straight path
    of a pair of leads along the tail.
    """

    connector: Connector
    body_end: float
    """Position x (m) of the body's end, where the taper to the tail begins."""
    funnel: float
    """Position x (m) at which leads enter the funnel and may begin to change their heights."""
    start: float
    """Position x (m) at which the tail has its full width: the end of the taper."""
    end: float
    """Position x (m) of the tail's free end."""
    body_half_width: float
    """Distance (m) from the axis to the body's edge at the taper."""
    half_width: float
    """Half of the tail's width (m)."""
    plug_half_width: float
    """Half of the width (m) of the part with the contacts, which is plugged into the connector."""
    outer_contact: float
    """Height (m) of the uppermost used contact above the middle of the used contacts."""
    inner_radius: float
    """Radius (m) of concave edge corners."""
    end_gap: float
    """Distance (m) from the contacts' copper to the free end."""
    trace_width: float
    """Width (m) of single tracks, from the place where the two leads of a pair separate up to the contacts."""
    lane_width: float
    """Width (m) of the tracks of pairs along the tail."""
    lead_width: float
    """Width (m) of the leads beside the coils, as they enter the funnel."""
    neck_width: float
    """Width (m) of the tracks in the funnel. The spacing of the lanes limits it."""
    fan_pitch: float
    """Centre distance (m) of tracks in the tail up to the vias at the contacts.

    It exceeds the contacts' pitch if vias or capacitors (`chip`) need more room.
    """
    edge: float
    """Smallest distance (m) of copper from the board's edge."""
    row: Row
    """Contacts at the free end."""
    finger_lap: float = 0.0
    """Length (m) of the part of each plug contact that the coverlay covers."""
    chip: Chip | None = None
    """Capacitor across each pair of leads in the tail. None if there are no capacitors."""
    chip_opening: float = 0.0
    """Distance (m) by which the coverlay's opening over a capacitor pad extends beyond the pad."""
    turn: float = 0.0
    """Length (m) of the tail's turn along the axis.

    It lies before the stiffener and before the leads of pairs separate.
    """
    wait: float = 0.0
    """Distance (m) along x from the bend of the innermost lane to the later bend of the outermost lane in the funnel.

    Tracks that move to the same side bend one after the other. If the tail is narrower than the body, the body is
    longer by this distance.
    """
    covered: float = 0.0
    """Additional distance (m) of vias near the contacts from the opening of the coverlay. It is added to `CAP`."""
    chip_room: float = CHIP_ROOM
    """Distance (m) of a capacitor's pads from the vias on one side and the track bends on the other side."""
    ahead: float = 0.0
    """Length (m) by which the body extends beyond the length that coils and leads need."""
    waiting: float = 0.0
    """Part (m) of `ahead` along which leads run straight on before they move outwards to a wider tail."""
    thermistor: ThermistorRoom | None = None
    """Room of the thermistor on the body or on the stiffener. None if the board carries none."""
    zone: float = 0.0
    """Length (m) of the body for a thermistor. Leads of coils in line run straight along it."""

    def reaching(self, ahead: float, leads_wait: bool = False) -> TailFrame:
        """Return the tail moved by `ahead` (m) along x, for a body that is longer by this length.

        The funnel still begins at the same x, unless `leads_wait` is True: then it moves along with the tail.
        """
        begin, start, end = self.body_end + ahead, self.start + ahead, self.end + ahead
        later = ahead if leads_wait else 0.0
        return replace(self, body_end=begin, start=start, end=end, ahead=self.ahead + ahead,
                       funnel=self.funnel + later, waiting=self.waiting + later)

    @property
    def pad_start(self) -> float:
        """Position x (m) at which the contacts' copper begins."""
        return self.end - self.end_gap - self.contact_length

    @property
    def contact_length(self) -> float:
        """Length (m) of the contacts' copper: the bare part and the part under the coverlay."""
        return self.connector.contact_length + self.finger_lap

    @property
    def thermistor_start(self) -> float:
        """Position x (m) at which the coverlay's openings over a thermistor on the tail begin.

        Without such a thermistor, it is the tail's end.

        Its outer track bends by 45 degrees from the pads' height to its own, before the tail becomes narrower.
        """
        if self.thermistor is None or self.thermistor.spot is not ThermistorSpot.STIFFENER:
            return self.end
        chip, room = self.thermistor.chip, self.thermistor
        end = self.chip_end - max(self.thermistor_shift, (math.sqrt(2.0) - 1.0) * room.to_edge)
        return end - chip.pitch - chip.pad_along - 2.0 * room.opening

    @property
    def thermistor_shift(self) -> float:
        """Distance (m) across the tail from the pads of a thermistor on the tail to the outer one of its two tracks."""
        return 0.0 if self.thermistor is None else max(0.0, self.thermistor.passing - self.fan_pitch)

    @property
    def stiff_start(self) -> float:
        """Position x (m) at which the stiffener begins at the latest: it lies below contacts and thermistor."""
        return min(self.end - self.connector.stiffener_length, self.thermistor_start)

    @property
    def shoulder(self) -> float:
        """Half width (m) of the tail minus half width of its plugged part.

        Vias of the outer tracks need this room to the edge.
        """
        return self.half_width - self.plug_half_width

    @property
    def taper(self) -> Taper:
        """Taper between body and tail.

        Its convex corner radius leaves room for a lead that bends at the body's edge.
        """
        shoulder = self.edge + self.lead_width / 2
        return Taper(self.body_end, self.start, self.body_half_width, self.half_width, self.inner_radius, shoulder)

    @cached_property
    def plug_taper(self) -> Taper:
        """Taper between the tail and its plugged part, which ends where the contacts' copper begins."""
        widths = (self.half_width, self.plug_half_width, self.inner_radius, 0.0)
        corners = Taper(0.0, self.shoulder, *widths)
        end = self.pad_start - corners.reach_beyond
        begin = end - corners.length
        return Taper(begin, begin + self.shoulder, *widths)

    @property
    def squeeze(self) -> float:
        """Height (m) of the outermost track above the axis at its via, minus its height at the contact."""
        return self.outer_contact * (self.fan_pitch / self.connector.pitch - 1.0)

    @property
    def squeeze_start(self) -> float:
        """Position x (m) at which tracks begin to converge from the pitch of the vias to the pitch of the contacts.

        They bend by 45 degrees and are straight again before the contacts. The outermost track keeps its distance from
        the edge of the narrower plugged part.
        """
        plug_begin = self.plug_taper.begin + self.shoulder
        beside = math.sqrt(2.0) * (self.edge + self.trace_width / 2)
        beside -= self.plug_half_width - self.outer_contact - self.row.offset
        beside += self.pad_start - plug_begin
        return self.pad_start - max(beside, 1.5 * self.connector.contact_width) - self.squeeze

    @property
    def fan_end(self) -> float:
        """Position x (m) at which the range for vias ends. Capacitors, if any, lie between it and `chip_end`."""
        if self.chip:
            return self.chip_end - self.chip.pad_across - 2.0 * self.chip_room
        return min(self.chip_end, self.pad_start - self.covered)

    @property
    def chip_end(self) -> float:
        """Position x (m) at which the range for capacitors and the tail's full width end."""
        shoulder = self.plug_taper.begin
        if self.shoulder > SAME:
            shoulder -= max(0.0, (math.sqrt(2.0) - 1.0) * self.edge - CAP)
        return min(shoulder, self.squeeze_start) if self.squeeze > 1e-9 else shoulder

    def strip(self, start: float) -> Path:
        """Return the closed outline of the tail from x = `start` (m) to its end, with the taper to the plugged part."""
        end = [(Point(self.end, -self.plug_half_width), 0.0)]
        lower = [(Point(start, -self.half_width), 0.0), *self.plug_taper.corners(), *end]
        corners = lower + [(Point(point.x, -point.y), radius) for point, radius in reversed(lower)]
        return rounded_polygon([point for point, _ in corners], [radius for _, radius in corners])


def frame(artwork: ArtworkSpec, bus: Bus, connector: Connector, front: float, body_half_width: float) -> TailFrame:
    """Return the dimensions of the tail.

    `front` is the x (m) from which all leads run parallel to the axis, each at its own height.
    """
    rules, tail, chip = artwork.fpc.rules, artwork.fpc.tail, chip_of(artwork.fpc.tail, artwork.chip, bus)
    edge, is_soldered = rules.copper_to_edge, connector.kind == "pads"
    row = contact_row(artwork.wires, artwork.fpc.tail, connector)
    fan = fan_pitch(artwork.fpc, artwork.chip, bus, connector)
    outer_contact, plug = contact_height(connector.pitch, row.used, 1), connector.width(row.count) / 2
    if is_soldered:  # nothing is plugged in that asks for a width
        plug = max(plug, outer_contact + connector.contact_width / 2 + edge)
    # tracks are as wide as a via beside them allows; those that draw together run at 45 degrees
    width = min(TAIL_TRACE_WIDTH, 2.0 * (fan - _beside_via(rules)), connector.contact_width)
    if fan > connector.pitch:
        width = min(width, fan / math.sqrt(2.0) - rules.trace_spacing, connector.pitch - rules.trace_spacing)
    width = max(rules.trace_width, width)
    # copper keeps its distance from the edge, and the coverlay its web beside a capacitor's opening
    opening = chip_opening(rules, chip) if chip else 0.0
    copper = max(width, rules.via_pad if bus.is_stacked else 0.0, chip.pad_along if chip else 0.0)
    to_edge = max(copper / 2 + edge, chip.pad_along / 2 + opening + rules.coverlay_web if chip else 0.0)
    outer_track = contact_height(fan, row.used, 1)
    half_width = max(plug, outer_track + row.offset + to_edge)
    room = thermistor_room(artwork, bus, width)
    if room is not None and room.is_lowest:
        pads = outer_track - fan - row.offset + max(fan, room.passing)
        half_width = max(half_width, pads + room.chip.pad_across / 2 + room.to_edge)
    # necks are as wide as their neighbours in the lanes and the tail's edge allow
    lanes = 2.0 * fan if bus.is_stacked else fan
    beside = half_width - row.offset - edge - (outer_track - (lanes - fan) / 2)
    if artwork.fpc.body is not None:  # it has its own root, and no taper
        body_half_width = half_width
    zone = room.length if room is not None and room.spot is not ThermistorSpot.STIFFENER else 0.0
    front += zone
    narrows = half_width < body_half_width
    slack = STAGGER * (edge + bus.width / 2)
    wait = max(0.0, STAGGER * (lane_height(bus, (len(artwork.array.placements) - 2) // 2, 1) - lane_height(bus, 0)))
    body_end = front + slack + wait if narrows else front
    inner, outer = max(CORNER_RADIUS, rules.inside_radius), edge + bus.width / 2
    taper = Taper(body_end, body_end + abs(body_half_width - half_width), body_half_width, half_width, inner, outer)
    start = body_end + taper.length if narrows else taper.end
    covered = max(0.0, rules.coverlay_opening_to_trace - CAP)  # what a via lacks with `CAP` behind its pad
    turn = turn_length(tail, half_width)
    laid = TailFrame(
        connector=connector, body_end=body_end, funnel=front if narrows else front + slack, start=start, end=start,
        body_half_width=body_half_width, half_width=half_width, plug_half_width=plug, outer_contact=outer_contact,
        inner_radius=inner, end_gap=max(END_GAP, edge) if is_soldered else END_GAP, trace_width=width,
        lane_width=max(width, min(TAIL_TRACE_WIDTH, lanes - rules.trace_spacing, 2.0 * beside)), lead_width=bus.width,
        neck_width=min(bus.width, max(rules.trace_width, min(lanes - bus.spacing, 2.0 * beside))), fan_pitch=fan,
        edge=edge, row=row, finger_lap=0.0 if is_soldered else rules.finger_lap + rules.coverlay_registration,
        chip=chip, chip_opening=opening,
        turn=turn, wait=wait, covered=covered if is_soldered else max(0.0, covered - rules.finger_lap),
        chip_room=max(CHIP_ROOM, opening + max(covered, rules.coverlay_web)), thermistor=room, zone=zone,
    )
    # a stacked pair parts, changes layer and reaches the contacts; a flat pair widens
    needed = fan + CAP + (fan / 2 + CAP + rules.via_pad if bus.is_stacked else 0.0) + laid.end - laid.fan_end
    needed = max(needed, laid.end - laid.thermistor_start + CAP)
    if turn:
        needed = max(needed, laid.end - laid.stiff_start) + turn + CAP + taper.reach_beyond
    needed = start - body_end + max(needed, taper.reach_beyond + laid.end - laid.plug_taper.begin)
    return replace(laid, end=body_end + (max(tail.length, needed) if tail else needed + BARE_LENGTH))


def contact_row(used: int, tail: Tail | None, connector: Connector) -> Row:
    """Return the row of contacts at the tail's end. Coils and thermistor use `used` contacts.

    The number of contacts is the number in the spec. If the spec states none, it is the smallest number of contacts
    that the connector offers and that is sufficient. It is never smaller than the number of used contacts.
    """
    written = tail.contacts if tail is not None else None
    enough = min((count for count in connector.positions if count >= used), default=used)
    return Row(connector.pitch, max(used, written or enough), used)


def fan_pitch(fpc: FpcSpec, readout_chip: Chip | None, bus: Bus, connector: Connector) -> float:
    """Return the centre distance (m) of neighbouring tracks in the tail.

    Every second track has a via beside its neighbour. The distance is the contacts' pitch, or more if vias or
    capacitors need more room.
    """
    if not bus.is_stacked:
        return connector.pitch
    chip, rules = chip_of(fpc.tail, readout_chip, bus), fpc.rules
    return max(connector.pitch, _beside_via(rules) + rules.trace_width / 2, chip.pitch if chip else 0.0)


def _beside_via(rules: DesignRules) -> float:
    """Return the smallest distance (m) from a via's centre to the near edge of a neighboulead ring."""
    return hole_keep_out(joined_hole(rules, 0.0), rules, rules.trace_spacing)


def chip_of(tail: Tail | None, chip: Chip | None, bus: Bus) -> Chip | None:
    """Return the capacitor that is soldered across each pair of leads before the contacts.

    None if there is no tail, or if the leads of a pair lie side by side on one layer.
    """
    return chip if tail is not None and bus.is_stacked else None


def contact_height(pitch: float, contacts: int, number: int) -> float:
    """Return the height (m) of contact number `number`, or of its track in the tail, above the axis.

    Number 1 is at the top.
    """
    return pitch * ((contacts - 1) / 2 - (number - 1))


def track_height(tail: TailFrame, number: int) -> float:
    """Return the height (m) above the axis of used track number `number` in the tail. Number 1 is at the top."""
    return tail.row.offset + contact_height(tail.fan_pitch, tail.row.used, number)


def pair_height(tail: TailFrame, lane: Lane) -> float:
    """Return the height (m) above the axis of a stacked pair of leads: the middle between the coil's two contacts."""
    return (track_height(tail, 2 * lane.rank + 1) + track_height(tail, 2 * lane.rank + 2)) / 2


def parting(rules: DesignRules, bus: Bus, tail: TailFrame) -> float:
    """Return x (m) at which the two leads of a stacked pair separate.

    Pairs that run side by side must have reached their lanes before this x.
    """
    if not bus.is_stacked:
        return tail.pad_start - CAP
    return first_via(rules, tail) - tail.fan_pitch / 2


def turn_begin(rules: DesignRules, bus: Bus, tail: TailFrame) -> float:
    """Return x (m) at which the tail's turn begins. Leads must have reached their lanes before this x.

    For a straight tail, this is the x at which the leads of pairs separate.
    """
    apart = parting(rules, bus, tail)
    if not tail.turn:
        return apart
    return min(apart, tail.stiff_start) - CAP - tail.turn


def turn_lag(rules: DesignRules, bus: Bus, tail: TailFrame) -> float:
    """Return the length (m) by which the tail must become longer for its turn to begin beyond the taper at the body.

    0 if the tail has no turn.
    """
    return max(0.0, tail.start + tail.taper.reach_beyond - turn_begin(rules, bus, tail)) if tail.turn else 0.0


def first_via(rules: DesignRules, tail: TailFrame) -> float:
    """Return x (m) at which the range for vias near the contacts begins. The tail must not be bent beyond this x."""
    return tail.fan_end - rules.via_pad - 2.0 * CAP


ASKEW = "within a tail's turn everything has to run along the tail"


@record
class FrameStretch:
    """A straight part or an arc of a bent tail's axis. It begins at x = `begin` (m) of the straight tail.

    `origin` and `heading` (rad from +x) are its start point and direction on the bent board. `radius` (m) is positive
    for an arc to the left, negative for an arc to the right, and None for a straight part.
    """

    begin: float
    origin: Point
    heading: float
    radius: float | None = None

    @cached_property
    def centre(self) -> Point:
        """Centre of the arc. Only arcs have a centre."""
        assert self.radius is not None
        return _shifted_left(self.origin, self.heading, self.radius)

    def place(self, point: Point) -> Point:
        """Return the position on the bent board of a point of the straight tail."""
        length = point.x - self.begin
        if self.radius is None:
            cosine, sine = round(math.cos(self.heading), 15), round(math.sin(self.heading), 15)  # exact along an axis
            return _shifted_left(self.origin.shifted(length * cosine, length * sine), self.heading, point.y)
        return _shifted_left(self.centre, self.heading + length / self.radius, point.y - self.radius)


def _shifted_left(point: Point, heading: float, distance: float) -> Point:
    """Return the point at `distance` (m) to the left of `point`, as seen along `heading` (rad).

    The result is exact if the heading is along the x or y axis.
    """
    return point.shifted(-distance * round(math.sin(heading), 15), distance * round(math.cos(heading), 15))


@record
class Course:
    """Axis of a bent tail as successive parts. The board before the first part stays in place."""

    stretches: tuple[FrameStretch, ...]

    def place(self, point: Point) -> Point:
        """Return the position on the bent board of a point of the straight board."""
        return self._at(point.x).place(point)

    def path(self, path: Path) -> Path:
        """Return a path on the bent board. Raise ValueError if the path is not parallel to the axis within an arc."""
        laid: list[Segment] = []
        for segment in path:
            low, _, high, _ = segment.box
            cuts = [s.begin for s in self.stretches if low + 1e-12 < s.begin < high - 1e-12]
            if isinstance(segment, Arc) or not cuts:
                laid.append(_moved(segment, self._at((low + high) / 2)))
                continue
            y = segment.start.y
            if abs(segment.end.y - y) > 1e-9:
                raise ValueError(ASKEW)
            ends = [low, *cuts, high] if segment.end.x > segment.start.x else [high, *reversed(cuts), low]
            laid += [_moved(Line(Point(a, y), Point(b, y)), self._at((a + b) / 2)) for a, b in pairwise(ends)]
        return Path(tuple(laid))

    @property
    def is_across(self) -> bool:
        """Whether the tail ends at a right angle to its initial direction."""
        return abs(math.sin(self.stretches[-1].heading)) > 0.5

    def _at(self, x: float) -> FrameStretch:
        return next((s for s in reversed(self.stretches) if x >= s.begin), self.stretches[0])


def _moved(segment: Segment, stretch: FrameStretch) -> Segment:
    start, end = stretch.place(segment.start), stretch.place(segment.end)
    if isinstance(segment, Arc):
        if stretch.radius is not None:
            raise ValueError(ASKEW)
        return Arc(start, end, stretch.place(segment.centre), segment.ccw)
    if stretch.radius is None or start.distance(end) < 1e-12:
        return Line(start, end)
    if abs(segment.end.y - segment.start.y) > 1e-9:
        raise ValueError(ASKEW)
    return Arc(start, end, stretch.centre, ccw=(stretch.radius > 0.0) == (segment.end.x > segment.start.x))


def turn_length(tail: Tail | None, half_width: float) -> float:
    """Return the length (m) of a tail's turn along the axis. 0 for a straight tail."""
    return math.fsum(abs(length) for length, _ in _plan(tail, half_width))


def course(tail: Tail | None, half_width: float, begin: float) -> Course | None:
    """Return the bent axis of a tail whose turn begins at x = `begin` (m). None for a straight tail."""
    plan = _plan(tail, half_width)
    if not plan:
        return None
    here = FrameStretch(-math.inf, Point(0.0, 0.0), 0.0)
    at, origin, heading = begin, Point(begin, 0.0), 0.0
    stretches = [replace(here, begin=begin - 1.0, origin=Point(begin - 1.0, 0.0))]
    for length, radius in [*plan, (0.0, None)]:
        stretches.append(FrameStretch(at, origin, heading, radius))
        at += length
        origin = stretches[-1].place(Point(at, 0.0))
        heading += length / radius if radius is not None else 0.0
    return Course(tuple(stretches))


def _plan(tail: Tail | None, half_width: float) -> list[tuple[float, float | None]]:
    """Return the parts of a tail's turn: (length along the axis, radius of the axis), in metres.

    Empty for a straight tail.

    Radii are positive for arcs to the left, negative for arcs to the right, and None for straight parts.
    """
    if tail is None:
        return []
    radius = tail.turn_radius + half_width
    if tail.turn != "none":
        side = 1.0 if tail.turn == "left" else -1.0
        return [(0.5 * math.pi * radius, side * radius)]
    if not tail.offset:
        return []
    side, offset = math.copysign(1.0, tail.offset), abs(tail.offset)
    angle = math.acos(max(0.0, 1.0 - offset / (2.0 * radius)))
    straight = offset - 2.0 * radius
    middle: list[tuple[float, float | None]] = [(straight, None)] if straight > 1e-12 else []
    return [(angle * radius, side * radius), *middle, (angle * radius, -side * radius)]
