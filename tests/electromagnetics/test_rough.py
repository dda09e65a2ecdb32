"""What screening takes for thousands of designs, against what an estimate takes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

from sitscad.basics.record import replace
from sitscad.kernels.electromagnetics.inductance.rings import mean_ring_inductance
from sitscad.kernels.electromagnetics.inductance.spirals import Resolution, SpiralLayer, spiral_inductance_matrix
from sitscad.kernels.electromagnetics.loss.proximity import ROUGH, suited_resolution, winding_cuts, winding_loss
from sitscad.kernels.electromagnetics.metal.current_spectrum import ring_spectrum, spiral_spectrum
from sitscad.kernels.electromagnetics.metal.finite_plate import CoaxialRings, FinitePlate, plate_ratio, sheet_ratios
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.kernels.electromagnetics.metal.near_metal import ROUGH_STEPS, crowding_near_metal

COPPER = 58e6


def winding(layers: int, turns: float, width: float, spacing: float, inner: float) -> tuple[SpiralLayer, ...]:
    """Layers in series, wound in and out by turns, 60 um apart."""
    pitch, angle, result = width + spacing, 0.3, []
    for k in range(layers):
        inward = k % 2 == 0
        angle += 0.0 if inward else 4.0 * math.pi * turns
        sense, outer = 1 if inward else -1, inner + turns * pitch
        result.append(SpiralLayer(outer, pitch, turns, angle, sense, inward, -60e-6 * k, width, 25e-6))
    return tuple(result)


CASES = [(1, 8.0, 100e-6, 100e-6, 0.5e-3), (2, 12.0, 100e-6, 100e-6, 1e-3), (2, 6.25, 150e-6, 90e-6, 0.4e-3),
         (4, 7.75, 80e-6, 80e-6, 0.7e-3), (4, 6.5, 90e-6, 110e-6, 0.5e-3), (6, 10.0, 100e-6, 80e-6, 0.6e-3)]


@pytest.mark.parametrize("case", CASES)
def test_mean_ring_inductance_is_within_1_2_percent_of_spirals(case):
    layers = winding(*case)
    exact = spiral_inductance_matrix(list(layers), Resolution(12, 8, 2)).sum()
    assert abs(mean_ring_inductance(layers) / exact - 1.0) < 0.012


@pytest.mark.parametrize("case", CASES[:5])
def test_single_cut_resistance_ratio_is_within_8_percent(case):
    at = np.array([2e6, 5e6, 9e6])
    item, all_of_them = (winding_loss(winding(*case), COPPER, tolerance) for tolerance in (ROUGH, 0.03))
    assert np.all(np.abs(item.resistance_ratios(at) / all_of_them.resistance_ratios(at) - 1.0) < 0.08)
    assert all_of_them.resistance_ratios(at)[-1] > 1.2


def test_reflected_impedance_of_rings_agrees_with_spirals():
    layers, at = winding(4, 7.75, 80e-6, 80e-6, 0.7e-3), np.array([3e6, 8e6])
    sides = Reflector(0.6e-3, (MetalLayer(COPPER),)), Reflector(0.9e-3, (MetalLayer(1.4e6),))
    rings, spirals = (reflected_inductances(item(layers, 0.6e-3), at, *sides, (0.0,)) for item in
                      (ring_spectrum, spiral_spectrum))
    assert np.all(np.abs(rings / spirals - 1.0) < 2e-3)


@pytest.mark.parametrize("floor", [-math.inf, -0.9e-3])
@pytest.mark.parametrize("is_round", [False, True])
def test_sheet_ratios_are_within_4_percent_of_plate_ratios(floor, is_round):
    radii = np.tile(np.linspace(1.0e-3, 2.0e-3, 8), 2)
    coil = CoaxialRings(radii, np.repeat([-40e-6, -100e-6], 8), np.ones(16))
    plate = FinitePlate((5e-3, 5e-3 if is_round else 4.2e-3), 0.15e-3, is_round)
    places, gaps = np.array([[0.0, 0.0], [1.2e-3, 0.0], [1.2e-3, 0.3e-3]]), np.array([0.5e-3, 0.65e-3, 0.7e-3])
    exact = np.array([plate_ratio(plate, coil, places, gap, floor) for gap in gaps])
    rough = sheet_ratios(plate, coil, places, gaps, floor)
    assert np.all(np.abs(rough / exact - 1.0) < 0.04)
    assert np.all(np.abs((rough[0] / rough[2]) / (exact[0] / exact[2]) - 1.0) < 0.015)


def test_one_mode_subspace_is_accurate_for_metal_at_any_distance():
    layers, at = winding(4, 7.75, 80e-6, 80e-6, 0.7e-3), np.array([2e6, 8e6])
    resolution = suited_resolution(layers, COPPER, ROUGH)
    item = crowding_near_metal(
        winding_cuts(layers, COPPER, resolution), COPPER, resolution.modes, 0.2e-3, steps=ROUGH_STEPS)
    own = replace(item, nearest=None, known={}, changed={})
    target, jaw = Reflector(0.3e-3, (MetalLayer(COPPER),)), Reflector(0.5e-3, (MetalLayer(1.4e6),))
    farther = replace(target, distance=0.9e-3)
    for sides in ((target, jaw), (farther, jaw), (None, jaw), (target, None)):
        assert np.all(np.abs(item.changes(at, *sides) / own.changes(at, *sides) - 1.0) < 0.02)
    assert len(item.known) == 3 < len(own.known)


def test_sheet_ratios_of_many_gaps_equal_single_gap_solution():
    coil = CoaxialRings(np.linspace(1.0e-3, 2.0e-3, 8), np.zeros(8), np.ones(8))
    places, gaps = np.array([[0.0, 0.0], [1.2e-3, 0.3e-3]]), np.array([0.5e-3, 0.8e-3])
    plate = FinitePlate((4e-3, 4e-3), 0.1e-3, is_round=True)
    together = sheet_ratios(plate, coil, places, gaps, -0.9e-3)[0]
    assert together == approx(sheet_ratios(plate, coil, places, gaps[:1], -0.9e-3)[0], rel=1e-9)
