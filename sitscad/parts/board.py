"""The body of the flexible circuit, its stiffener and the shield behind it. Copper is not modelled."""

from __future__ import annotations

from sitscad.layout.board import Layout
from sitscad.parts.prism import prism
from sitscad.parts.solid import Solid
from sitscad.scene import stack
from sitscad.scene.bodies import Body
from sitscad.spec.profiles.presets import metal_colour


def board_body(layout: Layout) -> Solid:
    """The board's outline with its tail held straight, from the bottom face to z = 0."""
    return _drawn_out(stack.board(layout), "#c8821e")


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
