"""Arcs of tracks: few points where they are far, against many."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.inductance import arcs
from sitscad.kernels.electromagnetics.inductance.arcs import sum_arcs_with_arcs, sum_arcs_with_sides
from sitscad.kernels.electromagnetics.inductance.track_strands import Pairs, common_height_count, strand_pairs, track
from sitscad.kernels.electromagnetics.special_functions import gauss

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
        result = []
        for x, y, radius, start, way, angle in item.arcs:
            for offset, share in zip(across * item.width / 2, shares / 2, strict=True):
                r, azimuth = radius - way * offset, start + way * angle * (1 + nodes) / 2
                where = np.array([x, y]) + r * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
                forward = way * np.stack([-np.sin(azimuth), np.cos(azimuth)], axis=1)
                result.append((where, r * angle * share * weights[:, None] / 2 * forward))
        return result

    def of_sides(item):
        result = []
        for start, end, before, after in zip(item.starts, item.ends, item.before, item.after, strict=True):
            for offset, share in zip(across * item.width / 2, shares / 2, strict=True):
                p, q = start + offset * before, end + offset * after
                s = (1 + gauss(60)[0][:, None]) / 2
                result.append((p + s * (q - p), share * gauss(60)[1][:, None] / 2 * (q - p)))
        return result

    return of_arcs(one), of_arcs(other), of_sides(other)


def sum_over(pairs, square):
    return math.fsum(
        float(np.sum((dp @ dq.T) / np.sqrt(np.sum((p[:, None] - q) ** 2, axis=2) + square)))
        for (p, dp), (q, dq) in pairs
    )


def every(one, other, arcs_with="arcs"):
    """All pairs of arcs, or of the one's arcs and the other's sides."""
    count = len(other.arcs if arcs_with == "arcs" else other.starts)
    i, j = np.divmod(np.arange(len(one.arcs) * count), count)
    return Pairs(i, j, np.ones((i.size, 1)))


def with_arcs(one, other):
    """The integral over all pairs of pieces with at least one arc, two strands a track."""
    strands = strand_pairs(one, other, 2, common_height_count(one, other, 2))
    total = sum_arcs_with_arcs(one, other, every(one, other), strands)
    both = (one, other), (other, one)
    return total + sum(sum_arcs_with_sides(a, b, every(a, b, "sides"), strands) for a, b in both)


@pytest.mark.parametrize("corners", [4, 6, 8])
def test_coupling_of_far_arcs_and_sides_agrees_with_fine_sum(corners):
    item, other = rounded(corners, 2, 3.0, 0.3, 0.3), rounded(corners, 2, 3.0, 0.3, 0.3, z=0.2, mirror=True)
    strands = strand_pairs(item, other, 2, 1)
    level = replace(strands, heights=np.zeros(1), clearances=(np.zeros(1), np.full(1, 0.05)))
    far = arcs._pairs_by_method(item, other, every(item, other))[0]
    assert 0.5 < np.mean(far) < 1.0
    mine, others, lines = by_many_points(item, other)
    chosen = every(item, other).select(far)
    pairs = [(mine[2 * a + x], others[2 * b + y])
             for a, b in zip(chosen.first, chosen.second, strict=True) for x in (0, 1) for y in (0, 1)]
    # arcs of opposite ways nearly cancel: what is left is small against all pairs of one way
    whole = sum(abs(sum_over([pair], 0.05)) for pair in pairs)
    assert sum_arcs_with_arcs(item, other, chosen, level) == approx(sum_over(pairs, 0.05), abs=1e-6 * whole)
    chosen = every(item, other, "sides")
    half = arcs.arc_half_lengths(item.arcs)[chosen.first]
    chosen = chosen.select(arcs._middle_distances(item, other, chosen) > np.maximum(arcs.FAR * half, 0.5 + half))
    pairs = [(mine[2 * a + x], lines[2 * b + y])
             for a, b in zip(chosen.first, chosen.second, strict=True) for x in (0, 1) for y in (0, 1)]
    assert len(pairs) > 100
    assert sum_arcs_with_sides(item, other, chosen, level) == approx(sum_over(pairs, 0.05), rel=3e-5)


@pytest.mark.parametrize("z", [0.0, 0.08])
@pytest.mark.parametrize("make", [lambda **k: rounded(8, 3, 2.0, 0.2, 0.3, **k), lambda **k: oval(6, **k)])
def test_adaptive_arc_points_agree_with_many_points(make, z, monkeypatch):
    """All pairs by the rules of near ones, with more points."""
    item = make()
    other = make(z=z, mirror=True) if z else item
    usual = with_arcs(item, other)
    for name in ("FAR", "MIDDLING", "APART", "SPACED", "BESIDE"):
        monkeypatch.setattr(arcs, name, math.inf)
    crowded = arcs._points_near_ends
    monkeypatch.setattr(arcs, "_points_near_ends", lambda count: crowded(2 * count))
    assert usual == approx(with_arcs(item, other), rel=3e-6)
