"""Convex outlines of lines and arcs: what a straight cut leaves of them, and how far a point lies outside. Exact."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from sitscad.geometry.path import TWO_PI, Arc, Line, Path, Point, Segment

_TINY = 1e-12


def clipped(outline: Path, edge: Point, normal: Point) -> Path | None:
    """What lies behind a straight line of a closed path that this line crosses at most twice; None where nothing does.

    The line runs through `edge`, square to the unit vector `normal`; the part that `normal` points to is cut away.
    """
    kept = [part for segment in outline for part in _behind(segment, edge, normal)]
    segments: list[Segment] = []
    for part in kept:
        if segments and segments[-1].end.distance(part.start) > _TINY:
            segments.append(Line(segments[-1].end, part.start))
        segments.append(part)
    if not segments:
        return None
    if segments[-1].end.distance(segments[0].start) > _TINY:
        segments.append(Line(segments[-1].end, segments[0].start))
    return Path(tuple(segments))


def within_box(outline: Path, box: tuple[float, float, float, float]) -> Path | None:
    """The part of a closed path in a box (x_min, y_min, x_max, y_max in metres); each side crosses it twice at most."""
    x0, y0, x1, y1 = box
    low, high = Point(x0, y0), Point(x1, y1)
    found: Path | None = outline
    for edge, normal in ((low, Point(-1, 0)), (low, Point(0, -1)), (high, Point(1, 0)), (high, Point(0, 1))):
        found = None if found is None else clipped(found, edge, normal)
    return found


def _behind(segment: Segment, edge: Point, normal: Point) -> Iterator[Segment]:
    """The parts of a segment on the far side of a line from its normal."""
    cuts = [0.0, *sorted(t for t in _crossings(segment, edge, normal) if _TINY < t < 1.0 - _TINY), 1.0]
    for first, last in pairwise(cuts):
        if _height(segment.at((first + last) / 2), edge, normal) > 0.0:
            continue
        start, end = segment.at(first), segment.at(last)
        if start.distance(end) > _TINY or last - first > 0.5:
            yield Arc(start, end, segment.centre, segment.ccw) if isinstance(segment, Arc) else Line(start, end)


def _height(point: Point, edge: Point, normal: Point) -> float:
    return (point.x - edge.x) * normal.x + (point.y - edge.y) * normal.y


def _crossings(segment: Segment, edge: Point, normal: Point) -> Iterator[float]:
    """The fractions of a segment's length at which it meets a line."""
    if isinstance(segment, Line):
        first, last = (_height(point, edge, normal) for point in (segment.start, segment.end))
        if first != last:
            yield first / (first - last)
        return
    share = -_height(segment.centre, edge, normal) / segment.radius
    if abs(share) >= 1.0 or not segment.sweep:
        return
    towards, aside = math.atan2(normal.y, normal.x), math.acos(share)
    for angle in (towards - aside, towards + aside):
        turn = angle - segment.start_angle
        yield (turn % TWO_PI if segment.sweep > 0.0 else -(-turn % TWO_PI)) / segment.sweep


def beyond(outline: Path, point: Point) -> float:
    """How far (m) a point lies outside a closed convex path that runs counter-clockwise; negative inside.

    The largest of the heights above all its tangents: of a side that is one of them, of an arc or a corner the one that
    looks at the point.
    """
    found = -math.inf
    segments = outline.segments
    for segment, after in zip(segments, segments[1:] + segments[:1], strict=True):
        if isinstance(segment, Arc):
            if _looks(segment.start_angle, segment.sweep, segment.centre, point):
                found = max(found, point.distance(segment.centre) - segment.radius)
        else:
            found = max(found, _height(point, segment.start, _outward(segment)))
        out = _direction(segment, 1.0)
        turn = math.remainder(_direction(after, 0.0) - out, TWO_PI)
        if turn > _TINY and _looks(out, turn, segment.end, point):
            found = max(found, point.distance(segment.end))
    return found


def _outward(side: Line) -> Point:
    length = side.length
    return Point((side.end.y - side.start.y) / length, (side.start.x - side.end.x) / length)


def _direction(segment: Segment, fraction: float) -> float:
    """Where the outward normal of a segment points (rad), at its start (0) or its end (1)."""
    if isinstance(segment, Arc):
        return segment.start_angle + fraction * segment.sweep
    normal = _outward(segment)
    return math.atan2(normal.y, normal.x)


def _looks(first: float, turn: float, centre: Point, point: Point) -> bool:
    """Whether a point lies from a centre in one of the directions from `first` on, `turn` (rad) counter-clockwise."""
    return (math.atan2(point.y - centre.y, point.x - centre.x) - first) % TWO_PI <= turn


def centroid(outline: Path) -> Point:
    """The centroid of what a closed path encloses, arcs exact (Green's theorem); the start of one without area."""
    area = x = y = 0.0
    origin = outline.start  # near the path, so that small shapes far out lose no digits
    for segment in outline:
        (ax, ay), (bx, by) = (segment.start - origin), (segment.end - origin)
        double = ax * by - bx * ay
        area += double / 2.0
        x += double * (ax + bx) / 6.0
        y += double * (ay + by) / 6.0
        if isinstance(segment, Arc):
            cap, out = _cap(segment)
            area, x, y = area + cap, x + cap * (out.x - origin.x), y + cap * (out.y - origin.y)
    return origin.shifted(x / area, y / area) if abs(area) > 0.0 else origin


def _cap(arc: Arc) -> tuple[float, Point]:
    """The signed area (m2) between an arc and its chord, and the centroid of that."""
    sweep, radius = abs(arc.sweep), arc.radius
    area = 0.5 * radius**2 * (sweep - math.sin(sweep))
    if area <= 0.0:
        return 0.0, arc.start
    away = 4.0 * radius * math.sin(sweep / 2.0) ** 3 / (3.0 * (sweep - math.sin(sweep)))
    middle = arc.start_angle + arc.sweep / 2.0
    out = arc.centre.shifted(away * math.cos(middle), away * math.sin(middle))
    return math.copysign(area, arc.sweep), out
