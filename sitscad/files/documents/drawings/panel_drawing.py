"""Documents of the panel: a dimensioned drawing (SVG and PDF on A4), and a readme with the coupon's inductance."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from textwrap import wrap

from sitscad.assembly.places.state import FREE
from sitscad.basics.units import show
from sitscad.estimates.coil_estimates import Estimates
from sitscad.files.drawing.frame import (
    FORCED,
    HIDDEN,
    SCALES,
    THICK,
    THIN,
    View,
    centred_view,
    draw_dimension,
    draw_ordinates,
    draw_paragraph,
    mm,
    new_sheet,
    numbered_notes,
    scale_for,
    scale_text,
)
from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.sheet import Pen, Sheet, text_width
from sitscad.files.drawing.svg import svg
from sitscad.files.order_facts.files import (
    body_files,
    drill_map_file,
    fingerprint,
    on_drawing,
    panel_files,
    panel_images,
    panel_path,
    shell_line,
)
from sitscad.files.order_facts.notes import TEXT_WIDTH, outline_text, quantity_text, section
from sitscad.kernels.geometry.path import bounding_box, circle, rectangle
from sitscad.layout.panel import FIDUCIAL, FIDUCIAL_OPENING, TOOLING_HOLE, Panel
from sitscad.spec.presets import board_kind

ROOM = (32.0, 46.0, 150.0, 135.0)


def render(
    panel: Panel | None, coupon_estimates: Estimates | None, forced: str, files: Mapping[str, bytes]
) -> dict[str, bytes]:
    """Return the documents by path in the package; empty without a panel.

    `coupon_estimates` are the estimates of the coupon's coil, or None. `files` are the images whose fingerprint the
    documents state. If `forced` is not empty, they have a warning.
    """
    if panel is None:
        return {}
    layout = panel.layout
    images = panel_images(layout.spec.name, files)
    sheet = panel_sheet(panel, on_drawing("panel", files, images), bool(forced))
    return {
        panel_path(layout.spec.name, "-drawing.svg"): svg(sheet).encode("utf-8"),
        panel_path(layout.spec.name, "-drawing.pdf"): pdf([sheet]),
        panel_path(layout.spec.name, "-readme.txt"): panel_readme(panel, coupon_estimates, files,
                                                                  bool(forced)).encode("utf-8"),
    }


def panel_sheet(panel: Panel, artwork: str, forced: bool = False) -> Sheet:
    """Return the sheet: frame, cuts with their bridges, marks, and the place of each board and coupon.

    `artwork` is the text in the title block that states the fingerprint of the panel's files. The sheet is stamped if
    `forced`.
    """
    scale = scale_for(panel.size, ROOM[2:], SCALES)
    sheet = new_sheet(panel.layout.spec.name, panel.layout.spec.issue, "panel", scale_text(scale), artwork, forced)
    view = centred_view((0.0, 0.0, *panel.size), scale, ROOM)
    width, height = panel.size
    sheet.draw(view.path(rectangle(0.0, 0.0, width, height)), THICK, name="panel-outline")
    with sheet.group("panel-cuts"):
        for cut in panel.cuts:
            sheet.draw(view.path(cut), Pen(0.25))
    # A red mark on each bridge, and a cross at each copy's origin
    copies = [(panel.layout, panel.bridges, at) for at in panel.parts]
    if panel.coupon is not None:
        copies += [(panel.coupon, panel.coupon_bridges, at) for at in panel.coupons]
    for layout, bridges, at in copies:
        for bridge in bridges:
            middle = bridge.middle(layout.outline).shifted(*at)
            sheet.draw(view.path(circle(middle, 0.6e-3)), Pen(0.25, "#b00000"))
        sheet.line(view.x(at.x) - 1.0, view.y(at.y), view.x(at.x) + 1.0, view.y(at.y), THIN)
        sheet.line(view.x(at.x), view.y(at.y) - 1.0, view.x(at.x), view.y(at.y) + 1.0, THIN)
    x0, _, x1, _ = bounding_box([panel.layout.outline])
    for i, at in enumerate(panel.parts, 1):
        sheet.text(view.x(at.x + (x0 + x1) / 2), view.y(at.y) - 0.8, str(i), 2.2, "middle")
    _draw_coupon_names(sheet, panel, view)
    # The holes and fiducials of the frame
    for at in panel.tooling_holes:
        sheet.draw(view.path(circle(at, TOOLING_HOLE / 2)), THICK)
    for at in panel.fiducials:
        sheet.draw(view.path(circle(at, FIDUCIAL / 2)), None, "#b8860b")
        sheet.draw(view.path(circle(at, FIDUCIAL_OPENING / 2)), HIDDEN)
    draw_dimension(sheet, (view.x(0.0), view.y(height) + 6.0), (view.x(width), view.y(height) + 6.0), mm(width))
    draw_dimension(sheet, (view.x(width) + 7.0, view.y(0.0)), (view.x(width) + 7.0, view.y(height)), mm(height))
    xs = [0.0, width, *(at.x for at in (*panel.tooling_holes, *panel.fiducials, *panel.parts, *panel.coupons))]
    ys = [0.0, height, *(at.y for at in (*panel.tooling_holes, *panel.parts, *panel.coupons))]
    draw_ordinates(sheet, view, 0, xs, view.y(0.0), view.y(0.0) - 8.0)
    draw_ordinates(sheet, view, 1, ys, view.x(0.0), view.x(0.0) - 8.0)
    draw_paragraph(sheet, 212.0, 190.0, 74.0, 40.0, numbered_notes(_notes(panel)), 2.4)
    return sheet


def _draw_coupon_names(sheet: Sheet, panel: Panel, view: View) -> None:
    """Draw a name beside each coupon, or a single name for both if the space between them is too narrow."""
    if panel.coupon is None:
        return
    box, size = bounding_box([panel.coupon.outline]), 2.2
    first, last = panel.coupons[0], panel.coupons[-1]
    y, begin, end = view.y(first.y) - 0.8, view.x(first.x + box[2]) + 2.0, view.x(last.x + box[0]) - 2.0
    if len(panel.coupons) == 1:
        sheet.text(begin, y, "coupon", size)
    elif end - begin > 2.0 * text_width("coupon", size) + 1.0:
        sheet.text(begin, y, "coupon", size)
        sheet.text(end, y, "coupon", size, "end")
    else:
        fits = text_width("coupons", size) < end - begin
        sheet.text((begin + end) / 2, y if fits else view.y(first.y + box[1]) - 3.0, "coupons", size, "middle")


def _notes(panel: Panel) -> Iterator[str]:
    count = f"{len(panel.parts)} parts ({panel.columns} x {panel.rows})"
    coupons = f" and {len(panel.coupons)} coupons" if panel.coupons else ""
    yield f"{count}{coupons}. Coordinates in mm from the panel's lower left corner; crosses: each part's own origin."
    yield f"Rails {mm(panel.rail)} mm. {len(panel.tooling_holes)} tooling holes {mm(TOOLING_HOLE)} mm, not plated."
    faces = "on both faces" if panel.layout.copper_layers > 1 else "on the top face"
    opening = f"coverlay open {mm(FIDUCIAL_OPENING)} mm"
    yield f"{len(panel.fiducials)} fiducials {mm(FIDUCIAL)} mm, {opening}, {faces}."
    if panel.bridges:
        wide = mm(panel.layout.spec.fpc.panel.bridge)
        yield (
            f"Cut along the lines (laser or die); leave every bridge (red circles, {wide} mm, "
            f"{len(panel.bridges)} a part). No perforation: it would tear the film."
        )
    else:
        yield "No place for a bridge was found: the parts are to be held as the fabricator sees fit."
    yield "Deliver the panel whole. Parts are cut out by the customer."
    outlines = outline_text(panel.layout.spec.fpc.rules)
    yield f"Parts' outlines {outlines}; of frame and tooling holes the rules state none."
    if quantity := quantity_text(panel.layout.spec.fpc.boards, len(panel.parts)):
        yield f"Wanted: {quantity}."
    if panel.coupons:
        yield "Coupons: one coil with solder pads, for measuring inductance."
    if body_files(panel.layout.spec.name, panel.layout.spec.fpc):
        where = "the parts' bodies, the coupons and the rails" if panel.coupons else "the parts' bodies and the rails"
        lower = f"{panel.layout.spec.fpc.tail_copper + 1} to {panel.layout.copper_layers}"
        yield f"Copper {lower} and what lies between and below: {where} only, not the parts' tails."


def panel_readme(
    panel: Panel, coupon_estimates: Estimates | None, files: Mapping[str, bytes] | None = None, forced: bool = False,
) -> str:
    """Return the panel's readme: delivery, expected readings of the coupon, and the fingerprint of `files` if given.

    `coupon_estimates` are the estimates of the coupon's coil, or None. The readme begins with a warning if `forced`.
    """
    title = f"{panel.layout.spec.name}: panel of {board_kind(panel.layout.spec.fpc.stackup)} circuits"
    width, height = (show(side, "m") for side in panel.size)
    paragraphs = [
        f"The boards are delivered in a panel of {width} x {height}. The single board is described by readme.txt; "
        "everything in it (stack-up, thicknesses, finish, test) holds for the panel. The netlist is that of one board: "
        "test each part by it.",
        *numbered_notes(_notes(panel)),
        *_nub_notes(panel),
        *_coupon_lines(panel, coupon_estimates),
    ]
    lines = [title, "=" * len(title), "", *(f"{name}: {text}" for name, text in panel.layout.spec.issue.rows)]
    lines += [""] if panel.layout.spec.issue.rows else []
    lines += [f"{FORCED}.", ""] if forced else []
    for text in paragraphs:
        lines += [*wrap(text, TEXT_WIDTH, subsequent_indent="   ", break_on_hyphens=False), ""]
    hashes = _fingerprint_lines(panel, files) if files else []
    return "\n".join([*lines, *section("Files", _file_rows(panel)), *hashes])


def _file_rows(panel: Panel) -> Iterator[tuple[str, str]]:
    layout = panel.layout
    yield from (file.row for file in panel_files(layout.spec.name, layout.spec.fpc, layout.stiffener, layout.spans))
    drill_map = drill_map_file(panel_path(layout.spec.name, "-Drill_Map.gbr"))
    yield drill_map.name, "drill map (Gerber drawing)"
    yield panel_path(layout.spec.name, "-drawing.pdf").rpartition("/")[2], "drawing of the panel (also as SVG)"
    yield panel_path(layout.spec.name, "-job.gbrjob").rpartition("/")[2], "Gerber job file of the panel"
    yield "Coordinates", "millimetres, one origin for all files of the panel: its lower left corner"


def _fingerprint_lines(panel: Panel, files: Mapping[str, bytes]) -> list[str]:
    """Return the lines with the fingerprint of the panel's Gerber and drill files."""
    images = panel_images(panel.layout.spec.name, files)
    what = (
        "Fingerprint: SHA-256 of the panel's Gerber and drill files one after another, in the order of the line below; "
        "in the folder that holds them that line prints the same. The panel's drawing shows its first 16 digits."
    )
    return [
        *wrap(what, TEXT_WIDTH, subsequent_indent="   ", break_on_hyphens=False), "", fingerprint(files, images),
        shell_line(images), "",
    ]


def _nub_notes(panel: Panel) -> Iterator[str]:
    """Yield the note on the nubs that cut bridges leave on a part; empty without bridges."""
    if panel.bridges:
        beside = ", two of them at the sides of the stiffener, behind what is plugged in"
        beside = "" if panel.layout.stiffener is None else beside
        wide = mm(panel.layout.spec.fpc.panel.bridge)
        yield (
            f"Where a bridge was cut, a nub up to {wide} mm wide is left on the part's edge: at the red "
            f"circles of the drawing{beside}; none at the contacts and none in the bend zone. Nubs carry no copper: "
            "cut as near to the edge as you can, and file off what is left or shave it with a blade, along the edge "
            "and never across it. Nubs beside the stiffener must go where the connector's housing takes in more of the "
            "part than the contacts."
        )


def _coupon_lines(panel: Panel, estimates: Estimates | None) -> Iterator[str]:
    if panel.coupon is None:
        yield f"There is no coupon: {panel.no_coupon}."
        return
    coil = estimates.coils[0] if estimates is not None else None
    if coil is None or FREE not in coil.states:
        return
    free = coil.states[FREE]
    low = math.fsum(value for name, value in coil.inductance_parts.items() if name != "crowding")
    high = ""
    if free.apparent_inductance is not None:
        read = f"{show(free.apparent_inductance, 'H')} at {show(free.frequency, 'Hz', 3)}"
        high = f", {read} (as a meter reads it there, with the coupon's own capacitance)"
    yield (
        "A coupon, lying free (no metal within three coil diameters), should measure between its pads "
        f"{show(low, 'H')} at 100 kHz or less{high}, and "
        f"{show(coil.terminal_resistance_dc, 'ohm', 3)} at direct current and 20 C. A short between "
        "turns, which no continuity test sees, lowers both: compare the coupons with these values and with each other "
        "before parts are cut out."
    )
