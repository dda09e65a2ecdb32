"""The spirals follow the contract's definition: circle within 0.1 um, polygons corner by corner."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.geometry.path import Arc, Point, polar
from sitscad.kernels.geometry.shapes import SHAPES, SpiralDimensions, rounded_corners

MM = 1e-3


@settings(max_examples=40, deadline=None)
@given(
    st.floats(2.0, 40.0),
    st.floats(0.06, 0.4),
    st.floats(0.25, 30.0),
    st.floats(-7.0, 7.0),
    st.sampled_from([1, -1]),
)
def test_circle_winding_is_archimedean_spiral(diameter, pitch, turns, start, sense):
    turns = min(turns, (diameter - pitch) / 2 / pitch * 0.95)
    size = SpiralDimensions((diameter * MM, diameter * MM), pitch * MM / 2, pitch * MM, turns)
    path = SHAPES["circle"].wind(size, start, sense)
    worst = 0.0
    for i in range(400):
        theta = 2 * math.pi * turns * i / 399
        radius = (diameter - pitch / 2) * MM / 2 - pitch * MM * theta / (2 * math.pi)
        here = polar(radius, start + sense * theta)
        middle = min(len(path.segments) - 1, int(i / 399 * len(path.segments)))
        near = path.segments[max(0, middle - 1) : middle + 2]
        worst = max(worst, min(segment.distance(here) for segment in near))
    assert worst < 0.1e-6
    assert all(isinstance(segment, Arc) and (segment.sweep > 0) == (sense > 0) for segment in path)


def test_square_winding_matches_specified_corners():
    """D = 3 mm, w = s = 0.1 mm: h = 1.45 mm, p = 0.2 mm; one flat faces +x, so the first side begins at -45 degrees."""
    path = SHAPES["square"].wind(SpiralDimensions((3 * MM, 3 * MM), 0.1 * MM, 0.2 * MM, 1.5), 0.0)
    corners = [path.start, *(segment.end for segment in path)]
    expected = [(1.45, -1.45), (1.45, 1.45), (-1.45, 1.45), (-1.45, -1.45), (1.25, -1.45), (1.25, 1.25), (-1.25, 1.25)]
    for corner, (x, y) in zip(corners, expected, strict=True):
        assert corner.distance(Point(x * MM, y * MM)) < 1e-12


@pytest.mark.parametrize(("shape", "corners"), [("square", 4), ("hexagon", 6), ("octagon", 8)])
@pytest.mark.parametrize("sense", [1, -1])
def test_polygon_sides_lie_on_flats(shape, corners, sense):
    diameter, width, pitch, turns = 5 * MM, 0.1 * MM, 0.2 * MM, 4
    path = SHAPES[shape].wind(SpiralDimensions((diameter, diameter), width, pitch, turns), 0.3, sense)
    assert len(path.segments) == corners * turns
    for m, side in enumerate(path.segments):
        middle = side.at(0.5)
        dx, dy = side.end.x - side.start.x, side.end.y - side.start.y
        distance = abs(dx * side.start.y - dy * side.start.x) / math.hypot(dx, dy)
        assert distance == approx((diameter - width) / 2 - pitch * (m // corners), abs=1e-12)
        normal = math.atan2(dx * sense, -dy * sense)
        flat = math.remainder(normal, 2 * math.pi / corners)
        assert min(abs(flat), abs(abs(flat) - 2 * math.pi / corners)) < 1e-9
        assert middle.distance(Point(0, 0)) < diameter


@given(
    st.sampled_from([("square", 4), ("hexagon", 6), ("octagon", 8)]),
    st.floats(0.05, 0.5),
    st.floats(1.2, 3.0),
    st.integers(1, 48),
    st.floats(0.4, 5.0),
)
def test_polygon_winds_in_one_sense(shape, width, spread, sides, inside):
    """The step at the end of a whole turn once took more than the last side was long: a small octagon turned back."""
    name, corners = shape
    turns, pitch = max(0.5, sides / corners), width * spread
    diameter = pitch * (2 * math.ceil(turns) + inside)
    size = SpiralDimensions((diameter * MM, diameter * MM), width * MM, pitch * MM, turns)
    path = SHAPES[name].wind(size, 0.0)
    along = [math.atan2(line.end.y - line.start.y, line.end.x - line.start.x) for line in path]
    for item, other in pairwise(along):
        assert math.remainder(other - item, 2 * math.pi) == approx(2 * math.pi / corners, rel=1e-6)
    assert round(turns * corners) - len(path.segments) in ((0, 1) if (turns * corners) % corners == 0 else (0,))


def test_first_turn_of_rectangle_has_specified_start_and_length():
    path = SHAPES["rectangle"].wind(SpiralDimensions((6 * MM, 3 * MM), 0.1 * MM, 0.2 * MM, 1.0), 0.0)
    assert path.start.distance(Point(2.95 * MM, -1.45 * MM)) < 1e-12
    assert path.segments[1].length == approx(5.9 * MM, rel=1e-6)


def test_mirrored_layers_are_mirror_images():
    size = SpiralDimensions((4 * MM, 4 * MM), 0.1 * MM, 0.2 * MM, 5.3)
    item, other = SHAPES["circle"].wind(size, 0.7, 1), SHAPES["circle"].wind(size, -0.7, -1)
    for a, b in zip(item.segments, other.segments, strict=True):
        assert a.start.distance(Point(b.start.x, -b.start.y)) < 1e-15


def test_start_angle_is_rounded_to_last_corner_in_winding_direction():
    assert SHAPES["circle"].start(0.3, 1) == 0.3
    assert SHAPES["square"].start(0.0, 1) == approx(-math.pi / 4, rel=1e-6)
    assert SHAPES["square"].start(0.0, -1) == approx(math.pi / 4, rel=1e-6)
    assert SHAPES["square"].start(math.pi / 4, 1) == approx(math.pi / 4, rel=1e-6)
    assert SHAPES["hexagon"].start(0.0, 1) == approx(-math.pi / 6, rel=1e-6)


def test_rounded_corners_keep_winding_ends():
    path = SHAPES["square"].wind(SpiralDimensions((3 * MM, 3 * MM), 0.1 * MM, 0.2 * MM, 3.0), 0.0)
    soft = rounded_corners(path, 0.3 * MM, 4, 0.2 * MM)
    assert soft.start == path.start and soft.end == path.end and soft.length < path.length
    assert rounded_corners(path, 0.0, 4, 0.2 * MM) is path


@pytest.mark.parametrize("shape", ["circle", "square", "hexagon", "octagon"])
def test_outer_boundary_surrounds_coil_at_offset(shape):
    ring = SHAPES[shape].boundary((4 * MM, 4 * MM), 0.2 * MM)
    assert ring.is_closed
    distances = [math.hypot(*segment.at(0.5)) for segment in ring]
    assert min(distances) == approx(2.2 * MM, rel=1e-3 if shape == "circle" else 0.3)
    assert ring.start.distance(Point(2.2 * MM, 0)) < 1e-12


def racetrack(turns, angle, sense):
    size = SpiralDimensions((9 * MM, 5 * MM), 0.1 * MM, 0.2 * MM, turns)
    return SHAPES["racetrack"].wind(size, angle, sense)


def test_racetrack_winding_matches_specification():
    """D = [9, 5] mm: straights from x = 2 to -2 mm, R = 2.45 mm, the +x end p/2 across with p/2 less radius."""
    path = racetrack(1.5, SHAPES["racetrack"].start(0.0, 1), 1)
    assert path.start.distance(Point(2 * MM, 2.45 * MM)) < 1e-12
    assert path.segments[0].end.distance(Point(-2 * MM, 2.45 * MM)) < 1e-12
    first, other, third = (s for s in path if isinstance(s, Arc))
    assert first.centre.distance(Point(-2 * MM, 0.0)) < 1e-12 and first.radius == approx(2.45 * MM, rel=1e-6)
    assert other.centre.distance(Point(2 * MM, -0.1 * MM)) < 1e-12 and other.radius == approx(2.35 * MM, rel=1e-6)
    assert third.centre.distance(Point(-2 * MM, 0.0)) < 1e-12 and third.radius == approx(2.25 * MM, rel=1e-6)


@pytest.mark.parametrize("quadrant", range(4))
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("turns", [0.5, 2.0, 4.5])
def test_racetrack_is_smooth_and_evenly_spaced(quadrant, sense, turns):
    path = racetrack(turns, math.pi / 4 + quadrant * math.pi / 2, sense)
    assert len(path.segments) == round(4 * turns)
    corner = Point((2 if quadrant in (0, 3) else -2) * MM, (2.45 if quadrant < 2 else -2.45) * MM)
    assert path.start.distance(corner) < 1e-12
    for item, following in zip(path.segments, path.segments[1:], strict=False):
        assert item.end.distance(following.start) < 1e-15
        a, b = item.at(1.0 - 1e-6), following.at(1e-6)
        assert abs(math.hypot(a.x - b.x, a.y - b.y) - a.distance(item.end) - b.distance(item.end)) < 1e-12
    for item, inner in zip(path.segments, path.segments[4:], strict=False):
        for fraction in (0.1, 0.5, 0.9):
            assert inner.distance(item.at(fraction)) == approx(0.2 * MM, rel=1e-9)
    assert all((s.sweep > 0) == (sense > 0) for s in path if isinstance(s, Arc))


def test_racetrack_layers_of_opposite_sense_meet_at_inner_end():
    for turns in (1.0, 2.5):
        angle = SHAPES["racetrack"].start(0.0, 1)
        inner, other = racetrack(turns, angle, 1), racetrack(turns, angle + 4 * math.pi * turns, -1)
        assert inner.end.distance(other.end) < 0.11 * MM


def test_racetrack_boundary_surrounds_winding():
    ring = SHAPES["racetrack"].boundary((9 * MM, 5 * MM), 0.2 * MM)
    assert ring.is_closed
    for segment in ring:
        middle = segment.at(0.5)
        assert math.hypot(max(0.0, abs(middle.x) - 2 * MM), middle.y) >= 2.7 * MM - 1e-12
        assert math.hypot(max(0.0, abs(segment.end.x) - 2 * MM), segment.end.y) <= 2.73 * MM


@pytest.mark.parametrize(("shape", "size"), [("square", (5 * MM, 5 * MM)), ("rectangle", (8 * MM, 5 * MM))])
@pytest.mark.parametrize("turns", [0.25, 1.0, 3.75, 6.0])
@pytest.mark.parametrize("sense", [1, -1])
def test_mid_side_spiral_runs_between_middles_of_sides_at_its_pitch(shape, size, turns, sense):
    dimensions = SpiralDimensions(size, 0.1 * MM, 0.25 * MM, turns, is_mid_side=True)
    path = SHAPES[shape].wind(dimensions, SHAPES[shape].start(0.3, sense, True), sense)
    for end, level in ((path.start, 0), (path.end, math.floor(turns))):
        flats = [(item - 0.1 * MM) / 2 - level * 0.25 * MM for item in size]
        assert min(abs(end.x), abs(end.y)) == approx(0.0, abs=1e-12)
        assert max(abs(end.x) - flats[0], abs(end.y) - flats[1]) == approx(0.0, abs=1e-12)
    headings = [math.atan2(s.end.y - s.start.y, s.end.x - s.start.x) for s in path]
    turned = math.fsum(math.remainder(b - a, 2 * math.pi) for a, b in pairwise(headings))
    assert turned == approx(sense * 2 * math.pi * turns, abs=1e-9)
