"""Gmsh as the meshes here want it: every option that matters set, sizes that are small at edges, quality reported."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sitscad.parts.extras import require

DELAUNAY, HXT = 1, 10
"""Gmsh's algorithms for tetrahedra: the first for single bodies, the second for many that share faces."""

_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "General.Verbosity": 0,
    "Geometry.OCCImportLabels": 0,
    "Geometry.Tolerance": 1e-8,
    "Mesh.Algorithm": 6,
    "Mesh.Binary": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.MaxNumThreads1D": 1,
    "Mesh.MaxNumThreads2D": 1,
    "Mesh.MaxNumThreads3D": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 0,
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

Entity = tuple[int, int]
"""A volume, face or curve of gmsh: its dimension and number."""


@contextmanager
def session(name: str, algorithm: int) -> Iterator[Any]:
    """Gmsh in a model of its own, in millimetres; files are in metres. A session that the caller has open survives."""
    gmsh = require("gmsh")
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    for option, value in {**_OPTIONS, "Mesh.Algorithm3D": algorithm}.items():
        gmsh.option.setNumber(option, value)
    gmsh.model.add(name)
    try:
        yield gmsh
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()


def imported(gmsh: Any, shape: Any, folder: Path) -> list[Entity]:
    """The volumes of a build123d shape, handed over as BREP text."""
    path = folder / "shape.brep"
    require("build123d").export_brep(shape, path)
    found: list[Entity] = gmsh.model.occ.importShapes(str(path))
    return found


def faces(gmsh: Any, volumes: list[Entity]) -> set[int]:
    """The numbers of all faces of volumes."""
    return (
        {abs(tag) for _, tag in gmsh.model.getBoundary(volumes, combined=False, oriented=False)} if volumes else set()
    )


def edges(gmsh: Any, surfaces: Iterable[int]) -> list[int]:
    """The numbers of all curves that bound faces."""
    around = gmsh.model.getBoundary([(2, tag) for tag in sorted(surfaces)], combined=False, oriented=False)
    return sorted({abs(tag) for _, tag in around})


def grade(gmsh: Any, curves: list[int], sizes: tuple[float, float], reach: float) -> None:
    """Elements of the first size (mm) at curves that grow to the second one at a distance `reach` (mm)."""
    field = gmsh.model.mesh.field
    near, size = field.add("Distance"), field.add("Threshold")
    field.setNumbers(near, "CurvesList", curves)
    field.setNumber(near, "Sampling", SAMPLES)
    values = {"InField": near, "SizeMin": sizes[0], "SizeMax": sizes[1], "DistMin": sizes[0] / 2, "DistMax": reach}
    for name, value in values.items():
        field.setNumber(size, name, value)
    field.setAsBackgroundMesh(size)


SAMPLES = 100
"""Points on each curve that distances are taken from."""


def written(gmsh: Any, path: Path) -> bytes:
    """The mesh as the format that a file's ending names."""
    gmsh.write(str(path))
    return path.read_bytes()


def as_abaqus(gmsh: Any, path: Path, title: str) -> bytes:
    """The mesh as Abaqus' input file, which CalculiX and others read; gmsh's heading would name a folder of ours."""
    return f"*Heading\n {title}, metres\n".encode("ascii") + written(gmsh, path).split(b"\n", 2)[2]


def quality(gmsh: Any, volumes: Iterable[Entity] = ()) -> dict[str, float]:
    """How many nodes and tetrahedra there are, of all volumes or of some, and how good these are: 1 is regular, 0 flat,
    less than 0 inside out (the signed inverse condition number, SICN).
    """
    places = [tag for _, tag in volumes] or [-1]
    tags = [int(tag) for place in places for each in gmsh.model.mesh.getElements(3, place)[1] for tag in each]
    worth = sorted(float(value) for value in gmsh.model.mesh.getElementQualities(tags, "minSICN"))
    return {
        "nodes": len({int(n) for p in places for n in gmsh.model.mesh.getNodes(3, p, includeBoundary=True)[0]}),
        "tetrahedra": len(tags),
        "least_quality": round(worth[0], 4),
        "median_quality": round(worth[len(worth) // 2], 4),
        "share_below_0.1": round(sum(value < 0.1 for value in worth) / len(worth), 6),
    }
