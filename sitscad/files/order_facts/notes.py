"""Texts on the flexible circuit shared by all order documents (bend, finish, foil, laminate), and layout of readmes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from textwrap import wrap

from sitscad.assembly.places.tail_path import bends, bends_at_every_grasp, stated_bend
from sitscad.basics.units import count_text, in_mm, show
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.bending import Bend, FinishedThickness, Where, finished_thickness
from sitscad.layout.board import Capacitor, Coil, Layout, Pad, SolderedThermistor, Stiffener, Via
from sitscad.layout.gaps import Nearness, pair_in_words
from sitscad.layout.lamination import is_bonded
from sitscad.spec.circuit import Chip, CopperLayer, FpcSpec, LayerKind, Plating, StackLayer, Stackup, Tail
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.mount import Jaw
from sitscad.spec.presets import finish, is_rigid, names
from sitscad.spec.thermistor import Thermistor

FOILS = {"rolled-annealed": "rolled annealed (RA)", "electrodeposited": "electrodeposited (ED)"}


def finish_text(pads: tuple[Pad, ...], fpc: FpcSpec, has_holes: bool) -> str:
    """Describe the finish of the bare contacts, its plating bars, the foil and the plating of holes.

    For a fabricator with a single process, the text omits foil and plating, because the order cannot choose them.
    """
    chosen, stackup = finish(fpc.finish), fpc.stackup
    is_plated = has_holes and stackup.plating_thickness
    plating = f"; {plating_text(stackup)}" if is_plated else ""
    bars = (
        f" Plated by a current: add plating bars from the tips of all {len(pads)} contacts over the board's end "
        "to a common bar outside the outline (none are in the artwork), and cut them off with the outline before the "
        "test."
    )
    bars = bars if chosen.is_electrolytic and pads else ""
    if fpc.rules.one_process:
        return f"Finish on bare contacts: {chosen.words}.{bars}"
    return f"Finish on bare contacts: {chosen.words}.{bars} Copper foil: {FOILS[fpc.copper]}{plating}."


PLATINGS = {
    Plating.PANEL: "panel plating: all copper that lies open is plated with the holes, and etched afterwards",
    Plating.PATTERN: "pattern plating: tracks are plated with the holes through a resist, the foil between them is "
    "etched afterwards",
    Plating.BUTTONS: "button plating: holes and their pads alone are plated, all tracks stay foil",
}


def plating_text(stackup: Stackup) -> str:
    """Describe the plating of the holes, its thickness, and the copper layers that it thickens."""
    text = f"{PLATINGS[stackup.plating]}; {show(stackup.plating_thickness, 'm')} nominal in the holes"
    times: dict[int, list[str]] = {}
    for layer in stackup.copper:
        if layer.plated:
            times.setdefault(stackup.platings(layer.number), []).append(str(layer.number))
    counts = {1: "once", 2: "twice"}
    layers = [f"copper {' and '.join(numbers)} {counts[count]}" for count, numbers in sorted(times.items())]
    return f"{text} ({', '.join(layers)})" if layers else text


def copper_text(stackup: Stackup, layer: StackLayer | CopperLayer) -> str:
    """Describe a copper layer of a stack-up: its foil and the plating on it."""
    if not stackup.is_plating_stated:
        return "as the fabricator states it: whether that contains the plating is not known"
    foil = f"{show(layer.foil, 'm')} foil"
    return f"{foil} and {show(layer.plated, 'm')} plating" if layer.plated else f"{foil}, not plated"


def holes_text(copper_layers: int, vias: tuple[Via, ...], tail_layers: int, inside: int) -> str:
    """Describe the layers that the plated holes go through, separately for the body and a thinner tail."""
    count, through = len(vias), tail_layers
    if not inside:
        return "through all layers"
    tail_text = f"{inside} in the tail through its {count_text(through, 'layer')}"
    return f"{count - inside} through all {copper_layers} layers, {tail_text}"


def step_text(fpc: FpcSpec, vias: tuple[Via, ...], lap_start: float) -> str:
    """Describe the bottom coverlay at the step from the body to a thinner tail; empty without this step.

    `lap_start` is the x (m) at which the tail's own coverlay begins.
    """
    if not fpc.has_tail_coverlay:
        return ""
    last, lap = fpc.tail_copper, show(fpc.rules.coverlay_lap, "m")
    film = layer_text(fpc.stackup.layers[-1])
    return (
        f"The bottom coverlay cannot run over the step of {show(fpc.tail_step, 'm')} at the body's end "
        f"and ends there. The tail has a coverlay of its own under copper {last}, of the same film ({film}), laid "
        f"before the layers below are laminated on: it laps {lap} into the body, from x = "
        f"{show(lap_start, 'm')} on, where the bond takes up its thickness."
        f"{_beside_lap(vias, lap_start)}"
    )


def _beside_lap(vias: tuple[Via, ...], lap: float) -> str:
    """Describe the smallest gap from the edge of the tail's own coverlay to the walls of through holes.

    Empty if there are no through holes. `lap` is the x (m) of the edge.
    """
    through = [via.centre.x + via.drill / 2 for via in vias if via.lowest is None]
    if not through:
        return ""
    gap = show(lap - max(through), "m", 3)
    return f" Its edge is laid {gap} or more from the walls of holes."


def bend_text(stretch: tuple[float, float] | None, tail_bends: tuple[Bend, ...], pivot: float | None) -> str:
    """Describe the tail's bends: lines, directions, angles, radii, and the stretch without holes and joints.

    `stretch` holds the x (m) of both ends of this stretch; None if no part of the tail is straight. `pivot` is the x
    (m) of the pivot of the jaw's hinge; None if it is unknown.
    """
    if stretch is None:
        return "The tail has no stretch where its tracks run straight: do not bend it."
    if not tail_bends:
        return "The tail is not bent."
    texts = []
    for bend in tail_bends:
        how = "in use (dynamic)" if bend.is_dynamic else "once, at assembly (static)"
        why = f", {bend.why}" if bend.why else ""
        if not why and pivot is not None:
            is_there = math.isclose(pivot, bend.line, abs_tol=1e-9)
            pivot_text = f" (the jaw's hinge has its pivot at x = {show(pivot, 'm')})"
            why = ", where the jaw's hinge has its pivot" if is_there else pivot_text
        room = "the rules state no radius"
        if bend.radius is not None:
            range_text = f"x = {show(bend.start, 'm')} to {show(bend.end, 'm')}"
            room = f"inside radius at least {show(bend.radius, 'm')}, which takes {range_text}"
        line = show(bend.line, "m")
        texts.append(f"{how} by {bend_words(bend)}, about the line across it at x = {line}{why}; {room}")
    a, b = (show(x, "m") for x in stretch)
    return (
        f"The tail bends {'; then '.join(texts)}. It bends nowhere else. No holes "
        f"and no joints between x = {a} and x = {b}."
    )


WAYS = {"down": "away from the face with the coils", "up": "towards the face with the coils"}


def bend_words(bend: Bend) -> str:
    """Describe angle and direction of a bend."""
    return f"{bend.angle_text} {bend.direction} ({WAYS[bend.direction]})"


def bend_place(body_end: float, bend: Bend) -> str:
    """Describe angle, direction and line of a bend; the line is measured from the body's end, as at the bench."""
    why = f" ({bend.why})" if bend.why else ""
    return f"{bend_words(bend)} about the line {in_mm(bend.line - body_end, 1)} mm behind the body{why}"


def bent_text(layout: Layout) -> str:
    """Describe how to bend the tail at assembly: lines, angles and inside radius, from the body outwards."""
    tail_bends = bends(layout)
    if not tail_bends:
        return "Do not bend the tail."
    lines = ", then by ".join(bend_place(layout.body[2], bend) for bend in tail_bends)
    radius = "" if tail_bends[0].radius is None else f", inside radius {in_mm(tail_bends[0].radius)} mm or more"
    return (
        f"Bend the tail by {lines}{radius}, and nowhere else: the drawing of the board has these lines."
        f"{hinge_text(layout.spec.fpc.tail, layout.spec.jaw, stated_bend(layout))}"
    )


def hinge_text(tail: Tail | None, jaw: Jaw | None, hinge_bend: Bend | None) -> str:
    """Return a warning if the bend at the hinge of a moving jaw is static, although each grasp bends the tail.

    Empty if the tail does not bend there at each grasp, or if the bend is dynamic.
    """
    if hinge_bend is None or hinge_bend.is_dynamic or not bends_at_every_grasp(tail, jaw):
        return ""
    return (
        " In a jaw that moves against the shaft, the bend farthest from the body moves at every grasp: this needs "
        "fpc.tail.bend: dynamic."
    )


def turn_text(tail: Tail | None) -> str:
    """Describe the tail's turn or offset in its plane, and the least inner radius; empty for a straight tail."""
    if tail is None or (tail.turn == "none" and not tail.offset):
        return ""
    side = "left" if tail.offset > 0.0 else "right"
    how = (
        f"turns {tail.turn} by 90 degrees"
        if tail.turn != "none"
        else f"runs {show(abs(tail.offset), 'm')} to the {side}"
    )
    return f"The tail {how} before its contacts; inner edges there have a radius of {show(tail.turn_radius, 'm')}."


def coil_kinds(coils: tuple[Coil, ...], spec: CoilSpec) -> list[CoilSpec]:
    """Return `spec` and the own windings of a reference coil that differ from it."""
    return [spec, *(coil.placement.own for coil in coils if coil.placement.own is not None)]


def coil_text(coils: tuple[Coil, ...], spec: CoilSpec) -> str:
    """Describe the coils: size over the outer copper edges, tracks, gaps, and turned coils.

    The size of polygons is measured across flats. `spec` has their dimensions.
    """
    head = f"Coil {coils[0].name}" if coils[0].placement.own is not None else "Coils"
    size = " x ".join(f"{side * 1e3:.6g}" for side in dict.fromkeys(spec.size))
    turned = {coil.name: math.degrees(coil.placement.rotation) for coil in coils if coil.placement.rotation}
    angles = ", ".join(f"{name} by {angle:g} deg" for name, angle in turned.items())
    rotated = f"; turned: {angles}" if angles and not spec.outline.is_round else ""
    return (
        f"{head} ({spec.shape}): {size} mm {spec.outline.size_note}over the outer copper edges, "
        f"tracks {show(spec.trace_width, 'm')}, gaps {show(spec.trace_spacing, 'm')}{rotated}."
    )


def gap_texts(gaps: Mapping[int, Nearness]) -> Iterator[str]:
    """Yield the smallest gap between copper as drawn, with its layers, places and the features on its two sides."""
    layers: dict[str, list[str]] = {}
    for number, near in gaps.items():
        text = f"{show(near.gap, 'm', 3)} between {pair_in_words(near)}"
        x, y = (show(round(way, 8), "m") for way in (near.x, near.y))
        layers.setdefault(text, []).append(f"{number} (x = {x}, y = {y})")
    yield from (f"copper {', '.join(numbers)}: {text}" for text, numbers in layers.items())


def chip_texts(
    chips: Sequence[Capacitor | SolderedThermistor], capacitor: Chip | None, sensor: Thermistor | None
) -> Iterator[str]:
    """Yield a description of each land pattern of `chips`: of the capacitors, and of the thermistor.

    `capacitor` is the land pattern of the capacitors; the pattern of the thermistor is in its spec `sensor`.
    """
    for kind, chip in ((Capacitor, capacitor), (SolderedThermistor, sensor.part.chip if sensor is not None else None)):
        names = ", ".join(each.reference for each in chips if isinstance(each, kind))
        if not names or chip is None:
            continue
        length, across = show(chip.pad_along, "m"), show(chip.pad_across, "m")
        yield f"Pads of {names} ({chip.name}): {length} x {across}, {show(chip.pitch, 'm')} from middle to middle."


def stiffener_text(tail: Tail | None, plate: Stiffener | None) -> str:
    """Describe the stiffener: material, size (along the tail first) and thickness; empty without a stiffener."""
    if plate is None:
        return ""
    x0, y0, x1, y1 = bounding_box([plate.outline.outline])
    length, across = (y1 - y0, x1 - x0) if tail is not None and tail.turn != "none" else (x1 - x0, y1 - y0)
    size = f"{show(length, 'm')} along the tail, {show(across, 'm')} across"
    film = plate.thickness - plate.adhesive
    parts = f" ({show(film, 'm')} film and {show(plate.adhesive, 'm')} adhesive)" if plate.adhesive else ""
    ask = "" if plate.adhesive else "; not a stock thickness that we know of: tell us the nearest that you have"
    thick = f"about {show(plate.thickness, 'm')} thick with its adhesive{parts}{ask}"
    return f"{plate.material}, {size}, {thick}; the total thickness at the contacts governs"


def contact_sum_text(
    stiffener: Stiffener | None, contact_layers: frozenset[int], tail_layers: int, thickness: FinishedThickness
) -> str:
    """Describe the copper layers under the contacts and the total thickness with films and stiffener."""
    copper, total = sorted(contact_layers), show(thickness.nominal, "m")
    there = f"copper {', '.join(map(str, copper))}{' alone' if len(copper) < tail_layers else ''}"
    plate = "" if stiffener is None else f" and a stiffener of {show(stiffener.thickness, 'm')}"
    verb = "lies" if len(copper) < 2 else "lie"
    return f"{there} {verb} there; with the films of the stack-up{plate} this gives {total}"


def laminate_text(stackup: Stackup) -> str:
    """Describe the films between copper layers, with or without adhesive, as far as known."""
    names = dict.fromkeys(layer.material for layer in stackup.layers if layer.kind is not LayerKind.COPPER)
    texts = [f"{name}: {_LAMINATES[name]}" for name in names if name in _LAMINATES]
    return "; ".join(texts) or "as the stack-up's materials say"


def layer_text(layer: StackLayer) -> str:
    """Describe a layer's material, and the sheets that it is laminated from if the stack-up states them."""
    return f"{layer.material} ({layer.made_of})" if layer.made_of else layer.material


def bond_texts(stackup: Stackup) -> dict[str, str]:
    """Describe the films that bond cores to each other or to copper, keyed by the copper layers on both sides.

    Each text states the distance from copper to copper and the sheets, as far as the stack-up states them.
    """
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
    """Describe the outline's tolerance, with its source if the fabricator's own profile does not state it."""
    holder = rules.holders.get("outline_tolerance", rules.name)
    is_anothers = holder != rules.name and holder in names("rules")  # a user's figure has file and line as holder
    other = f" (not stated by {rules.name}: the figure of {holder}, to be confirmed)" if is_anothers else ""
    return f"+/- {show(rules.outline_tolerance, 'm')}{other}"


def questions(fpc: FpcSpec) -> Iterator[tuple[str, str]]:
    """Yield (subject, text) of questions to a fabricator with a single process. Empty for other fabricators.

    An order cannot choose foil, plating, class, test and marks there, so users ask about them before the order.
    """
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
    """Describe the number of boards, and the panels or multiples in which they are ordered.

    Empty if `boards` is None. `panel_parts` is the number of boards on a panel; None for single boards. Single boards
    are sold in multiples of `multiple`.
    """
    if boards is None:
        return ""
    board_count = count_text(boards, "board")
    if panel_parts is None:
        sold = math.ceil(boards / multiple) * multiple
        multiples = f": order {sold}, they are sold in multiples of {multiple}"
        return board_count if sold == boards else f"{board_count}{multiples}"
    panels = math.ceil(boards / panel_parts)
    spare = panels * panel_parts - boards
    more = f", {spare} more than wanted" if spare else ""
    return f"{board_count}: {count_text(panels, 'panel')} of {panel_parts} ({panels * panel_parts} boards{more})"


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
    """Describe the finished thickness at each place: nominal, and the range of delivered boards in brackets."""
    places = {Where.COIL: "at the coils"}
    if layout.spec.fpc.tail is not None:
        places |= {Where.TAIL: "tail", Where.CONTACT: "at the contacts"}
    return {word: thickness_text(layout, where) for where, word in places.items()}


def thickness_text(layout: Layout, where: Where) -> str:
    """Describe the finished thickness at a place.

    For contacts that are plugged in, the text also states the thickness that the connector accepts. It contains a
    warning if the fabricator's tolerance is wider than the connector's.
    """
    finished, tail = finished_thickness(layout, where), layout.spec.fpc.tail
    if where is not Where.CONTACT or tail is None or tail.connector.insertion_thickness <= 0.0:
        return _band(finished)
    nominal, allowed = tail.connector.insertion_thickness, tail.connector.insertion_thickness_tolerance
    low, high = nominal - allowed, nominal + allowed
    text = f"{_band(FinishedThickness(low, nominal, high, ''))}, as {tail.connector.name} takes it"
    if finished.minimum >= low - ROUNDING and finished.maximum <= high + ROUNDING:
        return text
    delivered = f"+/- {show(finished.maximum - finished.nominal, 'm')} about {show(finished.nominal, 'm')}"
    return f"{text}: closer than {layout.spec.fpc.rules.name} keeps ({delivered}), to be confirmed or measured"


ROUNDING = 1e-9
"""Largest difference (m) between two thicknesses that count as equal; it comes from rounding."""


def _band(thickness: FinishedThickness) -> str:
    return f"{show(thickness.nominal, 'm')} ({show(thickness.minimum, 'm')} to {show(thickness.maximum, 'm')})"


TEXT_WIDTH = 100


def hanging(start: str, text: str, width: int) -> list[str]:
    """Wrap a text to lines of at most `width` characters, with a hanging indent.

    `start` begins the first line and sets the indent of the others. Lines are not broken at hyphens, so that names of
    files and pieces stay whole.
    """
    return wrap(text, width, initial_indent=start, subsequent_indent=" " * len(start), break_on_hyphens=False)


def headed(title: str, lines: Iterable[str]) -> list[str]:
    """Return the lines under a heading, followed by an empty line."""
    return [title, "-" * len(title), *lines, ""]


def section(title: str, rows: Iterable[tuple[str, str]]) -> list[str]:
    """Return a heading and rows of a name and a text; each text is wrapped beside its name."""
    lines: list[str] = []
    pairs = list(rows)
    indent = max(len(name) for name, _ in pairs) + 2
    for name, text in pairs:
        first, *rest = wrap(text, TEXT_WIDTH - indent, break_long_words=False, break_on_hyphens=False) or [""]
        lines += [f"{name:<{indent}}{first}".rstrip(), *(" " * indent + more for more in rest)]
    return headed(title, lines)
