"""Two coils as straight wires without an end and a target as a perfect conductor, in the plane: the thesis's chapter 5.

A wire's vector potential is -mu0 I / (2 pi) ln r; the target's surface has one potential and carries no current in all.
Its surface current is constant on each of some segments, which shrink towards the corners.
"""

from __future__ import annotations

import numpy as np

TURNS = 3.5e-3 - 50e-6 - 200e-6 * np.arange(12)
WIDE, TALL, PITCH, THICK = 100e-6, 35e-6, 8e-3, 0.2e-3
ALONG, UP = 120, 10
"""Segments of the long sides and of the short ones."""

ITSELF = 0.2235 * (WIDE + TALL)
"""Geometric mean distance of a rectangle from itself (Rosa; Grover, Inductance Calculations, 1946)."""


def output(width: float, gap: float, shift: float) -> np.ndarray:
    """Change of both coils' inductance over that without target, for a target of a width at a gap, shifted (m)."""
    ends = _segments(width, gap, shift)
    middles, steps = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
    lengths = np.hypot(*steps.T)
    system = np.zeros((len(lengths) + 1,) * 2)
    system[:-1, :-1], system[:-1, -1], system[-1, :-1] = _potential(middles, ends), -1.0, lengths
    places, currents = _coil()
    own = np.hypot(*(places[:, None] - places[None]).T)
    np.fill_diagonal(own, ITSELF)
    free = -currents @ np.log(own) @ currents
    result = []
    for side in (-0.5, 0.5):
        wires = places + np.array([side * PITCH, 0.0])
        given = -np.log(np.hypot(*(middles[:, None] - wires[None]).T)).T @ currents
        density = np.linalg.solve(system, np.append(-given, 0.0))[:-1]
        result.append(currents @ (_potential(wires, ends) @ density) / free)
    return np.array(result)


def _coil() -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) and currents (n) of a coil's wires about its middle: two layers, out on one side, back on the
    other.
    """
    x = np.concatenate([-TURNS, TURNS])
    places = np.concatenate([np.column_stack([x, np.full_like(x, z)]) for z in (30e-6, -30e-6)])
    return places, -np.sign(places[:, 0])


def _segments(width: float, gap: float, shift: float) -> np.ndarray:
    """Ends (n, 2, 2) of the pieces of the target's surface."""
    x, z = np.array([-0.5, 0.5, 0.5, -0.5]) * width + shift, np.array([0.0, 0.0, 1.0, 1.0]) * THICK + gap
    corners, result = np.column_stack([x, z]), []
    for k, count in enumerate((ALONG, UP, ALONG, UP)):
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(count + 1) / count)
        points = corners[k] + (corners[(k + 1) % 4] - corners[k]) * share[:, None]
        result.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate(result)


def _potential(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Integral of -ln r over each segment, (points, segments)."""
    way = ends[:, 1] - ends[:, 0]
    length = np.hypot(*way.T)
    unit, away = way / length[:, None], points[:, None] - ends[None, :, 0]
    along = np.sum(away * unit, axis=2)
    height = np.abs(away[..., 0] * unit[:, 1] - away[..., 1] * unit[:, 0])

    def primitive(s: np.ndarray) -> np.ndarray:
        square = np.maximum(s * s + height * height, 1e-300)
        return 0.5 * s * np.log(square) - s + height * np.arctan2(s, np.maximum(height, 1e-300))

    return primitive(along - length) - primitive(along)
