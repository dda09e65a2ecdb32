"""Polygons at frequency against a grid of cells (`corner_grid`): at their corners, and over a mirror.

The grid knows neither modes nor cuts: current finds its own way round every corner. What it lacks is the thickness, so
copper thinner than the skin depth is taken. Filaments between nodes, which were the reference before, read the rise of
these coils with frequency 5 to 8 % high, for their currents may jump at corners.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
from corner_grid import impedance
from corner_windings import bent, changes_by_mirror
from tolerance import approx
from windings import square

from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.loss import proximity
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack, bent_winding_loss
from sitscad.kernels.electromagnetics.loss.resistance import bend_squares
from sitscad.kernels.electromagnetics.loss.track_modes import suited_modes
from tests.oracles.filament_tracks import track_mutual_inductance
from tests.oracles.losses import inductance_change

UM, MM = 1e-6, 1e-3
COPPER = 58e6
FREQUENCIES = np.array([1e5, 1e7, 2e7])

# turns, half the outer centre line's side, pitch, width, copper (m)
SQUARES = {
    "small": (2, 0.45 * MM, 160 * UM, 100 * UM, 12 * UM),
    "one wide turn": (1, 1.0 * MM, 500 * UM, 450 * UM, 12 * UM),
    "three": (3, 1.0 * MM, 250 * UM, 150 * UM, 18 * UM),
}


def by_modes(name, fine):
    turns, half, pitch, width, copper = SQUARES[name]
    corners = square(turns, half, pitch)
    gap = proximity.least_gap(pitch - width, width, [0.0])
    modes = suited_modes(width, copper, gap, skin_depth(10e6, COPPER), fine)
    track = BentTrack(corners[:-1], corners[1:], np.zeros(len(corners) - 1), width, copper, 0.0)
    return bent_winding_loss([track], COPPER, modes, 8 if fine else 4, 27 if fine else 16)


@lru_cache
def by_cells(name, cells, mirror=None):
    turns, half, pitch, width, copper = SQUARES[name]
    return impedance(square(turns, half, pitch), width, copper, COPPER, FREQUENCIES, *cells, mirror)


def rises(loss):
    return np.array([loss.direct * (loss.resistance_ratio(f) - loss.resistance_ratio(1e5)) for f in FREQUENCIES[1:]])


def assert_near(loss, z, of_r, of_l):
    """Rise of R over that at 100 kHz, in parts of R at each frequency, and change of L in parts of L."""
    assert np.all(np.abs(rises(loss) - (z.real[1:] - z.real[0])) < of_r * z.real[1:])
    inductance = z.imag / (2.0 * math.pi * FREQUENCIES)
    changes = [inductance_change(loss, f) - inductance_change(loss, 1e5) for f in FREQUENCIES[1:]]
    assert changes == approx(inductance[1:] - inductance[0], abs=of_l * inductance[0])


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["small", "one wide turn"])
def test_polygon_impedance_rise_agrees_with_cells(name):
    z = by_cells(name, (5, 5) if name == "small" else (8, 6))
    assert_near(by_modes(name, fine=False), z, 0.015, 2.5e-3)
    assert_near(by_modes(name, fine=True), z, 0.01, 2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", SQUARES)
def test_polygon_impedance_rise_agrees_with_extrapolated_cells(name):
    """Cells that converge: their error falls by more than a half from six cells across to ten."""
    coarse, better = (by_cells(name, cells) for cells in ((6, 6), (10, 10)))
    limit = better + (better - coarse) * 0.5625
    assert (better.real[1:] - better.real[0]) == approx(limit.real[1:] - limit.real[0], rel=0.025)
    assert_near(by_modes(name, fine=False), limit, 0.015, 2.5e-3)
    assert_near(by_modes(name, fine=True), limit, 0.01, 2e-3)
    assert rises(by_modes(name, fine=True)) == approx(limit.real[1:] - limit.real[0], rel=0.035)


def over_mirror(name, mirror):
    """Resistances (ohm) and changes of the inductance (H) over a perfect conductor, as an estimate makes them."""
    turns, half, pitch, width, copper = SQUARES[name]
    track = bent(square(turns, half, pitch), width, copper)
    _, changes = changes_by_mirror("square", track, turns, 2.0 * half + width, pitch, mirror, FREQUENCIES)
    loss = by_modes(name, fine=False)
    alone = loss.direct * loss.resistance_ratios(FREQUENCIES)
    return alone - 2.0 * math.pi * FREQUENCIES * changes.imag, changes.real


# Design, distance of the mirror, and what R (of R) and L (of L in free air) may differ by.
MIRRORS = [("one wide turn", 0.1 * MM, 0.03, 5e-3), ("one wide turn", 0.5 * MM, 0.03, 3e-3),
           ("small", 0.06 * MM, 0.015, 3.5e-3)]


@pytest.mark.parametrize(
    ("name", "mirror", "of_r", "of_l"),
    [MIRRORS[0], *(pytest.param(*row, marks=pytest.mark.slow) for row in MIRRORS[1:]),
     pytest.param("three", 0.1 * MM, 0.03, 3e-3, marks=pytest.mark.slow)],
)
def test_polygon_impedance_over_mirror_agrees_with_cells(name, mirror, of_r, of_l):
    cells = (5, 5) if name == "one wide turn" else (6, 6)
    alone, over = by_cells(name, cells), by_cells(name, cells, mirror)
    r, changes = over_mirror(name, mirror)
    assert np.all(np.abs((r - r[0]) - (over.real - over.real[0]))[:2] < of_r * over.real[:2])
    omega = 2.0 * math.pi * FREQUENCIES
    # at 100 kHz against 100 kHz: what direct current does at corners is in both
    free = alone.imag / omega
    assert changes[:2] == approx(((over.imag - alone.imag) / omega)[:2], abs=of_l * free[0])


def test_cell_corner_resistance_converges_to_formula():
    arms, width, copper = 5e-4, 1e-4, 10e-6
    corners = np.array([(0.0, 0.0), (arms, 0.0), (arms, arms)])
    squares = [
        impedance(corners, width, copper, COPPER, [1.0], n, n)[0].real * COPPER * copper - 2.0 * arms / width
        for n in (3, 6, 9)
    ]
    exact = bend_squares(math.pi / 2)
    errors = np.abs(np.array(squares) - exact)
    assert np.all(errors[1:] < 0.62 * errors[:-1]) and errors[-1] < 0.035


def test_straight_track_of_cells_agrees_with_bar_formula():
    length, width, copper = 1e-3, 1e-4, 18e-6
    z = impedance(np.array([(0.0, 0.0), (length, 0.0)]), width, copper, COPPER, [1e3], 6, 4)[0]
    bar = PolylineTrack(np.array([(0.0, 0.0), (length, 0.0)]), width, copper, 0.0)
    assert z.real == approx(length / (COPPER * width * copper), rel=1e-6)
    assert z.imag / (2e3 * math.pi) == approx(track_mutual_inductance(bar, bar, 12), rel=1e-3)
