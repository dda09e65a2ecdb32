"""Poses and loads as they are written."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.assembly.places.motions import FORCE, POSE, MotionError, frequency_of, read_motions


def test_bare_numbers_are_millimetres_degrees_and_newtons():
    result = read_motions(poses=["x=0.5,z=-200 um, rx=1,ry=0.1rad"], loads=["normal=4.8,shear_y=-300 mN,rotation=held"])
    assert result.poses[0] == approx([5e-4, 0.0, -2e-4, math.radians(1.0), 0.1, 0.0], rel=1e-6, abs=1e-12)
    assert result.loads[0] == approx([4.8, 0.0, -0.3], rel=1e-6, abs=1e-12)
    assert list(result.held) == [True]


def test_no_input_is_pose_at_rest():
    result = read_motions()
    assert np.array_equal(result.poses, np.zeros((1, 6)))
    assert len(result.loads) == 0


def test_scan_is_product_with_last_range_fastest():
    result = read_motions(scans=["x=-2:2:5,rz=90,z=-0.9:0:4", "normal=0:2:3,shear_x=0.5"])
    assert result.poses.shape == (20, 6)
    assert result.poses[1] - result.poses[0] == approx([0.0, 0.0, 3e-4, 0.0, 0.0, 0.0], rel=1e-6, abs=1e-12)
    assert result.poses[-1] == approx([2e-3, 0.0, 0.0, 0.0, 0.0, math.pi / 2], rel=1e-6, abs=1e-12)
    assert result.loads == approx(np.array([[0.0, 0.5, 0.0], [1.0, 0.5, 0.0], [2.0, 0.5, 0.0]]), rel=1e-6)


def test_motion_files_name_columns_and_units(tmp_path):
    poses, loads = tmp_path / "poses.csv", tmp_path / "loads.csv"
    poses.write_text("# scanned\nx,z_m,ry_deg\n1,-0.0002,2\n\n2,,\n")
    loads.write_text("normal_N,shear_x,rotation\n1,0.5,held\n2,0,\n")
    result = read_motions(pose_files=[str(poses)], load_files=[str(loads)])
    assert result.poses[0] == approx([1e-3, 0.0, -2e-4, 0.0, math.radians(2.0), 0.0], rel=1e-6, abs=1e-12)
    assert result.poses[1] == approx([2e-3, 0.0, 0.0, 0.0, 0.0, 0.0], rel=1e-6, abs=1e-12)
    assert list(result.held) == [True, False]


def test_reading_columns_are_skipped_and_reported(tmp_path):
    """The plan that `calibrate` writes is asked for as it is, empty or filled in."""
    plan, poses = tmp_path / "plan.csv", tmp_path / "poses.csv"
    plan.write_text("normal_N,shear_x_N,C1_counts,C2_counts\n0,0,,\n8,-1.15,8123456,7654321\n")
    poses.write_text("x,C1_MHz\n1,5.2\n")
    result = read_motions(load_files=[str(plan)], pose_files=[str(poses)])
    assert result.loads == approx(np.array([[0.0, 0.0, 0.0], [8.0, -1.15, 0.0]]), rel=1e-6) and len(result.poses) == 1
    assert result.skipped_rows == (
        f"{poses}: columns of readings are passed over: C1_MHz",
        f"{plan}: columns of readings are passed over: C1_counts, C2_counts",
    )
    assert read_motions(loads=["normal=1"]).skipped_rows == ()


@pytest.mark.parametrize("head", ["normal_N,C1", "normal_N,normal_counts", "normal_N,_counts", "normal_N,C1_V"])
def test_unknown_column_is_refused(tmp_path, head):
    (tmp_path / "loads.csv").write_text(f"{head}\n1,2\n")
    with pytest.raises(MotionError, match="is none of normal"):
        read_motions(load_files=[str(tmp_path / "loads.csv")])


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"poses": ["w=1"]}, "NAME one of x, y, z"),
        ({"poses": ["x"]}, "NAME=NUMBER"),
        ({"poses": ["x=1,x=2"]}, "twice"),
        ({"poses": ["x=inf"]}, "finite"),
        ({"poses": ["x=1 deg"]}, "unit of angle"),
        ({"poses": ["x=abc"]}, "abc"),
        ({"loads": ["normal=1,rotation=loose"]}, "held or free"),
        ({"scans": ["x=1:2"]}, "FIRST:LAST:COUNT"),
        ({"scans": ["x=1:2:0"]}, "a COUNT from 1 to 2000000 is wanted"),
        ({"scans": ["x=1:2:2000001"]}, "a COUNT from 1 to 2000000 is wanted"),
        ({"scans": ["x=1:2:" + "9" * 5000]}, "a COUNT from 1 to 2000000 is wanted"),
        ({"scans": ["x=1:2:3,normal=4"]}, "NAME one of"),
        ({"scans": ["x=0:1:2000,y=0:1:2000"]}, "4000000 points"),
        ({"scans": [""]}, "scans nothing"),
    ],
)
def test_unreadable_motion_error_states_allowed_form(asked, said):
    with pytest.raises(MotionError, match=said):
        read_motions(**asked)


@pytest.mark.parametrize(
    ("text", "said"),
    [("", "first line"), ("x,q\n1,2\n", "column 'q'"), ("x,x_m\n1,2\n", "each once"), ("x,y\n1\n", "row 2"),
     ("x_N\n1\n", "column 'x_N'"), ("x\nabc\n", "abc"), ("x_m\nnan\n", "finite")],
)
def test_unreadable_motion_file_error_states_row(tmp_path, text, said):
    path = tmp_path / "poses.csv"
    path.write_text(text)
    with pytest.raises(MotionError, match=said):
        read_motions(pose_files=[str(path)])


@given(st.text(alphabet="xyzr=,:.-+0123456789e mdN\n_alo", max_size=40), st.sampled_from(["poses", "loads", "scans"]))
def test_random_text_is_read_or_refused(text, kind):
    try:
        result = read_motions(**{kind: [text]})
    except MotionError:
        return
    assert np.all(np.isfinite(result.poses))
    assert result.poses.shape[1:] == (len(POSE),)
    assert result.loads.shape[1:] == (len(FORCE),)


def test_frequency_without_unit_is_refused():
    assert frequency_of("5MHz") == 5e6
    for text in ("5", "0 Hz", "-1 MHz", "5 GHz", "x"):
        with pytest.raises(MotionError):
            frequency_of(text)


def test_negative_force_and_endless_file_are_refused(tmp_path):
    with pytest.raises(MotionError, match="normal=-5: it presses"):
        read_motions(loads=["normal=-5"])
    with pytest.raises(MotionError, match="normal=-1"):
        read_motions(scans=["normal=-1:1:3"])
    with pytest.raises(MotionError, match="larger than"):
        read_motions(load_files=["/dev/zero"])


def test_carriage_return_lines_are_read_and_huge_cells_refused(tmp_path):
    """Both ended in a traceback of the csv module."""
    path = tmp_path / "loads.csv"
    path.write_bytes(b"normal_N,shear_x_N\r1,0.5\r2,0\r")
    assert read_motions(load_files=[str(path)]).loads[:, 0].tolist() == [1.0, 2.0]
    path.write_text("normal_N\n" + 200_000 * "1" + "\n")
    with pytest.raises(MotionError, match=r"loads.csv is no table that can be read"):
        read_motions(load_files=[str(path)])
