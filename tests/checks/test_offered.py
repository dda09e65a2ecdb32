"""SIT131: what a fabricator does not offer is refused, and what nobody states is not judged."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tolerance import approx

from sitscad.spec import presets
from sitscad.spec.load import load_text
from sitscad.spec.profiles import installed_rules

OWN = "stackup: flex-2l-osh-park, rules: osh-park-flex"
PADS = "tail: {length: 30, connector: solder-pads}"
PLUG = "tail: {length: 30, connector: zif-0.5mm}"
THIN, THICK = (f"stackup: {name}, rules: osh-park-flex, {PADS}" for name in ("flex-2l-30um", "flex-2l-35um"))


def spec(fpc):
    coil = "{shape: circle, outer_diameter: 8, turns: 5, layers: 2, trace_width: 6 mil, trace_spacing: 6 mil}"
    return load_text(f"sitscad: 1\nname: offered\ncoil: {coil}\nfpc: {{{fpc}}}\n", "offered.yaml")


def said(judge, fpc):
    return [(f.severity.value, f.key, f.message) for f in judge("SIT131", spec(fpc))]


def test_board_within_osh_park_offers_passes(judge):
    assert said(judge, f"{OWN}, boards: 9, {PADS}") == []


@pytest.mark.parametrize(
    ("fpc", "key", "have", "listed"),
    [
        (THIN, "fpc.stackup", 18e-6, "35 um (osh-park-flex)"),
        (THICK, "fpc.stackup", 25e-6, "101.6 um (osh-park-flex)"),
        (THICK, "fpc.stackup", None, "solder-mask (osh-park-flex)"),
        (f"stackup: flex-4l, rules: osh-park-flex, {PADS}", "fpc.stackup", 4, "2 (osh-park-flex)"),
        (f"{OWN}, finish: osp, {PADS}", "fpc.finish", None, "enig (osh-park-flex)"),
        (f"{OWN}, {PLUG}", "fpc.tail", None, "none (osh-park-flex)"),
        (f"stackup: flex-4l, rules: rehan-2l, {PADS}", "fpc.stackup", 4, "1, 2 (rehan-2l)"),
        (f"stackup: flex-2l-18um, rules: rehan-4l, {PADS}", "fpc.stackup", 2, "3, 4, 5, 6, 7, 8 (rehan-4l)"),
        (f"stackup: flex-2l-30um, rules: {{based_on: shipco, foils: 35 um}}, {PADS}", "fpc.stackup", 18e-6,
         "35 um (the spec (line 4))"),
    ],
)
def test_feature_not_offered_gives_error_at_its_key(judge, fpc, key, have, listed):
    result = [f for f in judge("SIT131", spec(fpc)) if f.message.endswith(f" {listed}")]
    assert [(f.severity.value, f.key) for f in result] == [("error", key)]
    assert result[0].measured == (have and approx(have, rel=1e-9))


WRITTEN = "stackup: [{coverlay: 27.5 um}, {copper: %s}, {dielectric: 25 um}, {copper: %s}, {coverlay: 27.5 um}]"


@pytest.mark.parametrize("house", ["jselectronic", "rehan-2l", "wellpcb", "lab-circuits", "shipco"])
@pytest.mark.parametrize(("copper", "foil"), [("18 um", "6 um"), ("30 um", ""), ("47 um", ""), ("35 um", "23 um")])
def test_unlisted_foil_gives_error_although_finished_copper_is_listed(judge, house, copper, foil):
    """18 um finished were once taken as listed: with 12 um of plating they need a foil of 6 um."""
    result = said(judge, f"{WRITTEN % (copper, copper)}, rules: {house}, {PADS}")
    assert [message.partition(",")[0] for *_, message in result] == [f"copper foil {foil}"] * bool(foil)


@pytest.mark.parametrize("name", ["flex-2l-18um", "flex-2l-24um", "flex-2l-30um", "flex-2l-35um"])
def test_preset_stackups_use_listed_foils(judge, name):
    for house in ("jselectronic", "rehan-2l", "wellpcb"):
        assert said(judge, f"stackup: {name}, rules: {house}, {PADS}") == []


def test_board_count_off_multiple_gives_warning_with_next_multiple(judge):
    (result,) = judge("SIT131", spec(f"{OWN}, boards: 10, {PADS}"))
    assert (result.severity.value, result.key, result.limit) == ("warning", "fpc.boards", 12)
    assert result.source and "fpc.boards: 12" in result.hint


def test_stackup_hint_names_offered_stackup(judge):
    hints = {f.hint for f in judge("SIT131", spec(THIN))}
    assert hints and all("fpc.stackup: flex-2l-osh-park" in hint for hint in hints)


@pytest.mark.parametrize(("fpc", "key", "new"), [
    (THIN, "fpc.stackup", "flex-2l-osh-park"),
    (f"{OWN}, boards: 10, {PADS}", "fpc.boards", "12"),
    (f"{OWN}, finish: osp, {PADS}", "fpc.finish", "enig"),
    (f"{OWN}, {PLUG}", "fpc.tail.connector", "solder-pads"),
])
def test_hint_for_feature_not_offered_has_tried_fix(advised, fpc, key, new):
    """Hints named a stack-up that is offered, and `--fix` said that no fix is known."""
    result = advised("SIT131", spec(fpc))
    assert result and all((edit.key, edit.new) == (key, new) for item in result for edit in item.fixes[0].edits)
    assert all(item.hint.count(f"{key}: {new} (tried)") == 1 and item.hint.count(new) == 1 for item in result)


def test_stackup_with_fewer_layers_than_coil_is_not_suggested(judge):
    text = f"stackup: flex-4l, rules: rehan-2l, {PADS}"
    four = replace(spec(text), coil=replace(spec(text).coil, layers=(1, 2, 3, 4)))
    assert all("fpc.stackup" not in item.hint for item in judge("SIT131", four))


@pytest.mark.parametrize("name", presets.names("stackup"))
def test_profile_without_stated_offers_is_not_checked(verdicts, name):
    assert "layer_counts" not in installed_rules("generic-flex").sources
    request = spec(f"stackup: {name}, rules: generic-flex, boards: 7, {PLUG}")
    findings, undecided = verdicts("SIT131", request)
    assert findings == [] and [each.case for each in undecided] == ["no-offers"]


def test_custom_profile_overrides_listed_offers(judge):
    own = "rules: {based_on: osh-park-flex, stiffeners: [polyimide], order_multiple: 1}"
    assert said(judge, f"stackup: flex-2l-osh-park, {own}, boards: 10, {PLUG}") == []
