"""The board's outline: the body under the coils, a taper, and the tail."""

from __future__ import annotations

from dataclasses import replace

from sitscad.geometry.path import Path, Point
from sitscad.layout.tail import CORNER_RADIUS, TailFrame, both_edges
from sitscad.layout.taper import Taper
from sitscad.record import record


@record
class Body:
    """The part of the board on the jaw: from `start` to `end` along x, `half_width` to both sides of the axis (m)."""

    start: float
    end: float
    half_width: float


def outline(body: Body, tail: TailFrame, copper: list[tuple[Point, float]], edge: float) -> Path:
    """The closed outline, counter-clockwise from the body's far lower corner.

    ``copper`` lists points of the body's copper with their half widths (m): a corner of the body is rounded only as far
    as they keep the distance `edge` from it.
    """
    return both_edges(
        [
            (Point(body.start, -body.half_width), far_corner_radius(body, copper, edge)),
            *_taper(body, tail).corners(),
            *tail.plug_taper.corners(),
            (Point(tail.end, -tail.plug_half_width), 0.0),
        ]
    )


def with_room_for_corners(body: Body, tail: TailFrame) -> Body:
    """The body, made as wide as a wider tail where the inner corner between them would not fit beside the far one."""
    taper = _taper(body, tail)
    first = taper.end - taper.length
    is_short = not taper.narrows and first - taper.reach_before < body.start + _side_room(body)
    return replace(body, half_width=tail.half_width) if is_short else body


def _taper(body: Body, tail: TailFrame) -> Taper:
    return replace(tail.taper, near=body.half_width)


def _side_room(body: Body) -> float:
    """The largest radius (m) that the body's sides leave its far corners: a fifth of the shorter one."""
    return 0.2 * min(2.0 * body.half_width, body.end - body.start)


def far_corner_radius(body: Body, copper: list[tuple[Point, float]], edge: float) -> float:
    """The largest radius (m) of the far corners, at most `CORNER_RADIUS`, that leaves all copper its distance."""
    radius = CORNER_RADIUS
    while radius > edge and not all(_keeps(body, radius, point, half + edge) for point, half in copper):
        radius -= 0.05e-3
    return min(max(radius, edge), _side_room(body))


def _keeps(body: Body, radius: float, point: Point, need: float) -> bool:
    """Whether a point near a far corner stays `need` away from the corner's arc."""
    x, y = body.start + radius, body.half_width - radius
    if point.x >= x or abs(point.y) <= y:
        return True
    return Point(point.x, abs(point.y)).distance(Point(x, y)) <= radius - need + 1e-9
