"""The pieces over the coils, from the top: where they are in the spec's own coordinates, legible, and in the report."""

from __future__ import annotations

import re
from functools import cache

import pytest
from legibility import assert_legible
from tolerance import approx

import sitscad
from sitscad.assembly.places.bodies import plates_of
from sitscad.files.documents.drawings import plan_view
from sitscad.files.documents.drawings import plan_view as assembly_drawing
from sitscad.files.drawing.frame import mm
from sitscad.files.drawing.sheet import Label, Shape
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout import lay_out
from sitscad.spec import templates
from sitscad.spec.load import load_text

COIL = "coil: {shape: circle, outer_diameter: 6, turns: 5, layers: 2, trace_width: 0.1, trace_spacing: 0.1}"
SENSORS = {
    "three axes": "array: {pattern: grid, count: [2, 2], pitch: 8}\ntarget: {size: 9}\nelastomer: {size: 9}",
    "offset and turned": (
        "array: {pattern: triangle, pitch: 8}\n"
        "target: {shape: rectangle, size: [9, 6], offset: [1, -0.5], rotation: 30 deg}\n"
        "elastomer: {size: 10, offset: [0.5, 0.25]}\nencapsulation: {}"
    ),
    "a disc alone": "target: {shape: circle, size: 5}",
    "a pad alone, as large as the board": "array: {pattern: line, count: 3, pitch: 7}\nelastomer: {size: 22}",
    "off the middle": "array: {pattern: explicit, centres: [[3, 2], [10, 2]]}\ntarget: {size: 4}\nelastomer: {size: 5}",
}


@cache
def layout_of(name):
    return lay_out(load_text(f"sitscad: 1\nname: over\n{COIL}\n{SENSORS[name]}\nfpc: {{tail: {{length: 30}}}}\n"))


@pytest.fixture(params=SENSORS)
def sensor(request):
    return layout_of(request.param)


def _scale(sheet):
    words = " ".join(item.text for item in sheet.items if isinstance(item, Label))
    larger, smaller = re.search(r"(\d+(?:\.\d+)?):(\d+(?:\.\d+)?); millimetres", words).groups()
    return float(larger) / float(smaller)


def test_assembly_drawing_is_legible(sensor):
    assert_legible(plan_view.plan_sheet(sensor))


def test_pieces_are_drawn_to_scale_at_their_positions(sensor):
    sheet = plan_view.plan_sheet(sensor)
    scale, pieces = _scale(sheet), plates_of(sensor.spec).all
    ink = {pen: [i.paths[0] for i in sheet.items if isinstance(i, Shape) and i.pen == pen and i.paths[0].is_closed]
           for pen in plan_view.PENS.values()}
    (red,) = [i.paths[0] for i in sheet.items if isinstance(i, Shape) and i.pen and i.pen.colour == "#b00000"][:1]
    x0, y0, x1, y1 = bounding_box([red])
    origin = (x0 + x1) / 2, (y0 + y1) / 2
    for piece in pieces:
        (drawn,) = ink[plan_view.PENS[piece.name]]
        low_x, low_y, high_x, high_y = bounding_box([drawn])
        expected = piece.footprint.box
        result = [(c - o) / scale / 1e3 for c, o in zip((low_x, low_y, high_x, high_y), origin * 2, strict=True)]
        assert result == approx(expected, abs=1e-9)
    assert sum(map(len, ink.values())) == len(pieces)


def test_edges_and_centres_of_pieces_are_dimensioned(sensor):
    sheet = plan_view.plan_sheet(sensor)
    labels = {item.text for item in sheet.items if isinstance(item, Label)}
    words = " ".join(item.text for item in sheet.items if isinstance(item, Label))
    for piece in plates_of(sensor.spec).all:
        assert {mm(round(side, 7)) for side in piece.footprint.box} <= labels
        at = piece.footprint.centre
        assert f"{piece.name.capitalize()}: centre at x = {mm(at.x)}, y = {mm(at.y)}" in words
    for coil in sensor.coils:
        assert {coil.name, mm(coil.centre.x), mm(coil.centre.y)} <= labels


def test_sensor_without_pieces_has_no_assembly_drawing(board):
    assert plan_view.plan_sheet(board) is None and assembly_drawing.assembly_pdf(board, "") == {}


@pytest.mark.parametrize(
    ("mount", "caption"),
    [
        ("mount: {kind: bench-plate}", "The part with the coils, seen from the top, to scale"),
        ("mount: {kind: grasper-pad}", "The part that lies on the jaw, seen from the top, to scale"),
        ("", "The part with the coils, seen from the top, to scale"),
    ],
)
def test_report_shows_assembly_drawing_and_names_jaw_only_if_present(tmp_path, mount, caption):
    text = f"sitscad: 1\nname: over\n{COIL}\ntarget: {{size: 6}}\nelastomer: {{size: 6}}\n{mount}\n"
    built = sitscad.build(load_text(text), tmp_path, ("laser", "report"), force=True)
    page = (built.directory / "report.html").read_text()
    assert caption in page and ("lies on the jaw" in page) == ("lies on the jaw" in caption)
    assert "Elastomer and target over the coils, seen from the top, to scale." in page
    assert (built.directory / "laser" / "over-assembly.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("name", ["skin_strip_6", "skin_grid_3x3"])
def test_pieces_of_cells_are_listed_in_cell_order(name):
    """Pieces ran from 6 down to 1, coils from 1 up."""
    spec = load_text(templates.read(name))
    plates = plates_of(spec)
    message = [*plan_view._notes(spec.assembly.glue_line, spec.encapsulation, plates.lines_below_target, plates.all)]
    for part in ("Target", "Elastomer"):
        numbers = [int(line.split(":")[0].split("-")[1]) for line in message if line.startswith(f"{part}-")]
        assert len(numbers) > 5 and numbers == [*range(1, len(numbers) + 1)]
    first = [line.split("-")[0] for line in message if line.startswith(("Target", "Elastomer"))]
    assert first == sorted(first, reverse=True)
