"""One sensor's own errors out of a few points: the model's unknowns, held by the scatter of manufacture, by nonlinear
least squares with what is known beforehand.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sitscad.arrays import Array, Flags
from sitscad.calibration.points import Points, foretold, load_slopes, tared, whiteners
from sitscad.calibration.sensors import Sensors
from sitscad.record import record

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


def _slopes(residuals: Residuals, values: Array, there: Array) -> Array:
    """How the residuals change with the values, (n, k), by forward, or at an edge backward, differences."""
    found = []
    for step in np.eye(values.size) * STEP:
        slope = (residuals(values + step) - there) / STEP
        found.append(slope if np.all(np.isfinite(slope)) else (there - residuals(values - step)) / STEP)
    return np.stack(found, axis=1)


ROUNDS, NEAR = 4, 0.1
"""Rounds of a fit at most: with noise as expected, then as large as what was left shows, the chart set right where it
is; until one moves nothing by more (prior standard deviations)."""

MOST = 100.0  # How many times larger than expected errors of loads and model may turn out

COARSER = (10.0, 30.0, 1.0)
"""How many times larger errors may be in the fits from which one is begun, one after the other while it is needed."""

SUSPECT = 1.5  # How many times larger than expected errors are where a fit is begun again, and where it is told

TRUSTED = 4.0
"""Degrees of freedom that count for loads and model being off by as much as is expected, beside those of the readings:
three loads alone show little of it."""

CONSIDERED = 0.1  # Step (prior standard deviations) of the slopes over unknowns that are not looked for

LEAST_SCATTER = 0.3
"""Least scatter of the other readings (of what is expected) beside which one is called odd: readings of exact loads
scatter by 0.3 to 0.4, and what stands out of less moves no force that anybody sees."""

FARTHEST = 8.0  # Standard deviations beyond which no unknown is looked for


@record(eq=False)
class ModelFit:
    """The errors of one sensor (unknowns; in their own units), how many prior standard deviations each was moved
    (`moved`) and how sure it is (`sigma`, of the prior's: 1 is nothing learnt), with the `covariance` (unknowns,
    unknowns; in prior standard deviations) of what the fit leaves open, those among them that it does not look for; how
    many times larger than expected loads and model were off (`excess`), and are believed to be after so few points
    (`believed`); and, foretold by the other points, the force error of each point (n, axes; N; NaN at rest; None for
    poses) and that of ln f over rest (n, coils); `slips` (n, coils) is the error of ln f of one coil alone that would
    explain a point best, and `odd` (n, coils) how unlikely that is beside the others (`studentized`). `cost` is that of
    the readings with errors as expected and of the prior, in squares of standard deviations.
    """

    errors: Array
    moved: Array
    sigma: Array
    covariance: Array
    excess: float
    believed: float
    force_errors: Array | None
    reading_errors: Array
    slips: Array
    odd: Array
    settled: bool
    cost: float


def fit_model(sensors: Sensors, points: Points, start: Array | None = None, rounds: int = ROUNDS) -> ModelFit:
    """The most likely errors of a sensor that read so (drift taken out), in `rounds` at most; raises NoFit."""
    points = points.settled
    sigma = np.array([one.sigma for one in sensors.known])
    chosen = np.array([one.is_fitted for one in sensors.known])
    values = np.zeros(int(chosen.sum())) if start is None else (start / sigma)[chosen]
    given = np.log(points.frequency)
    problem = _problem(sensors, points, given, values)
    # about a start the chart holds no farther than that is unsure: other beginnings would lead beyond it
    found = _first(problem, values) if start is None else levenberg_marquardt(problem.residuals, values)
    excess, believed = _excess(found, 1.0), _excess(found, 1.0, TRUSTED)
    for _ in range(rounds - 1):
        before, errors = found.values, _errors(found.values, sigma, chosen)
        off = np.log(foretold(sensors, errors, points)) - np.log(foretold(sensors, errors, points, exact=True))
        problem = _problem(sensors, points, given + np.where(np.isfinite(off), off, 0.0), found.values, believed)
        found = levenberg_marquardt(problem.residuals, found.values)
        excess, believed = _excess(found, believed), _excess(found, believed, TRUSTED)
        if np.abs(found.values - before).max() < NEAR:
            break
    plain = _problem(sensors, points, problem.aim, found.values).residuals(found.values)
    told, cost = _told(problem, found, excess, believed), float(plain @ plain + found.values @ found.values)
    return replace(told, cost=cost, odd=studentized(told.odd, cost))


def studentized(odd: Array, cost: float) -> Array:
    """How unlikely readings are that are off by so many standard deviations as expected (n, coils), each beside the
    scatter of all others, in standard deviations of a normal number: externally studentized residuals (Cook and
    Weisberg, Residuals and Influence in Regression, 1982, 2.2.1), by Wallace's approximation to Student's t (Ann. Math.
    Stat. 30, 1959). `cost` is the sum of squares of all, with that of the prior.
    """
    freedom = odd.size - 1
    others = np.sqrt(np.maximum(cost - odd**2, 0.0) / freedom)
    ratio = odd / np.maximum(others, LEAST_SCATTER)
    share = (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
    return np.asarray(share * np.sqrt(freedom * np.log1p(ratio**2 / freedom)))


def _first(problem: _Problem, values: Array) -> Fitted:
    """The first round of a fit: begun from one with coarser readings, which the scatter of manufacture holds more
    firmly, because from far off it may go astray, into a second minimum or to the edge of what is looked for. Where it
    leaves more than is expected other beginnings are tried, and the likeliest is taken.
    """
    tried: list[Fitted] = []
    for times in COARSER:
        coarse = _problem(problem.sensors, problem.points, problem.aim, values, times)
        begun = levenberg_marquardt(coarse.residuals, values).values if times > 1.0 else values
        tried.append(levenberg_marquardt(problem.residuals, begun))
        if tried[-1].settled and _excess(tried[-1], 1.0) < SUSPECT:
            break
    return min(tried, key=lambda one: (not one.settled, one.cost))


def _errors(values: Array, sigma: Array, chosen: Flags) -> Array:
    errors = np.zeros(len(sigma))
    errors[chosen] = values * sigma[chosen]
    return errors


def _excess(found: Fitted, before: float, trusted: float = 0.0) -> float:
    """How many times larger than expected errors are, by what is left over the degrees of freedom that the readings
    have beside what is learnt from them; with so many degrees `trusted` beforehand the mean of a variance's posterior.
    """
    learnt = len(found.values) - float(np.trace(found.covariance))
    free = max(len(found.residuals) - learnt, 1.0)
    square = before**2 * float(found.residuals @ found.residuals)
    return min(max(math.sqrt((trusted + square) / (trusted + free)), 1.0), MOST)


@record(eq=False)
class _Problem:
    # What is to be fitted: ln f (n, coils) at the points, the whiteners of its errors, and the unknowns.
    sensors: Sensors
    points: Points
    aim: Array
    white: Array
    sigma: Array
    chosen: Flags
    excess: float

    def residuals(self, values: Array) -> Array:
        """Independent errors of unit size, flat; infinite far from all that is made."""
        if not np.abs(values).max() < FARTHEST:
            return np.full(self.aim.size, np.inf)
        frequency = foretold(self.sensors, _errors(values, self.sigma, self.chosen), self.points)
        off = tared(self.aim - np.log(frequency), self.points.at_rest)
        return np.asarray(np.einsum("ncd,nd->nc", self.white, off).ravel())


def _problem(sensors: Sensors, points: Points, aim: Array, values: Array, excess: float = 1.0) -> _Problem:
    """What is to be fitted, whitened where the unknowns have these values (prior standard deviations)."""
    sigma = np.array([one.sigma for one in sensors.known])
    chosen = np.array([one.is_fitted for one in sensors.known])
    try:
        white = whiteners(sensors, _errors(values, sigma, chosen), points, excess)
    except np.linalg.LinAlgError as error:
        raise NoFit("the model foretells no readings where a fit went") from error
    return _Problem(sensors, points, aim, white, sigma, chosen, excess)


def _told(problem: _Problem, found: Fitted, excess: float, believed: float) -> ModelFit:
    """The fit as it is told: what every unknown came to, how sure it is, and what every point is off by."""
    sensors, points, count = problem.sensors, problem.points, len(problem.points)
    errors = _errors(found.values, problem.sigma, problem.chosen)
    alone, own = left_out(found, count)
    left = found.residuals.reshape(count, -1)
    pulled = np.einsum("ndc,nd->nc", problem.white, left)
    weight = np.einsum("ndc,nde,nec->nc", problem.white, own, problem.white)
    reading = np.asarray(np.linalg.solve(problem.white, alone[:, :, None])[:, :, 0], dtype=float)
    force = None
    if points.loads is not None:
        slopes = problem.white @ load_slopes(sensors, errors, points.loads)
        force = np.einsum("nac,nc->na", np.linalg.pinv(slopes), alone) * sensors.range.full_scales
        force[points.at_rest] = np.nan
    moved, sure = np.zeros(len(problem.sigma)), np.ones(len(problem.sigma))
    moved[problem.chosen] = found.values
    sure[problem.chosen] = np.sqrt(np.diag(found.covariance))
    return ModelFit(errors, moved, sure, _open(problem, found), excess, believed, force, reading, pulled / weight,
                    problem.excess * np.abs(pulled) / np.sqrt(weight), found.settled, 0.0)


def _open(problem: _Problem, found: Fitted) -> Array:
    """Covariance (unknowns, unknowns; prior standard deviations) of what a fit leaves open: what it is unsure of, and
    what the unknowns that it does not look for put into those that it does ("consider" parameters: Schmidt, Advances in
    Control Systems 3, 1966).
    """
    sensors, errors = problem.sensors, _errors(found.values, problem.sigma, problem.chosen)
    here, slopes = np.log(foretold(sensors, errors, problem.points)), []
    for k in np.flatnonzero(~problem.chosen):
        moved = errors.copy()
        moved[k] += CONSIDERED * problem.sigma[k]
        apart = tared(np.log(foretold(sensors, moved, problem.points)) - here, problem.points.at_rest)
        slopes.append(np.einsum("ncd,nd->nc", problem.white, -apart / CONSIDERED).ravel())
    covariance = np.eye(len(problem.sigma))
    into = -found.covariance @ found.slopes.T @ np.array(slopes).reshape(-1, len(found.residuals)).T
    covariance[np.ix_(problem.chosen, problem.chosen)] = found.covariance + into @ into.T
    covariance[np.ix_(problem.chosen, ~problem.chosen)] = into
    covariance[np.ix_(~problem.chosen, problem.chosen)] = into.T
    return np.asarray(covariance)


def left_out(found: Fitted, count: int) -> tuple[Array, Array]:
    """Residuals (count, each) of every point by the others, to first order; and 1 less its pull (count, each, each)."""
    left = found.residuals.reshape(count, -1)
    slopes = found.slopes.reshape(count, left.shape[1], -1)
    pull = slopes @ found.covariance @ np.swapaxes(slopes, 1, 2)
    own = np.eye(left.shape[1]) - pull
    return np.asarray(np.linalg.solve(own, left[:, :, None])[:, :, 0]), own
