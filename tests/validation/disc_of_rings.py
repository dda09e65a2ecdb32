"""A round plate of finite conductivity under coaxial rings: its body as rings that carry their own eddy currents.

Nothing of the sheets, shares and rules of `physics.finite_plate`: rings from the skin at every face inwards,
Maxwell's mutual inductance of coaxial circles (1873, art. 701), the geometric mean distance of neighbours in place of
the distance of their centres, and one complex system at the frequency. Halving the cells changes it by below 1 %.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ellipe, ellipkm1

MU0 = 4e-7 * math.pi
COPPER = 5.8e7
NEIGHBOURS = 6.0
"""Distance, in the longest side of two cells, up to which their mean distance is taken."""


def disc_change(radii, gap, diameter, thickness, frequency=5e6, first=8e-6, growth=1.5):
    """Change of inductance (H) and resistance (ohm) of rings at z = 0 by a copper disc whose near face is at `gap` (m).

    `first` (m) is the size of the cells at the faces; they grow by `growth` inwards.
    """
    r, z, width, height = _cells(0.5 * diameter, gap, thickness, max(0.25 * gap, diameter / 60.0), first, growth)
    inductance = np.array([_row(i, r, z, width, height) for i in range(r.size)])
    omega = 2.0 * math.pi * frequency
    impedance = np.diag(2.0 * math.pi * r / (COPPER * width * height)) + 0.5j * omega * (inductance + inductance.T)
    coupling = sum(_circles(radius, 0.0, r, z) for radius in radii)
    change = 1j * omega * coupling @ np.linalg.solve(impedance, -1j * omega * coupling)
    return change.imag / omega, change.real


def _cells(radius, gap, thickness, widest, first, growth):
    steps = [0.0]
    step = first
    while steps[-1] < radius:
        steps.append(steps[-1] + step)
        step = min(step * growth, widest)
    inwards = radius - np.array(steps[:-1])
    r = np.append(inwards[inwards > 0.3 * (steps[-1] - steps[-2])], 0.0)[::-1]
    half = [0.0]
    step = min(first, thickness / 6.0)
    while half[-1] + step < 0.5 * thickness:
        half.append(half[-1] + step)
        step *= growth
    lower = np.array(half) * 0.5 * thickness / half[-1]
    z = gap + np.concatenate([lower, thickness - lower[-2::-1]])
    centres = np.meshgrid(0.5 * (r[1:] + r[:-1]), 0.5 * (z[1:] + z[:-1]), indexing="ij")
    sizes = np.meshgrid(np.diff(r), np.diff(z), indexing="ij")
    return tuple(part.ravel() for part in (*centres, *sizes))


def _row(i, r, z, width, height):
    with np.errstate(all="ignore"):
        row = _circles(r[i], z[i], r, z)
    distance = np.hypot(r - r[i], z - z[i])
    near = distance < NEIGHBOURS * np.maximum(np.maximum(width, height), max(width[i], height[i]))
    mean = _log_mean_distance((r - r[i])[near], (z - z[i])[near], (width[i], height[i]), (width[near], height[near]))
    away = distance[near]
    with np.errstate(all="ignore"):
        row[near] += MU0 * np.sqrt(r[i] * r[near]) * (np.log(away) - mean)
    row[i] = MU0 * r[i] * (math.log(8.0 * r[i]) - mean[away == 0.0][0] - 2.0)
    return row


def _circles(radius, height, r, z):
    up = (z - height) ** 2
    complement = ((r - radius) ** 2 + up) / ((r + radius) ** 2 + up)
    k = np.sqrt(1.0 - complement)
    return MU0 * np.sqrt(radius * r) * ((2.0 / k - k) * ellipkm1(complement) - 2.0 / k * ellipe(1.0 - complement))


def _log_mean_distance(x, y, one, other):
    # Mean of ln(distance) over two rectangles with parallel sides: the fourfold integral at their sixteen corners.
    unit = max(*one, other[0].max(), other[1].max())
    x, y, w, h, v, g = (np.asarray(value) / unit for value in (x, y, *one, *other))
    across = ((x + (v + w) / 2, 1), (x + (v - w) / 2, -1), (x - (v - w) / 2, -1), (x - (v + w) / 2, 1))
    along = ((y + (g + h) / 2, 1), (y + (g - h) / 2, -1), (y - (g - h) / 2, -1), (y - (g + h) / 2, 1))
    total = sum(a * b * _fourfold(p, q) for p, a in across for q, b in along)
    return total / (w * h * v * g) - 25.0 / 12.0 + math.log(unit)


def _fourfold(x, y):
    square = x * x + y * y
    log = np.log(np.where(square > 0.0, square, 1.0))
    angles = x * x * np.arctan2(y * np.sign(x), np.abs(x)) + y * y * np.arctan2(x * np.sign(y), np.abs(y))
    return 0.5 * ((x * x * y * y / 4.0 - (x**4 + y**4) / 24.0) * log + x * y / 3.0 * angles)
