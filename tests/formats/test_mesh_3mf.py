"""3MF files: a well-formed package that trimesh and PrusaSlicer read, with nothing in it that depends on the day."""

from __future__ import annotations

import zipfile
from io import BytesIO
from xml.etree import ElementTree

import handmade
import pytest
from tolerance import approx

from sitscad.files.formats import meshes

pytestmark = pytest.mark.cad
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    return meshes.render_3mf(handmade.solids("jaw"), handmade.layout("jaw").spec)


def test_every_piece_of_mount_and_jaw_has_a_file(files):
    assert set(files) == {f"mount/hand-made-{name}.3mf" for name in ("jaw", "mount", "mount-spacer")}


def test_archives_hold_the_three_parts_undated_and_stored(files):
    for data in files.values():
        with zipfile.ZipFile(BytesIO(data)) as archive:
            assert archive.namelist() == ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]
            for entry in archive.infolist():
                assert entry.date_time == (1980, 1, 1, 0, 0, 0)
                assert entry.compress_type == zipfile.ZIP_STORED


def test_the_model_is_in_millimetres_named_and_coloured(files):
    with zipfile.ZipFile(BytesIO(files["mount/hand-made-mount.3mf"])) as archive:
        model = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    assert model.get("unit") == "millimeter"
    assert model.find(f".//{CORE}object").get("name") == "mount"
    assert model.find(f".//{CORE}base").get("displaycolor") == "#DFE6E9FF"
    heights = [float(vertex.get("z")) for vertex in model.iter(f"{CORE}vertex")]
    assert (min(heights), max(heights)) == approx((0.0, 1.2), abs=1e-6)


@pytest.mark.needs("networkx", "lxml")
def test_trimesh_reads_a_closed_body_of_the_solid_s_volume(files):
    import trimesh

    for solid in handmade.solids("jaw"):
        data = files.get(f"mount/hand-made-{solid.name}.3mf")
        if data is not None:
            body = trimesh.load(BytesIO(data), file_type="3mf", force="mesh")
            assert body.is_watertight
            assert body.volume == approx(solid.shape.volume, rel=2e-3)


def test_without_a_mount_there_is_no_file():
    assert meshes.render_3mf(handmade.solids("bare"), handmade.layout("bare").spec) == {}
