"""Builds that do no more than they must: nothing for what is the same, only what depends on a changed value, and a
comparison that names what is stale.
"""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool
from functools import cache
from pathlib import Path

import pytest

import sitscad
from sitscad.basics.finding import Edit
from sitscad.package import stages
from sitscad.package.building import stale
from sitscad.package.contents import UNREAD
from sitscad.package.manifest import read_manifest
from sitscad.spec import templates
from sitscad.spec.yaml.rewriting import rewritten

ROOT = Path(__file__).parents[2]
TEXT = templates.read("grasper_4layer")
SMALL = """sitscad: 1
name: small
coil: {shape: circle, outer_diameter: 8, turns: 10, layers: 2, trace_width: 0.16, trace_spacing: 0.16}
target: {size: 8}
elastomer: {size: 8, thickness: 2}
mount: {kind: bench-plate, standoff: 2}
requirements: {normal_force: 5 N}
"""
"""A sensor with parts of every stage and few solids."""

LIGHT = ("kicad", "laser")
SOLID = ("mount", "mesh")

ELECTRICAL = {
    "readout.clock": "39 MHz",
    "readout.scan_rate": "400 Hz",
    "readout.capacitance": "330 pF",
    "requirements.normal_force": "4.1 N",
    "requirements.shear_force": "0.7 N",
    "requirements.bandwidth": "90 Hz",
    "requirements.temperature": "37 degC",
}


@cache
def design_of(text: str) -> sitscad.Design:
    """A design whose coils and pad are solved once for all builds of it."""
    return sitscad.Design(sitscad.load_text(text, "sensor.yaml"))


def changed(key: str, value: str, text: str = TEXT) -> str:
    """The template with one value changed."""
    result = rewritten(text, [Edit(key, value)])
    assert result != text
    return result


def files_of(text: str, stages: tuple[str, ...], folder: Path) -> dict[str, bytes]:
    """The files of some stages, built anew."""
    result = sitscad.build(design_of(text), folder, stages, force=True)
    manifest = read_manifest(result.directory)
    return {
        name: (result.directory / name).read_bytes() for name, entry in manifest.files.items() if entry.stage in stages
    }


@pytest.fixture(scope="module")
def before(tmp_path_factory) -> dict[str, bytes]:
    return files_of(TEXT, LIGHT, tmp_path_factory.mktemp("before"))


def test_unread_sections_of_stages_match_tested_keys():
    assert {stage for stage, unread in UNREAD.items() if set(unread) == {"requirements", "readout", "source"}} == {
        *LIGHT,
        *SOLID,
    }
    assert set(UNREAD["assembly"]) == {"readout", "source"}, "pictures are drawn at the required force"


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("key", ELECTRICAL)
def test_electrical_values_do_not_change_drawn_files(key, before, tmp_path):
    assert files_of(changed(key, ELECTRICAL[key]), LIGHT, tmp_path) == before


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "key", "value"), [("grasper_4layer", "shield.thickness", "0.09"), ("bench_7mm", "target.size", "30")]
)
def test_bend_lines_in_kicad_follow_changed_mount(name, key, value, tmp_path):
    """A thicker shield lets the tail down deeper, a larger target widens the plate under it: stale lines once."""
    text = templates.read(name).replace("bend: static", "bend: {angle: 30 deg}")
    sitscad.build(design_of(text), tmp_path, ("kicad",), force=True)
    spec = design_of(changed(key, value, text))
    (drawn,) = sitscad.build(spec, tmp_path, ("kicad",), force=True).directory.glob("kicad/*.kicad_pcb")
    (fresh,) = sitscad.build(spec, tmp_path / "fresh", ("kicad",), force=True).directory.glob("kicad/*.kicad_pcb")
    assert drawn.read_bytes() == fresh.read_bytes()


@pytest.mark.more
@pytest.mark.cad
@pytest.mark.slow
def test_electrical_values_do_not_change_solid_files(tmp_path):
    text = TEXT
    for key, value in ELECTRICAL.items():
        text = changed(key, value, text)
    assert text != TEXT
    assert files_of(text, SOLID, tmp_path / "after") == files_of(TEXT, SOLID, tmp_path / "before")


@pytest.mark.more
@pytest.mark.cad
@pytest.mark.slow
def test_changed_readout_rewrites_only_assembly_text(tmp_path, monkeypatch):
    """assembly.txt has what the coils read; solids stay, and are what a fresh build makes, beside all else or not."""
    other = changed("readout.capacitance", "330 pF", changed("readout.scan_rate", "400 Hz"))
    first = files_of(TEXT, ("assembly",), tmp_path)
    monkeypatch.setattr("sitscad.assembly.solids.whole.whole", None)  # nothing is put together again
    again = files_of(other, ("assembly",), tmp_path)
    monkeypatch.undo()
    assert {name for name in first if first[name] != again[name]} == {"mount/assembly.txt"}
    assert again == files_of(other, ("assembly",), tmp_path / "fresh")
    spec, only = design_of(other), ("assembly", "datasheet")
    beside = sitscad.build(spec, tmp_path / "beside", only, jobs=2)
    assert {name: (beside.directory / name).read_bytes() for name in again} == again
    made = [name for name, outcome in outcomes(beside).items() if outcome == "made"]
    assert made == ["assembly", "datasheet", "check"]


@pytest.mark.cad
@pytest.mark.slow
def test_assembly_steps_list_stages_missing_from_growing_package(tmp_path):
    """Steps of `--only mount` said which files are lacking, also once these were there."""
    spec = design_of(SMALL)

    def lacking(only):
        folder = sitscad.build(spec, tmp_path, only=only).directory
        return re.findall(r"--only\s+([a-z]+)", (folder / "mount/assembly.txt").read_text())

    assert lacking(("mount",)) == ["gerber", "laser", "firmware", "report"]
    assert lacking(("laser",)) == ["gerber", "laser", "firmware", "report"]  # the steps are kept as they are
    assert lacking(("mount", "report")) == ["gerber", "firmware"]
    assert lacking(("mount",)) == ["gerber", "firmware"]


@pytest.mark.slow
def test_killed_solid_process_stops_build_and_leaves_package(tmp_path, monkeypatch):
    """By too little memory, mostly: the package before stays as it is, and the error is told."""
    spec = sitscad.load_text(SMALL, "sensor.yaml")  # of no other test, which may have its solids
    before = sitscad.build(spec, tmp_path, ("report",))
    stamps = {path: path.stat().st_mtime_ns for path in before.directory.rglob("*")}
    monkeypatch.setattr(stages, "_render_solids", os.abort)  # ends in the other process, whatever it is given
    with pytest.raises(BrokenProcessPool, match="solids"):
        sitscad.build(spec, tmp_path, ("mesh", "datasheet", "report"), jobs=2)
    assert {path: path.stat().st_mtime_ns for path in before.directory.rglob("*")} == stamps


@pytest.mark.cad
@pytest.mark.slow
@pytest.mark.more
def test_longer_tail_rebuilds_no_mount(tmp_path):
    """Neither is anything of it made, nor would a fresh build make other bytes."""
    longer = changed("fpc.tail.length", "40")
    first = sitscad.build(design_of(TEXT), tmp_path, SOLID)
    again = sitscad.build(design_of(longer), tmp_path, SOLID)
    assert [outcomes(first)[stage] for stage in SOLID] == ["made", "made"]
    assert [outcomes(again)[stage] for stage in (*SOLID, "assembly")] == ["kept", "kept", "made"]
    assert files_of(longer, SOLID, tmp_path / "fresh") == files_of(TEXT, SOLID, tmp_path / "before")


def outcomes(result: sitscad.BuildResult) -> dict[str, str]:
    return {stage.name: stage.outcome for stage in result.stages}


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "made"),
    [
        (("readout.clock", "39 MHz"), {"gerber", "firmware", "check", "report"}),
        (("encapsulation.thickness", "0.07"), {"gerber", "kicad", "laser", "firmware", "check", "report"}),
        (("coil.turns", "6.75"), {"gerber", "kicad", "laser", "firmware", "check", "report"}),
    ],
)
def test_changed_value_rebuilds_only_dependent_stages(tmp_path, change, made):
    light = ("gerber", "kicad", "laser", "firmware", "report")
    sitscad.build(design_of(TEXT), tmp_path, light)
    result = sitscad.build(design_of(changed(*change)), tmp_path, light, force=True)
    assert {stage for stage, outcome in outcomes(result).items() if outcome == "made"} == made
    fresh = sitscad.build(design_of(changed(*change)), tmp_path / "fresh", light, force=True)
    for path in sorted(path for path in fresh.directory.rglob("*") if path.is_file()):
        assert path.read_bytes() == (result.directory / path.relative_to(fresh.directory)).read_bytes(), path


# ---------------------------------------------------------------------------------------------------------- no change


@pytest.fixture
def built(tmp_path):
    spec = design_of(TEXT)
    return spec, sitscad.build(spec, tmp_path, ("firmware", "report")), tmp_path


@pytest.mark.slow
def test_second_build_of_unchanged_spec_writes_nothing(built, monkeypatch):
    spec, first, out = built
    stamps = {path: path.stat().st_mtime_ns for path in first.directory.rglob("*")}
    monkeypatch.setattr("sitscad.package.stages.make_stages", None)
    again = sitscad.build(spec, out, ("report",))
    assert again.is_unchanged and again.written and not again.forced
    assert {path: path.stat().st_mtime_ns for path in first.directory.rglob("*")} == stamps
    assert again.checked == first.checked
    assert again.checked.signals and again.checked.fit and again.checked.closing is not None


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("harm", ["a changed file", "a missing file", "a foreign file", "a missing stage", "a date"])
def test_changed_file_stage_or_date_triggers_rebuild(built, monkeypatch, harm):
    spec, first, out = built
    only: tuple[str, ...] = ("report",)
    if harm == "a changed file":
        (first.directory / "report.html").write_text("x")
    elif harm == "a missing file":
        (first.directory / "bom.csv").unlink()
    elif harm == "a foreign file":
        (first.directory / "mine.txt").write_text("x")
    elif harm == "a missing stage":
        only = ("laser",)
    else:
        monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    again = sitscad.build(spec, out, only)
    assert not again.is_unchanged
    assert sitscad.build(spec, out, only).is_unchanged


@pytest.mark.slow
def test_leftovers_of_killed_build_are_removed(built):
    spec, _, out = built
    (out / ".grasper-4layer.new-0123456789ab").mkdir()
    (out / ".grasper-4layer.lock").touch()
    assert not sitscad.build(spec, out, ("report",)).is_unchanged
    assert [path.name for path in out.iterdir()] == ["grasper-4layer"]
    assert sitscad.build(spec, out, ("report",)).is_unchanged


@pytest.mark.slow
def test_stages_built_in_sequence_count_together(built):
    spec, _, out = built
    assert not sitscad.build(spec, out, ("laser",)).is_unchanged
    assert sitscad.build(spec, out, ("laser", "firmware", "report")).is_unchanged


@pytest.mark.slow
def test_forced_package_is_checked_at_every_build(tmp_path):
    spec = design_of(templates.read("grasper_3p5mm"))
    assert sitscad.build(spec, tmp_path, ("firmware",), force=True).forced
    again = sitscad.build(spec, tmp_path, ("firmware",), force=True)
    assert again.forced and not again.is_unchanged and not again.checked.ok
    assert not sitscad.build(spec, tmp_path, ("firmware",)).written


@pytest.mark.slow
def test_second_build_needs_under_half_second_of_processor_time(tmp_path):
    """With every module compiled; the best of some runs, on a machine that has other work."""
    (tmp_path / "sensor.yaml").write_text(TEXT)
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONPYCACHEPREFIX": str(tmp_path / "cache")}
    env.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, "-m", "sitscad", "build", "sensor.yaml", "--only", "gerber,kicad,laser,firmware,report"]
    seconds = []
    for attempt in range(6):
        start = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=300, check=True)
        end = resource.getrusage(resource.RUSAGE_CHILDREN)
        if attempt:
            assert "(unchanged)" in done.stdout
            seconds.append(end.ru_utime + end.ru_stime - start.ru_utime - start.ru_stime)
            if min(seconds) < 0.5:
                return
    pytest.fail(f"it cost {seconds}")


# --------------------------------------------------------------------------------------------------------------- stale


@pytest.mark.slow
def test_stale_files_are_listed_without_writing(built):
    spec, first, out = built
    only = ("firmware", "report")
    fresh = stale(spec, out, only)
    assert fresh.is_unchanged and not fresh.stale
    (first.directory / "bom.csv").unlink()
    (first.directory / "report.html").write_text("mine")
    (first.directory / "more.txt").write_text("mine")
    stamps = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
    other = design_of(changed("readout.clock", "39 MHz"))
    result = stale(other, out, only)
    assert not result.written and not result.is_unchanged
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == stamps
    words = dict(line.split(" ", 1) for line in result.stale)
    assert words["bom.csv"] == "is missing" and words["report.html"] == "was changed by hand"
    assert words["firmware/ldc1614_config.h"] == "is stale" and words["more.txt"] == "is not sitscad's"
    assert not any(name.startswith("fpc/") for name in words), "what was never built is not asked for"
    (without, *_) = stale(other, out, (*only, "gerber")).stale
    assert without.startswith("it was built without gerber (") and "--only firmware,report" in without


@pytest.mark.slow
def test_missing_package_is_stale(tmp_path):
    result = stale(design_of(TEXT), tmp_path / "outputs", ("firmware",))
    assert "manifest.json is missing" in result.stale and not (tmp_path / "outputs").exists()
