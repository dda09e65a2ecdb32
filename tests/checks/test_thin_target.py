"""A thin target is judged by what it costs in our own numbers, against a thick one of the same metal."""

from __future__ import annotations

import cmath
import re

import pytest
from tolerance import approx

import sitscad
from sitscad.basics.finding import Severity
from sitscad.checks.judging import RULES
from sitscad.checks.reading.metal import THICK, _resistance_of_sheet
from sitscad.checks.rules import apply_rule, constant_limits
from sitscad.estimates import estimate_layout
from sitscad.estimates.design import Design
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.spec.load import load_text

FOIL = """\
sitscad: 1
name: foil
coil: {{shape: circle, outer_diameter: 10, turns: 18, layers: 2, trace_width: 100 um, trace_spacing: 100 um}}
fpc: {{tail: {{length: 40, connector: zif-0.5mm}}}}
target: {{shape: circle, size: 10, thickness: {thickness}, material: {material}}}
elastomer: {{material: ecoflex-00-30, shape: circle, size: 10, thickness: 3}}
{force}"""
FORCE = "requirements: {normal_force: 5 N}\n"


def foil(thickness="20 um", material="aluminium", force=FORCE):
    return load_text(FOIL.format(thickness=thickness, material=material, force=force), "foil.yaml")


def numbers(spec):
    (coil,) = estimate_layout(sitscad.lay_out(spec)).coils
    return coil.states["pressed"].parallel_resistance, coil.sensitivity(5.0)[0], coil.sensor_frequency


def test_household_foil_target_gives_only_note():
    """It was an error at 0.53 skin depths, where it takes a tenth of R_P and nothing of the signal."""
    result = sitscad.check(foil(), hints="none")
    (findings,) = [finding for finding in result.findings if finding.rule == "SIT305"]
    assert findings.severity is Severity.NOTE and result.ok
    (mine, change, frequency), (thick, before, _) = numbers(foil()), numbers(foil("115 um"))
    assert THICK * skin_depth(frequency, 35.4e6) == approx(114e-6, rel=0.02)
    assert findings.measured == approx(1.0 - mine / thick, abs=2e-3)
    assert 0.08 < findings.measured < 0.11 and change / before == approx(1.01, abs=0.01)
    assert re.search(r"\(-\d\.\d %\)", findings.detail) and "nH/N" in findings.detail
    assert findings.limit == constant_limits()["thin_target_resistance"].value


@pytest.mark.parametrize(
    ("thickness", "severity"), [("5 um", Severity.WARNING), ("20 um", Severity.NOTE), ("120 um", None)]
)
def test_thinner_target_gives_higher_severity(thickness, severity, judge):
    assert [f.severity for f in judge_alone(judge, foil(thickness))] == ([severity] if severity else [])


def test_slightly_thin_target_needs_no_comparison_design(monkeypatch, judge):
    """A second design with a thick target costs as much as the check; from 1.2 skin depths on it cannot matter."""
    spec = foil("60 um")
    (mine, change, _), (thick, before, _) = numbers(spec), numbers(foil("115 um"))
    assert abs(1.0 - mine / thick) < 0.02 and abs(1.0 - change / before) < 0.01
    estimates = sitscad.estimate(sitscad.lay_out(spec))
    monkeypatch.setattr("sitscad.checks.reading.metal._design_for_comparison", None)
    (result,) = judge("SIT305", spec, None, estimates)
    assert result.severity is Severity.NOTE and result.limit == constant_limits()["thin_target_resistance"].value
    assert abs(result.measured) < 0.09 < constant_limits()["thin_target_resistance"].value


@pytest.mark.parametrize("depths", [1.2, 1.5, 2.0, 3.0])
def test_sheet_resistance_equals_complex_impedance_formula(depths):
    """Against the impedance of an endless sheet with complex numbers."""
    ratio = ((1.0 + 1.0j) / cmath.tanh((1.0 + 1.0j) * depths)).real
    assert _resistance_of_sheet(depths) == approx(ratio, rel=1e-9) and abs(ratio - 1.0) < 0.09


@pytest.mark.parametrize("thickness", [70.0, 84.0])
def test_higher_frequency_is_suggested_only_within_converter_range(thickness):
    """Three skin depths stop 95 %: at 13.1 MHz for 70 um of aluminium, at 9.1 MHz for 84 um; the LDC1614 ends at 10."""
    result = sitscad.check(foil(f"{thickness} um", force=FORCE + "readout: {capacitance: 220 nF}\n"))
    (findings,) = [finding for finding in result.findings if finding.rule == "SIT305"]
    stopped = next(f for f in range(1, 1000) if THICK * skin_depth(0.1e6 * f, 35.4e6) < thickness * 1e-6)
    assert findings.severity is Severity.WARNING
    assert ("thin-thicker-frequency" in findings.cases) is (stopped <= 100)


def judge_alone(judge, spec):
    return judge("SIT305", spec, None, sitscad.estimate(sitscad.lay_out(spec)))


def test_lost_signal_gives_warning_despite_small_loss(judge):
    """A poor conductor: hardly any loss, and a fifth of the signal."""
    for force, case in ((FORCE, "thin-change-newton"), ("", "thin-change-rest")):
        (result,) = judge_alone(judge, foil("200 um", "{conductivity: 3e4 S/m}", force))
        assert result.severity is Severity.WARNING and case in result.cases
        assert result.measured > 0.5 and result.limit == constant_limits()["thin_target_change"].value


@pytest.mark.parametrize("force", [FORCE, ""])
@pytest.mark.parametrize("conductivity", ["0 S/m", "1 S/m"])
def test_target_without_effect_gives_error(conductivity, force, judge):
    (result,) = judge_alone(judge, foil("200 um", f"{{conductivity: {conductivity}}}", force))
    assert result.severity is Severity.ERROR and result.measured < 1e-5 and "poor-conductor" in result.cases
    assert result.limit == constant_limits()["least_target_effect"].value


@pytest.mark.parametrize("permeability", [5, 100])
def test_insulating_magnetic_target_gives_no_error(permeability, verdicts):
    """It draws the field in, and was refused for want of eddy currents."""
    spec = foil("1 mm", f"{{conductivity: 0 S/m, relative_permeability: {permeability}}}")
    findings, undecided = verdicts("SIT305", spec, None, sitscad.estimate(sitscad.lay_out(spec)))
    assert not [finding for finding in findings if finding.severity is Severity.ERROR]
    assert bool(undecided) is (permeability == 100)


def test_every_constant_limit_has_source():
    assert all(row.value > 0.0 and len(row.source) > 40 for row in constant_limits().values())


def test_skin_depth_of_copper_equals_reference_values():
    assert skin_depth(8e6, 58e6) == approx(23.4e-6, abs=0.05e-6)
    assert skin_depth(3.1e6, 58e6) == approx(37e-6, rel=0.02)
    assert skin_depth(5e6, 0.0) == float("inf")


LONG = """\
sitscad: 1
name: long-foil
coil: {{shape: circle, outer_diameter: 8, turns: 10, layers: 2, trace_width: 0.15, trace_spacing: 0.15}}
array: {{pattern: line, count: 2, pitch: 10}}
fpc: {{tail: {{length: 40, connector: solder-pads}}}}
target: {{shape: rectangle, size: [19, 9], thickness: {thickness}, material: {material}}}
elastomer: {{material: ecoflex-00-30, shape: rectangle, size: [19, 9], thickness: 2}}
requirements: {{normal_force: 5 N{more}}}
"""


def judged(text):
    """What SIT327 says of a spec: findings, and what it does not judge."""
    (rule,) = (rule for rule in RULES if rule.id == "SIT327")
    return apply_rule(rule, Design(load_text(text, "long.yaml")))


def bends(thickness, more="", material="aluminium"):
    return judged(LONG.format(thickness=thickness, more=more, material=material))[0]


@pytest.mark.parametrize(("thickness", "more", "is_said"), [
    ("50 um", "", True), ("0.4 mm", "", False), ("50 um", ", contact: [9, 9]", False),
])
def test_soft_contact_over_whole_foil_is_not_checked(thickness, more, is_said):
    """The pad's rim gives way under even pressure; a stiff face, as large as the target, keeps that flat."""
    text = LONG.format(thickness=thickness, more=more, material="copper").replace("[19, 9]", "[9, 9]")
    findings, undecided = judged(text)
    assert not findings and [item.case for item in undecided] == ["even-press"] * is_said


def test_bending_foil_gives_warning_with_sufficient_thickness():
    (text,) = bends("50 um")
    assert text.severity is Severity.WARNING and text.measured > 1.0 and text.key == "target.thickness"
    enough = re.search(r"([\d.]+) um", text.hint)
    assert not bends(f"{enough[1]} um") and bends(f"{0.93 * float(enough[1]):.4g} um")
    assert not bends("50 um", ", contact: [19, 9]") and bends(f"{enough[1]} um", ", contact: 3")
    assert not bends("50 um", material="ferrite"), "whose modulus is not known: not checked"


def test_bending_target_gets_fix_with_sufficient_thickness():
    """The hint named 1.4 mm, and --fix said that no fix is known."""
    spec = sitscad.load_text("""
    {sitscad: 1, name: a, coil: {shape: circle, outer_diameter: 18, turns: 15, layers: 2, trace_width: 0.165,
     trace_spacing: 0.165}, fpc: {margin: [1, 1]}, target: {size: 20, thickness: 0.3, material: aluminium},
     elastomer: {size: 20, thickness: 4}, requirements: {normal_force: 20 N}}
    """, "a.yaml")
    (findings,) = (f for f in sitscad.check(spec).findings if f.rule == "SIT327")
    (remedy,) = findings.fixes
    (edit,) = remedy.edits
    assert edit.key == "target.thickness" and remedy.is_safe
    changed = spec.source.text.replace("thickness: 0.3,", f"thickness: {edit.new},")
    thicker = sitscad.check(load_text(changed), hints="none")
    assert not [f for f in thicker.findings if f.rule == "SIT327"]
