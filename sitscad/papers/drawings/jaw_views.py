"""Views of the closed pair that several drawings show: across the jaw, its layers' names, and from the side."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from sitscad.drawing.frame import CHAIN, HIDDEN, TEXT, THIN, View, mm, spread
from sitscad.drawing.sheet import Pen, Sheet
from sitscad.geometry.path import Path, Point, circle, closed_polygon, polyline, rectangle
from sitscad.layout.board import Layout
from sitscad.scene.bodies import MOUNT_PIECES, above_board
from sitscad.scene.column import column, levels
from sitscad.scene.jaws import POCKET_CLEARANCE, axis, half_width, jaw_range, section
from sitscad.scene.tail_path import tail_path
from sitscad.spec.mount import Jaw
from sitscad.units import decimal

COLOURS = {
    "jaw": "#a8adb5", "opposing-jaw": "#c9cdd3", "opposing-pad": "#5f6b6d", "shield": "#d98a4b", "board": "#c07f1f",
    "elastomer": "#e8d8c8", "target": "#d98a4b", "encapsulation": "#9fc5e8", **dict.fromkeys(MOUNT_PIECES, "#dfe6e9"),
}
GLUE = "#4d6b1f"
EDGE = Pen(0.18)
PORT = Pen(0.35, "#b00000", (3.0, 1.5))
TAIL_STEPS = 400  # Straight stretches that the whole tail is drawn with, from the side
STEPS = 12  # Straight stretches that a side along the port's circle is drawn with


def draw_section(sheet: Sheet, layout: Layout, jaw: Jaw, view: View, port: Pen = PORT) -> None:
    """Every layer across the jaw at its height, glue between them, and the port's circle about the pair's axis."""
    layers = column(layout)
    at = {name: (lower.nominal, upper.nominal) for name, (lower, upper) in levels(layers).items()}
    middle = at["opposing-jaw"][1] / 2

    def draw(path: Path, name: str) -> None:
        placed = path.mapped(lambda p: Point(view.x(p.x), view.y(p.y - middle)))
        sheet.draw(placed, EDGE, COLOURS[name], f"jaw-section-{name}")

    for path in _jaw(jaw, jaw.recess, jaw.pocket):
        draw(path.shifted(0.0, at["jaw"][1]), "jaw")
    for path in _jaw(jaw, jaw.opposing_recess, jaw.opposing_pocket):
        draw(path.rotated(math.pi).shifted(0.0, at["opposing-jaw"][0]), "opposing-jaw")
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
    sheet.draw(circle(Point(view.x(0.0), view.y(0.0)), view.length(jaw.port_diameter / 2)), port, name="jaw-port")
    reach = 0.55 * view.length(jaw.port_diameter)
    x, y = view.x(0.0), view.y(0.0)
    sheet.line(x - reach, y, x + reach, y, CHAIN)
    sheet.line(x, y - reach, x, y + reach, CHAIN)


def _jaw(jaw: Jaw, recess: float, pocket: tuple[float, float] | None) -> Iterator[Path]:
    """A jaw across its axis (m), its floor at height 0: with a pocket its bar to the rims, cut out of it."""
    if pocket is None or not recess:
        yield section(jaw).outline
        return
    tall, half = section(replace(jaw, height=jaw.height + recess)), pocket[1] / 2
    back = tall.outline.shifted(0.0, recess).segments[0]
    rims = [Point(tall.face / 2, recess), Point(half, recess), Point(half, 0.0), Point(-half, 0.0),
            Point(-half, recess), Point(-tall.face / 2, recess)]
    if half >= tall.face / 2:
        rims = [Point(tall.face / 2, 0.0), Point(-tall.face / 2, 0.0)]
    yield Path((back, *polyline([back.end, *rims, back.start]).segments))


def _half(layout: Layout, jaw: Jaw, part: str, level: float) -> float:
    """Half the width (m) of a layer; `level` is a height above the jaw's lowest point."""
    plates = above_board(layout.spec)
    if part == "encapsulation" and plates:  # where it goes over the uppermost plate
        part = plates[-1].role.value
    if part in ("board", "encapsulation"):
        return layout.body_size[1] / 2
    if part == "opposing-pad":
        pocket = jaw.opposing_pocket if jaw.opposing_recess else None
        return section(jaw).face / 2 if pocket is None else pocket[1] / 2 - POCKET_CLEARANCE
    for body in plates:
        if body.role.value == part:
            return (body.footprint.box[3] - body.footprint.box[1]) / 2
    at = levels(column(layout))
    return half_width(layout, level - at["board"][1].nominal)


def _across(layout: Layout, jaw: Jaw, part: str, at: dict[str, tuple[float, float]]) -> Path:
    """A layer's outline (m): a rectangle, or for the seat's pieces one whose sides follow the port's circle."""
    lower, upper = at[part]
    for body in above_board(layout.spec):
        if body.role.value == part:
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
        foot = max(board, at[body.role.value][0] - thick)
        yield rectangle(y0 - y - thick, foot, y1 - y + thick, at[body.role.value][1] + thick)


def draw_names(sheet: Sheet, layout: Layout, jaw: Jaw, view: View, right: float) -> None:
    """Every layer's name, thickness and tolerance beside the section, right of a place on paper (mm)."""
    layers = column(layout)
    at, named = levels(layers), [layer for layer in layers if not layer.is_glue]
    middle = at["opposing-jaw"][1].nominal / 2
    heights = [view.y((at[layer.part][0].nominal + at[layer.part][1].nominal) / 2 - middle) for layer in named]
    for layer, height, row in zip(named, heights, spread(heights, 4.6), strict=True):
        lower = at[layer.part][0].nominal
        half = section(jaw).face / 3 if layer.part.endswith("jaw") else 0.97 * _half(layout, jaw, layer.part, lower)
        sheet.line(view.x(half), height, right - 6.0, height, THIN)
        sheet.line(right - 6.0, height, right + 2.0, row, THIN)
        words = f"{layer.part} {mm(layer.thickness.nominal)} \xb1{decimal(layer.thickness.spread * 1e3, 3)}"
        sheet.text(right + 3.0, row - 0.35 * TEXT, words, TEXT)


def draw_side(
    sheet: Sheet, layout: Layout, jaw: Jaw, at: tuple[float, float], pivot: float, scale: float, turn: float,
    gap: float = 0.0,
) -> None:
    """Both jaws from the side, each turned by an angle (rad) about the pivot, which stands before a place on paper or
    beside it. `gap` is what lies between the faces where they are parallel (m), negative where the sensor has no room.
    """
    layers, offset = levels(column(layout)), jaw.pivot_offset
    half = layers["opposing-jaw"][1].nominal / 2 - offset
    level_line = at[1]
    at = at[0], at[1] - scale * 1e3 * offset
    x0, x1 = jaw_range(layout, jaw)
    body = layout.body[0], layout.body[2]
    plates: dict[str, list[tuple[float, float]]] = {}
    for piece in above_board(layout.spec):
        plates.setdefault(piece.role.value, []).append((piece.footprint.box[0], piece.footprint.box[2]))
    for part, (low, high) in layers.items():
        if part not in COLOURS or part == "encapsulation":
            continue
        is_other = part.startswith("opposing")
        middle = half + (-0.5 if is_other else 0.5) * gap
        if part in plates and "encapsulation" in layers:
            film = layers["encapsulation"][1].nominal - layers["encapsulation"][0].nominal
            for first, last in plates[part]:
                path = rectangle(first - film - pivot, low.nominal - middle, last + film - pivot,
                                 high.nominal + film - middle)
                sheet.draw(_turned(path, turn, at, scale), EDGE, COLOURS["encapsulation"])
        angle = -turn if is_other else turn
        for first, last in [(x0, x1)] if part in ("jaw", "opposing-jaw", "opposing-pad") else plates.get(part, [body]):
            path = rectangle(first - pivot, low.nominal - middle, last - pivot, high.nominal - middle)
            sheet.draw(_turned(path, angle, at, scale), EDGE, COLOURS[part])
    top = layers["board"][1].nominal - half - 0.5 * gap
    if (tail := _tail(layout, pivot, top, turn)) is not None:
        sheet.draw(_turned(tail, turn, at, scale), Pen(0.35, COLOURS["board"]), name="jaw-side-tail")
    for angle in sorted({turn, -turn}):
        along = polyline([Point(x0 - pivot, offset), Point(0.0, offset)])
        sheet.draw(_turned(along, angle, at, scale), HIDDEN)
    if jaw.hinge is not None and math.isclose(pivot, x1 + jaw.hinge):
        sheet.draw(circle(Point(*at), 0.8), EDGE, "#ffffff")
    sheet.line(at[0] - scale * 1e3 * (pivot - x0) - 4.0, level_line, at[0] + 4.0, level_line, CHAIN)


def _tail(layout: Layout, pivot: float, top: float, turn: float) -> Path | None:
    """The tail's middle line from the body to the pivot, on its way over the jaw's face and, with jaws open by twice an
    angle (rad), into the shaft; m from the pivot, in the jaw's own axes, `top` being the board's upper face there. None
    without a tail.
    """
    way = tail_path(layout, turn)
    if way is None:
        return None
    places = (way.at(way.length * i / TAIL_STEPS) for i in range(TAIL_STEPS + 1))
    beside = [Point(place.x - pivot, place.z + top) for place in places]
    cosine, sine = math.cos(turn), math.sin(turn)
    drawn = [point for point in beside if point.x * cosine - point.y * sine <= 0.0]
    return polyline(drawn) if len(drawn) > 1 else None


def _turned(path: Path, angle: float, at: tuple[float, float], scale: float) -> Path:
    """A path (m about the pivot) turned about it, on paper."""
    turned = path.rotated(angle)
    return turned.mapped(lambda p: Point(at[0] + scale * 1e3 * p.x, at[1] + scale * 1e3 * p.y))
