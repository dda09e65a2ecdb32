"""Candidates, drawn generation by generation: what a generation costs is known before the next one is drawn.

It depends on the seed and on what was told alone: never on who computed it, nor in which order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from importlib.util import find_spec
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.arrays import Array, Flags
from sitscad.parts import MissingExtra
from sitscad.record import record
from sitscad.study.space import Point, Space

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
