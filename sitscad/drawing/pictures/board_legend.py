"""The legend under a picture of the layout: a scale bar, and a key for every colour and line that the picture shows."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from sitscad.drawing.frame import View
from sitscad.drawing.sheet import Pen, Sheet
from sitscad.geometry.path import Point, bounding_box, circle, polyline, rectangle
from sitscad.layout.board import Layout
from sitscad.scene.tail_path import bends
from sitscad.units import show

COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#8c564b", "#5f5f5f")
"""One colour a copper layer, from the top (after Okabe and Ito's palette)."""

PLATE, CONTACT, RING = "#cdb380", "#e6b800", "#8a8a8a"
TAKEN = "#dfd3ad"
"""What the bend takes of the tail."""
TOP_OPENING, BOTTOM_OPENING, BEND = "#1b7837", "#762a83", "#444444"
TOP_DASHES, BOTTOM_DASHES, BEND_DASHES = "8 4", "2 5", "14 4 3 4 3 4"
WIDTH = 1200.0
"""Width of a picture in pixels."""
ROW, LETTERS, IN_A_ROW = 30.0, 16.0, 6
"""Height of a row and of its letters (pixels), and the keys in it."""


class Mark(NamedTuple):
    """A place to point at: metres on the board, the number or word beside it, and what it is (a key of `MARKS`)."""

    x: float
    y: float
    text: str
    kind: str


MARKS = {"error": "#d00000", "warning": "#b35900", "note": "#0050b3"}
"""The colours of marks."""

Sign = Callable[[Sheet, float, float], None]
"""Draws a key's sign on a sheet, its upper left corner at (x, y)."""


def colour(layer: int) -> str:
    """A copper layer's colour."""
    return COLOURS[(layer - 1) % len(COLOURS)]


def legend_keys(layout: Layout, shown: list[int], view: View, marks: list[Mark]) -> list[tuple[Sign, str]]:
    """A sign and its meaning for everything that the picture shows."""
    plate = layout.stiffener

    def sees(x: float) -> bool:
        return 0.0 <= view.x(x) <= WIDTH

    keys = [(_swatch(colour(layer)), f"copper {layer}") for layer in shown]
    if any(pad.layer in shown and sees(pad.centre.x) for pad in layout.pads):
        keys.append((_swatch(CONTACT), "contacts"))
    if any(sees(via.centre.x) for via in layout.vias):
        keys.append((_swatch(RING), "vias"))
    if any(sees(opening.outline.start.x) for opening in layout.top_openings):
        keys.append((_line(TOP_OPENING, TOP_DASHES), "top coverlay open"))
    if any(sees(opening.outline.start.x) for opening in layout.bottom_openings):
        keys.append((_line(BOTTOM_OPENING, BOTTOM_DASHES), "bottom coverlay open"))
    if plate is not None and sees(plate.outline.outline.start.x):
        keys.append((_swatch(PLATE), f"stiffener {show(plate.thickness, 'm')}"))
    seen = [bend for bend in bends(layout) if sees(bend.line)]
    words = dict.fromkeys(f"bend {math.degrees(bend.angle):.4g} deg {bend.direction}" for bend in seen)
    keys += [(_line(BEND, BEND_DASHES), each) for each in words]
    if any(bend.end > bend.start for bend in seen):
        keys.append((_swatch(TAKEN), "taken by bends" if len(seen) > 1 else "taken by the bend"))
    return keys + [
        (_ring(MARKS[kind]), f"{kind}, numbered") for kind in MARKS if any(mark.kind == kind for mark in marks)
    ]


def legend_height(layout: Layout, keys: list[tuple[Sign, str]]) -> float:
    """The room (pixels) that the legend takes at the lower edge."""
    return ROW * (bool(layout.spec.issue.words) + 1 + math.ceil(len(keys) / IN_A_ROW)) + 20.0


def draw_legend(sheet: Sheet, layout: Layout, view: View, keys: list[tuple[Sign, str]], height: float) -> None:
    """Part number and issue where there are any, the scale bar with the sizes in words, then the keys, six to a row."""
    top = height - 10.0
    if words := layout.spec.issue.words:
        sheet.text(WIDTH - 20.0, top - 17.0, words, LETTERS, "end")
        top -= ROW
    _scale_bar(sheet, layout, view, top)
    for i, (sign, text) in enumerate(keys):
        row, column = divmod(i, IN_A_ROW)
        x, y = 20.0 + 195.0 * column, top - ROW * (row + 1)
        sign(sheet, x, y)
        sheet.text(x + 34.0, y - 17.0, text, LETTERS)


def _scale_bar(sheet: Sheet, layout: Layout, view: View, top: float) -> None:
    """A bar of a round length near a sixth of the picture, and the sizes in words."""
    length = _round_below(WIDTH / view.length(1.0) / 6)
    end = 20.0 + view.length(length)
    body, board = layout.body_size, bounding_box([layout.outline])
    sizes = (
        f"{layout.spec.name}: body {show(body[0], 'm')} x {show(body[1], 'm')}, "
        f"board {show(board[2] - board[0], 'm')} x {show(board[3] - board[1], 'm')}, seen from the top"
    )
    bar = (((20.0, 8.0), (20.0, 16.0)), ((20.0, 12.0), (end, 12.0)), ((end, 8.0), (end, 16.0)))
    strokes = [polyline([Point(x, top - down) for x, down in ends]) for ends in bar]
    sheet.draw(strokes, Pen(2.0, round_ends=False), kind="scale")
    sheet.text(end + 10.0, top - 17.0, show(length, "m"), LETTERS)
    sheet.text(WIDTH - 20.0, top - 17.0, sizes, LETTERS, "end")


def _round_below(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `length`."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(f * power for f in (1.0, 2.0, 5.0) if f * power <= length * (1 + 1e-9))


def _swatch(fill: str) -> Sign:
    return lambda sheet, x, y: sheet.draw(rectangle(x, y - 18.0, x + 26.0, y - 4.0), None, fill)


def _ring(ink: str) -> Sign:
    return lambda sheet, x, y: sheet.draw(circle(Point(x + 13.0, y - 11.0), 8.0), Pen(3.0, ink))


def _line(ink: str, dashes: str) -> Sign:
    pen = Pen(2.0, ink, tuple(map(float, dashes.split())), round_ends=False)
    return lambda sheet, x, y: sheet.line(x, y - 11.0, x + 26.0, y - 11.0, pen)
