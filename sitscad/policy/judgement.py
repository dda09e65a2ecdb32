"""Findings as a policy judges them: weighed, left out, ignored with a reason, or known before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from sitscad.finding import Finding, Ignored, Severity
from sitscad.policy.baseline import Baseline
from sitscad.policy.comments import RULE, Comment, comments
from sitscad.policy.values import Policy, chosen_rules, stands_for
from sitscad.report.findings import CheckedSpec, RuleTexts
from sitscad.spec.source import SpecSource

NOT_FOR_WAIVING = ("SIT111", "SIT122", "SIT125")
"""Rules beside SIT2xx that no fabricator can judge: coils that lead nowhere, are shorted or open."""


def judged(
    checked: CheckedSpec,
    source: SpecSource | None,
    rules: Sequence[RuleTexts],
    policy: Policy | None = None,
    baseline: Baseline | None = None,
) -> CheckedSpec:
    """What a policy, the comments in the spec and a baseline leave of what was found.

    ``source`` is the spec's text with its keys, None where it could not be read: then nothing can be ignored. Errors
    that only physics can judge and that are no errors any more stand in the result's ``silenced``.
    """
    if source is None:
        return checked
    policy = policy or Policy()
    names = {rule.id: rule.name for rule in rules}
    before = checked.findings
    checked = _weighed(checked, policy.severity)
    checked = _chosen(checked, rules, policy)
    checked = _commented(checked, source, comments(source.text, names), names)
    checked = _waived(checked, policy.reasons)
    if baseline is not None:
        checked = _known(checked, baseline)
    return replace(checked, silenced=tuple(_silenced(before, checked.findings)))


def _weighed(checked: CheckedSpec, severity: Mapping[str, Severity]) -> CheckedSpec:
    """Findings with the severities that a policy gives them; the last pattern that stands for a rule counts."""
    if not severity:
        return checked
    found = []
    for finding in checked.findings:
        words = [weight for pattern, weight in severity.items() if stands_for(pattern, finding.rule, finding.name)]
        is_free = words and not finding.rule.startswith("SIT0")
        found.append(replace(finding, severity=words[-1]) if is_free else finding)
    return replace(checked, findings=tuple(found))


def _chosen(checked: CheckedSpec, rules: Sequence[RuleTexts], policy: Policy) -> CheckedSpec:
    if not policy.select and not policy.ignore:
        return checked
    wanted = chosen_rules(rules, policy.select, policy.ignore)
    left_out = [rule.id for rule in rules if rule.id not in wanted]
    return checked.without(left_out, f"left out by {policy.named}")


def _commented(
    checked: CheckedSpec, source: SpecSource, written: tuple[Comment, ...], names: Mapping[str, str]
) -> CheckedSpec:
    """Findings that comments silence moved to the ignored ones, and a warning of every comment that is in vain."""
    if not written:
        return checked
    kept, ignored = [], []
    used: set[tuple[int, str]] = set()
    for finding in checked.findings:
        comment = next((each for each in written if each.covers(finding, source)), None)
        if comment is None:
            kept.append(finding)
        else:
            used.add((comment.line, finding.rule))
            ignored.append(Ignored(finding, comment.reason, "comment"))
    skipped = {each.rule for each in checked.not_checked}
    warnings: list[Finding] = []
    for comment in written:
        spare = [rule for rule in comment.rules if (comment.line, rule) not in used and rule not in skipped]
        warnings += _vain(comment, spare, names)
    return replace(checked, findings=(*kept, *warnings), ignored=(*checked.ignored, *ignored))


def _vain(comment: Comment, spare: Sequence[str], names: Mapping[str, str]) -> Iterator[Finding]:
    """What is to be said of a comment: its fault, or which of its rules that were checked it names in vain."""
    if comment.fault:
        message = f"the comment ignores nothing: {comment.fault}"
    elif spare:
        what = "the comment silences nothing" if len(spare) == len(comment.rules) else "the comment names rules in vain"
        message = f"{what}: no finding of {', '.join(spare)} is at a key of this line"
    else:
        return
    it = "the comment" if comment.fault or len(spare) == len(comment.rules) else ", ".join(spare)
    hint = f"take {it} out, or write it at the end of the line that the finding points at"
    yield Finding(RULE, names.get(RULE, ""), Severity.WARNING, message, hint, None, comment.line, comment.column)


def _waived(checked: CheckedSpec, reasons: Mapping[str, str]) -> CheckedSpec:
    """Findings that the configuration ignores with a reason, as ignored ones."""
    kept, ignored = [], []
    for finding in checked.findings:
        why = [reason for pattern, reason in reasons.items() if stands_for(pattern, finding.rule, finding.name)]
        if why and not finding.rule.startswith("SIT0"):
            ignored.append(Ignored(finding, why[-1], "configuration"))
        else:
            kept.append(finding)
    return replace(checked, findings=tuple(kept), ignored=(*checked.ignored, *ignored))


def _known(checked: CheckedSpec, baseline: Baseline) -> CheckedSpec:
    """Findings that a baseline knows, and that have not become graver, as ignored ones."""
    kept, ignored = [], []
    covered = baseline.covered(checked.path, checked.name, checked.findings)
    for finding, is_known in zip(checked.findings, covered, strict=True):
        if is_known and not finding.rule.startswith("SIT0"):
            ignored.append(Ignored(finding, f"known before ({baseline.named})", "baseline"))
        else:
            kept.append(finding)
    return replace(checked, findings=tuple(kept), ignored=(*checked.ignored, *ignored))


def _silenced(before: Iterable[Finding], after: Iterable[Finding]) -> Iterator[Finding]:
    """Errors that only physics can judge and that are none after the policy."""
    errors = {id(finding) for finding in after if finding.severity is Severity.ERROR}
    for finding in before:
        is_physics = finding.rule.startswith("SIT2") or finding.rule in NOT_FOR_WAIVING
        if is_physics and finding.severity is Severity.ERROR and id(finding) not in errors:
            yield finding
