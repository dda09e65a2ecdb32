"""Annotations of GitHub Actions: parsed back as the runner does, never more than it shows, and the page of the job."""

from __future__ import annotations

import re
from dataclasses import replace

import told

from sitscad.basics.finding import Finding, Severity
from sitscad.checks.findings import CheckedSpec
from sitscad.checks.findings.ci import SHOWN, job_summary
from sitscad.checks.findings.ci import github as render

COMMAND = re.compile(r"::(?P<name>\w+) (?P<properties>[^:]*)::(?P<message>.*)")


def commands(text: str) -> list[dict[str, str]]:
    """What the runner makes of the lines that are workflow commands: names, properties and messages unescaped."""
    result = []
    for line in text.splitlines():
        if match := COMMAND.fullmatch(line):
            pairs = (pair.split("=", 1) for pair in match["properties"].split(","))
            values = {name: unescaped(value) for name, value in pairs}
            result.append({"name": match["name"], "message": unescaped(match["message"]), **values})
    return result


def unescaped(text: str) -> str:
    for code, character in (("%0D", "\r"), ("%0A", "\n"), ("%3A", ":"), ("%2C", ","), ("%25", "%")):
        text = text.replace(code, character)
    return text


def test_finding_gives_annotation_with_file_and_line():
    first, unread, *_ = commands(render(told.BOTH, told.OUTPUT))
    assert first == {
        "name": "error",
        "file": "sensors/first, 100%: new.yaml",
        "line": "3",
        "col": "30",
        "title": "SIT201 inductance-floor",
        "message": "too weak: 70 % of it\nHint: more turns",
    }
    assert unread["file"] == "second.yaml" and unread["title"] == "SIT001 not-yaml"


def test_annotations_are_sorted_with_errors_first():
    names = [command["name"] for command in commands(render(told.BOTH, told.OUTPUT))]
    assert names == ["error", "error", "warning", "warning", "notice", "notice"]


def test_spec_text_cannot_inject_workflow_command():
    lines = render(told.BOTH, told.OUTPUT).splitlines()
    assert len(commands("\n".join(lines))) == len([line for line in lines if line.startswith("::")]) == 6
    hostile = replace(told.FIRST, path="x\n::error::y")
    assert len(commands(render((hostile,), told.OUTPUT))) == 5


def test_only_ten_worst_findings_are_annotated():
    milds = tuple(Finding("SIT206", "x", Severity.WARNING, str(i), line=i + 1) for i in range(SHOWN + 4))
    many = CheckedSpec("many.yaml", "", (*milds, told.TURNS))
    text = render((many,), told.OUTPUT)
    result = commands(text)
    assert len(result) == SHOWN and result[0]["name"] == "error"
    assert f"the {SHOWN} worst of 15 findings" in text
    assert text.splitlines()[-1] == "sitscad: not ok: 1 error, 14 warnings"


def test_job_summary_lists_every_finding_with_escaped_text():
    page = job_summary(told.BOTH, {told.FIRST.path: "\u28ff"})
    for finding in (*told.FIRST.findings, *told.SECOND.findings, told.WAIVED):
        assert f"{finding.rule}" in page
    assert "a \\| b \\<b\\>" in page and "```text\n\u28ff\n```" in page
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    assert all(len(re.findall(r"(?<!\\)\|", row)) == 5 for row in rows)
    assert "their quotation of 3 May" in page and "SIT301, SIT302 (no mount in the spec)" in page
