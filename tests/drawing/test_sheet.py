"""The drawing vocabulary: names, groups and windows mean the same in SVG and PDF."""

from __future__ import annotations

import math
import re
import subprocess
import xml.etree.ElementTree as ET

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.sheet import Pen, Sheet, flat_items, text_width
from sitscad.files.drawing.svg import path_data, svg
from sitscad.kernels.geometry.path import Arc, Path, Point, circle, closed_polygon, polar, polyline, rectangle

SVG = "{http://www.w3.org/2000/svg}"
RED, BLUE = "#d00000", "#0000d0"


def element(sheet: Sheet, kind: str) -> ET.Element:
    return next(ET.fromstring(svg(sheet)).iter(f"{SVG}{kind}"))


def test_svg_group_is_found_by_its_name():
    sheet = Sheet("names", (40.0, 30.0))
    with sheet.group("net-C1", kind="copper"), sheet.group("it's <odd>"):
        sheet.draw(rectangle(1.0, 1.0, 2.0, 2.0), None, RED, name="pad")
    sheet.text(5.0, 5.0, "beside")
    root = ET.fromstring(svg(sheet))
    named = {e.get("id"): e for e in root.iter() if e.get("id")}
    assert list(named) == ["net-C1", "it's <odd>", "pad"]
    assert named["net-C1"].get("class") == "copper" and named["pad"] in list(named["it's <odd>"])
    assert [type(item).__name__ for item in flat_items(sheet.items)] == ["Shape", "Label"]


def test_exception_in_group_keeps_sheet_usable():
    sheet = Sheet("broken", (10.0, 10.0))
    with pytest.raises(ZeroDivisionError), sheet.group("half"):
        sheet.line(0.0, 0.0, 1.0 / 0.0, 1.0)
    sheet.line(0.0, 0.0, 1.0, 1.0)
    assert len(list(flat_items(sheet.items))) == 1


def test_line_of_zero_length_is_omitted():
    point, line = Point(3.0, 4.0), polyline([Point(1.0, 1.0), Point(2.0, 1.0)])
    for paths in (polyline([point, point]), [polyline([point, point]), line], [closed_polygon([point] * 3)]):
        sheet = Sheet("dots", (40.0, 30.0))
        sheet.draw(paths, Pen(), RED)
        assert element(sheet, "path").get("d") == ("M1 29L2 29" if line in paths else "")
        assert pdf([sheet])


def test_full_circles_are_svg_circles_and_dashed_circles_keep_their_start():
    sheet = Sheet("round", (40.0, 30.0))
    sheet.draw(circle(Point(10.0, 12.0), 3.0), Pen())
    result = element(sheet, "circle")
    assert [result.get(key) for key in ("cx", "cy", "r")] == ["10", "18", "3"]
    dashed = Sheet("round", (40.0, 30.0))
    dashed.draw(circle(Point(10.0, 12.0), 3.0), Pen(dashes=(2.0, 1.0)))
    assert element(dashed, "path").get("d").startswith("M13 18A3 3 0 0 0 7 18")
    half = Sheet("half", (40.0, 30.0))
    half.draw(Path(circle(Point(10.0, 12.0), 3.0).segments[:1]), Pen())
    assert "<circle" not in svg(half)


def test_long_text_line_has_fixed_text_length():
    """In DejaVu, which machines without Arial take, notes ran over a drawing's frame."""
    sheet = Sheet("notes", (140.0, 30.0))
    line = "7. Finish on bare contacts: nickel and immersion gold"
    sheet.text(5.0, 5.0, line, 2.0)
    assert float(element(sheet, "text").get("textLength")) == approx(text_width(line, 2.0), rel=1e-3)


@pytest.mark.slow
@settings(deadline=None)  # the first example imports svgpathtools
@given(st.floats(0.1, 50.0), st.floats(-3.1, 3.1), st.floats(-6.2, 6.2))
def test_svg_arcs_pass_start_middle_and_end(radius, start, sweep):
    """SVG's flags choose the one of four arcs that the path has: its middle lies on the drawn one."""
    tools = pytest.importorskip("svgpathtools", reason="svgpathtools is not installed")
    if abs(sweep) < 0.05 or abs(abs(sweep) - math.pi) < 0.05:
        return
    centre = Point(60.0, 60.0)
    arc = Arc(polar(radius, start, centre), polar(radius, start + sweep, centre), centre, sweep > 0)
    drawn = tools.parse_path(path_data(Path((arc,)), 120.0, 9))
    for fraction in (0.0, 0.5, 1.0):
        at = arc.at(fraction)
        assert abs(drawn.point(fraction) - complex(at.x, 120.0 - at.y)) < 1e-5 * radius + 1e-6


def test_closed_paths_do_not_repeat_their_first_point():
    assert path_data(closed_polygon([Point(0, 0), Point(1, 0), Point(0, 1)]), 1.0, 4) == "M0 1L1 1L0 0Z"
    assert path_data(polyline([Point(0, 0), Point(1, 0)]), 1.0, 4) == "M0 1L1 1"


def busy() -> Sheet:
    """One of everything."""
    sheet = Sheet("busy", (100.0, 80.0))
    with sheet.group("window", (5.0, -4.0), (20.0, 20.0, 60.0, 50.0)):
        sheet.draw(rectangle(0.0, 0.0, 40.0, 40.0), None, RED)
        sheet.draw(circle(Point(55.0, 40.0), 20.0), Pen(2.0, BLUE), "#ffff00")
    sheet.draw(rectangle(50.0, 10.0, 90.0, 60.0), None, BLUE, opacity=0.5)
    sheet.line(70.0, 70.0, 90.0, 70.0, Pen(4.0, RED, round_ends=False, round_corners=False))
    sheet.text(10.0, 70.0, "bold words", 6.0, bold=True)
    sheet.text(30.0, 30.0, "haloed", 8.0, halo=2.0)
    return sheet


@pytest.mark.clients("pdftoppm", "rsvg-convert")
def test_svg_and_pdf_render_groups_windows_halos_and_opacity_equally(tmp_path):
    np = pytest.importorskip("numpy")
    image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    (tmp_path / "a.svg").write_text(svg(busy()))
    (tmp_path / "a.pdf").write_bytes(pdf([busy()]))
    subprocess.run(["rsvg-convert", "-d", "127", "-p", "127", "-o", "svg.png", "a.svg"], cwd=tmp_path, check=True)
    subprocess.run(["pdftoppm", "-png", "-r", "127", "-singlefile", "a.pdf", "pdf"], cwd=tmp_path, check=True)
    item, other = (
        np.asarray(image.open(tmp_path / f"{k}.png").convert("RGB").resize((250, 200))) for k in ("svg", "pdf")
    )
    differ = abs(item.astype(int) - other.astype(int)).max(axis=2) > 60
    assert differ.mean() < 0.04
    red = (item[..., 0] > 180) & (item[..., 1] < 60)
    assert 0.03 < red.mean() < 0.06, "25 by 16 of 100 by 80 in the window, part of it covered, and a line"


def test_pdf_text_beyond_font_is_written_as_code_points():
    sheet = Sheet("spelled", (40.0, 20.0))
    sheet.text(2.0, 10.0, "Umri\u00df \u0141\u00f3d\u017a \u03a9 \u6f22", 3.0)
    assert b"(Umri\xdf U+0141\xf3dz U+03A9 U+6F22)" in pdf([sheet])


def test_pdf_contains_only_needed_graphics_states():
    plain = Sheet("plain", (40.0, 30.0))
    plain.line(0.0, 0.0, 5.0, 5.0)
    assert b"ExtGState" not in pdf([plain]) and b"ExtGState" in pdf([busy()])
    assert len(re.findall(rb"\nq\b", pdf([busy()]))) == len(re.findall(rb"\nQ\b", pdf([busy()]))) == 2
