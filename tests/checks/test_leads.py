"""SIT216: what it costs that leads run round their coil, and the turns or the start angle that spare it."""

import re
from dataclasses import replace

import pytest
from one_rule import findings_of
from tolerance import approx

from sitscad.basics.finding import Severity
from sitscad.checks.fixes.moves import fewer_turns, more_turns, whole_turns, with_each_turns
from sitscad.checks.judging import check
from sitscad.checks.reading.electrical import WARNED
from sitscad.estimates import estimate
from sitscad.estimates.design import Design
from sitscad.layout import lay_out
from sitscad.layout.routing.branches import drawn_closing, least_closing
from sitscad.spec.load import load_text

from .conftest import design

LOOP_LINES = """sitscad: 1
name: loops
coil: {{shape: circle, outer_diameter: 10, turns: {turns}, layers: 2, trace_width: 203.2 um, trace_spacing: 203.2 um}}
array: {{pattern: line, count: 2, pitch: 11.5}}
fpc: {{stackup: flex-2l-35um, rules: jselectronic, tail: {{length: 30, connector: zif-0.5mm}}}}"""


def loops(turns):
    return load_text(LOOP_LINES.format(turns=turns), "loops.yaml")


def found_in(spec):
    return [finding for finding in check(spec).findings if finding.rule == "SIT216"]


def test_half_turn_lead_gives_note_with_turns_that_avoid_it():
    (findings,) = [each for each in check(loops(8.75), hints="full").findings if each.rule == "SIT216"]
    assert findings.severity is Severity.NOTE and findings.key == "coil.turns" and 0.04 < findings.measured < 0.06
    assert {"lead-on", "lead-resistance"} <= set(findings.cases)
    assert re.search(r"0\.5 turns .* \d+\.?\d* nH, \d\.\d % ", findings.message)
    assert [(edit.key, edit.new) for edit in findings.fixes[0].edits] == [("coil.turns", "8.5")]
    assert found_in(loops(8.5)) == found_in(loops(9)) == []


def test_half_turn_forward_lead_raises_inductance_and_parallel_resistance():
    """Once 8.75 turns had less of both than 8.5 and 9: the lead ran half a turn back."""
    coils = [estimate(lay_out(loops(turns)), tolerance=1e-3).coils[0] for turns in (8.5, 8.75, 9)]
    inductances, parallel = ([getattr(coil.states["free"], name) for coil in coils]
                             for name in ("inductance", "parallel_resistance"))
    assert inductances[1] > max(inductances[0], inductances[2])
    assert parallel[1] > max(parallel[0], parallel[2])


def test_backward_lead_gives_warning_with_turns_that_avoid_it():
    spec = loops(8.65)
    (found,) = found_in(spec)
    assert (found.severity, found.key) == (Severity.WARNING, "coil.turns") and found.measured > found.limit == WARNED
    assert "lead-back" in found.cases and "0.3 turns" in found.message
    turns = float(found.fixes[0].edits[0].new)
    assert turns == 8.5 and found_in(replace(spec, coil=replace(spec.coil, turns=turns))) == []


def test_measured_lead_ratio_equals_estimate():
    spec = loops(8.65)
    layout = lay_out(spec)
    estimates = estimate(layout)
    (findings,) = findings_of("SIT216", spec, layout, estimates)
    shares = [coil.lead_parts["coupling"] / coil.winding_inductance for coil in estimates.coils]
    assert findings.measured == approx(max(map(abs, shares)), rel=1e-6)
    assert drawn_closing(spec.coil, layout.coils[0]) == approx(-0.3, abs=0.01)


@pytest.mark.parametrize("shape, layers, turns, named", [
    ("circle", 2, 8.7, [8.5, 9.0]), ("circle", 4, 8.7, [8.75, 8.5]), ("circle", 2, 8.5, [9.0]),
    ("square", 2, 6.25, [6.0, 6.5]), ("hexagon", 4, 6 + 1 / 6, [6.0, 6.5]), ("racetrack", 4, 6.5, [7.0]),
])
def test_whole_turns_gives_nearest_turns_first(shape, layers, turns, named):
    spec = wound(shape, layers, turns)
    numbers = list(whole_turns(spec.coil))
    assert numbers == approx(named, rel=1e-6)
    assert [change.spec.coil.turns for change in with_each_turns(spec, numbers)] == numbers
    assert all(f"{change.spec.coil.turns:.7g}" in change.words for change in with_each_turns(spec, numbers))


def test_changed_jaw_width_recomputes_layout():
    """A board may become as wide as its jaw for the sake of its leads."""
    spec = design()
    wide = replace(spec, mount=replace(spec.mount, jaw=replace(spec.mount.jaw, width=9e-3)))
    subject = Design(spec)
    assert subject.drawn(wide).layout.coils is not subject.layout.coils
    assert subject.drawn(replace(spec, name="other")).layout.coils is subject.layout.coils


@pytest.mark.parametrize("shape, layers, turns", [
    ("hexagon", 2, 6), ("octagon", 2, 6), ("octagon", 4, 6.25), ("circle", 2, 8.5), ("square", 2, 6.25),
    ("hexagon", 4, 6),
])
def test_suggested_turns_never_give_backward_lead(shape, layers, turns):
    """Such turns have less inductance and a smaller Rp than their neighbours."""
    spec = wound(shape, layers, turns)
    coil = spec.coil
    numbers = *more_turns(coil, 1.01), *more_turns(coil, 1.3), *fewer_turns(coil, turns - 0.01, 6)
    for fix in with_each_turns(spec, numbers):
        assert fix.spec == spec or least_closing(fix.spec.coil) > -0.05
    assert next(more_turns(coil, 1.01)) > turns
    assert len(list(fewer_turns(coil, turns - 0.01, 6))) == 8


def wound(shape, layers, turns):
    size = "[14, 10]" if shape == "racetrack" else "10"
    return load_text(
        f"sitscad: 1\nname: whole\ncoil: {{shape: {shape}, outer_diameter: {size}, turns: {turns}, layers: {layers}, "
        "trace_width: 100 um, trace_spacing: 100 um}", "whole.yaml")
