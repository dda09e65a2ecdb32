"""How the sensor is put together, for a reader who has the package alone."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache

import handmade
import pytest
from tolerance import approx

import sitscad
from sitscad.assembly import solids as parts
from sitscad.assembly.places.bodies import plates_of, top_height
from sitscad.assembly.places.column import column, layer_heights, layers_on_board, placement_tolerance, sealed_height
from sitscad.assembly.places.fit import closed_section
from sitscad.assembly.places.jaws import jaw_range, jaw_section
from sitscad.assembly.places.seating import cap_size, is_near_metal, plate_floor, plate_holes, screw_spacing, stop_place
from sitscad.assembly.places.tail_path import ROD, bending_rod_start, bends
from sitscad.assembly.solids import tooling
from sitscad.basics.quantities import FREQUENCY, plus_minus
from sitscad.basics.units import show
from sitscad.checks.findings import as_json, as_text
from sitscad.checks.findings.document import read_findings
from sitscad.estimates.design import Design
from sitscad.estimates.loads.gluing import (
    HARD_HANDLING,
    MOST_PRESSURE,
    board_plan,
    board_press,
    hard_adhesive,
    spreading_time,
)
from sitscad.files.documents import assembly_notes, firmware_driver, parts_list
from sitscad.files.documents.assembly_notes import WIDTH, render
from sitscad.files.documents.gluing import line_areas, toleranced_text
from sitscad.files.documents.mounting import LENGTHS, sensor_mounting_steps
from sitscad.files.documents.piece_places import piece_sizes
from sitscad.files.documents.preparing import STAGE_OF, is_missing_list_right
from sitscad.files.writer import Package
from sitscad.kernels.geometry.path import bounding_box
from sitscad.package.contents import incoming_tests
from sitscad.package.inspection import as_configured
from sitscad.spec import presets, templates
from sitscad.spec.load import rewritten_spec
from sitscad.spec.mount import StepPart

SENSOR = Design(sitscad.load_text(templates.read("grasper_4layer"), "t.yaml"))
GRASPER = SENSOR.layout
MOUNTED = [name for name in templates.names() if sitscad.load_text(templates.read(name), "t.yaml").mount is not None]


def text(layout) -> str:
    """The page of a layout, with the figures of the grasper: what is glued to what does not hang on them."""
    return assembly_notes.instructions(layout, SENSOR.estimates, incoming_tests(SENSOR).board)


def in_one_line(layout) -> str:
    return re.sub(r"\s+", " ", text(layout))


def in_order(said: str, *words: str) -> bool:
    places = [said.find(each) for each in words]
    return -1 not in places and places == sorted(places)


def test_assembly_steps_are_numbered_and_fit_page_width():
    lines = text(GRASPER).splitlines()
    numbers = [int(result[1]) for line in lines if (result := re.match(r" ?(\d+)\. ", line))]
    assert numbers and numbers == list(range(1, len(numbers) + 1))
    assert max(map(len, lines)) <= WIDTH


def test_listed_layers_add_up_to_closed_pair_height():
    rows = re.findall(r"^  ([a-z -]+?) +([\d.]+) \+-([\d.]+) mm(?:  unverified)?$", text(GRASPER), re.M)
    assert sum(float(size) for _, size, _ in rows) == approx(closed_section(GRASPER).height * 1e3, abs=1e-6)


def test_unverified_jaw_and_metals_are_marked_in_notes():
    message = text(GRASPER)
    marked = re.findall(r"^  ([a-z -]+?) +[\d.]+ \+-[\d.]+ mm  unverified$", message, re.M)
    assert marked == ["jaw", "opposing-jaw"]
    assert "the port has 5 mm (the jaw's figures are unverified: measure yours)" in in_one_line(GRASPER)
    assert "lean on unverified" not in in_one_line(GRASPER), "copper and 304 are"
    brass = GRASPER.spec.replace("target.material", "brass").replace(
        "mount.jaw", {"based_on": "generic-5mm", "height": "1.3 mm"}
    )
    measured = sitscad.lay_out(brass)
    assert "They lean on unverified figures of metals near the coils: brass." in in_one_line(measured)
    assert not re.findall(r"^  jaw .*unverified$", text(measured), re.M)


def test_weight_table_lists_heaviest_pieces_with_unverified_densities():
    pieces = [
        {"name": "mount", "is_carrier": False, "material": "resin", "mass_kg": 6e-5, "copper_m3": 0.0,
         "density_source": "unverified: from memory"},
        *({"name": name, "is_carrier": False, "material": material, "mass_kg": 3.5e-6, "copper_m3": 1e-10,
           "density_source": "the maker's data sheet"}
          for name, material in (("tail-2-fill", "adhesive"), ("copper-1-C1", "copper"))),
        *({"name": f"target-{k}", "is_carrier": False, "material": "copper", "mass_kg": 1e-6, "copper_m3": 0.0,
           "density_source": "the maker's data sheet"} for k in (1, 2)),
    ]
    sensor = {"mass_kg": 6.7e-5, "centre_m": [0, 0, 0], "not_weighed": []}
    files = {"mount/assembly.json": json.dumps({"sensor": sensor, "pieces": pieces}).encode()}
    (content,) = render(
        GRASPER, SENSOR.estimates, incoming_tests(SENSOR).board, "", Package(files, frozenset(STAGE_OF.values())),
    ).values()
    rows = [" ".join(row.split()) for row in content.decode().splitlines()[-4:]]
    assert rows[0] == "mount resin 60 mg *" and rows[1] == "board films and copper 7 mg"
    assert rows[2] == "2 targets copper 2 mg" and rows[3] == "* its density is unverified"


@pytest.mark.slow
def test_every_named_jig_piece_is_built():
    from sitscad.assembly.solids import assembly_aids

    named = set(re.findall(r"(jig-[a-z-]+|mould-[a-z]+)", text(GRASPER).replace("\n    ", " ")))
    assert named <= {solid.name for solid in assembly_aids(GRASPER)}


test_every_named_jig_piece_is_built = pytest.mark.cad(test_every_named_jig_piece_is_built)


def test_bench_plate_notes_mention_no_jaw():
    bench = sitscad.lay_out(sitscad.load_text(templates.read("bench_7mm"), "t.yaml"))
    message = text(bench)
    assert "M2 x 6 screws" in message and "port" not in message and "jaw" not in message


@pytest.mark.parametrize("template", ["bench_7mm", "fingertip_foil", "round_button_12mm"])
def test_each_gluing_step_states_resulting_height(template):
    """Only sensors in jaws had the heights that docs/assembling.md promises."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read(template), "t.yaml"))
    spec, message = layout.spec, in_one_line(layout)
    line, board = spec.assembly.glue_line, spec.fpc.stackup.thickness
    to_pad = line + spec.elastomer.thickness
    for words, height in (
        ("The upper face of the elastomer is then", to_pad),
        ("The upper face of the target is then", to_pad + line + spec.target.thickness),
        ("to the board's top face are", spec.mount.standoff + line + board),
    ):
        assert f"{words} {1e3 * height:.3f} +-" in message


def test_weight_text_states_mass_of_mount():
    """A fingertip "without what carries it" weighed 6.2 g, 5.6 g of it the mount."""
    pieces = [{"name": name, "is_carrier": False, "material": "steel", "mass_kg": mass, "copper_m3": 0.0,
               "density_source": "x"} for name, mass in (("mount", 5e-3), ("mount-spacer", 1e-3), ("target", 1e-3))]
    content = {"sensor": {"mass_kg": 7e-3, "centre_m": [0.0, 0.0, 0.0], "not_weighed": []}, "pieces": pieces}
    message = " ".join(assembly_notes._mass_lines(json.dumps(content).encode()))
    assert message.startswith("The sensor with its mount (6 g of it) weighs 7 g;")
    carried = content | {"pieces": [*pieces, pieces[0] | {"name": "jaw", "is_carrier": True}]}
    message = " ".join(assembly_notes._mass_lines(json.dumps(carried).encode()))
    assert message.startswith("The sensor with its mount (6 g of it), without the jaws, weighs 7 g;")


def test_notes_are_absent_without_mount_and_mould_without_pad():
    bare = handmade.bare()
    assert render(bare, SENSOR.estimates, incoming_tests(SENSOR).board, "", {}) == {}
    none = replace(GRASPER, spec=replace(GRASPER.spec, elastomer=None))
    assert "mould-" not in text(none) and "jig-elastomer" not in text(none)


NANO = "{kind: bench-plate, holes: ati-nano17}"
FINGER = "{kind: fingertip}"
OWN = "{kind: custom}"


@pytest.mark.parametrize(
    ("template", "mount", "words"),
    [
        ("bench_7mm", "bench-plate", ("M2 x 6 screws", "tail in the slot")),
        ("bench_7mm", NANO, ("mount-adapter", "3 screws", "M2 nuts")),
        ("bench_7mm", FINGER, ("Tap both holes", "set screws of plastic")),
        ("bench_7mm", OWN, ("your own mount",)),
        ("grasper_4layer", "dovetail", ("Mill the dovetail's groove", "slides in from the tip")),
        ("grasper_4layer", "pins", ("Drill two holes of 1.31 mm", "Glue the tail down")),
    ],
)
def test_notes_describe_fastening_of_each_mount(template, mount, words):
    from sitscad.spec.load import rewritten_spec
    from sitscad.spec.yaml.source import read_yaml

    spec = sitscad.load_text(templates.read(template), "t.yaml")
    if mount in ("dovetail", "pins"):
        spec = spec.replace({"mount.retention": mount, "shield": None})
    elif mount.startswith("{"):
        spec = rewritten_spec(spec, [("mount", read_yaml(mount).data)])
    message = re.sub(r"\s+", " ", text(sitscad.lay_out(spec)))
    assert all(word in message for word in words), message


def test_thick_film_is_cast_and_thin_film_is_brushed():
    assert "brushed on: mix" in re.sub(r"\s+", " ", text(GRASPER))
    thick = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace("encapsulation.thickness", "0.4 mm")
    message = re.sub(r"\s+", " ", text(sitscad.lay_out(thick)))
    assert "mould-skin" in message and "5 ml" in message


@pytest.mark.parametrize("changes", [{}, {"encapsulation.thickness": "0.4 mm"}, {"mount": {"kind": "custom"}}])
def test_notes_state_height_with_film(changes):
    """The notes gave heights of pad and target, and none of the finished face."""
    spec = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace(changes)
    layout = sitscad.lay_out(spec)
    pieces = layer_heights(layers_on_board(layout))
    sealed = sealed_height(layers_on_board(layout), spec.encapsulation, spec.assembly)
    film = sealed - (pieces["target"][1] - pieces["board"][1])
    assert film.nominal == approx(spec.encapsulation.thickness, rel=1e-9) and film.spread > 0.0
    assert toleranced_text(sealed) in in_one_line(layout)
    if spec.jaw is not None:
        at = layer_heights(column(layout))
        assert toleranced_text(at["encapsulation"][1] - at["board"][1]) == toleranced_text(sealed)


def test_film_is_cast_before_board_leaves_jig():
    thick = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace("encapsulation.thickness", "0.4 mm")
    message = in_one_line(sitscad.lay_out(thick))
    assert in_order(message, "on the foot of jig-target-press", "Cast the skin", "Push the board out")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("template", "changes", "made"),
    [
        ("bench_7mm", {}, "Make the mount and the jig from"),
        ("bench_7mm", {"mount": {"kind": "custom"}}, "Make the jig from"),
        ("bench_7mm", {"mount": {"kind": "custom"}, "target": None, "elastomer": None}, ""),
        ("single_coil", {"mount": {"kind": "bench-plate"}}, "Make the mount from"),
        ("jaw_5x20", {"mount.standoff": 0, "shield": None}, "Make the jig from"),
    ],
)
def test_notes_make_only_pieces_of_package(template, changes, made):
    """With a mount of one's own the first step made one from mount/, where none is."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read(template), "t.yaml").replace(changes))
    message, names = in_one_line(layout), {each.name for each in (*parts.solids(layout), *parts.assembly_aids(layout))}
    assert (made in message) if made else "Make the" not in message
    assert ("the mount" in made) == ("mount" in names) and ("the jig" in made) == ("jig-base" in names)
    assert ("Wax the jig" in message) == ("keep the feet of its presses clean" in message) == ("jig-base" in names)


KINDS = ("fingertip_cell", "grasper_4layer", "racetrack_jaw", "square_bench")
"""A template of each kind of mount."""


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    "template", [pytest.param(n, marks=() if n in KINDS else (pytest.mark.slow, pytest.mark.more)) for n in MOUNTED]
)
def test_assembly_steps_agree_with_solids_of_pieces(template):
    """`jaw_5x20` was pushed against a stop that it has not, and glued over 3 mm to 0.13 mm of metal."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read(template), "t.yaml"))
    message, spec = in_one_line(layout), layout.spec
    pieces = {each.name: each for each in (*parts.solids(layout), *parts.assembly_aids(layout))}
    assert set(re.findall(r"(?:jig|mould)-[a-z]+(?:-press)?|mount-[a-z]+", message)) - {"mount-spacer"} <= set(pieces)
    mount = pieces["mount"].shape.bounding_box()
    has_stop = spec.mount.jaw is not None and layout.body[0] - 0.3e-3 > 1e-3 * mount.min.X
    assert ("against the stop itself" in message) == has_stop
    wide = layout.body_size[1] + 0.5e-3 < 1e-3 * (mount.max.Y - mount.min.Y)
    assert ("between the ledges" in message) == (spec.mount.jaw is not None and wide)
    if result := re.search(r"on the mount's tongue behind the body, over ([0-9.]+) mm", message):
        flat = [face.bounding_box() for face in pieces["mount"].shape.faces() if face.geom_type.name == "PLANE"]
        ends = [1e-3 * box.max.X for box in flat if box.size.Z < 1e-6 and layout.body[2] + 0.5e-3 < 1e-3 * box.max.X]
        assert any(end - layout.body[2] == approx(1e-3 * float(result[1]), abs=1e-5) for end in ends)
    if result := re.search(r"metal from ([0-9.]+) mm behind the body on, over at least ([0-9.]+) mm", message):
        heel = 1e-3 * pieces["jaw"].shape.bounding_box().max.X
        assert heel - layout.body[2] - 1e-3 * float(result[1]) >= 1e-3 * float(result[2])
    assert ("tail in the slot" in message) == (spec.fpc.tail is not None)
    assert spec.mount.jaw is not None or "under the board's whole body" in message


def test_tail_is_glued_after_board_and_before_sealing():
    message = in_one_line(GRASPER)
    assert in_order(
        message, "the shield with", "the mount with", "Glue the board on", "Glue the tail down with",
        "Seal board",
    )


def test_bare_board_is_tested_first_and_sensor_last():
    said, coil = in_one_line(GRASPER), incoming_tests(SENSOR).board.coils[0]
    free, rest = (FREQUENCY.shown(coil.states[name].frequency).split()[0] for name in ("free", "rest"))
    direct = show(coil.terminal_resistance_dc, "ohm", 4).split()[0]
    assert in_order(
        said, "Test the bare board", direct, free, "jig-elastomer on", "Plug the tail", "Measure each coil again", rest
    )


def table_below(words):
    """Rows of the table below the step that begins with some words, each by its first cell."""
    _, _, after = text(GRASPER).partition(words)
    lines = [line.strip() for line in after.partition("\n\n")[0].splitlines()]
    (head,) = (k for k, line in enumerate(lines) if line.startswith("coil  "))
    return {row[0]: row[1:] for row in (re.split(r"\s{2,}", line) for line in lines[head:])}


def test_each_test_value_has_its_instrument():
    """An inductance without the coil's capacitance, which no instrument reads, stood first in every line."""
    bench = incoming_tests(SENSOR).board
    bare, finished = table_below("Test the bare board"), table_below("Measure each coil again")
    for coil, read in zip(bench.coils, bench.metered, strict=True):
        free, rest = coil.states["free"], coil.states["rest"]
        *_, inductance, resistance, frequency = bare[coil.name]
        assert inductance.startswith(show(read.inductance, "H", 4)) and frequency.startswith(
            show(free.frequency, "Hz", 4).split()[0])
        assert resistance.startswith(show(read.resistance, "ohm", 4).split()[0])
        assert finished[coil.name][1:] == [
            show(rest.converter_inductance, "H", 4), show(rest.apparent_inductance, "H", 4)]
        assert show(free.inductance, "H", 4) not in " ".join(bare[coil.name])
    assert len(bare["coil"]) == len(bare["C1"]) and "100 kHz" in bare["coil"][2] + bare["coil"][1]


def test_bare_board_drive_code_stays_below_amplitude_limit():
    """What was a note of every check of an assembled sensor stands here, and in the report."""
    (lines,) = re.findall(r"use drive code (\d+) for the bare board; the assembled sensor has 27", in_one_line(GRASPER))
    bare = [coil.states["free"].parallel_resistance for coil in incoming_tests(SENSOR).board.coils]
    device = SENSOR.spec.readout.device
    assert device.amplitude(max(bare), int(lines)) < device.limit("amplitude_max") < device.amplitude(max(bare), 27)


def test_bare_board_table_has_meter_inductance_with_sigma():
    rows = table_below("Test the bare board")
    for read in incoming_tests(SENSOR).board.metered:
        assert plus_minus(read.inductance, read.inductance_sigma, "H", digits=4) in rows[read.coil]


def test_equal_drive_code_for_bare_and_assembled_board_is_stated_once():
    """Use drive code 25 for the bare board; the assembled sensor has 25, it said."""
    used = str(SENSOR.estimates.readout.drive_code)
    message = firmware_driver.bare_drive_text(SENSOR.layout.spec.readout.device, SENSOR.estimates.readout, int(used))
    assert message.endswith(f"use drive code {used} for the bare board as for the assembled sensor.")


def test_resin_is_sealed_before_casting_but_filament_is_not():
    assert in_order(in_one_line(GRASPER), "may not cure on raw photopolymer", "try a drop first", "Cut the elastomer")
    filament = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace("mount.process", "filament")
    assert "photopolymer" not in in_one_line(sitscad.lay_out(filament))


def test_pad_is_primed_only_for_glue_that_needs_primer():
    message = in_one_line(GRASPER)
    assert in_order(
        message, "Wipe Loctite 770 once and thinly on the elastomer's upper and lower face", "Let it dry before",
        "mm3 (microlitres; a bead 1.0 mm across) of Loctite",
    )
    tough = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace(
        "assembly.adhesive", "silicone-adhesive"
    )
    assert "Wipe Loctite" not in in_one_line(sitscad.lay_out(tough)) and re.search(
        "Glue the tail down with [^:]*Sil-Poxy", in_one_line(sitscad.lay_out(tough)))


@pytest.mark.parametrize("template", ["grasper_4layer", "bench_7mm", "three_axis_triangle"])
def test_contact_1_is_at_left_edge_along_tail(template):
    layout = sitscad.lay_out(sitscad.load_text(templates.read(template), "t.yaml"))
    pads = sorted(layout.pads, key=lambda pad: pad.number)
    first, last = pads[0].centre, pads[-1].centre
    ahead = ((first.x + last.x) / 2 - layout.body[2], (first.y + last.y) / 2)
    assert ahead[0] * (first.y - last.y) - ahead[1] * (first.x - last.x) > 0.0
    if layout.spec.mount is not None:
        assert f"contact 1 ({pads[0].pin}) is at the left edge" in in_one_line(layout)


def test_forced_package_without_solids_has_assembly_steps():
    """Where pieces cannot be put together nothing is weighed, and a build with --force ended in a KeyError."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read("grasper_3p5mm")))
    estimates = sitscad.estimate(layout)
    (text,) = render(layout, estimates, estimates, "", Package({}, frozenset())).values()
    assert b" 1. " in text and b"weighs" not in text


def test_mount_without_pocket_gets_alignment_instructions():
    """A reader of the package alone had to guess how the mount is squared on the jaw, and where the pictures are."""
    pages = {}
    for jaw in ("generic-5mm", "toothless-5mm"):
        spec = sitscad.load_text(JAW.format(jaw=jaw, tail=", tail: {length: 40}"), "jaw.yaml")
        layout = sitscad.lay_out(spec)
        result = sitscad.estimate(layout)
        pages[jaw] = " ".join(assembly_notes.instructions(layout, result, result).split())
        assert "mount/assembly.svg shows the pieces apart, mount/placed-jaw-drawing.pdf the closed pair" in pages[jaw]
        assert "its tank's capacitor of" in pages[jaw] and " 30 deg down" in pages[jaw]
    assert "straight waxed strips upright against the jaw's sides" in pages["generic-5mm"]
    assert "waxed strips" not in pages["toothless-5mm"]  # its pocket places the mount
    bare = sitscad.lay_out(sitscad.load_text(JAW.format(jaw="generic-5mm", tail=""), "jaw.yaml"))
    assert "the tail" not in " ".join(text(bare).split()).replace("the tail's bend", "")


JAW = """
sitscad: 1
name: placed
coil: {{shape: circle, outer_diameter: 3, turns: 6, layers: 4, trace_width: 80 um, trace_spacing: 80 um}}
fpc: {{stackup: flex-4l{tail}}}
target: {{shape: circle, size: 3, thickness: 0.1, material: copper}}
elastomer: {{shape: circle, size: 3, thickness: 0.5, material: dragon-skin-10}}
mount: {{kind: grasper-pad, jaw: {jaw}, standoff: 0.5}}
"""


@pytest.mark.slow
def test_plate_is_screwed_down_after_bending_and_sealing():
    """Nothing is dipped, and no rod of 11 mm lies under a tail, once the plate is screwed to a bench."""
    said = in_one_line(sitscad.lay_out(sitscad.load_text(templates.read("round_button_12mm"), "t.yaml")))
    assert in_order(said, "Glue the board into", "Bend the tail", "Seal board", "Screw the mount down", "Plug the tail")
    (far,) = re.findall(r"must end ([0-9.]+) mm behind the body", said)
    layout = sitscad.lay_out(sitscad.load_text(templates.read("round_button_12mm"), "t.yaml"))
    assert float(far) <= 1e3 * (bends(layout)[0].start - layout.body[2]) + 0.01
    cap = in_one_line(sitscad.lay_out(sitscad.load_text(templates.read("fingertip_cell"), "t.yaml")))
    assert in_order(cap, "Tap both holes", "Bend the tail", "Slip the cap", "Plug the tail")


def test_board_is_cut_from_panel_before_test():
    spec = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml")
    assert "coupons" not in in_one_line(sitscad.lay_out(spec))
    message = in_one_line(sitscad.lay_out(spec.replace("fpc.panel", {"parts": [1, 2]})))
    assert in_order(message, "cut the board out", "grasper-4layer-panel-readme.txt", "Test the bare board")


def test_custom_mount_notes_state_height_over_metal_behind():
    metal = {"material": "aluminium", "distance": "3 mm", "thickness": "4 mm"}
    spec = sitscad.load_text(templates.read("fingertip_foil"), "t.yaml").replace(
        {"mount": {"kind": "custom", "metal_behind": metal}})
    message = in_one_line(sitscad.lay_out(spec))
    assert "your own mount" in message and "3 mm above the aluminium" in message and "4 mm thick" in message


PIECES = Package({
    "mount/print.json": json.dumps({"pieces": [
        {"piece": name, "size_m": [0.01, 0.02, 0.003]} for name in ("mount", "jig-target-press", "mould-lid")
    ]}).encode(),
    "mount/grasper-4layer-jaw.stl": b"",
}, frozenset({"mount", "assembly"}))
"""What `--only mount` writes of a grasper, as far as the steps read it."""


def test_every_piece_to_make_is_listed_with_size_and_use():
    message = assembly_notes.instructions(GRASPER, SENSOR.estimates, incoming_tests(SENSOR).board, PIECES)
    rows = {line.split()[0]: line for line in message.partition(" 1. ")[0].splitlines() if line.startswith("  ")}
    assert {"mount", "jig-target-press", "mould-lid", "jaw"} <= set(rows)
    assert all("10.0 x 20.0 x 3.0" in row for name, row in rows.items() if name in ("mount", "mould-lid"))
    assert "not made" in rows["jaw"] and "stays" in rows["mount"]
    assert max(map(len, message.splitlines())) <= WIDTH


@pytest.mark.parametrize(("stages", "lacks"), [
    ({"gerber", "laser", "firmware", "report"}, []), ({"laser"}, ["gerber", "firmware", "report"])])
def test_files_missing_from_package_have_their_build_command(stages, lacks):
    """`--only mount` writes steps that name bom.csv, laser/ and fpc/, and nothing said where those are."""
    package = Package(PIECES.files, PIECES.stages | stages)
    (content,) = render(GRASPER, SENSOR.estimates, incoming_tests(SENSOR).board, "", package).values()
    assert re.findall(r"--only\s+([a-z]+)", content.decode()) == lacks
    text = content.decode()
    assert is_missing_list_right(text, package.stages) and not is_missing_list_right(text, frozenset({"firmware"}))


def test_cast_pad_notes_state_mixing_ratio_cure_time_and_release():
    message = in_one_line(GRASPER)
    known = presets.casting("dragon-skin-10")
    assert known.mix in message and f"cure for {known.cure_time / 3600:.2g} h" in message and "mould release" in message
    other = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace("elastomer.material", "mold-star-16")
    message = in_one_line(sitscad.lay_out(other))
    assert presets.casting("mold-star-16") is None and "maker's sheet" in message and "cure time" in message


def test_plate_screws_have_engaging_length():
    for name in ("bench_7mm", "three_axis_grid"):
        layout = sitscad.lay_out(sitscad.load_text(templates.read(name), "t.yaml"))
        (length,) = map(float, re.findall(r"M2 x ([0-9.]+) screws", in_one_line(layout)))
        engaged = 1e-3 * length + plate_floor(layout)[1]
        assert length in LENGTHS and 3e-3 <= engaged < 7e-3


@pytest.mark.parametrize(("holes", "said"), [
    ("ati-nano17", "M2 x 6 screws (ISO 4762) reach 1.2 mm"), ("ati-mini40", "M2 x 8 screws (ISO 4762), cut to 7.6 mm"),
    ("breadboard-m6-25mm", "M6 x 16 screws"), ("breadboard-quarter-inch", "1/4-20 screws are longer"),
    ([{"at": [20, 0]}, {"at": [-20, 0]}], "the screws are longer"),
])
def test_screws_of_every_hole_pattern_have_length(holes, said):
    spec = sitscad.load_text(templates.read("bench_7mm"), "t.yaml")
    mounted = rewritten_spec(spec, [("mount", {"kind": "bench-plate", "holes": holes})])
    assert said in " ".join(sensor_mounting_steps(sitscad.lay_out(mounted)))


def test_finger_cap_notes_state_outer_width():
    layout = sitscad.lay_out(sitscad.load_text(templates.read("fingertip_cell"), "t.yaml"))
    width, side = cap_size(layout.body, layout.spec.mount)
    finger = layout.spec.mount.finger
    assert width > finger.size[0] + 2 * 1.5 * finger.screw and side >= 1.5 * finger.screw
    (message,) = re.findall(r"Slip the cap, ([0-9.]+) mm wide", in_one_line(layout))
    assert float(message) == approx(1e3 * width, rel=1e-3)
    (screw,) = re.findall(r"screws of ([0-9.]+) mm do not", in_one_line(layout))
    assert 1e-3 * float(screw) <= side + 1e-9 < 1e-3 * float(screw) + 1e-3


@pytest.mark.slow
@pytest.mark.cad
@pytest.mark.parametrize("name", ["fingertip_foil", "bench_7mm"])
def test_check_states_outer_size_of_plate_and_cap(name):
    """How wide the cap over a finger is was told nowhere."""
    spec = sitscad.load_text(templates.read(name), "t.yaml")
    result = sitscad.check(spec, hints="none")
    (mount,) = (piece.shape.bounding_box() for piece in parts.solids(sitscad.lay_out(spec)) if piece.name == "mount")
    assert result.board[4:] == approx([1e-3 * mount.size.X, 1e-3 * mount.size.Y], rel=1e-6)
    checked = as_configured(spec, result)
    assert read_findings(as_json([checked]).encode(), "", "").board == result.board
    assert re.search("^mount: .* mm outside$", as_text([checked]), re.MULTILINE)


@pytest.mark.parametrize("kind", ["bench-plate", "custom"])
def test_notes_state_minimum_distance_of_metal_below_board(kind):
    spec = sitscad.load_text(templates.read("three_axis_grid"), "t.yaml")
    spec = spec if kind == "bench-plate" else spec.replace({"mount": {"kind": kind}})
    message = in_one_line(sitscad.lay_out(spec))
    (far,) = re.findall(r"of metal only from ([0-9.]+) mm below the board", message)
    assert float(far) == approx(2e3 * max(spec.coil.size), rel=1e-3)
    metal = {"material": "aluminium", "distance": "5 mm", "thickness": "4 mm"}
    behind = sitscad.lay_out(spec.replace({"mount": {"kind": kind, "metal_behind": metal}}))
    assert "of metal only from" not in in_one_line(behind) and "aluminium" in in_one_line(behind)


def test_custom_mount_is_clamped_before_glue_is_spread():
    """One hand held a bar on the press, the other pressed the rim, and nothing held the board, in five seconds."""
    own = sitscad.load_text(templates.read("fingertip_foil"), "t.yaml").replace({"mount": {"kind": "custom"}})
    said = in_one_line(sitscad.lay_out(own))
    assert in_order(said, "(1) Clamp", "Load jig-board-press", "(3) Spread", "(4) Lay the board on", "stands by itself")


def test_bending_rod_is_clear_of_plate():
    """The rod of three_axis_grid met the plate's lower edge by 0.4 mm."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read("three_axis_grid"), "t.yaml"))
    (bend,) = bends(layout)
    (rod,) = re.findall(r"rod of ([0-9.]+) mm diameter", in_one_line(layout))
    assert float(rod) <= 2e3 * (bend.radius + ROD) and bend.start >= bending_rod_start(layout) - 1e-9
    assert "table's edge" in in_one_line(layout) and "chamfer" not in in_one_line(layout)
    at = 1e3 * (bend.line - layout.body[2]) - 0.5
    nearer = sitscad.lay_out(layout.spec.replace("fpc.tail.bend", {"kind": "static", "at": f"{at:.3f} mm"}))
    (met,) = re.findall(r"lower edge there by ([0-9.]+) mm", in_one_line(nearer))
    assert 0.0 < float(met) <= 0.5


@pytest.mark.parametrize("width", ["4.2 mm", "4.8 mm", "6 mm"])
def test_mount_of_any_width_has_gap_of_at_least_50_um(width):
    """A jaw of 4.386 mm and a mount of 4.427 mm left no gap between strips on the jaw's sides."""
    jaw = {"based_on": "generic-5mm", "width": width, "port_diameter": "7 mm"}
    layout = sitscad.lay_out(GRASPER.spec.replace("mount.jaw", jaw))
    message = in_one_line(layout)
    film = re.search(r"a film of ([0-9.]+) mm between each and the jaw", message)
    (face,) = re.findall(r"the jaw's face is ([0-9.]+) mm wide", message)
    widths = re.findall(r"mm wide, the shield ([0-9.]+), the mount ([0-9.]+)\. Put", message)[0]
    gaps = re.findall(r"([0-9.]+) mm beside the (?:shield|mount)", message)
    for wide, gap in zip(widths, gaps, strict=True):
        assert float(gap) == approx((float(film[1]) if film else 0.0) + (float(face) - float(wide)) / 2, abs=2e-3)
    assert min(map(float, gaps)) >= 0.05 - 1e-9
    sizes = piece_sizes(layout)
    assert float(widths[1]) == approx(1e3 * sizes["mount"][1], abs=1e-3)


@pytest.mark.cad
@pytest.mark.slow
def test_widths_and_ends_in_steps_equal_solids():
    pieces = {each.name: each.shape.bounding_box() for each in parts.solids(GRASPER)}
    for name, (end, width) in piece_sizes(GRASPER).items():
        assert approx(1e3 * end, abs=1e-3) == pieces[name].min.X
        assert approx(1e3 * width, abs=5e-3) == pieces[name].size.Y


@pytest.mark.parametrize("template", ["bench_7mm", "fingertip_cell", "grasper_4layer", "round_button_12mm"])
def test_each_placing_step_states_position_and_tolerance(template):
    """The spec counts how far a piece is glued beside its place, and no step said how that is reached."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read(template), "t.yaml"))
    band = f"+-{1e3 * placement_tolerance(layout.spec.assembly).band:.3f} mm"
    steps = re.split(r"(?<=\s)(?=\d+\. [A-Z])", in_one_line(layout))
    placing = [step for step in steps if re.search("Put the frame jig-|Glue the board", step)]
    assert len(placing) == 3 and all(band in step for step in placing)
    assert layout.spec.mount.jaw is None or f"place of each piece {band}" in in_one_line(layout)
    target, (x0, *_) = plates_of(layout.spec).targets[0], layout.body
    (end,) = re.findall(r"target's edges must be, in mm [^:]+: away from [^0-9]+([0-9.]+)", placing[1])
    assert float(end) == approx(1e3 * (target.footprint.box[0] - x0), abs=6e-4)


def test_notes_state_gap_between_board_and_stop():
    """"Against the stop" put the board 0.15 mm beside the place that the same page gave."""
    message, inner = in_one_line(GRASPER), stop_place(GRASPER.body, GRASPER.spec.jaw, GRASPER.spec.mount)[1]
    (gap,) = re.findall(r"Do not push the board against the stop itself: leave a gap of ([0-9.]+) mm", message)
    assert float(gap) == approx(1e3 * (GRASPER.body[0] - inner), abs=1e-6)
    tip = jaw_range(GRASPER.body, GRASPER.spec.jaw)[0]
    assert f"its end {1e3 * (GRASPER.body[0] - tip):.2f} mm from the jaw's tip" in message
    stop = stop_place(GRASPER.body, GRASPER.spec.jaw, GRASPER.spec.mount)[0]
    assert f"shield {1e3 * (GRASPER.body[0] - tip):.2f}, mount {1e3 * (stop - tip):.2f}" in message


def test_pieces_are_pressed_first_and_measured_afterwards():
    """"Press until it is as high as this" asked for a gauge within the five seconds that the glue flows."""
    said = in_one_line(GRASPER)
    assert in_order(
        said, "Press each down at once", "spring clamp over a flat block", "measure how high each is", "If it is higher"
    )
    assert "tongue hang 0.16 mm over the metal" in said and "up to 0.7 mm3" in said
    assert in_order(said, "Measure how thick", "mount 0.500 +-0.050 mm", "Rub a thicker one down")
    assert re.search(r"Glue the tail down with 0\.24 mm3", said)


def test_drive_code_is_given_with_register_word():
    (code, word), = re.findall(r"drive code (\d+) for the bare board; .*? Write (0x[0-9A-F]{4}) ", in_one_line(GRASPER))
    assert int(word, 16) >> 11 == int(code)


INSTRUMENTS = (
    "microscope", "caliper", "feeler gauge", "ring gauge", "dial gauge", "micrometer", "kitchen scale", "file",
    "vacuum", "petroleum jelly", "M8 washers", "abrasive film", "cover glass", "flat-ended rod", "isopropanol",
    "polyimide tape", "acrylic lacquer", "balance", "PTFE", "1 kg", "blade", "UV",
)


@pytest.mark.parametrize("template", ["grasper_4layer", "three_axis_grid", "fingertip_cell", "skin_strip_6"])
def test_every_instrument_in_steps_is_listed_as_tool(template):
    message = in_one_line(sitscad.lay_out(sitscad.load_text(templates.read(template), "t.yaml")))
    head, _, steps = message.partition(" 1. ")
    listed = head.partition("Tools:")[2]
    absent = [each for each in INSTRUMENTS if re.search(rf"\b{each}\b(?!/)", steps) and each not in listed]
    assert listed and absent == []
    assert "Longest waits:" in head and "24 h" in head


MOUNTED = [name for name in templates.names() if sitscad.load_text(templates.read(name), "t.yaml").mount is not None]


@pytest.mark.few(6)
@pytest.mark.parametrize("name", [*templates.names()])
def test_board_glue_stays_liquid_until_board_is_pressed(name):
    """Five seconds were to do for a board, a frame and a weight, and for a shield between feeler gauges."""
    spec = sitscad.load_text(templates.read(name), "t.yaml")
    layout = sitscad.lay_out(spec)
    glue, (plan, _) = hard_adhesive(layout), board_plan(layout)
    force = board_press(layout) * 9.80665
    takes = spreading_time(glue, plan, force, spec.assembly.glue_line, HARD_HANDLING)
    assert HARD_HANDLING >= 5.0 and takes <= glue.open_time
    assert force <= MOST_PRESSURE * board_plan(layout)[1] * 1.01
    if spec.mount is not None:
        own, steps = spec.assembly.adhesive.product, steps_of(name)[1].partition("Push the board out")[2]
        assert f"of {glue.product}, for a glue line" in steps and f"of {own}, for a glue line" not in steps
        (item,) = (row for row in parts_list._glue_items(layout) if row.item == "board adhesive")
        assert item.part == glue.product and f"Not {own}" in steps


@pytest.mark.parametrize("name", MOUNTED)
def test_parts_list_contains_every_film_and_dose_of_steps(name):
    """Steps wanted a film of 0.1 mm and doses of 61 mm3; bought were 0.05 mm and a dispenser for 10 at most."""
    layout, said = steps_of(name)
    rows = {row.item: row.size for row in parts_list._support_items(layout)}
    films = {*re.findall(r"a film of ([0-9.]+) mm between", said), *re.findall(r"PTFE\), ([0-9.]+) mm thick", said)}
    films |= {*re.findall(r"recess is ([0-9.]+) mm larger", said), *re.findall(r"stop itself: ([0-9.]+) mm", said)}
    assert {f"{float(film):g} mm" for film in films} == {*rows["film"].split(", ")}
    doses = [float(value) for value in re.findall(r"([0-9.]+) mm3 \(microlitres", said)]
    least, most = re.fullmatch(r"([0-9.]+)(?: to ([0-9.]+))? microlitres", rows["dispenser"]).groups()
    assert (float(least), float(most or least)) == (min(doses), max(doses))


@pytest.mark.parametrize("name", MOUNTED)
def test_board_press_clears_recess_films_and_pads(name):
    """A frame stood on the films and on the mount's rim, a glass plate on the highest of six pads."""
    layout, message = steps_of(name)
    pockets, (x0, y0, x1, y1) = tooling.foot_pockets(layout), layout.body
    assert pockets and tooling.FOOT_INSET > 0.0 and "jig-board-press" in message
    boxes = [bounding_box((pocket,)) for pocket in pockets]
    for body in plates_of(layout.spec).all:
        left, low, right, high = body.footprint.box
        assert any(box[0] <= left - tooling.FOOT_ROOM[0] + 1e-9 and box[1] <= low - tooling.FOOT_ROOM[0] + 1e-9
                   and box[2] >= right + tooling.FOOT_ROOM[0] - 1e-9 and box[3] >= high + tooling.FOOT_ROOM[0] - 1e-9
                   for box in boxes)
    feet = any(min(box[k] for box in boxes) > end and max(box[k + 2] for box in boxes) < other
               for k, (end, other) in enumerate(((x0, x1), (y0, y1))))
    assert feet, "two opposite rims carry it"
    worst = max(frame.face.spread for frame in tooling.jig_frames(layout))
    assert worst < 0.2 * tooling.FOAM_STRAIN * tooling.FOAM, "foam presses the lowest pad and the highest nearly alike"


def test_custom_mount_part_is_not_printed_and_locates_board():
    part = StepPart("block.step", "0" * 64, (0.0, 0.0, 4e-3), "x", "z")
    bench = sitscad.load_text(templates.read("bench_7mm"), "t.yaml")
    layout = sitscad.lay_out(bench.replace({"mount": {"kind": "custom"}}))
    spec = replace(layout.spec, mount=replace(layout.spec.mount, step=part))
    own = replace(layout, spec=spec)
    message = assembly_notes.instructions(own, SENSOR.estimates, incoming_tests(SENSOR).board, PIECES)
    (row,) = (line for line in message.splitlines() if line.startswith("  mount "))
    assert "block.step" in row and "10.0 x" not in row
    flat = " ".join(message.split())
    assert "comes over the point 0, 0, 4 (mm" in flat and "the file's axis x, where the tail leaves" in flat
    assert f"{1e3 * layout.body_size[0]:.2f}"[:4] in flat


def test_round_pad_notes_mention_no_corner_or_long_wall():
    message = in_one_line(sitscad.lay_out(sitscad.load_text(templates.read("round_button_12mm"), "t.yaml")))
    assert "out from the edge" in message and "a corner" not in message.partition("Test the bare board")[0]
    assert "long wall" not in message[message.index("Put the frame jig-elastomer"):message.index("Push the board out")]


@cache
def steps_of(name):
    layout = sitscad.lay_out(sitscad.load_text(templates.read(name), "t.yaml"))
    return layout, in_one_line(layout)


@pytest.mark.parametrize("name", ["round_button_12mm", "bench_7mm", "grasper_4layer"])
def test_placing_steps_name_only_existing_walls_and_edges(name):
    """A round recess has no long wall, and no edge of the body is free where the tail leaves it."""
    layout, message = steps_of(name)
    is_round = layout.spec.fpc.body is not None and layout.spec.fpc.body.shape == "circle"
    base = message[message.index("Lay the board, face"):message.index("Put the frame jig-elastomer")]
    assert ("round wall" in base) == is_round and ("the wall on the right" in base) != is_round
    assert "long wall" not in message and "at it" not in message
    (edges,) = re.findall(r"to the elastomer's edges must be, in mm [^:]+: [a-z ]+([0-9.]+), on the right ([0-9.]+), "
                          r"on the left ([0-9.]+) ", message)
    pad, (x0, y0, _, y1) = plates_of(layout.spec).elastomer, layout.body
    left, low, _, high = pad.footprint.box
    assert [*map(float, edges)] == approx([1e3 * each for each in (left - x0, low - y0, y1 - high)], abs=6e-4)
    assert "lift the frame off without moving" in message and re.search("films? out when the glue has set", message)


def test_alignment_strips_are_removed_before_gluing_board():
    layout, message = steps_of("grasper_4layer")
    (film,) = re.findall(r"a film of ([0-9.]+) mm between each", message)
    apart = jaw_section(layout.spec.jaw).face + 2e-3 * float(film)
    assert apart < layout.body_size[1]
    assert in_order(message, "clamp two straight waxed strips", "Take strips and films away", "Glue the board on")


def test_each_glue_line_has_dose_for_its_area():
    layout, message = steps_of("grasper_4layer")
    areas, length = line_areas(layout), layout.body_size[0]
    wide = {part: width for part, (_, width) in piece_sizes(layout).items()}
    assert areas["shield"] == approx(length * wide["shield"], rel=0.01)
    assert areas["mount"] == approx(length * wide["shield"], rel=0.01)
    assert areas["shield"] < areas["board"] < length * layout.body_size[1]
    for part, area in areas.items():
        assert f"under {1e6 * area:.3g} mm2" in message, part


def test_notes_state_screw_spacing_and_height_of_heads():
    layout, message = steps_of("round_button_12mm")
    metal = layout.spec.array.placements, plate_holes(layout)
    apart = screw_spacing(plate_holes(layout))
    assert f"{1e3 * apart[0]:g} x {1e3 * apart[1]:g} mm apart" in message
    (above,) = re.findall(r"heads stand ([0-9.]+) mm above", message)
    glue = 3.0 * layout.spec.assembly.glue_line  # the board itself stands out of the plate by its own line
    assert float(above) == approx(2.0 - 1e3 * (top_height(layout.spec) + glue), abs=6e-3)
    assert ("screws of plastic" in message) == is_near_metal(layout.spec.coil, *metal)
    assert not is_near_metal(replace(layout.spec.coil, size=(1e-3, 1e-3)), *metal)


def test_notes_state_film_thickness_for_pocket_clearance():
    layout = sitscad.lay_out(sitscad.load_text(JAW.format(jaw="toothless-5mm", tail=""), "jaw.yaml"))
    message, pocket = in_one_line(layout), layout.spec.jaw.pocket
    (end, side), = re.findall(r"at the sides, in mm: mount ([0-9.]+) and ([0-9.]+)\.", message)
    start, width = piece_sizes(layout)["mount"]
    tip = sum(jaw_range(layout.body, layout.spec.jaw)) / 2 - pocket[0] / 2
    assert float(end) == approx(max(0.1, 1e3 * (start - tip)), abs=6e-3)
    assert float(side) == approx(max(0.1, 1e3 * (pocket[1] - width) / 2), abs=6e-3)
