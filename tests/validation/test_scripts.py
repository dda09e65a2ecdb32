"""Every script that a page names runs: in a copy of the tree, with the cheapest arguments that it has."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))

CHEAPLY = {
    "tests/benchmarks/command_times.py": ("--repeat", "1", "--only", "gerber"),
    "tests/benchmarks/many_designs.py": ("--designs", "40"),
    "tests/benchmarks/run.py": ("--quick",),
    "tests/benchmarks/scaling.py": ("--designs", "4"),
    "tests/benchmarks/watch_latency.py": ("bench_7mm", "--saves", "1"),
    "tests/samples/rule_examples.py": (),
    "tests/validation/accuracy.py": ("--only", "no comparison of that name"),
    "tests/validation/calibrated_units.py": ("--templates", "bench_7mm", "--points", "5", "--units", "1"),
    "tests/validation/calibration_points.py": ("--sensors", "1", "--templates", "grasper_4layer", "--jobs", "1"),
    "tests/validation/draw_pads.py": (),
    "tests/validation/hidden_faults.py": ("--only", "nothing"),
    "tests/validation/random_boards.py": ("--boards", "2", "--shallow"),
    "tests/validation/random_poses.py": ("--told",),
    "tests/validation/screen_level.py": ("0", "--cache", "nothing.jsonl"),
    "tests/validation/warmed_units.py": ("bench_7mm", "--units", "2"),
    "tests/benchmarks/screening.py": ("--designs", "12", "single_coil"),
    "tests/validation/test_jones_response.py": ("--only", "3 x 7"),
}
"""Arguments of every script that is named."""


def named() -> set[str]:
    """The scripts that pages and the scripts' own first lines say are to be run."""
    pages = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    return set(re.findall(r"python (tests/[\w/]+\.py)", pages)) | {
        name for name in re.findall(r"tests/[\w/]+\.py", pages)
        if f"python {name}" in (ROOT / name).read_text(encoding="utf-8").partition("from __future__")[0]
        and name in CHEAPLY
    }


def test_all_scripts_named_on_pages_are_listed():
    assert named() == set(CHEAPLY)


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of what scripts read and write."""
    place = tmp_path_factory.mktemp("tree")
    for name in ("sitscad", "tests", "docs", "templates"):
        shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("README.md", "pyproject.toml"):
        shutil.copy(ROOT / name, place / name)
    return place


@pytest.mark.slow
@pytest.mark.parametrize("script", sorted(CHEAPLY))
def test_script_named_on_page_exits_0(tree, script):
    """One ended in an AttributeError: what it calls had changed its arguments."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, script, *CHEAPLY[script]], cwd=tree, env=environment, capture_output=True,
                          text=True, timeout=900)
    assert done.returncode == 0, done.stderr[-2000:]
