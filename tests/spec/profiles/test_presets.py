"""The data behind the presets: all of it loads, makes sense, and names its sources."""

from __future__ import annotations

import csv
import dataclasses
import math
import re

import pytest
from tolerance import approx

from sitscad.data import FOLDER
from sitscad.spec import presets
from sitscad.spec.circuit import Plating
from sitscad.spec.load import load_text
from sitscad.spec.materials import AT_DOUBLE, TO_30_PERCENT, neo_hookean_ratio, tension
from sitscad.spec.profiles import installed_rules
from sitscad.spec.yaml.source import read_yaml

MINIMAL = (
    "sitscad: 1\nname: a\ncoil: {shape: circle, outer_diameter: 7, turns: 5, trace_width: 0.1, trace_spacing: 0.1}\n"
)
LOOKUPS = {
    "stackup": presets.stackup,
    "rules": installed_rules,
    "connector": presets.connector,
    "jaw": presets.jaw,
    "conductor": presets.conductor,
    "elastomer": presets.elastomer,
    "dielectric": presets.permittivity,
    "chip": presets.chip,
}
ALL = [(kind, name) for kind in LOOKUPS for name in presets.names(kind)]
SECTIONS = {
    "stackup": "fpc: {{stackup: {}}}",
    "rules": "fpc: {{rules: {}}}",
    "connector": "fpc: {{tail: {{length: 30, connector: {}}}}}",
    "jaw": "mount: {{jaw: {}}}",
    "conductor": "target: {{material: {}}}",
    "elastomer": "elastomer: {{material: {}}}",
    "dielectric": "fpc: {{stackup: [{{copper: 18 um}}, {{dielectric: 25 um, material: {}}}, {{copper: 18 um}}]}}",
    "chip": "fpc: {{tail: {{length: 30}}}}\nreadout: {{capacitors_on_board: {}}}",
}


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_each_preset_loads(kind, name):
    assert LOOKUPS[kind](name)


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_each_preset_name_is_accepted_in_spec(kind, name):
    assert load_text(MINIMAL + SECTIONS[kind].format(name))


@pytest.mark.parametrize("kind", LOOKUPS)
def test_unknown_preset_raises_key_error(kind):
    with pytest.raises(KeyError):
        LOOKUPS[kind]("no-such-thing")


FITTED = ("pad_films", "rule", "messages")
"""Tables of texts of rules and messages, and of what was fitted here (tests/validation/fit_films.py)."""


def test_every_row_of_data_tables_has_source_and_status():
    tables = [path for path in FOLDER.rglob("*.csv") if not path.stem.startswith(FITTED)]
    read = {f"{name}.csv" for kind in ("stackup", "connector", "jaw") for name in presets.names(kind)}
    read |= {"conductors.csv", "converters.csv", "finishes.csv", "tolerances.csv"}
    assert read <= {each.name for each in tables}
    for path in tables:
        with path.open(encoding="utf-8", newline="") as stream:
            for row in csv.DictReader(stream):
                assert row["source"].strip(), f"{path.name}: {row}"
                assert row["status"] in ("verified", "unverified"), f"{path.name}: {row}"
                assert None not in row, f"{path.name}: a comma too many in {row}"
                from_memory = "from memory" in row["source"] and row["status"] == "verified"
                assert not from_memory or ";" in row["source"], f"{path.name}: {row}"


@pytest.mark.parametrize("name", presets.names("rules"))
def test_every_fabricator_value_has_source_or_unverified_status(name):
    """A figure that was not seen says so; what is said to be seen is not from memory alone."""
    data = read_yaml((FOLDER / "fabricators" / f"{name}.yaml").read_text(encoding="utf-8")).data
    rows = [
        row[what] for table in ("tracks", "coil_tracks") for row in data.get(table, ()) for what in ("width", "spacing")
    ]
    figures = [*rows, *(each for key, each in data.items() if key not in ("based_on", "tracks", "coil_tracks"))]
    for figure in figures:
        assert figure["source"].strip(), figure
        assert "from memory" not in figure["source"] or figure.get("status") == "unverified" or ";" in figure["source"]
    assert "checked_on" in data and "based_on" in data


def test_flex_4l_copper_has_expected_depths_and_thicknesses():
    stackup = presets.stackup("flex-4l")
    depths = [layer.z - stackup.copper[0].z for layer in stackup.copper]
    assert depths == approx([0, -49e-6, -127e-6, -176e-6], abs=1e-12)
    assert [layer.thickness for layer in stackup.copper] == approx([30e-6, 18e-6, 18e-6, 30e-6], rel=1e-6)


@pytest.mark.parametrize(("finished", "foil"), [(18, 18), (24, 12), (30, 18), (35, 35)])
def test_two_layer_stackup_name_states_finished_copper_thickness(finished, foil):
    """That of 18 and 35 um is foil with plated holes and pads: files written for these names keep their meaning."""
    stackup = presets.stackup(f"flex-2l-{finished}um")
    assert [layer.foil for layer in stackup.copper] == approx([foil * 1e-6] * 2, rel=1e-9)
    assert [layer.thickness for layer in stackup.copper] == approx([finished * 1e-6] * 2, rel=1e-9)
    assert stackup.copper[0].z - stackup.copper[1].z == approx((finished + 25) * 1e-6, rel=1e-9)
    assert stackup.plating is (Plating.BUTTONS if finished == foil else Plating.PANEL)


@pytest.mark.parametrize("name", presets.names("stackup"))
def test_stackups_are_symmetric_with_coverlay_on_both_sides(name):
    stackup = presets.stackup(name)
    assert [(s.kind, s.thickness) for s in stackup.layers] == [(s.kind, s.thickness) for s in reversed(stackup.layers)]
    assert stackup.layers[0].kind == stackup.layers[-1].kind == "coverlay"
    assert len(stackup.copper) == int(name.split("-")[1].removesuffix("l"))


@pytest.mark.parametrize("name", presets.names("rules"))
def test_fabricator_rules_have_consistent_widths_pads_and_dates(name):
    rules = installed_rules(name)
    assert rules.coil_trace_width >= rules.trace_width
    assert rules.via_pad == approx(rules.via_drill + 2 * rules.annular_ring, rel=1e-6)
    assert rules.drill_to_copper >= rules.annular_ring
    assert {"trace_width", "trace_spacing", "via_drill", "annular_ring", "part_size"} <= rules.sources.keys()
    assert rules.sources["hole_to_hole"].startswith("wellerpcba.com" if name == "weller" else "unverified")
    assert rules.coil_rule_binding == (name in ("hkgalaxy", "jselectronic", "shipco"))
    assert re.fullmatch(r"20\d\d-\d\d-\d\d", rules.checked_on)
    assert {1, 2} <= rules.static_bend_ratio.keys() and {1, 2, 3} <= rules.thickness_tolerance.keys()


def test_generic_rules_have_promised_trace_width_and_spacing():
    assert installed_rules("generic-flex").trace_width == 100e-6
    assert installed_rules("generic-fine").trace_spacing == 76e-6


def test_ecoflex_modulus_spread_covers_data_sheet_and_measurement():
    material = presets.elastomer("ecoflex-00-30")
    spread = math.exp(material.shear_modulus_sigma)
    doubled, to_30_percent = neo_hookean_ratio(2.42, AT_DOUBLE), neo_hookean_ratio(2.42, TO_30_PERCENT)
    assert material.shear_modulus * spread == approx(39.4e3 / doubled, rel=1e-6)
    assert material.shear_modulus / spread == approx(14.4e3 / to_30_percent, rel=1e-6)


def test_elastomer_modulus_is_extrapolated_to_rest_by_ogden_exponent():
    """Pulled to twice its length the silicone bears the data sheet's 100 % modulus, and no stiffening counts twice;
    without an exponent nothing changes.
    """
    assert neo_hookean_ratio(2.0, AT_DOUBLE) == neo_hookean_ratio(2.0, TO_30_PERCENT) == 1.0
    assert presets.elastomer("mold-star-16").shear_modulus == 83e3
    for exponent in (2.42, 3.25):
        pulled = 2.0 / exponent * (2.0 ** (exponent - 1.0) - 2.0 ** (-0.5 * exponent - 1.0))
        assert tension(exponent, 2.0) == approx(pulled, rel=1e-6)
        assert tension(exponent, 1.0 + 1e-6) == approx(3e-6, rel=1e-5)
        assert neo_hookean_ratio(exponent, AT_DOUBLE) == approx(pulled / 1.75, rel=1e-6)
        assert 1.0 < neo_hookean_ratio(exponent, TO_30_PERCENT) < tension(exponent, 1.3) / tension(2.0, 1.3)
    for name in ("dragon-skin-10", "dragon-skin-20", "dragon-skin-30"):  # data sheet and measurement agree at rest
        assert presets.elastomer(name).shear_modulus_sigma < 0.2


def test_generic_jaw_fits_recommended_board_and_is_marked_unverified():
    jaw = presets.jaw("generic-5mm")
    assert jaw.width >= 4.72e-3
    assert jaw.material.name == "stainless-304"
    assert "unverified" in jaw.source


@pytest.mark.parametrize(
    ("stackup", "copper", "wanted"),
    [("flex-2l-18um", 18e-6, 6), ("flex-2l-35um", 35e-6, 8), ("flex-4l", 18e-6, 6)],
)
@pytest.mark.parametrize("rules", ["generic-flex", "generic-fine"])
def test_coil_trace_limits_depend_on_foil_thickness(stackup, copper, wanted, rules):
    """By the foil before plating: a 30 um outer layer of 18 um foil and 12 um plating counts as 18 um."""
    coil = "coil: {shape: circle, outer_diameter: 8, turns: 8, layers: 2, trace_width: 0.15, trace_spacing: 0.15}"
    text = f"sitscad: 1\nname: x\n{coil}\nfpc: {{stackup: {stackup}, rules: %s}}\n"
    result = load_text(text % rules).fpc.rules
    assert result.coil_copper == approx(copper, rel=1e-6)
    assert (result.coil_trace_width, result.coil_trace_spacing) == approx((wanted * 25.4e-6,) * 2, rel=1e-6)
    assert f"{wanted} mil" in result.sources["coil_trace_width"]
    own = load_text(text % f"{{based_on: {rules}, coil_trace_width: 0.12}}").fpc.rules
    assert own.coil_trace_width == approx(120e-6, rel=1e-6) and own.coil_copper is None
    assert own.sources["coil_trace_width"] == "the spec"


@pytest.mark.parametrize(
    ("rules", "stackup", "ring", "said"),
    [
        ("generic-flex", "flex-2l-18um", 125e-6, "two layers"),
        ("generic-flex", "flex-4l", 150e-6, "four layers and more"),
        ("jselectronic", "flex-4l", 150e-6, "four layers and more"),
        ("huayue", "flex-4l", 101.6e-6, "huayue"),
        ("{based_on: generic-flex, annular_ring: 0.11}", "flex-4l", 110e-6, "the spec"),
        ("{annular_ring: 0.11, annular_ring_4: 0.14}", "flex-6l", 140e-6, "the spec"),
    ],
)
def test_annular_ring_limit_depends_on_layer_count(rules, stackup, ring, said):
    """Where the house states a ring of its own it holds; of the generic one four layers ask 0.15 mm, as Rehan does."""
    result = load_text(MINIMAL + f"fpc: {{stackup: {stackup}, rules: {rules}}}").fpc.rules
    assert result.annular_ring == approx(ring, rel=1e-6) and said in result.sources["annular_ring"]


@pytest.mark.parametrize("name", presets.names("rules"))
def test_installed_trace_limits_state_valid_copper_thickness(name):
    """A width that holds for 18 um copper says nothing of 210 um: beyond the table there is no figure."""
    rules = installed_rules(name)
    assert rules.track_lines and rules.track_lines[-1].copper >= 35e-6
    thickest = rules.track_lines[-1].copper
    message = rules.for_foil(thickest).sources, rules.for_foil(210e-6).sources
    for field in ("trace_width", "trace_spacing"):
        assert "nothing is stated" not in message[0][field] and "nothing is stated for 210 um" in message[1][field]


def test_copper_thicker_than_table_uses_largest_trace_limits():
    rules = installed_rules("generic-flex")
    assert rules.for_foil(70e-6).coil_trace_width == approx(8 * 25.4e-6, rel=1e-6)
    assert rules.for_foil(5e-6).coil_trace_width == approx(6 * 25.4e-6, rel=1e-6)
    bare = dataclasses.replace(rules, coil_lines=(), coil_trace_width=None, track_lines=())
    assert bare.for_foil(18e-6) is bare
