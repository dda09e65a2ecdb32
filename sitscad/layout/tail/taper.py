"""Where the board changes from one width to another: a straight taper between two corners, both rounded."""

from __future__ import annotations

import math
from functools import cached_property

from sitscad.geometry.path import Point
from sitscad.record import record

SAME = 1e-9
"""Half widths that differ by less (m) are equal: there is no corner between them."""


@record
class Taper:
    """The change of the half width `near` to the half width `far` (m) along x from `begin` to `end`, or a longer one.

    The inner one of its two corners has the radius `inner`, the outer one `outer` (m). Where the way from `begin` to
    `end` is too steep for both, the taper becomes longer at its inner corner, so that the board only grows.
    """

    begin: float
    end: float
    near: float
    far: float
    inner: float
    outer: float

    @property
    def narrows(self) -> bool:
        """Whether the far part is the narrower one; its corner is then the inner one."""
        return self.far < self.near

    @property
    def step(self) -> float:
        """By how much (m) the half width changes."""
        return abs(self.near - self.far)

    @cached_property
    def angle(self) -> float:
        """How far (rad) the edge turns at both corners: their two arcs together must not climb more than the step."""
        steepest = math.acos(max(0.0, 1.0 - self.step / (self.inner + self.outer)))
        return min(math.atan2(self.step, self.end - self.begin), steepest)

    @property
    def length(self) -> float:
        """Along x (m) from corner to corner."""
        return self.step / math.tan(self.angle) if self.step > SAME else 0.0

    @property
    def reach_before(self) -> float:
        """How far (m) the rounding of the first corner reaches back along the near part."""
        return self._cut(self.outer if self.narrows else self.inner)

    @property
    def reach_beyond(self) -> float:
        """How far (m) the rounding of the second corner reaches along the far part."""
        return self._cut(self.inner if self.narrows else self.outer)

    def corners(self) -> list[tuple[Point, float]]:
        """The two corners of the lower edge with their radii (m); none where the widths are the same."""
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
