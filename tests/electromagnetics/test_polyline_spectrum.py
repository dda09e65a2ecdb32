"""The waves of polygons: mitred sides against Neumann's integral with their image, loops against loops of wire."""

from __future__ import annotations

import math

import numpy as np
import pytest
from reflected import reflected_impedance
from tolerance import approx

from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack
from sitscad.kernels.electromagnetics.loss.corner_excess import Loops, corner_moment
from sitscad.kernels.electromagnetics.loss.corners import bend_loops
from sitscad.kernels.electromagnetics.metal import polyline_spectrum as polyline_spectrum_module
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import (
    Rows,
    _Directions,
    _Mitred,
    _rotate_off_normals,
    polyline_spectrum,
    repeating_patterns,
    track_images,
    with_chords,
)
from tests.oracles.filament_tracks import track_mutual_inductance

UM, MM = 1e-6, 1e-3
SQUARE = MM * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -0.7)])
BLUNT = MM * np.array([(-1.0, -1.0), (0.5, -1.2), (1.1, 0.2), (0.2, 1.0), (-1.0, 0.5)])


def over_mirror(tracks, gap, loops=()):
    spectrum = polyline_spectrum(tracks, gap, loops)
    return reflected_impedance(spectrum, 5e6, Reflector(gap, (MetalLayer(1e30),)), None)[0]


@pytest.mark.parametrize("corners", [SQUARE, BLUNT], ids=["square", "blunt"])
@pytest.mark.parametrize(("width", "gap"), [(400 * UM, 0.15 * MM), (400 * UM, 1.0 * MM), (100 * UM, 0.1 * MM)])
def test_spectrum_of_mitred_wide_sides_agrees_with_strands(corners, width, gap):
    """From their centre lines, cut off square, the reflection was up to 1 % off: an outside lacked, an inside was
    double."""
    track = PolylineTrack(corners, width, 1 * UM, 0.0)
    image = PolylineTrack(corners, width, 1 * UM, 2.0 * gap)
    strands = [PolylineTrack(track.strand(0.5 * width * x), 1e-9, 1e-9, 0.0) for x in NODES]
    images = [PolylineTrack(image.strand(0.5 * width * x), 1e-9, 1e-9, 2.0 * gap) for x in NODES]
    exact = -sum(p * q * track_mutual_inductance(a, b, 1) for a, p in zip(strands, SHARES, strict=True)
                 for b, q in zip(images, SHARES, strict=True))
    assert over_mirror([track], gap) == approx(exact, rel=4e-4)


NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
SHARES = 0.5 * _WEIGHTS


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_corner_loop_agrees_with_small_wire_turn(sense):
    """Upwards where the current runs counter-clockwise; it acts on the winding and on itself."""
    side, place, gap = 40 * UM, np.array([0.8 * MM, -0.75 * MM]), 0.2 * MM
    turn = place + 0.5 * side * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
    winding = PolylineTrack(SQUARE, 100 * UM, 12 * UM, 0.0)
    wire = PolylineTrack(turn[:: int(sense)], 1e-9, 12 * UM, 0.0)
    alone = over_mirror([winding], gap)
    by_wire = over_mirror([winding, wire], gap) - alone
    loop = Loops(place[None], np.array([sense * side * side]), 0.0)
    assert over_mirror([winding], gap, [loop]) - alone == approx(by_wire, rel=0.01)
    assert sense * by_wire < 0.0


def test_bend_loop_moments_match_corner_and_rounded_values():
    width = 100 * UM
    for radius, expected in ((0.0, corner_moment(math.pi / 2)), (2.0, math.pi / 24.0)):
        onwards = radius * width
        starts = np.array([(-MM, 0.0), (-onwards, 0.0), (0.0, onwards)])
        ends = np.array([(-onwards, 0.0), (0.0, onwards), (0.0, MM)])
        kept = [0, 1, 2] if radius else [0, 2]
        track = BentTrack(starts[kept], ends[kept], np.array([0.0, 0.5 * math.pi, 0.0])[kept], width, 12 * UM, 0.0)
        for nearest in (0.3 * width, 3.0 * width):
            loops = bend_loops(track, nearest)
            assert np.sum(loops.moments) == approx(-expected * width**2, rel=1e-3)
            assert np.all(np.abs(loops.places) < 3.0 * width)
        back = BentTrack(track.ends[::-1], track.starts[::-1], -track.turns[::-1], width, 12 * UM, 0.0)
        assert np.sum(bend_loops(back, width).moments) == approx(expected * width**2, rel=1e-3)


def test_a_straight_track_has_no_loops():
    track = BentTrack(np.array([(0.0, 0.0)]), np.array([(MM, 0.0)]), np.zeros(1), 100 * UM, 12 * UM, 0.0)
    assert bend_loops(track, MM).moments.size == 0


@pytest.mark.parametrize("gap", [0.5 * MM, 2.0 * MM])
def test_coarse_chords_of_arc_agree_with_fine_chords(gap):
    # the half circles of a racetrack
    starts = MM * np.array([(-1.0, -2.0), (1.0, -2.0), (1.0, 2.0), (-1.0, 2.0)])
    ends = MM * np.array([(1.0, -2.0), (1.0, 2.0), (-1.0, 2.0), (-1.0, -1.5)])
    track = BentTrack(starts, ends, np.array([0.0, math.pi, 0.0, math.pi - 0.25]), 100 * UM, 12 * UM, 0.0)
    result, fine = with_chords(track, gap), with_chords(track, 0.02 * gap)
    assert len(result.corners) < 0.5 * len(fine.corners)
    assert over_mirror([result], gap) == approx(over_mirror([fine], gap), rel=5e-4)


def test_wave_normal_to_a_side_gives_finite_value():
    """Side by side, both ends of a side have one phase: their difference over it is the side's length."""
    track = PolylineTrack(MM * np.array([(-1.0, 0.0), (1.0, 0.0), (1.0, 0.4)]), 100 * UM, 12 * UM, 0.0)
    turned = [np.array([[0.0], [1.0]]), np.array([[1e-6], [1.0]])]
    sides = np.array([(1.0, 0.0), (0.0, 1.0)])
    shape = _Mitred(track, np.zeros(2), None)
    across, beside = (shape.waves(np.array([3e3]), _rotate_off_normals(unit, sides)) for unit in turned)
    assert np.all(np.isfinite(across)) and across == approx(beside, abs=1e-8)
    assert abs(across[0, 0]) == approx(2 * MM, rel=0.02)


def test_repeated_bends_are_summed_as_one_pattern():
    """Sixteen corners of eight chords each: eight figures, the first and the last corner aside."""
    steps = [0.05 * np.array([math.cos(a), math.sin(a)]) for a in np.radians(np.arange(5.0, 45.0, 5.0))]
    points = [np.zeros(2)]
    for k in range(16):
        turn = math.pi / 4 * k
        matrix = np.array([(math.cos(turn), -math.sin(turn)), (math.sin(turn), math.cos(turn))])
        points += [points[-1] + matrix @ sum(steps[: n + 1]) for n in range(len(steps))]
        points.append(points[-1] + (2.0 - 0.1 * k) * matrix @ np.array([math.sqrt(0.5), math.sqrt(0.5)]))
    corners = np.array(points)
    result = repeating_patterns(corners, np.zeros((len(corners), 1)), 1e-7)
    assert len(result.first) == 9 and len(result.places) == 17 and len(result.kinds) == 8 * 9 + 1
    wave = np.array([[3.0], [5.0]])
    assert result.sums(wave, np.ones((1, 1)))[0] == approx(np.sum(np.exp(-1j * (corners @ wave))), rel=1e-12)


@pytest.mark.parametrize("whole", [False, True])
def test_repeated_loops_are_summed_at_their_positions(whole):
    angle = np.radians(45.0) * np.arange(24)
    radius = 2.0 - 0.02 * np.arange(24)
    middles = MM * (radius * np.stack([np.cos(angle), np.sin(angle)])).T
    starts, ends = middles[:-1], middles[1:]
    track = BentTrack(starts, ends, np.zeros(23), 100 * UM, 12 * UM, 0.0)
    loops = bend_loops(track, 0.3 * MM if whole else 30 * UM)
    line = PolylineTrack(middles, 100 * UM, 12 * UM, 0.0)
    number, unit = 2e3, np.array([[0.6], [0.8]])
    more = _Mitred(line, np.zeros(2), loops).waves(number, unit) - _Mitred(line, np.zeros(2), None).waves(number, unit)
    amount = np.sum(loops.moments * np.exp(-1j * number * (loops.places @ unit)[:, 0]))
    size = number * math.exp(-0.5 * (number * loops.spread) ** 2)
    assert more[:, 0] == approx(1j * size * amount * np.array([0.8, -0.6]), rel=1e-9)


@pytest.mark.slow
def test_nearly_round_racetrack_converges_with_few_directions(monkeypatch):
    """The chords of its arcs are as long as its sides: each counted as one that needs directions crowding about it."""
    starts = MM * np.array([(-0.3, -3.0), (0.3, -3.0), (0.3, 3.0), (-0.3, 3.0)])
    ends = MM * np.array([(0.3, -3.0), (0.3, 3.0), (-0.3, 3.0), (-0.3, -2.9)])
    track = BentTrack(starts, ends, np.array([0.0, math.pi, 0.0, math.pi]), 250 * UM, 35 * UM, 0.0)
    gap = 0.1 * MM
    chords = with_chords(track, gap)
    directions = _Directions.from_corners([chords.corners])
    assert directions.normals == () and directions.length == approx(0.6 * MM, rel=0.1)
    assert directions.count(8.0 / gap) < 110
    few = over_mirror([chords], gap)
    monkeypatch.setattr(_Directions, "count", lambda self, number: 600)
    assert few == approx(over_mirror([chords], gap), rel=1e-5)


def test_waves_are_computed_in_batches_with_equal_result(monkeypatch):
    """One by one, a thousand of them took a second of calls for numbers that need a third of it."""
    calls, waves = [], _Mitred.waves

    def counted(self, numbers, unit):
        calls.append(numbers.size)
        return waves(self, numbers, unit)

    monkeypatch.setattr(_Mitred, "waves", counted)
    track = PolylineTrack(SQUARE, 100 * UM, 12 * UM, 0.0)
    result = over_mirror([track], 30 * UM)
    assert len(calls) < 30
    monkeypatch.setattr(polyline_spectrum_module, "AT_ONCE", 1)
    assert result == approx(over_mirror([track], 30 * UM), rel=1e-4)
    assert len(calls) > 400


@pytest.mark.parametrize("phase", [0.0, 1e-17, 0.3, 2.0, math.pi, 2.0 * math.pi - 1e-4, 7.0])
def test_sum_over_row_of_positions_matches_closed_form(phase):
    """Also where every step turns the wave by nearly nothing, or by nearly a whole turn."""
    count, wave = 25, np.array([[phase / 0.05], [0.7]])
    places = np.array([2.0, 3.0]) + np.outer(np.arange(count) - 12.0, [0.05, 0.0])
    result = Rows(np.array([(2.0, 3.0)]), np.array([(0.05, 0.0)]), np.array([float(count)])).sums(wave)
    assert result[0, 0] == approx(np.sum(np.exp(-1j * (places @ wave))), rel=1e-9, abs=1e-9)


def test_polygon_turns_are_summed_as_rows():
    """Thirty turns of a square, a pitch farther in each: every corner is one figure in one row of thirty places."""
    size = np.repeat(2.0 - 0.05 * np.arange(30), 4)
    points = size[:, None] * np.tile([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)], (30, 1))
    result = repeating_patterns(points, np.tile(np.arange(4.0), 30)[:, None], 1e-7)
    assert len(result.kinds) == 4 and len(result.places) == 120 and len(result._rows[0].counts) <= 6
    wave = np.array([[31.0, 3.0], [5.0, -40.0]])
    assert result.sums(wave, np.ones((4, 2))) == approx(np.sum(np.exp(-1j * (points @ wave)), axis=0), rel=1e-9)


def octagon(turns, begin, sense, inwards=True):
    """Corners of a spiral of straight sides, each nearer to the centre than the one before, and small loops there."""
    side = np.arange(round(8 * turns) + 2)
    angle = begin + sense * math.pi / 4 * side
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    distance = MM * (2.0 - 0.15 * side / 8)
    pairs = zip(normals[:-1], normals[1:], distance[:-1], distance[1:], strict=True)
    corners = np.array([np.linalg.solve([item, other], [near, far]) for item, other, near, far in pairs])
    corners = corners if inwards else corners[::-1]
    loops = Loops(corners[1:-1], np.full(len(corners) - 2, 1e-9 * (sense if inwards else -sense)), 20 * UM)
    return PolylineTrack(corners, 100 * UM, 12 * UM, 0.0), loops


def test_congruent_layers_share_computed_waves(monkeypatch):
    """Four layers, turned by quarter turns, mirrored, walked inwards and outwards: one spiral is enough for all."""
    calls, waves = [], _Mitred.waves

    def counted(self, numbers, unit):
        calls.append(self)
        return waves(self, numbers, unit)

    monkeypatch.setattr(_Mitred, "waves", counted)
    four = [octagon(3.75, 0.0, 1), octagon(3.75, 0.5 * math.pi, 1, False),
            octagon(3.75, 0.25 * math.pi, -1), octagon(3.75, -0.5 * math.pi, -1, False)]
    tracks, loops = zip(*four, strict=True)
    shared = polyline_spectrum(tracks, 0.3 * MM, loops).power
    assert len({id(item) for item in calls}) == 1
    monkeypatch.setattr(polyline_spectrum_module, "track_images", lambda tracks, loops, centre: [None] * len(tracks))
    alone = polyline_spectrum(tracks, 0.3 * MM, loops).power
    assert len({id(item) for item in calls}) == 5
    assert np.abs(shared - alone).max() < 1e-9 * np.abs(alone).max()


def test_tracks_with_different_loops_are_not_images():
    (item, loops), (other, _) = octagon(3.75, 0.0, 1), octagon(3.75, 0.5 * math.pi, 1)
    less = Loops(loops.places, 0.9 * loops.moments, loops.spread)
    turned = octagon(3.75, 0.5 * math.pi, 1)[1]
    assert track_images([item, other], [loops, turned], np.zeros(2))[1] is not None
    assert track_images([item, other], [loops, less], np.zeros(2)) == [None, None]
