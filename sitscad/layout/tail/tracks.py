"""The tracks in the tail: every pair down to its lane, along it, apart to its two contacts."""

from __future__ import annotations

from dataclasses import replace

from sitscad.geometry.path import Point, polyline
from sitscad.layout.clearance import Hole, Track
from sitscad.layout.pieces import Pad
from sitscad.layout.routing.lanes import Bus, Lane
from sitscad.layout.tail.frame import CAP, TailFrame, contact_height, pair_height, parting, turn_begin
from sitscad.layout.tail.funnel import SAME, Descent, descents
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec

Ends = tuple[Point, Point]
"""Where a coil's two conductors (A, B) enter the funnel."""


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


def _lane_heights(spec: SensorSpec, bus: Bus, tail: TailFrame, lane: Lane, entries: Ends) -> tuple[float, float]:
    """Heights (m) above the axis at which a coil's two conductors (A, B) run in the tail: both at its pair's middle, or
    side by side in the order in which they come.
    """
    if bus.is_stacked:
        return (pair_height(spec, tail, lane),) * 2
    a, b = _numbers(bus, lane, entries)
    return _track_height(tail, a), _track_height(tail, b)


def _track_height(tail: TailFrame, number: int) -> float:
    """Height (m) above the axis of a track in the tail; the coils' own are numbered from 1 at the top."""
    return tail.row.offset + contact_height(tail.fan_pitch, tail.row.used, number)


def _numbers(bus: Bus, lane: Lane, entries: Ends) -> tuple[int, int]:
    """The numbers of the contacts of a coil's ends A and B."""
    first = 2 * lane.rank + 1
    return (first, first + 1) if bus.is_stacked or entries[0].y >= entries[1].y else (first + 1, first)


def ways_down(
    spec: SensorSpec, bus: Bus, tail: TailFrame, lanes: tuple[Lane, ...], entries: list[Ends]
) -> list[tuple[Descent, Descent]]:
    """How both conductors of every coil, entering the funnel at these points, come to their lanes."""
    heights = [_lane_heights(spec, bus, tail, lane, ends) for lane, ends in zip(lanes, entries, strict=True)]
    if bus.is_stacked:  # above each other, on two layers
        one = descents(tail.funnel, [ends[0] for ends in entries], [pair[0] for pair in heights], bus.pitch)
        return [(way, way) for way in one]
    flat = descents(
        tail.funnel, [e for ends in entries for e in ends], [h for pair in heights for h in pair], bus.pitch
    )
    return list(zip(flat[::2], flat[1::2], strict=True))


def stretched(spec: SensorSpec, bus: Bus, tail: TailFrame, ways: list[tuple[Descent, Descent]]) -> TailFrame:
    """The tail, made longer where its pairs would come down to their lanes too late, and begun later where the outer
    ones wait longer than for each other.
    """
    both = [way for pair in ways for way in pair]
    waited = max((way.bend - tail.funnel for way in both if not way.parts), default=0.0) - tail.wait
    if waited > SAME and tail.taper.narrows:
        begin, start, end = tail.body_end + waited, tail.start + waited, tail.end + waited
        tail = replace(tail, body_end=begin, start=start, end=end)
    limit = turn_begin(spec, bus, tail)
    late = max(0.0, tail.start + tail.taper.reach_beyond - limit) if tail.turn else 0.0
    late = max(late, *(way.foot.x + 1.5 * tail.fan_pitch - limit for way in both))
    return replace(tail, end=tail.end + late)


def runs(spec: SensorSpec, bus: Bus, tail: TailFrame, lane: Lane, ways: tuple[Descent, Descent]) -> tuple[Run, Run]:
    """Both conductors (A, B) of one coil from where they enter the funnel to their contacts."""
    numbers = _numbers(bus, lane, (ways[0].entry, ways[1].entry))
    run = _stacked_run if bus.is_stacked else _flat_run
    return run(spec, bus, tail, lane, ways[0], numbers[0], "A"), run(spec, bus, tail, lane, ways[1], numbers[1], "B")


def _stacked_run(spec: SensorSpec, bus: Bus, tail: TailFrame, lane: Lane, way: Descent, number: int, end: str) -> Run:
    """A conductor of a pair whose two run above each other, from the funnel to its contact."""
    neck, middle = _neck(bus, tail, way, end), way.height
    height = _track_height(tail, number)
    pad = _contact(tail, lane, number, end)
    begin = neck.path.end
    part = Point(parting(spec, bus, tail), middle)
    joint = Point(part.x + abs(height - middle), height)
    chip_pad = _chip_pad(tail, lane, height, end)
    if end == "A":
        pieces = _past_chip(tail, neck.layer, [begin, part, joint], chip_pad, _squeezed(tail, height, pad))
        return Run(neck, tuple(pieces), pad, chip_pad)
    via_x = tail.fan_end - spec.fpc.rules.via_pad / 2 - CAP
    hole = Hole(Point(via_x, height), spec.fpc.rules.via_pad, spec.fpc.rules.via_drill)
    pieces = [
        Track(polyline([begin, part, joint, hole.centre]), tail.trace_width, neck.layer),
        hole,
        *_past_chip(tail, pad.layer, [hole.centre], chip_pad, _squeezed(tail, height, pad)),
    ]
    return Run(neck, tuple(pieces), pad, chip_pad)


def _neck(bus: Bus, tail: TailFrame, way: Descent, end: str) -> Track:
    """The track down to the lane, which widens where its neighbour has gone."""
    return Track(way.neck(tail.fan_pitch), tail.neck_width, bus.layers[0] if end == "A" else bus.layers[1])


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


def _flat_run(spec: SensorSpec, bus: Bus, tail: TailFrame, lane: Lane, way: Descent, number: int, end: str) -> Run:
    neck = _neck(bus, tail, way, end)
    pad = _contact(tail, lane, number, end)
    return Run(neck, (Track(polyline([neck.path.end, pad.centre]), tail.trace_width, neck.layer),), pad)


def _contact(tail: TailFrame, lane: Lane, number: int, end: str) -> Pad:
    name = lane.placement.name
    return replace(_bare_contact(tail, tail.row.first - 1 + number), net=name, pin=f"{name}.{end}")


def unused_contacts(tail: TailFrame) -> tuple[Pad, ...]:
    """The contacts that no coil has: copper without a net, which the connector holds the tail by."""
    used = range(tail.row.first, tail.row.first + tail.row.used)
    return tuple(_bare_contact(tail, number) for number in range(1, tail.row.count + 1) if number not in used)


def _bare_contact(tail: TailFrame, number: int) -> Pad:
    size = (tail.contact_length, tail.connector.contact_width)
    return Pad(Point(tail.pad_start + size[0] / 2, tail.row.height(number)), size, 1, "", "", number)
