"""The mould for the elastomer: cast it, where it is not bought as sheet and cut.

An open tray with cavities of the pad's outline, as deep as the pad is thick, their walls leaning outwards by the draft
so that the cured pad comes out; a groove round each takes what runs over, and a lid drawn across from one side leaves
the face flat. Its vents let air out. Each pad has its nominal size at half its height.
"""

from __future__ import annotations

import math
from typing import Any

from sitscad.geometry.path import Path, Point, Region, circle, rectangle
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, face, one_solid, prism
from sitscad.parts.solid import Solid
from sitscad.record import record
from sitscad.scene.bodies import Body, BodyRole, elastomer
from sitscad.scene.column import print_limit

MATERIAL, COLOUR = "printed resin", "#c9b8a9"
DRAFT = math.radians(3.0)
FLOOR, BORDER, LID = 2.0e-3, 4.0e-3, 2.0e-3
GROOVE, RIM = 1.0e-3, 1.0e-3
VENT = 1.0e-3
CAVITIES = 4
"""A bad pad of four is a pad to throw away, not an afternoon."""
SPILL = 1.3
"""What is mixed over what the cavities hold: cup, stirrer and what runs over keep the rest (from memory)."""


LEAST_MIX = 5e-6
"""Two liquids of less than this (m3) cannot be weighed out well on a laboratory balance (from memory)."""


@record
class Pour:
    """How much silicone a mould takes: how many pads, the volume (m3) of one, and what is to be mixed for all."""

    pads: int
    pad: float
    mixed: float


def pour(layout: Layout) -> Pour | None:
    """What is mixed for one mould; None without an elastomer."""
    body = elastomer(layout.spec)
    if body is None:
        return None
    x, y = body.footprint.size
    area = math.pi * x * y / 4 if body.footprint.is_round else x * y
    volume = area * body.thickness
    return Pour(CAVITIES, volume, SPILL * CAVITIES * volume)


def mould(layout: Layout) -> tuple[Solid, ...]:
    """Tray and lid, each lying as it is printed, beside the sensor's place; none without an elastomer."""
    pad = elastomer(layout.spec)
    if pad is None:
        return ()
    pieces = (("mould-tray", _tray(pad)), ("mould-lid", _lid(pad, _vent(layout))))
    return tuple(Solid(name, shape, MATERIAL, COLOUR, BodyRole.MOULD) for name, shape in pieces)


def _size(pad: Body) -> tuple[float, float]:
    """The pad's own sides, unturned (m)."""
    return pad.footprint.size


def _pitch(pad: Body) -> float:
    return _size(pad)[0] + 2 * (RIM + GROOVE) + RIM


def _centres(pad: Body) -> list[Point]:
    return [Point((i - (CAVITIES - 1) / 2) * _pitch(pad), 0.0) for i in range(CAVITIES)]


def _plan(pad: Body) -> Path:
    half_x = CAVITIES * _pitch(pad) / 2 + BORDER
    half_y = _size(pad)[1] / 2 + RIM + GROOVE + BORDER
    return rectangle(-half_x, -half_y, half_x, half_y, 2e-3)


def _tray(pad: Body) -> Any:
    tray = prism(_plan(pad), -pad.thickness - FLOOR, 0.0)
    for centre in _centres(pad):
        tray = one_solid(tray - _cavity(pad, centre), "mould")
        tray = one_solid(tray - _groove(pad, centre), "mould")
    return tray


def _cavity(pad: Body, centre: Point) -> Any:
    """The pad with leaning walls: narrowest at the floor, and of its nominal size at half its height."""
    bd = require("build123d")
    lean = math.tan(DRAFT) * pad.thickness / 2
    ends = [
        face(Region(_outline(pad, centre, room))).moved(bd.Location((0, 0, height * MM))).outer_wire()
        for room, height in ((-lean, -pad.thickness), (lean, 0.0))
    ]
    return bd.Solid.make_loft(ends, ruled=True)


def _groove(pad: Body, centre: Point) -> Any:
    """A ditch round the cavity, half as deep, behind a rim."""
    inner, outer = _outline(pad, centre, RIM), _outline(pad, centre, RIM + GROOVE)
    return prism(Region(outer, (inner,)), -max(pad.thickness / 2, 0.5e-3), 1e-3)


def _outline(pad: Body, centre: Point, room: float) -> Path:
    """The pad's outline about a point, so much larger on each side (m)."""
    x, y = (side / 2 + room for side in _size(pad))
    if pad.footprint.is_round:
        return circle(centre, x)
    return rectangle(centre.x - x, centre.y - y, centre.x + x, centre.y + y)


def _vent(layout: Layout) -> float:
    """The diameter (m) of the lid's vents: as small as the process that prints it makes holes."""
    mount = layout.spec.mount
    return max(VENT, print_limit(mount.process if mount is not None else "resin", "hole").value)


def _lid(pad: Body, size: float) -> Any:
    """A flat plate with vents over the grooves, where they leave no mark on a pad."""
    lid = prism(_plan(pad), 0.0, LID)
    for centre in _centres(pad):
        beside = _size(pad)[1] / 2 + RIM + GROOVE / 2
        for side in (-1.0, 1.0):
            vent = circle(Point(centre.x, centre.y + side * beside), size / 2)
            lid = one_solid(lid - prism(vent, -1e-3, LID + 1e-3), "mould")
    return lid
