"""What a sensor feels, in newtons: laws that must hold of any."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import sitscad
from sitscad import Design
from sitscad.estimates.response.performance import AXES, axes_told_apart
from sitscad.readout import ldc161x

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.fixture(scope="module")
def bench():
    return Design(sitscad.load(TEMPLATES / "bench_7mm.yaml"))


def test_axes_are_those_that_the_array_tells_apart():
    found = {name: axes_told_apart(sitscad.load(TEMPLATES / f"{name}.yaml").array)
             for name in ("single_coil", "bench_7mm", "three_axis_triangle", "three_axis_grid")}  # fmt: skip
    assert found["single_coil"] == ("normal",)
    assert found["bench_7mm"] == ("normal", "shear_x")
    assert found["three_axis_triangle"] == found["three_axis_grid"] == AXES


def test_it_is_taken_at_rest_half_and_full_load(bench):
    found = bench.performance
    force = bench.spec.requirements.normal_force
    assert [(point.at, point.load[0]) for point in found] == [("rest", 0.0), ("half", force / 2), ("full", force)]


def test_resolution_is_the_converter_s_noise_through_the_map(bench):
    """Of two alike coils: normal force by their sum, shear by their difference, so noise falls by the root of two."""
    point, readout = bench.performance[1], bench.estimates.readout
    reading = bench.response.under(np.array([point.load]))
    noise = ldc161x.measured_noise(float(reading.frequency.mean()), readout.rcount)
    for axis in point.axes.values():
        by_hand = noise / math.sqrt(2.0) / np.mean(np.abs(axis.sensitivity))
        assert axis.resolution == pytest.approx(by_hand, rel=0.02)
        assert axis.errors["noise"] == axis.resolution


def test_sensitivity_is_the_slope_of_the_readings(bench):
    point = bench.performance[2]
    loads = np.array([[point.load[0] - 0.05, 0.0, 0.0], [point.load[0] + 0.05, 0.0, 0.0]])
    low, high = bench.response.under(loads).frequency
    assert point.axes["normal"].sensitivity == pytest.approx((high - low) / 0.1, rel=5e-3)
    one, other = point.axes["shear_x"].sensitivity
    assert one < 0.0 < other, "towards +x is towards the second coil"


def test_tilt_about_y_is_read_as_shear_along_x(bench):
    tilt = bench.performance[1].tilt_error
    assert abs(tilt["shear_x"]["ry"]) > 10.0 * abs(tilt["shear_x"]["rx"])
    assert tilt["shear_x"]["ry"] > 0.0, "the +x side comes nearer, as under a shear along +x"


def test_the_map_of_two_coils_can_be_inverted(bench):
    for point in bench.performance:
        assert point.invertible
        assert 1.0 <= point.condition_number < 10.0
        assert point.axes["normal"].limited_by == "strain"
        assert 0.0 < point.axes["normal"].nonlinearity < 0.1


def test_errors_grow_with_the_load_that_they_go_with(bench):
    rest, half, full = (point.axes["normal"].errors for point in bench.performance)
    for cause in ("modulus", "temperature per 10 K", "manufacture, before calibration"):
        assert rest[cause] == 0.0 < half[cause] < full[cause]
    assert bench.performance[0].friction_error is None
    assert 0.0 < bench.performance[2].friction_error < 1.0


def test_a_document_is_json(bench):
    document = json.loads(json.dumps([point.document() for point in bench.performance], allow_nan=False))
    assert {"at", "axes", "crosstalk", "tilt_error_N_per_rad", "temperature_error_N_per_K", "friction_error",
            "bandwidth_Hz", "condition_number", "invertible"} <= set(document[0])  # fmt: skip
    assert {"range_N", "limited_by", "sensitivity_Hz_per_N", "resolution_N", "nonlinearity"} <= set(
        document[0]["axes"]["normal"]
    )


def test_without_a_pad_or_a_target_there_is_nothing_to_feel():
    assert Design(sitscad.load(TEMPLATES / "single_coil.yaml")).performance == ()
