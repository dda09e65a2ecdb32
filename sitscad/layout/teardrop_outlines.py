"""Outlines that widen a straight track towards a via or a contact."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.kernels.geometry.path import Line, Path, Point, closed_polygon

TEARDROP_LENGTHS = (1.5, 1.2, 0.9, 0.75)
"""Teardrop lengths in the order of trial: distance from a via's centre in pad diameters, or from a contact's edge.

Distances from a contact's edge are in contact widths.
"""

INSIDE = 10e-6
"""Length (m) of the teardrop inside its contact. With this overlap, rounding errors leave no slit between them."""

SLACK = 1e-9
"""Rounding error (m) of lengths. Shorter lengths count as 0, and clearances may be smaller by this length."""


def via_teardrops(centre: Point, diameter: float, leg: Line, width: float) -> Iterator[Path]:
    """Yield teardrops of a via on the track `leg`, the longest first.

    Each is the convex hull of the via's pad, a circle of this `diameter` (m) at `centre`, and of a circle on the
    track's centre line. `width` (m) is the track's width and the second circle's diameter.
    """
    large, small = diameter / 2, width / 2
    if small >= large:
        return
    ux, uy = (leg.end.x - leg.start.x) / leg.length, (leg.end.y - leg.start.y) / leg.length
    for reach in (factor * diameter for factor in TEARDROP_LENGTHS):
        if reach > leg.length:
            continue
        cos = (large - small) / reach
        sin = math.sqrt(1.0 - cos * cos)
        sides = [(ux * cos - side * uy * sin, uy * cos + side * ux * sin) for side in (1.0, -1.0)]
        tip = centre.shifted(reach * ux, reach * uy)
        near = [centre.shifted(large * x, large * y) for x, y in sides]
        ends = [tip.shifted(small * x, small * y) for x, y in sides]
        yield closed_polygon([near[0], near[1], ends[1], ends[0]])


def contact_teardrops(centre: Point, size: tuple[float, float], leg: Line, width: float) -> Iterator[Path]:
    """Yield trapezoids from the edge of a contact to a track of `width` (m) that leaves the edge at a right angle.

    `centre` and `size` [x, y] (m) are the contact's. The longest trapezoid is first.
    """

    def exchanged(point: Point) -> Point:
        return Point(point.y, point.x)

    if abs(leg.end.x - leg.start.x) < SLACK < abs(leg.end.y - leg.start.y):
        lying = Line(exchanged(leg.start), exchanged(leg.end))
        for outline in contact_teardrops(exchanged(centre), size[::-1], lying, width):
            yield outline.mapped(exchanged, flips=True).reversed()
        return
    height = size[1]
    if abs(leg.end.y - leg.start.y) > SLACK or width >= height:
        return
    side = math.copysign(1.0, leg.end.x - leg.start.x)
    edge = centre.x + side * size[0] / 2
    for reach in (factor * height for factor in TEARDROP_LENGTHS):
        if (leg.end.x - edge) * side < reach:
            continue
        base, tip, y = edge - side * INSIDE, edge + side * reach, leg.start.y
        low, high = centre.y - height / 2, centre.y + height / 2
        corners = [Point(base, low), Point(edge, low), Point(tip, y - width / 2), Point(tip, y + width / 2)]
        yield closed_polygon([*corners, Point(edge, high), Point(base, high)])
