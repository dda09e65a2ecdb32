"""Findings as text for a person, in a short form and a full form (`OutputOptions.verbose`).

The short form prints findings that fail the command in full and warnings in one line. It counts the rest and names the
option to see them. The full form has ``file:line:column rule severity message``, the line of the spec and the hint of
every finding. It also has every rule that was not checked with its reason, and every measured value. Rules are listed
as text, as JSON and as a page.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path, PurePosixPath
from textwrap import wrap
from typing import Protocol

from sitscad.basics.finding import Finding, Ignored, Severity
from sitscad.basics.record import record
from sitscad.basics.units import count_text, escape_controls
from sitscad.basics.version import __version__
from sitscad.checks.examples import reason_without_example, rule_example
from sitscad.checks.findings.document import CheckedSpec, excerpt, sorted_by_place, sorted_by_severity, to_json
from sitscad.checks.findings.measures import closing_text, fit_lines, performance_text, signal_lines

INDENT = 6  # Indent (columns) of a finding's further lines


class RuleTexts(Protocol):
    """Texts of a rule, without the function that applies it."""

    @property
    def id(self) -> str: ...  # noqa: D102
    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def severity(self) -> Severity: ...  # noqa: D102
    @property
    def summary(self) -> str: ...  # noqa: D102
    @property
    def why(self) -> str: ...  # noqa: D102
    @property
    def mend(self) -> str: ...  # noqa: D102
    @property
    def source(self) -> str: ...  # noqa: D102


@record
class OutputOptions:
    """Options for the output of findings.

    Attributes
    ----------
    colour : bool
        whether the text has terminal colours
    rules : tuple of RuleTexts
        all rules, sorted by identifier
    fail_on : Severity
        mildest severity that fails the command
    root : str
        folder of the repository; paths in formats for other programs are relative to it
    has_names : bool
        whether every line of the text names its spec, even if there is a single spec
    verbose : bool
        whether the text has the full form
    hints : bool
        whether the short form has warnings in full, with their hints
    width : int or None
        number of characters at which lines are folded; None if they are not folded
    """

    colour: bool = False
    rules: tuple[RuleTexts, ...] = ()
    fail_on: Severity = Severity.ERROR
    root: str = "."
    has_names: bool = False
    verbose: bool = False
    hints: bool = False
    width: int | None = None

    def is_told_in_full(self, severity: Severity) -> bool:
        """Whether the short form prints a finding of this severity completely, with its line and hint."""
        return severity.is_at_least(self.fail_on) or (self.hints and severity.is_at_least(Severity.WARNING))

    def path_from_root(self, path: str) -> str:
        """Return a path relative to the folder ``root``, with forward slashes. A path outside it remains as typed."""
        try:
            whole = Path(os.path.abspath(path))
            return PurePosixPath(whole.relative_to(os.path.abspath(self.root))).as_posix()
        except ValueError:
            return path.replace(os.sep, "/")


_BRIEF = OutputOptions()


def as_text(checked: Sequence[CheckedSpec], output: OutputOptions = _BRIEF) -> str:
    """Return the text with the findings of all specs, the measured values, and the final verdict.

    Every line names its spec if there are several, or if `OutputOptions.has_names` is set. For several specs, only the
    full form has the measured values.
    """
    output, colour = replace(output, has_names=output.has_names or len(checked) > 1), output.colour
    groups = [group for spec in checked for group in _findings_text(spec, output)]
    if output.verbose or not output.has_names:
        groups += [_values_text(spec, output) for spec in checked]
    name = _named(checked[0], output) if len(checked) == 1 else ""
    if output.verbose:
        last = [line for spec in checked for line in _reasons_text(spec, output)]
    else:
        last = _not_checked_text(checked, name, output)
    last += [line for spec in checked for line in _ignored_text(spec, output)]
    final = summary(checked, colour)
    if not output.verbose:  # what the short form leaves out, and the option that shows it
        milder = {f.severity for spec in checked for f in spec.findings if not output.is_told_in_full(f.severity)}
        labels = {Severity.NOTE: "notes", Severity.WARNING: "hints"}
        hidden = " and ".join(word for severity, word in labels.items() if severity in milder)
        final = verdict_text(checked, colour) + (f" (check -v shows {hidden})" if hidden else "")
    last += [name + line for line in (*_fixes_text(checked, output.hints), final)]
    return "\n\n".join("\n".join(group) for group in (*groups, last) if group) + "\n"


def _findings_text(spec: CheckedSpec, output: OutputOptions) -> list[list[str]]:
    """Return the findings of a spec as groups of lines.

    Each finding that is printed in full has its own group. The last group has a line for each warning printed in short.
    """
    if output.verbose:
        return [_full_lines(spec, finding, output) for finding in sorted_by_place(spec.findings)]
    findings = sorted_by_severity(spec.findings)
    full = [_full_lines(spec, finding, output) for finding in findings if output.is_told_in_full(finding.severity)]
    milder = [f for f in findings if f.severity is Severity.WARNING and not output.is_told_in_full(f.severity)]
    return [*full, [line for finding in milder for line in _head(spec, finding, output)]]


def _fixes_text(checked: Sequence[CheckedSpec], are_all_tried: bool) -> list[str]:
    """Return a line with the number and the rules of findings that `check --fix` can remove. Empty if there are none.

    The line names the command. If all changes were tried (`are_all_tried`), the command has the option ``--hints
    full``. Without this option, it would find fewer fixes.
    """
    command = "check --fix --hints full" if are_all_tried else "check --fix"
    rules: dict[bool, list[str]] = {True: [], False: []}
    for finding in (finding for spec in checked for finding in spec.findings):
        if fixes := [fix for fix in finding.fixes if not fix.new_warnings]:
            rules[any(fix.is_safe for fix in fixes)].append(finding.rule)
    rule_lists = {is_safe: f" ({', '.join(sorted(set(rule_ids)))})" for is_safe, rule_ids in rules.items()}
    safe, unsafe = rules[True], rules[False]
    parts = [f"for {count_text(len(safe), 'finding')}{rule_lists[True]} by {command}"] if safe else []
    if unsafe:
        more = " more" if safe else ""
        parts.append(f"for {count_text(len(unsafe), 'finding')}{more}{rule_lists[False]} by check --fix --unsafe-fixes")
    return [f"fixes: {', '.join(parts)}"] if parts else []


def verdict_text(checked: Sequence[CheckedSpec], colour: bool = False) -> str:
    """Return the verdict with the numbers of errors, warnings and notes."""
    counts = [(severity, sum(spec.count(severity) for spec in checked)) for severity in Severity]
    counted_severities = [count_text(count, severity.value) for severity, count in counts if count]
    ok = all(spec.ok for spec in checked)
    status = styled("ok" if ok else "not ok", "green" if ok else "red", colour)
    where = f" in {len(checked)} specs" if len(checked) > 1 else ""
    return f"{status}: {', '.join(counted_severities) or 'no findings'}{where}"


def summary(checked: Sequence[CheckedSpec], colour: bool = False) -> str:
    """Return the verdict and the number of rules that were not checked, in one line."""
    skipped = sum(len(spec.not_checked) for spec in checked)
    return verdict_text(checked, colour) + (f"; {count_text(skipped, 'rule')} not checked" if skipped else "")


_COLOURS = {"red": "31;1", "yellow": "33;1", "cyan": "36", "green": "32;1", "dim": "2", "bold": "1"}
SEVERITY_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "cyan"}


def styled(text: str, colour: str, on: bool = True) -> str:
    """Return `text` in the terminal colour `colour`. If `on` is False, return it unchanged."""
    return f"\033[{_COLOURS[colour]}m{text}\033[0m" if on else text


def _head(spec: CheckedSpec, finding: Finding, output: OutputOptions) -> list[str]:
    where = ":".join(str(part) for part in (escape_controls(finding.file or spec.path), finding.line, finding.column)
                     if part)
    severity = styled(finding.severity.value, SEVERITY_COLOURS[finding.severity], output.colour)
    plain = f"{where} {finding.rule} {finding.severity.value} "
    first, *rest = _fold(plain, finding.message, INDENT, output)
    return [f"{styled(where, 'bold', output.colour)} {finding.rule} {severity} {first[len(plain) :]}", *rest]


def _full_lines(spec: CheckedSpec, finding: Finding, output: OutputOptions) -> list[str]:
    """Return the lines of a finding: its place with rule and message, its line of the spec, its detail and its hint."""
    lines, text = _head(spec, finding, output), spec.line(finding.line, finding.file)
    if text is not None:
        margin = f"{finding.line:>5} | "
        shown, caret = excerpt(text, finding.column or 1, output.width and output.width - len(margin))
        mark = styled("^", SEVERITY_COLOURS[finding.severity], output.colour)
        lines += [f"{margin}{escape_controls(shown)}", f"{'| ':>{len(margin)}}{'':{caret}}{mark}"]
    for word, content in (("detail", finding.detail), ("hint", finding.hint)):
        lines += _fold(f"{'':{INDENT}}{word}: ", content, INDENT + len(word) + 2, output) if content else []
    return lines


def _fold(head: str, text: str, indent: int, output: OutputOptions) -> list[str]:
    """Return `head` followed by `text` as lines no wider than the terminal.

    Lines after the first are indented by `indent` spaces.
    """
    text = escape_controls(text)
    if output.width is None:
        return [head + text]
    lines = wrap(
        _UNIT.sub(_UNBROKEN, text), max(output.width, 2 * INDENT), initial_indent=head, subsequent_indent=" " * indent,
        break_long_words=False, break_on_hyphens=False,
    )
    return [line.replace(_UNBROKEN, " ") for line in lines] or [head]


_UNIT, _UNBROKEN = re.compile(r"(?<=\d) (?=(?:%|[pnumkMG]?(?:m|H|F|ohm|Hz|N|Pa|V|A|s)\b))"), "\0"
"""Pattern of the space between a number and its unit, and the character that replaces it while lines are folded."""


def _not_checked_text(checked: Sequence[CheckedSpec], name: str, output: OutputOptions) -> list[str]:
    """Return a line with the number of rules not checked. It has the reason if all share a single reason."""
    reasons = [skipped.reason for spec in checked for skipped in spec.not_checked]
    if not reasons:
        return []
    several = "check -v says which and why" if len(set(reasons)) > 1 else reasons[0]
    return _dim(_fold(f"{name}not checked: {count_text(len(reasons), 'rule')} ", f"({several})", INDENT, output),
                output)


def _reasons_text(spec: CheckedSpec, output: OutputOptions) -> list[str]:
    """Return the rules of a spec that were not checked, one line per reason."""
    reasons: dict[str, list[str]] = {}
    requirements: list[str] = []  # all requirements that are not stated share one line
    for skipped in spec.not_checked:
        reason = skipped.reason
        if reason.startswith("no requirements.") and reason.endswith(" in the spec"):
            requirements.append(reason.removeprefix("no ").removesuffix(" in the spec").replace("requirements.", ""))
            reason = "requirements"
        reasons.setdefault(reason, []).append(skipped.rule)
    if requirements:
        unstated = f"no requirements in the spec for {', '.join(dict.fromkeys(requirements))}"
        reasons = {unstated if reason == "requirements" else reason: rules for reason, rules in reasons.items()}
    head = f"{_named(spec, output)}not checked: "
    reason_texts = (f"{', '.join(_rule_runs(rules))} ({reason})" for reason, rules in reasons.items())
    return _dim((line for reason_text in reason_texts for line in _fold(head, reason_text, INDENT, output)), output)


def _ignored_text(spec: CheckedSpec, output: OutputOptions) -> list[str]:
    """Return lines on ignored findings with reasons, and on silenced errors.

    The full form has a line per finding, the short form a line per rule and reason.
    """
    def why(each: Ignored) -> tuple[str, str]:
        return each.finding.rule, f"({each.by}: {each.reason})"

    texts = [f"{each.finding.rule} {each.finding.message} {why(each)[1]}" for each in spec.ignored]
    if not output.verbose:
        groups = ((*key, len(list(group))) for key, group in groupby(sorted(spec.ignored, key=why), why))
        texts = [f"{rule} {f'{count} times ' if count > 1 else ''}{reason}" for rule, reason, count in groups]
    name = _named(spec, output)
    lines = [line for each in texts for line in _fold(f"{name}ignored: ", each, INDENT, output)]
    if spec.silenced:
        rules = ", ".join(_rule_runs([finding.rule for finding in spec.silenced]))
        marked = f"{rules}: a package is marked as one that is not to be ordered"
        lines += _fold(f"{name}silenced errors: ", marked, INDENT, output)
    return _dim(lines, output)


def _values_text(spec: CheckedSpec, output: OutputOptions) -> list[str]:
    """Return lines with the board's size, the signal, the estimated performance, the fit and the closing of the jaw."""
    rows: list[tuple[str, Sequence[str]]] = []
    if spec.board is not None:
        sizes = [f"{size * 1e3:.4g}" for size in spec.board]
        body, over_all, mount = (" x ".join(sizes[k : k + 2]) for k in (0, 2, 4))
        rows += [("board", [f"body {body} mm, {over_all} mm over all"])]
        rows += [("mount", [f"{mount} mm outside"])] if mount else []
    if spec.signals or spec.reached:
        rows += [("signal", signal_lines(spec.signals)), ("felt", [performance_text(each) for each in spec.reached])]
    if spec.fit:
        rows += [("fit", fit_lines(spec.fit, output.verbose))]
        rows += [("closing", [closing_text(spec.closing)])] if spec.closing is not None else []
    width = max((len(label) for label, texts in rows if texts), default=0) + 2
    labels = ((f"{label}:" if k == 0 else "", text) for label, texts in rows for k, text in enumerate(texts))
    name = _named(spec, output)
    return [line for label, text in labels for line in _fold(f"{name}{label:{width}}", text, width + 2, output)]


def _named(spec: CheckedSpec, output: OutputOptions) -> str:
    return f"{escape_controls(spec.path)}: " if output.has_names else ""


def _dim(lines: Iterable[str], output: OutputOptions) -> list[str]:
    return [styled(line, "dim", output.colour) for line in lines]


def _rule_runs(rules: list[str]) -> list[str]:
    """Return rule identifiers with runs of three or more consecutive numbers shortened: ``SIT101-SIT117``."""
    runs: list[list[str]] = []
    for rule in sorted(set(rules)):
        if runs and rule[:3] == runs[-1][-1][:3] and rule[3:].isdigit() and int(rule[3:]) == int(runs[-1][-1][3:]) + 1:
            runs[-1].append(rule)
        else:
            runs.append([rule])
    return [text for run in runs for text in ([f"{run[0]}-{run[-1]}"] if len(run) > 2 else run)]


class ListedRule(RuleTexts, Protocol):
    """Rule in the output of ``sitscad rules``, with the severities of its findings as text."""

    @property
    def severities(self) -> str: ...  # noqa: D102


RULE_GROUPS = {
    "0": "The spec itself", "1": "Fabrication", "2": "Electrical and readout", "3": "Fit and mechanics",
    "4": "What the sensor feels",
}
"""Headings by the first digit of a rule's number."""


def rules_text(rules: Sequence[ListedRule]) -> str:
    """Return a line for each rule: identifier, name, severities and summary."""
    width = max(len(rule.name) for rule in rules)
    rows = (f"{rule.id}  {rule.name:<{width}}  {severities(rule):<20}  {rule.summary}" for rule in rules)
    return "\n".join(rows) + "\n"


def rules_json(rules: Sequence[ListedRule]) -> str:
    """Return all texts of all rules as JSON."""
    entries = [
        {
            "rule": rule.id, "name": rule.name, "severities": severities(rule).split(", "), "when": rule.severities,
            "summary": rule.summary, "why": rule.why, "mend": rule.mend, "source": rule.source,
        } | ({} if (example := rule_example(rule.id)) is None else {"wrong": example.wrong, "right": example.right})
        for rule in rules
    ]
    return to_json({"sitscad": __version__, "rules": entries})


def rules_markdown(rules: Sequence[ListedRule]) -> str:
    """Return a page with a section per rule, by group.

    Headings have the form `SIT103 coil-trace`, so that links to them stay valid.
    """
    lines = ["# Rules", ""]
    for figure, heading in RULE_GROUPS.items():
        lines += [f"## {heading}", ""]
        for rule in (each for each in rules if each.id[3:4] == figure):
            lines += [f"### {rule.id} {rule.name}", "", f"*{severities(rule)}*", "", rule.summary, ""]
            cases = severity_cases(rule)
            lines += [*(f"* {case}" for case in cases), *([""] if cases else [])]
            lines += [f"**Why:** {rule.why}", "", f"**To mend it:** {rule.mend}", ""]
            example = rule_example(rule.id)
            if example is not None:
                lines += ["```yaml", "# wrong", example.wrong, "# right", example.right, "```", ""]
            elif reason := reason_without_example(rule.id):
                lines += [f"**No example:** {reason}.", ""]
            sources = rule.source.split("; ")
            lines += [f"**Source:** {rule.source}" if len(sources) == 1 else "**Sources:**", ""]
            lines += [*(f"* {source}" for source in sources), ""] if len(sources) > 1 else []
    return "\n".join(lines)


def severities(rule: ListedRule) -> str:
    """Return the severities without their conditions, mildest first: ``warning, error``."""
    listed = {case.partition(" ")[0] for case in re.split(r"[;,]\s*", rule.severities)}
    return ", ".join(word for word in ("note", "warning", "error") if word in listed)


def severity_cases(rule: ListedRule) -> list[str]:
    """Return the severities with their conditions, mildest first. Empty if all findings have one severity."""
    return rule.severities.split("; ") if rule.severities != severities(rule) else []


RULE_FORMATS: Mapping[str, Callable[[Sequence[ListedRule]], str]] = {
    "text": rules_text, "json": rules_json, "markdown": rules_markdown,
}
"""Output formats of ``rules``."""
