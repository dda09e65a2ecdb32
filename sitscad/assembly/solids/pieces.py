"""Solids of the sensor's parts and of the instrument.

Parts are the board (without copper), stiffener, shield, pad, target and encapsulation. A jaw is modelled from its
dimensions: a flat face for the sensor, and a back with the port's radius. The mount is a seat in the jaw, a bench
plate, a cap on a finger, or a part of the user.

A mount must be an insulator, because the standoff is the distance to the nearest metal behind the coil. A shield lies
between two printed parts, `mount` below and `mount-spacer` above it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest
from typing import Any

from sitscad.assembly.places import stack
from sitscad.assembly.places.bodies import (
    MOUNT_PIECES,
    Body,
    BodyRole,
    Plates,
    backing_of,
    board_heights,
    plates_of,
    top_height,
)
from sitscad.assembly.places.jaws import (
    FILM_ROUNDING,
    POCKET_CLEARANCE,
    board_middle,
    jaw_range,
    jaw_section,
    jaw_with_rims,
)
from sitscad.assembly.solids.imported import import_solid
from sitscad.assembly.solids.plates import adapter, bench_plate, fingertip, over_body
from sitscad.assembly.solids.seat import cut_for_retention, grasper_pad
from sitscad.assembly.solids.solid import (
    MM,
    Solid,
    box,
    extrude_along_jaw,
    import_extra,
    one_solid,
    prism,
    rounded_at_tip,
    sort_by_height,
    subtract,
    top_edges,
)
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, bounding_box
from sitscad.layout.board import Layout
from sitscad.spec.circuit import FpcSpec
from sitscad.spec.mount import Jaw
from sitscad.spec.presets import metal_colour
from sitscad.spec.yaml.source import SpecSource

PAD_COLOUR, STIFFENER_COLOUR = "#e8d8c8", "#8c6a3f"


def board_body(outline: Path, body_end: float, fpc: FpcSpec) -> Solid:
    """Return the board with a straight tail, and with its top face at z = 0.

    From x = `body_end` (m) on, it has only the layers of the tail.
    """
    board, under = stack.board(outline, fpc.stackup), stack.tail_heights(fpc)[0]
    whole = _extruded_board(board, "#c8821e")
    if under - board.lower < 1e-9:
        return whole
    _, y0, x1, y1 = bounding_box((outline,))
    below = box(body_end, y0 - 1e-3, board.lower - 1e-3, x1 + 1e-3, y1 + 1e-3, under)
    return replace(whole, shape=one_solid(whole.shape - below, "board"))


def _extruded_board(body: Body, colour: str) -> Solid:
    return Solid(body.name, prism(body.region, *body.heights), body.material, colour, body.role)


def above_board(plates: Plates) -> tuple[Solid, ...]:
    """Return the pads and targets above the board as solids."""
    return tuple(
        _extruded_board(body, PAD_COLOUR if body.role is BodyRole.ELASTOMER else metal_colour(body.material))
        for body in plates.all
    )


def encapsulation(layout: Layout) -> Solid | None:
    """Return the encapsulation over the board's body, around the pad and over the target, with rounded outer edges.

    Its thickness over pad and target is at least the spec's. Contacts on the body stay open. The board's edges and its
    bottom face are not covered. None if the spec has no encapsulation.
    """
    film = layout.spec.encapsulation
    if film is None:
        return None
    shape = over_body(layout.outline, layout.body, layout.spec.body_outline, 0.0, film.thickness)
    for opening in layout.top_openings:
        shape = shape - prism(opening, -film.thickness, 2 * film.thickness)
    shape = one_solid(shape, "encapsulation")
    for cover in _film_over_cells(plates_of(layout.spec), film.thickness):
        shape = one_solid(shape + cover, "encapsulation")
    shape = subtract(shape, (inside.shape for inside in above_board(plates_of(layout.spec))), "encapsulation")
    return Solid("encapsulation", shape, film.material.name, "#9fc5e8", BodyRole.ENCAPSULATION)


def _film_over_cells(plates: Plates, film: float) -> list[Any]:
    """Return, for each cell, blocks around pad and target with the encapsulation's thickness `film` (m).

    A cell has one block if pad and target have equal outlines.
    """
    blocks = []
    for pad, plate in zip_longest(plates.elastomers, plates.targets):
        if pad and plate and pad.footprint == plate.footprint:
            blocks.append(_rounded_block(plate, 0.0, plate.upper + film, film))
            continue
        if pad:
            blocks.append(_rounded_block(pad, 0.0, pad.upper + film, film))
        if plate:
            blocks.append(_rounded_block(plate, max(0.0, plate.lower - film), plate.upper + film, film))
    return blocks


def _rounded_block(body: Body, lower: float, upper: float, film: float) -> Any:
    block = prism(body.outline(film), lower, upper)
    return block.fillet(FILM_ROUNDING * film * MM, top_edges(block))


TIP_ROUNDING = 0.5e-3
REACH = 2.0
"""A length (m) greater than the length of any part."""


def jaw(layout: Layout) -> Solid | None:
    """Return the jaw's metal as a solid.

    Its face is at the standoff below the board, centred under the board's body.
    """
    fitted, seat, mount = layout.spec.jaw, backing_of(layout.spec).seat_heights, layout.spec.mount
    if seat is None or mount is None or mount.metal is None:
        return None
    metal = mount.metal.name
    if mount.is_jaw_unmeasured and mount.step is not None:
        shape = import_solid(layout.spec.source, mount.step, board_middle(layout.body), seat[0])
    elif fitted is None:
        return None
    elif fitted.step is not None:
        shape = import_solid(layout.spec.source, fitted.step, board_middle(layout.body), seat[0])
    else:
        bar = _bar(layout.body, jaw_with_rims(fitted), seat[0] + (jaw_with_rims(fitted).height - fitted.height))
        bar = _with_pocket(layout.body, fitted, bar, seat[0], (fitted.pocket, fitted.recess))
        shape = cut_for_retention(layout.body, mount, layout.spec.assembly.glue_line, bar, seat[0])
    return Solid("jaw", shape, metal, metal_colour(metal), BodyRole.JAW)


def opposing_jaw(layout: Layout) -> tuple[Solid, ...]:
    """Return the opposing jaw of the closed jaws and its pad, if it has one.

    It touches the sensor's top with its face down. If only a STEP file describes the jaw, the opposing jaw is the
    mirror image of the file, without a pad.
    """
    fitted, mount = layout.spec.jaw, layout.spec.mount
    bd = import_extra("build123d")
    if fitted is None:
        if mount is None or not mount.is_jaw_unmeasured or mount.step is None or mount.metal is None:
            return ()
        shape = import_solid(layout.spec.source, mount.step, board_middle(layout.body),
                             -top_height(layout.spec)).mirror(bd.Plane.XY)
        name = mount.metal.name
        return (Solid("opposing-jaw", shape, name, metal_colour(name), BodyRole.OPPOSING_JAW),)
    pad, top = fitted.opposing_pad_thickness, top_height(layout.spec)
    (x0, x1), y = jaw_range(layout.body, fitted), board_middle(layout.body).y
    mirrored = _opposing_metal(layout.body, layout.spec.source, fitted, -(top + pad)).mirror(bd.Plane.XY)
    metal = fitted.material.name
    solids = [Solid("opposing-jaw", mirrored, metal, metal_colour(metal), BodyRole.OPPOSING_JAW)]
    if pad > 0.0:
        half_width, half_length = jaw_section(fitted).face / 2, (x1 - x0) / 2
        if fitted.opposing_pocket is not None and fitted.opposing_recess:
            half_length, half_width = (size / 2 - POCKET_CLEARANCE for size in fitted.opposing_pocket)
        middle = (x0 + x1) / 2
        sheet = box(middle - half_length, y - half_width, top, middle + half_length, y + half_width, top + pad)
        solids.append(Solid("opposing-pad", sheet, "pad", "#5f6b6d", BodyRole.OPPOSING_PAD))
    return tuple(solids)


def _opposing_metal(body: Box, source: SpecSource, fitted: Jaw, floor: float) -> Any:
    """Return the metal of the opposing jaw, with its face up at height `floor` (m).

    It is a STEP file's solid up to its heel (the end at the hinge), or the assumed cross-section with its own pocket.
    The file does not define the opposing jaw behind the heel, because the shanks of the two jaws cross there.
    """
    if fitted.step is not None:
        shape, (_, heel) = import_solid(source, fitted.step, board_middle(body), floor), jaw_range(body, fitted)
        if heel * MM + 1e-6 < shape.bounding_box().max.X:
            before_heel = (shape & box(heel - REACH, -REACH, -REACH, heel, REACH, REACH)).solids()
            shape = max(before_heel, key=lambda solid: float(solid.volume), default=shape)
        return shape
    recess = fitted.opposing_recess if fitted.opposing_pocket is not None else 0.0
    tall = replace(fitted, height=fitted.height + recess)
    return _with_pocket(body, fitted, _bar(body, tall, floor + recess), floor, (fitted.opposing_pocket, recess))


def _with_pocket(
    body: Box, fitted: Jaw, bar: Any, floor: float, pocket: tuple[tuple[float, float] | None, float] 
) -> Any:
    """Return a jaw's bar with its pad pocket and its window cut out.

    `floor` (m) is the height of the pocket's floor. `pocket` has the pocket's length and width (m), None if there is no
    pocket, and the height of its rims above the floor (m).
    """
    (x0, x1), y, (pad, recess) = jaw_range(body, fitted), board_middle(body).y, pocket
    middle, low, high = (x0 + x1) / 2, floor - 2 * fitted.height, floor + recess + 1e-3
    for size, bottom in ((pad if recess else None, floor), (fitted.fenestration, low)):
        if size is not None:
            half_length, half_width = size[0] / 2, size[1] / 2
            block = box(middle - half_length, y - half_width, bottom, middle + half_length, y + half_width, high)
            bar = one_solid(bar - block, "jaw")
    return bar


def _bar(body: Box, fitted: Jaw, height: float) -> Any:
    """Return the jaw's cross-section extruded along x, with its face up at height `height` (m).

    The tip's corners are rounded as seen from above.
    """
    (x0, x1), y, half = jaw_range(body, fitted), board_middle(body).y, fitted.width / 2
    bar = extrude_along_jaw(jaw_section(fitted).outline, x0, x1, y, height)
    plan = rounded_at_tip(x0, y - half, x1, y + half, min(TIP_ROUNDING, fitted.width / 4))
    return one_solid(bar & prism(plan, height - 2 * fitted.height, height + fitted.height), "jaw")


def assemble(layout: Layout) -> tuple[Solid, ...]:
    """Return the solids of all parts in the spec, from the jaw upwards."""
    sheet = stack.shield(layout)
    shield = None if sheet is None else _extruded_board(sheet, metal_colour(sheet.material))
    plate = stack.stiffener(layout.stiffener, layout.spec.fpc)
    stiffener = None if plate is None else _extruded_board(plate, STIFFENER_COLOUR)
    below = sort_by_height(solid for solid in (jaw(layout), *mount(layout), shield, stiffener) if solid)
    board = board_body(layout.outline, layout.body[2], layout.spec.fpc)
    film = encapsulation(layout)
    return (*below, board, *above_board(plates_of(layout.spec)), *([film] if film else []))


COLOUR = "#dfe6e9"
ADAPTER = "mount-adapter"
MATERIALS = {
    "resin": "printed resin", "powder": "printed powder", "filament": "printed filament", "machined": "milled plastic",
}
BUILDERS = {"grasper-pad": grasper_pad, "bench-plate": bench_plate, "fingertip": fingertip}


def mount(layout: Layout) -> tuple[Solid, ...]:
    """Return the printed parts of the mount from the bottom up. Empty if the board lies directly on metal."""
    mount_spec = layout.spec.mount
    if mount_spec is None:
        return ()
    shapes: tuple[Any, ...] = ()
    if mount_spec.kind != "custom":
        shapes = BUILDERS[mount_spec.kind](layout)
    elif mount_spec.step is not None:
        shapes = (import_solid(layout.spec.source, mount_spec.step, board_middle(layout.body),
                               board_heights(layout.spec.fpc.stackup)[0]),)
    named: list[tuple[str, Any]] = list(zip(MOUNT_PIECES, shapes, strict=False))
    if mount_spec.kind == "bench-plate" and (below := adapter(layout)) is not None:
        named.insert(0, (ADAPTER, below))
    material = MATERIALS[mount_spec.process]
    return tuple(Solid(name, shape, material, COLOUR, BodyRole.MOUNT) for name, shape in named)
