"""Special functions and quadrature, as far as numpy lacks them or takes long to load: Legendre polynomials and Gauss
points, Bessel functions (J0 and J1 by the polynomial fits of Abramowitz and Stegun 9.4.1 to 9.4.6, error below 1e-7;
sequences of orders by recurrence), and the mutual inductance of coaxial circles.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from sitscad.basics.arrays import Array
from sitscad.kernels.electromagnetics.constants import MU0


def legendre(order: int, x: Array) -> Array:
    """P_0 to P_order at every x, the order last: (..., order + 1), by Bonnet's recursion (Abramowitz and Stegun 22.7).
    (n + 1) P_(n+1) = (2 n + 1) x P_n - n P_(n-1).
    """
    values = np.ones((order + 1, *x.shape))
    if order:
        values[1] = x
    for n in range(1, order):
        values[n + 1] = ((2 * n + 1) * x * values[n] - n * values[n - 1]) / (n + 1)
    return np.moveaxis(values, 0, -1)


def legendre_integrals(order: int, x: Array) -> Array:
    """Integrals (no unit) of P_0 to P_order from 0 to every x, the order last: (P_(n+1) - P_(n-1)) / (2 n + 1) between
    both (Jackson, Classical Electrodynamics, equation 3.28).
    """
    grown = legendre(order + 1, x) - legendre(order + 1, np.zeros(1))
    n = np.arange(1, order + 1)
    return np.concatenate([x[..., None], (grown[..., 2:] - grown[..., :-2]) / (2 * n + 1)], axis=-1)


@lru_cache(maxsize=64)
def gauss(count: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on [-1, 1], kept. Eigenvalues of the recursion's symmetric matrix, and twice the
    squared first elements of its eigenvectors (Golub and Welsch 1969).
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
    """J0(x) for real x >= 0 (no unit), an array of the shape of `x`; absolute error below 1e-7 (Abramowitz and Stegun
    9.4.1 and 9.4.3).
    """
    x = np.asarray(x, dtype=float)
    found, near = _far(x, _MODULUS_0, _PHASE_0), x < 3.0
    found[near] = _polynomial(_SMALL_0, (x[near] / 3.0) ** 2)
    return found


def j1(x: ArrayLike) -> Array:
    """J1(x) for real x >= 0 (no unit), an array of the shape of `x`; absolute error below 4e-8 (Abramowitz and Stegun
    9.4.4 and 9.4.6).
    """
    x = np.asarray(x, dtype=float)
    found, near = _far(x, _MODULUS, _PHASE), x < 3.0
    low = x[near]
    found[near] = low * _polynomial(_SMALL, (low / 3.0) ** 2)
    return found


def _far(x: Array, modulus: tuple[float, ...], phase: tuple[float, ...]) -> Array:
    """Modulus times cosine of the phase (no unit) at every x, those below 3 taken as 3: Abramowitz and Stegun 9.4.3 and
    9.4.6; in place, for tables are large. The cosine by the tangent of half the phase, which costs a tenth of it.
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
    """A polynomial at every x by Horner's rule, constant coefficient first; no unit."""
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
    """Spherical j_0 to j_highest (no unit) of every x > 0, (highest + 1, len(x)): sqrt(pi / 2x) J_(n + 1/2)(x)
    (Abramowitz and Stegun 10.1.1).
    """
    return _downward(x, highest, 0.5)


def _downward(x: Array, highest: int, shift: float) -> Array:
    """Bessel functions (no unit) of all orders at every x (n,), (highest + 1, n), by Miller's recurrence from far
    above. `shift` is 0 for J_n and 1/2 for the spherical j_n: f_(n-1) = 2 (n + shift) / x f_n - f_(n+1) (Abramowitz and
    Stegun 9.1.27, 10.1.19), made right by J0^2 + 2 sum J_n^2 = 1 (9.1.76) or by sum (2 n + 1) j_n^2 = 1 (10.1.50).
    """
    # All start positive, as the functions are for orders beyond x.
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


def coaxial_rings(radius: ArrayLike, other: ArrayLike, distance_squared: ArrayLike) -> Array:
    """Mutual inductance (H) of coaxial circular filaments (radii in m, arrays that broadcast together).

    `distance_squared` (m2) is the squared shortest distance of the two circles, (r1 - r2)^2 + z^2, given by the caller
    so that touching circles lose no digits. Maxwell's integral (art. 701) in Landen's form, with K - E of the reduced
    modulus summed by the arithmetic-geometric mean (Abramowitz and Stegun 17.6): relative error about 1e-14 from
    relative distances of 1e-9 to 1e6.
    """
    r1, r2 = np.asarray(radius, dtype=float), np.asarray(other, dtype=float)
    near = np.sqrt(np.asarray(distance_squared, dtype=float))
    product = 4.0 * r1 * r2
    far = np.sqrt(near * near + product)
    # Landen: k1 = (far - near) / (far + near), written without the difference.
    k1 = product / (far + near) ** 2
    complement = 2.0 * np.sqrt(near * far) / (far + near)
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
