"""Difference between direct current at a sharp corner and a uniform, mitred current. It scales with the track width.

The difference is a loop of current: forwards on the inside of the corner, back on the outside, and zero beyond about a
width. Its stream function follows from the conformal map of a bent strip, dz/du = tanh(u/2)^(turn / pi). The resistance
follows from this map, too (`bend_squares`; Hall, Thin Solid Films 1, 1967, has bends by such maps). The tables are
results of `python tests/validation/corner_flow.py`. Lengths are divided by the track width.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0

TURNS = np.radians((0.0, 45.0, 60.0, 90.0))
"""Angles (rad) by which a track turns: 0, then corners of octagons, hexagons and squares. Columns of the tables."""

TIGHT = (0.0, 0.55, 0.7)
"""Bend radii of the centre line, divided by the track width: a sharp corner, then rounded corners.

Rows of the tables.
"""

MOMENTS = ((0.0, 0.0710, 0.1014, 0.1889), (0.0, 0.0688, 0.0931, 0.1435), (0.0, 0.0681, 0.0915, 0.1391))
"""Magnetic moment of a corner's current loop, divided by current and squared width. Rows: `TIGHT`, columns: `TURNS`.

The error is below 0.5 %. Rows for rounded corners, in this table and the next ones, come from `corner_flow.py rounded`,
the limit of two meshes.
"""

SQUARES = ((0.0, -0.0890, -0.1666, -0.4413), (0.0, 0.3729, 0.4800, 0.6799), (0.0, 0.4972, 0.6503, 0.9493))
"""Resistance of a corner in squares, minus the resistance of its straight sides. Rows: `TIGHT`, columns: `TURNS`.

A square is a piece of track as long as it is wide. The row of sharp corners is from `bend_squares`.
"""

ROUNDED = ((1.0, 1.0, 1.0, 1.0), (1.0, 0.943, 0.884, 0.718), (1.0, 0.911, 0.838, 0.657))
"""Inductance of a rounded corner's loop divided by a sharp corner's (`OWN`). Rows: `TIGHT`, columns: `TURNS`."""

INWARDS = ((0.0, 0.0, 0.0, 0.0), (0.0, 0.023, 0.049, 0.152), (0.0, 0.032, 0.068, 0.212))
"""Shift of a rounded corner's loop towards the inside, divided by the width, relative to a sharp corner's loop.

Rows: `TIGHT`, columns: `TURNS`.
"""

POINTS = (
    ((-0.146, 0.169, 0.389), (0.205, 0.569, 0.215), (0.272, 0.151, 0.338), (0.490, 1.149, 0.058)),
    ((-0.120, 0.155, 0.408), (0.218, 0.550, 0.201), (0.332, 0.164, 0.322), (0.633, 1.026, 0.069)),
    ((-0.212, 0.133, 0.251), (0.155, 0.264, 0.353), (0.504, 0.204, 0.277), (0.752, 0.790, 0.119)),
)
"""Points that represent the moment of a corner's loop, for turns of 45, 60 and 90 degrees (rows).

Each entry is (distance along the bisector, distance from the bisector, weight), with distances divided by the width.
The first distance runs from the corner of the centre lines to the inside. Each entry represents two points, one on
either side of the bisector, which share the weight. Accuracy: for a source at least a third of a width away, the flux
of its field through the points is within 6 % of the loop's.
"""

OWN = np.array([
    (0.001, -0.01075, -0.02033, -0.05558), (0.01, -0.01062, -0.02009, -0.05493), (0.05, -0.01010, -0.01911, -0.05234),
    (0.1, -0.00954, -0.01806, -0.04951), (0.2, -0.00861, -0.01631, -0.04479), (0.35, -0.00754, -0.01429, -0.03932),
    (0.5, -0.00672, -0.01274, -0.03510), (0.7, -0.00587, -0.01114, -0.03075), (1.0, -0.00496, -0.00940, -0.02596),
    (2.0, -0.00328, -0.00623, -0.01719), (3.0, -0.00247, -0.00468, -0.01291),
])
"""Inductance of a sharp corner's loop between long arms, divided by mu0 and the width.

Columns: thickness divided by width, then the inductance for turns of 45, 60 and 90 degrees. Each inductance is the
loop's self-inductance plus twice its coupling with both arms. It is the limit of two meshes, within 1 %.
"""


RELAXATION = np.array([
    (0.0, 0.0046, 0.0033, -0.0008, 19.4, 21.4, 4.2), (0.55, 0.0044, 0.0028, -0.0026, 19.4, 23.0, 9.6),
    (0.7, 0.0043, 0.0027, -0.0037, 19.5, 24.0, 10.6), (1.3, 0.0025, 0.0051, 0.0111, 29.3, 21.2, 17.6),
    (1.7, 0.0018, 0.0037, 0.0083, 36.4, 24.0, 19.2), (2.5, 0.0012, 0.0019, 0.0040, 110.0, 50.6, 29.0),
    (4.0, 0.0, 0.0, 0.0, 110.0, 50.6, 29.0),
])
"""Inductance that a bend loses to alternating current, minus the loss that the modes of its sides and arcs describe.

The first column is the bend radius divided by the width. Then follow, for bends of 45, 60 and 90 degrees, the
inductance that is lost at high frequency, divided by mu0 and the width. The last three columns are the normalised
frequencies at which half of it is lost, for these bends. The normalised frequency is mu0 times conductivity, width,
thickness and angular frequency (no unit). Each bend has one relaxation.

The values are fitted to meshes of triangles minus the modes. The copper of the meshes is 0.03 to 0.04 times as thick as
wide. The values hold within 0.0005, or 0.001 for 90 degrees and radius 0.6 (`python
tests/validation/corner_relaxation.py`).
"""

THICKER = np.array([
    (0.027, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), (0.1, 1.09, 1.06, 1.56, 1.14, 1.13, 1.43),
    (0.3, 1.20, 1.06, 3.8, 1.54, 1.60, 2.5), (1.0, 0.0, 0.0, 0.0, 1.54, 1.60, 2.5),
])
"""Factors on the six values of `RELAXATION` for thicker copper. Columns: thickness divided by width, six factors.

For rounded bends, the factors on the lost inductance are limited to 1. The meshes assume a uniform current through the
thickness. Beyond a thickness of 0.3 widths this does not hold, and the lost inductance is unknown. There it is reduced
to zero.
"""


@record(eq=False)
class Loops:
    """Small loops of current in the plane of a track.

    `places` (n, 2; m) are their middles. `moments` (n; m2 per ampere of the track's current) are positive upwards. Each
    moment is distributed over a Gaussian with the standard deviation `spread` (m).
    """

    places: Array
    moments: Array
    spread: float


@lru_cache(maxsize=256)
def corner_moment(turn: float, radius: float = 0.0) -> float:
    """Return the magnetic moment of a corner's loop, divided by current and squared track width (from `MOMENTS`).

    `turn` is in rad, `radius` is divided by the track width.
    """
    return _tight_bend_value(MOMENTS, turn, radius)


@lru_cache(maxsize=256)
def corner_points(turn: float, radius: float = 0.0) -> Array:
    """Return places and weights (8, 3; in track widths) of the eight points that represent a corner's loop (`POINTS`).

    Columns are the distance from the corner of the centre lines to the inside, the distance to the left of this
    direction, and the weight. `turn` is in rad, `radius` is divided by the track width.
    """
    nearest = POINTS[int(np.argmin(np.abs(TURNS[1:] - abs(turn))))]
    half = np.array(nearest) * np.array([1.0, 1.0, 0.5]) + np.array([_tight_bend_value(INWARDS, turn, radius), 0.0,
                                                                     0.0])
    rows = np.concatenate([half, half * np.array([1.0, -1.0, 1.0])])
    rows.setflags(write=False)
    return rows


@lru_cache(maxsize=256)
def own_inductance(turn: float, width: float, thickness: float, radius: float = 0.0) -> float:
    """Return the inductance (H, negative) of a corner's loop between long arms, from the tables `OWN` and `ROUNDED`.

    `turn` is in rad, `width` and `thickness` are in metres, `radius` is divided by the width.
    """
    return MU0 * width * _sharp_corner_inductance(turn, thickness / width) * _tight_bend_value(ROUNDED, turn, radius)


@lru_cache(maxsize=256)
def tight_bend_squares(turn: float, radius: float) -> float:
    """Return the resistance of a tight corner minus the resistance of its straight sides, in squares.

    A square is a piece of track as long as it is wide. `turn` is in rad, `radius` is divided by the width, at most the
    last of `TIGHT`. Source: the table `SQUARES`.
    """
    return _tight_bend_value(SQUARES, turn, radius)


def gentle_bend_squares(turn: float, radius: float) -> float:
    """Return the resistance in squares (pieces as long as wide) of a wider arc between straight sides.

    `turn` is in rad. `radius` is the centre line's radius divided by the width, above the last of `TIGHT`.

    Notes
    -----
    It is the turn divided by ln(outer radius / inner radius) (textbook), plus 0.029 radius^-2.6 for the ends. At the
    ends, the current changes to a profile in proportion to 1 / radius. The second term is fitted here to arcs of 45 to
    90 degrees and 0.7 to 4.5 widths (`corner_flow.py`), within 0.015 squares. For smaller turns the result is up to
    0.08 squares too large.
    """
    return abs(turn) / math.log((radius + 0.5) / (radius - 0.5)) + 0.029 * radius**-2.6


@lru_cache(maxsize=256)
def gentle_bend_inductance(turn: float, width: float, thickness: float, radius: float) -> float:
    """Return the inductance (H) of a wider arc minus its inductance for a 1 / radius current profile everywhere.

    `turn` is in rad, `width` and `thickness` are in metres, `radius` is divided by the width. The result is 0.0086
    (turn / 90 degrees)^2 radius^-2.2 mu0 widths at thickness / width = 0.1, fitted by `corner_flow.py` within 0.002 mu0
    widths.
    """
    profile = _sharp_corner_inductance(math.pi / 2, thickness / width) / _sharp_corner_inductance(math.pi / 2, 0.1)
    return -0.0086 * MU0 * width * profile * (2.0 * turn / math.pi) ** 2 * radius**-2.2


def bend_relaxation(
    turn: float, width: float, thickness: float, radius: float, conductivity: float
) -> tuple[float, float]:
    """Return the inductance (H) that a bend loses to alternating current, and its relaxation time tau (s).

    At the angular frequency w, the inductance falls by the first value times (w tau)^2 / (1 + (w tau)^2). Both values
    come from the table `RELAXATION`. `turn` is in rad, `width` and `thickness` in metres, `radius` divided by the
    width, conductivity in S/m.
    """
    row = [float(np.interp(radius, RELAXATION[:, 0], column)) for column in RELAXATION.T[1:]]
    thicker = [float(np.interp(math.log(thickness / width), np.log(THICKER[:, 0]), column)) for column in THICKER.T[1:]]
    if radius > 0.0:  # only how it fades out was found for sharp corners alone
        thicker[:3] = [min(1.0, factor) for factor in thicker[:3]]
    lost, half = np.array(row[:3]) * thicker[:3], np.array(row[3:]) * thicker[3:]
    scale = MU0 * conductivity * width * thickness
    drop = float(np.interp(abs(turn), TURNS, [0.0, *lost]))
    return MU0 * width * drop, scale / float(np.interp(abs(turn), TURNS[1:], half))


def _sharp_corner_inductance(turn: float, aspect: float) -> float:
    """Return the inductance of a sharp corner's loop (in mu0 widths), for a turn (rad) and an aspect ratio.

    The aspect ratio is thickness divided by width.
    """
    row = [0.0, *(float(np.interp(math.log(aspect), np.log(OWN[:, 0]), column)) for column in OWN.T[1:])]
    return float(np.interp(abs(turn), TURNS, row))


def _tight_bend_value(table: Sequence[Sequence[float]], turn: float, radius: float) -> float:
    """Return the value of a table with rows `TIGHT` and columns `TURNS`, linearly interpolated, in the table's unit.

    `turn` is in rad, `radius` is divided by the track width.
    """
    return float(np.interp(radius, TIGHT, [np.interp(abs(turn), TURNS, row) for row in table]))
