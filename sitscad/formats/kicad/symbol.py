"""Schematic symbols for the project's footprints, in a library of their own: the sensor by its contacts, and each coil.

The numbers of the pins are those of the footprints' pads, their names those of the contacts (``C1.A``). A contact that
no coil has is a pin that must stay unconnected. Millimetres, y up, pins on KiCad's grid of 1.27 mm.
"""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.formats.kicad.footprint import FOOTPRINT_NAME
from sitscad.formats.kicad.sexpr import node, quoted
from sitscad.layout.board import Coil, Layout, Pad
from sitscad.units import decimal, show

FORMAT = 20241209
"""Of KiCad 9's symbol libraries; later versions read it."""

GRID = 2.54
LEFT, RIGHT = -10.16, 7.62
"""The sides of the sensor's box (mm); its pins end on the left one."""
AXIS = 2.54
"""Where the coils stand in the box (mm)."""
BOW = 1.27
"""Diameter of one of the four bows that a coil is drawn with (mm)."""

_HIDDEN = "(effects (font (size 1.27 1.27)) (hide yes))"
_KEYWORDS = "LDC inductive sensor coil"


def symbol_library(layout: Layout) -> str:
    """The ``.kicad_sym`` file: the sensor where it has contacts, and every coil that leads from contact to contact."""
    symbols = [_sensor(layout)] if layout.pads else []
    symbols += [_coil(layout, coil) for coil in layout.coils if coil.is_closed_circuit]
    head = f"(version {FORMAT})", '(generator "sitscad")', '(generator_version "9.0")'
    return node("kicad_symbol_lib", *head, *symbols) + "\n"


def library_table(name: str) -> str:
    """The project's table of symbol libraries, which names this one."""
    uri = quoted(f"${{KIPRJMOD}}/{name}.kicad_sym")
    row = f'(lib (name {quoted(name)})(type "KiCad")(uri {uri})(options "")(descr "The sensor {name} and its coils"))'
    return f"(sym_lib_table\n  (version 7)\n  {row}\n)\n"


def _sensor(layout: Layout) -> str:
    """The whole sensor: a box with a pin a contact, coil by coil, and the coils between their pins."""
    name, rows = layout.spec.name, _rows(layout)
    top, low = rows[0][1] + GRID, rows[-1][1] - GRID
    box = f"(rectangle (start {decimal(LEFT)} {decimal(top)}) (end {decimal(RIGHT)} {decimal(low)})"
    drawn = [f"{box} {_pen(0.254)} (fill (type background)))"]
    for coil in layout.coils:
        ends = [y for pad, y in rows if pad.net == coil.net]
        if len(ends) == 2:
            drawn += _winding(AXIS, ends[0], ends[1], LEFT + 6.35)
    pins = [
        _pin("no_connect" if not pad.net else "passive", LEFT - GRID, y, 0, pad.pin or "unused", pad.number)
        for pad, y in rows
    ]
    issue = f", {layout.spec.issue.words}" if layout.spec.issue.rows else ""
    many = "s" * (len(layout.coils) > 1)
    words = f"inductive sensor of {len(layout.coils)} coil{many}: both pins of a coil are one net{issue}"
    return _symbol(layout, name, "J", FOOTPRINT_NAME, words, (LEFT, top + GRID / 2, low - GRID / 2), drawn, pins)


def _rows(layout: Layout) -> list[tuple[Pad, float]]:
    """The contacts from the top down, coil by coil, each with its height (mm); those that no coil has are last."""
    groups = [[pad for pad in layout.pads if pad.net == coil.net] for coil in layout.coils]
    groups += [[pad] for pad in layout.pads if not pad.net]
    rows, y = [], 0.0
    for group in groups:
        for pad in sorted(group, key=lambda pad: pad.number):
            rows.append((pad, y))
            y -= 2 * GRID if pad.net else GRID
        y += GRID if group and group[0].net else 0.0
    return rows


def _coil(layout: Layout, coil: Coil) -> str:
    """One coil alone: pin 1 the beginning of its first layer, pin 2 the end of its last, as in its footprint."""
    name, spec, reach = f"coil-{coil.name}", layout.spec.coil, 2 * GRID
    pins = [
        _pin("passive", 0.0, sign * (reach + GRID), 270 if sign > 0 else 90, str(number), number)
        for number, sign in ((1, 1.0), (2, -1.0))
    ]
    words = (
        f"printed coil, {spec.shape}, {spec.turns_in_words} turns, {len(spec.layers)} "
        f"layer{'s' * (len(spec.layers) > 1)}, {show(spec.outer_diameter, 'm')}; for stack-up "
        f"{layout.spec.fpc.stackup.name}"
    )
    drawn = _winding(0.0, reach, -reach, 0.0)
    return _symbol(layout, name, "L", name, words, (BOW, GRID, -GRID), drawn, pins)


def _winding(x: float, upper: float, lower: float, start: float) -> list[str]:
    """A coil of four bows between two heights at `x`, with the lines that lead there from `start` (mm)."""
    middle = (upper + lower) / 2
    rows = []
    for end, sign in ((upper, 1.0), (lower, -1.0)):
        corners = [(start, end), (x, end), (x, middle + sign * 2 * BOW)] if start != x else [(x, end)]
        corners += [(x, middle + sign * 2 * BOW)] if start == x else []
        points = " ".join(f"(xy {decimal(a)} {decimal(b)})" for a, b in dict.fromkeys(corners))
        if len(dict.fromkeys(corners)) > 1:
            rows.append(f"(polyline (pts {points}) {_pen(0.0)} (fill (type none)))")
    for i in range(4):
        high = middle + (2 - i) * BOW
        across = decimal(x)
        ends = (
            f"(start {across} {decimal(high - BOW)}) (mid {decimal(x + BOW / 2)} {decimal(high - BOW / 2)}) "
            f"(end {across} {decimal(high)})"
        )
        rows.append(f"(arc {ends} {_pen(0.0)} (fill (type none)))")
    return rows


def _pin(kind: str, x: float, y: float, angle: int, name: str, number: int) -> str:
    """A pin as a node."""
    font = "(effects (font (size 1.27 1.27)))"
    return node(
        f"pin {kind} line",
        f"(at {decimal(x)} {decimal(y)} {angle})",
        f"(length {decimal(GRID)})",
        f"(name {quoted(name)} {font})",
        f'(number "{number}" {font})',
    )


def _symbol(
    layout: Layout,
    name: str,
    reference: str,
    footprint: str,
    words: str,
    places: tuple[float, float, float],
    drawn: list[str],
    pins: list[str],
) -> str:
    """A symbol with its properties: reference and value stand at an x and two heights of `places`."""
    library, (x, above, below) = layout.spec.name, places
    shown = ((("Reference", reference), above), (("Value", name), below))
    left = "(effects (font (size 1.27 1.27)) (justify left))"
    hidden = {"Footprint": f"{library}:{footprint}", "Datasheet": "", "Description": words, "ki_keywords": _KEYWORDS}
    return node(
        f"symbol {quoted(name)}",
        *_pin_names(reference == "L"),
        "(exclude_from_sim no)",
        "(in_bom no)",
        "(on_board yes)",
        *(
            node(f"property {quoted(key)} {quoted(text)}", f"(at {decimal(x)} {decimal(y)} 0)", left)
            for (key, text), y in shown
        ),
        *(node(f"property {quoted(key)} {quoted(text)}", "(at 0 0 0)", _HIDDEN) for key, text in hidden.items()),
        node(f"symbol {quoted(f'{name}_0_1')}", *drawn),
        node(f"symbol {quoted(f'{name}_1_1')}", *pins),
        "(embedded_fonts no)",
    )


def _pin_names(is_coil: bool) -> Iterator[str]:
    """Names inside the box; a coil's pins show neither name nor number, as those of any inductor."""
    if is_coil:
        yield "(pin_numbers (hide yes))"
    yield f"(pin_names (offset 0.508){' (hide yes)' if is_coil else ''})"


def _pen(width: float) -> str:
    return f"(stroke (width {decimal(width)}) (type default))"
