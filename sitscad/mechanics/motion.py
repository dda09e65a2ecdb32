"""A rigid plate's motion over a fixed one, seen from a frame that is turned by a share of its turn.

From the frame that is turned half as far as the plate, swapping board and plate turns the pad about an axis in its
plane and changes nothing else: the energy of a pad that is alike at both faces has no product of shear and tilt there,
their coupling is in the motion itself. A pad wider than its plate has that frame nearer to the board's. Arrays run over
the poses first. SI units; rotations are vectors: axis times angle (rad).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.record import record

Array = NDArray[np.float64]

SMALL = 1e-4
"""Angle (rad) below which the coefficients of a rotation are taken from their series."""

SERIES = 0.25
"""Square of the angle below which four more terms of these series are as good as rounding."""

UNIT = np.eye(3)


def rotations(angles: Array) -> Array:
    """Matrices Rx(rx) Ry(ry) Rz(rz), (n, 3, 3), of angles (n, 3) in rad: the spec's turn of a target."""
    (a, b, c), (p, q, r) = np.cos(angles).T, np.sin(angles).T
    found = np.empty((len(a), 3, 3))
    found[:, 0, 0], found[:, 0, 1], found[:, 0, 2] = b * c, -b * r, q
    found[:, 1, 0], found[:, 1, 1], found[:, 1, 2] = a * r + p * q * c, a * c - p * q * r, -p * b
    found[:, 2, 0], found[:, 2, 1], found[:, 2, 2] = p * r - a * q * c, p * c + a * q * r, a * b
    return found


def angles(matrices: Array) -> Array:
    """Angles (n, 3; rad) with Rx Ry Rz of rotation matrices (n, 3, 3), tilts below a right angle."""
    turned = np.arctan2(-matrices[:, 1, 2], matrices[:, 2, 2])
    tilted = np.arcsin(np.clip(matrices[:, 0, 2], -1.0, 1.0))
    return np.column_stack([turned, tilted, np.arctan2(-matrices[:, 0, 1], matrices[:, 0, 0])])


def rotation_vectors(matrices: Array) -> Array:
    """Axis times angle (n, 3; rad) of rotation matrices (n, 3, 3), by less than half a turn."""
    odd = np.empty((len(matrices), 3))
    odd[:, 0] = matrices[:, 2, 1] - matrices[:, 1, 2]
    odd[:, 1] = matrices[:, 0, 2] - matrices[:, 2, 0]
    odd[:, 2] = matrices[:, 1, 0] - matrices[:, 0, 1]
    odd *= 0.5
    sine = np.sqrt(np.einsum("ni,ni->n", odd, odd))
    angle = np.arctan2(sine, 0.5 * (matrices[:, 0, 0] + matrices[:, 1, 1] + matrices[:, 2, 2] - 1.0))
    return np.where(sine > SMALL, angle / np.maximum(sine, 1e-30), 1.0 + angle * angle / 6.0)[:, None] * odd


def exponentials(vectors: Array) -> Array:
    """Rotation matrices (n, 3, 3) of axis times angle (n, 3; rad): Rodrigues' formula."""
    first, second, _ = _coefficients(vectors)
    turning = crosses(vectors)
    return UNIT + first[:, None, None] * turning + second[:, None, None] * (turning @ turning)


def left_jacobians(vectors: Array) -> Array:
    """(n, 3, 3), no unit: what turn, in board axes, follows from a small change of a rotation vector (n, 3; rad). The
    left Jacobian of rotations.
    """
    _, second, third = _coefficients(vectors)
    turning = crosses(vectors)
    return UNIT + second[:, None, None] * turning + third[:, None, None] * (turning @ turning)


def crosses(vectors: Array) -> Array:
    """Matrices (n, 3, 3) that take a vector to the cross product of `vectors` (n, 3) with it, in their unit."""
    found = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    found[:, 2, 1], found[:, 1, 2] = x, -x
    found[:, 0, 2], found[:, 2, 0] = y, -y
    found[:, 1, 0], found[:, 0, 1] = z, -z
    return found


def cross(one: Array, other: Array) -> Array:
    """Cross products of vectors (n, 3): for a few of them in a fraction of numpy's time."""
    found = np.empty_like(one)
    found[:, 0] = one[:, 1] * other[:, 2] - one[:, 2] * other[:, 1]
    found[:, 1] = one[:, 2] * other[:, 0] - one[:, 0] * other[:, 2]
    found[:, 2] = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return found


def _coefficients(vectors: Array) -> tuple[Array, Array, Array]:
    """Sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3 of the length t of vectors (n, 3; rad)."""
    square = np.einsum("ni,ni->n", vectors, vectors)
    if float(square.max(initial=0.0)) < SERIES:
        return (
            1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))),
            0.5 - square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0 * (1.0 - square / 90.0))),
            1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0 * (1.0 - square / 110.0))),
        )
    angle = np.sqrt(square)
    safe, small = np.maximum(angle, SMALL), angle < SMALL
    return (
        np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe),
        np.where(small, 0.5 - square / 24.0, (1.0 - np.cos(safe)) / safe**2),
        np.where(small, 1.0 / 6.0 - square / 120.0, (safe - np.sin(safe)) / safe**3),
    )


@record(eq=False)
class Motion:
    """A plate's place in board axes (n, 3; m), how it is turned (n, 3, 3) and that as a rotation vector (n, 3; rad),
    the frame that is turned by `share` of it (n, 3, 3), the place in that, and the left Jacobians of frame and plate.
    """

    place: Array
    turn: Array
    vectors: Array
    share: float
    frame: Array
    within: Array
    frame_jacobians: Array
    jacobians: Array

    def wrenches(self, slopes: Array, turning: Array) -> Array:
        """Force and moment about the plate's displaced middle, (n, 6) in board axes, of an energy whose slopes are
        (n, 3) by the place and (n, 3) by the rotation vector, both in the frame.

        A small turn of the plate turns the frame by its share: virtual work of both together.
        """
        force = np.einsum("nij,nj->ni", self.frame, slopes)
        with np.errstate(invalid="ignore"):  # a pad that is shut: without bound, and its moment is no number
            lever = cross(self.place, force)
        followed = self.share * np.einsum("nji,nj->ni", self.frame_jacobians, lever)
        transposed = np.swapaxes(self.jacobians, 1, 2)
        moment = np.linalg.solve(transposed, (turning - followed)[:, :, None])[:, :, 0]
        return np.concatenate([force, moment], axis=1)


def relative(poses: Array, height: float, share: float = 0.5) -> Motion:
    """What a pad feels of poses (n, 6; see `sitscad.scene.state`) of a plate at rest `height` (m) above the board."""
    count, turn = len(poses), rotations(poses[:, 3:])
    vectors = rotation_vectors(turn)
    # frame and plate at once: of a few poses it is the calls that cost
    both = np.concatenate([share * vectors, vectors])
    first, second, third = _coefficients(both)
    turning = crosses(both)
    twice = turning @ turning
    jacobians = UNIT + second[:, None, None] * turning + third[:, None, None] * twice
    frame = UNIT + first[:count, None, None] * turning[:count] + second[:count, None, None] * twice[:count]
    place = poses[:, :3] + (0.0, 0.0, height)
    within = np.einsum("nji,nj->ni", frame, place)
    return Motion(place, turn, vectors, share, frame, within, jacobians[:count], jacobians[count:])
