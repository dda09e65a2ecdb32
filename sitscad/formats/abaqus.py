"""The pad as an input deck that a finite-element program runs: nodes and elements, sets, rubber, and a step that
presses it. Written for CalculiX, in the words of Abaqus' input file; lengths in metres, stresses in pascals.

CalculiX (2.20 was asked) knows no hybrid element (``C3D10H is an unknown element type``), and its C3D10 locks in rubber
that cannot change its volume. So the deck takes less bulk modulus than the material has: see `SHRINK`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.spec.plates import ElastomerPad

FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
"""The corners of a tetrahedron's faces S1 to S4."""

GMSH_TO_ABAQUS = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""The nodes of a tetrahedron of second order: gmsh has the last two the other way round."""

SHRINK = 0.06
"""Modulus of the bonded pad, 3 mu (1 + 2 S^2) with the shape factor S (Gent & Lindley 1959), over the deck's bulk
modulus. A smaller share locks the elements, a larger one lets the rubber shrink: with this one the two err against each
other, by a few per cent of the force (tests/formats/test_volume_mesh.py runs it; docs/package.md has the figures).
"""

STRAIN = 0.05
"""The step's compression, in parts of the thickness."""

ABOUT = """\
The elastomer pad in metres, newtons and pascals: C3D10 tetrahedra, surfaces and node sets, rubber, one step.
Run it with CalculiX: ccx NAME-elastomer (without the ending); the force is in NAME-elastomer.dat.
The rubber is {name}: W = (2 mu / alpha^2) (sum of stretches^alpha - 3) + (J - 1)^2 / D, mu = {mu:.6g} Pa,
alpha = {alpha:.6g} (Ogden, one term; 2 is neo-Hookean), D = 2 / K.
K is {ratio:.4g} mu here and {bulk:.6g} Pa in the material: CalculiX has no hybrid element, and C3D10 locks with more.
The force then comes out some per cent off, more with coarse elements or a thin, wide pad: see docs/package.md.
In Abaqus write TYPE=C3D10H and D = {d_real:.6g}, which needs no such help."""


def input_deck(gmsh: Any, pad: ElastomerPad) -> bytes:
    """The deck of gmsh's mesh of second order (written in metres: its own millimetres times 1e-3)."""
    return ("\n".join(_lines(gmsh, pad)) + "\n").encode("ascii")


def bulk_ratio(pad: ElastomerPad) -> float:
    """Bulk over shear modulus in the deck; the material's own where that is less."""
    shape_factor = pad.size[0] * pad.size[1] / (2.0 * sum(pad.size) * pad.thickness)
    stiff = 3.0 * (1.0 + 2.0 * shape_factor**2)
    return min(stiff / SHRINK, pad.material.bulk_modulus / pad.material.shear_modulus)


def _lines(gmsh: Any, pad: ElastomerPad) -> Iterator[str]:
    material, ratio = pad.material, bulk_ratio(pad)
    mu, alpha = material.shear_modulus, material.ogden_exponent
    words = ABOUT.format(name=material.name, mu=mu, alpha=alpha, ratio=ratio, bulk=material.bulk_modulus,
                         d_real=2.0 / material.bulk_modulus)
    yield from (f"** {line}" for line in words.splitlines())
    yield from ("*HEADING", "elastomer, metres")
    tags, places, _ = gmsh.model.mesh.getNodes()
    yield "*NODE"
    order = np.argsort(tags)
    for tag, (x, y, z) in zip(tags[order].tolist(), places.reshape(-1, 3)[order].tolist(), strict=True):
        yield f"{tag}, {_metres(x)}, {_metres(y)}, {_metres(z)}"
    tetrahedra = gmsh.model.mesh.getElements(3)[2][0].reshape(-1, 10)[:, GMSH_TO_ABAQUS]
    yield "*ELEMENT, TYPE=C3D10, ELSET=elastomer"
    yield from (f"{number}, {', '.join(map(str, row))}" for number, row in enumerate(tetrahedra.tolist(), 1))
    surfaces = dict(_surfaces(gmsh))
    for name, triangles in surfaces.items():
        # A surface by the elements' faces that it is made of, and its nodes as a set
        corners = np.sort(triangles[:, :3])
        wanted = set(map(tuple, corners.tolist()))
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        sides = [np.sort(tetrahedra[:, face]).tolist() for face in FACES]
        for element, each in enumerate(zip(*sides, strict=True), 1):
            yield from (f"{element}, S{side}" for side, face in enumerate(each, 1) if tuple(face) in wanted)
        yield f"*NSET, NSET=nodes_{name}"
        yield from map(str, np.unique(triangles).tolist())
    yield from ("*MATERIAL, NAME=rubber", "*HYPERELASTIC, OGDEN, N=1")
    yield f"{mu:.9g}, {alpha:.9g}, {2.0 / (ratio * mu):.9g}"
    if material.density is not None:
        yield from ("*DENSITY", f"{material.density:.9g}")
    yield "*SOLID SECTION, ELSET=elastomer, MATERIAL=rubber"
    if {"bonded_top", "bonded_bottom"} <= surfaces.keys():
        yield from _step(pad.thickness)


def _metres(millimetres: float) -> str:
    return f"{millimetres * 1e-3 + 0.0:.9g}"


def _surfaces(gmsh: Any) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """The named faces and the nodes (n, 6) of their triangles, corners first."""
    for group in gmsh.model.getPhysicalGroups(2):
        faces = gmsh.model.getEntitiesForPhysicalGroup(*group)
        found = [gmsh.model.mesh.getElements(2, face)[2][0].reshape(-1, 6) for face in faces]
        yield gmsh.model.getPhysicalName(*group), np.concatenate(found).astype(np.int64)


def _step(thickness: float) -> Iterator[str]:
    """The board holds the pad, the target presses it without turning: `STRAIN` of its thickness."""
    yield from ("*STEP, NLGEOM, INC=1000", "*STATIC", "0.5, 1., 1e-4, 1.")
    yield from ("*BOUNDARY", "nodes_bonded_bottom, 1, 3, 0.", "nodes_bonded_top, 1, 2, 0.")
    yield f"** the target's travel: {STRAIN:.0%} of the pad's thickness"
    yield f"nodes_bonded_top, 3, 3, {-STRAIN * thickness:.9g}"
    yield from ("** what holds the target: the force is the third", "*NODE PRINT, NSET=nodes_bonded_top, TOTALS=ONLY")
    yield from ("RF", "*NODE FILE", "U", "*EL FILE", "S", "*END STEP")
