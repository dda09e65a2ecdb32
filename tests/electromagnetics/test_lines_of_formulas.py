"""Single lines of long formulas, each by an invariant: a sign or constant of them passed all other tests."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.eddy.target import SolvedTarget
from sitscad.kernels.electromagnetics.inductance import tracks
from sitscad.kernels.electromagnetics.loss import bent_tracks, corners, proximity
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack
from sitscad.kernels.electromagnetics.loss.current_modes import mode_system
from sitscad.kernels.electromagnetics.loss.track_modes import Cut, ModeSet, local_points
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector
from sitscad.kernels.electromagnetics.metal.near_metal import crowding_near_metal
from tests.electromagnetics.windings import coil

MM, UM, COPPER = 1e-3, 1e-6, 58e6


@pytest.mark.parametrize("turn", [0.3, 1.2, 2.5])
def test_arc_half_angles_at_cuts_add_up_to_turn(monkeypatch, turn):
    """The rest of a circle is taken from the arc's ends on: with 0.55 of the angle 3 % more were lost, unseen."""
    radius, halves = 1 * MM, []
    whole = bent_tracks._bend_flux

    def seen(cut, half, modes):
        halves.append(half)
        return whole(cut, half, modes)

    monkeypatch.setattr(bent_tracks, "_bend_flux", seen)
    end = radius * np.array([math.sin(turn), 1.0 - math.cos(turn)])
    ways = np.array([(-2 * MM, 0.0), (0.0, 0.0), end, end + 2 * MM * np.array([math.cos(turn), math.sin(turn)])])
    track = BentTrack(ways[:-1], ways[1:], np.array([0.0, turn, 0.0]), 200 * UM, 35 * UM, 0.0)
    bent_tracks.bent_winding_loss([track], COPPER, ModeSet(4, 1, (6, 2)), 2, 10)
    assert 2.0 * np.sum(np.concatenate(halves)) == approx(turn, rel=1e-2)


def test_right_and_left_bends_have_equal_loss():
    """And hardly another share than a gentle one: what the rest of its circle would send through it is taken off."""
    frequencies, result = np.array([1e6, 1e7]), {}
    for radius, side in ((0.4 * MM, 1.0), (0.4 * MM, -1.0), (1.6 * MM, 1.0)):
        ways = np.array([(-2 * MM, 0.0), (0.0, 0.0), (radius, radius), (radius, radius + 2 * MM)]) * (1.0, side)
        track = BentTrack(ways[:-1], ways[1:], np.array([0.0, 0.5 * side * math.pi, 0.0]), 200 * UM, 35 * UM, 0.0)
        loss = bent_tracks.bent_winding_loss([track], COPPER, ModeSet(4, 1, (6, 2)), 2, 10)
        result[radius, side] = loss.resistance_ratios(frequencies) - 1.0
    tight, mirrored, gentle = result.values()
    assert tight == approx(mirrored, rel=1e-6) and tight == approx(gentle, rel=0.02)


def test_bend_inductance_change_equals_energy_of_current_shift():
    """The change is the energy of the current with its shift less that without, the field from outside in both."""
    cut = Cut(np.array([1.0, 1.3]) * MM, np.zeros(2), np.full(2, 200 * UM), np.full(2, 35 * UM), np.full(2, 5 * MM),
              np.array([1e3, 1e3 / 1.3]))
    modes = ModeSet(4, 1, (6, 2))
    place = local_points(modes)[0]
    smooth = 1e-8 * np.stack([1.0 + place, 2.0 - place])
    bare, within = (mode_system(cut, item, COPPER, modes) for item in (np.zeros_like(smooth), smooth))
    outside = within.coupling - bare.coupling
    assert within.shift.any() and outside.any()
    assert within.change - bare.change == approx(2.0 * float(within.shift @ outside), rel=1e-9)


@pytest.mark.parametrize("turn", [0.4, 1.0, 2.0])
def test_mitre_spans_full_width_of_both_sides(turn):
    """What a mitre has of either side's normal is one: at right angles alone a product is as good as a quotient."""
    nodes = np.array([(0.0, 0.0), (1.0, 0.0), (1.0 + math.cos(turn), math.sin(turn))]) * MM
    track = BentTrack(nodes[:-1], nodes[1:], np.zeros(2), 200 * UM, 35 * UM, 0.0)
    starts, ends, before, after, *_ = corners._chord_arrays(track)
    along = (ends - starts) / np.hypot(*(ends - starts).T)[:, None]
    normals = np.column_stack([-along[:, 1], along[:, 0]])
    assert np.sum(normals * before, axis=1) == approx(np.ones(2), rel=1e-9)
    assert np.sum(normals * after, axis=1) == approx(np.ones(2), rel=1e-9)


def test_bend_current_shift_is_excluded_from_crowding_on_request():
    """At low frequencies nothing crowds, and near a magnetic wall what is left is the shift of direct current."""
    layers = tuple(coil(4 * MM, 3, 400 * UM, 100 * UM, [0.0], [35 * UM]))
    resolution = proximity.suited_resolution(layers, COPPER, 0.03)
    cuts = proximity.winding_cuts(layers, COPPER, resolution)
    wall = Reflector(200 * UM, (MetalLayer(1.0, 1000.0),))
    with_bends, without = (
        abs(crowding_near_metal(cuts, COPPER, resolution.modes, 200 * UM, bends).change(10.0, wall, None))
        for bends in (True, False)
    )
    assert with_bends > 1e-12 and without < 1e-3 * with_bends


def test_image_coupling_solution_agrees_with_series():
    """Of the image's combinations the loss turns the phase: with the wrong sign it would give energy."""
    rng = np.random.default_rng(4)
    coils, combinations = 2, 3
    driven = rng.normal(size=(combinations, 1, coils)) + 1j * rng.normal(size=(combinations, 1, coils))
    among = rng.normal(size=(combinations,) * 2) + 1j * rng.normal(size=(combinations,) * 2)
    coupling, bare = rng.normal(size=(combinations,) * 2), np.zeros((1, coils, coils), dtype=complex)
    solved = SimpleNamespace(_change_from_matrices=lambda linked, shape: (bare.copy(), driven, among))
    (result,) = SolvedTarget._changes(solved, (), [coupling], (1, coils), False)
    # summed order by order: the image's answer to its own answer, and so on
    scale = 1e-2 / np.abs(coupling @ among).max()
    (small,) = SolvedTarget._changes(solved, (), [scale * coupling], (1, coils), False)
    way = driven[:, 0]
    series = sum(way.T @ np.linalg.matrix_power(-scale * coupling @ among, k) @ (scale * coupling) @ way
                 for k in range(12))
    assert small == approx(series, rel=1e-9)
    assert np.all(np.isfinite(result))


def test_strand_count_rises_at_width_to_distance_bounds():
    """Each of them is the first width over layer distance that takes so many."""
    for (least, strands), (more, _) in pairwise((*tracks.WIDE, (1e3, 0))):
        item, other = (SimpleNamespace(width=least, z=z) for z in (0.0, 1.0))
        assert tracks._near_strands(item, other, (1, 3), False) == ((strands + 1, 2.0), (strands, -1.0))
        item.width = other.width = least * (1.0 - 1e-9)
        fewer = tracks._near_strands(item, other, (1, 3), False)
        assert fewer[0][0] < strands + 1 <= more
