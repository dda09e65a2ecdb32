"""One sensor's own errors out of a few points: the model's unknowns, held by the scatter of manufacture, by nonlinear
least squares with what is known beforehand.
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
    foretold,
    load_errors,
    load_slopes,
    tared,
    whiteners,
)
from sitscad.calibration.sensors import Sensors

Residuals = Callable[[Array], Array]

STEP = 1e-3  # Step of the differences by which slopes are taken, in standard deviations of what is known beforehand

MOST_STEPS, ENOUGH = 25, 1e-2
"""Steps of a fit at most, and the largest part of a standard deviation by which the last one may move anything."""

SHORT = 0.1  # Steps (prior standard deviations) so short that the slopes are still taken for the same


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
        # small because the least is near, and not because residuals beyond are not finite
        newton = np.linalg.solve(normal, slope.T @ left + values) if np.abs(step).max() < ENOUGH else np.inf
        settled = bool(np.abs(newton).max() < SHORT)
        is_better = bool(np.isfinite(after) and after <= before)
        damping = max(0.1 * damping, 1e-12) if is_better else 10.0 * damping
        if is_better:
            values, left = values + step, tried
        if settled:
            break
        if is_better and np.abs(step).max() > SHORT:
            here = _slopes(residuals, values, left)
            if not np.all(np.isfinite(here)):
                break  # between edges: the last slopes are all that is known, and nothing has settled
            slope = here
    covariance = np.asarray(np.linalg.inv(slope.T @ slope + np.eye(values.size)), dtype=float)
    if not np.all(np.isfinite(covariance)):
        raise NoFit("a fit ended where nothing is known of its values")
    return Fitted(values, covariance, left, slope, settled)


def _slopes(residuals: Residuals, values: Array, there: Array, size: float = STEP) -> Array:
    """Derivatives (n, k) of the residuals by forward differences of a `size`, at an edge by backward ones."""
    found = []
    for step in np.eye(values.size) * size:
        slope = (residuals(values + step) - there) / size
        found.append(slope if np.all(np.isfinite(slope)) else (there - residuals(values - step)) / size)
    return np.stack(found, axis=1)


ROUNDS, NEAR, SAME = 6, 0.1, 0.3
"""Rounds of a fit at most, each with the scatter that the one before left and the chart set right where it is; until
one moves no value by more (prior standard deviations), and the scatter by less than this part."""

SCATTERS = np.geomspace(1e-4, 1.0, 33)
"""Scatters of loads (one sigma, full scales) or of changes in poses (parts) beyond what is expected that a table may
have, each as likely beforehand (Jeffreys' prior of a scale)."""

COARSE = 0.1
"""Scatter at the start of a fit. A smaller one can lead to a second minimum or to the edge of the search."""

SUSPECT = 1.5  # How many times larger than expected errors are where it is told

LIKELY, LIKELY_SEED = 400, 8  # Sensors that measured points may come from, and the seed by which they are drawn

CONSIDERED = 0.1  # Step (prior standard deviations) of the slopes over unknowns that are not looked for

FARTHEST = 8.0  # Standard deviations beyond which no unknown is looked for


@record(eq=False)
class ModelFit:
    """The errors of one sensor (unknowns; in their own units), how many prior standard deviations each was moved
    (`moved`) and how sure it is (`sigma`, of the prior's: 1 is nothing learnt).

    `likely` (sensors, unknowns; prior standard deviations) are other sensors from which the readings may come, less
    this one. `scatter` is what loads and model are off by beyond what is expected (full scales; for poses, parts of a
    change), `excess` how many times larger than expected that makes them. `force_errors` (n, axes; N; NaN at rest; None
    for poses) are the errors of each point's force as the other points foretell it, and `odd` (n) is how unlikely the
    chi-square of its readings is beside those of the other points, in standard deviations of a normal number.
    `cost` is minus twice the logarithm of the likelihood of the readings.
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
    """Fit the most likely errors of a sensor that read so (drift taken out). Raises NoFit.

    `start` is a fit by another chart from which this one begins. With one of the `rounds` no pose is solved.
    """
    points = points.settled
    fitted = [one.is_fitted for one in sensors.known]
    values = np.zeros(sum(fitted)) if start is None else start.moved[fitted]
    scatter = COARSE if start is None else start.scatter
    given = aim = np.log(points.frequency)
    for number in range(ROUNDS):
        problem = _problem(sensors, points, aim, values, scatter)
        found = levenberg_marquardt(problem.residuals, values)
        likely = _likely(problem, found)
        near = np.abs(found.values - values).max() < NEAR and abs(math.log(likely.scatter / scatter)) < SAME
        values, scatter = found.values, likely.scatter
        if near and number:
            break
        if rounds > 1:
            errors = problem.errors(values)
            off = np.log(foretold(sensors, errors, points)) - np.log(foretold(sensors, errors, points, exact=True))
            aim = given + np.where(np.isfinite(off), off, 0.0)
    return _told(problem, found, likely)


@record(eq=False)
class _Problem:
    """Points to be fitted: their ln f (n, coils), covariances (n, coils, coils) as expected and those that a scatter of
    1 adds, whiteners at one `scatter`, and the prior standard deviations of the unknowns, of which some are `chosen`.
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
        """Errors (unknowns; in their own units) of values (prior standard deviations) of the fitted unknowns."""
        found = np.zeros(len(self.sigma))
        found[self.chosen] = values * self.sigma[self.chosen]
        return found

    def off(self, errors: Array) -> Array:
        """Errors (n, coils) of `tared` ln f of a sensor with these errors."""
        return tared(self.aim - np.log(foretold(self.sensors, errors, self.points)), self.points.at_rest)

    def residuals(self, values: Array) -> Array:
        """Independent errors of unit size, flat; infinite far from all that is made."""
        if not np.abs(values).max() < FARTHEST:
            return np.full(self.aim.size, np.inf)
        return np.asarray(np.einsum("ncd,nd->nc", self.white, self.off(self.errors(values))).ravel())


def _problem(sensors: Sensors, points: Points, aim: Array, values: Array, scatter: float) -> _Problem:
    """Points to be fitted, whitened where the unknowns have these values (prior standard deviations)."""
    sigma, chosen = (np.array([getattr(one, name) for one in sensors.known]) for name in ("sigma", "is_fitted"))
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
    """What the readings leave likely: `sensors` (`LIKELY`, unknowns; prior standard deviations) less the fitted one,
    the scatter (geometric mean), and minus twice the logarithm of the likelihood at the likeliest scatter; `odd` (n) as
    of a `ModelFit`.
    """

    sensors: Array
    scatter: float
    cost: float
    odd: Array


def _likely(problem: _Problem, found: Fitted) -> _Likely:
    """Sensors and scatter that the readings leave likely, to first order about a fit.

    Unknowns that a fit does not look for are among them. The likelihood of a scatter is integrated over all unknowns,
    and sensors are drawn for scatters as often as these are likely (Gelman, Bayesian Data Analysis, 2013, 5.4).
    """
    used = np.zeros(len(problem.sigma))
    used[problem.chosen] = found.values
    slopes = _all_slopes(problem, found, used * problem.sigma)
    off = problem.off(used * problem.sigma) - slopes @ used  # as if it were linear: what no error at all would leave
    costs, centres, roots, odd = [], [], [], []
    for scatter in SCATTERS:
        covariance = problem.expected + scatter**2 * problem.more
        white = whiteners(covariance)
        left, slope = (white @ off[..., None]).ravel(), (white @ slopes).reshape(off.size, -1)
        normal = np.eye(len(used)) + slope.T @ slope
        inverse = np.asarray(np.linalg.inv(normal), dtype=float)
        centre = -inverse @ slope.T @ left
        centres.append(centre)
        roots.append(np.linalg.cholesky(0.5 * (inverse + inverse.T)))
        costs.append(float(np.linalg.slogdet(covariance)[1].sum() + np.linalg.slogdet(normal)[1]
                           + left @ (left + slope @ centre)))
        odd.append(_beside_others(white, slope.reshape(*off.shape, -1), inverse, left + slope @ centre))
    weights = _weights(np.array(costs))
    number = np.searchsorted(np.cumsum(weights), (np.arange(LIKELY) + 0.5) / LIKELY).clip(max=len(SCATTERS) - 1)
    drawn = np.random.default_rng(LIKELY_SEED).normal(size=(LIKELY, len(used)))
    sensors = np.array(centres)[number] - used + np.einsum("nij,nj->ni", np.array(roots)[number], drawn)
    alone, chance = (np.array(part) for part in zip(*odd, strict=True))
    others = _weights(np.array(costs)[:, None] - alone)  # of scatters, (scatters, n), by the other points
    chances = np.clip(np.sum(others * chance, axis=0), 1e-300, 1.0 - 1e-12)
    return _Likely(sensors, float(np.exp(weights @ np.log(SCATTERS))), min(costs),
                   -np.vectorize(NormalDist().inv_cdf)(chances))


def _weights(costs: Array) -> Array:
    """How likely scatters are, of a sum of 1, by minus twice the logarithm of their likelihoods (scatters, ...)."""
    weights = np.exp(-0.5 * (costs - costs.min(axis=0)))
    return np.asarray(weights / weights.sum(axis=0))


def _all_slopes(problem: _Problem, found: Fitted, errors: Array) -> Array:
    """Change of `off` with every unknown (n, coils, unknowns), those that a fit does not look for among them. Raises
    NoFit where that is not finite.
    """
    chosen, slopes = problem.chosen, np.empty((*problem.aim.shape, len(errors)))

    def off(values: Array) -> Array:
        moved = errors.copy()
        moved[~chosen] += values * problem.sigma[~chosen]
        return problem.off(moved).ravel()

    none = np.zeros(int(np.sum(~chosen)))
    slopes[..., chosen] = np.linalg.solve(problem.white, found.slopes.reshape(*problem.aim.shape, -1))
    slopes[..., ~chosen] = _slopes(off, none, off(none), CONSIDERED).reshape(*problem.aim.shape, -1)
    if not np.all(np.isfinite(slopes)):
        raise NoFit("a fit ended where the pad bears no more")
    return slopes


def _beside_others(white: Array, slope: Array, inverse: Array, left: Array) -> tuple[Array, Array]:
    """Minus twice the logarithm of each point's likelihood after the others (n), and the chance (n) that its readings
    are so far off what all others foretell, by chi-square; to first order, by the inverse of the readings' covariance.
    """
    pulled = np.einsum("ndc,nd->nc", white, left.reshape(white.shape[:2]))
    own = np.eye(white.shape[1]) - slope @ inverse @ np.swapaxes(slope, 1, 2)
    precision = np.swapaxes(white, 1, 2) @ own @ white
    square = np.einsum("nc,nc->n", pulled, np.linalg.solve(precision, pulled[..., None])[..., 0])
    return square - np.linalg.slogdet(precision)[1], chi_square_chance(square, white.shape[1])


def _told(problem: _Problem, found: Fitted, likely: _Likely) -> ModelFit:
    """The fit as it is told: what every unknown came to, how sure it is, and what every point is off by."""
    sensors, points, count = problem.sensors, problem.points, len(problem.points)
    errors = problem.errors(found.values)
    expected = sensors.charted if points.loads is None else float(
        np.sqrt(np.mean(load_errors(sensors, points.loads[~points.at_rest]) ** 2)))
    excess = math.hypot(1.0, likely.scatter / expected)
    force = None
    if points.loads is not None:
        slopes = problem.white @ load_slopes(sensors, errors, points.loads)
        force = np.einsum("nac,nc->na", np.linalg.pinv(slopes), left_out(found, count)) * sensors.range.full_scales
        force[points.at_rest] = np.nan
    moved, sure = np.zeros(len(problem.sigma)), np.ones(len(problem.sigma))
    moved[problem.chosen] = found.values
    sure[problem.chosen] = np.sqrt(np.diag(found.covariance))
    return ModelFit(errors, moved, sure, likely.sensors, likely.scatter, excess, force, likely.odd,
                    found.settled, likely.cost)


def left_out(found: Fitted, count: int) -> Array:
    """Residuals (count, each) of every point by the others, to first order."""
    left = found.residuals.reshape(count, -1)
    slopes = found.slopes.reshape(count, left.shape[1], -1)
    own = np.eye(left.shape[1]) - slopes @ found.covariance @ np.swapaxes(slopes, 1, 2)
    return np.asarray(np.linalg.solve(own, left[:, :, None])[:, :, 0])
