"""Line and column of every finding are those of the key that it names, or of its nearest parent."""

from __future__ import annotations

import random
import re

import pytest
from ruamel.yaml import YAML
from ruamel.yaml.nodes import MappingNode, ScalarNode

from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError

HEAD = "sitscad: 1\nname: x\n"
COIL = "coil: {shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 0.1, trace_spacing: 0.1}\n"


def findings(text):
    try:
        load_text(text, "x.yaml")
    except SpecError as error:
        return error.findings
    return ()


def pointed_at(text):
    """Rule, key and the text at the place of every finding."""
    lines = text.split("\n")
    return [(f.rule, f.key, lines[f.line - 1][f.column - 1 :].strip()) for f in findings(text)]


def test_list_entries_after_empty_entry_keep_their_index_and_place():
    """The empty entry was taken out first: what followed it was sought one place too early, and found nowhere."""
    text = f"{HEAD}{COIL}fpc:\n  stackup:\n    -\n    - {{coper: 35 um}}\n    - {{copper: 35 um}}\n"
    assert pointed_at(text) == [
        ("SIT004", "fpc.stackup.0", "-"),
        ("SIT002", "fpc.stackup.1.coper", "coper: 35 um}"),
    ]


def test_pair_with_empty_entry_reports_only_empty_entry():
    text = f"{HEAD}{COIL}array: {{pattern: explicit, centres: [[0, 0], [~, 3]]}}\n"
    assert pointed_at(text) == [("SIT004", "array.centres.1.0", "~, 3]]}")]
    text = f"{HEAD}{COIL}array: {{pattern: explicit, centres: [~, [2, x]]}}\n"
    assert [key for _, key, _ in pointed_at(text)] == ["array.centres.0", "array.centres.1"]


def test_key_containing_dot_is_not_confused_with_section_key():
    """The value in the section was said to stand at the key of that name at the top."""
    text = f"{HEAD}{COIL.replace('turns: 14', 'turns: -14')}coil.turns: 5\n"
    (_, _, value), (_, key, top) = pointed_at(text)
    assert value.startswith("-14") and (key, top) == ("coil.turns", "coil.turns: 5")
    (result,) = [f for f in findings(f"{HEAD}{COIL}fpc: {{tail.length: }}\n") if f.rule == "SIT004"]
    assert (result.key, result.line, result.column) == (
        "fpc.tail.length",
        4,
        7,
    ) and "fpc.tail.length: has" in result.message


def test_duplicate_key_in_duplicate_section_is_reported_by_written_key():
    """Its key was an inner word of the reader's."""
    text = f"{HEAD}{COIL}fpc: {{boards: 3}}\nfpc: {{boards: 3, boards: 4}}\n"
    assert pointed_at(text) == [
        ("SIT012", "fpc", "fpc: {boards: 3, boards: 4}"),
        ("SIT012", "fpc.boards", "boards: 4}"),
    ]
    text = f"{HEAD}{COIL.replace('14', '-14')}coil: {{turns: 3}}\n"
    assert [here[:3] for rule, _, here in pointed_at(text) if rule == "SIT006"] == ["-14"]


def test_key_equal_to_internal_tag_is_reported_as_unknown():
    assert pointed_at(f"{HEAD}{COIL}fpc: {{<name>: 3}}\n") == [("SIT002", "fpc.<name>", "<name>: 3}")]


@pytest.mark.parametrize(
    ("section", "key", "at"),
    [
        ("fpc: {rules: {name: ours, source: asked, read 2026-11-20, trace_width: 90 um}}", "fpc.rules.read 2026-11-20",
         "read 2026-11-20"),
        ("fpc: {tail: [length: 30, connector: zif]}", "fpc.tail", "[length"),
        ("fpc:\n  tail:\n  - length: 30", "fpc.tail", "tail:"),
        ("array: {pattern: explicit, centres: [[[1]], [2, 3]]}", "array.centres.0", "[[1]]"),
        ("fpc:\n  stackup:\n  - - {copper: 35 um}", "fpc.stackup.0", "- {copper"),
    ],
)
def test_value_of_wrong_form_is_reported_at_its_place(section, key, at):
    ((_, result, here),) = pointed_at(f"{HEAD}{COIL}{section}\n")
    assert result == key and here.startswith(at)


# ---------------------------------------------------------------------------------------------------------- mutations

WHOLE = """\
sitscad: 1
name: mutant
coil: {shape: circle, outer_diameter: 8, turns: [14, 13], layers: 2, trace_width: 100 um, trace_spacing: 100 um}
array: {pattern: explicit, centres: [[-5, 0], [5, 0]], rotations: [0 deg, 90 deg]}
fpc:
  stackup:
    - {copper: 35 um}
    - {dielectric: 25 um, material: polyimide}
    - {copper: 35 um}
  rules: {name: ours, trace_width: {value: 90 um, source: asked}, source: "asked, read 2026-11-20"}
  tail: {length: 30, connector: zif-0.5mm, layers: 2, bend: static}
target: {shape: rectangle, size: [8, 6], thickness: 0.2, material: {name: tin, conductivity: 8 MS/m}}
elastomer: {material: {name: soft, shear_modulus: 20 kPa}, shape: square, size: 8, thickness: 2}
readout:
  cable: {length: 300, inductance: 180 nH, capacitance: 30 pF, resistance: 0.3 ohm}
requirements: {normal_force: 4.8 N}
"""
BITS = ["[", "]", "{", "}", ": ", ", ", "- ", "? ", "'", " #", "\n", "\n  ", "~", "-3", "x", "[~, 1]", "[[1]]", "[]",
        "{a: 1}", "turns: 3", "a.b: 1", "coil.turns: 5", "<name>", "'key': 1", ""]


def mutated(chance):
    text = WHOLE
    for _ in range(chance.choice([1, 1, 2])):
        kind, spot = chance.randrange(4), chance.randrange(len(text))
        lines = text.split("\n")
        line = chance.randrange(len(lines))
        if kind == 0:
            text = text[:spot] + chance.choice(BITS) + text[spot:]
        elif kind == 1:
            text = text[:spot] + text[spot + chance.randrange(1, 8) :]
        elif kind == 2:
            lines[line] = chance.choice([f"  {lines[line]}", lines[line].lstrip(), f"- {lines[line]}", ""])
            text = "\n".join(lines)
        else:
            result = chance.choice(list(re.finditer(r": *([^,{}\[\]\n#]+)", text)))
            text = text[: result.start(1)] + chance.choice(BITS) + text[result.end(1) :]
    return text


def entries(node):
    if isinstance(node, MappingNode):
        return [(str(key.value), key, value) for key, value in node.value if isinstance(key, ScalarNode)]
    if isinstance(node, ScalarNode) or node is None:
        return []
    return [(str(index), value, value) for index, value in enumerate(node.value)]


def marks(node, key, own):
    """Whether a dotted key is there in the tree of nodes, and where it or its nearest parent stands."""
    if not key:
        return True, own
    whole, part = set(), set()
    for name, at, value in entries(node):
        if key == name or key.startswith(f"{name}."):
            here = {(mark.line + 1, mark.column + 1) for mark in (at.start_mark, value.start_mark)}
            here |= {(mark.line + 1, mark.column) for mark in (at.start_mark,) if at is value and at.value == ""}
            is_there, result = marks(value, key[len(name) + 1 :], here)
            (whole if is_there else part).update(result)
    return (True, whole) if whole else (False, part or own)


@pytest.mark.slow
def test_findings_of_mutated_specs_point_at_their_keys():
    seen = 0
    for seed in range(200):
        text = mutated(random.Random(seed))
        reader = YAML(typ="rt", pure=True)
        reader.allow_duplicate_keys = True
        for finding in findings(text):
            if finding.key:
                _, places = marks(reader.compose(text), finding.key, {(1, 1)})
                assert (finding.line, finding.column) in places, (seed, finding)
                seen += 1
    assert seen > 60
