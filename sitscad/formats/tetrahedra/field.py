"""What a field program (eddy currents, magnetostatics) computes on, as one mesh of tetrahedra in **metres**: the coils,
all metal near them, the pad, and the air round all of it.

Regions share their faces. Every volume is a physical group (``coil_C1``, ``target``, ``shield``, ``jaw``,
``elastomer``, ``air``), and so is every surface between two of them (``target_air``, ``target_elastomer``, ...) and the
air's end (``outer``). Pieces lie where they are glued; what neither conducts nor is the pad (board, film, mount,
glue) is air, but for the glue over and under the pad, which counts as pad: the target stands at the gap that the
estimates have.
"""

from __future__ import annotations

import json
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

from sitscad.formats.tetrahedra.session import (
    HXT,
    Entity,
    as_abaqus,
    edges,
    faces,
    grade,
    imported,
    quality,
    session,
    written,
)
from sitscad.geometry.path import Point, Region, circle
from sitscad.layout.board import Coil, Layout
from sitscad.parts.assembly import assemble
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, prism
from sitscad.parts.whole.films import LEAST_OPENING, ring
from sitscad.parts.whole.lift import glued
from sitscad.scene import bodies
from sitscad.scene.bodies import BodyRole, target_gap

AIR, OUTER = "air", "outer"
METALS = {BodyRole.TARGET: "target", BodyRole.SHIELD: "shield", BodyRole.JAW: "jaw"}
COPPER = ("coils", "layers")
"""A region for every coil, from its topmost to its lowest copper, or one for every layer of every coil."""

PER_COIL = 25
"""Elements across the smallest coil, along the edges of all pieces but the air."""

ROOM = 1.5
"""Air beyond the pieces on every side, over the largest coil's width."""


def field_mesh(
    layout: Layout, size: float | None = None, air: float | None = None, copper: str = "coils"
) -> dict[str, bytes]:
    """The mesh by the ending of its file: ``msh`` (MSH 2.2), ``inp`` (Abaqus' input file, which CalculiX and Elmer
    read), ``json`` with every region's volume (m3), number of tetrahedra and their quality.

    `size` (m) is that of the elements along all edges of coils, metal and pad, by default a twenty-fifth of the
    smallest coil; away from them they grow. `air` (m) is how far the air reaches beyond all pieces, by default one and
    a half times the largest coil's width. `copper` is ``coils``: each is a ring as high as its winding, to carry a
    current that is spread evenly; or ``layers``: a ring for every layer (``coil_C1_1``). The other jaw is left out.
    Regions and sizes are the spec's; the order of points and elements may differ between two calls, because
    OpenCASCADE numbers shared edges by their addresses.

    Raises
    ------
    MissingExtra
        without gmsh or a CAD kernel (`pip install 'sitscad[all]'`).
    PartsError
        for a part that cannot exist.
    ValueError
        for lengths that are not positive, and another word for the copper.
    """
    for length in (size, air):
        if length is not None and not 0.0 < length < float("inf"):
            raise ValueError("sizes of elements and of the air are positive lengths in metres")
    if copper not in COPPER:
        raise ValueError(f"the copper is meshed as {' or '.join(COPPER)}, not {copper!r}")
    widths = [min(layout.spec.coil.size), max(layout.spec.coil.size)]
    fine, room = size or widths[0] / PER_COIL, air or ROOM * widths[1]
    return _meshed(_regions(layout, copper), fine * MM, room * MM)


def _regions(layout: Layout, copper: str) -> dict[str, Any]:
    """The pieces by their regions' names, as build123d solids."""
    found = {name: shape for coil in layout.coils for name, shape in _rings(layout, coil, copper)}
    pieces = glued(layout, tuple(s for s in assemble(layout) if s.role in METALS))
    found |= {METALS[solid.role]: solid.shape for solid in pieces}
    pad, gap = bodies.elastomer(layout.spec), target_gap(layout.spec)
    if pad is not None:
        found["elastomer"] = prism(pad.outline(), 0.0, pad.upper if gap is None else gap)
    return found


def _ring(layout: Layout, coil: Coil, number: int) -> Region:
    """The ring of a layer: for round coils where its tracks are on the average over a turn, in which they go inwards by
    a pitch; other shapes step in at one place, and cover what is drawn of them.
    """
    spec, drawn = layout.spec.coil, ring(layout, coil, number)
    if not spec.outline.is_round:
        return drawn
    step = (spec.trace_width + spec.trace_spacing) / 2
    order = [winding.layer for winding in coil.windings].index(number)
    outer = spec.size[0] / 2 - step
    inner = outer + spec.trace_spacing - 2.0 * step * spec.layer_turns[order]
    holes = (circle(Point(*coil.centre), inner),) if inner > LEAST_OPENING else ()
    return Region(circle(Point(*coil.centre), outer), holes)


def _rings(layout: Layout, coil: Coil, copper: str) -> list[tuple[str, Any]]:
    """A coil's regions: the ring of its widest layer, or that of each."""
    spans = [(w.layer, w.z - w.thickness / 2, w.z + w.thickness / 2) for w in coil.windings]
    if copper == "layers":
        return [(f"coil_{coil.name}_{n}", prism(_ring(layout, coil, n), low, high)) for n, low, high in spans]
    low, high = min(span[1] for span in spans), max(span[2] for span in spans)
    widest = max(spans, key=lambda span: _ring(layout, coil, span[0]).area)[0]
    return [(f"coil_{coil.name}", prism(_ring(layout, coil, widest), low, high))]


def _meshed(regions: dict[str, Any], fine: float, room: float) -> dict[str, bytes]:
    """The files of regions (build123d solids) in air, lengths in millimetres."""
    with TemporaryDirectory() as name, session("field", HXT) as gmsh:
        folder = FilePath(name)
        volumes = _fragmented(gmsh, regions, room, folder)
        within = {face for region, own in volumes.items() if region != AIR for face in faces(gmsh, own)}
        _name_groups(gmsh, volumes)
        grade(gmsh, edges(gmsh, within), (fine, max(fine, room / 2)), 2.4 * room)
        gmsh.model.mesh.generate(3)
        made = {
            "msh": written(gmsh, folder / "field.msh"),
            "inp": as_abaqus(gmsh, folder / "field.inp", "coils, metal, pad and air"),
        }
        worth = {region: {"volume_m3": _volume(gmsh, own), **quality(gmsh, own)} for region, own in volumes.items()}
        document = {"size_at_edges_m": round(fine * 1e-3, 9), "air_m": round(room * 1e-3, 9), "all": quality(gmsh)}
        return {**made, "json": (json.dumps({**document, "regions": worth}, indent=1) + "\n").encode("ascii")}


def _fragmented(gmsh: Any, regions: dict[str, Any], room: float, folder: FilePath) -> dict[str, list[Entity]]:
    """Every region's volumes with faces shared, the air's last; what two pieces share belongs to the first."""
    bd = require("build123d")
    bounds = bd.Compound(list(regions.values())).bounding_box()
    size, low = bounds.size, bounds.min
    corner = bd.Plane((low.X - room, low.Y - room, low.Z - room))
    around = bd.Solid.make_box(size.X + 2 * room, size.Y + 2 * room, size.Z + 2 * room, corner)
    pieces = {region: imported(gmsh, shape, folder) for region, shape in regions.items()}
    air = imported(gmsh, around, folder)
    ordered = [entity for own in pieces.values() for entity in own]
    _, parts = gmsh.model.occ.fragment(air, ordered)
    gmsh.model.occ.synchronize()
    came = dict(zip(ordered, parts[len(air) :], strict=True))
    found: dict[str, list[Entity]] = {}
    taken: set[Entity] = set()
    for region, own in pieces.items():
        found[region] = sorted({part for entity in own for part in came[entity]} - taken)
        taken |= set(found[region])
    return {**found, AIR: sorted({part for each in parts[: len(air)] for part in each} - taken)}


def _name_groups(gmsh: Any, volumes: dict[str, list[Entity]]) -> None:
    """The physical groups: every region, every surface between two of them, and the end of the air."""
    beside: dict[int, list[str]] = {}
    for region, own in volumes.items():
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in own], name=region)
        for entity in own:
            for face in faces(gmsh, [entity]):
                beside.setdefault(face, []).append(region)
    surfaces: dict[str, list[int]] = {}
    for face, names in sorted(beside.items()):
        if len(names) == 1 or names[0] != names[1]:
            surfaces.setdefault("_".join(names) if len(names) > 1 else OUTER, []).append(face)
    for name, tags in surfaces.items():
        gmsh.model.addPhysicalGroup(2, tags, name=name)


def _volume(gmsh: Any, volumes: list[Entity]) -> float:
    """The exact volume (m3)."""
    return float(f"{sum(gmsh.model.occ.getMass(3, tag) for _, tag in volumes) * 1e-9:.9g}")
