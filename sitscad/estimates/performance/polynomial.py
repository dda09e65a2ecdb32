"""Polynomials of a few variables through many points: from readings to loads and from loads to readings."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from sitscad.record import record

Array = NDArray[np.float64]

LEAST_SHARE, LEAST_SHARE_REDUNDANT = 1e-10, 1e-4
"""Combinations of terms that the points hardly change (singular values over the largest) are left out. With more
variables than outputs the points lie on a surface, and what is off it by less than 1e-4 is how one design's leads and
manufacture lie: coefficients made of that err by several full scales on the next unit (four coils, three forces).
"""


@record(eq=False)
class Polynomial:
    """A polynomial without constant term: nothing read is no load. `scale` (variables) divides what goes in, `powers`
    (terms, variables) are exponents, `coefficients` (terms, outputs).
    """

    degree: int
    scale: Array
    powers: NDArray[np.intp]
    coefficients: Array

    def __call__(self, points: Array) -> Array:
        """Values (n, outputs) at (n, variables) points."""
        return np.asarray(_terms(points / self.scale, self.powers) @ self.coefficients)

    def slope(self, points: Array) -> Array:
        """Derivatives (n, outputs, variables), by central differences of a thousandth of the scale."""
        steps = 1e-3 * self.scale
        found = [(self(points + step) - self(points - step)) / (2.0 * step.sum()) for step in np.diag(steps)]
        return np.stack(found, axis=2)


def _terms(points: Array, powers: NDArray[np.intp]) -> Array:
    return np.asarray(np.prod(points[:, None, :] ** powers, axis=2))


def powers_up_to(variables: int, degree: int) -> NDArray[np.intp]:
    """Exponents (terms, variables) of all products of one to `degree` variables."""
    rows = [
        np.bincount(np.array(chosen), minlength=variables)
        for order in range(1, degree + 1)
        for chosen in combinations_with_replacement(range(variables), order)
    ]
    return np.array(rows, dtype=np.intp)


def fitted(points: Array, values: Array, degree: int) -> Polynomial:
    """The polynomial of least squares through (n, variables) points and (n, outputs) values, of those the smallest
    where the points leave some combinations of terms open.

    Raises ValueError where the points are fewer than its terms.
    """
    powers = powers_up_to(points.shape[1], degree)
    if len(points) < len(powers):
        raise ValueError(f"{len(points)} points do not hold {len(powers)} terms")
    scale = np.maximum(np.abs(points).max(axis=0), 1e-300)
    least = LEAST_SHARE_REDUNDANT if points.shape[1] > values.shape[1] else LEAST_SHARE
    found = np.linalg.lstsq(_terms(points / scale, powers), values, rcond=least)[0]
    return Polynomial(degree, scale, powers, np.asarray(found))


def best_fitted(points: Array, values: Array, held_out: tuple[Array, Array], most: int) -> Polynomial:
    """Of the polynomials up to a degree, the one that errs least (rms over the values' spread) at points held out."""
    found, apart = None, np.inf
    spread = np.maximum(np.ptp(values, axis=0), 1e-300)
    for degree in range(1, most + 1):
        if 1.5 * len(powers_up_to(points.shape[1], degree)) > len(points):
            break
        one = fitted(points, values, degree)
        error = float(np.sqrt(np.mean(((one(held_out[0]) - held_out[1]) / spread) ** 2)))
        if error < 0.9 * apart:
            found, apart = one, error
    assert found is not None
    return found
