"""What a rule is, what it may look at, and what it says: the vocabulary of the checks, and the limits that sitscad sets
itself (`data/own_limits.csv`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache, partial
from string import Formatter

from sitscad.basics.check_results import RequirementResult
from sitscad.basics.finding import Finding, NotChecked, Place, Severity
from sitscad.basics.record import record, replace
from sitscad.checks.fixes.search import Family
from sitscad.data import rows
from sitscad.estimates.design import Design
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.converters.figures import source_in_all
from sitscad.spec.coil import written_key
from sitscad.spec.mount import Mount, StepPart
from sitscad.spec.reading import RULE_TEXTS
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import SpecSource

ROUNDING = 1e-9
"""Lengths that differ by less than this (m) are equal: a nanometre is rounding, not a breach."""


@record
class Violation:
    """What a rule found, before it knows its name: a severity or source of its own overrides the rule's. ``fixes`` are
    families of changes that may mend it, the best first: the search in `fixes` tries them. ``hint`` says what else
    helps, or is a function that finds out. ``keeps_limit`` is set where ``measured`` lies on the right side of the
    limit, by little.
    """

    message: str
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


@record
class Undecided:
    """Something a rule could not decide although its needs were met, and why."""

    reason: str


def joined(*words: str) -> str:
    """What is not empty of some words, apart by semicolons."""
    return "; ".join(filter(None, words))


Verdict = Violation | Undecided | RequirementResult
"""What a rule yields: what it finds, what it cannot decide, and figures beside their requirements, met or not."""


@record
class Rule:
    """One rule: its texts for `explain`, the parts that it needs, and the function that applies it. ``severity`` is the
    worst that it says, ``cases`` says when it is which, mildest first, where single complaints are milder; ``needs``
    are keys of `NEEDS`.
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
        """Every severity that a finding of the rule can have, mildest first, and when."""
        return self.cases or self.severity.value


def rule_of(
    number: str, apply: Callable[[Design], Iterable[Verdict]] | None = None, *needs: str, **values: object
) -> Rule:
    """A rule of sitscad by its number, with its texts out of ``data/rules.csv``: `values` stand in them by name, and
    the sources of converters' figures by the names of these.
    """
    row = RULE_TEXTS[number]
    texts = {field: row[field] for field in ("summary", "why", "mend", "source", "severities")}
    for field, text in texts.items() if "{" in "".join(texts.values()) else ():
        named = {name for _, name, _, _ in Formatter().parse(text) if name}
        texts[field] = text.format_map(values | {name: source_in_all(name) for name in named - values.keys()})
    cases = texts.pop("severities")
    return Rule(number, row["name"], Severity(row["severity"]), **texts, needs=needs, apply=apply, cases=cases)


_ASKED = {"normal force": ("normal_force",), "shear force": ("shear_force",), "bandwidth": ("bandwidth",)}
"""Needs of single requirements."""

_FEELING = {"normal resolution": ("normal_resolution",), "shear resolution": ("shear_resolution",),
            "moment resolution": ("moment_resolution",), "normal error": ("normal_error",),
            "shear error": ("shear_error",), "moment error": ("moment_error",),
            "crosstalk": ("crosstalk",), "tilt error": ("tilt", "tilt_error"), "friction error": ("friction_error",),
            "temperature error": ("temperature_range", "temperature_error")}
"""Needs of SIT4xx, and the requirements that each takes."""


_REQUIRED = _ASKED | _FEELING

NO_REQUIREMENT = "no requirements."
"""How a reason begins that names requirements which are not in the spec."""


def _unstated(keys: Sequence[str]) -> str:
    return f"{NO_REQUIREMENT}{' and requirements.'.join(keys)} in the spec"


def _states(spec: SensorSpec, keys: tuple[str, ...]) -> bool:
    return all(getattr(spec.requirements, key) is not None for key in keys)


def _step_files(mount: Mount | None) -> tuple[StepPart | None, StepPart | None]:
    return (None, None) if mount is None else (mount.step, None if mount.jaw is None else mount.jaw.step)


NEEDS: dict[str, tuple[Callable[[SensorSpec], bool], str]] = {
    "target": (lambda s: s.target is not None, "no target in the spec"),
    "elastomer": (lambda s: s.elastomer is not None, "no elastomer in the spec"),
    "plate": (lambda s: s.target is not None or s.elastomer is not None, "no target and no elastomer in the spec"),
    "mount": (lambda s: s.mount is not None, "no mount in the spec"),
    "jaw": (lambda s: s.jaw is not None, "no jaw: the mount is not for a grasper"),
    "STEP file": (lambda s: any(_step_files(s.mount)), "no STEP file in the spec"),
    "jaw file": (lambda s: s.mount is not None and s.mount.kind != "custom" and any(_step_files(s.mount)),
                 "no STEP file of a jaw in the spec"),
    "shield": (lambda s: s.shield is not None, "no shield in the spec"),
    "tail": (lambda s: s.fpc.tail is not None, "no tail in the spec"),
    **{need: (partial(_states, keys=keys), _unstated(keys)) for need, keys in _REQUIRED.items()},
    "force": (lambda s: bool(s.requirements.normal_force or s.requirements.shear_force),
              _unstated(("normal_force", "shear_force"))),
    "errors": (lambda s: any(getattr(s.requirements, f"{kind}_{what}") is not None
                             for kind in ("normal", "shear", "moment") for what in ("error", "resolution")),
               "no requirements.normal_error or normal_resolution in the spec, nor those of shear and moments"),
    "feeling": (lambda s: any(_states(s, keys) for keys in _FEELING.values()),
                "the spec does not ask how finely the sensor feels (requirements.normal_resolution and others)"),
}
"""What a rule may need of the spec: how to tell, and the reason given when it is missing."""


@record
class Outcome:
    """One finding, without its place in the text, and the changes that are to be tried for it."""

    finding: Finding
    fixes: tuple[Family, ...] = ()


OF_ONE_CELL = {"SIT218", "SIT221", "SIT304", "SIT306", "SIT310", "SIT312", "SIT313", "SIT327",
               *(f"SIT40{k}" for k in range(1, 10)), "SIT411", "SIT412", "SIT413", "SIT414"}
"""Rules about a target, its pad and what is felt, which judge a cell: that of which they find most. Nothing
is tried for their hints, for what is tried is a whole sensor.
"""


OF_THE_SOFTEST = {"SIT304", "SIT310", "SIT312"}
"""Those of them that ask how far a pad gives way: of them it is first the cell with the least webs."""


def apply_rule(
    rule: Rule, design: Design, least: Severity | None = Severity.NOTE
) -> tuple[list[Finding], list[NotChecked]]:
    """The findings of one rule, located in the spec's text, and what it could not check; nothing is tried for hints,
    and none is looked for where a finding is milder than the `least`, of all where that is None.
    """
    found, undecided = outcomes(rule, design, least)
    return [located(outcome.finding, design.spec.source) for outcome in found], undecided


def outcomes(
    rule: Rule, design: Design, least: Severity | None = Severity.NOTE
) -> tuple[list[Outcome], list[NotChecked]]:
    """What one rule finds, and what it could not check; hints are looked for as in `apply_rule`."""
    if design.spec.cells is not None and rule.id in OF_ONE_CELL:
        return _of_worst_cell(rule, design, least)
    missing = next((need for need in rule.needs if not NEEDS[need][0](design.spec)), None)
    if missing is not None:
        mount = design.spec.mount
        is_by_file = missing == "jaw" and mount is not None and mount.is_jaw_unmeasured
        # of several requirements those that are not stated
        absent = [key for key in _REQUIRED.get(missing, ()) if getattr(design.spec.requirements, key) is None]
        why = _unstated(absent) if absent else NEEDS[missing][1]
        return [], [NotChecked(rule.id, JAW_BY_FILE_ALONE if is_by_file else why)]
    found: list[Outcome] = []
    undecided: list[NotChecked] = []
    for verdict in rule.apply(design) if rule.apply else ():
        if isinstance(verdict, Undecided):
            undecided.append(NotChecked(rule.id, verdict.reason))
        elif isinstance(verdict, Violation):
            found.append(Outcome(finding_of(rule, verdict, design.spec.readout.device, least), verdict.fixes))
    return found, undecided


def _of_worst_cell(rule: Rule, design: Design, least: Severity | None) -> tuple[list[Outcome], list[NotChecked]]:
    """What a rule finds of the cell that it finds most of, which is named: of two extremes, those with the softest pad
    and with the least signal, the rule's own first where they are as bad.
    """
    order = list(design.cells.extremes.items())[:: -1 if rule.id in OF_THE_SOFTEST else 1]
    each = [(number, *outcomes(rule, cell, least)) for number, cell in order]

    number, said, unsaid = max(each, key=lambda one: max((_weight(found.finding) for found in one[1]), default=()))
    command = "sitscad response --"
    return [Outcome(replace(
        found.finding, message=f"cell {number}: {found.finding.message}",
        hint=found.finding.hint.replace(command, f"{command}cell {number} --"))) for found in said], unsaid


def _weight(finding: Finding) -> tuple[float, ...]:
    """How bad a finding is: by its severity, then of what is felt (SIT4xx, of which less is better) by its figure."""
    beyond = finding.measured / finding.limit if finding.measured and finding.limit else 0.0
    return -list(Severity).index(finding.severity), beyond * finding.rule.startswith("SIT4")


JAW_BY_FILE_ALONE = (
    "the jaw is a STEP file, whose dimensions are not in the spec: write mount.jaw.width, length and height; the build "
    "measures the file's solid"
)


def finding_of(
    rule: Rule, complaint: Violation, converter: Converter, least: Severity | None = Severity.NOTE
) -> Finding:
    """The finding that a complaint becomes under its rule's name; of the rule's source what is of the converter."""
    severity, hint = complaint.severity or rule.severity, complaint.hint
    if not isinstance(hint, str):
        hint = hint() if least is not None and severity.weighs(least) else ""
    return Finding(
        rule=rule.id, name=rule.name, severity=severity, message=complaint.message,
        hint=hint or rule.mend, key=complaint.key, measured=complaint.measured, limit=complaint.limit,
        unit=complaint.unit, source=complaint.source or converter.cited_alone(rule.source), place=complaint.place,
        sigma=complaint.sigma, keeps_limit=complaint.keeps_limit, detail=complaint.detail,
    )


def located(finding: Finding, source: SpecSource) -> Finding:
    """The finding with line and column of its key in the spec's text; a key that is not there is named in the hint. One
    in a section that the spec leaves out points at the spec's end, where the section can be added.
    """
    finding = replace(finding, key=written_key(finding.key, source.keys))
    section = (finding.key or "").partition(".")[0]
    is_left_out = source.text and section and section not in source.keys
    line, column = (len(source.text.rstrip().splitlines()), 1) if is_left_out else source.locate(finding.key)
    missing = source.absent(finding.key)
    if missing is None:
        return replace(finding, line=line, column=column)
    added = f"(the spec leaves {missing} out: add {missing} to change it)"
    return replace(finding, hint=f"{finding.hint} {added}".strip(), line=line, column=column)


@record
class OwnLimit:
    """One limit: its value in SI units (relative ones as shares), and the reason for it."""

    value: float
    source: str


@cache
def own_limits() -> dict[str, OwnLimit]:
    """Every limit by its name."""
    return {row["name"]: OwnLimit(float(row["value"]), row["source"]) for row in rows("own_limits")}
