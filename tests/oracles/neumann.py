"""Neumann's double integral summed point by point: what closed forms and faster sums are held against."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.kernels.electromagnetics.constants import MU0

Array = NDArray[np.float64]


def sampled_mutual_inductance(
    first: tuple[Array, Array],
    second: tuple[Array, Array],
    clearance: float | Array = 0.0,
    chunk: int = 60_000,
) -> float:
    """Mutual inductance (H) of two filamentary curves far apart against the spacing of their nodes.

    Each curve is (points (n, 3), elements dl (n, 2)) in metres, the elements already weighted by the quadrature.
    `clearance` (m2) lengthens every squared distance, or those from each point of the second curve.
    """
    (p, dp), (q, dq) = first, second
    middle = 0.5 * (p.mean(axis=0) + q.mean(axis=0))
    p, q = p - middle, q - middle
    # Squared distances as one product: (-2 p, p^2, 1) with (q, 1, q^2).
    own = np.column_stack([-2.0 * p, np.sum(p * p, axis=1), np.ones(len(p))])
    other = np.vstack([q.T, np.ones(len(q)), np.sum(q * q, axis=1) + clearance])
    rows = max(1, min(len(p), chunk // max(1, len(q))))
    # Written over again and again: fresh memory for every part would cost as much as the sum.
    distances, total = np.empty((rows, len(q))), 0.0
    for k in range(0, len(p), rows):
        distance = distances[: len(p) - k]
        np.matmul(own[k : k + rows], other, out=distance)
        np.sqrt(distance, out=distance)
        np.divide(1.0, distance, out=distance)
        total += float(np.sum(dp[k : k + rows] * (distance @ dq)))
    return MU0 / (4.0 * math.pi) * total
