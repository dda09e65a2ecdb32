"""Ways through arrays whose coils do not stand in one line."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tolerance import approx

from sitscad import lay_out
from sitscad.kernels.geometry.path import Line, Point, polyline
from sitscad.layout.board import Role
from sitscad.layout.clearance import Breadth, TrackToPlace, ViaToPlace
from sitscad.layout.lanes import Ring, bus_for, rows_of_lanes
from sitscad.layout.routing import routes
from sitscad.layout.routing.escape import BUDGET, MAX_TRIALS_WITHOUT_PROGRESS, SearchLimit
from sitscad.layout.routing.maze import Ground, Lattice, Maze, spread
from sitscad.layout.routing.routes import front_of, route_freely
from sitscad.layout.windings import wind_all
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.load import load_text
from sitscad.spec.resolver import coils as positions

from .conftest import sensor


def grid(**changes):
    centres = positions.grid_centres(2, 2, 6.2e-3)
    values = dict(diameter=5e-3, turns=6, layers=2, stackup="flex-2l-18um", centres=centres)
    return sensor(**values | changes)


def maze_of(spec, length=40e-3, half_width=15e-3):
    """An empty board, its coils at the far end."""
    bus = bus_for(spec.artwork)
    across = Breadth(-half_width, half_width)
    lattice = Lattice(spec.artwork, bus, -10e-3, length, across)
    return Maze(lattice, bus, Ground(length - 5e-3, length, across, half_width))


def test_wave_path_avoids_occupied_nodes():
    free = np.ones((7, 9), dtype=bool)
    free[3, :8] = False
    wave = spread(free, [(0, 0)])
    assert wave.distance((2, 2)) == approx(2 * math.sqrt(2), rel=1e-6)
    assert math.isinf(wave.distance((3, 4)))
    way = list(wave.back((6, 0)))
    assert way[0] == (6, 0) and way[-1] == (0, 0) and (3, 8) in way
    assert all(max(abs(a - c), abs(b - d)) == 1 for (a, b), (c, d) in pairwise(way))


def test_wave_distances_are_shortest():
    """Distances against Bellman and Ford's, over random lattices."""
    rng = random.Random(4)
    for _ in range(5):
        free = np.array([[rng.random() < 0.7 for _ in range(8)] for _ in range(7)])
        free[0, 0] = True
        expected = np.full(free.shape, math.inf)
        expected[0, 0] = 0.0
        for _ in range(free.size):
            for i, j in np.argwhere(free):
                near = expected[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2]
                steps = np.hypot(*(np.indices(near.shape) - np.array([min(i, 1), min(j, 1)])[:, None, None]))
                expected[i, j] = min(expected[i, j], (near + steps).min())
        wave = spread(free, [(0, 0)])
        result = [[wave.distance((i, j)) for j in range(8)] for i in range(7)]
        assert np.array(result) == approx(expected, rel=1e-6)


def test_maze_path_never_crosses_thin_track():
    """The lattice of a large board is coarser than a track with its spacing: no way may slip through."""
    spec = grid(diameter=8e-3, turns=6, width=7.6e-5, spacing=7.6e-5, centres=[(0.0, 0.0), (0.0, 12e-3)])
    maze = maze_of(spec, length=120e-3, half_width=30e-3)
    assert maze.step > 2 * maze.bus.pitch
    wall = TrackToPlace(polyline([Point(20e-3, -30e-3), Point(25e-3, 24e-3)]), maze.bus.width, 1)
    maze.add([wall], [])
    entry = Point(120e-3, 0.0)
    ways = [pair[0].way for pair in maze.exits(spec.array.placements[0], entry)]
    assert ways
    for way in ways:
        least = min(wall.path.distance(Point(*p)) for p in dense(way))
        assert least >= maze.bus.pitch - 1e-9
        assert max(p.y for p in way) > 24e-3  # round its end


@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0])
def test_maze_path_never_cuts_coil_corner(angle):
    """A long step between two free points may lead over a corner: the way would end in the other coil's copper."""
    centres = positions.grid_centres(3, 3, 14.8e-3 if angle < 45.0 else 18e-3)
    spec = grid(shape="square", diameter=10.6e-3, turns=6, width=0.12e-3, spacing=0.1e-3, centres=centres)
    turned = tuple(replace(p, rotation=math.radians(angle)) for p in spec.array.placements)
    spec = replace(spec, array=replace(spec.array, placements=turned))
    bus = bus_for(spec.artwork)
    across = Breadth(-30e-3, 30e-3)
    maze = Maze(Lattice(spec.artwork, bus, -22e-3, 60e-3, across), bus, Ground(55e-3, 60e-3, across, 30e-3))
    assert maze.step > 1.5 * bus.pitch
    # beside a corner at an odd angle a step comes a little nearer: the exact check of every lead refuses such a way
    need = bus.spacing + bus.width / 2 - (0.1 * maze.step if angle == 20.0 else 0.0)
    for own in (turned[0], turned[1], turned[4]):
        ways = [pair[0].way for pair in maze.exits(own, Point(60e-3, 1e-3))]
        assert len(ways) >= 8
        points = np.concatenate([np.linspace(a, b, 100) for way in ways for a, b in pairwise(way)])
        assert all(from_square(points, other, 5.3e-3).min() >= need - 1e-9 for other in turned if other != own)


def from_square(points, placement, half):
    """True distances (m) of points from a square's copper edge, 0 inside."""
    away = (points - np.array(placement.centre)) @ np.array(
        [[math.cos(placement.rotation), -math.sin(placement.rotation)],
         [math.sin(placement.rotation), math.cos(placement.rotation)]]
    )
    return np.hypot(*np.maximum(np.abs(away) - half, 0.0).T)


def test_wave_step_needs_free_midpoint():
    free = np.array([[1, 1], [0, 1]], dtype=bool)
    between = np.ones((3, 3), dtype=bool)
    assert spread(free, [(0, 0)], between).distance((1, 1)) == approx(math.sqrt(2), rel=1e-6)
    between[1, 1] = False
    assert spread(free, [(0, 0)], between).distance((1, 1)) == approx(2.0, rel=1e-6)
    between[0, 1] = False
    assert math.isinf(spread(free, [(0, 0)], between).distance((1, 1)))


def test_maze_path_never_passes_full_wall():
    spec = grid(centres=[(0.0, 0.0), (0.0, 12e-3)])
    maze = maze_of(spec)
    maze.add([TrackToPlace(polyline([Point(20e-3, -15e-3), Point(21e-3, 15e-3)]), maze.bus.width, 1)], [])
    assert list(maze.exits(spec.array.placements[0], Point(40e-3, 0.0))) == []


def test_maze_paths_avoid_holes_and_end_before_tail():
    spec = grid(centres=[(0.0, 0.0), (0.0, 12e-3)])
    maze = maze_of(spec)
    holes = [ViaToPlace(Point(12e-3, k * 0.9e-3), 0.45e-3, 0.2e-3) for k in range(-6, 7)]
    maze.add([], holes)
    way = next(maze.exits(spec.array.placements[0], Point(40e-3, 0.0)))[0].way
    assert min(p.distance(hole.centre) for p in dense(way) for hole in holes) >= 0.225e-3 + maze.bus.pitch / 2
    assert max(p.x for p in way) <= 40e-3 + 1e-9


def test_maze_paths_leave_ring_at_right_angle():
    """A lead may come round the ring from either side, and must not bend back over itself."""
    spec = grid(shape="rectangle", size=(9e-3, 4e-3), centres=[(0.0, 0.0), (0.0, 12e-3)])
    maze = maze_of(spec)
    ring = Ring(spec.coil, spec.array.placements[0], maze.bus.ring_offset)
    for out, _ in maze.exits(spec.array.placements[0], Point(40e-3, 0.0)):
        start = ring.at(out.angle)
        assert min(abs(out.way[0].x - start.x), abs(out.way[0].y - start.y)) < 1e-9 or is_corner(ring, start)


def test_maze_path_never_turns_back_at_first_corner():
    """A lead left a corner downwards and came back round it towards the tail, its two legs 72 um apart."""
    text = """sitscad: 1
name: corner
coil: {shape: square, outer_diameter: 7.63, turns: 6.25, layers: 3, trace_width: 100 um, trace_spacing: 90 um,
       start_angle: 311 deg, sense: clockwise}
array: {pattern: grid, count: [2, 2], pitch: 8.43}
fpc: {rules: generic-fine, tail: {length: 60, connector: zif-0.5mm}}"""
    layout = lay_out(load_text(text, "corner.yaml"))
    leads = [trace.path for trace in layout.traces if trace.role is Role.LEAD]
    assert layout.shortfalls == () and len(leads) >= 8
    for item, other in (pair for lead in leads for pair in pairwise(lead)):
        ahead, onward = (np.subtract(line.end, line.start) / line.length for line in (item, other))
        assert float(ahead @ onward) > math.cos(math.radians(120.0))


def is_corner(ring, point):
    return min(point.distance(side.start) for side in ring.boundary) < 0.2e-3


def dense(way):
    return [
        Point(*(np.array(a) + t * (np.array(b) - np.array(a))))
        for a, b in pairwise(way)
        for t in np.linspace(0, 1, 200)
    ]


@pytest.mark.parametrize("centres", [positions.grid_centres(2, 2, 6e-3), positions.grid_centres(3, 3, 6e-3),
                                     positions.triangle_centres(6e-3),
                                     [(0.0, 1e-3), (6e-3, 2e-3), (12e-3, -1e-3), (18e-3, 0.5e-3)]])
def test_each_tail_order_assigns_one_lane_per_coil(centres):
    placements = tuple(CoilPlacement(f"C{k}", (x, y)) for k, (x, y) in enumerate(centres))
    orders = rows_of_lanes(placements)
    ranks = [tuple(lane.rank for lane in order) for order in orders]
    assert len(set(ranks)) == len(ranks) <= 9
    for order in orders:
        assert sorted(lane.rank for lane in order) == list(range(len(placements)))
        assert tuple(lane.placement for lane in order) == placements


@pytest.mark.slow
def test_grid_with_room_between_rows_is_routed():
    """Once refused: vias of the near coils stand where the far ones were to pass, beside 4.5 mm of free board."""
    spec = grid(shape="racetrack", size=(7.76e-3, 5.23e-3), turns=7, layers=7, width=100e-6, spacing=90e-6,
                stackup="flex-8l", clockwise=True, centres=positions.grid_centres(2, 2, 9.76e-3))
    assert lay_out(spec).shortfalls == ()


@pytest.mark.parametrize("centre, rotation", [((0.0, 1e-3), 0.0), ((0.0, 0.0), math.radians(30))])
def test_single_offset_or_rotated_coil_is_routed(centre, rotation):
    spec = sensor(diameter=5e-3, turns=6, layers=2, stackup="flex-2l-18um", coils=1)
    array = replace(spec.array, pattern="explicit", placements=(CoilPlacement("C1", centre, rotation),))
    assert lay_out(replace(spec, array=array)).shortfalls == ()


@pytest.mark.slow
def test_leads_never_turn_back_over_themselves():
    """Once the lead of the second coil left the ring towards the tail though it came along its side from there."""
    spec = sensor(shape="square", diameter=5.24e-3, turns=11.5, layers=4, width=76e-6, spacing=76e-6, coils=4,
                  pitch=6.6e-3, clockwise=True, corner_radius=0.56e-3)
    for trace in lay_out(spec).traces:
        for item, other in pairwise(trace.path):
            if trace.role is Role.LEAD and isinstance(item, Line) and isinstance(other, Line):
                ahead, onward = (np.subtract(line.end, line.start) / line.length for line in (item, other))
                assert float(ahead @ onward) > -0.9


def test_search_of_unroutable_array_ends_early():
    """Between coils nearer to each other than a track with its spacings nothing passes, in whatever order."""
    spec = grid(centres=positions.grid_centres(3, 3, 5.2e-3))
    bus, searches = bus_for(spec.artwork), SearchLimit()
    artwork = spec.artwork
    assert route_freely(artwork, bus, wind_all(artwork), front_of(artwork, bus),
                        searches) is None
    assert searches.left > 0.9 * BUDGET


def test_search_limit_ends_early_with_two_stuck_coils():
    """One that is missing is looked for with all of it: boards found the last of six coils after 7,600 trials."""
    searches = SearchLimit()
    searches.begin(4)
    searches.left -= 200
    searches.led_out(2, 4)
    searches.left -= MAX_TRIALS_WITHOUT_PROGRESS - 1
    assert not searches.is_spent and not searches.is_overdrawn
    searches.left -= 1
    assert searches.is_spent and searches.is_overdrawn and searches.left > 0
    searches.led_out(3, 4)
    assert not searches.is_spent


@pytest.mark.slow
def test_board_with_two_stuck_coils_ends_search_early():
    """All 16,000 trials were made on it, and check took 69 times what importing numpy takes."""
    spec = load_text(
        "sitscad: 1\nname: lost\narray: {pattern: grid, pitch: 13.09, count: [2, 2]}\n"
        "coil: {shape: circle, outer_diameter: 12.09, turns: 16.75, layers: 8, trace_width: 150 um,"
        " trace_spacing: 76 um}\n"
        "fpc: {rules: generic-flex, tail: {length: 15, connector: zif-0.5mm, layers: 2, bend: static}}"
    )
    bus, searches = bus_for(spec.artwork), SearchLimit()
    artwork = spec.artwork
    assert route_freely(artwork, bus, wind_all(artwork), front_of(artwork, bus),
                        searches) is None
    assert searches.left > BUDGET - 1.3 * MAX_TRIALS_WITHOUT_PROGRESS


@pytest.mark.slow
def test_no_escape_search_is_repeated(monkeypatch):
    """Orders that begin alike once led the first coils out again: an eighth of all searches of this board."""
    result, lead_out = [], routes._lead_out

    def recorded(board, index, choices, laid, first=False):
        result.append((board.bus.base, board.breadth, board.lanes[index], index, repr(laid._tracks)))
        return lead_out(board, index, choices, laid, first)

    monkeypatch.setattr(routes, "_lead_out", recorded)
    spec = grid(turns=5.75, layers=6, stackup="flex-6l", centres=positions.grid_centres(2, 2, 5.5e-3))
    bus = bus_for(spec.artwork)
    artwork = spec.artwork
    assert route_freely(artwork, bus, wind_all(artwork), front_of(artwork, bus),
                        SearchLimit()) is not None
    assert len(result) > 40
    assert len(set(result)) == len(result)


@pytest.mark.slow
def test_six_square_coils_with_wide_gaps_are_routed():
    """Six square coils nearly a coil apart: every exit without a way took all that one coil's search may try."""
    text = """
sitscad: 1
name: six
coil: {shape: square, outer_diameter: 5.3, turns: 10.5, layers: 6, trace_width: 0.1, trace_spacing: 0.09,
       start_angle: 45 deg}
array: {pattern: grid, count: [2, 3], pitch: 9.1}
fpc: {rules: generic-fine, tail: {length: 60, connector: zif-0.3mm, layers: 2}}
"""
    assert not lay_out(load_text(text, "six.yaml")).shortfalls
