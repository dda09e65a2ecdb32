"""The body of the flexible circuit, its stiffener and the shield behind it. Copper is not modelled."""

from __future__ import annotations

from sitscad.geometry.path import rectangle
from sitscad.layout.board import Layout
from sitscad.parts.prism import prism
from sitscad.parts.solid import Solid, SolidRole
from sitscad.scene.stack import shield_size, stack
from sitscad.spec.profiles.presets import metal_colour


def board_body(layout: Layout) -> Solid:
    """The board's outline with its tail held straight, from the bottom face to z = 0."""
    shape = prism(layout.outline, *stack(layout).board)
    return Solid("board", shape, "polyimide", "#c8821e", SolidRole.BOARD)


def stiffener(layout: Layout) -> Solid | None:
    """The plate under the contacts, bonded to the board's bottom face."""
    if layout.stiffener is None:
        return None
    upper = stack(layout).board[0]
    shape = prism(layout.stiffener.outline, upper - layout.stiffener.thickness, upper)
    return Solid("stiffener", shape, layout.stiffener.material, "#8c6a3f", SolidRole.STIFFENER)


def shield(layout: Layout) -> Solid | None:
    """The sheet between coil and jaw, as large as the board's body, narrower where the port asks for it."""
    sheet, levels, size = layout.spec.shield, stack(layout).shield, shield_size(layout)
    if sheet is None or levels is None or size is None:
        return None
    x0, _, x1, _ = layout.body
    y, half = stack(layout).axis[1], size[1] / 2
    shape = prism(rectangle(x0, y - half, x1, y + half), *levels)
    return Solid("shield", shape, sheet.material.name, metal_colour(sheet.material.name), SolidRole.SHIELD)
