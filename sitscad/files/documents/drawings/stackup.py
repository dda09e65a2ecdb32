"""The stack-up drawing (SVG and PDF on A4): sections through tail and body, heights to scale, all thicknesses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from sitscad.assembly.places.tail_path import bends, pivot_line
from sitscad.basics.units import show
from sitscad.files.drawing.frame import (
    MARGIN,
    TEXT,
    THIN,
    draw_paragraph,
    draw_table,
    new_sheet,
    spaced_places,
    wrapped_lines,
)
from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.sheet import Sheet
from sitscad.files.drawing.svg import svg
from sitscad.files.order_facts import notes
from sitscad.files.order_facts.files import board_images, fabrication_path, on_drawing, stack_names
from sitscad.kernels.geometry.path import rectangle
from sitscad.layout.bending import bend_stretch, contact_copper, contact_layers
from sitscad.layout.board import Layout, Via
from sitscad.layout.lamination import lamination_text
from sitscad.spec.circuit import MASK, LayerKind, StackLayer, Stackup

COLOURS = {LayerKind.COVERLAY: "#d9a441", LayerKind.COPPER: "#c46a2b", LayerKind.DIELECTRIC: "#f0dfb0"}
PLATE = "#b8b8b8"
TAIL, JOINT, BODY = 24.0, 92.0, 160.0
"""x coordinates on paper (mm): free end of the tail, joint of tail and body, end of the body."""
TOP, ROOM = 182.0, 92.0  # Top and largest height of the sections (mm)
CAPTION, CAPTIONS = 116.0, 140.0  # Width of a layer's caption and height of all of them (mm)
LAP = 10.0  # Length of the lap of the tail's own coverlay in the body's section (mm)
OPEN = 30.0  # Length of the contacts in the tail's section (mm)


def render(layout: Layout, forced: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the drawing as SVG and PDF by path in the package, stamped if `forced` is not empty.

    `files` are the images whose fingerprint the drawing states.
    """
    sheet = stackup_sheet(layout, on_drawing("board", files, board_images(files)), bool(forced))
    return {
        fabrication_path(layout.spec.name, "stackup.svg"): svg(sheet).encode("utf-8"),
        fabrication_path(layout.spec.name, "stackup.pdf"): pdf([sheet]),
    }


def stackup_sheet(layout: Layout, artwork: str, forced: bool = False) -> Sheet:
    """Return the sheet: the sections, a caption for each layer, finished thicknesses and the films' materials.

    `artwork` is the text in the title block that states the fingerprint of the board's files. The sheet is stamped if
    `forced`.
    """
    stackup = layout.spec.fpc.stackup
    plate = layout.stiffener.thickness if layout.stiffener is not None else 0.0
    scale = ROOM / max(stackup.thickness, sum(layer.thickness for layer in layout.spec.fpc.tail_layers) + plate)
    scale_words = f"heights {scale / 1e3:.0f}:1, lengths not to scale"
    title = f"stack-up {stackup.name}"
    sheet = new_sheet(layout.spec.name, layout.spec.issue, title, scale_words, artwork, forced, "in section")
    _draw_body_section(sheet, layout.copper_layers, layout.spec.fpc.stackup, layout.vias, scale)
    # The tail's layers, its opened coverlays shorter, and the stiffener under its end
    if layout.spec.fpc.tail is not None:
        y, is_plugged = TOP, bool(layout.pads)
        for i, layer in enumerate(layout.spec.fpc.tail_layers):
            height, start = layer.thickness * scale, TAIL + (OPEN if is_plugged else 0.0)
            is_own = layout.spec.fpc.has_tail_coverlay and i + 1 == len(layout.spec.fpc.tail_layers)
            _draw_bar(sheet, start, y, JOINT + (LAP if is_own else 0.0) - start, height, COLOURS[layer.kind])
            if is_own:
                lap = show(layout.spec.fpc.rules.coverlay_lap, "m")
                caption = wrapped_lines(f"the tail's own coverlay laps {lap} into the body",
                                        JOINT - TAIL - OPEN - 18.0, 2.3)
                for row, line in enumerate(caption):
                    sheet.text(JOINT - 1.0, y - height - 3.5 - 3.2 * row, line, 2.3, "end")
            y -= height
        if is_plugged:
            _draw_contact_section(sheet, contact_copper(layout), contact_layers(layout), layout.spec.fpc.tail_copper, y,
                                  scale)
        stiffener = layout.stiffener
        if stiffener is not None:
            height = stiffener.thickness * scale
            _draw_bar(sheet, TAIL, y, OPEN + 15.0, height, PLATE)
            sheet.text(TAIL + 2.0, y - height / 2, f"stiffener, {stiffener.material}", TEXT)
            thick = f"about {show(stiffener.thickness, 'm')} with its adhesive"
            sheet.text(TAIL + 2.0, y - height / 2 - 1.4 * TEXT, thick, TEXT)
        sheet.text((TAIL + (OPEN if is_plugged else 0.0) + JOINT) / 2, TOP + 3.0, "tail", TEXT, "middle")
    texts = notes.thickness_texts(layout)
    parts = {place: text.partition("), ") for place, text in texts.items()}
    rows = [["place", "finished thickness (least to most)"],
            *([place, f"{thick})" if more else thick] for place, (thick, _, more) in parts.items())]
    low = draw_table(sheet, 16.0, 72.0, (34.0, 118.0), rows)
    captions = [f"Finished thickness {place} {texts[place]}." for place, (_, _, more) in parts.items() if more]
    draw_paragraph(sheet, 16.0, low - 2.0, 143.0, MARGIN + 3.0, [*captions, *_notes(layout)], 2.3)
    return sheet


def _draw_body_section(sheet: Sheet, copper_layers: int, stackup: Stackup, vias: tuple[Via, ...], scale: float) -> None:
    """Draw the body's layers with their captions, and a plated hole.

    `scale` is in mm on paper for each metre of height.
    """
    layers = stackup.layers
    middles, copper, y, wall = [], [], TOP, COLOURS[LayerKind.COPPER]
    for number, layer in enumerate(layers, 1):
        height = layer.thickness * scale
        _draw_bar(sheet, JOINT, y, BODY - JOINT, height, COLOURS[layer.kind], f"stackup-layer-{number}")
        copper += [y, y - height] if layer.kind is LayerKind.COPPER else []
        middles.append(y - height / 2)
        y -= height
    if vias and copper:
        # A plated hole through all copper layers
        middle, height = (JOINT + BODY) / 2, copper[0] - copper[-1]
        for x, width, fill in ((-4.0, 8.0, "#ffffff"), (-4.0, 1.5, wall), (2.5, 1.5, wall)):
            _draw_bar(sheet, middle + x, copper[0], width, height, fill)
    texts = []
    for layer, name in zip(layers, stack_names(copper_layers, stackup.layers), strict=True):
        material = f", {notes.layer_text(layer)}" if layer.material != name else f" {layer.made_of}".rstrip()
        if layer.kind is LayerKind.COPPER:
            material = f", {notes.copper_text(stackup, layer)}"
        texts.append(wrapped_lines(f"{show(layer.thickness, 'm')}  {name}{material}", CAPTION, TEXT))
    most = max(map(len, texts))
    size = min(TEXT, TEXT * CAPTIONS / (1.4 * TEXT * most * len(texts)))
    captions = spaced_places([-m for m in middles], 1.4 * size * most)
    for lines, middle, place in zip(texts, middles, captions, strict=True):
        sheet.line(BODY, middle, BODY + 4.0, middle, THIN)
        sheet.line(BODY + 4.0, middle, BODY + 10.0, -place, THIN)
        for row, line in enumerate(lines):
            sheet.text(BODY + 11.0, -place - 0.35 * size - 1.4 * size * (row - (len(lines) - 1) / 2), line, size)
    sheet.text((JOINT + BODY) / 2, TOP + 3.0, "body with the coils", TEXT, "middle")


def _draw_contact_section(
    sheet: Sheet, copper: frozenset[int], layers: tuple[StackLayer, ...], tail_layers: int, bottom: float, scale: float
) -> None:
    """Draw the layers at the contacts, and name the copper layers that are absent there.

    `copper` has the numbers of the copper layers under the contacts, and `tail_layers` is the number of the tail's
    copper layers. The lowest face is at the y `bottom` (mm on paper). `scale` is in mm on paper for each metre of
    height.
    """
    there = layers
    y = bottom + math.fsum(layer.thickness for layer in there) * scale
    sheet.text(TAIL, TOP + 3.0, "contacts", TEXT)
    if absent := [str(number) for number in range(1, tail_layers + 1) if number not in copper]:
        sheet.text(TAIL, y + 1.5, f"no copper {', '.join(absent)}", 2.3)
    for layer in there:
        height = layer.thickness * scale
        _draw_bar(sheet, TAIL, y, OPEN, height, COLOURS[layer.kind])
        y -= height


def _draw_bar(sheet: Sheet, x: float, top: float, width: float, height: float, fill: str, name: str = "") -> None:
    sheet.draw(rectangle(x, top - height, x + width, top), THIN, fill, name)


def _notes(layout: Layout) -> Iterator[str]:
    stackup = layout.spec.fpc.stackup
    is_film = any(layer.kind is LayerKind.COVERLAY and layer.material != MASK for layer in stackup.layers)
    glued = "; coverlay with its adhesive" if is_film else ""
    yield f"Thicknesses are finished ones{glued}. Laminates: {notes.laminate_text(stackup)}."
    yield from (f"Bond, {where}: {text}." for where, text in notes.bond_texts(stackup).items())
    if build := lamination_text(layout):
        yield f"Build: {build}."
    yield notes.finish_text(layout.pads, layout.spec.fpc, bool(layout.vias))
    if layout.bend_zone is not None:
        yield notes.bend_text(bend_stretch(layout), bends(layout), pivot_line(layout))
    yield f"Stack-up from: {stackup.source}" if stackup.source else "Stack-up as written in the spec."
