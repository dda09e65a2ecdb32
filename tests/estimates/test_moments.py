"""Moments as axes of what is asked for: which arrays tell them, what is felt of them, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from one_rule import findings_of
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad.assembly.places.motions import MotionError, read_motions
from sitscad.calibration.bench_data import BenchError
from sitscad.checks.judging import check
from sitscad.estimates.loads.pad import loaded_poses, soft_pad, tilt_stiffness
from sitscad.estimates.loads.working_range import measured_axes, required_range, working_range
from sitscad.estimates.requested_response import respond
from sitscad.spec import templates

CELL = templates.read("fingertip_cell")

SMALL = """
sitscad: 1
name: small
coil: {{shape: circle, outer_diameter: 5, turns: 5, layers: 2, trace_width: 0.16, trace_spacing: 0.16}}
array: {array}
fpc: {{stackup: flex-2l-24um}}
target: {{shape: circle, size: 10, material: copper, thickness: 0.2}}
elastomer: {{shape: circle, size: 10, thickness: 1.5, material: dragon-skin-10}}
requirements: {{normal_force: 6 N{more}}}
"""

ARRAYS = {
    "one": "{pattern: single}",
    "along x": "{pattern: line, count: 2, pitch: 6}",
    "along y": "{pattern: explicit, centres: [[0, -3], [0, 3]]}",
    "triangle": "{pattern: triangle, pitch: 6}",
    "grid": "{pattern: grid, count: [2, 2], pitch: 6}",
}
BOTH = ", moment_x: 3 N mm, moment_y: 2 N mm"


def spec_of(array, more=BOTH):
    return sitscad.load_text(SMALL.format(array=ARRAYS[array], more=more), "small.yaml")


@pytest.fixture(scope="module")
def cell():
    return template_design("fingertip_cell")


@pytest.mark.parametrize(
    "array, axes",
    [
        ("one", ("normal",)),
        ("along x", ("normal", "moment_y")),
        ("along y", ("normal", "moment_x")),
        ("triangle", ("normal", "moment_x", "moment_y")),
        ("grid", ("normal", "moment_x", "moment_y")),
    ],
)
def test_array_measures_moments_only_about_axes_with_separated_coils(array, axes):
    spec = spec_of(array)
    assert measured_axes(spec.cell_placements[0], spec.requirements) == axes
    untold = {"moment_x", "moment_y"} - set(axes)
    keys = {result.key for result in findings_of("SIT411", spec)}
    assert keys == {f"requirements.{name}" for name in untold}


def test_single_required_moment_leaves_other_axis_as_shear():
    spec = spec_of("grid", ", moment_x: 3 N mm")
    assert measured_axes(spec.cell_placements[0], spec.requirements) == ("normal", "shear_x", "moment_x")
    assert required_range(spec).moments == (3e-3, 0.0)


def test_spec_without_moments_measures_forces_only():
    result = required_range(spec_of("grid", ""))
    assert (result.axes, result.width, result.has_moments) == (("normal", "shear_x", "shear_y"), 3, False)
    assert result.corners.shape == (18, 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "more, rule, key",
    [
        (BOTH + ", shear_resolution: 5 mN", "SIT411", "requirements.moment_x"),
        (BOTH + ", shear_resolution: 5 mN", "SIT402", "requirements.shear_resolution"),
        (BOTH + ", friction_error: 0.1", "SIT405", "requirements.friction_error"),
        (", moment_resolution: 0.01 N mm", "SIT411", "requirements.moment_resolution"),
        (", tilt: 1 deg, tilt_error: {moment_x: 1 N mm}", "SIT411", "requirements.tilt_error.moment_x"),
        (BOTH + ", moment_resolution: 0.1 mN mm", "SIT412", "requirements.moment_resolution"),
    ],
)
def test_requirement_that_contradicts_moments_gives_finding(more, rule, key):
    assert key in {item.key for item in findings_of(rule, spec_of("grid", more))}


@pytest.mark.parametrize(("moment", "severity"), [("4.5 N mm", None), ("6 N mm", "warning"), ("1000 N m", "error")])
def test_moment_beyond_pad_limit_gives_warning_or_error(moment, severity):
    """The template's pad bears 5.1 N mm; 1000 N m passed `check`, and its data sheet could not be written."""
    text = CELL.replace("moment_x: 4 N mm", f"moment_x: {moment}")
    assert text.count(moment) == 1
    places = [(item.key, str(item.severity)) for item in findings_of("SIT413", sitscad.load_text(text))]
    assert places == [("requirements.moment_x", severity)] * bool(severity)


def test_moment_without_target_is_not_checked():
    text = SMALL.format(array=ARRAYS["grid"], more=BOTH)
    bare = "".join(line for line in text.splitlines(True) if not line.startswith(("target", "elastomer")))
    untold = {item.rule for item in check(sitscad.load_text(bare), hints="none").not_checked}
    assert {"SIT411", "SIT413"} <= untold


def test_moment_calibration_with_held_rotation_gives_bench_error(cell):
    with pytest.raises(BenchError, match="rotation held"):
        sitscad.calibrate(cell, rotation="held")


@pytest.mark.slow
def test_tilt_error_is_checked_only_for_required_axes():
    """A value for all judged shear of sensors that are asked for the normal force alone."""
    many = ", tilt: 1 deg, tilt_error: 60 mN"
    assert findings_of("SIT404", spec_of("grid", many)) == []
    sheared = check(spec_of("grid", many + ", shear_force: 1 N"), hints="none")
    assert "SIT404" in {item.rule for item in sheared.findings}
    (judged,) = (item for item in sheared.reached if item.rule == "SIT404")
    assert (judged.axis.split()[0], judged.limit) == ("shear", 0.06)


@pytest.mark.slow
def test_tilt_error_by_axis_uses_limit_of_each_axis():
    own = ", shear_force: 1 N, tilt: 1 deg, tilt_error: {normal: 60 mN, shear_x: 2 N}"
    findings = check(spec_of("grid", own), hints="none")
    assert "SIT404" not in {item.rule for item in findings.findings}
    (judged,) = (item for item in findings.reached if item.rule == "SIT404")
    assert judged.limit in (0.06, 2.0)


def test_offset_force_tilts_like_equivalent_moment():
    spec = sitscad.load_text(CELL)
    pad, force, (x, y) = soft_pad(spec), 4.0, (2e-4, -1e-4)
    beside = pad.pose(np.array([[force, 0.0, 0.0]]), at=np.array([[x, y]]))
    turned = loaded_poses(spec, np.array([[force, 0.0, 0.0, -y * force, x * force]]), np.array([False]))[0]
    assert np.abs(turned - beside)[0, 3:5].max() < 2e-3 * np.abs(beside)[0, 3:5].max()


@pytest.mark.slow
def test_moment_is_refused_for_held_target_and_tilts_free_target():
    spec = sitscad.load_text(CELL)
    with pytest.raises(ValueError, match="rotation free"):
        respond(spec, loads=[[4.0, 0.0, 0.0, 1e-3, 0.0]], rotation="held")
    with pytest.raises(MotionError):
        read_motions(loads=("normal=4,moment_x=1,rotation=held",))
    loads = read_motions(loads=("normal=4,moment_x=1", "moment_y=2 N mm")).loads
    assert loads == approx(np.array([[4.0, 0.0, 0.0, 1e-3, 0.0], [0.0, 0.0, 0.0, 0.0, 2e-3]]), rel=1e-12)
    assert read_motions(loads=("normal=4",)).loads.shape == (1, 3)
    pose = loaded_poses(spec, loads, np.zeros(2, dtype=bool))[0]
    assert pose[0, 3] > 0.0
    assert pose[1, 4] > 0.0
    assert pose[0, 3] == approx(1e-3 / tilt_stiffness(soft_pad(spec), loads[:1] * [1, 0, 0, 0, 0])[0, 0], rel=0.01)


@pytest.mark.slow
def test_moment_noise_has_expected_size_in_newton_metres(cell):
    felt = cell.sensing.analysis
    assert felt.bench.range.axes == ("normal", "moment_x", "moment_y")
    full = felt.points[-1]
    # the map reads the loads of its own range back, and each axis alone
    assert np.all(felt.working.map_errors < 0.003 * felt.bench.range.full_scales)
    noise = full.noise
    assert 1e-6 < noise[1] < 2e-5
    assert noise[1] == approx(noise[2], rel=1e-3)  # the cell is square
    # what stands beside the middle is a moment, not an error: of the normal force alone it was one before
    assert np.abs(full.contact_errors[1:]).max() < 0.02 * 1e-3 * full.load[0]


def test_moment_to_force_ratio_gives_contact_position(cell):
    """6 N, 0.4 mm along x and -0.3 mm along y beside the middle: read by the map, after nothing but a tare."""
    felt, force, (x, y) = cell.sensing.analysis, 6.0, (4e-4, -3e-4)
    pose = felt.bench.pad.pose(np.array([[force, 0.0, 0.0]]), at=np.array([[x, y]]))
    normal, about_x, about_y = felt.working.map(felt.bench.readings(pose))[0]
    assert normal == approx(force, rel=0.01)
    assert (about_y / normal, -about_x / normal) == approx((x, y), rel=0.02)


def test_working_range_includes_moment_loads():
    result = working_range(sitscad.load_text(CELL))
    assert result.width == 5
    assert result.evenly_spread_loads(50).shape == (50, 5)
    assert not result.evenly_spread_loads(50)[:, 1:3].any()
    assert np.all(np.hypot(*(result.evenly_spread_loads(50)[:, 3:] / 4e-3).T) <= 1.0 + 1e-12)
    assert np.all(np.abs(result.edge_loads[:, 3:]) <= 4e-3 + 1e-12)
    assert len(result.notes) >= 2


@pytest.mark.slow
def test_performance_document_has_moment_units_and_tilt_stiffness(cell):
    points = cell.performance
    assert [point.at for point in points] == ["rest", "half", "full"]
    document = points[-1].document()
    assert {"range_Nm", "full_scale_Nm", "resolution_Nm", "errors_Nm"} <= set(document["axes"]["moment_x"])
    assert "range_N" not in document["axes"]["moment_x"]
    assert set(document["tilt_error_N"]) == {"normal"}
    assert set(document["tilt_error_Nm"]) == {"moment_x", "moment_y"}
    assert document["axes"]["moment_x"]["full_scale_Nm"] == 4e-3
    stiffness, error = (document[f"tilt_stiffness_{name}"]["rx"] for name in ("Nm_per_rad", "error"))
    assert 0.05 < stiffness < 0.2
    assert 0.02 < error < 0.2
    for felt, point in zip(cell.sensing.analysis.points, points, strict=True):
        for k, name in enumerate(("moment_x", "moment_y"), start=1):
            assert felt.noise[k] == approx(point.axes[name].resolution, rel=1e-12, abs=0.0)


@pytest.mark.more
@pytest.mark.slow
def test_calibrated_unit_reads_moments_within_two_percent(cell, tmp_path):
    """Eight presses beside the middle, of a sensor off by its own errors, read through the bench's table."""
    from sitscad.calibration.calibration import simulated_sensors
    from sitscad.calibration.unknowns import draw_units
    from sitscad.files.report.calibration import plan_csv

    planned = sitscad.calibrate(cell)
    sensors = simulated_sensors(cell.response)
    assert not sensors.is_held
    errors = 0.7 * draw_units(sensors.unknowns, 1, 3)[0]
    head, names, *rows = plan_csv(planned, planned.plan).decode().splitlines()
    assert head == "# rotation: free"
    assert names.startswith("normal_N,moment_x_Nmm,moment_y_Nmm,C1_counts")
    frequency = sensors.frequencies_under(errors, planned.plan.rows, exact=True)
    counts = sensors.conversion.counts(frequency)
    lines = [",".join([*row.split(",")[:3], *(f"{one:.1f}" for one in read)])
             for row, read in zip(rows, counts, strict=True)]
    table = tmp_path / "measured.csv"
    table.write_text("\n".join([head, names, *lines]) + "\n", encoding="utf-8")
    result = sitscad.calibrate(cell, table)
    loads = sensors.range.evenly_spread_loads(20, 900)
    rest, *read = sensors.conversion.counts(sensors.frequencies_under(errors, np.vstack([np.zeros(5), loads]),
                                                                      exact=True))
    off = result.map(read, rest) - loads[:, [0, 3, 4]]
    before = planned.map(read, rest) - loads[:, [0, 3, 4]]
    rms, untold = (np.sqrt(np.mean(each**2, axis=0)) / sensors.range.full_scales for each in (off, before))
    assert np.all(rms < 0.02)
    assert np.all(rms < 0.5 * untold)
    document = result.document()
    assert set(document["error_N"]) == {"normal"}
    assert set(document["error_Nm"]) == {"moment_x", "moment_y"}
    assert document["map"]["units"] == ["N", "N m", "N m"]
    held = table.read_text(encoding="utf-8").replace("free", "held")
    table.write_text(held, encoding="utf-8")
    with pytest.raises(ValueError, match="held"):
        sitscad.calibrate(cell, table)
    with pytest.raises(MotionError):
        sitscad.calibrate(cell, rotation="held")


def test_tilt_stiffness_falls_under_normal_force():
    pad = soft_pad(spec_of("grid"))
    soft = replace(pad, thickness=4.0 * pad.thickness)
    level, pressed = tilt_stiffness(soft, np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]]))
    assert pressed[0] < 0.6 * level[0]
    assert math.isnan(tilt_stiffness(soft, np.array([[8.0, 0.0, 0.0]]))[0, 0])
