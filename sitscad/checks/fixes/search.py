"""A change of a spec as a value, and the search for a change that mends a finding, for hints and for `--fix`.

A rule gives families of changes with its finding. The search tries them in order within a budget of trials, and writes
the hint. The budget counts trials and not time, so every machine finds the same hints.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace
from typing import Any, ClassVar

from sitscad.basics.finding import Edit
from sitscad.basics.record import record
from sitscad.spec.sensor import SensorSpec

DECISIVE = "decisive"

LEVELS = {"none": (0, 0, 0), DECISIVE: (6, 2, 200), "full": (1000, 300, 1_000_000)}
"""Trials for hints: boards laid out (each counts as its number of coils), designs estimated, branches of the router."""

MOST_BRANCHES = 10_000
"""Largest number of the router's branches for one board. The next change may be easier."""

HINTS = tuple(LEVELS)
"""Choices of the number of trials for hints: none, few, and many (minutes)."""

FOR_WARNINGS = (3, 1)
"""Boards (counted as their coils) and estimates for warnings, if few trials are made."""

OTHER_BOARD = 2
"""Estimates that the estimate of another board counts as, because its windings are solved anew."""

NOT_FURTHER = "not searched further: sitscad check --hints full"
"""Text of a hint that the budget cut short."""

HELPS = 1.1
"""Least factor towards the limit for which a hint names a change that does not mend the finding."""

NAMED = 4
"""Largest number of unsuccessful changes that a hint names."""


class Budget:
    """Remaining trials for the hints of a check."""

    def __init__(self, layouts: int, estimates: int, branches: int) -> None:
        self.layouts, self.estimates, self.branches = layouts, estimates, branches
        self.is_long = estimates > LEVELS[DECISIVE][1]

    @classmethod
    def of(cls, hints: str) -> Budget:
        """Return the budget for one of the choices `HINTS`. Raises ValueError for any other choice."""
        if hints not in LEVELS:
            raise ValueError(f"hints are one of {', '.join(HINTS)}, not {hints!r}")
        return cls(*LEVELS[hints])

    @property
    def is_spent(self) -> bool:
        """Whether no further design can be tried."""
        return self.layouts <= 0 or self.estimates <= 0

    def begin_warnings(self) -> None:
        """Return reduce a small budget to the trials for warnings.

        Errors come first, and checks without errors stay fast.
        """
        if not self.is_long:
            self.layouts, self.estimates = min(self.layouts, FOR_WARNINGS[0]), min(self.estimates, FOR_WARNINGS[1])

    @property
    def board_branches(self) -> int:
        """Router branches for the next board: half of the remaining branches."""
        return min(self.branches // 2, MOST_BRANCHES)

    def lays_out(self, coils: int) -> bool:
        """Take the layout of a board from the budget. Return False if none is left."""
        is_left = self.layouts > 0
        self.layouts -= is_left * coils
        return is_left

    def estimates_one(self, is_same_board: bool) -> bool:
        """Take the estimate of one design from the budget. Return False if none is left."""
        is_left = self.estimates > 0
        self.estimates -= is_left * (1 if is_same_board else OTHER_BOARD)
        return is_left


@record
class Fix:
    """A change of a spec: its edits, and the changed spec.

    ``said`` is its text, if it differs from "key: value with key: value".
    """

    edits: tuple[Edit, ...]
    spec: SensorSpec
    said: str = ""

    def with_also(self, fix: Fix) -> Fix:
        """Return this fix combined with another fix, which was made for the spec that this fix leaves."""
        text = " with ".join(part for part in (self.words, fix.words) if part)
        return Fix((*self.edits, *fix.edits), fix.spec, text)

    @property
    def words(self) -> str:
        """Keys and values as they are to be written."""
        return self.said or " with ".join(f"{edit.key}: {edit.new}" for edit in self.edits)


Family = Callable[[], Iterable[Fix]]
"""Changes of one kind, the best first. They are made when a search needs them."""


@record
class Costly:
    """A family whose changes take as long to find as to try, because coils are wound for them.

    A search with a spent budget skips it.
    """

    changes: Family
    is_costly: ClassVar[bool] = True

    def __call__(self) -> Iterable[Fix]:
        """Return the changes."""
        return self.changes()


GROWTH, AMOUNTS = 1.7, 4
"""Factor between successive amounts to try, and number of amounts."""

HALVINGS = 5
"""Number of bisection steps between an amount that does not mend and an amount that does, in a long search."""


@record
class Growing:
    """A family of changes by an amount (m), from `first` on.

    Amounts are rounded up to the `grain` (m). Changes for which `fits` is false are not tried. `is_costly` is as in
    `Costly`.
    """

    move: Callable[[float], Fix]
    first: float
    grain: float = 10e-6
    fits: Callable[[SensorSpec], bool] = lambda _: True
    is_costly: bool = False

    def rounded(self, amount: float) -> float:
        """Return an amount rounded up."""
        return max(self.grain, math.ceil(amount / self.grain - 1e-6) * self.grain)

    @property
    def amounts(self) -> list[float]:
        """Amounts to try."""
        return [self.rounded(self.first * GROWTH**step) for step in range(AMOUNTS)]

    def __call__(self) -> Iterator[Fix]:
        """Yield the changes. Moves without edits are left out."""
        return (fix for fix in map(self.move, self.amounts) if fix.edits and self.fits(fix.spec))

    def smaller(self, fix: Fix, trial: Trial) -> Iterator[tuple[Fix, Left]]:
        """Yield smaller amounts of a fix that mend without a warning, found by bisection. The smallest is last."""
        amounts = self.amounts
        number = next(k for k, amount in enumerate(amounts) if self.move(amount) == fix)
        low, high = amounts[number - 1] if number else 0.0, amounts[number]
        for _ in range(HALVINGS):
            middle = self.rounded(0.5 * (low + high))
            if middle >= high - 0.5 * self.grain:
                return
            remaining = trial(smaller := self.move(middle))
            if remaining is not None and not (remaining.broken or remaining.brings or remaining.worse):
                high = middle
                yield smaller, remaining
            else:
                low = middle


def setting(spec: SensorSpec, key: str, value: object, written: str, description: str = "") -> Fix:
    """Return the fix that sets one value. `key` is its place in text and spec, `written` the value's text."""

    def changed(of: Any, names: list[str]) -> Any:
        new = value if len(names) == 1 else changed(getattr(of, names[0]), names[1:])
        return replace(of, **{names[0]: new})

    return Fix((Edit(key, written),), changed(spec, key.split(".")), description)


@record
class Left:
    """Remaining problems of a changed design that was tried.

    ``broken`` are the finding's own rule if it still complains, and rules with new errors. ``brings`` are rules with
    new warnings, a reason against the change. ``worse`` are rules whose warnings get worse, no reason against mending
    an error. ``gain`` is the factor by which the value of a remaining finding comes nearer to its limit, 1 if unknown.
    """

    broken: tuple[str, ...] = ()
    brings: tuple[str, ...] = ()
    worse: tuple[str, ...] = ()
    gain: float = 1.0


@record
class Search:
    """The outcome of a search: changes that mend, changes that do not, and whether the budget ended it.

    Each change has its remaining problems.
    """

    mending: tuple[tuple[Fix, Left], ...] = ()
    vain: tuple[tuple[Fix, Left], ...] = ()
    is_cut_short: bool = False


Trial = Callable[[Fix], Left | None]
"""Function that tries a change. It returns None if the budget does not suffice."""


def search(families: Iterable[Family], trial: Trial, budget: Budget) -> Search:
    """Try families of changes in order, each until a change mends and brings no warning.

    The first such change ends a search with a small budget.
    """
    mending: list[tuple[Fix, Left]] = []
    vain: list[tuple[Fix, Left]] = []
    is_cut_short = False
    for family in families:
        if budget.is_spent and getattr(family, "is_costly", False):
            is_cut_short = True
            continue
        candidates: list[tuple[Fix, Left]] = []
        for fix in family():
            remaining = trial(fix)
            if remaining is None:
                is_cut_short = True
                if budget.is_spent:
                    break  # another family may begin with a change that was already tried for another finding
            elif remaining.broken:
                vain.append((fix, remaining))
            elif remaining.brings or (remaining.worse and budget.is_long):
                candidates.append((fix, remaining))
            else:
                candidates.insert(0, (fix, remaining))
                if isinstance(family, Growing) and budget.is_long:
                    candidates[:1] = [candidates[0], *family.smaller(fix, trial)][-1:]
                break
        mending += candidates[:1]
        if candidates and not candidates[0][1].brings and not budget.is_long:
            break
    mending.sort(key=lambda pair: (bool(pair[1].brings), bool(pair[1].worse)))
    if not budget.is_long:
        is_cut_short, mending = is_cut_short and not mending, mending[:1]
    return Search(tuple(mending), tuple(vain), is_cut_short)


def hint_text(otherwise: str, result: Search, already: Collection[str]) -> str:
    """Return a hint: the changes that were tried, then other advice. `already` are rules that complain anyway."""
    brings = (warn(sorted({*remaining.brings, *remaining.worse}), already) for _, remaining in result.mending)
    changes = [f"{fix.words} (clears this; {some})" if some else fix.words
             for (fix, _), some in zip(result.mending, brings, strict=True)]
    nearest = max((pair for pair in result.vain if pair[1].gain >= HELPS), key=lambda pair: pair[1].gain, default=None)
    if changes:
        trial_text = f"{'; or '.join(changes)} (tried)"
    elif nearest is not None:
        fix, remaining = nearest
        trial_text = f"{fix.words} helps {remaining.gain:.2g} times and is not enough (tried)"
    else:
        trial_text = ""
    named = _place_of(result.mending[0][0], otherwise) if len(changes) == 1 else None
    if named is not None:  # the advice contains the change: insert the result at its place
        hint = f"{otherwise[: named.start()]}{trial_text}{otherwise[named.end() :]}"
    else:
        hint = "; ".join(filter(None, (trial_text, otherwise)))
    if not result.mending and (vain := _in_vain(result.vain)):
        hint += f" (tried in vain: {vain})"
    return f"{hint} ({NOT_FURTHER})" if result.is_cut_short else hint


def _place_of(fix: Fix, advice: str) -> re.Match[str] | None:
    """Return the place in an advice that has the words of a fix. None if there is none."""
    return re.search(rf"(?<![\w.]){re.escape(fix.words)}(?![\w.])", advice)


def _in_vain(trials: Iterable[tuple[Fix, Left]]) -> str:
    # the last changes go farthest; changes with the same failing rules are named together
    by_failure: dict[tuple[str, ...], list[str]] = {}
    for fix, remaining in list(trials)[-NAMED:]:
        by_failure.setdefault(remaining.broken, []).append(fix.words)
    return "; ".join(f"{', '.join(changes)} (then {fail(broken)})" for broken, changes in by_failure.items())


def fail(rules: tuple[str, ...]) -> str:
    """Return text that names the rules that fail."""
    return f"{', '.join(rules)} fail{'s' if len(rules) == 1 else ''}"


def warn(rules: Iterable[str], already: Collection[str]) -> str:
    """Return text that names rules with warnings. Rules in `already` are named as rules that warn of more."""
    rule_ids = list(rules)
    new, more = [rule for rule in rule_ids if rule not in already], [rule for rule in rule_ids if rule in already]
    groups = ((new, ""), (more, " of more"))
    return " and ".join(f"{', '.join(some)} then warn{'s' * (len(some) == 1)}{than}" for some, than in groups if some)
