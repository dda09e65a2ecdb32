"""Few heights that stand for many: 1 / distance is smooth in the square of the height where pieces are far apart."""

from __future__ import annotations

import math

import numpy as np

from sitscad.arrays import Array, Index
from sitscad.physics.polynomials import chebyshev_points, shares

RIGHT = math.log(3e-8)
"""Logarithm of what the polynomial in the squared height may be off by."""


def nodes_enough(squares: Array, apart: Array) -> Index:
    """How many nodes stand for sorted squared heights (m2) of points `apart` (n; m): all of them, where no fewer do."""
    low, high = float(squares[0]), float(squares[-1])
    if high <= low:
        return np.ones(apart.shape, dtype=np.intp)
    beyond = 2.0 * (np.maximum(apart, 0.0) ** 2 + low) / max(high - low, 1e-300)
    count = np.ceil(-RIGHT / np.arccosh(1.0 + np.maximum(beyond, 1e-12)))
    return np.clip(count, 1, squares.size).astype(np.intp)


def height_nodes(squares: Array, count: int) -> tuple[Array, Array]:
    """So many squared heights (count; m2), and what each of `squares` (m2) weighs at them (heights, count)."""
    if count >= squares.size:
        return squares, np.eye(squares.size)
    low, high = float(squares[0]), float(squares[-1])
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    if half <= 0.0:
        return squares[:1], np.ones((squares.size, 1))
    nodes = chebyshev_points(-1.0, 1.0, count)
    return middle + half * nodes, shares(nodes, (squares - middle) / half)
