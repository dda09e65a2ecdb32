"""Sheets as SVG without scripts, style sheets or external resources. Equal sheets give equal text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import partial
from html import escape as html_escape

from sitscad.basics.units import fixed_decimals
from sitscad.files.drawing.sheet import Group, Item, Label, Shape, Sheet, text_width
from sitscad.kernels.geometry.path import TWO_PI, Arc, Path, Point

LINE = 30
"""Number of characters above which the width of a text is fixed in the SVG (`textLength`).

Otherwise the notes on a drawing run over its frame if a viewer has only a wider substitute for Helvetica.
"""
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
escape = partial(html_escape, quote=False)


def svg(sheet: Sheet) -> str:
    """Return the sheet as SVG text, in its own unit, with y downwards."""
    paper = _Paper(sheet.size[1], sheet.decimals)
    width, height = (paper.number(side) for side in sheet.size)
    unit = sheet.unit
    layers = f" xmlns:inkscape='{INKSCAPE}'" if any(isinstance(i, Group) and i.layer for i in sheet.items) else ""
    kind = f" class='{sheet.kind}'" if sheet.kind else ""
    rows = [
        f"<svg xmlns='http://www.w3.org/2000/svg'{layers}{kind} viewBox='0 0 {width} {height}' "
        f"width='{width}{unit}' height='{height}{unit}' role='img'>",
        f"<title>{escape(sheet.title)}</title>",
        *([f"<rect width='{width}' height='{height}' fill='{sheet.ground}'/>"] if sheet.ground else []),
        f"<g font-family='{sheet.font}' stroke-linecap='round' stroke-linejoin='round'>",
        *paper.items(sheet.items),
        "</g>",
        "</svg>",
    ]
    return "\n".join(rows) + "\n"


def path_data(path: Path, height: float, decimals: int) -> str:
    """Return the ``d`` attribute of a path, with y measured down from `height`.

    A straight last segment of a closed path is left out, because the final ``Z`` draws it.
    """
    paper = _Paper(height, decimals)
    data = [f"M{paper.xy(path.start)}"]
    for i, segment in enumerate(path.segments):
        if isinstance(segment, Arc) and abs(segment.sweep) > 1e-9:
            radius, is_long = paper.number(segment.radius), abs(segment.sweep) > math.pi + 1e-9
            data.append(f"A{radius} {radius} 0 {int(is_long)} {int(not segment.ccw)} {paper.xy(segment.end)}")
        elif not (path.is_closed and i + 1 == len(path.segments)):
            data.append(f"L{paper.xy(segment.end)}")
    return "".join([*data, "Z"] if path.is_closed else data)


class _Paper:
    """Conversion of a sheet's coordinates and items to SVG.

    `height` is the height of the sheet, `decimals` the decimals of coordinates.
    """

    def __init__(self, height: float, decimals: int) -> None:
        self.height, self.decimals = height, decimals

    def number(self, value: float) -> str:
        return fixed_decimals(value, self.decimals)

    def xy(self, point: Point) -> str:
        return f"{self.number(point.x)} {self.number(self.height - point.y)}"

    def items(self, items: Iterable[Item]) -> Iterator[str]:
        """Yield the SVG lines of all items. A group's tags enclose its items."""
        for item in items:
            if isinstance(item, Group):
                yield from self.group(item)
            else:
                yield self.label(item) if isinstance(item, Label) else self.shape(item)

    def group(self, group: Group) -> Iterator[str]:
        """Yield the SVG lines of a group. A window becomes a nested `<svg>`, which clips to that rectangle in place."""
        layer = f" inkscape:groupmode='layer' inkscape:label='{_escaped_attribute(group.name)}'" if group.layer else ""
        moved = ""
        if group.offset != (0.0, 0.0):
            moved = f" transform='translate({self.number(group.offset[0])} {self.number(-group.offset[1])})'"
        if group.window is not None:
            x0, y0, x1, y1 = group.window
            x, y, wide, high = (self.number(value) for value in (x0, self.height - y1, x1 - x0, y1 - y0))
            yield f"<svg x='{x}' y='{y}' width='{wide}' height='{high}' viewBox='{x} {y} {wide} {high}'>"
        yield f"<g{_name_attributes(group.name, group.kind)}{layer}{moved}>"
        yield from self.items(group.items)
        yield "</g>"
        if group.window is not None:
            yield "</svg>"

    def label(self, label: Label) -> str:
        turn = f" rotate({self.number(-label.angle)})" if label.angle else ""
        look = ""
        if label.halo:
            look += f" stroke='#ffffff' stroke-width='{self.number(label.halo)}' paint-order='stroke'"
        if label.bold:
            look += " font-weight='bold'"
        elif len(label.text) > LINE:
            look += f" textLength='{self.number(text_width(label.text, label.size))}' lengthAdjust='spacingAndGlyphs'"
        return (
            f"<text transform='translate({self.xy(label.at)}){turn}' font-size='{self.number(label.size)}' "
            f"text-anchor='{label.anchor}' fill='{label.colour}'{look}>{escape(label.text)}</text>"
        )

    def shape(self, shape: Shape) -> str:
        look = f" fill='{shape.fill or 'none'}'"
        if shape.fill:
            look += " fill-rule='evenodd'"
        if shape.opacity != 1.0:
            look += f" fill-opacity='{fixed_decimals(shape.opacity)}'"
        named, pen = _name_attributes(shape.name, shape.kind), shape.pen
        if pen is not None:  # The sheet's outer group sets round ends and corners
            look += f" stroke='{pen.colour}' stroke-width='{self.number(pen.width)}'"
            look += f" stroke-dasharray='{' '.join(map(self.number, pen.dashes))}'" if pen.dashes else ""
            look += "" if pen.round_ends else " stroke-linecap='butt'"
            look += "" if pen.round_corners else " stroke-linejoin='miter'"
        round_one = _as_circle(shape.paths) if pen is None or not pen.dashes else None
        if round_one is not None:
            centre, radius = round_one
            x, y, r = (self.number(value) for value in (centre.x, self.height - centre.y, radius))
            return f"<circle{named} cx='{x}' cy='{y}' r='{r}'{look}/>"
        data = "".join(path_data(path, self.height, self.decimals) for path in shape.paths)
        return f"<path{named} d='{data}'{look}/>"


def _as_circle(paths: tuple[Path, ...]) -> tuple[Point, float] | None:
    """Return centre and radius if the paths are a single full circle, otherwise None."""
    first = paths[0].segments[0] if len(paths) == 1 else None
    if not isinstance(first, Arc):
        return None
    arcs = [segment for segment in paths[0] if isinstance(segment, Arc) and segment.centre == first.centre]
    turn = sum(arc.sweep for arc in arcs)
    is_whole = len(arcs) == len(paths[0].segments) and abs(abs(turn) - TWO_PI) < 1e-9
    return (first.centre, first.radius) if is_whole else None


def _name_attributes(name: str, kind: str) -> str:
    ident = f" id='{_escaped_attribute(name)}'" if name else ""
    return ident + (f" class='{_escaped_attribute(kind)}'" if kind else "")


def _escaped_attribute(text: str) -> str:
    return escape(text).replace("'", "&apos;")
