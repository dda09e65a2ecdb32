"""STL files through trimesh and admesh, and PrusaSlicer."""

from __future__ import annotations

import re
import subprocess
from io import BytesIO

import handmade
import numpy as np
import pytest
from tolerance import approx

from sitscad.assembly.solids.solid import NotManifold, TriangleMesh, tessellate
from sitscad.files.formats import meshes

pytestmark = pytest.mark.cad


@pytest.fixture(scope="module", params=["jaw", "bench"])
def sensor(request) -> str:
    return request.param


@pytest.fixture(scope="module")
def files(sensor) -> dict[str, bytes]:
    return meshes.render_stl(handmade.solids(sensor), handmade.layout(sensor).spec)


def test_stl_meshes_are_watertight_on_print_bed_with_volume_of_solid(sensor, files):
    import trimesh

    solids = {f"mount/{handmade.layout(sensor).spec.name}-{s.name}.stl": s for s in handmade.solids(sensor)}
    assert files
    for name, data in files.items():
        body = trimesh.load(BytesIO(data), file_type="stl")
        assert body.is_watertight, name
        assert body.volume == approx(solids[name].shape.volume, rel=2e-3)
        assert body.bounds[0] == approx((0.0, 0.0, 0.0), abs=1e-6)
        size = solids[name].shape.bounding_box().size
        assert body.bounds[1] == approx(tuple(size), abs=0.005)


@pytest.mark.clients("admesh")
def test_admesh_finds_no_open_or_reversed_facets(files, tmp_path):
    for data in files.values():
        path = tmp_path / "part.stl"
        path.write_bytes(data)
        text = subprocess.run(["admesh", str(path)], capture_output=True, text=True, check=True).stdout
        assert re.search(r"Total disconnected facets\s*:\s*0\s+0\b", text), text
        for defect in ("Backwards edges", "Degenerate facets", "Facets reversed"):
            assert re.search(rf"{defect}\s*:\s*0\b", text), text


@pytest.mark.clients("prusa-slicer")
@pytest.mark.slow
@pytest.mark.parametrize("render", [meshes.render_stl, meshes.render_3mf])
def test_prusaslicer_slices_each_part(render, tmp_path):
    for name, data in render(handmade.solids("jaw"), handmade.layout("jaw").spec).items():
        path, out = tmp_path / name.rpartition("/")[2], tmp_path / "out.gcode"
        path.write_bytes(data)
        layers = ["--layer-height", "0.1", "--first-layer-height", "0.1", "--nozzle-diameter", "0.2"]
        subprocess.run(["prusa-slicer", "--export-gcode", *layers, "-o", out, path], check=True, capture_output=True)
        assert out.read_text().count("G1 ") > 100, name


def test_open_or_reversed_mesh_raises_not_manifold():
    mesh = tessellate(handmade.solids("jaw")[1])
    with pytest.raises(NotManifold, match="mount"):
        meshes.stl(TriangleMesh("mount", mesh.vertices, mesh.triangles[1:]))
    with pytest.raises(NotManifold):
        meshes.stl(TriangleMesh("mount", mesh.vertices, np.fliplr(mesh.triangles)))


def test_sensor_without_mount_has_no_stl_file():
    assert meshes.render_stl(handmade.solids("bare"), handmade.layout("bare").spec) == {}
