"""Laser files: kerf on the right side, equal areas in DXF and SVG by others' readers, named layers, true arcs."""

from __future__ import annotations

import itertools
import math
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import handmade
import layouts
import pytest
from one_rule import findings_of
from tolerance import approx

from sitscad.assembly.places.stack import sheets, shield
from sitscad.files.documents import laser_notes
from sitscad.files.drawing.svg import path_data
from sitscad.files.formats import laser
from sitscad.kernels.geometry.path import Line, Point, bounding_box, closed_polygon, rounded_polygon
from sitscad.layout import lay_out
from sitscad.layout.laser_sheet import (
    COUPON_HOLE,
    COUPON_SIZE,
    LOOKS,
    MARGIN,
    Contour,
    CutLayer,
    is_laser_cut,
    laser_sheets,
)
from sitscad.spec import templates
from sitscad.spec.load import load_text
from sitscad.spec.materials import Conductor, ElastomerMaterial, ElastomerPad, Shield, Target

MM = 1e-3
RUBBER = ElastomerMaterial("ecoflex-00-30", 23e3, 0.2, 1e9, "00-30")
COPPER = Conductor("copper", 58e6)
TEMPLATES = Path(__file__).parents[2] / "templates"
SVG = "{http://www.w3.org/2000/svg}"

SHAPES = [("circle", (4 * MM, 4 * MM)), ("square", (8 * MM, 8 * MM)), ("rectangle", (9 * MM, 5 * MM))]


def layout_with(shape="square", size=(4 * MM, 4 * MM), kerf=0.15 * MM, target_kerf=0.05 * MM, name="two-coils"):
    """The hand-made board with an elastomer and a target of one shape."""
    layout = layouts.two_coils(name=name)
    pad = ElastomerPad(RUBBER, shape, size, 2 * MM, kerf)
    plate = Target(shape, size, 0.2 * MM, COPPER, target_kerf)
    return replace(layout, spec=replace(layout.spec, elastomer=pad, target=plate))


def nominal_area(shape, size) -> float:
    """Area in square millimetres."""
    return math.pi / 4 * size[0] ** 2 * 1e6 if shape == "circle" else size[0] * size[1] * 1e6


# --- the sheet


@pytest.mark.parametrize("kerf", [0.0, 0.15 * MM])
def test_pads_joined_by_webs_are_cut_as_one_piece_with_holes(kerf):
    """Three by two pads of 10 mm, 16 mm apart, webs 2 mm wide: two holes, cut before the piece comes loose."""
    text = (TEMPLATES / "skin_grid_3x3.yaml").read_text().replace("[3, 3]", "[3, 2]").replace(
        "coils: 1 ", "coils: 1\n  web: 2 mm\n").replace("kerf: 0.15", f"kerf: {1e3 * kerf:g}")
    layout = lay_out(load_text(text, "webs.yaml"))
    sheet = laser_sheets(layout)[0]
    holes, coupon_hole = sheet.on(CutLayer.CUT_INNER)[1:], sheet.on(CutLayer.CUT_INNER)[0]
    assert coupon_hole.area == approx((COUPON_HOLE - kerf) ** 2, rel=1e-9) and len(holes) == 2
    hole = (14e-3 - kerf) ** 2 - 4 * (4e-3) ** 2  # from web to web, less the corners of four pads
    assert [item.area for item in holes] == [approx(hole, rel=1e-9)] * 2
    side, gap, web = 10e-3 + kerf, 6e-3 - kerf, 2e-3 + kerf
    assert sheet.cut.area - sum(item.area for item in holes) == approx(6 * side**2 + 7 * gap * web, rel=1e-9)
    assert sheet.size == approx((42e-3, 26e-3), rel=1e-9) and sheet.nest.count == 1
    assert "6 pads of 10 x 10 mm, joined by webs 2 mm wide" in "\n".join(text for _, text in sheet.notes)
    assert laser_sheets(layout)[1].nest.count == 6
    notes = laser_notes.laser_readme(layout.spec, laser_sheets(layout))
    assert "joined by webs 2 mm wide, finished" in notes and "least      2 mm between two cuts" in notes


@pytest.mark.parametrize(("shape", "size"), SHAPES, ids=[name for name, _ in SHAPES])
@pytest.mark.parametrize("kerf", [0.0, 0.15 * MM])
def test_outer_cuts_grow_and_holes_shrink_by_half_kerf(shape, size, kerf):
    sheet = laser_sheets(layout_with(shape, size, kerf))[0]
    grown = (size[0] + kerf, size[1] + kerf)
    assert sheet.cut.area * 1e6 == approx(nominal_area(shape, grown), rel=1e-6)
    if kerf:
        assert sheet.on(CutLayer.REF)[0].area * 1e6 == approx(nominal_area(shape, size), rel=1e-6)
    assert sheet.on(CutLayer.CUT_INNER)[0].area == approx((COUPON_HOLE - kerf) ** 2, rel=1e-6)
    assert sheet.on(CutLayer.CUT_OUTER)[1].area == approx((COUPON_SIZE + kerf) ** 2, rel=1e-6)


@pytest.mark.parametrize(("shape", "size"), SHAPES, ids=[name for name, _ in SHAPES])
def test_part_left_by_beam_of_kerf_width_has_nominal_size(shape, size):
    """A beam as wide as the kerf, run along the contours, leaves exactly the part, and the coupon with its hole."""
    shapely = pytest.importorskip("shapely", reason="shapely is not installed")
    sheet = laser_sheets(layout_with(shape, size))[0]

    def polygon(contour):
        return shapely.Polygon([(p.x * 1e3, p.y * 1e3) for p in contour.path.flattened(1e-8)])

    part, coupon = (polygon(c) for c in sheet.on(CutLayer.CUT_OUTER))
    hole, outline = polygon(sheet.on(CutLayer.CUT_INNER)[0]), polygon(sheet.on(CutLayer.REF)[0])
    beam = shapely.unary_union([p.exterior.buffer(sheet.kerf * 5e2, quad_segs=64) for p in (part, coupon, hole)])
    left = part.difference(beam)
    assert left.symmetric_difference(outline).area < 1e-3 * outline.area
    ring = coupon.difference(hole).difference(beam)
    x0, _, x1, _ = ring.bounds
    assert x1 - x0 == approx(COUPON_SIZE * 1e3, abs=1e-6)
    inner = ring.interiors[0].bounds
    assert inner[2] - inner[0] == approx(COUPON_HOLE * 1e3, abs=1e-6)
    assert left.distance(ring) > 3.0


def test_laser_steps_have_unique_colours_and_sheet_lists_their_order():
    """A driver that sorts by colour keeps the order: what is inside is cut before what sets it free."""
    for field in ("colour", "rgb", "index"):
        assert len({getattr(LOOKS[layer], field) for layer in CutLayer}) == len(CutLayer)
    for sheet in laser_sheets(layout_with()):
        assert [text for _, text in sheet.notes if re.match(r"[0-9]\. ", text)] == [
            "1. black: engrave (layer ENGRAVE)",
            "2. red: cut inside (layer CUT_INNER)",
            "3. magenta: cut outside (layer CUT_OUTER)",
        ]
    plain = laser_sheets(layout_with(kerf=0.0))[0]
    steps = [text[:6] for _, text in plain.notes if re.match(r"[0-9]\. ", text)]
    assert not plain.on(CutLayer.ENGRAVE) and steps == ["1. red", "2. mag"]


def test_laser_pieces_and_marks_are_separate_and_inside_sheet():
    for sheet in laser_sheets(layout_with("rectangle", (15 * MM, 7 * MM))):
        points = [p for contour in sheet.contours for p in contour.path.flattened(1e-6)]
        assert all(0 < p.x < sheet.width and 0 < p.y < sheet.height for p in points)
        coupon, label = sheet.on(CutLayer.CUT_OUTER)[1], sheet.on(CutLayer.ENGRAVE)
        low = min(p.y for p in coupon.path.flattened(1e-6))
        hole = min(p.y for p in sheet.on(CutLayer.CUT_INNER)[0].path.flattened(1e-6))
        assert all(low < p.y < hole for stroke in label for p in stroke.path.flattened(1e-6))


def test_coil_marks_have_pitch_of_coils():
    sheet = laser_sheets(layout_with())[0]
    crosses = [c.path for c in sheet.on(CutLayer.REF)[1:] if c.path.start.y == c.path.end.y]
    arms = {round(path.length * 1e3, 6): [] for path in crosses}
    for path in crosses:
        arms[round(path.length * 1e3, 6)].append(path.segments[0].at(0.5))
    left, right = sorted(arms[1.0])
    assert right.x - left.x == approx(layouts.COIL_PITCH, rel=1e-6)
    assert (left.x + right.x) / 2 == approx(sheet.on(CutLayer.REF)[0].path.segments[0].at(0.5).x, rel=1e-6)


def test_coil_marks_follow_target_offset_and_rotation():
    """Laid on the board with its marks over the coils, the part lies as the spec says."""
    layout = layout_with()
    turned = replace(layout.spec.target, offset=(1 * MM, 0.5 * MM), rotation=math.radians(90.0))
    sheet = laser_sheets(replace(layout, spec=replace(layout.spec, target=turned)))[1]
    crosses = [c.path for c in sheet.on(CutLayer.REF)[1:] if abs(c.path.start.y - c.path.end.y) < 1e-9]
    marks = [p.segments[0].at(0.5) for p in crosses if p.length == approx(1e-3, rel=1e-6)]
    marks.sort(key=lambda mark: mark.y)
    centre = (sheet.on(CutLayer.CUT_OUTER)[0].centre.x, sheet.on(CutLayer.REF)[0].path.start.y + 2 * MM)
    half = layouts.COIL_PITCH / 2
    assert [(m.x - centre[0], m.y - centre[1]) for m in marks] == [
        approx((-0.5 * MM, y), abs=1e-9) for y in sorted((1 * MM + half, 1 * MM - half))
    ]
    assert "centre [1, 0.5] mm from the coils' mean, turned by 90 deg" in [text for _, text in sheet.notes]


def test_laser_sheets_exist_only_for_parts_in_spec():
    layout = layouts.two_coils()
    assert laser_sheets(layout) == () and laser.render_dxf(layout) == {} and laser.render_svg(layout) == {}
    only = replace(layout, spec=replace(layout.spec, target=Target("circle", (4 * MM, 4 * MM), 0.2 * MM, COPPER)))
    assert list(laser.render_dxf(only)) == ["laser/two-coils-target.dxf"]


@pytest.mark.parametrize("kerf", [-0.1 * MM, COUPON_HOLE, 9 * MM, math.nan])
def test_impossible_kerf_is_refused(kerf):
    with pytest.raises(ValueError, match="kerf"):
        laser_sheets(layout_with(kerf=kerf))


def test_part_without_kerf_is_drawn_at_nominal_size_with_note():
    _, target = laser_sheets(layout_with(target_kerf=0.0))
    texts = [text for _, text in target.notes]
    assert "kerf not compensated: drawn at nominal size" in texts
    assert not any("if right" in text or "0 mm added" in text for text in texts)
    assert sum(".kerf = 10 - measured" in text for text in texts) == 1
    assert target.on(CutLayer.ENGRAVE) == ()
    assert len(target.on(CutLayer.CUT_OUTER)) == 2, "the coupon is still cut: it shows what the beam takes"
    marks = target.on(CutLayer.REF)
    assert marks and all(len(mark.path.segments) == 1 for mark in marks), "an outline would lie on the cut"


# --- DXF, read by ezdxf


def dxf_of(layout):
    """Both drawings as ezdxf sees them, with its auditor's verdict."""
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed")
    import io

    for name, content in laser.render_dxf(layout).items():
        document = ezdxf.read(io.StringIO(content.decode("ascii").replace("\r\n", "\n")))
        auditor = document.audit()
        assert not auditor.errors and not auditor.fixes
        yield name, document


def entity_area(entity) -> float:
    """Area in square millimetres of a circle or of a closed polyline with bulges."""
    if entity.dxftype() == "CIRCLE":
        return math.pi * entity.dxf.radius**2
    assert entity.closed
    rows = list(entity.get_points("xyb"))
    total = 0.0
    for (x0, y0, bulge), (x1, y1, _) in pairwise([*rows, rows[0]]):
        chord = math.hypot(x1 - x0, y1 - y0)
        total += (x0 * y1 - x1 * y0) / 2
        if bulge:
            angle = 4 * math.atan(bulge)
            radius = chord / 2 / math.sin(angle / 2)
            total += radius**2 / 2 * (angle - math.sin(angle))
    return abs(total)


@pytest.mark.parametrize(("shape", "size"), SHAPES, ids=[name for name, _ in SHAPES])
def test_dxf_contours_have_intended_areas(shape, size):
    layout = layout_with(shape, size)
    for (_, document), sheet in zip(dxf_of(layout), laser_sheets(layout), strict=True):
        space = document.modelspace()
        for layer in (CutLayer.CUT_INNER, CutLayer.CUT_OUTER):
            result = [entity_area(e) for e in space.query(f'*[layer=="{layer}"]')]
            assert result == approx([c.area * 1e6 for c in sheet.on(layer)], rel=1e-6)
        kind = "CIRCLE" if shape == "circle" else "LWPOLYLINE"
        assert space.query('*[layer=="CUT_OUTER"]').first.dxftype() == kind


def test_dxf_states_millimetres_and_layer_names():
    for _, document in dxf_of(layout_with()):
        assert document.dxfversion == "AC1015"
        assert document.header["$INSUNITS"] == 4 and document.header["$MEASUREMENT"] == 1
        colours = {layer.dxf.name: layer.dxf.color for layer in document.layers}
        assert (colours["CUT_INNER"], colours["CUT_OUTER"]) == (1, 6)
        assert colours["ENGRAVE"] == 7 and colours["REF"] == 8
        assert {e.dxf.layer for e in document.modelspace()} == {str(layer) for layer in CutLayer}


def test_dxf_handles_are_unique():
    for content in laser.render_dxf(layout_with()).values():
        lines = content.decode("ascii").split("\r\n")
        tags = list(zip(lines[::2], lines[1::2], strict=False))
        handles = [value for code, value in tags if int(code) in (5, 105)]
        seed = int(handles.pop(0), 16)
        assert len(handles) == len(set(handles)) and max(int(h, 16) for h in handles) < seed


def test_dxf_rounded_corners_are_bulges():
    """A contour with rounded corners keeps its arcs: no format word for it, but the area is exact."""
    corners = [Point(0, 0), Point(8 * MM, 0), Point(8 * MM, 5 * MM), Point(0, 5 * MM)]
    contour = Contour(CutLayer.CUT_OUTER, rounded_polygon(corners, 1 * MM))
    vertices = list(laser.bulged_vertices(contour.path))
    bulges = [bulge for _, bulge in vertices if bulge]
    assert bulges == approx([math.tan(math.pi / 8)] * 4, rel=1e-6)
    reverse = [bulge for _, bulge in laser.bulged_vertices(contour.path.reversed()) if bulge]
    assert reverse == approx([-math.tan(math.pi / 8)] * 4, rel=1e-6)


@pytest.mark.slow
@pytest.mark.needs("ezdxf")
def test_ezdxf_audit_finds_no_error(tmp_path):
    for name, content in laser.render_dxf(layout_with()).items():
        path = tmp_path / name.rpartition("/")[2]
        path.write_bytes(content)
        command = [sys.executable, "-m", "ezdxf", "audit", path]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert "No errors found." in done.stdout


@pytest.mark.clients("librecad")
@pytest.mark.parametrize("shape", ["circle", "square"])
def test_librecad_prints_dxf_to_pdf(shape, tmp_path):
    name, content = next(iter(laser.render_dxf(layout_with(shape)).items()))
    path, printed = tmp_path / "part.dxf", tmp_path / "part.pdf"
    path.write_bytes(content)
    command = [
        "timeout",
        "30",
        "env",
        "QT_QPA_PLATFORM=offscreen",
        f"XDG_RUNTIME_DIR={tmp_path}",
        "librecad",
        "dxf2pdf",
    ]
    subprocess.run(
        [*command, "-a", "-c", "-k", "-m", "-o", printed, path], capture_output=True, timeout=40, check=False
    )
    assert printed.stat().st_size > 2000, name


# --- SVG, read by svgpathtools


def svg_of(layout):
    """Both drawings as trees."""
    for content in laser.render_svg(layout).values():
        yield ET.fromstring(content)


def drawn(group):
    """The shapes of a layer as svgpathtools paths."""
    tools = pytest.importorskip("svgpathtools", reason="svgpathtools is not installed")
    for element in group:
        if element.tag == f"{SVG}circle":
            cx, cy, r = (float(element.get(key)) for key in ("cx", "cy", "r"))
            yield tools.parse_path(f"M {cx + r} {cy} A {r} {r} 0 0 1 {cx - r} {cy} A {r} {r} 0 0 1 {cx + r} {cy} Z")
        elif element.tag == f"{SVG}path":
            yield tools.parse_path(element.get("d"))


@pytest.mark.parametrize(("shape", "size"), SHAPES, ids=[name for name, _ in SHAPES])
def test_svg_contours_have_intended_areas(shape, size):
    layout = layout_with(shape, size)
    for tree, sheet in zip(svg_of(layout), laser_sheets(layout), strict=True):
        for layer in (CutLayer.CUT_INNER, CutLayer.CUT_OUTER):
            group = next(g for g in tree.iter(f"{SVG}g") if g.get("id") == layer)
            result = [abs(path.area(chord_length=1e-2)) for path in drawn(group)]
            assert result == approx([c.area * 1e6 for c in sheet.on(layer)], rel=1e-5)


def test_svg_is_in_millimetres_with_hairlines_and_colour_per_step():
    for tree, sheet in zip(svg_of(layout_with()), laser_sheets(layout_with()), strict=True):
        assert tree.get("width") == f"{sheet.width * 1e3:.6f}".rstrip("0").rstrip(".") + "mm"
        assert tree.get("viewBox").split()[2:] == [tree.get("width")[:-2], tree.get("height")[:-2]]
        groups = {g.get("id"): g for g in tree.iter(f"{SVG}g") if g.get("id")}
        assert list(groups) == ["ENGRAVE", "CUT_INNER", "CUT_OUTER", "REF"]
        shapes = {name: [e for e in group if e.tag != f"{SVG}text"] for name, group in groups.items()}
        colours = {"CUT_INNER": {"#ff0000"}, "CUT_OUTER": {"#ff00ff"}, "ENGRAVE": {"#000000"}}
        assert {name: {e.get("stroke") for e in shapes[name]} for name in colours} == colours
        drawn_ones = [e for result in shapes.values() for e in result]
        assert all(float(e.get("stroke-width")) <= 0.0254 and e.get("fill") == "none" for e in drawn_ones)
        layers = [g.get("{http://www.inkscape.org/namespaces/inkscape}label") for g in groups.values()]
        assert layers == list(groups)


def test_svg_rounded_corners_are_arcs_of_correct_sense():
    """Rounded corners stay outside the chord when y is turned over: the area is that of the path."""
    tools = pytest.importorskip("svgpathtools", reason="svgpathtools is not installed")
    corners = [Point(1 * MM, 1 * MM), Point(9 * MM, 1 * MM), Point(9 * MM, 6 * MM), Point(1 * MM, 6 * MM)]
    for path in (rounded_polygon(corners, 1 * MM), rounded_polygon(corners, 1 * MM).reversed()):
        data = path_data(path.mapped(lambda p: Point(p.x * 1e3, p.y * 1e3)), 10.0, 6)
        assert data.count("A") == 4
        assert abs(tools.parse_path(data).area(chord_length=1e-2)) == approx(40 - (4 - math.pi), rel=1e-5)


def test_svg_and_dxf_contain_equal_points():
    layout = layout_with("rectangle", (9 * MM, 5 * MM))
    for (_, document), tree, sheet in zip(dxf_of(layout), svg_of(layout), laser_sheets(layout), strict=True):
        group = next(g for g in tree.iter(f"{SVG}g") if g.get("id") == "CUT_OUTER")
        entity = document.modelspace().query('*[layer=="CUT_OUTER"]').first
        path = next(iter(drawn(group)))
        flipped = sorted((round(z.real, 6), round(sheet.height * 1e3 - z.imag, 6)) for z in (s.start for s in path))
        assert flipped == sorted((round(float(x), 6), round(float(y), 6)) for x, y in entity.get_points("xy"))


def test_names_and_notes_are_escaped_in_svg_and_dxf():
    layout = layout_with()
    odd = replace(layout.spec.elastomer, material=replace(RUBBER, name='a<b>&"c" \N{MICRO SIGN}'))
    layout = replace(layout, spec=replace(layout.spec, elastomer=odd))
    texts = [e.text for e in next(svg_of(layout)).iter(f"{SVG}text")]
    assert 'a<b>&"c" \N{MICRO SIGN}' in texts
    _, document = next(dxf_of(layout))
    decode = pytest.importorskip("ezdxf").lldxf.encoding.decode_dxf_unicode
    assert any("\N{MICRO SIGN}" in decode(e.dxf.text) for e in document.modelspace().query("TEXT"))


IN_A_FRESH_PROCESS = """
import hashlib
from test_laser import layout_with
from sitscad.files.formats import laser
for render in (laser.render_dxf, laser.render_svg):
    for name, content in render(layout_with()).items():
        print(name, hashlib.sha256(content).hexdigest())
"""


@pytest.mark.slow
def test_laser_bytes_are_equal_in_every_process():
    here, tests = Path(__file__).parent, Path(__file__).parents[1]
    paths = os.pathsep.join(map(str, (here, tests / "samples", tests / "oracles", tests.parent)))

    def hashes(**environment: str) -> str:
        whole = os.environ | {"PYTHONPATH": paths} | environment
        command = [sys.executable, "-c", IN_A_FRESH_PROCESS]
        return subprocess.run(command, env=whole, capture_output=True, text=True, check=True).stdout

    item = hashes(PYTHONHASHSEED="1", TZ="UTC", LC_ALL="C")
    assert item == hashes(PYTHONHASHSEED="2", TZ="Asia/Kolkata", LC_ALL="de_DE.UTF-8")
    assert item.count("\n") == 4


def test_closed_contours_do_not_repeat_their_first_point():
    path = closed_polygon([Point(0, 0), Point(1 * MM, 0), Point(0, 1 * MM)])
    assert [point for point, _ in laser.bulged_vertices(path)] == [s.start for s in path if isinstance(s, Line)]


def test_forty_boards_are_distributed_over_sheets_of_given_size():
    """Every piece is there, none nearer to another than the gap, and all within the material."""
    import sitscad
    from sitscad.spec import templates

    text = templates.read("grasper_4layer").replace("  margin:", "  boards: 250\n  margin:")
    layout = sitscad.lay_out(sitscad.load_text(text + "cutting: {sheet: [80, 60], gap: 2}\n", "many.yaml"))
    result = [sheet for sheet in laser_sheets(layout) if sheet.part == "elastomer"]
    assert sum(sheet.nest.count * sheet.nest.times for sheet in result) == 250 and len(result) == 2
    for sheet in result:
        *pieces, _ = [bounding_box((each.path,)) for each in sheet.on(CutLayer.CUT_OUTER)]
        assert len(pieces) == sheet.nest.count
        for item, other in itertools.combinations(pieces, 2):
            apart = max(max(item[k], other[k]) - min(item[k + 2], other[k + 2]) for k in (0, 1))
            assert apart >= 2e-3 - 1e-9
        everything = [bounding_box((each.path,)) for each in sheet.on(CutLayer.CUT_OUTER)]
        assert max(box[2] for box in everything) <= 80e-3 - MARGIN + 1e-9
        assert max(box[3] for box in everything) <= 60e-3 - MARGIN + 1e-9
        assert min(min(box[:2]) for box in everything) >= MARGIN - 1e-9
    names = set(laser.render_dxf(layout))
    assert {"laser/grasper-4layer-elastomer.dxf", "laser/grasper-4layer-elastomer-2.dxf"} <= names
    lines = dict(text_lines(result[0]))
    assert any("cut this sheet" in line for line in lines)


def text_lines(sheet):
    return [(text, place) for place, text in sheet.notes]


def test_sheet_smaller_than_one_piece_is_refused():
    import sitscad
    from sitscad.spec import templates

    text = templates.read("grasper_4layer").replace("  margin:", "  boards: 2\n  margin:")
    layout = sitscad.lay_out(sitscad.load_text(text + "cutting: {sheet: [20, 20]}\n", "small.yaml"))
    with pytest.raises(ValueError, match=r"cutting\.sheet"):
        laser_sheets(layout)


@pytest.mark.parametrize(("material", "thickness", "is_soft"), [
    ("copper", 0.2, True), ("copper", 0.3, False), ("aluminium", 0.1, True), ("stainless-304", 0.1, False),
])
def test_scalpel_is_suggested_only_for_thin_soft_metal(material, thickness, is_soft):
    text = f"{{shape: square, size: 4, thickness: {thickness}, material: {material}}}"
    coil = "{shape: circle, outer_diameter: 3.5, turns: 6, layers: 2, trace_width: 0.1, trace_spacing: 0.1}"
    pad = "{material: ecoflex-00-30, shape: square, size: 4, thickness: 1}"
    layout = lay_out(load_text(f"sitscad: 1\nname: cut\ncoil: {coil}\ntarget: {text}\nelastomer: {pad}\n", "c.yaml"))
    message = laser_notes.render(layout)["laser/readme.txt"].decode()
    assert ("with a scalpel" in message.replace("\n", " ")) == is_soft


def test_laser_readme_states_laser_type_per_part():
    import sitscad
    from sitscad.files.documents import laser_notes
    from sitscad.spec import templates

    layout = sitscad.lay_out(sitscad.load_text(templates.read("grasper_4layer"), "one.yaml"))
    message = " ".join(laser_notes.render(layout)["laser/readme.txt"].decode().split())
    assert "CO2 does NOT cut: copper throws back" in message and "CO2 cuts: silicone" in message
    for word in ("Etched", "Punched", "two liquids", "#ff0000 layer CUT_INNER", "Cut the coupon first"):
        assert word in message, word
    assert "rectangle 4.9 x 4.1 mm, finished" in message
    round_target = templates.read("three_axis_grid").replace("shape: square", "shape: circle")
    layout = sitscad.lay_out(sitscad.load_text(round_target, "two.yaml"))
    assert "circle diameter 8 mm, finished" in laser_notes.render(layout)["laser/readme.txt"].decode()


@pytest.mark.parametrize("kerf", [0.0, 0.1 * MM])
def test_shield_sheet_has_width_limited_by_jaw_port(kerf):
    """The size of the body that the parts have, which is narrower than the board; marks lie under the coils."""
    layout = handmade.jaw_sensor(shield=Shield(COPPER, 0.1 * MM, 0.5 * MM, kerf))
    (sheet,) = [sheet for sheet in sheets(layout) if sheet.part == "shield"]
    x0, y0, x1, y1 = bounding_box((shield(layout).outline(),))
    assert sheet.size == approx((x1 - x0, y1 - y0), rel=1e-6) and y1 - y0 < layout.body_size[1]
    assert sheet.cut.area == approx((x1 - x0 + kerf) * (y1 - y0 + kerf), rel=1e-6)
    assert f"laser/{layout.spec.name}-shield.dxf" in laser.render_dxf(layout)
    assert "goes under the board, 0.5 mm below its lower face" in [text for _, text in sheet.notes]
    readme = laser_notes.render(layout)["laser/readme.txt"].decode()
    assert "-shield.dxf" in readme and "ferrite breaks" in readme


def test_shield_larger_than_sheet_yields_finding():
    text = (
        "sitscad: 1\nname: s\ncoil: {shape: circle, outer_diameter: 20, turns: 14, layers: 2, trace_width: 100 um, "
        "trace_spacing: 100 um}\nfpc: {boards: 4}\nshield: {}\ncutting: {sheet: [30, 30]}\n"
    )
    message = findings_of("SIT317", load_text(text, "s.yaml"))
    assert [each.message.startswith("the shield") for each in message] == [True]


def copies(gap, boards=4):
    """Four copies of a pad of 6 mm at a distance from each other."""
    return load_text(
        f"sitscad: 1\nname: s\ncoil: {{shape: circle, outer_diameter: 6, turns: 9, layers: 2, trace_width: 120 um, "
        f"trace_spacing: 120 um}}\nfpc: {{boards: {boards}}}\ncutting: {{gap: {gap}}}\n"
        "elastomer: {material: ecoflex-00-30, shape: square, size: 6, thickness: 2, kerf: 0.15}\n",
        "s.yaml",
    )


@pytest.mark.parametrize(("gap", "boards", "is_found"), [(0, 4, True), (0.15, 4, True), (0.2, 4, False), (0, 1, False)])
def test_copies_with_touching_cuts_yield_finding(gap, boards, is_found):
    """An edge of two copies would be cut twice."""
    said = findings_of("SIT317", copies(gap, boards))
    assert [(each.key, each.measured, each.limit) for each in said] == [("cutting.gap", gap * MM, 0.15 * MM)] * is_found


@pytest.mark.parametrize("kerf", [0.0, 0.1])
def test_laser_readme_states_kerf_of_each_sheet(kerf):
    """It said of every sheet that half a kerf is added, and targets are drawn at nominal size."""
    layout = layout_with(target_kerf=kerf * MM)
    message = " ".join(laser_notes.render(layout)["laser/readme.txt"].decode().split())
    for sheet in laser_sheets(layout):
        grown = sheet.kerf > 0.0
        assert (f"The {sheet.part} is drawn at nominal size" in message) != grown
        assert (f"The {sheet.part} is drawn for a kerf of {1e3 * sheet.kerf:g} mm" in message) == grown
        assert f"write {sheet.part}.kerf = " in message
        assert any("kerf =" in text for _, text in sheet.notes)


@pytest.mark.parametrize(("thickness", "is_cut"), [("0.2 mm", True), ("0.3 mm", False)])
def test_readme_names_no_laser_for_target_too_thick_to_cut(thickness, is_cut):
    spec = load_text(templates.read("bench_7mm"), "t.yaml").replace("target.thickness", thickness)
    layout = lay_out(spec)
    message = laser_notes.render(layout)["laser/readme.txt"].decode()
    assert is_laser_cut(spec.target.material.name, spec.target.thickness) == is_cut
    assert ("none that we know cuts 0.3 mm" in message) != is_cut


def test_laser_readme_states_material_left_between_copies():
    """Not only what is between the two cuts of one: with no gap it said 5.85 mm where one edge is cut twice."""
    for gap, words in (
        ("0", "0 mm between two cuts"),
        ("0.4", "0.25 mm between two cuts; lasers for it need 0.5 mm: TOO NARROW"),
        ("1.5", "1.35 mm between two cuts; lasers for it need 0.5 mm: wide enough"),
    ):
        assert words in laser_notes.render(lay_out(copies(gap)))["laser/readme.txt"].decode()
