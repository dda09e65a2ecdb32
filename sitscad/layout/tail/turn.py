"""The tail's turn in its own plane: a straight tail laid along arcs, so that its end lies to the side.

The board is laid out straight. Within the turn only tracks and edges along the tail run, and they become concentric
arcs: tracks keep their widths and their distances from each other and from the edge. What lies beyond is moved rigidly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

from sitscad.geometry.path import Arc, Line, Path, Point, Segment
from sitscad.geometry.region import Region
from sitscad.layout.board import Layout
from sitscad.layout.pieces import Pad, Trace, Via
from sitscad.record import record
from sitscad.spec.circuit import Tail

_SAME = 1e-12


@record
class Stretch:
    """A part of a tail's middle line from `begin` on (m along the straight tail).

    It starts at `origin` with a heading (rad from +x); ``radius`` (m) is positive for an arc to the left, negative for
    one to the right, None for a straight part.
    """

    begin: float
    origin: Point
    heading: float
    radius: float | None = None

    @cached_property
    def centre(self) -> Point:
        """The centre of an arc."""
        assert self.radius is not None
        return self._beside(self.origin, self.heading, self.radius)

    def place(self, point: Point) -> Point:
        """Where a point of the straight tail comes to lie."""
        along = point.x - self.begin
        if self.radius is None:
            cosine, sine = _direction(self.heading)
            ahead = self.origin.shifted(along * cosine, along * sine)
            return self._beside(ahead, self.heading, point.y)
        return self._beside(self.centre, self.heading + along / self.radius, point.y - self.radius)

    def _beside(self, point: Point, heading: float, left: float) -> Point:
        cosine, sine = _direction(heading)
        return point.shifted(-left * sine, left * cosine)


@record
class Course:
    """The stretches of a tail's middle line, one after the other; before the first one the board is as it was."""

    stretches: tuple[Stretch, ...]

    def place(self, point: Point) -> Point:
        """Where a point of the straight board comes to lie."""
        return self._at(point.x).place(point)

    def path(self, path: Path) -> Path:
        """A path of the straight board, laid along the course."""
        return Path(tuple(part for segment in path for part in self._segments(segment)))

    @property
    def is_across(self) -> bool:
        """Whether the tail ends across the direction in which it began."""
        return abs(math.sin(self.stretches[-1].heading)) > 0.5

    def _at(self, x: float) -> Stretch:
        return next((s for s in reversed(self.stretches) if x >= s.begin), self.stretches[0])

    def _segments(self, segment: Segment) -> Iterator[Segment]:
        """A segment's pieces after the turn, one a stretch of the tail."""
        low, _, high, _ = segment.box
        cuts = [s.begin for s in self.stretches if low + _SAME < s.begin < high - _SAME]
        if isinstance(segment, Arc) or not cuts:
            yield self._moved(segment, self._at((low + high) / 2))
            return
        if abs(segment.end.y - segment.start.y) > 1e-9:
            raise ValueError("within a tail's turn everything has to run along the tail")
        ends = [low, *cuts, high] if segment.end.x > segment.start.x else [high, *reversed(cuts), low]
        for a, b in pairwise(ends):
            yield self._moved(Line(Point(a, segment.start.y), Point(b, segment.start.y)), self._at((a + b) / 2))

    def _moved(self, segment: Segment, stretch: Stretch) -> Segment:
        """A segment that lies in one stretch, after the turn; ValueError for one that does not run along the tail."""
        start, end = stretch.place(segment.start), stretch.place(segment.end)
        if isinstance(segment, Arc):
            if stretch.radius is not None:
                raise ValueError("within a tail's turn everything has to run along the tail")
            return Arc(start, end, stretch.place(segment.centre), segment.ccw)
        if stretch.radius is None or start.distance(end) < _SAME:
            return Line(start, end)
        if abs(segment.end.y - segment.start.y) > 1e-9:
            raise ValueError("within a tail's turn everything has to run along the tail")
        forwards = segment.end.x > segment.start.x
        return Arc(start, end, stretch.centre, ccw=(stretch.radius > 0.0) == forwards)


def _direction(heading: float) -> tuple[float, float]:
    """Cosine and sine, exact where the heading is along an axis."""
    return round(math.cos(heading), 15), round(math.sin(heading), 15)


def turn_length(tail: Tail | None, half_width: float) -> float:
    """How much (m) of a tail of some half width its turn takes along the middle line; 0 for a straight one."""
    return math.fsum(abs(length) for length, _ in _plan(tail, half_width))


def course(tail: Tail | None, half_width: float, begin: float) -> Course | None:
    """The course of a tail whose turn begins at `begin` (m); None for a straight one."""
    plan = _plan(tail, half_width)
    if not plan:
        return None
    here = Stretch(-math.inf, Point(0.0, 0.0), 0.0)
    at, origin, heading = begin, Point(begin, 0.0), 0.0
    stretches = [replace(here, begin=begin - 1.0, origin=Point(begin - 1.0, 0.0))]
    for length, radius in [*plan, (0.0, None)]:
        stretches.append(Stretch(at, origin, heading, radius))
        at += length
        origin = stretches[-1].place(Point(at, 0.0))
        heading += length / radius if radius is not None else 0.0
    return Course(tuple(stretches))


def _plan(tail: Tail | None, half_width: float) -> list[tuple[float, float | None]]:
    """Lengths of the turn's parts (m), and their radii of the middle line: positive to the left, None for straight."""
    if tail is None:
        return []
    radius = tail.turn_radius + half_width
    if tail.turn != "none":
        side = 1.0 if tail.turn == "left" else -1.0
        return [(0.5 * math.pi * radius, side * radius)]
    if not tail.offset:
        return []
    side, far = math.copysign(1.0, tail.offset), abs(tail.offset)
    angle = math.acos(max(0.0, 1.0 - far / (2.0 * radius)))
    straight = far - 2.0 * radius
    middle: list[tuple[float, float | None]] = [(straight, None)] if straight > _SAME else []
    return [(angle * radius, side * radius), *middle, (angle * radius, -side * radius)]


def turned(layout: Layout, way: Course) -> Layout:
    """A layout with its tail laid along a course."""

    def piece(item: Trace | Via) -> Trace | Via:
        if isinstance(item, Trace):
            return replace(item, path=way.path(item.path))
        return replace(item, centre=way.place(item.centre))

    coils = tuple(replace(coil, series=tuple(piece(item) for item in coil.series)) for coil in layout.coils)
    pieces = [item for coil in coils for item in coil.series]
    plate = layout.stiffener
    return replace(
        layout,
        coils=coils,
        traces=tuple(item for item in pieces if isinstance(item, Trace)),
        vias=tuple(item for item in pieces if isinstance(item, Via)),
        pads=tuple(_pad(pad, way) for pad in layout.pads),
        capacitors=tuple(
            replace(each, pads=(_pad(each.pads[0], way), _pad(each.pads[1], way))) for each in layout.capacitors
        ),
        outline=way.path(layout.outline),
        top_openings=_regions(layout.top_openings, way.path),
        bottom_openings=_regions(layout.bottom_openings, way.path),
        stiffener=replace(plate, outline=_regions((plate.outline,), way.path)[0]) if plate else None,
    )


def _regions(regions: tuple[Region, ...], move: Callable[[Path], Path]) -> tuple[Region, ...]:
    return tuple(Region(move(region.outline), tuple(move(hole) for hole in region.holes)) for region in regions)


def _pad(pad: Pad, way: Course) -> Pad:
    size = pad.size[::-1] if way.is_across and way.place(pad.centre) != pad.centre else pad.size
    return replace(pad, centre=way.place(pad.centre), size=(size[0], size[1]))
