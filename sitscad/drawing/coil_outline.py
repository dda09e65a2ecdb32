"""Where a coil ends on the board: the outline of its outermost copper, turned as the coil is."""

from __future__ import annotations

import math

from sitscad.geometry.path import TWO_PI, Path, Point, bounding_box, circle, polar, rectangle, rounded
from sitscad.layout.board import Coil
from sitscad.spec.sensor import CoilSpec

CORNERS = {"hexagon": 6, "octagon": 8}


def coil_outline(spec: CoilSpec, coil: Coil) -> Path:
    """The closed outline (m) that a coil's outer copper edges lie on, about its centre and turned as it is drawn.

    Corners are as round as the pen that draws them leaves the copper: half a track's width and the corner's own radius.
    """
    return _unturned(spec).rotated(coil.placement.rotation).shifted(*coil.centre)


def coil_extent(spec: CoilSpec, coil: Coil) -> tuple[float, float, float, float]:
    """(x0, y0, x1, y1) in metres of a coil's outer copper edges on the board.

    They are the outline's, but for a rounded corner at which a layer begins: that one is left sharp.
    """
    outline, half = bounding_box([coil_outline(spec, coil)]), spec.trace_width / 2
    if not spec.corner_radius:
        return outline
    x0, y0, x1, y1 = bounding_box([winding.path for winding in coil.windings])
    return (
        min(outline[0], x0 - half), min(outline[1], y0 - half), max(outline[2], x1 + half), max(outline[3], y1 + half)
    )  # fmt: skip


def _unturned(spec: CoilSpec) -> Path:
    (x, y), radius = (side / 2 for side in spec.size), spec.corner_radius + spec.trace_width / 2
    if spec.shape == "circle":
        return circle(Point(0.0, 0.0), x)
    if spec.shape == "racetrack":
        return rectangle(-x, -y, x, y, min(x, y))
    if spec.shape not in CORNERS:
        return rectangle(-x, -y, x, y, radius)
    step = TWO_PI / CORNERS[spec.shape]
    reach = x / math.cos(step / 2)
    return rounded([polar(reach, (i + 0.5) * step) for i in range(CORNERS[spec.shape])], radius)
