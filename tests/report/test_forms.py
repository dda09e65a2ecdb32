"""Every form that findings are told in, held against a kept text; REWRITE=1 in the environment writes them anew."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
import told
from told import TURNS

from sitscad.basics.finding import Finding, Severity
from sitscad.checks.findings import FINDING_FORMATS, CheckedSpec, OutputOptions
from sitscad.checks.findings.ci import job_summary
from sitscad.data import json_file

KEPT = Path(__file__).parent / "snapshots"
NAMES = {"text": "text.txt", "json": "check.json", "sarif": "check.sarif", "junit": "junit.xml", "github": "github.txt"}
SHOWN = ("SIT001", "SIT103", "SIT201", "SIT301")
FEW = OutputOptions(rules=tuple(rule for rule in told.OUTPUT.rules if rule.id in SHOWN))
"""A few rules, so that a rule's new words do not change the kept texts; what the findings name must be told all the
same where a rule's texts are not known.
"""


def held_against(name: str, text: str) -> None:
    path = KEPT / name
    if os.environ.get("REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8"), f"{name} is told otherwise; REWRITE=1 keeps the new text"


def test_every_output_format_has_snapshot():
    assert set(NAMES) == set(FINDING_FORMATS)
    assert {path.name for path in KEPT.iterdir()} == {*NAMES.values(), "summary.md", "whole.txt"}


@pytest.mark.parametrize("form", NAMES)
def test_output_format_equals_snapshot(form):
    held_against(NAMES[form], FINDING_FORMATS[form](told.BOTH, FEW))


def test_verbose_text_equals_snapshot():
    held_against("whole.txt", FINDING_FORMATS["text"](told.BOTH, replace(FEW, verbose=True)))


def test_job_summary_equals_snapshot():
    held_against("summary.md", job_summary(told.BOTH, {told.FIRST.path: "\u28ff picture"}))


@pytest.mark.parametrize("form", NAMES)
def test_output_format_is_printable_and_reproducible(form):
    item, two = (FINDING_FORMATS[form](told.BOTH, told.OUTPUT) for _ in range(2))
    assert item == two and "\x1b" not in item and item.endswith("\n")


@pytest.mark.parametrize("form", NAMES)
def test_output_format_accepts_no_specs(form):
    assert FINDING_FORMATS[form]((), told.OUTPUT)


def test_json_document_matches_published_schema():
    import jsonschema

    schema = json_file("check.schema")
    jsonschema.Draft202012Validator.check_schema(schema)
    document = json.loads(FINDING_FORMATS["json"](told.BOTH, told.OUTPUT))
    jsonschema.validate(document, schema)
    told_keys = {key for spec in document["specs"] for finding in spec["findings"] for key in finding}
    assert told_keys <= set(schema["$defs"]["finding"]["properties"]), "a key that the schema does not name"
    assert set(document["specs"][0]) == set(schema["properties"]["specs"]["items"]["properties"])
    del document["specs"][0]["findings"][0]["rule"]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, schema)


@pytest.mark.parametrize("form", NAMES)
def test_very_long_line_is_quoted_in_part(form):
    """300 kB of zeros as a spec printed 1 MB, and 1.7 MB as SARIF."""
    text = "turns: " + "0" * 300_000
    finding = Finding("SIT004", "type", Severity.ERROR, "no", "", "turns", 1, 8)
    message = FINDING_FORMATS[form]((CheckedSpec("a.yaml", text, (finding,)),), replace(FEW, verbose=True))
    assert len(message) < 10_000


@pytest.mark.parametrize("form", NAMES)
def test_non_utf8_file_name_is_reported(form):
    name = os.fsdecode(b"n\xff.yaml")
    message = FINDING_FORMATS[form]((CheckedSpec(name, "a: 1\n", (replace(TURNS, line=1, column=1),)),), FEW)
    assert "SIT201" in message
    if form == "sarif":
        (result,) = json.loads(message)["runs"][0]["results"]
        assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "n%FF.yaml"
