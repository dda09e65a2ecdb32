"""Findings as text for a person and as JSON for a program. A new format is one function and one row of the table."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from sitscad.finding import Finding, NotChecked, Remedy, Severity
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.source import SpecSource
from sitscad.version import __version__

if TYPE_CHECKING:
    from sitscad.estimates.signal import Signal


@record
class CheckedSpec:
    """One spec after its checks: the path as typed, the text that findings point into, and what was found.

    ``texts`` are those of other files that findings point into, by path; ``signals`` what each coil does from rest to
    the required force.
    """

    path: str
    text: str
    findings: tuple[Finding, ...]
    not_checked: tuple[NotChecked, ...] = ()
    texts: Mapping[str, str] = field(default_factory=dict)
    signals: tuple[Signal, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether no error was found."""
        return not self.count(Severity.ERROR)

    @property
    def exit_code(self) -> int:
        """2 when the spec itself is at fault (an error of SIT0xx), else 1 with any error, else 0."""
        errors = [finding for finding in self.findings if finding.severity == Severity.ERROR]
        return 2 if any(finding.rule.startswith("SIT0") for finding in errors) else 1 if errors else 0

    def count(self, severity: Severity) -> int:
        """How many findings have this severity."""
        return sum(finding.severity == severity for finding in self.findings)

    def without(self, rules: Collection[str], reason: str) -> CheckedSpec:
        """The same without what these rules found; they count as not checked, for this reason."""
        findings = tuple(finding for finding in self.findings if finding.rule not in rules)
        not_checked = tuple(skipped for skipped in self.not_checked if skipped.rule not in rules)
        left_out = tuple(NotChecked(rule, reason) for rule in rules)
        return replace(self, findings=findings, not_checked=not_checked + left_out)

    def line(self, number: int | None, file: str | None = None) -> str | None:
        """A line of the spec's text, or of another file's, counted from 1; None where there is none."""
        lines = (self.text if file is None else self.texts.get(file, "")).splitlines()
        return lines[number - 1] if number and 0 < number <= len(lines) else None


def checked_spec(
    spec: SensorSpec,
    findings: Sequence[Finding],
    not_checked: Sequence[NotChecked],
    signals: Sequence[Signal] = (),
) -> CheckedSpec:
    """A spec with its findings, each given its place in the text where it has none yet, and the coils' signals."""
    source, placed = spec.source, (_placed(spec.source, finding) for finding in findings)
    return CheckedSpec(source.path, source.text, tuple(placed), tuple(not_checked), signals=tuple(signals))


def _placed(source: SpecSource, finding: Finding) -> Finding:
    if finding.line is not None:
        return finding
    line, column = source.locate(finding.key)
    return replace(finding, line=line, column=column)


def as_text(checked: Sequence[CheckedSpec], colour: bool = False) -> str:
    """``file:line:column rule severity message``, the offending line under it, a hint, and a summary in the end."""
    blocks = [_finding_text(spec, finding, colour) for spec in checked for finding in in_order(spec.findings)]
    left_out = [line for spec in checked for line in _not_checked_text(spec, len(checked) > 1, colour)]
    felt = [line for spec in checked for line in _signal_text(spec, len(checked) > 1)]
    return "\n".join([*blocks, *left_out, *felt, summary(checked, colour)]) + "\n"


def as_json(checked: Sequence[CheckedSpec], colour: bool = False) -> str:
    """The JSON document of ``check`` (docs/commands.md): one entry a spec, absent numbers null."""
    return to_json(json_document(checked))


FINDING_FORMATS: Mapping[str, Callable[[Sequence[CheckedSpec], bool], str]] = {"text": as_text, "json": as_json}
"""How ``check`` can print what it found: each takes the checked specs and whether colours may be used."""


def json_document(checked: Sequence[CheckedSpec]) -> dict[str, Any]:
    """The findings as plain values for JSON."""
    return {
        "sitscad": __version__,
        "ok": all(spec.ok for spec in checked),
        "specs": [
            {
                "spec": spec.path,
                "ok": spec.ok,
                "findings": [finding_json(finding) for finding in spec.findings],
                "not_checked": [{"rule": skipped.rule, "reason": skipped.reason} for skipped in spec.not_checked],
                "signal": [signal_json(signal) for signal in spec.signals],
            }
            for spec in checked
        ],
    }


def to_json(document: object) -> str:
    """JSON text with every number that is not finite as null, and pure ASCII for every terminal and locale."""
    import json  # text needs none of it, and most checks are read by people

    return json.dumps(_finite(document), indent=1, allow_nan=False) + "\n"


def summary(checked: Sequence[CheckedSpec], colour: bool = False) -> str:
    """One line: how many errors, warnings and notes there are, and how many rules were not checked."""
    counts = [(severity, sum(spec.count(severity) for spec in checked)) for severity in Severity]
    words = [_number(count, severity.value) for severity, count in counts if count]
    skipped = sum(len(spec.not_checked) for spec in checked)
    ok = all(spec.ok for spec in checked)
    verdict = styled("ok" if ok else "not ok", "green" if ok else "red", colour)
    tail = f"; {_number(skipped, 'rule')} not checked" if skipped else ""
    files = f" in {len(checked)} specs" if len(checked) > 1 else ""
    return f"{verdict}: {', '.join(words) or 'no findings'}{files}{tail}"


def in_order(findings: Sequence[Finding]) -> list[Finding]:
    """Findings in the order of the spec's text."""
    return sorted(findings, key=lambda f: (f.file or "", f.line or 0, f.column or 0, f.rule))


def by_weight(findings: Sequence[Finding]) -> list[Finding]:
    """Findings as the report lists them: errors first, then in the order of the spec's text."""
    return sorted(findings, key=lambda f: (list(Severity).index(f.severity), f.line or 0, f.rule))


def numbered_places(findings: Sequence[Finding]) -> list[tuple[int, Finding]]:
    """The findings that have a place on the board, numbered from 1 as report and pictures number them."""
    return list(enumerate((finding for finding in by_weight(findings) if finding.place is not None), 1))


_COLOURS = {"red": "31;1", "yellow": "33;1", "cyan": "36", "green": "32;1", "dim": "2", "bold": "1"}
SEVERITY_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "cyan"}


def styled(text: str, colour: str, on: bool = True) -> str:
    """`text` in a colour of the terminal, or as it is."""
    return f"\033[{_COLOURS[colour]}m{text}\033[0m" if on else text


def printable(text: str) -> str:
    """`text` with tabs as spaces and without anything that could steer a terminal."""
    return "".join(" " if c == "\t" else c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _finding_text(spec: CheckedSpec, finding: Finding, colour: bool) -> str:
    where = ":".join(str(part) for part in (printable(finding.file or spec.path), finding.line, finding.column) if part)
    severity = styled(finding.severity.value, SEVERITY_COLOURS[finding.severity], colour)
    lines = [f"{styled(where, 'bold', colour)} {finding.rule} {severity} {printable(finding.message)}"]
    text = spec.line(finding.line, finding.file)
    if text is not None:
        margin = f"{finding.line:>5} | "
        caret = " " * (len(margin) - 2) + "| " + " " * ((finding.column or 1) - 1)
        lines += [f"{margin}{printable(text)}", caret + styled("^", SEVERITY_COLOURS[finding.severity], colour)]
    if finding.hint:
        lines.append(f"      hint: {printable(finding.hint)}")
    return "\n".join(lines)


def _not_checked_text(spec: CheckedSpec, name_it: bool, colour: bool) -> list[str]:
    """The rules that were not checked, one line a reason."""
    reasons: dict[str, list[str]] = {}
    for skipped in spec.not_checked:
        reasons.setdefault(skipped.reason, []).append(skipped.rule)
    prefix = f"{printable(spec.path)}: " if name_it else ""
    grouped = ((", ".join(_in_runs(rules)), printable(reason)) for reason, rules in reasons.items())
    return [styled(f"{prefix}not checked: {rules} ({reason})", "dim", colour) for rules, reason in grouped]


def _signal_text(spec: CheckedSpec, name_it: bool) -> list[str]:
    """The change per newton of all coils in one line; none where there is no signal."""
    from sitscad.report.signal import headline  # only where something was estimated

    prefix = f"{printable(spec.path)}: " if name_it else ""
    return [f"{prefix}signal: {'; '.join(headline(spec.signals))}"] if spec.signals else []


def _in_runs(rules: list[str]) -> list[str]:
    """Identifiers with runs of three and more neighbours drawn together: ``SIT101-SIT117``."""
    runs: list[list[str]] = []
    for rule in sorted(set(rules)):
        if runs and rule[:3] == runs[-1][-1][:3] and rule[3:].isdigit() and int(rule[3:]) == int(runs[-1][-1][3:]) + 1:
            runs[-1].append(rule)
        else:
            runs.append([rule])
    return [text for run in runs for text in ([f"{run[0]}-{run[-1]}"] if len(run) > 2 else run)]


def signal_json(signal: Signal) -> dict[str, Any]:
    """What one coil's reading does from rest to the required force, as plain values for JSON."""
    return {
        "coil": signal.coil,
        "force_N": signal.force,
        "rest_inductance_H": signal.rest,
        "inductance_H_per_N": signal.per_newton,
        "sigma_inductance_H_per_N": signal.sigma,
        "frequency_Hz_per_N": signal.frequency_per_newton,
        "sigma_frequency_Hz_per_N": signal.frequency_sigma,
        "share": signal.share,
        "frequency_share": signal.frequency_share,
        "steps": signal.steps,
    }


def finding_json(finding: Finding) -> dict[str, Any]:
    """One finding as plain values for JSON."""
    entry: dict[str, Any] = {
        "rule": finding.rule,
        "name": finding.name,
        "severity": finding.severity.value,
        "message": finding.message,
        "hint": finding.hint,
        "key": finding.key,
        "line": finding.line,
        "column": finding.column,
        "measured": finding.measured,
        "limit": finding.limit,
        "unit": finding.unit,
        "source": finding.source,
    }
    if finding.sigma is not None:
        entry["sigma"] = finding.sigma
    if finding.file is not None:
        entry["file"] = finding.file
    if finding.place is not None:
        place = finding.place
        entry["place"] = {"x_m": place.x, "y_m": place.y, "layer": place.layer, "nets": list(place.nets)}
    entry["fixes"] = [remedy_json(remedy) for remedy in finding.fixes]
    return entry


def remedy_json(remedy: Remedy) -> dict[str, Any]:
    """What mends a finding, as plain values for JSON."""
    edits = [{"key": edit.key, "old": edit.old, "new": edit.new, "what": edit.what} for edit in remedy.edits]
    return {"edits": edits, "safe": remedy.is_safe, "brings": list(remedy.brings)}


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _number(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
