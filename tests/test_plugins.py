"""Plugins: rules and writers from a file or an installed package, used as ours are; what is wrong with one names it."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest
from click.testing import CliRunner

import sitscad
from sitscad.checks.judging import all_rules
from sitscad.checks.rules import NEEDS
from sitscad.cli import cli, run
from sitscad.files.writer import STAGES
from sitscad.spec import templates

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "docs" / "examples" / "plugin.py"

RULE = """
import sitscad
def apply(design):
    {body}
RULES = [sitscad.Rule(id="{id}", name="{name}", severity=sitscad.Severity.NOTE, summary="s", why="w", mend="m",
                      source="x", needs={needs}, apply=apply)]
"""
WRITER = """
import sitscad
def write(spec):
    {body}
WRITERS = [sitscad.Writer("{name}", "", "{stage}", {takes}, function=write)]
"""


@pytest.fixture(autouse=True)
def no_plugins_before_and_after(monkeypatch):
    """A plugin is in force for a whole process; here for one test."""
    for place in ("sitscad.checks.judging._added", "sitscad.files.writer._added", "sitscad.files.writer._marks"):
        monkeypatch.setattr(place, ())


@pytest.fixture
def plugin(tmp_path):
    def written(text, **values):
        given = {"id": "LAB001", "name": "own", "needs": (), "stage": "firmware", "takes": ("spec",),
                 "body": "return {}" if text is WRITER else "return ()"}
        file = tmp_path / "own.py"
        file.write_text(text.format_map({**given, **values}))
        return file

    return written


@pytest.fixture
def spec(tmp_path):
    file = tmp_path / "jaw.yaml"
    file.write_text(templates.read("jaw_5x20"))
    return file


@pytest.fixture
def typed(capsys):
    def told(*words):
        return run([str(word) for word in words]), capsys.readouterr()

    return told


def ran(*words):
    return CliRunner().invoke(cli, [str(word) for word in words])


@pytest.mark.slow
def test_plugin_rule_is_reported_listed_explained_ignored_and_waived(spec):
    result = json.loads(ran("check", spec, "--format", "json", "--hints", "none", "--plugin", EXAMPLE).stdout)
    (finding,) = [each for each in result["specs"][0]["findings"] if each["rule"] == "LAB001"]
    assert finding["severity"] == "warning" and finding["limit"] == 0.5 and finding["unit"] == "m"
    assert spec.read_text().splitlines()[finding["line"] - 1].lstrip().startswith("turns:")
    assert "LAB001  winder-track" in ran("rules").stdout and "winder's manual" in ran("explain", "LAB001").stdout
    ignored = json.loads(ran("check", spec, "--format", "json", "--hints", "none", "--ignore", "LAB001").stdout)
    assert "LAB001" in {each["rule"] for each in ignored["specs"][0]["not_checked"]}
    spec.write_text(
        spec.read_text().replace("turns: 4.5 ", "turns: 4.5 # sitscad: ignore LAB001 wound by hand\n  #", 1)
    )
    waived = json.loads(ran("check", spec, "--format", "json", "--hints", "none").stdout)["specs"][0]
    assert "LAB001" not in {each["rule"] for each in waived["findings"]}
    assert ran("check", spec, "--format", "sarif", "--hints", "none").exit_code == 0


@pytest.mark.slow
def test_plugin_files_are_in_package_only_with_plugin(tmp_path, spec, monkeypatch):
    out = tmp_path / "out"
    assert ran("build", spec, "-o", out, "--only", "firmware,report", "--plugin", EXAMPLE).exit_code == 0
    package = out / "jaw-5x20"
    made = json.loads((package / "field/filaments.json").read_text())
    assert made[0]["name"] == "C1" and len(made[0]["layers_m"]) == 4
    manifest = json.loads((package / "manifest.json").read_text())
    assert manifest["files"]["field/filaments.json"]["stage"] == "report"
    assert manifest["configuration"]["plugins"].keys() == {"plugin.py"}
    again = ran("build", spec, "-o", out, "--only", "firmware,report", "--plugin", EXAMPLE)
    assert "(unchanged)" in again.stdout and "LAB001" in again.stderr
    for place in ("sitscad.checks.judging._added", "sitscad.files.writer._added", "sitscad.files.writer._marks"):
        monkeypatch.setattr(place, ())
    assert ran("build", spec, "-o", out, "--only", "firmware,report").exit_code == 0
    assert not (package / "field").exists() and "configuration" not in json.loads(
        (package / "manifest.json").read_text()
    )


@pytest.mark.slow
def test_plugin_and_profile_of_extending_page_work_as_shown(tmp_path, spec):
    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    blocks = {kind: page.partition(f"```{kind}\n")[2].partition("```")[0] for kind in ("python", "yaml")}
    (tmp_path / "lab.py").write_text(blocks["python"])
    (tmp_path / "ourshop.yaml").write_text(blocks["yaml"])
    spec.write_text(re.sub("rules: [^ ]+", "rules: ourshop.yaml", spec.read_text(), count=1))
    done = ran("build", spec, "-o", tmp_path, "--only", "firmware,report", "--plugin", tmp_path / "lab.py")
    assert done.exit_code == 0 and "LAB001 warning our copper is 0.3 mm thick" in done.stderr
    assert "our shop does not state" in ran("check", "-v", spec, "--plugin", tmp_path / "lab.py").stdout
    (row,) = (tmp_path / "jaw-5x20/lab/coils.csv").read_text().splitlines()[1:]
    assert row.startswith("C1,") and float(row[3:]) > 1e-7
    for name in (*STAGES, "target", "plate", "jaw", "tail", "normal force", "bandwidth"):
        assert f"`{name}`" in page and (name in STAGES or name in NEEDS)
    for table, kind in (
        (page.partition("## A writer")[0], sitscad.Rule),
        (page.partition("## A writer")[2], sitscad.Writer),
    ):
        named = set(re.findall(r"`(\w+)`", " ".join(re.findall(r"^\| (`.*?) \|", table, re.MULTILINE))))
        assert named == {item.name for item in fields(kind)} - {"applies"}


def test_plugin_file_named_repeatedly_is_used_once(spec):
    for _ in range(3):
        sitscad.use_plugin(EXAMPLE)
    assert [rule.id for rule in all_rules()].count("LAB001") == 1
    assert len(sitscad.RULES) == len(all_rules()) - 1


@pytest.mark.parametrize(
    ("text", "values", "said"),
    [
        ("1 +", {}, "SyntaxError"),
        ("import no_such_module", {}, "no_such_module"),
        ("X = 1", {}, "neither RULES nor WRITERS"),
        ("RULES = 3", {}, "RULES is no list"),
        ("RULES = ['x']", {}, "RULES is no list"),
        (RULE, {"id": "SIT999"}, "SIT is ours"),
        (RULE, {"id": "lab"}, "its id"),
        (RULE, {"name": "Own Rule"}, "its name"),
        (RULE, {"name": "inductance-floor"}, "there already"),
        (RULE, {"needs": ("wings",)}, "it may need"),
        (WRITER, {"stage": "soup"}, "its stage"),
        (WRITER, {"takes": ("world",)}, "it takes others"),
        (WRITER, {"takes": 7}, "it takes others"),
        (WRITER, {"name": ""}, "its name"),
    ],
)
def test_invalid_plugin_is_refused_by_name(plugin, text, values, said):
    file = plugin(text, **values)
    with pytest.raises(sitscad.PluginError, match=f"own.py: .*{said}"):
        sitscad.use_plugin(file)
    assert all_rules() == sitscad.RULES


def test_missing_plugin_file_is_refused_by_name(tmp_path):
    with pytest.raises(sitscad.PluginError, match=r"none\.py"):
        sitscad.use_plugin(tmp_path / "none.py")


@pytest.mark.parametrize(
    "body", ["raise RuntimeError('no ink')", "return [3]", "return 7", "yield design.spec.nothing"]
)
def test_failing_plugin_rule_ends_command_with_its_name(plugin, spec, body):
    words = ["check", str(spec), "--hints", "none", "--plugin", str(plugin(RULE, body=body))]
    done = subprocess.run([sys.executable, "-m", "sitscad", *words], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 2 and "own.py: rule LAB001" in done.stderr and "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("body", ["raise RuntimeError('no ink')", "return 3", "return {'a.txt': 'text'}"])
def test_failing_plugin_writer_keeps_previous_package(plugin, spec, tmp_path, body):
    loaded = sitscad.load(spec)
    sitscad.build(loaded, tmp_path / "out", only=["firmware"])
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    sitscad.use_plugin(plugin(WRITER, body=body))
    with pytest.raises(sitscad.PluginError, match=r"own\.py: writer own"):
        sitscad.build(loaded, tmp_path / "out", only=["firmware"])
    assert before == {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}


@pytest.mark.parametrize("path", ["../outside.txt", "/outside.txt", "manifest.json", "firmware/ldc1614_config.h"])
def test_plugin_writer_of_path_outside_package_or_existing_file_is_refused(plugin, spec, tmp_path, path):
    sitscad.use_plugin(plugin(WRITER, body=f"return {{'{path}': b'x'}}"))
    with pytest.raises(sitscad.PackageError):
        sitscad.build(sitscad.load(spec), tmp_path / "out", only=["firmware"])
    assert not (tmp_path / "outside.txt").exists() and not Path("/outside.txt").exists()


ENDS = (
    "raise SystemExit(0)",
    "raise KeyboardInterrupt",
    "raise GeneratorExit",
    "raise BaseException('out')",
    "raise type('Mute', (Exception,), {'__str__': lambda self: exit(0)})",
)


@pytest.mark.parametrize("body", ENDS)
@pytest.mark.parametrize("where", ["import", "apply", "the rule's text", "writer"])
def test_exit_in_plugin_is_reported_with_plugin_name(plugin, spec, typed, tmp_path, body, where):
    """Exit 2 and its name, at whatever time it tries: exit 0 with nothing checked would pass any bad design."""
    if where == "writer":
        file = plugin(WRITER, body=body)
    else:
        file = plugin(RULE, body=body if where == "apply" else "return ()")
    text = "import sys\n" + file.read_text()
    if where == "import":
        text += f"\n{body}\n"
    if where == "the rule's text":
        text += f"\ndel RULES\ndef __getattr__(name):\n    {body}\n"
    file.write_text(text)
    if where == "writer":
        code, message = typed("build", spec, "-o", tmp_path / "out", "--only", "firmware", "--plugin", file)
    else:
        code, message = typed("check", spec, "--hints", "none", "--plugin", file)
    assert code == 2 and re.search(r"plugin .*own\.py", message.err), message
    assert not (tmp_path / "out" / "jaw-5x20").exists()


@pytest.mark.slow
def test_exit_in_installed_plugin_is_reported_with_plugin_name(tmp_path):
    info = tmp_path / "our_lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: our-lab\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[sitscad.plugins]\nleaver = our_lab_leaver\n")
    for body in ("raise SystemExit(0)", "raise KeyboardInterrupt", "def __getattr__(name): raise SystemExit(0)"):
        (tmp_path / "our_lab_leaver.py").write_text(body)
        code = (
            f"import sys; sys.path[:0] = [{str(ROOT)!r}, {str(tmp_path)!r}]\n"
            "from sitscad.cli import main; main(['check', 'templates'])"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
        assert done.returncode == 2 and "plugin leaver (our_lab_leaver)" in done.stderr, done.stderr


def test_user_interrupt_during_plugin_exits_130(plugin, spec, typed):
    body = "import os, signal, time; os.kill(os.getpid(), signal.SIGINT); time.sleep(5)"
    before = signal.getsignal(signal.SIGINT)
    code, message = typed("check", spec, "--hints", "none", "--plugin", plugin(RULE, body=body))
    assert code == 130 and "own.py" not in message.err
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("where", ["import", "apply"])
def test_slow_plugin_is_reported_by_name(plugin, spec, monkeypatch, caplog, where):
    monkeypatch.setattr("sitscad.package.plugins.force.SLOW", 0.05)
    file = plugin(RULE, body="import time; time.sleep(0.4)" if where == "apply" else "return ()")
    if where == "import":
        file.write_text("import time; time.sleep(0.4)\n" + file.read_text())
    ran("check", spec, "--hints", "none", "--plugin", file)
    what = "own.py: rule LAB001" if where == "apply" else "own.py"
    text = re.findall(rf"plugin .*{re.escape(what)} has been at work for ([\d.]+) s", caplog.text)
    assert [float(seconds) for seconds in text[:2]] == [0.05, 0.1] and len(text) < 5, caplog.text


def test_fast_plugin_is_not_reported(spec, caplog):
    ran("check", spec, "--hints", "none", "--plugin", EXAMPLE)
    assert not caplog.text


@pytest.mark.parametrize(
    ("field", "value"), [("message", "3"), ("hint", "None"), ("key", "3"), ("measured", "'a'"), ("limit", "True"),
                         ("severity", "'error'"), ("unit", "3"), ("place", "(1, 2)")],
)
def test_violation_field_of_wrong_type_is_refused_by_name(plugin, spec, typed, field, value):
    given = {"message": "'m'", field: value}
    body = f"return [sitscad.Violation({', '.join(f'{name}={word}' for name, word in given.items())})]"
    code, message = typed("check", spec, "--hints", "none", "--plugin", plugin(RULE, body=body))
    assert code == 2 and f"own.py: rule LAB001: TypeError: the {field} of its Violation" in message.err


@pytest.mark.few(4)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("stage", "path", "only"),
    [("report", "Report.HTML", "report"), ("firmware", "bom.csv", "firmware,report"),
     ("firmware", "findings.json", "firmware"), ("firmware", "spec/jaw.yaml", "firmware"),
     ("report", "report.html", "report"), ("calibration", "calibration/calibration.h", "calibration"),
     ("gerber", "firmware/ldc1614_config.h", "gerber,firmware")],
)
def test_plugin_writer_of_reserved_file_is_refused_by_name(plugin, spec, typed, tmp_path, stage, path, only):
    file = plugin(WRITER, stage=stage, body=f"return {{'{path}': b'x'}}")
    code, message = typed("build", spec, "-o", tmp_path / "out", "--only", only, "--plugin", file)
    assert code == 2
    assert re.search(r"plugin own\.py: writer own would write .*, which is", message.err), message
    assert not (tmp_path / "out" / "jaw-5x20").exists()


def test_worker_process_ended_by_plugin_is_no_internal_error(plugin, spec, tmp_path):
    (tmp_path / "more.yaml").write_text(spec.read_text())
    file = plugin(RULE, body="import os; os._exit(0)")
    words = ["check", str(spec), str(tmp_path / "more.yaml"), "--jobs", "2", "--hints", "none", "--plugin", str(file)]
    done = subprocess.run([sys.executable, "-m", "sitscad", *words], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 2 and "ended without a word" in done.stderr and "internal error" not in done.stderr


def test_installed_plugin_is_used_automatically(tmp_path):
    (tmp_path / "our_lab_winder.py").write_text(EXAMPLE.read_text())
    info = tmp_path / "our_lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: our-lab\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[sitscad.plugins]\nwinder = our_lab_winder\n")
    code = (
        f"import sys; sys.path[:0] = [{str(ROOT)!r}, {str(tmp_path)!r}]; from sitscad.cli import main; main(['rules'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("LAB001"), done.stderr
