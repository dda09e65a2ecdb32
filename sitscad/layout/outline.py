"""The board's outline: the body under the coils, a taper, and the tail."""

from __future__ import annotations

from sitscad.geometry.path import Path, Point, rounded
from sitscad.layout.tail import CORNER_RADIUS, TailFrame
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
    as they keep the distance `edge` from it. Where the taper begins, the radius is that of the lead which bends there,
    so that the lead keeps its distance round the corner.
    """
    wide, narrow = body.half_width, tail.half_width
    shoulder = edge + tail.neck_width / 2
    inner, outer = (CORNER_RADIUS, shoulder) if narrow < wide else (shoulder, CORNER_RADIUS)
    lower = [
        (Point(body.start, -wide), far_corner_radius(body, copper, edge)),
        (Point(tail.body_end, -wide), outer),
        (Point(tail.start, -narrow), inner),
        *((corner, 0.0) for corner in tail.lower_shoulder()),
        (Point(tail.end, -tail.plug_half_width), 0.0),
    ]
    if abs(wide - narrow) < 1e-9:
        lower = [lower[0], *lower[3:]]
    upper = [(point._replace(y=-point.y), radius) for point, radius in reversed(lower)]
    corners = [point for point, _ in lower + upper]
    radii = [_fitting(corners, i, radius) for i, (_, radius) in enumerate(lower + upper)]
    return rounded(corners, radii)


def far_corner_radius(body: Body, copper: list[tuple[Point, float]], edge: float) -> float:
    """The largest radius (m) of the far corners, at most `CORNER_RADIUS`, that leaves all copper its distance."""
    radius = CORNER_RADIUS
    while radius > edge and not all(_keeps(body, radius, point, half + edge) for point, half in copper):
        radius -= 0.05e-3
    return max(radius, edge)


def _keeps(body: Body, radius: float, point: Point, need: float) -> bool:
    """Whether a point near a far corner stays `need` away from the corner's arc."""
    x, y = body.start + radius, body.half_width - radius
    if point.x >= x or abs(point.y) <= y:
        return True
    return Point(point.x, abs(point.y)).distance(Point(x, y)) <= radius - need + 1e-9


def _fitting(corners: list[Point], index: int, radius: float) -> float:
    """The radius, at most a fifth of the shorter of the two sides that meet in the corner."""
    here, count = corners[index], len(corners)
    return min(radius, 0.2 * min(here.distance(corners[index - 1]), here.distance(corners[(index + 1) % count])))
