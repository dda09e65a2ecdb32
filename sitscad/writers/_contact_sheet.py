"""The second sheet of the board drawing: the contacts at a scale at which they can be read, numbered, with a table of
where each leads.
"""

from __future__ import annotations

from sitscad.geometry.path import Path, bounding_box, rectangle
from sitscad.layout.board import Layout, Pad
from sitscad.layout.contacts import HEAD, contacts
from sitscad.writers._clipping import Box, parts_inside
from sitscad.writers._drawing import (
    CHAIN,
    HIDDEN,
    THICK,
    THIN,
    View,
    detail_scale,
    new_sheet,
    paragraph,
    placed,
    scale_text,
    table,
)
from sitscad.writers._sheet import Pen, Sheet, text_width

ROOM = (22.0, 52.0, 112.0, 132.0)
"""Room for the contacts on paper: left, low, width, height (mm)."""
AROUND = 0.6e-3
"""So much of the board (m) is drawn about the contacts."""
COPPER, CONTACT = "#d8b08c", "#e6c200"
COLUMNS = (16.0, 18.0, 16.0, 16.0, 28.0, 20.0, 20.0)


def contact_sheet(layout: Layout, artwork: str) -> Sheet | None:
    """The sheet; None for a board without contacts."""
    if not layout.pads:
        return None
    x0, y0, x1, y1 = bounding_box([_shape(pad) for pad in layout.pads])
    box = (x0 - AROUND, y0 - AROUND, x1 + AROUND, y1 + AROUND)
    scale = detail_scale((box[2] - box[0], box[3] - box[1]), ROOM[2:])
    sheet = new_sheet(layout.spec.name, "flexible circuit, contacts", f"{scale_text(scale)}", artwork)
    view = placed(box, scale, ROOM)
    _draw(sheet, layout, view, box)
    size = 2.3 if len(layout.pads) <= 24 else 1.8
    low = table(sheet, 148.0, 190.0, COLUMNS, [HEAD, *(contact.cells for contact in contacts(layout))], size)
    paragraph(sheet, 148.0, low - 2.0, 134.0, list(_notes(layout)), 2.3)
    return sheet


def _shape(pad: Pad) -> Path:
    (w, h), (x, y) = pad.size, pad.centre
    return rectangle(x - w / 2, y - h / 2, x + w / 2, y + h / 2)


def _draw(sheet: Sheet, layout: Layout, view: View, box: Box) -> None:
    for trace in layout.on_layer(1):
        half = trace.width / 2
        for piece in parts_inside(trace.path, (box[0] + half, box[1] + half, box[2] - half, box[3] - half)):
            sheet.draw(view.path(piece), Pen(view.length(trace.width), COPPER))
    for pad in layout.pads:
        sheet.draw(view.path(_shape(pad)), THIN, CONTACT)
    for opening in layout.top_openings:
        for piece in parts_inside(opening.outline, box):
            sheet.draw(view.path(piece), HIDDEN)
    for piece in parts_inside(layout.outline, box):
        sheet.draw(view.path(piece), THICK)
    sheet.draw(view.path(rectangle(*box)), CHAIN)
    for pad in layout.pads:
        _number(sheet, pad, view)


def _number(sheet: Sheet, pad: Pad, view: View) -> None:
    """Number and pin in the contact, along its longer side, as large as fits."""
    text = f"{pad.number}: {pad.pin}"
    along, across = sorted((view.length(side) for side in pad.size), reverse=True)
    size = min(4.0, 0.75 * across, 0.94 * along / text_width(text, 1.0))
    x, y = view.x(pad.centre.x), view.y(pad.centre.y)
    if pad.size[0] >= pad.size[1]:
        sheet.text(x, y - 0.35 * size, text, size, "middle")
    else:
        sheet.text(x + 0.35 * size, y, text, size, "middle", 90.0)


def _notes(layout: Layout) -> list[str]:
    connector = layout.spec.fpc.tail.connector if layout.spec.fpc.tail is not None else None
    named = f" of {connector.name}" if connector is not None else ""
    return [
        f"Contacts{named} seen from the top, where they are bare. Each is marked with its number and its pin.",
        "Both contacts of a coil are one net: they are joined through its winding.",
        "Coils are wired to the channels in their order; which end is A and which is B is of no matter to the reading.",
    ]
