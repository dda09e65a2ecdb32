"""What checks found in one spec, with the text that findings point into, and the orders that reports list them in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING

from sitscad.finding import Finding, Ignored, NotChecked, Severity
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import SpecSource

if TYPE_CHECKING:
    from sitscad.measured import Closing, Measure, RequirementResult, Signal


@record
class CheckedSpec:
    """One spec after its checks: the path as typed, the text that findings point into, and what was found.

    ``texts`` are those of other files that findings point into, by path; ``signals`` what each coil does from rest to
    the required force; ``fit`` what was measured of the sensor in its jaw, ``closing`` how that closes; ``reached``
    what is felt beside what is required; ``ignored`` what was found and is not held against the spec, each with the
    reason; ``silenced`` the errors among that and what was left out that only physics can judge: they stop no build,
    but mark its package; ``name`` the spec's own name, empty where it could not be read;
    ``board`` the length and width (m) of the board's body and of all of it.
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
    board: tuple[float, float, float, float] | None = None

    @property
    def ok(self) -> bool:
        """Whether no error was found."""
        return not self.count(Severity.ERROR)

    @property
    def exit_code(self) -> int:
        """2 when the spec itself is at fault (an error of SIT0xx), else 1 with any error, else 0."""
        errors = [finding for finding in self.findings if finding.severity == Severity.ERROR]
        return 2 if any(finding.rule.startswith("SIT0") for finding in errors) else 1 if errors else 0

    @property
    def is_orderable(self) -> bool:
        """Whether no error was found, and none was silenced that is no matter of opinion."""
        return self.ok and not self.silenced

    def fails(self, on: Severity) -> bool:
        """Whether anything was found that weighs as much as `on`, or more."""
        return any(finding.severity.weighs(on) for finding in self.findings)

    def count(self, severity: Severity) -> int:
        """How many findings have this severity."""
        return sum(finding.severity == severity for finding in self.findings)

    def without(self, rules: Collection[str], reason: str) -> CheckedSpec:
        """The same without what these rules found; they count as not checked, for this reason."""
        findings = tuple(finding for finding in self.findings if finding.rule not in rules)
        not_checked = tuple(skipped for skipped in self.not_checked if skipped.rule not in rules)
        left_out = tuple(NotChecked(rule, reason) for rule in rules)
        reached = tuple(each for each in self.reached if each.rule not in rules)
        return replace(self, findings=findings, not_checked=not_checked + left_out, reached=reached)

    def line(self, number: int | None, file: str | None = None) -> str | None:
        """A line of the spec's text, or of another file's, counted from 1; None where there is none."""
        lines = (self.text if file is None else self.texts.get(file, "")).splitlines()
        return lines[number - 1] if number and 0 < number <= len(lines) else None


EXCERPT = 160
"""Characters of a spec's line that are quoted where nobody says how many there is room for."""


def excerpt(line: str, column: int, room: int | None = None) -> tuple[str, int]:
    """As much of a line as there is room for about a column (from 1), and how many characters of it stand before."""
    room = max(EXCERPT if room is None else room, 20)
    if len(line) <= room:
        return line, column - 1
    first = max(0, min(column - 1 - room // 3, len(line) - room))
    before, after = "..." if first else "", "..." if first + room < len(line) else ""
    return f"{before}{line[first + len(before) : first + room - len(after)]}{after}", column - 1 - first


def checked_spec(
    spec: SensorSpec, findings: Sequence[Finding], not_checked: Sequence[NotChecked], signals: Sequence[Signal] = (),
    fit: Sequence[Measure] = (), closing: Closing | None = None, reached: Sequence[RequirementResult] = (),
    board: tuple[float, float, float, float] | None = None,
) -> CheckedSpec:
    """A spec with its findings, each given its place in the text where it has none yet, and what was measured of it."""
    source, placed = spec.source, (_placed(spec.source, finding) for finding in findings)
    return CheckedSpec(
        source.path, source.text, tuple(placed), tuple(not_checked), signals=tuple(signals), fit=tuple(fit),
        closing=closing, reached=tuple(reached), name=spec.name, board=board,
    )


def _placed(source: SpecSource, finding: Finding) -> Finding:
    if finding.line is not None:
        return finding
    line, column = source.locate(finding.key)
    return replace(finding, line=line, column=column)


def in_order(findings: Sequence[Finding]) -> list[Finding]:
    """Findings in the order of the spec's text."""
    return sorted(findings, key=lambda f: (f.file or "", f.line or 0, f.column or 0, f.rule))


def by_weight(findings: Sequence[Finding]) -> list[Finding]:
    """Findings as the report lists them: errors first, then in the order of the spec's text."""
    return sorted(findings, key=lambda f: (list(Severity).index(f.severity), f.line or 0, f.rule))


def numbered_places(findings: Sequence[Finding]) -> list[tuple[int, Finding]]:
    """The findings that have a place on the board, numbered from 1 as report and pictures number them."""
    return list(enumerate((finding for finding in by_weight(findings) if finding.place is not None), 1))


def worst_first(checked: Sequence[CheckedSpec]) -> list[tuple[CheckedSpec, Finding]]:
    """The findings of all specs, each with its spec: errors first, then in the order of specs and of their text."""
    pairs = [(spec, finding) for spec in checked for finding in by_weight(spec.findings)]
    return sorted(pairs, key=lambda pair: list(Severity).index(pair[1].severity))


def identities(findings: Sequence[Finding]) -> list[str]:
    """For every finding a text that stays the same when lines move, or when the numbers in its message change.

    Findings of one rule at one key are told apart by their turn, in the order given.
    """
    seen: Counter[tuple[str, str | None, str | None]] = Counter()
    names = []
    for finding in findings:
        key = (finding.rule, finding.key, finding.file)
        seen[key] += 1
        names.append("\0".join((finding.rule, finding.key or "", finding.file or "", str(seen[key]))))
    return names


def turnless(identity: str) -> str:
    """An identity without its turn: all findings of one rule at one key share it."""
    return identity.rpartition("\0")[0]


def fingerprint(*parts: str) -> str:
    """Sixteen hexadecimal digits of the SHA-256 of some texts."""
    import hashlib  # loads OpenSSL, which a plain check does not need

    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass")).hexdigest()[:16]
