"""The KiCad project: KiCad's rule check finds nothing, finds what is spoilt, and plots the layout's copper."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import layouts
import pytest
from kicad_oracle import kinds, needs_kicad, plots, rule_check, write
from tolerance import approx

from sitscad.files.formats.kicad import project_files as kicad
from sitscad.files.formats.kicad.sexpr import (
    copper_names,
    curve,
    is_straight,
    layer_table,
    length,
    millimetres,
    quoted,
    stackup_section,
)
from sitscad.kernels.geometry.path import Arc, Line, Point, Region, bounding_box, circle, polyline, rectangle
from sitscad.layout.board import Role, Trace, Via

MM = 1e-3


def board_text(layout) -> str:
    """The board file as text."""
    return kicad.render(layout)[f"kicad/{layout.spec.name}.kicad_pcb"].decode()


# --- KiCad's own judgement


@needs_kicad
@pytest.mark.parametrize(("copper", "tail"), [(2, True), (2, False), (3, True), (4, True)])
def test_kicad_rule_check_finds_no_violation(copper, tail, tmp_path):
    layout = layouts.two_coils(copper, tail)
    if not tail:  # without contacts the leads' ends hang free, so only the coils are left
        layout = replace(layout, traces=tuple(t for t in layout.traces if t.role in (Role.WINDING, Role.STUB)))
        layout = replace(layout, vias=tuple(v for v in layout.vias if v.centre.x < 5 * MM))
    violations, unconnected = rule_check(write(kicad.render(layout), tmp_path))
    stored = [v for v in violations if tail or v["type"] != "track_dangling"]
    assert (stored, unconnected) == ([], [])


def _spoilt_copper(layout):
    """A foreign track across both tracks of C1's tail."""
    cross = Trace(polyline([Point(9 * MM, -1.0 * MM), Point(9 * MM, 1.0 * MM)]), 100e-6, 1, "C2", Role.LEAD)
    return replace(layout, traces=(*layout.traces, cross))


def _without_a_stub(layout):
    return replace(layout, traces=tuple(t for i, t in enumerate(layout.traces) if i != 1))


def _thin_track(layout):
    return replace(layout, traces=(replace(layout.traces[0], width=80e-6), *layout.traces[1:]))


def _small_drill(layout):
    return replace(layout, vias=(replace(layout.vias[0], drill=100e-6), *layout.vias[1:]))


def _thin_ring(layout):
    return replace(layout, vias=(replace(layout.vias[0], pad=300e-6), *layout.vias[1:]))


def _near_the_edge(layout):
    near = polyline([layout.traces[0].path.start, Point(-0.55 * MM, 2.25 * MM)])
    return replace(layout, traces=(*layout.traces, Trace(near, 100e-6, 1, "C1", Role.LEAD)))


def _holes_too_near(layout):
    first = layout.vias[0]
    beside = Via(first.centre.shifted(0.3 * MM, 0.0), first.drill, first.pad, first.net)
    return replace(layout, vias=(*layout.vias, beside))


def _bridged_window(layout):
    """A coverlay window over tracks of two nets, away from the contacts."""
    return replace(layout, top_openings=(Region(rectangle(8.9 * MM, -1.0 * MM, 9.5 * MM, 1.0 * MM)),))


def _open_outline(layout):
    return replace(layout, outline=replace(layout.outline, segments=layout.outline.segments[:-1]))


@needs_kicad
@pytest.mark.parametrize(
    ("spoil", "kind"),
    [
        (_spoilt_copper, {"tracks_crossing", "shorting_items"}),
        (_without_a_stub, {"track_dangling", "unconnected_items"}),
        (_thin_track, {"track_width"}),
        (_small_drill, {"drill_out_of_range"}),
        (_thin_ring, {"annular_width"}),
        (_near_the_edge, {"copper_edge_clearance"}),
        (_holes_too_near, {"hole_to_hole"}),
        (_bridged_window, {"solder_mask_bridge"}),
        (_open_outline, {"invalid_outline"}),
    ],
    ids=lambda value: value.__name__.strip("_") if callable(value) else "",
)
def test_kicad_rule_check_finds_each_injected_fault(spoil, kind, tmp_path):
    """The clean verdict means something: each rule of the design is really armed."""
    assert kinds(write(kicad.render(spoil(layouts.two_coils())), tmp_path)) & kind


@needs_kicad
def test_kicad_applies_rules_file_and_footprint_library(tmp_path):
    layout = layouts.two_coils()
    files = kicad.render(layout)
    rules = f"kicad/{layout.spec.name}.kicad_dru"
    stricter = files[rules].replace(b"(constraint track_width (min 0.1mm))", b"(constraint track_width (min 0.11mm))")
    library = next(name for name in files if name.endswith(".kicad_mod"))
    other = files[library].replace(b"(size 3 0.3)", b"(size 3 0.31)")
    assert stricter != files[rules] and other != files[library]
    board = write(files | {rules: stricter, library: other}, tmp_path)
    assert kinds(board) == {"track_width", "lib_footprint_mismatch"}


@needs_kicad
def test_binding_coil_width_holds_for_windings_only(tmp_path):
    layout = layouts.two_coils()
    rules = replace(layout.spec.fpc.rules, coil_trace_width=150e-6, coil_trace_spacing=150e-6, coil_rule_binding=True)
    spec = replace(layout.spec, fpc=replace(layout.spec.fpc, rules=rules))
    violations, _ = rule_check(write(kicad.render(replace(layout, spec=spec)), tmp_path))
    windings = sum(len(t.path.segments) for t in layout.traces if t.role is Role.WINDING)
    assert len(violations) <= windings
    assert {v["type"] for v in violations} == {"track_width"}
    loose = replace(layout, spec=replace(spec, fpc=replace(spec.fpc, rules=replace(rules, coil_rule_binding=False))))
    assert b"memberOfGroup" not in kicad.render(loose)[f"kicad/{spec.name}.kicad_dru"]


@pytest.mark.few(2)
@pytest.mark.slow
@needs_kicad
@pytest.mark.parametrize("copper", [2, 3, 4])
def test_kicad_plots_match_copper_of_layout(copper, tmp_path):
    shapes = pytest.importorskip("gerber_shapes", reason="gerbonara and shapely are not installed")
    layout = layouts.two_coils(copper)
    files = plots(write(kicad.render(layout), tmp_path))
    for number, name in enumerate(copper_names(copper), 1):
        drawn = shapes.image(shapes.GerberFile.open(files[name.replace(".", "_")]))
        wanted = drawn_copper(layout, number)
        assert drawn.area == approx(wanted.area, rel=1e-5)
        assert drawn.symmetric_difference(wanted).area < 2e-4 * wanted.area
    mask = shapes.image(shapes.GerberFile.open(files["F_Mask"]))
    assert mask.area == approx(layout.top_openings[0].area * 1e6, rel=1e-6)
    assert mask.bounds == approx([v * 1e3 for v in bounding_box([layout.top_openings[0].outline])], abs=1e-6)


def drawn_copper(layout, number):
    """The copper of one layer in square millimetres, straight from the layout."""
    from shapely.geometry import LineString, box
    from shapely.geometry import Point as Spot
    from shapely.ops import unary_union

    parts = [
        LineString([(p.x * 1e3, p.y * 1e3) for p in trace.path.flattened(1e-8)]).buffer(trace.width * 5e2, quad_segs=64)
        for trace in layout.on_layer(number)
    ]
    parts += [Spot(v.centre.x * 1e3, v.centre.y * 1e3).buffer(v.pad * 5e2, quad_segs=64) for v in layout.vias]
    for pad in layout.pads:
        if pad.layer == number:
            (x, y), (w, h) = pad.centre, pad.size
            parts.append(box((x - w / 2) * 1e3, (y - h / 2) * 1e3, (x + w / 2) * 1e3, (y + h / 2) * 1e3))
    return unary_union(parts)


@pytest.mark.slow
@needs_kicad
def test_kicad_drill_file_matches_vias_of_layout(tmp_path):
    gerbonara = pytest.importorskip("gerbonara", reason="gerbonara is not installed")
    layout = layouts.two_coils()
    file = gerbonara.ExcellonFile.open(plots(write(kicad.render(layout), tmp_path))["drill"])
    result = sorted((round(o.x, 4), round(o.y, 4), round(o.aperture.diameter, 4)) for o in file.objects)
    wanted = sorted((round(v.centre.x * 1e3, 4), round(v.centre.y * 1e3, 4), v.drill * 1e3) for v in layout.vias)
    assert result == [approx(hole, abs=2e-3) for hole in wanted]


# --- what the files say


def test_kicad_project_ignores_and_excludes_no_rule(board):
    project = json.loads(kicad.render(board)[f"kicad/{board.spec.name}.kicad_pro"])
    settings = project["board"]["design_settings"]
    assert settings["drc_exclusions"] == []
    assert set(settings["rule_severities"].values()) == {"error", "warning"}
    assert len(settings["rule_severities"]) >= 50


def test_kicad_board_setup_equals_fabricator_rules(board):
    rules = board.spec.fpc.rules
    project = json.loads(kicad.render(board)[f"kicad/{board.spec.name}.kicad_pro"])
    setup = project["board"]["design_settings"]["rules"]
    assert setup["min_clearance"] == approx(rules.trace_spacing * 1e3, rel=1e-6)
    assert setup["min_track_width"] == approx(rules.trace_width * 1e3, rel=1e-6)
    assert setup["min_through_hole_diameter"] == approx(rules.via_drill * 1e3, rel=1e-6)
    assert setup["min_via_annular_width"] == approx(rules.annular_ring * 1e3, rel=1e-6)
    assert setup["min_copper_edge_clearance"] == approx(rules.copper_to_edge * 1e3, rel=1e-6)
    assert setup["min_hole_to_hole"] == approx(rules.hole_to_hole * 1e3, rel=1e-6)
    assert setup["min_hole_clearance"] == approx(rules.drill_to_copper * 1e3, rel=1e-6)
    patterns = project["net_settings"]["netclass_patterns"]
    assert [row["pattern"] for row in patterns] == list(board.nets)


def test_kicad_rules_file_cites_source_and_date_of_each_rule():
    layout = layouts.two_coils()
    rules = replace(layout.spec.fpc.rules, sources={"hole_to_hole": "a page,\n  seen by hand"}, checked_on="2026-11-20")
    spec = replace(layout.spec, fpc=replace(layout.spec.fpc, rules=rules))
    text = kicad.render(replace(layout, spec=spec))[f"kicad/{spec.name}.kicad_dru"].decode()
    assert '# a page, seen by hand\n(rule "hole to hole"\n\t(constraint hole_to_hole (min 0.2mm)))' in text
    assert "seen 2026-11-20" in text


def test_kicad_stackup_thicknesses_sum_to_board_thickness(board):
    text = stackup_section(board.spec.fpc.stackup, "enig")
    total = sum(float(value) for value in re.findall(r"\(thickness ([\d.]+)\)", text))
    assert total == approx(board.spec.fpc.stackup.thickness * 1e3, abs=1e-9)
    assert f"(thickness {length(board.spec.fpc.stackup.thickness)})" in board_text(board)


@pytest.mark.parametrize(
    ("copper", "names", "unused"),
    [
        (1, ["F.Cu", "B.Cu"], "B.Cu"),
        (2, ["F.Cu", "B.Cu"], None),
        (3, ["F.Cu", "In1.Cu", "In2.Cu", "B.Cu"], "In2.Cu"),
        (4, ["F.Cu", "In1.Cu", "In2.Cu", "B.Cu"], None),
    ],
)
def test_kicad_copper_layers_are_listed_from_top_to_bottom(copper, names, unused):
    """KiCad drops inner layers that follow B.Cu in the table from its plots, and refuses an odd number of layers."""
    rows = re.findall(r'"([FIB]\w*\.Cu)" signal(.*)\)', layer_table(copper))
    assert [name for name, _ in rows] == names
    assert [name for name, alias in rows if "unused" in alias] == ([unused] if unused else [])
    text = stackup_section(layouts.stackup(copper), "enig")
    assert re.findall(r'layer "([FIB]\w*\.Cu)"', text) == names
    total = sum(float(value) for value in re.findall(r"\(thickness ([\d.]+)\)", text))
    assert total == approx(layouts.stackup(copper).thickness * 1e3, rel=1e-6)


def test_kicad_pads_have_net_number_and_pin_function(board):
    text = board_text(board)
    for pad in board.pads:
        row = next(line for line in text.splitlines() if f'(pad "{pad.number}" ' in line)
        assert f'"{pad.net}")' in row and f'(pinfunction "{pad.pin}")' in row and '(layers "F.Cu")' in row


def test_kicad_uuids_are_unique_and_repeatable(board):
    result = re.findall(r'\(uuid "([0-9a-f-]{36})"\)', board_text(board))
    assert len(result) == len(set(result)) > 50
    assert all(value[14] == "5" for value in result)
    assert result == re.findall(r'\(uuid "([0-9a-f-]{36})"\)', board_text(board))


def test_parentheses_balance_outside_strings(board):
    for name, content in kicad.render(board).items():
        bare = re.sub(r'"(?:[^"\\]|\\.)*"', "", content.decode())
        bare = "\n".join(line.split("#")[0] for line in bare.splitlines())
        assert name.endswith((".kicad_pro", ".kicad_jobset")) or bare.count("(") == bare.count(")") > 0


@needs_kicad
def test_kicad_jobset_writes_same_plots_as_export_commands(tmp_path):
    layout = layouts.two_coils(4)
    board = write(kicad.render(layout), tmp_path)
    command = ["kicad-cli", "jobset", "run", "--stop-on-error", "-f", board.with_suffix(".kicad_jobset")]
    done = subprocess.run([*command, board.with_suffix(".kicad_pro")], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    exported, stem = plots(board), board.stem
    for layer in ("F_Cu", "In1_Cu", "In2_Cu", "B_Cu", "F_Mask", "B_Mask", "Edge_Cuts"):
        plotted = board.parent / "gerbers" / f"{stem}-{layer}.gbr"
        assert _undated(plotted) == _undated(exported[layer]), layer
    holes = re.findall(r"(?m)^X.*", exported["drill"].read_text())
    drilled = "".join(path.read_text() for path in (board.parent / "gerbers").glob("*.drl"))
    assert sorted(re.findall(r"(?m)^X.*", drilled)) == sorted(holes) != []


def _undated(path):
    return [line for line in path.read_text().splitlines() if "CreationDate" not in line and "Created by" not in line]


def test_contact_on_inner_layer_is_refused():
    layout = layouts.two_coils(4)
    inner = replace(layout, pads=(replace(layout.pads[0], layer=2), *layout.pads[1:]))
    with pytest.raises(ValueError, match=r"In1\.Cu"):
        kicad.render(inner)


def test_mask_opening_with_hole_is_refused():
    layout = layouts.two_coils()
    opening = layout.top_openings[0]
    island = Region(opening.outline, (circle(Point(14 * MM, 0.0), 0.2 * MM),))
    with pytest.raises(ValueError, match="hole"):
        kicad.render(replace(layout, top_openings=(island,)))


# --- where the board lies


def _numbers(text: str, name: str) -> list[tuple[float, ...]]:
    return [tuple(map(float, result.split())) for result in re.findall(rf"\({name} ([-\d. ]+)\)", text)]


def test_kicad_board_is_centred_on_a4_sheet(board):
    text = board_text(board)
    assert '(paper "A4")' in text
    ((ox, oy),) = _numbers(text, "aux_axis_origin")
    assert [(ox, oy)] == _numbers(text, "grid_origin") and ox == int(ox) and oy == int(oy)
    x0, y0, x1, y1 = (value / MM for value in bounding_box([board.outline]))
    assert (ox + (x0 + x1) / 2, oy - (y0 + y1) / 2) == approx((148.5, 105), abs=0.51)
    for name in ("start", "end", "mid", "xy"):
        rows = [line for line in text.splitlines() if "\tfp_" not in line and "(fp_" not in line]
        for x, y, *_ in _numbers("\n".join(rows), name):
            assert 0 < x < 297 and 0 < y < 210


def test_kicad_board_longer_than_a4_gets_custom_sheet():
    layout = layouts.two_coils()
    long = replace(layout, outline=rectangle(-5 * MM, -3 * MM, 600 * MM, 3 * MM))
    text = board_text(long)
    ((width, height),) = [tuple(map(float, size)) for size in re.findall(r'\(paper "User" (\S+) (\S+)\)', text)]
    assert 640 <= width <= 650 and height >= 210
    ((ox, _),) = _numbers(text, "aux_axis_origin")
    assert ox - 5 > 0 and ox + 600 < width


# --- numbers and points


@pytest.mark.parametrize(
    ("nanometres", "text"),
    [
        (0, "0"),
        (100_000, "0.1"),
        (-1, "-0.000001"),
        (35_000_000, "35"),
        (-16_500_000, "-16.5"),
        (1_000_001, "1.000001"),
    ],
)
def test_nanometres_are_written_as_millimetres(nanometres, text):
    assert millimetres(nanometres) == text


def test_lengths_are_rounded_to_kicad_grid():
    assert length(0.1 * MM) == "0.1"
    assert length(27.5e-6) == "0.0275"


def test_quotes_and_backslashes_are_escaped():
    assert quoted('a "b" \\') == '"a \\"b\\" \\\\"'


def _points(text: str) -> dict[str, tuple[float, float]]:
    return {name: (float(x), float(y)) for name, x, y in re.findall(r"\((\w+) (\S+) (\S+)\)", text)}


@pytest.mark.parametrize("arc", layouts.rotated_arcs(), ids=lambda arc: f"{arc.radius * 1e3:.2f} mm")
def test_start_middle_and_end_lie_on_mirrored_arc(arc):
    """KiCad knows an arc by three points: all must stand on the circle, the middle one on the right side."""
    if is_straight(arc):
        assert arc.radius * (1 - math.cos(arc.sweep / 2)) < 1.5e-9
        return
    kind, text = curve(arc)
    assert kind == "arc"
    for x, y in _points(text).values():
        there = Point(x * MM, -y * MM)
        assert there.distance(arc.centre) == approx(arc.radius, abs=1e-9)
        assert arc.distance(there) < 1e-9
    middle = Point(_points(text)["mid"][0] * MM, -_points(text)["mid"][1] * MM)
    assert middle.distance(arc.at(0.5)) < 1e-9


def test_arc_flatter_than_kicad_grid_is_written_as_line():
    flat = Arc(Point(-1e-6, 0.0), Point(1e-6, 0.0), Point(0.0, -1.0), ccw=False)
    assert curve(flat)[0] == "line"
    assert curve(Line(Point(0, 0), Point(1 * MM, 2 * MM))) == ("line", "(start 0 0) (end 1 -2)")


# --- the same bytes everywhere

RENDER = """
import hashlib, layouts
from sitscad.files.formats.kicad import project_files as project
for name, content in sorted(project.render(layouts.two_coils()).items()):
    print(name, hashlib.sha256(content).hexdigest())
"""


def hashes_in_another_process(**environment: str) -> str:
    """What a fresh interpreter renders under other hash seeds, time zones and locales."""
    tests = Path(__file__).parents[1]
    paths = os.pathsep.join([str(tests / "samples"), str(tests.parent)])
    done = subprocess.run(
        [sys.executable, "-c", RENDER],
        env=os.environ | {"PYTHONPATH": paths} | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def test_kicad_bytes_are_equal_in_every_process():
    item = hashes_in_another_process(PYTHONHASHSEED="1", TZ="UTC", LC_ALL="C")
    two = hashes_in_another_process(PYTHONHASHSEED="2", TZ="Asia/Kolkata", LC_ALL="de_DE.UTF-8")
    assert item == two and item.count("\n") == 10
