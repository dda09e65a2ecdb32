"""Inversion of readings to loads: a nonlinear map of one design, and a test for ambiguous loads.

The map is a polynomial, fitted to exact readings over the box of required loads. Its errors belong to the drawn design,
and it takes little time. The firmware has another map, `calibration.inverse_map`, for noisy readings of all units of a
design. Its range is smaller: both shears share one limit. Crosstalk of both maps differs by up to 1 % of full scale
(tests/documents/test_datasheet.py). Data sheets state both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import chain, islice, product

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.loads.working_range import WorkingRange
from sitscad.estimates.performance.bench import LoadModel
from sitscad.estimates.performance_values import Loads, loads_on_axis
from sitscad.kernels.electromagnetics.polynomials import POINTS_A_TERM, Polynomial, exponents, least_squares

GRID = {1: 13, 2: 8, 3: 5}  # Points along each axis of the map's fit, by the number of axes
HELD_OUT = {1: 6, 2: 5, 3: 4}  # Points along each axis of the map's test
MOST_DEGREE = 6  # Highest degree of the map

APART = 0.1
"""Least distance between two loads, as a fraction of full scale, at which they count as different loads."""

MAX_POLYNOMIAL_DIFFERENCE = 1e-3
"""Largest difference of readings up to which the polynomials count two loads as ambiguous, over the readings' span."""

MAX_MODEL_DIFFERENCE = 3e-3
"""Largest difference of readings up to which the response model counts two loads as ambiguous, over the span."""

MAX_SURROGATE_DIFFERENCE = 1e-2
"""Largest difference of readings of two loads, computed by a surrogate, up to which the response model tests them.

It is divided by the span of the readings. The surrogate has errors of some per cent of the span, so the response model
decides whether the loads are ambiguous.
"""

LOAD_STEP = 1e-2
"""Step of a load, as a fraction of full scale, for numerical derivatives of the readings with respect to the load."""

MAX_PLOT_ERROR = 3e-3  # Largest rms error of readings, over their span, in plots: less than a line's width

LEAST_SINGULAR_RATIO = 0.1
"""Least singular value of the matrix of the readings' derivatives that Gauss-Newton steps use, divided by the largest.

In directions with smaller singular values, readings hardly change. A step in these directions would bring the two loads
together.
"""

SWEEP = 5  # Loads along an axis at which crosstalk is computed
Crosstalk = dict[str, dict[str, float]]  # Errors by axis, and by the axis that causes them

START_PAIRS = 12  # Pairs of loads from which the search for equal readings starts

LEAST_TOLD = 4
"""Number of grid points around which ambiguous loads are searched. They are the points with the least sensitivity."""

MAX_REFINED_PAIRS = 8
"""Largest number of pairs of loads that are refined with the load model.

Pairs at points of least sensitivity come first, then pairs that the polynomials suggest.
"""

MAX_REFINING_STEPS = 8
"""Largest number of Gauss-Newton steps that refine a pair of loads."""


LEAST_SHARE = 1e-10
"""Least singular value of the matrix of terms, divided by the largest, that a polynomial's fit includes."""

LEAST_SHARE_REDUNDANT = 1e-4
"""Least singular value as in LEAST_SHARE, for fits with more variables (coils) than outputs (axes).

The readings of such fits lie on a surface with as many dimensions as there are axes. Relative deviations from it below
1e-4 depend on the leads and on manufacture. Coefficients that are fitted to such deviations of one design caused errors
of several full scales on another unit (four coils, three forces).
"""


def fit_polynomial(points: Array, values: Array, degree: int) -> Polynomial:
    """Return the polynomial fitted to points (n, variables) and values (n, outputs), without a constant term.

    It is 0 for zero readings. Raises ValueError if there are fewer points than terms. Terms have powers up to `degree`.
    """
    powers = exponents([1.0] * points.shape[1], degree, 1)
    if len(points) < len(powers):
        raise ValueError(f"{len(points)} points do not hold {len(powers)} terms")
    scale = np.maximum(np.abs(points).max(axis=0), 1e-300)
    least = LEAST_SHARE_REDUNDANT if points.shape[1] > values.shape[1] else LEAST_SHARE
    return least_squares(points, values, powers, -scale, scale, least=least)


def fit_best_polynomial(points: Array, values: Array, held_out: tuple[Array, Array], most: int) -> Polynomial:
    """Return the polynomial of degree 1 to `most` that has the least rms error at held-out points.

    `held_out` holds points and values that are not fitted. Errors are relative to the span of the values.
    """
    best, apart = None, np.inf
    span = np.maximum(np.ptp(values, axis=0), 1e-300)
    for degree in range(1, most + 1):
        if POINTS_A_TERM * len(exponents([1.0] * points.shape[1], degree, 1)) > len(points):
            break
        polynomial = fit_polynomial(points, values, degree)
        error = float(np.sqrt(np.mean(((polynomial(held_out[0]) - held_out[1]) / span) ** 2)))
        if error < 0.9 * apart:
            best, apart = polynomial, error
    assert best is not None
    return best


@record(eq=False)
class SolvedRange:
    """Loads (n, 3 or 5; N, N m) over the required range, with their readings (n, coils).

    The normal axis goes from zero to full scale, and the other measured axes from minus to plus full scale. The map is
    fitted to `loads` and `readings`, and tested on the loads and readings of `held_out`.
    """

    bench: LoadModel
    """Load model from which readings are computed."""
    loads: Array
    readings: Array
    held_out: tuple[Array, Array]

    @cached_property
    def map(self) -> Polynomial:
        """Polynomial from readings to loads (N, N m) on measured axes, with the least error at held-out loads."""
        columns = self.bench.range.columns
        return fit_best_polynomial(self.readings, self.loads[:, columns],
                                   (self.held_out[1], self.held_out[0][:, columns]), MOST_DEGREE)

    @cached_property
    def forward(self) -> Polynomial:
        """Polynomial from loads (N, N m) on measured axes to readings, with the least error at held-out loads."""
        columns = self.bench.range.columns
        return fit_best_polynomial(self.loads[:, columns], self.readings,
                                   (self.held_out[0][:, columns], self.held_out[1]), MOST_DEGREE)

    @cached_property
    def map_errors(self) -> Array:
        """Rms error (N, N m) of the map at held-out loads, for every measured axis."""
        loads, readings = self.held_out
        return np.asarray(np.sqrt(np.mean((self.map(readings) - loads[:, self.bench.range.columns]) ** 2, axis=0)))

    @cached_property
    def is_interpolated(self) -> bool:
        """Whether `forward` is exact enough for plots: its rms error is below `MAX_PLOT_ERROR` of each coil's span."""
        loads, readings = self.held_out
        off = np.sqrt(np.mean((self.forward(loads[:, self.bench.range.columns]) - readings) ** 2, axis=0))
        return bool(np.all(off < MAX_PLOT_ERROR * np.ptp(self.readings, axis=0)))

    def read(self, loads: Array) -> Array:
        """Return readings (n, coils) under loads (n, 3 or 5; N, N m) of the range.

        They are interpolated by `forward` if it is exact enough for plots, and otherwise computed by the load model.
        """
        if self.is_interpolated:
            return self.forward(loads[:, self.bench.range.columns])
        return self.bench.readings(self.bench.poses(loads))

    def ambiguous_loads(self, exact: Callable[[], LoadModel]) -> tuple[Loads, Loads] | None:
        """Return two loads (N, N m) in the range with equal readings. None if no such pair is found.

        `exact` returns a more exact load model. It computes only loads whose readings are nearly equal by this load
        model.
        """
        ranged = self.bench.range
        pairs = islice(chain(self._insensitive_loads(), _ambiguous_loads(self.forward, ranged)), MAX_REFINED_PAIRS)
        nearly = [pair for pair in (self._refine_pair(*pair, MAX_SURROGATE_DIFFERENCE) for pair in pairs)
                  if pair is not None]
        judge = replace(self, bench=exact()) if nearly else self
        polished = (judge._refine_pair(*pair, MAX_MODEL_DIFFERENCE) for pair in nearly)
        loads = (ranged.loads_at(np.array(pair)) for pair in polished if pair is not None)
        return next(((_as_loads(first), _as_loads(second)) for first, second in loads), None)

    def _insensitive_loads(self) -> Iterator[tuple[Array, Array]]:
        """Yield pairs of loads (fractions of full scale) around the grid points with the least sensitivity.

        The two loads lie on either side of the point, along the direction of load that changes the readings least. In
        this direction the readings may reverse.
        """
        names, coils = self.bench.range.axes, self.readings.shape[1]
        count, lowest = GRID[len(names)], self.bench.range.lowest
        span = np.maximum(np.ptp(self.readings, axis=0), 1e-300)
        table = (self.readings / span).reshape((count,) * len(names) + (coils,))
        slopes = [np.gradient(table, (1.0 - low) / (count - 1), axis=k) for k, low in enumerate(lowest)]
        _, singular, directions = np.linalg.svd(np.stack(slopes, axis=-1).reshape(-1, coils, len(names)))
        places = np.array(list(product(*(np.linspace(low, 1.0, count) for low in lowest))))
        for flat in np.argsort(singular[:, -1], kind="stable")[:LEAST_TOLD]:
            way = APART * directions[flat, -1]
            middle = np.clip(places[flat], lowest + np.abs(way), 1.0 - np.abs(way))
            yield middle + way, middle - way

    def _refine_pair(self, first: Array, second: Array, tolerance: float) -> tuple[Array, Array] | None:
        """Return the `first` load and a load near `second` with equal readings, both as fractions of full scale.

        Readings count as equal if they differ by less than `tolerance` times their span. The load model computes them,
        and Gauss-Newton steps move the second load. None if no step leads to equal readings, or if the loads come
        closer than `APART`.
        """
        span, lowest = np.maximum(np.ptp(self.readings, axis=0), 1e-300), self.bench.range.lowest
        for _ in range(MAX_REFINING_STEPS):
            steps = LOAD_STEP * np.where(second > 0.5, -1.0, 1.0)  # into the range from any place
            loads = self.bench.range.loads_at(np.vstack([first, second, second + np.diag(steps)]))
            read = self.bench.readings(self.bench.poses(loads)) / span
            lacking = read[0] - read[1]
            if np.linalg.norm(lacking) < tolerance:
                return (first, second) if np.linalg.norm(second - first) > APART else None
            slope = (read[2:] - read[1]).T / steps
            step = np.linalg.lstsq(slope, lacking, rcond=LEAST_SINGULAR_RATIO)[0]
            second = np.clip(second + np.clip(step, -0.2, 0.2), lowest, 1.0)
        return None


def _as_loads(load: Array) -> Loads:
    return tuple(map(float, load))


def solve_range(bench: LoadModel) -> SolvedRange:
    """Return the required loads of a load model, with their readings, for fit and test of a map."""
    axes = len(bench.range.axes)

    def grid(count: int, inside: float) -> Array:
        lines = [np.linspace(low, 1.0, count) * inside for low in bench.range.lowest]
        return bench.range.loads_at(list(product(*lines)))

    fit, judged = grid(GRID[axes], 1.0), grid(HELD_OUT[axes], 0.93)
    readings = bench.readings(bench.poses(np.concatenate([fit, judged])))
    return SolvedRange(bench, fit, readings[: len(fit)], (judged, readings[len(fit) :]))


def _ambiguous_loads(forward: Polynomial, scope: WorkingRange) -> Iterator[tuple[Array, Array]]:
    """Yield pairs of loads (fractions of full scale) that give equal readings by the polynomials.

    The search starts from the pairs of a grid with the nearest readings. Gauss-Newton steps refine the second load.
    Pairs that converge to one load, or whose readings stay different, are dropped. `forward` returns readings from
    loads, and `scope` is the range of loads.
    """
    lowest, full = scope.lowest, scope.full_scales
    count = {1: 41, 2: 13, 3: 7}[len(lowest)]
    places = np.array(list(product(*(np.linspace(low, 1.0, count) for low in lowest))))
    values = forward(places * full)
    span = np.maximum(np.ptp(values, axis=0), 1e-300)
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    between = np.linalg.norm((values[:, None] - values[None]) / span, axis=2)
    ratio = np.where(distances > APART, between / np.maximum(distances, 1e-9), np.inf)
    for flat in np.argsort(ratio, axis=None)[:START_PAIRS]:
        first, second = np.unravel_index(flat, ratio.shape)
        goal, here = forward(places[first][None] * full)[0], places[second].copy()
        for _ in range(20):
            lacking = (goal - forward(here[None] * full)[0]) / span
            slope = forward.slope(here[None] * full)[0] * full / span[:, None]
            step = np.linalg.lstsq(slope, lacking, rcond=1e-6)[0]
            here = np.clip(here + np.clip(step, -0.2, 0.2), lowest, 1.0)
        misfit = float(np.linalg.norm((goal - forward(here[None] * full)[0]) / span))
        if misfit < MAX_POLYNOMIAL_DIFFERENCE and float(np.linalg.norm(here - places[first])) > APART:
            yield places[first], here


def crosstalk_at(working: SolvedRange, load: Array, straight: Array) -> tuple[Crosstalk, ...]:
    """Return the crosstalk around a working point, for two maps: the nonlinear map of `working`, and a linear map.

    `load` (3 or 5; N, N m) is the load at the point. `straight` (axes, coils; N per reading) is the linear map.
    """
    bench = working.bench
    loads = axis_sweeps(bench.range, load)
    readings = bench.readings(bench.poses(loads.reshape(-1, loads.shape[-1])))
    return tuple(map_crosstalk(bench.range, loads, read) for read in (working.map(readings), readings @ straight.T))


def axis_sweeps(scope: WorkingRange, load: Array) -> Array:
    """Return loads (axes, n, 3 or 5; N, N m), one series of loads for each measured axis.

    The first load of a series is `load`. In the other loads, one axis goes from its lower to its upper end. `scope` is
    the range of loads.
    """
    sweeps = zip(scope.axes, scope.lowest, scope.full_scales, strict=True)
    return np.array([np.vstack([load, loads_on_axis(load, name, np.linspace(low, 1.0, SWEEP) * full)])
                     for name, low, full in sweeps])


def map_crosstalk(scope: WorkingRange, loads: Array, read: Array) -> Crosstalk:
    """Return the largest error of each axis while another axis moves over its range, as a fraction of full scale.

    `loads` (axes, n, 3 or 5; N, N m) are from `axis_sweeps`. `read` (axes * n, measured axes; N, N m) are the loads
    that a map returns for their readings.
    """
    forces = read.reshape(*loads.shape[:2], -1)
    true = loads[:, :, scope.columns]
    error = np.abs((forces - forces[:, :1]) - (true - true[:, :1])).max(axis=1) / scope.full_scales
    return {a: {b: float(error[j, k]) for j, b in enumerate(scope.axes) if b != a} for k, a in enumerate(scope.axes)}
