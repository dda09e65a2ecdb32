"""Load cases of a spec: what pose and force each stands for, and what a scissor jaw reads like."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

from sitscad import Design, NoResponse, SpecError, respond
from sitscad.estimates.loads.pad import soft_pad
from sitscad.estimates.requested_response import applied_load, case_pose, load_cases
from sitscad.spec.load import load_text

TEMPLATES = Path(__file__).parents[2] / "templates"
PLAIN = """\
sitscad: 1
name: pushed
coil: {shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
array: {pattern: line, count: 2, pitch: 7}
target: {shape: square, size: 7, thickness: 0.2, material: copper}
elastomer: {material: ecoflex-00-30, shape: square, size: 7, thickness: 2}
requirements: {normal_force: 2 N}
"""
ALL = (
    PLAIN
    + """\
loads:
  press: {}
  shear: {normal: 1 N, shear_x: 0.2 N, rotation: free}
  scissor: {opening: 10 deg, normal: 1 N, face: slides}
  edge: {normal: 1 N, offset: [1, -0.5]}
  mechanism: {shaft_tension: 20 N, theta0: 21.80 deg, LA: 3.770, LB: 3.200, LJ: 28}
"""
)


def case(text, name="scissor"):
    spec = load_text(PLAIN + text)
    return spec, case_pose(soft_pad(spec), load_cases(spec.loads, [name])[0])[0]


def test_press_case_applies_required_force_without_tilt():
    spec = load_text(ALL)
    pose = case_pose(soft_pad(spec), load_cases(spec.loads, ["press"])[0])[0]
    assert pose[[0, 1, 3, 4, 5]] == approx(0.0, abs=1e-12)
    assert soft_pad(spec).force(pose)[0, 2] == approx(-2.0, rel=1e-6)


def test_pad_force_at_case_pose_equals_applied_load():
    spec = load_text(ALL)
    pad = soft_pad(spec)
    for item in load_cases(spec.loads, ["all"]):
        held, push = pad.force(case_pose(pad, item)[0])[0], applied_load(item)
        assert held[:3] == approx(push.force, abs=1e-7), item.name


def test_sliding_face_pushes_along_normal_and_tilts_target_flush():
    spec, pose = case("loads: {scissor: {opening: 10 deg, normal: 1 N, face: slides}}\n")
    assert pose[4] == approx(math.radians(10.0), rel=1e-6)
    held = soft_pad(spec).force(pose)[0]
    assert held[0] / held[2] == approx(math.tan(math.radians(10.0)), rel=1e-6)
    assert pose[0] < 0.0  # the jaws drive it out towards the tip


def test_sticking_face_leaves_middle_of_outer_face_in_place():
    spec, pose = case("loads: {scissor: {opening: 10 deg, normal: 1 N}}\n")
    assert pose[0] == approx(-0.2e-3 * math.sin(pose[4]), rel=1e-6)
    assert soft_pad(spec).force(pose)[0, 2] == approx(-1.0, rel=1e-6)


def test_offset_force_tilts_target_towards_its_side():
    spec, pose = case("loads: {edge: {normal: 1 N, offset: [1, -0.5]}}\n", "edge")
    assert pose[4] > 0.0 and pose[3] > 0.0
    lever = soft_pad(spec).force(pose)[0]
    assert lever[4] == approx(1e-3, rel=0.05) and lever[3] == approx(0.5e-3, rel=0.05)


def test_shaft_tension_gives_tip_force():
    result = applied_load(load_text(ALL).loads[-1])
    assert result.force[2] == approx(-0.4116 * 3.770 / 28.0 * 20.0, rel=1e-3)
    jaw = load_text((TEMPLATES / "grasper_3p5mm.yaml").read_text())
    assert applied_load(jaw.loads[-1]).force[2] == approx(result.force[2], rel=1e-9)  # 20 mm of jaw and 8 to its pivot


def test_ten_degree_tilt_reads_like_half_millimetre_shear():
    """Section 7.5.1: a target turned by about 10 degrees read like 0.5 mm of shear, the travel under 1 N."""
    spec = load_text((TEMPLATES / "bench_7mm.yaml").read_text()).replace("loads", {"press": {}})
    design = Design(spec)
    pose = np.tile(respond(design, case="press").poses, (3, 1))
    pose[1, 0], pose[2, 4] = 0.5e-3, math.radians(10.0)
    result = respond(design, pose)
    _, moved, turned = result.target_change[:, 0, 0] - result.target_change[:, 1, 1]
    assert 0.5 * turned / moved == approx(0.5, abs=0.06)


def test_named_load_cases_give_responses_in_order():
    result = respond(load_text(ALL), case=["edge", "press"])
    assert result.cases == ("edge", "press")
    assert result.point_document(0)["case"] == "edge"
    with pytest.raises(NoResponse, match="names no"):
        respond(load_text(PLAIN), case="all")
    with pytest.raises(ValueError, match="either"):
        respond(load_text(ALL), [[0.0] * 6], case="press")


@pytest.mark.parametrize(
    ("loads", "rule", "key"),
    [
        ("{scissor: {opening: 45 deg}}", "SIT006", "loads.scissor.opening"),
        ("{scissor: {}}", "SIT003", "loads.scissor.opening"),
        ("{scissor: {opening: 10}}", "SIT005", "loads.scissor.opening"),
        ("{edge: {offset: [9, 9]}}", "SIT009", "loads.edge.offset"),
        ("{edge: {offset: 1}}", "SIT004", "loads.edge.offset"),
        ("{shear: {normal: -1 N}}", "SIT006", "loads.shear.normal"),
        ("{mechanism: {shaft_tension: 20 N, theta0: 21.8 deg, LA: 3.77, LB: 3.2}}", "SIT009", "loads.mechanism.LJ"),
        ("{mechanism: {shaft_tension: 1 N, theta0: 80 deg, LA: 4, LB: 3, LJ: 28}}", "SIT009", "loads.mechanism.LB"),
        ("{mechanism: {shaft_tension: 20 N, theta0: 1 deg, theta: -2 deg, LA: 3.77, LB: 3.2, LJ: 28}}", "SIT009",
         "loads.mechanism.theta"),
        ("{scisor: {opening: 10 deg}}", "SIT002", "loads.scisor"),
        ("[press]", "SIT004", "loads"),
    ],
)
def test_invalid_load_case_gives_finding_at_its_key(loads, rule, key):
    with pytest.raises(SpecError) as refused:
        load_text(f"{PLAIN}loads: {loads}\n")
    assert (rule, key, 8) in [(result.rule, result.key, result.line) for result in refused.value.findings]


def test_load_case_without_force_or_pad_gives_spec_error():
    for text, missing in ((PLAIN.replace("requirements: {normal_force: 2 N}\n", ""), "no normal force"),
                          (PLAIN.replace("elastomer", "#"), "a target on an elastomer")):
        with pytest.raises(SpecError, match=missing):
            load_text(text + "loads: {press: {}}\n")
