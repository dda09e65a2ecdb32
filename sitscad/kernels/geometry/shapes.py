"""Outlines of coils: a row of `SHAPES` for each, and a class for each kind of winding.

Other modules use the features of an outline, never its name. `Outline.bounds` names the shapes whose fitted error
bounds hold for coils of this shape. `Outline.plate` is the form in which a plate of this shape is computed and cut. The
use of a shape without these entries raises an error with the shape's name. A class inherits the features of another
shape, but not its fits.

Lengths are in metres, angles in radians. A coil's size is [x, y] across its outer copper edges. The centre line of a
layer is wound exactly as the spec defines it: counter-clockwise about the origin, from the outside to the inside.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from itertools import pairwise
from typing import ClassVar

from sitscad.basics.record import record
from sitscad.basics.units import in_mm
from sitscad.kernels.geometry.path import (
    TWO_PI,
    Arc,
    Line,
    Path,
    Point,
    Segment,
    arc_through,
    circle,
    polar,
    rectangle,
    rounded_polygon,
    rounded_polyline,
)

CHORD_TOLERANCE = 0.05e-6
"""Largest distance (m) between the arcs of a layer and the exact spiral. The limit in the format of specs is 0.1 um."""

SKETCHED = 10e-6
"""Largest distance (m) between the arcs and the exact spiral in sketches. One arc then covers nearly half a turn."""


@record
class SpiralDimensions:
    """Dimensions of one layer of a coil in metres.

    `size` [x, y] is measured across the outer copper edges. `trace_width` is the width of the track, `pitch` the
    distance of the centre lines of adjacent turns. `tolerance` is the largest distance between the arcs of a layer and
    the exact spiral. If `is_mid_side`, a four-sided layer begins and ends in the middle of sides, otherwise at corners.
    """

    size: tuple[float, float]
    trace_width: float
    pitch: float
    turns: float
    tolerance: float = CHORD_TOLERANCE
    is_mid_side: bool = False

    @property
    def outer_radius(self) -> float:
        """Distance (m) along y from the coil's centre to the centre line of the outermost track."""
        return (self.size[1] - self.trace_width) / 2


def crossing(first: tuple[float, float], second: tuple[float, float], step: float) -> Point:
    """Return the intersection (m) of two lines.

    Each line is (k, d): the direction of its normal is k times `step` (rad), and d (m) is its distance from the origin.
    """
    a, b = first[0] * step, second[0] * step
    determinant = math.sin(b - a)
    return Point(
        (first[1] * math.sin(b) - second[1] * math.sin(a)) / determinant,
        (second[1] * math.cos(a) - first[1] * math.cos(b)) / determinant,
    )


def rounded_corners(path: Path, radius: float, sides: int, pitch: float) -> Path:
    """Return a polygon spiral with its corners rounded by `radius` (m), or less if the sides are too short.

    `path` is the spiral from the outside to the inside, `sides` the number of sides per turn. From the inner end
    outwards, the radius increases by at most the pitch (m) per turn. A faster increase would bring a turn too near to
    the inner end or to the next turn inside.
    """
    if radius <= 0.0 or len(path.segments) < 2:
        return path
    corners = [path.start, *(segment.end for segment in path)]
    radii = [radius] * len(corners)
    for turn, corner in enumerate(range(len(corners) - 1 - sides, 0, -sides), start=1):
        radii[corner] = min(radius, turn * pitch)
    return rounded_polyline(corners, radii)


Size = tuple[float, float]
"""Size across the outer copper edges along x and y (m)."""

PLATE_FORMS = ("disc", "rectangle")
"""Forms of plates that sitscad can compute (target response, pad law) and cut (laser sheet)."""

_SLACK = 1e-9
"""Number of pitches by which the room for turns is reduced, so that rounding does not add a turn."""
_ORIGIN = Point(0.0, 0.0)
"""Centre of all coils."""


@record
class Outline(ABC):
    """Features of one shape of coils and plates.

    ``name`` is the name in specs, ``adjective`` the word in messages. ``sides`` is the number of straight sides of a
    polygon, 0 for other shapes. ``is_long`` is true if x and y may differ. ``is_round`` is true if the coil is a spiral
    about its centre without a straight part.

    ``bounds`` names the shapes whose fitted error bounds hold for coils of this shape. It is the shape itself. For a
    polygon without a fit, it is the fitted polygons with fewer and with more sides. ``plate`` is the form in which a
    target, a pad or a finger of this shape is computed and cut: "disc" or "rectangle". Both are empty if they are
    unknown.
    """

    name: str
    adjective: str
    sides: int = 0
    is_long: bool = False
    bounds: tuple[str, ...] = ()
    plate: str = ""
    is_round: ClassVar[bool] = False

    @property
    def shapes_with_bounds(self) -> tuple[str, ...]:
        """Names of the shapes whose error bounds hold for coils of this shape.

        Raises ValueError for a shape without `bounds`.
        """
        if not self.bounds:
            raise ValueError(f"no coil of shape {self.name!r} can be computed: the shape declares no error bounds")
        return self.bounds

    @property
    def is_disc(self) -> bool:
        """Whether a plate of this shape is a disc; it is a rectangle otherwise.

        Raises ValueError for a shape without `plate`.
        """
        if self.plate not in PLATE_FORMS:
            raise ValueError(f"no plate of shape {self.name!r} can be computed: the shape declares no form of a plate")
        return self.plate == PLATE_FORMS[0]

    @property
    def ends_per_turn(self) -> int | None:
        """Number of positions per turn at which a layer may end, None if it may end anywhere.

        The number of turns is a multiple of 1/`ends_per_turn`.
        """
        return self.sides or None

    @property
    def size_note(self) -> str:
        """Text in a drawing that states how the size is measured. Empty if this needs no text."""
        if self.is_round:
            return "in diameter "
        if self.sides % 2:  # no two flats face each other
            return "twice from the centre to the flats "
        return "across flats " if self.sides > 4 else ""

    def size_text(self, size: Size) -> str:
        """Return a size in millimetres, without the unit: a diameter, or both sides."""
        return f"diameter {in_mm(size[0])}" if self.is_round else f"{in_mm(size[0])} x {in_mm(size[1])}"

    @property
    def area(self) -> float:
        """Area of the shape with sharp corners, divided by the area of its bounding rectangle."""
        return 1.0

    @property
    def turn_shortening(self) -> float:
        """Length (m) by which a turn becomes shorter if it lies one metre further inside."""
        return TWO_PI

    @abstractmethod
    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """Return the centre line of a layer, wound counter-clockwise about the origin from the outside to the inside.

        The layer begins at `outer_angle` (rad), or at the last place before it at which layers of this shape may begin.
        """

    def start(self, angle: float, sense: int, is_mid_side: bool = False) -> float:
        """Return the angle (rad) at which a layer starts if a start at `angle` (rad) is wanted.

        Polygons and racetracks start at certain places only. `sense` is +1 for counter-clockwise winding and -1 for
        clockwise. `is_mid_side` is explained in `SpiralDimensions`.
        """
        return angle

    @abstractmethod
    def boundary(self, size: Size, offset: float) -> Path:
        """Return the closed counter-clockwise curve at a distance `offset` (m) outside the outer copper edge.

        It begins at +x, y = 0.
        """

    @abstractmethod
    def edge(self, size: Size, radius: float) -> Path:
        """Return the closed curve of the outer copper edge.

        The corners of a polygon are rounded by `radius` (m).
        """

    @abstractmethod
    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """Return the points and the radius (m) that define the outer copper edge.

        The edge is the convex hull of the points, expanded by the radius.
        """

    def corner_radius(self, size: Size, required: float) -> float:
        """Return the corner radius (m) of the outer copper edge: `required` (m) for polygons.

        For a racetrack it is the radius of the half circles.
        """
        return required

    @property
    def outermost_turns(self) -> float:
        """Number of turns along the outer edge before the winding moves inwards: 1, or 0 for a circle."""
        return 1.0

    def inset(self, trace_width: float, pitch: float, turns: float) -> float:
        """Return the distance (m) from the outer to the inner copper edge of a layer.

        For a polygon it is the mean over the sides of the innermost turn.
        """
        return trace_width + pitch * max(0.0, turns - self.outermost_turns)

    INWARD: ClassVar[tuple[float, float]] = (0.0, 0.0)
    """Mean distance from the start of a turn inwards to its track, divided by the pitch, as two terms.

    It is the first term plus the second times the wound fraction of the turn (1 for a whole turn).
    """

    def wind(
        self, dimensions: SpiralDimensions, outer_angle: float, sense: int = 1, corner_radius: float = 0.0
    ) -> Path:
        """Return the centre line of one layer from its outer end inwards, about the origin, with rounded corners.

        Parameters
        ----------
        dimensions : SpiralDimensions
            dimensions of the layer
        outer_angle : float
            angle of the outer end (rad). A polygon begins at the last corner at or before it in winding direction.
        sense : int, optional
            +1 for counter-clockwise, -1 for clockwise
        corner_radius : float, optional
            radius of the corners (m)
        """
        path = self.inwards(dimensions, sense * outer_angle)
        path = path if sense > 0 else path.mapped(lambda p: Point(p.x, -p.y), flips=True)
        if dimensions.is_mid_side:  # no corner lies outside of its inner end
            corners = [path.start, *(segment.end for segment in path)]
            return rounded_polyline(corners, [corner_radius] * len(corners)) if corner_radius > 0.0 else path
        return rounded_corners(path, corner_radius, self.sides, dimensions.pitch) if self.sides else path

    def nearest_turns(self, turns: float) -> float:
        """Return the allowed number of turns nearest to `turns`, a multiple of 1/`ends_per_turn` and not 0."""
        return turns if self.ends_per_turn is None else max(1, round(turns * self.ends_per_turn)) / self.ends_per_turn

    def is_whole(self, turns: float) -> bool:
        """Whether a layer with this number of turns ends at an allowed position (`ends_per_turn`).

        Differences of up to one part in 10^6 are accepted as rounding, for example 2.166667.
        """
        return abs(self.nearest_turns(turns) - turns) <= 1e-6 * max(1.0, turns)

    def most_turns(self, size: Size, trace_width: float, pitch: float) -> float:
        """Return the largest number of turns for which the innermost track does not reach the centre.

        It is 0 if there is no space for a turn.
        """
        room = (min(size) / 2 - trace_width) / pitch - _SLACK
        return self._most_turns_in_room(room) if room > 0 else 0.0

    @abstractmethod
    def _most_turns_in_room(self, room: float) -> float:
        """Return the largest number of turns if the outermost track is `room` pitches away from the centre."""


@record
class Round(Outline):
    """Circle: an Archimedean spiral that may end anywhere. The radius of its inner edge stays positive.

    The radius of the inner edge is (D - w)/2 - p N - w/2, with diameter D, track width w, pitch p and N turns.
    """

    is_round: ClassVar[bool] = True

    @property
    def area(self) -> float:
        """Area of a circle divided by the area of its square."""
        return math.pi / 4.0

    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """Return an Archimedean spiral r = (D - w)/2 - p theta / (2 pi), as arcs through three of its points each.

        D is the diameter, w the track width, p the pitch. The spiral begins at `outer_angle` (rad).
        """
        slope = dimensions.pitch / TWO_PI
        total = TWO_PI * dimensions.turns
        # an arc through both ends and the middle of a spiral piece departs from it by under slope step^3 / 60
        longest = math.pi / 4 if dimensions.tolerance <= CHORD_TOLERANCE else 0.95 * math.pi
        count = max(1, math.ceil(total / min(longest, (60.0 * dimensions.tolerance / slope) ** (1 / 3))))
        angles = (total * i / (2 * count) for i in range(2 * count + 1))
        points = [polar(dimensions.outer_radius - slope * theta, outer_angle + theta) for theta in angles]
        return Path(tuple(arc_through(points[2 * i], points[2 * i + 1], points[2 * i + 2], 1e-24)
                          for i in range(count)))

    def boundary(self, size: Size, offset: float) -> Path:
        """Return a circle as four quarters, at a distance `offset` (m) outside the outer copper edge."""
        radius = size[0] / 2 + offset
        east, north = Point(radius, 0.0), Point(0.0, radius)
        west, south = Point(-radius, 0.0), Point(0.0, -radius)
        return Path(tuple(Arc(a, b, _ORIGIN) for a, b in pairwise((east, north, west, south, east))))

    def edge(self, size: Size, radius: float) -> Path:
        """Return the circle of the outer copper edge. It has no corners, so `radius` has no effect."""
        return circle(_ORIGIN, size[0] / 2)

    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """Return the circle's centre and the radius (m) of the outer copper edge."""
        return (_ORIGIN,), size[0] / 2

    @property
    def outermost_turns(self) -> float:
        """0: the winding moves inwards from its outer end."""
        return 0.0

    INWARD: ClassVar[tuple[float, float]] = (0.0, 0.5)  # a spiral comes inwards steadily

    def _most_turns_in_room(self, room: float) -> float:
        return room


@record
class Polygon(Outline):
    """Regular polygon with one flat facing +x, or a rectangle.

    Turns end at corners and step inwards after each whole turn. The flat of the innermost track's inner edge is (D -
    w)/2 - p floor(N) - w/2 from the centre. Here D is the size, w the track width, p the pitch and N the number of
    turns. This distance stays positive.
    """

    @property
    def area(self) -> float:
        """Area of the regular polygon, divided by the area of the square round its inscribed circle."""
        return 1.0 if self.sides == 4 else self.sides * math.tan(math.pi / self.sides) / 4.0

    @property
    def turn_shortening(self) -> float:
        """Length (m) by which a turn becomes shorter if it lies one metre further inside.

        It is twice the tangent of half the change of direction at a corner, summed over the corners.
        """
        return 8.0 if self.sides == 4 else 2.0 * self.sides * math.tan(math.pi / self.sides)

    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """Return the centre line of a polygon spiral; side number m lies floor(m / sides) pitches further inside.

        The step inwards at the end of a whole turn shortens its last side. If less than a track's width would remain of
        the side, the spiral ends a corner earlier. In an octagon's small turns the remainder can be negative. Only a
        four-sided spiral may have different sizes along x and y.
        """
        step = TWO_PI / self.sides
        first = math.floor((outer_angle - (0.0 if dimensions.is_mid_side else step / 2)) / step + 1e-9)
        first -= dimensions.is_mid_side
        count = round(dimensions.turns * self.sides)

        def side(m: int, turn: int) -> tuple[float, float]:
            index = first + 1 + m
            size = dimensions.size[index % 2 if self.sides == 4 else 1]
            return index, (size - dimensions.trace_width) / 2 - dimensions.pitch * turn

        if dimensions.is_mid_side:  # from the middle of the first side to the middle of the last side
            flats = [side(m, m // self.sides) for m in range(count + 1)]
            begin, end = (polar(distance, index * step) for index, distance in (flats[0], flats[-1]))
            points = [begin, *(crossing(this, other, step) for this, other in pairwise(flats)), end]
            return Path(tuple(Line(a, b) for a, b in pairwise(points)))
        sides = [side(-1, 0), *(side(m, m // self.sides) for m in range(count))]
        points = [crossing(this, other, step) for this, other in pairwise(sides)]
        end, normal = crossing(sides[-1], side(count, count // self.sides), step), sides[-1][0] * step
        ahead = (end.y - points[-1].y) * math.cos(normal) - (end.x - points[-1].x) * math.sin(normal)
        if count % self.sides or ahead >= dimensions.trace_width:
            points.append(end)
        return Path(tuple(Line(a, b) for a, b in pairwise(points)))

    def start(self, angle: float, sense: int, is_mid_side: bool = False) -> float:
        """Return the angle (rad) of the last corner, or middle of a side, at or before `angle` in winding direction.

        `sense` is +1 for counter-clockwise winding and -1 for clockwise. With `is_mid_side`, layers begin at the middle
        of a side.
        """
        step = TWO_PI / self.sides
        if is_mid_side:
            return sense * math.floor(sense * angle / step + 1e-9) * step
        return sense * (math.floor((sense * angle - step / 2) / step + 1e-9) * step + step / 2)

    def boundary(self, size: Size, offset: float) -> Path:
        """Return the polygon at a distance `offset` (m) outside the outer copper edge."""
        flats = [(i, size[i % 2 if self.sides == 4 else 1] / 2 + offset) for i in range(self.sides + 1)]
        points = [crossing(a, b, TWO_PI / self.sides) for a, b in pairwise(flats)]
        east = Point(size[0] / 2 + offset, 0.0)
        segments: list[Segment] = [Line(a, b) for a, b in pairwise([east, *points, east])]
        return Path(tuple(segments))

    def edge(self, size: Size, radius: float) -> Path:
        """Return the polygon of the outer copper edge, with corners rounded by `radius` (m)."""
        x, y = size[0] / 2, size[1] / 2
        if self.sides == 4:
            return rectangle(-x, -y, x, y, radius)
        step = TWO_PI / self.sides
        reach = x / math.cos(step / 2)
        return rounded_polygon([polar(reach, (i + 0.5) * step) for i in range(self.sides)], radius)

    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """Return the polygon's corners and the radius 0 (m)."""
        x, y = size[0] / 2, size[1] / 2
        if self.is_long:
            return (Point(x, y), Point(-x, y), Point(-x, -y), Point(x, -y)), 0.0
        step = math.pi / self.sides
        reach = x / math.cos(step)
        corners = ((2 * k + 1) * step for k in range(self.sides))
        return tuple(Point(reach * math.cos(a), reach * math.sin(a)) for a in corners), 0.0

    def _most_turns_in_room(self, room: float) -> float:
        return math.floor(room) + (self.sides - 1) / self.sides


@record
class Racetrack(Outline):
    """Straight sides along x and half circles. Turns end at the joints of sides and half circles.

    The innermost track's inner edge is (D - w)/2 - p (N - 1/2) - w/2 from the axis. Here D is the width, w the track
    width, p the pitch and N the number of turns. This distance stays positive.
    """

    @property
    def ends_per_turn(self) -> int | None:
        """Number of allowed end positions per turn, 2: a racetrack ends at the end of a straight side."""
        return 2

    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """Return the centre line of straight sides along x and half circles.

        Turns join because every second half circle is shifted across by half a pitch. The first half circle is
        concentric about the axis. The others are p/2 nearer to the side at which the layer begins, with radii p/2
        smaller. The layer begins at the joint in the quadrant of ``outer_angle`` (rad).
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
            # The end at the start of the second half of a turn returns one pitch nearer to the axis.
            second = -y + (math.copysign(dimensions.pitch, y) if piece % 4 >= 2 else 0.0)
            segments.append(Arc(start, Point(x, second), Point(x, (y + second) / 2)))
            y = second
        return Path(tuple(segments))

    def start(self, angle: float, sense: int, is_mid_side: bool = False) -> float:
        """Return the angle (rad) at which a racetrack begins, at the start of a straight side.

        Angle 0 gives the joint at +x, +y (clockwise: +x, -y), and half a turn gives the opposite joint. A joint's angle
        is the middle of its quadrant.
        """
        return sense * (math.pi * math.floor(sense * angle / math.pi + 0.5 + 1e-9) + math.pi / 4)

    def boundary(self, size: Size, offset: float) -> Path:
        """Return a polygon of straight sides that touch the two half circles from outside.

        It is `offset` (m) outside the outer copper edge. Parallel tracks round a coil are routed along such polygons.
        """
        half, radius, parts = (size[0] - size[1]) / 2, size[1] / 2 + offset, 12
        step = math.pi / parts
        reach = radius / math.cos(step / 2)
        points = [polar(reach, step * (i + 0.5), Point(half, 0.0)) for i in range(parts // 2)]
        points += [polar(reach, math.pi / 2 + step * (i + 0.5), Point(-half, 0.0)) for i in range(parts)]
        points += [polar(reach, -math.pi / 2 + step * (i + 0.5), Point(half, 0.0)) for i in range(parts // 2)]
        east = Point(half + radius, 0.0)
        return Path(tuple(Line(a, b) for a, b in pairwise([east, *points, east])))

    def edge(self, size: Size, radius: float) -> Path:
        """Return the outer copper edge of straight sides and half circles. `radius` has no effect."""
        x, y = size[0] / 2, size[1] / 2
        return rectangle(-x, -y, x, y, min(x, y))

    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """Return the centres of the half circles and their radius (m)."""
        half = (size[0] - size[1]) / 2
        return (Point(half, 0.0), Point(-half, 0.0)), size[1] / 2

    def corner_radius(self, size: Size, required: float) -> float:
        """Return the radius (m) of the half circles at both ends."""
        return 0.5 * min(size)

    INWARD: ClassVar[tuple[float, float]] = (0.25, 0.0)  # by half a pitch in the middle of each turn

    def _most_turns_in_room(self, room: float) -> float:
        return max(0.0, math.floor(2 * (room + 0.5)) / 2)


SHAPES: dict[str, Outline] = {
    outline.name: outline
    for outline in (
        Round("circle", "circular", bounds=("circle",), plate="disc"),
        Polygon("square", "square", 4, bounds=("square",), plate="rectangle"),
        Polygon("rectangle", "rectangular", 4, is_long=True, bounds=("rectangle",), plate="rectangle"),
        Polygon("hexagon", "hexagonal", 6, bounds=("hexagon",)),
        Polygon("octagon", "octagonal", 8, bounds=("octagon",)),
        Racetrack("racetrack", "racetrack", is_long=True, bounds=("racetrack",)),
    )
}
"""All outlines by the name in a spec. A new outline is a new row."""

PLATES: dict[str, Outline] = {name: SHAPES[name] for name in ("square", "circle", "rectangle")}
"""Outlines of plates: target, elastomer and finger."""

LONG_PLATE = next(name for name, outline in PLATES.items() if outline.is_long)
"""Name of the plate outline whose sides along x and y may differ."""
