"""A slow integrator of Neumann's integral over the real cross-sections: the yardstick for the fast methods.

Nothing of the fast methods' arrangement is used: for every point of one spiral the other is integrated along its own
angle, panel by panel between the places where it passes by. The width is cut into strips, each of which keeps its own
geometric mean distance to every other strip; strips, points and panels are refined until nothing changes.
"""

from __future__ import annotations

import math

import numpy as np

from sitscad.physics.constants import MU0
from sitscad.physics.mean_distance import strand_clearance
from sitscad.physics.spirals import SpiralLayer


def crowded(low, high, count):
    """Gauss points on [low, high] (arrays) crowded towards both ends."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    t = 0.5 * (1.0 + nodes)
    x = t * t * (3.0 - 2.0 * t)
    low, high = np.asarray(low)[..., None], np.asarray(high)[..., None]
    return low + (high - low) * x, (high - low) * 0.5 * weights * 6.0 * t * (1.0 - t)


def mutual(first: SpiralLayer, second: SpiralLayer, strips: int = 3, panels: int = 8, points: int = 10) -> float:
    """Mutual inductance (H) of two layers, the self one when they are the same; uniform current."""
    edges = np.linspace(0.0, first.span, max(2, math.ceil(first.turns * panels)) + 1)
    theta, weight = crowded(edges[:-1], edges[1:], points)
    theta, weight = theta.ravel(), weight.ravel()
    slope = first.pitch / (2.0 * math.pi)
    azimuth = first.angle + first.sense * theta
    # the angle on the second layer at which it has this azimuth, and every whole turn from there
    base = (second.sense * (azimuth - second.angle)) % (2.0 * math.pi)
    centres = base[:, None] + 2.0 * math.pi * np.arange(-1, math.ceil(second.turns) + 1)
    offsets = (np.arange(strips) + 0.5) / strips - 0.5
    strip_widths = (first.width / strips, second.width / strips)
    height = first.z - second.z
    sign = (1 if first.inward else -1) * (1 if second.inward else -1)
    total = 0.0
    for a in offsets * first.width:
        r1 = first.radius + a - slope * theta
        for b in offsets * second.width:
            across = (r1[:, None]) - (second.radius + b - slope * centres)
            clearance = strand_clearance(across, height, strip_widths, (first.thickness, second.thickness), 1)
            for side in (-1.0, 1.0):
                other = np.clip(centres + side * math.pi, 0.0, second.span)
                near = np.clip(centres, 0.0, second.span)
                low, high = (other, near) if side < 0 else (near, other)
                scale = np.sqrt(np.maximum(across**2 + height**2 + clearance, 1e-16)) / r1[:, None]
                total += _branch(
                    first, second, r1, theta, weight, centres, low, high, scale, clearance, height, b, slope
                )
    return sign * MU0 / (4.0 * math.pi) * total / strips**2


def _branch(first, second, r1, theta, weight, centres, low, high, scale, clearance, height, b, slope):
    nodes, share = np.polynomial.legendre.leggauss(24)
    start, end = np.arcsinh((low - centres) / scale), np.arcsinh((high - centres) / scale)
    t = 0.5 * (start + end)[..., None] + 0.5 * (end - start)[..., None] * nodes
    v = scale[..., None] * np.sinh(t)
    jacobian = 0.5 * (end - start)[..., None] * share * scale[..., None] * np.cosh(t)
    r2 = second.radius + b - slope * (centres[..., None] + v)
    p = r1[:, None, None]
    # second's azimuth less first's is sense2 * v, whole turns aside
    psi = -second.sense * v
    s1, s2 = first.sense, second.sense
    dot = (slope**2 + s1 * s2 * p * r2) * np.cos(psi) + slope * np.sin(psi) * (s1 * p - s2 * r2)
    squared = (p - r2) ** 2 + 4.0 * p * r2 * np.sin(0.5 * psi) ** 2 + height**2 + clearance[..., None]
    # Panels beyond the curve's ends have no width, whatever the distance there would be.
    return float(np.sum(weight[:, None, None] * jacobian * dot / np.sqrt(np.maximum(squared, 1e-18))))


def winding(layers, strips: int = 3, panels: int = 8) -> float:
    """Inductance (H) of layers in series."""
    pairs = [(i, j) for i in range(len(layers)) for j in range(i + 1)]
    return sum((1.0 if i == j else 2.0) * mutual(layers[i], layers[j], strips, panels) for i, j in pairs)


def converged(layers, panels: int = 8) -> float:
    """The limit of ever finer strips, from 3 and 5 of them: the error falls with the square of their width."""
    return (25.0 * winding(layers, 5, panels) - 9.0 * winding(layers, 3, panels)) / 16.0
