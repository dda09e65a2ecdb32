"""Can a piece be made: what is measured on its solid, against what its process makes. Walls are measured between faces
that look away from each other, by rays through the piece from the middle of every triangle; holes are whole cylinders
that open inwards; a hollow that nothing leads out of is a shell inside the solid.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.arrays import Array
from sitscad.parts.solid import Solid, require, tessellate
from sitscad.record import record
from sitscad.scene.column import print_limit

COARSE = (0.05, 0.5)
"""Chord (mm) and turn (rad) of the triangles that walls are measured on: they are flat, or nearly."""

FACING = 0.9  # Cosine between two faces from which on they are the two sides of one wall
SUPPORTED = math.cos(math.radians(45.0))  # Faces that look down more steeply than this want support: 45 degrees
GRAIN = 2e-6  # What is thinner than a limit by less than this (m) is not

BEDS: dict[str, tuple[int, float]] = {
    f"{sign}{axis}": (i, s) for i, axis in enumerate("xyz") for sign, s in (("-", -1.0), ("+", 1.0))
}
"""Directions that a piece may lie on the bed with: axis and sign of the outward normal there."""


@record
class Unprintable:
    """Something of a piece that its process does not make: what, its size and the least (m; m3 of hollows)."""

    what: str
    measured: float
    limit: float
    fix: str


@record
class Printable:
    """A piece as it is made: its size (m), the volume of its material (m3), its thinnest wall and smallest hole (m;
    None where it has none), which of its sides lies on the bed, and the area (m2) that then wants support.
    """

    name: str
    size: tuple[float, float, float]
    volume: float
    wall: float | None
    hole: float | None
    bed: str
    unsupported: float
    faults: tuple[Unprintable, ...]


def printable(solid: Solid, process: str) -> Printable:
    """What is measured of one piece, and what a process (``resin``, ``powder``, ...) does not make of it."""
    mesh = tessellate(solid, *COARSE)
    corners = mesh.vertices[mesh.triangles]
    # Outward unit normals (n, 3) of triangles (n, 3, 3)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.asarray(cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-300))
    # The diameter (m) of the smallest round hole; None without one
    tools = require("OCP.BRepTools").BRepTools
    found = []
    for face in solid.shape.faces():
        if face.geom_type.name == "CYLINDER":
            u0, u1, _, _ = tools.UVBounds_s(face.wrapped)
            if u1 - u0 > 1.9 * math.pi and _opens_inwards(face):
                found.append(2e-3 * float(face.radius))
    # The shortest way (m) through the piece between two faces that look away from each other
    middles = corners.mean(axis=1) - 1e-6 * normals
    best = math.inf
    for start in range(0, len(middles), CHUNK):
        chosen = slice(start, start + CHUNK)
        distance, hit = _first_hits(middles[chosen], -normals[chosen], corners)
        faces = np.einsum("ij,ij->i", normals[chosen], normals[hit])
        through = distance[faces < -FACING]
        best = min(best, float(through.min(initial=math.inf)))
    wall, hole = (best * 1e-3 if math.isfinite(best) else None), min(found, default=None)
    # The volume (m3) of hollows that nothing leads out of
    shells, hollow = solid.shape.shells(), 0.0
    if len(shells) > 1:
        volumes = [abs(float(require("build123d").Solid(shell).volume)) for shell in shells]
        hollow = 1e-9 * (sum(volumes) - max(volumes))
    bed, unsupported = _bed(corners, normals)
    x, y, z = (mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)) * 1e-3
    size = float(x), float(y), float(z)
    # What the process cannot make of walls (m), holes (m) and trapped volume (m3)
    faults = []
    for what, measured, fix in (
        ("wall", wall, "a larger standoff, a thicker piece, or another mount.process"),
        ("hole", hole, "drill it after printing, or another mount.process"),
    ):
        limit = print_limit(process, what).value
        if measured is not None and measured < limit - GRAIN:
            faults.append(Unprintable(what, measured, limit, fix))
    if hollow > 0.0:
        fix = "open it by two holes (sitscad/data/print_limits.csv: escape)"
        faults.append(Unprintable("trapped volume", hollow, 0.0, fix))
    return Printable(solid.name, size, solid.volume, wall, hole, bed, unsupported, tuple(faults))


CHUNK = 128  # Rays that are traced at once: each meets every triangle


def _first_hits(origins: Array, directions: Array, corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """Distance along each ray to the first triangle, and which that is (Moeller and Trumbore 1997), their triple
    products taken apart so that each is a product of matrices; lengths from about the rays' own places.
    """
    middle = origins.mean(axis=0)
    origins, first = origins - middle, corners[:, 0] - middle
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, moment = np.cross(one, two), np.cross(origins, directions)
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = -directions @ normal.T
        inverse = np.where(np.abs(determinant) > 1e-12, 1.0 / determinant, np.nan)
        u = (moment @ two.T - directions @ np.cross(two, first).T) * inverse
        v = (directions @ np.cross(one, first).T - moment @ one.T) * inverse
        t = (origins @ normal.T - np.einsum("nj,nj->n", first, normal)) * inverse
        inside = (u >= -EDGE) & (v >= -EDGE) & (u + v <= 1.0 + EDGE) & (t > 1e-5)
    far = np.where(inside, t, np.inf)
    hit = far.argmin(axis=1)
    return far[np.arange(len(hit)), hit], hit


EDGE = 1e-7  # Part of a triangle beside its edge that counts to it: no ray goes through between two


def _opens_inwards(face: Any) -> bool:
    """Whether a cylinder's outward normal points at its axis: a hole, and no pin."""
    axis = require("OCP.BRepAdaptor").BRepAdaptor_Surface(face.wrapped).Cylinder().Axis()
    at, along = axis.Location(), axis.Direction()
    point, normal = face.position_at(0.5, 0.5), face.normal_at(0.5, 0.5)
    away = np.array([point.X - at.X(), point.Y - at.Y(), point.Z - at.Z()])
    straight = np.array([along.X(), along.Y(), along.Z()])
    away -= straight * float(away @ straight)
    return float(away @ np.array([normal.X, normal.Y, normal.Z])) < 0.0


def _bed(corners: Array, normals: Array) -> tuple[str, float]:
    """The side to lie on: the one that wants least support, of those alike the one with most on the bed."""
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    ranked: list[tuple[float, float, str]] = []
    for name, (axis, sign) in BEDS.items():
        height = sign * corners[:, :, axis]
        on_bed = height.min(axis=1) > height.max() - 1e-3
        down = sign * normals[:, axis] > SUPPORTED
        unsupported = float(areas[down & ~on_bed].sum())
        ranked.append((round(unsupported, 3), -round(float(areas[on_bed & down].sum()), 3), name))
    unsupported, _, name = min(ranked)
    return name, unsupported * 1e-6


def as_json(piece: Printable, process: str) -> dict[str, Any]:
    """One piece as plain values, lengths in metres to a tenth of a micrometre."""
    return {
        "piece": piece.name,
        "process": process,
        "size_m": [_rounded(side) for side in piece.size],
        "volume_m3": round(piece.volume, 14),
        "least_wall_m": None if piece.wall is None else _rounded(piece.wall),
        "least_hole_m": None if piece.hole is None else _rounded(piece.hole),
        "lies_on": piece.bed,
        "unsupported_m2": round(piece.unsupported, 9),
        "faults": [
            {"what": f.what, "measured": _rounded(f.measured), "limit": f.limit, "fix": f.fix} for f in piece.faults
        ],
    }


def _rounded(length: float) -> float:
    return round(length, 7) + 0.0
