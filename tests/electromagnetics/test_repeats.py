"""Pairs of pieces that lie alike: worked out once, and the same as each by itself."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.electromagnetics.inductance import tracks
from sitscad.kernels.electromagnetics.inductance.mean_distance import height_nodes, sufficient_node_counts
from sitscad.kernels.electromagnetics.inductance.track_strands import distinct_pairs, piece_kinds, track
from sitscad.kernels.electromagnetics.inductance.tracks import tracks_mutual_inductance, winding_inductance
from sitscad.kernels.geometry.path import Arc
from sitscad.kernels.geometry.shapes import SHAPES, SpiralDimensions

PITCH, WIDTH, COPPER = 0.2e-3, 0.1e-3, 18e-6


def layers(shape, turns, count, radius=0.0, gap=60e-6, angle=0.0):
    """A coil's layers as layouts wind them, each mirrored to go on where the last one ends."""
    size = (8e-3, 6e-3) if shape in ("rectangle", "racetrack") else (6e-3, 6e-3)
    result = []
    for k in range(count):
        dimensions = SpiralDimensions(size, WIDTH, PITCH, turns)
        path = SHAPES[shape].wind(dimensions, angle + 0.9 * k, -1 if k % 2 else 1, radius)
        result.append(track([_piece(segment) for segment in path], WIDTH, COPPER, -gap * k * (1.0 + 0.3 * (k % 2))))
    return result


def _piece(segment):
    if not isinstance(segment, Arc):
        return tuple(segment.start), tuple(segment.end)
    return tuple(segment.centre), segment.radius, segment.start_angle, 1.0 if segment.ccw else -1.0, abs(segment.sweep)


def one_by_one(stack):
    return math.fsum(tracks_mutual_inductance(a, b) for a in stack for b in stack)


@pytest.mark.parametrize(("shape", "radius"), [
    ("square", 0.0), ("hexagon", 0.0), ("octagon", 0.0), ("octagon", 0.6e-3), ("rectangle", 0.5e-3), ("racetrack", 0.0),
])
def test_winding_inductance_equals_sum_of_layer_pairs(shape, radius, monkeypatch):
    stack = layers(shape, 6.0, 4, radius)
    result = winding_inductance(stack)
    # where arcs cross, the points of the first are not those of the second; what is distant goes by a few heights,
    # 1e-5 at most
    assert result == approx(one_by_one(stack), rel=6e-6)
    monkeypatch.setattr(tracks, "DISTANT", math.inf)
    assert result == approx(winding_inductance(stack), rel=6e-6)


def test_distant_pieces_of_many_layers_are_summed_at_few_heights(monkeypatch):
    request = []
    summed = tracks.distant_sides
    monkeypatch.setattr(tracks, "distant_sides", lambda *a: request.append(a[-1].size) or summed(*a))
    winding_inductance(layers("octagon", 8.0, 8))
    # 36 pairs of layers at 22 distances, each through two thicknesses
    assert len(request) > 1 and max(request) <= 8


def test_concentric_arc_pairs_are_counted_by_rotation():
    eighth = math.pi / 4
    rings = [track([((0.0, 0.0), 0.1 * r, 0.3 + k * eighth, 1.0, eighth) for k in range(8)], 0.05, 0.02, 0.0)
             for r in range(1, 11)]
    _, arcs, turns = piece_kinds(rings)
    pairs = distinct_pairs(arcs, arcs, turns, [[(i, j, 1.0) for i in range(10) for j in range(10)]])
    # two radii in any order, and none to four eighths between them, either way round
    assert len(pairs.first) == 55 * 5
    assert sorted(set(pairs.times[:, 0])) == [8.0, 16.0, 32.0] and pairs.times.sum() == 80 * 80


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-6, 0.3), st.floats(0.0, 2 * math.pi))
def test_displaced_pieces_are_counted_as_different_pairs(moved, angle):
    square = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])

    def kinds_of(corners):
        points = np.array(corners) @ turn
        result = piece_kinds([track(list(pairwise([tuple(p) for p in points])), 0.1, 0.02, 0.0)])
        return len(distinct_pairs(result[0], result[0], result[2], [[(0, 0, 1.0)]]).first)

    closed = [*square, square[0]]
    # the first and the last side have an end, the two between lie alike
    assert kinds_of(closed) == 6
    assert kinds_of([*square[:2], (-1.0 - moved, 1.0), *square[3:], square[0]]) > 6


def test_shifted_equal_tracks_give_different_mutual_inductances():
    item = layers("octagon", 2.0, 1, 0.3e-3)[0]
    shifted = [item, item.shifted(15e-3, 0.0), item.shifted(18e-3, 0.0)]
    assert winding_inductance(shifted) == approx(one_by_one(shifted), rel=1e-6)
    assert 1.05 * tracks_mutual_inductance(*shifted[::2]) > tracks_mutual_inductance(*shifted[:2])


def test_inductance_of_layers_with_different_thickness_equals_pair_sum():
    stack = [replace(layer, thickness=thickness) for layer, thickness in
             zip(layers("hexagon", 5.0, 3, 0.4e-3, 120e-6), (70e-6, 35e-6, 70e-6), strict=True)]
    assert winding_inductance(stack) == approx(one_by_one(stack), rel=2e-6)


@given(st.lists(st.floats(0.0, 0.5), min_size=2, max_size=40, unique=True), st.floats(1.5, 40.0))
@example([0.0, 2.6e-161], 2.0)  # heights that are one height
def test_height_nodes_interpolate_many_heights(heights, apart):
    squares = np.unique(np.square(heights))
    count = int(sufficient_node_counts(squares, np.array([apart]))[0])
    nodes, shares = height_nodes(squares, count)
    assert nodes.size <= squares.size
    exact = 1.0 / np.sqrt(apart**2 + squares)
    assert shares @ (1.0 / np.sqrt(apart**2 + nodes)) == approx(exact, rel=1e-7)


def test_equal_heights_are_reproduced_exactly():
    nodes, shares = height_nodes(np.full(3, 4.0), 1)
    assert list(shares @ nodes) == [4.0, 4.0, 4.0]
