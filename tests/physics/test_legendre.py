"""Legendre polynomials, their integrals and Gauss points, against numpy's own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre as reference
from tolerance import approx

from sitscad.physics.special.legendre import gauss, legendre, legendre_integrals

X = np.linspace(-1.0, 1.0, 31).reshape(1, 31)


@pytest.mark.parametrize("count", [1, 2, 3, 8, 17, 48])
def test_gauss_points(count):
    nodes, weights = gauss(count)
    expected, shares = reference.leggauss(count)
    assert np.allclose(nodes, expected, rtol=0.0, atol=1e-15)
    assert np.allclose(weights, shares, rtol=2e-12, atol=0.0)
    assert weights @ nodes ** (2 * count - 2) == approx(2.0 / (2 * count - 1), rel=1e-13)


@pytest.mark.parametrize("order", [0, 1, 2, 9, 24])
def test_polynomials(order):
    assert np.allclose(legendre(order, X), reference.legvander(X, order), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("order", [0, 1, 4])
def test_integrals_from_zero(order):
    expected = reference.legval(X, reference.legint(np.eye(order + 1)))
    assert np.allclose(legendre_integrals(order, X), np.moveaxis(expected, 0, -1), rtol=0.0, atol=1e-15)
