"""The pictures of the layout, the stack-up drawing and the readme: measured in the SVG itself, drawn by librsvg."""

from __future__ import annotations

import re
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise

import layouts
import pytest
from tolerance import approx

from sitscad.basics.finding import Missing, Shortfall
from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.documents.drawings import board_drawing as board_pictures
from sitscad.files.documents.drawings import stackup as stackup_drawing
from sitscad.files.drawing.pictures import layout_picture as board_legend
from sitscad.files.drawing.pictures import layout_picture as board_picture
from sitscad.files.drawing.sheet import text_width
from sitscad.files.drawing.svg import svg as as_svg
from sitscad.files.formats import gerber, ipc356
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout import lay_out
from sitscad.layout.bending import Where, finished_thickness
from sitscad.spec.circuit import LayerKind
from sitscad.spec.load import load, load_text

SVG = "{http://www.w3.org/2000/svg}"


def drawing(svg: str) -> ET.Element:
    """The inner picture: the drawing to scale."""
    return ET.fromstring(svg).find(f".//{SVG}svg")


def scale_of(svg: str) -> float:
    """User units a millimetre, from the scale bar and what is written beside it."""
    bar = next(path for path in ET.fromstring(svg).iter(f"{SVG}path") if path.get("class") == "scale")
    end = max(float(x) for x in re.findall(r"[ML]([0-9.]+)", bar.get("d")))
    words = [text.text for text in ET.fromstring(svg).iter(f"{SVG}text") if re.fullmatch(r"[0-9.]+ (mm|um)", text.text)]
    number, unit = words[0].split()
    return (end - 20.0) / (float(number) * (1e-3 if unit == "um" else 1.0))


def test_tracks_and_vias_are_drawn_to_scale_of_bar(board):
    for svg in (board_picture.layout_svg(board), board_picture.layout_svg(board, window=board.body)):
        scale = scale_of(svg)
        group = next(g for g in drawing(svg).iter(f"{SVG}g") if g.get("class") == "copper-1")
        nets = [g for g in group if g.get("class", "").startswith("net-")]
        assert [g.get("id") for g in nets] == ["board-copper-1-net-C1", "board-copper-1-net-C2"]
        tracks = [path for g in nets for path in g if path.get("fill") == "none"]
        (width,) = {float(path.get("stroke-width")) for path in tracks}
        assert width == approx(0.1 * scale, abs=0.006)
        radii = sorted({float(circle.get("r")) for circle in drawing(svg).iter(f"{SVG}circle")})
        assert radii == approx([0.075 * scale, 0.175 * scale], abs=0.006)


def test_arcs_are_drawn_as_arcs_in_correct_direction():
    svg = board_picture.layout_svg(layouts.two_coils(), layers=[1])
    spirals = [p.get("d") for p in drawing(svg).iter(f"{SVG}path") if p.get("d").count("A") == 9]
    assert len(spirals) == 2
    first = re.match(r"M([0-9.]+) ([0-9.]+)A([0-9.]+) [0-9.]+ 0 0 0 ([0-9.]+) ([0-9.]+)", spirals[0])
    assert first, "a counter-clockwise half turn is a small arc of sweep 0 where y points down"
    x0, y0, radius, x1, y1 = map(float, first.groups())
    assert x0 - x1 == approx(2 * radius, abs=0.03) and y0 == approx(y1, rel=1e-6)


def test_selected_layers_are_drawn_in_different_colours(board):
    last = board.copper_layers
    everything = board_picture.layout_svg(board)
    only = board_picture.layout_svg(board, layers=[last])
    assert f"class='copper-{last}'" in only and "class='copper-1'" not in only
    assert len({board_legend.COLOURS[i] for i in range(last)}) == last
    assert all(f"class='copper-{i}'" in everything for i in range(1, last + 1))


def test_labels_and_legend_name_visible_parts(board):
    whole, body = board_picture.layout_svg(board), board_picture.layout_svg(board, window=board.body)
    for word in (
        "C1",
        "C2",
        "1: C1.A",
        "4: C2.A",
        "stiffener 200 um",
        "bend 90 deg down",
        "top coverlay open",
        "copper 1",
    ):
        assert f">{word}<" in whole
    assert ">contacts<" not in body and ">bend zone<" not in body


def test_pictures_are_self_contained(board):
    for path, text in layouts.order_set(board).items():
        if path.endswith(".svg"):
            root = ET.fromstring(text)
            assert not [e.tag for e in root.iter() if e.tag.rpartition("}")[2] in ("script", "image", "use", "style")]
            assert b"href" not in text and b"url(" not in text
            names = [e.get("id") for e in root.iter() if e.get("id")]
            assert len(names) == len(set(names))
            assert b"nan" not in text.lower().replace(b"dominant", b"") and b"inf" not in text.lower()


def test_sheets_have_element_ids_for_nets_contacts_and_layers(board):
    """So that a page can point at them, as at the pictures of the board."""
    texts = {path.rpartition("/")[2]: ET.fromstring(text) for path, text in layouts.order_set(board).items()
             if path.endswith(("drawing.svg", "contacts.svg", "stackup.svg"))}
    names = {path: {e.get("id") for e in root.iter()} for path, root in texts.items()}
    whole, contacts, layers = (next(names[path] for path in names if path.endswith(end))
                               for end in ("drawing.svg", "contacts.svg", "stackup.svg"))
    for coil in board.coils:
        assert {
            f"drawing-copper-1-net-{coil.net}",
            f"drawing-coil-{coil.name}",
            f"drawing-body-coil-{coil.name}",
        } <= whole
        assert f"contacts-copper-1-net-{coil.net}" in contacts
    assert {f"contacts-pad-{pad.reference}-{pad.number}" for pad in board.pads} <= contacts
    assert {f"stackup-layer-{k + 1}" for k in range(len(board.spec.fpc.stackup.layers))} <= layers


def test_stackup_name_is_escaped_in_svg():
    board = layouts.two_coils()
    spec = replace(board.spec, fpc=replace(board.spec.fpc, stackup=replace(board.spec.fpc.stackup, name="a<b & c")))
    ET.fromstring(as_svg(stackup_drawing.stackup_sheet(replace(board, spec=spec), "a<b")))


def bars(board) -> list[tuple[float, float]]:
    """Left edge and height (mm on paper) of every bar of the stack-up drawing, from the top of each section."""
    result = []
    for shape in stackup_drawing.stackup_sheet(board, "").items:
        if getattr(shape, "fill", None) in {*stackup_drawing.COLOURS.values(), stackup_drawing.PLATE}:
            x0, y0, _, y1 = bounding_box(shape.paths)
            result.append((x0, y1 - y0))
    return result


def test_stackup_drawing_has_heights_to_scale(board):
    body = [height for x, height in bars(board) if x == stackup_drawing.JOINT]
    layers = board.spec.fpc.stackup.layers
    scale = body[0] / layers[0].thickness
    assert body == approx([layer.thickness * scale for layer in layers], rel=1e-9)
    tail = [height for x, height in bars(board) if x == stackup_drawing.TAIL + stackup_drawing.OPEN]
    assert tail == approx([layer.thickness * scale for layer in layers], rel=1e-9)
    contacts = [height for x, height in bars(board) if x == stackup_drawing.TAIL]
    assert sum(contacts) == approx(finished_thickness(board, Where.CONTACT).nominal * scale, rel=1e-9)
    lower = [each for each in layers[1:] if each.kind is not LayerKind.COPPER]
    assert len(contacts) == 1 + len(lower) + 1  # the contacts' copper, all films below, the stiffener


def test_readme_states_layers_size_thickness_and_holes():
    text = fabrication_notes.order_readme(layouts.two_coils())
    assert "2 copper layers" in text and "20.4 mm x 4.7 mm" in text
    assert "150 um finished, without stiffener" in text
    assert "4 of 150 um (pad 350 um), plated" in text
    assert "DO NOT ORDER" not in text


def test_readme_marks_contact_thickness_out_of_tolerance():
    board = layouts.two_coils()
    assert finished_thickness(board, Where.CONTACT).nominal == approx(287.5e-6, rel=1e-6)
    good = fabrication_notes.order_readme(board)
    assert "gives 287.5 um" in " ".join(good.split()) and "OUT OF TOLERANCE" not in good
    thick = replace(board, stiffener=replace(board.stiffener, thickness=250e-6))
    assert "OUT OF TOLERANCE" in fabrication_notes.order_readme(thick)


def test_readme_states_thinner_tail_of_fewer_layers():
    board = layouts.thin_tail(layouts.two_coils(4))
    assert finished_thickness(board, Where.CONTACT).nominal == approx(287.5e-6, rel=1e-6)
    text = " ".join(fabrication_notes.order_readme(board).split())
    assert "only its first 2 copper layers: copper 3 to 4 and what lies between end there" in text
    assert "the tail is 150 um thick" in text
    assert "only its first" not in fabrication_notes.order_readme(layouts.two_coils(4))
    assert len([x for x, _ in bars(board) if x < stackup_drawing.JOINT]) == 5 + 3 + 1


def test_readme_lists_every_order_file(board):
    text = fabrication_notes.order_readme(board)
    written = (gerber.render, gerber.render_drills, ipc356.render, gerber.render_job, board_pictures.render_pictures)
    for render in written:
        for path in render(board):
            assert f"\n{path.rpartition('/')[2]} " in text


def test_readme_of_incomplete_layout_begins_with_do_not_order():
    lack = Shortfall(Missing.INNER_ROOM, facts=(("count", 1), ("clear", 0.1e-3)))
    text = fabrication_notes.order_readme(replace(layouts.two_coils(), shortfalls=(lack,)))
    assert "DO NOT ORDER" in text.splitlines()[3] and f"\n- {lack.message}" in text


def test_board_without_tail_has_readme_and_picture():
    board = layouts.two_coils(tail=False)
    text = fabrication_notes.order_readme(board)
    assert "Stiffener" not in text and "Bend" not in text
    assert "bend zone" not in board_picture.layout_svg(board)


@pytest.mark.clients("rsvg-convert")
def test_librsvg_renders_pictures(board, tmp_path):
    for path, text in layouts.order_set(board).items():
        if path.endswith(".svg"):
            picture = tmp_path / "picture.png"
            run = subprocess.run(["rsvg-convert", "-o", picture], input=text, capture_output=True, timeout=60)
            assert run.returncode == 0 and run.stderr == b"" and picture.stat().st_size > 5000


def test_marks_are_drawn_at_positions_and_merged_if_close(board):
    """A mark is a ring about its place, one for places that lie together; those outside the window are left out."""
    x0, y0, x1, y1 = board.body
    marks = [
        board_picture.PicturePoint(x0, y0, "1", "warning"),
        board_picture.PicturePoint(x0, y0 + 1e-5, "2", "error"),
        board_picture.PicturePoint(x1, y1, "3", "warning"),
        board_picture.PicturePoint(x1 + 5e-3, 0.0, "4", "note"),
    ]
    text = board_picture.layout_svg(board, window=board.body, marks=marks)
    root = ET.fromstring(text)
    groups = [g for g in root.iter() if g.get("class", "").startswith("mark-")]
    assert [(g.get("class"), next(g.iter(f"{SVG}text")).text) for g in groups] == [
        ("mark-error", "1, 2"),
        ("mark-warning", "3"),
    ]
    ids = [[e.get("id") for e in g.iter() if e.get("id")] for g in groups]
    assert ids == [["board-finding-1", "board-finding-2"], ["board-finding-3"]]
    margin = 0.06 * max(y1 - y0, 0.15 * (x1 - x0))
    scale = board_legend.WIDTH / (x1 - x0 + 2 * margin)
    for group, (x, y) in zip(groups, ((margin, y1 - y0 + margin), (x1 - x0 + margin, margin)), strict=True):
        ring = next(group.iter(f"{SVG}circle"))
        assert (float(ring.get("cx")), float(ring.get("cy"))) == approx((x * scale, y * scale), abs=0.02)
    assert ">error, numbered<" in text and ">note, numbered<" not in text
    assert "mark-" not in board_picture.layout_svg(board)


@pytest.mark.parametrize("tail", ["connector: zif-0.3mm", "connector: zif-0.5mm, length: 200", "turn: left"])
def test_contact_names_do_not_overlap(tail):
    """Eight contacts at a pitch of 0.3 mm, a board so long that they are tiny, and one whose names stand upright."""
    text = (
        "sitscad: 1\nname: fine\ncoil: {shape: circle, outer_diameter: 4, turns: 5, layers: 2, trace_width: 0.1, "
        "trace_spacing: 0.1}\narray: {pattern: grid, count: [2, 2], pitch: 6}\n"
    )
    layout = lay_out(load_text(f"{text}fpc: {{tail: {{{tail}}}}}\n"))
    root = ET.fromstring(board_picture.layout_svg(layout))
    (group,) = [g for g in root.iter(f"{SVG}g") if g.get("id") == "board-contact-names"]
    names = group.findall(f"{SVG}text")
    assert [t.text for t in names] == [f"{p.number}: {p.pin}" if p.pin else f"{p.number}" for p in layout.pads]
    (size,), axis = {float(t.get("font-size")) for t in names}, 0 if "turn" in tail else 1
    places = sorted(float(re.findall(r"[0-9.]+", t.get("transform"))[axis]) for t in names)
    assert min(b - a for a, b in pairwise(places)) > size > 1.0
    assert not any(t.get("stroke-width") for t in names)


@pytest.mark.parametrize("layers", [1, 2, 4, 6])
def test_every_picture_colour_is_in_legend(layers):
    coil = f"{{shape: circle, outer_diameter: 8, turns: 5, layers: {layers}, trace_width: 0.1, trace_spacing: 0.1}}"
    spec = load_text(f"sitscad: 1\nname: colours\ncoil: {coil}\nfpc: {{tail: {{length: 30}}}}\n")
    for svg in (board_picture.layout_svg(lay_out(spec)), board_picture.layout_svg(lay_out(spec), layers=[1])):
        inner = ET.tostring(drawing(svg), encoding="unicode")
        legend = svg[svg.index("</svg>") :]
        colours = set(re.findall(r"(?:fill|stroke)=\"(#[0-9a-f]{6})\"", inner))
        named = set(re.findall(r"(?:fill|stroke)='(#[0-9a-f]{6})'", legend))
        plain = {board_picture.BOARD, board_picture.EDGE, "#000000", "#ffffff"}
        assert colours - plain <= named and len(colours - plain) >= 4
        assert "opacity" not in svg


def test_legend_texts_do_not_overlap_signs(template):
    """Where Helvetica is not installed "bend 48.16 deg down" ran into the sign beside it: letters are a fifth wider."""
    root = ET.fromstring(board_picture.layout_svg(lay_out(load(template))))
    rows = {}
    for text in root.iter(f"{SVG}text"):
        if text.get("text-anchor") == "start" and text.get("font-size") == f"{board_picture.LETTERS:g}":
            x, y = map(float, re.findall(r"[-0-9.]+", text.get("transform")))
            rows.setdefault(y, []).append((x, x + 1.2 * text_width(text.text, board_picture.LETTERS)))
    assert rows
    for row in rows.values():
        assert all(end <= start - board_picture.SIGN for (_, end), (start, _) in pairwise(sorted(row)))
        assert max(end for _, end in row) <= board_picture.WIDTH


def test_metals_have_different_colours():
    from sitscad.files.report.page import section_layers, stack_section_svg
    from sitscad.spec.presets import UNKNOWN_METAL, metal_colour, names

    colours = {name: metal_colour(name) for name in names("conductor")}
    assert len(set(colours.values())) == len(colours)
    assert all(re.fullmatch("#[0-9a-f]{6}", colour) for colour in colours.values())
    coil = "{shape: circle, outer_diameter: 8, turns: 5, layers: 2, trace_width: 0.1, trace_spacing: 0.1}"
    for material, colour in (
        ("aluminium", colours["aluminium"]),
        ("copper", colours["copper"]),
        ("{name: tin, conductivity: 9 MS/m}", UNKNOWN_METAL),
    ):
        text = f"sitscad: 1\nname: metal\ncoil: {coil}\ntarget: {{material: {material}, size: 8}}\n"
        drawn = stack_section_svg(section_layers(load_text(text)))
        assert f"fill='{colour}'" in drawn
        assert (f"fill='{colours['copper']}'" in drawn) == (material == "copper")


def test_jig_piece_label_states_whole_height():
    """The cut shows no pins and no peg, and its labels contradicted the list of pieces (2.24 for 4 mm)."""
    from types import SimpleNamespace

    from sitscad.assembly.places.bodies import BodyRole
    from sitscad.assembly.solids.solid import Solid
    from sitscad.files.drawing.pictures import rendered

    shape = SimpleNamespace(bounding_box=lambda: SimpleNamespace(size=SimpleNamespace(Z=4.04)))
    cut = [[(0.0, -2.24), (1.0, -2.24), (1.0, 0.0), (0.0, 0.0)]]
    sheet = rendered.Sheet("x", unit="", decimals=1, ground=None)
    spec = SimpleNamespace(mount=None, encapsulation=None)
    cuts = [(Solid("jig-base", shape, "resin", "#000000", BodyRole.JIG), cut),
            (Solid("mount", shape, "resin", "#000000", BodyRole.MOUNT), cut)]
    with sheet.group("section"):
        rendered._draw_labels(
            sheet, cuts, spec.encapsulation, spec.mount, lambda y, z: rendered.Point(y, z), 10.0, 10.0)
    (group,) = sheet.items
    texts = {item.text for item in group.items if hasattr(item, "text")}
    assert texts == {"jig-base: resin, 4.04 mm high", "mount: resin, 2.24 mm"}


def test_equal_coordinates_have_one_ordinate():
    """Body and outline, a ten thousandth of a millimetre apart, stood twice at one corner, forked."""
    from sitscad.files.drawing.frame import View, draw_ordinates
    from sitscad.files.drawing.sheet import Sheet
    from sitscad.files.drawing.svg import svg

    sheet = Sheet("t", (100.0, 100.0), unit="", decimals=1)
    draw_ordinates(sheet, View(1.0, (50.0, 50.0)), 0, [-6.1270e-3, -6.12703e-3, 2e-3], 40.0, 30.0)
    assert svg(sheet).count("-6.127") == 1
