"""Geometry of a layout for other programs: centre lines, current paths, areas and solids.

All coordinates are in the board's frame: x along the jaw towards the tail, y across the jaw, z away from the board's
top face. The top face is z = 0, and copper lies below. The origin is the spec's: the middle of the array, unless the
spec states the coils' centres. Lengths are metres. Solids are in millimetres, as CAD programs expect.
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
from sitscad.assembly.solids.solid import MM, Solid, extrude_face, import_extra
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Path, Point, Segment
from sitscad.layout.board import Coil, Layout, Via
from sitscad.spec.circuit import Stackup

TOLERANCE = 1e-6
"""Default for the largest distance (m) of chords from an arc."""


@record
class CentreLine:
    """Centre line of one layer's track, in the direction of the coil's current.

    ``coil`` is the coil's name (C1, C2, ...), and ``layer`` the copper layer from 1 at the top. ``z`` is the height of
    the middle of the copper; ``width`` and ``thickness`` describe the track, all in metres. ``path`` has straight
    pieces and arcs as drawn.
    """

    coil: str
    layer: int
    z: float
    width: float
    thickness: float
    path: Path

    def __repr__(self) -> str:
        """Return a line of text with coil, layer and length."""
        return f"<CentreLine of {self.coil} on layer {self.layer}: {1e3 * self.length:.4g} mm>"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Lines and arcs in order. Each begins at the end of the previous segment."""
        return self.path.segments

    @property
    def length(self) -> float:
        """Length (m) of the line, with exact arcs."""
        return self.path.length

    def points(self, tolerance: float = TOLERANCE) -> Array:
        """Return points (n, 3; m) whose chords stay within a tolerance (m) of the line."""
        return _raised(self.path.flattened(_positive(tolerance)), self.z)


@record(eq=False)
class CurrentPath:
    """Polyline that carries a current.

    ``points`` (n, 3; m) are in the direction of ``current`` (A). ``coil`` is the coil's name, and ``layer`` the copper
    layer, or None if the path passes through several layers.
    """

    coil: str
    layer: int | None
    points: Array
    current: float

    def __repr__(self) -> str:
        """Return a line of text with coil, number of points and current."""
        return f"<CurrentPath of {self.coil}: {len(self.points)} points, {self.current:.4g} A>"


@checked_arguments
def centre_lines(layout: Layout) -> tuple[CentreLine, ...]:
    """Return the centre lines of all layers of all coils.

    They are in the order of the coils, and for each coil in the order of its current.

    Parameters
    ----------
    layout
        The layout of a sensor.

    Returns
    -------
    tuple of CentreLine
        Lines with coil, layer, width and height (m).

    Examples
    --------
    >>> import sitscad
    >>> coil = {"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...         "trace_width": "100 um", "trace_spacing": "100 um"}
    >>> spec = sitscad.SensorSpec.from_mapping(name="bench", coil=coil)
    >>> [line.layer for line in sitscad.centre_lines(sitscad.lay_out(spec))]
    [1, 2]
    """
    return tuple(
        CentreLine(coil.name, winding.layer, winding.z, (coil.placement.own or layout.spec.coil).trace_width,
                   winding.thickness, winding.path)
        for coil in layout.coils
        for winding in coil.windings
    )


@checked_arguments
def current_paths(
    layout: Layout, current: float = 1.0, leads: bool = True, tolerance: float = TOLERANCE
) -> tuple[CurrentPath, ...]:
    """Return the coils as filaments for a field program.

    Parameters
    ----------
    layout
        The layout.
    current
        Current (A). It enters at contact A, which leads to the outer end of layer 1.
    leads
        If true, there is one path per coil, from its contact A through stubs, layers and vias to its contact B.
        The tail is straight. If false, there is one path per layer, and the paths are not joined.
    tolerance
        Largest distance (m) of chords from the middle of the copper.

    Returns
    -------
    tuple of CurrentPath
        Points (n, 3; m) of each path with its current.

    Raises
    ------
    ValueError
        with `leads`, if the leads of a coil found no room on the board and its circuit is open.
        Also for a tolerance that is no positive length.
    """
    _positive(tolerance)
    if leads:
        stackup = layout.spec.fpc.stackup
        return tuple(CurrentPath(c.name, None, _circuit(c, stackup, tolerance), float(current)) for c in layout.coils)
    return tuple(
        CurrentPath(line.coil, line.layer, line.points(tolerance), float(current)) for line in centre_lines(layout)
    )


def _circuit(coil: Coil, stackup: Stackup, tolerance: float) -> Array:
    """Return a coil's whole circuit, leads included, as points (n, 3; m). Raises ValueError if it is open."""
    if not coil.is_closed_circuit:
        raise ValueError(f"the leads of {coil.name} found no room: its circuit is open (leads=False gives its layers)")
    heights = {layer.number: layer.z for layer in stackup.copper}
    pieces = [
        _raised(piece.path.flattened(tolerance), heights[piece.layer])
        for piece in coil.series
        if not isinstance(piece, Via)
    ]
    for before, after in pairwise(pieces):  # between layers the current flows vertically through the via
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
    """Flat body in its place: copper of one net and layer, or another part.

    Attributes
    ----------
    what
        Kind of body: ``copper``, ``board``, ``elastomer``, ``target``, ...
    polygon
        Its outline as a shapely polygon (m).
    lower, upper
        Heights (m) of its faces.
    layer
        Copper layer from 1 at the top. None for other bodies.
    net
        Net of copper. Empty for contacts in no circuit, and for other bodies.
    """

    what: str
    polygon: shapely.Polygon | shapely.MultiPolygon
    lower: float
    upper: float
    layer: int | None = None
    net: str = ""


@checked_arguments
def areas(layout: Layout, tolerance: float = TOLERANCE) -> tuple[Area, ...]:
    """Return all copper with its holes by layer and net, then board, stiffener, shield, jaw and parts on the board.

    The parts are in order from below. Arcs are chords within `tolerance` (m). Copper comprises tracks with round ends,
    pads and teardrops, without the drilled holes.

    Parameters
    ----------
    layout
        The layout of a sensor.
    tolerance
        Largest distance (m) of a chord from its arc.

    Returns
    -------
    tuple of Area
        Outlines with holes (m), and heights.

    Raises
    ------
    PartsError
        if a part has no place (a shield that does not fit into the standoff).
    ValueError
        for a tolerance that is no positive length.

    Examples
    --------
    >>> import sitscad
    >>> coil = {"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...         "trace_width": "100 um", "trace_spacing": "100 um"}
    >>> spec = sitscad.SensorSpec.from_mapping(name="bench", coil=coil)
    >>> [(area.what, area.layer) for area in sitscad.areas(sitscad.lay_out(spec))][:2]
    [('copper', 1), ('copper', 2)]
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
    """Yield the copper of every layer as areas, one per net, without the drilled holes."""
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
    """Return the number of chords of a quarter circle that stay within a tolerance (m)."""
    return max(2, math.ceil(math.pi / 4 / math.acos(max(0.0, 1.0 - tolerance / radius))))


COARSE = 5e-6
"""Default for the largest distance (m) between an arc and the chords that replace it in copper solids.

Each chord becomes a face.
"""

COPPER_COLOUR = "#d98a4b"


@checked_arguments
def copper_solids(layout: Layout, tolerance: float = COARSE) -> tuple[Solid, ...]:
    """Return the copper of every layer and net as build123d solids (mm), in place.

    Arcs are chords within `tolerance` (m). Names are like ``copper-1-COIL_C1``. The plating of holes is left out.

    Parameters
    ----------
    layout
        The layout of a sensor.
    tolerance
        Largest distance (m) of a chord from its arc.

    Returns
    -------
    tuple of Solid
        A solid for each layer and net.

    Raises
    ------
    MissingExtra
        without shapely or a CAD kernel (`pip install 'sitscad[all]'`).
    ValueError
        for a tolerance that is no positive length.
    """
    bd = import_extra("build123d")
    solids = []
    for area in areas(layout, tolerance):
        if area.what == COPPER:
            for polygon in getattr(area.polygon, "geoms", (area.polygon,)):
                rings = (polygon.exterior, *polygon.interiors)
                outer, *inner = (
                    bd.Wire.make_polygon([(x * MM, y * MM) for x, y in ring.coords[:-1]]) for ring in rings
                )
                shape = extrude_face(bd.Face(outer, inner), area.lower, area.upper)
                name = f"{COPPER}-{area.layer}-{area.net}" if area.net else f"{COPPER}-{area.layer}"
                solids.append(Solid(name, shape, "copper", COPPER_COLOUR, BodyRole.BOARD))
    return tuple(solids)


@checked_arguments
def as_cadquery(solids: Iterable[Solid]) -> dict[str, Any]:
    """Return solids by name as CadQuery workplanes (mm), in place. Solids of equal name share a workplane.

    Parameters
    ----------
    solids
        Solids, like the result of `sitscad.solids`.

    Returns
    -------
    dict
        Workplanes by name.

    Raises
    ------
    MissingExtra
        without CadQuery
    """
    cq = import_extra("cadquery")
    objects: dict[str, Any] = {}
    for solid in solids:
        shape = cq.Shape.cast(solid.shape.wrapped)
        objects[solid.name] = objects[solid.name].add(shape) if solid.name in objects else cq.Workplane(obj=shape)
    return objects


@checked_arguments
def as_cadquery_assembly(solids: Iterable[Solid], name: str = "sensor") -> Any:
    """Return solids as one ``cadquery.Assembly`` (mm), in place.

    There is a child for every name, with its colour, and its material in ``metadata``. Solids of equal name form one
    compound. The shapes are not copied.

    Parameters
    ----------
    solids
        Solids, like the result of `sitscad.solids`.
    name
        Name of the assembly.

    Returns
    -------
    cadquery.Assembly
        The assembly of all solids.

    Raises
    ------
    MissingExtra
        without CadQuery
    """
    cq = import_extra("cadquery")
    whole = cq.Assembly(name=name)
    for called, pieces in _by_name(solids).items():
        shapes = [cq.Shape.cast(piece.shape.wrapped) for piece in pieces]
        shape = shapes[0] if len(shapes) == 1 else cq.Compound.makeCompound(shapes)
        whole.add(shape, name=called, color=cq.Color(*pieces[0].rgb), metadata={"material": pieces[0].material})
    return whole


@checked_arguments
def as_build123d(solids: Iterable[Solid], name: str = "sensor") -> Any:
    """Return solids as one ``build123d.Compound`` (mm), in place.

    Its children have labels and colours, which build123d exports. Solids of equal name form one compound. The geometry
    of the shapes is shared. The solids themselves get no label and no parent.

    Parameters
    ----------
    solids
        Solids, like the result of `sitscad.solids`.
    name
        Label of the compound.

    Returns
    -------
    build123d.Compound
        The compound of all solids.

    Raises
    ------
    MissingExtra
        without build123d
    """
    bd = import_extra("build123d")
    children = []
    for called, pieces in _by_name(solids).items():
        shapes = [bd.Solid(piece.shape.wrapped) for piece in pieces]
        child = shapes[0] if len(shapes) == 1 else bd.Part(shapes)
        child.label, child.color = called, bd.Color(*pieces[0].linear_rgb)
        children.append(child)
    return bd.Compound(label=name, children=children)


def _by_name(solids: Iterable[Solid]) -> dict[str, list[Solid]]:
    """Return solids grouped by name, in the order of the names' first occurrence."""
    groups: dict[str, list[Solid]] = {}
    for solid in solids:
        groups.setdefault(solid.name, []).append(solid)
    return groups
