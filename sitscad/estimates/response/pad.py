"""From loads to poses and back by the pad's closed formulas: a flat press, and shear of a target that stays level."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.states.pressing import loaded_face, pressed, rests_on_pad
from sitscad.mechanics.elastomer import force_for_strain, shear_strain
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]


class NoResponse(ValueError):
    """The design has nothing that could respond; the text says what it lacks."""


HELD = "rotation=held: the pad's closed formulas know a target that stays level alone"


def pushed(spec: SensorSpec, loads: Array) -> Array:
    """Poses (n, 6; m, rad) of the target under loads (n, 3): normal, towards the board, and shear along +x and +y (N).

    The pad gives way as `mechanics.elastomer` says: compression by the loaded part, shear by G A of that part, the
    target held level. Raises NoResponse where no pad carries the target, ValueError for a pull.
    """
    pad = spec.elastomer
    if pad is None or not rests_on_pad(spec):
        raise NoResponse("a load needs an elastomer under the target")
    loads = np.asarray(loads, dtype=float).reshape(-1, 3)
    if not np.all(np.isfinite(loads)) or np.any(loads[:, 0] < 0.0):
        raise ValueError("a load is three finite forces in newtons, the normal one 0 or more (towards the board)")
    area, found = loaded_face(spec)[0].area, np.zeros((len(loads), 6))
    depth = {force: _depth(spec, force) for force in np.unique(loads[:, 0])}
    found[:, 2] = [-depth[force] for force in loads[:, 0]]
    found[:, :2] = pad.thickness * shear_strain(1.0, area, pad.material.shear_modulus) * loads[:, 1:]
    return found


def _depth(spec: SensorSpec, force: float) -> float:
    pad = spec.elastomer
    assert pad is not None
    asked = replace(spec, requirements=replace(spec.requirements, normal_force=float(force)))
    return pressed(asked).strain * pad.thickness


def holding(spec: SensorSpec, poses: Array) -> tuple[Array, Array] | None:
    """Force (N) and moment (Nm), (n, 3) each, in board axes, that hold the target in (n, 6) poses; None without pad.

    By the same formulas: NaN for turned poses and for pulled or shut pads, which they do not know. The pad's faces are
    held level, so each has half of the moment of the force over the way from one's middle to the other's.
    """
    pad = spec.elastomer
    if pad is None or not rests_on_pad(spec):
        return None
    face, material = loaded_face(spec)[0], pad.material
    force = np.full((len(poses), 3), math.nan)
    stiffness = material.shear_modulus * face.area / pad.thickness
    for k, (x, y, z, *turn) in enumerate(poses):
        if any(turn) or not -pad.thickness < z <= 0.0:
            continue
        normal = force_for_strain(-z / pad.thickness, face.width_x, face.width_y, pad.thickness,
                                  material.shear_modulus, material.bulk_modulus, face.round)  # fmt: skip
        force[k] = stiffness * x, stiffness * y, -normal
    between = np.array([0.0, 0.0, pad.thickness]) + poses[:, :3]
    return force, -0.5 * np.cross(between, force)
