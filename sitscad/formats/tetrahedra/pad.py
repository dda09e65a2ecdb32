"""A tetrahedral mesh of the elastomer pad for finite-element programs, coordinates in **metres**: MSH 2.2 (ASCII) with
straight sides, and in second order an input deck that CalculiX runs (`input_deck`).

Physical groups: the volume ``elastomer``, and the surfaces ``bonded_bottom`` (where the pad stands on the board),
``bonded_top`` (where it carries the target) and ``free`` (all the rest, also what overhangs). gmsh cuts the pad's faces
along the edges of board and target, so that bonded and free areas are exact; along those edges, where stresses are
singular, elements are smaller.
"""

from __future__ import annotations

import json
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

from sitscad.formats.tetrahedra.input_deck import input_deck
from sitscad.formats.tetrahedra.session import (
    DELAUNAY,
    edges,
    faces,
    grade,
    imported,
    quality,
    session,
    written,
)
from sitscad.layout.board import Layout
from sitscad.parts.pad import elastomer
from sitscad.parts.solid import PartsError, Solid, of_role
from sitscad.scene.bodies import BodyRole
from sitscad.spec.plates import ElastomerPad
from sitscad.spec.sensor import SensorSpec

ELEMENTS_THROUGH_THICKNESS = 5
ELEMENTS_ACROSS = 10
AT_EDGES = 0.5
"""Size of the elements along the bonded edges over that of the others, which they grow to within two of these."""


def render(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """``mesh/NAME-elastomer.msh`` of straight tetrahedra, the deck ``.inp`` in second order with its named faces, its
    rubber and a step, and their quality as ``.json``; nothing without an elastomer.
    """
    if not of_role(solids, BodyRole.ELASTOMER):
        return {}
    made = elastomer_meshes(solids, _pad_of(spec))
    return {f"mesh/{spec.name}-elastomer.{ending}": content for ending, content in made.items()}


def pad_mesh(layout: Layout, size: float | None = None) -> dict[str, bytes]:
    """The elastomer pad as a mesh, by the ending of its file: ``msh``, ``inp`` (CalculiX) in second order, ``json``
    with what they are worth. `size` is the elements' size (m), by default five through the thickness, ten across; half
    of it along the edges of what is bonded.

    Raises
    ------
    MissingExtra
        without gmsh or a CAD kernel (`pip install 'sitscad[all]'`).
    PartsError
        without an elastomer.
    ValueError
        for a size that is no positive length.
    """
    from sitscad.parts.assembly import assemble

    if size is not None and not 0.0 < size < float("inf"):
        raise ValueError("the size of elements is a positive length in metres")
    if elastomer(layout) is None:
        raise PartsError("the spec has no elastomer to be meshed")
    return elastomer_meshes(assemble(layout), _pad_of(layout.spec), size)


def _pad_of(spec: SensorSpec) -> ElastomerPad:
    assert spec.elastomer is not None  # there is a solid of it
    return spec.elastomer


def elastomer_meshes(solids: tuple[Solid, ...], pad_of: ElastomerPad, size: float | None = None) -> dict[str, bytes]:
    """The pad's mesh by the ending of its file: ``msh``, ``inp`` in second order, ``json`` with what they are worth."""
    with TemporaryDirectory() as name, session("elastomer", DELAUNAY) as gmsh:
        folder = FilePath(name)
        pad, board, target = (
            [each for solid in of_role(solids, role) for each in imported(gmsh, solid.shape, folder)]
            for role in (BodyRole.ELASTOMER, BodyRole.BOARD, BodyRole.TARGET)
        )
        gmsh.model.occ.fragment(pad, board + target)
        gmsh.model.occ.synchronize()
        bonded = _name_groups(gmsh, pad, board, target)
        edge = size * 1e3 if size else _element_size(gmsh, pad[0])
        gmsh.option.setNumber("Mesh.MeshSizeMin", AT_EDGES * edge)
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        grade(gmsh, edges(gmsh, bonded), (AT_EDGES * edge, edge), 2.0 * edge)
        gmsh.model.mesh.generate(3)
        found = {"msh": written(gmsh, folder / "elastomer.msh")}
        first = quality(gmsh)
        gmsh.model.mesh.setOrder(2)
        found["inp"] = input_deck(gmsh, pad_of)
        sizes = {"element_size_m": edge * 1e-3, "size_at_bonded_edges_m": AT_EDGES * edge * 1e-3}
        document = {**sizes, "first_order": first, "second_order": quality(gmsh)}
        return {**found, "json": (json.dumps(document, indent=1) + "\n").encode("ascii")}


def _name_groups(gmsh: Any, pad: list, board: list, target: list) -> set[int]:
    """The physical groups, by whose faces the pad shares; board and target themselves are not meshed. Those that are
    bonded.
    """
    around = faces(gmsh, pad)
    bottom, top = around & faces(gmsh, board), around & faces(gmsh, target)
    gmsh.model.removeEntities(board + target, recursive=False)
    for tag, (name, group) in enumerate(
        (("bonded_bottom", bottom), ("bonded_top", top), ("free", around - bottom - top)), start=1
    ):
        if group:
            gmsh.model.addPhysicalGroup(2, sorted(group), tag, name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in pad], 4, "elastomer")
    _drop_strays(gmsh, around)
    return bottom | top


def _drop_strays(gmsh: Any, around: set[int]) -> None:
    """Faces of board and target that the pad has no part in are not to be meshed."""
    strays = [(2, tag) for _, tag in gmsh.model.getEntities(2) if tag not in around]
    gmsh.model.removeEntities(strays, recursive=True)


def _element_size(gmsh: Any, pad: tuple[int, int]) -> float:
    x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(*pad)
    return round(min((z1 - z0) / ELEMENTS_THROUGH_THICKNESS, min(x1 - x0, y1 - y0) / ELEMENTS_ACROSS), 6)
