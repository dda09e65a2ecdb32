"""Gerber X2: parsed back by gerbonara, compared with the layout; drawn by gerbv and pygerber where installed."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import layouts
import pytest
from gerber_shapes import area_of, function_of, image, net_of, read
from shapely.geometry import LineString, Point, box
from shapely.ops import unary_union
from tolerance import approx

from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.formats import gerber, ipc356
from sitscad.kernels.geometry.path import Arc, circle, enclosed_area
from sitscad.kernels.geometry.path import Path as Curve
from sitscad.kernels.geometry.path import Point as Spot
from sitscad.layout.board import Role, Trace

MM = 1e-3


def files_of(board):
    return {path.rpartition("-")[2]: text for path, text in gerber.render(board).items()}


def drawn_copper(board, layer):
    """The copper of a layout's layer made by shapely straight from the layout, in millimetres."""
    shapes = [
        LineString([(p.x / MM, p.y / MM) for p in trace.path.flattened(2e-8)]).buffer(
            trace.width / MM / 2, quad_segs=64
        )
        for trace in board.on_layer(layer)
    ]
    shapes += [Point(v.centre.x / MM, v.centre.y / MM).buffer(v.pad / MM / 2, quad_segs=64) for v in board.vias]
    for pad in (pad for pad in board.pads if pad.layer == layer):
        (x, y), (w, h) = pad.centre, pad.size
        shapes.append(box(*((c / MM) for c in (x - w / 2, y - h / 2, x + w / 2, y + h / 2))))
    return unary_union(shapes)


def test_gerber_set_has_one_file_per_layer(board):
    inner = ["In1_Cu.gbr", "In2_Cu.gbr"] if board.copper_layers == 4 else []
    faces = ["F_Mask.gbr", "B_Mask.gbr", "B_Stiffener.gbr"]
    expected = ["F_Cu.gbr", *inner, "B_Cu.gbr", *faces, "Edge_Cuts.gbr"]
    assert list(gerber.render(board)) == [f"fpc/two-coils-{ending}" for ending in expected]


def test_gerber_files_have_expected_file_attributes(board):
    count = board.copper_layers
    wanted = {
        "F_Cu.gbr": ("Copper", "L1", "Top"),
        "B_Cu.gbr": ("Copper", f"L{count}", "Bot"),
        "F_Mask.gbr": ("Soldermask", "Top"),
        "B_Mask.gbr": ("Soldermask", "Bot"),
        "B_Stiffener.gbr": ("Other", "Stiffener_Bottom"),
        "Edge_Cuts.gbr": ("Profile", "NP"),
    }
    if count == 4:
        wanted |= {"In1_Cu.gbr": ("Copper", "L2", "Inr"), "In2_Cu.gbr": ("Copper", "L3", "Inr")}
    read_back = {name: read(text) for name, text in files_of(board).items()}
    assert {name: file.file_attrs[".FileFunction"] for name, file in read_back.items()} == wanted
    for name, file in read_back.items():
        assert file.file_attrs[".FilePolarity"] == (("Negative",) if "Mask" in name else ("Positive",))
        assert file.file_attrs[".SameCoordinates"] == ("two-coils",)
        assert file.file_attrs[".Part"] == ("Single",)
        assert file.import_settings.number_format == (4, 6)


def test_gerber_copper_area_agrees_with_layout(board):
    for layer, name in ((1, "F_Cu.gbr"), (board.copper_layers, "B_Cu.gbr")):
        expected = drawn_copper(board, layer)
        result = image(read(files_of(board)[name]))
        assert result.area == approx(expected.area, rel=1e-4)
        assert result.symmetric_difference(expected).area < 1e-4 * expected.area


def test_winding_area_equals_length_times_width():
    """A winding alone covers its length times its width and one round end: no reader involved in the expectation."""
    board = layouts.two_coils()
    winding = next(trace for trace in board.traces if trace.role is Role.WINDING)
    alone = replace(board, traces=(winding,), vias=(), pads=())
    length = sum(math.pi * (1.7 - 0.05 - 0.1 * i + 0.0) for i in range(9))
    expected = length * 0.1 + math.pi * 0.05**2
    assert image(read(files_of(alone)["F_Cu.gbr"])).area == approx(expected, rel=1e-4)


def test_gerber_objects_carry_net_and_aperture_function(board):
    for layer, name in ((1, "F_Cu.gbr"), (board.copper_layers, "B_Cu.gbr")):
        objects = read(files_of(board)[name]).objects
        for net in board.nets:
            of_net = [item for item in objects if net_of(item) == net]
            kinds = [function_of(item)[0] for item in of_net]
            assert kinds.count("ViaPad") == sum(via.net == net for via in board.vias)
            assert kinds.count("ConnectorPad") == sum(pad.net == net and pad.layer == layer for pad in board.pads)
            segments = sum(len(trace.path.segments) for trace in board.on_layer(layer) if trace.net == net)
            assert kinds.count("Conductor") == segments


def test_gerber_nets_are_separate_and_match_layout(board):
    objects = read(files_of(board)["F_Cu.gbr"]).objects
    by_net = {net: [item for item in objects if net_of(item) == net] for net in board.nets}
    first, second = (unary_union([area_of(item) for item in by_net[net]]) for net in board.nets)
    assert first.distance(second) > 0.1
    alone = replace(
        board,
        traces=tuple(t for t in board.traces if t.net == "C1"),
        vias=tuple(v for v in board.vias if v.net == "C1"),
        pads=tuple(p for p in board.pads if p.net == "C1"),
    )
    assert first.symmetric_difference(drawn_copper(alone, 1)).area < 1e-4 * first.area


def test_gerber_contacts_carry_component_pin_and_function(board):
    text = files_of(board)["F_Cu.gbr"]
    flashes = [item for item in read(text).objects if ".P" in item.attrs]
    assert sorted(item.attrs[".P"] for item in flashes) == [
        ("J1", str(pad.number), pad.pin) for pad in sorted(board.pads, key=lambda pad: pad.number)
    ]
    for item in flashes:
        pad = board.pads[int(item.attrs[".P"][1]) - 1]
        assert (item.x, item.y) == approx((pad.centre.x / MM, pad.centre.y / MM), abs=1e-6)
        assert (item.aperture.w, item.aperture.h) == approx((3.0, 0.3), rel=1e-6)


def test_solder_pads_have_smd_pad_function():
    board = layouts.two_coils()
    tail = replace(board.spec.fpc.tail, connector=replace(layouts.ZIF, insertion_thickness=0.0))
    board = replace(board, spec=replace(board.spec, fpc=replace(board.spec.fpc, tail=tail)))
    assert b"%TA.AperFunction,SMDPad,CuDef*%" in files_of(board)["F_Cu.gbr"]


def test_mask_openings_and_stiffener_have_expected_areas(board):
    files = files_of(board)
    assert image(read(files["F_Mask.gbr"])).area == approx(3.3 * 2.5, rel=1e-9)
    assert read(files["B_Mask.gbr"]).objects == []
    plate = image(read(files["B_Stiffener.gbr"]))
    assert plate.area == approx(board.stiffener.outline.area * 1e6, rel=1e-4)
    assert len(plate.interiors) == 1


def test_body_layers_file_bounds_layers_missing_in_tail():
    board = layouts.thin_tail(layouts.two_coils(4))
    extent = read(files_of(board)["Body_Layers.gbr"])
    assert extent.file_attrs[".FileFunction"] == ("Other", "Extent_of_L3_to_L4")
    assert image(extent).bounds == approx(tuple(c / MM for c in board.body), rel=1e-6)


def test_gerber_outline_is_closed_and_encloses_board_area(board):
    objects = read(files_of(board)["Edge_Cuts.gbr"]).objects
    assert {function_of(item) for item in objects} == {("Profile",)}
    for here, there in zip(objects, [*objects[1:], objects[0]], strict=True):
        assert here.p2 == there.p1
    doubled = sum(item.x1 * item.y2 - item.x2 * item.y1 for item in objects) / 2
    for item in objects:
        if hasattr(item, "clockwise"):
            radius, sweep = math.dist(item.p1, item.center), item.sweep_angle()
            doubled += (-1 if item.clockwise else 1) * radius**2 / 2 * (sweep - math.sin(sweep))
    assert doubled == approx(enclosed_area(board.outline) * 1e6, rel=1e-6)


def test_side_without_coverlay_has_no_mask_file():
    board = layouts.two_coils()
    stackup = replace(board.spec.fpc.stackup, layers=board.spec.fpc.stackup.layers[:-1])
    board = replace(board, spec=replace(board.spec, fpc=replace(board.spec.fpc, stackup=stackup)), stiffener=None)
    assert list(files_of(board)) == ["F_Cu.gbr", "B_Cu.gbr", "F_Mask.gbr", "Edge_Cuts.gbr"]


# Arcs: what readers see after rounding.


def arcs_in(text: bytes):
    return [item for item in read(text).objects if hasattr(item, "clockwise")]


def drawing(board, *segments):
    """A board whose only copper is the given segments, each a trace of its own."""
    traces = tuple(Trace(Curve((s,)), 1e-4, 1, "C1", Role.LEAD) for s in segments)
    return files_of(replace(board, traces=traces, vias=(), pads=()))["F_Cu.gbr"]


def test_arcs_keep_one_radius_after_rounding():
    """Start and end radius as a reader sees them differ by less than 1 nm (gerbonara's `numeric_error`, in mm)."""
    arcs = arcs_in(drawing(layouts.two_coils(), *layouts.rotated_arcs()))
    assert len(arcs) >= len(layouts.rotated_arcs())
    assert max(arc.numeric_error() for arc in arcs) < 1e-6


def test_arcs_keep_their_shape_after_rounding():
    for arc in layouts.rotated_arcs():
        pieces = arcs_in(drawing(layouts.two_coils(), arc))
        assert sum(piece.sweep_angle() for piece in pieces) == approx(abs(arc.sweep), abs=1e-4)
        for piece in pieces:
            assert piece.clockwise == (not arc.ccw)
            assert math.dist(piece.center, (arc.centre.x / MM, arc.centre.y / MM)) < 1e-5
            assert math.dist(piece.p1, piece.center) == approx(arc.radius / MM, abs=1e-5)


def test_no_arc_is_a_full_circle():
    ring = circle(Spot(1e-3, 2e-3), 0.5e-3)
    nearly = Arc(Spot(1e-3, 0.0), Spot(1e-3 * math.cos(-1e-7), 1e-3 * math.sin(-1e-7)), Spot(0.0, 0.0))
    for arcs in (arcs_in(drawing(layouts.two_coils(), *ring)), arcs_in(drawing(layouts.two_coils(), nearly))):
        assert len(arcs) == 2
        assert all(arc.p1 != arc.p2 and arc.sweep_angle() < 1.01 * math.pi for arc in arcs)


def test_arc_shorter_than_grid_is_omitted():
    speck = Arc(Spot(1e-3, 0.0), Spot(1e-3, 1e-10), Spot(0.0, 0.0))
    assert read(drawing(layouts.two_coils(), speck)).objects == []


def test_arc_flatter_than_grid_is_drawn_as_line():
    angle = 1e-6
    flat = Arc(Spot(1.0, 0.0), Spot(math.cos(angle), math.sin(angle)), Spot(0.0, 0.0))
    objects = read(drawing(layouts.two_coils(), flat)).objects
    assert [type(item).__name__ for item in objects] == ["Line"]


def test_gerber_files_avoid_syntax_rejected_by_readers(board):
    for text in gerber.render(board).values():
        lines = text.decode("ascii").splitlines()
        assert lines[-1] == "M02*"
        assert lines.count("G75*") == 1 and "G74*" not in lines
        assert not any(re.match(r"G0?[123]X", line) for line in lines), "mode and coordinates in one command"
        assert all(line.endswith(("*", "*%")) for line in lines)
        assert all(float(size) > 0 for size in re.findall(r"%ADD\d+[CR],([0-9.]+)", text.decode("ascii")))


# Other programs, and the same bytes everywhere.


def write(folder: Path, board) -> list[Path]:
    paths = []
    for render in (gerber.render, gerber.render_drills, ipc356.render, gerber.render_job):
        for path, text in render(board).items():
            file = folder / Path(path).name
            file.write_bytes(text)
            paths.append(file)
    return paths


@pytest.mark.clients("gerbv")
def test_gerbv_renders_each_file_without_warning(board, tmp_path):
    files = [file for file in write(tmp_path, board) if file.suffix in (".gbr", ".drl")]
    for file in files:
        picture = tmp_path / f"{file.stem}.png"
        command = ["gerbv", "-x", "png", "-D", "600", "-a", "-o", picture, file, *tmp_path.glob("*Edge_Cuts.gbr")]
        run = subprocess.run(command, capture_output=True, text=True, timeout=60)
        complaints = [
            line
            for line in run.stderr.splitlines()
            if re.search("CRITICAL|WARNING", line) and not re.search(r"extension found %T[FAOD]%", line)
        ]
        assert complaints == [] and picture.stat().st_size > 100


@pytest.mark.clients
@pytest.mark.needs("pygerber")
def test_pygerber_renders_the_copper_layer(tmp_path):
    write(tmp_path, layouts.two_coils())
    file, picture = tmp_path / "two-coils-F_Cu.gbr", tmp_path / "F_Cu.png"
    command = [sys.executable, "-m", "pygerber", "render", "raster", "-t", "copper", "-d", "100", "-o", picture, file]
    subprocess.run(command, check=True, timeout=120)
    assert picture.stat().st_size > 1000


def test_gerbonara_reads_the_set_as_one_board(board, tmp_path):
    from gerbonara import LayerStack

    write(tmp_path, board)
    stack = LayerStack.open_dir(tmp_path)
    layers = set(stack.graphic_layers)
    assert {("top", "copper"), ("bottom", "copper"), ("top", "mask"), ("mechanical", "outline")} <= layers
    assert len([use for use in layers if use[1] == "copper"]) == board.copper_layers
    assert stack.drill_pth is not None and len(list(stack.drill_pth.drills())) == len(board.vias)


SCRIPT = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
import layouts
total = hashlib.sha256()
for path, text in layouts.order_set(layouts.two_coils(4)).items():
    total.update(path.encode() + text)
print(total.hexdigest())
"""


def digest(**changes: str) -> str:
    environment = {k: v for k, v in os.environ.items() if k != "SOURCE_DATE_EPOCH"} | changes
    here = str(Path(layouts.__file__).parent)
    command = [sys.executable, "-c", SCRIPT, here]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.slow
def test_gerber_bytes_are_equal_in_every_process():
    first = digest(PYTHONHASHSEED="1", TZ="UTC", LC_ALL="C")
    assert first == digest(PYTHONHASHSEED="4242", TZ="Asia/Kolkata", LC_ALL="de_DE.UTF-8")
    assert first != digest(SOURCE_DATE_EPOCH="86400")


def test_creation_date_is_written_only_with_source_date_epoch(monkeypatch):
    board = layouts.two_coils()
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    everything = {
        **gerber.render(board),
        **gerber.render_drills(board),
        **gerber.render_job(board),
        **fabrication_notes.render(board),
    }
    assert not any(b"CreationDate" in text for text in everything.values())
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert read(files_of(board)["F_Cu.gbr"]).file_attrs[".CreationDate"] == ("1970-01-02T00:00:00+00:00",)


@pytest.mark.parametrize("epoch", ["abc", "-5", "99999999999999"])
def test_invalid_source_date_epoch_is_refused_by_name(monkeypatch, epoch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    with pytest.raises(ValueError, match="SOURCE_DATE_EPOCH"):
        gerber.render(layouts.two_coils())
