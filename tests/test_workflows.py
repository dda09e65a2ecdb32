"""What runs elsewhere: workflows are well formed and name what is there, and the light core needs no POSIX system."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import sitscad
from sitscad.package.folder import FILE_NAME
from sitscad.spec import templates

ROOT = Path(__file__).parents[1]
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
PLACE = re.compile(r"(?:\.ci|docs|templates|tests)(?:/\w+(?:\.\w+)?)*")
"""A file or folder of this repository in a command."""


def read(path):
    return YAML(typ="safe").load(path.read_text(encoding="utf-8"))


def commands_of(path):
    return [step["run"] for job in read(path)["jobs"].values() for step in job["steps"] if "run" in step]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflow_jobs_have_valid_structure(path):
    workflow = read(path)
    assert workflow["name"] == path.stem and workflow["on"] and "contents" in workflow["permissions"]
    for name, job in workflow["jobs"].items():
        assert job["runs-on"] and job["timeout-minutes"] <= 60, name
        assert set(job.get("needs", "").split()) <= workflow["jobs"].keys() - {name}
        for step in job["steps"]:
            assert ("run" in step) != ("uses" in step), step
            assert re.fullmatch(r"[\w-]+/[\w-]+@(v\d+|release/v\d+)", step.get("uses", "actions/checkout@v4"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflow_commands_name_existing_files(path):
    named = {place for command in commands_of(path) for place in PLACE.findall(command)}
    assert path.stem == "release" or named
    assert not [place for place in named if not (ROOT / place).exists()]


def test_only_publish_job_has_identity_permission_and_needs_build():
    jobs = read(ROOT / ".github/workflows/release.yml")["jobs"]
    assert [name for name, job in jobs.items() if "id-token" in job.get("permissions", {})] == ["publish"]
    assert jobs["publish"]["needs"] == "build" and not [step for step in jobs["publish"]["steps"] if "run" in step]


def test_citation_file_states_current_version():
    cited = read(ROOT / "CITATION.cff")
    assert cited["version"] == sitscad.__version__ and cited["license"] == "Apache-2.0"
    assert {"cff-version", "message", "title", "authors"} <= cited.keys()


POSIX = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
"""Modules that Windows lacks."""


def imported_at_once(tree):
    """The modules that a file loads when it is imported itself, not in a function of it."""
    waiting = list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
        elif not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            waiting += ast.iter_child_nodes(node)


def test_modules_import_without_posix_modules():
    for path in (ROOT / "sitscad").rglob("*.py"):
        if "firmware" in path.parts:
            continue
        text = path.read_text(encoding="utf-8")
        assert not POSIX & set(imported_at_once(ast.parse(text))), path
        assert not re.search(r"\bos\.(fork|getuid|geteuid|setsid|killpg)\b|[\"']/tmp\b", text), path


@pytest.mark.parametrize("name", ["a:b", "con", "nul.txt", "aux/x", "x.", "x ", "a\\b", "lpt1.csv", "?"])
def test_package_file_names_are_valid_on_windows(name):
    assert not FILE_NAME.fullmatch(name)


def test_package_data_names_are_not_reserved_by_windows():
    reserved = re.compile(r"(?i)(con|prn|aux|nul|(com|lpt)\d)(\..*)?")
    names = [path.name for path in (ROOT / "sitscad").rglob("*")] + list(templates.names())
    assert len(names) > 300
    assert not [name for name in names if reserved.fullmatch(name) or re.search(r'[<>:"|?*]', name)]
