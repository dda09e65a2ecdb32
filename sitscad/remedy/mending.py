"""A spec's text with the fixes of its findings written into it, one after the other, as far as each makes it better."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Generic, Protocol, TypeVar

from sitscad.finding import Edit, Finding, NotChecked, Remedy, Severity
from sitscad.record import record
from sitscad.spec.format.rewriting import CannotWriteError, rewritten


class Judged(Protocol):
    """What is said of a spec's text."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found."""

    @property
    def not_checked(self) -> tuple[NotChecked, ...]:
        """What could not be checked."""


Said = TypeVar("Said", bound=Judged)
Judge = Callable[[str], Said]
May = Callable[[Finding, Remedy], bool]


@record
class Applied:
    """A fix that was written into a text, and the finding that it mended."""

    finding: Finding
    remedy: Remedy


@record(eq=False)
class Mended(Generic[Said]):
    """A text after all fixes that make it better, what is said of it then, and the fixes."""

    text: str
    said: Said
    applied: tuple[Applied, ...]


def mended_text(text: str, judge: Judge[Said], may: May, verdict: Judge[Said] | None = None) -> Mended[Said]:
    """A text with every fix written into it that mends its finding and adds none; `may` says which may be.

    Findings are mended in the order of their rules; after each fix the text is judged again, and what was not better is
    left as it was. Every fix leaves fewer findings, or lets a spec be read further: so it ends, and doing it again
    changes nothing. `judge` says all of a text, fixes included; `verdict` says its findings in less time.
    """
    said, applied = judge(text), list[Applied]()
    seen = {text}
    while (step := _next(text, said, verdict or judge, may, seen)) is not None:
        text, one = step
        seen.add(text)
        said = judge(text)
        applied.append(one)
    return Mended(text, said, tuple(applied))


def _next(text: str, said: Said, verdict: Judge[Said], may: May, seen: set[str]) -> tuple[str, Applied] | None:
    """The text with the first fix that makes it better, and that; None where none does."""
    for finding, remedy in _fixes(said.findings):
        if remedy.brings or not may(finding, remedy):
            continue
        try:
            changed = rewritten(text, remedy.edits)
        except CannotWriteError:
            continue
        one = Applied(finding, remedy)
        if changed not in seen and is_improved(one, said, verdict(changed)):
            return changed, one
    return None


def _fixes(findings: Iterable[Finding]) -> Iterator[tuple[Finding, Remedy]]:
    for finding in sorted(findings, key=lambda found: (found.rule, found.line or 0, found.column or 0)):
        for remedy in finding.fixes:
            yield finding, remedy


def is_improved(applied: Applied, before: Judged, after: Judged) -> bool:
    """Whether a text is better after a fix: it is read further, or one finding is gone and nothing new is wrong."""
    if _unread(before.findings) and is_further(before.findings, after.findings):
        return True
    return is_better(applied, before.findings, after.findings) and _unknown(after) <= _unknown(before)


def _unknown(said: Judged) -> set[str]:
    """The rules of a design that could not be applied, or not wholly."""
    return {skipped.rule for skipped in said.not_checked if not skipped.rule.startswith("SIT0")}


def _unread(findings: Iterable[Finding]) -> bool:
    return any(finding.rule.startswith("SIT0") for finding in findings)


def is_further(before: Iterable[Finding], after: Iterable[Finding]) -> bool:
    """Whether nothing is left of what kept a spec from being read, so that what is said now could not be seen then."""
    return not {(one.rule, one.key) for one in before} & {(one.rule, one.key) for one in after}


def is_better(applied: Applied, before: Iterable[Finding], after: Iterable[Finding]) -> bool:
    """Whether a finding is gone, or milder, and none is new or weighs more than it did; a note is no reason to leave an
    error or a warning. What a key holds could not be judged as long as its name was wrong.
    """
    finding = applied.finding
    read = [f"{_new_key(edit)}." for edit in applied.remedy.edits if edit.what == "name"]
    seen = [found for found in after if not any(f"{found.key}.".startswith(key) for key in read)]
    now, then, place = _weighed(seen), _weighed(before), (finding.rule, finding.key, finding.severity)
    new = {severity for _, _, severity in now - then}
    return now[place] < then[place] and new <= ({Severity.NOTE} - {finding.severity})


def _new_key(edit: Edit) -> str:
    parent = edit.key.rpartition(".")[0]
    return f"{parent}.{edit.new}" if parent else edit.new


_Weighed = Counter[tuple[str, str | None, Severity]]


def _weighed(findings: Iterable[Finding]) -> _Weighed:
    """How many findings of each rule and key weigh as much as each severity, or more."""
    order = list(Severity)
    return Counter((f.rule, f.key, milder) for f in findings for milder in order[order.index(f.severity) :])
