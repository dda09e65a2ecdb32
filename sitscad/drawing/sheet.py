"""A drawing sheet: lines, areas and texts in millimetres on paper (origin at the lower left, y upwards), and its SVG.

The same sheet is written as PDF by `_pdf`; both show the same drawing, true to scale when printed unscaled.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

from sitscad.geometry.path import Arc, Line, Path, Point
from sitscad.record import record
from sitscad.units import decimal

A4 = (297.0, 210.0)
"""Landscape, millimetres."""

BLACK, GREY = "#000000", "#808080"

# Widths of Helvetica's characters from the space (code 32) to the tilde (126), in thousandths of the font size.
_WIDTHS = (
    "278 278 355 556 556 889 667 191 333 333 389 584 278 333 278 278 556 556 556 556 556 556 556 556 556 556 278 278 "
    "584 584 584 556 1015 667 667 722 722 667 611 778 722 278 500 667 556 833 722 778 667 778 722 667 611 722 667 944 "
    "667 667 611 278 278 278 469 556 333 556 556 500 556 556 278 556 556 222 222 500 222 833 556 556 556 556 333 500 "
    "278 556 500 722 500 500 500 334 260 334 584"
)
_CHARACTER_WIDTHS = tuple(int(width) for width in _WIDTHS.split())


@record
class Pen:
    """A line's width (mm), colour (``#rrggbb``) and dashes (mm on, mm off, ...)."""

    width: float = 0.25
    colour: str = BLACK
    dashes: tuple[float, ...] = ()


@record
class Shape:
    """Paths (mm) that are drawn, filled, or both; holes are paths of the same shape (even-odd rule)."""

    paths: tuple[Path, ...]
    pen: Pen | None
    fill: str | None


@record
class Label:
    """A text in Helvetica: where (mm), its size (mm), its anchor (``start``, ``middle``, ``end``), its angle (deg)."""

    at: Point
    text: str
    size: float
    anchor: str = "start"
    angle: float = 0.0
    colour: str = BLACK


@dataclass
class Sheet:
    """What is drawn, in the order of drawing."""

    title: str
    size: tuple[float, float] = A4
    items: list[Shape | Label] = field(default_factory=list)

    def draw(self, paths: Path | Iterable[Path], pen: Pen | None = None, fill: str | None = None) -> None:
        """Add paths as one shape."""
        self.items.append(Shape((paths,) if isinstance(paths, Path) else tuple(paths), pen, fill))

    def line(self, x0: float, y0: float, x1: float, y1: float, pen: Pen | None = None) -> None:
        """Add a straight line."""
        self.draw(Path((Line(Point(x0, y0), Point(x1, y1)),)), pen or Pen())

    def text(
        self,
        x: float,
        y: float,
        text: str,
        size: float = 3.0,
        anchor: str = "start",
        angle: float = 0.0,
        colour: str = BLACK,
    ) -> None:
        """Add a text whose base line begins (or ends, or has its middle) at (x, y)."""
        self.items.append(Label(Point(x, y), text, size, anchor, angle, colour))

    def svg(self) -> str:
        """The sheet as self-contained SVG, in millimetres."""
        width, height = self.size
        parts = [
            f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {decimal(width)} {decimal(height)}' "
            f"width='{decimal(width)}mm' height='{decimal(height)}mm' role='img'>",
            f"<title>{escape(self.title)}</title>",
            f"<rect width='{decimal(width)}' height='{decimal(height)}' fill='#ffffff'/>",
            "<g font-family='Helvetica, Arial, sans-serif' stroke-linecap='round' stroke-linejoin='round'>",
            *(_svg_item(item, height) for item in self.items),
            "</g>",
            "</svg>",
        ]
        return "\n".join(parts) + "\n"


def text_width(text: str, size: float) -> float:
    """Width (mm) of a text in Helvetica; characters outside ASCII count as wide as a digit."""
    widths = (_CHARACTER_WIDTHS[ord(c) - 32] if 32 <= ord(c) <= 126 else 556 for c in text)
    return sum(widths) * size / 1000.0


def _svg_item(item: Shape | Label, height: float) -> str:
    if isinstance(item, Label):
        place = f"{decimal(item.at.x)} {decimal(height - item.at.y)}"
        turn = f" rotate({decimal(-item.angle)})" if item.angle else ""
        return (
            f"<text transform='translate({place}){turn}' font-size='{decimal(item.size)}' text-anchor='{item.anchor}' "
            f"fill='{item.colour}'>{escape(item.text)}</text>"
        )
    data = "".join(_svg_path(path, height) for path in item.paths)
    look = f"fill='{item.fill or 'none'}' fill-rule='evenodd'"
    if item.pen is not None:
        look += f" stroke='{item.pen.colour}' stroke-width='{decimal(item.pen.width)}'"
        if item.pen.dashes:
            look += f" stroke-dasharray='{' '.join(decimal(dash) for dash in item.pen.dashes)}'"
    return f"<path d='{data}' {look}/>"


def _svg_path(path: Path, height: float) -> str:
    def xy(point: Point) -> str:
        return f"{decimal(point.x)} {decimal(height - point.y)}"

    data = [f"M{xy(path.start)}"]
    for segment in path:
        if isinstance(segment, Arc) and abs(segment.sweep) > 1e-9:
            radius = decimal(segment.radius)
            large, sweep = int(abs(segment.sweep) > math.pi + 1e-9), int(not segment.ccw)
            if segment.start.distance(segment.end) < 1e-9:  # a full turn, which SVG cannot draw in one piece
                data.append(f"A{radius} {radius} 0 0 {sweep} {xy(segment.at(0.5))}")
                large = 0
            data.append(f"A{radius} {radius} 0 {large} {sweep} {xy(segment.end)}")
        else:
            data.append(f"L{xy(segment.end)}")
    return "".join([*data, "Z"] if path.is_closed else data)
