"""Pictures of the layout to scale: self-contained SVG without scripts, fonts or anything from outside.

The plane is drawn as seen from the top, y upwards; copper layers have colours that stay apart for colour-blind eyes.
Nothing is transparent: upper layers hide lower ones, and every colour of the picture is one of its legend. Layers, nets
on them, coils, contacts and findings have names (ids) that begin with the picture's own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import ExitStack
from itertools import combinations

from sitscad.drawing.frame import View
from sitscad.drawing.pictures.board_legend import (
    BEND,
    BEND_DASHES,
    BOTTOM_DASHES,
    BOTTOM_OPENING,
    CONTACT,
    MARKS,
    PLATE,
    RING,
    TAKEN,
    TOP_DASHES,
    TOP_OPENING,
    WIDTH,
    colour,
    draw_legend,
    legend_height,
    legend_keys,
)
from sitscad.drawing.pictures.board_legend import (
    Mark as Mark,
)
from sitscad.drawing.sheet import Pen, Sheet
from sitscad.drawing.svg import svg
from sitscad.geometry.path import Path, Point, Region, bounding_box, circle, rectangle
from sitscad.layout.bending import Bend
from sitscad.layout.board import Layout, Pad
from sitscad.scene.tail_path import bends

Window = tuple[float, float, float, float]

BOARD, EDGE, WHITE = "#f6e7c1", "#222222", "#ffffff"


def picture(
    layout: Layout,
    layers: Iterable[int] | None = None,
    window: Window | None = None,
    marks: Iterable[Mark] = (),
    name: str = "board",
) -> str:
    """A picture of the layout as SVG text.

    ``layers`` are the copper layers to show (from 1 at the top; all where left out), ``window`` is what to show of the
    plane, (x0, y0, x1, y1) in metres (the whole board where left out); a margin is added around it. ``marks`` are drawn
    over it, those that the window shows. ``name`` begins every id, so that one page may hold several pictures.
    """
    return svg(board_sheet(layout, layers, window, marks, name))


def board_sheet(
    layout: Layout,
    layers: Iterable[int] | None = None,
    window: Window | None = None,
    marks: Iterable[Mark] = (),
    name: str = "board",
) -> Sheet:
    """The same picture as a sheet, in pixels."""
    shown = sorted(set(layers)) if layers is not None else list(range(1, layout.copper_layers + 1))
    view, high = _view(window or bounding_box([layout.outline]), 0.0)
    pointed_at = [mark for mark in marks if 0.0 <= view.x(mark.x) <= WIDTH]
    keys = legend_keys(layout, shown, view, pointed_at)
    low = legend_height(layout, keys)
    view = View(view.scale, (view.origin[0], view.origin[1] + low))
    words = f"{layout.spec.name}: copper layers {', '.join(map(str, shown))}, seen from the top"
    sheet = Sheet(words, (WIDTH, high + low), unit="", decimals=2)
    with sheet.group(name, window=(0.0, low, WIDTH, low + high)):
        _board(sheet, layout, shown, view, name)
        _labels(sheet, layout, view, name)
        _marks(sheet, pointed_at, view, name)
    draw_legend(sheet, layout, view, keys, low)
    return sheet


def _view(window: Window, low: float) -> tuple[View, float]:
    """A window with a margin around it as wide as the picture, its lower edge `low` above the sheet's; its height."""
    x0, y0, x1, y1 = window
    margin = 0.06 * max(y1 - y0, 0.15 * (x1 - x0))
    scale = WIDTH / (x1 - x0 + 2 * margin)
    return View(scale / 1e3, ((margin - x0) * scale, low + (margin - y0) * scale)), (y1 - y0 + 2 * margin) * scale


def flat(width: float, colour: str, dashes: str = "") -> Pen:
    """A pen whose ends are cut off and whose corners are pointed."""
    return Pen(width, colour, tuple(map(float, dashes.split())), round_ends=False, round_corners=False)


def _region(view: View, region: Region) -> list[Path]:
    return [view.path(path) for path in (region.outline, *region.holes)]


def _board(sheet: Sheet, layout: Layout, shown: list[int], view: View, name: str) -> None:
    """The board's material, copper from the lowest layer up, holes, openings, and the edge over all of it."""
    sheet.draw(view.path(layout.outline), None, BOARD)
    if layout.stiffener is not None:
        sheet.draw(_region(view, layout.stiffener.outline), flat(1.0, PLATE), PLATE)
    for bend in bends(layout):
        _bend(sheet, layout, bend, view)
    for layer in reversed(shown):
        with sheet.group(f"{name}-copper-{layer}", kind=f"copper-{layer}"):
            _copper(sheet, layout, layer, view, name)
    with sheet.group(f"{name}-vias"):
        for via in layout.vias:
            centre = Point(view.x(via.centre.x), view.y(via.centre.y))
            sheet.draw(circle(centre, view.length(via.pad / 2)), None, RING)
            sheet.draw(circle(centre, view.length(via.drill / 2)), None, WHITE)
    for opening in layout.bottom_openings:
        sheet.draw(_region(view, opening), flat(2.0, BOTTOM_OPENING, BOTTOM_DASHES))
    for opening in layout.top_openings:
        sheet.draw(_region(view, opening), flat(2.0, TOP_OPENING, TOP_DASHES))
    sheet.draw(view.path(layout.outline), flat(1.5, EDGE), name=f"{name}-outline")


def _copper(sheet: Sheet, layout: Layout, layer: int, view: View, name: str) -> None:
    """One layer: tracks and their teardrops by net, then its contacts."""
    for net in layout.nets:
        with sheet.group(f"{name}-copper-{layer}-net-{net}", kind=f"net-{net}"):
            for trace in (trace for trace in layout.on_layer(layer) if trace.net == net):
                sheet.draw(view.path(trace.path), Pen(view.length(trace.width), colour(layer)))
            for drop in (drop for drop in layout.teardrops if drop.layer == layer and drop.net == net):
                sheet.draw(view.path(drop.outline), None, colour(layer))
    for pad in (pad for pad in layout.all_pads if pad.layer == layer):
        sheet.draw(_box(view, pad), flat(1.0, colour(layer)), CONTACT, name=f"{name}-pad-{pad.reference}-{pad.number}")


def _box(view: View, pad: Pad) -> Path:
    (w, h), (x, y) = pad.size, pad.centre
    return view.path(rectangle(x - w / 2, y - h / 2, x + w / 2, y + h / 2))


def _bend(sheet: Sheet, layout: Layout, bend: Bend, view: View) -> None:
    """The line about which the tail is bent, and what the bend takes of it as a band."""
    low, high = layout.reach_at(bend.line)
    if bend.end > bend.start:
        sheet.draw(view.path(rectangle(bend.start, low, bend.end, high)), None, TAKEN)
    x, pen = view.x(bend.line), flat(2.0, BEND, BEND_DASHES)
    sheet.line(x, view.y(high) + 8.0, x, view.y(low) - 8.0, pen)


def _labels(sheet: Sheet, layout: Layout, view: View, name: str) -> None:
    """The names of coils, of capacitors and of contacts."""
    reach = min(layout.spec.coil.size) / 2
    size = max(12.0, min(30.0, 0.25 * view.length(reach)))
    for coil in layout.coils:
        at = _free_place(layout, coil.centre, 0.9 * size / view.length(1.0))
        with sheet.group(f"{name}-coil-{coil.name}"):
            sheet.text(view.x(at.x), view.y(at.y) - 0.35 * size, coil.name, size, "middle", halo=4.0)
    for each in layout.capacitors:
        size = min(12.0, max(7.0, 0.4 * view.length(max(each.pads[0].size))))
        x, y = view.x(each.centre.x), view.y(each.centre.y)
        sheet.text(x, y - 0.35 * size, each.reference, size, "middle", halo=4.0)
    _contact_names(sheet, layout, view, name)


def _contact_names(sheet: Sheet, layout: Layout, view: View, name: str) -> None:
    """Each contact's number and pin on it, as high as their pitch allows, so that no two cover each other."""
    rows = sorted(pad.centre for pad in layout.pads)
    pitch = view.length(min((a.distance(b) for a, b in combinations(rows, 2)), default=math.inf))
    size = min(16.0, 0.75 * pitch)
    with sheet.group(f"{name}-contact-names"):
        for pad in layout.pads:
            x, y = view.x(pad.centre.x), view.y(pad.centre.y)
            words = f"{pad.number}" if pad.is_unused else f"{pad.number}: {pad.pin}"
            if pad.size[1] > pad.size[0]:  # a tail that turns: written along the contact
                sheet.text(x + 0.35 * size, y, words, size, "middle", 90.0)
            else:
                sheet.text(x, y - 0.35 * size, words, size, "middle")


def _free_place(layout: Layout, centre: Point, step: float) -> Point:
    """The centre of a coil, or a place one step beside it, whichever is farthest from every via."""
    places = [centre.shifted(i * step, j * step) for i, j in ((0, 0), (0, 1), (0, -1), (-1, 0), (1, 0))]
    return max(places, key=lambda p: round(min((p.distance(via.centre) for via in layout.vias), default=0.0), 9))


def _marks(sheet: Sheet, marks: list[Mark], view: View, name: str) -> None:
    """A ring at each place, with its text beside it; places that would hide one another share a ring."""
    taken: list[tuple[float, float, float]] = []
    for group in _shared(marks, view):
        kind = next(kind for kind in MARKS if any(mark.kind == kind for mark in group))
        x, y, text = view.x(group[0].x), view.y(group[0].y), ", ".join(mark.text for mark in group)
        wide = 12.0 * len(text)
        left = x - 18.0 - wide if x > WIDTH - 120.0 else x + 18.0
        low = y + 12.0
        while any(left < end and start < left + wide and abs(low - other) < 22.0 for start, end, other in taken):
            low += 22.0
        taken.append((left, left + wide, low))
        with ExitStack() as names:
            names.enter_context(sheet.group(kind=f"mark-{kind}"))
            for mark in group:
                names.enter_context(sheet.group(f"{name}-finding-{mark.text}"))
            sheet.draw(circle(Point(x, y), 13.0), Pen(6.0, WHITE))
            sheet.draw(circle(Point(x, y), 13.0), Pen(3.0, MARKS[kind]))
            sheet.text(left, low, text, 22.0, colour=MARKS[kind], halo=5.0, bold=True)


def _shared(marks: list[Mark], view: View) -> list[list[Mark]]:
    """The marks by the ring that they share."""
    groups: list[list[Mark]] = []
    for mark in marks:
        here = Point(view.x(mark.x), view.y(mark.y))
        near = (g for g in groups if here.distance(Point(view.x(g[0].x), view.y(g[0].y))) < 26.0)
        group = next(near, None)
        if group is None:
            groups.append([mark])
        else:
            group.append(mark)
    return groups
