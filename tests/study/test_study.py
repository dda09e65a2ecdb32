"""Studies: read, searched, kept, resumed; the same answer whoever computes it."""

from __future__ import annotations

import contextlib
import json
import math
import os
import random
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.apps.study.answer import (
    binding_limits,
    changed_keys,
    count_unjudged,
    hypervolume,
    level_agreement,
    smallest_relaxation,
)
from sitscad.apps.study.answer_text import (
    answer_json,
    answer_text,
    base_value,
    breach_text,
    design_table,
    sweep_range,
    yield_table,
    yields_text,
)
from sitscad.apps.study.document import Goal, Requirement, StudyDocument, study_schema
from sitscad.apps.study.evaluating import (
    IN_FULL,
    NOT_COMPUTED,
    Chunk,
    evaluate_chunk,
    free_results,
    measure_values,
    screen_designs,
    screen_errors,
)
from sitscad.apps.study.evaluation import ARCHIVE, Archive, Breach, Evaluation
from sitscad.apps.study.evaluation import UnitEvaluation as Unit
from sitscad.apps.study.measures import MEASURES
from sitscad.apps.study.page import answer_files, progress_page, study_page
from sitscad.apps.study.running import (
    Costs,
    StudyResults,
    StudyState,
    costs,
    front_numbers,
    search,
    sobol_set,
    violations,
)
from sitscad.apps.study.space import Space, Variable, code_version, value_at_key
from sitscad.apps.study.spreads import SPREADS, compute_yield, latin_hypercube, unit_spec, wilson_interval
from sitscad.apps.study.study import StudyAnswer
from sitscad.apps.study.sweeping import parse_range
from sitscad.basics.messages import text_of
from sitscad.cli import designing, run
from sitscad.spec import templates

ROOT = Path(__file__).parents[2]

STUDY = """\
sitscad_study: 1
base: coil.yaml
vary:
  coil.turns: {from: 11, to: 13, step: 0.5}
  coil.trace_width: {from: 100 um, to: 130 um, step: 10 um}
same: {coil.trace_spacing: coil.trace_width}
goals:
  - maximize: rp
  - minimize: board.area
require: {inductance: ">= 2.5 uH"}
accept: all
search: {evaluations: 100, seed: 3}
keep: 3
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "coil.yaml").write_text(templates.read("single_coil"))
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    """The study and its answer, with a few units only."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "coil.yaml").write_text(templates.read("single_coil"))
    (folder / "study.yaml").write_text(STUDY)
    study = sitscad.Study.load(folder / "study.yaml")
    return study, study.run(draws=6)


@pytest.mark.parametrize("name", ["jaw_5mm", "jaw_steady", "miniature_3p5mm", "three_axis_pad"])
def test_gallery_studies_load_and_their_variables_change_designs(name):
    asked = sitscad.Study.load(ROOT / "templates/studies" / f"{name}.yaml").request
    first, last = (asked.space.changes(tuple(k * (n - 1) for n in asked.space.shape)) for k in (0, 1))
    assert asked.space.size > 10 * asked.evaluations and asked.base.key(first, "full") != asked.base.key(last, "full")


@pytest.mark.slow
def test_small_grid_is_screened_completely_with_correct_front(answered):
    _, answer = answered
    assert answer.results.method == "grid" and len(answer.results.screened) == 20 and answer.is_met
    figures = {point: (one.values["rp"][0], one.values["board.area"][0]) for point, one in answer.results.full.items()
               if not one.refused and one.values["inductance"][0] >= 2.5e-6}
    for point in answer.front:
        rp, area = figures[point]
        assert not any(a >= rp and b <= area and (a, b) != (rp, area) for a, b in figures.values())


@pytest.mark.more
@pytest.mark.slow
def test_kept_designs_are_different_complete_specs_that_pass_check(answered, tmp_path):
    study, answer = answered
    assert len({item.point for item in answer.kept}) == len(answer.kept) == len(answer.spec_texts)
    for number, text in enumerate(answer.spec_texts, 1):
        spec = sitscad.load_text(text)
        assert spec.name == f"{study.request.base.spec.name}-{number}"
        head, below = text.split("\n", 1)
        assert all(f"{key}: " in head for key in answer.kept[number - 1].changed) and "#" in below
        assert sitscad.check(spec, hints="none").ok
        result = sitscad.measure(spec, ["rp"], level="full")
        assert result.values["rp"][0] == approx(answer.kept[number - 1].evaluation.values["rp"][0], rel=1e-12)


def test_answer_text_and_json_report_kept_designs(answered):
    _, answer = answered
    message, text = json.loads(answer_json(answer)), answer_text(answer, "outputs/x-study")
    assert message["met"] and message["screened"] == 20 and len(message["kept"]) == len(answer.kept)
    assert message["kept"][0]["yield"]["units"] == 6 and message["agreement"]["designs"] == len(answer.results.full)
    assert text.startswith("The requirements can be met: 20 of 20 designs")
    assert "sitscad build outputs/x-study/designs/1.yaml" in text
    assert sorted(answer_files(answer))[-1] == "study.json"
    assert "sitscad build 'my study/designs/1.yaml'" in answer_text(answer, "my study")


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("method", ["nsga2", "sobol", "grid"])
def test_base_is_evaluated_first_as_design_of_the_study(method, folder):
    """A short search kept designs that the base beat, since it was no candidate itself."""
    base = sitscad.load(folder / "coil.yaml").replace(
        {"coil.turns": 11.5, "coil.trace_width": "125 um", "coil.trace_spacing": "0.125 mm"})
    (folder / "coil.yaml").write_text(base.source.text)
    text = STUDY.replace("from: 100 um, to: 130 um, step: 10 um", "from: 0.1, to: 0.15, step: 0.005")
    (folder / "study.yaml").write_text(text.replace("evaluations: 100", f"method: {method}, evaluations: 8"))
    answer = sitscad.Study.load(folder / "study.yaml").run(draws=0)
    first = next(iter(answer.results.screened))
    assert answer.request.space.varied_values(first) == {
        "coil.turns": 11.5, "coil.trace_width": 0.125}  # 125 um in the base
    assert len(answer.results.screened) == 8 and "not in the searched ranges" not in answer_text(answer)
    assert answer.results.full[first].values == answer.base.values


def test_accepted_warnings_are_reported_with_kept_designs(answered):
    """They vanished, though check --strict refuses them."""
    _, answer = answered
    first = answer.kept[0]
    warned = replace(first.evaluation, warned={"SIT203": Breach(), "SIT020": Breach()})
    text = replace(answer, kept=(replace(first, evaluation=warned), *answer.kept[1:]))
    words = "SIT203 parallel-resistance"
    assert re.search(rf"^ +1 .* {words} ", answer_text(text), re.MULTILINE) and f">{words}<" in study_page(text)
    message = json.loads(answer_json(text))["kept"]
    assert message[0]["accepted"] == ["SIT203 parallel-resistance"]
    untold = replace(answer, kept=tuple(replace(item, evaluation=replace(item.evaluation, warned={}))
                                        for item in answer.kept))
    assert "accepts" not in answer_text(untold) + study_page(untold)


def test_low_yield_without_required_yield_prints_caution(answered):
    _, answer = answered
    few, most = (compute_yield([Unit(k < good, () if k < good else ("SIT202",), True, {}) for k in range(128)],
                          lambda values: ()) for good in (96, 116))
    text = replace(answer, kept=(replace(answer.kept[0], units=most), replace(answer.kept[0], units=few)),
                   spec_texts=answer.spec_texts[:1] * 2)
    caution = "Caution: fewer than 90% of the units keep all of design 2 (75.0%), and the study asks for no yield"
    assert caution in yields_text(text, "x") and caution in study_page(text)
    requires = Requirement("yield", True, 0.8, ">= 80 %")
    asks = replace(text, request=replace(text.request, require=(*text.request.require, requires)))
    assert "Caution" not in yields_text(asks, "x") + study_page(asks)


def test_base_value_of_varied_list_entry_is_found(folder):
    """It was told as no value of the base, so that the search began at the range's end and the base was no design."""
    base = sitscad.load(folder / "coil.yaml").replace({"target.shape": "rectangle", "target.size": [10e-3, "9 mm"]})
    (folder / "coil.yaml").write_text(base.source.text)
    both = "target.size.0: {from: 7, to: 11, step: 1}\n  target.size.1: [8, 9]\n  coil.turns: "
    (folder / "study.yaml").write_text(STUDY.replace("coil.turns: ", both))
    request = sitscad.Study.load(folder / "study.yaml").request
    assert request.base_point[:2] == (3, 1) and "target" not in " ".join(changed_keys(request, (3, 1, 0, 0)))
    assert base_value(request.base.changed_values(()), "target.size.1") == "9 mm"
    assert value_at_key({"size": [6, 3]}, "size.2") is value_at_key({"size": [6, 3]}, "size.x") is None


def test_base_better_than_kept_designs_is_reported(answered):
    """A short search kept a design that was worse than the base in both goals, without a word."""
    _, answer = answered
    first = answer.kept[0].evaluation
    better = replace(first, values=first.values | {"rp": (2.0 * first.values["rp"][0], 0.0), "board.area": (1e-9, 0.0)})
    text = answer_text(replace(answer, base=better))
    assert text_of("study-base-best", "message", {}) in text
    assert "has coil.trace_width: 130 um in place of 160 um, coil.trace" in text
    for other in (first, replace(better, values=better.values | {"inductance": (1e-6, 0.0)})):  # refused
        assert "The base design beats" not in answer_text(replace(answer, base=other, kept=answer.kept[:1]))


def test_designs_at_end_of_a_range_are_reported(answered):
    _, answer = answered
    item = answer.kept[0]

    def told(*points):
        return answer_text(replace(answer, kept=[replace(item, point=point) for point in points]))

    assert text_of("study-last-value", "message", {"key": "coil.turns", "value": "13"}) in told((4, 1), (4, 2))
    assert text_of("study-first-value", "message", {"key": "coil.trace_width", "value": "100 um"}) in told((1, 0))
    assert "of its range" not in told((1, 1), (4, 2))


def test_suggested_sweep_varies_key_without_linked_keys(answered):
    space = answered[0].request.space
    key, values = parse_range(sweep_range(space))
    assert key == "coil.turns" and values == space.variables[0].values
    assert sweep_range(replace(space, variables=space.variables[1:])) == ""
    wide = replace(space.variables[1], values=tuple(f"{100 + k} um" for k in range(31)))
    key, values = parse_range(sweep_range(replace(space, variables=(wide,), linked={})))
    assert key == "coil.trace_width" and (values[0], values[-1], len(values)) == ("100 um", "130 um", 7)


def test_remaining_time_uses_rate_of_current_units(monkeypatch, capsys):
    """Units of designs that take the place of fallen ones were shared out over the time of all before them."""
    clock = iter([0.0, 100.0, 110.0])
    monkeypatch.setattr(designing.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(designing, "STUDY_REPORT_INTERVAL", 0.0)
    show = designing._study_progress()
    show(StudyState("units", 256, 256, 0, {}, 256))
    show(StudyState("units", 20, 256, 0, {}, 20))
    assert "units: 20 of 256, 2 min left, 2 a second" in capsys.readouterr().err


@pytest.mark.more
@pytest.mark.slow
def test_designs_with_too_small_yield_are_replaced_and_counted(folder, monkeypatch):
    """The first design that is asked about yields nothing, all others everything."""
    from sitscad.apps.study.running import StudyRun

    first = []

    def units(run, points, count):
        first.extend(points)
        return {point: [Unit(point != first[0], () if point != first[0] else ("SIT202",), True, {"inductance": 3e-6})]
                * count for point in points}

    monkeypatch.setattr(StudyRun, "simulated_units", units)
    text = STUDY.replace('">= 2.5 uH"}', '">= 2.5 uH", yield: ">= 95 %"}')
    (folder / "study.yaml").write_text(text)
    early = []
    answer = sitscad.Study.load(folder / "study.yaml").run(draws=16, before_yields=early.append)
    assert "The requirements can be met, but the required yield (>= 95 %) was not computed" in answer_text(early[0])
    assert json.loads(answer_json(early[0]))["met"] is None and json.loads(answer_json(answer))["met"] is True
    again = ["Designs, the best of" in yields_text(answer, "x", before) for before in (*early, answer)]
    assert again == [True, False]
    assert answer.dropped_count == 1 and answer.kept and first[0] not in {*answer.front,
                                                                          *(item.point for item in answer.kept)}
    assert "too small a yield: 1" in answer_text(answer)


@pytest.mark.more
@pytest.mark.slow
def test_goal_with_constant_measure_is_reported(folder):
    (folder / "study.yaml").write_text(STUDY.replace("minimize: board.area", "minimize: rate"))
    answer = sitscad.Study.load(folder / "study.yaml").run(draws=0)
    assert [goal.measure for goal in answer.constant_goals] == ["rate"]
    assert text_of("study-constant-goal", "message", {"measure": "rate"}) in answer_text(answer)


@pytest.mark.slow
def test_infeasible_study_reports_binding_limit_and_nearest_value(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    text = STUDY.replace(">= 2.5 uH", ">= 1 mH").replace("- minimize: board.area", "").replace("to: 13,", "to: 12,")
    (folder / "study.yaml").write_text(text)
    assert run(["design", "study.yaml", "--jobs", "1"]) == 1
    said = json.loads((folder / "outputs/study/study.json").read_text())
    assert not said["met"] and said["bindings"][0]["name"] == "inductance" and said["bindings"][0]["alone"] > 0.0
    best = max(item["values"]["inductance"][0] for item in _lines(folder / "outputs/study")
               if list(item["refused"]) == [])
    assert said["relaxation"]["lets_go"]["inductance"]["measured"] == approx(best, rel=1e-12)
    lines = capsys.readouterr().out
    assert "No design was found" in lines and "1 mH is asked" in lines and "let go of inductance" in lines


@pytest.mark.slow
def test_study_interrupted_during_yields_reports_answer_and_resume_command(
    folder, capsys, monkeypatch
):
    from sitscad.apps.study.running import StudyRun

    def interrupted(*given):
        raise KeyboardInterrupt

    monkeypatch.chdir(folder)
    (folder / "study.yaml").write_text(STUDY.replace("to: 13,", "to: 11.5,"))
    with monkeypatch.context() as patch:
        patch.setattr(StudyRun, "simulated_units", interrupted)
        assert run(["design", "study.yaml", "--jobs", "1", "-o", "the out", "--again"]) == 130
    early = capsys.readouterr()
    assert early.out.startswith("The requirements can be met: 8 of 8 designs") and "Next:" not in early.out
    command = "sitscad design study.yaml -o 'the out' --jobs 1"
    assert f"goes on from there: {command}\n" in early.err and (folder / "the out/designs/1.yaml").exists()
    assert run([*shlex.split(command)[1:], "--no-yield"]) == 0
    whole = capsys.readouterr()
    assert whole.out.startswith(early.out) and "sitscad build 'the out'" not in early.out
    assert "Not worked out" in (folder / "the out/study.html").read_text() and "used again" in whole.err


@pytest.mark.more
@pytest.mark.slow
def test_interrupted_search_writes_page_and_resumes_equally(folder, capsys, monkeypatch):
    """It left archive.jsonl alone, which nobody reads."""
    from sitscad.apps.study.running import StudyRun

    evaluate, generations = StudyRun._costs_of, []

    def interrupted(run, points):
        if generations:
            raise KeyboardInterrupt
        generations.append(points)
        return evaluate(run, points)

    monkeypatch.chdir(folder)
    monkeypatch.setattr("sitscad.apps.study.running.GENERATION", 8)
    with monkeypatch.context() as patch:
        patch.setattr(StudyRun, "_costs_of", interrupted)
        assert run(["design", "study.yaml", "--jobs", "1", "--no-yield"]) == 130
    page, message = folder / "outputs/study/so-far.html", capsys.readouterr().err
    looked = f"{len(generations[0])} of 20 designs looked at by the screen"
    assert looked in page.read_text() and "so-far.html" in message and "goes on from there" in message
    assert run(["design", "study.yaml", "--jobs", "1", "--no-yield"]) == 0
    assert not page.exists() and (folder / "outputs/study/study.html").exists()
    again = _files(folder / "outputs", "study")
    assert run(["design", "study.yaml", "--jobs", "1", "--no-yield", "-o", "whole"]) == 0
    assert again == _files(folder, "whole")


@pytest.mark.slow
def test_designs_without_screen_are_evaluated_once_in_full_and_reported(folder, monkeypatch):
    from sitscad.apps.study import evaluating

    calls = []
    full = evaluating.evaluate_design
    monkeypatch.setattr(evaluating, "evaluate_design", lambda *given: calls.append(given[0]) or full(*given))
    (folder / "coil.yaml").write_text(templates.read("square_bench"))
    request = {"base": "coil.yaml", "vary": {"coil.turns": [9, 10]}, "goals": [{"maximize": "rp"}], "accept": "all"}
    answer = sitscad.Study.from_mapping(request, folder).run(draws=0)
    assert len(answer.results.full) == len(answer.results.screened) == 2 and answer.is_met
    assert len(calls) == 2
    assert "2 of 2 designs took the full level at once: the screen has" in answer_text(answer)


@pytest.mark.slow
@pytest.mark.parametrize("goal, is_all", [("amplitude", True), ("inductance", False)])
def test_all_designs_are_evaluated_in_full_if_screen_cannot_rank_goal(goal, is_all, folder, monkeypatch):
    from sitscad.apps.study import running

    monkeypatch.setattr(running, "LEAST_FULL", 1)
    monkeypatch.setattr(running, "MOST_AT_ONCE", 1)
    text = STUDY.replace("maximize: rp", f"maximize: {goal}").replace("  - minimize: board.area\n", "")
    (folder / "study.yaml").write_text(text.replace("to: 13,", "to: 11.5,").replace("keep: 3", "keep: 1"))
    result = sitscad.Study.load(folder / "study.yaml").run(draws=0).results
    assert len(result.screened) == 8 and (len(result.full) == 8) is is_all


def _lines(folder):
    return [line for line in map(json.loads, (folder / ARCHIVE).read_text().splitlines()) if "values" in line]


RUN = """\
import pathlib, sys
from sitscad.apps.study import running
from sitscad.apps.study.page import answer_files, study_page
from sitscad.apps.study.evaluating import dask_cluster
from sitscad.basics.messages import text_of
from sitscad.apps.study.study import Study

running.LEAST_FULL = 6
executor, jobs = dask_cluster(sys.argv[1]) if sys.argv[1].startswith("tcp") else (None, int(sys.argv[1]))
said = Study.load("study.yaml").run(executor, folder="out", jobs=jobs, draws=4)
for name, content in answer_files(said).items():
    path = pathlib.Path("out") / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
"""
ENV = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}


def _command(folder, jobs):
    """A process that runs the study of a folder: by so many processes, or by those of a scheduler at an address."""
    return subprocess.Popen([sys.executable, "-c", RUN, jobs], cwd=folder, env=ENV)


def _files(folder, name="out"):
    own = folder / name
    result = {path.relative_to(own): path.read_bytes() for path in own.rglob("*") if path.is_file()}
    return {path: content for path, content in result.items() if path.name != ARCHIVE}


@pytest.mark.more
@pytest.mark.slow
def test_killed_study_resumed_by_two_processes_writes_identical_files(folder, tmp_path_factory):
    whole = tmp_path_factory.mktemp("whole")
    for name in ("coil.yaml", "study.yaml"):
        (whole / name).write_text((folder / name).read_text())
    assert _command(whole, "1").wait() == 0
    process = _command(folder, "2")
    archive = folder / "out" / ARCHIVE
    while process.poll() is None and not (archive.exists() and len(archive.read_bytes().splitlines()) > 6):
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    _until(lambda: not _open_in_a_process(archive))
    with archive.open("ab") as stream:
        stream.write(b'{"key": "torn')
    assert _command(folder, "2").wait() == 0
    assert _files(folder) == _files(whole) and len(_files(whole)) >= 3


DENSE = ("step: 10 um", "step: 2 um")
STUDIES = {
    "grid": ("2",),
    "sobol": ("1", ("evaluations: 100", "method: sobol, evaluations: 14")),
    "nsga2": ("2", ("evaluations: 100", "method: nsga2, evaluations: 40"), DENSE),
    "differential evolution": ("1", ("  - minimize: board.area\n", ""),
                               ("evaluations: 100", "method: de, evaluations: 18"), DENSE),
    "a yield that is required": ("2", ('uH"}', 'uH", yield: ">= 60 %"}')),
    "Dask": ("tcp", ("to: 13,", "to: 12.5,")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.more) if name != "grid" else name
                                  for name in STUDIES])
def test_study_killed_at_random_times_ends_with_identical_files(name, folder, tmp_path_factory):
    jobs, *others = STUDIES[name]
    text = STUDY
    for old, new in others:
        text = text.replace(old, new)
    whole, chance = tmp_path_factory.mktemp("whole"), random.Random(name)
    for place in (folder, whole):
        (place / "coil.yaml").write_text(templates.read("single_coil"))
        (place / "study.yaml").write_text(text)
    with _dask(folder) if jobs == "tcp" else contextlib.nullcontext((jobs, [])) as (request, _):
        assert _command(whole, "1").wait() == 0
        archive, lines = folder / "out" / ARCHIVE, len(_lines_of(whole / "out" / ARCHIVE))
        for most in sorted(chance.randrange(1, lines) for _ in range(2)):
            process = _command(folder, request)
            _until(lambda p=process, n=most: p.poll() is not None
                   or (archive.exists() and len(_lines_of(archive)) >= n), 300.0)
            time.sleep(0.3 * chance.random())
            process.kill()
            process.wait()
            _until(lambda: not _open_in_a_process(archive))
        assert _command(folder, request).wait() == 0
    assert _files(folder) == _files(whole) and len(_files(whole)) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", pytest.param("2", marks=pytest.mark.more)])
def test_sweep_killed_at_random_times_leaves_no_partial_file(folder, jobs):
    command = [sys.executable, "-m", "sitscad", "sweep", "coil.yaml", "coil.turns=10:13:13", "--measure", "rp",
               "--jobs", jobs, "-o"]
    began, chance = time.monotonic(), random.Random(jobs)
    subprocess.run([*command, "whole.csv"], cwd=folder, env=ENV, check=True)
    taken = time.monotonic() - began
    for _ in range(3):
        process = subprocess.Popen([*command, "part.csv"], cwd=folder, env=ENV)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(taken * chance.random())
        process.kill()
        process.wait()
        part = folder / "part.csv"
        assert not part.exists() or part.read_bytes() == (folder / "whole.csv").read_bytes()
    subprocess.run([*command, "part.csv"], cwd=folder, env=ENV, check=True)
    assert (folder / "part.csv").read_bytes() == (folder / "whole.csv").read_bytes()


@contextlib.contextmanager
def _dask(folder, programs=(ROOT, ROOT)):
    """The address of a real scheduler, and its workers, one by each program."""
    pytest.importorskip("distributed")
    text, processes = folder / "scheduler.json", []

    def started(command, *more, program=ROOT):
        request = [sys.executable, "-m", "dask", command, "--scheduler-file", str(text), "--no-dashboard", *more]
        env = {**ENV, "PYTHONPATH": str(program)}
        processes.append(subprocess.Popen(request, env=env, cwd=folder, stderr=subprocess.DEVNULL))

    try:
        started("scheduler", "--port", "0", "--host", "127.0.0.1")
        _until(text.exists)
        for program in programs:
            started("worker", "--nthreads", "1", "--no-nanny", program=program)
        yield json.loads(text.read_text())["address"], processes[1:]
    finally:
        for item in processes[::-1]:
            item.kill()
            item.wait()


@pytest.mark.more
@pytest.mark.slow
def test_cluster_with_killed_worker_writes_identical_files(folder, tmp_path_factory):
    """A real scheduler and two workers, one of which is killed half-way."""
    whole = tmp_path_factory.mktemp("whole")
    for name in ("coil.yaml", "study.yaml"):
        (whole / name).write_text((folder / name).read_text())
    with _dask(folder) as (address, workers):
        process = _command(folder, address)
        _until(lambda: (folder / "out" / ARCHIVE).exists() and len(_lines_of(folder / "out" / ARCHIVE)) > 3)
        workers[0].kill()
        assert process.wait(timeout=300) == 0
    assert _command(whole, "1").wait() == 0
    assert _files(folder) == _files(whole) and len(_files(whole)) >= 3


@pytest.mark.slow
def test_workers_of_other_version_are_refused_with_both_versions(folder, capsys):
    """They would judge by other rules, and their figures go into the archive of this one."""
    other = folder / "other"
    shutil.copytree(ROOT / "sitscad", other / "sitscad", ignore=shutil.ignore_patterns("__pycache__"))
    with (other / "sitscad/basics/units.py").open("a") as stream:
        stream.write("# changed\n")
    with _dask(folder, (ROOT, other)) as (address, _):
        from distributed import Client

        with Client(address) as client:
            client.wait_for_workers(2, 60)
            workers = client.run(code_version)
        assert run(["design", str(folder / "study.yaml"), "--scheduler", address]) == 2
    message, ours = capsys.readouterr().err, code_version()
    assert [worker in message for worker in workers] == [theirs != ours for theirs in workers.values()]
    assert sorted(theirs == ours for theirs in workers.values()) == [False, True]
    assert f"another program than {ours}" in message


@pytest.mark.parametrize("address", ["nonsense", "http://x", "tls://127.0.0.1:5"])
def test_invalid_scheduler_address_exits_2(address, folder, capsys):
    pytest.importorskip("distributed")
    assert run(["design", str(folder / "study.yaml"), "--scheduler", address]) == 2
    assert f"--scheduler: {address!r} is no scheduler's address" in capsys.readouterr().err


def _open_in_a_process(path):
    """Whether any process has a file open still, as those that another one began have."""
    held = []
    for each in Path("/proc").glob("[0-9]*/fd/*"):
        with contextlib.suppress(OSError):
            held.append(each.readlink())
    return path in held


def _until(done, seconds=60.0):
    for _ in range(int(seconds / 0.05)):
        if done():
            return
        time.sleep(0.05)
    raise TimeoutError


def _lines_of(path):
    return path.read_bytes().splitlines()


@pytest.mark.more
@pytest.mark.slow
def test_changed_study_reuses_matching_archive_rows(folder):
    first = sitscad.Study.load(folder / "study.yaml").run(folder=folder / "out", draws=0)
    (folder / "study.yaml").write_text(STUDY.replace("to: 13,", "to: 13.5,").replace("2.5 uH", "2.6 uH"))
    second = sitscad.Study.load(folder / "study.yaml").run(folder=folder / "out", draws=0)
    assert first.results.reused == 0 and second.results.reused >= 20 and len(second.results.screened) == 24


PROFILE = "name: {0}\nbased_on: generic-flex\nsource: {0}\n"


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("asked", [
    {"vary": {"fpc.rules": ["one.yaml", "two.yaml"]}},
    {"vary": {"coil.turns": [11, 12]}, "with": {"coil.turns": {"12": {"fpc.rules": "two.yaml"}}}},
])
def test_designs_with_edited_profile_file_are_evaluated_again(asked, folder):
    """The second run took the design of the file as it was before; one that could not be read stayed refused."""
    for name in ("one", "two"):
        (folder / f"{name}.yaml").write_text(PROFILE.format(name))
    binding = "coil_rule_binding: {value: true, source: x}\ntracks: [{copper: 18 um, "
    binding += "width: {value: 300 um, source: x}, spacing: {value: 300 um, source: x}}]"

    def refused():
        study = sitscad.Study.from_mapping({"base": "coil.yaml", "goals": [{"maximize": "rp"}]} | asked, folder)
        message = study.run(folder=folder / "out", draws=0)
        lines = _lines_of(folder / "out" / ARCHIVE)
        return {point for point, item in message.results.full.items() if item.refused}, len(lines)

    assert refused() == refused() == (set(), 4)
    (folder / "two.yaml").write_text(PROFILE.format("two") + binding)
    assert refused() == ({(1,)}, 6)
    (folder / "two.yaml").unlink()
    assert refused() == ({(1,)}, 8)
    (folder / "two.yaml").write_text(PROFILE.format("third"))
    assert refused() == (set(), 10)


def test_profiles_of_varied_values_are_copied_beside_kept_designs(folder, capsys):
    for name in ("one", "two"):
        (folder / f"{name}.yaml").write_text(PROFILE.format(name))
    request = {"base": "coil.yaml", "vary": {"fpc.rules": ["one.yaml", "two.yaml"]}, "goals": [{"maximize": "rp"}]}
    files = answer_files(sitscad.Study.from_mapping(request, folder).run(draws=0))
    assert [name for name in files if name.startswith("designs/")] == [
        "designs/one.yaml", "designs/two.yaml", "designs/1.yaml", "designs/2.yaml"]
    (folder / "designs").mkdir()
    for name, content in files.items():
        (folder / name).write_bytes(content)
    assert sitscad.check(sitscad.load(folder / "designs/2.yaml"), hints="none").ok


@pytest.mark.slow
def test_answer_does_not_depend_on_earlier_studies_in_archive(folder):
    """Figures that an earlier study of the folder asked for stood in the next one's answer, too."""
    small = {"base": "coil.yaml", "vary": {"coil.turns": [11, 12]}, "goals": [{"maximize": "rp"}]}
    large = small | {"goals": [{"minimize": "board.area"}, {"maximize": "rp"}], "require": {"q": ">= 1"}}
    _, used, new = (answer_files(sitscad.Study.from_mapping(request, folder).run(folder=folder / name, draws=0))
                    for request, name in ((large, "out"), (small, "out"), (small, "new")))
    assert used == new


def test_measure_missing_only_in_screen_is_no_breach(answered):
    request = replace(answered[0].request, goals=(Goal("board.area"),))
    screen = Evaluation({"inductance": (3e-6, 0.0)}, {"board.area": IN_FULL}, level="screen")
    assert violations(request, screen) == {}
    assert set(violations(request, replace(screen, absent={"board.area": "it has no board"}))) == {"board.area"}


def test_design_without_layout_is_excluded_from_relaxations(folder):
    request = sitscad.Study.load(folder / "study.yaml").request
    unmade = Evaluation({}, {}, {"SIT016": Breach(8.5, 8.24)})
    weak = Evaluation({"rp": (1.0, 0.0), "board.area": (1.0, 0.0), "inductance": (1e-6, 0.0)}, {}, {})
    result = StudyResults(request, "grid", {(0, 0): unmade, (1, 0): weak})
    assert smallest_relaxation(request, result).names == ("inductance",)


def test_design_without_layout_counts_only_for_its_own_rule(folder):
    """It counted against every requirement, too, and its rule was said to refuse nothing alone."""
    request = sitscad.Study.load(folder / "study.yaml").request
    unmade, both = (Evaluation({}, {}, {rule: Breach(8.5, 8.24) for rule in rules})
                    for rules in (["SIT016"], ["SIT014", "SIT016"]))
    weak = Evaluation({"rp": (1.0, 0.0), "board.area": (1.0, 0.0), "inductance": (1e-6, 0.0)}, {}, {})
    result = StudyResults(request, "grid", {(0, 0): unmade, (1, 0): weak, (2, 0): both, (3, 0): unmade})
    text = {item.name: (item.share, item.sole_share) for item in binding_limits(request, result)}
    assert text == {"SIT016": (0.75, 0.5), "inductance": (0.25, 0.25), "SIT014": (0.25, 0.0)}
    assert costs(request, unmade).violation > costs(request, weak).violation + 10
    message = answer_text(StudyAnswer("x", request, weak, result, tuple(binding_limits(request, result)), None,
                                   level_agreement(request.goals, result), (), (), (), ()))
    assert "cannot be drawn" in message


def test_nearest_value_is_reported_if_no_limit_binds_alone(folder):
    request = sitscad.Study.load(folder / "study.yaml").request
    values = {"rp": (1.0, 0.0), "board.area": (1.0, 0.0)}
    item, other = (Evaluation({**values, "inductance": (size, 0.0)}, {}, {"SIT203": Breach(rp, 600.0, "ohm")})
                  for size, rp in ((1e-6, 500.0), (2e-6, 400.0)))
    result = binding_limits(request, StudyResults(request, "grid", {(0, 0): item, (1, 0): other}))
    assert {(each.name, each.sole_share, each.nearest_breach.measured, each.nearest_point) for each in result} == {
        ("SIT203", 0.0, 500.0, (0, 0)), ("inductance", 0.0, 2e-6, (1, 0))}


def test_relaxation_uses_only_designs_evaluated_in_full(folder):
    """By the screen one kept everything else, and full refused it by a rule more."""
    study = sitscad.Study.load(folder / "study.yaml")
    request = study.request
    good = {"rp": (1.0, 0.0), "board.area": (1.0, 0.0), "inductance": (3e-6, 0.0)}
    hopeful, weak = (Evaluation({**good, "inductance": (size, 0.0)}, {}, {}, level="screen") for size in (3e-6, 2.4e-6))
    fallen = replace(hopeful, refused={"SIT112": Breach(80e-6, 650e-6)}, level="full")
    result = StudyResults(request, "grid", {(0, 0): hopeful, (1, 0): weak, (2, 0): hopeful}, {(0, 0): fallen})
    assert smallest_relaxation(request, result).names == ("SIT112",) and count_unjudged(request, result) == 1
    both = replace(result, full={(0, 0): fallen, (1, 0): weak})
    assert smallest_relaxation(request, both).names == ("inductance",)  # nobody can let go of room for vias
    assert smallest_relaxation(request, replace(result, full={(0, 0): hopeful})) is None
    assert level_agreement(request.goals, result).designs == 0  # its leads are not drawn
    assert "smallest relaxation" not in progress_page(study, result, 20)  # by the screen some keep everything


HIDING = """\
sitscad_study: 1
base: base.yaml
vary:
  coil.turns: [8, 15]
  fpc.tail.length: {from: 20, to: 60}
goals: [{maximize: inductance}]
search: {method: sobol, evaluations: 80}
"""


@pytest.mark.more
@pytest.mark.slow
def test_designs_ranked_behind_full_level_failures_are_found(tmp_path):
    """Coils of 15 turns have no room for their inner vias, which the screen cannot ask, and rank first: it ended with
    none of 8 turns judged, all of which pass.
    """
    (tmp_path / "base.yaml").write_text(templates.read("single_coil"))
    (tmp_path / "study.yaml").write_text(HIDING)
    answer = sitscad.Study.load(tmp_path / "study.yaml").run(draws=0)
    assert answer.kept and {item.changed["coil.turns"] for item in answer.kept} == {8}


@pytest.mark.more
@pytest.mark.slow
def test_scatter_of_goals_and_limits_is_reported_without_required_yield(folder):
    study = sitscad.Study.load(folder / "study.yaml")
    answer = study.run(draws=8)
    assert study.request.least_yield is None and set(study.request.measures_with_sigma) == {"rp", "inductance"}
    assert answer.kept[0].units.sigmas.keys() == {"rp", "inductance"}
    assert all("to first order" in text for text in (yields_text(answer, ""), study_page(answer)))


def test_check_of_folder_skips_study_files(folder, capsys):
    assert run(["check", str(folder)]) in (0, 1)
    message = capsys.readouterr()
    assert "is a study and is skipped" in message.err and "sitscad_study" not in message.out
    assert run(["check", str(folder / "study.yaml")]) == 2
    assert "sitscad design" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["response"], ["calibrate"], ["estimate"], ["sweep", "coil.turns=11,12"]])
def test_spec_commands_refuse_study_file_and_name_design_command(command, folder, capsys):
    assert run([command[0], str(folder / "study.yaml"), *command[1:]]) == 2
    message = "".join(capsys.readouterr())
    assert "study.yaml:1:1 SIT002 error the file is a study" in message and "`sitscad design` takes it" in message
    assert "did you mean" not in message


def test_design_command_refuses_spec_as_study_and_study_as_base(folder, capsys):
    assert run(["design", str(folder / "coil.yaml")]) == 2
    message = capsys.readouterr().err
    assert "the file is a spec" in message and "`sitscad new --study`" in message and "not ok: 1 error" in message
    (folder / "study.yaml").write_text(STUDY.replace("coil.yaml", "study.yaml"))
    assert run(["design", str(folder / "study.yaml")]) == 2
    assert "study.yaml cannot be read (line 1): the file is a study" in capsys.readouterr().err


BAD = {
    "a version that is not known": ("sitscad_study: 1", "sitscad_study: 9", "SIT008", 1),
    "no such base": ("base: coil.yaml", "base: other.yaml", "SIT011", 2),
    "a misspelt key at the top": ("accept: all", "acept: all", "SIT002", 11),
    "a path that the spec has not": ("coil.turns:", "coil.turs:", "SIT002", 4),
    "a reversed range": ("from: 11, to: 13", "from: 13, to: 11", "SIT006", 4),
    "an empty range": ("from: 11, to: 13", "from: 11, to: 11", "SIT006", 4),
    "a step of nothing": ("step: 0.5", "step: 0", "SIT006", 4),
    "a range of two units": ("to: 130 um", "to: 0.13", "SIT006", 5),
    "a range without an end": ("from: 11, to: 13, step: 0.5", "from: 11", "SIT006", 4),
    "a value that can be none": ("from: 11, to: 13, step: 0.5", "from: -3, to: 13, step: 8", "SIT006", 4),
    "an empty list": ("{from: 11, to: 13, step: 0.5}", "[]", "SIT006", 4),
    "the same value twice": ("{from: 11, to: 13, step: 0.5}", "[11, 11]", "SIT009", 4),
    "the same value in two units": ("{from: 100 um, to: 130 um, step: 10 um}", '["100 um", "0.1 mm"]', "SIT009", 5),
    "the same number twice": ("{from: 11, to: 13, step: 0.5}", "[11, 11.0]", "SIT009", 4),
    "a section and a key of it": ("vary:\n", "vary:\n  coil: [{turns: 3}]\n", "SIT009", 5),
    "a value that a range has not": ("accept: all", "with: {coil.turns: {11.3: {coil.outer_diameter: 11}}}", "SIT007",
                                     11),
    "a key that is the same as none": ("coil.trace_spacing: coil.trace_width", "coil.trace_spacing: no", "SIT007", 6),
    "a key that is the same as a list": ("coil.trace_spacing: coil.trace_width", "coil.turns: [coil.trace_width]",
                                         "SIT007", 6),
    "a key that is the same as a section": ("coil.trace_spacing: coil.trace_width", "coil.turns: {a: 1}", "SIT007", 6),
    "what is no number among many": ("{from: 11, to: 13, step: 0.5}",
                                     f"[{', '.join(str(6 + k / 1000) for k in range(120))}, .nan, 8]", "SIT006", 4),
    "two keys that fight": ("same: {", "same: {coil.trace_width: coil.trace_width, ", "SIT009", 6),
    "a measure that there is not": ("maximize: rp", "maximize: rpp", "SIT007", 8),
    "a list of measures": ("maximize: rp", "maximize: [rp]", "SIT007", 8),
    "a goal that is none": ("- maximize: rp", "- enlarge: rp", "SIT004", 8),
    "four goals": ("  - maximize: rp\n", "  - maximize: rp\n  - maximize: q\n  - maximize: inductance\n", "SIT006", 7),
    "a goal that a fixed key decides": ("minimize: board.area", "minimize: board.layers", "SIT009", 9),
    "a measure that is a goal twice": ("minimize: board.area", "minimize: rp", "SIT009", 9),
    "a goal that no design has": ("minimize: board.area", "minimize: resolution.normal", "SIT009", 9),
    "a limit of what no design has": ('inductance: ">= 2.5 uH"', 'fit.spare: ">= 0 mm"', "SIT009", 10),
    "a limit without its unit": (">= 2.5 uH", ">= 2.5", "SIT005", 10),
    "a limit that is none": (">= 2.5 uH", "2.5 uH", "SIT004", 10),
    "a rule that there is not": ("accept: all", "accept: [SIT999]", "SIT007", 11),
    "a method that there is not": ("search: {evaluations", "search: {method: luck, evaluations", "SIT006", 12),
    "no evaluations": ("evaluations: 100", "evaluations: 0", "SIT006", 12),
    "too many to keep": ("keep: 3", "keep: 30", "SIT006", 13),
    "a spread of nothing known": ("keep: 3", "spread: {coil.colour: 3 %}", "SIT007", 13),
    "a grid that ends never": ("{evaluations: 100, seed: 3}", "{method: grid}", "SIT010", 12),
}


@pytest.mark.parametrize("old, new, rule, line", BAD.values(), ids=BAD.keys())
def test_invalid_study_is_reported_with_rule_and_line(folder, old, new, rule, line):
    text = STUDY.replace(old, new)
    if rule == "SIT010":
        text = text.replace("step: 0.5", "step: 0.0001").replace("step: 10 um", "step: 0.01 um")
    (folder / "study.yaml").write_text(text)
    with pytest.raises(sitscad.SpecError) as refused:
        sitscad.Study.load(folder / "study.yaml")
    first = refused.value.findings[0]
    assert (first.rule, first.line) == (rule, line) and first.column and first.message
    assert first.message.isprintable() and str(first.key).isprintable()


@pytest.mark.slow
def test_varied_coil_layers_change_board_layers(folder):
    """The goal was refused: only a stack-up that varies was thought to decide it."""
    request = {"base": "coil.yaml", "vary": {"coil.layers": [2, 4]}, "goals": [{"minimize": "board.layers"}]}
    message = sitscad.Study.from_mapping(request, folder).run(draws=0)
    assert [message.results.evaluation((k,)).values["board.layers"][0] for k in (0, 1)] == [2.0, 4.0]


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["single_coil", "bench_7mm", "grasper_3p5mm", "skin_strip_6"])
def test_measures_whose_needs_are_missing_are_absent(name):
    spec = sitscad.load_text(templates.read(name))
    quick = [row for row in MEASURES.values() if not row.name.startswith(("range.", "error.tilt."))]
    values, absent = measure_values(sitscad.Design(spec), [row.name for row in quick])
    lacking = {row.name for row in quick if not all(need.is_present(spec) for need in row.needs)}
    assert lacking <= absent.keys() and values


@pytest.mark.parametrize("brings", [{"vary": {"target.thickness": [0.1, 0.2]}},
                                    {"with": {"coil.turns": {"11": {"elastomer.thickness": 1}}}}])
def test_goal_may_need_section_added_by_varied_key(brings, folder):
    base = templates.read("bench_7mm")
    lacks = "target" if "vary" in brings else "elastomer"
    (folder / "coil.yaml").write_text(re.sub(rf"(?m)^{lacks}:\n(?:[ #].*\n|\n)*", "", base))
    request = {"base": "coil.yaml", "vary": {"coil.turns": [11, 12]}, "goals": [{"minimize": "resolution.normal"}]}
    with pytest.raises(sitscad.SpecError, match=f"needs {lacks}, which the base lacks"):
        sitscad.Study.from_mapping(request, folder)
    merged = request | brings | {"vary": request["vary"] | brings.get("vary", {})}
    assert sitscad.Study.from_mapping(merged, folder).request.goals


def _screen_design(asked, count):
    """Evaluations by the screen of the first designs that a study looks at."""
    designs = [asked.space.changes(point) for point in sobol_set(asked.space, count, asked.seed)]
    return evaluate_chunk(asked.base, Chunk(tuple(designs), asked.measures, "screen"))[0]


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["single_coil", "grasper_3p5mm", "racetrack_jaw", "three_axis_triangle"])
def test_study_written_by_new_loads_and_first_design_is_screened(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["new", "--study", name.replace("_", "-")]) == 0
    request = sitscad.Study.load("study.yaml").request
    assert request.base.spec.name == name.replace("_", "-") and request.space.size > 1000
    item, = _screen_design(request, 1)
    assert NOT_COMPUTED not in item.refused and item.verdict


def test_new_study_refuses_existing_file_and_unreadable_spec(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "single_coil.yaml").write_text("sitscad: 1\n")
    assert run(["new", "--study", "single_coil"]) == 2 and "`sitscad check single_coil.yaml`" in capsys.readouterr().err
    (tmp_path / "study.yaml").write_text("mine")
    assert run(["new", "--study", "bench_7mm"]) == 2 and (tmp_path / "study.yaml").read_text() == "mine"


@pytest.mark.slow
@pytest.mark.more
@pytest.mark.parametrize("name", templates.names())
def test_fifty_designs_of_template_study_are_screened_without_failure(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["new", "--study", name]) == 0
    result = _screen_design(sitscad.Study.load("study.yaml").request, 50)
    assert len(result) == 50 and not [item for item in result if NOT_COMPUTED in item.refused]
    assert sum(not any(rule.startswith("SIT0") for rule in item.refused) for item in result) > 25  # can be drawn


def test_design_command_prints_study_findings_and_exits_2(folder, capsys):
    (folder / "study.yaml").write_text(STUDY.replace("coil.turns:", "coil.turs:"))
    assert run(["design", str(folder / "study.yaml")]) == 2
    assert "study.yaml:4:" in capsys.readouterr().err


def test_study_findings_do_not_suggest_check_fix(folder, capsys):
    """They were, though check --fix refuses a study; the hint says what to write."""
    (folder / "study.yaml").write_text(STUDY.replace("keep: 3", "kep: 3"))
    assert run(["design", str(folder / "study.yaml")]) == 2
    text = capsys.readouterr().err
    assert "did you mean keep?" in text and "--fix" not in text


def test_study_schema_accepts_study_and_refuses_unknown_measure(folder):
    jsonschema = pytest.importorskip("jsonschema")
    from ruamel.yaml import YAML

    data = json.loads(json.dumps(YAML(typ="safe").load(STUDY)))
    jsonschema.validate(data, study_schema())
    assert set(study_schema()["properties"]) == set(StudyDocument.keys)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**data, "goals": [{"maximize": "rpp"}]}, study_schema())


def test_study_from_mapping_equals_study_from_file(folder, answered):
    from ruamel.yaml import YAML

    data = YAML(typ="safe").load(STUDY)
    data.pop("sitscad_study")
    study = sitscad.Study.from_mapping(data, folder)
    assert study.request.space == answered[0].request.space and study.request.goals == answered[0].request.goals


BOWL = Space(tuple(Variable(f"x{k}", tuple(range(21))) for k in range(3)), {}, {})


def _bowl(count, calls):
    def evaluate(points):
        calls.append(list(points))
        return [Costs(((x - 3) ** 2 + (y - 7) ** 2 + (z - 20) ** 2, float(x + y))[:count], max(0.0, 2.0 - x))
                for x, y, z in points]

    return evaluate


def test_study_values_in_different_units_are_compared():
    lengths = Variable("coil.trace_width", ("75 um", "100 um", "125 um"))
    assert [lengths.nearest(item) for item in ("0.1 mm", 0.12, "4 mil", "90 um")] == [1, 2, 1, 1]
    assert [Variable("fpc.rules", ("one", "two")).nearest(item) for item in ("two", "three", None)] == [1, 0, 0]
    assert Breach(1.20044, 1.2, "V", 0.1).size > Breach(1.204, 1.2, "V", 0.9).size > Breach(1.2045, 1.2, "V", 1.0).size
    assert breach_text("SIT204", Breach(1.20044, 1.2, "V", 0.1)).endswith("keeps 1.2 V by 0.1 sigma of manufacture "
                                                                          "where one is asked")


@pytest.mark.parametrize("method, goals", [("sobol", 1), ("de", 1), ("nsga2", 2)])
def test_search_evaluates_each_point_once_and_is_repeatable(method, goals):
    pytest.importorskip("pymoo")
    item, other = [], []
    for calls in (item, other):
        search(method, BOWL, 500, 7, goals, _bowl(goals, calls))
    points = [point for part in item for point in part]
    assert item == other and len(points) == len(set(points)) <= 500
    assert all(0 <= k < 21 for point in points for k in point)
    if method != "sobol":
        assert any(sum((a - b) ** 2 for a, b in zip(point, (3, 7, 20), strict=True)) <= 3 for point in points)


def test_differential_evolution_finds_optimum_of_grid():
    calls = []
    search("de", BOWL, 900, 1, 1, _bowl(1, calls))
    assert (3, 7, 20) in [point for part in calls for point in part]


@pytest.mark.more
@pytest.mark.slow
def test_nsga2_front_equals_front_of_all_designs():
    pytest.importorskip("pymoo")
    space = Space(tuple(Variable(f"x{k}", tuple(range(9))) for k in range(3)), {}, {})

    def evaluate(points):
        return [Costs((float((x - 6) ** 2 + z), float((x - 2) ** 2 + (y - 4) ** 2)), 0.0) for x, y, z in points]

    every = list(space.points())
    best = {cost.goals for cost, rank in zip(evaluate(every), front_numbers(evaluate(every)), strict=True) if rank == 0}
    calls = []

    def noted(points):
        calls.extend(points)
        return evaluate(points)

    search("nsga2", space, 400, 1, 2, noted)
    result = evaluate(calls)
    assert {cost.goals for cost, rank in zip(result, front_numbers(result), strict=True) if rank == 0} == best


WIDE = {"coil.outer_diameter": {"from": 9, "to": 12, "step": 0.2}}
GRIDS = {
    "rp against area": ({"coil.turns": {"from": 8, "to": 15, "step": 0.5}, **WIDE},
                        [{"maximize": "rp"}, {"minimize": "board.area"}]),
    "three keys": ({"coil.turns": [8, 9, 10, 11, 12, 13], "coil.outer_diameter": [9, 10, 11, 12],
                    "coil.trace_width": {"from": "100 um", "to": "160 um", "step": "10 um"}},
                   [{"maximize": "q"}, {"minimize": "inductance"}]),
    "three goals": ({"coil.turns": {"from": 8, "to": 14, "step": 1}, **WIDE},
                    [{"maximize": "rp"}, {"minimize": "board.area"}, {"minimize": "inductance"}]),
}


@pytest.mark.slow
@pytest.mark.more
@pytest.mark.parametrize("vary, goals", GRIDS.values(), ids=GRIDS)
def test_search_finds_front_of_complete_grid_within_tolerance(folder, vary, goals):
    pytest.importorskip("pymoo")

    def found(method, evaluations):
        request = {"base": "coil.yaml", "vary": vary, "goals": goals, "accept": ["all"],
                 "search": {"method": method, "evaluations": evaluations}}
        return sitscad.Study.from_mapping(request, folder).run(folder=folder / "out", draws=0)

    whole = found("grid", 1000)
    size = whole.request.space.size
    some = found("nsga2", size * 3 // 4)
    assert len(some.results.screened) <= size * 3 // 4 < len(whole.results.screened) == size

    def goals_of(answer):  # of the front, as figures to make small
        return np.array([costs(answer.request, answer.results.full[point]).goals for point in answer.front])

    off = [screen_errors().get(goal.measure, 0.0) + 1e-9 for goal in whole.request.goals]
    ours, true = goals_of(some), goals_of(whole)
    for item, other in ((ours, true), (true, ours)):  # equal but for what the screen is off by
        excess = (item[:, None] - other[None, :]) / np.abs(other[None, :])
        assert (excess <= off).all(axis=2).any(axis=0).all()


def test_feasible_designs_rank_before_infeasible_designs():
    costs = [Costs((1.0,), 3.0), Costs((5.0,), 0.0), Costs((4.0,), 0.0), Costs((None,), 1.0)]
    assert front_numbers(costs).tolist() == [3, 1, 0, 2]
    assert front_numbers([]).tolist() == []


def test_sobol_set_has_requested_size_and_depends_on_seed():
    space = Space((Variable("a", (2, 4)), Variable("b", tuple(range(16)))), {}, {})
    points = sobol_set(space, 32, 5)
    assert len(points) == 32 and points == sobol_set(space, 32, 5) != sobol_set(space, 32, 6)


def test_hypervolume_matches_exact_values():
    assert hypervolume(np.array([[0.0, 0.0]])) == approx(1.21, rel=1e-12)
    assert hypervolume(np.array([[0.0, 1.0], [1.0, 0.0]])) == approx(1.1 * 0.1 * 2 - 0.01, rel=1e-12)
    assert hypervolume(np.array([[0.0, 0.5, 0.0], [0.5, 0.5, 0.5]])) == approx(1.1 * 0.6 * 1.1, rel=1e-12)


def test_archive_ignores_incomplete_lines(tmp_path):
    path, message = tmp_path / "a" / ARCHIVE, {"units": [[True, [], True, {}]]}
    with Archive(path) as archive:
        archive.add("one", (("coil.turns", 7),), message)
    with path.open("ab") as stream:
        stream.write(b'{"key": "two", "chan')
    with Archive(path) as archive:
        assert archive.read_values("one")["units"] == message["units"] and archive.read_values("two") is None
        archive.add("two", (), message)
    with Archive(path) as archive:
        assert len(archive) == 2
    with Archive(path, again=True) as archive:
        assert len(archive) == 0


def test_changed_archive_byte_is_detected_and_row_ignored(tmp_path):
    """One digit of a parallel resistance gave other designs and false figures, with exit 0."""
    path = tmp_path / ARCHIVE
    message = {name: Evaluation({"rp": (1500.25, 0.1)}, refused={"SIT103": Breach(1.0, 2.0, "m")}).as_json()
            for name in ("one", "two")}
    with Archive(path) as archive:
        for key, item in message.items():
            archive.add(key, (("coil.turns", 7),), item)
        archive.add("units", (), {"units": [[True, [], True, {"rp": 1500.25}]]})
    whole = path.read_bytes()
    with Archive(path) as archive:
        assert archive.damaged == 0 and archive.evaluation("two", ["rp"]).values == {"rp": (1500.25, 0.1)}
    for place in range(len(whole) - 1):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1:])
        with Archive(path) as archive:
            assert len(archive) < 3 and archive.damaged, place
    path.write_bytes(b'{"key": "old", "changes": {}, "units": [[true, [], true, {}]]}\n\n' + whole)
    with Archive(path) as archive:
        assert (len(archive), archive.damaged, archive.units("old")) == (3, 1, None)


def test_two_writers_share_archive_and_truncated_archive_is_refused(tmp_path):
    path = tmp_path / ARCHIVE
    with Archive(path) as item, Archive(path) as other:
        for k in range(4):
            item.add(f"one {k}", (), {"units": [k]})
            other.add(f"other {k}", (("coil.turns", "x" * 10_000 * k),), {"units": [-k]})
        assert [item.read_values(f"one {k}")["units"] for k in range(4)] == [[0], [1], [2], [3]]
        assert [other.read_values(f"other {k}")["units"] for k in range(4)] == [[0], [-1], [-2], [-3]]
        path.write_bytes(b"")
        with pytest.raises(OSError, match="cut or rewritten"):
            item.read_values("one 0")
    assert Archive(path).read_values("one 3") is None


@pytest.mark.parametrize("turns", [8.25, 8.0])
def test_screen_error_of_board_width_covers_leads(turns):
    """Width and area stated an error of 0 and were up to 5.8 % off."""
    spec = sitscad.load_text(templates.read("robotic_jaw_12mm"), "robotic_jaw_12mm.yaml").replace({
        "coil.outer_diameter": "7.93 mm", "coil.turns": turns, "coil.trace_width": "170 um",
        "coil.trace_spacing": "165 um"})
    names = ("fit.width", "fit.length", "fit.closed_pair", "fit.spare", "board.area", "board.layers")
    values, full = screen_designs([spec], names)[0].values, sitscad.Design(spec)
    for name, (value, error) in values.items():
        assert abs(MEASURES[name].read(full)[0] - value) <= error + 1e-9 * value, name
    assert 0.0 < values["fit.width"][1] < 0.1 * values["fit.width"][0] and values["board.layers"][1] == 0.0


def test_wilson_interval_matches_published_values():
    low, high = wilson_interval(81, 263)  # Newcombe 1998, Statistics in Medicine 17, table I: 0.2553 to 0.3662
    assert (round(low, 4), round(high, 4)) == (0.2553, 0.3662)
    assert wilson_interval(10, 10)[1] == approx(1.0, rel=1e-12) and wilson_interval(0, 10)[0] == 0.0


def test_yield_is_reported_before_and_after_calibration(answered):
    judged = [Unit(True, (), True, {"error.gap": 0.1 * k, "rp": float(k)}) for k in range(8)]
    findings = compute_yield(judged, lambda values: (("error.gap",) if values["error.gap"] > 0.35 else ())
                     + (("rp",) if values["rp"] < 1.0 else ()))
    assert (findings.good, findings.calibrated) == (3, 7)
    with_yield = replace(answered[1], kept=(replace(answered[1].kept[0], units=findings),))
    text = yield_table(design_table(with_yield)).text_table()
    assert [dict(zip(text.head, row, strict=True))[head].split()[0] for row in text.rows
            for head in ("yield", "once calibrated")] == ["37.5%", "87.5%"]


def test_yield_loss_is_attributed_to_causing_spread():
    rows = latin_hypercube(256)
    k = list(SPREADS).index("elastomer.modulus")
    judged = [Unit(u < 0.75, () if u < 0.75 else ("SIT401",), True, {"rp": u}) for u in map(float, rows[:, k])]
    findings = compute_yield(judged, lambda values: ())
    assert findings.share == approx(0.75, rel=0.01) and next(iter(findings.costs)) == "elastomer.modulus"
    assert findings.costs["elastomer.modulus"] > 0.9 and len(findings.costs) == 1
    assert findings.sigmas["rp"] == approx(1.0 / math.sqrt(12.0), rel=0.01)


def test_failed_units_count_as_bad_and_separately():
    judged = [Unit(True, (), True, {})] * 7 + [Unit(False, (), False, {})]
    findings = compute_yield(judged, lambda values: ())
    assert (findings.good, findings.failed, findings.units) == (7, 1, 8)


def test_every_spread_changes_unit_by_its_sigma():
    spec = sitscad.load_text(templates.read("grasper_4layer"))
    middle = np.full(len(SPREADS), 0.5)
    assert unit_spec(spec, middle, {}) == spec
    still = []
    for k, (name, spread) in enumerate(SPREADS.items()):
        row = middle.copy()
        row[k] = 0.5 + 0.5 / math.sqrt(3.0)  # one sigma of an even band
        moved = unit_spec(spec, row, {})
        assert (moved != spec) is (spread.sigma(spec) > 0.0), name
        still += [name] * (moved == spec)
    assert still == ["fpc.plating"], "its tracks are not plated"
    assert unit_spec(spec, row, {"target.rotation": 0.0}) == spec


def test_copper_width_spread_changes_resistance_by_estimated_sigma():
    """One sigma of the trace's width, by the full model and to first order."""
    from sitscad.estimates.design import Design

    spec = sitscad.load_text(templates.read("single_coil"))
    k = list(SPREADS).index("coil.trace_width")
    result = []
    for side in (-1.0, 1.0):
        row = np.full(len(SPREADS), 0.5)
        row[k] = 0.5 + side * 0.5 / math.sqrt(3.0)
        made = unit_spec(spec, row, {})
        result.append(Design(made).estimates.coils[0].resistance_dc)
    from sitscad.estimates.circuits.uncertainty import tolerance_sigmas
    from sitscad.estimates.tolerances.scatter import WIDTH

    assert 0.5 * (result[0] - result[1]) / (0.5 * sum(result)) == approx(tolerance_sigmas(spec)[WIDTH], rel=0.05)


@pytest.mark.slow
def test_results_of_a_design_are_freed_before_the_next():
    """Units of a design of 33 MB each grew to 3.6 GB: rings of few objects, which Python does not look for."""
    class Ring:
        def __init__(self):
            self.me = self

    left = [weakref.ref(item) for item in free_results(Ring() for _ in range(3))]
    assert [ref() is None for ref in left[:2]] == [True, True]


@pytest.mark.more
@pytest.mark.slow
def test_progress_of_resumed_run_includes_archived_units(folder):
    """A study that went on told 0 of what was left, as if nothing had been done."""
    study, out = sitscad.Study.load(folder / "study.yaml"), folder / "out"
    text = []

    def interrupt(state):
        if state.stage == "units":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study.run(folder=out, draws=16, progress=interrupt)
    study.run(folder=out, draws=16, progress=text.append)
    units = [state for state in text if state.stage == "units"]
    assert units and units[0].done > units[0].made and units[-1].done == units[-1].of
