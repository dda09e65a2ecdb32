"""Polynomials through values at Chebyshev's points, and sums of products of several variables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.basics.arrays import Array, slices
from sitscad.basics.record import record

Exponents = NDArray[np.int64]

POINTS_A_TERM = 1.5
"""Points for each term of a polynomial that is fitted by least squares: of fewer it swings between them."""

PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
"""Bases of Halton's sequence."""

AT_ONCE = 2000
"""Places at which a polynomial of several variables is evaluated together: so few that what it takes stays in cache."""


@lru_cache(maxsize=64)
def _roots(count: int) -> tuple[Array, Array]:
    """Roots (count,) of the Chebyshev polynomial of an order, rising, and the weights (count,) of the barycentric
    formula there, no unit: (-1)^j sin(angle of the root) (Berrut and Trefethen, SIAM Review 46, 2004).
    """
    angle = math.pi * (np.arange(count) + 0.5) / count
    return -np.cos(angle), np.where(np.arange(count) % 2, -1.0, 1.0) * np.sin(angle)


def chebyshev_points(low: float, high: float, count: int) -> Array:
    """Chebyshev's points (count,) of the first kind between two ends, rising and in their unit (Abramowitz and Stegun
    22.16).
    """
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * _roots(count)[0])


def shares(points: Array, at: Array, weights: Array | None = None) -> Array:
    """What values at points weigh in the polynomial through them at (n,) places, (n, points): the barycentric formula
    (Berrut and Trefethen, SIAM Review 46, 2004), of Chebyshev's points unless other `weights` (points) are given.
    """
    away = at[:, None] - points
    away[away == 0.0] = 1e-300  # at a point its own weight outweighs all others
    each = (_roots(points.size)[1] if weights is None else weights) / away
    return np.asarray(each / each.sum(axis=1)[:, None])


def node_counts(half: Sequence[float], longest: float, order: int, apart: float) -> tuple[int, ...]:
    """Numbers of Chebyshev's points along half sides (m) of a box, `order` along the `longest` (m). Along shorter sides
    fewer are as good: the error falls like rho^-n with ln rho = acosh(1 + d), d being the distance in half sides of
    what sees them (Trefethen, Approximation Theory and Approximation Practice, 2013, chapter 8), `apart` times the
    longest at least.
    """
    rate = math.acosh(1.0 + apart)
    ways = (apart * longest / max(side, 1e-9 * longest) for side in half)
    return tuple(math.ceil(order * rate / math.acosh(1.0 + way)) for way in ways)


def evaluated(tensor: NDArray[Any], grid: Sequence[Array], places: Array) -> NDArray[Any]:
    """Polynomials in several variables at (n, axes) places, (n, ...): the product of those along each axis through a
    `tensor` of values, (points of each axis of the `grid` ..., what is one value); in the unit of the values. By
    `shares`.
    """
    weights = [shares(points, places[:, axis]) for axis, points in enumerate(grid)]
    found = np.empty((len(places), *tensor.shape[len(grid):]), dtype=tensor.dtype)
    for some in slices(len(places), AT_ONCE):
        part = np.tensordot(weights[0][some], tensor, axes=(1, 0))
        for weight in weights[1:]:
            part = np.einsum("ni,ni...->n...", weight[some], part)
        found[some] = part
    return found


@record(eq=False)
class Interpolant:
    """A function charted in a box by polynomials through its `values` (points along every variable, and what is one
    value there) at all products of Chebyshev's points between the ends `low` and `high` (variables).
    """

    low: Array
    high: Array
    values: NDArray[Any]

    @cached_property
    def grid(self) -> tuple[Array, ...]:
        """Chebyshev's points of every variable, rising."""
        ends = zip(self.low, self.high, self.values.shape, strict=False)
        return tuple(chebyshev_points(low, high, count) for low, high, count in ends)

    def __call__(self, places: Array) -> NDArray[Any]:
        """Values (n, ...) at (n, variables) places; beyond the ends what they are there."""
        return evaluated(self.values, self.grid, np.clip(places, self.low, self.high))


def exponents(weights: Sequence[float], degree: float, least: int = 0) -> Exponents:
    """Exponents (terms, variables), no unit, of all products whose weighted degree is at most `degree`, and whose plain
    one is at least `least`; low ones first.
    """
    each = [range(int(degree / weight + 1e-9) + 1) for weight in weights]
    found = [row for row in product(*each) if np.dot(row, weights) <= degree + 1e-9 and sum(row) >= least]
    return np.array(sorted(found, key=lambda row: (sum(row), tuple(-k for k in row))), dtype=np.int64).reshape(
        -1, len(weights)
    )


def monomials(points: Array, powers: Exponents) -> Array:
    """Values (n, terms) of products of powers at (n, variables) points; no unit."""
    found = np.ones((len(points), len(powers)))
    for k in range(points.shape[1]):
        highest = int(powers[:, k].max(initial=0))
        found *= (points[:, k : k + 1] ** np.arange(highest + 1))[:, powers[:, k]]
    return found


def chebyshev(points: Array, orders: Exponents) -> Array:
    """Values (n, terms) of products of Chebyshev's polynomials at (n, variables) points, no unit: T_n(cos t) = cos(n t)
    (Abramowitz and Stegun 22.3.15). Beyond -1 and 1 each polynomial goes on straight, by its slope at that end.
    """
    # T_n(x) = cos(n arccos x), which keeps its digits at orders where sums of powers cancel; T_n' is n^2 at 1
    inside = np.clip(points, -1.0, 1.0)
    angles, beyond = np.arccos(inside), points - inside
    found = np.ones((len(points), len(orders)))
    for k in range(points.shape[1]):
        order = np.arange(int(orders[:, k].max(initial=0)) + 1)
        slope = np.sign(inside[:, k : k + 1]) ** (order + 1) * order**2
        found *= (np.cos(angles[:, k : k + 1] * order) + beyond[:, k : k + 1] * slope)[:, orders[:, k]]
    return found


Basis = Callable[[Array, Exponents], Array]
"""`monomials`, or `chebyshev` where high orders are summed."""


@record(eq=False)
class Polynomial:
    """A function charted in a box by products of polynomials, one of each variable, of low order in all: where a grid
    of all products of points, as an `Interpolant` has, would take more of them than can be solved for. The variables
    are brought to -1 to 1 between `low` and `high` (variables); `orders` (terms, variables) are of the `basis`,
    `coefficients` (terms, outputs) in the unit of what is charted.
    """

    low: Array
    high: Array
    orders: Exponents
    coefficients: Array
    basis: Basis = monomials

    @property
    def degree(self) -> int:
        """The highest order of a product."""
        return int(self.orders.sum(axis=1).max())

    def __call__(self, points: Array) -> Array:
        """Values (n, outputs) at (n, variables) points, also beyond the box as its basis goes on there."""
        return np.asarray(self.basis(_inside(points, self.low, self.high), self.orders) @ self.coefficients)

    def slope(self, points: Array) -> Array:
        """Derivatives (n, outputs, variables), by central differences of a thousandth of half the box."""
        steps = 5e-4 * (self.high - self.low)
        found = [(self(points + step) - self(points - step)) / (2.0 * step.sum()) for step in np.diag(steps)]
        return np.stack(found, axis=2)


def least_squares(
    points: Array, values: Array, orders: Exponents, low: Array, high: Array, basis: Basis = monomials,
    least: float | None = None,
) -> Polynomial:
    """The polynomial of these orders in a box that is nearest to (n, outputs) values at (n, variables) points. Of those
    that are as near, the one with the smallest coefficients: combinations of terms count as left open by the points
    where their singular value is below a part of `least` of the largest (of rounding, where it is left out).
    """
    columns = basis(_inside(points, low, high), orders)
    return Polynomial(low, high, orders, np.asarray(np.linalg.lstsq(columns, values, rcond=least)[0]), basis)


def _inside(points: Array, low: Array, high: Array) -> Array:
    """Points (n, variables) with the box between both ends brought to -1 to 1; no unit."""
    return (points - 0.5 * (low + high)) / (0.5 * (high - low))


def spread(count: int, variables: int, skip: int = 0) -> Array:
    """Points (count, variables; no unit) that fill 0 to 1 evenly and are always the same: Halton's sequence (Numerische
    Mathematik 2, 1960), from `skip` on. Raises ValueError for more variables than there are bases here.
    """
    if variables > len(PRIMES):
        raise ValueError(f"at most {len(PRIMES)} variables")
    return np.array([[_inverse_digits(k + 1 + skip, base) for base in PRIMES[:variables]] for k in range(count)]
                    ).reshape(count, variables)


def _inverse_digits(number: int, base: int) -> float:
    """Van der Corput's radical inverse (no unit): the digits of a number behind the point, turned round."""
    found, share = 0.0, 1.0
    while number:
        share /= base
        number, digit = divmod(number, base)
        found += share * digit
    return found
