"""Paths cut by boxes and boxes joined: lengths, areas, directions and number of the parts."""

from __future__ import annotations

import math

import pytest
from tolerance import approx

from sitscad.kernels.geometry.areas import areas_beyond, areas_inside, joined_boxes, parts_inside
from sitscad.kernels.geometry.path import Point, circle, closed_polygon, enclosed_area, polyline, rectangle

DISC = circle(Point(0.0, 0.0), 1e-3)
CORNERS = (0, 0), (5, 0), (5, 1), (1, 1), (1, 2), (5, 2), (5, 3), (0, 3)
COMB = closed_polygon([Point(x * 1e-3, y * 1e-3) for x, y in CORNERS])


def test_path_within_box_is_unchanged():
    box = (-1e-3, -1e-3, 1e-3, 1e-3)
    assert parts_inside(DISC, box) == [DISC] and areas_inside(DISC, box) == [DISC]


def test_path_outside_box_gives_no_parts():
    box = (2e-3, 2e-3, 3e-3, 3e-3)
    assert parts_inside(DISC, box) == [] and areas_inside(DISC, box) == []


def test_line_crossing_box_twice_leaves_two_parts():
    line = polyline([Point(-2e-3, 0.0), Point(2e-3, 0.0), Point(2e-3, 0.5e-3), Point(-2e-3, 0.5e-3)])
    parts = parts_inside(line, (-1e-3, -1e-3, 1e-3, 1e-3))
    assert sorted((part.start.y, part.length) for part in parts) == [
        (approx(0.0, abs=1e-15), approx(2e-3, rel=1e-9)), (approx(0.5e-3, rel=1e-9), approx(2e-3, rel=1e-9)),
    ]


def test_circle_is_cut_to_arc():
    (half,) = parts_inside(DISC, (-2e-3, 0.0, 2e-3, 2e-3))
    assert half.length == approx(math.pi * 1e-3, rel=2e-3)
    (area,) = areas_inside(DISC, (-2e-3, 0.0, 2e-3, 2e-3))
    assert enclosed_area(area) == approx(math.pi / 2.0 * 1e-6, rel=4e-3)


@pytest.mark.parametrize("path", [COMB, COMB.reversed()])
def test_cut_comb_leaves_two_counter_clockwise_areas(path):
    assert sorted(map(enclosed_area, areas_beyond(path, 2e-3))) == approx([3e-6, 3e-6], rel=1e-9)


def test_joined_boxes_have_corners_and_holes():
    frame = [(0.0, 0.0, 3e-3, 1e-3), (0.0, 2e-3, 3e-3, 3e-3), (0.0, 0.0, 1e-3, 3e-3), (2e-3, 0.0, 3e-3, 3e-3)]
    outer, hole = sorted(joined_boxes(frame), key=enclosed_area, reverse=True)
    assert enclosed_area(outer) == approx(9e-6, rel=1e-9) and enclosed_area(hole) == approx(-1e-6, rel=1e-9)
    assert len(outer.segments) == len(hole.segments) == 4


def test_separate_boxes_stay_two_outlines():
    assert sorted(map(enclosed_area, joined_boxes([(0.0, 0.0, 1e-3, 1e-3), (2e-3, 0.0, 4e-3, 1e-3)]))) == approx(
        [1e-6, 2e-6], rel=1e-9)


def test_cut_rectangle_is_rectangle():
    (area,) = areas_beyond(rectangle(0.0, 0.0, 4e-3, 1e-3), 1e-3)
    assert len(area.segments) == 4 and enclosed_area(area) == approx(3e-6, rel=1e-9)
