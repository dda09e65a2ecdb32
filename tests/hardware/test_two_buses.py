"""Nine coils on three converters, the third on a second I2C bus: driver, examples and bench take them as one sensor."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

import sitscad
from sitscad.apps.hardware.bench_board import Board
from sitscad.apps.hardware.converter import SimulatedConverter
from sitscad.apps.hardware.diagnosis import read_scans
from sitscad.apps.hardware.source import open_source
from sitscad.files.documents import firmware_driver
from sitscad.package.contents import incoming_tests
from tests.hardware.conftest import STRICT, TEMPLATES, Bench, compiled
from tests.hardware.test_driver import BUS, GOOD, LOST, _of_coils, _tested
from tests.hardware.test_examples import run_of_the_sketch

pytestmark = [pytest.mark.clients("gcc"), pytest.mark.slow]
COILS = 9


@pytest.fixture(scope="module")
def grid(tmp_path_factory) -> Bench:
    return compiled(sitscad.Design(sitscad.load(TEMPLATES / "skin_grid_3x3.yaml")), tmp_path_factory.mktemp("grid"))


def test_two_bus_driver_reads_all_coils_and_reports_lost_converter(grid):
    begun, rest, tested, silent = grid.run("begin", "settle 4", "test", "nack 2 1", "poll")
    assert begun == ["0", "good"] and _of_coils(rest)[2] == [GOOD] * COILS
    assert _tested(tested)[0] == 0 and silent[0] == str(BUS)
    assert str(LOST) in [row[0] for row in grid.run("begin", "settle 4", "reset 2", *["poll"] * 8)]
    _, wrong = grid.run("begin", "coil 8 0 0", "settle 4")
    assert [status == GOOD for status in _of_coils(wrong)[2]] == [True] * 8 + [False]


def test_two_bus_readme_names_equal_buses_in_every_step(grid):
    design = grid.design
    files = firmware_driver.render_readme(design.layout, design.estimates, incoming_tests(design).board)
    text = " ".join(files["firmware/readme.txt"].decode().split())
    assert set(re.findall("/dev/i2c-([0-9]+)", text)) == set(re.findall("i2cdetect -y ([0-9]+)", text)) == {"1", "3"}
    shown = dict(re.findall("i2cdetect -y ([0-9]+)` shows ([0-9a-f]+(?: and [0-9a-f]+)?)", text))
    assert shown == {"1": "2a and 2b", "3": "2a"}
    assert "calibration.h" not in text[text.index("FILES"):]  # cells have maps of their own


def test_two_bus_driver_does_not_compile_with_single_bus(grid):
    """It read beyond the one that it was given."""
    program = '#include "sensor.h"\nint f(sensor *one, const ldc161x_bus *bus) {return sensor_begin(one, bus);}'
    command = ["gcc", "-x", "c", *STRICT, "-fsyntax-only", f"-I{grid.folder}", "-"]
    refused = subprocess.run(command, input=program, capture_output=True, text=True, check=False)
    assert refused.returncode != 0 and "incompatible" in refused.stderr
    program = program.replace("*bus)", "(*bus)[SENSOR_BUSES])")
    subprocess.run(command, input=program, text=True, check=True)


def test_linux_example_runs_with_two_buses(grid, tmp_path):
    made = ["gcc", *STRICT, "-o", str(tmp_path / "sensor"), "example_linux.c", "sensor.c", "ldc161x.c"]
    subprocess.run([*made, "-DSIMULATED", "simulated/simulated.c", "-lm"], cwd=grid.folder, check=True)
    done = subprocess.run([tmp_path / "sensor", "-,-", "3"], capture_output=True, text=True, check=True)
    assert [line.split(": ")[-1] for line in done.stdout.splitlines()[1:10]] == ["good"] * COILS
    subprocess.run([*made, "-lm"], cwd=grid.folder, check=True)
    assert subprocess.run([tmp_path / "sensor", "/dev/null"], capture_output=True, check=False).returncode == 1


@pytest.mark.clients("g++")
def test_arduino_sketch_runs_with_two_buses(grid, tmp_path):
    """Each bus of the stub answers at its second try."""
    _, *lines = run_of_the_sketch(grid.folder, tmp_path)
    assert [line[:15] for line in lines[:2]] == ["# no answer on "] * 2
    assert lines[2:11] == [f"# C{k}: good" for k in range(1, COILS + 1)] and "C9_counts" in lines[11]


class TwoAddresses:
    """machine.I2C with one or two simulated converters behind it."""

    def __init__(self, *chips):
        self.chips = dict(zip((0x2A, 0x2B), chips, strict=False))

    def readfrom_mem(self, address, register, count):
        return self.chips[address].read(register).to_bytes(count, "big")

    def writeto_mem(self, address, register, content):
        self.chips[address].write(register, int.from_bytes(content, "big"))


def test_micropython_module_reads_two_buses(grid, monkeypatch):
    monkeypatch.syspath_prepend(str(grid.folder / "micropython"))
    for name in ("sensor", "sensor_config"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(time, "sleep_ms", lambda ms: None, raising=False)
    import sensor

    chips = [SimulatedConverter(grid.design, number=number) for number in range(3)]
    with pytest.raises(sensor.SensorError, match="on 2 buses, not 1"):
        sensor.Sensor(TwoAddresses(*chips))
    item = sensor.Sensor(TwoAddresses(*chips[:2]), TwoAddresses(chips[2]))
    for chip in chips:
        chip.advance(60_000_000)
    assert [status for _, status in item.poll()] == [sensor.GOOD] * COILS
    for name in ("sensor", "sensor_config"):
        sys.modules.pop(name, None)


def test_read_source_opens_two_buses(grid, monkeypatch):
    opened = []
    monkeypatch.setitem(sys.modules, "smbus2", SimpleNamespace(SMBus=lambda path: opened.append(path) or path))
    source, _ = open_source("/dev/i2c-1,/dev/i2c-3", grid.design)
    wired = [(chip.bus, chip.address) for chip in source.chips]
    assert wired == [("/dev/i2c-1", 0x2A), ("/dev/i2c-1", 0x2B), ("/dev/i2c-3", 0x2A)] and len(opened) == 2
    with pytest.raises(ValueError, match="on 2 buses"):
        open_source("/dev/i2c-1", grid.design)
    simulated, _ = open_source(f"sim:{TEMPLATES}/skin_grid_3x3.yaml?fault=open:C9", None)
    board = Board(grid.design, simulated.chips)
    assert board.set_up() == []
    read = [(k, item.is_good) for scan in read_scans(board, simulated, 0.1) for k, item in scan.items()]
    assert set(read) == {*((k, True) for k in range(COILS - 1)), (COILS - 1, False)}
