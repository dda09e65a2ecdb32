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

POINTS_A_TERM = 1.5
"""Number of points for each term of a polynomial in a least-squares fit.

With fewer points the polynomial oscillates between them.
"""

PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
"""Bases of Halton's sequence."""

AT_ONCE = 2000
"""Number of places at which a polynomial of several variables is evaluated at once: the arrays stay in cache."""


@lru_cache(maxsize=64)
def _roots(count: int) -> tuple[Array, Array]:
    """Return the roots (count,; rising) of a Chebyshev polynomial and the barycentric weights (count,) there (no unit).

    The weights are (-1)^j sin(angle of the root) (Berrut and Trefethen, SIAM Review 46, 2004).
    """
    angle = math.pi * (np.arange(count) + 0.5) / count
    return -np.cos(angle), np.where(np.arange(count) % 2, -1.0, 1.0) * np.sin(angle)


def chebyshev_points(low: float, high: float, count: int) -> Array:
    """Return the Chebyshev points (count,) of the first kind between two ends, rising and in their unit.

    Source: Abramowitz and Stegun 22.16.
    """
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * _roots(count)[0])


def barycentric_weights(points: Array, at: Array, weights: Array | None = None) -> Array:
    """Return the weights (n, points) that interpolate from values at `points` to the places `at` (n,) by a polynomial.

    Barycentric formula (Berrut and Trefethen, SIAM Review 46, 2004). `weights` (points) are the barycentric weights. If
    None, `points` are Chebyshev points.
    """
    offset = at[:, None] - points
    offset[offset == 0.0] = 1e-300  # at a point, its own weight dominates
    each = (_roots(points.size)[1] if weights is None else weights) / offset
    return np.asarray(each / each.sum(axis=1)[:, None])


def node_counts(half: Sequence[float], longest: float, order: int, apart: float) -> tuple[int, ...]:
    """Return numbers of Chebyshev points along the half sides (m) of a box, with `order` along the `longest` (m).

    Other points see the box from a distance of at least `apart` times the longest half side.

    Notes
    -----
    Fewer points are enough along shorter sides. The error falls like rho^-n with ln rho = acosh(1 + d), with d the
    distance in half sides (Trefethen, Approximation Theory and Approximation Practice, 2013, chapter 8).
    """
    rate = math.acosh(1.0 + apart)
    distances = (apart * longest / max(side, 1e-9 * longest) for side in half)
    return tuple(math.ceil(order * rate / math.acosh(1.0 + distance)) for distance in distances)


def evaluate_polynomials(tensor: NDArray[Any], grid: Sequence[Array], places: Array) -> NDArray[Any]:
    """Return the values (n, ...) of polynomials in several variables at (n, axes) places, in the unit of the tensor.

    `tensor` holds values (points of each axis of the `grid`, then the shape of one value). Uses `barycentric_weights`
    along each axis.
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
    """Polynomial surrogate of a function in a box, from values at all products of Chebyshev points.

    `values` has an axis of points for each variable, then the shape of one value. `low` and `high` (variables) are the
    ends of the box.
    """

    low: Array
    high: Array
    values: NDArray[Any]

    @cached_property
    def grid(self) -> tuple[Array, ...]:
        """Chebyshev points of every variable, rising."""
        ends = zip(self.low, self.high, self.values.shape, strict=False)
        return tuple(chebyshev_points(low, high, count) for low, high, count in ends)

    def __call__(self, places: Array) -> NDArray[Any]:
        """Return values (n, ...) at (n, variables) places. Places beyond the box get the value at its surface."""
        return evaluate_polynomials(self.values, self.grid, np.clip(places, self.low, self.high))


def exponents(weights: Sequence[float], degree: float, least: int = 0) -> Exponents:
    """Return the exponents (terms, variables; no unit) of all products up to a weighted degree of `degree`.

    The sum of the exponents of each term is at least `least`. Low degrees come first.
    """
    each = [range(int(degree / weight + 1e-9) + 1) for weight in weights]
    rows = [row for row in product(*each) if np.dot(row, weights) <= degree + 1e-9 and sum(row) >= least]
    return np.array(sorted(rows, key=lambda row: (sum(row), tuple(-k for k in row))), dtype=np.int64).reshape(
        -1, len(weights)
    )


def monomials(points: Array, powers: Exponents) -> Array:
    """Return values (n, terms; no unit) of products of powers at (n, variables) points."""
    values = np.ones((len(points), len(powers)))
    for k in range(points.shape[1]):
        highest = int(powers[:, k].max(initial=0))
        values *= (points[:, k : k + 1] ** np.arange(highest + 1))[:, powers[:, k]]
    return values


def chebyshev(points: Array, orders: Exponents) -> Array:
    """Return values (n, terms; no unit) of products of Chebyshev polynomials at (n, variables) points.

    T_n(cos t) = cos(n t) (Abramowitz and Stegun 22.3.15). Beyond -1 and 1 each polynomial is extended linearly, with
    its slope at that end.
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
"""Type of `monomials` and `chebyshev`. The latter suits high orders."""


@record(eq=False)
class Polynomial:
    """Polynomial surrogate of a function in a box, from products of low total order.

    It suits cases in which the grid of an `Interpolant` would need more points than can be solved. The variables are
    scaled to -1 to 1 between `low` and `high` (variables). `orders` (terms, variables) belong to the `basis`.
    `coefficients` (terms, outputs) have the function's unit.
    """

    low: Array
    high: Array
    orders: Exponents
    coefficients: Array
    basis: Basis = monomials

    @property
    def degree(self) -> int:
        """Highest order of a product."""
        return int(self.orders.sum(axis=1).max())

    def __call__(self, points: Array) -> Array:
        """Return values (n, outputs) at (n, variables) points. Beyond the box the basis is extrapolated."""
        return np.asarray(self.basis(_scaled_to_box(points, self.low, self.high), self.orders) @ self.coefficients)

    def slope(self, points: Array) -> Array:
        """Return derivatives (n, outputs, variables), by central differences of a thousandth of half the box."""
        steps = 5e-4 * (self.high - self.low)
        differences = [(self(points + step) - self(points - step)) / (2.0 * step.sum()) for step in np.diag(steps)]
        return np.stack(differences, axis=2)


def least_squares(
    points: Array, values: Array, orders: Exponents, low: Array, high: Array, basis: Basis = monomials,
    least: float | None = None,
) -> Polynomial:
    """Fit a polynomial in a box to values by least squares.

    If several polynomials fit equally, the result has the smallest coefficients.

    Parameters
    ----------
    points : array
        points (n, variables)
    values : array
        values (n, outputs)
    orders : Exponents
        orders of the terms (terms, variables)
    low, high : array
        ends of the box (variables)
    basis : Basis, optional
        `monomials` or `chebyshev`
    least : float or None, optional
        singular value, relative to the largest, below which a combination of terms is undetermined; rounding if None
    """
    columns = basis(_scaled_to_box(points, low, high), orders)
    return Polynomial(low, high, orders, np.asarray(np.linalg.lstsq(columns, values, rcond=least)[0]), basis)


def _scaled_to_box(points: Array, low: Array, high: Array) -> Array:
    """Return points (n, variables) scaled so that the box runs from -1 to 1 (no unit)."""
    return (points - 0.5 * (low + high)) / (0.5 * (high - low))


def halton_points(count: int, variables: int, skip: int = 0) -> Array:
    """Return points (count, variables; no unit) of Halton's sequence (Numerische Mathematik 2, 1960), from `skip` on.

    They fill 0 to 1 evenly and are deterministic. Raises ValueError if there are more variables than `PRIMES`.
    """
    if variables > len(PRIMES):
        raise ValueError(f"at most {len(PRIMES)} variables")
    return np.array([[_inverse_digits(k + 1 + skip, base) for base in PRIMES[:variables]] for k in range(count)]
                    ).reshape(count, variables)


def _inverse_digits(number: int, base: int) -> float:
    """Return van der Corput's radical inverse (no unit): the digits of a number in reverse behind the point."""
    inverse, share = 0.0, 1.0
    while number:
        share /= base
        number, digit = divmod(number, base)
        inverse += share * digit
    return inverse
