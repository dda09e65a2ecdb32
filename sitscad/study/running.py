"""A study at work: its designs evaluated on both levels, each once, and what each costs by what is asked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from heapq import nsmallest
from statistics import NormalDist

import numpy as np

from sitscad.checks import all_rules
from sitscad.data import rows
from sitscad.policy import stands_for
from sitscad.record import record
from sitscad.study.document import ALL, Asked
from sitscad.study.evaluating import IN_FULL, Workers
from sitscad.study.evaluation import FULL, SCREEN, Archive, Breach, Evaluation, UnitJudged
from sitscad.study.measures import MEASURES
from sitscad.study.search import Costs, method_for, ranked, search
from sitscad.study.space import Point
from sitscad.study.spreads import DRAWS, draws, judge_units

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

