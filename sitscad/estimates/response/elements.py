"""Loads to poses by finite elements instead of the law: minutes rather than a millisecond, for one design at will."""

from __future__ import annotations

import math
from importlib import import_module

import numpy as np

from sitscad.arrays import Array, Flags
from sitscad.estimates.response.pad import NoResponse, soft_pad
from sitscad.mechanics.elements import Pad as Elements
from sitscad.mechanics.elements import Solid, fanned
from sitscad.mechanics.pad import Pad
from sitscad.spec.sensor import SensorSpec

DEGREE, CELLS = 3, 2
"""Of the elements: within 2 % of finer ones (4 % of flat pads pressed by more than 30 %)."""

SETTLED = 1e-6
"""Where the search for a pose ends: the last step in thicknesses and radians."""

MOST_STEPS = 12


def require_elements() -> None:
    """Raise NoResponse, with the command that mends it, where the solver is not installed."""
    try:
        import_module("ngsolve")
    except ImportError as error:
        raise NoResponse(f"finite elements need ngsolve: pip install 'sitscad[fe]' ({error})") from error


def pushed_by_elements(spec: SensorSpec, loads: Array, held: Flags) -> tuple[Array, tuple[str, ...]]:
    """Poses (n, 6; m, rad) under loads (n, 3; N: normal, shear along x, along y), and what there is to say of each.

    A load lies in the plane of one shear force. Raises NoResponse without the solver, for pads that the meshes do not
    know (partly round faces, a film beyond a rim), loads in two planes, and where no equilibrium is found.
    """
    require_elements()
    pad, poses = soft_pad(spec), np.zeros((len(loads), 6))
    for k, (normal, shear_x, shear_y) in enumerate(loads):
        if shear_x and shear_y:
            raise NoResponse("finite elements take shear along x or along y, not both in one load")
        along_y = bool(shear_y)
        x, z, turn = _posed(pad, along_y, float(normal), float(shear_y if along_y else shear_x), bool(held[k]))
        poses[k, [1, 2, 3] if along_y else [0, 2, 4]] = x, z, -turn if along_y else turn
    return poses, tuple("the pose by finite elements of third degree" for _ in loads)


def _posed(pad: Pad, along_y: bool, normal: float, shear: float, is_held: bool) -> tuple[float, float, float]:
    """Place along the shear and up (m) and turn (rad) under a load: Newton's method from the law's pose."""
    elements = Elements(_solid(pad, along_y), CELLS, pad.shear_modulus, pad.film_modulus, DEGREE,
                        fanned(_solid(pad, along_y), CELLS, 1), (pad.exponent, pad.film_exponent))
    pose, free = _guess(pad, along_y, normal, shear, is_held), 2 if is_held else 3
    units = np.array([pad.thickness, pad.thickness, 1.0])[:free]
    for _ in range(MOST_STEPS):
        try:
            found = elements.move((float(pose[0]), float(pose[1]), float(pose[2])))
        except ArithmeticError as error:
            raise NoResponse(f"finite elements: {error}") from error
        sine, cosine = math.sin(pose[2]), math.cos(pose[2])
        lack = np.array([found.force_x - shear, found.force_z + normal,
                         found.moment_y - pad.height * (cosine * shear + sine * normal)])
        slope = found.stiffness.copy()
        slope[2, 2] -= pad.height * (cosine * normal - sine * shear)
        step = np.linalg.solve(slope[:free, :free], lack[:free])
        size = float(np.abs(step / units).max())
        pose[:free] -= step * min(1.0, 0.2 / max(size, 1e-30))
        if size < SETTLED:
            return float(pose[0]), float(pose[1]), float(pose[2])
    raise NoResponse("finite elements: no equilibrium was found, the pad gives way sideways")


def _guess(pad: Pad, along_y: bool, normal: float, shear: float, is_held: bool) -> Array:
    """Where the law says that the target goes; pressed alone where it finds no place."""
    load = np.array([[normal, 0.0, shear] if along_y else [normal, shear, 0.0]])
    pose = pad.pose(load, is_held)[0]
    if not np.all(np.isfinite(pose)):
        return np.array([0.0, -pad.thickness * float(pad.strain(np.array(normal))), 0.0])
    return np.array([pose[1], pose[2], -pose[3]]) if along_y else pose[[0, 2, 4]]


def _solid(pad: Pad, along_y: bool) -> Solid:
    """The pad as its mesh is told, its first width along the shear."""
    face = pad.face
    is_round = face.round > 0.5
    if 0.0 < face.round < 1.0 or (is_round and abs(face.width_x - face.width_y) > 1e-9):
        raise NoResponse("finite elements know rectangular and circular faces of a pad, not what lies between")
    if pad.rim and pad.film:
        raise NoResponse("finite elements know a film round a target that covers its pad, not one beyond a rim")
    widths = (face.width_y, face.width_x) if along_y else (face.width_x, face.width_y)
    return Solid(*widths, pad.thickness, is_round, pad.rim, pad.film)
