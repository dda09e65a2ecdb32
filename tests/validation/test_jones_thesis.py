"""Jones (thesis, Leeds): the ranges of its lumped 3-D model, its square coil beside its round one, its resonances."""

from __future__ import annotations

import math

import numpy as np
import pytest
from box_of_loops import endless_change
from windings import MM, UM
from wound_boards import of

from sitscad.geometry.shapes import SHAPES
from sitscad.geometry.spiral import SpiralDimensions
from sitscad.physics.constants import MU0
from sitscad.physics.inductance.filaments import PolylineTrack, track_mutual_inductance
from sitscad.physics.metal.finite_plate import CoaxialRings, Plate, plate_share

_TURNS = (7e-3 - 100e-6) / 2 - 200e-6 * (np.arange(12) + 0.5)
BENCH = np.tile(_TURNS, 2), np.repeat([30e-6, -30e-6], 12)
"""Radii and heights (m) of the turns of the bench coil."""

RANGES = {
    (3, 7): (0.112, 0.248, 0.002, 0.077),
    (9, 7): (0.058, 1.212, 0.122, 1.200),
    (15, 7): (0.163, 0.350, 0.334, 2.563),
    (9, 5): (0.031, 1.074, 0.254, 1.147),
    (9, 9): (0.065, 1.226, 0.026, 1.201),
}
"""Ranges (uH) by target length and width (mm), Jones tables 6.3 and 6.4: L1 + L2 and L1 - L2 over dx of +-2 mm, L1 + L2
over dy of +-2 mm and over dz."""

SCAN_GAP, NEAR, FAR = 0.95e-3, 0.2e-3, 1.06e-3
"""The thesis does not say at which gap it scanned: these (m, from the middle of the copper) fit best."""


def changes(size, gap, moves):
    """Change (uH) of both coils, 8 mm apart, for displacements of the target (m): shape (moves, 2)."""
    (radii, heights) = BENCH
    depth = 0.5 / math.sqrt(math.pi * 5e6 * MU0 * 5.8e7)
    plate = Plate(tuple(1e-3 * s - 2 * depth for s in size), 0.2e-3 - 2 * depth)
    offsets = np.array([[side * 4e-3 - x, -y] for x, y in moves for side in (-1, 1)])
    shares = plate_share(plate, CoaxialRings(radii, heights, np.ones_like(radii)), offsets, gap + depth)
    return 1e6 * endless_change(radii, heights, gap + depth) * shares.reshape(-1, 2)


@pytest.mark.parametrize("size", RANGES, ids=str)
def test_the_thesis_ranges(size):
    """Within 3 % where the plate covers coils and the range is large, 15 % for small differences of large numbers.

    The 3 mm plate between the coils lies 6 % low in shear and 13 % in dz.
    """
    dx_normal, dx_shear, dy_normal, dz_normal = RANGES[size]
    shifts = np.linspace(-2e-3, 2e-3, 9)
    along = changes(size, SCAN_GAP, [(s, 0.0) for s in shifts])
    across = changes(size, SCAN_GAP, [(0.0, s) for s in shifts])
    near, far = (changes(size, gap, [(0.0, 0.0)]).sum() for gap in (NEAR, FAR))
    covers = size[0] > 3
    assert np.ptp(along[:, 0] - along[:, 1]) == pytest.approx(dx_shear, rel=0.03 if covers else 0.07)
    assert np.ptp(along.sum(axis=1)) == pytest.approx(dx_normal, abs=0.01)
    assert np.ptp(across.sum(axis=1)) == pytest.approx(dy_normal, abs=0.004)
    assert abs(near - far) == pytest.approx(dz_normal, rel=0.03 if covers else 0.14)


def test_square_bench_coil_has_more_inductance_than_the_round_one():
    # thesis 6.3.2: 12 % more by finite elements with its own square; the sides as this project defines them give 28 %
    path = SHAPES["square"].wind(SpiralDimensions((7 * MM, 7 * MM), 100 * UM, 200 * UM, 12.0), -math.pi / 4)
    corners = np.array([path.start, *(segment.end for segment in path)])
    track = PolylineTrack(corners, 100 * UM, 35 * UM, 0.0)
    assert track_mutual_inductance(track, track) > 1.12 * 0.6498e-6


SEVEN = "{shape: circle, outer_diameter: 7, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}"
MINIATURE = "{shape: circle, outer_diameter: 3.5, turns: 6.5, layers: 2, trace_width: 100 um, trace_spacing: 100 um}"


def test_the_thesis_coils():
    # 6 to 8 pF and 35 to 41 MHz for 7 mm, about 2 pF and 200 MHz for 3.5 mm (their own overlap estimate)
    own, _, resonance = of(SEVEN, "flex-2l-35um")
    assert 6e-12 < own < 8.5e-12
    assert 34e6 < resonance < 41e6
    own, _, resonance = of(MINIATURE, "flex-2l-35um")
    assert own == pytest.approx(2e-12, rel=0.1)
    assert resonance == pytest.approx(200e6, rel=0.05)
