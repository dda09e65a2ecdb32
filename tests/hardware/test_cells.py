"""A sensor with cells: its firmware gives the forces of every cell, by the cells' own maps."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest
from click.testing import CliRunner
from tolerance import approx

import sitscad
from sitscad.calibration.calibration import plan_calibration
from sitscad.cli import cli
from sitscad.files.formats.calibration_header import header
from tests.hardware.conftest import SANE, STRICT, TEMPLATES, Bench, compiled
from tests.hardware.test_examples import _checked, run_of_the_sketch
from tests.hardware.test_examples import node as node  # a fixture

pytestmark = pytest.mark.clients("gcc")
CELLS, PRESSED = 6, 3


@pytest.fixture(scope="module")
def maps():
    """The headers of all cells by their paths: the maps of two cells, because each takes seconds."""
    design = sitscad.Design(sitscad.load(TEMPLATES / "skin_strip_6.yaml"))
    own, other = (plan_calibration(design.cells.by_number(k).response) for k in (PRESSED, 1))
    result = {k: own if k == PRESSED else other for k in range(1, CELLS + 1)}
    return {f"cell-{k}/calibration.h": header(item.map, item.sensors.conversion, cell=k) for k, item in result.items()}


@pytest.fixture(scope="module")
def skin(maps, tmp_path_factory) -> Bench:
    design = sitscad.Design(sitscad.load(TEMPLATES / "skin_strip_6.yaml"))
    return compiled(design, tmp_path_factory.mktemp("skin"), SANE, maps)


def built(folder):
    """The command that compiles the example for the simulated converter."""
    sources = ["example_linux.c", "sensor.c", "ldc161x.c", "simulated/simulated.c", "-lm"]
    return ["gcc", *STRICT, "-DSIMULATED", "-o", str(folder / "sensor"), *sources]


def test_driver_computes_force_of_each_cell_with_its_map(skin):
    """The driver took one map of all coils, and refused that of a cell."""
    cell = skin.design.cells.by_number(PRESSED)
    frequency = sitscad.respond(cell, loads=[[5.0, 0.0, 0.0]]).frequency[0, 0]
    ohms = cell.estimates.coils[0].states["rest"].parallel_resistance
    words = [f"coil {PRESSED - 1} {frequency:.17g} {ohms:.17g}", "settle 6", "forces"]
    text = skin.run("begin", "settle 6", *["settle 1", "tare"] * 16, *words)
    result = np.array(text[-1], dtype=float).reshape(CELLS, 2)
    assert np.all(result[:, 0] == 0)
    assert result[PRESSED - 1, 1] == approx(5.0, rel=0.03)
    assert np.all(np.abs(np.delete(result[:, 1], PRESSED - 1)) < 0.05)


def test_fault_of_one_cell_keeps_forces_of_other_cells(skin):
    text = skin.run("begin", "settle 6", *["settle 1", "tare"] * 16, "coil 1 0 0", "settle 8", "forces")
    result = np.array(text[-1], dtype=float).reshape(CELLS, 2)
    assert result[1, 0] == 2 and np.all(np.delete(result[:, 0], 1) == 0)


def test_linux_example_prints_each_cell_without_error(skin, tmp_path):
    subprocess.run(built(tmp_path), cwd=skin.folder, check=True)
    run = [tmp_path / "sensor", "-", "3"]
    lines = subprocess.run(run, capture_output=True, text=True, check=True).stdout.splitlines()[-3:]
    assert all(line.count("cell ") == line.count(" N ") == CELLS and "calibration" not in line for line in lines)
    text = subprocess.run([*run, "lines"], capture_output=True, text=True, check=True).stdout
    (head,) = (line.partition("*")[0] for line in text.splitlines() if line.startswith("id,"))
    assert head.split(",")[-CELLS:] == [f"C{k}.normal_N" for k in range(1, CELLS + 1)]
    last = text.splitlines()[-1].partition("*")[0].split(",")[-CELLS:]
    assert all(abs(float(item)) < 0.05 for item in last)


@pytest.mark.slow
@pytest.mark.clients("g++")
def test_sketch_sends_the_forces_of_each_cell(skin, tmp_path):
    lines = run_of_the_sketch(skin.folder, tmp_path)
    (head, *_) = (line for line in lines if line.startswith("id,"))
    assert head.count(".normal_N") == CELLS


def test_exchanged_or_missing_cell_maps_do_not_compile(skin, maps, tmp_path):
    folder = tmp_path / "firmware"
    shutil.copytree(skin.folder, folder)
    command = ["gcc", *STRICT, "-fsyntax-only", "sensor.c"]
    assert subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode == 0
    for name, text, said in (("cell-2", maps["cell-1/calibration.h"], "cell-2/calibration.h"),
                             ("cell-6", None, "cell-6/calibration.h")):
        place = folder / name / "calibration.h"
        stored = place.read_bytes()
        place.unlink() if text is None else place.write_bytes(text)
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode != 0 and f'#error "{said}' in done.stderr
        place.write_bytes(stored)


def test_example_without_maps_names_missing_header_once(skin, tmp_path):
    subprocess.run([*built(tmp_path), "-DSENSOR_NO_CALIBRATION"], cwd=skin.folder, check=True)
    text = subprocess.run([tmp_path / "sensor", "-", "20"], capture_output=True, text=True, check=True).stdout
    assert text.count("calibration.h") == 1


@pytest.mark.slow
def test_output_line_has_all_axes_of_multi_coil_cells(tmp_path):
    spec = sitscad.load(TEMPLATES / "skin_strip_6.yaml").replace(
        {"cells.coils": 2, "target.size": "20 mm", "elastomer.size": "20 mm"})
    design = sitscad.Design(spec)
    item = plan_calibration(design.cells.by_number(1).response)
    own = {f"cell-{k}/calibration.h": header(item.map, item.sensors.conversion, cell=k) for k in (1, 2, 3)}
    folder = compiled(design, tmp_path, SANE, own).folder
    subprocess.run(built(tmp_path), cwd=folder, check=True)
    text = subprocess.run([tmp_path / "sensor", "-", "8", "lines"], capture_output=True, text=True, check=True).stdout
    (head,) = (line.partition("*")[0].split(",") for line in text.splitlines() if line.startswith("id,"))
    assert head[-6:] == [f"{pair}.{axis}_N" for pair in ("C1+C2", "C3+C4", "C5+C6") for axis in ("normal", "shear_x")]
    assert text.splitlines()[-1].count(",") == len(head) - 1


def test_ros_node_publishes_each_cell_on_its_topic(node):
    item, received, sent, message = node
    topics = []
    item.create_publisher = lambda kind, topic, depth: topics.append(topic) or item.publisher
    received += [
        _checked("id", "sequence", "C1_counts", "C1_status", "C2_counts", "C2_status", "C1.normal_N", "C2.normal_N"),
        _checked(item.identity, 0, 1, 0, 1, 0, "1.5", "2.5"), _checked(item.identity, 1, 1, 0, 1, 4, "1.0", ""),
    ]
    for _ in range(3):
        item.read()
    assert topics == ["cell_1/wrench", "cell_2/wrench"] and message == []
    assert [each.wrench.force.z for each in sent] == [-1.5, -2.5, -1.0]


@pytest.mark.slow
def test_guided_calibration_of_one_cell_completes(tmp_path):
    """It was refused; a coil of another cell does not stop it."""
    path, folder = TEMPLATES / "skin_strip_6.yaml", tmp_path / f"cell-{PRESSED}"
    source = f"sim:{path}?fault=open:C6"
    command = ["calibrate", str(path), "--cell", str(PRESSED), "--points", "3", "--from", source, "-o", str(folder)]
    done = CliRunner().invoke(cli, command)
    assert done.exit_code == 0, done.output
    head = (folder / "measured.csv").read_text().splitlines()[2]
    assert head == f"normal_N,C{PRESSED}_counts"
    text = (folder / "calibration.h").read_text()
    assert " * Calibrated by " in text and f"int sitscad_cell{PRESSED}_forces(" in text
