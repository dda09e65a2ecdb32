"""Legendre polynomials, and the Gauss points that are their zeros.

`numpy.polynomial` has all of it, but takes longer to load than this takes to compute.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sitscad.arrays import Array


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
    both.
    """
    grown = legendre(order + 1, x) - legendre(order + 1, np.zeros(1))
    n = np.arange(1, order + 1)
    return np.concatenate([x[..., None], (grown[..., 2:] - grown[..., :-2]) / (2 * n + 1)], axis=-1)


@lru_cache(maxsize=64)
def gauss(count: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on [-1, 1], kept.

    Eigenvalues of the recursion's symmetric matrix, and twice the squared first elements of its eigenvectors (Golub and
    Welsch 1969).
    """
    n = np.arange(1, count)
    beside = n / np.sqrt(4.0 * n * n - 1.0)
    nodes, vectors = np.linalg.eigh(np.diag(beside, 1) + np.diag(beside, -1))
    nodes, weights = 0.5 * (nodes - nodes[::-1]), vectors[0] ** 2 + vectors[0, ::-1] ** 2
    nodes.setflags(write=False)
    weights.setflags(write=False)
    return nodes, weights
