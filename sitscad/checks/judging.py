"""The function `check`: it applies every rule to a design, and lists the rules that could not be applied."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import indent
from typing import TYPE_CHECKING

from sitscad.assembly.places.seating import mount_size
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Finding, NotChecked, Severity
from sitscad.basics.record import record
from sitscad.basics.units import count_text
from sitscad.checks import performance, required_loads, usual_ranges
from sitscad.checks.assembly import fit, mount, overhang, plates, room_in_jaw, thermistor, transduction
from sitscad.checks.board import clearances, drawn_form, fabrication, room, tail
from sitscad.checks.examples import reason_without_example, rule_example
from sitscad.checks.findings.text import severities, severity_cases
from sitscad.checks.fixes.search import DECISIVE, HINTS, Budget
from sitscad.checks.reading import drive, electrical, metal, reference, response, timing
from sitscad.checks.rules import Outcome, Rule, rule_of, rule_outcomes
from sitscad.checks.trials import Trials, findings_with_tested_fixes
from sitscad.estimates.design import Design
from sitscad.kernels.solve_cache import cache_results
from sitscad.layout.board import Layout
from sitscad.spec.reading import RULE_NAMES, SpecError
from sitscad.spec.resolver.validity import refuse_unusable
from sitscad.spec.sensor import SensorSpec

if TYPE_CHECKING:
    from sitscad.basics.check_results import Closing, Measure, RequirementResult, Signal
    from sitscad.estimates import Estimates

__all__ = ["HINTS", "RULES", "CheckResult", "Rule", "add_rules", "all_rules", "check", "explain", "mended"]

_ROOMS = (fit, mount, overhang, plates, room_in_jaw, thermistor, transduction, clearances, drawn_form, fabrication,
          room, tail, drive, electrical, metal, reference, response, timing, performance, required_loads, usual_ranges)

RULES: tuple[Rule, ...] = tuple(
    sorted((*map(rule_of, RULE_NAMES), *(rule for module in _ROOMS for rule in module.RULES)), key=lambda rule: rule.id)
)
"""Every rule, sorted by identifier. Rules of the spec itself (SIT0xx) are applied when the spec is loaded."""


_added: tuple[Rule, ...] = ()


def add_rules(rules: tuple[Rule, ...]) -> None:
    """Add rules of a plugin for this process."""
    global _added
    _added = (*_added, *rules)


def all_rules() -> tuple[Rule, ...]:
    """Return every active rule, including rules of plugins, sorted by identifier."""
    return tuple(sorted((*RULES, *_added), key=lambda rule: rule.id)) if _added else RULES


@record
class CheckResult:
    """The result of a check: findings sorted by rule and place, and the checks that were not made, with reasons.

    ``signals`` are the changes of each coil's reading from rest to the required force. ``fit`` compares the sensor's
    sizes with its jaw, and ``closing`` describes how the jaws close. ``reached`` lists each requirement with its
    estimated value; the text and JSON of `sitscad check` name this list ``felt``. ``board`` is the length and width (m)
    of the board's body, then of the whole board, then of the plate or cap below it.
    """

    findings: tuple[Finding, ...]
    not_checked: tuple[NotChecked, ...]
    signals: tuple[Signal, ...] = ()
    fit: tuple[Measure, ...] = ()
    closing: Closing | None = None
    reached: tuple[RequirementResult, ...] = ()
    board: tuple[float, ...] | None = None

    def __repr__(self) -> str:
        """Return a line with the verdict, the rules that report errors and warnings, and the number of notes."""
        graver = [f"{finding.rule} {finding.severity}" for finding in self.findings
                  if finding.severity is not Severity.NOTE]
        rule_text = ", ".join(dict.fromkeys(graver))
        notes = count_text(len(self.findings) - len(graver), "note")
        return f"<CheckResult {'ok' if self.ok else 'not ok'}: {rule_text[:160]}{', ' if rule_text else ''}{notes}>"

    @property
    def ok(self) -> bool:
        """Whether no error was found."""
        return not any(finding.severity is Severity.ERROR for finding in self.findings)


@checked_arguments
def check(
    spec: SensorSpec, layout: Layout | None = None, estimates: Estimates | None = None, hints: str = DECISIVE
) -> CheckResult:
    """Apply every rule to a design.

    Parameters
    ----------
    spec : SensorSpec
        The spec of the sensor.
    layout, estimates : optional
        Layout and estimates of this spec. They are computed if left out.
    hints : {"none", "decisive", "full"}
        Number of trials of changed designs for hints. ``none`` tries no change, for callers that read no hints.
        ``decisive`` tries a few changes, for errors first. ``full`` takes minutes. The verdict does not depend on it.

    Returns
    -------
    CheckResult
        Findings are sorted by rule, line, column and message, so that the order of rules does not matter.

    Raises
    ------
    ValueError
        For any other value of `hints`.
    SpecError
        For a spec built in Python with values that no text could have.

    Notes
    -----
    No CAD module is imported. A change that a hint calls tried was laid out, estimated and checked.

    Examples
    --------
    >>> import sitscad
    >>> coil = {"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...         "trace_width": "100 um", "trace_spacing": "100 um"}
    >>> spec = sitscad.SensorSpec.from_mapping(name="bench", coil=coil)
    >>> result = sitscad.check(spec, hints="none")
    >>> result.ok
    True
    """
    refuse_unusable(spec)
    return apply_rules(Design(spec, layout, estimates), hints)


@cache_results()
def apply_rules(
    design: Design, hints: str = DECISIVE, least: Severity | None = Severity.NOTE,
    is_ignored: Callable[[Finding], bool] = lambda _: False,
) -> CheckResult:
    """Apply every rule to a design. Layout and estimates are computed when a rule first needs them.

    `hints` is the name of the budget of trials for hints, as in `check`. No changes are tried for findings that are
    milder than `least`, or for which `is_ignored` returns True. If `least` is None, no changes are tried.
    """
    budget = Budget.of(hints)
    results: list[Outcome] = []
    not_checked: list[NotChecked] = []
    for rule in all_rules():
        outcomes, undecided = rule_outcomes(rule, design, least)
        results += outcomes
        not_checked += [reason for reason in undecided if reason not in not_checked]
    findings = Trials(design, all_rules(), results, not_checked, budget).advised(least, is_ignored)
    findings.sort(key=lambda finding: (finding.rule, finding.line or 0, finding.column or 0, finding.message))
    return CheckResult(tuple(findings), tuple(not_checked), design.estimates.signals, design.fit, design.closing,
                       performance.estimated_values(design.cells),
                       (*design.layout.body_size, *design.layout.size, *(mount_size(design.layout) or ())))


@checked_arguments
def mended(error: SpecError, hints: str = DECISIVE) -> tuple[Finding, ...]:
    """Return the findings of a spec that could not be loaded, with fixes that make it readable.

    If only coils or turns lack room, hints and fixes name changes that make room. These are laid out within the budget
    of `hints`, as in `check`.

    Parameters
    ----------
    error : SpecError
        The error of `load` or `load_text`.
    hints : {"none", "decisive", "full"}
        Number of trials of changed designs, as in `check`.

    Returns
    -------
    tuple of Finding
        The findings of the error, with fixes in ``fixes``.

    Examples
    --------
    >>> import sitscad
    >>> try:
    ...     sitscad.load_text("{sitscad: 1, name: bench, coil: {}}")
    ... except sitscad.SpecError as error:
    ...     print({finding.rule for finding in sitscad.mended(error, "none")})
    {'SIT003'}
    """
    return findings_with_tested_fixes(error, all_rules(), hints)


def explain(rule_id: str) -> str:
    """Return the texts of a rule: its summary, severities, reason, remedy and example, and the source of its limit.

    Raises KeyError for an unknown rule.
    """
    rule = next((rule for rule in all_rules() if rule_id.upper() == rule.id or rule_id.lower() == rule.name), None)
    if rule is None:
        raise KeyError(rule_id)
    parts = [f"{rule.id} {rule.name} ({severities(rule)})", rule.summary, "\n".join(severity_cases(rule)),
             f"Why: {rule.why}", f"To mend it: {rule.mend}"]
    example = rule_example(rule.id)
    if example is not None:
        parts += [f"{word}:\n{indent(text, '    ')}" for word, text in (("Wrong", example.wrong),
                                                                       ("Right", example.right))]
    elif reason := reason_without_example(rule.id):
        parts.append(f"No example: {reason}")
    return "\n\n".join(filter(None, (*parts, f"Source: {rule.source}")))
