"""Specs made and changed in Python: checked as a file is, and refused where they were changed past it."""

from __future__ import annotations

import math
import time
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sitscad
from sitscad import SensorSpec, SpecError
from sitscad.basics.finding import Edit
from sitscad.spec import templates
from sitscad.spec.load import plain_data, yaml_text
from sitscad.spec.resolver.validity import refuse_unusable
from sitscad.spec.yaml.rewriting import rewritten
from sitscad.spec.yaml.source import read_yaml

COIL = {
    "shape": "circle",
    "outer_diameter": 7,
    "turns": 12,
    "layers": 2,
    "trace_width": "100 um",
    "trace_spacing": "100 um",
}
BENCH = sitscad.load_text(templates.read("bench_7mm"))
SMALL = SensorSpec.from_mapping(name="small", coil=COIL)


def refused(call) -> tuple[sitscad.Finding, ...]:
    with pytest.raises(SpecError) as caught:
        call()
    return caught.value.findings


def test_mapping_keywords_and_text_give_equal_specs():
    text = """
sitscad: 1
name: small
coil: {shape: circle, outer_diameter: 7, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
"""
    read = sitscad.load_text(text)
    assert replace(SMALL, source=read.source) == read
    assert SensorSpec.from_mapping({"name": "small", "coil": COIL}) == SMALL
    assert sitscad.load_text(SMALL.source.text) == SMALL


@pytest.mark.parametrize("key", [[], ["coil.turns"], {1}, (1, 2), None, 3, {(1, 2): 3}, {"coil.turns": object()}])
def test_non_string_key_raises_spec_error(key):
    refused(lambda: BENCH.replace(key, 1))


@pytest.mark.parametrize("sections", [3, "coil", ["coil"]])
def test_invalid_sections_raise_spec_error(sections):
    refused(lambda: SensorSpec.from_mapping(sections))


def test_number_with_5000_zeros_equals_plain_number():
    text = SMALL.source.text.replace("outer_diameter: 7", f"outer_diameter: 7.{'0' * 5000}")
    assert sitscad.load_text(text).coil == SMALL.coil


@pytest.mark.parametrize("name", templates.names())
def test_template_from_mapping_equals_template_from_text(name):
    text = templates.read(name)
    made, read = SensorSpec.from_mapping(read_yaml(text).data), sitscad.load_text(text)
    assert replace(made, source=read.source) == read
    refuse_unusable(replace(read))  # values put together in Python, and right


@pytest.mark.parametrize("own", [
    "fpc: {rules: {based_on: generic-fine, trace_width: 70 um}}",
    "fpc: {stackup: [{coverlay: 27.5 um}, {copper: 18 um}, {dielectric: 25 um}, {copper: 18 um}, {coverlay: 27.5 um}]}",
    "elastomer: {size: 8, thickness: 1, material: {name: own, shear_modulus: 50 kPa}}\n"
    "target: {size: 8, thickness: 0.2, material: {name: own, conductivity: 30 MS/m}}",
    "mount: {kind: grasper-pad, standoff: 0.7, jaw: {based_on: generic-5mm, height: 2}}",
])
def test_spec_with_written_section_is_usable_after_dataclass_replace(own):
    """Rules of one's own have no date; `lay_out` of a changed spec refused their empty `checked_on`."""
    text = f"sitscad: 1\nname: own\ncoil: {{shape: circle, outer_diameter: 8, turns: 5, layers: 2, {TRACKS}}}\n{own}\n"
    read = sitscad.load_text(text)
    refuse_unusable(replace(read, coil=replace(read.coil, turns=6.0)))


TRACKS = "trace_width: 150 um, trace_spacing: 150 um"


def test_numpy_numbers_are_accepted_in_mapping():
    coil = COIL | {"turns": np.array([12.0, 11.0]), "outer_diameter": np.float64(7.0), "layers": np.int64(2)}
    assert SensorSpec.from_mapping(name="small", coil=coil).coil.layer_turns == (12.0, 11.0)


def test_replaced_value_keeps_comments_and_updates_spec():
    changed = BENCH.replace("coil.turns", 7.5)
    assert changed.coil == replace(BENCH.coil, turns=7.5)
    assert changed.source.text == rewritten(BENCH.source.text, [Edit("coil.turns", "7.5")])
    assert changed.source.text.count("#") == BENCH.source.text.count("#") > 0
    assert changed.replace("coil.turns", BENCH.coil.most_turns).coil == BENCH.coil


def test_several_replaced_values_are_validated_together():
    assert {f.rule for f in refused(lambda: BENCH.replace("coil.outer_diameter", 3e-3))} == {"SIT016"}
    assert BENCH.replace({"coil.outer_diameter": 3e-3, "coil.turns": 4}).coil.size == (3e-3, 3e-3)


def test_replace_adds_and_removes_sections():
    target = SMALL.replace("target", {"shape": "square", "size": "4 mm"})
    assert target.target.size == (4e-3, 4e-3)
    assert target.replace({"target.size": [4e-3, "5 mm"], "target.shape": "rectangle"}).target.size == (4e-3, 5e-3)
    assert target.replace("target", None) == SMALL.replace("target", None)
    assert target.replace("target", None).target is None


def test_replace_indexes_list_entries_from_zero():
    spec = SMALL.replace("array", {"pattern": "explicit", "centres": [[-4e-3, 0], [4e-3, 0]]})
    assert spec.replace("array.centres.1.0", 5e-3).array.placements[1].centre == (5e-3, 0.0)
    assert refused(lambda: spec.replace("array.centres.2", [9e-3, 0]))[0].key == "array.centres.2"


@pytest.mark.parametrize(
    ("key", "value", "rule"),
    [
        ("coil.turns", -3, "SIT006"),
        ("coil.turns", math.nan, "SIT006"),
        ("coil.turns", 10**400, "SIT006"),
        ("coil.trace_width", 80, "SIT006"),
        ("coil.trace_width", "80 kg", "SIT005"),
        ("coil.layers", "two", "SIT004"),
        ("coil.shape", "circus", "SIT007"),
        ("coil.turnz", 3, "SIT002"),
        ("coil.turns.3", 3, "SIT002"),
        ("coil.turns", object(), "SIT004"),
        ("coil.turns", None, "SIT003"),
        ("coil", 3, "SIT004"),
        ("fpc.rules.trace_width", "1 mm", "SIT002"),
    ],
)
def test_invalid_replacement_is_refused_with_rule_and_key(key, value, rule):
    spec = SMALL.replace("fpc", {"rules": "generic-fine"})
    result = refused(lambda: spec.replace(key, value))[0]
    assert result.rule == rule and result.key is not None and key.startswith(result.key.split(".")[0])
    assert (result.key or "").rpartition(".")[2] in result.message


def test_replace_refuses_spec_whose_fields_differ_from_text():
    past = replace(BENCH, coil=replace(BENCH.coil, turns=5.0))
    result = refused(lambda: past.replace("coil.layers", 2))[0]
    assert (result.rule, result.key) == ("SIT009", "coil")
    assert replace(BENCH, coil=BENCH.coil).replace("coil.turns", 5.0).coil == past.coil


HOSTILE = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary()
    | st.sampled_from([10**400, -1e308, "1e999 mm", "\ud800", "a: b", "- x", "[", "{a", "#", "&x", "nan"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text() | st.integers(), inner, max_size=3),
    max_leaves=6,
)
KEYS = st.sampled_from([
    "coil", "coil.turns", "coil.turns.0", "coil.layers", "coil.trace_width", "coil.outer_diameter", "coil.start_angle",
    "array", "array.count", "array.centres", "fpc", "fpc.stackup", "fpc.stackup.0.copper", "fpc.rules", "fpc.tail",
    "name", "sitscad", "target.size", "requirements.temperature", "readout.clock", "a.b.c.d", "", ".", "..",
])


@pytest.mark.slow
@given(key=KEYS | st.text(max_size=12), value=HOSTILE)
@settings(max_examples=300, deadline=None)
def test_random_replacement_gives_spec_or_spec_error_within_5_seconds(key, value):
    began = time.process_time()
    try:
        assert isinstance(BENCH.replace(key, value), SensorSpec)
    except SpecError as error:
        assert error.findings and all(isinstance(f.rule, str) for f in error.findings)
    assert time.process_time() - began < 5.0


@pytest.mark.slow
@given(sections=st.dictionaries(st.sampled_from(["name", "coil", "array", "fpc", "target", "x"]), HOSTILE, max_size=4))
@settings(max_examples=200, deadline=None)
def test_random_mapping_gives_spec_or_spec_error(sections):
    for given_sections in (sections, {"name": "x", "coil": COIL} | sections):
        try:
            assert isinstance(SensorSpec.from_mapping(given_sections), SensorSpec)
        except SpecError as error:
            assert error.findings


def test_number_of_5000_digits_is_refused():
    assert refused(lambda: BENCH.replace("coil.turns", 10**5000))[0].key == "coil.turns"
    assert refused(lambda: sitscad.lay_out(replace(BENCH, coil=replace(BENCH.coil, turns=10**5000))))


def test_list_containing_itself_is_refused():
    endless: list[object] = [1e-3, 2e-3, 3e-3]
    endless += [endless] * 9
    assert refused(lambda: BENCH.replace("array.centres", endless))[0].rule in ("SIT004", "SIT010")


TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
WORDS = st.text("abcdefghijklmnopqrstuvwxyz_", min_size=1, max_size=8)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**30), 10**30) | st.floats(allow_nan=False) | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(WORDS, inner, max_size=4),
    max_leaves=12,
)


@pytest.mark.slow
@given(data=st.dictionaries(WORDS, PLAIN, min_size=1, max_size=5))
@settings(deadline=None)
def test_written_yaml_is_read_back_equally(data):
    assert read_yaml(yaml_text(plain_data(data))).data == data


PLACES = [(part, one) for part in ("coil", "array", "fpc", "target", "readout", "requirements", "name", "source")
          for one in (None, *(each.name for each in (fields(getattr(BENCH, part)) if part != "name" else ())))]


@pytest.mark.slow
@given(place=st.sampled_from(PLACES), value=HOSTILE | st.sampled_from([1e30, 1e-30, (1,), (1e3, 1.0)]))
@settings(max_examples=300, deadline=None)
def test_random_field_value_is_laid_out_or_refused_within_10_seconds(place, value):
    part, item = place
    spec = replace(BENCH, **{part: value if item is None else replace(getattr(BENCH, part), **{item: value})})
    began = time.process_time()
    try:
        sitscad.lay_out(spec)
    except SpecError as error:
        assert error.findings
    assert time.process_time() - began < 10.0


WRONG = {
    "turns": -3,
    "layers": 2,
    "trace_width": 80,
    "shape": "pear",
    "size": (1e-3, 2e-3),
    "trace_spacing": 1.0,
    "start_angle": math.inf,
}


@pytest.mark.parametrize("field", WRONG)
def test_layout_check_estimate_and_design_refuse_wrong_coil_field(field):
    spec = replace(BENCH, coil=replace(BENCH.coil, **{field: WRONG[field]}))
    drawn = replace(sitscad.lay_out(BENCH), spec=spec)
    for call in (
        lambda: sitscad.lay_out(spec),
        lambda: sitscad.check(spec),
        lambda: sitscad.estimate(drawn),
        lambda: sitscad.Design(spec).layout,
    ):
        assert any(finding.key.startswith("coil.") for finding in refused(call))


def test_layout_of_mapping_raises_type_error():
    with pytest.raises(TypeError, match="SensorSpec"):
        sitscad.lay_out({"coil": 3})
