"""`sitscad check --fix` and `--diff`: what they write, what they print, and exit codes."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sitscad.package import inspection

SLIPS = """\
# my coil
sitscad: 1
name: slips
coil:
  shape: circel   # round
  outer_diameter: 6
  turns: 12
  layers: 2
  trace_width: 100 Um
  trace_spacing: 100 um
fpc: {tail: {conector: zif-0.5mm, layers: 2}}
readout: {capacitance: 47 pF}   # too fast
"""

MENDED = (
    SLIPS.replace("circel", "circle").replace("Um", "um").replace("conector", "connector").replace("47 pF", "150 pF")
)


LATE = """\
sitscad: 1
name: late
coil: {shape: circle, outer_diameter: 8, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
fpc: {tail: {length: 30, connector: zif-0.5mm, bend: dynamic}}
readout: {capacitance: 47 pF}
"""


@pytest.fixture
def slips(run, tmp_path):
    path = tmp_path / "slips.yaml"
    path.write_bytes(SLIPS.encode())
    return path


def test_fix_changes_only_faulty_values_in_spec(run, slips):
    done = run("check", "--fix", "slips.yaml")
    assert slips.read_text() == MENDED
    assert done.code == 0 and done.out.splitlines()[-1].startswith("ok: ")
    message = [line for line in done.err.splitlines() if "mended" in line]
    assert message == [
        "sitscad: slips.yaml: SIT002 mended: fpc.tail.conector is now connector",
        "sitscad: slips.yaml: SIT005 mended: coil.trace_width: 100 um instead of 100 Um",
        "sitscad: slips.yaml: SIT007 mended: coil.shape: circle instead of circel",
        "sitscad: slips.yaml: SIT202 mended: readout.capacitance: 150 pF instead of 47 pF",
    ]
    before = slips.stat().st_mtime_ns, slips.stat().st_ino
    again = run("check", "--fix", "slips.yaml")
    assert (again.code, again.err) == (0, "") and (slips.stat().st_mtime_ns, slips.stat().st_ino) == before


def test_check_text_counts_fixable_findings(run, slips):
    safe = "fixes: for 3 findings (SIT002, SIT005, SIT007) by check --fix"
    assert safe in run("check", "slips.yaml").out.splitlines()
    slips.write_text(MENDED)
    assert "fixes:" not in run("check", "slips.yaml").out
    slips.write_text(SLIPS.replace("  turns: 12\n", '  turns: "12"\n'))
    lines = run("check", "slips.yaml").out.splitlines()
    assert f"{safe}, for 1 finding more (SIT004) by check --fix --unsafe-fixes" in lines


def test_announced_fix_command_applies_announced_fixes(run, tmp_path):
    """A capacitor was promised to `check --fix`, whose few trials went to the six findings before it."""
    path = tmp_path / "late.yaml"
    path.write_text(LATE)
    promised = next(line for line in run("check", "--hints", "full", "late.yaml").out.splitlines() if "fixes: " in line)
    rules, command = re.fullmatch(r"fixes: for \d+ findings? \((.*?)\) by (check --fix.*?)(?:, .*)?", promised).groups()
    done = run(*command.split(), "late.yaml")
    assert all(f"{rule} mended: " in done.err for rule in rules.split(", "))


def test_diff_prints_applicable_patch_and_writes_nothing(run, slips, tmp_path):
    done = run("check", "--diff", "slips.yaml")
    assert done.code == 1 and slips.read_text() == SLIPS
    assert done.out.startswith("--- slips.yaml\n+++ slips.yaml\n@@") and "ok: " in done.err
    if shutil.which("patch"):
        subprocess.run(["patch", "-p0"], input=done.out, text=True, cwd=tmp_path, check=True, capture_output=True)
        assert slips.read_text() == MENDED
    slips.write_text(MENDED)
    done = run("check", "--diff", "slips.yaml")
    assert (done.code, done.out) == (0, "")


def test_diff_marks_missing_newline_at_end_of_file(run, slips):
    slips.write_bytes(SLIPS.rstrip().encode())
    lines = run("check", "--diff", "slips.yaml").out.splitlines()
    assert lines.count("\\ No newline at end of file") == 2


def test_fix_of_standard_input_prints_fixed_spec(run, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(SLIPS.replace("\n", "\r\n").encode())))
    done = run("check", "--fix", "-")
    assert done.code == 0 and done.out.replace("\r\n", "\n") == MENDED
    assert "SIT103 warning" in done.err and "SIT202 mended" in done.err


def test_fix_changes_turns_only_with_unsafe_fixes(run, tmp_path):
    text = Path("good.yaml").read_text().replace("shape: circle", "shape: square").replace("12.5", "5.3")
    Path("square.yaml").write_text(text)
    assert run("check", "--fix", "square.yaml").code == 2
    assert Path("square.yaml").read_text() == text
    done = run("check", "--fix", "--unsafe-fixes", "square.yaml")
    assert done.code in (0, 1) and "coil.turns: 5.25 instead of 5.3" in done.err
    assert "SIT216 mended: coil.turns: 5 instead of 5.25" in done.err, "one note for another"
    wide = text.replace("5.3", "5").replace("150 um", "152.4 um")
    assert Path("square.yaml").read_text() == wide, "so few turns have room for the loop lines of SIT103"
    assert not run("check", "--fix", "--unsafe-fixes", "square.yaml").err


@pytest.mark.parametrize("key", ["target.size", "elastomer.size", "coil.turns", "target.material"])
def test_edits_of_defining_keys_are_unsafe(key):
    """A pad of 20 mm became one of 17.4 with --fix alone."""
    from sitscad.basics.finding import Edit

    assert not Edit(key, "1").is_safe and Edit("fpc.margin", "1").is_safe


def test_fix_without_improvement_is_reported_and_not_announced_again(run, monkeypatch):
    monkeypatch.setattr("sitscad.checks.fixes.mending.is_improved", lambda *_: False)
    monkeypatch.setattr("sitscad.checks.fixes.mending._swaps_notes", lambda *_: False)
    Path("slips.yaml").write_text(SLIPS)
    assert "fixes: for " in run("check", "slips.yaml").out
    done = run("check", "--fix", "--unsafe-fixes", "slips.yaml")
    assert "slips.yaml: SIT002 not mended by " in done.err and "fixes: for " not in done.out


@pytest.mark.more
@pytest.mark.slow
def test_rejected_fix_is_reported_with_its_new_findings(run, tmp_path):
    """JSON had `brings`, and the text nothing: --fix --unsafe-fixes changed nothing and did not say why."""
    broken = (Path(__file__).parents[1] / "report/broken/SIT407.yaml").read_text(encoding="utf-8")
    path = tmp_path / "soft.yaml"
    path.write_text(f"{broken}fpc: {{margin: [0, 0.1]}}\n", encoding="utf-8")
    before = path.read_bytes()
    done = run("check", "--fix", "--unsafe-fixes", "--hints", "decisive", "soft.yaml")
    message = [line.removeprefix("sitscad: soft.yaml: ") for line in done.err.splitlines()]
    (tried,) = [line for line in message if line.startswith("SIT103 not mended by coil.trace_width: ")]
    assert "SIT217" in tried.rpartition(": ")[2]
    assert "no fix is known for SIT134, SIT217, SIT312 (check -v has hints)" in message
    assert len(message) == len(set(message)) and path.read_bytes() == before


def test_fix_with_ignored_rule_skips_it(run, slips):
    run("check", "--fix", "slips.yaml", "--ignore", "SIT202")
    assert slips.read_text() == MENDED.replace("150 pF", "47 pF")


def test_fix_preserves_permissions_and_symbolic_links(run, slips, tmp_path):
    slips.chmod(0o640)
    os.symlink("slips.yaml", tmp_path / "link.yaml")
    assert run("check", "--fix", "link.yaml").code == 0
    assert (tmp_path / "link.yaml").is_symlink() and slips.read_text() == MENDED
    assert slips.stat().st_mode & 0o777 == 0o640
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_fix_preserves_hard_links(run, slips, tmp_path):
    os.link(slips, tmp_path / "same.yaml")
    assert run("check", "--fix", "slips.yaml").code == 0
    assert (tmp_path / "same.yaml").read_text() == slips.read_text() == MENDED
    assert slips.stat().st_nlink == 2
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_unsafe_fixes_search_full_hints_by_default(run, slips, monkeypatch):
    request, mend = [], inspection.mend

    def noted(path, may, hints, options, progress=None):
        request.append(hints)
        return mend(path, may, "none", options, progress=progress)

    monkeypatch.setattr("sitscad.cli.checking.mend", noted)
    for words in (("--unsafe-fixes",), ("--unsafe-fixes", "--hints", "decisive"), ()):
        run("check", "--diff", *words, "slips.yaml")
    assert request == ["full", "decisive", "decisive"]


def test_fix_of_read_only_file_exits_2_and_changes_nothing(run, open_folder, as_a_user):
    locked = open_folder / "locked.yaml"
    locked.write_bytes(SLIPS.encode())
    locked.chmod(0o444)
    with as_a_user():
        done = run("check", "--fix", str(locked))
    assert done.code == 2 and "may only be read" in done.err and locked.read_text() == SLIPS


def test_json_output_contains_fixes_of_findings(run, slips):
    (spec,) = json.loads(run("check", "--format", "json", "slips.yaml").out)["specs"]
    fixes = {finding["rule"]: finding["fixes"] for finding in spec["findings"]}
    assert fixes["SIT002"] == [
        {
            "edits": [{"key": "fpc.tail.conector", "old": "conector", "new": "connector", "what": "name"}],
            "safe": True,
            "brings": [],
        }
    ]
    assert fixes["SIT007"][0]["edits"] == [{"key": "coil.shape", "old": "circel", "new": "circle", "what": "value"}]
    Path("slips.yaml").write_text(MENDED.replace("150 pF", "47 pF"))
    (spec,) = json.loads(run("check", "--fix", "--format", "json", "slips.yaml").out)["specs"]
    assert spec["ok"] and slips.read_text() == MENDED


WRONG = {
    "unsafe alone": ("--unsafe-fixes", "slips.yaml"),
    "a patch as json": ("--diff", "--format", "json", "slips.yaml"),
    "standard input as json": ("--fix", "--format", "json", "-"),
    "standard input and a file": ("--fix", "-", "slips.yaml"),
}


@pytest.mark.parametrize("name", WRONG)
def test_contradictory_fix_options_exit_2(run, slips, name):
    done = run("check", *WRONG[name])
    assert done.code == 2 and done.out == "" and "Usage" in done.err


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"", b"a: [1, 2\n", b"- 1\n", b"a: 1\na: 2\n" * 3])
def test_fix_of_invalid_file_exits_2_and_changes_nothing(run, tmp_path, content):
    path = tmp_path / "odd.yaml"
    path.write_bytes(content)
    assert run("check", "--fix", "odd.yaml").code == 2
    assert run("check", "--diff", "odd.yaml").code == 2
    assert path.read_bytes() == content
    assert run("check", "--fix", "absent.yaml").code == 2


@pytest.mark.slow
def test_long_search_for_fixes_prints_progress(run, tmp_path, monkeypatch):
    """It ran for 50 s without a word."""
    from sitscad.cli import terminal
    from sitscad.spec import templates

    monkeypatch.setattr(terminal, "REPORT_INTERVAL", 0.2)
    (tmp_path / "jaw.yaml").write_text(templates.read("single_coil").replace("turns:", "turns: 60 #", 1))
    done = run("check", "--diff", "--unsafe-fixes", "jaw.yaml")
    text = [line for line in done.err.splitlines() if line.startswith("sitscad: jaw.yaml: ") and " s, " in line]
    assert text and all("fixes" in line or "trying" in line for line in text)
    quick = run("check", "--hints", "none", "jaw.yaml")
    assert " s, " not in quick.err


@pytest.mark.slow
def test_full_hints_print_hint_of_every_warning(run, tmp_path):
    from sitscad.spec import templates

    (tmp_path / "bench.yaml").write_text(templates.read("bench_7mm"))
    brief, full = run("check", "bench.yaml"), run("check", "--hints", "full", "bench.yaml")
    assert "warning" in brief.out and "hint: " not in brief.out and "shows notes and hints" in brief.out
    warnings = len(re.findall(r" SIT\d+ warning ", full.out))
    assert full.out.count("hint: ") == warnings > 0 and "shows notes)" in full.out
