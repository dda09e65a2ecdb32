"""Up to where a sensor is calibrated: what is asked for, and what its pad's law says of that."""

from __future__ import annotations

import pytest

import sitscad
from sitscad.calibration.working_range import working_range
from sitscad.estimates.performance.bench import shear_per_strain

SENSOR = """
sitscad: 1
name: pair
coil: {{shape: circle, outer_diameter: 8, turns: 8, layers: 2, trace_width: 150 um, trace_spacing: 150 um}}
array: {{pattern: line, count: 2, pitch: 8.5}}
target: {{shape: rectangle, size: [9, 8], thickness: 0.2, material: copper}}
elastomer: {{shape: rectangle, size: [9, 8], thickness: 1, material: ecoflex-00-50}}
requirements: {{normal_force: 8 N{asked}}}
"""


@pytest.mark.parametrize(
    ("asked", "travel", "notes"),
    [(None, 0.5, 0), (0.4, 0.4, 0), (0.9, 0.9, 1), (1.4, 1.0, 2)],
    ids=["not asked", "within", "beyond half the thickness", "beyond the thickness"],
)
def test_shear_is_calibrated_as_far_as_it_is_asked_for_and_can_be_trusted(asked, travel, notes):
    plain = sitscad.load_text(SENSOR.format(asked=""), "pair.yaml")
    across = shear_per_strain(plain)
    words = "" if asked is None else f", shear_force: {asked * across:.6g} N"
    found = working_range(sitscad.load_text(SENSOR.format(asked=words), "pair.yaml"))
    assert found.shear == pytest.approx(travel * across, rel=1e-5)
    assert len(found.notes) == notes
