"""Findings as SARIF 2.1.0 (OASIS Standard, with errata 01), the form that code hosts and editors read.

One run for all specs. What was not checked is a notification of the run, not a result: readers show every result as a
complaint, whatever its kind. Results have the fingerprints of `identity`, which survive moved lines; the same value
stands as ``primaryLocationLineHash``, the one that GitHub's code scanning looks at.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import SequenceMatcher
from typing import Any

from sitscad.finding import Finding, Ignored, Remedy
from sitscad.report.findings.checked import CheckedSpec, excerpt
from sitscad.report.findings.document import finding_json, to_json
from sitscad.report.findings.identity import fingerprint, identities
from sitscad.report.findings.manner import Manner, RuleTexts
from sitscad.spec.rewriting import CannotWriteError, rewritten
from sitscad.version import __version__

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "%SRCROOT%"
LONGEST = 1000
"""Characters of a line up to which it stands whole in a result."""

_GROUPS = {"0": "spec", "1": "fabrication", "2": "readout", "3": "mechanics"}
"""The tag of a rule, by the first figure of its number."""


def render(checked: Sequence[CheckedSpec], manner: Manner) -> str:
    """The SARIF document of some checked specs; deterministic: it holds neither times nor the machine's paths."""
    indices = {rule.id: index for index, rule in enumerate(manner.rules)}
    driver = {
        "name": "sitscad",
        "semanticVersion": __version__,
        "rules": [_rule(rule) for rule in manner.rules],
    }
    run = {
        "tool": {"driver": driver},
        "invocations": [_invocation(checked, indices)],
        "originalUriBaseIds": {ROOT: {"description": {"text": "The folder of the repository."}}},
        "columnKind": "unicodeCodePoints",
        "results": [result for spec in checked for result in _results(spec, manner, indices)],
    }
    return to_json({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


def _rule(rule: RuleTexts) -> dict[str, Any]:
    """One rule as SARIF describes it."""
    help_text = f"{rule.summary}\n\nWhy: {rule.why}\n\nTo mend it: {rule.mend}\n\nSource: {rule.source}"
    markdown = f"{rule.summary}\n\n**Why:** {rule.why}\n\n**To mend it:** {rule.mend}\n\n**Source:** {rule.source}"
    return {
        "id": rule.id,
        "name": "".join(word.capitalize() for word in rule.name.split("-")),
        "shortDescription": {"text": rule.name.replace("-", " ")},
        "fullDescription": {"text": rule.summary},
        "help": {"text": help_text, "markdown": markdown},
        "defaultConfiguration": {"level": rule.severity.value},
        "properties": {"tags": [_GROUPS.get(rule.id[3:4], "other")]},
    }


def _invocation(checked: Sequence[CheckedSpec], indices: dict[str, int]) -> dict[str, Any]:
    """What SARIF says of the run: rules that were not checked."""
    notifications = [
        {
            "level": "note",
            "message": {"text": f"{spec.path}: {skipped.rule} was not checked: {skipped.reason}"},
            "associatedRule": _reference(skipped.rule, indices),
        }
        for spec in checked
        for skipped in spec.not_checked
    ]
    return {"executionSuccessful": True, "toolExecutionNotifications": notifications}


def _reference(rule: str, indices: dict[str, int]) -> dict[str, Any]:
    return {"id": rule} | ({"index": indices[rule]} if rule in indices else {})


def _results(spec: CheckedSpec, manner: Manner, indices: dict[str, int]) -> list[dict[str, Any]]:
    ignored = {id(each.finding): each for each in spec.ignored}
    findings = [*spec.findings, *(each.finding for each in spec.ignored)]
    named = zip(findings, identities(findings), strict=True)
    return [_result(spec, finding, name, manner, indices, ignored.get(id(finding))) for finding, name in named]


def _result(
    spec: CheckedSpec, finding: Finding, name: str, manner: Manner, indices: dict[str, int], ignored: Ignored | None
) -> dict[str, Any]:
    """One finding as SARIF has it."""
    where = _artifact(manner.uri_from_root(finding.file or spec.path))
    mark = fingerprint(manner.path_from_root(spec.path), name)
    index = {"ruleIndex": indices[finding.rule]} if finding.rule in indices else {}
    result: dict[str, Any] = {
        "ruleId": finding.rule,
        **index,
        "level": finding.severity.value,
        "message": {"text": finding.advised_message},
        "locations": [_location(spec, finding, where)],
        "partialFingerprints": {"primaryLocationLineHash": f"{mark}:1", "sitscadFinding/v1": mark},
        "properties": _measures(finding),
    }
    if fixes := [fix for fix in (_fix(spec, remedy, where) for remedy in finding.fixes) if fix]:
        result["fixes"] = fixes
    if ignored is not None:
        kind = "inSource" if ignored.by == "comment" else "external"
        result["suppressions"] = [{"kind": kind, "status": "accepted", "justification": ignored.reason}]
    return result


def _measures(finding: Finding) -> dict[str, Any]:
    """What the finding's JSON has beyond what SARIF has a place for."""
    entry = finding_json(finding)
    told = ("rule", "severity", "message", "detail", "hint", "key", "line", "column", "file", "fixes")
    return {name: value for name, value in entry.items() if name not in told and value is not None}


def _fix(spec: CheckedSpec, remedy: Remedy, where: dict[str, Any]) -> dict[str, Any] | None:
    """What mends a finding, as the lines of the spec that become others; None where the text has no place for it."""
    try:
        after = rewritten(spec.text, remedy.edits).splitlines(keepends=True)
    except CannotWriteError:
        return None
    before = spec.text.splitlines(keepends=True)
    changes = SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
    replacements = [
        {
            "deletedRegion": {"startLine": start + 1, "startColumn": 1, "endLine": end + 1, "endColumn": 1},
            "insertedContent": {"text": "".join(after[first:last])},
        }
        for kind, start, end, first, last in changes
        if kind != "equal"
    ]
    words = "; ".join(f"{edit.key}: {edit.new}" for edit in remedy.edits)
    if not replacements:
        return None
    told = words if remedy.is_safe else f"{words} (changes what the sensor is)"
    return {
        "description": {"text": told},
        "artifactChanges": [{"artifactLocation": where, "replacements": replacements}],
    }


def _artifact(uri: str) -> dict[str, Any]:
    return {"uri": uri} if uri.startswith("file:") else {"uri": uri, "uriBaseId": ROOT}


def _location(spec: CheckedSpec, finding: Finding, where: dict[str, Any]) -> dict[str, Any]:
    """Where SARIF says that a finding lies."""
    region = _region(spec, finding)
    place = {"artifactLocation": where} | ({"region": region} if region else {})
    location: dict[str, Any] = {"physicalLocation": place}
    if finding.key:
        location["logicalLocations"] = [{"fullyQualifiedName": finding.key, "kind": "member"}]
    return location


def _region(spec: CheckedSpec, finding: Finding) -> dict[str, Any] | None:
    """Line, columns and text of what the finding points at: one value of the spec, as far as its line goes."""
    if finding.line is None:
        return None
    column, text = finding.column or 1, spec.line(finding.line, finding.file)
    region: dict[str, Any] = {"startLine": finding.line, "startColumn": column}
    if text is None:
        return region
    end = {"endLine": finding.line, "endColumn": column + extent(text, column)}
    return region | end | {"snippet": {"text": excerpt(text, column, LONGEST)[0]}}


_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*"|\'(?:[^\']|\'\')*\'')
_PLAIN = re.compile(r"[^#\[\]{},]*?(?=\s*(?:$|[\[\]{},]|\s#))")


def extent(line: str, column: int) -> int:
    """How many characters the value takes that begins at a column (from 1): a quoted or plain one, or a bracketed list;
    at least one.
    """
    rest = line[column - 1 :]
    if rest.startswith(("[", "{")):
        return _bracketed(rest)
    found = _QUOTED.match(rest) or _PLAIN.match(rest)
    return max(1, found.end() if found else 1)


def _bracketed(text: str) -> int:
    """Characters up to the bracket that closes the first one; those of the line where it closes later."""
    depth = 0
    for index, character in enumerate(text):
        depth += (character in "[{") - (character in "]}")
        if depth == 0:
            return index + 1
    return len(text.rstrip()) or 1
