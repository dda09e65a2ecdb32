"""Paths of leads outside a coil: around the coil, and then along the jaw past the other coils into the tail.

The lead ring is the closed path around a coil, next to its outermost turn, along which leads can run. Short tracks of
the outer vias also use it. A pair is the two leads of a coil. A lane is the straight path of a pair, parallel to the
tail's axis. The pair of the coil next to the tail runs straight to the tail. The other pairs pass this coil alternately
above and below. Coils nearer to the tail use the inner lanes, so that pairs never cross. A pair runs on two copper
layers, or side by side if the tail has only one layer.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise
from typing import Any

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import TWO_PI, Arc, Line, Path, Point, Segment, bounding_box, polar
from sitscad.layout.clearance import Breadth
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.sensor import ArtworkSpec


@record
class Ring:
    """The closed curve around a coil at the distance `offset` (m) from its copper, for example its lead ring.

    A point of the curve is given by its angle (rad) about the coil's centre. `usual` is the coil of the array. It is
    replaced by the coil in the placement if the placement has one.
    """

    usual: CoilSpec
    placement: CoilPlacement
    offset: float

    @cached_property
    def coil(self) -> CoilSpec:
        """The coil inside the curve."""
        return self.placement.own or self.usual

    @cached_property
    def centre(self) -> Point:
        """Centre of the coil."""
        return Point(*self.placement.centre)

    @cached_property
    def boundary(self) -> Path:
        """The curve, for a coil at the origin without rotation."""
        return self.coil.outline.boundary(self.coil.size, self.offset)

    @cached_property
    def half_size(self) -> tuple[float, float]:
        """Largest distances (m) of the curve from the coil's centre, along x and along y.

        If the curve is not symmetric (a triangle), the larger side counts.
        """
        if self.coil.outline.is_round:
            radius = 0.5 * self.coil.size[0] + self.offset
            return radius, radius
        box = bounding_box([self.boundary.rotated(self.placement.rotation)])
        return max(box[2], -box[0]), max(box[3], -box[1])

    @cached_property
    def _known(self) -> dict[float | Point, Any]:
        return {}

    def at(self, angle: float) -> Point:
        """Return the curve's point in the direction `angle` (rad) from the coil's centre. Results are cached."""
        if angle not in self._known:
            if self.coil.outline.is_round:
                distance = self.coil.size[0] / 2 + self.offset
            else:
                local = angle - self.placement.rotation
                ux, uy = math.cos(local), math.sin(local)
                distance = max(_ray_length(segment, ux, uy) for segment in self.boundary)
            self._known[angle] = polar(distance, angle, self.centre)
        return self._known[angle]

    def facing(self, point: Point) -> tuple[float, float]:
        """Return the directions (rad) from the coil's centre to the curve's points nearest to `point`.

        Results are cached. The first direction is clockwise of the second. They differ only if the point is on the
        diagonal of a corner, so that two points of the curve are equally near.
        """
        if point not in self._known:
            centre, turn = self.centre, self.placement.rotation
            direction = math.atan2(point.y - centre.y, point.x - centre.x)
            sides = [0.0]
            if not self.coil.outline.is_round:
                local = polar(point.distance(centre), direction - turn, Point(0.0, 0.0))
                feet = [Line(side.start, side.end).nearest(local) for side in self.boundary]
                least = min(foot.distance(local) for foot in feet)
                near = [foot for foot in feet if foot.distance(local) < least + 1e-9]
                sides = [math.remainder(math.atan2(foot.y, foot.x) + turn - direction, TWO_PI) for foot in near]
            self._known[point] = direction + min(sides), direction + max(sides)
        return self._known[point]

    def is_outside(self, line: Line) -> bool:
        """Whether a straight line does not enter the closed curve. It may touch the curve."""
        if self.coil.outline.is_round:
            return line.distance(self.centre) >= self.coil.size[0] / 2 + self.offset - 1e-9
        for side in self.boundary.rotated(self.placement.rotation).shifted(*self.centre):
            x, y = side.end - side.start
            if all((end.x - side.start.x) * y - (end.y - side.start.y) * x >= -1e-9 * side.length
                   for end in (line.start, line.end)):
                return True
        return False

    def along(self, start: float, end: float, ccw: bool) -> Path:
        """Return the path along the curve from angle `start` to angle `end` (rad), clockwise unless `ccw` is True."""
        sweep = (end - start) % TWO_PI if ccw else -((start - end) % TWO_PI)
        if abs(sweep) < 1e-9 or TWO_PI - abs(sweep) < 1e-9:
            return Path(())
        if self.coil.outline.is_round:
            return Path((Arc(self.at(start), self.at(end), self.centre, ccw),))
        passed = []  # corners by how far along the sweep they are
        for corner in (segment.end for segment in self.boundary.segments[:-1]):
            angle = math.atan2(corner.y, corner.x) + self.placement.rotation
            progress = (angle - start) % TWO_PI if sweep > 0 else (start - angle) % TWO_PI
            if 1e-9 < progress < abs(sweep) - 1e-9:
                passed.append((progress, polar(math.hypot(corner.x, corner.y), angle, self.centre)))
        points = [self.at(start), *(point for _, point in sorted(passed)), self.at(end)]
        return Path(tuple(Line(a, b) for a, b in pairwise(points) if a.distance(b) > 1e-9))


def _ray_length(segment: Segment, ux: float, uy: float) -> float:
    """Return the distance (m) from the origin at which a ray with the unit vector (ux, uy) meets a straight side.

    0 if the ray does not meet the side.
    """
    dx, dy = segment.end.x - segment.start.x, segment.end.y - segment.start.y
    determinant = ux * dy - uy * dx
    if abs(determinant) < 1e-18:
        return 0.0
    reach = (segment.start.x * dy - segment.start.y * dx) / determinant
    t = (segment.start.x * uy - segment.start.y * ux) / determinant
    return reach if reach > 0 and -1e-9 <= t <= 1 + 1e-9 else 0.0


STAGGER = math.sqrt(2.0) - 1.0
"""Distance along the tail between the 45 degree bends of two parallel tracks, divided by the tracks' centre distance.

With this ratio, the tracks have equal distances before, between and after their bends.
"""

PAIR_EXIT_ANGLES = (-15, 15, -30, 30, 45)
"""Angles (degrees) from the ring's corner at which a pair of leads may leave the ring, in the order of trial.

Positive angles are away from the tail. These angles are tried if the pair cannot leave at the corner itself.
"""


@record
class Exit:
    """Start of one lead, on copper layer `layer`.

    The lead first follows the lead ring around the coil. At `angle` (rad, about the coil's centre) it leaves the ring.
    `way` lists the corner points from there to the taper in front of the tail.
    """

    angle: float
    way: tuple[Point, ...]
    layer: int


BENT_BACK = math.sin(math.radians(22.5))
"""Sine of the largest angle by which a lead may turn beyond a right angle: 22.5 degrees.

It limits turns of leads under the coil's turns and at the place where leads leave the lead ring.
"""


def straightness(before: Point, corner: Point, after: Point) -> float:
    """Return the cosine of the change of direction of a path at a corner. 1 means straight on, -1 straight back."""
    ahead, onward = (corner.x - before.x, corner.y - before.y), (after.x - corner.x, after.y - corner.y)
    return (ahead[0] * onward[0] + ahead[1] * onward[1]) / max(math.hypot(*ahead) * math.hypot(*onward), 1e-30)


@record
class Bus:
    """Dimensions common to all leads.

    `width` (m) is the width of the tracks, and `spacing` (m) the gap between them. `layers` are the copper layers of
    the two leads of a pair. `coils` is the y range of the coils' copper. Between the coils and the innermost lane lie
    the lead ring and an additional distance `base` (m), which leaves room for tracks or vias.
    """

    width: float
    spacing: float
    layers: tuple[int, int]
    coils: Breadth
    base: float = 0.0

    @property
    def reach(self) -> float:
        """Largest distance (m) of the coils' copper from the tail's axis."""
        return self.coils.farthest

    @property
    def ring_offset(self) -> float:
        """Distance (m) from a coil's copper edge to the centre line of the lead ring."""
        return self.spacing + self.width / 2

    @property
    def pitch(self) -> float:
        """Centre distance (m) of neighbouring leads."""
        return self.width + self.spacing

    @property
    def is_stacked(self) -> bool:
        """Whether the two leads of a pair lie above each other on two layers."""
        return self.layers[0] != self.layers[1]


@record
class Lane:
    """Straight path of one coil's pair of leads past the other coils and into the tail.

    `side` is +1 above the coils, -1 below, and 0 for the coil next to the tail. `index` counts the lanes of one side
    outwards from the coils. `rank` is the position of the pair in the tail, counted from the top.
    """

    placement: CoilPlacement
    side: int
    index: int
    rank: int


WIDEST_GAP = 8 * 25.4e-6
"""Largest gap (m) between leads that is tried: 8 mil.

No fabricator's profile requires a larger gap between turns in 35 um copper. Sources: hkgalaxy, jselectronic, ship.ie.
"""


def lead_spacings(trace_spacing: float, least: float) -> tuple[float, ...]:
    """Return gaps (m) to try between leads, vias and turns, the largest first.

    The largest is the gap between turns, at most `WIDEST_GAP`. Half and a quarter of its excess over the fabricator's
    minimum `least` follow, then the minimum.
    """
    widest = min(trace_spacing, WIDEST_GAP)
    fractions = (1.0, 0.5, 0.25, 0.0) if widest > least + 1e-9 else (0.0,)
    return tuple(least + fraction * (widest - least) for fraction in fractions)


def bus_for(artwork: ArtworkSpec, spacing: float | None = None) -> Bus:
    """Return the dimensions of leads with the coils' track width and a gap `spacing` (m), on the two top layers.

    If the tail has only one layer, both leads are on this layer. A `spacing` of None means the fabricator's minimum.
    """
    second = min(artwork.fpc.tail_copper, 2)
    breadth = coils_breadth(artwork.array.placements, artwork.coil)
    return Bus(artwork.coil.trace_width, spacing or artwork.fpc.rules.trace_spacing, (1, second), breadth)


def coils_breadth(placements: tuple[CoilPlacement, ...], coil: CoilSpec) -> Breadth:
    """Return the extent (m) of the coils' copper across the jaw, relative to the tail's axis."""
    halves = [(p.centre[1], Ring(coil, p, 0.0).half_size[1]) for p in placements]
    return Breadth(min(y - half for y, half in halves), max(y + half for y, half in halves))


def assign_lanes(placements: tuple[CoilPlacement, ...], first_side: int) -> tuple[Lane, ...]:
    """Return a lane for each coil, in the order of the placements.

    The leads of the coil next to the tail pass no other coil, so their lane has side 0. The next coil uses the inner
    lane on `first_side` (+1 above, -1 below). Further coils use the two sides alternately, and lanes farther out.
    """
    near_first = sorted(range(len(placements)), key=lambda i: -placements[i].centre[0])
    lane_of = {near_first[0]: (0, 0)}
    for distance, coil in enumerate(near_first[1:]):
        lane_of[coil] = (-first_side if distance % 2 else first_side, distance // 2)
    from_top = sorted(lane_of, key=lambda coil: -lane_of[coil][0] * (1 + lane_of[coil][1]))
    return tuple(Lane(placement, *lane_of[i], rank=from_top.index(i)) for i, placement in enumerate(placements))


def rows_of_lanes(placements: tuple[CoilPlacement, ...]) -> list[tuple[Lane, ...]]:
    """Return the lanes of coils in several rows: one tuple for each possible order of the pairs in the tail.

    The orders are listed in the order of trial. If the y positions of all coils differ, two orders come first. They are
    the order in which the coils appear from the tail, and the order for coils in line. In the next orders, the leads of
    a row's far coils pass outside the row's near coils, or between the rows. In the last orders, the leads of a middle
    row pass all others on one side.
    """
    middle = sum(p.centre[1] for p in placements) / len(placements)
    far_first = sorted(placements, key=lambda p: (-round(p.centre[1], 7), p.centre[0]))
    near_first = sorted(placements, key=lambda p: (-round(p.centre[1], 7), -p.centre[0]))
    row = [p for p in far_first if abs(p.centre[1] - middle) <= 1e-7]
    between = row[-3::-2][::-1] + row[-1:] + row[-2::-2]
    above, below = (
        [[p for p in order if side * (p.centre[1] - middle) > 1e-7] for order in (far_first, near_first)]
        for side in (1, -1)
    )
    orders = [above[i] + between + below[j] for i, j in ((0, 1), (1, 0), (0, 0), (1, 1))]
    orders += [between + above[0] + below[1], above[0] + below[1] + between]
    ranks = [tuple(order.index(p) for p in placements) for order in orders]
    if len({round(p.centre[1], 7) for p in placements}) == len(placements) > 1:
        in_line = (tuple(lane.rank for lane in assign_lanes(placements, side)) for side in (1, -1))
        size = max(math.dist(p.centre, q.centre) for p in placements for q in placements)
        eye = max(p.centre[0] for p in placements) + 0.5 * size
        from_top = sorted(placements, key=lambda p: round(-p.centre[1] / (eye - p.centre[0]), 9))
        ranks = [tuple(from_top.index(p) for p in placements), *in_line, *ranks]
    unlike = dict.fromkeys(ranks)
    return [tuple(map(Lane, placements, [0] * len(order), [0] * len(order), order)) for order in unlike]


def lane_height(bus: Bus, index: int, track: int = 0) -> float:
    """Return the distance (m) from the tail's axis to a track of a lane.

    `index` counts lanes outwards from the coils. If the leads of a pair lie side by side, `track` is 0 for the inner
    and 1 for the outer lead.
    """
    tracks = index if bus.is_stacked else 2 * index + track
    return bus.reach + bus.ring_offset + bus.base + tracks * bus.pitch


def exits(coil: CoilSpec, bus: Bus, lane: Lane, funnel_x: float, turned: bool = False) -> list[tuple[Exit, Exit]]:
    """Return candidate beginnings of the leads A and B of a coil, in the order of trial.

    Leads with a lane beside the coils leave the lead ring at its corner. If `turned` is True, leads that lie above each
    other leave it at the angles `PAIR_EXIT_ANGLES` from the corner instead. This serves windings that end at the
    corner. Leads that lie side by side ignore `turned`. The paths end at x = `funnel_x` (m), at the taper in front of
    the tail.
    """
    ring = Ring(coil, lane.placement, bus.ring_offset)
    coil = ring.coil
    corner = math.atan2(ring.half_size[1], ring.half_size[0])
    upper, lower = bus.layers

    def passing(angle: float, track: int = 0) -> tuple[Point, ...]:
        """Return the path from the ring at 45 degrees towards the tail up to the lane, and along the lane."""
        start, height = ring.at(angle), lane.side * lane_height(bus, lane.index, track)
        return Point(start.x + abs(height - start.y), height), Point(funnel_x, height)

    if bus.is_stacked:
        paths = _forwards(coil, ring, funnel_x) if not lane.side else []
        for degrees in (PAIR_EXIT_ANGLES if turned else (0,)) if lane.side else ():
            angle = lane.side * (corner + math.radians(degrees))
            paths.append((angle, passing(angle)))
        return [(Exit(angle, path, upper), Exit(angle, path, lower)) for angle, path in paths]

    # side by side the track that leaves the ring farther back takes the outer lane; either end of the coil may
    apart = 2.0 * bus.pitch / min(ring.half_size)
    pairs = []
    if lane.side:
        outer, inner = lane.side * corner, lane.side * corner - lane.side * apart
        pairs.append((Exit(outer, passing(outer, 1), upper), Exit(inner, passing(inner), upper)))
    else:
        for middle in map(math.radians, (0, 25, -25)):
            first, second = middle + apart / 2, middle - apart / 2
            lanes = (Exit(angle, (Point(funnel_x, ring.at(angle).y),), upper) for angle in (first, second))
            pairs.append((next(lanes), next(lanes)))
    return [path for first, second in pairs for path in ((first, second), (second, first))]


def _forwards(coil: CoilSpec, ring: Ring, funnel_x: float) -> list[tuple[float, tuple[Point, ...]]]:
    """Return candidate beginnings of leads for the coil next to the tail, as (angle, corner points).

    The lead leaves the lead ring around the coil at the angle (rad). The corner points lead from there to the taper in
    front of the tail, at x = `funnel_x` (m).
    """
    paths: list[tuple[float, tuple[Point, ...]]] = []
    length, breadth = ring.half_size
    for turn in map(math.radians, (0, 20, -20, 40, -40)):
        # about the middle of the end that faces the tail, which is the centre unless the coil is long
        angle = math.atan2(breadth * math.sin(turn), max(0.0, length - breadth) + breadth * math.cos(turn))
        place = ring.at(angle)
        is_flat = coil.outline.sides and coil.outline.is_long
        height = place.y if is_flat else ring.centre.y + min(ring.half_size) * math.tan(turn)
        edge, end = Point(ring.centre.x + length, height), Point(funnel_x, height)
        paths.append((angle, (edge, end) if edge.distance(place) > 1e-9 else (end,)))
    return paths
