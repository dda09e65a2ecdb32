"""The packages that sitscad stands on: declared, living together, and the heavy ones left alone by light commands."""

from __future__ import annotations

import ast
import importlib.metadata
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
"""As a user has it: `import numpy`, by which costs are told, is cheaper where no threads are begun."""
SPEC = ROOT / "templates" / "grasper_4layer.yaml"

SIX = ("build123d", "cadquery", "gmsh", "manifold3d", "numpy", "trimesh")

HEAVY = {
    "build123d", "cadquery", "OCP", "gmsh", "manifold3d", "trimesh", "scipy", "matplotlib", "ezdxf", "shapely",
    "gerbonara", "ngsolve", "netgen", "vtkmodules", "sympy", "rich", "pymoo", "distributed",
    "threadpoolctl",
}


def declared(*extras: str) -> set[str]:
    """The distributions that the project requires, with some of its extras and dependency groups."""
    whole = tomllib.loads((ROOT / "pyproject.toml").read_text())
    project, groups = whole["project"], whole["project"]["optional-dependencies"] | whole["dependency-groups"]
    extras = (*extras, *(("solids", "cadquery") if "all" in extras else ()))
    wanted = [*project["dependencies"], *(row for extra in extras for row in groups[extra])]
    return {canonical(re.split(r"[<>=!~;\[ ]", row, maxsplit=1)[0]) for row in wanted} | {canonical(project["name"])}


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def undeclared(files: Iterable[Path], known: set[str]) -> dict[str, str]:
    """Modules from outside that files import, wherever in them, and that no distribution asked for brings."""
    brought = importlib.metadata.packages_distributions()
    result = {}
    for file in files:
        for name in imported(ast.parse(file.read_text(encoding="utf-8"))):
            is_ours = (ROOT / name).is_dir()
            if name in brought and not is_ours and not {canonical(each) for each in brought[name]} & known:
                result[name] = str(file.relative_to(ROOT))
    return result


def imported(tree: ast.AST) -> set[str]:
    names = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and not node.level]
    return {name.partition(".")[0] for name in names}


@pytest.mark.slow
def test_imported_packages_are_declared_dependencies():
    """What another package happens to bring may be gone with its next version."""
    assert not undeclared((ROOT / "sitscad").rglob("*.py"), declared("all", "bench", "cluster", "design"))
    assert not undeclared(
        [*(ROOT / "tests").rglob("*.py"), *(ROOT / "docs").rglob("*.py")],
        declared("all", "bench", "cluster", "design", "docs", "references", "test"),
    )


def python(code: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a piece of Python in a process of its own, with this source tree on its path."""
    env = {**ENVIRONMENT, "PYTHONPATH": str(ROOT), **environment}
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, env=env, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.few(1)
@pytest.mark.cad
@pytest.mark.slow
@pytest.mark.parametrize("names", [SIX, SIX[::-1]], ids=["build123d first", "trimesh first"])
def test_cad_and_mesh_packages_work_in_one_process(names):
    """A solid of build123d is taken up by cadquery: only one copy of OCP can do that."""
    code = "\n".join(f"import {name}" for name in names) + (
        "\nsolid = build123d.Box(1, 2, 3)"
        "\nshape = cadquery.Shape.cast(solid.wrapped)"
        "\ngmsh.initialize(readConfigFiles=False); gmsh.finalize()"
        "\ncube = manifold3d.Manifold.cube((1, 2, 3))"
        "\nassert trimesh.creation.box((1, 2, 3)).is_watertight"
        "\nvolumes = [solid.volume, shape.Volume(), cube.volume(), numpy.prod([1, 2, 3])]"
        "\nprint(*(round(float(volume), 6) for volume in volumes))"
    )
    done = python(code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["6.0", "6.0", "6.0", "6.0"]


@pytest.mark.cad
def test_ocp_comes_from_one_distribution():
    """Two of them write different copies of the same file, and which one is left is chance."""
    assert importlib.metadata.packages_distributions()["OCP"] == ["cadquery-ocp"]


def loaded_by(code: str, *arguments: str) -> set[str]:
    """The heavy packages that a piece of Python has loaded by the time it exits."""
    listing = (
        "import atexit, sys\n"
        "names = lambda: print('LOADED', *sorted({name.partition('.')[0] for name in sys.modules}), file=sys.stderr)\n"
        "atexit.register(names)\n"
    )
    done = python(listing + code, *arguments)
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode in (0, 1), done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("LOADED ")]
    return HEAVY & set(line.split())


COMMAND = "import runpy; sys.argv[0] = 'sitscad'; runpy.run_module('sitscad', run_name='__main__')"


def test_importing_sitscad_loads_no_heavy_package():
    assert not loaded_by("import sitscad")


@pytest.mark.slow
def test_check_does_not_import_numpy_ma():
    """Numpy's set functions load them, which takes a third of what numpy itself takes."""
    assert "numpy.ma" not in modules_after_a_check()


@pytest.mark.slow
def test_check_does_not_import_openssl():
    assert "_hashlib" not in modules_after_a_check()


@cache
def modules_after_a_check() -> set[str]:
    """All that the command has loaded by the time it exits."""
    code = "import atexit, sys\natexit.register(lambda: print('LOADED', *sys.modules, file=sys.stderr))\n" + COMMAND
    done = python(code, "check", str(SPEC))
    assert done.returncode in (0, 1), done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("LOADED ")]
    return set(line.split())


def test_importing_sitscad_does_not_load_numpy():
    done = python("import sys, sitscad; print('numpy' in sys.modules)")
    assert done.stdout.strip() == "False", done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", str(SPEC)),
        ("check", "--format", "json", str(SPEC)),
        ("estimate", str(SPEC)),
        ("estimate", "--format", "json", str(SPEC)),
        ("rules",),
        ("schema",),
        ("new", "--list"),
        ("--help",),
    ],
    ids=" ".join,
)
def test_light_commands_load_no_heavy_package(arguments):
    assert not loaded_by(COMMAND, *arguments)


@pytest.mark.slow
def test_build_of_flex_files_loads_no_cad(tmp_path):
    assert loaded_by(COMMAND, "build", str(SPEC), "--only", "gerber,kicad,laser", "-o", str(tmp_path)) <= {"shapely"}


MOST_CALLS = 1_300_000
"""Calls of functions that a check of SPEC may take: 1.5 million when hints were searched that nobody reads. Times
are measured by the benchmark, and differ by a factor of two from one machine to the next.
"""


@pytest.mark.slow
def test_check_stays_below_limit_of_function_calls():
    counting = (
        "import atexit, sys\n"
        "calls = [0]\n"
        "def count(frame, event, value):\n"
        "    calls[0] += event in ('call', 'c_call')\n"
        "atexit.register(lambda: (sys.setprofile(None), print('CALLS', calls[0], file=sys.stderr)))\n"
        "sys.setprofile(count)\n"
    )
    done = python(counting + COMMAND, "check", str(SPEC))
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("CALLS ")]
    assert 50_000 < int(line.split()[1]) <= MOST_CALLS
