"""SIT315 and SIT316: tongue, pins and holes by the figures of the process, the jaw by those of the metal."""

from __future__ import annotations

import math
import re

import pytest
from tolerance import approx

from sitscad.assembly.places.column import print_limit
from sitscad.basics.finding import Severity
from sitscad.checks.judging import check
from sitscad.spec import presets
from sitscad.spec.load import load_text

SENSOR = """sitscad: 1
name: held
coil: {shape: circle, outer_diameter: 4, turns: 7.75, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: line, count: 2, pitch: 4.5}
fpc: {stackup: flex-4l, rules: generic-fine, tail: {length: 30, connector: zif-0.5mm, layers: 2}}
"""


def found(mount, rule):
    result = check(load_text(SENSOR + f"mount: {mount}\n", "held.yaml"))
    return [finding for finding in result.findings if finding.rule == rule]


def joint(retention, jaw="generic-10mm", standoff=0.6, process="resin"):
    return found(f"{{jaw: {jaw}, standoff: {standoff}, process: {process}, retention: {retention}}}", "SIT315")


@pytest.mark.parametrize("retention", ["glue", "dovetail", "pins"])
def test_default_joint_of_each_kind_passes_in_resin(retention):
    assert joint(retention) == []


def test_narrow_dovetail_neck_gives_finding_with_sufficient_width():
    (thin,) = joint("{kind: dovetail, width: 1.2, depth: 0.8}", jaw="{based_on: generic-10mm, height: 4}")
    assert thin.measured == approx(1.2e-3 - 1.6e-3 / math.tan(math.radians(60.0)), rel=1e-6)
    assert thin.limit == print_limit("resin", "wall").value and thin.key == "mount.retention.width"
    wider = float(re.search(r"width: ([\d.]+)", thin.hint)[1])
    retention = f"{{kind: dovetail, width: {wider}, depth: 0.8}}"
    assert joint(retention, jaw="{based_on: generic-10mm, height: 4}") == []


def test_crossing_dovetail_flanks_give_finding():
    crossed = joint("{kind: dovetail, width: 2, depth: 8}", jaw="{based_on: generic-10mm, height: 9}")
    (none,) = [each for each in crossed if each.measured == approx(8e-3, rel=1e-6)]
    assert none.measured == approx(8e-3, rel=1e-6) and none.limit == approx(
        math.tan(math.radians(60.0)) * 1e-3, rel=1e-6
    )


@pytest.mark.slow
@pytest.mark.cad
def test_crossing_dovetail_flanks_raise_parts_error():
    from sitscad.assembly.solids import solids
    from sitscad.assembly.solids.solid import PartsError
    from sitscad.layout import lay_out

    retention = "{kind: dovetail, width: 2, depth: 8}"
    mount = f"{{jaw: generic-10mm, standoff: 0.6, retention: {retention}}}"
    with pytest.raises(PartsError, match="flanks cross"):
        solids(lay_out(load_text(SENSOR + f"mount: {mount}\n", "held.yaml")))


@pytest.mark.parametrize(
    ("boards", "sheet", "is_found"), [(1, "", False), (4, "[30, 40]", True), (4, "[60, 60]", False)]
)
def test_sheet_too_small_for_parts_and_coupon_gives_finding(boards, sheet, is_found):
    plate = "target: {shape: circle, size: 8, thickness: 0.1, material: copper}\n"
    cutting = f"cutting: {{sheet: {sheet}}}\n" if sheet else ""
    text = SENSOR.replace("fpc: {", f"fpc: {{boards: {boards}, ") + plate + cutting
    rules = {each.rule for each in check(load_text(text, "held.yaml"), hints="none").findings}
    assert ("SIT317" in rules) is is_found


@pytest.mark.parametrize(("finger", "is_found"), [(3, True), (8, False)])
def test_finger_narrower_than_board_gives_finding(finger, is_found):
    message = found(f"{{kind: fingertip, standoff: 1, finger: {{shape: circle, size: {finger}}}}}", "SIT318")
    assert bool(message) is is_found


@pytest.mark.slow
def test_dovetail_groove_depth_is_checked_at_round_jaw_corner():
    """The back is round: at the groove's corner the jaw is lower than in its middle."""
    (deep,) = joint("{kind: dovetail, width: 2.4, depth: 0.7}", jaw="generic-5mm")
    jaw = presets.jaw("generic-5mm")
    room = print_limit("resin", "clearance").value + 30e-6
    half = 1.2e-3 + room * (1 / math.tan(math.radians(60.0)) + 1 / math.sin(math.radians(60.0)))
    at_corner = jaw.height - (2.5e-3 - math.sqrt(2.5e-3**2 - half**2))
    assert deep.measured == approx(at_corner - 0.7e-3 - room, rel=1e-6)
    assert deep.severity is Severity.ERROR and "jaw-unverified" in deep.cases


@pytest.mark.slow
def test_thin_or_long_pins_give_finding():
    (thin,) = joint("{kind: pins, diameter: 0.8}")
    assert (thin.measured, thin.limit) == (approx(0.8e-3, rel=1e-6), print_limit("resin", "pin").value)
    (filament,) = joint("{kind: pins, diameter: 1}", process="filament", standoff=1)
    assert filament.limit == print_limit("filament", "pin").value
    (long,) = joint("{kind: pins, depth: 3}")
    assert (long.key, long.measured > long.limit) == ("mount.retention.depth", True)


@pytest.mark.slow
def test_pins_near_jaw_window_give_finding():
    window = "{based_on: generic-10mm, fenestration: [6, 2]}"
    assert joint("{kind: pins, spacing: 12}", jaw=window) == []
    (close,) = joint("{kind: pins, spacing: 7}", jaw=window)
    room = print_limit("resin", "clearance").value + 30e-6
    assert close.measured == approx(3.5e-3 - 0.5e-3 - room - 3e-3, rel=1e-6) and close.key == "mount.retention.spacing"


@pytest.mark.more
@pytest.mark.slow
def test_joint_without_plastic_on_jaw_gives_finding():
    shield = "{jaw: generic-5mm, standoff: 0.6, retention: pins}\nshield: {gap: 0.5, thickness: 0.1}"
    (nothing,) = found(shield, "SIT315")
    assert (nothing.key, nothing.measured) == ("mount.retention", None)


def test_two_small_holes_give_one_warning():
    holes = (
        "{kind: bench-plate, process: PROCESS, holes: [{at: [20, 9], diameter: 1.6}, {at: [-20, 9], diameter: 1.6}]}"
    )
    (item,) = found(holes.replace("PROCESS", "filament"), "SIT316")
    assert (item.measured, item.limit, item.severity) == (
        approx(1.6e-3, rel=1e-6),
        approx(2e-3, rel=1e-6),
        Severity.WARNING,
    )
    assert found(holes.replace("PROCESS", "resin"), "SIT316") == []


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", presets.names("hole pattern"))
def test_holes_of_every_pattern_pass_in_every_process(name):
    for process in ("resin", "powder", "filament", "machined"):
        assert found(f"{{kind: bench-plate, process: {process}, holes: {name}}}", "SIT316") == []
