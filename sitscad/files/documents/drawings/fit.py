"""Drawing of failed fits: sizes of board, mount and jaws that exceed their limits. Other drawings use its views.

Sections and side views are to scale. Each size that exceeds its limit is dimensioned in red. All views are computed
from places and dimensions, without a CAD kernel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from sitscad.assembly.places.bodies import MOUNT_PIECES, Body, PartsError, plates_of
from sitscad.assembly.places.column import Layer, column, layer_heights
from sitscad.assembly.places.fit import (
    OVERHANG,
    ClosedJawsSection,
    closed_section,
    hinge_pivot,
    measures,
    pin_gaps,
    shaft,
    tail_section_size,
)
from sitscad.assembly.places.jaws import (
    POCKET_CLEARANCE,
    board_middle,
    jaw_range,
    jaw_section,
    jaw_with_rims,
    seat_half_width,
)
from sitscad.assembly.places.stack import support_width
from sitscad.assembly.places.tail_path import tail_path
from sitscad.basics.check_results import Measure
from sitscad.basics.finding import Finding
from sitscad.basics.units import fixed_decimals
from sitscad.files.drawing.frame import (
    CHAIN,
    HIDDEN,
    RED,
    TEXT,
    THIN,
    View,
    draw_dimension,
    draw_paragraph,
    draw_table,
    mm,
    new_sheet,
    scale_for,
    scale_text,
    spaced_places,
)
from sitscad.files.drawing.sheet import BLACK, Pen, Sheet
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Path, Point, circle, closed_polygon, polyline, rectangle
from sitscad.layout.board import Layout
from sitscad.spec.mount import Assembly, Jaw

SECTION = (40.0, 96.0, 84.0, 84.0)  # Room for the section on paper: left, low, width, height (mm)
RIGHT, WIDE, TOP, SLOT = 196.0, 88.0, 196.0, 50.0
"""Views beside the section: left edge, width, top edge of the first view, step to the next top edge (mm on paper)."""
TOO_MUCH = Pen(0.35, RED)
CIRCLE = Pen(0.5, RED, (3.0, 1.5))
DRAWN_RULES = ("SIT301", "SIT302", "SIT303", "SIT309", "SIT314", "SIT319", "SIT320", "SIT321", "SIT322", "SIT323",
               "SIT324", "SIT325", "SIT326")
"""Rules whose findings this drawing shows."""


def _measured_and_limit(fault: Finding) -> tuple[float, ...]:
    """Return the measured length and its limit (m); empty if the finding has no such lengths."""
    is_length = fault.measured is not None and fault.limit is not None and fault.unit == "m"
    return (fault.measured or 0.0, fault.limit or 0.0) if is_length else ()


def fit_sheet(layout: Layout, faults: Sequence[Finding], forced: bool = False, bodies: str = "") -> Sheet | None:
    """Return the drawing of failed fits; None if there is no jaw or no finding of a rule in `DRAWN_RULES`.

    `bodies` is the name of a picture of the colliding solids, which a note mentions.
    """
    jaw, shown = layout.spec.jaw, [fault for fault in faults if fault.rule in DRAWN_RULES]
    if jaw is None or not shown:
        return None
    try:
        pair = closed_section(layout)
    except PartsError:
        return None
    assert pair is not None
    sized = [fault for fault in shown if _measured_and_limit(fault)]
    # Required extents (m) of the section
    needed = (width for fault in sized for width in _enclosing_diameter(fault))
    scale = scale_for((max(jaw.port_diameter, layout.body_size[1], 2.0 * pair.radius, *needed),) * 2, SECTION[2:])
    sheet = new_sheet(layout.spec.name, layout.spec.issue, "what does not fit", f"section {scale_text(scale)}",
                      "see the package", forced,
                      "the jaw from its tip")
    view = View(scale, (SECTION[0] + SECTION[2] / 2, SECTION[1] + SECTION[3] / 2))
    with sheet.group("fit-section"):
        _draw_failed_section(sheet, layout, jaw, pair, view, shown)
    views = _view_drawers(layout, jaw, {fault.rule: fault for fault in sized})
    for slot, draw in enumerate(views):
        with sheet.group(f"fit-view-{slot + 1}"):
            draw(sheet, TOP - SLOT * slot)
    low = draw_table(sheet, 16.0, 64.0, (16.0, 40.0, 26.0, 26.0, 26.0), [HEAD, *map(_finding_row, shown)], 2.4)
    note = NOTE + (f" {bodies} has the bodies themselves." if bodies else "")
    draw_paragraph(sheet, 16.0, low - 2.0, 134.0, 10.0, [note], 2.3)
    return sheet


HEAD = ("rule", "what does not fit", "measured (mm)", "limit (mm)", "off by (mm)")
NOTE = (
    "Red is what misses its limit, black the limit; drawn nominally, where a warning counts tolerances at worst. The "
    "words are what check says, and in a package's report.html."
)
AREAS = {"m2": (1e6, "mm2"), "m3": (1e9, "mm3")}  # Factors and units of areas and volumes


def _finding_row(fault: Finding) -> tuple[str, ...]:
    measured, limit, texts = fault.measured, fault.limit, ["", "", ""]
    if measured is not None and limit is not None and fault.unit in AREAS:
        factor, unit = AREAS[fault.unit]
        texts = [f"{factor * size:.3g} {unit}" for size in (measured, limit, abs(measured - limit))]
    elif measured is not None and limit is not None and fault.unit == "m":
        across = RADIUS if fault.rule == "SIT321" else 1.0
        texts = [mm(across * size) for size in (measured, limit, abs(measured - limit))]
    return fault.rule, fault.name, *texts


RADIUS = 2.0  # SIT321 measures from the port's axis, the other rules across: the drawing has diameters


def _enclosing_diameter(fault: Finding) -> Iterator[float]:
    """Yield the diameter (m) of the circle that encloses the closed jaws, from a finding of SIT303 or SIT321.

    Empty for other rules. SIT321 measures the radius, which is doubled here.
    """
    if fault.rule in ("SIT303", "SIT321"):
        yield _measured_and_limit(fault)[0] * (RADIUS if fault.rule == "SIT321" else 1.0)


def _draw_failed_section(
    sheet: Sheet, layout: Layout, jaw: Jaw, pair: ClosedJawsSection, view: View, shown: Sequence[Finding],
) -> None:
    """Draw the cross section of the closed jaws, their enclosing circle, and each width that exceeds its limit.

    `shown` are the findings that the drawing shows.
    """
    sized = [fault for fault in shown if _measured_and_limit(fault)]
    draw_section(sheet, layout, jaw, view, Pen(0.35))
    draw_layer_names(sheet, layout, jaw, view, SECTION[0] + SECTION[2])
    circles = [width for fault in sized for width in _enclosing_diameter(fault)]
    centre = Point(view.x(0.0), view.y(0.0))
    reach = max([jaw.port_diameter, 2.0 * pair.radius, *circles]) / 2
    if circles:
        needed = max(circles)
        sheet.draw(circle(centre, view.length(needed / 2)), CIRCLE, name="fit-needed")
        y = view.y(reach) + 4.0
        _draw_width(sheet, view, needed, y, f"needs {mm(needed)}", RED)
    board_width, measured = layout.body_size[1], measures(layout)
    widths = dict.fromkeys(pair for fault in sized for pair in _labelled_widths(board_width, measured, jaw, fault))
    under, across = support_width(layout), layout.body_size[1]  # the face that the board lies on
    if any(fault.rule == "SIT319" for fault in shown) and under is not None and under < across:
        widths[under, f"carried {mm(under)}", across, f"board {mm(across)}"] = None
    rows = [*((size, label, RED) for size, label, _, _ in widths), *((size, label, "") for _, _, size, label in widths)]
    rows.append((jaw.port_diameter, f"port {mm(jaw.port_diameter)}", ""))
    low = view.y(-reach) - 4.0
    for i, (size, label, colour) in enumerate(sorted(dict.fromkeys(rows))):
        _draw_width(sheet, view, size, low - 5.5 * i, label, colour)
    for fault in sized:
        if fault.rule == "SIT314":
            _draw_thin_wall(sheet, layout.body_size[1], column(layout), view, fault, SECTION[0] - 6.0)


def _draw_width(sheet: Sheet, view: View, size: float, y: float, label: str, colour: str) -> None:
    """Draw the dimension of a width `size` (m), centred on the section, at the y `y` (mm on paper).

    Extension lines start at the height of the axis of the closed jaws. If `colour` is empty, the dimension is black.
    """
    for x in (-size / 2, size / 2):
        sheet.line(view.x(x), view.y(0.0), view.x(x), y, TOO_MUCH if colour else HIDDEN)
    draw_dimension(sheet, (view.x(-size / 2), y), (view.x(size / 2), y), label, colour or BLACK)


def _labelled_widths(
    width: float, circles: tuple[Measure, ...], jaw: Jaw, fault: Finding
) -> Iterator[tuple[float, str, float, str]]:
    """Yield a width (m), its label, its limit (m) and the limit's label, from a finding of SIT301 or SIT309.

    Empty for other rules. `width` is the width (m) of the board, and `circles` are the measures of the closed jaws.
    """
    measured, limit = _measured_and_limit(fault)
    if fault.rule == "SIT309":
        yield measured, f"shield {mm(measured)}", limit, f"coils {mm(limit)}"
    if fault.rule != "SIT301":
        return
    over = next((each for each in circles if each.name == OVERHANG), None)
    part = (fault.key or "").partition(".")[0]
    if over is not None and math.isclose(measured, over.measured):
        face = jaw_section(jaw_with_rims(jaw)).face
        yield width, f"board {mm(width)}", face, f"jaw's face {mm(face)}"
    else:
        name = part if part in ("elastomer", "target") else "tail" if fault.key == "fpc.tail" else "board"
        room = {jaw.port_diameter: "port", jaw.width: "jaw"}.get(limit, "room")
        yield measured, f"{name} {mm(measured)}", limit, f"{room} {mm(limit)}"


def _draw_thin_wall(
    sheet: Sheet, width: float, layers: tuple[Layer, ...], view: View, fault: Finding, x: float
) -> None:
    """Draw the thickness of a printed piece that is less than the least wall thickness of its process.

    The lines of the dimension begin at `x` (mm on paper). `width` (m) is the width of the board.
    """
    measured, limit = _measured_and_limit(fault)
    at = layer_heights(layers)
    middle = at["opposing-jaw"][1].nominal / 2
    for name in MOUNT_PIECES:
        if name in at and math.isclose(at[name][1].nominal - at[name][0].nominal, measured, abs_tol=1e-9):
            low, high = (view.y(level.nominal - middle) for level in at[name])
            for y in (low, high):
                sheet.line(x, y, view.x(-0.4 * width), y, TOO_MUCH)
            sheet.text(x + 1.0, high + 1.0, f"{name} {mm(measured)}", TEXT, "end", 0.0, RED)
            sheet.text(x + 1.0, low - 3.0, f"{mm(limit)} at least", TEXT, "end")


Draw = Callable[[Sheet, float], None]


def _view_drawers(layout: Layout, jaw: Jaw, sized: dict[str, Finding]) -> list[Draw]:
    """Return functions that draw the views beside the section: along the jaw, at the hinge, through the shaft.

    `sized` has the findings with lengths, by rule. Only views that show such a finding are included. Each function
    takes the sheet and the view's top edge (mm on paper).
    """
    views: list[Draw] = []
    if (long := sized.get("SIT302")) is not None:
        views.append(lambda sheet, top: _draw_lengths(sheet, layout, jaw, long, top))
    if "SIT324" in sized:
        views.append(lambda sheet, top: _draw_hinge(sheet, layout, jaw, top))
    if (end := sized.get("SIT325")) is not None:
        assembly, section = layout.spec.assembly, tail_section_size(layout)
        views.append(lambda sheet, top: _draw_tail_end(sheet, assembly, jaw, section, end, top))
    return views


def _draw_lengths(sheet: Sheet, layout: Layout, jaw: Jaw, fault: Finding, top: float) -> None:
    """Draw both jaws from the side, with the lengths of board and jaw; `top` is the top edge on paper (mm)."""
    start, heel = jaw_range(layout.body, jaw)
    body = layout.body[0], layout.body[2]
    x0, x1 = min(start, body[0]), max(heel, body[1])
    pair = closed_section(layout)
    assert pair is not None
    scale = scale_for((x1 - x0, pair.height), (WIDE, SLOT - 24.0))
    right, half = RIGHT + scale * 1e3 * (x1 - x0), 0.5e3 * scale * pair.height
    middle = top - 7.0 - half
    draw_jaws_from_side(sheet, layout, jaw, (right, middle), x1, scale, 0.0)
    sheet.text(RIGHT, top - 4.0, f"from the side, {scale_text(scale)}, the tip on the left", TEXT)

    def at(x: float) -> float:
        return right - scale * 1e3 * (x1 - x)

    _, limit = _measured_and_limit(fault)
    draw_dimension(
        sheet, (at(body[0]), middle - half - 5.0), (at(body[1]), middle - half - 5.0), f"board {mm(body[1] - body[0])}",
        colour=RED,
    )
    draw_dimension(sheet, (at(start), middle - half - 10.5), (at(heel), middle - half - 10.5), f"jaw {mm(limit)}")


def _draw_hinge(sheet: Sheet, layout: Layout, jaw: Jaw, top: float) -> None:
    """Draw the tail and the hinge's pin in the first of the checked states in which they collide."""
    path, pivot = tail_path(layout), hinge_pivot(layout)
    gap = next((gap for gap in pin_gaps(layout) if not gap.is_free), None)
    if gap is None or pivot is None or jaw.hinge is None or path is None:
        return
    if gap.angle:
        path = tail_path(layout, gap.angle) or path
    heel = jaw_range(layout.body, jaw)[1]
    scale = scale_for((jaw.hinge + 4e-3, 5e-3), (WIDE, SLOT - 14.0))
    view = View(scale, (RIGHT + 3.0 - 1e3 * scale * (heel - 1e-3), top - 22.0 - 1e3 * scale * pivot.y))
    # Points on the tail's middle line near the pivot (m)
    start = heel - 1e-3
    end = pivot.x + 3e-3
    steps = (path.at(path.length * i / 2000) for i in range(2001))
    places = [Point(place.x, place.z) for place in steps if start <= place.x <= end]
    thick = 2.0 * (path.distance(pivot.x, pivot.y) - gap.away)
    sheet.draw(view.path(polyline(places)), Pen(max(0.3, view.length(thick)), COLOURS["board"], (), False))
    sheet.draw(circle(Point(view.x(pivot.x), view.y(pivot.y)), view.length(gap.pin)), TOO_MUCH, "#e8c4c4")
    nearest = min(places, key=lambda place: math.hypot(place.x - pivot.x, place.y - pivot.y))
    sheet.line(view.x(pivot.x), view.y(pivot.y), view.x(nearest.x), view.y(nearest.y), TOO_MUCH)
    sheet.line(view.x(heel), view.y(pivot.y) - 8.0, view.x(heel), view.y(pivot.y) + 8.0, CHAIN)
    sheet.text(view.x(heel) + 1.0, view.y(pivot.y) + 5.0, "jaw's heel", TEXT)
    label = f"{gap.when}: tail {mm(gap.away)} from the pivot"
    sheet.text(RIGHT, top - 4.0, f"{label}, {scale_text(scale)}", TEXT, colour=RED)
    sheet.text(RIGHT, top - 8.0, f"pin {mm(2.0 * gap.pin)} thick: {mm(gap.pin)} at least", TEXT)


def _draw_tail_end(
    sheet: Sheet, assembly: Assembly, jaw: Jaw | None, end: tuple[float, float], fault: Finding, top: float
) -> None:
    measured, limit = _measured_and_limit(fault)
    behind, (width, thick) = shaft(assembly, jaw), end
    assert behind is not None
    scale = scale_for((max(width, limit),) * 2, (WIDE, SLOT - 16.0))
    view = View(scale, (RIGHT + WIDE / 2, top - 28.0))
    sheet.draw(circle(Point(view.x(0.0), view.y(0.0)), view.length(behind.bore / 2)), Pen(0.35))
    box = [view.x(-width / 2), view.y(-thick / 2), view.x(width / 2), view.y(thick / 2)]
    sheet.draw(rectangle(*box), EDGE, COLOURS["board"])
    sheet.line(box[0], box[1], box[2], box[3], TOO_MUCH)
    sheet.text(RIGHT, top - 4.0, f"the tail's end {mm(measured)} from corner to corner, {scale_text(scale)}", TEXT,
               colour=RED)
    sheet.text(RIGHT, top - 8.0, f"the tube behind the jaws leaves {mm(limit)}", TEXT)


COLOURS = {
    "jaw": "#a8adb5", "opposing-jaw": "#c9cdd3", "opposing-pad": "#5f6b6d", "shield": "#d98a4b", "board": "#c07f1f",
    "elastomer": "#e8d8c8", "target": "#d98a4b", "encapsulation": "#9fc5e8", **dict.fromkeys(MOUNT_PIECES, "#dfe6e9"),
}
GLUE = "#4d6b1f"
EDGE = Pen(0.18)
PORT = Pen(0.35, "#b00000", (3.0, 1.5))
TAIL_STEPS = 400  # Segments of the tail in side views
STEPS = 12  # Segments of a side along the port's circle


def draw_section(sheet: Sheet, layout: Layout, jaw: Jaw, view: View, port: Pen = PORT) -> None:
    """Draw the cross section of the closed jaws: layers, glue lines, and the port's circle about their axis.

    `port` is the pen of the circle.
    """
    layers = column(layout)
    at = {name: (lower.nominal, upper.nominal) for name, (lower, upper) in layer_heights(layers).items()}
    middle = at["opposing-jaw"][1] / 2

    def draw(path: Path, name: str) -> None:
        placed_path = path.mapped(lambda p: Point(view.x(p.x), view.y(p.y - middle)))
        sheet.draw(placed_path, EDGE, COLOURS[name], f"jaw-section-{name}")

    for path in _jaw_outlines(jaw, jaw.recess, jaw.pocket):
        draw(path.shifted(0.0, at["jaw"][1]), "jaw")
    for path in _jaw_outlines(jaw, jaw.opposing_recess, jaw.opposing_pocket):
        draw(path.rotated(math.pi).shifted(0.0, at["opposing-jaw"][0]), "opposing-jaw")
    if "encapsulation" in at:
        for path in _film_outlines(layout.body, layout.body_size[1], plates_of(layout.spec).all, at):
            draw(path, "encapsulation")
    for layer in layers:
        if layer.part in COLOURS and layer.part not in ("jaw", "opposing-jaw", "encapsulation"):
            draw(_layer_outline(layout, jaw, layer.part, at), layer.part)
    for layer in (layer for layer in layers if layer.is_glue):
        under, over = at[layer.part]
        half = _half_width_of_layer(layout, jaw, layer.part.removeprefix("glue under the "), under)
        ends = [Point(view.x(-half), view.y(under - middle)), Point(view.x(half), view.y(over - middle))]
        sheet.draw(rectangle(ends[0].x, ends[0].y, ends[1].x, ends[1].y), None, GLUE)
    sheet.draw(circle(Point(view.x(0.0), view.y(0.0)), view.length(jaw.port_diameter / 2)), port, name="jaw-port")
    reach = 0.55 * view.length(jaw.port_diameter)
    x, y = view.x(0.0), view.y(0.0)
    sheet.line(x - reach, y, x + reach, y, CHAIN)
    sheet.line(x, y - reach, x, y + reach, CHAIN)


def _jaw_outlines(jaw: Jaw, recess: float, pocket: tuple[float, float] | None) -> Iterator[Path]:
    """Yield the outline (m) of a jaw's cross section, with the face that carries the sensor at height 0.

    If the sensor lies in a pocket, the jaw is taller by `recess` (m), and the pocket has the width ``pocket[1]`` (m).
    """
    if pocket is None or not recess:
        yield jaw_section(jaw).outline
        return
    tall, half = jaw_section(replace(jaw, height=jaw.height + recess)), pocket[1] / 2
    back = tall.outline.shifted(0.0, recess).segments[0]
    rims = [Point(tall.face / 2, recess), Point(half, recess), Point(half, 0.0), Point(-half, 0.0),
            Point(-half, recess), Point(-tall.face / 2, recess)]
    if half >= tall.face / 2:
        rims = [Point(tall.face / 2, 0.0), Point(-tall.face / 2, 0.0)]
    yield Path((back, *polyline([back.end, *rims, back.start]).segments))


def _half_width_of_layer(layout: Layout, jaw: Jaw, part: str, level: float) -> float:
    """Return half the width (m) of the layer `part` in the cross section.

    The width of a mount's piece changes with the height. `level` is the height (m) above the jaw's lowest point.
    """
    plates = plates_of(layout.spec).all
    if part == "encapsulation" and plates:  # its width over the uppermost plate
        part = plates[-1].role.value
    if part in ("board", "encapsulation"):
        return layout.body_size[1] / 2
    if part == "opposing-pad":
        pocket = jaw.opposing_pocket if jaw.opposing_recess else None
        return jaw_section(jaw).face / 2 if pocket is None else pocket[1] / 2 - POCKET_CLEARANCE
    for body in plates:
        if body.role.value == part:
            return (body.footprint.box[3] - body.footprint.box[1]) / 2
    at = layer_heights(column(layout))
    return seat_half_width(layout, level - at["board"][1].nominal)


def _layer_outline(layout: Layout, jaw: Jaw, part: str, at: dict[str, tuple[float, float]]) -> Path:
    """Return the outline (m) of the layer `part` in the cross section.

    It is a rectangle, except for pieces of the mount, whose sides follow the port's circle. `at` holds the heights (m)
    of the lower and the upper face of each part.
    """
    lower, upper = at[part]
    for body in plates_of(layout.spec).all:
        if body.role.value == part:
            y = board_middle(layout.body).y
            return rectangle(body.footprint.box[1] - y, lower, body.footprint.box[3] - y, upper)
    if part not in MOUNT_PIECES:
        half = _half_width_of_layer(layout, jaw, part, lower)
        return rectangle(-half, lower, half, upper)
    heights = [lower + (upper - lower) * i / STEPS for i in range(STEPS + 1)]
    right = [Point(_half_width_of_layer(layout, jaw, part, z), z) for z in heights]
    return closed_polygon([*right, *(Point(-p.x, p.y) for p in reversed(right))])


def _film_outlines(
    body: Box, width: float, pieces: tuple[Body, ...], at: dict[str, tuple[float, float]]
) -> Iterator[Path]:
    """Yield the outlines (m) of the film in the cross section: on the board, and round each piece.

    The film is drawn before the pieces, which then cover the middle of its outlines. `width` (m) is the width of the
    board. `at` holds the heights (m) of the lower and the upper face of each part.
    """
    (_, board), (lower, upper) = at["board"], at["encapsulation"]
    thick, half, y = upper - lower, width / 2, board_middle(body).y
    yield rectangle(-half, board, half, board + thick)
    for piece in pieces:
        _, y0, _, y1 = piece.footprint.box
        foot = max(board, at[piece.role.value][0] - thick)
        yield rectangle(y0 - y - thick, foot, y1 - y + thick, at[piece.role.value][1] + thick)


def draw_layer_names(sheet: Sheet, layout: Layout, jaw: Jaw, view: View, right: float) -> None:
    """Draw each layer's name, thickness and tolerance beside the section, to the right of x = `right` (mm on paper)."""
    layers = column(layout)
    at, named = layer_heights(layers), [layer for layer in layers if not layer.is_glue]
    middle = at["opposing-jaw"][1].nominal / 2
    heights = [view.y((at[layer.part][0].nominal + at[layer.part][1].nominal) / 2 - middle) for layer in named]
    for layer, height, row in zip(named, heights, spaced_places(heights, 4.6), strict=True):
        lower = at[layer.part][0].nominal
        half = jaw_section(jaw).face / 3
        if not layer.part.endswith("jaw"):
            half = 0.97 * _half_width_of_layer(layout, jaw, layer.part, lower)
        sheet.line(view.x(half), height, right - 6.0, height, THIN)
        sheet.line(right - 6.0, height, right + 2.0, row, THIN)
        label = f"{layer.part} {mm(layer.thickness.nominal)} \xb1{fixed_decimals(layer.thickness.spread * 1e3, 3)}"
        sheet.text(right + 3.0, row - 0.35 * TEXT, label, TEXT)


def draw_jaws_from_side(
    sheet: Sheet, layout: Layout, jaw: Jaw, at: tuple[float, float], pivot: float, scale: float, turn: float,
    gap: float = 0.0,
) -> None:
    """Draw both jaws from the side, turned about the pivot by `turn` (rad) in opposite directions.

    `pivot` is the pivot's x (m) on the board. `at` is the point (mm on paper) of the closed jaws' middle line at this
    x; the pivot itself may lie beside this line. `scale` is the scale of the drawing. `gap` is the distance (m) of the
    faces when parallel; it is negative if the sensor is too thick.
    """
    layers, offset = layer_heights(column(layout)), jaw.pivot_offset
    half = layers["opposing-jaw"][1].nominal / 2 - offset
    level_line = at[1]
    at = at[0], at[1] - scale * 1e3 * offset
    x0, x1 = jaw_range(layout.body, jaw)
    body = layout.body[0], layout.body[2]
    plates: dict[str, list[tuple[float, float]]] = {}
    for piece in plates_of(layout.spec).all:
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
                sheet.draw(_path_on_paper(path, turn, at, scale), EDGE, COLOURS["encapsulation"])
        angle = -turn if is_other else turn
        for first, last in [(x0, x1)] if part in ("jaw", "opposing-jaw", "opposing-pad") else plates.get(part, [body]):
            path = rectangle(first - pivot, low.nominal - middle, last - pivot, high.nominal - middle)
            sheet.draw(_path_on_paper(path, angle, at, scale), EDGE, COLOURS[part])
    top = layers["board"][1].nominal - half - 0.5 * gap
    if (tail := _tail_middle_line(layout, pivot, top, turn)) is not None:
        sheet.draw(_path_on_paper(tail, turn, at, scale), Pen(0.35, COLOURS["board"]), name="jaw-side-tail")
    for angle in sorted({turn, -turn}):
        line = polyline([Point(x0 - pivot, offset), Point(0.0, offset)])
        sheet.draw(_path_on_paper(line, angle, at, scale), HIDDEN)
    if jaw.hinge is not None and math.isclose(pivot, x1 + jaw.hinge):
        sheet.draw(circle(Point(*at), 0.8), EDGE, "#ffffff")
    sheet.line(at[0] - scale * 1e3 * (pivot - x0) - 4.0, level_line, at[0] + 4.0, level_line, CHAIN)


def _tail_middle_line(layout: Layout, pivot: float, top: float, turn: float) -> Path | None:
    """Return the tail's middle line (m from the pivot, in the jaw's axes) from the body to the pivot.

    None if no part of a tail lies before the pivot. Each jaw is turned by `turn` (rad). `pivot` is the pivot's x (m) on
    the board, and `top` the height (m) of the board's upper face above the pivot.
    """
    way = tail_path(layout, turn)
    if way is None:
        return None
    places = (way.at(way.length * i / TAIL_STEPS) for i in range(TAIL_STEPS + 1))
    beside = [Point(place.x - pivot, place.z + top) for place in places]
    cosine, sine = math.cos(turn), math.sin(turn)
    points = [point for point in beside if point.x * cosine - point.y * sine <= 0.0]
    return polyline(points) if len(points) > 1 else None


def _path_on_paper(path: Path, angle: float, at: tuple[float, float], scale: float) -> Path:
    """Return a path (m from the pivot) as a path on paper (mm), turned about the pivot by `angle` (rad).

    `at` is the pivot's place on paper (mm), and `scale` the scale of the drawing.
    """
    turned = path.rotated(angle)
    return turned.mapped(lambda p: Point(at[0] + scale * 1e3 * p.x, at[1] + scale * 1e3 * p.y))
