"""The fit of one sensor's own errors to a few points.

The model's unknowns are found by nonlinear least squares, with the scatter of manufacture as prior.
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
    tared,
    whiteners,
)
from sitscad.calibration.sensors import Sensors

Residuals = Callable[[Array], Array]

STEP = 1e-3  # Step of the differences for derivatives (prior standard deviations)

MOST_STEPS = 25
"""Largest number of steps of a fit."""

ENOUGH = 1e-2
"""Largest last step of a fit, in standard deviations."""

SHORT = 0.1  # Largest step (prior standard deviations) after which derivatives are reused


class NoFit(ValueError):
    """Raised if residuals or their derivatives are not finite at the start or the end of a fit."""


@record(eq=False)
class Fitted:
    """The result of a fit.

    `values` (k) are in prior standard deviations, with `covariance` (k, k). `residuals` (n) are whitened, without the
    prior. `slopes` (n, k) are their derivatives, and `settled` is True if the fit converged.
    """

    values: Array
    covariance: Array
    residuals: Array
    slopes: Array
    settled: bool

    @property
    def cost(self) -> float:
        """Sum of squares of the residuals and of the prior."""
        return float(self.residuals @ self.residuals + self.values @ self.values)


def levenberg_marquardt(residuals: Residuals, start: Array) -> Fitted:
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
    return Fitted(values, covariance, remainder, slope, settled)


def _slopes(residuals: Residuals, values: Array, there: Array, size: float = STEP) -> Array:
    """Return derivatives (n, k) of the residuals by forward differences of a `size`, at an edge by backward ones."""
    columns = []
    for step in np.eye(values.size) * size:
        slope = (residuals(values + step) - there) / size
        columns.append(slope if np.all(np.isfinite(slope)) else (there - residuals(values - step)) / size)
    return np.stack(columns, axis=1)


ROUNDS = 6
"""Largest number of rounds of a fit. Each uses the scatter from the round before, and a corrected surrogate."""

NEAR = 0.1
"""Largest change of a value in the last round of a fit, in prior standard deviations."""

SAME = 0.3
"""Largest change of the logarithm of the scatter in the last round of a fit."""

SCATTERS = np.geomspace(1e-4, 1.0, 33)
"""Possible scatters beyond the expected errors: of loads (one sigma, full scales) or of changes in poses (relative).

All are equally likely beforehand (Jeffreys' prior of a scale).
"""

COARSE = 0.1
"""Scatter at the start of a fit. A smaller value can lead to a second minimum or to the edge of the search."""

SUSPECT = 1.5  # Ratio of errors to expected errors above which this is reported

LIKELY, LIKELY_SEED = 400, 8  # Number of drawn sensors that agree with measured points, and their seed

CONSIDERED = 0.1  # Step (prior standard deviations) of derivatives by unknowns that are not fitted

FARTHEST = 8.0  # Largest value of a fitted unknown (prior standard deviations)


@record(eq=False)
class ModelFit:
    """The fitted errors of one sensor.

    Attributes
    ----------
    errors : array (unknowns)
        errors in their own units
    moved : array (unknowns)
        errors in prior standard deviations
    sigma : array (unknowns)
        standard deviations over the prior ones; 1 if the points carry no information
    likely : array (sensors, unknowns)
        other sensors that agree with the readings, minus this sensor, in prior standard deviations
    scatter : float
        error of loads and model beyond the expected errors (full scales; for poses, relative to a change)
    excess : float
        ratio of the total errors to the expected errors
    force_errors : array (n, axes) or None
        error of each point's force, predicted from the other points (N; NaN at rest); None for poses
    odd : array (n)
        improbability of a point's chi-square beside the other points, as standard deviations of a normal number
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
    odd: Array
    settled: bool
    cost: float


def fit_model(sensors: Sensors, points: Points, start: ModelFit | None = None, rounds: int = ROUNDS) -> ModelFit:
    """Fit the most likely errors of a sensor to its readings, without drift. Raises NoFit.

    `start` is a fit with another surrogate, from which this fit begins. With `rounds` of 1, no pose is solved.
    """
    points = points.settled
    fitted = [each.is_fitted for each in sensors.known]
    values = np.zeros(sum(fitted)) if start is None else start.moved[fitted]
    scatter = COARSE if start is None else start.scatter
    measured = aim = np.log(points.frequency)
    for number in range(ROUNDS):
        problem = _problem(sensors, points, aim, values, scatter)
        fit = levenberg_marquardt(problem.residuals, values)
        likely = _likely(problem, fit)
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
    """Points to be fitted.

    `aim` is their ln f (n, coils). `expected` are covariances (n, coils, coils) of expected errors, and `more` the
    covariances that a scatter of 1 adds. `white` are the whiteners at one `scatter`. `sigma` are the prior standard
    deviations of all unknowns, and `chosen` marks the fitted ones.
    """

    sensors: Sensors
    points: Points
    aim: Array
    expected: Array
    more: Array
    scatter: float
    white: Array
    sigma: Array
    chosen: Flags

    def errors(self, values: Array) -> Array:
        """Return errors (unknowns; own units) from values (prior standard deviations) of the fitted unknowns."""
        errors = np.zeros(len(self.sigma))
        errors[self.chosen] = values * self.sigma[self.chosen]
        return errors

    def off(self, errors: Array) -> Array:
        """Return errors (n, coils) of `tared` ln f of a sensor with these errors."""
        return tared(self.aim - np.log(predicted_frequencies(self.sensors, errors, self.points)), self.points.at_rest)

    def residuals(self, values: Array) -> Array:
        """Return independent errors of unit size, flat. Infinite far beyond all manufactured sensors."""
        if not np.abs(values).max() < FARTHEST:
            return np.full(self.aim.size, np.inf)
        return np.asarray(np.einsum("ncd,nd->nc", self.white, self.off(self.errors(values))).ravel())


def _problem(sensors: Sensors, points: Points, aim: Array, values: Array, scatter: float) -> _Problem:
    """Return points to be fitted, whitened at these values of the unknowns (prior standard deviations)."""
    sigma, chosen = (np.array([getattr(each, name) for each in sensors.known]) for name in ("sigma", "is_fitted"))
    empty = np.zeros((0, 0, 0))
    problem = _Problem(sensors, points, aim, empty, empty, scatter, empty, sigma, chosen)
    try:
        expected, more = covariances(sensors, problem.errors(values), points)
        white = whiteners(expected + scatter**2 * more)
    except np.linalg.LinAlgError as error:
        raise NoFit("the model foretells no readings where a fit went") from error
    return replace(problem, expected=expected, more=more, white=white)


@record(eq=False)
class _Likely:
    """Sensors and scatter that agree with the readings.

    `sensors` (`LIKELY`, unknowns; prior standard deviations) are relative to the fitted sensor. `scatter` is a
    geometric mean. `cost` is minus twice the logarithm of the likelihood at the likeliest scatter. `odd` (n) is as in
    `ModelFit`.
    """

    sensors: Array
    scatter: float
    cost: float
    odd: Array


def _likely(problem: _Problem, fitted: Fitted) -> _Likely:
    """Return sensors and scatter that agree with the readings, to first order about a fit.

    Unknowns that are not fitted are included. The likelihood of a scatter is integrated over all unknowns, and sensors
    are drawn for scatters in proportion to their likelihood (Gelman, Bayesian Data Analysis, 2013, 5.4).
    """
    used = np.zeros(len(problem.sigma))
    used[problem.chosen] = fitted.values
    slopes = _all_slopes(problem, fitted, used * problem.sigma)
    off = problem.off(used * problem.sigma) - slopes @ used  # linear extrapolation to a sensor without errors
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
        odd.append(_beside_others(white, slope.reshape(*off.shape, -1), inverse, remainder + slope @ centre))
    weights = _weights(np.array(costs))
    number = np.searchsorted(np.cumsum(weights), (np.arange(LIKELY) + 0.5) / LIKELY).clip(max=len(SCATTERS) - 1)
    normals = np.random.default_rng(LIKELY_SEED).normal(size=(LIKELY, len(used)))
    sensors = np.array(centres)[number] - used + np.einsum("nij,nj->ni", np.array(roots)[number], normals)
    alone, chance = (np.array(part) for part in zip(*odd, strict=True))
    scatter_weights = _weights(np.array(costs)[:, None] - alone)  # (scatters, n), from the other points
    chances = np.clip(np.sum(scatter_weights * chance, axis=0), 1e-300, 1.0 - 1e-12)
    return _Likely(sensors, float(np.exp(weights @ np.log(SCATTERS))), min(costs),
                   -np.vectorize(NormalDist().inv_cdf)(chances))


def _weights(costs: Array) -> Array:
    """Return normalised likelihoods of scatters from minus twice the logarithm of their likelihoods (scatters, ...)."""
    weights = np.exp(-0.5 * (costs - costs.min(axis=0)))
    return np.asarray(weights / weights.sum(axis=0))


def _all_slopes(problem: _Problem, fitted: Fitted, errors: Array) -> Array:
    """Return derivatives of `off` by every unknown (n, coils, unknowns), including unknowns that are not fitted.

    Raises NoFit if they are not finite.
    """
    chosen, slopes = problem.chosen, np.empty((*problem.aim.shape, len(errors)))

    def off(values: Array) -> Array:
        moved = errors.copy()
        moved[~chosen] += values * problem.sigma[~chosen]
        return problem.off(moved).ravel()

    none = np.zeros(int(np.sum(~chosen)))
    slopes[..., chosen] = np.linalg.solve(problem.white, fitted.slopes.reshape(*problem.aim.shape, -1))
    slopes[..., ~chosen] = _slopes(off, none, off(none), CONSIDERED).reshape(*problem.aim.shape, -1)
    if not np.all(np.isfinite(slopes)):
        raise NoFit("a fit ended where the pad bears no more")
    return slopes


def _beside_others(white: Array, slope: Array, inverse: Array, remainder: Array) -> tuple[Array, Array]:
    """Return two values (n) for each point, given all other points.

    They are minus twice the logarithm of its likelihood, and the probability of a larger chi-square of its readings.
    Both are to first order, from the inverse of the readings' covariance.
    """
    pulled = np.einsum("ndc,nd->nc", white, remainder.reshape(white.shape[:2]))
    projection = np.eye(white.shape[1]) - slope @ inverse @ np.swapaxes(slope, 1, 2)
    precision = np.swapaxes(white, 1, 2) @ projection @ white
    square = np.einsum("nc,nc->n", pulled, np.linalg.solve(precision, pulled[..., None])[..., 0])
    return square - np.linalg.slogdet(precision)[1], chi_square_chance(square, white.shape[1])


def _model_fit(problem: _Problem, fitted: Fitted, likely: _Likely) -> ModelFit:
    """Return the fit for reports: values of the unknowns, their uncertainty, and the errors of every point."""
    sensors, points, count = problem.sensors, problem.points, len(problem.points)
    errors = problem.errors(fitted.values)
    expected = sensors.charted if points.loads is None else float(
        np.sqrt(np.mean(load_errors(sensors, points.loads[~points.at_rest]) ** 2)))
    excess = math.hypot(1.0, likely.scatter / expected)
    force = None
    if points.loads is not None:
        slopes = problem.white @ load_slopes(sensors, errors, points.loads)
        force = np.einsum("nac,nc->na", np.linalg.pinv(slopes), left_out(fitted, count)) * sensors.range.full_scales
        force[points.at_rest] = np.nan
    moved, sure = np.zeros(len(problem.sigma)), np.ones(len(problem.sigma))
    moved[problem.chosen] = fitted.values
    sure[problem.chosen] = np.sqrt(np.diag(fitted.covariance))
    return ModelFit(errors, moved, sure, likely.sensors, likely.scatter, excess, force, likely.odd,
                    fitted.settled, likely.cost)


def left_out(fitted: Fitted, count: int) -> Array:
    """Return residuals (count, each) of every point, predicted from the other points, to first order."""
    residuals = fitted.residuals.reshape(count, -1)
    slopes = fitted.slopes.reshape(count, residuals.shape[1], -1)
    remainder = np.eye(residuals.shape[1]) - slopes @ fitted.covariance @ np.swapaxes(slopes, 1, 2)
    return np.asarray(np.linalg.solve(remainder, residuals[:, :, None])[:, :, 0])
