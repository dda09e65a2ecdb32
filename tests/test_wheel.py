"""What a user gets: the wheel, installed without extras in a clean environment, away from the source tree."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

pytestmark = pytest.mark.slow


def run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    env = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    line = [str(part) for part in command]
    return subprocess.run(line, cwd=cwd, env=env, capture_output=True, text=True, timeout=600, check=False)


def run_well(*command: str | Path, cwd: Path) -> str:
    done = run(*command, cwd=cwd)
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    run_well(sys.executable, "-m", "pip", "wheel", "--no-deps", "--quiet", "-w", folder, ROOT, cwd=folder)
    (path,) = folder.glob("sitscad-*.whl")
    return path


def pip_of(folder: Path) -> tuple[str | Path, ...]:
    """The pip of these tests, which works on another environment: one of its own takes long to make."""
    return sys.executable, "-m", "pip", "--python", folder / "python"


@pytest.fixture(scope="module")
def bin_folder(wheel) -> Path:
    """A clean environment with the wheel, its light dependencies and nothing else."""
    environment = wheel.parent / "environment"
    venv.create(environment)
    constraints = ROOT / "constraints.txt"
    run_well(*pip_of(environment / "bin"), "install", "--quiet", "-c", constraints, wheel, cwd=wheel.parent)
    return environment / "bin"


def test_wheel_contains_templates_data_and_licence(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    templates = {path.name for path in (ROOT / "templates").glob("*.yaml")}
    assert {Path(name).name for name in names if name.startswith("sitscad/templates/")} >= templates
    data = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "sitscad" / "data").rglob("*")
        if path.suffix in (".csv", ".yaml")
    }
    assert data <= set(names)
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert not [name for name in names if name.startswith(("tests", "outputs"))]


def test_installation_without_extras_brings_no_cad(bin_folder):
    listed = json.loads(run_well(*pip_of(bin_folder), "list", "--format", "json", cwd=bin_folder))
    names = {entry["name"].lower() for entry in listed}
    assert not names & {
        "build123d",
        "cadquery",
        "cadquery-ocp",
        "gmsh",
        "scipy",
        "trimesh",
        "ezdxf",
        "gerbonara",
    }


def test_new_check_estimate_and_build_work_without_extras(bin_folder, tmp_path):
    sitscad = bin_folder / "sitscad"
    run_well(sitscad, "new", "grasper_4layer", "-o", "sensor.yaml", cwd=tmp_path)
    checked = json.loads(run_well(sitscad, "check", "--format", "json", "sensor.yaml", cwd=tmp_path))
    assert checked["ok"] is True
    estimated = json.loads(run_well(sitscad, "estimate", "--format", "json", "sensor.yaml", cwd=tmp_path))
    assert len(estimated["coils"]) == 2
    run_well(sitscad, "build", "--only", "gerber,kicad,laser", "sensor.yaml", cwd=tmp_path)
    (package,) = (tmp_path / "outputs").iterdir()
    assert {"fpc", "kicad", "laser", "manifest.json"} <= {path.name for path in package.iterdir()}


def test_build_without_needed_extra_prints_one_sentence(bin_folder, tmp_path):
    sitscad = bin_folder / "sitscad"
    run_well(sitscad, "new", "grasper_4layer", "-o", "sensor.yaml", cwd=tmp_path)
    done = run(sitscad, "build", "sensor.yaml", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "pip install" in done.stderr
    assert "sitscad[all]" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "outputs").exists() or not list((tmp_path / "outputs").iterdir())
