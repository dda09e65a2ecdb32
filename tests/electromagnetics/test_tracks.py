"""Tracks of sides and arcs: filaments against mpmath, and what must not change their inductance."""

from __future__ import annotations

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.electromagnetics.inductance.filaments import inclined_integral
from sitscad.kernels.electromagnetics.inductance.track_strands import track
from sitscad.kernels.electromagnetics.inductance.tracks import tracks_mutual_inductance


def inclined_exactly(u0, u1, v0, v1, angle, square):
    with mpmath.workdps(30):
        u0, u1, v0, v1, square = (mpmath.mpf(x) for x in (u0, u1, v0, v1, square))
        c, s = mpmath.cos(angle), mpmath.sin(angle)

        def inner(u):
            rho = mpmath.sqrt((u * s) ** 2 + square)
            return mpmath.asinh((v1 - u * c) / rho) - mpmath.asinh((v0 - u * c) / rho)

        cuts = sorted({u0, u1, *(x for x in (mpmath.mpf(0), v0 / c, v1 / c, v0 * c, v1 * c) if u0 < x < u1)})
        return float(mpmath.quad(inner, cuts))


@pytest.mark.parametrize(
    ("u0", "u1", "v0", "v1", "angle", "square"),
    [
        (0.0, 1.0, 0.0, 1.0, math.pi / 3, 1e-12),  # meeting at a corner
        (-1.0, 1.0, -1.0, 2.0, math.pi / 4, 1e-4),  # crossing above each other
        (1e-6, 1.0, 1e-6, 1.0, 2 * math.pi / 3, 1e-18),
        (5.0, 6.0, 4.0, 6.0, math.pi / 3, 0.01),
        (0.0, 1.0, 0.0, 1e-4, math.pi / 4, 1e-6),  # aspect ratio 1e4
        (100.0, 101.0, -3.0, -2.0, math.pi / 3, 1.0),
        (1e4, 1e4 + 1, 0.0, 1.0, math.pi / 4, 0.25),
    ],
)
def test_inclined_filament_integral_agrees_with_mpmath(u0, u1, v0, v1, angle, square):
    arrays = (np.array([x]) for x in (u0, u1, v0, v1, math.cos(angle), math.sin(angle)))
    ours = float(inclined_integral(*arrays, square)[0])
    assert ours == approx(inclined_exactly(u0, u1, v0, v1, angle, square), rel=1e-9)


def polygon(corners, turns, size, pitch, width, thickness=35e-6, z=0.0, turn=0.0, mirror=False, at=(0.0, 0.0)):
    count = round(corners * turns)
    points = []
    for m in range(count + 1):
        angle, radius = 2 * math.pi * m / corners + turn, size - pitch * m / corners
        points.append((at[0] + radius * math.cos(angle), at[1] + (-1 if mirror else 1) * radius * math.sin(angle)))
    return track(list(pairwise(points)), width, thickness, z)


def oval(length, radius, width=100e-6, thickness=35e-6, z=0.0):
    half = length / 2
    return track(
        [((half, radius), (-half, radius)), ((-half, 0.0), radius, math.pi / 2, 1.0, math.pi),
         ((-half, -radius), (half, -radius)), ((half, 0.0), radius, -math.pi / 2, 1.0, math.pi * 0.97)],
        width, thickness, z,
    )


turned = st.sampled_from([0.5, 1.0, 2.5])
coils = st.tuples(st.sampled_from([4, 6, 8]), turned, st.floats(0.02, 0.2), st.floats(0.3, 0.8))


def drawn(design, **placed):
    corners, turns, pitch, share = design
    return polygon(corners, turns, 2e-3, 2e-3 * pitch, 2e-3 * pitch * share, **placed)


@settings(max_examples=15, deadline=None)
@given(coils, st.floats(-3.0, 3.0), st.booleans(), st.floats(-0.1, 0.1))
def test_track_inductance_is_invariant_to_rotation_mirror_and_shift(design, turn, mirror, shift):
    plain = drawn(design)
    own = tracks_mutual_inductance(plain, plain)
    moved = drawn(design, turn=turn, mirror=mirror, at=(shift, -shift))
    assert tracks_mutual_inductance(moved, moved) == approx(own, rel=1e-8)


@settings(max_examples=10, deadline=None)
@given(coils, st.floats(-6.0, 3.0))
def test_track_inductance_scales_with_length(design, exponent):
    item = drawn(design)
    large = item.scaled(10.0**exponent)
    expected = 10.0**exponent * tracks_mutual_inductance(item, item)
    assert tracks_mutual_inductance(large, large) == approx(expected, rel=1e-9)


@settings(max_examples=12, deadline=None)
@given(coils, st.floats(20e-6, 1e-3))
def test_track_layers_are_reciprocal_and_passive(design, apart):
    layers = [drawn(design), drawn(design, z=-apart - 35e-6, mirror=True)]
    matrix = np.array([[tracks_mutual_inductance(a, b) for a in layers] for b in layers])
    assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert matrix[1, 0] == approx(matrix[0, 1], rel=1e-6)


@pytest.mark.parametrize("pieces", [2, 3, 7])
def test_split_side_has_equal_inductance(pieces):
    points = np.linspace((0.0, 0.0), (5e-3, 1e-3), pieces + 1)
    whole = track([(tuple(points[0]), tuple(points[-1]))], 100e-6, 35e-6, 0.0)
    split = track([(tuple(a), tuple(b)) for a, b in pairwise(points)], 100e-6, 35e-6, 0.0)
    assert tracks_mutual_inductance(split, split) == approx(tracks_mutual_inductance(whole, whole), rel=2e-5)


def test_split_arc_has_equal_inductance():
    def arcs(count):
        step = 1.9 * math.pi / count
        return track([((0.0, 0.0), 2e-3, k * step, 1.0, step) for k in range(count)], 100e-6, 35e-6, 0.0)

    item = arcs(2)
    for count in (4, 7):
        other = arcs(count)
        assert tracks_mutual_inductance(other, other) == approx(tracks_mutual_inductance(item, item), rel=1e-4)


def test_oval_of_zero_length_agrees_with_ring_formula():
    radius, width, thickness = 5e-3, 20e-6, 20e-6
    ring = 4e-7 * math.pi * radius * (math.log(8 * radius / (0.44705 * width)) - 2)
    coil = track([((0.0, 0.0), radius, 0.0, 1.0, math.pi), ((0.0, 0.0), radius, math.pi, 1.0, math.pi * 0.9999)],
                 width, thickness, 0.0)
    assert tracks_mutual_inductance(coil, coil) == approx(ring, rel=1e-3)


def test_coincident_or_touching_tracks_have_finite_inductance():
    item = oval(3e-3, 1e-3)
    for other in (oval(3e-3, 1e-3, z=-1e-9), oval(3e-3, 1e-3 + 1.0001e-4), oval(3e-3, 1e-3)):
        assert 0.0 < tracks_mutual_inductance(item, other) <= 1.001 * tracks_mutual_inductance(item, item)


def test_far_tracks_reach_the_dipole_limit():
    item = polygon(4, 1.0, 1e-3, 0.0, 20e-6)
    area = 2e-6
    excess = []
    for distance in (0.02, 0.04, 1.0, 10.0):
        mutual = tracks_mutual_inductance(item, item.shifted(distance, 0.0), (1, 1))
        excess.append(mutual / (-1e-7 * area**2 / distance**3) - 1.0)
    assert excess[0] == approx(4.0 * excess[1], rel=0.01) and excess[0] < 5e-3
    assert excess[2:] == approx([0.0, 0.0], abs=1e-4)  # at 10 m the sides cancel to 1e-12 of each


def test_loop_of_extreme_aspect_ratio_has_plausible_inductance():
    for ratio in (1e-4, 1e4):
        x, y = (1e-3, 1e-3 * ratio) if ratio < 1 else (1e-3 * ratio, 1e-3)
        width = min(x, y) / 20
        corners = [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y), (0.0, 2 * width)]
        loop = track(list(pairwise(corners)), width, width / 4, 0.0)
        value = tracks_mutual_inductance(loop, loop)
        assert 0.0 < value < 4e-7 * 2 * (x + y) * math.log(20 * max(x, y) / width)
