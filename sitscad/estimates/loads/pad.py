"""Poses of the target under loads, and loads that hold poses, by the pad's law in `mechanics.pad`.

Only the part of the pad under the target counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitscad.assembly.places.bodies import film_thickness
from sitscad.basics.arrays import Array, Flags
from sitscad.estimates.loads.pressing import loaded_face, pad_surroundings, rests_on_pad
from sitscad.kernels.mechanics.elastomer import BARE
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.spec.sensor import SensorSpec

STEPS = np.array([5e-6, 5e-6, 5e-6, 5e-4, 5e-4, 5e-4])
"""Steps (x, y, z in m; rx, ry, rz in rad) of the pose in numerical derivatives.

They are a thousandth of the usual displacements, far above rounding errors.
"""


class NoResponse(ValueError):
    """Error for a design that cannot respond. Its text names the missing part."""


PAD_INSTABILITY = ("the pad gives way sideways under this load: no tilt holds it, and the pose is that of a target "
                   "held level")
"""Note for loads under which a target that is free to tilt has no equilibrium."""
TOO_SOFT = "the pad gives way sideways under this load even with the target held level: a straight estimate"
"""Note for loads under which even a level target has no equilibrium. The pose is a linear estimate."""


def soft_pad(spec: SensorSpec, modulus: float = 1.0) -> BondedPad:
    """Return the part of the pad under the target, with its surroundings. Loads act on the outermost face.

    The surroundings are the pad's rim and the film of an encapsulation, as in the states. If the rim differs from side
    to side, they are left out. `modulus` multiplies the shear modulus, for scatter. Raises NoResponse if no pad carries
    the target.
    """
    pad = spec.elastomer
    if pad is None or not rests_on_pad(spec):
        raise NoResponse("a load needs an elastomer under the target")
    above = film_thickness(spec.encapsulation) + (spec.target.thickness if spec.target is not None else 0.0)
    return BondedPad(loaded_face(spec)[0], pad.thickness, modulus * pad.material.shear_modulus,
                     pad.material.bulk_modulus, pad_surroundings(spec) or BARE, above, pad.material.ogden_exponent)


def loaded_poses(
    spec: SensorSpec, loads: Array, is_level: Flags | None = None, modulus: float = 1.0
) -> tuple[Array, tuple[str, ...]]:
    """Return poses (n, 6; m, rad) of the target under loads, and a note for each pose (usually empty).

    Loads are (n, 3; N): normal, towards the board, and shear along +x and +y. Or (n, 5), with moments about x and y (N
    m). `is_level` (n) is True for targets that are kept level against any moment; None means all. `modulus` multiplies
    the pad's modulus. Raises NoResponse if no pad carries the target, and ValueError for a pull.
    """
    pad = soft_pad(spec, modulus)
    loads = np.asarray(loads, dtype=float)
    loads = loads.reshape(-1, loads.shape[-1] if loads.ndim > 1 else 3)
    if not np.all(np.isfinite(loads)) or np.any(loads[:, 0] < 0.0):
        raise ValueError("a load is three finite forces in newtons, the normal one 0 or more (towards the board)")
    poses, notes = np.full((len(loads), 6), np.nan), np.full(len(loads), "", dtype=object)
    free = np.zeros(len(loads), dtype=bool) if is_level is None else ~is_level
    if free.any():
        poses[free] = pad.pose(loads[free])
    lost = np.isnan(poses[:, 0])
    notes[lost & free] = PAD_INSTABILITY
    if lost.any():
        poses[lost] = pad.pose(loads[lost], is_held=True)
    lost = np.isnan(poses[:, 0])
    notes[lost] = TOO_SOFT
    poses[lost] = linear_poses(pad, loads[lost])
    return poses, tuple(str(note) for note in notes)


def tilt_stiffness(pad: BondedPad, loads: Array) -> Array:
    """Return the tilt stiffness of the pad about x and y: (n, 2; N m/rad). NaN if the pad buckles.

    It is for a free target under loads (n, 3 or 5; N, N m), against a moment on its outermost face. It is computed by
    central differences of `BondedPad.pose`.
    """
    whole = np.zeros((len(loads), 5))
    whole[:, : np.shape(loads)[1]] = loads
    small = SMALL_TILT * pad.shear_modulus * pad.face.area * pad.thickness
    moved = np.zeros((4, 1, 5))
    moved[[0, 1], 0, 3], moved[[2, 3], 0, 4] = (small, -small), (small, -small)
    turns = pad.pose((whole + moved).reshape(-1, 5))[:, 3:5].reshape(2, 2, len(loads), 2)
    return np.stack([2.0 * small / (turns[k, 0, :, k] - turns[k, 1, :, k]) for k in (0, 1)], axis=1)


def tilt_stiffness_error(pad: BondedPad, pose: Array, stiffness: Array) -> Array:
    """Return the relative standard deviation (2) of the `tilt_stiffness` about x and y.

    `stiffness` (2; N m/rad) belongs to the target's `pose` (6; m, rad). The result is infinite for strains beyond the
    range tested with finite elements. Compression reduces the stiffness, to zero at the load at which the pad buckles.
    A given error of the pad's law is then relative to a smaller stiffness.
    """
    about_face = np.diag(pad.stiffness(pose[None])[0])[3:5]
    strain = -float(pose[2]) / pad.thickness
    times = next((factor for most, factor in TILT_SIGMAS if strain <= most), math.inf)
    return np.asarray(times * pad.sigma * about_face / np.abs(stiffness))


TILT_SIGMAS = ((0.2, 1.0), (0.31, 2.0))
"""Rows (largest strain, factor). The relative sigma of the tilt stiffness is the factor times the pad's `sigma`.

A row holds up to its strain. Source: finite elements (tests/mechanics/test_pad.py).
"""

SMALL_TILT = 3e-3
"""Moment for numerical derivatives of the tilt, divided by shear modulus, area and thickness of the pad.

It tilts a pad by some thousandths of a radian.
"""


def linear_poses(pad: BondedPad, loads: Array) -> Array:
    """Return linear estimates of poses (n, 6; m, rad) under loads (n, 3 or 5; N, N m), without tilt.

    Compression follows the pad's law; lateral travel is F / (G A) times the thickness.
    """
    poses = np.zeros((len(loads), 6))
    poses[:, 2] = -pad.thickness * pad.strain(loads[:, 0])
    poses[:, :2] = pad.thickness * (1.0 / (pad.shear_modulus * pad.face.area)) * loads[:, 1:3]
    return poses


def holding_loads(spec: SensorSpec, poses: Array) -> tuple[Array, Array] | None:
    """Return force (n, 3; N) and moment (n, 3; N m) that hold the target in (n, 6) poses. None if there is no pad.

    Both are in board axes. The moment is about the displaced middle of the near face. NaN if the pad would be fully
    compressed.
    """
    if spec.elastomer is None or not rests_on_pad(spec):
        return None
    wrench = soft_pad(spec).force(poses)
    return wrench[:, :3], wrench[:, 3:]


def reading_slopes(read: Callable[[Array], Array], poses: Array) -> Array:
    """Return derivatives of readings with respect to each number of the pose (per m and rad): (poses, coils, 6).

    `read` returns readings (n, coils) at (n, 6) poses.
    """
    moves = np.concatenate([np.diag(STEPS), -np.diag(STEPS)])
    readings = read((poses[:, None, :] + moves).reshape(-1, 6)).reshape(len(poses), 2, 6, -1)
    return np.asarray(np.swapaxes((readings[:, 0] - readings[:, 1]) / (2.0 * STEPS[:, None]), 1, 2))


def pose_slopes(pad: BondedPad, poses: Array) -> Array:
    """Return derivatives (poses, 6, 3; m/N) of x, y, z, rx, ry, rz with respect to normal force, shear x and shear y.

    The target does not rotate, so the last three rows are 0. The derivatives are the inverse of the pad's stiffness at
    the pose. NaN for a fully compressed pad.
    """
    derivatives = np.zeros((len(poses), 6, 3))
    derivatives[:, :3] = np.linalg.inv(pad.stiffness(poses)[:, :3, :3])[:, :, [2, 0, 1]] * [-1.0, 1.0, 1.0]
    return derivatives
