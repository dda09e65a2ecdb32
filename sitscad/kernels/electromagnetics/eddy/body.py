"""Response of the metal inside a target's surface: fields that diffuse through its whole volume.

Any thickness, conductivity and permeability is allowed.

Notes
-----
On the surface the tangential field is the gradient of a potential phi, because no current leaves the body. The normal
field through the surface is T phi in metal. In vacuum it would be S phi.

Seen from outside, the body is a jump of potential, (1/T - 1/S) T phi (Calderon's relations: Steinbach, Numerical
Approximation Methods for Elliptic Boundary Value Problems, 2008, chapter 6).

Inside, the field has two parts. The first is the gradient of the harmonic extension of phi. The second comes from the
currents and has no tangential component on the surface. In a box, each component of the second part is a series of
sines along two edges and cosines along the third. Each term decays independently. Its decay depends on lambda / g,
where lambda is the square of its wave number and g = j omega mu0 mu sigma. So

    T = mu (S - D),    D = sum over terms of g / (lambda + g) times the squared coefficient of grad phi.

The sum excludes terms that are gradients themselves, because gradients carry no current. The formula is exact for sines
and cosines. Here it is applied to splines with the same relations (`LineModes`; of the kind in Arnold, Falk and
Winther, Acta Numerica 15, 2006). A small error of the field changes T in second order only. Derived here.
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
    """Energies (m) inside a body for functions that are potentials on its surface.

    `vacuum` (n, n) is S, the energy if the body is vacuum. `within` returns D (2, n, n; real and imaginary part) for
    the squared wave number g (1/m2) in the metal.
    """

    vacuum: Array
    within: Callable[[complex], Array]

    def energy_difference(self, square: complex, permeability: float) -> Array:
        """Return S - T (2, n, n; m), the vacuum's energies minus the metal's, as real and imaginary part.

        `square` is g (1/m2), the squared wave number in the metal; `permeability` is relative.
        """
        difference = permeability * self.within(square)
        difference[0] += (1.0 - permeability) * self.vacuum
        return difference


CONSTANT = 1e-9
"""Stiffness of a function, divided by the stiffness of a straight line, below which the function counts as constant."""


def _is_constant(lines: Sequence[LineModes]) -> bool:
    """Whether the product of the last functions along all lines is a constant."""
    return all(line.stiffness * line.mass < CONSTANT for line in lines)


def _body_without_response(body: BodyEnergies, number: int) -> BodyEnergies:
    """Return a body (m) in which the constant function with the given number has no response and couples to no other.

    A constant potential has no gradient and so no field. Its energy in vacuum is set to the mean diagonal of S, so the
    matrices can be inverted.
    """
    vacuum = body.vacuum.copy()
    vacuum[number, number] = np.trace(vacuum) / len(vacuum)

    def within(square: complex) -> Array:
        response = body.within(square).copy()
        response[0, number, number] += vacuum[number, number]
        return response

    return BodyEnergies(vacuum, within)


KINDS = tuple(kind for kind in product((0, 1), repeat=3) if any(kind))
"""Kinds of surface functions of a box: for each axis, 1 if the factor along it is the end function, else 0.

The end function is 1 at the end of the axis, all others are 0 at the end. A triple with one 1 is a function of a face,
with two of an edge, with three of a corner.
"""

PAIRS = tuple((one, two) for k, one in enumerate(KINDS) for two in KINDS[k:])
"""All pairs of kinds of surface functions, each pair once."""


def surface_function_numbers(counts: Sequence[int]) -> Index:
    """Return a number for each product of functions along x, y and z; -1 if the product is zero on the box's surface.

    `counts` are the numbers of functions along x, y and z, and the shape of the result. The last function along each
    axis is the only function that is not 0 at the end of the axis.
    """
    number = np.full(counts, -1)
    is_outer = np.zeros(number.shape, dtype=bool)
    is_outer[-1], is_outer[:, -1], is_outer[:, :, -1] = True, True, True
    number[is_outer] = np.arange(np.count_nonzero(is_outer))
    return number


@record(eq=False)
class _Axis:
    """Integrals of the functions along one axis, as arrays that broadcast over all products of functions.

    The fields `squares` (1/m2), `ends` (m), `mass` (m) and `stiffness` (1/m) are explained at `LineModes`. The first
    three dimensions are the parities along x, y and z, the last three the functions along x, y and z. Dimensions of the
    other two axes have length 1. If a parity has fewer functions than the other, the array is padded.
    """

    squares: Array
    ends: Array
    mass: Array
    stiffness: Array

    @classmethod
    def from_modes(cls, modes: Mapping[int, LineModes], axis: int) -> _Axis:
        """Return the integrals (1/m2, m, m, 1/m) of both parities' functions along an axis (0 to 2 for x to z)."""
        parities = [modes[parity] for parity in PARITIES]
        count = max(line.squares.size for line in parities)

        def along(values: Sequence[Array | float], filling: float = 0.0) -> Array:
            filled = [np.append(row, np.full(count - row.size, filling)) for row in map(np.atleast_1d, values)]
            return np.array(filled).reshape([2 if k == axis else -1 if k == 3 + axis else 1 for k in range(6)])

        mass, stiffness = (
            np.array(values).reshape([2 if k == axis else 1 for k in range(6)])
            for values in ([line.mass for line in parities], [line.stiffness for line in parities])
        )
        squares, ends = along([line.squares for line in parities], 1.0), along([line.ends for line in parities])
        return cls(squares, ends, mass, stiffness)


@record(eq=False)
class _FieldDrive:
    """Squared coefficients (m) with which a pair of surface functions excites the fields inside the body.

    `amounts` has one coefficient for each field. `end_axes` are the axes along which both functions have the end
    function as factor; coefficients are summed over them. `level` maps each of these axes to the coefficients of fields
    that are constant along it.
    """

    end_axes: tuple[int, ...]
    amounts: Array
    level: Mapping[int, Array]

    def sum_fields(self, waves: Array, level: Sequence[Array]) -> Array:
        """Return D (m; real and imaginary part) for one pair of kinds of surface functions.

        `waves` are the factors g / (lambda + g) (no unit) of all fields. `level` has these factors for fields that are
        constant along x, along y and along z.
        """
        over = tuple(4 + axis for axis in self.end_axes)
        total = (self.amounts * waves).sum(axis=over, keepdims=True)
        for axis, amounts in self.level.items():
            total = total + (amounts * level[axis]).sum(axis=over, keepdims=True)
        return np.asarray(total)


@record(eq=False)
class _Entries:
    """Positions of pairs of functions in a symmetric matrix (`size`, `size`), as `rows` and `columns`.

    `functions` flags, among all pairs, the pairs with both functions in use.
    """

    size: int
    rows: Index
    columns: Index
    functions: Flags

    def fill_matrices(self, values: Array) -> Array:
        """Return symmetric matrices (n, size, size) from the values of all pairs of functions (n, pairs).

        The matrices have the unit of the values.
        """
        matrices = np.zeros((len(values), self.size, self.size))
        matrices[:, self.rows, self.columns] = matrices[:, self.columns, self.rows] = values[:, self.functions]
        return matrices


def box_bodies(lines: Sequence[Mapping[int, LineModes]], selections: Flags) -> list[BodyEnergies]:
    """Return the energies inside a box (m), one `BodyEnergies` for each parity along x, y and z.

    Parameters
    ----------
    lines : sequence of mapping of int to LineModes
            integrals of the functions along x, y and z, by parity (1, -1). Surface functions are products of functions
        along the axes.
    selections : array of bool
            flags (parities, functions) of the functions in use, in the numbers of `surface_function_numbers`. These
        numbers assume equal counts of odd and even functions along every axis.

    Returns
    -------
    One `BodyEnergies` (m) for each parity, in the order of `selections`.
    """
    axes = [_Axis.from_modes(line, axis) for axis, line in enumerate(lines)]
    number = surface_function_numbers([axis.squares.shape[3 + k] + 1 for k, axis in enumerate(axes)])
    total = axes[0].squares + axes[1].squares + axes[2].squares
    waves = {kind: sum((axes[k].squares for k in range(3) if not kind[k]), 0.0 * total) for kind in KINDS}
    vacuum, driven, pairs = [], [], []
    for first, second in PAIRS:
        shared = [a + b for a, b in zip(first, second, strict=True)]
        over = tuple(axis for axis in range(3) if shared[axis] == 2)
        size = _product([axes[k].ends ** shared[k] for k in range(3)])
        inward = waves[first] * waves[second] / total
        shared_waves = waves[tuple(int(count > 0) for count in shared)]
        vacuum.append(_gradient_product(axes, shared) - (size * inward).sum(axis=tuple(3 + axis for axis in over),
                                                                            keepdims=True))
        driven.append(_FieldDrive(over, size * (shared_waves - inward), {
            axis: axes[axis].stiffness * _product([axes[k].ends ** shared[k] for k in range(3) if k != axis])
            for axis in over
        }))
        of_kind = (number[tuple(slice(-1, None) if end else slice(-1) for end in kind)] for kind in (first, second))
        pairs.append(np.stack(np.broadcast_arrays(*of_kind)).reshape(2, -1))

    @lru_cache(maxsize=1)
    def answers(square: complex) -> Array:
        """Return D (m) of every pair for a g (1/m2): real and imaginary part, (2, parities, pairs)."""
        x, y, z = (axis.squares for axis in axes)
        answered = (_real_and_imaginary(np.asarray(square / (some + square))) for some in (total, y + z, x + z, x + y))
        to_waves, *to_level = answered
        sums = [each.sum_fields(to_waves, to_level).reshape(2, len(selections), -1) for each in driven]
        return np.concatenate(sums, axis=2)

    energies = np.concatenate([part.reshape(len(selections), -1) for part in vacuum], axis=1)
    bodies = [_parity_energies(k, each, energies[k], np.concatenate(pairs, axis=1), answers)
              for k, each in enumerate(selections)]
    if _is_constant([line[1] for line in lines]):
        bodies[0] = _body_without_response(bodies[0], -1)
    return bodies


def _parity_energies(
    number: int, selection: Flags, vacuum: Array, pairs: Index, answers: Callable[[complex], Array]
) -> BodyEnergies:
    """Return the energies (m) inside a box for the functions of one parity that `selection` flags.

    `number` is the parity's row in the results of `answers`. `vacuum` (m) and `answers` (m) are the energies S and D of
    all pairs of functions, and `pairs` (2, pairs) are their function numbers.
    """
    place, used = np.cumsum(selection) - 1, selection[pairs[0]] & selection[pairs[1]]
    rows, columns = place[pairs[:, used]]
    entries = _Entries(int(np.count_nonzero(selection)), rows, columns, used)
    return BodyEnergies(entries.fill_matrices(vacuum[None])[0],
                        lambda square: entries.fill_matrices(answers(square)[:, number]))


def _product(factors: Sequence[Array]) -> Array:
    """Return the product of arrays whose shapes broadcast together, in the product of their units."""
    result = factors[0]
    for factor in factors[1:]:
        result = result * factor
    return result


def _real_and_imaginary(values: ComplexArray) -> Array:
    """Return the real parts and the imaginary parts along a new first axis, in the unit of `values`."""
    return np.stack([values.real, values.imag])


def _gradient_product(axes: Sequence[_Axis], shared: Sequence[int]) -> Array:
    """Return the integral (m) over a box of the product of two functions' gradients.

    `shared` counts, for each axis, how many of the two functions have the end function as factor. With 2, the axis
    contributes one number. With 0 or 1, the result has a dimension for the axis, over the factors other than the end
    function.
    """
    total, masses = np.zeros((1,) * 6), np.ones((1,) * 6)
    for axis, count in zip(axes, shared, strict=True):
        mass = (np.ones_like(axis.squares), axis.ends, axis.mass)[count]
        slope = (axis.squares, 0.0 * axis.ends, axis.stiffness)[count]
        total, masses = total * mass + masses * slope, masses * mass
    return total


def disc_body(radial: LineModes, turning: tuple[Array, Array], wall: LineModes, around: float) -> BodyEnergies:
    """Return the energies (m) inside a disc for functions of one order m and one parity across the middle plane.

    Parameters
    ----------
    radial : LineModes
        integrals of the face's functions along the radius. The last function is 1 at the edge.
    turning : tuple[array, array]
            two arrays for currents that run along the faces with no potential in their plane: squared wave numbers
        (1/m2), and squared coefficients (no unit). With these coefficients, the last radial function drives the
        currents.
    wall : LineModes
        integrals of the wall's functions along the height. The last function continues the last radial function.
    around : float
        integral (rad) of the squared azimuthal function: 2 pi for order 0, pi for others.
    """
    inner, through = radial.squares[:, None], wall.squares[None]
    edge, count = inner.size, inner.size + 1 + through.size
    face, side = np.arange(edge), np.arange(edge + 1, count)
    out, up = radial.ends[:, None], wall.ends[None]
    total = inner + through
    face_to_face = inner * through / total
    vacuum = np.zeros((count, count))
    vacuum[face, face] = inner[:, 0] * wall.mass + wall.stiffness - (up**2 * inner**2 / total).sum(axis=1)
    vacuum[side, side] = through[0] * radial.mass + radial.stiffness - (out**2 * through**2 / total).sum(axis=0)
    vacuum[face[:, None], side] = -face_to_face * out * up
    vacuum[face, edge], vacuum[edge, side] = wall.stiffness * out[:, 0], radial.stiffness * up[0]
    vacuum = np.triu(vacuum) + np.triu(vacuum, 1).T
    vacuum[edge, edge] = radial.stiffness * wall.mass + wall.stiffness * radial.mass
    squares, driven = turning[0][:, None] + through, turning[1][:, None] + 0.0 * through
    steady = wall.stiffness + 0.0 * inner

    @lru_cache(maxsize=1)
    def within(square: complex) -> Array:
        """Return D (m) for a g (1/m2): real and imaginary part."""
        response = np.zeros((count, count), dtype=complex)
        waves, level, turned = (square / (scale + square) for scale in (total, inner, squares))
        response[face, face] = (face_to_face * up**2 * waves).sum(axis=1) + (steady * level)[:, 0]
        response[side, side] = (face_to_face * out**2 * waves).sum(axis=0) + (driven * turned).sum(axis=0)
        response[face[:, None], side] = -face_to_face * out * up * waves
        response[face, edge] = (steady * out * level)[:, 0]
        response[edge, side] = (driven * up * turned).sum(axis=0)
        response = response + np.triu(response, 1).T
        response[edge, edge] = (steady * out**2 * level).sum() + (driven * up**2 * turned).sum()
        return around * _real_and_imaginary(response)

    body = BodyEnergies(around * vacuum, within)
    return _body_without_response(body, edge) if _is_constant((radial, wall)) else body
