"""Solids drawn apart in parallel projection: from the bottom up, each by a depth buffer of its own (`rendered`).

Solids lie on top of one another, and drawn apart they are in each other's way only as the upper one hides the lower.
"""

from __future__ import annotations

import math

import numpy as np

from sitscad.drawing.pictures.rendered import Coloured, camera, fitted, rendered
from sitscad.drawing.sheet import Sheet
from sitscad.parts.mesh import TriangleMesh, manifold, tessellate
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import BodyRole

CHORD, TURN = 0.02, 0.5  # mm, rad: a picture's mesh
AZIMUTH, ELEVATION = math.radians(28.0), math.radians(32.0)  # the viewer stands towards +x and -y, above
INK = "#22303c"
TRANSLUCENT = 0.6
"""Opacity of the film, through which the pieces below it are seen."""


def exploded(sheet: Sheet, solids: tuple[Solid, ...], width: float, height: float) -> tuple[float, float]:
    """Draw the solids apart along z, as large as fits into width and height (pixels), downwards from y = 0; what the
    drawing takes of both.
    """
    meshes = [(solid, _coloured(solid, mesh)) for solid, mesh in _lifted(_trimmed(solids))]
    every = [mesh for _, mesh in meshes]
    view = fitted(every, camera(AZIMUTH, ELEVATION), (width, height))
    for solid, mesh in meshes:
        with sheet.group(f"exploded-{solid.name}"):
            opacity = TRANSLUCENT if solid.role is BodyRole.ENCAPSULATION else 1.0
            rendered(sheet, [mesh], view, (width, height), opacity)
    wide, down = np.ptp(view(np.concatenate([mesh.vertices for mesh in every])), axis=0).tolist()
    return wide, down


def _coloured(solid: Solid, mesh: TriangleMesh) -> Coloured:
    return Coloured(mesh.vertices, mesh.triangles, solid.colour)


def _trimmed(solids: tuple[Solid, ...]) -> list[tuple[Solid, TriangleMesh]]:
    """The meshes, cut off a little beyond the sensor so that a long tail does not make it small."""
    meshes = [(solid, tessellate(solid, CHORD, TURN)) for solid in solids]
    body = [m.vertices[:, 0] for s, m in meshes if s.role not in (BodyRole.BOARD, BodyRole.STIFFENER)]
    if not body:
        return meshes
    x0, x1 = min(float(x.min()) for x in body), max(float(x.max()) for x in body)
    found = []
    for solid, mesh in meshes:
        part = manifold(mesh).trim_by_plane((-1.0, 0.0, 0.0), -(x1 + 0.3 * (x1 - x0)))
        if not part.is_empty():
            cut = part.to_mesh64()
            points = np.asarray(cut.vert_properties)[:, :3]
            found.append((solid, TriangleMesh(solid.name, points, np.asarray(cut.tri_verts).astype(int))))
    return found


def _lifted(meshes: list[tuple[Solid, TriangleMesh]]) -> list[tuple[Solid, TriangleMesh]]:
    """The meshes moved apart along z: each stands clear of all that was drawn before it."""
    depth = max(float(m.vertices[:, 1].max() - m.vertices[:, 1].min()) for _, m in meshes)
    gap, top, found = 0.3 * depth, None, []
    for solid, mesh in meshes:
        low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
        lift = 0.0 if top is None else top + gap - low
        top = high + lift
        found.append((solid, TriangleMesh(mesh.name, mesh.vertices + np.array([0.0, 0.0, lift]), mesh.triangles)))
    return found
