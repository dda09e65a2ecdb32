"""A study at work: candidates drawn generation by generation, each evaluated once on both levels, and their costs.

Candidates depend on the seed and on the costs that the search was told, never on who computed them, nor in which order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from heapq import nsmallest
from importlib.util import find_spec
from itertools import islice
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.apps.study.document import ALL, Asked
from sitscad.apps.study.evaluating import IN_FULL, Workers
from sitscad.apps.study.evaluation import FULL, SCREEN, Archive, Breach, Evaluation, UnitJudged
from sitscad.apps.study.measures import MEASURES
from sitscad.apps.study.space import Point, Space
from sitscad.apps.study.spreads import DRAWS, draws, judge_units
from sitscad.assembly.solids import MissingExtra
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.checks.judging import all_rules
from sitscad.checks.policy import stands_for
from sitscad.data import rows

POPULATION = 64
GENERATION = 4096
"""Designs of a grid or a Sobol' set that workers have at once, all of them before the next ones."""

LEAST_SOBOL, MOST_SOBOL = 32, 1024
"""Designs with which a search begins: a quarter of all, as a power of two between these."""


@record
class Costs:
    """What a point costs: its goals as figures to make small (None where it has them not), and how far it lies beyond
    what is required, 0 where it keeps all.
    """

    goals: tuple[float | None, ...]
    violation: float


Evaluate = Callable[[list[Point]], list[Costs]]
"""Says what points cost, each of which it is asked about once."""


def method_for(asked: str, space: Space, evaluations: int, goals: int) -> str:
    """The method that a study uses: what it names, else the grid where that is no more than it may evaluate."""
    if asked != "auto":
        return asked
    if space.size <= evaluations:
        return "grid"
    return "nsga2" if find_spec("pymoo") is not None else "de" if goals == 1 else "sobol"


def search(
    method: str, space: Space, evaluations: int, seed: int, goals: int, evaluate: Evaluate, begin: Sequence[Point] = ()
) -> None:
    """Ask `evaluate` about points of a method, so many in all at most, equal ones once; first about those to `begin`
    with.
    """
    if method in ("grid", "sobol"):
        further = space.points() if method == "grid" else sobol_set(space, evaluations, seed)
        _in_turn(_distinct((*begin, *islice(further, evaluations)), evaluations), evaluate)
        return
    first = first_set(space, evaluations, seed, begin)
    known = dict(zip(first, _in_turn(first, evaluate), strict=True))
    go_on = _nsga2 if method == "nsga2" else _differential_evolution
    go_on(space, evaluations, seed, goals, known, evaluate)


def first_set(space: Space, evaluations: int, seed: int, begin: Sequence[Point] = ()) -> list[Point]:
    """The points with which a search of so many evaluations begins."""
    count = 2 ** max(0, (evaluations // 4).bit_length() - 1)
    drawn = sobol_set(space, min(max(count, LEAST_SOBOL), MOST_SOBOL, evaluations), seed)
    return _distinct((*begin, *drawn), evaluations)


def _distinct(points: Iterable[Point], most: int) -> list[Point]:
    """The first points, equal ones once."""
    return list(dict.fromkeys(points))[:most]


def _in_turn(points: Sequence[Point], evaluate: Evaluate) -> list[Costs]:
    parts = (list(points[k : k + GENERATION]) for k in range(0, len(points), GENERATION))
    return [cost for part in parts for cost in evaluate(part)]


def sobol_set(space: Space, count: int, seed: int) -> list[Point]:
    """Points of a scrambled Sobol' set, equal ones once: as many as there are among `count` of its rows."""
    from scipy.stats import qmc  # only searches

    size = 2 ** max(0, (count - 1).bit_length())  # a power of two keeps its balance
    rows = qmc.Sobol(len(space.shape), scramble=True, rng=seed).random(size)[:count]
    shape = np.array(space.shape)
    found = np.minimum((rows * shape).astype(int), shape - 1)
    return list(dict.fromkeys(tuple(map(int, row)) for row in found))


WORST = 1e30
"""Stands for a goal that a point does not have: it is beyond what is required, too."""


def _figures(costs: Sequence[Costs]) -> tuple[Array, Array]:
    """Goals (n, goals) and violations (n, 1) as arrays."""
    goals = np.array([[WORST if value is None else value for value in one.goals] for one in costs])
    return goals, np.array([one.violation for one in costs]).reshape(-1, 1)


def _nsga2(
    space: Space, evaluations: int, seed: int, goals: int, known: dict[Point, Costs], evaluate: Evaluate
) -> None:
    """NSGA-II (Deb 2002) on the numbers of the values, begun with the best of what is known."""
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import Problem
        from pymoo.operators.crossover.sbx import SBX
        from pymoo.operators.mutation.pm import PM
        from pymoo.operators.repair.rounding import RoundingRepair
        from pymoo.problems.static import StaticProblem
    except ImportError as error:
        raise MissingExtra(f"method: nsga2 needs pymoo ({error}): pip install 'sitscad[design]'") from error

    low, high = np.zeros(len(space.shape)), np.array(space.shape) - 1
    problem = Problem(n_var=len(low), n_obj=goals, n_ieq_constr=1, xl=low, xu=high, vtype=int)
    whole: Any = {"vtype": float, "repair": RoundingRepair()}
    size = min(POPULATION, max(8, evaluations // 8))
    algorithm = NSGA2(pop_size=size, sampling=np.array(_best(known, size)), crossover=SBX(prob=0.9, eta=10, **whole),
                      mutation=PM(eta=10, **whole), eliminate_duplicates=True)
    algorithm.setup(problem, termination=("n_gen", evaluations), seed=seed, verbose=False)
    still = 0
    while len(known) < evaluations and still < STILL:
        asked = algorithm.ask()
        if asked is None or not len(asked):
            return
        points = [tuple(map(int, row)) for row in np.rint(asked.get("X"))]
        still = 0 if _ask(points, evaluations, known, evaluate) else still + 1
        nothing = Costs((None,) * goals, WORST)  # beyond what may be evaluated: told as the worst, and asked no more
        values, violations = _figures([known.get(point, nothing) for point in points])
        algorithm.evaluator.eval(StaticProblem(problem, F=values, G=violations), asked)
        algorithm.tell(infills=asked)


STILL = 50
"""Generations without a new design after which there is nothing left to find."""


def _ask(points: Sequence[Point], evaluations: int, known: dict[Point, Costs], evaluate: Evaluate) -> int:
    """Evaluate those of some points that are not known, as long as there are evaluations left; how many these were."""
    new = [point for point in dict.fromkeys(points) if point not in known][: evaluations - len(known)]
    if new:
        known |= dict(zip(new, evaluate(new), strict=True))
    return len(new)


def _best(known: dict[Point, Costs], size: int) -> list[Point]:
    """The points that a population begins with: those that keep most, and of these those that cost least, front by
    front.
    """
    points = list(known)
    ranks = ranked([known[point] for point in points])
    return [points[k] for k in np.argsort(ranks, kind="stable")[:size]]


def ranked(costs: Sequence[Costs], wanted: int | None = None) -> NDArray[np.int64]:
    """The front that each point is on, from 0: those that keep what is required by their goals, all others behind
    these by their violation. Once `wanted` points have their front, the others of those share the next one.
    """
    goals, violations = _figures(costs)
    ranks = np.full(len(costs), -1, dtype=np.int64)
    good, front = np.flatnonzero(violations[:, 0] <= 0.0), 0
    while len(good):
        is_enough = wanted is not None and np.count_nonzero(ranks >= 0) >= wanted
        first = np.ones(len(good), dtype=bool) if is_enough else _unbeaten(goals[good])
        ranks[good[first]] = front
        good, front = good[~first], front + 1
    bad = np.flatnonzero(ranks < 0)
    ranks[bad[np.argsort(violations[bad, 0], kind="stable")]] = front + np.arange(len(bad))
    return ranks


def _unbeaten(values: Array) -> Flags:
    """Which rows (n, goals; less is better) no other one beats: in the order of their goals, one can be beaten by those
    before it alone. It takes as many passes as there are such rows.
    """
    left, found = np.lexsort(values.T[::-1]), np.zeros(len(values), dtype=bool)
    while len(left):
        own, found[left[0]] = values[left[0]], True
        others = values[left[1:]]
        left = left[1:][np.any(others < own, axis=1) | np.all(others == own, axis=1)]
    return found


class _SpentError(Exception):
    """As many designs were evaluated as may be."""


REFUSED = 1e12
"""Cost of a design that lies beyond what is required, and more by how far: above all goals in SI units."""


def _differential_evolution(
    space: Space, evaluations: int, seed: int, goals: int, known: dict[Point, Costs], evaluate: Evaluate
) -> None:
    """Differential evolution (Storn and Price 1997) on the numbers of the values, begun with the best that is known."""
    from scipy.optimize import differential_evolution

    bounds, size = [(0, count - 1) for count in space.shape], min(32, max(8, evaluations // 8), len(known))
    free = [k for k, (low, high) in enumerate(bounds) if high > low]
    still = 0

    def cost(columns: Array) -> Array:
        nonlocal still
        points = []
        for row in np.rint(columns.T).astype(int):
            point = [0] * len(bounds)
            for k, value in zip(free, row, strict=True):
                point[k] = int(value)
            points.append(tuple(point))
        still = 0 if _ask(points, evaluations, known, evaluate) else still + 1
        if still >= STILL or any(point not in known for point in points):
            raise _SpentError
        return np.array([_single(known[point]) for point in points])

    start = np.array(_best(known, size), dtype=float)[:, free]
    if len(start) < 5 or not free:
        return
    with suppress(_SpentError):
        differential_evolution(
            cost, [bounds[k] for k in free], init=start, integrality=np.ones(len(free), dtype=bool), rng=seed,
            vectorized=True, updating="deferred", polish=False, tol=0.0, maxiter=evaluations,
        )


def _single(cost: Costs) -> float:
    """What a design of one goal costs."""
    goal = cost.goals[0]
    return REFUSED * (1.0 + cost.violation) if cost.violation > 0.0 or goal is None else goal


IN_VAIN = "SIT020"
"""Warns of a comment that silences nothing: it is taken out of a kept design, and held against none."""

LEAST_FULL = 24
"""Designs that are judged in full at least, where there are so many; four times those that are kept if that is more."""

MOST_FRONT = 256
"""Designs of the front that are judged in full at most: those beyond are in the archive alone."""

MOST_AT_ONCE = 8
"""Designs of one generation that are judged in full while searching."""

MOST_ROUNDS = 4
"""How often designs are judged in full that the screen has on the front once those before fell."""

MOST_IN_VAIN = 8
"""How often so where none of them keeps everything yet."""

MANY = 8
"""Designs with one value that fell in full, and none that did not, from which on others without that value go first."""


@record
class StudyState:
    """How far a study is: what it does, designs (or units) done of all, as far as it is known how many there will be,
    those that keep everything, and the best of each goal; how many this run `made` and did not find in its archive.
    """

    stage: str
    done: int
    of: int
    feasible: int
    best: Mapping[str, float]
    made: int


Progress = Callable[[StudyState], None]


@dataclass
class Found:
    """Everything that was evaluated: points in the order in which they were drawn, by level, in both where there is no
    screen; how many evaluations were `reused` from the archive, and how many of its lines are `damaged`.
    """

    asked: Asked
    method: str
    screened: dict[Point, Evaluation] = field(default_factory=dict)
    full: dict[Point, Evaluation] = field(default_factory=dict)
    reused: int = 0
    damaged: int = 0

    @property
    def unscreened(self) -> int:
        """How many designs have no screen, and were judged in full in its place."""
        return sum(one.level == FULL for one in self.screened.values())

    def of(self, point: Point) -> Evaluation:
        """The best that is known of a point."""
        return self.full.get(point) or self.screened[point]


LEAST_RANK = 0.98
"""Rank correlation (Spearman) with the full level from which on the screen ranks designs by a measure."""


@cache
def unranked() -> frozenset[str]:
    """The measures by which it does not."""
    return frozenset(row["measure"] for row in rows("screen_errors") if row["rank"] and float(row["rank"]) < LEAST_RANK)


def violations(asked: Asked, found: Evaluation) -> dict[str, Breach]:
    """What a design breaks: rules with errors, warnings that may not stay, and requirements of the study; a measure
    that is asked for and that it does not have is broken, too, but for what only the full level has. Of a design that
    cannot be drawn nothing else is known, and nothing else is broken.
    """
    broken = dict(found.refused)
    if is_unmade(broken):
        return broken
    names = {rule.id: rule.name for rule in all_rules()} if found.warned else {}
    broken |= {rule: breach for rule, breach in found.warned.items() if rule != IN_VAIN and not any(
        word == ALL or stands_for(word, rule, names.get(rule, "")) for word in asked.accept)}
    for one in asked.require:
        if one.measure == "yield":
            continue
        value, unit = found.values.get(one.measure), MEASURES[one.measure].unit
        if found.absent.get(one.measure) == IN_FULL:
            continue
        if value is None or not one.holds(value[0]):
            broken[one.measure] = Breach(None if value is None else value[0], one.limit, unit)
        elif (sigma := found.values.get(f"sigma.{one.measure}")) is not None and asked.least_yield is not None:
            far = NormalDist().inv_cdf(asked.least_yield) * sigma[0]
            worst = value[0] - far if one.is_floor else value[0] + far
            if not one.holds(worst):  # so many units would not keep it: to first order, each limit by itself
                broken[f"yield by {one.measure}"] = Breach(worst, one.limit, unit)
    if not broken:
        lacking = [goal.measure for goal in asked.goals
                   if goal.measure not in found.values and found.absent.get(goal.measure) != IN_FULL]
        broken |= dict.fromkeys(lacking, Breach())
    return broken


def costs(asked: Asked, found: Evaluation) -> Costs:
    """What a design costs the search."""
    goals = tuple(goal.cost(found.values[goal.measure][0]) if goal.measure in found.values else None
                  for goal in asked.goals)
    unmade = NOT_MADE if is_unmade(found.refused) else 0.0
    return Costs(goals, unmade + sum(breach.size for breach in violations(asked, found).values()))


def is_unmade(broken: Iterable[str]) -> bool:
    """Whether a rule of the spec itself is broken, so that nothing can be drawn and no other rule asked."""
    return any(name.startswith("SIT0") and name != IN_VAIN for name in broken)


NOT_MADE = 100.0
"""What a design weighs beside its breaches that cannot be drawn at all: more than any that can."""


@dataclass
class LevelTally:
    """Counts the evaluations of a level, and tells how far it is after each that is made."""

    asked: Asked
    level: str
    of: int
    progress: Progress
    done: int = 0
    good: int = 0
    made: int = 0
    best: dict[str, float] = field(default_factory=dict)

    def note(self, one: Evaluation, is_made: bool) -> None:
        """Count one."""
        self.done += 1
        if not violations(self.asked, one):
            self.good += 1
            for goal in (goal for goal in self.asked.goals if goal.measure in one.values):
                value = one.values[goal.measure][0]
                self.best[goal.measure] = min(self.best.get(goal.measure, value), value, key=goal.cost)
        self.made += is_made
        if is_made:
            of = max(self.of, self.done)
            self.progress(StudyState(self.level, self.done, of, self.good, dict(self.best), self.made))


class StudyRun:
    """One study with its workers, its archive and whom it tells how far it is."""

    def __init__(self, asked: Asked, workers: Workers, archive: Archive, progress: Progress | None = None) -> None:
        self._asked, self._workers, self._archive = asked, workers, archive
        self._progress = progress or (lambda state: None)
        self._costs: dict[Point, Costs] = {}
        total = min(asked.evaluations, asked.space.size)
        self._told = {level: LevelTally(asked, level, of, self._progress) for level, of in ((SCREEN, total), (FULL, 0))}
        self.found = Found(asked, method_for(asked.method, asked.space, asked.evaluations, len(asked.goals)),
                           damaged=archive.damaged)

    def evaluate(self, points: Sequence[Point], level: str) -> None:
        """Evaluate points on a level, each once. What the archive has is taken from there."""
        kept = self.found.full if level == FULL else self.found.screened
        base, measures = self._asked.base, self._asked.measures
        changes = {point: self._asked.space.changes(point) for point in points if point not in kept}
        keys = {point: base.key(changes[point], level) for point in changes}
        found = {point: self._archive.evaluation(key, measures) for point, key in keys.items()}
        missing = [point for point, one in found.items() if one is None]
        self.found.reused += len(found) - len(missing)
        for one in filter(None, found.values()):
            self._told[level].note(one, is_made=False)
        made = self._workers.evaluations([changes[point] for point in missing], measures, level)
        for point, one in zip(missing, made, strict=True):
            self._archive.add(keys[point], changes[point], one.as_json())
            found[point] = self._archive.evaluation(keys[point], measures)  # as it is read by a run that goes on
            self._told[level].note(one, is_made=True)
        for point, evaluation in found.items():
            if evaluation is None:
                continue
            kept[point] = evaluation
            if evaluation.level == FULL:
                self.found.full[point] = evaluation
            self._costs[point] = costs(self._asked, evaluation)

    def search(self) -> None:
        """Screen designs as the method draws them, judging in full what comes to the front; then all that may be on it,
        until it stands; those with values of which many fell so come last.
        """
        asked = self._asked
        count = min(asked.evaluations, asked.space.size)
        search(self.found.method, asked.space, count, asked.seed, len(asked.goals), self._costs_of, [asked.base_point])
        in_vain = rounds = 0
        while rounds < MOST_ROUNDS and in_vain < MOST_IN_VAIN:
            good, doubtful = self._good(), self._doubtful()
            likely = [point for point in good if point in self.found.full or doubtful.isdisjoint(enumerate(point))]
            on_front = np.count_nonzero(ranked([self._costs[point] for point in good], 1) == 0)
            count = max(LEAST_FULL, 4 * asked.keep, min(MOST_FRONT, int(on_front)))
            first = (point for points in (likely, good) for point in self.best(count, points))
            wanted = list(dict.fromkeys(point for point in first if point not in self.found.full))[:count]
            if not wanted:
                break
            self._told[FULL].of = self._told[FULL].done + len(wanted)
            self.evaluate(wanted, FULL)
            is_in_vain = bool(good) and not any(self._costs[point].violation <= 0.0 for point in self.found.full)
            in_vain, rounds = in_vain + is_in_vain, rounds + (not is_in_vain)

    def _doubtful(self) -> set[tuple[int, int]]:
        """Keys with values (numbers of both) of which many designs that the screen let pass were judged in full and all
        fell, by rules that it cannot ask. A key all of whose values are such says nothing.
        """
        fell, sound = Counter[tuple[int, int]](), set[tuple[int, int]]()
        for point, one in self.found.full.items():
            if not violations(self._asked, one):
                sound.update(enumerate(point))
            elif not violations(self._asked, self.found.screened.get(point, one)):
                fell.update(enumerate(point))
        found = {at for at, count in fell.items() if count >= MANY and at not in sound}
        counts = Counter(key for key, _ in found)
        return {(key, value) for key, value in found if counts[key] < len(self._asked.space.variables[key].values)}

    def _good(self) -> list[Point]:
        """The designs that keep everything by the best that is known, as many as fronts are told apart among."""
        good = [point for point, cost in self._costs.items() if cost.violation <= 0.0]
        if len(good) <= MOST_RANKED:
            return good
        return nsmallest(MOST_RANKED, good, key=lambda point: self._costs[point].goals)

    def _costs_of(self, points: list[Point]) -> list[Costs]:
        """What a generation costs: by the screen, and in full where that has a design on the front so far, for there
        rules decide that the screen cannot ask. Of a goal by which the screen does not rank, all are judged in full
        that it does not refuse. The base's own is, always.
        """
        self.evaluate(points, SCREEN)
        self.evaluate([point for point in points if point == self._asked.base_point], FULL)
        new, is_ranked = set(points), not unranked() & {goal.measure for goal in self._asked.goals}
        near = self.best(LEAST_FULL) if is_ranked else points
        hopeful = [point for point in near if point in new and point not in self.found.full
                   and not violations(self._asked, self.found.screened[point])]
        self.evaluate(hopeful[:MOST_AT_ONCE] if is_ranked else hopeful, FULL)
        return [self._costs[point] for point in points]

    def best(self, count: int, among: list[Point] | None = None) -> list[Point]:
        """The points that cost least by the best that is known, front by front, of all or `among` those that keep
        everything; behind them those that break least.
        """
        good = self._good() if among is None else among
        ranks = ranked([self._costs[point] for point in good], count)
        order = [good[k] for k in np.argsort(ranks, kind="stable")]
        bad = (point for point, cost in self._costs.items() if cost.violation > 0.0)
        left = max(0, count - len(order))
        return [*order[:count], *nsmallest(left, bad, key=lambda point: self._costs[point].violation)]

    def units(self, points: Sequence[Point], count: int = DRAWS) -> dict[Point, list[UnitJudged]]:
        """Units of designs as manufacture makes them, each judged; parts of all designs are worked out side by side."""
        base, own, drawn = self._asked.base, dict(self._asked.spread), draws(count)
        names = tuple(dict.fromkeys((*(one.measure for one in self._asked.require if one.measure != "yield"),
                                     *self._asked.scattered)))
        changes = {point: self._asked.space.changes(point) for point in points}
        keys = {(point, k): base.key(made, "units", count, k, sorted(own.items()), names)
                for point, made in changes.items() for k in range(0, count, PART)}
        missing = [at for at, key in keys.items() if self._archive.units(key) is None]
        given = [(base, changes[point], own, names, drawn[k : k + PART]) for point, k in missing]
        archived = [one for key in keys.values() for one in self._archive.units(key) or ()]
        done, good = len(archived), sum(one.is_good for one in archived)
        of, made = done + sum(len(one[-1]) for one in given), 0
        for at, part in zip(missing, self._workers.each(judge_units, given), strict=True):
            self._archive.add(keys[at], changes[at[0]], {"units": [one.as_json() for one in part]})
            made, good = made + len(part), good + sum(one.is_good for one in part)
            self._progress(StudyState("units", done + made, of, good, {}, made))
        found: dict[Point, list[UnitJudged]] = {point: [] for point in points}
        for (point, _), key in keys.items():
            found[point] += self._archive.units(key) or ()
        return found


PART = 8
"""Units that go to one worker together: some seconds."""

MOST_RANKED = 20_000
"""Designs among which fronts are told apart; of more, those that are best by the first goal."""
