"""Capacitance of stacked and neighbouring tracks, and of a winding between its terminals."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.physics.constants import EPSILON0

EDGE = 2.0 * math.log(2.0) / math.pi
"""Fringe of a wide parallel-plate edge, in plate distances (0.44; Maxwell's edge correction)."""


def stacked_strips(width: float, distance: float, relative_permittivity: float) -> float:
    """Capacitance per length (F/m) of two equal strips face to face: plate formula with Maxwell's edges, about 10 %.

    Width and distance between the facing surfaces in metres; the same dielectric is taken all round.
    """
    return EPSILON0 * relative_permittivity * (width / distance + 2.0 * EDGE)


def coplanar_strips(width: float, spacing: float, relative_permittivity: float) -> float:
    """Capacitance per length (F/m) of two equal thin strips side by side: eps K(k') / K(k), k = s / (s + 2 w).

    `relative_permittivity` is the effective one: half of dielectric and air for a board thick against the spacing.
    """
    k = spacing / (spacing + 2.0 * width)
    complement = math.sqrt(1.0 - k * k)
    return EPSILON0 * relative_permittivity * _mean(1.0, complement) / _mean(1.0, k)


def crossing_layers(length: float, width: float, pitch: float, distance: float, relative_permittivity: float) -> float:
    """Capacitance (F) between two spiral layers whose tracks cross: the facing copper averaged over all offsets.

    `length` (m) is one layer's track, `distance` (m) between the facing surfaces. Each edge reaches 0.44 distances
    further; of the other layer's area a share width/pitch is copper, likewise widened. About 20 %.
    """
    widened = min(pitch, width + 2.0 * EDGE * distance)
    return EPSILON0 * relative_permittivity * length * widened * widened / (pitch * distance)


def winding_capacitance(between_layers: Sequence[float]) -> float:
    """Capacitance (F) that n layers in series show at their terminals: 4 sum C / (3 n^2), n - 1 gaps given.

    Voltage rises evenly along the track; where two layers join it is equal, at the far end 2/n of the whole
    (Zolfaghari, Chan, Razavi 2001). Two layers: a third of the capacitance between them.
    """
    layers = len(between_layers) + 1
    return 4.0 * math.fsum(between_layers) / (3.0 * layers * layers)


def turn_capacitance(length: float, turns: float, width: float, spacing: float, relative_permittivity: float) -> float:
    """Capacitance (F) of a single layer by its neighbouring turns, each a 1/N of the voltage apart."""
    if turns <= 1.0:
        return 0.0
    shared = length * (turns - 1.0) / turns
    return coplanar_strips(width, spacing, relative_permittivity) * shared / (turns * turns)


def series_permittivity(thicknesses: Sequence[float], permittivities: Sequence[float]) -> float:
    """Relative permittivity of layers one over the other: total thickness over the sum of thickness / permittivity."""
    return math.fsum(thicknesses) / math.fsum(t / e for t, e in zip(thicknesses, permittivities, strict=True))


def _mean(a: float, b: float) -> float:
    for _ in range(12):
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return a
