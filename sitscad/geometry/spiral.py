"""The centre line of one inward layer of a planar spiral, for every way to wind, exactly as the spec defines it.

Every function winds counter-clockwise about the origin from the outside in; `sitscad.geometry.shapes` has the outlines.
"""

from __future__ import annotations

import math
from itertools import pairwise

from sitscad.geometry.path import TWO_PI, Arc, Line, Path, Point, Segment, polar, rounded_polyline
from sitscad.record import record

CHORD_TOLERANCE = 0.05e-6
"""What is drawn follows the ideal curve within this distance, in metres (the contract allows 0.1 um)."""


@record
class SpiralDimensions:
    """Outer size [x, y] across the copper edges, trace width and turn-to-turn pitch (m); turns of this layer."""

    size: tuple[float, float]
    trace_width: float
    pitch: float
    turns: float

    @property
    def outer_radius(self) -> float:
        """Distance of the outermost centre line from the coil's centre across y (m)."""
        return (self.size[1] - self.trace_width) / 2


def archimedean(dimensions: SpiralDimensions, outer_angle: float) -> Path:
    """Archimedean spiral r = (D - w)/2 - p theta / (2 pi), drawn as arcs through three of its points each."""
    slope = dimensions.pitch / TWO_PI
    total = TWO_PI * dimensions.turns
    step = _arc_step(slope)
    count = max(1, math.ceil(total / step))

    def on_spiral(theta: float) -> Point:
        return polar(dimensions.outer_radius - slope * theta, outer_angle + theta)

    points = [on_spiral(total * i / (2 * count)) for i in range(2 * count + 1)]
    return Path(tuple(_arc_through(points[2 * i], points[2 * i + 1], points[2 * i + 2]) for i in range(count)))


def _arc_step(slope: float) -> float:
    """Angle of one arc: one through both ends and the middle of a spiral piece departs by under slope step^3 / 60."""
    return min(math.pi / 4, (60.0 * CHORD_TOLERANCE / slope) ** (1 / 3))


def _arc_through(start: Point, middle: Point, end: Point) -> Arc | Line:
    """The arc through three points; a line where they lie on one."""
    ax, ay = middle.x - start.x, middle.y - start.y
    bx, by = end.x - start.x, end.y - start.y
    cross = 2.0 * (ax * by - ay * bx)
    if abs(cross) < 1e-24:
        return Line(start, end)
    a2, b2 = ax * ax + ay * ay, bx * bx + by * by
    centre = Point(start.x + (by * a2 - ay * b2) / cross, start.y + (ax * b2 - bx * a2) / cross)
    return Arc(start, end, centre, ccw=cross > 0)


def regular(corners: int, dimensions: SpiralDimensions, outer_angle: float) -> Path:
    """The spiral on a regular polygon, one flat facing +x: side m lies floor(m / corners) pitches further in.

    The step inwards at the end of a whole turn shortens its last side; where less than a track's width would be left
    of it (in an octagon's small turns less than nothing), the spiral ends a corner earlier.
    """
    step = TWO_PI / corners
    first = math.floor((outer_angle - step / 2) / step + 1e-9)
    count = round(dimensions.turns * corners)

    def side(m: int, turn: int) -> tuple[float, float]:
        return first + 1 + m, _flat(dimensions, first + 1 + m, corners) - dimensions.pitch * turn

    sides = [side(-1, 0), *(side(m, m // corners) for m in range(count))]
    points = [crossing(one, other, step) for one, other in pairwise(sides)]
    end = crossing(sides[-1], side(count, count // corners), step)
    if count % corners or _advance(points[-1], end, sides[-1][0] * step) >= dimensions.trace_width:
        points.append(end)
    return Path(tuple(Line(a, b) for a, b in pairwise(points)))


def corner(corners: int, angle: float) -> float:
    """The angle (rad) of the last corner at or before an angle, walking counter-clockwise."""
    step = TWO_PI / corners
    return math.floor((angle - step / 2) / step + 1e-9) * step + step / 2


def _advance(start: Point, end: Point, normal: float) -> float:
    """How far (m) a point lies ahead of another along a side whose normal has this angle (rad)."""
    return (end.y - start.y) * math.cos(normal) - (end.x - start.x) * math.sin(normal)


def _flat(dimensions: SpiralDimensions, index: int, corners: int) -> float:
    """Distance of a flat's centre line: only a four-sided spiral may be longer one way than the other."""
    axis = index % 2 if corners == 4 else 1
    return (dimensions.size[axis] - dimensions.trace_width) / 2


def crossing(one: tuple[float, float], other: tuple[float, float], step: float) -> Point:
    """Where two lines cross, each given by the number of its normal's direction and its distance from the origin."""
    a, b = one[0] * step, other[0] * step
    determinant = math.sin(b - a)
    return Point(
        (one[1] * math.sin(b) - other[1] * math.sin(a)) / determinant,
        (other[1] * math.cos(a) - one[1] * math.cos(b)) / determinant,
    )


def racetrack(dimensions: SpiralDimensions, outer_angle: float) -> Path:
    """Straight sides along x and semicircles: turn joins turn because every other end is moved across by half a pitch.

    The first end that is walked is concentric about the axis, the other family stands p/2 nearer to the side that the
    layer began at, with radii p/2 smaller. Begins at the junction of the quadrant that ``outer_angle`` lies in.
    """
    half = (dimensions.size[0] - dimensions.size[1]) / 2
    quadrant = math.floor(outer_angle / (math.pi / 2) + 1e-9) % 4
    up = 1.0 if quadrant < 2 else -1.0
    side_first = quadrant % 2 == 0
    y, x = up * dimensions.outer_radius, half if quadrant in (0, 3) else -half
    segments: list[Segment] = []
    for piece in range(round(4 * dimensions.turns)):
        start = Point(x, y)
        if (piece % 2 == 0) == side_first:
            x = -x
            segments.append(Line(start, Point(x, y)))
            continue
        # The end that begins the second half of a turn comes back one pitch nearer to the axis.
        other = -y + (math.copysign(dimensions.pitch, y) if piece % 4 >= 2 else 0.0)
        segments.append(Arc(start, Point(x, other), Point(x, (y + other) / 2)))
        y = other
    return Path(tuple(segments))


def rounded_corners(path: Path, radius: float, sides: int, pitch: float) -> Path:
    """An inward polygon spiral with its corners rounded by `radius` (m), less where the sides are too short for it.

    Outside the inner end the radius grows from turn to turn by at most the pitch (m): more would cut a turn in towards
    that end, or towards the turn inside it. `sides` is the number of sides a turn.
    """
    if radius <= 0.0 or len(path.segments) < 2:
        return path
    corners = [path.start, *(segment.end for segment in path)]
    radii = [radius] * len(corners)
    for turn, corner in enumerate(range(len(corners) - 1 - sides, 0, -sides), start=1):
        radii[corner] = min(radius, turn * pitch)
    return rounded_polyline(corners, radii)
