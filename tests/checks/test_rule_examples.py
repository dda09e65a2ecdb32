"""Wrong and right examples of rules: the wrong spec breaks the rule, and the right spec keeps it."""

from __future__ import annotations

import csv

import pytest
import rule_examples

import sitscad.data
from sitscad.checks.examples import reason_without_example, rule_example
from sitscad.data import rows
from sitscad.spec.reading import RULE_TEXTS

SLOW = {"SIT219", "SIT221", "SIT224", "SIT403", "SIT405", "SIT407", "SIT414"}
"""Rules whose examples take about a second each."""

STATED = {"SIT219": "the crosstalk of cells is stated as a note if it keeps its limit"}
"""Rules with a finding also on a design that keeps them, and why."""

UNDECIDED = {"SIT123": "a tail that does not bend has no bend to check"}
"""Rules that do not check their right example, and why."""

EXAMPLES = [pytest.param(rule, marks=[pytest.mark.slow] if rule in SLOW else []) for rule in rule_examples.CHANGES]


@pytest.mark.parametrize("rule", EXAMPLES)
def test_wrong_example_gives_stored_messages_and_right_example_passes(rule, tmp_path):
    findings, before = rule_examples.findings(rule, rule_examples.wrong_text(rule), tmp_path)
    assert rule in {each.rule for each in findings}
    assert rule_examples.messages(rule, findings) == rule_examples.stored_messages()[rule]
    stored, undecided = rule_examples.findings(rule, rule_examples.right_text(rule), tmp_path)
    assert [each.message for each in stored if not (each.keeps_limit and rule in STATED)] == []
    assert set(undecided) <= set(before) or rule in UNDECIDED


def test_stored_messages_cover_all_rules_with_examples():
    assert list(rule_examples.stored_messages()) == list(rule_examples.CHANGES)


def test_every_broken_spec_file_has_rule_example():
    assert {path.stem for path in rule_examples.BROKEN.glob("*.yaml")} == set(rule_examples.CHANGES)


def test_rule_example_is_yaml_of_changed_keys():
    result = rule_example("SIT205")
    assert result is not None
    assert rule_examples.value(result.wrong) == {"coil": {"outer_diameter": 3, "turns": 3, "trace_width": 0.05}}
    assert rule_examples.value(result.right) == {"coil": {"outer_diameter": 6, "turns": 7, "trace_width": 0.1}}
    assert rule_example("SIT320") is None
    assert reason_without_example("SIT320") and not reason_without_example("SIT205")
    missing = rule_example("SIT003")
    assert missing is not None and missing.wrong == "# no coil.turns" and rule_examples.value(missing.wrong) is None


def test_every_rule_has_an_example_or_a_reason():
    without = {row["rule"] for row in rows("rule_examples") if row["reason"]}
    assert not without & set(rule_examples.CHANGES) and without | set(rule_examples.CHANGES) == set(RULE_TEXTS)


def test_every_row_of_rule_tables_has_all_columns():
    """An unquoted comma moved the reason of SIT330 into its remedy."""
    for name in ("rules", "rule_examples", "messages"):
        with (sitscad.data.FOLDER / f"{name}.csv").open(encoding="utf-8", newline="") as lines:
            table = list(csv.reader(line for line in lines if not line.startswith("#")))
        assert {len(row) for row in table} == {len(table[0])}


def test_rule_summary_is_one_short_sentence_with_must():
    for rule, row in RULE_TEXTS.items():
        assert "must" in row["summary"].split() and len(row["summary"].split()) <= 25, rule
        assert row["summary"].count(". ") == 0 and row["summary"].endswith("."), rule
        cases = [case.split()[:2] for case in row["severities"].split("; ")] if row["severities"] else []
        order = [case[0] for case in cases]
        assert all(case[1] == "if" for case in cases) and order == sorted(order, key=("note", "warning", "error").index)
        assert not order or order[-1] == row["severity"], rule
