"""Circuit between the tail's connector and a controller, as a KiCad 9 schematic with symbols and as a picture.

It has converters, clock, capacitors and pull-ups (``firmware/wiring/``). Nets are labels at the pins; there are no
wires.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator

from sitscad.basics.record import record
from sitscad.basics.units import fixed_decimals, show
from sitscad.estimates.coil_estimates import Estimates
from sitscad.files.drawing.sheet import Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.files.formats.kicad.library import library_table
from sitscad.files.formats.kicad.sexpr import identity, node, quoted, uuid_of
from sitscad.files.order_facts.board_end import footprint_row, socket_pad
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.geometry.path import rectangle
from sitscad.layout.board import Coil, Layout
from sitscad.layout.tail.tracks import CONTROLLER, THERMISTOR_LINES, contacts

STEP = 2.54
MARGIN = 6  # Steps from the paper's edge

LIBRARY = "wiring"
BUS = ("SCL", "SDA")
"""Lines of the first I2C bus. The names of the second bus end in 2."""

FONT = "(effects (font (size 1.27 1.27)))"
LEFT_FONT = "(effects (font (size 1.27 1.27)) (justify left))"
HIDDEN = "(effects (font (size 1.27 1.27)) (hide yes))"


@record
class Pin:
    """Pin with number, name, KiCad's electrical type, and net. The net is empty if the pin is unconnected."""

    number: int
    name: str
    kind: str
    net: str


@record
class SchematicPart:
    """Part of the circuit.

    `symbol` is the name of the symbol, which several parts may share. `left` and `right` are its pins from the top
    down, and `place` is its place on the sheet (steps of 2.54 mm).
    """

    reference: str
    value: str
    symbol: str
    left: tuple[Pin, ...]
    right: tuple[Pin, ...]
    place: tuple[int, int]

    @property
    def half(self) -> int:
        """Half of the width of the box, in steps of 2.54 mm."""
        return 2 if self.symbol in ("R", "C") else 4

    @property
    def height(self) -> int:
        """Number of rows of pins."""
        return max(len(self.left), len(self.right))

    @property
    def footprint(self) -> str:
        """Name of the footprint in KiCad's own libraries. Empty if the table ``footprints`` has none for the part."""
        number = len(self.left) + len(self.right)
        row = footprint_row(self.symbol, number)
        return "" if row is None else row["footprint"].format(number=number, pins=f"{number:02}")

    def at(self) -> Iterator[tuple[Pin, int, int]]:
        """Yield (pin, side, row) for each pin.

        The side is -1 (left) or 1 (right). The row counts steps of 2.54 mm from the top of the box downwards.
        """
        for side, pins in ((-1, self.left), (1, self.right)):
            for row, pin in enumerate(pins):
                yield pin, side, row


def render(layout: Layout, estimates: Estimates) -> dict[str, bytes]:
    """Return schematic, symbols, project and picture by their paths in the package.

    Empty if the sensor needs more converters than its buses can address, if it has no contacts, or if the converter has
    other pins than the circuit.
    """
    readout, count = layout.spec.readout, len(estimates.all_coils)
    if count > readout.device.most_coils * readout.buses or not layout.pads or not readout.device.has_circuit:
        return {}
    circuit = parts(layout, estimates.readout.capacitance)
    # The circuit does not depend on KiCad's footprint libraries; the board editor reports missing ones
    project = {
        "meta": {"filename": f"{LIBRARY}.kicad_pro", "version": 3}, "sheets": [], "text_variables": {},
        "erc": {"rule_severities": {"footprint_link_issues": "ignore"}},
    }
    texts = {
        f"{LIBRARY}.kicad_sch": _schematic(layout.spec.name, circuit),
        f"{LIBRARY}.kicad_sym": node(
            "kicad_symbol_lib", "(version 20241209)", '(generator "sitscad")', '(generator_version "9.0")',
            *_symbols(circuit),
        ) + "\n",
        f"{LIBRARY}.kicad_pro": json.dumps(project, indent=2) + "\n",
        "sym-lib-table": library_table(
            "sym", LIBRARY, f"{LIBRARY}.kicad_sym", f"The sensor {LIBRARY} and its coils"
        ),
        f"{LIBRARY}.svg": svg(_picture(layout.spec.name, circuit)),
    }
    return {f"firmware/wiring/{name}": text.encode("utf-8") for name, text in texts.items()}


def parts(layout: Layout, capacitance: float) -> tuple[SchematicPart, ...]:
    """Return all parts of the circuit with their nets."""
    spec, coils = layout.spec, layout.coils
    device = spec.readout.device
    number = device.converter_count(len(coils))
    circuit = [_converter(layout.coils, layout.spec.readout.device, k) for k in range(number)]
    row = 4 + 24 * number
    capacitors = [("100nF", "VDD", "GND"), ("1uF", "VDD", "GND")] * number + [("100nF", "VDD", "GND")]
    if spec.readout.chip is None and spec.readout.capacitor_at != "coil":
        value = show(capacitance, "F").replace(" ", "")
        capacitors += [(f"{value} C0G", f"{coil.name}.A", f"{coil.name}.B") for coil in coils]
    serial = [line + ending for ending in ("", "2")[: 1 + device.coil_channels(len(coils))[-1].bus] for line in BUS]
    resistors = [*(("4.7k", line, "VDD") for line in serial), ("10k", "SD", "VDD")]
    analogue = []
    if layout.thermistor is not None and (sensor := spec.soldered_thermistor) is not None:
        analogue = [THERMISTOR_LINES[0]]
        resistors.append((f"{1e-3 * (sensor.part.resistance or 0.0):g}k 0.1%", analogue[0], "VDD"))
    for symbol, two_ended, column in (("C", capacitors, 40), ("R", resistors, 62)):
        for k, (value, connection, other) in enumerate(two_ended):
            ends = (Pin(1, "~", "passive", connection),), (Pin(2, "~", "passive", other),)
            # Numbers from 101, because coils are also called C1
            circuit.append(SchematicPart(f"{symbol}{k + 101}", value, symbol, *ends, (column, 6 + 4 * k)))
    row_below = 10 + 4 * len(resistors)
    clock = f"{spec.readout.clock / 1e6:g}MHz"
    circuit.append(
        SchematicPart("Y1", clock, "oscillator", (Pin(1, "OE", "input", "VDD"), Pin(2, "GND", "power_in", "GND")),
                      (Pin(4, "VDD", "power_in", "VDD"), Pin(3, "OUT", "output", "CLK")), (62, row_below)),
    )
    interrupts = [f"INTB{k + 1}" for k in range(number)]
    host = [("VDD", "power_out"), ("GND", "power_out")]
    host += [(net, "passive") for net in (*serial, "SD", *interrupts, *analogue)]
    pins = tuple(Pin(k, net, kind, net) for k, (net, kind) in enumerate(host, 1))
    circuit.append(SchematicPart("J2", "controller", "controller", pins, (), (62, row_below + 8)))
    tail = tuple(
        Pin(socket_pad(layout.pads, layout.spec.fpc.tail, connection.number), connection.pin, "passive",
            "" if connection.net == "-" else connection.converter_pin if connection.converter == CONTROLLER
            else connection.pin)
        for connection in contacts(layout)
    )
    symbol = spec.fpc.tail.connector.name if spec.fpc.tail is not None else "tail"
    circuit.append(SchematicPart("J1", spec.name, symbol, (), tail, (14, row)))
    return tuple(circuit)


def _converter(coils: tuple[Coil, ...], device: Converter, number: int) -> SchematicPart:
    """Return a converter: the pins of its family, then the pins of its channels, and the die pad."""
    inputs = [(at, coil.name) for at, coil in zip(device.coil_channels(len(coils)), coils, strict=True)
           if at.converter == number]
    names, place = {at.number: name for at, name in inputs}, inputs[0][0]
    bus = {line: line + "2" for line in BUS if place.bus}
    tied = device.address_net(place.address)
    nets = {"CLKIN": "CLK", "ADDR": bus.get(tied, tied), "INTB": f"INTB{number + 1}", **bus}
    left_pins = tuple(Pin(k, name, kind, nets.get(name, name)) for k, (name, kind) in enumerate(device.pins, 1))
    right = []
    for channel in range(device.channels):
        coil = names.get(channel)
        right += [(pin, f"{coil}.{end}" if coil else "")
                  for end, pin in zip("AB", device.coil_pins(channel), strict=True)]
    right.append(("DAP", "GND"))
    pins = tuple(Pin(len(left_pins) + k, name, "passive", net) for k, (name, net) in enumerate(right, 1))
    return SchematicPart(f"U{number + 1}", device.part, device.part, left_pins, pins, (14, 4 + 24 * number))


# -------------------------------------------------------------------------------------------------------- the files


def _mm(steps: float) -> str:
    return fixed_decimals(STEP * steps)


def _symbols(circuit: Iterable[SchematicPart], prefix: str = "") -> Iterator[str]:
    """Yield every symbol once: a box with its pins, with y upwards."""
    for part in {part.symbol: part for part in circuit}.values():
        box = f"(rectangle (start {_mm(-part.half)} {_mm(1)}) (end {_mm(part.half)} {_mm(-part.height)})"
        pins = [
            node(
                f"pin {pin.kind} line", f"(at {_mm(side * (part.half + 1))} {_mm(-row)} {0 if side < 0 else 180})",
                f"(length {_mm(1)})", f"(name {quoted(pin.name)} {FONT})", f'(number "{pin.number}" {FONT})',
            )
            for pin, side, row in part.at()
        ]
        letter = "".join(c for c in part.reference if c.isalpha())
        yield node(
            f"symbol {quoted(prefix + part.symbol)}", "(pin_names (offset 0.508))", "(exclude_from_sim no)",
            "(in_bom yes)", "(on_board yes)",
            *(node(f"property {quoted(key)} {quoted(text)}", "(at 0 0 0)", HIDDEN if key != "Reference" else FONT)
              for key, text in (("Reference", letter), ("Value", part.symbol), ("Footprint", part.footprint),
                                ("Datasheet", ""), ("Description", ""))),
            node(f"symbol {quoted(f'{part.symbol}_0_1')}",
                 f"{box} (stroke (width 0.254) (type default)) (fill (type background)))"),
            node(f"symbol {quoted(f'{part.symbol}_1_1')}", *pins),
            "(embedded_fonts no)",
        )


def _schematic(name: str, circuit: tuple[SchematicPart, ...]) -> str:
    root = uuid_of(name, "wiring")
    return node(
        "kicad_sch", "(version 20250114)", '(generator "sitscad")', '(generator_version "9.0")', f'(uuid "{root}")',
        f'(paper "{"A4" if _height(circuit) < 72 else "A3"}")',
        f"(title_block (title {quoted(f'Readout of the sensor {name}')}))",
        node("lib_symbols", *_symbols(circuit, f"{LIBRARY}:")),
        *(text for part in circuit for text in _connected(name, part)),
        *(_instance(name, root, part) for part in circuit),
        '(sheet_instances (path "/" (page "1")))', "(embedded_fonts no)",
    ) + "\n"


def _connected(name: str, part: SchematicPart) -> Iterator[str]:
    """Yield a label at the end of every pin, or a no-connect mark if the pin has no net."""
    x, y = part.place[0] + MARGIN, part.place[1] + MARGIN
    for pin, side, row in part.at():
        at = f"{_mm(x + side * (part.half + 1))} {_mm(y + row)}"
        names = identity(name, "wiring", part.reference, pin.number)
        if not pin.net:
            yield node("no_connect", f"(at {at})", names)
        else:
            where, justify = (180, "right") if side < 0 else (0, "left")
            font = f"(effects (font (size 1.27 1.27)) (justify {justify} bottom))"
            yield node(f"label {quoted(pin.net)}", f"(at {at} {where})", font, names)


def _instance(name: str, root: str, part: SchematicPart) -> str:
    x, y = part.place[0] + MARGIN, part.place[1] + MARGIN
    shown = (("Reference", part.reference, y - 1.5), ("Value", part.value, y + part.height + 0.5))
    return node(
        "symbol", f"(lib_id {quoted(f'{LIBRARY}:{part.symbol}')})", f"(at {_mm(x)} {_mm(y)} 0)", "(unit 1)",
        "(exclude_from_sim no)", "(in_bom yes)", "(on_board yes)", "(dnp no)",
        identity(name, "wiring", part.reference),
        *(node(f"property {quoted(key)} {quoted(text)}", f"(at {_mm(x - part.half)} {_mm(height)} 0)", LEFT_FONT)
          for key, text, height in shown),
        *(node(f"property {quoted(key)} {quoted(text)}", f"(at {_mm(x)} {_mm(y)} 0)", HIDDEN)
          for key, text in (("Footprint", part.footprint), ("Datasheet", ""), ("Description", ""))),
        *(node(f'pin "{pin.number}"', identity(name, "wiring", part.reference, pin.number, "pin"))
          for pin, _, _ in part.at()),
        node("instances", node(f"project {quoted(LIBRARY)}",
             node(f"path {quoted(f'/{root}')}", f"(reference {quoted(part.reference)})", "(unit 1)"))),
    )


def _height(circuit: tuple[SchematicPart, ...]) -> int:
    return max(part.place[1] + part.height for part in circuit)


def _picture(name: str, circuit: tuple[SchematicPart, ...]) -> Sheet:
    """Return the schematic as a drawing, with its labels as text."""
    wide, high, step = 200.0, 7.0 + STEP * _height(circuit), STEP
    sheet = Sheet(f"Readout of the sensor {name}: nets by name", (wide, high))
    pen = Pen(0.2)
    for part in circuit:
        x, y = part.place[0] * step, high - part.place[1] * step
        half, below = part.half * step, y - part.height * step
        sheet.draw(rectangle(x - half, below, x + half, y + step), pen, "#fffbe8")
        sheet.text(x - half, y + step + 0.8, f"{part.reference}  {part.value}", 2.4, bold=True)
        for pin, side, row in part.at():
            at, end = y - row * step, x + side * (half + step)
            sheet.line(x + side * half, at, end, at, pen)
            anchor, inner = ("end", "start") if side < 0 else ("start", "end")
            if pin.name != "~":
                sheet.text(x + side * (half - 0.8), at - 0.7, pin.name, 1.8, inner)
            sheet.text(x + side * (half + 0.4), at + 0.3, str(pin.number), 1.3, anchor, colour="#777777")
            sheet.text(end + side * 0.8, at - 0.7, pin.net or "not connected", 1.9, anchor, colour="#225588")
    return sheet
