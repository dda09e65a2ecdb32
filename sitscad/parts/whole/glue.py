"""The glue lines: between every two pieces that lie on each other, as wide as both faces reach."""

from __future__ import annotations

from typing import Any

from sitscad.geometry.path import Region, rectangle
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, face, raised
from sitscad.parts.solid import Solid
from sitscad.record import record
from sitscad.scene.bodies import BodyRole, board_heights
from sitscad.scene.column import GLUE, column

COLOUR = "#b6d7a8"
SAME_LEVEL = 1e-6  # mm


@record(eq=False)
class Plate:
    """A piece that glue lies under or on: its level faces (build123d), and the heights (mm) of its lowest and highest
    planes.
    """

    faces: list[Any]
    low: float
    high: float

    def at(self, height: float) -> list[Any]:
        """The faces in a level plane (mm)."""
        return [each for each in self.faces if abs(each.center().Z - height) < SAME_LEVEL]


def glue_lines(layout: Layout, pieces: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """A solid for every glue line between pieces that stand at their glued heights; none where the line is 0."""
    line, glue = layout.spec.assembly.glue_line, layout.spec.assembly.adhesive
    if not line or glue is None:
        return ()
    plates = {solid.name: _plate(solid.shape) for solid in pieces} | {"board": _board(layout)}
    found = []
    for part in _glued(layout, plates):
        shape = _line(part, plates, line * MM)
        if shape is not None:
            found.append(Solid(f"glue-{part}", shape, glue.name, COLOUR, BodyRole.GLUE))
    return tuple(found)


def _glued(layout: Layout, plates: dict[str, Plate]) -> list[str]:
    """The pieces that have glue under them."""
    named = [layer.part.removeprefix(GLUE) for layer in column(layout) if layer.is_glue]
    wanted = named or ["shield", "mount-spacer", "board", "elastomer", "target"]
    return [name for name in wanted if name in plates]


def _line(part: str, plates: dict[str, Plate], line: float) -> Any | None:
    """The glue (thickness in mm) under a piece: its lower face as far as what is below reaches; None over nothing."""
    bd, over = require("build123d"), plates[part]
    height = over.low - line
    below = [each for name, plate in plates.items() if name != part for each in plate.at(height)]
    if not below:
        return None
    bounds = [each.bounding_box() for each in below]
    x0, y0 = min(b.min.X for b in bounds), min(b.min.Y for b in bounds)
    x1, y1 = max(b.max.X for b in bounds), max(b.max.Y for b in bounds)
    widest = max(over.at(over.low), key=lambda each: float(each.area))
    upright = widest if widest.normal_at().Z > 0 else -widest
    reach = face(Region(rectangle(x0 / MM, y0 / MM, x1 / MM, y1 / MM)))
    plan = (upright.moved(bd.Location((0, 0, -over.low))) & reach).faces()
    if not plan:
        return None
    return raised(plan[0].moved(bd.Location((0, 0, height))), 0.0, line / MM)


def _board(layout: Layout) -> Plate:
    """The board's body, whose films are pieces of their own."""
    bd, (x0, y0, x1, y1) = require("build123d"), layout.body
    low, high = (height * MM for height in board_heights(layout.spec))
    body = (face(Region(layout.outline)) & face(Region(rectangle(x0, y0, x1, y1)))).faces()[0]
    return Plate([body.moved(bd.Location((0, 0, height))) for height in (low, high)], low, high)


def _plate(shape: Any) -> Plate:
    bounds = shape.bounding_box()
    level = [each for each in shape.faces() if each.bounding_box().size.Z < SAME_LEVEL]
    return Plate(level, float(bounds.min.Z), float(bounds.max.Z))
