"""How one coil's outer ends get out: stubs to the vias outside the winding, leads round the ring to their exits.

A small search: every end may go either way round the ring, every outer via may stand at several places; of the
combinations that keep the rules' distances that one is taken whose leads link least of the winding's flux (see
`closing`), and of those the shortest. Branches of one coil are compared by the angles that they claim on the ring,
which is cheap; with everything else on the board they are compared by their true geometry.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.geometry.path import TWO_PI, Point, polyline
from sitscad.layout.clearance import Hole, Obstacles, Track
from sitscad.layout.routing.branch_table import BranchTable, branch_table
from sitscad.layout.routing.branches import Branch, Leg, OuterEnd, Surroundings
from sitscad.layout.routing.closing import closing_cost, closing_turns, counted, least_closing
from sitscad.layout.routing.lanes import Exit
from sitscad.layout.routing.search_limit import SearchLimit
from sitscad.record import record

TRIALS = 2_000
"""The search of one coil gives up after it has tried this many branches: ways found took up to 1,100 (1,000 coils)."""

QUICK = 100
"""Where the first way found is taken, every exit is given so many at first: an exit without a way spends them all."""

PIECES = 48
"""Pieces of the ring road of which it is known whether a track may run there."""

PROVED = 8
"""Legs refused on a layer after which that is looked up: most searches find a way before."""

SPARED = 0.04
"""Leads that run so little farther round their coil than they must (turns) are as good as any."""

INSIDE = 0.1
"""A lead from the inside comes out within this (turns) of where it would go round nothing, past inner vias."""

COMES_OUT = tuple(math.radians(degrees) for degrees in (0, 10, -10, 20, -20, 30, -30, 45, -45))
"""How far beside its other end a coil that ends inside may come out from under its turns: to make up for what that lead
sweeps inside, or past an inner via.
"""

NEAR = math.radians(60.0)
"""A via stands no farther (rad) from where the lead from the inside comes out, or where it does."""

STEP_BACK = 1e-3
"""How far back on the ring (rad) its direction is taken."""

BENT_BACK = math.sin(math.radians(22.5))
"""A lead from under the turns bends back on to the ring by no more than a right angle and a quarter of one (sine)."""

SHARPEST = math.cos(math.radians(40.0))
"""A lead leaves the ring at no sharper angle: its two parts would lie on each other."""


Joined = dict[tuple[tuple[OuterEnd, OuterEnd], tuple[Point, ...]], BranchTable]
"""Ways to join two ends, by the ends and the places where a via may stand: boards that are tried share them."""


@record
class Escape:
    """What leads out of one coil: the joins outside (between layers), and the two leads."""

    joins: tuple[Branch, ...]
    lead_a: Branch
    lead_b: Branch

    @property
    def branches(self) -> tuple[Branch, ...]:
        """All of them."""
        return (*self.joins, self.lead_a, self.lead_b)

    @property
    def entries(self) -> tuple[Point, Point]:
        """Where the two leads enter the tail."""
        return self.lead_a.legs[-1].track.path.end, self.lead_b.legs[-1].track.path.end

    @property
    def closing(self) -> float:
        """How far leads and joins run round the coil in all (turns), positive where they run on as the winding does."""
        around = self.lead_a.legs[0].around
        joins = math.fsum(join.round for join in self.joins)
        return float(closing_turns(around.spec.coil, self.lead_a.round, self.lead_b.round + joins))

    @property
    def excess(self) -> float:
        """How much more that counts for than it had to (turns)."""
        coil = self.lead_a.legs[0].around.spec.coil
        least = INSIDE if len(coil.layers) % 2 else float(counted(least_closing(coil)))
        return max(0.0, float(counted(self.closing)) - least)

    @property
    def cost(self) -> float:
        """Length of everything (m), vias counted as in `Branch.cost`, and what running round the coil costs."""
        radius = self.lead_a.legs[0].around.radius
        return sum(branch.cost for branch in self.branches) + float(closing_cost(self.closing, radius))


def escape(
    around: Surroundings,
    joins: list[tuple[OuterEnd, OuterEnd]],
    ends: tuple[OuterEnd, OuterEnd],
    choices: Iterable[tuple[Exit, Exit]],
    obstacles: Obstacles,
    searches: SearchLimit,
    first: bool = False,
    known: Joined | None = None,
) -> Escape | None:
    """The cheapest way out that keeps every distance, or the `first` whose leads run no farther round the coil than
    they must; None where the search finds none. `known` are joins of boards that were tried before.
    """
    places = obstacles.admitted(list(around.via_places()))
    search = _Search(obstacles, searches)
    join_tables: list[BranchTable] = []
    best: Escape | None = None
    hard: list[list[BranchTable]] = []
    for exits in choices:
        if not all(search.lets_out(around, out) for out in exits):
            continue
        leads = _admitted_leads(search, _lead_options(around, ends, exits, places))
        if leads is None:
            continue
        if not join_tables:
            join_tables = [_join_table(around, pair, places, {} if known is None else known) for pair in joins]
        tables = [*(branch_table(around, options) for options in leads), *join_tables]
        found = search.find(tables, QUICK if first else TRIALS)
        if found is None and search.gave_up:
            hard.append(tables)
        best = _better(best, found)
        if first and best is not None and best.excess < SPARED:
            return best
    for tables in hard if first and best is None else ():
        best = search.find(tables, TRIALS)
        if best is not None:
            return best
    return best


def _admitted_leads(search: _Search, options: Iterable[Iterable[Branch]]) -> list[list[Branch]] | None:
    """The ways of two leads, the cheapest first; None where one has none that the board admits: the other's, which are
    many, are then not made.
    """
    leads = []
    for ways in options:
        leads.append(_sorted(ways))
        if not any(map(search.admits, leads[-1])):
            return None
    return leads


def _join_table(
    around: Surroundings, pair: tuple[OuterEnd, OuterEnd], places: list[Hole], known: Joined
) -> BranchTable:
    """The ways to join two ends by a via at one of the places, whatever else the board is like."""
    key = pair, tuple(hole.centre for hole in places)
    if key not in known:
        known[key] = branch_table(around, _sorted(_join_options(around, pair, places)))
    return known[key]


def _better(best: Escape | None, found: Escape | None) -> Escape | None:
    if best is None or found is None:
        return best or found
    return found if found.cost < best.cost - 1e-6 else best


class _Search:
    """In depth over the connections' branches, cheapest first, on sets of those that the chosen ones leave room for."""

    def __init__(self, obstacles: Obstacles, searches: SearchLimit) -> None:
        self._obstacles = obstacles
        self._admitted: dict[int, tuple[Leg, bool]] = {}
        self._exact: dict[tuple[int, int], bool] = {}
        self._single: dict[int, Obstacles] = {}
        self._barred: dict[int, int] = {}
        self._refused: dict[int, int] = {}
        self._closed: dict[int, NDArray[np.float64]] = {}
        self._asked: list[Sequence[BranchTable]] = []
        self._searches = searches
        self._total = self._left = TRIALS
        self.gave_up = False

    def find(self, tables: Sequence[BranchTable], most: int) -> Escape | None:
        """One branch of every table, those of the two leads first, none too near another or anything on the board;
        None, too, where `most` trials were not enough: then it `gave_up`.
        """
        self._asked.append(tables)  # what is remembered goes by identity, so the tables have to live on
        self._left = min(most, self._total)
        self.gave_up = False
        leads_a, leads_b, *joins = tables
        for row_a, row_b in _cheapest_pairs(leads_a, leads_b):
            pair = leads_a.branches[row_a], leads_b.branches[row_b]
            if not self.admits(pair[0]) or not leads_b.beside_branch(leads_a, row_a) >> row_b & 1:
                continue
            left = [table.beside_branch(leads_a, row_a) & table.beside_branch(leads_b, row_b) for table in joins]
            if not all(left) or not self.admits(pair[1]) or not self._clear(pair[1], pair[0]):
                continue
            if not self._goes_on():
                return None
            chosen = self._combine(joins, left, pair)
            if chosen is not None:
                return Escape(chosen[2:], *pair)
            if self.gave_up:
                return None
        return None

    def _goes_on(self) -> bool:
        """Counts a trial; whether the search may go on."""
        self._spend(1)
        self.gave_up = self._left < 0 or self._searches.is_overdrawn
        return not self.gave_up

    def _combine(
        self, tables: Sequence[BranchTable], left: list[int], chosen: tuple[Branch, ...]
    ) -> tuple[Branch, ...] | None:
        """The first branches, one of each table still left, that keep clear of each other; None where there are
        none.
        """
        if not tables:
            return chosen
        options = left[0] & ~self._barred.get(id(tables[0]), 0)
        while options:
            row = (options & -options).bit_length() - 1
            options &= options - 1
            branch = tables[0].branches[row]
            if not self.admits(branch):
                self._barred[id(tables[0])] = self._barred.get(id(tables[0]), 0) | 1 << row
                continue
            if not all(self._clear(branch, other) for other in chosen):
                continue
            if not self._goes_on():
                return None
            after = [
                mask & other.beside_branch(tables[0], row) for mask, other in zip(left[1:], tables[1:], strict=True)
            ]
            if all(after):
                found = self._combine(tables[1:], after, (*chosen, branch))
                if found is not None:
                    return found
        return None

    def _clear(self, branch: Branch, other: Branch) -> bool:
        """Whether two branches keep the fabricator's distance: angles on the ring do not see what bends at a corner."""
        key = (id(branch), id(other))
        if key not in self._exact:
            self._exact[key] = self._alone(other).admits(branch.tracks, branch.holes)
        return self._exact[key]

    def _alone(self, branch: Branch) -> Obstacles:
        """One branch as what others are to keep clear of."""
        if id(branch) not in self._single:
            rules = branch.legs[0].around.spec.fpc.rules
            self._single[id(branch)] = Obstacles(rules, rules.trace_spacing)
            self._single[id(branch)].add(branch.tracks, branch.holes)
        return self._single[id(branch)]

    def _spend(self, trials: int) -> None:
        self._left -= trials
        self._total -= trials
        self._searches.left -= trials

    def lets_out(self, around: Surroundings, out: Exit) -> bool:
        """Whether the way from the ring to the tail, which all leads by that exit share, keeps its distances: if not,
        none of them does, which is one trial instead of one each.
        """
        way = polyline([around.ring.at(out.angle), *out.way])
        is_free = not way.segments or self._obstacles.admits([Track(way, around.bus.width, out.layer)])
        if not is_free:
            self._spend(1)
        return is_free

    def admits(self, branch: Branch) -> bool:
        """Whether a branch's legs keep their distance from what is on the board; its via is at a place that does."""
        return all(map(self._admits, branch.legs))

    def _admits(self, leg: Leg) -> bool:
        if id(leg) not in self._admitted:  # the leg is kept too, so that no other gets its identity
            self._admitted[id(leg)] = leg, not self._runs_into(leg) and self._tried(leg)
        return self._admitted[id(leg)][1]

    def _tried(self, leg: Leg) -> bool:
        """The same by its true geometry, which is a trial."""
        self._spend(1)
        is_free = self._obstacles.admits([leg.track])
        if not is_free:
            self._refused[leg.layer] = self._refused.get(leg.layer, 0) + 1
        return is_free

    def _runs_into(self, leg: Leg) -> bool:
        """Whether a leg runs over a whole piece of the ring road on which no track may: it is refused for certain."""
        if self._refused.get(leg.layer, 0) < PROVED or abs(leg.sweep) < TWO_PI / PIECES:
            return False
        if leg.layer not in self._closed:
            self._closed[leg.layer] = self._closed_pieces(leg)
        ahead = (self._closed[leg.layer] - (leg.angle + min(leg.sweep, 0.0))) % TWO_PI
        return bool(np.any(ahead <= abs(leg.sweep) - TWO_PI / PIECES - 1e-9))

    def _closed_pieces(self, leg: Leg) -> NDArray[np.float64]:
        """Where the pieces of a leg's ring road begin (rad) on which no track of its layer may run."""
        ring, width = leg.around.ring, leg.around.bus.width
        begin = np.linspace(0.0, TWO_PI, PIECES, endpoint=False)
        ways = [ring.along(low, low + TWO_PI / PIECES, True) for low in begin.tolist()]
        return np.asarray(begin[~self._obstacles.admits_each([Track(way, width, leg.layer) for way in ways])])


def _cheapest_pairs(leads_a: BranchTable, leads_b: BranchTable) -> Iterator[tuple[int, int]]:
    """Rows of two leads' branches, by what both together cost."""
    around = leads_a.around
    turns = closing_turns(around.spec.coil, leads_a.round[:, None], leads_b.round[None, :])
    costs = leads_a.cost[:, None] + leads_b.cost[None, :] + closing_cost(turns, around.radius)
    for place in np.argsort(np.round(costs, 9), axis=None, kind="stable").tolist():
        yield divmod(place, len(leads_b.branches))


def _lead_options(
    around: Surroundings, ends: tuple[OuterEnd, OuterEnd], exits: tuple[Exit, Exit], places: list[Hole]
) -> Iterator[Iterator[Branch]]:
    """The ways of a coil's two leads. One from the inside may come out beside the other end, or near there."""
    beside = dict.fromkeys(around.ring.facing(ends[0].point))
    for end, out in zip(ends, exits, strict=True):
        yield _ways_out(around, end, out, places, list(beside))


def _ways_out(
    around: Surroundings, end: OuterEnd, out: Exit, places: list[Hole], beside: list[float]
) -> Iterator[Branch]:
    """The ways from a coil's end to its exit: directly, or by a via where the layers differ.

    The via of a lead from the inside stands where that lead comes out, or not far from there.
    """
    if end.layer == out.layer:
        near = [angle + turned for turned in COMES_OUT for angle in beside]
        for sweep in _sweeps(around, end, out.angle, near):
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
        for to_via in _legs_to(around, end, hole, angle, [out for out in beside if _is_near(out, angle)]):
            for from_via in onward:
                yield Branch((to_via, from_via), hole)


def _is_near(one: float, other: float) -> bool:
    return abs(math.remainder(one - other, TWO_PI)) < NEAR


def _doubles_back(around: Surroundings, out: Exit, sweep: float) -> bool:
    """Whether a lead that comes round the ring by `sweep` (rad) would leave it back over itself."""
    if not sweep:
        return False
    leaves, before = around.ring.at(out.angle), around.ring.at(out.angle - math.copysign(STEP_BACK, sweep))
    beyond = next((point for point in out.way if point.distance(leaves) > 1e-9), leaves)
    return _straightness(before, leaves, beyond) < -SHARPEST


def _straightness(one: Point, corner: Point, other: Point) -> float:
    """The cosine of the angle by which a way turns at a corner."""
    ahead, onward = (corner.x - one.x, corner.y - one.y), (other.x - corner.x, other.y - corner.y)
    return (ahead[0] * onward[0] + ahead[1] * onward[1]) / max(math.hypot(*ahead) * math.hypot(*onward), 1e-30)


def _join_options(around: Surroundings, pair: tuple[OuterEnd, OuterEnd], places: list[Hole]) -> Iterator[Branch]:
    """The ways to join two layers' outer ends by a via outside the winding."""
    for hole in places:
        angle, _ = around.stand(hole)
        others = _legs_to(around, pair[1], hole, angle)
        for one in _legs_to(around, pair[0], hole, angle):
            for other in others:
                yield Branch((one, other), hole, returns=True)


def _legs_to(around: Surroundings, end: OuterEnd, hole: Hole, angle: float, beside: Sequence[float] = ()) -> list[Leg]:
    """The ways from a coil's end to a via that stands beside the ring at an angle."""
    return [
        Leg(around, end.layer, end.point, angle - sweep, sweep, (hole.centre,))
        for sweep in _sweeps(around, end, angle, beside)
    ]


def _sweeps(around: Surroundings, end: OuterEnd, angle: float, beside: Sequence[float] = ()) -> list[float]:
    """Both ways round from an end to an angle; from an inner via straight under the turns, or out at one of the angles
    `beside` and both ways round from there.

    At a corner each way begins on its own side of it, so that no lead bends back sharply.
    """
    if end.from_inside:
        round_ring = (sweep for out in beside for sweep in _both_ways(angle - out))
        return list(dict.fromkeys([0.0, *(sweep for sweep in round_ring if _comes_out(around, end, angle, sweep))]))
    back, on = around.ring.facing(end.point)
    if on - back < 1e-6:
        return _both_ways(angle - on)
    ways = sorted((-((back - angle) % TWO_PI), (angle - on) % TWO_PI), key=abs)
    return [0.0, *ways] if (angle - back) % TWO_PI < on - back else ways


def _comes_out(around: Surroundings, end: OuterEnd, angle: float, sweep: float) -> bool:
    """Whether a lead from the inside that goes round the ring by `sweep` up to an angle meets the ring without bending
    back sharply.
    """
    meets, onward = (around.ring.at(angle - sweep + ahead) for ahead in (0.0, math.copysign(STEP_BACK, sweep)))
    return _straightness(end.point, meets, onward) > -BENT_BACK


def _both_ways(turn: float) -> list[float]:
    short = math.remainder(turn, TWO_PI)
    if abs(short) < 1e-6:
        return [0.0]
    return [short, short - math.copysign(TWO_PI, short)]


def _sorted(branches: Iterable[Branch]) -> list[Branch]:
    return sorted(branches, key=lambda branch: round(branch.cost, 9))
