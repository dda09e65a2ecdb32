"""What `check` and `estimate` import: nothing heavy, and nothing that only an extra brings."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import sitscad

HEAVY = {
    "build123d", "cadquery", "OCP", "gmsh", "manifold3d", "trimesh", "scipy", "matplotlib", "ezdxf", "shapely",
    "gerbonara", "rich", "vtkmodules", "sympy", "lxml", "networkx",
}  # fmt: skip

_RUN = """
import sys
sys.path.insert(0, sys.argv.pop(1))
from sitscad.cli import main
try:
    main(sys.argv[1:])
finally:
    print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


@pytest.mark.parametrize("command", ["check", "check --picture drawn.svg", "estimate"])
def test_nothing_heavy_is_imported(tmp_path, command):
    spec = sitscad.write_template("grasper_4layer", tmp_path / "spec.yaml")
    source = str(Path(sitscad.__file__).parents[1])
    done = subprocess.run([sys.executable, "-c", _RUN, source, *command.split(), str(spec)], capture_output=True,
                          text=True, cwd=tmp_path)  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    imported = set(done.stderr.splitlines()[-1].split())
    assert "numpy" in imported
    assert not imported & HEAVY


def test_a_build_of_what_has_not_changed_loads_neither_rules_nor_numbers(tmp_path):
    spec = sitscad.write_template("grasper_4layer", tmp_path / "spec.yaml")
    command = ["build", str(spec), "-o", str(tmp_path), "--only", "firmware"]
    run = [sys.executable, "-c", _RUN.replace('.partition(".")[0]', ""), str(Path(sitscad.__file__).parents[1])]
    first, again = (subprocess.run([*run, *command], capture_output=True, text=True) for _ in range(2))
    assert "(unchanged)" in again.stdout
    *said, imported = again.stderr.splitlines()
    assert said == first.stderr.splitlines()[:-1] and any(line.startswith("signal: ") for line in said)
    assert not {"numpy", "sitscad.checks", "sitscad.estimates", "sitscad.layout"} & set(imported.split())


def test_importing_sitscad_imports_nothing_else():
    source = str(Path(sitscad.__file__).parents[1])
    code = "import sys; before = set(sys.modules); import sitscad; print(*sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={"PYTHONPATH": source})
    imported = done.stdout.split()
    assert {name for name in imported if name.startswith("sitscad")} == {"sitscad", "sitscad.version"}, done.stderr
    assert not {"numpy", "pydantic", "click", "pathlib"} & set(imported)


def test_every_public_name_exists():
    for name in sitscad.__all__:
        assert getattr(sitscad, name) is not None
    assert set(sitscad.__all__) <= set(dir(sitscad))
    with pytest.raises(AttributeError):
        _ = sitscad.no_such_name
