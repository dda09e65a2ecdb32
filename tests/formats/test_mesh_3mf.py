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


def test_each_part_of_mount_and_jaw_has_3mf_file(files):
    assert set(files) == {f"mount/hand-made-{name}.3mf" for name in ("jaw", "mount", "mount-spacer")}


def test_3mf_archives_have_three_entries_with_fixed_date_and_no_compression(files):
    for data in files.values():
        with zipfile.ZipFile(BytesIO(data)) as archive:
            assert archive.namelist() == ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]
            for entry in archive.infolist():
                assert entry.date_time == (1980, 1, 1, 0, 0, 0)
                assert entry.compress_type == zipfile.ZIP_STORED


def test_3mf_model_is_in_millimetres_with_name_and_colour(files):
    with zipfile.ZipFile(BytesIO(files["mount/hand-made-mount.3mf"])) as archive:
        model = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    assert model.get("unit") == "millimeter"
    assert model.find(f".//{CORE}object").get("name") == "mount"
    assert model.find(f".//{CORE}base").get("displaycolor") == "#DFE6E9FF"
    heights = [float(vertex.get("z")) for vertex in model.iter(f"{CORE}vertex")]
    assert (min(heights), max(heights)) == approx((0.0, 1.2), abs=1e-6)


@pytest.mark.needs("networkx", "lxml")
def test_trimesh_reads_watertight_3mf_with_volume_of_solid(files):
    import trimesh

    for solid in handmade.solids("jaw"):
        data = files.get(f"mount/hand-made-{solid.name}.3mf")
        if data is not None:
            body = trimesh.load(BytesIO(data), file_type="3mf", force="mesh")
            assert body.is_watertight
            assert body.volume == approx(solid.shape.volume, rel=2e-3)


def test_sensor_without_mount_has_no_3mf_file():
    assert meshes.render_3mf(handmade.solids("bare"), handmade.layout("bare").spec) == {}
