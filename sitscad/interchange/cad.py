"""Solids for CAD programs: the copper that `sitscad.solids` leaves out, and all of them for CadQuery."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sitscad.interchange.areas import COPPER, areas
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import BodyRole

COARSE = 5e-6
"""How far (m) the sides of solid copper may lie from the arcs that are drawn: each chord is a face."""

COPPER_COLOUR = "#d98a4b"


def copper_solids(layout: Layout, tolerance: float = COARSE) -> tuple[Solid, ...]:
    """The copper of every layer and net as build123d solids in millimetres, in place, arcs as chords within a tolerance
    (m); named like ``copper-1-COIL_C1``. What plates the holes is left out.

    Raises
    ------
    MissingExtra
        without shapely or a CAD kernel (`pip install 'sitscad[all]'`).
    ValueError
        for a tolerance that is no positive length.
    """
    bd = require("build123d")
    found = []
    for area in areas(layout, tolerance):
        if area.what == COPPER:
            for polygon in getattr(area.polygon, "geoms", (area.polygon,)):
                shape = _prism(polygon, area.lower, area.upper, bd)
                name = f"{COPPER}-{area.layer}-{area.net}" if area.net else f"{COPPER}-{area.layer}"
                found.append(Solid(name, shape, "copper", COPPER_COLOUR, BodyRole.BOARD))
    return tuple(found)


def as_cadquery(solids: Iterable[Solid]) -> dict[str, Any]:
    """Solids by name as CadQuery workplanes in millimetres, in place; those of one name are on one workplane.

    Raises `MissingExtra` without CadQuery.
    """
    cq = require("cadquery")
    found: dict[str, Any] = {}
    for solid in solids:
        shape = cq.Shape.cast(solid.shape.wrapped)
        found[solid.name] = found[solid.name].add(shape) if solid.name in found else cq.Workplane(obj=shape)
    return found


def _prism(polygon: Any, lower: float, upper: float, bd: Any) -> Any:
    rings = (polygon.exterior, *polygon.interiors)
    outer, *inner = (bd.Wire.make_polygon([(x * MM, y * MM) for x, y in ring.coords[:-1]]) for ring in rings)
    face = bd.Face(outer, inner)
    upright = face if face.normal_at().Z > 0 else -face
    return bd.Solid.extrude(upright.moved(bd.Location((0, 0, lower * MM))), bd.Vector(0, 0, (upper - lower) * MM))
