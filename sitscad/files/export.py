"""What other programs compute with: a layout as lines, currents, areas and solids.

All of it is in one frame, the board's: x along the jaw towards the tail, y across it, z away from the board's top face,
which is z = 0 (copper lies below it); the origin is the spec's, the middle of the array unless its centres are written
out. Lengths are metres; solids are in millimetres, which is what CAD programs take a number for.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any

import numpy as np
import shapely

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.places.stack import stack
from sitscad.assembly.solids.solid import MM, Solid, raised, require
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Path, Point, Segment
from sitscad.layout.board import Coil, Layout, Via
from sitscad.spec.circuit import Stackup

TOLERANCE = 1e-6
"""How far (m) chords may lie from an arc, unless another distance is asked for."""


@record
class CentreLine:
    """The middle of one layer's track, walked as the coil's current does: ``coil`` (C1, C2, ...), copper ``layer`` from
    1 at the top, the height ``z`` of the copper's middle, ``width`` and ``thickness`` of the track, all in metres.

    ``path`` has its straight pieces and arcs as they are drawn.
    """

    coil: str
    layer: int
    z: float
    width: float
    thickness: float
    path: Path

    def __repr__(self) -> str:
        """A line with coil, layer and length."""
        return f"<CentreLine of {self.coil} on layer {self.layer}: {1e3 * self.length:.4g} mm>"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The lines and arcs in order: each begins where the one before ends."""
        return self.path.segments

    @property
    def length(self) -> float:
        """Length (m) of the line, arcs as arcs."""
        return self.path.length

    def points(self, tolerance: float = TOLERANCE) -> Array:
        """Points (n, 3) in metres whose chords stay within a tolerance (m) of the line."""
        return _raised(self.path.flattened(_positive(tolerance)), self.z)


@record(eq=False)
class CurrentPath:
    """A polyline that carries a current: points (n, 3) in metres, in the direction of the current (A); the names of the
    coil, and the copper layer that it lies on (None where it goes through several).
    """

    coil: str
    layer: int | None
    points: Array
    current: float

    def __repr__(self) -> str:
        """A line with coil, number of points and current."""
        return f"<CurrentPath of {self.coil}: {len(self.points)} points, {self.current:.4g} A>"


@checked_arguments
def centre_lines(layout: Layout) -> tuple[CentreLine, ...]:
    """Every layer of every coil, in the order of the coils and, within each, of its current."""
    width = layout.spec.coil.trace_width
    return tuple(
        CentreLine(coil.name, winding.layer, winding.z, width, winding.thickness, winding.path)
        for coil in layout.coils
        for winding in coil.windings
    )


@checked_arguments
def current_paths(
    layout: Layout, current: float = 1.0, leads: bool = True, tolerance: float = TOLERANCE
) -> tuple[CurrentPath, ...]:
    """The coils as filaments for a field program: chords within a tolerance (m) of the middle of the copper.

    With `leads` one path a coil, from its contact A through stubs, layers and vias back to its contact B, its tail held
    straight; without them one a layer, which are not joined. `current` (A) enters at contact A, which leads to the
    outer end of layer 1.

    Raises
    ------
    ValueError
        with `leads`, where a coil's leads found no room on the board and its circuit is open; and for a tolerance that
        is no positive length.
    """
    _positive(tolerance)
    if leads:
        stackup = layout.spec.fpc.stackup
        return tuple(CurrentPath(c.name, None, _circuit(c, stackup, tolerance), float(current)) for c in layout.coils)
    return tuple(
        CurrentPath(line.coil, line.layer, line.points(tolerance), float(current)) for line in centre_lines(layout)
    )


def _circuit(coil: Coil, stackup: Stackup, tolerance: float) -> Array:
    """A coil's whole circuit, leads included, as points (n, 3; m); ValueError where it is open."""
    if not coil.is_closed_circuit:
        raise ValueError(f"the leads of {coil.name} found no room: its circuit is open (leads=False gives its layers)")
    heights = {layer.number: layer.z for layer in stackup.copper}
    pieces = [
        _raised(piece.path.flattened(tolerance), heights[piece.layer])
        for piece in coil.series
        if not isinstance(piece, Via)
    ]
    for before, after in pairwise(pieces):  # between layers the current goes straight down or up the via
        assert np.hypot(*(after[0] - before[-1])[:2]) < TOLERANCE, "pieces of a circuit that do not meet"
    points = np.vstack(pieces)
    apart = np.any(np.diff(points, axis=0) != 0.0, axis=1)
    return np.asarray(points[np.concatenate([[True], apart])])


def _raised(points: Sequence[Point], z: float) -> Array:
    flat = np.array(points, dtype=np.float64)
    return np.column_stack([flat, np.full(len(flat), z)])


def _positive(tolerance: float) -> float:
    if not 0.0 < tolerance < np.inf:
        raise ValueError("the tolerance is a positive length in metres")
    return tolerance


COPPER = "copper"


@record(eq=False)
class Area:
    """Something flat in its place: what it is (``copper``, ``board``, ``elastomer``, ``target``, ...), its shapely
    polygon and the heights (m) of its faces; of copper its layer from 1 at the top, and its net (empty for contacts in
    no circuit).
    """

    what: str
    polygon: shapely.Polygon | shapely.MultiPolygon
    lower: float
    upper: float
    layer: int | None = None
    net: str = ""


@checked_arguments
def areas(layout: Layout, tolerance: float = TOLERANCE) -> tuple[Area, ...]:
    """All copper with its holes, by layer and net, then board, stiffener, shield, jaw and what lies on the board, from
    below; arcs are chords within a tolerance (m).

    Copper is what is made of it: tracks with round ends, pads, holes, teardrops.

    Raises
    ------
    PartsError
        where a part has no place (a shield that does not fit into the standoff).
    ValueError
        for a tolerance that is no positive length.
    """
    _positive(tolerance)
    copper = tuple(_copper(layout, tolerance))
    bodies = []
    for body in stack(layout):
        holes = [hole.flattened(tolerance) for hole in body.region.holes]
        area = shapely.Polygon(body.region.outline.flattened(tolerance), holes)
        bodies.append(Area(body.name, area, *body.heights))
    return (*copper, *bodies)


def _copper(layout: Layout, tolerance: float) -> Iterator[Area]:
    """The copper of every layer as areas, one a net, holes drilled out."""
    for layer in layout.spec.fpc.stackup.copper:
        pieces = sorted(_pieces(layout, layer.number, tolerance), key=lambda piece: piece[0])
        drills = [
            shapely.Point(via.centre).buffer(via.drill / 2, _quarter(via.drill / 2, tolerance))
            for via in layout.vias_on(layer.number)
        ]
        bored = shapely.union_all(drills)
        for net, group in groupby(pieces, key=lambda piece: piece[0]):
            whole = shapely.union_all([shape for _, shape in group])
            half = layer.thickness / 2
            yield Area(COPPER, whole.difference(bored), layer.z - half, layer.z + half, layer.number, net)


def _pieces(layout: Layout, number: int, tolerance: float) -> Iterator[tuple[str, Any]]:
    for trace in layout.on_layer(number):
        line = shapely.LineString(trace.path.flattened(tolerance))
        yield trace.net, line.buffer(trace.width / 2, _quarter(trace.width / 2, tolerance))
    for via in layout.vias_on(number):
        yield via.net, shapely.Point(via.centre).buffer(via.pad / 2, _quarter(via.pad / 2, tolerance))
    for pad in layout.all_pads:
        if pad.layer == number:
            (x, y), (w, h) = pad.centre, pad.size
            yield pad.net, shapely.box(x - w / 2, y - h / 2, x + w / 2, y + h / 2)
    for drop in layout.teardrops:
        if drop.layer == number:
            yield drop.net, shapely.Polygon(drop.outline.flattened(tolerance))


def _quarter(radius: float, tolerance: float) -> int:
    """Chords of a quarter circle of a radius that stay within a tolerance (m)."""
    return max(2, math.ceil(math.pi / 4 / math.acos(max(0.0, 1.0 - tolerance / radius))))


COARSE = 5e-6
"""How far (m) the sides of solid copper may lie from the arcs that are drawn: each chord is a face."""

COPPER_COLOUR = "#d98a4b"


@checked_arguments
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
                rings = (polygon.exterior, *polygon.interiors)
                outer, *inner = (
                    bd.Wire.make_polygon([(x * MM, y * MM) for x, y in ring.coords[:-1]]) for ring in rings
                )
                shape = raised(bd.Face(outer, inner), area.lower, area.upper)
                name = f"{COPPER}-{area.layer}-{area.net}" if area.net else f"{COPPER}-{area.layer}"
                found.append(Solid(name, shape, "copper", COPPER_COLOUR, BodyRole.BOARD))
    return tuple(found)


@checked_arguments
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


@checked_arguments
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


@checked_arguments
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
