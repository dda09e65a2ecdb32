"""Polynomials of several variables: which terms they have, their values, points that serve to fit them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Exponents = NDArray[np.int64]

PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
"""Bases of Halton's sequence."""


def exponents(weights: Sequence[float], degree: float, least: int = 0) -> Exponents:
    """Exponents (terms, variables) of all products whose weighted degree is at most `degree`, and whose plain one is at
    least `least`; low ones first.
    """
    each = [range(int(degree / weight + 1e-9) + 1) for weight in weights]
    found = [row for row in product(*each) if np.dot(row, weights) <= degree + 1e-9 and sum(row) >= least]
    return np.array(sorted(found, key=lambda row: (sum(row), tuple(-k for k in row))), dtype=np.int64).reshape(
        -1, len(weights)
    )


def monomials(points: Array, powers: Exponents) -> Array:
    """Values (n, terms) of products of powers at (n, variables) points."""
    found = np.ones((len(points), len(powers)))
    for k in range(points.shape[1]):
        highest = int(powers[:, k].max(initial=0))
        found *= (points[:, k : k + 1] ** np.arange(highest + 1))[:, powers[:, k]]
    return found


def chebyshev(points: Array, orders: Exponents) -> Array:
    """Values (n, terms) of products of Chebyshev's polynomials at (n, variables) points of -1 to 1; those beyond count
    as at the end.
    """
    angles = np.arccos(np.clip(points, -1.0, 1.0))
    found = np.ones((len(points), len(orders)))
    for k in range(points.shape[1]):
        highest = int(orders[:, k].max(initial=0))
        found *= np.cos(angles[:, k : k + 1] * np.arange(highest + 1))[:, orders[:, k]]
    return found


def spread(count: int, variables: int, skip: int = 0) -> Array:
    """Points (count, variables) that fill 0 to 1 evenly, always the same: Halton's sequence (1960), from `skip` on.

    Raises ValueError for more variables than there are bases here.
    """
    if variables > len(PRIMES):
        raise ValueError(f"at most {len(PRIMES)} variables")
    return np.array([[_inverse_digits(k + 1 + skip, base) for base in PRIMES[:variables]] for k in range(count)]
                    ).reshape(count, variables)  # fmt: skip


def _inverse_digits(number: int, base: int) -> float:
    """The digits of a number behind the point, turned round."""
    found, share = 0.0, 1.0
    while number:
        share /= base
        number, digit = divmod(number, base)
        found += share * digit
    return found
