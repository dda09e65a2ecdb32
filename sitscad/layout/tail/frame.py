"""Frame of the tail from the taper at the body's end to the contacts, and the tail's turn in its own plane.

The frame also has the places of vias and bends. The board is laid out straight with the tail's axis at y = 0. Within a
turn only tracks and edges along the tail run. They become concentric arcs: tracks keep their widths and their distances
from each other and from the edge. All beyond the turn is moved rigidly.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise

from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.path import Arc, Line, Path, Point, Segment, rounded_polygon
from sitscad.layout.clearance import hole_keep_out, joined_hole
from sitscad.layout.lanes import STAGGER, Bus, Lane, lane_height
from sitscad.spec.circuit import Chip, Connector, FpcSpec, Tail
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.sensor import ArtworkSpec

SAME = 1e-9  # Half widths that differ by less (m) are equal: there is no corner between them


@record
class Taper:
    """A change of the half width from `near` to `far` (m) along x from `begin` to `end` (m).

    `inner` and `outer` (m) are the radii of the inner and the outer corner. If the slope from `begin` to `end` is too
    steep for both radii, the taper becomes longer at its inner corner. The board then only grows.
    """

    begin: float
    end: float
    near: float
    far: float
    inner: float
    outer: float

    @property
    def narrows(self) -> bool:
        """Whether the far part is narrower than the near part. The far corner is then the inner corner."""
        return self.far < self.near

    @property
    def step(self) -> float:
        """Change (m) of the half width."""
        return abs(self.near - self.far)

    @cached_property
    def angle(self) -> float:
        """Angle (rad) by which the edge turns at both corners.

        The two arcs together must not climb more than the step.
        """
        steepest = math.acos(max(0.0, 1.0 - self.step / (self.inner + self.outer)))
        return min(math.atan2(self.step, self.end - self.begin), steepest)

    @property
    def length(self) -> float:
        """Length (m) along x from corner to corner."""
        return self.step / math.tan(self.angle) if self.step > SAME else 0.0

    @property
    def reach_before(self) -> float:
        """Distance (m) by which the rounding of the first corner reaches back along the near part."""
        return self._cut(self.outer if self.narrows else self.inner)

    @property
    def reach_beyond(self) -> float:
        """Distance (m) by which the rounding of the second corner reaches along the far part."""
        return self._cut(self.inner if self.narrows else self.outer)

    def corners(self) -> list[tuple[Point, float]]:
        """Return the two corners of the lower edge with their radii (m). Empty if the widths are equal."""
        if self.step <= SAME:
            return []
        if self.narrows:
            return [
                (Point(self.begin, -self.near), self.outer),
                (Point(self.begin + self.length, -self.far), self.inner),
            ]
        return [(Point(self.end - self.length, -self.near), self.inner), (Point(self.end, -self.far), self.outer)]

    def _cut(self, radius: float) -> float:
        return radius * math.tan(self.angle / 2) if self.step > SAME else 0.0


TAIL_TRACE_WIDTH = 0.2e-3  # Tracks widen to this outside the jaw, for their resistance (m)

BARE_LENGTH = 2.0e-3
"""Length (m) of the strip with solder pads if the spec has no tail: pads, vias and a little to hold."""

END_GAP = 0.2e-3  # Between the contacts and the end of the board (m); solder pads keep the fabricator's edge distance
CHIP_ROOM = 0.3e-3  # Between a capacitor's pads and the vias behind and the bends before them (m), at least

CORNER_RADIUS = 0.5e-3
"""Radius (m) of rounded corners: no sharp edge touches tissue, and sharp inner corners of a flexible circuit tear.

Inner corners have the fabricator's radius if it is larger.
"""

CAP = 0.25e-3  # Straight copper left between the bends and the vias at the contacts (m)


@record
class Row:
    """The contacts at the tail's end, numbered from 1 at the top.

    `pitch` (m) is their centre distance, and `count` their number. The coils use `used` contacts from number `first`
    on. Unused contacts are divided between both sides, so that the tail stays in line. An odd contact is below.
    """

    pitch: float
    count: int
    used: int

    @property
    def first(self) -> int:
        """Number of the first contact with a coil."""
        return (self.count - self.used) // 2 + 1

    @property
    def offset(self) -> float:
        """Height (m) of the middle of the coils' contacts above the axis: half a pitch if an odd contact is below."""
        return self.pitch * ((self.count - self.used) % 2) / 2

    def height(self, number: int) -> float:
        """Return the height (m) of a contact above the axis. Number 1 is at the top."""
        return contact_height(self.pitch, self.count, number)


@record
class TailFrame:
    """Position of the tail (m) before it is turned: start and end along x, half width, and connector.

    `turn` is the length of its turn, which lies before the stiffener and before the pairs part. Leads arrive with
    `lead_width`. They draw together as necks of `neck_width`, no wider than their lanes permit. Tracks of pairs are
    `lane_width` wide along the tail, and `trace_width` wide from the place where a pair parts. `fan_pitch` is the pitch
    of the tracks in the tail, up to the vias. It exceeds the contacts' pitch if vias or capacitors (`chip`) need more.
    `outer_contact` is the height of a coil's outermost contact above the middle of all contacts.
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
    lane_width: float
    lead_width: float
    neck_width: float
    fan_pitch: float
    edge: float
    row: Row
    finger_lap: float = 0.0
    """Length (m) of plugged-in contacts under the coverlay."""
    chip: Chip | None = None
    chip_opening: float = 0.0
    """Distance (m) by which the coverlay's opening over a capacitor pad reaches beyond the pad."""
    turn: float = 0.0
    wait: float = 0.0
    """Distance (m) from the bend of the innermost lane to the later bend of the outermost.

    The body's end leaves this room.
    """
    covered: float = 0.0
    """Distance (m), beyond `CAP`, of a via at the contacts from an opening of the coverlay."""
    chip_room: float = CHIP_ROOM
    """Distance (m) of a capacitor's pads from the vias behind them and the bends before them."""
    ahead: float = 0.0
    """Distance (m) by which the body reaches beyond the need of coils and leads."""
    waiting: float = 0.0
    """Part of `ahead` (m) along which leads run on before they part to a wider tail."""

    def reaching(self, ahead: float, leads_wait: bool = False) -> TailFrame:
        """Return the tail of a body that reaches farther by `ahead` (m).

        The leads reach their lanes at the old place, or later by `ahead` if `leads_wait`.
        """
        begin, start, end = self.body_end + ahead, self.start + ahead, self.end + ahead
        later = ahead if leads_wait else 0.0
        return replace(self, body_end=begin, start=start, end=end, ahead=self.ahead + ahead,
                       funnel=self.funnel + later, waiting=self.waiting + later)

    @property
    def pad_start(self) -> float:
        """Start (m) of the contacts' copper along x."""
        return self.end - self.end_gap - self.contact_length

    @property
    def contact_length(self) -> float:
        """Length (m) of the contacts' copper: the bare part, and the part under the coverlay."""
        return self.connector.contact_length + self.finger_lap

    @property
    def shoulder(self) -> float:
        """Width (m), on each side, of the tail beyond the plugged part: room for the outer vias' edge distance."""
        return self.half_width - self.plug_half_width

    @property
    def taper(self) -> Taper:
        """Taper from the body to the tail. At an outer first corner a lead bends and keeps clear of the rounding."""
        shoulder = self.edge + self.lead_width / 2
        return Taper(self.body_end, self.start, self.body_half_width, self.half_width, self.inner_radius, shoulder)

    @cached_property
    def plug_taper(self) -> Taper:
        """Taper from the tail to the plugged part, which has its own width from the contacts on."""
        widths = (self.half_width, self.plug_half_width, self.inner_radius, 0.0)
        corners = Taper(0.0, self.shoulder, *widths)
        end = self.pad_start - corners.reach_beyond
        begin = end - corners.length
        return Taper(begin, begin + self.shoulder, *widths)

    @property
    def squeeze(self) -> float:
        """Distance from the axis of the outermost contact's track at its via, less its distance at the contact (m)."""
        return self.outer_contact * (self.fan_pitch / self.connector.pitch - 1.0)

    @property
    def squeeze_start(self) -> float:
        """Position x (m) at which tracks at the vias' pitch begin to draw together.

        All tracks are straight again before the contacts. The outermost draws in at 45 degrees beside the shoulder and
        keeps its distance from the edge.
        """
        plug_begin = self.plug_taper.begin + self.shoulder
        beside = math.sqrt(2.0) * (self.edge + self.trace_width / 2)
        beside -= self.plug_half_width - self.outer_contact - self.row.offset
        beside += self.pad_start - plug_begin
        return self.pad_start - max(beside, 1.5 * self.connector.contact_width) - self.squeeze

    @property
    def fan_end(self) -> float:
        """End (m) of the vias along x. Capacitors, if any, lie behind it."""
        if self.chip:
            return self.chip_end - self.chip.pad_across - 2.0 * self.chip_room
        return min(self.chip_end, self.pad_start - self.covered)

    @property
    def chip_end(self) -> float:
        """End (m) along x of the range for capacitors and of the tail's full width, clear of the shoulder."""
        shoulder = self.plug_taper.begin
        if self.shoulder > SAME:
            shoulder -= max(0.0, (math.sqrt(2.0) - 1.0) * self.edge - CAP)
        return min(shoulder, self.squeeze_start) if self.squeeze > 1e-9 else shoulder

    def strip(self, start: float) -> Path:
        """Return the closed outline of the tail from `start` to its end, with the shoulders before the contacts."""
        end = [(Point(self.end, -self.plug_half_width), 0.0)]
        lower = [(Point(start, -self.half_width), 0.0), *self.plug_taper.corners(), *end]
        corners = lower + [(Point(point.x, -point.y), radius) for point, radius in reversed(lower)]
        return rounded_polygon([point for point, _ in corners], [radius for _, radius in corners])


def frame(artwork: ArtworkSpec, bus: Bus, connector: Connector, front: float, body_half_width: float) -> TailFrame:
    """Lay out the tail.

    `front` is the x (m) at which the coils' leads have come together. Beyond it, lanes run along x.
    """
    rules, tail, chip = artwork.fpc.rules, artwork.fpc.tail, chip_of(artwork.fpc.tail, artwork.chip, bus)
    edge, is_soldered = rules.copper_to_edge, connector.kind == "pads"
    row = contact_row(artwork.array.placements, artwork.fpc.tail, connector)
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
    # necks are as wide as their neighbours in the lanes and the tail's edge allow
    lanes = 2.0 * fan if bus.is_stacked else fan
    beside = half_width - row.offset - edge - (outer_track - (lanes - fan) / 2)
    if artwork.fpc.body is not None:  # it has its own root, and no taper
        body_half_width = half_width
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
        chip_room=max(CHIP_ROOM, opening + max(covered, rules.coverlay_web)),
    )
    # a stacked pair parts, changes layer and reaches the contacts; a flat pair widens
    needed = fan + CAP + (fan / 2 + CAP + rules.via_pad if bus.is_stacked else 0.0) + laid.end - laid.fan_end
    if turn:
        needed = max(needed, connector.stiffener_length) + turn + CAP + taper.reach_beyond
    needed = start - body_end + max(needed, taper.reach_beyond + laid.end - laid.plug_taper.begin)
    return replace(laid, end=body_end + (max(tail.length, needed) if tail else needed + BARE_LENGTH))


def chip_opening(rules: DesignRules, chip: Chip) -> float:
    """Return the distance (m) by which the coverlay's opening reaches beyond a capacitor pad.

    It is the coverlay's registration tolerance, or less if the web between the two pads is narrow.
    """
    between = (chip.pitch - chip.pad_along - rules.coverlay_web) / 2
    return max(0.0, min(rules.coverlay_registration, between))


def contact_row(placements: tuple[CoilPlacement, ...], tail: Tail | None, connector: Connector) -> Row:
    """Return the contacts at the tail's end.

    Their number is the spec's, or the smallest sufficient number in which the connector is made. If the connector has
    no sufficient number, it is the number that the coils need. It is never smaller than this.
    """
    used = 2 * len(placements)
    written = tail.contacts if tail is not None else None
    enough = min((count for count in connector.positions if count >= used), default=used)
    return Row(connector.pitch, max(used, written or enough), used)


def fan_pitch(fpc: FpcSpec, readout_chip: Chip | None, bus: Bus, connector: Connector) -> float:
    """Return the pitch (m) of tracks with a via beside every second track.

    It is the contacts' pitch, or more if such a row needs more.
    """
    if not bus.is_stacked:
        return connector.pitch
    chip, rules = chip_of(fpc.tail, readout_chip, bus), fpc.rules
    return max(connector.pitch, _beside_via(rules) + rules.trace_width / 2, chip.pitch if chip else 0.0)


def _beside_via(rules: DesignRules) -> float:
    """Return the distance (m) from a via's centre to the nearest edge of a track beside it."""
    return hole_keep_out(joined_hole(rules, 0.0), rules, rules.trace_spacing)


def chip_of(tail: Tail | None, chip: Chip | None, bus: Bus) -> Chip | None:
    """Return the capacitor across each pair before its contacts.

    None if there is no tail, or if pairs lie side by side.
    """
    return chip if tail is not None and bus.is_stacked else None


def contact_height(pitch: float, contacts: int, number: int) -> float:
    """Return the height (m) above the axis of a contact, or of its track in the tail. Number 1 is at the top."""
    return pitch * ((contacts - 1) / 2 - (number - 1))


def pair_height(placements: tuple[CoilPlacement, ...], tail: TailFrame, lane: Lane) -> float:
    """Return the height (m) above the axis of the middle between a coil's two contacts, where its stacked pair runs."""
    contacts = 2 * len(placements)
    first = contact_height(tail.fan_pitch, contacts, 2 * lane.rank + 1)
    return tail.row.offset + (first + contact_height(tail.fan_pitch, contacts, 2 * lane.rank + 2)) / 2


def parting(rules: DesignRules, bus: Bus, tail: TailFrame) -> float:
    """Return x (m) at which the two tracks of a stacked pair part, or up to which a flat pair must reach its lanes."""
    if not bus.is_stacked:
        return tail.pad_start - CAP
    return first_via(rules, tail) - tail.fan_pitch / 2


def turn_begin(rules: DesignRules, bus: Bus, tail: TailFrame) -> float:
    """Return x (m) at which the turn begins. On a straight tail: x up to which the pairs must reach their lanes."""
    apart = parting(rules, bus, tail)
    if not tail.turn:
        return apart
    return min(apart, tail.end - tail.connector.stiffener_length) - CAP - tail.turn


def turn_lag(rules: DesignRules, bus: Bus, tail: TailFrame) -> float:
    """Return the length (m) to add to the tail so that its turn begins beyond its root's taper. 0 without a turn."""
    return max(0.0, tail.start + tail.taper.reach_beyond - turn_begin(rules, bus, tail)) if tail.turn else 0.0


def first_via(rules: DesignRules, tail: TailFrame) -> float:
    """Return x (m) at which the vias at the contacts begin. The tail may be bent up to this place."""
    return tail.fan_end - rules.via_pad - 2.0 * CAP


ASKEW = "within a tail's turn everything has to run along the tail"


@record
class FrameStretch:
    """A part of a tail's middle line from `begin` (m along the straight tail).

    It starts at `origin` with a heading (rad from +x). `radius` (m) is positive for an arc to the left and negative for
    an arc to the right. None for a straight part.
    """

    begin: float
    origin: Point
    heading: float
    radius: float | None = None

    @cached_property
    def centre(self) -> Point:
        """Centre of an arc."""
        assert self.radius is not None
        return _shifted_left(self.origin, self.heading, self.radius)

    def place(self, point: Point) -> Point:
        """Map a point of the straight tail to its place on this stretch."""
        length = point.x - self.begin
        if self.radius is None:
            cosine, sine = round(math.cos(self.heading), 15), round(math.sin(self.heading), 15)  # exact along an axis
            return _shifted_left(self.origin.shifted(length * cosine, length * sine), self.heading, point.y)
        return _shifted_left(self.centre, self.heading + length / self.radius, point.y - self.radius)


def _shifted_left(point: Point, heading: float, distance: float) -> Point:
    """Return a point at a distance (m) to the left of another along a heading.

    Exact if the heading is along an axis.
    """
    return point.shifted(-distance * round(math.sin(heading), 15), distance * round(math.cos(heading), 15))


@record
class Course:
    """Successive stretches of a tail's middle line. The board before the first stretch stays in place."""

    stretches: tuple[FrameStretch, ...]

    def place(self, point: Point) -> Point:
        """Map a point of the straight board to its place."""
        return self._at(point.x).place(point)

    def path(self, path: Path) -> Path:
        """Map a path of the straight board. Raises ValueError if it runs obliquely in the turn."""
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
    """Return the length (m) of a tail's turn along the middle line. 0 for a straight tail."""
    return math.fsum(abs(length) for length, _ in _plan(tail, half_width))


def course(tail: Tail | None, half_width: float, begin: float) -> Course | None:
    """Return the course of a tail whose turn begins at `begin` (m). None for a straight tail."""
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
    """Return lengths and middle-line radii (m) of the turn's parts.

    Radii are positive to the left, None if straight.
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
