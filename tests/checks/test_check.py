"""`check` as a whole: the table of rules, the order of findings, and what was not checked."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys

import pytest

from sitscad.basics.finding import Severity
from sitscad.checks.judging import RULES, check, explain
from sitscad.checks.rules import NEEDS


def test_every_rule_is_complete_and_has_unique_id_and_name():
    assert len({rule.id for rule in RULES}) == len({rule.name for rule in RULES}) == len(RULES)
    for rule in RULES:
        assert re.fullmatch(r"SIT[0-4]\d\d", rule.id) and re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", rule.name), rule.id
        assert all(len(text) > 8 for text in (rule.summary, rule.why, rule.mend)), rule.id
        assert rule.source and isinstance(rule.severity, Severity), rule.id
        assert set(rule.needs) <= set(NEEDS), rule.id
        assert (rule.apply is None) == rule.id.startswith("SIT0"), rule.id
    assert [rule.id for rule in RULES] == sorted(rule.id for rule in RULES)
    assert {rule.id[3] for rule in RULES} == set("01234")


def test_explain_accepts_rule_id_and_rule_name():
    text = explain("SIT201")
    assert text == explain("sit201") == explain("inductance-floor")
    assert all(part in text for part in ("0.2 uH", "Why:", "To mend it:", "Source:"))
    with pytest.raises(KeyError):
        explain("SIT999")


@pytest.mark.slow
def test_coil_only_spec_lists_rules_not_checked(design, estimates):
    gone = dict.fromkeys(("target", "elastomer", "encapsulation", "mount", "shield", "requirements"))
    spec = design(**gone)
    result = check(spec, estimates=estimates(spec, resistances={"free": 1500.0}), hints="none")
    cases = {skipped.rule: skipped.case for skipped in result.not_checked}
    assert (cases["SIT301"], cases["SIT305"]) == ("no-jaw", "no-target")
    assert {"SIT302", "SIT303", "SIT304", "SIT306", "SIT307", "SIT309", "SIT310", "SIT311", "SIT312", "SIT210"} <= set(
        cases
    )


@pytest.mark.slow
def test_findings_are_sorted_located_and_reproducible(design, estimates):
    spec = design(coil__trace_width="70 um", coil__trace_spacing="70 um", requirements__bandwidth="400 Hz")
    numbers = estimates(spec, inductance=0.1e-6, quality=5.0)
    item, other = check(spec, estimates=numbers), check(spec, estimates=numbers)
    assert item == other and not item.ok
    rules = [f.rule for f in item.findings]
    assert rules == sorted(rules) and {"SIT101", "SIT102", "SIT201", "SIT205", "SIT210"} <= set(rules)
    for result in item.findings:
        assert result.line and result.column and result.source and result.hint and result.name, result


@pytest.mark.slow
def test_every_finding_has_id_and_name_of_rule_table(design, estimates):
    spec = design(coil__turns=11.75)
    names = {rule.id: rule.name for rule in RULES}
    result = check(spec, estimates=estimates(spec), hints="none")
    assert all(names[results.rule] == results.name for results in result.findings)
    assert any(results.rule == "SIT112" for results in result.findings)


def test_checks_package_imports_no_cad_or_plotting():
    code = (
        "import sys, sitscad.checks, sitscad.assembly.solids.solid\n"
        "heavy = {'build123d', 'cadquery', 'OCP', 'gmsh', 'manifold3d', 'trimesh', 'scipy', 'matplotlib', 'ezdxf'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_every_rule_lists_all_severities_in_its_code():
    """Whatever the rule's own function says, and whatever it says by default, stands in its list."""
    for rule in RULES:
        listed = {word for word in ("note", "warning", "error") if word in rule.severities.replace(",", " ").split()}
        message = {word.lower() for word in re.findall(r"Severity\.(NOTE|WARNING|ERROR)", _sources(rule.apply))}
        assert rule.severity.value in listed and (message <= listed or rule.id == "SIT111"), (rule.id, message, listed)


def _sources(function):
    """The source of a rule's function and of those that it hands over to."""
    if function is None:
        return ""
    text = inspect.getsource(inspect.unwrap(function))
    for name in re.findall(r"yield from (_\w+)\(design\)", text):
        text += _sources(function.__globals__[name])
    return text


@pytest.mark.slow
def test_finding_for_absent_key_names_key_to_add(design, estimates):
    spec = design(readout={"device": "ldc1614"}, requirements={"bandwidth": "400 Hz"})
    (findings,) = [f for f in check(spec, estimates=estimates(spec)).findings if f.rule == "SIT210"]
    assert findings.line and "readout.scan_rate" in findings.hint
    bare = design(readout=None, requirements={"bandwidth": "400 Hz"})
    (findings,) = [f for f in check(bare, estimates=estimates(bare)).findings if f.rule == "SIT210"]
    assert findings.line == len(bare.source.text.splitlines()) and "readout.scan_rate" in findings.hint
    written = design(requirements={"bandwidth": "400 Hz"})
    (findings,) = [f for f in check(written, estimates=estimates(written)).findings if f.rule == "SIT210"]
    assert "add " not in findings.hint


def test_key_below_preset_name_is_not_absent_key(design):
    source = design().source
    assert source.addable_key("mount.jaw.width") is None and source.addable_key("mount.jaw") is None
    assert source.addable_key("mount.kerf") == "mount.kerf"
    assert source.addable_key("readout") is None is source.addable_key(None)


def test_target_without_elastomer_gives_warning(judge, design, verdicts):
    (result,) = judge("SIT313", design(elastomer=None))
    assert (result.severity, result.key, result.measured) == (Severity.WARNING, "elastomer", 0.0)
    assert judge("SIT313", design()) == []
    assert verdicts("SIT313", design(target=None, elastomer=None))[1][0].case == "no-target"
