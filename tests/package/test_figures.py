"""Packages on another processor: drawn files are equal byte by byte, computed figures by value."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sitscad
from sitscad.package.building import stale
from sitscad.package.manifest import (
    EXACT,
    FIGURES,
    MANIFEST,
    figure_files,
    has_equal_numbers,
    has_figures,
    read_manifest,
    sha256,
    with_equal_figures,
)
from sitscad.spec import templates

pytest.importorskip("gerbonara", reason="reading Gerber files back needs gerbonara")

ROOT = Path(__file__).parents[2]
DRAWN = ("gerber", "kicad", "laser", "firmware", "report")
SCRIPT = """
import json, sys
import sitscad
found = []
for folder, name in json.loads(sys.argv[1]):
    verified = sitscad.verify(folder + "/" + name, rebuild=True)
    found.append([verified.differences, verified.rebuilt, verified.by_value])
print(json.dumps(found))
"""


def on_another_processor(asked):
    """What `verify --rebuild` finds if every sum is added in the order of the oldest processor."""
    dispatched = " ".join(np._core._multiarray_umath.__cpu_dispatch__)
    surroundings = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_CORETYPE": "Prescott",
                    "NPY_DISABLE_CPU_FEATURES": dispatched}
    command = [sys.executable, "-c", SCRIPT, json.dumps(asked)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=surroundings)
    return json.loads(done.stdout.splitlines()[-1])


def built(name, folder, stages):
    return sitscad.build(sitscad.load(ROOT / "templates" / f"{name}.yaml"), folder, stages).directory


@pytest.mark.slow
@pytest.mark.parametrize("stages", [DRAWN, pytest.param(None, marks=[pytest.mark.more, pytest.mark.cad])])
def test_package_from_other_processor_passes_rebuild_verification(tmp_path, stages):
    names = ("single_coil", "bench_7mm") if stages else ("fingertip_foil", "grasper_4layer")
    request = [[str(tmp_path), built(name, tmp_path, stages).name] for name in names]
    for differences, rebuilt, by_value in on_another_processor(request):
        assert (differences, rebuilt) == ([], 0)
        assert by_value < 12


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    spec = sitscad.load_text(templates.read("single_coil"), "single_coil.yaml")
    return sitscad.build(spec, tmp_path_factory.mktemp("whole"), ["report"]).directory


def moved(folder, name, factor):
    """The first long decimal number of a file times a factor, as long as before, and its hash in the manifest."""
    path = folder / name
    text = re.sub(r"\d\.\d{12,}", lambda m: f"{float(m[0]) * factor:.{len(m[0]) - 2}f}", path.read_text(), count=1)
    assert text != path.read_text()
    path.write_text(text)
    manifest = read_manifest(folder)
    entry = replace(manifest.files[name], sha256=sha256(path.read_bytes()))
    (folder / MANIFEST).write_bytes(replace(manifest, files={**manifest.files, name: entry}).as_bytes())


@pytest.mark.parametrize(("factor", "is_equal"), [(1.0 + 1e-9, True), (1.0 + 5e-5, True), (1.0 + 3e-4, False)])
def test_value_changed_beyond_tolerance_is_difference(whole, tmp_path, factor, is_equal):
    folder = shutil.copytree(whole, tmp_path / whole.name)
    moved(folder, "estimate.json", factor)
    assert sitscad.verify(folder).ok  # by its own manifest it is as it was built
    result = sitscad.verify(folder, rebuild=True)
    named = {words.split()[0] for words in result.differences}
    assert MANIFEST in named  # it says that the report was made from another file
    assert ("estimate.json" in named) is not is_equal
    assert result.by_value == is_equal


def test_stale_comparison_ignores_changes_within_tolerance(whole, tmp_path):
    folder = shutil.copytree(whole, tmp_path / whole.name)
    moved(folder, "estimate.json", 1.0 + 1e-9)
    spec = sitscad.load_text(templates.read("single_coil"), "single_coil.yaml")
    manifest = read_manifest(folder)  # as if another machine had to make all of it anew
    files = {name: replace(entry, made_from="0") for name, entry in manifest.files.items()}
    (folder / MANIFEST).write_bytes(replace(manifest, files=files, built_from="0").as_bytes())
    assert stale(spec, tmp_path, ["report"]).stale == ()
    moved(folder, "estimate.json", 1.001)
    assert [words.split()[0] for words in stale(spec, tmp_path, ["report"]).stale] == ["estimate.json"]


def test_wrong_hash_is_difference_although_value_agrees(whole, tmp_path):
    folder = shutil.copytree(whole, tmp_path / whole.name)
    path = folder / "estimate.json"
    path.write_text(re.sub(r"(\d\.\d{12})\d", r"\g<1>0", path.read_text()))
    assert sitscad.verify(folder).changed == 1
    assert not sitscad.verify(folder, rebuild=True).ok
    assert figure_files(folder, read_manifest(folder)).keys() == {"findings.json", "report.html"}


EQUAL = [
    ('{"a": 1.2345678, "b": [1e-9, -2.0]}', '{"a": 1.2345679, "b": [1.2e-9, -2.0]}'),  # small in its list
    ("Rp 1.23 kohm, 4.798 N", "Rp 1.24 kohm, 4.799 N"),  # rounded to the other side
    ("{1.5e+02f, 3.0e-04f}", "{1.5e+02f, 3.1e-04f}"),
    ("counts 30512440", "counts 30512441"),
    ("%PDF\n<< /Length 10 >>\n172.5 3 l\nxref\n0 7\n000011", "%PDF\n<< /Length 12 >>\n172.501 3 l\nxref\n0 7\n000013"),
]
OTHER = [
    ('{"a": 1.234}', '{"b": 1.234}'),
    ('{"a": 1.2345678}', '{"a": 1.2347678}'),
    ('{"a": 1e-9, "b": 2.0}', '{"a": 1.2e-9, "b": 2.0}'),
    ("RCOUNT 41250", "RCOUNT 41251"), ("0x1F40", "0x1F41"), ("code 17", "code 18"), ("C1", "C2"),
    ("0.16 mm", "0.17 mm"), ("sitscad 0.1.0", "sitscad 0.2.0"), ("2026-11-28", "2026-11-29"), ("1.0 mm", "1.0 um"),
    ("-1.5 nH", "1.5 nH"), ("%PDF\n1 l\nxref\n0 7", "%PDF\n1 l\nxref\n0 8"), ("1.5", "1.5 2"),
]


@pytest.mark.parametrize(("one", "other", "is_equal"),
                         [*((*pair, True) for pair in EQUAL), *((*pair, False) for pair in OTHER)])
def test_numbers_agree_within_tolerance_and_text_exactly(one, other, is_equal):
    assert has_equal_numbers(one.encode(), other.encode()) is is_equal
    assert has_equal_numbers(other.encode(), one.encode()) is is_equal
    stored = with_equal_figures({"x": other.encode()}, {"x": one.encode()})
    assert stored["x"] == (one if is_equal else other).encode()


@pytest.mark.parametrize("name", [
    "fpc/a-F_Cu.gbr", "fpc/a-PTH.drl", "fpc/a-netlist.d356", "fpc/a-order.zip", "fpc/a-drawing.pdf",
    "kicad/a.kicad_pcb", "laser/a-target.dxf", "laser/a-target.svg", "mount/a-jaw.step", "mount/a-jaw.stl",
    "mount/assembly.glb", "bom.csv", "mesh/a-elastomer.inp", "firmware/wiring/a.kicad_sch", "spec/a.yaml",
])
def test_manufacturing_files_are_compared_byte_by_byte(name):
    assert not has_figures(name)


def test_documentation_lists_every_pattern_of_value_files():
    page = (ROOT / "docs" / "package.md").read_text("utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| by value |")]
    assert len(rows) == 1
    named = set(re.findall(r"`([^`]+)`", rows[0]))
    assert {*FIGURES, *EXACT} == named
