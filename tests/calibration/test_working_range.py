"""Up to where a sensor is calibrated: what is asked for, and what its pad's law says of that."""

from __future__ import annotations

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.estimates.loads.pad import loaded_poses
from sitscad.estimates.loads.working_range import full_normal_force, shear_for_travel, working_range
from sitscad.spec import templates

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
def test_calibrated_shear_range_is_required_force_limited_by_travel(asked, travel, notes):
    plain = sitscad.load_text(SENSOR.format(asked=""), "pair.yaml")
    words = "" if asked is None else f", shear_force: {shear_for_travel(plain, asked):.9g} N"
    result = working_range(sitscad.load_text(SENSOR.format(asked=words), "pair.yaml"))
    assert result.shear == approx(shear_for_travel(plain, travel), rel=1e-5)
    assert len(result.notes) == notes


@pytest.mark.parametrize("name", ["grasper_3p5mm", "three_axis_triangle", "bench_7mm", "jaw_5x20"])
@pytest.mark.parametrize("travel", [0.5, 1.0])
def test_shear_for_travel_moves_pad_by_half_its_thickness(name, travel):
    """It was G A of it: film, rim, exponent and press left out, three times too little with a film of PDMS."""
    spec = sitscad.load_text(templates.read(name), name)
    force, normal = shear_for_travel(spec, travel), full_normal_force(spec)
    loads = np.array([[n, x, y] for n in (0.0, normal) for x, y in ((force, 0.0), (0.0, force))])
    poses = loaded_poses(spec, loads, np.ones(4, dtype=bool))[0]
    moved = np.hypot(poses[:, 0], poses[:, 1]) / spec.elastomer.thickness
    assert moved.max() == approx(travel, rel=0.005)


def test_shear_range_of_tall_pad_is_limited_at_half_normal_force():
    """Under 1 N with half of the normal force the pad went 2.7 times its thickness, and under neither end of it."""
    spec = sitscad.load_text(templates.read("grasper_3p5mm"), "grasper_3p5mm.yaml")
    result = working_range(spec)
    assert result.shear < 0.5 < spec.requirements.shear_force and "the pad's thickness" in " ".join(result.notes)
    loads = np.array([[share * result.normal, result.shear, 0.0] for share in (0.0, 0.5, 1.0)])
    assert np.abs(loaded_poses(spec, loads)[0][:, 0]).max() < 1.01 * spec.elastomer.thickness


def test_opposite_jaw_note_exists_only_for_sensors_in_jaw():
    """No figure counts its metal, and a unit that was calibrated with the jaw open never sees it."""
    from sitscad.estimates.loads.working_range import OTHER_JAW

    for name in ("grasper_4layer", "bench_7mm"):
        spec = sitscad.load_text(templates.read(name), "t.yaml")
        assert (OTHER_JAW in working_range(spec).notes) == (spec.jaw is not None) == (name == "grasper_4layer")
