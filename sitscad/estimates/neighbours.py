"""Mutual inductance between the windings of different coils: filaments, the coils lying side by side."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.windings import WindingGeometry
from sitscad.layout.board import Coil
from sitscad.physics.filaments import sampled_mutual_inductance, track_mutual_inductance
from sitscad.physics.mean_distance import gauss

Array = NDArray[np.float64]

MOST_NODES = 1600
"""Nodes of one coil's curve beyond which turns are sampled more coarsely (never below 8 a turn)."""


def inductance_matrix(self_inductance: float, coils: list[tuple[Coil, WindingGeometry]]) -> Array:
    """Inductance matrix (H) of alike coils; a displacement that occurs again is not computed again."""
    count = len(coils)
    matrix = np.full((count, count), self_inductance)
    known: dict[tuple[float, ...], float] = {}
    for i in range(count):
        for j in range(i):
            key = _displacement(coils[i][0], coils[j][0])
            if key not in known:
                known[key] = _mutual(coils[i], coils[j])
            matrix[i, j] = matrix[j, i] = known[key]
    return matrix


def _displacement(one: Coil, other: Coil) -> tuple[float, ...]:
    dx, dy = one.centre.x - other.centre.x, one.centre.y - other.centre.y
    a, b = one.placement.rotation, other.placement.rotation
    if (dx, dy) < (0.0, 0.0):
        dx, dy, a, b = -dx, -dy, b, a
    return round(dx, 9), round(dy, 9), round(a, 9), round(b, 9)


def _mutual(one: tuple[Coil, WindingGeometry], other: tuple[Coil, WindingGeometry]) -> float:
    (first, a), (second, b) = one, other
    if a.spirals:
        return sampled_mutual_inductance(_samples(a, first.centre), _samples(b, second.centre))
    return math.fsum(
        track_mutual_inductance(p.shifted(*first.centre), q.shifted(*second.centre), 1)
        for p in a.tracks
        for q in b.tracks
    )


def _samples(geometry: WindingGeometry, centre: tuple[float, float]) -> tuple[Array, Array]:
    # Gauss points on every half turn: positions (n, 3) and elements dl (n, 2) in the current's direction.
    halves = max(1, math.ceil(2.0 * geometry.turns))
    per_half = int(min(6, max(4, MOST_NODES // (halves * len(geometry.spirals)))))
    nodes, weights = gauss(per_half)
    points, elements = [], []
    for layer in geometry.spirals:
        step = layer.span / halves
        theta = (step * (np.arange(halves)[:, None] + 0.5 * (1.0 + nodes))).ravel()
        weight = np.tile(0.5 * step * weights, halves) * (1.0 if layer.inward else -1.0)
        slope = layer.pitch / (2.0 * math.pi)
        radius, angle = layer.radius - slope * theta, layer.angle + layer.sense * theta
        cosine, sine = np.cos(angle), np.sin(angle)
        height = np.full_like(theta, layer.z)
        points.append(np.stack([centre[0] + radius * cosine, centre[1] + radius * sine, height], axis=1))
        turn = layer.sense * radius
        elements.append(
            np.stack([-slope * cosine - turn * sine, -slope * sine + turn * cosine], axis=1) * weight[:, None]
        )
    return np.concatenate(points), np.concatenate(elements)
