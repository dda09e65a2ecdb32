"""The search of a study: designs in generations, each evaluated once per level, and their costs.

The designs of a generation depend on the seed and on earlier costs. They never depend on the order of computation or on
the process that computed a cost.
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

from sitscad.apps.study.document import ALL, StudyRequest
from sitscad.apps.study.evaluating import IN_FULL, Workers
from sitscad.apps.study.evaluation import FULL, SCREEN, Archive, Breach, Evaluation, UnitEvaluation
from sitscad.apps.study.measures import MEASURES
from sitscad.apps.study.space import Point, Space
from sitscad.apps.study.spreads import DRAWS, judge_units, latin_hypercube
from sitscad.assembly.solids import MissingExtra
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.checks.judging import all_rules
from sitscad.checks.policy import matches_rule
from sitscad.data import rows

POPULATION = 64
GENERATION = 4096
"""Number of designs of a grid or a Sobol' set that are passed to the workers together."""

LEAST_SOBOL, MOST_SOBOL = 32, 1024
"""Least and largest number of designs in the Sobol' set that a search evaluates first.

Within these limits, the number is a quarter of all evaluations, rounded down to a power of two.
"""


@record
class Costs:
    """Costs of a design.

    ``goals`` are values to minimize, None if the design does not have the measure. ``violation`` is the total breach of
    rules and requirements, and 0 if all are met.
    """

    goals: tuple[float | None, ...]
    violation: float


Evaluate = Callable[[list[Point]], list[Costs]]
"""Function that returns the costs of points. It is called once for each point."""


def method_for(method: str, space: Space, evaluations: int, goals: int) -> str:
    """Return the search method for `goals` goals.

    For "auto", it is the grid if the space has at most as many designs as `evaluations`. Otherwise it is NSGA-II if
    pymoo is installed, else differential evolution for one goal and a Sobol' set for several goals.
    """
    if method != "auto":
        return method
    if space.size <= evaluations:
        return "grid"
    return "nsga2" if find_spec("pymoo") is not None else "de" if goals == 1 else "sobol"


def search(
    method: str, space: Space, evaluations: int, seed: int, goals: int, evaluate: Evaluate, begin: Sequence[Point] = ()
) -> None:
    """Evaluate points chosen by a method, at most `evaluations` points, each once. Points in `begin` come first."""
    if method in ("grid", "sobol"):
        further = space.points() if method == "grid" else sobol_set(space, evaluations, seed)
        _evaluate_in_parts(_distinct((*begin, *islice(further, evaluations)), evaluations), evaluate)
        return
    first = first_set(space, evaluations, seed, begin)
    evaluated = dict(zip(first, _evaluate_in_parts(first, evaluate), strict=True))
    go_on = _nsga2 if method == "nsga2" else _differential_evolution
    go_on(space, evaluations, seed, goals, evaluated, evaluate)


def first_set(space: Space, evaluations: int, seed: int, begin: Sequence[Point] = ()) -> list[Point]:
    """Return the points that a search with `evaluations` evaluations begins with: `begin`, then a Sobol' set."""
    count = 2 ** max(0, (evaluations // 4).bit_length() - 1)
    points = sobol_set(space, min(max(count, LEAST_SOBOL), MOST_SOBOL, evaluations), seed)
    return _distinct((*begin, *points), evaluations)


def _distinct(points: Iterable[Point], most: int) -> list[Point]:
    """Return the first `most` different points."""
    return list(dict.fromkeys(points))[:most]


def _evaluate_in_parts(points: Sequence[Point], evaluate: Evaluate) -> list[Costs]:
    parts = (list(points[k : k + GENERATION]) for k in range(0, len(points), GENERATION))
    return [cost for part in parts for cost in evaluate(part)]


def sobol_set(space: Space, count: int, seed: int) -> list[Point]:
    """Return the different designs of a scrambled Sobol' set with `count` rows.

    Each coordinate (0 to 1) selects a value of a key. Rows that select the same values are one design.
    """
    from scipy.stats import qmc  # loaded for searches only

    size = 2 ** max(0, (count - 1).bit_length())  # a power of two keeps the set balanced
    rows = qmc.Sobol(len(space.shape), scramble=True, rng=seed).random(size)[:count]
    shape = np.array(space.shape)
    numbers = np.minimum((rows * shape).astype(int), shape - 1)
    return list(dict.fromkeys(tuple(map(int, row)) for row in numbers))


WORST = 1e30
"""Value used for a goal whose measure a design does not have. Such a design also violates the requirements."""


def _cost_arrays(costs: Sequence[Costs]) -> tuple[Array, Array]:
    """Return the values of the goals (n, goals) and the violations (n, 1) of n designs as arrays."""
    goals = np.array([[WORST if value is None else value for value in each.goals] for each in costs])
    return goals, np.array([each.violation for each in costs]).reshape(-1, 1)


def _nsga2(
    space: Space, evaluations: int, seed: int, goals: int, evaluated: dict[Point, Costs], evaluate: Evaluate
) -> None:
    """Search with NSGA-II (Deb 2002). Its variables are the numbers of the keys' values.

    The first population are the best of the known points.
    """
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
    algorithm = NSGA2(pop_size=size, sampling=np.array(_first_population(evaluated, size)), eliminate_duplicates=True,
                      crossover=SBX(prob=0.9, eta=10, **whole), mutation=PM(eta=10, **whole))
    algorithm.setup(problem, termination=("n_gen", evaluations), seed=seed, verbose=False)
    still = 0
    while len(evaluated) < evaluations and still < STILL:
        candidates = algorithm.ask()
        if candidates is None or not len(candidates):
            return
        points = [tuple(map(int, row)) for row in np.rint(candidates.get("X"))]
        still = 0 if _evaluate_new(points, evaluations, evaluated, evaluate) else still + 1
        nothing = Costs((None,) * goals, WORST)  # beyond the limit of evaluations: given the worst costs
        values, violations = _cost_arrays([evaluated.get(point, nothing) for point in points])
        algorithm.evaluator.eval(StaticProblem(problem, F=values, G=violations), candidates)
        algorithm.tell(infills=candidates)


STILL = 50
"""Number of generations without a new design after which the search ends."""


def _evaluate_new(points: Sequence[Point], evaluations: int, evaluated: dict[Point, Costs], evaluate: Evaluate) -> int:
    """Evaluate points that are not yet known, up to the limit of evaluations. Return how many were evaluated."""
    new = [point for point in dict.fromkeys(points) if point not in evaluated][: evaluations - len(evaluated)]
    if new:
        evaluated |= dict(zip(new, evaluate(new), strict=True))
    return len(new)


def _first_population(evaluated: dict[Point, Costs], size: int) -> list[Point]:
    """Return `size` evaluated points for the first population.

    Valid points come first, front by front, then the points with the least violation.
    """
    points = list(evaluated)
    ranks = front_numbers([evaluated[point] for point in points])
    return [points[k] for k in np.argsort(ranks, kind="stable")[:size]]


def front_numbers(costs: Sequence[Costs], least: int | None = None) -> NDArray[np.int64]:
    """Return the number (from 0) of the Pareto front to which each point belongs, from the costs of all points.

    Valid points are ranked by their goals. Points with violations follow, ranked by their violation. When `least`
    points have a front, the remaining valid points share the next front.
    """
    goals, violations = _cost_arrays(costs)
    ranks = np.full(len(costs), -1, dtype=np.int64)
    good, front = np.flatnonzero(violations[:, 0] <= 0.0), 0
    while len(good):
        is_enough = least is not None and np.count_nonzero(ranks >= 0) >= least
        first = np.ones(len(good), dtype=bool) if is_enough else _find_unbeaten_rows(goals[good])
        ranks[good[first]] = front
        good, front = good[~first], front + 1
    bad = np.flatnonzero(ranks < 0)
    ranks[bad[np.argsort(violations[bad, 0], kind="stable")]] = front + np.arange(len(bad))
    return ranks


def _find_unbeaten_rows(values: Array) -> Flags:
    """Return flags of the rows (n, goals) that no other row beats. Smaller values are better.

    If rows are sorted by their goals, a row can be beaten only by earlier rows. The number of passes is the number of
    unbeaten rows.
    """
    remaining, unbeaten = np.lexsort(values.T[::-1]), np.zeros(len(values), dtype=bool)
    while len(remaining):
        best, unbeaten[remaining[0]] = values[remaining[0]], True
        rest = values[remaining[1:]]
        remaining = remaining[1:][np.any(rest < best, axis=1) | np.all(rest == best, axis=1)]
    return unbeaten


class _SpentError(Exception):
    """Raised when the limit of evaluations is reached."""


REFUSED = 1e12
"""Factor in the cost of an invalid design: the cost is `REFUSED` times (1 + violation).

It exceeds each goal of a valid design in SI units.
"""


def _differential_evolution(
    space: Space, evaluations: int, seed: int, goals: int, evaluated: dict[Point, Costs], evaluate: Evaluate
) -> None:
    """Search with differential evolution (Storn and Price 1997). Its variables are the numbers of the keys' values.

    The first population are the best of the known points.
    """
    from scipy.optimize import differential_evolution

    bounds, size = [(0, count - 1) for count in space.shape], min(32, max(8, evaluations // 8), len(evaluated))
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
        still = 0 if _evaluate_new(points, evaluations, evaluated, evaluate) else still + 1
        if still >= STILL or any(point not in evaluated for point in points):
            raise _SpentError
        return np.array([_single_cost(evaluated[point]) for point in points])

    start = np.array(_first_population(evaluated, size), dtype=float)[:, free]
    if len(start) < 5 or not free:
        return
    with suppress(_SpentError):
        differential_evolution(
            cost, [bounds[k] for k in free], init=start, integrality=np.ones(len(free), dtype=bool), rng=seed,
            vectorized=True, updating="deferred", polish=False, tol=0.0, maxiter=evaluations,
        )


def _single_cost(cost: Costs) -> float:
    """Return the cost of a design in a search with one goal. Invalid designs have large costs."""
    goal = cost.goals[0]
    return REFUSED * (1.0 + cost.violation) if cost.violation > 0.0 or goal is None else goal


USELESS_COMMENT_RULE = "SIT020"
"""Rule on a comment that suppresses no finding.

Such a comment is removed from kept designs, and the warning is ignored.
"""

LEAST_FULL = 24
"""Least number of designs to evaluate at the full level, if the search has that number.

If four times the number of designs to keep is larger, the larger number is used.
"""

MOST_FRONT = 256
"""Largest number of designs of the front to evaluate at the full level. Further designs are only in the archive."""

MOST_AT_ONCE = 8
"""Largest number of designs of one generation that are evaluated at the full level during the search."""

MOST_ROUNDS = 4
"""Largest number of rounds after the search in which the best screened designs are evaluated at the full level.

Rounds do not count while no design passes (see `MOST_IN_VAIN`).
"""

MOST_IN_VAIN = 8
"""Largest number of rounds (see `MOST_ROUNDS`) without a design that passes at the full level."""

MANY = 8
"""Least number of designs with one value of a key that must fail at the full level before this value is tried last.

No design with the value may have passed.
"""


@record
class StudyState:
    """Progress of a study.

    ``stage`` is the present work. ``done`` of ``of`` designs or simulated sensors are finished, as far as the total is
    known. ``feasible`` is the number of designs that pass, and ``best`` the best value of each goal. ``made`` counts
    evaluations of this run, without those from the archive.
    """

    stage: str
    done: int
    of: int
    feasible: int
    best: Mapping[str, float]
    made: int


Progress = Callable[[StudyState], None]


@dataclass
class StudyResults:
    """All evaluations of a study.

    ``screened`` and ``full`` hold evaluations at the two levels by point, in the order of evaluation. A design that
    cannot be screened is in both. ``reused`` counts evaluations from the archive, and ``damaged`` its damaged lines.
    """

    request: StudyRequest
    method: str
    screened: dict[Point, Evaluation] = field(default_factory=dict)
    full: dict[Point, Evaluation] = field(default_factory=dict)
    reused: int = 0
    damaged: int = 0

    @property
    def unscreened(self) -> int:
        """Number of designs that cannot be screened and were evaluated at the full level instead."""
        return sum(each.level == FULL for each in self.screened.values())

    def evaluation(self, point: Point) -> Evaluation:
        """Return the evaluation of a point at the full level, or else at the screen level."""
        return self.full.get(point) or self.screened[point]


LEAST_RANK = 0.98
"""Least rank correlation (Spearman) between screen and full level for which the screen level ranks designs.

A measure with a smaller correlation is not used for ranking at the screen level.
"""


@cache
def unranked_measures() -> frozenset[str]:
    """Return the measures that are not used for ranking designs at the screen level."""
    return frozenset(row["measure"] for row in rows("screen_errors") if row["rank"] and float(row["rank"]) < LEAST_RANK)


def violations(request: StudyRequest, evaluation: Evaluation) -> dict[str, Breach]:
    """Return the breaches of a design: rules with errors, warnings that are not accepted, and broken requirements.

    A missing measure is a breach, too, unless only the full level computes it. A design that cannot be drawn has only
    the breaches of the rules that refuse its spec, because no others are known.
    """
    broken = dict(evaluation.refused)
    if is_undrawable(broken):
        return broken
    names = {rule.id: rule.name for rule in all_rules()} if evaluation.warned else {}
    broken |= {rule: breach for rule, breach in evaluation.warned.items() if rule != USELESS_COMMENT_RULE and not any(
        word == ALL or matches_rule(word, rule, names.get(rule, "")) for word in request.accept)}
    for requirement in request.require:
        if requirement.measure == "yield":
            continue
        value, unit = evaluation.values.get(requirement.measure), MEASURES[requirement.measure].unit
        if evaluation.absent.get(requirement.measure) == IN_FULL:
            continue
        if value is None or not requirement.holds(value[0]):
            broken[requirement.measure] = Breach(None if value is None else value[0], requirement.limit, unit)
        elif request.least_yield is not None and f"sigma.{requirement.measure}" in evaluation.values:
            margin = NormalDist().inv_cdf(request.least_yield) * evaluation.values[f"sigma.{requirement.measure}"][0]
            worst = value[0] - margin if requirement.is_floor else value[0] + margin
            if not requirement.holds(worst):  # too many units would break it (to first order, each limit separately)
                broken[f"yield by {requirement.measure}"] = Breach(worst, requirement.limit, unit)
    if not broken:
        lacking = [goal.measure for goal in request.goals
                   if goal.measure not in evaluation.values and evaluation.absent.get(goal.measure) != IN_FULL]
        broken |= dict.fromkeys(lacking, Breach())
    return broken


def costs(request: StudyRequest, evaluation: Evaluation) -> Costs:
    """Return the costs of a design for the search."""
    goals = tuple(goal.cost(evaluation.values[goal.measure][0]) if goal.measure in evaluation.values else None
                  for goal in request.goals)
    unmade = NOT_MADE if is_undrawable(evaluation.refused) else 0.0
    return Costs(goals, unmade + sum(breach.size for breach in violations(request, evaluation).values()))


def is_undrawable(broken: Iterable[str]) -> bool:
    """Whether a rule on the spec itself (SIT0xx) is broken.

    The board then cannot be drawn, and other rules cannot be applied.
    """
    return any(name.startswith("SIT0") and name != USELESS_COMMENT_RULE for name in broken)


NOT_MADE = 100.0
"""Additional violation of a design that cannot be drawn. It exceeds the violation of any other design."""


@dataclass
class LevelTally:
    """Counts of evaluations at one level, with a progress report after each new evaluation."""

    request: StudyRequest
    level: str
    of: int
    progress: Progress
    done: int = 0
    good: int = 0
    made: int = 0
    best: dict[str, float] = field(default_factory=dict)

    def count_evaluation(self, evaluation: Evaluation, is_made: bool) -> None:
        """Count one evaluation. `is_made` is False if it comes from the archive."""
        self.done += 1
        if not violations(self.request, evaluation):
            self.good += 1
            for goal in (goal for goal in self.request.goals if goal.measure in evaluation.values):
                value = evaluation.values[goal.measure][0]
                self.best[goal.measure] = min(self.best.get(goal.measure, value), value, key=goal.cost)
        self.made += is_made
        if is_made:
            of = max(self.of, self.done)
            self.progress(StudyState(self.level, self.done, of, self.good, dict(self.best), self.made))


class StudyRun:
    """One run of a study, with its workers, its archive and its progress function."""

    def __init__(
        self, request: StudyRequest, workers: Workers, archive: Archive, progress: Progress | None = None
    ) -> None:
        self._asked, self._workers, self._archive = request, workers, archive
        self._progress = progress or (lambda state: None)
        self._costs: dict[Point, Costs] = {}
        total = min(request.evaluations, request.space.size)
        self._tallies = {level: LevelTally(request, level, of, self._progress)
                         for level, of in ((SCREEN, total), (FULL, 0))}
        method = method_for(request.method, request.space, request.evaluations, len(request.goals))
        self.found = StudyResults(request, method, damaged=archive.damaged)

    def evaluate(self, points: Sequence[Point], level: str) -> None:
        """Evaluate points at a level, each once. Evaluations in the archive are reused."""
        results = self.found.full if level == FULL else self.found.screened
        base, measures = self._asked.base, self._asked.measures
        changes = {point: self._asked.space.changes(point) for point in points if point not in results}
        keys = {point: base.key(changes[point], level) for point in changes}
        evaluated = {point: self._archive.evaluation(key, measures) for point, key in keys.items()}
        missing = [point for point, each in evaluated.items() if each is None]
        self.found.reused += len(evaluated) - len(missing)
        for each in filter(None, evaluated.values()):
            self._tallies[level].count_evaluation(each, is_made=False)
        computed = self._workers.evaluations([changes[point] for point in missing], measures, level)
        for point, each in zip(missing, computed, strict=True):
            self._archive.add(keys[point], changes[point], each.as_json())
            evaluated[point] = self._archive.evaluation(keys[point], measures)  # as a later run reads it
            self._tallies[level].count_evaluation(each, is_made=True)
        for point, evaluation in evaluated.items():
            if evaluation is None:
                continue
            results[point] = evaluation
            if evaluation.level == FULL:
                self.found.full[point] = evaluation
            self._costs[point] = costs(self._asked, evaluation)

    def search(self) -> None:
        """Screen designs chosen by the method, then evaluate the front at the full level until it is stable.

        Promising designs are evaluated at the full level during the search, too. Designs with a value that failed often
        are evaluated last.
        """
        study = self._asked
        count = min(study.evaluations, study.space.size)
        search(self.found.method, study.space, count, study.seed, len(study.goals), self._costs_of, [study.base_point])
        in_vain = rounds = 0
        while rounds < MOST_ROUNDS and in_vain < MOST_IN_VAIN:
            good, doubtful = self._passing_points(), self._failing_values()
            likely = [point for point in good if point in self.found.full or doubtful.isdisjoint(enumerate(point))]
            on_front = np.count_nonzero(front_numbers([self._costs[point] for point in good], 1) == 0)
            count = max(LEAST_FULL, 4 * study.keep, min(MOST_FRONT, int(on_front)))
            first = (point for points in (likely, good) for point in self.best_points(count, points))
            new = list(dict.fromkeys(point for point in first if point not in self.found.full))[:count]
            if not new:
                break
            self._tallies[FULL].of = self._tallies[FULL].done + len(new)
            self.evaluate(new, FULL)
            is_in_vain = bool(good) and not any(self._costs[point].violation <= 0.0 for point in self.found.full)
            in_vain, rounds = in_vain + is_in_vain, rounds + (not is_in_vain)

    def _failing_values(self) -> set[tuple[int, int]]:
        """Return pairs (key number, value number) that fail at the full level although they pass the screen level.

        At least `MANY` designs with the value passed the screen level and failed at the full level, and no design with
        the value passed. A key is left out if all its values failed.
        """
        fell, sound = Counter[tuple[int, int]](), set[tuple[int, int]]()
        for point, each in self.found.full.items():
            if not violations(self._asked, each):
                sound.update(enumerate(point))
            elif not violations(self._asked, self.found.screened.get(point, each)):
                fell.update(enumerate(point))
        doubtful = {at for at, count in fell.items() if count >= MANY and at not in sound}
        counts = Counter(key for key, _ in doubtful)
        return {(key, value) for key, value in doubtful if counts[key] < len(self._asked.space.variables[key].values)}

    def _passing_points(self) -> list[Point]:
        """Return at most `MOST_RANKED` designs that break no limit.

        A design's evaluation at the full level counts, or else its evaluation at the screen level.
        """
        good = [point for point, cost in self._costs.items() if cost.violation <= 0.0]
        if len(good) <= MOST_RANKED:
            return good
        return nsmallest(MOST_RANKED, good, key=lambda point: self._costs[point].goals)

    def _costs_of(self, points: list[Point]) -> list[Costs]:
        """Return the costs of a generation of designs.

        Designs are evaluated at the screen level. Designs on the present front are also evaluated at the full level,
        because only this level decides some rules. If the screen level cannot rank designs by one of the goals, all
        designs that pass it are evaluated at the full level. The design nearest to the base is always evaluated at the
        full level.
        """
        self.evaluate(points, SCREEN)
        self.evaluate([point for point in points if point == self._asked.base_point], FULL)
        new, is_ranked = set(points), not unranked_measures() & {goal.measure for goal in self._asked.goals}
        near = self.best_points(LEAST_FULL) if is_ranked else points
        hopeful = [point for point in near if point in new and point not in self.found.full
                   and not violations(self._asked, self.found.screened[point])]
        self.evaluate(hopeful[:MOST_AT_ONCE] if is_ranked else hopeful, FULL)
        return [self._costs[point] for point in points]

    def best_points(self, count: int, among: list[Point] | None = None) -> list[Point]:
        """Return the `count` best points: first the points that break no limit, front by front.

        If `among` is given, only its points are used for the fronts. Points with the least violation follow. The
        evaluation at the full level counts, or else the evaluation at the screen level.
        """
        good = self._passing_points() if among is None else among
        ranks = front_numbers([self._costs[point] for point in good], count)
        order = [good[k] for k in np.argsort(ranks, kind="stable")]
        bad = (point for point, cost in self._costs.items() if cost.violation > 0.0)
        rest = max(0, count - len(order))
        return [*order[:count], *nsmallest(rest, bad, key=lambda point: self._costs[point].violation)]

    def simulated_units(self, points: Sequence[Point], count: int = DRAWS) -> dict[Point, list[UnitEvaluation]]:
        """Return simulated sensors of designs, each with random manufacturing errors.

        `count` is their number per design. Groups of sensors of all designs are computed in parallel.
        """
        base, sigmas, draw_rows = self._asked.base, dict(self._asked.spread), latin_hypercube(count)
        names = tuple(dict.fromkeys((*(each.measure for each in self._asked.require if each.measure != "yield"),
                                     *self._asked.measures_with_sigma)))
        changes = {point: self._asked.space.changes(point) for point in points}
        keys = {(point, k): base.key(computed, "units", count, k, sorted(sigmas.items()), names)
                for point, computed in changes.items() for k in range(0, count, PART)}
        missing = [at for at, key in keys.items() if self._archive.units(key) is None]
        arguments = [(base, changes[point], sigmas, names, draw_rows[k : k + PART]) for point, k in missing]
        archived = [each for key in keys.values() for each in self._archive.units(key) or ()]
        done, good = len(archived), sum(each.passes for each in archived)
        of, computed = done + sum(len(each[-1]) for each in arguments), 0
        for at, part in zip(missing, self._workers.call_results(judge_units, arguments), strict=True):
            self._archive.add(keys[at], changes[at[0]], {"units": [each.as_json() for each in part]})
            computed, good = computed + len(part), good + sum(each.passes for each in part)
            self._progress(StudyState("units", done + computed, of, good, {}, computed))
        by_point: dict[Point, list[UnitEvaluation]] = {point: [] for point in points}
        for (point, _), key in keys.items():
            by_point[point] += self._archive.units(key) or ()
        return by_point


PART = 8
"""Number of simulated sensors that one worker computes at a time: some seconds of work."""

MOST_RANKED = 20_000
"""Largest number of designs that are divided into fronts. Of more designs, the best by the first goal are used."""
