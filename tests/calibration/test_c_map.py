"""The C header against the numpy map: compiled as strictly as a compiler can be told, at 1,000 random loads."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest
from tolerance import approx

from sitscad.calibration.map_fit import SHARE, fit_unit_map, map_gain, sensor_samples
from sitscad.files.formats.calibration_header import PROGRAM, header

FLAGS = [
    "-std=c99",
    "-O2",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
]

MAIN = r"""
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "calibration.h"
int main(void)
{
    static uint32_t counts[ROWS][SITSCAD_COILS];
    struct sitscad_tare tare;
    float forces[SITSCAD_AXES], sum = 0.0f;
    struct timespec from, to;
    for (int c = 0; c < SITSCAD_COILS; ++c)
        if (scanf("%u", &tare.counts[c]) != 1) return 1;
    for (int r = 0; r < ROWS; ++r)
        for (int c = 0; c < SITSCAD_COILS; ++c)
            if (scanf("%u", &counts[r][c]) != 1) return 1;
    for (int r = 0; r < ROWS; ++r) {
        printf("%d", sitscad_forces((const uint32_t *)counts[r], &tare, forces));
        for (int a = 0; a < SITSCAD_AXES; ++a) printf(" %.9g", (double)forces[a]);
        printf("\n");
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
    for (int k = 0; k < 100; ++k)
        for (int r = 0; r < ROWS; ++r) {
            (void)sitscad_forces((const uint32_t *)counts[r], &tare, forces);
            sum += forces[0];
        }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    printf("%.1f %g\n", ((double)(to.tv_sec - from.tv_sec) * 1e9 + (double)(to.tv_nsec - from.tv_nsec))
           / (100.0 * ROWS), (double)sum);
    return 0;
}
"""


def _run_c(tmp_path, found, conversion, counts, tare):
    """Results, forces and nanoseconds a call of the compiled header."""
    (tmp_path / "calibration.h").write_bytes(header(found, conversion, ["a remark with */ in it"]))
    (tmp_path / "main.c").write_text(MAIN)
    program = tmp_path / "map"
    command = ["gcc", *FLAGS, f"-DROWS={len(counts)}", "-o", str(program), str(tmp_path / "main.c"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    given = "\n".join(" ".join(map(str, map(int, row))) for row in [tare, *counts])
    *lines, last = subprocess.run(
        [str(program)], input=given, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    values = np.array([[float(value) for value in line.split()] for line in lines])
    return values[:, 0].astype(int), values[:, 1:], float(last.split()[0])


@pytest.mark.clients("gcc")
def test_c_example_program_prints_forces_of_header(tmp_path, foretold):
    (tmp_path / "calibration.h").write_bytes(header(foretold.map, foretold.sensors.conversion))
    (tmp_path / "example.c").write_text(PROGRAM)
    made = tmp_path / "forces"
    command = ["gcc", *FLAGS, "-o", str(made), str(tmp_path / "example.c"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    tare = foretold.map.rest
    rows = [tare, 1.001 * tare, 1.002 * tare]
    given = "\n".join(" ".join(str(int(count)) for count in row) for row in [tare, *rows]) + "\n"
    text = subprocess.run([str(made)], input=given, capture_output=True, text=True)
    result = np.array([[float(value) for value in line.split()] for line in text.stdout.splitlines()])
    assert text.returncode == 0
    assert np.abs(result - foretold.map(np.floor(rows), tare)).max() < 3e-5 * foretold.map.full_scale.max()
    assert subprocess.run([str(made)], input=given + "7 x\n", capture_output=True, text=True).returncode == 1
    still = subprocess.run([str(made)], input=given + "0 0\n", capture_output=True, text=True)
    assert still.returncode == 2 and still.stdout.splitlines()[-1] == "0 0"


def _at_loads(sensors, errors, count):
    loads = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(count, 2000)])
    counts = np.rint(sensors.conversion.counts(sensors.frequencies_under(errors, loads)))
    return loads[1:], counts[1:], counts[0]


@pytest.mark.clients("gcc")
def test_c_header_forces_agree_with_numpy_map(tmp_path, sensors, foretold, capsys):
    loads, counts, tare = _at_loads(sensors, np.zeros(len(sensors.unknowns)), 1000)
    result, forces, time = _run_c(tmp_path, foretold.map, foretold.sensors.conversion, counts, tare)
    wanted, full = foretold.map(counts, tare), foretold.map.full_scale
    apart = np.abs(forces - wanted) / full
    truth = np.sqrt(np.mean((forces - loads[:, sensors.range.columns]) ** 2, axis=0)) / full
    with capsys.disabled():
        off = ", ".join(f"{100 * one:.2f}" for one in truth)
        print(f"\n  C map: {100 * apart.max():.1e} % of full scale from numpy's, {time:.0f} ns a call; {off} % off")
    assert apart.max() < 2e-5
    assert np.all(truth < 0.01)
    assert np.all(result == 0)


@pytest.mark.clients("gcc")
def test_every_c_header_table_is_used(tmp_path, sensors, hidden):
    result = fit_unit_map(sensors, hidden)
    _, counts, tare = _at_loads(sensors, hidden, 200)
    code = re.sub(r"/\*.*?\*/", "", header(result, sensors.conversion).decode("ascii"), flags=re.DOTALL)
    tables = re.findall(r"static const \w+ (\w+)\[", code)
    assert tables and [name for name in tables if len(re.findall(rf"\b{name}\b", code)) < 2] == [], "unused"
    _, forces, _ = _run_c(tmp_path, result, sensors.conversion, counts, tare)
    assert np.abs(forces - result(counts, tare)).max() < 3e-5 * result.full_scale.max()


@pytest.mark.clients("gcc")
def test_c_forces_report_invalid_counts_and_counts_beyond_map(tmp_path, foretold):
    tare = foretold.map.rest
    counts = np.floor([tare, 0 * tare, 0 * tare + 2**28 - 1, 1.1 * tare, 0.9 * tare])
    result, forces, _ = _run_c(tmp_path, foretold.map, foretold.sensors.conversion, counts, tare)
    assert list(result) == [0, 1, 1, 2, 2]
    assert np.all(forces[:3] == 0.0), "no change is no force, exactly"
    assert np.abs(forces[3:] - foretold.map(counts[3:], tare)).max() < 1e-4 * foretold.map.full_scale.max()


def test_c_header_is_repeatable_single_precision_with_short_lines(foretold):
    text = header(foretold.map, foretold.sensors.conversion).decode("ascii")
    assert header(foretold.map, foretold.sensors.conversion).decode("ascii") == text
    assert "malloc" not in text and "double" not in text and max(map(len, text.splitlines())) <= 120
    for word in ("newtons", "grasper-4layer", "One sigma"):
        assert word in text


def test_map_gain_corresponds_to_target_share_of_inductance(sensors):
    """A gain of 14 says that the target takes 1/29 of the inductance at rest."""
    share = 1.0 / (1.0 + map_gain(sensors) / SHARE)
    assert np.all((share > 0.01) & (share < 0.2))
    rest = sensor_samples(sensors, np.zeros(len(sensors.unknowns)), np.zeros((1, 3)))
    assert rest.readings[0] == approx(rest.rest, rel=1e-12)
