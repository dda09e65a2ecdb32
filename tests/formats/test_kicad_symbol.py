"""The schematic symbols, and what the KiCad board says of finish, films and the layers that end at the body."""

from __future__ import annotations

import re
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from kicad_oracle import needs_kicad, rule_check, write

from sitscad.files.formats.kicad import library as kicad_footprint
from sitscad.files.formats.kicad import library as kicad_symbol
from sitscad.files.formats.kicad import project_files as kicad
from sitscad.files.formats.kicad import project_files as kicad_board
from sitscad.files.formats.kicad import sexpr as kicad_stackup
from sitscad.layout import lay_out
from sitscad.spec.design_rules import FINISHES
from sitscad.spec.load import load_text

TEXT = """\
sitscad: 1
name: drawn
coil: {{shape: circle, outer_diameter: 6, turns: 5, layers: {layers}, trace_width: 0.1, trace_spacing: 0.1}}
array: {{pattern: {array}}}
fpc: {{tail: {{length: 30, layers: 2}}}}
"""
GRID = 1.27


def spec_board(array="line, count: 2, pitch: 8", layers=2):
    return lay_out(load_text(TEXT.format(array=array, layers=layers)))


def symbols_of(text):
    """Each symbol's text by its name."""
    parts = re.split(r'\n\t\(symbol "([^"]+)"', text)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def pins_of(symbol):
    """Kind, name and place by number."""
    result = re.findall(
        r'\(pin (\w+) line\s+\(at (\S+) (\S+) \d+\)\s+\(length [\d.]+\)\s+\(name "([^"]*)".*?\(number "(\d+)"',
        symbol,
        re.S,
    )
    return {int(number): (kind, name, (float(x), float(y))) for kind, x, y, name, number in result}


def footprint_of(symbol):
    return re.search(r'property "Footprint" "([^"]+)"', symbol)[1]


@pytest.mark.parametrize("array", ["single", "line, count: 3, pitch: 8", "grid, count: [2, 2], pitch: 8"])
def test_sensor_symbol_pins_equal_footprint_pads(array):
    layout = spec_board(array)
    sensor = symbols_of(kicad_symbol.symbol_library(layout))["drawn"]
    pins = pins_of(sensor)
    used = {pad.number: pad.pin for pad in layout.pads if pad.net}
    assert {number: name for number, (kind, name, _) in pins.items() if kind == "passive"} == used
    assert footprint_of(sensor) == "drawn:contacts"
    pads = set(re.findall(r'\(pad "(\d+)"', kicad_footprint.library_footprints(layout)["contacts"]))
    assert {str(number) for number in pins} == pads
    nets = dict(re.findall(r'\(pad "(\d+)".*?\(net \d+ "([^"]+)"\)', kicad_footprint.board_footprint(
        layout, kicad_board.net_numbers(layout.all_pads, layout.nets, layout.traces, layout.vias), (0, 0)
    )))
    assert all(used[int(number)].startswith(f"{net}.") for number, net in nets.items() if net)


def test_unused_contact_is_no_connect_pin():
    layout = spec_board("single")
    extra = replace(layout.pads[0], net="", pin="", number=1 + max(pad.number for pad in layout.pads))
    pins = pins_of(symbols_of(kicad_symbol.symbol_library(replace(layout, pads=(*layout.pads, extra))))["drawn"])
    assert pins[extra.number][:2] == ("no_connect", "unused")


@pytest.mark.parametrize("layers", [1, 2, 4])
def test_coil_symbol_pins_are_first_two_footprint_pads(layers):
    layout = spec_board(layers=layers) if layers != 1 else spec_board("single", 1)
    files, symbols = kicad.render(layout), symbols_of(kicad_symbol.symbol_library(layout))
    for coil in layout.coils:
        footprint = files.get(f"kicad/drawn.pretty/coil-{coil.name}.kicad_mod")
        assert (footprint is not None) == (f"coil-{coil.name}" in symbols)
        if footprint is not None:
            symbol = symbols[f"coil-{coil.name}"]
            assert footprint_of(symbol) == f"drawn:coil-{coil.name}"
            assert set(pins_of(symbol)) == {1, 2} <= {int(n) for n in re.findall(rb'\(pad "(\d+)"', footprint)}


def test_symbol_pins_end_at_separate_grid_points(board):
    for symbol in symbols_of(kicad_symbol.symbol_library(board)).values():
        places = [place for _, _, place in pins_of(symbol).values()]
        assert len(set(places)) == len(places) >= 2
        assert all(abs(c / GRID - round(c / GRID)) < 1e-9 for place in places for c in place)


def test_library_tables_name_footprint_and_symbol_library(board):
    files = kicad.render(board)
    for table, library in (("fp-lib-table", "two-coils.pretty"), ("sym-lib-table", "two-coils.kicad_sym")):
        assert f"${{KIPRJMOD}}/{library}".encode() in files[f"kicad/{table}"]
    assert "kicad/two-coils.kicad_sym" in files


@needs_kicad
@pytest.mark.parametrize("layers", [2, 4])
def test_kicad_exports_symbols_and_upgrade_keeps_their_pins(tmp_path, layers):
    layout = spec_board("line, count: 2, pitch: 8", layers)
    place = write(kicad.render(layout), tmp_path).with_suffix(".kicad_sym")
    for command in (
        ["export", "svg", "-o", tmp_path / "svg"],
        ["upgrade", "--force", "-o", tmp_path / "new.kicad_sym"],
    ):
        done = subprocess.run(["kicad-cli", "sym", *command, place], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0 and not done.stderr, done.stdout + done.stderr
    drawn = {path.name.split("_unit")[0]: ET.parse(path) for path in (tmp_path / "svg").glob("*.svg")}
    assert set(drawn) == {"drawn", "coil-C1", "coil-C2"}
    words = " ".join(text.text or "" for text in drawn["drawn"].iter() if text.tag.endswith(("text", "desc")))
    assert all(f"C{i}.{end}" in words for i in (1, 2) for end in "AB")
    ours, theirs = (
        {name: pins_of(symbol) for name, symbol in symbols_of(path.read_text()).items()}
        for path in (place, tmp_path / "new.kicad_sym")
    )
    assert ours == theirs


@needs_kicad
def test_board_with_body_layers_and_bend_passes_rule_check(tmp_path):
    layout = spec_board("line, count: 2, pitch: 8", 4)
    layout = replace(layout, spec=replace(layout.spec, fpc=replace(layout.spec.fpc, finish="immersion-tin")))
    assert rule_check(write(kicad.render(layout), tmp_path)) == ([], [])


# -------------------------------------------------------------------------------------------------- what the board says


@pytest.mark.parametrize("finish", FINISHES)
def test_kicad_board_states_copper_finish_of_spec(board, finish):
    ordered = replace(board, spec=replace(board.spec, fpc=replace(board.spec.fpc, finish=finish)))
    (message,) = re.findall(r'\(copper_finish "([^"]+)"\)', kicad_board.board_text(ordered))
    assert message.lower().replace(" ", "-") == finish


@pytest.mark.parametrize("name", ["flex-2l-18um", "flex-4l", "flex-6l", "flex-8l"])
def test_bondply_between_copper_is_prepreg_in_kicad_stackup(name):
    from sitscad.spec import presets

    stackup = presets.stackup(name)
    section = kicad_stackup.stackup_section(stackup, "enig")
    kinds = dict(re.findall(r'layer "dielectric (\d+)"\s+\(type "(\w+)"\)', section))
    copper = [layer.number for layer in stackup.copper]
    expected = {
        str(i): "prepreg" if any(film.material == "bondply" for film in stackup.between(i, i + 1)) else "core"
        for i in copper[:-1]
    }
    assert kinds == expected and ("prepreg" in kinds.values()) == (len(copper) > 2)


def test_extent_of_body_only_layers_is_drawn_on_user_layer():
    layout = spec_board("line, count: 2, pitch: 8", 4)
    text, corner = kicad_board.board_text(layout), kicad_board.sheet_corner(layout.outline)
    rows = re.findall(r'\(gr_line \(start (\S+) (\S+)\) \(end (\S+) (\S+)\).*?\(layer "User.3"\)', text)
    points = {(float(x), float(y)) for row in rows for x, y in (row[:2], row[2:])}
    x0, y0, x1, y1 = (side * 1e3 for side in layout.body)
    dx, dy = (c / 1e6 for c in corner)
    wanted = {(x - dx, -y - dy) for x in (x0, x1) for y in (y0, y1)}
    assert len(points) == 4 and all(min(abs(a - c) + abs(b - d) for c, d in wanted) < 2e-6 for a, b in points)
    assert "extent of copper 3 to 4 and of what lies between and below (the tail is without)" in text
    assert '"User.3"' not in kicad_board.board_text(spec_board()).partition("(setup")[2]
