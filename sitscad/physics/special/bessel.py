"""Bessel functions: J0 and J1 by the polynomial fits of Abramowitz and Stegun 9.4.1 to 9.4.6 (error below 1e-7), and
whole sequences of orders, integer and half-integer, by Miller's downward recurrence (9.12).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from sitscad.arrays import Array

_SMALL = (0.5, -0.56249985, 0.21093573, -0.03954289, 0.00443319, -0.00031761, 0.00001109)
_MODULUS = (0.79788456, 0.00000156, 0.01659667, 0.00017105, -0.00249511, 0.00113653, -0.00020033)
_PHASE = (-2.35619449, 0.12499612, 0.00005650, -0.00637879, 0.00074348, 0.00079824, -0.00029166)

_SMALL_0 = (1.0, -2.2499997, 1.2656208, -0.3163866, 0.0444479, -0.0039444, 0.0002100)
_MODULUS_0 = (0.79788456, -0.00000077, -0.00552740, -0.00009512, 0.00137237, -0.00072805, 0.00014476)
_PHASE_0 = (-0.78539816, -0.04166397, -0.00003954, 0.00262573, -0.00054125, -0.00029333, 0.00013558)


def j0(x: ArrayLike) -> Array:
    """J0(x) for real x >= 0 (no unit), an array of the shape of `x`; absolute error below 1e-7."""
    x = np.asarray(x, dtype=float)
    found, near = _far(x, _MODULUS_0, _PHASE_0), x < 3.0
    found[near] = _polynomial(_SMALL_0, (x[near] / 3.0) ** 2)
    return found


def j1(x: ArrayLike) -> Array:
    """J1(x) for real x >= 0 (no unit), an array of the shape of `x`; absolute error below 4e-8."""
    x = np.asarray(x, dtype=float)
    found, near = _far(x, _MODULUS, _PHASE), x < 3.0
    low = x[near]
    found[near] = low * _polynomial(_SMALL, (low / 3.0) ** 2)
    return found


def _far(x: Array, modulus: tuple[float, ...], phase: tuple[float, ...]) -> Array:
    """Modulus times cosine of the phase (no unit) at every x, those below 3 taken as 3; in place: tables are large.

    The cosine by the tangent of half the phase, which costs a tenth of it.
    """
    high = np.asarray(np.maximum(x, 3.0))
    inverse = 3.0 / high
    found = np.asarray(_polynomial(phase, inverse))
    found += high
    found *= 0.5
    np.tan(found, out=found)
    np.square(found, out=found)
    cosine = 1.0 - found
    found += 1.0
    np.divide(cosine, found, out=found)
    found *= _polynomial(modulus, inverse)
    found /= np.sqrt(high, out=high)
    return found


def _polynomial(coefficients: tuple[float, ...], x: Array) -> Array:
    result = x * coefficients[-1]
    result += coefficients[-2]
    for coefficient in coefficients[-3::-1]:
        result *= x
        result += coefficient
    return result


def bessel_orders(x: Array, highest: int) -> Array:
    """J_0 to J_highest (no unit) of every x > 0, shape (highest + 1, len(x)); relative to the largest order exact to
    rounding. Miller's downward recurrence (Abramowitz and Stegun 1964, 9.12).
    """
    return _downward(x, highest, 0.0)


def spherical_bessel_orders(x: Array, highest: int) -> Array:
    """Spherical j_0 to j_highest (no unit) of every x > 0, (highest + 1, len(x)): sqrt(pi / 2x) J_(n + 1/2)(x)."""
    return _downward(x, highest, 0.5)


def _downward(x: Array, highest: int, shift: float) -> Array:
    """Bessel functions (no unit) of all orders by recurrence from far above, made right by the sum rule they obey."""
    # f_(n-1) = 2 (n + shift) / x f_n - f_(n+1) from far above, made right by J0^2 + 2 sum J_n^2 = 1 or by
    # sum (2n + 1) j_n^2 = 1. All start positive, as the functions are for orders beyond x.
    x = np.maximum(x, 1e-6)
    above, here, total = np.zeros_like(x), np.full_like(x, 1e-120), np.zeros_like(x)
    found = np.zeros((highest + 1, x.size))
    slope = 2.0 / x
    for n in range(max(highest, math.ceil(float(x.max(initial=0.0)))) + 40, 0, -1):
        above, here = here, (n + shift) * slope * here - above
        total += (2 * n - 1 if shift else 2 if n > 1 else 1) * here * here
        if n <= highest + 1:
            found[n - 1] = here
        if n % 4 == 0:
            scale = np.where(total > 1e120, 1e-60, 1.0)
            above, here, total = above * scale, here * scale, total * (scale * scale)
            found[n - 1 :] *= scale
    found /= np.sqrt(total)
    return found
