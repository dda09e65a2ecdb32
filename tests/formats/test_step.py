"""STEP files read back by OpenCASCADE: shapes, places, names, colours; and nothing in them that depends on the day."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import handmade
import pytest
from tolerance import approx

from sitscad.files.formats import step

pytestmark = pytest.mark.cad


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    solids, spec = handmade.solids("jaw"), handmade.layout("jaw").spec
    return step.render(solids, spec) | step.render_whole(solids, spec)


def read(data: bytes, folder: Path):
    import build123d as bd

    path = folder / "read.step"
    path.write_bytes(data)
    return bd.import_step(path)


def test_each_part_and_the_assembly_have_step_file(files):
    pieces = {f"mount/hand-made-{name}.step" for name in ("jaw", "mount", "mount-spacer")}
    assert set(files) == {*pieces, "mount/assembly.step"}


def test_sensor_without_mount_has_no_step_file():
    assert step.render(handmade.solids("bare"), handmade.layout("bare").spec) == {}


@pytest.mark.slow
def test_step_assembly_contains_each_solid_in_place_named_and_coloured(files, tmp_path):
    whole = read(files["mount/assembly.step"], tmp_path)
    wanted = handmade.solids("jaw")
    assert [child.label for child in whole.children] == [solid.name for solid in wanted]
    for child, solid in zip(whole.children, wanted, strict=True):
        assert child.is_valid
        assert child.volume == approx(solid.shape.volume, rel=1e-6)
        ours, theirs = solid.shape.bounding_box(), child.bounding_box()
        assert tuple(theirs.min) == approx(tuple(ours.min), abs=1e-5)
        assert tuple(theirs.max) == approx(tuple(ours.max), abs=1e-5)
        linear = tuple(child.color)[:3]
        assert tuple(_display(value) for value in linear) == approx(solid.rgb, abs=0.01)


@pytest.mark.parametrize("name", ["jaw", "target", "elastomer"])
def test_step_assembly_of_sensor_named_like_a_part_contains_every_part(name, tmp_path):
    """The build ended with "Unique name is required" after all other work was done."""
    solids, spec = handmade.solids("jaw"), replace(handmade.layout("jaw").spec, name=name)
    assert name in {solid.name for solid in solids}
    data = step.render_whole(solids, spec)["mount/assembly.step"]
    assert {child.label for child in read(data, tmp_path).children} == {solid.name for solid in solids}
    products = re.findall(rb"= PRODUCT\('([^']*)'", data)
    assert len(products) == len(set(products)) == len(solids) + 1


def test_step_part_has_volume_of_solid_in_millimetres(files, tmp_path):
    solid = next(s for s in handmade.solids("jaw") if s.name == "mount")
    result = read(files["mount/hand-made-mount.step"], tmp_path)
    assert result.is_valid
    assert result.volume == approx(solid.shape.volume, rel=1e-6)
    assert b"SI_UNIT(.MILLI.,.METRE.)" in files["mount/hand-made-mount.step"]


def test_cadquery_reads_step_assembly_with_equal_volumes(files, tmp_path):
    import cadquery as cq

    path = tmp_path / "assembly.step"
    path.write_bytes(files["mount/assembly.step"])
    volumes = sorted(solid.Volume() for solid in cq.importers.importStep(str(path)).solids().vals())
    assert volumes == approx(sorted(s.shape.volume for s in handmade.solids("jaw")), rel=1e-6)


def test_step_files_do_not_depend_on_earlier_exports(files):
    solids, spec = handmade.solids("jaw"), handmade.layout("jaw").spec
    again = step.render(solids, spec) | step.render_whole(solids, spec)
    assert again == files


def test_step_header_time_is_epoch_or_source_date_epoch(files, monkeypatch):
    for data in files.values():
        assert re.findall(rb"'(\d{4}-\d\d-\d\dT[\d:]+)'", data) == [b"1970-01-01T00:00:00"]
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    data = step.part(handmade.solids("jaw")[1], "mount")
    assert b"'2023-11-14T22:13:20'" in data


def test_step_occurrences_are_numbered_from_one(files):
    numbers = re.findall(rb"NEXT_ASSEMBLY_USAGE_OCCURRENCE\('(\d+)'", files["mount/assembly.step"])
    assert [int(n) for n in numbers] == list(range(1, 10))


def test_step_entities_take_one_line_and_zeros_are_exact(files):
    long = "a-name-" * 14 + "longer-than-a-line-of-opencascade"
    for data in (*files.values(), step.part(handmade.solids("jaw")[1], long)):
        lines = data.decode("ascii").splitlines()
        assert [line for line in lines if not line.endswith(";")] == []
        assert not re.search(rb"[(,]-0\.[,)]", data)
        assert [n for n in re.findall(rb"[(,](-?\d\.\d*E-\d+)(?=[,)])", data) if abs(float(n)) < 1e-14] == []
    assert f"PRODUCT('{long}','{long}'".encode() in data


def _display(linear: float) -> float:
    """Linear light to sRGB (IEC 61966-2-1), as OpenCASCADE reads colours into linear values."""
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055
