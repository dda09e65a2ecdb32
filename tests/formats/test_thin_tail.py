"""A tail of fewer copper layers than the body: its holes end with its own layers, in every file that shows them."""

from __future__ import annotations

import json
import re

import pytest
from gerber_shapes import image, read
from gerbonara import ExcellonFile
from kicad_oracle import needs_kicad, rule_check, write
from layouts import order_set, thin_tail, two_coils
from one_rule import findings_of
from shapely import Polygon
from shapely import box as shapely_box
from tolerance import approx

import sitscad
from sitscad.files.extraction.differences import compare, extract
from sitscad.files.formats import gerber
from sitscad.files.formats.kicad import project_files as kicad
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout import lay_out
from sitscad.layout.panel import plan
from sitscad.spec.load import load_text
from sitscad.spec.yaml.rewriting import rewritten

MM = 1e-3

SPEC = """
sitscad: 1
name: thin
coil: {{shape: circle, outer_diameter: {across}, turns: 5, layers: {layers}, trace_width: 0.1, trace_spacing: 0.1}}
array: {array}
fpc: {{tail: {{length: 30, layers: {tail}{turn}}}}}
"""


def board(layers=4, tail=2, array="{pattern: single}", across=6, turn=""):
    return lay_out(load_text(SPEC.format(layers=layers, tail=tail, array=array, across=across, turn=turn), "thin.yaml"))


BOARDS = {
    "four layers": {},
    "four layers, a tail of three": {"tail": 3},
    "six layers": {"layers": 6, "across": 8},
    "eight layers, four coils": {"layers": 8, "across": 9, "array": "{pattern: grid, count: [2, 2], pitch: 11}"},
    "three coils, a tail that turns": {"array": "{pattern: line, count: 3, pitch: 8}", "turn": ", turn: left"},
}


@pytest.fixture(params=BOARDS.values(), ids=list(BOARDS), scope="module")
def thin(request):
    return board(**request.param)


def holes(text: bytes) -> set[tuple[float, float]]:
    file = ExcellonFile.from_string(text.decode("ascii"), filename="x.drl")
    return {(round(hole.x, 4), round(hole.y, 4)) for hole in file.objects}


def flashes(text: bytes) -> set[tuple[float, float]]:
    result = (item for item in read(text).objects if type(item).__name__ == "Flash")
    return {(round(item.x, 4), round(item.y, 4)) for item in result}


def test_tail_vias_end_at_last_tail_layer(thin):
    last = thin.spec.fpc.tail.layers
    assert not thin.shortfalls
    inside = [via for via in thin.vias if via.lowest is not None]
    assert len(inside) == len(thin.coils)
    assert {via.lowest for via in inside} == {last}
    assert all(via.centre.x <= thin.body[2] for via in thin.vias if via.lowest is None)


def test_each_drill_span_has_file_and_pads_only_on_its_layers(thin):
    last, count = thin.spec.fpc.tail.layers, thin.copper_layers
    drills = gerber.render_drills(thin)
    assert sorted(drills) == ["fpc/thin-PTH.drl", f"fpc/thin-front-in{last - 1}.drl"]
    blind, through = drills[f"fpc/thin-front-in{last - 1}.drl"], drills["fpc/thin-PTH.drl"]
    assert f"TF.FileFunction,Plated,1,{last},Blind\n".encode() in blind
    assert f"TF.FileFunction,Plated,1,{count},PTH\n".encode() in through
    assert not holes(blind) & holes(through)
    for path, text in gerber.render(thin).items():
        if number := re.search(rb"FileFunction,Copper,L(\d+)", text):
            there = flashes(text)
            assert holes(through) <= there, path
            assert (holes(blind) <= there) if int(number[1]) <= last else not (holes(blind) & there), path


@pytest.mark.more
@pytest.mark.slow
def test_files_of_thin_tail_pass_readback_and_wrong_span_is_found(thin, tmp_path):
    files = order_set(thin, plan(thin))
    for path, content in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    assert compare(extract(tmp_path)) == ()
    job, last = (tmp_path / "fpc/thin-job.gbrjob").read_text(), thin.spec.fpc.tail.layers
    assert f"Plated,1,{last},Blind" in job
    drill = tmp_path / f"fpc/thin-front-in{last - 1}.drl"
    drill.write_text(drill.read_text().replace(f"1,{last},Blind", f"1,{thin.copper_layers},PTH"))
    kinds = {difference.kind.value for difference in compare(extract(tmp_path))}
    assert {"no-layer", "hole-off-pad"} <= kinds


def test_readback_finds_copper_beyond_end_of_body_layer(tmp_path):
    files = order_set(thin_tail(two_coils(4)))
    for path, content in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    copper = tmp_path / "fpc/two-coils-In2_Cu.gbr"
    text = copper.read_text()
    copper.write_text(text.replace("M02*", "%ADD90C,0.4*%\nD90*\nX12000000Y0D03*\nM02*"))
    assert "no-layer" in {difference.kind.value for difference in compare(extract(tmp_path))}


def test_test_netlist_gives_tail_vias_top_access(thin):
    records = [line for line in order_set(thin)["fpc/thin-netlist.d356"].decode().splitlines() if line[:3] == "317"]
    access = [line[38:41] for line in records]
    assert access.count("A01") == len(thin.coils) and set(access) == {"A00", "A01"}


@pytest.mark.few(2)
@pytest.mark.slow
@needs_kicad
def test_kicad_reads_tail_vias_as_blind_vias_without_violation(thin, tmp_path):
    files = kicad.render(thin)
    text = files["kicad/thin.kicad_pcb"].decode()
    assert text.count("(via blind ") == len(thin.coils)
    assert f'(layers "F.Cu" "In{thin.spec.fpc.tail.layers - 1}.Cu")' in text
    assert rule_check(write(files, tmp_path)) == ([], [])


def test_tail_coverlay_overlaps_body_by_fabricator_lap(thin):
    """Drawn from the lap on over all of the tail, named in the papers; the body's ends at the step."""
    files, lap = order_set(thin), thin.spec.fpc.rules.coverlay_lap
    last = thin.spec.fpc.tail.layers
    text = files["fpc/thin-Tail_Coverlay.gbr"]
    assert f"TF.FileFunction,Other,Tail_Coverlay_L{last}*".encode() in text
    area, box = image(read(text)), bounding_box([thin.outline])
    x0, _, x1, _ = area.bounds
    assert (x0, x1) == approx(((thin.body[2] - lap) / MM, box[2] / MM), abs=1e-5)
    whole = Polygon([(p.x / MM, p.y / MM) for p in thin.outline.flattened(1e-6)])
    assert area.area == approx(whole.intersection(shapely_box(x0, -1e3, 1e3, 1e3)).area, rel=1e-4)
    words = " ".join(files["fpc/readme.txt"].decode().split())
    assert f"The tail has a coverlay of its own under copper {last}" in words
    assert "laps 300 um into the body" in words and "the bottom coverlay goes on" not in words
    for name in ("drawing.svg", "stackup.svg"):
        drawn = " ".join(re.sub(r"<[^>]*>", " ", files[f"fpc/thin-{name}"].decode()).split())
        assert "coverlay" in drawn and re.search(r"laps\s+300 um\s+into", drawn), name
    step = thin.spec.fpc.stackup.thickness - sum(layer.thickness for layer in thin.spec.fpc.tail_layers)
    assert f"the step of {step * 1e6:.4g} um" in words


@pytest.mark.few(2)
@pytest.mark.slow
def test_readback_finds_tail_copper_without_bottom_coverlay(thin, tmp_path):
    for path, content in order_set(thin).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    path = tmp_path / "fpc/thin-Tail_Coverlay.gbr"
    little = "G36*\nX0Y0D02*\nG01*\nX1000Y0D01*\nX1000Y1000D01*\nX0Y0D01*\nG37*"
    path.write_text(re.sub(r"G36\*.*G37\*", little, path.read_text(), flags=re.DOTALL))
    assert "bare-copper" in {difference.kind.value for difference in compare(extract(tmp_path))}


@pytest.mark.slow
def test_via_near_step_yields_finding_and_suggested_margin_removes_it(thin):
    findings = [f for f in sitscad.check(thin.spec, thin, hints="full").findings if f.rule == "SIT130"]
    gaps = [thin.body[2] - via.centre.x - via.drill / 2 for via in thin.vias if via.lowest is None]
    holes = [f for f in findings if f.measured == approx(min(gaps), rel=1e-6)]
    assert bool(holes) == (min(gaps) < thin.spec.fpc.rules.hole_to_step)
    for finding in findings:
        assert finding.severity.value == "warning"
        (edit,) = finding.fixes[0].edits
        assert edit.key == "fpc.margin"
        changed = sitscad.load_text(rewritten(thin.spec.source.text, [edit]), "thin.yaml")
        assert findings_of("SIT130", changed) == []


@pytest.mark.slow
def test_tail_with_all_layers_has_no_tail_coverlay_or_step_finding():
    whole = board(tail=4)
    assert {path for path in order_set(whole) if "Tail_Coverlay" in path} == set()
    assert findings_of("SIT130", whole.spec, whole) == []


@pytest.mark.parametrize("turned", [0, 30, 90, 180])
def test_distance_of_rotated_coils_to_step_matches_drawn_copper(turned):
    """What is said of the outermost turns is measured on the copper itself, whatever way a coil lies."""
    laid = lay_out(
        load_text(
            f"""
sitscad: 1
name: turned
coil: {{shape: racetrack, outer_diameter: [8, 4], turns: 4, layers: 4, trace_width: 0.1, trace_spacing: 0.1}}
array: {{centres: [[-6, 0], [6, 0]], rotations: [{turned} deg, {turned} deg]}}
fpc: {{tail: {{length: 30, layers: 2}}, rules: {{name: wide, coverlay_lap: 9}}}}
""",
            "turned.yaml",
        )
    )
    result = findings_of("SIT130", laid.spec, laid)
    result = [f for f in result if (f.place.x, f.place.y) in {tuple(coil.centre) for coil in laid.coils}]
    windings = [winding.path for coil in laid.coils for winding in coil.windings]
    copper = bounding_box(windings)[2] + laid.spec.coil.trace_width / 2
    assert len(result) == 1 and abs(result[0].measured - (laid.body[2] - copper)) < 0.05 * MM


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plated", "finished", "core"),
    [
        ("panel", ["42 um", "30 um", "18 um", "30 um"], "copper 1 and 2 get 12 um"),
        ("buttons", ["18 um"] * 4, "12 um in holes and pads alone"),
    ],
)
def test_finished_copper_is_equal_in_all_order_documents(plated, finished, core):
    """The readme had copper 2 plated before lamination, and the stack-up said 18 um of foil, not plated."""
    text = SPEC.format(layers=4, tail=2, array="{pattern: single}", across=6, turn="")
    spec = load_text(text.replace("fpc: {", f"fpc: {{plated: {plated}, "), "thin.yaml")
    layout = lay_out(spec)
    files = order_set(layout)
    readme = " ".join(files["fpc/readme.txt"].decode().split())
    assert [f"{layer.thickness * 1e6:g} um" for layer in spec.fpc.stackup.copper] == finished
    for layer, whole in zip(spec.fpc.stackup.copper, finished, strict=True):
        plating = f" and {layer.plated * 1e6:g} um plating" if layer.plated else ", not plated"
        assert f"{whole} copper {layer.number} " in readme and f", 18 um foil{plating}" in readme
    job = json.loads(next(data for name, data in files.items() if name.endswith("-job.gbrjob")))
    rows = [row for row in job["MaterialStackup"] if row["Type"] == "Copper"]
    assert [f"{row['Thickness'] * 1e3:g} um" for row in rows] == finished
    assert all("18 um foil" in row["Notes"] for row in rows)
    drawn = " ".join(re.findall(r">([^<>]+)<", files["fpc/thin-stackup.svg"].decode()))
    assert f"plated ({core})" in readme and drawn.count("18 um foil") >= 4
    (note,) = [finding for finding in sitscad.check(spec).findings if finding.rule == "SIT132"]
    assert note.severity.value == "note" and core in note.detail
    assert "/".join(each.removesuffix(" um") for each in finished) in note.message
    assert {"tail-layers", "tail-layers-bends"} <= set(note.cases)


def test_two_cores_without_blind_vias_need_one_lamination():
    text = SPEC.format(layers=4, tail=4, array="{pattern: single}", across=6, turn="")
    layout = lay_out(load_text(text, "thin.yaml"))
    assert not findings_of("SIT132", layout.spec)
    files = order_set(layout)
    assert "one lamination" in files["fpc/readme.txt"].decode() and not any("front-in" in name for name in files)
