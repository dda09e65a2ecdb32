"""Mean of cos(n phi) / distance between two coaxial circles: Legendre functions of half-integer degree."""

from __future__ import annotations

import numpy as np

from sitscad.arrays import Array

NEAR, BEYOND = 0.3, 70
"""Argument's acosh up to which the recursion is stable upwards; orders beyond the highest from which it starts
downwards (Gil and Segura, Comput. Phys. Commun. 124, 2000)."""


def toroidal(excess: Array, order: int) -> Array:
    """Q_(n - 1/2)(1 + excess) for n = 0 to `order`, first axis, no unit; `excess` (> 0) of any shape. The integral of
    cos(n phi) / distance over phi is 2 Q / sqrt(r1 r2) for circles of radii r1 and r2, 1 + excess being (r1^2 + r2^2 +
    z^2) / (2 r1 r2).
    """
    x = excess.ravel()
    first, elliptic_e = _elliptic(np.sqrt(x / (x + 2.0)))
    modulus = np.sqrt(2.0 / (x + 2.0))
    lowest, next_one = modulus * first, (1.0 + x) * modulus * first - 2.0 / modulus * elliptic_e
    found = np.empty((order + 1, x.size))
    near = np.arccosh(1.0 + x) < NEAR
    found[:, near] = _upwards(1.0 + x[near], lowest[near], next_one[near], order)
    found[:, ~near] = _downwards(1.0 + x[~near], lowest[~near], order)
    return found.reshape(order + 1, *excess.shape)


def _elliptic(complement: Array) -> tuple[Array, Array]:
    """K and E by the arithmetic-geometric mean, from the complementary modulus."""
    a, b = np.ones_like(complement), complement
    total, weight = 0.5 * (1.0 - complement**2), 1.0
    for _ in range(8):
        difference = 0.5 * (a - b)
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        total = total + weight * difference**2
        weight *= 2.0
    first = 0.5 * np.pi / a
    return first, first * (1.0 - total)


def _upwards(x: Array, lowest: Array, next_one: Array, order: int) -> Array:
    found = np.empty((order + 2, x.size))
    found[0], found[1] = lowest, next_one
    for n in range(1, order + 1):
        found[n + 1] = (2 * n * x * found[n] - (n - 0.5) * found[n - 1]) / (n + 0.5)
    return found[: order + 1]


def _downwards(x: Array, lowest: Array, order: int) -> Array:
    """All orders (no unit) by ratios of one to the one below, from far beyond: no number grows too large."""
    found, ratio = np.empty((order + 1, x.size)), np.zeros_like(x)
    for n in range(order + BEYOND, 0, -1):
        ratio = (n - 0.5) / (2 * n * x - (n + 0.5) * ratio)
        if n <= order:
            found[n] = ratio
    found[0] = lowest
    return np.asarray(np.cumprod(found, axis=0), dtype=float)
