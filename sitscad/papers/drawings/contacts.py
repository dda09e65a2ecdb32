"""The second sheet of the board drawing: the contacts at a scale at which they can be read, numbered, with a table of
where each leads.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

from sitscad.drawing.frame import (
    CHAIN,
    HIDDEN,
    TEXT,
    THICK,
    THIN,
    View,
    fitting_paragraph,
    mm,
    new_sheet,
    outer_span,
    placed,
    scale_for,
    scale_text,
    span,
    table,
)
from sitscad.drawing.pictures.board import pad_outline
from sitscad.drawing.sheet import Pen, Sheet, text_width
from sitscad.fabrication.board_end import (
    bare_size,
    board_end,
    contact_row,
    contact_size,
    contact_text,
    end_tolerance,
    plug_text,
    runs_along_x,
)
from sitscad.fabrication.notes import chip_text, stiffener_text
from sitscad.geometry.areas import areas_inside, parts_inside
from sitscad.geometry.convex import Box
from sitscad.geometry.path import bounding_box, circle, rectangle
from sitscad.layout.board import Layout
from sitscad.layout.tail_tracks import contact_rows
from sitscad.spec.presets import board_kind

ROOM = (30.0, 54.0, 84.0, 116.0)  # Room for the contacts on paper: left, low, width, height (mm)
AROUND = 0.6e-3  # So much of the board (m) is drawn about the contacts
STAND, STEP = 5.0, 8.0  # Of the first dimension line from the view, and of the next one from that (mm)
COPPER, CONTACT = "#d8b08c", "#e6c200"
COLUMNS = (16.0, 18.0, 16.0, 16.0, 28.0, 20.0, 20.0)


def contact_sheet(layout: Layout, artwork: str, forced: bool = False) -> Sheet | None:
    """The sheet; None for a board without contacts."""
    if not layout.pads:
        return None
    x0, y0, x1, y1 = bounding_box([pad_outline(pad) for pad in layout.pads])
    box = (x0 - AROUND, y0 - AROUND, x1 + AROUND, y1 + AROUND)
    scale = scale_for((box[2] - box[0], box[3] - box[1]), ROOM[2:])
    title = f"{board_kind(layout.spec.fpc.stackup)} circuit, contacts"
    sheet = new_sheet(layout.spec, title, f"{scale_text(scale)}", artwork, forced)
    view = placed(box, scale, ROOM)
    _draw(sheet, layout, view, box)
    size = 2.3 if len(layout.pads) <= 24 else 1.8
    low = table(sheet, 148.0, 190.0, COLUMNS, contact_rows(layout), size)
    fitting_paragraph(sheet, 148.0, low - 2.0, 134.0, 40.0, list(_notes(layout)), 2.3)
    return sheet


def draw_copper(sheet: Sheet, layout: Layout, view: View, box: Box, name: str, is_within: bool = False) -> None:
    """The top layer's tracks whose middles lie in a box, or that lie `is_within` it with their width, and what of
    teardrops and vias does; `name` begins every id.
    """
    for net, traces in groupby(layout.on_layer(1), key=lambda trace: trace.net):
        with sheet.group(f"{name}-copper-1-net-{net}", kind=f"net-{net}"):
            for trace in traces:
                half = trace.width / 2 if is_within else 0.0
                for piece in parts_inside(trace.path, (box[0] + half, box[1] + half, box[2] - half, box[3] - half)):
                    sheet.draw(view.path(piece), Pen(view.length(trace.width), COPPER))
    areas = [(drop.outline, drop.net) for drop in layout.teardrops if drop.layer == 1]
    areas += [(circle(via.centre, via.pad / 2), via.net) for via in layout.vias]
    for area, net in areas:
        for inside in areas_inside(area, box):
            sheet.draw(view.path(inside), None, COPPER, kind=f"net-{net}")


def _draw(sheet: Sheet, layout: Layout, view: View, box: Box) -> None:
    """Draw what lies inside the box: copper, holes, openings, outline, dimensions."""
    draw_copper(sheet, layout, view, box, "contacts", True)
    for via in layout.vias:
        for inside in areas_inside(circle(via.centre, via.drill / 2), box):
            sheet.draw(view.path(inside), THIN, "#ffffff")
    for pad in layout.pads:
        name = f"contacts-pad-{pad.reference}-{pad.number}"
        sheet.draw(view.path(pad_outline(pad)), THIN, CONTACT, name=name, kind=f"net-{pad.net}")
    for opening in layout.top_openings:
        for piece in parts_inside(opening.outline, box):
            sheet.draw(view.path(piece), HIDDEN)
    for piece in parts_inside(layout.outline, box):
        sheet.draw(view.path(piece), THICK)
    sheet.draw(view.path(rectangle(*box)), CHAIN)
    _dimensions(sheet, layout, view, box)
    for pad in layout.pads:
        # Number and pin in the contact, along its longer side, as large as fits
        text = f"{pad.number}" if pad.is_unused else f"{pad.number}: {pad.pin}"
        along, across = sorted((view.length(side) for side in pad.size), reverse=True)
        size = min(4.0, 0.75 * across, 0.94 * along / text_width(text, 1.0))
        x, y = view.x(pad.centre.x), view.y(pad.centre.y)
        if pad.size[0] >= pad.size[1]:
            sheet.text(x, y - 0.35 * size, text, size, "middle")
        else:
            sheet.text(x + 0.35 * size, y, text, size, "middle", 90.0)


def _dimensions(sheet: Sheet, layout: Layout, view: View, box: Box) -> None:
    """Width and length of the last contact of the row, the pitch to the one before, and what is measured at its end."""
    row, pitch = contact_row(layout.pads)
    (w, h), (x, y) = row[-1].size, row[-1].centre
    left, low, right, high = view.x(box[0]), view.y(box[1]), view.x(box[2]), view.y(box[3])
    _end(sheet, layout, view, (left, low, right, high))
    names = ("length", "width") if w >= h else ("width", "length")
    xs, ys = (view.x(x - w / 2), view.x(x + w / 2)), (view.y(y - h / 2), view.y(y + h / 2))
    _dimension(sheet, 0, xs, ys[1], high + STAND, f"{names[0]} {mm(w)}")
    _dimension(sheet, 1, ys, xs[0], left - STAND, f"{names[1]} {mm(h)}")
    if pitch is None:
        return
    before = row[-2].centre
    if abs(before.x - x) > abs(before.y - y):
        _dimension(sheet, 0, (view.x(before.x), view.x(x)), ys[0], low - STAND, f"pitch {mm(pitch)}")
    else:
        # Before it are the other contacts; beyond it the words would lie on the dimension of the edge.
        pair = view.y(before.y), view.y(y)
        _dimension(sheet, 1, pair, xs[1], right + STAND, f"pitch {mm(pitch)}", is_before=True)


def _end(sheet: Sheet, layout: Layout, view: View, frame: Box) -> None:
    """The board's width with its tolerance, from contact 1 to the edge, what is bare, and on to the board's end."""
    end, (row, _) = board_end(layout), contact_row(layout.pads)
    across, along = (1, 0) if runs_along_x(row) else (0, 1)
    axes = view.x, view.y
    # The coordinate (m) at which the contacts end, along themselves
    place, half = end.first.centre, end.first.size[along] / 2
    tip = place[along] + half if end.end > place[along] else place[along] - half
    outward = 1.0 if end.end > tip else -1.0

    def level(axis: int, step: int) -> float:
        # Below or right of the view; behind contacts that run along y, where pitch and numbers leave room
        aside = STAND + step * STEP
        if axis == 1:
            return frame[2] + aside
        return frame[3] + aside if along == 1 and outward < 0.0 else frame[1] - aside

    near = min(end.sides, key=lambda side: abs(side - place[across]))
    behind = tip if along == 0 else tip - outward * end.first.size[along]
    edge, sides = sorted((axes[across](near), axes[across](place[across]))), [axes[across](side) for side in end.sides]
    _dimension(sheet, across, edge, axes[along](behind), level(across, 1), f"edge to 1: {mm(end.edge)}")
    width = f"{mm(end.width)} +/- {mm(end_tolerance(layout.spec.fpc))}"
    _dimension(sheet, across, sides, axes[along](end.end), level(across, 2), width)
    last = row[0] if along == 0 else row[-1]
    start = axes[across](last.centre[across] + (-1 if along == 0 else 1) * last.size[across] / 2)
    reaches = sorted((axes[along](tip), axes[along](end.end)))
    _dimension(sheet, along, reaches, start, level(along, 1), f"to end {mm(end.tip)}")
    bare = bare_size(layout)
    if bare is not None and bare[0] > contact_size(end.first)[0] - 1e-9:
        shown = sorted((axes[along](tip), axes[along](tip - outward * bare[1])))
        _dimension(sheet, along, shown, start, level(along, 0), f"bare {mm(bare[1])}")


def _dimension(
    sheet: Sheet, axis: int, ends: Sequence[float], start: float, level: float, text: str, is_before: bool = False
) -> None:
    """A dimension along x (axis 0) at a height of the paper, or along y (axis 1) at an x of it, led there from `start`;
    words that do not fit between its ends stand beyond, or before them.
    """
    over = level + math.copysign(1.0, level - start)
    for end in ends:
        sheet.line(*((end, start, end, over) if axis == 0 else (start, end, over, end)), THIN)
    one, other = ((end, level) if axis == 0 else (level, end) for end in ends)
    if ends[1] - ends[0] > text_width(text, TEXT) + 5.0:
        span(sheet, one, other, text)
    else:
        outer_span(sheet, one, other, text, is_before=is_before)


def _notes(layout: Layout) -> list[str]:
    """How the contacts are to be read, in words."""
    connector = layout.spec.fpc.tail.connector if layout.spec.fpc.tail is not None else None
    named = f" of {connector.name}" if connector is not None else ""
    return [
        f"Contacts{named} seen from the top, where they are bare. Each is marked with its number and its pin.",
        f"{contact_text(layout)}.", *([text] if (text := chip_text(layout)) else []),
        *([f"{plug_text(layout).capitalize()}: closer than the rest of the outline."] if plug_text(layout) else []),
        *([f"Stiffener below them: {stiffener_text(layout)}."] if layout.stiffener is not None else []),
        "Both contacts of a coil are one net: they are joined through its winding.",
        "Coils are wired to the channels in their order; which end is A and which is B is of no matter to the reading.",
    ]
