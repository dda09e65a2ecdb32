"""The funnel: how tracks that come side by side past the coils draw together, or apart, to their lanes in the tail.

Every track bends by 45 degrees where it leaves its height and bends back where it has reached its lane's. Tracks never
cross: their order across the tail is that of their lanes. So two can only come too near each other where both run
towards the same side, and there the one behind waits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from sitscad.geometry.path import Path, Point, polyline
from sitscad.layout.routing.lanes import STAGGER
from sitscad.record import record

SAME = 1e-9
"""Heights that differ by less (m) are equal."""


@record
class Descent:
    """One track in the funnel: where it enters it, the height of its lane (m), and the x (m) where it bends to it."""

    entry: Point
    height: float
    bend: float

    @property
    def climb(self) -> float:
        """How far up its lane lies (m), negative for down."""
        return self.height - self.entry.y

    @property
    def parts(self) -> bool:
        """Whether its lane is as far from the axis as its entry, or farther."""
        return abs(self.height) >= abs(self.entry.y)

    @property
    def foot(self) -> Point:
        """Where it has reached its lane."""
        return Point(self.bend + abs(self.climb), self.height)

    def neck(self, length: float) -> Path:
        """From the entry to the foot, and so far (m) along the lane."""
        bend = Point(self.bend, self.entry.y)
        return polyline([self.entry, bend, self.foot, self.foot.shifted(length, 0.0)])


def descents(funnel: float, entries: Sequence[Point], heights: Sequence[float], pitch: float) -> list[Descent]:
    """The ways of one layer's tracks from x = `funnel` (m) to lanes at these heights, middle lines a `pitch` (m) apart.

    Those that part bend in turn, the outermost first: a track widens only where its neighbour has gone. Any others bend
    at once, or as late as those must that follow another to the same side.
    """
    ways = [Descent(entry, height, funnel) for entry, height in zip(entries, heights, strict=True)]
    outermost = max((abs(way.entry.y) for way in ways if way.parts), default=0.0)
    ways = [replace(w, bend=funnel + STAGGER * (outermost - abs(w.entry.y))) if w.parts else w for w in ways]
    for side in (1.0, -1.0):
        going = [i for i, way in enumerate(ways) if side * way.climb > SAME]
        going.sort(key=lambda i: -side * ways[i].entry.y)
        for ahead, behind in pairwise(going):
            apart = abs(ways[ahead].entry.y - ways[behind].entry.y)
            soonest = ways[ahead].bend + math.sqrt(2.0) * pitch - apart
            if soonest > ways[behind].bend + SAME:
                ways[behind] = replace(ways[behind], bend=soonest)
    return ways
