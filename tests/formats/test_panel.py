"""The panel: every copy shows what the board's own files show, parts hang by their bridges, the frame is whole."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace

import layouts
import pytest
from tolerance import approx

from sitscad.basics.units import show
from sitscad.estimates import estimate
from sitscad.files.documents.drawings import panel_drawing
from sitscad.kernels.geometry.path import Point, bounding_box, circle, rectangle
from sitscad.layout import lay_out
from sitscad.layout.panel import bridges, cut_lines, is_wanted, plan
from sitscad.spec.circuit import PanelSpec
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError

shapes = pytest.importorskip("gerber_shapes", reason="gerbonara and shapely are not installed")
from gerbonara import ExcellonFile  # noqa: E402 - after the test that it is there
from shapely import affinity  # noqa: E402
from shapely.geometry import Polygon  # noqa: E402

MM = 1e-3

TEXT = """
sitscad: 1
name: small-part
coil: {shape: circle, outer_diameter: 3.5, turns: 6.5, layers: 2, trace_width: 0.1, trace_spacing: 0.1}
array: {pattern: line, count: 2, pitch: 4}
fpc:
  tail: {length: 30, connector: zif-0.5mm}
  %s
"""

FOUR_LAYERS = """
sitscad: 1
name: small-part
coil: {shape: circle, outer_diameter: 4, turns: 5.75, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: line, count: 2, pitch: 4.5}
fpc:
  stackup: flex-4l
  rules: generic-fine
  tail: {length: 30, connector: zif-0.5mm, layers: 2}
  panel: {parts: [1, 2]}
"""


@pytest.fixture(scope="module")
def small():
    """A board of 4.3 mm across, its panel of 2 by 3, and all files of the order."""
    layout = lay_out(load_text(TEXT % "panel: {parts: [2, 3]}"))
    panel = plan(layout)
    return layout, panel, layouts.order_set(layout, panel)


def image(files, name):
    return shapes.image(shapes.read(files[name]))


def moved(shape, at: Point):
    return affinity.translate(shape, round(at.x / MM, 6), round(at.y / MM, 6))


def area(layout, at: Point):
    """The part's own outline in the panel (mm)."""
    outline = Polygon([(p.x / MM, p.y / MM) for p in layout.outline.flattened(1e-6)])
    return moved(outline, at)


@pytest.mark.more
@pytest.mark.slow
def test_panel_copies_equal_artwork_of_single_board(small):
    layout, panel, files = small
    for ending in ("F_Cu.gbr", "B_Cu.gbr", "F_Mask.gbr", "B_Stiffener.gbr"):
        own = image(files, f"fpc/small-part-{ending}")
        whole = image(files, f"fpc/panel/small-part-panel-{ending}")
        for at in panel.parts:
            cell = area(layout, at).buffer(0.5)  # a plug's opening goes beyond the board's edge
            assert whole.intersection(cell).symmetric_difference(moved(own, at)).area < 1e-6


@pytest.mark.slow
def test_panel_frame_has_only_fiducials_and_name(small):
    layout, panel, files = small
    whole = image(files, "fpc/panel/small-part-panel-B_Cu.gbr")
    for at in panel.parts:
        whole = whole.difference(area(layout, at))
    for at in panel.coupons:
        whole = whole.difference(area(panel.coupon, at))
    dots = sorted((round(dot.centroid.x, 4), round(dot.centroid.y, 4)) for dot in whole.geoms)
    assert dots == sorted((round(at.x / MM, 4), round(at.y / MM, 4)) for at in panel.fiducials)
    openings = image(files, "fpc/panel/small-part-panel-F_Mask.gbr")
    top = image(files, "fpc/panel/small-part-panel-F_Cu.gbr")
    for at in panel.fiducials:
        dot = Polygon([(at.x / MM + x, at.y / MM + y) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        assert openings.intersection(dot).area > 3.0 and 0.7 < top.intersection(dot).area < 0.8


@pytest.mark.slow
def test_coupon_is_first_coil_with_two_pads(small):
    layout, panel, files = small
    assert len(panel.coupons) == 2 and len(panel.coupon.pads) == 2
    (coil,) = panel.coupon.coils
    assert coil.is_closed_circuit and coil.windings[0].path.length == approx(
        layout.coils[0].windings[0].path.length, rel=0.02
    )
    single = layouts.order_set(panel.coupon)["fpc/small-part-F_Cu.gbr"]
    whole = image(files, "fpc/panel/small-part-panel-F_Cu.gbr")
    for at in panel.coupons:
        item = moved(shapes.image(shapes.read(single)), at)
        assert whole.intersection(area(panel.coupon, at)).symmetric_difference(item).area < 1e-6


@pytest.mark.slow
def test_extent_of_body_layers_covers_all_other_copper_of_panel():
    """Rails carry fiducials on the lowest layer, coupons coils on all: the extent drew the boards' bodies alone."""
    layout = lay_out(load_text(FOUR_LAYERS))
    panel = plan(layout)
    files = layouts.order_set(layout, panel)
    extent = image(files, "fpc/panel/small-part-panel-Body_Layers.gbr").buffer(1e-6)
    assert panel.coupons
    for layer in ("In2_Cu", "B_Cu"):
        lower = image(files, f"fpc/panel/small-part-panel-{layer}.gbr")
        for at in panel.parts:
            lower = lower.difference(area(layout, at))
        assert lower.area > 0.5 and extent.contains(lower), layer
    own = image(files, "fpc/small-part-Body_Layers.gbr")
    for at in panel.parts:
        cell = area(layout, at)
        assert extent.intersection(cell).symmetric_difference(moved(own, at).intersection(cell)).area < 1e-3
    message = files["fpc/panel/small-part-panel-readme.txt"].decode()
    assert "Copper 3 to 4 and what lies between and below: the parts' bodies, the coupons and the rails only" in message


def test_panel_drills_holes_of_all_copies_and_unplated_tooling_holes(small):
    layout, panel, files = small

    def drilled(name):
        file = ExcellonFile.from_string(
            files[f"fpc/panel/small-part-panel-{name}.drl"].decode(), filename=f"{name}.drl"
        )
        return sorted((round(hole.x, 6), round(hole.y, 6)) for hole in file.drills())

    wanted = [(via.centre, at) for at in panel.parts for via in layout.vias]
    wanted += [(via.centre, at) for at in panel.coupons for via in panel.coupon.vias]
    assert drilled("PTH") == sorted((round((c.x + a.x) / MM, 6), round((c.y + a.y) / MM, 6)) for c, a in wanted)
    assert drilled("NPTH") == sorted((round(at.x / MM, 6), round(at.y / MM, 6)) for at in panel.tooling_holes)
    assert b"NonPlated,1,2,NPTH" in files["fpc/panel/small-part-panel-NPTH.drl"]
    for name, file in files.items():
        if "/panel/" in name and name.endswith((".gbr", ".drl")):
            assert b"TF.Part,Array" in file and b"TO.N" not in file, name


def test_cut_lines_and_bridges_add_up_to_outline(small):
    layout, panel, _ = small
    stops = panel.bridges
    pieces = cut_lines(layout.outline, stops)
    assert len(pieces) == len(stops) >= 3
    cut = sum(piece.length for piece in pieces)
    held = sum(stop.end - stop.begin for stop in stops)
    assert cut + held == approx(layout.outline.length, rel=1e-9)
    assert held == approx(len(stops) * 0.5 * MM, rel=1e-6)
    assert not any(piece.is_closed for piece in pieces)
    assert len(cut_lines(layout.outline, ())) == 1 and cut_lines(layout.outline, ())[0].is_closed


def test_bridges_avoid_contacts_and_bend_zone(small):
    layout, panel, _ = small
    low, high = layout.bend_zone
    for bridge in panel.bridges:
        at = bridge.middle(layout.outline)
        assert not low - 0.9 * MM < at.x < high + 0.2 * MM
        assert all(abs(at.x - pad.centre.x) > pad.size[0] / 2 + 0.45 * MM for pad in layout.pads)
    middles = [bridge.middle(layout.outline) for bridge in panel.bridges]
    assert min(a.distance(b) for i, a in enumerate(middles) for b in middles[:i]) > 0.9 * MM
    assert max(p.y for p in middles) > 0 > min(p.y for p in middles), "held on both sides"


TAILS = [
    "length: 30, bend: static", "length: 30, connector: zif-0.3mm, bend: static", "length: 60, layers: 2",
    "length: 30, connector: zif-0.3mm", "length: 30, connector: solder-pads, bend: static",
    "length: 25, turn: left, bend: static", "length: 25, offset: 6",
]


@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("more", ["", "readout: {capacitors_on_board: chip-0603}\n"])
def test_long_tail_has_bridges_on_both_sides_of_its_end(tail, more):
    """A tongue of film that hangs free is folded or torn off in the bath: it is held just before what is plugged in."""
    if more and "solder" in tail:
        return
    text = (TEXT % "panel: {parts: [1, 1]}").replace("tail: {length: 30, connector: zif-0.5mm}", f"tail: {{{tail}}}")
    layout = lay_out(load_text(text + more))
    middles = [bridge.middle(layout.outline) for bridge in bridges(layout)]
    ends = [pad.centre for pad in layout.pads]
    middle = Point(sum(p.x for p in ends) / len(ends), sum(p.y for p in ends) / len(ends))
    near = sorted(middles, key=middle.distance)[:2]
    reach = layout.spec.fpc.tail.connector.stiffener_length + 3.5 * MM
    assert all(at.distance(middle) < reach for at in near), [at.distance(middle) / MM for at in near]
    between = Point((near[0].x + near[1].x) / 2, (near[0].y + near[1].y) / 2)
    assert near[0].distance(near[1]) > 1.4 * MM, "one on either side"
    assert 2.0 * min(at.distance(between) for at in near) > 0.9 * near[0].distance(near[1])
    assert len(middles) >= 5
    for pad in layout.all_pads:  # nothing beside what is plugged in, or beside a capacitor
        (w, h), (x, y) = pad.size, pad.centre
        for at in middles:
            assert max(abs(at.x - x) - w / 2, abs(at.y - y) - h / 2) > 0.45 * MM


def test_panel_is_limited_to_500_boards():
    """Written out, more is a finding that says why; left to itself, the panel stays below."""
    with pytest.raises(SpecError) as caught:
        load_text(TEXT % "panel: {parts: [60, 60]}")
    (found,) = caught.value.findings
    assert (found.rule, found.key, found.measured, found.limit) == ("SIT006", "fpc.panel.parts", 3600.0, 500.0)
    assert load_text(TEXT % "panel: {parts: [25, 20]}").fpc.panel.parts == (25, 20)
    text = "rules: {panel_size: [1000, 1000]}\n  panel: {parts: auto, gap: 0.5, rail: 3}"
    panel = plan(lay_out(load_text((TEXT % text).replace("length: 30", "length: 1"))))
    assert 400 < len(panel.parts) <= 500


def test_panel_copies_and_marks_are_separate_and_inside_frame(small):
    layout, panel, files = small
    areas = [area(layout, at) for at in panel.parts] + [area(panel.coupon, at) for at in panel.coupons]
    for i, item in enumerate(areas):
        assert all(item.distance(other) > 1.99 for other in areas[:i])
    inner = Polygon(rectangle_of(5, 5, *(s / MM - 5 for s in panel.size)))
    assert all(inner.contains(item) for item in areas)
    listed = json.loads(files["fpc/panel/small-part-panel.json"])
    assert listed["parts"] == [[round(v / MM, 6) for v in at] for at in panel.parts]


def rectangle_of(x0, y0, x1, y1):
    return [(p.x, p.y) for p in rectangle(x0, y0, x1, y1).flattened(1.0)]


@pytest.mark.parametrize(
    ("line", "wanted"),
    [("rules: generic-flex", True), ("rules: generic-fine", False), ("panel: none", False), ("panel: {gap: 3}", True)],
)
def test_panel_is_made_for_small_part_or_if_spec_requires(line, wanted):
    layout = lay_out(load_text(TEXT % line))
    assert is_wanted(layout.size, layout.spec.fpc) == wanted


def test_default_panel_fills_panel_size_of_fabricator():
    layout = lay_out(load_text(TEXT % "rules: generic-flex"))
    panel = plan(layout)
    room = layout.spec.fpc.rules.panel_size
    x0, y0, x1, y1 = bounding_box([layout.outline])
    assert panel.size[0] <= room[0] + 1e-9 and panel.size[1] <= room[1] + 1e-9
    assert panel.size[0] + x1 - x0 + 2 * MM > room[0] and panel.size[1] + y1 - y0 + 2 * MM > room[1]


def test_single_coil_with_solder_pads_needs_no_coupon():
    text = TEXT.replace("  tail: {length: 30, connector: zif-0.5mm}\n", "").replace("count: 2", "count: 1")
    panel = plan(lay_out(load_text(text % "panel: {parts: [1, 2]}")))
    assert panel.coupon is None and "its own coupon" in panel.no_coupon
    assert "There is no coupon" in panel_drawing.panel_readme(panel, None)


def test_coupon_too_small_for_its_bridges_is_omitted_with_reason(small):
    """Bridges of 3 mm find fewer than three places on a coupon of 4 mm; it would drop out of the panel."""
    layout, panel, _ = small
    spec = layout.spec
    assert panel.coupon is not None and len(panel.coupon_bridges) >= 3
    wide = replace(spec, fpc=replace(spec.fpc, panel=replace(spec.fpc.panel, bridge=3e-3)))
    without = plan(replace(layout, spec=wide))
    assert without.coupon is None and "bridges of 3 mm" in without.no_coupon and not without.coupons
    assert "bridges of 3 mm" in panel_drawing.panel_readme(without, None)


def test_round_board_has_at_least_three_bridges(board):
    round_board = replace(board, outline=circle(Point(0.0, 0.0), 6 * MM), bend_zone=None, stiffener=None, pads=())
    assert len(bridges(round_board)) >= 3
    wide = replace(board.spec.fpc, panel=PanelSpec(bridge=40 * MM))
    assert bridges(replace(round_board, spec=replace(board.spec, fpc=wide))) == ()


def test_order_archive_contains_panel_instead_of_single_board(small):
    files = small[2]
    names = zipfile.ZipFile(io.BytesIO(files["fpc/small-part-order.zip"])).namelist()
    own = {f"small-part-panel{ending}" for ending in (".GTL", "-Part_Cuts.gbr", "-NPTH.drl")}
    assert own | {"readme.txt"} <= set(names)
    assert "small-part.GTL" not in names and "small-part-netlist.d356" in names


def test_archive_readme_describes_each_panel_file():
    """The readme of the archive named the single board's files alone."""
    layout = lay_out(load_text(FOUR_LAYERS))
    sent = zipfile.ZipFile(io.BytesIO(layouts.order_set(layout, plan(layout))["fpc/small-part-order.zip"]))
    lines = sent.read("small-part-panel-readme.txt").decode().splitlines()
    listed = dict(line.split("  ", 1) for line in lines if line.startswith("small-part-panel") and "  " in line)
    images = {name for name in sent.namelist() if "-panel" in name and not name.endswith((".txt", ".pdf"))}
    stiffener, cuts = "small-part-panel-B_Stiffener.gbr", "small-part-panel-Part_Cuts.gbr"
    assert {stiffener, cuts, "small-part-panel-Body_Layers.gbr", "small-part-panel-job.gbrjob"} < images <= set(listed)
    assert "stiffener" in listed[stiffener] and "cuts round" in listed[cuts]
    assert "small-part-panel-readme.txt" in sent.read("readme.txt").decode()
    assert len({len(name) + 2 + len(text) - len(text.lstrip()) for name, text in listed.items()}) == 1


def test_coupon_inductance_is_stated_with_its_frequency(small):
    """It stood there without one, and a meter at 100 kHz reads another value than at the sensor's."""
    layout, panel, _ = small
    result = estimate(panel.coupon)
    files = layouts.order_set(layout, panel, coupon_estimates=result)
    (text,) = [data for path, data in files.items() if b"A coupon, lying free" in data and path.endswith(".txt")]
    words = " ".join(text.decode().split())
    coil = result.coils[0]
    free = coil.states["free"]
    low = coil.winding_inductance + coil.bend_inductance + coil.lead_inductance
    assert f"{show(low, 'H')} at 100 kHz or less" in words
    assert f"{show(free.apparent_inductance, 'H')} at {show(free.frequency, 'Hz', 3)}" in words
    assert low > free.inductance
