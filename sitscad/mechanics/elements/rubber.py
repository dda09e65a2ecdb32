"""Ogden's rubber of one term as finite elements take it: a polynomial in the invariants of the stretch.

W = (2 mu / alpha^2) (sum of the stretches to the power alpha - 3) has no closed form in the invariants I1 and I2 of
C = F^T F, and by its principal stretches it has no slope at rest, where they are alike. As a symmetric function of them
it is smooth in I1 and I2, and two even exponents are polynomials: 2 gives I1 / 2, 4 gives (I1^2 - 2 I2) / 8.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Terms = tuple[tuple[int, int, float], ...]

DEGREE, FARTHEST, GRID = 3, 1.0, 41
"""Degree of the polynomial; logarithm of the stretches up to which it is fitted, and how finely. Stresses are within
0.1 % (rms) and 1 % (largest, at the ends) for exponents from 2 to 4 (tests/mechanics/test_rubber.py)."""


@cache
def invariant_terms(exponent: float) -> Terms:
    """Powers of I1 - 3 and I2 - 3 with their coefficients: their sum is W over the shear modulus of incompressible
    rubber. Fitted to stresses by least squares; the modulus at rest is exact.
    """
    first = 0.125 * (exponent - 2.0)
    powers = [(i, total - i) for total in range(2, DEGREE + 1) for i in range(total, -1, -1)]
    stretch, size = _states(exponent)
    rows, wanted = [], []
    for side in (0, 1):
        slopes = _slopes(stretch, side)
        rows.append(_columns(stretch, slopes, powers) / size[:, None])
        linear = _columns(stretch, slopes, [(1, 0), (0, 1)])
        given = _stress(stretch, exponent, side) - linear @ [0.5 + first, -first]
        wanted.append(given / size)
    found = np.linalg.lstsq(np.vstack(rows), np.concatenate(wanted), rcond=None)[0]
    higher = ((i, j, float(value)) for (i, j), value in zip(powers, found, strict=True))
    return (1, 0, 0.5 + first), (0, 1, -first), *higher


def _states(exponent: float) -> tuple[Array, Array]:
    """Stretches (n, 3) of constant volume, and the size (n) of their stresses over the modulus: no unit."""
    each = np.linspace(-FARTHEST, FARTHEST, GRID)
    one, two = (part.ravel() for part in np.meshgrid(each, each))
    logs = np.stack([one, two, -one - two], axis=1)
    stretch = np.exp(logs[np.abs(logs).max(axis=1) <= FARTHEST + 1e-12])
    return stretch, np.hypot(_stress(stretch, exponent, 0), _stress(stretch, exponent, 1)) + 1e-3


def _stress(stretch: Array, exponent: float, side: int) -> Array:
    """Difference of a principal stress and the third over the modulus (no unit): slope of W by the logarithm of that
    stretch (Ogden 1972).
    """
    return np.asarray(2.0 / exponent * (stretch[:, side] ** exponent - stretch[:, 2] ** exponent))


def _slopes(stretch: Array, side: int) -> tuple[Array, Array]:
    """Slopes (no unit) of I1 and I2 by the logarithm of a stretch, the third one giving way."""
    square = stretch**2
    return 2.0 * (square[:, side] - square[:, 2]), 2.0 * (1.0 / square[:, 2] - 1.0 / square[:, side])


def _columns(stretch: Array, slopes: tuple[Array, Array], powers: list[tuple[int, int]]) -> Array:
    """Slopes (n, terms; no unit) of products of powers of I1 - 3 and I2 - 3."""
    x, y = np.sum(stretch**2, axis=1) - 3.0, np.sum(stretch**-2.0, axis=1) - 3.0
    found = []
    for i, j in powers:
        by_x = i * x ** max(i - 1, 0) * y**j if i else 0.0 * x
        by_y = j * y ** max(j - 1, 0) * x**i if j else 0.0 * x
        found.append(by_x * slopes[0] + by_y * slopes[1])
    return np.stack(found, axis=1)
