"""What direct current does at corners: symmetries, limits, and the field that goes through a corner's loop."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.loss import corners
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack, bent_winding_loss
from sitscad.kernels.electromagnetics.loss.corner_excess import (
    OWN,
    TURNS,
    bend_relaxation,
    corner_moment,
    corner_points,
    own_inductance,
)
from sitscad.kernels.electromagnetics.loss.corners import (
    corner_inductance,
    direct_resistance,
    normal_field,
    with_corners,
    with_mitred_arcs,
)
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.loss.resistance import bend_squares
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet
from sitscad.kernels.geometry.path import Arc, Point, rounded_polyline
from tests.oracles.losses import inductance_change

MM, UM = 1e-3, 1e-6
MU0 = 4e-7 * math.pi
SPIRAL = np.array([(-2, -2), (2, -2), (2, 2), (-2, 2), (-2, -1.6), (1.6, -1.6), (1.6, 1.6)]) * MM


def bent(corners, width=200 * UM, thickness=35 * UM, z=0.0, turns=None):
    corners = np.asarray(corners, dtype=float)
    turns = np.zeros(len(corners) - 1) if turns is None else np.array(turns)
    return BentTrack(corners[:-1], corners[1:], turns, width, thickness, z)


def turned(corners, angle):
    c, s = math.cos(angle), math.sin(angle)
    return corners @ np.array([[c, s], [-s, c]])


def test_corner_inductance_is_invariant_to_reversal_mirror_and_motion():
    plain = corner_inductance([bent(SPIRAL)])
    assert plain < 0.0
    for other in (SPIRAL[::-1], SPIRAL * np.array([1.0, -1.0]), turned(SPIRAL, 0.7), SPIRAL + 0.03):
        assert corner_inductance([bent(other)]) == approx(plain, rel=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1e3, 1e6])
def test_corner_inductance_scales_with_size(scale):
    plain = corner_inductance([bent(SPIRAL), bent(SPIRAL, z=-100 * UM)])
    large = corner_inductance(
        [bent(SPIRAL * scale, 200 * UM * scale, 35 * UM * scale, z) for z in (0, -100 * UM * scale)]
    )
    assert large == approx(scale * plain, rel=1e-9)


def test_corner_inductance_of_single_corner_matches_table():
    for degrees in (45.0, 60.0, 90.0):
        turn = math.radians(degrees)
        arms = np.array([(-1.0, 0.0), (0.0, 0.0), (math.cos(turn), math.sin(turn))])
        result = corner_inductance([bent(arms, 1e-3, 1e-4)])
        assert result == approx(own_inductance(turn, 1e-3, 1e-4), rel=1e-3)
        column = int(np.argmin(np.abs(TURNS[1:] - turn)))
        assert result == approx(MU0 * 1e-3 * OWN[3, 1 + column], rel=1e-3)


def test_straight_tracks_and_arcs_have_no_corner():
    assert corner_inductance([bent([(0.0, 0.0), (1e-3, 0.0), (2e-3, 0.0)])]) == 0.0
    half_turn = bent([(0.0, 0.0), (5e-3, 0.0), (5e-3, 2e-3), (0.0, 2e-3)], turns=[0.0, math.pi, 0.0])
    assert corner_inductance([half_turn]) == 0.0
    loss = ProximityLoss(1.0, np.zeros(1), np.zeros(1))
    length = 10e-3 + math.pi * 1e-3 * 0.1 / math.atanh(0.1)
    assert with_corners(loss, [half_turn], 58e6).direct == approx(length / (58e6 * 200 * UM * 35 * UM), rel=1e-6)


def test_corner_inductance_grows_with_field_of_other_layers():
    # two layers with the same current: more than twice as much, for each is in the other's field; far apart, twice
    item = corner_inductance([bent(SPIRAL)])
    assert corner_inductance([bent(SPIRAL), bent(SPIRAL, z=-80 * UM)]) < 2.2 * item
    assert corner_inductance([bent(SPIRAL), bent(SPIRAL, z=-1.0)]) == approx(2.0 * item, rel=1e-6)
    opposed = [bent(SPIRAL), bent(SPIRAL[::-1], z=-80 * UM)]
    assert corner_inductance(opposed) > 2.0 * item


def test_corner_in_uniform_field_acts_as_magnetic_dipole():
    # a corner far inside a large square frame: twice the moment times the frame's field
    frame = np.array([(-50, -50), (50, -50), (50, 50), (-50, 50), (-50, -49.9)]) * MM
    small = bent(np.array([(-1, 0), (0, 0), (0, 1)]) * MM, 100 * UM)
    with_frame = corner_inductance([small, bent(frame, 100 * UM)])
    alone = corner_inductance([small]) + corner_inductance([bent(frame, 100 * UM)])
    field = 4.0 * MU0 / (4.0 * math.pi) * 2.0 * math.sqrt(0.5) / 50e-3
    seen = 2.0 * corner_moment(math.pi / 2) * (100 * UM) ** 2 * field
    # and the frame's own corners see the small one's arms, which is next to nothing
    assert with_frame - alone == approx(-seen, rel=3e-4)


@pytest.mark.parametrize("turn", [math.pi / 3, math.pi / 2, -2 * math.pi / 3])
def test_bend_of_given_radius_starts_at_tangent_points(turn):
    corner, along = np.array([5.0, 0.0]) * MM, np.array([math.cos(turn), math.sin(turn)])
    starts = np.array([(0.0, 0.0), corner, corner])
    ends = np.array([corner, corner, corner + 5.0 * MM * along])
    track = BentTrack(starts, ends, np.array([0.0, turn, 0.0]), 200 * UM, 35 * UM, 0.0)
    bend = corners._TrackBend(1, turn, 0.5, tuple(corner), True)
    result = corners._with_radius(track, [bend], 1.5)
    cut = 1.5 * 200 * UM * math.tan(0.5 * abs(turn))
    assert result.ends[0] == approx(corner - np.array([cut, 0.0]), rel=1e-9)
    assert result.starts[2] == approx(corner + cut * along, rel=1e-9)
    assert (result.ends[1] == result.starts[2]).all() and (result.starts[1] == result.ends[0]).all()


@pytest.mark.parametrize("turn", [0.2, 0.25 * math.pi, 0.5 * math.pi, 2.2])
def test_bend_resistance_matches_conformal_map(turn):
    """2/pi (psi((1 + a)/2) - psi(1/2)) - tan(pi a/2) by the digamma function's series: -0.441 at a right angle."""
    a, n = turn / math.pi, np.arange(2_000_000)
    rise = math.fsum(0.5 * a / ((n + 0.5) * (n + 0.5 + 0.5 * a))) + 0.5 * a / n.size
    assert bend_squares(turn) == approx(2.0 * rise / math.pi - math.tan(0.5 * turn), abs=2e-5)
    assert bend_squares(-turn) == bend_squares(turn) < 0.0


@pytest.mark.parametrize("alike", [2, 4])
def test_loss_of_congruent_parts_equals_whole_solution(alike):
    """Square rings: opposite sides are images of each other, and so are the halves of a side."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * MM
    rings, modes = [bent(corners, 400 * UM), bent(0.7 * corners, 400 * UM)], ModeSet(6, 1, (4, 2))
    whole, part = (bent_winding_loss(rings, 58e6, modes, 4, 14, repetitions=k) for k in (1, alike))
    assert (part.direct, part.unresolved) == approx((whole.direct, whole.unresolved), rel=1e-6)
    frequencies = np.geomspace(1e5, 2e7, 4)
    assert part.resistance_ratios(frequencies) == approx(whole.resistance_ratios(frequencies), rel=1e-6)
    assert part.inductance_changes(frequencies) == approx(whole.inductance_changes(frequencies), rel=1e-6)


def test_corner_resistance_follows_conformal_map_and_frequency():
    track = bent(SPIRAL)
    squares = np.hypot(*np.diff(SPIRAL, axis=0).T).sum() / (200 * UM) + 5 * bend_squares(math.pi / 2)
    loss = ProximityLoss(squares / (58e6 * 35 * UM) + 0.003, np.array([1e-9]), np.array([1e-20]), -1e-12)
    cornered = with_corners(loss, [track], 58e6)
    assert cornered.direct == approx(squares / (58e6 * 35 * UM), rel=1e-6)
    assert cornered.direct_change == approx(-1e-12 + corner_inductance([track]), rel=1e-6)
    rise = [k.direct * (k.resistance_ratio(1e7) - 1.0) for k in (loss, cornered)]
    lost, time = bend_relaxation(math.pi / 2, 200 * UM, 35 * UM, 0.0, 58e6)
    phase = 2e7 * math.pi * time
    assert rise[1] - rise[0] == approx(5 * lost * 2e7 * math.pi * phase / (1.0 + phase**2), rel=1e-6)
    assert inductance_change(cornered, 1e7) - inductance_change(loss, 1e7) == approx(
        corner_inductance([track]) - 5 * lost * phase**2 / (1.0 + phase**2), rel=1e-6)


def rounded(radius, width=200 * UM):
    """A square of 2 mm with its corners rounded, as pieces of a track, and its length along the centre line."""
    path = rounded_polyline([Point(*(1e-3 * np.array(c))) for c in ((0, 0), (2, 0), (2, 2), (0, 2), (0, 0.5))],
                            [radius] * 5)
    table = np.array([(*s.start, *s.end, s.sweep if isinstance(s, Arc) else 0.0) for s in path])
    return BentTrack(table[:, :2], table[:, 2:4], table[:, 4], width, 35 * UM, 0.0)


def test_corner_resistance_is_continuous_in_radius():
    radii = np.array([0.51, 0.55, 0.6, 0.65, 0.699, 0.701, 0.75, 0.9, 1.2, 1.6, 2.5]) * 200 * UM
    resistances = [direct_resistance(rounded(r), 58e6) for r in radii]
    steps = np.diff(resistances) / resistances[0]
    assert np.all(np.abs(steps) < 0.04) and abs(steps[4]) < 5e-4
    # an arc of quite some radius has the current go as 1 / radius all along it
    wide = rounded(0.7e-3, 100 * UM)
    assert direct_resistance(wide, 58e6) == approx(as_one_over_radius(wide), rel=2e-5)


def as_one_over_radius(track):
    straight = track.turns == 0.0
    length = float(np.hypot(*(track.ends - track.starts)[straight].T).sum())
    for turn, start, end in zip(track.turns[~straight], track.starts[~straight], track.ends[~straight], strict=True):
        radius = math.dist(start, end) / (2.0 * math.sin(0.5 * abs(turn))) / track.width
        length += track.width * abs(turn) / math.log((radius + 0.5) / (radius - 0.5))
    return length / (58e6 * track.width * track.thickness)


def test_tight_arcs_count_as_corners():
    tight, gentle = rounded(0.6 * 200 * UM), rounded(0.8 * 200 * UM)
    corners = with_mitred_arcs(tight)
    assert np.all(corners.turns == 0.0) and len(corners.turns) == 4
    assert corners.ends[:-1] == approx(1e-3 * np.array([(2, 0), (2, 2), (0, 2)]), abs=1e-12)
    assert len(with_mitred_arcs(gentle).turns) == len(gentle.turns) == 7
    assert with_mitred_arcs(gentle).starts == approx(gentle.starts, rel=1e-6)
    sharp = corner_inductance([bent(np.vstack([corners.starts, corners.ends[-1:]]))])
    assert 1.0 * sharp < corner_inductance([tight]) < 0.5 * sharp


def test_filament_field_matches_biot_savart():
    rng = np.random.default_rng(3)
    start, end = rng.normal(size=(20, 2)), rng.normal(size=(20, 2))
    point, height = rng.normal(size=(7, 1, 2)), np.full((7, 1), 0.2)
    result = normal_field(point, height, start, end, np.zeros(20))
    t = np.linspace(0.0, 1.0, 4001)
    middle = 0.5 * (t[1:] + t[:-1])
    place = start[:, None] + middle[:, None] * (end - start)[:, None]
    away = point[:, :, None] - place
    distance = np.sqrt(np.sum(away**2, axis=-1) + 0.04)
    step = (end - start)[:, None] / 4000
    exact = 1e-7 * np.sum((step[..., 0] * away[..., 1] - step[..., 1] * away[..., 0]) / distance**3, axis=-1)
    assert result == approx(exact, rel=1e-5, abs=1e-13)


def test_corner_points_distribute_moment_evenly():
    for turn in TURNS[1:]:
        table = corner_points(float(turn))
        assert table[:, 2].sum() == approx(1.0, abs=2e-3)
        assert table[:, 1] @ table[:, 2] == approx(0.0, abs=1e-12)
    assert corner_moment(-math.pi / 2) == corner_moment(math.pi / 2)
