"""Lines and circular arcs, paths of lines and arcs, and areas. Lengths are in metres.

Arcs stay arcs in all files. Chords replace them only where a machine or a library requires it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

from sitscad.basics.record import record

TWO_PI = 2.0 * math.pi
"""Full turn (rad)."""
QUARTER_TURN = 0.5 * math.pi
"""Quarter turn (rad)."""


class Point(NamedTuple):
    """Point of the plane, by coordinates `x` and `y` in metres."""

    x: float
    y: float

    def __sub__(self, other: Point) -> Point:
        return Point(self.x - other.x, self.y - other.y)

    def shifted(self, dx: float, dy: float) -> Point:
        """Return the point moved by `dx` and `dy` (m)."""
        return Point(self.x + dx, self.y + dy)

    def distance(self, other: Point) -> float:
        """Return the distance (m) to another point."""
        return math.hypot(self.x - other.x, self.y - other.y)


def polar(radius: float, angle: float, centre: Point = Point(0.0, 0.0)) -> Point:
    """Return the point at a radius (m) and an angle (rad, from +x, counter-clockwise) about a centre."""
    return Point(centre.x + radius * math.cos(angle), centre.y + radius * math.sin(angle))


@record
class Line:
    """Straight segment from `start` to `end`."""

    start: Point
    end: Point

    @property
    def length(self) -> float:
        """Length (m) of the segment."""
        return self.start.distance(self.end)

    def reversed(self) -> Line:
        """Return the segment in the opposite direction."""
        return Line(self.end, self.start)

    def at(self, fraction: float) -> Point:
        """Return the point at a fraction (0 to 1) of the length."""
        return Point(
            self.start.x + fraction * (self.end.x - self.start.x), self.start.y + fraction * (self.end.y - self.start.y)
        )

    def flattened(self, tolerance: float) -> list[Point]:
        """Return start and end. A straight line needs no chords, so `tolerance` has no effect."""
        return [self.start, self.end]

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max) in metres."""
        (ax, ay), (bx, by) = self.start, self.end
        return min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)

    def nearest(self, point: Point) -> Point:
        """Return the point on the segment with the least distance from `point`."""
        dx, dy = self.end.x - self.start.x, self.end.y - self.start.y
        square = dx * dx + dy * dy
        if square == 0.0:
            return self.start
        t = ((point.x - self.start.x) * dx + (point.y - self.start.y) * dy) / square
        return self.at(min(1.0, max(0.0, t)))

    def distance(self, point: Point) -> float:
        """Return the shortest distance (m) from a point to the segment."""
        return point.distance(self.nearest(point))


@record
class Arc:
    """Circular arc from `start` to `end` about `centre`; never a full circle.

    `ccw` is true if it runs counter-clockwise.
    """

    start: Point
    end: Point
    centre: Point
    ccw: bool = True

    @cached_property
    def radius(self) -> float:
        """Radius (m) of the arc."""
        return self.centre.distance(self.start)

    @cached_property
    def start_angle(self) -> float:
        """Direction (rad) from the centre to the start."""
        return math.atan2(self.start.y - self.centre.y, self.start.x - self.centre.x)

    @cached_property
    def sweep(self) -> float:
        """Signed angle (rad) from start to end about the centre: positive counter-clockwise, magnitude below 2 pi."""
        end = math.atan2(self.end.y - self.centre.y, self.end.x - self.centre.x)
        turn = (end - self.start_angle) % TWO_PI
        return turn if self.ccw else turn - TWO_PI if turn else 0.0

    @property
    def length(self) -> float:
        """Length (m) along the arc."""
        return self.radius * abs(self.sweep)

    def reversed(self) -> Arc:
        """Return the arc in the opposite direction."""
        return Arc(self.end, self.start, self.centre, not self.ccw)

    def at(self, fraction: float) -> Point:
        """Return the point at a fraction (0 to 1) of the length."""
        if fraction <= 0.0:
            return self.start
        if fraction >= 1.0:
            return self.end
        return polar(self.radius, self.start_angle + fraction * self.sweep, self.centre)

    def flattened(self, tolerance: float) -> list[Point]:
        """Return points on the arc, from start to end, to be joined by chords.

        The chords stay within `tolerance` (m) of the arc. For an angle `step` between points, the largest distance
        between chord and arc is r (1 - cos(step / 2)).
        """
        radius, sweep = self.radius, self.sweep
        if radius <= tolerance:
            return [self.start, self.end]
        step = 2.0 * math.acos(max(-1.0, 1.0 - tolerance / radius))
        count = max(1, math.ceil(abs(sweep) / step))
        start = self.start_angle
        return [self.start, *(polar(radius, start + sweep * i / count, self.centre) for i in range(1, count)), self.end]

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Exact bounding box (x_min, y_min, x_max, y_max) in metres.

        It includes the points of the arc that are farthest along x and y.
        """
        xs, ys = [self.start.x, self.end.x], [self.start.y, self.end.y]
        start, sweep, radius = self.start_angle, self.sweep, self.radius
        low, high = min(start, start + sweep) / QUARTER_TURN, max(start, start + sweep) / QUARTER_TURN
        for quarter in (turn % 4 for turn in range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)):
            angle = quarter * math.pi / 2
            travelled = (angle - start) % TWO_PI if sweep >= 0 else (start - angle) % TWO_PI
            if travelled <= abs(sweep):
                xs.append(self.centre.x + radius * (1, 0, -1, 0)[quarter])
                ys.append(self.centre.y + radius * (0, 1, 0, -1)[quarter])
        return min(xs), min(ys), max(xs), max(ys)

    def distance(self, point: Point) -> float:
        """Return the shortest distance (m) from a point to the arc."""
        angle = math.atan2(point.y - self.centre.y, point.x - self.centre.x)
        if self.ccw:
            sweep, travelled = self.sweep, (angle - self.start_angle) % TWO_PI
        else:
            sweep, travelled = -self.sweep, (self.start_angle - angle) % TWO_PI
        if travelled <= sweep:
            return abs(point.distance(self.centre) - self.radius)
        return min(point.distance(self.start), point.distance(self.end))


Segment = Line | Arc
"""Straight or circular piece of a path."""


def segment_part(segment: Segment, start: Point, end: Point) -> Segment:
    """Return the part of a segment from `start` to `end`, which are two points on it."""
    return Arc(start, end, segment.centre, segment.ccw) if isinstance(segment, Arc) else Line(start, end)


@record
class Path:
    """Segments in order. Every segment starts at the end of the segment before.

    The path is closed if the last segment ends at the start of the first.
    """

    segments: tuple[Segment, ...]

    @property
    def start(self) -> Point:
        """Start of the first segment."""
        return self.segments[0].start

    @property
    def end(self) -> Point:
        """End of the last segment."""
        return self.segments[-1].end

    @cached_property
    def length(self) -> float:
        """Length (m) of all segments together."""
        return math.fsum([segment.length for segment in self.segments])

    @property
    def is_closed(self) -> bool:
        """Whether the path ends at its start, within a nanometre."""
        return self.start.distance(self.end) < 1e-9

    def __iter__(self) -> Iterator[Segment]:
        return iter(self.segments)

    def __add__(self, other: Path) -> Path:
        return Path(self.segments + other.segments)

    def reversed(self) -> Path:
        """Return the path in the opposite direction."""
        return Path(tuple(segment.reversed() for segment in reversed(self.segments)))

    def shifted(self, dx: float, dy: float) -> Path:
        """Return the path moved by `dx` and `dy` (m)."""
        return self.mapped(lambda p: p.shifted(dx, dy))

    def rotated(self, angle: float, centre: Point = Point(0.0, 0.0)) -> Path:
        """Return the path rotated by `angle` (rad), counter-clockwise, about a centre."""
        cos, sin = math.cos(angle), math.sin(angle)

        def turned(p: Point) -> Point:
            dx, dy = p.x - centre.x, p.y - centre.y
            return Point(centre.x + cos * dx - sin * dy, centre.y + sin * dx + cos * dy)

        return self.mapped(turned)

    def mapped(self, move: Callable[[Point], Point], flips: bool = False) -> Path:
        """Return the path after a rigid motion, with each point replaced by the result of `move`.

        `flips` is true if the motion is a mirror image.
        """
        moved: list[Segment] = []
        before = start = end = None
        for s in self.segments:
            start = end if s.start is before and end is not None else move(s.start)
            before, end = s.end, move(s.end)
            if isinstance(s, Arc):
                moved.append(Arc(start, end, move(s.centre), s.ccw != flips))
            else:
                moved.append(Line(start, end))
        return Path(tuple(moved))

    def flattened(self, tolerance: float) -> list[Point]:
        """Return points on the path, to be joined by chords that stay within `tolerance` (m) of the path."""
        points = [self.start]
        for segment in self.segments:
            points.extend(segment.flattened(tolerance)[1:])
        return points

    def distance(self, point: Point) -> float:
        """Return the shortest distance (m) from a point to the path."""
        return min(segment.distance(point) for segment in self.segments)


def polyline(points: Iterable[Point]) -> Path:
    """Return straight segments from point to point. Repeated points are omitted."""
    corners = [p if isinstance(p, Point) else Point(*p) for p in points]
    return Path(tuple([Line(a, b) for a, b in pairwise(corners) if a.distance(b) > 1e-12]))


def closed_polygon(points: Iterable[Point]) -> Path:
    """Return a closed path of straight sides from point to point and back to the first."""
    corners = [Point(*p) for p in points]
    return polyline([*corners, corners[0]])


def rectangle(x0: float, y0: float, x1: float, y1: float, corner_radius: float = 0.0) -> Path:
    """Return a closed counter-clockwise rectangle from (x0, y0) to (x1, y1), with rounded corners.

    `corner_radius` (m) is limited to half the shorter side.
    """
    r = min(corner_radius, (x1 - x0) / 2, (y1 - y0) / 2)
    if r <= 0.0:
        return closed_polygon([Point(x0, y0), Point(x1, y0), Point(x1, y1), Point(x0, y1)])
    return rounded_polygon([Point(x0, y0), Point(x1, y0), Point(x1, y1), Point(x0, y1)], r)


def rounded_polygon(corners: list[Point], radius: float | list[float]) -> Path:
    """Return a closed polygon whose corners are replaced by tangent arcs.

    `radius` (m) is for all corners, or a list with a radius for each corner.
    """
    count = len(corners)
    radii = radius if isinstance(radius, list) else [radius] * count
    starts, ends, arcs = [], [], []
    for i, corner in enumerate(corners):
        before, after = corners[i - 1], corners[(i + 1) % count]
        a, b, arc = fillet(before, corner, after, radii[i])
        starts.append(a)
        ends.append(b)
        arcs.append(arc)
    segments: list[Segment] = []
    for i in range(count):
        if (arc := arcs[i]) is not None:
            segments.append(arc)
        nxt = (i + 1) % count
        if ends[i].distance(starts[nxt]) > 1e-12:
            segments.append(Line(ends[i], starts[nxt]))
    return Path(tuple(segments))


def fillet(before: Point, corner: Point, after: Point, radius: float) -> tuple[Point, Point, Arc | None]:
    """Return the start and the end of the arc that rounds a corner, and the arc.

    Start and end lie on the sides towards the points `before` and `after`; `radius` is in m.

    The arc is None if the radius is 0 or the corner is straight.
    """
    ux, uy = _unit_vector(corner, before)
    vx, vy = _unit_vector(corner, after)
    angle = math.acos(max(-1.0, min(1.0, ux * vx + uy * vy)))
    if radius <= 0.0 or angle > math.pi - 1e-9:
        return corner, corner, None
    cut = radius / math.tan(angle / 2)
    a, b = corner.shifted(cut * ux, cut * uy), corner.shifted(cut * vx, cut * vy)
    mx, my = ux + vx, uy + vy
    reach = radius / math.sin(angle / 2) / math.hypot(mx, my)
    centre = corner.shifted(reach * mx, reach * my)
    return a, b, Arc(a, b, centre, ccw=ux * vy - uy * vx < 0)


def rounded_polyline(corners: list[Point], radius: float | list[float]) -> Path:
    """Return an open polyline with all corners between its ends rounded.

    `radius` (m) is for all corners, or a list with a radius for each point. A radius is reduced if its arc would cover
    more than half of the shorter side at the corner.
    """
    segments: list[Segment] = []
    here = corners[0]
    radii = radius if isinstance(radius, list) else [radius] * len(corners)
    for before, corner, after, most_radius in zip(corners, corners[1:], corners[2:], radii[1:], strict=False):
        ux, uy = _unit_vector(corner, before)
        vx, vy = _unit_vector(corner, after)
        half = math.acos(max(-1.0, min(1.0, ux * vx + uy * vy))) / 2
        room = 0.5 * min(corner.distance(before), corner.distance(after)) * math.tan(half)
        a, b, arc = fillet(before, corner, after, min(most_radius, room))
        if here.distance(a) > 1e-12:
            segments.append(Line(here, a))
        if arc is not None:
            segments.append(arc)
        here = b
    segments.append(Line(here, corners[-1]))
    return Path(tuple(segments))


def circle(centre: Point, radius: float) -> Path:
    """Return a full circle as two half arcs, counter-clockwise. `radius` is in m."""
    east, west = centre.shifted(radius, 0.0), centre.shifted(-radius, 0.0)
    return Path((Arc(east, west, centre), Arc(west, east, centre)))


def enclosed_area(path: Path) -> float:
    """Return the signed area (m2) inside a closed path, positive counter-clockwise.

    Arcs are exact (Green's theorem).
    """
    total = 0.0
    for s in path:
        total += 0.5 * (s.start.x * s.end.y - s.end.x * s.start.y)
        if isinstance(s, Arc):
            total += 0.5 * s.radius**2 * (s.sweep - math.sin(s.sweep))
    return total


def arc_through(start: Point, middle: Point, end: Point, flat: float) -> Segment:
    """Return the arc through three points, or a line if the points are nearly on a line.

    It is a line if four times the area of the points' triangle is below `flat` (m2).
    """
    (ax, ay), (bx, by) = middle - start, end - start
    cross = 2.0 * (ax * by - ay * bx)
    if abs(cross) < flat:
        return Line(start, end)
    a2, b2 = ax * ax + ay * ay, bx * bx + by * by
    return Arc(start, end, start.shifted((by * a2 - ay * b2) / cross, (ax * b2 - bx * a2) / cross), ccw=cross > 0)


def winding_number(points: Sequence[Point], centre: Point) -> float:
    """Return the number of turns that a polyline makes about a centre, counter-clockwise positive."""
    moved = [point - centre for point in points]
    return math.fsum(math.atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y) for a, b in pairwise(moved)) / math.tau


def bounding_box(paths: Iterable[Path]) -> tuple[float, float, float, float]:
    """Return the box (x_min, y_min, x_max, y_max; m) around the centre lines of some paths, with exact arcs."""
    return box_around([segment.box for path in paths for segment in path.segments])


def box_around(boxes: Sequence[tuple[float, float, float, float]]) -> tuple[float, float, float, float]:
    """Return the box (x_min, y_min, x_max, y_max; m) that encloses all given boxes."""
    return min(b[0] for b in boxes), min(b[1] for b in boxes), max(b[2] for b in boxes), max(b[3] for b in boxes)


def _unit_vector(a: Point, b: Point) -> tuple[float, float]:
    """Return the unit vector from point `a` to point `b`."""
    length = a.distance(b)
    return (b.x - a.x) / length, (b.y - a.y) / length


@record
class Region:
    """Area inside a closed `outline` and outside its `holes`."""

    outline: Path
    holes: tuple[Path, ...] = ()

    @property
    def area(self) -> float:
        """Area (m2) without the holes."""
        return abs(enclosed_area(self.outline)) - sum(abs(enclosed_area(hole)) for hole in self.holes)
