"""Rules of materials in wrong places, holes in each other, tolerances, capacitors and requirements, each with a spec
that is refused and a neighbour that is not.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from tolerance import approx

import sitscad
from sitscad.assembly.places.column import print_limit
from sitscad.assembly.places.seating import CORNER_SCREW, adapter_holes, corner_holes, plate_plan
from sitscad.basics.finding import Severity
from sitscad.checks.fixes.moves import narrower_plugs
from sitscad.estimates.circuits.tank import E12, E24, neighbour_values, preferred_values
from sitscad.estimates.loads.gluing import (
    PIECE_HANDLING,
    glued_footprint,
    has_too_fast_glue,
    piece_press,
    spreading_time,
)
from sitscad.layout import lay_out
from sitscad.spec import presets, templates
from sitscad.spec.load import load_text
from sitscad.spec.sensor import SensorSpec

COPPER, COVER = {"copper": "30 um"}, {"coverlay": "27.5 um"}


def stack(*dielectrics, coverlay=None):
    """A stack-up of copper layers with groups of dielectrics between them."""
    layers = [coverlay or COVER, COPPER]
    for group in dielectrics:
        layers += [{"dielectric": "25 um", "material": name} for name in group] + [COPPER]
    return [*layers, coverlay or COVER]


def of_stack(design, layers, copper):
    return design(fpc__stackup=layers, coil__layers=copper, fpc__tail__layers=min(2, copper))


@pytest.mark.parametrize(("layers", "copper", "key"), [
    (stack(["solder-mask"]), 2, "fpc.stackup.2.material"),
    (stack(["polyimide", "solder-mask"]), 2, "fpc.stackup.3.material"),
    (stack(["adhesive"]), 2, "fpc.stackup.2.material"),
    (stack(["adhesive"], ["polyimide"], ["adhesive"]), 4, "fpc.stackup.2.material"),
    (stack(["polyimide-coverlay"]), 2, "fpc.stackup.2.material"),
    (stack(["polyimide"], coverlay={"coverlay": "25 um", "material": "adhesive"}), 2, "fpc.stackup.0.material"),
    (stack(["polyimide"], coverlay={"coverlay": "25 um", "material": "felios"}), 2, "fpc.stackup.0.material"),
])
def test_stackup_layer_of_unsuitable_material_gives_error(design, judge, layers, copper, key):
    (result,) = judge("SIT137", of_stack(design, layers, copper))
    assert result.severity is Severity.ERROR and result.key == key


@pytest.mark.parametrize(("layers", "copper"), [
    (stack(["polyimide"]), 2), (stack(["felios"]), 2), (stack(["bondply"]), 2),
    (stack(["adhesive", "polyimide", "adhesive"]), 2),
    (stack(["polyimide"], ["adhesive"], ["polyimide"]), 4),
    (stack(["polyimide"], coverlay={"coverlay": "25 um", "material": "solder-mask"}), 2),
])
def test_stackup_layer_of_suitable_material_passes(design, judge, layers, copper):
    assert judge("SIT137", of_stack(design, layers, copper)) == []


def film(thickness, adhesive=None):
    return {"coverlay": thickness} | ({"adhesive": adhesive} if adhesive else {})


@pytest.mark.parametrize(("coverlay", "severity"), [
    (film("27.5 um", "15 um"), Severity.WARNING), (film("27.5 um"), Severity.WARNING),
    (film("27.5 um", "10 um"), Severity.ERROR), (film("37.5 um", "25 um"), None), (film("37.5 um"), None),
    (film("50 um", "20 um"), Severity.WARNING), (film("25 um") | {"material": "solder-mask"}, None),
])
def test_coverlay_with_little_adhesive_gives_warning_or_error(design, judge, coverlay, severity):
    result = judge("SIT138", of_stack(design, stack(["polyimide"], coverlay=coverlay), 2))
    assert [(item.severity, item.key) for item in result] == [
        (severity, "fpc.stackup.0"), (severity, "fpc.stackup.4")] * (severity is not None)
    for item in result:
        assert item.limit == approx(25e-6 * 30 / 35, rel=1e-9, abs=0)


@pytest.mark.parametrize("name", presets.names("stackup"))
@pytest.mark.parametrize("plating", [None, "panel", "pattern", "buttons"])
@pytest.mark.parametrize("tail", [1, 2, 8])
def test_every_preset_stackup_has_enough_adhesive_for_any_plating(name, plating, tail):
    count = len(presets.stackup(name).copper)
    bend = "none" if name.startswith("rigid") else "static"
    fpc = {"stackup": name, "tail": {"layers": min(tail, count), "bend": bend}}
    fpc |= {} if plating is None else {"plated": plating}
    coil = {"shape": "circle", "outer_diameter": 7, "turns": 5, "layers": 2, "trace_width": 0.15, "trace_spacing": 0.15}
    stackup = SensorSpec.from_mapping(name="fill", coil=coil, fpc=fpc).fpc.stackup
    for _, layer, copper in stackup.covers:
        assert layer.material == "solder-mask" or layer.adhesive >= 25e-6 * copper.thickness / 35e-6 - 1e-9
        assert layer.material == "solder-mask" or layer.thickness > layer.adhesive + 10e-6


@pytest.mark.parametrize("adhesive", ["epoxy", "transfer-tape"])
def test_glue_without_silicone_bond_gives_error_only_with_pad(design, judge, adhesive):
    (result,) = judge("SIT329", design(assembly={"adhesive": adhesive}))
    assert result.severity is Severity.ERROR and result.key == "assembly.adhesive"
    without = design(assembly={"adhesive": adhesive}, elastomer=None, requirements=None)
    assert judge("SIT329", without) == []


@pytest.mark.parametrize("adhesive", ["silicone-adhesive", "cyanoacrylate"])
def test_glue_with_silicone_bond_passes(design, judge, adhesive):
    assert judge("SIT329", design(assembly={"adhesive": adhesive})) == []


@pytest.mark.parametrize(("size", "adhesive", "is_found"), [
    (10, "cyanoacrylate", False), (30, "cyanoacrylate", True), (30, "silicone-adhesive", False),
    (13.5, "cyanoacrylate", False),
])
def test_glue_that_sets_before_spreading_gives_warning(judge, size, adhesive, is_found):
    spec = sitscad.load_text(templates.read("three_axis_pad"), "t.yaml").replace(
        {"elastomer.size": f"{size} mm", "assembly.adhesive": adhesive})
    result = judge("SIT334", spec)
    assert [each.severity for each in result] == [Severity.WARNING] * is_found
    if is_found:
        assert result[0].key == "assembly.adhesive" and result[0].measured > result[0].limit == 5.0
        assert "silicone-adhesive" in result[0].hint and "epoxy" not in result[0].hint  # it does not hold on silicone


def test_board_too_large_for_glue_spreading_gives_warning(judge):
    text = templates.read("skin_grid_3x3")
    assert judge("SIT334", sitscad.load_text(text, "t.yaml")) == []
    (result,) = judge("SIT334", sitscad.load_text(text, "t.yaml").replace("assembly.glue_line", "5 um"))
    assert (result.severity, result.key) == (Severity.WARNING, "assembly.glue_line")
    assert result.measured > result.limit == 300.0


@pytest.mark.few(4)
@pytest.mark.parametrize("name", templates.names())
def test_glue_spreads_within_open_time_in_every_template(judge, name):
    """And is not asked how long it takes where half of the pad's stiffness is enough."""
    spec = sitscad.load_text(templates.read(name), "t.yaml")
    assert judge("SIT334", spec) == []
    for part in ("elastomer", "target"):
        if getattr(spec, part) is not None:
            glue, plan, force = spec.assembly.adhesive, glued_footprint(spec, part), piece_press(spec, part).force
            takes = spreading_time(glue, plan, force, spec.assembly.glue_line, PIECE_HANDLING)
            assert takes <= glue.open_time or has_too_fast_glue(spec, part)


@pytest.mark.parametrize(("changes", "is_found"), [
    ({}, True), ({"assembly.adhesive": "silicone-adhesive"}, True), ({"assembly.adhesive": "transfer-tape"}, False),
    ({"encapsulation": None}, False), ({"encapsulation.material": {"shear_modulus": "100 kPa"}}, False),
])
def test_platinum_silicone_film_on_inhibiting_glue_gives_note(judge, changes, is_found):
    spec = sitscad.load_text(templates.read("round_button_12mm"), "t.yaml").replace(changes)
    result = judge("SIT335", spec)
    assert [(each.severity, each.key) for each in result] == [(Severity.NOTE, "encapsulation.material")] * is_found
    # the one adhesive without an inhibitor does not hold on silicone: a hint that names it is no way out
    assert all("film-barrier" in each.cases for each in result)


@pytest.mark.parametrize(("thickness", "is_found"), [("1.5 mm", True), ("1.55 mm", True), ("1.7 mm", False)])
def test_screw_heads_above_sensor_give_note_with_height(judge, thickness, is_found):
    """The steps alone said that the heads of a shipped template stand 0.11 mm above its top face."""
    spec = sitscad.load_text(templates.read("round_button_12mm"), "t.yaml").replace({"elastomer.thickness": thickness})
    result = judge("SIT337", spec)
    assert [(each.severity, each.key) for each in result] == [(Severity.NOTE, "mount.holes")] * is_found
    pad = float(thickness.removesuffix(" mm")) * 1e-3
    # target, film and three glue lines of 30 um under board, pad and target
    top = pad + spec.target.thickness + spec.encapsulation.thickness + 3.0 * spec.assembly.glue_line
    assert all(each.measured == approx(2e-3 - top, abs=0, rel=1e-6) for each in result)


def plate(design, *places, **sizes):
    holes = [{"at": list(place), "diameter": 2.4, "head": 3.8, **sizes} for place in places]
    return design(mount={"kind": "bench-plate", "standoff": 1, "holes": holes}, shield=None)


@pytest.mark.parametrize(("places", "sizes"), [
    ([(-20, 20), (-20, 21)], {}), ([(-20, 20), (20, 20), (-20, 23.5)], {}), ([(-20, 20), (-20, 20)], {}),
    ([(-20, 20), (-20, 24)], {"diameter": 3.8}),
])
def test_overlapping_plate_holes_give_error(design, judge, places, sizes):
    (result,) = judge("SIT330", plate(design, *places, **sizes))
    assert result.severity is Severity.ERROR and result.key == f"mount.holes.{len(places) - 1}.at"
    assert result.measured < result.limit


@pytest.mark.parametrize("places", [[(-20, 20), (-20, 24)], [(-20, 20)]])
def test_separated_plate_holes_pass(design, judge, places):
    assert judge("SIT330", plate(design, *places)) == []


@pytest.mark.parametrize(("places", "found"), [([(0, 0), (-20, 20)], 0), ([(-20, 20), (5, 0)], 1)])
def test_plate_hole_under_board_gives_warning(design, judge, places, found):
    (item,) = judge("SIT330", plate(design, *places))
    assert (item.severity, item.key) == (Severity.WARNING, f"mount.holes.{found}.at")
    assert item.measured == 0.0 and item.limit == approx(1.9e-3 + 1e-3, rel=1e-9, abs=0)


@pytest.mark.parametrize("pattern", ["corners-m2", "ati-nano17", "ati-mini40", "breadboard-m6-25mm"])
def test_installed_hole_patterns_pass_hole_distance_rule(design, judge, pattern):
    assert judge("SIT330", design(mount={"kind": "bench-plate", "standoff": 1, "holes": pattern}, shield=None)) == []


def test_tolerance_above_half_part_thickness_gives_warning(design, judge):
    (result,) = judge("SIT331", design(assembly={"tolerances": {"target": "190 um", "elastomer": "0.3 mm"}}))
    assert result.severity is Severity.WARNING and result.key == "assembly.tolerances.target"
    assert (result.measured, result.limit) == approx((190e-6, 100e-6), rel=1e-9)
    assert judge("SIT331", design(assembly={"tolerances": {"target": "100 um", "encapsulation": "50 um"}})) == []


@pytest.mark.parametrize(("written", "nearest"), [("333.33 pF", 330e-12), ("350 pF", 360e-12), ("95 pF", 91e-12)])
def test_capacitor_outside_e24_series_gives_warning_with_nearest_value(design, judge, written, nearest):
    (result,) = judge("SIT220", design(readout__capacitance=written))
    assert result.severity is Severity.WARNING and result.key == "readout.capacitance"
    assert result.limit == approx(nearest, rel=1e-9)


@pytest.mark.parametrize("written", ["auto", "330 pF", "91 pF", "1 nF", "0.1 nF", "360 pF", "1.1 nF"])
def test_capacitor_of_e24_series_passes(design, judge, written):
    assert judge("SIT220", design(readout__capacitance=written)) == []


def test_preferred_capacitors_are_in_e24_series():
    assert set(E12) < set(E24) and len(E24) == 24
    chosen = preferred_values(presets.converter("ldc1614"))
    assert chosen and all(neighbour_values(value) == approx((value, value), rel=1e-9) for value in chosen)
    assert neighbour_values(9.6e-11) == approx((9.1e-11, 1e-10), rel=1e-9)


@pytest.mark.parametrize(("asked", "severity", "key"), [
    ({"temperature": "60 degC", "temperature_range": [15, 45]}, Severity.ERROR, "requirements.temperature"),
    ({"temperature": "10 degC", "temperature_range": [15, 45]}, Severity.ERROR, "requirements.temperature"),
    ({"temperature_range": [30, 40]}, Severity.NOTE, "requirements.temperature_range"),
])
def test_temperature_outside_required_range_gives_finding_at_its_key(design, judge, asked, severity, key):
    (result,) = judge("SIT410", design(requirements=asked))
    assert (result.severity, result.key) == (severity, key)


@pytest.mark.parametrize("asked", [{"temperature_range": [15, 45]}, {"temperature": "37 degC"},
                                   {"temperature": "37 degC", "temperature_range": [37, 40]}])
def test_temperature_inside_required_range_passes(design, judge, asked):
    assert judge("SIT410", design(requirements=asked)) == []


def test_load_case_beyond_required_force_gives_warning(design, judge):
    result = judge("SIT410", design(loads={"press": {"normal": "6 N"}, "shear": {"shear_x": "2 N"}}))
    assert [(item.key, item.severity) for item in result] == [("loads.press", Severity.WARNING),
                                                          ("loads.shear", Severity.WARNING)]
    assert judge("SIT410", design(loads={"press": {"normal": "4.8 N"}, "shear": {"shear_x": "-1 N"}})) == []


def test_unknown_layer_material_passes(judge, design):
    spec = design()
    layers = tuple(replace(item, material="own film") if item.material == "polyimide" else item
                   for item in spec.fpc.stackup.layers)
    assert judge("SIT137", replace(spec, fpc=replace(spec.fpc, stackup=replace(spec.fpc.stackup, layers=layers)))) == []


def test_mount_tolerance_above_half_plate_thickness_gives_warning(design, judge):
    plate = {"kind": "bench-plate", "standoff": "0.5 mm"}
    spec = design(mount=plate, shield=None, assembly={"tolerances": {"mount": "0.49 mm"}})
    (result,) = judge("SIT331", spec)
    assert result.key == "assembly.tolerances.mount"
    assert (result.measured, result.limit) == approx((0.49e-3, 0.25e-3), rel=1e-9)


@pytest.mark.parametrize("pattern", ["ati-nano17", "ati-mini40", [{"at": [0, 0], "diameter": 6.6, "head": 10}]])
def test_adapter_holes_are_clear_of_corner_nuts(design, pattern):
    spec = design(mount={"kind": "bench-plate", "standoff": 1, "holes": pattern}, shield=None)
    layout = lay_out(spec)
    corners = corner_holes(plate_plan(layout, 0.0))
    for hole in (needed := adapter_holes(layout)):
        nearest = min(math.dist(hole.at, corner.at) for corner in corners)
        assert nearest > hole.head / 2 + CORNER_SCREW.nut_across / math.sqrt(3.0) + print_limit("resin", "wall").value
    assert needed


STRIP = """sitscad: 1
name: strip
coil: {shape: racetrack, outer_diameter: [16, 1.99], turns: 3.5, layers: 4, trace_width: 0.08, trace_spacing: 0.08}
array: {pattern: line, count: 3, pitch: 18}
fpc:
  stackup: flex-4l
  rules: {based_on: generic-fine, coil_trace_width: 0.08, coil_trace_spacing: 0.08, source: their quotation}
  largest: {shape: rectangle, size: [60, WIDTH]}
  tail: {length: 150, bend: none, END}
target: {shape: rectangle, size: [16, 2.2], thickness: 0.6}
elastomer: {shape: rectangle, size: [16, 2.2], thickness: 1, material: ecoflex-00-30}
MOUNT
"""


def strip(end="connector: zif-0.3mm, contacts: 7", width="3", mount=""):
    return load_text(STRIP.replace("END", end).replace("WIDTH", width).replace("MOUNT", mount))


@pytest.mark.parametrize(("end", "width", "told"), [
    ("connector: zif-0.3mm, contacts: 7", "3.2", False), ("connector: zif-0.3mm", "3.2", True),
    ("connector: zif-0.3mm", "4.3", False), ("connector: solder-pads", "3.2", True),
    ("connector: zif-0.5mm", "3.2", True), ("connector: solder-pads, turn: left", "3.2", False),
])
def test_contacts_wider_than_largest_outline_give_note(judge, end, width, told):
    layout = lay_out(strip(end, width))
    result = [each for each in judge("SIT136", layout.spec, layout) if each.severity is Severity.NOTE]
    assert len(result) == told
    for each in result:
        assert each.key == "fpc.tail.connector" and each.limit == approx(1e-3 * float(width), rel=1e-9)
        assert each.measured == approx(layout.size[1], rel=1e-6)


@pytest.mark.few(1)
@pytest.mark.parametrize(("end", "edits"), [
    ("connector: zif-0.3mm", {"fpc.tail.connector": "zif-0.5mm"}), ("connector: zif-0.5mm", {}),
    ("connector: zif-0.3mm, contacts: 12", {"fpc.tail.connector": "zif-0.5mm", "fpc.tail.contacts": "6"}),
    ("connector: zif-0.5mm, contacts: 12", {"fpc.tail.contacts": "6"}),
])
def test_too_wide_tail_gets_narrower_existing_plugs(judge, end, edits):
    """A spec with zif-0.3mm was told to write zif-0.3mm, and a number of contacts that nobody is known to make."""
    spec = strip(end, "3")
    (result,) = [each for each in judge("SIT136", spec) if each.severity is Severity.NOTE]
    offered = narrower_plugs(spec, result.measured)
    assert [{edit.key: edit.new for edit in fix.edits} for _, fix in offered[:1]] == [edits] * bool(edits)
    assert all(value in result.hint for value in edits.values()) and ("fpc.tail" in result.hint) == bool(edits)
    for width, fix in offered:
        layout = lay_out(fix.spec)
        assert layout.size[1] == approx(width, rel=1e-6) and width < result.measured
        assert not [each for each in judge("SIT127", fix.spec, layout) if each.severity is not Severity.NOTE]


@pytest.mark.parametrize(("mount", "told"), [
    ("mount: {kind: custom}", True), ("mount: {kind: bench-plate}", False), ("", False),
    ("mount: {kind: custom, metal_behind: {material: stainless-304, distance: 2, thickness: 1}}", False),
])
def test_custom_mount_without_stated_metal_behind_gives_note(judge, mount, told):
    result = judge("SIT336", strip(mount=mount))
    assert [(each.severity, each.key) for each in result] == [(Severity.NOTE, "mount")] * told
    assert all("metal-behind" in each.cases for each in result)


@pytest.mark.parametrize(("material", "thickness", "limit"), [
    ("copper", "0.2", None), ("copper", "0.21", 0.2e-3), ("copper", "0.5", 0.2e-3), ("aluminium", "0.5", None),
])
def test_target_too_thick_for_laser_cutting_gives_note(design, judge, material, thickness, limit):
    result = judge("SIT317", design(target__material=material, target__thickness=thickness))
    assert [(each.severity, each.key, each.limit) for each in result] == (
        [(Severity.NOTE, "target.thickness", limit)] if limit else [])


@pytest.mark.parametrize("room", [3.1, 2.4])
def test_outline_is_suggested_for_large_body_only_with_room(judge, room):
    """The outline as the body's own is laid out: it is advised if everything has room in it."""
    spec = strip(width=f"{room}").replace("fpc.margin", (0.0, 0.5e-3))
    (result,) = [each for each in judge("SIT136", spec) if each.severity is Severity.ERROR]
    body = {"shape": "rectangle", "size": ["60 mm", f"{room} mm"]}
    lacks = lay_out(spec.replace("fpc.margin", (0.0, 0.0)).replace("fpc.body", body))
    assert bool(lacks.shortfalls) == (room == 2.4)
    assert (f"[60, {room}]" in result.hint) != bool(lacks.shortfalls)


@pytest.mark.parametrize(("name", "shown"), [("", "based on generic-fine"), ("name: our shop, ", "our shop")])
def test_rules_name_is_stated_name_or_base_profile(name, shown):
    """Papers said "closer than written out keeps"."""
    rules = load_text(STRIP.replace("END", "connector: zif-0.3mm").replace("WIDTH", "9").replace("MOUNT", "").replace(
        "{based_on", f"{{{name}based_on")).fpc.rules
    assert rules.name.endswith(shown) and "written out" not in rules.name
