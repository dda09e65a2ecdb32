"""`sitscad build` and `sitscad verify` as they are typed."""

from __future__ import annotations

import json
import re
import sys

import pytest

import sitscad

MOUNTED = """\
sitscad: 1
name: mounted-coil
coil: {shape: circle, outer_diameter: 10, turns: 12.5, layers: 2, trace_width: 160 um, trace_spacing: 160 um}
mount: {kind: bench-plate, standoff: 6}
"""
STAGE = re.compile(r"sitscad: \S+: [a-z ,]+ \.\.\.$")
"""A line about a stage at work: a process shows those of its own packages."""

LIGHT = "gerber,kicad,laser,firmware,report"


@pytest.fixture
def without_cad(monkeypatch):
    """A machine on which no CAD kernel is installed."""
    for package in ("build123d", "cadquery", "OCP"):
        monkeypatch.setitem(sys.modules, package, None)


@pytest.mark.slow
def test_build_prints_package_path_and_verify_passes(run, tmp_path):
    done = run("build", "good.yaml", "--only", LIGHT)
    assert done.code == 0
    assert done.out.startswith("outputs/good-coil: ")
    assert "made gerber, kicad" in done.out
    assert "\r" not in done.err, "progress on one line is for terminals"
    assert run("build", "good.yaml", "--only", LIGHT).out.endswith("files (unchanged)\n")
    pytest.importorskip("gerbonara", reason="reading Gerber files back needs gerbonara")
    verified = run("verify", "outputs/good-coil")
    assert (verified.code, verified.err) == (0, "")
    assert verified.out.startswith("ok: ")
    (tmp_path / "outputs/good-coil/findings.json").write_text("{}")
    changed = run("verify", "outputs/good-coil")
    assert changed.code == 1
    assert "findings.json" in changed.out


@pytest.mark.parametrize("directory", [".", "absent", "good.yaml"])
def test_verify_of_folder_without_manifest_exits_2(run, directory):
    done = run("verify", directory)
    assert (done.code, done.out) == (2, "")
    assert "manifest.json" in done.err


def test_strict_build_with_warnings_stops_and_keeps_existing_package(run, tmp_path):
    command = ("build", "good.yaml", "--only", "gerber")
    stopped = run(*command, "--strict")
    assert (stopped.code, stopped.out) == (1, "") and "without --strict" in stopped.err
    assert not (tmp_path / "outputs").exists()
    assert run(*command).code == 0
    built = (tmp_path / "outputs/good-coil/manifest.json").read_bytes()
    assert run(*command, "--strict").code == run(*command, "--strict", "--check").code == 1
    assert (tmp_path / "outputs/good-coil/manifest.json").read_bytes() == built
    assert run(*command, "--strict", "--force").code == 2


@pytest.mark.slow
def test_build_with_errors_stops_and_force_marks_package(run, tmp_path):
    stopped = run("build", "weak.yaml", "--only", LIGHT)
    assert (stopped.code, stopped.out) == (1, "")
    assert "SIT2" in stopped.err
    assert "--force" in stopped.err
    assert not (tmp_path / "outputs").exists()
    forced = run("build", "weak.yaml", "--only", LIGHT, "--force")
    assert forced.code == 0
    assert "marked as forced" in forced.err
    assert (tmp_path / "outputs/weak-coil/FORCED.txt").exists()


def test_build_of_several_specs_returns_highest_exit_code(run, tmp_path):
    done = run("build", "good.yaml", "weak.yaml", "broken.yaml", "--only", "gerber", "-o", "made")
    assert done.code == 2
    assert done.out.startswith("made/good-coil: ")
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["good-coil"]


def test_build_of_two_specs_with_equal_names_is_refused_without_output(run, tmp_path):
    (tmp_path / "twin.yaml").write_text((tmp_path / "good.yaml").read_text())
    done = run("build", "good.yaml", "twin.yaml", "--only", "gerber")
    assert done.code == 2
    assert "good.yaml and twin.yaml both have the name 'good-coil'" in done.err
    assert not (tmp_path / "outputs").exists()


def test_part_without_content_in_spec_is_reported(run):
    for _ in range(2):  # the second finds it unchanged
        done = run("build", "good.yaml", "--only", "datasheet,firmware")
        assert done.code == 0
        assert done.err.count("outputs/good-coil has no datasheet: it takes a target that conducts") == 1
        assert "no firmware" not in done.err


@pytest.mark.more
@pytest.mark.slow
def test_build_without_matplotlib_omits_datasheet(run, tmp_path, monkeypatch):
    text = (tmp_path / "good.yaml").read_text()
    text += "target: {shape: circle, size: 10}\nelastomer: {shape: circle, size: 10}\n"
    (tmp_path / "felt.yaml").write_text(text)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setattr("sitscad.package.manifest.find_spec", lambda name: None)
    for _ in range(2):
        done = run("build", "felt.yaml", "--force")
        assert done.code == 0, done.err
        assert "has no datasheet: it needs matplotlib, which is not installed: pip install 'sitscad[all]'" in done.err
    names = {path.name for path in (tmp_path / "outputs" / "good-coil").iterdir()}
    assert {"fpc", "laser", "report.html"} <= names and "datasheet.pdf" not in names
    named = run("build", "felt.yaml", "--force", "--only", "datasheet")
    assert named.code == 2 and "matplotlib" in named.err


def test_unknown_part_lists_known_parts(run, tmp_path):
    done = run("build", "good.yaml", "--only", "gerbre")
    assert done.code == 2
    assert "gerber, kicad, laser, mount, mesh, assembly, firmware, datasheet, calibration, report" in done.err
    assert not (tmp_path / "outputs").exists()


def test_build_without_cad_names_pip_install_command(run, tmp_path, without_cad):
    (tmp_path / "mounted.yaml").write_text(MOUNTED)
    refused = run("build", "mounted.yaml", "--force")
    assert refused.code == 2
    assert "pip install 'sitscad[all]'" in refused.err
    assert "Traceback" not in refused.err
    assert not list(tmp_path.glob("outputs/*")), "a package is written as a whole or not at all"
    assert run("build", "mounted.yaml", "--force", "--only", "gerber,kicad,laser").code == 0
    files = json.loads((tmp_path / "outputs/mounted-coil/manifest.json").read_text())["files"]
    assert {entry["stage"] for entry in files.values()} == {"gerber", "kicad", "check"}


def test_interrupted_build_keeps_previous_package(run, tmp_path, monkeypatch):
    assert run("build", "good.yaml", "--only", "gerber").code == 0
    before = (tmp_path / "outputs/good-coil/manifest.json").read_bytes()
    (tmp_path / "good.yaml").write_text((tmp_path / "good.yaml").read_text().replace("turns: 12.5", "turns: 12"))

    from sitscad.files.writer import Writer

    def interrupted(self, *values):
        raise KeyboardInterrupt

    monkeypatch.setattr(Writer, "render", interrupted)
    done = run("build", "good.yaml", "--only", "gerber")
    assert done.code == 130
    assert (tmp_path / "outputs/good-coil/manifest.json").read_bytes() == before
    assert [path.name for path in (tmp_path / "outputs").iterdir()] == ["good-coil"]


@pytest.mark.parametrize(("no_color", "coloured"), [("", True), ("1", False)])
def test_terminal_shows_progress_and_colours_unless_no_color_is_set(run, monkeypatch, no_color, coloured):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", no_color)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    done = run("build", "good.yaml", "--only", "gerber")
    assert "\r  gerber    made" in re.sub(r"\x1b\[[\d;]*m", "", done.err)
    assert ("\x1b[" in done.err) is coloured
    assert "\x1b" not in done.out, "only standard error is a terminal here"


def test_piped_build_prints_line_at_start_of_long_stage(run):
    """A build into a pipe said nothing for up to a minute."""
    done = run("build", "good.yaml", "--only", "gerber")
    text = [line for line in done.err.splitlines() if line.endswith(" ...")]
    assert text == ["sitscad: good-coil: check ..."], "gerber is made at once, and nothing else is wanted"
    assert " ..." not in run("build", "good.yaml", "--only", "gerber").err, "nothing is made anew"


def test_version_option_prints_version(run):
    assert run("--version").out == f"sitscad {sitscad.__version__}\n"


@pytest.mark.slow
def test_build_check_lists_stale_files_exits_1_and_writes_nothing(run, tmp_path):
    assert run("build", "good.yaml", "--only", "firmware,report").code == 0
    only = ("--only", "firmware,report")
    fresh = run("build", "good.yaml", "--check", *only)
    assert (fresh.code, fresh.out) == (0, "outputs/good-coil: 29 files (unchanged)\n")
    spec = tmp_path / "good.yaml"
    spec.write_text(spec.read_text() + "readout: {clock: 39 MHz}\n")
    stamp = (tmp_path / "outputs/good-coil/manifest.json").read_bytes()
    stale = run("build", "good.yaml", "--check", *only)
    assert stale.code == 1 and "outputs/good-coil: firmware/ldc1614_config.h is stale\n" in stale.out
    assert "outputs/good-coil is stale: sitscad build good.yaml --only firmware,report makes it anew" in stale.err
    assert (tmp_path / "outputs/good-coil/manifest.json").read_bytes() == stamp
    none = run("build", "good.yaml", "--check", "-o", "a b", *only)
    assert (none.code, none.out) == (1, "a b/good-coil: there is no package, 29 files are missing\n")
    assert "sitscad build good.yaml -o 'a b' --only firmware,report makes it anew" in none.err
    assert run("build", "weak.yaml", "--check").code == 1
    assert run("build", "broken.yaml", "--check").code == 2


def test_messages_of_several_specs_start_with_spec_name(run):
    message = run("build", "good.yaml", "weak.yaml", "--check", "--only", "firmware").err
    lines = [line for line in message.splitlines() if line and not line.startswith((" ", "sitscad: "))]
    assert lines and all(line.startswith(("good.yaml:", "weak.yaml:")) for line in lines)
    assert "weak.yaml: not ok: " in message and "good.yaml: ok: " in message


@pytest.mark.slow
def test_build_check_of_partial_package_fails_without_only(run):
    assert run("build", "good.yaml", "--only", "gerber,report").code == 0
    whole = run("build", "good.yaml", "--check")
    said = whole.out.splitlines()[0]
    assert whole.code == 1 and said.startswith("outputs/good-coil: it was built without kicad (")
    assert "firmware (22 files)" in said and said.endswith(": with --only gerber,report it is compared as it was built")
    assert "kicad/" not in whole.out, "parts that are lacking are named once, not file by file"
    assert run("build", "good.yaml", "--check", "--only", "gerber,report").code == 0
    assert run("build", "good.yaml").code == 0 and run("build", "good.yaml", "--check").code == 0


@pytest.mark.slow
def test_packages_do_not_depend_on_number_of_processes(run, tmp_path):
    text = (tmp_path / "good.yaml").read_text()
    names = [f"coil-{number}" for number in range(3)]
    for name in names:
        (tmp_path / f"{name}.yaml").write_text(text.replace("good-coil", name))
    specs = [f"{name}.yaml" for name in names]
    item = run("build", *specs, "weak.yaml", "--only", "firmware", "-o", "one", "--jobs", "1")
    two = run("build", *specs, "weak.yaml", "--only", "firmware", "-o", "two", "--jobs", "2")
    of_one, of_two = (sorted(line for line in done.err.splitlines() if not STAGE.match(line)) for done in (item, two))
    assert (item.code, two.code) == (1, 1)
    assert of_one == of_two
    assert item.out.replace("one/", "two/") == two.out and "coil-2" in two.out
    for path in sorted((tmp_path / "one").rglob("*.json")):
        assert path.read_bytes() == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes()
