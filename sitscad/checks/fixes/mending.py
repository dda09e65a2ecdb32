"""Application of fixes to a spec's text, one after the other. A fix that does not improve the text is undone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Generic, Protocol, TypeVar

from sitscad.basics.finding import Finding, NotChecked, Remedy, Severity
from sitscad.basics.record import record, replace
from sitscad.checks.fixes.search import warnings_text
from sitscad.spec.yaml.rewriting import CannotWriteError, rewritten


class SpecFindings(Protocol):
    """Results of the checks of a spec's text, as far as mending needs them."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings in the text."""

    @property
    def not_checked(self) -> tuple[NotChecked, ...]:
        """Rules that could not be checked."""


CheckResults = TypeVar("CheckResults", bound=SpecFindings)
CheckText = Callable[[str], CheckResults]
IsAllowed = Callable[[Finding, Remedy], bool]


@record
class AppliedFix:
    """A fix that was written into a text, and the finding that it removes.

    `worsens` are the identifiers of rules whose values are farther beyond their limits than before.
    """

    finding: Finding
    remedy: Remedy
    worsens: tuple[str, ...] = ()


@record
class UndoneFix:
    """An allowed fix that is not in the text, because it does not improve the text or cannot be written.

    `why` is the reason as text.
    """

    finding: Finding
    remedy: Remedy
    why: str


@record(eq=False)
class MendedText(Generic[CheckResults]):
    """Text of a spec with all fixes that improve it.

    `check_result` are the results of the checks of this text. `applied` are the fixes in the text, and `rolled_back`
    the allowed fixes that did not improve it.
    """

    text: str
    check_result: CheckResults
    applied: tuple[AppliedFix, ...]
    rolled_back: tuple[UndoneFix, ...] = ()


def mended_text(
    text: str, judge: CheckText[CheckResults], may: IsAllowed, verdict: CheckText[CheckResults] | None = None,
    progress: Callable[[str], None] = lambda step: None,
) -> MendedText[CheckResults]:
    """Apply allowed fixes to a spec's text, one after the other, as long as a fix improves the text.

    Parameters
    ----------
    text : str
        Text of the spec.
    judge : callable
        Checks a text and returns its findings, with their fixes.
    may : callable
        Returns whether a given fix of a given finding is allowed.
    verdict : callable, optional
        Checks a text in less time than `judge` and returns findings without fixes. By default `judge`.
    progress : callable, optional
        Called before each step with a text that describes the step.

    Returns
    -------
    MendedText
        The changed text, the results of its checks, the fixes in it, and the fixes that did not improve it.

    Notes
    -----
    Errors are mended before warnings, and warnings before notes, then in the order of the rules' numbers. After each
    fix the text is checked again, and a fix that does not improve the text is undone. Every fix leaves fewer findings,
    replaces a note that has a fix by a note without, or lets a spec be read further. So the process ends, and a
    repetition changes nothing.
    """
    progress("looking for fixes")
    result, applied = judge(text), list[AppliedFix]()
    past_texts = {text}

    def told(finding: Finding, remedy: Remedy) -> bool:
        """Return whether a fix is allowed. If it is allowed, `progress` is called with the fix."""
        if is_allowed := may(finding, remedy):
            progress(f"{len(applied)} mended, {finding.rule}: trying {'; '.join(edit.words for edit in remedy.edits)}")
        return is_allowed

    while True:
        step, rolled_back = _next_fix(text, result, judge, verdict or judge, told, past_texts)
        if step is None:
            return MendedText(text, result, tuple(applied), rolled_back)
        text, applied_fix = step
        past_texts.add(text)
        applied.append(applied_fix)
        progress(f"{len(applied)} mended, looking for further fixes")
        result = judge(text)


def _next_fix(
    text: str, result: CheckResults, judge: CheckText[CheckResults], verdict: CheckText[CheckResults], may: IsAllowed,
    past_texts: set[str]
) -> tuple[tuple[str, AppliedFix] | None, tuple[UndoneFix, ...]]:
    """Return the first fix that improves a text, with the changed text, and the fixes that do not improve it.

    The first result is (changed text, fix), or None if no fix improves the text. The second result are the allowed
    fixes that do not improve it, each with the reason. It is empty if a fix improves the text. `result` are the
    findings of `text`. `judge`, `verdict` and `may` are as in `mended_text`. `past_texts` are the texts of earlier
    steps. A fix that leads back to an earlier text is no improvement.
    """
    rolled_back: list[UndoneFix] = []
    already = {each.rule for each in result.findings if each.severity is not Severity.NOTE}
    for finding, remedy in _fixes_in_order(result.findings):
        if not may(finding, remedy):
            continue
        if remedy.new_warnings:
            if all(each.finding != finding for each in rolled_back):
                rolled_back.append(UndoneFix(finding, remedy, warnings_text(remedy.new_warnings, already)))
            continue
        try:
            changed = rewritten(text, remedy.edits)
        except CannotWriteError as error:
            rolled_back.append(UndoneFix(finding, remedy, str(error)))
            continue
        applied_fix = AppliedFix(finding, remedy)
        if changed in past_texts:
            rolled_back.append(UndoneFix(finding, remedy, "that is what another fix has changed"))
            continue
        after = verdict(changed)
        is_swap = _swaps_notes(applied_fix, result, after)
        if is_improved(applied_fix, result, after) or (is_swap and not _has_new_fixes(result, judge(changed), may)):
            worsens = tuple(sorted(worsened_rules(result.findings, after.findings)))
            return (changed, replace(applied_fix, worsens=worsens)), ()
        rolled_back.append(UndoneFix(finding, remedy, _no_improvement_reason(applied_fix, result, after)))
    return None, tuple(rolled_back)


def _swaps_notes(applied: AppliedFix, before: SpecFindings, after: SpecFindings) -> bool:
    """Whether a fix removes its note and adds only notes. It must add no more notes than it removes.

    No further rule may be unchecked after the fix.
    """
    gone, new = _removed_and_added(applied, before.findings, after.findings)
    is_note = applied.finding.severity is Severity.NOTE and {severity for _, _, severity in new} == {Severity.NOTE}
    is_fewer = new.total() <= gone.total() and _unchecked_rules(after) <= _unchecked_rules(before)
    return is_note and is_fewer and _finding_place(applied) in gone


def _has_new_fixes(before: SpecFindings, after: SpecFindings, may: IsAllowed) -> bool:
    """Whether a finding that is new in `after` has an allowed fix without new warnings.

    Such a fix might undo the present fix.
    """
    old_keys = {(finding.rule, finding.key) for finding in before.findings}
    fixes = ((f, remedy) for f, remedy in _fixes_in_order(after.findings) if (f.rule, f.key) not in old_keys)
    return any(not remedy.new_warnings and may(finding, remedy) for finding, remedy in fixes)


def _no_improvement_reason(applied: AppliedFix, before: SpecFindings, after: SpecFindings) -> str:
    """Return the reason, as text, why a fix does not improve a spec.

    `before` and `after` are the results of the checks without and with the fix.
    """
    gone, new = _removed_and_added(applied, before.findings, after.findings)
    if _finding_place(applied) not in gone:
        return f"{applied.finding.rule} stays" + (f", and {_new_findings_text(new)}" if new else "")
    if new:
        return _new_findings_text(new)
    if worse := worsened_rules(before.findings, after.findings):
        return f"{', '.join(sorted(worse))} gets worse"
    unknown = sorted(_unchecked_rules(after) - _unchecked_rules(before))
    return f"{', '.join(unknown)} can then not be checked"


def worsened_rules(before: Iterable[Finding], after: Iterable[Finding]) -> set[str]:
    """Return the rules whose values are farther beyond their limits than before.

    The distance beyond the limit, divided by the limit, must have grown by more than `WORSE`. Only rules with findings
    both before and after are compared. Notes are left out.
    """
    was, now = _largest_excess_by_rule(before), _largest_excess_by_rule(after)
    return {rule for rule, excess in now.items() if excess > was.get(rule, excess) + WORSE}


WORSE = 0.01
"""Increase of the distance beyond a limit, divided by the limit, up to which a value does not count as worse."""


def _largest_excess_by_rule(findings: Iterable[Finding]) -> dict[str, float]:
    # Largest distance of each rule's errors and warnings beyond their limits, as a fraction of the limit.
    by_rule: dict[str, float] = {}
    for finding in findings:
        if finding.severity is not Severity.NOTE and finding.measured is not None and finding.limit:
            beyond = abs(finding.measured / finding.limit - 1.0) * (-1.0 if finding.keeps_limit else 1.0)
            by_rule[finding.rule] = max(by_rule.get(finding.rule, -1.0), beyond)
    return by_rule


def _new_findings_text(new: _Counts) -> str:
    """Return a text with the rules of the new findings, each with its highest severity in parentheses."""
    gravest = {rule: severity for rule, _, severity in sorted(new, key=lambda entry: -list(Severity).index(entry[2]))}
    return "it brings " + ", ".join(f"{rule} ({gravest[rule].value})" for rule in sorted(gravest))


def _fixes_in_order(findings: Iterable[Finding]) -> Iterator[tuple[Finding, Remedy]]:
    order = list(Severity)
    for finding in sorted(findings, key=lambda each: (order.index(each.severity), each.rule, each.line or 0,
                                                     each.column or 0)):
        for remedy in finding.fixes:
            yield finding, remedy


def is_improved(applied: AppliedFix, before: SpecFindings, after: SpecFindings) -> bool:
    """Whether a fix improves the text of a spec. Either of two improvements is sufficient.

    The first is for a text that could not be read as a spec (findings SIT0xx): all its former findings are gone. The
    second is for every text. The finding is gone or milder without new problems (`is_better`), and every rule that was
    checked before is still checked.
    """
    is_unread = any(finding.rule.startswith("SIT0") for finding in before.findings)
    return (is_unread and are_former_findings_gone(before.findings, after.findings)) or (
        is_better(applied, before.findings, after.findings) and _unchecked_rules(after) <= _unchecked_rules(before))


def _unchecked_rules(result: SpecFindings) -> set[str]:
    """Return the rules that were not checked, or not completely. Rules about the spec itself (SIT0xx) are left out."""
    return {skipped.rule for skipped in result.not_checked if not skipped.rule.startswith("SIT0")}


def are_former_findings_gone(before: Iterable[Finding], after: Iterable[Finding]) -> bool:
    """Whether all former findings are gone. New findings do not count, because they could not be found before."""
    return not {(finding.rule, finding.key) for finding in before} & {(finding.rule, finding.key) for finding in after}


def is_better(applied: AppliedFix, before: Iterable[Finding], after: Iterable[Finding]) -> bool:
    """Whether the finding of a fix is gone or milder, no finding is new or more severe, and no value is worse.

    If the fix is for an error or a warning, new notes are permitted. If it is for an error, worse values are permitted.
    If the fix corrects the name of a key, this key may have new findings, because its value was not checked before.
    """
    gone, new = _removed_and_added(applied, before, after)
    allowed = {Severity.NOTE} - {applied.finding.severity}
    is_gone = _finding_place(applied) in gone and {severity for *_, severity in new} <= allowed
    is_error = applied.finding.severity is Severity.ERROR
    return is_gone and (is_error or not worsened_rules(before, after))


def _removed_and_added(
    applied: AppliedFix, before: Iterable[Finding], after: Iterable[Finding]
) -> tuple[_Counts, _Counts]:
    """Return two counts by (rule, key, severity): the findings that a fix removes, and the findings that it adds.

    A finding is counted at its own severity and at each milder severity. A finding at another key than before is not
    new, if its rule has no more findings in total than before.
    """
    read = [f"{edit.key.rpartition('.')[0]}.{edit.new}.".removeprefix(".")
            for edit in applied.remedy.edits if edit.what == "name"]
    comparable = [finding for finding in after if not any(f"{finding.key}.".startswith(key) for key in read)]
    now, then = _finding_counts(comparable), _finding_counts(before)
    gone, new = then - now, now - then
    return gone, Counter({entry: count for entry, count in new.items() if entry[0] == applied.finding.rule
                          or _count_at_any_key(now, entry) > _count_at_any_key(then, entry)})


def _count_at_any_key(weighed: _Counts, entry: tuple[str, str | None, Severity]) -> int:
    """Return the number of findings with the rule and severity of `entry` (rule, key, severity), at any key.

    The key is left out, because the key of a finding depends on the changes that were tried.
    """
    return sum(count for (rule, _, severity), count in weighed.items() if (rule, severity) == (entry[0], entry[2]))


def _finding_place(applied: AppliedFix) -> tuple[str, str | None, Severity]:
    return applied.finding.rule, applied.finding.key, applied.finding.severity


_Counts = Counter[tuple[str, str | None, Severity]]


def _finding_counts(findings: Iterable[Finding]) -> _Counts:
    """Return the number of findings by (rule, key, severity).

    Each finding is counted at its own severity and at all milder severities.
    """
    order = list(Severity)
    return Counter((f.rule, f.key, milder) for f in findings for milder in order[order.index(f.severity) :])
