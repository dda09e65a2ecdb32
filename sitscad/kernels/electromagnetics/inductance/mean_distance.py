"""Geometric mean distance (GMD) of two parallel rectangular conductors, and quantities that follow from it.

The inductance of two long straight conductors depends on the mean of ln(distance) over both cross-sections (Maxwell
1873, art. 691). Here the mean across the width has a closed form, and the mean through the thickness is a Gauss sum.
This is accurate also for infinitely thin tracks, for which the fully closed form loses digits. Beyond a few widths the
closed form loses digits, too. There the multipole series of the harmonic function ln|zeta| is used.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.kernels.electromagnetics.polynomials import barycentric_weights, chebyshev_points
from sitscad.kernels.electromagnetics.special_functions import gauss

SERIES_FROM = 4.0
"""Least distance of two rectangles' centres, divided by the sum of their half diagonals, at which a series is used.

The multipole series is of 10th order and has an error below 1e-7.
"""


def log_mean_distance(
    across: Array | float, height: float, widths: tuple[float, float], thicknesses: tuple[float, float]
) -> Array:
    """Return the mean of ln(distance / 1 m) between two rectangles with parallel sides (Maxwell 1873, art. 691).

    The relative error of the GMD is below 1e-6. If rectangles touch or coincide, it is below 1.1e-5 for squares and
    4e-6 for a thickness of at most a third of the width.

    Parameters
    ----------
    across : array or float
        offset of the centres along the width (m), any shape
    height : float
        offset of the centres along the thickness (m)
    widths : tuple[float, float]
        width of each rectangle (m)
    thicknesses : tuple[float, float]
        thickness of each rectangle (m)

    Returns
    -------
    array
            in the shape of `across`. Rectangles may overlap. With both offsets 0, the result is the mean for a
        rectangle with itself.

    Notes
    -----
    For distant rectangles, it is the mean of the Taylor series of ln|zeta + xi|, by even moments of the difference xi
    of two places (derived here).
    """
    unit = max(*widths, *thicknesses)
    d = np.abs(np.asarray(across, dtype=float)) / unit
    h, w, t = abs(height) / unit, (widths[0] / unit, widths[1] / unit), (thicknesses[0] / unit, thicknesses[1] / unit)
    reach = 0.5 * (math.hypot(w[0], t[0]) + math.hypot(w[1], t[1]))
    distant = np.hypot(d, h) > SERIES_FROM * reach
    result = np.empty_like(d)
    # <Re ln(zeta + xi)> (lengths in m) with xi = x - x' + i (z - z')
    zeta = d[distant] + 1j * h
    moments = _even_moments(w, t)
    inverse = 1.0 / (zeta * zeta)
    total = np.zeros_like(zeta)
    power = inverse.copy()
    for order, moment in enumerate(moments, start=1):
        total -= moment / (2 * order) * power
        power = power * inverse
    result[distant] = np.log(np.abs(zeta)) + total.real
    near = ~distant
    if near.any():
        result[near] = _rectangle_mean_logarithm(d[near], h, w, t)
    return result + math.log(unit)


def strand_clearance(
    across: Array, height: float, widths: tuple[float, float], thicknesses: tuple[float, float], strands: int = 2,
    levels: int = 1
) -> Array:
    """Return the term (m2) to add to the squared distances of two tracks' strands so that they keep the tracks' GMD.

    Parameters
    ----------
    across : array
        offset of the centre lines along the width (m)
    height : float
        distance of the mid-planes (m)
    widths : tuple[float, float]
        width of each track (m)
    thicknesses : tuple[float, float]
        thickness of each track (m)
    strands : int, optional
        number of filaments that replace each track, at the Gauss points of its width (1: the centre line)
    levels : int, optional
        1, or 2 to count each pair of strands at both heights of `level_heights`

    Returns
    -------
    array
        in the shape of `across`. It may be slightly negative for tracks side by side.

    Notes
    -----
    With the term c2, the weighted mean of ln(distance^2 + c2) over all pairs of strands equals the rectangles' mean. So
    a Neumann sum over strands is exact for long straight tracks. Its error is of fourth order in width divided by
    radius of curvature. Two levels keep the mean distance, too. The mean distance affects the ends and corners of
    tracks above each other.
    """
    log_square = 2.0 * log_mean_distance(across, height, widths, thicknesses)
    d = np.asarray(across, dtype=float)
    nodes, weights = gauss(strands)
    offsets = 0.5 * (widths[0] * nodes[:, None] - widths[1] * nodes[None, :])
    share = (0.25 * weights[:, None] * weights[None, :]).ravel()
    heights = level_heights(height, thicknesses, levels)
    squares = np.concatenate([(d[..., None] + offsets.ravel()) ** 2 + h * h for h in heights], axis=-1)
    share = np.tile(share, levels) / levels
    if strands == levels == 1:
        return np.exp(log_square) - squares[..., 0]
    # Newton's method for the clearance c with the required mean of ln(a + c)
    smallest = squares.min(axis=-1)
    clearance = np.maximum(-0.5 * smallest, np.exp(np.minimum(log_square, 600.0)) * 1e-3 - smallest)
    start = np.sum(share * np.log(squares + clearance[..., None]), axis=-1)
    clearance = np.where(start > log_square, -smallest * (1.0 - 1e-9) + 1e-9 * np.exp(log_square), clearance)
    for _ in range(40):
        inside = squares + clearance[..., None]
        step = (log_square - np.sum(share * np.log(inside), axis=-1)) / np.sum(share / inside, axis=-1)
        clearance = np.maximum(clearance + step, -smallest * (1.0 - 1e-9))
        if np.all(np.abs(step) <= 1e-12 * np.exp(log_square)):
            break
    return clearance


@lru_cache(maxsize=256)
def clearance_table(
    height: float, widths: tuple[float, float], thicknesses: tuple[float, float], strands: int, levels: int = 1
) -> tuple[Array, Array]:
    """Return distances of centre lines (101; m), and the term to add to squared distances of strands (101; m2) at each.

    The arguments are explained in `strand_clearance`. The table is cached.
    """
    across = 5.0 * max(widths) * np.linspace(0.0, 1.0, 101) ** 1.5
    return across, strand_clearance(across, height, widths, thicknesses, strands, levels)


def level_heights(height: float, thicknesses: tuple[float, float], levels: int) -> tuple[float, ...]:
    """Return one or two heights (m) that represent the distance of two layers: `levels` is their number.

    One height is the distance `height` of the mid-planes. Two heights have the mean and the variance of the distance
    over both thicknesses. Each thickness t contributes t^2 / 12 to the variance (textbook).
    """
    if levels == 1:
        return (height,)
    deviation = math.sqrt((thicknesses[0] ** 2 + thicknesses[1] ** 2) / 12.0)
    return abs(height) - deviation, abs(height) + deviation


@lru_cache(maxsize=256)
def _even_moments(w: tuple[float, float], t: tuple[float, float]) -> tuple[float, ...]:
    """Return the real moments <xi^2> to <xi^10> (no unit) of xi = x + i z, the difference of two places.

    The places lie in rectangles of widths w and thicknesses t, divided by the largest side.

    Notes
    -----
    A place along a side of length a has the even moments (a / 2)^(2 n) / (2 n + 1) (textbook). Sums and differences
    follow by the binomial theorem.
    """

    def of_difference(first_width: float, second_width: float) -> list[float]:
        widths = first_width, second_width
        first, second = ([(width / 2) ** (2 * n) / (2 * n + 1) for n in range(6)] for width in widths)
        return [sum(math.comb(2 * n, 2 * k) * first[n - k] * second[k] for k in range(n + 1)) for n in range(6)]

    x, z = of_difference(*w), of_difference(*t)
    return tuple(sum(math.comb(2 * n, 2 * k) * (-1) ** k * x[n - k] * z[k] for k in range(n + 1)) for n in range(1, 6))


def _rectangle_mean_logarithm(d: Array, h: float, w: tuple[float, float], t: tuple[float, float]) -> Array:
    """Return the mean logarithm (n; no unit) of the distance of two rectangles; lengths divided by the largest side.

    `d` (n) and `h` are the offsets across and in height, `w` the widths, `t` the thicknesses. The mean across is the
    second difference of `_twice_integrated`. The mean over the heights is a sum over Gauss points. Derived here.
    """
    heights, weights = _height_nodes(h, t)
    outer, inner = 0.5 * (w[0] + w[1]), 0.5 * abs(w[0] - w[1])
    x = d[..., None]
    if min(w) < 1e-6 * max(*w, *t, 1e-300):
        return np.sum(weights * 0.5 * np.log(x * x + heights * heights), axis=-1)
    total = _twice_integrated(x + outer, heights) + _twice_integrated(x - outer, heights)
    if inner == 0.0:
        total -= 2.0 * _twice_integrated(x, heights)
    else:
        total -= _twice_integrated(x + inner, heights) + _twice_integrated(x - inner, heights)
    return np.sum(weights * total, axis=-1) / (w[0] * w[1])


def _twice_integrated(x: Array, z: Array) -> Array:
    """Return the second integral over x of ln sqrt(x^2 + z^2) for z > 0, in the squared unit of x (by parts)."""
    square = x * x + z * z
    return 0.25 * (x * x - z * z) * np.log(square) - 0.75 * x * x + x * z * np.arctan(x / z)


@lru_cache(maxsize=256)
def _height_nodes(h: float, t: tuple[float, float]) -> tuple[Array, Array]:
    """Return nodes (m) and weights (no unit) for the mean over the difference of heights in two thicknesses.

    Both heights are uniformly distributed, so the difference has a trapezoidal density. Gauss points lie between the
    corners of the trapezium (derived here).
    """
    outer, inner = 0.5 * (t[0] + t[1]), 0.5 * abs(t[0] - t[1])
    if outer == 0.0:
        return np.array([max(h, 1e-12)]), np.array([1.0])
    corners = sorted({h - outer, h - inner, h + inner, h + outer} | ({0.0} if abs(h) < outer else set()))
    share = outer + inner
    nodes, weights = [], []
    g, gw = gauss(6)
    for low, high in pairwise(corners):
        if high - low < 1e-12 * outer:
            continue
        z = 0.5 * (high + low) + 0.5 * (high - low) * g
        density = np.minimum(1.0, (outer - np.abs(z - h)) / (outer - inner)) if outer > inner else np.ones_like(z)
        nodes.append(np.abs(z))
        weights.append(0.5 * (high - low) * gw * density / share)
    return np.concatenate(nodes), np.concatenate(weights)


RIGHT = math.log(3e-8)
"""Natural logarithm of the largest relative error, 3e-8, of 1/distance as a polynomial in the squared height."""


def sufficient_node_counts(squares: Array, apart: Array) -> Index:
    """Return the number of polynomial nodes (n; no unit) that represent all squared heights, for each distance (n).

    `squares` (m2) are the squared height differences in rising order, `apart` (n; m) the distances of the points in the
    plane. The result is at most the number of squared heights, even if the accuracy `RIGHT` would need more nodes.

    Notes
    -----
    1 / sqrt(apart^2 + h^2) has a pole in h^2 at -apart^2. So the polynomial's error falls like rho^-count with ln rho =
    acosh(1 + distance of the pole in half the range) (Trefethen, Approximation Theory and Approximation Practice, 2013,
    chapter 8).
    """
    low, high = float(squares[0]), float(squares[-1])
    if high <= low:
        return np.ones(apart.shape, dtype=np.intp)
    beyond = 2.0 * (np.maximum(apart, 0.0) ** 2 + low) / max(high - low, 1e-300)
    count = np.ceil(-RIGHT / np.arccosh(1.0 + np.maximum(beyond, 1e-12)))
    return np.clip(count, 1, squares.size).astype(np.intp)


def height_nodes(squares: Array, count: int) -> tuple[Array, Array]:
    """Return `count` squared heights (m2) at Chebyshev points, and weights (nodes, given heights; no unit).

    The weights of a given squared height in `squares` (m2) distribute it over the nodes, by the interpolation
    polynomial through the nodes.
    """
    if count >= squares.size:
        return squares, np.eye(squares.size)
    low, high = float(squares[0]), float(squares[-1])
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    if half <= 0.0:
        return squares[:1], np.ones((squares.size, 1))
    nodes = chebyshev_points(-1.0, 1.0, count)
    return middle + half * nodes, barycentric_weights(nodes, (squares - middle) / half)
