"""Libraries of the project: footprints of contacts (or solder pads) and tank capacitors, symbols of sensor and coils.

The footprint of the contacts has no 3-D model: contacts are printed copper, and their connector is not on this board.
Capacitors are bought and placed, and appear in KiCad's lists of parts and positions. Their 3-D models are in
KiCad's own library, found by the variable for its folder. If this library is not installed, KiCad shows the board
alone.

The numbers of a symbol's pins are the numbers of the footprint's pads. The names of the pins are the names of the
contacts (``C1.A``). A contact without a coil is a pin that must stay unconnected. Symbols are in millimetres, with y
upwards and pins on KiCad's grid of 1.27 mm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from sitscad.basics.units import count_text, fixed_decimals, show
from sitscad.files.formats.kicad.sexpr import (
    Grid,
    copper_names,
    grid,
    identity,
    length,
    node,
    polygon_points,
    quoted,
    xy,
)
from sitscad.kernels.geometry.path import Path, Region, bounding_box
from sitscad.layout.board import Capacitor, Coil, Layout, Pad, SolderedThermistor
from sitscad.spec.coil import CoilSpec
from sitscad.spec.yaml.source import Issue

REFERENCE = "J1"
FOOTPRINT_NAME = "contacts"

_FONT = "(effects (font (size 1 1) (thickness 0.15)))"
_COURTYARD_MARGIN = 250_000
FOOTPRINT_HEAD = "(version 20241229)", '(generator "sitscad")', '(layer "F.Cu")'  # of a footprint in its own file

# Tails have one coverlay window over all contacts of an edge connector (at 0.5 mm pitch no web fits between contacts).
# KiCad reports a window over two nets as an error unless the footprint has an attribute that allows it.
# Contacts are printed copper and are neither bought nor placed. In a schematic they belong to the sensor's symbol.
_ATTRIBUTES = "(attr smd exclude_from_pos_files exclude_from_bom allow_soldermask_bridges)"


def anchor(pads: tuple[Pad, ...]) -> Grid:
    """Return the place of the footprint on the grid (nm, y downwards): the centre of its pads."""
    low, high = extent(pads)
    return (low[0] + high[0]) // 2, (low[1] + high[1]) // 2


def contact_openings(openings: Sequence[Region], pads: Sequence[Pad]) -> tuple[Region, ...]:
    """Return the coverlay openings over any of the pads. These openings belong to the footprint."""

    def overlaps(outline: Path, pad: Pad) -> bool:
        x0, y0, x1, y1 = bounding_box([outline])
        (x, y), (width, height) = pad.centre, pad.size
        return x0 < x + width / 2 and x1 > x - width / 2 and y0 < y + height / 2 and y1 > y - height / 2

    return tuple(o for o in openings if any(overlaps(o.outline, pad) for pad in pads))


def board_footprint(layout: Layout, nets: Mapping[str, int], sheet: Grid) -> str:
    """Return the footprint of the contacts on the board, with nets at the pads.

    `sheet` is the sheet's upper left corner from the layout's origin (nm, y downwards).
    """
    place = anchor(layout.pads)
    return node(
        f"footprint {quoted(f'{layout.spec.name}:{FOOTPRINT_NAME}')}", '(layer "F.Cu")',
        identity(layout.spec.name, "footprint"), xy("at", place, sheet), *_body(layout, REFERENCE, nets),
    )


def _body(layout: Layout, reference: str, nets: Mapping[str, int] | None) -> list[str]:
    """Return the content of the contacts' footprint: texts, openings, pads."""
    place, owner = anchor(layout.pads), (layout.spec.name, "board" if nets is not None else "library")
    tail = layout.spec.fpc.tail
    value = tail.connector.name if tail else "solder pads"
    # Openings of both masks over the contacts
    rows = []
    for layer, openings, number in (
        ("F.Mask", layout.top_openings, 1), ("B.Mask", layout.bottom_openings, layout.copper_layers),
    ):
        pads = [pad for pad in layout.pads if pad.layer == number]
        for i, region in enumerate(contact_openings(openings, pads)):
            rows.append(filled("fp", region, layer, place, (*owner, layer, i)))
    description = f"{len(layout.pads)} contacts of {layout.spec.name}, {value}"
    texts = [pad_text(pad, layout.copper_layers, place, nets, owner) for pad in layout.pads]
    above = _COURTYARD_MARGIN + 1_000_000
    return _around(layout.pads, place, owner, (reference, value, description), [_ATTRIBUTES, *rows], texts, above)


def _around(
    pads: Sequence[Pad], place: Grid, owner: tuple[str, ...], descriptions: tuple[str, str, str], before: Sequence[str],
    texts: Sequence[str], above: int = 1_000_000, margin: int = _COURTYARD_MARGIN,
) -> list[str]:
    """Return the content of a footprint.

    `descriptions` are reference, value and description. Reference and value stand `above` (nm) beyond the pads.
    `before` are attributes and openings, placed before the courtyard. `texts` are the pads as text.
    """
    low, high = extent(pads)
    low, high = (low[0] - place[0], low[1] - place[1]), (high[0] - place[0], high[1] - place[1])
    return [
        property_text("Reference", descriptions[0], (0, low[1] - above), owner),
        property_text("Value", descriptions[1], (0, high[1] + above), owner), f"(descr {quoted(descriptions[2])})",
        *before, courtyard(low, high, owner, margin), *texts, "(embedded_fonts no)",
    ]


def property_text(name: str, text: str, at: Grid, owner: tuple[str, ...]) -> str:
    """Return a property of a footprint, shown on the fabrication layer."""
    place = f"{xy('at', at)[:-1]} 0)"
    return node(f"property {quoted(name)} {quoted(text)}", place, '(layer "F.Fab")', identity(*owner, name), _FONT)


def filled(prefix: str, region: Region, layer: str, place: Grid, names: tuple[object, ...]) -> str:
    """Return a filled polygon without an outline pen (``gr_poly``, ``fp_poly``) on a layer.

    Raises ValueError for a region with holes, which KiCad's polygons cannot have.
    """
    if region.holes:
        raise ValueError(f"an opening with {len(region.holes)} holes cannot be drawn as a KiCad polygon")
    points = polygon_points(region.outline, place)
    pen = "(stroke (width 0) (type solid)) (fill yes)"
    return f"({prefix}_poly {points} {pen} (layer {quoted(layer)}) {identity(*names)})"


def courtyard(low: Grid, high: Grid, owner: tuple[str, ...], margin: int = _COURTYARD_MARGIN) -> str:
    """Return the courtyard's rectangle, a margin (nm) around the rectangle between two corners."""
    start = xy("start", (low[0] - margin, low[1] - margin))
    end = xy("end", (high[0] + margin, high[1] + margin))
    pen = "(stroke (width 0.05) (type solid)) (fill no)"
    return f'(fp_rect {start} {end} {pen} (layer "F.CrtYd") {identity(*owner, "courtyard")})'


def pad_text(
    pad: Pad, copper_layers: int, place: Grid, nets: Mapping[str, int] | None, owner: tuple[str, ...],
    kind: str = "connect"
) -> str:
    """Return a rectangular pad of a footprint at `place`. Its net is stated if `nets` has its number."""
    layer = copper_names(copper_layers)[pad.layer - 1]
    if layer not in ("F.Cu", "B.Cu"):
        raise ValueError(f"contact {pad.name} is on {layer}: a contact must be on an outer layer")
    size = f"(size {length(pad.size[0])} {length(pad.size[1])})"
    net = f" (net {nets[pad.net]} {quoted(pad.net)})" if nets is not None and pad.net else ""
    pin = f' (pinfunction {quoted(pad.pin)}) (pintype "passive")' if nets is not None and pad.pin else ""
    where = xy("at", grid(pad.centre), place)
    head = f'pad "{pad.number}" {kind} rect {where} {size} (layers {quoted(layer)})'
    return f"({head}{net}{pin} {identity(*owner, 'pad', pad.number)})"


def extent(pads: Sequence[Pad]) -> tuple[Grid, Grid]:
    """Return the lower and the upper corner (nm) of the box around all pads."""
    sides = [(*grid(pad.centre), round(pad.size[0] * 5e8), round(pad.size[1] * 5e8)) for pad in pads]
    low = min(x - half for x, _, half, _ in sides), min(y - half for _, y, _, half in sides)
    return low, (max(x + half for x, _, half, _ in sides), max(y + half for _, y, _, half in sides))


_CHIP_COURTYARD = 150_000  # Margin (nm) as in KiCad's own footprints of chips

MODELS = "${KICAD9_3DMODEL_DIR}"  # KiCad 9's own variable for the folder of its 3-D models


def library_footprints(layout: Layout) -> dict[str, str]:
    """Return the ``.kicad_mod`` files of the project's library by name: contacts, capacitors and thermistor."""
    bodies = {FOOTPRINT_NAME: _body(layout, "REF**", None)} if layout.pads else {}
    bodies |= {_chip_name(each): _chip_body(layout, each, None) for each in layout.chips}
    return {name: node(f"footprint {quoted(name)}", *FOOTPRINT_HEAD, *body) + "\n" for name, body in bodies.items()}


def placed_chips(layout: Layout, nets: Mapping[str, int], sheet: Grid) -> Iterator[str]:
    """Yield the footprints of capacitors and thermistor on the board.

    `sheet` is the sheet's upper left corner from the layout's origin (nm, y downwards).
    """
    name = layout.spec.name
    for each in layout.chips:
        yield node(
            f"footprint {quoted(f'{name}:{_chip_name(each)}')}", '(layer "F.Cu")',
            identity(name, each.reference), xy("at", grid(each.centre), sheet), *_chip_body(layout, each, nets),
        )


def _chip_name(part: Capacitor | SolderedThermistor) -> str:
    """Return the name of a chip's footprint."""
    return f"{'capacitor' if isinstance(part, Capacitor) else 'thermistor'}-{part.package}"


def _chip_body(
    layout: Layout, part: Capacitor | SolderedThermistor, nets: Mapping[str, int] | None
) -> list[str]:
    """Return the content of a chip's footprint: texts, openings, pads, model."""
    place, name, is_capacitor = grid(part.centre), layout.spec.name, isinstance(part, Capacitor)
    owner = (name, part.reference if nets is not None else f"library {_chip_name(part).partition('-')[0]}")
    boxes = [(region, bounding_box([region.outline])) for region in layout.top_openings]
    over = [
        region for region, (x0, y0, x1, y1) in boxes
        if any(x0 < pad.centre.x < x1 and y0 < pad.centre.y < y1 for pad in part.pads)
    ]
    openings = [filled("fp", region, "F.Mask", place, (*owner, "opening", i)) for i, region in enumerate(over)]
    reference, sensor = part.reference if nets is not None else "REF**", layout.spec.soldered_thermistor
    product = "" if sensor is None else f"thermistor {sensor.part.product}, {part.package}"
    texts = reference, part.package, f"tank capacitor, {part.package}, C0G" if is_capacitor else product
    pads = [pad_text(pad, layout.copper_layers, place, nets, owner, "smd") for pad in part.pads]
    body = _around(part.pads, place, owner, texts, ["(attr smd)", *openings], pads, margin=_CHIP_COURTYARD)
    chip = layout.spec.readout.chip if is_capacitor else None if sensor is None else sensor.part.chip
    if chip is None or not chip.model:
        return body
    # KiCad's own solid of the chip lies along x; it is rotated to the line of the pads
    first, other = (pad.centre for pad in part.pads)
    turned = 90 if abs(first.y - other.y) > abs(first.x - other.x) else 0
    moves = "(offset (xyz 0 0 0))", "(scale (xyz 1 1 1))", f"(rotate (xyz 0 0 {turned}))"
    return [*body, node(f"model {quoted(f'{MODELS}/{chip.model}')}", *moves)]


FORMAT = 20241209  # Format of KiCad 9's symbol libraries; later versions read it

GRID = 2.54
LEFT, RIGHT = -10.16, 7.62  # Sides of the sensor's box (mm); its pins end on the left side
AXIS = 2.54  # x of the coils in the box (mm)
BOW = 1.27  # Diameter of each of the four bows of a coil symbol (mm)

_HIDDEN = "(effects (font (size 1.27 1.27)) (hide yes))"
_KEYWORDS = "LDC inductive sensor coil"


def symbol_library(layout: Layout) -> str:
    """Return the ``.kicad_sym`` file: the sensor if it has contacts, and every coil with a closed circuit."""
    symbols = [_sensor(layout.coils, layout.pads, layout.spec.issue, layout.spec.name)] if layout.pads else []
    symbols += [_coil(coil.placement.own or layout.spec.coil, layout.spec.fpc.stackup.name, layout.spec.name,
                      coil) for coil in layout.coils if coil.is_closed_circuit]
    head = f"(version {FORMAT})", '(generator "sitscad")', '(generator_version "9.0")'
    return node("kicad_symbol_lib", *head, *symbols) + "\n"


def library_table(kind: str, name: str, file: str, description: str) -> str:
    """Return a project's library table of symbols (``sym``) or footprints (``fp``) with one library."""
    uri = quoted(f"${{KIPRJMOD}}/{file}")
    row = f'(lib (name {quoted(name)})(type "KiCad")(uri {uri})(options "")(descr "{description}"))'
    return f"({kind}_lib_table\n  (version 7)\n  {row}\n)\n"


def _sensor(coils: tuple[Coil, ...], pads: tuple[Pad, ...], issue: Issue, name: str) -> str:
    """Return the symbol of the whole sensor: a box with a pin per contact, coil by coil, and the coils between pins."""
    rows = _rows(coils, pads)
    top, low = rows[0][1] + GRID, rows[-1][1] - GRID
    start, end = (f"{fixed_decimals(x)} {fixed_decimals(y)}" for x, y in ((LEFT, top), (RIGHT, low)))
    graphics = [f"(rectangle (start {start}) (end {end}) {_pen(0.254)} (fill (type background)))"]
    for coil in coils:
        ends = [y for pad, y in rows if pad.net == coil.net]
        if len(ends) == 2:
            graphics += _winding(AXIS, ends[0], ends[1], LEFT + 6.35)
    pins = [
        _pin("no_connect" if not pad.net else "passive", LEFT - GRID, y, 0, pad.pin or "unused", pad.number)
        for pad, y in rows
    ]
    description = f"inductive sensor of {count_text(len(coils), 'coil')}: both pins of a coil are one net"
    description += f", {issue.words}" if issue.rows else ""
    return _symbol(name, name, "J", FOOTPRINT_NAME, description, (LEFT, top + GRID / 2, low - GRID / 2), graphics, pins)


def _rows(coils: tuple[Coil, ...], pads: tuple[Pad, ...]) -> list[tuple[Pad, float]]:
    """Return (contact, y in mm) for the pins of the symbol, from y = 0 downwards, grouped by coil.

    Contacts of a thermistor follow, and contacts without a net are last.
    """
    groups = [[pad for pad in pads if pad.net == coil.net] for coil in coils]
    groups.append([pad for pad in pads if pad.net and pad.net not in {coil.net for coil in coils}])
    groups += [[pad] for pad in pads if not pad.net]
    rows, y = [], 0.0
    for group in groups:
        for pad in sorted(group, key=lambda pad: pad.number):
            rows.append((pad, y))
            y -= 2 * GRID if pad.net else GRID
        y += GRID if group and group[0].net else 0.0
    return rows


def _coil(spec: CoilSpec, stackup_name: str, spec_name: str, coil: Coil) -> str:
    """Return the symbol of one coil.

    Pin 1 is the beginning of its first layer, pin 2 the end of its last, as in its footprint.
    """
    name, reach = f"coil-{coil.name}", 2 * GRID
    pins = [
        _pin("passive", 0.0, sign * (reach + GRID), 270 if sign > 0 else 90, str(number), number)
        for number, sign in ((1, 1.0), (2, -1.0))
    ]
    sides = " x ".join(show(side, "m") for side in dict.fromkeys(spec.size))
    description = (
        f"printed coil, {spec.shape}, {spec.turns_in_words} turns, "
        f"{count_text(len(spec.layers), 'layer')}, {sides}; for stack-up "
        f"{stackup_name}"
    )
    graphics = _winding(0.0, reach, -reach, 0.0)
    return _symbol(spec_name, name, "L", name, description, (BOW, GRID, -GRID), graphics, pins)


def _winding(x: float, upper: float, lower: float, start: float) -> list[str]:
    """Return a coil symbol of four bows at `x` between two heights, and its lead lines from `start` (mm)."""
    middle = (upper + lower) / 2
    rows = []
    for end, sign in ((upper, 1.0), (lower, -1.0)):
        corners = [(start, end), (x, end), (x, middle + sign * 2 * BOW)] if start != x else [(x, end)]
        corners += [(x, middle + sign * 2 * BOW)] if start == x else []
        points = " ".join(f"(xy {fixed_decimals(a)} {fixed_decimals(b)})" for a, b in dict.fromkeys(corners))
        if len(dict.fromkeys(corners)) > 1:
            rows.append(f"(polyline (pts {points}) {_pen(0.0)} (fill (type none)))")
    for i in range(4):
        high = middle + (2 - i) * BOW
        across = fixed_decimals(x)
        ends = (
            f"(start {across} {fixed_decimals(high - BOW)}) (mid {fixed_decimals(x + BOW / 2)} "
            f"{fixed_decimals(high - BOW / 2)}) "
            f"(end {across} {fixed_decimals(high)})"
        )
        rows.append(f"(arc {ends} {_pen(0.0)} (fill (type none)))")
    return rows


def _pin(kind: str, x: float, y: float, angle: int, name: str, number: int) -> str:
    font = "(effects (font (size 1.27 1.27)))"
    return node(
        f"pin {kind} line", f"(at {fixed_decimals(x)} {fixed_decimals(y)} {angle})", f"(length {fixed_decimals(GRID)})",
        f"(name {quoted(name)} {font})", f'(number "{number}" {font})',
    )


def _symbol(
    library: str, name: str, reference: str, footprint: str, description: str, places: tuple[float, float, float],
    graphics: list[str], pins: list[str],
) -> str:
    """Return a symbol with its properties.

    `places` are the x of reference and value, and their two heights.
    """
    (x, above, below) = places
    shown = ((("Reference", reference), above), (("Value", name), below))
    justification = "(effects (font (size 1.27 1.27)) (justify left))"
    hidden = {"Footprint": f"{library}:{footprint}", "Datasheet": "", "Description": description,
              "ki_keywords": _KEYWORDS}
    return node(
        f"symbol {quoted(name)}",
        # Pin names are inside the box. A coil shows neither names nor numbers, as usual for inductors
        *(["(pin_numbers (hide yes))"] if reference == "L" else []),
        f"(pin_names (offset 0.508){' (hide yes)' if reference == 'L' else ''})",
        "(exclude_from_sim no)",
        "(in_bom no)",
        "(on_board yes)",
        *(
            node(f"property {quoted(key)} {quoted(text)}", f"(at {fixed_decimals(x)} {fixed_decimals(y)} 0)",
                 justification)
            for (key, text), y in shown
        ),
        *(node(f"property {quoted(key)} {quoted(text)}", "(at 0 0 0)", _HIDDEN) for key, text in hidden.items()),
        node(f"symbol {quoted(f'{name}_0_1')}", *graphics),
        node(f"symbol {quoted(f'{name}_1_1')}", *pins),
        "(embedded_fonts no)",
    )


def _pen(width: float) -> str:
    return f"(stroke (width {fixed_decimals(width)}) (type default))"
