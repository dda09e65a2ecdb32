"""Places of pieces while they are glued: strips, films and gauges, with the sentences of the steps about them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from sitscad.assembly.places import stack
from sitscad.assembly.places.bodies import MOUNT_PIECES, backing_of, plates_of
from sitscad.assembly.places.column import GLUE, Layer, Levels, column, placement_tolerance
from sitscad.assembly.places.jaws import POCKET_CLEARANCE, free_half_width, jaw_range, jaw_section, seat_half_width
from sitscad.assembly.places.seating import Relief, clearance, process_clearance, retention, side_ledges, stop_place
from sitscad.assembly.solids.seat import GROOVE_DEPTH, groove_places
from sitscad.assembly.solids.tooling import FOAM, FOOT_INSET
from sitscad.basics.units import in_mm
from sitscad.files.documents.gluing import mass_text
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import box_around
from sitscad.layout.board import Layout
from sitscad.spec.circuit import FpcSpec, Tail
from sitscad.spec.mount import Assembly, Jaw, Mount, StepPart

FLUSH = 10e-6  # Smallest step (m) between faces that counts; smaller ones are flush

FILM = "film that no glue holds (polyethylene or PTFE)"

GAUGE, FILM_STEP = 0.05e-3, 0.05e-3
"""Smallest gap (m) that a feeler gauge measures well, and step (m) between available film thicknesses.

From memory, not verified.
"""


def place_tolerance_text(assembly: Assembly) -> str:
    """Return the largest deviation (mm) of a piece from its intended place, along and across the jaw, as text."""
    return f"+-{1e3 * placement_tolerance(assembly).band:.3f} mm"


def piece_sizes(layout: Layout) -> dict[str, tuple[float, float]]:
    """Return two lengths (m) of each piece between jaw and board, by name: x of its end at the tip, and largest width.

    Pieces of a mount widen upwards as far as the port leaves room.
    """
    ledges, stop = side_ledges(layout), stop_place(layout.body, layout.spec.jaw, layout.spec.mount)
    half, x0 = layout.body_size[1] / 2, layout.body[0]
    sizes = {}
    for name, (_, top) in zip(MOUNT_PIECES, backing_of(layout.spec).spans, strict=False):
        sizes[name] = x0, 2.0 * min(half, free_half_width(layout, top))
    if "mount" in sizes and (stop is not None or ledges is not None):  # both reach up to the board's top face
        wide = 2.0 * min(half if ledges is None else ledges[1], free_half_width(layout, 0.0))
        sizes["mount"] = (x0 if stop is None else stop[0]), wide
    sheet = stack.shield(layout)
    if sheet is not None:
        sizes["shield"] = x0, 2.0 * seat_half_width(layout, sheet.heights[0])
    return sizes


def alignment_text(
    body: Box, mount: Mount | None, assembly: Assembly,
    sizes: dict[str, tuple[float, float]], jaw: Jaw | None, stiff: list[str],
) -> str:
    """Describe the places of mount and shield on the jaw, and the strips that align them.

    Empty if a dovetail or pins place the pieces. In a pocket, films fill the room round the pieces. Elsewhere, strips
    beside the jaw align them. If a piece is nearly as wide as the jaw or wider, a film between strip and jaw leaves a
    measurable gap. `sizes` is from `piece_sizes`, and `stiff` names the pieces from the jaw upwards.
    """
    if jaw is None or mount is None or retention(body, mount) is not None or not stiff:
        return ""
    if jaw.pocket is not None:
        return _pocket_alignment_text(assembly, body, sizes, jaw, stiff) if jaw.recess else ""
    tip, face = jaw_range(body, jaw)[0], jaw_section(jaw).face
    ends = {part: sizes[part][0] - tip for part in stiff}
    wide = {part: sizes[part][1] for part in stiff}
    narrower = {part: (face - width) / 2 for part, width in wide.items()}
    film = _squaring_film(narrower.values())
    between = f", a film of {in_mm(film)} mm between each and the jaw" if film else ""
    widths = ", ".join(f"the {part} {1e3 * width:.3f}" for part, width in wide.items())
    gaps = ", ".join(f"{1e3 * (film + gap):.3f} mm beside the {part}" for part, gap in narrower.items())
    places = ", ".join(f"{part} {in_mm(end, 2)}" for part, end in ends.items())
    width_rule = "half of (the jaw's width - the piece's width)"
    width_rule = width_rule if not film else f"the film + {width_rule}"
    sides = "" if jaw_section(jaw).side > 0.0 else " The jaw's sides are round: the strips touch the edges of its face."
    return (
        f" Before any glue, clamp two straight waxed strips upright against the jaw's sides, high enough to stand "
        f"beside all that is glued{between}.{sides} As drawn the jaw's face is {1e3 * face:.3f} mm wide, {widths}. "
        f"Put feeler gauges on both sides of each piece, {gaps}: they centre it to {place_tolerance_text(assembly)}. "
        "Measure your own "
        f"widths: the gap is {width_rule}. The distances from the jaw's tip to the pieces' ends there are, in mm: "
        f"{places}, each to {place_tolerance_text(assembly)} (measure by a caliper, and clamp a block across to push "
        "the piece against). A piece that is glued on askew gives a false force."
    )


def _squaring_film(narrower: Iterable[float]) -> float:
    """Return the thickness (m) of the film between a jaw and the strips that align its pieces.

    `narrower` holds for each piece half the width (m) of the jaw minus half the width of the piece.
    """
    return max(0.0, FILM_STEP * math.ceil((GAUGE - min(narrower)) / FILM_STEP - 1e-9))


def stiff_pieces(layers: tuple[Layer, ...]) -> list[str]:
    """Return the names of the pieces glued on a jaw below the board, from the jaw upwards. Empty without a jaw."""
    below = [layer.part.removeprefix(GLUE) for layer in layers if layer.is_glue]
    return below[: below.index("board")] if "board" in below else []


def film_thicknesses(layout: Layout) -> set[float]:
    """Return the thicknesses (m) of the films that fill gaps beside pieces during gluing. Empty without a mount."""
    spec, gaps_found, stiff = layout.spec, set[float](), stiff_pieces(column(layout))
    if spec.mount is None:
        return gaps_found
    pieces = [*plates_of(spec).elastomers, *plates_of(spec).targets]
    if pieces or spec.mount.kind in ("bench-plate", "grasper-pad"):
        gaps_found.add(round(clearance(spec.mount), 9))
    if any(not piece.footprint.is_round for piece in pieces):
        gaps_found.add(round(process_clearance(spec.mount), 9))
    if spec.jaw is None:
        return gaps_found
    sizes = piece_sizes(layout)
    if alignment_text(layout.body, spec.mount, spec.assembly, sizes, spec.jaw, stiff):
        if spec.jaw.pocket is not None:
            rooms = _pocket_gaps(layout.body, sizes, spec.jaw, stiff)
            gaps_found |= {round(gap, 5) for gaps in rooms.values() for gap in gaps}
        elif film := _squaring_film((jaw_section(spec.jaw).face - sizes[part][1]) / 2 for part in stiff):
            gaps_found.add(round(film, 9))
    return gaps_found


def strip_removal_text(jaw: Jaw | None, width: float, has_strips: bool) -> str:
    """Describe the removal of the strips and films that aligned the pieces below the board during gluing.

    `width` (m) is the width of the board, which needs the room of the strips. Empty if there is no jaw, or if
    `has_strips` is False.
    """
    if jaw is None or not has_strips:
        return ""
    if jaw.pocket is not None:
        return " Pull the films out of the pocket when the glue has set."
    return f" Take strips and films away when the glue has set: the board, {in_mm(width, 2)} mm wide, needs the room."


def _pocket_gaps(
    body: Box, sizes: dict[str, tuple[float, float]], jaw: Jaw, stiff: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """Return the gaps (m) between each piece and the jaw's pocket: at the end and at each side.

    A mount that would leave a smaller gap is cut back to the pocket's clearance.
    """
    assert jaw.pocket is not None
    length, across = jaw.pocket
    start = sum(jaw_range(body, jaw)) / 2 - length / 2
    return {part: (max(sizes[part][0] - start, POCKET_CLEARANCE), max((across - sizes[part][1]) / 2, POCKET_CLEARANCE))
            for part in stiff}


def _pocket_alignment_text(
    assembly: Assembly, body: Box, sizes: dict[str, tuple[float, float]], jaw: Jaw, stiff: Sequence[str]
) -> str:
    """Describe the places of mount and shield in the jaw's pocket, with the thickness of films at end and sides."""
    gap_texts = [f"{part} {' and '.join(in_mm(gap, 2) for gap in gaps)}"
             for part, gaps in _pocket_gaps(body, sizes, jaw, stiff).items()]
    return (
        f" In the jaw's pocket, strips of {FILM} between each piece and the pocket's end at the tip, and beside it on "
        f"both sides, put it in its place to {place_tolerance_text(assembly)}; thickness at the end and at the sides, "
        f"in mm: {', '.join(gap_texts)}."
    )


def stop_place_text(layout: Layout) -> str:
    """Describe the board's place on a grasper's mount: its gaps to stop and ledges, or its flush edges."""
    room, mount = clearance(layout.spec.mount), layout.spec.mount
    jaw = layout.spec.jaw
    assert mount is not None and jaw is not None
    distance = in_mm(layout.body[0] - jaw_range(layout.body, jaw)[0], 2)
    end = f"its end {distance} mm from the jaw's tip, to {place_tolerance_text(layout.spec.assembly)}"
    over = layout.body_size[1] / 2 - seat_half_width(layout, backing_of(layout.spec).spans[-1][1])
    sides = f"stand out by {in_mm(over, 2)} mm beside the mount's floor" if over > FLUSH else "are flush with the mount"
    beside = f"; its sides {sides}, equally on both sides (microscope)"
    if side_ledges(layout) is not None:
        beside = "; the same film beside it on both sides keeps it in the middle between the ledges"
    if stop_place(layout.body, layout.spec.jaw, layout.spec.mount) is None:
        return f"The board lies with its end flush with the mount's end at the tip ({end}){beside}."
    return (
        f"Do not push the board against the stop itself: leave a gap of {in_mm(room)} mm ({end}). "
        f"Stand a strip of {FILM}, as thick as this gap, at the stop and push the board against that{beside}. Pull "
        "the film out when the glue has set."
    )


def _tail_end_text(tail: Tail | None) -> str:
    """Name the end of the board at which its tail leaves."""
    return "the tail" if tail is not None else "the end at large x (drawing of the board)"


def base_place_text(fpc: FpcSpec, mount: Mount | None) -> str:
    """Describe the board's place in the jig's base, in whole sentences."""
    room = clearance(mount)
    return (
        f" The recess is {in_mm(room)} mm larger on each side. {_film_text(fpc)} The films stay, no higher than the "
        "base's face, until the board is pushed out."
    )


def _film_text(fpc: FpcSpec) -> str:
    """Describe the films that fill the room round the board in a recess and so set its place, in whole sentences."""
    end = _tail_end_text(fpc.tail)
    if stack.has_round_body(fpc.body):
        return f"Line its round wall with a strip of {FILM}, as thick as this room: it holds the board in the middle."
    return (
        f"Put strips of {FILM}, as thick as this room, along the wall away from {end} and along the wall on the right "
        f"(seen towards {end}), and push the board against both."
    )


def well_place_text(layout: Layout, part: str) -> str:
    """Describe how a piece is placed in the well of the jig's frame, which is larger on all sides, in whole sentences.

    `part` is ``elastomer`` or ``target``.
    """
    room, end = process_clearance(layout.spec.mount), _tail_end_text(layout.spec.fpc.tail)
    row = plates_of(layout.spec).of(part)
    (x0, y0, _, y1), (left, low, _, high) = layout.body, box_around([piece.footprint.box for piece in row])
    what = f"the {part}" if part == "elastomer" or layout.spec.elastomer is None else "the press with the target"
    places = (f"away from {end}", left - x0), ("on the right", low - y0), ("on the left", y1 - high)
    edges = ", ".join(f"{place} {in_mm(gap, 3)}" for place, gap in places) + f" (seen towards {end})"
    back = f"Push {what} in the well away from {end}: the two shifts cancel."
    across = (
        "The round well holds it in the middle across." if row[0].footprint.is_round else
        f"A strip of {FILM}, {in_mm(room, 3)} mm thick, on the right in the well (seen towards {end}), with the piece "
        "pushed against it, puts it in the middle across; it comes out with the frame."
    )
    by_hand = "into the well" if part == "elastomer" or layout.spec.elastomer is None else (
        "by hand into the well, on the elastomer and without the press")
    return (
        f" Frame and well have {in_mm(room, 3)} mm of room on each side. Push the frame straight towards {end} and "
        f"keep it there: its round holes on the round pins hold it in the middle across. {back} {across} Try it dry "
        f"first: put the {part} {by_hand}, lift the frame off without moving the {part}, and measure under the "
        f"microscope. The distances from the body's edges to the {part}'s edges must be, in mm "
        f"(each {place_tolerance_text(layout.spec.assembly)}): {edges}."
    )


def jig_captions(layout: Layout, part: str) -> tuple[str, ...]:
    """Return the captions of the jig's picture: the tail's side, the directions in which to push, and the film."""
    room, end = process_clearance(layout.spec.mount), _tail_end_text(layout.spec.fpc.tail)
    row = plates_of(layout.spec).of(part)
    film = f"A film of {in_mm(room, 3)} mm goes on the right in the well, seen towards {end}."
    return (
        f"On the left {end} is at the lower right.", f"Push the frame towards {end},",
        f"and the {part} in its well away from {end}.", *([] if row[0].footprint.is_round else [film]),
    )


def press_captions(mass: float) -> tuple[str, ...]:
    """Return the captions of the board press's picture: its place, the foam (not drawn), the mass (kg) on the board."""
    return (
        f"The feet stand on the board's rim, {in_mm(FOOT_INSET)} mm inside its edges.",
        f"Foam of {in_mm(FOAM)} mm fills each pocket (not drawn).",
        f"Pressed by {mass_text(mass)}, the press with it.",
    )


def recess_place_text(assembly: Assembly, fpc: FpcSpec, mount: Mount | None) -> str:
    """Describe the board's place in the recess of a plate or a cap, in whole sentences."""
    room = clearance(mount)
    return (
        f" The recess is {in_mm(room)} mm larger on each side. {_film_text(fpc)} Its place is kept to "
        f"{place_tolerance_text(assembly)}. "
        "Let films stand up by some millimetres, and pull the films out when the glue has set."
    )


def custom_mount_place_text(body: Box, assembly: Assembly, fpc_tail: Tail | None, part: StepPart | None) -> str:
    """Describe the board's place on a mount of the user's own, in whole sentences.

    `part` is the STEP file of the mount; None if the spec has none.
    """
    x0, y0, x1, y1 = body
    size = f"{in_mm(x1 - x0, 2)} x {in_mm(y1 - y0, 2)} mm"
    if part is None:
        return f" It takes a flat face of {size}, with nothing beside it where the tail leaves, coils up."
    datum, axis = part.datum, f"the file's axis {part.along}"
    at = f"the coordinate system {datum}"
    if isinstance(datum, str):
        axis = "its x axis"
    else:
        at = f"the point {', '.join(in_mm(value, 3) for value in datum)} (mm, axes of the file)"
    up = "its z axis" if isinstance(datum, str) else f"the file's axis {part.up}"
    tail = ", where the tail leaves" if fpc_tail is not None else ""
    return (
        f" The middle of its body ({size}, the first along {axis}{tail}) comes over {at} of {part.file}, on the face "
        f"there, the coils on the side of {up}. Draw this outline on the face first: its place is kept to "
        f"{place_tolerance_text(assembly)}, its lower face lies a glue line above the face."
    )


def groove_text(layout: Layout) -> str:
    """Describe the grooves in the mount's floor, which take surplus glue; empty if there are none."""
    spans = backing_of(layout.spec).spans
    if not spans:
        return ""
    places, width = groove_places(layout.body, layout.spec.mount, spans[-1])
    if not places:
        return ""
    across = 2.0 * seat_half_width(layout, spans[-1][1])
    volume = 1e9 * len(places) * width * GROOVE_DEPTH * across
    return (
        f" Spread the glue between the {len(places)} grooves across the mount's floor, not into them: they take the "
        f"surplus (up to {volume:.1f} mm3)."
    )


def overhang_text(body: Box, mount: Mount | None, tongue: Relief | None, at: Levels) -> str:
    """Describe the parts of the mount that overhang the jaw's metal beside a shield. Empty if there are none."""
    if "shield" not in at or "mount" not in at or mount is None or mount.jaw is None:
        return ""
    stop = stop_place(body, mount.jaw, mount)
    hangs = [name for name, place in (("stop", stop), ("tongue", tongue)) if place is not None]
    if not hangs:
        return ""
    gap = (at["mount"][0] - at["jaw"][1]).nominal
    if at["mount"][0].nominal < at["shield"][0].nominal:  # the mount lies on the metal itself
        return ""
    verb = "hangs" if len(hangs) == 1 else "hang"
    return (
        f" The mount's {' and '.join(hangs)} {verb} {in_mm(gap, 2)} mm over the metal beside the shield: leave that "
        "open, with no glue in it."
    )


def place_tolerance_row(assembly: Assembly) -> str:
    """Return the row on the places of pieces for the table of tolerances, whose other rows are thicknesses."""
    return f"  {'place of each piece':<28}{place_tolerance_text(assembly)} (along and across)"
