"""Everything flat as shapely polygons: copper by layer and net, the board, openings, plates."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import groupby
from typing import TYPE_CHECKING, Any

from sitscad.geometry.path import Region
from sitscad.interchange.lines import TOLERANCE
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.record import record
from sitscad.scene.stack import stack

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

COPPER = "copper"


@record(eq=False)
class Area:
    """Something flat in its place: what it is (``copper``, ``board``, ``elastomer``, ``target``, ...), its shapely
    polygon and the heights (m) of its faces; of copper its layer from 1 at the top, and its net (empty for contacts in
    no circuit).
    """

    what: str
    polygon: Polygon | MultiPolygon
    lower: float
    upper: float
    layer: int | None = None
    net: str = ""


def areas(layout: Layout, tolerance: float = TOLERANCE) -> tuple[Area, ...]:
    """All copper with its holes, by layer and net, then board, stiffener, shield, jaw and what lies on the board, from
    below; arcs are chords within a tolerance (m).

    Copper is what is made of it: tracks with round ends, pads, holes, teardrops.

    Raises
    ------
    MissingExtra
        without shapely (`pip install 'sitscad[all]'`).
    PartsError
        where a part has no place (a shield that does not fit into the standoff).
    ValueError
        for a tolerance that is no positive length.
    """
    if not 0.0 < tolerance < float("inf"):
        raise ValueError("the tolerance is a positive length in metres")
    shapely = require("shapely")
    copper = tuple(_copper(layout, tolerance, shapely))
    bodies = (Area(body.name, _polygon(body.region, tolerance, shapely), *body.heights) for body in stack(layout))
    return (*copper, *bodies)


def _copper(layout: Layout, tolerance: float, shapely: Any) -> Iterator[Area]:
    """The copper of every layer as areas, one a net, holes drilled out."""
    for layer in layout.spec.fpc.stackup.copper:
        pieces = sorted(_pieces(layout, layer.number, tolerance, shapely), key=lambda piece: piece[0])
        drills = [
            shapely.Point(via.centre).buffer(via.drill / 2, _quarter(via.drill / 2, tolerance))
            for via in layout.vias_on(layer.number)
        ]
        bored = shapely.union_all(drills)
        for net, group in groupby(pieces, key=lambda piece: piece[0]):
            whole = shapely.union_all([shape for _, shape in group])
            half = layer.thickness / 2
            yield Area(COPPER, whole.difference(bored), layer.z - half, layer.z + half, layer.number, net)


def _pieces(layout: Layout, number: int, tolerance: float, shapely: Any) -> Iterator[tuple[str, Any]]:
    for trace in layout.on_layer(number):
        line = shapely.LineString(trace.path.flattened(tolerance))
        yield trace.net, line.buffer(trace.width / 2, _quarter(trace.width / 2, tolerance))
    for via in layout.vias_on(number):
        yield via.net, shapely.Point(via.centre).buffer(via.pad / 2, _quarter(via.pad / 2, tolerance))
    for pad in layout.all_pads:
        if pad.layer == number:
            (x, y), (w, h) = pad.centre, pad.size
            yield pad.net, shapely.box(x - w / 2, y - h / 2, x + w / 2, y + h / 2)
    for drop in layout.teardrops:
        if drop.layer == number:
            yield drop.net, shapely.Polygon(drop.outline.flattened(tolerance))


def _quarter(radius: float, tolerance: float) -> int:
    """Chords of a quarter circle of a radius that stay within a tolerance (m)."""
    return max(2, math.ceil(math.pi / 4 / math.acos(max(0.0, 1.0 - tolerance / radius))))


def _polygon(region: Region, tolerance: float, shapely: Any) -> Any:
    holes = [hole.flattened(tolerance) for hole in region.holes]
    return shapely.Polygon(region.outline.flattened(tolerance), holes)

