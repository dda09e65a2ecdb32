"""`build`: what is made, what is kept, what is refused, and that the same spec gives the same bytes."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sitscad
from sitscad.files.writer import STAGES
from sitscad.package import stages
from sitscad.package.building import locked_staging_folder, require_distinct_names
from sitscad.package.folder import PackageError, list_files

GOOD = """\
sitscad: 1
name: good-coil
coil: {shape: circle, outer_diameter: 10, turns: 12.5, layers: 2, trace_width: 150 um, trace_spacing: 150 um}
target: {shape: square, size: 10, thickness: 0.2, material: copper}
elastomer: {material: ecoflex-00-30, shape: square, size: 10, thickness: 4}
"""
WEAK = """\
sitscad: 1
name: weak-coil
coil: {shape: circle, outer_diameter: 3, turns: 4.5, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
"""
LIGHT = ("gerber", "kicad", "laser", "firmware", "report")


@pytest.fixture(scope="module")
def good():
    """Its coils and pad are solved once for all tests."""
    return sitscad.Design(sitscad.load_text(GOOD, "some/where/good.yaml"))


@pytest.fixture(scope="module")
def fewer_turns():
    return sitscad.Design(sitscad.load_text(GOOD.replace("turns: 12.5", "turns: 12"), "good.yaml"))


@pytest.fixture(scope="module")
def weak():
    return sitscad.Design(sitscad.load_text(WEAK, "weak.yaml"))


def _hashes(directory: Path) -> dict[str, str]:
    return {name: hashlib.sha256((directory / name).read_bytes()).hexdigest() for name in list_files(directory)}


def _outcomes(result) -> dict[str, str]:
    return {stage.name: stage.outcome for stage in result.stages}


@pytest.mark.slow
def test_manifest_lists_every_file_with_hash(good, tmp_path):
    result = sitscad.build(good, tmp_path, LIGHT)
    manifest = json.loads((result.directory / "manifest.json").read_text())
    results = _hashes(result.directory)
    del results["manifest.json"]
    assert {name: entry["sha256"] for name, entry in manifest["files"].items()} == results
    assert manifest["sitscad"] == sitscad.__version__
    assert manifest["spec"] == {
        "name": "good-coil",
        "file": "good.yaml",
        "sha256": hashlib.sha256(GOOD.encode()).hexdigest(),
    }
    assert manifest["forced"] is False
    assert {entry["stage"] for entry in manifest["files"].values()} == {*LIGHT, "check"}
    folders = {name.partition("/")[0] for name in results if "/" in name}
    assert folders == {"fpc", "kicad", "laser", "firmware", "spec"}
    beside = {"bom.csv", "estimate.json", "findings.json", "live.html", "report.html"}
    assert {name for name in results if "/" not in name} == beside


@pytest.mark.slow
def test_json_files_contain_only_file_name_of_spec(good, tmp_path):
    directory = sitscad.build(good, tmp_path, ["report"]).directory
    assert json.loads((directory / "estimate.json").read_text())["spec"] == "good.yaml"
    assert json.loads((directory / "findings.json").read_text())["specs"][0]["spec"] == "good.yaml"
    for name in list_files(directory):
        assert b"some/where" not in (directory / name).read_bytes(), name


@pytest.mark.slow
def test_absent_spec_sections_build_no_files(weak, tmp_path):
    result = sitscad.build(weak, tmp_path, force=True)
    assert not {name.partition("/")[0] for name in list_files(result.directory)} & {"mount", "laser", "mesh"}
    assert {stage.outcome for stage in result.stages if stage.name in ("mount", "laser", "mesh")} == {"none"}


def test_spec_error_stops_build_without_output(weak, tmp_path):
    result = sitscad.build(weak, tmp_path / "outputs")
    assert not result.written
    assert result.checked.exit_code == 1
    assert not (tmp_path / "outputs").exists()


def test_forced_package_is_marked(weak, tmp_path):
    result = sitscad.build(weak, tmp_path, LIGHT, force=True)
    assert result.forced
    directory = result.directory
    assert json.loads((directory / "manifest.json").read_text())["forced"] is True
    rules = [f.rule for f in result.checked.findings if f.severity == sitscad.Severity.ERROR]
    for note in ("FORCED.txt", "fpc/FORCED.txt"):
        assert all(rule in (directory / note).read_text() for rule in rules)
    assert "built with --force" in (directory / "report.html").read_text()


def test_forced_build_of_valid_spec_is_not_marked(good, tmp_path):
    result = sitscad.build(good, tmp_path, ["report"], force=True)
    assert not result.forced
    assert "FORCED.txt" not in list_files(result.directory)


def test_unchanged_package_is_not_rewritten(good, tmp_path):
    first = sitscad.build(good, tmp_path, LIGHT)
    before = {name: (first.directory / name).stat().st_mtime_ns for name in list_files(first.directory)}
    second = sitscad.build(good, tmp_path, LIGHT)
    assert {stage.outcome for stage in second.stages if stage.files} == {"kept"}
    assert {name: (first.directory / name).stat().st_mtime_ns for name in list_files(first.directory)} == before


@pytest.mark.slow
def test_changed_comment_rebuilds_only_report(good, tmp_path):
    sitscad.build(good, tmp_path, LIGHT)
    commented = sitscad.load_text("# a remark\n" + GOOD, "good.yaml")
    outcomes = _outcomes(sitscad.build(commented, tmp_path, LIGHT))
    assert [outcomes[name] for name in ("gerber", "kicad", "laser", "firmware")] == ["kept"] * 4
    assert outcomes["report"] == "made"


@pytest.mark.slow
def test_incremental_build_equals_fresh_build(good, tmp_path):
    changed = sitscad.Design(sitscad.load_text(GOOD.replace("thickness: 4", "thickness: 4.5"), "good.yaml"))
    sitscad.build(good, tmp_path / "a", LIGHT)
    sitscad.build(changed, tmp_path / "a", LIGHT)
    sitscad.build(changed, tmp_path / "b", ["kicad"])
    sitscad.build(changed, tmp_path / "b", LIGHT)
    sitscad.build(changed, tmp_path / "c", LIGHT)
    hashes = [_hashes(tmp_path / out / "good-coil") for out in "abc"]
    assert hashes[0] == hashes[1] == hashes[2]


@pytest.mark.slow
def test_damaged_file_is_rebuilt_and_backed_up(good, tmp_path):
    directory = sitscad.build(good, tmp_path, LIGHT).directory
    before = _hashes(directory)
    (directory / "kicad" / "good-coil.kicad_pcb").write_text("edited by hand")
    (directory / "notes.txt").write_text("mine")
    result = sitscad.build(good, tmp_path, LIGHT)
    assert _outcomes(result)["kicad"] == "made"
    assert _outcomes(result)["gerber"] == "kept"
    assert _hashes(directory) == before
    assert list_files(result.kept_aside) == ["kicad/good-coil.kicad_pcb", "notes.txt"]
    assert (result.kept_aside / "notes.txt").read_text() == "mine"


@pytest.mark.slow
def test_only_option_rebuilds_stage_and_drops_stale_stages(good, fewer_turns, tmp_path):
    sitscad.build(good, tmp_path, LIGHT)
    same = _outcomes(sitscad.build(good, tmp_path, ["gerber"]))
    assert (same["gerber"], same["kicad"], same["laser"], same["report"]) == ("kept",) * 4
    other = sitscad.build(fewer_turns, tmp_path, ["gerber"])
    outcomes = _outcomes(other)
    assert outcomes["gerber"] == "made"
    assert {outcomes[name] for name in ("kicad", "laser", "firmware", "report")} == {"dropped"}
    left = {name.partition("/")[0] for name in list_files(other.directory)}
    assert "fpc" in left and not left & {"kicad", "laser", "firmware", "report.html"}


@pytest.mark.parametrize("only", [["gerbers"], [], ["gerber", "check"]])
def test_unknown_stage_gives_package_error(good, tmp_path, only):
    with pytest.raises(PackageError, match="not a stage"):
        sitscad.build(good, tmp_path, only)
    assert not list(tmp_path.iterdir())


def test_foreign_folder_gives_package_error(good, tmp_path):
    (tmp_path / "good-coil").mkdir()
    (tmp_path / "good-coil" / "thesis.tex").write_text("years of work")
    with pytest.raises(PackageError, match="did not make it"):
        sitscad.build(good, tmp_path, ["gerber"])
    assert _hashes(tmp_path) == {"good-coil/thesis.tex": hashlib.sha256(b"years of work").hexdigest()}


def test_symbolic_link_as_package_gives_package_error(good, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "good-coil").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(PackageError, match="not a folder"):
        sitscad.build(good, tmp_path, ["gerber"])
    assert not list((tmp_path / "elsewhere").iterdir())


@pytest.mark.slow
def test_damaged_manifest_rebuilds_everything(good, tmp_path):
    directory = sitscad.build(good, tmp_path, ["gerber"]).directory
    (directory / "manifest.json").write_text("{")
    result = sitscad.build(good, tmp_path, ["gerber"])
    assert _outcomes(result)["gerber"] == "made"
    assert sitscad.verify(directory).ok


def test_two_specs_with_equal_name_give_package_error(good):
    with pytest.raises(PackageError, match="both have the name"):
        require_distinct_names([good.spec, good.spec])


def test_concurrent_build_gives_package_error(good, tmp_path):
    with locked_staging_folder(tmp_path, "good-coil"), pytest.raises(PackageError, match="another build"):
        sitscad.build(good, tmp_path, ["gerber"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["../x", "/x", "manifest.json", "REPORT.html"])
def test_writer_with_invalid_file_name_leaves_package_unchanged(good, fewer_turns, tmp_path, monkeypatch, name):
    first = sitscad.build(good, tmp_path, ["gerber"]).directory
    before = _hashes(first)
    monkeypatch.setattr(stages.Writer, "render", lambda self, *values: {name: b"x", "report.HTML": b"y"})
    with pytest.raises(PackageError):
        sitscad.build(fewer_turns, tmp_path, ["gerber"])
    assert _hashes(first) == before
    assert os.listdir(tmp_path) == ["good-coil"]


@pytest.mark.slow
def test_failing_writer_leaves_package_unchanged(good, fewer_turns, tmp_path, monkeypatch):
    directory = sitscad.build(good, tmp_path, ["gerber"]).directory
    before = _hashes(directory)

    def refuse(self, *values):
        raise ValueError("it does not fit")

    monkeypatch.setattr(stages.Writer, "render", refuse)
    with pytest.raises(PackageError, match="it does not fit; nothing was changed"):
        sitscad.build(fewer_turns, tmp_path, ["gerber"])
    assert _hashes(directory) == before


@pytest.mark.more
@pytest.mark.slow
def test_missing_cad_kernel_error_lists_possible_stages(good, tmp_path, monkeypatch):
    def missing(_layout):
        raise sitscad.MissingExtra("solids need build123d")

    monkeypatch.setattr("sitscad.assembly.solids.solids", missing)
    with pytest.raises(
        sitscad.MissingExtra, match=r"build123d; .*--only gerber,kicad,laser,firmware,calibration,report"
    ):
        sitscad.build(good, tmp_path)
    assert not (tmp_path / "good-coil").exists()


def test_forced_build_continues_without_failing_writer(weak, tmp_path, monkeypatch):
    real = stages.Writer.render

    def refuse(self, *values):
        if self.module == "files.documents.firmware":
            raise ValueError("no drive code")
        return real(self, *values)

    monkeypatch.setattr(stages.Writer, "render", refuse)
    directory = sitscad.build(weak, tmp_path, LIGHT, force=True).directory
    assert "firmware: no drive code" in (directory / "FORCED.txt").read_text()
    # the wiring, and what is to be read, do not hang on the drive
    assert {path.name for path in (directory / "firmware").iterdir()} == {"wiring", "readme.txt"}


def test_progress_reports_each_stage_once(good, tmp_path):
    text: list[tuple[str, str]] = []
    sitscad.build(good, tmp_path, ["gerber"], progress=lambda stage, outcome, seconds: text.append((stage, outcome)))
    assert [stage for stage, outcome in text if outcome == "start"] == ["check", "gerber"], "nothing else is made"
    ends = [stage for stage, outcome in text if outcome != "start"]
    assert sorted(ends) == sorted(["check", *STAGES]) and (ends[0], ends[-1]) == ("check", "report")


_BUILD = """
import sys
import sitscad
sitscad.build(sitscad.load(sys.argv[1]), sys.argv[2], sys.argv[3].split(","))
assert not {"build123d", "cadquery", "OCP", "gmsh"} & set(sys.modules), "a CAD kernel was imported"
"""


@pytest.mark.slow
def test_build_is_reproducible_across_place_zone_locale_and_hash_seed(tmp_path):
    for number, seed in enumerate(("0", "12345")):
        home = tmp_path / str(number) / ("x" * 5 * number)
        home.mkdir(parents=True)
        (home / "good.yaml").write_text(GOOD)
        zone, locale = (("UTC", "C"), ("Asia/Kathmandu", "de_DE.UTF-8"))[number]
        source = str(Path(sitscad.__file__).parents[1])
        environment = os.environ | {"PYTHONHASHSEED": seed, "TZ": zone, "LC_ALL": locale, "PYTHONPATH": source}
        spec, out = ("good.yaml", "out") if number else (str(home / "good.yaml"), str(home / "out"))
        command = [sys.executable, "-c", _BUILD, spec, out, ",".join(LIGHT)]
        subprocess.run(command, cwd=home, env=environment, check=True)
    item, other = (_hashes(path) for path in sorted(tmp_path.rglob("good-coil")))
    assert item == other
    assert len(item) > 20


class TestVerify:
    """`verify` of a package, whole and damaged."""

    @pytest.mark.slow
    def test_intact_package_passes_verification(self, good, tmp_path):
        pytest.importorskip("gerbonara", reason="reading Gerber files back needs gerbonara")
        result = sitscad.verify(sitscad.build(good, tmp_path, LIGHT).directory)
        assert (result.ok, result.nets) == (True, ("C1",))

    def test_changed_added_and_removed_files_are_listed(self, good, tmp_path):
        directory = sitscad.build(good, tmp_path, ["kicad"]).directory
        (directory / "findings.json").write_text("{}")
        (directory / "estimate.json").unlink()
        (directory / "more.txt").write_text("")
        differences = "\n".join(sitscad.verify(directory).differences)
        for words in ("estimate.json is missing", "findings.json is not the file", "more.txt is not in the manifest"):
            assert words in differences

    @pytest.mark.slow
    def test_joined_nets_are_found_despite_correct_hashes(self, tmp_path):
        pytest.importorskip("gerbonara", reason="reading Gerber files back needs gerbonara")
        array = "array: {pattern: line, count: 2, pitch: 12}\n"
        spec = sitscad.load_text(GOOD.replace("size: 10", "size: 22") + array, "two.yaml")
        result = sitscad.build(spec, tmp_path, ["gerber"], force=True)
        name = "fpc/good-coil-F_Cu.gbr"
        text = (result.directory / name).read_text()
        bridge = "%ADD99C,0.5*%\nD99*\nG01*\nX-6000000Y0D02*\nX6000000Y0D01*\nM02*"
        (result.directory / name).write_text(text.replace("M02*", bridge))
        manifest = json.loads((result.directory / "manifest.json").read_text())
        content = (result.directory / name).read_bytes()
        manifest["files"][name]["sha256"] = hashlib.sha256(content).hexdigest()
        (result.directory / "manifest.json").write_text(json.dumps(manifest))
        differences = sitscad.verify(result.directory).differences
        assert any("C1 and C2 are joined" in difference for difference in differences)

    def test_folder_without_manifest_gives_package_error(self, tmp_path):
        with pytest.raises(PackageError):
            sitscad.verify(tmp_path)
        with pytest.raises(PackageError):
            sitscad.verify(tmp_path / "absent")

    def test_verify_of_output_folder_lists_packages(self, good, tmp_path):
        built = sitscad.build(good, tmp_path, ("firmware",)).directory
        with pytest.raises(PackageError, match=f"it holds {re.escape(str(built))}: name one of these"):
            sitscad.verify(tmp_path)


WIDE = """\
sitscad: 1
name: wide
coil: {shape: circle, outer_diameter: 12, turns: 16, layers: 2, trace_width: 150 um, trace_spacing: 150 um}
array: {pattern: line, count: 4, pitch: 40}
target: {shape: rectangle, size: [150, 60], thickness: 0.3, material: copper}
elastomer: {shape: rectangle, size: [150, 60], thickness: 1}
requirements: {normal_force: 20 N}
"""


@pytest.mark.slow
def test_missing_calibration_states_processor_time_of_target(tmp_path):
    result = sitscad.build(sitscad.load_text(WIDE, "wide.yaml"), tmp_path, ["calibration"], force=True)
    assert _outcomes(result)["calibration"] == "none"
    missing = result.missing(["calibration"])
    assert missing.keys() == {"calibration"} and "processor time" in missing["calibration"]
