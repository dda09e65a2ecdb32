"""Changes of a spec, and the search for a change that removes a finding, for hints and for `--fix`.

A rule yields its finding with families of changes. A family is a list of changes of one kind. The search tries them in
order within a `Budget`, and writes the hint. The budget limits the number of trials and not the time, so every computer
writes the same hints.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace
from typing import Any, ClassVar

from sitscad.basics.finding import Edit
from sitscad.basics.messages import text_of
from sitscad.basics.record import record
from sitscad.spec.sensor import SensorSpec

DECISIVE = "decisive"

LEVELS = {"none": (0, 0, 0), DECISIVE: (6, 2, 200), "full": (1000, 300, 1_000_000)}
"""Limits of trials for hints, by the name of the budget.

Columns are the number of boards to lay out, the number of designs to estimate, and the number of router branches. A
board with n coils counts as n boards. A branch is one attempt of the router to place a lead.
"""

MOST_BRANCHES = 10_000
"""Largest number of router branches for one board. If it is exceeded, the next change is tried."""

HINTS = tuple(LEVELS)
"""Names of the budgets for hints: no trials, few trials, or many trials, which take minutes."""

WARNING_BUDGET = (3, 1)
"""Number of boards to lay out, and number of designs to estimate, for the hints of all warnings together.

These limits apply to the small budget `DECISIVE` only. A board with n coils counts as n boards.
"""

OTHER_BOARD = 2
"""Number of estimates that the budget subtracts for a changed board, because its windings are computed again."""

MORE_TRIALS = "sitscad check --hints full"
"""Command that a hint names if its search used up the budget before all changes were tried."""

LEAST_HELPFUL_GAIN = 1.1
"""Least gain with which the hint names a change that helps, but does not remove the finding.

The gain is the factor by which the change moves the value towards its limit.
"""

DRAWN = ("coil.", "fpc.tail", "fpc.panel")
"""Beginnings of the spec keys that no change may set if the user has drawn the coil and its board."""

MAX_NAMED_CHANGES = 4
"""Largest number of changes that a hint names although they do not help. They are the changes tried last."""


class Budget:
    """Number of trials that remain for the hints of a check.

    ``layouts`` is the number of boards to lay out, where a board with n coils counts as n boards. ``estimates`` is the
    number of designs to estimate. ``branches`` is the number of attempts of the router to place a lead. A budget is
    large (`is_long`) if it begins with more estimates than the budget `DECISIVE`, otherwise small.
    """

    def __init__(self, layouts: int, estimates: int, branches: int) -> None:
        self.layouts, self.estimates, self.branches = layouts, estimates, branches
        self.is_long = estimates > LEVELS[DECISIVE][1]

    @classmethod
    def of(cls, hints: str) -> Budget:
        """Return the budget with a name of `HINTS`. Raises ValueError for any other name."""
        if hints not in LEVELS:
            raise ValueError(f"hints are one of {', '.join(HINTS)}, not {hints!r}")
        return cls(*LEVELS[hints])

    @property
    def is_spent(self) -> bool:
        """Whether no further design can be tried."""
        return self.layouts <= 0 or self.estimates <= 0

    def begin_warnings(self) -> None:
        """Limit the remaining trials of a small budget to `WARNING_BUDGET`. A large budget does not change.

        Trials for errors come before this call. So a check without errors remains fast.
        """
        if not self.is_long:
            self.layouts, self.estimates = min(self.layouts, WARNING_BUDGET[0]), min(self.estimates, WARNING_BUDGET[1])

    @property
    def board_branches(self) -> int:
        """Number of router branches for the next board: half of the remaining branches, at most `MOST_BRANCHES`."""
        return min(self.branches // 2, MOST_BRANCHES)

    def lays_out(self, coils: int) -> bool:
        """Subtract a board with `coils` coils. Return False, and subtract nothing, if no boards remain."""
        is_left = self.layouts > 0
        self.layouts -= is_left * coils
        return is_left

    def estimates_one(self, is_same_board: bool) -> bool:
        """Subtract an estimate from the budget. Return False, and subtract nothing, if no estimates remain.

        If the board is unchanged (`is_same_board`), the design counts as one estimate. If the board is changed, the
        design counts as `OTHER_BOARD` estimates.
        """
        is_left = self.estimates > 0
        self.estimates -= is_left * (1 if is_same_board else OTHER_BOARD)
        return is_left


@record
class Fix:
    """Change of a spec: the edits of its text, and the changed spec.

    ``description`` is the text of the change in hints. If it is empty, the hint lists the edits, as in "key: value with
    key: value".
    """

    edits: tuple[Edit, ...]
    spec: SensorSpec
    description: str = ""

    def with_also(self, fix: Fix) -> Fix:
        """Return one change that makes this change, then `fix`. The edits of `fix` must apply to this change's spec."""
        text = " with ".join(part for part in (self.words, fix.words) if part)
        return Fix((*self.edits, *fix.edits), fix.spec, text)

    @property
    def words(self) -> str:
        """Text of the change in hints: ``description``, or else the keys and their new values."""
        return self.description or " with ".join(f"{edit.key}: {edit.new}" for edit in self.edits)


Family = Callable[[], Iterable[Fix]]
"""Function that yields changes of one kind, the best first. A search calls it only when it needs these changes."""


@record
class CostlyFamily:
    """Family of changes whose computation takes long, because it computes the windings of trial coils.

    A search that has used up its budget skips such a family.
    """

    changes: Family
    is_costly: ClassVar[bool] = True

    def __call__(self) -> Iterable[Fix]:
        """Return the changes of the family, the best first."""
        return self.changes()


GROWTH, AMOUNTS = 1.7, 4
"""Ratio of successive amounts of a `FamilyByAmount`, and number of its amounts."""

HALVINGS = 5
"""Number of bisection steps by which a search with a large budget reduces an amount that removes the finding.

A step halves the range between an amount that does not remove the finding and an amount that does.
"""


@record
class FamilyByAmount:
    """Family of changes that differ by an amount (m), such as a length added to a coil.

    `move` returns the change by an amount. The first of the `AMOUNTS` amounts is `first` (m). Each next amount is
    larger by the factor `GROWTH`. Amounts are rounded up to multiples of `grain` (m). Changes to specs for which `fits`
    returns False are not tried. If `is_costly`, a search that has used up its budget skips the family.
    """

    move: Callable[[float], Fix]
    first: float
    grain: float = 10e-6
    fits: Callable[[SensorSpec], bool] = lambda _: True
    is_costly: bool = False

    def rounded(self, amount: float) -> float:
        """Return an amount (m) rounded up to a multiple of `grain`. The result is at least one `grain`."""
        return max(self.grain, math.ceil(amount / self.grain - 1e-6) * self.grain)

    @property
    def amounts(self) -> list[float]:
        """Amounts (m) to try, in ascending order."""
        return [self.rounded(self.first * GROWTH**step) for step in range(AMOUNTS)]

    def __call__(self) -> Iterator[Fix]:
        """Yield the changes that have edits, and for whose spec `fits` returns True."""
        return (fix for fix in map(self.move, self.amounts) if fix.edits and self.fits(fix.spec))

    def smaller(self, fix: Fix, trial: Trial) -> Iterator[tuple[Fix, RemainingProblems]]:
        """Yield changes by smaller amounts than `fix` that also remove the finding, each with its remaining problems.

        The amounts are found by bisection, and the smallest is last. Changes with new warnings or worse values are left
        out. `trial` tries a change.
        """
        amounts = self.amounts
        number = next(k for k, amount in enumerate(amounts) if self.move(amount) == fix)
        low, high = amounts[number - 1] if number else 0.0, amounts[number]
        for _ in range(HALVINGS):
            middle = self.rounded(0.5 * (low + high))
            if middle >= high - 0.5 * self.grain:
                return
            remaining = trial(smaller := self.move(middle))
            if remaining is not None and not (remaining.broken or remaining.new_warnings or remaining.worse):
                high = middle
                yield smaller, remaining
            else:
                low = middle


def with_value(spec: SensorSpec, key: str, value: object, written: str, description: str = "") -> Fix:
    """Return the change that sets one value of the spec.

    `key` is the dotted key of the value, as in ``fpc.margin``. `value` is the new value, and `written` its text in
    YAML. `description` is the text of the change in hints. If it is empty, hints show `key` and `written`.
    """

    def changed(of: Any, names: list[str]) -> Any:
        new = value if len(names) == 1 else changed(getattr(of, names[0]), names[1:])
        return replace(of, **{names[0]: new})

    return Fix((Edit(key, written),), changed(spec, key.split(".")), description)


@record
class RemainingProblems:
    """Problems that a trial found in a changed design.

    Attributes
    ----------
    broken : tuple of str
        identifiers of the finding's own rule, if the finding remains, and of the rules with new errors
    new_warnings : tuple of str
        identifiers of the rules with new warnings or more warnings; these speak against the change
    worse : tuple of str
        identifiers of the rules whose values are farther beyond their limits than before; these do not speak against
        the change if it removes an error
    gain : float
        factor by which the value of the remaining finding moves towards its limit; 1 if it is unknown
    """

    broken: tuple[str, ...] = ()
    new_warnings: tuple[str, ...] = ()
    worse: tuple[str, ...] = ()
    gain: float = 1.0


@record
class Search:
    """Result of a search for changes that remove a finding.

    ``mending`` are the changes that remove it. ``ineffective`` are the tried changes that do not remove it. Each change
    has the problems that remain after it. ``is_cut_short`` is True if the search stopped because the budget was used
    up.
    """

    mending: tuple[tuple[Fix, RemainingProblems], ...] = ()
    ineffective: tuple[tuple[Fix, RemainingProblems], ...] = ()
    is_cut_short: bool = False


Trial = Callable[[Fix], RemainingProblems | None]
"""Function that tries a change and returns the remaining problems. It returns None if the budget does not suffice."""


def search(families: Iterable[Family], trial: Trial, budget: Budget, fixed: tuple[str, ...] = ()) -> Search:
    """Try families of changes in order. Return the changes that remove the finding, and the other tried changes.

    In each family, changes are tried until one removes the finding without a new warning. With a small budget, the
    first such change ends the search. `trial` tries a change. Changes of keys that begin with a text in `fixed` are
    left out.
    """
    mending: list[tuple[Fix, RemainingProblems]] = []
    vain: list[tuple[Fix, RemainingProblems]] = []
    is_cut_short = False
    for family in families:
        if budget.is_spent and getattr(family, "is_costly", False):
            is_cut_short = True
            continue
        candidates: list[tuple[Fix, RemainingProblems]] = []
        for fix in family():
            if any(edit.key.startswith(fixed) for edit in fix.edits):
                continue
            remaining = trial(fix)
            if remaining is None:
                is_cut_short = True
                if budget.is_spent:
                    break  # another family may begin with a change that was already tried for another finding
            elif remaining.broken:
                vain.append((fix, remaining))
            elif remaining.new_warnings or (remaining.worse and budget.is_long):
                candidates.append((fix, remaining))
            else:
                candidates.insert(0, (fix, remaining))
                if isinstance(family, FamilyByAmount) and budget.is_long:
                    candidates[:1] = [candidates[0], *family.smaller(fix, trial)][-1:]
                break
        mending += candidates[:1]
        if candidates and not candidates[0][1].new_warnings and not budget.is_long:
            break
    mending.sort(key=lambda pair: (bool(pair[1].new_warnings), bool(pair[1].worse)))
    if not budget.is_long:
        is_cut_short, mending = is_cut_short and not mending, mending[:1]
    return Search(tuple(mending), tuple(vain), is_cut_short)


def hint_text(advice: str, result: Search, already: Collection[str]) -> str:
    """Return the hint: the changes that remove the finding, or else the change that helps most, then `advice`.

    If no change removes the finding, the changes tried last follow in brackets. If the budget was used up, the hint
    names the command that searches further. `already` are the rules with findings in the unchanged design.
    """
    changes = [_filled_hint("tried-brings", change=fix.words, warnings=warnings) if warnings else fix.words
               for fix, remaining in result.mending
               for warnings in [warnings_text(sorted({*remaining.new_warnings, *remaining.worse}), already)]]
    nearest = max((pair for pair in result.ineffective if pair[1].gain >= LEAST_HELPFUL_GAIN),
                  key=lambda pair: pair[1].gain, default=None)
    trial_text = ""
    if changes:
        trial_text = _filled_hint("tried", changes="; or ".join(changes))
    elif nearest is not None:
        trial_text = _filled_hint("tried-helps", change=nearest[0].words, gain=nearest[1].gain)
    named = None
    if len(changes) == 1:
        named = re.search(rf"(?<![\w.]){re.escape(result.mending[0][0].words)}(?![\w.])", advice)
    if named is not None:  # the advice contains the change: insert the result at its place
        hint = f"{advice[: named.start()]}{trial_text}{advice[named.end() :]}"
    else:
        hint = "; ".join(filter(None, (trial_text, advice)))
    if not result.mending and result.ineffective:
        hint = _filled_hint("tried-in-vain", advice=hint, trials=_vain_trials(result.ineffective))
    return cut_short_hint(hint) if result.is_cut_short else hint


def cut_short_hint(advice: str) -> str:
    """Return the hint `advice` of a search that used up its budget, with the command that searches further."""
    return _filled_hint("not-further", advice=advice, command=MORE_TRIALS)


def _filled_hint(case: str, **values: object) -> str:
    return text_of(case, "hint", values)


def _vain_trials(trials: Iterable[tuple[Fix, RemainingProblems]]) -> str:
    # the last changes go farthest; changes with the same failing rules are named together
    by_failure: dict[tuple[str, ...], list[str]] = {}
    for fix, remaining in list(trials)[-MAX_NAMED_CHANGES:]:
        by_failure.setdefault(remaining.broken, []).append(fix.words)
    return "; ".join(_filled_hint("tried-fails", changes=changes, rules=broken)
                     for broken, changes in by_failure.items())


def warnings_text(rules: Collection[str], already: Collection[str]) -> str:
    """Return a text that names the rules with warnings after a change. Empty if `rules` is empty.

    Rules in `already` have findings before the change, and are listed after the other rules.
    """
    new, more = ([rule for rule in rules if (rule in already) is is_known] for is_known in (False, True))
    groups = (("tried-warns", new), ("tried-warns-more", more))
    return ", ".join(_filled_hint(case, rules=group) for case, group in groups if group)
