"""The sensor in section: every layer from the jaw to the film over the target, heights to scale."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.drawing.sheet import Pen, Sheet
from sitscad.drawing.svg import svg
from sitscad.geometry.path import Point, polyline, rectangle
from sitscad.record import record
from sitscad.scene.bodies import (
    MOUNT_PIECES,
    above_board,
    board_heights,
    film_thickness,
    seat_heights,
    shield_heights,
    top_height,
)
from sitscad.spec.circuit import LayerKind
from sitscad.spec.places import cell_specs
from sitscad.spec.presets import metal_colour
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

WIDTH, LEFT, RIGHT, LABEL = 900.0, 20.0, 470.0, 520.0
HEIGHT, ROW, LETTERS = 380.0, 22.0, 13.0
OUTLINE = Pen(0.6, round_ends=False, round_corners=False)
"""The page's style gives it its colour, and the texts theirs."""

COLOURS = {
    "standoff": "#dfe5ea", LayerKind.COVERLAY: "#d9a441", LayerKind.COPPER: "#c46a2b", LayerKind.DIELECTRIC: "#f0dfb0",
    "elastomer": "#a9cfe0", "film": "#cfe3cf",
}
JAW_SHOWN = 0.6e-3


@record
class SectionLayer:
    """One layer of the section: heights in metres, z = 0 at the board's top face, its colour and what it is."""

    bottom: float
    top: float
    colour: str
    label: str
    inset: float = 0.0


def section(spec: SensorSpec) -> str:
    """The section as an inline SVG that takes its text colours from the page."""
    slices = list(_slices(spec))
    low, high = min(s.bottom for s in slices), max(s.top for s in slices)
    scale = HEIGHT / (high - low)
    # Rows for the labels near where they are wanted (top down), never closer than one row
    rows: list[float] = []
    for y in [HEIGHT - ((s.bottom + s.top) / 2 - low) * scale for s in slices]:
        rows.append(max(y, rows[-1] + ROW) if rows else max(y, 4.0))
    excess = rows[-1] - max(HEIGHT, (len(rows) - 1) * ROW + 4.0)
    for i in range(len(rows) - 1, -1, -1):
        if excess <= 0:
            break
        limit = rows[i + 1] - ROW if i + 1 < len(rows) else rows[i] - excess
        rows[i] = min(rows[i], limit)
    height = max(HEIGHT, rows[-1] + ROW) + 20.0
    sheet = Sheet("Section of the sensor", (WIDTH, height), unit="", decimals=2, ground=None, kind="section")
    for piece, row in zip(slices, rows, strict=True):
        top, bottom = (height - 10.0 - (high - z) * scale for z in (piece.top, piece.bottom))
        edge, middle, line = RIGHT - piece.inset, (top + bottom) / 2, height - 10.0 - row
        sheet.draw(rectangle(LEFT + piece.inset, bottom, edge, top), OUTLINE, piece.colour, kind="layer")
        knees = [(edge, middle), (RIGHT + 10.0, middle), (LABEL - 12.0, line), (LABEL - 4.0, line)]
        sheet.draw(polyline([Point(*knee) for knee in knees]), OUTLINE, kind="leader")
        sheet.text(LABEL, line - 4.5, piece.label, LETTERS)
    return svg(sheet)


def _slices(spec: SensorSpec) -> Iterator[SectionLayer]:
    above: list[SectionLayer] = []
    for body in above_board(cell_specs(spec)[0]):
        label = f"{body.name}, {body.material}, {show(body.thickness, 'm')}"
        colour = metal_colour(body.material) if body.name == "target" else COLOURS[body.name]
        above.append(SectionLayer(*body.heights, colour, label, 40.0))
    if spec.encapsulation is not None:
        label = f"encapsulation, {spec.encapsulation.material.name}, {show(spec.encapsulation.thickness, 'm')}"
        top = top_height(spec)
        above.append(SectionLayer(top - film_thickness(spec.encapsulation), top, COLOURS["film"], label, 20.0))
    yield from reversed(above)
    # The layers of the board from the top down
    depth, copper = 0.0, 0
    for layer in spec.fpc.stackup.layers:
        copper += layer.kind is LayerKind.COPPER
        name = f"copper {copper}" if layer.kind is LayerKind.COPPER else layer.kind.value
        made = f", {layer.material}" if layer.material not in ("", "copper") else ""
        label = f"{name}{made}, {show(layer.thickness, 'm')}"
        yield SectionLayer(-depth - layer.thickness, -depth, COLOURS[layer.kind], label)
        depth += layer.thickness
    # Mount, shield and jaw under the board, named as in the drawing; without a mount only the gap to the shield
    here = board_heights(spec.fpc.stackup)[0]
    shield, mount, levels, seat = spec.shield, spec.mount, shield_heights(spec), seat_heights(spec)
    if shield is not None and levels is not None:
        below = seat is not None and levels[0] - seat[0] > 1e-9
        what = "gap" if mount is None else MOUNT_PIECES[1 if below else 0]
        yield SectionLayer(levels[1], here, COLOURS["standoff"], f"{what} to the shield, {show(shield.gap, 'm')}")
        label = f"shield, {shield.material.name}, {show(shield.thickness, 'm')}"
        yield SectionLayer(*levels, metal_colour(shield.material.name), label)
        here = levels[0]
    if mount is None or seat is None:
        return
    face = seat[0]
    if here - face > 1e-9:
        yield SectionLayer(face, here, COLOURS["standoff"], f"{MOUNT_PIECES[0]}, {show(here - face, 'm')}")
    if mount.jaw is not None:
        shown = min(JAW_SHOWN, mount.jaw.height)
        label = f"jaw, {mount.jaw.material.name} ({show(mount.jaw.height, 'm')} high, cut off here)"
        yield SectionLayer(face - shown, face, metal_colour(mount.jaw.material.name), label)
