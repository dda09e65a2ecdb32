"""What `check` and `estimate` import: nothing heavy, and nothing that only an extra brings."""

from __future__ import annotations

import platform
import subprocess
import sys
from pathlib import Path

import click
import pytest

import sitscad
from sitscad.cli import COMMANDS, cli
from sitscad.package.example_specs import write_template

HEAVY = {
    "build123d", "cadquery", "OCP", "gmsh", "manifold3d", "trimesh", "scipy", "matplotlib", "ezdxf", "shapely",
    "gerbonara", "rich", "vtkmodules", "sympy", "lxml", "networkx",
}

_RUN = """
import sys
sys.path.insert(0, sys.argv.pop(1))
from sitscad.cli import main
try:
    main(sys.argv[1:])
finally:
    print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


@pytest.mark.slow
@pytest.mark.parametrize("command", ["check --picture drawn.svg", "estimate"])
def test_commands_import_no_heavy_packages(tmp_path, command):
    spec = write_template("grasper_4layer", tmp_path / "spec.yaml")
    source = str(Path(sitscad.__file__).parents[1])
    done = subprocess.run([sys.executable, "-c", _RUN, source, *command.split(), str(spec)], capture_output=True,
                          text=True, cwd=tmp_path)
    assert done.returncode in (0, 1), done.stderr
    imported = set(done.stderr.splitlines()[-1].split())
    assert "numpy" in imported
    assert not imported & HEAVY - ({"shapely"} if "picture" in command else set())


@pytest.mark.slow
def test_unchanged_build_imports_neither_numpy_nor_rules(tmp_path):
    spec = write_template("grasper_4layer", tmp_path / "spec.yaml")
    command = ["build", str(spec), "-o", str(tmp_path), "--only", "firmware"]
    run = [sys.executable, "-c", _RUN.replace('.partition(".")[0]', ""), str(Path(sitscad.__file__).parents[1])]
    first, again = (subprocess.run([*run, *command], capture_output=True, text=True) for _ in range(2))
    assert "(unchanged)" in again.stdout
    *message, imported = again.stderr.splitlines()
    findings = [line for line in first.stderr.splitlines()[:-1] if not line.startswith("sitscad: ")]  # stages at work
    assert message == findings
    assert any(line.startswith("signal: ") for line in message)
    assert not {"numpy", "sitscad.checks.judging", "sitscad.estimates", "sitscad.layout"} & set(imported.split())


def test_command_list_shows_first_help_sentence_of_each_command():
    context = click.Context(cli)
    for name, (module, sentence) in COMMANDS.items():
        _, command, rest = cli.resolve_command(context, [name, "-v"])
        assert (command.name, rest) == (name, ["-v"])
        assert command.callback.__module__ == f"sitscad.cli.{module}"
        assert command.get_short_help_str(200) == sentence


def test_command_list_imports_no_command_module():
    source = str(Path(sitscad.__file__).parents[1])
    code = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); " \
           "from sitscad.cli import main; main(['--help'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={"PYTHONPATH": source})
    imported = {name for name in done.stderr.split() if name.startswith("sitscad.cli.")}
    assert imported == {"sitscad.cli.terminal"}
    assert all(f"  {name} " in done.stdout for name in COMMANDS)


def test_importing_sitscad_imports_only_version():
    source = str(Path(sitscad.__file__).parents[1])
    code = "import sys; before = set(sys.modules); import sitscad; print(*sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={"PYTHONPATH": source})
    imported = done.stdout.split()
    ours = {name for name in imported if name.startswith("sitscad")}
    assert ours == {"sitscad", "sitscad.basics", "sitscad.basics.version"}, done.stderr
    assert not {"numpy", "pydantic", "click", "pathlib"} & set(imported)


def test_every_public_name_exists():
    for name in sitscad.__all__:
        assert getattr(sitscad, name) is not None
    assert set(sitscad.__all__) <= set(dir(sitscad))
    with pytest.raises(AttributeError):
        _ = sitscad.no_such_name


_FAULTS = """
import resource, sys
import numpy
from sitscad.cli import keep_freed_memory
print(keep_freed_memory() if sys.argv[1] == "kept" else False)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    arrays = [numpy.ones(400_000) for _ in range(8)]
    del arrays
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only GNU's C library is asked to keep freed memory")
def test_freed_memory_is_reused_without_page_faults():
    """Large arrays that come and go were cleared by the system every time: a fifth of a check's time."""
    environment = {"PYTHONPATH": str(Path(sitscad.__file__).parents[1]), "NUMPY_MADVISE_HUGEPAGE": "0"}
    result = {
        how: subprocess.run([sys.executable, "-c", _FAULTS, how], capture_output=True, text=True, env=environment)
        for how in ("plain", "kept")
    }
    message = {how: done.stdout.split() for how, done in result.items()}
    assert (message["plain"][0], message["kept"][0]) == ("False", "True")
    assert int(message["kept"][1]) < 0.3 * int(message["plain"][1])
