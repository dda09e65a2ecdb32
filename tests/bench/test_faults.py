"""Every named fault on a simulated board: what driver and self-test say of it, and whether that is right."""

from __future__ import annotations

from dataclasses import replace

import pytest

import sitscad
from sitscad.bench.converter import FAULTS, lost_layer
from sitscad.design import Design
from sitscad.spec import presets
from tests.bench.conftest import TEMPLATES, Bench, compiled
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
