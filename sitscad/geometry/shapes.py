"""The outlines that a coil may have: a row of `SHAPES` each, and a class for each way to wind.

What the other rooms ask of an outline (how a layer runs, where turns may end, what lies round it, how bounds and closed
forms go by it) is here, by features and never by name: a further polygon is one row, another curve one class and one
row. Lengths are metres, angles radians; a coil's size is [x, y] across its outer copper edges.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from itertools import pairwise

from sitscad.geometry import path as curves
from sitscad.geometry.path import TWO_PI, Arc, Line, Path, Point, Segment, polar, rectangle, rounded
from sitscad.geometry.spiral import SpiralDimensions, archimedean, corner, crossing, racetrack, regular, rounded_corners
from sitscad.record import record
from sitscad.units import in_mm

Size = tuple[float, float]

_SLACK = 1e-9
_ORIGIN = Point(0.0, 0.0)


@record
class Outline(ABC):
    """What all outlines have: a name, the adjective for people, and the features that others go by.

    ``sides`` are the straight sides of a polygon, 0 for the others; ``is_long`` says that x and y may differ.
    """

    name: str
    adjective: str
    sides: int = 0
    is_long: bool = False

    @property
    def is_round(self) -> bool:
        """Whether it is wound as a spiral about its centre, that has no part which is straight."""
        return False

    @property
    def ends(self) -> int | None:
        """Into how many parts a turn may be broken; None where any number of turns is defined."""
        return self.sides or None

    @property
    def across(self) -> str:
        """What a drawing says of how its size is measured; empty where that is plain."""
        return ""

    def size_in_words(self, size: Size) -> str:
        """A size for people, in millimetres without the unit: a diameter, or both sides."""
        return f"diameter {in_mm(size[0])}" if self.is_round else f"{in_mm(size[0])} x {in_mm(size[1])}"

    @property
    def area(self) -> float:
        """Its area over that of the rectangle that its sizes span, corners of any radius not taken off."""
        return 1.0

    @property
    def shrinks(self) -> float:
        """How much shorter a turn gets for each metre that it lies further inside."""
        return TWO_PI

    @abstractmethod
    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """A layer wound counter-clockwise about the origin, from the outside in."""

    def start(self, angle: float, sense: int) -> float:
        """The angle at which a layer asked to begin at `angle` does begin."""
        return angle

    @abstractmethod
    def boundary(self, size: Size, offset: float) -> Path:
        """The closed counter-clockwise curve at `offset` (m) outside the outer copper edge, beginning at +x, y = 0."""

    @abstractmethod
    def edge(self, size: Size, radius: float) -> Path:
        """The closed curve that the outer copper edges lie on, the corners of a polygon rounded by `radius` (m)."""

    @abstractmethod
    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """The convex core of points, and the radius round it (m), that make the outer copper edge."""

    def corner_radius(self, size: Size, asked: float) -> float:
        """Radius (m) of what rounds the outer edge of a polygon of that corner radius, or of what ends another."""
        return asked

    def shifts_inwards(self, turns: float) -> float:
        """How far (pitches) the mean of a turn, or of that share of one, lies inside of where it begins."""
        return 0.0

    def wind(
        self, dimensions: SpiralDimensions, outer_angle: float, sense: int = 1, corner_radius: float = 0.0
    ) -> Path:
        """One layer from its outer end inwards, about the origin, its corners rounded by a radius (m).

        ``outer_angle`` is where the outer end stands (polygons: the last corner at or before it, in the direction of
        winding); ``sense`` is +1 for counter-clockwise, -1 for clockwise.
        """
        path = self.inwards(dimensions, sense * outer_angle)
        path = path if sense > 0 else path.mapped(lambda p: Point(p.x, -p.y), flips=True)
        return rounded_corners(path, corner_radius, self.sides, dimensions.pitch) if self.sides else path

    def nearest_turns(self, turns: float) -> float:
        """The number of turns nearest to `turns` that it allows (at least one part of a turn)."""
        return turns if self.ends is None else max(1, round(turns * self.ends)) / self.ends

    def is_whole(self, turns: float) -> bool:
        """Whether the turns end where it defines an end; one part in 10^6 is taken as rounding (2.166667)."""
        return abs(self.nearest_turns(turns) - turns) <= 1e-6 * max(1.0, turns)

    def most_turns(self, size: Size, trace_width: float, pitch: float) -> float:
        """Largest number of turns whose innermost trace stays clear of the centre; 0 where none does."""
        room = (min(size) / 2 - trace_width) / pitch - _SLACK
        return self._most_in(room) if room > 0 else 0.0

    @abstractmethod
    def _most_in(self, room: float) -> float:
        """The most turns in so many pitches from the outermost track to the centre."""


@record
class Round(Outline):
    """A circle: an Archimedean spiral, that may end anywhere. Its inner edge (D - w)/2 - p N - w/2 stays positive."""

    @property
    def is_round(self) -> bool:
        """It is."""
        return True

    @property
    def ends(self) -> int | None:
        """It may end anywhere."""
        return None

    @property
    def across(self) -> str:
        """Its size is a diameter."""
        return "in diameter "

    @property
    def area(self) -> float:
        """That of a circle over its square."""
        return math.pi / 4.0

    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """An Archimedean spiral, drawn as arcs."""
        return archimedean(dimensions, outer_angle)

    def boundary(self, size: Size, offset: float) -> Path:
        """Four quarters of a circle."""
        radius = size[0] / 2 + offset
        east, north = Point(radius, 0.0), Point(0.0, radius)
        west, south = Point(-radius, 0.0), Point(0.0, -radius)
        quarters = ((east, north), (north, west), (west, south), (south, east))
        return Path(tuple(Arc(a, b, _ORIGIN) for a, b in quarters))

    def edge(self, size: Size, radius: float) -> Path:
        """A circle: it has no corners."""
        return curves.circle(_ORIGIN, size[0] / 2)

    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """Its centre, and its radius."""
        return (_ORIGIN,), size[0] / 2

    def shifts_inwards(self, turns: float) -> float:
        """It comes inwards steadily."""
        return 0.5 * turns

    def _most_in(self, room: float) -> float:
        return room


@record
class Polygon(Outline):
    """A regular polygon, one flat facing +x, or a rectangle: turns end at corners, and step in after each whole turn.

    The flat on which the inner end stands, (D - w)/2 - p floor(N) - w/2 from the centre, stays clear of it.
    """

    @property
    def across(self) -> str:
        """Between flats; of an odd number of sides no two face each other."""
        if self.sides % 2:
            return "twice from the centre to the flats "
        return "across flats " if self.sides > 4 else ""

    @property
    def area(self) -> float:
        """The regular polygon's over that of the square about its inscribed circle."""
        return 1.0 if self.sides == 4 else self.sides * math.tan(math.pi / self.sides) / 4.0

    @property
    def shrinks(self) -> float:
        """Twice the tangent of half a corner's angle for each corner."""
        return 8.0 if self.sides == 4 else 2.0 * self.sides * math.tan(math.pi / self.sides)

    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """Sides at whole pitches from the outermost, a turn each."""
        return regular(self.sides, dimensions, outer_angle)

    def start(self, angle: float, sense: int) -> float:
        """The last corner at or before it, in the direction of winding."""
        return sense * corner(self.sides, sense * angle)

    def boundary(self, size: Size, offset: float) -> Path:
        """The polygon itself, larger."""
        flats = [(i, size[i % 2 if self.sides == 4 else 1] / 2 + offset) for i in range(self.sides + 1)]
        points = [crossing(a, b, TWO_PI / self.sides) for a, b in pairwise(flats)]
        east = Point(size[0] / 2 + offset, 0.0)
        segments: list[Segment] = [Line(a, b) for a, b in pairwise([east, *points, east])]
        return Path(tuple(segments))

    def edge(self, size: Size, radius: float) -> Path:
        """The polygon, its corners rounded."""
        x, y = size[0] / 2, size[1] / 2
        if self.sides == 4:
            return rectangle(-x, -y, x, y, radius)
        step = TWO_PI / self.sides
        reach = x / math.cos(step / 2)
        return rounded([polar(reach, (i + 0.5) * step) for i in range(self.sides)], radius)

    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """Its corners."""
        x, y = size[0] / 2, size[1] / 2
        if self.is_long:
            return (Point(x, y), Point(-x, y), Point(-x, -y), Point(x, -y)), 0.0
        step = math.pi / self.sides
        reach = x / math.cos(step)
        corners = ((2 * k + 1) * step for k in range(self.sides))
        return tuple(Point(reach * math.cos(a), reach * math.sin(a)) for a in corners), 0.0

    def _most_in(self, room: float) -> float:
        return math.floor(room) + (self.sides - 1) / self.sides


@record
class Racetrack(Outline):
    """Straight sides along x and half circles: turns end where one goes over into the other.

    The innermost end, (D - w)/2 - p (N - 1/2) - w/2 from the axis, stays clear of it.
    """

    @property
    def ends(self) -> int | None:
        """It ends where a straight side does."""
        return 2

    def inwards(self, dimensions: SpiralDimensions, outer_angle: float) -> Path:
        """Straight sides and half circles in turn."""
        return racetrack(dimensions, outer_angle)

    def start(self, angle: float, sense: int) -> float:
        """It begins where a straight side does: with angle 0 at +x, +y (clockwise: +x, -y), with half a turn at the
        opposite junction. Its junctions are named by the middle of their quadrant.
        """
        return sense * (math.pi * math.floor(sense * angle / math.pi + 0.5 + 1e-9) + math.pi / 4)

    def boundary(self, size: Size, offset: float, parts: int = 12) -> Path:
        """Straight sides that touch both semicircles from outside: roads around a coil are laid side by side."""
        half, radius = (size[0] - size[1]) / 2, size[1] / 2 + offset
        step = math.pi / parts
        reach = radius / math.cos(step / 2)
        points = [polar(reach, step * (i + 0.5), Point(half, 0.0)) for i in range(parts // 2)]
        points += [polar(reach, math.pi / 2 + step * (i + 0.5), Point(-half, 0.0)) for i in range(parts)]
        points += [polar(reach, -math.pi / 2 + step * (i + 0.5), Point(half, 0.0)) for i in range(parts // 2)]
        east = Point(half + radius, 0.0)
        return Path(tuple(Line(a, b) for a, b in pairwise([east, *points, east])))

    def edge(self, size: Size, radius: float) -> Path:
        """Straight sides and half circles."""
        x, y = size[0] / 2, size[1] / 2
        return rectangle(-x, -y, x, y, min(x, y))

    def core(self, size: Size) -> tuple[tuple[Point, ...], float]:
        """The centres of its ends, and their radius."""
        half = (size[0] - size[1]) / 2
        return (Point(half, 0.0), Point(-half, 0.0)), size[1] / 2

    def corner_radius(self, size: Size, asked: float) -> float:
        """Its ends are half circles."""
        return 0.5 * min(size)

    def shifts_inwards(self, turns: float) -> float:
        """It comes inwards by half a pitch in the middle of each turn."""
        return 0.25

    def _most_in(self, room: float) -> float:
        return max(0.0, math.floor(2 * (room + 0.5)) / 2)


SHAPES: dict[str, Outline] = {
    outline.name: outline
    for outline in (
        Round("circle", "circular"),
        Polygon("square", "square", 4),
        Polygon("rectangle", "rectangular", 4, is_long=True),
        Polygon("hexagon", "hexagonal", 6),
        Polygon("octagon", "octagonal", 8),
        Racetrack("racetrack", "racetrack", is_long=True),
    )
}
"""Every outline by the name that a spec gives it; a new one is a row."""

PLATES: dict[str, Outline] = {name: SHAPES[name] for name in ("square", "circle", "rectangle")}
"""Those of them that plates are cut in: target and elastomer."""

LONG_PLATE = next(name for name, outline in PLATES.items() if outline.is_long)
"""The plate whose two sides may differ."""


def plate_shape(size: Size) -> str:
    """The shape of a plate of which only the size is said: a square where both sides are alike."""
    return "square" if size[0] == size[1] else LONG_PLATE


def nearest_sides(known: Iterable[int], sides: int) -> tuple[int, ...]:
    """The numbers of sides with known figures that a number lies between, fewer first; itself where it is known."""
    of_polygons = sorted(number for number in known if number)
    if not sides or sides in of_polygons:
        return (sides,)
    fewer = [number for number in of_polygons if number < sides][-1:]
    more = [number for number in of_polygons if number > sides][:1]
    return (*fewer, *more)
