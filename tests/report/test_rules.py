"""The list of rules in every form."""

from __future__ import annotations

import json
import re

import pytest

import sitscad
import sitscad.cli
from sitscad.basics.record import replace
from sitscad.checks.findings.text import RULE_FORMATS, severities, severity_cases


@pytest.mark.parametrize("form", RULE_FORMATS)
def test_every_rule_list_format_contains_all_rules_in_order(form):
    text = RULE_FORMATS[form](sitscad.RULES)
    begins = {"text": r"^(SIT\d+)", "json": r'"rule": "(SIT\d+)"', "markdown": r"^### (SIT\d+)"}[form]
    assert re.findall(begins, text, re.MULTILINE) == [rule.id for rule in sitscad.RULES]
    assert text.endswith("\n")


def test_json_and_markdown_contain_all_rule_texts():
    document, page = json.loads(RULE_FORMATS["json"](sitscad.RULES)), RULE_FORMATS["markdown"](sitscad.RULES)
    for rule, entry in zip(sitscad.RULES, document["rules"], strict=True):
        for text in (rule.summary, rule.why, rule.mend, rule.source):
            assert text in entry.values()
        assert all(text in page for text in (rule.summary, rule.why, rule.mend, *rule.source.split("; ")))
        assert set(entry["severities"]) <= {"note", "warning", "error"} and rule.severity.value in entry["severities"]


def test_plugin_severity_text_without_semicolons_is_one_case():
    (rule,) = (replace(rule, cases="warning, error beyond 50 %") for rule in sitscad.RULES if rule.id == "SIT101")
    assert (severities(rule), severity_cases(rule)) == ("warning, error", ["warning, error beyond 50 %"])
    (rule,) = (rule for rule in sitscad.RULES if rule.id == "SIT103")
    assert severities(rule) == "warning, error"
    assert [case.split(" if ")[0] for case in severity_cases(rule)] == ["warning", "error"]
    assert severity_cases(replace(rule, cases="")) == []


def test_rules_command_prints_every_format(capsys):
    for form in RULE_FORMATS:
        with pytest.raises(SystemExit) as left:
            sitscad.cli.main(["rules", "--format", form])
        assert left.value.code == 0
        assert capsys.readouterr().out == RULE_FORMATS[form](sitscad.RULES)
