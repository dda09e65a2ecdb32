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

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import product

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray, Flags, Index
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.eddy.graded_line import PARITIES, LineModes


@record(eq=False)
class BodyEnergies:
    """Energies (m) of a body's surface functions: `vacuum` (n, n) as potentials of vacuum within, S; and D `within` for
    a g (1/m2), real and imaginary part, (2, n, n).
    """

    vacuum: Array
    within: Callable[[complex], Array]

    def jump(self, square: complex, permeability: float) -> Array:
        """S - T for g = `square` (1/m2) and a relative permeability: real and imaginary part, (2, n, n; m)."""
        found = permeability * self.within(square)
        found[0] += (1.0 - permeability) * self.vacuum
        return found


CONSTANT = 1e-9
"""Stiffness, in parts of what a straight line has, below which a function is a constant."""


def _is_constant(lines: Sequence[LineModes]) -> bool:
    """Whether the product of the lines' last functions is a constant."""
    return all(line.stiffness * line.mass < CONSTANT for line in lines)


def _unfelt(body: BodyEnergies, number: int) -> BodyEnergies:
    """The body that answers one function, a constant, with nothing: no field, and kept from every other (m)."""
    vacuum = body.vacuum.copy()
    vacuum[number, number] = np.trace(vacuum) / len(vacuum)

    def within(square: complex) -> Array:
        found = body.within(square).copy()
        found[0, number, number] += vacuum[number, number]
        return found

    return BodyEnergies(vacuum, within)


KINDS = tuple(kind for kind in product((0, 1), repeat=3) if any(kind))
"""Functions of a box's surface by the axes along which they are those of the ends: of faces, edges and corners."""

PAIRS = tuple((one, two) for k, one in enumerate(KINDS) for two in KINDS[k:])
"""Every two kinds once."""


def on_surface(counts: Sequence[int]) -> Index:
    """Numbers of products of so many functions along x, y and z that are not 0 on a box's surface, for the last along
    each is not 0 at its end; -1 of others: no unit.
    """
    number = np.full(counts, -1)
    kept = np.zeros(number.shape, dtype=bool)
    kept[-1], kept[:, -1], kept[:, :, -1] = True, True, True
    number[kept] = np.arange(np.count_nonzero(kept))
    return number


@record(eq=False)
class _Axis:
    # What functions along an axis are to each other (`LineModes`): by parities along x, y and z, then by functions
    # along these, of length 1 but for its own axis. Where fewer are odd than even, they are filled up.
    squares: Array
    ends: Array
    mass: Array
    stiffness: Array

    @classmethod
    def of(cls, modes: Mapping[int, LineModes], axis: int) -> _Axis:
        """Those (1/m2, m, m, 1/m) of both parities along an axis."""
        both = [modes[parity] for parity in PARITIES]
        count = max(one.squares.size for one in both)

        def along(values: Sequence[Array | float], filling: float = 0.0) -> Array:
            filled = [np.append(one, np.full(count - one.size, filling)) for one in map(np.atleast_1d, values)]
            return np.array(filled).reshape([2 if k == axis else -1 if k == 3 + axis else 1 for k in range(6)])

        mass, stiffness = (
            np.array(values).reshape([2 if k == axis else 1 for k in range(6)])
            for values in ([one.mass for one in both], [one.stiffness for one in both])
        )
        return cls(along([one.squares for one in both], 1.0), along([one.ends for one in both]), mass, stiffness)


@record(eq=False)
class _Driven:
    # What two kinds of functions drive within (m): amounts by wave, to be summed `over` some axes, and of what has no
    # wave along one of these by that.
    over: tuple[int, ...]
    amounts: Array
    level: Mapping[int, Array]

    def summed(self, waves: Array, level: Sequence[Array]) -> Array:
        """D (m) by what waves and those with none along each axis are answered with (no unit): real and imaginary."""
        over = tuple(4 + axis for axis in self.over)
        found = (self.amounts * waves).sum(axis=over, keepdims=True)
        for axis, amounts in self.level.items():
            found = found + (amounts * level[axis]).sum(axis=over, keepdims=True)
        return np.asarray(found)


@record(eq=False)
class _Entries:
    # Where values of pairs that are `used` stand in the matrix of a parity's functions.
    size: int
    rows: Index
    columns: Index
    used: Flags

    def filled(self, values: Array) -> Array:
        """The symmetric matrices (n, size, size) of values (n, pairs), in their unit."""
        found = np.zeros((len(values), self.size, self.size))
        found[:, self.rows, self.columns] = found[:, self.columns, self.rows] = values[:, self.used]
        return found


def box_bodies(lines: Sequence[Mapping[int, LineModes]], kept: Flags) -> list[BodyEnergies]:
    """Boxes of every parity along x, y and z, whose functions are products of those along these by parity. Each has
    those `kept` (parities, functions) of all that `on_surface` numbers, if along every axis as many were odd as are
    even.
    """
    axes = [_Axis.of(line, axis) for axis, line in enumerate(lines)]
    number = on_surface([axis.squares.shape[3 + k] + 1 for k, axis in enumerate(axes)])
    total = axes[0].squares + axes[1].squares + axes[2].squares
    waves = {kind: sum((axes[k].squares for k in range(3) if not kind[k]), 0.0 * total) for kind in KINDS}
    vacuum, driven, pairs = [], [], []
    for first, second in PAIRS:
        shared = [a + b for a, b in zip(first, second, strict=True)]
        over = tuple(axis for axis in range(3) if shared[axis] == 2)
        size = _product([axes[k].ends ** shared[k] for k in range(3)])
        inward = waves[first] * waves[second] / total
        both = waves[tuple(int(count > 0) for count in shared)]
        vacuum.append(_own(axes, shared) - (size * inward).sum(axis=tuple(3 + axis for axis in over), keepdims=True))
        driven.append(_Driven(over, size * (both - inward), {
            axis: axes[axis].stiffness * _product([axes[k].ends ** shared[k] for k in range(3) if k != axis])
            for axis in over
        }))
        of_kind = (number[tuple(slice(-1, None) if end else slice(-1) for end in kind)] for kind in (first, second))
        pairs.append(np.stack(np.broadcast_arrays(*of_kind)).reshape(2, -1))

    @lru_cache(maxsize=1)
    def answers(square: complex) -> Array:
        """D (m) of every pair for a g (1/m2): real and imaginary part, (2, parities, pairs)."""
        x, y, z = (axis.squares for axis in axes)
        answered = (_parts(np.asarray(square / (some + square))) for some in (total, y + z, x + z, x + y))
        to_waves, *to_level = answered
        return np.concatenate([one.summed(to_waves, to_level).reshape(2, len(kept), -1) for one in driven], axis=2)

    own = np.concatenate([part.reshape(len(kept), -1) for part in vacuum], axis=1)
    bodies = [_of_parity(k, one, own[k], np.concatenate(pairs, axis=1), answers) for k, one in enumerate(kept)]
    if _is_constant([line[1] for line in lines]):
        bodies[0] = _unfelt(bodies[0], -1)
    return bodies


def _of_parity(
    number: int, kept: Flags, vacuum: Array, pairs: Index, answers: Callable[[complex], Array]
) -> BodyEnergies:
    """The body of one parity's kept functions, by energies and answers (m) of pairs of functions."""
    place, used = np.cumsum(kept) - 1, kept[pairs[0]] & kept[pairs[1]]
    rows, columns = place[pairs[:, used]]
    entries = _Entries(int(np.count_nonzero(kept)), rows, columns, used)
    return BodyEnergies(entries.filled(vacuum[None])[0], lambda square: entries.filled(answers(square)[:, number]))


def _product(factors: Sequence[Array]) -> Array:
    """The product of arrays, in that of their units."""
    found = factors[0]
    for one in factors[1:]:
        found = found * one
    return found


def _parts(values: ComplexArray) -> Array:
    """Real and imaginary parts along a first axis, in the values' unit."""
    return np.stack([values.real, values.imag])


def _own(axes: Sequence[_Axis], shared: Sequence[int]) -> Array:
    """The integral (m) of the product of the slopes of two functions, `shared` being how many of both are those of the
    end along each axis: where both are, over that axis; elsewhere by the place of the one that is not.
    """
    total, masses = np.zeros((1,) * 6), np.ones((1,) * 6)
    for axis, count in zip(axes, shared, strict=True):
        mass = (np.ones_like(axis.squares), axis.ends, axis.mass)[count]
        slope = (axis.squares, 0.0 * axis.ends, axis.stiffness)[count]
        total, masses = total * mass + masses * slope, masses * mass
    return total


def disc_body(radial: LineModes, turning: tuple[Array, Array], wall: LineModes, around: float) -> BodyEnergies:
    """A disc's functions of one order round the axis and one parity across it, integrated `around` (rad): those of the
    face, of which the last is 1 at the edge, and those of the `wall` without that. `turning` are currents that run
    along the faces with no potential in their plane: their squares (1/m2), and the squares (no unit) of what the last
    radial function drives of them.
    """
    inner, through = radial.squares[:, None], wall.squares[None]
    edge, count = inner.size, inner.size + 1 + through.size
    face, side = np.arange(edge), np.arange(edge + 1, count)
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

    @lru_cache(maxsize=1)
    def within(square: complex) -> Array:
        """D (m) for a g (1/m2), of both phases: real and imaginary part."""
        found = np.zeros((count, count), dtype=complex)
        waves, level, turned = (square / (one + square) for one in (total, inner, squares))
        found[face, face] = (both * up**2 * waves).sum(axis=1) + (steady * level)[:, 0]
        found[side, side] = (both * out**2 * waves).sum(axis=0) + (driven * turned).sum(axis=0)
        found[face[:, None], side] = -both * out * up * waves
        found[face, edge] = (steady * out * level)[:, 0]
        found[edge, side] = (driven * up * turned).sum(axis=0)
        found = found + np.triu(found, 1).T
        found[edge, edge] = (steady * out**2 * level).sum() + (driven * up**2 * turned).sum()
        return around * _parts(found)

    body = BodyEnergies(around * vacuum, within)
    return _unfelt(body, edge) if _is_constant((radial, wall)) else body
