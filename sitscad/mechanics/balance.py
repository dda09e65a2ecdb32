"""What a loaded plate on a pad lacks to its balance, and how that changes as it moves: both in closed form.

The unknowns are the plate's place in the frame of `motion` and its rotation vector. There the pad's energy is a plain
sum, and the work of a force that keeps its direction is Rodrigues' formula: f R(t) p = c0 f.p + c1 t.(p x f) +
c2 (f.t)(p.t), with the even functions c_k(t^2) = sum of (-t^2)^j / (2j + k)!, of which 2 c_k' = k c_(k+2) - c_(k+1)
(Stumpff's functions; textbook). Every number is a float, of one load, or an array over loads: of a single one floats
take a third of the time. Lengths in thicknesses, forces in shear moduli times the loaded area; moments in both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Number: TypeAlias = Any
"""A float, or an array (n,)."""

Vector: TypeAlias = Sequence[Number]
Rows: TypeAlias = list[list[Number]]

SMALL, LARGE = 0.25, 10.0
"""Squares of a turn's angle up to which the series have `FEW` and all `TERMS`: within rounding of either."""

FEW, TERMS = 7, 13

THREE, PAIRS = range(3), ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


class Law(NamedTuple):
    """A pad's law at one compression: pressure and its slope by the strain; the five courses of `courses.Courses` with
    their first and second slopes; the stiffness of twist. No units.
    """

    pressure: Number
    pressed: Number
    values: Sequence[Number]
    slopes: Sequence[Number]
    bends: Sequence[Number]
    twist: float


class Load(NamedTuple):
    """A force that keeps its direction, where it acts on the plate (from the middle of its near face, in the plate's
    own axes), and a moment about that point; in board axes but for the point.
    """

    force: Vector
    point: Vector
    moment: Vector
    is_moment: bool


def evens(square: Number, largest: float) -> tuple[Number, ...]:
    """c_0 to c_6 of a square of an angle (rad2), the largest of which is given: no unit."""
    five = six = 1.0
    for j in range(FEW if largest <= SMALL else TERMS, 0, -1):
        k = 2 * j
        five = 1.0 - square * five / ((k + 4) * (k + 5))
        six = 1.0 - square * six / ((k + 5) * (k + 6))
    five, six = five / 120.0, six / 720.0
    four, three = 1.0 / 24.0 - square * six, 1.0 / 6.0 - square * five
    two, one = 0.5 - square * four, 1.0 - square * three
    return 1.0 - square * two, one, two, three, four, five, six


def balance(
    law: Law, share: float, place: Vector, turn: Vector, load: Load, largest: float
) -> tuple[list[Number], Rows]:
    """What is lacking, by place and by rotation vector (six numbers), and its slopes by both (six rows of six).

    The frame is turned by `share` of the plate's turn, whose largest squared angle (rad2) is given.
    """
    lack, rows = _held(law, place, turn)
    square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
    frame = evens(share * share * square, share * share * largest)
    plate = evens(square, largest)
    carried, carrying = _carried(load.force, share, turn, frame)
    works = [_work(load.force, place, share, turn, frame), _work(load.force, load.point, 1.0, turn, plate)]
    # no -= here: of arrays several entries are one
    for i in THREE:
        lack[i] = lack[i] - carried[i]
        lack[3 + i] = lack[3 + i] - works[0][0][i] - works[1][0][i]
        for j in THREE:
            rows[i][3 + j] = rows[3 + j][i] = rows[i][3 + j] - carrying[i][j]
            rows[3 + i][3 + j] = rows[3 + i][3 + j] - works[0][1][i][j] - works[1][1][i][j]
    if load.is_moment:
        turned, turning = _turned(load.moment, turn, plate)
        for i in THREE:
            lack[3 + i] = lack[3 + i] - turned[i]
            for j in THREE:
                rows[3 + i][3 + j] = rows[3 + i][3 + j] - turning[i][j]
    return lack, rows


def _held(law: Law, place: Vector, turn: Vector) -> tuple[list[Number], Rows]:
    """Slopes and second slopes of the pad's energy."""
    (x, y, _), (a, b, c) = place, turn
    along, across, cubic, tilt_x, tilt_y = law.values
    along_1, across_1, cubic_1, tilt_x_1, tilt_y_1 = law.slopes
    along_2, across_2, cubic_2, tilt_x_2, tilt_y_2 = law.bends
    xx, yy, aa, bb = x * x, y * y, a * a, b * b
    both = xx + yy
    hardened, fourth, none = cubic * both, 0.25 * both * both, 0.0 * x
    coupled = 0.5 * (along_1 * xx + across_1 * yy + tilt_x_1 * aa + tilt_y_1 * bb)
    bent = 0.5 * (along_2 * xx + across_2 * yy + tilt_x_2 * aa + tilt_y_2 * bb)
    xy, zx, zy = 2.0 * cubic * x * y, -(along_1 + cubic_1 * both) * x, -(across_1 + cubic_1 * both) * y
    za, zb = -tilt_x_1 * a, -tilt_y_1 * b
    lack = [(along + hardened) * x, (across + hardened) * y, -(law.pressure + cubic_1 * fourth + coupled), tilt_x * a,
            tilt_y * b, law.twist * c]  # fmt: skip
    return lack, [
        [along + hardened + 2.0 * cubic * xx, xy, zx, none, none, none],
        [xy, across + hardened + 2.0 * cubic * yy, zy, none, none, none],
        [zx, zy, law.pressed + cubic_2 * fourth + bent, za, zb, none],
        [none, none, za, tilt_x + none, none, none],
        [none, none, zb, none, tilt_y + none, none],
        [none, none, none, none, none, law.twist + none],
    ]


def _dot(one: Vector, other: Vector) -> Number:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _cross(one: Vector, other: Vector) -> Vector:
    (a, b, c), (x, y, z) = one, other
    return b * z - c * y, c * x - a * z, a * y - b * x


def _work(force: Vector, arm: Vector, share: float, turn: Vector, c: tuple[Number, ...]) -> tuple[Vector, Rows]:
    """Slopes and second slopes, by the rotation vector, of a force's work at an arm that turns by a share of it."""
    squared, odd, fd, ad = share * share, _cross(arm, force), _dot(force, turn), _dot(arm, turn)
    still, across, along = _dot(force, arm), share * _dot(odd, turn), squared * fd * ad
    one, two = 0.5 * (c[3] - c[2]), c[4] - 0.5 * c[3]
    first = 2.0 * squared * (one * across + two * along - 0.5 * c[1] * still)
    one_2, two_2 = 0.75 * (c[5] - c[4]) + 0.25 * c[3], 2.0 * c[6] - 1.25 * c[5] + 0.25 * c[4]
    second = 4.0 * squared * squared * (one_2 * across + two_2 * along - 0.5 * one * still)
    lean = [squared * (fd * arm[i] + ad * force[i]) for i in THREE]
    grown = [2.0 * squared * (one * share * odd[i] + two * lean[i]) for i in THREE]
    slopes = [first * turn[i] + c[1] * share * odd[i] + c[2] * lean[i] for i in THREE]
    rows: Rows = [[0.0, 0.0, 0.0] for _ in THREE]
    both = c[2] * squared
    for i, j in PAIRS:
        rows[i][j] = rows[j][i] = (
            second * turn[i] * turn[j] + turn[i] * grown[j] + turn[j] * grown[i]
            + both * (force[i] * arm[j] + force[j] * arm[i])
        )  # fmt: skip
    for i in THREE:
        rows[i][i] = rows[i][i] + first
    return slopes, rows


def _carried(force: Vector, share: float, turn: Vector, c: tuple[Number, ...]) -> tuple[Vector, Rows]:
    """A force in the axes that are turned by a share of the rotation vector, and its slopes by that."""
    squared, fd, odd = share * share, _dot(force, turn), _cross(turn, force)
    one, two = 0.5 * (c[3] - c[2]), c[4] - 0.5 * c[3]
    found = [c[0] * force[i] - c[1] * share * odd[i] + c[2] * squared * fd * turn[i] for i in THREE]
    grown = [2.0 * squared * (-0.5 * c[1] * force[i] - one * share * odd[i] + two * squared * fd * turn[i])
             for i in THREE]  # fmt: skip
    spun, both = _spun(force), c[2] * squared
    rows: Rows = [
        [grown[i] * turn[j] + c[1] * share * spun[i][j] + both * turn[i] * force[j] for j in THREE] for i in THREE
    ]
    for i in THREE:
        rows[i][i] = rows[i][i] + both * fd
    return found, rows


def _turned(moment: Vector, turn: Vector, c: tuple[Number, ...]) -> tuple[Vector, Rows]:
    """What a moment does along the rotation vector, by the left Jacobian of rotations, and its slopes by that."""
    md, odd, square = _dot(moment, turn), _cross(turn, moment), _dot(turn, turn)
    two, three = c[4] - 0.5 * c[3], 1.5 * c[5] - 0.5 * c[4]
    flat = [turn[i] * md - moment[i] * square for i in THREE]
    found = [moment[i] - c[2] * odd[i] + c[3] * flat[i] for i in THREE]
    grown = [2.0 * (three * flat[i] - two * odd[i]) - 2.0 * c[3] * moment[i] for i in THREE]
    spun = _spun(moment)
    rows: Rows = [[grown[i] * turn[j] + c[2] * spun[i][j] + c[3] * turn[i] * moment[j] for j in THREE] for i in THREE]
    for i in THREE:
        rows[i][i] = rows[i][i] + c[3] * md
    return found, rows


def _spun(vector: Vector) -> Sequence[Vector]:
    """The matrix that takes another vector to its cross product with this one."""
    x, y, z = vector
    return (0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)
