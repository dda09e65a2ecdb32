"""Places of pieces in words: against which ledge each piece is pushed, how near to its place it has to come, how wide
and how high it is there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.geometry.convex import Box
from sitscad.layout.board import Layout
from sitscad.parts.seat import GROOVE_DEPTH, grooves
from sitscad.scene import stack
from sitscad.scene.bodies import MOUNT_PIECES, Body, elastomers, seat_spans, targets
from sitscad.scene.column import Levels, placement
from sitscad.scene.jaws import POCKET_CLEARANCE, half_width, jaw_range, room_across, section
from sitscad.scene.seating import clearance, process_clearance, relief, retention, side_ledges, stop_place
from sitscad.spec.mount import Jaw, StepPart
from sitscad.units import in_mm

FLUSH = 10e-6  # Steps below this (m) are none

FILM = "film that no glue holds (polyethylene or PTFE)"

GAUGE, FILM_STEP = 0.05e-3, 0.05e-3
"""Thinnest gap (m) that a feeler gauge measures well, and step of films' thicknesses (m). From memory, not verified."""


def near(layout: Layout) -> str:
    """Tolerance of a piece's place, along and across."""
    return f"+-{1e3 * placement(layout.spec.assembly).band:.3f} mm"


def piece_sizes(layout: Layout) -> dict[str, tuple[float, float]]:
    """Place of the end at the tip, and width (m) where it is widest, of each piece between a jaw's metal and the board.

    Pieces of a mount widen upwards, as far as the port leaves them room.
    """
    ledges, stop, half, x0 = side_ledges(layout), stop_place(layout), layout.body_size[1] / 2, layout.body[0]
    found = {}
    for name, (_, top) in zip(MOUNT_PIECES, seat_spans(layout.spec), strict=False):
        found[name] = x0, 2.0 * min(half, room_across(layout, top))
    if "mount" in found and (stop is not None or ledges is not None):  # they stand up to the board's top face
        wide = 2.0 * min(half if ledges is None else ledges[1], room_across(layout, 0.0))
        found["mount"] = (x0 if stop is None else stop[0]), wide
    sheet = stack.shield(layout)
    if sheet is not None:
        found["shield"] = x0, 2.0 * half_width(layout, sheet.heights[0])
    return found


def squared(layout: Layout, stiff: list[str]) -> str:
    """The places of mount and shield on the jaw, and how they are kept straight.

    Empty if a joint places them; a pocket has room that films take. A film between each strip and the jaw makes room
    for a mount that is about as wide as the jaw, or wider: every pair of widths leaves a gap that a gauge measures.
    """
    jaw, mount = layout.spec.jaw, layout.spec.mount
    if jaw is None or mount is None or retention(layout) is not None or not stiff:
        return ""
    if jaw.pocket is not None:
        return _in_pocket(layout, jaw, stiff) if jaw.recess else ""
    tip, face, sizes = jaw_range(layout, jaw)[0], section(jaw).face, piece_sizes(layout)
    ends = {part: sizes[part][0] - tip for part in stiff}
    wide = {part: sizes[part][1] for part in stiff}
    narrower = {part: (face - width) / 2 for part, width in wide.items()}
    film = max(0.0, FILM_STEP * math.ceil((GAUGE - min(narrower.values())) / FILM_STEP - 1e-9))
    between = f", a film of {in_mm(film)} mm between each and the jaw" if film else ""
    widths = ", ".join(f"the {part} {1e3 * width:.3f}" for part, width in wide.items())
    gaps = ", ".join(f"{1e3 * (film + gap):.3f} mm beside the {part}" for part, gap in narrower.items())
    places = ", ".join(f"{part} {in_mm(end, 2)}" for part, end in ends.items())
    own = "half of what the jaw is wider" if not film else "the film and half of what the jaw is wider (less, if not)"
    return (
        f" Before any glue, clamp two straight waxed strips against the jaw's sides, high enough to stand beside all "
        f"that is glued{between}. As drawn the jaw's face is {1e3 * face:.3f} mm wide, {widths}: feeler gauges on both "
        f"sides of each piece, {gaps}, put it in the middle to {near(layout)}. Measure your own widths: the gap is "
        f"{own}. From the jaw's tip to each piece's own end there (caliper; a block clamped across to push it against) "
        f"are, in mm: {places}, to {near(layout)}. What a piece is turned by is read as force."
    )


def _in_pocket(layout: Layout, jaw: Jaw, stiff: Sequence[str]) -> str:
    """The places of mount and shield in the jaw's pocket: how thick the films at its end and its sides are."""
    assert jaw.pocket is not None
    (along, across), sizes, found = jaw.pocket, piece_sizes(layout), []
    start = sum(jaw_range(layout, jaw)) / 2 - along / 2
    for part in stiff:
        end, width = sizes[part]  # a seat is cut back to the pocket, with its clearance
        gaps = (max(gap, POCKET_CLEARANCE) for gap in (end - start, (across - width) / 2))
        found.append(f"{part} {' and '.join(in_mm(gap, 2) for gap in gaps)}")
    return (
        f" In the jaw's pocket, strips of {FILM} between each piece and the pocket's end at the tip, and beside it on "
        f"both sides, put it in its place to {near(layout)}; thickness at the end and at the sides, in mm: "
        f"{', '.join(found)}."
    )


def against_stop(layout: Layout) -> str:
    """The board's place on a grasper's mount: how far from the stop and the ledges, or flush; a whole sentence."""
    room, mount = clearance(layout.spec.mount), layout.spec.mount
    jaw = layout.spec.jaw
    assert mount is not None and jaw is not None
    away = in_mm(layout.body[0] - jaw_range(layout, jaw)[0], 2)
    end = f"its end {away} mm from the jaw's tip, to {near(layout)}"
    over = layout.body_size[1] / 2 - half_width(layout, seat_spans(layout.spec)[-1][1])
    alike = f"stand out by {in_mm(over, 2)} mm beside the mount's floor" if over > FLUSH else "are flush with the mount"
    beside = f"; its sides {alike}, the same on both"
    if side_ledges(layout) is not None:
        beside = "; the same film beside it on both sides keeps it in the middle between the ledges"
    if stop_place(layout) is None:
        return f"The board lies with its end flush with the mount's end at the tip ({end}){beside}."
    return (
        f"Do not push the board against the stop itself: {in_mm(room)} mm between them are part of its place ({end}). "
        f"Stand a strip of {FILM}, as thick as this gap, at the stop and push the board against that{beside}."
    )


def _tail_end(layout: Layout) -> str:
    """The end of the board where its tail leaves, in words."""
    return "the tail" if layout.spec.fpc.tail is not None else "the end at large x (drawing of the board)"


def in_base(layout: Layout) -> str:
    """The board's place in the jig's base; a whole sentence."""
    room = clearance(layout.spec.mount)
    return (
        f" The recess is {in_mm(room)} mm larger on each side: put strips of {FILM}, as thick, along the wall away "
        f"from {_tail_end(layout)} and one long wall, and push the board against both."
    )


def in_well(layout: Layout, part: str) -> str:
    """How a piece comes to its place in a frame's well, though frame and well have room; whole sentences."""
    room, end = process_clearance(layout.spec.mount), _tail_end(layout)
    pieces = elastomers(layout.spec) if part == "elastomer" else targets(layout.spec)
    (x0, y0, x1, y1), (left, low, right, high) = layout.body, _box(pieces)
    what = f"the {part}" if part == "elastomer" or layout.spec.elastomer is None else "the press with the target"
    edges = ", ".join(in_mm(gap, 3) for gap in (left - x0, x1 - right, low - y0, y1 - high))
    strip = f", and against a strip of {FILM}, {in_mm(room, 3)} mm thick, at one long wall"
    return (
        f" Frame and well have {in_mm(room, 3)} mm of room on each side: keep the frame pushed towards {end} on its "
        f"pins, and {what} in the well against the wall away from {end}, which takes that back"
        f"{'' if pieces[0].footprint.is_round else strip}. Try it dry first, and measure under the microscope: from "
        f"the body's edges (away from {end}; at it; right and left of it, seen towards it) to the "
        f"{part}'s are, in mm: {edges}, to {near(layout)}."
    )


def _box(pieces: Sequence[Body]) -> Box:
    """The box (m) round all pieces."""
    boxes = [piece.footprint.box for piece in pieces]
    return min(b[0] for b in boxes), min(b[1] for b in boxes), max(b[2] for b in boxes), max(b[3] for b in boxes)


def in_recess(layout: Layout) -> str:
    """The board's place in the recess of a plate or a cap; a whole sentence."""
    room = clearance(layout.spec.mount)
    return (
        f" The recess is {in_mm(room)} mm larger on each side: push the board against strips of {FILM}, as thick, "
        f"along the wall away from {_tail_end(layout)} and one long wall, to {near(layout)}."
    )


def on_own(layout: Layout, part: StepPart | None) -> str:
    """Where the board lies on a mount of the user's own; whole sentences."""
    x0, y0, x1, y1 = layout.body
    size = f"{in_mm(x1 - x0, 2)} x {in_mm(y1 - y0, 2)} mm"
    if part is None:
        return f" It takes a flat face of {size}, with nothing beside it where the tail leaves, coils up."
    datum, ways = part.datum, f"the file's axis {part.along}"
    at = f"the coordinate system {datum}"
    if isinstance(datum, str):
        ways = "its x axis"
    else:
        at = f"the point {', '.join(in_mm(value, 3) for value in datum)} (mm, axes of the file)"
    up = "its z axis" if isinstance(datum, str) else f"the file's axis {part.up}"
    tail = ", where the tail leaves" if layout.spec.fpc.tail is not None else ""
    return (
        f" The middle of its body ({size}, the first along {ways}{tail}) comes over {at} of {part.file}, on the face "
        f"there, the coils on the side of {up}. Draw this outline on the face first: its place is kept to "
        f"{near(layout)}, its lower face lies a glue line above the face."
    )


def floor_grooves(layout: Layout) -> str:
    """What the grooves in the mount's floor are for, beside the dose; empty without any."""
    spans = seat_spans(layout.spec)
    if not spans:
        return ""
    places, width = grooves(layout, spans[-1])
    if not places:
        return ""
    across = 2.0 * half_width(layout, spans[-1][1])
    volume = 1e9 * len(places) * width * GROOVE_DEPTH * across
    return (
        f" The {len(places)} grooves across the mount's floor stay open: spread between them, they take what is too "
        f"much (up to {volume:.1f} mm3)."
    )


def over_jaw(layout: Layout, at: Levels) -> str:
    """What hangs over the metal beside a shield; empty without a shield below a mount."""
    if "shield" not in at or "mount" not in at or layout.spec.jaw is None:
        return ""
    hangs = [name for name, there in (("stop", stop_place(layout)), ("tongue", relief(layout))) if there is not None]
    if not hangs:
        return ""
    gap = (at["mount"][0] - at["jaw"][1]).nominal
    if at["mount"][0].nominal < at["shield"][0].nominal:  # it lies on the metal itself
        return ""
    verb = "hangs" if len(hangs) == 1 else "hang"
    return (
        f" The mount's {' and '.join(hangs)} {verb} {in_mm(gap, 2)} mm over the metal beside the shield: leave that "
        "open, with no glue in it."
    )


def listed(layout: Layout) -> str:
    """The row of the table of tolerances that is no thickness."""
    return f"  {'each piece beside its place':<28}{near(layout)} (along and across)"
