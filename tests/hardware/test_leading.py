"""`sitscad calibrate --from`: points led through on simulated boards, gone on with, refused; and the map from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.apps.hardware.bench_board import Board
from sitscad.apps.hardware.converter import SimulatedConverter
from sitscad.apps.hardware.leading import LOAD_INPUTS, GuidedCalibration, PointRefused, head_lines, stable_counts
from sitscad.apps.hardware.source import Simulation, Source, open_source
from sitscad.calibration.points import Plan
from tests.hardware.conftest import TEMPLATES

SPEC = TEMPLATES / "bench_7mm.yaml"


@pytest.fixture(scope="module")
def design() -> sitscad.Design:
    return sitscad.Design(sitscad.load(SPEC))


@pytest.fixture(scope="module")
def planned(design):
    """A plan of three loads, as much of a calibration as is led by."""
    loads = np.array([[4.0, 0.5, 0.0], [2.0, 0.0, 0.0], [1.0, -0.5, 0.0]])
    plan = Plan(loads, np.zeros((4, 2)), np.zeros(2), np.zeros(2))
    return replace(sitscad.calibrate(design), plan=plan)


def _begun(design, source=""):
    given, _ = open_source(f"sim:{SPEC}?{source}", design)
    board = Board(design, given.chips)
    board.set_up()
    return board, given


def _simulated(design):
    """The board of a design without a file."""
    given = Simulation(design, [SimulatedConverter(design)])
    board = Board(design, given.chips)
    board.set_up()
    return board, given


def _unasked(words: str) -> str:
    raise AssertionError(words)


@pytest.mark.slow
def test_guided_calibration_records_points_and_resumes_table(design, planned):
    board, source = _begun(design)
    message: list[str] = []
    leading = GuidedCalibration(board, source, planned, _unasked, message.append)
    part = [text for text, _ in zip(leading.table(), range(3), strict=False)][-1]
    *_, whole = leading.table(part)
    assert whole.startswith(part) and whole.startswith(head_lines(board, planned)) and message[-1] == "6 of 6 taken"
    rows = np.array([[float(cell) for cell in line.split(",")] for line in whole.splitlines()[3:]])
    assert rows[:, 0].tolist() == [0, 4, 0, 2, 1, 0] and rows[:, 1].tolist() == [0, 0.5, 0, 0, -0.5, 0]
    loads = np.insert(rows[:, :2], 2, 0.0, axis=1)
    true = board.conversion.counts(sitscad.respond(design, loads=loads, rotation="held").frequency)
    sigma = board.conversion.noise(8e6) / board.frequency(1) / np.sqrt(200)
    assert np.all(np.abs(rows[:, 2:] - true) < 6.0 * sigma)
    assert list(leading.table(whole)) == []


@pytest.mark.slow
def test_guided_calibration_refuses_table_or_board_of_other_sensor(design, planned):
    board, source = _begun(design)
    other = head_lines(board, planned).replace("3 points", "8 points") + "0,0,1,2\n"
    with pytest.raises(ValueError, match="of another plan"):
        next(GuidedCalibration(board, source, planned, _unasked, print).table(other))
    given, _ = open_source(f"sim:{TEMPLATES / 'jaw_5x20.yaml'}", None)
    with pytest.raises(ValueError, match="the simulated board is jaw"):
        next(GuidedCalibration(Board(design, given.chips), given, planned, _unasked, print).table(""))
    board = Board(design, given.chips)  # as a bus has it: only its readings say so
    board.set_up()
    with pytest.raises(PointRefused, match="C1: watchdog"):
        stable_counts(board, _by_hand(given), print, range(2))


def _by_hand(simulated: Source) -> Source:
    """The same board, its loads put on by somebody."""
    wired = Source(simulated.chips)
    wired.creep, wired.now, wired.wait = 0.0, simulated.now, simulated.wait
    return wired


@pytest.mark.parametrize(
    ("source", "words"),
    [("fault=open:C2", "C2: watchdog"), ("fault=lost-layer:C1", "C1: out of band: another sensor"),
     ("fault=stuck:C1@0.01", "C1: stuck")],
)
def test_guided_calibration_refuses_faulty_readings(design, source, words):
    board, given = _begun(design, source)
    with pytest.raises(PointRefused, match=words):
        stable_counts(board, given, print, range(2))


def test_stable_counts_wait_for_rest_and_omit_single_jumps(design):
    board, source = _begun(design, "load=normal:3:0&seconds=3&fault=glitch:C1@4.5")
    message: list[str] = []
    result = stable_counts(board, source, message.append, range(2))
    rest = board.conversion.counts(sitscad.respond(design, loads=[[0, 0, 0]], rotation="held").frequency)[0]
    assert list(result) == approx(list(rest), rel=2e-6) and len(message) >= 2 and "still moves" in message[0]


def _answered(design, planned, *answers: str, fault: str = ""):
    """A table led by what somebody types, a load put on before each answer where one is given: (load, words). What was
    asked and said comes in one list.
    """
    board, source = _begun(design, fault)
    message: list[str] = []
    left = iter(answers)

    def ask(words: str) -> str:
        message.append(f"? {words.removesuffix(LOAD_INPUTS)}")
        load, typed = next(left)
        source.apply_load(np.array(load), True)
        return typed

    return GuidedCalibration(board, _by_hand(source), planned, ask, message.append).table(), message


NOTHING, FOUR = [0.0, 0.0, 0.0], [4.0, 0.5, 0.0]


def test_typed_load_replaces_planned_load(design, planned):
    on = [3.8, 0.4, 0.0]
    texts, message = _answered(
        design, planned, (NOTHING, ""), (on, "three"), (on, "0 0"), (on, "3.8"), (on, "3.8, 0.4")
    )
    next(texts)
    assert next(texts).splitlines()[-1].startswith("3.8,0.4,")
    assert message[0] == "? 1 of 6: nothing on it" and "? 2 of 6: press 4 N, push +0.5 N along x" in message
    assert sum(line.startswith("? 2") for line in message) == 4
    assert "'three' is not normal, shear_x in newtons" in message[-7]


def test_implausible_point_is_reported_and_requested_again(design, planned):
    """A weight that was forgotten, a push the wrong way; what somebody insists on is kept."""
    texts, message = _answered(
        design, planned, (NOTHING, ""), (NOTHING, ""), ([4.0, -0.5, 0.0], ""), (FOUR, ""), (FOUR, ""), (FOUR, "0 0")
    )
    next(texts)
    second = next(texts)
    assert second.splitlines()[-1].startswith("4,0.5,")
    again = [line for line in message if "Once more" in line]
    assert len(again) == 2 and "reads as about" in again[0] and "-0.5 N shear_x" in again[1]
    assert next(texts).splitlines()[-1].startswith("0,0,")  # four newtons on it, and typed to be none
    assert "reads as about 4 N normal" in [line for line in message if "Once more" in line][2]


def test_typing_back_repeats_previous_point(design, planned):
    texts, message = _answered(
        design, planned, (NOTHING, "back"), (NOTHING, ""), (FOUR, ""), (FOUR, "back"), ([3.9, 0.5, 0.0], "3.9 0.5")
    )
    first, second, back, again = (next(texts) for _ in range(4))
    assert "'back' is not 0 for every axis" in message[1] and back == first != second
    assert again.splitlines()[-1].startswith("3.9,0.5,") and len(again.splitlines()) == len(second.splitlines())


def test_guided_calibration_rejects_points_of_exchanged_coils(design, planned):
    """Nothing else sees them where they are drawn alike."""
    texts, message = _answered(design, planned, (NOTHING, ""), (FOUR, ""), (FOUR, "4 0.5"), fault="fault=swapped:C1:C2")
    next(texts)
    next(texts)
    assert any("Once more" in line and "-0.5 N shear_x" in line for line in message)


@pytest.fixture(scope="module")
def warm_plan(design):
    """A plan of three loads and a second temperature, and its design with a thermometer."""
    spec = design.spec.replace({"requirements.temperature_range": [20.0, 37.0], "array.reference": {},
                                "readout.compensation.coefficients": "calibrated"})
    other = sitscad.Design(spec)
    full = sitscad.calibrate(other)
    plan = Plan(np.array([[4.0, 0.5, 0.0], [1.0, -0.5, 0.0]]), np.zeros((3, 2)), np.zeros(2), np.zeros(2))
    return other, replace(full, plan=plan)


def test_guided_calibration_has_temperatures_and_reference_coil(warm_plan):
    """A simulated board is warmed by the plan: all coils lose frequency."""
    other, planned = warm_plan
    board, source = _simulated(other)
    *_, whole = GuidedCalibration(board, source, planned, _unasked, str).table()
    lines = whole.splitlines()
    assert lines[2] == "normal_N,shear_x_N,temperature_degC,C1_counts,C2_counts,C3_counts"
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[3:]])
    assert rows[:, 2].tolist() == planned.planned_rows[1].tolist()
    assert rows[:, 0].tolist() == planned.planned_rows[0][:, 0].tolist()
    change = np.log(rows[-1, 3:] / rows[0, 3:]) / 17.0
    assert change[2] == approx(other.cells.reference_drift, rel=0.02)
    assert change[:2] == approx(planned.map.drifts.at_rest, rel=0.1)


def test_typed_temperature_is_written(warm_plan):
    other, planned = warm_plan
    board, source = _simulated(other)
    answers, asked = iter(["", "warm", "20,4"]), []

    def ask(words: str) -> str:
        asked.append(words)
        return next(answers)

    first = next(GuidedCalibration(board, _by_hand(source), planned, ask, str).table())
    assert "20 degC" in asked[0] and first.splitlines()[-1].split(",")[2] == "20.4"
