"""A drawing sheet: lines, areas and texts on paper (origin at the lower left, y upwards), named where a page may point.

The one vocabulary of all pictures: `drawing.svg` and `drawing.pdf` write the same sheet, and both show the same, true
to scale when printed unscaled.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Union

from sitscad.geometry.path import Line, Path, Point, polyline
from sitscad.record import record

A4 = (297.0, 210.0)
"""Landscape, millimetres."""

BLACK = "#000000"

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
    """A line's width (mm), colour (``#rrggbb``), dashes (mm on, mm off, ...), and whether its ends and its corners are
    round: ends are else cut off, corners pointed.
    """

    width: float = 0.25
    colour: str = BLACK
    dashes: tuple[float, ...] = ()
    round_ends: bool = True
    round_corners: bool = True


@record
class Shape:
    """Paths (mm) that are drawn, filled, or both; holes are paths of the same shape (even-odd rule).

    ``opacity`` is the filling's; ``name`` is what a page points at (its id), ``kind`` what a style sheet calls it.
    """

    paths: tuple[Path, ...]
    pen: Pen | None
    fill: str | None
    name: str = ""
    opacity: float = 1.0
    kind: str = ""


@record
class Label:
    """A text in Helvetica: where (mm), its size (mm), its anchor (``start``, ``middle``, ``end``), its angle (deg).

    ``halo`` is the width (mm) of a white line round its letters, half of which they cover.
    """

    at: Point
    text: str
    size: float
    anchor: str = "start"
    angle: float = 0.0
    colour: str = BLACK
    halo: float = 0.0
    bold: bool = False


@record
class Group:
    """Items that belong together: under a name that a page can point at, moved by ``offset`` (mm), and no more of them
    shown than lies in ``window`` (x0, y0, x1, y1 in mm, after moving). A ``layer`` is one for drawing programs, too.
    """

    name: str
    items: tuple[Item, ...]
    offset: tuple[float, float] = (0.0, 0.0)
    window: tuple[float, float, float, float] | None = None
    kind: str = ""
    layer: bool = False


Item = Union[Shape, Label, Group]  # noqa: UP007  (the alias is used before it is complete)


@dataclass
class Sheet:
    """What is drawn, in the order of drawing; a ground of None is the page's own.

    Millimetres on paper, or pixels on a screen where ``unit`` is empty: then all lengths of pens, shapes and labels
    are pixels, too. ``decimals`` are those that coordinates are written with.
    """

    title: str
    size: tuple[float, float] = A4
    items: list[Item] = field(default_factory=list)
    unit: str = "mm"
    decimals: int = 4
    ground: str | None = "#ffffff"
    font: str = "Helvetica, Arial, sans-serif"
    kind: str = ""

    def draw(
        self, paths: Path | Iterable[Path], pen: Pen | None = None, fill: str | None = None, name: str = "",
        opacity: float = 1.0, kind: str = "",
    ) -> None:
        """Add paths as one shape."""
        drawn = (paths,) if isinstance(paths, Path) else tuple(paths)
        self.items.append(Shape(drawn, pen, fill, name, opacity, kind))

    def line(self, x0: float, y0: float, x1: float, y1: float, pen: Pen | None = None) -> None:
        """Add a straight line."""
        self.draw(Path((Line(Point(x0, y0), Point(x1, y1)),)), pen or Pen())

    def text(
        self, x: float, y: float, text: str, size: float = 3.0, anchor: str = "start", angle: float = 0.0,
        colour: str = BLACK, halo: float = 0.0, bold: bool = False,
    ) -> None:
        """Add a text whose base line begins (or ends, or has its middle) at (x, y)."""
        self.items.append(Label(Point(x, y), text, size, anchor, angle, colour, halo, bold))

    @contextmanager
    def group(
        self, name: str = "", offset: tuple[float, float] = (0.0, 0.0),
        window: tuple[float, float, float, float] | None = None, kind: str = "", layer: bool = False,
    ) -> Iterator[None]:
        """What is added within is one group."""
        outer, self.items = self.items, []
        try:
            yield
        finally:
            inner, self.items = self.items, outer
        self.items.append(Group(name, tuple(inner), offset, window, kind, layer))


def flattened(items: Iterable[Item]) -> Iterator[Shape | Label]:
    """All shapes and labels in their order, out of their groups; those of groups stand where they were drawn."""
    for item in items:
        if isinstance(item, Group):
            yield from flattened(item.items)
        else:
            yield item


def text_width(text: str, size: float) -> float:
    """Width (mm) of a text in Helvetica; characters outside ASCII count as wide as a digit."""
    widths = (_CHARACTER_WIDTHS[ord(c) - 32] if 32 <= ord(c) <= 126 else 556 for c in text)
    return sum(widths) * size / 1000.0


ADVANCE = 6.0
HEIGHT = 6.0

# Each glyph is strokes, each stroke its corners, each corner its two digits: column 0 to 4, row 0 to 6.
_GLYPHS = {
    "0": "0040460600 0046", "1": "152620 1030", "2": "064643030040", "3": "06464000 0343", "4": "060343 4640",
    "5": "460603434000", "6": "460600404303", "7": "064620", "8": "0040460600 0343", "9": "430306464000",
    "A": "0004264440 0343", "B": "00063645443303 3342413000", "C": "46060040", "D": "00062644422000",
    "E": "46060040 0333", "F": "460600 0333", "G": "460600404323", "H": "0006 4046 0343", "I": "1030 2026 1636",
    "J": "4641301001", "K": "0006 460340", "L": "060040", "M": "0006234640", "N": "00064046", "O": "0040460600",
    "P": "0006464303", "Q": "0040460600 2240", "R": "0006464303 2340", "S": "460603434000", "T": "0646 2620",
    "U": "06004046", "V": "062046", "W": "0610243046", "X": "0046 0640", "Y": "062346 2320", "Z": "06460040",
    "-": "1333", ".": "2021", "_": "0040", "/": "0046", "=": "0242 0444", "+": "0343 2125", ":": "2122 2425",
    ",": "2110", "(": "36252130", ")": "16252110",
}


def strokes(text: str, at: Point, height: float) -> Iterator[Path]:
    """The strokes of a text whose lower left corner is `at`, capitals `height` high (m); small letters are capitals.

    Raises KeyError for a character that the font has not; a space is one advance.
    """
    unit = height / HEIGHT
    for i, character in enumerate(text.upper()):
        if character == " ":
            continue
        left = at.x + i * ADVANCE * unit
        for stroke in _GLYPHS[character].split():
            corners = zip(stroke[::2], stroke[1::2], strict=True)
            yield polyline([Point(left + int(x) * unit, at.y + int(y) * unit) for x, y in corners])


def length(text: str, height: float) -> float:
    """How long a text is (m), without the gap after its last character."""
    return (len(text) * ADVANCE - 2.0) * height / HEIGHT
