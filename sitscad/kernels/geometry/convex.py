"""Convex outlines of lines and arcs, clipped exactly by straight lines.

The module also has discs and rectangles as plates. It computes their overlap and how far they project beyond an
outline.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from sitscad.basics.record import memo, record
from sitscad.kernels.geometry.path import (
    TWO_PI,
    Arc,
    Line,
    Path,
    Point,
    Segment,
    circle,
    enclosed_area,
    polar,
    rectangle,
    segment_part,
)

_TINY = 1e-12
"""Distance (m) or fraction below which two points, or two fractions of a segment, count as equal."""

Box = tuple[float, float, float, float]
"""Rectangle with sides along x and y: x_min, y_min, x_max, y_max in metres."""

Side = tuple[float, float, float, float]
"""Straight side of an outline: x, y of a point (m), x, y of the outward unit normal."""
Round = tuple[float, float, float, float, float]
"""Arc or corner of an outline: centre x, y (m), radius (m; 0 for a corner), first direction (rad), angle (rad)."""


def clip_path(outline: Path, edge: Point, normal: Point) -> Path | None:
    """Return the part of a closed path on one side of a straight line, or None if no part remains.

    The line crosses the path at most twice. It runs through `edge`, perpendicular to the unit vector `normal`, which
    points to the removed part.
    """
    parts = [part for segment in outline for part in _parts_behind(segment, edge, normal)]
    segments: list[Segment] = []
    for part in parts:
        if segments and segments[-1].end.distance(part.start) > _TINY:
            segments.append(Line(segments[-1].end, part.start))
        segments.append(part)
    if not segments:
        return None
    if segments[-1].end.distance(segments[0].start) > _TINY:
        segments.append(Line(segments[-1].end, segments[0].start))
    return Path(tuple(segments))


def clip_to_box(outline: Path, box: Box) -> Path | None:
    """Return the part of a closed path inside a box (x_min, y_min, x_max, y_max in metres), or None if no part remains.

    Each side of the box crosses the path at most twice.
    """
    x0, y0, x1, y1 = box
    low, high = Point(x0, y0), Point(x1, y1)
    part: Path | None = outline
    for edge, normal in ((low, Point(-1, 0)), (low, Point(0, -1)), (high, Point(1, 0)), (high, Point(0, 1))):
        part = None if part is None else clip_path(part, edge, normal)
    return part


def _parts_behind(segment: Segment, edge: Point, normal: Point) -> Iterator[Segment]:
    """Yield the parts of a segment on one side of a line through `edge`: opposite to the line's `normal`."""
    if isinstance(segment, Line):
        ends = _distance_from_edge(segment.start, edge, normal), _distance_from_edge(segment.end, edge, normal)
    else:
        middle = _distance_from_edge(segment.centre, edge, normal)
        ends = middle - segment.radius, middle + segment.radius
    if min(ends) > 0.0:
        return
    if max(ends) <= 0.0:  # the usual case: all on one side
        yield segment
        return
    cuts = [0.0, *sorted(t for t in _crossings(segment, edge, normal) if _TINY < t < 1.0 - _TINY), 1.0]
    for first, last in pairwise(cuts):
        if _distance_from_edge(segment.at((first + last) / 2), edge, normal) > 0.0:
            continue
        start, end = segment.at(first), segment.at(last)
        if start.distance(end) > _TINY or last - first > 0.5:
            yield segment_part(segment, start, end)


def _distance_from_edge(point: Point, edge: Point, normal: Point) -> float:
    """Return the distance (m) of a point from the line through `edge`, positive in the direction of `normal`."""
    return (point.x - edge.x) * normal.x + (point.y - edge.y) * normal.y


def _crossings(segment: Segment, edge: Point, normal: Point) -> Iterator[float]:
    """Yield the fractions of a segment's length at which it crosses the line through `edge`, perpendicular to `normal`.

    The segment is extended to its whole straight line or circle. Fractions outside 0 to 1 lie beyond its ends.
    """
    if isinstance(segment, Line):
        first, last = (_distance_from_edge(point, edge, normal) for point in (segment.start, segment.end))
        if first != last:
            yield first / (first - last)
        return
    share = -_distance_from_edge(segment.centre, edge, normal) / segment.radius
    if abs(share) >= 1.0 or not segment.sweep:
        return
    towards, half_angle = math.atan2(normal.y, normal.x), math.acos(share)
    for angle in (towards - half_angle, towards + half_angle):
        turn = angle - segment.start_angle
        yield (turn % TWO_PI if segment.sweep > 0.0 else -(-turn % TWO_PI)) / segment.sweep


def signed_distance(outline: Path, point: Point) -> float:
    """Return the distance (m) of a point from a closed, convex, counter-clockwise path: positive outside.

    It is the largest distance beyond the path's tangents: at each side, and at each arc or corner that faces the point.
    """
    sides, rounds = memo(outline, "_tangents", lambda: _tangents(outline))
    px, py = point
    heights = [(px - x) * nx + (py - y) * ny for x, y, nx, ny in sides]
    heights += [math.hypot(px - x, py - y) - radius for x, y, radius, first, turn in rounds
                if (math.atan2(py - y, px - x) - first) % TWO_PI <= turn]
    return max(heights, default=-math.inf)


def _tangents(outline: Path) -> tuple[list[Side], list[Round]]:
    """Return the straight sides (`Side`), and the arcs and corners (`Round`), of a closed convex path.

    The outward normals of an arc or corner cover an angle (rad), from a first direction (rad) counter-clockwise.
    """

    def normal(side: Line) -> tuple[float, float]:
        length = side.length
        return (side.end.y - side.start.y) / length, (side.start.x - side.end.x) / length

    def direction(segment: Segment, fraction: float) -> float:
        """Return the direction (rad) of the outward normal at the start (0) or the end (1)."""
        if isinstance(segment, Arc):
            return segment.start_angle + fraction * segment.sweep
        x, y = normal(segment)
        return math.atan2(y, x)

    segments = outline.segments
    sides = [(*segment.start, *normal(segment)) for segment in segments if isinstance(segment, Line)]
    rounds = [(*segment.centre, segment.radius, segment.start_angle, segment.sweep)
              for segment in segments if isinstance(segment, Arc)]
    for segment, after in zip(segments, segments[1:] + segments[:1], strict=True):
        out = direction(segment, 1.0)
        turn = math.remainder(direction(after, 0.0) - out, TWO_PI)
        if turn > _TINY:
            rounds.append((*segment.end, 0.0, out, turn))
    return sides, rounds


def centroid(outline: Path) -> Point:
    """Return the centroid (m) of the area of a closed path, with exact arcs (Green's theorem).

    If the area is zero, the start of the path is returned.
    """
    area = x = y = 0.0
    origin = outline.start  # near the path, so that small shapes far out lose no digits
    for segment in outline:
        (ax, ay), (bx, by) = (segment.start - origin), (segment.end - origin)
        double = ax * by - bx * ay
        area += double / 2.0
        x += double * (ax + bx) / 6.0
        y += double * (ay + by) / 6.0
        if not isinstance(segment, Arc):
            continue
        sweep, radius = abs(segment.sweep), segment.radius
        beside = sweep - math.sin(sweep)  # area between the arc and its chord, over r^2 / 2
        if beside > 0.0:
            cap = math.copysign(0.5 * radius**2 * beside, segment.sweep)
            distance = 4.0 * radius * math.sin(sweep / 2.0) ** 3 / (3.0 * beside)
            out = polar(distance, segment.start_angle + segment.sweep / 2.0, segment.centre) - origin
            area, x, y = area + cap, x + cap * out.x, y + cap * out.y
    return origin.shifted(x / area, y / area) if abs(area) > 0.0 else origin


@record
class Footprint:
    """Outline of a plate in the plane: a disc if ``is_round``, otherwise a rectangle.

    ``size`` (m) holds the lengths along the plate's own x and y axes; the first is the diameter of a disc. ``rotation``
    (rad) is counter-clockwise about the ``centre``.
    """

    is_round: bool
    size: tuple[float, float]
    centre: Point
    rotation: float = 0.0

    @property
    def corners(self) -> tuple[Point, ...]:
        """Four corners (m) of a rectangle, counter-clockwise. Empty for a disc."""
        if self.is_round:
            return ()
        x, y = self.size[0] / 2, self.size[1] / 2
        cos, sin = math.cos(self.rotation), math.sin(self.rotation)
        return tuple(
            self.centre.shifted(cos * u - sin * v, sin * u + cos * v) for u, v in ((-x, -y), (x, -y), (x, y), (-x, y))
        )

    @property
    def reach(self) -> tuple[float, float]:
        """Half the widths (m) of the bounding box along x and y, after the rotation."""
        if self.is_round:
            return self.size[0] / 2, self.size[0] / 2
        cos, sin = abs(math.cos(self.rotation)), abs(math.sin(self.rotation))
        x, y = self.size[0] / 2, self.size[1] / 2
        # a quarter turn is exact although its cosine is not quite zero
        cos, sin = (0.0 if part < 1e-15 else part for part in (cos, sin))
        return cos * x + sin * y, sin * x + cos * y

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max) in metres."""
        x, y = self.reach
        return self.centre.x - x, self.centre.y - y, self.centre.x + x, self.centre.y + y

    def outline(self, margin: float = 0.0) -> Path:
        """Return the closed outline, counter-clockwise, expanded by `margin` (m) with round corners."""
        if self.is_round:
            return circle(self.centre, self.size[0] / 2 + margin)
        (cx, cy), x, y = self.centre, self.size[0] / 2 + margin, self.size[1] / 2 + margin
        upright = rectangle(cx - x, cy - y, cx + x, cy + y, margin)
        return upright.rotated(self.rotation, self.centre) if self.rotation else upright

    def local_coordinates(self, point: Point) -> tuple[float, float]:
        """Return a point's coordinates (m) along the plate's own x and y axes, from its centre."""
        dx, dy = point.x - self.centre.x, point.y - self.centre.y
        cos, sin = math.cos(self.rotation), math.sin(self.rotation)
        return cos * dx + sin * dy, cos * dy - sin * dx

    def overhang_beyond(self, ground: Path) -> float:
        """Return the largest distance (m) by which the plate projects beyond the convex outline `ground`.

        If the whole plate lies inside, the result is negative: minus its smallest distance from the outline.
        """
        if self.is_round:
            return signed_distance(ground, self.centre) + self.size[0] / 2
        return max(signed_distance(ground, corner) for corner in self.corners)

    def intersection(self, other: Footprint) -> Path | None:
        """Return the outline of the overlap with another footprint, or None if they do not overlap."""
        if self.is_round and other.is_round:
            # two discs: a lens
            small, large = sorted((self, other), key=lambda disc: disc.size[0])
            r, big, apart = small.size[0] / 2, large.size[0] / 2, small.centre.distance(large.centre)
            if apart >= r + big:
                return None
            if apart <= big - r:
                return small.outline()
            towards = math.atan2(large.centre.y - small.centre.y, large.centre.x - small.centre.x)
            half_angle = math.acos(max(-1.0, min(1.0, (apart**2 + r**2 - big**2) / (2.0 * apart * r))))
            lower, upper = polar(r, towards - half_angle, small.centre), polar(r, towards + half_angle, small.centre)
            return Path((Arc(lower, upper, small.centre), Arc(upper, lower, large.centre)))
        clip, outline = (other, self.outline()) if not other.is_round else (self, other.outline())
        here: Path | None = outline
        for corner, after in zip(clip.corners, clip.corners[1:] + clip.corners[:1], strict=True):
            side = corner.distance(after)
            normal = Point((after.y - corner.y) / side, (corner.x - after.x) / side)
            here = None if here is None else clip_path(here, corner, normal)
        return here if here is not None and enclosed_area(here) > 0.0 else None

    @property
    def area(self) -> float:
        """Area (m2) of the plate."""
        return math.pi / 4.0 * self.size[0] ** 2 if self.is_round else self.size[0] * self.size[1]
