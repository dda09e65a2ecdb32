"""How the frequencies change with the six numbers of a pose and with the load, by central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import soft_pad
from sitscad.estimates.response.values import Response

Array = NDArray[np.float64]

STEPS = np.array([5e-6, 5e-6, 5e-6, 5e-4, 5e-4, 5e-4])
"""Steps (m, rad) of the differences: a thousandth of what matters, far above rounding."""


def with_derivatives(model: ResponseModel, response: Response) -> Response:
    """The response with `by_pose` and `by_load`, the target keeping its turn: the latter NaN where the pad is shut, and
    None without a pad.
    """
    by_pose = slopes(model, response.poses)
    by_load = None
    if response.force is not None:
        by_load = np.einsum("ncp,npl->ncl", by_pose, compliance(model, response.poses))
    return replace(response, by_pose=by_pose, by_load=by_load)


def slopes(model: ResponseModel, poses: Array) -> Array:
    """Change of every coil's frequency (Hz) with every number of the pose (per m and rad): (poses, coils, 6)."""
    moves = np.concatenate([np.diag(STEPS), -np.diag(STEPS)])
    stacked = (poses[:, None, :] + moves).reshape(-1, 6)
    found = model.respond(stacked).frequency.reshape(len(poses), 2, 6, -1)
    return np.asarray(np.swapaxes((found[:, 0] - found[:, 1]) / (2.0 * STEPS[:, None]), 1, 2))


def compliance(model: ResponseModel, poses: Array) -> Array:
    """Change of the pose (m, rad) with the load (N; normal, shear along x, along y) where the target keeps its turn:
    (poses, 6, 3), the inverse of the pad's stiffness there; NaN for a pad that is shut.
    """
    stiffness = soft_pad(model.spec).stiffness(poses)[:, :3, :3]
    found = np.zeros((len(poses), 6, 3))
    found[:, :3] = np.linalg.inv(stiffness)[:, :, [2, 0, 1]] * [-1.0, 1.0, 1.0]
    return found
