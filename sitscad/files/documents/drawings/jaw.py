"""The jaw drawing: dimensioned section of the closed jaws with the port's circle, and side views closed and open.

The views are drawn from the dimensions, with glue lines, that decide whether the closed jaws pass the port. They need
no CAD kernel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from sitscad.assembly.places.bodies import Body, plates_of
from sitscad.assembly.places.column import Layer, column
from sitscad.assembly.places.fit import closed_section, closing_motion, measures
from sitscad.assembly.places.jaws import jaw_range, jaw_section
from sitscad.assembly.places.tail_path import bends
from sitscad.basics.check_results import Closing
from sitscad.basics.units import show
from sitscad.files.documents.drawings.fit import draw_jaws_from_side, draw_layer_names, draw_section
from sitscad.files.documents.piece_places import piece_sizes
from sitscad.files.drawing.frame import (
    HIDDEN,
    SUBSTITUTE,
    TEXT,
    THIN,
    View,
    draw_dimension,
    draw_paragraph,
    draw_short_dimension,
    draw_table,
    mm,
    new_sheet,
    numbered_notes,
    scale_for,
    scale_text,
)
from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.sheet import Sheet, text_width
from sitscad.files.drawing.svg import svg
from sitscad.files.order_facts.notes import bent_text
from sitscad.kernels.geometry.convex import Box
from sitscad.layout.bending import Bend
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw

SECTION = (34.0, 92.0, 92.0, 92.0)
"""Room for the section on paper: left edge, lower edge, width, height (mm).

Its dimensions need more space around it.
"""
SIDES = 198.0, 86.0  # Left edge and largest width of the side views (mm)
CLOSED, OPEN = 176.0, 112.0  # Heights of the pivots in the side views, closed and open (mm)
HIGHEST = 20.0  # Largest height of the closed pair in the side view (mm)


def render(layout: Layout, forced: str) -> dict[str, bytes]:
    """Return ``mount/NAME-jaw-drawing.svg`` and ``.pdf``, stamped if `forced`; empty without a jaw.

    Raises `PartsError` if the shield does not fit into the standoff.
    """
    sheet = jaw_sheet(layout, bool(forced))
    if sheet is None:
        return {}
    name = f"mount/{layout.spec.name}-jaw-drawing"
    return {f"{name}.svg": svg(sheet).encode("utf-8"), f"{name}.pdf": pdf([sheet])}


def jaw_sheet(layout: Layout, forced: bool = False) -> Sheet | None:
    """Return the sheet; None if there is no jaw. Raises `PartsError` if the shield does not fit into the standoff."""
    jaw, pair, closes = layout.spec.jaw, closed_section(layout), closing_motion(layout)
    if jaw is None or pair is None or closes is None:
        return None
    across = max(jaw.port_diameter, pair.height, 2.0 * pair.radius)
    scale = scale_for((across, across), SECTION[2:])
    scales = f"section {scale_text(scale)}"
    title = f"jaw {jaw.name}"
    sheet = new_sheet(layout.spec.name, layout.spec.issue, title, scales, "see the package", forced,
                      "the jaw from its tip")
    view = View(scale, (SECTION[0] + SECTION[2] / 2, SECTION[1] + SECTION[3] / 2))
    with sheet.group("jaw-section"):
        draw_section(sheet, layout, jaw, view)
        draw_layer_names(sheet, layout, jaw, view, SECTION[0] + SECTION[2])
        # The sizes across the section: the pair's height, the port, the jaw's face, the board's width
        half, radius = pair.height / 2, max(jaw.port_diameter / 2, pair.radius)
        left = view.x(-radius) - 7.0
        for z in (-half, half):
            sheet.line(view.x(0.0), view.y(z), left - 1.0, view.y(z), THIN)
        draw_dimension(sheet, (left, view.y(-half)), (left, view.y(half)), f"{mm(pair.height)} back to back")
        face, board = jaw_section(jaw).face, layout.body_size[1]
        lines = [(jaw.port_diameter, f"port {mm(jaw.port_diameter)}")]
        lines += [(face, f"jaw's face {mm(face)}"), (board, f"board {mm(board)}")]
        low = view.y(-radius) - 5.0
        for i, (size, label) in enumerate(sorted(lines)):
            y = low - 5.5 * i
            start = view.y(0.0) if size == jaw.port_diameter else low + 3.0
            for x in (-size / 2, size / 2):
                sheet.line(view.x(x), start, view.x(x), y - 1.0, HIDDEN)
            draw_dimension(sheet, (view.x(-size / 2), y), (view.x(size / 2), y), label)
    with sheet.group("jaw-sides"):
        _draw_side_views(sheet, layout, jaw, closes)
    rows = [("measure (mm)", "nominal", "root-sum-square", "at worst", "limit")]
    rows += [(m.name, mm(m.nominal), mm(m.root_sum_square), mm(m.worst), mm(m.limit)) for m in measures(layout)]
    low = draw_table(sheet, 16.0, 66.0, (42.0, 22.0, 28.0, 22.0, 22.0), rows, 2.4)
    draw_paragraph(sheet, 16.0, low - 2.0, 140.0, 10.0,
                   numbered_notes(_notes(bends(layout), bent_text(layout), column(layout), jaw, closes)), 2.3)
    return sheet


def _draw_side_views(sheet: Sheet, layout: Layout, jaw: Jaw, closes: Closing) -> None:
    """Draw both jaws from the side: closed, and fully open about the pivot if hinge and opening are known."""
    start, heel = jaw_range(layout.body, jaw)
    pivot = heel + (jaw.hinge if jaw.hinge is not None else 0.0)
    turn = (closes.opening or 0.0) / 2 if closes.reach is not None else 0.0
    scale = scale_for((1.15 * (pivot - start), jaw.port_diameter), (SIDES[1], HIGHEST))
    right = SIDES[0] + SIDES[1]
    gap = closes.parallel_at if closes.reach is not None else 0.0
    closed, label = _closed_tilt(layout.body, plates_of(layout.spec).all, closes, pivot)
    draw_jaws_from_side(sheet, layout, jaw, (right, CLOSED), pivot, scale, closed, gap)
    lift = scale * 1e3 * (pivot - start) * math.sin(closed)
    reach = scale * 1e3 * jaw.port_diameter
    captions = [f"{label}, {scale_text(scale)}, the tip on the left"]
    draw_paragraph(sheet, SIDES[0], CLOSED + reach + lift + 6.0, SIDES[1], CLOSED + 0.6 * reach + lift, captions,
                   TEXT)
    y = CLOSED - 0.5 * reach - lift - 6.0
    ends = right - scale * 1e3 * (pivot - start), right - scale * 1e3 * (pivot - heel)
    draw_dimension(sheet, (ends[0], y), (ends[1], y), mm(jaw.length))
    if jaw.hinge:
        beside = f", pivot {mm(abs(jaw.pivot_offset))} beside the middle" if jaw.pivot_offset else ""
        draw_dimension(sheet, (ends[1], y), (right, y), f"{mm(jaw.hinge)}{beside}")
    # distances from the tip to the pieces glued on the face
    begins = {part: end - start for part, (end, _) in piece_sizes(layout).items()} | {"board": layout.body[0] - start}
    for distance in sorted(set(begins.values())):
        y -= 5.5
        label = f"{', '.join(part for part, each in begins.items() if each == distance)} {mm(distance)}"
        end = ends[0] + scale * 1e3 * distance
        if distance > 0.0:
            is_before = end + 6.0 + SUBSTITUTE * text_width(label, TEXT) > right
            draw_short_dimension(sheet, (ends[0], y), (end, y), label, is_before=is_before)
    if not turn:
        label = "The jaw's hinge or opening is not known (mount.jaw.hinge, mount.jaw.opening): not drawn open."
        draw_paragraph(sheet, SIDES[0], OPEN, SIDES[1], 60.0, [label], TEXT)
        return
    draw_jaws_from_side(sheet, layout, jaw, (right, OPEN), pivot, scale, turn, gap)
    most = closes.most
    between = f", {show(most, 'm', 3)} between the faces at the sensor's middle" if most is not None else ""
    label = f"open by {math.degrees(2 * turn):.3g} deg{between}"
    draw_paragraph(sheet, SIDES[0], OPEN - 34.0, SIDES[1], 44.0, [label], TEXT)


def _closed_tilt(body: Box, pieces: tuple[Body, ...], closes: Closing, pivot: float) -> tuple[float, str]:
    """Return the tilt (rad) of each jaw in the closed view, and the caption of the view.

    The tilt is 0 if the jaws can be parallel with tissue between them. If the sensor is too thick for this, the tilt
    is set so that the sensor touches at its end nearest to the hinge (heel).
    """
    if closes.reach is None:
        return 0.0, "closed"
    if closes.parallel_at >= 0.0:
        return 0.0, f"closed, parallel on tissue {mm(closes.parallel_at)} thick"
    ends = [piece.footprint.box[2] for piece in pieces] or [body[2]]
    touching = replace(closes, reach=pivot - max(ends))
    angle = touching.tilt(0.0)
    if angle is None:
        return 0.0, "closed"
    return angle / 2.0, f"closed until the sensor touches at the heel: open by {math.degrees(angle):.2g} deg"


def _notes(
    tail_bends: tuple[Bend, ...], bend_note: str, layers: tuple[Layer, ...], jaw: Jaw, closes: Closing
) -> Iterator[str]:
    """Yield the notes on the section and on the source of its dimensions."""
    glued = [layer for layer in layers if layer.is_glue]
    yield "Millimetres. The red circle is the port about the closed pair's axis; jaws closed without force."
    if glued:
        thick = mm(glued[0].thickness.nominal)
        yield f"{len(glued)} glue lines of {thick} (green), counted in the height."
    else:
        yield "No glue line is counted: assembly.glue_line is zero."
    if closes.parallel_at >= 0.0:
        slide = closes.slide(0.0)
        slides = f" From none to that they slide by {mm(abs(slide))} along each other." if slide else ""
        yield f"The faces are parallel on tissue {mm(closes.parallel_at)} thick.{slides}"
    else:
        yield "The sensor is too thick for the faces ever to be parallel: they touch at the heel first."
    if tail_bends:
        yield bend_note
    if jaw.source:
        yield f"The jaw's sizes: {jaw.source}"
