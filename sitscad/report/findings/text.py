"""Findings as text for a person: one line a finding, the offending line of the spec under it, and a hint."""

from __future__ import annotations

from collections.abc import Sequence

from sitscad.finding import Finding, Severity
from sitscad.report.findings.checked import CheckedSpec, in_order


def as_text(checked: Sequence[CheckedSpec], colour: bool = False, named: bool = False) -> str:
    """``file:line:column rule severity message``, the offending line under it, a hint, and a summary in the end.

    Every line names its spec where there are several, or `named` says that others are told before or after.
    """
    name_it = named or len(checked) > 1
    blocks = [_finding_text(spec, finding, colour) for spec in checked for finding in in_order(spec.findings)]
    left_out = [line for spec in checked for line in _not_checked_text(spec, name_it, colour)]
    left_out += [line for spec in checked for line in _ignored_text(spec, name_it, colour)]
    felt = [line for spec in checked for line in _signal_text(spec, name_it)]
    felt += [line for spec in checked for line in _felt_text(spec, name_it)]
    felt += [line for spec in checked for line in _fit_text(spec, name_it)]
    verdict = (f"{printable(checked[0].path)}: " if named and len(checked) == 1 else "") + summary(checked, colour)
    return "\n".join([*blocks, *left_out, *felt, *_fixes_text(checked), verdict]) + "\n"


def _fixes_text(checked: Sequence[CheckedSpec]) -> list[str]:
    """How many findings `check --fix` has something for; nothing where it has none."""
    fixes = [[fix for fix in finding.fixes if not fix.brings] for spec in checked for finding in spec.findings]
    safe = sum(any(fix.is_safe for fix in found) for found in fixes)
    unsafe = sum(bool(found) for found in fixes) - safe
    words = [f"for {_number(safe, 'finding')} by check --fix"] if safe else []
    words += [f"for {_number(unsafe, 'finding')}{' more' if safe else ''} by --fix --unsafe-fixes"] if unsafe else []
    return [f"fixes: {', '.join(words)}"] if words else []


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


_COLOURS = {"red": "31;1", "yellow": "33;1", "cyan": "36", "green": "32;1", "dim": "2", "bold": "1"}
SEVERITY_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "cyan"}


def styled(text: str, colour: str, on: bool = True) -> str:
    """`text` in a colour of the terminal, or as it is."""
    return f"\033[{_COLOURS[colour]}m{text}\033[0m" if on else text


def printable(text: str) -> str:
    """`text` with tabs as spaces and without anything that could steer a terminal."""
    return "".join(" " if c == "\t" else c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _finding_text(spec: CheckedSpec, finding: Finding, colour: bool) -> str:
    """One finding with its line of the spec and its hint."""
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
    requirements: list[str] = []  # all that are not stated make one line, not one each
    for skipped in spec.not_checked:
        reason = skipped.reason
        if reason.startswith("no requirements.") and reason.endswith(" in the spec"):
            requirements.append(reason.removeprefix("no ").removesuffix(" in the spec").replace("requirements.", ""))
            reason = "requirements"
        reasons.setdefault(reason, []).append(skipped.rule)
    if requirements:
        unstated = f"no requirements in the spec for {', '.join(dict.fromkeys(requirements))}"
        reasons = {unstated if reason == "requirements" else reason: rules for reason, rules in reasons.items()}
    prefix = f"{printable(spec.path)}: " if name_it else ""
    grouped = ((", ".join(_in_runs(rules)), printable(reason)) for reason, rules in reasons.items())
    return [styled(f"{prefix}not checked: {rules} ({reason})", "dim", colour) for rules, reason in grouped]


def _ignored_text(spec: CheckedSpec, name_it: bool, colour: bool) -> list[str]:
    """What is ignored, one line a finding with its reason, and the errors among it that mark a package."""
    prefix = f"{printable(spec.path)}: " if name_it else ""
    lines = [
        f"{prefix}ignored: {each.finding.rule} {printable(each.finding.message)} ({each.by}: {printable(each.reason)})"
        for each in spec.ignored
    ]
    if spec.silenced:
        rules = ", ".join(_in_runs([finding.rule for finding in spec.silenced]))
        lines.append(f"{prefix}silenced errors: {rules}: a package is marked as one that is not to be ordered")
    return [styled(line, "dim", colour) for line in lines]


def _signal_text(spec: CheckedSpec, name_it: bool) -> list[str]:
    """The change per newton of all coils in one line; none where there is no signal."""
    from sitscad.report.signal import headline  # only where something was estimated

    prefix = f"{printable(spec.path)}: " if name_it else ""
    return [f"{prefix}signal: {'; '.join(headline(spec.signals))}"] if spec.signals else []


def _felt_text(spec: CheckedSpec, name_it: bool) -> list[str]:
    """What is felt beside what is required in one line; none where nothing of it is required."""
    from sitscad.report.signal import felt_words  # only where something is required

    prefix = f"{printable(spec.path)}: " if name_it else ""
    return [f"{prefix}felt: {'; '.join(map(felt_words, spec.reached))}"] if spec.reached else []


def _fit_text(spec: CheckedSpec, name_it: bool) -> list[str]:
    """The fit in its jaw in one line; none without a jaw."""
    from sitscad.report.fit import closing_words, headline  # only where something was measured

    prefix = f"{printable(spec.path)}: " if name_it else ""
    if not spec.fit:
        return []
    closes = [f"{prefix}closing: {closing_words(spec.closing)}"] if spec.closing is not None else []
    return [f"{prefix}fit {headline(spec.fit)}", *closes]


def _in_runs(rules: list[str]) -> list[str]:
    """Identifiers with runs of three and more neighbours drawn together: ``SIT101-SIT117``."""
    runs: list[list[str]] = []
    for rule in sorted(set(rules)):
        if runs and rule[:3] == runs[-1][-1][:3] and rule[3:].isdigit() and int(rule[3:]) == int(runs[-1][-1][3:]) + 1:
            runs[-1].append(rule)
        else:
            runs.append([rule])
    return [text for run in runs for text in ([f"{run[0]}-{run[-1]}"] if len(run) > 2 else run)]


def _number(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
