"""A tail of fewer copper layers than the body: its holes end with its own layers, in every file that shows them."""

from __future__ import annotations

import re

import pytest
from gerber_shapes import read
from gerbonara import ExcellonFile
from kicad_oracle import needs_kicad, rule_check, write
from layouts import order_set, thin_tail, two_coils

from sitscad.extraction import compare, extract
from sitscad.layout import lay_out
from sitscad.layout.panel import plan
from sitscad.spec.load import load_text
from sitscad.writers import excellon, gerber, kicad

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
    found = (item for item in read(text).objects if type(item).__name__ == "Flash")
    return {(round(item.x, 4), round(item.y, 4)) for item in found}


def test_holes_in_the_tail_end_with_its_layers(thin):
    last = thin.spec.fpc.tail.layers
    assert not thin.findings
    inside = [via for via in thin.vias if via.lowest is not None]
    assert len(inside) == len(thin.coils)
    assert {via.lowest for via in inside} == {last}
    assert all(via.centre.x <= thin.body[2] for via in thin.vias if via.lowest is None)


def test_every_span_has_its_drill_file_and_pads_on_its_layers_only(thin):
    last, count = thin.spec.fpc.tail.layers, thin.copper_layers
    drills = excellon.render(thin)
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


def test_the_files_read_back_keep_their_word(thin, tmp_path):
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


def test_copper_beyond_the_end_of_its_layer_is_found(tmp_path):
    files = order_set(thin_tail(two_coils(4)))
    for path, content in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    copper = tmp_path / "fpc/two-coils-In2_Cu.gbr"
    text = copper.read_text()
    copper.write_text(text.replace("M02*", "%ADD90C,0.4*%\nD90*\nX12000000Y0D03*\nM02*"))
    assert "no-layer" in {difference.kind.value for difference in compare(extract(tmp_path))}


def test_the_test_netlist_meets_holes_of_the_tail_from_the_top(thin):
    records = [line for line in order_set(thin)["fpc/thin-netlist.d356"].decode().splitlines() if line[:3] == "317"]
    access = [line[38:41] for line in records]
    assert access.count("A01") == len(thin.coils) and set(access) == {"A00", "A01"}


@needs_kicad
def test_kicad_takes_them_for_blind_vias_and_finds_nothing(thin, tmp_path):
    files = kicad.render(thin)
    text = files["kicad/thin.kicad_pcb"].decode()
    assert text.count("(via blind ") == len(thin.coils)
    assert f'(layers "F.Cu" "In{thin.spec.fpc.tail.layers - 1}.Cu")' in text
    assert rule_check(write(files, tmp_path)) == ([], [])
