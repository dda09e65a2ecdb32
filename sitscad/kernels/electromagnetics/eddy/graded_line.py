"""Smooth functions along one edge of a box or the radius of a disc: cubic splines, with knots dense towards both ends.

At a metal's edge a current grows like a root of the distance, so knots crowd there geometrically. Every spline is
stored as its values at finer nodes and is linear between them. Then all integrals with Gaussians have a closed form.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.special_functions import gauss, legendre

STEP = 0.45
"""Step of the trapezoidal rule in ln s (see `GaussianSum`), for a relative error of 2e-5 in 1/R.

The error falls like exp(-pi^2 / 2 step).
"""


@record(eq=False)
class GaussianSum:
    """Approximation of 1/R as the sum of `weights` exp(-(scales R)^2) (1/m), for R between two distances.

    Each term is a product of functions of x, y and z, so integrals over boxes separate. On a surface, nearer points
    contribute `tail` (m) times a delta function, which the sum lacks.

    Notes
    -----
    1/R = 2/sqrt(pi) times the integral of exp(-s^2 R^2) over s, by the trapezoidal rule in ln s (Beylkin and Monzon,
    Appl. Comput. Harmon. Anal. 28, 2010). Long wavelengths may be left out, because a constant does not couple to
    currents without sources.
    """

    scales: Array
    weights: Array
    tail: float


def gaussian_sum(nearest: float, farthest: float) -> GaussianSum:
    """Return the sum that holds from `nearest` to `farthest` (m).

    It is the trapezoidal rule of `GaussianSum`. Its tail is the integral over larger s.
    """
    count = math.ceil(math.log(40.0 * farthest / nearest) / STEP)
    scales = 0.05 / farthest * np.exp(STEP * np.arange(count + 1))
    weights = 2.0 / math.sqrt(math.pi) * STEP * scales
    return GaussianSum(scales, weights, 2.0 * math.sqrt(math.pi) / (float(scales[-1]) * math.exp(0.5 * STEP)))


def repeated_integrals(scales: Array, u: Array) -> tuple[Array, Array, Array, Array]:
    """Return the first to fourth repeated integral of exp(-s^2 u^2) over u from 0.

    Parameters
    ----------
    scales : array
        s (1/m)
    u : array
        upper limits (n), rising from 0 or more (m)

    Returns
    -------
    four arrays (scales, n)
        in m, m2, m3 and m4. Their parity alternates, beginning with odd

    Notes
    -----
    n I_n+1 = u I_n + I_n-1 / 2 s^2 (Abramowitz and Stegun 7.2.5).
    """
    first, second, third, fourth = np.empty((4, scales.size, u.size))
    for k, s in enumerate(scales.tolist()):
        narrow, near = 0.5 / (s * s), int(np.searchsorted(u, FAR / s))
        x = s * u[:near]
        falling = np.exp(-x * x)
        first[k] = 0.5 * math.sqrt(math.pi) / s
        first[k, :near] *= _erf(x, falling)
        np.multiply(u, first[k], out=second[k])
        second[k, :near] += narrow * falling
        third[k] = 0.5 * (u * second[k] + narrow * first[k])
        fourth[k] = (u * third[k] + narrow * second[k]) / 3.0
    return first, second, third, fourth


FAR = 6.0
"""Argument of erf from which its value is 1 up to rounding."""

ERF_STEPS = 512
"""Number of tabulated values of erf per unit of its argument."""


@lru_cache(maxsize=1)
def _known_erf() -> Array:
    return np.array([math.erf(k / ERF_STEPS) for k in range(int(FAR * ERF_STEPS) + 1)])


def _erf(x: Array, falling: Array) -> Array:
    """Return erf(x) (no unit) to rounding, for x from 0 to `FAR`; `falling` is exp(-x^2).

    It is Taylor's series from the nearest tabulated value. The next term is below 1e-16 (derivatives: Abramowitz and
    Stegun 7.1.19).
    """
    place = np.rint(x * ERF_STEPS)
    t = x - place / ERF_STEPS
    square = x * x
    more = (2.0 * square - 1.0) / 3.0 + t * x * (2.0 * square - 3.0) / 6.0
    series = t * (1.0 + t * (x + t * more))
    return np.asarray(_known_erf()[place.astype(np.intp)] + 2.0 / math.sqrt(math.pi) * falling * series)


RATIO = 1.7
"""Ratio of successive knot distances, from the ends of the line inwards."""

FINER = 6
"""Number of Gauss nodes for each knot."""

DEGREE = 3
"""Degree of the splines."""

PARITIES = (1, -1)

EQUAL = 1e-12
"""Largest difference of two distances, over half the line, that is rounding alone: the distances count as equal."""


@record(eq=False)
class LineIntegrals:
    """Double integrals of a line's functions with each Gaussian exp(-s^2 (x - x')^2).

    `mass` (scales, n, n; m2) integrates products of two functions, `slope` (scales, n, n; no unit) products of two
    slopes. `end` (scales, n; no unit) is a single integral: a slope times the Gaussian of the distance from the upper
    end.
    """

    mass: Array
    slope: Array
    end: Array


@record(eq=False)
class LineModes:
    """Functions of one parity along a line, or of one order along a radius, described by their integrals.

    A mass is the integral of the product of two functions, a stiffness is the integral of the product of their slopes.
    All but the last function are 0 at the end. They have unit mass, are orthogonal in mass and stiffness, and have the
    stiffnesses `squares` (n - 1; 1/m2). The last function is 1 at the end and orthogonal to the others in stiffness.
    `ends` (n - 1) are the masses of the last function with the others. `mass` and `stiffness` are the last function's
    own values.
    """

    squares: Array
    ends: Array
    mass: float
    stiffness: float


def line_modes(mass: Array, stiffness: Array) -> tuple[Array, LineModes]:
    """Return combinations of functions (n, n; columns, no unit) as in `LineModes`, and their relations.

    `mass` and `stiffness` are the matrices of the functions (textbook). Only the last function is not 0 at the end, and
    it is 1 there.
    """
    root = np.linalg.inv(np.linalg.cholesky(mass[:-1, :-1]))
    squares, vectors = np.linalg.eigh(root @ stiffness[:-1, :-1] @ root.T)
    combinations = np.zeros_like(mass)
    combinations[:-1, :-1], combinations[-1, -1] = root.T @ vectors, 1.0
    combinations[:-1, -1] = -np.linalg.solve(stiffness[:-1, :-1], stiffness[:-1, -1])
    last = combinations[:, -1]
    ends = combinations[:, :-1].T @ (mass @ last)
    return combinations, LineModes(squares, ends, float(last @ mass @ last), max(float(last @ stiffness @ last), 0.0))


@record(eq=False)
class GradedLine:
    """Functions on [-half, half] (m): even ones under the key 1, odd ones under -1, as values (nodes, n) at the nodes.

    Only the last function of each parity is not 0 at the end. It is 1 there: a constant or a straight line. `modes` are
    the relations of the functions.
    """

    half: float
    nodes: Array
    values: Mapping[int, Array]
    modes: Mapping[int, LineModes]

    @cached_property
    def steps(self) -> Array:
        """Distances of the nodes (m)."""
        return np.diff(self.nodes)

    def bends(self, parity: int) -> Array:
        """Return the jumps of the slope (nodes, n; 1/m). Beyond both ends the slope is 0."""
        slopes = np.diff(self.values[parity], axis=0) / self.steps[:, None]
        nothing = np.zeros_like(slopes[:1])
        return np.diff(np.concatenate([nothing, slopes, nothing]), axis=0)

    def integrals(self, scales: Array) -> dict[int, LineIntegrals]:
        """Return integrals with exp(-s^2 (x - x')^2) for every s (1/m), by parity.

        Integration by parts leaves the jumps of the slopes times repeated integrals (derived here).
        """
        # half of the line is enough: every function and its bends are even or odd
        middle = self.nodes.size // 2
        x = self.nodes[middle:]
        share = np.ones((x.size, 1))
        share[: self.nodes.size % 2] = 0.5
        # each distance of nodes once, because nodes have equal steps: (scales, side, nodes, nodes)
        apart = np.stack([np.abs(x[:, None] - x), x[:, None] + x])
        steps = np.round(apart / (EQUAL * self.half)).astype(np.int64)
        _, distinct, which = np.unique(steps, return_index=True, return_inverse=True)
        which = which.reshape(apart.shape)
        first_integral, two, three, four = repeated_integrals(scales, apart.ravel()[distinct])
        ends = [share * self.bends(parity)[middle:] for parity in PARITIES]
        masses, slopes = (_quadratic_forms(ends, *np.take(part, which, axis=1).swapaxes(0, 1)) for part in (four, two))
        integrals = {}
        for parity, bends, mass, slope in zip(PARITIES, ends, masses, slopes, strict=True):
            first, third = (part[:, which[0, -1]] + parity * part[:, which[1, -1]] for part in (first_integral, three))
            at_end = self.values[parity][-1]
            mixed = at_end[:, None] * (third @ bends)[:, None]
            corner = two[:, which[0, -1, -1]] - parity * two[:, which[1, -1, -1]]
            crossed = mixed + mixed.transpose(0, 2, 1) - corner[:, None, None] * np.outer(at_end, at_end)
            integrals[parity] = LineIntegrals(2.0 * (mass + crossed), -2.0 * slope, first @ bends)
        return integrals

    def grams(self, parity: int) -> tuple[Array, Array]:
        """Return integrals of products of functions (n, n; m) and of products of slopes (n, n; 1/m)."""
        return _grams(self.nodes, self.values[parity])

    def projections(self, count: int) -> dict[int, tuple[Array, Array]]:
        """Return matrices (n, count) that integrate a smooth field with functions (m) and slopes (no unit), by parity.

        The field is given at `count` Gauss points. The matrices are exact for polynomials of degree `count` - 1.
        """
        at, share = gauss(4)
        part = 0.5 * (1.0 + at[:, None])
        place = (self.nodes[:-1, None] + 0.5 * self.steps[:, None] * (1.0 + at)).ravel() / self.half
        weight = (0.5 * self.steps[:, None] * share).reshape(-1, 1)
        through, projections = weight * interpolation(count, place), {}
        step = through.reshape(self.steps.size, -1, count).sum(axis=1) / self.steps[:, None]
        for parity, values in self.values.items():
            function = (values[:-1, None] * (1.0 - part) + values[1:, None] * part).reshape(place.size, -1)
            projections[parity] = function.T @ through, np.diff(values, axis=0).T @ step
        return projections


def _quadratic_forms(functions: Sequence[Array], here: Array, mirrored: Array) -> list[Array]:
    """Return f' M f (m, n, n) for even and for odd functions f (nodes, n), in the product of their units.

    M are matrices (m, nodes, nodes): `here` plus (even) or minus (odd) `mirrored`, the matrix of the line's mirrored
    half.
    """
    results = []
    for table, between in zip(functions, (here + mirrored, here - mirrored), strict=True):
        results.append(((table.T @ between).reshape(-1, len(table)) @ table).reshape(len(here), table.shape[1], -1))
    return results


def interpolation(count: int, places: Array) -> Array:
    """Return the matrix (n, count; no unit) that interpolates from `count` Gauss points to `places` (n) in -1 to 1.

    Legendre coefficients are (k + 1/2) times the integral with P_k (Jackson, Classical Electrodynamics, equation 3.24).
    """
    nodes, weights = gauss(count)
    order = np.arange(count)
    to_legendre = (legendre(count - 1, nodes) * weights[:, None]).T * (order[:, None] + 0.5)
    return np.asarray(legendre(count - 1, places) @ to_legendre)


@lru_cache(maxsize=8)
def graded_line(half: float, first: float, widest: float, finer: int = FINER) -> GradedLine:
    """Return the line from -half to half with its splines.

    Parameters
    ----------
    half : float
        half of its length (m)
    first, widest : float
        distance of the knots at the ends and largest distance in the middle (m)
    finer : int, optional
        nodes for each knot

    Notes
    -----
    B-splines by Cox and de Boor's recursion (de Boor, A Practical Guide to Splines, 1978), with repeated end knots.
    """
    # knots from -half to half (m): the first step at each end is `first`, none is wider than `widest`
    steps: list[float] = []
    while sum(steps) < half:
        steps.append(min(first * RATIO ** len(steps), widest))
    inwards = half - np.concatenate([[0.0], np.cumsum(steps)])[::-1] * half / sum(steps)
    inwards[0] = 0.0
    knots = np.concatenate([-inwards[:0:-1], inwards])
    pieces = [np.linspace(a, b, finer + 1)[:-1] for a, b in pairwise(knots)]
    nodes = np.concatenate([*pieces, [half]])
    nodes = 0.5 * (nodes - nodes[::-1])
    # Cox and de Boor's recursion, the end knots repeated
    t = np.concatenate([[knots[0]] * DEGREE, knots, [knots[-1]] * DEGREE])
    basis = ((nodes[:, None] >= t[:-1]) & (nodes[:, None] < t[1:])).astype(float)
    basis[nodes == knots[-1], np.nonzero(t[:-1] < t[1:])[0][-1]] = 1.0
    for degree in range(1, DEGREE + 1):
        n = basis.shape[1] - 1
        rise, fall = t[degree : degree + n] - t[:n], t[degree + 1 : degree + 1 + n] - t[1 : n + 1]
        up = (nodes[:, None] - t[:n]) / np.where(rise > 0.0, rise, np.inf)
        down = (t[degree + 1 : degree + 1 + n] - nodes[:, None]) / np.where(fall > 0.0, fall, np.inf)
        basis = up * basis[:, :n] + down * basis[:, 1:]
    splines = np.asarray(basis)
    count = splines.shape[1]
    splines_ahead, mirrored = splines[:, count // 2 :], splines[:, ::-1][:, count // 2 :]
    even, odd = splines_ahead + mirrored, splines_ahead - mirrored
    if count % 2:
        even[:, 0] *= 0.5
        odd = odd[:, 1:]
    values, modes = {}, {}
    for parity, splines in ((1, even), (-1, odd)):
        turned, modes[parity] = line_modes(*_grams(nodes, splines))
        values[parity] = splines @ turned
    return GradedLine(half, nodes, values, modes)


def _grams(nodes: Array, values: Array) -> tuple[Array, Array]:
    """Return integrals of products of functions (n, n; m) and of products of slopes (n, n; 1/m).

    Functions are linear between the nodes (textbook).
    """
    steps = np.diff(nodes)[:, None]
    slopes = np.diff(values, axis=0) / steps
    low, high = values[:-1], values[1:]
    mass = (low * steps).T @ (2.0 * low + high) + (high * steps).T @ (low + 2.0 * high)
    return mass / 6.0, (slopes * steps).T @ slopes
