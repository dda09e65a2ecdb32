"""Every named fault on a simulated board: what driver and self-test say of it, and whether that is right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sitscad
from sitscad.bench.converter import FAULTS, lost_layer
from sitscad.calibration.making import own_map
from sitscad.calibration.unknowns import units
from sitscad.design import Design
from sitscad.formats.calibration_header import header
from sitscad.spec import presets
from tests.bench.conftest import SANE, TEMPLATES, Bench, compiled
from tests.bench.test_driver import (
    AMPLITUDE,
    BUS,
    GOOD,
    LOST,
    OPEN,
    OUT_OF_BAND,
    STALE,
    TURNS_MISSING,
    WATCHDOG,
    _of_coils,
    _tested,
)

pytestmark = pytest.mark.clients("gcc")


def _broken(bench: Bench, fault: str) -> list[str]:
    """The commands that bring a fault on, most of them on C2."""
    coils = bench.design.estimates.coils
    rest = [coil.states["rest"] for coil in coils]
    higher, less = lost_layer(coils[1], len(bench.design.spec.coil.layers))
    return {
        "open": ["coil 1 0 0"],
        "short": ["coil 1 0 0"],
        "lost-layer": [f"coil 1 {rest[1].frequency * higher} {rest[1].parallel_resistance * less}"],
        "low-amplitude": [f"coil 1 {rest[1].frequency} {0.5 * rest[1].parallel_resistance}"],
        "swapped": [f"coil 0 {rest[2].frequency} 4000", f"coil 2 {rest[0].frequency} 4000"],
        "nack": ["nack 0 1"],
        "stuck": ["stuck 0 2"],
        "reset": ["reset 0"],
        "glitch": ["glitch 0 2"],
    }[fault]


SAID = {
    "open": ({WATCHDOG}, OPEN),
    "short": ({WATCHDOG}, OPEN),
    "lost-layer": ({OUT_OF_BAND}, TURNS_MISSING),
    "low-amplitude": ({AMPLITUDE}, None),
    "stuck": ({STALE}, None),
}
"""What the status of C2 comes to, and what the self-test says of it; None: that it is good."""


@pytest.mark.parametrize("fault", SAID)
def test_a_fault_of_a_coil_is_said_of_that_coil(pad, fault):
    status, tested = SAID[fault]
    rows = pad.run("begin", "settle 4", *_broken(pad, fault), "settle 210", "test")[1:]
    before, after = (_of_coils(row) for row in rows[:2])
    assert before[2] == [GOOD] * 4
    assert {after[2][1]} == status and after[2][:1] + after[2][2:] == [GOOD] * 3
    wrong, *_, results, _ = _tested(rows[2])
    assert (wrong, results[1]) == ((0, 0) if tested is None else (1, tested))


def test_faults_of_the_converter_are_said(pad):
    assert pad.run("begin", "settle 4", *_broken(pad, "nack"), "poll")[-1][0] == str(BUS)
    polls = pad.run("begin", "settle 4", *_broken(pad, "reset"), *["poll"] * 4, "settle 4")[2:]
    assert [row[0] for row in polls] == ["0", "0", "0", str(LOST), "1"]
    assert _of_coils(polls[-1])[2] == [GOOD] * 4


def test_every_fault_has_its_row():
    """The table of docs/bring_up.md names each."""
    page = (TEMPLATES.parent / "docs/bring_up.md").read_text()
    assert {*SAID, "nack", "reset", "swapped", "glitch"} == set(FAULTS)
    assert all(f"| `{fault}` |" in page for fault in FAULTS)


def test_swapped_coils_that_are_alike_are_not_called_sound_without_a_word(pad):
    wrong, _, told, *_ = _tested(pad.run("begin", *_broken(pad, "swapped"), "test")[1])
    assert (wrong, told) == (0, 0)


def test_two_converters_are_one_sensor(tmp_path):
    """Four coils on two LDC1612: their scans do not keep step, and forces come all the same."""
    spec = sitscad.load(TEMPLATES / "three_axis_pad.yaml")
    spec = replace(spec, readout=replace(spec.readout, device=presets.converter("ldc1612")))
    bench = compiled(Design(spec), tmp_path)
    begun, rest, *polls = bench.run("begin", "settle 4", *["poll"] * 40, "test", "nack 1 1", "poll")
    assert begun == ["0", "good"] and _of_coils(rest)[2] == [GOOD] * 4
    new = [_of_coils(row) for row in polls[:40]]
    assert {tuple(row[2]) for row in new if row[0] > 0} == {(GOOD,) * 4}
    assert _tested(polls[40])[0] == 0 and polls[41][0] == str(BUS)
    lost = bench.run("begin", "settle 4", "reset 1", "poll", "poll", "poll", "poll", "poll", "poll", "poll", "poll")
    assert str(LOST) in [row[0] for row in lost]


def _chain(name: str, tmp_path, loads: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Loads in newtons on one board as it is made, read by simulated converter, compiled driver and the map of that
    board: what was put on, what came out, and what data sheet and package state of a unit that is calibrated with the
    points of the plan (axes; N, one sigma).
    """
    design = Design(sitscad.load(TEMPLATES / f"{name}.yaml"))
    found = sitscad.calibrate(design)
    sensors = found.sensors
    errors = units(sensors.known, 1, seed)[0]
    own = own_map(sensors, found.form.form, errors)
    bench = compiled(design, tmp_path, SANE, header(own, sensors.conversion))
    given = np.vstack([np.zeros((1, 3)), sensors.range.inside(loads, 700)])
    frequencies = sensors.under(errors, given, exact=True)
    ohms = [coil.states["rest"].parallel_resistance for coil in design.estimates.coils]

    def wired(row: np.ndarray) -> list[str]:
        return [f"coil {k} {value:.17g} {ohms[k]:.17g}" for k, value in enumerate(row)]

    words = [*wired(frequencies[0]), "begin", "settle 6", *["settle 1", "tare"] * 16]
    for row in frequencies[1:]:
        words += [*wired(row), "settle 6", "forces"]
    rows = bench.run(*words)
    assert rows[3] == ["0"]
    told = np.array([[float(word) for word in row] for row in rows[35::2]])
    assert np.all(told[:, 0] == 0)
    assert found.plan is not None
    return given[1:, sensors.range.columns], told[:, 1:], found.plan.errors[-1]


def _holds(name: str, tmp_path, capsys, loads: int) -> None:
    given, told, error = _chain(name, tmp_path, loads, 3)
    off = np.sqrt(np.mean((told - given) ** 2, axis=0))
    with capsys.disabled():
        print(f"\n  {name}: forces off by {np.round(off, 4)} N rms, stated {np.round(error, 4)} N")
    # the noise of a single reading comes on top of what is stated
    assert np.all(off < 1.3 * error) and np.all(off < 0.01 * np.abs(given).max(axis=0))


def test_newtons_come_out_as_they_were_put_on(tmp_path, capsys):
    """From the load by response, simulated converter, compiled driver and calibrated map to the load."""
    _holds("bench_7mm", tmp_path, capsys, 40)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["three_axis_pad", "three_axis_triangle", "square_bench", "jaw_5x20"])
def test_newtons_come_out_of_other_templates(tmp_path, capsys, name):
    _holds(name, tmp_path, capsys, 80)
