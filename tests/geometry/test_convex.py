"""Convex outlines and plates in the plane, held against shapely, which sitscad itself does not use for them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point as Dot
from shapely.geometry import Polygon
from tolerance import approx

from sitscad.kernels.geometry.convex import Footprint, centroid, clip_path, clip_to_box, signed_distance
from sitscad.kernels.geometry.path import Point, circle, enclosed_area, rectangle

lengths = st.floats(0.2, 12.0)
places = st.floats(-6.0, 6.0)
radii = st.one_of(st.just(0.0), st.floats(1e-3, 3.0))
angles = st.floats(-math.pi, math.pi)
plates = st.builds(
    lambda is_round, x, y, cx, cy, turn: Footprint(is_round, (x, x if is_round else y), Point(cx, cy), turn),
    st.booleans(), lengths, lengths, places, places, angles,
)


def polygon(path):
    return Polygon(path.flattened(1e-5))


@settings(max_examples=60, deadline=None)
@given(plates, plates)
def test_overlap_of_plates_matches_shapely(one, other):
    shared = polygon(one.outline()).intersection(polygon(other.outline()))
    result = one.intersection(other)
    area = 0.0 if result is None else enclosed_area(result)
    assert area == approx(shared.area, abs=1e-3)
    if shared.area > 1e-2:
        middle = centroid(result)
        assert (middle.x, middle.y) == approx((shared.centroid.x, shared.centroid.y), abs=1e-3)
    if result is not None:
        assert result.is_closed


@settings(max_examples=60, deadline=None)
@given(lengths, lengths, radii, places, places)
def test_distance_beyond_rounded_body_matches_shapely(x, y, radius, px, py):
    ground = rectangle(-x / 2, -y / 2, x / 2, y / 2, radius)
    result, reference, dot = signed_distance(ground, Point(px, py)), polygon(ground), Dot(px, py)
    inside = reference.contains(dot)
    expected = -reference.exterior.distance(dot) if inside else reference.distance(dot)
    assert result == approx(expected, abs=1e-4)


@settings(max_examples=60, deadline=None)
@given(plates, lengths, lengths, radii)
def test_plate_overhang_equals_distance_beyond_body(plate, x, y, radius):
    ground = rectangle(-x, -y, x, y, radius)
    over = plate.overhang_beyond(ground)
    outside = polygon(plate.outline()).difference(polygon(ground))
    if over <= 0.0:
        assert outside.area < 1e-4
    else:
        body = polygon(ground)
        reach = max(body.distance(Dot(p)) for p in polygon(plate.outline()).exterior.coords)
        assert over == approx(reach, abs=1e-3)


def test_box_cuts_body_from_board_with_tail():
    board = rectangle(-5.0, -1.0, 20.0, 1.0, 0.4)
    body = clip_to_box(board, (-5.0, -1.0, 3.0, 1.0))
    assert enclosed_area(body) == approx(16.0 - 2 * (1 - math.pi / 4) * 0.4**2, rel=1e-6)


def test_half_plane_beside_disc_keeps_whole_disc_or_returns_none():
    disc = circle(Point(1.0, 2.0), 0.5)
    assert enclosed_area(clip_path(disc, Point(3.0, 0.0), Point(1, 0))) == approx(math.pi / 4, rel=1e-6)
    assert clip_path(disc, Point(0.0, 0.0), Point(1, 0)) is None


@pytest.mark.parametrize("turn", [0.0, math.pi / 2, math.pi, -math.pi / 2])
def test_reach_of_plate_rotated_by_quarter_turns_is_exact(turn):
    plate = Footprint(False, (4.0, 2.0), Point(0.5, 0.0), turn)
    assert sorted(plate.reach) == [1.0, 2.0]
