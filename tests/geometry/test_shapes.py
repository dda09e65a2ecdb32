"""An outline is one row: what is drawn, estimated and read back of one that no other code has heard of."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from tolerance import approx

import sitscad
from sitscad.estimates import estimated
from sitscad.geometry.shapes import SHAPES, Polygon, nearest_sides
from sitscad.layout import arrange

SPEC = sitscad.SensorSpec.from_mapping(
    name="row",
    coil={"shape": "octagon", "outer_diameter": 8, "turns": 6.25, "layers": 2, "trace_width": "150 um",
          "trace_spacing": "150 um"},
    array={"count": 2},
    fpc={"tail": {"length": 20}},
)


@pytest.fixture
def dodecagon(monkeypatch):
    monkeypatch.setitem(SHAPES, "dodecagon", Polygon("dodecagon", "dodecagonal", 12))
    return "dodecagon"


def in_shape(name):
    return arrange(replace(SPEC, coil=replace(SPEC.coil, shape=name)))


def test_a_new_outline_is_laid_out_estimated_and_checked(dodecagon):
    layout = in_shape(dodecagon)
    assert not layout.shortfalls and all(coil.is_closed_circuit for coil in layout.coils)
    found = {name: estimated(in_shape(name)).coils[0].winding_inductance for name in ("octagon", dodecagon, "circle")}
    # of equal inscribed circles the one with more corners lies nearer to it
    assert found["octagon"] > found[dodecagon] > 0.97 * found["circle"]
    assert found[dodecagon] == approx(found["octagon"], rel=0.05)


def test_a_new_outline_is_drawn_where_its_boundary_says(dodecagon):
    layout = in_shape(dodecagon)
    width = layout.spec.coil.trace_width
    for coil in layout.coils:
        edge = SHAPES[dodecagon].boundary(layout.spec.coil.size, 0.0)
        assert len(edge.segments) == 13
        for winding in coil.windings:
            inside = winding.path.shifted(-coil.centre.x, -coil.centre.y)
            assert min(edge.distance(s.start) for s in inside) == approx(width / 2, rel=1e-6)


def test_features_of_outlines():
    assert (SHAPES["circle"].ends, SHAPES["rectangle"].ends, SHAPES["racetrack"].ends) == (None, 4, 2)
    assert SHAPES["racetrack"].is_long and not SHAPES["hexagon"].is_long
    assert SHAPES["hexagon"].area == approx(math.sqrt(3) / 2, rel=1e-6)
    assert SHAPES["octagon"].shrinks == approx(16 * math.tan(math.pi / 8), rel=1e-6)


def test_the_nearest_numbers_of_sides():
    assert nearest_sides({0, 4, 6, 8}, 6) == (6,) and nearest_sides({0, 4, 6, 8}, 0) == (0,)
    assert nearest_sides({0, 4, 6, 8}, 5) == (4, 6) and nearest_sides({0, 4, 6, 8}, 12) == (8,)
