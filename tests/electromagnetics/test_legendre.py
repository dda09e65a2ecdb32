"""Legendre polynomials, their integrals and Gauss points, against numpy's own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre as reference
from tolerance import approx

from sitscad.kernels.electromagnetics.special_functions import gauss, legendre, legendre_integrals

X = np.linspace(-1.0, 1.0, 31).reshape(1, 31)


@pytest.mark.parametrize("count", [1, 2, 3, 8, 17, 48])
def test_gauss_nodes_and_weights_match_numpy(count):
    nodes, weights = gauss(count)
    expected, shares = reference.leggauss(count)
    assert nodes == approx(expected, abs=1e-15)
    assert weights == approx(shares, rel=2e-12)
    assert weights @ nodes ** (2 * count - 2) == approx(2.0 / (2 * count - 1), rel=1e-13)


@pytest.mark.parametrize("order", [0, 1, 2, 9, 24])
def test_legendre_polynomials_match_numpy(order):
    assert legendre(order, X) == approx(reference.legvander(X, order), abs=1e-14)


@pytest.mark.parametrize("order", [0, 1, 4])
def test_legendre_integrals_match_numpy(order):
    expected = reference.legval(X, reference.legint(np.eye(order + 1)))
    assert legendre_integrals(order, X) == approx(np.moveaxis(expected, 0, -1), abs=1e-15)
