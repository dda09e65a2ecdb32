"""Metal behind the board that is neither jaw nor finger: what a jaw of the same sheet does, in every number."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.apps.study.evaluating import can_screen
from sitscad.assembly.places.bodies import backing_of
from sitscad.estimates.design import Design
from sitscad.estimates.targets.assembly import metal_behind, spec_at_temperature
from sitscad.estimates.tolerances.scatter import HEIGHT, METAL, MOVED, scatter_by_cause

TEXT = """
sitscad: 1
name: over-metal
coil: {{shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 0.12, trace_spacing: 0.12}}
fpc: {{stackup: flex-2l-24um, tail: {{length: 40}}}}
target: {{size: 6, shape: circle, material: copper, thickness: 0.2}}
elastomer: {{size: 6.5, shape: circle, thickness: 1.2}}
mount: {mount}
assembly: {{glue_line: 0.04, tolerances: {{mount: 0.08, jaw: 0.05, metal_behind: 0.05{more}}}}}
requirements: {{normal_force: 3 N, shear_force: 1 N}}
"""

JAW = ("{kind: grasper-pad, standoff: 1, jaw: {name: plate, width: 40, length: 40, height: 0.3, port_diameter: 60, "
       "material: aluminium}}")
SHEET = "metal_behind: {material: aluminium, distance: 1.04, thickness: 0.3}"
KINDS = ("custom", "bench-plate", "fingertip")


def design(mount, more=", metal_distance: 0.08"):
    """The sensor on a mount; `more` are tolerances."""
    return Design(sitscad.load_text(TEXT.format(mount=mount, more=more), "over_metal.yaml"))


def over(kind="custom", sheet=SHEET, **words):
    """The sensor on a mount of a kind; the sheet lies a glue line deeper than the face of a jaw, which is glued on."""
    standoff = "" if "standoff" in sheet else "standoff: 1, "
    return design(f"{{kind: {kind}, {standoff}{sheet}}}", **words)


@pytest.fixture(scope="module")
def in_jaw():
    return design(JAW, more="")


@pytest.mark.parametrize("kind", KINDS)
def test_metal_behind_any_mount_equals_jaw_of_same_sheet(kind, in_jaw):
    result, jaw = metal_behind(over(kind).spec), metal_behind(in_jaw.spec)
    assert result.distance == approx(jaw.distance, rel=1e-12)
    assert result.plates == jaw.plates
    assert backing_of(over(kind).spec).room == approx(backing_of(in_jaw.spec).room, rel=1e-12)


def test_metal_behind_gives_state_values_of_same_jaw(in_jaw):
    result, jaw = over().estimates.coils[0], in_jaw.estimates.coils[0]
    assert set(result.states) == set(jaw.states) == {"free", "rest", "pressed"}
    for name, state in jaw.states.items():
        for figure in ("inductance", "resistance", "parallel_resistance", "frequency", "quality_factor"):
            assert getattr(result.states[name], figure) == approx(getattr(state, figure), rel=1e-9), (name, figure)
    rest = jaw.states["rest"], jaw.states["free"]
    assert rest[0].inductance < 0.97 * rest[1].inductance, "the sheet is seen"


def test_metal_behind_gives_response_of_same_jaw(in_jaw):
    poses = np.array([[0.0, 0.0, -2e-4, 0.0, 0.0, 0.0], [3e-4, 1e-4, -1e-4, 0.01, 0.0, 0.0]])
    result, jaw = (item.response.respond(poses) for item in (over(), in_jaw))
    assert np.abs(result.frequency / jaw.frequency - 1.0).max() < 1e-9
    assert np.abs(result.inductance / jaw.inductance - 1.0).max() < 1e-9


def test_metal_distance_and_thickness_tolerances_scatter_states(in_jaw):
    loose = over(more=", metal_distance: 0.3")
    result = scatter_by_cause(loose.spec)
    glue = loose.spec.assembly.glue_tolerance
    assert result[HEIGHT].sigma == approx(math.hypot(0.3e-3, glue) / math.sqrt(3.0), rel=1e-9)
    assert result[METAL].sigma == approx(0.05e-3 / math.sqrt(3.0), rel=1e-9)
    assert METAL in scatter_by_cause(in_jaw.spec)
    tight = over().estimates.coils[0].states["rest"].spread
    wide = loose.estimates.coils[0].states["rest"].spread
    assert wide.inductance > 1.5 * tight.inductance
    assert abs(wide.shifts[HEIGHT][0]) > 3.0 * abs(tight.shifts[HEIGHT][0])


def test_default_tolerances_are_of_mount_and_rolled_sheet():
    text = TEXT.replace("jaw: 0.05, metal_behind: 0.05{more}", "jaw: 0.05{more}")
    spec = sitscad.load_text(text.format(mount=f"{{kind: bench-plate, standoff: 1, {SHEET}}}", more=""), "over.yaml")
    assert scatter_by_cause(spec)[HEIGHT].sigma == approx(
        math.hypot(0.1e-3, spec.assembly.glue_tolerance) / math.sqrt(3.0), rel=1e-9)  # resin
    assert scatter_by_cause(spec)[METAL].sigma == approx(22e-6 / math.sqrt(3.0), rel=1e-9)


@pytest.mark.parametrize("cause, face, thickness", [(HEIGHT, -1e-4, 0.0), (METAL, 0.0, 1e-4)])
def test_moved_unit_has_shifted_metal_face_or_thickness(cause, face, thickness):
    spec = over().spec
    unit = MOVED[cause](spec, 1e-4)
    assert backing_of(unit).metal_face - backing_of(spec).metal_face == approx(face, rel=1e-9, abs=1e-15)
    assert unit.mount.metal_thickness - spec.mount.metal_thickness == approx(thickness, rel=1e-9, abs=1e-15)


def test_warm_metal_has_lower_conductivity():
    spec = over().spec
    assert spec_at_temperature(spec, 60.0).metal.conductivity < 0.95 * spec.metal.conductivity


def test_shield_and_metal_behind_are_separated_by_air():
    sheet = "metal_behind: {material: brass, distance: 2, thickness: 0.5}"
    text = TEXT + "shield: {{material: copper, thickness: 0.1, gap: 0.6}}\n"
    spec = sitscad.load_text(text.format(mount=f"{{kind: custom, standoff: 1, {sheet}}}", more=""), "over.yaml")
    shield, air, metal = metal_behind(spec).plates
    assert (shield.thickness, metal.thickness) == (1e-4, 5e-4)
    # board, glue, spacer, glue, shield, glue, mount
    assert air.thickness == approx(2e-3 - 0.6e-3 - 0.1e-3 + 0.04e-3, rel=1e-6)
    assert not can_screen(spec), "shields without a jaw have no model on the screen level"
    assert can_screen(over().spec)


@pytest.mark.parametrize(
    "mount, key",
    [
        (f"{{kind: grasper-pad, {SHEET}}}", "mount.metal_behind"),
        (f"{{kind: fingertip, finger: {{material: brass}}, {SHEET}}}", "mount.metal_behind"),
        (f"{{kind: bench-plate, standoff: 1.2, {SHEET}}}", "mount.metal_behind.distance"),
    ],
)
def test_metal_behind_in_contradictory_mount_gives_spec_error(mount, key):
    with pytest.raises(sitscad.SpecError) as refused:
        design(mount)
    assert [(result.rule, result.key) for result in refused.value.findings] == [("SIT009", key)]


def test_default_standoff_equals_metal_distance():
    near = design("{kind: bench-plate, metal_behind: {material: aluminium, distance: 0.6, thickness: 1}}")
    assert near.spec.mount.standoff == 0.6e-3


def test_low_resistance_near_metal_gives_hint_of_larger_metal_distance():
    near = over(sheet="metal_behind: {material: titanium-grade-5, distance: 0, thickness: 1}, standoff: 0")
    findings = [item for item in sitscad.check(near.spec, hints="none").findings if item.rule in ("SIT201", "SIT203")]
    assert findings
    assert any("metal behind" in item.hint or "mount.metal_behind.distance" in item.hint for item in findings)
    assert not any("mount.standoff" in item.hint for item in findings), "that does not move this metal"
