"""The hooks for pre-commit: which files they take, and what they say of them, really run."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[2]
HOOKS = {hook["id"]: hook for hook in YAML(typ="safe").load((ROOT / ".pre-commit-hooks.yaml").read_text())}
GOOD = """\
sitscad: 1
name: good-coil
coil: {shape: circle, outer_diameter: 10, turns: 12.5, layers: 2, trace_width: 160 um, trace_spacing: 160 um}
"""
SHOP = "based_on: generic-flex\ntracks: [{copper: 35 um, width: 100 um, spacing: 100 um}]\n"


def test_check_hook_runs_on_specs_profiles_and_configuration():
    hook = HOOKS["sitscad-check"]
    takes = re.compile(hook["files"])
    for name in ("sensors/a.yaml", "shops/ours.yml", "sitscad.toml", "sub/pyproject.toml", "known.json", "jaws/a.step"):
        assert takes.search(name), name
    for name in ("README.md", "sensors/a.yaml.bak", "notsitscad.toml", "src/main.py"):
        assert not takes.search(name), name
    assert hook["pass_filenames"] is False and hook["args"] == ["sensors"]


def test_fix_hook_runs_only_on_spec_files():
    takes = re.compile(HOOKS["sitscad-fix"]["files"])
    assert takes.search("sensors/a.yaml") and takes.search("sensors/deep/b.yml")
    assert not takes.search("shops/a.yaml") and not takes.search("sensors/a.yaml.bak")
    assert set(HOOKS) == {"sitscad-check", "sitscad-fix"}


def test_hook_manifest_is_valid_for_pre_commit():
    command = [sys.executable, "-m", "pre_commit", "validate-manifest", str(ROOT / ".pre-commit-hooks.yaml")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def git(folder: Path, *arguments: str) -> None:
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    subprocess.run(["git", *who, *arguments], cwd=folder, check=True, capture_output=True, timeout=60)


@pytest.mark.slow
def test_pre_commit_runs_check_hook_on_changed_spec(tmp_path):
    """It clones this repository, installs it in an environment of its own, and hands it the files of a commit."""
    source, project = tmp_path / "source", tmp_path / "project"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(source)], check=True, timeout=120)
    for name in (".pre-commit-hooks.yaml", "pyproject.toml"):
        (source / name).write_bytes((ROOT / name).read_bytes())
    git(source, "add", "-A")
    git(source, "commit", "--quiet", "--allow-empty", "-m", "x")
    revision = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=source, check=True, capture_output=True, text=True, timeout=60
    ).stdout.strip()
    (project / "sensors").mkdir(parents=True)
    (project / "sensors" / "good.yaml").write_text(GOOD)
    (project / "other.yaml").write_text("not: a spec\n")
    config = f"repos: [{{repo: '{source}', rev: {revision}, hooks: [{{id: sitscad-check}}]}}]\n"
    (project / ".pre-commit-config.yaml").write_text(config)
    git(project, "init", "--quiet")
    git(project, "add", "-A")
    environment = {**os.environ, "PRE_COMMIT_HOME": str(tmp_path / "home")}

    def ran(*files: str) -> subprocess.CompletedProcess[str]:
        command = [
            sys.executable,
            "-m",
            "pre_commit",
            "run",
            "--verbose",
            *(["--files", *files] if files else ["--all-files"]),
        ]
        return subprocess.run(
            command, cwd=project, env=environment, capture_output=True, text=True, timeout=600, check=False
        )

    done = ran()
    assert done.returncode == 0 and "\nok: " in done.stdout, done.stdout + done.stderr
    assert "Skipped" in ran("README.md").stdout
    (project / "sensors" / "good.yaml").write_text(GOOD + "fpc: {rules: ourshop.yaml}\n")
    shop = project / "shops" / "ourshop.yaml"
    shop.parent.mkdir()
    (project / "sitscad.toml").write_text('profiles = "shops"\n')
    shop.write_text(SHOP)
    git(project, "add", "-A")
    assert ran("sitscad.toml").returncode == 0
    shop.write_text(SHOP.replace("100 um", "170 um"))
    done = ran("shops/ourshop.yaml")
    assert done.returncode == 1 and "sensors/good.yaml" in done.stdout and "170 um" in done.stdout, done.stdout
    (project / "sensors" / "good.yaml").write_text(GOOD)
    (project / "sensors" / "bad.yaml").write_text(GOOD.replace("circle", "circel"))
    git(project, "add", "-A")
    done = ran()
    assert done.returncode == 1 and "sensors/bad.yaml:3:" in done.stdout and "other.yaml" not in done.stdout
