"""Mutual inductance of two straight-sided tracks, side by side in closed form: what faster sums are held against."""

from __future__ import annotations

import math

import numpy as np

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.filaments import (
    TOUCHING,
    PolylineTrack,
    inclined_integral,
    parallel_filaments,
)
from sitscad.kernels.electromagnetics.inductance.mean_distance import strand_clearance
from sitscad.kernels.electromagnetics.special_functions import gauss


def track_mutual_inductance(first: PolylineTrack, second: PolylineTrack, strands: int = 2) -> float:
    """Mutual inductance (H) of two tracks (the self one for the same track), uniform current over the cross-sections.

    Strands at the Gauss points of the width follow the mitred corners; the rectangles' geometric mean distance is kept
    for inclined sides too. Parallel sides by Grover (1946), chapter 6, inclined ones by Campbell (1915).
    """
    nodes, weights = gauss(strands)
    height = first.z - second.z
    clearance = _clearance(first, second, height, strands)
    total = 0.0
    for x, item in zip(nodes, weights, strict=True):
        for y, other in zip(nodes, weights, strict=True):
            p, q = first.strand(0.5 * first.width * x), second.strand(0.5 * second.width * y)
            total += 0.25 * item * other * _mutual(p, q, height**2, clearance)
    return float(total)


def _clearance(first, second, height, strands):
    """By how much (m2) the squared distances of the strands of each pair of sides grow, (n, m)."""
    sides = np.diff(first.corners, axis=0)
    normals = np.stack([-sides[:, 1], sides[:, 0]], axis=1) / np.hypot(*sides.T)[:, None]
    middles = 0.5 * (second.corners[1:] + second.corners[:-1])
    across = np.abs(normals @ middles.T - np.sum(normals * first.corners[:-1], axis=1)[:, None])
    # far sides need none: the table ends at five widths, as the sums that are held against this one do
    reach = np.minimum(across, 5.0 * max(first.width, second.width))
    return strand_clearance(reach, height, (first.width, second.width), (first.thickness, second.thickness), strands)


def _mutual(p, q, square, clearance):
    """Mutual inductance (H) of two lines of corners (n, 2) in parallel planes, `square` (m2) that of their distance."""
    item, other = np.diff(p, axis=0)[:, None], np.diff(q, axis=0)[None]
    length, reach = np.linalg.norm(item, axis=2), np.linalg.norm(other, axis=2)
    t, u = item / length[..., None], other / reach[..., None]
    cosine, sine = np.sum(t * u, axis=2), _cross(t, u)
    away = q[None, :-1] - p[:-1, None]
    parallel = np.abs(sine) < 1e-9
    start, aside = np.sum(t * away, axis=2), _cross(t, away)
    distance = np.maximum(aside**2 + square + clearance, TOUCHING**2)
    level = parallel_filaments(np.broadcast_to(length, sine.shape), start, start + reach * cosine, distance)
    at = ~parallel & (np.abs(cosine) > 1e-9)
    length, reach = (np.broadcast_to(x, sine.shape)[at] for x in (length, reach))
    u0 = -(_cross(away, u)[at]) / sine[at]
    v0 = -(_cross(away, t)[at]) / sine[at]
    apart = square + np.clip(clearance[at], TOUCHING**2, None)  # a negative one would take crossing lines for touching
    inclined = inclined_integral(u0, u0 + length, v0, v0 + reach, cosine[at], np.abs(sine[at]), apart)
    return np.sum(level[parallel]) + MU0 / (4.0 * math.pi) * np.sum(cosine[at] * inclined)


def _cross(a, b):
    """The third component of a x b."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
