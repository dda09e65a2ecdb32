"""An inner diameter in place of turns, width or spacing; specs with too few or too many of these keys."""

from __future__ import annotations

import re

import pytest
from tolerance import approx

from sitscad import SensorSpec, check, sweep
from sitscad.apps.study import document
from sitscad.checks.fixes import moves
from sitscad.layout.windings import wind_coil
from sitscad.spec.coil import CoilSpec
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError
from sitscad.spec.yaml.rewriting import rewritten

TRACK = {"trace_width": "120 um", "trace_spacing": "100 um"}
SIZES = {"rectangle": [9, 6], "racetrack": [9, 6]}


def spec(shape="circle", **keys):
    coil = {"shape": shape, "outer_diameter": SIZES.get(shape, 7), "layers": 2, **keys}
    return SensorSpec.from_mapping(name="coil", coil={name: value for name, value in coil.items() if value is not None})


def findings(shape="circle", **keys):
    with pytest.raises(SpecError) as refused:
        spec(shape, **keys)
    return [(result.rule, result.key) for result in refused.value.findings]


@pytest.mark.parametrize("shape", ["circle", "square", "rectangle", "hexagon", "octagon", "racetrack"])
@pytest.mark.parametrize("left_out", ["turns", "trace_width", "trace_spacing"])
def test_inner_diameter_in_place_of_a_key_gives_the_same_coil(shape, left_out):
    whole = spec(shape, turns=9, **TRACK)
    keys = {"turns": 9, **TRACK, "inner_diameter": whole.coil.inner_diameter * 1e3, left_out: None}
    result = spec(shape, **keys).coil
    assert result.layer_turns == whole.coil.layer_turns
    assert (result.trace_width, result.trace_spacing) == approx((120e-6, 100e-6), rel=1e-9)


def test_inner_diameter_of_circle_matches_drawn_copper():
    design = spec(inner_diameter=2.345, **TRACK)
    path = wind_coil(design.artwork, design.array.placements[0])[0].path
    nearest = min((point[0] ** 2 + point[1] ** 2) ** 0.5 for point in path.flattened(1e-6))
    assert 2.0 * nearest - 120e-6 == approx(2.345e-3, abs=1e-6)


@pytest.mark.parametrize("shape", ["square", "octagon"])
@pytest.mark.parametrize("turns", [1, 3, 8.5])
def test_inner_diameter_of_polygon_matches_mohan_formula(shape, turns):
    """Mohan et al., IEEE JSSC 34 (1999): d = D - 2 N w - 2 (N - 1) s."""
    inner = 7.0 - 2.0 * turns * 0.12 - 2.0 * (turns - 1.0) * 0.1
    assert spec(shape, inner_diameter=inner, **TRACK).coil.layer_turns[0] == approx(turns, rel=1e-9)
    assert spec(shape, turns=turns, **TRACK).coil.inner_diameter == approx(inner * 1e-3, rel=1e-9)


def test_inner_diameter_of_square_is_rounded_to_whole_sides_and_reported():
    design = spec("square", inner_diameter=2.4, **TRACK)
    assert design.coil.layer_turns[0] == 11.0
    assert design.coil.inner_diameter == approx(2.36e-3, rel=1e-9)
    assert any(line.startswith("coil.turns: 11,") and "2.36 mm" in line for line in design.source.defaults)


@pytest.mark.parametrize(("keys", "expected"), [
    ({"turns": 9, "inner_diameter": 2.0, **TRACK}, [("SIT009", "coil.inner_diameter")]),
    ({"turns": 9, **TRACK, "trace_width": None}, [("SIT003", "coil.trace_width")]),
    (TRACK, [("SIT003", "coil.turns")]),
    ({"turns": 9, "inner_diameter": 2.0}, [("SIT003", "coil.trace_spacing")]),
    ({"inner_diameter": 2.0, "trace_width": "0.1 mm"}, [("SIT003", "coil.trace_spacing")]),
    ({"inner_diameter": 6.9, **TRACK}, [("SIT009", "coil.inner_diameter")]),
    ({"inner_diameter": 7.5, **TRACK}, [("SIT009", "coil.inner_diameter")]),
    ({"inner_diameter": 6.75, **TRACK}, [("SIT009", "coil.inner_diameter")]),
    ({"turns": 30, "inner_diameter": 2.0, "trace_width": "0.1 mm"}, [("SIT009", "coil.inner_diameter")]),
    ({"inner_diameter": [2.0, 3.0], **TRACK}, [("SIT009", "coil.inner_diameter")]),
])
def test_over_or_underdetermined_coil_is_refused_by_its_key(keys, expected):
    assert findings(**keys) == expected


def test_spacing_of_one_turn_square_is_refused_as_undetermined():
    assert findings("square", turns=1, inner_diameter=2.0, trace_width="0.1 mm") == [("SIT009", "coil.inner_diameter")]


def test_inner_sides_of_unequal_distance_are_refused():
    assert findings("rectangle", inner_diameter=[4, 2], **TRACK) == [("SIT009", "coil.inner_diameter")]
    assert spec("rectangle", inner_diameter=[5, 2], **TRACK).coil.inner_size[1] <= 2.2e-3


def test_replaced_inner_diameter_changes_the_turns():
    design = spec(inner_diameter=2.0, **TRACK)
    assert design.replace("coil.inner_diameter", 3e-3).coil.most_turns < design.coil.most_turns
    assert design.replace({"coil.inner_diameter": None, "coil.turns": 5}).coil.turns == 5.0


@pytest.mark.parametrize("keys", [
    {"inner_diameter": 2.0, **TRACK},
    {"inner_diameter": 2.0, "turns": 8, "trace_spacing": "100 um"},
    {"inner_diameter": 2.0, "turns": 8, "trace_width": "100 um"},
    {"turns": 8, **TRACK},
])
@pytest.mark.parametrize("move", [
    lambda design: moves.with_turns(design, 7.0),
    lambda design: next(moves.narrower_coils(design, 0.3e-3)),
    lambda design: next(moves.wider_tracks(design, 130e-6, 130e-6)),
    lambda design: moves.larger_coils(design, 0.5e-3),
])
def test_fix_of_turns_and_tracks_edits_the_keys_that_are_written(keys, move):
    fix = move(spec(**keys))
    text = spec(**keys).source.text
    assert all(edit.key in spec(**keys).source.keys for edit in fix.edits)
    again = load_text(rewritten(text, fix.edits)).coil
    assert again.most_turns == approx(fix.spec.coil.most_turns, rel=1e-5)
    assert again.size == approx(fix.spec.coil.size, rel=1e-9)
    for name in ("trace_width", "trace_spacing"):
        assert getattr(again, name) == approx(getattr(fix.spec.coil, name), rel=1e-4)


def test_replaceable_coil_keys_are_keys_of_coil_spec():
    other, replaced = CoilSpec.stands_in
    assert {other, *replaced} <= CoilSpec.keys.keys()


def test_turns_finding_and_fix_name_written_inner_diameter_key():
    result = [item for item in check(spec(inner_diameter=0.5, **TRACK)).findings if item.rule == "SIT112"]
    assert [item.key for item in result] == ["coil.inner_diameter"]
    assert {edit.key for item in result for remedy in item.fixes for edit in remedy.edits} == {"coil.inner_diameter"}


def test_sweep_of_the_inner_diameter_changes_the_turns():
    table = sweep(spec(inner_diameter=2.0, **TRACK), {"coil.inner_diameter": [2e-3, 3e-3]}, measures=["inductance"])
    more, fewer = table.values["inductance"]
    assert more > fewer


@pytest.mark.parametrize(("keys", "varied"), [
    ({"inner_diameter": 2.0, **TRACK}, {"coil.outer_diameter", "coil.inner_diameter", "coil.trace_width"}),
    ({"inner_diameter": 2.0, "turns": 8, "trace_spacing": "100 um"},
     {"coil.outer_diameter", "coil.inner_diameter", "coil.turns"}),
    ({"turns": 8, **TRACK}, {"coil.outer_diameter", "coil.turns", "coil.trace_width"}),
])
def test_new_study_varies_the_written_keys(keys, varied):
    text = document.first_study_text(spec(**keys), "coil.yaml")
    assert set(re.findall(r"^  (coil\.\w+):", text, re.MULTILINE)) == varied
