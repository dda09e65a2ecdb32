"""Mutual inductance between the windings of different coils, and how far it can be from the truth."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.winding.methods import WindingGeometry
from sitscad.layout.board import Coil
from sitscad.physics.constants import MU0
from sitscad.physics.inductance.side_by_side import SideBySide, spirals_side_by_side, tracks_side_by_side
from sitscad.spec.coil import CoilSpec

Array = NDArray[np.float64]

Placed = tuple[Coil, WindingGeometry]
"""A coil and its winding about its own centre."""

FAR_ERROR, NEAR_ERROR = 4e-5, 1e-4
"""Relative error of a mutual inductance far away, and what nearness adds to it."""

END_ERROR = 5e-4
"""What nearness adds for each pair of layers, in mu0/(4 pi) times the track width: open ends beside the other coil."""


def inductance_matrix(self_inductance: float, self_error: float, coils: list[Placed]) -> tuple[Array, Array]:
    """Inductance matrix (H) of alike coils, and what its elements can be off by at most (H).

    `self_error` is the relative bound of the coils' own inductance. A displacement that occurs again is not computed
    again.
    """
    count = len(coils)
    matrix = np.full((count, count), self_inductance)
    errors = np.full((count, count), self_inductance * self_error)
    known: dict[tuple[float, ...], SideBySide] = {}
    for i in range(count):
        for j in range(i):
            key = _displacement(coils[i][0], coils[j][0])
            if key not in known:
                known[key] = side_by_side(coils[i], coils[j])
            matrix[i, j] = matrix[j, i] = known[key].inductance
            errors[i, j] = errors[j, i] = mutual_error(known[key], coils[i][1].spec)
    return matrix, errors


def mutual_error(pair: SideBySide, spec: CoilSpec) -> float:
    """What a mutual inductance can be off by at most (H): held against the volume integral over random pairs of coils
    (tests/validation/coil_pairs.py).
    """
    relative = FAR_ERROR + NEAR_ERROR * pair.nearness
    ends = END_ERROR * pair.nearness * len(spec.layers) ** 2 * MU0 / (4.0 * math.pi) * spec.trace_width
    return relative * abs(pair.inductance) + ends


def _displacement(one: Coil, other: Coil) -> tuple[float, ...]:
    dx, dy = one.centre.x - other.centre.x, one.centre.y - other.centre.y
    a, b = one.placement.rotation, other.placement.rotation
    if (dx, dy) < (0.0, 0.0):
        dx, dy, a, b = -dx, -dy, b, a
    return round(dx, 9), round(dy, 9), round(a, 9), round(b, 9)


def side_by_side(one: Placed, other: Placed) -> SideBySide:
    """Two coils for currents that enter each at its outer end on layer 1."""
    (first, a), (second, b) = one, other
    displacement = (second.centre.x - first.centre.x, second.centre.y - first.centre.y)
    if a.spirals:
        return spirals_side_by_side(a.spirals, b.spirals, displacement)
    return tracks_side_by_side(a.drawn, b.drawn, displacement)
