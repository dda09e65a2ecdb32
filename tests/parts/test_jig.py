"""The jig holds board, elastomer and target where the spec has them; the mould's cavities are pads."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import handmade
import pytest
from tolerance import approx

from sitscad.layout import lay_out
from sitscad.parts import aids, mesh
from sitscad.parts.mesh import manifold, tessellate
from sitscad.parts.solid import MM, PartsError, Solid, box, prism, without
from sitscad.parts.tooling import CAVITIES, SPILL, WELL, jig, mould, pour
from sitscad.scene import stack
from sitscad.scene.bodies import BodyRole, elastomer, target
from sitscad.scene.seating import process_clearance
from sitscad.spec.load import load_text
from sitscad.spec.mount import Assembly

pytestmark = pytest.mark.cad

TEMPLATES = Path(__file__).parents[2] / "templates"
GLUE = Assembly(None, 30e-6, 20e-6)


def pieces(name="jaw"):
    return {solid.name: solid for solid in jig(handmade.layout(name))}


def as_solid(body, lift=0.0):
    return Solid(body.name, prism(body.region, body.lower + lift, body.upper + lift), "m", "#000000", body.role)


@pytest.mark.parametrize("name", ["jaw", "round", "oblique", "overhanging", "bench", "solder-pads"])
def test_every_piece_is_closed_and_one_piece(name):
    found = aids(handmade.layout(name))
    assert all(solid.shape.is_valid and solid.volume > 0.0 for solid in found)
    for solid in found:
        manifold(tessellate(solid))
    assert {solid.role for solid in found} == {BodyRole.JIG, BodyRole.MOULD}


@pytest.mark.parametrize("name", ["jaw", "round", "oblique", "overhanging"])
def test_board_and_pieces_lie_in_the_jig_and_touch_nothing_but_the_board(name):
    layout, found = handmade.layout(name), pieces(name)
    board = as_solid(stack.board(layout))
    for body in (elastomer(layout.spec), target(layout.spec)):
        together = (board, found["jig-base"], found[f"jig-{body.name}"], as_solid(body))
        assert mesh.interferences(together) == ()
        gaps = {(c.first, c.second): c.gap for c in mesh.clearances(together)}
        if name in ("jaw", "round"):  # others overhang, and lie on their frame
            assert gaps[f"jig-{body.name}", body.name] == approx(process_clearance(layout.spec.mount), abs=2e-6)
        assert gaps["jig-base", f"jig-{body.name}"] == approx(0.0, abs=1e-9)


def test_the_frame_goes_on_one_way_only():
    """Turned by half a circle, the thick pin stands where the thin one's hole is."""
    import build123d as bd

    found = pieces()
    base, frame = found["jig-base"], found["jig-target"]
    box = frame.shape.bounding_box()
    middle = bd.Axis(((box.min.X + box.max.X) / 2, (box.min.Y + box.max.Y) / 2, 0), (0, 0, 1))
    turned = replace(frame, shape=frame.shape.rotate(middle, 180.0))
    assert mesh.interferences((base, frame)) == ()
    assert mesh.interferences((base, turned)) != ()


def test_the_press_stops_where_glue_and_piece_are_as_high_as_meant():
    """Its foot reaches into the well as deep as the glue line leaves the piece's face above it."""
    layout = handmade.jaw_sensor()
    glued = replace(layout, spec=replace(layout.spec, assembly=GLUE))
    found = {solid.name: solid for solid in jig(glued)}
    for name, lines in (("elastomer", 1), ("target", 2)):
        press = found[f"jig-{name}-press"].shape
        areas = sorted({round(face.center().Z, 6) for face in press.faces() if abs(face.normal_at().Z) > 0.99})
        foot = areas[-1] - areas[-2]
        assert foot == approx((WELL - lines * 30e-6) * MM, abs=1e-6), name


def test_without_anything_on_the_board_there_is_no_jig():
    assert jig(handmade.layout("bare")) == () and mould(handmade.layout("bare")) == ()
    assert pour(handmade.layout("bare").spec) is None


@pytest.mark.parametrize("name", ["jaw", "round"])
def test_a_cavity_holds_a_pad_of_its_nominal_volume(name):
    """What the cavities take out of the tray, grooves apart, is the pads' volume but for the draft's second order."""
    layout = handmade.layout(name)
    pad = elastomer(layout.spec)
    tray, lid = mould(layout)
    found = pour(layout.spec)
    x, y = pad.footprint.size
    area = math.pi * x * y / 4 if pad.footprint.is_round else x * y
    assert found.pad == approx(area * pad.thickness, rel=1e-6) and found.mixed == approx(
        SPILL * CAVITIES * found.pad, rel=1e-6
    )
    body = manifold(tessellate(tray))
    middle = body.slice(-0.5e3 * pad.thickness - 1e-6 if pad.thickness > 1e-3 else -0.5e3 * pad.thickness - 1e-3)
    outline = body.slice(-pad.thickness * 1e3 - 1.0)
    holes = outline.area() - middle.area()
    assert holes == approx(CAVITIES * area * 1e6, rel=5e-3)
    assert manifold(tessellate(lid)).genus() == 2 * CAVITIES


def test_a_coarser_process_leaves_more_room_in_the_jig():
    mount = replace(handmade.jaw_sensor().spec.mount, process="filament")
    usual = handmade.jaw_sensor().spec.mount
    assert process_clearance(handmade.jaw_sensor(mount=mount).spec.mount) > process_clearance(usual)


@pytest.mark.slow
@pytest.mark.more
def test_pads_that_webs_join_are_cast_and_laid_as_one_piece():
    """The tray's cavity at half its height is four pads and their webs, which one well takes; targets have four."""
    text = (TEMPLATES / "skin_grid_3x3.yaml").read_text().replace("[3, 3]", "[2, 2]")
    text = text.replace("coils: 1 ", "coils: 1\n  web: 2 mm\n")
    layout = lay_out(load_text(text, "webs.yaml"))
    tray, _ = mould(layout)
    cut = manifold(tessellate(tray))
    low, depth = cut.bounding_box()[2], 1e3 * layout.spec.elastomer.thickness
    whole, middle = cut.slice(low + 0.5).area(), cut.slice(low + 2.0 + 0.49 * depth).area()
    area = 4 * 10.0**2 + 4 * 2.0 * 6.0
    assert whole - middle == approx(area, rel=0.01)
    assert (pour(layout.spec).pads, pour(layout.spec).pad) == approx((1, 1e-9 * area * depth), rel=1e-9)
    found = {solid.name: manifold(tessellate(solid)) for solid in jig(layout)}
    assert found["jig-elastomer"].slice(1.0).num_contour() == 4  # outside, two pins, a well
    assert found["jig-target"].slice(1e3 * elastomer(layout.spec).upper + 1.0).num_contour() == 3 + 4


@pytest.mark.slow
@pytest.mark.parametrize(("gap", "wells"), [(1.0, 2), (0.66, 2), (0.5, 1)])
def test_a_frame_with_wells_of_neighbours_is_one_piece(gap, wells):
    """Drilled corners cut the wall between them off, and `build` refused; too thin to print, it is left out."""
    spec = load_text(f"""
sitscad: 1
name: neighbours
coil: {{shape: circle, outer_diameter: 6.5, turns: 6, layers: 4, trace_width: 153 um, trace_spacing: 153 um}}
array: {{pattern: line, count: 2, pitch: {7.0 + gap}}}
cells: {{coils: 1}}
target: {{size: 7, thickness: 0.2, material: copper}}
elastomer: {{size: 7, thickness: 1.5}}
mount: {{kind: grasper-pad, jaw: robotic-12mm, standoff: 1}}
""")
    found = {solid.name: manifold(tessellate(solid)) for solid in jig(lay_out(spec))}
    assert found["jig-elastomer"].slice(1.0).num_contour() == 3 + wells  # outside, two pins
    assert found["jig-target"].slice(1e3 * elastomer(spec).upper + 1.0).num_contour() == 3 + wells


def test_tools_that_overlap_cut_what_they_cut_one_after_the_other():
    block = box(0.0, 0.0, 0.0, 4e-3, 2e-3, 1e-3)
    tools = [box(0.5e-3, 0.5e-3, 0.5e-3, 2e-3, 1.5e-3, 2e-3), box(1.5e-3, 1e-3, -1e-3, 3e-3, 1.8e-3, 2e-3)]
    # their volumes less what both take of the block
    assert without(block, iter(tools), "block").volume == approx(8.0 - 1.5 * 0.5 - 1.2 + 0.5 * 0.5 * 0.5, rel=1e-9)
    assert without(block, (), "block") is block
    with pytest.raises(PartsError, match="falls into 2 pieces"):
        without(block, [*tools, box(1.7e-3, -1e-3, -1e-3, 1.9e-3, 3e-3, 2e-3)], "block")
    with pytest.raises(PartsError, match="falls into 0 pieces"):
        without(block, [*tools, box(-1e-3, -1e-3, -1e-3, 5e-3, 3e-3, 2e-3)], "block")
