"""Gluing in words: how much of which glue, what presses the pieces meanwhile, how long it takes, and how heights are
measured on silicone.
"""

from __future__ import annotations

import math
from dataclasses import replace

from sitscad.estimates.gluing import (
    board_adhesive,
    board_plan,
    board_press,
    force_for,
    glued_area,
    lying_time,
    piece_press,
    pressed_by,
)
from sitscad.layout.board import Layout
from sitscad.layout.laser_sheet import joined_part
from sitscad.parts.tooling import PEG, is_cast
from sitscad.scene.bodies import joints
from sitscad.scene.column import Toleranced
from sitscad.spec import presets
from sitscad.spec.materials import Adhesive
from sitscad.spec.mount import Assembly
from sitscad.spec.places import cell_placements
from sitscad.spec.sensor import SensorSpec
from sitscad.units import in_mm, show

STEEL = 7850.0
"""Density (kg/m3) of steel, as of the washers below."""

WASHER_MASS, WASHER_HEIGHT = 6.2e-3, 2.0e-3
"""Mass (kg) and height (m) of a washer M8 of ISO 7093: 24 mm, hole 8.4 mm, 2 mm thick, of steel of 7.85 g/cm3."""

PRESS_MASS = 2e-3
"""Least mass (kg) of a printed press of the jig."""

BARS, BAR_HOLE = (30e-3, 50e-3, 80e-3), 8.5e-3
"""Diameters (m) of the steel bars that load a press, and of the hole in their middle for the press's peg."""

HEIGHT_ERROR = 5e-6
"""How far (m) an instrument may press a pad whose height it reads."""

LIGHT_GAUGE = 0.1
"""Force (N) of a light dial gauge. From memory, not verified."""

LARGEST_BEAD = 10.0
"""Largest volume (mm3) that is given as a single bead, too."""

RATCHET = 5.0
"""Least force (N) of a micrometer's ratchet, usually 5 to 10 N. From memory, not verified."""


def toleranced(size: Toleranced) -> str:
    """A length in millimetres, with the farthest that its tolerances take it from that."""
    return f"{size.nominal * 1e3:.3f} +-{size.spread * 1e3:.3f} mm"


def grams(mass: float) -> str:
    """A mass (kg) to two digits, in grams or kilograms."""
    return f"{_plain(mass * 1e3, 2)} g" if mass < 1.0 else f"{_plain(mass, 2)} kg"


def duration(seconds: float) -> str:
    """A time (s) in seconds, minutes or hours."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{max(1.0, seconds):.0f} s"


def product(assembly: Assembly) -> str:
    """The glue's product, or just glue."""
    return assembly.adhesive.product if assembly.adhesive is not None else "glue"


def dose(glue: Adhesive | None, area: float, line: float, tolerance: float) -> str:
    """How much glue goes on an area (m2) for a line (m): ``2.9 mm3 of Loctite 401``; a tape by its area."""
    under, volume = f"{_plain(1e6 * area, 3)} mm2", 1e9 * area * line
    if glue is not None and glue.viscosity is None:
        return f"{glue.product}, {under} cut to the outline"
    bead = f"; a bead of {(6.0 * volume / math.pi) ** (1.0 / 3.0):.1f} mm" if volume < LARGEST_BEAD else ""
    return (
        f"{_plain(volume, 2)} mm3 (microlitres{bead}) of {glue.product if glue else 'glue'}, for a line of "
        f"{in_mm(line)} +-{in_mm(tolerance)} mm under {under}"
    )


def _plain(value: float, digits: int) -> str:
    """A number to significant digits, never with an exponent."""
    return f"{float(f'{value:.{digits - 1}e}'):.12g}"


def setting(glue: Adhesive | None) -> str:
    """How long glue flows, when pieces may be let go, and when it is at full strength; empty if nothing is known."""
    if glue is None or glue.set_time is None or glue.open_time is None:
        return "" if glue is None or not glue.cure_time else f" Full strength comes after {duration(glue.cure_time)}."
    return (
        f" {glue.product[0].upper()}{glue.product[1:]} flows for about {duration(glue.open_time)} once the faces meet, "
        f"sets in about {duration(glue.set_time)} and has its full strength after {duration(glue.cure_time)} (thin "
        "lines; the data sheet goes before)."
    )


def measuring(spec: SensorSpec) -> str:
    """How heights on the soft pad are measured; empty without one."""
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


def primed(spec: SensorSpec) -> str:
    """Which faces get a primer; empty where none is needed."""
    glue = spec.assembly.adhesive
    if glue is None or not glue.primer or spec.elastomer is None:
        return ""
    return (
        f"Wipe {glue.primer.partition(' on ')[0]} on the elastomer's upper and lower face, on nothing else (its sides, "
        "board, target and metal need none), once and thinly, and let it dry before gluing: about a minute, the data "
        "sheet has it."
    )


def washers(mass: float) -> int | None:
    """Number of washers that bring a press to a mass (kg). None if its peg does not hold them."""
    count = max(1, math.ceil((mass - PRESS_MASS) / WASHER_MASS))
    return count if count * WASHER_HEIGHT <= PEG[1] else None


def steel_bar(mass: float) -> tuple[float, float]:
    """Diameter and height (m) of a bar with a hole that brings a press to a mass (kg)."""
    bars = [(across, (mass - PRESS_MASS) / (STEEL * math.pi / 4.0 * (across**2 - BAR_HOLE**2))) for across in BARS]
    return next((bar for bar in bars if bar[1] <= 2.0 * bar[0]), bars[-1])


def loaded(part: str, mass: float) -> str:
    """Instruction to load the press of a part to a mass (kg); the beginning of a sentence."""
    if washers(mass) is not None:
        weight = f"M8 washers (ISO 7093, {1e3 * WASHER_MASS:g} g each) on its peg"
    else:
        across, high = steel_bar(mass)
        weight = (f"a round bar of steel, {1e3 * across:g} mm across, about {1e3 * high:.0f} mm high, with a hole of "
                  f"{1e3 * BAR_HOLE:g} mm through its middle for the peg")
    return f"Load jig-{part}-press with {weight}, until both weigh {grams(mass)}"


def glued(spec: SensorSpec, part: str, under: str, height: Toleranced, place: str) -> str:
    """How the elastomer or the target is glued in the jig at its place, and how high it is then."""
    assembly, cells = spec.assembly, len(cell_placements(spec))
    is_one = cells == 1 or (part == "elastomer" and joined_part(spec) is not None)
    press, area, glue = piece_press(spec, part), glued_area(spec, part), assembly.adhesive
    said = dose(glue, area, assembly.glue_line, assembly.glue_tolerance)
    on_foot = part == "target" and spec.elastomer is not None
    placed = f"drop the {part} into the well and lower the loaded press on it"
    if on_foot:
        placed = "lower the loaded press with the target into the well, without pushing"
    held = (
        f"Hold the target on the foot of jig-{part}-press, a burr towards the foot, its edges flush, by a trace of "
        "petroleum jelly in the middle. " if on_foot else ""
    )
    verb = "Put" if glue is not None and glue.viscosity is None else "Spread"
    webs = ", under the pads alone: the webs between them get none" if part == "elastomer" and joints(spec) else ""
    pad = f", and presses the pad by {1e3 * press.travel:.2g} mm, which comes back" if press.travel else ""
    again = "" if is_one else f" Do this for one of the {cells} cells after the other: what waits sets."
    wiped = " Wipe the jelly off with isopropanol." if on_foot else ""
    return (
        f"Put the frame jig-{part} on the base: it goes on one way only.{place} {loaded(part, press.mass)}. "
        f"{held}{verb} {said}, on {under} in the well"
        f"{'' if is_one else ' of a cell'}{webs}; {placed}. Nothing stops the press: its weight brings the glue to its "
        f"line{pad}. Leave it until the glue has set, then lift press and frame.{wiped}{setting(glue)}{again} From the "
        f"board's top face to its upper face are {toleranced(height)} then."
    )


def board_assembly(layout: Layout) -> Assembly:
    """The assembly with the adhesive that goes between board and mount."""
    assembly, glue = layout.spec.assembly, board_adhesive(layout)
    if glue is None or glue == assembly.adhesive:
        return assembly
    return replace(assembly, adhesive=glue, glue_line=glue.line, glue_tolerance=glue.tolerance)


def board_glued(layout: Layout) -> str:
    """The glue under the board: how much, why another one than the spec's, and what is pressed on; a whole sentence."""
    spec, used = layout.spec, board_assembly(layout)
    plan, area = board_plan(layout)
    why, own = "", spec.assembly.adhesive
    if own is not None and used.adhesive is not None and used.adhesive != own:
        takes = lying_time(own, plan, board_press(spec).force, spec.assembly.glue_line)
        why = (
            f" Not {own.product}: it flows for about {duration(own.open_time or 0.0)} between two faces, and takes "
            f"{duration(takes)} to be spread and to lie flat here; {used.adhesive.product} flows for "
            f"{duration(used.adhesive.open_time or 0.0)} (times unverified)."
        )
    said = dose(used.adhesive, area, used.glue_line, used.glue_tolerance)
    verb = "Put" if used.adhesive is not None and used.adhesive.viscosity is None else "Spread"
    return f"{verb} {said}, under the board's whole body.{why} {pressing(layout)}{setting(used.adhesive)}"


def pressing(layout: Layout) -> str:
    """What presses the board on its mount: never a finger on the pads alone."""
    spec = layout.spec
    part = "target" if spec.target is not None else "elastomer"
    if spec.target is None and spec.elastomer is None:
        return "Press the board down with a flat stick until the glue has set."
    press = board_press(spec)
    is_one = len(cell_placements(spec)) == 1
    gives = "the pad gives" if is_one else "they give"
    pads = f" ({gives} by {1e3 * press.travel:.2g} mm, which comes back)" if press.travel else ""
    rim = f"Press the rim beside the {part} down with a flat stick, and never the {part} at one edge."
    if not is_one:
        return (
            f"Lay a flat stiff plate (glass) over all {part}s, {grams(press.mass)} with a weight on its middle, until "
            f"the glue has set{pads}. {rim}"
        )
    kind = spec.mount.kind if spec.mount is not None and not is_cast(layout) else ""  # a skin is too large for the well
    if kind in ("custom", "bench-plate"):  # the frame lies on the board's rim, which stands out by the glue
        whose = "your mount" if kind == "custom" else "the mount"
        return (
            f"{loaded(part, press.mass)} before any glue is spread, have jig-{part}, waxed, at hand, fix {whose}, "
            f"and then lay the board on. In one go, while the glue flows, one hand puts the frame round the {part} and "
            "presses it down on the board's rim with two fingers; the other lowers the press into the frame's well, "
            f"which keeps it upright. Hold the frame until the glue has set{pads}. Never press the {part} at one edge."
        )
    return (
        f"{loaded(part, press.mass)} before any glue is spread, and clamp what the board goes on, so that both hands "
        f"are free. Stand the press on the {part} and hold it upright with one hand until the glue has set{pads}; the "
        f"other presses the rim beside the {part} down with a flat stick. Never press the {part} at one edge."
    )


def rods(radius: float | None) -> str:
    """What a tail is bent over where no edge of the mount is below it; empty without a radius (m)."""
    if radius is None or radius <= 0.0:
        return ""
    across = math.ceil(2e4 * radius - 1e-6) / 10.0
    return (
        f" Where no round edge of the mount lies below such a line, lay a rod of {across:g} mm diameter (or a little "
        "more) along it and bend the tail over that, by hand and slowly."
    )


INHIBITION = (
    "Amines, nitriles, tin and sulphur keep platinum silicone liquid where it touches them (lists of techsil.co.uk and "
    "siliconesandmore.com; Smooth-On's bulletin on Dragon Skin names epoxies)"
)


def inhibited(spec: SensorSpec) -> str:
    """What may keep the film from curing on the glued pieces, and what to do; empty if nothing is known to."""
    film, glue = spec.encapsulation, spec.assembly.adhesive
    if film is None or glue is None or not glue.inhibitor or not presets.cures_by_platinum(film.material.name):
        return ""
    return (
        f" {INHIBITION}. {film.material.name} is such a silicone, and of {glue.product}, {glue.inhibitor}. Let the "
        f"glue cure fully first ({duration(glue.cure_time)}), wipe squeezed-out glue and the pad's sides with "
        "isopropanol, let that dry, and try a drop of the film on a scrap glued the same way. If it stays sticky, "
        "brush on a barrier coat (clear acrylic lacquer), or glue with something else. (No test of this pair was "
        "found: unverified.)"
    )
