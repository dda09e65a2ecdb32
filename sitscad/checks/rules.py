"""Rules with their preconditions, results and examples, and sitscad's own limits (`data/own_limits.csv`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field as field_of
from functools import cache, cached_property, partial
from string import Formatter

from sitscad.basics.check_results import RequirementResult
from sitscad.basics.finding import Finding, NotChecked, Place, Severity
from sitscad.basics.messages import text_of
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.checks.fixes.search import Family
from sitscad.data import rows
from sitscad.estimates.design import Cells, Design
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.converters.figures import source_in_all
from sitscad.spec.coil import written_key
from sitscad.spec.mount import Mount, StepPart
from sitscad.spec.reading import RULE_TEXTS
from sitscad.spec.sensor import Requirements, SensorSpec
from sitscad.spec.yaml.source import SpecSource

ROUNDING = 1e-9
"""Difference (m) below which two lengths count as equal. Rounding errors are below a nanometre."""


@record
class Violation:
    """A violation that a rule found, before the rule's texts are added.

    ``severity`` and ``source`` override the rule's values. ``fixes`` are families of changes that may remove the
    violation, the best first; the search in `fixes` tries them. ``hint`` is further advice, or a function that returns
    it. ``keeps_limit`` is True if ``measured`` meets the limit, but is near to it. If ``case`` is set, the texts are
    the templates of this case with ``values`` (`violation_of`), and ``message``, ``hint`` and ``detail`` are empty.
    """

    message: str = ""
    hint: str | Callable[[], str] = ""
    key: str | None = None
    measured: float | None = None
    limit: float | None = None
    unit: str | None = None
    severity: Severity | None = None
    source: str | None = None
    place: Place | None = None
    sigma: float | None = None
    fixes: tuple[Family, ...] = ()
    keeps_limit: bool = False
    detail: str = ""
    case: str = ""
    hint_case: str | Callable[[], str] = ""
    details: tuple[str, ...] = ()
    values: Mapping[str, object] = field_of(default_factory=dict)

    def text(self, part: str) -> str:
        """Return the ``message``, ``hint`` or ``detail`` (`part`) of the case, with its values inserted.

        The hint is the template of ``hint_case``, if set. The details of the cases in ``details`` are appended to the
        detail.
        """
        cases = (self.case, *self.details) if part == "detail" else (self._hint_case if part == "hint" else self.case,)
        named = {"measured": self.measured, "limit": self.limit, "key": self.key, **self.values}
        for name, value in (("measured_text", self.measured), ("limit_text", self.limit)):
            named[name] = "" if value is None else show(value, self.unit or "", 3)
        return join_texts(*(text_of(case, part, named) for case in cases))

    @cached_property
    def _hint_case(self) -> str:
        return (self.hint_case if isinstance(self.hint_case, str) else self.hint_case()) or self.case

    def cases(self, with_hint: bool) -> tuple[str, ...]:
        """Return the keys in ``data/messages.csv`` of the message, of the details and, if `with_hint`, of the hint.

        Empty if the texts were not made from a case.
        """
        hint_cases = (self._hint_case,) if with_hint and self.case else ()
        return tuple(dict.fromkeys((self.case, *self.details, *hint_cases))) if self.case else ()


def violation_of(
    case: str, key: str | None = None, measured: float | None = None, limit: float | None = None,
    unit: str | None = None, *, hint: str | Callable[[], str] = "", details: tuple[str, ...] = (),
    severity: Severity | None = None, source: str | None = None, place: Place | None = None,
    sigma: float | None = None, fixes: tuple[Family, ...] = (), keeps_limit: bool = False, **values: object,
) -> Violation:
    """Return a violation with the texts of a case in ``data/messages.csv``.

    `hint` is another case whose hint is used, or a function that returns the case. `details` are cases whose details
    are added. The templates name `values`, and also ``measured``, ``limit`` and ``key``, and ``measured_text`` and
    ``limit_text`` with the unit. A value that is a function is called only if its text is needed.
    """
    return Violation(
        key=key, measured=measured, limit=limit, unit=unit, severity=severity, source=source, place=place, sigma=sigma,
        fixes=fixes, keeps_limit=keeps_limit, case=case, hint_case=hint, details=details, values=values,
    )


@record
class Undecided:
    """Reason why a rule could not check a part of the design, although its preconditions were met.

    ``case`` is the key of the reason's template in ``data/messages.csv``. Rules of plugins have none.
    """

    reason: str
    case: str = ""


def not_checked(case: str, **values: object) -> Undecided:
    """Return the reason why a rule could not be checked. `case` is its key in ``data/messages.csv``."""
    return Undecided(text_of(case, "message", values), case)


def join_texts(*texts: str) -> str:
    """Join all texts that are not empty by semicolons."""
    return "; ".join(filter(None, texts))


Verdict = Violation | Undecided | RequirementResult
"""Results that a rule yields: a violation, a reason why a part was not checked, or the value for a requirement."""


@record
class Rule:
    """A rule: its texts for `explain`, its needs, and the function that applies it.

    ``severity`` is the highest severity of its findings. If there are several severities, ``cases`` has each with its
    condition, mildest first, separated by semicolons: ``warning if ...; error if ...``. ``needs`` are keys of `NEEDS`.
    """

    id: str
    name: str
    severity: Severity
    summary: str
    why: str
    mend: str
    source: str
    needs: tuple[str, ...] = ()
    apply: Callable[[Design], Iterable[Verdict]] | None = None
    cases: str = ""

    @property
    def severities(self) -> str:
        """Every severity that a finding of the rule can have, mildest first, each with its condition."""
        return self.cases or self.severity.value


def rule_of(
    number: str, apply: Callable[[Design], Iterable[Verdict]] | None = None, *needs: str, **values: object
) -> Rule:
    """Return a rule with its texts from ``data/rules.csv``.

    `number` is the rule's identifier, `apply` the function that yields its results, and `needs` are preconditions
    (keys of `NEEDS`). Names in braces in the texts are replaced by `values`. Other names in braces are values of
    converters, and are replaced by the sources of these values.
    """
    row = RULE_TEXTS[number]
    texts = {field: row[field] for field in ("summary", "why", "mend", "source", "severities")}
    for field, text in texts.items() if "{" in "".join(texts.values()) else ():
        named = {name for _, name, _, _ in Formatter().parse(text) if name}
        texts[field] = text.format_map(values | {name: source_in_all(name) for name in named - values.keys()})
    cases = texts.pop("severities")
    return Rule(number, row["name"], Severity(row["severity"]), **texts, needs=needs, apply=apply, cases=cases)


_ASKED = {"normal force": ("normal_force",), "shear force": ("shear_force",), "bandwidth": ("bandwidth",)}
"""Preconditions of rules on requirements outside SIT4xx. Each maps to the keys of ``requirements`` that must be set."""

_FEELING = {"normal resolution": ("normal_resolution",), "shear resolution": ("shear_resolution",),
            "moment resolution": ("moment_resolution",), "normal error": ("normal_error",),
            "shear error": ("shear_error",), "moment error": ("moment_error",),
            "crosstalk": ("crosstalk",), "tilt error": ("tilt", "tilt_error"), "friction error": ("friction_error",),
            "temperature error": ("temperature_range", "temperature_error")}
"""Preconditions of rules SIT4xx. Each maps to the keys of section ``requirements`` that must be set."""


_REQUIRED = _ASKED | _FEELING | {"force": ("normal_force", "shear_force")}

NO_REQUIREMENT = "no-requirement"
"""Key in ``data/messages.csv`` of the reason why a rule is not checked if the spec lacks a requirement."""

def _has_all(requirements: Requirements, keys: tuple[str, ...]) -> bool:
    return all(getattr(requirements, key) is not None for key in keys)


def _requirement_test(keys: tuple[str, ...]) -> Callable[[SensorSpec], bool]:
    return lambda spec: _has_all(spec.requirements, keys)


def _step_files(mount: Mount | None) -> tuple[StepPart | None, StepPart | None]:
    return (None, None) if mount is None else (mount.step, None if mount.jaw is None else mount.jaw.step)


NEEDS: dict[str, tuple[Callable[[SensorSpec], bool], str]] = {
    "target": (lambda s: s.target is not None, "no-target"),
    "elastomer": (lambda s: s.elastomer is not None, "no-elastomer"),
    "plate": (lambda s: s.target is not None or s.elastomer is not None, "no-plate"),
    "mount": (lambda s: s.mount is not None, "no-mount"),
    "jaw": (lambda s: s.jaw is not None, "no-jaw"),
    "STEP file": (lambda s: any(_step_files(s.mount)), "no-step-file"),
    "jaw file": (lambda s: s.mount is not None and s.mount.kind != "custom" and any(_step_files(s.mount)),
                 "no-jaw-file"),
    "reference": (lambda s: s.array.reference is not None, "no-reference"),
    "soldered thermistor": (lambda s: s.soldered_thermistor is not None, "no-soldered-thermistor"),
    "shield": (lambda s: s.shield is not None, "no-shield"),
    "tail": (lambda s: s.fpc.tail is not None, "no-tail"),
    **{need: (_requirement_test(keys), NO_REQUIREMENT) for need, keys in _REQUIRED.items()},
    "force": (lambda s: bool(s.requirements.normal_force or s.requirements.shear_force), NO_REQUIREMENT),
    "errors": (lambda s: any(getattr(s.requirements, f"{kind}_{what}") is not None
                             for kind in ("normal", "shear", "moment") for what in ("error", "resolution")),
               "no-error-limit"),
    "feeling": (lambda s: any(_has_all(s.requirements, keys) for keys in _FEELING.values()), "no-performance-limit"),
}
"""Preconditions of rules by name.

Each has a function that tests the spec, and the key in ``data/messages.csv`` of the reason if the test fails.
"""


@record
class Outcome:
    """A finding that is not yet located in the spec's text, with the families of changes to try for its hint."""

    finding: Finding
    fixes: tuple[Family, ...] = ()


ONE_CELL_RULES = {"SIT218", "SIT221", "SIT304", "SIT306", "SIT310", "SIT312", "SIT313", "SIT327",
                  *(f"SIT40{k}" for k in range(1, 10)), "SIT411", "SIT412", "SIT413", "SIT414"}
"""Rules that report only the worst cell of a sensor with several cells. They check target, pad and performance.

No changes are tried for the hints of these findings, because a trial needs a whole sensor.
"""


ARTWORK_RULES = frozenset(f"SIT{number}" for number in range(101, 134))
"""Rules about the artwork of sitscad's own boards. They do not apply to boards that the user drew."""

SOFTEST_CELL_RULES = {"SIT304", "SIT310", "SIT312"}
"""Rules on the pad's compression. If two cells are equally bad, they report the cell with the softest pad.

The softest pad has the fewest webs to its neighbours. Other rules of `ONE_CELL_RULES` then report the cell with the
smallest signal.
"""


def apply_rule(
    rule: Rule, design: Design, least: Severity | None = Severity.NOTE
) -> tuple[list[Finding], list[NotChecked]]:
    """Return the findings of one rule with their lines in the spec's text, and the reasons for cases not checked.

    Hints contain only general advice, because no changes are tried. Findings milder than `least` have no hint. If
    `least` is None, no finding has a hint.
    """
    results, undecided = rule_outcomes(rule, design, least)
    return [locate_finding(outcome.finding, design.spec.source) for outcome in results], undecided


def rule_outcomes(
    rule: Rule, design: Design, least: Severity | None = Severity.NOTE
) -> tuple[list[Outcome], list[NotChecked]]:
    """Return the findings of one rule with the changes to try, and the reasons for cases not checked.

    The findings have no lines yet. Findings milder than `least` have no hint. If `least` is None, no finding has a
    hint.
    """
    if design.spec.coil.copper is not None and rule.id in ARTWORK_RULES:
        why = not_checked("drawn-by-user")
        return [], [NotChecked(rule.id, why.reason, why.case)]
    if design.spec.cells is not None and rule.id in ONE_CELL_RULES:
        return _worst_cell_outcomes(rule, design.cells, least)
    missing = next((need for need in rule.needs if not NEEDS[need][0](design.spec)), None)
    if missing is not None:
        mount = design.spec.mount
        is_by_file = missing == "jaw" and mount is not None and mount.is_jaw_unmeasured
        # requirements that the spec does not state
        absent = [f"requirements.{key}" for key in _REQUIRED.get(missing, ())
                  if getattr(design.spec.requirements, key) is None]
        why = not_checked("jaw-by-file" if is_by_file else NEEDS[missing][1], keys=absent)
        return [], [NotChecked(rule.id, why.reason, why.case)]
    results: list[Outcome] = []
    undecided: list[NotChecked] = []
    for verdict in rule.apply(design) if rule.apply else ():
        if isinstance(verdict, Undecided):
            undecided.append(NotChecked(rule.id, verdict.reason, verdict.case))
        elif isinstance(verdict, Violation):
            finding = finding_from_violation(rule, verdict, design.spec.readout.device, least)
            results.append(Outcome(finding, verdict.fixes))
    return results, undecided


def _worst_cell_outcomes(rule: Rule, cells: Cells, least: Severity | None) -> tuple[list[Outcome], list[NotChecked]]:
    """Return a rule's findings for the worse of two cells, with the cell's number in the message.

    The two are the cell with the softest pad and the cell with the smallest signal. If both are equally bad, rules of
    `SOFTEST_CELL_RULES` report the cell with the softest pad, and other rules the cell with the smallest signal.
    """
    order = list(cells.extremes.items())[:: -1 if rule.id in SOFTEST_CELL_RULES else 1]
    each = [(number, *rule_outcomes(rule, cell, least)) for number, cell in order]

    number, cell_outcomes, unsaid = max(
        each, key=lambda entry: max((_severity_key(outcome.finding) for outcome in entry[1]), default=()))
    command = "sitscad response --"
    return [Outcome(replace(
        outcome.finding, message=text_of("of-cell", "message", {"cell": number, "message": outcome.finding.message}),
        hint=outcome.finding.hint.replace(command, f"{command}cell {number} --"))) for outcome in cell_outcomes], unsaid


def _severity_key(finding: Finding) -> tuple[float, ...]:
    """Return a sort key that is larger for a worse finding.

    It is the severity, then for rules SIT4xx the ratio of value to limit.
    """
    beyond = finding.measured / finding.limit if finding.measured and finding.limit else 0.0
    return -list(Severity).index(finding.severity), beyond * finding.rule.startswith("SIT4")


def finding_from_violation(
    rule: Rule, complaint: Violation, converter: Converter, least: Severity | None = Severity.NOTE
) -> Finding:
    """Return the finding for a violation of a rule.

    If the source of the rule's limit depends on the converter, the finding has the source for `converter`. A finding
    milder than `least` has no hint. If `least` is None, no finding has a hint.
    """
    severity, hint = complaint.severity or rule.severity, complaint.hint
    message, detail, is_hinted = complaint.message, complaint.detail, least is not None and severity.is_at_least(least)
    if complaint.case:
        message, hint, detail = complaint.text("message"), partial(complaint.text, "hint"), complaint.text("detail")
    if not isinstance(hint, str):
        hint = hint() if is_hinted else ""
    return Finding(
        rule=rule.id, name=rule.name, severity=severity, message=message,
        hint=hint or rule.mend, key=complaint.key, measured=complaint.measured, limit=complaint.limit,
        unit=complaint.unit, place=complaint.place,
        source=complaint.source or converter.text_with_own_sources(rule.source),
        sigma=complaint.sigma, keeps_limit=complaint.keeps_limit, detail=detail, cases=complaint.cases(is_hinted),
    )


def locate_finding(finding: Finding, source: SpecSource) -> Finding:
    """Return the finding with the line and column of its key in the spec's text.

    If the key is missing, the hint names it. If its whole section is missing, the place is the end of the spec.
    """
    finding = replace(finding, key=written_key(finding.key, source.keys))
    section = (finding.key or "").partition(".")[0]
    is_left_out = source.text and section and section not in source.keys
    line, column = (len(source.text.rstrip().splitlines()), 1) if is_left_out else source.locate(finding.key)
    missing = source.addable_key(finding.key)
    if missing is None:
        return replace(finding, line=line, column=column)
    hint = text_of("key-left-out", "hint", {"advice": finding.hint, "key": missing}).strip()
    return replace(finding, hint=hint, line=line, column=column)


@record
class ConstantLimit:
    """A limit of rules (SI unit; relative limits as fractions), with the reason for its value in ``source``."""

    value: float
    source: str


@cache
def constant_limits() -> dict[str, ConstantLimit]:
    """Return all limits of ``data/own_limits.csv`` by their names."""
    return {row["name"]: ConstantLimit(float(row["value"]), row["source"]) for row in rows("own_limits")}
