"""The finite plate in its limits: endless, tiny, far away, mirrored, growing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.metal.finite_plate import (
    CoaxialRings,
    FinitePlate,
    magnetic_ratio,
    plate_loss_ratio,
    plate_ratio,
)
from sitscad.kernels.electromagnetics.special_functions import bessel_orders, j0, j1

COIL = CoaxialRings(np.tile(np.linspace(0.9e-3, 1.95e-3, 7), 2), np.repeat([-20e-6, -120e-6], 7), np.ones(14))
ALONE = CoaxialRings(np.array([2e-3]), np.zeros(1), np.ones(1))


def rectangle(x, y, thickness=0.2e-3):
    return FinitePlate((x, y), thickness)


def disc(diameter, thickness=0.2e-3):
    return FinitePlate((diameter, diameter), thickness, is_round=True)


@pytest.mark.parametrize("plate", [rectangle(40e-3, 40e-3), rectangle(0.4, 0.1), disc(40e-3)])
@pytest.mark.parametrize("gap", [0.3e-3, 1e-3, 3e-3])
@pytest.mark.parametrize("floor", [-math.inf, -1e-3])
def test_large_plate_has_ratio_1_to_infinite_plate(plate, gap, floor):
    shares = plate_ratio(plate, COIL, np.array([[0.0, 0.0], [1e-3, 0.5e-3]]), gap, floor)
    assert shares == approx(1.0, abs=4e-3)


@pytest.mark.parametrize("plate", [rectangle(4.5e-3, 4.2e-3), disc(4.5e-3)])
def test_mirrored_positions_have_equal_plate_ratio(plate):
    places = np.array([[1.3e-3, 0.7e-3], [-1.3e-3, 0.7e-3], [1.3e-3, -0.7e-3], [-1.3e-3, -0.7e-3]])
    shares = plate_ratio(plate, COIL, places, 0.8e-3)
    assert shares == approx(shares[0], rel=1e-9)


@pytest.mark.parametrize("floor", [-math.inf, -1e-3])
def test_plate_ratio_is_invariant_to_common_height_offset(floor):
    """Coil, mirror and plate moved up together are what they were."""
    up, place = 5e-3, np.array([[1.3e-3, 0.7e-3]])
    raised = CoaxialRings(COIL.radii, COIL.heights + up, COIL.turns)
    for share in (plate_ratio, plate_loss_ratio, magnetic_ratio):
        for plate in (rectangle(4.5e-3, 3e-3), disc(4.5e-3)):
            result = share(plate, raised, place, 0.8e-3 + up, floor + up)
            assert result == approx(share(plate, COIL, place, 0.8e-3, floor), rel=1e-9)


def test_rotated_rectangle_at_rotated_position_has_equal_ratio():
    item = plate_ratio(rectangle(4.5e-3, 3e-3), COIL, np.array([[1.3e-3, 0.7e-3]]), 0.8e-3)
    other = plate_ratio(rectangle(3e-3, 4.5e-3), COIL, np.array([[0.7e-3, 1.3e-3]]), 0.8e-3)
    assert item == approx(other, rel=1e-9)


@pytest.mark.parametrize("make", [lambda s: rectangle(s, s), lambda s: rectangle(s, 4e-3), disc])
@pytest.mark.parametrize("offset", [0.0, 2.25e-3])
def test_plate_ratio_rises_with_size(make, offset):
    shares = [float(plate_ratio(make(s), COIL, np.array([[offset, 0.0]]), 0.8e-3)[0]) for s in np.arange(1, 16) * 1e-3]
    assert np.all(np.diff(shares) > -1e-4)
    assert 0.0 < shares[0] < 0.25
    assert shares[-1] == approx(1.0 if make(1e-3).size[1] == 1e-3 else 0.93, abs=0.02)


@pytest.mark.parametrize("width", [1.5e-3, 2.5e-3, 4e-3])
@pytest.mark.parametrize("gap", [0.3e-3, 2e-3])
def test_plate_ratio_never_falls_with_thickness(width, gap):
    """10 mm of copper did less than half of what 0.2 mm did: its sheet lay 5 mm away."""
    thicknesses = np.geomspace(0.01e-3, 10e-3, 13)
    shares = [float(plate_ratio(disc(width, t), COIL, np.zeros((1, 2)), gap)[0]) for t in thicknesses]
    assert np.all(np.diff(shares) > -1e-3 * shares[0])
    assert shares[-1] < 1.01


@pytest.mark.parametrize("floor", [-math.inf, -1e-3])
@pytest.mark.parametrize("plate", [rectangle(40e-3, 40e-3), disc(40e-3)])
def test_large_plate_has_loss_ratio_1(plate, floor):
    shares = plate_loss_ratio(plate, COIL, np.array([[0.0, 0.0], [1e-3, 0.5e-3]]), 0.8e-3, floor)
    assert shares == approx(1.0, abs=0.02)


def test_small_plate_has_loss_ratio_above_inductance_ratio():
    for make in (disc, lambda s: rectangle(s, s)):
        plate, place = make(2.5e-3), np.zeros((1, 2))
        assert plate_loss_ratio(plate, COIL, place, 0.3e-3) > 1.5 * plate_ratio(plate, COIL, place, 0.3e-3)


def test_plate_ratio_is_invariant_to_scale_and_turns():
    small = plate_ratio(rectangle(4.5e-3, 4.2e-3), COIL, np.array([[2.25e-3, 0.0]]), 0.8e-3, -1e-3)
    coil = CoaxialRings(COIL.radii * 1e3, COIL.heights * 1e3, COIL.turns * 5.0)
    large = plate_ratio(rectangle(4.5, 4.2, 0.2), coil, np.array([[2.25, 0.0]]), 0.8, -1.0)
    assert large == approx(small, rel=1e-9)


@pytest.mark.parametrize("offset", [0.0, 10e-3])
def test_small_distant_disc_acts_as_dipole(offset):
    # A perfectly conducting disc of radius a across a field B has the moment 8 a^3 B / (3 mu0) (Van Bladel).
    radius, gap = 0.5e-3, 20e-3
    share = plate_ratio(disc(2 * radius, 0.0), ALONE, np.array([[offset, 0.0]]), gap)[0]
    turn = 2 * math.pi * (np.arange(720) + 0.5) / 720
    source = 2e-3 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    along = np.stack([-np.sin(turn), np.cos(turn), 0 * turn], axis=1) * 2e-3 * (2 * math.pi / 720)
    away = np.array([offset, 0.0, gap]) - source
    field = 1e-7 * (np.cross(along, away) / np.linalg.norm(away, axis=1)[:, None] ** 3).sum(axis=0)[2]
    dipole = 8 * radius**3 / (3 * 4e-7 * math.pi) * field**2
    k = (np.arange(4000) + 0.5) * 0.5
    endless = 4e-7 * math.pi**2 * np.sum((2e-3 * j1(k * 2e-3)) ** 2 * np.exp(-2 * k * gap)) * 0.5
    assert share == approx(dipole / endless, rel=0.01)


def test_square_plate_polarizability_matches_published_value():
    # Electric polarizabilities of small holes, the dual of plates: 0.1137 s^3 (McDonald 1985) and d^3 / 12 (Bethe).
    square = plate_ratio(rectangle(1e-3, 1e-3, 0.0), ALONE, np.zeros((1, 2)), 20e-3)
    round_one = plate_ratio(disc(1e-3, 0.0), ALONE, np.zeros((1, 2)), 20e-3)
    assert square / round_one == approx(0.1137 * 12, rel=0.003)


def test_plate_over_half_of_coil_has_ratio_near_one_quarter():
    """The recommended jaw design: the plate between two 4 mm coils. An endless plate would overstate it fourfold."""
    between, over = plate_ratio(rectangle(4.5e-3, 4.2e-3), COIL, np.array([[2.25e-3, 0.0], [0.0, 0.0]]), 1e-3)
    assert 0.25 < between < 0.32
    assert 0.85 < over < 0.93


def test_bessel_functions_obey_their_identities():
    x = np.linspace(1e-3, 90.0, 400)
    orders = bessel_orders(x, 40)
    assert np.abs(orders[0] - j0(x)).max() < 2e-7
    assert np.abs(orders[1] - j1(x)).max() < 2e-7
    low = x < 15
    assert (orders[0] + 2 * orders[2::2].sum(axis=0))[low] == approx(1.0, abs=1e-9)
    spherical = bessel_orders(x, 3, True)
    assert np.abs(spherical[0] - np.sin(x) / x).max() < 1e-12
    assert np.abs(spherical[1] - (np.sin(x) / x**2 - np.cos(x) / x)).max() < 1e-9


@pytest.mark.parametrize("floor", [-math.inf, -1e-3])
def test_large_magnetic_plate_has_ratio_1(floor):
    shares = magnetic_ratio(disc(120e-3), COIL, np.array([[0.0, 0.0], [1e-3, 0.5e-3]]), 1e-3, floor)
    assert shares == approx(1.0, abs=0.01)


def test_plate_ratios_of_small_discs_scale_with_expected_power_of_size():
    """In the share of a small disc the radius stands to the fifth for poles, to the third for currents; in what a disc
    of some thickness leads through itself it stands to the second.
    """
    place = np.zeros((1, 2))
    for make, power, thickness in (
        (magnetic_ratio, 5.0, 1e-14), (plate_ratio, 3.0, 1e-9), (magnetic_ratio, 2.0, 1e-6)
    ):
        item, other = (float(make(disc(d, thickness), ALONE, place, 1e-3)[0]) for d in (0.1e-3, 0.2e-3))
        assert math.log2(other / item) == approx(power, abs=0.1)
    shares = [float(magnetic_ratio(disc(d), COIL, place, 1e-3)[0]) for d in (2e-3, 4e-3, 8e-3, 16e-3, 32e-3)]
    assert np.all(np.diff(shares) > 0.0)


def test_small_thin_magnetic_disc_acts_as_dipole():
    """In an even field along it a thin disc of endless permeability has 16 r^3 / 3 times that field as its moment
    (Landau and Lifshitz, Electrodynamics of Continuous Media, section 4: the flat spheroid's limit).
    """
    gap, off, radius, loop = 1.5e-3, 1.8e-3, 0.1e-3, 2e-3
    angle = 2.0 * math.pi * (np.arange(2000) + 0.5) / 2000
    ring = loop * np.stack([np.cos(angle), np.sin(angle)])
    step = loop * 2.0 * math.pi / 2000 * np.stack([-np.sin(angle), np.cos(angle)])
    away = np.hypot(np.hypot(off - ring[0], ring[1]), gap)
    along = math.fsum(step[1] * gap / away**3) / (4.0 * math.pi)  # Biot and Savart, across the axis, A/m by A
    mirror = np.hypot(np.hypot(loop - ring[0], ring[1]), 2.0 * gap)
    endless = 0.5 * loop * math.fsum(step[1] / mirror)  # Neumann, with the mirror's ring, by mu0
    result = magnetic_ratio(disc(2.0 * radius, 1e-14), ALONE, np.array([[off, 0.0]]), gap)[0]
    assert result == approx(16.0 / 3.0 * radius**3 * along**2 / endless, rel=0.02)


@pytest.mark.parametrize("size", [0.1e-3, 1e-3, 4e-3, 8e-3, 30e-3])
def test_magnetic_ratio_never_falls_with_thickness(size):
    """The edge of a thick one was taken to be inside it: shares of 75,000, or an array of negative size."""
    shares = [
        float(magnetic_ratio(FinitePlate((size, size), t), COIL, np.zeros((1, 2)), 1e-3)[0])
        for t in np.geomspace(1e-6, 0.1, 16)
    ]
    assert np.all(np.diff(shares) > -2e-3) and shares[0] > 0.0 and shares[-1] < 1.0 + 1e-9


def test_magnetic_ratio_is_smooth_at_change_of_basis():
    shares = np.array([float(magnetic_ratio(disc(d), COIL, np.zeros((1, 2)), 1e-3)[0]) for d in (18e-3, 20e-3, 24e-3)])
    slopes = np.diff(np.log(1.0 - shares)) / np.diff(np.log([18.0, 20.0, 24.0]))
    assert slopes == approx(-3.0, abs=0.6)
