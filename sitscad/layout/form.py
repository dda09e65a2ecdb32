"""A body of a given outline: the board that it and its tail make, and the wall that its edge is to leads.

Where the tail leaves the body its inner corners are rounded by a ball that rolls along the tail's edge until it meets
the body's: it touches both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache

from sitscad.finding import Missing, Shortfall
from sitscad.geometry.convex import beyond
from sitscad.geometry.path import Arc, Line, Path, Point, Segment, bounding_box
from sitscad.layout.clearance import SLACK, Breadth, Track
from sitscad.layout.tail_frame import TailFrame
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

_NEAR = 1e-9

CHORD = 1e-6
"""How far (m) chords of an outline lie from its arcs where points are held against it."""


def edge_of_body(spec: SensorSpec) -> Path | None:
    """The outline (closed, counter-clockwise) that the spec gives its body, where the coils stand; None without one."""
    return None if spec.fpc.body is None else spec.fpc.body.edge.shifted(*spec.array.middle)


def given_box(spec: SensorSpec) -> tuple[float, float, float, float] | None:
    """The box (m) of the outline that the spec gives its body; None where coils and leads say how large it is."""
    edge = edge_of_body(spec)
    return None if edge is None else bounding_box([edge])


@record
class Root:
    """Where one side of the tail leaves the body: the ball's centre and where it touches the body's edge, the piece of
    that (its index), and where it touches the tail's edge.
    """

    centre: Point
    on_body: Point
    piece: int
    on_tail: Point


@lru_cache(maxsize=64)
def root(edge: Path, side: int, half_width: float, radius: float) -> Root | None:
    """One side (+1 above, -1 below) of the root of a tail with its axis at y = 0, with an inner corner of a radius (m);
    None where the tail's edge passes the body.
    """
    height = side * (half_width + radius)
    found = [
        (x, index, foot) for index, segment in enumerate(edge) for x, foot in _contacts(segment, height, radius)
    ]
    if not found:
        return None
    x, piece, foot = max(found, key=lambda each: (round(each[0], 12), -each[1]))
    return Root(Point(x, height), foot, piece, Point(x, side * half_width))


def _contacts(segment: Segment, height: float, radius: float) -> Iterator[tuple[float, Point]]:
    """Where balls of a radius whose centres lie at a height touch a segment: their centres' x, and the point (m)."""
    start = segment.start
    for x in _abscissae(start, height, radius):
        yield x, start
    if isinstance(segment, Arc):
        centre = segment.centre
        for reach in (segment.radius + radius, abs(segment.radius - radius)):
            for x in _abscissae(centre, height, reach):
                away = math.hypot(x - centre.x, height - centre.y)
                if away > 0.0:
                    share = segment.radius / away
                    foot = Point(centre.x + share * (x - centre.x), centre.y + share * (height - centre.y))
                    if segment.distance(foot) < _NEAR and abs(foot.distance(Point(x, height)) - radius) < _NEAR:
                        yield x, foot
        return
    nx, ny = ((segment.end.y - start.y) / segment.length, (start.x - segment.end.x) / segment.length)
    for reach in (radius, -radius) if abs(nx) > _NEAR else ():
        x = start.x + (reach - (height - start.y) * ny) / nx
        foot = Point(x - reach * nx, height - reach * ny)
        if segment.distance(foot) < _NEAR:
            yield x, foot


def _abscissae(centre: Point, height: float, reach: float) -> tuple[float, ...]:
    square = reach * reach - (height - centre.y) ** 2
    return () if square < 0.0 else (centre.x + math.sqrt(square), centre.x - math.sqrt(square))


def roots(edge: Path, tail: TailFrame) -> tuple[Root, Root] | None:
    """The lower and the upper side of a tail's root; None where the tail is wider than the body."""
    lower, upper = (root(edge, side, tail.half_width, tail.inner_radius) for side in (-1, 1))
    return None if lower is None or upper is None else (lower, upper)


def board(edge: Path, tail: TailFrame) -> Path:
    """The closed outline, counter-clockwise, of a body and its tail; of the tail and the body's box where the tail is
    wider than the body.
    """
    both = roots(edge, tail)
    if both is None:
        return edge
    lower, upper = both
    strip = tail.strip(max(tail.start, lower.on_tail.x, upper.on_tail.x)).segments[:-1]
    way = [
        *_between(edge, upper, lower),
        Arc(lower.on_body, lower.on_tail, lower.centre, ccw=False),
        Line(lower.on_tail, strip[0].start),
        *strip,
        Line(strip[-1].end, upper.on_tail),
        Arc(upper.on_tail, upper.on_body, upper.centre, ccw=False),
    ]
    return Path(tuple(part for part in way if part.start.distance(part.end) > 1e-10))


def _between(edge: Path, first: Root, last: Root) -> list[Segment]:
    """The closed edge from one point on it to another."""
    count = len(edge.segments)
    before, after = edge.segments[first.piece], edge.segments[last.piece]
    if first.piece == last.piece and _along(before, first.on_body) <= _along(before, last.on_body):
        return [_cut(before, first.on_body, last.on_body)]
    passed = range(1, (last.piece - first.piece) % count or count)
    return [
        _cut(before, first.on_body, before.end),
        *(edge.segments[(first.piece + step) % count] for step in passed),
        _cut(after, after.start, last.on_body),
    ]


def _along(segment: Segment, point: Point) -> float:
    """How far (m, or rad on an arc) along a segment a point on it lies."""
    if isinstance(segment, Line):
        return segment.start.distance(point)
    angle = math.atan2(point.y - segment.centre.y, point.x - segment.centre.x) - segment.start_angle
    return (angle if segment.ccw else -angle) % (2.0 * math.pi)


def _cut(segment: Segment, start: Point, end: Point) -> Segment:
    return Arc(start, end, segment.centre, segment.ccw) if isinstance(segment, Arc) else Line(start, end)


def walls(spec: SensorSpec, tail: TailFrame) -> tuple[Track, ...]:
    """The given edge as tracks on all layers, so wide that what keeps its spacing from them keeps the fabricator's
    distance from the edge (their width is negative where that is the smaller one); none without a given outline.
    """
    edge = edge_of_body(spec)
    if edge is None:
        return ()
    rules = spec.fpc.rules
    width, outline = 2.0 * (rules.copper_to_edge - rules.trace_spacing), board(edge, tail)
    return tuple(Track(outline, width, copper.number) for copper in spec.fpc.stackup.copper)


def lack(spec: SensorSpec, tail: TailFrame) -> Shortfall | None:
    """What a body of a given outline lacks most room for, as far as that is known before leads are laid: the root of
    its tail, or the coil that lies farthest out, with the fabricator's distance from the edge.
    """
    edge, asked = edge_of_body(spec), spec.fpc.rules.copper_to_edge
    if edge is None:
        return None
    (_, low, _, high), coil, kept = bounding_box([edge]), spec.coil.outline.boundary(spec.coil.size, 0.0), {}
    for placement in spec.array.placements:
        turns = coil.rotated(placement.rotation).shifted(*placement.centre)
        kept[placement.name] = -max(beyond(edge, point) for point in turns.flattened(CHORD))
    name = min(kept, key=lambda name: kept[name])
    wider = max(tail.half_width - high, tail.half_width + low)
    if asked - kept[name] > max(wider, SLACK):
        words = f"{name}, with the {show(asked, 'm')} that copper keeps from the edge, is"
        return _lacking(spec, words, kept[name], asked)
    return _lacking(spec, "the tail's root is", -wider, 0.0) if wider > SLACK else None


def _lacking(spec: SensorSpec, what: str, have: float, need: float) -> Shortfall:
    body = spec.fpc.body.written if spec.fpc.body else ""
    facts = (("what", what), ("body", body), ("missing", (need - have) * 1e6))
    return Shortfall(Missing.BODY_ROOM, have, need, "m", facts=facts)


def breadth_of(spec: SensorSpec) -> Breadth | None:
    """How far a body of a given outline reaches across; None where coils and leads say it."""
    box = given_box(spec)
    return None if box is None else Breadth(box[1], box[3])
