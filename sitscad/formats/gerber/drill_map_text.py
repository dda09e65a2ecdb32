"""The drill map as a Gerber drawing: every hole with its tool's symbol, and a table of the tools below the board."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sitscad.drawing.drill_symbols import SYMBOLS
from sitscad.drawing.stroke_font import strokes
from sitscad.fabrication.files import UNIT, DrilledHole, Tool, millimetres
from sitscad.formats.gerber.image import mm, stroke
from sitscad.geometry.path import Path, Point, bounding_box

PEN = 0.05e-3
TEXT_PEN = 0.1e-3
LINE = 2.0e-3
"""From line to line of the table (m)."""
TEXT_HEIGHT = 1.0e-3


def symbol_size(hole: DrilledHole) -> float:
    """Radius (m) of a hole's symbol: seen even where the hole is small."""
    return max(hole.diameter * UNIT, 0.25e-3) / 2.0


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
