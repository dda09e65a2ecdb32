"""Numerical traps that were seen to fail, each against high precision; what is not here stands beside its kernel.

* Coaxial rings near and far: `test_kernels` (equal ones), here unequal ones and the kernel without its logarithm.
* ln(u + sqrt(u^2 + ...)) for negative u, collinear and inclined filaments: `test_kernels`, `test_tracks` (inclined),
  here nearly parallel ones and points on a filament's axis.
* Mean distances of far and thin rectangles: `test_kernels`; here of thin strips with themselves and touching.
* Far and thin bars (Hoer and Love): `test_kernels` for leads; here for tracks of windings.
* Scales: `test_spirals`, `test_tracks`, `test_side_by_side`; here leads, curves and rings.
* Bessel functions upwards through their orders: here.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from bars import bars_exactly
from tolerance import approx
from windings import MM, UM, coil

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.filaments import (
    TOUCHING,
    PolylineTrack,
    curve_segments_mutual,
    grouped_segments_inductance,
    inclined_integral,
    segment_set,
)
from sitscad.kernels.electromagnetics.inductance.mean_distance import log_mean_distance
from sitscad.kernels.electromagnetics.inductance.rings import mean_ring_inductance
from sitscad.kernels.electromagnetics.inductance.track_strands import track
from sitscad.kernels.electromagnetics.inductance.tracks import tracks_mutual_inductance
from sitscad.kernels.electromagnetics.loss.proximity import ring_inductance_without_logarithm
from sitscad.kernels.electromagnetics.metal.current_spectrum import _bessel_slopes
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings
from tests.oracles.filament_tracks import track_mutual_inductance


def rings_exactly(r1, r2, z):
    r1, r2, z = (mpmath.mpf(x) for x in (r1, r2, z))
    m = 4 * r1 * r2 / ((r1 + r2) ** 2 + z * z)
    k = mpmath.sqrt(m)
    return 4e-7 * mpmath.pi * mpmath.sqrt(r1 * r2) * ((2 / k - k) * mpmath.ellipk(m) - 2 / k * mpmath.ellipe(m))


@pytest.mark.parametrize("ratio", [1.0 + 2.0**-30, 1.0 + 2.0**-20, 1.001, 1.9, 1e3, 1e6])
@pytest.mark.parametrize("height", [0.0, 1e-9, 1e-3, 1.0, 1e4, 1e6])
def test_unequal_ring_inductance_is_exact_near_and_far(ratio, height):
    squared = (ratio - 1.0) ** 2 + height**2
    with mpmath.workdps(60):
        exact = float(rings_exactly(1.0, ratio, height))
    assert float(coaxial_rings(1.0, ratio, squared)) == approx(exact, rel=3e-14)


@pytest.mark.parametrize("distance", [1e-9, 1e-6, 1e-3, 0.1])
def test_ring_inductance_without_logarithm_is_exact_at_contact(distance):
    """M + mu0 r ln(d) of two rings that nearly touch: mu0 r (ln 8 - 2) where they do."""
    with mpmath.workdps(60):
        exact = rings_exactly(1.0, 1.0, distance) + 4e-7 * mpmath.pi * mpmath.log(distance)
    ours = float(ring_inductance_without_logarithm(np.array(1.0), np.array(1.0), np.array(distance**2), 1.0))
    assert ours == approx(float(exact), rel=3e-12)  # what is left is a hundredth of either logarithm
    assert ours == approx(MU0 * (math.log(8.0) - 2.0), rel=2.0 * distance)


# Where the point stands along a filament of length 1, and how far off its axis.
BESIDE = [(x, rho) for x in (-1e4, -1.0, -1e-6, 0.5, 1.000001, 2.0, 1e4) for rho in (1e-9, 1e-3, 1.0)]


@pytest.mark.parametrize(("along", "rho"), BESIDE)
def test_segment_potential_near_axis_agrees_with_mpmath(along, rho):
    """ln((r0 + r1 + l) / (r0 + r1 - l)) is 0/0 or ln(1 + tiny) there."""
    with mpmath.workdps(60):
        x, h = mpmath.mpf(along), mpmath.hypot(rho, TOUCHING)  # what touches is kept that far apart
        exact = float(mpmath.asinh(x / h) - mpmath.asinh((x - 1) / h)) * 1e-7
    segments = segment_set([PolylineTrack(np.array([[0.0, 0.0], [1.0, 0.0]]), 1e-4, 1e-5, 0.0)])
    point = np.array([[along, 0.0, rho]]), np.array([[1.0, 0.0]])
    assert curve_segments_mutual(point, segments, 0.0) == approx(exact, rel=1e-10)


def test_segment_potential_on_axis_is_finite_and_exact():
    segments = segment_set([PolylineTrack(np.array([[0.0, 0.0], [1.0, 0.0]]), 1e-4, 1e-5, 0.0)])
    for along, exact in ((3.0, math.log(1.5)), (-1.0, math.log(2.0))):
        point = np.array([[along, 0.0, 0.0]]), np.array([[1.0, 0.0]])
        assert curve_segments_mutual(point, segments, 0.0) == approx(1e-7 * exact, rel=1e-9)


@pytest.mark.parametrize("angle", [1e-2, 1e-4, 1e-6, 1e-7])
@pytest.mark.parametrize("apart", [0.05, 1.0])
def test_nearly_parallel_filament_integral_agrees_with_mpmath(angle, apart):
    """Their lines cross far away: the closed form is a difference of large numbers."""
    crossing = apart / math.sin(angle)
    u0, u1, v0, v1 = crossing, crossing + 1.0, crossing + 0.2, crossing + 1.4
    with mpmath.workdps(40):
        c, s = mpmath.cos(angle), mpmath.sin(angle)

        def inner(u):
            rho = mpmath.sqrt((u * s) ** 2 + mpmath.mpf("1e-4"))
            return mpmath.asinh((v1 - u * c) / rho) - mpmath.asinh((v0 - u * c) / rho)

        exact = float(mpmath.quad(inner, [u0, u0 + 0.2, u1]))
    arrays = (np.array([x]) for x in (u0, u1, v0, v1, math.cos(angle), math.sin(angle)))
    assert float(inclined_integral(*arrays, 1e-4)[0]) == approx(exact, rel=1e-14 / angle + 1e-11)


THINNESS = (1.0, 0.35, 0.1, 1e-2, 9e-3, 1e-4, 1e-8)


@pytest.mark.parametrize("thinness", THINNESS)
def test_log_mean_distance_of_strip_with_itself_matches_rosa(thinness):
    """Rosa's closed form (Bulletin of the Bureau of Standards 4, 1908): useless for thin strips in double precision."""
    with mpmath.workdps(80):
        a, b = mpmath.mpf(1), mpmath.mpf(thinness)
        exact = mpmath.log(a * a + b * b) / 2 - mpmath.mpf(25) / 12
        exact -= ((b / a) ** 2 * mpmath.log(1 + (a / b) ** 2) + (a / b) ** 2 * mpmath.log(1 + (b / a) ** 2)) / 12
        exact += 2 * (b / a * mpmath.atan(a / b) + a / b * mpmath.atan(b / a)) / 3
    ours = float(log_mean_distance(0.0, 0.0, (1.0, 1.0), (thinness, thinness)))
    assert ours == approx(float(exact), abs=1.1e-5 if thinness > 0.4 else 4e-6)


@pytest.mark.parametrize("across", [1.0, 1.0 + 1e-9, 1.2])
@pytest.mark.parametrize("thinness", THINNESS)
def test_log_mean_distance_of_touching_strips_agrees_with_mpmath(across, thinness):
    """By the fourth integral of ln|zeta| at sixteen corners."""
    with mpmath.workdps(80):
        w, t, d = mpmath.mpf(1), mpmath.mpf(thinness), mpmath.mpf(across)

        def fourth(z):
            return mpmath.mpf(0) if z == 0 else z**4 / 24 * (mpmath.log(z) - mpmath.mpf(25) / 12)

        total = mpmath.mpf(0)
        for a, b, c, e in itertools.product((-1, 1), repeat=4):
            x, y = d + (a + b) * w / 2, (c + e) * t / 2
            total -= a * b * c * e * mpmath.re(fourth(mpmath.mpc(x, abs(y))))
        exact = float(total / (w * t) ** 2)
    ours = float(log_mean_distance(across, 0.0, (1.0, 1.0), (thinness, thinness)))
    assert ours == approx(exact, abs=6e-6 if thinness > 0.4 else 1e-6)


@pytest.mark.parametrize(
    ("length", "start", "height", "width", "thickness"),
    [
        (1.0, 0.0, 0.1, 0.01, 1e-3), (1.0, 0.0, 30.0, 0.05, 1e-5), (1.0, 40.0, 0.3, 0.01, 1e-8),
        (1.0, 0.3, 1e3, 1e-4, 1e-8), (1e-3, 0.0, 0.02, 1e-4, 1e-6),
    ],
)
def test_inductance_of_far_thin_tracks_keeps_accuracy(length, start, height, width, thickness):
    item = track([((0.0, 0.0), (length, 0.0))], width, thickness, 0.0)
    other = track([((start, 0.0), (start + length, 0.0))], width, thickness, height)
    exact = bars_exactly(length, start, height, width, thickness)
    assert tracks_mutual_inductance(item, other) == approx(exact, rel=2e-6)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3])
def test_inductances_of_leads_curves_and_rings_scale_with_length(scale):
    corners = np.array([[0, 0], [8, 0], [8, 3], [1, 3]]) * MM

    def leads(by):
        there = PolylineTrack(corners * by, 0.2 * MM * by, 35 * UM * by, 0.0)
        back = replace(there, corners=corners[::-1] * by, z=-60 * UM * by)
        point = np.array([[1.0, 1.0, 0.1], [9.0, 0.0, 0.0]]) * MM * by, np.array([[1.0, 0.5], [-1.0, 0.2]]) * MM * by
        return np.array([
            grouped_segments_inductance([segment_set([there]), segment_set([back])], [0, 0])[0, 0],
            track_mutual_inductance(there, back), curve_segments_mutual(point, segment_set([there]), 20 * UM * by),
            mean_ring_inductance(coil(7 * MM * by, 6, 100 * UM * by, 100 * UM * by, (0.0, -60 * UM * by),
                                      (35 * UM * by,) * 2)),
        ])

    assert leads(scale) == approx(scale * leads(1.0), rel=1e-9)


@pytest.mark.parametrize("x", [1e-3, 0.5, 2.9, 3.1, 9.9, 10.1, 60.0, 2000.0])
def test_bessel_functions_and_derivatives_agree_with_mpmath(x):
    """Upwards the recurrence loses all digits where the order exceeds the argument."""
    values, slopes = _bessel_slopes(np.array([x]), 8)
    for order in range(9):
        exact = float(mpmath.besselj(order, x))
        assert values[order, 0] == approx(exact, abs=2e-7)
        assert slopes[order, 0] == approx(float(mpmath.besselj(order, x, 1)), abs=2e-7)
