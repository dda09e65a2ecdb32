"""Every named fault on a simulated board: what driver and `--diagnose` say of it, and whether that is right."""

from __future__ import annotations

from dataclasses import replace

import faults
import pytest
from template_designs import template_design

import sitscad
from sitscad.apps.hardware.converter import FAULTS
from sitscad.estimates.design import Design
from sitscad.spec import presets
from tests.hardware.conftest import TEMPLATES, compiled
from tests.hardware.test_driver import BUS, GOOD, LOST, _of_coils, _tested

pytestmark = pytest.mark.clients("gcc")


@pytest.mark.slow
def test_every_simulated_fault_is_detected_without_false_alarm():
    """But for coils that are exchanged, which nothing tells apart that are drawn alike."""
    rows = list(faults.table(template_design("bench_7mm")))
    assert len(rows) == 2 * (1 + len(FAULTS))
    assert {(fault, who): right for fault, who, _, right in rows if right != "right"} == {
        ("swapped:C1:C2", who): "not seen" for who in ("driver", "diagnose")
    }
    assert [message for fault, who, message, _ in rows if (fault, who) == ("stuck:C2@0.1", "driver")] == ["C2 stale"]
    assert any(fault.startswith("glitch") and message.endswith("given out 0 wrong") for fault, _, message, _ in rows)


@pytest.mark.slow
def test_driver_treats_two_converters_as_one_sensor(tmp_path):
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
