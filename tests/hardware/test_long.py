"""What takes many boards or many hours: no false alarm among 10,000 sound ones, a day of readings with wrong ones."""

from __future__ import annotations

import re

import numpy as np
import pytest
from template_designs import template_design

import sitscad
from sitscad.apps.hardware.bench_board import Board, CoilReading
from sitscad.apps.hardware.diagnosis import MET, diagnose_board
from sitscad.files.formats.calibration_header import header
from tests.hardware.conftest import Bench, compiled, sound_boards

pytestmark = [pytest.mark.clients("gcc"), pytest.mark.slow]


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Two coils with a map to newtons, compiled for speed."""
    design = template_design("bench_7mm")
    result = sitscad.calibrate(design)
    return compiled(design, tmp_path_factory.mktemp("fast"), ["-O2"], header(result.map, result.sensors.conversion))


@pytest.mark.parametrize("state", ["rest", "free"])
def test_10000_faultless_boards_pass_self_test(fast, state):
    """10,000 in each state; every coil's self-test, and every poll of a scan."""
    ohms = [coil.states[state].parallel_resistance for coil in fast.design.estimates.coils]
    words = []
    for board in sound_boards(fast.design, 10_000, state, 1):
        words += [f"coil {k} {value:.9g} {ohms[k]:.6g}" for k, value in enumerate(board)]
        words += ["begin", "test", "settle 2"]
    rows = fast.run(*words)
    tests, polls = rows[1::3], rows[2::3]
    assert len(tests) == 10_000 and {row[0] for row in tests} == {"0"}
    assert {tuple(row[2::2]) for row in polls} == {("0", "0")}


@pytest.mark.more
@pytest.mark.parametrize("state", ["rest", "free"])
def test_10000_faultless_boards_get_no_diagnosis(fast, state):
    """The same boards by what `read --diagnose` says of a few results of each coil, with the noise of the estimates."""
    board, generator = Board(fast.design, ()), np.random.default_rng(2)
    of_coil = re.compile("C[12] (frequency|amplitude|noise)")
    for frequencies in sound_boards(fast.design, 10_000, state, 1):
        noise = np.array([board.conversion.noise(item) for item in frequencies])
        read = board.conversion.counts(frequencies + noise * generator.normal(size=(40, 2))).round().astype(int)
        rows = [
            [CoilReading(0.01 * k, item, board.status(coil, item, 0)) for k, item in enumerate(read[:, coil].tolist())]
            for coil in (0, 1)
        ]
        message = [item for item in diagnose_board(board, [], rows) if of_coil.match(item.name)]
        assert len(message) == 6 and {item.verdict for item in message} == {MET}, message


def test_no_wrong_value_in_a_day_changes_forces(fast, capsys):
    """At rest every force that comes is the noise; 24 results were wrong, and hardly any reading was lost."""
    rate = fast.design.estimates.readout.scan_rate
    begun, *_, quiet, day = fast.run(
        "begin", "settle 6", *["settle 1", "tare"] * 16, "watch 600 2500000 0", "watch 86400 2500000 3600"
    )
    assert begun == ["0", "good"]
    noise = float(quiet[3])
    good, bad, glitches, worst = (float(word) for word in day)
    with capsys.disabled():
        print(f"\n  a day: {good:.0f} readings good, {bad:.0f} kept back, {glitches:.0f} wrong; largest force "
              f"{1e3 * worst:.1f} mN, of ten minutes without wrong ones {1e3 * noise:.1f} mN")
    assert 23 <= glitches <= 24 and bad <= 4 * glitches
    assert good > 0.95 * 86400 * rate
    assert worst < 1.6 * noise
