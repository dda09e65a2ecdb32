"""The jig holds board, elastomer and target where the spec has them; the mould's cavities are pads."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import handmade
import pytest
from shapely import Polygon, unary_union
from solid_pairs import clearances, interferences
from tolerance import approx

from sitscad.assembly.places import stack
from sitscad.assembly.places.bodies import (
    BodyRole,
    plates_of,
)
from sitscad.assembly.places.column import layer_heights, layers_on_board
from sitscad.assembly.places.seating import process_clearance
from sitscad.assembly.solids import assembly_aids, solids
from sitscad.assembly.solids.proof import check_print
from sitscad.assembly.solids.solid import (
    MM,
    PartsError,
    Solid,
    box,
    import_extra,
    manifold,
    prism,
    subtract,
    tessellate,
)
from sitscad.assembly.solids.tooling import (
    BOARD_PRESS,
    CAVITIES,
    LIFT,
    PUSH_HOLES,
    PUSH_PITCH,
    SPILL,
    WELL,
    jig,
    jig_frames,
    mould,
    push_places,
    silicone_to_mix,
)
from sitscad.layout import lay_out
from sitscad.spec import templates
from sitscad.spec.load import load_text
from sitscad.spec.mount import Assembly
from tests.conftest import SHOWN

pytestmark = pytest.mark.cad

TEMPLATES = Path(__file__).parents[2] / "templates"
GLUE = Assembly(None, 30e-6, 20e-6)


def pieces(name="jaw"):
    return {solid.name: solid for solid in jig(handmade.layout(name))}


def as_solid(body, lift=0.0):
    return Solid(body.name, prism(body.region, body.lower + lift, body.upper + lift), "m", "#000000", body.role)


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["jaw", "round", "oblique", "overhanging", "bench", "solder-pads"])
def test_jig_pieces_are_closed_single_solids(name):
    result = assembly_aids(handmade.layout(name))
    assert all(solid.shape.is_valid and solid.volume > 0.0 for solid in result)
    for solid in result:
        manifold(tessellate(solid))
    assert {solid.role for solid in result} == {BodyRole.JIG, BodyRole.MOULD}


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["jaw", "round", "oblique", "overhanging"])
def test_board_and_pieces_in_jig_touch_only_board(name):
    layout, result = handmade.layout(name), pieces(name)
    board = as_solid(stack.board(layout.outline, layout.spec.fpc.stackup))
    for body in (plates_of(layout.spec).elastomer, plates_of(layout.spec).target):
        together = (board, result["jig-base"], result[f"jig-{body.name}"], as_solid(body))
        assert interferences(together) == ()
        gaps = {(c.first, c.second): c.gap for c in clearances(together)}
        if name in ("jaw", "round") and body.role is BodyRole.ELASTOMER:  # others overhang, and lie on their frame
            assert gaps[f"jig-{body.name}", body.name] == approx(process_clearance(layout.spec.mount), abs=2e-6)
        assert gaps["jig-base", f"jig-{body.name}"] == approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_jig_frame_has_single_orientation():
    """Turned by half a circle, the thick pin stands where the thin one's hole is."""
    import build123d as bd

    result = pieces()
    base, frame = result["jig-base"], result["jig-target"]
    box = frame.shape.bounding_box()
    middle = bd.Axis(((box.min.X + box.max.X) / 2, (box.min.Y + box.max.Y) / 2, 0), (0, 0, 1))
    turned = replace(frame, shape=frame.shape.rotate(middle, 180.0))
    assert interferences((base, frame)) == ()
    assert interferences((base, turned)) != ()


VARIANTS = {
    "larger pad": {"elastomer.size": "13.5 mm", "target.size": "11.5 mm"},
    "larger target": {"elastomer.size": "9 mm", "target.size": "12 mm"},
    "disc on a square": {"elastomer.size": "12 mm", "target.shape": "circle", "target.size": "9 mm"},
    "thin foil": {"target.thickness": "20 um"},
    "thick pad": {"elastomer.thickness": "4 mm"},
    "rough tolerances": {"assembly.tolerances": {"elastomer": "0.3 mm"}},
    "thick glue": {"assembly.adhesive": "silicone-adhesive"},
}


LEFT_OUT = (pytest.mark.slow, pytest.mark.more)


def lifted(solid, height):
    """A solid moved up (m)."""
    return replace(solid, shape=solid.shape.moved(import_extra("build123d").Location((0, 0, MM * height))))


def specs():
    """The templates, and `three_axis_pad` with plates that overhang, lie within each other or are hardly there."""
    for name in templates.names():
        yield name, load_text(templates.read(name), "t.yaml")
    for name, changes in VARIANTS.items():
        yield name, load_text(templates.read("three_axis_pad"), "t.yaml").replace(changes)


def placed(layout):
    """Everything on the board by its part: its bodies with the levels of lower and upper face, least and largest."""
    at, plates = layer_heights(layers_on_board(layout)), plates_of(layout.spec)
    rows = {part: plates.glued(part) for part in ("elastomer", "target")}
    for part, row in rows.items():
        if row:
            lower, upper = (each - at["board"][1] for each in at[part])
            yield part, row, lower, upper


@pytest.mark.parametrize(
    ("name", "spec"),
    [pytest.param(*each, id=each[0], marks=() if each[0] in SHOWN or each[0] in VARIANTS else LEFT_OUT)
     for each in specs()],
)
def test_jig_frames_clear_pads_and_targets_of_all_thicknesses(name, spec):
    """A frame stood on the rim of a pad larger than its target, and on every thick pad."""
    layout = lay_out(spec)
    for frame in jig_frames(layout):
        for part, row, lower, upper in placed(layout):
            low, high = lower.nominal - lower.spread, upper.nominal + upper.spread
            spans = [outline for outline, start, end in frame.cuts if start <= max(0.0, low) and high <= end]
            free = unary_union([Polygon(path.flattened(1e-6)) for path in spans])
            for body in row:
                assert free.buffer(1e-7).covers(Polygon(body.outline().flattened(1e-6))), (part, frame.kind)
            if part == frame.kind:
                break  # what is glued on it later is not there yet


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "spec"),
    [pytest.param(*each, id=each[0], marks=() if each[0] in ("grasper_4layer", "three_axis_pad") else pytest.mark.more)
     for each in specs() if each[1].target],
)
def test_jig_pieces_overlap_no_contents(name, spec):
    """Boolean overlaps of all pieces of the jig with board, pads and targets, as thin and as thick as they may be."""
    layout = lay_out(spec)
    result = {solid.name: solid for solid in jig(layout)}
    board = as_solid(stack.board(layout.outline, layout.spec.fpc.stackup))
    assert interferences((board, result["jig-base"])) == ()
    for side in (-1.0, 0.0, 1.0):
        glued = [board]
        for part, row, lower, upper in placed(layout):
            low, high = (level.nominal + side * level.spread for level in (lower, upper))
            glued += [Solid(body.name, prism(body.region, max(0.0, low), high), "m", "#000000", body.role)
                      for body in row]
            frame, press = result[f"jig-{part}"], lifted(result[f"jig-{part}-press"], high - upper.nominal)
            for solid in glued:
                common = frame.shape & solid.shape
                assert common is None or common.volume < 1e-6, (part, solid.name, side)
            assert interferences((frame, press)) == ()


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["jaw", "round"])
def test_press_rests_only_on_piece_at_all_thicknesses(name):
    """A thin pad was never touched by the press, which stopped on the frame; a thick one was squeezed."""
    layout = handmade.layout(name)
    glued = replace(layout, spec=replace(layout.spec, assembly=GLUE))
    result = {solid.name: solid for solid in jig(glued)}
    for frame in jig_frames(glued):
        press, well = result[f"jig-{frame.kind}-press"], result[f"jig-{frame.kind}"]
        for side in (-1.0, 1.0):
            shift = side * frame.face.spread
            moved = lifted(press, shift)
            (gap,) = clearances((well, moved))
            bounds = moved.shape.bounding_box()
            assert approx(MM * (frame.face.nominal + shift), abs=1e-6) == bounds.min.Z
            assert frame.collar + shift - frame.height >= LIFT - 1e-12  # nothing else of it reaches the frame
            assert gap.gap == approx(process_clearance(layout.spec.mount), abs=2e-6)
            assert frame.height - (frame.face.nominal + shift) >= WELL - 1e-12  # and it is guided


@pytest.mark.slow
def test_wide_board_has_push_holes_over_its_area():
    """One hole of 2.5 mm was to push out a skin of 46 x 46 mm."""
    grid, small = (lay_out(load_text(templates.read(name), "t.yaml")) for name in ("skin_grid_3x3", "grasper_4layer"))
    places, size = push_places(grid.body, grid.body_outline)
    (x0, y0, x1, y1) = grid.body
    for x, y in ((x0, y0), (x1, y1), (0.5 * (x0 + x1), 0.5 * (y0 + y1))):
        assert min(math.hypot(x - at.x, y - at.y) for at in places) <= PUSH_PITCH / math.sqrt(2.0)
    assert size == max(PUSH_HOLES) and len(places) == 9
    assert push_places(small.body, small.body_outline)[1] == min(PUSH_HOLES)
    base = manifold(tessellate(next(solid for solid in jig(small) if solid.name == "jig-base")))
    assert base.genus() == len(push_places(small.body, small.body_outline)[0])


def test_board_without_pieces_has_no_jig():
    assert jig(handmade.layout("bare")) == () and mould(handmade.layout("bare")) == ()
    assert silicone_to_mix(plates_of(handmade.layout("bare").spec)) is None


@pytest.mark.parametrize("name", ["jaw", "round"])
def test_mould_cavity_has_nominal_pad_volume(name):
    """What the cavities take out of the tray, grooves apart, is the pads' volume but for the draft's second order."""
    layout = handmade.layout(name)
    pad = plates_of(layout.spec).elastomer
    tray, lid = mould(layout)
    result = silicone_to_mix(plates_of(layout.spec))
    x, y = pad.footprint.size
    area = math.pi * x * y / 4 if pad.footprint.is_round else x * y
    assert result.pad == approx(area * pad.thickness, rel=1e-6) and result.mixed == approx(
        SPILL * CAVITIES * result.pad, rel=1e-6
    )
    body = manifold(tessellate(tray))
    middle = body.slice(-0.5e3 * pad.thickness - 1e-6 if pad.thickness > 1e-3 else -0.5e3 * pad.thickness - 1e-3)
    outline = body.slice(-pad.thickness * 1e3 - 1.0)
    holes = outline.area() - middle.area()
    assert holes == approx(CAVITIES * area * 1e6, rel=5e-3)
    assert manifold(tessellate(lid)).genus() == 2 * CAVITIES


def test_coarser_process_gives_jig_more_clearance():
    mount = replace(handmade.jaw_sensor().spec.mount, process="filament")
    usual = handmade.jaw_sensor().spec.mount
    assert process_clearance(handmade.jaw_sensor(mount=mount).spec.mount) > process_clearance(usual)


@pytest.mark.slow
@pytest.mark.more
def test_webbed_pads_are_cast_and_placed_as_single_piece():
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
    silicone = silicone_to_mix(plates_of(layout.spec))
    assert (silicone.pads, silicone.pad) == approx((1, 1e-9 * area * depth), rel=1e-9)
    result = {solid.name: manifold(tessellate(solid)) for solid in jig(layout)}
    assert result["jig-elastomer"].slice(1.0).num_contour() == 4  # outside, two pins, a well
    assert result["jig-target"].slice(1e3 * plates_of(layout.spec).elastomer.upper + 1.0).num_contour() == 3 + 4


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(("gap", "wells"), [(1.0, 2), (0.66, 2), (0.5, 1)])
def test_frame_with_neighbouring_wells_is_single_piece(gap, wells):
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
    result = {solid.name: manifold(tessellate(solid)) for solid in jig(lay_out(spec))}
    assert result["jig-elastomer"].slice(1.0).num_contour() == 3 + wells  # outside, two pins
    assert result["jig-target"].slice(1e3 * plates_of(spec).elastomer.upper + 1.0).num_contour() == 3 + wells


def test_joint_cut_equals_successive_cuts():
    block = box(0.0, 0.0, 0.0, 4e-3, 2e-3, 1e-3)
    tools = [box(0.5e-3, 0.5e-3, 0.5e-3, 2e-3, 1.5e-3, 2e-3), box(1.5e-3, 1e-3, -1e-3, 3e-3, 1.8e-3, 2e-3)]
    # their volumes less what both take of the block
    assert subtract(block, iter(tools), "block").volume == approx(8.0 - 1.5 * 0.5 - 1.2 + 0.5 * 0.5 * 0.5, rel=1e-9)
    assert subtract(block, (), "block") is block
    with pytest.raises(PartsError, match="falls into 2 pieces"):
        subtract(block, [*tools, box(1.7e-3, -1e-3, -1e-3, 1.9e-3, 3e-3, 2e-3)], "block")
    with pytest.raises(PartsError, match="falls into 0 pieces"):
        subtract(block, [*tools, box(-1e-3, -1e-3, -1e-3, 5e-3, 3e-3, 2e-3)], "block")


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("template", ["round_button_12mm", "three_axis_triangle", "grasper_4layer"])
def test_board_press_stands_on_rim_and_clears_mount_and_pieces(template):
    """A frame stood on the mount's rim where boards are thin, and its glue was pressed by nothing."""
    layout = lay_out(load_text(templates.read(template)))
    press = next(solid for solid in jig(layout) if solid.name == BOARD_PRESS)
    mounts = [solid for solid in solids(layout) if solid.role is BodyRole.MOUNT]
    thin = lifted(as_solid(stack.board(layout.outline, layout.spec.fpc.stackup)),
                  -50e-6)  # a board below the mount's rim
    around = (lifted(press, -50e-6), thin, *(as_solid(body) for body in plates_of(layout.spec).all), *mounts)
    assert not [clash for clash in interferences(around) if BOARD_PRESS in clash]
    gaps = {(c.first, c.second): c.gap for c in clearances((around[0], thin))}
    assert gaps[BOARD_PRESS, "board"] == approx(0.0, abs=1e-9)
    assert check_print(press, layout.spec.mount.process).faults == ()
