"""Resistance of extracted copper at direct current, from its areas alone.

Each layer is a sheet of conductivity times thickness; the potential in it solves Laplace's equation with no current
through the edges. Linear triangles (gmsh), one sparse solve (scipy). The finite-element potential is admissible, so by
Dirichlet's principle the conductance is never under-estimated: the resistance comes from below, with an error of second
order in the size of the triangles where no corner points inward.

gmsh is free software under the GPL; it is called here and in the `mesh` stage, and only when it is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import gmsh
import numpy as np
import shapely
from scipy import sparse
from scipy.sparse import csgraph
from scipy.sparse.linalg import spsolve
from shapely import Polygon, remove_repeated_points
from shapely.geometry.base import BaseGeometry

from sitscad.basics.record import record
from sitscad.files.extraction.artwork import PlottedHole
from sitscad.files.extraction.differences import BarePad, ExtractedNet
from sitscad.files.formats.volume_mesh import session

_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Geometry.Tolerance": 1e-9,
    "Mesh.Algorithm": 6,
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeExtendFromBoundary": 1,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeMin": 0,
    "Mesh.RandomSeed": 1,
}

_SAME = 1e-9
"""Corners nearer to each other than this (m) are one: triangles between them have no area, and conduct everything."""


@record
class Mesh:
    """Triangles in the plane: ``points`` [n, 2] in metres, ``triangles`` [m, 3] indices into them."""

    points: np.ndarray
    triangles: np.ndarray

    def stiffness(self) -> np.ndarray:
        """Each triangle's stiffness matrix [m, 3, 3] of Laplace's equation with linear shape functions.

        K_ij = e_i . e_j / (4 A), with e_i the side opposite to corner i (dimensionless in the plane).
        """
        corners = self.points[self.triangles]
        sides = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)
        twice_area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
        return np.einsum("mik,mjk->mij", sides, sides) / (2.0 * np.abs(twice_area))[:, None, None]


def triangulate(area: Polygon, size: float) -> Mesh:
    """Triangles that fill a polygon (m), none longer than about `size` (m); equal polygons give equal triangles."""
    with session(gmsh, "copper"):
        for option, value in _OPTIONS.items():
            gmsh.option.setNumber(option, value)
        area = remove_repeated_points(area, _SAME)
        millimetres = [np.asarray(ring.coords)[:-1] * 1e3 for ring in (area.exterior, *area.interiors)]
        gmsh.option.setNumber("Mesh.MeshSizeMax", size * 1e3)
        gmsh.model.geo.addPlaneSurface([_loop(ring) for ring in millimetres])
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, corners = gmsh.model.mesh.getElementsByType(2)
    number = np.zeros(int(tags.max()) + 1, dtype=int)
    number[tags.astype(int)] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)[:, :2] * 1e-3
    return Mesh(points, number[corners.astype(int)].reshape(-1, 3))


def _loop(corners: np.ndarray) -> int:
    points = [gmsh.model.geo.addPoint(x, y, 0.0) for x, y in corners]
    lines = [gmsh.model.geo.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    return int(gmsh.model.geo.addCurveLoop(lines))


COPPER_RESISTIVITY = 1.7241e-8
"""Annealed copper at 20 C (ohm m): 100 % IACS, 1/58 ohm mm2/m (IEC 60028)."""

PERFECT_BARREL = 1e9
"""Conductance (S) of a barrel whose plating or depth is not given: a millionth of the resistance of any real one."""

CLEANING = 5e-8
"""How far (m) an outline may be moved before it is meshed, so that chords of nanometres do not become triangles."""


def copper_resistance(
    net: ExtractedNet,
    start: BarePad,
    end: BarePad,
    thickness: Sequence[float],
    *,
    resistivity: float = COPPER_RESISTIVITY,
    depths: Sequence[float] | None = None,
    plating: float | None = None,
    fineness: float = 2.0,
) -> float:
    """Resistance (ohm) of a net's copper between two of its contacts, each with all its area at one potential.

    ``thickness`` (m) is each copper layer's, top
    first. With ``depths`` (m, each layer's mid-plane) and ``plating`` (m, the wall inside the drilled hole) the barrels
    have their resistance, else none. ``fineness`` is the number of triangles across a track of the net's mean width.
    Raises ValueError when the contacts are not two of this net, when no copper joins them, or when a layer's thickness
    or depth is not given.
    """
    layers = max(piece.layer for piece in net.pieces)
    if len(thickness) < layers or (depths is not None and len(depths) < layers):
        raise ValueError(f"the net reaches copper layer {layers}: a thickness and a depth are needed for each")
    own = [(contact.pin, contact.layer) for contact in net.contacts]
    if start == end or any((contact.pin, contact.layer) not in own for contact in (start, end)):
        raise ValueError("the resistance is asked for between two different contacts of one net")
    nodes = _Nodes(net, (start, end))
    size = (
        2.0 * sum(piece.shape.area for piece in net.pieces) / sum(piece.shape.length for piece in net.pieces)
    ) / fineness
    circuit = _Circuit(2 + len(nodes.barrels))
    for piece in net.pieces:
        for part in _conducting(piece.shape, piece.layer, net.holes, (start, end)):
            mesh = triangulate(part, size)
            circuit.add_sheet(mesh, nodes.of(mesh.points, piece.layer), thickness[piece.layer - 1] / resistivity)
    for a, b, hole, upper, lower in nodes.hops(net.holes):
        length = abs(depths[upper - 1] - depths[lower - 1]) if depths else 0.0
        circuit.add_conductor(a, b, _barrel_conductance(hole.diameter, length, plating, resistivity))
    return 1.0 / circuit.conductance()


def _barrel_conductance(diameter: float, length: float, plating: float | None, resistivity: float) -> float:
    """Conductance (S) of a stretch of plated barrel: a tube whose outer diameter is the drill's."""
    if not plating or not length:
        return PERFECT_BARREL
    return math.pi * (diameter - plating) * plating / (resistivity * length)


def _conducting(
    shape: Polygon, layer: int, holes: Sequence[PlottedHole], contacts: Sequence[BarePad]
) -> Iterator[Polygon]:
    """The parts of a piece in which the potential varies: without the drilled holes and without the contacts' pads."""
    taken = [hole.shape for hole in holes if layer in hole.layers]
    taken += [contact.shape for contact in contacts if contact.layer == layer]
    left = shape.difference(shapely.union_all(taken)).simplify(CLEANING)
    for part in shapely.get_parts(left):
        if isinstance(part, Polygon) and part.area > CLEANING**2:
            yield part


class _Nodes:
    """Numbers of the equipotential nodes: 0 and 1 are the contacts, then one for each plated hole on each layer."""

    def __init__(self, net: ExtractedNet, contacts: tuple[BarePad, BarePad]) -> None:
        self._contacts = contacts
        self.barrels: list[tuple[PlottedHole, int]] = [(hole, layer) for hole in net.holes for layer in hole.layers]

    def _shapes(self, layer: int) -> Iterator[tuple[int, BaseGeometry]]:
        """The shapes of holes and contacts on a layer, each with its node's number."""
        for number, (hole, own) in enumerate(self.barrels, start=2):
            if own == layer:
                yield self._merged(number), hole.shape
        for number, contact in enumerate(self._contacts):
            if contact.layer == layer:
                yield number, contact.shape

    def _merged(self, number: int) -> int:
        """The contact's node for a hole that is drilled through the contact's pad."""
        hole, layer = self.barrels[number - 2]
        for contact_number, contact in enumerate(self._contacts):
            if contact.layer == layer and hole.shape.intersects(contact.shape):
                return contact_number
        return number

    def of(self, points: np.ndarray, layer: int) -> np.ndarray:
        """For each point [n, 2] of a layer's mesh the node on whose edge it lies, or -1."""
        result = np.full(len(points), -1)
        for number, shape in self._shapes(layer):
            result[shapely.dwithin(shapely.points(points), shape, 2.0 * CLEANING)] = number
        return result

    def hops(self, holes: Sequence[PlottedHole]) -> Iterator[tuple[int, int, PlottedHole, int, int]]:
        """Every stretch of barrel between neighbouring layers: its two nodes, its hole, upper and lower layer."""
        number = {(id(hole), layer): n for n, (hole, layer) in enumerate(self.barrels, start=2)}
        for hole in holes:
            for upper, lower in pairwise(hole.layers):
                a, b = self._merged(number[id(hole), upper]), self._merged(number[id(hole), lower])
                yield a, b, hole, upper, lower


class _Circuit:
    """Sheets and conductors between equipotential nodes; node 0 is held at one volt, node 1 at none."""

    def __init__(self, nodes: int) -> None:
        self._count = nodes
        self._rows: list[np.ndarray] = []
        self._columns: list[np.ndarray] = []
        self._values: list[np.ndarray] = []

    def add_sheet(self, mesh: Mesh, nodes: np.ndarray, conductance: float) -> None:
        """Add a meshed sheet of a conductance per square (S); `nodes` [n] names the node of each point, or -1."""
        free = nodes < 0
        number = nodes.copy()
        number[free] = self._count + np.arange(free.sum())
        self._count += int(free.sum())
        corners = number[mesh.triangles]
        self._rows.append(np.repeat(corners, 3, axis=1).ravel())
        self._columns.append(np.tile(corners, (1, 3)).ravel())
        self._values.append(conductance * mesh.stiffness().ravel())

    def add_conductor(self, a: int, b: int, conductance: float) -> None:
        """Add a conductor (S) between two nodes."""
        self._rows.append(np.array([a, b, a, b]))
        self._columns.append(np.array([a, b, b, a]))
        self._values.append(conductance * np.array([1.0, 1.0, -1.0, -1.0]))

    def conductance(self) -> float:
        """Conductance (S) between nodes 0 and 1. Raises ValueError when no copper joins them."""
        entries = np.concatenate(self._values), (np.concatenate(self._rows), np.concatenate(self._columns))
        matrix = sparse.csr_matrix(entries, shape=(self._count, self._count))
        _, part = csgraph.connected_components(matrix, directed=False)
        if part[0] != part[1]:
            raise ValueError("no copper joins the two contacts")
        inner = np.flatnonzero(part == part[0])
        inner = inner[inner > 1]
        potential = np.zeros(self._count)
        potential[0] = 1.0
        if len(inner):
            potential[inner] = spsolve(matrix[inner][:, inner].tocsc(), -matrix[inner][:, [0]].toarray().ravel())
        return float(potential @ (matrix @ potential))
