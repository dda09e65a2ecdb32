"""The lead ring around a coil: where it passes a point, and how leads leave it."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from tolerance import approx

from sitscad.checks.judging import RULES
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Point, polar
from sitscad.kernels.geometry.shapes import SHAPES, Polygon
from sitscad.layout import lay_out
from sitscad.layout.board import Role
from sitscad.layout.gaps import copper_of, too_near
from sitscad.layout.lanes import Ring
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.load import load_text


def ring(sensor, rotation=0.0, **coil):
    return Ring(sensor(**coil).coil, CoilPlacement("C1", (1e-3, 2e-3), rotation), 0.2e-3)


@pytest.mark.parametrize("rotation", [0.0, 0.7])
def test_ring_points_nearest_to_corner_lie_on_both_sides(sensor, rotation):
    square = ring(sensor, rotation, shape="square", diameter=4e-3)
    corner = polar(2e-3 * math.sqrt(2.0), math.pi / 4 + rotation, square.centre)
    first, second = square.facing(corner)
    assert first < math.pi / 4 + rotation < second
    for angle in (first, second):
        assert square.at(angle).distance(corner) == approx(0.2e-3, rel=1e-6)


def test_ring_point_facing_long_side_is_perpendicular_to_it(sensor):
    long = ring(sensor, shape="racetrack", size=(10e-3, 4e-3))
    point = Point(1e-3 + 2e-3, 2e-3 + 2e-3)
    first, second = long.facing(point)
    assert first == approx(second, rel=1e-6)
    assert long.at(first).x == approx(point.x, rel=1e-6) and long.at(first).y == approx(point.y + 0.2e-3, rel=1e-6)


def test_round_ring_faces_point_radially(sensor):
    round_ring = ring(sensor)
    assert round_ring.facing(Point(1e-3, 5e-3)) == approx((math.pi / 2, math.pi / 2), rel=1e-6)


@pytest.mark.parametrize(
    "coil",
    [
        {"shape": "racetrack", "size": (11e-3, 4e-3), "turns": 6.5, "layers": 4, "coils": 1},
        {"shape": "square", "diameter": 7e-3, "turns": 11, "layers": 2, "pitch": 8.5e-3, "stackup": "flex-2l-18um"},
        {"shape": "hexagon", "diameter": 6e-3, "turns": 6.0, "layers": 2, "pitch": 8e-3, "stackup": "flex-2l-18um"},
    ],
)
def test_leads_never_bend_back_sharply(sensor, coil):
    """Corners of less than 70 degrees hold etchant, and a lead at a slant stays too near the turn that it leaves."""
    layout = lay_out(sensor(**coil))
    assert layout.shortfalls == ()
    for trace in layout.traces:
        if trace.role is Role.LEAD:
            pieces = trace.path.segments
            for before, after in pairwise(pieces):
                assert bend(before, after) > math.radians(70.0), (trace.layer, before.end)


@pytest.mark.parametrize(
    "text",
    [
        "coil: {outer_diameter: 3.5, turns: 5, layers: 2, trace_width: 150 um, trace_spacing: 150 um, shape: octagon}",
        """coil: {outer_diameter: 5, turns: 3, layers: 4, trace_width: 100 um, trace_spacing: 100 um, shape: octagon}
fpc: {rules: generic-fine, stackup: flex-4l, tail: {length: 5, connector: zif-0.5mm}}""",
    ],
)
def test_octagon_stubs_keep_clearance(text):
    """Their via stood beside the end of a last side of no length, and their lead bent at a corner beside a stub."""
    layout = lay_out(load_text(f"sitscad: 1\nname: octagon\n{text}\n", "octagon.yaml"))
    assert layout.shortfalls == ()
    drawn = next(rule for rule in RULES if rule.id == "SIT108")
    assert apply_rule(drawn, Design(layout.spec, layout))[0] == []


def bend(before, after):
    """The angle between two pieces that follow each other (rad); pi: straight on."""
    a, b = before.at(1.0 - 1e-4), after.at(1e-4)
    corner = before.end
    first, second = (math.atan2(p.y - corner.y, p.x - corner.x) for p in (a, b))
    return abs(math.remainder(first - second, 2.0 * math.pi))


def test_exits_of_long_coil_are_at_its_end(sensor):
    """All exits lie on the half circle that faces the tail, and no lead turns round to reach one."""
    layout = lay_out(sensor(shape="racetrack", size=(11e-3, 4e-3), turns=6.5, layers=4, coils=1))
    ways = [t.path for t in layout.traces if t.role is Role.LEAD and t.path.segments[0].start.x > 5.5e-3]
    assert ways and all(abs(point.y) <= 2.6e-3 for path in ways for point in (path.start, path.end))


def test_ring_of_rotated_coil_is_rotated(sensor):
    straight, turned = ring(sensor, shape="hexagon"), ring(sensor, 0.3, shape="hexagon")
    assert turned.at(1.3).distance(turned.centre) == approx(straight.at(1.0).distance(straight.centre), rel=1e-6)
    assert replace(turned, placement=straight.placement) == straight


@pytest.mark.parametrize("turn", [0.0, 0.5 * math.pi, math.pi])
def test_ring_half_size_includes_farthest_corner(sensor, monkeypatch, turn):
    """Of a pentagon the board ended before the corner that has a side across from it."""
    monkeypatch.setitem(SHAPES, "square", Polygon("square", "pentagonal", 5, bounds=("square", "hexagon")))
    at = CoilPlacement("C1", (0.0, 0.0), turn)
    pentagon = replace(ring(sensor, shape="square", diameter=4e-3), placement=at)
    points = [pentagon.at(2.0 * math.pi * k / 720) for k in range(720)]
    reach = max(abs(point.x) for point in points), max(abs(point.y) for point in points)
    assert pentagon.half_size == approx(reach, rel=1e-4)


@pytest.mark.parametrize("coils, shape, turns", [(3, "racetrack", 3.0), (4, "racetrack", 3.5), (3, "rectangle", 3.0)])
def test_long_coil_leads_in_line_never_cross_own_winding(sensor, coils, shape, turns):
    """A lead that left its ring on the side turned away from its lane was drawn straight across the coil's turns."""
    spec = sensor(shape=shape, size=(11.2e-3, 2.2e-3), turns=turns, width=76e-6, spacing=76e-6, coils=coils,
                  pitch=12.1e-3)
    layout = lay_out(spec)
    assert not layout.shortfalls
    assert not list(too_near(copper_of(layout), 75e-6, 75e-6))
