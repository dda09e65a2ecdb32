"""A picture of the board in text: a letter of the braille alphabet shows 2 by 4 dots, so that a hundred columns hold
the turns of a coil. It needs nothing but a font, where pictures cannot be shown: job pages, logs, messages.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sitscad.drawing.pictures.board import Mark
from sitscad.layout.board import Layout

COLUMNS = 96
"""Width of a picture in letters."""

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""The bit of every dot of a braille letter, by row and column (Unicode, chapter 21.1)."""

Points = NDArray[np.float64]


def dot_picture(layout: Layout, marks: Iterable[Mark] = (), columns: int = COLUMNS) -> str:
    """The part with the coils as seen from the top, to scale: its outline, the tracks of layer 1, and the words of
    `marks` at their places. Lines of at most `columns` letters.
    """
    x0, y0, x1, y1 = layout.body
    across = 2 * columns - 1
    step = max(x1 - x0, y1 - y0, 1e-9) / across
    rows = math.ceil((y1 - y0) / step / 4) + 1
    drawn = np.zeros((4 * rows, 2 * columns), dtype=bool)
    paths = [layout.outline, *(trace.path for trace in layout.on_layer(1))]
    places = np.concatenate([_along(np.array(path.flattened(step / 4)), step / 2) for path in paths])
    x, y = np.rint((places[:, 0] - x0) / step), np.rint((y1 - places[:, 1]) / step)
    inside = (x >= 0) & (x < 2 * columns) & (y >= 0) & (y < 4 * rows)
    drawn[y[inside].astype(int), x[inside].astype(int)] = True
    lines = [list(line) for line in _letters(drawn)]
    for mark in marks:
        # Put a word over the picture, wholly inside it; a place outside is left out
        column = int((mark.x - x0) / step) // 2
        row = int((y1 - mark.y) / step) // 4
        if 0 <= row < len(lines) and 0 <= column < len(lines[row]):
            start = min(column, len(lines[row]) - len(mark.text))
            lines[row][start : start + len(mark.text)] = mark.text
    text = ["".join(line).rstrip("\u2800 ") for line in lines]
    while text and not text[-1]:
        text.pop()
    return "\n".join(text)


def _along(corners: Points, step: float) -> Points:
    """Points on a polyline, no further apart than `step`."""
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.linspace(0.0, way[-1], max(2, math.ceil(way[-1] / step) + 1))
    return np.column_stack([np.interp(at, way, corners[:, axis]) for axis in (0, 1)])


def _letters(drawn: NDArray[np.bool_]) -> list[str]:
    """Rows of braille letters for a raster whose sides are multiples of 4 and 2."""
    codes = np.full((drawn.shape[0] // 4, drawn.shape[1] // 2), 0x2800)
    for row, bits in enumerate(_DOTS):
        for column, bit in enumerate(bits):
            codes += bit * drawn[row::4, column::2]
    return ["".join(map(chr, line)) for line in codes]

