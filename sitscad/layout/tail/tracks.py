"""Tracks in the tail, and the table of contacts.

Each pair of leads runs through the funnel to its lane and then separates to its two contacts.

The funnel is the area at the body's end in which tracks change from their heights beside the coils to their lanes in
the tail. Each track bends by 45 degrees, and bends back at the height of its lane. Tracks never cross: their order
across the tail is the order of their lanes. Two tracks can therefore come too close only if both move to the same side.
The second track then bends later.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Path, Point, polyline
from sitscad.layout.board import Layout, Pad
from sitscad.layout.clearance import TrackToPlace, ViaToPlace
from sitscad.layout.lanes import STAGGER, Bus, Lane
from sitscad.layout.tail.frame import CAP, TailFrame, pair_height, parting, track_height, turn_begin, turn_lag
from sitscad.spec.circuit import FpcSpec
from sitscad.spec.design_rules import DesignRules

SAME = 1e-9  # Heights that differ by less (m) are equal


@record
class Descent:
    """A track in the funnel, which runs along x, then at 45 degrees, then along its lane.

    `entry` is its start, `bend` the x (m) of its first bend, and `height` (m) the y of its lane.
    """

    entry: Point
    height: float
    bend: float

    @property
    def climb(self) -> float:
        """Height (m) of the lane above the entry point. Negative for a lower lane."""
        return self.height - self.entry.y

    @property
    def parts(self) -> bool:
        """Whether the distance of the track from the axis increases or stays equal in the funnel."""
        return abs(self.height) >= abs(self.entry.y)

    @property
    def foot(self) -> Point:
        """Second bend of the track, at the beginning of its lane."""
        return Point(self.bend + abs(self.climb), self.height)

    def neck(self, length: float) -> Path:
        """Return the track's centre line: from its start over both bends, and then `length` (m) along its lane."""
        bend = Point(self.bend, self.entry.y)
        return polyline([self.entry, bend, self.foot, self.foot.shifted(length, 0.0)])


def descents(funnel: float, entries: Sequence[Point], heights: Sequence[float], pitch: float) -> list[Descent]:
    """Return the tracks of one layer from x = `funnel` (m) to lanes at the given heights (m).

    `entries` are the start points of the tracks, and `pitch` (m) is the smallest centre distance of two tracks. Tracks
    that move away from the axis bend one after the other, the outermost first. Other tracks bend immediately, or later
    if their neighbour moves to the same side.
    """
    tracks = [Descent(entry, height, funnel) for entry, height in zip(entries, heights, strict=True)]
    outermost = max((abs(way.entry.y) for way in tracks if way.parts), default=0.0)
    tracks = [replace(w, bend=funnel + STAGGER * (outermost - abs(w.entry.y))) if w.parts else w for w in tracks]
    for side in (1.0, -1.0):
        going = [i for i, way in enumerate(tracks) if side * way.climb > SAME]
        going.sort(key=lambda i: -side * tracks[i].entry.y)
        for ahead, behind in pairwise(going):
            apart = abs(tracks[ahead].entry.y - tracks[behind].entry.y)
            soonest = tracks[ahead].bend + math.sqrt(2.0) * pitch - apart
            if soonest > tracks[behind].bend + SAME:
                tracks[behind] = replace(tracks[behind], bend=soonest)
    return tracks


Ends = tuple[Point, Point]  # Where a coil's two conductors (A, B) enter the funnel


@record
class Run:
    """A conductor from the beginning of the funnel to its contact.

    `neck` is the track in the funnel. `lane` lists the tracks and vias in the tail, in order. `pad` is the contact, and
    `chip_pad` the pad of a capacitor (None if there are no capacitors).
    """

    neck: TrackToPlace
    lane: tuple[TrackToPlace | ViaToPlace, ...]
    pad: Pad
    chip_pad: Pad | None = None

    @property
    def pieces(self) -> tuple[TrackToPlace | ViaToPlace, ...]:
        """All tracks and vias of the conductor."""
        return (self.neck, *self.lane)


def _numbers(bus: Bus, lane: Lane, entries: Ends) -> tuple[int, int]:
    """Return the contact positions of a coil's ends A and B, among the used contacts from 1 at the top."""
    first = 2 * lane.rank + 1
    return (first, first + 1) if bus.is_stacked or entries[0].y >= entries[1].y else (first + 1, first)


def ways_down(
    bus: Bus, tail: TailFrame, lanes: tuple[Lane, ...], entries: list[Ends], flat_ends: Sequence[Point] = (),
    flat_numbers: Sequence[int] = (),
) -> list[tuple[Descent, Descent]]:
    """Return the tracks in the funnel, one pair (conductors A and B) for each coil. Each track ends in its lane.

    `entries` are the points at which the conductors enter the funnel. `flat_ends` are these points for the thermistor's
    two tracks, and `flat_numbers` the positions of these tracks among the used contacts. If the board has a thermistor,
    its pair is the last.
    """
    flat_heights = [track_height(tail, number) for number in flat_numbers[: len(flat_ends)]]
    if bus.is_stacked:  # both at the pair's middle, above each other on two layers
        middles = [*(pair_height(tail, lane) for lane in lanes), *flat_heights]
        tracks = descents(tail.funnel, [*(a for a, _ in entries), *flat_ends], middles, bus.pitch)
        pairs, flat = [(way, way) for way in tracks[: len(lanes)]], tracks[len(lanes) :]
        return [*pairs, *zip(flat[::2], flat[1::2], strict=True)]
    numbers = [number for lane, ends in zip(lanes, entries, strict=True) for number in _numbers(bus, lane, ends)]
    heights = [*(track_height(tail, number) for number in numbers), *flat_heights]
    points = [*(entry for ends in entries for entry in ends), *flat_ends]
    flat = descents(tail.funnel, points, heights, bus.pitch)
    return list(zip(flat[::2], flat[1::2], strict=True))


def stretched(rules: DesignRules, bus: Bus, tail: TailFrame, pairs: list[tuple[Descent, Descent]]) -> TailFrame:
    """Return the tail, longer if tracks reach their lanes too late, and moved if outer tracks bend too late.

    `pairs` are the tracks in the funnel of each coil's two conductors.
    """
    tracks = [way for pair in pairs for way in pair]
    waited = max((way.bend - tail.funnel for way in tracks if not way.parts), default=0.0) - tail.wait
    if waited > SAME and tail.taper.narrows:
        begin, start, end = tail.body_end + waited, tail.start + waited, tail.end + waited
        tail = replace(tail, body_end=begin, start=start, end=end)
    limit = turn_begin(rules, bus, tail)
    late = max(turn_lag(rules, bus, tail), *(way.foot.x + 1.5 * tail.fan_pitch - limit for way in tracks))
    return replace(tail, end=tail.end + late)


def runs(fpc: FpcSpec, bus: Bus, tail: TailFrame, lane: Lane, pair: tuple[Descent, Descent]) -> tuple[Run, Run]:
    """Return both conductors (A, B) of a coil from the funnel to the contacts."""
    a, b = _numbers(bus, lane, (pair[0].entry, pair[1].entry))
    return _run(fpc, bus, tail, lane, pair[0], a, "A"), _run(fpc, bus, tail, lane, pair[1], b, "B")


def _run(fpc: FpcSpec, bus: Bus, tail: TailFrame, lane: Lane, way: Descent, number: int, end: str) -> Run:
    """Return the conductor of coil end `end` ("A" or "B") from the funnel to its contact.

    `number` is its position among the used contacts. End B of a stacked pair has a via to the contact's layer.
    """
    name, width, rules = lane.placement.name, tail.trace_width, fpc.rules
    layer = bus.layers[0] if end == "A" else bus.layers[1]
    neck = TrackToPlace(way.neck(tail.fan_pitch), tail.neck_width, layer)  # it widens where its neighbour has gone
    pad = replace(bare_contact(tail, tail.row.first - 1 + number), net=name, pin=f"{name}.{end}")
    part = Point(parting(rules, bus, tail), way.height)
    start, pieces = neck.path.end, list[TrackToPlace | ViaToPlace]()
    if tail.lane_width > width + SAME and part.x > start.x + SAME:
        pieces = [TrackToPlace(polyline([start, part]), tail.lane_width, layer)]
        start = part
    if not bus.is_stacked:
        return Run(neck, (*pieces, TrackToPlace(polyline([start, pad.centre]), width, layer)), pad)

    height = track_height(tail, number)
    before = [*dict.fromkeys((start, part)), Point(part.x + abs(height - way.height), height)]
    if end == "B":
        hole = ViaToPlace(Point(tail.fan_end - rules.via_pad / 2 - CAP, height), rules.via_pad, rules.via_drill)
        pieces += [TrackToPlace(polyline([*before, hole.centre]), width, layer), hole]
        before, layer = [hole.centre], pad.layer
    after = down_to_contact(tail, height, pad)
    if tail.chip is None:
        return Run(neck, (*pieces, TrackToPlace(polyline([*before, *after]), width, layer)), pad)
    reference, pin = f"CT{name.removeprefix('C')}", 1 if end == "A" else 2
    size, centre = (tail.chip.pad_across, tail.chip.pad_along), Point((tail.fan_end + tail.chip_end) / 2, height)
    chip_pad = Pad(centre, size, 1, name, f"{reference}.{pin}", pin, reference)
    broken = [TrackToPlace(polyline(points), width, layer) for points in ([*before, centre], [centre, *after])]
    return Run(neck, (*pieces, *broken), pad, chip_pad)


def down_to_contact(tail: TailFrame, height: float, contact: Pad) -> list[Point]:
    """Return the corner points of a track from the tail to the middle of its contact.

    `height` (m) is the track's y in the tail. If tracks are farther apart than contacts, they converge before the
    contacts.
    """
    if (shift := abs(height - contact.centre.y)) < SAME:
        return [contact.centre]
    begin = Point(tail.squeeze_start, height)
    return [begin, Point(begin.x + shift, contact.centre.y), contact.centre]


def unused_contacts(tail: TailFrame) -> tuple[Pad, ...]:
    """Return the contacts that no coil uses. Their copper has no net, but a plug needs all its contacts."""
    used = range(tail.row.first, tail.row.first + tail.row.used)
    return tuple(bare_contact(tail, number) for number in range(1, tail.row.count + 1) if number not in used)


def bare_contact(tail: TailFrame, number: int) -> Pad:
    """Return contact number `number` at the tail's end, without a net. Number 1 is at the top."""
    size = (tail.contact_length, tail.connector.contact_width)
    return Pad(Point(tail.pad_start + size[0] / 2, tail.row.height(number)), size, 1, "", "", number)


CONTROLLER, THERMISTOR_LINES = "controller", ("TEMP", "GND")
"""Part that reads a thermistor, and its lines for the thermistor's two pads: analogue input and ground."""


@record
class Contact:
    """Row of the contact table, for the contact `number` at the tail's end.

    `pin` is ``C1.A`` or ``C1.B`` for the two ends of coil C1. `converter`, `channel` and `converter_pin` are the
    converter's name, and its channel and pin for this contact. For a thermistor, `converter` is `CONTROLLER`, and
    `converter_pin` is one of `THERMISTOR_LINES`.
    """

    number: int
    pin: str
    net: str
    coil: str
    converter: str
    channel: str
    converter_pin: str

    @property
    def cells(self) -> tuple[str, ...]:
        """Texts of all fields, as a row of `contact_rows`."""
        pin = self.converter_pin
        return str(self.number), self.pin, self.net, self.coil, self.converter, self.channel, pin


def contacts(layout: Layout) -> tuple[Contact, ...]:
    """Return the contacts of the tail in the order of their numbers. Empty if no leads are routed."""
    places = layout.spec.readout.device.coil_channels(len(layout.coils))
    labels = layout.labels
    wired = {coil.net: (channel, labels[coil.name]) for channel, coil in zip(places, layout.coils, strict=True)}
    rows = []
    for pad in sorted(layout.pads, key=lambda pad: pad.number):
        if pad.is_unused:
            rows.append(Contact(pad.number, "unused", "-", "-", "-", "-", "-"))
            continue
        if pad.net not in wired:
            line = THERMISTOR_LINES[layout.nets.index(pad.net) - len(layout.coils)]
            rows.append(Contact(pad.number, pad.pin, pad.net, "-", CONTROLLER, "-", line))
            continue
        channel, name = wired[pad.net]
        end = pad.pin.rpartition(".")[2]
        number = str(channel.number)
        rows.append(Contact(pad.number, pad.pin, pad.net, name, channel.converter_text, number, channel.pin(end)))
    return tuple(rows)


def contact_rows(layout: Layout) -> list[tuple[str, ...]]:
    """Return the contact table: a row of column heads, then one row per contact. Empty if there are no contacts."""
    head = "contact", "pin", "net", "coil", layout.spec.readout.device.part, "channel", "its pin"
    rows = [contact.cells for contact in contacts(layout)]
    return [head, *rows] if rows else []
