"""Places for the tank capacitors on the tail: across every pair, in all files, and where the estimate has them."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
import subprocess
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.checks.judging import check
from sitscad.estimates import estimate
from sitscad.files.documents import parts_list as bom
from sitscad.files.documents import parts_list as placement
from sitscad.files.formats import gerber, ipc356
from sitscad.files.formats.kicad import project_files as kicad
from sitscad.kernels.geometry.path import bounding_box, rectangle
from sitscad.layout.panel import coupon_spec
from sitscad.spec import presets
from sitscad.spec.reading import SpecError

TEMPLATES = Path(__file__).parents[2] / "templates"
CASES = [
    ("grasper_4layer", "chip-0402", ""),
    ("grasper_4layer", "chip-0603", "turn: left"),
    ("three_axis_grid", "chip-0402", "offset: -4"),
    ("racetrack_jaw", "chip-0603", ""),
    ("bench_7mm", "chip-0402", "connector: zif-0.3mm"),
]


def text_of(template, chip, extra=""):
    text = (TEMPLATES / f"{template}.yaml").read_text(encoding="utf-8")
    text = re.sub(r"^name: .*$", "name: tank", text, flags=re.MULTILINE)
    text = re.sub(r"^  capacitor_at: .*\n", "", text, flags=re.MULTILINE)
    text = text.replace("readout:\n", f"readout:\n  capacitors_on_board: {chip}\n", 1)
    if extra.startswith("connector"):
        return re.sub(r"connector: [\w.-]+", extra, text)
    return text.replace("    bend: static", f"    bend: static\n    {extra}", 1) if extra else text


def board(*case):
    spec = sitscad.load_text(text_of(*case), "tank.yaml")
    return sitscad.lay_out(spec)


@pytest.mark.parametrize("case", CASES)
def test_capacitor_pads_lie_across_track_pairs_on_stiffener(case):
    layout = board(*case)
    chip = presets.chip(case[1])
    assert layout.shortfalls == ()
    assert [c.coil for c in layout.capacitors] == [c.name for c in layout.coils]
    for capacitor, coil in zip(layout.capacitors, layout.coils, strict=True):
        item, other = capacitor.pads
        assert item.centre.distance(other.centre) == approx(
            max(chip.pitch, layout.spec.fpc.tail.connector.pitch), rel=1e-6
        )
        assert sorted(item.size) == approx(sorted((chip.pad_along, chip.pad_across)), rel=1e-6)
        assert {p.net for p in capacitor.pads} == {coil.net} and (item.pin, other.pin) == (
            f"{capacitor.reference}.1",
            f"{capacitor.reference}.2",
        )
        # the current passes both pads, the first one on its way in from contact A, the second on its way out to B
        joints = [a.path.end for a, b in pairwise(coil.series) if hasattr(a, "path") and hasattr(b, "path")]
        at = [next(i for i, p in enumerate(joints) if p.distance(pad.centre) < 1e-9) for pad in capacitor.pads]
        assert at[0] < at[1]
        x0, y0, x1, y1 = bounding_box([layout.stiffener.outline.outline])
        assert all(x0 < p.centre.x < x1 and y0 < p.centre.y < y1 for p in capacitor.pads)
        assert sum(_holds(r.outline, item) or _holds(r.outline, other) for r in layout.top_openings) == 2


@pytest.mark.parametrize(("chip", "web"), [("chip-0402", "0.1 mm"), ("chip-0603", "0.2 mm"), ("chip-0402", "0.3 mm")])
def test_coverlay_web_beside_capacitor_pads_meets_minimum(chip, web):
    """Between an opening over a capacitor's pad and the tail's edge; half a web less of board and the check says so."""
    text = text_of("bench_7mm", chip)
    spec = sitscad.load_text(re.sub(r"rules: .*", f"rules: {{coverlay_web: {web}}}", text), "tank.yaml")
    layout, request = sitscad.lay_out(spec), spec.fpc.rules.coverlay_web
    assert [f for f in check(spec, layout, hints="none").findings if f.rule in ("SIT109", "SIT114", "SIT115")] == []
    highest = max(bounding_box([region.outline])[3] for region in layout.top_openings[1:])
    _, edge = layout.reach_at(layout.capacitors[0].centre.x)
    assert edge - highest >= request - 1e-9
    flat = rectangle(-10e-3, -(highest + request / 2), 60e-3, highest + request / 2)
    lines = findings_of("SIT114", spec, replace(layout, outline=flat))
    assert len(lines) >= 1 and all(f.measured == approx(request / 2, rel=1e-6) for f in lines)


def _holds(outline, pad):
    x0, y0, x1, y1 = bounding_box([outline])
    (w, h), (x, y) = pad.size, pad.centre
    return x0 < x - w / 2 and x + w / 2 < x1 and y0 < y - h / 2 and y + h / 2 < y1


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_board_with_capacitors_has_no_layout_error(case):
    layout = board(*case)
    findings = [f for f in sitscad.check(layout.spec, layout, hints="none").findings if f.rule.startswith("SIT1")]
    assert [f for f in findings if f.severity == "error"] == []
    assert not {"SIT107", "SIT108", "SIT109", "SIT110", "SIT114", "SIT115", "SIT121", "SIT122"} & {
        f.rule for f in findings
    }


@pytest.mark.slow
def test_files_contain_both_pads_of_every_capacitor():
    layout = board(*CASES[0])
    top = next(t for n, t in gerber.render(layout).items() if n.endswith("F_Cu.gbr")).decode()
    netlist = next(iter(ipc356.render(layout).values())).decode()
    for reference in ("CT1", "CT2"):
        for number in (1, 2):
            assert f"%TO.P,{reference},{number},{reference}.{number}*%" in top
            assert re.search(rf"^327C\d +{reference}   -{number} ", netlist, re.MULTILINE)
    (table,) = placement.render_placement(layout, estimate(layout)).values()
    rows = list(csv.DictReader(io.StringIO(table.decode())))
    assert [(row["Ref"], row["Package"], row["Side"]) for row in rows] == [
        ("CT1", "chip-0402", "top"),
        ("CT2", "chip-0402", "top"),
    ]
    for row, capacitor in zip(rows, layout.capacitors, strict=True):
        assert (float(row["PosX"]), float(row["PosY"])) == approx([c * 1e3 for c in capacitor.centre], abs=1e-4)
        turn = math.radians(float(row["Rot"]))
        reach = capacitor.pads[1].centre - capacitor.centre
        assert (math.cos(turn), math.sin(turn)) == approx([r / math.hypot(*reach) for r in reach], abs=1e-6)
    parts = {item.item: item for item in bom.items(layout, estimate(layout).readout)}
    assert parts["capacitor"].size.startswith("chip-0402") and "CT1, CT2" in parts["capacitor"].note
    assert {row["Val"] for row in rows} == {parts["capacitor"].part} and parts["capacitor"].part.endswith("F")
    assert parts["connector"].part == "zif-0.5mm, 4 contacts"
    assert placement.render_placement(sitscad.lay_out(sitscad.load(TEMPLATES / "grasper_4layer.yaml")), None) == {}


@pytest.mark.slow
def test_capacitor_on_board_is_estimated_at_coil():
    on_board = sitscad.load_text(text_of("grasper_4layer", "chip-0402"), "tank.yaml")
    assert on_board.readout.capacitor_at == "coil"
    assert "readout.capacitor_at: coil, the default" in on_board.source.defaults
    cable = "  cable: {length: 300}\n"
    near, far = (
        estimate(sitscad.lay_out(sitscad.load_text(text.replace("readout:\n", f"readout:\n{cable}"), "x.yaml"))).coils[
            0
        ]
        for text in (text_of("grasper_4layer", "chip-0402"), (TEMPLATES / "grasper_4layer.yaml").read_text())
    )
    assert near.sensor_frequency > 1.01 * far.sensor_frequency  # the cable's inductance is no part of the tank


@pytest.mark.parametrize(
    "change",
    [
        ("capacitors_on_board: chip-0402", "capacitors_on_board: chip-0402\n  capacitor_at: converter"),
        (("layers: 2                   #", "layers: 1                   #")),
        (("connector: zif-0.5mm", "connector: solder-pads")),
        (("chip-0402", "chip-0201")),
        (("chip-0402", "402")),
    ],
)
def test_capacitors_without_position_give_spec_error(change):
    text = text_of("grasper_4layer", "chip-0402")
    assert change[0] in text
    with pytest.raises(SpecError) as caught:
        sitscad.load_text(text.replace(*change))
    assert {f.key for f in caught.value.findings} == {"readout.capacitors_on_board"}


@pytest.mark.parametrize(("case", "turned"), [(CASES[0], 90), (CASES[1], 0), (CASES[2], 90)])
def test_footprints_reference_kicad_model_of_chip(case, turned):
    """Lying along the line of its pads; contacts and coils are printed copper and name none."""
    layout = board(*case)
    size = {"chip-0402": "0402_1005", "chip-0603": "0603_1608"}[case[1]]
    path = f'"${{KICAD9_3DMODEL_DIR}}/Capacitor_SMD.3dshapes/C_{size}Metric.step"'
    files = {name: text.decode() for name, text in kicad.render(layout).items()}
    library = [text for name, text in files.items() if f"capacitor-{case[1]}.kicad_mod" in name]
    (drawn,) = (text for name, text in files.items() if name.endswith(".kicad_pcb"))
    for text, count in ((library[0], 1), (drawn, len(layout.capacitors))):
        models = re.findall(r"\(model\s+(\S+)\s.*?\(rotate\s+\(xyz 0 0 (\d+)\)\)", text, re.DOTALL)
        assert models == [(path, str(turned))] * count
    assert len(library) == 1
    assert not any("(model" in text for name, text in files.items() if name.endswith("contacts.kicad_mod"))


@pytest.mark.slow
@pytest.mark.cad
@pytest.mark.clients("kicad-cli")
@pytest.mark.parametrize("case", [CASES[0], CASES[1]])
def test_kicad_places_chip_model_on_pads(case, tmp_path):
    """A brick in the chip's size stands for KiCad's library; the board's STEP file has one on every pair of pads."""
    from build123d import Box, export_step, import_step

    length, width, height = {"chip-0402": (1.0, 0.5, 0.4), "chip-0603": (1.6, 0.8, 0.7)}[case[1]]
    layout = board(*case)
    model = tmp_path / layout.spec.readout.chip.model
    model.parent.mkdir(parents=True)
    export_step(Box(length, width, height), model)
    for name, text in kicad.render(layout).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(text)
    (pcb,) = (tmp_path / "kicad").glob("*.kicad_pcb")
    command = [
        "kicad-cli",
        "pcb",
        "export",
        "step",
        "--drill-origin",
        "-f",
        "-o",
        tmp_path / "chips.step",
    ]
    environment = {**os.environ, "KICAD9_3DMODEL_DIR": str(tmp_path)}
    done = subprocess.run([*command, pcb], capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0 and "Could not" not in done.stdout + done.stderr, done.stdout + done.stderr
    solids = import_step(tmp_path / "chips.step").solids()
    assert len(solids) == len(layout.capacitors) + 1  # and the board's own body
    for capacitor in layout.capacitors:
        x, y = (c * 1e3 for c in capacitor.centre)
        (box,) = [
            b for b in (s.bounding_box() for s in solids) if math.hypot(b.center().X - x, b.center().Y - y) < 0.01
        ]
        along = [abs(a - b) for a, b in zip(*(pad.centre for pad in capacitor.pads), strict=True)]
        sides = (length, width) if along[0] > along[1] else (width, length)
        assert approx((*sides, height), abs=1e-3) == (box.size.X, box.size.Y, box.size.Z)


def test_coupon_has_no_capacitors():
    spec = sitscad.load_text(text_of("grasper_4layer", "chip-0402"), "tank.yaml")
    assert sitscad.lay_out(coupon_spec(spec)).capacitors == ()


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.clients("kicad-cli")
@pytest.mark.parametrize("case", [
    CASES[0], pytest.param(CASES[1], marks=pytest.mark.slow),
    *(pytest.param(case, marks=[pytest.mark.slow, pytest.mark.more]) for case in CASES[2:]),
])
def test_board_with_capacitors_passes_kicad_and_verification(case, tmp_path):
    pytest.importorskip("gerbonara", reason="verify reads Gerbers through gerbonara, which sitscad[all] brings")
    sitscad.build(sitscad.load_text(text_of(*case), "tank.yaml"), tmp_path, only=("gerber", "kicad"), force=True)
    folder = tmp_path / "tank"
    result = sitscad.verify(folder)
    assert result.ok, result.differences
    nets = json.loads((folder / "manifest.json").read_text())["nets"]
    assert nets["C1"] == ["C1.A", "C1.B", "CT1.1", "CT1.2"]
    assert (folder / "fpc" / "tank-placement.csv").exists() and "CT1" in (folder / "fpc" / "readme.txt").read_text()
    report = tmp_path / "drc.json"
    command = ["kicad-cli", "pcb", "drc", "--format", "json", "--severity-all", "--exit-code-violations"]
    done = subprocess.run(
        [*command, "-o", str(report), str(next(folder.glob("kicad/*.kicad_pcb")))], capture_output=True, check=False
    )
    assert done.returncode == 0, json.loads(report.read_text())
