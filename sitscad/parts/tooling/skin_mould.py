"""The mould for the skin: an open cup in which the film round elastomer and target is cast, the board lying on it.

The cup goes on the jig's base the one way that its pins allow. It is filled lying open, the air taken out, and the base
with the finished sensor is put on it face down: what is too much leaves by grooves in the parting face, where no mark
is on the skin that senses. Its walls lean by the draft, so that the skin comes out; at their upper end the skin is as
thick as the spec has it.
"""

from __future__ import annotations

import math
from typing import Any

from sitscad.geometry.path import Region, circle, rectangle
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, box, face, one_solid, prism
from sitscad.parts.solid import Solid
from sitscad.parts.tooling.jig import PIN_HEIGHT, clearance, pins
from sitscad.parts.tooling.mould import COLOUR, DRAFT, MATERIAL, SPILL, Pour
from sitscad.scene.bodies import Body, BodyRole, above_board, top_height
from sitscad.scene.column import mount_tolerance
from sitscad.scene.plate import plate_plan
from sitscad.scene.stack import ground

ROOF = 2.5e-3
"""Plastic over the highest point of the skin (m)."""

VENT = (1.0e-3, 0.5e-3)
"""Width and depth of the grooves that let air and silicone out (m)."""

LEAST_OVER_TOLERANCE = 2.0
"""A skin thinner than so many tolerances of the printed cup would come out with holes in it."""


def skin_mould(layout: Layout) -> Solid | None:
    """The cup as it is printed, open side up; None without a film, or where the film is too thin to be cast."""
    if not is_cast(layout):
        return None
    plan, film = plate_plan(layout, 0.0), layout.spec.encapsulation
    assert film is not None
    height = max(top_height(layout.spec), PIN_HEIGHT) + ROOF
    cup = prism(rectangle(*plan, 2e-3), 0.0, height)
    x0, y0, x1, y1 = layout.body
    flange = prism(layout.outline, -1e-3, film.thickness) & box(x0, y0, -1e-3, x1, y1, film.thickness)
    cup = one_solid(cup - flange, "mould")
    for body in _blocks(layout):
        cup = one_solid(cup - _leaning(body, film.thickness, top_height(layout.spec)), "mould")
    for vent in _vents(layout, plan):
        cup = one_solid(cup - vent, "mould")
    gap = clearance(layout)
    for at, size in pins(plan):
        cup = one_solid(cup - prism(circle(at, size / 2 + gap), -1e-3, PIN_HEIGHT + gap), "mould")
    turned = one_solid(cup.rotate(require("build123d").Axis.X, 180.0), "mould")
    return Solid("mould-skin", turned, MATERIAL, COLOUR, BodyRole.MOULD)


def is_cast(layout: Layout) -> bool:
    """Whether the film is cast in a mould: there is one, thick enough for the process that prints the cup, and no
    contacts lie under it.
    """
    film = layout.spec.encapsulation
    if film is None or not above_board(layout.spec):
        return False
    body_end = layout.body[2]
    has_contacts = any(
        point.x < body_end - 1e-9
        for opening in layout.top_openings
        for segment in opening.outline
        for point in (segment.start, segment.end)
    )
    return film.thickness >= LEAST_OVER_TOLERANCE * mount_tolerance(layout.spec).band - 1e-12 and not has_contacts


def skin_pour(layout: Layout) -> Pour | None:
    """How much silicone the skin takes, and what is mixed for it; None where it is not cast."""
    film = layout.spec.encapsulation
    if film is None or not is_cast(layout):
        return None
    thick, top = film.thickness, top_height(layout.spec)
    inside = sum(_area(body, 0.0) * body.thickness for body in above_board(layout.spec))
    blocks = max(_area(body, thick + math.tan(DRAFT) * top / 2) for body in above_board(layout.spec))
    flange = max(0.0, Region(ground(layout)).area - blocks) * thick
    volume = flange + blocks * top - inside
    return Pour(1, volume, SPILL * volume)


def _area(body: Body, room: float) -> float:
    """A piece's area from above, so much larger all round (m), its corners rounded by that."""
    x, y = body.footprint.size
    if body.footprint.is_round:
        return math.pi * (x / 2 + room) ** 2
    return (x + 2.0 * room) * (y + 2.0 * room) - (4.0 - math.pi) * room**2


def _blocks(layout: Layout) -> list[Body]:
    """The pieces that the skin goes round; one where the other lies within it."""
    bodies = list(above_board(layout.spec))
    if len({body.footprint for body in bodies}) == 1:
        return bodies[:1]
    return bodies


def _leaning(body: Body, film: float, top: float) -> Any:
    """What a piece with its skin takes out of the cup: narrowest at the top, wider at the parting face by the draft."""
    bd = require("build123d")
    lean = math.tan(DRAFT) * top
    ends = [
        face(Region(body.outline(film + room))).moved(bd.Location((0, 0, height * MM))).outer_wire()
        for room, height in ((lean + math.tan(DRAFT) * 1e-3, -1e-3), (0.0, top))
    ]
    return bd.Solid.make_loft(ends, ruled=True)


def _vents(layout: Layout, plan: tuple[float, ...]) -> list[Any]:
    """Grooves in the parting face from the cavity's corners out over the cup's sides, away from the pins."""
    x0, y0, x1, y1 = layout.body
    width, depth = VENT
    found = []
    for x in (x0 + width / 2, x1 - width / 2):
        found.append(box(x - width / 2, plan[1] - 1e-3, -1e-3, x + width / 2, y0 + 0.5e-3, depth))
        found.append(box(x - width / 2, y1 - 0.5e-3, -1e-3, x + width / 2, plan[3] + 1e-3, depth))
    return found
