"""Areas and solids: the copper that is drawn, apart by net, inside the board, and the same volume as a solid."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from itertools import combinations

import handmade
import pytest
from tolerance import approx

import sitscad
from sitscad.files.export import areas, as_build123d, as_cadquery, as_cadquery_assembly, copper_solids
from sitscad.spec import templates

LAYOUTS = {name: sitscad.lay_out(sitscad.load_text(templates.read(name))) for name in ("bench_7mm", "jaw_5x20")}


@pytest.mark.parametrize("name", LAYOUTS)
def test_exported_copper_areas_of_nets_are_disjoint_and_inside_board(name):
    layout = LAYOUTS[name]
    result = areas(layout)
    (board,) = (area for area in result if area.what == "board")
    copper = [area for area in result if area.what == "copper"]
    assert all(area.polygon.is_valid and board.polygon.contains(area.polygon.buffer(-2e-6)) for area in copper)
    for item, other in combinations(copper, 2):
        if item.layer == other.layer:
            assert item.polygon.distance(other.polygon) > 50e-6
    thickness = layout.spec.fpc.stackup.copper[0].thickness
    assert all(area.upper - area.lower == approx(thickness, rel=1e-6) for area in copper if area.layer == 1)
    assert all(area.upper < 0.0 for area in copper)


def test_exported_coil_area_equals_length_times_width():
    layout = LAYOUTS["bench_7mm"]
    coil = layout.coils[0]
    (result,) = (area for area in areas(layout) if area.layer == 2 and area.net == coil.net)
    tracks = [trace for trace in layout.on_layer(2) if trace.net == coil.net]
    drawn = math.fsum(trace.path.length * trace.width for trace in tracks)
    assert result.polygon.area == approx(drawn, rel=0.03)  # pads and teardrops come on top, holes go off


def test_exported_target_and_elastomer_have_expected_heights_and_areas():
    result = {area.what: area for area in areas(LAYOUTS["jaw_5x20"])}
    spec = LAYOUTS["jaw_5x20"].spec
    assert result["target"].polygon.area == approx(math.prod(spec.target.size), rel=1e-6)
    assert (
        result["target"].lower
        == approx(result["elastomer"].upper, rel=1e-6)
        == approx(spec.elastomer.thickness, rel=1e-6)
    )


@pytest.mark.slow
@pytest.mark.cad
def test_solid_copper_volume_equals_area_times_thickness():
    pytest.importorskip("build123d")
    layout = sitscad.lay_out(
        sitscad.load_text(templates.read("bench_7mm")).replace({"coil.turns": 3, "array": {"pattern": "single"}})
    )
    solids = copper_solids(layout, 20e-6)
    flat = [area for area in areas(layout, 20e-6) if area.what == "copper"]
    drawn = math.fsum(area.polygon.area * (area.upper - area.lower) for area in flat)
    assert math.fsum(solid.volume for solid in solids) == approx(drawn, rel=1e-6)
    assert all(solid.shape.is_valid and solid.shape.bounding_box().max.Z < 0.0 for solid in solids)
    pytest.importorskip("cadquery")
    volumes = {name: sum(s.Volume() for s in work.vals()) for name, work in as_cadquery(solids).items()}
    assert math.fsum(volumes.values()) * 1e-9 == approx(drawn, rel=1e-6)


@pytest.mark.cad
def test_build123d_and_cadquery_exports_have_equal_named_coloured_shapes(tmp_path):
    """In place, the very shapes; what each program writes into a STEP file has our names and colours."""
    import build123d as bd

    solids = (*handmade.solids("jaw"), replace(handmade.piece("jaw", "target"), name="elastomer"))
    model, whole = as_build123d(solids, "grasper"), as_cadquery_assembly(solids, "grasper")
    single = {solid.name: solid for solid in solids if solid.name != "elastomer"}
    assert model.label == whole.name == "grasper" and len(model.children) == len(single) + 1
    for child in model.children:
        if child.label in single:
            assert child.wrapped.IsSame(single[child.label].shape.wrapped), child.label
            assert whole.objects[child.label].obj.wrapped.IsSame(child.wrapped)
            assert whole.objects[child.label].metadata == {"material": single[child.label].material}
    assert all(solid.shape.parent is None for solid in solids)
    pad = next(child for child in model.children if child.label == "elastomer")
    assert len(pad.solids()) == len(whole.objects["elastomer"].obj.Solids()) == 2
    bd.export_step(model, str(tmp_path / "bd.step"))
    whole.export(str(tmp_path / "cq.step"))
    for name in ("bd.step", "cq.step"):
        text = (tmp_path / name).read_text(encoding="ascii")
        colours = {tuple(map(float, c.split(","))) for c in re.findall(r"COLOUR_RGB\('',([\d.,E+-]+)\)", text)}
        for solid in single.values():
            assert any(c == approx(solid.rgb, abs=1e-6) for c in colours), (name, solid.name)
            assert f"PRODUCT('{solid.name}'" in text, (name, solid.name)
