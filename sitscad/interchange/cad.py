"""Solids for CAD programs: the copper that `sitscad.solids` leaves out, and all of them for build123d and CadQuery."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sitscad.interchange.areas import COPPER, areas
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.solid import MM, Solid
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


def as_cadquery_assembly(solids: Iterable[Solid], name: str = "sensor") -> Any:
    """Solids as one ``cadquery.Assembly`` in millimetres, in place: a child for every name, in its colour and with its
    material in ``metadata``; those of one name are one compound. The shapes are the solids' own, not copies.

    Raises `MissingExtra` without CadQuery.
    """
    cq = require("cadquery")
    whole = cq.Assembly(name=name)
    for called, pieces in _by_name(solids).items():
        shapes = [cq.Shape.cast(piece.shape.wrapped) for piece in pieces]
        shape = shapes[0] if len(shapes) == 1 else cq.Compound.makeCompound(shapes)
        whole.add(shape, name=called, color=cq.Color(*pieces[0].rgb), metadata={"material": pieces[0].material})
    return whole


def as_build123d(solids: Iterable[Solid], name: str = "sensor") -> Any:
    """Solids as one ``build123d.Compound`` in millimetres, in place: its children are labelled and coloured, so that
    what build123d exports has names and colours; those of one name are one compound.

    The shapes' geometry is shared; the solids themselves get no label and no parent. Raises `MissingExtra` without
    build123d.
    """
    bd = require("build123d")
    children = []
    for called, pieces in _by_name(solids).items():
        shapes = [bd.Solid(piece.shape.wrapped) for piece in pieces]
        child = shapes[0] if len(shapes) == 1 else bd.Part(shapes)
        child.label, child.color = called, bd.Color(*pieces[0].linear_rgb)
        children.append(child)
    return bd.Compound(label=name, children=children)


def _by_name(solids: Iterable[Solid]) -> dict[str, list[Solid]]:
    """Solids of one name together, in the order in which the names come."""
    found: dict[str, list[Solid]] = {}
    for solid in solids:
        found.setdefault(solid.name, []).append(solid)
    return found


def _prism(polygon: Any, lower: float, upper: float, bd: Any) -> Any:
    rings = (polygon.exterior, *polygon.interiors)
    outer, *inner = (bd.Wire.make_polygon([(x * MM, y * MM) for x, y in ring.coords[:-1]]) for ring in rings)
    face = bd.Face(outer, inner)
    upright = face if face.normal_at().Z > 0 else -face
    return bd.Solid.extrude(upright.moved(bd.Location((0, 0, lower * MM))), bd.Vector(0, 0, (upper - lower) * MM))
