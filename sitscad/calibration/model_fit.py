"""One sensor's own errors out of a few points: the model's unknowns, held by the scatter of manufacture."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sitscad.arrays import Array, Flags
from sitscad.calibration.least_squares import Fitted, NoFit, levenberg_marquardt
from sitscad.calibration.points import Points, foretold, load_slopes, tared, whiteners
from sitscad.calibration.sensors import Sensors
from sitscad.record import record

ROUNDS, NEAR = 4, 0.1
"""Rounds of a fit at most: with noise as expected, then as large as what was left shows, the chart set right where it
is; until one moves nothing by more (prior standard deviations)."""

MOST = 100.0
"""How many times larger than expected errors of loads and model may turn out."""

COARSER = (10.0, 30.0, 1.0)
"""How many times larger errors may be in the fits from which one is begun, one after the other while it is needed."""

SUSPECT = 1.5
"""How many times larger than expected errors are where a fit is begun again, and where it is told."""

TRUSTED = 4.0
"""Degrees of freedom that count for loads and model being off by as much as is expected, beside those of the readings:
three loads alone show little of it."""

CONSIDERED = 0.1
"""Step (prior standard deviations) of the slopes over unknowns that are not looked for."""

LEAST_SCATTER = 0.3
"""Least scatter of the other readings (of what is expected) beside which one is called odd: readings of exact loads
scatter by 0.3 to 0.4, and what stands out of less moves no force that anybody sees."""

FARTHEST = 8.0
"""Standard deviations beyond which no unknown is looked for."""


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
    """The most likely errors of a sensor that read so (after drift is taken out), in so many `rounds` at most; raises
    NoFit where none are found.
    """
    points = points.settled
    sigma = np.array([one.sigma for one in sensors.known])
    chosen = np.array([one.is_fitted for one in sensors.known])
    values = np.zeros(int(chosen.sum())) if start is None else (start / sigma)[chosen]
    given = np.log(points.frequency)
    problem = _problem(sensors, points, given, values)
    # about a start the chart holds no farther than that is unsure: other beginnings would lead beyond it
    found = _first(problem, values) if start is None else levenberg_marquardt(problem.residuals, values)
    excess, believed = _excess(found, 1.0), _believed(found, 1.0)
    for _ in range(rounds - 1):
        before, errors = found.values, _errors(found.values, sigma, chosen)
        off = np.log(foretold(sensors, errors, points)) - np.log(foretold(sensors, errors, points, exact=True))
        problem = _problem(sensors, points, given + np.where(np.isfinite(off), off, 0.0), found.values, believed)
        found = levenberg_marquardt(problem.residuals, found.values)
        excess, believed = _excess(found, believed), _believed(found, believed)
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


def _excess(found: Fitted, before: float) -> float:
    """How many times larger than expected errors are, by what is left over what degrees of freedom are."""
    share = math.sqrt(float(found.residuals @ found.residuals) / _freedom(found))
    return min(max(before * share, 1.0), MOST)


def _believed(found: Fitted, before: float) -> float:
    """The same after what is known beforehand of it (`TRUSTED`): the mean of a variance's posterior."""
    square = before**2 * float(found.residuals @ found.residuals)
    return min(max(math.sqrt((TRUSTED + square) / (TRUSTED + _freedom(found))), 1.0), MOST)


def _freedom(found: Fitted) -> float:
    """Degrees of freedom that the readings have beside what is learnt from them, 1 at least."""
    learnt = len(found.values) - float(np.trace(found.covariance))
    return max(len(found.residuals) - learnt, 1.0)


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
    """Residuals (count, each) of every point as the other points foretell it, to first order: what is left, over one
    less the point's own pull; and that (count, each, each).
    """
    left = found.residuals.reshape(count, -1)
    slopes = found.slopes.reshape(count, left.shape[1], -1)
    pull = slopes @ found.covariance @ np.swapaxes(slopes, 1, 2)
    own = np.eye(left.shape[1]) - pull
    return np.asarray(np.linalg.solve(own, left[:, :, None])[:, :, 0]), own
