"""The jig in which board, elastomer and target are aligned while their glue sets: printed, and used again.

Base: the board lies in a recess of its own outline, face flush, over a hole to push it out by. Two pins of different
size guide what is put on it, so that nothing goes on the wrong way round. Elastomer and target each have a frame with a
well of their outline; its corners are drilled out, for glue and because no printer makes a sharp inner corner. A press
is a stamp that goes into the well until its collar rests on the frame: then the piece and the glue under it are as high
as they were meant to be, whoever presses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sitscad.geometry.convex import within_box
from sitscad.geometry.path import Path, Point, circle, rectangle
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.mounts.plate import grown
from sitscad.parts.prism import one_solid, prism, raised
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import Body, BodyRole, board_heights, elastomer, target
from sitscad.scene.column import print_limit
from sitscad.scene.plate import plate_plan

MATERIAL, COLOUR = "printed resin", "#b8c9a9"
FLOOR = 2.0e-3
PINS = (3.0e-3, 2.0e-3)
PIN_INSET = 3.0e-3
PIN_HEIGHT = 1.8e-3
PUSH_HOLE = 2.5e-3
CORNER_RELIEF = 0.5e-3
ROOM_ROUND_PAD = 1.0e-3
WELL = 1.5e-3
"""How deep a well is above its piece, so that the press is guided; frames are higher than the pins therefore."""
COLLAR = 4.0e-3
Box = tuple[float, float, float, float]


def jig(layout: Layout) -> tuple[Solid, ...]:
    """The pieces of the jig, standing as they are used; none for a sensor with nothing on its board."""
    pad, plate = elastomer(layout.spec), target(layout.spec)
    if pad is None and plate is None:
        return ()
    plan = plate_plan(layout, 0.0)
    found = [("jig-base", _base(layout, plan))]
    for lines, (body, under) in enumerate(((pad, None), (plate, pad)), 1 if pad is not None else 0):
        if body is not None:
            found.append((f"jig-{body.name}", _well(layout, plan, body, under)))
            found.append((f"jig-{body.name}-press", _press(body, max(1, lines) * layout.spec.assembly.glue_line)))
    return tuple(Solid(name, shape, MATERIAL, COLOUR, BodyRole.JIG) for name, shape in found)


def clearance(layout: Layout) -> float:
    """Between a piece and what guides it, on each side (m): the least that the mount's process can make."""
    mount = layout.spec.mount
    return print_limit(mount.process if mount is not None else "resin", "clearance").value


def _base(layout: Layout, plan: Box) -> Any:
    """The jig's base: a block with the board's outline sunk in, a hole to push it out, and pins."""
    under = board_heights(layout.spec)[0]
    body = prism(rectangle(*plan, 2e-3), under - FLOOR, 0.0)
    near = within_box(layout.outline, (plan[0] - 5e-3, plan[1] - 5e-3, plan[2] + 5e-3, plan[3] + 5e-3))
    if near is not None:  # a longer tail makes the same jig, to the last digit
        layout = replace(layout, outline=near.mapped(lambda p: Point(round(p.x, 12), round(p.y, 12))))
    body = one_solid(body - raised(grown(layout), under, 1e-3), "jig")
    for solid in _stiffener_room(layout, plan, under):
        body = one_solid(body - solid, "jig")
    middle = Point((layout.body[0] + layout.body[2]) / 2, (layout.body[1] + layout.body[3]) / 2)
    body = one_solid(body - prism(circle(middle, PUSH_HOLE / 2), under - FLOOR - 1e-3, 1e-3), "jig")
    for at, size in pins(plan):
        body = one_solid(body + prism(circle(at, size / 2), -FLOOR / 2, PIN_HEIGHT), "jig")
    return body


def _stiffener_room(layout: Layout, plan: Box, under: float) -> tuple[Any, ...]:
    """What a stiffener that lies over the base takes out of it."""
    plate, gap = layout.stiffener, clearance(layout)
    if plate is None:
        return ()
    points = [point for segment in plate.outline.outline for point in (segment.start, segment.end)]
    x0, x1 = min(p.x for p in points) - gap, max(p.x for p in points) + gap
    y0, y1 = min(p.y for p in points) - gap, max(p.y for p in points) + gap
    if x0 >= plan[2]:
        return ()
    return (prism(rectangle(x0, y0, x1, y1), under - plate.thickness - gap, 1e-3),)


def _well(layout: Layout, plan: Box, body: Body, under: Body | None) -> Any:
    """A piece's frame: a well of its outline, and below it room for the one that is glued already."""
    height = body.upper + WELL
    cuts = [(body, clearance(layout), body.lower, height)]
    if under is not None:
        cuts.append((under, ROOM_ROUND_PAD, 0.0, body.lower))
    return _windowed(layout, plan, height, tuple(cuts))


def _windowed(layout: Layout, plan: Box, height: float, cuts: tuple[tuple[Body, float, float, float], ...]) -> Any:
    """A plate on the base with windows: each a body, what is left free round it, and from where to where (m)."""
    frame = prism(rectangle(*plan, 2e-3), 0.0, height)
    gap = clearance(layout)
    for at, size in pins(plan):
        frame = one_solid(frame - prism(circle(at, size / 2 + gap), -1e-3, height + 1e-3), "jig")
    for body, room, lower, upper in cuts:
        lower, upper = (lower if lower > 0.0 else -1e-3), (upper if upper < height else height + 1e-3)
        for outline in (body.outline(room), *_reliefs(body)):
            frame = one_solid(frame - prism(outline, lower, upper), "jig")
    return frame


def _press(body: Body, glue: float) -> Any:
    """The stamp: its foot has the piece's outline, a clearance less than the well, its collar what fingers want. It
    stops on the frame when the piece's upper face is as high as `glue` (m) under it makes it. It lies on its collar, as
    it is printed.
    """
    top = body.upper + WELL
    foot = prism(body.outline(), body.upper + glue, top)
    x0, y0, x1, y1 = body.footprint.box
    collar = prism(rectangle(x0 - COLLAR, y0 - COLLAR, x1 + COLLAR, y1 + COLLAR, 2e-3), top, top + COLLAR)
    turned = one_solid(foot + collar, "press").rotate(require("build123d").Axis.X, 180.0)
    return one_solid(turned, "press")


def _reliefs(body: Body) -> tuple[Path, ...]:
    """Holes in a window's corners; none for a disc."""
    if body.footprint.is_round:
        return ()
    return tuple(circle(corner, CORNER_RELIEF) for corner in _corners(body.outline()))


def _corners(outline: Path) -> list[Point]:
    return [segment.start for segment in outline]


def pins(plan: Box) -> tuple[tuple[Point, float], tuple[Point, float]]:
    """Where the pins stand, and how thick they are: in two corners, clear of board and tail."""
    low = Point(plan[0] + PIN_INSET, plan[1] + PIN_INSET)
    high = Point(plan[2] - PIN_INSET, plan[3] - PIN_INSET)
    return (low, PINS[0]), (high, PINS[1])
