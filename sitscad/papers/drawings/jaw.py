"""The jaw drawing: the closed pair in section with the port's circle and its dimensions, and the jaws closed and open.

All of it from the scene's figures, glue lines included, without a CAD kernel: the very ones that decide whether the
pair passes its port.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from sitscad.drawing.frame import (
    CHAIN,
    HIDDEN,
    TEXT,
    THIN,
    View,
    detail_scale,
    fitting_paragraph,
    mm,
    new_sheet,
    scale_text,
    span,
    spread,
    table,
)
from sitscad.drawing.pdf import pdf
from sitscad.drawing.sheet import Pen, Sheet
from sitscad.drawing.svg import svg
from sitscad.geometry.path import Path, Point, circle, closed_polygon, polyline, rectangle
from sitscad.layout.board import Layout
from sitscad.measured import Closing
from sitscad.scene.bodies import MOUNT_PIECES, above_board
from sitscad.scene.column import column, levels
from sitscad.scene.fit import ClosedSection, closed_section, measures
from sitscad.scene.grasper.closing import closing
from sitscad.scene.grasper.jaws import axis, fitted_jaw, half_width, jaw_range, rim, section
from sitscad.spec.sensor import Jaw
from sitscad.units import decimal, show

SECTION = (34.0, 92.0, 92.0, 92.0)
"""Room for the section on paper: left, low, width, height (mm); dimensions stand around it."""
SIDES = 198.0, 86.0
"""Where the views from the side begin along the paper, and how wide they may be (mm)."""
CLOSED, OPEN = 176.0, 112.0
"""The heights of the pivots in the views from the side, closed and open (mm)."""
COLOURS = {
    "jaw": "#a8adb5", "opposing-jaw": "#c9cdd3", "opposing-pad": "#5f6b6d", "shield": "#d98a4b", "board": "#c07f1f",
    "elastomer": "#e8d8c8", "target": "#d98a4b", "encapsulation": "#9fc5e8", **dict.fromkeys(MOUNT_PIECES, "#dfe6e9"),
}  # fmt: skip
GLUE = "#4d6b1f"
EDGE = Pen(0.18)
PORT = Pen(0.35, "#b00000", (3.0, 1.5))
STEPS = 12
"""Straight stretches that a side along the port's circle is drawn with."""

Place = Callable[[Point], Point]


def render(layout: Layout, forced: str) -> dict[str, bytes]:
    """``mount/NAME-jaw-drawing.svg`` and ``.pdf``; nothing without a jaw; stamped where ``forced``.

    Raises `PartsError` where the shield does not fit into the standoff.
    """
    sheet = drawing(layout, bool(forced))
    if sheet is None:
        return {}
    name = f"mount/{layout.spec.name}-jaw-drawing"
    return {f"{name}.svg": svg(sheet).encode("utf-8"), f"{name}.pdf": pdf([sheet])}


def drawing(layout: Layout, forced: bool = False) -> Sheet | None:
    """The sheet; None without a jaw. Raises `PartsError` where the shield does not fit into the standoff."""
    jaw, pair, closes = fitted_jaw(layout), closed_section(layout), closing(layout)
    if jaw is None or pair is None or closes is None:
        return None
    across = max(jaw.port_diameter, pair.height, 2.0 * pair.radius)
    scale = detail_scale((across, across), SECTION[2:])
    sheet = new_sheet(
        layout.spec,
        f"jaw {jaw.name}",
        f"section {scale_text(scale)}",
        "see the package",
        forced,
        "the jaw from its tip",
    )
    view = View(scale, (SECTION[0] + SECTION[2] / 2, SECTION[1] + SECTION[3] / 2))
    with sheet.group("jaw-section"):
        _section(sheet, layout, jaw, view)
        _names(sheet, layout, jaw, view)
        _section_sizes(sheet, layout, jaw, pair, view)
    with sheet.group("jaw-sides"):
        _sides(sheet, layout, jaw, closes)
    low = table(sheet, 16.0, 66.0, (42.0, 22.0, 28.0, 22.0, 22.0), list(_rows(layout)), 2.4)
    fitting_paragraph(sheet, 16.0, low - 2.0, 140.0, 10.0, list(_notes(layout, jaw, closes)), 2.3)
    return sheet


def _section(sheet: Sheet, layout: Layout, jaw: Jaw, view: View) -> None:
    """Every layer across the jaw at its height, glue between them, and the port's circle about the pair's axis."""
    layers = column(layout)
    at = {name: (lower.nominal, upper.nominal) for name, (lower, upper) in levels(layers).items()}
    middle = at["opposing-jaw"][1] / 2

    def draw(path: Path, name: str) -> None:
        placed = path.mapped(lambda p: Point(view.x(p.x), view.y(p.y - middle)))
        sheet.draw(placed, EDGE, COLOURS[name], f"jaw-section-{name}")

    lower = section(rim(jaw)).outline.mapped(lambda p: Point(p.x, p.y + at["jaw"][1] + rim(jaw).height - jaw.height))
    draw(lower, "jaw")
    draw(section(jaw).outline.rotated(math.pi).shifted(0.0, at["opposing-jaw"][0]), "opposing-jaw")
    if "encapsulation" in at:
        for path in _film(layout, at):
            draw(path, "encapsulation")
    for layer in layers:
        if layer.part in COLOURS and layer.part not in ("jaw", "opposing-jaw", "encapsulation"):
            draw(_across(layout, jaw, layer.part, at), layer.part)
    for layer in (layer for layer in layers if layer.is_glue):
        under, over = at[layer.part]
        half = _half(layout, jaw, layer.part.removeprefix("glue under the "), under)
        ends = [Point(view.x(-half), view.y(under - middle)), Point(view.x(half), view.y(over - middle))]
        sheet.draw(rectangle(ends[0].x, ends[0].y, ends[1].x, ends[1].y), None, GLUE)
    sheet.draw(circle(Point(view.x(0.0), view.y(0.0)), view.length(jaw.port_diameter / 2)), PORT, name="jaw-port")
    reach = 0.55 * view.length(jaw.port_diameter)
    x, y = view.x(0.0), view.y(0.0)
    sheet.line(x - reach, y, x + reach, y, CHAIN)
    sheet.line(x, y - reach, x, y + reach, CHAIN)


def _half(layout: Layout, jaw: Jaw, part: str, level: float) -> float:
    """Half the width (m) of a layer; `level` is a height above the jaw's lowest point."""
    plates = above_board(layout.spec)
    if part == "encapsulation" and plates:  # where it goes over the uppermost plate
        part = plates[-1].name
    if part in ("board", "encapsulation"):
        return layout.body_size[1] / 2
    if part == "opposing-pad":
        return section(jaw).face / 2
    for body in plates:
        if body.name == part:
            return (body.footprint.box[3] - body.footprint.box[1]) / 2
    at = levels(column(layout))
    return half_width(layout, level - at["board"][1].nominal)


def _across(layout: Layout, jaw: Jaw, part: str, at: dict[str, tuple[float, float]]) -> Path:
    """A layer's outline (m): a rectangle, or for the seat's pieces one whose sides follow the port's circle."""
    lower, upper = at[part]
    for body in above_board(layout.spec):
        if body.name == part:
            y = axis(layout).y
            return rectangle(body.footprint.box[1] - y, lower, body.footprint.box[3] - y, upper)
    if part not in MOUNT_PIECES:
        half = _half(layout, jaw, part, lower)
        return rectangle(-half, lower, half, upper)
    heights = [lower + (upper - lower) * i / STEPS for i in range(STEPS + 1)]
    right = [Point(_half(layout, jaw, part, z), z) for z in heights]
    return closed_polygon([*right, *(Point(-p.x, p.y) for p in reversed(right))])


def _film(layout: Layout, at: dict[str, tuple[float, float]]) -> Iterator[Path]:
    """The film on the board and round what stands on it (m), drawn before that."""
    (_, board), (lower, upper) = at["board"], at["encapsulation"]
    thick, half, y = upper - lower, layout.body_size[1] / 2, axis(layout).y
    yield rectangle(-half, board, half, board + thick)
    for body in above_board(layout.spec):
        _, y0, _, y1 = body.footprint.box
        foot = max(board, at[body.name][0] - thick)
        yield rectangle(y0 - y - thick, foot, y1 - y + thick, at[body.name][1] + thick)


def _names(sheet: Sheet, layout: Layout, jaw: Jaw, view: View) -> None:
    """Beside the section every layer with its thickness and its tolerance, glue lines in one row."""
    layers = column(layout)
    at, named = levels(layers), [layer for layer in layers if not layer.is_glue]
    middle = at["opposing-jaw"][1].nominal / 2
    heights = [view.y((at[layer.part][0].nominal + at[layer.part][1].nominal) / 2 - middle) for layer in named]
    right = SECTION[0] + SECTION[2]
    for layer, height, row in zip(named, heights, spread(heights, 4.6), strict=True):
        lower = at[layer.part][0].nominal
        half = section(jaw).face / 3 if layer.part.endswith("jaw") else 0.97 * _half(layout, jaw, layer.part, lower)
        sheet.line(view.x(half), height, right - 6.0, height, THIN)
        sheet.line(right - 6.0, height, right + 2.0, row, THIN)
        words = f"{layer.part} {mm(layer.thickness.nominal)} \xb1{decimal(layer.thickness.spread * 1e3, 3)}"
        sheet.text(right + 3.0, row - 0.35 * TEXT, words, TEXT)


def _section_sizes(sheet: Sheet, layout: Layout, jaw: Jaw, pair: ClosedSection, view: View) -> None:
    """The sizes across the section: the pair's height, the port, the jaw's face, the board's width."""
    half, radius = pair.height / 2, max(jaw.port_diameter / 2, pair.radius)
    left = view.x(-radius) - 7.0
    for z in (-half, half):
        sheet.line(view.x(0.0), view.y(z), left - 1.0, view.y(z), THIN)
    span(sheet, (left, view.y(-half)), (left, view.y(half)), f"{mm(pair.height)} back to back")
    face, board = section(jaw).face, layout.body_size[1]
    lines = [(jaw.port_diameter, f"port {mm(jaw.port_diameter)}")]
    lines += [(face, f"jaw's face {mm(face)}"), (board, f"board {mm(board)}")]
    low = view.y(-radius) - 5.0
    for i, (size, words) in enumerate(sorted(lines)):
        y = low - 5.5 * i
        for x in (-size / 2, size / 2):
            sheet.line(view.x(x), view.y(0.0) if size == jaw.port_diameter else low + 3.0, view.x(x), y - 1.0, HIDDEN)
        span(sheet, (view.x(-size / 2), y), (view.x(size / 2), y), words)


def _sides(sheet: Sheet, layout: Layout, jaw: Jaw, closes: Closing) -> None:
    """The pair from the side, closed and wide open about its pivot; closed alone where the hinge is not known."""
    start, heel = jaw_range(layout, jaw)
    pivot = heel + (jaw.hinge if jaw.hinge is not None else 0.0)
    turn = (closes.opening or 0.0) / 2 if closes.reach is not None else 0.0
    scale = detail_scale((1.15 * (pivot - start), 1e-9), (SIDES[1], 1.0))
    right = SIDES[0] + SIDES[1]
    _side(sheet, layout, jaw, (right, CLOSED), pivot, scale, 0.0)
    reach = scale * 1e3 * jaw.port_diameter
    sheet.text(SIDES[0], CLOSED + reach, f"closed, {scale_text(scale)}, the tip on the left", TEXT)
    y = CLOSED - 0.5 * reach - 6.0
    ends = right - scale * 1e3 * (pivot - start), right - scale * 1e3 * (pivot - heel)
    span(sheet, (ends[0], y), (ends[1], y), mm(jaw.length))
    if jaw.hinge:
        beside = f", pivot {mm(abs(jaw.pivot_offset))} beside the middle" if jaw.pivot_offset else ""
        span(sheet, (ends[1], y), (right, y), f"{mm(jaw.hinge)}{beside}")
    if not turn:
        words = "The jaw's hinge or opening is not known (mount.jaw.hinge, mount.jaw.opening): not drawn open."
        fitting_paragraph(sheet, SIDES[0], OPEN, SIDES[1], 60.0, [words], TEXT)
        return
    _side(sheet, layout, jaw, (right, OPEN), pivot, scale, turn)
    most = closes.most
    gap = f", {show(most, 'm', 3)} between the faces at the sensor's middle" if most is not None else ""
    words = f"open by {math.degrees(2 * turn):.3g} deg{gap}"
    fitting_paragraph(sheet, SIDES[0], OPEN - 34.0, SIDES[1], 44.0, [words], TEXT)


def _side(
    sheet: Sheet, layout: Layout, jaw: Jaw, at: tuple[float, float], pivot: float, scale: float, turn: float
) -> None:
    """Both jaws from the side, each turned by an angle (rad) about the pivot, which stands before a place on paper or
    beside it.
    """
    layers, offset = levels(column(layout)), jaw.pivot_offset
    middle = layers["opposing-jaw"][1].nominal / 2 - offset
    level_line = at[1]
    at = at[0], at[1] - scale * 1e3 * offset
    x0, x1 = jaw_range(layout, jaw)
    body = layout.body[0], layout.body[2]
    plates = {piece.name: (piece.footprint.box[0], piece.footprint.box[2]) for piece in above_board(layout.spec)}
    for part, (low, high) in layers.items():
        if part not in COLOURS or part == "encapsulation":
            continue
        is_other = part.startswith("opposing")
        ends = (x0, x1) if part in ("jaw", "opposing-jaw", "opposing-pad") else plates.get(part, body)
        angle = -turn if is_other else turn
        path = rectangle(ends[0] - pivot, low.nominal - middle, ends[1] - pivot, high.nominal - middle)
        sheet.draw(_turned(path, angle, at, scale), EDGE, COLOURS[part])
    board = layers["board"]
    level = (board[0].nominal + board[1].nominal) / 2 - middle
    tail = rectangle(body[1] - pivot, level, min(0.0, x1 - pivot + 1e-3), level + 1e-6)
    sheet.draw(_turned(tail, turn, at, scale), Pen(0.35, COLOURS["board"]))
    for angle in sorted({turn, -turn}):
        along = polyline([Point(x0 - pivot, offset), Point(0.0, offset)])
        sheet.draw(_turned(along, angle, at, scale), HIDDEN)
    sheet.draw(circle(Point(*at), 0.8), EDGE, "#ffffff")
    sheet.line(at[0] - scale * 1e3 * (pivot - x0) - 4.0, level_line, at[0] + 4.0, level_line, CHAIN)


def _turned(path: Path, angle: float, at: tuple[float, float], scale: float) -> Path:
    """A path (m about the pivot) turned about it, on paper."""
    turned = path.rotated(angle)
    return turned.mapped(lambda p: Point(at[0] + scale * 1e3 * p.x, at[1] + scale * 1e3 * p.y))


def _rows(layout: Layout) -> Iterator[tuple[str, ...]]:
    """What is measured of the fit, against its limit."""
    yield "measure (mm)", "nominal", "root-sum-square", "at worst", "limit"
    for each in measures(layout):
        yield each.name, mm(each.nominal), mm(each.root_sum_square), mm(each.worst), mm(each.limit)


def _notes(layout: Layout, jaw: Jaw, closes: Closing) -> Iterator[str]:
    """How the section is to be read, and where its figures come from."""
    glued = [layer for layer in column(layout) if layer.is_glue]
    yield "1. Millimetres. The red circle is the port about the closed pair's axis; jaws closed without force."
    if glued:
        thick = mm(glued[0].thickness.nominal)
        yield f"2. {len(glued)} glue lines of {thick} (green), counted in the height."
    else:
        yield "2. No glue line is counted: assembly.glue_line is zero."
    if closes.parallel_at >= 0.0:
        slide = closes.slide(0.0)
        slides = f" From none to that they slide by {mm(abs(slide))} along each other." if slide else ""
        yield f"3. The faces are parallel on tissue {mm(closes.parallel_at)} thick.{slides}"
    else:
        yield "3. The sensor is too thick for the faces ever to be parallel: they touch at the heel first."
    if jaw.source:
        yield f"4. The jaw's sizes: {jaw.source}"
