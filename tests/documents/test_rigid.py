"""Boards of FR4: materials, stack-ups, and papers that do not call them flexible."""

from __future__ import annotations

import re

import pytest
from tolerance import approx

from sitscad import check, estimate, lay_out, load
from sitscad.package.building import build
from sitscad.package.verification import verify
from sitscad.spec import presets
from sitscad.spec.load import load_text

BARE = """
sitscad: 1
name: rigid
coil: {shape: circle, outer_diameter: 14, turns: 14, layers: 2, trace_width: 210 um, trace_spacing: 210 um}
fpc:
  stackup:
    - {coverlay: 20 um, material: solder-mask}
    - {copper: 35 um}
    - {dielectric: 0.8 mm, material: FR4}
    - {copper: 35 um}
    - {coverlay: 20 um, material: solder-mask}
"""
PRESET = re.sub(r"stackup:\n(    - .*\n)+", "stackup: rigid-2l-1.6mm\n", BARE)
FLEX_WORDS = re.compile(r"flexible|polyimide|coverlay|stiffener|rolled|IPC-6013|\bfilm\b", re.IGNORECASE)


def rules(text, least=("error", "warning")):
    return {result.rule for result in check(load_text(text), hints="none").findings if result.severity.value in least}


@pytest.mark.parametrize("text", [BARE, PRESET])
def test_rigid_board_passes_check(text):
    assert rules(text) == set()


@pytest.mark.parametrize("name", ["rigid-2l-1.6mm", "rigid-4l-1.6mm"])
def test_rigid_preset_has_thickness_and_layers_of_its_name(name):
    stackup = presets.stackup(name)
    assert presets.is_rigid(stackup) and stackup.thickness == approx(1.6e-3, rel=0.02)
    assert len(stackup.copper) == int(name.split("-")[1][0])
    assert not any(presets.is_rigid(presets.stackup(other)) for other in presets.names("stackup") if "flex" in other)


def test_rigid_board_capacitance_follows_laminate_permittivity():
    thin = BARE.replace("0.8 mm", "0.2 mm")
    dense, light = (check_capacitance(thin.replace("FR4", name)) for name in ("FR4", "polyimide"))
    assert dense / light == approx(4.5 / 3.4, rel=0.1)


def check_capacitance(text):
    return estimate(lay_out(load_text(text))).coils[0].winding_capacitance


def test_bend_in_rigid_tail_gives_error():
    tail = BARE + "  tail: {length: 20, connector: solder-pads"
    assert load_text(tail + "}\n").fpc.tail.bend == "none"
    errors = [item for item in check(load_text(tail + ", bend: static}\n")).findings if item.severity.value == "error"]
    assert [(item.rule, item.key) for item in errors] == [("SIT308", "fpc.tail.bend")]
    assert [edit.new for item in errors for remedy in item.fixes for edit in remedy.edits] == ["none"]


def test_suggested_stackup_matches_rigid_or_flexible_board():
    assert presets.stackups_with_copper_layers(4, rigid=True) == ["rigid-4l-1.6mm"]
    assert presets.stackups_with_copper_layers(4, rigid=False)[0] == "flex-4l"


def test_rigid_board_documents_contain_no_flex_terms(tmp_path):
    (tmp_path / "rigid.yaml").write_text(BARE, encoding="utf-8")
    build(load(tmp_path / "rigid.yaml"), tmp_path, only=["gerber", "kicad"])
    folder = tmp_path / "rigid"
    for path in ("fpc/readme.txt", "bom.csv", "fpc/rigid-job.gbrjob", "fpc/rigid-drawing.svg", "fpc/rigid-stackup.svg"):
        if not (folder / path).exists():
            continue
        text = (folder / path).read_text(encoding="utf-8").replace("steel stiffener, shielding film", "")
        assert FLEX_WORDS.findall(text) == [], path
    readme = (folder / "fpc/readme.txt").read_text(encoding="utf-8")
    assert "IPC-6012" in readme and "rigid circuit" in readme and "FR4" in readme
    assert verify(folder).ok
