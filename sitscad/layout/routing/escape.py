"""Search for the tracks outside one coil: joins between layers, and leads around the coil to their lanes.

The lead ring is the closed path around the coil, next to its outermost turn. Each connection may go around it in either
sense, and each outer via may have several positions. The search considers all combinations that keep the design rules'
clearances. It takes the combination whose leads link the smallest part of the winding's flux (see `branches`). Among
equal combinations, it takes the shortest.
Connections of one coil are compared by their angle ranges on the lead ring, which is cheap. They are compared with
other copper by their exact geometry. The limit of a search is a number of trials, not a time, so every computer finds
the same board.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import product

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.geometry.path import TWO_PI, Point, polyline
from sitscad.layout.clearance import Obstacles, TrackToPlace, ViaToPlace
from sitscad.layout.lanes import BENT_BACK, Exit, straightness
from sitscad.layout.routing.branches import (
    Branch,
    BranchGround,
    BranchTable,
    Leg,
    OuterEnd,
    branch_table,
    closing_cost,
    closing_turns,
    counted,
    least_closing,
)

TRIALS_OF_A_WAVE = 50  # Cost, in trials, of a search for the paths through the array to one coil
"""Number of trial connections that are charged for one maze search of one coil."""

BUDGET = 16_000
"""Largest number of trial connections for all searches of one board: a few seconds.

Of 329 random boards with complete routing (tests/validation/random_boards.py, tests/benchmarks/check_times.py), ten
took over 4,000 trials, two over 8,000, and one 13,699.
"""

MAX_TRIALS_WITHOUT_PROGRESS = 4_000
"""Number of trials without progress after which the searches end while two or more coils have no leads.

Progress is a board on which more coils have leads than before. Of 112 boards of four layers or more with complete
routing (random_boards.py, seeds 0 to 449), none made progress after more than 3,209 trials.
"""


class SearchLimit:
    """Remaining number of trial connections for one board.

    `left` is this number. `stuck` is the index of the coil that remained without leads on the last trial board. None if
    each coil had leads.
    """

    def __init__(self, budget: int = BUDGET) -> None:
        self.left = budget
        self.stuck: int | None = None
        self._missing, self._since = 0, budget

    def begin(self, coils: int) -> None:
        """Start the routing of a board with `coils` coils."""
        self._missing, self._since = coils, self.left

    def led_out(self, coils: int, of: int) -> None:
        """Record that `coils` coils of the current trial board have leads. The board has `of` coils."""
        if of - coils < self._missing:
            self._missing, self._since = of - coils, self.left

    @property
    def is_lost(self) -> bool:
        """Whether two or more coils still lack leads after `MAX_TRIALS_WITHOUT_PROGRESS` trials without progress."""
        return self._missing > 1 and self._since - self.left >= MAX_TRIALS_WITHOUT_PROGRESS

    @property
    def is_spent(self) -> bool:
        """Whether no further search may begin: the trials are used up, or there was no progress."""
        return self.left <= 0 or self.is_lost

    @property
    def is_overdrawn(self) -> bool:
        """Whether a running search must end: more trials were made than permitted, or there was no progress."""
        return self.left < 0 or self.is_lost

    @contextmanager
    def at_most(self, most: int) -> Iterator[None]:
        """Limit the searches within a context to at most `most` further trials."""
        reserve = max(0, self.left - most)
        self.left -= reserve
        yield
        self.left += reserve


TRIALS = 2_000
"""Largest number of trial connections in the search for one coil.

Successful searches for 1,000 coils took at most 1,100.
"""

QUICK = 100
"""Number of trials for each pair of candidate beginnings in a search that accepts the first solution.

If no pair gives a solution, the search is repeated with the full number of trials.
"""

PIECES = 48  # Number of pieces of the lead ring that are marked open or closed to tracks
"""Number of equal pieces of the lead ring that are marked as open or closed to tracks."""
REFUSED_LEGS_BEFORE_MARKING = 8  # Refused legs on a layer before the pieces are marked: most searches succeed earlier
"""Number of refused tracks on a layer after which the pieces of the lead ring are marked."""
NEGLIGIBLE_ARC_TURNS = 0.04  # Excess (turns) of a closing arc that counts as none
"""Largest excess of the leads' path around the coil over the necessary minimum (turns) that counts as 0."""

INSIDE = 0.1
"""Number of turns by which leads may run around a coil with an odd number of layers without counting as excess.

One lead of such a coil begins inside the coil, and may have to pass inner vias.
"""

INSIDE_LEAD_ANGLES = tuple(math.radians(degrees) for degrees in (0, 10, -10, 20, -20, 30, -30, 45, -45))
"""Angles (rad), from the outer end of the winding, at which a lead from inside may come out from under the turns.

Some angles compensate the flux through the area between the lead and the coil's centre. Others avoid an inner via.
"""

NEAR = math.radians(60.0)
"""Largest angle (rad) about the coil's centre between an inside lead's via and the beginning of its lane.

The via may also be within this angle of the place where the lead comes out from under the turns.
"""

STEP_BACK = 1e-3  # Step back on the ring (rad) for the ring's direction
"""Step (rad) along the lead ring for the finite difference that gives its direction."""

SHARPEST = math.cos(math.radians(40.0))
"""Cosine of the smallest permitted angle between a lead and the lead ring.

With a smaller angle, their copper overlaps.
"""

Joined = dict[tuple[tuple[OuterEnd, OuterEnd], tuple[Point, ...]], BranchTable]
"""Cache of connections that join two layer ends, by these ends and the possible positions of a via.

Successive trial boards share it.
"""


@record
class Escape:
    """The tracks and vias outside one coil, up to the tail.

    `joins` connect the coil's layers with each other. `lead_a` and `lead_b` are the leads from the coil's ends A and B.
    """

    joins: tuple[Branch, ...]
    lead_a: Branch
    lead_b: Branch

    @property
    def branches(self) -> tuple[Branch, ...]:
        """All connections: joins, lead A and lead B."""
        return (*self.joins, self.lead_a, self.lead_b)

    @property
    def entries(self) -> tuple[Point, Point]:
        """Points at which the two leads enter the tail's funnel."""
        return self.lead_a.legs[-1].track.path.end, self.lead_b.legs[-1].track.path.end

    @property
    def closing(self) -> float:
        """Total turns of leads and joins around the coil, positive in the winding's sense."""
        around = self.lead_a.legs[0].around
        joins = math.fsum(join.round for join in self.joins)
        return float(closing_turns(around.coil, self.lead_a.round, self.lead_b.round + joins))

    @property
    def excess(self) -> float:
        """Turns by which the leads run around the coil beyond the least possible number, weighted as in `closing_cost`.

        At least 0.
        """
        coil = self.lead_a.legs[0].around.coil
        least = INSIDE if len(coil.layers) % 2 else float(counted(least_closing(coil)))
        return max(0.0, float(counted(self.closing)) - least)

    @property
    def cost(self) -> float:
        """Cost as a length (m): tracks, vias as in `Branch.cost`, and the cost of turns around the coil."""
        radius = self.lead_a.legs[0].around.radius
        return sum(branch.cost for branch in self.branches) + float(closing_cost(self.closing, radius))


def escape(
    around: BranchGround, joins: list[tuple[OuterEnd, OuterEnd]], ends: tuple[OuterEnd, OuterEnd],
    choices: Iterable[tuple[Exit, Exit]], obstacles: Obstacles, searches: SearchLimit, first: bool = False,
    cache: Joined | None = None,
) -> Escape | None:
    """Return the cheapest tracks of one coil that keep all clearances. None if the search finds none.

    `joins` are the pairs of layer ends to connect. `ends` are the two layer ends with leads, and `choices` pairs of
    candidate beginnings of their lanes. If `first` is True, the result is the first solution whose leads run no farther
    around the coil than necessary. `cache` holds joins from earlier trial boards.
    """
    places = obstacles.admitted(list(around.via_places()))
    search = _BranchSearch(obstacles, searches)
    cache = {} if cache is None else cache
    via_centres = tuple(hole.centre for hole in places)
    best: Escape | None = None
    hard: list[list[BranchTable]] = []
    for exits in choices:
        if not all(search.lets_out(around, out) for out in exits):
            continue
        tables = search.lead_tables(around, ends, exits, places)
        if tables is None:
            continue
        for pair in joins:
            if (pair, via_centres) not in cache:
                legs = ((hole, [_legs_to_via(around, end, hole) for end in pair]) for hole in places)
                pairs = ((hole, pair_of_legs) for hole, legs_of in legs for pair_of_legs in product(*legs_of))
                branches = [Branch(pair_of_legs, hole, returns=True) for hole, pair_of_legs in pairs]
                cache[pair, via_centres] = branch_table(around, cheapest_first(branches))
            tables.append(cache[pair, via_centres])
        candidate = search.find(tables, QUICK if first else TRIALS)
        if candidate is None and search.gave_up:
            hard.append(tables)
        if candidate is not None and (best is None or candidate.cost < best.cost - 1e-6):
            best = candidate
        if first and best is not None and best.excess < NEGLIGIBLE_ARC_TURNS:
            return best
    for tables in hard if first and best is None else ():
        best = search.find(tables, TRIALS)
        if best is not None:
            return best
    return best


def cheapest_first(branches: Iterable[Branch]) -> list[Branch]:
    """Return connections in the order of cost. Connections of nearly equal cost keep their order."""
    return sorted(branches, key=lambda branch: round(branch.cost, 9))


class _BranchSearch:
    """Depth-first search for one connection per table, cheapest first.

    Sets hold the connections that are still possible.
    """

    def __init__(self, obstacles: Obstacles, searches: SearchLimit) -> None:
        self._obstacles = obstacles
        self._admitted: dict[int, tuple[Leg, bool]] = {}
        self._exact: dict[tuple[int, int], bool] = {}
        self._single: dict[int, Obstacles] = {}
        self._barred: dict[int, int] = {}
        self._refused: dict[int, int] = {}
        self._closed: dict[int, Array] = {}
        self._asked: list[Sequence[BranchTable]] = []
        self._searches = searches
        self._total = self._left = TRIALS
        self.gave_up = False

    def lead_tables(
        self, around: BranchGround, ends: tuple[OuterEnd, OuterEnd], exits: tuple[Exit, Exit], places: list[ViaToPlace]
    ) -> list[BranchTable] | None:
        """Return the possible connections of both leads, the cheapest first. None if one lead has no permitted path.

        A lead from inside the coil may come out from under the turns at the angle of the other layer end, or near it.
        """
        beside = list(dict.fromkeys(around.ring.facing(ends[0].point)))
        leads = []
        for end, out in zip(ends, exits, strict=True):
            leads.append(cheapest_first(_ways_out(around, end, out, places, beside)))
            if not any(map(self.admits, leads[-1])):
                return None
        return [branch_table(around, options) for options in leads]

    def find(self, tables: Sequence[BranchTable], most: int) -> Escape | None:
        """Return one connection per table, leads first, so that all keep their clearances. None if there are none.

        Also None, with `gave_up` set, if `most` trials are exceeded.
        """
        self._asked.append(tables)  # what is remembered goes by identity, so the tables have to live on
        self._left = min(most, self._total)
        self.gave_up = False
        leads_a, leads_b, *joins = tables
        for row_a, row_b in _cheapest_pairs(leads_a, leads_b):
            pair = leads_a.branches[row_a], leads_b.branches[row_b]
            if not self.admits(pair[0]) or not leads_b.beside_branch(leads_a, row_a) >> row_b & 1:
                continue
            remaining = [table.beside_branch(leads_a, row_a) & table.beside_branch(leads_b, row_b) for table in joins]
            if not all(remaining) or not self.admits(pair[1]) or not self._clear(pair[1], pair[0]):
                continue
            chosen = self._combine(joins, remaining, pair) if self._goes_on() else None
            if chosen is not None:
                return Escape(chosen[2:], *pair)
            if self.gave_up:
                return None
        return None

    def _combine(
        self, tables: Sequence[BranchTable], remaining: list[int], chosen: tuple[Branch, ...]
    ) -> tuple[Branch, ...] | None:
        """Return `chosen` and one connection per remaining table, so that all keep their clearances.

        None if there are none. `remaining` holds a bit set of possible connections for each table.
        """
        if not tables:
            return chosen
        options = remaining[0] & ~self._barred.get(id(tables[0]), 0)
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
            later = zip(remaining[1:], tables[1:], strict=True)
            after = [mask & other.beside_branch(tables[0], row) for mask, other in later]
            complete = self._combine(tables[1:], after, (*chosen, branch)) if all(after) else None
            if complete is not None:
                return complete
        return None

    def _clear(self, branch: Branch, other: Branch) -> bool:
        """Whether two connections keep the fabricator's clearance.

        Their exact geometry is compared. Their angle ranges on the lead ring do not include the bends where they leave
        the ring.
        """
        key = (id(branch), id(other))
        if key not in self._exact:
            if id(other) not in self._single:
                rules = other.legs[0].around.artwork.fpc.rules
                self._single[id(other)] = Obstacles(rules, rules.trace_spacing)
                self._single[id(other)].add(other.tracks, other.holes)
            self._exact[key] = self._single[id(other)].admits(branch.tracks, branch.holes)
        return self._exact[key]

    def _goes_on(self) -> bool:
        """Count a trial, and return whether the search may continue."""
        self._spend()
        self.gave_up = self._left < 0 or self._searches.is_overdrawn
        return not self.gave_up

    def _spend(self) -> None:
        self._left -= 1
        self._total -= 1
        self._searches.left -= 1

    def lets_out(self, around: BranchGround, out: Exit) -> bool:
        """Whether the path of `out` from the lead ring to the tail is free of other copper and of the coil's own turns.

        All candidate leads with this beginning share the path. If it is blocked, only one trial is counted.
        """
        way = polyline([around.ring.at(out.angle), *out.way])
        track = TrackToPlace(way, around.bus.width, out.layer)
        is_free = not way.segments or (around.own_turns.admits([track]) and self._obstacles.admits([track]))
        if not is_free:
            self._spend()
        return is_free

    def admits(self, branch: Branch) -> bool:
        """Whether the tracks of a connection keep their clearances to copper on the board.

        Its via is already checked.
        """
        for leg in branch.legs:
            if id(leg) not in self._admitted:  # the leg is kept too, so that no other gets its identity
                self._admitted[id(leg)] = leg, self._is_free(leg)
            if not self._admitted[id(leg)][1]:
                return False
        return True

    def _is_free(self, leg: Leg) -> bool:
        """Whether a track keeps its clearances to copper on the board, by its exact geometry.

        The comparison counts as a trial, unless the track covers a closed piece of the lead ring.
        """
        if self._runs_into(leg):
            return False
        self._spend()
        is_free = self._obstacles.admits([leg.track])
        if not is_free:
            self._refused[leg.layer] = self._refused.get(leg.layer, 0) + 1
        return is_free

    def _runs_into(self, leg: Leg) -> bool:
        """Whether a track covers a whole piece of the lead ring that is closed to tracks."""
        piece, layer = TWO_PI / PIECES, leg.layer
        if self._refused.get(layer, 0) < REFUSED_LEGS_BEFORE_MARKING or abs(leg.sweep) < piece:
            return False
        if layer not in self._closed:  # where the pieces begin (rad) on which no track of the layer may run
            ring, begin = leg.around.ring, np.linspace(0.0, TWO_PI, PIECES, endpoint=False)
            roads = (ring.along(low, low + piece, True) for low in begin.tolist())
            tracks = [TrackToPlace(road, leg.around.bus.width, layer) for road in roads]
            self._closed[layer] = begin[~self._obstacles.admits_each(tracks)]
        ahead = (self._closed[layer] - (leg.angle + min(leg.sweep, 0.0))) % TWO_PI
        return bool(np.any(ahead <= abs(leg.sweep) - piece - 1e-9))


def _cheapest_pairs(leads_a: BranchTable, leads_b: BranchTable) -> Iterator[tuple[int, int]]:
    """Yield (row, row) of the connections of leads A and B, in the order of their joint cost."""
    around = leads_a.around
    turns = closing_turns(around.coil, leads_a.round[:, None], leads_b.round[None, :])
    costs = leads_a.cost[:, None] + leads_b.cost[None, :] + closing_cost(turns, around.radius)
    for place in np.argsort(np.round(costs, 9), axis=None, kind="stable").tolist():
        yield divmod(place, len(leads_b.branches))


def _ways_out(
    around: BranchGround, end: OuterEnd, out: Exit, places: list[ViaToPlace], beside: list[float]
) -> Iterator[Branch]:
    """Yield possible paths of a lead: directly, or by a nearby via if the layers of `end` and `out` differ.

    `end` is the layer end of the winding, and `out` the beginning of the lane. `beside` are angles (rad) at which a
    lead from inside may come out.
    """
    if end.layer == out.layer:
        near = [angle + turned for turned in INSIDE_LEAD_ANGLES for angle in beside]
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
        near = [place for place in beside if abs(math.remainder(place - angle, TWO_PI)) < NEAR]
        for to_via in _legs_to_via(around, end, hole, near):
            for from_via in onward:
                yield Branch((to_via, from_via), hole)


def _doubles_back(around: BranchGround, out: Exit, sweep: float) -> bool:
    """Whether a lead that comes along the lead ring by `sweep` (rad) would leave it at too sharp an angle."""
    if not sweep:
        return False
    leaves, before = around.ring.at(out.angle), around.ring.at(out.angle - math.copysign(STEP_BACK, sweep))
    beyond = next((point for point in out.way if point.distance(leaves) > 1e-9), leaves)
    return straightness(before, leaves, beyond) < -SHARPEST


def _legs_to_via(around: BranchGround, end: OuterEnd, hole: ViaToPlace, beside: Sequence[float] = ()) -> list[Leg]:
    """Return the possible paths from a layer end to a via beside the lead ring."""
    angle, _ = around.stand(hole)
    sweeps = _sweeps(around, end, angle, beside)
    return [Leg(around, end.layer, end.point, angle - sweep, sweep, (hole.centre,)) for sweep in sweeps]


def _sweeps(around: BranchGround, end: OuterEnd, angle: float, beside: Sequence[float] = ()) -> list[float]:
    """Return the angles (rad, signed) around the lead ring from a layer end to `angle`, in both senses.

    From an inner via, the lead runs straight under the turns, or comes out at one of the angles `beside` and continues
    on the lead ring from there. Its bend at the lead ring must not be sharp. If the end is at a corner, each sense
    begins on its own side of the corner, so that no lead bends back sharply.
    """
    if end.from_inside:
        sweeps = [0.0]
        for sweep in (sweep for out in beside for sweep in _both_ways(angle - out)):
            meets, onward = (around.ring.at(angle - sweep + ahead) for ahead in (0.0, math.copysign(STEP_BACK, sweep)))
            if straightness(end.point, meets, onward) > -BENT_BACK:
                sweeps.append(sweep)
        return list(dict.fromkeys(sweeps))
    back, on = around.ring.facing(end.point)
    if on - back < 1e-6:
        return _both_ways(angle - on)
    sweeps = sorted((-((back - angle) % TWO_PI), (angle - on) % TWO_PI), key=abs)
    return [0.0, *sweeps] if (angle - back) % TWO_PI < on - back else sweeps


def _both_ways(turn: float) -> list[float]:
    short = math.remainder(turn, TWO_PI)
    if abs(short) < 1e-6:
        return [0.0]
    return [short, short - math.copysign(TWO_PI, short)]
