"""Polynomials through values at Chebyshev points, and sums of products of polynomials in several variables."""

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
"""Array (terms, variables): for each product of variables, the exponent or polynomial order of each variable."""

POINTS_A_TERM = 1.5
"""Number of points in a least-squares fit divided by the number of terms of the polynomial.

With fewer points the polynomial oscillates between them.
"""

PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
"""Bases of Halton's sequence, one for each variable."""

AT_ONCE = 2000
"""Number of places at which a polynomial in several variables is evaluated together. The arrays then fit the cache."""


@lru_cache(maxsize=64)
def _roots(count: int) -> tuple[Array, Array]:
    """Return the roots (count; rising) of a Chebyshev polynomial and the barycentric weights (count; no unit) there.

    The weights are (-1)^j sin(angle of the root) (Berrut and Trefethen, SIAM Review 46, 2004).
    """
    angle = math.pi * (np.arange(count) + 0.5) / count
    return -np.cos(angle), np.where(np.arange(count) % 2, -1.0, 1.0) * np.sin(angle)


def chebyshev_points(low: float, high: float, count: int) -> Array:
    """Return the Chebyshev points (count) of the first kind between `low` and `high`, rising and in their unit.

    Source: Abramowitz and Stegun 22.16.
    """
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * _roots(count)[0])


def barycentric_weights(points: Array, at: Array, weights: Array | None = None) -> Array:
    """Return the weights (n, points; no unit) that interpolate values at `points` to the places `at` (n).

    The interpolation is a polynomial by the barycentric formula (Berrut and Trefethen, SIAM Review 46, 2004). `weights`
    (points) are the barycentric weights. If None, `points` are Chebyshev points.
    """
    offset = at[:, None] - points
    offset[offset == 0.0] = 1e-300  # at a point, its own weight dominates
    each = (_roots(points.size)[1] if weights is None else weights) / offset
    return np.asarray(each / each.sum(axis=1)[:, None])


def node_counts(half: Sequence[float], longest: float, order: int, apart: float) -> tuple[int, ...]:
    """Return numbers of Chebyshev points along the sides of a box, enough for a smooth function of distant points.

    `half` are the half sides (m). `longest` (m) is the longest half side, which gets `order` points. The distant points
    are at least `apart` times `longest` away from the box.

    Notes
    -----
    Fewer points are enough along shorter sides. The error falls like rho^-n with ln rho = acosh(1 + d), with d the
    distance in half sides (Trefethen, Approximation Theory and Approximation Practice, 2013, chapter 8).
    """
    rate = math.acosh(1.0 + apart)
    distances = (apart * longest / max(side, 1e-9 * longest) for side in half)
    return tuple(math.ceil(order * rate / math.acosh(1.0 + distance)) for distance in distances)


def evaluate_polynomials(tensor: NDArray[Any], grid: Sequence[Array], places: Array) -> NDArray[Any]:
    """Return the values (n, ...) of a polynomial in several variables at places (n, variables), in the tensor's unit.

    `tensor` holds values at all products of the points of the `grid` (one axis per variable), then the shape of one
    value. Interpolation is by `barycentric_weights` along each axis.
    """
    weights = [barycentric_weights(points, places[:, axis]) for axis, points in enumerate(grid)]
    values = np.empty((len(places), *tensor.shape[len(grid):]), dtype=tensor.dtype)
    for some in slices(len(places), AT_ONCE):
        part = np.tensordot(weights[0][some], tensor, axes=(1, 0))
        for weight in weights[1:]:
            part = np.einsum("ni,ni...->n...", weight[some], part)
        values[some] = part
    return values


@record(eq=False)
class Interpolant:
    """Polynomial that replaces a function in a box, through values at all products of Chebyshev points.

    `values` has an axis of points for each variable, then the shape of one value. `low` and `high` (variables) are the
    ends of the box, in the unit of each variable.
    """

    low: Array
    high: Array
    values: NDArray[Any]

    @cached_property
    def grid(self) -> tuple[Array, ...]:
        """Chebyshev points of every variable, rising, in the variable's unit."""
        ends = zip(self.low, self.high, self.values.shape, strict=False)
        return tuple(chebyshev_points(low, high, count) for low, high, count in ends)

    def __call__(self, places: Array) -> NDArray[Any]:
        """Return values (n, ...) at places (n, variables).

        A place outside the box gets the value at the nearest surface.
        """
        return evaluate_polynomials(self.values, self.grid, np.clip(places, self.low, self.high))


def exponents(weights: Sequence[float], degree: float, least: int = 0) -> Exponents:
    """Return the exponents (terms, variables; no unit) of all products of powers up to a weighted degree.

    The weighted degree of a product, at most `degree`, is the sum of exponents times `weights`. The sum of exponents is
    at least `least`. Low degrees come first.
    """
    each = [range(int(degree / weight + 1e-9) + 1) for weight in weights]
    rows = [row for row in product(*each) if np.dot(row, weights) <= degree + 1e-9 and sum(row) >= least]
    return np.array(sorted(rows, key=lambda row: (sum(row), tuple(-k for k in row))), dtype=np.int64).reshape(
        -1, len(weights)
    )


def monomials(points: Array, powers: Exponents) -> Array:
    """Return products of powers (n, terms; no unit) at points (n, variables).

    `powers` (terms, variables) are exponents.
    """
    values = np.ones((len(points), len(powers)))
    for k in range(points.shape[1]):
        highest = int(powers[:, k].max(initial=0))
        values *= (points[:, k : k + 1] ** np.arange(highest + 1))[:, powers[:, k]]
    return values


def chebyshev(points: Array, orders: Exponents) -> Array:
    """Return products of Chebyshev polynomials (n, terms; no unit) at points (n, variables).

    `orders` (terms, variables) are the orders. T_n(cos t) = cos(n t) (Abramowitz and Stegun 22.3.15). Beyond -1 and 1
    each polynomial is continued as a straight line with the slope at that end.
    """
    # T_n(x) = cos(n arccos x) is accurate at orders where sums of powers cancel; T_n' is n^2 at 1
    inside = np.clip(points, -1.0, 1.0)
    angles, beyond = np.arccos(inside), points - inside
    values = np.ones((len(points), len(orders)))
    for k in range(points.shape[1]):
        order = np.arange(int(orders[:, k].max(initial=0)) + 1)
        slope = np.sign(inside[:, k : k + 1]) ** (order + 1) * order**2
        values *= (np.cos(angles[:, k : k + 1] * order) + beyond[:, k : k + 1] * slope)[:, orders[:, k]]
    return values


Basis = Callable[[Array, Exponents], Array]
"""Function that evaluates products of polynomials: `monomials`, or `chebyshev` for high orders."""


@record(eq=False)
class Polynomial:
    """Polynomial that replaces a function in a box, as a sum of products of low total order.

    It suits cases in which the grid of an `Interpolant` would need too many solved points. `low` and `high` (variables)
    are the ends of the box; variables are scaled to -1 to 1 between them. `orders` (terms, variables) are the orders of
    each product, evaluated by `basis`. `coefficients` (terms, outputs) have the function's unit.
    """

    low: Array
    high: Array
    orders: Exponents
    coefficients: Array
    basis: Basis = monomials

    @property
    def degree(self) -> int:
        """Highest total order of a product (no unit)."""
        return int(self.orders.sum(axis=1).max())

    def __call__(self, points: Array) -> Array:
        """Return values (n, outputs) at points (n, variables). Outside the box the polynomial is extrapolated."""
        return np.asarray(self.basis(_scale_to_box(points, self.low, self.high), self.orders) @ self.coefficients)

    def slope(self, points: Array) -> Array:
        """Return derivatives (n, outputs, variables) at points (n, variables), by central differences.

        The steps are a thousandth of half the box.
        """
        steps = 5e-4 * (self.high - self.low)
        differences = [(self(points + step) - self(points - step)) / (2.0 * step.sum()) for step in np.diag(steps)]
        return np.stack(differences, axis=2)


def least_squares(
    points: Array, values: Array, orders: Exponents, low: Array, high: Array, basis: Basis = monomials,
    least: float | None = None,
) -> Polynomial:
    """Fit a polynomial in a box to values by least squares.

    If several polynomials fit equally well, the result has the smallest coefficients.

    Parameters
    ----------
    points : array
        points (n, variables)
    values : array
        values (n, outputs)
    orders : Exponents
        orders of the products (terms, variables)
    low, high : array
        ends of the box (variables)
    basis : Basis, optional
        `monomials` or `chebyshev`
    least : float or None, optional
            smallest singular value that is used, divided by the largest. Coefficients of combinations of terms with
        smaller singular values are zero. If None, the limit is rounding.
    """
    columns = basis(_scale_to_box(points, low, high), orders)
    return Polynomial(low, high, orders, np.asarray(np.linalg.lstsq(columns, values, rcond=least)[0]), basis)


def _scale_to_box(points: Array, low: Array, high: Array) -> Array:
    """Return points (n, variables; no unit) scaled so that the box from `low` to `high` becomes -1 to 1."""
    return (points - 0.5 * (low + high)) / (0.5 * (high - low))


def halton_points(count: int, variables: int, skip: int = 0) -> Array:
    """Return points (count, variables; no unit) of Halton's sequence (Numerische Mathematik 2, 1960).

    They fill the range 0 to 1 evenly and are deterministic. The first `skip` points of the sequence are left out.
    Raises ValueError if there are more variables than `PRIMES`.
    """
    if variables > len(PRIMES):
        raise ValueError(f"at most {len(PRIMES)} variables")
    return np.array([[_inverse_digits(k + 1 + skip, base) for base in PRIMES[:variables]] for k in range(count)]
                    ).reshape(count, variables)


def _inverse_digits(number: int, base: int) -> float:
    """Return van der Corput's radical inverse (no unit): the number's digits in reverse order behind the point."""
    inverse, share = 0.0, 1.0
    while number:
        share /= base
        number, digit = divmod(number, base)
        inverse += share * digit
    return inverse
