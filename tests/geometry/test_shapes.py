"""An outline is one row: what is drawn, estimated and read back of one that no other code has heard of."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from tolerance import approx

import sitscad
from sitscad.estimates import estimate_layout
from sitscad.kernels.geometry.shapes import PLATES, SHAPES, Polygon, Racetrack, Round
from sitscad.layout import arrange

COIL = {"shape": "octagon", "outer_diameter": 8, "turns": 6.25, "layers": 2, "trace_width": "150 um",
        "trace_spacing": "150 um"}
SPEC = sitscad.SensorSpec.from_mapping(
    name="row",
    coil=COIL,
    array={"count": 2},
    fpc={"tail": {"length": 20}},
)


@pytest.fixture
def dodecagon(monkeypatch):
    monkeypatch.setitem(SHAPES, "dodecagon", Polygon("dodecagon", "dodecagonal", 12, bounds=("octagon",)))
    return "dodecagon"


def in_shape(name):
    return arrange(replace(SPEC, coil=replace(SPEC.coil, shape=name)))


@pytest.mark.slow
def test_new_outline_is_laid_out_estimated_and_checked(dodecagon):
    layout = in_shape(dodecagon)
    assert not layout.shortfalls and all(coil.is_closed_circuit for coil in layout.coils)
    result = {name: estimate_layout(in_shape(name)).coils[0].winding_inductance
              for name in ("octagon", dodecagon, "circle")}
    # of equal inscribed circles the one with more corners lies nearer to it
    assert result["octagon"] > result[dodecagon] > 0.97 * result["circle"]
    assert result[dodecagon] == approx(result["octagon"], rel=0.05)


def test_new_outline_is_drawn_at_its_boundary(dodecagon):
    layout = in_shape(dodecagon)
    width = layout.spec.coil.trace_width
    for coil in layout.coils:
        edge = SHAPES[dodecagon].boundary(layout.spec.coil.size, 0.0)
        assert len(edge.segments) == 13
        for winding in coil.windings:
            inside = winding.path.shifted(-coil.centre.x, -coil.centre.y)
            assert min(edge.distance(s.start) for s in inside) == approx(width / 2, rel=1e-6)


def test_outline_properties_match_each_shape():
    assert [SHAPES[name].ends_per_turn for name in ("circle", "rectangle", "racetrack")] == [None, 4, 2]
    assert SHAPES["racetrack"].is_long and not SHAPES["hexagon"].is_long
    assert SHAPES["hexagon"].area == approx(math.sqrt(3) / 2, rel=1e-6)
    assert SHAPES["octagon"].turn_shortening == approx(16 * math.tan(math.pi / 8), rel=1e-6)


class Ring(Round):
    """A disc with a hole, of which nothing is declared: it inherits the features of a circle."""


class Ellipse(Racetrack):
    """A curve that inherits the features of a racetrack."""


@pytest.mark.parametrize(
    ("name", "row"), [("circle", Ring("ring", "annular")), ("racetrack", Ellipse("ellipse", "elliptic", is_long=True))]
)
def test_coil_shape_without_error_bounds_is_refused_by_name(name, row, monkeypatch):
    monkeypatch.setitem(SHAPES, name, row)
    coil = {**COIL, "shape": name, "outer_diameter": [9, 6] if row.is_long else 8, "turns": 6}
    with pytest.raises(sitscad.SpecError) as refused:
        sitscad.SensorSpec.from_mapping(name="row", coil=coil, fpc={"tail": {"length": 20}})
    findings = [f for f in refused.value.findings if (f.rule, f.key) == ("SIT009", "coil.shape")]
    assert len(findings) == 1 and row.name in findings[0].message


@pytest.mark.parametrize("key", ["target", "elastomer", "mount.finger"])
def test_plate_shape_without_form_is_refused_by_name(key, monkeypatch):
    monkeypatch.setitem(PLATES, "circle", Ring("ring", "annular"))
    plates = {"target": {"size": 8, "shape": "square"}, "elastomer": {"thickness": 1, "size": 8, "shape": "square"},
              "mount": {"kind": "fingertip", "finger": {"shape": "rectangle"}}}
    (plates["mount"]["finger"] if key == "mount.finger" else plates[key])["shape"] = "circle"
    with pytest.raises(sitscad.SpecError) as refused:
        sitscad.SensorSpec.from_mapping(name="row", coil=COIL, fpc={"tail": {"length": 20}}, **plates)
    assert ("SIT009", f"{key}.shape") in {(f.rule, f.key) for f in refused.value.findings}
    assert any("ring" in f.message for f in refused.value.findings)


def test_shape_without_required_methods_raises_value_error_when_used():
    """A program that exchanges the row of a loaded spec meets the same refusal."""
    for ask in (lambda: Ring("ring", "annular").is_disc, lambda: Ring("ring", "annular").shapes_with_bounds):
        with pytest.raises(ValueError, match="'ring'"):
            ask()


def test_spec_shapes_declare_needed_features():
    assert all(row.shapes_with_bounds == (name,) for name, row in SHAPES.items())
    assert {name: row.is_disc for name, row in PLATES.items()} == {"circle": True, "square": False, "rectangle": False}
