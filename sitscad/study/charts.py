"""The pictures of a study's page: fields of designs by two goals, parallel axes, small drawings of boards.

All are sheets in pixels, whole without scripts; what stands for a design is named ``CHART-design-NUMBER``, by which the
page's script finds it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from sitscad.drawing.sheet import COLOURS, Pen, Sheet
from sitscad.drawing.svg import svg
from sitscad.geometry.path import Path, Point, bounding_box, box_around, circle, polyline
from sitscad.record import record

INK, SOFT, LINE = "#1c2126", "#5c6670", "#d9dee3"
REFUSED, PASSES, FRONT, KEPT = "#b9c1c9", "#7fa8d6", COLOURS[0], COLOURS[1]
LETTERS = 12.0
TICKS = 4  # Steps of an axis at most


@record
class ChartAxis:
    """Figures along a side of a chart: their name, between which, and what is written where."""

    title: str
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...]

    def at(self, value: float) -> float:
        """Where a figure stands: 0 at the low end, 1 at the high one, and never beyond."""
        return min(1.0, max(0.0, (value - self.low) / (self.high - self.low)))

    def has(self, value: float | None) -> bool:
        """Whether a figure lies on it."""
        return value is not None and self.low <= value <= self.high


def axis_of_figures(title: str, values: Iterable[float]) -> ChartAxis:
    """One that holds all of some figures, with round ones written at it."""
    found = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(found), max(found)
    room = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    low, high = low - room, high + room
    power = 10.0 ** math.floor(math.log10((high - low) / TICKS))
    step = next(k * power for k in (1, 2, 5, 10) if k * power * TICKS >= high - low)
    first = math.ceil(low / step - 1e-9)
    ticks = [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]
    return ChartAxis(title, low, high, tuple((value, f"{value:.6g}") for value in ticks))


@record
class DesignMark:
    """A design in a chart: its number, what it is (a key of `MARKS`), and the number that it is kept under."""

    number: int
    kind: str
    kept: int = 0


MARKS = {
    "refused": (2.2, REFUSED), "passes": (2.6, PASSES), "front": (4.0, FRONT), "nearest": (7.0, KEPT),
    "kept": (8.0, KEPT),
}
"""Radius (px) and colour of a design, in the order of drawing: what it is is the best that can be said of it."""


def in_order(marks: Iterable[DesignMark]) -> list[DesignMark]:
    """The lesser ones first, so that they lie below."""
    return sorted(marks, key=lambda mark: list(MARKS).index(mark.kind))


def field(
    name: str, axes: tuple[ChartAxis, ChartAxis], marks: Iterable[DesignMark],
    place: Callable[[DesignMark], tuple[float, float] | None], base: tuple[float, float] | None,
) -> str:
    """Designs by two figures; those beyond the axes are left out."""
    size, (left, low, right, top) = (620.0, 430.0), (66.0, 52.0, 606.0, 400.0)
    sheet, (across, up) = Sheet(f"{axes[1].title} against {axes[0].title}", size, unit="", decimals=1), axes
    for value, words in across.ticks:
        x = left + across.at(value) * (right - left)
        sheet.line(x, low, x, top, Pen(1.0, LINE))
        sheet.text(x, low - 16.0, words, 11.0, "middle", colour=SOFT)
    for value, words in up.ticks:
        y = low + up.at(value) * (top - low)
        sheet.line(left, y, right, y, Pen(1.0, LINE))
        sheet.text(left - 6.0, y - 4.0, words, 11.0, "end", colour=SOFT)
    sheet.text((left + right) / 2, 12.0, across.title, LETTERS, "middle", colour=INK)
    sheet.text(left - 46.0, top + 14.0, up.title, LETTERS, colour=INK)

    def point(at: tuple[float, float]) -> Point:
        return Point(left + across.at(at[0]) * (right - left), low + up.at(at[1]) * (top - low))

    for mark in in_order(marks):
        at = place(mark)
        if at is None or not (across.has(at[0]) and up.has(at[1])):
            continue
        radius, colour = MARKS[mark.kind]
        with sheet.group(f"{name}-design-{mark.number}", kind=f"design {mark.kind}"):
            sheet.draw(circle(point(at), radius), None, colour)
            if mark.kept:
                sheet.text(point(at).x, point(at).y - 4.0, str(mark.kept), 11.0, "middle", colour="#ffffff", bold=True)
    if base is not None and across.has(base[0]) and up.has(base[1]):
        at = point(base)
        sheet.draw(circle(at, 6.0), Pen(2.0, INK))
        sheet.text(at.x + 9.0, at.y - 4.0, "base", 11.0, colour=INK, halo=3.0)
    return svg(sheet)


PARALLEL = (380.0, 40.0, 300.0)
"""Height of the picture of parallel axes, and where they begin and end (px)."""


def parallel(
    axes: Sequence[ChartAxis], marks: Iterable[DesignMark], values: Callable[[DesignMark], Sequence[float] | None]
) -> str:
    """A line a design over upright axes; beyond its axis a figure is drawn at its end."""
    height, low, top = PARALLEL
    step = max(118.0, 900.0 / max(1, len(axes) - 1))
    sheet = Sheet("All keys and goals", (step * (len(axes) - 1) + 150.0, height), unit="", decimals=1)
    places = [75.0 + step * k for k in range(len(axes))]
    for mark in in_order(marks):
        row = values(mark)
        if row is None:
            continue
        line = [Point(x, low + axis.at(value) * (top - low)) for x, axis, value in zip(places, axes, row, strict=True)]
        width = {"kept": 2.6, "nearest": 2.6, "front": 1.4}.get(mark.kind, 0.6)
        with sheet.group(f"lines-design-{mark.number}", kind=f"design {mark.kind}"):
            sheet.draw(polyline(line), Pen(width, MARKS[mark.kind][1]))
    for k, (x, axis) in enumerate(zip(places, axes, strict=True)):
        with sheet.group(f"lines-axis-{k}", kind="axis"):
            sheet.line(x, low, x, top, Pen(1.4, INK))
        for value, words in axis.ticks:
            y = low + axis.at(value) * (top - low)
            sheet.line(x - 4.0, y, x, y, Pen(1.4, INK))
            sheet.text(x - 7.0, y - 4.0, words, 11.0, "end", colour=INK, halo=3.0)
        sheet.text(x, top + 18.0 + 24.0 * (k % 2), axis.title, LETTERS, "middle", colour=INK, bold=True)
    return svg(sheet)


def board_sketch(
    body: tuple[float, float, float, float], outline: Path, windings: Sequence[Path], width: float,
    targets: Sequence[Path],
) -> str:
    """A board without leads, as seen from the top (m): its outline, the tail cut off behind the body, the tracks of a
    layer, and the targets over it.
    """
    x0, y0, x1, y1 = box_around([body, *(bounding_box([path]) for path in targets)])
    scale = 400.0 / (x1 - x0)
    wide, high = 420.0, (y1 - y0) * scale + 20.0

    def placed(path: Path) -> Path:
        return path.mapped(lambda p: Point(10.0 + (p.x - x0) * scale, 10.0 + (p.y - y0) * scale))

    sheet = Sheet("The coils from the top", (wide, high), unit="", decimals=1)
    with sheet.group("sketch", window=(0.0, 0.0, wide, high)):
        sheet.draw(placed(outline), Pen(1.5, "#222222"), "#f1e8d2")
        for path in windings:
            sheet.draw(placed(path), Pen(width * scale, "#d55e00"))
        for path in targets:
            sheet.draw(placed(path), Pen(1.5, "#0072b2", (6.0, 4.0)))
    return svg(sheet)
