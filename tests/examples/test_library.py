"""The library as its page says it is: examples, names and signatures, silence, threads."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import is_dataclass
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))  # as a program

from tolerance import approx

import sitscad
from sitscad.spec import templates

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
TOLD = set(re.findall(r"[`.](\w+)", PAGE))
NAMES = Path(__file__).with_name("public_names.txt")


@pytest.mark.slow
def test_examples_of_library_page_run_with_shown_results():
    pytest.importorskip("shapely")
    pytest.importorskip("cadquery")
    blocks = "\n".join(re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE))
    result = doctest.DocTestParser().get_doctest(blocks, {}, "library.md", "docs/library.md", 0)
    message: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.IGNORE_EXCEPTION_DETAIL | doctest.ELLIPSIS)
    assert runner.run(result, out=message.append).failed == 0, "".join(message)
    assert len(result.examples) > 15


WITH_EXAMPLES = ("spec.sensor", "spec.load", "layout", "estimates", "estimates.requested_response", "checks.judging",
                 "files.export", "apps.coil.spiral", "apps.coil.drawn", "apps.study.sweeping")
"""Modules of public names with examples."""


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_docstring_examples_run(name):
    results = doctest.testmod(importlib.import_module(f"sitscad.{name}"))
    assert results.attempted and not results.failed


def run(name, monkeypatch, *arguments):
    """What an example's `main` gives, run as a script with arguments, from the root of the tree."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
    return runpy.run_path(str(ROOT / "docs" / "examples" / name))["main"]()


@pytest.mark.more
@pytest.mark.slow
def test_sweep_example_writes_plot_with_monotonic_inductances(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "sweep.png"
    rows = run("sweep.py", monkeypatch, "templates/three_axis_pad.yaml", picture)
    assert picture.read_bytes().startswith(b"\x89PNG") and len(rows) == 15
    for width in ("80 um", "100 um", "120 um"):
        inductances = [row["inductance_H"] for row in rows if row["width"] == width]
        assert inductances == sorted(inductances)  # more turns, more inductance


@pytest.mark.more
@pytest.mark.slow
def test_field_example_agrees_with_own_inductances(monkeypatch, capsys):
    result = run("field.py", monkeypatch)
    # its filaments have no width: 0.2 % of the mutual inductance; the mean distance leaves 0.4 % of the own
    assert result["own"] == approx(result["own_here"], rel=6e-3)
    assert result["mutual"] == approx(result["mutual_here"], rel=6e-3)
    assert 1e-6 < result["field_T"] < 5e-6 and "uT upwards" in capsys.readouterr().out


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.cad
def test_cad_example_writes_assembly_with_sensor(tmp_path, monkeypatch):
    pytest.importorskip("cadquery")
    made = run("cad_model.py", monkeypatch, "templates/square_bench.yaml", tmp_path)
    _, sensor = made["model"].children
    names = {child.label for child in sensor.children}
    assert {"board", "target", "elastomer", "copper-1-C1", "copper-2-C2"} <= names
    inside = made["housing"].bounding_box()
    for solid in sitscad.solids(made["layout"]):
        assert made["housing"].intersect(solid.shape) is None or not made["housing"].intersect(solid.shape).solids()
        box = solid.shape.bounding_box()
        assert inside.min.X < box.min.X and box.max.X < inside.max.X and inside.min.Z < box.min.Z
    assert {"base", "board", "target"} <= {name.split("/")[-1] for name in made["assembly"].objects}
    assert all((tmp_path / name).stat().st_size > 50_000 for name in ("housing.step", "on-a-plate.step"))


@pytest.mark.cad
@pytest.mark.slow
def test_pad_mesh_example_force_agrees_with_pad_law(monkeypatch, capsys):
    """Elements of this kind are too stiff, the coarser the more: on so few the law is at most a tenth below them."""
    pytest.importorskip("ngsolve")
    result = run("pad_compression.py", monkeypatch, "templates/bench_7mm.yaml", 1)
    assert "20% compressed" in capsys.readouterr().out
    for there, here in zip(result["elements"], result["law"], strict=True):
        assert 0.9 < here / there < 1.0


def described() -> dict[str, str]:
    """What callers rely on, of every public name that the page tells of: a function's parameters, a value's fields,
    the parameters of its public methods.
    """
    result: dict[str, str] = {}
    for name in sitscad.__all__:
        if name in TOLD:
            result |= _described(name, getattr(sitscad, name))
    return result


def _described(name: str, value: object) -> dict[str, str]:
    if not isinstance(value, type):
        return {name: _parameters(value) if inspect.isfunction(value) else type(value).__name__}
    methods = {
        f"{name}.{key}": _parameters(getattr(value, key))
        for key, each in sorted(vars(value).items())
        if key in TOLD and (inspect.isfunction(each) or isinstance(each, classmethod))
    }
    return {name: " ".join(value.__dataclass_fields__) if is_dataclass(value) else "class"} | methods


def _parameters(function: Callable[..., object]) -> str:
    """Names and defaults in their order, those that take names alone after a star."""
    shown = [str(one.replace(annotation=one.empty)) for one in inspect.signature(function).parameters.values()]
    return " ".join(f"({one})" for one in shown)


def test_api_page_lists_all_public_names_at_most_64():
    named = set(re.findall(r"sitscad\.(\w+)$", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"), re.MULTILINE))
    assert named == set(sitscad.__all__) - {"__version__"} and len(named) <= 64


def test_public_names_and_signatures_are_backward_compatible():
    """Callers hold on to them. `python tests/examples/test_library.py` writes them down anew; a value may gain fields,
    and a function parameters with a default after those that it has, without that.
    """
    now = described()
    known = dict(line.split("\t") for line in NAMES.read_text(encoding="utf-8").splitlines())
    for name, was in known.items():
        assert name in now, f"{name} is gone, or the page says nothing of it any more"
        if was.startswith("("):
            assert now[name].startswith(was) and all("=" in item for item in now[name][len(was) :].split()), name
        else:
            assert [item for item in now[name].split() if item in was.split()] == was.split(), name
    assert set(now) == set(known), "new on the page: write it down"


@pytest.mark.slow
def test_estimates_in_threads_equal_estimates_in_one_thread():
    specs = [sitscad.load_text(templates.read(name)) for name in ("grasper_3p5mm", "square_bench", "single_coil")]

    def worked_out(spec):
        layout = sitscad.lay_out(spec)
        paths = [path.points.tobytes() for path in sitscad.current_paths(layout)]
        return sitscad.estimate(layout), paths, sitscad.check(spec, layout, hints="none").findings

    with ThreadPoolExecutor(6) as pool:
        together = list(pool.map(worked_out, specs * 3))
    alone = [worked_out(spec) for spec in specs]
    assert [repr(result) for result in together] == [repr(result) for result in alone] * 3


def test_library_functions_print_nothing():
    code = (
        "import warnings; warnings.simplefilter('error')\n"
        "import sitscad\n"
        "from sitscad.spec import templates\n"
        "spec = sitscad.load_text(templates.read('single_coil')).replace('coil.turns', 8)\n"
        "layout = sitscad.lay_out(spec); sitscad.estimate(layout); sitscad.check(spec); sitscad.current_paths(layout)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout == done.stderr == ""


if __name__ == "__main__":
    NAMES.write_text("".join(f"{name}\t{what}\n" for name, what in described().items()), encoding="utf-8")
