"""The lanes along the jaw: which way each coil's pair of conductors runs past the other coils and into the tail.

The coil next to the tail leaves forwards; the others pass it above and below in turn, the nearest on the inner lanes,
so that no pair crosses another. A pair runs stacked on two copper layers, or side by side where the tail has only one.
"""

from __future__ import annotations

import math

from sitscad.geometry.path import Point
from sitscad.layout.clearance import Breadth
from sitscad.layout.routing.ring import Ring
from sitscad.record import record
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.sensor import SensorSpec

STAGGER = math.sqrt(2.0) - 1.0
"""Parallel tracks bend by 45 degrees this many spacings apart, so that they stay equally far from each other."""

TURNED = (-15, 15, -30, 30, 45)
"""Degrees from the corner of the ring, away from the tail, at which a pair may leave it too."""


@record
class Exit:
    """Where one end of a coil leaves its ring (angle, rad), and the corners that it then passes up to the tail."""

    angle: float
    way: tuple[Point, ...]
    layer: int


@record
class Bus:
    """Sizes shared by all lanes (m): trace width and spacing, the layers of the two conductors, and where lanes begin.

    ``coils`` is how far the coils' copper extends across the jaw; lanes stand off from it by the ring road and by
    ``base``, which leaves the coils room for tracks or vias under the lanes.
    """

    width: float
    spacing: float
    layers: tuple[int, int]
    coils: Breadth
    base: float = 0.0

    @property
    def reach(self) -> float:
        """The farthest from the axis that a coil's copper extends."""
        return self.coils.farthest

    @property
    def ring_offset(self) -> float:
        """From a coil's copper edge to the centre line of the ring road."""
        return self.spacing + self.width / 2

    @property
    def pitch(self) -> float:
        """Distance of neighbouring tracks."""
        return self.width + self.spacing

    @property
    def is_stacked(self) -> bool:
        """Whether the two conductors of a pair lie above each other."""
        return self.layers[0] != self.layers[1]


@record
class Lane:
    """One coil's lane.

    ``side`` is +1 above, -1 below, 0 forwards; ``index`` counts outwards; ``rank`` counts from the top in the tail.
    """

    placement: CoilPlacement
    side: int
    index: int
    rank: int


def bus_for(spec: SensorSpec) -> Bus:
    """The coil's own trace width, the fabricator's spacing, and the two top layers if the tail has two."""
    tail_layers = spec.fpc.tail.layers if spec.fpc.tail else 2
    second = 2 if min(tail_layers, len(spec.fpc.stackup.copper)) >= 2 else 1
    return Bus(spec.coil.trace_width, spec.fpc.rules.trace_spacing, (1, second), coils_breadth(spec))


def coils_breadth(spec: SensorSpec) -> Breadth:
    """How far the coils' copper reaches across."""
    halves = [(p.centre[1], Ring(spec.coil, p, 0.0).half_size[1]) for p in spec.array.placements]
    return Breadth(min(y - half for y, half in halves), max(y + half for y, half in halves))


def assign_lanes(placements: tuple[CoilPlacement, ...], first_side: int) -> tuple[Lane, ...]:
    """A lane for every coil, in the order of the placements; `first_side` is the side that is used first."""
    near_first = sorted(range(len(placements)), key=lambda i: -placements[i].centre[0])
    taken = {near_first[0]: (0, 0)}
    for distance, coil in enumerate(near_first[1:]):
        taken[coil] = (-first_side if distance % 2 else first_side, distance // 2)
    from_top = sorted(taken, key=lambda coil: -taken[coil][0] * (1 + taken[coil][1]))
    return tuple(Lane(placement, *taken[i], rank=from_top.index(i)) for i, placement in enumerate(placements))


def rows_of_lanes(placements: tuple[CoilPlacement, ...]) -> list[tuple[Lane, ...]]:
    """Places in the tail for coils in several rows, to be tried in this order.

    Rows from the top with the far coils of each outermost, so that they pass outside the near ones; innermost, so that
    they come through between the rows; and with a row in the middle passing all others on one side. Where every coil
    has a height of its own, first in the order in which they are seen from the tail, and as if they stood in line.
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
        ranks = [_as_seen(placements), *in_line, *ranks]
    unlike = dict.fromkeys(ranks)
    return [tuple(map(Lane, placements, [0] * len(order), [0] * len(order), order)) for order in unlike]


def _as_seen(placements: tuple[CoilPlacement, ...]) -> tuple[int, ...]:
    """Ranks from the top by the direction in which the tail's end of the array sees the coils."""
    size = max(math.dist(p.centre, q.centre) for p in placements for q in placements)
    eye = max(p.centre[0] for p in placements) + 0.5 * size
    from_top = sorted(placements, key=lambda p: round(-p.centre[1] / (eye - p.centre[0]), 9))
    return tuple(from_top.index(p) for p in placements)


def lane_height(bus: Bus, index: int, track: int = 0) -> float:
    """Distance (m) from the axis to a lane's track: `index` counts outwards, `track` 1 is the outer of a flat pair."""
    tracks = index if bus.is_stacked else 2 * index + track
    return bus.reach + bus.ring_offset + bus.base + tracks * bus.pitch


def exits(spec: SensorSpec, bus: Bus, lane: Lane, funnel_x: float, turned: bool = False) -> list[tuple[Exit, Exit]]:
    """The ways in which a coil's two ends (A, B) may leave: pairs of exits, to be tried in this order.

    `turned` gives those that leave the ring beside its corner, for coils whose own ends stand there.
    """
    if bus.is_stacked:
        single = _turned_exits if turned and lane.side else _single_exits
        return [
            (Exit(angle, way, bus.layers[0]), Exit(angle, way, bus.layers[1]))
            for angle, way in single(spec, bus, lane, funnel_x)
        ]
    return _flat_exits(spec, bus, lane, funnel_x)


def _single_exits(spec: SensorSpec, bus: Bus, lane: Lane, funnel_x: float) -> list[tuple[float, tuple[Point, ...]]]:
    """Where a coil's pair may leave its ring: the angle (rad) and the way to the funnel."""
    ring = Ring(spec.coil, lane.placement, bus.ring_offset)
    if lane.side:
        height = lane.side * lane_height(bus, lane.index)
        corner = lane.side * math.atan2(ring.half_size[1], ring.half_size[0])
        return [(corner, (_diagonal(ring.at(corner), height), Point(funnel_x, height)))]
    found: list[tuple[float, tuple[Point, ...]]] = []
    length, breadth = ring.half_size
    outline = spec.coil.outline
    for degrees in (0, 20, -20, 40, -40):
        # about the middle of the end that faces the tail, which is the centre unless the coil is long
        turn = math.radians(degrees)
        angle = math.atan2(breadth * math.sin(turn), max(0.0, length - breadth) + breadth * math.cos(turn))
        place = ring.at(angle)
        height = place.y if outline.sides and outline.is_long else ring.centre.y + min(ring.half_size) * math.tan(turn)
        edge = Point(ring.centre.x + length, height)
        way = (edge, Point(funnel_x, edge.y)) if edge.distance(place) > 1e-9 else (Point(funnel_x, edge.y),)
        found.append((angle, way))
    return found


def _turned_exits(spec: SensorSpec, bus: Bus, lane: Lane, funnel_x: float) -> list[tuple[float, tuple[Point, ...]]]:
    ring = Ring(spec.coil, lane.placement, bus.ring_offset)
    height = lane.side * lane_height(bus, lane.index)
    corner = math.atan2(ring.half_size[1], ring.half_size[0])
    angles = [lane.side * (corner + math.radians(degrees)) for degrees in TURNED]
    return [(angle, (_diagonal(ring.at(angle), height), Point(funnel_x, height))) for angle in angles]


def _flat_exits(spec: SensorSpec, bus: Bus, lane: Lane, funnel_x: float) -> list[tuple[Exit, Exit]]:
    """Side by side: the track that leaves the ring farther back takes the outer lane; either end of the coil may."""
    ring = Ring(spec.coil, lane.placement, bus.ring_offset)
    turn = 2.0 * bus.pitch / min(ring.half_size)
    layer = bus.layers[0]
    if lane.side:
        corner = lane.side * math.atan2(ring.half_size[1], ring.half_size[0])
        ways = []
        for track, angle in ((1, corner), (0, corner - lane.side * turn)):
            height = lane.side * lane_height(bus, lane.index, track)
            ways.append(Exit(angle, (_diagonal(ring.at(angle), height), Point(funnel_x, height)), layer))
        return [(ways[0], ways[1]), (ways[1], ways[0])]
    pairs = []
    for degrees in (0, 25, -25):
        upper, lower = (
            Exit(angle, (Point(funnel_x, ring.at(angle).y),), layer)
            for angle in (math.radians(degrees) + turn / 2, math.radians(degrees) - turn / 2)
        )
        pairs += [(upper, lower), (lower, upper)]
    return pairs


def _diagonal(start: Point, height: float) -> Point:
    """Where a 45 degree line towards the tail from `start` reaches a height."""
    return Point(start.x + abs(height - start.y), height)
