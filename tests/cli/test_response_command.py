"""`sitscad response` as people and programs use it."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.checks.trials import Trials


def test_response_json_has_promised_fields(run, pair):
    done = run("response", pair, "--pose", "z=-0.2,ry=1", "--load", "normal=2", "--format", "json")
    document = json.loads(done.out)
    assert (document["coils"], document["spec"]) == (["C1", "C2"], "pair.yaml")
    posed, loaded = document["points"]
    assert "performance" not in document  # seconds that nobody asked for
    assert posed["pose"]["z_m"] == approx(-2e-4, rel=1e-6)
    assert posed["strain"] == approx(0.1, rel=1e-6)
    assert posed["force_N"][2] < -0.1 and posed["force_N"][0] < 0.0
    assert loaded["force_N"] == approx([0.0, 0.0, -2.0], rel=1e-6, abs=1e-12)
    assert loaded["moment_Nm"] == approx([0.0, 0.0, 0.0], rel=1e-6, abs=1e-12)
    for point in document["points"]:
        for name in ("inductance_H", "resistance_ohm", "target_resistance_ohm", "frequency_Hz", "counts"):
            assert len(point[name]) == 2
        change = np.array(point["target_change_H"])
        assert change == approx(change.T, rel=1e-6)
        assert np.all(np.array(point["target_change_error"]) < 0.02)
        assert all(0.01 < error < 0.05 for error in point["target_resistance_error"])


@pytest.mark.more
@pytest.mark.slow
def test_response_text_contains_pose_readings_and_notes(run, pair):
    done = run("response", pair, "--load", "normal=1,shear_x=0.2")
    assert done.code in (0, 1)
    for word in ("C1", "C2", "counts", "uH", "MHz", "its loss", "1.5 %"):
        assert word in done.out
    assert "What the sensor feels" in run("response", pair, "--performance").out
    felt = json.loads(run("response", pair, "--performance", "--format", "json").out)["performance"]
    assert [point["at"] for point in felt] == ["rest", "half", "full"]
    assert json.loads(run("estimate", pair, "--performance", "--format", "json").out)["performance"] == felt
    assert "What the sensor feels" in run("estimate", pair, "--performance").out
    assert "performance" not in json.loads(run("estimate", pair, "--format", "json").out)
    assert run("response", pair, "--load", "normal=1,shear_x=0.2,rotation=held").out != done.out
    assert run("response", pair, "--load", "normal=1,shear_x=0.2,rotation=free").out == done.out


def test_response_csv_has_one_row_per_point(run, pair):
    done = run("response", pair, "--scan", "x=-1:1:3", "--frequency", "5MHz", "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(done.out)))
    assert [float(row["x_m"]) for row in rows] == approx([-1e-3, 0.0, 1e-3], rel=1e-6, abs=1e-12)
    assert float(rows[0]["target_change_H.C1.C1"]) < float(rows[2]["target_change_H.C1.C1"]) < 0.0
    assert float(rows[1]["inductance_H.C1"]) > 0.0
    assert 0.01 < float(rows[1]["target_resistance_error.C1"]) < 0.05


@pytest.mark.slow
def test_response_files_have_equal_numbers(run, pair, tmp_path):
    shown = json.loads(run("response", pair, "--pose", "x=0.3", "--jacobian", "--format", "json").out)
    done = run("response", pair, "--pose", "x=0.3", "--jacobian", "-o", "found.npz")
    assert (done.out, "1 point" in done.err) == ("", True)
    first = (tmp_path / "found.npz").read_bytes()
    run("response", pair, "--pose", "x=0.3", "--jacobian", "-o", "found.npz")
    assert (tmp_path / "found.npz").read_bytes() == first
    with np.load(tmp_path / "found.npz") as result:
        point = shown["points"][0]
        assert result["pose"].shape == (1, 6)
        assert result["target_change_H"][0] == approx(np.array(point["target_change_H"]), rel=1e-6)
        assert result["frequency_by_pose"][0] == approx(np.array(point["frequency_by_pose"]), rel=1e-6)
        # nearer is higher, and towards +x is towards the second coil
        assert result["frequency_by_pose"][0, 0, 2] < 0.0
        assert result["frequency_by_pose"][0, 0, 0] < 0.0 < result["frequency_by_pose"][0, 1, 0]
        assert result["frequency_by_load"][0, 0, 0] > 0.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("pair.yaml", "--pose", "q=1"), "NAME one of"),
        (("pair.yaml", "--frequency", "5"), "unit"),
        (("pair.yaml", "--format", "xml"), "text, json, csv"),
        (("pair.yaml", "-o", "found.txt"), ".npz, .csv, .json"),
        (("pair.yaml", "--poses", "missing.csv"), "missing.csv"),
        (("good.yaml",), "no target"),
        (("broken.yaml",), "circle"),
        (("pair.yaml", "--load", "normal=-1"), "0 or more"),
        (("pair.yaml", "--load", "normal=1e9"), "10 kN"),
        (("pair.yaml", "--tolerance", "nan"), "--tolerance"),
        (("pair.yaml", "--pose", "x=1e9"), "more than 1 m from rest"),
        (("pair.yaml", "--pose", "z=-0.2", "--pose", "rx=90"), "away from the coils"),
        (("pair.yaml", "--pose", "rz=1e6"), "more than once"),
        (("pair.yaml", "--pose", "z=-500"), "inside or under the board"),
    ],
)
def test_wrong_response_arguments_exit_2_with_sentence(run, pair, arguments, said):
    done = run("response", *arguments)
    assert (done.code, done.out) == (2, "")
    assert said in done.err


@pytest.mark.slow
def test_response_accepts_load_cases_by_name(run, pair, tmp_path):
    text = (tmp_path / pair).read_text()
    text += "loads: {press: {}, scissor: {opening: 10 deg, normal: 1 N}, edge: {normal: 1 N, offset: [1, 0]}}\n"
    (tmp_path / "cases.yaml").write_text(text)
    done = run("response", "cases.yaml", "--case", "all", "--pose", "z=-0.1", "--jacobian", "--format", "json")
    points = json.loads(done.out)["points"]
    assert [point.get("case") for point in points] == [None, "press", "scissor", "edge"]
    assert points[1]["force_N"] == approx([0.0, 0.0, -2.0], abs=1e-6)
    assert points[2]["pose"]["ry_rad"] == approx(np.radians(10.0), rel=1e-6)
    text = run("response", "cases.yaml", "--case", "scissor", "--case", "edge").out
    assert "load case scissor: 1 N" in text and [line.split()[0] for line in text.splitlines()[2:7:2]] == [
        "case", "C2", "C2"]
    rows = run("response", "cases.yaml", "--case", "all", "--pose", "z=-0.1", "--format", "csv").out.splitlines()
    assert [row.split(",")[0] for row in rows] == ["case", "", "press", "scissor", "edge"]
    assert not any(cell == "-0" for row in rows for cell in row.split(","))
    done = run("response", "cases.yaml", "--case", "scisor")
    assert (done.code, "did you mean scissor" in done.err) == (2, True)
    assert "names no load case" in run("response", pair, "--case", "all").err


@pytest.mark.slow
@pytest.mark.parametrize("command", ["estimate", "response", "calibrate"])
def test_commands_without_hints_try_no_changed_designs(run, pair, tmp_path, monkeypatch, command):
    path = tmp_path / pair
    path.write_text(path.read_text().replace("turns: 12.5", "turns: 8"))

    def refuse(*_):
        raise AssertionError("a changed design was tried")

    monkeypatch.setattr(Trials, "_trial_of", refuse)
    with pytest.raises(AssertionError, match="was tried"):
        sitscad.check(sitscad.load(path))
    assert run(command, pair).code == 0


@pytest.mark.slow
@pytest.mark.parametrize(("glue", "line"), [("", 30e-6), ("assembly: {glue_line: 0.1}\n", 1e-4)])
def test_response_prints_gap_at_rest_and_adhesive_thickness(run, pair, tmp_path, glue, line):
    (tmp_path / pair).write_text((tmp_path / pair).read_text() + glue)
    document = json.loads(run("response", pair, "--pose", "z=-0.1", "--format", "json").out)
    gap = json.loads(run("estimate", pair, "--format", "json").out)["gaps_m"]["rest"]
    assert document["gap_at_rest_m"] == approx(gap, rel=1e-12)
    assert document["glue_in_gap_m"] == approx(2.0 * line, rel=1e-12)
    message = run("response", pair, "--pose", "z=-0.1").out
    assert f"{1e3 * gap:.4g} mm" in message and f"{2e6 * line:.3g} um" in message
