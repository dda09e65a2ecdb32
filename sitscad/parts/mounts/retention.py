"""What holds a mount in its jaw besides glue: a dovetail's tongue or pins on the mount, groove or holes in the jaw."""

from __future__ import annotations

import math
from typing import Any

from sitscad.geometry.path import Point, circle, closed_polygon
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, one_solid, prism
from sitscad.parts.solid import PartsError
from sitscad.scene.jaws import axis, fitted_jaw, jaw_range
from sitscad.scene.seating import joint_clearance, neck, pin_places, retention, tongue_across
from sitscad.spec.mount import Retention

CHAMFER = 0.1e-3
"""Of the pins' ends (m), which find their holes by it."""

OVERCUT = 1.0e-3


def with_retention(layout: Layout, seat: Any, metal: float) -> Any:
    """The seat's lowest piece, which stands on the metal at a height (m), with its tongue or pins."""
    found = retention(layout)
    if found is None:
        return seat
    if found.kind == "pins":
        for x, y in pin_places(layout):
            seat = one_solid(seat + _pin(found, x, y, metal), "mount")
        return seat
    x0, x1 = seat.bounding_box().min.X / MM, layout.body[2]
    return one_solid(seat + _along(layout, _tongue(found, 0.0), x0, x1, metal), "mount")


def cut_for(layout: Layout, jaw: Any, metal: float) -> Any:
    """The jaw, its face at a height (m), with the groove or the holes that the mount's tongue or pins go into: a
    clearance larger, the groove open at the tip, the holes drilled through so that glue can leave.
    """
    found, room, fitted = retention(layout), joint_clearance(layout), fitted_jaw(layout)
    if found is None or fitted is None:
        return jaw
    if found.kind == "pins":
        for x, y in pin_places(layout):
            hole = circle(Point(x, y), found.diameter / 2 + room)
            jaw = one_solid(jaw - prism(hole, metal - 2.0 * fitted.height, metal + OVERCUT), "jaw")
        return jaw
    tip = jaw_range(layout, fitted)[0] - OVERCUT
    groove = _along(layout, _tongue(found, room), tip, layout.body[2] + room, metal)
    return one_solid(jaw - groove, "jaw")


def _pin(found: Retention, x: float, y: float, metal: float) -> Any:
    """A peg below the mount, its end chamfered."""
    peg = prism(circle(Point(x, y), found.diameter / 2), metal - found.depth, metal + 0.1e-3)
    low = peg.bounding_box().min.Z
    rim = [edge for edge in peg.edges() if low + 1e-6 > edge.bounding_box().max.Z]
    return peg.chamfer(min(CHAMFER, found.depth / 3) * MM, None, rim)


def _tongue(found: Retention, room: float) -> list[Point]:
    """The dovetail across (m), its middle at 0 and the mount's lower face at height 0, larger by a clearance. Raises
    `PartsError` where its flanks cross.
    """
    if neck(found) <= 0.0:
        raise PartsError("the dovetail's flanks cross below the mount (mount.retention): it has no tongue")
    bottom, top, depth = tongue_across(found, room)
    above = 0.1e-3  # into the mount, or out of the jaw: no face of it lies in that of another
    narrow = top - above / math.tan(found.angle)
    return [Point(-bottom, -depth), Point(bottom, -depth), Point(narrow, above), Point(-narrow, above)]


def _along(layout: Layout, across: list[Point], start: float, end: float, height: float) -> Any:
    """A section drawn out along the jaw from one place to another (m), its zero at a height (m)."""
    bd = require("build123d")
    upright = prism(closed_polygon(across), 0.0, end - start)
    stand = bd.Plane((start * MM, axis(layout).y * MM, height * MM), x_dir=(0, 1, 0), z_dir=(1, 0, 0))
    return upright.moved(bd.Location(stand))
