"""How a tail may be bent: how sharply, and where in its bend zone: all tracks straight at one width.

Where it is bent says `sitscad.scene.tail_path`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import accumulate

from sitscad.geometry.path import Arc, Segment
from sitscad.layout.board import Layout
from sitscad.layout.thickness import tail_thickness
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec

STRAIGHT = math.radians(10.0)
"""Tracks may cross the bend zone at this angle (rad) to the tail's length."""

_ROUNDING = 1e-9
_SAME_PLACE = 1e-8


@record
class Unfit:
    """A stretch of x (m) in the bend zone where one track runs askew or changes its width, and a place (m) on it."""

    first: float
    last: float
    y: float
    layer: int
    net: str


@record
class Stretch:
    """From one x to another (m); not above zero long where there is none."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """How long it is (m)."""
        return self.end - self.start


def bend_stretch(layout: Layout) -> tuple[float, float] | None:
    """Between which x (m) the tail may be bent; None where it has no bend, or nothing straight to bend."""
    if layout.bend_zone is None:
        return None
    longest = longest_straight(layout.bend_zone, unfit_for_bending(layout))
    return (longest.start, longest.end) if longest.length > _ROUNDING else None


@record
class Bend:
    """A bend about the line x = `line` (m) across the tail by an angle (rad), ``down`` (away from the coils) or ``up``.

    It takes the board from `start` to `end` (m), only its line where no radius is known; `radius` (m) is inside. `why`
    says what makes it where that is the mount.
    """

    line: float
    start: float
    end: float
    angle: float
    direction: str
    radius: float | None
    is_dynamic: bool
    why: str = ""


def bend_figure(spec: SensorSpec) -> tuple[str, float] | None:
    """Which figure of the fabricator's is the tail's smallest bend radius, and that radius by its thickness."""
    tail, rules = spec.fpc.tail, spec.fpc.rules
    if tail is None or tail.bend == "none":
        return None
    ratios = rules.dynamic_bend_ratio if tail.bend == "dynamic" else rules.static_bend_ratio
    if not ratios:
        return None
    layers = tail.layers if tail.layers in ratios else max(ratios)
    return f"{tail.bend}_bend_{layers}", ratios[layers]


def least_bend_radius(spec: SensorSpec) -> float | None:
    """Smallest inside radius (m) that the tail may be bent to by the fabricator's rules; None where they state none."""
    figure = bend_figure(spec)
    return None if figure is None else figure[1] * tail_thickness(spec)


def bend_radius(spec: SensorSpec) -> float | None:
    """The inside radius (m) of the bend: the spec's, or the fabricator's least; None where neither is stated."""
    tail = spec.fpc.tail
    stated = tail.bend_radius if tail is not None else None
    return least_bend_radius(spec) if stated is None else stated


def bend_length(spec: SensorSpec) -> float:
    """The length (m) of tail that its bend takes, along the middle of its thickness; 0 where no radius is known."""
    tail, radius = spec.fpc.tail, bend_radius(spec)
    return 0.0 if tail is None or radius is None else tail.bend_angle * (radius + tail_thickness(spec) / 2)


def longest_straight(zone: tuple[float, float], unfit: list[Unfit]) -> Stretch:
    """The longest stretch of a zone (m) that is free of all that is unfit."""
    unfit = sorted(unfit, key=lambda each: (each.first, each.last))
    starts = accumulate([zone[0], *(each.last for each in unfit)], max)
    ends = [*(each.first for each in unfit), zone[1]]
    pairs = zip(starts, ends, strict=True)
    return max((Stretch(start, end) for start, end in pairs), key=lambda each: (each.length, each.start))


def unfit_for_bending(layout: Layout) -> list[Unfit]:
    """All in the bend zone that is unfit for bending, from the body on."""
    zone = layout.bend_zone
    if zone is None:
        return []
    found = [*_askew(layout, zone), *_steps(layout, zone)]
    return sorted(found, key=lambda each: (each.first, each.last))


def _askew(layout: Layout, zone: tuple[float, float]) -> Iterator[Unfit]:
    """Places inside the zone (x from and to, m) where a track does not run straight along the tail."""
    middle, half = (zone[0] + zone[1]) / 2.0, (zone[1] - zone[0]) / 2.0
    for trace in layout.traces:
        for segment in trace.path:
            if isinstance(segment, Arc) and abs(segment.centre.x - middle) > half + segment.radius:
                continue  # a coil's, as most are: far from the tail, and its box takes time
            x0, y0, x1, _ = segment.box
            if x0 < zone[1] - _ROUNDING and x1 > zone[0] + _ROUNDING and _angle(segment) > STRAIGHT:
                yield Unfit(max(zone[0], x0), min(zone[1], x1), y0, trace.layer, trace.net)


def _steps(layout: Layout, zone: tuple[float, float]) -> Iterator[Unfit]:
    """Places inside the zone (x from and to, m) where a track's width changes."""
    widths: dict[tuple[int, int, int], float] = {}
    for trace in layout.traces:
        for end in (trace.path.start, trace.path.end):
            key = trace.layer, round(end.x / _SAME_PLACE), round(end.y / _SAME_PLACE)
            if zone[0] < end.x < zone[1] and abs(widths.setdefault(key, trace.width) - trace.width) > _ROUNDING:
                yield Unfit(end.x, end.x, end.y, trace.layer, trace.net)


def _angle(segment: Segment) -> float:
    """The largest angle (rad, at most a right one) at its ends between a segment and the tail's length."""
    (ax, ay), (bx, by) = segment.start, segment.end
    if isinstance(segment, Arc):
        centre = segment.centre
        directions = [(centre.y - p.y, p.x - centre.x) for p in (segment.start, segment.end)]
    else:
        directions = [(bx - ax, by - ay)]
    return max(math.atan2(abs(dy), abs(dx)) for dx, dy in directions)
