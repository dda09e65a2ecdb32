"""Performance at the screen level against the response; checks and data sheets have the response's own figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.basics.record import replace
from sitscad.checks.judging import apply_rules
from sitscad.checks.performance import POINTS
from sitscad.estimates import estimate_layout
from sitscad.estimates.performance.screen import NEARLY
from sitscad.estimates.windings.losses import SCREENING

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["bench_7mm", pytest.param("grasper_4layer", marks=pytest.mark.slow),
                                  pytest.param("three_axis_triangle", marks=pytest.mark.slow)])
def test_screen_resolution_agrees_with_response_within_error(name):
    design = template_design(name)
    screened = Design(design.spec, design.layout, estimate_layout(design.layout, tolerance=SCREENING))
    for point, other in zip(screened.sensing.analysis.points, design.sensing.analysis.points, strict=True):
        assert point.noise == approx(other.noise, rel=NEARLY, abs=0.0)
    # no study reads the drift of a shear at the screen level: it needs the slope of the map under shear
    for place in (0, -1):
        warm, exact = (each.sensing.analysis.warmed[place].temperature[0] for each in (screened, design))
        assert warm == approx(exact, rel=0.15)


def test_screen_performance_covers_a_strain_above_45_percent():
    design = Design(sitscad.load(TEMPLATES / "grasper_3p5mm.yaml"))
    screened = Design(design.spec, design.layout, estimate_layout(design.layout, tolerance=SCREENING))
    half, full = (abs(point.by_pose[:, 2]).min() for point in screened.sensing.analysis.points[1:])
    assert screened.sensing.analysis.points[2].pose[2] < -0.45 * design.spec.elastomer.thickness and full > half > 0.0


FIGURES = {
    "normal_resolution": lambda point, axis: point.axes[axis].resolution,
    "tilt_error": lambda point, axis: max(point.tilt_error[axis].values()),
    "zero_drift": lambda point, axis: point.axes[axis].errors["zero drift, 10 K"],
    "drift": lambda point, axis: point.axes[axis].errors["drift at full load, 10 K"],
    "hysteresis": lambda point, axis: point.axes[axis].errors["hysteresis"],
}


@pytest.mark.slow
def test_rules_and_data_sheet_have_equal_values():
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    request = replace(spec.requirements, normal_resolution=1.0, tilt=0.02, tilt_error=100.0)
    design = Design(replace(spec, requirements=request))
    reached = {item.requirement: item for item in apply_rules(design, "none").reached}
    for requirement, of in FIGURES.items():
        item = reached[requirement]
        point = design.performance[POINTS.index(item.at.split(",")[0])]
        assert item.measured == approx(of(point, item.axis), rel=1e-12, abs=0.0), requirement


def test_unsolvable_large_target_leaves_resolution_not_checked(monkeypatch):
    from sitscad.estimates.states import solved_target

    monkeypatch.setattr(solved_target, "MOST", 1.0)
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    design = Design(replace(spec, requirements=replace(spec.requirements, normal_resolution=1e-6)))
    result = apply_rules(design, "none")
    assert not design.estimates.is_solved and design.sensing.analysis is None
    assert any("too large" in note for note in design.estimates.notes)
    assert any(item.rule == "SIT401" and item.case == "performance-unsolved" for item in result.not_checked)
    assert not any(item.rule == "SIT401" for item in result.findings)


def test_spec_without_target_has_no_sensing_analysis():
    design = Design(sitscad.load(TEMPLATES / "single_coil.yaml"))
    assert design.sensing.analysis is None and design.performance == ()


def test_performance_has_rest_frequencies_of_states():
    design = template_design("bench_7mm")
    rest = [coil.states["rest"].frequency for coil in design.estimates.coils]
    assert np.abs(design.sensing.analysis.bench.rest / rest - 1.0).max() < 1e-5
