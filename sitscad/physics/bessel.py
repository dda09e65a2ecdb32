"""The Bessel function J1, by the polynomial fits of Abramowitz and Stegun 9.4.4 and 9.4.6 (error below 4e-8)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_SMALL = (0.5, -0.56249985, 0.21093573, -0.03954289, 0.00443319, -0.00031761, 0.00001109)
_MODULUS = (0.79788456, 0.00000156, 0.01659667, 0.00017105, -0.00249511, 0.00113653, -0.00020033)
_PHASE = (-2.35619449, 0.12499612, 0.00005650, -0.00637879, 0.00074348, 0.00079824, -0.00029166)


def j1(x: ArrayLike) -> Array:
    """J1(x) for real x >= 0, an array of the shape of `x`; absolute error below 4e-8."""
    x = np.asarray(x, dtype=float)
    low, high = np.minimum(x, 3.0), np.maximum(x, 3.0)
    small = low * _polynomial(_SMALL, (low / 3.0) ** 2)
    inverse = 3.0 / high
    large = _polynomial(_MODULUS, inverse) * np.cos(high + _polynomial(_PHASE, inverse)) / np.sqrt(high)
    return np.where(x < 3.0, small, large)


def _polynomial(coefficients: tuple[float, ...], x: Array) -> Array:
    result = np.full_like(x, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        result = result * x + coefficient
    return result
