"""The composite action: its steps are read from action.yml and executed, as GitHub's runner does."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import venv
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[2]
ACTION = YAML(typ="safe").load((ROOT / "action.yml").read_text(encoding="utf-8"))
GOOD = """\
sitscad: 1
name: good-coil
coil: {shape: circle, outer_diameter: 10, turns: 12.5, layers: 2, trace_width: 160 um, trace_spacing: 160 um}
"""
WEAK = GOOD.replace("good", "weak").replace("10,", "3,").replace("12.5", "4.5").replace("160 um", "100 um")


def filled(text: str, inputs: dict[str, str]) -> str:
    """A text with its expressions replaced; only inputs may be asked for."""
    return re.sub(r"\$\{\{\s*inputs\.([\w-]+)\s*\}\}", lambda match: inputs[match[1]], text)


def is_run(step: dict, inputs: dict[str, str], failed: bool) -> bool:
    """Whether a step is run: GitHub's conditions, as far as the action uses them."""
    terms = [term.strip() for term in step.get("if", "").split("&&") if term.strip()]
    if failed and "always()" not in terms:
        return False
    for term in terms:
        if term == "always()":
            continue
        match = re.fullmatch(r"inputs\.([\w-]+) (==|!=) '([^']*)'", term)
        assert match, f"a condition that this test does not know: {term}"
        if (inputs[match[1]] == match[3]) != (match[2] == "=="):
            return False
    return True


def executed(folder: Path, environment: dict[str, str], skip: tuple[str, ...] = (), **given: str) -> dict[str, int]:
    """Run the action's own steps in a folder and return the exit code of each; those of other actions are left out."""
    inputs = {name: entry.get("default", "") for name, entry in ACTION["inputs"].items()}
    assert set(given) <= {name.replace("-", "_") for name in inputs}
    inputs |= {name.replace("_", "-"): value for name, value in given.items()}
    codes: dict[str, int] = {}
    for step in ACTION["runs"]["steps"]:
        if "run" not in step or step["name"] in skip or not is_run(step, inputs, any(codes.values())):
            continue
        env = environment | {name: filled(value, inputs) for name, value in step.get("env", {}).items()}
        assert "${{" not in step["run"], "what a user writes comes by the environment, never into the script"
        command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
        done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, timeout=600, check=False)
        (folder / f"{step['name']}.log").write_text(done.stdout + done.stderr, encoding="utf-8")
        codes[step["name"]] = done.returncode
    return codes


@pytest.fixture
def repository(tmp_path) -> Path:
    (tmp_path / "sensors").mkdir()
    (tmp_path / "sensors" / "good one.yaml").write_text(GOOD)
    return tmp_path


@pytest.fixture
def environment(tmp_path) -> dict[str, str]:
    """A runner's environment in which `sitscad` is this source tree's."""
    tools = tmp_path / "bin"
    tools.mkdir()
    script = f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" -m sitscad "$@"\n'
    (tools / "sitscad").write_text(script)
    (tools / "sitscad").chmod(0o755)
    return {
        "PATH": f"{tools}:{os.environ['PATH']}",
        "GITHUB_ACTION_PATH": str(ROOT),
        "GITHUB_WORKSPACE": str(tmp_path),
        "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md"),
        "HOME": str(tmp_path),
    }


def test_action_pins_other_actions_and_documents_used_inputs():
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    for step in ACTION["runs"]["steps"]:
        assert "uses" not in step or re.fullmatch(r"[\w-]+/[\w/-]+@v\d+", step["uses"])
        assert "uses" in step or step["shell"] == "bash"
    for name, entry in ACTION["inputs"].items():
        assert f"inputs.{name}" in text and entry["description"] and isinstance(entry["default"], str)
        assert f"`{name}`" in (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_action_passes_good_spec_and_fails_weak_spec(repository, environment):
    assert executed(repository, environment, ("Install",)) == {"Check": 0}
    (repository / "sensors" / "weak.yaml").write_text(WEAK)
    assert executed(repository, environment, ("Install",), sarif="found.sarif") == {"Check": 1, "SARIF": 0}
    log = (repository / "Check.log").read_text(encoding="utf-8")
    assert "::error file=sensors/weak.yaml,line=3," in log
    assert "```text" in (repository / "summary.md").read_text(encoding="utf-8")
    document = json.loads((repository / "found.sarif").read_text(encoding="utf-8"))
    assert {result["level"] for result in document["runs"][0]["results"]} >= {"error"}


@pytest.mark.slow
def test_action_arguments_reach_check_without_shell_expansion(repository, environment):
    more = "--ignore SIT103,SIT204 --hints none"
    assert executed(repository, environment, ("Install",), fail_on="note", arguments=more)["Check"] in (0, 1)
    hostile = "--ignore $(touch${IFS}owned) `touch owned` *"
    assert executed(repository, environment, ("Install",), arguments=hostile)["Check"] == 2
    assert not (repository / "owned").exists()


@pytest.mark.slow
def test_action_baseline_input_silences_known_findings(repository, environment):
    (repository / "sensors" / "weak.yaml").write_text(WEAK)
    command = ["sitscad", "check", "sensors", "--hints", "none", "--format", "json"]
    done = subprocess.run(command, cwd=repository, env=environment, capture_output=True, timeout=300, check=False)
    (repository / "known.json").write_bytes(done.stdout)
    codes = executed(repository, environment, ("Install", "Build"), baseline="known.json")
    assert codes == {"Check": 0}


@pytest.mark.slow
def test_action_build_arguments_reach_build_without_shell_expansion(repository, environment):
    given = {"build": "outputs", "build_arguments": "--only firmware"}
    assert executed(repository, environment, ("Install",), **given) == {"Check": 0, "Build": 0}
    made = {path.name for path in (repository / "outputs" / "good-coil").iterdir()}
    assert "firmware" in made and "fpc" not in made
    assert executed(repository, environment, ("Install",), **given, build_check="true") == {"Check": 0, "Build": 0}
    hostile = {"build": "outputs", "build_arguments": "--only $(touch${IFS}owned) *"}
    assert executed(repository, environment, ("Install",), **hostile)["Build"] == 2
    assert not (repository / "owned").exists()


@pytest.mark.more
@pytest.mark.slow
def test_action_installs_sitscad_in_empty_environment(repository, environment, tmp_path):
    """In an empty environment, as on a runner; the packages that it needs come from the registry."""
    venv.create(tmp_path / "runner", with_pip=True)
    environment |= {"PATH": f"{tmp_path}/runner/bin:/usr/bin:/bin", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    environment |= {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "UV_", "SSL_"))}
    assert executed(repository, environment) == {"Install": 0, "Check": 0}, (repository / "Install.log").read_text()
