"""Assembly instructions, step by step, with the height to be measured after each step (``mount/assembly.txt``).

They include the bench tests of the bare board, the connection of the tail, and the measurement of the finished sensor.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from sitscad.assembly.places.bodies import BodyRole, plates_of
from sitscad.assembly.places.column import (
    Layer,
    Levels,
    Toleranced,
    column,
    layer_heights,
    layers_on_board,
    sealed_height,
)
from sitscad.assembly.places.fit import measures
from sitscad.assembly.places.seating import tail_support
from sitscad.assembly.places.state import FREE, REST
from sitscad.assembly.solids.tooling import BOARD_PRESS, foot_pockets, push_places, silicone_to_mix, skin_silicone
from sitscad.basics.check_results import Measure
from sitscad.basics.quantities import plus_minus
from sitscad.basics.units import DASH, aligned_lines, in_mm, show
from sitscad.data import is_unverified
from sitscad.estimates.circuits.settings import bare_board_code
from sitscad.estimates.circuits.uncertainty import direct_resistance_sigma
from sitscad.estimates.coil_estimates import METER_FREQUENCY, CoilEstimate, Estimates, ReadoutEstimate
from sitscad.estimates.loads.gluing import board_plan, hard_adhesive
from sitscad.estimates.tolerances.scatter import ACCEPTED_SIGMAS
from sitscad.files.documents.firmware_driver import bare_drive_text
from sitscad.files.documents.gluing import (
    gluing_text,
    hard_glue_dose_text,
    line_areas,
    measuring_text,
    other_glue_reason,
    pressing_text,
    primer_text,
    setting_text,
    toleranced_text,
)
from sitscad.files.documents.mounting import (
    board_mounting_steps,
    film_text,
    has_resin_moulds,
    jaw_joint_steps,
    jig_picture,
    release_text,
    sensor_mounting_steps,
)
from sitscad.files.documents.piece_places import (
    alignment_text,
    base_place_text,
    groove_text,
    overhang_text,
    piece_sizes,
    place_tolerance_row,
    stiff_pieces,
    stop_place_text,
    strip_removal_text,
    well_place_text,
)
from sitscad.files.documents.preparing import (
    PROCESS_TEXTS,
    RAW_RESIN,
    RELEASE,
    connector_order,
    cure_text,
    cut_text,
    missing_file_lines,
    piece_list_lines,
    pour_count,
    silicone_mix_text,
    silicone_volume_text,
    tool_list_text,
    waiting_time_text,
)
from sitscad.files.documents.tail_steps import loose_tail_text, strain_relief_text
from sitscad.files.drawing.frame import FORCED
from sitscad.files.order_facts.files import panel_path
from sitscad.files.order_facts.notes import hanging
from sitscad.files.writer import Package
from sitscad.layout.board import Layout, Pad, SolderedThermistor
from sitscad.layout.panel import is_wanted
from sitscad.spec.circuit import Tail
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.mount import Assembly, Mount
from sitscad.spec.presets import UnverifiedFigure, unverified_figures
from sitscad.spec.thermistor import Thermistor

WIDTH = 96

NOTHING = Package({}, frozenset())


def render(layout: Layout, estimates: Estimates, bench: Estimates, forced: str, package: Package) -> dict[str, bytes]:
    """Return ``mount/assembly.txt``: the numbered steps and the masses of the heaviest parts. Empty without a mount.

    `bench` are the estimates at 20 degrees Celsius. The text begins with a warning if `forced` is not empty.
    """
    if layout.spec.mount is None:
        return {}
    # absent if pieces of a forced package cannot be put together
    content = package.files.get("mount/assembly.json")
    weighed = "\n".join(["", *_mass_lines(content), ""]) if content is not None else ""
    stop = f"{FORCED}\n\n" if forced else ""
    steps = instructions(layout, estimates, bench, package)
    absent = missing_file_lines(steps, package, WIDTH)
    lacking = "\n".join(["", *absent, ""]) if absent else ""
    return {"mount/assembly.txt": (stop + steps + weighed + lacking).encode("utf-8")}


def instructions(layout: Layout, estimates: Estimates, bench: Estimates, package: Package = NOTHING) -> str:
    """Return the instructions without masses; `bench` are the estimates at the test temperature, 20 degrees Celsius."""
    spec = layout.spec
    mount = spec.mount
    jaws = "" if mount is None or mount.jaw is None else f", mount/{spec.name}-jaw-drawing.pdf the closed pair"
    frames = [jig_picture(f"jig-{part}") for part in ("elastomer", "target") if getattr(spec, part) is not None]
    if frames and foot_pockets(layout):
        frames.append(jig_picture(BOARD_PRESS))
    *earlier, last = frames or [""]
    pictures = f", {', '.join(earlier)}{' and ' if earlier else ''}{last} the jig at each use" if frames else ""
    jig = (
        "Wax the jig, or wipe it with mould release, so that no glue holds it, but keep the feet of its presses clean: "
        "they lie on faces that are glued later. "
    ) if _has_jig(spec.elastomer, spec.target) else ""
    head = (
        f"mount/assembly.svg shows the pieces apart{jaws}{pictures}. Parts and quantities are in bom.csv. Work under a "
        f"microscope, with gloves; clean metal and plastic with isopropanol. {jig}Lengths are in mm."
    )
    issue = [f"{spec.issue.title}."] if spec.issue.rows else []
    steps = [*_steps(layout, estimates.readout, bench)]
    parts = [f"{spec.name}: how it is put together", *issue, "", *hanging("", head, WIDTH), ""]
    for sentence in filter(None, (tool_list_text(" ".join([head, *steps])), waiting_time_text(layout))):
        parts += [*hanging("", sentence, WIDTH), ""]
    cuts = cut_text({part: getattr(spec, part) for part in ("elastomer", "target", "shield")})
    drawn = spec.coil.drawn
    ordered = f"The board is ordered by {'fpc/' if drawn is None else f'the files of its own ({drawn})'}{cuts}"
    if listed := [*piece_list_lines(mount, spec.name, ordered, package, WIDTH)]:
        parts += [*listed, ""]
    for number, step in enumerate(steps, 1):
        sentence, *lines = step.split("\n")
        parts += hanging(f"{number:>2}. ", sentence, WIDTH)
        parts += [*(row for line in lines for row in hanging("    ", line, WIDTH)), ""]
    parts += _size_check_lines(spec.assembly, column(layout), measures(layout), unverified_figures(spec))
    return "\n".join(parts).rstrip("\n") + "\n"


def _steps(layout: Layout, readout: ReadoutEstimate, bench: Estimates) -> Iterator[str]:
    """Yield the steps from the jig to the finished sensor.

    Lines of tables follow a step's sentences after line breaks.
    """
    spec, at = layout.spec, layer_heights(column(layout) or layers_on_board(layout))
    yield from _preparation_steps(layout)
    if is_wanted(layout.size, layout.spec.fpc):
        yield (
            "Measure the panel's coupons. Then cut the board out at the bridges, and file their nubs off "
            f"({panel_path(spec.name, '-readme.txt')} has their places and what a coupon measures)."
        )
    yield bare_board_test(layout, readout, bench)
    yield from filter(None, (primer_text(spec.assembly.adhesive, spec.elastomer),))
    if spec.elastomer is not None or spec.target is not None:
        slot = " and tail in the slot" if spec.fpc.tail is not None else ""
        base = base_place_text(layout.spec.fpc, layout.spec.mount)
        yield f"Lay the board, face with the coils up{slot}, into the jig's base (jig-base).{base}"
    if spec.elastomer is not None:
        height, place = _height_above_board(at, "elastomer"), well_place_text(layout, "elastomer")
        yield gluing_text(spec, "elastomer", "the board", height, place)
    if spec.target is not None:
        under = "the elastomer" if spec.elastomer is not None else "the board"
        yield gluing_text(spec, "target", under, _height_above_board(at, "target"), well_place_text(layout, "target"))
    if layout.reference is not None:
        yield f"Glue nothing on coil {layout.reference.name}. It is the reference coil, which has no target and no pad."
    is_cast = skin_silicone(layout) is not None  # done with the board in the base, whose pins guide the mould
    sealing = [] if spec.encapsulation is None else [
        f"{film_text(layout, spec.encapsulation)} From the board's top face to the film's upper face are "
        f"{toleranced_text(sealed_height(layers_on_board(layout), spec.encapsulation, spec.assembly))} then."]
    if is_cast:
        yield from sealing
    if _has_jig(spec.elastomer, spec.target):
        yield release_text(push_places(layout.body, layout.body_outline), skin_silicone(layout))
    yield from _jaw_steps(layout, at)
    if not is_cast:
        yield from sealing
    yield from sensor_mounting_steps(layout)
    if spec.coil.drawn is not None:
        yield f"Connect the terminals of each coil ({spec.coil.drawn}) to the converter as in firmware/readme.txt."
    elif connection := connection_text(layout.pads, layout.spec.fpc.tail):
        yield connection
    unseen = [f.what.split()[1] for f in unverified_figures(spec) if f.what.startswith("conductor ")]
    yield finished_sensor_test(bench.all_coils, _measuring_preparations(spec.mount), unseen)


def _measuring_preparations(mount: Mount | None) -> str:
    """Describe what to do before the finished sensor is measured; empty without a jaw or metal behind the board."""
    if mount is not None and mount.jaw is not None:
        return (
            "Close the jaws: they must close without force, and pass a ring gauge (or a reamed hole) of the port's "
            f"{in_mm(mount.jaw.port_diameter)} mm. Open them. "
        )
    if mount is None or mount.metal_behind is None:
        return ""
    metal = mount.metal_behind
    return (
        f"Put the sensor over the {metal.material.name} that it is used over ({in_mm(metal.thickness)} mm thick, its "
        f"face {in_mm(metal.distance)} mm and the glue lines below the board): the readings count it. "
    )


def _has_jig(elastomer: ElastomerPad | None, target: Target | None) -> bool:
    """Whether an elastomer or a target is glued on the board, which needs a jig."""
    return elastomer is not None or target is not None


def _has_printed_mount(mount: Mount | None, layers: tuple[Layer, ...]) -> bool:
    """Whether the package contains the mount. It does not for a custom mount or a board glued directly to the jaw."""
    if mount is None or mount.kind == "custom":
        return False
    return mount.jaw is None or any(layer.part.startswith("mount") for layer in layers)


def _preparation_steps(layout: Layout) -> Iterator[str]:
    spec, mount, poured = layout.spec, layout.spec.mount, silicone_to_mix(plates_of(layout.spec))
    assert mount is not None
    counts = ""
    if mount.jaw is not None and _has_printed_mount(layout.spec.mount, column(layout)):
        sizes = ", ".join(f"{layer.part} {toleranced_text(layer.thickness)}" for layer in column(layout)
                          if layer.part.startswith("mount"))
        counts = (
            " Measure how thick each is between its lower face and the floor that carries the board, beside stop and "
            f"grooves, by a dial gauge on a flat plate (it counts in the closed pair): {sizes}. Rub a thicker one "
            "down, its lower face on abrasive film on glass."
        )
    printed = ["the mount"] * _has_printed_mount(mount, column(layout))
    printed += ["the jig"] * _has_jig(spec.elastomer, spec.target)
    if printed:
        yield f"Make {' and '.join(printed)} from mount/ ({PROCESS_TEXTS.get(mount.process, mount.process)}).{counts}"
    yield from filter(None, (measuring_text(spec),))
    if has_resin_moulds(mount) and (poured is not None or skin_silicone(layout) is not None):
        yield RAW_RESIN
    if poured is not None and spec.elastomer is not None:
        count, is_webbed = len(plates_of(spec).glued("elastomer")), plates_of(spec).joined is not None
        chosen = "Choose a pad that is" if count == 1 else f"Choose {count} pads that are each"
        if is_webbed:
            chosen = "The piece, all pads in one, is good if it is"
        pads = "the piece" if is_webbed else "the pads"
        again = f" {pour_count(spec)} pours make all pads: mix anew for each." if pour_count(spec) > 1 else ""
        edge = "the edge" if spec.elastomer.outline.is_round else "a corner"
        thickness = next(each.thickness for each in layers_on_board(layout) if each.part == "elastomer")
        yield (
            f"Cut the elastomer by laser/, or cast it. {RELEASE} Mix {silicone_volume_text(poured)} of "
            f"{silicone_mix_text(spec.elastomer.material)}, take the air out of it (vacuum, until it no longer "
            "foams), fill the "
            "cavities of mould-tray a little over, draw mould-lid over it from one side, weigh it down (about 1 kg). "
            f"{cure_text(spec.elastomer.material)}{again} Lift the lid from one edge; press {pads} out from {edge} "
            f"with a blunt plastic tip, and wash the release off with isopropanol before they are glued. {chosen} "
            f"{toleranced_text(thickness)} thick."
        )


def _height_above_board(at: Levels, part: str) -> Toleranced:
    """Return the height (m, with tolerance) of a part's upper face above the board's top face.

    `at` holds the heights of the lower and the upper face of each part.
    """
    return at[part][1] - at["board"][1]


def _jaw_steps(layout: Layout, at: Levels) -> Iterator[str]:
    mount = layout.spec.mount
    assert mount is not None
    if not column(layout):
        yield from board_mounting_steps(layout)
        return
    yield from jaw_joint_steps(layout.body, layout.spec.assembly.glue_line, layout.spec.mount)
    metal = at["jaw"][1]

    def height(part: str) -> str:
        return toleranced_text(at[part][1] - metal)

    areas, stiff, glue = line_areas(layout), stiff_pieces(column(layout)), hard_adhesive(layout)
    assembly, sets = layout.spec.assembly, setting_text(glue)
    why = other_glue_reason(assembly, board_plan(layout), glue)
    overhang = overhang_text(layout.body, mount, tail_support(layout), at)
    alignment = alignment_text(layout.body, mount, assembly, piece_sizes(layout), mount.jaw, stiff)
    yield (
        "Degrease the jaw's face. Heights in the next steps are above its metal: zero a dial gauge there."
        f"{alignment}"
    )
    if stiff:
        glues = ", ".join(f"the {part} with {hard_glue_dose_text(assembly, glue, areas[part])}" for part in stiff)
        most = ", ".join(f"{part} {height(part)}" for part in stiff)
        yield (
            f"Glue on the jaw's face, in this order: {glues}.{why} "
            "Press each down at once with about 10 N (1 kg on a kitchen scale) by a flat stick, and hold it there by a "
            f"spring clamp over a flat block until the glue has set.{overhang}{sets} Before the "
            f"next piece, measure how high each is above the jaw's metal: {most}. If it is higher, take it off with a "
            "blade, clean both faces, and glue it on with less glue; first rub down the lower face of a mount that is "
            "too thick (step 1)."
            f"{strip_removal_text(mount.jaw, layout.body_size[1], bool(alignment))}"
        )
    if bending := loose_tail_text(layout):
        yield bending
    # a board on metal or shield alone is not located by a mount
    has_mount = any(part.startswith("mount") for part in stiff)
    place = f"{stop_place_text(layout)}{groove_text(layout)} " if has_mount else ""
    spreading = f"Spread {hard_glue_dose_text(assembly, glue, areas['board'])}.{'' if stiff else why}"
    yield (
        f"Glue the board on. {place}{pressing_text(layout, spreading)}{'' if stiff else sets} The board's top face "
        f"beside the pad is then {height('board')} above the jaw's metal."
    )
    if layout.spec.fpc.tail is not None:
        yield strain_relief_text(layout)


OF_JAW = {"jaw": "height", "opposing-jaw": "height", "opposing-pad": "opposing_pad_thickness"}
"""Parts of the instrument with both jaws, and for each part the key of `mount.jaw` that states its thickness."""


def _size_check_lines(
    assembly: Assembly, layers: tuple[Layer, ...], circles: tuple[Measure, ...], figures: tuple[UnverifiedFigure, ...]
) -> list[str]:
    pair = next(iter(circles), None)
    if pair is None:
        return []
    text = (
        f"Closed without force, the pair needs a circle of {pair.nominal * 1e3:.3f} mm as drawn, of "
        f"{pair.worst * 1e3:.3f} mm with all tolerances at their worst; the port has {in_mm(pair.limit)} mm{{}}. "
        "Measure back to back before you order many."
    )
    unseen = {f.what.split()[-1] for f in figures if f.what.startswith("jaw ")}
    text = text.format(" (the jaw's figures are unverified: measure yours)" if unseen else "")
    rows = [
        f"  {layer.part:<28}{toleranced_text(layer.thickness)}"
        f"{'  unverified' if OF_JAW.get(layer.part) in unseen else ''}"
        for layer in layers
    ]
    lines = hanging("", text, WIDTH)
    return [*lines, "", "From the jaw's back to the other jaw's:", *rows, place_tolerance_row(assembly)]


HEAVIEST = 6  # Number of parts listed by weight


def _mass_text(mass: float) -> str:
    """Format a mass (kg) in grams, or in milligrams below 1 g."""
    return f"{mass * 1e3:.3g} g" if mass >= 1e-3 else f"{mass * 1e6:.3g} mg"


def _total_mass(pieces: Sequence[Mapping[str, Any]]) -> float:
    """Return the total mass (kg) of pieces; pieces without a known mass count as 0."""
    return math.fsum(each["mass_kg"] or 0.0 for each in pieces)


def _mass_lines(content: bytes) -> list[str]:
    """Describe the sensor's mass, centre of mass and heaviest parts. `content` is the file ``mount/assembly.json``."""
    document = json.loads(content)
    balance, pieces = document["sensor"], [each for each in document["pieces"] if not each["is_carrier"]]
    x, y, z = (round(value * 1e3, 2) + 0.0 for value in balance["centre_m"])
    mounts = [each for each in pieces if each["name"].startswith(BodyRole.MOUNT)]
    mounted = f" with its mount ({_mass_text(_total_mass(mounts))} of it)" if mounts else ""
    carried = ", without the jaws," if len(pieces) < len(document["pieces"]) else ""
    weighed = (
        f"The sensor{mounted}{carried} weighs {_mass_text(balance['mass_kg'])}; its centre is at x {x:.2f}, y "
        f"{y:.2f}, z {z:.2f} (mm, axes of mount/assembly.step). Its heaviest parts (films, glue and each piece: "
        "mount/assembly.json):"
    )
    lines = hanging("", weighed, WIDTH)
    groups: dict[str, list[dict[str, Any]]] = {}
    for each in pieces:
        first = each["name"].split("-")[0]
        part = "board" if first in ("board", "tail", "copper") else (
            first if first in ("glue", "target", "elastomer") else each["name"])
        groups.setdefault(part, []).append(each)
    heaviest = sorted(((-_total_mass(group), name, group) for name, group in groups.items()))[:HEAVIEST]
    for mass, name, group in heaviest:
        materials = dict.fromkeys(each["material"] for each in group)
        material = "films and copper" if name == "board" else ", ".join(materials)
        count = len(group) if name in ("target", "elastomer") and len(group) > 1 else 0
        unseen = "  *" if any(is_unverified(each["density_source"]) for each in group) else ""
        label = f"{count} {name}s" if count else name
        lines.append(f"   {label:<18} {material:<22} {_mass_text(-mass):>10}{unseen}")
    if any(is_unverified(each["density_source"]) for *_, group in heaviest for each in group):
        lines.append("   * its density is unverified")
    if balance["not_weighed"]:
        lines.append(f"Not weighed, no density being known: {', '.join(balance['not_weighed'])}.")
    return lines


def bare_board_test(layout: Layout, readout: ReadoutEstimate, bench: Estimates) -> str:
    """Describe the test of a bare board at 20 degrees Celsius, with a table of each coil's reading on each instrument.

    `bench` are the estimates at this temperature. The text includes the converter's drive code for the bare board,
    which depends on the estimated `readout` of the finished sensor.
    """
    relative, metered = direct_resistance_sigma(layout.spec), {read.coil: read for read in bench.metered}
    meter = f"LCR, {show(METER_FREQUENCY, 'Hz')}:"
    rows = [("coil", "contacts", "ohmmeter", f"{meter} L", "R", "converter")]
    for coil in bench.all_coils:
        nets = {each.net for each in layout.coils if each.name == coil.name}
        numbers = sorted(pad.number for pad in layout.pads if pad.net in nets)
        direct, read = coil.terminal_resistance_dc, metered.get(coil.name)
        rows.append((
            coil.name, ", ".join(map(str, numbers)) or DASH, _with_sigma(direct, relative * direct, "ohm"),
            DASH if read is None else _with_sigma(read.inductance, read.inductance_sigma, "H"),
            DASH if read is None else _with_sigma(read.resistance, read.resistance_sigma, "ohm"),
            _tank_frequency(coil, FREE),
        ))
    code = bare_board_code(bench.all_coils, bench.readout.device)
    text = (
        "Test the bare board before any glue, at 20 degC, far from metal, by short wires from a spare connector or by "
        "probes; zero the meter with them shorted. The table has the reading of each instrument between the contacts "
        "of each coil: an ohmmeter; an LCR meter, for L and R in series; the converter with its tank's capacitor of "
        f"{show(bench.readout.capacitance, 'F')} and the programs in firmware/. The LCR meter alone is enough. +- is "
        f"one sigma of manufacture. Reject a board with a coil that is more than {ACCEPTED_SIGMAS:g} sigma off."
        f"{bare_drive_text(layout.spec.readout.device, readout, code)}"
    )
    text += _thermistor_test(layout.pads, layout.thermistor, layout.spec.soldered_thermistor)
    return "\n".join([text, *aligned_lines(rows)])


def _thermistor_test(contacts: Iterable[Pad], soldered: SolderedThermistor | None, sensor: Thermistor | None) -> str:
    """Describe how a thermistor is soldered to the board and tested; empty if the board carries none."""
    if soldered is None or sensor is None or sensor.part.resistance is None:
        return ""
    first, second = sorted(pad.number for pad in contacts if pad.net in soldered.nets)
    return (f" Solder {soldered.reference} ({sensor.part.product}) first: between contacts {first} and {second} it has "
            f"{show(sensor.part.resistance, 'ohm')} at 25 degC, and less when you warm it with a finger.")


def finished_sensor_test(coils: tuple[CoilEstimate, ...], closes: str, unseen: Sequence[str] = ()) -> str:
    """Describe the test of the finished sensor at rest at 20 degrees Celsius, with a table of readings by coil.

    `closes` is the text on the preparations, from `_measuring_preparations`. `unseen` names metals near the coils whose
    data are unverified.
    """
    coils = tuple(coil for coil in coils if REST in coil.states)
    if not coils:
        return f"{closes}Measure each coil again."
    rows = [("coil", "converter", "inductance by firmware/", "LCR meter at the converter's frequency")]
    rows += [(coil.name, _tank_frequency(coil, REST), _inductance_text(coil.states[REST].converter_inductance),
              _inductance_text(coil.states[REST].apparent_inductance)) for coil in coils]
    leaning = f" They lean on unverified figures of metals near the coils: {', '.join(unseen)}." if unseen else ""
    text = (
        f"{closes}Measure each coil again at 20 degC, with nothing on it. The table has the reading of each instrument "
        "at rest: the converter with its tank's capacitor, whose frequency firmware/ shows as an inductance; or an LCR "
        "meter that reaches this frequency. Their inductances differ, because each counts the coil's own capacitance "
        f"and losses in its own way. +- is one sigma of manufacture.{leaning}"
    )
    return "\n".join([text, *aligned_lines(rows)])


def connection_text(pads: tuple[Pad, ...], tail: Tail | None) -> str:
    """Describe the face that bears the contacts, the place of contact 1, and the connector. Empty without contacts."""
    if not pads:
        return ""
    first = min(pads, key=lambda pad: pad.number)
    name = "unused" if first.is_unused else first.pin
    where = (
        "The contacts are on the face with the coils. Seen on that face, along the tail to its end, contact 1 "
        f"({name}) is at the left edge; which contact goes to which pin of the converter is in fpc/readme.txt."
    )
    if tail is None or tail.connector.insertion_thickness == 0.0:
        return f"Solder wires to the contacts. {where}"
    order = connector_order(tail.connector, len(pads))
    doubt = ", code unverified" if order is not None and is_unverified(order.source) else ""
    code = "" if order is None else f"; {order.maker} {order.code}{doubt}" if order.code else f"; {order.words}"
    return (
        f"Plug the tail into its connector ({tail.connector.name}, {len(pads)} contacts{code}): open the latch, "
        f"push the tail in straight, close the latch. The connector's springs have to be on the contacts' side. {where}"
    )


def _tank_frequency(coil: CoilEstimate, state: str) -> str:
    """Format the tank's frequency in a state, with its standard deviation. A dash if the state has no estimate."""
    estimate = coil.states.get(state)
    if estimate is None:
        return DASH
    return _with_sigma(estimate.frequency, None if estimate.spread is None else estimate.spread.frequency, "Hz")


def _inductance_text(inductance: float | None) -> str:
    return DASH if inductance is None or not math.isfinite(inductance) else show(inductance, "H", 4)


def _with_sigma(value: float, sigma: float | None, unit: str) -> str:
    return plus_minus(value, sigma, unit, digits=4) if math.isfinite(value) else DASH
