"""Ogden's rubber as a polynomial in the invariants of the stretch."""

from __future__ import annotations

import numpy as np
import pytest
from pad_elements import FARTHEST, invariant_terms
from tolerance import approx


def _stress(exponent, stretch):
    """Difference of the first and the third principal stress by the polynomial, (n,)."""

    def energy(logs):
        square = np.exp(2.0 * logs)
        x, y = square.sum(axis=1) - 3.0, (1.0 / square).sum(axis=1) - 3.0
        return sum(value * x**i * y**j for i, j, value in invariant_terms(exponent))

    logs, step = np.log(stretch), 1e-5 * np.array([1.0, 0.0, -1.0])
    return (energy(logs + step) - energy(logs - step)) / 2e-5


def _states(most, count=500):
    logs = np.random.default_rng(3).uniform(-most, most, (count, 2))
    logs = np.column_stack([logs, -logs.sum(axis=1)])
    return np.exp(logs[np.abs(logs).max(axis=1) <= most])


@pytest.mark.parametrize("exponent", [2.0, 2.42, 2.5, 3.05, 3.3, 4.0])
def test_polynomial_stress_matches_ogden_stress(exponent):
    stretch = _states(FARTHEST)
    true = 2.0 / exponent * (stretch[:, 0] ** exponent - stretch[:, 2] ** exponent)
    apart = np.abs(_stress(exponent, stretch) - true)
    assert np.sqrt(np.mean(apart**2)) < 0.004 * np.sqrt(np.mean(true**2))
    near = _states(0.5)
    true = 2.0 / exponent * (near[:, 0] ** exponent - near[:, 2] ** exponent)
    assert np.abs(_stress(exponent, near) - true).max() < 0.004 * np.abs(true).max()


def test_invariant_terms_of_exponents_2_and_4_are_exact():
    """2 is neo-Hookean; for 4 the sum of fourth powers is I1^2 - 2 I2."""
    for exponent, known in ((2.0, {(1, 0): 0.5}), (4.0, {(1, 0): 0.75, (0, 1): -0.25, (2, 0): 0.125})):
        for i, j, value in invariant_terms(exponent):
            assert value == approx(known.get((i, j), 0.0), abs=1e-9)


def test_invariant_terms_have_given_modulus_at_rest():
    for exponent in (2.0, 2.5, 3.3):
        first = {(i, j): value for i, j, value in invariant_terms(exponent)}
        assert 2.0 * (first[1, 0] + first[0, 1]) == approx(1.0, rel=1e-6)
