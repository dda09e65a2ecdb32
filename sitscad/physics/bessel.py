"""The Bessel functions J0 and J1, by the polynomial fits of Abramowitz and Stegun 9.4 (errors below 7e-8)."""

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


_SMALL_0 = (1.0, -2.2499997, 1.2656208, -0.3163866, 0.0444479, -0.0039444, 0.0002100)
_MODULUS_0 = (0.79788456, -0.00000077, -0.00552740, -0.00009512, 0.00137237, -0.00072805, 0.00014476)
_PHASE_0 = (-0.78539816, -0.04166397, -0.00003954, 0.00262573, -0.00054125, -0.00029333, 0.00013558)


def j0(x: ArrayLike) -> Array:
    """J0(x) for real x >= 0 (Abramowitz and Stegun 9.4.1 and 9.4.3), of the shape of `x`; absolute error below 7e-8."""
    x = np.asarray(x, dtype=float)
    low, high = np.minimum(x, 3.0), np.maximum(x, 3.0)
    inverse = 3.0 / high
    large = _polynomial(_MODULUS_0, inverse) * np.cos(high + _polynomial(_PHASE_0, inverse)) / np.sqrt(high)
    return np.where(x < 3.0, _polynomial(_SMALL_0, (low / 3.0) ** 2), large)
