"""Smooth functions along one edge of a box or the radius of a disc: cubic splines, with knots dense towards both ends.

Near a metal's edge, a current varies like a root of the distance from the edge, so knots are spaced geometrically.
Every spline is stored as its values at finer nodes and is linear between them. Then all integrals with Gaussians have a
closed form.
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
"""Step of the trapezoidal rule in ln s (no unit) by which `GaussianSum` approximates 1/R.

The relative error of 1/R is 2e-5. It falls like exp(-pi^2 / (2 step)).
"""


@record(eq=False)
class GaussianSum:
    """Approximation of 1/R (1/m) as the sum of weights exp(-(scales R)^2), for R between two distances.

    `scales` and `weights` (Gaussians) are in 1/m. Each term is a product of functions of x, y and z, so integrals over
    boxes separate. At shorter distances, the sum is less than 1/R. On a surface, the missing part is a delta function
    times `tail` (m).

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
    """Return the sum of Gaussians that equals 1/R for distances R from `nearest` to `farthest` (m).

    It is the trapezoidal rule of `GaussianSum`. The tail is the integral over s above the largest scale.
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
        integrals in m, m2, m3 and m4: odd, even, odd and even functions of u

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
"""Argument of erf above which its value counts as 1. The difference is below rounding."""

ERF_STEPS = 512
"""Number of tabulated values of erf per unit of its argument."""


@lru_cache(maxsize=1)
def _erf_table() -> Array:
    """Return erf(x) (no unit) for x from 0 to `FAR`, at `ERF_STEPS` values per unit of x."""
    return np.array([math.erf(k / ERF_STEPS) for k in range(int(FAR * ERF_STEPS) + 1)])


def _erf(x: Array, falling: Array) -> Array:
    """Return erf(x) (no unit) to rounding, for x from 0 to `FAR`; `falling` is exp(-x^2).

    Method: Taylor's series about the nearest tabulated value. The first omitted term is below 1e-16 (derivatives:
    Abramowitz and Stegun 7.1.19).
    """
    place = np.rint(x * ERF_STEPS)
    t = x - place / ERF_STEPS
    square = x * x
    more = (2.0 * square - 1.0) / 3.0 + t * x * (2.0 * square - 3.0) / 6.0
    series = t * (1.0 + t * (x + t * more))
    return np.asarray(_erf_table()[place.astype(np.intp)] + 2.0 / math.sqrt(math.pi) * falling * series)


RATIO = 1.7
"""Ratio of successive knot distances, counted from each end of the line towards the middle."""

FINER = 6
"""Number of nodes per knot distance. Functions are stored as their values at the nodes."""

DEGREE = 3
"""Degree of the splines (3: cubic)."""

PARITIES = (1, -1)
"""Parities of functions about the middle: 1 even, -1 odd."""

EQUAL = 1e-12
"""Largest difference of two distances, divided by half the line's length, at which the distances count as equal.

Such a difference is rounding.
"""


@record(eq=False)
class LineIntegrals:
    """Double integrals of a line's functions with each Gaussian exp(-s^2 (x - x')^2).

    `mass` (scales, n, n; m2) integrates products of two functions, `slope` (scales, n, n; no unit) products of two
    slopes. `end` (scales, n; no unit) is a single integral of a slope times a Gaussian of the distance from the line's
    upper end.
    """

    mass: Array
    slope: Array
    end: Array


@record(eq=False)
class LineModes:
    """Functions of one parity along a line, or of one order along a radius, described by their integrals.

    A mass is the integral of the product of two functions, a stiffness the integral of the product of their slopes. All
    but the last function are 0 at the end, have unit mass and are orthogonal in mass and stiffness. `squares` (n - 1;
    1/m2) are their stiffnesses. The last function is 1 at the end and orthogonal to the others in stiffness. `ends` (n
    - 1) are its masses with the other functions, `mass` and `stiffness` its own mass and stiffness.
    """

    squares: Array
    ends: Array
    mass: float
    stiffness: float


def line_modes(mass: Array, stiffness: Array) -> tuple[Array, LineModes]:
    """Return combinations of functions (n, n; columns, no unit) that are orthogonal, and their integrals.

    `mass` and `stiffness` (n, n) are the integrals of the given functions (textbook). Only the last function differs
    from 0 at the end: its value there is 1. `LineModes` describes the combinations.
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
    """Even and odd functions on a line from -half to half (m): splines with knots that are dense towards both ends.

    `nodes` (m) are the places at which functions are stored. `values` (nodes, n) are the functions by parity (1 even,
    -1 odd). All but the last function of each parity are 0 at the ends. The last function is a constant or a straight
    line and is 1 at the upper end. `modes` are the functions' integrals by parity.
    """

    half: float
    nodes: Array
    values: Mapping[int, Array]
    modes: Mapping[int, LineModes]

    @cached_property
    def steps(self) -> Array:
        """Distances between successive nodes (m)."""
        return np.diff(self.nodes)

    def slope_jumps(self, parity: int) -> Array:
        """Return the jumps of the functions' slopes at the nodes (nodes, n; 1/m). Outside the line the slope is 0."""
        slopes = np.diff(self.values[parity], axis=0) / self.steps[:, None]
        nothing = np.zeros_like(slopes[:1])
        return np.diff(np.concatenate([nothing, slopes, nothing]), axis=0)

    def integrals(self, scales: Array) -> dict[int, LineIntegrals]:
        """Return double integrals of the functions with exp(-s^2 (x - x')^2) for every s in `scales` (1/m), by parity.

        Integration by parts leaves the jumps of the slopes times repeated integrals of the Gaussian (derived here).
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
        ends = [share * self.slope_jumps(parity)[middle:] for parity in PARITIES]
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
        """Return integrals of products of two functions (n, n; m) and of two slopes (n, n; 1/m), for one parity."""
        return _grams(self.nodes, self.values[parity])

    def projections(self, count: int) -> dict[int, tuple[Array, Array]]:
        """Return two matrices (n, count) that integrate a field times functions (m) and slopes (no unit), by parity.

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

    f' is the transpose of f. The matrices M (m, nodes, nodes) are `here` + `mirrored` for even functions and `here` -
    `mirrored` for odd functions. `mirrored` is the matrix from the upper half of the line to its lower half.
    """
    results = []
    for table, between in zip(functions, (here + mirrored, here - mirrored), strict=True):
        results.append(((table.T @ between).reshape(-1, len(table)) @ table).reshape(len(here), table.shape[1], -1))
    return results


def interpolation(count: int, places: Array) -> Array:
    """Return the matrix (n, count; no unit) that interpolates from `count` Gauss points to `places` (n; -1 to 1).

    Legendre coefficients are (k + 1/2) times the integral with P_k (Jackson, Classical Electrodynamics, equation 3.24).
    """
    nodes, weights = gauss(count)
    order = np.arange(count)
    to_legendre = (legendre(count - 1, nodes) * weights[:, None]).T * (order[:, None] + 0.5)
    return np.asarray(legendre(count - 1, places) @ to_legendre)


@lru_cache(maxsize=8)
def graded_line(half: float, first: float, widest: float, finer: int = FINER) -> GradedLine:
    """Return the spline functions on the line from -half to half.

    Parameters
    ----------
    half : float
        half of the line's length (m)
    first, widest : float
        distance of the knots at the ends, and largest distance of knots in the middle (m)
    finer : int, optional
        number of nodes per knot distance

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
    """Return integrals of products of two functions (n, n; m) and of products of two slopes (n, n; 1/m).

    `values` (nodes, n) are the functions, linear between the `nodes` (m) (textbook).
    """
    steps = np.diff(nodes)[:, None]
    slopes = np.diff(values, axis=0) / steps
    low, high = values[:-1], values[1:]
    mass = (low * steps).T @ (2.0 * low + high) + (high * steps).T @ (low + 2.0 * high)
    return mass / 6.0, (slopes * steps).T @ slopes
