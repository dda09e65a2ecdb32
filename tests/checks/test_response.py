"""Whether every coil feels the force: designs whose coils lie beside the target are named coil by coil."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.basics.finding import Severity
from sitscad.checks.findings import checked_spec, json_document
from sitscad.checks.fixes.pads import other_metals, pad_cut_to_target
from sitscad.checks.reading.response import FEWEST_STEPS, LEAST_SHARE, responses
from sitscad.checks.rules import constant_limits
from sitscad.estimates.design import Design

TEMPLATES = Path(__file__).parents[2] / "templates"

FOUR = """
sitscad: 1
name: line4
coil: {shape: circle, outer_diameter: 10, turns: 13, layers: 2, trace_width: 0.155, trace_spacing: 0.155}
array: {pattern: line, count: 4, pitch: 11.5}
fpc: {tail: {length: 40}}
target: {shape: rectangle, size: [11, 10]}
elastomer: {shape: rectangle, size: [11, 10], thickness: 1}
mount: {kind: bench-plate}
requirements: {normal_force: 5 N}
"""


def answers(estimates, spec, steps):
    """Estimates by hand whose coils change by so many steps of the converter from rest to pressed."""
    numbers = estimates(spec)
    coils = []
    for coil, many in zip(numbers.coils, steps, strict=True):
        rest = replace(coil.states["rest"], converter_inductance=2.5e-6)
        higher = rest.frequency + many * numbers.readout.conversion.resolution(rest.frequency)
        less = 2.5e-6 * (rest.frequency / higher) ** 2
        pressed = replace(coil.states["pressed"], frequency=higher, converter_inductance=less)
        coils.append(replace(coil, states=coil.states | {"rest": rest, "pressed": pressed}))
    return replace(numbers, coils=tuple(coils))


@pytest.mark.slow
def test_coils_beside_target_give_warning_with_larger_target():
    spec = sitscad.load_text(FOUR, "line4.yaml")
    result = sitscad.check(spec)
    (findings,) = [f for f in result.findings if f.rule == "SIT215"]
    assert findings.severity is Severity.WARNING and findings.key == "target.size"
    assert {"C1", "C4"} == set(re.findall(r"C\d", findings.message)) and "C2" in findings.detail
    assert "target.size: [44.5, 10]" in findings.hint
    (untried,) = findings_of("SIT215", spec)
    assert "11.8 mm" in untried.detail and not untried.fixes
    (left,) = [n for n in result.not_checked if n.rule == "SIT306"]
    assert left.case == "target-length-line"


def test_offset_target_gets_hint_of_zero_offset():
    """The hints asked for a softer pad over a coil that the target does not reach."""
    aside = """sitscad: 1
name: aside
coil: {shape: circle, outer_diameter: 10, turns: 13, layers: 2, trace_width: 0.16, trace_spacing: 0.16}
fpc: {margin: [20, 0]}
target: {size: 10, offset: [12, 0]}
elastomer: {size: 10, thickness: 2, offset: [12, 0], material: ecoflex-00-30}
requirements: {normal_force: 2 N}
"""
    result = sitscad.check(sitscad.load_text(aside, "aside.yaml"))
    for rule in ("SIT215", "SIT217"):
        (findings,) = [f for f in result.findings if f.rule == rule]
        assert "target.offset: [0, 0]" in findings.hint
    back = sitscad.check(sitscad.load_text(aside.replace("[12, 0]", "[0, 0]"), "back.yaml"))
    assert not {f.rule for f in back.findings} & {"SIT215", "SIT217", "SIT306"}


def test_suggested_target_size_gives_signal_in_every_coil():
    wide = FOUR.replace("size: [11, 10]", "size: [44.5, 10]")
    spec = sitscad.load_text(wide, "line4.yaml")
    numbers = sitscad.estimate(sitscad.lay_out(spec))
    result = responses(numbers.coils, numbers.readout.conversion)
    most = max(abs(item.change) for item in result)
    assert all(abs(item.change) > 0.5 * most for item in result)


def test_signal_below_least_fraction_of_best_coil_gives_finding(design, estimates, judge):
    spec = design()
    weak = 0.9 * LEAST_SHARE * 1e3
    (result,) = judge("SIT215", spec, None, answers(estimates, spec, (1e3, weak)))
    assert weak > FEWEST_STEPS and result.measured == approx(weak, rel=1e-6)
    assert judge("SIT215", spec, None, answers(estimates, spec, (1e3, 1.1 * LEAST_SHARE * 1e3))) == []


@pytest.mark.parametrize(("shear", "severity"), [(1.0, Severity.ERROR), (None, Severity.WARNING)])
def test_coil_without_signal_gives_error_only_with_required_shear(shear, severity, design, estimates, judge):
    """With one of two coils lost shear is a normal force: that was a warning of the steps alone."""
    spec = design(requirements__shear_force=None if shear is None else f"{shear} N")
    (result,) = judge("SIT215", spec, None, answers(estimates, spec, (1e3, 0.01)))
    assert result.severity is severity
    assert result.measured == approx(0.01, rel=1e-3)
    (weak,) = judge("SIT215", spec, None, answers(estimates, spec, (1e3, 29.0)))
    assert weak.severity is Severity.WARNING and weak.measured == approx(29.0, rel=1e-6)


CELLS = (TEMPLATES / "skin_strip_6.yaml").read_text(encoding="utf-8").replace("coils: 1  ", "coils: 3  ")


@pytest.mark.slow
def test_cell_without_shear_signal_gives_error():
    """Three coils a cell under a target over the middle one, six in all: two of them felt something, each alone."""
    text = CELLS.replace("normal_force: 8 N", "normal_force: 8 N\n  shear_force: 1 N")
    result = sitscad.check(sitscad.load_text(text, "strip.yaml"), hints="none")
    (findings,) = (each for each in result.findings if each.rule == "SIT215")
    assert findings.severity is Severity.ERROR and {"C1", "C3", "C4", "C6"} <= set(re.findall(r"C\d", findings.detail))


def test_few_signal_steps_of_all_coils_give_finding(design, estimates, judge):
    spec = design()
    (result,) = judge("SIT215", spec, None, answers(estimates, spec, (29.0, 29.0)))
    assert result.key == "elastomer.thickness"
    assert result.measured == approx(29.0, rel=1e-6) and result.limit == FEWEST_STEPS
    assert judge("SIT215", spec, None, answers(estimates, spec, (31.0, 31.0))) == []


def test_missing_signal_estimate_leaves_rule_not_checked(design, estimates, verdicts):
    spec = design()
    findings, skipped = verdicts("SIT215", spec, None, estimates(spec))
    assert findings == [] and skipped[0].case == "no-change"
    assert verdicts("SIT215", design(requirements__normal_force=None))[1][0].case == "no-requirement"


SMALL = """
sitscad: 1
name: small
coil: {shape: circle, outer_diameter: 8, turns: 12, layers: 2, trace_width: 0.155, trace_spacing: 0.155}
fpc: {tail: {length: 40}}
target: {shape: circle, size: 9}
elastomer: {material: MATERIAL, shape: circle, size: 9, thickness: 2}
mount: {kind: bench-plate}
requirements: {normal_force: 2 N}
"""


@pytest.mark.parametrize(("material", "small"), [("ecoflex-00-30", False), ("dragon-skin-30", True)])
def test_signal_smaller_than_thermal_drift_gives_warning(material, small):
    """A sensor whose reading changes by half a per cent over its whole range passed without a word."""
    spec = sitscad.load_text(SMALL.replace("MATERIAL", material), "small.yaml")
    result = sitscad.check(spec)
    findings = [f for f in result.findings if f.rule == "SIT217"]
    (signal,) = result.signals
    states = sitscad.estimate(sitscad.lay_out(spec)).coils[0].states
    before, after = (states[name].converter_inductance for name in ("rest", "pressed"))
    assert signal.share == approx(after / before - 1.0, rel=1e-6)
    assert bool(findings) is small is (abs(signal.share) < constant_limits()["least_signal"].value)
    if small:
        (item,) = findings
        assert item.severity is Severity.WARNING and item.measured == approx(abs(signal.share), rel=1e-6)
        assert "small-signal-steps" in item.cases
        # a target over the whole coil and a mount without metal: neither makes the signal larger
        assert "elastomer" in item.hint and "target" not in item.hint and "metal" not in item.hint


def test_json_contains_signal_of_every_coil():
    """Programs found neither the change per newton nor the share that SIT217 judges unless it was too small."""
    spec = sitscad.load_text(SMALL.replace("MATERIAL", "ecoflex-00-30"), "small.yaml")
    result = sitscad.check(spec)
    checked = checked_spec(spec.name, spec.source, result.findings, result.not_checked, result.signals)
    (entry,) = json_document([checked])["specs"][0]["signal"]
    (signal,), coil = result.signals, sitscad.estimate(sitscad.lay_out(spec)).as_json("small.yaml")["coils"][0]
    assert entry["coil"] == "C1" and entry["force_N"] == 2.0 and entry["share"] == signal.share
    for key in ("inductance_H_per_N", "frequency_Hz_per_N", "sigma_inductance_H_per_N", "sigma_frequency_Hz_per_N"):
        assert entry[key] == approx(coil[key], rel=1e-6)
    assert entry["rest_inductance_H"] == approx(coil["states"]["rest"]["inductance_H"], rel=1e-6)
    assert entry["steps"] == approx(signal.steps, rel=1e-6) and entry["frequency_share"] > 0.0


def test_signal_steps_are_frequency_change_over_converter_resolution():
    """A change by the converter's formula stood over a step of the inductance at the contacts: 39.5 for 35 steps."""
    design = sitscad.Design(sitscad.load_text(SMALL.replace("MATERIAL", "ecoflex-00-30"), "small.yaml"))
    (coil,), (signal,) = design.estimates.coils, design.estimates.signals
    (judged,) = responses(design.estimates.coils, design.estimates.readout.conversion)
    rest, pressed = coil.states["rest"], coil.states["pressed"]
    wanted = (pressed.frequency - rest.frequency) / design.estimates.readout.conversion.resolution(rest.frequency)
    assert signal.steps == approx(wanted, rel=1e-9) and judged.steps == approx(wanted, rel=1e-9)
    assert abs(judged.change) / judged.step == approx(wanted, rel=0.03), "but for the curve of f over L"
    assert rest.converter_inductance > 1.02 * rest.inductance, "or both ways are alike"


def test_spec_without_force_has_no_signals():
    text = FOUR.replace("requirements: {normal_force: 5 N}\n", "")
    result = sitscad.check(sitscad.load_text(text, "line4.yaml"), hints="none")
    assert result.signals == () and "SIT217" in {n.rule for n in result.not_checked}


@pytest.mark.slow
def test_temperature_sensor_clears_thermal_drift_warning(advised):
    """Of signals below 1 %, those above 0.3 % are kept from warmth by a compensation."""
    spec = sitscad.load_text(SMALL.replace("MATERIAL", "dragon-skin-20"), "small.yaml")
    (findings,) = advised("SIT217", spec)
    assert constant_limits()["least_signal_compensated"].value < findings.measured < findings.limit
    sensor = spec.replace("readout.thermistor.part", "tmp117")
    assert advised("SIT217", sensor) == []
    keys = [edit.key for fix in findings.fixes for edit in fix.edits]
    assert keys, "a change that clears it is named"


def test_drift_over_ten_kelvin_agrees_with_constant():
    spec = sitscad.load_text(SMALL.replace("MATERIAL", "ecoflex-00-30"), "small.yaml")
    layout = sitscad.lay_out(replace(spec, readout=replace(spec.readout, capacitance=220e-12)))
    cold, warm = (sitscad.estimate(layout, temperature=t).coils[0].states["rest"] for t in (20.0, 30.0))
    moved = warm.converter_inductance / cold.converter_inductance - 1.0
    assert 0.3 < moved / constant_limits()["drift_of_ten_kelvin"].value < 2.0


@pytest.mark.slow
def test_magnetic_steel_target_with_small_signal_gets_copper_fix(advised):
    """17-4PH gave 0.06 % where 304 gives 0.7: softness and thickness were offered, and four rounds lost."""
    steel = sitscad.load(TEMPLATES / "bench_7mm.yaml").replace("target.material", "stainless-17-4ph")
    (findings,) = advised("SIT217", steel)
    assert [edit.new for fix in other_metals(steel) for edit in fix.edits] == ["stainless-316l", "copper"]
    assert [(edit.key, edit.new) for edit in findings.fixes[0].edits] == [("target.material", "copper")]
    equal = sitscad.check(steel.replace("target.material", "stainless-316l"), hints="none").findings
    (better,) = [f for f in equal if f.rule == "SIT217"]
    assert 1.5 * findings.measured < better.measured < better.limit, "more signal, and not enough"
    copper = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    assert not list(other_metals(copper)), "there is no better conductor"


@pytest.mark.slow
def test_pad_wider_than_target_gets_hint_to_cut_it():
    """Cutting it from 12 mm to the target's 10 helped most, and no hint said so."""
    wide = """
    {sitscad: 1, name: tip, coil: {shape: circle, outer_diameter: 10, turns: 13, layers: 2, trace_width: 0.16,
     trace_spacing: 0.16}, target: {shape: square, size: 10, thickness: 0.2, material: copper},
     elastomer: {shape: square, size: 13, thickness: 1.8, material: ecoflex-00-30}, requirements: {normal_force: 0.4 N}}
    """
    spec = sitscad.load_text(wide, "wide.yaml")
    narrow = spec.replace("elastomer.size", 10e-3)
    here, there = (abs(Design(each).estimates.signals[0].share) for each in (spec, narrow))
    (findings,) = (f for f in sitscad.check(spec).findings if f.rule == "SIT217")
    times = re.match(r"elastomer\.size: 10 \(tried: improves the value by a factor of ([\d.]+)", findings.hint)[1]
    assert float(times) == approx(there / here, rel=0.05) and there > 1.2 * here
    (untried,) = findings_of("SIT217", spec)
    assert "elastomer.size: 10" in untried.hint
    assert pad_cut_to_target(narrow) is None
    assert pad_cut_to_target(spec.replace("elastomer.offset", [0.5e-3, 0])) is None


@pytest.mark.slow
def test_thick_pad_gets_thickness_with_largest_signal(advised):
    """Too thin a pad gives way too little, too thick a one keeps the target away; nobody said which is best."""
    thick = """
    {sitscad: 1, name: thick, array: {pattern: line, count: 2, pitch: 7}, readout: {capacitance: 150 pF},
     coil: {shape: circle, outer_diameter: 6, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um},
     target: {shape: rectangle, size: [7, 6], thickness: 0.3, material: copper},
     elastomer: {shape: rectangle, size: [12, 6], thickness: 4, material: ecoflex-00-30},
     requirements: {normal_force: 0.3 N}}
    """
    spec = sitscad.load_text(thick, "thick.yaml")
    (findings,) = advised("SIT217", spec)
    named = r"elastomer\.thickness: ([\d.]+) \(tried: improves the value by a factor of ([\d.]+)"
    thickness, times = re.match(named, findings.hint).groups()
    share = {mm: abs(Design(spec.replace("elastomer.thickness", f"{mm} mm")).estimates.signals[0].share)
             for mm in ("1.2", "1.5", "2", "4")}
    assert share[thickness] == max(share.values()) and share[thickness] / share["4"] == approx(float(times), rel=0.05)
