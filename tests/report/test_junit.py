"""JUnit's XML, read by two programs that were written for it."""

from __future__ import annotations

from dataclasses import replace

import junitparser
import pytest
import told
from junit2htmlreport.parser import Junit

import sitscad
from sitscad.basics.finding import Finding, Severity
from sitscad.checks.findings import CheckedSpec
from sitscad.checks.findings.ci import junit as render


@pytest.fixture
def written(tmp_path):
    path = tmp_path / "junit.xml"
    path.write_text(render(told.BOTH, told.OUTPUT), encoding="utf-8")
    return path


def outcomes(path) -> dict[str, dict[str, str]]:
    """For every suite the outcome of every case, by junitparser."""
    words = {junitparser.Failure: "failed", junitparser.Error: "error", junitparser.Skipped: "skipped"}
    return {
        suite.name: {
            case.name.split()[0]: next((words[type(result)] for result in case.result), "passed") for case in suite
        }
        for suite in junitparser.JUnitXml.fromfile(str(path))
    }


def test_junit_has_one_case_per_rule_and_spec(written):
    result = outcomes(written)
    assert list(result) == ["sensors/first, 100%: new.yaml", "second.yaml"]
    for cases in result.values():
        assert set(cases) == {rule.id for rule in sitscad.RULES}


def test_junit_outcomes_equal_findings(written):
    first, second = outcomes(written).values()
    told_of = {rule: outcome for rule, outcome in first.items() if outcome != "passed"}
    assert told_of == {"SIT103": "skipped", "SIT201": "failed", "SIT301": "skipped", "SIT302": "skipped"}
    assert {rule for rule, outcome in second.items() if outcome == "error"} == {"SIT001"}


def test_two_junit_readers_count_equal_outcomes(written):
    report = Junit(filename=str(written))
    result = outcomes(written)
    assert [suite.name for suite in report.suites] == list(result)
    for suite in report.suites:
        words = list(result[suite.name].values())
        assert len(suite.all()) == len(words)
        assert len(suite.failed()) == words.count("failed") + words.count("error")
        assert len(suite.skipped()) == words.count("skipped")
        assert len(suite.passed()) == words.count("passed")


def test_junit_totals_equal_counted_cases(written):
    document = junitparser.JUnitXml.fromfile(str(written))
    stated = (document.tests, document.failures, document.errors, document.skipped)
    document.update_statistics()
    assert stated == (document.tests, document.failures, document.errors, document.skipped)
    for suite in document:
        stated = (suite.tests, suite.failures, suite.errors, suite.skipped)
        suite.update_statistics()
        assert stated == (suite.tests, suite.failures, suite.errors, suite.skipped)


@pytest.mark.parametrize(
    ("fail_on", "failed"),
    [
        (Severity.ERROR, {"SIT201"}),
        (Severity.WARNING, {"SIT201", "SIT206"}),
        (Severity.NOTE, {"SIT201", "SIT206", "SIT308", "SIT108"}),
    ],
)
def test_finding_at_fail_level_fails_junit_case(tmp_path, fail_on, failed):
    path = tmp_path / "junit.xml"
    path.write_text(render((told.FIRST,), replace(told.OUTPUT, fail_on=fail_on)), encoding="utf-8")
    (cases,) = outcomes(path).values()
    assert {rule for rule, outcome in cases.items() if outcome == "failed"} == failed


def test_finding_below_fail_level_is_in_system_out(written):
    (first, _) = junitparser.JUnitXml.fromfile(str(written))
    (case,) = [case for case in first if case.name.startswith("SIT206")]
    assert "first, 100%: new.yaml:3:43 warning: near; one sigma is 3 %\nhint: fewer layers" in case.system_out


def test_invalid_xml_characters_give_readable_xml(tmp_path):
    hostile = Finding("SIT001", "x", Severity.ERROR, "]]><&\x00\x0b\ud800\ufffe\x1b", "\x7f\u2028", None, 1, 1)
    path = tmp_path / "junit.xml"
    path.write_text(render((CheckedSpec("<&\x01.yaml", "", (hostile,)),), told.OUTPUT), encoding="utf-8")
    (cases,) = outcomes(path).values()
    assert cases["SIT001"] == "error"
