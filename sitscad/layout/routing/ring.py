"""The ring road: the track next outside a coil, on which its leads and the stubs of its outer vias run."""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise

from sitscad.geometry.path import TWO_PI, Arc, Line, Path, Point, Segment, bounding_box, polar
from sitscad.record import record
from sitscad.spec.coil import CoilPlacement, CoilSpec


@record
class Ring:
    """The closed curve at `offset` (m) outside a coil's copper, walked by angle (rad) about the coil's centre."""

    coil: CoilSpec
    placement: CoilPlacement
    offset: float

    @cached_property
    def centre(self) -> Point:
        """The coil's centre."""
        return Point(*self.placement.centre)

    @cached_property
    def boundary(self) -> Path:
        """The ring about the origin, unrotated."""
        return self.coil.outline.boundary(self.coil.size, self.offset)

    @cached_property
    def half_size(self) -> tuple[float, float]:
        """Half the ring's extent in x and y (m)."""
        box = bounding_box([self.boundary.rotated(self.placement.rotation)])
        return box[2], box[3]

    @cached_property
    def _known(self) -> dict[float, Point]:
        return {}

    def at(self, angle: float) -> Point:
        """The ring's point in a direction from the centre; remembered, for many ways round begin or end alike."""
        if angle not in self._known:
            self._known[angle] = self._at(angle)
        return self._known[angle]

    def _at(self, angle: float) -> Point:
        """The ring's point in a direction (rad) from its centre."""
        if self.coil.outline.is_round:
            return polar(self.coil.size[0] / 2 + self.offset, angle, self.centre)
        local = angle - self.placement.rotation
        ux, uy = math.cos(local), math.sin(local)
        distance = max(_ray_length(segment, ux, uy) for segment in self.boundary)
        return polar(distance, angle, self.centre)

    def facing(self, point: Point) -> tuple[float, float]:
        """The directions from the centre in which the ring's points nearest to `point` lie (rad), the first clockwise
        of the second: two of them for a point on the diagonal of a corner, else twice the same. Remembered.
        """
        if point not in self._faced:
            self._faced[point] = self._facing(point)
        return self._faced[point]

    @cached_property
    def _faced(self) -> dict[Point, tuple[float, float]]:
        return {}

    def _facing(self, point: Point) -> tuple[float, float]:
        """The directions (rad) between which the ring is nearest to a point."""
        centre = self.centre
        away = math.atan2(point.y - centre.y, point.x - centre.x)
        if self.coil.outline.is_round:
            return away, away
        turn = self.placement.rotation
        local = polar(point.distance(centre), away - turn, Point(0.0, 0.0))
        feet = [_foot(segment, local) for segment in self.boundary]
        least = min(foot.distance(local) for foot in feet)
        near = [foot for foot in feet if foot.distance(local) < least + 1e-9]
        sides = [math.remainder(math.atan2(foot.y, foot.x) + turn - away, TWO_PI) for foot in near]
        return away + min(sides), away + max(sides)

    def along(self, start: float, end: float, ccw: bool) -> Path:
        """The way along the ring from one angle to another, either way round; empty where they are equal."""
        sweep = (end - start) % TWO_PI if ccw else -((start - end) % TWO_PI)
        if abs(sweep) < 1e-9 or TWO_PI - abs(sweep) < 1e-9:
            return Path(())
        if self.coil.outline.is_round:
            return Path((Arc(self.at(start), self.at(end), self.centre, ccw),))
        points = [self.at(start), *self._corners(start, sweep), self.at(end)]
        return Path(tuple(Line(a, b) for a, b in pairwise(points) if a.distance(b) > 1e-9))

    def _corners(self, start: float, sweep: float) -> list[Point]:
        """The ring's corners that are passed from a direction on over a sweep (rad), in their order."""
        turned = [segment.end for segment in self.boundary.segments[:-1]]
        passed = []
        for corner in turned:
            angle = math.atan2(corner.y, corner.x) + self.placement.rotation
            along = (angle - start) % TWO_PI if sweep > 0 else (start - angle) % TWO_PI
            if 1e-9 < along < abs(sweep) - 1e-9:
                passed.append((along, polar(math.hypot(corner.x, corner.y), angle, self.centre)))
        return [point for _, point in sorted(passed)]


def _foot(line: Segment, point: Point) -> Point:
    """The point of a straight side that is nearest to another."""
    dx, dy = line.end.x - line.start.x, line.end.y - line.start.y
    share = ((point.x - line.start.x) * dx + (point.y - line.start.y) * dy) / (dx * dx + dy * dy)
    share = min(1.0, max(0.0, share))
    return Point(line.start.x + share * dx, line.start.y + share * dy)


def _ray_length(segment: Segment, ux: float, uy: float) -> float:
    """Distance from the origin at which a ray in direction (ux, uy) meets a straight side; 0 where it misses."""
    dx, dy = segment.end.x - segment.start.x, segment.end.y - segment.start.y
    determinant = ux * dy - uy * dx
    if abs(determinant) < 1e-18:
        return 0.0
    reach = (segment.start.x * dy - segment.start.y * dx) / determinant
    t = (segment.start.x * uy - segment.start.y * ux) / determinant
    return reach if reach > 0 and -1e-9 <= t <= 1 + 1e-9 else 0.0
