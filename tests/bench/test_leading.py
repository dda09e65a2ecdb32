"""`sitscad calibrate --from`: points led through on simulated boards, gone on with, refused; and the map from them."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from tolerance import approx

import sitscad
from sitscad.bench.board import Board
from sitscad.bench.leading import NotTaken, head, led, taken
from sitscad.bench.source import Source, source_of
from sitscad.calibration.calibration import sensors_of
from sitscad.calibration.plan import Plan
from sitscad.calibration.sensors import Sensors
from sitscad.cli import cli
from tests.bench.conftest import TEMPLATES

SPEC = TEMPLATES / "bench_7mm.yaml"


@pytest.fixture(scope="module")
def design() -> sitscad.Design:
    return sitscad.Design(sitscad.load(SPEC))


@pytest.fixture(scope="module")
def planned(design):
    """A plan of three loads, as much of a calibration as is led by."""
    plan = Plan(np.array([[4.0, 0.5, 0.0], [2.0, 0.0, 0.0], [1.0, -0.5, 0.0]]), np.zeros((4, 2)), np.zeros(2))
    return SimpleNamespace(plan=plan, sensors=Sensors(design.response))


def _begun(design, source=""):
    given, _ = source_of(f"sim:{SPEC}?{source}", design)
    board = Board(design, given.chips)
    board.set_up()
    return board, given


def _unasked(words: str) -> str:
    raise AssertionError(words)


def test_points_are_taken_and_gone_on_with(design, planned):
    board, source = _begun(design)
    said: list[str] = []
    part = [text for text, _ in zip(led(board, source, planned, "", _unasked, said.append), range(3), strict=False)][-1]
    *_, whole = led(board, source, planned, part, _unasked, said.append)
    assert whole.startswith(part) and whole.startswith(head(board, planned)) and said[-1] == "6 of 6 taken"
    rows = np.array([[float(cell) for cell in line.split(",")] for line in whole.splitlines()[3:]])
    assert rows[:, 0].tolist() == [0, 4, 0, 2, 1, 0] and rows[:, 1].tolist() == [0, 0.5, 0, 0, -0.5, 0]
    loads = np.insert(rows[:, :2], 2, 0.0, axis=1)
    true = board.conversion.counts(sitscad.respond(design, loads=loads, rotation="held").frequency)
    sigma = board.conversion.noise(8e6) / board.frequency(1) / np.sqrt(200)
    assert np.all(np.abs(rows[:, 2:] - true) < 6.0 * sigma)
    assert list(led(board, source, planned, whole, _unasked, said.append)) == []


def test_tables_and_boards_of_another_sensor_are_refused(design, planned):
    board, source = _begun(design)
    other = head(board, planned).replace("3 points", "8 points") + "0,0,1,2\n"
    with pytest.raises(ValueError, match="of another plan"):
        next(led(board, source, planned, other, _unasked, print))
    given, _ = source_of(f"sim:{TEMPLATES / 'jaw_5x20.yaml'}", None)
    with pytest.raises(ValueError, match="the simulated board is jaw"):
        next(led(Board(design, given.chips), given, planned, "", _unasked, print))
    board = Board(design, given.chips)  # as a bus has it: only its readings say so
    board.set_up()
    with pytest.raises(NotTaken, match="C1: watchdog"):
        taken(board, _by_hand(given), print)


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
def test_readings_that_are_not_good_are_not_taken(design, source, words):
    board, given = _begun(design, source)
    with pytest.raises(NotTaken, match=words):
        taken(board, given, print)


def test_it_waits_until_readings_are_at_rest_and_leaves_single_jumps_out(design):
    board, source = _begun(design, "load=normal:3:0&seconds=3&fault=glitch:C1@4.5")
    said: list[str] = []
    found = taken(board, source, said.append)
    rest = board.conversion.counts(sitscad.respond(design, loads=[[0, 0, 0]], rotation="held").frequency)[0]
    assert list(found) == approx(list(rest), rel=2e-6) and len(said) >= 2 and "still moves" in said[0]


def test_what_is_typed_goes_before_what_was_asked_for(design, planned):
    board, source = _begun(design)
    source.put_on(np.array([3.8, 0.4, 0.0]), True)
    answers = iter(["", "three", "0 0", "3.8", "3.8, 0.4"])
    asked: list[str] = []
    texts = led(board, _by_hand(source), planned, "", lambda words: (asked.append(words), next(answers))[1], print)
    next(texts)
    assert next(texts).splitlines()[-1].startswith("3.8,0.4,")
    assert asked[0] == "1 of 6: nothing on it" and asked[1] == "2 of 6: press 4 N, push +0.5 N along x"
    assert len(asked) == 5


@pytest.mark.slow
def test_a_unit_that_is_led_through_reads_newtons_as_well_as_its_file_says(design, tmp_path):
    """A sensor with errors of its own, noise and all, from the command to its newtons."""
    source = f"sim:{SPEC}?unit=3"
    words = ["calibrate", str(SPEC), "--from", source, "-o", str(tmp_path)]
    done = CliRunner().invoke(cli, words, standalone_mode=False)
    assert done.return_value in (0, 1), done.output
    made = json.loads((tmp_path / "calibration.json").read_text())
    given, _ = source_of(source, design)
    sensors = sensors_of(design.response)
    tried = np.vstack([np.zeros((1, 3)), sensors.range.inside(12, 300)])
    read = sensors.conversion.counts(sensors.under(given.unit, tried, exact=True))
    found = sitscad.map_of(tmp_path / "calibration.json")
    off = np.sqrt(np.mean((found(read[1:], read[0]) - tried[1:, sensors.range.columns]) ** 2, axis=0))
    stated = np.array([made["error_N"][axis] for axis in found.axes])
    assert np.all(off < stated), (off, stated)
