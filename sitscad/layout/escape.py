"""How one coil's outer ends get out: stubs to the vias outside the winding, and the leads round the ring to their exits.

A small search: every end may go either way round, every outer via may stand at several places; the shortest combination
that keeps the rules' distances from everything on the board is taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from sitscad.geometry.path import TWO_PI, Line, Path, Point, polyline
from sitscad.layout.board import Winding
from sitscad.layout.clearance import Hole, Obstacles, Track, hole_keep_out
from sitscad.layout.lanes import Bus, Exit
from sitscad.layout.ring import Ring
from sitscad.spec.sensor import CoilPlacement, SensorSpec

VIA_PLACES = 32


@dataclass(frozen=True)
class OuterEnd:
    """The outer end of one layer, or the inner via from which a coil with an odd number of layers comes out."""

    point: Point
    layer: int
    from_inside: bool = False


@dataclass(frozen=True)
class Branch:
    """One connection outside the winding: tracks in the order of the current, with holes between them."""

    pieces: tuple[Track | Hole, ...]

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks alone."""
        return tuple(piece for piece in self.pieces if isinstance(piece, Track))

    @property
    def holes(self) -> tuple[Hole, ...]:
        """The holes alone."""
        return tuple(piece for piece in self.pieces if isinstance(piece, Hole))

    @property
    def length(self) -> float:
        """Length of all tracks (m), a hole counting as a millimetre so that vias are avoided."""
        return sum(track.path.length for track in self.tracks) + 1e-3 * len(self.holes)


@dataclass(frozen=True)
class Escape:
    """What leads out of one coil: the joins outside (between layers), and the two leads."""

    joins: tuple[Branch, ...]
    lead_a: Branch
    lead_b: Branch | None

    @property
    def branches(self) -> tuple[Branch, ...]:
        """All of them."""
        return (*self.joins, self.lead_a) + ((self.lead_b,) if self.lead_b else ())

    @property
    def length(self) -> float:
        """Length of all tracks (m), holes counted as in `Branch.length`."""
        return sum(branch.length for branch in self.branches)


@dataclass(frozen=True)
class Surroundings:
    """What the search of one coil needs to know: the spec, the bus, the ground that vias may stand on."""

    spec: SensorSpec
    bus: Bus
    placement: CoilPlacement
    half_width: float

    @property
    def hole(self) -> Hole:
        """A via of the fabricator's smallest size, not yet placed."""
        return Hole(Point(0.0, 0.0), self.spec.fpc.rules.via_pad, self.spec.fpc.rules.via_drill)

    @property
    def ring(self) -> Ring:
        """The ring road of the coil."""
        return Ring(self.spec.coil, self.placement, self.bus.ring_offset)

    @property
    def via_ring(self) -> Ring:
        """Where outer vias stand: next outside the coil's copper."""
        keep = hole_keep_out(self.hole, self.spec.fpc.rules, self.bus.spacing)
        return Ring(self.spec.coil, self.placement, keep)


def escape(
    around: Surroundings,
    joins: list[tuple[OuterEnd, OuterEnd]],
    ends: tuple[OuterEnd, OuterEnd | None],
    choices: list[tuple[Exit, Exit]],
    obstacles: Obstacles,
) -> Escape | None:
    """The shortest way out that keeps every distance, or None where there is none."""
    places = [place for place in _via_places(around) if obstacles.admits((), (place,))]
    best: Escape | None = None
    for exit_a, exit_b in choices:
        found = _escape_by(around, joins, ends, (exit_a, exit_b), obstacles, places)
        if found is not None and (best is None or found.length < best.length - 1e-9):
            best = found
    return best


def _escape_by(
    around: Surroundings,
    joins: list[tuple[OuterEnd, OuterEnd]],
    ends: tuple[OuterEnd, OuterEnd | None],
    exits: tuple[Exit, Exit],
    obstacles: Obstacles,
    places: list[Hole],
) -> Escape | None:
    options = [_lead_options(around, ends[0], exits[0], places)]
    if ends[1] is not None:
        options.append(_lead_options(around, ends[1], exits[1], places))
    options += [_join_options(around, pair, places) for pair in joins]
    clear = [[b for b in branches if obstacles.admits(b.tracks, b.holes)] for branches in options]
    chosen = _combine(around, clear)
    if chosen is None:
        return None
    lead_b = chosen[1] if ends[1] is not None else None
    return Escape(chosen[2:] if lead_b else chosen[1:], chosen[0], lead_b)


def _combine(around: Surroundings, options: list[list[Branch]]) -> tuple[Branch, ...] | None:
    """Depth-first over the options, shortest first, each branch clear of the ones already chosen."""

    def extend(chosen: tuple[Branch, ...], placed: Obstacles) -> tuple[Branch, ...] | None:
        if len(chosen) == len(options):
            return chosen
        for branch in options[len(chosen)]:
            if placed.admits(branch.tracks, branch.holes):
                further = placed.copy()
                further.add(branch.tracks, branch.holes)
                found = extend((*chosen, branch), further)
                if found is not None:
                    return found
        return None

    return extend((), Obstacles(around.spec.fpc.rules, around.bus.spacing))


def _via_places(around: Surroundings) -> Iterator[Hole]:
    """Holes about the coil where the outline has room for the pad and its distance to the edge."""
    ring, hole, rules = around.via_ring, around.hole, around.spec.fpc.rules
    limit = around.half_width - hole.pad / 2 - rules.copper_to_edge + 1e-9
    for i in range(VIA_PLACES):
        place = ring.at(TWO_PI * (i + 0.5) / VIA_PLACES if VIA_PLACES % 2 else TWO_PI * i / VIA_PLACES)
        if abs(place.y) <= limit:
            yield Hole(place, hole.pad, hole.drill)


def _lead_options(around: Surroundings, end: OuterEnd, out: Exit, places: list[Hole]) -> list[Branch]:
    """The ways from a coil's end to its exit, shortest first: directly, or by a via where the layers differ."""
    width = around.bus.width
    if end.layer == out.layer:
        return _sorted(
            Branch((Track(path + _way_out(around, out), width, end.layer),)) for path in _to_ring(around, end, out.angle)
        )
    found = []
    for hole in places:
        angle = _angle(around, hole.centre)
        for first in _to_via(around, end, hole):
            for second in (True, False):
                ring = around.ring
                back = _lines(hole.centre, ring.at(angle)) + ring.along(angle, out.angle, second)
                beyond = Track(back + _way_out(around, out), width, out.layer)
                found.append(Branch((Track(first, width, end.layer), hole, beyond)))
    return _sorted(found)


def _join_options(around: Surroundings, pair: tuple[OuterEnd, OuterEnd], places: list[Hole]) -> list[Branch]:
    """The ways to join two layers' outer ends by a via outside the winding, shortest first."""
    width = around.bus.width
    found = []
    for hole in places:
        for first in _to_via(around, pair[0], hole):
            for second in _to_via(around, pair[1], hole):
                found.append(
                    Branch((Track(first, width, pair[0].layer), hole, Track(second.reversed(), width, pair[1].layer)))
                )
    return _sorted(found)


def _to_ring(around: Surroundings, end: OuterEnd, angle: float) -> list[Path]:
    """From an end out to the ring and either way round to an angle; from an inner via straight under the turns."""
    if end.from_inside:
        return [_lines(end.point, around.ring.at(angle))]
    start = _angle(around, end.point)
    out = _lines(end.point, around.ring.at(start))
    ways = {round(path.length, 12): out + path for path in (around.ring.along(start, angle, s) for s in (True, False))}
    return [ways[length] for length in sorted(ways)]


def _to_via(around: Surroundings, end: OuterEnd, hole: Hole) -> list[Path]:
    angle = _angle(around, hole.centre)
    if end.from_inside:
        return [_lines(end.point, hole.centre)]
    if abs(math.remainder(angle - _angle(around, end.point), TWO_PI)) < 1e-6:
        return [_lines(end.point, hole.centre)]
    return [path + _lines(around.ring.at(angle), hole.centre) for path in _to_ring(around, end, angle)]


def _way_out(around: Surroundings, out: Exit) -> Path:
    return polyline([around.ring.at(out.angle), *out.way])


def _lines(start: Point, end: Point) -> Path:
    return Path((Line(start, end),)) if start.distance(end) > 1e-9 else Path(())


def _angle(around: Surroundings, point: Point) -> float:
    centre = around.ring.centre
    return math.atan2(point.y - centre.y, point.x - centre.x)


def _sorted(branches: Iterator[Branch] | list[Branch]) -> list[Branch]:
    return sorted(branches, key=lambda branch: round(branch.length, 9))


def outer_ends(windings: tuple[Winding, ...]) -> tuple[OuterEnd, list[tuple[OuterEnd, OuterEnd]], OuterEnd | None]:
    """A coil's first outer end, the pairs of outer ends to be joined, and its last outer end (None: it ends inside)."""

    def end(winding: Winding) -> OuterEnd:
        return OuterEnd(winding.path.start if winding.inward else winding.path.end, winding.layer)

    pairs = [(end(windings[i]), end(windings[i + 1])) for i in range(1, len(windings) - 1, 2)]
    return end(windings[0]), pairs, end(windings[-1]) if len(windings) % 2 == 0 else None
