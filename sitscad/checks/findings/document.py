"""JSON document of ``check`` (docs/commands.md, data/check.schema.json), written and read.

It also defines `CheckedSpec`, the results for one spec with the text to which its findings refer, and the sort orders
of reports.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from sitscad.basics.check_results import Closing, Measure, RequirementResult, Share, Signal
from sitscad.basics.digest import sha256
from sitscad.basics.finding import Edit, Finding, Ignored, NotChecked, Place, Remedy, Severity
from sitscad.basics.quantities import FIT, FIT_PART, SIGNAL, document
from sitscad.basics.record import record
from sitscad.basics.version import __version__
from sitscad.checks.findings.measures import closing_json
from sitscad.spec.yaml.source import SpecSource


@record
class CheckedSpec:
    """Results of all checks of one spec.

    Attributes
    ----------
    path : str
        path of the spec, as the user typed it
    text : str
        text of the spec, to which the lines and columns of findings refer
    findings : tuple of Finding
        findings that count
    not_checked : tuple of NotChecked
        rules that could not be applied, each with the reason
    texts : mapping
        texts of other files to which findings refer, by path
    signals : tuple of Signal
        for each coil, the change of its reading from rest to the required force
    ignored : tuple of Ignored
        findings that do not count because of the policy, a comment or a baseline, each with the reason
    fit : tuple of Measure
        sizes of the sensor in its jaw, each compared with its limit
    silenced : tuple of Finding
        errors of SIT2xx and `NOT_FOR_WAIVING` that the policy, a comment or a baseline has switched off; they do not
        stop a build, but the package is marked
    closing : Closing or None
        motion of the jaws when they close on tissue
    reached : tuple of RequirementResult
        each requirement with its estimated value
    name : str
        name that the spec gives itself; empty if it could not be read
    board : tuple of float or None
        length and width (m) of the board's body, then of the whole board, then of the plate or cap that carries it
    """

    path: str
    text: str
    findings: tuple[Finding, ...]
    not_checked: tuple[NotChecked, ...] = ()
    texts: Mapping[str, str] = field(default_factory=dict)
    signals: tuple[Signal, ...] = ()
    ignored: tuple[Ignored, ...] = ()
    fit: tuple[Measure, ...] = ()
    silenced: tuple[Finding, ...] = ()
    closing: Closing | None = None
    reached: tuple[RequirementResult, ...] = ()
    name: str = ""
    board: tuple[float, ...] | None = None

    @property
    def ok(self) -> bool:
        """Whether no error was found."""
        return not self.count(Severity.ERROR)

    @property
    def exit_code(self) -> int:
        """Exit code: 2 if the spec itself has an error (SIT0xx), 1 for any other error, else 0."""
        errors = [finding for finding in self.findings if finding.severity == Severity.ERROR]
        return 2 if any(finding.rule.startswith("SIT0") for finding in errors) else 1 if errors else 0

    @property
    def is_orderable(self) -> bool:
        """Whether there are no errors, and no silenced errors."""
        return self.ok and not self.silenced

    def fails(self, on: Severity) -> bool:
        """Whether any finding has the severity `on` or a higher severity."""
        return any(finding.severity.is_at_least(on) for finding in self.findings)

    def count(self, severity: Severity) -> int:
        """Return the number of findings of a severity."""
        return sum(finding.severity == severity for finding in self.findings)

    def without(self, rules: Collection[str], reason: str) -> CheckedSpec:
        """Return the results without the findings of `rules`, which are added to ``not_checked`` with `reason`."""
        findings = tuple(finding for finding in self.findings if finding.rule not in rules)
        not_checked = tuple(skipped for skipped in self.not_checked if skipped.rule not in rules)
        left_out = tuple(NotChecked(rule, reason) for rule in rules)
        reached = tuple(each for each in self.reached if each.rule not in rules)
        return replace(self, findings=findings, not_checked=not_checked + left_out, reached=reached)

    def line(self, number: int | None, file: str | None = None) -> str | None:
        """Return line `number` (from 1) of the spec's text, or of `file` if given. None if there is no such line."""
        lines = (self.text if file is None else self.texts.get(file, "")).splitlines()
        return lines[number - 1] if number and 0 < number <= len(lines) else None


EXCERPT = 160  # Characters of a spec's line that are quoted by default


def excerpt(line: str, column: int, room: int | None = None) -> tuple[str, int]:
    """Return the part of a line around a column, and the position (from 0) of this column in the part.

    `column` counts from 1. The part has at most `room` characters, by default `EXCERPT`. A smaller `room` than 20
    counts as 20. Cut ends are marked by "...".
    """
    room = max(EXCERPT if room is None else room, 20)
    if len(line) <= room:
        return line, column - 1
    first = max(0, min(column - 1 - room // 3, len(line) - room))
    before, after = "..." if first else "", "..." if first + room < len(line) else ""
    return f"{before}{line[first + len(before) : first + room - len(after)]}{after}", column - 1 - first


def checked_spec(
    name: str, source: SpecSource, findings: Sequence[Finding], not_checked: Sequence[NotChecked],
    signals: Sequence[Signal] = (), fit: Sequence[Measure] = (), closing: Closing | None = None,
    reached: Sequence[RequirementResult] = (), board: tuple[float, ...] | None = None,
) -> CheckedSpec:
    """Return the results of a spec's checks. Findings without a line get the line and column of their key.

    `name` is the path as typed, and `source` the spec's text with its keys. The other arguments are the attributes of
    `CheckedSpec` with these names.
    """
    located = []
    for finding in findings:
        if finding.line is None:
            line, column = source.locate(finding.key)
            finding = replace(finding, line=line, column=column)
        located.append(finding)
    return CheckedSpec(
        source.path, source.text, tuple(located), tuple(not_checked), signals=tuple(signals), fit=tuple(fit),
        closing=closing, reached=tuple(reached), name=name, board=board,
    )


def sorted_by_place(findings: Sequence[Finding]) -> list[Finding]:
    """Return findings sorted by their place in the spec's text."""
    return sorted(findings, key=lambda f: (f.file or "", f.line or 0, f.column or 0, f.rule))


def sorted_by_severity(findings: Sequence[Finding]) -> list[Finding]:
    """Return findings sorted as in the report: errors first, then by place in the spec's text."""
    return sorted(findings, key=lambda f: (list(Severity).index(f.severity), f.line or 0, f.rule))


def numbered_places(findings: Sequence[Finding]) -> list[tuple[int, Finding]]:
    """Return the findings that have a place on the board, each with its number (from 1) in report and pictures."""
    return list(enumerate((finding for finding in sorted_by_severity(findings) if finding.place is not None), 1))


def finding_identities(findings: Sequence[Finding]) -> list[str]:
    """Return for each finding a text that identifies it in later checks of an edited spec.

    The text does not depend on lines or on numbers in the message. Several findings of one rule at one key are numbered
    at the end of the text, in the order of `findings`.
    """
    counts: Counter[tuple[str, str | None, str | None]] = Counter()
    names = []
    for finding in findings:
        key = (finding.rule, finding.key, finding.file)
        counts[key] += 1
        names.append("\0".join((finding.rule, finding.key or "", finding.file or "", str(counts[key]))))
    return names


def without_count(identity: str) -> str:
    """Return the text that identifies a finding (`finding_identities`) without the number at its end.

    The number distinguishes several findings of one rule at one key.
    """
    return identity.rpartition("\0")[0]


def fingerprint(*parts: str) -> str:
    """Return the first sixteen hexadecimal digits of the SHA-256 hash of the joined texts `parts`."""
    return sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()[:16]


BOARD = ("body_length_m", "body_width_m", "length_m", "width_m", "mount_length_m", "mount_width_m")
"""JSON keys of the board's sizes, in the order of `CheckedSpec.board`.

The last two exist only if a plate or a cap carries the board.
"""


def as_json(checked: Sequence[CheckedSpec]) -> str:
    """Return the JSON document of ``check`` (docs/commands.md): one entry per spec, missing numbers as null."""
    return to_json(json_document(checked))


def json_document(checked: Sequence[CheckedSpec]) -> dict[str, Any]:
    """Return the content of the JSON document of ``check`` as dictionaries, lists, texts and numbers."""
    return {
        "sitscad": __version__,
        "ok": all(spec.ok for spec in checked),
        "specs": [
            {
                "spec": spec.path,
                "name": spec.name or None,
                "ok": spec.ok,
                "findings": [finding_json(finding) for finding in spec.findings],
                "ignored": [
                    {"reason": ignored.reason, "by": ignored.by, "finding": finding_json(ignored.finding)}
                    for ignored in spec.ignored
                ],
                "not_checked": [{"rule": skipped.rule, "reason": skipped.reason} for skipped in spec.not_checked],
                "felt": [{name: getattr(reached, name) for name in RESULT_KEYS} for reached in spec.reached],
                "signal": [document(signal, SIGNAL) for signal in spec.signals],
                "fit": [document(measure, FIT) | {"parts": [document(part, FIT_PART) for part in measure.parts]}
                        for measure in spec.fit],
                "closing": None if spec.closing is None else closing_json(spec.closing),
                "board": None if spec.board is None else dict(zip(BOARD, spec.board, strict=False)),
            }
            for spec in checked
        ],
    }


def to_json(document: object) -> str:
    """Return `document` as JSON text in ASCII. Infinite numbers and NaN become null."""
    return json.dumps(_without_nan(document), indent=1, allow_nan=False) + "\n"


RESULT_KEYS = ("requirement", "rule", "measured", "limit", "unit", "axis", "at")
"""JSON keys of a requirement and its estimated value. They are also attributes of `RequirementResult`."""


FINDING_KEYS = ("rule", "name", "severity", "message", "hint", "key", "line", "column", "measured", "limit", "unit",
                "source")
"""JSON keys that every finding has. Other keys are only present if they have a value."""


def finding_json(finding: Finding) -> dict[str, Any]:
    """Return a finding as a dictionary for JSON: the keys `FINDING_KEYS`, further keys with a value, and its fixes."""
    entry: dict[str,
                Any] = {name: getattr(finding, name) for name in FINDING_KEYS} | {"severity": finding.severity.value}
    if finding.detail:
        entry["detail"] = finding.detail
    if finding.sigma is not None:
        entry["sigma"] = finding.sigma
    if finding.keeps_limit:
        entry["keeps_limit"] = True
    if finding.file is not None:
        entry["file"] = finding.file
    if finding.place is not None:
        place = finding.place
        entry["place"] = {"x_m": place.x, "y_m": place.y, "layer": place.layer, "nets": list(place.nets)}
    entry["fixes"] = [
        {"edits": [{"key": edit.key, "old": edit.old, "new": edit.new, "what": edit.what} for edit in remedy.edits],
         "safe": remedy.is_safe, "brings": list(remedy.new_warnings)} for remedy in finding.fixes
    ]
    return entry


def _without_nan(value: object) -> object:
    """Return a copy of dictionaries, lists and numbers in which infinite numbers and NaN are None."""
    if isinstance(value, Mapping):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_without_nan(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def read_findings(content: bytes, path: str, text: str) -> CheckedSpec | None:
    """Return the results stored in a ``findings.json``. None if it is unreadable or does not hold exactly one spec.

    `content` is the JSON file. `path` and `text` are the path and text of the spec, which the JSON file does not
    contain.
    """
    try:
        (spec,) = json.loads(content)["specs"]
        ignored = [Ignored(_read_finding(each["finding"]), each["reason"], each["by"]) for each in spec["ignored"]]
        not_checked = tuple(NotChecked(each["rule"], each["reason"]) for each in spec["not_checked"])
        findings = tuple(map(_read_finding, spec["findings"]))
        closing, shut = None, spec["closing"]
        if shut is not None:
            closing = Closing(shut["parallel_at_m"], shut["reach_m"], shut["opening_rad"], shut["pivot_offset_m"])
        signals = tuple(
            Signal(**{quantity.field: each[quantity.key] for quantity in SIGNAL}) for each in spec["signal"])
        return CheckedSpec(
            path, text, findings, not_checked, signals=signals, ignored=tuple(ignored),
            fit=tuple(map(_read_measure, spec["fit"])), closing=closing,
            reached=tuple(RequirementResult(**each) for each in spec["felt"]), name=spec["name"] or "",
            board=None if spec["board"] is None else tuple(
                spec["board"][key] for key in BOARD if key in spec["board"]),
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _read_finding(entry: dict[str, Any]) -> Finding:
    place = entry.get("place")
    fixes = (
        Remedy(tuple(Edit(each["key"], each["new"], each["old"], each.get("what", "value")) for each in fix["edits"]),
               tuple(fix["brings"]))
        for fix in entry.get("fixes", ())
    )
    return Finding(
        **{name: entry[name] for name in FINDING_KEYS} | {"severity": Severity(entry["severity"])},
        sigma=entry.get("sigma"),
        keeps_limit=entry.get("keeps_limit", False), detail=entry.get("detail", ""), file=entry.get("file"),
        place=None if place is None else Place(place["x_m"], place["y_m"], place["layer"], tuple(place["nets"])),
        fixes=tuple(fixes),
    )


def _read_measure(entry: dict[str, Any]) -> Measure:
    parts = tuple(Share(**{quantity.field: each[quantity.key] for quantity in FIT_PART}) for each in entry["parts"])
    values = {quantity.field: entry[quantity.key] for quantity in FIT if quantity.field != "margin"}
    return Measure(**values, parts=parts)
