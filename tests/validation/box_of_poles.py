"""The yardstick for finite magnetic plates: a box of endless permeability whose six faces are covered with poles.

Every panel carries an even density of magnetic poles; together, and without a sum, they make the scalar potential the
same at all panel centres. Panels shrink towards the edges. The coil's potential is an integral over Bessel functions of
scipy; the poles' is that of points, and of a rectangle for a panel on itself.
"""

from __future__ import annotations

import math

import numpy as np
from box_of_loops import box_panels
from scipy.special import j0, j1


def _spectrum(radii, heights, k, level):
    return (radii * j1(k[:, None] * radii) * np.exp(-k[:, None] * (level - heights))).sum(axis=1)


def _waves(depth, reach):
    # even nodes up to where exp(-k depth) has died out
    count = math.ceil(16.0 / depth * reach * 2.0) + 400
    k = 16.0 / depth * (np.arange(count) + 0.5) / count
    return k, 16.0 / depth / count


def pole_share(size, thickness, offset, radii, heights, gap, across=24, through=6):
    """Change of inductance of rings by the box over that by an endless half-space of endless permeability."""
    corners = box_panels(size, thickness, across, through)
    middles = corners.mean(axis=1)
    sides = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1), np.linalg.norm(corners[:, 2] - corners[:, 1], axis=1)
    area = sides[0] * sides[1]
    distance = np.linalg.norm(middles[:, None] - middles, axis=2)
    np.fill_diagonal(distance, 1.0)
    potential = area / (4.0 * math.pi * distance)
    a, b = sides
    own = 2.0 * (a * np.arcsinh(b / a) + b * np.arcsinh(a / b)) / (4.0 * math.pi)
    np.fill_diagonal(potential, own)
    k, step = _waves(gap - heights.max(), radii.max() + max(size))
    rho = np.hypot(middles[:, 0] - offset, middles[:, 1])
    outside = np.empty(len(middles))
    for level in np.unique(np.round(middles[:, 2], 12)):
        here = np.abs(middles[:, 2] - level) < 1e-11
        waves = _spectrum(radii, heights, k, gap + level) * step
        outside[here] = 0.5 * j0(rho[here][:, None] * k) @ waves
    count = len(middles)
    system = np.zeros((count + 1, count + 1))
    system[:count, :count], system[:count, count], system[count, :count] = potential, 1.0, area
    density = np.linalg.solve(system, np.append(-outside, 0.0))[:count]
    front = _spectrum(radii, heights, k, gap)
    return float(-np.sum(density * area * outside) / (math.pi * np.sum(front**2) * step))
