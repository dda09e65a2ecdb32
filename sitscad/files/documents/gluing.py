"""Gluing instructions: doses, weights on the pieces, setting times, heights on silicone, and the places of pieces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from sitscad.assembly.places import stack
from sitscad.assembly.places.bodies import (
    MOUNT_PIECES,
    Body,
    backing_of,
    plates_of,
)
from sitscad.assembly.places.column import GLUE, Layer, Levels, Toleranced, column, placement
from sitscad.assembly.places.jaws import POCKET_CLEARANCE, half_width, jaw_range, room_across, section
from sitscad.assembly.places.seating import (
    Relief,
    clearance,
    process_clearance,
    retention,
    side_ledges,
    stop_place,
)
from sitscad.assembly.solids.seat import GROOVE_DEPTH, grooves
from sitscad.assembly.solids.tooling import FOAM, FOAM_STRAIN, FOOT_INSET, FOOT_ROOM, PEG, foot_pockets
from sitscad.basics.units import in_mm, show
from sitscad.estimates.loads.gluing import (
    HARD_HANDLING,
    HARD_PRESSURE,
    STANDARD_GRAVITY,
    board_plan,
    board_press,
    force_for,
    glued_area,
    hard_adhesive,
    lying_time,
    piece_press,
    pressed_by,
)
from sitscad.kernels.geometry.convex import Box, Footprint
from sitscad.layout.board import Layout
from sitscad.spec import presets
from sitscad.spec.circuit import FpcSpec, Tail
from sitscad.spec.materials import Adhesive, ElastomerPad, Encapsulation
from sitscad.spec.mount import Assembly, Jaw, Mount, StepPart
from sitscad.spec.sensor import SensorSpec

STEEL = 7850.0
"""Density (kg/m3) of steel."""

WASHER_MASS, WASHER_HEIGHT = 6.2e-3, 2.0e-3
"""Mass (kg) and height (m) of a washer M8 of ISO 7093: 24 mm, hole 8.4 mm, 2 mm thick, of steel of 7.85 g/cm3."""

JELLY_OFF = (
    "Wipe the jelly off the target with a swab of naphtha or heptane, then with isopropanol, which alone hardly "
    "dissolves it; keep both off the elastomer, which naphtha swells (unverified)."
)
"""Removal of petroleum jelly, a mixture of hydrocarbons: soluble in hydrocarbons and hardly in alcohols."""

PRESS_MASS = 2e-3
"""Least mass (kg) of a printed press of the jig."""

BARS, BAR_HOLE = (30e-3, 50e-3, 80e-3), 8.5e-3
"""Diameters (m) of the steel bars that load a press, and of the bars' central hole for the press's peg."""

HEIGHT_ERROR = 5e-6
"""Largest compression (m) of a pad by the instrument that measures its height."""

LIGHT_GAUGE = 0.1
"""Force (N) of a light dial gauge. From memory, not verified."""

LARGEST_BEAD = 10.0
"""Largest volume (mm3) of glue that is also stated as a single bead."""

RATCHET = 5.0
"""Least force (N) of a micrometer's ratchet, usually 5 to 10 N. From memory, not verified."""


def toleranced(size: Toleranced) -> str:
    """Format a length in millimetres with its largest deviation by tolerances."""
    return f"{size.nominal * 1e3:.3f} +-{size.spread * 1e3:.3f} mm"


def grams(mass: float) -> str:
    """Format a mass (kg) to two digits, in grams or kilograms."""
    return f"{_plain(mass * 1e3, 2)} g" if mass < 1.0 else f"{_plain(mass, 2)} kg"


def duration(seconds: float) -> str:
    """Format a time (s) in seconds, minutes or hours."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{max(1.0, seconds):.0f} s"


def product(assembly: Assembly) -> str:
    """Return the name of the glue's product, or `glue` if the spec has no adhesive."""
    return assembly.adhesive.product if assembly.adhesive is not None else "glue"


def dose(glue: Adhesive | None, area: float, line: float, tolerance: float) -> str:
    """Describe the dose of glue for an area (m2) and a line (m): a volume (``2.9 mm3 of ...``) or an area of tape."""
    under, volume = f"{_plain(1e6 * area, 3)} mm2", 1e9 * area * line
    if glue is not None and glue.viscosity is None:
        return f"{glue.product}, {under} cut to the outline"
    bead = f"; a bead of {(6.0 * volume / math.pi) ** (1.0 / 3.0):.1f} mm" if volume < LARGEST_BEAD else ""
    return (
        f"{_plain(volume, 2)} mm3 (microlitres{bead}) of {glue.product if glue else 'glue'}, for a line of "
        f"{in_mm(line)} +-{in_mm(tolerance)} mm under {under}"
    )


def _plain(value: float, digits: int) -> str:
    """Format a number to significant digits, never with an exponent."""
    return f"{float(f'{value:.{digits - 1}e}'):.12g}"


def setting(glue: Adhesive | None) -> str:
    """Describe the glue's open time, setting time and cure time; empty if all are unknown."""
    if glue is None or glue.set_time is None or glue.open_time is None:
        return "" if glue is None or not glue.cure_time else f" Full strength comes after {duration(glue.cure_time)}."
    maker = "Loctite's" if glue.product.startswith("Loctite") else "the maker's"
    return (
        f" {glue.product[0].upper()}{glue.product[1:]} flows for about {duration(glue.open_time)} once the faces meet, "
        f"sets in about {duration(glue.set_time)} and has its full strength after {duration(glue.cure_time)} (thin "
        f"lines; {maker} data sheet takes precedence)."
    )


def measuring(spec: SensorSpec) -> str:
    """Describe the measurement of heights on the soft pad; empty if the spec has no pad."""
    force, travel = force_for(spec, HEIGHT_ERROR), pressed_by(spec, RATCHET)
    if force is None or travel is None:
        return ""
    light = 1e3 * (pressed_by(spec, LIGHT_GAUGE) or 0.0)
    by_gauge = (
        f"or a dial gauge of at most {show(force, 'N', 2)} on a flat plate as large as the piece, whose thickness you "
        "take off (a cover glass)"
        if force >= LIGHT_GAUGE
        else f"not by a dial gauge: even a light one ({LIGHT_GAUGE:g} N) presses this pad by {light:.2g} mm"
    )
    return (
        f"Heights on silicone are read by focusing a microscope on board and piece in turn, {by_gauge}. A micrometer's "
        f"ratchet ({RATCHET:g} N and more) presses the pad by {1e3 * travel:.2g} mm."
    )


def primed(glue: Adhesive | None, elastomer: ElastomerPad | None) -> str:
    """Describe the faces that get a primer; empty if no primer is needed."""
    if glue is None or not glue.primer or elastomer is None:
        return ""
    return (
        f"Wipe {glue.primer.partition(' on ')[0]} on the elastomer's upper and lower face, on nothing else (its sides, "
        "board, target and metal need none), once and thinly, and let it dry before gluing: about a minute, the data "
        "sheet has it."
    )


def washers(mass: float) -> int | None:
    """Return the number of washers that bring a press to a mass (kg); None if its peg is too short for them."""
    count = max(1, math.ceil((mass - PRESS_MASS) / WASHER_MASS))
    return count if count * WASHER_HEIGHT <= PEG[1] else None


def bar_height(across: float, mass: float) -> float:
    """Return the height (m) of a steel bar with a hole, from its diameter `across` (m) and mass (kg)."""
    return mass / (STEEL * math.pi / 4.0 * (across**2 - BAR_HOLE**2))


def steel_bar(mass: float) -> tuple[float, float]:
    """Return diameter and height (m) of a steel bar with a hole that brings a press to a mass (kg)."""
    bars = [(across, bar_height(across, mass - PRESS_MASS)) for across in BARS]
    return next((bar for bar in bars if bar[1] <= bar[0]), bars[-1])


MOST_STANDING = 3.0
"""Largest mass (kg) that stands on a press; a steel bar of this mass is as high as wide. An assumption."""


def is_clamped(mass: float) -> bool:
    """Whether a clamp over a spring replaces a mass (kg) on a press."""
    return mass > MOST_STANDING


SPRING_RATE = 10e3
"""Rate (N/m) of a compression spring under a clamp: usual, and some millimetres of travel are read easily."""


def spring(mass: float) -> str:
    """Describe the force of a mass (kg) and the compression of a spring by this force."""
    force = mass * STANDARD_GRAVITY
    travel = force / SPRING_RATE
    return (f"{show(force, 'N', 2)}: a spring of {1e-3 * SPRING_RATE:g} N/mm, at least "
            f"{1e3 * (PEG[1] + 2.0 * travel):.0f} mm long, becomes {1e3 * travel:.2g} mm shorter")


def loaded(part: str, mass: float) -> str:
    """Return the instruction to load the press of a part to a mass (kg); other text follows in the sentence."""
    if is_clamped(mass):
        return (
            f"Have a bar clamp and a compression spring ready, which goes over the peg of jig-{part}-press: so large a "
            f"board takes the weight of {grams(mass)}, too much to stand on it. With a washer on the spring, tighten "
            f"the clamp from under the mount, over the peg, to {spring(mass)} (another rate: force by rate)"
        )
    if washers(mass) is not None:
        weight = f"M8 washers (ISO 7093, {1e3 * WASHER_MASS:g} g each) on its peg"
    else:
        across, high = steel_bar(mass)
        weight = (f"a round bar of steel, {1e3 * across:g} mm across, about {1e3 * high:.0f} mm high "
                  f"({_plain(1e3 * bar_height(across, 1e-3), 2)} mm less for each gram of the press above "
                  f"{1e3 * PRESS_MASS:g} g: weigh it), with a hole of {1e3 * BAR_HOLE:g} mm through its middle for the "
                  "peg")
    return f"Load jig-{part}-press with {weight}, until both weigh {grams(mass)}"


def glued(spec: SensorSpec, part: str, under: str, height: Toleranced, place: str) -> str:
    """Describe the gluing of the elastomer or the target in the jig, and the resulting height."""
    assembly, count = spec.assembly, len(plates_of(spec).glued(part))
    press, area, glue = piece_press(spec, part), glued_area(spec, part), assembly.adhesive
    dose_text = dose(glue, area, assembly.glue_line, assembly.glue_tolerance)
    on_foot = part == "target" and spec.elastomer is not None
    placing = f"drop the {part} into the well and lower the loaded press on it at once, from the other hand"
    if on_foot:
        placing = "lower the loaded press with the target into the well, without pushing"
    holding = (
        f"Hold the target on the foot of jig-{part}-press, a burr towards the foot, its edges flush, by a trace of "
        "petroleum jelly in the middle. " if on_foot else ""
    )
    verb = "Put" if glue is not None and glue.viscosity is None else "Spread"
    is_webbed = part == "elastomer" and bool(plates_of(spec).webs)
    webs = ", under the pads alone: the webs between them get none" if is_webbed else ""
    pad = f", and presses the pad by {1e3 * press.travel:.2g} mm, which comes back" if press.travel else ""
    again = "" if count == 1 else f" Glue one of the {count} cells at a time: glue that is spread beforehand sets."
    wiped = f" {JELLY_OFF}" if on_foot else ""
    return (
        f"Put the frame jig-{part} on the base: it goes on one way only.{place} {loaded(part, press.mass)}. "
        f"{holding}{verb} {dose_text}, on {under} in the well"
        f"{'' if count == 1 else ' of a cell'}{webs}; {placing}. Nothing stops the press: its weight brings the glue "
        f"to its line{pad}. Leave it until the glue has set, then lift press and frame.{wiped}{setting(glue)}{again} "
        f"From the board's top face to its upper face are {toleranced(height)} then."
    )


def line_areas(layout: Layout) -> dict[str, float]:
    """Return the areas (m2) of the glue lines between a jaw and the board, by the piece above each line.

    The order is from the jaw upwards; empty without a jaw. Pieces are as long as the board's body. A line is as wide as
    the narrower of its two faces.
    """
    spec, jaw, (_, area), half = layout.spec, layout.spec.jaw, board_plan(layout), layout.body_size[1] / 2
    if jaw is None:
        return {}
    faces, sheet = dict[str, tuple[float, float]](), stack.shield(layout)
    if sheet is not None:
        faces["shield"] = (half_width(layout, sheet.lower),) * 2
    for name, (low, high) in zip(MOUNT_PIECES, backing_of(spec).spans, strict=False):
        faces[name] = half_width(layout, low), half_width(layout, high)
    faces["board"] = half, half
    areas, below = {}, section(jaw).face / 2
    for name, (lower, upper) in faces.items():
        areas[name] = area * min(1.0, min(below, lower) / half)
        below = upper
    return areas


def hard_dose(assembly: Assembly, glue: Adhesive | None, area: float) -> str:
    """Describe the dose of glue for an area (m2) between two hard faces."""
    return dose(glue, area, assembly.glue_line, assembly.glue_tolerance)


def why_other(assembly: Assembly, board: tuple[Footprint, float], hard: Adhesive | None) -> str:
    """Give the reason why hard faces need another glue than the spec's; empty if they use the spec's glue."""
    adhesive, used, (plan, area) = assembly.adhesive, hard, board
    if adhesive is None or used is None or used == adhesive:
        return ""
    takes = lying_time(adhesive, plan, HARD_PRESSURE * area, assembly.glue_line, HARD_HANDLING)
    return (
        f" Not {adhesive.product}: it flows for about {duration(adhesive.open_time or 0.0)} between two faces, and "
        f"takes {duration(takes)} to be spread, put in its place and pressed flat here; {used.product} flows for "
        f"{duration(used.open_time or 0.0)} (times unverified)."
    )


def board_glued(layout: Layout) -> str:
    """Describe the glue under the board: dose, reason for the choice of glue, and pressing, in whole sentences."""
    glue = hard_adhesive(layout)
    verb = "Put" if glue is not None and glue.viscosity is None else "Spread"
    dose_text = hard_dose(layout.spec.assembly, glue, board_plan(layout)[1])
    why = why_other(layout.spec.assembly, board_plan(layout), glue)
    return pressing(layout, f"{verb} {dose_text}, under the board's whole body.{why}") + setting(glue)


def pressing(layout: Layout, spreading: str) -> str:
    """Describe the pressing of the board on its mount; `spreading` is the sentence on spreading the glue.

    The board is never pressed by a finger on the pads.
    """
    spec, mass = layout.spec, board_press(layout)
    part = "target" if spec.target is not None else "elastomer"
    if spec.target is None and spec.elastomer is None:
        return f"{spreading} Press the board down with a flat stick until the glue has set."
    pockets, is_one = foot_pockets(layout), len(plates_of(spec).of(part)) == 1
    foam = f"soft open-cell foam (polyurethane), {in_mm(FOAM)} mm thick"
    parts = part if is_one else f"{part}s"
    if not pockets:
        return (
            f"Clamp what the board goes on, its face level. {spreading} Lay {foam}, over the whole board and a flat "
            f"stiff plate (glass) on it, {grams(mass)} with a weight on its middle, until the glue has set. Never "
            f"press the {parts} at one edge."
        )
    each = "the pocket" if len(pockets) == 1 else "each pocket"
    return (
        f"Keep this order. (1) Clamp what the board goes on, its face level. (2) Stick {foam} and as large as the "
        f"{part}, under the roof of {each} of jig-board-press, by double-sided tape. It is pressed by about "
        f"{100.0 * FOAM_STRAIN:.0f} %, and keeps the board down under the {parts}, however high "
        f"{'it has' if is_one else 'each has'} come out (unverified). {loaded('board', mass)}. (3) {spreading} (4) Lay "
        f"the board on. Put the press round the {parts}: its feet stand on the board's rim, {in_mm(FOOT_INSET)} mm "
        f"inside the board's edges, inside any recess and film, and at least {in_mm(FOOT_ROOM[0])} mm beside them. It "
        f"stands by itself until the glue has set. Never press the {parts} at one edge."
    )


INHIBITION = (
    "Amines, nitriles, tin and sulphur keep platinum silicone liquid where it touches them (lists of techsil.co.uk and "
    "siliconesandmore.com; Smooth-On's bulletin on Dragon Skin names epoxies)"
)


def inhibited(adhesive: Adhesive | None, film: Encapsulation | None, hard: Adhesive | None = None) -> str:
    """Warn of glues that may keep the film from curing, with the remedy; empty if none is known to.

    `hard` is the adhesive of hard faces, the spec's if None.
    """
    glues = [*dict.fromkeys(glue for glue in (adhesive, hard) if glue is not None and glue.inhibitor)]
    if film is None or not glues or not presets.cures_by_platinum(film.material.name):
        return ""
    named = ", and ".join(f"of {glue.product}, {glue.inhibitor}" for glue in glues)
    return (
        f" {INHIBITION}. {film.material.name} is such a silicone, and {named}. Let the glue cure fully first "
        f"({duration(max(glue.cure_time for glue in glues))}), wipe squeezed-out glue and the pad's sides with "
        "isopropanol, let that dry, and try a drop of the film on a scrap glued the same way. If it stays sticky, "
        "brush on a barrier coat (clear acrylic lacquer), or glue with something else. (No test of this pair was "
        "found: unverified.)"
    )


FLUSH = 10e-6  # Smallest step (m) between faces that counts; smaller ones are flush

FILM = "film that no glue holds (polyethylene or PTFE)"

GAUGE, FILM_STEP = 0.05e-3, 0.05e-3
"""Thinnest gap (m) that a feeler gauge measures well, and step of films' thicknesses (m). From memory, not verified."""


def near(assembly: Assembly) -> str:
    """Format the tolerance of a piece's place, along and across."""
    return f"+-{1e3 * placement(assembly).band:.3f} mm"


def piece_sizes(layout: Layout) -> dict[str, tuple[float, float]]:
    """Return the place of the tip end (m) and the largest width (m) of each piece between a jaw and the board.

    Pieces of a mount widen upwards as far as the port leaves room.
    """
    ledges, stop = side_ledges(layout), stop_place(layout.body, layout.spec.jaw, layout.spec.mount)
    half, x0 = layout.body_size[1] / 2, layout.body[0]
    sizes = {}
    for name, (_, top) in zip(MOUNT_PIECES, backing_of(layout.spec).spans, strict=False):
        sizes[name] = x0, 2.0 * min(half, room_across(layout, top))
    if "mount" in sizes and (stop is not None or ledges is not None):  # both reach up to the board's top face
        wide = 2.0 * min(half if ledges is None else ledges[1], room_across(layout, 0.0))
        sizes["mount"] = (x0 if stop is None else stop[0]), wide
    sheet = stack.shield(layout)
    if sheet is not None:
        sizes["shield"] = x0, 2.0 * half_width(layout, sheet.heights[0])
    return sizes


def squared(
    body: tuple[float, float, float, float], mount: Mount | None, assembly: Assembly,
    sizes: dict[str, tuple[float, float]], jaw: Jaw | None, stiff: list[str],
) -> str:
    """Describe the places of mount and shield on the jaw, and the strips that align them.

    Empty if a joint places the pieces. In a pocket, films fill the room round the pieces. Elsewhere, strips beside the
    jaw align the pieces. If a mount is nearly as wide as the jaw or wider, a film between strip and jaw leaves a
    measurable gap.
    """
    if jaw is None or mount is None or retention(body, mount) is not None or not stiff:
        return ""
    if jaw.pocket is not None:
        return _in_pocket(assembly, body, sizes, jaw, stiff) if jaw.recess else ""
    tip, face = jaw_range(body, jaw)[0], section(jaw).face
    ends = {part: sizes[part][0] - tip for part in stiff}
    wide = {part: sizes[part][1] for part in stiff}
    narrower = {part: (face - width) / 2 for part, width in wide.items()}
    film = _squaring_film(narrower.values())
    between = f", a film of {in_mm(film)} mm between each and the jaw" if film else ""
    widths = ", ".join(f"the {part} {1e3 * width:.3f}" for part, width in wide.items())
    gaps = ", ".join(f"{1e3 * (film + gap):.3f} mm beside the {part}" for part, gap in narrower.items())
    places = ", ".join(f"{part} {in_mm(end, 2)}" for part, end in ends.items())
    width_rule = "half of what the jaw is wider"
    width_rule = width_rule if not film else f"the film and {width_rule} (less, if not)"
    sides = "" if section(jaw).side > 0.0 else " The jaw's sides are round: the strips touch the edges of its face."
    return (
        f" Before any glue, clamp two straight waxed strips upright against the jaw's sides, high enough to stand "
        f"beside all that is glued{between}.{sides} As drawn the jaw's face is {1e3 * face:.3f} mm wide, {widths}: "
        f"feeler gauges on both sides of each piece, {gaps}, put it in the middle to {near(assembly)}. "
        f"Measure your own widths: the gap is {width_rule}. From the jaw's tip to each piece's own end there (caliper; "
        "a block clamped across "
        f"to push it against) are, in mm: {places}, to {near(assembly)}. A piece that is glued on "
        "askew gives a false force."
    )


def _squaring_film(narrower: Iterable[float]) -> float:
    """Return the thickness (m) of the film between a jaw and the strips beside its pieces.

    `narrower` holds the widths (m) by which pieces are narrower than the jaw on each side.
    """
    return max(0.0, FILM_STEP * math.ceil((GAUGE - min(narrower)) / FILM_STEP - 1e-9))


def stiff_pieces(layers: tuple[Layer, ...]) -> list[str]:
    """List the pieces glued on a jaw below the board, from the jaw upwards; empty without a jaw."""
    below = [layer.part.removeprefix(GLUE) for layer in layers if layer.is_glue]
    return below[: below.index("board")] if "board" in below else []


def film_rooms(layout: Layout) -> set[float]:
    """Return the thicknesses (m) of the films that fill gaps beside pieces during gluing; empty without a mount."""
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
    if squared(layout.body, spec.mount, spec.assembly, sizes, spec.jaw, stiff):
        if spec.jaw.pocket is not None:
            rooms = _pocket_gaps(layout.body, sizes, spec.jaw, stiff)
            gaps_found |= {round(gap, 5) for gaps in rooms.values() for gap in gaps}
        elif film := _squaring_film((section(spec.jaw).face - sizes[part][1]) / 2 for part in stiff):
            gaps_found.add(round(film, 9))
    return gaps_found


def strips_off(jaw: Jaw | None, width: float, has_strips: bool) -> str:
    """Describe the removal of the strips and films of `squared` before a board of a width (m) is glued."""
    if jaw is None or not has_strips:
        return ""
    if jaw.pocket is not None:
        return " Pull the films out of the pocket when the glue has set."
    return f" Take strips and films away when the glue has set: the board, {in_mm(width, 2)} mm wide, needs the room."


def _pocket_gaps(
    body: tuple[float, float, float, float], sizes: dict[str, tuple[float, float]], jaw: Jaw, stiff: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """Return each piece's room (m) in the jaw's pocket, at the end and at the sides.

    A mount that would leave less room is cut back to the pocket's clearance.
    """
    assert jaw.pocket is not None
    length, across = jaw.pocket
    start = sum(jaw_range(body, jaw)) / 2 - length / 2
    return {part: (max(sizes[part][0] - start, POCKET_CLEARANCE), max((across - sizes[part][1]) / 2, POCKET_CLEARANCE))
            for part in stiff}


def _in_pocket(
    assembly: Assembly, body: tuple[float, float, float, float], sizes: dict[str, tuple[float, float]], jaw: Jaw,
    stiff: Sequence[str],
) -> str:
    """Describe the places of mount and shield in the jaw's pocket, with the thickness of films at end and sides."""
    gap_texts = [f"{part} {' and '.join(in_mm(gap, 2) for gap in gaps)}"
             for part, gaps in _pocket_gaps(body, sizes, jaw, stiff).items()]
    return (
        f" In the jaw's pocket, strips of {FILM} between each piece and the pocket's end at the tip, and beside it on "
        f"both sides, put it in its place to {near(assembly)}; thickness at the end and at the sides, "
        f"in mm: {', '.join(gap_texts)}."
    )


def against_stop(layout: Layout) -> str:
    """Describe the board's place on a grasper's mount: its gaps to stop and ledges, or flush edges."""
    room, mount = clearance(layout.spec.mount), layout.spec.mount
    jaw = layout.spec.jaw
    assert mount is not None and jaw is not None
    distance = in_mm(layout.body[0] - jaw_range(layout.body, jaw)[0], 2)
    end = f"its end {distance} mm from the jaw's tip, to {near(layout.spec.assembly)}"
    over = layout.body_size[1] / 2 - half_width(layout, backing_of(layout.spec).spans[-1][1])
    sides = f"stand out by {in_mm(over, 2)} mm beside the mount's floor" if over > FLUSH else "are flush with the mount"
    beside = f"; its sides {sides}, the same on both (microscope)"
    if side_ledges(layout) is not None:
        beside = "; the same film beside it on both sides keeps it in the middle between the ledges"
    if stop_place(layout.body, layout.spec.jaw, layout.spec.mount) is None:
        return f"The board lies with its end flush with the mount's end at the tip ({end}){beside}."
    return (
        f"Do not push the board against the stop itself: {in_mm(room)} mm between them are part of its place ({end}). "
        f"Stand a strip of {FILM}, as thick as this gap, at the stop and push the board against that{beside}. Pull "
        "the film out when the glue has set."
    )


def _tail_end(tail: Tail | None) -> str:
    """Name the end of the board where its tail leaves."""
    return "the tail" if tail is not None else "the end at large x (drawing of the board)"


def in_base(fpc: FpcSpec, mount: Mount | None) -> str:
    """Describe the board's place in the jig's base, in whole sentences."""
    room = clearance(mount)
    return (
        f" The recess is {in_mm(room)} mm larger on each side. {_films(fpc)} The films stay, no higher than the "
        "base's face, until the board is pushed out."
    )


def _films(fpc: FpcSpec) -> str:
    """Describe the films that fill the room round the board in a recess and so place it, in whole sentences."""
    end = _tail_end(fpc.tail)
    if stack.has_round_body(fpc.body):
        return f"Line its round wall with a strip of {FILM}, as thick as this room: it holds the board in the middle."
    return (
        f"Put strips of {FILM}, as thick as this room, along the wall away from {end} and along the wall on the right "
        f"(seen towards {end}), and push the board against both."
    )


def in_well(layout: Layout, part: str) -> str:
    """Describe the placing of a piece in a frame's well, which has room on all sides; whole sentences."""
    room, end = process_clearance(layout.spec.mount), _tail_end(layout.spec.fpc.tail)
    row = plates_of(layout.spec).of(part)
    (x0, y0, _, y1), (left, low, _, high) = layout.body, _box(row)
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
        f"(each {near(layout.spec.assembly)}): {edges}."
    )


def pushed_ways(layout: Layout, part: str) -> tuple[str, ...]:
    """Return the captions of the jig's picture: the tail's side, the directions of pushing, and the film."""
    room, end = process_clearance(layout.spec.mount), _tail_end(layout.spec.fpc.tail)
    row = plates_of(layout.spec).of(part)
    film = f"A film of {in_mm(room, 3)} mm goes on the right in the well, seen towards {end}."
    return (
        f"On the left {end} is at the lower right.", f"Push the frame towards {end},",
        f"and the {part} in its well away from {end}.", *([] if row[0].footprint.is_round else [film]),
    )


def press_words(mass: float) -> tuple[str, ...]:
    """Return the captions of the board press's picture: its place, the foam (not drawn), and the mass on the board."""
    return (
        f"The feet stand on the board's rim, {in_mm(FOOT_INSET)} mm inside its edges.",
        f"Foam of {in_mm(FOAM)} mm fills each pocket (not drawn).",
        f"Pressed by {grams(mass)}, the press with it.",
    )


def _box(pieces: Sequence[Body]) -> Box:
    """Return the bounding box (m) of all pieces."""
    boxes = [piece.footprint.box for piece in pieces]
    return min(b[0] for b in boxes), min(b[1] for b in boxes), max(b[2] for b in boxes), max(b[3] for b in boxes)


def in_recess(assembly: Assembly, fpc: FpcSpec, mount: Mount | None) -> str:
    """Describe the board's place in the recess of a plate or a cap, in whole sentences."""
    room = clearance(mount)
    return (
        f" The recess is {in_mm(room)} mm larger on each side. {_films(fpc)} Its place is kept to {near(assembly)}. "
        "Let films stand up by some millimetres, and pull the films out when the glue has set."
    )


def on_own(
    body: tuple[float, float, float, float], assembly: Assembly, fpc_tail: Tail | None, part: StepPart | None
) -> str:
    """Describe the board's place on a mount of the user's own, in whole sentences."""
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
        f"{near(assembly)}, its lower face lies a glue line above the face."
    )


def floor_grooves(layout: Layout) -> str:
    """Describe the grooves in the mount's floor, which take surplus glue; empty if there are none."""
    spans = backing_of(layout.spec).spans
    if not spans:
        return ""
    places, width = grooves(layout.body, layout.spec.mount, spans[-1])
    if not places:
        return ""
    across = 2.0 * half_width(layout, spans[-1][1])
    volume = 1e9 * len(places) * width * GROOVE_DEPTH * across
    return (
        f" The {len(places)} grooves across the mount's floor stay open: spread between them, they take what is too "
        f"much (up to {volume:.1f} mm3)."
    )


def over_jaw(
    body: tuple[float, float, float, float], mount: Mount | None, tongue: Relief | None, at: Levels
) -> str:
    """Describe parts of the mount that overhang the metal beside a shield; empty if there are none."""
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


def listed(assembly: Assembly) -> str:
    """Return the tolerance table's row on the places of pieces; all other rows are thicknesses."""
    return f"  {'each piece beside its place':<28}{near(assembly)} (along and across)"
