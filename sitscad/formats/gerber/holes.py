"""Holes as files: Excellon in the XNC manner (metric, explicit decimal points, drilling only, X2 attributes in
comments), and the drill map as a Gerber drawing, every hole with its tool's symbol, with a table of the tools below
the board.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from sitscad.drawing.frame import SYMBOLS
from sitscad.drawing.sheet import strokes
from sitscad.fabrication.files import UNIT, DrilledHole, Tool, millimetres, tools_of
from sitscad.formats.gerber.image import mm, stroke
from sitscad.geometry.path import Path, Point, bounding_box


def drill_text(
    title: str, function: str, attributes: Iterable[tuple[str, ...]], holes: Sequence[DrilledHole], use: str
) -> bytes:
    """A drill file: ``function`` is its X2 file function, ``use`` what the holes are for (``ViaDrill``)."""
    return ("\n".join(_lines(title, function, attributes, holes, use)) + "\n").encode("ascii")


def _lines(
    title: str, function: str, attributes: Iterable[tuple[str, ...]], holes: Sequence[DrilledHole], use: str
) -> Iterator[str]:
    plating, *_, kind = function.split(",")
    tools = tools_of(holes)
    yield from ("M48", f"; {title}, tool sizes are finished holes")
    for attribute in (*attributes, (".FileFunction", function)):
        yield f"; #@! TF{','.join(attribute)}"
    yield from ("METRIC", ";TYPE=PLATED" if plating == "Plated" else ";TYPE=NON_PLATED")
    for code, (diameter, _) in enumerate(tools, 1):
        yield from (f"; #@! TA.AperFunction,{plating},{kind},{use}", f"T{code}C{millimetres(diameter, 3)}")
    yield from ("%", "G05")
    for code, (_, drilled) in enumerate(tools, 1):
        yield f"T{code}"
        yield from (f"X{millimetres(hole.x)}Y{millimetres(hole.y)}" for hole in drilled)
    yield "M30"


PEN = 0.05e-3
TEXT_PEN = 0.1e-3
LINE = 2.0e-3
"""From line to line of the table (m)."""
TEXT_HEIGHT = 1.0e-3


def map_text(outline: Path, tools: Sequence[Tool]) -> Iterator[str]:
    """The body of a drill map: outline, holes, table."""
    yield from ("%TA.AperFunction,Drawing*%", f"%ADD10C,{mm(PEN)}*%", f"%ADD11C,{mm(TEXT_PEN)}*%", "%TD*%", "D10*")
    yield from stroke(outline)
    for order, tool in enumerate(tools):
        for hole in tool.holes:
            at = Point(hole.x * UNIT, hole.y * UNIT)
            for path in SYMBOLS[order % len(SYMBOLS)](at, max(hole.diameter * UNIT, 0.25e-3) / 2.0):
                yield from stroke(path)
    x0, y0, _, _ = bounding_box([outline])
    yield "D11*"
    for order, tool in enumerate(tools):
        at = Point(x0 + LINE / 2, y0 - (order + 1) * LINE)
        words = f"{millimetres(tool.diameter, 3)} MM {len(tool.holes)} {tool.words.upper()}, FINISHED"
        text = strokes(words, at.shifted(LINE, -TEXT_HEIGHT / 2), TEXT_HEIGHT)
        for path in (*SYMBOLS[order % len(SYMBOLS)](at, TEXT_HEIGHT / 2), *text):
            yield from stroke(path)
