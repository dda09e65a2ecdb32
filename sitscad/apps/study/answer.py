"""Result of a study: whether a design meets the requirements, which limits refuse designs, and the selected designs.

A study varies keys of a base spec. A design is one combination of their values, and a point is the tuple of the values'
numbers. The screen level evaluates a design quickly, and the full level like `check`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from sitscad.apps.study.document import Goal, Requirement, StudyRequest
from sitscad.apps.study.evaluation import FULL, UNDRAWN, UNKNOWN, Breach, Evaluation
from sitscad.apps.study.running import (
    USELESS_COMMENT_RULE,
    StudyResults,
    costs,
    front_numbers,
    is_undrawable,
    violations,
)
from sitscad.apps.study.space import Point, value_at_key, value_difference
from sitscad.apps.study.spreads import Yield
from sitscad.apps.study.sweeping import rule_titles
from sitscad.basics.arrays import Array
from sitscad.basics.record import record


@record
class Binding:
    """A rule or requirement that refuses designs.

    ``share`` is the fraction of all screened designs that it refuses. ``sole_share`` is the fraction that only this
    rule or requirement refuses. ``nearest_breach`` is the smallest violation of its limit, and ``nearest_point`` the
    design with this violation. If it alone refuses some designs, only these designs are compared.
    """

    name: str
    share: float
    sole_share: float
    nearest_breach: Breach
    nearest_point: Point


@record
class Relaxation:
    """The smallest relaxation of rules and requirements with which an evaluated design would pass.

    ``names`` are the relaxed rules and requirements. ``point`` is the design that would then pass, and ``breaches`` are
    its distances from the relaxed limits.
    """

    names: tuple[str, ...]
    breaches: Mapping[str, Breach]
    point: Point


@record
class Agreement:
    """Agreement of the screen level and the full level on the designs that both evaluated.

    ``designs`` is the number of these designs. ``undecided`` counts designs without a verdict at the screen level, and
    ``verdicts_differ`` designs with different verdicts. ``rank_correlation`` is Spearman's correlation of both levels
    by goal. None if all values of the goal are equal.
    """

    designs: int
    undecided: int
    verdicts_differ: int
    rank_correlation: Mapping[str, float | None]


@record(eq=False)
class KeptDesign:
    """A design that the study selects for its answer.

    ``changed`` are the keys that differ from the base, with their values. ``evaluation`` is the evaluation at the full
    level, and ``units`` the yield, None if it was not computed.
    """

    point: Point
    changed: Mapping[str, Any]
    evaluation: Evaluation
    units: Yield | None

    @property
    def accepted_warnings(self) -> list[str]:
        """Titles of the rules that warn about the design and whose warnings the study accepts."""
        titles = rule_titles()
        return [titles.get(rule, rule) for rule in self.evaluation.warned if rule != USELESS_COMMENT_RULE]


def binding_limits(request: StudyRequest, results: StudyResults) -> list[Binding]:
    """Return the rules and requirements that refuse designs, sorted by the fraction that each alone refuses.

    A design whose board cannot be drawn is not checked further. It counts as refused only by the rule that found this,
    although other rules might refuse it, too.
    """
    every, alone = Counter[str](), Counter[str]()
    nearest: dict[str, tuple[tuple[bool, float], Breach, Point]] = {}
    for point in results.screened:
        broken = violations(request, results.evaluation(point))
        every.update(list(broken))
        alone.update(list(broken) if len(broken) == 1 else ())
        for name, breach in broken.items():
            distance = len(broken) > 1, breach.size
            if name not in nearest or distance < nearest[name][0]:
                nearest[name] = distance, breach, point
    total = max(1, len(results.screened))
    order = sorted(every, key=lambda name: (-alone[name], -every[name], name))
    return [Binding(name, every[name] / total, alone[name] / total, *nearest[name][1:]) for name in order]


def smallest_relaxation(request: StudyRequest, results: StudyResults) -> Relaxation | None:
    """Return the smallest relaxation of limits with which at least one design would pass.

    It relaxes as few rules and requirements as possible, and among these has the smallest total breach. Designs
    evaluated at the full level are preferred, because the screen level does not apply all rules. Designs with complete
    leads are preferred to others. None if a design passes at the full level, or if no board can be drawn.
    """
    best: tuple[bool, bool, int, float, int] | None = None
    chosen: Relaxation | None = None
    for k, point in enumerate(results.screened):
        broken, is_guess = violations(request, results.evaluation(point)), point not in results.full
        if not broken and not is_guess:
            return None
        if not broken or is_undrawable(broken):
            continue
        size = is_guess, not UNDRAWN.isdisjoint(broken), len(broken), sum(each.size for each in broken.values()), k
        if best is None or size < best:
            best, chosen = size, Relaxation(tuple(sorted(broken)), broken, point)
    return chosen


def count_unjudged(request: StudyRequest, results: StudyResults) -> int:
    """Return the number of designs that pass the screen level but were not evaluated at the full level."""
    return sum(not violations(request, each) for point, each in results.screened.items() if point not in results.full)


def level_agreement(goals: Sequence[Goal], results: StudyResults) -> Agreement:
    """Return the agreement of screen and full level on the designs that both evaluated and whose leads are complete."""
    from scipy.stats import spearmanr

    pairs_of = [(results.screened[point], full) for point, full in results.full.items()
                if point in results.screened and results.screened[point].level != FULL
             and not UNDRAWN & full.refused.keys()]
    differ = sum(screen.verdict != UNKNOWN and screen.verdict != other.verdict for screen, other in pairs_of)
    open_ones = sum(screen.verdict == UNKNOWN for screen, _ in pairs_of)
    ranks: dict[str, float | None] = {}
    for name in (goal.measure for goal in goals):
        pairs = np.array([(screen.values[name][0], other.values[name][0]) for screen, other in pairs_of
                          if name in screen.values and name in other.values])
        varies = len(pairs) > 2 and np.ptp(pairs, axis=0).all()
        ranks[name] = round(float(spearmanr(*pairs.T).statistic), 6) if varies else None
    return Agreement(len(pairs_of), open_ones, differ, ranks)


def pareto_front(request: StudyRequest, results: StudyResults, but: Collection[Point] = ()) -> list[Point]:
    """Return the designs that pass at the full level and that no other design beats (the Pareto front).

    A design beats another if it is at least as good by each goal and better by at least one goal. The result is sorted
    by the first goal, the best first. Designs in `but` are left out.
    """
    return unbeaten_designs(request, {point: each for point, each in results.full.items() if point not in but})


def unbeaten_designs(request: StudyRequest, judged: Mapping[Point, Evaluation]) -> list[Point]:
    """Return the designs in `judged` that pass and that no other design beats, the best by the first goal first."""
    good = passing_designs(request, judged)
    ranks = front_numbers([costs(request, judged[point]) for point in good])
    first = [point for point, rank in zip(good, ranks, strict=True) if rank == 0]
    return sorted(first, key=lambda point: (_goal_costs(request.goals, judged[point]), point))


def passing_designs(request: StudyRequest, judged: Mapping[Point, Evaluation]) -> list[Point]:
    """Return the designs that meet all rules and requirements."""
    return [point for point, each in judged.items() if not violations(request, each)]


def _goal_costs(goals: Sequence[Goal], evaluation: Evaluation) -> tuple[float, ...]:
    values = evaluation.values
    return tuple(goal.cost(values[goal.measure][0]) if goal.measure in values else math.inf for goal in goals)


def count_beaten_by_base(request: StudyRequest, base: Evaluation, designs: Sequence[KeptDesign]) -> int:
    """Return the number of kept designs that the base design beats.

    0 if the base breaks a rule or requirement, or is itself a design of the study.
    """
    if violations(request, base) or not changed_keys(request, request.base_point):
        return 0
    base_costs = _goal_costs(request.goals, base)
    design_costs = (_goal_costs(request.goals, design.evaluation) for design in designs)
    return sum(base_costs != costs and all(mine <= its for mine, its in zip(base_costs, costs, strict=True))
               for costs in design_costs)


NEAR = 0.1
"""Smallest distance between two kept designs of a study with a single goal.

For each varied key, the difference of the values' numbers is divided by the largest possible difference. The distance
is the mean over the varied keys.
"""


def kept_points(request: StudyRequest, results: StudyResults, but: Collection[Point] = ()) -> list[Point]:
    """Return the designs to keep, without those in `but`.

    For a single goal, they are the best designs with sufficient distance from each other (`NEAR`). For several goals,
    they are the designs of the front that together dominate the largest volume (greedy hypervolume).
    """
    if len(request.goals) == 1:
        good = [point for point in passing_designs(request, results.full) if point not in but]
        order = sorted(good, key=lambda point: (_goal_costs(request.goals, results.full[point]), point))
        return _distinct_designs(request, order)
    points = pareto_front(request, results, but)
    goals = np.array([_goal_costs(request.goals, results.full[point]) for point in points])
    return _select_by_hypervolume(goals, points, request.keep)


def _distinct_designs(request: StudyRequest, order: Sequence[Point]) -> list[Point]:
    """Return the first designs in `order` whose distances from each other are at least `NEAR`.

    At most as many designs are returned as the request keeps.
    """
    spans = np.maximum(np.array(request.space.shape) - 1, 1)
    points: list[Point] = []
    for point in order:
        distances = (float(np.mean(np.abs(np.array(point) - np.array(other)) / spans)) for other in points)
        if len(points) < request.keep and all(apart >= NEAR for apart in distances):
            points.append(point)
    return points


def _select_by_hypervolume(values: Array, points: Sequence[Point], keep: int) -> list[Point]:
    if not len(points):
        return []
    low, high = values.min(axis=0), values.max(axis=0)
    scaled = (values - low) / np.where(high > low, high - low, 1.0)
    chosen: list[int] = []
    while len(chosen) < min(keep, len(points)):
        candidates = [k for k in range(len(points)) if k not in chosen]
        volumes = [hypervolume(scaled[[*chosen, k]]) for k in candidates]
        best = candidates[int(np.argmax(volumes))]
        chosen.append(best)
    return [points[k] for k in sorted(chosen)]


REFERENCE = 1.1
"""Coordinate of the hypervolume's reference corner for each goal, if the front is scaled to 0 to 1.

It is larger than 1, so that the designs at the ends of the front contribute to the volume.
"""


def hypervolume(values: Array) -> float:
    """Return the volume of the region that is worse than at least one point, up to `REFERENCE` on each axis.

    `values` (points, goals) are costs: smaller is better. The coordinates of all points divide the space into cells.
    The result is the exact sum of the cells in the region.
    """
    axes = [np.unique(np.append(column, REFERENCE)) for column in values.T]
    lows = np.meshgrid(*(axis[:-1] for axis in axes), indexing="ij")
    sizes = np.meshgrid(*(np.diff(axis) for axis in axes), indexing="ij")
    covered = np.zeros(lows[0].shape, dtype=bool)
    for point in values:
        covered |= np.all([low >= value for low, value in zip(lows, point, strict=True)], axis=0)
    return float(np.sum(np.prod(sizes, axis=0)[covered]))


def changed_keys(request: StudyRequest, point: Point) -> dict[str, Any]:
    """Return the keys of a design that differ from the base, with their values as in a spec."""
    before = request.base.changed_values(())
    return {key: value for key, value in request.space.changes(point)
            if value_difference(value_at_key(before, key), value)}


def broken_requirements(require: Sequence[Requirement], values: Mapping[str, float]) -> tuple[str, ...]:
    """Return the measures in `require` whose limit `values` break, or whose value is missing."""
    pairs = ((limit, values.get(limit.measure, math.nan)) for limit in require if limit.measure != "yield")
    return tuple(limit.measure for limit, value in pairs if not limit.holds(value))
