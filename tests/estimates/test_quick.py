"""The method of the checks against the response itself, on sensors of one, two and three coils."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.estimates.performance import quick
from sitscad.estimates.performance.points import feel
from sitscad.estimates.performance.quick import resting_tanks

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.fixture(scope="module", params=["bench_7mm", pytest.param("grasper_4layer", marks=pytest.mark.slow),
                                        pytest.param("three_axis_triangle", marks=pytest.mark.slow),
                                        pytest.param("fingertip_foil", marks=pytest.mark.slow)])
def both(request):
    design = Design(sitscad.load(TEMPLATES / f"{request.param}.yaml"))
    return feel(design.layout, design.estimates), design.performance


def test_resolutions_are_within_three_per_cent(both):
    quick, whole = both
    for point, other in zip(quick.points, whole, strict=True):
        assert point.noise == approx([axis.resolution for axis in other.axes.values()], rel=0.03)


def test_slopes_by_tilt_are_within_a_quarter_of_the_largest(both):
    quick, whole = both
    for point, other in zip(quick.points, whole, strict=True):
        tilts = np.array([list(row.values()) for row in other.tilt_slope.values()])[:, :2]
        assert point.tilts[:, :2] == approx(tilts, abs=0.25 * np.abs(tilts).max() + 0.02)


def test_errors_by_a_degree_of_tilt_are_within_four_per_cent_of_the_largest(both):
    """A coil alone has them too: at second order, of which slopes know nothing."""
    quick, whole = both
    for point, other in zip(quick.points, whole, strict=True):
        errors = np.array([list(row.values()) for row in other.tilt_error.values()])
        assert point.tilt_errors(other.tilt) == approx(errors, abs=0.04 * errors.max())


@pytest.fixture(scope="module")
def pressed_far():
    """A design whose pad full load presses by 47 %: nearly as far as its chart goes."""
    return Design(sitscad.load(TEMPLATES / "grasper_3p5mm.yaml"))


def test_a_pad_is_felt_where_full_load_presses_it(pressed_far):
    points = pressed_far.felt.points
    half, full = (abs(point.by_pose[:, 2]).min() for point in points[1:])
    assert points[2].pose[2] < -0.45 * pressed_far.spec.elastomer.thickness and full > half > 0.0


def test_its_chart_is_as_good_as_a_finer_one(pressed_far, monkeypatch):
    """Six places, none of them over the middle, and five heights made resolutions 6 % finer than they are."""
    usual = pressed_far.felt.points
    monkeypatch.setattr(quick, "PLACES", 11)
    monkeypatch.setattr(quick, "HEIGHTS", 9)
    finer = feel(pressed_far.layout, pressed_far.estimates)
    for point, other in zip(usual, finer.points, strict=True):
        assert point.noise == approx(other.noise, rel=0.03, abs=0.0)


@pytest.mark.slow
@pytest.mark.more
def test_its_resolution_is_within_a_tenth_of_the_response(pressed_far):
    for point, other in zip(pressed_far.felt.points, pressed_far.performance, strict=True):
        assert point.noise == approx([axis.resolution for axis in other.axes.values()], rel=0.1)


STEEL = """
sitscad: 1
name: steel
coil: {shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
target: {shape: square, size: 3, thickness: 0.3, material: stainless-17-4ph}
elastomer: {shape: square, size: 6, thickness: 1.0, material: ecoflex-00-50}
requirements: {normal_force: 2 N}
"""


@pytest.fixture(scope="module")
def steel():
    return Design(sitscad.load_text(STEEL))


def test_loss_in_magnetic_steel_pulls_the_tank_too(steel):
    """By inductance alone the noise in newtons was 18, 72 and 117 % off, and a tilt's errors by half."""
    quick = feel(steel.layout, steel.estimates)
    for point, other in zip(quick.points, steel.performance, strict=True):  # 30 um of copper: the steel has more of R
        assert point.noise == approx([axis.resolution for axis in other.axes.values()], rel=0.03)
        errors = np.array([list(row.values()) for row in other.tilt_error.values()])
        assert point.tilt_errors(other.tilt) == approx(errors, abs=0.03 * errors.max())


def test_the_tanks_are_those_of_the_states(steel):
    tanks, coil = resting_tanks(steel.spec.readout, steel.estimates), steel.estimates.coils[0]
    rest, pressed = coil.states["rest"], coil.states["pressed"]
    lost = (pressed.resistance - rest.resistance) / (2.0 * np.pi * rest.frequency)
    said = tanks.logarithms(np.array([complex(pressed.inductance - rest.inductance, -lost)]))[0]
    assert said == approx(np.log(pressed.frequency / rest.frequency), rel=1e-3)
    assert np.abs(tanks.logarithms(np.zeros((3, 1), dtype=complex))).max() < 1e-12


def test_temperature_is_within_a_tenth(both):
    quick, whole = both
    assert quick.warmed[-1].temperature == approx(list(whole[-1].temperature_error.values()), rel=0.1)


def test_without_target_there_is_nothing_to_feel():
    design = Design(sitscad.load(TEMPLATES / "single_coil.yaml"))
    assert design.felt is None and design.performance == ()
