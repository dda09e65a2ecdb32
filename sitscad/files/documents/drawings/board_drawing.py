"""The board drawing (SVG and PDF on A4): outline, coils, contacts, holes and zones, dimensioned by coordinates.

The second sheet shows the contacts at a legible scale, with a table of their nets. All coordinates refer to the origin
of the Gerber files, which the drawing marks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby

from sitscad.assembly.places.tail_path import bends, pivot_line
from sitscad.basics.units import show
from sitscad.files.drawing.frame import (
    CHAIN,
    HIDDEN,
    SCALES,
    TEXT,
    THICK,
    THIN,
    View,
    centred_view,
    draw_dimension,
    draw_ordinates,
    draw_origin,
    draw_paragraph,
    draw_short_dimension,
    draw_table,
    mm,
    new_sheet,
    numbered_notes,
    scale_for,
    scale_text,
    tool_symbol,
)
from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.pictures.layout_picture import coil_extent, draw_coil, layout_svg, pad_outline
from sitscad.files.drawing.sheet import Pen, Sheet, text_width
from sitscad.files.drawing.svg import svg
from sitscad.files.order_facts.board_end import (
    bare_size,
    board_end,
    contact_row,
    contact_size,
    contact_text,
    end_tolerance,
    plug_text,
    runs_along_x,
    tail_width,
)
from sitscad.files.order_facts.files import (
    UNIT,
    Tool,
    board_images,
    fabrication_path,
    millimetres,
    on_drawing,
    on_grid,
    plated_tools,
)
from sitscad.files.order_facts.notes import (
    bend_text,
    chip_texts,
    coil_text,
    finish_text,
    holes_text,
    outline_text,
    step_text,
    stiffener_text,
    thickness_texts,
    turn_text,
)
from sitscad.kernels.geometry.areas import areas_inside, parts_inside
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, Point, Region, bounding_box, circle, rectangle
from sitscad.layout.bending import Bend, bend_stretch
from sitscad.layout.board import Coil, Layout, Pad, Via
from sitscad.layout.lamination import tail_holes
from sitscad.layout.tail.tracks import contact_rows
from sitscad.spec.circuit import FpcSpec, Tail
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.presets import board_kind, cover_name, is_rigid

PLATE, BEND = "#dddddd", "#eef3e2"
BEND_LINE = Pen(0.35, "#4d6b1f", (5.0, 1.0, 1.0, 1.0, 1.0, 1.0))
"""Bend lines: two dots and a dash, the line type of bent positions."""
WHOLE = (40.0, 132.0, 225.0, 47.0)
"""Room for the whole board on paper: left edge, lower edge, width, height (mm).

Its dimensions need more space around it.
"""
DETAIL = (36.0, 32.0, 112.0, 70.0)


def render(layout: Layout, forced: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the drawing as PDF, and its sheets as SVG, by path in the package.

    `files` are the images whose fingerprint the drawing states. Each sheet is stamped if `forced` is not empty.
    """
    artwork = on_drawing("board", files, board_images(files))
    sheets = {"drawing.svg": board_sheet(layout, artwork, bool(forced))}
    if (details := contact_sheet(layout, artwork, bool(forced))) is not None:
        sheets["contacts.svg"] = details
    outputs = {fabrication_path(layout.spec.name, name): svg(sheet).encode("utf-8") for name, sheet in sheets.items()}
    return outputs | {fabrication_path(layout.spec.name, "drawing.pdf"): pdf(list(sheets.values()))}


def board_sheet(layout: Layout, artwork: str, forced: bool = False) -> Sheet:
    """Return the sheet of the board: whole board, enlarged body, table of holes and notes.

    `artwork` is the text in the title block that names the files of the board and their fingerprint. The sheet is
    stamped if `forced`.
    """
    box = bounding_box([layout.outline])
    detail = scale_for(layout.body_size, DETAIL[2:])
    # the detail is larger than the whole, unless the body is drawn at 1:1 or less: half of 1:1 is illegible
    smaller = tuple(scale for scale in SCALES if scale < detail - 1e-9 or scale <= 1.0)
    whole = scale_for((box[2] - box[0], box[3] - box[1]), WHOLE[2:], smaller or SCALES[-1:])
    scales = f"{scale_text(whole)} (whole), {scale_text(detail)} (body)"
    title = f"{board_kind(layout.spec.fpc.stackup)} circuit, board"
    sheet = new_sheet(layout.spec.name, layout.spec.issue, title, scales, artwork, forced)
    _draw_whole_board(sheet, layout, centred_view(box, whole, WHOLE))
    # The body alone, cut off at its end
    view = centred_view(layout.body, detail, DETAIL)
    x0, y0, x1, y1 = layout.body
    limit = x1 + 0.05 * (x1 - x0)
    _draw_top_copper(sheet, layout, view, limit, "drawing-body")
    shown = parts_inside(layout.outline, (-math.inf, -math.inf, limit + 1e-9, math.inf))
    sheet.draw([view.path(piece) for piece in shown], THICK, name="drawing-body-outline")
    _draw_marks(sheet, layout.coils, layout.spec.coil, plated_tools(layout), view, "drawing-body", limit)
    sheet.line(view.x(limit), view.y(y0) - 2.0, view.x(limit), view.y(y1) + 2.0, CHAIN)
    for coil in layout.coils:
        _draw_coil_name(sheet, layout.vias, view, coil)
    draw_ordinates(sheet, view, 0, [x0, x1, *(c.centre.x for c in layout.coils)], view.y(y0), view.y(y0) - 7.0)
    edges = [coil_extent(layout.spec.coil, coil)[side] for coil in layout.coils for side in (1, 3)]
    draw_ordinates(sheet, view, 1, [y0, y1, *edges, *(c.centre.y for c in layout.coils)], view.x(x0), view.x(x0) - 9.0)
    sheet.text(WHOLE[0] - 24.0, 194.0, f"whole board, {scale_text(whole)}", 3.2)
    sheet.text(WHOLE[0] - 24.0, DETAIL[1] + DETAIL[3] + 8.0, f"body, {scale_text(detail)}", 3.2)
    low = _draw_hole_table(sheet, layout.vias, plated_tools(layout), 161.0, 108.0)
    draw_paragraph(sheet, 161.0, low - 2.0, 121.0, 40.0, numbered_notes(board_notes(layout)), 2.3)
    return sheet


def _draw_whole_board(sheet: Sheet, layout: Layout, view: View) -> None:
    x0, y0, x1, y1 = bounding_box([layout.outline])
    # The stiffener as an area, bends as line and area, coverlay openings as broken lines
    named = _draw_stiffener(sheet, layout, view)
    for opening in (*layout.top_openings, *layout.bottom_openings):
        sheet.draw(view.path(opening.outline), HIDDEN)
    # Areas of the bends, under the tracks
    for bend in bends(layout):
        if bend.end > bend.start:
            below, above = layout.reach_at(bend.line)
            sheet.draw(view.path(rectangle(bend.start, below, bend.end, above)), Pen(0.18, "#7a8f4a", (2.0, 1.0)), BEND)
    _draw_top_copper(sheet, layout, view, x1, "drawing")
    sheet.draw(view.path(layout.outline), THICK, name="drawing-outline")
    _draw_marks(sheet, layout.coils, layout.spec.coil, plated_tools(layout), view, "drawing")
    low, high = view.y(y0), view.y(y1)
    stations = list(_dimensioned_x(layout))
    draw_ordinates(sheet, view, 0, stations, low, low - 7.0)
    tail = _tail_end_y(layout.outline, layout.pads, layout.spec.fpc.tail)
    draw_ordinates(sheet, view, 1, [y0, y1, *tail, layout.body[1], layout.body[3]], view.x(x0), view.x(x0) - 9.0)
    below = low - 9.0 - max(text_width(mm(x), TEXT) for x in stations)  # the ordinates
    reached = 0.0  # top on paper of the dimension of the tail's width
    if (width_at := tail_width(layout.body[2], layout.outline, layout.pads, layout.spec.fpc.tail)) is not None:
        at, bottom, top = view.x(width_at[0]), view.y(width_at[1]), view.y(width_at[2])
        draw_short_dimension(sheet, (at, bottom), (at, top), _tail_width_text(layout.spec.fpc, width_at), upright=True)
        reached = top + 5.0 + TEXT
    level = max(high + 6.0, named + 2.0, reached + 2.0, _draw_bends(sheet, layout, view, below) + 4.0)
    tolerance = _outline_tolerance_text(layout.spec.fpc.rules)
    draw_dimension(sheet, (view.x(x0), level), (view.x(x1), level), f"{mm(x1 - x0)} +/- {tolerance}")
    for x in (x0, x1):
        sheet.line(view.x(x), high + 1.0, view.x(x), level + 1.0, THIN)
    side = view.x(x1) + (12.0 if layout.pads else 7.0)  # beyond the numbers of the contacts
    draw_dimension(sheet, (side, low), (side, high), f"{mm(y1 - y0)} +/- {tolerance}")


def _draw_stiffener(sheet: Sheet, layout: Layout, view: View) -> float:
    """Draw the stiffener and its name.

    Return the y (mm on paper) of the name's upper edge if the name stands above the dimension of the tail's width, else
    0. It stands there if it would overlap the dimension elsewhere.
    """
    if layout.stiffener is None:
        return 0.0
    above, size, name = 1.2, 2.3, "stiffener below"
    width_at = tail_width(layout.body[2], layout.outline, layout.pads, layout.spec.fpc.tail)
    sheet.draw(view.path(layout.stiffener.outline.outline), THIN, PLATE)
    box = bounding_box([layout.stiffener.outline.outline])
    if _has_turn(layout.spec.fpc.tail):
        sheet.text(view.x(box[0]) - 6.0, view.y((box[1] + box[3]) / 2) - 0.8, name, size, "end")
        return 0.0
    low = view.y(max([box[3], *(bounding_box([each.outline])[3] for each in layout.top_openings)])) + above
    left, over = view.x(box[2]) - text_width(name, size), 0.0
    width_text = "" if width_at is None else _tail_width_text(layout.spec.fpc, width_at)
    if width_at is not None and left < view.x(width_at[0]) + 1.0 + text_width(width_text, TEXT):
        low = over = view.y(width_at[2]) + 5.5 + TEXT
        over += size
    sheet.text(view.x(box[2]), low, name, size, "end")
    return over


def _tail_width_text(fpc: FpcSpec, width_at: tuple[float, float, float]) -> str:
    usual, end = _outline_tolerance_text(fpc.rules), mm(end_tolerance(fpc))
    at_contacts = "" if end == usual else f", +/- {end} at the contacts"
    return f"tail {mm(width_at[2] - width_at[1])} +/- {usual}{at_contacts}"


def _dimensioned_x(layout: Layout) -> Iterator[float]:
    """Yield the dimensioned x coordinates (m) of the board: ends, coils, body, bends, stiffener, contacts."""
    x0, _, x1, _ = bounding_box([layout.outline])
    yield from (x0, x1, layout.body[2], *(coil.centre.x for coil in layout.coils))
    yield from bend_stretch(layout) or ()
    yield from (bend.line for bend in bends(layout))
    if layout.stiffener is not None:
        yield bounding_box([layout.stiffener.outline.outline])[0]
    if not _has_turn(layout.spec.fpc.tail):
        yield from {pad.centre.x - pad.size[0] / 2 for pad in layout.pads}


def _has_turn(tail: Tail | None) -> bool:
    return tail is not None and tail.turn != "none"


def _tail_end_y(outline: Path, pads: tuple[Pad, ...], tail: Tail | None) -> tuple[float, ...]:
    """Return the lowest and the highest y (m) of the outline at its largest x, where the tail ends.

    If the tail turns sideways, return the y (m) of both ends of contact 1 instead. Empty if the outline has no point
    there.
    """
    if _has_turn(tail):
        return tuple({pad.centre.y - side * pad.size[1] / 2 for pad in pads[:1] for side in (-1, 1)})
    x1 = bounding_box([outline])[2]
    ys = [p.y for p in outline.flattened(1e-5) if p.x > x1 - 1e-6]
    return (min(ys), max(ys)) if ys else ()


def _draw_coil_name(sheet: Sheet, vias: tuple[Via, ...], view: View, coil: Coil) -> None:
    """Draw a coil's name on a white ground beside its centre, in the quarter farthest from vias."""
    size, x, y = 3.2, view.x(coil.centre.x), view.y(coil.centre.y)
    wide = text_width(coil.name, size)
    corners = [(x + 1.4 if right else x - 1.4 - wide, y + 1.4 if up else y - 1.4 - 0.8 * size)
               for right in (True, False) for up in (True, False)]

    def crowding(corner: tuple[float, float]) -> float:
        middle = corner[0] + wide / 2, corner[1] + 0.4 * size
        gaps = (math.dist((view.x(via.centre.x), view.y(via.centre.y)), middle) for via in vias)
        return -min(3.0 * size, min(gaps, default=math.inf))

    left, low = min(corners, key=crowding)
    sheet.draw(rectangle(left - 0.4, low - 0.4, left + wide + 0.4, low + 0.8 * size), None, "#ffffff")
    sheet.text(left, low, coil.name, size)


def _draw_bends(sheet: Sheet, layout: Layout, view: View, below: float) -> float:
    """Draw the tail's bend lines with their directions and angles; return the y (mm on paper) of their upper ends.

    The text stands beside the bend lines. If it would cross the board's outline there, its top is at `below` (mm on
    paper), under the coordinate dimensions.
    """
    tail_bends, tail = bends(layout), layout.spec.fpc.tail
    if not tail_bends or tail is None:
        return 0.0
    is_above, size = tail.turn == "right" or tail.offset < 0.0, 2.3
    low, high = math.inf, -math.inf
    for bend in tail_bends:
        y0, y1 = layout.reach_at(bend.line)
        ends = view.y(y0) - (2.5 if is_above else 4.0), view.y(y1) + (10.5 if is_above else 2.5)
        sheet.line(view.x(bend.line), ends[1], view.x(bend.line), ends[0], BEND_LINE)
        low, high = min(low, ends[0]), max(high, ends[1])
    at, before, top = view.x(tail_bends[-1].line), view.x(tail_bends[0].line) - 1.0, high - 2.0 if is_above else low
    room = view.x(bounding_box([layout.outline])[2]) - at - 1.0
    lines, outline = _bend_captions(tail_bends, room), view.path(layout.outline)
    wide = max(text_width(line, size) for line in lines)
    places = [Point(before - wide * k / 8.0, top - 3.2 * row) for k in range(9) for row in range(len(lines))]
    place, anchor = (at + 1.0, "start") if wide < room else (before, "end")
    if wide >= room and any(outline.distance(point) < 1.5 for point in places):
        place, anchor, top, lines = at, "middle", below - size, (", ".join(lines),)
    for row, line in enumerate(lines):
        sheet.text(place, top - 3.2 * row, line, size, anchor, colour=BEND_LINE.colour)
    return high


def _bend_captions(tail_bends: Sequence[Bend], room: float) -> tuple[str, ...]:
    """Describe the tail's bends from the body outwards, in two lines if one is wider than `room` (mm on paper)."""
    angles = ", ".join(f"{bend.angle_text} {bend.direction}" for bend in tail_bends)
    label = f"bend{'s' * (len(tail_bends) > 1)} {angles}"
    if tail_bends[0].radius is None:
        return (label,)
    radius = f"R min {mm(tail_bends[0].radius)} inside"
    single_line = f"{label}, {radius}"
    return (single_line,) if text_width(single_line, 2.3) < room else (label, radius)


def _draw_top_copper(sheet: Sheet, layout: Layout, view: View, limit: float, name: str) -> None:
    """Draw the top layer's tracks and the contacts up to x = `limit` (m). `name` begins each id in the SVG."""
    draw_copper(sheet, layout, view, (-math.inf, -math.inf, limit + 1e-9, math.inf), name)
    for pad in layout.all_pads:
        if pad.centre.x + pad.size[0] / 2 <= limit + 1e-9:
            outline_path, ident = view.path(pad_outline(pad)), f"{name}-pad-{pad.reference}-{pad.number}"
            edge = Pen(min(THIN.width, view.length(min(pad.size)) / 5.0))  # contacts side by side stay apart
            sheet.draw(outline_path, edge, CONTACT, name=ident, kind=f"net-{pad.net}")
    if limit >= bounding_box([layout.outline])[2] - 1e-9:
        _draw_end_numbers(sheet, layout.outline, layout.pads, layout.top_openings, view)


def _draw_end_numbers(
    sheet: Sheet, outline: Path, pads: tuple[Pad, ...], top_openings: tuple[Region, ...], view: View
) -> None:
    """Draw the numbers of the first and the last contact beside them.

    The second sheet has the numbers of all contacts.
    """
    if len(pads) < 2:
        return
    ends = min(pads, key=lambda pad: pad.number), max(pads, key=lambda pad: pad.number)
    (xa, ya), (xb, yb) = (pad.centre for pad in ends)
    bounds = bounding_box([outline, *(each.outline for each in top_openings)])
    for pad, sign in zip(ends, (1.0, -1.0), strict=True):
        x, y = view.x(pad.centre.x), view.y(pad.centre.y)
        if abs(ya - yb) >= abs(xa - xb):
            out = view.x(bounds[2]) + 1.0
            sheet.text(out, y - 0.8 + sign * math.copysign(0.9, ya - yb), str(pad.number), 2.3)
        else:
            out = sign * math.copysign(view.length(2.0 * pad.size[0]) + 4.0, xa - xb)
            sheet.text(x + out, y - 0.8, str(pad.number), 2.3, "middle")


def _draw_marks(
    sheet: Sheet, coils: tuple[Coil, ...], spec: CoilSpec, tools: list[Tool], view: View, name: str,
    limit: float = float("inf"),
) -> None:
    """Draw each coil's outer edge and centre, the holes up to x = `limit` (m), and the origin of the coordinates.

    `tools` are the drilled holes by diameter. `name` begins each id in the SVG.
    """
    for coil in coils:
        draw_coil(sheet, view, spec, coil, CHAIN, f"{name}-coil-{coil.name}")
    for order, tool in enumerate(tools):
        for hole in tool.holes:
            if hole.x * UNIT <= limit:
                at, radius = Point(view.x(hole.x * UNIT), view.y(hole.y * UNIT)), view.length(tool.diameter * UNIT / 2)
                _draw_hole(sheet, at, radius, order)
    draw_origin(sheet, view)


def _draw_hole(sheet: Sheet, at: Point, radius: float, tool: int) -> None:
    """Draw a hole to scale, and the symbol of tool number `tool` at a legible size."""
    sheet.draw(circle(at, radius), THIN, "#ffffff")
    sheet.draw(tool_symbol(tool, at, max(1.5 * radius, 0.6)), Pen(0.13))


def _draw_hole_table(sheet: Sheet, vias: tuple[Via, ...], tools: list[Tool], left: float, top: float) -> float:
    rows = [["", "finished hole", "holes", "plated", "pad"]]
    for tool in tools:
        pads = sorted({show(v.pad, "m") for v in vias if on_grid(v.drill) == tool.diameter})
        plated = tool.words.removeprefix("plated").removeprefix(", ") or "yes, all layers"
        rows.append(["", f"{millimetres(tool.diameter, 3)} mm", str(len(tool.holes)), plated, ", ".join(pads)])
    if len(rows) == 1:
        rows.append(["", "none", "", "", ""])
    low = draw_table(sheet, left, top, (8.0, 30.0, 16.0, 34.0, 38.0), rows)
    step = (top - low) / len(rows)
    for order in range(len(tools)):
        _draw_hole(sheet, Point(left + 4.0, top - (order + 1.55) * step), 0.8, order)
    return low


def board_notes(layout: Layout) -> Iterator[str]:
    """Yield the notes of the drawing."""
    rules = layout.spec.fpc.rules
    register = show(rules.registration, "m")
    yield "Coordinates in mm from the files' origin (red cross). No layer is mirrored."
    cover = f"{cover_name(layout.spec.fpc.stackup)} within {show(rules.coverlay_registration, 'm')} of the copper"
    yield f"Outline {outline_text(rules)}, layers in register within {register}, {cover} (rules {rules.name})."
    yield coil_text(layout.coils, layout.spec.coil)
    if (reference := layout.reference) is not None and reference.placement.own is not None:
        yield coil_text((reference,), reference.placement.own)
    yield f"Finished thickness: {', '.join(f'{k} {v}' for k, v in thickness_texts(layout).items())}."
    if tail_holes(layout):
        layers, tail_layers = layout.copper_layers, layout.spec.fpc.tail_copper
        yield f"Holes: {holes_text(layers, layout.vias, tail_layers, tail_holes(layout))}."
    if step := step_text(layout.spec.fpc, layout.vias, layout.lap_start):
        yield step
    if layout.stiffener is not None:
        yield f"Stiffener below the contacts: {stiffener_text(layout.spec.fpc.tail, layout.stiffener)}."
    yield from chip_texts(layout.chips, layout.spec.readout.chip, layout.spec.soldered_thermistor)
    if layout.bend_zone is not None:
        yield bend_text(bend_stretch(layout), bends(layout), pivot_line(layout))
    if turn := turn_text(layout.spec.fpc.tail):
        yield turn
    yield finish_text(layout.pads, layout.spec.fpc, bool(layout.vias))
    standard = "IPC-6012" if is_rigid(layout.spec.fpc.stackup) else "IPC-6013"
    yield f"{standard} class 2. 100 % test by the netlist. Add no copper anywhere inside the outline."


def _outline_tolerance_text(rules: DesignRules) -> str:
    return mm(rules.outline_tolerance)


def render_pictures(layout: Layout) -> dict[str, bytes]:
    """Return pictures of the whole board and of its body, which carries the coils, by path in the package."""
    return {
        fabrication_path(layout.spec.name, "board.svg"): layout_svg(layout).encode("utf-8"),
        fabrication_path(layout.spec.name, "body.svg"): layout_svg(layout, window=layout.body,
                                                                   name="body").encode("utf-8"),
    }


ROOM = (30.0, 54.0, 84.0, 116.0)  # Room for the contacts on paper: left, low, width, height (mm)
CONTACT_MARGIN = 0.6e-3  # Margin of the board (m) drawn about the contacts
# Distance of the first dimension line from the view, and of further lines from each other (mm)
DIMENSION_SPACING, STEP = 5.0, 8.0
COPPER, CONTACT = "#d8b08c", "#e6c200"
CONTACT_COLUMNS = (16.0, 18.0, 16.0, 16.0, 28.0, 20.0, 20.0)


def contact_sheet(layout: Layout, artwork: str, forced: bool = False) -> Sheet | None:
    """Return the sheet of the contacts; None for a board without contacts. Arguments are as in `board_sheet`."""
    if not layout.pads:
        return None
    x0, y0, x1, y1 = bounding_box([pad_outline(pad) for pad in layout.pads])
    box = (x0 - CONTACT_MARGIN, y0 - CONTACT_MARGIN, x1 + CONTACT_MARGIN, y1 + CONTACT_MARGIN)
    scale = scale_for((box[2] - box[0], box[3] - box[1]), ROOM[2:])
    title = f"{board_kind(layout.spec.fpc.stackup)} circuit, contacts"
    sheet = new_sheet(layout.spec.name, layout.spec.issue, title, f"{scale_text(scale)}", artwork, forced)
    view = centred_view(box, scale, ROOM)
    _draw_contact_view(sheet, layout, view, box)
    size = 2.3 if len(layout.pads) <= 24 else 1.8
    low = draw_table(sheet, 148.0, 190.0, CONTACT_COLUMNS, contact_rows(layout), size)
    draw_paragraph(sheet, 148.0, low - 2.0, 134.0, 40.0, list(_contact_notes(layout)), 2.3)
    return sheet


def draw_copper(sheet: Sheet, layout: Layout, view: View, box: Box, name: str, is_within: bool = False) -> None:
    """Draw the top layer's tracks, teardrops and vias inside `box` (x0, y0, x1, y1; m).

    `name` begins each id in the SVG. Tracks are clipped so that their middle lines end at the box. If `is_within`,
    their edges end at the box.
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


def _draw_contact_view(sheet: Sheet, layout: Layout, view: View, box: Box) -> None:
    """Draw all features inside `box` (x0, y0, x1, y1; m): copper, holes, openings, outline, dimensions."""
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
    _draw_contact_dimensions(sheet, layout.outline, layout.pads, layout.spec.fpc, layout.top_openings, view, box)
    for pad in layout.pads:
        # Number and pin in the contact, along its longer side, as large as fits
        text = f"{pad.number}" if pad.is_unused else f"{pad.number}: {pad.pin}"
        length, across = sorted((view.length(side) for side in pad.size), reverse=True)
        size = min(4.0, 0.75 * across, 0.94 * length / text_width(text, 1.0))
        x, y = view.x(pad.centre.x), view.y(pad.centre.y)
        if pad.size[0] >= pad.size[1]:
            sheet.text(x, y - 0.35 * size, text, size, "middle")
        else:
            sheet.text(x + 0.35 * size, y, text, size, "middle", 90.0)


def _draw_contact_dimensions(
    sheet: Sheet, outline: Path, pads: tuple[Pad, ...], fpc: FpcSpec, top_openings: tuple[Region, ...], view: View,
    box: Box,
) -> None:
    """Draw width, length and pitch of the last contact of the row, and the dimensions of the board's end."""
    row, pitch = contact_row(pads)
    (w, h), (x, y) = row[-1].size, row[-1].centre
    left, low, right, high = view.x(box[0]), view.y(box[1]), view.x(box[2]), view.y(box[3])
    _draw_end_dimensions(sheet, outline, pads, fpc, top_openings, view, (left, low, right, high))
    names = ("length", "width") if w >= h else ("width", "length")
    xs, ys = (view.x(x - w / 2), view.x(x + w / 2)), (view.y(y - h / 2), view.y(y + h / 2))
    _draw_dimension(sheet, 0, xs, ys[1], high + DIMENSION_SPACING, f"{names[0]} {mm(w)}")
    _draw_dimension(sheet, 1, ys, xs[0], left - DIMENSION_SPACING, f"{names[1]} {mm(h)}")
    if pitch is None:
        return
    before = row[-2].centre
    if abs(before.x - x) > abs(before.y - y):
        _draw_dimension(sheet, 0, (view.x(before.x), view.x(x)), ys[0], low - DIMENSION_SPACING,
                        f"pitch {mm(pitch)}")
    else:
        # Before it are the other contacts; beyond it the words would lie on the dimension of the edge.
        pair = view.y(before.y), view.y(y)
        _draw_dimension(sheet, 1, pair, xs[1], right + DIMENSION_SPACING, f"pitch {mm(pitch)}", is_before=True)


def _draw_end_dimensions(
    sheet: Sheet, outline: Path, pads: tuple[Pad, ...], fpc: FpcSpec, top_openings: tuple[Region, ...], view: View,
    frame: Box,
) -> None:
    """Draw the dimensions of the board's end.

    They are its width, the distances of contact 1 from the edge and of the contacts from the end, and the bare length
    of the contacts. `frame` is the box of the view on paper (mm).
    """
    end, (row, _) = board_end(outline, pads), contact_row(pads)
    across, along = (1, 0) if runs_along_x(row) else (0, 1)
    axes = view.x, view.y
    # Coordinate (m) of the contacts' ends, along the contacts
    place, half = end.first.centre, end.first.size[along] / 2
    tip = place[along] + half if end.end > place[along] else place[along] - half
    outward = 1.0 if end.end > tip else -1.0

    def level(axis: int, step: int) -> float:
        # Below or right of the view; behind contacts that run along y, where pitch and numbers leave room
        distance = DIMENSION_SPACING + step * STEP
        if axis == 1:
            return frame[2] + distance
        return frame[3] + distance if along == 1 and outward < 0.0 else frame[1] - distance

    near = min(end.sides, key=lambda side: abs(side - place[across]))
    behind = tip if along == 0 else tip - outward * end.first.size[along]
    edge, sides = sorted((axes[across](near), axes[across](place[across]))), [axes[across](side) for side in end.sides]
    _draw_dimension(sheet, across, edge, axes[along](behind), level(across, 1), f"edge to 1: {mm(end.edge)}")
    width = f"{mm(end.width)} +/- {mm(end_tolerance(fpc))}"
    _draw_dimension(sheet, across, sides, axes[along](end.end), level(across, 2), width)
    last = row[0] if along == 0 else row[-1]
    start = axes[across](last.centre[across] + (-1 if along == 0 else 1) * last.size[across] / 2)
    reaches = sorted((axes[along](tip), axes[along](end.end)))
    _draw_dimension(sheet, along, reaches, start, level(along, 1), f"to end {mm(end.tip)}")
    bare_area = bare_size(pads, top_openings)
    if bare_area is not None and bare_area[0] > contact_size(end.first)[0] - 1e-9:
        shown = sorted((axes[along](tip), axes[along](tip - outward * bare_area[1])))
        _draw_dimension(sheet, along, shown, start, level(along, 0), f"bare {mm(bare_area[1])}")


def _draw_dimension(
    sheet: Sheet, axis: int, ends: Sequence[float], start: float, level: float, text: str, is_before: bool = False
) -> None:
    """Draw a dimension along x (`axis` 0) at the y `level`, or along y (`axis` 1) at the x `level`.

    All coordinates are mm on paper. `ends` are both ends of the dimensioned length. Extension lines begin at `start`. A
    text too long for this length stands beyond its second end, or before its first end if `is_before`.
    """
    over = level + math.copysign(1.0, level - start)
    for end in ends:
        sheet.line(*((end, start, end, over) if axis == 0 else (start, end, over, end)), THIN)
    first, other = ((end, level) if axis == 0 else (level, end) for end in ends)
    if ends[1] - ends[0] > text_width(text, TEXT) + 5.0:
        draw_dimension(sheet, first, other, text)
    else:
        draw_short_dimension(sheet, first, other, text, is_before=is_before)


def _contact_notes(layout: Layout) -> list[str]:
    """Return the notes on the contacts."""
    connector = layout.spec.fpc.tail.connector if layout.spec.fpc.tail is not None else None
    named = f" of {connector.name}" if connector is not None else ""
    plug, plate = plug_text(layout.pads, layout.spec.fpc), layout.stiffener
    return [
        f"Contacts{named} seen from the top, where they are bare. Each is marked with its number and its pin.",
        f"{contact_text(layout.pads, layout.spec.fpc.stackup, layout.top_openings)}.",
        *chip_texts(layout.chips, layout.spec.readout.chip, layout.spec.soldered_thermistor),
        *([f"{plug.capitalize()}: closer than the rest of the outline."] if plug else []),
        *([f"Stiffener below them: {stiffener_text(layout.spec.fpc.tail, plate)}."] if plate is not None else []),
        "Both contacts of a coil are one net: they are joined through its winding.",
        "Coils are wired to the channels in their order; which end is A and which is B is of no matter to the reading.",
    ]
