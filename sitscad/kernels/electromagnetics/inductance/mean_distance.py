"""Geometric mean distance (GMD) of two parallel rectangular conductors, and what follows from it.

The mean of ln(distance) over both cross-sections is what a long straight pair needs (Maxwell 1873, art. 691). Here the
mean across the width is closed, the one through the thickness is a Gauss sum: that stays exact for infinitely thin
tracks, where the all-closed form cancels. Beyond a few widths the closed form cancels too and the multipole series of
the harmonic function ln|zeta| takes over.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.kernels.electromagnetics.polynomials import chebyshev_points, shares
from sitscad.kernels.electromagnetics.special_functions import gauss

SERIES_FROM = 4.0
"""Distance, in sums of the half diagonals, from which the series (to 10th order, error below 1e-7) is used."""


def log_mean_distance(
    across: Array | float, height: float, widths: tuple[float, float], thicknesses: tuple[float, float]
) -> Array:
    """Mean of ln(distance / 1 m) between two rectangles with parallel sides (Maxwell 1873, art. 691).

    `across` (m, any shape) is the offset of their centres along the width, `height` (m) the one along the thickness,
    `widths` and `thicknesses` (m) are each rectangle's. Returns an array of the shape of `across`; overlapping
    rectangles are allowed (offset 0, 0 gives the self distance). Far apart it is the mean of the Taylor series of
    ln|zeta + xi|, derived here: the even moments of the difference xi of two places. Relative error of the GMD below
    1e-6, where rectangles touch or coincide below 1.1e-5 (squares; 4e-6 from a third as thick as wide).
    """
    unit = max(*widths, *thicknesses)
    d = np.abs(np.asarray(across, dtype=float)) / unit
    h, w, t = abs(height) / unit, (widths[0] / unit, widths[1] / unit), (thicknesses[0] / unit, thicknesses[1] / unit)
    reach = 0.5 * (math.hypot(w[0], t[0]) + math.hypot(w[1], t[1]))
    far = np.hypot(d, h) > SERIES_FROM * reach
    result = np.empty_like(d)
    # <Re ln(zeta + xi)> (lengths in m) with xi = x - x' + i (z - z')
    zeta = d[far] + 1j * h
    moments = _even_moments(w, t)
    inverse = 1.0 / (zeta * zeta)
    total = np.zeros_like(zeta)
    power = inverse.copy()
    for order, moment in enumerate(moments, start=1):
        total -= moment / (2 * order) * power
        power = power * inverse
    result[far] = np.log(np.abs(zeta)) + total.real
    near = ~far
    if near.any():
        result[near] = _closed(d[near], h, w, t)
    return result + math.log(unit)


def strand_clearance(
    across: Array, height: float, widths: tuple[float, float], thicknesses: tuple[float, float], strands: int = 2,
    levels: int = 1
) -> Array:
    """Square (m2) that the squared distances of strands must be lengthened by so that the pair keeps its GMD.

    Each track is replaced by `strands` filaments at the Gauss points of its width (1: the centre line). The number c2
    returned, of the shape of `across` (m), makes the weighted mean of ln(distance^2 + c2) over all pairs of strands
    equal to that of the rectangles, so that a Neumann sum over strands is exact for long straight pairs, and right to
    fourth order in width over radius of curvature. It may be slightly negative for tracks side by side. With two
    `levels` each pair of strands counts twice, at both heights of `level_heights`: that keeps the mean distance too,
    which ends and corners of tracks above each other see.
    """
    wanted = 2.0 * log_mean_distance(across, height, widths, thicknesses)
    d = np.asarray(across, dtype=float)
    nodes, weights = gauss(strands)
    offsets = 0.5 * (widths[0] * nodes[:, None] - widths[1] * nodes[None, :])
    share = (0.25 * weights[:, None] * weights[None, :]).ravel()
    heights = level_heights(height, thicknesses, levels)
    squares = np.concatenate([(d[..., None] + offsets.ravel()) ** 2 + h * h for h in heights], axis=-1)
    share = np.tile(share, levels) / levels
    if strands == levels == 1:
        return np.exp(wanted) - squares[..., 0]
    # the clearance c with which the mean of ln(a + c) is right
    smallest = squares.min(axis=-1)
    clearance = np.maximum(-0.5 * smallest, np.exp(np.minimum(wanted, 600.0)) * 1e-3 - smallest)
    start = np.sum(share * np.log(squares + clearance[..., None]), axis=-1)
    clearance = np.where(start > wanted, -smallest * (1.0 - 1e-9) + 1e-9 * np.exp(wanted), clearance)
    for _ in range(40):
        inside = squares + clearance[..., None]
        step = (wanted - np.sum(share * np.log(inside), axis=-1)) / np.sum(share / inside, axis=-1)
        clearance = np.maximum(clearance + step, -smallest * (1.0 - 1e-9))
        if np.all(np.abs(step) <= 1e-12 * np.exp(wanted)):
            break
    return clearance


@lru_cache(maxsize=256)
def clearance_table(
    height: float, widths: tuple[float, float], thicknesses: tuple[float, float], strands: int, levels: int = 1
) -> tuple[Array, Array]:
    """Distances (101; m), and by how much squared distances of strands are longer there (101; m2), kept: see
    `strand_clearance`.
    """
    across = 5.0 * max(widths) * np.linspace(0.0, 1.0, 101) ** 1.5
    return across, strand_clearance(across, height, widths, thicknesses, strands, levels)


def level_heights(height: float, thicknesses: tuple[float, float], levels: int) -> tuple[float, ...]:
    """The height (m) between two mid-planes, or the two that have its mean and its variance over both thicknesses: t^2
    / 12 of each (textbook).
    """
    if levels == 1:
        return (height,)
    spread = math.sqrt((thicknesses[0] ** 2 + thicknesses[1] ** 2) / 12.0)
    return abs(height) - spread, abs(height) + spread


@lru_cache(maxsize=256)
def _even_moments(w: tuple[float, float], t: tuple[float, float]) -> tuple[float, ...]:
    """Real moments <xi^2> to <xi^10> (no unit: lengths in the largest side) of the difference xi = x + i z of two
    places in rectangles of widths w and thicknesses t. A place along a side of length a has the even moments (a / 2)^(2
    n) / (2 n + 1) (textbook), sums and differences follow by the binomial theorem.
    """

    def of_difference(one: float, other: float) -> list[float]:
        first, second = ([(width / 2) ** (2 * n) / (2 * n + 1) for n in range(6)] for width in (one, other))
        return [sum(math.comb(2 * n, 2 * k) * first[n - k] * second[k] for k in range(n + 1)) for n in range(6)]

    x, z = of_difference(*w), of_difference(*t)
    return tuple(sum(math.comb(2 * n, 2 * k) * (-1) ** k * x[n - k] * z[k] for k in range(n + 1)) for n in range(1, 6))


def _closed(d: Array, h: float, w: tuple[float, float], t: tuple[float, float]) -> Array:
    """Mean logarithm of the distance of two rectangles, (n,; no unit), lengths in the largest side: derived here. The
    mean across is the second difference of `_twice_integrated`, the one over the heights a sum over Gauss points.
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
    """Second integral over x of ln sqrt(x^2 + z^2) for z > 0, all in one unit of length; by parts."""
    square = x * x + z * z
    return 0.25 * (x * x - z * z) * np.log(square) - 0.75 * x * x + x * z * np.arctan(x / z)


@lru_cache(maxsize=256)
def _height_nodes(h: float, t: tuple[float, float]) -> tuple[Array, Array]:
    """Nodes (m) and weights (no unit) over the difference of two uniform heights, derived here: its density is a
    trapezium with corners at outer and inner, and Gauss points lie between these.
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
"""Logarithm of what the polynomial in the squared height may be off by."""


def nodes_enough(squares: Array, apart: Array) -> Index:
    """How many nodes (n; no unit) stand for sorted squared heights (m2) of points `apart` (n; m): all of them, where no
    fewer do. 1 / sqrt(apart^2 + h^2) has its pole in h^2 at -apart^2, so the polynomial's error falls like rho^-count
    with ln rho = acosh(1 + distance of the pole in half the range) (Trefethen, Approximation Theory and Approximation
    Practice, 2013, chapter 8).
    """
    low, high = float(squares[0]), float(squares[-1])
    if high <= low:
        return np.ones(apart.shape, dtype=np.intp)
    beyond = 2.0 * (np.maximum(apart, 0.0) ** 2 + low) / max(high - low, 1e-300)
    count = np.ceil(-RIGHT / np.arccosh(1.0 + np.maximum(beyond, 1e-12)))
    return np.clip(count, 1, squares.size).astype(np.intp)


def height_nodes(squares: Array, count: int) -> tuple[Array, Array]:
    """So many squared heights (count; m2) at Chebyshev's points, and what each of `squares` (m2) weighs at them in the
    polynomial (heights, count; no unit).
    """
    if count >= squares.size:
        return squares, np.eye(squares.size)
    low, high = float(squares[0]), float(squares[-1])
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    if half <= 0.0:
        return squares[:1], np.ones((squares.size, 1))
    nodes = chebyshev_points(-1.0, 1.0, count)
    return middle + half * nodes, shares(nodes, (squares - middle) / half)
