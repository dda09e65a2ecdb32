"""The papers and the archive of an order: drawings measured, drill map counted, archive unpacked and compared."""

from __future__ import annotations

import hashlib
import io
import json
import re
import subprocess
import warnings
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace

import layouts
import pytest
from kicad_oracle import needs_kicad, write
from legibility import assert_legible
from tolerance import approx

import sitscad
from sitscad.basics.units import show
from sitscad.files.documents import archive as order_archive
from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.documents.drawings import board_drawing, panel_drawing
from sitscad.files.documents.drawings import stackup as stackup_drawing
from sitscad.files.documents.drawings.board_drawing import contact_sheet
from sitscad.files.drawing import frame as _drawing
from sitscad.files.drawing.sheet import Group, Label, Sheet, text_width
from sitscad.files.drawing.svg import svg
from sitscad.files.formats import gerber
from sitscad.files.formats.kicad import project_files
from sitscad.files.order_facts import notes as _flex_facts
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout import lay_out
from sitscad.layout.bending import Where, finished_thickness
from sitscad.layout.panel import plan
from sitscad.package.contents import incoming_tests
from sitscad.spec import presets
from sitscad.spec.circuit import PanelSpec
from sitscad.spec.load import load_text
from sitscad.spec.profiles import installed_rules
from sitscad.spec.yaml.source import Issue

SVG = "{http://www.w3.org/2000/svg}"
MM = 1e-3


def archive(files: dict[str, bytes]) -> zipfile.ZipFile:
    (path,) = (path for path in files if path.endswith(".zip"))
    return zipfile.ZipFile(io.BytesIO(files[path]))


# --- Drawings


def drawn(items):
    """Items out of their groups."""
    return [each for item in items for each in (drawn(item.items) if isinstance(item, Group) else [item])]


def test_outline_is_drawn_to_scale_of_title_block(board):
    sheet = board_drawing.board_sheet(board, "")
    (scale,) = {item.text for item in sheet.items if isinstance(item, Label) and "(whole)" in item.text}
    factor = float(re.match(r"([0-9.]+):1", scale)[1])
    x0, y0, x1, y1 = bounding_box([board.outline])
    sizes = []
    for item in drawn(sheet.items):
        if not isinstance(item, Label) and item.pen == _drawing.THICK:
            a, b, c, d = bounding_box(item.paths)
            sizes.append((c - a, d - b))
    wanted = ((x1 - x0) / MM * factor, (y1 - y0) / MM * factor)
    assert any(size == approx(wanted, rel=1e-9) for size in sizes)


def test_dimensions_equal_coordinates_of_files(board):
    texts = {item.text for item in board_drawing.board_sheet(board, "").items if isinstance(item, Label)}
    stations = [
        board.body[2],
        *board.bend_zone,
        *(coil.centre.x for coil in board.coils),
        bounding_box([board.outline])[2],
    ]
    assert {_drawing.mm(x) for x in stations} <= texts
    assert any(text.startswith(_drawing.mm(20.4 * MM)) for text in texts), "the length over all"


REAL = {
    "fine contacts": "grid, count: [2, 2], pitch: 6}\nfpc: {tail: {length: 20, connector: zif-0.3mm}}",
    "one coil": "single}\nfpc: {tail: {length: 12, connector: zif-0.5mm}}",
    "a long tail": "line, count: 2, pitch: 5}\nfpc: {tail: {length: 120}}",
    "aside": "line, count: 2, pitch: 5}\nfpc: {tail: {length: 25, offset: 4}}",
    "turned": "line, count: 2, pitch: 5}\nfpc: {tail: {length: 25, turn: right}}",
    "capacitors": "line, count: 2, pitch: 5}\nfpc: {tail: {length: 25}}\nreadout: {capacitors_on_board: chip-0402}",
}


@pytest.mark.parametrize("rest", REAL.values(), ids=REAL)
def test_drawing_of_complete_board_is_legible(rest):
    text = (
        "sitscad: 1\nname: real\ncoil: {shape: circle, outer_diameter: 4, turns: 5, layers: 2, trace_width: 0.1, "
        f"trace_spacing: 0.1}}\narray: {{pattern: {rest}\n"
    )
    layout = lay_out(load_text(text))
    assert not layout.shortfalls
    test_drawings_stay_on_sheet_without_overlapping_texts(layout)


def test_drawings_stay_on_sheet_without_overlapping_texts(board):
    drawn = [board_drawing.board_sheet(board, "x" * 60), stackup_drawing.stackup_sheet(board, "x" * 60)]
    for sheet in (*drawn, *filter(None, [contact_sheet(board, "x" * 60)])):
        assert_legible(sheet)


@pytest.mark.parametrize("rest", REAL.values(), ids=REAL)
def test_detail_scale_is_larger_and_every_contact_is_numbered(rest):
    text = (
        "sitscad: 1\nname: real\ncoil: {shape: circle, outer_diameter: 4, turns: 5, layers: 2, trace_width: 0.1, "
        f"trace_spacing: 0.1}}\narray: {{pattern: {rest}\n"
    )
    layout = lay_out(load_text(text))
    (scales,) = {
        item.text
        for item in board_drawing.board_sheet(layout, "").items
        if isinstance(item, Label) and item.text.endswith("seen from the top")
    }
    whole, detail = (float(number) for number in re.findall(r"([\d.]+):1", scales))
    assert detail > whole
    labels = {item.text for item in contact_sheet(layout, "").items if isinstance(item, Label)}
    used = [pad for pad in layout.pads if not pad.is_unused]
    numbers = {str(pad.number) for pad in layout.pads if pad.is_unused}
    assert {f"{pad.number}: {pad.pin}" for pad in used} | numbers <= labels
    pins = {pad.net: f"IN{order % 4}" for order, net in enumerate(layout.nets) for pad in used if pad.net == net}
    assert {pins[pad.net] + pad.pin[-1] for pad in used} <= labels


SIX = """
sitscad: 1
name: six
coil: {shape: circle, outer_diameter: 10, turns: 13, layers: 2, trace_width: 0.155, trace_spacing: 0.155}
array: {pattern: grid, count: [3, 2], pitch: 11}
fpc: {tail: {length: 40, connector: zif-0.5mm, bend: static, layers: 2}}
"""


def test_board_of_70_mm_is_enlarged_with_contact_numbers_clear_of_dimensions():
    layout = lay_out(load_text(SIX))
    sheet = board_drawing.board_sheet(layout, "", forced=True)
    assert_legible(sheet)
    (block,) = {item.text for item in sheet.items if isinstance(item, Label) and "(whole)" in item.text}
    assert block.startswith("1.5:1 (whole)")
    (twelve,) = (item for item in sheet.items if isinstance(item, Label) and item.text == "12" and item.size == 2.3)
    upright = [x.at.x for x in sheet.items if isinstance(x, Label) and x.angle == 90.0 and "+/-" in x.text]
    assert len(upright) == 1 and upright[0] - 0.7 * _drawing.TEXT > twelve.at.x + text_width("12", 2.3) + 1.0


def test_width_and_length_have_outline_tolerance(board):
    x0, y0, x1, y1 = bounding_box([board.outline])
    texts = [item.text for item in board_drawing.board_sheet(board, "").items if isinstance(item, Label)]
    tolerance = _drawing.mm(board.spec.fpc.rules.outline_tolerance)
    assert {f"{_drawing.mm(side)} +/- {tolerance}" for side in (x1 - x0, y1 - y0)} <= set(texts)


def test_holes_are_drawn_with_symbols_of_table(board):
    """A circle with its tool's symbol, both in the views and in the table."""
    symbols = [
        item
        for item in drawn(board_drawing.board_sheet(board, "").items)
        if not isinstance(item, Label) and item.pen is not None and item.pen.width == 0.13
    ]
    rows = len({round(via.drill, 9) for via in board.vias})
    in_body = sum(via.centre.x <= board.body[2] + 0.05 * (board.body[2] - board.body[0]) for via in board.vias)
    assert board.vias and len(symbols) == len(board.vias) + in_body + rows


def test_holes_in_thin_tail_are_counted_separately():
    """Drawing and readme asked for ten holes through four layers, of which the tail has two."""
    whole = layouts.two_coils(4)
    thin = layouts.thin_tail(whole)
    inside = sum(via.centre.x > thin.body[2] for via in thin.vias)
    assert inside
    message = f"{len(thin.vias) - inside} through all 4 layers, {inside} in the tail through its 2 layers"
    assert message in " ".join(layouts.order_set(thin)["fpc/readme.txt"].decode().split())
    assert any(message in note for note in board_drawing.board_notes(thin))
    assert "finished diameters; through all layers" in layouts.order_set(whole)["fpc/readme.txt"].decode()


def test_plating_is_stated_only_for_boards_with_holes(board):
    six = lay_out(load_text(SIX))
    text = _flex_facts.finish_text(six.pads, six.spec.fpc, bool(six.vias))
    assert "12 um nominal in the holes (copper 1 and 2 once)" in text
    bare = replace(board, vias=())
    assert not bare.vias and "plated" not in _flex_facts.finish_text(bare.pads, bare.spec.fpc, bare.vias)


@pytest.mark.parametrize("turn", ["none", "left"])
def test_contacts_and_stiffener_are_dimensioned_in_sheet_and_readme(turn):
    layout = lay_out(load_text(SIX.replace("layers: 2}}", f"layers: 2, turn: {turn}}}}}")))
    sheet = contact_sheet(layout, "")
    assert_legible(sheet)
    texts = {item.text for item in sheet.items if isinstance(item, Label)}
    assert {"width 0.30", "length 3.45", "pitch 0.50"} <= texts
    words = " ".join(fabrication_notes.order_readme(layout).split())
    for part in (
        "contacts 300 um wide and 3.45 mm long, pitch 500 um, bare over 3.15 mm",
        "5 mm along the tail, 6.5 mm across",
    ):
        assert part in words
        assert any(part in text.lower() or part in text for text in texts)


def test_drawings_of_forced_package_are_stamped(board):
    for stamped in (False, True):
        sheets = [
            board_drawing.board_sheet(board, "x", stamped),
            stackup_drawing.stackup_sheet(board, "x", stamped),
            contact_sheet(board, "x", stamped),
        ]
        for sheet in sheets:
            texts = [item.text for item in sheet.items if isinstance(item, Label)]
            assert texts.count("MADE IN SPITE OF ERRORS, NOT FOR ORDER") == int(stamped)
            assert_legible(sheet)


def test_long_material_names_stay_on_stackup_drawing(board):
    stackup = board.spec.fpc.stackup
    layers = tuple(
        replace(layer, material=layer.material + " of a maker with a long name" * 6) for layer in stackup.layers
    )
    long = replace(stackup, layers=layers, source="a long story without end " * 40 + "x" * 300)
    spec = replace(board.spec, fpc=replace(board.spec.fpc, stackup=long))
    sheet = stackup_drawing.stackup_sheet(replace(board, spec=spec), "")
    for item in sheet.items:
        if isinstance(item, Label) and item.anchor == "start":
            assert item.at.x + text_width(item.text, item.size) < sheet.size[0] - 8.0, item.text
            assert item.at.y > 8.0, item.text
    written = " ".join(item.text for item in sheet.items if isinstance(item, Label))
    assert written.count("a long story without end") == 40


def test_title_block_contains_hash_of_files(board):
    files = layouts.order_set(board)
    named = sorted(path for path in files if path.endswith((".gbr", ".drl")))
    digest = hashlib.sha256(b"".join(files[path] for path in named)).hexdigest()[:16]
    for path in (path for path in files if path.endswith((".pdf", "drawing.svg", "stackup.svg"))):
        assert digest.encode() in files[path], path


@pytest.mark.parametrize("size", [4, 7, 12])
@pytest.mark.parametrize("parts", [(1, 1), (1, 4), (2, 2)])
def test_panel_drawing_is_legible_and_dimensions_every_part(size, parts):
    text = (
        f"sitscad: 1\nname: x\ncoil: {{shape: circle, outer_diameter: {size}, turns: 5, layers: 2, trace_width: 0.1, "
        f"trace_spacing: 0.1}}\narray: {{pattern: line, count: 2, pitch: {size + 1}}}\n"
        f"fpc: {{tail: {{length: 20}}, panel: {{parts: {list(parts)}}}}}\n"
    )
    panel = plan(lay_out(load_text(text)))
    sheet = panel_drawing.panel_sheet(panel, "x" * 60)
    assert_legible(sheet)
    labels = {item.text for item in sheet.items if isinstance(item, Label)}
    assert {_drawing.mm(x) for at in (*panel.parts, *panel.coupons) for x in at} <= labels


@pytest.mark.parametrize("wish", ["none", "always"])
def test_fingerprint_command_in_archive_prints_stated_hash(board, tmp_path, wish):
    """With the shell line of the readme that lies in it, whatever the fabricator's names are."""
    spec = replace(board.spec, fpc=replace(board.spec.fpc, panel=PanelSpec(wish, (1, 2))))
    layout = replace(board, spec=spec)
    files = layouts.order_set(layout, plan(layout))
    archive(files).extractall(tmp_path)
    own = "" if wish == "none" else f"{layout.spec.name}-panel-"
    lines = (tmp_path / f"{own}readme.txt").read_text().splitlines()
    (at,) = (i for i, line in enumerate(lines) if line.endswith("| sha256sum"))
    printed = subprocess.run(["sh", "-c", lines[at]], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert printed.split()[0] == lines[at - 1]
    drawing = "fpc/two-coils-drawing.svg" if wish == "none" else "fpc/panel/two-coils-panel-drawing.svg"
    assert lines[at - 1][:16].encode() in files[drawing]
    if wish == "always":
        single = (tmp_path / "readme.txt").read_text()
        assert "whose files are not in the archive" in " ".join(single.split())
        assert lines[at - 1] not in single and lines[at - 1][:16].encode() not in files["fpc/two-coils-drawing.svg"]


@pytest.mark.parametrize("wish", ["none", "always"])
def test_readme_lists_archive_files_apart_from_other_files(board, wish):
    """An order of panels had "the files above" in its archive, which holds none of the board's images."""
    layout = replace(board, spec=replace(board.spec, fpc=replace(board.spec.fpc, panel=PanelSpec(wish, (1, 2)))))
    sent = archive(layouts.order_set(layout, plan(layout)))
    _, _, listed = sent.read("readme.txt").decode().partition("Files in the archive\n")
    inside, _, after = listed.partition("Files in the package only\n")
    outside, _, _ = after.partition("Fingerprint\n")
    own, others = (set(re.findall(r"^(two-coils\S+)", part, re.M)) for part in (inside, outside))
    panel = {name for name in sent.namelist() if "-panel" in name}
    assert own - panel == set(sent.namelist()) - panel - {"readme.txt"}
    assert not others & set(sent.namelist()) and "two-coils-order.zip" in others
    assert bool(panel) == (wish == "always") == any(name.endswith("Edge_Cuts.gbr") for name in others)


def test_drawing_date_is_stated_only_with_source_date_epoch(board, monkeypatch):
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    assert b"(not stated)" in layouts.order_set(board)["fpc/two-coils-drawing.pdf"]
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert b"(1970-01-02)" in layouts.order_set(board)["fpc/two-coils-drawing.pdf"]


def test_pdf_has_object_table_and_no_identifier(board):
    text = layouts.order_set(board)["fpc/two-coils-stackup.pdf"]
    start = int(re.search(rb"startxref\n(\d+)\n%%EOF", text)[1])
    table = text[start:].split(b"trailer")[0].splitlines()[3:]
    for number, row in enumerate(table, 1):
        assert text[int(row[:10]) :].startswith(b"%d 0 obj" % number)
    assert b"/ID" not in text and b"Date" not in re.sub(rb"\(Date\)", b"", text)


@pytest.mark.slow
@pytest.mark.clients("pdftoppm", "rsvg-convert")
def test_pdf_and_svg_show_equal_picture(tmp_path):
    image = pytest.importorskip("PIL.Image", reason="pillow is not installed")
    chops = pytest.importorskip("PIL.ImageChops", reason="pillow is not installed")
    stat = pytest.importorskip("PIL.ImageStat", reason="pillow is not installed")
    files = layouts.order_set(layouts.two_coils(4))
    for name in ("drawing", "stackup"):
        pdf, svg = tmp_path / f"{name}.pdf", tmp_path / f"{name}.svg"
        pdf.write_bytes(files[f"fpc/two-coils-{name}.pdf"])
        svg.write_bytes(files[f"fpc/two-coils-{name}.svg"])
        subprocess.run(["pdftoppm", "-r", "100", "-png", "-singlefile", pdf, tmp_path / f"{name}-pdf"], check=True)
        command = ["rsvg-convert", "-d", "100", "-p", "100", "-o", tmp_path / f"{name}-svg.png", svg]
        subprocess.run(command, check=True)
        item, other = (image.open(tmp_path / f"{name}-{kind}.png").convert("L") for kind in ("pdf", "svg"))
        assert abs(item.size[0] - other.size[0]) <= 1 and abs(item.size[1] - other.size[1]) <= 1
        size = tuple(map(min, item.size, other.size))
        coarse = size[0] // 8, size[1] // 8  # edges and fonts are drawn a little differently
        item, other = (picture.crop((0, 0, *size)).resize(coarse, image.Resampling.BOX) for picture in (item, other))
        same = stat.Stat(chops.difference(item, other)).mean[0]
        shifted = stat.Stat(chops.difference(item, chops.offset(other, 3, 0))).mean[0]
        assert same < 0.4 * shifted, (name, same, shifted)
        assert stat.Stat(item).mean[0] < 252, "an empty sheet proves nothing"


def test_text_width_equals_helvetica_widths():
    assert text_width("Hello", 10.0) == approx((722 + 556 + 222 + 222 + 556) / 100.0, rel=1e-6)


def test_user_text_is_escaped_in_pdf_and_svg():
    from sitscad.files.drawing.pdf import pdf

    sheet = Sheet("a)b\\c<d>&e")
    sheet.text(10, 10, "a)b\\c<d>&e")
    assert b"(a\\)b\\\\c<d>&e) Tj" in pdf([sheet])
    assert [text.text for text in ET.fromstring(svg(sheet)).iter(f"{SVG}text")] == ["a)b\\c<d>&e"]


# --- Thickness


def test_finished_thickness_has_tolerance_of_its_place(board):
    rules = replace(
        board.spec.fpc.rules,
        thickness_tolerance={1: 20e-6, 2: 30e-6, 3: 60e-6},
        stiffened_tolerance={"polyimide": 40e-6, "fr4": 90e-6},
        sources={"thickness_tolerance_2": "two", "thickness_tolerance_3": "many"},
    )
    board = replace(board, spec=replace(board.spec, fpc=replace(board.spec.fpc, rules=rules)))
    at = {where: finished_thickness(board, where) for where in Where}
    many = board.copper_layers > 2
    spread = {where: (result.maximum - result.minimum) / 2 for where, result in at.items()}
    assert spread[Where.COIL] == approx(60e-6 if many else 30e-6, rel=1e-6)
    assert spread[Where.CONTACT] == approx(40e-6, rel=1e-6)
    assert at[Where.COIL].source == ("many" if many else "two")
    assert at[Where.COIL].nominal == approx(board.spec.fpc.stackup.thickness, rel=1e-6)
    thin = layouts.thin_tail(layouts.two_coils(4))
    thin = replace(thin, spec=replace(thin.spec, fpc=replace(thin.spec.fpc, rules=rules)))
    tail = finished_thickness(thin, Where.TAIL)
    assert (tail.nominal, tail.maximum - tail.nominal) == approx((150e-6, 30e-6), rel=1e-6)


# --- Drill map


def test_drill_map_has_symbol_for_each_hole(board):
    shapes = pytest.importorskip("gerber_shapes", reason="gerbonara and shapely are not installed")
    (text,) = gerber.render_drill_map(board).values()
    file = shapes.read(text)
    assert file.file_attrs[".FileFunction"] == ("Drillmap",)
    arms = [item for item in file.objects if hasattr(item, "x1") and not hasattr(item, "clockwise")]
    for via in board.vias:
        x, y = via.centre.x / MM, via.centre.y / MM
        crossing = [o for o in arms if abs((o.x1 + o.x2) / 2 - x) < 1e-6 and abs((o.y1 + o.y2) / 2 - y) < 1e-6]
        assert len(crossing) == 2
    assert not gerber.render_drill_map(replace(board, vias=()))


# --- The archive


def test_archive_contains_order_files_under_archive_names(board):
    files = layouts.order_set(board)
    sent = archive(files)
    names = set(sent.namelist())
    assert {"two-coils.GTL", "two-coils.GBL", "two-coils.GTS", "two-coils.GBS", "two-coils.GM1"} <= names
    assert ("two-coils.G1" in names) == (board.copper_layers > 2)
    assert {"two-coils-PTH.drl", "two-coils-netlist.d356", "two-coils-drawing.pdf", "readme.txt"} <= names
    job = json.loads(sent.read("two-coils-job.gbrjob"))
    assert {entry["Path"] for entry in job["FilesAttributes"]} <= names
    listed = re.findall(r"^(two-coils\S*\.(?:G\w+|drl|gbr|pdf|d356))  ", sent.read("readme.txt").decode(), re.MULTILINE)
    assert len(listed) >= 8 and set(listed) <= names
    for name in names - {"readme.txt", "two-coils-job.gbrjob"}:
        assert sent.read(name) in files.values(), name
    assert not any(name.endswith((".svg", ".json")) for name in names)


@pytest.mark.parametrize("naming", ["protel", "kicad"])
@pytest.mark.parametrize("is_panel", [False, True], ids=["single", "panel"])
def test_archive_layers_are_recognised_by_file_names(board, naming, is_panel, tmp_path):
    """Files of ours beside the outline, called as mechanical layers, made the outline ambiguous."""
    gerbonara = pytest.importorskip("gerbonara")
    rules = replace(board.spec.fpc.rules, file_naming=naming)
    fpc = replace(board.spec.fpc, rules=rules, panel=PanelSpec("always", (1, 2)) if is_panel else PanelSpec())
    layout = replace(board, spec=replace(board.spec, fpc=fpc))
    (path,) = [name for name in layouts.order_set(layout, plan(layout) if is_panel else None) if name.endswith(".zip")]
    (tmp_path / "order.zip").write_bytes(layouts.order_set(layout, plan(layout) if is_panel else None)[path])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stack = gerbonara.LayerStack.open(tmp_path / "order.zip")
    inner = {(f"inner_{k}", "copper") for k in range(1, board.copper_layers - 1)}
    sides = {(side, what) for side in ("top", "bottom") for what in ("copper", "mask")}
    assert set(stack.graphic_layers) == sides | inner | {("mechanical", "outline")}
    assert len(stack.drill_pth) >= len(board.vias)


def test_kicad_naming_leaves_archive_names_unchanged(board):
    rules = replace(board.spec.fpc.rules, file_naming="kicad")
    board = replace(board, spec=replace(board.spec, fpc=replace(board.spec.fpc, rules=rules)))
    files = layouts.order_set(board)
    for name in archive(files).namelist():
        assert archive(files).read(name) == files[f"fpc/{name}"]


def test_archive_file_list_is_aligned_in_one_column(board):
    lines = archive(layouts.order_set(board)).read("readme.txt").decode().splitlines()
    begin, end = lines.index("Files in the archive"), lines.index("Files in the package only")
    rows = [re.match(r"(\S+)? +", line) for line in lines[begin + 2 : end] if line]
    assert len(rows) > 8 and len({row.end() for row in rows}) == 1


@pytest.mark.parametrize("length", range(40, 60, 3))
def test_file_names_are_not_broken_at_hyphens(length):
    """A broken name cannot be looked for, and is not renamed in the archive."""
    board = layouts.thin_tail(layouts.two_coils(4))
    name = ("a-" * 30)[:length] + "x"
    spec = replace(board.spec, name=name, fpc=replace(board.spec.fpc, panel=PanelSpec("always", (1, 2))))
    layout = replace(board, spec=spec)
    for path, content in layouts.order_set(layout, plan(layout)).items():
        if path.endswith("readme.txt"):
            assert not re.search(r"a-$", content.decode(), re.MULTILINE), path


def test_both_readmes_of_forced_order_begin_with_warning(board):
    spec = replace(board.spec, fpc=replace(board.spec.fpc, panel=PanelSpec("always", (1, 2))))
    layout = replace(board, spec=spec)
    made = layouts.order_set(layout, plan(layout), forced="do not order: 2 errors\n")
    readmes = [text.decode() for name, text in made.items() if name.endswith("readme.txt")]
    assert len(readmes) == 2
    for text in readmes:
        assert text.splitlines()[3] == "MADE IN SPITE OF ERRORS, NOT FOR ORDER."


def test_archive_of_forced_order_contains_warning_note(board):
    assert order_archive.NOTE not in archive(layouts.order_set(board)).namelist()
    sent = archive(layouts.order_set(board, forced="do not order: 2 errors\n"))
    assert sent.read(order_archive.NOTE) == b"do not order: 2 errors\n"


def test_archive_entries_are_stored_without_date(board):
    for entry in archive(layouts.order_set(board)).infolist():
        assert entry.compress_type == zipfile.ZIP_STORED and entry.date_time == (1980, 1, 1, 0, 0, 0)
        assert entry.create_system == 3


@needs_kicad
def test_archive_names_end_like_kicad_plots(tmp_path):
    """Copper, openings and outline end as in KiCad's own plots."""
    layout = layouts.two_coils(4)
    board, folder = write(project_files.render(layout), tmp_path), tmp_path / "plots"
    command = ["kicad-cli", "pcb", "export", "gerbers", "-o", f"{folder}/", board]
    assert subprocess.run(command, capture_output=True, timeout=60).returncode == 0
    plots = [path for path in folder.glob("*.g*") if path.suffix != ".gbrjob"]
    theirs = {re.search(r"FileFunction,(\w+,L?\w+)", path.read_text())[1]: path.suffix for path in plots}
    files = layouts.order_set(layout)
    rules = layout.spec.fpc.rules
    named = order_archive.Naming(layout.spec.name, rules.file_naming, layout.copper_layers)
    for path in (path for path in files if path.endswith(("Cu.gbr", "Mask.gbr", "Edge_Cuts.gbr"))):
        function = re.search(rb"FileFunction,(\w+,L?\w+)", files[path])[1].decode()
        ours = order_archive.archive_name(named, path, files[path])
        assert ours.lower().endswith(theirs[function]), function


def test_every_profile_has_supported_file_naming():
    for name in presets.names("rules"):
        assert installed_rules(name).file_naming in ("protel", "kicad")


# --- What the person who orders has to know


def test_order_notes_ask_for_inspection_and_resistance_limits():
    """A short between turns of one coil joins two places of one net."""
    design = sitscad.Design(ordered("rules: generic-fine", 4).spec)
    text = " ".join(fabrication_notes.order_readme(design.layout, None, incoming_tests(design).board).split())
    read = incoming_tests(design).board.metered[0]
    ends = [show(read.direct + side * 3.0 * read.direct_sigma, "ohm", 3) for side in (-1, 1)]
    assert f"{read.coil} {show(read.direct, 'ohm', 3)} ({ends[0]} to {ends[1]})" in text
    assert "copper 2, 3 before lamination, the outer copper before the coverlay is laid" in text
    assert text.count("this governs") == 1 and text.index("this governs") > text.index("at least 8.5 um")
    assert "by 20 %: compensate" in text and "at least 8.5 um" in text
    assert "IPC-6013 class 2, type 3, use A" in text


@pytest.mark.parametrize(("fpc", "layers", "wanted"), [
    ("rules: generic-fine", 2, "type 2, use A"),
    ("rules: generic-fine", 4, "type 3, use A"),
])
def test_order_states_ipc_type_of_board(fpc, layers, wanted):
    assert wanted in " ".join(fabrication_notes.order_readme(ordered(fpc, layers)).split())


def test_job_file_states_issue_and_panel_size(board):
    issue = Issue(revision="B", part_number="A-17", date="2026-11-22")
    spec = replace(board.spec, issue=issue, fpc=replace(board.spec.fpc, panel=PanelSpec("always", (1, 2))))
    layout = replace(board, spec=spec)
    panel = plan(layout)
    sent = archive(layouts.order_set(layout, panel))
    job = json.loads(sent.read("two-coils-panel-job.gbrjob"))
    assert job["Header"]["Comment"] == "Part number A-17, revision B, 2026-11-22"
    size = job["GeneralSpecs"]["Size"]
    assert [size["X"], size["Y"]] == approx([1e3 * side for side in panel.size], rel=1e-9)
    assert {entry["Path"] for entry in job["FilesAttributes"]} <= set(sent.namelist())
    assert "two-coils-job.gbrjob" not in sent.namelist()


def ordered(fpc: str, layers: int = 2):
    coil = f"{{shape: circle, outer_diameter: 6, turns: 9, layers: {layers}, trace_width: 0.1, trace_spacing: 0.1}}"
    text = f"sitscad: 1\nname: ordered\ncoil: {coil}\nfpc: {{tail: {{length: 30, connector: zif-0.5mm}}, {fpc}}}\n"
    return lay_out(load_text(text))


def words(text: str) -> str:
    return " ".join(text.split())


SPLIT = (
    "stackup: [{coverlay: 27.5 um}, {copper: 30 um}, {dielectric: 25 um, material: polyimide}, {copper: 18 um}, "
    "{dielectric: 12.5 um, material: adhesive}, {dielectric: 25 um, material: polyimide}, "
    "{dielectric: 12.5 um, material: adhesive}, {copper: 18 um}, {dielectric: 25 um, material: polyimide}, "
    "{copper: 30 um}, {coverlay: 27.5 um}]"
)


@pytest.mark.parametrize(
    ("fpc", "said"),
    [
        ("stackup: flex-2l-35um", ()),
        (
            "stackup: flex-6l",
            ("copper 2 to 3, 4 to 5", "60 um from copper to copper: 60 um bondply; which sheets and how much adhesive"),
        ),
        (SPLIT, ("copper 2 to 3", "50 um from copper to copper: 12.5 um adhesive, 25 um polyimide, 12.5 um adhesive")),
    ],
)
def test_readme_and_drawing_state_bonding_sheets(fpc, said):
    layout = ordered(fpc)
    readme = words(fabrication_notes.order_readme(layout))
    sheet = stackup_drawing.stackup_sheet(layout, "")
    drawn = words(" ".join(item.text for item in sheet.items if isinstance(item, Label)))
    assert ("from copper to copper" in readme, "from copper to copper" in drawn) == (bool(said), bool(said))
    for text in said:
        assert text in readme and text in drawn
    assert ("is not stated in the stack-up" in readme) is ("flex-6l" in fpc)  # sheets written out are no question


def test_laminated_film_is_listed_with_its_layers():
    film = "coverlay, polyimide-coverlay (12.5 um polyimide + 15 um adhesive)"
    assert words(fabrication_notes.order_readme(ordered("stackup: flex-2l-18um"))).count(film) == 2
    assert "um adhesive)" not in fabrication_notes.order_readme(ordered(SPLIT)).partition("Stiffener")[0]


@pytest.mark.parametrize(
    ("rules", "said"),
    [
        ("hkgalaxy", "outline +/- 100 um (not stated by hkgalaxy: the figure of generic-flex, to be confirmed)"),
        ("osh-park-flex", "outline +/- 50.8 um, layers"),
        ("generic-flex", "outline +/- 100 um, layers"),
        ("{based_on: generic-flex, outline_tolerance: 0.2}", "outline +/- 200 um, layers"),
    ],
)
def test_unstated_tolerance_names_profile_it_comes_from(rules, said):
    layout = ordered(f"rules: {rules}")
    assert said in words(fabrication_notes.order_readme(layout))
    note = next(text for text in board_drawing.board_notes(layout) if "utline" in text)
    assert said.removeprefix("outline ").removesuffix(", layers") in note
    panel = plan(ordered(f"rules: {rules}, panel: {{}}"))
    assert said.removeprefix("outline ").removesuffix(", layers") in words(panel_drawing.panel_readme(panel, None))


def test_single_process_house_gets_questions_instead_of_requirements():
    asked = ("IPC-6013 class 2", "rolled annealed (RA)", "film and adhesive", "100 % continuity", "date code or maker")
    own = "panel: none, boards: 10, rules: osh-park-flex, stackup: flex-2l-osh-park, tail: {length: 30, connector: "
    layout = load_text(
        "sitscad: 1\nname: ordered\ncoil: {shape: circle, outer_diameter: 8, turns: 8, layers: 2, trace_width: 6 mil, "
        f"trace_spacing: 6 mil}}\nfpc: {{{own}solder-pads}}}}\n"
    )
    readme = words(fabrication_notes.order_readme(lay_out(layout)))
    order, _, questions = readme.partition("Questions ---------")
    assert not [text for text in asked if text in order] and "10 boards: order 12, they are sold in mult" in order
    assert "OSH Park makes every board in one way" in questions and "which class of IPC-6013" in questions
    assert "25.4 um solder-mask, solder mask, printed" not in order and "25.4 um solder-mask" in order
    other = words(fabrication_notes.order_readme(ordered("stackup: flex-2l-18um, panel: none, boards: 10")))
    assert not [text for text in asked if text not in other] and "Questions" not in other


@pytest.mark.parametrize(
    ("fpc", "quantity"),
    [
        ("panel: none, boards: 1", "1 board"),
        ("panel: none, boards: 25", "25 boards"),
        ("panel: {parts: [1, 4]}, boards: 8", "8 boards: 2 panels of 4 (8 boards)"),
        ("panel: {parts: [1, 4]}, boards: 9", "9 boards: 3 panels of 4 (12 boards, 3 more than wanted)"),
        ("panel: {parts: [1, 4]}, boards: 1", "1 board: 1 panel of 4 (4 boards, 3 more than wanted)"),
        ("panel: {parts: [1, 4]}", None),
    ],
)
def test_wanted_boards_are_counted_in_panels(fpc, quantity):
    layout = ordered(fpc)
    panel = plan(layout)
    readme = words(fabrication_notes.order_readme(layout, panel))
    assert (f"Quantity {quantity} Delivery" in readme) if quantity else "Quantity" not in readme
    if panel is not None:
        assert (f"Wanted: {quantity}." in words(panel_drawing.panel_readme(panel, None))) is (quantity is not None)
