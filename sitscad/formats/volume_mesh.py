"""A tetrahedral mesh of the elastomer pad for finite-element programs: MSH 2.2 (ASCII), coordinates in **metres**.

Physical groups: the volume ``elastomer``, and the surfaces ``bonded_bottom`` (where the pad stands on the board),
``bonded_top`` (where it carries the target) and ``free`` (all the rest, also what overhangs). gmsh cuts the pad's faces
along the edges of board and target, so that bonded and free areas are exact.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

from sitscad.parts.extras import require
from sitscad.parts.solid import Solid, of_role
from sitscad.scene.bodies import BodyRole
from sitscad.spec.sensor import SensorSpec

ELEMENTS_THROUGH_THICKNESS = 5
ELEMENTS_ACROSS = 10
_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "General.Verbosity": 0,
    "Geometry.OCCImportLabels": 0,
    "Geometry.Tolerance": 1e-8,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 1,
    "Mesh.Binary": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.MaxNumThreads1D": 1,
    "Mesh.MaxNumThreads2D": 1,
    "Mesh.MaxNumThreads3D": 1,
    "Mesh.MeshSizeExtendFromBoundary": 1,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 1,
    "Mesh.MshFileVersion": 2.2,
    "Mesh.Optimize": 1,
    "Mesh.OptimizeNetgen": 0,
    "Mesh.RandomFactor": 1e-9,
    "Mesh.RandomFactor3D": 1e-12,
    "Mesh.RandomSeed": 1,
    "Mesh.SaveAll": 0,
    "Mesh.SaveParametric": 0,
    "Mesh.ScalingFactor": 1e-3,
}


def render(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """``mesh/NAME-elastomer.msh`` of straight tetrahedra, the same in second order as ``.inp`` (Abaqus, CalculiX) with
    its named faces, and their quality as ``.json``; nothing without an elastomer.
    """
    if not of_role(solids, BodyRole.ELASTOMER):
        return {}
    made = elastomer_meshes(solids)
    return {f"mesh/{spec.name}-elastomer.{ending}": content for ending, content in made.items()}


def elastomer_mesh(solids: tuple[Solid, ...], size: float | None = None) -> bytes:
    """The pad's mesh; `size` is the element size in metres (by default five through its thickness, ten across it)."""
    return elastomer_meshes(solids, size)["msh"]


def elastomer_meshes(solids: tuple[Solid, ...], size: float | None = None) -> dict[str, bytes]:
    """The pad's mesh by the ending of its file: ``msh``, ``inp`` in second order, ``json`` with what they are worth."""
    with TemporaryDirectory() as folder, _session() as gmsh:
        pad, board, target = _imported(gmsh, solids, FilePath(folder))
        gmsh.model.occ.fragment(pad, board + target)
        gmsh.model.occ.synchronize()
        _name_groups(gmsh, pad, board, target)
        edge = size * 1e3 if size else _element_size(gmsh, pad[0])
        gmsh.option.setNumber("Mesh.MeshSizeMin", edge)
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        gmsh.model.mesh.generate(3)
        found = {"msh": _written(gmsh, FilePath(folder) / "elastomer.msh")}
        first = _quality(gmsh)
        gmsh.model.mesh.setOrder(2)
        text = _written(gmsh, FilePath(folder) / "elastomer.inp")
        found["inp"] = b"*Heading\n elastomer, metres\n" + text.split(b"\n", 2)[2]  # gmsh names a folder of ours there
        document = {"element_size_m": edge * 1e-3, "first_order": first, "second_order": _quality(gmsh)}
        return {**found, "json": (json.dumps(document, indent=1) + "\n").encode("ascii")}


def _written(gmsh: Any, path: FilePath) -> bytes:
    gmsh.write(str(path))
    return path.read_bytes()


def _quality(gmsh: Any) -> dict[str, float]:
    """How many nodes and tetrahedra there are, and how good these are: 1 is regular, 0 flat, less than 0 inside out
    (the signed inverse condition number, SICN).
    """
    tags = [int(tag) for each in gmsh.model.mesh.getElements(3)[1] for tag in each]
    worth = sorted(float(value) for value in gmsh.model.mesh.getElementQualities(tags, "minSICN"))
    return {
        "nodes": len(gmsh.model.mesh.getNodes()[0]),
        "tetrahedra": len(tags),
        "least_quality": round(worth[0], 4),
        "median_quality": round(worth[len(worth) // 2], 4),
        "share_below_0.1": round(sum(value < 0.1 for value in worth) / len(worth), 6),
    }


@contextmanager
def _session() -> Iterator[Any]:
    """Gmsh with every option that matters set, in a model of its own; a session that the caller has open survives."""
    gmsh = require("gmsh")
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    for name, value in _OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.model.add("elastomer")
    try:
        yield gmsh
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()


def _imported(gmsh: Any, solids: tuple[Solid, ...], folder: FilePath) -> list[list[tuple[int, int]]]:
    """The volumes of pad, board and target, handed over as BREP text."""
    bd = require("build123d")
    volumes = []
    for role in (BodyRole.ELASTOMER, BodyRole.BOARD, BodyRole.TARGET):
        found: list[tuple[int, int]] = []
        for solid in of_role(solids, role):
            path = folder / f"{role.value}.brep"
            bd.export_brep(solid.shape, path)
            found += gmsh.model.occ.importShapes(str(path))
        volumes.append(found)
    return volumes


def _name_groups(gmsh: Any, pad: list, board: list, target: list) -> None:
    """The physical groups, by whose faces the pad shares; board and target themselves are not meshed."""
    faces = _faces(gmsh, pad)
    bottom, top = faces & _faces(gmsh, board), faces & _faces(gmsh, target)
    gmsh.model.removeEntities(board + target, recursive=False)
    for tag, (name, group) in enumerate(
        (("bonded_bottom", bottom), ("bonded_top", top), ("free", faces - bottom - top)), start=1
    ):
        if group:
            gmsh.model.addPhysicalGroup(2, sorted(group), tag, name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in pad], 4, "elastomer")
    _drop_strays(gmsh, faces)


def _drop_strays(gmsh: Any, faces: set[int]) -> None:
    """Faces of board and target that the pad has no part in are not to be meshed."""
    strays = [(2, tag) for _, tag in gmsh.model.getEntities(2) if tag not in faces]
    gmsh.model.removeEntities(strays, recursive=True)


def _faces(gmsh: Any, volumes: list) -> set[int]:
    if not volumes:
        return set()
    return {abs(tag) for _, tag in gmsh.model.getBoundary(volumes, combined=False, oriented=False)}


def _element_size(gmsh: Any, pad: tuple[int, int]) -> float:
    x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(*pad)
    return round(min((z1 - z0) / ELEMENTS_THROUGH_THICKNESS, min(x1 - x0, y1 - y0) / ELEMENTS_ACROSS), 6)
