"""Bill of materials for one sensor with its converter (``bom.csv``), and the placement of chips on the board.

``placement.csv`` has the positions of capacitors and thermistor in the coordinate system of all files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import astuple, fields, replace

from sitscad.assembly.places.bodies import MOUNT_PIECES, backing_of, plates_of
from sitscad.assembly.places.column import GLUE, column
from sitscad.assembly.places.jaws import jaw_section
from sitscad.assembly.places.seating import (
    FLOOR,
    adapter_depth,
    adapter_holes,
    is_near_metal,
    plate_floor,
    plate_holes,
    screw_spacing,
)
from sitscad.assembly.places.stack import has_round_body, shield, shield_part
from sitscad.assembly.solids.tooling import FOAM, foot_pockets, silicone_to_mix, skin_silicone
from sitscad.assembly.solids.whole import SOFT_LINES
from sitscad.basics.record import record
from sitscad.basics.units import count_text, csv_text, in_mm, show
from sitscad.data import is_unverified
from sitscad.estimates.coil_estimates import Estimates, ReadoutEstimate
from sitscad.estimates.loads.gluing import board_press, hard_adhesive, piece_press
from sitscad.files.documents.gluing import BAR_HOLE, is_clamped, mass_text, spring_text, steel_weight_size, washer_count
from sitscad.files.documents.mounting import (
    dose_volumes,
    has_resin_moulds,
    nut_screw_length,
    screw_length,
    set_screw_length,
)
from sitscad.files.documents.piece_places import film_thicknesses
from sitscad.files.documents.preparing import (
    Order,
    capacitor_order,
    connector_order,
    cutting_text,
    order_of,
    pour_count,
)
from sitscad.files.drawing.frame import FORCED
from sitscad.files.order_facts.board_end import contact_text
from sitscad.files.order_facts.files import fabrication_path
from sitscad.files.order_facts.notes import stiffener_text
from sitscad.kernels.geometry.path import bounding_box
from sitscad.kernels.geometry.shapes import PLATES
from sitscad.layout.board import Capacitor, Layout, SolderedThermistor
from sitscad.layout.laser_sheet import joined_part
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.mount import HolePattern, Mount
from sitscad.spec.places import place_text
from sitscad.spec.presets import board_kind
from sitscad.spec.sensor import ReadoutSpec, SensorSpec
from sitscad.spec.thermistor import BOARD, CONTROLLER, TAIL

USUAL_CHIP = "chip-0603"  # Package of a tank capacitor if the spec names none: can be soldered by hand

SENSOR_PLACES = {BOARD: "glued on the board beside the pad", TAIL: "glued on the tail's stiffener",
                 CONTROLLER: "on the board of the converter"}
"""Text for each place of the temperature sensor."""

LIQUIDS = "two liquids"


@record
class Item:
    """One row of ``bom.csv``. `quantity` is for one sensor, `for_boards` for all ordered boards.

    `maker` and `order_code` are empty if unknown.
    """

    item: str
    quantity: int
    part: str
    material: str
    size: str
    note: str
    maker: str = ""
    order_code: str = ""
    for_boards: int = 0


def render(layout: Layout, estimates: Estimates, forced: str = "") -> dict[str, bytes]:
    """Return ``bom.csv``: UTF-8, commas, one header row.

    If `forced` is not empty, a warning with quantity 0 comes first.
    """
    stop = (Item("warning", 0, layout.spec.name, "", "", FORCED),) if forced else ()
    lines = [[field.name for field in fields(Item)]]
    for item in (*stop, *items(layout, estimates.readout)):
        cells = map(str, astuple(item))
        # a leading quote keeps spreadsheets from reading a cell as a formula
        lines.append([f"'{cell}" if cell[:1] in ("=", "+", "-", "@") else cell for cell in cells])
    return {"bom.csv": csv_text(lines).encode("utf-8")}


def items(layout: Layout, readout: ReadoutEstimate) -> tuple[Item, ...]:
    """Return the rows for all parts that the spec contains, in the order of assembly."""
    boards = layout.spec.fpc.boards or 1
    parts = (*_circuit_items(layout),
             *_converter_items(layout.capacitors, layout.thermistor, len(layout.coils), layout.spec.name,
                               layout.spec.readout, readout),
             *_soft_part_items(layout), *_support_items(layout))
    return tuple(
        replace(each, for_boards=each.quantity if each.item in SHARED else boards * each.quantity) for each in parts
    )


SHARED = ("adhesive", "board adhesive", "primer", "jig", "jig weight", "jig bar", "board weight", "foam", "jelly",
          "jelly solvent", "mould", "skin mould", "sealer", "mould release", "cleaner", "film", "dispenser",
          "controller", "spare connector")
"""Items that are bought once for any number of sensors."""


def _with_order(item: Item, order: Order | None) -> Item:
    """Return a row with maker and order code, and with a note if the code is unverified."""
    if order is None:
        return item
    size = "; ".join(part for part in (item.size, order.words) if part and part not in item.note)
    unseen = order.code and is_unverified(order.source)
    doubt = "; order code unverified: compare with the maker's list" if unseen else ""
    return replace(item, maker=order.maker, order_code=order.code, size=size, note=item.note + doubt)


def _plate_size(shape: str, size: tuple[float, float], thickness: float) -> str:
    return f"{PLATES[shape].size_text(size)} x {in_mm(thickness)} mm"


def _circuit_items(layout: Layout) -> Iterator[Item]:
    fpc = layout.spec.fpc
    length, across = layout.size
    drawn = layout.spec.coil.drawn
    note = "order from fpc/" if drawn is None else f"drawn by the user in {drawn}: order it from its own files"
    if layout.spec.issue.rows:
        note += f"; {layout.spec.issue.words}"
    if layout.stiffener is not None:
        note += f"; with a stiffener of {stiffener_text(layout.spec.fpc.tail, layout.stiffener)}"
    if layout.pads:
        note += f"; {contact_text(layout.pads, layout.spec.fpc.stackup, layout.top_openings)}"
    yield Item(
        f"{board_kind(fpc.stackup)} printed circuit", 1, layout.spec.name,
        f"{fpc.stackup.name}, {count_text(layout.copper_layers, 'copper layer')}",
        f"{in_mm(length)} x {in_mm(across)} x {in_mm(fpc.stackup.thickness)} mm", note,
    )
    if fpc.tail is None or fpc.tail.connector.insertion_thickness == 0.0:
        yield Item("wires", len(layout.pads), "", "", "", "soldered to the contacts of the circuit")
        return
    connector = fpc.tail.connector
    order = connector_order(connector, len(layout.pads))
    width = in_mm(connector.width(len(layout.pads)))
    thickness = f"{in_mm(connector.insertion_thickness)} +-{in_mm(connector.insertion_thickness_tolerance)} mm"
    item = Item(
        "connector", 1, f"{connector.name}, {len(layout.pads)} contacts", "",
        f"pitch {in_mm(connector.pitch)} mm, for a tail {width} mm wide and {thickness} thick",
        "on the converter's board; compare its drawing with the tail before ordering",
    )
    yield _with_order(item, order)
    spare = replace(item, item="spare connector", note="on wires, to test the bare board (mount/assembly.txt)")
    if layout.spec.mount is not None:
        yield _with_order(spare, order)


def _converter_items(
    capacitors: tuple[Capacitor, ...], thermistor: SolderedThermistor | None, coils: int, name: str,
    readout: ReadoutSpec, estimate: ReadoutEstimate,
) -> Iterator[Item]:
    chosen = estimate.capacitance
    chip = readout.chip.name if capacitors and readout.chip else ""
    if chip:
        references = ", ".join(each.reference for each in capacitors)
        place = f"soldered to the tail: {references}, places in fpc/{name}-placement.csv"
    else:
        across = " and ".join(readout.device.coil_pins())
        place = "at the coil" if readout.capacitor_at == "coil" else f"at the converter, across {across}"
    reason = estimate.capacitance_reason
    item = Item(
        "capacitor", coils, capacitance_text(chosen), "C0G", chip,
        f"one a coil, {place}" + (f"; {reason}" if reason else ""),
    )
    yield _with_order(item, capacitor_order(chip or USUAL_CHIP, chosen) if chosen else None)
    device = readout.device
    used = f"{device.channels} channels each, {coils} used"
    item = Item("converter", device.converter_count(coils), device.part, "", device.package, used)
    yield _with_order(item, order_of("converter", device.name))
    yield from _converter_circuit_items(readout, coils)
    runs = "firmware/: Arduino, MicroPython or Linux" if readout.device.has_driver else "a program of your own"
    yield Item("controller", 1, "with I2C", "", "", f"runs {runs}")
    if (sensor := readout.thermistor) is not None:
        note = f"{SENSOR_PLACES[sensor.at]}, with wires of its own to the controller"
        if thermistor is not None:
            note = f"soldered to the board: {thermistor.reference}, place in fpc/{name}-placement.csv"
        yield Item("temperature sensor", 1, sensor.part.product, "", sensor.part.package, note)
        if thermistor is not None and sensor.part.resistance is not None:
            yield Item("divider", 1, show(sensor.part.resistance, "ohm"), "0.1 %, 25 ppm/K", "",
                       "from TEMP to VDD, beside the controller's analogue input")
    if readout.cable is not None:
        size = f"{in_mm(readout.cable.length)} mm"
        yield Item("cable", coils, "conductor pair", "", size, "one pair a coil, between tail and converter")


def _converter_circuit_items(readout: ReadoutSpec, coils: int) -> Iterator[Item]:
    """Yield the parts around the converters in the circuit that sitscad draws."""
    device, oscillator = readout.device, f"{show(readout.clock, 'Hz')} oscillator"
    if not device.has_circuit:
        yield Item("clock", 1, oscillator, "", "", "it is what frequencies are measured by")
        yield Item("converter board", 1, "", "", "", f"of your own, by the data sheet of {device.part}: sitscad draws "
                   "no circuit for its pins")
        return
    yield Item("clock", 1, oscillator, "", "", "to CLKIN: it is what frequencies are measured by")
    number = device.converter_count(coils)
    yield Item("decoupling", number + 1, "100 nF", "ceramic", "", "beside VDD of every converter and of the clock")
    yield Item("reservoir", number, "1 uF", "ceramic", "", "beside VDD of every converter")
    buses = device.coil_channels(coils)[-1].bus + 1
    which = "SCL and SDA" + " of each bus" * (buses > 1)
    yield Item("bus pull-up", 2 * buses, "4.7 kohm", "", "", f"{which} to VDD, where the controller's board has none")
    yield Item("SD pull-up", 1, "10 kohm", "", "", "SD to VDD: off until the controller drives it low")
    board = "of your own from firmware/wiring, or an evaluation board (firmware/readme.txt)"
    yield Item("converter board", 1, "", "", "", f"carries the parts above; {board}; not in this package")


def _soft_part_items(layout: Layout) -> Iterator[Item]:
    """Yield the parts on the board: elastomer, target, film."""
    spec = layout.spec
    if spec.elastomer is not None:
        pad, name = spec.elastomer, spec.elastomer.material.name
        hardness = f"hardness {pad.material.hardness}; " if pad.material.hardness else ""
        size = _plate_size(pad.shape, pad.size, pad.thickness)
        note = f"{hardness}cut from a {in_mm(pad.thickness)} mm sheet with laser/{spec.name}-elastomer.dxf"
        mixed = silicone_to_mix(plates_of(spec))
        if mixed is not None and spec.mount is not None:
            volume = f"{1e6 * mixed.pads * mixed.pad:.2g} ml"
            times = f", {pour_count(spec)} pours" if pour_count(spec) > 1 else ""
            note += f"; or cast, {mixed.pads} at a time{times} in mount/{spec.name}-mould-tray, which takes {volume}"
            note += ", sealed first (mount/assembly.txt)" if has_resin_moulds(spec.mount) else ""
        shape, joined = pad.shape, joined_part(spec)
        if joined is not None:
            shape, note = "joined pads", f"{joined.words}; {note}"
            size = _plate_size("rectangle", joined.size, pad.thickness)
        order = order_of("elastomer", name)
        if order is not None and order.words == LIQUIDS:
            note += f"; sold as {LIQUIDS}: cast it, or order cured sheet of this thickness from a maker of silicone "
            note += "sheet"
        count = len(plates_of(spec).glued("elastomer"))
        yield _with_order(Item("elastomer", count, shape, name, size, note + _place_text(pad)), order)
    if spec.target is not None:
        target = spec.target
        size = _plate_size(target.shape, target.size, target.thickness)
        note = f"{cutting_text(target)} by laser/{spec.name}-target.dxf{_place_text(target)}"
        yield Item("target", len(plates_of(spec).targets), target.shape, target.material.name, size, note)
    if spec.encapsulation is not None:
        film = spec.encapsulation
        x, y = layout.body_size
        size = f"over {in_mm(x)} x {in_mm(y)} mm, {in_mm(film.thickness)} mm thick"
        purpose = "cast or coated over board, elastomer and target"
        yield Item("encapsulation", 1, "film", film.material.name, size, purpose)


def _place_text(plate: Target | ElastomerPad) -> str:
    """Describe the shift and the rotation of elastomer or target; empty if centred on the coils and not turned."""
    return f"; {place}" if (place := place_text(plate)) else ""


def _support_items(layout: Layout) -> Iterator[Item]:
    """Yield the parts behind the board (shield, glue, mount, jaw, other metal), and the aids for assembly."""
    spec = layout.spec
    sheet = shield(layout)
    if spec.shield is not None and sheet is not None:
        x0, y0, x1, y1 = bounding_box((sheet.outline(),))
        size = f"{in_mm(x1 - x0)} x {in_mm(y1 - y0)} x {in_mm(spec.shield.thickness)} mm"
        if has_round_body(spec.fpc.body) and shield_part(layout)[0].shape == "circle":
            size = f"diameter {in_mm(x1 - x0)}, {in_mm(spec.shield.thickness)} mm"
        narrowed = ", narrower than the circuit's body to pass the port" if y1 - y0 < layout.body_size[1] - 1e-9 else ""
        note = f"{backing_of(spec).shield_gap_text} under the circuit's bottom face{narrowed}"
        note += f"; {cutting_text(spec.shield)} by laser/{spec.name}-shield.dxf"
        yield Item("shield", 1, "sheet", spec.shield.material.name, size, note)
    yield from _glue_items(layout)
    if spec.mount is None:
        return
    yield from _mount_items(layout, spec, spec.mount)
    if spec.mount.jaw is not None:
        jaw = spec.mount.jaw
        size = f"face {in_mm(jaw_section(jaw).face, 3)} x {in_mm(jaw.length)} mm, height {in_mm(jaw.height)} mm"
        purpose = "the instrument that the sensor is glued into; not made here"
        yield Item("jaw", 1, jaw.name, jaw.material.name, size, purpose)
    if (metal := spec.mount.metal_behind) is not None:
        purpose = f"{in_mm(metal.distance)} mm behind the circuit's bottom face, glue not counted; not made here"
        yield Item("metal behind", 1, "", metal.material.name, f"{in_mm(metal.thickness)} mm thick", purpose)
    if spec.target is not None or spec.elastomer is not None:
        purpose = "print from mount/: aligns the pieces while the glue sets; reusable"
        yield Item("jig", 1, "jig-*", "printed", "", purpose)
        parts = [part for part in ("elastomer", "target") if getattr(spec, part) is not None]
        yield from _weight_items(layout, parts)
        if len(parts) == 2:
            yield Item("jelly", 1, "petroleum jelly", "", "", "holds the target on its press while it is lowered")
            yield Item("jelly solvent", 1, "naphtha or heptane", "", "", "takes the jelly off the target (unverified)")
    poured, cast = silicone_to_mix(plates_of(spec)), skin_silicone(layout)
    if poured is not None:
        yield Item("mould", 1, "mould-tray, mould-lid", "printed", "", "print from mount/; where the pad is cast")
    if cast is not None:
        yield Item("skin mould", 1, "mould-skin", "printed", "", "print from mount/; where the encapsulation is cast")
    if has_resin_moulds(spec.mount) and (poured is not None or cast is not None):
        yield Item("sealer", 1, "clear acrylic lacquer", "", "", "on moulds printed in resin (mount/assembly.txt)")
    yield Item("mould release", 1, "or wax", "", "", "on jig and moulds, so that no glue holds them")
    yield Item("cleaner", 1, "isopropanol", "", "", "for metal and plastic before gluing")
    rooms = [f"{in_mm(room, 3)} mm" for room in sorted(film_thicknesses(layout))]
    if rooms:
        purpose = "strips that no glue holds, between pieces and what places them (mount/assembly.txt)"
        yield Item("film", len(rooms), "polyethylene or PTFE film", "", ", ".join(rooms), purpose)
    if volumes := dose_volumes(layout):
        ends = " to ".join(dict.fromkeys(f"{float(f'{1e9 * volume:.1e}'):g}" for volume in (volumes[0], volumes[-1])))
        yield Item("dispenser", 1, "micropipette, or syringe with a needle", "", f"{ends} microlitres",
                   "doses of glue (mount/assembly.txt)")


def _weight_items(layout: Layout, parts: Sequence[str]) -> Iterator[Item]:
    """Yield the weights on the jig's presses, and the foam of the board's press."""
    note, board, pockets = "on jig-*-press (mount/assembly.txt)", board_press(layout), foot_pockets(layout)
    masses = {*(piece_press(layout.spec, part).mass for part in parts), *([board] if pockets else [])}
    if counts := [count for mass in masses if (count := washer_count(mass)) is not None]:
        yield Item("jig weight", max(counts), "washer M8, ISO 7093", "steel", "", note)
    if clamped := sorted(mass for mass in masses if is_clamped(mass)):
        forces = "; ".join(map(spring_text, clamped))
        yield Item("jig clamp", 1, "bar clamp, compression spring and washer for a peg of 8 mm", "steel", forces, note)
    if heavy := sorted(mass for mass in masses if washer_count(mass) is None and not is_clamped(mass)):
        bars = [(mass_text(mass), *steel_weight_size(mass)) for mass in heavy]
        sizes = [f"{in_mm(across)} mm across, about {1e3 * high:.0f} mm high" for _, across, high in bars]
        part = f"round bar, {' and '.join(mass for mass, *_ in bars)} with the press"
        yield Item("jig bar", len(bars), part, "steel", f"{'; '.join(sizes)}; hole of {in_mm(BAR_HOLE)} mm", note)
    if not pockets:
        yield Item("board weight", 1, f"flat stiff plate and a weight, {mass_text(board)} together", "glass, steel", "",
                   "on foam over the board while it is glued on (mount/assembly.txt)")
    where = "in jig-board-press, by double-sided tape" if pockets else "under the flat stiff plate"
    size = f"{in_mm(FOAM)} mm thick"
    yield Item("foam", 1, "soft open-cell foam", "polyurethane", size, f"{where}; presses the pads")


def _glue_items(layout: Layout) -> Iterator[Item]:
    spec, lines = layout.spec, [layer for layer in column(layout) if layer.is_glue]
    adhesive = spec.assembly.adhesive
    if adhesive is None or not (lines or spec.elastomer is not None or spec.target is not None):
        return
    size = f"lines of {in_mm(spec.assembly.glue_line)} +-{in_mm(spec.assembly.glue_tolerance)} mm"
    soft = [line for line in lines if line.part.removeprefix(GLUE) in SOFT_LINES]
    hard = hard_adhesive(layout) if spec.mount is not None else adhesive
    glue_lines = lines if hard == adhesive else soft
    count = f"{len(glue_lines)} lines: {', '.join(line.part for line in glue_lines)}" if lines else (
        "between all pieces" if hard == adhesive else "under elastomer and target")
    yield Item("adhesive", 1, adhesive.product, adhesive.name, size, count)
    if hard is not None and hard != adhesive:
        note = f"between hard faces: the board and what is below it; {adhesive.product} sets before these lie flat"
        yield Item("board adhesive", 1, hard.product, hard.name, size, note)
    if adhesive.primer and spec.elastomer is not None:
        yield Item("primer", 1, adhesive.primer, "", "", "wiped on the elastomer's faces before they are glued")


def _mount_items(layout: Layout, spec: SensorSpec, mount: Mount) -> Iterator[Item]:
    """Yield the mount's pieces, with the names and dimensions of the assembly drawing."""
    note = "print from mount/"
    if mount.kind != "grasper-pad":
        standoff = f"standoff {in_mm(mount.standoff)} mm"
        if mount.kind != "custom":
            yield Item("mount", 1, mount.kind, "printed", standoff, note)
        elif mount.step is not None:
            yield Item("mount", 1, mount.step.file, "", standoff, "a part of your own")
        if mount.finger is not None:
            thread = f"M{in_mm(mount.finger.screw)} x {in_mm(set_screw_length(layout.body, layout.spec.mount))}"
            yield Item("set screw", 2, thread, "plastic", "", "tap the cap's holes for them; clamp the finger")
        if mount.holes is not None and mount.kind != "custom":
            yield from _screw_items(layout, mount.holes)
        return
    sheet = backing_of(spec).shield_heights
    whole = f"{in_mm(mount.standoff)} mm of standoff in all" + (", with the shield" if sheet else "")
    for name, (lower, upper) in zip(MOUNT_PIECES, backing_of(spec).spans, strict=False):
        yield Item(name, 1, mount.kind, "printed", f"{in_mm(upper - lower)} mm thick", f"{note}; {whole}")


def _screw_items(layout: Layout, pattern: HolePattern) -> Iterator[Item]:
    corner, below = "M2", adapter_holes(layout)
    if below:
        yield Item("adapter", 1, "mount-adapter", "printed", "", f"print from mount/; screwed on {pattern.name} first")
        note = f"heads sunk in the adapter ({pattern.name})"
        yield Item("screw", len(below), _screw_text(pattern.thread, FLOOR, below[0].diameter), "", "", note)
        length, is_cut = nut_screw_length(adapter_depth(adapter_holes(layout)) - plate_floor(layout)[1])
        cut = "; cut to length (mount/assembly.txt)" if is_cut else ""
        yield Item("screw and nut", 4, f"{corner} x {length}", "", "", f"plate on adapter; nuts let in from below{cut}")
        return
    count = 4 if pattern.grid is not None or pattern.name == "corners-m2" else len(pattern.holes) or 4
    thread = corner if pattern.name == "corners-m2" else pattern.thread
    hole = pattern.holes[0].diameter if pattern.holes else 0.0
    holes = plate_holes(layout)
    apart = screw_spacing(holes)
    spacing = "" if apart is None else f"{in_mm(apart[0], 2)} x {in_mm(apart[1], 2)} mm apart"
    material = "polyamide" if is_near_metal(layout.spec.coil, layout.spec.all_placements, holes) else ""
    screw = _screw_text(thread, -plate_floor(layout)[1], hole)
    yield Item("screw", count, screw, material, spacing, f"of the plate ({pattern.name})")


def _screw_text(thread: str, grip: float, hole: float) -> str:
    """Describe a screw: its thread, and its length through plastic of the thickness `grip` (m).

    If the length is unknown, the text has only the thread. Without a thread, it has the diameter `hole` (m) of the
    screw's hole.
    """
    length = screw_length(thread, grip)
    return (thread or f"for {in_mm(hole)} mm holes") if length is None else f"{thread} x {length}"


PLACEMENT_HEADER = ("Ref", "Val", "Package", "PosX", "PosY", "Rot", "Side")


def render_placement(layout: Layout, estimates: Estimates | None) -> dict[str, bytes]:
    """Return ``placement.csv`` with KiCad's columns (millimetres, degrees). Empty without chips on the board.

    At rotation 0, a chip lies along x with its first terminal on the left. The value of a capacitor is the capacitance
    in `estimates`, as in ``bom.csv``. The value of a thermistor is its product.
    """
    if not layout.chips:
        return {}
    sensor = layout.spec.soldered_thermistor
    value = capacitance_text(estimates.readout.capacitance if estimates is not None else None)
    lines: list[Sequence[object]] = [PLACEMENT_HEADER]
    for each in layout.chips:
        first, other = (pad.centre for pad in each.pads)
        dx, dy = other.x - first.x, other.y - first.y
        turned = (0 if dx > 0 else 180) if abs(dx) > abs(dy) else (90 if dy > 0 else 270)
        at = tuple(in_mm(place, 4, 4) for place in each.centre)
        text = value if isinstance(each, Capacitor) or sensor is None else sensor.part.product
        lines.append([each.reference, text, each.package, *at, turned, "top"])
    return {fabrication_path(layout.spec.name, "placement.csv"): csv_text(lines).encode("ascii")}


def capacitance_text(chosen: float | None) -> str:
    """Format the tank capacitor's value (F). The text is `none found` if there is none."""
    return show(chosen, "F") if chosen is not None and math.isfinite(chosen) else "none found"
