"""The coil as a footprint: placed on a board of its own, KiCad finds nothing to complain about, and all the copper."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import layouts
import pytest
from kicad_oracle import kinds, needs_kicad, plots, rule_check, write

from sitscad.files.formats.kicad import project_files as kicad
from sitscad.files.formats.kicad.coil import coil_footprints, winding
from sitscad.files.formats.kicad.sexpr import copper_names, layer_table, node
from sitscad.kernels.geometry.path import Line, Point, polar
from sitscad.layout import lay_out
from sitscad.layout.board import Role, Trace, Via
from sitscad.spec.load import load, load_text

SPEC = """
sitscad: 1
name: library
coil: {{shape: {shape}, outer_diameter: {size}, turns: 5, layers: {layers}, trace_width: 0.1, trace_spacing: 0.1}}
array: {array}
fpc: {{stackup: {stackup}, tail: {{length: 16, connector: zif-0.5mm}}}}
"""

KINDS = {
    "two layers": ("circle", "6", "2", "{pattern: single}", "flex-2l-18um"),
    "inner layers": ("square", "6", "[2, 3]", "{pattern: line, count: 2, pitch: 8}", "flex-4l"),
    "four layers": ("octagon", "6", "4", "{pattern: single}", "flex-4l"),
    "one layer": ("racetrack", "[6, 4]", "1", "{pattern: single}", "flex-2l-18um"),
    "three layers": ("rectangle", "[7, 5]", "3", "{pattern: single}", "flex-4l"),
}


def laid_out(kind: str):
    """The layout of one kind of coil."""
    names = ("shape", "size", "layers", "array", "stackup")
    layout = lay_out(load_text(SPEC.format(**dict(zip(names, KINDS[kind], strict=True))), "library.yaml"))
    assert not layout.shortfalls
    return layout


@pytest.fixture(params=KINDS)
def layout(request):
    """A layout of each kind of coil."""
    return laid_out(request.param)


def test_footprint_description_names_pads_at_winding_ends(layout):
    for name, text in coil_footprints(layout).items():
        pads = len(set(re.findall(r'pad "(\d+)"', text)))
        words = re.search(r'descr "([^"]*)"', text)[1]
        assert "pads 1 and 2 are the ends of the winding" in words, name
        inside = {2: "the winding; ", 3: "pad 3 is inside"}.get(pads, f"pads 3 to {pads} are inside")
        assert inside in words


def own_board(layout, name: str = "coil-C1") -> dict[str, bytes]:
    """A user's board of 24 mm x 24 mm: the footprint placed, and each end led to a contact by the user's own tracks."""
    files = {path: data for path, data in kicad.render(layout).items() if "J1" not in path}
    text = files[f"kicad/library.pretty/{name}.kicad_mod"].decode()
    text = re.sub(r"\t\(version \d+\)\n\t\(generator .*\)\n", "", text).replace(f'"{name}"', f'"library:{name}"', 1)
    text = text.replace('\t(layer "F.Cu")\n', '\t(layer "F.Cu")\n\t(at 20 20)\n', 1).replace("REF**", "L1")
    head, zone = text.split("\t(zone")  # KiCad writes zones of placed footprints in the board's coordinates
    shifted = re.sub(r"\(xy (\S+) (\S+?)\)", lambda m: f"(xy {20 + float(m[1]):.6f} {20 + float(m[2]):.6f})", zone)
    text = f"{head}\t(zone{shifted}"
    placed = {n: _pad(text, n) for n in ("1", "2")}
    for number, net in (("1", 1), ("2", 2)):
        text = re.sub(rf'(\(pad "{number}" [^U]*?)(\(uuid)', rf'\1(net {net} "END{number}") \2', text)
    children = [
        "(version 20241229)",
        '(generator "tests")',
        layer_table(layout.copper_layers),
        '(net 0 "")',
        '(net 1 "END1")',
        '(net 2 "END2")',
        '(gr_rect (start 8 8) (end 32 32) (stroke (width 0.05) (type solid)) (fill no) (layer "Edge.Cuts"))',
        text.rstrip("\n"),
        *_tracks(layout, placed),
    ]
    return files | {"kicad/library.kicad_pcb": (node("kicad_pcb", *children) + "\n").encode()}


def _pad(text: str, number: str) -> tuple[float, float, str]:
    """Where a pad stands on the board (mm) and on which layer tracks may reach it."""
    row = re.search(rf'\(pad "{number}" (\w+) circle \(at (\S+) (\S+)\)[^L]*?\(layers "(\S+)"\)', text)
    return 20 + float(row[2]), 20 + float(row[3]), row[4] if row[1] == "smd" else ""


def _tracks(layout, placed) -> list[str]:
    """For each end a contact well outside the coil, and a straight track to it past all other pads."""
    free = [name for i, name in enumerate(copper_names(layout.copper_layers), 1) if i not in layout.spec.coil.layers]
    spots = [(20 + 1e3 * (v.centre.x - c.x), 20 - 1e3 * (v.centre.y - c.y)) for c in [layout.coils[0].centre]
             for v in winding(layout.coils[0]) if isinstance(v, Via)]
    width = f"{1e3 * layout.spec.coil.trace_width:.6g}"
    reach = max(9.0, 500.0 * max(layout.spec.coil.size) + 2.0)  # beyond the coil, in millimetres
    rows, taken = [], [*spots, *((x, y) for x, y, _ in placed.values())]
    for number, (x, y, layer) in placed.items():
        outward = math.atan2(y - 20, x - 20)
        ways = [Line(Point(x, y), polar(reach, outward + k * math.radians(5), Point(20, 20))) for k in range(-14, 15)]
        way = max(ways, key=lambda w: min(w.distance(Point(*s)) for s in taken if math.dist(s, (x, y)) > 1e-6))
        taken += [way.at(i / 20) for i in range(21)]
        rows.append(
            f"(segment (start {x:.6f} {y:.6f}) (end {way.end.x:.6f} {way.end.y:.6f}) (width {width}) "
            f'(layer "{layer or (*free, "F.Cu")[0]}") (net {number}) (uuid "{number:0>35}0"))'
        )
        rows.append(_contact(way.end, number))
    return rows


def _contact(at, number: str) -> str:
    pad = f'(pad "1" thru_hole circle (at 0 0) (size 1 1) (drill 0.5) (layers "*.Cu") (net {number} "END{number}"))'
    yard = '(fp_circle (center 0 0) (end 1 0) (stroke (width 0.05) (type solid)) (fill no) (layer "F.CrtYd"))'
    name = f'(property "Reference" "X{number}" (at 0 0 0) (layer "F.Fab") (effects (font (size 1 1) (thickness 0.15))))'
    return node('footprint "X"', '(layer "F.Cu")', f"(at {at.x:.6f} {at.y:.6f})", "(attr board_only)", name, yard, pad)


@needs_kicad
@pytest.mark.parametrize(
    "kind",
    [
        "two layers",
        "one layer",
        *(pytest.param(k, marks=pytest.mark.slow) for k in ("inner layers", "four layers", "three layers")),
    ],
)
def test_rule_check_of_coil_footprint_finds_no_violation(kind, tmp_path):
    assert rule_check(write(own_board(laid_out(kind)), tmp_path)) == ([], [])


@needs_kicad
@pytest.mark.parametrize("net", [1, 2])
def test_rule_check_finds_track_across_footprint_turns(net, tmp_path):
    """A track over the turns is found although the footprint is a net tie, whichever end's net it has."""
    files = own_board(laid_out("two layers"))
    board = files["kicad/library.kicad_pcb"]
    across = f'(segment (start 18 20) (end 19.5 20) (width 0.1) (layer "F.Cu") (net {net}) (uuid "{net:036}"))'
    spoilt = board.rstrip().removesuffix(b")") + across.encode() + b")\n"
    assert kinds(write(files | {"kicad/library.kicad_pcb": spoilt}, tmp_path)) & {"shorting_items", "clearance"}


@pytest.mark.slow
@needs_kicad
@pytest.mark.parametrize("kind", ["two layers", "four layers"])
def test_kicad_plot_of_footprint_matches_turns_and_joints(kind, tmp_path):
    """KiCad's own plot of the user's board: the coil's copper as laid out, the user's tracks, and nothing else."""
    artwork = pytest.importorskip("sitscad.files.extraction.artwork", reason="gerbonara and shapely are not installed")
    from shapely import LineString, union_all
    from shapely import Point as Spot
    from shapely.affinity import scale, translate

    layout = laid_out(kind)
    coil, files = layout.coils[0], own_board(layout)
    text = files["kicad/library.kicad_pcb"].decode()
    folder = plots(write(files, tmp_path))["F_Cu"].parent
    drawn = [scale(area, 1e3, 1e3, origin=(0, 0)) for area in artwork.read_artwork(folder).copper]
    for number, name in enumerate(copper_names(layout.copper_layers), 1):
        pieces = winding(coil)
        wanted = [
            LineString([(1e3 * q.x, 1e3 * q.y) for q in piece.path.flattened(1e-8)]).buffer(5e2 * piece.width)
            for piece in pieces
            if isinstance(piece, Trace) and piece.layer == number
        ]
        wanted += [Spot(1e3 * v.centre.x, 1e3 * v.centre.y).buffer(5e2 * v.pad) for v in pieces if isinstance(v, Via)]
        dx, dy = 1e3 * coil.centre.x, 1e3 * coil.centre.y
        mine = [translate(shape, 20 - dx, -20 - dy) for shape in wanted]
        row = r"\(segment \(start (\S+) (\S+)\) \(end (\S+) (\S+?)\) \(width 0.1\) \(layer \"(\S+)\"\)"
        for result in re.finditer(row, text):
            x0, y0, x1, y1 = map(float, result.groups()[:4])
            mine.append(Spot(x1, -y1).buffer(0.5))
            if result[5] == name:
                mine.append(LineString([(x0, -y0), (x1, -y1)]).buffer(0.05))
        there, wish = drawn[number - 1], union_all(mine)
        assert there.symmetric_difference(wish).area < 2e-3 * wish.area, name


def test_each_coil_has_footprint_with_net_tie_of_all_pads(layout):
    files = coil_footprints(layout)
    assert list(files) == [f"coil-{coil.name}" for coil in layout.coils]
    for text in files.values():
        numbers = re.findall(r'\(pad "(\d+)"', text)
        assert numbers == [str(i) for i in range(1, len(numbers) + 1)] and len(numbers) >= 2
        assert f'(net_tie_pad_groups "{", ".join(numbers)}")' in text
        assert text.count("F.CrtYd") == 1 and "(copperpour not_allowed)" in text
        result = re.findall(r'\(uuid "([0-9a-f-]{36})"\)', text)
        assert len(result) == len(set(result))


def test_outer_layer_ends_are_smd_pads_and_inner_ends_are_holes():
    kinds_of = {kind: re.findall(r'\(pad "[12]" (\w+)', coil_footprints(laid_out(kind))["coil-C1"]) for kind in KINDS}
    assert kinds_of["two layers"] == kinds_of["four layers"] == ["smd", "smd"]
    assert kinds_of["inner layers"] == ["thru_hole", "thru_hole"]
    assert kinds_of["one layer"] == kinds_of["three layers"] == ["smd", "thru_hole"]


def test_footprint_courtyard_surrounds_all_copper(layout):
    text = coil_footprints(layout)["coil-C1"]
    x0, y0, x1, y1 = map(float, re.search(r"fp_rect \(start (\S+) (\S+?)\) \(end (\S+) (\S+?)\)", text).groups())
    for x, y in re.findall(r"fp_(?:line|arc) \(start (\S+) (\S+?)\)", text) + re.findall(r"\(at (\S+) (\S+?)\)", text):
        assert x0 < float(x) < x1
        assert y0 < float(y) < y1 or abs(float(y)) > max(-y0, y1)  # the texts stand above and below


def test_coil_without_closed_circuit_has_no_footprint():
    board = layouts.two_coils()
    first, second = board.coils
    assert list(coil_footprints(replace(board, coils=(replace(first, is_closed_circuit=False), second)))) == ["coil-C2"]
    names = [name for name in kicad.render(board) if name.endswith(".kicad_mod")]
    assert names == [f"kicad/two-coils.pretty/{name}.kicad_mod" for name in ("contacts", "coil-C1", "coil-C2")]
    assert all(piece.role in (Role.WINDING, Role.STUB) for piece in winding(first) if isinstance(piece, Trace))


@pytest.mark.few(2)
@needs_kicad
@pytest.mark.slow
def test_rule_check_of_template_coil_footprints_finds_no_violation(template, tmp_path):
    layout = lay_out(load(str(template)))
    layout = replace(layout, spec=replace(layout.spec, name="library"))
    for coil in layout.coils:
        turned = replace(layout, coils=(coil,))
        assert rule_check(write(own_board(turned, f"coil-{coil.name}"), tmp_path)) == ([], [])
