"""Where a plate lies, seen from above: a disc or a rectangle of some size about a centre, turned in its plane."""

from __future__ import annotations

import math

from sitscad.geometry.convex import beyond, clipped
from sitscad.geometry.path import Arc, Path, Point, circle, enclosed_area, polar, rectangle
from sitscad.record import record


@record
class Footprint:
    """A disc (``is_round``, its diameter the first of its sizes) or a rectangle: sizes along its own x and y (m),
    centre, and rotation (rad, counter-clockwise).
    """

    is_round: bool
    size: tuple[float, float]
    centre: Point
    rotation: float = 0.0

    @property
    def corners(self) -> tuple[Point, ...]:
        """The four corners of a rectangle, counter-clockwise; none of a disc."""
        if self.is_round:
            return ()
        x, y = self.size[0] / 2, self.size[1] / 2
        cos, sin = math.cos(self.rotation), math.sin(self.rotation)
        return tuple(
            self.centre.shifted(cos * u - sin * v, sin * u + cos * v) for u, v in ((-x, -y), (x, -y), (x, y), (-x, y))
        )

    @property
    def reach(self) -> tuple[float, float]:
        """How far (m) it reaches from its centre along x and along y."""
        if self.is_round:
            return self.size[0] / 2, self.size[0] / 2
        cos, sin = abs(math.cos(self.rotation)), abs(math.sin(self.rotation))
        x, y = self.size[0] / 2, self.size[1] / 2
        # a quarter turn is exact although its cosine is not quite zero
        cos, sin = (0.0 if part < 1e-15 else part for part in (cos, sin))
        return cos * x + sin * y, sin * x + cos * y

    @property
    def box(self) -> tuple[float, float, float, float]:
        """(x_min, y_min, x_max, y_max) in metres."""
        x, y = self.reach
        return self.centre.x - x, self.centre.y - y, self.centre.x + x, self.centre.y + y

    def outline(self, margin: float = 0.0) -> Path:
        """The closed outline, counter-clockwise, grown by `margin` (m) with round corners."""
        if self.is_round:
            return circle(self.centre, self.size[0] / 2 + margin)
        (cx, cy), x, y = self.centre, self.size[0] / 2 + margin, self.size[1] / 2 + margin
        upright = rectangle(cx - x, cy - y, cx + x, cy + y, margin)
        return upright.rotated(self.rotation, self.centre) if self.rotation else upright

    def place_of(self, point: Point) -> tuple[float, float]:
        """A point's coordinates (m) in the plate's own axes, about its centre."""
        dx, dy = point.x - self.centre.x, point.y - self.centre.y
        cos, sin = math.cos(self.rotation), math.sin(self.rotation)
        return cos * dx + sin * dy, cos * dy - sin * dx

    def hangs_over(self, ground: Path) -> float:
        """How far (m) its farthest point lies outside a convex outline; what is left of room, negative, where it lies
        inside.
        """
        if self.is_round:
            return beyond(ground, self.centre) + self.size[0] / 2
        return max(beyond(ground, corner) for corner in self.corners)

    def common(self, other: Footprint) -> Path | None:
        """The outline of what both cover; None where they do not overlap."""
        if self.is_round and other.is_round:
            return _lens(self, other)
        clip, found = (other, self.outline()) if not other.is_round else (self, other.outline())
        here: Path | None = found
        for corner, after in zip(clip.corners, clip.corners[1:] + clip.corners[:1], strict=True):
            side = corner.distance(after)
            normal = Point((after.y - corner.y) / side, (corner.x - after.x) / side)
            here = None if here is None else clipped(here, corner, normal)
        return here if here is not None and enclosed_area(here) > 0.0 else None

    @property
    def area(self) -> float:
        """Area (m2)."""
        return math.pi / 4.0 * self.size[0] ** 2 if self.is_round else self.size[0] * self.size[1]


def _lens(one: Footprint, other: Footprint) -> Path | None:
    """What two discs have in common."""
    small, large = sorted((one, other), key=lambda disc: disc.size[0])
    r, big, apart = small.size[0] / 2, large.size[0] / 2, small.centre.distance(large.centre)
    if apart >= r + big:
        return None
    if apart <= big - r:
        return small.outline()
    towards = math.atan2(large.centre.y - small.centre.y, large.centre.x - small.centre.x)
    aside = math.acos(max(-1.0, min(1.0, (apart**2 + r**2 - big**2) / (2.0 * apart * r))))
    lower, upper = polar(r, towards - aside, small.centre), polar(r, towards + aside, small.centre)
    return Path((Arc(lower, upper, small.centre), Arc(upper, lower, large.centre)))
