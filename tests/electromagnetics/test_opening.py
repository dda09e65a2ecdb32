"""Openings in a slab: of what is endlessly wide, thin or small everything, the sheet's and nothing is missing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.kernels.electromagnetics.metal.opening import Opening, gained_inductance
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import polyline_spectrum

GAP, ROOM = 0.7e-3, 2.2e-3
CORNERS = np.array([(-2.0, -0.8), (2.0, -0.8), (2.0, 0.8), (-2.0, 0.8), (-2.0, -0.8)]) * 1e-3
LONG = PolylineTrack(CORNERS, 80e-6, 30e-6, 0.0)


def taken_away(roof: MetalLayer | None) -> float:
    """What the whole slab takes of the coil's inductance (H) under a mirror, by its waves."""
    spectrum, at = polyline_spectrum([LONG], GAP), np.array([1e6])
    above = None if roof is None else Reflector(ROOM - GAP, (roof,))
    floors = Reflector(GAP, (MetalLayer(1e18),)), None
    whole, none = (
        0.0 if above is None and floor is None else reflected_inductances(spectrum, at, above, floor, (0.0,))[0, 0].real
        for floor in floors
    )
    return float(none - whole)


@pytest.mark.parametrize(("roof", "echo"), [(None, 1.0), (MetalLayer(1e18), 1.0), (MetalLayer(0.0, 1e6), -1.0)])
def test_wide_thin_opening_recovers_full_inductance_of_elongated_coil(roof, echo):
    wide = Opening((14e-3, 11e-3), 20e-6)
    gained = gained_inductance(wide, [LONG], GAP, math.inf if roof is None else ROOM, echo)
    assert gained == approx(taken_away(roof), rel=0.03)


def test_opening_gain_falls_with_thickness_and_fifth_power_of_size():
    thin, thick, endless = (gained_inductance(Opening((3e-3, 1e-3), t), [LONG], GAP) for t in (2e-5, 1e-3, 8e-3))
    assert thin > 1.1 * thick > 1.1 * endless
    item, half = (gained_inductance(Opening((s, s), 1e-3), [LONG], GAP) for s in (0.4e-3, 0.2e-3))
    # in the middle a coil's field along the slab is nothing and grows evenly: a hole gains with the fifth power
    assert item / half == approx(32.0, rel=0.2)


def test_opening_rotated_with_its_coil_gives_equal_gain():
    turned = PolylineTrack(LONG.corners[:, ::-1] * [1.0, -1.0] + [1e-3, 0.4e-3], LONG.width, LONG.thickness, LONG.z)
    beside = PolylineTrack(LONG.corners + np.array([-0.4e-3, 1e-3]), LONG.width, LONG.thickness, LONG.z)
    item = gained_inductance(Opening((2e-3, 3e-3), 1e-3), [turned], GAP, ROOM)
    assert item == approx(gained_inductance(Opening((3e-3, 2e-3), 1e-3), [beside], GAP, ROOM), rel=1e-9)
