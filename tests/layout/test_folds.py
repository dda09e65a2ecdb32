"""Leads that turn back on themselves: no notch narrower than the fabricator's spacing is left between their parts."""

import math

import pytest
from tolerance import approx

from sitscad.checks.board.drawn_form import acute_angle, sliver
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Line, Point, polar
from sitscad.layout import lay_out
from sitscad.layout.gaps import conductor_notches, copper_of
from sitscad.layout.lanes import Ring
from sitscad.layout.routing.branches import fold_chord
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.load import load_text

UM = 1e-6

HEAD = "sitscad: 1\nname: folded\n"
FINE = "trace_width: 76 um, trace_spacing: 76 um"
TAIL = "connector: zif-0.5mm, layers"

FOLDED = {
    "hexagons of one layer": f"""
coil: {{shape: hexagon, outer_diameter: 8.6, turns: 22.666666666666668, layers: 1, {FINE}, start_angle: 90 deg}}
array: {{pattern: line, count: 4, pitch: 9.1}}
fpc: {{rules: generic-fine, tail: {{length: 60, {TAIL}: 1}}}}
""",
    "hexagons that end inside": f"""
coil: {{shape: hexagon, outer_diameter: 6.69, turns: 9, layers: 3, {FINE}, sense: clockwise}}
array: {{pattern: line, count: 4, pitch: 8.69}}
fpc: {{rules: generic-fine, tail: {{length: 15, {TAIL}: 2}}}}
""",
    "racetracks that end inside": f"""
coil: {{shape: racetrack, outer_diameter: [22.78, 10.24], turns: 9, layers: 5, {FINE}, start_angle: 45 deg,
       sense: clockwise}}
array: {{pattern: line, count: 5, pitch: 23.98}}
fpc: {{rules: generic-fine, tail: {{length: 15, {TAIL}: 2}}}}
""",
    "racetracks that end outside": f"""
coil: {{shape: racetrack, outer_diameter: [15.28, 6.68], turns: 9, layers: 6, {FINE}, start_angle: 45 deg}}
array: {{pattern: line, count: 4, pitch: 17.28}}
fpc: {{rules: generic-fine, tail: {{length: 30, connector: zif-0.3mm, layers: 2}}}}
""",
    "small octagon": f"""
coil: {{shape: octagon, outer_diameter: 3.16, turns: 2.625, layers: 3, trace_width: 120 um, trace_spacing: 100 um,
       start_angle: 90 deg, sense: clockwise, corner_radius: 0.42}}
fpc: {{rules: generic-flex, tail: {{length: 15, {TAIL}: 2}}}}
""",
}
"""Random boards (tests/validation/random_boards.py) whose leads turned back within 59 to 74 um."""


@pytest.mark.parametrize("name", FOLDED)
def test_lead_beside_ring_corner_leaves_no_narrow_notch(name):
    spec = load_text(HEAD + FOLDED[name], "folded.yaml")
    layout = lay_out(spec)
    request = min(spec.fpc.rules.trace_spacing, spec.coil.trace_spacing)
    assert layout.shortfalls == ()
    assert [near.gap for near in conductor_notches(copper_of(layout), request - 1 * UM)] == []


ACUTE = {
    "racetracks": f"""
coil: {{shape: racetrack, outer_diameter: [16, 1.99], turns: 3.5, layers: 4, {FINE}}}
array: {{pattern: line, count: 3, pitch: 18}}
fpc:
  stackup: flex-4l
  rules: generic-fine
  largest: {{shape: rectangle, size: [60, 3]}}
  tail: {{length: 30, connector: zif-0.3mm, contacts: 7, bend: none}}
""",
    "squares": f"""
coil: {{shape: square, outer_diameter: 5.22, turns: 4.5, layers: 4, {FINE}}}
array: {{pattern: line, count: 3, pitch: 7.38}}
fpc: {{stackup: flex-4l, rules: generic-fine, tail: {{length: 30, connector: zif-0.5mm}}}}
""",
}
"""Boards whose leads turned back at 45 degrees where they left the ring."""


@pytest.mark.parametrize("name", ACUTE)
def test_lead_that_turns_back_makes_no_acute_angle_or_sliver(name):
    layout = lay_out(load_text(HEAD + ACUTE[name], "acute.yaml"))
    assert layout.shortfalls == ()
    for rule in (acute_angle, sliver):
        assert list(rule(Design(layout.spec, layout))) == []


@pytest.mark.parametrize("opening", [20, 45, 80])
@pytest.mark.parametrize("short", [10 * UM, 90 * UM])
def test_fold_chord_separates_lines_by_required_distance(opening, short):
    """Both lines meet at `opening` degrees; one of them begins `short` before or after that corner."""
    there = polar(1e-3, math.radians(opening))
    for begin in (polar(short, math.radians(opening)), polar(short, math.radians(opening) + math.pi)):
        item, other = Line(Point(1e-3, 0.0), Point(short, 0.0)), Line(begin, there)
        chord = fold_chord(item, other, 152 * UM)
        assert chord.length == approx(152 * UM, abs=0, rel=1e-9)
        assert chord.start.y == approx(0.0, abs=1e-12) and other.distance(chord.end) < 1e-12
        left = Line(chord.end, there)
        nearest = min(left.distance(item.at(k / 200)) for k in range(201) if item.at(k / 200).x >= chord.start.x)
        assert nearest >= 152 * UM - 1e-12


def test_fold_chord_of_distant_or_short_lines_is_none():
    item = Line(Point(1e-3, 0.0), Point(0.2e-3, 0.0))
    assert fold_chord(item, Line(Point(0.2e-3, 0.2e-3), Point(1e-3, 0.4e-3)), 152 * UM) is None
    assert fold_chord(item, Line(Point(0.2e-3, 0.02e-3), Point(0.25e-3, 0.05e-3)), 152 * UM) is None
    assert fold_chord(item, Line(Point(0.2e-3, 0.05e-3), Point(1e-3, 0.05e-3)), 152 * UM) is None


@pytest.mark.parametrize("shape", ["circle", "hexagon"])
def test_line_outside_ring_is_distinguished_from_crossing_line(sensor, shape):
    ring = Ring(sensor(shape=shape).coil, CoilPlacement("C1", (1e-3, 2e-3), 0.3), 0.2e-3)
    away = [polar(5e-3, 0.9 + step, ring.centre) for step in (-0.05, 0.05)]
    assert ring.is_outside(Line(*away)) and ring.is_outside(Line(ring.at(0.9), polar(5e-3, 0.9, ring.centre)))
    assert not ring.is_outside(Line(ring.at(0.2), ring.at(2.5))) and not ring.is_outside(Line(ring.centre, away[0]))
