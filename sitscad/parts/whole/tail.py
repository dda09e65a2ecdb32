"""Flat pieces of the tail laid along its way: straight parts are moved, bent ones drawn out round the bend's axis."""

from __future__ import annotations

import math
from typing import Any

from sitscad.geometry.path import Region, bounding_box, rectangle
from sitscad.layout.bending import bend_stretch
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, face, raised
from sitscad.parts.solid import PartsError, Solid
from sitscad.record import record
from sitscad.scene import stack
from sitscad.scene.bodies import BodyRole
from sitscad.scene.tail_path import Station, Stretch, TailPath

BEYOND = 1e-3


@record(eq=False)
class Part:
    """A part of a flat region on one stretch of the tail's way: where that begins, flat (x, m) and laid, and for a
    straight one its faces (build123d, in the plane z = 0).
    """

    first: float
    here: Station
    stretch: Stretch
    faces: tuple[Any, ...] = ()


@record(eq=False)
class Plan:
    """A flat region, cut into the stretches of the tail's way; ``width`` is from where to where across (m) it is
    bent.
    """

    parts: tuple[Part, ...]
    middle: float
    width: tuple[float, float]

    def laid(self, lower: float, upper: float) -> Any:
        """It from height `lower` to `upper` (m, of the flat board), along the way: one build123d solid in millimetres.

        Raises `PartsError` where nothing of the region is there, or it falls apart.
        """
        pieces = [piece for part in self.parts for piece in self._pieces(part, lower, upper)]
        if not pieces:
            raise PartsError("the tail has no part beyond the board's body")
        found = pieces[0].fuse(*pieces[1:]).solids() if len(pieces) > 1 else pieces
        if len(found) != 1:
            raise PartsError(f"the tail falls into {len(found)} pieces along its way")
        return found[0]

    def _pieces(self, part: Part, lower: float, upper: float) -> list[Any]:
        if part.stretch.turn:
            return [_bent(part, (lower - self.middle, upper - self.middle), self.width)]
        return [_moved(raised(each, lower, upper), part, self.middle) for each in part.faces]


def plan(layout: Layout, path: TailPath, region: Region) -> Plan:
    """What of a flat region lies beyond the body, cut into the stretches of the tail's way."""
    x0, y0, x1, y1 = bounding_box((region.outline,))
    whole, here, first, parts = face(region), path.start, path.start.x, []
    for stretch in path.stretches:
        end = x1 + BEYOND if stretch is path.stretches[-1] else first + stretch.length
        if end > x0 and first < x1 and stretch.length > 0.0:
            room = face(Region(rectangle(first, y0 - BEYOND, end, y1 + BEYOND)))
            cut = () if stretch.turn else tuple((whole & room).faces())
            parts.append(Part(first, here, stretch, cut))
        here, first = here.after(stretch), first + stretch.length
    return Plan(tuple(parts), path.start.z, _width(layout))


def stiffener_on(layout: Layout, path: TailPath | None) -> Solid | None:
    """The plate under the contacts, where the tail's end has gone."""
    plate = stack.stiffener(layout)
    if plate is None:
        return None
    flat = raised(face(plate.region), *plate.heights)
    shape = flat if path is None else plan(layout, path, plate.region).laid(*plate.heights)
    return Solid(plate.name, shape, plate.material, "#8c6a3f", BodyRole.STIFFENER)


def _width(layout: Layout) -> tuple[float, float]:
    """From where to where across (m) the tail reaches where it may be bent; nothing where it may not."""
    stretch = bend_stretch(layout)
    return (0.0, 0.0) if stretch is None else layout.reach_at(sum(stretch) / 2)


def _moved(flat: Any, part: Part, middle: float) -> Any:
    """A flat piece, its middle at height `middle` (m), moved to its station."""
    bd = require("build123d")
    to_origin = bd.Location((-part.first * MM, 0, -middle * MM))
    to_place = bd.Location((part.here.x * MM, 0, part.here.z * MM), (0, -math.degrees(part.here.angle), 0))
    return flat.moved(to_place * to_origin)


def _bent(part: Part, heights: tuple[float, float], width: tuple[float, float]) -> Any:
    """A bent stretch: the tail's section there, drawn out round the bend's axis."""
    bd, here, (low, high) = require("build123d"), part.here, heights
    normal = (-math.sin(here.angle), math.cos(here.angle))
    corners = [(y, h) for y, h in ((width[0], low), (width[1], low), (width[1], high), (width[0], high))]
    points = [((here.x + h * normal[0]) * MM, y * MM, (here.z + h * normal[1]) * MM) for y, h in corners]
    section = bd.Face(bd.Wire.make_polygon([bd.Vector(*point) for point in points]))
    radius = part.stretch.length / part.stretch.turn
    centre = ((here.x + radius * normal[0]) * MM, 0.0, (here.z + radius * normal[1]) * MM)
    return bd.Solid.revolve(section, math.degrees(part.stretch.turn), bd.Axis(centre, (0, -1, 0)))
