"""Rows that no sensor can have been in, fits that tell nothing, and readings given twice."""

from __future__ import annotations

import warnings
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from tolerance import approx

import sitscad.calibration
from sitscad.calibration.bench_data import BenchError, read_table, table_points
from sitscad.calibration.model_fit import NoFit, fit_model
from sitscad.calibration.refusals import require_agreement, require_possible_points, unused_column_remarks


@pytest.fixture
def poses(tmp_path, sensors):
    """Writes a table of poses, one of them as given, and gives it with its points."""

    def written(head, row):
        names = head.split(",")
        rows = [["0"] * len(names), row.split(","), *([f"{-20 * k}" if n == "z_um" else "0" for n in names]
                                                       for k in (1, 2, 3))]
        path = tmp_path / "poses.csv"
        path.write_text("\n".join([f"{head},C1_Hz,C2_Hz", *(",".join([*row, "7e6", "7e6"]) for row in rows)]) + "\n")
        table = read_table(str(path), sensors.coils)
        return table, table_points(table, sensors)

    return written


@pytest.mark.parametrize(
    ("head", "row", "words"),
    [
        ("x_mm,z_um", "0,-640", r"poses.csv:3:2: the target's lowest point would be .* pressed to nothing"),
        ("x_mm,z_um", "0,-2500", r"poses.csv:3:2: the target's lowest point would be .* inside the board"),
        ("z_um,ry_deg", "-400,-14.5", r"poses.csv:3:1: the target's lowest point would be .* inside the board"),
        ("z_um,rx_deg", "0,20", r"poses.csv:3:2: tilted by 20 degrees"),
    ],
)
def test_impossible_target_poses_are_refused(poses, sensors, head, row, words):
    with pytest.raises(BenchError, match=words):
        require_possible_points(*poses(head, row), sensors)


def test_load_beyond_pad_stability_is_refused(table, sensors):
    def pulled(head, rows):
        return head, [*rows[:4], ["40", "6", *rows[4][2:]], *rows[5:]]

    read = read_table(table(pulled), sensors.coils)
    with pytest.raises(
        BenchError, match=r"bench.csv:6:1: normal 40 N, shear_x 6 N: the pad gives way sideways .* even if"
    ):
        require_possible_points(read, table_points(read, sensors), sensors)


@pytest.fixture(scope="module")
def fit(sensors, bench):
    return fit_model(sensors, bench)


def _read(table, sensors, change=lambda head, rows: (head, rows)):
    result = read_table(table(change), sensors.coils)
    return result, table_points(result, sensors)


def test_fit_of_matching_readings_is_accepted(table, sensors, fit):
    read, points = _read(table, sensors)
    require_possible_points(read, points, sensors)
    require_agreement(read, points, sensors, fit)


def test_unsettled_fit_is_refused_with_worst_row(table, sensors, fit):
    read, points = _read(table, sensors)
    worst = 1 + int(np.argmax(fit.disagreement[1:]))
    words = rf"bench.csv:{worst + 2}:1 no sensor of this design reads so: .* by 2.8 times what .* without a best fit"
    with pytest.raises(BenchError, match=words):
        require_agreement(read, points, sensors, replace(fit, settled=False, excess=2.8))
    require_agreement(read, points, sensors, replace(fit, settled=False))  # what is left is as expected


def test_unknown_beyond_6_sigma_is_refused_by_name(table, sensors, fit):
    read, points = _read(table, sensors)
    k = [item.name for item in sensors.unknowns].index("offset_x")
    moved = fit.moved.copy()
    moved[k] = -6.5
    with pytest.raises(BenchError, match=r"offset_x would be -6.5 sigma of manufacture off \(.* m\)"):
        require_agreement(read, points, sensors, replace(fit, moved=moved))


@pytest.mark.slow
def test_row_contradicted_by_all_others_is_refused(table, sensors):
    """The load of a row mistyped by its sign: nothing in it alone is impossible."""

    def turned(head, rows):
        k = next(k for k in range(1, len(rows)) if float(rows[k][1]) and float(rows[k][0]) < 3.0)
        lines.append(k + 2)  # the head is the first line
        return head, [*rows[:k], [rows[k][0], f"{-float(rows[k][1])}", *rows[k][2:]], *rows[k + 1 :]]

    lines = []
    read, points = _read(table, sensors, turned)
    with pytest.raises(BenchError, match=rf"bench.csv:{lines[0]}:1 no sensor .* others foretell shear_x .* N off"):
        require_agreement(read, points, sensors, fit_model(sensors, points))


def test_loads_unrelated_to_readings_are_refused(table, sensors, fit):
    read, points = _read(table, sensors)
    for excess in (30.0, 60.0):
        with pytest.raises(BenchError, match=rf"loads and readings disagree by {excess:.1f} times"):
            require_agreement(read, points, sensors, replace(fit, excess=excess))
    require_agreement(read, points, sensors, replace(fit, excess=14.0))  # hysteresis of a tenth of full scale


FAR_ASIDE = """\
0,0,49981566,52129422
3,-1,51193593,51074490
6,1,49809390,54736180
6,0,50071128,53032169
1.5,1,49809019,53452940
6,-1,51561400,51115922
1.5,0,50007105,52386453
1.5,-1,50964021,51079620
3,1,49808273,53902324
"""
"""Readings of a simulated unit of the design whose target is 0.8 mm aside, 26 sigma."""


@pytest.mark.slow
def test_readings_of_far_displaced_target_are_refused_with_worst_row(table, sensors):
    """The fit went to the edge of what is looked for, where slopes were not finite: an internal error."""
    read, points = _read(table, sensors, lambda head, rows: (head, [line.split(",") for line in FAR_ASIDE.split()]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = fit_model(sensors, points)
        assert np.all(np.isfinite(result.likely)) and np.all(np.isfinite(result.disagreement))
        with pytest.raises(BenchError, match="this row most"):
            require_agreement(read, points, sensors, result)


def _twice(sensors, bench, scale):
    """Adds inductances that a firmware with another capacitor computed, changes from rest times a scale."""

    def change(head, rows):
        capacitance = 1.5 * sensors.model.estimates.readout.conversion_capacitance
        result = 1e6 / (capacitance * (2.0 * np.pi * bench.frequency) ** 2)
        result = result[:1] + scale * (result - result[:1])
        return [*head, "C1_uH", "C2_uH"], [[*row, *(f"{v:.9f}" for v in more)]
                                           for row, more in zip(rows, result, strict=True)]

    return change


@pytest.mark.parametrize(("scale", "words"), [(1.0, "agree within"), (1.05, "times the converter's noise")])
def test_counts_column_is_preferred_and_difference_of_second_column_reported(table, sensors, bench, scale, words):
    read, points = _read(table, sensors, _twice(sensors, bench, scale))
    assert points.frequency == approx(bench.frequency, rel=1e-7)
    item, other = unused_column_remarks(read, points, sensors)
    assert "C1_counts is used, C1_uH is not" in item and "C2_counts is used" in other
    assert words in item and words in other
    assert "capacitor +50.0 % off" in item
    assert unused_column_remarks(*_read(table, sensors), sensors) == ()


@pytest.mark.slow
def test_table_whose_fit_fails_is_refused(table, design, monkeypatch):
    def nothing(*given, **more):
        raise NoFit("a fit ended where nothing is known of its values")

    monkeypatch.setattr(import_module("sitscad.calibration.calibration"), "fit_model", nothing)
    with pytest.raises(BenchError, match=r"bench.csv:2:1 no sensor of this design reads so: a fit ended"):
        sitscad.calibrate(design, table())
