"""SIT401 to SIT409: requirements of how finely and truly a sensor feels, and notes on what a reading can mean."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad.apps.study.measures import MEASURES
from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.findings import as_json, as_text
from sitscad.checks.findings.document import read_findings
from sitscad.checks.judging import RULES, apply_rules, check
from sitscad.checks.performance import estimated_values, largest_by_unit
from sitscad.checks.rules import NEEDS, apply_rule
from sitscad.estimates.design import Design
from sitscad.estimates.loads.working_range import validated_shear
from sitscad.estimates.performance.tables import PerformanceReport, axis_table
from sitscad.estimates.performance_values import combined_error
from sitscad.package.example_specs import write_template
from sitscad.package.inspection import as_configured
from sitscad.spec import templates
from sitscad.spec.load import load_text, rewritten_spec
from sitscad.spec.sensor import TiltErrors

TEMPLATES = Path(__file__).parents[2] / "templates"
ASKED = {
    "SIT401": {"normal_resolution": (1e-3, 0.1)},
    "SIT402": {"shear_resolution": (1e-5, 0.1)},
    "SIT403": {"crosstalk": (1e-7, 0.5)},
    "SIT404": {"tilt": (0.05, 0.05), "tilt_error": (1e-3, 1.0)},
    "SIT405": {"friction_error": (1e-4, 1.0)},
    "SIT406": {"temperature_range": ((15.0, 45.0), (15.0, 45.0)), "temperature_error": (1e-3, 100.0)},
    "SIT414": {"normal_error": (0.3, 0.4)},
}
"""By rule its requirements: what bench_7mm misses, and what it meets."""


@pytest.fixture(scope="module")
def bench():
    design = template_design("bench_7mm")
    assert design.estimates
    return design


def _judged(rule_id, design, **needs):
    (rule,) = (rule for rule in RULES if rule.id == rule_id)
    request = replace(design.spec, requirements=replace(design.spec.requirements, **needs))
    return apply_rule(rule, Design(request, replace(design.layout, spec=request), design.estimates))


@pytest.mark.slow
def test_too_large_tilt_error_gets_smaller_target_and_pad(monkeypatch):
    """The hint named softer and thinner pads alone, where a pad shorter by 0.3 mm was enough."""
    for family in ("other_metals", "other_silicones", "other_thicknesses"):
        monkeypatch.setattr(f"sitscad.checks.performance.{family}", lambda spec, is_softer=True: ())
    spec = rewritten_spec(sitscad.load(TEMPLATES / "grasper_4layer.yaml"), [
        ("requirements.tilt", "1 deg"), ("requirements.tilt_error", {"shear_x": "60 mN"})])
    (findings,) = (item for item in check(spec).findings if item.rule == "SIT404")
    keys = {edit.key for edit in findings.fixes[0].edits}
    assert findings.severity is Severity.ERROR and keys == {"target.size", "elastomer.size"}


@pytest.mark.parametrize("kind, together", [("normal", 0.330), ("shear", 0.0696)])
def test_resolution_below_combined_error_gives_warning_unless_error_allowed(bench, kind, together):
    """`check` said ok to 500 mN of resolution where tilt alone was read as 2.6 N."""
    key = f"requirements.{kind}_resolution"
    (findings,), _ = _judged("SIT414", bench, **{f"{kind}_resolution": 0.5 * together})
    assert (findings.severity, findings.key) == (Severity.WARNING, key)
    assert findings.measured == approx(together, rel=0.02) and findings.limit == 0.5 * together
    assert _judged("SIT414", bench, **{f"{kind}_resolution": 2.0 * together}) == ([], [])
    allowed = {f"{kind}_resolution": 0.5 * together, f"{kind}_error": 1.1 * together}
    assert _judged("SIT414", bench, **allowed) == ([], [])


def test_combined_error_equals_data_sheet_and_includes_required_shear(bench):
    def together(**needs):
        request = replace(bench.spec, requirements=replace(bench.spec.requirements, normal_resolution=1.0, **needs))
        design = Design(request, replace(bench.layout, spec=request), bench.estimates)
        return {item.requirement: item for item in estimated_values(design.cells)}

    alone, full = together(), bench.sensing.performance[-1]
    assert alone["normal_error"].measured == approx(combined_error(full.axes["normal"].errors), rel=0.02)
    assert alone["tilt_of_one_degree"].limit is None and alone["tilt_of_one_degree"].measured > 0.01
    with_shear = together(shear_force=0.5)
    both = alone["normal_error"].measured, with_shear["unmeasured_shear"].measured
    assert with_shear["normal_error"].measured == approx(np.hypot(*both), rel=1e-4)
    assert with_shear["normal_error"].measured > both[0]
    assert "tilt_of_one_degree" not in together(tilt=0.01, tilt_error=1.0)


@pytest.mark.parametrize("rule_id", ASKED)
def test_missed_requirement_gives_finding_and_met_one_does_not(bench, rule_id):
    missed, met = ({name: pair[k] for name, pair in ASKED[rule_id].items()} for k in (0, 1))
    (finding,), skipped = _judged(rule_id, bench, **missed)
    assert not skipped and finding.measured > finding.limit
    assert finding.key.removeprefix("requirements.") in ASKED[rule_id]
    assert finding.severity is (Severity.WARNING if rule_id in ("SIT405", "SIT406", "SIT414") else Severity.ERROR)
    assert _judged(rule_id, bench, **met) == ([], [])


@pytest.mark.slow
def test_requirement_without_effective_change_gets_general_advice(advised):
    """A drift was answered with what was tried in vain, and no longer with a tare or a reference coil."""
    spec = sitscad.load_text("""
    {sitscad: 1, name: a, coil: {shape: circle, outer_diameter: 10, turns: 8, layers: 2, trace_width: 0.2,
     trace_spacing: 0.2}, target: {size: 10}, elastomer: {size: 10, thickness: 2},
     requirements: {normal_force: 5 N, temperature_range: [15, 35], temperature_error: 1 mN}}
    """, "a.yaml")
    (findings,) = advised("SIT406", spec)
    (rule,) = (rule for rule in RULES if rule.id == "SIT406")
    assert rule.mend.rstrip(".") in findings.hint and not findings.fixes


def test_check_output_shows_estimated_values_beside_requirements(bench):
    """A resolution that passed was silent."""
    wanted = {"tilt": 0.05, "tilt_error": 1.0, "normal_resolution": 0.1, "crosstalk": 0.5}
    request = replace(bench.spec, requirements=replace(bench.spec.requirements, **wanted))
    result = check(request, replace(bench.layout, spec=request), bench.estimates, "none")
    results = {each.requirement: each for each in result.reached}
    asked_for = ["normal_resolution", "crosstalk", "tilt_error"]
    assert list(results) == [*asked_for, "unmeasured_shear", "normal_error", "zero_drift", "drift", "tared_drift",
                           "hysteresis", "creep", "modulus"]
    results = {name: results[name] for name in asked_for}
    assert all(0.0 < each.measured < each.limit == wanted[name] for name, each in results.items())
    checked = as_configured(request, result)
    line = "felt: +normal resolution by noise alone 1\\.[0-9]+ mN of 100 mN asked \\(normal, at full load\\)\n +cross"
    assert re.search(f"^{line}", as_text([checked]), re.MULTILINE)
    document = json.loads(as_json([checked]))["specs"][0]
    assert [each["rule"] for each in document["felt"]] == [
        "SIT401", "SIT403", "SIT404", "SIT409", "SIT414", *["SIT406"] * 3, *["SIT405"] * 3]
    assert read_findings(as_json([checked]).encode(), "", "").reached == result.reached


@pytest.mark.slow
def test_estimated_values_include_hysteresis_creep_modulus_and_tared_drift(bench):
    """Beside a resolution known within a few per cent, what a pad is off by by a tenth was not said."""
    request = replace(bench.spec, requirements=replace(bench.spec.requirements, normal_resolution=0.1))
    design = Design(request, replace(bench.layout, spec=request), bench.estimates)
    findings = {item.requirement: item for item in check(request, design.layout, bench.estimates, "none").reached}
    full, k = design.performance[-1], list(design.performance[-1].axes).index("normal")
    for name, cause in (("hysteresis", "hysteresis"), ("creep", "creep"), ("modulus", "modulus, before calibration"),
                        ("tared_drift", "drift with a tare before each grasp, 10 K")):
        assert findings[name].axis == "normal" and findings[name].limit is None
        assert findings[name].measured == approx(full.axes["normal"].errors[cause], rel=0.1), name
    pad = request.elastomer.material
    assert findings["creep"].measured == approx(pad.creep * full.axes["normal"].full_scale, rel=1e-9)
    # the tare takes away what moves the reading at rest: capacitors and most of the metal
    warmed = design.sensing.analysis.warmed[-1]
    assert warmed.tared_drift[k] < warmed.drift[k]
    elastomer = warmed.bench.spec.elastomer
    elastomer = replace(elastomer, material=replace(elastomer.material, expansion=0.0))
    spec = replace(warmed.bench.spec, elastomer=elastomer)
    left = replace(warmed, by_metal_loaded=warmed.by_metal, bench=replace(warmed.bench, spec=spec))
    assert left.tared_drift[k] == approx(10.0 * pad.modulus_temperature_coefficient * warmed.axis_loads[k], rel=1e-9)


@pytest.mark.parametrize(("needs", "end"), [({}, 30.0), ({"temperature_range": (-20.0, 45.0)}, -20.0)])
def test_check_output_shows_zero_drift_with_temperature(bench, needs, end):
    """It was most of what three sensors of a new user were off by, and every line of what is felt was met."""
    wanted = {"normal_resolution": 0.1, **needs}
    request = replace(bench.spec, requirements=replace(bench.spec.requirements, **wanted))
    design = Design(request, replace(bench.layout, spec=request), bench.estimates)
    checked = as_configured(request, check(request, design.layout, bench.estimates, "none"))
    drift = abs(end - 20.0) * design.sensing.analysis.warmed[0].temperature[0]
    line = f"zero drift {show(float(drift), 'N', 3)} (normal, at rest, after one tare, 20 to {end:.3g} degC)"
    assert line in as_text([checked]) and drift > 0.1
    assert json.loads(as_json([checked]))["specs"][0]["felt"][-1]["limit"] is None


@pytest.mark.parametrize("rule_id", ASKED)
def test_rule_without_stated_requirement_is_not_checked(bench, rule_id):
    findings, (skipped,) = _judged(rule_id, bench)
    assert not findings and skipped.case in {case for _, case in NEEDS.values()}


@pytest.mark.parametrize(("rule_id", "needs", "absent"), [
    ("SIT406", {"temperature_range": (15.0, 35.0)}, "requirements.temperature_error"),
    ("SIT404", {"tilt_error": 0.1}, "requirements.tilt"),
    ("SIT404", {}, "requirements.tilt and requirements.tilt_error"),
])
def test_reason_names_missing_one_of_two_requirements(bench, rule_id, needs, absent):
    """A spec with a range of temperatures was told that there is none, or no error."""
    _, (skipped,) = _judged(rule_id, bench, **needs)
    assert skipped.reason == f"no {absent} in the spec"


@pytest.mark.slow
def test_error_budget_uses_required_temperature_range(bench):
    """The largest error of a sensor for 15 to 35 degC stood as "temperature, 10 K"."""
    request = replace(bench.spec, requirements=replace(bench.spec.requirements, temperature_range=(-10.0, 45.0)))
    ranged = Design(request, replace(bench.layout, spec=request), bench.estimates)
    wide, usual = (design.performance[-1].axes["normal"].errors for design in (ranged, bench))
    assert "drift at full load, 10 K" not in wide
    assert wide["drift at full load, 30 K"] == approx(3.0 * usual["drift at full load, 10 K"], rel=1e-9)
    shear = next(axis for axis in bench.performance[-1].axes if axis != "normal")
    wide, usual = (design.sensing.analysis.friction(shear) for design in (ranged, bench))
    assert wide["drift at full load, 30 K"] == approx(3.0 * usual["drift at full load, 10 K"], rel=1e-9)


@pytest.mark.slow
def test_check_data_sheet_and_sweep_give_equal_drift_values(bench):
    """1.7, 3.34 and 3.3 N stood for "temperature", at rest and at full load."""
    request = replace(bench.spec, requirements=replace(bench.spec.requirements, normal_resolution=1.0))
    design = Design(request, replace(bench.layout, spec=request), bench.estimates)
    rest, _, full = design.performance
    reached = {item.requirement: item for item in apply_rules(design, "none").reached}
    axis = {name.replace("_", " along "): name for name in rest.axes}
    for name, point, cause, at in (("zero_drift", rest, "zero drift, 10 K", "at rest"),
                                   ("drift", full, "drift at full load, 10 K", "at full load")):
        item = reached[name]
        figure = point.axes[axis[item.axis]].errors[cause]
        assert item.at.startswith(at) and item.measured == approx(figure, rel=1e-12, abs=0.0)
        rows = axis_table(PerformanceReport(design.performance, design.spec)).rows
        assert [row[0].startswith(cause) for row in rows].count(True) == 1
    for measure, point, cause in (("error.zero_drift.normal", rest, "zero drift, 10 K"),
                                  ("error.temperature.normal", full, "drift at full load, 10 K")):
        value, error = MEASURES[measure].read(design)
        assert value == approx(point.axes["normal"].errors[cause], rel=1e-12, abs=0.0) and error == 0.0
    assert reached["zero_drift"].measured < reached["drift"].measured


@pytest.mark.slow
def test_checked_resolution_equals_largest_axis_resolution(bench):
    (finding,), _ = _judged("SIT401", bench, normal_resolution=1e-6)
    most = max(point.axes["normal"].resolution for point in bench.performance)
    assert finding.measured == approx(most, rel=1e-12, abs=0.0)


def test_single_coil_tilt_error_includes_second_order():
    """By symmetry hardly any slope over tilt is left; any tilt passed, however small its allowed error."""
    item = template_design("fingertip_foil")
    (finding,), left = _judged("SIT404", item, tilt=0.0349, tilt_error=3e-3)
    assert not left and finding.measured == approx(0.0157, rel=0.2)
    assert _judged("SIT404", item, tilt=0.0349, tilt_error=25e-3) == ([], [])
    findings, left = _judged("SIT403", item, crosstalk=1e-9)
    assert not findings and left[0].case == "one-axis"


def test_single_coil_with_shear_requirement_gives_error():
    design = template_design("fingertip_foil")
    (finding,), _ = _judged("SIT402", design, shear_resolution=0.1)
    assert "no-shear-coil" in finding.cases and finding.severity is Severity.ERROR
    (finding,), _ = _judged("SIT405", design, friction_error=0.1)
    assert "no-friction-coil" in finding.cases
    (finding,), _ = _judged("SIT409", design, shear_force=1.0)
    assert finding.severity is Severity.NOTE and "one-coil-shear" in finding.cases


LONG = """sitscad: 1
name: strip
coil: {shape: racetrack, outer_diameter: [16, 1.99], turns: 3.5, layers: 4, trace_width: 0.08, trace_spacing: 0.08}
fpc: {stackup: flex-4l, rules: generic-fine}
target: {shape: rectangle, size: [16, 2.2], thickness: 0.6}
elastomer: {shape: rectangle, size: [16, 2.2], thickness: 1, material: ecoflex-00-30}
requirements: {normal_force: 1 N, normal_resolution: 50 mN, contact: [12, 2]}
"""
FOUR = """sitscad: 1
name: tip
coil: {shape: circle, outer_diameter: 4.2, turns: 6, layers: 4, trace_width: 0.1, trace_spacing: 0.1}
array: {pattern: grid, count: [2, 2], pitch: 4.5}
fpc: {stackup: flex-4l, rules: generic-fine}
target: {shape: square, size: 6.5, thickness: 0.3}
elastomer: {shape: square, size: 6.5, thickness: 1.2, material: dragon-skin-10}
requirements: {normal_force: 5 N, moment_x: 3 N mm, moment_y: 3 N mm, moment_resolution: 0.1 N mm}
"""
NOTE, WARNING = [Severity.NOTE], [Severity.WARNING]


@cache
def design_of(text):
    """The design of a spec, which is estimated once: shear and allowed errors change no estimate."""
    return Design(load_text(text))


UNMEASURED = [
    ("coil alone", LONG, {}, "normal", 0.1, WARNING),
    ("coil alone, little friction", LONG, {"shear_force": 0.05}, "normal", 0.1, NOTE),
    ("coil alone, required friction", LONG, {"shear_force": 0.3}, "normal", 0.1, WARNING),
    ("coil alone, small allowed error", LONG, {"shear_force": 0.05, "normal_error": 1e-5}, "normal", 1e-5, WARNING),
    ("coil alone, large allowed error", LONG, {"normal_error": 3.0}, "normal", 3.0, []),
    ("moments", FOUR, {}, "moment", 0.3e-3, WARNING),
    ("moments, little friction", FOUR, {"shear_force": 0.02}, "moment", 0.3e-3, []),
    ("moments, large allowed error", FOUR, {"moment_error": 0.1, "normal_error": 10.0}, "moment", 0.1, []),
]


@pytest.mark.parametrize(("text", "needs", "axis", "limit", "severities"), [row[1:] for row in UNMEASURED],
                         ids=[row[0] for row in UNMEASURED])
def test_unmeasured_shear_gives_warning_above_allowed_error_or_tenth_of_range(
        text, needs, axis, limit, severities):
    """It was a note, although it read as 87 % of full scale. Friction is expected if no shear is required."""
    known = design_of(text)
    spec = replace(known.spec, requirements=replace(known.spec.requirements, **needs))
    result = check(spec, replace(known.layout, spec=spec), known.estimates, "none")
    shear = [each for each in result.reached if each.requirement == "unmeasured_shear"]
    assert [each.unit for each in shear] == (["N"] if axis == "normal" else ["N", "N m"])
    assert axis in shear[-1].axis and shear[-1].rule == "SIT409" and shear[-1].limit is None
    findings = [each for each in result.findings if each.rule == "SIT409"]
    assert [each.severity for each in findings] == severities
    assert (shear[-1].measured > limit) == (severities == WARNING)
    for each in findings:
        assert (each.measured, each.limit, each.key) == (
            approx(shear[-1].measured, rel=1e-12), approx(limit, rel=1e-9), "requirements.shear_force")


def test_largest_errors_are_chosen_separately_for_forces_and_moments():
    """300 mN of shear were printed where the normal axis had 1 N, because shear has the smaller full scale."""
    errors = {"normal": 1.0, "shear_x": 0.3, "moment_y": 2e-3}
    force, moment = largest_by_unit("creep", "SIT405", errors, "at full load")
    assert (force.axis, force.measured, force.unit) == ("normal", 1.0, "N")
    assert (moment.measured, moment.unit) == (2e-3, "N m")
    (alone,) = largest_by_unit("creep", "SIT405", {"shear_x": 0.3, "normal": 0.1}, "at full load")
    assert (alone.measured, alone.requirement) == (0.3, "creep")


def test_estimated_values_are_largest_force_errors_of_all_axes(bench):
    request = replace(bench.spec, requirements=replace(bench.spec.requirements, normal_resolution=1.0, tilt=0.005))
    design = Design(request, replace(bench.layout, spec=request), bench.estimates)
    full, results = design.sensing.analysis.warmed[-1], {one.requirement: one for one in estimated_values(design.cells)}
    for name, errors in {"hysteresis": full.hysteresis, "drift": full.drift, "tared_drift": full.tared_drift,
                         "tilt": full.tilt_errors(0.005).max(axis=1)}.items():
        assert len(errors) > 1 and results[name].measured == approx(errors.max(), rel=1e-12), name
    assert "tilt_of_one_degree" not in results


@pytest.mark.parametrize("tilt", [None, math.radians(0.5), math.radians(5.0)])
def test_combined_error_uses_required_tilt_or_one_degree(bench, tilt):
    """One degree was taken whatever tilt was required."""
    needs = replace(bench.spec.requirements, normal_resolution=1.0, tilt=tilt)
    request = replace(bench.spec, requirements=needs)
    felt = Design(request, replace(bench.layout, spec=request), bench.estimates).sensing.analysis
    name = {None: "tilt of 1 degree"}.get(tilt, f"tilt of {math.degrees(tilt or 0.0):.1g} degrees")
    both = felt.warmed[-1].tilt_errors(tilt or math.radians(1.0))
    assert felt.lasting_errors[name] == approx(np.hypot(*both.T), rel=1e-9)
    assert sum(cause.startswith("tilt") for cause in felt.lasting_errors) == 1


def test_two_coils_with_required_shear_give_no_finding(bench):
    assert _judged("SIT409", bench, shear_force=1.0) == ([], [])


def test_tilt_error_larger_than_noise_gives_note(bench):
    (finding,), _ = _judged("SIT408", bench, normal_resolution=1.0)
    assert finding.severity is Severity.NOTE and finding.measured > 10.0
    assert "shear along x" in finding.message


def test_tilt_note_proposes_only_missing_requirements(bench):
    """It asked for a tilt and a tilt_error of specs that have both."""
    def hint(**needs):
        (finding,), _ = _judged("SIT408", bench, normal_resolution=1.0, **needs)
        return finding.hint

    assert "requirements.tilt and requirements.tilt_error" in hint()
    assert "requirements.tilt_error" in hint(tilt=0.02) and "requirements.tilt and" not in hint(tilt=0.02)
    assert "requirements.tilt" not in hint(tilt=0.02, tilt_error=TiltErrors(shear_x=1.0, shear_y=1.0))
    other = hint(tilt=0.02, tilt_error=TiltErrors(normal=1.0))
    assert "requirements.tilt_error.shear_x" in other


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", templates.names())
def test_hints_propose_no_value_already_in_spec(name):
    """A value advised for a key is another than the spec's, and a requirement named alone is not stated yet."""
    spec = sitscad.load_text(templates.read(name), "spec.yaml")
    has_moments = any(spec.requirements.moments)
    for result in sitscad.check(spec, hints="none").findings:
        for key, value in re.findall(r"\b([a-z_]+(?:\.[a-z_]+)+): ([^,;()]+)", result.hint):
            assert spec.source.text is not None and f"{key.split('.')[-1]}: {value.strip()}" not in spec.source.text
        for key in re.findall(r"requirements\.([a-z_]+)(?!\w|[.:])", result.hint):
            assert getattr(spec.requirements, key) is None, (result.rule, result.hint)
        assert not has_moments or not {"tilt-advice", "tilt-advice-judged"} & set(result.cases), result.rule


@pytest.mark.slow
def test_ambiguous_shear_loads_give_note(bench):
    """Far beyond the coils the target is as far from one as from nothing: readings turn back."""
    thick = bench.spec.replace("elastomer.thickness", 5e-3)
    (finding,), _ = _judged("SIT407", Design(thick), normal_resolution=1.0, normal_force=1.0, shear_force=1.2)
    assert "loads-alike" in finding.cases and finding.severity is Severity.NOTE
    assert _judged("SIT407", bench, normal_resolution=1.0, shear_force=0.5) == ([], [])


def test_target_beside_coils_leaves_resolution_not_checked(bench):
    aside = bench.spec.replace("target.offset", [16e-3, 0])
    design = Design(aside)
    findings, (skipped,) = _judged("SIT401", design, normal_resolution=0.1)
    assert not findings and skipped.case == "performance-unknown"


@pytest.mark.slow
def test_scan_rate_fix_clears_resolution_finding(advised):
    text = (TEMPLATES / "bench_7mm.yaml").read_text()
    spec = sitscad.load_text(text.replace("  bandwidth: 50 Hz", "  bandwidth: 20 Hz\n  normal_resolution: 1.3 mN"))
    (finding,) = advised("SIT401", spec)
    (fix, *_) = finding.fixes
    assert fix.edits[0].key == "readout.scan_rate"
    mended = spec.replace(fix.edits[0].key, fix.edits[0].new)
    assert _judged("SIT401", Design(mended)) == ([], [])


@pytest.mark.slow
def test_check_without_sensing_requirements_imports_no_performance_modules(tmp_path):
    spec = write_template("bench_7mm", tmp_path / "spec.yaml")
    run = "import sys; from sitscad.cli import main\ntry: main(['check', sys.argv[1]])\nfinally: " \
          "print([m for m in sys.modules if 'performance.points' in m or 'response.model' in m], file=sys.stderr)"
    source = str(Path(sitscad.__file__).parents[1])
    done = subprocess.run([sys.executable, "-c", run, str(spec)], capture_output=True, text=True,
                          env={"PYTHONPATH": source})
    assert done.stderr.splitlines()[-1] == "[]"


# ------------------------------------------------------------------------------------------- pads that do not hold


def _pressed(size, force, **needs):
    """A pair of coils, and a pad of a size (mm) under a force (N)."""
    text = (TEMPLATES / "robotic_jaw_12mm.yaml").read_text(encoding="utf-8")
    spec = sitscad.load_text(text, "spec.yaml")
    pad = replace(spec.elastomer, size=(size * 1e-3, size * 1e-3))
    return replace(spec, elastomer=pad, requirements=replace(spec.requirements, normal_force=force, **needs))


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_collapsing_pad_leaves_performance_not_checked():
    """Its figures at half load were zeros, and the least of noises passed; numpy warned of them."""
    design = Design(_pressed(0.25, 8.0))
    for rule_id in ("SIT401", "SIT402", "SIT407", "SIT408"):
        (rule,) = (rule for rule in RULES if rule.id == rule_id)
        findings, skipped = apply_rule(rule, design)
        assert skipped[0].case == "performance-lost" and "at half load" in skipped[0].reason
        assert not any("half" in item.message or "full" in item.message for item in findings)
    assert "SIT304" in [f.rule for f in apply_rules(design, hints="none").findings if f.severity is Severity.ERROR]
    assert design.performance == ()


def test_noise_of_unmeasurable_axis_is_infinite(bench):
    """Least squares leave such an axis out, and its noise was none."""
    felt = bench.sensing.analysis
    point = felt.points[0]
    blind = replace(point, by_pose=0.0 * point.by_pose, inverse=0.0 * point.inverse)
    assert np.isfinite(point.noise).all() and np.isinf(blind.noise).all()
    known, untold = (item.errors(felt.units, felt.working.map_errors) for item in (point, blind))
    assert all(np.isfinite(error).all() for error in known.values())
    assert all(np.isinf(error).all() for error in untold.values())


def test_suggested_scan_rate_gives_sufficient_signal_steps():
    """Fewer scans a second were advised, and nothing said how many."""
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml").replace(
        {"requirements.normal_force": "80 mN", "requirements.bandwidth": "1 Hz", "readout.scan_rate": "1 kHz"})

    def said(changes):
        result = sitscad.check(spec.replace(changes), hints="none").findings
        return [item for item in result if item.rule == "SIT215"]

    (result,) = said({})
    rate = float(re.search(r"readout.scan_rate: (\d+) Hz", result.hint)[1])
    assert rate == approx(1e3 * result.measured / result.limit, rel=0.02)
    assert said({"readout.scan_rate": f"{rate} Hz"}) == []
    assert "readout.scan_rate)" in said({"requirements.normal_force": "5 mN"})[0].hint, "beyond the longest conversion"


def test_shear_beyond_validated_range_gets_material_with_larger_range():
    spec = sitscad.load(TEMPLATES / "three_axis_grid.yaml")
    ((findings,), _) = _judged("SIT312", Design(spec))
    name = re.search(r"such as one of ([a-z0-9-]+)", findings.hint)[1]
    assert validated_shear(spec) < spec.requirements.shear_force
    assert validated_shear(spec.replace("elastomer.material", name)) >= spec.requirements.shear_force
