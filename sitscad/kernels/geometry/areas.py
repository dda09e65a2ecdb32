"""Paths clipped to boxes, and unions of boxes, by the library shapely.

Arcs are replaced by chords. The results are for drawings and for outlines in files.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import shapely

from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, Point, bounding_box, polyline

CHORDS = 2e-6
"""Largest distance (m) between an arc and the chords that replace it."""


def parts_inside(path: Path, box: Box) -> list[Path]:
    """Return the parts of a path that are inside a box (m). A path that lies entirely inside is returned unchanged."""
    if _is_inside(path, box):
        return [path]
    line = shapely.LineString(path.flattened(CHORDS))
    parts = shapely.get_parts(line.intersection(_rectangle(path, box)))
    return [_path(part) for part in parts if isinstance(part, shapely.LineString) and part.coords]


def areas_inside(path: Path, box: Box) -> list[Path]:
    """Return the outlines of the parts of an area that are inside a box (m), counter-clockwise.

    The area is the inside of a closed path. A path that lies entirely inside the box is returned unchanged.
    """
    if _is_inside(path, box):
        return [path]
    area = shapely.Polygon(path.flattened(CHORDS))
    parts = shapely.orient_polygons(shapely.get_parts(area.intersection(_rectangle(path, box))))
    return [_path(part.exterior) for part in parts if isinstance(part, shapely.Polygon) and not part.is_empty]


def areas_beyond(path: Path, x: float) -> list[Path]:
    """Return the outlines of the parts of a closed path's area with coordinates above `x` (m), counter-clockwise."""
    return areas_inside(path, (x, -math.inf, math.inf, math.inf))


def joined_boxes(boxes: Iterable[Box]) -> list[Path]:
    """Return the outlines (m) of the union of rectangles with sides along x and y.

    Outer outlines run counter-clockwise, outlines of holes clockwise.
    """
    joined = shapely.union_all([shapely.box(*box) for box in boxes], grid_size=1e-12)
    areas = shapely.orient_polygons(shapely.get_parts(joined.simplify(0.0)))
    return [_path(ring) for area in areas for ring in (area.exterior, *area.interiors)]


def _is_inside(path: Path, box: Box) -> bool:
    """Whether a path lies entirely inside a box (m)."""
    x0, y0, x1, y1 = bounding_box([path])
    return x0 >= box[0] and y0 >= box[1] and x1 <= box[2] and y1 <= box[3]


def _rectangle(path: Path, box: Box) -> shapely.Polygon:
    """Return the box as a polygon (m). Infinite sides are moved to 1 m beyond the path."""
    x0, y0, x1, y1 = bounding_box([path])
    wide = 1.0  # metres: more than any path
    return shapely.box(max(box[0], x0 - wide), max(box[1], y0 - wide), min(box[2], x1 + wide), min(box[3], y1 + wide))


def _path(line: shapely.LineString) -> Path:
    """Return a polyline of shapely as a path of straight sides (m)."""
    return polyline([Point(x, y) for x, y in line.coords])
