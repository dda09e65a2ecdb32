"""A spiral winding as coaxial rings: the radii that its layers have at an azimuth, and the inductance of the rings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.inductance.mean_distance import strand_clearance
from sitscad.physics.inductance.spirals import SpiralLayer
from sitscad.physics.special.elliptic import coaxial_rings
from sitscad.physics.special.legendre import gauss

Array = NDArray[np.float64]

PASSING = 2.0
"""Azimuths for every pitch by which crossing layers pass each other, over how near they do."""

MOST = 60
"""Azimuths between two ends at most: turns so far apart against their width and distance hardly see each other."""


def radii_at(layers: Sequence[SpiralLayer], azimuth: float) -> list[Array]:
    """For every layer, the radii (m) at which its centre line meets the half-plane of an azimuth (rad)."""
    found = []
    for layer in layers:
        first = (layer.sense * (azimuth - layer.angle)) % (2.0 * math.pi)
        theta = np.arange(first, layer.span, 2.0 * math.pi)
        found.append(layer.radius - layer.pitch / (2.0 * math.pi) * theta)
    return found


def azimuths(layers: Sequence[SpiralLayer], points: int) -> list[tuple[float, float]]:
    """Azimuths (rad) and weights (sum 1): Gauss points between the directions in which any layer begins or ends."""
    ends = {round((layer.angle + layer.sense * t) % (2.0 * math.pi), 9) for layer in layers for t in (0.0, layer.span)}
    corners = sorted(ends)
    corners.append(corners[0] + 2.0 * math.pi)
    nodes, weights = gauss(points)
    chosen = []
    for low, high in pairwise(corners):
        if high - low < 1e-7:
            continue
        half = 0.5 * (high - low)
        chosen += [(low + half * (1.0 + x), half * w / (2.0 * math.pi)) for x, w in zip(nodes, weights, strict=True)]
    return chosen


def ring_winding_inductance(layers: Sequence[SpiralLayer], points: int | None = None) -> float:
    """Inductance (H) of the layers in series as coaxial rings, averaged over azimuths; self terms by the GMD.

    Rings of every pair keep the geometric mean distance of their rectangles. Half of 198 random coils of five turns and
    more are within 0.014 %, nine in ten within 0.08 %, all within 0.23 %; a ring ignores that a fractional turn is
    open, so up to 1 % below that. `points` azimuths lie between two ends of layers: enough by default, up to MOST, for
    the rings of crossing layers to pass each other.
    """
    total = 0.0
    for azimuth, weight in azimuths(layers, points or _enough(layers)):
        radii = radii_at(layers, azimuth)
        for i, first in enumerate(layers):
            for j in range(i + 1):
                if radii[i].size and radii[j].size:
                    double = 1.0 if i == j else 2.0 * first.circulation * layers[j].circulation
                    total += weight * double * _block(first, layers[j], radii[i], radii[j])
    return total


def _enough(layers: Sequence[SpiralLayer]) -> int:
    # In a full turn crossing layers pass each other by two pitches; what they are to each other changes within about
    # their distance and a share of their width.
    reach = [abs(a.z - b.z) + 0.25 * a.width for a in layers for b in layers if a.sense != b.sense]
    return min(MOST, max(3, math.ceil(PASSING * layers[0].pitch / min(reach)))) if reach else 3


def _block(first: SpiralLayer, second: SpiralLayer, one: Array, other: Array) -> float:
    height = first.z - second.z
    gap = one[:, None] - other[None, :]
    clearance = strand_clearance(gap, height, (first.width, second.width), (first.thickness, second.thickness), 1)
    return float(np.sum(coaxial_rings(one[:, None], other[None, :], gap**2 + height**2 + clearance)))
