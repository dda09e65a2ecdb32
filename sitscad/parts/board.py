"""The body of the flexible circuit, its stiffener and the shield behind it. Copper is not modelled."""

from __future__ import annotations

from dataclasses import replace

from sitscad.geometry.path import bounding_box
from sitscad.layout.board import Layout
from sitscad.parts.prism import box, one_solid, prism
from sitscad.parts.solid import Solid
from sitscad.scene import stack
from sitscad.scene.bodies import Body
from sitscad.spec.presets import metal_colour


def board_body(layout: Layout) -> Solid:
    """The board's outline with its tail held straight, up to z = 0: the body of all layers, beyond it the tail of those
    that run down it.
    """
    board, under = stack.board(layout), stack.tail_heights(layout)[0]
    whole = _drawn_out(board, "#c8821e")
    if under - board.lower < 1e-9:
        return whole
    _, y0, x1, y1 = bounding_box((layout.outline,))
    below = box(layout.body[2], y0 - 1e-3, board.lower - 1e-3, x1 + 1e-3, y1 + 1e-3, under)
    return replace(whole, shape=one_solid(whole.shape - below, "board"))


def stiffener(layout: Layout) -> Solid | None:
    """The plate under the contacts, bonded to the board's bottom face."""
    plate = stack.stiffener(layout)
    return None if plate is None else _drawn_out(plate, "#8c6a3f")


def shield(layout: Layout) -> Solid | None:
    """The sheet between coil and jaw, as large as the board's body, narrower where the port asks for it."""
    sheet = stack.shield(layout)
    return None if sheet is None else _drawn_out(sheet, metal_colour(sheet.material))


def _drawn_out(body: Body, colour: str) -> Solid:
    return Solid(body.name, prism(body.region, *body.heights), body.material, colour, body.role)
