"""Skin and proximity effect, half-spaces, resistance and capacitance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from half_plane import azimuth_loss
from hypothesis import given, settings
from hypothesis import strategies as st
from reflected import reflected_impedance
from tolerance import approx
from windings import MM, UM, bench, coil, four_layers, miniature

import sitscad.kernels.electromagnetics.loss.proximity as proximity
from sitscad.kernels.electromagnetics.capacitance import coplanar_strips, series_permittivity, stacked_strips
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.inductance.mean_distance import log_mean_distance
from sitscad.kernels.electromagnetics.inductance.rings import radii_at
from sitscad.kernels.electromagnetics.inductance.spirals import spiral_inductance_matrix
from sitscad.kernels.electromagnetics.loss.resistance import lone_track_loss, via_resistance
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet
from sitscad.kernels.electromagnetics.metal.current_spectrum import spiral_spectrum
from sitscad.kernels.electromagnetics.metal.half_spaces import (
    MetalLayer,
    Reflector,
    distance_derivative,
    reflection,
)
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import polyline_spectrum
from sitscad.kernels.electromagnetics.resonator import resonance_frequency
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings
from tests.oracles.losses import inductance_change

COPPER = 58e6


def parallel_resistance(inductance: float, resistance: float, frequency: float) -> float:
    """(omega L)^2 / R (ohm), what the drive sees at resonance (SNOSCY9A 7.3)."""
    return (2.0 * math.pi * frequency * inductance) ** 2 / resistance


def test_resistance_ratio_is_1_at_dc_and_rises_with_frequency():
    loss = proximity.winding_loss(four_layers(), COPPER)
    assert loss.resistance_ratio(0.0) == 1.0
    ratios = [loss.resistance_ratio(f) for f in np.geomspace(1e3, 20e6, 30)]
    assert ratios[0] == approx(1.0, abs=1e-6)
    assert np.all(np.diff(ratios) > 0.0)
    changes = [inductance_change(loss, f) for f in np.geomspace(1e3, 20e6, 30)]
    assert np.all(np.diff(changes) < 0.0)


def test_scaled_loss_scales_resistance_and_inductance_change():
    loss = proximity.winding_loss(miniature(), COPPER)
    double, frequencies = loss.scaled(2.0 * loss.direct), np.geomspace(1e4, 2e7, 5)
    assert double.resistance_ratios(frequencies) == approx(loss.resistance_ratios(frequencies), rel=1e-12)
    assert double.inductance_changes(frequencies) == approx(2.0 * loss.inductance_changes(frequencies), rel=1e-12)
    assert double.direct == 2.0 * loss.direct and double.unresolved == 2.0 * loss.unresolved


@pytest.mark.parametrize("apart", [300 * UM, 600 * UM])
def test_distance_derivative_agrees_with_neumann_difference(apart):
    layers = coil(4 * MM, 6, 100 * UM, 100 * UM, (0.0, -apart), (18 * UM, 18 * UM))
    result = distance_derivative(spiral_spectrum(layers, apart, 0), [layer.z for layer in layers])
    step = 0.02 * apart
    further, nearer = (
        spiral_inductance_matrix([layers[0], replace(layers[1], z=-apart - change)])[0, 1] for change in (step, -step)
    )
    sign = layers[0].circulation * layers[1].circulation
    assert result[0, 1] == approx(sign * (further - nearer) / (2.0 * step), rel=0.01)
    assert result[0, 0] == result[1, 1] == 0.0 and result[1, 0] == result[0, 1]


def test_sectors_cover_full_circle_without_gaps():
    result = proximity.sectors(four_layers(), 12)
    ends = [middle + 0.5 * width for middle, width in result]
    starts = [middle - 0.5 * width for middle, width in result]
    assert starts[1:] == approx(ends[:-1], abs=1e-9)
    assert ends[-1] - starts[0] == approx(2.0 * math.pi, abs=2e-6)  # ends are told apart to 1e-6


def eddy_power_by_cells(layers, radii, across=12, through=3):
    """Loss at low frequency over frequency squared: the rings' own flux on small cells, no modes."""
    radius = np.concatenate(radii)
    owner = np.concatenate([np.full(r.size, i) for i, r in enumerate(radii)])
    w, t = layers[0].width, layers[0].thickness
    x = ((np.arange(across) + 0.5) / across - 0.5) * w
    z = ((np.arange(through) + 0.5) / through - 0.5) * t
    grid_x, grid_z = (g.ravel() for g in np.meshgrid(x, z))
    r = (radius[:, None] + grid_x).ravel()
    h = (np.array([layer.z for layer in layers])[owner][:, None] + grid_z).ravel()
    track = np.repeat(np.arange(radius.size), grid_x.size)
    dx, dz = np.abs(r[:, None] - r), np.abs(h[:, None] - h)
    table = np.array(
        [
            np.exp(
                2
                * log_mean_distance(
                    np.arange(across) * w / across, k * t / through, (w / across,) * 2, (t / through,) * 2
                )
            )
            for k in range(through)
        ]
    )
    i = np.clip(np.rint(dx / (w / across)).astype(int), 0, across - 1)
    k = np.clip(np.rint(dz / (t / through)).astype(int), 0, through - 1)
    squared = np.where(track[:, None] == track, table[k, i], dx**2 + dz**2)
    flux = (coaxial_rings(r[:, None], r, squared).sum(axis=1) / grid_x.size).reshape(radius.size, -1)
    spread = (flux - flux.mean(axis=1)[:, None]) ** 2 / (2 * math.pi * radius[:, None])
    return COPPER * w * t * spread.mean(axis=1).sum()


def test_low_frequency_loss_agrees_with_small_cells(monkeypatch):
    layers = coil(4e-3, 6.25, 100 * UM, 100 * UM, [0, -43 * UM, -130 * UM, -173 * UM], [18 * UM] * 4)
    radii = radii_at(layers, 0.3)
    resolution = proximity.LossResolution(ModeSet(8, 2, (8, 2)), 1, 30)
    monkeypatch.setattr(proximity, "_end_flux", lambda *_: 0.0)
    ours = azimuth_loss(layers, 0.3, 2.0 * math.pi, COPPER, resolution)
    assert ours.strengths.sum() == approx(eddy_power_by_cells(layers, radii), rel=0.03)


@pytest.mark.parametrize("tolerance", [0.03, 0.01])
def test_default_loss_resolution_meets_tolerance(tolerance):
    finest = proximity.LossResolution(ModeSet(10, 4, (10, 3)), 16, 36)
    for layers in (four_layers(), miniature(), coil(6 * MM, 1.5, 200 * UM, 100 * UM, (0, -60 * UM), [35 * UM] * 2)):
        ours = proximity.winding_loss(layers, COPPER, tolerance)
        fine = proximity.winding_loss(layers, COPPER, resolution=finest)
        whole = spiral_inductance_matrix(layers).sum()
        for frequency in (1e5, 1e6, 3e6, 10e6):
            assert ours.resistance_ratio(frequency) == approx(fine.resistance_ratio(frequency), rel=tolerance / 3)
            change = inductance_change(fine, frequency)
            assert inductance_change(ours, frequency) == approx(change, abs=tolerance / 30 * whole)


def test_default_modes_resolve_wide_tracks_within_3_percent():
    layers = coil(30 * MM, 4, 900 * UM, 150 * UM, (0.0,), (35 * UM,))
    ours = proximity.winding_loss(layers, COPPER)
    fine = proximity.winding_loss(layers, COPPER, resolution=proximity.LossResolution(ModeSet(24, 4, (24, 3)), 4, 50))
    for frequency in (1e5, 1e6, 5e6, 10e6):
        assert ours.resistance_ratio(frequency) == approx(fine.resistance_ratio(frequency), rel=0.03)


def rp(layers, frequency):
    loss = proximity.winding_loss(layers, COPPER)
    inductance = spiral_inductance_matrix(layers).sum() + inductance_change(loss, frequency)
    return parallel_resistance(inductance, loss.direct * loss.resistance_ratio(frequency), frequency)


def test_parallel_resistance_of_miniature_coil_matches_thesis():
    # 0.14 / 0.27 / 0.37 kohm at 5 / 8 / 10 MHz: the project's figures for 3.5 mm, 2 x 6.5 turns
    for frequency, expected in ((5e6, 140.0), (8e6, 270.0), (10e6, 370.0)):
        assert rp(miniature(), frequency) == approx(expected, rel=0.06)


def test_parallel_resistance_of_four_layer_coil_matches_other_solver():
    # 3.5 mm, 8 turns, 75/50 um, 18 um copper, 0/43/130/173 um: 2.7 kohm at 8 MHz by a proximity solve
    layers = coil(3.5e-3, 8, 75 * UM, 50 * UM, [0, -43 * UM, -130 * UM, -173 * UM], [18 * UM] * 4)
    assert rp(layers, 8e6) == approx(2700.0, rel=0.04)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.05e-3, 5e-3), st.floats(0.2e6, 20e6), st.floats(1e5, 6e7), st.floats(10e-6, 1e-3))
def test_conductor_lowers_inductance_and_adds_resistance(gap, frequency, conductivity, thickness):
    spectrum = spiral_spectrum(bench(), gap)
    change, added = reflected_impedance(
        spectrum, frequency, Reflector(gap, (MetalLayer(conductivity, 1.0, thickness),)), None
    )
    assert change < 0.0
    assert added > 0.0


def test_reflection_of_perfect_thin_and_thick_metal_has_known_limits():
    k = np.geomspace(10.0, 1e5, 30)
    assert reflection(k, 5e6, (MetalLayer(1e30),)) == approx(-1.0, rel=1e-6)
    assert np.all(reflection(k, 5e6, (MetalLayer(0.0),)) == 0.0)
    assert reflection(k, 5e6, (MetalLayer(0.0, 1e9),)) == approx(1.0, rel=1e-6)
    plates = (MetalLayer(COPPER, 1.0, 0.1e-3), MetalLayer(0.0, 1.0, 0.3e-3), MetalLayer(1.4e6, 1.02))
    thick = reflection(k, 5e6, (MetalLayer(COPPER, 1.0, 1.0), *plates[1:]))
    assert thick == approx(reflection(k, 5e6, (MetalLayer(COPPER),)), rel=1e-12)
    assert np.all(np.abs(reflection(k, 5e6, plates)) <= 1.0)


def test_two_perfect_plates_lower_inductance_more_than_either_alone():
    spectrum = spiral_spectrum(bench(), 0.5e-3)
    plate = (MetalLayer(1e15),)
    above, below = Reflector(0.5e-3, plate), Reflector(0.6e-3, plate)
    item = reflected_impedance(spectrum, 5e6, above, None)[0]
    other = reflected_impedance(spectrum, 5e6, None, below)[0]
    both = reflected_impedance(spectrum, 5e6, above, below)[0]
    assert both < min(item, other)
    assert -spiral_inductance_matrix(bench()).sum() < both


def test_metal_acts_as_mirror_half_a_skin_depth_deep():
    spectrum = spiral_spectrum(bench(), 1e-3)
    depth = skin_depth(5e6, COPPER)
    real = reflected_impedance(spectrum, 5e6, Reflector(1e-3, (MetalLayer(COPPER),)), None)[0]
    ideal = reflected_impedance(spectrum, 5e6, Reflector(1e-3 + depth / 2, (MetalLayer(1e18),)), None)[0]
    assert real == approx(ideal, rel=3e-4)


@pytest.mark.parametrize(("plate", "expected"), [(MetalLayer(1.389e6, 1.02), 540.0), (MetalLayer(1.25e6, 100.0), 510.0),
                                                 (MetalLayer(COPPER), 730.0)])
def test_parallel_resistance_of_jaw_coil_with_metal_behind_matches_reference(plate, expected):
    # 4 mm, 4 x 6.25 turns at 8 MHz: 1.52 kohm in air; 0.54, 0.51, 0.73 with 304, 17-4 steel, copper 0.5 mm behind
    layers = coil(4e-3, 6.25, 100 * UM, 100 * UM, [0, -68 * UM, -136 * UM, -204 * UM], [18 * UM] * 4)
    f, bottom = 8e6, 213 * UM
    loss = proximity.winding_loss(layers, COPPER)
    change, added = reflected_impedance(spiral_spectrum(layers, 0.5e-3), f, None, Reflector(bottom + 0.5e-3, (plate,)))
    inductance = spiral_inductance_matrix(layers).sum() + inductance_change(loss, f)
    resistance = loss.direct * loss.resistance_ratio(f)
    assert parallel_resistance(inductance, resistance, f) == approx(1520.0, rel=0.03)
    assert parallel_resistance(inductance + change, resistance + added, f) == approx(expected, rel=0.03)


def test_magnetic_steel_keeps_inductance_and_adds_more_loss():
    spectrum = spiral_spectrum(four_layers(), 0.5e-3)
    soft = reflected_impedance(spectrum, 8e6, None, Reflector(0.7e-3, (MetalLayer(1.25e6, 100.0),)))
    plain = reflected_impedance(spectrum, 8e6, None, Reflector(0.7e-3, (MetalLayer(1.389e6, 1.02),)))
    assert abs(soft[0]) < 0.02 * spiral_inductance_matrix(four_layers()).sum()
    assert soft[1] > 2.0 * plain[1]


def test_spiral_and_polyline_spectra_give_equal_reflected_impedance():
    layer = bench()[:1]
    theta = np.linspace(0.0, layer[0].span, 12 * 48 + 1)
    r = layer[0].radius - layer[0].pitch / (2 * math.pi) * theta
    track = PolylineTrack(np.stack([r * np.cos(theta), r * np.sin(theta)], axis=1), 100 * UM, 35 * UM, 0.0)
    plate = Reflector(1e-3, (MetalLayer(COPPER),))
    a = reflected_impedance(spiral_spectrum(layer, 1e-3), 5e6, plate, None)
    b = reflected_impedance(polyline_spectrum([track], 1e-3), 5e6, plate, None)
    assert a == approx(b, rel=5e-3)


def test_ring_over_perfect_plate_agrees_with_image_ring():
    # one narrow turn: the change is minus the mutual inductance of two rings twice the gap apart
    ring = coil(4e-3, 1.0, 10 * UM, 1e-4 * UM, (0.0,), (10 * UM,))
    gap = 0.7e-3
    change, _ = reflected_impedance(spiral_spectrum(ring, gap), 5e6, Reflector(gap, (MetalLayer(1e18),)), None)
    assert change == approx(-float(coaxial_rings(1.995e-3, 1.995e-3, (2 * gap) ** 2)), rel=1e-2)


def test_closed_capacitance_formulas_have_known_values():
    # PHYSICS 6: 44 pF/m x eps_r for 100 um tracks through 25 um; edges on both sides make it 48
    assert 44e-12 < stacked_strips(100 * UM, 25 * UM, 1.0) < 49e-12
    assert series_permittivity([10.0, 10.0], [2.0, 2.0]) == 2.0
    wide, narrow = coplanar_strips(1.0, 0.1, 1.0), coplanar_strips(0.1, 1.0, 1.0)
    assert wide > narrow > 0.0
    # equal K and K' at k = 1/sqrt 2
    k = math.sqrt(0.5)
    assert coplanar_strips((1 - k) / (2 * k), 1.0, 1.0) == approx(8.8541878128e-12, rel=1e-9)


def test_resonance_frequency_matches_data_sheet_example():
    # SNOSCY9A 8.2: 43.9 uH with 100 pF runs at 2.4 MHz
    assert resonance_frequency(43.9e-6, 100e-12) == approx(2.4e6, rel=5e-3)


def test_skin_depth_and_single_track_loss_have_known_values():
    assert skin_depth(8e6, COPPER) == approx(23.4e-6, rel=2e-3)
    assert lone_track_loss(1e-4, 35e-6, COPPER).resistance_ratio(1e3) == approx(1.0, abs=1e-6)
    # a thin strip between its two limits: uniform current, and current at the surface alone
    most = 1.0 + 3e-4 / skin_depth(10e6, COPPER)
    assert 1.3 < lone_track_loss(3e-4, 35e-6, COPPER).resistance_ratio(10e6) < most
    assert lone_track_loss(3e-4, 35e-6, COPPER).direct == approx(1.0 / (COPPER * 3e-4 * 35e-6), rel=1e-9)


@pytest.mark.parametrize(("drill", "plating"), [(0.2e-3, 20e-6), (0.1e-3, 40e-6), (0.3e-3, 5e-6)])
def test_via_resistance_uses_plated_ring_of_drilled_hole(drill, plating):
    """The drill is the outer diameter; a hole that plating fills is a rod."""
    ring = math.pi / 4.0 * (drill**2 - (drill - 2.0 * plating) ** 2)
    assert via_resistance(60e-6, drill, plating, COPPER) == approx(60e-6 / (COPPER * ring), rel=1e-9)
    rod = 60e-6 / (COPPER * math.pi / 4.0 * drill**2)
    assert via_resistance(60e-6, drill, drill, COPPER) == approx(rod, rel=1e-9)
