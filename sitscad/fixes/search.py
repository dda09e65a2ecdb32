"""A change of the spec as a value, the search for the first that mends a finding, how its outcome is told, and what
such a search may cost: counted in units of work, not timed, so that every machine finds the same hints.

A unit is about a millisecond of a processor of 2020. What laying out and estimating a design costs is foretold from its
numbers, by formulas that were fitted to the times of random designs (tests/benchmarks/check_times.py) and need to be
right within a factor of two only.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any, Protocol

from sitscad.finding import Edit
from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.spec.coil import CoilSpec
from sitscad.spec.sensor import SensorSpec

HINTS = ("none", "decisive", "full")
"""What is searched for hints: nothing, what one more check costs (on the errors first), everything."""

DECISIVE = "decisive"

LEAST, MOST, WHOLE = 600.0, 1000.0, 4000.0
"""Units for hints: at least, at most, and together with the check itself at most."""

AFTER_ERRORS, LARGE = 150.0, 2000.0
"""Units for the hints of warnings of a design that is refused, for its errors come first and mending them changes it,
where its check takes more than so many without hints."""

LOOKS = 1000.0
"""Units for looking at what was not tried any more, before it is named: at its layout, and by rules that need no
estimate.
"""

FULL = 400_000.0
"""Units of the long search: minutes."""

TRIALS_OF_ONE_CHANGE = 10_000
"""No changed board is routed for more trials than these: the next change may be easier."""

TURN, PAIR = {True: 2.0, False: 8.0}, {True: 0.1, False: 0.05}
"""Units that a turn costs the estimate, and a pair of turns: of round coils, and of coils of sides and arcs."""

SOLVING = 150.0
"""Units that solving the target takes, where a share of an endless one's effect is not enough."""

MAGNETIC, POOR, SMALL, LONG_FROM = 1.5, 5e6, 0.8, 1.05
"""Relative permeability from which and conductivity (S/m) up to which it likely is, its side over the coil's smaller
one, and how long a coil is over its width."""

LONG = 2.5
"""Coils longer than wide have fewer figures that repeat: so many times that."""


def winding_work(coil: CoilSpec) -> float:
    """Units that winding the coils takes, their inner vias included."""
    return 10.0 + 8.0 * len(coil.layers) ** 2


def layout_work(spec: SensorSpec) -> float:
    """Units that laying a board out takes where its leads find their ways at once."""
    return winding_work(spec.coil) + 40.0 * len(spec.array.placements)


def trial_work(coil: CoilSpec) -> float:
    """Units that one trial of a branch takes the router: more where more turns are in its way."""
    return 0.3 + 0.005 * sum(coil.layer_turns)


def estimate_work(spec: SensorSpec, is_same_board: bool = False, is_solved: bool = False) -> float:
    """Units that an estimate takes; less of a board that was estimated before, only with other things around it; more
    where the target `is_solved` in a design like it.
    """
    target, (long, short), solved = spec.target, sorted(spec.coil.size, reverse=True), False
    if target is not None:
        # likely: no good conductor, smaller than a coil, or over long coils that it does not cover
        metal = target.material
        is_poor = metal.relative_permeability > MAGNETIC or metal.conductivity < POOR
        is_small = min(target.size) < SMALL * short or (long > LONG_FROM * short and max(target.size) < long)
        solved = is_solved or is_poor or is_small
    around = 100.0 + (100.0 if target is not None else 0.0) + (SOLVING if solved else 0.0)
    if is_same_board:
        return around
    turns, is_round = sum(spec.coil.layer_turns), spec.coil.outline.is_round
    alone = TURN[is_round] * turns + PAIR[is_round] * turns**2
    several = 1.0 + 0.3 * (len(spec.array.placements) - 1)
    return around + (LONG if spec.coil.size[0] != spec.coil.size[1] else 1.0) * alone * several


def check_work(spec: SensorSpec) -> float:
    """Units that a check takes without hints."""
    return layout_work(spec) + estimate_work(spec)


class Budget:
    """How many units of work the search for hints may still take."""

    def __init__(self, units: float) -> None:
        self.left = units

    @classmethod
    def of(cls, hints: str, spec: SensorSpec, is_checked: bool = True) -> Budget:
        """The budget of a choice of HINTS: by default as much as the check of the design itself takes, for both
        together have to be quick, and twice that where it was not checked. Raises ValueError for any other choice.
        """
        if hints not in HINTS:
            raise ValueError(f"hints are one of {', '.join(HINTS)}, not {hints!r}")
        if hints != DECISIVE:
            return cls(0.0 if hints == "none" else FULL)
        work = check_work(spec)
        return cls(max(LEAST, min(work, MOST, WHOLE - work)) + (0.0 if is_checked else min(work, MOST)))

    def spend(self, units: float) -> bool:
        """Take so many units; False, and nothing is taken, where fewer are left."""
        if units > self.left:
            return False
        self.left -= units
        return True

    def after_errors(self, spec: SensorSpec) -> Budget:
        """What is left of it for the warnings of a design that is refused."""
        return self if self.is_long or check_work(spec) <= LARGE else Budget(min(self.left, AFTER_ERRORS))

    def for_warnings(self) -> Budget:
        """What is left of it where nothing was refused: a design that passes is not to be held up long."""
        return self if self.is_long else Budget(min(self.left, LEAST))

    @property
    def is_long(self) -> bool:
        """Whether much may be tried: alternatives are looked for, too."""
        return self.left > WHOLE


@record
class Fix:
    """A change of a spec: its edits, and the spec with them applied. ``said`` is how it is told where that is not "key:
    value with key: value"; ``brings`` says which rules warn of the changed design and not, or of less, of the design as
    it stands.
    """

    edits: tuple[Edit, ...]
    spec: SensorSpec
    said: str = ""
    brings: str = ""

    def with_also(self, fix: Fix) -> Fix:
        """This fix together with another, which was made for the spec that this one leaves."""
        told = " with ".join(words for words in (self.words, fix.words) if words)
        return Fix((*self.edits, *fix.edits), fix.spec, told)

    @property
    def words(self) -> str:
        """The keys and values as they are to be written, and what they bring."""
        told = self.said or " with ".join(f"{edit.key}: {edit.new}" for edit in self.edits)
        return f"{told} (clears this; {self.brings})" if self.brings else told


def setting(spec: SensorSpec, key: str, value: object, written: str, said: str = "") -> Fix:
    """One value of the spec set to another: `key` is its place in the text and its path in the spec, `written` how the
    value stands in the text.
    """

    def changed(of: Any, names: list[str]) -> Any:
        new = value if len(names) == 1 else changed(getattr(of, names[0]), names[1:])
        return replace(of, **{names[0]: new})

    return Fix((Edit(key, written),), changed(spec, key.split(".")), said)


def fail(rules: tuple[str, ...]) -> str:
    """Words that say which rules fail."""
    return f"{', '.join(rules)} fail{'s' if len(rules) == 1 else ''}"


def warn(rules: Iterable[str], already: Collection[str] = ()) -> str:
    """Words that say which rules warn: of more, those that do `already`."""
    known = list(rules)
    new, more = [rule for rule in known if rule not in already], [rule for rule in known if rule in already]
    said = ((new, ""), (more, " of more"))
    return " and ".join(f"{', '.join(some)} then warn{'s' * (len(some) == 1)}{than}" for some, than in said if some)


class Left(Protocol):
    """What a change of the spec leaves to complain of, when the changed design is laid out, estimated and checked."""

    def __call__(self, fix: Fix, /) -> tuple[str, ...] | None:
        """What it still breaks: the rule in question, and those with errors that the spec as it stands has not. None
        where that was not tried, because the budget does not reach so far. A fix that leaves nothing is kept: the
        finding is told with it.
        """

    def mends(self, fix: Fix) -> None:
        """Tell the finding with a fix that was laid out and held against the rules that matter, but not estimated."""

    def warned(self, changed: SensorSpec) -> str:
        """Which other rules warn of it, and of the spec as it stands not or of less, in words; of a change that breaks
        nothing.
        """

    def stands(self, fix: Fix) -> bool:
        """Whether a fix that was not tried was laid out and nothing that needs no estimate speaks against it."""

    def share(self, changed: SensorSpec) -> float | None:
        """The share by which the reading changes over the required force, of the coil where it changes most; None where
        that was not tried, or nothing is felt.
        """

    def drawn(self, changed: SensorSpec) -> Layout | None:
        """The changed design laid out, no more; None where the budget does not reach so far."""

    def affords(self, units: float) -> bool:
        """Take so many units of the budget; False where fewer are left."""

    @property
    def is_cut_short(self) -> bool:
        """Whether something was not tried in this search."""

    def wants_another(self) -> bool:
        """Whether a second way is to be looked for once one is found; what is not looked for cuts the search short."""


def first_that_mends(fixes: Iterable[Fix], left: Left) -> Fix | None:
    """The first fix with which nothing is left to complain of, else the first that only brings warnings, with those;
    None where none was found. It ends where the budget does.
    """
    second = None
    for fix in fixes:
        broken = left(fix)
        if broken is None:
            break
        if broken:
            continue
        brings = left.warned(fix.spec)
        if not brings:
            return fix
        second = second or replace(fix, brings=brings)
    return second


def ways(families: Iterable[Iterable[Fix]], left: Left) -> list[Fix]:
    """The first fix of each family that mends; of the first family with one, where one is enough."""
    found: list[Fix] = []
    for fixes in families:
        if found and not left.wants_another():
            break
        fix = first_that_mends(fixes, left)
        if fix is not None:
            found.append(fix)
    return found


def named(fixes: Iterable[Fix]) -> str:
    """Fixes as alternatives, each as it is to be written."""
    return "; or ".join(fix.words for fix in fixes)


def in_vain(fixes: Iterable[Fix], left: Left) -> str:
    """Fixes that mend nothing, with what each leaves or breaks, said once of those that do the same; not those that
    were not tried.
    """
    alike: dict[tuple[str, ...], list[str]] = {}
    for fix in fixes:
        if broken := left(fix):
            alike.setdefault(broken, []).append(fix.words)
    return "; ".join(f"{', '.join(words)} (then {fail(broken)})" for broken, words in alike.items())


def untried(fixes: Iterable[Fix], left: Left) -> str:
    """The first fix that was not tried and is not refused at first sight, in words that say so; nothing where none is
    left.
    """
    fix = next((fix for fix in fixes if left(fix) is None and left.stands(fix)), None)
    return "" if fix is None else f"perhaps {fix.words} (not tried)"


def first_or_vain(fixes: list[Fix], left: Left, instead: tuple[str, str, str]) -> str:
    """The first fix that mends, in words, with the alternative to it; where the search ended before it found one, the
    first that was not tried; else what else would do, and what was tried in vain. ``instead`` is what stands between
    the fix and "(it was tried)", the alternative, and what else would do.
    """
    between, alternative, else_does = instead
    found = first_that_mends(fixes, left)
    if found is not None:
        return f"{found.words}{between} (it was tried), or {alternative}"
    if left.is_cut_short:
        perhaps = untried(fixes, left)
        return f"{perhaps}, or {alternative}" if perhaps else ""
    vain = f" (tried in vain: {in_vain(fixes, left)})" if fixes else ""
    return f"{else_does}{vain}"


def first_tried(families: Sequence[Sequence[Fix]], otherwise: str = "") -> Callable[[Left], str]:
    """Writes a hint with the first fix of each family that mends; where none does, with what else would do, and what
    was tried in vain.
    """

    def advice(left: Left) -> str:
        found = ways(families, left)
        if found:
            return f"{named(found)} (tried)"
        vain = in_vain((fix for family in families for fix in family), left)
        return "; ".join(words for words in (otherwise, f"tried in vain: {vain}" if vain else "") if words)

    return advice


def broken_by(fixes: Iterable[Fix], left: Left) -> tuple[str, ...]:
    """All that fixes leave or break, of those that were tried."""
    return tuple(sorted({rule for fix in fixes for rule in left(fix) or ()}))


def tried(fix: Fix, left: Left) -> str:
    """What became of a fix that was tried, in brackets with a space before: that it mends, or what then fails; nothing
    where it was not tried.
    """
    broken = left(fix)
    if broken is None:
        return ""
    if broken:
        return f" (tried, but {fail(broken)} then)"
    brings = left.warned(fix.spec)
    return f" (it was tried: clears this; {brings})" if brings else " (it was tried)"
