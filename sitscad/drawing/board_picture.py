"""Pictures of the layout to scale: self-contained SVG without scripts, fonts, identifiers or anything from outside.

The plane is drawn as seen from the top, y upwards; copper layers have colours that stay apart for colour-blind eyes.
Nothing is transparent: upper layers hide lower ones, and every colour of the picture is one of its legend.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import NamedTuple
from xml.sax.saxutils import escape

from sitscad.geometry.path import Arc, Path, Point, bounding_box
from sitscad.geometry.region import Region
from sitscad.layout.board import Layout
from sitscad.layout.tail.bending import Bend, bend_of
from sitscad.units import decimal, show

Window = tuple[float, float, float, float]

COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#8c564b", "#5f5f5f")
"""One colour a copper layer, from the top (after Okabe and Ito's palette)."""

BOARD, PLATE, CONTACT, RING, EDGE = "#f6e7c1", "#cdb380", "#e6b800", "#8a8a8a", "#222222"
TAKEN = "#dfd3ad"
"""What the bend takes of the tail."""
TOP_OPENING, BOTTOM_OPENING, BEND, BEND_DASHES = "#1b7837", "#762a83", "#444444", "14 4 3 4 3 4"
WIDTH = 1200.0
"""Width of a picture in user units."""
FONT = "font-family='Helvetica, Arial, sans-serif'"


class Mark(NamedTuple):
    """A place to point at: metres on the board, the number or word beside it, and what it is (a key of `MARKS`)."""

    x: float
    y: float
    text: str
    kind: str


MARKS = {"error": "#d00000", "warning": "#b35900", "note": "#0050b3"}
"""The colours of marks."""


def picture(
    layout: Layout, layers: Iterable[int] | None = None, window: Window | None = None, marks: Iterable[Mark] = ()
) -> str:
    """A picture of the layout as SVG text.

    ``layers`` are the copper layers to show (from 1 at the top; all where left out), ``window`` is what to show of the
    plane, (x0, y0, x1, y1) in metres (the whole board where left out); a margin is added around it. ``marks`` are drawn
    over it, those that the window shows.
    """
    shown = sorted(set(layers)) if layers is not None else list(range(1, layout.copper_layers + 1))
    view = _View(window or bounding_box([layout.outline]), WIDTH)
    pointed_at = [mark for mark in marks if view.shows(mark.x)]
    legend = _legend(layout, shown, view, pointed_at)
    height = view.height + 30.0 * len(legend) + 20.0
    title = escape(f"{layout.spec.name}: copper layers {', '.join(map(str, shown))}, seen from the top")
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {_n(WIDTH)} {_n(height)}' width='{_n(WIDTH)}' "
        f"height='{_n(height)}' role='img'>",
        f"<title>{title}</title>",
        f"<rect width='{_n(WIDTH)}' height='{_n(height)}' fill='#ffffff'/>",
        f"<svg width='{_n(WIDTH)}' height='{_n(view.height)}' viewBox='0 0 {_n(WIDTH)} {_n(view.height)}'>",
        *_board(layout, shown, view),
        *_labels(layout, view),
        *_marks(pointed_at, view),
        "</svg>",
        *(f"<g transform='translate(0 {_n(view.height + 10.0 + 30.0 * i)})'>{row}</g>" for i, row in enumerate(legend)),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


class _View:
    """From metres to the picture: a window with a margin around it, y turned over."""

    def __init__(self, window: Window, width: float) -> None:
        x0, y0, x1, y1 = window
        margin = 0.06 * max(y1 - y0, 0.15 * (x1 - x0))
        self.x0, self.y1 = x0 - margin, y1 + margin
        self.scale = width / (x1 - x0 + 2 * margin)
        self.height = (y1 - y0 + 2 * margin) * self.scale

    def x(self, metres: float) -> float:
        return (metres - self.x0) * self.scale

    def y(self, metres: float) -> float:
        return (self.y1 - metres) * self.scale

    def shows(self, metres: float) -> bool:
        """Whether an x lies in the picture."""
        return 0.0 <= self.x(metres) <= WIDTH

    def xy(self, point: tuple[float, float]) -> str:
        return f"{_n(self.x(point[0]))} {_n(self.y(point[1]))}"

    def path(self, path: Path) -> str:
        """The path as SVG data; counter-clockwise stays so to the eye, which SVG calls sweep 0."""
        data = [f"M{self.xy(path.start)}"]
        for segment in path:
            if isinstance(segment, Arc) and abs(segment.sweep) > 1e-9:
                radius = _n(segment.radius * self.scale)
                large, sweep = int(abs(segment.sweep) > math.pi + 1e-9), int(not segment.ccw)
                data.append(f"A{radius} {radius} 0 {large} {sweep} {self.xy(segment.end)}")
            else:
                data.append(f"L{self.xy(segment.end)}")
        return "".join([*data, "Z"] if path.is_closed else data)

    def region(self, region: Region) -> str:
        return "".join(self.path(path) for path in (region.outline, *region.holes))


def _board(layout: Layout, shown: list[int], view: _View) -> Iterator[str]:
    yield f"<path d='{view.path(layout.outline)}' fill='{BOARD}' stroke='none'/>"
    if layout.stiffener is not None:
        outline = view.region(layout.stiffener.outline)
        yield f"<path d='{outline}' fill='{PLATE}' fill-rule='evenodd' stroke='{PLATE}'/>"
    if (bend := bend_of(layout)) is not None:
        yield from _bend(layout, bend, view)
    for layer in reversed(shown):
        yield from _copper(layout, layer, view)
    for via in layout.vias:
        x, y = _n(view.x(via.centre.x)), _n(view.y(via.centre.y))
        yield f"<circle cx='{x}' cy='{y}' r='{_n(via.pad / 2 * view.scale)}' fill='{RING}'/>"
        yield f"<circle cx='{x}' cy='{y}' r='{_n(via.drill / 2 * view.scale)}' fill='#ffffff'/>"
    yield from _openings(layout.bottom_openings, BOTTOM_OPENING, "2 5", view)
    yield from _openings(layout.top_openings, TOP_OPENING, "8 4", view)
    yield f"<path d='{view.path(layout.outline)}' fill='none' stroke='{EDGE}' stroke-width='1.5'/>"


def _copper(layout: Layout, layer: int, view: _View) -> Iterator[str]:
    colour = _colour(layer)
    ends = "stroke-linecap='round' stroke-linejoin='round'"
    yield f"<g class='copper-{layer}' fill='none' stroke='{colour}' {ends}>"
    for trace in layout.on_layer(layer):
        yield f"<path d='{view.path(trace.path)}' stroke-width='{_n(trace.width * view.scale)}'/>"
    for drop in (drop for drop in layout.teardrops if drop.layer == layer):
        yield f"<path d='{view.path(drop.outline)}' fill='{colour}' stroke='none'/>"
    yield "</g>"
    for pad in (pad for pad in layout.all_pads if pad.layer == layer):
        (w, h), (x, y) = pad.size, pad.centre
        size = f"width='{_n(w * view.scale)}' height='{_n(h * view.scale)}'"
        corner = f"x='{_n(view.x(x - w / 2))}' y='{_n(view.y(y + h / 2))}'"
        yield f"<rect {corner} {size} fill='{CONTACT}' stroke='{colour}'/>"


def _openings(openings: tuple[Region, ...], colour: str, dashes: str, view: _View) -> Iterator[str]:
    for opening in openings:
        data = view.region(opening)
        yield f"<path d='{data}' fill='none' stroke='{colour}' stroke-width='2' stroke-dasharray='{dashes}'/>"


def _bend(layout: Layout, bend: Bend, view: _View) -> Iterator[str]:
    """The line about which the tail is bent, and what the bend takes of it as a band."""
    low, high = layout.reach_at(bend.line)
    size = f"width='{_n((bend.end - bend.start) * view.scale)}' height='{_n((high - low) * view.scale)}'"
    corner = f"x='{_n(view.x(bend.start))}' y='{_n(view.y(high))}'"
    yield f"<rect {corner} {size} fill='{TAKEN}'/>"
    x, top, bottom = _n(view.x(bend.line)), _n(view.y(high) - 8.0), _n(view.y(low) + 8.0)
    yield f"<path d='M{x} {top}V{bottom}' stroke='{BEND}' stroke-width='2' stroke-dasharray='{BEND_DASHES}'/>"


def _labels(layout: Layout, view: _View) -> Iterator[str]:
    halo = "stroke='#ffffff' paint-order='stroke' stroke-linejoin='round'"
    reach = min(layout.spec.coil.size) / 2
    size = max(12.0, min(30.0, 0.25 * reach * view.scale))
    yield f"<g {FONT} fill='#000000' {halo} stroke-width='4' text-anchor='middle'>"
    for coil in layout.coils:
        x, y = _free_place(layout, coil.centre, 0.9 * size / view.scale)
        place = f"x='{_n(view.x(x))}' y='{_n(view.y(y) + 0.35 * size)}'"
        yield f"<text {place} font-size='{_n(size)}'>{escape(coil.name)}</text>"
    for each in layout.capacitors:
        size = min(12.0, max(7.0, 0.4 * max(each.pads[0].size) * view.scale))
        place = f"x='{_n(view.x(each.centre.x))}' y='{_n(view.y(each.centre.y) + 0.35 * size)}'"
        yield f"<text {place} font-size='{_n(size)}'>{escape(each.reference)}</text>"
    yield "</g>"
    yield from _contact_names(layout, view)


def _contact_names(layout: Layout, view: _View) -> Iterator[str]:
    """Each contact's number and pin on it, as high as their pitch allows, so that no two cover each other."""
    rows = sorted(pad.centre for pad in layout.pads)
    pitch = min((a.distance(b) for a, b in combinations(rows, 2)), default=math.inf) * view.scale
    text = min(16.0, 0.75 * pitch)
    yield f"<g {FONT} fill='#000000' font-size='{_n(text)}' text-anchor='middle'>"
    for pad in layout.pads:
        across, down = view.x(pad.centre.x), view.y(pad.centre.y)
        place = f"x='{_n(across)}' y='{_n(down + 0.35 * text)}'"
        if pad.size[1] > pad.size[0]:  # a tail that turns: written along the contact
            place += f" transform='rotate(-90 {_n(across)} {_n(down)})'"
        words = f"{pad.number}" if pad.is_unused else f"{pad.number}: {escape(pad.pin)}"
        yield f"<text {place}>{words}</text>"
    yield "</g>"


def _free_place(layout: Layout, centre: Point, step: float) -> Point:
    """The centre of a coil, or a place one step beside it, whichever is farthest from every via."""
    places = [centre.shifted(i * step, j * step) for i, j in ((0, 0), (0, 1), (0, -1), (-1, 0), (1, 0))]
    return max(places, key=lambda p: round(min((p.distance(via.centre) for via in layout.vias), default=0.0), 9))


def _marks(marks: list[Mark], view: _View) -> Iterator[str]:
    """A ring at each place, with its text beside it; places that would hide one another share a ring."""
    groups: list[list[Mark]] = []
    for mark in marks:
        near = (
            g for g in groups if math.hypot(view.x(g[0].x) - view.x(mark.x), view.y(g[0].y) - view.y(mark.y)) < 26.0
        )
        group = next(near, None)
        if group is None:
            groups.append([mark])
        else:
            group.append(mark)
    taken: list[tuple[float, float, float]] = []
    for group in groups:
        kind = next(kind for kind in MARKS if any(mark.kind == kind for mark in group))
        x, y, text = view.x(group[0].x), view.y(group[0].y), ", ".join(mark.text for mark in group)
        left = x - 18.0 - 12.0 * len(text) if x > WIDTH - 120.0 else x + 18.0
        height = y - 12.0
        while any(left < end and start < left + 12.0 * len(text) and abs(height - h) < 22.0 for start, end, h in taken):
            height -= 22.0
        taken.append((left, left + 12.0 * len(text), height))
        ring = f"<circle cx='{_n(x)}' cy='{_n(y)}' r='13' fill='none'"
        yield (
            f"<g class='mark-{kind}'>{ring} stroke='#ffffff' stroke-width='6'/>"
            f"{ring} stroke='{MARKS[kind]}' stroke-width='3'/>"
            f"<text x='{_n(left)}' y='{_n(height)}' {FONT} font-size='22' font-weight='bold' "
            f"fill='{MARKS[kind]}' stroke='#ffffff' stroke-width='5' paint-order='stroke'>{escape(text)}</text></g>"
        )


# The legend: rows of text and swatches under the drawing.


def _legend(layout: Layout, shown: list[int], view: _View, marks: list[Mark]) -> list[str]:
    """The scale bar, then a key for everything that the window shows."""
    plate, bend = layout.stiffener, bend_of(layout)
    keys = [(_swatch(_colour(layer)), f"copper {layer}") for layer in shown]
    if any(pad.layer in shown and view.shows(pad.centre.x) for pad in layout.pads):
        keys.append((_swatch(CONTACT), "contacts"))
    if any(view.shows(via.centre.x) for via in layout.vias):
        keys.append((_swatch(RING), "vias"))
    if any(view.shows(opening.outline.start.x) for opening in layout.top_openings):
        keys.append((_dashes(TOP_OPENING, "8 4"), "top coverlay open"))
    if any(view.shows(opening.outline.start.x) for opening in layout.bottom_openings):
        keys.append((_dashes(BOTTOM_OPENING, "2 5"), "bottom coverlay open"))
    if plate is not None and view.shows(plate.outline.outline.start.x):
        keys.append((_swatch(PLATE), f"stiffener {show(plate.thickness, 'm')}"))
    if bend is not None and view.shows(bend.line):
        keys.append((_dashes(BEND, BEND_DASHES), f"bend {math.degrees(bend.angle):g} deg {bend.direction}"))
        keys += [(_swatch(TAKEN), "taken by the bend")] if bend.end > bend.start else []
    keys += [(_ring(MARKS[kind]), f"{kind}, numbered") for kind in MARKS if any(mark.kind == kind for mark in marks)]
    return [*_title(layout), _scale_bar(layout, view), *_rows(keys)]


def _rows(keys: list[tuple[str, str]]) -> Iterator[str]:
    """The keys side by side, six to a row."""
    for start in range(0, len(keys), 6):
        cells = [
            f"<g transform='translate({20 + 195 * i} 0)'>{mark}"
            f"<text x='34' y='17' font-size='16'>{escape(text)}</text></g>"
            for i, (mark, text) in enumerate(keys[start : start + 6])
        ]
        yield f"<g {FONT}>{''.join(cells)}</g>"


def _title(layout: Layout) -> Iterator[str]:
    """Part number, revision and date, those that there are, in a row of their own."""
    if words := layout.spec.issue.words:
        yield f"<text x='{_n(WIDTH - 20)}' y='17' {FONT} font-size='16' text-anchor='end'>{escape(words)}</text>"


def _scale_bar(layout: Layout, view: _View) -> str:
    """A bar of a round length near a sixth of the picture, and the sizes in words."""
    length = _round_below(WIDTH / view.scale / 6)
    end = 20.0 + length * view.scale
    body, board = layout.body_size, bounding_box([layout.outline])
    sizes = (
        f"{layout.spec.name}: body {show(body[0], 'm')} x {show(body[1], 'm')}, "
        f"board {show(board[2] - board[0], 'm')} x {show(board[3] - board[1], 'm')}, seen from the top"
    )
    return (
        f"<g {FONT} font-size='16'><path d='M20 8V16M20 12H{_n(end)}M{_n(end)} 8V16' stroke='#000000' fill='none' "
        f"stroke-width='2'/><text x='{_n(end + 10)}' y='17'>{show(length, 'm')}</text>"
        f"<text x='{_n(WIDTH - 20)}' y='17' text-anchor='end'>{escape(sizes)}</text></g>"
    )


def _round_below(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `length`."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(f * power for f in (1.0, 2.0, 5.0) if f * power <= length * (1 + 1e-9))


def _colour(layer: int) -> str:
    return COLOURS[(layer - 1) % len(COLOURS)]


def _swatch(colour: str) -> str:
    return f"<rect y='4' width='26' height='14' fill='{colour}'/>"


def _ring(colour: str) -> str:
    return f"<circle cx='13' cy='11' r='8' fill='none' stroke='{colour}' stroke-width='3'/>"


def _dashes(colour: str, dashes: str) -> str:
    return f"<path d='M0 11H26' stroke='{colour}' stroke-width='2' stroke-dasharray='{dashes}'/>"


def _n(value: float) -> str:
    """A number with two decimals at most, never "-0"."""
    return decimal(value, 2)
