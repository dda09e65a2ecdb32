"""Everything of a forced package that somebody orders or builds from says so, in the same words."""

from __future__ import annotations

import csv
import json

import pytest

import sitscad
from sitscad.files.drawing.frame import FORCED
from sitscad.spec import templates

pytestmark = pytest.mark.cad

MARKED = ("laser/readme.txt", "laser/{name}-target.dxf", "laser/{name}-elastomer.svg", "laser/{name}-shield.dxf",
          "bom.csv", "mount/assembly.txt", "firmware/ldc1614_config.h", "firmware/ldc1614_config.json",
          "firmware/sensor_config.h", "firmware/readme.txt",
          "calibration/calibration.h", "calibration/calibration.json", "calibration/calibration.html",
          "calibration/plan.txt")


def built(tmp_path, name, change, force=True):
    text = templates.read("grasper_4layer").replace("name: grasper-4layer", f"name: {name}")
    assert change[0] in text
    spec = sitscad.load_text(text.replace(*change))
    only = ("laser", "assembly", "firmware", "calibration", "report")
    return sitscad.build(spec, tmp_path, only=only, force=force)


@pytest.mark.more
@pytest.mark.slow
def test_every_working_file_of_forced_package_is_marked(tmp_path):
    done = built(tmp_path, "forced", ("  thickness: 0.65", "  thickness: 1.25"))
    assert done.written and not done.checked.ok
    for path in MARKED:
        text = (tmp_path / "forced" / path.format(name="forced")).read_text()
        assert FORCED in text, path
    first, *_ = csv.DictReader((tmp_path / "forced/bom.csv").open())
    assert (first["item"], first["quantity"], first["note"]) == ("warning", "0", FORCED)
    assert json.loads((tmp_path / "forced/firmware/ldc1614_config.json").read_text())["warning"] == FORCED


@pytest.mark.more
@pytest.mark.slow
def test_errors_found_on_solids_are_in_order_archive(tmp_path):
    text = templates.read("grasper_4layer").replace("  thickness: 0.65", "  thickness: 1.25")
    done = sitscad.build(sitscad.load_text(text), tmp_path, only=("gerber", "mount"), force=True)
    assert {"SIT303", "SIT321"} <= {each.rule for each in done.checked.findings if each.severity.value == "error"}
    assert sitscad.verify(done.directory).ok


@pytest.mark.more
@pytest.mark.slow
def test_package_without_errors_is_not_marked(tmp_path):
    done = built(tmp_path, "fine", ("coil:", "coil:"), force=False)
    assert done.written
    for path in (tmp_path / "fine").rglob("*"):
        assert not path.is_file() or FORCED.encode() not in path.read_bytes(), path
