"""Examples for each rule (`data/rule_examples.csv`), as YAML: values that break it and values that meet it.

Apart from the rules, because an unchanged build prints findings without loading numpy.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import groupby

from sitscad.basics.record import record
from sitscad.data import Row, rows


@record
class RuleExample:
    """Example for a rule, as YAML: ``wrong`` is a part of a spec that breaks it, ``right`` a part that meets it."""

    wrong: str
    right: str


def rule_example(rule_id: str) -> RuleExample | None:
    """Return the example of a rule. None if no spec alone can break the rule."""
    changed = _example_rows().get(rule_id)
    if changed is None:
        return None
    wrong, right = (_as_yaml([(row["key"], row[side]) for row in changed]) for side in ("wrong", "right"))
    return RuleExample(wrong, right)


def reason_without_example(rule_id: str) -> str:
    """Return the reason why a rule has no example. Empty if it has one, and for rules of plugins."""
    return next((row["reason"] for row in rows("rule_examples") if row["rule"] == rule_id), "")


@cache
def _example_rows() -> dict[str, tuple[Row, ...]]:
    by_rule = groupby((row for row in rows("rule_examples") if not row["reason"]), key=lambda row: row["rule"])
    return {rule: tuple(changed_rows) for rule, changed_rows in by_rule}


def _as_yaml(values: Sequence[tuple[str, str]]) -> str:
    """Return (dotted key, value) pairs as YAML, one line per section of the spec.

    If no pair has a value, the result is a comment that names the keys.
    """
    sections: dict[str, dict[str, str]] = {}
    for key, value in values:
        if value:
            section, _, rest = key.partition(".")
            *parents, last = rest.split(".")
            opened = "".join(f"{parent}: {{" for parent in parents)
            sections.setdefault(section, {})[f"{opened}{last}"] = f"{value}{'}' * len(parents)}"
    if not sections:
        return "\n".join(f"# no {key}" for key, _ in values)
    return "\n".join(_yaml_section(name, inside) for name, inside in sections.items())


def _yaml_section(name: str, inside: dict[str, str]) -> str:
    """Return a section of the spec as one line of YAML. `inside` maps the keys in the section to their values as text.

    If `inside` has an empty key, its value is the whole section. If `name` is empty as well, this value is the complete
    line.
    """
    if "" in inside:
        return f"{name}: {inside['']}" if name else inside[""]
    return f"{name}: {{{', '.join(f'{key}: {value}' for key, value in inside.items())}}}"
