"""SARIF: valid by the official schema, at the right place, and the same finding in the next run."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
import told

import sitscad
from sitscad.checks.findings import CheckedSpec, OutputOptions
from sitscad.checks.findings.ci import sarif as render
from sitscad.checks.findings.ci import value_length
from sitscad.package.inspection import inspect

HERE = Path(__file__).parent
SCHEMA = json.loads((HERE / "sarif-schema-2.1.0.json").read_text(encoding="utf-8"))
VALID = jsonschema.validators.validator_for(SCHEMA)(SCHEMA)
TEMPLATES = sorted((HERE.parents[1] / "templates").glob("*.yaml"))


def document_of(checked: tuple[CheckedSpec, ...], output: OutputOptions = told.OUTPUT) -> dict:
    document = json.loads(render(checked, output))
    VALID.validate(document)
    return document


def results_of(checked: CheckedSpec) -> list[dict]:
    return document_of((checked,))["runs"][0]["results"]


def test_sarif_is_valid_by_official_schema():
    assert SCHEMA["title"].startswith("Static Analysis Results Format (SARIF) Version 2.1.0")
    (run,) = document_of(told.BOTH)["runs"]
    assert [rule["id"] for rule in run["tool"]["driver"]["rules"]] == [rule.id for rule in sitscad.RULES]
    for result in run["results"]:
        assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == result["ruleId"]
        assert len(result["locations"]) == 1, "code hosts drop results without a place"
    assert document_of(())["runs"][0]["results"] == []


def test_sarif_validator_refuses_invalid_level():
    document = json.loads(render(told.BOTH, told.OUTPUT))
    document["runs"][0]["results"][0]["level"] = "fatal"
    assert not VALID.is_valid(document)


def test_sarif_rules_contain_explanation_texts():
    rules = document_of(())["runs"][0]["tool"]["driver"]["rules"]
    for rule, told_rule in zip(sitscad.RULES, rules, strict=True):
        for text in (rule.summary, rule.why, rule.mend, rule.source):
            assert text in told_rule["help"]["text"] and text in told_rule["help"]["markdown"]
        assert told_rule["defaultConfiguration"]["level"] == rule.severity.value


def test_rule_not_checked_gives_sarif_notification():
    (run,) = document_of(told.BOTH)["runs"]
    notes = run["invocations"][0]["toolExecutionNotifications"]
    assert [note["associatedRule"]["id"] for note in notes] == ["SIT301", "SIT302", "SIT002"]
    assert "no mount in the spec" in notes[0]["message"]["text"]


def test_ignored_finding_gives_suppressed_result_with_reason():
    (suppressed,) = [result for result in results_of(told.FIRST) if "suppressions" in result]
    assert suppressed["ruleId"] == "SIT103"
    assert suppressed["suppressions"][0]["kind"] == "inSource"
    assert suppressed["suppressions"][0]["justification"] == "their quotation of 3 May"


@pytest.mark.parametrize(
    ("line", "column", "text"),
    [
        ("turns: 6.5", 8, "6.5"),
        ("turns: 6.5   # many", 8, "6.5"),
        ("a: 4 mil # x", 4, "4 mil"),
        ("c: {turns: 6.5, b: 2}", 12, "6.5"),
        ("c: [1, [2, 3], 4] # x", 4, "[1, [2, 3], 4]"),
        ("c: [1,", 4, "[1,"),
        ('a: "x # y, z" # c', 4, '"x # y, z"'),
        ("a: 'it''s' ", 4, "'it''s'"),
        ("a: c#1", 4, "c"),
        ("coil:", 1, "coil:"),
        ("a: ", 4, ""),
    ],
)
def test_sarif_region_ends_at_end_of_value(line, column, text):
    assert value_length(line, column) == max(1, len(text))
    assert line[column - 1 : column - 1 + value_length(line, column)] == text


def test_sarif_paths_are_relative_to_root(tmp_path):
    spec = replace(told.FIRST, path=str(tmp_path / "sensors" / "a b.yaml"))
    (run,) = document_of((spec,), replace(told.OUTPUT, root=str(tmp_path)))["runs"]
    place = run["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert place == {"uri": "sensors/a%20b.yaml", "uriBaseId": "%SRCROOT%"}
    (run,) = document_of((spec,), replace(told.OUTPUT, root=str(tmp_path / "other")))["runs"]
    place = run["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert place["uri"].startswith("file:///") and "uriBaseId" not in place


def marks_of(text: str, path: Path) -> dict[str, int]:
    """Fingerprints of a spec's findings, and the lines that they are at."""
    path.write_text(text, encoding="utf-8")
    results = results_of(inspect(str(path), "none").checked)
    lines = [result["locations"][0]["physicalLocation"]["region"]["startLine"] for result in results]
    marks = [result["partialFingerprints"]["sitscadFinding/v1"] for result in results]
    assert len(set(marks)) == len(marks), "two findings of one spec are never the same"
    return dict(zip(marks, lines, strict=True))


@pytest.mark.slow
def test_fingerprints_are_unchanged_by_moved_lines(tmp_path):
    text = next(path for path in TEMPLATES if path.stem == "grasper_3p5mm").read_text(encoding="utf-8")
    path = tmp_path / "sensor.yaml"
    before = marks_of(text, path)
    after = marks_of("# one line\n# and another\n" + text, path)
    assert {mark: line + 2 for mark, line in before.items()} == after
    assert any(result.message for result in inspect(str(path), "none").checked.findings)


def test_fingerprints_differ_between_specs(tmp_path):
    text = TEMPLATES[0].read_text(encoding="utf-8")
    assert not set(marks_of(text, tmp_path / "a.yaml")) & set(marks_of(text, tmp_path / "b.yaml"))


def applied(text: str, fix: dict) -> str:
    """The text that a reader of SARIF makes of a fix: regions from the last to the first, as lines and columns."""
    (change,) = fix["artifactChanges"]
    lines = text.splitlines(keepends=True)
    starts = [sum(map(len, lines[:number])) for number in range(len(lines) + 1)]
    for each in reversed(change["replacements"]):
        region = each["deletedRegion"]
        start = starts[region["startLine"] - 1] + region["startColumn"] - 1
        end = starts[region["endLine"] - 1] + region["endColumn"] - 1
        text = text[:start] + each["insertedContent"]["text"] + text[end:]
    return text


@pytest.mark.parametrize("text", [told.TEXT, told.TEXT.replace("\n", "\r\n"), told.TEXT.rstrip()])
def test_sarif_fixes_equal_edits_of_rewriter(text):
    from sitscad.basics.finding import Edit, Remedy
    from sitscad.spec.yaml.rewriting import rewritten

    sure = Remedy((Edit("coil.turns", "7.5"), Edit("fpc.tail.bend", "none")))
    added = Remedy((Edit("fpc.margin", "0.2"),))
    nowhere = Remedy((Edit("coil.turns.first", "1"),))
    finding = replace(told.TURNS, fixes=(sure, added, nowhere))
    (result,) = results_of(CheckedSpec("x.yaml", text, (finding,)))
    first, second = result["fixes"]
    assert applied(text, first) == rewritten(text, sure.edits) != text
    assert applied(text, second) == rewritten(text, added.edits) != text
    assert "changes what the sensor is" in first["description"]["text"]
