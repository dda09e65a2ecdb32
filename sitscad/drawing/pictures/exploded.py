"""Solids drawn apart in parallel projection, shaded by the painter's method from coarse meshes.

Solids lie on top of one another, so they are drawn from the bottom up; within a solid, faces towards the viewer are
drawn inner before outer, low before high, far before near.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sitscad.drawing.sheet import Pen, Sheet
from sitscad.geometry.path import Path, Point, closed_polygon, polyline
from sitscad.parts.mesh import TriangleMesh, manifold, tessellate
from sitscad.parts.solid import Solid
from sitscad.record import record
from sitscad.scene.bodies import BodyRole

CHORD, TURN = 0.02, 0.5  # mm, rad: a picture's mesh
AZIMUTH, ELEVATION = math.radians(28.0), math.radians(32.0)  # the viewer stands towards +x and -y, above
LIGHT = (0.25, -0.45, 0.86)
CREASE = math.cos(math.radians(25.0))  # faces that meet at more than this angle have a drawn edge
INK = "#22303c"
CREASE_PEN = Pen(0.7, INK, round_ends=False)


def exploded(sheet: Sheet, solids: tuple[Solid, ...], width: float, height: float) -> tuple[float, float]:
    """Draw the solids apart along z, as large as fits into width and height (pixels), downwards from y = 0; what the
    drawing takes of both.
    """
    meshes = _lifted(_trimmed(solids))
    toward, right, up = _camera()
    corners = np.concatenate([mesh.vertices for _, mesh in meshes])
    flat = np.stack([corners @ right, corners @ up], axis=1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = min(width / (high[0] - low[0]), height / (high[1] - low[1]))
    corner = np.array([low[0], high[1]])
    for solid, mesh in meshes:
        points = (np.stack([mesh.vertices @ right, mesh.vertices @ up], axis=1) - corner) * scale
        with sheet.group(f"exploded-{solid.name}"):
            for face in _faces(mesh, toward):
                _paint(sheet, face, points, solid)
    wide, tall = ((high - low) * scale).tolist()
    return wide, tall


def _camera() -> tuple[Any, Any, Any]:
    """Unit vectors towards the viewer, to the right and up in the picture."""
    toward = np.array(
        [math.cos(ELEVATION) * math.sin(AZIMUTH), -math.cos(ELEVATION) * math.cos(AZIMUTH), math.sin(ELEVATION)]
    )
    right = np.array([math.cos(AZIMUTH), math.sin(AZIMUTH), 0.0])
    return toward, right, np.cross(toward, right)


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


@record
class _Face:
    """Triangles of one plane: the loops round them and the creases among their edges, as vertex indices."""

    loops: tuple[tuple[int, ...], ...]
    creases: tuple[tuple[int, int], ...]
    brightness: float


def _faces(mesh: TriangleMesh, toward: Any) -> list[_Face]:
    """The faces that look towards the viewer, in drawing order."""
    normals = _normals(mesh)
    triangles = mesh.triangles.tolist()
    beside = _neighbours(triangles)
    planes: dict[tuple[float, ...], list[int]] = {}
    offsets = np.einsum("ij,ij->i", normals, mesh.vertices[mesh.triangles[:, 0]])
    keys = np.round(np.column_stack([normals, offsets]), 3) + 0.0
    for index, key in enumerate(map(tuple, keys.tolist())):
        if normals[index] @ toward > 1e-6:
            planes.setdefault(key, []).append(index)
    ordered = sorted(planes.items(), key=lambda item: (*_depth(mesh, item[1], toward, normals[item[1][0]]), item[0]))
    return [_face(members, triangles, beside, normals) for _, members in ordered]


def _normals(mesh: TriangleMesh) -> Any:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    return cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)


def _neighbours(triangles: list[list[int]]) -> dict[tuple[int, int], int]:
    """Which triangle has each directed edge; the triangle beyond an edge has it the other way round."""
    return {(t[i], t[(i + 1) % 3]): index for index, t in enumerate(triangles) for i in range(3)}


def _depth(mesh: TriangleMesh, members: list[int], toward: Any, normal: Any) -> tuple[bool, float, float]:
    """Faces on the convex hull last: nothing of the same solid hides them; before them the low, then the far ones."""
    points = mesh.vertices[mesh.triangles[members].reshape(-1)]
    on_hull = bool((mesh.vertices @ normal).max() <= (points @ normal).max() + 1e-3)
    return on_hull, round(float(points[:, 2].max()), 4), round(float((points @ toward).mean()), 4)


def _face(members: list[int], triangles: list, beside: dict, normals: Any) -> _Face:
    """The loops and creases of triangles that lie in one plane."""
    inside = set(members)
    rim: dict[int, list[int]] = {}
    creases: list[tuple[int, int]] = []
    for index in members:
        corners = triangles[index]
        for i in range(3):
            a, b = corners[i], corners[(i + 1) % 3]
            other = beside.get((b, a))
            if other in inside:
                continue
            rim.setdefault(a, []).append(b)
            if other is None or normals[index] @ normals[other] < CREASE:
                creases.append((a, b))
    light = np.array(LIGHT)
    brightness = 0.62 + 0.38 * max(0.0, float(normals[members[0]] @ light))
    return _Face(tuple(_loops(rim)), tuple(creases), brightness)


def _loops(rim: dict[int, list[int]]) -> list[tuple[int, ...]]:
    """Directed edges chained into closed loops."""
    found = []
    while rim:
        start = here = next(iter(rim))
        loop = []
        while here in rim:
            loop.append(here)
            following = rim[here].pop()
            if not rim[here]:
                del rim[here]
            here = following
            if here == start:
                break
        found.append(tuple(loop))
    return found


def _paint(sheet: Sheet, face: _Face, points: Any, solid: Solid) -> None:
    """One face: its area, outlined in its own colour so that no seam shows, then its creases in ink."""
    red, green, blue = (round(255 * value * face.brightness) for value in solid.rgb)
    colour = f"#{red:02x}{green:02x}{blue:02x}"
    opacity = 0.6 if solid.role is BodyRole.ENCAPSULATION else 1.0
    areas = [closed_polygon([Point(*points[i].tolist()) for i in loop]) for loop in face.loops]
    sheet.draw(areas, Pen(0.3, colour), colour, opacity=opacity)
    if face.creases:
        sheet.draw([_stroke(points[a], points[b]) for a, b in face.creases], CREASE_PEN)


def _stroke(one: Any, other: Any) -> Path:
    return polyline([Point(*one.tolist()), Point(*other.tolist())])
