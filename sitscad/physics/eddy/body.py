"""What the metal within a target's surface does: fields that diffuse through its whole volume, of any thickness,
conductivity and permeability.

On the surface the field along it is the slope of a potential phi (no current leaves the body), which the body answers
with a field T phi through the surface; vacuum in its place would with S phi. The jump of potential that stands for the
body, seen from outside, is (1/T - 1/S) T phi (Calderon's relations: Steinbach, Numerical Approximation Methods for
Elliptic Boundary Value Problems, 2008, chapter 6). Within, the field is the slope of phi carried on harmonically and
what the currents add, which has nothing along the surface. In a box that is sines along two edges and cosines along the
third for each component; every one of them decays by itself, with the square of its wave number lambda against g = j
omega mu0 mu sigma, so that

    T = mu (S - D),    D = the sum of g / (lambda + g) times the square of what phi's slope has of it,

without what is itself a slope of something, for that is no current. With sines and cosines that is exact; those used
are splines with the same relations (`LineModes`; of the kind in Arnold, Falk and Winther, Acta Numerica 15, 2006), and
T is stationary about the true field. Derived here.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from sitscad.arrays import Array, ComplexArray, Flags, Index
from sitscad.physics.eddy.graded_line import LineModes
from sitscad.record import record

Sums = tuple[Index, Index, Array, Array, tuple[int, ...]]
"""Entries of D: rows and columns; amounts (m) and squares (1/m2) of their waves, to be summed over the axes."""


@record(eq=False)
class Body:
    """Energies (m) of a body's surface functions: `vacuum` (n, n) as potentials of vacuum within, S; and D. Its entries
    at `rows` and `columns`, and mirrored, are the sums of all terms from `starts` on: `amounts` (m) of waves with their
    `squares` (1/m2).
    """

    vacuum: Array
    rows: Index
    columns: Index
    starts: Index
    amounts: Array
    squares: Array

    def jump(self, square: complex, permeability: float) -> ComplexArray:
        """S - T (n, n; m), for g = `square` (1/m2) and a relative permeability."""
        found = np.zeros(self.vacuum.shape, dtype=complex)
        if len(self.starts):
            values = np.add.reduceat(self.amounts * (square / (self.squares + square)), self.starts)
            np.add.at(found, (self.rows, self.columns), values)
            beside = self.rows != self.columns
            np.add.at(found, (self.columns[beside], self.rows[beside]), values[beside])
        return np.asarray(permeability * found + (1.0 - permeability) * self.vacuum, dtype=complex)


def _body(vacuum: Array, sums: Sequence[Sums], kept: Flags, around: float = 1.0) -> Body:
    """The body of those functions (n,) that are kept, energies (m) times what the azimuth makes of them."""
    rows, columns, counts, amounts, squares = [], [], [], [], []
    for row, column, amount, square, axes in sums:
        last = tuple(range(-len(axes), 0))
        shape = np.broadcast_shapes(row.shape, column.shape)
        rows.append(np.broadcast_to(row, shape).ravel())
        columns.append(np.broadcast_to(column, shape).ravel())
        counts.append(np.full(rows[-1].size, amount.size // max(rows[-1].size, 1)))
        amounts.append(np.moveaxis(amount, axes, last).ravel())
        squares.append(np.moveaxis(np.broadcast_to(square, amount.shape), axes, last).ravel())
    row, column, count, amount, square = (np.concatenate(part) for part in (rows, columns, counts, amounts, squares))
    is_kept = kept[row] & kept[column] & (count > 0)
    terms, number = np.repeat(is_kept, count), np.cumsum(kept) - 1
    count = count[is_kept]
    return Body(around * vacuum[np.ix_(kept, kept)], number[row[is_kept]], number[column[is_kept]],
                np.cumsum(count) - count, around * amount[terms], square[terms])


KINDS = tuple(kind for kind in product((0, 1), repeat=3) if any(kind))
"""Functions of a box's surface by the axes along which they are those of the ends: of faces, edges and corners."""


def on_surface(lines: Sequence[LineModes]) -> Index:
    """Numbers of products of functions along x, y and z that are not 0 on a box's surface, -1 of others: no unit."""
    number = np.full([len(line.squares) + 1 for line in lines], -1)
    kept = np.zeros(number.shape, dtype=bool)
    kept[-1], kept[:, -1], kept[:, :, -1] = True, True, True
    number[kept] = np.arange(np.count_nonzero(kept))
    return number


def box_body(lines: Sequence[LineModes], kept: Flags) -> Body:
    """A box whose functions are products of those along x, y and z, of those numbered by `on_surface` the `kept`."""
    number = on_surface(lines)
    squares = [_along(line.squares, axis) for axis, line in enumerate(lines)]
    ends = [(1.0, _along(line.ends, axis), _along(line.ends**2, axis)) for axis, line in enumerate(lines)]
    total = squares[0] + squares[1] + squares[2]
    level = [(total - squares[axis]).take([0], axis) if total.size else total for axis in range(3)]
    waves = {kind: sum((squares[axis] for axis in range(3) if not kind[axis]), 0.0 * total) for kind in KINDS}
    vacuum, sums = np.zeros((kept.size, kept.size)), []
    for one, first in enumerate(KINDS):
        for second in KINDS[one:]:
            shared = [a + b for a, b in zip(first, second, strict=True)]
            axes = tuple(axis for axis in range(3) if shared[axis] == 2)
            rows, columns = (_numbers(number, kind, axes) for kind in (first, second))
            size = np.ones((1, 1, 1))
            for axis in range(3):
                size = size * ends[axis][shared[axis]]
            inward = waves[first] * waves[second] / total
            both = waves[tuple(int(count > 0) for count in shared)]
            vacuum[rows, columns] = _own(lines, shared).squeeze(axes) - (size * inward).sum(axis=axes)
            vacuum[columns, rows] = vacuum[rows, columns]
            sums.append((rows, columns, size * (both - inward), total, axes))
            for axis in axes:
                # no wave along the axis
                if lines[axis].stiffness > CONSTANT / lines[axis].mass:
                    amounts = lines[axis].stiffness * np.ones_like(level[axis])
                    for k in range(3):
                        amounts = amounts if k == axis else amounts * ends[k][shared[k]]
                    sums.append((rows, columns, amounts, level[axis], axes))
    if all(line.stiffness * line.mass < CONSTANT for line in lines):
        sums.append(_unfelt(vacuum, kept.size - 1))
    return _body(vacuum, sums, kept)


CONSTANT = 1e-9
"""Stiffness, in parts of what a straight line has, below which a function is a constant."""


def _unfelt(vacuum: Array, number: int) -> Sums:
    """What keeps a constant function, which is no field, from every other (m): the body answers it with nothing."""
    vacuum[number, number] = np.trace(vacuum) / len(vacuum)
    at = np.array([number])
    return at, at, vacuum[number, number].reshape(1, 1), np.zeros((1, 1)), (1,)


def _along(values: Array, axis: int) -> Array:
    """Values (n,; in their unit) along one of three axes."""
    return values.reshape([-1 if k == axis else 1 for k in range(3)])


def _numbers(number: Index, kind: Sequence[int], axes: tuple[int, ...]) -> Index:
    """Numbers (no unit) of the functions of a kind by the waves that they are of, without the axes summed over."""
    found = number[tuple(slice(-1, None) if at_end else slice(-1) for at_end in kind)]
    return found.squeeze(axes)


def _own(lines: Sequence[LineModes], shared: Sequence[int]) -> Array:
    """The integral (m) of the product of the slopes of two functions, `shared` being how many of both are those of the
    end along each axis: where both are, over that axis; elsewhere by the place of the one that is not.
    """
    total, masses = np.zeros((1, 1, 1)), np.ones((1, 1, 1))
    for axis, (line, count) in enumerate(zip(lines, shared, strict=True)):
        mass = _along((np.ones_like(line.squares), line.ends, np.array([line.mass]))[count], axis)
        slope = _along((line.squares, 0.0 * line.ends, np.array([line.stiffness]))[count], axis)
        total, masses = total * mass + masses * slope, masses * mass
    return total


def disc_body(radial: LineModes, turning: tuple[Array, Array], wall: LineModes, around: float) -> Body:
    """A disc's functions of one order round the axis and one parity across it, integrated `around` (rad): those of the
    face, of which the last is 1 at the edge, and those of the `wall` without that. `turning` are currents that run
    along the faces with no potential in their plane: their squares (1/m2), and the squares (no unit) of what the last
    radial function drives of them.
    """
    inner, through = radial.squares[:, None], wall.squares[None]
    edge, count = inner.size, inner.size + 1 + through.size
    face, side, rim = np.arange(edge), np.arange(edge + 1, count), np.array([edge])
    out, up = radial.ends[:, None], wall.ends[None]
    total = inner + through
    both = inner * through / total
    vacuum = np.zeros((count, count))
    vacuum[face, face] = inner[:, 0] * wall.mass + wall.stiffness - (up**2 * inner**2 / total).sum(axis=1)
    vacuum[side, side] = through[0] * radial.mass + radial.stiffness - (out**2 * through**2 / total).sum(axis=0)
    vacuum[face[:, None], side] = -both * out * up
    vacuum[face, edge], vacuum[edge, side] = wall.stiffness * out[:, 0], radial.stiffness * up[0]
    vacuum = np.triu(vacuum) + np.triu(vacuum, 1).T
    vacuum[edge, edge] = radial.stiffness * wall.mass + wall.stiffness * radial.mass
    squares, driven = turning[0][:, None] + through, turning[1][:, None] + 0.0 * through
    steady = wall.stiffness + 0.0 * inner
    sums: list[Sums] = [
        (face, face, both * up**2, total, (1,)),
        (side, side, both * out**2, total, (0,)),
        (face[:, None], side, -both * out * up, total, ()),
        (face, face, steady, inner, (1,)),
        (face, rim, steady * out, inner, (1,)),
        (rim, rim, steady * out**2, inner, (0, 1)),
        (side, side, driven, squares, (0,)),
        (side, rim, driven * up, squares, (0,)),
        (rim, rim, driven * up**2, squares, (0, 1)),
    ]
    if all(line.stiffness * line.mass < CONSTANT for line in (radial, wall)):
        sums.append(_unfelt(vacuum, edge))
    return _body(vacuum, sums, np.ones(count, dtype=bool), around)
