"""SVG for laser cutters: one file a sheet, millimetres, hairlines, one group a layer."""

from __future__ import annotations

import math
from xml.sax.saxutils import escape, quoteattr

from sitscad.geometry.path import Arc, Path, Point
from sitscad.layout.board import Layout
from sitscad.layout.cutting.laser_sheet import LOOKS, TEXT_HEIGHT, Contour, CutLayer, LaserSheet, laser_sheets
from sitscad.units import in_mm

# A line that drivers take for a vector to follow and not for an area to raster: below 0.001 inch.
HAIRLINE = 0.01


def render(layout: Layout) -> dict[str, bytes]:
    """``laser/NAME-elastomer.svg`` and ``laser/NAME-target.svg``, of those parts that the spec has.

    Raises ValueError for a kerf that cannot be compensated.
    """
    name = layout.spec.name
    return {f"laser/{name}-{sheet.part}.svg": drawing(sheet, name).encode("utf-8") for sheet in laser_sheets(layout)}


def drawing(sheet: LaserSheet, name: str) -> str:
    """The whole SVG of one sheet, y pointing down."""
    width, height = _number(sheet.width), _number(sheet.height)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">',
        f"<title>{escape(f'{name} {sheet.part}')}</title>",
    ]
    for layer in CutLayer:
        lines += _group(sheet, layer)
    return "\n".join([*lines, "</svg>"]) + "\n"


def _group(sheet: LaserSheet, layer: CutLayer) -> list[str]:
    head = (
        f'<g id="{layer}" inkscape:groupmode="layer" inkscape:label="{layer}" fill="none" '
        f'stroke="{LOOKS[layer].rgb}" stroke-width="{HAIRLINE}">'
    )
    rows = [f"  {_shape(contour, sheet.height)}" for contour in sheet.on(layer)]
    if layer is CutLayer.REF:
        rows += [f"  {_note(place, text, sheet.height)}" for place, text in sheet.notes]
    return [head, *rows, "</g>"]


def _shape(contour: Contour, height: float) -> str:
    if contour.diameter is not None:
        centre = contour.centre
        return (
            f'<circle cx="{_number(centre.x)}" cy="{_number(height - centre.y)}" r="{_number(contour.diameter / 2)}"/>'
        )
    return f'<path d="{path_data(contour.path, height)}"/>'


def path_data(path: Path, height: float) -> str:
    """The ``d`` of a path in millimetres, y measured down from `height` (m)."""
    parts = [f"M {_point(path.start, height)}"]
    for i, segment in enumerate(path.segments):
        if isinstance(segment, Arc):
            radius, large = _number(segment.radius), int(abs(segment.sweep) > math.pi)
            parts.append(f"A {radius} {radius} 0 {large} {int(not segment.ccw)} {_point(segment.end, height)}")
        elif not (path.is_closed and i == len(path.segments) - 1):
            parts.append(f"L {_point(segment.end, height)}")
    return " ".join([*parts, "Z"] if path.is_closed else parts)


def _note(place: Point, text: str, height: float) -> str:
    x, y = _number(place.x), _number(height - place.y)
    style = f'font-family="sans-serif" font-size="{_number(TEXT_HEIGHT)}" fill={quoteattr(LOOKS[CutLayer.REF].rgb)}'
    return f'<text x="{x}" y="{y}" {style} stroke="none">{escape(text)}</text>'


def _point(point: Point, height: float) -> str:
    return f"{_number(point.x)} {_number(height - point.y)}"


def _number(metres: float) -> str:
    return in_mm(metres, 6)
