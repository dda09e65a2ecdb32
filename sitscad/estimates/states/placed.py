"""Poses of the target, their ranges, and the distances between target and coils."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sitscad.assembly.places.bodies import plates_of, target_gap
from sitscad.assembly.places.state import State
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.circuits.solved_winding import HEIGHT_STEP
from sitscad.estimates.loads.pad import NoResponse
from sitscad.kernels.electromagnetics.eddy.coil_potential import FINE
from sitscad.kernels.electromagnetics.eddy.target import rotation_matrices
from sitscad.layout.board import Coil
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import Target
from sitscad.spec.sensor import SensorSpec

FARTHER = 1.3
"""Rounding step of the lateral reach of a target, as a ratio.

The reach is the largest lateral distance of the target's points from a coil's centre. It is rounded up to a power of
this ratio, so that one solution serves many poses.
"""

LEAST_HEIGHT = 40e-6
"""Least height (m) over the copper's mid-plane at which a coil's field is computed.

Lower points have the field at this height. The field is computed from filaments, and close to a track a filament is
inaccurate.
"""

WIDEST = 4.4
"""Side of the square over which a coil's potential is tabulated, divided by the coil's size.

Outside the square, the coil is replaced by a dipole. The error is 2e-4 of an inductance change.
"""

MOST_NODES = 800
"""Largest number of nodes along a side of the table of a coil's potential."""


MARGIN, PER_HEIGHT, HIGHEST, MAGNETIC = 0.6, 2.0, 0.75, 1.6
"""Constants of the distance beyond the outermost coil up to which a target's eddy currents are computed.

The distance is `MARGIN` coil sizes plus `PER_HEIGHT` times the target's height. For this sum, the height is limited to
`HIGHEST` coil sizes, where a change is below 1 % of an inductance. For magnetic metals the distance is `MAGNETIC` times
as large. The rest of the target is left out.
"""

MAX_PARTIAL_ERROR = 0.003
"""Largest error of an inductance change because only a part of the target is computed, as a fraction of the change.

The results were compared with whole targets of 11 sizes (tests/estimates/test_placed.py).
"""

LEFT_OUT_OF_MAGNETIC = 0.006
"""Largest error because only a part of a magnetic target is computed, as a fraction of the inductance change."""

STEP = 0.5
"""Rounding step, in coil sizes, for half the side of the part of a target that is computed. It is rounded up."""

WHOLE_SIDE_RATIO = 0.8
"""Least side of the computed part of a target, divided by the target's side, from which the whole side is computed."""

FARTHEST = 1.0
"""Largest distance (m) of a requested pose from rest, along each axis."""

STEEPEST = math.radians(89.0)
"""Largest tilt (rad) of a requested pose about x or y."""

NAMES = ("x", "y", "z", "rx", "ry", "rz")
"""Names of the components of a pose in messages."""


def level_poses(states: Sequence[State]) -> Array:
    """Return poses (n, 6; m, rad) of the level target, one for each state that has a target."""
    heights = [state.pose.z for state in states if state.pose is not None]
    poses = np.zeros((len(heights), 6))
    poses[:, 2] = heights
    return poses


def target_centre_at_rest(spec: SensorSpec) -> Array:
    """Return the centre (x, y, z; m) of the target's near face at rest, in the layout's coordinates."""
    body, gap = plates_of(spec).target, target_gap(spec)
    assert body is not None and gap is not None
    return np.array([*body.footprint.centre, gap])


def require_possible_poses(spec: SensorSpec, poses: Array) -> None:
    """Raise NoResponse if one of (n, 6; m, rad) poses is impossible for a target, with the reason for the first.

    It does not check whether the pad permits the pose.
    """
    poses = np.asarray(poses, dtype=float).reshape(-1, 6)
    if not np.all(np.isfinite(poses)):
        return  # the solver refuses these
    assert spec.target is not None
    target_poses = TargetPoses.from_rest(spec.target, target_centre_at_rest(spec), poses)
    highest = 2.0 * target_poses.places[:, 2] - target_poses.lowest + spec.target.thickness
    reasons = (
        (np.abs(poses[:, :3]).max(axis=1) > FARTHEST, f"is more than {FARTHEST:g} m from rest"),
        (np.abs(poses[:, 3:5]).max(axis=1) > STEEPEST, "turns the target's near face away from the coils: rx and ry "
                                                       "are at most 89 degrees"),
        (np.abs(poses[:, 5]) > 2.0 * math.pi, "turns the target more than once: rz is at most 360 degrees"),
        (highest < 0.0, "has the whole target inside or under the board"),
    )
    for is_wrong, reason in reasons:
        if is_wrong.any():
            k = int(np.argmax(is_wrong))
            *place, rx, ry, rz = (*1e3 * poses[k, :3], *np.degrees(poses[k, 3:]))
            pose = ", ".join(f"{name}={value:.6g}" for name, value in zip(NAMES, (*place, rx, ry, rz), strict=True))
            raise NoResponse(f"the pose {pose} (mm, degrees) {reason}")


@record
class PoseRange:
    """Range of poses for which one solution of a target's eddy currents holds.

    `lowest` (m) is the lowest height of the target in the layout's coordinates. `reach` (m) is the largest lateral
    distance of the target's points from a coil's centre. `half` (m) are half the sides of the part of the target that
    is computed. `error` is the relative error of an inductance change because the rest of the target is left out.
    """

    lowest: float
    reach: float
    half: tuple[float, float]
    error: float = 0.0

    def serves(self, other: PoseRange) -> bool:
        """Whether a solution for this range of poses also holds for all poses of the `other` range."""
        return (other.lowest >= self.lowest and other.reach <= self.reach and other.half[0] <= self.half[0]
                and other.half[1] <= self.half[1])

    def part(self, target: Target) -> Target:
        """Return the part of a target that is computed: a target with the same middle and smaller sides."""
        size = 2.0 * self.half[0], 2.0 * self.half[1]
        return target if size == target.size else replace(target, size=size)


@record(eq=False)
class TargetPoses:
    """Poses of the target: rotations `turns` (n, 3, 3) and centres of the near face, `places` (n, 3; m).

    `lowest` (n; m) is the height of the lowest point in each pose, and `half` are half the target's sides (m).
    """

    turns: Array
    places: Array
    lowest: Array
    half: tuple[float, float]

    @classmethod
    def from_rest(cls, target: Target, rest: Array, poses: Array) -> TargetPoses:
        """Return the poses of a target that is displaced and turned from rest.

        `rest` (m) is the centre of its near face at rest. `poses` (n, 6; m, rad) are displacements and rotations.
        """
        rotation = 0.0 if target.outline.is_disc else target.rotation
        turns = rotation_matrices(poses[:, 3:]) @ rotation_matrices(np.array([[0.0, 0.0, rotation]]))[0]
        places = rest + poses[:, :3]
        half = 0.5 * target.size[0], 0.5 * target.size[1]
        return cls(turns, places, places[:, 2] - _lowest_depth(target, turns, half), half)

    def heights(self, centres: Array) -> Array:
        """Return logarithms of the target's heights (m) over the coils' centres: (n, coils).

        Each height is measured to the plane of the near face. It is limited to the range between the lowest and the
        highest point of the face.
        """
        normal = self.turns[:, :, 2]
        offsets = centres[None, :, :] - self.places[:, None, :2]
        plane = self.places[:, None, 2] - np.einsum("nci,ni->nc", offsets, normal[:, :2]) / normal[:, 2:]
        span = (self.places[:, 2] - self.lowest)[:, None]
        middle = self.places[:, 2:]
        return np.log(np.maximum(np.clip(plane, middle - span, middle + span), LEAST_HEIGHT))

    def pose_range(
        self, target: Target, coil: CoilSpec, coils: Sequence[Coil], middle: tuple[float, float]
    ) -> PoseRange:
        """Return a range that contains these poses, over coils with the dimensions `coil` around a `middle` (m).

        Its values are rounded to steps, so that a solution serves many poses.
        """
        is_magnetic = target.material.relative_permeability > 1.1
        top, centre = max(winding.z for winding in coils[0].windings), np.array(middle)
        apart = max(math.hypot(*(np.array(each.placement.centre) - centre)) for each in coils)
        size, sideways = max(coil.size), float(np.hypot(*(self.places[:, :2] - centre).T).max())
        high = min(float(self.places[:, 2].max()) - top, HIGHEST * size)
        beyond = (MAGNETIC if is_magnetic else 1.0) * (MARGIN * size + PER_HEIGHT * high)
        part = STEP * size * math.ceil((sideways + apart + 0.5 * size + beyond) / (STEP * size))
        x, y = (part if part < WHOLE_SIDE_RATIO * side else side for side in self.half)
        half = x, y
        reach = FARTHER ** math.ceil(math.log(sideways + math.hypot(*half) + apart, FARTHER))
        least = max(LEAST_HEIGHT, WIDEST * size / (FINE * MOST_NODES))
        height = max(float((self.places[:, 2] - _lowest_depth(target, self.turns, half)).min()) - top, least)
        lowest = max(HEIGHT_STEP ** math.floor(math.log(height, HEIGHT_STEP)), least) + top
        error = 0.0 if half == self.half else LEFT_OUT_OF_MAGNETIC if is_magnetic else MAX_PARTIAL_ERROR
        return PoseRange(lowest, reach, half, error)


def _lowest_depth(target: Target, turns: Array, half: tuple[float, float]) -> Array:
    """Return the depth (m) of the target's lowest point below the centre of its near face, for each rotation (n).

    `turns` (n, 3, 3) are the rotations, `half` (m) half the target's sides.
    """
    by_x, by_y = half[0] * np.abs(turns[:, 2, 0]), half[1] * np.abs(turns[:, 2, 1])
    return np.hypot(by_x, by_y) if target.outline.is_disc else np.asarray(by_x + by_y)
