"""The other jaw's metal in front of the target: what it takes of the coils, in henries and in newtons."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.basics.finding import Severity
from sitscad.basics.record import replace
from sitscad.checks.reading.metal import other_jaw_metal
from sitscad.estimates.design import Design
from sitscad.estimates.performance_values import OTHER_JAW_CAUSES, combined_error
from sitscad.estimates.states.other_jaw import GRASPED, estimate_other_jaw_changes, front_plate, other_jaw_changes
from sitscad.estimates.states.placed import TargetPoses, target_centre_at_rest
from sitscad.estimates.states.plate import make_target_plate
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.spec import templates
from sitscad.spec.load import load_text

DISC = """
sitscad: 1
name: disc
coil: {{shape: circle, outer_diameter: 3.95, turns: 8, layers: 4, trace_width: 80 um, trace_spacing: 80 um}}
fpc: {{stackup: flex-4l, rules: generic-fine, margin: [0.15, 0], tail: {{length: 30, connector: zif-0.5mm, layers: 2}}}}
target: {{shape: circle, size: {size}, thickness: 0.15, material: copper}}
elastomer: {{material: dragon-skin-10, shape: circle, size: {size}, thickness: 0.65}}
shield: {{material: copper, thickness: 0.1, gap: 0.5}}
mount: {{kind: grasper-pad, jaw: generic-5mm, standoff: 0.6}}
readout: {{device: ldc1614, capacitance: 220 pF, clock: 40 MHz}}
requirements: {{normal_force: 6 N}}
"""
FREQUENCY, GAP, BEHIND, STEEL = 6.4e6, 0.7e-3, 0.8e-3, 1.39e6
"""Frequency (Hz), gap of the disc and depth of a copper sheet 0.1 mm thick (m), conductivity of the front (S/m)."""


@cache
def discs(size):
    design = Design(load_text(DISC.format(size=1e3 * size)))
    return design, design.response.windings


def by_front(size, room):
    """Heights of the layers, change by the front and by the disc alone (H)."""
    design, wound = discs(size)
    spec, coils = wound.spec, design.layout.coils
    rest = target_centre_at_rest(spec)
    placed = TargetPoses.from_rest(spec.target, rest, np.array([[0.0, 0.0, GAP - rest[2], 0.0, 0.0, 0.0]]))
    cover = replace(placed.pose_range(spec.target, spec.coil, coils, spec.array.middle), lowest=GAP)
    behind = Reflector(BEHIND, (MetalLayer(5.8e7, 1.0, 0.1e-3),))
    result = []
    for front in (None, Reflector(GAP + 0.15e-3 + room, (MetalLayer(STEEL, 1.0, 1.3e-3),))):
        target = make_target_plate(spec.target, spec.coil, coils, (FREQUENCY,), behind, cover, front=front)
        change = target.changes(placed.turns, placed.places, True)[0][0, 0, 0, 0]
        bare = reflected_inductances(wound.winding.spectrum, np.array([FREQUENCY]), front, behind, (0.0,))[0, 0]
        result.append((float(change.real), float((change + bare).real)))
    return [winding.z for winding in coils[0].windings], result[1][1] - result[0][1], result[0][0]


@pytest.mark.parametrize(("size", "room", "exact"), [
    pytest.param(4.1e-3, 0.05e-3, -3.778e-9, marks=pytest.mark.slow), (2.8e-3, 2.05e-3, -1.260e-9),
])
def test_inductance_change_by_front_metal_agrees_with_finite_elements(size, room, exact):
    """`validation/front_of_elements.py` has them."""
    _, result, target = by_front(size, room)
    assert result == approx(exact, abs=0.02 * abs(exact) + 1e-4 * abs(target))


@pytest.mark.slow
def test_distant_front_metal_does_not_change_inductance():
    _, result, target = by_front(4.1e-3, 30e-3)
    assert abs(result) < 1e-5 * abs(target)


@pytest.fixture(scope="module")
def grasper():
    return Design(load_text(templates.read("grasper_4layer")))


@pytest.mark.slow
def test_other_jaw_error_falls_with_grasped_thickness(grasper):
    errors = [point.axes["normal"].errors for point in grasper.performance]
    at_rest_, _, full = [[each[cause] for cause in OTHER_JAW_CAUSES] for each in errors]
    assert at_rest_[0] == approx(8.8, rel=0.05) and at_rest_[1] == approx(1.24, rel=0.05)
    assert all(more > less > 0.0 for row in (at_rest_, full) for more, less in pairwise(row))
    assert combined_error(errors[-1]) < full[0]
    axis = grasper.performance[0].axes["shear_x"]
    assert axis.errors[OTHER_JAW_CAUSES[0]] < 1e-2


def test_estimated_other_jaw_change_agrees_with_solved_change(grasper):
    wound = grasper.response.windings
    solved = other_jaw_changes(wound, np.sqrt(np.prod(grasper.response.band)), [0.0], GRASPED[1:2])[0, 0]
    estimates = grasper.estimates
    about = estimate_other_jaw_changes(grasper.layout, estimates.coils, estimates.temperature, GRASPED[1])
    assert list(about.values()) == approx(solved, rel=0.25)


def test_pad_on_other_jaw_reduces_warning_to_note(grasper):
    padded = grasper.spec.replace({"mount.jaw": {"based_on": "generic-5mm", "opposing_pad_thickness": "1.5 mm"}})
    bare, less = (list(other_jaw_metal(item)) for item in (grasper, Design(padded)))
    assert [item.severity for item in bare] == [None] and bare[0].measured > bare[0].limit
    assert [item.severity for item in less] == [Severity.NOTE] and less[0].measured < less[0].limit


def test_mount_without_jaw_has_no_front_metal():
    assert front_plate(load_text(templates.read("fingertip_cell")).jaw) is None
    findings = sitscad.check(load_text(templates.read("single_coil")), hints="none").findings
    assert "SIT221" not in {f.rule for f in findings}
