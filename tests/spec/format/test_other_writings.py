"""Values as people write them elsewhere are read as what they say, or refused; they never become another number."""

from __future__ import annotations

import pytest
from tolerance import approx

import sitscad
from sitscad import SpecError
from sitscad.spec.format.kinds import Boolean, Layers, Number, NumberOrList, Refusal, UnitValue, is_misspelling
from sitscad.spec.yaml.rewriting import rewritten
from sitscad.spec.yaml.source import TextError, read_yaml

SPEC = """\
sitscad: 1
name: other
coil: {shape: circle, outer_diameter: 7, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
readout: {capacitance: 330 pF}
requirements: {normal_force: 4 N}
"""


def _findings(old, new):
    assert old in SPEC
    with pytest.raises(SpecError) as caught:
        sitscad.load_text(SPEC.replace(old, new))
    return caught.value.findings


@pytest.mark.parametrize(("old", "new", "meant"), [
    ("330 pF", "330 MF", None),
    ("330 pF", "330 mF", None),
    ("330 pF", "330 PF", "330 pF"),
    ("outer_diameter: 7", "outer_diameter: 7 MM", "7 mm"),
])
def test_unit_prefix_fixes_are_unsafe_and_within_allowed_range(old, new, meant):
    (finding, *_) = _findings(old, new)
    fixes = [edit.new for fix in finding.fixes for edit in fix.edits]
    assert fixes == ([meant] if meant else [])
    assert not any(fix.is_safe for fix in finding.fixes)
    assert "did you mean" in finding.hint if meant else "did you mean" not in finding.hint


@pytest.mark.parametrize(("word", "meant", "is_sure"), [
    ("ecoflex-00-40", "ecoflex-00-30", False),
    ("ldc1613", "ldc1614", False),
    ("ecoflex_00_30", "ecoflex-00-30", True),
    ("circel", "circle", True),
])
def test_similar_name_with_other_digits_is_no_sure_fix(word, meant, is_sure):
    assert is_misspelling(word, meant) is is_sure


@pytest.mark.parametrize(("word", "meant"), [("fr4", "FR4"), ("FR-4", "FR4"), ("fr4-prepeg", "FR4-prepreg")])
def test_material_name_is_suggested_in_any_letter_case(word, meant):
    layers = f"[{{copper: 35 um}}, {{dielectric: 1, material: {word}}}, {{copper: 35 um}}]"
    (finding,) = _findings("readout:", f"fpc: {{stackup: {layers}}}\nreadout:")
    assert finding.rule == "SIT007" and f"did you mean {meant}?" in finding.hint


TABBED = {
    "after a colon": ("turns:\t12\n", {"turns": 12}),
    "several after a colon": ("turns: \t\t 12\n", {"turns": 12}),
    "before a comment": ("turns: 12\t# of copper\nlayers: 2\t\n", {"turns": 12, "layers": 2}),
    "before a unit": ("width: 100\tum\n", {"width": "100 um"}),
    "in braces": ("coil: {turns:\t12,\tlayers: 2\t}\n", {"coil": {"turns": 12, "layers": 2}}),
    "in brackets": ("layers: [1,\t2\t]\t# both\n", {"layers": [1, 2]}),
    "after a dash": ("a:\n  -\t1\n", {"a": [1]}),
    "in quotes": ('a: "x\ty"\nb: \'x\ty\'\n', {"a": "x\ty", "b": "x\ty"}),
    "before a comment of its own line": ("a: 1\n\t# more\nb: 2\n", {"a": 1, "b": 2}),
    "on an empty line": ("a: 1\n\t\nb: 2\n", {"a": 1, "b": 2}),
}


@pytest.mark.parametrize("where", TABBED)
def test_tab_outside_indentation_is_read_as_space(where):
    text, values = TABBED[where]
    assert read_yaml(text).data == values


@pytest.mark.parametrize("text", ["a:\n\tb: 1\n", "a:\n  b: 1\n \tc: 2\n", "\ta: 1\n"])
def test_tab_as_indentation_is_refused(text):
    with pytest.raises(TextError) as caught:
        read_yaml(text)
    assert caught.value.rule == "SIT001" and "indent" in caught.value.hint


def test_replaced_value_in_text_with_tabs_keeps_other_tabs():
    text = SPEC.replace("turns: 12", "turns:\t12\t").replace("4 N", "4\tN")
    spec = sitscad.load_text(text)
    assert spec.coil.turns == 12
    changed = spec.replace("coil.turns", 11)
    assert changed.source.text == text.replace("\t12\t", "\t11\t")
    assert rewritten(text, ()) == text


NUMBER, LENGTH, FORCE = Number(1, 100), UnitValue("length", "1 um", "500 mm"), UnitValue("force", "1 mN", "100 N")
READ = {
    "012": 12, "+7": 7, "1e1": 10, "0o17": 15, "0x1F": 31, "12.": 12, ".5e1": 5, "-0": None, "1_0": None, "0b11": None,
    "1:30": None, ".inf": None, ".nan": None, "~": None, "yes": None, "on": None, "1,5": None, "1.000,5": None,
    "1 000": None, "1'000": None, "0X1F": None, "1e": None, "--1": None, "1.2.3": None, '"12"': None,
}
"""How a number may be written, by the number that YAML 1.2 has in it; None for what is refused."""


@pytest.mark.parametrize("written", READ)
@pytest.mark.parametrize("kind", [NUMBER, LENGTH, FORCE], ids=["number", "length", "force"])
def test_number_is_read_as_in_yaml_1_2_or_refused(written, kind):
    value, wanted = read_yaml(f"a: {written}\n").data["a"], READ[written]
    try:
        result = kind.read(value)
    except Refusal as error:
        meant = error.facts.get("meant")
        assert wanted is None or kind is FORCE, "it is a number"
        if meant and error.facts.get("is_sure", True):
            digits = written.replace("_", "").replace(",", ".").strip('"')
            assert kind.read(read_yaml(f"a: {meant}\n").data["a"]) == kind.read(read_yaml(f"a: {digits}\n").data["a"])
        return
    scale = 1e-3 if kind is LENGTH else 1
    assert result == approx((wanted if wanted is not None else float(written.strip('"'))) * scale, rel=1e-15, abs=0)


@pytest.mark.parametrize("version", ["1.1", "1.0", "2.0", "1.3"])
def test_yaml_directive_of_other_version_is_refused(version):
    with pytest.raises(TextError) as caught:
        read_yaml(f"%YAML {version}\n---\nturns: 012\n")
    assert caught.value.rule in ("SIT001", "SIT013")


def test_yaml_directive_1_2_is_accepted():
    assert read_yaml("%YAML 1.2\n---\nturns: 012\n").data == {"turns": 12}


@pytest.mark.parametrize(("written", "meant"), [
    ("1-2", "[1, 2]"), ("1 - 4", "[1, 2, 3, 4]"), ("1..3", "[1, 2, 3]"), ("1,2", "[1, 2]"), ("1, 4", "[1, 4]"),
    ("2-1", None), ("0-3", None), ("1-99", None), ("two", None),
])
def test_layer_range_as_text_suggests_list_without_sure_fix(written, meant):
    with pytest.raises(Refusal) as caught:
        Layers().read(written)
    assert caught.value.rule == "SIT004"
    assert (caught.value.facts.get("meant") or None) == meant
    assert not (meant and caught.value.facts["is_sure"]), "1-4 may be all four, or two"


def test_layer_range_is_reported_at_coil_layers():
    (finding,) = _findings("layers: 2", "layers: 1-2")
    assert (finding.rule, finding.key, finding.line) == ("SIT004", "coil.layers", 3)
    assert "[1, 2]" in finding.hint and not any(fix.is_safe for fix in finding.fixes)


def test_comma_separated_numbers_give_hint_with_list_brackets():
    with pytest.raises(Refusal) as caught:
        NumberOrList(NUMBER).read("8,7")
    assert "[8, 7]" in caught.value.hint and not caught.value.facts.get("meant")


@pytest.mark.parametrize(("written", "meant"), [("yes", "true"), ("On", "true"), ("NO", "false"), ("off", "false"),
                                                ("maybe", ""), ("1", "")])
def test_yaml_1_1_booleans_are_refused_and_true_or_false_suggested(written, meant):
    with pytest.raises(Refusal) as caught:
        Boolean().read(read_yaml(f"a: {written}\n").data["a"])
    assert (caught.value.facts.get("meant") or "") == meant
