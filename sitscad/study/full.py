"""The full level: a design judged as `check` judges it, without hints, and the figures that are asked for read off."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from sitscad.checks import judged as checked
from sitscad.checks.rules import NEEDS
from sitscad.design import Design
from sitscad.finding import Finding, NotChecked, Severity
from sitscad.inspection import as_configured
from sitscad.spec.format.reading import SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.study.evaluation import FULL, Breach, Evaluation
from sitscad.study.measures import MEASURES, AbsentError

NO_NEED = frozenset(reason for _, reason in NEEDS.values())
"""Reasons for which a rule is not applied because the spec has not what it is about."""

BY_BUILD = "by sitscad build"
"""In the reason of what only a build measures."""


def judged(spec: SensorSpec, measures: Sequence[str], level: str = FULL) -> Evaluation:
    """What every rule says of a design, and these of its figures; configuration and comments count as in `check`."""
    design = Design(spec)
    found = as_configured(spec, checked(design, "none"))
    values, absent = figures(design, measures)
    return Evaluation(values, absent, breaches(found.findings, Severity.ERROR),
                      breaches(found.findings, Severity.WARNING), _undecided(found.not_checked), level)


def unreadable(error: SpecError, measures: Sequence[str], level: str = FULL) -> Evaluation:
    """A design whose spec is refused: it has no figures."""
    absent = dict.fromkeys(measures, "the spec is refused")
    return Evaluation({}, absent, breaches(error.findings, Severity.ERROR), level=level)


def figures(design: Design, measures: Sequence[str]) -> tuple[dict[str, tuple[float, float]], dict[str, str]]:
    """Figures of a design by their names, and why it has others not."""
    values, absent = {}, {}
    for name in measures:
        try:
            value, error = MEASURES[name].read(design)
            values[name] = (float(value), float(error))
        except AbsentError as why:
            absent[name] = str(why)
    return values, absent


def breaches(findings: Iterable[Finding], severity: Severity) -> Mapping[str, Breach]:
    """The rules that find something of a severity, each with its largest breach, in the order of the rules."""
    found: dict[str, Breach] = {}
    for finding in sorted(findings, key=lambda one: one.rule):
        if finding.severity is severity:
            one = Breach(finding.measured, finding.limit, finding.unit or "")
            found[finding.rule] = max(found.get(finding.rule, one), one, key=lambda each: each.size)
    return found


def _undecided(not_checked: Iterable[NotChecked]) -> tuple[str, ...]:
    left = (one.rule for one in not_checked if one.reason not in NO_NEED and BY_BUILD not in one.reason)
    return tuple(sorted(set(left)))
