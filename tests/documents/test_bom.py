"""The bill of materials: what the spec has is listed once with the right size, what it has not is not."""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import replace
from types import SimpleNamespace

import layouts
import pytest
from tolerance import approx

from sitscad.assembly.places.bodies import backing_of, top_height
from sitscad.assembly.places.column import worst_deviations
from sitscad.assembly.places.jaws import closed_span, seat_circle_radius
from sitscad.estimates.loads.gluing import board_press, piece_press
from sitscad.files.documents import gluing, mounting, preparing
from sitscad.files.documents import parts_list as bom
from sitscad.files.report.page import section_layers, stack_section_svg
from sitscad.layout import lay_out
from sitscad.spec import presets, templates
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.load import load_text
from sitscad.spec.materials import Conductor, ElastomerMaterial, ElastomerPad, Encapsulation, Shield, Target
from sitscad.spec.mount import LEVEL, Jaw, Mount
from sitscad.spec.sensor import Cable

MM = 1e-3
RUBBER = ElastomerMaterial("ecoflex-00-30", 23e3, 0.2, 1e9, "00-30")
PDMS = ElastomerMaterial("pdms", 600e3, 0.3, 1e9)
COPPER, STEEL = Conductor("copper", 58e6), Conductor("stainless-304", 1.39e6)
JAW = Jaw("generic-5mm", None, 4.8 * MM, 20 * MM, 2.2 * MM, 5 * MM, STEEL, **LEVEL)
ESTIMATES = SimpleNamespace(
    readout=SimpleNamespace(capacitance=330e-12, capacitance_reason="E12, centre of both windows")
)


def full(name="two-coils"):
    """The hand-made board with everything that a spec can have."""
    layout = layouts.two_coils(name=name)
    spec = replace(
        layout.spec,
        target=Target("circle", (4 * MM, 4 * MM), 0.2 * MM, COPPER),
        elastomer=ElastomerPad(RUBBER, "square", (4 * MM, 4 * MM), 2 * MM, 0.15 * MM),
        encapsulation=Encapsulation(PDMS, 0.1 * MM),
        shield=Shield(COPPER, 0.1 * MM, 0.6 * MM),
        mount=Mount("grasper-pad", JAW, 1 * MM),
        readout=replace(layout.spec.readout, cable=Cable(0.3, 180e-9, 30e-12, 0.3)),
    )
    return replace(layout, spec=spec)


def rows_of(layout, estimates=ESTIMATES) -> dict[str, dict[str, str]]:
    """The rows by their item, as a spreadsheet reads them."""
    text = bom.render(layout, estimates)["bom.csv"].decode("utf-8")
    rows = list(csv.DictReader(io.StringIO(text)))
    assert all(None not in row and None not in row.values() for row in rows)
    result = {row["item"]: row for row in rows}
    assert len(result) == len(rows)
    return result


def test_full_spec_lists_every_part_with_size():
    rows = rows_of(full())
    assert list(rows["target"]) == [
        "item", "quantity", "part", "material", "size", "note", "maker", "order_code", "for_boards",
    ]
    assert rows["elastomer"]["size"] == "4 x 4 x 2 mm" and rows["elastomer"]["material"] == "ecoflex-00-30"
    assert rows["target"]["size"] == "diameter 4 x 0.2 mm"
    assert rows["connector"]["part"] == "zif-0.5mm, 4 contacts" and "2.5 mm wide" in rows["connector"]["size"]
    assert rows["capacitor"]["quantity"] == "2" and rows["capacitor"]["part"] == "330 pF"
    assert rows["clock"]["part"] == "40 MHz oscillator"
    assert rows["cable"]["size"] == "300 mm" and rows["cable"]["quantity"] == "2"
    made = rows["flexible printed circuit"]["note"]
    assert "stiffener of polyimide, 5 mm along the tail, 2.5 mm across, about 200 um thick" in made
    assert "4 contacts 300 um wide and 3 mm long, pitch 500 um" in made


def test_offset_plate_note_states_its_centre():
    layout = full()
    pad = replace(layout.spec.elastomer, offset=(0.5 * MM, -0.25 * MM))
    rows = rows_of(replace(layout, spec=replace(layout.spec, elastomer=pad)))
    assert rows["elastomer"]["note"].endswith("; centre [0.5, -0.25] mm from the coils' mean")
    assert "mean" not in rows["target"]["note"]


def test_circuit_row_has_outline_thickness_and_stackup():
    row = rows_of(full())["flexible printed circuit"]
    assert row["size"] == "20.4 x 4.7 x 0.15 mm"
    assert row["material"] == "flex-2l-35um, 2 copper layers"


def test_bare_board_lists_no_soft_parts_and_no_connector():
    rows = rows_of(layouts.two_coils(tail=False))
    readout = ["capacitor", "converter", "clock", "decoupling", "reservoir", "bus pull-up", "SD pull-up",
               "converter board", "controller"]
    assert list(rows) == ["flexible printed circuit", "wires", *readout]
    assert [rows[name]["quantity"] for name in readout[3:7]] == ["2", "1", "2", "1"]


@pytest.mark.parametrize(("coils", "converters"), [(1, 1), (4, 1), (5, 2), (8, 2)])
def test_converter_count_follows_number_of_coils(coils, converters):
    layout = full()
    placements = tuple(CoilPlacement(f"C{i}", (i * 4 * MM, 0.0)) for i in range(coils))
    more = tuple(replace(layout.coils[0], placement=placement, net=placement.name) for placement in placements)
    rows = rows_of(replace(layout, coils=more))
    assert (rows["converter"]["quantity"], rows["capacitor"]["quantity"]) == (str(converters), str(coils))


def test_missing_capacitor_row_gives_reason():
    none = SimpleNamespace(readout=SimpleNamespace(capacitance=None, capacitance_reason="no value fits both windows"))
    row = rows_of(full(), none)["capacitor"]
    assert row["part"] == "none found" and "no value fits" in row["note"]


def test_spreadsheet_formula_in_cell_is_escaped():
    layout = full()
    odd = replace(layout.spec.elastomer, material=replace(RUBBER, name='=HYPERLINK("x"),\n"y"'))
    row = rows_of(replace(layout, spec=replace(layout.spec, elastomer=odd)))["elastomer"]
    assert row["material"] == '\'=HYPERLINK("x"),\n"y"'


def test_bill_of_materials_is_reproducible():
    assert bom.render(full(), ESTIMATES) == bom.render(full(), ESTIMATES)


@pytest.mark.parametrize(
    ("standoff", "shield", "pieces"),
    [
        (0.7, 0.6, {"mount": "0.6 mm thick"}),
        (1.0, 0.6, {"mount": "0.3 mm thick", "mount-spacer": "0.6 mm thick"}),
        (0.7, None, {"mount": "0.7 mm thick"}),
    ],
)
def test_mount_pieces_have_sizes_of_stack_section(standoff, shield, pieces):
    layout = full()
    mount = replace(layout.spec.mount, standoff=standoff * MM)
    sheet = Shield(COPPER, 0.1 * MM, shield * MM) if shield else None
    layout = replace(layout, spec=replace(layout.spec, mount=mount, shield=sheet))
    rows = {name: row for name, row in rows_of(layout).items() if name.startswith("mount")}
    assert {name: row["size"] for name, row in rows.items()} == pieces
    assert all(f"{standoff:g} mm of standoff in all" in row["note"] for row in rows.values())
    drawn = stack_section_svg(section_layers(layout.spec))
    for name, size in pieces.items():
        words = f"{name} to the shield, " if shield == float(size.split()[0]) else f"{name}, "
        shown = size.removesuffix(" thick")
        assert words + (f"{float(shown.split()[0]) * 1e3:g} um" if float(shown.split()[0]) < 1 else shown) in drawn


def test_mount_rows_equal_mount_solids():
    pytest.importorskip("build123d", reason="build123d is not installed")
    from sitscad.assembly.solids.pieces import mount as solids_of

    layout = full()
    heights = {}
    for solid in solids_of(replace(layout, spec=replace(layout.spec, mount=replace(layout.spec.mount, standoff=1e-3)))):
        box = solid.shape.bounding_box()
        heights[solid.name] = box.max.Z - box.min.Z
    assert set(heights) == {name for name in rows_of(layout) if name.startswith("mount")}
    assert heights["mount-spacer"] == approx(0.6, rel=1e-6)


@pytest.mark.parametrize("template", ["grasper_4layer", "racetrack_jaw"])
def test_shield_width_in_list_fits_port(template):
    """The list had the body's width, of which a quarter of a millimetre would have stood out of the port."""
    layout = lay_out(load_text(templates.read(template)))
    rows = rows_of(layout)
    length, width, thickness = (float(side) for side in rows["shield"]["size"].removesuffix(" mm").split(" x "))
    low, high = closed_span(backing_of(layout.spec), top_height(layout.spec))
    levels = backing_of(layout.spec).shield_heights
    corner = math.hypot(width / 2, (levels[0] - (low + high) / 2) / MM)
    assert corner == approx(seat_circle_radius(layout.spec.mount.jaw, worst_deviations(layout)) / MM, abs=1e-4)
    assert width < layout.body_size[1] / MM and "to pass the port" in rows["shield"]["note"]
    assert (length, thickness) == (approx(layout.body_size[0] / MM, abs=1e-4), 0.1)


def test_capacitor_codes_equal_trade_codes():
    from sitscad.files.documents.preparing import capacitance_code, capacitor_order

    known = {220e-12: "221", 330e-12: "331", 47e-12: "470", 1e-9: "102", 4.7e-12: "4R7", 10e-12: "100", 1.5e-9: "152"}
    assert {value: capacitance_code(value) for value in known} == known
    assert capacitor_order("chip-0603", 220e-12).code == "GRM1885C1H221JA01D"
    assert capacitor_order("chip-0402", 10e-9) is None and capacitor_order("chip-1206", 220e-12) is None


def test_rows_have_order_codes_and_quantities_for_all_boards():
    text = templates.read("grasper_4layer").replace("  margin:", "  boards: 40\n  margin:")
    layout = lay_out(load_text(text, "forty.yaml"))
    rows = rows_of(layout)
    assert rows["connector"]["order_code"] == "SFV4R-1STE1LF" and rows["connector"]["maker"] == "Amphenol"
    assert rows["capacitor"]["for_boards"] == "80" and rows["capacitor"]["order_code"] == "GRM1885C1H331JA01D"
    assert "C0G, 5 %, 50 V" in rows["capacitor"]["size"]
    assert rows["converter"]["order_code"].startswith("LDC1614")
    assert rows["adhesive"]["for_boards"] == rows["jig"]["for_boards"] == "1"
    assert rows["elastomer"]["for_boards"] == "40" and "two liquids" in rows["elastomer"]["note"]
    assert "unverified" in rows["connector"]["note"]
    item = rows_of(lay_out(load_text(templates.read("grasper_4layer"), "one.yaml")))
    assert item["elastomer"]["for_boards"] == "1"


def test_every_silicone_has_order_information():
    from sitscad.data import rows
    from sitscad.files.documents.preparing import order_of

    for row in rows("elastomers"):
        order = order_of("elastomer", row["name"])
        assert order is not None and order.words == "two liquids" and order.source


@pytest.mark.slow
def test_metal_behind_is_listed_and_drawn_in_section():
    layout = lay_out(load_text(templates.read("fingertip_cell")))
    row = rows_of(layout)["metal behind"]
    assert (row["material"], row["size"]) == ("aluminium", "2 mm thick")
    assert row["note"].startswith("4 mm behind")
    drawn = stack_section_svg(section_layers(layout.spec))
    assert "metal behind, aluminium, 2 mm thick" in drawn
    assert "gap to the metal behind, 2.8 mm" in drawn, "the mount is 1.2 mm"
    near = replace(layout.spec.mount, standoff=4e-3)
    assert "gap to" not in stack_section_svg(section_layers(replace(layout.spec, mount=near)))


def test_metal_finger_is_drawn_in_section():
    text = templates.read("fingertip_foil").replace("size: [16, 10]}", "size: [16, 10], material: brass}")
    assert "finger, brass, 10 mm thick, cut off here" in stack_section_svg(section_layers(load_text(text)))


@pytest.mark.parametrize("name", ["round_button_12mm", "grasper_4layer", "skin_strip_6"])
def test_parts_list_contains_every_weight_of_steps(name):
    """The list counted the washers of the pieces' presses and left out what presses the board."""
    spec = load_text(templates.read(name), "t.yaml")
    listed = {row.part: row.quantity for row in bom.items(lay_out(spec), ESTIMATES.readout)
              if row.item in ("jig weight", "jig bar", "board weight")}
    for mass in (*(piece_press(spec, part).mass for part in ("elastomer", "target")), board_press(lay_out(spec))):
        if (count := gluing.washer_count(mass)) is not None:
            assert listed["washer M8, ISO 7093"] >= count
        else:
            assert any(gluing.mass_text(mass) in part for part in listed)


@pytest.mark.parametrize(("name", "ways"), [
    ("skin_strip_6", {"elastomer": "cut", "target": "etched or punched"}),
    ("round_button_12mm", {"elastomer": "cut", "target": "cut"}),
])
def test_cutting_method_is_equal_in_list_and_steps(name, ways):
    """A target that no known laser cuts was to be "etched or punched" in the list and "cut" in the steps."""
    spec = load_text(templates.read(name), "t.yaml")
    listed = {row.item: row.note for row in bom.items(lay_out(spec), ESTIMATES.readout)}
    assert {part: preparing.cutting_text(getattr(spec, part)) for part in ways} == ways
    assert listed["target"].startswith(f"{ways['target']} by ")
    steps = preparing.cut_text({part: getattr(spec, part) for part in ("elastomer", "target", "shield")})
    assert all(re.search(rf"{part}( and \w+)* {way} by", steps) for part, way in ways.items())


@pytest.mark.parametrize("template", ["bench_7mm", "fingertip_cell"])
def test_screw_length_is_equal_in_list_and_steps(template):
    """The list had "screw, M2"; its length was in the steps alone."""
    layout = lay_out(load_text(templates.read(template), "t.yaml"))
    (part,) = (item.part for item in bom._mount_items(layout, layout.spec, layout.spec.mount) if "screw" in item.item)
    thread, length = part.split(" x ")
    message = " ".join(mounting.sensor_mounting_steps(layout))
    assert thread == "M2" and (f"{part} screws" in message or f"screws of {length} mm" in message)


@pytest.mark.parametrize(("contacts", "coded"), [(13, True), (7, False)])
def test_connector_with_unavailable_contact_count_has_no_order_code(contacts, coded):
    from sitscad.files.documents.preparing import connector_order

    order = connector_order(presets.connector("zif-0.3mm"), contacts)
    assert bool(order.code) == coded
    assert (str(contacts) in order.words) != coded


def test_metal_free_distance_of_long_coil_equals_round_coil_of_equal_area():
    """A racetrack of 16 x 2 mm was told 32 mm, twice its length, where no catheter has room."""
    from sitscad.assembly.places.seating import FAR, metal_free_distance

    text = templates.read("single_coil")
    coil = load_text(text, "t.yaml").coil
    assert metal_free_distance(coil) == approx(FAR * coil.size[0], rel=1e-12, abs=0)
    long = replace(coil, shape="racetrack", size=(16 * MM, 2 * MM))
    area = 14 * 2 + math.pi
    assert metal_free_distance(long) == approx(FAR * MM * math.sqrt(4 * area / math.pi), rel=0.02, abs=0)
