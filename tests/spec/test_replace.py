"""`SensorSpec.replace`: it takes what attributes give, in SI units, or a text with its unit."""

from __future__ import annotations

import math
import re
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sitscad
from sitscad import SensorSpec, SpecError
from sitscad.basics.units import SI_UNITS, exact_text, parse_quantity
from sitscad.spec import templates
from sitscad.spec.format.kinds import UnitValue
from sitscad.spec.format.section import Section, kind_at, section_of
from sitscad.spec.load import attribute
from sitscad.spec.sensor import SpecDocument
from tests.conftest import EVERY_KEY

BENCH = sitscad.load_text(templates.read("bench_7mm"))


def spec_named(name, folder):
    return sitscad.load(folder / f"{name}.yaml") if name in EVERY_KEY else sitscad.load_text(templates.read(name))


def values_of(spec):
    """All values of a spec, without its text and the lines in that."""
    bare = replace(spec, fpc=replace(spec.fpc, rules=replace(spec.fpc.rules, holders={})))
    return {item.name: getattr(bare, item.name) for item in fields(bare) if item.name != "source"}


def readable_keys(spec, section=SpecDocument, path=""):
    """Each key that an attribute gives a value for, with the value: those of sections that the spec has."""
    for name, key in section.keys.items():
        place, inner = f"{path}{name}", section_of(key.kind)
        try:
            value = attribute(spec, place)
        except LookupError:
            continue
        yield place, value
        if inner is not None and isinstance(value, Section):
            yield from readable_keys(spec, inner, f"{place}.")


@pytest.mark.parametrize("name", [*templates.names(), *EVERY_KEY])
def test_replacing_written_key_by_its_attribute_keeps_all_values(name, every_key_folder):
    spec = spec_named(name, every_key_folder)
    tried = 0
    for key in spec.source.keys:
        try:
            value = attribute(spec, key)
        except LookupError:
            continue
        changed = spec.replace(key, value)
        assert values_of(changed) == values_of(spec), key
        tried += 1
    assert tried >= 8


@pytest.mark.parametrize("name", [*templates.names(), *EVERY_KEY])
def test_replacing_omitted_key_by_its_attribute_keeps_values_or_is_refused(name, every_key_folder):
    """Some keys cannot be written beside others (`coil.inner_diameter` beside the turns), or below a preset's name.

    Keys of a section that is left out are passed over: one of them makes the section.
    """
    spec = spec_named(name, every_key_folder)
    equal = 0
    for key, value in readable_keys(spec):
        if key in spec.source.keys or value is None or key.rpartition(".")[0] not in {"", *spec.source.keys}:
            continue
        try:
            changed = spec.replace(key, value)
        except SpecError:
            continue
        assert values_of(changed) == values_of(spec), key
        equal += 1
    assert equal >= 5


@pytest.mark.parametrize("name", templates.names())
def test_replacing_number_by_text_in_si_unit_keeps_all_values(name):
    spec = sitscad.load_text(templates.read(name))
    for key, value in readable_keys(spec):
        kind = kind_at(SpecDocument, key)
        if isinstance(kind, UnitValue) and isinstance(value, float) and key in spec.source.keys:
            text = f"{value!r} {SI_UNITS[kind.dimension]}"
            assert values_of(spec.replace(key, text)) == values_of(spec), key


@pytest.mark.parametrize(
    ("key", "value", "meant"),
    [("coil.outer_diameter", 8, "8 mm"), ("coil.trace_width", 0.1, "0.1 mm"), ("target.size", [8, 8], "8 mm"),
     ("elastomer.thickness", 1.5, "1.5 mm"), ("coil.start_angle", 90, "90 deg"), ("coil.outer_diameter", "8", "8 mm"),
     ("target", {"size": 8, "thickness": 2e-4}, "8 mm"), ("array.pitch", np.float64(9), "9 mm")],
)
def test_millimetres_without_unit_are_refused_and_text_with_unit_suggested(key, value, meant):
    with pytest.raises(SpecError) as caught:
        BENCH.replace(key, value)
    (findings,) = caught.value.findings
    assert findings.rule in ("SIT005", "SIT006") and findings.key is not None and findings.key.startswith(key)
    assert f"did you mean '{meant}'?" in findings.hint


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [("elastomer.thickness", 1.5e-3, 1.5e-3), ("elastomer.thickness", "1.5 mm", 1.5e-3),
     ("readout.capacitance", 330e-12, 330e-12), ("requirements.normal_force", 3, 3.0),
     ("coil.start_angle", math.pi / 2, math.pi / 2), ("readout.scan_rate", 250, 250.0),
     ("requirements.temperature", 37, 37.0), ("coil.turns", 7.5, 7.5), ("coil.sense", True, True),
     ("coil.layers", (1, 2), (1, 2)), ("target.size", np.array([8e-3, 8e-3]), (8e-3, 8e-3))],
)
def test_replacement_numbers_are_in_si_units(key, value, expected):
    assert attribute(BENCH.replace(key, value), key) == expected


def test_replaced_value_is_written_in_previous_unit():
    text = BENCH.replace("coil.trace_width", 1.2e-4).source.text
    assert re.search(r"trace_width: 120 um\b", text) is not None


def test_replacing_section_by_part_of_other_spec_gives_equal_part(every_key_folder):
    other = sitscad.load_text(templates.read("grasper_4layer"))
    changed = BENCH.replace({"target": other.target, "shield": other.shield, "fpc.rules": other.fpc.rules.name,
                             "elastomer.material": other.elastomer.material})
    assert (changed.target, changed.shield) == (other.target, other.shield)
    assert changed.elastomer.material == other.elastomer.material
    own = sitscad.load(every_key_folder / "jaw_from_a_file.yaml").target.material
    assert replace(BENCH.replace("target.material", own).target.material, source="") == replace(own, source="")


def test_replacing_preset_by_modified_preset_is_refused():
    thicker = replace(BENCH.fpc.tail.connector, pitch=1e-3)
    with pytest.raises(SpecError) as caught:
        BENCH.replace("fpc.tail.connector", thicker)
    assert caught.value.findings[0].key == "fpc.tail.connector"


def test_replacing_derived_size_writes_it_with_other_changes():
    """The target's size follows the coils if it is left out, and must not if it is given."""
    free = sitscad.load_text(re.sub(r"(target:(?:\n .*?)*?\n) *size:[^\n]*\n", r"\1", templates.read("bench_7mm")))
    assert "target.size" not in free.source.keys
    wider = free.replace({"coil.outer_diameter": "9 mm", "array.pitch": "12 mm", "target.size": free.target.size})
    assert wider.target.size == free.target.size != free.replace(
        {"coil.outer_diameter": "9 mm", "array.pitch": "12 mm"}).target.size


def test_replacing_section_and_its_key_together_uses_new_section():
    changed = BENCH.replace({"target": {"size": "9 mm"}, "target.thickness": BENCH.target.thickness * 2})
    assert changed.target.size == (9e-3, 9e-3) and changed.target.thickness == 2 * BENCH.target.thickness
    same = BENCH.replace({"target": {"size": "9 mm", "thickness": "1 mm"}, "target.thickness": BENCH.target.thickness})
    assert same.target.thickness == BENCH.target.thickness


def test_mapping_numbers_without_unit_are_millimetres():
    coil = {"shape": "circle", "outer_diameter": 7, "turns": 12, "trace_width": 0.1, "trace_spacing": 0.1}
    assert SensorSpec.from_mapping(name="small", coil=coil).coil.outer_diameter == 7e-3


@given(value=st.floats(allow_nan=False, allow_infinity=False, min_value=-1e20, max_value=1e20),
       dimension=st.sampled_from(sorted(SI_UNITS)))
def test_exact_text_of_any_number_parses_to_same_number(value, dimension):
    assert parse_quantity(exact_text(value, dimension), dimension) == value


WITHOUT_SECTION = re.compile(r"loads\.|assembly\.tolerances\.|fpc\.tail\.bend\.|fpc\.stackup\.|mount\.holes\."
                             r"|array\.\w+\.\d|fpc\.rules\.(\w+\.\w+|(coil_)?tracks\.|(coil_)?trace_\w+um)|sitscad|.*datum\.")
"""Keys within what attributes hold as tuples and other values; docs/library.md says where each is read."""


@pytest.mark.parametrize("name", [*templates.names(), *EVERY_KEY])
def test_spec_key_is_attribute_or_error_names_attribute_to_read(name, every_key_folder):
    spec = spec_named(name, every_key_folder)
    for key in spec.source.keys:
        if WITHOUT_SECTION.match(key):
            continue
        value = spec
        try:
            for part in key.split("."):
                value = value[int(part)] if part.isdecimal() else getattr(value, part)
        except AttributeError as error:
            assert re.search(r", read \w+", str(error)), key


def test_attributes_named_in_errors_exist(every_key_folder):
    spec = sitscad.load(every_key_folder / "jaw_from_a_file.yaml")
    sheet = sitscad.load(every_key_folder / "jaw_of_sheet.yaml")
    for owner, whole in ((spec, spec), (spec.array, spec), (sheet.fpc.rules, sheet)):
        for where in type(owner).read_instead.values():
            assert eval(where, {}, {"spec": whole, "len": len}) is not None, where
    for part in (spec.coil, spec.elastomer.material, spec.readout):
        assert all(hasattr(part, name) for name in type(part).read_instead.values())


def test_misspelt_attribute_does_not_exist():
    for owner in (BENCH, BENCH.coil, BENCH.array, BENCH.fpc.rules):
        assert not hasattr(owner, "nonsense")


def test_outer_diameter_of_rectangular_coil_raises_error_naming_size():
    long = sitscad.load_text(templates.read("jaw_5x20"))
    with pytest.raises(AttributeError, match="read size"):
        assert long.coil.outer_diameter
    assert BENCH.coil.outer_diameter == 7e-3
