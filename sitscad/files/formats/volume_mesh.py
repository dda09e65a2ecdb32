"""Tetrahedral meshes by gmsh, in **metres**: the elastomer pad for mechanics, and coils and metal for field programs.

Pad: MSH 2.2 (ASCII) with straight sides, and an input deck of second order that CalculiX runs. Physical groups are the
volume ``elastomer`` and the surfaces ``bonded_bottom`` (on the board), ``bonded_top`` (under the target) and ``free``
(all other faces, with those that overhang). Gmsh cuts the pad's faces along the edges of board and target, so that
bonded and free areas are exact. Stresses are singular at these edges, and elements are smaller there.

Fields (eddy currents, magnetostatics): the coils, all metal near the coils, the pad, and the surrounding air. Regions
share their faces. Every volume is a physical group (``coil_C1``, ``target``, ``shield``, ``jaw``, ``finger``,
``metal_behind``, ``elastomer``, ``air``). So is every surface between two volumes (``target_air``,
``target_elastomer``, ...) and the outer boundary of the air (``outer``). Parts are in their glued positions. Parts that
are neither conductors nor pad (board, film, mount, glue) are air. Only the glue above and below the pad belongs to the
pad, so that the target is at the gap of the estimates.

Input deck: nodes and elements, sets, rubber material, and a step that presses the pad. It is written for CalculiX in
Abaqus' syntax, with lengths in metres and stresses in pascals. CalculiX (tested: 2.20) has no hybrid element (``C3D10H
is an unknown element type``), and its C3D10 locks in incompressible rubber. The deck therefore uses a smaller bulk
modulus than the material has: see `SHRINK`.
"""

from __future__ import annotations

import itertools
import signal
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.assembly.places.bodies import BodyRole, plates_of, target_gap
from sitscad.assembly.solids.pieces import assemble
from sitscad.assembly.solids.plates import metal_below
from sitscad.assembly.solids.solid import MM, PartsError, Solid, import_extra, prism, select_by_role
from sitscad.assembly.solids.whole import LEAST_OPENING, glue_lifts, lifted_by_glue, ring
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.units import show
from sitscad.estimates.loads.pad import NoResponse, soft_pad
from sitscad.estimates.loads.pressing import web_stiffness
from sitscad.files.writer import json_bytes
from sitscad.kernels.geometry.path import Point, Region, circle
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import CellsSpec, ElastomerPad
from sitscad.spec.sensor import SensorSpec

FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))  # The corners of a tetrahedron's faces S1 to S4

GMSH_TO_ABAQUS = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""Order of the nodes of a second-order tetrahedron: the last two are exchanged in gmsh."""

SHRINK = 0.06
"""Modulus of the bonded pad, 3 mu (1 + 2 S^2) with shape factor S (Gent & Lindley 1959), over the deck's bulk modulus.

A smaller ratio locks the elements, and a larger ratio makes the rubber compressible. At this ratio the two errors
partly cancel: the force is off by a few per cent (tests/formats/test_volume_mesh.py runs it; docs/package.md has the
figures).
"""

STRAIN = 0.05  # Compression in the step, over the thickness

INCREMENT = 0.25
"""Largest increment of the step.

With increments of one half, CalculiX 2.20 diverges in the second increment for `round_button_12mm`: from 2.5 % of the
thickness on, its extrapolation turns elements at the free side inside out.
"""

ABOUT = """\
The elastomer pad in metres, newtons and pascals: C3D10 tetrahedra, surfaces and node sets, rubber, one step.
Run it with CalculiX: ccx NAME-elastomer (without the ending); the force is in NAME-elastomer.dat.
The rubber is {name}: W = (2 mu / alpha^2) (sum of stretches^alpha - 3) + (J - 1)^2 / D, mu = {mu:.6g} Pa,
alpha = {alpha:.6g} (Ogden, one term; 2 is neo-Hookean), D = 2 / K.
K is {ratio:.4g} mu here and {bulk:.6g} Pa in the material: CalculiX has no hybrid element, and C3D10 locks with more.
The force then comes out some per cent off, more with coarse elements or a thin, wide pad: see docs/package.md.
In Abaqus write TYPE=C3D10H and D = {d_real:.6g}, which needs no such help."""


ONE_CELL = """
This is the pad of ONE cell of {cells}{webs}."""
WITHOUT_FILM = """
The encapsulation ({thickness} of {material}) is NOT in this deck. With it the pad is stiffer: by the pad's law this
step needs {held} % more force."""
WITHOUT_WEBS = """, WITHOUT the webs that join it to others:
those make it stiffer by {held} %, cell by cell (data sheet)"""


def bulk_ratio(pad: ElastomerPad) -> float:
    """Return the ratio of bulk modulus to shear modulus for the input deck, at most the material's own ratio."""
    shape_factor = pad.size[0] * pad.size[1] / (2.0 * sum(pad.size) * pad.thickness)
    stiff = 3.0 * (1.0 + 2.0 * shape_factor**2)
    return min(stiff / SHRINK, pad.material.bulk_modulus / pad.material.shear_modulus)


def _left_out(spec: SensorSpec) -> str:
    """Return the deck's text on film and cells, which are not in the deck. Empty if nothing is left out."""
    return _film(spec) + _of_cells(spec.cells, spec.web, web_stiffness(spec))


def _film(spec: SensorSpec) -> str:
    film = spec.encapsulation
    if film is None:
        return ""
    try:
        whole, uncoated = (soft_pad(each) for each in (spec, replace(spec, encapsulation=None)))
    except NoResponse:
        return ""
    with_film, without = (float(each.pressure(np.array([STRAIN]))[0]) for each in (whole, uncoated))
    percentage = f"{float(f'{100.0 * (with_film / without - 1.0):.1e}'):g}"
    return WITHOUT_FILM.format(thickness=show(film.thickness, "m"), material=film.material.name, held=percentage)


def _of_cells(cells: CellsSpec | None, web: float | None, stiffness: list[float]) -> str:
    if cells is None:
        return ""
    ordered = sorted(stiffness)
    percentages = " to ".join(dict.fromkeys(f"{100.0 * (each - 1.0):.2g}" for each in (ordered[0], ordered[-1])))
    return ONE_CELL.format(cells=len(ordered), webs=WITHOUT_WEBS.format(held=percentages) if web is not None else "")


def _deck(gmsh: Any, pad: ElastomerPad, left_out: str = "") -> Iterator[str]:
    """Yield the lines of the input deck for gmsh's mesh of second order, converted from millimetres to metres."""
    material, ratio = pad.material, bulk_ratio(pad)
    mu, alpha = material.shear_modulus, material.ogden_exponent
    comment = ABOUT.format(name=material.name, mu=mu, alpha=alpha, ratio=ratio, bulk=material.bulk_modulus,
                         d_real=2.0 / material.bulk_modulus)
    yield from (f"** {line}" for line in (comment + left_out).splitlines())
    yield from ("*HEADING", "elastomer, metres")
    tags, places, _ = gmsh.model.mesh.getNodes()
    yield "*NODE"
    order = np.argsort(tags)
    metres = places.reshape(-1, 3)[order] * 1e-3 + 0.0
    yield from map("{}, {:.9g}, {:.9g}, {:.9g}".format, tags[order].tolist(), *metres.T.tolist())
    tetrahedra = gmsh.model.mesh.getElements(3)[2][0].reshape(-1, 10)[:, GMSH_TO_ABAQUS].astype(np.int64)
    yield "*ELEMENT, TYPE=C3D10, ELSET=elastomer"
    yield from map(", ".join(["{}"] * 11).format, itertools.count(1), *tetrahedra.T.tolist())
    sides, surfaces = _by_corners(tetrahedra[:, FACES]), dict(_surfaces(gmsh))
    for name, triangles in surfaces.items():
        # A surface by its element faces, and its nodes as a set
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        bounding = np.argwhere(np.isin(sides, _by_corners(triangles[:, :3]))) + 1
        yield from map("{}, S{}".format, *bounding.T.tolist())
        yield f"*NSET, NSET=nodes_{name}"
        yield from map(str, np.unique(triangles).tolist())
    yield from ("*MATERIAL, NAME=rubber", "*HYPERELASTIC, OGDEN, N=1")
    yield f"{mu:.9g}, {alpha:.9g}, {2.0 / (ratio * mu):.9g}"
    if material.density is not None:
        yield from ("*DENSITY", f"{material.density:.9g}")
    yield "*SOLID SECTION, ELSET=elastomer, MATERIAL=rubber"
    if {"bonded_top", "bonded_bottom"} <= surfaces.keys():
        yield from _step(pad.thickness)


def _by_corners(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return a number for every triangle (..., 3) that does not depend on the order of its corners.

    Raises PartsError for node numbers of more than 21 bits.
    """
    if triangles.max() >> 21:
        raise PartsError("the pad's mesh has more than two million nodes: ask for larger elements")
    low, middle, high = np.moveaxis(np.sort(triangles, axis=-1), -1, 0)
    return np.asarray((low << 42) + (middle << 21) + high)


def _surfaces(gmsh: Any) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """Yield the names of the faces and the nodes (n, 6) of their triangles, corners first."""
    for group in gmsh.model.getPhysicalGroups(2):
        faces = gmsh.model.getEntitiesForPhysicalGroup(*group)
        elements = [gmsh.model.mesh.getElements(2, face)[2][0].reshape(-1, 6) for face in faces]
        yield gmsh.model.getPhysicalName(*group), np.concatenate(elements).astype(np.int64)


def _step(thickness: float) -> Iterator[str]:
    """Yield the step of the deck: the board holds the pad, and the target presses it by `STRAIN` without rotation."""
    yield from ("*STEP, NLGEOM, INC=1000", "*STATIC", f"{INCREMENT}, 1., 1e-4, {INCREMENT}")
    yield from ("*BOUNDARY", "nodes_bonded_bottom, 1, 3, 0.", "nodes_bonded_top, 1, 2, 0.")
    yield f"** the target's travel: {STRAIN:.0%} of the pad's thickness"
    yield f"nodes_bonded_top, 3, 3, {-STRAIN * thickness:.9g}"
    yield from ("** what holds the target: the force is the third", "*NODE PRINT, NSET=nodes_bonded_top, TOTALS=ONLY")
    yield from ("RF", "*NODE FILE", "U", "*EL FILE", "S", "*END STEP")


HXT = 10
"""Gmsh's parallel Delaunay algorithm for tetrahedra (Marot, Pellerin & Remacle 2019), here in one thread."""

_OPTIONS = {
    "General.Terminal": 0, "General.NumThreads": 1, "General.Verbosity": 0, "Geometry.OCCImportLabels": 0,
    "Geometry.Tolerance": 1e-8, "Mesh.Algorithm": 6, "Mesh.Algorithm3D": HXT, "Mesh.Binary": 0, "Mesh.ElementOrder": 1,
    "Mesh.MaxNumThreads1D": 1, "Mesh.MaxNumThreads2D": 1, "Mesh.MaxNumThreads3D": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0, "Mesh.MeshSizeFromCurvature": 0, "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MshFileVersion": 2.2, "Mesh.Optimize": 1, "Mesh.OptimizeNetgen": 0, "Mesh.RandomFactor": 1e-9,
    "Mesh.RandomFactor3D": 1e-12, "Mesh.RandomSeed": 1, "Mesh.SaveAll": 0, "Mesh.SaveParametric": 0,
    "Mesh.ScalingFactor": 1e-3,
}

Entity = tuple[int, int]  # A volume, face or curve of gmsh: its dimension and number


def imported(gmsh: Any, shape: Any, folder: Path) -> list[Entity]:
    """Return the volumes of a build123d shape, imported into gmsh as BREP text."""
    path = folder / "shape.brep"
    import_extra("build123d").export_brep(shape, path)
    entities: list[Entity] = gmsh.model.occ.importShapes(str(path))
    return entities


def faces(gmsh: Any, volumes: list[Entity]) -> set[int]:
    """Return the numbers of all faces of volumes."""
    around = gmsh.model.getBoundary(volumes, combined=False, oriented=False) if volumes else ()
    return {abs(tag) for _, tag in around}


def edges(gmsh: Any, surfaces: Iterable[int]) -> list[int]:
    """Return the numbers of all curves that bound faces, sorted."""
    around = gmsh.model.getBoundary([(2, tag) for tag in sorted(surfaces)], combined=False, oriented=False)
    return sorted({abs(tag) for _, tag in around})


def grade(gmsh: Any, curves: list[int], sizes: tuple[float, float], reach: float) -> None:
    """Set the element size: ``sizes[0]`` (mm) at curves, growing to ``sizes[1]`` at a distance `reach` (mm)."""
    field = gmsh.model.mesh.field
    near, size = field.add("Distance"), field.add("Threshold")
    field.setNumbers(near, "CurvesList", curves)
    field.setNumber(near, "Sampling", SAMPLES)
    values = {"InField": near, "SizeMin": sizes[0], "SizeMax": sizes[1], "DistMin": sizes[0] / 2, "DistMax": reach}
    for name, value in values.items():
        field.setNumber(size, name, value)
    field.setAsBackgroundMesh(size)


SAMPLES = 100  # Points on each curve from which distances are measured


def written(gmsh: Any, path: Path) -> bytes:
    """Write the mesh to a file in the format of the file's ending, and return the file's bytes."""
    gmsh.write(str(path))
    return path.read_bytes()


def quality(gmsh: Any, volumes: Iterable[Entity] = ()) -> dict[str, float]:
    """Return the numbers of nodes and tetrahedra, and the least and median quality of the tetrahedra.

    It also has the fraction of tetrahedra with a quality below 0.1. The quality is gmsh's SICN (signed inverse
    condition number): 1 for a regular tetrahedron, 0 for a flat one, negative for an inverted one. If `volumes` is not
    empty, only these volumes are evaluated.
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


ELEMENTS_THROUGH_THICKNESS = 5
ELEMENTS_ACROSS = 10
AT_EDGES = 0.5
"""Ratio of the element size along the edges of the bonded faces to the size elsewhere.

The size grows within two elements from the edges.
"""


def render(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """Return the pad's mesh files under ``mesh/NAME-elastomer``. Empty if there is no elastomer.

    ``.msh`` has straight tetrahedra, ``.inp`` is the deck of second order with named faces, rubber and step, and
    ``.json`` has the quality of the elements.
    """
    if not select_by_role(solids, BodyRole.ELASTOMER):
        return {}
    # Only the pad of the first cell is meshed, without webs
    neighbours = tuple(body.name for body in plates_of(spec).all if body.cell > 1 or body.web)
    first = tuple(solid for solid in solids if solid.name not in neighbours)
    meshes = elastomer_meshes(first, _pad_of(spec.elastomer), left_out=_left_out(spec))
    return {f"mesh/{spec.name}-elastomer.{ending}": content for ending, content in meshes.items()}


@checked_arguments
def pad_mesh(layout: Layout, size: float | None = None) -> dict[str, bytes]:
    """Return the mesh of the elastomer pad by file ending: ``msh``, ``inp`` and ``json``.

    Parameters
    ----------
    layout
        The layout.
    size
        Element size (m). The default gives five elements through the thickness and ten across. The size is half as
        large along the edges of bonded faces.

    Returns
    -------
    dict
        ``msh`` in first order, ``inp`` (CalculiX) in second order, and ``json`` with the quality of both.

    Raises
    ------
    MissingExtra
        without gmsh or a CAD kernel (`pip install 'sitscad[all]'`).
    PartsError
        without an elastomer.
    ValueError
        for a size that is no positive length.
    """
    if size is not None and not 0.0 < size < float("inf"):
        raise ValueError("the size of elements is a positive length in metres")
    if layout.spec.elastomer is None:
        raise PartsError("the spec has no elastomer to be meshed")
    return elastomer_meshes(assemble(layout.cell(1)), _pad_of(layout.spec.elastomer), size, _left_out(layout.spec))


def _pad_of(elastomer: ElastomerPad | None) -> ElastomerPad:
    assert elastomer is not None  # the caller has found its solid
    return elastomer


def elastomer_meshes(
    solids: tuple[Solid, ...], pad_of: ElastomerPad, size: float | None = None, left_out: str = ""
) -> dict[str, bytes]:
    """Return the pad's mesh by file ending: ``msh``, ``inp`` in second order, ``json`` with the quality.

    `left_out` is the deck's text on the film and on other cells, which are not in the deck.
    """
    gmsh = import_extra("gmsh")
    with TemporaryDirectory() as name, session(gmsh, "elastomer"):
        folder = Path(name)
        pad, board, target = (
            [each for solid in select_by_role(solids, role) for each in imported(gmsh, solid.shape, folder)]
            for role in (BodyRole.ELASTOMER, BodyRole.BOARD, BodyRole.TARGET)
        )
        gmsh.model.occ.fragment(pad, board + target)
        gmsh.model.occ.synchronize()
        # Physical groups by the part with which the pad shares a face. Board and target are not meshed
        around = faces(gmsh, pad)
        bottom, top = around & faces(gmsh, board), around & faces(gmsh, target)
        gmsh.model.removeEntities(board + target, recursive=False)
        for tag, (name, group) in enumerate(
            (("bonded_bottom", bottom), ("bonded_top", top), ("free", around - bottom - top)), start=1
        ):
            if group:
                gmsh.model.addPhysicalGroup(2, sorted(group), tag, name)
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in pad], 4, "elastomer")
        # Faces of board and target that are not faces of the pad are not meshed
        strays = [(2, tag) for _, tag in gmsh.model.getEntities(2) if tag not in around]
        gmsh.model.removeEntities(strays, recursive=True)
        bonded = bottom | top
        x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(*pad[0])
        fine = round(min((z1 - z0) / ELEMENTS_THROUGH_THICKNESS, min(x1 - x0, y1 - y0) / ELEMENTS_ACROSS), 6)
        edge = size * 1e3 if size else fine
        gmsh.option.setNumber("Mesh.MeshSizeMin", AT_EDGES * edge)
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        grade(gmsh, edges(gmsh, bonded), (AT_EDGES * edge, edge), 2.0 * edge)
        gmsh.model.mesh.generate(3)
        files = {"msh": written(gmsh, folder / "elastomer.msh")}
        first = quality(gmsh)
        gmsh.model.mesh.setOrder(2)
        files["inp"] = ("\n".join(_deck(gmsh, pad_of, left_out)) + "\n").encode("ascii")
        sizes = {"element_size_m": edge * 1e-3, "size_at_bonded_edges_m": AT_EDGES * edge * 1e-3}
        document = {**sizes, "first_order": first, "second_order": quality(gmsh)}
        return {**files, "json": json_bytes(document)}


AIR, OUTER = "air", "outer"
METALS = {BodyRole.TARGET: "target", BodyRole.SHIELD: "shield", BodyRole.JAW: "jaw", BodyRole.FINGER: "finger",
          BodyRole.METAL_BEHIND: "metal_behind"}
COPPER = ("coils", "layers")
"""Regions of the copper: one per coil, from its topmost to its lowest copper, or one per layer of every coil."""

PER_COIL = 25  # Elements across the smallest coil; sets the size along all edges except the air's
ROOM = 1.5  # Thickness of the air around all parts, over the largest coil's width


@checked_arguments
def field_mesh(
    layout: Layout, size: float | None = None, air: float | None = None, copper: str = "coils"
) -> dict[str, bytes]:
    """Return the mesh for field programs by file ending: ``msh``, ``inp`` and ``json``.

    Parameters
    ----------
    layout
        The layout of one sensor or one cell.
    size
        Element size (m) along all edges of coils, metal and pad. Elements grow with the distance from the edges. The
        default is a twenty-fifth of the smallest coil.
    air
        Thickness (m) of the air around all parts. The default is one and a half times the width of the largest coil.
    copper
        With ``coils``, each coil is a ring as high as its winding, for an evenly distributed current. With ``layers``,
        every layer is a ring (``coil_C1_1``).

    Returns
    -------
    dict
        ``msh`` (MSH 2.2), ``inp`` (Abaqus' input format, which CalculiX and Elmer read), and ``json`` with volume (m3),
        number of tetrahedra and their quality for every region.

    Raises
    ------
    MissingExtra
        without gmsh or a CAD kernel (`pip install 'sitscad[all]'`).
    PartsError
        for a part that cannot exist.
    ValueError
        for lengths that are not positive, for another value of `copper`, and for a layout with several cells.

    Notes
    -----
    The opposing jaw is left out. Regions and sizes depend on the spec alone. The order of points and elements may
    differ between two calls, because OpenCASCADE numbers shared edges by their addresses.
    """
    for length in (size, air):
        if length is not None and not 0.0 < length < float("inf"):
            raise ValueError("sizes of elements and of the air are positive lengths in metres")
    if layout.spec.cells is not None:
        raise ValueError("a field is meshed of one cell: give Layout.cell(1), or another number")
    if copper not in COPPER:
        raise ValueError(f"the copper is meshed as {' or '.join(COPPER)}, not {copper!r}")
    widths = [min(layout.spec.coil.size), max(layout.spec.coil.size)]
    fine, room = size or widths[0] / PER_COIL, air or ROOM * widths[1]
    # build123d solids by the names of their regions
    shapes = {name: shape for coil in layout.coils for name, shape in _rings(layout.spec.coil, coil, copper)}
    pieces = lifted_by_glue(glue_lifts(layout), tuple(s for s in (*metal_below(layout), *assemble(layout))
                                                      if s.role in METALS))
    shapes |= {METALS[solid.role]: solid.shape for solid in pieces}
    pad, gap = plates_of(layout.spec).elastomer, target_gap(layout.spec)
    if pad is not None:
        shapes["elastomer"] = prism(pad.outline(), 0.0, pad.upper if gap is None else gap)
    return _meshed(shapes, fine * MM, room * MM)


def _ring(spec: CoilSpec, coil: Coil, number: int) -> Region:
    """Return the ring that represents a layer of a coil.

    For round coils it follows the mean radius of the tracks over a turn, in which a spiral moves inwards by one pitch.
    The tracks of other shapes step inwards at one place: the ring covers them as drawn.
    """
    turns = ring(spec, coil, number)
    if not spec.outline.is_round:
        return turns
    step = (spec.trace_width + spec.trace_spacing) / 2
    order = [winding.layer for winding in coil.windings].index(number)
    outer = spec.size[0] / 2 - step
    inner = outer + spec.trace_spacing - 2.0 * step * spec.layer_turns[order]
    holes = (circle(Point(*coil.centre), inner),) if inner > LEAST_OPENING else ()
    return Region(circle(Point(*coil.centre), outer), holes)


def _rings(spec: CoilSpec, coil: Coil, copper: str) -> list[tuple[str, Any]]:
    """Return a coil's regions: the ring of its widest layer over the whole height, or a ring for each layer."""
    spans = [(w.layer, w.z - w.thickness / 2, w.z + w.thickness / 2) for w in coil.windings]
    if copper == "layers":
        return [(f"coil_{coil.name}_{n}", prism(_ring(spec, coil, n), low, high)) for n, low, high in spans]
    low, high = min(span[1] for span in spans), max(span[2] for span in spans)
    widest = max(spans, key=lambda span: _ring(spec, coil, span[0]).area)[0]
    return [(f"coil_{coil.name}", prism(_ring(spec, coil, widest), low, high))]


def _meshed(regions: dict[str, Any], fine: float, room: float) -> dict[str, bytes]:
    """Return the mesh files of regions (build123d solids; mm) in air."""
    gmsh = import_extra("gmsh")
    with TemporaryDirectory() as name, session(gmsh, "field"):
        folder = Path(name)
        volumes = _fragmented(gmsh, regions, room, folder)
        within = {face for region, entities in volumes.items() if region != AIR for face in faces(gmsh, entities)}
        # Physical groups: every region, every surface between two regions, and the outer boundary of the air
        beside: dict[int, list[str]] = {}
        for region, entities in volumes.items():
            gmsh.model.addPhysicalGroup(3, [tag for _, tag in entities], name=region)
            for entity in entities:
                for face in faces(gmsh, [entity]):
                    beside.setdefault(face, []).append(region)
        surfaces: dict[str, list[int]] = {}
        for face, names in sorted(beside.items()):
            if len(names) == 1 or names[0] != names[1]:
                surfaces.setdefault("_".join(names) if len(names) > 1 else OUTER, []).append(face)
        for name, tags in surfaces.items():
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        grade(gmsh, edges(gmsh, within), (fine, max(fine, room / 2)), 2.4 * room)
        gmsh.model.mesh.generate(3)
        files = {"msh": written(gmsh, folder / "field.msh")}
        # gmsh's heading would name a temporary folder
        _, _, deck = written(gmsh, folder / "field.inp").split(b"\n", 2)
        files["inp"] = b"*Heading\n coils, metal, pad and air, metres\n" + deck
        worth = {}
        for region, entities in volumes.items():
            volume = sum(gmsh.model.occ.getMass(3, tag) for _, tag in entities) * 1e-9
            worth[region] = {"volume_m3": float(f"{volume:.9g}"), **quality(gmsh, entities)}
        document = {"size_at_edges_m": round(fine * 1e-3, 9), "air_m": round(room * 1e-3, 9), "all": quality(gmsh)}
        return {**files, "json": json_bytes({**document, "regions": worth})}


def _fragmented(gmsh: Any, regions: dict[str, Any], room: float, folder: Path) -> dict[str, list[Entity]]:
    """Return the volumes of every region, with shared faces; the air is last.

    The intersection of two regions belongs to the first.
    """
    bd = import_extra("build123d")
    bounds = bd.Compound(list(regions.values())).bounding_box()
    size, low = bounds.size, bounds.min
    corner = bd.Plane((low.X - room, low.Y - room, low.Z - room))
    around = bd.Solid.make_box(size.X + 2 * room, size.Y + 2 * room, size.Z + 2 * room, corner)
    pieces = {region: imported(gmsh, shape, folder) for region, shape in regions.items()}
    air = imported(gmsh, around, folder)
    ordered = [entity for entities in pieces.values() for entity in entities]
    _, parts = gmsh.model.occ.fragment(air, ordered)
    gmsh.model.occ.synchronize()
    came = dict(zip(ordered, parts[len(air) :], strict=True))
    fragments: dict[str, list[Entity]] = {}
    claimed: set[Entity] = set()
    for region, entities in pieces.items():
        fragments[region] = sorted({part for entity in entities for part in came[entity]} - claimed)
        claimed |= set(fragments[region])
    return {**fragments, AIR: sorted({part for each in parts[: len(air)] for part in each} - claimed)}


@contextmanager
def session(gmsh: ModuleType, name: str) -> Iterator[None]:
    """Provide a new gmsh model with the options `_OPTIONS` set, for use in a `with` statement.

    A session that the caller has open remains open.
    """
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        with suppress(AttributeError, ValueError):  # Windows lacks this signal; only the main thread can set it
            # gmsh sets SIGPIPE to end the process: a server would end when a client disconnects
            signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))
    for option, value in _OPTIONS.items():
        gmsh.option.setNumber(option, value)
    gmsh.model.add(name)
    try:
        yield
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()
