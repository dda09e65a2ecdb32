"""How one coil's outer ends get out: stubs to the vias outside the winding, leads round the ring to their exits.

A small search: every end may go either way round the ring, every outer via may stand at several places; the shortest
combination that keeps the rules' distances is taken. Branches of one coil are compared by the angles that they claim on
the ring, which is cheap; with everything else on the board they are compared by their true geometry.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property, lru_cache
from itertools import pairwise

from sitscad.geometry.path import TWO_PI, Line, Path, Point, polyline
from sitscad.layout.board import Winding
from sitscad.layout.branch_table import BranchTable, branch_table
from sitscad.layout.clearance import Hole, Obstacles, Track, hole_keep_out
from sitscad.layout.lanes import Bus, Exit
from sitscad.layout.ring import Ring
from sitscad.record import record
from sitscad.spec.sensor import CoilPlacement, CoilSpec, SensorSpec

VIA_PLACES = 32
TRIALS = 4_000
"""The search of one coil gives up after it has tried this many branches."""

TRIALS_OF_A_WAVE = 50
"""What it takes to find the ways through the array to one coil, in trials."""

BUDGET = 16_000
"""And all searches of one board together after this many: some seconds."""

TRIALS_OF_CHANGES = 20_000
"""And all those of changed specs together, where it is tried what would help."""

TRIALS_OF_ONE_CHANGE = 6_000
"""One of them after this many: the next change may be easier."""


@record
class OuterEnd:
    """The outer end of one layer, or the inner via from which a coil with an odd number of layers comes out."""

    point: Point
    layer: int
    from_inside: bool = False


@record
class Surroundings:
    """What the search of one coil needs to know: the spec, the bus, the half width (m) of the ground for vias."""

    spec: SensorSpec
    bus: Bus
    placement: CoilPlacement
    half_width: float

    @cached_property
    def hole(self) -> Hole:
        """A via of the fabricator's smallest size, not yet placed."""
        return Hole(Point(0.0, 0.0), self.spec.fpc.rules.via_pad, self.spec.fpc.rules.via_drill)

    @cached_property
    def keep_out(self) -> float:
        """From a via's centre to the edge of copper that is not joined to it (m)."""
        return hole_keep_out(self.hole, self.spec.fpc.rules, self.bus.spacing)

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
        limit = self.half_width - self.hole.pad / 2 - self.spec.fpc.rules.copper_to_edge + 1e-9
        for place, angle, distance in self._around_coil:
            hole = Hole(place.shifted(*self.placement.centre), self.hole.pad, self.hole.drill)
            if abs(hole.centre.y) <= limit:
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

    @property
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

    @property
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

    @property
    def cost(self) -> float:
        """Length (m), a via counting as a millimetre."""
        return sum([leg.cost for leg in self.legs]) + (1e-3 if self.hole else 0.0)


@record
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
    def entries(self) -> tuple[Point, Point]:
        """Where the two leads enter the tail."""
        last = (self.lead_b or self.lead_a).legs[-1]
        return self.lead_a.legs[-1].track.path.end, last.track.path.end

    @property
    def cost(self) -> float:
        """Length of everything (m), vias counted as in `Branch.cost`."""
        return sum(branch.cost for branch in self.branches)


def escape(
    around: Surroundings,
    joins: list[tuple[OuterEnd, OuterEnd]],
    ends: tuple[OuterEnd, OuterEnd | None],
    choices: Iterable[tuple[Exit, Exit]],
    obstacles: Obstacles,
    patience: Patience,
    first: bool = False,
) -> Escape | None:
    """The cheapest way out that keeps every distance, or the `first` found; None where the search finds none."""
    places = obstacles.admitted(list(around.via_places()))
    search = _Search(obstacles, patience)
    join_tables: list[BranchTable] = []
    best: Escape | None = None
    for exit_a, exit_b in choices:
        leads = [_sorted(_lead_options(around, ends[0], exit_a, places))]
        if ends[1] is not None:
            leads.append(_sorted(_lead_options(around, ends[1], exit_b, places)))
        if not all(any(map(search.admits, options)) for options in leads):
            continue
        if not join_tables:
            join_tables = [branch_table(around, _sorted(_join_options(around, pair, places))) for pair in joins]
        chosen = search.find([*(branch_table(around, options) for options in leads), *join_tables])
        if chosen is not None:
            found = Escape(chosen[len(leads) :], chosen[0], chosen[1] if ends[1] is not None else None)
            best = found if best is None or found.cost < best.cost - 1e-6 else best
            if first:
                break
    return best


class Patience:
    """How many branches the searches of one board may still try."""

    def __init__(self, budget: int = BUDGET) -> None:
        self.left = budget

    @property
    def is_spent(self) -> bool:
        """Whether no search may begin any more."""
        return self.left <= 0

    @contextmanager
    def share(self, most: int) -> Iterator[Patience]:
        """A part of it, at most so many; what is spent of the part is spent of the whole."""
        part = Patience(min(most, self.left))
        before = part.left
        yield part
        self.left -= before - part.left


class _Search:
    """In depth over the connections' branches, cheapest first, on sets of those that the chosen ones leave room for."""

    def __init__(self, obstacles: Obstacles, patience: Patience) -> None:
        self._obstacles = obstacles
        self._admitted: dict[int, tuple[Leg, bool]] = {}
        self._apart: dict[tuple[int, int, int], int] = {}
        self._asked: list[Sequence[BranchTable]] = []
        self._patience = patience
        self._left = TRIALS

    def find(self, tables: Sequence[BranchTable]) -> tuple[Branch, ...] | None:
        """One branch of every table, none too near another or anything on the board."""
        self._asked.append(tables)  # what is remembered goes by identity, so the tables have to live on
        return self._combine(tables, [table.everything for table in tables])

    def _combine(self, tables: Sequence[BranchTable], left: list[int]) -> tuple[Branch, ...] | None:
        if not tables:
            return ()
        options = left[0]
        while options:
            row = (options & -options).bit_length() - 1
            options &= options - 1
            branch = tables[0].branches[row]
            if not self.admits(branch):
                continue
            self._spend(1)
            if self._left < 0 or self._patience.left < 0:
                return None
            after = [
                mask & self._beside(tables[0], row, other) for mask, other in zip(left[1:], tables[1:], strict=True)
            ]
            if all(after):
                found = self._combine(tables[1:], after)
                if found is not None:
                    return (branch, *found)
        return None

    def _beside(self, table: BranchTable, row: int, other: BranchTable) -> int:
        key = (id(table), row, id(other))
        if key not in self._apart:
            self._apart[key] = other.beside_branch(table, row)
        return self._apart[key]

    def _spend(self, trials: int) -> None:
        self._left -= trials
        self._patience.left -= trials

    def admits(self, branch: Branch) -> bool:
        """Whether a branch's legs keep their distance from what is on the board; its via is at a place that does."""
        return all(map(self._admits, branch.legs))

    def _admits(self, leg: Leg) -> bool:
        if id(leg) not in self._admitted:  # the leg is kept too, so that no other gets its identity
            self._spend(1)
            self._admitted[id(leg)] = leg, self._obstacles.admits([leg.track])
        return self._admitted[id(leg)][1]


def _lead_options(around: Surroundings, end: OuterEnd, out: Exit, places: list[Hole]) -> Iterator[Branch]:
    """The ways from a coil's end to its exit: directly, or by a via where the layers differ."""
    if end.layer == out.layer:
        for sweep in _sweeps(around, end, out.angle):
            yield Branch((Leg(around, end.layer, end.point, out.angle - sweep, sweep, out.way),))
        return
    way = polyline([around.ring.at(out.angle), *out.way])
    clear = around.keep_out + around.bus.width / 2 - 1e-9
    for hole in places:
        if way.distance(hole.centre) < clear:  # a lead that passes its own via closes a loop with it
            continue
        angle, _ = around.stand(hole)
        onward = [Leg(around, out.layer, hole.centre, angle, sweep, out.way) for sweep in _both_ways(out.angle - angle)]
        for to_via in _legs_to(around, end, hole, angle):
            for from_via in onward:
                yield Branch((to_via, from_via), hole)


def _join_options(around: Surroundings, pair: tuple[OuterEnd, OuterEnd], places: list[Hole]) -> Iterator[Branch]:
    """The ways to join two layers' outer ends by a via outside the winding."""
    for hole in places:
        angle, _ = around.stand(hole)
        others = _legs_to(around, pair[1], hole, angle)
        for one in _legs_to(around, pair[0], hole, angle):
            for other in others:
                yield Branch((one, other), hole, returns=True)


def _legs_to(around: Surroundings, end: OuterEnd, hole: Hole, angle: float) -> list[Leg]:
    """The ways from a coil's end to a via that stands beside the ring at an angle."""
    return [
        Leg(around, end.layer, end.point, angle - sweep, sweep, (hole.centre,)) for sweep in _sweeps(around, end, angle)
    ]


def _sweeps(around: Surroundings, end: OuterEnd, angle: float) -> list[float]:
    """Both ways round from an end to an angle; from an inner via straight under the turns.

    At a corner each way begins on its own side of it, so that no lead bends back sharply.
    """
    if end.from_inside:
        return [0.0]
    back, on = around.ring.facing(end.point)
    if on - back < 1e-6:
        return _both_ways(angle - on)
    ways = sorted((-((back - angle) % TWO_PI), (angle - on) % TWO_PI), key=abs)
    return [0.0, *ways] if (angle - back) % TWO_PI < on - back else ways


def _both_ways(turn: float) -> list[float]:
    short = math.remainder(turn, TWO_PI)
    if abs(short) < 1e-6:
        return [0.0]
    return [short, short - math.copysign(TWO_PI, short)]


def _sorted(branches: Iterable[Branch]) -> list[Branch]:
    return sorted(branches, key=lambda branch: round(branch.cost, 9))


def outer_ends(windings: tuple[Winding, ...]) -> tuple[OuterEnd, list[tuple[OuterEnd, OuterEnd]], OuterEnd | None]:
    """A coil's first outer end, the pairs of outer ends to be joined, and its last outer end (None: it ends inside)."""

    def end(winding: Winding) -> OuterEnd:
        return OuterEnd(winding.path.start if winding.inward else winding.path.end, winding.layer)

    pairs = [(end(windings[i]), end(windings[i + 1])) for i in range(1, len(windings) - 1, 2)]
    return end(windings[0]), pairs, end(windings[-1]) if len(windings) % 2 == 0 else None
