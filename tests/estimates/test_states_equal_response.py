"""States with a target have the numbers of the response at their poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad import Design

FOLDER = Path(__file__).parents[2] / "templates"
QUICK = ("bench_7mm", "fingertip_foil", "grasper_4layer")
TEMPLATES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
FIGURES = ("inductance", "resistance", "frequency", "parallel_resistance")


@pytest.mark.few(4)
@pytest.mark.parametrize("name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow)
                                  for name in TEMPLATES if name != "single_coil"])
def test_states_of_templates_equal_response_at_their_poses(name):
    """Beside poses that another solution of the target answers. A cell's response leaves the idle coils of other cells
    out.
    """
    sensor = Design(sitscad.load(FOLDER / f"{name}.yaml"))
    design, within = (sensor, 1e-9) if sensor.spec.cells is None else (sensor.cells.by_number(2), 1e-3)
    estimates = design.estimates
    assert estimates.is_solved
    states = [state for state in estimates.states if state.pose is not None]
    poses = np.zeros((len(states) + 1, 6))
    poses[1:, 2] = [state.pose.z for state in states]
    poses[0] = [15e-3, 0.0, 0.0, 0.01, 0.0, 0.0]
    result = design.response.respond(poses)
    for row, state in enumerate(states, start=1):
        for k, coil in enumerate(estimates.coils):
            for figure in FIGURES:
                text = getattr(coil.states[state.name], figure)
                assert text == approx(getattr(result, figure)[row, k], rel=within, abs=0.0), (state.name, figure)
    assert len(design.response.solved) == 2, "the last pose is not answered by the states' solution"
