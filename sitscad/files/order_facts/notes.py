"""What every paper of the order says of the flexible circuit in the same words (bend, finish, foil, laminate),
and how a readme is set.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise
from textwrap import wrap

from sitscad.assembly.places.tail_path import bends, bends_at_every_grasp, own_bend, pivot_line
from sitscad.basics.units import counted, in_mm, show
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.bending import (
    Bend,
    FinishedThickness,
    Where,
    bend_stretch,
    contact_copper,
    finished_thickness,
    has_tail_coverlay,
    lap_start,
    step_height,
    tail_copper,
)
from sitscad.layout.board import Capacitor, Coil, Layout, Stiffener
from sitscad.layout.copper import pair_in_words, smallest_gaps
from sitscad.layout.lamination import is_bonded, tail_holes
from sitscad.spec.circuit import Chip, CopperLayer, FpcSpec, LayerKind, Plating, StackLayer, Stackup, Tail
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.presets import finish, is_rigid, names

FOILS = {"rolled-annealed": "rolled annealed (RA)", "electrodeposited": "electrodeposited (ED)"}


def finish_text(layout: Layout) -> str:
    """Finish of the bare contacts with what it takes to plate them, foil and plating; of a fabricator who makes every
    board in one way the finish alone, since nothing else can be asked for.
    """
    chosen, stackup = finish(layout.spec.fpc.finish), layout.spec.fpc.stackup
    is_plated = layout.vias and stackup.plating_thickness
    plating = f"; {plating_text(stackup)}" if is_plated else ""
    bars = (
        f" Plated by a current: add plating bars from the tips of all {len(layout.pads)} contacts over the board's end "
        "to a common bar outside the outline (none are in the artwork), and cut them off with the outline before the "
        "test."
    )
    bars = bars if chosen.is_electrolytic and layout.pads else ""
    if layout.spec.fpc.rules.one_process:
        return f"Finish on bare contacts: {chosen.words}.{bars}"
    return f"Finish on bare contacts: {chosen.words}.{bars} Copper foil: {FOILS[layout.spec.fpc.copper]}{plating}."


PLATINGS = {
    Plating.PANEL: "panel plating: all copper that lies open is plated with the holes, and etched afterwards",
    Plating.PATTERN: "pattern plating: tracks are plated with the holes through a resist, the foil between them is "
    "etched afterwards",
    Plating.BUTTONS: "button plating: holes and their pads alone are plated, all tracks stay foil",
}


def plating_text(stackup: Stackup) -> str:
    """How the holes are plated and how thick, and which copper gets thicker with them."""
    text = f"{PLATINGS[stackup.plating]}; {show(stackup.plating_thickness, 'm')} nominal in the holes"
    times: dict[int, list[str]] = {}
    for layer in stackup.copper:
        if layer.plated:
            times.setdefault(stackup.platings(layer.number), []).append(str(layer.number))
    words = {1: "once", 2: "twice"}
    found = [f"copper {' and '.join(numbers)} {words[count]}" for count, numbers in sorted(times.items())]
    return f"{text} ({', '.join(found)})" if found else text


def copper_text(stackup: Stackup, layer: StackLayer | CopperLayer) -> str:
    """What a copper layer of a stack-up is made of: its foil, and what is plated on it."""
    if not stackup.is_plating_stated:
        return "as the fabricator states it: whether that contains the plating is not known"
    foil = f"{show(layer.foil, 'm')} foil"
    return f"{foil} and {show(layer.plated, 'm')} plating" if layer.plated else f"{foil}, not plated"


def holes_text(layout: Layout) -> str:
    """Through which layers the plated holes go; the copper of the body and of a thinner tail differ."""
    count, through = len(layout.vias), tail_copper(layout)
    inside = tail_holes(layout)
    if not inside:
        return "through all layers"
    own = f"{inside} in the tail through its {counted(through, 'layer')}"
    return f"{count - inside} through all {layout.copper_layers} layers, {own}"


def step_text(layout: Layout) -> str:
    """How the bottom is covered where the tail has fewer layers than the body; empty where it has not."""
    if not has_tail_coverlay(layout):
        return ""
    last, lap = tail_copper(layout), show(layout.spec.fpc.rules.coverlay_lap, "m")
    film = layer_text(layout.spec.fpc.stackup.layers[-1])
    return (
        f"The bottom coverlay cannot run over the step of {show(step_height(layout), 'm')} at the body's end and ends "
        f"there. The tail has a coverlay of its own under copper {last}, of the same film ({film}), laid before the "
        f"layers below are laminated on: it laps {lap} into the body, from x = {show(lap_start(layout), 'm')} on, "
        f"where the bond takes up its thickness.{_beside_lap(layout)}"
    )


def _beside_lap(layout: Layout) -> str:
    """How far the walls of the body's holes are from the tail's own coverlay; empty without such holes."""
    through = [via.centre.x + via.drill / 2 for via in layout.vias if via.lowest is None]
    if not through:
        return ""
    gap = show(lap_start(layout) - max(through), "m", 3)
    return f" Its edge is laid {gap} or more from the walls of holes."


def bend_text(layout: Layout) -> str:
    """How the tail is bent: about which lines, which way, how far, and where nothing stiff may be, as the check of the
    bend says; and how the line of a bend lies to the pivot of the jaw's hinge.
    """
    found, stretch, pivot = bends(layout), bend_stretch(layout), pivot_line(layout)
    if stretch is None:
        return "The tail has no stretch where its tracks run straight: do not bend it."
    if not found:
        return "The tail is not bent."
    said = []
    for bend in found:
        how = "in use (dynamic)" if bend.is_dynamic else "once, at assembly (static)"
        why = f", {bend.why}" if bend.why else ""
        if not why and pivot is not None:
            is_there = math.isclose(pivot, bend.line, abs_tol=1e-9)
            away = f" (the jaw's hinge has its pivot at x = {show(pivot, 'm')})"
            why = ", where the jaw's hinge has its pivot" if is_there else away
        room = "the rules state no radius"
        if bend.radius is not None:
            taken = f"x = {show(bend.start, 'm')} to {show(bend.end, 'm')}"
            room = f"inside radius at least {show(bend.radius, 'm')}, which takes {taken}"
        said.append(f"{how} by {bend_words(bend)}, about the line across it at x = {show(bend.line, 'm')}{why}; {room}")
    a, b = (show(x, "m") for x in stretch)
    return (
        f"The tail bends {'; then '.join(said)}. It bends nowhere else. No holes "
        f"and no joints between x = {a} and x = {b}."
    )


WAYS = {"down": "away from the face with the coils", "up": "towards the face with the coils"}


def bend_words(bend: Bend) -> str:
    """Angle and direction of a bend."""
    return f"{bend.angle_text} {bend.direction} ({WAYS[bend.direction]})"


def bend_place(layout: Layout, bend: Bend) -> str:
    """Angle, direction and line of a bend, as they are read at the bench."""
    why = f" ({bend.why})" if bend.why else ""
    return f"{bend_words(bend)} about the line {in_mm(bend.line - layout.body[2], 1)} mm behind the body{why}"


def bent_text(layout: Layout) -> str:
    """How the tail is bent at assembly: where, how far and how sharply, from the body on."""
    found = bends(layout)
    if not found:
        return "Do not bend the tail."
    lines = ", then by ".join(bend_place(layout, bend) for bend in found)
    radius = "" if found[0].radius is None else f", inside radius {in_mm(found[0].radius)} mm or more"
    return (
        f"Bend the tail by {lines}{radius}, and nowhere else: the drawing of the board has these lines."
        f"{hinge_text(layout)}"
    )


def hinge_text(layout: Layout) -> str:
    """What a jaw that moves asks of the bend at its hinge; empty if it asks for nothing."""
    own = own_bend(layout)
    if own is None or own.is_dynamic or not bends_at_every_grasp(layout.spec.fpc.tail, layout.spec.jaw):
        return ""
    return (
        " In a jaw that moves against the shaft, the bend farthest from the body moves at every grasp: this needs "
        "fpc.tail.bend: dynamic."
    )


def turn_text(tail: Tail | None) -> str:
    """How the tail turns in its plane, and the radius that its inner edge must keep; empty for a straight one."""
    if tail is None or (tail.turn == "none" and not tail.offset):
        return ""
    side = "left" if tail.offset > 0.0 else "right"
    how = (
        f"turns {tail.turn} by 90 degrees"
        if tail.turn != "none"
        else f"runs {show(abs(tail.offset), 'm')} to the {side}"
    )
    return f"The tail {how} before its contacts; inner edges there have a radius of {show(tail.turn_radius, 'm')}."


def coil_text(coils: tuple[Coil, ...], spec: CoilSpec) -> str:
    """The coils' size as the drawing dimensions it: over the outer copper, polygons across flats; who is turned."""
    size = " x ".join(f"{side * 1e3:.6g}" for side in dict.fromkeys(spec.size))
    turned = {coil.name: math.degrees(coil.placement.rotation) for coil in coils if coil.placement.rotation}
    words = ", ".join(f"{name} by {angle:g} deg" for name, angle in turned.items())
    rotated = f"; turned: {words}" if words and not spec.outline.is_round else ""
    return (
        f"Coils ({spec.shape}): {size} mm {spec.outline.across}over the outer copper edges, "
        f"tracks {show(spec.trace_width, 'm')}, gaps {show(spec.trace_spacing, 'm')}{rotated}."
    )


def gap_texts(layout: Layout) -> Iterator[str]:
    """The smallest gap between copper as drawn, with the layers that have it, and what it lies between."""
    layers: dict[str, list[str]] = {}
    for number, near in smallest_gaps(layout).items():
        text = f"{show(near.gap, 'm', 3)} between {pair_in_words(near)}"
        x, y = (show(round(way, 8), "m") for way in (near.x, near.y))
        layers.setdefault(text, []).append(f"{number} (x = {x}, y = {y})")
    yield from (f"copper {', '.join(numbers)}: {text}" for text, numbers in layers.items())


def chip_text(capacitors: tuple[Capacitor, ...], chip: Chip | None) -> str:
    """The capacitors' land pattern; empty without capacitors."""
    if not capacitors or chip is None:
        return ""
    names = ", ".join(each.reference for each in capacitors)
    along, across = show(chip.pad_along, "m"), show(chip.pad_across, "m")
    return f"Pads of {names} ({chip.name}): {along} x {across}, {show(chip.pitch, 'm')} from middle to middle."


def stiffener_text(tail: Tail | None, plate: Stiffener | None) -> str:
    """The stiffener's material, size (along the tail first) and thickness; empty without one."""
    if plate is None:
        return ""
    x0, y0, x1, y1 = bounding_box([plate.outline.outline])
    along, across = (y1 - y0, x1 - x0) if tail is not None and tail.turn != "none" else (x1 - x0, y1 - y0)
    size = f"{show(along, 'm')} along the tail, {show(across, 'm')} across"
    film = plate.thickness - plate.adhesive
    parts = f" ({show(film, 'm')} film and {show(plate.adhesive, 'm')} adhesive)" if plate.adhesive else ""
    ask = "" if plate.adhesive else "; not a stock thickness that we know of: tell us the nearest that you have"
    thick = f"about {show(plate.thickness, 'm')} thick with its adhesive{parts}{ask}"
    return f"{plate.material}, {size}, {thick}; the total thickness at the contacts governs"


def contact_sum_text(layout: Layout) -> str:
    """The layers under the contacts, and the thickness that they and the stiffener add up to."""
    copper, made = sorted(contact_copper(layout)), show(finished_thickness(layout, Where.CONTACT).nominal, "m")
    there = f"copper {', '.join(map(str, copper))}{' alone' if len(copper) < tail_copper(layout) else ''}"
    plate = "" if layout.stiffener is None else f" and a stiffener of {show(layout.stiffener.thickness, 'm')}"
    return f"there {there} counts, which with the films of the stack-up{plate} gives {made}"


def laminate_text(stackup: Stackup) -> str:
    """Which of the films between copper are bonded with adhesive, as far as the stack-up says."""
    names = dict.fromkeys(layer.material for layer in stackup.layers if layer.kind is not LayerKind.COPPER)
    words = [f"{name}: {_LAMINATES[name]}" for name in names if name in _LAMINATES]
    return "; ".join(words) or "as the stack-up's materials say"


def layer_text(layer: StackLayer) -> str:
    """A layer's material and what it is laminated from, as far as the stack-up says."""
    return f"{layer.material} ({layer.made_of})" if layer.made_of else layer.material


def bond_texts(stackup: Stackup) -> dict[str, str]:
    """Where copper is bonded to copper by more than one core: between which layers, and what of the sheets is known."""
    places: dict[str, list[str]] = {}
    for upper, lower in pairwise(layer.number for layer in stackup.copper):
        films = stackup.between(upper, lower)
        if not is_bonded(films):
            continue
        whole = show(sum(film.thickness for film in films), "m")
        parts = ", ".join(f"{show(film.thickness, 'm')} {layer_text(film)}" for film in films)
        text = f"{whole} from copper to copper: {parts}"
        if any(film.material == "bondply" and not film.made_of for film in films):
            unknown = "which sheets and how much adhesive make up the bondply is not stated in the stack-up"
            text = f"{text}; {unknown}: choose them to this distance, and tell us"
        places.setdefault(text, []).append(f"{upper} to {lower}")
    return {f"copper {', '.join(between)}": text for text, between in places.items()}


def outline_text(rules: DesignRules) -> str:
    """The outline's tolerance, and whose figure it is where the fabricator states none."""
    holder = rules.holders.get("outline_tolerance", rules.name)
    is_anothers = holder != rules.name and holder in names("rules")  # a user's own figure has a line of a file there
    other = f" (not stated by {rules.name}: the figure of {holder}, to be confirmed)" if is_anothers else ""
    return f"+/- {show(rules.outline_tolerance, 'm')}{other}"


def questions(fpc: FpcSpec) -> Iterator[tuple[str, str]]:
    """What a fabricator who makes every board in one way lists nothing of: asked before ordering, and not ordered."""
    rules, foil = fpc.rules, FOILS[fpc.copper]
    if not rules.one_process:
        return
    name = rules.house or rules.name
    yield "To know", f"{name} makes every board in one way. What follows is not ordered: ask where it matters to you."
    yield "Copper", f"which foil it is, and how thick the plating of the holes (the design counts on {foil})"
    yield "Class", f"which class of {'IPC-6012' if is_rigid(fpc.stackup) else 'IPC-6013'} the boards keep"
    yield "Test", "whether every board is tested for continuity and isolation"
    yield "Marks", "whether date codes and maker's marks can be left off"


def quantity_text(boards: int | None, panel_parts: int | None, multiple: int = 1) -> str:
    """How many boards are wanted and, where they come in panels of so many, how many panels; how many are ordered where
    they are sold in a multiple; empty if not said.
    """
    if boards is None:
        return ""
    wanted = counted(boards, "board")
    if panel_parts is None:
        sold = math.ceil(boards / multiple) * multiple
        return wanted if sold == boards else f"{wanted}: order {sold}, they are sold in multiples of {multiple}"
    panels = math.ceil(boards / panel_parts)
    spare = panels * panel_parts - boards
    more = f", {spare} more than wanted" if spare else ""
    return f"{wanted}: {counted(panels, 'panel')} of {panel_parts} ({panels * panel_parts} boards{more})"


_LAMINATES = {
    "polyimide": "copper on polyimide without adhesive (as Pyralux AP)",
    "felios": "copper on polyimide without adhesive (Panasonic Felios R-F775)",
    "bondply": "polyimide film with adhesive on both faces",
    "polyimide-coverlay": "polyimide film with adhesive on one face",
    "solder-mask": "solder mask, printed",
    "FR4": "glass cloth and epoxy, core",
    "FR4-prepreg": "glass cloth and epoxy, prepreg",
}


def thickness_texts(layout: Layout) -> dict[str, str]:
    """Finished thickness by place: nominal, and in brackets from the least to the most that may be delivered."""
    places = {Where.COIL: "at the coils"}
    if layout.spec.fpc.tail is not None:
        places |= {Where.TAIL: "tail", Where.CONTACT: "at the contacts"}
    return {word: thickness_text(layout, where) for where, word in places.items()}


def thickness_text(layout: Layout, where: Where) -> str:
    """Finished thickness at a place. At contacts that are plugged in it is what the connector takes: no other figure is
    ordered there, and where the fabricator's own band is wider that is said.
    """
    made, tail = finished_thickness(layout, where), layout.spec.fpc.tail
    if where is not Where.CONTACT or tail is None or tail.connector.insertion_thickness <= 0.0:
        return _band(made)
    wanted, allowed = tail.connector.insertion_thickness, tail.connector.insertion_thickness_tolerance
    low, high = wanted - allowed, wanted + allowed
    text = f"{_band(FinishedThickness(low, wanted, high, ''))}, as {tail.connector.name} takes it"
    if made.minimum >= low - ROUNDING and made.maximum <= high + ROUNDING:
        return text
    kept = f"+/- {show(made.maximum - made.nominal, 'm')} about {show(made.nominal, 'm')}"
    return f"{text}: closer than {layout.spec.fpc.rules.name} keeps ({kept}), to be confirmed or measured"


ROUNDING = 1e-9
"""Thicknesses (m) that differ by less are the same."""


def _band(thickness: FinishedThickness) -> str:
    return f"{show(thickness.nominal, 'm')} ({show(thickness.minimum, 'm')} to {show(thickness.maximum, 'm')})"


TEXT_WIDTH = 100


def hanging(start: str, text: str, width: int) -> list[str]:
    """A text in lines of at most so many letters: `start` begins the first one, and moves the others in. Names of files
    and pieces are not broken at their hyphens.
    """
    return wrap(text, width, initial_indent=start, subsequent_indent=" " * len(start), break_on_hyphens=False)


def headed(title: str, lines: Iterable[str]) -> list[str]:
    """Lines under a heading, and an empty one."""
    return [title, "-" * len(title), *lines, ""]


def section(title: str, rows: Iterable[tuple[str, str]]) -> list[str]:
    """A heading and rows of a name and a text, the text wrapped beside its name."""
    lines: list[str] = []
    pairs = list(rows)
    indent = max(len(name) for name, _ in pairs) + 2
    for name, text in pairs:
        first, *rest = wrap(text, TEXT_WIDTH - indent, break_long_words=False, break_on_hyphens=False) or [""]
        lines += [f"{name:<{indent}}{first}".rstrip(), *(" " * indent + more for more in rest)]
    return headed(title, lines)
