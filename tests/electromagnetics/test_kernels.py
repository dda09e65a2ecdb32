"""Rings, mean distances, filaments and Bessel functions against mpmath and against each other: each trap is a test."""

from __future__ import annotations

import itertools
import math

import mpmath
import numpy as np
import pytest
from bars import bars_exactly
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.filaments import (
    PolylineTrack,
    parallel_filaments,
    via_inductance,
)
from sitscad.kernels.electromagnetics.inductance.mean_distance import log_mean_distance, strand_clearance
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings, j1
from tests.oracles.filament_tracks import track_mutual_inductance


def rings_exactly(r1, r2, z):
    with mpmath.workdps(60):
        r1, r2, z = (mpmath.mpf(x) for x in (r1, r2, z))
        m = 4 * r1 * r2 / ((r1 + r2) ** 2 + z * z)
        k = mpmath.sqrt(m)
        bracket = (2 / k - k) * mpmath.ellipk(m) - 2 / k * mpmath.ellipe(m)
        return 4e-7 * mpmath.pi * mpmath.sqrt(r1 * r2) * bracket


@pytest.mark.parametrize("distance", [1e-9, 1e-6, 1e-3, 0.3, 3.0, 1e3, 1e4, 1e6])
def test_equal_ring_inductance_is_exact_at_all_distances(distance):
    ours = float(coaxial_rings(1.0, 1.0, distance**2))
    assert ours == approx(float(rings_exactly(1.0, 1.0, distance)), rel=2e-14)


def test_unequal_ring_inductance_is_exact_and_symmetric():
    assert float(coaxial_rings(1.0, 3.0, 4.0 + 0.25)) == approx(float(rings_exactly(1.0, 3.0, 0.5)), rel=1e-14)
    assert float(coaxial_rings(3.0, 1.0, 4.25)) == float(coaxial_rings(1.0, 3.0, 4.25))


def test_far_rings_reach_the_dipole_limit():
    """Short of it by 3 (a^2 + b^2) / 2 z^2, the next term of the series."""
    for z, tolerance in ((40.0, 6e-3), (1000.0, 1e-5)):
        short = 1.0 - float(coaxial_rings(1.0, 2.0, 1.0 + z * z)) / (MU0 * math.pi * 4.0 / (2.0 * z**3))
        assert short == approx(1.5 * (1.0 + 4.0) / z**2, rel=tolerance)


def test_self_mean_distance_of_square_and_thin_strip():
    # 0.447049 a for the square (Rosa 1908), exp(-3/2) w for the strip (Maxwell, art. 692)
    assert math.exp(float(log_mean_distance(0.0, 0.0, (2.0, 2.0), (2.0, 2.0)))) == approx(2 * 0.447049, rel=3e-5)
    for thinness in (1e-3, 1e-6, 1e-12):
        gmd = math.exp(float(log_mean_distance(0.0, 0.0, (1.0, 1.0), (thinness, thinness))))
        assert gmd == approx(math.exp(-1.5), rel=4.0 * thinness + 1e-9)


def mean_by_points(d, h, w, t, count=60):
    x, wx = np.polynomial.legendre.leggauss(count)
    z, wz = np.polynomial.legendre.leggauss(12)
    dx = d + 0.5 * (w[0] * x[:, None] - w[1] * x[None, :])
    dz = h + 0.5 * (t[0] * z[:, None] - t[1] * z[None, :])
    logs = 0.5 * np.log(dx[:, :, None, None] ** 2 + dz[None, None] ** 2)
    return np.einsum("i,j,k,l,ijkl->", wx, wx, wz, wz, logs) / 16.0


@pytest.mark.parametrize(
    ("d", "h", "w", "t"),
    [
        (2.0, 0.0, (1.0, 1.0), (0.35, 0.35)),
        (0.0, 0.6, (1.0, 1.0), (0.35, 0.18)),
        (0.3, 0.6, (1.0, 0.4), (0.3, 0.3)),
        (5.0, 0.7, (1.0, 1.0), (0.2, 0.2)),
        (0.5, 0.1, (0.0, 0.0), (0.35, 0.35)),
        (40.0, 2.0, (1.0, 2.0), (0.2, 0.3)),
    ],
)
def test_log_mean_distance_agrees_with_point_sum(d, h, w, t):
    assert float(log_mean_distance(d, h, w, t)) == approx(mean_by_points(d, h, w, t), abs=2e-6)


def test_log_mean_distance_is_smooth_at_series_and_exact_far_away():
    w, t = (1.0, 1.0), (0.3, 0.3)
    across = np.linspace(3.5, 5.0, 301)
    third = np.diff(log_mean_distance(across, 0.0, w, t), 3)
    assert np.max(np.abs(third)) < 1e-6
    far = 1e6
    assert float(log_mean_distance(far, 0.0, w, t)) == approx(math.log(far), abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 5.0), st.floats(0.2, 2.0), st.floats(1e-6, 1e3), st.integers(1, 4))
def test_strand_clearance_preserves_log_mean_distance(across, height, scale, strands):
    d, h, w, t = across * scale, height * scale, (scale, scale), (0.15 * scale, 0.15 * scale)
    extra = float(strand_clearance(np.array(d), h, w, t, strands))
    nodes, weights = np.polynomial.legendre.leggauss(strands)
    gap = d + 0.5 * scale * (nodes[:, None] - nodes[None, :])
    mean = 0.25 * np.sum(weights[:, None] * weights * 0.5 * np.log(gap**2 + h * h + extra))
    assert mean == approx(float(log_mean_distance(d, h, w, t)), abs=1e-9)


def filaments_exactly(length, start, end, rho):
    with mpmath.workdps(50):

        def twice(u):
            u = mpmath.mpf(u)
            return u * mpmath.asinh(u / rho) - mpmath.sqrt(u * u + mpmath.mpf(rho) ** 2)

        return 1e-7 * (twice(end) - twice(start) - twice(mpmath.mpf(end) - length) + twice(mpmath.mpf(start) - length))


@pytest.mark.parametrize(
    ("length", "start", "end", "rho"),
    [
        (1.0, 0.0, 1.0, 1e-6), (1.0, -2.0, -1.0, 1e-9), (1.0, 1.0, 2.0, 1e-9), (1.0, 5.0, 3.0, 0.1),
        (1.0, 0.2, 1.4, 1e3), (1.0, 1e4, 1e4 + 1, 1e-3), (1e-3, 0.0, 2.0, 0.5),
    ],
)
def test_parallel_filament_inductance_is_exact_near_collinear_and_far(length, start, end, rho):
    ours = float(parallel_filaments(*(np.array(x) for x in (length, start, end, rho * rho))))
    assert ours == approx(float(filaments_exactly(length, start, end, rho)), rel=1e-9)


def test_split_straight_track_has_equal_inductance():
    whole = PolylineTrack(np.array([[0.0, 0.0], [5e-3, 0.0]]), 1e-4, 35e-6, 0.0)
    split = PolylineTrack(np.array([[0.0, 0.0], [1.3e-3, 0.0], [3.1e-3, 0.0], [5e-3, 0.0]]), 1e-4, 35e-6, 0.0)
    assert track_mutual_inductance(split, split) == approx(track_mutual_inductance(whole, whole), rel=1e-12)


def test_straight_bar_inductance_agrees_with_rosa():
    length, w, t = 10e-3, 1e-4, 35e-6
    bar = PolylineTrack(np.array([[0.0, 0.0], [length, 0.0]]), w, t, 0.0)
    gmd = math.exp(float(log_mean_distance(0.0, 0.0, (w, w), (t, t))))
    rosa = MU0 / (2 * math.pi) * length * (math.log(2 * length / gmd) - 1 + gmd / length)
    assert track_mutual_inductance(bar, bar) == approx(rosa, rel=2e-4)


def test_via_inductance_agrees_with_tube_formula():
    assert via_inductance(1e-3, 1e-5) == approx(MU0 / (2 * math.pi) * 1e-3 * (math.log(4e-3 / 1e-5) - 1), rel=2e-3)
    assert 0.0 < via_inductance(60e-6, 0.2e-3) < 0.02e-9


def test_bessel_j1_agrees_with_mpmath():
    x = np.concatenate([np.linspace(0, 12, 97), np.geomspace(12, 1e3, 40)])
    exact = np.array([float(mpmath.besselj(1, float(v))) for v in x])
    assert np.max(np.abs(j1(x) - exact)) < 6e-8


def mean_distance_exactly(d, h, w, t):
    """Mean of ln(distance) of two rectangles by the fourth integral of ln|zeta| at their sixteen corners, 80 digits."""
    with mpmath.workdps(80):

        def fourth(z):
            # fourth integral of ln z; polynomials of degree three and less cancel in the sum
            return mpmath.mpf(0) if z == 0 else z**4 / 24 * (mpmath.log(z) - mpmath.mpf(25) / 12)

        half = [mpmath.mpf(x) / 2 for x in (*w, *t)]
        total = mpmath.mpf(0)
        for a, b, c, e in itertools.product((-1, 1), repeat=4):
            z = mpmath.mpc(abs(d + a * half[0] + b * half[1]), h + c * half[2] + e * half[3])
            total += a * b * c * e * mpmath.re(fourth(z) * -1)
        return total / (mpmath.mpf(w[0]) * w[1] * t[0] * t[1])


@pytest.mark.parametrize("thinness", [1.0, 1e-2, 1e-4, 1e-8])
@pytest.mark.parametrize("distance", [1.5, 4.0, 11.0, 13.0, 100.0, 1e4, 1e6])
def test_log_mean_distance_of_far_thin_rectangles_keeps_accuracy(distance, thinness):
    """In double precision the closed form is useless beyond some twelve widths, and earlier for thin strips."""
    w, t = (1.0, 0.7), (thinness, 0.5 * thinness)
    exact = mean_distance_exactly(distance, 0.3, w, t)
    assert float(log_mean_distance(distance, 0.3, w, t)) == approx(float(exact), abs=2e-7)


@pytest.mark.parametrize(
    ("length", "start", "height", "width", "thickness"),
    [
        (1.0, 0.0, 1.0, 0.01, 1e-3),
        (1.0, 0.0, 1e3, 0.01, 1e-3),
        (1.0, 20.0, 0.5, 0.05, 1e-5),
        (1.0, 0.3, 5.0, 1e-4, 1e-8),
    ],
)
def test_inductance_of_far_thin_bars_keeps_accuracy(length, start, height, width, thickness):
    """The sixty-four terms of the bar formula lose all digits in double precision; the tracks' sums must not."""
    item = PolylineTrack(np.array([[0.0, 0.0], [length, 0.0]]), width, thickness, 0.0)
    other = PolylineTrack(np.array([[start, 0.0], [start + length, 0.0]]), width, thickness, height)
    exact = bars_exactly(length, start, height, width, thickness)
    assert track_mutual_inductance(item, other) == approx(exact, rel=2e-6)
