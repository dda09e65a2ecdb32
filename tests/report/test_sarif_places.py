"""One spec that breaks it for every rule that a spec can break: SARIF is valid and points at the key that the finding
names, by a reading of the file that is not ours.
"""

from __future__ import annotations

import importlib.util
import json
import random
import sys
from pathlib import Path

import pytest
import told
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from test_sarif import VALID

import sitscad
from sitscad.checks.findings import CheckedSpec, checked_spec
from sitscad.checks.findings.ci import sarif as render
from sitscad.checks.rules import Violation, apply_rule, finding_from_violation, locate_finding
from sitscad.estimates.design import Design
from sitscad.package.inspection import inspect

BROKEN = sorted((Path(__file__).parent / "broken").glob("*.yaml"))
DRAWN = {"SIT104", "SIT105", "SIT122", "SIT125"}
"""Rules that a spec cannot break, because what is drawn keeps to the fabricator's figures: broken in the drawing."""
BY_HAND = {"SIT120": "coil", "SIT018": "fpc.rules",
           "SIT320": "mount.standoff", "SIT321": "mount.standoff", "SIT322": "mount.jaw",
           "SIT323": "target.size", "SIT326": "mount.standoff", "SIT332": "mount.jaw.step",
           "SIT333": "mount.jaw.step"}
"""Rules that take more than one file, a drawing without a way out or solids, and a key that they name."""


def results_of(checked: CheckedSpec) -> list[dict]:
    document = json.loads(render((checked,), told.OUTPUT))
    VALID.validate(document)
    return document["runs"][0]["results"]


def place_of(text: str, key: str) -> tuple[int, int] | None:
    """Where the value of a dotted key begins, or its key where the value is a block, by ruamel; of the nearest parent
    that is there. None for what cannot be read, and for a section that is not there at all.
    """
    try:
        node = YAML(typ="rt").load(text)
    except YAMLError:
        return None
    place = None
    for name in key.split("."):
        step = int(name) if isinstance(node, list) and name.isdecimal() else name
        if not (isinstance(node, dict) and step in node) and not (isinstance(node, list) and step < len(node)):
            break
        at_key, at_value = node.lc.key(step) if isinstance(node, dict) else node.lc.item(step), None
        if isinstance(node, dict):
            at_value = node.lc.value(step)
        line, column = at_value if at_value is not None and at_value[0] == at_key[0] else at_key
        place, node = (line + 1, column + 1), node[step]
    return place


def assert_points_at_its_key(result: dict, text: str) -> None:
    (location,) = result["locations"]
    region = location["physicalLocation"]["region"]
    lines = text.splitlines()
    assert 1 <= region["startLine"] <= max(1, len(lines))
    if "logicalLocations" in location:
        place = place_of(text, location["logicalLocations"][0]["fullyQualifiedName"])
        if place is not None:
            assert (region["startLine"], region["startColumn"]) == place, location
        if place is not None:
            assert region["snippet"]["text"] == lines[place[0] - 1]
            assert place[1] < region["endColumn"] <= len(lines[place[0] - 1]) + 1


def test_every_rule_has_broken_spec_or_manual_case():
    assert {path.stem for path in BROKEN} | DRAWN | set(BY_HAND) == {rule.id for rule in sitscad.RULES}


SOME = [
    pytest.param(path, id=path.stem, marks=() if turn % 12 == 0 else (pytest.mark.slow, pytest.mark.more))
    for turn, path in enumerate(BROKEN)
]
"""Every twelfth in every run, the others only where slow tests are asked for."""


@pytest.mark.parametrize("path", SOME)
def test_sarif_result_points_at_key_of_finding(path):
    checked = inspect(str(path), "none").checked
    results = results_of(checked)
    assert path.stem in {result["ruleId"] for result in results}
    for result in results:
        if result["ruleId"] not in ("SIT001", "SIT002", "SIT012", "SIT013"):
            assert_points_at_its_key(result, path.read_text(encoding="utf-8"))


@pytest.mark.slow
def test_layout_fault_result_points_at_key():
    source = Path(__file__).parents[1] / "checks" / "test_broken_layouts.py"
    spec = importlib.util.spec_from_file_location("broken_layouts", source)
    faults = sys.modules["broken_layouts"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(faults)
    board, seen = faults.board(2), set()
    for spoil in faults.FAULTS:
        layout = spoil(board, random.Random(f"{spoil.__name__} 0")).layout
        rules = [rule for rule in sitscad.RULES if rule.id in DRAWN - seen]
        findings = [finding for rule in rules for finding in apply_rule(rule, Design(layout.spec, layout))[0]]
        for result in results_of(checked_spec(layout.spec.name, layout.spec.source, findings, ())):
            seen.add(result["ruleId"])
            assert_points_at_its_key(result, layout.spec.source.text)
    assert seen == DRAWN


@pytest.mark.parametrize("rule", sorted(BY_HAND))
def test_manual_finding_result_points_at_key(rule, root):
    spec = sitscad.load(root / "templates" / "grasper_4layer.yaml")
    (row,) = (each for each in sitscad.RULES if each.id == rule)
    finding = locate_finding(finding_from_violation(row, Violation("it is so", key=BY_HAND[rule]), spec.readout.device),
                             spec.source)
    (result,) = results_of(checked_spec(spec.name, spec.source, (finding,), ()))
    assert_points_at_its_key(result, spec.source.text)
