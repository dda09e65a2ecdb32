"""`check`: every rule that applies to a design, and an honest list of those that could not be applied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sitscad.checks.assembly.fit import FIT_RULES
from sitscad.checks.assembly.joints import JOINT_RULES
from sitscad.checks.assembly.mount_walls import MOUNT_WALL_RULES
from sitscad.checks.assembly.overhang import OVERHANG_RULES
from sitscad.checks.assembly.pair_in_port import PAIR_IN_PORT_RULES
from sitscad.checks.assembly.plates import PLATE_RULES
from sitscad.checks.assembly.room_in_jaw import ROOM_IN_JAW_RULES
from sitscad.checks.assembly.sheets_and_fingers import SHEET_AND_FINGER_RULES
from sitscad.checks.assembly.solid_fit import SOLID_FIT_RULES
from sitscad.checks.assembly.transduction import TRANSDUCTION_RULES
from sitscad.checks.board.bend import BEND_RULES
from sitscad.checks.board.clearances import CLEARANCE_RULES
from sitscad.checks.board.coverlay import COVERLAY_RULES
from sitscad.checks.board.drawn_form import DRAWN_FORM_RULES
from sitscad.checks.board.fabrication import FABRICATION_RULES
from sitscad.checks.board.offered import OFFER_RULES
from sitscad.checks.board.plug import PLUG_RULES
from sitscad.checks.board.room import ROOM_RULES
from sitscad.checks.board.step import STEP_RULES
from sitscad.checks.board.track_lines import TRACK_RULES
from sitscad.checks.feeling.felt import noted
from sitscad.checks.feeling.maps import MAP_RULES
from sitscad.checks.feeling.requirements import REQUIREMENT_RULES
from sitscad.checks.reading.drive import DRIVE_RULES
from sitscad.checks.reading.electrical import ELECTRICAL_RULES
from sitscad.checks.reading.leads import LEAD_RULES
from sitscad.checks.reading.response import RESPONSE_RULES
from sitscad.checks.reading.shear import SHEAR_RULES
from sitscad.checks.reading.thin_target import THIN_TARGET_RULES
from sitscad.checks.reading.timing import TIMING_RULES
from sitscad.checks.rules import Outcome, Rule, outcomes
from sitscad.checks.trials import Trials
from sitscad.checks.usual_ranges import USUAL_RANGE_RULES
from sitscad.design import Design
from sitscad.finding import Finding, NotChecked, Severity
from sitscad.geometry.path import bounding_box
from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.remedy.budget import DECISIVE, HINTS, Budget
from sitscad.spec.rules import SPEC_RULES, SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.validity import refuse_unusable

if TYPE_CHECKING:
    from sitscad.estimates import Estimates
    from sitscad.measured import Closing, Measure, Reached, Signal

__all__ = ["HINTS", "RULES", "CheckResult", "Rule", "add_rules", "all_rules", "check", "explain", "mended"]

_LOADING = tuple(
    Rule(row.id, row.name, row.severity, row.summary, row.why, row.mend, "docs/spec.md") for row in SPEC_RULES
)
"""The rules of the spec itself: applied while it is loaded, listed here so that all rules stand in one table."""

_TABLES = (
    _LOADING, TRACK_RULES, FABRICATION_RULES, CLEARANCE_RULES, COVERLAY_RULES, ROOM_RULES, DRAWN_FORM_RULES,
    BEND_RULES, PLUG_RULES, OFFER_RULES, STEP_RULES, ELECTRICAL_RULES, DRIVE_RULES, TIMING_RULES, RESPONSE_RULES,
    FIT_RULES, ROOM_IN_JAW_RULES, PAIR_IN_PORT_RULES, MOUNT_WALL_RULES, JOINT_RULES, SHEET_AND_FINGER_RULES,
    SHEAR_RULES, TRANSDUCTION_RULES, THIN_TARGET_RULES, PLATE_RULES, OVERHANG_RULES, LEAD_RULES, REQUIREMENT_RULES,
    MAP_RULES, SOLID_FIT_RULES, USUAL_RANGE_RULES,
)

RULES: tuple[Rule, ...] = tuple(sorted((rule for table in _TABLES for rule in table), key=lambda rule: rule.id))
"""Every rule, in the order of their identifiers."""


_added: tuple[Rule, ...] = ()


def add_rules(rules: tuple[Rule, ...]) -> None:
    """Put rules of a plugin in force for this process."""
    global _added
    _added = (*_added, *rules)


def all_rules() -> tuple[Rule, ...]:
    """Every rule in force, those of plugins among them, in the order of their identifiers."""
    return tuple(sorted((*RULES, *_added), key=lambda rule: rule.id)) if _added else RULES


@record
class CheckResult:
    """What was found, in the order of rule and place, what could not be checked, with the reason, what each coil's
    reading does from rest to the required force, what was measured of the sensor in its jaw, how that closes, what is
    felt beside what is required (``reached``; ``felt`` in the text and JSON of `sitscad check`), and the board's size:
    length and width (m) of its body, and of all of it.
    """

    findings: tuple[Finding, ...]
    not_checked: tuple[NotChecked, ...]
    signals: tuple[Signal, ...] = ()
    fit: tuple[Measure, ...] = ()
    closing: Closing | None = None
    reached: tuple[Reached, ...] = ()
    board: tuple[float, float, float, float] | None = None

    @property
    def ok(self) -> bool:
        """Whether no error was found."""
        return not any(finding.severity is Severity.ERROR for finding in self.findings)


def check(
    spec: SensorSpec, layout: Layout | None = None, estimates: Estimates | None = None, hints: str = DECISIVE
) -> CheckResult:
    """Apply every rule to a design.

    The spec is laid out and estimated here unless `layout` and `estimates` are given. Nothing of CAD is imported. The
    result is the same whatever the order of the rules: findings are sorted by rule, line, column and message. Where a
    hint says that something was tried, the changed design was laid out, estimated and checked. `hints` is what such
    trials may cost: ``none``; ``decisive``, about as much as the check itself, errors first; ``full``, minutes. The
    verdict is the same with each. Raises ValueError for any other choice, and SpecError for a spec put together in
    Python that has values which no text could have.
    """
    refuse_unusable(spec)
    return judged(Design(spec, layout, estimates), hints)


def judged(design: Design, hints: str = DECISIVE) -> CheckResult:
    """What every rule says of a design; its layout and estimates are made when a rule first asks for them. As `check`
    otherwise.
    """
    budget = Budget.of(hints, design.spec)
    said: list[Outcome] = []
    not_checked: list[NotChecked] = []
    for rule in all_rules():
        found, undecided = outcomes(rule, design)
        said += found
        not_checked += [reason for reason in undecided if reason not in not_checked]
    if not any(outcome.finding.severity is Severity.ERROR for outcome in said):
        budget = budget.for_warnings()
    findings = Trials(design, all_rules(), said, not_checked, budget).advised()
    from sitscad.estimates.signal import signals  # loads nothing that the rules have not loaded

    x0, y0, x1, y1 = bounding_box([design.layout.outline])
    return CheckResult(tuple(sorted(findings, key=_order)), tuple(not_checked), signals(design.estimates), design.fit,
                       design.closing, noted(design), (*design.layout.body_size, x1 - x0, y1 - y0))


def mended(error: SpecError, hints: str = DECISIVE) -> tuple[Finding, ...]:
    """The findings of a spec that could not be loaded, with the fixes with which reading it again finds them gone;
    where only coils or turns lack room, hints and fixes name what gives it, laid out and checked as far as the budget
    of `hints` goes (as of `check`).
    """
    from sitscad.checks import cramped, unread  # only specs that are refused

    return unread.tried(error, cramped.mended(error, all_rules(), hints))


def explain(rule_id: str) -> str:
    """What a rule checks, why, how to mend a breach, and where its limit comes from; KeyError for an unknown rule."""
    rule = next((rule for rule in all_rules() if rule_id.upper() == rule.id or rule_id.lower() == rule.name), None)
    if rule is None:
        raise KeyError(rule_id)
    return "\n\n".join(
        (f"{rule.id} {rule.name} ({rule.severities})", rule.summary, f"Why: {rule.why}", f"To mend it: {rule.mend}",
         f"Source: {rule.source}")
    )


def _order(finding: Finding) -> tuple[str, int, int, str]:
    return finding.rule, finding.line or 0, finding.column or 0, finding.message
