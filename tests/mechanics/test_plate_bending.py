"""A plate on a soft pad that is pressed in its middle, against the beam's and the round plate's own solutions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import bei, beip, ber, berp, kei, keip, ker, kerp
from tolerance import approx

from sitscad.kernels.mechanics import plate_bending
from sitscad.kernels.mechanics.plate_bending import POISSON, plate_deflection, rigidity


def test_plate_rigidity_matches_timoshenko():
    assert rigidity(69e9, 1e-3) == approx(69e9 * 1e-9 / 12.0 / 0.91, rel=1e-12)


@pytest.mark.parametrize("slenderness", [0.7, 1.5, 2.0, 3.0])
def test_narrow_plate_deflection_matches_beam_on_springs(monkeypatch, slenderness):
    """Hetenyi's finite beam with free ends under a load across its middle; Poisson's ratio is nothing to a beam."""
    monkeypatch.setattr(plate_bending, "POISSON", 0.0)
    x = slenderness  # length times the fourth root of k / (4 E I)
    whole = np.sinh(x) + np.sin(x)
    beam = x * ((2.0 + np.cosh(x) + np.cos(x)) / 2.0 - 2.0 * np.cosh(x / 2.0) * np.cos(x / 2.0)) / whole
    (result,) = plate_deflection((59e-3, 3e-3), False, (0.02e-3, 3e-3), np.array([(59e-3 / x) ** 4 / 4.0]))
    assert result == approx(beam, rel=2e-3)


def _round(radius, pressed, length):
    """Middle less rim over the rigid way: Kelvin functions within and beyond the load's edge, the rim free."""
    def shapes(r):  # value, slope, Laplacian, its slope, in units of the length
        x = r / length
        return np.array([[ber(x), bei(x), ker(x), kei(x)], [berp(x), beip(x), kerp(x), keip(x)],
                         [-bei(x), ber(x), -kei(x), ker(x)], [-beip(x), berp(x), -keip(x), kerp(x)]])

    inner, outer = shapes(pressed), shapes(radius)
    rows, right = np.zeros((6, 6)), np.array([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    rows[:4, :2], rows[:4, 2:] = inner[:, :2], -inner
    rows[4, 2:] = outer[2] - (1.0 - POISSON) * length / radius * outer[1]
    rows[5, 2:] = outer[3]
    result = np.linalg.solve(rows, right)
    return (1.0 + result[0] - outer[0] @ result[2:]) * (radius / pressed) ** 2


@pytest.mark.parametrize(("pressed", "length"), [(2e-3, 6e-3), (5e-3, 6e-3), (5e-3, 3e-3), (8e-3, 4e-3)])
def test_round_plate_deflection_matches_kelvin_functions(pressed, length):
    (result,) = plate_deflection((20e-3, 20e-3), True, (2.0 * pressed, 2.0 * pressed), np.array([length**4]))
    assert result == approx(_round(10e-3, pressed, length), rel=3e-3)


def test_uniformly_pressed_plate_is_flat_and_bending_falls_with_rigidity():
    assert plate_deflection((59e-3, 10e-3), False, (80e-3, 20e-3), np.array([1e-9]))[0] == approx(0.0, abs=1e-9)
    bent = plate_deflection((59e-3, 10e-3), False, (10e-3, 10e-3), np.geomspace(1e-10, 1e-5, 12))
    assert (np.diff(bent) < 0.0).all() and bent[-1] < 0.01 < 0.1 < bent[0]
