"""A bench plate from above, and where its screws stand: clear of board and tail, in it or in an adapter below it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.scene.bodies import above_board
from sitscad.scene.jaws import axis
from sitscad.spec.mount import Hole, HolePattern

BORDER = 6.0e-3
"""Plastic round the board and what overhangs it, for the screws (m)."""

INSET = 3.0e-3
BESIDE_HEAD = 1.0e-3
"""Between a screw's head and the board or what overhangs it (m)."""

ROUND_HOLE = 2.0e-3
"""Plastic round a screw's head, out to the plate's edge (m)."""

Box = tuple[float, float, float, float]


@record
class Screw:
    """A screw with its nut: clearance hole, head, the nut's pocket across flats and its height (m)."""

    hole: float
    head: float
    nut_across: float
    nut_height: float


CORNER_SCREW = Screw(2.4e-3, 3.8e-3, 4.2e-3, 1.8e-3)
"""M2: ISO 273 medium, ISO 4762; nut ISO 4032 (4 mm across flats, 1.6 mm high) with 0.2 mm of room."""


def plate_plan(layout: Layout, film: float) -> Box:
    """The plate's rectangle: the body, whatever overhangs it and the tail beside the screws, a border for these, and
    the holes that it is screwed down by.
    """
    x0, y0, x1, y1 = layout.body
    near = [point.y for point in layout.outline.flattened(1e-5) if point.x < x1 + BORDER]
    y0, y1 = min(y0, *near), max(y1, *near)
    for body in above_board(layout.spec):
        left, low, right, high = body.footprint.box
        x0, y0, x1, y1 = min(x0, left - film), min(y0, low - film), max(x1, right + film), max(y1, high + film)
    plan = x0 - BORDER, y0 - BORDER, x1 + BORDER, y1 + BORDER
    far = reach(layout)
    return min(plan[0], far[0]), min(plan[1], far[1]), max(plan[2], far[2]), max(plan[3], far[3])


def holes_in_plate(layout: Layout, plan: Box) -> tuple[Hole, ...]:
    """The holes through the plate: its pattern's where they are clear of the board, else four in its corners."""
    own = _clear_pattern(layout)
    return own if own else corner_holes(plan)


def adapter_needed(layout: Layout) -> tuple[Hole, ...]:
    """The holes of an adapter: a pattern's that lie under board or tail; none where the plate has them itself."""
    pattern = _pattern(layout)
    if pattern is None or _clear_pattern(layout):
        return ()
    return _placed(layout, pattern)


def corner_holes(plan: Box) -> tuple[Hole, ...]:
    """Four holes in the corners of a plate; its border keeps them clear of board and tail."""
    x0, y0, x1, y1 = plan[0] + INSET, plan[1] + INSET, plan[2] - INSET, plan[3] - INSET
    centres = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    return tuple(Hole(centre, CORNER_SCREW.hole, CORNER_SCREW.head) for centre in centres)


def reach(layout: Layout) -> Box:
    """The rectangle (m) that a pattern's holes with their heads ask for; the middle of the body where they ask none."""
    middle, pattern = axis(layout), _pattern(layout)
    points = [(middle.x, middle.y, 0.0)]
    if pattern is not None:
        room = ROUND_HOLE
        points += [(*hole.at, hole.head / 2 + room) for hole in _placed(layout, pattern)]
    return (
        min(x - r for x, _, r in points),
        min(y - r for _, y, r in points),
        max(x + r for x, _, r in points),
        max(y + r for _, y, r in points),
    )


def _pattern(layout: Layout) -> HolePattern | None:
    """The plate's pattern; None for screws in its own corners."""
    mount = layout.spec.mount
    found = mount.holes if mount is not None else None
    if found is None or (found.grid is None and found.name == "corners-m2"):
        return None
    return found


def _clear_pattern(layout: Layout) -> tuple[Hole, ...]:
    """A pattern's holes where all of them are clear of board, tail and what stands over it; else none."""
    pattern = _pattern(layout)
    if pattern is None:
        return ()
    holes = _placed(layout, pattern)
    return holes if all(_is_clear(layout, hole) for hole in holes) else ()


def _placed(layout: Layout, pattern: HolePattern) -> tuple[Hole, ...]:
    """A pattern's holes in their places about the middle of the board's body."""
    middle = axis(layout)
    if pattern.grid is None:
        return tuple(Hole((middle.x + h.at[0], middle.y + h.at[1]), h.diameter, h.head) for h in pattern.holes)
    kind = pattern.holes[0]
    along, across = _steps(layout, pattern.grid, kind)
    return tuple(
        Hole((middle.x + i * along / 2, middle.y + j * across / 2), kind.diameter, kind.head)
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    )


def _steps(layout: Layout, grid: float, kind: Hole) -> tuple[float, float]:
    """How far apart the four holes of a bench are that a plate takes (m): the nearest that are clear of the board."""
    x0, low, x1, high = next(iter(_boxes(layout)))
    for box in _boxes(layout):
        low, high = min(low, box[1]), max(high, box[3])
    middle = axis(layout)
    half = max(high - middle.y, middle.y - low) + kind.head / 2 + BESIDE_HEAD
    across = grid * math.ceil(2.0 * half / grid - 1e-9)
    along = grid * max(1, math.ceil((x1 - x0) / grid - 1e-9))
    return along, across


def _boxes(layout: Layout) -> Iterator[Box]:
    """The body, the tail beside it and what stands on the board, from above."""
    yield layout.body
    near = [p for p in layout.outline.flattened(1e-5) if p.x < layout.body[2] + 30e-3]
    yield layout.body[2], min(p.y for p in near), max(p.x for p in near), max(p.y for p in near)
    for body in above_board(layout.spec):
        yield body.footprint.box


def _is_clear(layout: Layout, hole: Hole) -> bool:
    room, (x, y) = hole.head / 2 + BESIDE_HEAD, hole.at
    boxes = (box for box in _boxes(layout) if box[2] > box[0])
    return all(math.hypot(max(b[0] - x, 0.0, x - b[2]), max(b[1] - y, 0.0, y - b[3])) >= room - 1e-9 for b in boxes)
