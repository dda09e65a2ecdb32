"""The answer of a study: whether it can be met, what stands in the way, and the designs that are kept."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from sitscad.apps.study.document import Asked, Goal, Requirement
from sitscad.apps.study.evaluation import FULL, UNDRAWN, UNKNOWN, Breach, Evaluation
from sitscad.apps.study.running import IN_VAIN, Found, costs, is_unmade, ranked, violations
from sitscad.apps.study.space import Point, apart, at_key
from sitscad.apps.study.spreads import Yield
from sitscad.apps.study.sweeping import rule_titles
from sitscad.basics.arrays import Array
from sitscad.basics.record import record


@record
class Binding:
    """What refuses designs: a rule or a measure that is required; the share of all designs that it refuses, that which
    it refuses alone, and the nearest to its limit, of these where there are any.
    """

    name: str
    share: float
    alone: float
    nearest: Breach
    nearest_at: Point


@record
class Relaxation:
    """The smallest relaxation that was tried and admits a design: what is let go, how far beyond it that design lies,
    and which one it is.
    """

    names: tuple[str, ...]
    breaches: Mapping[str, Breach]
    point: Point


@record
class Agreement:
    """How well both levels agree on the designs that both judged: their number, of how many the screen had no verdict
    (`undecided`), how many verdicts differ of the others, and by goal the rank correlation (Spearman), None where all
    are alike.
    """

    designs: int
    undecided: int
    verdicts_differ: int
    rank_correlation: Mapping[str, float | None]


@record(eq=False)
class Kept:
    """A design that is kept: its point, what differs from the base (key: value), its evaluation in full, its yield."""

    point: Point
    changed: Mapping[str, Any]
    evaluation: Evaluation
    units: Yield | None

    @property
    def accepted(self) -> list[str]:
        """The rules whose warnings it has, which the study accepts, each with its name."""
        titles = rule_titles()
        return [titles.get(rule, rule) for rule in self.evaluation.warned if rule != IN_VAIN]


def bindings(asked: Asked, found: Found) -> list[Binding]:
    """What refuses designs, what refuses most alone first. Of a design that cannot be drawn nothing else is known, so
    that its rule counts as refusing it alone, though others might, once it is drawn.
    """
    every, alone = Counter[str](), Counter[str]()
    nearest: dict[str, tuple[tuple[bool, float], Breach, Point]] = {}
    for point in found.screened:
        broken = violations(asked, found.of(point))
        every.update(list(broken))
        alone.update(list(broken) if len(broken) == 1 else ())
        for name, breach in broken.items():
            far = len(broken) > 1, breach.size
            if name not in nearest or far < nearest[name][0]:
                nearest[name] = far, breach, point
    total = max(1, len(found.screened))
    order = sorted(every, key=lambda name: (-alone[name], -every[name], name))
    return [Binding(name, every[name] / total, alone[name] / total, *nearest[name][1:]) for name in order]


def relaxation(asked: Asked, found: Found) -> Relaxation | None:
    """The relaxation that lets go of the fewest names, and of these lies least beyond them, of designs judged in full
    where there are any that can be drawn, for others may break rules that the screen cannot ask, and rather with their
    leads than without; None where a design keeps all in full, or none can be drawn.
    """
    best: tuple[bool, bool, int, float, int] | None = None
    chosen: Relaxation | None = None
    for k, point in enumerate(found.screened):
        broken, is_guess = violations(asked, found.of(point)), point not in found.full
        if not broken and not is_guess:
            return None
        if not broken or is_unmade(broken):
            continue
        size = is_guess, not UNDRAWN.isdisjoint(broken), len(broken), sum(one.size for one in broken.values()), k
        if best is None or size < best:
            best, chosen = size, Relaxation(tuple(sorted(broken)), broken, point)
    return chosen


def unjudged(asked: Asked, found: Found) -> int:
    """How many designs keep everything by the screen and were not judged in full."""
    return sum(not violations(asked, one) for point, one in found.screened.items() if point not in found.full)


def agreement(goals: Sequence[Goal], found: Found) -> Agreement:
    """How well the screen agrees with the full level on the designs that both judged and whose leads were drawn."""
    from scipy.stats import spearmanr

    both = [(found.screened[point], full) for point, full in found.full.items()
            if point in found.screened and found.screened[point].level != FULL and not UNDRAWN & full.refused.keys()]
    differ = sum(one.verdict != UNKNOWN and one.verdict != other.verdict for one, other in both)
    open_ones = sum(one.verdict == UNKNOWN for one, _ in both)
    ranks: dict[str, float | None] = {}
    for name in (goal.measure for goal in goals):
        pairs = np.array([(one.values[name][0], other.values[name][0]) for one, other in both
                          if name in one.values and name in other.values])
        varies = len(pairs) > 2 and np.ptp(pairs, axis=0).all()
        ranks[name] = round(float(spearmanr(*pairs.T).statistic), 6) if varies else None
    return Agreement(len(both), open_ones, differ, ranks)


def front(asked: Asked, found: Found, but: Collection[Point] = ()) -> list[Point]:
    """The designs judged in full that keep everything and that no other one beats, the best by the first goal first; as
    if some had not been found.
    """
    return best_of(asked, {point: one for point, one in found.full.items() if point not in but})


def best_of(asked: Asked, judged: Mapping[Point, Evaluation]) -> list[Point]:
    """The designs, of some, that keep everything and that no other one beats, the best by the first goal first."""
    good = passing(asked, judged)
    ranks = ranked([costs(asked, judged[point]) for point in good])
    first = [point for point, rank in zip(good, ranks, strict=True) if rank == 0]
    return sorted(first, key=lambda point: (_goals(asked.goals, judged[point]), point))


def passing(asked: Asked, judged: Mapping[Point, Evaluation]) -> list[Point]:
    """The designs that keep everything."""
    return [point for point, one in judged.items() if not violations(asked, one)]


def _goals(goals: Sequence[Goal], one: Evaluation) -> tuple[float, ...]:
    return tuple(goal.cost(one.values[goal.measure][0]) if goal.measure in one.values else math.inf for goal in goals)


def beaten_by_base(asked: Asked, base: Evaluation, kept: Sequence[Kept]) -> int:
    """How many of the designs that are kept the base beats: none where it breaks something, or is a design itself."""
    own, counts = _goals(asked.goals, base), bool(changed(asked, asked.base_point)) and not violations(asked, base)
    others = [_goals(asked.goals, one.evaluation) for one in kept] if counts else []
    return sum(own != other and all(mine <= its for mine, its in zip(own, other, strict=True)) for other in others)


NEAR = 0.1
"""Part of the ranges of the varied keys, on average, by which designs of one goal have to differ."""


def kept_points(asked: Asked, found: Found, but: Collection[Point] = ()) -> list[Point]:
    """The designs that are kept, but for some: of one goal the best that differ, of several those that cover most of
    the front (greedy hypervolume).
    """
    if len(asked.goals) == 1:
        good = [point for point in passing(asked, found.full) if point not in but]
        order = sorted(good, key=lambda point: (_goals(asked.goals, found.full[point]), point))
        return _apart(asked, order)
    points = front(asked, found, but)
    return _by_hypervolume(np.array([_goals(asked.goals, found.full[point]) for point in points]), points, asked.keep)


def _apart(asked: Asked, order: Sequence[Point]) -> list[Point]:
    """The first ones of an order that differ from each other."""
    spans = np.maximum(np.array(asked.space.shape) - 1, 1)
    kept: list[Point] = []
    for point in order:
        far = (float(np.mean(np.abs(np.array(point) - np.array(other)) / spans)) for other in kept)
        if len(kept) < asked.keep and all(apart >= NEAR for apart in far):
            kept.append(point)
    return kept


def _by_hypervolume(values: Array, points: Sequence[Point], keep: int) -> list[Point]:
    if not len(points):
        return []
    low, high = values.min(axis=0), values.max(axis=0)
    scaled = (values - low) / np.where(high > low, high - low, 1.0)
    chosen: list[int] = []
    while len(chosen) < min(keep, len(points)):
        left = [k for k in range(len(points)) if k not in chosen]
        volumes = [hypervolume(scaled[[*chosen, k]]) for k in left]
        best = left[int(np.argmax(volumes))]
        chosen.append(best)
    return [points[k] for k in sorted(chosen)]


REFERENCE = 1.1
"""Corner of the hypervolume beyond the worst of a front scaled to 0 to 1: its ends count, too."""


def hypervolume(values: Array) -> float:
    """Volume between points (n, goals; less is better) and the corner at `REFERENCE`, exactly: by the cells between all
    coordinates.
    """
    axes = [np.unique(np.append(column, REFERENCE)) for column in values.T]
    lows = np.meshgrid(*(axis[:-1] for axis in axes), indexing="ij")
    sizes = np.meshgrid(*(np.diff(axis) for axis in axes), indexing="ij")
    covered = np.zeros(lows[0].shape, dtype=bool)
    for point in values:
        covered |= np.all([low >= own for low, own in zip(lows, point, strict=True)], axis=0)
    return float(np.sum(np.prod(sizes, axis=0)[covered]))


def changed(asked: Asked, point: Point) -> dict[str, Any]:
    """What differs from the base, by key, as a spec has it."""
    before = asked.base.values(())
    return {key: value for key, value in asked.space.changes(point) if apart(at_key(before, key), value)}


def limits_broken(require: Sequence[Requirement], values: Mapping[str, float]) -> tuple[str, ...]:
    """Requirements of the study that figures break, or that they are lacking for."""
    found = ((one, values.get(one.measure, math.nan)) for one in require if one.measure != "yield")
    return tuple(one.measure for one, value in found if not one.holds(value))
