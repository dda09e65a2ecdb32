"""Triangle meshes of solids: tessellated by OpenCASCADE, proven closed by manifold3d."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.parts.extras import require
from sitscad.parts.solid import PartsError, Solid
from sitscad.record import record

CHORD = 0.005  # mm, how far a chord may stand off a curved face
TURN = 0.15  # rad, the largest step along a curve


class NotManifold(PartsError):
    """A tessellated solid that does not enclose a volume; never written to a file."""


@record(eq=False)
class TriangleMesh:
    """Vertices (n, 3) in millimetres as float64 and triangles (m, 3) as indices, outward by the right-hand rule."""

    name: str
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]

    def on_bed(self) -> TriangleMesh:
        """The same mesh moved into the positive octant, standing on z = 0, as printing programs expect."""
        return TriangleMesh(self.name, self.vertices - self.vertices.min(axis=0), self.triangles)


def tessellate(solid: Solid, chord: float = CHORD, turn: float = TURN) -> TriangleMesh:
    """A solid's closed mesh within `chord` (mm) of its faces, curves in steps of at most `turn` (rad).

    Raises `NotManifold`. Cached triangles are thrown away first: they depend on what was asked of the shape before.
    """
    clean = require("OCP.BRepTools").BRepTools.Clean_s
    clean(solid.shape.wrapped)
    points, triangles = solid.shape.tessellate(chord, turn)
    clean(solid.shape.wrapped)
    vertices = np.array([(p.X, p.Y, p.Z) for p in points])
    return _welded(solid.name, vertices, np.array(triangles))


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


def _welded(name: str, vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> TriangleMesh:
    """Faces come one by one: points of equal place (within 1e-6 mm) become one vertex, in order of first use."""
    _, first, inverse = np.unique(np.round(vertices, 6), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    joined = rank[inverse.reshape(-1)][triangles]
    whole = (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
    mesh = TriangleMesh(name, np.round(vertices[first[order]], 6) + 0.0, joined[whole])
    manifold(mesh)
    return mesh
