"""Findings as annotations of GitHub Actions: workflow commands on stdout, one line each.

GitHub shows ten of a kind in a step and drops the rest without a word, so the ten worst of all are told, then their
number and that of the others. `job_summary` is the page of the job: a table of all, and the pictures that it is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sitscad.finding import Finding, Severity
from sitscad.report.findings.checked import CheckedSpec, by_weight, worst_first
from sitscad.report.findings.manner import Manner
from sitscad.report.findings.text import printable, summary

SHOWN = 10
"""How many findings become annotations."""

_COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}


def render(checked: Sequence[CheckedSpec], manner: Manner) -> str:
    """The worst ten findings as annotations, how many there are besides, and the line that ends every report."""
    pairs = worst_first(checked)
    lines = [_command(spec, finding, manner) for spec, finding in pairs[:SHOWN]]
    if len(pairs) > SHOWN:
        lines.append(f"sitscad: the {SHOWN} worst of {len(pairs)} findings are annotated; the others are not.")
    return "\n".join([*lines, f"sitscad: {summary(checked)}"]) + "\n"


def _command(spec: CheckedSpec, finding: Finding, manner: Manner) -> str:
    """A finding as a command of GitHub's workflows."""
    places = {"line": finding.line, "col": finding.column}
    properties = {
        "file": manner.path_from_root(finding.file or spec.path),
        **{name: str(value) for name, value in places.items() if value is not None},
        "title": f"{finding.rule} {finding.name}",
    }
    told = ",".join(f"{name}={_property(value)}" for name, value in properties.items())
    return f"::{_COMMANDS[finding.severity]} {told}::{_data(finding.advised_message)}"


def _data(text: str) -> str:
    """A message as a workflow command holds it: one line, nothing in it that begins another command."""
    lines = (printable(line) for line in text.replace("%", "%25").splitlines())
    return "%0A".join(lines)


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def job_summary(checked: Sequence[CheckedSpec], pictures: Mapping[str, str]) -> str:
    """Markdown for a job's page: for every spec its verdict, its picture (text in `pictures`, by the spec's path), all
    its findings, and what was not checked or is ignored.
    """
    return "\n".join(["## sitscad", "", summary(checked), "", *(_section(spec, pictures) for spec in checked)])


def _section(spec: CheckedSpec, pictures: Mapping[str, str]) -> str:
    """One spec's part of the job's page."""
    lines = [f"### {_cell(spec.path)}", "", summary([spec]), ""]
    if picture := pictures.get(spec.path):
        lines += ["```text", picture, "```", ""]
    if spec.findings:
        lines += ["| severity | rule | place | finding |", "|---|---|---|---|"]
        lines += [_row(finding) for finding in by_weight(spec.findings)] + [""]
    for ignored in spec.ignored:
        lines.append(f"- ignored: {ignored.finding.rule} {_cell(ignored.finding.message)} ({_cell(ignored.reason)})")
    reasons: dict[str, list[str]] = {}
    for skipped in spec.not_checked:
        reasons.setdefault(skipped.reason, []).append(skipped.rule)
    lines += [f"- not checked: {', '.join(rules)} ({_cell(reason)})" for reason, rules in reasons.items()]
    return "\n".join([*lines, ""])


def _row(finding: Finding) -> str:
    place = ":".join(str(part) for part in (finding.file, finding.line, finding.column) if part)
    hint = f"<br>{_cell(finding.hint)}" if finding.hint else ""
    name = f"{finding.rule} {finding.name}"
    return f"| {finding.severity.value} | {name} | {_cell(place)} | {_cell(finding.whole_message)}{hint} |"


_MARKDOWN = str.maketrans({character: f"\\{character}" for character in "\\`*_[]<>|#~$"})


def _cell(text: str) -> str:
    """Text that means nothing to Markdown, on one line."""
    return printable(" ".join(text.split())).translate(_MARKDOWN)
