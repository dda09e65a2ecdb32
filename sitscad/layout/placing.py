"""Where the straight board comes to lie: its tail's turn in its own plane, and the height of the tail's axis.

The board is laid out straight with the tail's axis at y = 0, which is the height of the mean of the coils' centres: so
it does not depend on where the coils' places are counted from. Within a turn only tracks and edges along the tail run,
and they become concentric arcs: tracks keep their widths and their distances from each other and from the edge. What
lies beyond is moved rigidly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

from sitscad.geometry.path import Arc, Line, Path, Point, Region, Segment
from sitscad.layout.board import Layout, Pad, Trace, Via
from sitscad.record import record
from sitscad.spec.circuit import Tail
from sitscad.spec.sensor import SensorSpec

_SAME = 1e-12
ASKEW = "within a tail's turn everything has to run along the tail"


@record
class Stretch:
    """A part of a tail's middle line from `begin` on (m along the straight tail). It starts at `origin` with a heading
    (rad from +x); ``radius`` (m) is positive for an arc to the left, negative for one to the right, None for a straight
    part.
    """

    begin: float
    origin: Point
    heading: float
    radius: float | None = None

    @cached_property
    def centre(self) -> Point:
        """The centre of an arc."""
        assert self.radius is not None
        return _beside(self.origin, self.heading, self.radius)

    def place(self, point: Point) -> Point:
        """Where a point of the straight tail comes to lie."""
        along = point.x - self.begin
        if self.radius is None:
            cosine, sine = round(math.cos(self.heading), 15), round(math.sin(self.heading), 15)  # exact along an axis
            return _beside(self.origin.shifted(along * cosine, along * sine), self.heading, point.y)
        return _beside(self.centre, self.heading + along / self.radius, point.y - self.radius)


def _beside(point: Point, heading: float, left: float) -> Point:
    """A point so far (m) to the left of another, seen along a heading: exact where that is along an axis."""
    return point.shifted(-left * round(math.sin(heading), 15), left * round(math.cos(heading), 15))


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
        """A segment's pieces after the turn, one a stretch of the tail.

        Raises ValueError for one that does not run along the tail within the turn.
        """
        low, _, high, _ = segment.box
        cuts = [s.begin for s in self.stretches if low + _SAME < s.begin < high - _SAME]
        if isinstance(segment, Arc) or not cuts:
            yield _moved(segment, self._at((low + high) / 2))
            return
        if abs(segment.end.y - segment.start.y) > 1e-9:
            raise ValueError(ASKEW)
        ends = [low, *cuts, high] if segment.end.x > segment.start.x else [high, *reversed(cuts), low]
        for a, b in pairwise(ends):
            yield _moved(Line(Point(a, segment.start.y), Point(b, segment.start.y)), self._at((a + b) / 2))


def _moved(segment: Segment, stretch: Stretch) -> Segment:
    """A segment that lies in one stretch, after the turn."""
    start, end = stretch.place(segment.start), stretch.place(segment.end)
    if isinstance(segment, Arc):
        if stretch.radius is not None:
            raise ValueError(ASKEW)
        return Arc(start, end, stretch.place(segment.centre), segment.ccw)
    if stretch.radius is None or start.distance(end) < _SAME:
        return Line(start, end)
    if abs(segment.end.y - segment.start.y) > 1e-9:
        raise ValueError(ASKEW)
    return Arc(start, end, stretch.centre, ccw=(stretch.radius > 0.0) == (segment.end.x > segment.start.x))


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
    return _mapped(layout, way.path, way.place, way.is_across)


def _mapped(
    layout: Layout, path: Callable[[Path], Path], place: Callable[[Point], Point], is_across: bool = False
) -> Layout:
    """All that is drawn but the windings, moved; `is_across` where contacts that move are turned by a right angle."""

    def piece(item: Trace | Via) -> Trace | Via:
        if isinstance(item, Trace):
            return replace(item, path=path(item.path))
        return replace(item, centre=place(item.centre))

    def pad(one: Pad) -> Pad:
        centre, (x, y) = place(one.centre), one.size
        return replace(one, centre=centre, size=(y, x) if is_across and centre != one.centre else one.size)

    def region(one: Region) -> Region:
        return Region(path(one.outline), tuple(map(path, one.holes)))

    coils = tuple(replace(coil, series=tuple(map(piece, coil.series))) for coil in layout.coils)
    pieces, plate = [item for coil in coils for item in coil.series], layout.stiffener
    return replace(
        layout, coils=coils, traces=tuple(item for item in pieces if isinstance(item, Trace)),
        vias=tuple(item for item in pieces if isinstance(item, Via)), pads=tuple(map(pad, layout.pads)),
        capacitors=tuple(replace(c, pads=(pad(c.pads[0]), pad(c.pads[1]))) for c in layout.capacitors),
        outline=path(layout.outline), top_openings=tuple(map(region, layout.top_openings)),
        bottom_openings=tuple(map(region, layout.bottom_openings)),
        stiffener=replace(plate, outline=region(plate.outline)) if plate else None,
    )


def about_axis(spec: SensorSpec) -> SensorSpec:
    """The spec with its coils counted from the tail's axis."""
    height = _axis_height(spec)
    if not height:
        return spec
    placements = tuple(replace(p, centre=(p.centre[0], p.centre[1] - height)) for p in spec.array.placements)
    return replace(spec, array=replace(spec.array, placements=placements))


def _axis_height(spec: SensorSpec) -> float:
    height = spec.array.middle[1]
    return height if abs(height) > 1e-9 else 0.0  # less is what rounding leaves of a sum


def placed(layout: Layout, spec: SensorSpec) -> Layout:
    """A layout of `about_axis(spec)`, moved to where the spec has its coils."""
    height = _axis_height(spec)
    if not height:
        return layout
    stands = {placement.name: placement for placement in spec.array.placements}
    coils = tuple(
        replace(
            coil,
            placement=stands[coil.name],
            windings=tuple(replace(w, path=w.path.shifted(0.0, height)) for w in coil.windings),
        )
        for coil in layout.coils
    )
    x0, y0, x1, y1 = layout.body
    level = replace(layout, spec=spec, coils=coils, body=(x0, y0 + height, x1, y1 + height))
    return _mapped(level, lambda path: path.shifted(0.0, height), lambda point: point.shifted(0.0, height))
