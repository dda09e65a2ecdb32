"""Pictures of the layout to scale, in SVG and in text.

`layout_svg` returns SVG without scripts, fonts or external resources. Below the picture are a scale bar and a legend
with every colour and line that it shows. The view is from the top, y upwards. Copper layers have colours that
colour-blind readers can distinguish. Nothing is transparent: upper layers cover lower layers, and narrow lines show the
covered tracks. Layers, nets, coils, contacts and findings have ids, which begin with the name of the picture.

`dot_picture` returns lines of braille characters, each 2 by 4 dots, for places where only text can be shown: job pages,
logs, messages. A hundred columns are enough for the turns of a coil.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from itertools import combinations
from typing import NamedTuple

import numpy as np

from sitscad.assembly.places.tail_path import bends
from sitscad.basics.arrays import Array
from sitscad.basics.units import show
from sitscad.files.drawing.frame import CHAIN, View, draw_axes
from sitscad.files.drawing.sheet import Pen, Sheet, text_width
from sitscad.files.drawing.svg import svg
from sitscad.kernels.geometry.path import Path, Point, Region, bounding_box, circle, polyline, rectangle
from sitscad.layout.board import Coil, Layout, Pad
from sitscad.spec.coil import CoilSpec


def pad_outline(pad: Pad) -> Path:
    """Return the rectangle (m) of a contact on the board."""
    (w, h), (x, y) = pad.size, pad.centre
    return rectangle(x - w / 2, y - h / 2, x + w / 2, y + h / 2)


def coil_outline(spec: CoilSpec, coil: Coil) -> Path:
    """Return the outline (m) of a coil's outer copper edges on the board.

    It is placed and turned as the coil. Its corner radius is the corner radius of the track's centre line plus half the
    track width. `spec` holds for coils without own windings.
    """
    spec = coil.placement.own or spec
    unturned = spec.outline.edge(spec.size, spec.corner_radius + spec.trace_width / 2)
    return unturned.rotated(coil.placement.rotation).shifted(*coil.centre)


def coil_extent(spec: CoilSpec, coil: Coil) -> tuple[float, float, float, float]:
    """Return the bounding box (x0, y0, x1, y1; m) of a coil's outer copper edges on the board.

    It is the bounding box of `coil_outline`, except at a rounded corner where a layer begins: this corner is sharp.
    """
    spec = coil.placement.own or spec
    outline, half = bounding_box([coil_outline(spec, coil)]), spec.trace_width / 2
    if not spec.corner_radius:
        return outline
    x0, y0, x1, y1 = bounding_box([winding.path for winding in coil.windings])
    return (
        min(outline[0], x0 - half), min(outline[1], y0 - half), max(outline[2], x1 + half), max(outline[3], y1 + half)
    )


def draw_coil(sheet: Sheet, view: View, spec: CoilSpec, coil: Coil, pen: Pen, name: str = "") -> None:
    """Draw a coil's outline and the axes through its centre on a dimensioned drawing."""
    sheet.draw(view.path(coil_outline(spec, coil)), pen, name=name)
    (x0, y0, x1, y1), (x, y) = coil_extent(spec, coil), coil.centre
    sheet.line(view.x(x0), view.y(y), view.x(x1), view.y(y), CHAIN)
    sheet.line(view.x(x), view.y(y0), view.x(x), view.y(y1), CHAIN)


COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#8c564b", "#5f5f5f")
"""Colours of copper layers, from the top (after Okabe and Ito's palette)."""

PLATE, CONTACT, RING = "#cdb380", "#e6b800", "#8a8a8a"
TAKEN = "#dfd3ad"
"""Colour of the part of the tail that bends occupy."""
TOP_OPENING, BOTTOM_OPENING, BEND = "#1b7837", "#762a83", "#444444"
TOP_DASHES, BOTTOM_DASHES, BEND_DASHES = "8 4", "2 5", "14 4 3 4 3 4"
WIDTH = 1200.0  # Width of a picture in pixels
ROW, LETTERS, IN_A_ROW, SIGN = 30.0, 16.0, 6, 34.0
"""Layout of the legend: height of a row, letter size, most keys in a row, and start of texts after a key's left edge.

Lengths are pixels.
"""


AXES_AT = 340.0
"""x position (pixels) of the axes symbol in the row of the scale bar."""
UNDER = 0.3
"""Ratio of the width of the line that shows a covered track to the width of this track.

Upper copper covers the track.
"""


class PicturePoint(NamedTuple):
    """Marked place: x and y (m) on the board, the number or word beside the mark, and a key of `MARKS`."""

    x: float
    y: float
    text: str
    kind: str


MARKS = {"error": "#d00000", "warning": "#b35900", "note": "#0050b3"}
"""Colours of marks."""

Sign = Callable[[Sheet, float, float], None]  # Draws a key's sign on a sheet, its upper left corner at (x, y)


def layer_colour(layer: int) -> str:
    """Return the colour of a copper layer."""
    return COLOURS[(layer - 1) % len(COLOURS)]


def legend_keys(layout: Layout, shown: list[int], view: View, marks: list[PicturePoint]) -> list[tuple[Sign, str]]:
    """Return the legend: a function that draws each sign, and the meaning of the sign as text.

    `shown` are the numbers of the shown copper layers, from 1 at the top.
    """
    plate = layout.stiffener

    def sees(x: float) -> bool:
        return 0.0 <= view.x(x) <= WIDTH

    keys = [(_swatch_sign(layer_colour(layer)), f"copper {layer}") for layer in shown]
    if len(shown) > 1:
        keys.append((_covered_track_sign(layer_colour(shown[0]), layer_colour(shown[1])), "lower copper under upper"))
    keys.append((_line_sign(EDGE, ""), "edge of the board"))
    if layout.spec.fpc.largest is not None:
        keys.append((_line_sign(LARGEST, LARGEST_DASHES), "fpc.largest"))
    if any(pad.layer in shown and sees(pad.centre.x) for pad in layout.pads):
        keys.append((_swatch_sign(CONTACT), "contacts"))
    if any(sees(via.centre.x) for via in layout.vias):
        keys.append((_swatch_sign(RING), "vias"))
    if any(sees(opening.outline.start.x) for opening in layout.top_openings):
        keys.append((_line_sign(TOP_OPENING, TOP_DASHES), "top coverlay open"))
    if any(sees(opening.outline.start.x) for opening in layout.bottom_openings):
        keys.append((_line_sign(BOTTOM_OPENING, BOTTOM_DASHES), "bottom coverlay open"))
    if plate is not None and sees(plate.outline.outline.start.x):
        keys.append((_swatch_sign(PLATE), f"stiffener {show(plate.thickness, 'm')}"))
    visible = [bend for bend in bends(layout) if sees(bend.line)]
    labels = dict.fromkeys(f"bend {bend.angle_text} {bend.direction}" for bend in visible)
    keys += [(_line_sign(BEND, BEND_DASHES), each) for each in labels]
    if any(bend.end > bend.start for bend in visible):
        keys.append((_swatch_sign(TAKEN), "taken by bends" if len(visible) > 1 else "taken by the bend"))
    return keys + [
        (_ring_sign(MARKS[kind]), f"{kind}, numbered") for kind in MARKS if any(mark.kind == kind for mark in marks)
    ]


WIDER_FONT = 1.2
"""Ratio of the letters' width in the widest substitute font to their width in Helvetica.

For DejaVu Sans it is 1.15 to 1.2.
"""


def _draw_scale_bar(
    sheet: Sheet, body_size: tuple[float, float], size: tuple[float, float], name: str, view: View, top: float
) -> None:
    """Draw a scale bar, the axes, and the sizes of body and board as text.

    The bar's length is 1, 2 or 5 times a power of ten metres, and at most a sixth of the picture's width. `body_size`
    and `size` are the two sides (m) of body and board. `top` is the upper edge of the row (pixels).
    """
    # The largest of 1, 2 and 5 times a power of ten up to `length`
    length = WIDTH / view.length(1.0) / 6
    power = 10.0 ** math.floor(math.log10(length))
    length = max(f * power for f in (1.0, 2.0, 5.0) if f * power <= length * (1 + 1e-9))
    end = 20.0 + view.length(length)
    body, board = body_size, size
    sizes = (
        f"{name}: body {show(body[0], 'm')} x {show(body[1], 'm')}, "
        f"board {show(board[0], 'm')} x {show(board[1], 'm')}, seen from the top"
    )
    bar = (((20.0, 8.0), (20.0, 16.0)), ((20.0, 12.0), (end, 12.0)), ((end, 8.0), (end, 16.0)))
    strokes = [polyline([Point(x, top - down) for x, down in ends]) for ends in bar]
    sheet.draw(strokes, Pen(2.0, round_ends=False), kind="scale")
    sheet.text(end + 10.0, top - 17.0, show(length, "m"), LETTERS)
    draw_axes(sheet, AXES_AT, top - 19.0, 22.0, LETTERS)
    sheet.text(WIDTH - 20.0, top - 17.0, sizes, LETTERS, "end")


def _swatch_sign(fill: str) -> Sign:
    return lambda sheet, x, y: sheet.draw(rectangle(x, y - 18.0, x + 26.0, y - 4.0), None, fill)


def _ring_sign(ink: str) -> Sign:
    return lambda sheet, x, y: sheet.draw(circle(Point(x + 13.0, y - 11.0), 8.0), Pen(3.0, ink))


def _covered_track_sign(upper: str, lower: str) -> Sign:
    """Return the legend's sign of a track under upper copper: an area with a narrow line."""

    def draw(sheet: Sheet, x: float, y: float) -> None:
        sheet.draw(rectangle(x, y - 18.0, x + 26.0, y - 4.0), None, upper)
        sheet.line(x, y - 11.0, x + 26.0, y - 11.0, Pen(14.0 * UNDER, lower, round_ends=False))

    return draw


def _line_sign(ink: str, dashes: str) -> Sign:
    pen = Pen(2.0, ink, tuple(map(float, dashes.split())), round_ends=False)
    return lambda sheet, x, y: sheet.line(x, y - 11.0, x + 26.0, y - 11.0, pen)


Window = tuple[float, float, float, float]

BOARD, EDGE, WHITE = "#f6e7c1", "#222222", "#ffffff"
LARGEST, LARGEST_DASHES = "#d00000", "10 5"


def layout_svg(
    layout: Layout, layers: Iterable[int] | None = None, window: Window | None = None,
    marks: Iterable[PicturePoint] = (), name: str = "board",
) -> str:
    """Return a picture of the layout as SVG text.

    Parameters
    ----------
    layout
        The layout.
    layers
        Copper layers to show, from 1 at the top. None shows all.
    window
        Part of the plane to show, (x0, y0, x1, y1) in metres. None shows the whole board. A margin is added around it.
    marks
        Marks to draw over the picture. Marks beyond the left or right edge are left out.
    name
        Beginning of every id, so that one page may hold several pictures.
    """
    shown = sorted(set(layers)) if layers is not None else list(range(1, layout.copper_layers + 1))
    # The window with its margin is as wide as the picture; its lower edge is later moved up by the legend's height
    largest = layout.largest_outline
    x0, y0, x1, y1 = window or bounding_box([layout.outline, *([largest] if largest else [])])
    margin = 0.06 * max(y1 - y0, 0.15 * (x1 - x0))
    scale = WIDTH / (x1 - x0 + 2 * margin)
    view, high = View(scale / 1e3, ((margin - x0) * scale, 0.0 + (margin - y0) * scale)), (y1 - y0 + 2 * margin) * scale
    pointed_at = [mark for mark in marks if 0.0 <= view.x(mark.x) <= WIDTH]
    keys = legend_keys(layout, shown, view, pointed_at)
    # Columns of the legend: texts must end before the next sign in the widest of usual fonts
    longest = max((text_width(text, LETTERS) for _, text in keys), default=0.0)
    columns = min(IN_A_ROW, int((WIDTH - 30.0) / (SIGN + WIDER_FONT * longest)))
    low = ROW * (bool(layout.spec.issue.words) + 1 + math.ceil(len(keys) / columns)) + 20.0
    view = View(view.scale, (view.origin[0], view.origin[1] + low))
    title = f"{layout.spec.name}: copper layers {', '.join(map(str, shown))}, seen from the top"
    sheet = Sheet(title, (WIDTH, high + low), unit="", decimals=2)
    with sheet.group(name, window=(0.0, low, WIDTH, low + high)):
        _draw_board(sheet, layout, shown, view, name)
        _draw_labels(sheet, layout, view, name)
        _draw_marks(sheet, pointed_at, view, name)
    # Part number and issue if stated, the scale bar with the sizes as text, then the keys
    top = low - 10.0
    if title := layout.spec.issue.words:
        sheet.text(WIDTH - 20.0, top - 17.0, title, LETTERS, "end")
        top -= ROW
    _draw_scale_bar(sheet, layout.body_size, layout.size, layout.spec.name, view, top)
    for i, (sign, text) in enumerate(keys):
        row, column = divmod(i, columns)
        x, y = 20.0 + (WIDTH - 30.0) / columns * column, top - ROW * (row + 1)
        sign(sheet, x, y)
        sheet.text(x + SIGN, y - 17.0, text, LETTERS)
    return svg(sheet)


def flat_pen(width: float, colour: str, dashes: str = "") -> Pen:
    """Return a pen whose ends are cut off and whose corners are pointed."""
    return Pen(width, colour, tuple(map(float, dashes.split())), round_ends=False, round_corners=False)


def _region_paths(view: View, region: Region) -> list[Path]:
    return [view.path(path) for path in (region.outline, *region.holes)]


def _draw_board(sheet: Sheet, layout: Layout, shown: list[int], view: View, name: str) -> None:
    """Draw the board's material, copper from the lowest layer up, holes, openings, and last the edge."""
    sheet.draw(view.path(layout.outline), None, BOARD)
    if layout.stiffener is not None:
        sheet.draw(_region_paths(view, layout.stiffener.outline), flat_pen(1.0, PLATE), PLATE)
    for bend in bends(layout):
        # The bend line, and the part of the tail that the bend occupies as a band
        low, high = layout.reach_at(bend.line)
        if bend.end > bend.start:
            sheet.draw(view.path(rectangle(bend.start, low, bend.end, high)), None, TAKEN)
        x, pen = view.x(bend.line), flat_pen(2.0, BEND, BEND_DASHES)
        sheet.line(x, view.y(high) + 8.0, x, view.y(low) - 8.0, pen)
    for layer in reversed(shown):
        with sheet.group(f"{name}-copper-{layer}", kind=f"copper-{layer}"):
            _draw_layer(sheet, layout, layer, view, name)
    for layer in reversed(shown[1:]):  # lower tracks as narrow lines over the copper that covers them
        with sheet.group(f"{name}-under-{layer}", kind=f"copper-{layer}"):
            for net in layout.nets:
                with sheet.group(f"{name}-under-{layer}-net-{net}", kind=f"net-{net}"):
                    for trace in (trace for trace in layout.on_layer(layer) if trace.net == net):
                        pen = Pen(UNDER * view.length(trace.width), layer_colour(layer), round_ends=False)
                        sheet.draw(view.path(trace.path), pen)
    with sheet.group(f"{name}-vias"):
        for via in layout.vias:
            centre = Point(view.x(via.centre.x), view.y(via.centre.y))
            sheet.draw(circle(centre, view.length(via.pad / 2)), None, RING)
            sheet.draw(circle(centre, view.length(via.drill / 2)), None, WHITE)
    for opening in layout.bottom_openings:
        sheet.draw(_region_paths(view, opening), flat_pen(2.0, BOTTOM_OPENING, BOTTOM_DASHES))
    for opening in layout.top_openings:
        sheet.draw(_region_paths(view, opening), flat_pen(2.0, TOP_OPENING, TOP_DASHES))
    sheet.draw(view.path(layout.outline), flat_pen(1.5, EDGE), name=f"{name}-outline")
    if (largest := layout.largest_outline) is not None:
        sheet.draw(view.path(largest), flat_pen(1.5, LARGEST, LARGEST_DASHES), name=f"{name}-largest")


def _draw_layer(sheet: Sheet, layout: Layout, layer: int, view: View, name: str) -> None:
    """Draw one layer: tracks and their teardrops by net, then its contacts."""
    for net in layout.nets:
        with sheet.group(f"{name}-copper-{layer}-net-{net}", kind=f"net-{net}"):
            for trace in (trace for trace in layout.on_layer(layer) if trace.net == net):
                sheet.draw(view.path(trace.path), Pen(view.length(trace.width), layer_colour(layer)))
            for drop in (drop for drop in layout.teardrops if drop.layer == layer and drop.net == net):
                sheet.draw(view.path(drop.outline), None, layer_colour(layer))
    for pad in (pad for pad in layout.all_pads if pad.layer == layer):
        box, ident = view.path(pad_outline(pad)), f"{name}-pad-{pad.reference}-{pad.number}"
        sheet.draw(box, flat_pen(1.0, layer_colour(layer)), CONTACT, name=ident)


def _draw_labels(sheet: Sheet, layout: Layout, view: View, name: str) -> None:
    """Draw the names of coils, chips and contacts."""
    reach = min(layout.spec.coil.size) / 2
    size, labels = max(12.0, min(30.0, 0.25 * view.length(reach))), layout.labels
    for coil in layout.coils:
        centre, step = coil.centre, 0.9 * size / view.length(1.0)
        places = [centre.shifted(i * step, j * step) for i, j in ((0, 0), (0, 1), (0, -1), (-1, 0), (1, 0))]
        at = max(places, key=lambda p: round(min((p.distance(via.centre) for via in layout.vias), default=0.0), 9))
        with sheet.group(f"{name}-coil-{coil.name}"):
            sheet.text(view.x(at.x), view.y(at.y) - 0.35 * size, labels[coil.name], size, "middle", halo=4.0)
    for each in layout.chips:
        size = min(12.0, max(7.0, 0.4 * view.length(max(each.pads[0].size))))
        x, y = view.x(each.centre.x), view.y(each.centre.y)
        sheet.text(x, y - 0.35 * size, each.reference, size, "middle", halo=4.0)
    # Each contact's number and pin, in letters small enough for the pitch
    rows = sorted(pad.centre for pad in layout.pads)
    pitch = view.length(min((a.distance(b) for a, b in combinations(rows, 2)), default=math.inf))
    size = min(16.0, 0.75 * pitch)
    with sheet.group(f"{name}-contact-names"):
        for pad in layout.pads:
            x, y = view.x(pad.centre.x), view.y(pad.centre.y)
            label = f"{pad.number}" if pad.is_unused else f"{pad.number}: {pad.pin}"
            if pad.size[1] > pad.size[0]:  # on a tail that turns, the text runs along the contact
                sheet.text(x + 0.35 * size, y, label, size, "middle", 90.0)
            else:
                sheet.text(x, y - 0.35 * size, label, size, "middle")


def _draw_marks(sheet: Sheet, marks: list[PicturePoint], view: View, name: str) -> None:
    """Draw a ring at each place, with its text beside it. Places less than 26 pixels apart share one ring."""
    boxes: list[tuple[float, float, float]] = []
    groups: list[list[PicturePoint]] = []
    for mark in marks:
        here = Point(view.x(mark.x), view.y(mark.y))
        near = (g for g in groups if here.distance(Point(view.x(g[0].x), view.y(g[0].y))) < 26.0)
        if (shared := next(near, None)) is not None:
            shared.append(mark)
        else:
            groups.append([mark])
    for group in groups:
        kind = next(kind for kind in MARKS if any(mark.kind == kind for mark in group))
        x, y, text = view.x(group[0].x), view.y(group[0].y), ", ".join(mark.text for mark in group)
        wide = 12.0 * len(text)
        left = x - 18.0 - wide if x > WIDTH - 120.0 else x + 18.0
        low = y + 12.0
        while any(left < end and start < left + wide and abs(low - other) < 22.0 for start, end, other in boxes):
            low += 22.0
        boxes.append((left, left + wide, low))
        with ExitStack() as names:
            names.enter_context(sheet.group(kind=f"mark-{kind}"))
            for mark in group:
                names.enter_context(sheet.group(f"{name}-finding-{mark.text}"))
            sheet.draw(circle(Point(x, y), 13.0), Pen(6.0, WHITE))
            sheet.draw(circle(Point(x, y), 13.0), Pen(3.0, MARKS[kind]))
            sheet.text(left, low, text, 22.0, colour=MARKS[kind], halo=5.0, bold=True)


COLUMNS = 96  # Width of a text picture in characters

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""Bit of every dot of a braille character, by row and column (Unicode, chapter 21.1)."""

Points = Array


def dot_picture(layout: Layout, marks: Iterable[PicturePoint] = (), columns: int = COLUMNS) -> str:
    """Return a text picture of the part of the board with the coils, from the top and to scale.

    It shows the outline, the tracks of layer 1 and the texts of `marks` at their places. Lines have at most `columns`
    characters.
    """
    x0, y0, x1, y1 = layout.body
    across = 2 * columns - 1
    step = max(x1 - x0, y1 - y0, 1e-9) / across
    rows = math.ceil((y1 - y0) / step / 4) + 1
    dots = np.zeros((4 * rows, 2 * columns), dtype=bool)
    paths = [layout.outline, *(trace.path for trace in layout.on_layer(1))]
    places = np.concatenate([_points_along(np.array(path.flattened(step / 4)), step / 2) for path in paths])
    x, y = np.rint((places[:, 0] - x0) / step), np.rint((y1 - places[:, 1]) / step)
    inside = (x >= 0) & (x < 2 * columns) & (y >= 0) & (y < 4 * rows)
    dots[y[inside].astype(int), x[inside].astype(int)] = True
    codes = np.full((rows, columns), 0x2800)
    for line, bits in enumerate(_DOTS):
        for column, bit in enumerate(bits):
            codes += bit * dots[line::4, column::2]
    lines = [list(map(chr, line)) for line in codes]
    for mark in marks:
        # Write the text over the picture, completely inside; marks outside are left out
        column = int((mark.x - x0) / step) // 2
        row = int((y1 - mark.y) / step) // 4
        if 0 <= row < len(lines) and 0 <= column < len(lines[row]):
            start = min(column, len(lines[row]) - len(mark.text))
            lines[row][start : start + len(mark.text)] = mark.text
    text = ["".join(line).rstrip("\u2800 ") for line in lines]
    while text and not text[-1]:
        text.pop()
    return "\n".join(text)


def _points_along(corners: Points, step: float) -> Points:
    """Return points (n, 2) along a polyline at equal distances of at most `step`."""
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.linspace(0.0, way[-1], max(2, math.ceil(way[-1] / step) + 1))
    return np.column_stack([np.interp(at, way, corners[:, axis]) for axis in (0, 1)])
