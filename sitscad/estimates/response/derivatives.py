"""How the frequencies change with the six numbers of a pose and with the load, by central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import pushed
from sitscad.estimates.response.values import Response

Array = NDArray[np.float64]

STEPS = np.array([5e-6, 5e-6, 5e-6, 5e-4, 5e-4, 5e-4])
"""Steps (m, rad) of the differences: a thousandth of what matters, far above rounding."""

LOAD_STEP = 2e-3
"""Step (N) of the load's."""


def with_derivatives(model: ResponseModel, response: Response) -> Response:
    """The response with `by_pose` and `by_load`: the latter NaN where the pad's formulas do not know the load that
    holds the pose, and None without a pad.
    """
    by_pose = slopes(model, response.poses)
    by_load = None
    if response.force is not None:
        loads = response.force[:, [2, 0, 1]] * [-1.0, 1.0, 1.0]
        by_load = np.einsum("ncp,npl->ncl", by_pose, compliance(model, loads))
    return replace(response, by_pose=by_pose, by_load=by_load)


def slopes(model: ResponseModel, poses: Array) -> Array:
    """Change of every coil's frequency (Hz) with every number of the pose (per m and rad): (poses, coils, 6)."""
    moves = np.concatenate([np.diag(STEPS), -np.diag(STEPS)])
    stacked = (poses[:, None, :] + moves).reshape(-1, 6)
    found = model.respond(stacked).frequency.reshape(len(poses), 2, 6, -1)
    return np.asarray(np.swapaxes((found[:, 0] - found[:, 1]) / (2.0 * STEPS[:, None]), 1, 2))


def compliance(model: ResponseModel, loads: Array) -> Array:
    """Change of the pose (m, rad) with the load (N), (loads, 6, 3); NaN for loads that are not known."""
    found = np.full((len(loads), 6, 3), np.nan)
    known = np.all(np.isfinite(loads), axis=1)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = LOAD_STEP
        down = np.maximum(loads[known] - step, [0.0, -np.inf, -np.inf])
        up = loads[known] + step
        span = (up - down)[:, axis]
        found[known, :, axis] = (pushed(model.spec, up) - pushed(model.spec, down)) / span[:, None]
    return found
