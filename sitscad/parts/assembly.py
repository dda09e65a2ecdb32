"""All solids of a sensor in their places."""

from __future__ import annotations

from sitscad.layout.board import Layout
from sitscad.parts.board import board_body, shield, stiffener
from sitscad.parts.jaw import jaw
from sitscad.parts.mount import mount
from sitscad.parts.pad import elastomer, encapsulation, target
from sitscad.parts.solid import Solid


def assemble(layout: Layout) -> tuple[Solid, ...]:
    """The solids that the spec contains, from the jaw upwards."""
    below = [solid for solid in (jaw(layout), *mount(layout), shield(layout), stiffener(layout)) if solid]
    below.sort(key=lambda solid: round(solid.shape.bounding_box().min.Z, 6))
    above = (board_body(layout), elastomer(layout), target(layout), encapsulation(layout))
    return (*below, *(solid for solid in above if solid))
