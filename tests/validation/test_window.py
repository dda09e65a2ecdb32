"""Windows in a jaw against slabs of surface currents with a hole, and round holes in plates of finite elements."""

from __future__ import annotations

import math

import numpy as np
import pytest
from box_of_loops import endless_change
from disc_of_elements import disc_change
from pierced_slab import slab_change
from tolerance import approx

from sitscad.estimates.targets.window import ERROR, LOSS_ERROR, opening_with_skin_depth
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.metal.opening import Opening, gained_inductance

RADII = np.linspace(0.78e-3, 1.88e-3, 8)
LAYERS = np.tile(RADII, 2), np.repeat([58e-6, 179e-6], 8)
GAP, SLAB = 0.7e-3, (9e-3, 7e-3)


def rings(radii, heights, place=(0.0, 0.0), corners=48):
    """The rings as polygons of the same area about a place from the window's middle."""
    angle = 2.0 * math.pi * np.arange(corners) / corners
    radii = radii * math.sqrt(2.0 * math.pi / corners / math.sin(2.0 * math.pi / corners))
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return [PolylineTrack(place + r * ways, 80e-6, 35e-6, z) for r, z in zip(radii, heights, strict=True)]


def compared(opening, depth, place, most, edge, roof=None):
    """Missing part of the whole slab's effect: of surface currents, and ours."""
    options = SLAB, depth, opening, place, *LAYERS, GAP, most, edge, roof
    gained = slab_change(*options) - slab_change(*options, is_open=False)
    # the slab reaches a little beyond the coil only: what it takes away whole is nearly what an endless one does
    whole = -slab_change(*options, is_open=False) if roof is None else 1e-9
    room = math.inf if roof is None else GAP + roof
    ours = gained_inductance(Opening(opening, depth), rings(*LAYERS, place), GAP, room)
    return gained / whole, ours / (-endless_change(LAYERS[0], -LAYERS[1], GAP) if roof is None else 1e-9)


def test_window_effect_agrees_with_surface_current_slab():
    reference, ours = compared((3e-3, 3e-3), 1.2e-3, (0.0, 0.0), 2.2e-3, 0.5e-3)
    assert ours == approx(reference, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("opening", "depth", "place", "roof"),
    [
        ((1e-3, 1e-3), 1.3e-3, (1.3e-3, 0.0), None),
        ((3e-3, 1e-3), 1.5e-3, (0.0, 0.0), None),
        ((4e-3, 4e-3), 1.5e-3, (0.0, 0.0), None),
        ((5e-3, 2e-3), 0.2e-3, (1.2e-3, 0.5e-3), None),
        ((6e-3, 5e-3), 1.3e-3, (0.0, 0.0), None),
        ((4e-3, 2e-3), 1.3e-3, (1.0e-3, 0.0), 1.5e-3),
    ],
)
def test_window_effect_agrees_with_slab_for_all_window_sizes(opening, depth, place, roof):
    coarse, _ = compared(opening, depth, place, 1.6e-3, 0.3e-3, roof)
    fine, ours = compared(opening, depth, place, 1.2e-3, 0.2e-3, roof)
    assert coarse == approx(fine, rel=0.04)
    assert ours == approx(fine, rel=0.5 * ERROR)


def in_plate(side, conductivity):
    """Parts of the inductance and of the loss that a square window takes away, by `sitscad` on rings at z = 0."""
    gap, thickness, depth = 0.8e-3, 1.3e-3, skin_depth(5e6, conductivity, 1.0)

    def at(recess):
        opening = opening_with_skin_depth(Opening((side, side), thickness), recess)
        gained = gained_inductance(opening, rings(RADII, 0.0 * RADII), gap + recess)
        return gained, -endless_change(RADII, 0.0 * RADII, gap + recess)

    (less, low), (more, high) = at(0.48 * depth), at(0.52 * depth)
    return 0.5 * (less / low + more / high), (more - less) / (high - low)


@pytest.mark.slow
@pytest.mark.parametrize("diameter", [2e-3, 3e-3, 4e-3, 6e-3])
def test_window_effect_and_loss_agree_with_round_hole_in_steel(diameter):
    """A square of the same area stands for a round hole; of a perfect conductor it gains more by what copper says."""
    steel, copper, side = 1.39e6, 5.8e8, 0.5 * math.sqrt(math.pi) * diameter
    whole, open_ = (disc_change(RADII, 0.8e-3, d, 1.3e-3, steel, is_hole=True) for d in (0.6e-3, diameter))
    sharp = disc_change(RADII, 0.8e-3, diameter, 1.3e-3, copper, is_hole=True)[0]
    missing, lost = 1.0 - open_[0] / whole[0], 1.0 - open_[1] / whole[1]
    perfect = 1.0 + sharp / -endless_change(RADII, 0.0 * RADII, 0.8e-3 + 0.5 * skin_depth(5e6, copper, 1.0))
    squares = in_plate(side, copper)[0] / perfect
    part, loss = in_plate(side, steel)
    assert part == approx(squares * missing, rel=0.5 * ERROR)
    assert abs(loss - lost) < (ERROR + LOSS_ERROR * (1.0 - part)) * part
