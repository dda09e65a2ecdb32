"""Paths and regions of the plane turned into build123d faces and prisms; metres in, millimetres out."""

from __future__ import annotations

from typing import Any

from sitscad.geometry.path import Arc, Path, Point, Region
from sitscad.parts.extras import require
from sitscad.parts.solid import PartsError

MM = 1e3


def face(region: Region) -> Any:
    """A build123d face of a region in the plane z = 0, arcs kept."""
    bd = require("build123d")
    return bd.Face(_wire(region.outline), [_wire(hole) for hole in region.holes])


def prism(region: Region | Path, lower: float, upper: float) -> Any:
    """A region extruded from height `lower` to `upper` (m), as a build123d solid."""
    shape = face(region if isinstance(region, Region) else Region(region))
    return raised(shape, lower, upper)


def raised(shape: Any, lower: float, upper: float) -> Any:
    """A build123d face in the plane z = 0, extruded from height `lower` to `upper` (m)."""
    bd = require("build123d")
    upright = shape if shape.normal_at().Z > 0 else -shape
    return bd.Solid.extrude(upright.moved(bd.Location((0, 0, lower * MM))), bd.Vector(0, 0, (upper - lower) * MM))


def box(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> Any:
    """An upright box between two corners (m), as a build123d solid."""
    bd = require("build123d")
    corner = bd.Plane((x0 * MM, y0 * MM, z0 * MM))
    return bd.Solid.make_box((x1 - x0) * MM, (y1 - y0) * MM, (z1 - z0) * MM, corner)


def one_solid(shape: Any, what: str) -> Any:
    """The single solid that a boolean left; raises `PartsError` when it left none or several."""
    found = shape.solids() if shape is not None else []
    if len(found) != 1:
        raise PartsError(f"the {what} falls into {len(found)} pieces; its parts in the spec do not join")
    return found[0]


def top_edges(shape: Any) -> Any:
    """The edges that lie in a solid's highest plane."""
    top = shape.bounding_box().max.Z
    lowest = [(edge, float(edge.bounding_box().min.Z)) for edge in shape.edges()]
    return [edge for edge, z in lowest if z > top - 1e-6]


def _wire(path: Path) -> Any:
    bd = require("build123d")
    return bd.Wire([_edge(segment) for segment in path])


def _edge(segment: Any) -> Any:
    bd = require("build123d")
    if isinstance(segment, Arc):
        return bd.Edge.make_three_point_arc(*(_mm(segment.at(t)) for t in (0.0, 0.5, 1.0)))
    return bd.Edge.make_line(_mm(segment.start), _mm(segment.end))


def _mm(point: Point) -> tuple[float, float]:
    return point.x * MM, point.y * MM
