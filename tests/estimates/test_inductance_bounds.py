"""The bounds of the inductance methods: how they go with a coil's dimensions."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.estimates.windings.methods import UNFITTED, WindingDimensions, error_bound
from sitscad.kernels.geometry.shapes import SHAPES, Polygon

COIL = WindingDimensions(12.0, 100e-6, 200e-6, 35e-6, 1.05e-3, 7e-3, (0.0, -60e-6))
PAIRS = [("circle", "spiral-neumann"), ("square", "strands"), ("racetrack", "strands"), ("pentagon", "strands"),
         ("rounded", "strands")]


def of(family):
    """The coil in another outline; polygons with rounded corners are as many-sided as one likes."""
    if family == "rounded":
        return replace(COIL, corner_radius=300e-6, shape=PENTAGON)
    return replace(COIL, shape=PENTAGON if family == "pentagon" else SHAPES[family])


PENTAGON = Polygon("pentagon", "pentagonal", 5, bounds=("square", "hexagon"))


def test_bench_coil_error_bound_is_below_one_hundredth_percent():
    assert error_bound("spiral-neumann", COIL) < 1e-4


@pytest.mark.parametrize(("family", "method"), PAIRS)
@given(factor=st.floats(1.01, 4.0))
def test_error_bound_grows_with_crowded_or_additional_tracks(family, method, factor):
    coil, bound = of(family), error_bound(method, of(family))
    more = (
        replace(coil, inner_radius=coil.inner_radius / factor),
        replace(coil, heights=tuple(z / factor for z in coil.heights)),
        replace(coil, heights=(*coil.heights, -120e-6, -180e-6)),
        replace(coil, pitch=max(coil.width, coil.pitch / factor)),
    )
    for worse in more:
        assert error_bound(method, worse) >= bound * (1.0 - 1e-12)


@pytest.mark.parametrize(("family", "method"), PAIRS)
@given(scale=st.floats(1e-3, 1e3))
def test_error_bound_is_independent_of_scale(family, method, scale):
    coil = of(family)
    scaled = WindingDimensions(coil.turns, coil.width * scale, coil.pitch * scale, coil.thickness * scale,
                      coil.inner_radius * scale, coil.size * scale, tuple(z * scale for z in coil.heights),
                      coil.corner_radius * scale, coil.shape)
    assert error_bound(method, scaled) == approx(error_bound(method, coil), rel=1e-9)


def test_thick_tracks_increase_error_bound():
    thick = replace(COIL, thickness=300e-6)
    square = replace(COIL, thickness=100e-6)
    gained = error_bound("spiral-neumann", thick) - error_bound("spiral-neumann", square)
    assert gained == approx(8e-4, rel=1e-6)


def test_error_bound_is_at_least_reference_accuracy():
    """Of a hexagon of 156 narrow turns 3.8e-7 was promised, and its error is 7.3e-7."""
    many = WindingDimensions(156.5, 20e-6, 60e-6, 10e-6, 5e-3, 30e-3, (0.0,))
    assert error_bound("strands", replace(many, shape=SHAPES["hexagon"])) >= 1e-6


def test_unfitted_polygon_has_enlarged_bound_of_neighbour_polygons():
    fitted = ("square", "hexagon", "octagon")
    bounds = {name: error_bound("strands", replace(COIL, shape=SHAPES[name])) for name in fitted}
    assert error_bound("strands", replace(COIL, shape=PENTAGON)) == approx(
        UNFITTED * max(bounds["square"], bounds["hexagon"]), rel=1e-6)
    many = Polygon("hendecagon", "hendecagonal", 11, bounds=("octagon",))
    assert error_bound("strands", replace(COIL, shape=many)) == approx(UNFITTED * bounds["octagon"], rel=1e-6)


def test_unsuitable_method_gives_key_error():
    with pytest.raises(KeyError):
        error_bound("strands", COIL)


def test_error_bounds_are_positive_and_below_a_tenth():
    for family, method in PAIRS:
        for turns in (0.25, 0.5, 1.0, 3.0, 30.0, 200.0):
            bound = error_bound(method, replace(of(family), turns=turns))
            assert 0.0 < bound < 0.1 and math.isfinite(bound)
