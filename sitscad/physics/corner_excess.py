"""What direct current at a sharp corner has more than current that is even across both sides, alike at every size.

A loop: forwards on the inside of the corner, back on the outside, gone within a width. Its stream function is known
from the conformal map of a bent strip, dz/du = tanh(u/2)^(turn / pi), as the resistance is (`bend_squares`); the tables
are what `python tests/validation/corner_flow.py` finds with it. Lengths are in widths of the track.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.physics.constants import MU0

Array = NDArray[np.float64]

TURNS = np.radians((0.0, 45.0, 60.0, 90.0))
"""Angles by which a track turns at the corners of octagons, hexagons and squares, and none."""

MOMENTS = (0.0, 0.0710, 0.1014, 0.1889)
"""Magnetic moment of the loop over current and width squared, at each of TURNS; within 0.5 %."""

POINTS = (
    ((-0.146, 0.169, 0.389), (0.205, 0.569, 0.215), (0.272, 0.151, 0.338), (0.490, 1.149, 0.058)),
    ((-0.120, 0.155, 0.408), (0.218, 0.550, 0.201), (0.332, 0.164, 0.322), (0.633, 1.026, 0.069)),
    ((-0.212, 0.133, 0.251), (0.155, 0.264, 0.353), (0.504, 0.204, 0.277), (0.752, 0.790, 0.119)),
)
"""Where the moment lies at the turns from the second on: from the centre line's corner along the bisector to the inside
and to either side of it, and the share. What a field has through these eight points is within 6 % of what it has
through the loop, from a third of a width off."""

OWN = np.array([
    (0.001, -0.01075, -0.02033, -0.05558), (0.01, -0.01062, -0.02009, -0.05493), (0.05, -0.01010, -0.01911, -0.05234),
    (0.1, -0.00954, -0.01806, -0.04951), (0.2, -0.00861, -0.01631, -0.04479), (0.35, -0.00754, -0.01429, -0.03932),
    (0.5, -0.00672, -0.01274, -0.03510), (0.7, -0.00587, -0.01114, -0.03075), (1.0, -0.00496, -0.00940, -0.02596),
    (2.0, -0.00328, -0.00623, -0.01719), (3.0, -0.00247, -0.00468, -0.01291),
])  # fmt: skip
"""What the loop makes of the inductance of a corner with long arms, over thickness / width, at the turns from the
second on, in mu0 times the width: its coupling with both arms, twice, and its own. The limit of two meshes; within 1 %.
"""


def moment(turn: float) -> float:
    """Moment of the loop over current and width squared for a turn (rad, either way)."""
    return float(np.interp(abs(turn), TURNS, MOMENTS))


def points(turn: float) -> Array:
    """Its moment's places (8, 3) for a turn (rad): to the inside, along the outgoing side's turn, and the share."""
    nearest = POINTS[int(np.argmin(np.abs(TURNS[1:] - abs(turn))))]
    half = np.array(nearest) * np.array([1.0, 1.0, 0.5])
    return np.concatenate([half, half * np.array([1.0, -1.0, 1.0])])


def own_inductance(turn: float, width: float, thickness: float) -> float:
    """What it makes of the inductance (H, negative) of a corner between long arms; width and thickness in metres."""
    aspect = math.log(thickness / width)
    row = [0.0, *(float(np.interp(aspect, np.log(OWN[:, 0]), column)) for column in OWN.T[1:])]
    return MU0 * width * float(np.interp(abs(turn), TURNS, row))
