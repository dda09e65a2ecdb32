"""`sitscad calibrate` as people use it: the plan, the table filled in, and what is refused."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest

import sitscad
from sitscad.calibration.calibration import simulated_sensors
from sitscad.calibration.unknowns import draw_units


def test_invalid_bench_table_is_reported_with_line_and_column(run, pair, tmp_path):
    (tmp_path / "bench.csv").write_text("normal_N,C1_counts,C2_counts\n0,5,6\n1,7,nan\n")
    done = run("calibrate", pair, "bench.csv")
    assert (done.code, done.out) == (2, "")
    assert "bench.csv:3:3 C2: 'nan' is no finite number" in done.err
    assert not (tmp_path / "pair-calibration").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["--rotation", "fixed"], "held, free"), (["--points", "2"], "3<=x<=40"), (["nowhere.csv"], "nowhere.csv")],
)
def test_wrong_calibrate_arguments_exit_2(run, pair, arguments, words):
    done = run("calibrate", pair, *arguments)
    assert done.code == 2 and words in done.err


def test_calibrate_without_spec_and_read_without_source_spec_exit_2(run):
    done = run("calibrate", "--from", "sim:pair.yaml")
    assert done.code == 2 and "SPEC, the sensor that is calibrated, is missing" in done.err
    done = run("read", "sim:?seconds=2")
    assert done.code == 2 and "sim: names no spec" in done.err


def test_calibrate_of_coil_without_target_exits_2(run, pair, tmp_path):
    (tmp_path / "alone.yaml").write_text("\n".join((tmp_path / pair).read_text().splitlines()[:5]) + "\n")
    done = run("calibrate", "alone.yaml")
    assert done.code == 2 and "no target" in done.err


@pytest.mark.slow
@pytest.mark.parametrize(
    "number", [5, pytest.param(6, marks=pytest.mark.more), pytest.param(8, marks=pytest.mark.more)]
)
def test_completed_plan_gives_calibration_within_stated_error(run, pair, tmp_path, number):
    """True readings of few points are taken: three of four such sensors were refused for a while."""
    planned = run("calibrate", pair, "--points", "5")
    folder = tmp_path / "pair-calibration"
    assert planned.code in (0, 1) and "not calibrated" in planned.out
    before = json.loads((folder / "calibration.json").read_text())
    message, _, text = (folder / "plan.csv").read_text().partition("\n")
    assert message == "# rotation: held"
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == 5 + 3  # points, and three tares that tell the noise
    sensors = simulated_sensors(sitscad.Design(sitscad.load(tmp_path / "pair.yaml")).response)
    hidden = draw_units(sensors.unknowns, 1, number)[0]
    loads = np.array([[float(row.get(f"{name}_N", 0.0)) for name in ("normal", "shear_x", "shear_y")] for row in rows])
    counts = np.rint(sensors.conversion.counts(sensors.frequencies_under(hidden, loads, exact=True)))
    for row, read in zip(rows, counts, strict=True):
        row |= {f"{coil}_counts": str(int(count)) for coil, count in zip(sensors.coils, read, strict=True)}
    with (tmp_path / "bench.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    done = run("calibrate", pair, "bench.csv", "-o", "made")
    assert done.code in (0, 1) and "moved by" in done.out
    after = json.loads((tmp_path / "made" / "calibration.json").read_text())
    assert after["is_calibrated"] and not before["is_calibrated"]
    tried = np.vstack([np.zeros((1, 3)), sensors.range.evenly_spread_loads(30, 300)])
    read = np.rint(sensors.conversion.counts(sensors.frequencies_under(hidden, tried, exact=True)))
    result = sitscad.map_of(tmp_path / "made" / "calibration.json")
    off = result(read[1:], read[0]) - tried[1:, sensors.range.columns]
    stated = np.array([after["error_N"][axis] for axis in result.axes])
    assert np.all(np.sqrt(np.mean(off**2, axis=0)) < 2.5 * stated)
    assert np.sqrt(np.mean(off[:, 0] ** 2)) < 0.3 * before["error_N"]["normal"]
