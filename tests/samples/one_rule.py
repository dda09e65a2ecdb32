"""Findings of a single rule: a check applies some hundred others, and estimates what these read."""

from __future__ import annotations

from sitscad.basics.finding import Finding
from sitscad.checks.judging import RULES
from sitscad.checks.rules import apply_rule
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.design import Design
from sitscad.layout.board import Layout
from sitscad.spec.sensor import SensorSpec


def findings_of(
    rule_id: str, spec: SensorSpec, layout: Layout | None = None, estimates: Estimates | None = None
) -> list[Finding]:
    """Return the findings of a rule, without fixes and lines."""
    return apply_rule(next(rule for rule in RULES if rule.id == rule_id), Design(spec, layout, estimates))[0]
