"""Plane areas as linear triangles, made by gmsh.

gmsh is free software under the GPL; it is called here and nowhere else, and only when a resistance is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import gmsh
import numpy as np
from shapely import Polygon, remove_repeated_points

from sitscad.record import record

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
    with _session():
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


@contextmanager
def _session() -> Iterator[None]:
    """A gmsh model of our own, with every option that matters set; leaves a session that was open before as it was."""
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    for name, value in _OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.model.add("copper")
    try:
        yield
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()
