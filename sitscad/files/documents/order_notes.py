"""The fabricator's readme: the order's parameters as plain text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from textwrap import wrap

from sitscad.assembly.places.column import usual_tolerances
from sitscad.assembly.places.tail_path import bends, pivot_line
from sitscad.basics.units import aligned_lines, count_text, show
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.tolerances.scatter import ACCEPTED_SIGMAS
from sitscad.files.drawing.frame import FORCED
from sitscad.files.order_facts import notes
from sitscad.files.order_facts.board_end import contact_text, end_tolerance, plug_text
from sitscad.files.order_facts.files import (
    FOLDER,
    board_images,
    body_files,
    drill_files,
    fabrication_path,
    fingerprint,
    gerber_files,
    has_coverlay,
    panel_path,
    shell_line,
    stack_names,
    tail_coverlay_files,
)
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.bending import Where, bend_stretch, contact_copper, finished_thickness
from sitscad.layout.board import Capacitor, Layout, SolderedThermistor, Via
from sitscad.layout.gaps import smallest_gaps
from sitscad.layout.lamination import lamination_text, tail_holes
from sitscad.layout.panel import Panel, is_too_small
from sitscad.layout.tail.chips import chip_opening
from sitscad.layout.tail.tracks import contact_rows
from sitscad.spec.circuit import MASK, Chip, FpcSpec, LayerKind, Plating, Stackup, Tail
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.presets import (
    board_kind,
    conductor,
    cover_name,
    is_rigid,
    is_unverified,
    least_adhesive,
    unverified_rows,
)


def render(
    layout: Layout, panel: Panel | None = None, bench: Estimates | None = None,
    files: Mapping[str, bytes] | None = None, forced: str = "",
) -> dict[str, bytes]:
    """Return the readme for the fabricator by its path in the package.

    `panel` is the panel in which the boards are ordered; None for single boards. `bench` are the estimates at 20
    degrees Celsius, which state the coils' resistances for the test. `files` are the images whose fingerprint the
    readme states. The readme begins with a warning if `forced` is not empty.
    """
    return {f"{FOLDER}/readme.txt": order_readme(layout, panel, bench, files, bool(forced)).encode("utf-8")}


def order_readme(
    layout: Layout, panel: Panel | None = None, bench: Estimates | None = None,
    files: Mapping[str, bytes] | None = None, forced: bool = False,
) -> str:
    """Return the order's parameters, critical properties, tests, files, and the fingerprint of `files` if given.

    `bench` are the estimates at 20 degrees Celsius, which state the coils' resistances for the test. The text begins
    with a warning if `forced`, which means that the package was built in spite of errors.
    """
    incomplete = [f"- {lack.message}" for lack in layout.shortfalls]
    if incomplete:
        incomplete = ["DO NOT ORDER FROM THESE FILES: the layout is not complete.", *incomplete, ""]
    wired = aligned_lines(contact_rows(layout))
    sections = [
        [f"{FORCED}.", ""] if forced else [], incomplete, notes.section("What to make", _order_rows(layout, panel)),
        notes.section("Stack-up, from the top", _layer_rows(layout.copper_layers, layout.spec.fpc, layout.vias)),
        notes.section("What the sensor depends on", _care_rows(layout.copper_layers, layout.spec.fpc.stackup)),
        notes.section("Test", _test_rows(layout, bench)),
        *([notes.section("Questions", notes.questions(layout.spec.fpc))] if layout.spec.fpc.rules.one_process else ()),
        notes.headed("Contacts, for whoever wires the sensor (numbered as in the drawing)", wired) if wired else [],
        notes.section("Files in the archive", _file_rows(layout.spec.name, _image_rows(layout), panel)),
        notes.section("Files in the package only", _unsent_file_rows(layout.spec.name, _image_rows(layout), panel)),
        _fingerprint_lines(layout.spec.name, panel, files) if files else []
    ]
    title = f"{layout.spec.name}: {board_kind(layout.spec.fpc.stackup)} printed circuit of an inductive sensor"
    return "\n".join([title, "=" * len(title), "", *(line for lines in sections for line in lines)])


def _fingerprint_lines(name: str, panel: Panel | None, files: Mapping[str, bytes]) -> list[str]:
    """Return the section on the fingerprint: the hashed files, and the shell command that prints the hash."""
    images = board_images(files)
    what = (
        "SHA-256 of the board's Gerber and drill files, one after another in the order of the command below. Run the "
        "command in the folder of these files: it prints the same number. Drawings show its first 16 digits."
    )
    if panel is not None:
        what += (
            f" It is the number of the single board, whose files are not in the archive. "
            f"{_panel_name(name, '-readme.txt')} has the number of the panel's files."
        )
    lines = wrap(what, notes.TEXT_WIDTH, break_long_words=False, break_on_hyphens=False)
    return notes.headed("Fingerprint", [*lines, "", fingerprint(files, images), shell_line(images)])


def _order_rows(layout: Layout, panel: Panel | None) -> Iterator[tuple[str, str]]:
    fpc = layout.spec.fpc
    length, across = layout.size
    copper = fpc.stackup.copper
    yield from layout.spec.issue.rows
    yield "Type", f"{board_kind(fpc.stackup)} circuit, {count_text(len(copper), 'copper layer')}"
    yield "Size", f"{show(length, 'm')} x {show(across, 'm')} over all (outline file, middle of the line)"
    parts = None if panel is None else len(panel.parts)
    if quantity := notes.quantity_text(fpc.boards, parts, fpc.rules.order_multiple):
        yield "Quantity", quantity
    is_small = is_too_small(layout.size, fpc.rules)
    yield "Delivery", _delivery_text(fpc.rules, layout.spec.name, is_small, panel)
    condition = "" if is_rigid(fpc.stackup) else ", without stiffener"
    yield "Thickness", f"{show(fpc.stackup.thickness, 'm')} finished{condition}"
    yield "Tolerances", (
        f"outline {notes.outline_text(fpc.rules)}, layers in register within {show(fpc.rules.registration, 'm')}, "
        f"{cover_name(fpc.stackup)} within {show(fpc.rules.coverlay_registration, 'm')} of the copper, "
        "finished thickness " + ", ".join(f"{place} {text}" for place, text in notes.thickness_texts(layout).items())
    )
    if layout.spec.fpc.tail_copper < len(copper):
        yield "Tail", _thin_tail_text(layout)
    if build := lamination_text(layout):
        yield "Build", build
    yield "Smallest track", show(min(trace.width for trace in layout.traces), "m") if layout.traces else "none"
    for each in notes.coil_kinds(layout.coils, layout.spec.coil):
        of = "" if each is layout.spec.coil else " (the reference coil)"
        yield "Coil", f"tracks {show(each.trace_width, 'm')} wide, {show(each.trace_spacing, 'm')} apart{of}"
    yield from (("Smallest gap", text) for text in notes.gap_texts(smallest_gaps(layout)))
    spans = notes.holes_text(layout.copper_layers, layout.vias, layout.spec.fpc.tail_copper, tail_holes(layout))
    yield "Holes", _hole_text(fpc, layout.vias, spans)
    yield "Finish", notes.finish_text(layout.pads, fpc, bool(layout.vias)).removeprefix("Finish on bare contacts: ")
    yield "Legend", "none" if fpc.rules.one_process else "none, and no date code or maker's mark on the boards"
    yield "Laminates", notes.laminate_text(fpc.stackup)
    if not fpc.rules.one_process:
        standard = "IPC-6012 class 2"
        if not is_rigid(fpc.stackup):
            standard = f"IPC-6013 class 2, {_ipc_type(layout.copper_layers, layout.spec.fpc.tail, layout.vias)}"
        yield "Class", f"{standard}, unless the order says otherwise"
    if layout.stiffener is not None:
        left, low, right, high = bounding_box([layout.stiffener.outline.outline])
        where = f"x = {show(left, 'm')} to {show(right, 'm')}, y = {show(low, 'm')} to {show(high, 'm')}"
        yield "Stiffener", f"{notes.stiffener_text(fpc.tail, layout.stiffener)}, on the bottom face, {where}"
    if fpc.tail is not None and fpc.tail.connector.insertion_thickness > 0.0:
        yield "Contacts", _contact_text(layout)
    elif layout.pads:
        yield "Contacts", f"{contact_text(layout.pads, layout.spec.fpc.stackup, layout.top_openings)}, for solder"
    if layout.capacitors and (chip := layout.spec.readout.chip) is not None:
        yield "Capacitors", _capacitor_text(layout.capacitors, chip, fpc.rules)
    if layout.thermistor is not None:
        yield "Thermistor", _thermistor_text(layout.thermistor, layout.body)
    if layout.bend_zone is not None:
        yield "Bend", notes.bend_text(bend_stretch(layout), bends(layout), pivot_line(layout))
    if turn := notes.turn_text(fpc.tail):
        yield "Outline", turn
    yield "Made for rules", _rule_text(layout.spec.coil.layers, layout.spec.fpc)


def _capacitor_text(capacitors: Sequence[Capacitor], chip: Chip, rules: DesignRules) -> str:
    """Describe the pads of capacitors, which are soldered later."""
    names, opening = ", ".join(each.reference for each in capacitors), chip_opening(rules, chip)
    return (
        f"bare pads for {names} ({capacitors[0].package}) over the stiffener, see placement.csv; the coverlay is open "
        f"{show(opening, 'm')} beyond each pad and laid within {show(rules.coverlay_registration, 'm')}; "
        "soldered on by hand or by an assembler, not part of this order unless it says so"
    )


def _thermistor_text(sensor: SolderedThermistor, body: Box) -> str:
    """Describe the pads of a thermistor, which is soldered later, on a board with a box of its `body` (m)."""
    where = "on the body" if sensor.centre.x < body[2] else "over the stiffener"
    return (
        f"bare pads for {sensor.reference} ({sensor.package}) {where}, see placement.csv; soldered on by hand or "
        "by an assembler, not part of this order unless it says so"
    )


def _delivery_text(rules: DesignRules, name: str, is_small: bool, panel: Panel | None) -> str:
    """Describe the delivery of the boards, as single boards or in panels.

    `is_small` states whether the board is smaller than the smallest part in the fabricator's rules.
    """
    if panel is None:
        small = "; smaller than the smallest part of these rules: deliver them in a panel of your own, held by bridges"
        return f"single boards, cut out{small if is_small else ''}"
    width, height = (show(side, "m") for side in panel.size)
    many = f"{len(panel.parts)} boards each, as drawn in {_panel_name(name, '-drawing.pdf')}"
    sides = zip(sorted(panel.size), sorted(rules.panel_size), strict=True)
    is_larger = any(actual > usual + 1e-9 for actual, usual in sides)  # larger than the rules' panel size
    larger = "; this is larger than usual: confirm that you make it" if is_larger else ""
    return f"in panels of {width} x {height}, {many}{larger}"


def _panel_name(name: str, ending: str) -> str:
    return panel_path(name, ending).rpartition("/")[2]


def _thin_tail_text(layout: Layout) -> str:
    """Describe a tail with fewer copper layers than the body, and the place where the other layers end."""
    first, last = layout.spec.fpc.tail_copper + 1, layout.copper_layers
    lower = f"copper {first}" if first == last else f"copper {first} to {last}"
    name, fpc = layout.spec.name, layout.spec.fpc
    (extent,) = body_files(name, fpc)
    step = notes.step_text(fpc, layout.vias, layout.lap_start)
    return (
        f"beyond x = {show(layout.body[2], 'm')} the board has only its first "
        f"{count_text(first - 1, 'copper layer')}: {lower} and what lies between end there (file {extent.name}); the "
        f"tail is {show(sum(layer.thickness for layer in layout.spec.fpc.tail_layers), 'm')} thick. "
        + "".join(f"{step} (File {file.name}.) " for file in tail_coverlay_files(name, fpc))
        + "Holes in the tail go through its own layers only and have a drill file of their own."
    )


def _hole_text(fpc: FpcSpec, vias: tuple[Via, ...], spans: str) -> str:
    if not vias:
        return "none"
    sizes = sorted({(round(via.drill, 9), round(via.pad, 9)) for via in vias})
    counts = [sum((round(v.drill, 9), round(v.pad, 9)) == size for v in vias) for size in sizes]
    kinds = (f"{n} of {show(drill, 'm')} (pad {show(pad, 'm')})" for n, (drill, pad) in zip(counts, sizes, strict=True))
    plating = fpc.stackup.plating_thickness
    least = plating - usual_tolerances()["copper plating"].band
    thick = f"; copper in the holes {show(plating, 'm')} nominal, at least {show(least, 'm', 2)}" if least > 0.0 else ""
    is_classed = thick and not fpc.rules.one_process
    thick += " (this governs, also where the class below asks for more)" if is_classed else ""
    return (
        f"{', '.join(kinds)}, plated, finished diameters; {spans}; no pins or wires go "
        f"into them: a hole may be smaller if annular ring and plating are kept{thick}"
    )


def _ipc_type(layers: int, tail: Tail | None, vias: tuple[Via, ...]) -> str:
    """Return type and use of a flexible board by IPC-6013, section 1.3.

    Type 5 has several layers but no plated holes.
    """
    kind = 1 if layers == 1 else 5 if not vias else 2 if layers == 2 else 3
    is_dynamic = tail is not None and tail.bend == "dynamic"
    return f"type {kind}, use {'B (flexes in use)' if is_dynamic else 'A (bent at installation)'}"


def _contact_text(layout: Layout) -> str:
    tail = layout.spec.fpc.tail
    assert tail is not None
    connector = tail.connector
    nominal = connector.insertion_thickness
    allowed, where = connector.insertion_thickness_tolerance, notes.thickness_text(layout, Where.CONTACT)
    closer, usual = "", layout.spec.fpc.rules.outline_tolerance
    if end_tolerance(layout.spec.fpc) < usual - 1e-9:
        closer = (
            f" (closer than the outline's +/- {show(usual, 'm')}: cut by laser, or by a punch of its own; to be "
            f"confirmed, or every board is measured before it is plugged in)"
        )
    thickness = finished_thickness(layout, Where.CONTACT)
    total = notes.contact_sum_text(layout.stiffener, contact_copper(layout), layout.spec.fpc.tail_copper, thickness)
    text = (
        f"{connector.name}: {contact_text(layout.pads, layout.spec.fpc.stackup, layout.top_openings)}; "
        f"{plug_text(layout.pads, layout.spec.fpc)}{closer}; thickness at the contacts {where}; this total governs, "
        f"and the stiffener is chosen for it: {total}"
    )
    if abs(thickness.nominal - nominal) > allowed + 1e-9:
        return text + ": THIS IS OUT OF TOLERANCE, change the stiffener before making the board"
    unseen = [field.replace("_", " ") for field, _, _ in unverified_rows("connector", connector.name)]
    return f"{text}; to be compared with the connector's drawing: {', '.join(unseen)}" if unseen else text


def _rule_text(layers: tuple[int, ...], fpc: FpcSpec) -> str:
    rules = fpc.rules
    checked = f", read on {rules.checked_on}" if rules.checked_on else ""
    # Validity of the rules' widths, if the copper is thicker than in all their rows
    foil = fpc.stackup.line_foil(layers)
    thickest = max((row.copper for row in rules.track_lines), default=foil)
    beyond = f"; these widths are for copper up to {show(thickest, 'm')}, not for {show(foil, 'm')}"
    beyond = beyond if foil > thickest + 1e-9 else ""
    # Rules without a page as source, for the fabricator to confirm
    named = {"hole_to_hole": "from hole to hole", "drill_to_copper": "from hole to copper", "trace_width": "track",
             "trace_spacing": "gap", "via_drill": "hole", "annular_ring": "ring", "copper_to_edge": "copper to edge",
             "outline_tolerance": "outline", "registration": "register",
             "coverlay_registration": "coverlay's register"}
    doubts = [
        f"{word} {show(getattr(rules, field), 'm')}" for field, word in named.items() if is_unverified(rules, field)
    ]
    unseen = f"; not verified, tell us if yours are larger: {', '.join(doubts)}" if doubts else ""
    return (
        f"{rules.name} (track {show(rules.trace_width, 'm')}, gap {show(rules.trace_spacing, 'm')}, "
        f"hole {show(rules.via_drill, 'm')}, ring {show(rules.annular_ring, 'm')}){checked}{beyond}{unseen}"
    )


def _layer_rows(copper_layers: int, fpc: FpcSpec, vias: tuple[Via, ...]) -> Iterator[tuple[str, str]]:
    stackup = fpc.stackup
    for layer, name in zip(stackup.layers, stack_names(copper_layers, fpc.stackup.layers), strict=True):
        layer_text = notes.copper_text(stackup, layer) if layer.kind is LayerKind.COPPER else notes.layer_text(layer)
        yield show(layer.thickness, "m"), f"{name}, {layer_text}" if layer.material != name else layer_text
    yield from ((f"Bond, {where}", text) for where, text in notes.bond_texts(stackup).items())
    if vias and stackup.plating_thickness and not fpc.rules.one_process:
        yield "Plating", f"{notes.plating_text(stackup)}. The copper above is finished, foil and plating together"
    if vias and stackup.plating is Plating.BUTTONS:
        rings = show(min((via.pad - via.drill) / 2 for via in vias), "m")
        high = show(stackup.covers[0][2].thickness + stackup.plating_thickness, "m")
        yield "Buttons", (
            f"pads at holes come to {high}, tracks and contacts stay foil. The resist for the buttons is yours to make "
            f"from the drill files; rings are {rings} wide: tell us if it needs wider ones, or if your coverlay does "
            "not fill round pads of that height"
        )
    for field, value, source in dict.fromkeys(unverified_rows("stackup", stackup.name)):
        yield "To confirm", f"{field}, {value}: {source}" if field != "note" else source
    for side, layer, copper in stackup.covers:
        if layer.material != MASK:
            has = f"{show(layer.adhesive, 'm')} thick" if layer.adhesive else "of a thickness that is not stated"
            yield "To confirm", (
                f"{side} coverlay: adhesive {has}, at least {show(least_adhesive(copper.thickness), 'm', 3)} to fill "
                f"{show(copper.thickness, 'm')} of copper (25 um an ounce); tell us before you lay another film, since "
                "thickness, contacts and bends change with it"
            )
    if any(has_coverlay(stackup)):
        masks = {layer.material == MASK for layer in stackup.layers if layer.kind is LayerKind.COVERLAY}
        layer_text = "solder mask" if masks == {True} else "film and adhesive together"
        if len(masks) > 1:
            layer_text = "film (with its adhesive) on one side, solder mask on the other"
        closed = "a file without openings means that this side is covered completely"
        yield cover_name(stackup).capitalize(), f"{layer_text}; {closed}"


def _care_rows(copper_layers: int, stackup: Stackup) -> Iterator[tuple[str, str]]:
    yield "Copper", (
        "The coils are the function of this board: add no copper inside the outline (no thieving, fill, marks, test "
        "coupons or closed rings), remove none, add no teardrops."
    )
    wide = usual_tolerances()["trace width"].band
    yield "Tracks", (
        "Width and copper thickness set the coils' resistance. Widths in the files are those of the finished tracks, "
        f"which may be off by {show(100.0 * wide, '%')}: compensate the artwork for your etching process as usual."
    )
    if copper_layers > 1:
        film = "laminate" if is_rigid(stackup) else "film"
        yield "Dielectric", (
            f"The thickness between copper layers sets the coils' inductance: do not replace the {film} by another."
        )
    yield "Registration", "Layers lie on each other as drawn; no layer is mirrored, all are seen from the top."
    yield "Metal", "No magnetic or conducting part (steel stiffener, shielding film) on or under the coils."


def _test_rows(layout: Layout, bench: Estimates | None) -> Iterator[tuple[str, str]]:
    pins = "; ".join(
        f"{net}: {', '.join(str(pad.number) for pad in layout.pads if pad.net == net) or 'no contact'}"
        for net in layout.nets
    )
    if not layout.spec.fpc.rules.one_process:
        yield "Bare board", "100 % continuity and isolation by the IPC-D-356A netlist"
    more = "" if layout.thermistor is None else f" and two of {layout.thermistor.reference}"
    yield "Nets", (
        f"{len(layout.nets)}, one a coil{more}; the contacts of one coil are joined through its winding ({pins})")
    if layout.reference is not None:
        like = "as the others" if layout.reference.placement.own is None else "of its own windings"
        yield "Reference", f"{layout.reference.name} is a coil {like}; no target covers it in the sensor"
    layers = sorted({trace.layer for trace in layout.traces if trace.net})
    covers = cover_name(layout.spec.fpc.stackup) if any(has_coverlay(layout.spec.fpc.stackup)) else ""
    inner = [str(number) for number in layers if 1 < number < layout.copper_layers]
    outer = f"{'the outer copper ' if inner else ''}before the {covers} is laid" if covers else ""
    when = ", ".join(filter(None, [f"copper {', '.join(inner)} before lamination" if inner else "", outer]))
    yield "Inspection", (
        f"optical, of the coils on {'each copper layer' if len(layers) > 1 else 'the copper'} after its etching"
        f"{f' ({when})' if when else ''}: a short between turns of one coil is within one net, so "
        "tests of continuity and isolation do not find it"
    )
    limits = []
    for read in bench.metered if bench else ():
        ends = (read.direct + side * ACCEPTED_SIGMAS * read.direct_sigma for side in (-1.0, 1.0))
        low, high = (show(max(end, 0.0), "ohm", 3) for end in ends)
        limits.append(f"{read.coil} {show(read.direct, 'ohm', 3)} ({low} to {high})")
    if limits:
        warming = 100.0 * conductor("copper").temperature_coefficient
        yield "Resistance", (
            f"to direct current between the contacts of each coil, at 20 degC: {', '.join(limits)}. Reject boards "
            "outside of these limits. Measure with four wires, or take off the leads' own resistance; copper reads "
            f"{warming:.2f} % more per kelvin above 20 degC. Send the readings along"
        )


def _file_rows(name: str, images: Iterable[tuple[str, str]], panel: Panel | None) -> Iterator[tuple[str, str]]:
    """Yield name and description of the board's files in the archive."""
    if panel is None:
        yield from images
    else:
        readme, drawing = (_panel_name(name, ending) for ending in ("-readme.txt", "-drawing.pdf"))
        yield readme, f"list of the panel's files, from which the boards are made; its drawing is {drawing}"
    yield _name(name, "netlist.d356"), "netlist for the bare-board test (IPC-D-356A, micrometres)"
    yield _name(name, "drawing.pdf"), "drawing with dimensions; contacts and their table on the second page"
    yield _name(name, "stackup.pdf"), "drawing of the stack-up"
    yield "Coordinates", "millimetres, one origin for all files" if panel is None else (
        "millimetres, one origin for all files of the board; the panel's files have their own")


def _image_rows(layout: Layout) -> Iterator[tuple[str, str]]:
    """Yield name and description of images, drill files and job file of the single board."""
    drills = drill_files(layout.copper_layers, layout.spans, layout.spec.name)
    yield from (file.row for file in (*gerber_files(layout.spec.name, layout.spec.fpc, layout.stiffener), *drills))
    yield _name(layout.spec.name, "job.gbrjob"), "Gerber job file: the stack-up and the list of files for CAM"
    if layout.vias:
        yield _name(layout.spec.name, "Drill_Map.gbr"), "drill map (Gerber drawing)"


def _unsent_file_rows(name: str, images: Iterable[tuple[str, str]], panel: Panel | None) -> Iterator[tuple[str, str]]:
    """Yield name and description of the files that stay in the package, and of the archive itself."""
    yield _name(name, "order.zip"), "the archive that is sent, with this text; files have the fabricator's names"
    if panel is not None:
        yield "panel", "folder of the panel's files, which are in the archive"
        yield from images
    yield _name(name, "board.svg"), "picture of the whole board"
    yield _name(name, "body.svg"), "picture of the part with the coils"
    yield "Drawings", "also as SVG"


def _name(name: str, ending: str) -> str:
    return fabrication_path(name, ending).rpartition("/")[2]
