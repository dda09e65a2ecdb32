"""A stage alone writes the files that docs/package.md lists for it, as a whole build does."""

from __future__ import annotations

import re

import pytest

import sitscad
from sitscad.estimates.design import Design
from sitscad.files.writer import STAGES
from sitscad.package.folder import list_files

pytestmark = [pytest.mark.cad, pytest.mark.slow]

SPEC = """sitscad: 1
name: staged
coil: {shape: circle, outer_diameter: 8, turns: 10, layers: 2, trace_width: 0.16, trace_spacing: 0.16}
target: {size: 8}
elastomer: {size: 8, thickness: 2}
mount: {kind: bench-plate, standoff: 2}
requirements: {normal_force: 5 N}
"""

ROWS = {
    "live.html": ("firmware", "report"), "report.html": ("report",), "fit.svg": ("report",), "fpc/": ("gerber",),
    "kicad/": ("kicad",), "laser/": ("laser",), "mount/": ("mount", "assembly"), "mesh/": ("mesh",),
    "datasheet.html": ("datasheet",), "calibration/": ("calibration",), "firmware/": ("firmware",), "spec/": (),
    "bom.csv": ("report",), "manifest.json": (),
}
"""The first name of each row of the page's table, with the stages that make it: none if every build does."""

ALWAYS = {"estimate.json", "findings.json", "manifest.json", "spec/spec.yaml"}
OF_ALL = {"estimate.json", "findings.json", "manifest.json", "report.html"}
"""Files that say something of the whole package."""

ASSEMBLED = re.compile(r"mount/(assembly\..*|fit.*|.*-jaw-drawing\..*)")


def stages_of(name):
    """The stages that have to be asked for before a file is made; none where every build makes it."""
    if name in ALWAYS:
        return ()
    row = "datasheet.html" if name.startswith("datasheet.") else f"{name.partition('/')[0]}/" if "/" in name else name
    stages = ROWS[row]
    if row == "mount/":
        return ("assembly",) if ASSEMBLED.fullmatch(name) else ("mount",)
    return stages


@pytest.fixture(scope="module")
def design():
    return Design(sitscad.load_text(SPEC))


@pytest.fixture(scope="module")
def whole(design, tmp_path_factory):
    folder = sitscad.build(design, tmp_path_factory.mktemp("whole")).directory
    return {name: (folder / name).read_bytes() for name in list_files(folder)}


def test_every_row_of_package_page_has_its_stage(root):
    page = (root / "docs" / "package.md").read_text(encoding="utf-8")
    rows = re.findall(r"(?m)^\| `([^`]+)`", page.partition("\n## ")[0])
    assert [row for row in rows if "." in row or row.endswith("/")] == list(ROWS)


@pytest.mark.few(4)
@pytest.mark.parametrize("stage", STAGES)
def test_single_stage_writes_files_of_whole_build(stage, design, whole, tmp_path):
    folder = sitscad.build(design, tmp_path, only=(stage,)).directory
    request = {stage, "assembly"} if stage == "mount" else {stage}
    assert set(list_files(folder)) == {name for name in whole if set(stages_of(name)) <= request}
    other = [name for name in list_files(folder) if (folder / name).read_bytes() != whole[name]]
    # the steps end with what a package lacks
    assert set(other) <= OF_ALL | {"mount/assembly.txt"}


def test_stl_and_3mf_are_written_with_the_mount_stage(whole):
    for name in ("mount/staged-mount.step", "mount/staged-mount.stl", "mount/staged-mount.3mf"):
        assert name in whole and stages_of(name) == ("mount",)
