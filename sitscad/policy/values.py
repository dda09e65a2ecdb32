"""The policy as a value, and the patterns that stand for rules in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Any

from sitscad.finding import Severity
from sitscad.record import record
from sitscad.report.findings import RuleTexts


class PolicyError(ValueError):
    """A configuration or baseline that cannot be used; the text says where and why."""


@record
class Policy:
    """What is held against a spec.

    ``select`` and ``ignore`` are patterns of rules (`stands_for`; no ``select`` is all), ``reasons`` are patterns that
    are ignored, each with its reason, ``severity`` what the findings of a pattern weigh instead. ``profiles`` is the
    folder of fabricators' profiles. ``named`` is what reports call the file that says so, empty where nothing does.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    reasons: Mapping[str, str] = field(default_factory=dict)
    severity: Mapping[str, Severity] = field(default_factory=dict)
    profiles: str | None = None
    named: str = ""

    @property
    def says_anything(self) -> bool:
        """Whether it changes the judgement of any spec."""
        return bool(self.select or self.ignore or self.reasons or self.severity)

    def as_json(self) -> dict[str, object]:
        """The rules' part as plain values, patterns in their order (the last one counts), and what reports call it."""
        return {
            "select": list(self.select),
            "ignore": [*self.ignore],
            "reasons": dict(self.reasons),
            "severity": {pattern: severity.value for pattern, severity in self.severity.items()},
            "named": self.named if self.says_anything else "",
        }


def kept_policy(said: Mapping[str, Any]) -> Policy:
    """The policy that a manifest keeps (`Policy.as_json`); ValueError, TypeError or KeyError for what is none."""
    reasons, severity = dict(said["reasons"]), dict(said["severity"])
    for text in (*said["select"], *said["ignore"], *reasons, *reasons.values(), *severity, said["named"]):
        if not isinstance(text, str):
            raise TypeError(f"{text!r} is no text")
    weights = {pattern: Severity(word) for pattern, word in severity.items()}
    return Policy(tuple(said["select"]), tuple(said["ignore"]), reasons, weights, None, said["named"])


def stands_for(pattern: str, rule: str, name: str) -> bool:
    """Whether a pattern means a rule: its identifier or the beginning of it, its number, or its name."""
    wanted = f"SIT{pattern}" if pattern.isdecimal() else pattern.upper()
    return rule.startswith(wanted) or name == pattern.lower().replace("_", "-")


def chosen_rules(rules: Iterable[RuleTexts], select: tuple[str, ...], ignore: tuple[str, ...]) -> frozenset[str]:
    """The identifiers that are selected and not ignored; rules of the spec itself always are."""

    def is_wanted(rule: RuleTexts) -> bool:
        is_selected = not select or any(stands_for(pattern, rule.id, rule.name) for pattern in select)
        is_ignored = any(stands_for(pattern, rule.id, rule.name) for pattern in ignore)
        return rule.id.startswith("SIT0") or (is_selected and not is_ignored)

    return frozenset(rule.id for rule in rules if is_wanted(rule))
