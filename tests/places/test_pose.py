"""The target's motion: its turn is a rotation, and every sign is the one that is written down."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.assembly.places.state import REST_POSE, Pose

ANGLES = st.floats(-math.pi, math.pi)
LENGTHS = st.floats(-1e-2, 1e-2)


@given(ANGLES, ANGLES, ANGLES)
def test_pose_rotation_is_orthonormal(rx, ry, rz):
    rows = Pose(rx=rx, ry=ry, rz=rz).rotation
    for i in range(3):
        for j in range(3):
            assert math.fsum(rows[i][k] * rows[j][k] for k in range(3)) == approx(float(i == j), abs=1e-12)
    (a, b, c), (d, e, f), (g, h, i) = rows
    assert a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) == approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("pose", "point", "gone"),
    [
        (Pose(ry=0.1), (1e-3, 0.0, 0.0), (1e-3 * math.cos(0.1), 0.0, -1e-3 * math.sin(0.1))),
        (Pose(rx=0.1), (0.0, 1e-3, 0.0), (0.0, 1e-3 * math.cos(0.1), 1e-3 * math.sin(0.1))),
        (Pose(rz=0.1), (1e-3, 0.0, 0.0), (1e-3 * math.cos(0.1), 1e-3 * math.sin(0.1), 0.0)),
        (Pose(z=-2e-4), (1e-3, 0.0, 0.0), (1e-3, 0.0, -2e-4)),
    ],
)
def test_pose_signs_follow_board_axes(pose, point, gone):
    assert pose.moved_point(point, (0.0, 0.0, 0.0)) == approx(gone, abs=1e-15)


@given(LENGTHS, LENGTHS, LENGTHS, ANGLES, ANGLES, ANGLES)
def test_pose_rotates_about_near_face(x, y, z, rx, ry, rz):
    centre = (1e-3, -2e-3, 1.5e-3)
    gone = Pose(x, y, z, rx, ry, rz).moved_point(centre, centre)
    assert gone == approx((centre[0] + x, centre[1] + y, centre[2] + z), abs=1e-15)


def test_pose_rotations_apply_in_order():
    """R = Rx Ry Rz: a point is turned about z first."""
    half = math.pi / 2
    moved = Pose(rx=half, rz=half).moved_point((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert moved == approx((0.0, 0.0, 1.0), abs=1e-12)


def test_rest_pose_moves_nothing():
    assert REST_POSE.rx == REST_POSE.ry == 0.0
    assert REST_POSE.moved_point((1.0, 2.0, 3.0), (0.0, 0.0, 1.0)) == (1.0, 2.0, 3.0)
