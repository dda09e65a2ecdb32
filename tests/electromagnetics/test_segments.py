"""Leads as straight segments: groups of them against whole tracks, and a curve's coupling with them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from neumann import sampled_mutual_inductance
from tolerance import approx

from sitscad.kernels.electromagnetics.inductance.filaments import (
    PolylineTrack,
    curve_segments_mutual,
    grouped_segments_inductance,
    segment_set,
)
from tests.oracles.filament_tracks import track_mutual_inductance

CORNERS = np.array([[0, 0], [8, 0], [8, 3], [1, 3], [1, 6]]) * 1e-3


def track(corners, width=0.2e-3, z=0.0):
    return PolylineTrack(np.asarray(corners, dtype=float), width, 35e-6, z)


def test_group_inductances_add_up_to_whole_track():
    pieces = [segment_set([track(CORNERS[:3])]), segment_set([track(CORNERS[2:])])]
    result = grouped_segments_inductance(pieces, [0, 1])
    assert result[0, 1] == result[1, 0]
    assert result.sum() == approx(track_mutual_inductance(track(CORNERS), track(CORNERS), 1), rel=1e-6)
    assert result.sum() == approx(grouped_segments_inductance(pieces, [0, 0])[0, 0], rel=1e-9)


def test_inclined_track_coupling_agrees_with_neumann_sum():
    """Leads that run off at 45 degrees: every angle but a right one couples, in one plane and above each other."""
    line, other = np.array([[0, 0], [3, 1], [4, 4]]) * 1e-3, np.array([[1, -2], [4, -1.5], [6, 2], [5, 5]]) * 1e-3
    for z in (0.0, -60e-6):
        sets = [segment_set([track(line, 2e-6)]), segment_set([track(other, 2e-6, z)])]
        expected = sampled_mutual_inductance(sampled(line, 0.0), sampled(other, z))
        assert grouped_segments_inductance(sets, [0, 1])[0, 1] == approx(expected, rel=1e-4)


def test_go_and_return_pair_inductance_agrees_with_mean_distances():
    # 30 mm of two 0.2 mm tracks, 60 um apart, currents opposed: mu0 l / pi times ln(g12 / g11), g by rectangles
    there, back = track([[0, 0], [30e-3, 0]]), track([[30e-3, 0], [0, 0]], z=-60e-6)
    result = grouped_segments_inductance([segment_set([there]), segment_set([back])], [0, 0])[0, 0]
    mutual = track_mutual_inductance(there, back, 8)
    expected = track_mutual_inductance(there, there, 8) + track_mutual_inductance(back, back, 8) + 2.0 * mutual
    assert result == approx(expected, rel=0.02)


def curve(count=400):
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    points = np.stack([2e-3 * np.cos(angle) - 4e-3, 2e-3 * np.sin(angle), np.full(count, -50e-6)], axis=1)
    return points, np.stack([-np.sin(angle), np.cos(angle)], axis=1) * (2 * np.pi * 2e-3 / count)


def sampled(line, z, count=400):
    sides = np.diff(line, axis=0)
    place = (np.arange(count) + 0.5) / count
    points = (line[:-1, None, :] + place[:, None] * sides[:, None, :]).reshape(-1, 2)
    elements = np.repeat(sides / count, count, axis=0)
    return np.column_stack([points, np.full(len(points), z)]), elements


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.floats(-1, 9), st.floats(-5, 5)), min_size=2, max_size=5, unique=True))
def test_curve_and_segment_coupling_agrees_with_neumann_sum(corners):
    line = np.array(corners) * 1e-3
    if np.hypot(*np.diff(line, axis=0).T).min() < 1e-4:
        return
    result = curve_segments_mutual(curve(), segment_set([track(line)]), 0.0)
    assert result == approx(sampled_mutual_inductance(curve(), sampled(line, 0.0)), rel=2e-3, abs=1e-12)
