"""SVG for laser cutters: one file a sheet, millimetres, hairlines, one group a layer."""

from __future__ import annotations

from sitscad.drawing.frame import FORCED
from sitscad.drawing.sheet import Pen, Sheet
from sitscad.drawing.svg import svg
from sitscad.geometry.path import Path, Point, circle
from sitscad.layout.board import Layout
from sitscad.layout.laser_sheet import LOOKS, TEXT_HEIGHT, Contour, CutLayer, LaserSheet
from sitscad.scene.stack import sheets

MM = 1e3
HAIRLINE = 0.01
"""Width (mm) of a line that drivers take for a vector to follow and not for an area to raster: below 0.001 inch."""


def render(layout: Layout, forced: str = "") -> dict[str, bytes]:
    """``laser/NAME-elastomer.svg``, the same of the target and of the shield, of those parts that the spec has; with a
    note that says so where ``forced`` is not empty.

    Raises ValueError for a kerf that cannot be compensated.
    """
    name, found = layout.spec.name, sheets(layout, FORCED if forced else "")
    return {f"laser/{name}-{sheet.name}.svg": drawing(sheet, name).encode("utf-8") for sheet in found}


def drawing(cut: LaserSheet, name: str) -> str:
    """The whole SVG of one sheet, y pointing down; coordinates to the nanometre."""
    size = cut.width * MM, cut.height * MM
    sheet = Sheet(f"{name} {cut.part}", size, decimals=6, ground=None, font="sans-serif")
    for layer in CutLayer:
        pen = Pen(HAIRLINE, LOOKS[layer].rgb)
        with sheet.group(layer, layer=True):
            for contour in cut.on(layer):
                sheet.draw(_outline(contour), pen)
            if layer is CutLayer.REF:
                for place, text in cut.notes:
                    sheet.text(place.x * MM, place.y * MM, text, TEXT_HEIGHT * MM, colour=LOOKS[layer].rgb)
    return svg(sheet)


def _outline(contour: Contour) -> Path:
    """A contour in millimetres; one that is a circle is written as such."""
    if contour.diameter is not None:
        return circle(_mm(contour.centre), contour.diameter / 2 * MM)
    return contour.path.mapped(_mm)


def _mm(point: Point) -> Point:
    return Point(point.x * MM, point.y * MM)
