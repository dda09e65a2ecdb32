"""Findings as JUnit's XML, which every CI server draws: one suite a spec, one case a rule.

A rule fails where a finding weighs as much as what fails the command (`Manner.fail_on`); milder ones stand in the
case's output, what was not checked is skipped with its reason, and so is what is ignored with a reason. A spec that
cannot be read has errors instead of failures. No times and no host: the same findings give the same bytes.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from sitscad.finding import Finding
from sitscad.report.findings.checked import CheckedSpec
from sitscad.report.findings.manner import Manner
from sitscad.report.findings.text import printable


def render(checked: Sequence[CheckedSpec], manner: Manner) -> str:
    """The XML document of some checked specs."""
    top = Element("testsuites", name="sitscad")
    for spec in checked:
        _suite(top, spec, manner)
    for count in ("tests", "failures", "errors", "skipped"):
        top.set(count, str(sum(int(suite.get(count, "0")) for suite in top)))
    ElementTree.indent(top, " ")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(top, encoding="unicode")}\n'


def _suite(top: Element, spec: CheckedSpec, manner: Manner) -> None:
    """Add one spec as a suite of tests, a case a rule."""
    path = _shown(manner.path_from_root(spec.path))
    suite = SubElement(top, "testsuite", name=path)
    rules = {rule.id: rule.name for rule in manner.rules}
    rules |= {finding.rule: finding.name for finding in spec.findings}
    for rule in sorted(rules):
        _case(suite, spec, manner, path, rule, rules[rule])
    for count, kind in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(count, str(sum(case.find(kind) is not None for case in suite)))
    suite.set("tests", str(len(suite)))
    suite.set("time", "0")


def _case(suite: Element, spec: CheckedSpec, manner: Manner, path: str, rule: str, name: str) -> None:
    """Add one rule as a test, with what it found."""
    found = [finding for finding in spec.findings if finding.rule == rule]
    case = SubElement(suite, "testcase", classname=path, name=f"{rule} {name}", time="0")
    failing = [finding for finding in found if finding.severity.weighs(manner.fail_on)]
    if failing:
        first = failing[0]
        kind = "error" if rule.startswith("SIT0") else "failure"
        told = SubElement(case, kind, message=_shown(first.message), type=first.severity.value)
        told.text = "\n".join(_lines(path, finding) for finding in failing)
    elif reasons := _reasons(spec, rule):
        SubElement(case, "skipped", message=_shown("; ".join(reasons)))
    milder = [finding for finding in found if finding not in failing]
    if milder:
        SubElement(case, "system-out").text = "\n".join(_lines(path, finding) for finding in milder)


def _reasons(spec: CheckedSpec, rule: str) -> list[str]:
    """Why a rule without a failure did not simply pass."""
    skipped = [f"not checked: {each.reason}" for each in spec.not_checked if each.rule == rule]
    ignored = [f"ignored: {each.reason}" for each in spec.ignored if each.finding.rule == rule]
    return list(dict.fromkeys((*skipped, *ignored)))


def _lines(path: str, finding: Finding) -> str:
    where = ":".join(str(part) for part in (finding.file or path, finding.line, finding.column) if part)
    hint = f"\nhint: {finding.hint}" if finding.hint else ""
    text = f"{where} {finding.severity.value}: {finding.whole_message}{hint}"
    return "\n".join(map(_shown, text.splitlines()))


def _shown(text: str) -> str:
    """Text as XML 1.0 may hold it."""
    return printable(text).encode("utf-8", "backslashreplace").decode("utf-8")
