"""Smooth functions along one edge of a box or the radius of a disc: cubic splines, dense towards both ends.

At a metal's edge a current grows like a root of the distance, so knots crowd there geometrically. Every spline is held
as its values at nodes some times finer, straight between them: then all integrals with Gaussians are closed.
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
"""Step in ln s: 1/R is then right to 2e-5 of itself (the error falls like exp(-pi^2 / 2 step))."""


@record(eq=False)
class GaussianSum:
    """1/R as the sum of `weights` exp(-(scales R)^2) (1/m) for R between two distances: products of functions of x, y
    and z, so that integrals over boxes fall apart. Nearer, on a surface, it lacks `tail` (m) times a delta function.

    1/R = 2/sqrt(pi) times the integral of exp(-s^2 R^2) over s, by the trapezoidal rule in ln s (Beylkin and Monzon,
    Appl. Comput. Harmon. Anal. 28, 2010). Currents without sources do not feel a constant, so long wavelengths may be
    left out.
    """

    scales: Array
    weights: Array
    tail: float


def gaussian_sum(nearest: float, farthest: float) -> GaussianSum:
    """The sum that holds from `nearest` to `farthest` (m): the trapezoidal rule of `GaussianSum`, its tail the integral
    over larger s.
    """
    count = math.ceil(math.log(40.0 * farthest / nearest) / STEP)
    scales = 0.05 / farthest * np.exp(STEP * np.arange(count + 1))
    weights = 2.0 / math.sqrt(math.pi) * STEP * scales
    return GaussianSum(scales, weights, 2.0 * math.sqrt(math.pi) / (float(scales[-1]) * math.exp(0.5 * STEP)))


def repeated_integrals(scales: Array, u: Array) -> tuple[Array, Array, Array, Array]:
    """First to fourth integral (m to as many) of exp(-s^2 u^2) over u (n; m, rising from 0 or more) from 0, of odd and
    even parity, each (scales, n); scales s in 1/m. n I_n+1 = u I_n + I_n-1 / 2 s^2 (Abramowitz and Stegun 7.2.5).
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


FAR, ERF_STEPS = 6.0, 512
"""From where on erf is 1 to rounding; its known places for every 1 of its argument."""


@lru_cache(maxsize=1)
def _known_erf() -> Array:
    return np.array([math.erf(k / ERF_STEPS) for k in range(int(FAR * ERF_STEPS) + 1)])


def _erf(x: Array, falling: Array) -> Array:
    """erf(x) (no unit) to rounding, for x from 0 to `FAR` and `falling` exp(-x^2): Taylor's series from the nearest
    known place, whose next term is below 1e-16 (derivatives: Abramowitz and Stegun 7.1.19).
    """
    place = np.rint(x * ERF_STEPS)
    t = x - place / ERF_STEPS
    square = x * x
    more = (2.0 * square - 1.0) / 3.0 + t * x * (2.0 * square - 3.0) / 6.0
    series = t * (1.0 + t * (x + t * more))
    return np.asarray(_known_erf()[place.astype(np.intp)] + 2.0 / math.sqrt(math.pi) * falling * series)


RATIO, FINER, DEGREE = 1.7, 6, 3
"""Growth of knot distances from the ends inwards, nodes for each of them, degree of the splines."""

PARITIES = (1, -1)

EQUAL = 1e-12
"""Difference of two distances, in parts of half the line, up to which they are one: rounding."""


@record(eq=False)
class LineIntegrals:
    """Integrals for every Gaussian: `mass` (m2) of two functions, `slope` (no unit) of two slopes (scales, n, n), and
    `end` (scales, n; no unit) of a slope against the upper end.
    """

    mass: Array
    slope: Array
    end: Array


@record(eq=False)
class LineModes:
    """What functions of one parity are to each other along a line, or of one order along a radius: all but the last are
    0 at the end, of unit mass, and share neither mass nor stiffness, which is `squares` (n - 1; 1/m2). The last one is
    1 at the end and shares no stiffness with them; `ends` are the masses it shares, `mass` and `stiffness` its own.
    """

    squares: Array
    ends: Array
    mass: float
    stiffness: float


def line_modes(mass: Array, stiffness: Array) -> tuple[Array, LineModes]:
    """The combinations (n, n; columns, no unit) of functions that do so, from their mass and stiffness (textbook): the
    last of the functions is the only one that is not 0 at the end, and 1 there.
    """
    root = np.linalg.inv(np.linalg.cholesky(mass[:-1, :-1]))
    squares, vectors = np.linalg.eigh(root @ stiffness[:-1, :-1] @ root.T)
    found = np.zeros_like(mass)
    found[:-1, :-1], found[-1, -1] = root.T @ vectors, 1.0
    found[:-1, -1] = -np.linalg.solve(stiffness[:-1, :-1], stiffness[:-1, -1])
    last = found[:, -1]
    ends = found[:, :-1].T @ (mass @ last)
    return found, LineModes(squares, ends, float(last @ mass @ last), max(float(last @ stiffness @ last), 0.0))


@record(eq=False)
class GradedLine:
    """Functions on [-half, half] (m), even ones under 1 and odd ones under -1: values at the nodes, (nodes, n). Only
    the last of each is not 0 at the end, and it is 1 there: a constant and a straight line. `modes` say what they are
    to each other.
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
        """Jumps of the slope (1/m) at every node, those at both ends from and to 0: (nodes, n)."""
        slopes = np.diff(self.values[parity], axis=0) / self.steps[:, None]
        nothing = np.zeros_like(slopes[:1])
        return np.diff(np.concatenate([nothing, slopes, nothing]), axis=0)

    def integrals(self, scales: Array) -> dict[int, LineIntegrals]:
        """Integrals with exp(-s^2 (x - x')^2) for every s (1/m), by parity: by parts (derived here), the jumps of the
        slopes with repeated integrals.
        """
        # half of the line, its mirrored other half folded in: every function and its bends are even or odd
        middle = self.nodes.size // 2
        x = self.nodes[middle:]
        share = np.ones((x.size, 1))
        share[: self.nodes.size % 2] = 0.5
        # each distance of nodes once, for they come in equal steps: (scales, on which side, nodes, nodes)
        apart = np.stack([np.abs(x[:, None] - x), x[:, None] + x])
        steps = np.round(apart / (EQUAL * self.half)).astype(np.int64)
        _, distinct, which = np.unique(steps, return_index=True, return_inverse=True)
        which = which.reshape(apart.shape)
        one, two, three, four = repeated_integrals(scales, apart.ravel()[distinct])
        ends = [share * self.bends(parity)[middle:] for parity in PARITIES]
        masses, slopes = (_sandwiched(ends, *np.take(part, which, axis=1).swapaxes(0, 1)) for part in (four, two))
        found = {}
        for parity, bends, mass, slope in zip(PARITIES, ends, masses, slopes, strict=True):
            first, third = (part[:, which[0, -1]] + parity * part[:, which[1, -1]] for part in (one, three))
            at_end = self.values[parity][-1]
            mixed = at_end[:, None] * (third @ bends)[:, None]
            corner = two[:, which[0, -1, -1]] - parity * two[:, which[1, -1, -1]]
            both = mixed + mixed.transpose(0, 2, 1) - corner[:, None, None] * np.outer(at_end, at_end)
            found[parity] = LineIntegrals(2.0 * (mass + both), -2.0 * slope, first @ bends)
        return found

    def grams(self, parity: int) -> tuple[Array, Array]:
        """Integrals of products of functions (n, n; m) and of slopes (n, n; 1/m)."""
        return _grams(self.nodes, self.values[parity])

    def projections(self, count: int) -> dict[int, tuple[Array, Array]]:
        """What turns values of a smooth field at `count` Gauss points into its integrals with functions (m) and slopes
        (no unit), by parity: (n, count) each, exact for polynomials of degree `count` - 1.
        """
        at, share = gauss(4)
        part = 0.5 * (1.0 + at[:, None])
        place = (self.nodes[:-1, None] + 0.5 * self.steps[:, None] * (1.0 + at)).ravel() / self.half
        weight = (0.5 * self.steps[:, None] * share).reshape(-1, 1)
        through, found = weight * interpolation(count, place), {}
        step = through.reshape(self.steps.size, -1, count).sum(axis=1) / self.steps[:, None]
        for parity, values in self.values.items():
            function = (values[:-1, None] * (1.0 - part) + values[1:, None] * part).reshape(place.size, -1)
            found[parity] = function.T @ through, np.diff(values, axis=0).T @ step
        return found


def _sandwiched(functions: Sequence[Array], here: Array, mirrored: Array) -> list[Array]:
    """Even and odd functions (nodes, n), turned over, times each of many matrices (m, nodes, nodes) times the
    functions, with what the mirrored half of the line does: (m, n, n), in the product of their units.
    """
    found = []
    for one, between in zip(functions, (here + mirrored, here - mirrored), strict=True):
        found.append(((one.T @ between).reshape(-1, len(one)) @ one).reshape(len(here), one.shape[1], -1))
    return found


def interpolation(count: int, places: Array) -> Array:
    """What takes values at `count` Gauss points to their polynomial at `places` (n) between -1 and 1: (n, count), no
    unit. By its Legendre coefficients, (k + 1/2) times the integral with P_k (Jackson, Classical Electrodynamics,
    equation 3.24).
    """
    nodes, weights = gauss(count)
    order = np.arange(count)
    to_legendre = (legendre(count - 1, nodes) * weights[:, None]).T * (order[:, None] + 0.5)
    return np.asarray(legendre(count - 1, places) @ to_legendre)


@lru_cache(maxsize=8)
def graded_line(half: float, first: float, widest: float, finer: int = FINER) -> GradedLine:
    """The line from -half to half; knots `first` apart at the ends, `widest` in the middle (m), `finer` nodes each.
    B-splines by Cox and de Boor's recursion (de Boor, A Practical Guide to Splines, 1978), the end knots repeated.
    """
    # knots from -half to half (m), the first step from each end given, none wider than `widest`
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
    found = ((nodes[:, None] >= t[:-1]) & (nodes[:, None] < t[1:])).astype(float)
    found[nodes == knots[-1], np.nonzero(t[:-1] < t[1:])[0][-1]] = 1.0
    for degree in range(1, DEGREE + 1):
        n = found.shape[1] - 1
        rise, fall = t[degree : degree + n] - t[:n], t[degree + 1 : degree + 1 + n] - t[1 : n + 1]
        up = (nodes[:, None] - t[:n]) / np.where(rise > 0.0, rise, np.inf)
        down = (t[degree + 1 : degree + 1 + n] - nodes[:, None]) / np.where(fall > 0.0, fall, np.inf)
        found = up * found[:, :n] + down * found[:, 1:]
    splines = np.asarray(found)
    count = splines.shape[1]
    right, left = splines[:, count // 2 :], splines[:, ::-1][:, count // 2 :]
    even, odd = right + left, right - left
    if count % 2:
        even[:, 0] *= 0.5
        odd = odd[:, 1:]
    values, modes = {}, {}
    for parity, splines in ((1, even), (-1, odd)):
        turned, modes[parity] = line_modes(*_grams(nodes, splines))
        values[parity] = splines @ turned
    return GradedLine(half, nodes, values, modes)


def _grams(nodes: Array, values: Array) -> tuple[Array, Array]:
    """Integrals of products of functions (n, n; m) and of slopes (n, n; 1/m), straight between the nodes (textbook)."""
    steps = np.diff(nodes)[:, None]
    slopes = np.diff(values, axis=0) / steps
    low, high = values[:-1], values[1:]
    mass = (low * steps).T @ (2.0 * low + high) + (high * steps).T @ (low + 2.0 * high)
    return mass / 6.0, (slopes * steps).T @ slopes
