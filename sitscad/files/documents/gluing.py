"""Gluing instructions: doses, weights on the pieces, setting times, heights on silicone, and the places of pieces."""

from __future__ import annotations

import math

from sitscad.assembly.places import stack
from sitscad.assembly.places.bodies import MOUNT_PIECES, backing_of, plates_of
from sitscad.assembly.places.column import Toleranced
from sitscad.assembly.places.jaws import jaw_section, seat_half_width
from sitscad.assembly.solids.tooling import FOAM, FOAM_STRAIN, FOOT_INSET, FOOT_ROOM, PEG, foot_pockets
from sitscad.basics.units import in_mm, show
from sitscad.estimates.loads.gluing import (
    HARD_HANDLING,
    HARD_PRESSURE,
    STANDARD_GRAVITY,
    board_plan,
    board_press,
    glued_area,
    hard_adhesive,
    pad_compression,
    pad_force,
    piece_press,
    spreading_time,
    unsealed_pad,
)
from sitscad.kernels.geometry.convex import Footprint
from sitscad.layout.board import Layout
from sitscad.spec import presets
from sitscad.spec.materials import Adhesive, ElastomerPad, Encapsulation
from sitscad.spec.mount import Assembly
from sitscad.spec.sensor import SensorSpec

STEEL = 7850.0
"""Density (kg/m3) of steel."""

WASHER_MASS, WASHER_HEIGHT = 6.2e-3, 2.0e-3
"""Mass (kg) and height (m) of a washer M8 of ISO 7093: 24 mm, hole 8.4 mm, 2 mm thick, of steel of 7.85 g/cm3."""

JELLY_OFF = (
    "Wipe the jelly off the target with a swab of naphtha or heptane, then with isopropanol, which alone hardly "
    "dissolves it; keep both off the elastomer, which naphtha swells (unverified)."
)
"""Instruction to remove petroleum jelly, which dissolves in hydrocarbons and hardly in alcohols."""

PRESS_MASS = 2e-3
"""Least mass (kg) of a printed press of the jig."""

BARS, BAR_HOLE = (30e-3, 50e-3, 80e-3), 8.5e-3
"""Outer diameters (m) of the steel bars that load a press, and diameter (m) of their hole for the press's peg."""

HEIGHT_ERROR = 5e-6
"""Largest compression (m) of a pad by the height gauge. It limits the contact force of a suitable gauge."""

LIGHT_GAUGE = 0.1
"""Contact force (N) of a light dial gauge. From memory, not verified."""

LARGEST_BEAD = 10.0
"""Volume (mm3) of glue below which the text also states the diameter of a sphere of this volume."""

RATCHET = 5.0
"""Least force (N) at which a micrometer's ratchet slips, usually 5 to 10 N. From memory, not verified."""


def toleranced_text(size: Toleranced) -> str:
    """Return a length in millimetres as text, with its largest deviation to both sides."""
    return f"{size.nominal * 1e3:.3f} +-{size.spread * 1e3:.3f} mm"


def mass_text(mass: float) -> str:
    """Format a mass (kg) to two significant digits, in grams or kilograms."""
    return f"{_digits_text(mass * 1e3, 2)} g" if mass < 1.0 else f"{_digits_text(mass, 2)} kg"


def duration_text(seconds: float) -> str:
    """Format a time (s) in seconds, minutes or hours."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{max(1.0, seconds):.0f} s"


def product_name(assembly: Assembly) -> str:
    """Return the name of the glue's product, or `glue` if the spec has no adhesive."""
    return assembly.adhesive.product if assembly.adhesive is not None else "glue"


def glue_dose_text(glue: Adhesive | None, area: float, line: float, tolerance: float) -> str:
    """Describe the dose of glue under an area (m2): a volume (``2.9 mm3 of ...``), or an area of tape.

    `line` is the thickness (m) of the glue line, and `tolerance` (m) its largest deviation. `glue` is None if the spec
    has no adhesive.
    """
    under, volume = f"{_digits_text(1e6 * area, 3)} mm2", 1e9 * area * line
    if glue is not None and glue.viscosity is None:
        return f"{glue.product}, {under} cut to the outline"
    bead = f"; a bead {(6.0 * volume / math.pi) ** (1.0 / 3.0):.1f} mm across" if volume < LARGEST_BEAD else ""
    return (
        f"{_digits_text(volume, 2)} mm3 (microlitres{bead}) of {glue.product if glue else 'glue'}, for a glue line "
        f"{in_mm(line)} +-{in_mm(tolerance)} mm thick under {under}"
    )


def _digits_text(value: float, digits: int) -> str:
    """Format a number to significant digits, never with an exponent."""
    return f"{float(f'{value:.{digits - 1}e}'):.12g}"


def setting_text(glue: Adhesive | None) -> str:
    """Describe the glue's open time, setting time and cure time, as far as they are known. Empty if none is known."""
    if glue is None or glue.set_time is None or glue.open_time is None:
        return f" Full strength comes after {duration_text(glue.cure_time)}." if glue and glue.cure_time else ""
    maker = "Loctite's" if glue.product.startswith("Loctite") else "the maker's"
    return (
        f" {glue.product[0].upper()}{glue.product[1:]} flows for about {duration_text(glue.open_time)} once the faces "
        f"meet, sets in about {duration_text(glue.set_time)} and has its full strength after "
        f"{duration_text(glue.cure_time)} (thin "
        f"lines; {maker} data sheet takes precedence)."
    )


def measuring_text(spec: SensorSpec) -> str:
    """Describe how heights on the soft pad are measured; empty if the spec has no pad."""
    pad = unsealed_pad(spec)
    force, travel = pad_force(pad, HEIGHT_ERROR), pad_compression(pad, RATCHET)
    if force is None or travel is None:
        return ""
    light = 1e3 * (pad_compression(pad, LIGHT_GAUGE) or 0.0)
    by_gauge = (
        "Or lay a flat plate as large as the piece on it (a cover glass), use a dial gauge of at most "
        f"{show(force, 'N', 2)}, and subtract the plate's thickness."
        if force >= LIGHT_GAUGE
        else f"Do not use a dial gauge: even a light one ({LIGHT_GAUGE:g} N) presses this pad by {light:.2g} mm."
    )
    return (
        f"Measure heights on silicone with a microscope: focus on the board, then on the piece. {by_gauge} A "
        f"micrometer's ratchet ({RATCHET:g} N and more) presses the pad by {1e3 * travel:.2g} mm: do not use it here."
    )


def primer_text(glue: Adhesive | None, elastomer: ElastomerPad | None) -> str:
    """Describe which faces get a primer; empty if no primer is needed."""
    if glue is None or not glue.primer or elastomer is None:
        return ""
    return (
        f"Wipe {glue.primer.partition(' on ')[0]} once and thinly on the elastomer's upper and lower face, and on "
        "nothing else: its sides, the board, the target and metal need no primer. Let it dry before gluing, for about "
        "a minute (its data sheet has the time)."
    )


def washer_count(mass: float) -> int | None:
    """Return the number of washers that load a press to at least a total mass (kg), the press included.

    None if the press's peg is too short for them.
    """
    count = max(1, math.ceil((mass - PRESS_MASS) / WASHER_MASS))
    return count if count * WASHER_HEIGHT <= PEG[1] else None


def weight_height(across: float, mass: float) -> float:
    """Return the height (m) of a steel bar with a hole, from its diameter `across` (m) and its mass (kg)."""
    return mass / (STEEL * math.pi / 4.0 * (across**2 - BAR_HOLE**2))


def steel_weight_size(mass: float) -> tuple[float, float]:
    """Return diameter and height (m) of the steel bar that loads a press to a total mass (kg), the press included.

    The diameter is the smallest of `BARS` at which the bar is not higher than wide, or else the largest of `BARS`.
    """
    bars = [(across, weight_height(across, mass - PRESS_MASS)) for across in BARS]
    return next((bar for bar in bars if bar[1] <= bar[0]), bars[-1])


MOST_STANDING = 3.0
"""Largest mass (kg) that stands on a press.

For a larger mass, a clamp presses through a spring instead. An assumption.
"""


def is_clamped(mass: float) -> bool:
    """Whether a clamp with a spring replaces a mass (kg) that would stand on a press."""
    return mass > MOST_STANDING


SPRING_RATE = 10e3
"""Rate (N/m) of the compression spring under a clamp. Such springs are usual, and their compression is easy to read."""


def spring_text(mass: float) -> str:
    """Describe the clamping force, the weight (N) of a mass (kg), and the spring's compression by this force.

    The spring has the rate `SPRING_RATE`.
    """
    force = mass * STANDARD_GRAVITY
    travel = force / SPRING_RATE
    return (f"{show(force, 'N', 2)}: a spring of {1e-3 * SPRING_RATE:g} N/mm, at least "
            f"{1e3 * (PEG[1] + 2.0 * travel):.0f} mm long, becomes {1e3 * travel:.2g} mm shorter")


def loading_text(part: str, mass: float) -> str:
    """Return the instruction to load a part's press to a total mass (kg), without a full stop."""
    if is_clamped(mass):
        return (
            f"Have a bar clamp and a compression spring ready, which goes over the peg of jig-{part}-press: so large a "
            f"board takes the weight of {mass_text(mass)}, too much to stand on it. With a washer on the spring, "
            "tighten "
            f"the clamp from under the mount, over the peg, to {spring_text(mass)} (another rate: force by rate)"
        )
    if washer_count(mass) is not None:
        weight = f"M8 washers (ISO 7093, {1e3 * WASHER_MASS:g} g each) on its peg"
    else:
        across, high = steel_weight_size(mass)
        weight = (f"a round bar of steel, {1e3 * across:g} mm across, about {1e3 * high:.0f} mm high "
                  f"({_digits_text(1e3 * weight_height(across, 1e-3), 2)} mm less for each gram of the press above "
                  f"{1e3 * PRESS_MASS:g} g: weigh it), with a hole of {1e3 * BAR_HOLE:g} mm through its middle for the "
                  "peg")
    return f"Load jig-{part}-press with {weight}, until press and weight together have {mass_text(mass)}"


def gluing_text(spec: SensorSpec, part: str, under: str, height: Toleranced, place: str) -> str:
    """Describe the gluing of the elastomer or the target in the jig, and the resulting height.

    `part` is ``elastomer`` or ``target``, and `under` names the face below it. `height` (m) is the height of its upper
    face above the board's top face. `place` is the text on its place in the jig's well.
    """
    assembly, count = spec.assembly, len(plates_of(spec).glued(part))
    press, area, glue = piece_press(spec, part), glued_area(spec, part), assembly.adhesive
    dose_text = glue_dose_text(glue, area, assembly.glue_line, assembly.glue_tolerance)
    on_foot = part == "target" and spec.elastomer is not None
    placing = f"drop the {part} into the well and lower the loaded press on it at once with the other hand"
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
        f"Put the frame jig-{part} on the base: it goes on one way only.{place} {loading_text(part, press.mass)}. "
        f"{holding}{verb} {dose_text}, on {under} in the well"
        f"{'' if count == 1 else ' of a cell'}{webs}; {placing}. Nothing stops the press: its weight brings the glue "
        f"to its line{pad}. Leave it until the glue has set, then lift press and "
        f"frame.{wiped}{setting_text(glue)}{again} "
        f"The upper face of the {part} is then {toleranced_text(height)} above the board's top face."
    )


def line_areas(layout: Layout) -> dict[str, float]:
    """Return the areas (m2) of the glue lines between a jaw and the board, keyed by the piece above each line.

    The order is from the jaw upwards; empty without a jaw. Pieces are as long as the board's body. A line is as wide as
    the narrower of its two faces.
    """
    spec, jaw, (_, area), half = layout.spec, layout.spec.jaw, board_plan(layout), layout.body_size[1] / 2
    if jaw is None:
        return {}
    faces, sheet = dict[str, tuple[float, float]](), stack.shield(layout)
    if sheet is not None:
        faces["shield"] = (seat_half_width(layout, sheet.lower),) * 2
    for name, (low, high) in zip(MOUNT_PIECES, backing_of(spec).spans, strict=False):
        faces[name] = seat_half_width(layout, low), seat_half_width(layout, high)
    faces["board"] = half, half
    areas, below = {}, jaw_section(jaw).face / 2
    for name, (lower, upper) in faces.items():
        areas[name] = area * min(1.0, min(below, lower) / half)
        below = upper
    return areas


def hard_glue_dose_text(assembly: Assembly, glue: Adhesive | None, area: float) -> str:
    """Describe the dose of glue for an area (m2) between two hard faces; `glue` is the glue for such faces."""
    return glue_dose_text(glue, area, assembly.glue_line, assembly.glue_tolerance)


def other_glue_reason(assembly: Assembly, board: tuple[Footprint, float], hard: Adhesive | None) -> str:
    """Give the reason why hard faces need another glue than the spec's; empty if they use the spec's glue.

    `board` is the outline and the area (m2) under the board, and `hard` the glue for hard faces.
    """
    adhesive, used, (plan, area) = assembly.adhesive, hard, board
    if adhesive is None or used is None or used == adhesive:
        return ""
    takes = spreading_time(adhesive, plan, HARD_PRESSURE * area, assembly.glue_line, HARD_HANDLING)
    return (
        f" Not {adhesive.product}: it flows for about {duration_text(adhesive.open_time or 0.0)} between two faces, "
        "and "
        f"takes {duration_text(takes)} to be spread, put in its place and pressed flat here; {used.product} flows for "
        f"{duration_text(used.open_time or 0.0)} (times unverified)."
    )


def board_gluing_text(layout: Layout) -> str:
    """Describe the gluing of the board in whole sentences: dose, reason for the choice of glue, and pressing."""
    glue = hard_adhesive(layout)
    verb = "Put" if glue is not None and glue.viscosity is None else "Spread"
    dose_text = hard_glue_dose_text(layout.spec.assembly, glue, board_plan(layout)[1])
    why = other_glue_reason(layout.spec.assembly, board_plan(layout), glue)
    return pressing_text(layout, f"{verb} {dose_text}, under the board's whole body.{why}") + setting_text(glue)


def pressing_text(layout: Layout, spreading: str) -> str:
    """Describe how the board is pressed on its mount; `spreading` is the sentence on spreading the glue.

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
            f"stiff plate (glass) on it, {mass_text(mass)} with a weight on its middle, until the glue has set. Never "
            f"press the {parts} at one edge."
        )
    each = "the pocket" if len(pockets) == 1 else "each pocket"
    return (
        f"Keep this order. (1) Clamp what the board goes on, its face level. (2) Stick {foam} and as large as the "
        f"{part}, under the roof of {each} of jig-board-press, by double-sided tape. The foam is "
        f"compressed by about {100.0 * FOAM_STRAIN:.0f} %, so it keeps the board down under the {parts}, whatever "
        f"{'its height' if is_one else 'their heights'} (unverified). {loading_text('board', mass)}. (3) {spreading} "
        "(4) Lay "
        f"the board on. Put the press round the {parts}: its feet stand on the board's rim, {in_mm(FOOT_INSET)} mm "
        f"inside the board's edges, inside any recess and film, and at least {in_mm(FOOT_ROOM[0])} mm beside them. It "
        f"stands by itself until the glue has set. Never press the {parts} at one edge."
    )


INHIBITION = (
    "Amines, nitriles, tin and sulphur keep platinum silicone liquid where it touches them (lists of techsil.co.uk and "
    "siliconesandmore.com; Smooth-On's bulletin on Dragon Skin names epoxies)"
)


def inhibition_warning(adhesive: Adhesive | None, film: Encapsulation | None, hard: Adhesive | None = None) -> str:
    """Warn of glues that may keep the film from curing, and state the remedy. Empty if no glue is known to do so.

    `hard` is the glue for hard faces; None if it is the spec's adhesive.
    """
    glues = [*dict.fromkeys(glue for glue in (adhesive, hard) if glue is not None and glue.inhibitor)]
    if film is None or not glues or not presets.cures_by_platinum(film.material.name):
        return ""
    named = " and ".join(f"{glue.product} ({glue.inhibitor})" for glue in glues)
    return (
        f" {INHIBITION}. {film.material.name} is such a silicone, and such a substance is in {named}. Let the glue "
        "cure fully first "
        f"({duration_text(max(glue.cure_time for glue in glues))}), wipe squeezed-out glue and the pad's sides with "
        "isopropanol, let that dry, and try a drop of the film on a scrap glued the same way. If it stays sticky, "
        "brush on a barrier coat (clear acrylic lacquer), or glue with something else. (No test of this pair was "
        "found: unverified.)"
    )
