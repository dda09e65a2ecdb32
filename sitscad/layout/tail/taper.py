"""Change of the tail's width between two half widths, with rounded corners. Lengths are in metres."""

from __future__ import annotations

import math
from functools import cached_property

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Point

SAME = 1e-9  # Half widths that differ by less (m) are equal: there is no corner between them


@record
class Taper:
    """A change of the tail's half width from `near` to `far` (m) between x = `begin` and x = `end` (m).

    `inner` and `outer` (m) are the edge radii of the concave and the convex corner. If the slope from `begin` to `end`
    is too steep for both radii, the taper becomes longer at its concave corner, and the board becomes larger.
    """

    begin: float
    end: float
    near: float
    far: float
    inner: float
    outer: float

    @property
    def narrows(self) -> bool:
        """Whether the width decreases from `begin` to `end`. The concave corner is then at `end`."""
        return self.far < self.near

    @property
    def step(self) -> float:
        """Difference (m) between the two half widths, without sign."""
        return abs(self.near - self.far)

    @cached_property
    def angle(self) -> float:
        """Angle (rad) between the sloping edge and the tail's axis.

        It is limited so that the two corner arcs together do not span more than the difference of the half widths.
        """
        steepest = math.acos(max(0.0, 1.0 - self.step / (self.inner + self.outer)))
        return min(math.atan2(self.step, self.end - self.begin), steepest)

    @property
    def length(self) -> float:
        """Length (m) along x between the two corner points of the unrounded edge."""
        return self.step / math.tan(self.angle) if self.step > SAME else 0.0

    @property
    def reach_before(self) -> float:
        """Distance (m) along x from the start of the first corner's arc to the corner point."""
        return self._cut(self.outer if self.narrows else self.inner)

    @property
    def reach_beyond(self) -> float:
        """Distance (m) along x from the second corner point to the end of its arc."""
        return self._cut(self.inner if self.narrows else self.outer)

    def corners(self) -> list[tuple[Point, float]]:
        """Return the two corner points of the lower edge with their radii (m). Empty if the widths are equal."""
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
