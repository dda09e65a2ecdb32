"""Capacitance: the layers' matrix against plates, isolated pairs and finer cells; energy against closed results."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.electromagnetics import capacitance
from sitscad.kernels.electromagnetics.capacitance import (
    Slab,
    coplanar_strips,
    stacked_strips,
    strip_layers,
    turn_capacitance,
    winding_capacitance,
    winding_voltages,
)
from sitscad.kernels.electromagnetics.constants import EPSILON0

UM = 1e-6


def stack(copper, gaps, permittivity=1.0):
    """Copper layers of one thickness with gaps between them, one dielectric (in um)."""
    slabs = [Slab(copper * UM, permittivity, True)]
    for gap in gaps:
        slabs += [Slab(gap * UM, permittivity), Slab(copper * UM, permittivity, True)]
    return slabs


@pytest.fixture
def aligned(monkeypatch):
    """Strips face to face instead of averaged over their shifts, with fine cells."""
    monkeypatch.setattr(capacitance, "OFFSETS", ((0.0, 1.0),))
    monkeypatch.setattr(capacitance, "CELLS", 12)
    monkeypatch.setattr(capacitance, "HARMONICS", 600)


def test_strips_25_um_apart_have_plate_capacitance(aligned):
    result = strip_layers(stack(1, [25]), 99 * UM, 100 * UM, 10e-3)
    assert -result[0, 1] == approx(EPSILON0 / (25 * UM), rel=2e-3)


@pytest.mark.parametrize(("width", "gap"), [(100, 25), (50, 50), (200, 60)])
def test_widely_spaced_strip_pairs_have_isolated_pair_capacitance(width, gap, aligned, monkeypatch):
    monkeypatch.setattr(capacitance, "CELLS", 8)
    monkeypatch.setattr(capacitance, "HARMONICS", 3000)
    # the layered sum against Hammerstad and Jensen's microstrip, both thin and in one dielectric
    pitch = 20 * (width + gap) * UM
    result = strip_layers(stack(0.2, [gap]), width * UM, pitch, 0.1)
    assert -result[0, 1] * pitch == approx(stacked_strips(width * UM, gap * UM, 1.0), rel=0.02)


def test_wide_stacked_strips_match_plate_with_fringe_formula():
    # Maxwell's edge: each side reaches (1 + ln(2 pi w/d)) / (2 pi) distances further (Palmer 1937)
    for ratio in (20.0, 60.0):
        edge = (1.0 + math.log(2.0 * math.pi * ratio / 2.0 + 1.0)) / math.pi
        assert stacked_strips(ratio, 1.0, 1.0) == approx(EPSILON0 * (ratio + edge), rel=0.02)


CHARGES = 24


def strip_charges(potential):
    """Charge by potential of a strip from -1 to 1 whose potential at x of a charge at y is `potential(x, y)` beside
    -ln |x - y|: densities T_n(x) / sqrt(1 - x^2), each of which makes a potential of its own T_n.
    """
    n = np.arange(CHARGES)
    angles = math.pi * (np.arange(4 * CHARGES) + 0.5) / (4 * CHARGES)
    waves, x = np.cos(np.outer(angles, n)), np.cos(angles)
    own = waves * np.where(n == 0, math.pi * math.log(2.0), math.pi / np.maximum(n, 1))
    system = own + potential(x[:, None], x[None, :]) @ waves * math.pi / (4 * CHARGES)
    return math.pi * np.linalg.lstsq(system, np.ones(x.size), rcond=None)[0][0]


@pytest.mark.parametrize("spacing", [0.1, 0.5, 1.0, 4.0])
def test_coplanar_strip_capacitance_matches_charge_solution(spacing):
    # V and -V: a charge at y has its opposite at as much beyond the middle of the gap; q/2 pi eps to 2 V
    charge = strip_charges(lambda x, y: np.log(x + y + 2.0 + 2.0 * spacing))
    assert coplanar_strips(2.0, 2.0 * spacing, 3.0) == approx(3.0 * EPSILON0 * math.pi * charge, rel=1e-5)


@pytest.mark.parametrize("shape", [0.1, 0.3, 1.0, 4.0, 10.0, 20.0, 40.0])
def test_stacked_strip_capacitance_matches_charge_solution(shape):
    # V and -V at twice the height over the plane of symmetry
    height = 2.0 / shape
    charge = strip_charges(lambda x, y: 0.5 * np.log((x - y) ** 2 + (2.0 * height) ** 2))
    assert stacked_strips(2.0, 2.0 * height, 3.0) == approx(3.0 * EPSILON0 * math.pi * charge, rel=1e-4)


def test_distant_strip_grids_have_capacitance_of_receded_sheets():
    # far against the pitch a grid of strips is a sheet set back by (p/2pi) ln 1/sin(pi w / 2p), as wire grids are
    pitch, width, gap = 200.0, 100.0, 800.0
    behind = pitch / (2.0 * math.pi) * math.log(1.0 / math.sin(0.5 * math.pi * width / pitch))
    result = strip_layers(stack(0.2, [gap]), width * UM, pitch * UM, 0.1)
    assert -result[0, 1] == approx(EPSILON0 / ((gap + 2.0 * behind) * UM), rel=5e-3)


@pytest.mark.parametrize(("width", "pitch", "gap", "copper"), [(100, 200, 25, 35), (80, 160, 60, 18), (50, 200, 25, 9)])
def test_default_cells_are_within_3_percent_of_fine_cells(width, pitch, gap, copper, monkeypatch):
    usual = strip_layers(stack(copper, [gap]), width * UM, pitch * UM, 3e-3)[0, 1]
    monkeypatch.setattr(capacitance, "CELLS", 14)
    monkeypatch.setattr(capacitance, "HARMONICS", 600)
    assert usual == approx(strip_layers(stack(copper, [gap]), width * UM, pitch * UM, 3e-3)[0, 1], rel=0.03)


@settings(max_examples=15, deadline=None)
@given(st.floats(40, 150), st.floats(40, 150), st.lists(st.floats(10, 100), min_size=1, max_size=3), st.floats(1, 5))
def test_capacitance_matrix_is_symmetric_and_passive(width, spacing, gaps, permittivity):
    result = strip_layers(stack(18, gaps, permittivity), width * UM, (width + spacing) * UM, 3e-3)
    assert result == approx(result.T, rel=1e-9)
    assert np.linalg.eigvalsh(result).min() > 0.0
    assert np.all(result - np.diag(np.diag(result)) <= 1e-12)
    in_air = strip_layers(stack(18, gaps), width * UM, (width + spacing) * UM, 3e-3)
    assert result == approx(permittivity * in_air, rel=0.3)


def between(value):
    """The matrix of one capacitance per area between two layers."""
    return np.array([[value, -value], [-value, value]])


def test_two_layers_with_linear_voltage_have_third_of_plate_capacitance():
    # FACTS 7: layers joined at the centre, voltage even along the track: C/3
    places = (np.arange(400) + 0.5) / 400
    outer_to_inner = 0.5 * places - 0.5
    voltages = np.stack([outer_to_inner, 0.5 - 0.5 * places])
    assert winding_capacitance(between(1.0), voltages, np.full(400, 1.0 / 400)) == approx(1.0 / 3.0, rel=1e-4)


def test_winding_capacitance_weights_outer_turns_by_area():
    # voltage even in the turns, a hole of 0.3 (FACTS 7): more than a third, because the outside is farther apart
    places = (np.arange(400) + 0.5) / 400
    voltages = np.stack([0.5 * places - 0.5, 0.5 - 0.5 * places])
    radii = 1.0 - 0.7 * places
    result = winding_capacitance(between(1.0), voltages, radii / radii.sum())
    assert result == approx(0.42, abs=0.01)


def test_winding_voltages_are_antisymmetric_with_larger_outer_steps():
    radii = np.linspace(3.4e-3, 1.0e-3, 12)
    result = winding_voltages(radii, [0.0, -60 * UM], [True, False], np.full(12, 30 * UM), np.ones((2, 12)))
    along = np.concatenate([result[0], result[1][::-1]])
    assert np.all(np.diff(along) > 0.0)
    assert along[0] == approx(-along[-1], rel=1e-6)
    steps = np.diff(result[0])
    assert steps[0] > steps[-1] * 1.5


def test_turn_capacitance_of_single_layer_matches_sum_of_pairs():
    # N turns of a length l, each 1/N of the voltage apart from the next: c l (N-1)/N^2
    lengths, shares = np.full(10, 20e-3), np.ones(10)
    voltages = (np.arange(10) + 0.5) / 10.0 - 0.5
    pair = coplanar_strips(100 * UM, 100 * UM, 2.0) + EPSILON0 * 2.0 * 35.0 / 100.0
    result = turn_capacitance(lengths, voltages, shares, 100 * UM, 100 * UM, 35 * UM, 2.0)
    assert result == approx(pair * 20e-3 * 9 * 0.01, rel=1e-9)
    assert turn_capacitance(lengths, voltages, 0.1 * shares, 100 * UM, 100 * UM, 35 * UM, 2.0) == 0.0
