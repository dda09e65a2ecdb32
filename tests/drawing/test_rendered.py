"""Meshes as coloured areas: where they are seen, how large, and what hides what."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np
from tolerance import approx

from sitscad.files.drawing.pictures.rendered import PaintedMesh, draw_meshes, fitted_view, view_axes
from sitscad.files.drawing.sheet import Shape, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.kernels.geometry.path import enclosed_area

SIZE = 200.0, 150.0


def block(low, high, colour):
    """An upright block between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    points = np.array([(x, y, z) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)], dtype=float)
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return PaintedMesh(
        points, np.array([(a, b, c) for s in sides for a, b, c in ((s[0], s[1], s[2]), (s[0], s[2], s[3]))]), colour
    )


def drawn(*meshes, angles=(0.0, 0.0)):
    """The area (of the sheet) of every colour."""
    sheet = Sheet("", SIZE, unit="")
    view = fitted_view(meshes, view_axes(*angles), SIZE)
    draw_meshes(sheet, meshes, view, SIZE)
    areas = {}
    for shape in sheet.items:
        if isinstance(shape, Shape) and shape.fill:
            areas[shape.fill] = areas.get(shape.fill, 0.0) + abs(sum(enclosed_area(path) for path in shape.paths))
    return view, areas, svg(sheet)


def hue(areas, channel):
    return sum(area for fill, area in areas.items() if int(fill[1 + 2 * channel : 3 + 2 * channel], 16) > 60)


def test_block_in_front_view_has_area_of_its_face():
    view, areas, _ = drawn(block((0, 0, 0), (2, 1, 1), "#ff0000"))
    assert view.scale == approx(100.0, rel=1e-6)
    assert sum(areas.values()) == approx(200.0 * 100.0, rel=0.01)


def test_nearer_block_hides_only_covered_part_of_farther_block():
    near, far = block((0, -2, 0), (1, -1, 1), "#ff0000"), block((0, 0, 0), (2, 1, 1), "#00ff00")
    for order in ((near, far), (far, near)):
        _, areas, _ = drawn(*order)
        assert hue(areas, 0) == approx(hue(areas, 1), rel=0.02)


def test_intersecting_blocks_show_their_front_parts():
    item, other = block((0, 0, 0), (3, 2, 1), "#ff0000"), block((1, -1, 0.25), (2, 1, 0.75), "#00ff00")
    _, areas, _ = drawn(item, other)
    assert hue(areas, 1) / sum(areas.values()) == approx(0.5 / 3.0, rel=0.03)


def test_cube_in_oblique_view_shows_three_sides_of_projected_area():
    angles = math.radians(30.0), math.radians(40.0)
    view, areas, _ = drawn(block((0, 0, 0), (1, 1, 1), "#8080ff"), angles=angles)
    sides = sorted(area / view.scale**2 for area in areas.values())
    assert sides == approx(sorted(abs(part) for part in view.toward), rel=0.02)


def test_rendering_is_repeatable():
    meshes = block((0, 0, 0), (3, 2, 1), "#ff0000"), block((1, -1, 0.25), (2, 1, 0.75), "#00ff00")
    assert drawn(*meshes, angles=(0.5, 0.4))[2] == drawn(*meshes, angles=(0.5, 0.4))[2]


def test_empty_and_off_picture_meshes_draw_nothing():
    """Meshes that are cut open may have nothing left; a raster is as large as what it shows."""
    red = block((0, 0, 0), (2, 1, 1), "#ff0000")
    none = PaintedMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=int), "#00ff00")
    _, areas, text = drawn(red, none)
    assert (areas, text) == drawn(red)[1:]
    beside, sheet = block((-9, 0, 3), (-8, 1, 4), "#0000ff"), Sheet("", SIZE, unit="")
    draw_meshes(sheet, [beside], fitted_view([red], view_axes(0.0, 0.0), SIZE), SIZE)
    assert not list(sheet.items)


def test_needles_one_raster_point_wide_are_rendered():
    """The border of one point that hangs on others by a corner had no line left, and the SVG no start."""
    random = np.random.default_rng(1)
    lows, sides = random.uniform(0.0, 1.0, (40, 3)), random.uniform(0.002, 0.01, (40, 3))
    sides[np.arange(40), random.integers(3, size=40)] = 1.0
    needles = [block(low, low + side, "#ff0000") for low, side in zip(lows, sides, strict=True)]
    _, _, text = drawn(*needles, angles=random.uniform(0.1, 1.2, 2))
    ElementTree.fromstring(text)
