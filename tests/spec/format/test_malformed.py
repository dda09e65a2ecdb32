"""Malformed specs: every one gets the right rule at the right line and column, and never a traceback.

Most are made from one good spec by replacing one value, misspelling one key or dropping one line; the rest are written
out.
"""

from __future__ import annotations

import re

import pytest

from sitscad.basics.finding import Severity
from sitscad.spec.load import load_text
from sitscad.spec.reading import RULE_NAMES, SpecError

GOOD = """\
sitscad: 1
name: pad-1
coil:
  shape: circle
  outer_diameter: 4.0
  turns: 7.75
  layers: 4
  trace_width: 80 um
  trace_spacing: 80 um
  start_angle: 90 deg
  sense: clockwise
  corner_radius: 0
array:
  pattern: line
  count: 2
  pitch: 4.5
fpc:
  stackup: flex-4l
  rules: generic-fine
  tail:
    length: 30
    connector: zif-0.5mm
    layers: 2
    bend: static
target:
  shape: square
  size: 4.5
  thickness: 0.2
  material: copper
  kerf: 0.05
elastomer:
  material: dragon-skin-10
  shape: square
  size: 4.5
  thickness: 1
  kerf: 0.15
encapsulation:
  material: pdms
  thickness: 0.1
mount:
  kind: grasper-pad
  jaw: generic-5mm
  standoff: 0.7
shield:
  material: copper
  thickness: 0.1
  gap: 0.6
readout:
  device: ldc1614
  capacitance: 220 pF
  capacitor_at: converter
  cable:
    length: 300
    inductance: 180 nH
    capacitance: 30 pF
    resistance: 0.3 ohm
  clock: 40 MHz
  scan_rate: 500 Hz
requirements:
  normal_force: 4.8 N
  shear_force: 1 N
  bandwidth: 100 Hz
"""
LINES = GOOD.splitlines()


def places():
    """Dotted key to its line number and column, by indentation alone."""
    result, stack = {}, []
    for number, line in enumerate(LINES, 1):
        indent = len(line) - len(line.lstrip())
        stack = [*stack[: indent // 2], line.strip().split(":")[0]]
        result[".".join(stack)] = (number, indent + 1)
    return result


PLACES = places()
SECTIONS = [key for key in PLACES if LINES[PLACES[key][0] - 1].endswith(":")]
LENGTHS = [
    "coil.outer_diameter",
    "coil.trace_width",
    "coil.trace_spacing",
    "coil.corner_radius",
    "array.pitch",
    "fpc.tail.length",
    "target.size",
    "target.thickness",
    "target.kerf",
    "elastomer.size",
    "elastomer.thickness",
    "elastomer.kerf",
    "encapsulation.thickness",
    "mount.standoff",
    "shield.thickness",
    "shield.gap",
    "readout.cable.length",
]
BAD_LENGTHS = [
    ("12 pF", "SIT005"),
    ("12 furlong", "SIT005"),
    ("1 2 mm", "SIT005"),
    ("abc", "SIT004"),
    ("1,5", "SIT004"),
    ("true", "SIT004"),
    ("{a: 1}", "SIT004"),
    ("[1, 2, 3]", "SIT004"),
    (".nan", "SIT006"),
    ("-.inf", "SIT006"),
    ("1e99", "SIT006"),
    ("1e4000 mm", "SIT006"),
    ("-1", "SIT006"),
    ("9" * 5000, "SIT006"),
]
QUANTITIES = {
    "coil.start_angle": "pF",
    "readout.capacitance": "Hz",
    "readout.cable.inductance": "pF",
    "readout.cable.capacitance": "nH",
    "readout.cable.resistance": "N",
    "readout.clock": "kPa",
    "readout.scan_rate": "ohm",
    "requirements.normal_force": "Hz",
    "requirements.shear_force": "mm",
    "requirements.bandwidth": "m",
}
NUMBERS = ["coil.turns", "coil.layers", "array.count", "fpc.tail.layers"]
BAD_NUMBERS = [
    ("many", "SIT004"),
    ('"2"', "SIT004"),
    ("2 mm", "SIT004"),
    ("false", "SIT004"),
    ("{a: 1}", "SIT004"),
    ("0", "SIT006"),
    ("-3", "SIT006"),
    ("1000000", "SIT006"),
    (".inf", "SIT006"),
    (".nan", "SIT006"),
]
CHOICES = {
    "coil.shape": ("circel", "circle"),
    "coil.sense": ("clokwise", "clockwise"),
    "array.pattern": ("lime", "line"),
    "fpc.stackup": ("flex-4", "flex-4l"),
    "fpc.rules": ("generic-fin", "generic-fine"),
    "fpc.tail.connector": ("zif-0.5", "zif-0.5mm"),
    "fpc.tail.bend": ("statick", "static"),
    "target.shape": ("sqare", "square"),
    "target.material": ("Copper", "copper"),
    "elastomer.material": ("dragonskin-10", "dragon-skin-10"),
    "elastomer.shape": ("circlle", "circle"),
    "encapsulation.material": ("PDMS", "pdms"),
    "mount.kind": ("grasper_pad", "grasper-pad"),
    "mount.jaw": ("generic-5", "generic-5mm"),
    "shield.material": ("ferite", "ferrite"),
    "readout.device": ("ldc-1612", "ldc1612"),
    "readout.capacitor_at": ("convertor", "converter"),
}


def with_value(key, value):
    """The good spec with another value, and where that value stands."""
    number, column = PLACES[key]
    indent, name = column - 1, key.rpartition(".")[2]
    lines = [*LINES]
    lines[number - 1] = f"{' ' * indent}{name}: {value}"
    return "\n".join(lines) + "\n", number, column + len(name) + 2


def value_cases():
    for key in LENGTHS:
        yield from ((key, *case) for case in BAD_LENGTHS)
    for key, other in QUANTITIES.items():
        number = LINES[PLACES[key][0] - 1].split(": ")[1].split()[0]
        yield key, number, "SIT005"
        yield key, f"{number} {other}", "SIT005"
        yield key, f"{number} parsec", "SIT005"
        yield key, "lots", "SIT004"
        yield key, "[1]", "SIT004"
        yield key, "true", "SIT004"
        yield key, ".inf", "SIT006"
        yield key, LINES[PLACES[key][0] - 1].split(": ")[1].replace(number, "-1e9"), "SIT006"
    for key in NUMBERS:
        yield from ((key, *case) for case in BAD_NUMBERS)
    for key, (wrong, _) in CHOICES.items():
        yield key, wrong, "SIT007"
        yield key, "7.5", "SIT004"
    for key in SECTIONS:
        if key not in ("fpc.tail", "readout.cable"):
            yield key, "soon", "SIT004"


VALUE_CASES = list(value_cases())


def findings_of(text):
    with pytest.raises(SpecError) as caught:
        load_text(text, "spec.yaml")
    for finding in caught.value.findings:
        assert finding.severity is Severity.ERROR
        assert finding.name == RULE_NAMES[finding.rule]
        assert finding.message and "Traceback" not in finding.message
        assert len(finding.message) < 300
        assert finding.line >= 1 and finding.column >= 1
    return caught.value.findings


def test_unchanged_spec_of_these_tests_loads():
    assert load_text(GOOD).name == "pad-1"


def test_more_than_200_wrong_values_are_tested():
    assert len(VALUE_CASES) > 200


@pytest.mark.parametrize(("key", "value", "rule"), VALUE_CASES, ids=lambda part: str(part)[:24])
def test_wrong_value_is_reported_with_its_line_column_and_key(key, value, rule):
    if key in SECTIONS:
        number, column = PLACES[key]
        stored = [line for line in LINES[number:] if len(line) - len(line.lstrip()) < column]
        rest = stored and LINES[LINES.index(stored[0], number) :]
        lines = [*LINES[: number - 1], f"{key}: {value}", *rest]
        text, column = "\n".join(lines) + "\n", len(key) + 3
    else:
        text, number, column = with_value(key, value)
    (finding,) = findings_of(text)
    assert (finding.rule, finding.line, finding.column, finding.key) == (rule, number, column, key)


@pytest.mark.parametrize(("key", "names"), CHOICES.items())
def test_misspelt_value_suggests_nearest_allowed_value(key, names):
    text, _, _ = with_value(key, names[0])
    assert f"did you mean {names[1]}?" in findings_of(text)[0].hint


@pytest.mark.parametrize("key", [key for key in PLACES if key != "sitscad"])
def test_misspelt_key_is_reported_and_correct_key_suggested(key):
    number, column = PLACES[key]
    name = key.rpartition(".")[2]
    lines = [*LINES]
    lines[number - 1] = lines[number - 1].replace(f"{name}:", f"{name}x:", 1)
    finding = next(f for f in findings_of("\n".join(lines)) if f.rule == "SIT002")
    assert (finding.line, finding.column, finding.key) == (number, column, f"{key}x")
    assert f"did you mean {name}?" in finding.hint


@pytest.mark.parametrize("section", ["", *SECTIONS])
def test_unknown_key_is_reported_in_every_section(section):
    number, column = PLACES[section] if section else (0, -1)
    lines = [*LINES[:number], " " * (column + 1) + "bogus: 1", *LINES[number:]]
    (finding,) = findings_of("\n".join(lines))
    assert (finding.rule, finding.line, finding.column) == ("SIT002", number + 1, column + 2)


@pytest.mark.parametrize(
    "key",
    ["sitscad", "name", "coil.shape", "coil.outer_diameter", "coil.turns", "coil.trace_width", "coil.trace_spacing"],
)
def test_missing_key_is_reported_at_place_of_its_section(key):
    lines = [line for number, line in enumerate(LINES, 1) if number != PLACES[key][0]]
    (finding,) = findings_of("\n".join(lines))
    parent = key.rpartition(".")[0]
    shift = 1 if parent and PLACES[parent][0] > PLACES[key][0] else 0
    line, column = (PLACES[parent][0] - shift, 1) if parent else (1, 1)
    assert (finding.rule, finding.key, finding.line, finding.column) == ("SIT003", key, line, column)


@pytest.mark.parametrize("key", [key for key in PLACES if key not in SECTIONS])
def test_empty_value_is_reported_at_its_key(key):
    text, number, _ = with_value(key, "")
    (finding,) = findings_of(text)
    assert (finding.rule, finding.line, finding.column, finding.key) == ("SIT004", number, PLACES[key][1], key)


@pytest.mark.parametrize("key", [key for key in PLACES if key not in SECTIONS])
def test_duplicate_key_is_reported_at_second_place(key):
    number, column = PLACES[key]
    lines = [*LINES[:number], LINES[number - 1], *LINES[number:]]
    (finding,) = findings_of("\n".join(lines))
    assert (finding.rule, finding.line, finding.column, finding.key) == ("SIT012", number + 1, column, key)


CONTRADICTIONS = [
    ({"coil.layers": "6"}, "SIT009", "coil.layers"),
    ({"coil.layers": "[1, 5]"}, "SIT009", "coil.layers"),
    ({"coil.layers": "[2, 1]"}, "SIT009", "coil.layers"),
    ({"coil.layers": "[1, 1]"}, "SIT009", "coil.layers"),
    ({"coil.layers": "[]"}, "SIT006", "coil.layers"),
    ({"coil.outer_diameter": "[4, 8]"}, "SIT009", "coil.outer_diameter"),
    ({"coil.corner_radius": "0.1"}, "SIT009", "coil.corner_radius"),
    ({"coil.shape": "square", "coil.corner_radius": "3"}, "SIT009", "coil.corner_radius"),
    ({"coil.shape": "racetrack", "coil.turns": "7.5"}, "SIT009", "coil.outer_diameter"),
    ({"coil.shape": "square", "coil.turns": "7.8"}, "SIT015", "coil.turns"),
    ({"coil.shape": "hexagon", "coil.turns": "7.3"}, "SIT015", "coil.turns"),
    ({"coil.shape": "octagon", "coil.turns": "7.3"}, "SIT015", "coil.turns"),
    ({"coil.shape": "racetrack", "coil.outer_diameter": "[4.2, 4]", "coil.turns": "7.25"}, "SIT015", "coil.turns"),
    ({"coil.turns": "12.5"}, "SIT016", "coil.turns"),
    ({"coil.turns": "200"}, "SIT016", "coil.turns"),
    ({"coil.trace_width": "2"}, "SIT016", "coil.outer_diameter"),
    ({"array.pitch": "4"}, "SIT014", "array.pitch"),
    ({"array.pitch": "4.079"}, "SIT014", "array.pitch"),
    ({"array.pattern": "triangle", "array.pitch": "3", "array.count": "3"}, "SIT014", "array.pitch"),
    ({"array.pattern": "single"}, "SIT009", "array.count"),
    ({"array.pattern": "single", "array.count": "1"}, "SIT009", "array.pitch"),
    ({"array.pattern": "explicit"}, "SIT003", "array.centres"),
    ({"array.pattern": "grid"}, "SIT009", "array.count"),
    ({"array.pattern": "grid", "array.count": "[10, 10]"}, "SIT006", "array.count"),
    ({"array.count": "[2, 2]"}, "SIT009", "array.count"),
    ({"array.count": "[2, 2, 2]"}, "SIT004", "array.count"),
    ({"array.count": "2.5"}, "SIT004", "array.count"),
    ({"fpc.tail.layers": "6"}, "SIT009", "fpc.tail.layers"),
    ({"target.size": "[4, 5]"}, "SIT009", "target.size"),
    ({"elastomer.size": "[4, 5]"}, "SIT009", "elastomer.size"),
    ({"mount.kind": "bench-plate"}, "SIT009", "mount.jaw"),
    ({"mount.standoff": "0.65"}, "SIT009", "mount.standoff"),
    ({"fpc.stackup": "[{copper: 18 um}, {copper: 18 um}]", "coil.layers": "2"}, "SIT009", "fpc.stackup.1"),
    (
        {"fpc.stackup": "[{copper: 18 um}, {coverlay: 18 um}, {copper: 18 um}]", "coil.layers": "2"},
        "SIT009",
        "fpc.stackup.1",
    ),
    (
        {"fpc.stackup": "[{copper: 18 um, dielectric: 2}]", "fpc.tail.layers": "1", "coil.layers": "1"},
        "SIT009",
        "fpc.stackup.0",
    ),
    ({"fpc.stackup": "[{coper: 18 um}]"}, "SIT002", "fpc.stackup.0.coper"),
    ({"fpc.stackup": "[{copper: 18 pF}]"}, "SIT005", "fpc.stackup.0.copper"),
    ({"fpc.stackup": "[{dielectric: 25 um, material: polymide}]"}, "SIT007", "fpc.stackup.0.material"),
    ({"fpc.stackup": "[7]"}, "SIT004", "fpc.stackup.0"),
    ({"fpc.stackup": "{copper: 18 um}"}, "SIT004", "fpc.stackup"),
    ({"fpc.rules": "{trace_with: 0.1}"}, "SIT002", "fpc.rules.trace_with"),
    ({"fpc.rules": "{trace_width: 0.1 N}"}, "SIT005", "fpc.rules.trace_width"),
    ({"fpc.rules": "{based_on: generic}"}, "SIT007", "fpc.rules.based_on"),
    ({"mount.jaw": "{width: 4.8, height: 1.3}"}, "SIT003", "mount.jaw.length"),
    ({"mount.jaw": "{width: 4.8, height: 1.3, length: 20, material: chrome}"}, "SIT007", "mount.jaw.material"),
    ({"target.material": "{name: silver}"}, "SIT003", "target.material.conductivity"),
    ({"target.material": "{conductivity: 62}"}, "SIT005", "target.material.conductivity"),
    ({"elastomer.material": "{name: own}"}, "SIT003", "elastomer.material.shear_modulus"),
    ({"elastomer.material": "{shear_modulus: 24}"}, "SIT005", "elastomer.material.shear_modulus"),
    ({"elastomer.material": "{shear_modulus: 24 kPa, uncertainty: lots}"}, "SIT004", "elastomer.material.uncertainty"),
    ({"name": "Pad"}, "SIT006", "name"),
    ({"name": "../pad"}, "SIT006", "name"),
    ({"name": "-pad"}, "SIT006", "name"),
    ({"name": "pad 1"}, "SIT006", "name"),
    ({"name": "p" * 65}, "SIT006", "name"),
    ({"name": "2026"}, "SIT004", "name"),
    ({"name": "[pad]"}, "SIT004", "name"),
    ({"sitscad": "2"}, "SIT008", "sitscad"),
    ({"sitscad": "true"}, "SIT008", "sitscad"),
    ({"sitscad": "one"}, "SIT008", "sitscad"),
    ({"sitscad": '"1"'}, "SIT008", "sitscad"),
]


@pytest.mark.parametrize(("changes", "rule", "key"), CONTRADICTIONS, ids=lambda part: str(part)[:40])
def test_contradictory_values_are_reported_at_their_key(changes, rule, key):
    text = GOOD
    for changed, value in changes.items():
        number, column = PLACES[changed]
        lines = text.splitlines()
        name = changed.rpartition(".")[2]
        lines[number - 1] = f"{' ' * (column - 1)}{name}: {value}"
        text = "\n".join(lines) + "\n"
    finding = next(f for f in findings_of(text) if f.key == key)
    written = next(
        k for k in (key, *(key[: m.start()] for m in reversed(list(re.finditer(r"\.", key))))) if k in PLACES
    )
    assert (finding.rule, finding.line) == (rule, PLACES[written][0])


def test_all_faults_of_a_spec_are_reported_together():
    text = GOOD.replace("turns", "turn").replace("4.8 N", "4.8").replace("flex-4l", "flex-9l").replace("4.5", "-4.5", 1)
    findings = [(f.rule, f.key) for f in findings_of(text)]
    assert findings == [
        ("SIT003", "coil.turns"),
        ("SIT002", "coil.turn"),
        ("SIT006", "array.pitch"),
        ("SIT007", "fpc.stackup"),
        ("SIT005", "requirements.normal_force"),
    ]


def test_unsupported_format_version_suppresses_all_other_findings():
    text = GOOD.replace("sitscad: 1", "sitscad: 2").replace("turns", "rounds")
    assert [f.rule for f in findings_of(text)] == ["SIT008"]


def test_key_in_wrong_section_suggests_correct_section():
    (finding,) = findings_of(GOOD.replace("  bandwidth", "  scan_rate: 500 Hz\n  bandwidth"))
    assert "did you mean readout.scan_rate?" in finding.hint


def test_decimal_comma_in_braces_gives_hint_about_decimals():
    (finding,) = findings_of("sitscad: 1\nname: a\ncoil: {shape: circle, trace_spacing: 0,1}\n")
    assert finding.rule == "SIT013" and "decimal" in finding.hint
    (finding,) = findings_of("sitscad: 1\nname: a\ncoil: {true: 1}\n")
    assert finding.rule == "SIT013" and "decimal" not in finding.hint


def test_impossible_turns_of_square_suggest_nearest_quarter():
    text, _, _ = with_value("coil.turns", "7.8")
    (finding,) = findings_of(text.replace("shape: circle", "shape: square"))
    assert "7.75" in finding.hint
    assert finding.limit == 7.75


def test_too_many_turns_message_states_maximum():
    text, _, _ = with_value("coil.turns", "13")
    (finding,) = findings_of(text)
    assert "at most 11.99" in finding.message  # (4.0 / 2 - 0.08) / 0.16 = 12 turns touch the centre


@pytest.mark.parametrize(
    ("section", "named"),
    [
        ("elastomer: {material: ecoflex, thickness: 1}", "ecoflex-00-10, ecoflex-00-20, ecoflex-00-30, ecoflex-00-50"),
        ("target: {shape: square, size: 4, thickness: 0.2, material: stainless}",
         "stainless-17-4ph, stainless-304, stainless-316l"),
    ],
)
def test_material_family_name_lists_members_without_suggesting_one(section, named):
    coil = "{shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 100 um, trace_spacing: 100 um}"
    (finding,) = findings_of(f"sitscad: 1\nname: a\ncoil: {coil}\n{section}\n")
    assert f" {named};" in finding.hint and "did you mean" not in finding.hint
