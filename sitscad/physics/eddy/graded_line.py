"""Smooth functions along one edge of a box or the radius of a disc: cubic splines, dense towards both ends.

At a metal's edge a current grows like a root of the distance, so knots crowd there geometrically. Every spline is held
as its values at nodes some times finer, straight between them: then all integrals with Gaussians are closed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from sitscad.arrays import Array
from sitscad.physics.special_functions import gauss, legendre
from sitscad.record import record

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
    """First to fourth integral (m to as many) of exp(-s^2 u^2) over u (m; any shape) from 0, of odd and even parity,
    each (scales, *u.shape); scales s in 1/m. n I_n+1 = u I_n + I_n-1 / 2 s^2 (Abramowitz and Stegun 7.2.5).
    """
    s = scales.reshape(-1, *(1,) * u.ndim)
    narrow = 0.5 / (s * s)
    # erf (without a unit) of every element, 1 where it is that to rounding
    x = s * u
    found = np.sign(x)
    near = np.abs(x) < 6.0
    found[near] = _ERF(x[near])
    first = 0.5 * math.sqrt(math.pi) / s * found
    second = u * first + narrow * np.exp(-((s * u) ** 2))
    third = 0.5 * (u * second + narrow * first)
    return first, second, third, (u * third + narrow * second) / 3.0


_ERF = np.frompyfunc(math.erf, 1, 1)


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
        # each distance of nodes once, for they come in equal steps and with both signs; (scales, nodes, nodes)
        apart = self.nodes[:, None] - self.nodes
        steps = np.round(np.abs(apart) / (EQUAL * self.half)).astype(np.int64)
        _, distinct, which = np.unique(steps, return_index=True, return_inverse=True)
        which, sign = which.reshape(apart.shape), np.sign(apart)
        one, two, three, four = repeated_integrals(scales, np.abs(apart).ravel()[distinct])
        first, second, third, fourth = one[:, which] * sign, two[:, which], three[:, which] * sign, four[:, which]
        found = {}
        for parity in PARITIES:
            bends, values = self.bends(parity), self.values[parity]
            ends = np.stack([values[0], -values[-1]])
            mixed = -(ends.T @ (third[:, [0, -1]] @ bends))
            corner = ends.T @ second[:, [0, -1]][:, :, [0, -1]] @ ends
            mass = bends.T @ fourth @ bends + mixed + mixed.transpose(0, 2, 1) - corner
            found[parity] = LineIntegrals(mass, -(bends.T @ second @ bends), -(first[:, :, -1] @ bends))
        return found

    def grams(self, parity: int) -> tuple[Array, Array]:
        """Integrals of products of functions (n, n; m) and of slopes (n, n; 1/m)."""
        return _grams(self.nodes, self.values[parity])

    def sampled(self, parity: int, at: Array) -> Array:
        """Functions (no unit) at places `at` (-1 to 1) of every step: (steps, places, n)."""
        values = self.values[parity]
        return np.asarray(values[:-1, None] * 0.5 * (1.0 - at[:, None]) + values[1:, None] * 0.5 * (1.0 + at[:, None]))

    def projections(self, parity: int, count: int) -> tuple[Array, Array]:
        """What turns values of a smooth field at `count` Gauss points into its integrals with functions (m) and slopes
        (no unit): (n, count) each, exact for polynomials of degree `count` - 1.
        """
        at, share = gauss(4)
        place = (self.nodes[:-1, None] + 0.5 * self.steps[:, None] * (1.0 + at)).ravel() / self.half
        weight = (0.5 * self.steps[:, None] * share).ravel()
        through = interpolation(count, place)
        function = self.sampled(parity, at).reshape(place.size, -1)
        slope = np.repeat(np.diff(self.values[parity], axis=0) / self.steps[:, None], at.size, axis=0)
        return (function * weight[:, None]).T @ through, (slope * weight[:, None]).T @ through


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
