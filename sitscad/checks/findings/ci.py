"""Findings for other programs.

There are four formats. SARIF 2.1.0 (OASIS Standard, with errata 01) is for code hosts and editors, and JUnit XML for
test reports. The others are annotations of GitHub Actions, and the summary page of a job (`job_summary`).

SARIF has one run for all specs. Rules that were not checked are notifications of the run and not results, because
readers show every result as a complaint, whatever its kind. Results have the fingerprints of `finding_identities`,
which do not change when lines move. One fingerprint is repeated as ``primaryLocationLineHash``, which GitHub code
scanning uses.

GitHub shows ten annotations of a kind in a step and drops the rest without notice. Therefore only the ten worst
findings become annotations. The total number of findings follows.
"""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from difflib import SequenceMatcher
from typing import Any
from urllib.parse import quote
from xml.etree.ElementTree import Element, SubElement

from sitscad.basics.finding import Finding, Ignored, Remedy, Severity
from sitscad.basics.units import escape_controls
from sitscad.basics.version import __version__
from sitscad.checks.findings.document import (
    CheckedSpec,
    excerpt,
    finding_identities,
    finding_json,
    fingerprint,
    sorted_by_severity,
    to_json,
)
from sitscad.checks.findings.text import OutputOptions, RuleTexts, summary
from sitscad.spec.yaml.rewriting import CannotWriteError, rewritten

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "%SRCROOT%"
LONGEST = 1000  # Largest length (characters) of a line that a result quotes whole

_GROUPS = {"0": "spec", "1": "fabrication", "2": "readout", "3": "mechanics"}
"""Tag of a rule by the first digit of its number."""


def sarif(checked: Sequence[CheckedSpec], output: OutputOptions) -> str:
    """Return the SARIF document of checked specs. Equal input gives equal text, because it contains no times.

    Paths are relative to the root folder of `output`; only paths outside this folder are absolute.
    """
    indices = {rule.id: index for index, rule in enumerate(output.rules)}
    driver = {"name": "sitscad", "semanticVersion": __version__, "rules": [_sarif_rule(rule) for rule in output.rules]}
    # Notifications of the SARIF run: rules that were not checked
    notifications = [
        {
            "level": "note",
            "message": {"text": f"{spec.path}: {skipped.rule} was not checked: {skipped.reason}"},
            "associatedRule": (
                {"id": skipped.rule} | ({"index": indices[skipped.rule]} if skipped.rule in indices else {})
            ),
        }
        for spec in checked
        for skipped in spec.not_checked
    ]
    results = []
    for spec in checked:
        ignored = {id(each.finding): each for each in spec.ignored}
        findings = [*spec.findings, *(each.finding for each in spec.ignored)]
        for finding, name in zip(findings, finding_identities(findings), strict=True):
            results.append(_sarif_result(spec, finding, name, output, indices, ignored.get(id(finding))))
    run = {
        "tool": {"driver": driver},
        "invocations": [{"executionSuccessful": True, "toolExecutionNotifications": notifications}],
        "originalUriBaseIds": {ROOT: {"description": {"text": "The folder of the repository."}}},
        "columnKind": "unicodeCodePoints",
        "results": results,
    }
    return to_json({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


def _sarif_rule(rule: RuleTexts) -> dict[str, Any]:
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


def _sarif_result(
    spec: CheckedSpec, finding: Finding, name: str, output: OutputOptions, indices: dict[str, int],
    ignored: Ignored | None,
) -> dict[str, Any]:
    path = finding.file or spec.path
    name_from_root = output.path_from_root(path)
    if name_from_root.startswith(("/", "../")) or name_from_root == "..":
        where = {"uri": "file://" + quote(os.fsencode(os.path.abspath(path)))}  # absolute outside the root (RFC 3986)
    else:
        where = {"uri": quote(os.fsencode(name_from_root)), "uriBaseId": ROOT}
    mark = fingerprint(output.path_from_root(spec.path), name)
    index = {"ruleIndex": indices[finding.rule]} if finding.rule in indices else {}
    # Properties of the finding's JSON that SARIF has no place for
    entry = finding_json(finding)
    known_fields = ("rule", "severity", "message", "detail", "hint", "key", "line", "column", "file", "fixes")
    # Location of a finding in SARIF
    region = _sarif_region(spec, finding)
    place = {"artifactLocation": where} | ({"region": region} if region else {})
    location: dict[str, Any] = {"physicalLocation": place}
    if finding.key:
        location["logicalLocations"] = [{"fullyQualifiedName": finding.key, "kind": "member"}]
    result: dict[str, Any] = {
        "ruleId": finding.rule,
        **index,
        "level": finding.severity.value,
        "message": {"text": finding.advised_message},
        "locations": [location],
        "partialFingerprints": {"primaryLocationLineHash": f"{mark}:1", "sitscadFinding/v1": mark},
        "properties": {name: value for name, value in entry.items() if name not in known_fields and value is not None},
    }
    if fixes := [fix for fix in (_sarif_fix(spec, remedy, where) for remedy in finding.fixes) if fix]:
        result["fixes"] = fixes
    if ignored is not None:
        kind = "inSource" if ignored.by == "comment" else "external"
        result["suppressions"] = [{"kind": kind, "status": "accepted", "justification": ignored.reason}]
    return result


def _sarif_fix(spec: CheckedSpec, remedy: Remedy, where: dict[str, Any]) -> dict[str, Any] | None:
    """Return a fix in SARIF form, as replaced lines of the spec. None if it cannot be written into the spec's text.

    `where` is the location of the spec's file in SARIF form.
    """
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
    edits = "; ".join(f"{edit.key}: {edit.new}" for edit in remedy.edits)
    if not replacements:
        return None
    description = edits if remedy.is_safe else f"{edits} (changes what the sensor is)"
    return {
        "description": {"text": description},
        "artifactChanges": [{"artifactLocation": where, "replacements": replacements}],
    }


def _sarif_region(spec: CheckedSpec, finding: Finding) -> dict[str, Any] | None:
    """Return line, columns and text of the value to which a finding points. None if the finding has no line."""
    if finding.line is None:
        return None
    column, text = finding.column or 1, spec.line(finding.line, finding.file)
    region: dict[str, Any] = {"startLine": finding.line, "startColumn": column}
    if text is None:
        return region
    end = {"endLine": finding.line, "endColumn": column + value_length(text, column)}
    return region | end | {"snippet": {"text": excerpt(text, column, LONGEST)[0]}}


_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*"|\'(?:[^\']|\'\')*\'')
_PLAIN = re.compile(r"[^#\[\]{},]*?(?=\s*(?:$|[\[\]{},]|\s#))")


def value_length(line: str, column: int) -> int:
    """Return the number of characters (at least 1) of the value that begins at `column` (from 1) of a line.

    The value is quoted, plain, or a list in brackets.
    """
    rest = line[column - 1 :]
    if rest.startswith(("[", "{")):
        # Number of characters up to the closing bracket, or to the line's end if it closes on a later line
        depth = 0
        for index, character in enumerate(rest):
            depth += (character in "[{") - (character in "]}")
            if depth == 0:
                return index + 1
        return len(rest.rstrip()) or 1
    match = _QUOTED.match(rest) or _PLAIN.match(rest)
    return max(1, match.end() if match else 1)


def junit(checked: Sequence[CheckedSpec], output: OutputOptions) -> str:
    """Return the JUnit XML document of checked specs."""
    top = Element("testsuites", name="sitscad")
    for spec in checked:
        path = _shown(output.path_from_root(spec.path))
        suite = SubElement(top, "testsuite", name=path)
        rules = {rule.id: rule.name for rule in output.rules}
        rules |= {finding.rule: finding.name for finding in spec.findings}
        for rule in sorted(rules):
            _add_test_case(suite, spec, output, path, rule, rules[rule])
        for count, kind in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            suite.set(count, str(sum(case.find(kind) is not None for case in suite)))
        suite.set("tests", str(len(suite)))
        suite.set("time", "0")
    for count in ("tests", "failures", "errors", "skipped"):
        top.set(count, str(sum(int(suite.get(count, "0")) for suite in top)))
    ElementTree.indent(top, " ")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(top, encoding="unicode")}\n'


def _add_test_case(suite: Element, spec: CheckedSpec, output: OutputOptions, path: str, rule: str, name: str) -> None:
    """Add a rule to a test suite as a test case, with its findings.

    `path` is the spec's path in the report. `rule` and `name` are the rule's identifier and name.
    """
    findings = [finding for finding in spec.findings if finding.rule == rule]
    case = SubElement(suite, "testcase", classname=path, name=f"{rule} {name}", time="0")
    failing = [finding for finding in findings if finding.severity.is_at_least(output.fail_on)]
    if failing:
        first = failing[0]
        kind = "error" if rule.startswith("SIT0") else "failure"
        element = SubElement(case, kind, message=_shown(first.message), type=first.severity.value)
        element.text = "\n".join(_lines(path, finding) for finding in failing)
    else:  # the reason why a rule without a failure did not pass
        reasons = [f"not checked: {each.reason}" for each in spec.not_checked if each.rule == rule]
        reasons += [f"ignored: {each.reason}" for each in spec.ignored if each.finding.rule == rule]
        if reasons:
            SubElement(case, "skipped", message=_shown("; ".join(dict.fromkeys(reasons))))
    milder = [finding for finding in findings if finding not in failing]
    if milder:
        SubElement(case, "system-out").text = "\n".join(_lines(path, finding) for finding in milder)


def _lines(path: str, finding: Finding) -> str:
    where = ":".join(str(part) for part in (finding.file or path, finding.line, finding.column) if part)
    hint = f"\nhint: {finding.hint}" if finding.hint else ""
    text = f"{where} {finding.severity.value}: {finding.whole_message}{hint}"
    return "\n".join(map(_shown, text.splitlines()))


def _shown(text: str) -> str:
    return escape_controls(text).encode("utf-8", "backslashreplace").decode("utf-8")


SHOWN = 10  # Largest number of findings that become annotations

_COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}


def github(checked: Sequence[CheckedSpec], output: OutputOptions) -> str:
    """Return annotations of GitHub Actions for the ten worst findings, the number of findings, and the verdict."""
    unsorted_pairs = [(spec, finding) for spec in checked for finding in sorted_by_severity(spec.findings)]
    pairs = sorted(unsorted_pairs, key=lambda pair: list(Severity).index(pair[1].severity))
    lines = [_annotation(spec, finding, output) for spec, finding in pairs[:SHOWN]]
    if len(pairs) > SHOWN:
        lines.append(f"sitscad: the {SHOWN} worst of {len(pairs)} findings are annotated; the others are not.")
    return "\n".join([*lines, f"sitscad: {summary(checked)}"]) + "\n"


def _annotation(spec: CheckedSpec, finding: Finding, output: OutputOptions) -> str:
    places = {"line": finding.line, "col": finding.column}
    properties = {
        "file": output.path_from_root(finding.file or spec.path),
        **{name: str(value) for name, value in places.items() if value is not None},
        "title": f"{finding.rule} {finding.name}",
    }
    escaped = {name: _escape_data(value).replace(":", "%3A").replace(",", "%2C") for name, value in properties.items()}
    settings = ",".join(f"{name}={value}" for name, value in escaped.items())
    return f"::{_COMMANDS[finding.severity]} {settings}::{_escape_data(finding.advised_message)}"


def _escape_data(text: str) -> str:
    """Return a message escaped for a workflow command: a single line that cannot start another command."""
    lines = (escape_controls(line) for line in text.replace("%", "%25").splitlines())
    return "%0A".join(lines)


def job_summary(checked: Sequence[CheckedSpec], pictures: Mapping[str, str]) -> str:
    """Return Markdown for the summary page of a GitHub job.

    For every spec, it has the verdict, a picture, all findings, and the rules that were not checked or are ignored.
    `pictures` maps the spec's path to the SVG text of its picture.
    """
    return "\n".join(["## sitscad", "", summary(checked), "", *(_markdown_section(spec, pictures) for spec in checked)])


def _markdown_section(spec: CheckedSpec, pictures: Mapping[str, str]) -> str:
    lines = [f"### {_escape(spec.path)}", "", summary([spec]), ""]
    if picture := pictures.get(spec.path):
        lines += ["```text", picture, "```", ""]
    if spec.findings:
        lines += ["| severity | rule | place | finding |", "|---|---|---|---|"]
        lines += [_markdown_row(finding) for finding in sorted_by_severity(spec.findings)] + [""]
    for ignored in spec.ignored:
        message = _escape(ignored.finding.message)
        lines.append(f"- ignored: {ignored.finding.rule} {message} ({_escape(ignored.reason)})")
    reasons: dict[str, list[str]] = {}
    for skipped in spec.not_checked:
        reasons.setdefault(skipped.reason, []).append(skipped.rule)
    lines += [f"- not checked: {', '.join(rules)} ({_escape(reason)})" for reason, rules in reasons.items()]
    return "\n".join([*lines, ""])


def _markdown_row(finding: Finding) -> str:
    place = ":".join(str(part) for part in (finding.file, finding.line, finding.column) if part)
    hint = f"<br>{_escape(finding.hint)}" if finding.hint else ""
    name = f"{finding.rule} {finding.name}"
    return f"| {finding.severity.value} | {name} | {_escape(place)} | {_escape(finding.whole_message)}{hint} |"


_MARKDOWN = str.maketrans({character: f"\\{character}" for character in "\\`*_[]<>|#~$"})


def _escape(text: str) -> str:
    """Return text on one line with all characters escaped that have a meaning in Markdown."""
    return escape_controls(" ".join(text.split())).translate(_MARKDOWN)
