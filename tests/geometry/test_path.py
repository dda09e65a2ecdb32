"""Lines, arcs and paths: lengths, boxes, distances, areas, rounding."""

import math
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.geometry.path import (
    Arc,
    Line,
    Path,
    Point,
    bounding_box,
    circle,
    closed_polygon,
    enclosed_area,
    polar,
    polyline,
    rectangle,
    rounded_polygon,
    rounded_polyline,
)

angles = st.floats(-7.0, 7.0)
sweeps = st.floats(0.01, 6.2)
coordinates = st.floats(-5e-3, 5e-3)


def arc(start: float, sweep: float, ccw: bool, radius: float = 1e-3, centre: Point = Point(0.3e-3, -0.2e-3)) -> Arc:
    turn = sweep if ccw else -sweep
    return Arc(polar(radius, start, centre), polar(radius, start + turn, centre), centre, ccw)


@given(angles, sweeps, st.booleans())
def test_arc_has_sweep_and_length(start, sweep, ccw):
    piece = arc(start, sweep, ccw)
    assert piece.sweep == approx(sweep if ccw else -sweep, abs=1e-9)
    assert piece.length == approx(1e-3 * sweep, rel=1e-9)
    assert piece.reversed().sweep == approx(-piece.sweep, abs=1e-9)


@given(angles, sweeps, st.booleans(), coordinates, coordinates)
def test_distance_to_arc_is_least_sampled_distance(start, sweep, ccw, x, y):
    piece, point = arc(start, sweep, ccw), Point(x, y)
    nearest = min(point.distance(piece.at(i / 2000)) for i in range(2001))
    assert piece.distance(point) <= nearest + 1e-12
    assert piece.distance(point) == approx(nearest, abs=1e-3 * sweep / 2000)


@given(angles, sweeps, st.booleans())
def test_arc_box_is_tight(start, sweep, ccw):
    piece = arc(start, sweep, ccw)
    points = [piece.at(i / 3000) for i in range(3001)]
    box = piece.box
    sampled = (min(p.x for p in points), min(p.y for p in points), max(p.x for p in points), max(p.y for p in points))
    for given_side, side in zip(box, sampled, strict=True):
        assert given_side == approx(side, abs=2e-9)


def test_flattening_converges_at_second_order():
    piece = arc(0.3, 2.5, True)
    lengths = [sum(a.distance(b) for a, b in pairwise(p)) for p in (piece.flattened(1e-6), piece.flattened(0.25e-6))]
    errors = [piece.length - length for length in lengths]
    assert errors[0] / errors[1] == approx(4.0, rel=0.15)


@given(st.floats(1e-8, 1e-5))
def test_flattened_chords_stay_within_tolerance(tolerance):
    piece = arc(0.1, 3.0, True)
    points = piece.flattened(tolerance)
    middles = [Line(a, b).at(0.5) for a, b in pairwise(points)]
    assert max(piece.distance(p) for p in middles) <= tolerance * (1 + 1e-9)


def test_enclosed_area_includes_arcs_exactly():
    assert enclosed_area(circle(Point(1e-3, 2e-3), 0.5e-3)) == approx(math.pi * 0.25e-6, rel=1e-12)
    assert enclosed_area(rectangle(0, 0, 2e-3, 1e-3)) == approx(2e-6, rel=1e-12)
    r = 0.2e-3
    assert enclosed_area(rectangle(0, 0, 2e-3, 1e-3, r)) == approx(2e-6 - (4 - math.pi) * r * r, rel=1e-12)


def test_rounded_path_is_closed_and_tangent():
    path = rounded_polygon([Point(0, 0), Point(3e-3, 0), Point(3e-3, 1e-3), Point(1e-3, 1e-3), Point(0, 3e-3)], 0.2e-3)
    assert path.is_closed
    for item, other in pairwise(path.segments):
        assert item.end.distance(other.start) < 1e-12
        before, after = item.at(1 - 1e-6), other.at(1e-6)
        a = math.atan2(item.end.y - before.y, item.end.x - before.x)
        b = math.atan2(after.y - other.start.y, after.x - other.start.x)
        assert abs(math.remainder(a - b, 2 * math.pi)) < 1e-3


def test_rounded_open_polyline_keeps_ends():
    corners = [Point(0, 0), Point(1e-3, 0), Point(1e-3, 1e-3), Point(0, 1e-3)]
    path = rounded_polyline(corners, 10e-3)
    assert path.start == corners[0] and path.end == corners[-1]
    assert path.length < polyline(corners).length


@given(angles, st.floats(-1e-2, 1e-2), st.floats(-1e-2, 1e-2))
def test_moved_path_keeps_length(angle, dx, dy):
    path = closed_polygon([Point(0, 0), Point(1e-3, 0), Point(0, 2e-3)]) + Path((arc(0.2, 1.0, False),))
    moved = path.rotated(angle).shifted(dx, dy)
    assert moved.length == approx(path.length, rel=1e-9)
    assert path.reversed().length == approx(path.length, rel=1e-12)


def test_mirrored_arc_reverses_sense():
    path = Path((arc(0.2, 1.0, True),)).mapped(lambda p: Point(p.x, -p.y), flips=True)
    assert path.segments[0].sweep == approx(-1.0, rel=1e-6)


def test_bounding_box_covers_several_paths():
    box = bounding_box([circle(Point(0, 0), 1e-3), polyline([Point(2e-3, 0), Point(2e-3, 3e-3)])])
    assert box == approx((-1e-3, -1e-3, 2e-3, 3e-3), rel=1e-6)
