"""The whole assembly as it is glued: nothing in anything, nothing missing, the tail as long bent as flat."""

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
import shapely
from solid_pairs import interferences
from tolerance import approx

import sitscad
from sitscad.assembly import solids as parts
from sitscad.assembly.places.bodies import BodyRole, backing_of
from sitscad.assembly.places.column import column, layer_heights
from sitscad.assembly.places.tail_path import BentStretch, Station, tail_path

TEMPLATES = Path(__file__).parents[2] / "templates"
pytestmark = pytest.mark.cad


@pytest.fixture(scope="module")
def layout():
    return sitscad.lay_out(sitscad.load(TEMPLATES / "grasper_4layer.yaml"))


@pytest.fixture(scope="module")
def pieces(layout):
    from sitscad.assembly.solids.whole import whole

    return {solid.name: solid for solid in whole(layout)}


@pytest.mark.slow
def test_whole_assembly_has_all_pieces_without_overlap(layout, pieces):
    assert not interferences(tuple(pieces.values()))
    wanted = {"jaw", "opposing-jaw", "shield", "mount", "elastomer", "target", "encapsulation", "stiffener"}
    wanted |= {f"glue-{part}" for part in ("shield", "mount", "board", "elastomer", "target")}
    wanted |= {f"copper-{layer}-{coil}" for layer in (1, 2, 3, 4) for coil in ("C1", "C2")}
    assert wanted < set(pieces)
    assert all(solid.shape.is_valid for solid in pieces.values())


@pytest.mark.slow
def test_assembled_heights_match_column(layout, pieces):
    at = layer_heights(column(layout))
    board = at["board"][1].nominal
    for part in ("jaw", "shield", "mount", "elastomer", "target", "opposing-jaw"):
        low = pieces[part].shape.bounding_box().min.Z * 1e-3
        assert low == approx(at[part][0].nominal - board, abs=1e-9), part
    for layer in layout.spec.fpc.stackup.copper:
        bounds = pieces[f"copper-{layer.number}-C1"].shape.bounding_box()
        assert approx(layer.z, abs=1e-9) == (bounds.min.Z + bounds.max.Z) / 2e3


def test_films_fill_board(layout, pieces):
    """Coverlay, copper, filling and dielectric of the body together are as large as the board's body without films."""
    films = [s for s in pieces.values() if s.name.startswith(("board-", "copper-"))]
    coverlay = pieces["board-1-coverlay"].volume / layout.spec.fpc.stackup.layers[0].thickness
    assert sum(s.volume for s in films) == approx(coverlay * layout.spec.fpc.stackup.thickness, rel=1e-9)


def test_bent_tail_has_volume_of_flat_tail(layout, pieces):
    """A film above the middle of the tail is stretched by one bend and shortened by the other, which is equal."""
    path = tail_path(layout)
    assert path.radius and not path.reason
    assert path.length == approx(layout.tail_length, rel=1e-6)
    straight = sitscad.lay_out(layout.spec.replace("fpc.tail.bend", "none"))
    from sitscad.assembly.solids.whole import board_layer_solids

    there = {solid.name: solid for solid in board_layer_solids(straight, tail_path(straight), (0.0, 0.0))}
    for name in ("tail-1-coverlay", "tail-3-dielectric", "tail-5-coverlay"):
        assert pieces[name].volume == approx(there[name].volume, rel=1e-6)
    low = min(pieces[name].shape.bounding_box().min.Z for name in pieces if name.startswith("tail-"))
    face = pieces["jaw"].shape.bounding_box().max.Z
    assert low == approx(face, abs=1e-6)


def test_bends_have_radius_and_end_level(layout):
    path = tail_path(layout)
    thickness = math.fsum(layer.thickness for layer in layout.spec.fpc.tail_layers)
    for stretch in path.stretches:
        if stretch.turn:
            assert stretch.length / abs(stretch.turn) == approx(path.radius + thickness / 2, rel=1e-6)
    assert math.fsum(stretch.turn for stretch in path.stretches) == approx(0.0, abs=1e-12)
    opened = tail_path(layout, math.radians(30))
    assert math.fsum(stretch.turn for stretch in opened.stretches) == approx(-math.radians(30), rel=1e-6)


def test_station_after_half_circle_is_opposite():
    end = Station(0.0, 0.0, 0.0).after(BentStretch(math.pi, math.pi))
    assert (end.x, end.z, end.angle) == approx((0.0, 2.0, math.pi), rel=1e-6, abs=1e-12)


@pytest.mark.slow
def test_sensor_without_jaw_is_assembled():
    from sitscad.assembly.solids.whole import whole

    spec = sitscad.load(TEMPLATES / "three_axis_pad.yaml")
    layout = sitscad.lay_out(replace(spec, mount=None))
    result = {solid.name: solid for solid in whole(layout)}
    assert {"glue-elastomer", "glue-target", "elastomer", "target", "tail-1-coverlay"} < set(result)
    assert {solid.role for solid in result.values()} >= {BodyRole.COPPER, BodyRole.GLUE, BodyRole.BOARD}
    lift = result["target"].shape.bounding_box().min.Z - result["elastomer"].shape.bounding_box().size.Z
    assert lift == approx(2e3 * spec.assembly.glue_line, rel=1e-6)


@pytest.mark.slow
def test_metal_finger_is_drawn_and_not_weighed():
    """What the coils of a fingertip see was in no picture."""
    from sitscad.assembly.solids.whole import weigh, whole
    from sitscad.files.documents.mounting import render_picture

    spec = sitscad.load(TEMPLATES / "fingertip_foil.yaml")
    plain = sitscad.lay_out(spec)
    finger = replace(spec.mount.finger, material=spec.target.material)
    metal = replace(plain, spec=replace(spec, mount=replace(spec.mount, finger=finger)))
    result = whole(metal)
    assert {s.name for s in result} - {s.name for s in whole(plain)} == {"finger"}
    (drawn,), (cap,) = ([s for s in result if s.name == name] for name in ("finger", "mount"))
    box, (width, height) = drawn.shape.bounding_box(), finger.size
    assert approx((1e3 * width, 1e3 * height), rel=1e-6) == (box.size.Y, box.size.Z)
    board = -1e3 * spec.fpc.stackup.thickness - 1e3 * spec.assembly.glue_line
    assert board - box.max.Z == approx(1e3 * spec.mount.standoff, rel=1e-6)
    assert (drawn.shape & cap.shape) is None or (drawn.shape & cap.shape).volume < 1e-6
    assert box.max.X > cap.shape.bounding_box().max.X, "it is seen to go on"
    assert "finger" not in {weight.name for weight in weigh(metal, result)}
    assert b"finger: aluminium, 10 mm" in render_picture(metal, parts.solids(metal))["mount/assembly.svg"]


def test_weight_includes_leads_contacts_and_tail_copper(layout, pieces):
    """Against the exact union of all copper on each layer (shapely): joints are counted twice, by 3 % at most."""
    from sitscad.assembly.solids.whole import balance, weigh

    result = weigh(layout, tuple(pieces.values()))
    rings = sum(w.volume * w.share for w in result if w.material == "copper" and w.name.startswith("copper-"))
    leads = {w.name: w.copper for w in result if w.copper}
    thickness = [layer.thickness for layer in layout.spec.fpc.stackup.copper]
    exact = sum(a.polygon.area * thickness[a.layer - 1] for a in sitscad.areas(layout) if a.what == "copper")
    assert exact < rings + sum(leads.values()) < 1.03 * exact
    beyond = shapely.box(layout.body[2], -1.0, 1.0, 1.0)
    of_tail = sum(
        a.polygon.intersection(beyond).area * thickness[a.layer - 1]
        for a in sitscad.areas(layout)
        if a.what == "copper"
    )
    found_there = sum(volume for name, volume in leads.items() if name.startswith("tail-"))
    assert 0.4e-9 < of_tail < found_there < 1.06 * of_tail  # the films of the tail begin a little inside the body
    weight = next(w for w in result if w.name == "tail-2-fill")
    assert weight.mass == approx(weight.volume * 1250.0 + weight.copper * (8960.0 - 1250.0), rel=1e-6)
    without = [w.volume * w.share * w.density for w in result if not w.is_carrier]
    sensor = balance(tuple(w for w in result if not w.is_carrier))
    assert sensor.mass - sum(without) == approx(sum(leads.values()) * (8960.0 - 1250.0), rel=1e-6)


@pytest.mark.parametrize(
    "mount", ["{kind: fingertip, standoff: 1.2, %s}", "{kind: bench-plate, standoff: 2, %s}", "{kind: custom, %s}"]
)
def test_metal_behind_is_drawn_in_place_and_not_weighed(mount):
    from sitscad.assembly.solids.whole import weigh, whole

    text = (TEMPLATES / "fingertip_foil.yaml").read_text(encoding="utf-8")
    there = mount % "metal_behind: {material: aluminium, distance: 3, thickness: 2}"
    text = re.sub(r"^mount: .*$", f"mount: {there}", text, flags=re.MULTILINE)
    layout = sitscad.lay_out(sitscad.load_text(text))
    result = whole(layout)
    drawn = next(solid for solid in result if solid.name == "metal-behind")
    box = drawn.shape.bounding_box()
    assert approx((1e3 * backing_of(layout.spec).metal_face, 2.0), rel=1e-6) == (box.max.Z, box.size.Z)
    assert box.size.Y > 10.0, "wider than the coil"
    for other in result:
        if other.name.startswith("mount"):
            shared = drawn.shape & other.shape
            assert shared is None or shared.volume < 1e-6
    assert "metal-behind" not in {weight.name for weight in weigh(layout, result)}
