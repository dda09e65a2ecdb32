"""Sweeps: the table, its files, and what is refused before anything is computed."""

from __future__ import annotations

import csv
import io
import json
import re
from concurrent.futures import Future

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.apps.study.evaluating import NOT_COMPUTED, Chunk, Workers, evaluate_chunk
from sitscad.apps.study.evaluation import Evaluation
from sitscad.apps.study.measures import MEASURES
from sitscad.apps.study.space import Base, RangeError, Space, Variable, values_by_count, values_by_step
from sitscad.apps.study.sweeping import (
    parse_range,
    sweep_as_written,
    sweep_csv,
    sweep_json,
    sweep_npz,
    sweep_svg,
    sweep_text,
)
from sitscad.cli import run
from sitscad.spec import templates

CONTRACT = {
    "inductance", "rp", "q", "frequency", "amplitude", "signal.normal", "resolution.normal", "resolution.shear_x",
    "resolution.shear_y", "range.normal", "range.shear_x", "range.shear_y", "crosstalk", "error.temperature.normal",
    "error.temperature.shear_x", "error.temperature.shear_y", "error.tilt.normal", "error.tilt.shear_x",
    "error.tilt.shear_y", "error.gap", "fit.closed_pair", "fit.spare", "fit.width", "fit.length", "board.area",
    "board.layers", "rate", "supply_current", "yield",
}


@pytest.fixture(scope="module")
def bench():
    return sitscad.load_text(templates.read("single_coil"))


@pytest.fixture(scope="module")
def table(bench):
    ranges = {"coil.turns": [10, 12], "coil.trace_width": ["100 um", "3 mm", "120 um"]}
    return sitscad.sweep(bench, ranges, ["rp", "inductance", "signal.normal", "board.area"])


def test_all_promised_measures_exist():
    assert set(MEASURES) >= CONTRACT


@pytest.mark.slow
def test_measured_values_equal_check_and_estimate():
    spec = sitscad.load_text(templates.read("grasper_4layer"))
    results = sitscad.measure(
        spec, ["inductance", "rp", "fit.spare", "fit.length", "resolution.normal"], level="full"
    )
    estimates, result = sitscad.estimate(sitscad.lay_out(spec)), sitscad.check(spec, hints="none")
    states = [state for coil in estimates.coils for state in coil.states.values()]
    assert results.values["rp"][0] == approx(min(state.parallel_resistance for state in states), rel=1e-12)
    assert results.values["inductance"][0] == approx(min(state.inductance for state in states), rel=1e-12)
    assert results.values["fit.spare"][0] == approx(min(measure.margin for measure in result.fit), rel=1e-12)
    assert results.values["fit.length"][0] == approx(result.board[0], rel=1e-12)
    assert results.verdict == "ok" and 0.0 < results.values["rp"][1] < 0.1 * results.values["rp"][0]


def test_sweep_rows_vary_last_key_fastest(table):
    assert table.shape == (2, 3) and len(table) == 6
    assert table.keys["coil.turns"] == (10, 10, 10, 12, 12, 12)
    assert table.keys["coil.trace_width"] == ("100 um", "3 mm", "120 um") * 2
    assert table.values["inductance"][3] > table.values["inductance"][0]


def test_refused_design_has_no_values_and_names_rule(table):
    assert table.verdict[1] == "fails" and table.refused_by[1][0].startswith("SIT01")
    assert np.isnan(table.values["rp"][1]) and np.isfinite(table.values["rp"][0])


def test_absent_measures_are_nan_null_or_empty(table):
    assert np.isnan(table.values["signal.normal"]).all()
    rows = list(csv.DictReader(io.StringIO(sweep_csv(table))))
    assert rows[0]["signal.normal"] == "" and float(rows[0]["rp"]) == approx(float(table.values["rp"][0]), rel=1e-9)
    assert json.loads(sweep_json(table))["measures"]["signal.normal"]["value"] == [None] * 6


@pytest.mark.slow
def test_sweep_files_are_repeatable(table):
    with np.load(io.BytesIO(sweep_npz(table))) as arrays:
        assert arrays["rp.error"].shape == (6,) and arrays["verdict"][1] == "fails"
    assert sweep_npz(table) == sweep_npz(table)
    assert sweep_svg(table) == sweep_svg(table) and "refused within" in sweep_svg(table)


def test_sweep_picture_of_three_keys_is_refused(bench):
    ranges = {"coil.turns": [10], "coil.trace_width": ["100 um"], "coil.outer_diameter": [9e-3, 10e-3]}
    with pytest.raises(ValueError, match="one key or two"):
        sweep_svg(sitscad.sweep(bench, ranges, ["rp"]))


def test_sweep_with_two_processes_equals_single_process(bench, table):
    ranges = {"coil.turns": [10, 12], "coil.trace_width": ["100 um", "3 mm", "120 um"]}
    several = sitscad.sweep(bench, ranges, list(table.values), jobs=2)
    assert sweep_csv(several) == sweep_csv(table)


@pytest.mark.parametrize("ranges, message", [
    ({}, "at least one key"),
    ({"coil.turns": []}, "at least one value"),
    ({"coil.turns": list(range(1, 3001)), "coil.trace_width": [1e-6 * k for k in range(1, 3001)]}, "9000000 designs"),
])
def test_invalid_sweep_raises_value_error(bench, ranges, message):
    with pytest.raises(ValueError, match=message):
        sitscad.sweep(bench, ranges)


@pytest.mark.parametrize("key, value, rule", [("coil.turs", 7, "SIT002"), ("coil.turns", "many", "SIT004"),
                                              ("fpc.stackup", "flex-9l", "SIT007"), ("coil.turns", -1, "SIT006")])
def test_unknown_sweep_keys_and_values_raise_spec_error(bench, key, value, rule):
    with pytest.raises(sitscad.SpecError) as refused:
        sitscad.sweep(bench, {key: [value]})
    assert {finding.rule for finding in refused.value.findings} == {rule}


def test_sweep_numbers_are_in_si_units(bench):
    sizes = [bench.coil.outer_diameter, 1.1 * bench.coil.outer_diameter]
    table = sitscad.sweep(bench, {"coil.outer_diameter": sizes}, ["inductance"])
    written = sweep_as_written(bench.source, {"coil.outer_diameter": [f"{size!r} m" for size in sizes]}, ["inductance"])
    assert table.keys["coil.outer_diameter"] == tuple(sizes)
    assert table.values["inductance"].tolist() == written.values["inductance"].tolist()
    assert table.values["inductance"][0] == sitscad.measure(bench).values["inductance"][0]
    with pytest.raises(sitscad.SpecError) as refused:
        sitscad.sweep(bench, {"coil.outer_diameter": [10]})
    assert "did you mean '10 mm'?" in refused.value.findings[0].hint


def test_measure_and_sweep_take_equal_measure_lists(bench):
    result, table = sitscad.measure(bench, ["rp"]), sitscad.sweep(bench, {"coil.turns": [bench.coil.turns]}, ["rp"])
    assert list(result.values) == list(table.values) == ["rp"]
    assert result.values["rp"][0] == table.values["rp"][0]
    with pytest.raises(TypeError, match="measures"):
        sitscad.measure(bench, "full")


def test_sweep_text_lists_warning_rules_of_check():
    spec = sitscad.load_text(templates.read("bench_7mm"))
    warned = {item.rule for item in sitscad.check(spec, hints="none").findings
              if item.severity is sitscad.Severity.WARNING}
    head, row = sweep_text(sitscad.sweep(spec, {"coil.turns": [spec.coil.turns]}, ["rp"], level="full")).splitlines()
    assert warned and row[head.index("warned by"):].split(", ") == sorted(warned)


def test_unknown_measure_suggests_nearest_name(bench):
    with pytest.raises(ValueError, match=r"did you mean resolution\.normal"):
        sitscad.sweep(bench, {"coil.turns": [10]}, ["resolution.norml"])
    with pytest.raises(ValueError, match="only the level full"):
        sitscad.sweep(bench, {"coil.turns": [10]}, ["range.normal"])


def test_ranges_are_parsed_with_units():
    assert parse_range("coil.turns=6:8:5") == ("coil.turns", (6, 6.5, 7, 7.5, 8))
    assert parse_range("coil.trace_width=70um:80um:3") == ("coil.trace_width", ("70 um", "75 um", "80 um"))
    assert parse_range("coil.layers=2,4") == ("coil.layers", (2, 4))
    assert values_by_count(1, 0.1, 4) == (1, 0.7, 0.4, 0.1)
    for wrong in ("coil.turns", "coil.turns=", "coil.turns=6:8", "coil.turns=a:b:3", "coil.turns=6um:8mm:3",
                  "coil.turns=6:8:0"):
        with pytest.raises(RangeError):
            parse_range(wrong)


def test_range_without_step_has_round_values_and_both_ends():
    values = values_by_step(3.5, 4.6)
    assert values[:3] == (3.5, 3.52, 3.54) and values[-1] == 4.6 and len(values) > 50
    assert values_by_step("75 um", "125 um", "5 um")[-2:] == ("120 um",
                                                              "125 um") and len(values_by_step(0, 1, 0.3)) == 4


def test_space_changes_include_linked_and_implied_keys():
    space = Space((Variable("coil.layers", (2, 4), False), Variable("coil.trace_width", ("80 um", "90 um"))),
                  {"coil.trace_spacing": "coil.trace_width"}, {"coil.layers": {"4": {"fpc.stackup": "flex-4l"}}})
    assert space.size == 4 and list(space.points())[2] == (1, 0)
    assert dict(space.changes((1, 0))) == {"coil.layers": 4, "coil.trace_width": "80 um",
                                           "coil.trace_spacing": "80 um", "fpc.stackup": "flex-4l"}


def test_failed_computation_refuses_only_its_design(bench, monkeypatch):
    def fails(specs, measures):
        if any(spec.coil.turns == 11 for spec in specs):
            raise ZeroDivisionError("of this test")
        return screen_designs(specs, measures)

    from sitscad.apps.study import evaluating
    from sitscad.apps.study.evaluating import screen_designs

    monkeypatch.setattr(evaluating, "screen_designs", fails)
    chunk = Chunk(((("coil.turns", 10),), (("coil.turns", 11),)), ("board.area",), "screen")
    (item, other), _ = evaluate_chunk(Base(bench.source.text, "x.yaml"), chunk)
    assert NOT_COMPUTED not in item.refused and other.refused_by == (NOT_COMPUTED,)
    assert "of this test" in other.absent["board.area"]


def test_design_from_changes_equals_its_written_spec():
    spec = sitscad.load_text(templates.read("grasper_4layer"))
    from sitscad.spec.sensor import without_text
    base = Base.from_source(spec.source)
    changes = (("coil.turns", 7.25), ("target.size", [4.8, 4.0]), ("fpc.tail.length", 31))
    written = sitscad.load_text(base.spec_text(changes))
    assert without_text(base.changed_spec(changes)) == without_text(written)
    assert "# the jaw is 4.8 mm wide" in base.spec_text(changes)


def test_archive_key_depends_on_values_comments_and_level():
    base = _base()
    other = type(base)(base.text.replace("# sitscad: ignore SIT103", "# once: ignore SIT103"), base.path)
    keys = {base.key((("coil.turns", 7.25),), "full"), base.key((("coil.turns", 7.5),), "full"),
            base.key((("coil.turns", 7.25),), "screen"), other.key((("coil.turns", 7.25),), "full")}
    assert len(keys) == 4
    assert base.key((("coil.turns", 8.75),), "full") == base.key((), "full")


def _base():
    return Base.from_source(sitscad.load_text(templates.read("grasper_4layer")).source)


class Counting:
    """An executor that works here, and is asked as any other."""

    def __init__(self):
        self.chunks = 0

    def submit(self, work, *given):
        from concurrent.futures import Future

        self.chunks += 1
        future = Future()
        future.set_result(work(*given))
        return future


def test_workers_accept_any_executor(bench):
    executor = Counting()
    with Workers(Base.from_source(bench.source), 2, executor) as workers:
        designs = [(("coil.turns", turns),) for turns in (10, 11, 12)]
        result = list(workers.evaluations(designs, ("board.area",), "screen"))
    assert len(result) == 3 and executor.chunks >= 2


class Timed:
    """Takes a designs' chunk as done in so many seconds each, and keeps how long each chunk took."""

    def __init__(self, seconds):
        self.seconds, self.chunks = seconds, []

    def submit(self, work, base, chunk):
        taken = self.seconds * len(chunk.designs)
        self.chunks.append(taken)
        done = Future()
        done.set_result(([Evaluation({}, {})] * len(chunk.designs), taken))
        return done


@pytest.mark.parametrize("seconds, count, most", [(0.02, 3000, 1.0), (0.7, 40, 0.7), (0.0001, 20_000, 0.05)])
def test_chunks_take_about_one_second_or_maximum_size(seconds, count, most, bench):
    """But for the first ones, whose designs take nobody knows how long, and the last, which are shared out."""
    executor = Timed(seconds)
    with Workers(Base.from_source(bench.source), 2, executor) as workers:
        result = list(workers.evaluations([(("coil.turns", 10),)] * count, ("rp",), "screen"))
    assert len(result) == count and sum(executor.chunks) == approx(seconds * count, rel=1e-9)
    assert max(executor.chunks) == approx(most, rel=1e-9)
    middle = executor.chunks[4 : len(executor.chunks) // 2]
    assert middle and all(taken == approx(most, rel=1e-9) for taken in middle)


def test_sweep_text_prints_error_beside_each_value(table):
    first = sweep_text(table).splitlines()[1]
    share = 100.0 * table.errors["rp"][0] / table.values["rp"][0]
    assert re.search(rf" kohm \+-{float(f'{share:.2g}'):g}%  ", first)
    assert re.search(r" [\d.]+ mm2 \+-\d+% +unknown", first)


def test_sweep_command_prints_table_and_writes_files(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "coil.yaml").write_text(templates.read("single_coil"))
    request = ["sweep", "coil.yaml", "coil.turns=10:12:2", "--measure", "rp", "--jobs", "1"]
    assert run(request) == 0
    assert "coil.turns" in capsys.readouterr().out
    assert run([*request, "-o", "turns.svg"]) == 0 and (tmp_path / "turns.svg").read_text().startswith("<")
    assert run(["sweep", "coil.yaml", "coil.turs=10:12:2"]) == 2
    assert "did you mean turns" in capsys.readouterr().err
    assert run(["measures", "--format", "json"]) == 0
    assert {row["name"] for row in json.loads(capsys.readouterr().out)["measures"]} == set(MEASURES)
