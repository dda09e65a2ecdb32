"""How one coil's outer ends get out: stubs to the vias outside the winding, leads round the ring to their exits.

A small search: every end may go either way round the ring, every outer via may stand at several places; the shortest
combination that keeps the rules' distances is taken. Branches of one coil are compared by the angles that they claim on
the ring, which is cheap; with everything else on the board they are compared by their true geometry.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from sitscad.geometry.path import TWO_PI, Point, polyline
from sitscad.layout.branch_table import BranchTable, branch_table
from sitscad.layout.branches import Branch, Leg, OuterEnd, Surroundings
from sitscad.layout.clearance import Hole, Obstacles
from sitscad.layout.lanes import Exit
from sitscad.layout.patience import Patience
from sitscad.record import record

TRIALS = 2_000
"""The search of one coil gives up after it has tried this many branches: ways found took up to 1,100 (1,000 coils)."""

QUICK = 100
"""Where the first way found is taken, every exit is given so many at first: an exit without a way spends them all."""

STEP_BACK = 1e-3
"""How far back on the ring (rad) its direction is taken."""

SHARPEST = math.cos(math.radians(40.0))
"""A lead leaves the ring at no sharper angle: its two parts would lie on each other."""


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
    hard: list[list[BranchTable]] = []
    for exit_a, exit_b in choices:
        leads = [_sorted(_lead_options(around, ends[0], exit_a, places))]
        if ends[1] is not None:
            leads.append(_sorted(_lead_options(around, ends[1], exit_b, places)))
        if not all(any(map(search.admits, options)) for options in leads):
            continue
        if not join_tables:
            join_tables = [branch_table(around, _sorted(_join_options(around, pair, places))) for pair in joins]
        tables = [*(branch_table(around, options) for options in leads), *join_tables]
        chosen = search.find(tables, QUICK if first else TRIALS)
        if chosen is None and search.gave_up:
            hard.append(tables)
        elif chosen is not None:
            found = _escape(chosen, ends)
            best = found if best is None or found.cost < best.cost - 1e-6 else best
            if first:
                return best
    for tables in hard if first else ():
        chosen = search.find(tables, TRIALS)
        if chosen is not None:
            return _escape(chosen, ends)
    return best


def _escape(chosen: tuple[Branch, ...], ends: tuple[OuterEnd, OuterEnd | None]) -> Escape:
    leads = 1 if ends[1] is None else 2
    return Escape(chosen[leads:], chosen[0], chosen[1] if ends[1] is not None else None)


class _Search:
    """In depth over the connections' branches, cheapest first, on sets of those that the chosen ones leave room for."""

    def __init__(self, obstacles: Obstacles, patience: Patience) -> None:
        self._obstacles = obstacles
        self._admitted: dict[int, tuple[Leg, bool]] = {}
        self._apart: dict[tuple[int, int, int], int] = {}
        self._exact: dict[tuple[int, int], bool] = {}
        self._asked: list[Sequence[BranchTable]] = []
        self._patience = patience
        self._total = self._left = TRIALS
        self.gave_up = False

    def find(self, tables: Sequence[BranchTable], most: int) -> tuple[Branch, ...] | None:
        """One branch of every table, none too near another or anything on the board; None, too, where `most` trials
        were not enough: then it `gave_up`.
        """
        self._asked.append(tables)  # what is remembered goes by identity, so the tables have to live on
        self._left = min(most, self._total)
        self.gave_up = False
        return self._combine(tables, [table.everything for table in tables], ())

    def _combine(
        self, tables: Sequence[BranchTable], left: list[int], chosen: tuple[Branch, ...]
    ) -> tuple[Branch, ...] | None:
        if not tables:
            return chosen
        options = left[0]
        while options:
            row = (options & -options).bit_length() - 1
            options &= options - 1
            branch = tables[0].branches[row]
            if not self.admits(branch) or not all(self._clear(branch, other) for other in chosen):
                continue
            self._spend(1)
            if self._left < 0 or self._patience.left < 0:
                self.gave_up = True
                return None
            after = [
                mask & self._beside(tables[0], row, other) for mask, other in zip(left[1:], tables[1:], strict=True)
            ]
            if all(after):
                found = self._combine(tables[1:], after, (*chosen, branch))
                if found is not None:
                    return found
        return None

    def _beside(self, table: BranchTable, row: int, other: BranchTable) -> int:
        key = (id(table), row, id(other))
        if key not in self._apart:
            self._apart[key] = other.beside_branch(table, row)
        return self._apart[key]

    def _clear(self, branch: Branch, other: Branch) -> bool:
        """Whether two branches keep the fabricator's distance: angles on the ring do not see what bends at a corner."""
        key = (id(branch), id(other))
        if key not in self._exact:
            rules = branch.legs[0].around.spec.fpc.rules
            beside = Obstacles(rules, rules.trace_spacing)
            beside.add(other.tracks, other.holes)
            self._exact[key] = beside.admits(branch.tracks, branch.holes)
        return self._exact[key]

    def _spend(self, trials: int) -> None:
        self._left -= trials
        self._total -= trials
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
            if not _doubles_back(around, out, sweep):
                yield Branch((Leg(around, end.layer, end.point, out.angle - sweep, sweep, out.way),))
        return
    way = polyline([around.ring.at(out.angle), *out.way])
    clear = around.keep_out + around.bus.width / 2 - 1e-9
    for hole in places:
        if way.distance(hole.centre) < clear:  # a lead that passes its own via closes a loop with it
            continue
        angle, _ = around.stand(hole)
        sweeps = [sweep for sweep in _both_ways(out.angle - angle) if not _doubles_back(around, out, sweep)]
        onward = [Leg(around, out.layer, hole.centre, angle, sweep, out.way) for sweep in sweeps]
        for to_via in _legs_to(around, end, hole, angle):
            for from_via in onward:
                yield Branch((to_via, from_via), hole)


def _doubles_back(around: Surroundings, out: Exit, sweep: float) -> bool:
    """Whether a lead that comes round the ring by `sweep` (rad) would leave it back over itself."""
    if not sweep:
        return False
    leaves, before = around.ring.at(out.angle), around.ring.at(out.angle - math.copysign(STEP_BACK, sweep))
    beyond = next((point for point in out.way if point.distance(leaves) > 1e-9), leaves)
    ahead, onward = (leaves.x - before.x, leaves.y - before.y), (beyond.x - leaves.x, beyond.y - leaves.y)
    along = ahead[0] * onward[0] + ahead[1] * onward[1]
    return along < -SHARPEST * math.hypot(*ahead) * math.hypot(*onward)


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
