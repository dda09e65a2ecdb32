"""From text to values: contract examples, defaults, presets, things written out, and places in the text."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from tolerance import approx

from sitscad.estimates.circuits.uncertainty import tolerance_sigmas
from sitscad.kernels.geometry.shapes import SHAPES
from sitscad.spec import presets, templates
from sitscad.spec.circuit import Plating
from sitscad.spec.load import load, load_text
from sitscad.spec.reading import RULE_NAMES, RULE_TEXTS, SpecError
from sitscad.spec.resolver.coils import coil_gap, coil_placements

COIL = "coil: {shape: circle, outer_diameter: 3.5, turns: 6.5, trace_width: 100 um, trace_spacing: 100 um}\n"
ROOT = Path(__file__).parents[2]
MINIMAL = "sitscad: 1\nname: a\n" + COIL


def loaded(*sections, coil=COIL):
    return load_text("sitscad: 1\nname: a\n" + coil + "\n".join(sections) + "\n")


@pytest.mark.parametrize("name", ["con", "nul", "aux.txt", "lpt1", "com9.b", "prn", "a.", "a.b."])
def test_name_reserved_by_windows_is_refused(name):
    with pytest.raises(SpecError) as refused:
        load_text(MINIMAL.replace("name: a\n", f"name: {name}\n"))
    assert [(item.rule, item.key) for item in refused.value.findings] == [("SIT006", "name")]


@pytest.mark.parametrize("name", ["console", "nul-1", "auxiliary", "lpt", "com", "a.b", "a", "0", "a.con", "con-a"])
def test_name_similar_to_reserved_windows_name_is_accepted(name):
    assert load_text(MINIMAL.replace("name: a\n", f"name: {name!r}\n")).name == name


def test_minimal_spec_lists_its_defaults():
    spec = load_text(MINIMAL, "minimal.yaml")
    assert spec.coil.layers == (1,)
    assert [placement.centre for placement in spec.array.placements] == [(0.0, 0.0)]
    assert spec.fpc.stackup.name == "flex-2l-30um"
    assert spec.fpc.rules.name == "generic-flex"
    assert spec.fpc.tail is spec.target is spec.elastomer is spec.mount is spec.shield is spec.encapsulation is None
    readout = spec.readout
    assert readout.device.name == "ldc1614"
    assert (readout.capacitance, readout.clock, readout.scan_rate) == (None, 40e6, 100.0)
    assert "fpc.stackup: flex-2l-30um, the default for 1 coil layer" in spec.source.defaults
    assert "readout.clock: 40 MHz, the default" in spec.source.defaults
    assert spec.source.path == "minimal.yaml"


@pytest.mark.parametrize("name", templates.names())
def test_each_template_loads_with_its_name(name):
    spec = load(templates.directory() / f"{name}.yaml")
    assert spec.name == name.replace("_", "-")


def test_template_list_includes_the_four_first_templates():
    assert set(templates.names()) >= {"bench_7mm", "grasper_3p5mm", "grasper_4layer", "single_coil"}


def test_spec_values_are_stored_in_si_units():
    spec = load(templates.directory() / "grasper_4layer.yaml")
    assert spec.coil.size == (0.00395, 0.00395)
    assert (spec.coil.turns, spec.coil.layers) == (8.75, (1, 2, 3, 4))
    assert (spec.coil.trace_width, spec.coil.trace_spacing) == (80e-6, 80e-6)
    assert [p.name for p in spec.array.placements] == ["C1", "C2"]
    assert [p.centre[0] for p in spec.array.placements] == [-0.0021, 0.0021]
    assert spec.fpc.tail.connector == presets.connector("zif-0.5mm")
    assert spec.readout.capacitance == 220e-12
    assert spec.requirements.normal_force == 6.0
    assert spec.shield.gap == 0.5e-3
    assert [layer.number for layer in spec.coil_copper] == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("layers", "name"),
    [
        (1, "flex-2l-30um"),
        (2, "flex-2l-30um"),
        (3, "flex-4l"),
        (4, "flex-4l"),
        (5, "flex-6l"),
        (6, "flex-6l"),
        (7, "flex-8l"),
        (8, "flex-8l"),
        ("[1, 3]", "flex-4l"),
    ],
)
def test_default_stackup_adds_free_layer_for_odd_coil_layers(layers, name):
    assert loaded(coil=COIL.replace("turns:", f"layers: {layers}, turns:")).fpc.stackup.name == name


def test_locate_returns_place_of_value_or_parent_of_missing_key():
    source = load_text(
        "sitscad: 1\nname: a\ncoil:\n"
        + COIL[7:-2].replace(", ", "\n").replace("shape", "  shape").replace("\n", "\n  ")
        + "\n"
    ).source
    assert source.locate("coil.turns") == (6, 10)
    assert source.locate("coil.layers") == (3, 1)
    assert source.locate("coil") == (3, 1)
    assert source.locate("array.count") == (1, 1)
    assert source.line(6) == "  turns: 6.5"


def test_stackup_can_be_written_as_list_of_layers():
    spec = loaded(
        "fpc:",
        "  stackup:",
        "    - {coverlay: 37.5 um, adhesive: 25 um}",
        "    - {copper: 30 um}",
        "    - {dielectric: 25 um, material: polyimide}",
        "    - {copper: 30 um}",
        "    - {coverlay: 27.5 um, permittivity: 3}",
    )
    of_preset = presets.stackup("flex-2l-30um").layers
    for own, other in zip(spec.fpc.stackup.layers[:-1], of_preset[:-1], strict=True):
        assert replace(own, thickness=other.thickness) == other
        assert own.thickness == approx(other.thickness, rel=1e-9)
    assert spec.fpc.stackup.layers[-1].relative_permittivity == 3
    assert spec.source.locate("fpc.stackup.1.copper") == (7, 16)


ROWS = "[{coverlay: 27.5 um}, {copper: %s}, {dielectric: 25 um}, {copper: %s}, {coverlay: 27.5 um}]"


def test_foil_of_written_stackup_is_finished_copper_minus_plating():
    spec = loaded("fpc:", f"  stackup: {ROWS % ('30 um', '47 um')}")
    own = spec.fpc.stackup
    assert own.plating_thickness == 12e-6 and [layer.thickness for layer in own.copper] == [30e-6, 47e-6]
    assert [layer.foil for layer in own.copper] == approx([18e-6, 35e-6], rel=1e-9)
    assert "fpc.plating: 12 um, part of the outer copper" in spec.source.defaults
    thick = loaded("fpc:", f"  stackup: {ROWS % ('35 um', '35 um')}", "  plating: 20 um").fpc.stackup
    assert (thick.plating_thickness, thick.line_foil((1, 2))) == (20e-6, approx(15e-6, rel=1e-9))
    buttons = loaded("fpc:", f"  stackup: {ROWS % ('18 um', '18 um')}", "  plated: buttons").fpc.stackup
    assert [layer.foil for layer in buttons.copper] == [18e-6, 18e-6] and buttons.plating_thickness == 12e-6
    thin = loaded("fpc:", f"  stackup: {ROWS % ('9 um', '35 um')}")
    assert thin.fpc.stackup.plating is Plating.BUTTONS, "copper thinner than the plating can have none on it"
    assert "fpc.plating: 12 um, in the holes alone" in thin.source.defaults
    bare = loaded("fpc:", "  stackup: [{copper: 35 um}, {dielectric: 25 um}]").fpc.stackup
    assert bare.plating_thickness == 0.0 and bare.copper[0].foil == 35e-6


def test_finished_copper_of_preset_stackup_follows_plating_method():
    stackup = loaded("fpc:", "  stackup: flex-2l-30um").fpc.stackup
    assert [(layer.foil, layer.thickness) for layer in stackup.copper] == [approx((18e-6, 30e-6), rel=1e-9)] * 2
    more = loaded("fpc:", "  stackup: flex-2l-30um", "  plating: 15 um").fpc.stackup
    assert [layer.thickness for layer in more.copper] == approx([33e-6] * 2, rel=1e-9)
    for name, finished in (("flex-2l-18um", 18e-6), ("flex-2l-18um\n  plated: panel", 30e-6)):
        copper = loaded("fpc:", f"  stackup: {name}").fpc.stackup.copper
        assert [layer.thickness for layer in copper] == approx([finished] * 2, rel=1e-9)


@pytest.mark.parametrize(
    ("method", "tail", "finished", "line_foil"),
    [
        ("panel", "", [30, 18, 18, 30], 18),
        ("panel", "layers: 2", [42, 30, 18, 30], 30),
        ("pattern", "layers: 2", [42, 30, 18, 30], 18),
        ("buttons", "layers: 2", [18, 18, 18, 18], 18),
        ("panel", "layers: 3", [42, 18, 30, 30], 30),
        ("panel", "layers: 1", [30, 18, 18, 30], 18),
    ],
)
def test_finished_copper_follows_plating_method_and_number_of_platings(method, tail, finished, line_foil):
    """A tail of fewer layers with holes of its own is plated before the rest is laminated on: those layers twice."""
    tail = f"  tail: {{length: 30, {tail}}}"
    stackup = loaded("fpc:", "  stackup: flex-4l", f"  plated: {method}", tail).fpc.stackup
    assert [layer.thickness * 1e6 for layer in stackup.copper] == approx(finished, rel=1e-9)
    assert stackup.line_foil((1, 2, 3, 4)) == approx(line_foil * 1e-6, rel=1e-9)


def test_tail_without_layers_key_has_all_body_layers():
    spec = loaded("fpc:", "  stackup: flex-4l", "  tail: {length: 30}")
    assert spec.fpc.tail.layers == 4 and "fpc.tail.layers: 4, the default" in spec.source.defaults


@pytest.mark.parametrize(
    "lines",
    [
        (f"  stackup: {ROWS % ('18 um', '18 um')}", "  plating: 18 um"),
        ("  stackup: [{copper: 35 um}, {dielectric: 25 um}]", "  plating: 12 um"),
    ],
)
def test_impossible_plating_is_refused_at_its_key(lines):
    with pytest.raises(SpecError) as stop:
        loaded("fpc:", *lines)
    assert [(finding.rule, finding.key) for finding in stop.value.findings] == [("SIT009", "fpc.plating")]


def test_written_stackup_equal_to_preset_has_equal_tolerances():
    preset = loaded("fpc: {stackup: flex-2l-30um}")
    own = loaded("fpc:", f"  stackup: {ROWS % ('30 um', '30 um')}")
    assert tolerance_sigmas(own) == approx(tolerance_sigmas(preset), rel=1e-9)


def test_written_rules_override_preset_rules():
    rules = loaded(
        "fpc: {rules: {based_on: generic-fine, via_drill: 0.2, name: shop, coil_trace_width: 0.2}}"
    ).fpc.rules
    assert (rules.name, rules.via_drill, rules.trace_width) == ("shop", 0.2e-3, 76e-6)
    assert rules.coil_rule_binding, "a coil rule that somebody writes is meant"
    assert rules.sources["via_drill"] == "the spec"


def test_jaw_and_materials_can_be_written_in_spec():
    spec = loaded(
        "mount: {jaw: {width: 4.5, length: 18, height: 2, material: {name: steel, conductivity: 1.4 MS/m}}}",
        "elastomer: {material: {name: own, shear_modulus: 24 kPa, uncertainty: 0.1}}",
        "target: {size: [4, 8], material: aluminium}",
    )
    assert spec.mount.jaw.width == 4.5e-3
    assert spec.mount.jaw.port_diameter == 5e-3
    assert spec.mount.jaw.material.conductivity == 1.4e6
    assert (spec.elastomer.material.shear_modulus, spec.elastomer.material.shear_modulus_sigma) == (24e3, 0.1)
    assert spec.elastomer.material.bulk_modulus == 1.5e9
    assert (spec.target.shape, spec.target.size) == ("rectangle", (0.004, 0.008))
    assert spec.elastomer.size == spec.target.size


def test_default_finger_is_listed_with_request_to_measure():
    spec = load_text("sitscad: 1\nname: tip\n" + COIL + "mount: {kind: fingertip}\n")
    (message,) = (item for item in spec.source.defaults if item.startswith("mount.finger"))
    assert "rectangle, 16 mm x 10 mm, grip 8 mm, screws of 2 mm" in message and "measure yours" in message


def test_empty_sections_get_listed_defaults():
    spec = loaded("target: {}", "elastomer: {}", "encapsulation: {}", "mount: {}", "shield: {}", "array: {}", "fpc: {}")
    assert spec.target.size == (3.5e-3, 3.5e-3)
    assert spec.mount.jaw.name == "generic-5mm"
    assert "mount.jaw: generic-5mm, the default" in spec.source.defaults
    assert "target.thickness: 0.2 mm, the default" in spec.source.defaults


def test_hexagon_turns_are_rounded_to_exact_sixth():
    coil = COIL.replace("circle", "hexagon").replace("6.5", "6.166667")
    assert loaded(coil=coil).coil.turns == 37 / 6


def test_missing_cable_inductance_is_derived_from_length_and_listed():
    spec = loaded("readout: {cable: {length: 150, resistance: 0.1 ohm}}")
    assert spec.readout.cable.inductance == approx(90e-9, rel=1e-6)
    assert spec.readout.cable.resistance == 0.1
    assert any("readout.cable.inductance: 90 nH" in text and "unverified" in text for text in spec.source.defaults)


@pytest.mark.parametrize(
    ("array", "centres"),
    [
        ("{pattern: line, count: 3, pitch: 4}", [(-4, 0), (0, 0), (4, 0)]),
        ("{count: 2, pitch: 4}", [(-2, 0), (2, 0)]),
        ("{count: [2, 2], pitch: 4}", [(-2, -2), (-2, 2), (2, -2), (2, 2)]),
        ("{pattern: triangle, pitch: 6}", [(-2 * math.sqrt(3), 0), (math.sqrt(3), -3), (math.sqrt(3), 3)]),
        ("{centres: [[5, 0], [0, 0.5 cm]]}", [(5, 0), (0, 5)]),
        ("{pattern: single}", [(0, 0)]),
        ("{pattern: single, count: 1}", [(0, 0)]),
        ("{pattern: line}", [(-2, 0), (2, 0)]),
        ("{pattern: grid}", [(-2, -2), (-2, 2), (2, -2), (2, 2)]),
        ("{pattern: line, count: 1}", [(0, 0)]),
    ],
)
def test_array_centres_follow_pattern(array, centres):
    result = [placement.centre for placement in loaded(f"array: {array}").array.placements]
    assert result == [approx((x * 1e-3, y * 1e-3), abs=1e-12) for x, y in centres]


def test_pitch_with_exactly_minimum_spacing_is_accepted():
    assert loaded("array: {count: 2, pitch: 3.6}").array.pitch == 3.6e-3


@pytest.mark.parametrize(
    ("shape", "size", "offset", "expected"),
    [
        ("circle", (4, 4), (3, 4), 1),
        ("square", (4, 4), (5, 4), 1),
        ("square", (4, 4), (3, 3), -1),
        ("rectangle", (8, 4), (5, 5), 1),
        ("racetrack", (8, 4), (4, 5), 1),
        ("racetrack", (8, 4), (9, 0), 1),
        ("octagon", (4, 4), (5, 0), 1),
        ("hexagon", (4, 4), (0, 5), 5 - 4 / math.cos(math.pi / 6)),  # corner to corner
    ],
)
def test_gap_between_coils_matches_expected_value(shape, size, offset, expected):
    assert coil_gap(shape, size, *coil_placements(((0, 0), offset))) == approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("shape", "turns", "whole", "nearest"),
    [
        ("circle", 6.37, True, 6.37),
        ("square", 6.25, True, 6.25),
        ("square", 6.3, False, 6.25),
        ("hexagon", 6.166667, True, 37 / 6),
        ("hexagon", 6.2, False, 37 / 6),
        ("octagon", 6.125, True, 6.125),
        ("racetrack", 6.5, True, 6.5),
        ("racetrack", 6.25, False, 6.0),
    ],
)
def test_turns_are_rounded_to_allowed_ends_of_shape(shape, turns, whole, nearest):
    assert SHAPES[shape].is_whole(turns) is whole
    assert SHAPES[shape].nearest_turns(turns) == approx(nearest, rel=1e-6)


@pytest.mark.parametrize(
    ("shape", "size", "most"),
    [
        ("circle", (4.05, 4.05), 9.625),
        ("square", (4.05, 4.05), 9.75),
        ("octagon", (4.05, 4.05), 9.875),
        ("racetrack", (8, 4.05), 10.0),
        ("circle", (0.2, 0.2), 0.0),
    ],
)
def test_maximum_turns_keep_innermost_trace_off_centre(shape, size, most):
    """Pitch 0.2, width 0.1: the room for pitches is (4.05/2 - 0.1) / 0.2 = 9.625."""
    assert SHAPES[shape].most_turns(size, 0.1, 0.2) == approx(most, abs=1e-6)


def test_rule_ids_are_consecutive_with_complete_unique_texts():
    assert list(RULE_NAMES) == [f"SIT{number:03d}" for number in range(1, len(RULE_NAMES) + 1)]
    assert all(row["summary"] and row["why"] and row["mend"] for row in RULE_TEXTS.values())
    assert len({row["name"] for row in RULE_TEXTS.values()}) == len(RULE_TEXTS)


def test_equal_texts_give_equal_specs_and_hashes():
    assert load_text(MINIMAL) == load_text(MINIMAL)
    assert load_text(MINIMAL).source.sha256 == load_text(MINIMAL).source.sha256


def test_loading_a_spec_imports_no_heavy_package():
    script = f"import sys; from sitscad.spec.load import load_text; load_text({MINIMAL!r}); print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT)
    heavy = {"numpy", "scipy", "pydantic_core", "email", "importlib.metadata", "build123d", "matplotlib", "shapely"}
    assert not heavy & set(done.stdout.split())


@pytest.mark.parametrize("coefficient", ["-0.005 1/K", "0.012 1/K"])
@pytest.mark.parametrize("temperature", ["-60 degC", "200 degC"])
def test_accepted_temperature_coefficients_leave_positive_resistivity(coefficient, temperature):
    """A coefficient of 2 % a kelvin left no resistivity at -40 degC: an internal error of the estimate."""
    metal = f"{{name: x, conductivity: 58 MS/m, temperature_coefficient: {coefficient}}}"
    spec = loaded(f"target: {{size: 8, material: {metal}}}", f"requirements: {{temperature: {temperature}}}")
    warmth = spec.requirements.temperature - 20.0
    assert 1.0 + spec.target.material.temperature_coefficient * warmth > 0.0


PLACED = """sitscad: 1
name: placed
coil: {shape: circle, outer_diameter: 6, turns: 8, trace_width: 100 um, trace_spacing: 100 um, layers: 2}
fpc: {margin: %s}
target: {offset: %s, rotation: %s}
elastomer: {offset: %s}
"""


def test_offset_and_rotation_keys_accept_units():
    spec = load_text(PLACED % ("[0.2, 100 um]", "[0.5, -20 mil]", "45 deg", "[0, 0.1 mm]"))
    assert spec.fpc.margin == approx((0.2e-3, 0.1e-3), rel=1e-6)
    assert spec.target.offset == approx((0.5e-3, -0.508e-3), rel=1e-6)
    assert spec.target.rotation == approx(math.radians(45.0), rel=1e-6)
    assert spec.elastomer.offset == approx((0.0, 0.1e-3), rel=1e-6, abs=1e-12)
    plain = load_text(PLACED.partition("fpc")[0] + "target: {size: 5}\n")
    assert (plain.fpc.margin, plain.target.offset, plain.target.rotation) == ((0.0, 0.0), (0.0, 0.0), 0.0)


@pytest.mark.parametrize(
    ("values", "key", "rule", "words"),
    [
        (("-0.1", "[0, 0]", "0 deg", "[0, 0]"), "fpc.margin", "SIT006", "out of range"),
        (("[1, 2, 3]", "[0, 0]", "0 deg", "[0, 0]"), "fpc.margin", "SIT004", "[x, y]"),
        (("0", "1", "0 deg", "[0, 0]"), "target.offset", "SIT004", "[x, y]"),
        (("0", "[0, 0]", "45", "[0, 0]"), "target.rotation", "SIT005", "deg"),
        (("0", "[0, 0]", "0 deg", "[0, 1 N]"), "elastomer.offset", "SIT005", "mm"),
    ],
)
def test_invalid_offsets_and_rotations_are_reported_at_their_line(values, key, rule, words):
    text = PLACED % values
    with pytest.raises(SpecError) as refused:
        load_text(text)
    (findings,) = refused.value.findings
    section = key.split(".")[0]
    assert (findings.rule, findings.key) == (rule, key)
    assert text.splitlines()[findings.line - 1].startswith(section) and words in findings.message + findings.hint


@pytest.mark.parametrize(
    ("turns", "layers", "count", "refused"),
    [
        (126, 4, 1, (504, 500)),
        (125, 4, 5, (2500, 2000)),
        (125, 4, 4, None),
        (30, 8, 8, None),
    ],
)
def test_too_many_turns_for_estimates_are_refused_on_load(turns, layers, count, refused):
    """They took three gigabytes and minutes, or ended for want of memory."""
    coil = f"{{shape: circle, outer_diameter: 80, turns: {turns}, layers: {layers}, trace_width: 100 um, "
    array = f"array: {{pattern: line, count: {count}, pitch: 90}}" if count > 1 else ""
    text = f"sitscad: 1\nname: large\ncoil: {coil}trace_spacing: 100 um}}\n{array}\n"
    if refused is None:
        assert load_text(text).coil.turns == turns
        return
    with pytest.raises(SpecError) as raised:
        load_text(text)
    (finding,) = raised.value.findings
    assert (finding.rule, finding.measured, finding.limit, finding.line) == ("SIT019", *refused, 3)


def test_tolerance_as_large_as_its_thickness_is_refused():
    """A pad of 1 mm +- 5 mm was only unusual: half a band can be no more than what comes out of it."""
    plates = "target: {size: 4, thickness: 0.2}\nelastomer: {size: 4, thickness: 1}\n"
    for part, least in (("elastomer", 1.0), ("target", 0.2), ("elastomer_size", 4.0), ("target_size", 4.0)):
        with pytest.raises(SpecError) as refused:
            loaded(f"{plates}assembly: {{tolerances: {{{part}: {least}}}}}")
        (findings,) = refused.value.findings
        assert (findings.rule, findings.key, findings.line) == ("SIT009", f"assembly.tolerances.{part}", 6)
        assert findings.measured == findings.limit == approx(1e-3 * least, rel=1e-9)
        loaded(f"{plates}assembly: {{tolerances: {{{part}: {0.9 * least}}}}}")
    loaded(f"{plates}assembly: {{tolerances: {{placement: 5, shield: 5}}}}")
