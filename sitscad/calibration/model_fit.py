"""Fit of one sensor's deviations from the design to a few measured points.

The unknowns are found by nonlinear least squares. Their manufacturing scatter is the prior.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from statistics import NormalDist

import numpy as np

from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.calibration.points import (
    Points,
    chi_square_chance,
    covariances,
    load_errors,
    load_slopes,
    predicted_frequencies,
    subtract_tare,
    whiteners,
)
from sitscad.calibration.sensors import Sensors

Residuals = Callable[[Array], Array]

STEP = 1e-3  # Step of the differences for derivatives (prior standard deviations)
"""Step (prior standard deviations) of the finite differences for derivatives with respect to fitted unknowns."""

MOST_STEPS = 25
"""Largest number of steps of a fit."""

ENOUGH = 1e-2
"""Step size (prior standard deviations) below which the fit checks whether it has converged."""

SHORT = 0.1  # Largest step (prior standard deviations) after which derivatives are reused
"""Largest step (prior standard deviations) after which the derivatives of the step before are used again."""


class NoFit(ValueError):
    """Raised if the residuals of a fit or their derivatives are not finite at its start or its end."""


@record(eq=False)
class LeastSquaresFit:
    """Result of a least-squares fit of k values to n residuals.

    `values` (k) are the most likely values, in prior standard deviations, and `covariance` (k, k) is their covariance.
    `residuals` (n) are the residuals at these values, in standard deviations and without the prior. `slopes` (n, k) are
    the derivatives of the residuals with respect to the values. `settled` is True if the fit converged.
    """

    values: Array
    covariance: Array
    residuals: Array
    slopes: Array
    settled: bool

    @property
    def cost(self) -> float:
        """Sum of the squares of the residuals and of the values (the prior)."""
        return float(self.residuals @ self.residuals + self.values @ self.values)


def levenberg_marquardt(residuals: Residuals, start: Array) -> LeastSquaresFit:
    """Minimise the sum of squares of the residuals and of the values.

    The method is by Marquardt (SIAM J. Appl. Math. 11, 1963).

    With whitened residuals, and values in prior standard deviations, these are the most likely values.

    Parameters
    ----------
    residuals
        Function that returns residuals (n,) at values (k,). A step to residuals that are not finite is rejected.
    start
        First values (k,).

    Raises
    ------
    NoFit
        (a ValueError) if residuals or derivatives are not finite at the start, or if the covariance is not finite

    Notes
    -----
    A fit ends without convergence if it comes to values without finite derivatives.
    """
    values, damping, settled = np.array(start, dtype=float), 1e-4, False
    remainder = residuals(values)
    if not np.all(np.isfinite(remainder)):
        raise NoFit("a fit cannot begin where its residuals are not finite")
    slope = _slopes(residuals, values, remainder)
    if not np.all(np.isfinite(slope)):
        raise NoFit("a fit cannot begin where its residuals have no slopes")
    for _ in range(MOST_STEPS):
        normal = slope.T @ slope + np.eye(values.size)
        step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), slope.T @ remainder + values)
        trial = residuals(values + step)
        before = remainder @ remainder + values @ values
        after = trial @ trial + (values + step) @ (values + step) if np.all(np.isfinite(trial)) else np.inf
        # small because the minimum is near, and not because residuals beyond are not finite
        newton = np.linalg.solve(normal, slope.T @ remainder + values) if np.abs(step).max() < ENOUGH else np.inf
        settled = bool(np.abs(newton).max() < SHORT)
        is_better = bool(np.isfinite(after) and after <= before)
        damping = max(0.1 * damping, 1e-12) if is_better else 10.0 * damping
        if is_better:
            values, remainder = values + step, trial
        if settled:
            break
        if is_better and np.abs(step).max() > SHORT:
            here = _slopes(residuals, values, remainder)
            if not np.all(np.isfinite(here)):
                break  # between edges: keep the last derivatives, and the fit has not converged
            slope = here
    covariance = np.asarray(np.linalg.inv(slope.T @ slope + np.eye(values.size)), dtype=float)
    if not np.all(np.isfinite(covariance)):
        raise NoFit("a fit ended where nothing is known of its values")
    return LeastSquaresFit(values, covariance, remainder, slope, settled)


def _slopes(residuals: Residuals, values: Array, there: Array, size: float = STEP) -> Array:
    """Return the derivatives (n, k) of residuals with respect to values, from forward differences of step `size`.

    Backward differences are used if residuals are not finite at the forward step. `there` (n) are the residuals at
    `values` (k).
    """
    columns = []
    for step in np.eye(values.size) * size:
        slope = (residuals(values + step) - there) / size
        columns.append(slope if np.all(np.isfinite(slope)) else (there - residuals(values - step)) / size)
    return np.stack(columns, axis=1)


ROUNDS = 6
"""Largest number of rounds of a fit. Each round uses the scatter from the round before and a corrected surrogate."""

NEAR = 0.1
"""Largest change of each unknown between two rounds (prior standard deviations) at which the fit ends."""

SAME = 0.3
"""Largest change of the scatter's natural logarithm between two rounds at which the fit ends. `NEAR` must hold, too."""

SCATTERS = np.geomspace(1e-4, 1.0, 33)
"""Trial values of the scatter: the standard deviation of errors in addition to the expected errors.

For loads, it is in full scales. For poses, it is relative to the change of ln f from rest (f: frequency). All trial
values are equally likely before the fit (Jeffreys' prior of a scale).
"""

COARSE = 0.1
"""Scatter at the start of a fit. With a smaller value, a fit may end at a wrong minimum or at the limit `FARTHEST`."""

SUSPECT = 1.5  # Ratio of errors to expected errors above which this is reported
"""Ratio of actual errors to expected errors (`ModelFit.excess`) above which a note is given."""

LIKELY, LIKELY_SEED = 400, 8  # Number of drawn sensors that agree with measured points, and their seed
"""Number of randomly drawn sensors that agree with the measured points, and seed of the random numbers."""

CONSIDERED = 0.1  # Step (prior standard deviations) of derivatives by unknowns that are not fitted
"""Step (prior standard deviations) of the finite differences for derivatives with respect to unfitted unknowns."""

FARTHEST = 8.0  # Largest value of a fitted unknown (prior standard deviations)
"""Limit for a fitted unknown (prior standard deviations). Steps beyond it are rejected."""


@record(eq=False)
class ModelFit:
    """The fitted errors of one sensor.

    Attributes
    ----------
    errors : array (unknowns)
        fitted values of the unknowns in their own units (m, rad, relative)
    moved : array (unknowns)
        fitted values of the unknowns in prior standard deviations
    sigma : array (unknowns)
        standard deviation of each fitted value over its prior standard deviation; 1 if the points give no information
    likely : array (sensors, unknowns)
        unknowns of randomly drawn sensors that agree with the readings, minus `moved` (prior standard deviations)
    scatter : float
        standard deviation of errors in addition to the expected errors (full scales of the loads; for poses, relative
        to the change of ln f from rest)
    excess : float
        ratio of the total errors to the expected errors
    force_errors : array (n, axes) or None
        difference of each point's force from the force predicted by a fit without this point (N; NaN at rest); None
        for poses
    odd : array (n)
        disagreement of each point with a fit to the other points. It is the number of standard deviations of a normal
        distribution with the same probability as the point's chi-square
    settled : bool
        whether the fit converged
    cost : float
        minus twice the logarithm of the likelihood of the readings
    """

    errors: Array
    moved: Array
    sigma: Array
    likely: Array
    scatter: float
    excess: float
    force_errors: Array | None
    disagreement: Array
    settled: bool
    cost: float


def fit_model(sensors: Sensors, points: Points, start: ModelFit | None = None, rounds: int = ROUNDS) -> ModelFit:
    """Return the most likely errors of a sensor by its readings, after removal of drift. Raises NoFit.

    The fit begins at the values of `start`, a fit with another surrogate. After every round, solved poses correct the
    surrogate for the next round. With `rounds` of 1, the surrogate is not corrected.
    """
    points = points.without_drift
    fitted = [each.is_fitted for each in sensors.unknowns]
    values = np.zeros(sum(fitted)) if start is None else start.moved[fitted]
    scatter = COARSE if start is None else start.scatter
    measured = aim = np.log(points.frequency)
    for number in range(ROUNDS):
        problem = _problem(sensors, points, aim, values, scatter)
        fit = levenberg_marquardt(problem.residuals, values)
        likely = _draw_likely_sensors(problem, fit)
        near = np.abs(fit.values - values).max() < NEAR and abs(math.log(likely.scatter / scatter)) < SAME
        values, scatter = fit.values, likely.scatter
        if near and number:
            break
        if rounds > 1:
            errors = problem.errors(values)
            off = np.log(predicted_frequencies(sensors, errors, points))
            off -= np.log(predicted_frequencies(sensors, errors, points, exact=True))
            aim = measured + np.where(np.isfinite(off), off, 0.0)
    return _model_fit(problem, fit, likely)


@record(eq=False)
class _Problem:
    """Points to be fitted, with the covariances of their errors.

    `measured` (n, coils) are the natural logarithms of the frequencies, corrected for errors of the surrogate.
    `expected` (n, coils, coils) are covariances of the expected errors, and `more` the additional covariances for a
    scatter of 1. `whitening` (n, coils, coils) are the matrices of `whiteners` for the present `scatter`. `sigma`
    (unknowns) are the prior standard deviations, and `chosen` (unknowns) is True for fitted unknowns.
    """

    sensors: Sensors
    points: Points
    measured: Array
    expected: Array
    more: Array
    scatter: float
    whitening: Array
    sigma: Array
    chosen: Flags

    def errors(self, values: Array) -> Array:
        """Return errors (unknowns; own units) from values of the fitted unknowns (prior standard deviations)."""
        errors = np.zeros(len(self.sigma))
        errors[self.chosen] = values * self.sigma[self.chosen]
        return errors

    def log_frequency_errors(self, errors: Array) -> Array:
        """Return differences (n, coils) of measured and predicted ln f for a sensor with `errors`.

        f is the frequency. The mean difference at rest is subtracted (`subtract_tare`).
        """
        return subtract_tare(self.measured - np.log(predicted_frequencies(self.sensors, errors, self.points)),
                          self.points.at_rest)

    def residuals(self, values: Array) -> Array:
        """Return the flat residuals (n times coils) in standard deviations. Infinite if a value exceeds `FARTHEST`."""
        if not np.abs(values).max() < FARTHEST:
            return np.full(self.measured.size, np.inf)
        off = self.log_frequency_errors(self.errors(values))
        return np.asarray(np.einsum("ncd,nd->nc", self.whitening, off).ravel())


def _problem(sensors: Sensors, points: Points, aim: Array, values: Array, scatter: float) -> _Problem:
    """Return the points to be fitted, with covariances at these `values` of the fitted unknowns. Raises NoFit.

    `aim` (n, coils) are the measured ln f, corrected for errors of the surrogate.
    """
    sigma, chosen = (np.array([getattr(each, name) for each in sensors.unknowns]) for name in ("sigma", "is_fitted"))
    empty = np.zeros((0, 0, 0))
    problem = _Problem(sensors, points, aim, empty, empty, scatter, empty, sigma, chosen)
    try:
        expected, more = covariances(sensors, problem.errors(values), points)
        white = whiteners(expected + scatter**2 * more)
    except np.linalg.LinAlgError as error:
        raise NoFit("the model foretells no readings where a fit went") from error
    return replace(problem, expected=expected, more=more, whitening=white)


@record(eq=False)
class _LikelySensors:
    """Randomly drawn sensors that agree with the readings, and the likely scatter of errors.

    `sensors` (`LIKELY`, unknowns; prior standard deviations) are differences from the fitted sensor. `scatter` is the
    geometric mean of `SCATTERS`, weighted by their likelihoods. `cost` is minus twice the logarithm of the likelihood
    at the likeliest scatter. `odd` (n) is the `ModelFit.disagreement` of each point.
    """

    sensors: Array
    scatter: float
    cost: float
    odd: Array


def _draw_likely_sensors(problem: _Problem, fitted: LeastSquaresFit) -> _LikelySensors:
    """Return random sensors that agree with the readings, and the scatter. The model is linearised about the fit.

    Unknowns that are not fitted vary, too. The likelihood of a scatter is integrated over all unknowns. Sensors are
    drawn for scatters in proportion to their likelihood (Gelman, Bayesian Data Analysis, 2013, 5.4).
    """
    used = np.zeros(len(problem.sigma))
    used[problem.chosen] = fitted.values
    slopes = _all_slopes(problem, fitted, used * problem.sigma)
    # linear extrapolation to a sensor without errors
    off = problem.log_frequency_errors(used * problem.sigma) - slopes @ used
    costs, centres, roots, odd = [], [], [], []
    for scatter in SCATTERS:
        covariance = problem.expected + scatter**2 * problem.more
        white = whiteners(covariance)
        remainder, slope = (white @ off[..., None]).ravel(), (white @ slopes).reshape(off.size, -1)
        normal = np.eye(len(used)) + slope.T @ slope
        inverse = np.asarray(np.linalg.inv(normal), dtype=float)
        centre = -inverse @ slope.T @ remainder
        centres.append(centre)
        roots.append(np.linalg.cholesky(0.5 * (inverse + inverse.T)))
        costs.append(float(np.linalg.slogdet(covariance)[1].sum() + np.linalg.slogdet(normal)[1]
                           + remainder @ (remainder + slope @ centre)))
        odd.append(leave_one_out_likelihoods(white, slope.reshape(*off.shape, -1), inverse, remainder + slope @ centre))
    weights = _weights(np.array(costs))
    number = np.searchsorted(np.cumsum(weights), (np.arange(LIKELY) + 0.5) / LIKELY).clip(max=len(SCATTERS) - 1)
    normals = np.random.default_rng(LIKELY_SEED).normal(size=(LIKELY, len(used)))
    sensors = np.array(centres)[number] - used + np.einsum("nij,nj->ni", np.array(roots)[number], normals)
    alone, chance = (np.array(part) for part in zip(*odd, strict=True))
    scatter_weights = _weights(np.array(costs)[:, None] - alone)  # (scatters, n), from the other points
    chances = np.clip(np.sum(scatter_weights * chance, axis=0), 1e-300, 1.0 - 1e-12)
    return _LikelySensors(sensors, float(np.exp(weights @ np.log(SCATTERS))), min(costs),
                          -np.vectorize(NormalDist().inv_cdf)(chances))


def _weights(costs: Array) -> Array:
    """Return the likelihoods (scatters, ...) of the trial scatters, with a sum of 1, from `costs`: -2 ln likelihood."""
    weights = np.exp(-0.5 * (costs - costs.min(axis=0)))
    return np.asarray(weights / weights.sum(axis=0))


def _all_slopes(problem: _Problem, fitted: LeastSquaresFit, errors: Array) -> Array:
    """Return derivatives (n, coils, unknowns) of `_Problem.log_frequency_errors` with respect to each unknown.

    They are per prior standard deviation. `errors` (unknowns) are the fitted errors. Unknowns that are not fitted are
    included. Raises NoFit if a derivative is not finite.
    """
    chosen, slopes = problem.chosen, np.empty((*problem.measured.shape, len(errors)))

    def off(values: Array) -> Array:
        moved = errors.copy()
        moved[~chosen] += values * problem.sigma[~chosen]
        return problem.log_frequency_errors(moved).ravel()

    none = np.zeros(int(np.sum(~chosen)))
    slopes[..., chosen] = np.linalg.solve(problem.whitening, fitted.slopes.reshape(*problem.measured.shape, -1))
    slopes[..., ~chosen] = _slopes(off, none, off(none), CONSIDERED).reshape(*problem.measured.shape, -1)
    if not np.all(np.isfinite(slopes)):
        raise NoFit("a fit ended where the pad bears no more")
    return slopes


def leave_one_out_likelihoods(white: Array, slope: Array, inverse: Array, remainder: Array) -> tuple[Array, Array]:
    """Return two arrays (n) with a value for each point, computed from a fit to all other points.

    The first holds minus twice the logarithm of the likelihood of the point's readings. The second holds the
    probability of a larger chi-square than the readings have. The model is linearised: `white` are whitening matrices,
    `slope` the whitened derivatives, `inverse` the covariance of the unknowns, and `remainder` the whitened residuals.
    """
    pulled = np.einsum("ndc,nd->nc", white, remainder.reshape(white.shape[:2]))
    projection = np.eye(white.shape[1]) - slope @ inverse @ np.swapaxes(slope, 1, 2)
    precision = np.swapaxes(white, 1, 2) @ projection @ white
    square = np.einsum("nc,nc->n", pulled, np.linalg.solve(precision, pulled[..., None])[..., 0])
    return square - np.linalg.slogdet(precision)[1], chi_square_chance(square, white.shape[1])


def _model_fit(problem: _Problem, fitted: LeastSquaresFit, likely: _LikelySensors) -> ModelFit:
    """Return the values of the unknowns, their uncertainty, and the errors of each point."""
    sensors, points, count = problem.sensors, problem.points, len(problem.points)
    errors = problem.errors(fitted.values)
    expected = sensors.surrogate_error if points.loads is None else float(
        np.sqrt(np.mean(load_errors(sensors, points.loads[~points.at_rest]) ** 2)))
    excess = math.hypot(1.0, likely.scatter / expected)
    force = None
    if points.loads is not None:
        slopes = problem.whitening @ load_slopes(sensors, errors, points.loads)
        force = np.einsum("nac,nc->na", np.linalg.pinv(slopes),
                          leave_one_out_residuals(fitted, count)) * sensors.range.full_scales
        force[points.at_rest] = np.nan
    moved, sure = np.zeros(len(problem.sigma)), np.ones(len(problem.sigma))
    moved[problem.chosen] = fitted.values
    sure[problem.chosen] = np.sqrt(np.diag(fitted.covariance))
    return ModelFit(errors, moved, sure, likely.sensors, likely.scatter, excess, force, likely.odd,
                    fitted.settled, likely.cost)


def leave_one_out_residuals(fitted: LeastSquaresFit, count: int) -> Array:
    """Return the residuals (count, coils) of each point in a fit without this point, by the linearised model."""
    residuals = fitted.residuals.reshape(count, -1)
    slopes = fitted.slopes.reshape(count, residuals.shape[1], -1)
    remainder = np.eye(residuals.shape[1]) - slopes @ fitted.covariance @ np.swapaxes(slopes, 1, 2)
    return np.asarray(np.linalg.solve(remainder, residuals[:, :, None])[:, :, 0])
