"""Application of a policy to findings: changed severities, rules left out, ignored findings and known findings.

Comments in a spec silence rules, too: ``turns: 9   # sitscad: ignore SIT103 their quotation of 3 May``. A comment
applies to findings whose key starts on its line. On a line with a mapping in braces, this includes all keys of the
mapping. On the line of a section, only findings on the section itself are silenced. Several rules are separated by
commas. The reason is required. Another comment may precede it.

Known findings come from a baseline, the JSON of an earlier ``check``. They do not fail again; new or worse findings do.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from sitscad.basics.finding import Finding, Ignored, Severity
from sitscad.basics.record import record
from sitscad.checks.findings import CheckedSpec, RuleTexts
from sitscad.checks.findings.document import finding_identities, without_count
from sitscad.checks.policy.configuration import Policy, PolicyError, matches_rule, selected_rules
from sitscad.spec.yaml.source import SpecSource

MAX_BYTES = 64 << 20

LARGEST = 1e15
"""Absolute value (SI unit) from which a number in a baseline is ignored, because it cannot be a measured value."""

MAX_EQUAL_INCREASE = 1e-6
"""Largest increase of the distance between a value and its limit, divided by the limit, that does not count as worse.

Results of different computers differ by up to this ratio.
"""


@record
class BaselineFinding:
    """A known finding in a baseline.

    ``measured`` and ``limit`` are in SI units; None if the finding has no such value. ``keeps_limit`` is True if the
    value meets its limit, but is near to it.
    """

    severity: Severity
    measured: float | None = None
    limit: float | None = None
    keeps_limit: bool = False

    def covers(self, now: Finding) -> bool:
        """Whether the finding `now` is no worse than this known finding.

        Its severity must not be higher, and its value must lie on the same side of the limit. A value beyond the limit
        must not be farther from the limit than before. A value that meets the limit must not be nearer to it. The
        tolerance is `MAX_EQUAL_INCREASE`. If a finding has no value, only severities are compared.
        """
        if not self.severity.is_at_least(now.severity):
            return False
        if now.measured is None or now.limit is None:
            return True
        if self.measured is None or self.limit is None or self.keeps_limit != now.keeps_limit:
            return False
        before, after = self.measured - self.limit, now.measured - now.limit
        if before * after < 0.0:
            return False
        worse = abs(after) - abs(before)
        return (-worse if now.keeps_limit else worse) <= MAX_EQUAL_INCREASE * abs(now.limit)


@record
class Baseline:
    """Findings that an earlier check reported, and that do not fail again.

    ``file_name`` is the file from which they were read. ``known`` holds them first by (absolute path, name) of the
    spec, then by the text that identifies the finding (`finding_identities`).
    """

    file_name: str
    known: Mapping[tuple[str, str], Mapping[str, BaselineFinding]]

    def of(self, path: str, name: str) -> Mapping[str, BaselineFinding]:
        """Return the known findings of the spec at `path` whose name is `name`. Empty if there are none."""
        return self.known.get((_absolute_path(path), name), {})

    def holds(self, path: str, name: str) -> bool:
        """Whether the spec at `path` whose name is `name` is part of the baseline."""
        return (_absolute_path(path), name) in self.known

    def covered(self, path: str, name: str, findings: Sequence[Finding]) -> list[bool]:
        """Return for each finding whether a known finding covers it.

        `path` and `name` identify the spec. Each known finding covers at most one finding. It is first compared with
        the finding that has the same identifying text (`finding_identities`). The remaining known findings are then
        compared with other findings that have their rule and key. The numbers in the identifying texts change when a
        finding is gone.
        """
        free, is_covered = dict(self.of(path, name)), [False] * len(findings)
        names = finding_identities(findings)
        for is_own in (True, False):
            for turn, finding in enumerate(findings):
                keys = (
                    key for key in free if without_count(key) == without_count(names[turn])
                    and (key == names[turn] or not is_own)
                )
                entry = None if is_covered[turn] else next((key for key in keys if free[key].covers(finding)), None)
                if entry is not None:
                    is_covered[turn] = free.pop(entry) is not None
        return is_covered

    def as_json(self, path: str, name: str) -> dict[str, Any]:
        """Return the known findings of a spec as a dictionary for a package's manifest. Empty if there are none.

        `path` is the path of the spec, and `name` the name that the spec gives to the sensor.
        """
        entries = self.of(path, name)
        rows = {key: [k.severity.value, k.measured, k.limit, k.keeps_limit] for key, k in sorted(entries.items())}
        return {"named": self.file_name, "known": rows} if rows else {}


def baseline_findings(baseline: Baseline | None, path: str, name: str) -> dict[str, Any]:
    """Return the result of `Baseline.as_json` for the spec at `path` with this `name`. Empty if `baseline` is None."""
    return {} if baseline is None else baseline.as_json(path, name)


def read_baseline(path: str) -> Baseline:
    """Read a baseline from a file with the output of ``sitscad check --format json``.

    Relative paths of specs in the file are relative to the file's folder.

    Raises `PolicyError` for any other file.
    """
    try:
        with open(path, "rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise PolicyError(f"cannot read the baseline {path}: {getattr(error, 'strerror', None) or error}") from error
    try:
        folder = os.path.dirname(os.path.abspath(path))
        entries = {(_absolute_path(s["spec"], folder), str(s["name"] or "")): _entries(s)
                   for s in json.loads(content)["specs"]}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        hint = "make one with: sitscad check SPEC... --format json > FILE"
        raise PolicyError(f"{path} is no baseline ({type(error).__name__}: {error}); {hint}") from error
    return Baseline(Path(path).name, entries)


def baseline_from_manifest(path: str, name: str, document: Mapping[str, Any]) -> Baseline:
    """Return the baseline stored in a manifest. `path` and `name` identify the spec, as in `Baseline.as_json`.

    Raises ValueError, TypeError or KeyError if the values are no baseline.
    """
    rows = {
        str(key): BaselineFinding(
            Severity(word), _measured_value(measured), _measured_value(limit), keeps_limit is True)
        for key, (word, measured, limit, keeps_limit) in document["known"].items()
    }
    return Baseline(str(document["named"]), {(_absolute_path(path), name): rows})


def _absolute_path(path: str, folder: str = "") -> str:
    """Return the absolute path of a spec. Relative paths start from `folder`. ``-`` (standard input) is unchanged."""
    return path if path == "-" else os.path.abspath(os.path.join(folder, path))


def _measured_value(value: Any) -> float | None:
    """Return a number from a baseline. None if it cannot be a measured value, for example for true, NaN or 1e99."""
    return float(value) if type(value) in (int, float) and abs(value) < LARGEST else None


def _entries(spec: Mapping[str, Any]) -> dict[str, BaselineFinding]:
    entries = [*spec["findings"], *(entry["finding"] for entry in spec["ignored"])]
    findings = [
        Finding(str(entry["rule"]), "", Severity(entry["severity"]), "", key=entry["key"], file=entry.get("file"))
        for entry in entries
    ]
    figures = (
        BaselineFinding(
            Severity(entry["severity"]), _measured_value(entry["measured"]), _measured_value(entry["limit"]),
            entry.get("keeps_limit") is True,
        )
        for entry in entries
    )
    return dict(zip(finding_identities(findings), figures, strict=True))


NOT_FOR_WAIVING = ("SIT111", "SIT122", "SIT125")
"""Rules besides SIT2xx whose errors mean that the sensor cannot work: coils that are open, shorted or not connected.

A package is marked if a policy, a comment or a baseline has silenced an error of these rules or of SIT2xx.
"""


def apply_policy(
    checked: CheckedSpec, source: SpecSource | None, rules: Sequence[RuleTexts], policy: Policy | None = None,
    baseline: Baseline | None = None,
) -> CheckedSpec:
    """Apply a policy, the comments in the spec and a baseline to the results of a check.

    ``source`` is the spec's text with its keys. If it is None, the spec could not be read, and `checked` is returned
    unchanged. ``rules`` are all rules. Errors of SIT2xx and `NOT_FOR_WAIVING` that no longer count as errors are in
    ``silenced`` of the result.
    """
    if source is None:
        return checked
    policy = policy or Policy()
    names = {rule.id: rule.name for rule in rules}
    before = checked.findings
    checked = _with_severities(checked, policy.severity)
    if policy.select or policy.ignore:
        chosen = selected_rules(rules, policy.select, policy.ignore)
        left_out = [rule.id for rule in rules if rule.id not in chosen]
        checked = checked.without(left_out, f"left out by {policy.file_name}")
    checked = _apply_comments(checked, source, silencing_comments(source.text, names), names)
    # the last matching reason counts
    reasons = list(policy.reasons.items())[::-1]
    checked = _move_to_ignored(checked, "configuration", lambda finding: next(
        (why for pattern, why in reasons if matches_rule(pattern, finding.rule, finding.name)), None))
    if baseline is not None:
        covered = baseline.covered(checked.path, checked.name, checked.findings)
        covered_ids = {id(finding) for finding, is_known in zip(checked.findings, covered, strict=True) if is_known}
        why = f"known before ({baseline.file_name})"
        checked = _move_to_ignored(checked, "baseline", lambda finding: why if id(finding) in covered_ids else None)
    errors = {id(finding) for finding in checked.findings if finding.severity is Severity.ERROR}
    return replace(checked, silenced=tuple(
        finding for finding in before if finding.severity is Severity.ERROR and id(finding) not in errors
        and (finding.rule.startswith("SIT2") or finding.rule in NOT_FOR_WAIVING)))


def make_ignored_test(
    source: SpecSource, rules: Sequence[RuleTexts], policy: Policy, select: tuple[str, ...] = (),
    ignore: tuple[str, ...] = (),
) -> Callable[[Finding], bool]:
    """Return a function that returns whether a finding is ignored, or belongs to a rule that is left out.

    No changes are tried for such a finding. The finding must have its line in the spec's text. The function uses
    `policy`, the patterns `select` and `ignore` of rules, and the comments in the spec.
    """
    chosen = selected_rules(rules, policy.select, policy.ignore) & selected_rules(rules, select, ignore)
    written = silencing_comments(source.text, [rule.id for rule in rules])

    def is_ignored(finding: Finding) -> bool:
        if finding.rule.startswith("SIT0"):
            return False
        return (finding.rule not in chosen or any(each.covers(finding, source) for each in written)
                or any(matches_rule(pattern, finding.rule, finding.name) for pattern in policy.reasons))

    return is_ignored


def _move_to_ignored(checked: CheckedSpec, by: str, reason: Callable[[Finding], str | None]) -> CheckedSpec:
    """Move each finding for which `reason` returns a text to the ignored findings. This text is the stated reason.

    `by` is the source of the reason: comment, configuration or baseline. Findings of SIT0xx are never ignored.
    """
    counting, ignored = [], []
    for finding in checked.findings:
        why = None if finding.rule.startswith("SIT0") else reason(finding)
        if why is None:
            counting.append(finding)
        else:
            ignored.append(Ignored(finding, why, by))
    return replace(checked, findings=tuple(counting), ignored=(*checked.ignored, *ignored))


def _with_severities(checked: CheckedSpec, severity: Mapping[str, Severity]) -> CheckedSpec:
    """Return the result with severities changed by a policy. `severity` maps patterns of rules to severities.

    The last pattern that matches a rule applies. Findings about the spec itself (SIT0xx) do not change.
    """
    if not severity:
        return checked
    weighed = []
    for finding in checked.findings:
        weights = [weight for pattern, weight in severity.items() if matches_rule(pattern, finding.rule, finding.name)]
        is_free = weights and not finding.rule.startswith("SIT0")
        weighed.append(replace(finding, severity=weights[-1]) if is_free else finding)
    return replace(checked, findings=tuple(weighed))


def _apply_comments(
    checked: CheckedSpec, source: SpecSource, written: tuple[Comment, ...], names: Mapping[str, str]
) -> CheckedSpec:
    """Move findings that comments silence to the ignored findings, and add a warning for each useless comment.

    `written` are the comments, and `names` the names of all rules by identifier.
    """
    if not written:
        return checked
    used: set[tuple[int, str]] = set()

    def reason(finding: Finding) -> str | None:
        comment = next((each for each in written if each.covers(finding, source)), None)
        if comment is None:
            return None
        used.add((comment.line, finding.rule))
        return comment.reason

    checked = _move_to_ignored(checked, "comment", reason)
    skipped = {each.rule for each in checked.not_checked}
    warnings: list[Finding] = []
    for comment in written:
        spare = [rule for rule in comment.rules if (comment.line, rule) not in used and rule not in skipped]
        warnings += _useless_comment_warnings(comment, spare, names)
    return replace(checked, findings=(*checked.findings, *warnings))


def _useless_comment_warnings(comment: Comment, spare: Sequence[str], names: Mapping[str, str]) -> Iterator[Finding]:
    """Yield a warning for a comment that has a fault, or that names rules without a finding on its line.

    `spare` are the identifiers of the rules without a finding. `names` are the names of all rules by identifier.
    """
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


RULE = "SIT020"
"""Identifier of the rule about useless comments."""

_WORDS = re.compile(r"#\s*sitscad:\s*ignore\b(.*)", re.IGNORECASE)
_RULES = re.compile(r"\s*([A-Za-z]+[0-9]+(?:\s*,\s*[A-Za-z]+[0-9]+)*)(?:[\s:]+(.*))?")


@record
class Comment:
    """A comment in a spec that silences rules, at `line` and `column`.

    ``rules`` are identifiers of rules. ``reason`` is the reason for silencing them. ``fault`` states why the comment
    has no effect; it is empty if the comment is valid.
    """

    line: int
    column: int
    rules: tuple[str, ...] = ()
    reason: str = ""
    fault: str = ""

    def covers(self, finding: Finding, source: SpecSource) -> bool:
        """Whether the comment names the finding's rule, and the finding's key starts on the comment's line."""
        if finding.rule not in self.rules or finding.file is not None:
            return False
        # lines of the key, and of the opening brackets around it
        key = finding.key or ""
        lines = {source.keys[key][0]} if key in source.keys else set()
        while key:
            if key in source.values:
                line, column = source.values[key]
                lines |= {line} if source.line(line)[column - 1 : column] in ("{", "[") else set()
            key = key.rpartition(".")[0]
        return finding.line == self.line or self.line in lines


def silencing_comments(text: str, rule_ids: Iterable[str]) -> tuple[Comment, ...]:
    """Return the comments of a spec that silence rules. `rule_ids` are the identifiers of all rules."""
    if "sitscad:" not in text.lower():
        return ()
    rules = frozenset(rule_ids)
    found_comments = []
    for number, line in enumerate(text.splitlines(), 1):
        start = _comment_start(line)
        match = _WORDS.search(line, start) if start is not None else None
        if match is not None:
            found_comments.append(_parse_comment(number, match.start() + 1, match[1], rules))
    return tuple(found_comments)


def _parse_comment(line: int, column: int, text: str, rule_ids: frozenset[str]) -> Comment:
    """Parse the text of a comment into rules and reason, or into a fault."""
    match = _RULES.fullmatch(text.rstrip())
    if match is None:
        return Comment(line, column, fault="it names no rule; write # sitscad: ignore SIT103 and the reason")
    rules = tuple(rule.strip().upper() for rule in match[1].split(","))
    reason = " ".join((match[2] or "").split())
    unknown = [rule for rule in rules if rule not in rule_ids]
    if unknown:
        return Comment(line, column, fault=f"there is no rule {', '.join(unknown)}")
    if any(rule.startswith("SIT0") for rule in rules):
        return Comment(line, column, fault="what a spec is read by (SIT0xx) cannot be ignored")
    if not reason:
        return Comment(line, column, fault="it gives no reason: who said so, and when?")
    return Comment(line, column, rules, reason)


def _comment_start(line: str) -> int | None:
    """Return the index at which a line's comment begins: a # after a blank, outside quotes. None if there is none."""
    quote = ""
    for index, character in enumerate(line):
        if quote:
            quote = "" if character == quote and line[index - 1 : index] != "\\" else quote
        elif character in "\"'" and (index == 0 or line[index - 1] in " \t[{,:"):
            quote = character
        elif character == "#" and (index == 0 or line[index - 1] in " \t"):
            return index
    return None
