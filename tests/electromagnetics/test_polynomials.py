"""Charts of functions: both kinds give back what they can hold, and fall off as fast as the theory says."""

from __future__ import annotations

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.polynomials import (
    Interpolant,
    chebyshev,
    chebyshev_points,
    exponents,
    halton_points,
    least_squares,
    monomials,
)

LOW, HIGH = np.array([1.0, -2.0]), np.array([3.0, 0.5])


def cubic(points):
    x, y = points.T
    return np.stack([x**3 - 2.0 * x * y**2 + y, 1.0 + x * y], axis=1)


def interpolant(function, count):
    lines = [chebyshev_points(low, high, count) for low, high in zip(LOW, HIGH, strict=True)]
    values = function(np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2))
    return Interpolant(LOW, HIGH, values.reshape(count, count, *values.shape[1:]))


def fit(function, degree, basis):
    points = LOW + halton_points(300, 2) * (HIGH - LOW)
    return least_squares(points, function(points), exponents([1.0, 1.0], degree), LOW, HIGH, basis)


INSIDE = LOW + halton_points(50, 2, 500) * (HIGH - LOW)


@pytest.mark.parametrize("chart", [
    interpolant(cubic, 4), fit(cubic, 3, monomials), fit(cubic, 3, chebyshev)], ids=["grid", "monomials", "chebyshev"])
def test_surrogate_reproduces_cubic(chart):
    assert chart(INSIDE) == approx(cubic(INSIDE), rel=1e-9, abs=1e-10)


def test_interpolant_handles_complex_values_and_clamps_at_box():
    result = interpolant(lambda points: np.exp(1j * points.sum(axis=1)), 14)
    beyond = np.array([[9.0, -1.0]])
    assert np.abs(result(INSIDE) - np.exp(1j * INSIDE.sum(axis=1))).max() < 1e-10
    assert np.abs(result(beyond) - np.exp(1j * (HIGH[0] - 1.0))).max() < 1e-10


def test_interpolation_error_falls_at_rate_of_nearest_pole():
    """1 / (x + 1) over 1 to 3: its pole is three half boxes from the middle, so a point more leaves 1 / (3 + sqrt(8))
    (Trefethen, Approximation Theory and Approximation Practice, theorem 8.2).
    """
    off = [np.abs(interpolant(lambda points: 1.0 / (points[:, 0] + 0.0 * points[:, 1] + 1.0), count)(INSIDE)
                  - 1.0 / (INSIDE[:, 0] + 1.0)).max() for count in (4, 6)]
    assert off[0] / off[1] == approx((3.0 + np.sqrt(8.0)) ** 2, rel=0.3)


def test_surrogate_slopes_equal_polynomial_derivatives():
    x, y = INSIDE.T
    slopes = np.array([[3.0 * x**2 - 2.0 * y**2, 1.0 - 4.0 * x * y], [y, x]]).transpose(2, 0, 1)
    chart = fit(cubic, 3, monomials)
    assert chart.degree == 3
    assert chart.slope(INSIDE) == approx(slopes, rel=1e-6, abs=1e-5)


def test_chebyshev_surrogate_extrapolates_linearly_beyond_box():
    """They ended there: a sensor beyond its chart read the same under every load, and states errors of thousands of
    newtons.
    """
    chart = fit(cubic, 3, chebyshev)
    for corner, way in ((HIGH, 1.0), (LOW, -1.0)):
        at = np.array([corner, corner + way * 1e-6 * (HIGH - LOW), corner + way * 3.0 * (HIGH - LOW)])
        at[:, 1] = INSIDE[0, 1]
        here, near, far = chart(at)
        assert far - here == approx(3e6 * (near - here), rel=1e-6)
        assert near - here == approx(cubic(at[1:2])[0] - cubic(at[:1])[0], rel=1e-4)
