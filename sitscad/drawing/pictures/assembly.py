"""The picture of the assembly: exploded in parallel projection, and cut across the jaw. Small, and the same twice."""

from __future__ import annotations

from sitscad.drawing.pictures.cross_section import cross_section
from sitscad.drawing.pictures.exploded import exploded
from sitscad.drawing.sheet import Group, Sheet
from sitscad.drawing.svg import svg
from sitscad.parts.solid import Solid
from sitscad.spec.sensor import SensorSpec

GAP, MARGIN = 40.0, 14.0
"""Pixels between the two drawings, and round them."""


def assembly_svg(solids: tuple[Solid, ...], spec: SensorSpec) -> str:
    """The exploded assembly on the left, the section across the jaw (to scale, with the port's circle) on the right."""
    sheet = Sheet(f"{spec.name}: assembly, exploded and in section", unit="", decimals=1, ground=None)
    with sheet.group("exploded"):
        wide, tall = exploded(sheet, solids, 470.0, 470.0)
    with sheet.group("section"):
        section = cross_section(sheet, solids, spec, 260.0)
    boxes = ((0.0, 0.0, wide, tall), section)
    height = max(y1 - y0 for _, y0, _, y1 in boxes)
    sheet.size = (
        round(sum(x1 - x0 for x0, _, x1, _ in boxes) + GAP + 2 * MARGIN),
        round(height + 2 * MARGIN),
    )
    placed, x = [], MARGIN
    for group, (x0, y0, x1, y1) in zip(sheet.items, boxes, strict=True):
        assert isinstance(group, Group)
        down = MARGIN + (height - (y1 - y0)) / 2 - y0
        placed.append(Group(group.name, group.items, (x - x0, sheet.size[1] - down)))
        x += x1 - x0 + GAP
    sheet.items = list(placed)
    return svg(sheet)
