"""A body of a given outline: what is drawn keeps inside it, follows it exactly, or is refused with what is missing."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from one_rule import findings_of
from ruamel.yaml import YAML
from tolerance import approx

import sitscad
from sitscad.assembly.places.bodies import film_thickness
from sitscad.assembly.places.seating import plate_plan
from sitscad.kernels.geometry.path import Arc, circle, enclosed_area
from sitscad.layout.outline import root
from sitscad.spec.load import rewritten_spec
from sitscad.spec.resolver.circuit import OutlineFileError, outline_from_dxf

BUTTON = Path(__file__).parents[2] / "templates" / "round_button_12mm.yaml"


@pytest.fixture(scope="module")
def button() -> sitscad.SensorSpec:
    return sitscad.load(BUTTON)


@pytest.fixture(scope="module")
def bare(button) -> sitscad.SensorSpec:
    """Its board alone: soon judged."""
    return button.replace(dict.fromkeys(["target", "elastomer", "encapsulation", "mount", "requirements"]))


def refusals(spec: sitscad.SensorSpec, hints: str = "decisive") -> dict[str, sitscad.Finding]:
    findings = sitscad.check(spec, hints=hints).findings
    return {finding.rule: finding for finding in findings if finding.severity is sitscad.Severity.ERROR}


def copper_outside(layout: sitscad.Layout) -> float:
    """The area (m2) of tracks and vias nearer to the edge than the fabricator asks, by another library's polygons."""
    board = shapely.Polygon(layout.outline.flattened(1e-7))
    inner = board.buffer(-layout.spec.fpc.rules.copper_to_edge + 1e-6, quad_segs=64)
    pieces = [shapely.LineString(t.path.flattened(1e-7)).buffer(t.width / 2) for t in layout.traces]
    pieces += [shapely.Point(via.centre).buffer(via.pad / 2) for via in layout.vias]
    return float(shapely.unary_union(pieces).difference(inner).area)


@pytest.mark.slow
@pytest.mark.parametrize("body", [
    {"shape": "circle", "size": 12}, {"shape": "circle", "size": 11.8}, {"shape": "rectangle", "size": [12, 13]},
    {"shape": "rounded", "size": [13, 12], "corner_radius": 4},
])
def test_copper_in_given_outline_has_required_edge_distance(button, body):
    layout = sitscad.lay_out(rewritten_spec(button, [("fpc.body", body)]))
    assert not layout.shortfalls
    assert layout.outline.is_closed
    assert copper_outside(layout) == 0.0
    size = np.ravel(body["size"])
    assert list(layout.body_size) == approx([size[0] * 1e-3, size[-1] * 1e-3], rel=1e-9)


@pytest.mark.slow
def test_round_outline_joins_tail_with_tangent_corners(button):
    layout = sitscad.lay_out(button)
    segments = layout.outline.segments
    fillets = [s for s in segments if isinstance(s, Arc) and not s.ccw]
    assert len(fillets) == 2
    for before, after in zip(segments, (*segments[1:], segments[0]), strict=True):
        assert before.end.distance(after.start) < 1e-9
        if fillets[0] in (before, after) or fillets[1] in (before, after):
            (a, b), (c, d) = before.flattened(1e-10)[-2:], after.flattened(1e-10)[:2]
            turn = math.atan2(b.y - a.y, b.x - a.x) - math.atan2(d.y - c.y, d.x - c.x)
            assert abs(math.remainder(turn, 2 * math.pi)) < 1e-3
    rounds = [s for s in segments if isinstance(s, Arc) and s.ccw]
    assert all(arc.radius == approx(6e-3, rel=1e-9) and arc.centre.distance(rounds[0].centre) < 1e-9 for arc in rounds)


@pytest.mark.slow
def test_shifted_coils_shift_whole_layout(button):
    """The body goes with the mean of the coils' centres."""
    there = [[x + 3e-3, y - 2e-3] for x, y in (place.centre for place in button.array.placements)]
    here = sitscad.lay_out(button).body
    moved = sitscad.lay_out(button.replace("array", {"centres": there})).body
    assert list(moved) == approx([here[0] + 3e-3, here[1] - 2e-3, here[2] + 3e-3, here[3] - 2e-3], rel=1e-9)


def test_root_rounding_touches_circle_and_tail():
    """(R + r)^2 = x^2 + (h + r)^2 (Pythagoras)."""
    result = root(circle(sitscad.kernels.geometry.path.Point(0.0, 0.0), 6e-3), 1, 1.75e-3, 1e-3)
    assert result.centre.x == approx(math.sqrt(7e-3**2 - 2.75e-3**2), rel=1e-12)
    assert math.hypot(*result.on_body) == approx(6e-3, rel=1e-9)
    assert root(circle(sitscad.kernels.geometry.path.Point(0.0, 0.0), 1e-3), 1, 1.75e-3, 1e-3) is None


@pytest.mark.slow
def test_small_body_is_refused_with_shortfall_and_sufficient_body(bare):
    result = refusals(bare.replace("fpc.body.size", 11e-3), "full")
    radius = bare.array.pitch / math.sqrt(3) + bare.coil.size[0] / 2
    message = result["SIT135"]
    assert message.limit - message.measured == approx(radius + 0.2e-3 - 5.5e-3, rel=0.02)
    larger = float(message.hint.split("fpc.body.size: ")[1].split()[0])
    assert 11 < larger < 12.5 and "SIT109" not in result  # which would say it of every layer of every coil
    assert not sitscad.lay_out(bare.replace("fpc.body.size", 1e-3 * larger)).shortfalls


@pytest.mark.slow
def test_largest_outline_limits_computed_body(bare):
    free = bare.replace("fpc.body", None)
    x, y = sitscad.lay_out(free).body_size
    roomy = {"shape": "rectangle", "size": [x + 2e-3, y + 2e-3]}
    assert "SIT136" not in refusals(free.replace("fpc.largest", roomy), "none")
    message = refusals(free.replace("fpc.largest", {"shape": "circle", "size": "12 mm"}), "full")["SIT136"]
    corner = math.hypot(x / 2 - 0.5e-3, y / 2 - 0.5e-3) + 0.5e-3  # of corners rounded by 0.5 mm
    assert message.measured == approx(corner - 6e-3, rel=0.1)
    assert [[(edit.key, edit.new) for edit in fix.edits] for fix in message.fixes] == [
        [("fpc.body", "{shape: circle, size: 12}")]]


@pytest.mark.slow
@pytest.mark.parametrize(("side", "is_told"), [(13, True), (40, False)])
def test_plate_beyond_largest_outline_yields_note(button, side, is_told):
    """A pad for a room of 25 mm came with a plate of 33 mm, which no command said before it was built."""
    spec = rewritten_spec(button, [("fpc.largest", {"shape": "rectangle", "size": [side, side]})])
    findings = findings_of("SIT136", spec)
    assert [(f.severity, f.key) for f in findings] == [(sitscad.Severity.NOTE, "fpc.largest")] * is_told
    assert all(f.measured > f.limit == 0.0 for f in findings)


@pytest.mark.slow
@pytest.mark.parametrize(("room", "is_told"), [(0.99, True), (1.01, False)])
def test_plate_corners_beyond_round_outline_yield_note(button, room, is_told):
    """The sides of a circle's box were compared with those of the plate, whose corners reach farther."""
    x0, y0, x1, y1 = plate_plan(sitscad.lay_out(button), film_thickness(button.encapsulation))
    diagonal = 1e3 * math.hypot(x1 - x0 - 4e-3, y1 - y0 - 4e-3) + 4.0  # corners of 2 mm
    spec = rewritten_spec(button, [("fpc.largest", {"shape": "circle", "size": room * diagonal})])
    findings = findings_of("SIT136", spec)
    assert [f.severity for f in findings] == [sitscad.Severity.NOTE] * is_told
    assert all(f.measured == approx(0.5e-3 * (1.0 - room) * diagonal, rel=1e-2) for f in findings)


@pytest.mark.slow
def test_long_coil_beyond_largest_outline_suggests_narrower_coil_with_fewer_turns():
    """A strip 3 mm wide was told "smaller coils" and no size: narrower, its vias had no room inside."""
    spec = sitscad.load_text(STRIP)
    result = refusals(spec, "full")["SIT136"]
    edits = {edit.key: edit.new for edit in result.fixes[0].edits}
    length, width = YAML(typ="safe").load(edits["coil.outer_diameter"])
    assert length == 30 and 2.0 < width < 2.6 and float(edits.get("coil.turns", 5)) <= 5
    changed = spec.source.text.replace("[30, 2.6]", edits["coil.outer_diameter"])
    changed = changed.replace("turns: 5", f"turns: {edits.get('coil.turns', 5)}")
    mended = sitscad.lay_out(sitscad.load_text(changed))
    assert not mended.shortfalls and mended.body_size[1] <= 3e-3


STRIP = """
sitscad: 1
name: strip
coil: {shape: racetrack, outer_diameter: [30, 2.6], turns: 5, layers: 2, trace_width: 0.076, trace_spacing: 0.076}
fpc: {rules: generic-fine, largest: {shape: rectangle, size: [34, 3]}, tail: {length: 20}}
"""


def dxf(tmp_path: Path, draw, version: str = "R2013") -> bytes:
    import ezdxf

    drawing = ezdxf.new(version)
    drawing.header["$INSUNITS"] = 4
    draw(drawing.modelspace())
    drawing.saveas(tmp_path / "body.dxf")
    return (tmp_path / "body.dxf").read_bytes()


D_SHAPE = [(5, -6, 0), (5, 6, 0), (0, 6, 1), (0, -6, 0)]


def test_drawn_outline_is_read_as_lines_and_arcs(tmp_path):
    result = outline_from_dxf(dxf(tmp_path, lambda space: space.add_lwpolyline(D_SHAPE, format="xyb", close=True)))
    assert enclosed_area(result) == approx((60 + math.pi * 18) * 1e-6, rel=1e-9)

    def pieces(space) -> None:  # in any order and direction
        space.add_arc((0, 0), 6, 90, 270)
        space.add_line((5, 6), (0, 6))
        space.add_line((5, 6), (5, -6))
        space.add_line((0, -6), (5, -6))

    assert enclosed_area(outline_from_dxf(dxf(tmp_path, pieces))) == approx((60 + math.pi * 18) * 1e-6, rel=1e-9)


def test_tiny_segments_of_drawn_outline_are_dropped(tmp_path):
    """Exports hold lines of no length and fillets of no radius: such a line has no direction."""

    def draw(space) -> None:
        corners = [(-5, -3), (5, -3), (5, 3), (-5, 3), (-5, -3)]
        for start, end in pairwise(corners):
            space.add_line(start, end)
            space.add_line(end, end)
        space.add_arc((5, 3 - 1e-5), 1e-5, 0, 90)

    result = list(outline_from_dxf(dxf(tmp_path, draw)))
    assert len(result) == 4 and all(piece.length > 5e-3 for piece in result)


@pytest.mark.parametrize(("draw", "said"), [
    (lambda space: space.add_spline([(0, 0), (1, 2), (3, 4)]), "SPLINE .* is no line"),
    (lambda space: space.add_lwpolyline([(0, 0), (5, 0), (5, 5)]), r"open: LWPOLYLINE .* ends at \[5, 5\] mm"),
    (lambda space: [space.add_circle((0, 0), 6), space.add_circle((0, 0), 1)], "CIRCLE .* does not belong"),
    (lambda space: space.add_lwpolyline([(-6, -6), (6, -6), (6, 6), (2, 0)], close=True), r"inwards at \[2, 0\]"),
    (lambda space: space.add_lwpolyline([(0, 0), (6, 6), (6, 0), (0, 6)], close=True), "inwards|crosses"),
    (lambda space: space.add_circle((0, 0), 0.2), "400 um x 400 um"),
    (lambda space: None, "0 lines and arcs"),
    (lambda space: [space.add_circle((0, 0), 6), space.add_circle((0, 0), 6)], "CIRCLE .* is drawn twice: CIRCLE"),
    (lambda space: [space.add_lwpolyline(D_SHAPE, format="xyb", close=True), space.add_line((5, 6), (5, -6))],
     "LINE .* is drawn twice: LWPOLYLINE"),
    (lambda space: [space.add_arc((0, 0), 6, 0, 180), space.add_line((-6, 0, 2), (6, 0, 2))],
     "ARC.* lies at z = 0 mm and LINE.* at 2 mm"),
    (lambda space: space.add_polyline3d([(0, 0, 0), (5, 0, 0), (5, 5, 1)], close=True), "POLYLINE .* in space"),
    (lambda space: space.add_circle((math.nan, 0), 6), "no DXF that can be read"),
    (lambda space: space.add_polyline2d([(0, 0), (9, 0), (9, 9), (0, 9)], close=True, dxfattribs={"flags": 4}),
     "POLYLINE .* is a spline"),
    (lambda space: space.add_lwpolyline([(1e-5 * k, 0) for k in range(3000)]), "LWPOLYLINE .* has 3000 vertices"),
])
def test_invalid_outline_drawing_is_refused_naming_wrong_entity(tmp_path, draw, said):
    with pytest.raises(OutlineFileError, match=said):
        outline_from_dxf(dxf(tmp_path, draw))


@pytest.mark.parametrize("version", ["R12", "R2000", "R2004", "R2007", "R2018"])
def test_drawing_of_each_version_is_read_in_its_encoding(tmp_path, version):
    """Before R2007 a layer's name is in the code page that the header names, not in UTF-8."""

    def draw(space) -> None:
        space.doc.layers.add("Umri\u00df")
        if version == "R12":
            space.add_polyline2d(D_SHAPE, format="xyb", close=True, dxfattribs={"layer": "Umri\u00df"})
        else:
            space.add_lwpolyline(D_SHAPE, format="xyb", close=True, dxfattribs={"layer": "Umri\u00df"})

    content = dxf(tmp_path, draw, version)
    assert (b"Umri\xc3\x9f" in content) == (version in ("R2007", "R2018"))
    assert enclosed_area(outline_from_dxf(content)) == approx((60 + math.pi * 18) * 1e-6, rel=1e-9)


def test_drawn_arc_of_360_degrees_at_any_height_is_circle(tmp_path):
    turned = outline_from_dxf(dxf(tmp_path, lambda space: space.add_arc((0, 0, 3), 6, 30, 390)))
    assert enclosed_area(turned) == approx(math.pi * 36e-6, rel=1e-9)


CORNERS = ((-13, -7), (13, -7), (13, 7), (-13, 7))


def test_drawing_without_header_is_in_millimetres():
    """It was read as one in metres, and refused for coordinates that are no lengths."""
    lines = "".join(
        f"0\nLINE\n8\n0\n10\n{x}\n20\n{y}\n11\n{u}\n21\n{v}\n"
        for (x, y), (u, v) in zip(CORNERS, CORNERS[1:] + CORNERS[:1], strict=True)
    )
    content = f"0\nSECTION\n2\nENTITIES\n{lines}0\nENDSEC\n0\nEOF\n".encode("ascii")
    assert enclosed_area(outline_from_dxf(content)) == approx(26 * 14 * 1e-6, rel=1e-9)


IN_PARSECS = b"0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n20\n0\nENDSEC\n0\nEOF\n"


@pytest.mark.parametrize("content", [b"", b"hello\0\xff", IN_PARSECS])
def test_file_without_drawing_is_refused(content):
    with pytest.raises(OutlineFileError):
        outline_from_dxf(content)


@pytest.mark.slow
def test_spec_with_outline_drawing_has_drawn_body(tmp_path):
    corners = [(6, -6, 0), (6, 6, 0), (0, 6, 1), (0, -6, 0)]
    dxf(tmp_path, lambda space: space.add_lwpolyline(corners, format="xyb", close=True))
    text = BUTTON.read_text(encoding="utf-8").replace("{shape: circle, size: 12}", "{shape: dxf, file: body.dxf}")
    (tmp_path / "d.yaml").write_text(text, encoding="utf-8")
    layout = sitscad.lay_out(sitscad.load(tmp_path / "d.yaml"))
    assert not layout.shortfalls and copper_outside(layout) == 0.0
    with pytest.raises(sitscad.SpecError, match="a text without a folder"):
        sitscad.load_text(text)
    (tmp_path / "body.dxf").unlink()
    with pytest.raises(sitscad.SpecError) as caught:
        sitscad.load(tmp_path / "d.yaml")
    assert caught.value.findings[0].hint == "there is no DXF file in that folder"


@pytest.mark.parametrize("way", [{"offset": 20}, {"offset": -3}, {"turn": "left"}, {"turn": "right", "turn_radius": 8}])
def test_coils_larger_than_body_are_unchanged_by_tail_turn(way):
    """The turn was to bend the spirals that stand in its way: an internal error."""
    coil = {"shape": "circle", "outer_diameter": 7, "turns": 8, "layers": 2, "trace_width": 0.15, "trace_spacing": 0.15}
    fpc = {"body": {"shape": "rectangle", "size": 9}, "tail": {"length": 40, **way}}
    values = {"sitscad": 1, "name": "small", "coil": coil, "array": {"count": 4}, "fpc": fpc}
    spec = sitscad.SensorSpec.from_mapping(values)
    message, layout = refusals(spec, "none")["SIT135"], sitscad.lay_out(spec)
    assert message.key == "fpc.body" and message.measured < 0.0 < message.limit == spec.fpc.rules.copper_to_edge
    straight = sitscad.lay_out(spec.replace({f"fpc.tail.{key}": None for key in way}))
    assert layout.coils == straight.coils and layout.outline != straight.outline
    assert shapely.Polygon(layout.outline.flattened(1e-6)).is_valid


@pytest.mark.parametrize("turn", ["left", "right"])
def test_turn_of_short_tail_begins_beyond_rounded_root(bare, turn):
    """Without leads, the tail was as long as a turn takes that begins at the body, in the middle of the root."""
    small = {"shape": "rectangle", "size": "9 mm"}
    layout = sitscad.lay_out(bare.replace({"fpc.body": small, "fpc.tail": {"length": "1 mm", "turn": turn}}))
    assert layout.shortfalls
    outline = shapely.Polygon(layout.outline.flattened(1e-6))
    assert outline.is_valid and outline.area > 9e-3**2
