"""Solids: named, coloured parts of the sensor or its mount.

Plane paths and regions become build123d faces and prisms. Inputs are in metres, shapes in millimetres. The packages of
``sitscad[all]`` are imported only when a solid or a mesh is needed. OpenCASCADE makes the meshes, and manifold3d proves
that they are closed.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property, lru_cache
from importlib import import_module
from importlib.util import find_spec
from itertools import combinations
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.places.bodies import PartsError as PartsError
from sitscad.basics.arrays import Array
from sitscad.basics.errors import ExpectedError
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Arc, Path, Point, Region, rounded_polygon

_MEND = "pip install 'sitscad[all]'"
_SYSTEM_LIBRARIES = "libgl1 libxrender1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"


class MissingExtra(ExpectedError, ImportError):
    """Raised if an optional package is missing or cannot be loaded. The text states how to install it."""


UNUSED = ("sympy", "vtk")
"""Packages that build123d and cadquery import, but sitscad does not use. Their import takes half a second."""


class _LazyModule(ModuleType):
    """A package that is imported at the first access to its attributes."""

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        module = import_module(self.__name__)
        self.__dict__.update(vars(module))
        return getattr(module, name)


def import_extra(package: str) -> ModuleType:
    """Import an optional package and return it.

    Raises `MissingExtra` with a one-sentence text if it is missing or cannot be loaded.
    """
    if package not in sys.modules:
        for name in UNUSED:
            if name not in sys.modules and (spec := find_spec(name)) is not None:
                sys.modules[name] = _LazyModule(name)
                sys.modules[name].__spec__ = spec
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        if error.name in (package, package.partition(".")[0]):
            text = f"solids and meshes need {package}, which is not installed: {_MEND}"
        else:
            text = f"{package} is installed without {error.name}, which it needs: {_MEND}"
        raise MissingExtra(text, name=package) from error
    except (ImportError, OSError) as error:
        cause: BaseException | None = error  # compiled packages that are loading turn a Ctrl-C into an ImportError
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__cause__ or cause.__context__
        if cause is not None:
            raise KeyboardInterrupt from error
        raise MissingExtra(
            f"{package} cannot be loaded ({error}): {_MEND}; on Debian also apt-get install {_SYSTEM_LIBRARIES}",
            name=package,
        ) from error


@record
class Solid:
    """One piece in its place in the sensor.

    `shape` is a build123d ``Solid`` in **millimetres**, the CAD unit (all else in sitscad is SI). The axis x runs along
    the jaw towards the handle, y across the jaw. z = 0 is the board's top face. `colour` is ``#rrggbb``.
    """

    name: str
    shape: Any
    material: str
    colour: str
    role: BodyRole

    @cached_property
    def volume(self) -> float:
        """Exact volume (m3)."""
        return float(self.shape.volume) * 1e-9

    @property
    def rgb(self) -> tuple[float, float, float]:
        """Colour as three numbers from 0 to 1."""
        red, green, blue = (int(self.colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
        return red, green, blue

    @property
    def linear_rgb(self) -> tuple[float, float, float]:
        """Colour as linear light (inverse of IEC 61966-2-1), the input of glTF and build123d."""
        red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in self.rgb)
        return red, green, blue


def select_by_role(solids: tuple[Solid, ...], *roles: BodyRole) -> tuple[Solid, ...]:
    """Return the solids with one of the roles, in their order."""
    return tuple(solid for solid in solids if solid.role in roles)


def sort_by_height(solids: Iterable[Solid]) -> list[Solid]:
    """Return solids in the order of the heights of their lowest corners, rounded to a nanometre."""
    return sorted(solids, key=lambda solid: round(min(corner.Z for corner in solid.shape.vertices()), 6))


MM = 1e3


def face(region: Region) -> Any:
    """Return the build123d face of a region in the plane z = 0. Arcs stay arcs."""
    bd = import_extra("build123d")
    return bd.Face(_wire(region.outline), [_wire(hole) for hole in region.holes])


def prism(region: Region | Path, lower: float, upper: float) -> Any:
    """Return a region extruded from height `lower` to `upper` (m), as a build123d solid."""
    shape = face(region if isinstance(region, Region) else Region(region))
    return extrude_face(shape, lower, upper)


def extrude_face(shape: Any, lower: float, upper: float) -> Any:
    """Return a build123d face in the plane z = 0, extruded from height `lower` to `upper` (m)."""
    bd = import_extra("build123d")
    upright = shape if shape.normal_at().Z > 0 else -shape
    return bd.Solid.extrude(upright.moved(bd.Location((0, 0, lower * MM))), bd.Vector(0, 0, (upper - lower) * MM))


def box(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> Any:
    """Return an upright box between two corners (m), as a build123d solid."""
    bd = import_extra("build123d")
    corner = bd.Plane((x0 * MM, y0 * MM, z0 * MM))
    return bd.Solid.make_box((x1 - x0) * MM, (y1 - y0) * MM, (z1 - z0) * MM, corner)


def extrude_along_jaw(section: Path, x0: float, x1: float, y: float, z: float) -> Any:
    """Return a closed path across the jaw, extruded along the jaw from x0 to x1 (m), as a build123d solid.

    The path's x becomes y, and its y becomes z. Its origin is at (y, z).
    """
    bd = import_extra("build123d")
    stand = bd.Plane((x0 * MM, y * MM, z * MM), x_dir=(0, 1, 0), z_dir=(1, 0, 0))
    return prism(section, 0.0, x1 - x0).moved(bd.Location(stand))


def rounded_at_tip(x0: float, y0: float, x1: float, y1: float, radius: float) -> Path:
    """Return the rectangle between (x0, y0) and (x1, y1) (m). Corners at x0, the jaw's tip, have a `radius` (m)."""
    corners = [Point(x0, y0), Point(x1, y0), Point(x1, y1), Point(x0, y1)]
    return rounded_polygon(corners, [radius, 0.0, 0.0, radius])


def one_solid(shape: Any, what: str) -> Any:
    """Return the single solid in the result of a boolean operation. Raises `PartsError` if there is none or several.

    `what` is the part's name for the message.
    """
    solids = shape.solids() if shape is not None else []
    if len(solids) != 1:
        raise PartsError(f"the {what} falls into {len(solids)} pieces; its parts in the spec do not join")
    return solids[0]


def subtract(shape: Any, cuts: Iterable[Any], what: str) -> Any:
    """Return a solid minus other solids, which may overlap. Raises `PartsError` if no solid or several solids remain.

    `what` is the part's name for the message. All solids are subtracted in one operation, which takes half the time of
    single operations.
    """
    tools = list(cuts)
    return one_solid(shape.cut(*tools), what) if tools else shape


def tapered_solid(lower: Path, upper: Path, z0: float, z1: float) -> Any:
    """Return a solid with straight inclined walls from an outline at height `z0` to another at height `z1` (m)."""
    bd, outlines = import_extra("build123d"), ((lower, z0), (upper, z1))
    ends = [face(Region(path)).moved(bd.Location((0, 0, z * MM))).outer_wire() for path, z in outlines]
    return bd.Solid.make_loft(ends, ruled=True)


def top_edges(shape: Any) -> Any:
    """Return the edges in a solid's highest plane."""
    top = shape.bounding_box().max.Z
    lowest = [(edge, float(edge.bounding_box().min.Z)) for edge in shape.edges()]
    return [edge for edge, z in lowest if z > top - 1e-6]


def _wire(path: Path) -> Any:
    """Return the path as a build123d wire (mm), built edge by edge.

    With a list of edges, OpenCASCADE joins ends in the order of memory addresses, so that the last digits vary.
    """
    bd, wire = import_extra("build123d"), import_extra("OCP.BRepBuilderAPI").BRepBuilderAPI_MakeWire()
    for segment in path:
        is_arc = isinstance(segment, Arc)
        places = [segment.at(t) for t in (0.0, 0.5, 1.0)] if is_arc else [segment.start, segment.end]
        make = bd.Edge.make_three_point_arc if is_arc else bd.Edge.make_line
        wire.Add(make(*((point.x * MM, point.y * MM) for point in places)).wrapped)
        if not wire.IsDone():
            raise ValueError("the segments of a path do not join")
    return bd.Wire(wire.Wire())


CHORD = 0.005  # mm, how far a chord may stand off a curved face
"""Largest distance (mm) between a curved face and the mesh."""
TURN = 0.15  # rad, the largest step along a curve
"""Largest angle (rad) between neighbouring chords along a curve."""


class NotManifold(PartsError):
    """Raised for a mesh that does not enclose a volume. Such a mesh is never written to a file."""


@record(eq=False)
class TriangleMesh:
    """Vertices (n, 3; mm) as float64, and triangles (m, 3) as indices. Normals point outwards (right-hand rule)."""

    name: str
    vertices: Array
    triangles: NDArray[np.int64]

    def on_bed(self) -> TriangleMesh:
        """Return the mesh moved to positive coordinates, with its lowest point at z = 0, for printing programs."""
        return TriangleMesh(self.name, self.vertices - self.vertices.min(axis=0), self.triangles)


def tessellate(solid: Solid, chord: float = CHORD, turn: float = TURN) -> TriangleMesh:
    """Return a solid's closed mesh, with errors up to `chord` (mm) and `turn` (rad). Raises `NotManifold`.

    Meshes that the CAD kernel caches with the solid are deleted before and after.
    """
    clean = import_extra("OCP.BRepTools").BRepTools.Clean_s
    clean(solid.shape.wrapped)
    solid.shape.mesh(chord, turn)
    vertices, triangles = _faces(solid.shape)
    clean(solid.shape.wrapped)
    # Faces come one by one: points of equal place (within 1e-6 mm) become one vertex, in order of first use
    _, first, inverse = np.unique(np.round(vertices, 6), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    joined = rank[inverse.reshape(-1)][triangles]
    whole = (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
    mesh = TriangleMesh(solid.name, np.round(vertices[first[order]], 6) + 0.0, joined[whole])
    manifold(mesh)
    return mesh


def _faces(shape: Any) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (n, 3; mm) and triangles (m, 3) of a meshed shape.

    Iteration over OpenCASCADE's array of triangles, as in build123d, takes ten times as long as access by number.
    """
    tool, reversed_ = import_extra("OCP.BRep").BRep_Tool, import_extra("OCP.TopAbs").TopAbs_Orientation.TopAbs_REVERSED
    place = import_extra("OCP.TopLoc").TopLoc_Location
    vertices: list[tuple[float, float, float]] = []
    triangles: list[NDArray[np.int64]] = []
    for face in shape.faces():
        where, before = place(), len(vertices) - 1  # nodes count from 1
        net = tool.Triangulation_s(face.wrapped, where)
        still, moved = where.IsIdentity(), where.Transformation()
        nodes = map(net.Node, range(1, net.NbNodes() + 1))
        vertices += [(node if still else node.Transformed(moved)).Coord() for node in nodes]
        corners = np.array([net.Triangle(k).Get() for k in range(1, net.NbTriangles() + 1)]) + before
        triangles.append(corners[:, [0, 2, 1]] if face.wrapped.Orientation() == reversed_ else corners)
    return np.array(vertices), np.concatenate(triangles)


@lru_cache(maxsize=1)
def printed_meshes(solids: tuple[Solid, ...]) -> tuple[TriangleMesh, ...]:
    """Return the meshes of printed solids. They are computed once for all file formats of a package."""
    return tuple(tessellate(solid) for solid in solids)


@lru_cache(maxsize=1)
def display_meshes(solids: tuple[Solid, ...]) -> tuple[TriangleMesh, ...]:
    """Return the meshes of solids for display, with errors up to 20 um, and 20 degrees between neighbouring chords."""
    return tuple(tessellate(solid, 0.02, 0.35) for solid in solids)


def manifold(mesh: TriangleMesh) -> Any:
    """Return the mesh as a ``manifold3d.Manifold`` in double precision. Raises `NotManifold` if it is not closed."""
    m3 = import_extra("manifold3d")
    body = m3.Manifold(m3.Mesh64(vert_properties=mesh.vertices, tri_verts=mesh.triangles.astype("uint64")))
    if body.status() != m3.Error.NoError or body.volume() <= 0.0:
        raise NotManifold(f"the mesh of {mesh.name} is not closed ({body.status().name})")
    return body


SEARCH = 20.0  # mm, the distance beyond which two solids simply are far apart
"""Distance (mm) above which distances between solids are not computed."""


@record
class Clearance:
    """Names of two solids and the smallest distance (m) between them. 0 if they touch.

    Larger values than `SEARCH` are cut off.
    """

    first: str
    second: str
    gap: float


TOUCHING = 1e-15
"""Largest volume (m3) that two solids may share and still count as touching."""


def overlaps(pieces: Sequence[tuple[Solid, Any]]) -> Iterator[tuple[Solid, Solid, Any, float]]:
    """Yield each pair of solids that overlap: both solids, the overlap of their meshes, and its exact volume (m3).

    `pieces` are solids with their meshes as manifolds. Meshes find candidates. Round faces that touch also overlap in
    their meshes, because chords replace arcs. Each candidate is therefore confirmed with the exact shapes
    (OpenCASCADE).
    """
    for (first, a), (second, b) in combinations(pieces, 2):
        if box_gap(a, b) < 0.0:
            shared = a ^ b
            if float(shared.volume()) * 1e-9 > TOUCHING and (volume := shared_volume(first, second)) > TOUCHING:
                yield first, second, shared, volume


def box_gap(first: Any, second: Any) -> float:
    """Return the largest of the gaps (mm) along x, y and z between the bounding boxes of two meshes.

    Negative if the boxes intersect.
    """
    a, b = first.bounding_box(), second.bounding_box()
    return float(max(max(a[k] - b[k + 3], b[k] - a[k + 3]) for k in range(3)))


def shared_volume(first: Solid, second: Solid) -> float:
    """Return the exact volume (m3) that two solids share."""
    shared = first.shape & second.shape
    return 1e-9 * sum(float(part.volume) for part in shared.solids()) if shared else 0.0
