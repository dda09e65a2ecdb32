"""The C header of the compensation: warmed sensors of the model, and temperatures that are not valid."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.package.contents import nominal_calibration
from tests.oracles.warmed import warmed_counts

TEMPLATES = Path(__file__).parents[2] / "templates"
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wdouble-promotion",
         "-Wshadow"]
COLD, WARM = 20.0, 37.0

MAIN = r"""
#include <stdio.h>
#include "temperature.h"
int main(void)
{
    struct sitscad_tare tare;
    uint32_t counts[SITSCAD_COILS];
    float forces[SITSCAD_AXES], kelvin;
    for (int c = 0; c < SITSCAD_COILS; ++c)
        if (scanf("%u", &tare.counts[c]) != 1) return 1;
    while (scanf("%f", &kelvin) == 1) {
        for (int c = 0; c < SITSCAD_COILS; ++c)
            if (scanf("%u", &counts[c]) != 1) return 1;
        printf("%d", sitscad_compensated((const uint32_t *)counts, &tare, kelvin, forces));
        for (int a = 0; a < SITSCAD_AXES; ++a) printf(" %.9g", (double)forces[a]);
        printf(" %.9g\n", (double)THERMOMETER);
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def cold():
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    return spec.replace({"requirements.temperature": f"{COLD} degC", "requirements.temperature_range": [COLD, WARM],
                         "readout.capacitance": "100 pF"})


def run(folder, files, thermometer, rows, tare):
    """Results, forces and temperatures of the compiled headers, for rows of a temperature change and counts."""
    for name in ("calibration.h", "temperature.h"):
        (folder / name).write_bytes(files[name])
    (folder / "main.c").write_text(MAIN.replace("THERMOMETER", thermometer))
    command = ["gcc", *FLAGS, "-o", str(folder / "main"), str(folder / "main.c"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    lines = [" ".join(map(str, row)) for row in (tare, *rows)]
    text = subprocess.run([str(folder / "main")], input="\n".join(lines), capture_output=True, text=True, check=True)
    values = np.array([[float(value) for value in line.split()] for line in text.stdout.splitlines()])
    return values[:, 0].astype(int), values[:, 1:-1], values[:, -1]


def headers(design):
    return {name.removeprefix("calibration/"): text for name, text in nominal_calibration(design).items()}


@pytest.mark.clients("gcc")
def test_forces_of_a_warmed_sensor_are_compensated(tmp_path, cold):
    design = Design(cold.replace("readout.thermistor.part", "ncp18xh103f03rb"))
    full = design.sensing.solved.bench.full_scales
    loads = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.3, 0.0]]) * [
        full["normal"], full["shear_x"], 0.0]
    counts, tare = warmed_counts(design, loads, WARM)
    rows = [(kelvin, *each) for kelvin in (WARM - COLD, "nan", 100.0) for each in counts]
    result, forces, celsius = run(tmp_path, headers(design), "sitscad_celsius(6111.0f)", rows, tare)
    compensated, without, beyond = np.split(forces, 3)
    true, scales = loads[:, :2], np.array([full["normal"], full["shear_x"]])
    assert list(result) == [0] * len(loads) + [3] * 2 * len(loads)
    assert np.array_equal(without, beyond) and np.abs((without - true) / scales).max() > 0.15
    assert np.abs((compensated - true) / scales).max() < 0.025
    part = design.spec.readout.thermistor.part
    ohms = part.resistance * math.exp(part.b * (1.0 / (celsius[0] + 273.15) - 1.0 / 298.15))
    assert ohms == approx(6111.0, rel=1e-4)


@pytest.mark.clients("gcc")
def test_compensated_force_is_constant_during_warming(tmp_path, cold):
    """17 K in ten minutes under full load, with the lag of the pad that is stated for this rate."""
    design = Design(cold.replace("readout.thermistor.part", "tmp117"))
    solved = design.sensing.solved
    full, lag = solved.bench.full_scales["normal"], solved.warmed[-1].compensation.lag
    temperatures = np.linspace(COLD, WARM, 5)
    series = [warmed_counts(design, np.array([[full, 0.0, 0.0]]), each, lag * (each > COLD)) for each in temperatures]
    rows = [(kelvin, *counts[0]) for kelvin, (counts, _) in zip(temperatures - COLD, series, strict=True)]
    plain = [("nan", *row[1:]) for row in rows]
    result, forces, _ = run(tmp_path, headers(design), "kelvin", rows + plain, series[0][1])
    compensated, without = np.split(forces[:, 0], 2)
    assert list(result) == [0] * 5 + [3] * 5
    assert without[0] - without[-1] > 0.15 * full and np.all(np.diff(without) < 0.0)
    assert np.abs(compensated - compensated[0]).max() < 0.02 * full


@pytest.mark.clients("gcc")
def test_reference_coil_counts_give_temperature_rise(tmp_path, cold):
    design = Design(cold.replace("array.reference", {}))
    drift = design.cells.reference_drift
    before = 50_000_000
    after = round(before * math.exp(drift * 10.0))
    rest = np.rint(design.estimates.readout.conversion.part(slice(0, 2)).counts(design.sensing.solved.bench.rest))
    tare = rest.astype(int)
    _, _, kelvin = run(tmp_path, headers(design), f"sitscad_warming({after}u, {before}u)", [(0.0, *tare)], tare)
    assert kelvin[0] == approx(10.0, rel=2e-3)
    _, _, kelvin = run(tmp_path, headers(design), f"sitscad_warming(0u, {before}u)", [(0.0, *tare)], tare)
    assert math.isnan(kelvin[0])


def test_package_without_thermometer_has_no_compensation(cold):
    assert "calibration/temperature.h" not in nominal_calibration(Design(cold))
