"""The table of a sensor's response against the response itself, where nobody fitted it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import loaded_poses
from sitscad.estimates.response.table import response_table

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["bench_7mm", pytest.param("three_axis_triangle", marks=pytest.mark.slow),
                                  pytest.param("grasper_4layer", marks=pytest.mark.slow)])
def test_response_table_agrees_with_response_within_error(name):
    model = template_design(name).response
    table = response_table(model)
    assert table.error < 0.03 and table.document()["rotation"] == "held"
    generator = np.random.default_rng(7)
    low, high = table.through.low, table.through.high
    request = low + generator.random((30, 5)) * (high - low)
    request[:20, 3:] = 0.0
    poses = loaded_poses(model.spec, request[:, :3])[0]
    poses[:, 3:] += np.pad(request[:, 3:], ((0, 0), (0, 1)))
    frequency = model.on_pad(np.vstack([np.zeros(6), poses])).frequency
    text, travel = table(request)
    off = np.abs(text - frequency[1:]) / np.ptp(frequency, axis=0)
    assert off[:20].max() < 0.007 and off.max() < 0.04
    assert travel == approx(poses[:, :3], abs=0.02 * np.abs(poses[:, :3]).max())
    rest, still = table(np.zeros((1, 5)))
    assert rest[0] == approx(frequency[0], rel=1e-4) and still[0] == approx(np.zeros(3), abs=1e-6)


@pytest.mark.slow
def test_response_table_with_moments_uses_free_target():
    """Its target was kept level, where map and data sheet have it free to tilt, and no moment could be put on it."""
    model = Design(sitscad.load(TEMPLATES / "fingertip_cell.yaml")).response
    table = response_table(model)
    made = table.document()
    assert (made["rotation"], made["inputs"][3:]) == ("free", ["moment_x_Nm", "moment_y_Nm"])
    assert table.error < 0.02
    low, high = table.through.low, table.through.high
    request = low + np.random.default_rng(7).random((30, 5)) * (high - low)
    request[:8, 1:] = 0.0
    poses = loaded_poses(model.spec, request, np.zeros(len(request), dtype=bool))[0]
    frequency = model.on_pad(np.vstack([np.zeros(6), poses])).frequency
    text, travel = table(request)
    off = np.abs(text - frequency[1:]) / np.ptp(frequency, axis=0)
    assert off[:8].max() < 0.005 and off.max() < 0.02
    assert travel == approx(poses[:, :5], abs=0.02 * np.abs(poses[:, :5]).max())
