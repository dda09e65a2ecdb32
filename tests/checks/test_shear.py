"""Whether the array feels shear: a target that covers all of it and more tells nothing when it moves."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from tolerance import approx

import sitscad
from sitscad.basics.finding import Severity
from sitscad.checks.judging import RULES
from sitscad.checks.reading.response import FEWEST_STEPS, _moved_changes
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pressing import BESIDE_PAD
from sitscad.estimates.performance.points import analyse_sensing
from sitscad.estimates.performance.screen import target_effects
from sitscad.spec.places import overlap_centres
from sitscad.spec.yaml.rewriting import rewritten

TEMPLATES = Path(__file__).parents[2] / "templates"
(SHEAR,) = (rule for rule in RULES if rule.id == "SIT218")

FOUR = """
sitscad: 1
name: four
coil: {shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 0.155, trace_spacing: 0.155}
array: {pattern: grid, count: [2, 2], pitch: 7}
target: {shape: square, size: TARGET}
elastomer: {material: ecoflex-00-50, shape: square, size: 24, thickness: 2}
requirements: {normal_force: 6 N, shear_force: 3 N}
"""


def judged(text):
    return apply_rule(SHEAR, Design(sitscad.load_text(text, "four.yaml")))


def test_target_wider_than_array_has_no_shear_signal():
    findings, skipped = judged(FOUR.replace("TARGET", "24"))
    assert not skipped and [f.severity for f in findings] == [Severity.WARNING] * 2
    for finding, axis in zip(findings, "xy", strict=True):
        assert f"shear along {axis}" in finding.message and finding.key == "target.size"
        assert finding.measured < 3 < FEWEST_STEPS <= finding.limit and finding.unit == "steps"
        assert "7 mm" in finding.hint and "8.5 mm" in finding.detail


def test_target_ending_over_coils_has_shear_signal():
    assert judged(FOUR.replace("TARGET", "7")) == ([], [])


@pytest.mark.more
@pytest.mark.slow
def test_target_ending_at_coil_rims_has_tilt_error_above_shear():
    """Between both nothing was said, though a degree of tilt was read as 3.6 N where 3 N were to be felt."""
    pad = sitscad.load(TEMPLATES / "three_axis_pad.yaml")
    assert apply_rule(SHEAR, Design(pad)) == ([], [])
    wide = pad.replace({"target.size": 14e-3, "elastomer.size": 14e-3})
    findings = [item for item in sitscad.check(wide, hints="full").findings if item.rule == "SIT218"]
    assert [item.key for item in findings] == ["target.size"] * 2
    felt = analyse_sensing(sitscad.lay_out(wide), sitscad.estimate(sitscad.lay_out(wide))).points[1]
    for finding, axis in zip(findings, (2, 1), strict=True):
        assert finding.fixes
        assert finding.measured == approx(felt.tilt_errors(math.radians(1.0))[axis].max(), rel=0.2)
        assert finding.limit == 3.0 < finding.measured
    mended = sitscad.load_text(rewritten(wide.source.text, findings[0].fixes[0].edits))
    assert mended.target.size[0] < 0.014
    assert apply_rule(SHEAR, Design(mended)) == ([], [])


def test_shear_is_checked_only_along_axes_with_several_coils():
    line = FOUR.replace("grid, count: [2, 2]", "line, count: 2").replace("TARGET", "24")
    findings, _ = judged(line)
    assert len(findings) == 1 and "shear-weak" in findings[0].cases and "along x" in findings[0].message


@pytest.mark.parametrize(
    ("old", "new", "case"),
    [
        ("array: {pattern: grid, count: [2, 2], pitch: 7}\n", "", "shear-one-coil"),
        ("size: TARGET", "size: 6, offset: [16, 0]", "beside-pad"),
        (", shear_force: 3 N", "", "no-requirement"),
    ],
)
def test_design_without_measurable_shear_is_not_checked(old, new, case):
    findings, (skipped,) = judged(FOUR.replace(old, new).replace("TARGET", "7"))
    assert not findings and skipped.case == case


@pytest.mark.parametrize(("shape", "mount"), [
    ("square", ""), ("circle", "mount: {standoff: 1, jaw: {width: 30, length: 30, height: 8}}\n")])
def test_inductance_change_equals_estimate_with_moved_target(shape, mount):
    text = FOUR.replace("shape: circle", f"shape: {shape}").replace("TARGET", "10").replace("size: 24", "size: 14")
    spec = sitscad.load_text(text + mount, "four.yaml")
    layout = sitscad.lay_out(spec)
    before = sitscad.estimate(layout)
    moves = [(0.6e-3, 0.0), (0.0, -0.4e-3)]
    solved = _moved_changes(Design(spec, layout, before), moves, 5e6)
    shared = target_effects(layout, [(0.0, 0.0), *moves], [0.0], 5e6)[0]
    for k, offset in enumerate(moves):
        moved = replace(spec, target=replace(spec.target, offset=offset))
        after = sitscad.estimate(replace(layout, spec=moved)).coils
        for number, (item, other) in enumerate(zip(before.coils, after, strict=True)):
            change = other.states["rest"].inductance - item.states["rest"].inductance
            assert solved[k][number] == approx(change, rel=0.08)
            assert shared[1 + k, number] - shared[0, number] == approx(change, rel=0.12)


def test_target_beside_pad_has_no_pressed_state():
    """It was computed as if a hair of the pad carried all the force: 96 % of strain, 0 % of the pad loaded."""
    spec = sitscad.load_text(FOUR.replace("size: TARGET", "size: 6, offset: [16, 0]"), "beside.yaml")
    estimates = sitscad.estimate(sitscad.lay_out(spec))
    assert all(set(coil.states) == {"free", "rest"} for coil in estimates.coils) and estimates.compression is None
    assert any(note == f"no state pressed: {BESIDE_PAD}" for note in estimates.notes)
    result = sitscad.check(spec, estimates=estimates, hints="none")
    cases = {skipped.rule: skipped.case for skipped in result.not_checked}
    assert all(cases[rule] == "beside-pad" for rule in ("SIT304", "SIT310", "SIT312", "SIT218"))
    assert result.signals == () and "SIT307" in {f.rule for f in result.findings if f.severity is Severity.ERROR}


def boxes(size, turn, target):
    text = f"""
sitscad: 1
name: turned
coil: {{shape: rectangle, outer_diameter: {size}, turns: 5, layers: 2, trace_width: 0.1, trace_spacing: 0.1}}
array: {{centres: [[-4, 0], [4, 1]], rotations: [{turn} deg, {turn} deg]}}
target: {target}
elastomer: {{size: 20}}
"""
    return [(at.x, at.y) for at in overlap_centres(sitscad.load_text(text))]


@pytest.mark.parametrize("target", ["{size: [8, 4]}", "{size: [4, 8], rotation: 90 deg}"])
def test_shared_middles_follow_coil_rotation(target):
    """A coil that is turned by a right angle shares what one shares that is as wide as it was long."""
    upright = boxes([4, 6], 0, target)
    assert boxes([6, 4], 90, target) == [approx(at, abs=1e-12) for at in upright]
    assert upright == [approx(at, abs=1e-12) for at in boxes([4, 6], 0, "{size: [8, 4]}")]
    assert boxes([6, 4], 0, target) != upright
