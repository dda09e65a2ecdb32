"""Firmware in C and MicroPython on simulated converters that warm: forces with and without compensation."""

from __future__ import annotations

import copy
import importlib
import json
import math
import re
import subprocess
import sys
import time
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from tolerance import approx

import sitscad
from sitscad import Design, SimulatedConverter
from sitscad.apps.hardware.ambient import pad_time_constant, parse_ambient, warmed_frequencies
from sitscad.apps.hardware.bench_board import GOOD, WATCHDOG, Board, CoilReading
from sitscad.apps.hardware.diagnosis import TARES, Forces, scan_lines
from sitscad.apps.hardware.source import open_source
from sitscad.cli import cli
from sitscad.files.documents import firmware
from sitscad.files.formats.compensation_header import compensation_header
from sitscad.package.contents import nominal_calibration
from tests.calibration.test_c_compensation import run, warmed_counts
from tests.hardware.conftest import SANE, STRICT, TEMPLATES, compiled
from tests.hardware.test_examples import FakeI2C, run_of_the_sketch

COLD, WARM, MINUTES = 20.0, 37.0, 10.0
POINTS = 9
NO_TEMPERATURE = 2  # SENSOR_NO_TEMPERATURE less the number of coils

spec = sitscad.load(TEMPLATES / "bench_7mm.yaml").replace({
    "requirements.temperature": f"{COLD} degC", "requirements.temperature_range": [COLD, WARM],
    "readout.capacitance": "100 pF"})


class WarmUp:
    """A design under full load in a warm-up: times (s), temperatures (degC), frequencies (Hz) of all coils; at rest."""

    def __init__(self, key: str, value: object) -> None:
        self.design = Design(spec.replace(key, value))
        cells, course = self.design.cells, parse_ambient(f"{COLD}:{WARM}", 60.0 * MINUTES)
        bench = cells.by_number(1).sensing.solved.bench
        self.times, self.full = np.linspace(0.0, 60.0 * MINUTES, POINTS), bench.full_scales["normal"]
        self.loads = np.tile([self.full, 0.0, 0.0], (POINTS, 1))
        self.celsius, self.pad = course.board(self.times), course.pad(self.times, pad_time_constant(
            self.design.spec.elastomer, self.design.spec.target))
        response = cells.by_number(1).response
        under_load = response.on_pad(bench.poses(self.loads)).frequency
        self.frequencies = warmed_frequencies(cells, under_load, self.loads, self.times, course, 1)
        at_rest = response.on_pad(bench.poses(0.0 * self.loads[:1])).frequency
        self.rest = warmed_frequencies(cells, at_rest, 0.0 * self.loads[:1], self.times[:1], course, 1)[0]
        self.maps = {name.removeprefix("calibration/"): content
                     for name, content in nominal_calibration(self.design).items() if name.endswith(".h")}


@pytest.fixture(scope="module")
def by_sensor():
    return WarmUp("readout.thermistor.part", "tmp117")


@pytest.fixture(scope="module")
def by_reference():
    return WarmUp("array.reference", {})


def in_c(warm_up, folder, *after):
    """Codes and normal forces (N) by the driver in C: tare, warm-up, commands afterwards, each followed by forces."""
    bench = compiled(warm_up.design, folder, SANE, warm_up.maps)
    ohms = [coil.states.get("rest", coil.states["free"]).parallel_resistance
            for coil in warm_up.design.estimates.all_coils]
    has_sensor = warm_up.design.spec.readout.thermistor is not None

    def state(frequencies, celsius):
        tanks = [f"coil {k} {value:.17g} {ohms[k]:.17g}" for k, value in enumerate(frequencies)]
        return tanks + [f"celsius {celsius}"] * has_sensor

    commands = [*state(warm_up.rest, COLD), "begin", "settle 60", *["settle 1", "tare"] * 16]
    for frequencies, celsius in zip(warm_up.frequencies, warm_up.celsius, strict=True):
        commands += [*state(frequencies, celsius), "settle 60", "forces"]
    for command in after:
        commands += [command, "settle 60", "forces"]
    rows = [(int(row[0]), float(row[1])) for row in bench.run(*commands)[35::2]]
    return np.array([code for code, _ in rows]), np.array([force for _, force in rows])


def test_simulated_warmth_agrees_with_sensor_solved_anew(by_sensor):
    counts, _ = warmed_counts(by_sensor.design, by_sensor.loads[:1], WARM, WARM - by_sensor.pad[-1])
    simulated = by_sensor.design.estimates.readout.conversion.counts(by_sensor.frequencies[[0, -1]])
    drift = simulated[1] - counts[0]
    assert np.all(np.abs(drift) < 0.02 * np.abs(simulated[1] - simulated[0]))


@pytest.mark.clients("gcc")
@pytest.mark.parametrize("name", ["by_sensor", "by_reference"])
def test_c_forces_are_constant_in_warm_up_and_uncompensated_without_valid_temperature(name, request, tmp_path, capsys):
    warm_up = request.getfixturevalue(name)
    coils = len(warm_up.design.estimates.all_coils)
    if name == "by_sensor":
        faults = "celsius nan", "celsius 80", "celsius 36"
    else:
        off, last = 1.01 * warm_up.rest[2], warm_up.frequencies[-1][2]
        faults = "coil 2 0 0", f"coil 2 {off:.17g} 20000", f"coil 2 {last:.17g} 9e3"
    codes, forces = in_c(warm_up, tmp_path, *faults)
    assert list(codes) == [0] * POINTS + [coils + NO_TEMPERATURE] * 2 + [0]
    course, (faulty, beyond, again) = forces[:POINTS], forces[POINTS:]
    with capsys.disabled():
        print(f"\n  {name}: {1e3 * np.abs(course - course[0]).max():.0f} mN compensated, "
              f"{1e3 * abs(faulty - course[0]):.0f} mN not")
    assert np.abs(course - course[0]).max() < 0.03 * warm_up.full
    assert abs(again - course[-1]) < 0.03 * warm_up.full
    assert faulty == approx(beyond, abs=0.01) and course[0] - faulty > 0.15 * warm_up.full


@pytest.fixture
def on_board(monkeypatch, tmp_path):
    """Function that returns the modules of MicroPython of a warm-up's firmware, with the headers of the map beside."""
    monkeypatch.setattr(time, "sleep_ms", lambda ms: None, raising=False)
    monkeypatch.syspath_prepend(str(tmp_path / "micropython"))
    names = ("sensor_config", "sensor", "forces", "thermometer")

    def modules(design, maps):
        written(design, tmp_path, maps)
        for name in names:
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        config = importlib.import_module("sensor_config")
        names_here = names[1:] if design.spec.readout.thermistor is not None else names[1:3]
        return SimpleNamespace(config=config, **{name: importlib.import_module(name) for name in names_here})

    yield modules
    for name in names:
        sys.modules.pop(name, None)


@pytest.mark.clients("gcc")
@pytest.mark.parametrize("name", ["by_sensor", "by_reference"])
def test_micropython_forces_in_warm_up_are_those_of_c_header(name, request, on_board, tmp_path):
    warm_up = request.getfixturevalue(name)
    board = on_board(warm_up.design, warm_up.maps)
    chip = SimulatedConverter(
        warm_up.design, loads=np.column_stack([[0.0, 0.5, *(1.0 + warm_up.times)], np.zeros((POINTS + 2, 3))]),
        frequencies=np.vstack([warm_up.rest, warm_up.rest, warm_up.frequencies]))
    sensor = board.sensor.Sensor(FakeI2C(chip))

    def reading():
        result = None
        for _ in range(8):
            chip.advance(3_000_000)
            result = sensor.poll() or result
        return result

    forces = board.forces.Forces(f"{tmp_path}/")
    assert forces(reading(), COLD)[0] == board.forces.NO_READING
    assert forces.tare([reading() for _ in range(16)], COLD)
    chip.pause(round(1e9) - chip.time)
    course, rows = [], []
    for celsius in warm_up.celsius:
        reading()
        last = reading()
        state, newtons = forces(last, celsius)
        assert state == board.forces.OK
        course.append(newtons["normal"])
        rows.append((forces.warming(last, celsius), *(last[k][0] for k in range(2))))
        if celsius < WARM:
            chip.pause(round(np.diff(warm_up.times)[0] * 1e9) - 48_000_000)
    assert np.abs(np.array(course) - course[0]).max() < 0.03 * warm_up.full
    codes, in_c_header, _ = run(tmp_path, warm_up.maps, "kelvin", rows, forces.rest)
    assert list(codes) == [0] * POINTS and course == approx(in_c_header[:, 0], abs=1e-3)
    uncompensated = []
    if name == "by_sensor":
        uncompensated = [forces(last, each) for each in (math.nan, 80.0, math.inf)]
    else:
        for broken in ((last[2][0], board.sensor.WATCHDOG), (round(1.01 * last[2][0]), 0)):
            uncompensated.append(forces([*last[:2], broken]))
    for state, newtons in uncompensated:
        assert state == board.forces.NO_TEMPERATURE and course[0] - newtons["normal"] > 0.15 * warm_up.full
    assert forces([(last[0][0], board.sensor.STALE), *last[1:]], WARM)[0] == board.forces.NO_READING


def test_micropython_says_no_temperature_without_temperature_header(by_sensor, on_board, tmp_path):
    board = on_board(by_sensor.design, {"calibration.h": by_sensor.maps["calibration.h"]})
    forces = board.forces.Forces(f"{tmp_path}/")
    counts = by_sensor.design.estimates.readout.conversion.counts(by_sensor.frequencies[:1])[0]
    rest = by_sensor.design.estimates.readout.conversion.counts(by_sensor.rest[None])[0]
    assert forces.tare([[(int(each), 0) for each in rest]], COLD)
    state, newtons = forces([(int(each), 0) for each in counts], COLD)
    assert state == board.forces.NO_TEMPERATURE and newtons["normal"] == approx(by_sensor.full, rel=0.02)


THERMOMETER = r"""
#include <stdio.h>
#include "thermometer.h"
static unsigned identity, steps, error;
static int write_read(void *context, uint8_t address, const uint8_t *out, size_t out_count, uint8_t *in, size_t count)
{
    const unsigned value = out[0] == 0x0F ? identity : steps;
    (void)context;
    in[0] = (uint8_t)(value >> 8);
    in[1] = (uint8_t)(value & 0xFFu);
    return (int)error || address != 0x48 || out_count != 1u || count != 2u;
}
int main(void)
{
    const ldc161x_bus bus = {NULL, NULL, write_read};
    while (scanf("%x %x %u", &identity, &steps, &error) == 3)
        printf("%.6f\n", (double)thermometer_celsius(&bus));
    return 0;
}
"""

NTC = r"""
#include <stdio.h>
#include "thermometer.h"
int main(void)
{
    float ratio;
    while (scanf("%f", &ratio) == 1)
        printf("%.6f\n", (double)thermometer_ntc(ratio));
    return 0;
}
"""


def written(design, folder, maps=MappingProxyType({})):
    """Write a design's firmware into a folder, with headers of the map."""
    for name, content in (firmware.render(design.spec, design.estimates) | dict(maps)).items():
        path = folder / name.removeprefix("firmware/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def from_c(folder, program, design, rows):
    """Temperatures (degC) of a program with the firmware's thermometer.h, for rows of words."""
    written(design, folder / "c")
    (folder / "c" / "main.c").write_text(program)
    command = ["gcc", *STRICT, *SANE, "-o", "main", "main.c", "ldc161x.c", "-lm"]
    done = subprocess.run(command, cwd=folder / "c", capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    text = subprocess.run([folder / "c" / "main"], input="\n".join(rows), capture_output=True, text=True, check=True)
    return [float(line) for line in text.stdout.split()]


@pytest.mark.clients("gcc")
@pytest.mark.parametrize(("part", "identity", "step"), [("tmp117", 0x1117, 2.0**-7), ("tmp1075", 0x7500, 2.0**-8)])
def test_digital_sensor_is_read_alike_in_c_and_micropython(part, identity, step, tmp_path, on_board):
    design = Design(spec.replace("readout.thermistor.part", part))
    rows = [(identity, round(25.0 / step), 0), (identity, 0x10000 - round(25.0 / step), 0), (identity, 1, 0),
            (0x0000, 0x0C80, 0), (0xFFFF, 0xFFFF, 0), (identity, 0x0C80, 1), (identity, 0x8000, 0)]
    celsius = from_c(tmp_path, THERMOMETER, design, [f"{who:x} {steps:x} {error}" for who, steps, error in rows])
    board = on_board(design, {})
    same = []
    for who, steps, error in rows:
        def readfrom_mem(address, register, count, who=who, steps=steps, error=error):
            if error or address != 0x48:
                raise OSError
            return (who if register == 0x0F else steps).to_bytes(count, "big")
        same.append(board.thermometer.Digital(SimpleNamespace(readfrom_mem=readfrom_mem))())
    assert celsius[:3] == approx([25.0, -25.0, step], abs=1e-6) and same[:3] == approx([25.0, -25.0, step], abs=1e-6)
    assert all(map(math.isnan, celsius[3:] + same[3:]))  # the last is the TMP117's before its first conversion


@pytest.mark.clients("gcc")
@pytest.mark.parametrize("part", ["ncp18xh103f03rb", "ntcle100e3103"])
def test_ntc_divider_is_read_alike_in_c_and_micropython(part, tmp_path, on_board):
    design = Design(spec.replace("readout.thermistor.part", part))
    figures = design.spec.readout.thermistor.part
    degrees = np.array([-20.0, 0.0, 25.0, 37.0, 90.0])
    ohms = figures.resistance * np.exp(figures.b * (1.0 / (degrees + 273.15) - 1.0 / 298.15))
    ratios = [*(ohms / (ohms + figures.resistance)), 0.0, 1.0, 0.9995]
    celsius = from_c(tmp_path, NTC, design, [f"{ratio:.9g}" for ratio in ratios])
    board = on_board(design, {})
    same = [board.thermometer.Ntc(SimpleNamespace(read_u16=lambda ratio=ratio: round(65535 * ratio)))()
            for ratio in ratios]
    assert celsius[:5] == approx(degrees, abs=2e-3) and same[:5] == approx(degrees, abs=0.03)
    assert all(map(math.isnan, celsius[5:] + same[5:]))


@pytest.mark.clients("gcc")
def test_driver_of_coil_without_target_compiles_with_temperature_sensor(tmp_path):
    lone = sitscad.load(TEMPLATES / "single_coil.yaml").replace("readout.thermistor.part", "tmp117")
    written(Design(lone), tmp_path)
    sources = ["sensor.c", "example_linux.c"]
    subprocess.run(["gcc", *STRICT, "-DSIMULATED", "-fsyntax-only", *sources], cwd=tmp_path, check=True, timeout=120)


@pytest.mark.clients("gcc")
def test_linux_example_sends_temperature_change_of_simulated_digital_sensor(by_sensor, tmp_path):
    written(by_sensor.design, tmp_path, by_sensor.maps)
    sources = ["example_linux.c", "sensor.c", "ldc161x.c", "simulated/simulated.c"]
    command = ["gcc", *STRICT, "-DSIMULATED", "-o", "sensor", *sources, "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=120)
    done = subprocess.run([tmp_path / "sensor", "-", "9", "lines"], capture_output=True, text=True, check=True)
    head, *lines = (line.partition("*")[0].split(",") for line in done.stdout.splitlines() if "*" in line)
    assert head[-1] == "warming_K" and lines
    assert [line[-1] for line in lines] == ["0.0000"] * len(lines) and all(len(line) == len(head) for line in lines)


@pytest.mark.clients("g++")
@pytest.mark.parametrize(("part", "warming"), [("ncp18xh103f03rb", "0.0000"), ("tmp117", "")])
def test_arduino_sketch_says_whether_temperature_is_valid(part, warming, by_sensor, tmp_path):
    """The stub has an NTC at 25 degC on A0, and no digital sensor on its buses."""
    folder = tmp_path / "firmware"
    written(Design(spec.replace("readout.thermistor.part", part)), folder, by_sensor.maps)
    lines = [line.partition("*")[0].split(",") for line in run_of_the_sketch(folder, tmp_path) if "*" in line]
    assert lines[0][-1] == "warming_K" and len(lines) > 3
    assert {line[-1] for line in lines[1:]} == {warming} and lines[-1][-2] != ""


def test_simulated_board_follows_ambient_temperature_and_load(by_reference, tmp_path):
    path = tmp_path / "warm.yaml"
    path.write_text(by_reference.design.spec.source.text)
    source, _ = open_source(f"sim:{path}?temperature={COLD}:{WARM}&load=normal:{by_reference.full}&seconds=600",
                          by_reference.design)
    (chip,) = source.chips
    seconds = 1e9 * by_reference.times
    read = np.array([[chip.tank(k, round(at))[0] for k in range(3)] for at in seconds])
    assert read == approx(by_reference.frequencies, rel=1e-6)
    assert math.isnan(source.celsius(300.0))  # the design has no temperature sensor
    source.wait(0.01)
    source.skip(600.0 - source.now())
    source.apply_load(by_reference.loads[0], True)
    assert [chip.tank(k, chip.time)[0] for k in range(3)] == approx(by_reference.frequencies[-1], rel=1e-6)


def test_fault_of_reference_coil_leaves_uncompensated_forces(by_reference):
    """The map of the drawn sensor reads the coils at rest; the third coil is dead, in the tare and afterwards."""
    forces, board = Forces([sitscad.calibrate(by_reference.design).map], True), Board(by_reference.design, ())
    counts = np.rint(by_reference.design.estimates.readout.conversion.counts(by_reference.rest[None])[0]).astype(int)
    scan = {k: CoilReading(0.0, int(count), WATCHDOG if k == 2 else GOOD) for k, count in enumerate(counts)}
    for _ in range(TARES):
        forces.add_to_tare(board, scan)
    assert forces.tare(board) == [*counts[:2], None] and forces.is_compensated
    assert forces(board, scan)["normal"] == approx(0.0, abs=1e-3) and forces.compensated_forces(board, scan) == {}
    assert "not compensated" in next(iter(scan_lines(board, [scan], forces)))


def test_pad_lags_behind_ramp_by_time_constant():
    course = parse_ambient("20:37", 600.0)
    times = np.array([0.0, 200.0, 600.0, 700.0])
    assert course.board(times)[-1] == WARM
    assert course.pad(times, 18.0) == approx([COLD, COLD + 17.0 / 600.0 * 182.0, WARM - 0.51, WARM], abs=2e-3)


@pytest.mark.parametrize("text", ["20:37:40", "nan", "-300", "20:1000", "no/table.csv", "time_s,kelvin\n0,1\n",
                                  "time_s,celsius\n", "time_s,celsius\n0,20\n0,21\n", "time_s,celsius\n0,300\n"])
def test_invalid_ambient_temperature_is_refused(text, tmp_path):
    if "\n" in text:
        (tmp_path / "day.csv").write_text(text)
        text = str(tmp_path / "day.csv")
    with pytest.raises(ValueError, match=r"time_s|degC"):
        parse_ambient(text, 1.0)


def test_table_of_temperatures_is_linear_between_rows(tmp_path):
    (tmp_path / "day.csv").write_text("time_s,celsius\n0,17\n43200,37\n86400,17\n")
    course = parse_ambient(str(tmp_path / "day.csv"), 1.0)
    assert course.board(np.array([21600.0, 64800.0, 9e4])) == approx([27.0, 27.0, 17.0], abs=1e-9)


def test_read_shows_forces_with_and_without_compensation(by_sensor, tmp_path):
    path = tmp_path / "warm.yaml"
    path.write_text(by_sensor.design.spec.source.text)
    (tmp_path / "calibration.json").write_text(json.dumps(sitscad.calibrate(by_sensor.design).document()))
    source = f"sim:{path}?temperature={COLD}:{WARM}&load=normal:{by_sensor.full}&seconds=600"
    words = ["read", source, "--tare", "--calibration", str(tmp_path / "calibration.json"), "--every", "30"]
    done = CliRunner().invoke(cli, words)
    rows = [re.findall(r"normal (\S+) N", line) for line in done.output.splitlines() if " K: " in line]
    kelvin = [float(each) for each in re.findall(r"compensated by (\S+) K", done.output)]
    plain, compensated = np.array([row for row in rows if float(row[0]) > 0.5 * by_sensor.full], dtype=float).T
    assert done.exit_code == 0 and kelvin[-1] == approx(WARM - COLD, abs=1.0) and len(plain) > 12
    assert np.abs(compensated - compensated[0]).max() < 0.03 * by_sensor.full < 0.15 * by_sensor.full < np.ptp(plain)


@pytest.mark.clients("gcc")
def test_measured_coefficients_are_not_used_beyond_their_temperatures(by_sensor, on_board, tmp_path):
    """The calibration was between 15 and 30 degC: at 36 degC the change is small enough, the temperature is not."""
    spec_drifts = by_sensor.design.cells.by_number(1).sensing.solved.drift_coefficients
    header = compensation_header(replace(spec_drifts, calibrated=(15.0, 30.0)))
    measured = copy.copy(by_sensor)
    measured.maps = by_sensor.maps | {"temperature.h": header}
    measured.celsius = np.linspace(25.0, 36.0, POINTS)
    codes, _ = in_c(measured, tmp_path)
    inside = [celsius <= 30.0 + 0.05 * 15.0 for celsius in measured.celsius]
    coils = len(by_sensor.design.estimates.all_coils)
    assert list(codes) == [0 if each else coils + NO_TEMPERATURE for each in inside] and 0 < sum(inside) < POINTS
    board = on_board(by_sensor.design, measured.maps)
    forces = board.forces.Forces(f"{tmp_path}/")
    readings = [[(int(count), 0) for count in by_sensor.design.estimates.readout.conversion.counts(row[None])[0]]
                for row in (by_sensor.rest, by_sensor.frequencies[0])]
    assert forces.tare([readings[0]], COLD)
    states = [forces(readings[1], celsius)[0] for celsius in measured.celsius]
    assert states == [board.forces.OK if each else board.forces.NO_TEMPERATURE for each in inside]
