"""The rules as a list for people, as JSON for programs, and as a page for a site."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from sitscad.report.findings import RuleTexts, to_json
from sitscad.version import __version__


class ListedRule(RuleTexts, Protocol):
    """A rule with the severities of its findings, in words."""

    @property
    def severities(self) -> str: ...  # noqa: D102


GROUPS = {
    "0": "The spec itself", "1": "Fabrication", "2": "Electrical and readout", "3": "Fit and mechanics",
    "4": "What the sensor feels",
}
"""Headings by the first figure of a rule's number."""


def as_list(rules: Sequence[ListedRule]) -> str:
    """One line a rule: identifier, name, severities, what it asks for."""
    width = max(len(rule.name) for rule in rules)
    rows = (f"{rule.id}  {rule.name:<{width}}  {severities(rule):<20}  {rule.summary}" for rule in rules)
    return "\n".join(rows) + "\n"


def as_json(rules: Sequence[ListedRule]) -> str:
    """Every text of every rule."""
    entries = [
        {
            "rule": rule.id, "name": rule.name, "severities": severities(rule).split(", "), "when": rule.severities,
            "summary": rule.summary, "why": rule.why, "mend": rule.mend, "source": rule.source,
        }
        for rule in rules
    ]
    return to_json({"sitscad": __version__, "rules": entries})


def as_markdown(rules: Sequence[ListedRule]) -> str:
    """A page with a section a rule, by group; headings are `SIT103 coil-trace`, so that links to them last."""
    lines = ["# Rules", ""]
    for figure, heading in GROUPS.items():
        lines += [f"## {heading}", ""]
        for rule in (each for each in rules if each.id[3:4] == figure):
            lines += [f"### {rule.id} {rule.name}", "", f"*{rule.severities}*", "", rule.summary, ""]
            lines += [f"**Why:** {rule.why}", "", f"**To mend it:** {rule.mend}", "", f"**Source:** {rule.source}", ""]
    return "\n".join(lines)


def severities(rule: ListedRule) -> str:
    """The severities alone, mildest first: ``warning, error``."""
    words = rule.severities.replace(",", " ").split()
    return ", ".join(word for word in ("note", "warning", "error") if word in words)


RULE_FORMATS: Mapping[str, Callable[[Sequence[ListedRule]], str]] = {
    "text": as_list, "json": as_json, "markdown": as_markdown,
}
"""How ``rules`` can print them."""
