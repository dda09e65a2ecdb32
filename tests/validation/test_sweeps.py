"""No jump where a pose is swept through the response (interpolated), nor where a design is; in large by sweeps.py."""

from __future__ import annotations

import pytest
from sweeps import DESIGNS, POSES, TEMPLATE, by_design, by_pose, jumps

import sitscad
from sitscad import Design

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def design():
    return Design(sitscad.load(TEMPLATE))


@pytest.mark.parametrize("name", POSES)
def test_500_steps_of_a_pose_have_no_jump(design, name):
    of_change, of_error = jumps(*by_pose(design, name, 500))
    assert of_change < 3e-4 and of_error < 0.05


@pytest.mark.parametrize("name", DESIGNS)
def test_neighbouring_designs_read_alike(name):
    of_change, of_error = jumps(*by_design(name, 4, span=0.01))
    assert of_change < 3e-4 and of_error < 0.05
