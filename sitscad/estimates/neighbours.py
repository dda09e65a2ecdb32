"""Mutual inductance between the windings of different coils: filaments, the coils lying side by side."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.windings import WindingGeometry
from sitscad.layout.board import Coil
from sitscad.physics.filaments import sampled_mutual_inductance
from sitscad.physics.mean_distance import gauss
from sitscad.physics.tracks import tracks_mutual_inductance

Array = NDArray[np.float64]

ONE_FILAMENT = 6.0
"""Gap between two coils, in track widths, from which one filament a track is enough."""


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
    apart = math.hypot(first.centre.x - second.centre.x, first.centre.y - second.centre.y)
    if a.spirals:
        gap = max(apart - a.spirals[0].radius - b.spirals[0].radius, a.spirals[0].width)
        return sampled_mutual_inductance(_samples(a, first.centre, gap), _samples(b, second.centre, gap))
    width = a.drawn[0].width
    strands = (1, 1) if apart - max(_reach(a), _reach(b)) > ONE_FILAMENT * width else (2, 2)
    return math.fsum(
        tracks_mutual_inductance(p.shifted(*first.centre), q.shifted(*second.centre), strands)
        for p in a.drawn
        for q in b.drawn
    )


def _reach(geometry: WindingGeometry) -> float:
    # Twice the distance of the outermost corner or arc from the centre.
    track = geometry.drawn[0]
    corners = np.hypot(*np.concatenate([track.starts, track.ends]).T) if len(track.starts) else np.zeros(1)
    arcs = np.hypot(track.arcs[:, 0], track.arcs[:, 1]) + track.arcs[:, 2] if len(track.arcs) else np.zeros(1)
    return 2.0 * float(max(corners.max(), arcs.max()))


def _samples(geometry: WindingGeometry, centre: tuple[float, float], gap: float) -> tuple[Array, Array]:
    # Gauss points on every half turn, as close together as the other coil's distance from it asks: positions (n, 3)
    # and elements dl (n, 2) in the current's direction. `gap` is between the outermost centre lines.
    points, elements = [], []
    for layer in geometry.spirals:
        halves = max(1, math.ceil(2.0 * layer.turns))
        step = layer.span / halves
        for k in range(halves):
            inset = 0.5 * k * layer.pitch * (2.0 * layer.turns / halves)
            count = math.ceil(3.0 + 1.5 * math.pi * (layer.radius - inset) / (gap + inset))
            nodes, weights = gauss(min(64, max(4, count)))
            theta = step * (k + 0.5 * (1.0 + nodes))
            weight = 0.5 * step * weights * (1.0 if layer.inward else -1.0)
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
