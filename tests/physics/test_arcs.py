"""Arcs of tracks: few points where they are far, against many; layers that are mirror images solved once."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from sitscad.physics.inductance import arcs, sides, tracks
from sitscad.physics.inductance.arcs import pairs_with_arcs
from sitscad.physics.inductance.far_arcs import far_arcs, far_sides
from sitscad.physics.inductance.sides import sides_with_sides
from sitscad.physics.inductance.track_strands import bundle, track
from sitscad.physics.special.legendre import gauss

MM = 1e-3


def rounded(corners, turns, size, pitch, radius, width=0.1, z=0.0, mirror=False):
    """A polygon's spiral with rounded corners, in widths of 100 um as mm; mirrored about y = 0."""
    side = 2 * math.pi / corners
    onwards, places = radius * math.tan(side / 2), []
    for m in range(round(corners * turns) + 1):
        flat = (size - pitch * (m // corners)) / math.cos(side / 2)
        places.append(flat * np.array([math.cos(m * side), math.sin(m * side)]))
    pieces = []
    for k, (here, there) in enumerate(pairwise(places)):
        t = (there - here) / np.hypot(*(there - here))
        start, end = here + (onwards * t if k else 0.0), there - (onwards * t if k < len(places) - 2 else 0.0)
        pieces.append((tuple(start), tuple(end)))
        if k < len(places) - 2:
            centre = end + radius * np.array([-t[1], t[0]])
            pieces.append((tuple(centre), radius, math.atan2(*(end - centre)[::-1]), 1.0, side))
    if mirror:
        pieces = [_mirrored(piece) for piece in pieces]
    return track(pieces, width, 0.02, z)


def _mirrored(piece):
    if len(piece) == 2:
        return tuple((x, -y) for x, y in piece)
    (x, y), radius, start, way, angle = piece
    return (x, -y), radius, -start, -way, angle


def oval(turns, z=0.0, mirror=False):
    """The half circles of a racetrack, one family of ends moved by half a pitch."""
    pieces = []
    for k in range(2 * turns):
        radius, sign = 2.0 - 0.1 * k, 1.0 if k % 2 == 0 else -1.0
        pieces.append(((sign * 1.5, 0.1 * (k % 2)), radius, -sign * math.pi / 2, 1.0, math.pi))
    return track([_mirrored(piece) for piece in pieces] if mirror else pieces, 0.1, 0.02, z)


def by_many_points(one, other, points=16):
    """The integral over all pairs of arcs, and of arcs of the one with sides of the other, by a product rule."""
    nodes, weights = gauss(points)
    across, shares = gauss(2)

    def of_arcs(item):
        found = []
        for x, y, radius, start, way, angle in item.arcs:
            for offset, share in zip(across * item.width / 2, shares / 2, strict=True):
                r, azimuth = radius - way * offset, start + way * angle * (1 + nodes) / 2
                where = np.array([x, y]) + r * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
                forward = way * np.stack([-np.sin(azimuth), np.cos(azimuth)], axis=1)
                found.append((where, r * angle * share * weights[:, None] / 2 * forward))
        return found

    def of_sides(item):
        found = []
        for start, end, before, after in zip(item.starts, item.ends, item.before, item.after, strict=True):
            for offset, share in zip(across * item.width / 2, shares / 2, strict=True):
                p, q = start + offset * before, end + offset * after
                s = (1 + gauss(60)[0][:, None]) / 2
                found.append((p + s * (q - p), share * gauss(60)[1][:, None] / 2 * (q - p)))
        return found

    return of_arcs(one), of_arcs(other), of_sides(other)


def sum_over(pairs, square):
    return math.fsum(
        float(np.sum((dp @ dq.T) / np.sqrt(np.sum((p[:, None] - q) ** 2, axis=2) + square)))
        for (p, dp), (q, dq) in pairs
    )


@pytest.mark.parametrize("corners", [4, 6, 8])
def test_far_arcs_need_few_points(corners):
    one, other = rounded(corners, 2, 3.0, 0.3, 0.3), rounded(corners, 2, 3.0, 0.3, 0.3, z=0.2, mirror=True)
    kinds = arcs._kinds(one, other)[0]
    assert 0.5 < np.mean(kinds) < 1.0
    strands = bundle(one, other, 2, 1)
    mine, others, lines = by_many_points(one, other)
    i, j = np.nonzero(kinds)
    pairs = [(mine[2 * a + x], others[2 * b + y]) for a, b in zip(i, j, strict=True) for x in (0, 1) for y in (0, 1)]
    # arcs of opposite ways nearly cancel: what is left is small against all pairs of one way
    every = sum(abs(sum_over([pair], 0.05)) for pair in pairs)
    assert far_arcs(one, other, strands, 0.01, kinds, 2) == pytest.approx(sum_over(pairs, 0.05), abs=1e-6 * every)
    far = np.zeros((len(one.arcs), len(other.starts)), dtype=bool)
    far[:, : len(far[0]) // 2] = np.hypot(*(one.arcs[:, None, :2] - other.starts[: len(far[0]) // 2]).T).T > 1.0
    i, j = np.nonzero(far)
    pairs = [(mine[2 * a + x], lines[2 * b + y]) for a, b in zip(i, j, strict=True) for x in (0, 1) for y in (0, 1)]
    assert far_sides(one, other, strands, 0.01, far, 2) == pytest.approx(sum_over(pairs, 0.05), rel=3e-5)


@pytest.mark.parametrize("z", [0.0, 0.08])
@pytest.mark.parametrize("make", [lambda **k: rounded(8, 3, 2.0, 0.2, 0.3, **k), lambda **k: oval(6, **k)])
def test_points_that_suit_the_distance_are_what_many_are(make, z, monkeypatch):
    """All pairs by the rules of near ones, with more points."""
    one = make()
    other = make(z=z, mirror=True) if z else one
    usual = pairs_with_arcs(one, other, 2)
    for name in ("FAR", "MIDDLING", "APART", "SPACED", "BESIDE"):
        monkeypatch.setattr(arcs, name, math.inf)
    crowded = arcs._crowded
    monkeypatch.setattr(arcs, "_crowded", lambda count: crowded(2 * count))
    assert usual == pytest.approx(pairs_with_arcs(one, other, 2), rel=3e-6)


def test_layers_that_are_mirror_images_are_solved_once(monkeypatch):
    layers = [rounded(8, 3, 2.0, 0.2, 0.3, z=0.1 * k, mirror=k % 2 == 1) for k in range(4)]
    solved = []
    one_by_one = tracks.tracks_mutual_inductance

    def counted(first, second, strands):
        solved.append((first.z, second.z))
        return one_by_one(first, second, strands)

    matrix = np.array([[one_by_one(a, b) for a in layers] for b in layers])
    monkeypatch.setattr(tracks, "tracks_mutual_inductance", counted)
    # where arcs cross, the points of the first are not those of the second
    assert tracks.track_inductance_matrix(layers) == pytest.approx(matrix, rel=3e-5)
    # each with itself; with the next, the next but one and the one after that
    assert len(solved) == 4


def test_tracks_of_one_outline_that_lie_otherwise_are_told_apart():
    one = rounded(8, 2, 2.0, 0.2, 0.3)
    near, far = (one.shifted(x, 0.0) for x in (5.0, 6.0))
    matrix = tracks.track_inductance_matrix([one, near, far])
    assert matrix[0, 0] == pytest.approx(matrix[2, 2], rel=1e-9)
    assert matrix[0, 1] < 1.2 * matrix[0, 2] < 0.0


def test_far_above_each_other_thick_sides_are_at_one_height(monkeypatch):
    one, other = (replace(rounded(8, 12, 6.0, 0.2, 0.3, z=z), thickness=0.05) for z in (0.0, 0.12))
    found = sides_with_sides(one, other, (2, 2), smooth=True)
    monkeypatch.setattr(sides, "EVEN", math.inf)
    both = sides_with_sides(one, other, (2, 2), smooth=True)
    assert found == pytest.approx(both, rel=1e-6) and found != both
