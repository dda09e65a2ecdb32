"""The chart holds for every sensor that is not sorted out, soft and thin ones too."""

from __future__ import annotations

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.calibration.calibrate import sensors_of
from sitscad.calibration.unknowns import WIDEST

SENSOR = """
sitscad: 1
name: jaw12
coil: {shape: circle, outer_diameter: 8, turns: 8.5, layers: 2, trace_width: 152.4 um, trace_spacing: 152.4 um}
array: {pattern: line, count: 2, pitch: 8.5}
target: {shape: rectangle, size: [9, 8.4], thickness: 0.2, material: copper}
elastomer: {shape: rectangle, size: [9, 8.4], thickness: 1, material: ecoflex-00-50}
requirements: {normal_force: 8 N, shear_force: 2 N}
"""


@pytest.fixture(scope="module")
def sensors():
    return sensors_of(sitscad.Design(sitscad.load_text(SENSOR, "jaw12.yaml")).response)


@pytest.mark.parametrize("gap", [-WIDEST, -1.9, 0.0, WIDEST])
@pytest.mark.parametrize("modulus", [-1.0, 0.0])
def test_a_sensor_at_either_end_of_its_scatter_is_on_the_chart(sensors, gap, modulus):
    """The box was that of forty sensors at random: one of a gap 1.9 sigma thin read the same from 2 N to 8 N."""
    errors = np.array([{"gap": gap, "modulus": modulus}.get(one.name, 0.0) * one.sigma for one in sensors.known])
    loads = np.array([[force, 0.0, 0.0] for force in (0.0, 2.0, 4.0, 8.0)])
    poses = sensors.poses(errors, loads)
    charted, solved = (np.log(sensors.frequencies(errors, poses, exact)) for exact in (False, True))
    change = solved[1:] - solved[0]
    assert charted[1:] - charted[0] == approx(change, abs=0.015 * np.abs(change).max())
