"""1/distance as a sum of Gaussians: products of functions of x, y and z, so that integrals over boxes fall apart.

1/R = 2/sqrt(pi) times the integral of exp(-s^2 R^2) over s, by the trapezoidal rule in ln s (Beylkin and Monzon, Appl.
Comput. Harmon. Anal. 28, 2010). Currents without sources do not feel a constant, so long wavelengths may be left out;
what lies beyond the narrowest Gaussian acts on a surface like a delta function.
"""

from __future__ import annotations

import math

import numpy as np

from sitscad.arrays import Array
from sitscad.record import record

STEP = 0.45
"""Step in ln s: 1/R is then right to 2e-5 of itself (the error falls like exp(-pi^2 / 2 step))."""


@record(eq=False)
class GaussianSum:
    """1/R as the sum of `weights` exp(-(scales R)^2) (1/m) for R between two distances; nearer, on a surface, it lacks
    `tail` (m) times a delta function.
    """

    scales: Array
    weights: Array
    tail: float


def gaussian_sum(nearest: float, farthest: float) -> GaussianSum:
    """The sum that holds from `nearest` to `farthest` (m)."""
    count = math.ceil(math.log(40.0 * farthest / nearest) / STEP)
    scales = 0.05 / farthest * np.exp(STEP * np.arange(count + 1))
    weights = 2.0 / math.sqrt(math.pi) * STEP * scales
    return GaussianSum(scales, weights, 2.0 * math.sqrt(math.pi) / (float(scales[-1]) * math.exp(0.5 * STEP)))


def repeated_integrals(scales: Array, u: Array) -> tuple[Array, Array, Array, Array]:
    """First to fourth integral of exp(-s^2 u^2) from 0 or of odd and even parity, each (scales, *u.shape).

    n I_n+1 = u I_n + I_n-1 / 2 s^2 (Abramowitz and Stegun 7.2.5).
    """
    s = scales.reshape(-1, *(1,) * u.ndim)
    narrow = 0.5 / (s * s)
    # erf (without a unit) of every element, 1 where it is that to rounding
    x = s * u
    found = np.sign(x)
    near = np.abs(x) < 6.0
    found[near] = _ERF(x[near])
    first = 0.5 * math.sqrt(math.pi) / s * found
    second = u * first + narrow * np.exp(-((s * u) ** 2))
    third = 0.5 * (u * second + narrow * first)
    return first, second, third, (u * third + narrow * second) / 3.0


_ERF = np.frompyfunc(math.erf, 1, 1)
