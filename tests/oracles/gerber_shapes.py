"""Gerber files as shapes: gerbonara reads the file (it is not our code), shapely makes areas of what it read."""

from __future__ import annotations

import math
import warnings

import pytest

pytest.importorskip("gerbonara", reason="gerbonara is not installed: pip install 'sitscad[all]' brings it")
pytest.importorskip("shapely", reason="shapely is not installed: pip install 'sitscad[all]' brings it")

import shapely
from gerbonara import GerberFile
from gerbonara.apertures import CircleAperture, RectangleAperture
from gerbonara.graphic_objects import Arc, Flash, Line, Region
from gerbonara.utils import MM
from shapely.geometry import LineString, Point, Polygon, box
from shapely.ops import unary_union

CHORD = 2e-5
"""How far chords may leave an arc, in millimetres."""
ROUND = 64
"""Chords in a quarter of a round end."""


def read(text: bytes, name: str = "file.gbr") -> GerberFile:
    """A file as gerbonara sees it; any of its warnings is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return GerberFile.from_string(text.decode("ascii"), filename=name)


def arc_points(start, end, centre, clockwise) -> list[tuple[float, float]]:
    """Chords of an arc given as gerbonara gives it: absolute centre, direction by flag."""
    radius = math.dist(start, centre)
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    last = math.atan2(end[1] - centre[1], end[0] - centre[0])
    sweep = -((first - last) % (2 * math.pi)) if clockwise else (last - first) % (2 * math.pi)
    count = max(2, math.ceil(abs(sweep) / (2 * math.acos(max(0.0, 1 - CHORD / radius))))) if radius > CHORD else 2
    inner = [
        (
            centre[0] + radius * math.cos(first + sweep * i / count),
            centre[1] + radius * math.sin(first + sweep * i / count),
        )
        for i in range(1, count)
    ]
    return [start, *inner, end]


def area_of(item) -> shapely.Geometry:
    """What one object of a file covers, in millimetres."""
    if isinstance(item, Flash):
        tool = item.aperture
        if isinstance(tool, CircleAperture):
            return Point(item.x, item.y).buffer(tool.diameter / 2, quad_segs=ROUND)
        assert isinstance(tool, RectangleAperture)
        return box(item.x - tool.w / 2, item.y - tool.h / 2, item.x + tool.w / 2, item.y + tool.h / 2)
    if isinstance(item, Line):
        return LineString([item.p1, item.p2]).buffer(item.aperture.diameter / 2, quad_segs=ROUND)
    if isinstance(item, Arc):
        points = arc_points(item.p1, item.p2, item.center, item.clockwise)
        return LineString(points).buffer(item.aperture.diameter / 2, quad_segs=ROUND)
    assert isinstance(item, Region)
    points = [item.outline[0]]
    for a, b, (clockwise, centre) in item.iter_segments():
        points += arc_points(a, b, centre, clockwise)[1:] if clockwise is not None else [b]
    return Polygon(points)


def image(file: GerberFile) -> shapely.Geometry:
    """The whole image in millimetres: dark objects joined, clear ones cut out in the order of the file."""
    whole, dark = Polygon(), []
    for item in file.objects:
        assert item.unit == MM
        if item.polarity_dark:
            dark.append(area_of(item))
        else:
            whole = unary_union([whole, *dark]).difference(area_of(item))
            dark = []
    return unary_union([whole, *dark])


def net_of(item) -> str:
    """The net of one object, from its attribute; "" of a region, of which gerbonara keeps no attributes."""
    return "" if isinstance(item, Region) else item.attrs[".N"][0]


def function_of(item) -> tuple[str, ...]:
    """The aperture function of one object; none of a region."""
    return () if isinstance(item, Region) else dict(item.aperture.attrs)[".AperFunction"]
