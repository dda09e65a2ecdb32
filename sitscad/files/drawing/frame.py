"""Frame, title block, standard scales and coordinate dimensions of drawings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import accumulate, pairwise

from sitscad.basics.units import in_mm
from sitscad.basics.version import __version__
from sitscad.files.drawing.sheet import BLACK, Pen, Sheet, text_width
from sitscad.kernels.geometry.path import Path, Point, circle, closed_polygon, polar, polyline, rectangle
from sitscad.spec.yaml.source import Issue

MARGIN = 8.0
FORCED = "MADE IN SPITE OF ERRORS, NOT FOR ORDER"
"""Stamp on the drawings of a package with errors."""
RED = "#b00000"
BLOCK = (118.0, 30.0)  # The title block at the lower right, millimetres on paper
ISSUE = (("Part no.", "Part number"), ("Rev.", "Revision"), ("Date", "Date"))
"""Cells on the issue of the design in the title block: label, and name of the row in `spec.issue`."""
ISSUE_CELLS = (58.0, 26.0, 34.0)  # Their widths (mm)
NOT_STATED = "not stated"

SCALES = (50.0, 20.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.0, 0.5, 0.2, 0.1)
DETAIL_SCALES = (50.0, 40.0, 30.0, 25.0, 20.0, 15.0, 12.0, 10.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0)
"""Scales for enlarged details. They have finer steps than `SCALES`, so that a detail fills more of its room."""
THICK, THIN, HIDDEN = Pen(0.5), Pen(0.18), Pen(0.18, BLACK, (1.2, 0.8))
CHAIN = Pen(0.18, "#555555", (4.0, 0.8, 0.8, 0.8))
TEXT = 2.6
SMALLEST = 1.5  # Letters that can still be read on paper (mm)
INDENT = 3.0  # Indent of a paragraph's lines after the first (mm)
SUBSTITUTE = 1.08
"""Largest expected width of a text in a substitute font, over its width in Helvetica.

SVG viewers without Helvetica use a substitute. With rsvg and Noto Sans, a ratio of 1.07 was measured.
"""


def new_sheet(
    name: str, issue: Issue, what: str, scale: str, artwork: str, forced: bool = False, view: str = "seen from the top"
) -> Sheet:
    """Return an A4 sheet with frame and title block.

    Parameters
    ----------
    name
        Name of the sensor.
    issue
        Issue of the sensor, for the title block.
    what
        Title of the drawing.
    scale
        Text of the scale. If empty, the title block has no such row (sheets of tables and plots).
    artwork
        Names of the finished files that the drawing belongs to.
    forced
        Whether to stamp the sheet with `FORCED`.
    view
        Direction of view, in words.
    """
    sheet = Sheet(f"{name}: {what}")
    width, height = sheet.size
    sheet.draw(rectangle(MARGIN, MARGIN, width - MARGIN, height - MARGIN), Pen(0.5))
    left, low = width - MARGIN - BLOCK[0], MARGIN
    sheet.draw(rectangle(left, low, left + BLOCK[0], low + BLOCK[1]), Pen(0.5), "#ffffff")
    issue_values = dict(issue.rows)
    rows: list[list[tuple[str, str]]] = [
        *([[("Stop", FORCED)]] if forced else []), [("Design", name)],
        [(label, issue_values.get(name, NOT_STATED)) for label, name in ISSUE], [("Drawing", what)],
        *([[("Scale", f"{scale}; millimetres; {view}")]] if scale else []), [("Files", artwork)],
        [("Made by", f"sitscad {__version__}")],
    ]
    step = BLOCK[1] / len(rows)
    for i, cells in enumerate(rows):
        y = low + BLOCK[1] - (i + 1) * step
        if i:
            sheet.line(left, y + step, left + BLOCK[0], y + step, THIN)
        # Widths (mm) of the cells in this row of the title block: one full cell, or the cells of the issue
        widths = (BLOCK[0],) if len(cells) == 1 else ISSUE_CELLS
        for cell, x, room in zip(cells, *(tuple(accumulate(widths[:-1], initial=0.0)), widths), strict=True):
            _draw_cell(sheet, cell, (left + x, y), (room, step))
    return sheet


def _draw_cell(sheet: Sheet, cell: tuple[str, str], corner: tuple[float, float], size: tuple[float, float]) -> None:
    """Draw a cell of the title block: its label, and its text in the largest letters that fit."""
    (label, text), (x, y), (width, step) = cell, corner, size
    indent = max(15.0, text_width(label, 2.0) + 3.0) if width > 60.0 else text_width(label, 2.0) + 3.0
    if width < BLOCK[0]:
        sheet.line(x + width, y, x + width, y + step, THIN)
    sheet.text(x + 1.5, y + 0.3 * step, label, 2.0)
    letters = 3.2 if label in ("Design", "Stop") else TEXT
    letters = min(letters, letters * (width - indent - 2.0) / max(text_width(text, letters), 1e-9))
    sheet.text(x + indent, y + 0.28 * step, text, letters, colour=RED if label == "Stop" else BLACK)


def scale_for(size: tuple[float, float], room: tuple[float, float], scales: tuple[float, ...] = DETAIL_SCALES) -> float:
    """Return the largest of `scales` at which `size` (m) fits `room` (mm on paper).

    Returns the last of `scales` if none fits.
    """
    fitting = (k for k in scales if all(s * 1e3 * k <= r + 1e-9 for s, r in zip(size, room, strict=True)))
    return next(fitting, scales[-1])


def scale_text(scale: float) -> str:
    """Return a scale as text, such as 10:1."""
    return f"{scale:g}:1" if scale >= 1.0 else f"1:{1.0 / scale:g}"


def centred_view(box: tuple[float, float, float, float], scale: float, room: tuple[float, float, float, float]) -> View:
    """Return a view that puts the centre of a box (m) at the centre of `room`.

    `room` is left, low, width and height (mm on paper).
    """
    middle = (box[0] + box[2]) / 2e-3 * scale, (box[1] + box[3]) / 2e-3 * scale
    return View(scale, (room[0] + room[2] / 2 - middle[0], room[1] + room[3] / 2 - middle[1]))


class View:
    """Map from metres on the board to millimetres on paper.

    `scale` is the scale of the drawing, `origin` the place of the board's origin on paper (mm).
    """

    def __init__(self, scale: float, origin: tuple[float, float]) -> None:
        self.scale, self.origin = scale, origin

    def x(self, metres: float) -> float:
        """Return the x (mm) on paper of an x (m) on the board."""
        return self.origin[0] + metres * 1e3 * self.scale

    def y(self, metres: float) -> float:
        """Return the y (mm) on paper of a y (m) on the board."""
        return self.origin[1] + metres * 1e3 * self.scale

    def length(self, metres: float) -> float:
        """Return the length (mm) on paper of a length (m)."""
        return metres * 1e3 * self.scale

    def path(self, path: Path) -> Path:
        """Return a path on the board (m) as a path on paper (mm)."""
        return path.mapped(lambda p: Point(self.x(p.x), self.y(p.y)))


def mm(metres: float) -> str:
    """Return a length (m) as the text of a dimension: millimetres with two decimals, or three if the third is not 0."""
    return in_mm(metres, 3, 2)


def draw_origin(sheet: Sheet, view: View) -> None:
    """Draw the origin of the files' coordinates: a red cross in a circle."""
    x, y, red = view.x(0.0), view.y(0.0), Pen(0.25, RED)
    sheet.draw(circle(Point(x, y), 1.2), red)
    for dx, dy in ((2.0, 0.0), (0.0, 2.0)):
        sheet.line(x - dx, y - dy, x + dx, y + dy, red)


def draw_axes(sheet: Sheet, x: float, y: float, size: float, letters: float) -> None:
    """Draw arrows along the board's x and y from (x, y) on the sheet, each `size` long, with their names."""
    tip = 0.25 * size
    ends = (((x + size, y), (x + size - tip, y + tip / 2), (x + size - tip, y - tip / 2)),
            ((x, y + size), (x + tip / 2, y + size - tip), (x - tip / 2, y + size - tip)))
    for end, first, other in ends:
        sheet.line(x, y, *end, Pen(size / 16, BLACK))
        sheet.draw(closed_polygon([Point(*end), Point(*first), Point(*other)]), None, BLACK)
    sheet.text(x + size + 0.4 * letters, y - 0.35 * letters, "x", letters)
    sheet.text(x + 0.5 * letters, y + size - 0.6 * letters, "y", letters)


def draw_ordinates(sheet: Sheet, view: View, axis: int, values: Sequence[float], start: float, end: float) -> None:
    """Draw coordinate dimensions of `values` (m) along x (`axis` 0) or y (`axis` 1).

    Leader lines run from the edge of the view at `start` to texts beyond `end` (mm on paper), below or left of the
    view. Values that give equal texts share a dimension.
    """
    # Values with equal texts share one dimension
    feet = list({mm(value): value for value in sorted(round(each, 7) for each in values)}.values())
    at = [(view.x, view.y)[axis](value) for value in feet]
    for value, foot, place in zip(feet, at, spaced_places(at, 1.3 * TEXT), strict=True):
        knee = start + (end - start) * 0.5
        corners = [(foot, start - 1.0), (foot, knee), (place, end)]
        for (a, b), (c, d) in pairwise(corners):
            sheet.line(*((a, b, c, d) if axis == 0 else (b, a, d, c)), THIN)
        if axis == 0:
            sheet.text(place + 0.35 * TEXT, end - (1.0 + text_width(mm(value), TEXT)), mm(value), TEXT, angle=90.0)
        else:
            sheet.text(end - 1.0, place - 0.35 * TEXT, mm(value), TEXT, "end")


def spaced_places(places: Sequence[float], least: float) -> list[float]:
    """Return sorted places, moved apart so that neighbours have a distance of `least` or more.

    Each result is the mean of two passes: one moves places only up, the other only down.
    """
    forward: list[float] = []
    for place in places:
        forward.append(max(place, forward[-1] + least) if forward else place)
    backward: list[float] = []
    for place in reversed(places):
        backward.append(min(place, backward[-1] - least) if backward else place)
    return [(a + b) / 2.0 for a, b in zip(forward, reversed(backward), strict=True)]


def draw_dimension(
    sheet: Sheet, first: tuple[float, float], other: tuple[float, float], text: str, colour: str = BLACK
) -> None:
    """Draw a dimension line with arrows between two points, with its text. The points have equal x or equal y (mm)."""
    (x0, y0), (x1, y1) = first, other
    sheet.line(x0, y0, x1, y1, Pen(THIN.width, colour))
    level = abs(y1 - y0) < 1e-9
    for (x, y), way in ((first, 1.0), (other, -1.0)):
        tip = [(x, y), (x + way * 2.0, y + 0.4), (x + way * 2.0, y - 0.4)]
        if not level:
            tip = [(x, y), (x + 0.4, y + way * 2.0), (x - 0.4, y + way * 2.0)]
        sheet.draw(closed_polygon([Point(*corner) for corner in tip]), None, colour)
    middle = (x0 + x1) / 2.0, (y0 + y1) / 2.0
    if level:
        sheet.text(middle[0], middle[1] + 0.8, text, TEXT, "middle", colour=colour)
    else:
        sheet.text(middle[0] - 0.8, middle[1], text, TEXT, "middle", 90.0, colour)


def draw_short_dimension(
    sheet: Sheet, first: tuple[float, float], other: tuple[float, float], text: str, upright: bool = False,
    is_before: bool = False,
) -> None:
    """Draw the dimension of a short distance, with arrows from outside.

    `first` is the lower or left point. The text stands beyond the arrows at `other`, or before `first` if `is_before`.
    For a vertical distance, `upright` text stands level beside the upper arrow.
    """
    reach, tip = 5.0, 2.0
    level = abs(other[1] - first[1]) < 1e-9

    def at(point: tuple[float, float], distance: float, offset: float = 0.0) -> Point:
        return Point(point[0] + distance, point[1] + offset) if level else Point(point[0] + offset, point[1] + distance)

    begin, end = at(first, -reach), at(other, reach)
    sheet.line(begin.x, begin.y, end.x, end.y, THIN)
    for point, way in ((first, -1.0), (other, 1.0)):
        corners = [at(point, 0.0), at(point, way * tip, 0.4), at(point, way * tip, -0.4)]
        sheet.draw(closed_polygon(corners), None, BLACK)
    if level or not upright:
        offset = -0.35 * TEXT if level else 0.35 * TEXT
        place = at(first, -reach - 1.0, offset) if is_before else at(other, reach + 1.0, offset)
        sheet.text(place.x, place.y, text, TEXT, "end" if is_before else "start", 0.0 if level else 90.0)
    else:
        sheet.text(end.x + 1.0, end.y - 0.7 * TEXT, text, TEXT)


def draw_table(
    sheet: Sheet, left: float, top: float, widths: Sequence[float], rows: Sequence[Sequence[str]], size: float = TEXT
) -> float:
    """Draw rows of texts in columns (widths in mm on paper), and return the y below the table.

    The first row is the heading. A text that is too wide for its column is drawn smaller.
    """
    step = 1.55 * size
    for i, row in enumerate(rows):
        y, x = top - (i + 1) * step, left
        for text, width in zip(row, widths, strict=True):
            room = width - 1.5
            sheet.text(x + 0.8, y + 0.42 * size, text, min(size, size * room / max(text_width(text, size), 1e-9)))
            x += width
        sheet.line(left, y, left + sum(widths), y, THICK if i == 0 else THIN)
    return top - len(rows) * step


def wrapped_lines(text: str, width: float, size: float) -> list[str]:
    """Return the lines of a text, broken between words so that no line is wider than `width` (mm).

    `size` is the size (mm) of the letters. A word wider than a line is broken, too.
    """
    lines, line = [], ""
    for word in (piece for each in text.split() for piece in _word_pieces(each, width, size)):
        longer = f"{line} {word}" if line else word
        if line and text_width(longer, size) > width:
            lines.append(line)
            longer = word
        line = longer
    return [*lines, line]


def _word_pieces(word: str, width: float, size: float) -> list[str]:
    """Return the pieces of a word, broken so that no piece is wider than `width` (mm)."""
    pieces, piece = [], ""
    for character in word:
        if piece and text_width(piece + character, size) > width:
            pieces.append(piece)
            piece = ""
        piece += character
    return [*pieces, piece]


def numbered_notes(texts: Iterable[str]) -> list[str]:
    """Return notes with their numbers in front, from 1."""
    return [f"{number}. {text}" for number, text in enumerate(texts, 1)]


def draw_paragraph(
    sheet: Sheet, left: float, top: float, width: float, low: float, lines: Sequence[str], size: float = TEXT
) -> float:
    """Draw texts below each other, and return the y (mm) of the last line.

    The first line is below `top` (mm). Texts are broken into lines of `width` (mm). Letters shrink from `size`, down to
    `SMALLEST`, until the last line is above `low` (mm). Lines stay within `width` in a viewer's substitute font, too.
    """
    width = width / SUBSTITUTE
    while size > SMALLEST and low > top - 1.45 * size * sum(
            len(wrapped_lines(text, width - INDENT, size)) for text in lines):
        size -= 0.1
    y = top
    for text in lines:
        for i, line in enumerate(wrapped_lines(text, width - INDENT, size)):
            y -= 1.45 * size
            sheet.text(left + (INDENT if i else 0.0), y, line, size)
    return y


SYMBOLS = (
    ((180.0, 0.0), (270.0, 90.0)), ((225.0, 45.0), (315.0, 135.0)), ((0.0, 90.0, 180.0, 270.0, 0.0),),
    ((45.0, 135.0, 225.0, 315.0, 45.0),), ((90.0, 210.0, 330.0, 90.0),), ((), (180.0, 0.0), (270.0, 90.0)),
)
"""Symbols of drill tools, in the order of the tools.

Each symbol is a tuple of lines, each line the angles (deg) of its points on a circle; an empty line is the whole
circle. After the last symbol, the first is used again.
"""


def tool_symbol(tool: int, at: Point, radius: float) -> list[Path]:
    """Return the lines of a tool's symbol (tools from 0) in a circle about `at`."""
    lines = SYMBOLS[tool % len(SYMBOLS)]
    return [polyline([polar(radius, math.radians(turn), at) for turn in line]) if line else circle(at, radius)
            for line in lines]
