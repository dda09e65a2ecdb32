"""Place, pads and tracks of a thermistor that is soldered to the body or to the tail above its stiffener.

Its two pads lie behind each other along the tail's axis, and both tracks run on the top layer. On a body with coils in
line, the thermistor lies in the largest gap between leads, or between leads and edge. On another body, it lies below
all leads (at smaller y). On the tail, it also lies below all leads.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.basics.finding import Missing, Shortfall
from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.path import Point, polyline
from sitscad.layout.board import Pad
from sitscad.layout.clearance import Breadth, Obstacles, TrackToPlace
from sitscad.layout.lanes import Bus, Lane
from sitscad.layout.tail.chips import ThermistorSpot
from sitscad.layout.tail.frame import TailFrame, track_height
from sitscad.layout.tail.tracks import Descent, Ends, bare_contact, descents, down_to_contact

THERMISTOR = "TH1"
"""Reference of the thermistor on the board. Its nets are this name with A and B, for its pads 1 and 2."""

CHAMFER = 0.2e-3
"""Largest length (m) by which the passing track's corner is cut off on each side."""


@record
class ThermistorPlace:
    """Place of a thermistor across the board, and its rank in the tail. Heights are y positions (m).

    `rank` is the position of its pair of tracks in the tail, counted from the top. `passing` is the height of the track
    that passes the pad next to the tail, and `pads` the height of both pads.
    """

    rank: int
    passing: float
    pads: float

    @property
    def side(self) -> int:
        """Side of the passing track on which the pads lie: +1 above, -1 below."""
        return 1 if self.pads > self.passing else -1

    @property
    def numbers(self) -> tuple[int, int]:
        """Contact positions of the passing track and of the other track, among the used contacts from 1 at the top."""
        upper = 2 * self.rank + 1
        return (upper, upper + 1) if self.side < 0 else (upper + 1, upper)

    def beside(self, lanes: tuple[Lane, ...]) -> tuple[Lane, ...]:
        """Return the lanes of the coils. Lanes below the thermistor have a rank that is higher by 1."""
        return tuple(replace(lane, rank=lane.rank + (lane.rank >= self.rank)) for lane in lanes)

    def corner(self, pad: Point) -> tuple[Point, ...]:
        """Return the passing track from the middle of its pad to its first point beside the other pad."""
        cut = min(CHAMFER, abs(self.pads - self.passing) / 2)
        return pad, Point(pad.x, self.passing + self.side * cut), Point(pad.x + cut, self.passing)


def lowest_place(tail: TailFrame) -> ThermistorPlace | None:
    """Return the place below all leads in the tail. None if the board carries no thermistor."""
    if tail.thermistor is None:
        return None
    passing = track_height(tail, tail.row.used - 1)
    return ThermistorPlace(tail.row.used // 2 - 1, passing, passing - max(tail.fan_pitch, tail.thermistor.passing))


def widest_gap(tail: TailFrame, bus: Bus, entries: Sequence[Ends], body: Breadth) -> ThermistorPlace | Shortfall | None:
    """Return the place in the middle of the largest gap between leads, or between leads and edge, for coils in line.

    `entries` are the points at which the leads of each coil leave the area of the coils, and `body` is the body's y
    range. If no gap has room, return the shortfall. None if the board carries no thermistor.
    """
    if (room := tail.thermistor) is None:
        return None
    pairs = sorted(((min(a.y, b.y), max(a.y, b.y)) for a, b in entries), reverse=True)
    tops = [body.high, *(low - bus.width / 2 for low, _ in pairs)]
    bottoms = [*(high + bus.width / 2 for _, high in pairs), body.low]
    needs = [room.across(bounds_lead=0 < rank < len(pairs)) for rank in range(len(tops))]
    rank = max(range(len(tops)), key=lambda k: round(tops[k] - bottoms[k] - needs[k], 9))
    slack = tops[rank] - bottoms[rank] - needs[rank]
    if slack < -1e-9:
        facts = (("part", room.chip.name),)
        return Shortfall(Missing.THERMISTOR_ROOM, tops[rank] - bottoms[rank], needs[rank], "m", facts=facts)
    # the passing track lies on the side of a lead, and the pads beyond it
    inner, side = (tops[rank], -1) if rank else (bottoms[rank], 1)
    passing = inner + side * (slack / 2 + room.gap)
    return ThermistorPlace(rank, passing, passing + side * room.passing)


def place_in_corner(
    tail: TailFrame, obstacles: Obstacles, front: float, low: float, pitch: float
) -> tuple[ThermistorPlace, tuple[Descent, Descent]] | Shortfall:
    """Return a place below all leads of coils that are not in line, and the tracks from there into the tail.

    Places are tried from the height in the tail down to the body's edge at y = `low` (m). `obstacles` are the leads,
    `front` is the x (m) beyond all coils, and `pitch` (m) the least centre distance of the two tracks. The tracks rise
    at 45 degrees beside the taper. If no place is free, return the shortfall.
    """
    room, lowest = tail.thermistor, lowest_place(tail)
    assert room is not None and lowest is not None
    heights = [track_height(tail, number) for number in lowest.numbers]
    half, spacing = room.chip.pad_along / 2, room.gap - tail.trace_width / 2
    beside = math.sqrt(2.0) * (tail.edge + tail.trace_width / 2)
    limit = tail.start + min(0.0, heights[1] + tail.half_width - beside)
    bottom = low + room.to_edge + room.chip.pad_across / 2 + room.passing
    for step in range(max(0, int((lowest.passing - bottom) / STEP) + 1)):
        passing = lowest.passing - step * STEP
        place = ThermistorPlace(lowest.rank, passing, passing - room.passing)
        first, second = pad_centres(tail, place, front)
        corner = place.corner(first)
        bend = limit - (heights[1] - second.y) - max(0.0, math.sqrt(2.0) * pitch - room.passing)
        if bend < second.x + half:
            break
        down = descents(bend, (corner[-1], second), heights, pitch)
        ends = [first.shifted(-half, 0.0), second.shifted(half, 0.0)]
        pads = TrackToPlace(polyline(ends), room.chip.pad_across + 2.0 * (room.clearance - spacing), 1)
        if obstacles.admits([pads, *(TrackToPlace(way.neck(0.0), tail.trace_width, 1) for way in down)]):
            return place, (down[0], down[1])
    return Shortfall(Missing.THERMISTOR_ROOM, facts=(("part", room.chip.name),))


STEP = 0.1e-3
"""Distance (m) between the places that are tried for a thermistor, across the board."""


@record
class ThermistorRun:
    """The thermistor's copper: its two pads, its two contacts, and its tracks as (number of the pad, track)."""

    pads: tuple[Pad, Pad]
    contacts: tuple[Pad, Pad]
    leads: tuple[tuple[int, TrackToPlace], ...]
    lanes: tuple[tuple[int, TrackToPlace], ...]


def pad_centres(tail: TailFrame, place: ThermistorPlace, begin: float) -> tuple[Point, Point]:
    """Return the centres of the pads. `begin` (m) is the x at which leads leave the coils."""
    room = tail.thermistor
    assert room is not None
    is_on_tail = room.spot is ThermistorSpot.STIFFENER
    start = tail.thermistor_start + room.opening if is_on_tail else begin + room.clearance
    first = Point(start + room.chip.pad_along / 2, place.pads)
    return first, first.shifted(room.chip.pitch, 0.0)


def thermistor_entries(tail: TailFrame, place: ThermistorPlace, begin: float) -> Ends | tuple[()]:
    """Return the points at which both tracks run towards the funnel. Empty for a thermistor on the tail."""
    if tail.thermistor is None or tail.thermistor.spot is ThermistorSpot.STIFFENER:
        return ()
    first, second = pad_centres(tail, place, begin)
    return place.corner(first)[-1], second


def thermistor_run(
    tail: TailFrame, place: ThermistorPlace, begin: float, down: tuple[Descent, Descent] | None
) -> ThermistorRun:
    """Return pads, tracks and contacts of the thermistor.

    `down` are its tracks in the funnel; None for a thermistor on the tail. `begin` is as in `pad_centres`.
    """
    room, centres = tail.thermistor, pad_centres(tail, place, begin)
    assert room is not None
    size, neck_width = (room.chip.pad_along, room.chip.pad_across), min(tail.neck_width, tail.trace_width)
    pads, contacts = [], []
    leads, lanes = list[tuple[int, TrackToPlace]](), list[tuple[int, TrackToPlace]]()
    for k, (centre, number) in enumerate(zip(centres, place.numbers, strict=True)):
        net, height = f"{THERMISTOR}{'AB'[k]}", track_height(tail, number)
        pads.append(Pad(centre, size, 1, net, f"{THERMISTOR}.{k + 1}", k + 1, THERMISTOR))
        contact = replace(bare_contact(tail, tail.row.first - 1 + number), net=net, pin=f"{THERMISTOR}.{'AB'[k]}")
        contacts.append(contact)
        head = place.corner(centre) if k == 0 else (centre,)
        if down is not None:
            if k == 0:
                leads.append((k, TrackToPlace(polyline(head), neck_width, 1)))
            leads.append((k, TrackToPlace(down[k].neck(tail.fan_pitch), neck_width, 1)))
            head = (down[k].foot.shifted(tail.fan_pitch, 0.0),)
        elif k == 1 and (climb := abs(height - centre.y)) > 1e-9:
            bend = centre.shifted(size[0] / 2 + room.opening, 0.0)
            head = (centre, bend, Point(bend.x + climb, height))
        way = polyline([*head, *down_to_contact(tail, height, contact)])
        lanes.append((k, TrackToPlace(way, tail.trace_width, 1)))
    return ThermistorRun((pads[0], pads[1]), (contacts[0], contacts[1]), tuple(leads), tuple(lanes))
