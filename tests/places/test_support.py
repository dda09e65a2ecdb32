"""SIT319: how much of the board lies on its mount, for every kind, against areas worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import handmade
import pytest
from template_designs import template_design
from tolerance import approx

from sitscad.assembly.places.bodies import backing_of, top_height
from sitscad.assembly.places.column import worst_deviations
from sitscad.assembly.places.jaws import closed_span, seat_circle_radius
from sitscad.assembly.places.stack import support
from sitscad.basics.finding import Severity
from sitscad.checks.judging import RULES, check
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import enclosed_area
from sitscad.layout import lay_out
from sitscad.spec.load import load, load_text
from sitscad.spec.mount import Finger

LENS = Path(__file__).parents[1] / "report/broken/SIT319.yaml"
SENSOR = """sitscad: 1
name: held
coil: {shape: circle, outer_diameter: 4, turns: 7.75, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: line, count: 2, pitch: 4.5}
fpc: {stackup: flex-4l, rules: generic-fine, tail: {length: 30, connector: zif-0.5mm, layers: 2}}
elastomer: {shape: rectangle, size: [8, 4], thickness: 0.6}
"""


def pad(**changes):
    """A hand-made sensor on a jaw, without the shield; its pad is 4 x 4 mm."""
    mount = handmade.Mount("grasper-pad", handmade.jaw(), 1.0e-3)
    return handmade.jaw_sensor(shield=None, **{"mount": mount, **changes})


(SUPPORT,) = (rule for rule in RULES if rule.id == "SIT319")


def said(mount):
    findings, skipped = apply_rule(SUPPORT, Design(load_text(f"{SENSOR}mount: {mount}\n", "held.yaml")))
    return findings, [reason.case for reason in skipped]


def test_seat_support_is_limited_by_port():
    """A strip about the axis, as wide as the circle is at the board's lower face."""
    thick = replace(handmade.jaw_sensor().spec.elastomer, thickness=2.4e-3)
    layout = pad(elastomer=thick)
    low, high = closed_span(backing_of(layout.spec), top_height(layout.spec))
    depth = (low + high) / 2 + layout.spec.fpc.stackup.thickness
    half = math.sqrt(seat_circle_radius(layout.spec.mount.jaw, worst_deviations(layout)) ** 2 - depth**2)
    result = support(layout)
    assert 2.0 * half < 4.0e-3 and result.name == "elastomer"
    assert result.carried == approx(4.0e-3 * 2.0 * half, rel=1e-12) and result.pressed == approx(16e-6, rel=1e-6)


def test_board_without_seat_lies_on_face_beside_window():
    jaw = replace(handmade.jaw(), fenestration=(3e-3, 1.0e-3))
    result = support(pad(mount=handmade.Mount("grasper-pad", jaw, 0.0)))
    assert result.carried == approx(16e-6 - 3e-6, rel=1e-12)
    assert support(pad(mount=handmade.Mount("grasper-pad", jaw, 1e-3))).carried == approx(16e-6, rel=1e-6)


def test_plate_and_cap_support_board_and_finger_supports_flat_part():
    def on(mount):
        layout = handmade.bench_sensor(mount=mount)
        result = support(layout)
        assert result.body == enclosed_area(layout.body_outline)
        return result.body_carried / result.body, result.share

    assert on(handmade.Mount("bench-plate", None, 2e-3)) == approx((1.0, 1.0), rel=1e-6)
    flat, round_one = Finger("rectangle", (4e-3, 4e-3), 8e-3, 2e-3), Finger("circle", (14e-3, 14e-3), 8e-3, 2e-3)
    for finger in (flat, round_one):
        assert on(handmade.Mount("fingertip", None, 1e-3, finger=finger)) == approx((1.0, 1.0), rel=1e-6)
    assert on(handmade.Mount("fingertip", None, 0.0, finger=round_one)) == (0.0, 0.0)
    assert 0.0 < on(handmade.Mount("fingertip", None, 0.0, finger=flat))[1] < 1.0


def test_seat_cut_to_lens_gives_error_with_both_areas():
    """Such a mount was called held, and built with --force."""
    result = check(load(LENS), hints="none")
    (lens,) = [finding for finding in result.findings if finding.rule == "SIT319"]
    assert lens.severity is Severity.ERROR and lens.key == "mount.standoff" and lens.unit == "m2"
    body = enclosed_area(lay_out(load(LENS)).body_outline)
    assert lens.limit == approx(0.5 * body, rel=1e-6) and 0.4 * body < lens.measured < lens.limit
    assert f"{body * 1e6:.3g} mm2" in lens.message
    over = [finding for finding in result.findings if finding.rule == "SIT301"]
    assert all("face-cut" in finding.cases for finding in over)


@pytest.mark.parametrize("template", ["bench_7mm", "fingertip_foil", "grasper_4layer", "racetrack_jaw"])
def test_template_boards_are_supported(template):
    assert apply_rule(SUPPORT, template_design(template)) == ([], [])


@pytest.mark.slow
def test_support_below_nine_tenths_gives_warning():
    ((finding,), _) = said("{jaw: {based_on: generic-10mm, fenestration: [4, 2]}, standoff: 0}")
    assert finding.severity is Severity.WARNING and "carried-window" in finding.cases
    assert (finding.measured, finding.limit) == (approx(24e-6, rel=1e-6), approx(0.9 * 32e-6, rel=1e-6))
    assert said("{jaw: {based_on: generic-10mm, fenestration: [4, 2]}, standoff: 1}") == ([], [])


def test_mount_without_figures_has_no_support_finding():
    assert said("{kind: custom}") == ([], ["custom-mount"])
