"""How the frequencies change with the six numbers of a pose and with the load, by central differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import soft_pad
from sitscad.estimates.response.values import Response
from sitscad.mechanics.pad import Pad

Array = NDArray[np.float64]

STEPS = np.array([5e-6, 5e-6, 5e-6, 5e-4, 5e-4, 5e-4])
"""Steps (m, rad) of the differences: a thousandth of what matters, far above rounding."""


def with_derivatives(model: ResponseModel, response: Response) -> Response:
    """The response with `by_pose` and `by_load`, the target keeping its turn: the latter NaN where the pad is shut, and
    None without a pad.
    """
    by_pose = slopes(lambda poses: model.respond(poses).frequency, response.poses)
    by_load = None
    if response.force is not None:
        by_load = np.einsum("ncp,npl->ncl", by_pose, compliance(soft_pad(model.spec), response.poses))
    return replace(response, by_pose=by_pose, by_load=by_load)


def slopes(read: Callable[[Array], Array], poses: Array) -> Array:
    """Change of what coils read (n, coils) at (n, 6) poses with every number of the pose (per m and rad): (poses,
    coils, 6).
    """
    moves = np.concatenate([np.diag(STEPS), -np.diag(STEPS)])
    found = read((poses[:, None, :] + moves).reshape(-1, 6)).reshape(len(poses), 2, 6, -1)
    return np.asarray(np.swapaxes((found[:, 0] - found[:, 1]) / (2.0 * STEPS[:, None]), 1, 2))


def compliance(pad: Pad, poses: Array) -> Array:
    """Change of the pose (m, rad) with the load (N; normal, shear along x, along y) where the target keeps its turn:
    (poses, 6, 3), the inverse of the pad's stiffness there; NaN for a pad that is shut.
    """
    found = np.zeros((len(poses), 6, 3))
    found[:, :3] = np.linalg.inv(pad.stiffness(poses)[:, :3, :3])[:, :, [2, 0, 1]] * [-1.0, 1.0, 1.0]
    return found
