"""Integral of 1/distance over two straight pieces of track as sheets or plates: two walks around their outlines.

With g = R - h ln(R + h), R^2 = rho^2 + h^2, the plane Laplacian of g is 1/R. So Gauss's theorem, used once on each of
two polygons in parallel planes h apart, turns the four-fold integral of 1/R into minus the double integral of g along
both outlines, element times element. g is smooth where 1/R is not; its integral along one edge is closed, the other one
is Gauss points crowded towards where the edges pass each other. The mean over the thicknesses is a Gauss sum over
heights.
"""

from __future__ import annotations

import numpy as np


def sides_mutual(first, second, heights, count, graded, chunk=4000):
    """Sum over pairs k of the integral of t1.t2 / R over two mitred sides, divided by both widths (m).

    `first`, `second` are (corners (k, 4, 2) counter-clockwise from the right start, tangents (k, 2), width); `heights`
    lists (height, weight); `graded(count)` gives points and weights of [0, 1] crowded towards both ends.
    """
    total = 0.0
    for k in range(0, len(first[0]), chunk):
        part = slice(k, k + chunk)
        total += _part(first[0][part], second[0][part], first[1][part], second[1][part], heights, graded(count))
    return total / (first[2] * second[2])


def _part(p, q, t1, t2, heights, points):
    share = np.sum(t1 * t2, axis=1)
    a, b = np.repeat(np.arange(4), 4), np.tile(np.arange(4), 4)
    starts, ends = p[:, a].reshape(-1, 2), p[:, (a + 1) % 4].reshape(-1, 2)
    other_starts, other_ends = q[:, b].reshape(-1, 2), q[:, (b + 1) % 4].reshape(-1, 2)
    edge, other = ends - starts, other_ends - other_starts
    dot = np.repeat(share, 16) * np.sum(edge * other, axis=1)
    # points along the shorter edge, the longer one closed
    swap = np.sum(edge * edge, axis=1) > np.sum(other * other, axis=1)
    column = swap[:, None]
    starts, other_starts = np.where(column, other_starts, starts), np.where(column, starts, other_starts)
    edge, other = np.where(column, other, edge), np.where(column, edge, other)
    stored = np.abs(dot) > 1e-14 * np.hypot(*edge.T) * np.hypot(*other.T)
    return -_outlines(starts[stored], edge[stored], other_starts[stored], other[stored], dot[stored], heights, points)


def _outlines(start, edge, other_start, other, dot, heights, points):
    length = np.hypot(*other.T)
    t = other / length[:, None]
    square = np.sum(edge * edge, axis=1)
    low, step, pair = _cut(start, edge, other_start, other, square)
    place = low[:, None] + step[:, None] * points[0]
    where = start[pair, None, :] + place[..., None] * edge[pair, None, :] - other_start[pair, None, :]
    along = where[..., 0] * t[pair, None, 0] + where[..., 1] * t[pair, None, 1]
    across = np.abs(where[..., 0] * t[pair, None, 1] - where[..., 1] * t[pair, None, 0])
    weight = (dot / length)[pair, None] * step[:, None] * points[1]
    total = 0.0
    for height, share in heights:
        value = _along(length[pair, None] - along, across, height) - _along(-along, across, height)
        total += share * float(np.sum(weight * value))
    return total


def _cut(start, edge, other_start, other, square):
    # Panels of each edge: between its ends, the feet of the other's ends, and where the two lines cross.
    cross = edge[:, 0] * other[:, 1] - edge[:, 1] * other[:, 0]
    wide = np.abs(cross) > 1e-6 * np.sqrt(square) * np.hypot(*other.T)
    away = other_start - start
    meeting = (away[:, 0] * other[:, 1] - away[:, 1] * other[:, 0]) / np.where(wide, cross, 1.0)
    foot = np.sum(away * edge, axis=1) / square
    second = foot + np.sum(other * edge, axis=1) / square
    cuts = np.clip(np.stack([foot, second, np.where(wide, meeting, 0.0)], axis=1), 0.0, 1.0)
    edges = np.concatenate([np.zeros((len(start), 1)), np.sort(cuts, axis=1), np.ones((len(start), 1))], axis=1)
    low, high = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    stored = high - low > 1e-12
    return low[stored], (high - low)[stored], np.repeat(np.arange(len(start)), 4)[stored]


def _along(u, d, h):
    # Integral of R - h ln(R + h) over u, with R^2 = u^2 + d^2 + h^2.
    square = d * d + h * h
    distance = np.sqrt(u * u + square + 1e-60)
    bent = np.arcsinh(u / np.sqrt(square + 1e-60))
    angles = d * (np.arctan2(u, d) - np.arctan2(h * u, d * distance))
    return 0.5 * (u * distance + square * bent) - h * (u * np.log(distance + h + 1e-60) - u + angles + h * bent)
