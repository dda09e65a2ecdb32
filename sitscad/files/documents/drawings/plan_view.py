"""Top view of the sensor: elastomer and target over the coils, to scale, with the coordinates of their edges.

The sensor separates three axes of force by the overlap of target and coils, which this view shows. The assembly
drawing, the report and the data sheet contain it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.assembly.places.bodies import Body, BodyRole, plates_of
from sitscad.basics.units import show
from sitscad.files.drawing.frame import (
    CHAIN,
    TEXT,
    THICK,
    THIN,
    View,
    centred_view,
    draw_axes,
    draw_ordinates,
    draw_origin,
    draw_paragraph,
    draw_table,
    mm,
    new_sheet,
    numbered_notes,
    scale_for,
    scale_text,
)
from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.pictures.layout_picture import draw_coil
from sitscad.files.drawing.sheet import Pen, Sheet, text_width
from sitscad.kernels.geometry.areas import parts_inside
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, bounding_box, rectangle
from sitscad.layout.board import Layout
from sitscad.spec.materials import Encapsulation

ROOM = (44.0, 34.0, 116.0, 146.0)
"""Room for the view on paper: left edge, lower edge, width, height (mm). Its dimensions need more space around it."""
COLUMN = 176.0  # Left edge of the table and the notes (mm)
PENS = {"elastomer": Pen(0.4, "#1f5fa8", (3.0, 1.2)), "target": Pen(1.0, "#e07ba8")}
"""Pens for the outlines of elastomer and target, which differ in colour and line type."""
COPPER = "#e3c4a6"
LARGEST = Pen(0.5, "#d00000", (2.0, 1.0))


def plan_sheet(layout: Layout, forced: bool = False) -> Sheet | None:
    """Return the sheet; None if the board carries neither elastomer nor target."""
    pieces = plates_of(layout.spec).all
    if not pieces:
        return None
    box = _shown_box(layout.body, layout.largest_outline, pieces)
    scale = scale_for((box[2] - box[0], box[3] - box[1]), ROOM[2:])
    drawn = layout.spec.coil.drawn
    title, hashes = "assembly, pieces over the coils", f"the board's are in {'fpc/' if drawn is None else drawn}"
    sheet = new_sheet(layout.spec.name, layout.spec.issue, title, scale_text(scale), hashes, forced)
    view = centred_view(box, scale, ROOM)
    _draw_view(sheet, layout, pieces, view, box)
    # The edges of body and pieces and the coils' centres, by their coordinates
    boxes = [layout.body, *(piece.footprint.box for piece in pieces)]
    low, left = min(view.y(box[1]) for box in boxes), min(view.x(box[0]) for box in boxes)
    centres = [coil.centre for coil in layout.coils]
    xs = [x for box in boxes for x in (box[0], box[2])] + [centre.x for centre in centres]
    ys = [y for box in boxes for y in (box[1], box[3])] + [centre.y for centre in centres]
    draw_ordinates(sheet, view, 0, xs, low, low - 7.0)
    draw_ordinates(sheet, view, 1, ys, left, left - 9.0)
    draw_axes(sheet, left - 16.0, low - 16.0, 8.0, TEXT)
    rows = [("coil", "x", "y", "turned by")]
    for coil in layout.coils:
        turned = f"{math.degrees(coil.placement.rotation):g} deg"
        rows.append((coil.name, mm(coil.centre.x), mm(coil.centre.y), turned))
    low = draw_table(sheet, COLUMN, 190.0, (22.0, 28.0, 28.0, 28.0), rows, 2.6) - 8.0
    for piece in {piece.role: piece for piece in reversed(pieces)}.values():  # legend of the lines
        sheet.line(COLUMN + 1.0, low + 1.0, COLUMN + 15.0, low + 1.0, PENS[piece.role.value])
        sheet.text(COLUMN + 18.0, low, f"{piece.role.value}: {_size_text(piece)}, {piece.material}", 2.6)
        low -= 5.0
    largest = [(LARGEST, "largest outline that is asked for")] * (layout.spec.fpc.largest is not None)
    for pen, label in ((THICK, "edge of the board"), *largest, (THIN, "outer edge of a coil"),
                       (Pen(1.0, COPPER), "copper of layer 1"), (CHAIN, "axes of coils; here the tail goes on")):
        sheet.line(COLUMN + 1.0, low + 1.0, COLUMN + 15.0, low + 1.0, pen)
        sheet.text(COLUMN + 18.0, low, label, 2.6)
        low -= 5.0
    glue_lines = plates_of(layout.spec).lines_below_target
    lines = _notes(layout.spec.assembly.glue_line, layout.spec.encapsulation, glue_lines, pieces)
    draw_paragraph(sheet, COLUMN, low - 2.0, 106.0, 42.0, numbered_notes(lines), 2.4)
    return sheet


def draw_plan(sheet: Sheet, layout: Layout, room: tuple[float, float, float, float]) -> None:
    """Draw the view without dimensions on another sheet, in a room (left edge, lower edge, width, height; mm)."""
    pieces = plates_of(layout.spec).all
    box = _shown_box(layout.body, layout.largest_outline, pieces)
    view = centred_view(box, plan_scale(layout, room), room)
    _draw_view(sheet, layout, pieces, view, box)
    draw_axes(sheet, view.x(box[0]), view.y(box[1]) - 12.0, 8.0, TEXT)


def plan_scale(layout: Layout, room: tuple[float, float, float, float]) -> float:
    """Return the scale that `draw_plan` uses in a room (left edge, lower edge, width, height; mm)."""
    box = _shown_box(layout.body, layout.largest_outline, plates_of(layout.spec).all)
    return scale_for((box[2] - box[0], box[3] - box[1]), room[2:])


def _draw_view(sheet: Sheet, layout: Layout, pieces: tuple[Body, ...], view: View, box: Box) -> None:
    """Draw the board, the pieces over it, and on top the names of the coils.

    `box` (x0, y0, x1, y1; m) encloses the board's body and the pieces. The tail is cut off beyond it.
    """
    # The visible part of the board: its edge, tracks on its top face, coils with their centres, the origin
    limit = box[2] + 0.04 * (box[2] - box[0])
    within = (-math.inf, -math.inf, limit, math.inf)
    for trace in layout.on_layer(1):
        for part in parts_inside(trace.path, within):
            sheet.draw(view.path(part), Pen(view.length(trace.width), COPPER))
    for edge in parts_inside(layout.outline, within):
        sheet.draw(view.path(edge), THICK)
    sheet.line(view.x(limit), view.y(box[1]) - 2.0, view.x(limit), view.y(box[3]) + 2.0, CHAIN)
    for coil in layout.coils:
        draw_coil(sheet, view, layout.spec.coil, coil, THIN)
    if (largest := layout.largest_outline) is not None:
        sheet.draw(view.path(largest), LARGEST)
    draw_origin(sheet, view)
    for piece in reversed(pieces):  # the lower piece last: its dashes stay visible on an equal outline
        sheet.draw(view.path(piece.outline()), PENS[piece.role.value])
    # Each coil's name beside its centre, on a white ground, on the first side where it covers no line of a piece
    size = 3.2
    outlines = [view.path(piece.outline()) for piece in pieces]
    for coil in layout.coils:
        x, y, wide = view.x(coil.centre.x), view.y(coil.centre.y), text_width(coil.name, size)
        places = [(x + dx, y + dy) for dx in (1.4, -1.4 - wide) for dy in (1.4, -1.4 - 0.8 * size)]
        boxes = [(left - 0.6, low - 0.6, left + wide + 0.6, low + 0.8 * size + 0.2) for left, low in places]
        free = (k for k, box in enumerate(boxes) if not any(any(parts_inside(outline, box)) for outline in outlines))
        k = next(free, 0)
        sheet.draw(rectangle(*boxes[k]), None, "#ffffff")
        sheet.text(*places[k], coil.name, size)


def _shown_box(body: Box, outline: Path | None, pieces: tuple[Body, ...]) -> Box:
    """Return the bounding box (m) of the board's body, all pieces over it, and the largest outline."""
    boxes = [body, *(piece.footprint.box for piece in pieces), *([bounding_box([outline])] if outline else [])]
    low = [min(box[axis] for box in boxes) for axis in (0, 1)]
    high = [max(box[axis] for box in boxes) for axis in (2, 3)]
    return low[0], low[1], high[0], high[1]


def _size_text(piece: Body) -> str:
    thick, (x, y) = show(piece.upper - piece.lower, "m"), piece.footprint.size
    across = f"diameter {show(x, 'm')}" if piece.footprint.is_round else f"{show(x, 'm')} x {show(y, 'm')}"
    return f"{across}, {thick} thick"


def _notes(
    glue_line: float, film: Encapsulation | None, lines_below_target: int, pieces: tuple[Body, ...]
) -> Iterator[str]:
    yield "Coordinates in mm from the origin of the board's files (red cross). Edges of what is turned: its extent."
    for piece in sorted(pieces, key=lambda piece: -piece.lower):  # the upper ones first, each in the order of its cells
        at, turn = piece.footprint.centre, math.degrees(piece.footprint.rotation)
        turned = f", turned by {turn:g} deg" if turn else ""
        face = "the board's top face"
        lines = lines_below_target if piece.role is BodyRole.TARGET else 1
        above = f"{show(piece.lower + lines * glue_line, 'm')} above {face}"
        above = f"{above} with the glue" if glue_line else f"on {face}" if piece.lower <= 0.0 else above
        yield f"{piece.name.capitalize()}: centre at x = {mm(at.x)}, y = {mm(at.y)}{turned}; {above}, unloaded."
    if film is not None:
        yield f"Over all of it {show(film.thickness, 'm')} of {film.material.name}, not drawn."


def assembly_pdf(layout: Layout, forced: str) -> dict[str, bytes]:
    """Return ``laser/NAME-assembly.pdf``, stamped if `forced`; empty for a sensor without elastomer and target."""
    sheet = plan_sheet(layout, bool(forced))
    return {} if sheet is None else {f"laser/{layout.spec.name}-assembly.pdf": pdf([sheet])}
