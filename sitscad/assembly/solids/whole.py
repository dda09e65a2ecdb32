"""The complete glued assembly in closed jaws: all layers of the board, copper, glue, and the tail on its path.

The board is modelled layer by layer (coverlay, copper, dielectric) in the body and along the tail. The copper of each
coil on each layer is a ring from the outermost to the innermost track. The adhesive of the coverlay or bonding sheet
fills the space between and beside the rings. Leads, stubs, pads and contacts are too fine for solids. Their volume is
computed from the layout, track by track. `weigh` adds it to the layer around them. Overlaps of tracks and pads are
counted twice, and the plating in holes is left out. This causes errors of a few per cent.

Flat parts of the tail are placed along its path: straight parts are moved, and bent parts are revolved about the bend's
axis. Glue lies between all touching parts, over their common area. Solids are modelled at their heights without glue
and then raised by the glue.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, cached_property
from itertools import pairwise
from typing import Any

from sitscad.assembly.places import stack
from sitscad.assembly.places.bodies import (
    MOUNT_PIECES,
    Body,
    BodyRole,
    Heights,
    backing_of,
    board_heights,
    target_lines,
)
from sitscad.assembly.places.column import GLUE, column, layer_heights
from sitscad.assembly.places.state import Vector
from sitscad.assembly.places.tail_path import BentStretch, Station, TailPath, tail_path
from sitscad.assembly.solids import assembly_aids
from sitscad.assembly.solids.pieces import STIFFENER_COLOUR, assemble, encapsulation, opposing_jaw
from sitscad.assembly.solids.plates import metal_below
from sitscad.assembly.solids.solid import MM, PartsError, Solid, extrude_face, face, import_extra, prism, sort_by_height
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.record import record
from sitscad.data import cited, rows
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, Region, bounding_box, rectangle
from sitscad.layout.bending import bend_stretch
from sitscad.layout.board import Coil, Layout, Pad, Role, Trace, Via
from sitscad.spec.circuit import LayerKind, StackLayer
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import Adhesive, ElastomerMaterial

COLOURS = {"coverlay": "#c8821e", "copper": "#d98a4b", "dielectric": "#b0741c", "fill": "#d9b26a"}
FILL = "adhesive"
LEAST_OPENING = 50e-6  # Openings inside a coil narrower than this (m) are filled in
"""Width (m) below which the opening inside a coil is filled in the model."""


def board_layer_solids(layout: Layout, path: TailPath | None, bent_width: tuple[float, float]) -> tuple[Solid, ...]:
    """Return the board's layers as solids, from the top down: the layers of its body, then the tail's along `path`.

    `bent_width` is the range of y (m) of the tail's bent parts.
    """
    solids: list[Solid] = []
    upper, number = 0.0, 0
    body = _body_face(layout.body, layout.outline)
    for index, layer in enumerate(layout.spec.fpc.stackup.layers):
        number += layer.kind is LayerKind.COPPER
        heights = upper - layer.thickness, upper
        rings = []  # of coils on this layer, each inside the board's body
        if layer.kind is LayerKind.COPPER:
            x0, y0, x1, y1 = layout.body
            for coil in (each for each in layout.coils if any(w.layer == number for w in each.windings)):
                plate = ring(layout.spec.coil, coil, number)
                left, low, right, high = bounding_box((plate.outline,))
                if left > x0 and low > y0 and right < x1 and high < y1:
                    rings.append((coil, plate))
        solids += _body_layer_solids(body, layer, index, number, heights, rings)
        upper = heights[0]
    if path is None:
        return tuple(solids)
    upper = 0.0
    flat = tail_plan(path, Region(layout.outline), bent_width)
    for index, layer in enumerate(layout.spec.fpc.tail_layers):
        shape = flat.placed_solid(upper - layer.thickness, upper)
        kind = "fill" if layer.kind is LayerKind.COPPER else layer.kind.value
        solids.append(Solid(f"tail-{index + 1}-{kind}", shape, _material(layer), COLOURS[kind], BodyRole.BOARD))
        upper -= layer.thickness
    return tuple(solids)


def _body_face(body: Box, outline: Path) -> Any:
    """Return the board's outline up to the body's end as a face in the plane z = 0."""
    return (face(Region(outline)) & face(Region(rectangle(*body)))).faces()[0]


def ring(spec: CoilSpec, coil: Coil, number: int) -> Region:
    """Return the ring that a coil's tracks cover on one of its layers, as a region from above.

    `number` is the number of the copper layer. `spec` describes coils that have no windings of their own.
    """
    spec = coil.placement.own or spec
    order = [winding.layer for winding in coil.windings].index(number)
    depth = spec.layer_turns[order] * (spec.trace_width + spec.trace_spacing) - spec.trace_spacing
    outer = _move_to_coil(spec.outline.edge(spec.size, spec.corner_radius + spec.trace_width / 2), coil)
    if min(spec.size) / 2 - depth < LEAST_OPENING:
        return Region(outer)
    return Region(outer, (_move_to_coil(spec.outline.boundary(spec.size, -depth), coil),))


def _move_to_coil(path: Path, coil: Coil) -> Path:
    return path.rotated(coil.placement.rotation).shifted(*coil.centre)


def _body_layer_solids(
    body: Any, layer: StackLayer, index: int, number: int, heights: Heights, rings: list[tuple[Coil, Region]]
) -> Iterator[Solid]:
    """Yield the solids of one layer of the body. A copper layer has the rings of coils and the adhesive around them.

    `body` is the body's outline as a face, `index` the layer's position from the top, and `number` the number of a
    copper layer. `rings` are the coils on the layer with their rings.
    """
    kind = layer.kind.value
    if layer.kind is not LayerKind.COPPER:
        name, shape = f"board-{index + 1}-{kind}", extrude_face(body, *heights)
        yield Solid(name, shape, _material(layer), COLOURS[kind], BodyRole.BOARD)
        return
    if rings:
        holes = [face(Region(plate.outline)).outer_wire() for _, plate in rings]
        body = import_extra("build123d").Face(body.outer_wire(), holes)
    name = f"board-{index + 1}-fill"
    yield Solid(name, extrude_face(body, *heights), FILL, COLOURS["fill"], BodyRole.BOARD)
    for coil, plate in rings:
        yield Solid(
            f"copper-{number}-{coil.name}", prism(plate, *heights), "copper", COLOURS["copper"], BodyRole.COPPER
        )
        if plate.holes:
            middle = prism(plate.holes[0], *heights)
            yield Solid(f"{name}-{coil.name}", middle, FILL, COLOURS["fill"], BodyRole.BOARD)


def _material(layer: StackLayer) -> str:
    return FILL if layer.kind is LayerKind.COPPER else layer.material


CHORD = 1e-5  # Arcs of tracks count as chords within this (m)
"""Largest distance (m) of tracks' arcs from their chords."""


def copper_in_films(layout: Layout, drawn_rings: frozenset[str]) -> dict[str, float]:
    """Return the copper volume (m3) inside the adhesive of each copper layer, by the name of the adhesive's solid.

    `drawn_rings` are the names of coil rings that are separate solids. The tracks of these coils are left out.
    """
    stack = layout.spec.fpc.stackup
    body = dict(_copper_layer_names("board", stack.layers))
    tail = dict(_copper_layer_names("tail", layout.spec.fpc.tail_layers))
    names = {coil.net: coil.name for coil in layout.coils}
    volumes: defaultdict[str, float] = defaultdict(float)
    for number, layer in enumerate(stack.copper, 1):
        rings = {net for net, name in names.items() if f"copper-{number}-{name}" in drawn_rings}
        traces = [t for t in layout.on_layer(number) if t.role is not Role.WINDING or t.net not in rings]
        pads = [pad for pad in layout.all_pads if pad.layer == number]
        for area, x in _copper_areas(traces, layout.vias_on(number), pads, layout.body[2]):
            film = body[number] if x <= layout.body[2] else tail.get(number)
            if film is not None:
                volumes[film] += area * layer.thickness
    return dict(volumes)


def _copper_layer_names(part: str, layers: tuple[StackLayer, ...]) -> Iterator[tuple[int, str]]:
    """Yield (number of the copper layer, name of the adhesive's solid) for each copper layer of a part of the board."""
    number = 0
    for index, layer in enumerate(layers):
        if layer.kind is LayerKind.COPPER:
            number += 1
            yield number, f"{part}-{index + 1}-fill"


def _copper_areas(
    traces: Sequence[Trace], vias: Sequence[Via], pads: Sequence[Pad], body_end: float
) -> Iterator[tuple[float, float]]:
    """Yield (area in m2, x in m) of each piece of track, via or pad on a layer.

    Tracks are divided at x = `body_end` (m).
    """
    for trace in traces:
        for a, b in pairwise(trace.path.flattened(CHORD)):
            cut = (body_end - a.x) / (b.x - a.x) if a.x != b.x else 0.0
            places = (0.0, cut, 1.0) if 0.0 < cut < 1.0 else (0.0, 1.0)
            for first, last in pairwise(places):
                yield (last - first) * a.distance(b) * trace.width, a.x + 0.5 * (first + last) * (b.x - a.x)
    for via in vias:
        yield math.pi / 4 * (via.pad**2 - via.drill**2), via.centre.x
    for pad in pads:
        yield pad.size[0] * pad.size[1], pad.centre.x


BEYOND = 1e-3


@record(eq=False)
class FlatPart:
    """A piece of a flat region that belongs to one part of the tail's path.

    `first` is the x (m) at which the part begins on the flat board, and `here` this point on the path. `faces` are the
    faces of a straight part (build123d, in the plane z = 0). Empty for a bent part.
    """

    first: float
    here: Station
    stretch: BentStretch
    faces: tuple[Any, ...] = ()


@record(eq=False)
class FlatPlan:
    """A flat region divided by the parts of the tail's path.

    `middle` (m) is the height of the tail's middle line on the flat board. `width` is the range of y (m) of the bent
    parts.
    """

    parts: tuple[FlatPart, ...]
    middle: float
    width: tuple[float, float]

    def placed_solid(self, lower: float, upper: float) -> Any:
        """Return the region between two heights (m, on the flat board), placed along the tail's path.

        The result is one build123d solid in millimetres. Raises `PartsError` if it is empty or in several pieces.
        """
        pieces = [piece for part in self.parts for piece in self._pieces(part, lower, upper)]
        if not pieces:
            raise PartsError("the tail has no part beyond the board's body")
        solids = pieces[0].fuse(*pieces[1:]).solids() if len(pieces) > 1 else pieces
        if len(solids) != 1:
            raise PartsError(f"the tail falls into {len(solids)} pieces along its way")
        return solids[0]

    def _pieces(self, part: FlatPart, lower: float, upper: float) -> list[Any]:
        if part.stretch.turn:
            # A bent stretch: the tail's section there, drawn out round the bend's axis
            bd, here, (low, high) = import_extra("build123d"), part.here, (lower - self.middle, upper - self.middle)
            normal = (-math.sin(here.angle), math.cos(here.angle))
            y0, y1 = self.width
            corners = (y0, low), (y1, low), (y1, high), (y0, high)
            points = [((here.x + h * normal[0]) * MM, y * MM, (here.z + h * normal[1]) * MM) for y, h in corners]
            section = bd.Face(bd.Wire.make_polygon([bd.Vector(*point) for point in points]))
            radius = part.stretch.length / part.stretch.turn
            centre = ((here.x + radius * normal[0]) * MM, 0.0, (here.z + radius * normal[1]) * MM)
            return [bd.Solid.revolve(section, math.degrees(part.stretch.turn), bd.Axis(centre, (0, -1, 0)))]
        return [_move_to_station(extrude_face(each, lower, upper), part, self.middle) for each in part.faces]


def tail_plan(path: TailPath, region: Region, bent_width: tuple[float, float]) -> FlatPlan:
    """Return the part of a flat region beyond the body, divided by the parts of the tail's path.

    `bent_width` is the range of y (m) of the bent parts.
    """
    x0, y0, x1, y1 = bounding_box((region.outline,))
    whole, here, first, parts = face(region), path.start, path.start.x, []
    for stretch in path.stretches:
        end = x1 + BEYOND if stretch is path.stretches[-1] else first + stretch.length
        if end > x0 and first < x1 and stretch.length > 0.0:
            room = face(Region(rectangle(first, y0 - BEYOND, end, y1 + BEYOND)))
            cut = () if stretch.turn else tuple((whole & room).faces())
            parts.append(FlatPart(first, here, stretch, cut))
        here, first = here.after(stretch), first + stretch.length
    return FlatPlan(tuple(parts), path.start.z, bent_width)


def stiffener_on(plate: Body | None, path: TailPath | None, bent_width: tuple[float, float]) -> Solid | None:
    """Return the stiffener under the contacts as a solid, at the end of the tail on its path. None if there is none."""
    if plate is None:
        return None
    flat = extrude_face(face(plate.region), *plate.heights)
    shape = flat if path is None else tail_plan(path, plate.region, bent_width).placed_solid(*plate.heights)
    return Solid(plate.name, shape, plate.material, STIFFENER_COLOUR, BodyRole.STIFFENER)


def _move_to_station(flat: Any, part: FlatPart, middle: float) -> Any:
    """Return a flat solid moved to its point on the tail's path, with its height `middle` (m) on the middle line."""
    bd = import_extra("build123d")
    to_origin = bd.Location((-part.first * MM, 0, -middle * MM))
    to_place = bd.Location((part.here.x * MM, 0, part.here.z * MM), (0, -math.degrees(part.here.angle), 0))
    return flat.moved(to_place * to_origin)


COLOUR = "#b6d7a8"
SAME_LEVEL = 1e-6  # mm


SOFT_LINES = ("elastomer", "target")
"""Parts that are glued with the pad's adhesive. Other parts are glued with the adhesive for hard faces."""


def glue_lines(layout: Layout, pieces: tuple[Solid, ...], hard: Adhesive | None = None) -> tuple[Solid, ...]:
    """Return a solid for each glue line between parts at their glued heights. Empty if glue lines have no thickness.

    `hard` is the adhesive of the glue lines up to the board; None for the spec's adhesive.
    """
    line, glue = layout.spec.assembly.glue_line, layout.spec.assembly.adhesive
    if not line or glue is None:
        return ()
    # The board's body, whose films are pieces of their own
    bd, body = import_extra("build123d"), _body_face(layout.body, layout.outline)
    shapes = {solid.name: solid.shape for solid in pieces}
    low, high = (height * MM for height in board_heights(layout.spec.fpc.stackup))
    plates = {name: _level_faces(shape) for name, shape in shapes.items()} | {
        "board": [body.moved(bd.Location((0, 0, height))) for height in (low, high)]
    }
    lines = []
    # The pieces that have glue under them
    named = [layer.part.removeprefix(GLUE) for layer in column(layout) if layer.is_glue]
    kinds = named or ["shield", "mount-spacer", "board", "elastomer", "target"]
    for part in [name for kind in kinds for name in plates if _piece_kind(name) == kind]:
        lowest = low if part == "board" else float(shapes[part].bounding_box().min.Z)
        shape = _glue_line(part, plates, lowest, line * MM)
        if shape is not None:
            used = glue if hard is None or _piece_kind(part) in SOFT_LINES else hard
            lines.append(Solid(f"glue-{part}", shape, used.name, COLOUR, BodyRole.GLUE))
    return tuple(lines)


def _glue_line(part: str, plates: dict[str, list[Any]], low: float, line: float) -> Any | None:
    """Return the glue under a part, `line` (mm) thick. None if no part is below.

    `plates` has the horizontal faces of each part by its name. The glue covers the part's lower face at height `low`
    (mm), as far as faces of other parts lie below it.
    """
    bd, height = import_extra("build123d"), low - line
    below = [each for name, plate in plates.items() if name != part for each in _faces_at(plate, height)]
    if not below:
        return None
    bounds = [each.bounding_box() for each in below]
    x0, y0 = min(b.min.X for b in bounds), min(b.min.Y for b in bounds)
    x1, y1 = max(b.max.X for b in bounds), max(b.max.Y for b in bounds)
    widest = max(_faces_at(plates[part], low), key=lambda each: float(each.area))
    upright = widest if widest.normal_at().Z > 0 else -widest
    reach = face(Region(rectangle(x0 / MM, y0 / MM, x1 / MM, y1 / MM)))
    plan = (upright.moved(bd.Location((0, 0, -low))) & reach).faces()
    if not plan:
        return None
    return extrude_face(plan[0].moved(bd.Location((0, 0, height))), 0.0, line / MM)


def _faces_at(faces: list[Any], height: float) -> list[Any]:
    """Return the faces whose centre is at a height (mm)."""
    return [each for each in faces if abs(each.center().Z - height) < SAME_LEVEL]


def _level_faces(shape: Any) -> list[Any]:
    """Return a shape's horizontal faces.

    Most other faces are excluded by the heights of their corners, because the CAD kernel computes exact boxes slowly.
    """
    corners = [(each, [corner.Z for corner in each.vertices()]) for each in shape.faces()]
    return [each for each, z in corners if max(z) - min(z) < SAME_LEVEL and each.bounding_box().size.Z < SAME_LEVEL]


def lifted_by_glue(lifts: dict[str, float], solids: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """Return the solids raised by the glue lines below them (`lifts` by name, m; see `glue_lifts`).

    The board stays in place.
    """
    bd = import_extra("build123d")
    lifted = ((s, lifts.get(_piece_kind(s.name))) for s in solids)
    return tuple(replace(s, shape=s.shape.moved(bd.Location((0, 0, by * MM)))) if by else s for s, by in lifted)


def _piece_kind(name: str) -> str:
    """Return a part's name without the number of its cell. Webs have the name of pads."""
    kind, _, number = name.rpartition("-")
    return kind.removesuffix("-web") if number.isdecimal() else name


def glue_lifts(layout: Layout) -> dict[str, float]:
    """Return the height (m) by which glue raises each part: its lower face's height with glue, minus without glue."""
    at, mount = layer_heights(column(layout)), layout.spec.mount
    if not at or mount is None:
        # The same (m) without a jaw: glue is under the pad and the target, under the board, and round a shield
        spec = layout.spec
        line, all_lines = spec.assembly.glue_line, target_lines(spec)
        sheet = backing_of(spec).shield_heights
        above = all_lines or line * (spec.elastomer is not None)
        below = 0 if sheet is None else 1 + (board_heights(spec.fpc.stackup)[0] - sheet[1] > SPACED)
        lifts = {"elastomer": line, "target": all_lines, "encapsulation": above, "opposing-jaw": above}
        spacer = {MOUNT_PIECES[1]: -line, "shield": -line * below} if below else {}
        # a jaw that only a STEP file describes
        lifts["jaw"] = -line * (1 + len(backing_of(spec).spans) + (sheet is not None))
        lowest = (BodyRole.FINGER, BodyRole.METAL_BEHIND, "mount-adapter", MOUNT_PIECES[0])
        return lifts | dict.fromkeys(lowest, -line * (1 + below)) | spacer
    board = at["board"][0].nominal - board_heights(layout.spec.fpc.stackup)[0]
    glued_faces = {part: lower.nominal - board for part, (lower, _) in at.items()}
    lower_faces = {body.role.value: body.lower for body in stack.stack(layout)}  # (m) of the pieces alone
    lower_faces |= {name: lower for name, (lower, _) in zip(MOUNT_PIECES, backing_of(layout.spec).spans, strict=False)}
    lifts = {part: glued_faces[part] - lower for part, lower in lower_faces.items() if part in glued_faces}
    return lifts | {"encapsulation": lifts.get("target", lifts.get("elastomer", 0.0))}


SPACED = 1e-9  # A shield farther from the board than this (m) has a spacer on it
"""Distance (m) between shield and board above which a spacer lies between them."""


@checked_arguments
def whole(
    layout: Layout, pieces: tuple[Solid, ...] | None = None, hard_glue: Adhesive | None = None
) -> tuple[Solid, ...]:
    """Return all pieces in their places, from the jaw upwards.

    They are jaw, seat, shield, the board's films, stiffener, elastomer, target, film and the closed opposing jaw, with
    the glue lines between them. The board's films have a copper ring for each coil on each layer. A metal finger is
    drawn in its cap. Metal behind the board is included. The assembly is glued, with z = 0 at the board's top face.

    Parameters
    ----------
    layout
        The layout of a sensor.
    pieces
        The result of `sitscad.assembly.solids.pieces.assemble`, if it is already known.
    hard_glue
        The adhesive of the lines up to the board. The spec's adhesive if None.

    Returns
    -------
    tuple of Solid
        Solids with name, material and shape (mm).

    Raises
    ------
    PartsError
        if a part cannot exist
    MissingExtra
        without a CAD kernel
    """
    alone = assemble(layout) if pieces is None else pieces
    pieces = lifted_by_glue(glue_lifts(layout), (*alone, *opposing_jaw(layout), *metal_below(layout)))
    path = tail_path(layout)
    # the encapsulation over pieces that glue lifts is that of a pad so much thicker
    spec, pad, lines = layout.spec, layout.spec.elastomer, target_lines(layout.spec)
    if pad is not None and lines:
        spec = replace(spec, elastomer=replace(pad, thickness=pad.thickness + lines))
    cover = encapsulation(replace(layout, spec=spec))
    # the tail's extent across where it may be bent
    stretch = bend_stretch(layout)
    bent_width = (0.0, 0.0) if stretch is None else layout.reach_at(sum(stretch) / 2)
    board = board_layer_solids(layout, path, bent_width)
    plate = stiffener_on(stack.stiffener(layout.stiffener, layout.spec.fpc), path, bent_width)
    rigid = [s for s in pieces if s.role not in (BodyRole.BOARD, BodyRole.STIFFENER, BodyRole.ENCAPSULATION)]
    glue = glue_lines(layout, tuple(rigid), hard_glue)
    solids = [*rigid, *board, *glue, *([plate] if plate else []), *([cover] if cover else [])]
    return tuple(sort_by_height(solids))


@record(eq=False)
class Solids:
    """Solids of a sensor. They are computed at the first access, which imports a CAD kernel, and cached.

    `hard_glue` is the adhesive of the glue lines up to the board; None for the spec's adhesive.
    """

    layout: Layout
    hard_glue: Adhesive | None = None

    @cached_property
    def alone(self) -> tuple[Solid, ...]:
        """All solids of the spec, without glue."""
        return assemble(self.layout)

    @cached_property
    def whole(self) -> tuple[Solid, ...]:
        """All parts of the glued assembly in closed jaws."""
        return whole(self.layout, self.alone, self.hard_glue)

    @cached_property
    def aids(self) -> tuple[Solid, ...]:
        """Solids of the assembly tools: jig and moulds."""
        return assembly_aids(self.layout)


CARRIERS = (BodyRole.JAW, BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD)
"""Roles of the instrument's parts, which do not belong to the sensor."""


@record
class Weight:
    """A part's volume (m3), density (kg/m3), mass (kg) and centre of mass (m).

    Mass and density are None if no density is known. `source` is the source of the density. `share` is the fraction of
    the volume that is material, because a coil's ring consists of tracks and gaps. `copper` (m3) is the volume of leads
    and contacts in a layer of another material. The mass includes this copper. `is_carrier` is True for the
    instrument's parts.
    """

    name: str
    material: str
    volume: float
    density: float | None
    mass: float | None
    centre: Vector
    source: str
    share: float = 1.0
    is_carrier: bool = False
    copper: float = 0.0


@record
class Balance:
    """Total mass (kg) and centre of mass (m) of several parts, and the names of the parts without a known mass."""

    mass: float
    centre: Vector
    unknown: tuple[str, ...]


def weigh(layout: Layout, solids: tuple[Solid, ...]) -> tuple[Weight, ...]:
    """Return the weight of each part of the assembly, in the order of the solids.

    A finger and metal behind the board are left out, because they are drawn incompletely.
    """
    # Densities (kg/m3) of the spec's silicones, with their sources
    spec = layout.spec
    parts = (spec.elastomer, spec.encapsulation)
    silicones: list[ElastomerMaterial] = [part.material for part in parts if part is not None]
    densities = {each.name: (each.density, each.source) for each in silicones if each.density is not None}
    leads = copper_in_films(layout, frozenset(s.name for s in solids if s.role is BodyRole.COPPER))
    return tuple(_weight(layout.coils, layout.spec.coil.trace_width, solid, densities,
                         leads.get(solid.name, 0.0)) for solid in solids
                 if solid.role not in (BodyRole.FINGER, BodyRole.METAL_BEHIND))


def balance(weights: tuple[Weight, ...]) -> Balance:
    """Return the total mass and the centre of mass of all parts."""
    masses = [(w, w.mass) for w in weights if w.mass is not None]
    mass = math.fsum(m for _, m in masses)
    centre = [math.fsum(m * w.centre[axis] for w, m in masses) / mass if mass else 0.0 for axis in range(3)]
    return Balance(mass, (centre[0], centre[1], centre[2]), tuple(w.name for w in weights if w.mass is None))


@cache
def density(material: str) -> tuple[float, str] | None:
    """Return a material's density (kg/m3) and its source. None if the table has no such material."""
    of = (row for row in rows("densities") if row["material"] == material)
    return next(((float(row["density"]), cited(row)) for row in of), None)


def _weight(
    coils: tuple[Coil, ...], trace_width: float, solid: Solid, densities: dict[str, tuple[float, str]], copper: float
) -> Weight:
    """Return the weight of a solid, with `copper` (m3) of leads and contacts in it.

    `trace_width` (m) is the width of the coils' tracks. `densities` maps materials to density (kg/m3) and source. If a
    material is missing there, the table of materials is used. If no density is known, the mass is None.
    """
    x, y, z = (float(value) * 1e-3 for value in solid.shape.center(import_extra("build123d").CenterOf.MASS))
    track_fraction = track_share(coils, trace_width, solid) if solid.role is BodyRole.COPPER else 1.0
    entry, of_copper = densities.get(solid.material) or density(solid.material), density("copper")
    assert of_copper is not None
    mass = None if entry is None else (solid.volume * track_fraction - copper) * entry[0] + copper * of_copper[0]
    value, source = entry or (None, "no density is known: weigh it")
    is_carrier = solid.role in CARRIERS
    return Weight(solid.name, solid.material, solid.volume, value, mass, (x, y, z), source, track_fraction, is_carrier,
                  copper)


def track_share(coils: tuple[Coil, ...], trace_width: float, solid: Solid) -> float:
    """Return the fraction of a coil's ring (`solid`) that tracks of this width (m) fill."""
    _, number, name = solid.name.split("-", 2)
    coil = next(coil for coil in coils if coil.name == name)
    winding = next(winding for winding in coil.windings if winding.layer == int(number))
    width = trace_width if coil.placement.own is None else coil.placement.own.trace_width
    tracks = winding.path.length * width * winding.thickness
    return min(1.0, tracks / solid.volume)
