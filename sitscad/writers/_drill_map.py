"""The drill map as a Gerber drawing: every hole with its tool's symbol, and a table of the tools below the board."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from sitscad.geometry.path import Path, Point, bounding_box, circle, closed_polygon, polyline
from sitscad.writers._excellon_text import UNIT, DrilledHole, millimetres
from sitscad.writers._fabrication_files import FabricationFile
from sitscad.writers._gerber_image import mm, stroke
from sitscad.writers._holes import Tool
from sitscad.writers._stroke_font import strokes

PEN = 0.05e-3
TEXT_PEN = 0.1e-3
LINE = 2.0e-3
"""From line to line of the table (m)."""
TEXT_HEIGHT = 1.0e-3

Symbol = Callable[[Point, float], tuple[Path, ...]]


def _polygon(sides: int, turn: float) -> Symbol:
    def symbol(at: Point, radius: float) -> tuple[Path, ...]:
        angles = [turn + 2.0 * math.pi * i / sides for i in range(sides)]
        return (closed_polygon([Point(at.x + radius * math.cos(a), at.y + radius * math.sin(a)) for a in angles]),)

    return symbol


def _cross(turn: float) -> Symbol:
    def symbol(at: Point, radius: float) -> tuple[Path, ...]:
        arms = [(radius * math.cos(turn + q), radius * math.sin(turn + q)) for q in (0.0, math.pi / 2)]
        return tuple(polyline([Point(at.x - x, at.y - y), Point(at.x + x, at.y + y)]) for x, y in arms)

    return symbol


def _ring(at: Point, radius: float) -> tuple[Path, ...]:
    return (circle(at, radius), *_cross(0.0)(at, radius))


SYMBOLS: tuple[Symbol, ...] = (
    _cross(0.0),
    _cross(math.pi / 4),
    _polygon(4, 0.0),
    _polygon(4, math.pi / 4),
    _polygon(3, math.pi / 2),
    _ring,
)
"""One symbol a tool, in the order of the tools; used again from the first where there are more tools."""


def symbol_size(hole: DrilledHole) -> float:
    """Radius (m) of a hole's symbol: seen even where the hole is small."""
    return max(hole.diameter * UNIT, 0.25e-3) / 2.0


def map_file(path: str) -> FabricationFile:
    """What a drill map is called in the set."""
    return FabricationFile(path, "Drillmap", "Positive", "drill map")


def map_text(outline: Path, tools: Sequence[Tool]) -> Iterator[str]:
    """The body of a drill map: outline, holes, table."""
    yield from ("%TA.AperFunction,Drawing*%", f"%ADD10C,{mm(PEN)}*%", f"%ADD11C,{mm(TEXT_PEN)}*%", "%TD*%", "D10*")
    yield from stroke(outline)
    for order, tool in enumerate(tools):
        for hole in tool.holes:
            at = Point(hole.x * UNIT, hole.y * UNIT)
            for path in SYMBOLS[order % len(SYMBOLS)](at, symbol_size(hole)):
                yield from stroke(path)
    x0, y0, _, _ = bounding_box([outline])
    yield "D11*"
    for order, tool in enumerate(tools):
        at = Point(x0 + LINE / 2, y0 - (order + 1) * LINE)
        words = f"{millimetres(tool.diameter, 3)} MM {len(tool.holes)} {tool.words.upper()}, FINISHED"
        text = strokes(words, at.shifted(LINE, -TEXT_HEIGHT / 2), TEXT_HEIGHT)
        for path in (*SYMBOLS[order % len(SYMBOLS)](at, TEXT_HEIGHT / 2), *text):
            yield from stroke(path)
