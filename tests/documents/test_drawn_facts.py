"""What the papers of one board say and show: one figure a fact, dimensions that are true of the copper and the outline,
bends as lines, and all copper of the contacts.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise

import pytest
from legibility import assert_legible
from one_rule import findings_of
from tolerance import approx

from sitscad.assembly.places.jaws import jaw_range
from sitscad.assembly.places.tail_path import pivot_line, stated_bend, stated_bend_range, tail_path
from sitscad.basics.finding import Severity
from sitscad.checks.judging import check
from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.documents.drawings import board_drawing
from sitscad.files.documents.drawings import stackup as stackup_drawing
from sitscad.files.documents.drawings.board_drawing import COPPER, contact_sheet
from sitscad.files.drawing.pictures import layout_picture as board_picture
from sitscad.files.drawing.pictures.layout_picture import coil_extent
from sitscad.files.drawing.sheet import Label, Shape, text_width
from sitscad.files.formats.kicad import project_files as kicad_board
from sitscad.files.order_facts.board_end import bare_size, board_end, end_tolerance, tail_width
from sitscad.kernels.geometry.path import Line, Point, bounding_box
from sitscad.layout import lay_out
from sitscad.layout.bending import Where, bend_length, bend_stretch, finished_thickness, tail_thickness
from sitscad.spec import templates
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError

COIL = (
    "{{shape: {shape}, outer_diameter: {size}, turns: {turns}, layers: 2, trace_width: 0.1, trace_spacing: 0.1{more}}}"
)
BOARDS = {
    "straight": ("circle", 7, "{length: 30, layers: 2}", "line, count: 2, pitch: 8", ""),
    "three coils": ("circle", 7, "{length: 30, layers: 2}", "triangle, pitch: 9", ""),
    "fine": ("racetrack", "[9, 5]", "{length: 30, connector: zif-0.3mm, layers: 2}", "line, count: 3, pitch: 10", ""),
    "left": ("square", 6, "{length: 30, layers: 2, turn: left}", "line, count: 2, pitch: 8", ""),
    "right": ("hexagon", 6, "{length: 30, layers: 2, turn: right}", "line, count: 2, pitch: 8", ""),
    "aside": ("octagon", 6, "{length: 40, layers: 2, offset: -5}", "line, count: 2, pitch: 8", ""),
    "capacitors": ("circle", 8, "{length: 30, layers: 2}", "grid, count: [2, 2], pitch: 10", "chip-0603"),
    "capacitors, right": (
        "circle",
        8,
        "{length: 30, layers: 2, turn: right}",
        "line, count: 2, pitch: 10",
        "chip-0402",
    ),
    "wires": ("circle", 8, "{length: 20, connector: solder-pads, layers: 2}", "line, count: 2, pitch: 10", ""),
    "no tail": ("circle", 8, "", "line, count: 2, pitch: 10", ""),
}


@cache
def board_of(name):
    shape, size, tail, array, chip = BOARDS[name]
    coil = COIL.format(shape=shape, size=size, turns=6, more="")
    text = f"sitscad: 1\nname: facts\ncoil: {coil}\narray: {{pattern: {array}}}\n"
    text += f"fpc: {{tail: {tail}}}\n" if tail else ""
    text += f"readout: {{capacitors_on_board: {chip}}}\n" if chip else ""
    layout = lay_out(load_text(text))
    assert not layout.shortfalls
    return layout


@pytest.fixture(params=BOARDS)
def real(request):
    return board_of(request.param)


def words_of(sheet):
    return " ".join(item.text for item in sheet.items if isinstance(item, Label))


def labels_of(sheet):
    return [item.text for item in sheet.items if isinstance(item, Label)]


def test_all_sheets_of_all_boards_are_legible(real):
    stackup = stackup_drawing.stackup_sheet(real, "x")
    for sheet in (board_drawing.board_sheet(real, "x"), contact_sheet(real, "x"), stackup):
        assert_legible(sheet)


# ------------------------------------------------------------------------------------------------ one figure a fact


@pytest.mark.parametrize("connector", ["zif-0.3mm", "zif-0.5mm"])
def test_readme_and_drawings_state_equal_contact_thickness(connector):
    tail = f"{{length: 30, connector: {connector}, layers: 2}}"
    coil = COIL.format(shape="circle", size=7, turns=6, more="")
    layout = lay_out(load_text(f"sitscad: 1\nname: one\ncoil: {coil}\nfpc: {{tail: {tail}}}\n"))
    papers = [
        fabrication_notes.order_readme(layout),
        words_of(board_drawing.board_sheet(layout, "")),
        words_of(stackup_drawing.stackup_sheet(layout, "")),
    ]
    bands = set()
    for paper in papers:
        result = re.findall(
            r"at the contacts ([0-9.]+) um \(([0-9.]+) um to ([0-9.]+) um\), as ", " ".join(paper.split())
        )
        assert result
        bands |= set(result)
        assert not re.search(r"at the contacts [0-9.]+ um \+/-", " ".join(paper.split()))
    plug = layout.spec.fpc.tail.connector
    ((nominal, low, high),) = bands
    assert float(nominal) == approx(plug.insertion_thickness * 1e6, rel=1e-6)
    tolerance = plug.insertion_thickness_tolerance
    assert (float(high) - float(low)) / 2 == approx(tolerance * 1e6, rel=1e-6)
    made = finished_thickness(layout, Where.CONTACT)
    keeps = (
        plug.insertion_thickness - tolerance <= made.minimum and made.maximum <= plug.insertion_thickness + tolerance
    )
    assert all(("closer than generic-flex keeps" in " ".join(paper.split())) is not keeps for paper in papers)


# ------------------------------------------------------------------------------------------------------- dimensions


def test_contact_sheet_dimensions_width_edge_and_end(real):
    labels, end = labels_of(contact_sheet(real, "")), board_end(real.outline, real.pads)
    count, connector = len(real.pads), real.spec.fpc.tail.connector if real.spec.fpc.tail else None
    allowed = end_tolerance(real.spec.fpc)
    assert f"{end.width * 1e3:.2f} +/- {allowed * 1e3:.2f}" in labels
    text = re.search(r"Tail [0-9.]+ mm \+/- ([0-9]+) um wide", words_of(contact_sheet(real, "")))
    assert text is None or float(text[1]) == approx(allowed * 1e6, rel=1e-6)
    bare = bare_size(real.pads, real.top_openings)
    is_plugged = connector is not None and connector.insertion_thickness > 0.0
    assert (
        any(label == f"bare {bare[1] * 1e3:.2f}" for label in labels)
        if is_plugged
        else not [label for label in labels if label.startswith("bare ")]
    )
    assert f"edge to 1: {end.edge * 1e3:.2f}" in labels and f"to end {end.tip * 1e3:.2f}" in labels
    assert any(label.startswith("width ") for label in labels) and any(label.startswith("pitch ") for label in labels)
    if connector is not None and connector.insertion_thickness:
        assert end.width == approx(connector.width(count), abs=2e-6)
        assert end.edge == approx(connector.edge_margin, abs=2e-6)
    assert end.tip == approx(0.2e-3, abs=2e-6)
    assert bool(real.capacitors) == any(label.startswith("Pads of CT1") for label in labels)


def test_board_drawing_dimensions_tail(real):
    labels = labels_of(board_drawing.board_sheet(real, ""))
    result = tail_width(real.body[2], real.outline, real.pads, real.spec.fpc.tail)
    if real.spec.fpc.tail is None:
        assert result is None
        return
    at, low, high = result
    (message,) = (label for label in labels if label.startswith("tail "))
    assert message.startswith(f"tail {board_drawing.mm(high - low)} +/- 0.10")
    # as the contacts' sheet and the readme have it
    at_contacts = re.findall(r"\+/- ([\d.]+) at the contacts", message)
    allowed = f"{end_tolerance(real.spec.fpc) * 1e3:.2f}"
    assert at_contacts == ([] if allowed == "0.10" else [allowed])
    assert real.reach_at(at) == approx((low, high), abs=2e-6)
    assert real.body[2] < at < min(pad.centre.x for pad in real.pads)
    if real.capacitors:
        assert high - low > board_end(real.outline, real.pads).width + 1e-3


TURNED = [
    (shape, turn, corner)
    for shape, corners in {"hexagon": (0, 0.3), "octagon": (0,), "square": (0, 0.4), "rectangle": (0.3,)}.items()
    for turn in (0, 15, 45)
    for corner in corners
] + [("racetrack", 30, 0), ("circle", 30, 0)]


@pytest.mark.parametrize(("shape", "turn", "corner"), TURNED)
def test_rotated_coil_extent_encloses_its_copper(shape, turn, corner):
    size = "[9, 6]" if shape in ("rectangle", "racetrack") else 7
    more = f", corner_radius: {corner}" if corner else ""
    coil = COIL.format(shape=shape, size=size, turns=6, more=more)
    text = f"sitscad: 1\nname: turned\ncoil: {coil}\n"
    text += (
        f"array: {{pattern: explicit, centres: [[-1, 2]], rotations: [{turn} deg]}}\nfpc: {{tail: {{length: 30}}}}\n"
    )
    layout = lay_out(load_text(text))
    (drawn,) = layout.coils
    x0, y0, x1, y1 = bounding_box([winding.path for winding in drawn.windings])
    half, slack = layout.spec.coil.trace_width / 2, layout.spec.coil.pitch / 2 + 0.02e-3
    copper = (x0 - half, y0 - half, x1 + half, y1 + half)
    extent = coil_extent(layout.spec.coil, drawn)
    for inner, outer, sign in zip(copper, extent, (1, 1, -1, -1), strict=True):
        assert -1e-9 <= sign * (inner - outer) <= slack
    labels = labels_of(board_drawing.board_sheet(layout, ""))
    assert {board_drawing.mm(round(extent[side], 7)) for side in (1, 3)} <= set(labels)


# ------------------------------------------------------------------------------------------------------------ copper


def _areas(sheet, colour):
    return [item.paths for item in sheet.items if isinstance(item, Shape) and item.fill == colour and item.pen is None]


def test_contact_sheet_shows_teardrops_and_pads_of_gerber(real):
    sheet = contact_sheet(real, "")
    pads = [(p.centre.x, p.centre.y, *p.size) for p in real.pads]
    low = min(x - w / 2 for x, _, w, _ in pads) - 0.6e-3, min(y - h / 2 for _, y, _, h in pads) - 0.6e-3
    high = max(x + w / 2 for x, _, w, _ in pads) + 0.6e-3, max(y + h / 2 for _, y, _, h in pads) + 0.6e-3

    def near(path):
        x0, y0, x1, y1 = bounding_box([path])
        return x1 > low[0] + 1e-6 and x0 < high[0] - 1e-6 and y1 > low[1] + 1e-6 and y0 < high[1] - 1e-6

    drops = [drop for drop in real.teardrops if drop.layer == 1 and near(drop.outline)]
    holes = [via for via in real.vias if all(
        a - via.pad / 2 < c < b + via.pad / 2 for a, b, c in zip(low, high, via.centre, strict=True)
    )]
    assert drops and len(_areas(sheet, COPPER)) >= len(drops) + len(holes) - 1  # a round pad may only touch the corner


# ------------------------------------------------------------------------------------------------------------- bends

BENT = """\
sitscad: 1
name: bent
coil: {{shape: circle, outer_diameter: 7, turns: 6, layers: 2, trace_width: 0.1, trace_spacing: 0.1}}
fpc: {{tail: {{length: 30, layers: 2, bend: {bend}}}}}
"""


@cache
def bent(bend):
    return lay_out(load_text(BENT.format(bend=bend)))


@pytest.mark.parametrize("bend", ["static", "dynamic"])
def test_default_bend_is_right_angle_down_in_middle(bend):
    layout = bent(bend)
    result, (a, b) = stated_bend(layout), bend_stretch(layout)
    assert result.line == approx((a + b) / 2, rel=1e-6) and result.angle == approx(math.pi / 2, rel=1e-6)
    assert (result.direction, result.is_dynamic) == ("down", bend == "dynamic")
    ratio = layout.spec.fpc.rules.static_bend_ratio[2] if bend == "static" else 40.0
    thickness = tail_thickness(layout.spec.fpc)
    assert result.radius == approx(ratio * thickness, rel=1e-6)
    assert result.end - result.start == approx(math.pi / 2 * (ratio + 0.5) * thickness, rel=1e-6)
    assert any("90 deg down" in default for default in load_text(BENT.format(bend=bend)).source.defaults)


def test_stated_bend_is_drawn_with_its_values():
    layout = bent("{kind: static, at: 12, direction: up, angle: 45 deg, radius: 2}")
    bend, x = stated_bend(layout), layout.body[2] + 12e-3
    assert bend.line == approx(x, rel=1e-6) and bend.radius == approx(2e-3, rel=1e-6)
    assert bend.end - bend.start == approx(math.pi / 4 * (2e-3 + tail_thickness(layout.spec.fpc) / 2), rel=1e-6)
    drawing = board_drawing.board_sheet(layout, "")
    assert "bend 45 deg up, R min 2.00 inside" in labels_of(drawing) and board_drawing.mm(x) in labels_of(drawing)
    message = f"about the line across it at x = {x * 1e3:.4g} mm; inside radius at least 2 mm"
    readme, stackup = fabrication_notes.order_readme(layout), stackup_drawing.stackup_sheet(layout, "")
    for paper in (readme, words_of(drawing), words_of(stackup)):
        assert message in " ".join(paper.split()) and "by 45 deg up (towards the face with the coils)" in " ".join(
            paper.split()
        )
    lines = [item for item in drawing.items if isinstance(item, Shape) and item.pen == board_drawing.BEND_LINE]
    ((path,),) = [item.paths for item in lines]
    assert abs(path.start.x - path.end.x) < 1e-9 and isinstance(path.segments[0], Line)
    assert ">bend 45 deg up<" in board_picture.layout_svg(layout)


@pytest.mark.parametrize("name", ["straight", "fine", "left", "capacitors"])
def test_pitch_label_does_not_overlap_edge_dimension(name):
    """They are as long as two pitches or more, and the edge lies half a millimetre beyond the last contact."""
    layout = board_of(name)
    labels = [item for item in contact_sheet(layout, "").items if isinstance(item, Label)]
    (pitch,) = [item for item in labels if item.text.startswith("pitch ")]
    (edge,) = [item for item in labels if item.text.startswith("edge to 1")]
    if pitch.angle != 90.0:
        assert pitch.angle == edge.angle == 0.0
        return
    assert pitch.anchor == "end" and pitch.at.y < edge.at.y - text_width(edge.text, edge.size) / 2


def test_bend_labels_lie_beside_wide_body():
    """A wide body lies to the left of the line, at the height of the words: they are written in two lines then."""
    text = (
        "sitscad: 1\nname: wide\narray: {pattern: grid, count: [2, 2], pitch: 9}\n"
        "coil: {shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 0.1524, trace_spacing: 0.1524}\n"
        "fpc: {tail: {length: 30}}\n"
    )
    drawing = board_drawing.board_sheet(lay_out(load_text(text)), "")
    colour = board_drawing.BEND_LINE.colour
    ((path,),) = [i.paths for i in drawing.items if isinstance(i, Shape) and i.pen == board_drawing.BEND_LINE]
    labels = [item for item in drawing.items if isinstance(item, Label) and item.colour == colour]
    assert [label.text for label in labels] == ["bend 90 deg down", "R min 1.60 inside"]
    assert all(label.anchor == "start" and label.at.x > path.start.x for label in labels)
    assert labels[0].at.y - labels[1].at.y > labels[0].size


@pytest.mark.parametrize("name", ["skin_strip_6", "skin_grid_3x3"])
def test_labels_of_short_tail_do_not_overlap(name):
    """They lay over each other and over the body's edge."""
    layout = lay_out(load_text(templates.read(name)))
    sheet = board_drawing.board_sheet(layout, "x")
    labels = [item for item in sheet.items if isinstance(item, Label) and item.angle == 0.0
              and re.match("tail |stiffener|bend |R min", item.text)]
    assert len(labels) == 3
    (outline,) = (item.paths[0] for item in sheet.items if isinstance(item, Shape) and item.name == "drawing-outline")
    boxes = []
    for label in labels:
        wide = text_width(label.text, label.size)
        left = label.at.x - {"start": 0.0, "middle": wide / 2.0, "end": wide}[label.anchor]
        boxes.append((left, label.at.y - 0.2 * label.size, left + wide, label.at.y + 0.8 * label.size))
        middle = label.at.y + 0.3 * label.size
        assert all(outline.distance(Point(left + wide * k / 20.0, middle)) > 0.5 * label.size for k in range(21))
    for each, other in combinations(boxes, 2):
        assert each[2] < other[0] or other[2] < each[0] or each[3] < other[1] or other[3] < each[1]


def test_kicad_board_has_bend_line_across_tail():
    layout = bent("{at: 12}")
    rows = re.findall(
        r'\(gr_line \(start (\S+) (\S+)\) \(end (\S+) (\S+)\).*?\(layer "User.2"\)', kicad_board.board_text(layout)
    )
    across = [row for row in rows if row[0] == row[2]]
    longest = max(abs(float(row[1]) - float(row[3])) for row in across)
    low, high = layout.reach_at(stated_bend(layout).line)
    assert longest == approx((high - low) * 1e3 + 2.0, abs=1e-5)
    assert "bend line, static: 90 deg down (away from the face with the coils)" in kicad_board.board_text(layout)


def bend_findings(bend, select="SIT123"):
    spec = load_text(BENT.format(bend=bend))
    return [finding for finding in check(spec, bent(bend)).findings if finding.rule == select]


@pytest.mark.parametrize(
    ("bend", "severity", "said"),
    [
        ("{at: 1}", Severity.ERROR, "reaches"),
        ("{at: 29}", Severity.ERROR, "into vias, contacts, stiffener or the body"),
        ("{radius: 0.5}", Severity.WARNING, "minimum 1.6 mm (10 times the tail's thickness"),
        ("{kind: dynamic, radius: 2}", Severity.WARNING, "40 times the tail's thickness"),
    ],
)
def test_impossible_bend_gives_warning_or_error(bend, severity, said):
    (findings,) = bend_findings(bend)
    assert findings.severity is severity and said in findings.message
    assert findings.key.startswith("fpc.tail.bend.") and findings.line == 4


@pytest.mark.parametrize("at", [1, 29])
def test_bend_positions_in_hint_give_no_finding(at):
    (findings,) = bend_findings(f"{{at: {at}}}")
    low, high = map(float, re.search(r"between ([0-9.]+) mm and ([0-9.]+) mm", findings.hint).groups())
    assert low < high
    for place in (low + 0.02, (low + high) / 2, high - 0.02):
        assert not bend_findings(f"{{at: {place:.3f}}}")


def test_fitting_bend_gives_no_finding():
    assert not bend_findings("{at: 12, radius: 3, angle: 30 deg, direction: up}")
    assert bend_length(bent("{angle: 180 deg}").spec.fpc) == approx(2 * bend_length(bent("static").spec.fpc), rel=1e-6)


@pytest.mark.parametrize(
    ("bend", "said"),
    [
        ("{at: 12, direction: left}", "allowed: down, up"),
        ("{angle: 270 deg}", "at most 180 deg"),
        ("{kind: none}", "allowed: static, dynamic"),
        ("{radius: 1, where: 2}", "radius"),
        ("sideways", "allowed: none, static, dynamic"),
    ],
)
def test_invalid_bend_gives_spec_error(bend, said):
    with pytest.raises(SpecError) as refused:
        load_text(BENT.format(bend=bend))
    (finding,) = refused.value.findings
    assert said in f"{finding.message} {finding.hint}"


def test_bend_radius_beyond_port_gives_finding():
    text = BENT.format(bend="{at: 12, radius: 5}") + "target: {shape: square, size: 4}\n"
    spec = load_text(text + "elastomer: {material: ecoflex-00-50, size: 4, thickness: 1}\nmount: {jaw: generic-5mm}\n")
    layout = replace(bent("{at: 12, radius: 5}"), spec=spec)
    result = findings_of("SIT308", spec, layout)
    (result,) = [f for f in result if f.key == "fpc.tail.bend.radius"]
    assert result.measured == approx(5e-3, rel=1e-9)


def test_board_stations_are_dimensioned_in_order(real):
    """Coordinates below the whole board stand in the order of their places."""
    sheet = board_drawing.board_sheet(real, "")
    texts = [item for item in sheet.items if isinstance(item, Label) and item.angle == 90.0 and item.at.y > 108]
    numbers = sorted((i.at.x, float(i.text)) for i in texts if re.fullmatch(r"-?[0-9.]+", i.text))
    assert all(a[1] < b[1] for a, b in pairwise(numbers))


def test_tail_in_jaw_bends_at_hinge_pivot():
    layout = lay_out(load_text(templates.read("grasper_4layer")))
    pivot = jaw_range(layout.body, layout.spec.mount.jaw)[1] + layout.spec.mount.jaw.hinge
    way = tail_path(layout, layout.spec.fpc.tail.bend_angle)
    along = pivot_line(layout) - layout.body[2]
    assert along > pivot - layout.body[2] and way.at(along).x == approx(pivot, abs=2e-5)
    assert stated_bend(layout).line == approx(pivot_line(layout), rel=1e-6)
    message = "about the line across it at x = 18.23 mm, where the jaw's hinge has its pivot; inside radius"
    drawing = board_drawing.board_sheet(layout, "")
    readme, stackup = fabrication_notes.order_readme(layout), stackup_drawing.stackup_sheet(layout, "")
    for paper in (readme, words_of(drawing), words_of(stackup)):
        assert message in " ".join(paper.split())


def test_bend_beside_pivot_names_both_positions():
    text = templates.read("grasper_4layer").replace("bend: static", "bend: {kind: static, at: 12}")
    layout = lay_out(load_text(text))
    assert stated_bend(layout).line == approx(layout.body[2] + 12e-3, rel=1e-6)
    assert "at x = 16.91 mm (the jaw's hinge has its pivot at x = 18.23 mm); inside" in " ".join(
        fabrication_notes.order_readme(layout).split()
    )


def test_pivot_without_bend_room_leaves_bend_in_middle():
    text = templates.read("grasper_4layer").replace("length: 30", "length: 14")
    layout = lay_out(load_text(text))
    assert stated_bend(layout).line == approx(sum(stated_bend_range(layout)) / 2, rel=1e-6)


def test_default_bend_at_hinge_is_half_jaw_opening():
    """Both jaws open alike, so each by half of the 60 degrees between them; a free tail, or one whose spec says so,
    by what is usual or written.
    """
    jaw = "mount: {kind: grasper-pad, jaw: toothless-5mm, standoff: 0.6}\n"
    for bend, mount, angle in (
        ("static", jaw, 30.0),
        ("static", "", 90.0),
        ("{kind: static}", jaw, 30.0),
        ("{kind: static, angle: 45 deg}", jaw, 45.0),
    ):
        spec = load_text(BENT.format(bend=bend) + mount)
        assert math.degrees(spec.fpc.tail.bend_angle) == approx(angle, rel=1e-6)
        text = any("fpc.tail.bend" in text and f"{angle:g} deg" in text for text in spec.source.defaults)
        assert text == (angle != 45.0)
