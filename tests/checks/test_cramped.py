"""Specs refused because coils or turns lack room: what their hints name was laid out, leads and vias included."""

import json
import re

import pytest
from ruamel.yaml import YAML

import sitscad
from sitscad.basics.finding import Missing
from sitscad.checks.judging import mended
from sitscad.layout import lay_out
from sitscad.spec import templates
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError

ROOM = {Missing.INNER_ROOM, Missing.LEAD_ROOM}

plain = YAML(typ="safe")


def refused(document):
    with pytest.raises(SpecError) as raised:
        load_text(json.dumps(document), "spec.yaml")
    return raised.value


def followed(document, hint):
    """The document with what a hint names."""
    changed = json.loads(json.dumps(document))
    for section, key, value in re.findall(r"(coil|array)\.(turns|pitch): ([\d.]+)", hint.partition(" gives room")[0]):
        changed[section][key] = plain.load(value)
    for factor in re.findall(r"array\.centres ([\d.]+) times", hint):
        changed["array"]["centres"] = [[float(factor) * each for each in c] for c in document["array"]["centres"]]
    return load_text(json.dumps(changed), "spec.yaml")


def sensor(shape, turns, array, layers=2):
    size = [9, 5] if shape in ("racetrack", "rectangle") else 6
    coil = {"shape": shape, "outer_diameter": size, "turns": turns, "layers": layers}
    coil |= {"trace_width": "100 um", "trace_spacing": "100 um"}
    fpc = {"rules": "generic-flex", "stackup": "flex-4l", "tail": {"length": 30, "connector": "zif-0.5mm", "layers": 2}}
    return {"sitscad": 1, "name": "cramped", "coil": coil, "array": array, "fpc": fpc}


CRAMPED = {
    "a line too near": (sensor("circle", 9, {"pattern": "line", "count": 2, "pitch": 6.02}), {"SIT014"}),
    "squares in a triangle": (sensor("square", 8, {"pattern": "triangle", "pitch": 6.05}), {"SIT014"}),
    "a grid that overlaps": (sensor("octagon", 8, {"pattern": "grid", "count": [2, 2], "pitch": 5.5}), {"SIT014"}),
    "explicit centres": (
        sensor("hexagon", 8, {"pattern": "explicit", "centres": [[-3, 0], [3, 0.5]]}), {"SIT014"},
    ),
    "too many turns": (sensor("circle", 40, {"pattern": "single"}), {"SIT016"}),
    "too many turns of four layers": (sensor("rectangle", 30, {"pattern": "single"}, 4), {"SIT016"}),
    "too many turns of coils too near": (
        sensor("hexagon", 40, {"pattern": "line", "count": 2, "pitch": 5.9}), {"SIT014", "SIT016"},
    ),
}


SLOW = {"too many turns of four layers": pytest.mark.slow}


@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW.get(name, ())) for name in CRAMPED])
def test_hint_for_crowded_coils_has_room_for_leads_and_vias(name):
    """The pitch that leaves the gap, and the turns that fit, were refused again for want of room for leads and vias."""
    document, rules = CRAMPED[name]
    error = refused(document)
    assert {finding.rule for finding in error.findings} == rules
    findings = mended(error, hints="full")
    assert [(f.rule, f.message, f.line) for f in findings] == [(f.rule, f.message, f.line) for f in error.findings]
    (hint,) = {finding.hint.partition("; or")[0] for finding in findings}
    assert all(finding.fixes for finding in findings)
    spec = followed(document, hint)
    assert not ROOM & {lack.what for lack in lay_out(spec).shortfalls}


def test_hint_without_trials_warns_that_leads_may_need_more():
    (finding,) = refused(CRAMPED["a line too near"][0]).findings
    assert finding.hint == "a pitch larger by 0.080 mm leaves that gap; leads and vias between the coils may need more"


def test_crowding_without_possible_trial_gets_unchanged_findings():
    document = sensor("circle", 40, {"pattern": "line", "count": 2, "pitch": 6.02})
    document["fpc"]["tail"]["connector"] = "none-such"
    error = refused(document)
    assert error.lacking_room is None and mended(error) == error.findings
    same_place = sensor("circle", 9, {"pattern": "explicit", "centres": [[0, 0], [0, 0]]})
    assert mended(refused(same_place)) == refused(same_place).findings
    many = sensor("circle", 9, {"pattern": "grid", "count": [4, 4], "pitch": 6.02})
    assert mended(refused(many)) == refused(many).findings


def test_check_command_prints_tried_hint_for_crowded_coils(tmp_path, capsys):
    path = tmp_path / "spec.yaml"
    path.write_text(templates.read("bench_7mm").replace("pitch: 8 ", "pitch: 7 "), encoding="utf-8")
    from sitscad.cli import run

    assert run(["check", str(path)]) == 2
    assert "(tried)" in capsys.readouterr().out
    assert "mended" in sitscad.__all__
