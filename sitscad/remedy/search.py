"""A search for what mends a finding: which fix is the first that does, and how its outcome is told."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Protocol

from sitscad.layout.board import Layout
from sitscad.remedy.fix import Fix, fail, warn
from sitscad.spec.sensor import SensorSpec


class Left(Protocol):
    """What a change of the spec leaves to complain of, when the changed design is laid out, estimated and checked."""

    def __call__(self, fix: Fix, /) -> tuple[str, ...] | None:
        """What it still breaks: the rule in question, and those with errors that the spec as it stands has not.

        None where that was not tried, because the budget does not reach so far. A fix that leaves nothing is kept: the
        finding is told with it.
        """

    def mends(self, fix: Fix) -> None:
        """Tell the finding with a fix that was laid out and held against the rules that matter, but not estimated."""

    def warned(self, changed: SensorSpec) -> tuple[str, ...]:
        """Other rules that warn of it, and of the spec as it stands not or of less; of a change that breaks nothing."""

    def stands(self, fix: Fix) -> bool:
        """Whether a fix that was not tried was laid out and nothing that needs no estimate speaks against it."""

    def share(self, changed: SensorSpec) -> float | None:
        """By how much of itself the reading changes over the required force, of the coil where it changes most; None
        where that was not tried, or nothing is felt.
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
    """Fixes that mend nothing, each with what it leaves or breaks; not those that were not tried."""
    tried_ones = ((fix, left(fix)) for fix in fixes)
    return "; ".join(f"{fix.words} (then {fail(broken)})" for fix, broken in tried_ones if broken)


def untried(fixes: Iterable[Fix], left: Left) -> str:
    """The first fix that was not tried and is not refused at first sight, in words that say so; nothing where none is
    left.
    """
    fix = next((fix for fix in fixes if left(fix) is None and left.stands(fix)), None)
    return "" if fix is None else f"perhaps {fix.words} (not tried)"


def first_or_vain(fixes: list[Fix], left: Left, instead: tuple[str, str, str]) -> str:
    """The first fix that mends, in words, with the alternative to it; where the search ended before it found one, the
    first that was not tried; else what else would do, and what was tried in vain.

    ``instead`` is what stands between the fix and "(it was tried)", the alternative, and what else would do.
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
    return f" (it was tried; {warn(brings)} then)" if brings else " (it was tried)"
