"""Triangle meshes of solids, tessellated by OpenCASCADE, proven closed by manifold3d, and what is measured of them:
clearances, and the closed pair of jaws against its port's circle. `sitscad.scene.fit.closed_section` says the latter of
the spec's figures alone, by an independent way that needs no CAD kernel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.arrays import Array
from sitscad.parts.solid import PartsError, Solid, require
from sitscad.record import record

CHORD = 0.005  # mm, how far a chord may stand off a curved face
TURN = 0.15  # rad, the largest step along a curve


class NotManifold(PartsError):
    """A tessellated solid that does not enclose a volume; never written to a file."""


@record(eq=False)
class TriangleMesh:
    """Vertices (n, 3) in millimetres as float64 and triangles (m, 3) as indices, outward by the right-hand rule."""

    name: str
    vertices: Array
    triangles: NDArray[np.int64]

    def on_bed(self) -> TriangleMesh:
        """The mesh moved into the positive octant, standing on z = 0, as printing programs expect."""
        return TriangleMesh(self.name, self.vertices - self.vertices.min(axis=0), self.triangles)


def tessellate(solid: Solid, chord: float = CHORD, turn: float = TURN) -> TriangleMesh:
    """A solid's closed mesh within `chord` (mm), by `turn` (rad), cached ones thrown away. Raises `NotManifold`."""
    clean = require("OCP.BRepTools").BRepTools.Clean_s
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
    """Vertices (n, 3; mm) and triangles (m, 3) of a meshed shape. To run through OpenCASCADE's array of triangles, as
    build123d does, takes ten times as long as to ask for each by its number.
    """
    tool, reversed_ = require("OCP.BRep").BRep_Tool, require("OCP.TopAbs").TopAbs_Orientation.TopAbs_REVERSED
    place = require("OCP.TopLoc").TopLoc_Location
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
def made(solids: tuple[Solid, ...]) -> tuple[TriangleMesh, ...]:
    """The meshes of solids that are printed: one tessellation for all formats of a package."""
    return tuple(tessellate(solid) for solid in solids)


@lru_cache(maxsize=1)
def seen(solids: tuple[Solid, ...]) -> tuple[TriangleMesh, ...]:
    """The meshes of solids that are looked at, not made: within 20 um of their faces, curves in steps of 20 degrees."""
    return tuple(tessellate(solid, 0.02, 0.35) for solid in solids)


def manifold(mesh: TriangleMesh) -> Any:
    """The mesh as a ``manifold3d.Manifold`` in double precision; raises `NotManifold`."""
    m3 = require("manifold3d")
    body = m3.Manifold(m3.Mesh64(vert_properties=mesh.vertices, tri_verts=mesh.triangles.astype("uint64")))
    if body.status() != m3.Error.NoError or body.volume() <= 0.0:
        raise NotManifold(f"the mesh of {mesh.name} is not closed ({body.status().name})")
    return body


SEARCH = 20.0  # mm, the distance beyond which two solids simply are far apart


@record
class Clearance:
    """Two solids and the shortest distance between them (m, 0 where they touch); at most `SEARCH` is looked for."""

    first: str
    second: str
    gap: float


TOUCHING = 1e-15
"""Solids that share no more than this (m3) touch."""


def overlaps(pieces: Sequence[tuple[Solid, Any]]) -> Iterator[tuple[Solid, Solid, Any, float]]:
    """Every two solids, each given with its mesh as a manifold, that share a volume: both, what their meshes share, and
    the volume (m3). The meshes find the pairs (manifold3d); since two chord meshes of one touching round face overlap
    by slivers, what they find is then settled on the exact shapes (OpenCASCADE).
    """
    for (first, a), (second, b) in combinations(pieces, 2):
        if box_gap(a, b) < 0.0:
            shared = a ^ b
            if float(shared.volume()) * 1e-9 > TOUCHING and (volume := shared_volume(first, second)) > TOUCHING:
                yield first, second, shared, volume


def box_gap(one: Any, other: Any) -> float:
    """How far (mm) the boxes of two meshes are apart along the axis on which it is most; negative where they meet."""
    a, b = one.bounding_box(), other.bounding_box()
    return float(max(max(a[k] - b[k + 3], b[k] - a[k + 3]) for k in range(3)))


def shared_volume(first: Solid, second: Solid) -> float:
    """Exact volume (m3) that two solids share."""
    shared = first.shape & second.shape
    return 1e-9 * sum(float(part.volume) for part in shared.solids()) if shared else 0.0
