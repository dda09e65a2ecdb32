"""Fits by least squares: linear ones held small, and nonlinear ones with what is known beforehand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sitscad.arrays import Array
from sitscad.record import record

Residuals = Callable[[Array], Array]

STEP = 1e-3
"""Step of the differences by which slopes are taken, in standard deviations of what is known beforehand."""

MOST_STEPS, ENOUGH = 25, 1e-2
"""Steps of a fit at most, and the largest part of a standard deviation by which the last one may move anything."""


SHORT = 0.1
"""Steps (prior standard deviations) so short that the slopes are still taken for the same."""


class NoFit(ValueError):
    """Residuals or their slopes are not finite where a fit begins or ends."""


@record(eq=False)
class Fitted:
    """The outcome of a fit: `values` (k) in prior standard deviations, their `covariance` (k, k), the `residuals` that
    are left (n; whitened, prior not among them), the `slopes` (n, k) there, and whether it `settled`.
    """

    values: Array
    covariance: Array
    residuals: Array
    slopes: Array
    settled: bool

    @property
    def cost(self) -> float:
        """Sum of squares of residuals and of what the prior adds."""
        return float(self.residuals @ self.residuals + self.values @ self.values)


def levenberg_marquardt(residuals: Residuals, start: Array) -> Fitted:
    """The values that make residuals and the values themselves smallest in squares: with whitened residuals and values
    in standard deviations from what is expected, the most likely ones (Marquardt, SIAM J. Appl. Math. 11, 1963).

    `residuals` gives (n,) numbers at (k,) values; where they are not finite a step is taken back, and a fit ends that
    comes so close that it has no slopes; at the start that raises NoFit (a ValueError), and so do values of
    which no finite covariance is known.
    """
    values, damping, settled = np.array(start, dtype=float), 1e-4, False
    left = residuals(values)
    if not np.all(np.isfinite(left)):
        raise NoFit("a fit cannot begin where its residuals are not finite")
    slope = _slopes(residuals, values, left)
    if not np.all(np.isfinite(slope)):
        raise NoFit("a fit cannot begin where its residuals have no slopes")
    for _ in range(MOST_STEPS):
        normal = slope.T @ slope + np.eye(values.size)
        step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), slope.T @ left + values)
        tried = residuals(values + step)
        before = left @ left + values @ values
        after = tried @ tried + (values + step) @ (values + step) if np.all(np.isfinite(tried)) else np.inf
        if not np.isfinite(after) or after > before:
            damping *= 10.0
            settled = _is_settled(step, normal, slope.T @ left + values)
            if settled:
                break
            continue
        settled = _is_settled(step, normal, slope.T @ left + values)
        values, left, damping = values + step, tried, max(0.1 * damping, 1e-12)
        if settled:
            break
        if np.abs(step).max() > SHORT:
            here = _slopes(residuals, values, left)
            if not np.all(np.isfinite(here)):
                break  # between edges: the last slopes are all that is known, and nothing has settled
            slope = here
    covariance = np.asarray(np.linalg.inv(slope.T @ slope + np.eye(values.size)), dtype=float)
    if not np.all(np.isfinite(covariance)):
        raise NoFit("a fit ended where nothing is known of its values")
    return Fitted(values, covariance, left, slope, settled)


def _is_settled(step: Array, normal: Array, gradient: Array) -> bool:
    """Whether a step (k) is small because the least is near, and not because residuals beyond are not finite."""
    if np.abs(step).max() >= ENOUGH:
        return False
    return bool(np.abs(np.linalg.solve(normal, gradient)).max() < SHORT)


def _slopes(residuals: Residuals, values: Array, there: Array) -> Array:
    """How the residuals change with the values, (n, k), by forward differences, or backward ones at an edge beyond
    which residuals are not finite; not finite between two edges.
    """
    found = []
    for step in np.eye(values.size) * STEP:
        slope = (residuals(values + step) - there) / STEP
        found.append(slope if np.all(np.isfinite(slope)) else (there - residuals(values - step)) / STEP)
    return np.stack(found, axis=1)


def ridge(columns: Array, wanted: Array, weight: float) -> tuple[Array, Array]:
    """Coefficients (terms, outputs) that take columns (n, terms) to what is wanted (n, outputs), held small by `weight`
    of the columns' mean square; and what is left of every row when it is foretold by the others alone (n, outputs).
    """
    size = np.sqrt(np.mean(columns**2, axis=0)) + 1e-300
    scaled = columns / size
    left, singular, right = np.linalg.svd(scaled, full_matrices=False)
    shrunk = singular / (singular**2 + weight * len(columns))
    found = (right.T * shrunk) @ (left.T @ wanted)
    hat = np.sum(left**2 * (singular * shrunk), axis=1)
    alone = (wanted - scaled @ found) / np.maximum(1.0 - hat, 1e-9)[:, None]
    return found / size[:, None], alone
