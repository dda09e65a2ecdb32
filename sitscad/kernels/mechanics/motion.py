"""Motion of a rigid plate over a fixed board, and the balance of forces on the plate.

The energy of a pad between board and plate is written in a frame that rotates by a fraction of the plate's rotation. In
the frame that rotates half as far as the plate, a pad with equal faces has no product of shear and tilt in its energy.
The reason is symmetry: a half turn of the pad about an axis in its plane exchanges board and plate. For a pad wider
than its plate, this frame rotates less.

Arrays have the poses as their first axis. Units are SI. Rotations are rotation vectors: axis times angle (rad).

Notes
-----
`energy_derivatives` returns the gradient and the Hessian of the energy in closed form. The unknowns are the plate's
place in the frame and its rotation vector. In the frame the energy of the pad is a sum of squares. The work of a force
f of constant direction at a point p is Rodrigues' formula: f R(t) p = c0 f.p + c1 t.(p x f) + c2 (f.t)(p.t). Here c_k
are Stumpff's functions, the even functions c_k(t^2) = sum of (-t^2)^j / (2j + k)!, with 2 c_k' = k c_(k+2) - c_(k+1)
(textbook). Each number is a float for one load, or an array over loads. For one load, floats take a third of the time.
`energy_derivatives` measures lengths in pad thicknesses, forces in shear modulus times loaded area, and moments in this
force times the thickness.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record

SMALL = 1e-4  # Angle (rad) below which the coefficients of a rotation are taken from their series
SERIES = 0.25  # Square of the angle below which four more terms of these series are as good as rounding

UNIT = np.eye(3)
"""Identity matrix (3, 3)."""


def rotations(angles: Array) -> Array:
    """Return rotation matrices Rx(rx) Ry(ry) Rz(rz) (n, 3, 3; no unit) for angles (n, 3; rad) about x, y and z.

    A spec's poses use the same order (textbook).
    """
    (a, b, c), (p, q, r) = np.cos(angles).T, np.sin(angles).T
    matrices = np.empty((len(a), 3, 3))
    matrices[:, 0, 0], matrices[:, 0, 1], matrices[:, 0, 2] = b * c, -b * r, q
    matrices[:, 1, 0], matrices[:, 1, 1], matrices[:, 1, 2] = a * r + p * q * c, a * c - p * q * r, -p * b
    matrices[:, 2, 0], matrices[:, 2, 1], matrices[:, 2, 2] = p * r - a * q * c, p * c + a * q * r, a * b
    return matrices


def angles(matrices: Array) -> Array:
    """Return the angles (n, 3; rad) about x, y and z of rotation matrices (n, 3, 3).

    It is the inverse of `rotations` for tilts below a right angle.
    """
    turned = np.arctan2(-matrices[:, 1, 2], matrices[:, 2, 2])
    tilted = np.arcsin(np.clip(matrices[:, 0, 2], -1.0, 1.0))
    return np.column_stack([turned, tilted, np.arctan2(-matrices[:, 0, 1], matrices[:, 0, 0])])


def rotation_vectors(matrices: Array) -> Array:
    """Return rotation vectors (n, 3; rad) of rotation matrices (n, 3, 3), for rotations by less than half a turn.

    The odd part of the matrix is sin t times the axis, and its trace is 1 + 2 cos t (Rodrigues' formula; textbook).
    """
    odd = np.empty((len(matrices), 3))
    odd[:, 0] = matrices[:, 2, 1] - matrices[:, 1, 2]
    odd[:, 1] = matrices[:, 0, 2] - matrices[:, 2, 0]
    odd[:, 2] = matrices[:, 1, 0] - matrices[:, 0, 1]
    odd *= 0.5
    sine = np.sqrt(np.einsum("ni,ni->n", odd, odd))
    angle = np.arctan2(sine, 0.5 * (matrices[:, 0, 0] + matrices[:, 1, 1] + matrices[:, 2, 2] - 1.0))
    return np.where(sine > SMALL, angle / np.maximum(sine, 1e-30), 1.0 + angle * angle / 6.0)[:, None] * odd


def rotations_of_vectors(vectors: Array) -> Array:
    """Return the rotation matrices (n, 3, 3) of rotation vectors (n, 3; rad), by Rodrigues' formula (textbook)."""
    first, second, _ = _rotation_coefficients(vectors)
    turning = cross_matrices(vectors)
    return UNIT + first[:, None, None] * turning + second[:, None, None] * (turning @ turning)


def cross_matrices(vectors: Array) -> Array:
    """Return matrices M (n, 3, 3), one for each vector (n, 3), in the vectors' unit.

    The product M b is the cross product of the vector and b.
    """
    matrices = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    matrices[:, 2, 1], matrices[:, 1, 2] = x, -x
    matrices[:, 0, 2], matrices[:, 2, 0] = y, -y
    matrices[:, 1, 0], matrices[:, 0, 1] = z, -z
    return matrices


def cross_products(first: Array, second: Array) -> Array:
    """Return cross products (n, 3) of vectors (n, 3), in the product of their units.

    For a few vectors this takes a fraction of the time of `numpy.cross`.
    """
    products = np.empty_like(first)
    products[:, 0] = first[:, 1] * second[:, 2] - first[:, 2] * second[:, 1]
    products[:, 1] = first[:, 2] * second[:, 0] - first[:, 0] * second[:, 2]
    products[:, 2] = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return products


def _rotation_coefficients(vectors: Array) -> tuple[Array, Array, Array]:
    """Return sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3 (n each) for the lengths t of vectors (n, 3; rad).

    For small lengths the Taylor series is used, because the differences would lose digits.
    """
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
    """Position and rotation of plates, and the rotating frames in which a pad's energy is written.

    Attributes
    ----------
    place : array (n, 3)
        position of the plate in board axes (m)
    turn, vectors : arrays (n, 3, 3) and (n, 3)
        rotation of the plate as a matrix and as a rotation vector (rad)
    share : float
        rotation angle of the frame divided by the plate's
    frame, within : arrays (n, 3, 3) and (n, 3)
        rotation matrix of the frame, and the plate's position in axes of the frame (m)
    frame_jacobians, jacobians : arrays (n, 3, 3)
        left Jacobians of the rotation vectors of frame and plate: they map a small change of the vector to a rotation
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
        """Return forces (N) and moments (N m) on the plate (n, 6; board axes) from derivatives of the pad's energy.

        Moments are about the displaced middle of the plate.

        `slopes` (n, 3; N) are derivatives with respect to the place, `turning` (n, 3; N m) derivatives with respect to
        the rotation vector. Both are in axes of the frame.

        Notes
        -----
        Derived here by virtual work. A small rotation of the plate rotates the frame by the fraction `share`. The left
        Jacobian maps the change of the rotation vector to this rotation.
        """
        force = np.einsum("nij,nj->ni", self.frame, slopes)
        with np.errstate(invalid="ignore"):  # a pad that is shut: without bound, and its moment is no number
            lever = cross_products(self.place, force)
        followed = self.share * np.einsum("nji,nj->ni", self.frame_jacobians, lever)
        transposed = np.swapaxes(self.jacobians, 1, 2)
        moment = np.linalg.solve(transposed, (turning - followed)[:, :, None])[:, :, 0]
        return np.concatenate([force, moment], axis=1)


def relative_motion(poses: Array, height: float, share: float = 0.5) -> Motion:
    """Return the motion of a plate at poses (n, 6; m and rad). At a pose of zeros it is `height` (m) above the board.

    `sitscad.assembly.places.state` defines poses. `share` is the rotation angle of the frame divided by the plate's.

    The matrices follow from Rodrigues' formula, and from the left Jacobian of rotations, 1 + (1 - cos t) / t^2 [t] + (t
    - sin t) / t^3 [t]^2 (textbook).
    """
    count, turn = len(poses), rotations(poses[:, 3:])
    vectors = rotation_vectors(turn)
    # frame and plate at once: of a few poses it is the calls that cost
    angles = np.concatenate([share * vectors, vectors])
    first, second, third = _rotation_coefficients(angles)
    turning = cross_matrices(angles)
    twice = turning @ turning
    jacobians = UNIT + second[:, None, None] * turning + third[:, None, None] * twice
    frame = UNIT + first[:count, None, None] * turning[:count] + second[:count, None, None] * twice[:count]
    place = poses[:, :3] + (0.0, 0.0, height)
    within = np.einsum("nji,nj->ni", frame, place)
    return Motion(place, turn, vectors, share, frame, within, jacobians[:count], jacobians[count:])


Number: TypeAlias = Any  # A float, or an array (n,)
"""A float for one load, or an array (n) for n loads."""

Vector: TypeAlias = Sequence[Number]
"""Three numbers along x, y and z."""
Rows: TypeAlias = list[list[Number]]
"""Matrix as a list of rows."""

SHORT, LARGE = 0.25, 10.0
"""Largest squared rotation angles (rad2) at which `FEW` terms and `TERMS` terms of the series are exact to rounding."""

FEW, TERMS = 7, 13
"""Numbers of terms in the series of Stumpff's functions, for small and for large rotations."""

THREE, PAIRS = range(3), ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Indices of the three axes, and all pairs of axes, each pair once."""


class StiffnessLaw(NamedTuple):
    """Dimensionless stiffness law of a pad at one compressive strain.

    `pressure` and `pressure_slope` are the pressure and its derivative with respect to the strain. `values` are the
    five stiffness curves of `pad.StiffnessCurves` at this strain. `slopes` and `bends` are their first and second
    derivatives. `twist` is the stiffness for rotation in the plane of the pad.
    """

    pressure: Number
    pressure_slope: Number
    values: Sequence[Number]
    slopes: Sequence[Number]
    bends: Sequence[Number]
    twist: float


class Load(NamedTuple):
    """Force of constant direction, the point at which it acts, and a moment about this point.

    `force` and `moment` are in board axes. `point` is in axes of the plate, from the middle of its face on the pad.
    `is_moment` is False if the moment is zero, so that its terms are omitted.
    """

    force: Vector
    point: Vector
    moment: Vector
    is_moment: bool


def stumpff(square: Number, largest: float) -> tuple[Number, ...]:
    """Return Stumpff's functions c_0 to c_6 (no unit) of squared angles (rad2).

    `largest` is the largest square, which sets the number of terms. The two highest functions come from their series,
    the others from c_k = 1 / k! - t^2 c_(k+2) (textbook).
    """
    fifth = sixth = 1.0
    for j in range(FEW if largest <= SHORT else TERMS, 0, -1):
        k = 2 * j
        fifth = 1.0 - square * fifth / ((k + 4) * (k + 5))
        sixth = 1.0 - square * sixth / ((k + 5) * (k + 6))
    fifth, sixth = fifth / 120.0, sixth / 720.0
    fourth, third = 1.0 / 24.0 - square * sixth, 1.0 / 6.0 - square * fifth
    second, first = 0.5 - square * fourth, 1.0 - square * third
    return 1.0 - square * second, first, second, third, fourth, fifth, sixth


def energy_derivatives(
    law: StiffnessLaw, share: float, place: Vector, turn: Vector, load: Load, largest: float
) -> tuple[list[Number], Rows]:
    """Return gradient (6) and Hessian (6 rows of 6) of the pad's energy minus the work of the load.

    The first three numbers belong to the place of the plate in the frame, the last three to its rotation vector.

    Parameters
    ----------
    law : StiffnessLaw
        stiffness law of the pad at its present compression
    share : float
        rotation angle of the frame divided by the plate's
    place, turn : vectors of 3
        place in the frame (divided by the thickness) and rotation vector (rad) of the plate
    load : Load
        forces in shear modulus times loaded area
    largest : float
        largest squared angle of `turn` (rad2)

    Notes
    -----
    Derived here. In equilibrium the gradient is zero.
    """
    lack, rows = _pad_energy_derivatives(law, place, turn)
    square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
    frame = stumpff(share * share * square, share * share * largest)
    plate = stumpff(square, largest)
    carried, carrying = _force_in_frame(load.force, share, turn, frame)
    works = [_work(load.force, place, share, turn, frame), _work(load.force, load.point, 1.0, turn, plate)]
    # no -= here: of arrays several entries are one
    for i in THREE:
        lack[i] = lack[i] - carried[i]
        lack[3 + i] = lack[3 + i] - works[0][0][i] - works[1][0][i]
        for j in THREE:
            rows[i][3 + j] = rows[3 + j][i] = rows[i][3 + j] - carrying[i][j]
            rows[3 + i][3 + j] = rows[3 + i][3 + j] - works[0][1][i][j] - works[1][1][i][j]
    if load.is_moment:
        turned, turning = _generalised_moment(load.moment, turn, plate)
        for i in THREE:
            lack[3 + i] = lack[3 + i] - turned[i]
            for j in THREE:
                rows[3 + i][3 + j] = rows[3 + i][3 + j] - turning[i][j]
    return lack, rows


def _pad_energy_derivatives(law: StiffnessLaw, place: Vector, turn: Vector) -> tuple[list[Number], Rows]:
    """Return gradient (6) and Hessian (6 rows of 6) of the pad's energy with respect to place and rotation vector.

    `energy_derivatives` defines the units. With the place (x, y, z) and the rotation vector (a, b, c), the energy has
    two parts. The first is (along x^2 + across y^2 + tilt_x a^2 + tilt_y b^2 + twist c^2) / 2 + cubic (x^2 + y^2)^2 /
    4. The second is the energy of the pressure. All coefficients except twist depend on the strain 1 - z.
    """
    (x, y, _), (a, b, c) = place, turn
    along_x, along_y, cubic, tilt_x, tilt_y = law.values
    along_1, across_1, cubic_1, tilt_x_1, tilt_y_1 = law.slopes
    along_2, across_2, cubic_2, tilt_x_2, tilt_y_2 = law.bends
    xx, yy, aa, bb = x * x, y * y, a * a, b * b
    shear_square = xx + yy
    hardened, fourth, none = cubic * shear_square, 0.25 * shear_square * shear_square, 0.0 * x
    coupled = 0.5 * (along_1 * xx + across_1 * yy + tilt_x_1 * aa + tilt_y_1 * bb)
    bent = 0.5 * (along_2 * xx + across_2 * yy + tilt_x_2 * aa + tilt_y_2 * bb)
    xy, zx, zy = 2.0 * cubic * x * y, -(along_1 + cubic_1 * shear_square) * x, -(across_1 + cubic_1 * shear_square) * y
    za, zb = -tilt_x_1 * a, -tilt_y_1 * b
    lack = [
        (along_x + hardened) * x,
        (along_y + hardened) * y,
        -(law.pressure + cubic_1 * fourth + coupled),
        tilt_x * a,
        tilt_y * b,
        law.twist * c,
    ]
    return lack, [
        [along_x + hardened + 2.0 * cubic * xx, xy, zx, none, none, none],
        [xy, along_y + hardened + 2.0 * cubic * yy, zy, none, none, none],
        [zx, zy, law.pressure_slope + cubic_2 * fourth + bent, za, zb, none],
        [none, none, za, tilt_x + none, none, none],
        [none, none, zb, none, tilt_y + none, none],
        [none, none, none, none, none, law.twist + none],
    ]


def _dot(first: Vector, second: Vector) -> Number:
    """Return the scalar product of two vectors of 3, in the product of their units."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def _cross(first: Vector, second: Vector) -> Vector:
    """Return the cross product (3) of two vectors of 3, in the product of their units."""
    (a, b, c), (x, y, z) = first, second
    return b * z - c * y, c * x - a * z, a * y - b * x


def _work(force: Vector, arm: Vector, share: float, turn: Vector, c: tuple[Number, ...]) -> tuple[Vector, Rows]:
    """Return gradient (3) and Hessian (3 rows of 3) of the work of a force with respect to the rotation vector.

    `arm` (3) is the point at which the force acts; it is rotated by `share` times the rotation vector `turn`. `c` are
    Stumpff's functions of the squared angle. `energy_derivatives` defines the units. These are the derivatives of f
    R(t) p in the notes of the module, with 2 c_k' = k c_(k+2) - c_(k+1).
    """
    squared, odd, fd, ad = share * share, _cross(arm, force), _dot(force, turn), _dot(arm, turn)
    still, crossed, turned = _dot(force, arm), share * _dot(odd, turn), squared * fd * ad
    odd_term, turn_term = 0.5 * (c[3] - c[2]), c[4] - 0.5 * c[3]
    first = 2.0 * squared * (odd_term * crossed + turn_term * turned - 0.5 * c[1] * still)
    one_2, two_2 = 0.75 * (c[5] - c[4]) + 0.25 * c[3], 2.0 * c[6] - 1.25 * c[5] + 0.25 * c[4]
    second = 4.0 * squared * squared * (one_2 * crossed + two_2 * turned - 0.5 * odd_term * still)
    lean = [squared * (fd * arm[i] + ad * force[i]) for i in THREE]
    grown = [2.0 * squared * (odd_term * share * odd[i] + turn_term * lean[i]) for i in THREE]
    slopes = [first * turn[i] + c[1] * share * odd[i] + c[2] * lean[i] for i in THREE]
    rows: Rows = [[0.0, 0.0, 0.0] for _ in THREE]
    double = c[2] * squared
    for i, j in PAIRS:
        rows[i][j] = rows[j][i] = (
            second * turn[i] * turn[j]
            + turn[i] * grown[j]
            + turn[j] * grown[i]
            + double * (force[i] * arm[j] + force[j] * arm[i])
        )
    for i in THREE:
        rows[i][i] = rows[i][i] + first
    return slopes, rows


def _force_in_frame(force: Vector, share: float, turn: Vector, c: tuple[Number, ...]) -> tuple[Vector, Rows]:
    """Return a force (3) in axes of the frame, and its derivatives (3 rows of 3) with respect to the rotation vector.

    The frame is rotated by `share` times the rotation vector `turn`. `c` are Stumpff's functions of the squared angle.
    The result is R(-t) f by Rodrigues' formula. Its derivatives are computed like those in `_work`.
    """
    squared, fd, odd = share * share, _dot(force, turn), _cross(turn, force)
    odd_term, turned = 0.5 * (c[3] - c[2]), c[4] - 0.5 * c[3]
    carried = [c[0] * force[i] - c[1] * share * odd[i] + c[2] * squared * fd * turn[i] for i in THREE]
    grown = [
        2.0 * squared * (-0.5 * c[1] * force[i] - odd_term * share * odd[i] + turned * squared * fd * turn[i])
        for i in THREE
    ]
    spun, double = _cross_matrix(force), c[2] * squared
    rows: Rows = [
        [grown[i] * turn[j] + c[1] * share * spun[i][j] + double * turn[i] * force[j] for j in THREE] for i in THREE
    ]
    for i in THREE:
        rows[i][i] = rows[i][i] + double * fd
    return carried, rows


def _generalised_moment(moment: Vector, turn: Vector, c: tuple[Number, ...]) -> tuple[Vector, Rows]:
    """Return the generalised moment (3) along the rotation vector, and its derivatives (3 rows of 3).

    It is the transposed left Jacobian of rotations (see `relative_motion`) times the moment, with derivatives as in
    `_work`.
    """
    md, odd, square = _dot(moment, turn), _cross(turn, moment), _dot(turn, turn)
    two, three = c[4] - 0.5 * c[3], 1.5 * c[5] - 0.5 * c[4]
    flat = [turn[i] * md - moment[i] * square for i in THREE]
    moments = [moment[i] - c[2] * odd[i] + c[3] * flat[i] for i in THREE]
    grown = [2.0 * (three * flat[i] - two * odd[i]) - 2.0 * c[3] * moment[i] for i in THREE]
    spun = _cross_matrix(moment)
    rows: Rows = [[grown[i] * turn[j] + c[2] * spun[i][j] + c[3] * turn[i] * moment[j] for j in THREE] for i in THREE]
    for i in THREE:
        rows[i][i] = rows[i][i] + c[3] * md
    return moments, rows


def _cross_matrix(vector: Vector) -> Sequence[Vector]:
    """Return the matrix M (3 rows of 3) for which M b is the cross product of `vector` and any b."""
    x, y, z = vector
    return (0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)
