"""The picture of a drawn coil's conductor: runs in the colours of their layers, terminals and vias."""

from __future__ import annotations

from sitscad.basics.units import show
from sitscad.files.drawing.frame import View
from sitscad.files.drawing.pictures.layout_picture import COLOURS, RING
from sitscad.files.drawing.sheet import Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.kernels.geometry.path import Path, Point, bounding_box, circle
from sitscad.layout.drawn.follow import DrawnConductor

SIDE, MARGIN, ROW, LETTERS = 900.0, 40.0, 26.0, 16.0
"""Width of the picture, its margin, row height of the legend, and letter height (pixels)."""


def conductor_svg(conductor: DrawnConductor) -> str:
    """Return a picture as SVG text, seen from the top, lower layers first."""
    x0, y0, x1, y1 = bounding_box([run.path for run in conductor.runs])
    scale = (SIDE - 2.0 * MARGIN) / max(x1 - x0, y1 - y0, 1e-6)
    layers = list(dict.fromkeys(run.layer for run in conductor.runs))
    low = ROW * (len(layers) + 1) + MARGIN
    view = View(scale / 1e3, (MARGIN - x0 * scale, low + MARGIN - y0 * scale))
    sheet = Sheet("conductor of the coil, seen from the top", (SIDE, (y1 - y0) * scale + 2.0 * MARGIN + low), unit="",
                  decimals=2)
    colours = {layer: COLOURS[k % len(COLOURS)] for k, layer in enumerate(layers)}
    for run in reversed(conductor.runs):
        for segment, width in zip(run.path, run.widths, strict=True):
            sheet.draw(view.path(Path((segment,))), Pen(view.length(width), colours[run.layer]))
    for via in conductor.vias:
        at = Point(view.x(via.centre.x), view.y(via.centre.y))
        sheet.draw(circle(at, view.length(min(via.size)) / 2.0), None, RING)
    ends = conductor.runs[0].path.start, conductor.runs[-1].path.end
    for place, name in zip(ends, conductor.ends, strict=True):
        at = Point(view.x(place.x), view.y(place.y))
        sheet.draw(circle(at, 7.0), Pen(2.5, "#222222"))
        sheet.text(at.x + 11.0, at.y + 5.0, name, LETTERS, halo=4.0)
    turns = conductor.turns()
    for k, layer in enumerate(layers):
        y = low - ROW * (k + 1)
        sheet.line(MARGIN, y + 5.0, MARGIN + 30.0, y + 5.0, Pen(8.0, colours[layer]))
        count = sum(number for name, number in turns if name == layer)
        sheet.text(MARGIN + 42.0, y, f"{layer}: {count:+.2f} turns (counter-clockwise positive)", LETTERS)
    sheet.text(SIDE - MARGIN, low - ROW, f"{show(x1 - x0, 'm', 3)} x {show(y1 - y0, 'm', 3)}", LETTERS, "end")
    return svg(sheet)
