"""Special functions and quadrature rules that numpy lacks.

Legendre polynomials and Gauss points, Bessel functions, and the mutual inductance of coaxial circles. J0 and J1 are
polynomial fits (Abramowitz and Stegun 9.4.1 to 9.4.6, error below 1e-7); higher orders follow by recurrence. Scipy is
not used because it takes long to load.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from sitscad.basics.arrays import Array
from sitscad.kernels.electromagnetics.constants import MU0


def legendre(order: int, x: Array) -> Array:
    """Return the Legendre polynomials P_0 to P_order (..., order + 1; no unit) at every x.

    Bonnet's recursion (Abramowitz and Stegun 22.7): (n + 1) P_(n+1) = (2 n + 1) x P_n - n P_(n-1).
    """
    values = np.ones((order + 1, *x.shape))
    if order:
        values[1] = x
    for n in range(1, order):
        values[n + 1] = ((2 * n + 1) * x * values[n] - n * values[n - 1]) / (n + 1)
    return np.moveaxis(values, 0, -1)


def legendre_integrals(order: int, x: Array) -> Array:
    """Return the integrals (..., order + 1; no unit) of Legendre polynomials P_0 to P_order from 0 to every x.

    They are differences of (P_(n+1) - P_(n-1)) / (2 n + 1) (Jackson, Classical Electrodynamics, equation 3.28).
    """
    grown = legendre(order + 1, x) - legendre(order + 1, np.zeros(1))
    n = np.arange(1, order + 1)
    return np.concatenate([x[..., None], (grown[..., 2:] - grown[..., :-2]) / (2 * n + 1)], axis=-1)


@lru_cache(maxsize=64)
def gauss(count: int) -> tuple[Array, Array]:
    """Return the nodes and weights (count; no unit) of Gauss-Legendre quadrature on [-1, 1]. They are read-only.

    Nodes are eigenvalues of the recursion's symmetric matrix. Weights are twice the squared first elements of its
    eigenvectors (Golub and Welsch 1969). Results are cached.
    """
    n = np.arange(1, count)
    beside = n / np.sqrt(4.0 * n * n - 1.0)
    nodes, vectors = np.linalg.eigh(np.diag(beside, 1) + np.diag(beside, -1))
    nodes, weights = 0.5 * (nodes - nodes[::-1]), vectors[0] ** 2 + vectors[0, ::-1] ** 2
    nodes.setflags(write=False)
    weights.setflags(write=False)
    return nodes, weights


_SMALL = (0.5, -0.56249985, 0.21093573, -0.03954289, 0.00443319, -0.00031761, 0.00001109)
_MODULUS = (0.79788456, 0.00000156, 0.01659667, 0.00017105, -0.00249511, 0.00113653, -0.00020033)
_PHASE = (-2.35619449, 0.12499612, 0.00005650, -0.00637879, 0.00074348, 0.00079824, -0.00029166)

_SMALL_0 = (1.0, -2.2499997, 1.2656208, -0.3163866, 0.0444479, -0.0039444, 0.0002100)
_MODULUS_0 = (0.79788456, -0.00000077, -0.00552740, -0.00009512, 0.00137237, -0.00072805, 0.00014476)
_PHASE_0 = (-0.78539816, -0.04166397, -0.00003954, 0.00262573, -0.00054125, -0.00029333, 0.00013558)


def j0(x: ArrayLike) -> Array:
    """Return J0(x) for real x >= 0 (no unit), in the shape of `x`, with an absolute error below 1e-7.

    Source: Abramowitz and Stegun 9.4.1 and 9.4.3.
    """
    x = np.asarray(x, dtype=float)
    values, near = _modulus_times_cosine(x, _MODULUS_0, _PHASE_0), x < 3.0
    values[near] = _polynomial(_SMALL_0, (x[near] / 3.0) ** 2)
    return values


def j1(x: ArrayLike) -> Array:
    """Return J1(x) for real x >= 0 (no unit), in the shape of `x`, with an absolute error below 4e-8.

    Source: Abramowitz and Stegun 9.4.4 and 9.4.6.
    """
    x = np.asarray(x, dtype=float)
    values, near = _modulus_times_cosine(x, _MODULUS, _PHASE), x < 3.0
    low = x[near]
    values[near] = low * _polynomial(_SMALL, (low / 3.0) ** 2)
    return values


def _modulus_times_cosine(x: Array, modulus: tuple[float, ...], phase: tuple[float, ...]) -> Array:
    """Return modulus times cosine of the phase (no unit) of a Bessel function at every x; x below 3 is replaced by 3.

    `modulus` and `phase` are coefficients of Abramowitz and Stegun 9.4.3 and 9.4.6. Arrays are modified in place,
    because tables are large. The cosine is computed by the tangent of half the phase, at a tenth of the cost.
    """
    high = np.asarray(np.maximum(x, 3.0))
    inverse = 3.0 / high
    values = np.asarray(_polynomial(phase, inverse))
    values += high
    values *= 0.5
    np.tan(values, out=values)
    np.square(values, out=values)
    cosine = 1.0 - values
    values += 1.0
    np.divide(cosine, values, out=values)
    values *= _polynomial(modulus, inverse)
    values /= np.sqrt(high, out=high)
    return values


def _polynomial(coefficients: tuple[float, ...], x: Array) -> Array:
    """Return a polynomial (no unit) at every x by Horner's rule. The constant coefficient is first."""
    result = x * coefficients[-1]
    result += coefficients[-2]
    for coefficient in coefficients[-3::-1]:
        result *= x
        result += coefficient
    return result


def bessel_orders(x: Array, highest: int, is_spherical: bool = False) -> Array:
    """Return Bessel functions J_0 to J_highest (highest + 1, n; no unit) of every x > 0 (n).

    With `is_spherical`, return the spherical functions j_0 to j_highest, sqrt(pi / 2x) J_(n + 1/2)(x) (Abramowitz and
    Stegun 10.1.1). Errors are rounding errors relative to the largest order.

    Notes
    -----
    Miller's downward recurrence (Abramowitz and Stegun 1964, 9.12): f_(n-1) = 2 (n + shift) / x f_n - f_(n+1) (9.1.27,
    10.1.19), with a shift of 1/2 for j_n. It is normalised by J0^2 + 2 sum J_n^2 = 1 (9.1.76) or by sum (2 n + 1) j_n^2
    = 1 (10.1.50).
    """
    # all start positive, like the functions of orders above x
    x, shift = np.maximum(x, 1e-6), 0.5 if is_spherical else 0.0
    above, here, total = np.zeros_like(x), np.full_like(x, 1e-120), np.zeros_like(x)
    values = np.zeros((highest + 1, x.size))
    slope = 2.0 / x
    for n in range(max(highest, math.ceil(float(x.max(initial=0.0)))) + 40, 0, -1):
        above, here = here, (n + shift) * slope * here - above
        total += (2 * n - 1 if is_spherical else 2 if n > 1 else 1) * here * here
        if n <= highest + 1:
            values[n - 1] = here
        if n % 4 == 0:
            scale = np.where(total > 1e120, 1e-60, 1.0)
            above, here, total = above * scale, here * scale, total * (scale * scale)
            values[n - 1 :] *= scale
    values /= np.sqrt(total)
    return values


def coaxial_rings(radius: ArrayLike, other: ArrayLike, distance_squared: ArrayLike) -> Array:
    """Return the mutual inductance (H) of coaxial circular filaments. The arguments broadcast together.

    The relative error is about 1e-14 for distances from 1e-9 to 1e6 radii.

    Parameters
    ----------
    radius, other : ArrayLike
        radii of both circles (m)
    distance_squared : ArrayLike
            squared shortest distance of the two circles (m2), (r1 - r2)^2 + z^2. It is an argument because the
        difference of radii would lose digits for circles that nearly touch.

    Notes
    -----
    Maxwell's integral (art. 701) in Landen's form. K - E of the reduced modulus is by the arithmetic-geometric mean
    (Abramowitz and Stegun 17.6).
    """
    r1, r2 = np.asarray(radius, dtype=float), np.asarray(other, dtype=float)
    nearest = np.sqrt(np.asarray(distance_squared, dtype=float))
    product = 4.0 * r1 * r2
    farthest = np.sqrt(nearest * nearest + product)
    # Landen: k1 = (far - near) / (far + near), without the difference
    k1 = product / (farthest + nearest) ** 2
    complement = 2.0 * np.sqrt(nearest * farthest) / (farthest + nearest)
    # K - E = K * sum of 2^(n-1) c_n^2, c_0 = k, from the arithmetic-geometric mean of 1 and k'
    a, b = np.ones_like(complement), complement
    square = k1 * k1
    total = 0.5 * square
    weight = 1.0
    for _ in range(9):
        mean = 0.5 * (a + b)
        # c_{n+1}^2 = (c_n^2 / (4 a_{n+1}))^2 avoids the difference a - b
        square = square / mean
        square *= 0.25
        square *= square
        total += weight * square
        b = np.sqrt(a * b)
        a = mean
        weight *= 2.0
        if np.max(square, initial=0.0) * weight < 1e-17 * np.min(total, initial=1.0):
            break
    return MU0 * np.sqrt(r1 * r2) * 2.0 / np.sqrt(k1) * (0.5 * np.pi / a * total)
