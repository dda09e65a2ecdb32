"""The ways that lead round one coil: tracks on its ring road, and vias outside it.

A branch is one connection outside the winding, of one or two legs; each leg runs from a point to the ring, round it,
and on to its end.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property, lru_cache
from itertools import pairwise

from sitscad.geometry.path import TWO_PI, Line, Path, Point
from sitscad.layout.board import Winding
from sitscad.layout.clearance import Breadth, Hole, Track, hole_keep_out, joined_hole
from sitscad.layout.routing.closing import swept_inside
from sitscad.layout.routing.lanes import Bus
from sitscad.layout.routing.ring import Ring
from sitscad.record import record
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.sensor import SensorSpec

VIA_PLACES = 32
"""Directions round a coil in which vias may stand."""


@record
class OuterEnd:
    """The outer end of one layer, or the inner via from which a coil with an odd number of layers comes out."""

    point: Point
    layer: int
    from_inside: bool = False


@record
class Surroundings:
    """What the search of one coil needs to know: the spec, the bus, the ground for vias across the tail."""

    spec: SensorSpec
    bus: Bus
    placement: CoilPlacement
    breadth: Breadth

    @cached_property
    def hole(self) -> Hole:
        """A via of the fabricator's smallest size, not yet placed."""
        return Hole(Point(0.0, 0.0), self.spec.fpc.rules.via_pad, self.spec.fpc.rules.via_drill)

    @cached_property
    def joined(self) -> Hole:
        """Such a via with the ends of the leads that meet there."""
        return joined_hole(self.spec.fpc.rules, self.bus.width)

    @cached_property
    def keep_out(self) -> float:
        """From a via's centre to the edge of copper that is not joined to it (m)."""
        return hole_keep_out(self.joined, self.spec.fpc.rules, self.bus.spacing)

    @cached_property
    def ring(self) -> Ring:
        """The ring road of the coil."""
        return Ring(self.spec.coil, self.placement, self.bus.ring_offset)

    @cached_property
    def radius(self) -> float:
        """The ring's smallest radius (m): angles are turned into distances with it, on the safe side."""
        return min(self.spec.coil.size) / 2 + self.bus.ring_offset

    def via_places(self) -> Iterator[Hole]:
        """Holes where the outline has room: next outside the coil, and farther out so that the ring road stays free."""
        keep = self.joined.pad / 2 + self.spec.fpc.rules.copper_to_edge - 1e-9
        for place, angle, distance in self._around_coil:
            hole = Hole(place.shifted(*self.placement.centre), self.hole.pad, self.hole.drill)
            if self.breadth.holds(hole.centre.y, hole.centre.y, keep):
                self._stands[hole.centre] = angle, distance
                yield hole

    @property
    def _around_coil(self) -> tuple[tuple[Point, float, float], ...]:
        beyond = self.bus.ring_offset + self.bus.width / 2 + self.keep_out
        placement = CoilPlacement("", (0.0, 0.0), self.placement.rotation)
        return _via_places(self.spec.coil, placement, self.bus.ring_offset, (self.keep_out, beyond))

    @cached_property
    def _stands(self) -> dict[Point, tuple[float, float]]:
        return {}

    def stand(self, hole: Hole) -> tuple[float, float]:
        """Where the ring road passes one of the via places (rad), and how far from it (m)."""
        return self._stands[hole.centre]


@lru_cache(maxsize=64)
def _via_places(
    coil: CoilSpec, placement: CoilPlacement, road: float, offsets: tuple[float, ...]
) -> tuple[tuple[Point, float, float], ...]:
    """Places round a coil at some offsets, where its ring road (offset `road`) passes each (rad), and how far off (m).

    Coils that differ in their place only share them, and so do boards that are tried to find out what helps.
    """
    ring, found = Ring(coil, placement, road), []
    for offset in offsets:
        around = Ring(coil, placement, offset)
        for i in range(VIA_PLACES):
            place = around.at(TWO_PI * i / VIA_PLACES)
            angle = ring.facing(place)[0]
            found.append((place, angle, place.distance(ring.at(angle))))
    return tuple(found)


@record
class Leg:
    """One track: from `begin` to the ring at `angle`, round it by `sweep` (rad, signed), and on through `finish`."""

    around: Surroundings
    layer: int
    begin: Point
    angle: float
    sweep: float
    finish: tuple[Point, ...]

    @property
    def end_angle(self) -> float:
        """Where the leg leaves the ring."""
        return self.angle + self.sweep

    @cached_property
    def stretches(self) -> list[tuple[Point, Point]]:
        """Start and end of every straight stretch beyond the ring."""
        corners = (self.around.ring.at(self.end_angle), *self.finish)
        return [(start, end) for start, end in pairwise(corners) if start.distance(end) > 1e-12]

    @cached_property
    def track(self) -> Track:
        """The leg as a track."""
        ring = self.around.ring
        first = ring.at(self.angle)
        path = Path((Line(self.begin, first),)) if self.begin.distance(first) > 1e-9 else Path(())
        if self.sweep:
            path = path + ring.along(self.angle, self.end_angle, self.sweep > 0)
        beyond = Path(tuple(Line(start, end) for start, end in self.stretches))
        return Track(path + beyond, self.around.bus.width, self.layer)

    @cached_property
    def round(self) -> float:
        """How far it goes round the coil (rad, signed): on the ring, and inside if it begins there."""
        ring = self.around.ring
        return self.sweep + swept_inside(self.begin, ring.at(self.angle), ring.centre)

    @cached_property
    def cost(self) -> float:
        """Its length on the ring and before it (m), near enough for sorting."""
        return abs(self.sweep) * self.around.radius + self.begin.distance(self.around.ring.at(self.angle))


@record
class Branch:
    """One connection outside the winding: one or two legs with a via between them.

    ``returns`` is set when the second leg was drawn from its own end towards the via and is walked backwards.
    """

    legs: tuple[Leg, ...]
    hole: Hole | None = None
    returns: bool = False

    @cached_property
    def pieces(self) -> tuple[Track | Hole, ...]:
        """Tracks and hole in the order of the current."""
        if self.hole is None:
            return (self.legs[0].track,)
        second = self.legs[1].track
        if self.returns:
            second = Track(second.path.reversed(), second.width, second.layer)
        return (self.legs[0].track, self.hole, second)

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks alone."""
        return tuple(leg.track for leg in self.legs)

    @property
    def holes(self) -> tuple[Hole, ...]:
        """The hole, if there is one."""
        return (self.hole,) if self.hole else ()

    @cached_property
    def cost(self) -> float:
        """Length (m), a via counting as a millimetre."""
        return sum([leg.cost for leg in self.legs]) + (1e-3 if self.hole else 0.0)

    @cached_property
    def round(self) -> float:
        """How far it goes round the coil, from where its first leg begins (rad, signed)."""
        first, *second = (leg.round for leg in self.legs)
        return first + sum(-sweep if self.returns else sweep for sweep in second)


def outer_ends(windings: tuple[Winding, ...]) -> tuple[OuterEnd, list[tuple[OuterEnd, OuterEnd]], OuterEnd | None]:
    """A coil's first outer end, the pairs of outer ends to be joined, and its last outer end (None: it ends inside)."""

    def end(winding: Winding) -> OuterEnd:
        return OuterEnd(winding.path.start if winding.inward else winding.path.end, winding.layer)

    pairs = [(end(windings[i]), end(windings[i + 1])) for i in range(1, len(windings) - 1, 2)]
    return end(windings[0]), pairs, end(windings[-1]) if len(windings) % 2 == 0 else None
