"""The assembly cut across the jaw through the middle of the array, every layer named, with the port's circle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.drawing.pictures.exploded import CHORD, INK, TURN
from sitscad.drawing.sheet import Pen, Sheet
from sitscad.geometry.path import Path, Point, circle, closed_polygon, polyline
from sitscad.parts.mesh import manifold, tessellate
from sitscad.parts.solid import Solid
from sitscad.record import record
from sitscad.scene.bodies import BodyRole
from sitscad.scene.jaws import section
from sitscad.spec.sensor import SensorSpec

FAINT, OTHER = "#7f8c8d", "#eef1f3"
ROW, LETTERS = 21.0, 13.0
"""Pixels between two labels, and the height of their letters."""
AREA = Pen(0.6, INK, round_corners=False, round_ends=False)
LEADER = Pen(0.6, FAINT, round_corners=False, round_ends=False)
PORT = Pen(1.2, INK, (6.0, 4.0), round_ends=False)

Polygons = list[list[tuple[float, float]]]


@record
class Place:
    """From the section's millimetres (y across the jaw, z upwards) to pixels: scale, the left edge and the top."""

    scale: float
    left: float
    top: float

    def __call__(self, y: float, z: float) -> Point:
        """A point of the section on the sheet, downwards from y = 0."""
        return Point((y - self.left) * self.scale, (z - self.top) * self.scale)


def cross_section(
    sheet: Sheet, solids: tuple[Solid, ...], spec: SensorSpec, width: float
) -> tuple[float, float, float, float]:
    """Draw the cut through the middle of the array, seen along the jaw, `width` pixels wide, downwards from y = 0;
    the box that it fills with its labels (x0, y0, x1, y1 in pixels, y down).

    With a jaw the opposing jaw is drawn closed on the sensor, and the port's circle about the pair's axis.
    """
    cuts = [(solid, _slice(solid, spec)) for solid in solids]
    cuts = [(solid, polygons) for solid, polygons in cuts if polygons]
    everything = [point for _, polygons in cuts for polygon in polygons for point in polygon]
    y0, y1 = min(p[0] for p in everything), max(p[0] for p in everything)
    z0, z1 = min(p[1] for p in everything), max(p[1] for p in everything)
    port = _port(cuts, spec, z1)
    if port is not None:
        axis, radius, other = port
        y0, y1, z0 = min(y0, -radius), max(y1, radius), min(z0, axis - radius)
        z1 = max(axis + radius, *(point[1] for polygon in other for point in polygon))
    place = Place(width / (y1 - y0), y0, z1)
    if port is not None:
        sheet.draw(_outlines(other, place), AREA, OTHER, "section-opposing-jaw")
    for solid, polygons in cuts:
        sheet.draw(_outlines(polygons, place), AREA, solid.colour, f"section-{solid.name}")
    if port is not None:
        sheet.draw(circle(place(0.0, axis), radius * place.scale), PORT, name="section-port")
    return _labels(sheet, cuts, spec, place, width + 34.0, (z1 - z0) * place.scale)


def _outlines(polygons: Polygons, place: Place) -> list[Path]:
    return [closed_polygon([place(*point) for point in polygon]) for polygon in polygons]


def _slice(solid: Solid, spec: SensorSpec) -> Polygons:
    """The solid's polygons (y, z in mm) in the plane through the middle of the array, across the jaw."""
    centres = [placement.centre[0] for placement in spec.array.placements]
    middle = 1e3 * math.fsum(centres) / len(centres) + 1e-4
    turned = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    cut = manifold(tessellate(solid, CHORD, TURN / 4)).transform(turned).slice(middle)
    return [[tuple(point) for point in np.asarray(polygon).tolist()] for polygon in cut.to_polygons()]


def _port(cuts: list[tuple[Solid, Polygons]], spec: SensorSpec, top: float) -> tuple[float, float, Polygons] | None:
    """The closed pair's axis height and port radius (mm), and the opposing jaw's polygons; None without a jaw."""
    jaw = spec.mount.jaw if spec.mount else None
    if jaw is None:
        return None
    lower = next(polygons for solid, polygons in cuts if solid.role is BodyRole.JAW)
    bottom = min(point[1] for polygon in lower for point in polygon)
    axis = (bottom + top + (jaw.opposing_pad_thickness + jaw.height) * 1e3) / 2
    mirrored = [[(y, 2 * axis - z) for y, z in reversed(polygon)] for polygon in lower]
    if jaw.opposing_pad_thickness > 0.0:
        half, pad = section(jaw).face * 500, jaw.opposing_pad_thickness * 1e3
        mirrored.append([(-half, top), (half, top), (half, top + pad), (-half, top + pad)])
    return axis, jaw.port_diameter * 500, mirrored


def _labels(
    sheet: Sheet, cuts: Sequence[tuple[Solid, Polygons]], spec: SensorSpec, place: Place, x: float, height: float
) -> tuple[float, float, float, float]:
    """Names with thicknesses beside the section, from the top down, each with a line to its layer; the box of all."""
    rows: list[tuple[Point | None, float, str]] = []
    for solid, polygons in cuts:
        levels = [point[1] for polygon in polygons for point in polygon]
        low, high = min(levels), max(levels)
        thick = _thickness(solid, high - low, spec)
        level = high - thick / 2 if _is_film(solid) else (low + high) / 2
        at = place(_right_end(polygons, level), level)
        rows.append((at, -at.y, f"{solid.name}: {solid.material}, {thick:.3g} mm"))
    if spec.mount and spec.mount.jaw:
        rows.append((None, math.inf, f"dashed: {spec.mount.jaw.port_diameter * 1e3:g} mm port, jaws closed"))
    rows.sort(key=lambda row: (row[1], row[2]))
    first = height / 2 - ROW * (len(rows) - 1) / 2
    for index, (at_, _, text) in enumerate(rows):
        down = first + ROW * index
        if at_ is not None:
            sheet.draw(polyline([at_, Point(x - 22.0, at_.y), Point(x - 4.0, -down)]), LEADER)
        sheet.text(x, -down - 4.5, text, LETTERS, colour=INK)
    above, below = first - ROW / 2, first + ROW * (len(rows) - 0.5)
    return 0.0, min(0.0, above), x + 7.2 * max(len(row[2]) for row in rows), max(height, below)


def _right_end(polygons: Polygons, level: float) -> float:
    """The largest y at which a horizontal line at a height crosses the polygons."""
    ends = []
    for polygon in polygons:
        for (ya, za), (yb, zb) in zip(polygon, [*polygon[1:], polygon[0]], strict=True):
            if (za <= level) != (zb <= level):
                ends.append(ya + (yb - ya) * (level - za) / (zb - za))
    return max(ends)


def _is_film(solid: Solid) -> bool:
    return solid.role is BodyRole.ENCAPSULATION


def _thickness(solid: Solid, height: float, spec: SensorSpec) -> float:
    """A layer's thickness in millimetres: its height, except for the film, which goes round the pad."""
    if _is_film(solid) and spec.encapsulation:
        return spec.encapsulation.thickness * 1e3
    return height
