"""The fast methods' stated bounds against a slow, converged integral of our own."""

from __future__ import annotations

from types import SimpleNamespace

import neumann_reference
import pytest
from windings import MM, UM, coil

from sitscad.estimates.windings import METHODS, WindingGeometry
from sitscad.physics.spirals import Resolution, spiral_inductance_matrix

# diameter (mm), turns, width, spacing, layer distance (0: one layer), copper (um)
DESIGNS = [
    (7, 3, 100, 100, 0, 35),
    (4, 2.25, 300, 100, 0, 18),
    (3, 0.5, 300, 100, 0, 35),
    (3, 0.5, 100, 100, 60, 35),
    (4, 1.5, 100, 100, 60, 35),
    (5, 0.75, 300, 200, 60, 35),
    (12, 0.75, 900, 100, 60, 9),
    (3, 1.5, 300, 200, 400, 9),
    (2, 3.3, 100, 100, 100, 18),
    (3.5, 6.5, 100, 100, 60, 35),
]


@pytest.fixture(scope="module", params=DESIGNS, ids=lambda d: f"{d[0]}mm-{d[1]}-{d[2]}-{d[3]}-{d[4]}")
def case(request):
    diameter, turns, width, spacing, apart, copper = request.param
    heights = (0.0,) if apart == 0 else (0.0, -apart * UM)
    layers = coil(diameter * MM, turns, width * UM, spacing * UM, heights, [copper * UM] * len(heights))
    spec = SimpleNamespace(shape="circle", turns=turns, outer_diameter=diameter * MM, trace_width=width * UM,
                           trace_spacing=spacing * UM, pitch=(width + spacing) * UM, layers=(1,) * len(layers),
                           corner_radius=0.0)  # fmt: skip
    return WindingGeometry(spec, tuple(layers), ()), neumann_reference.converged(layers)


@pytest.mark.parametrize(
    "method", [m for m in METHODS if "circle" in m.shapes and not m.is_cross_check], ids=lambda m: m.name
)
def test_the_stated_bound_holds(case, method):
    geometry, exact = case
    if not method.is_valid(geometry):
        assert method.error(geometry) > 1e-2
        return
    assert abs(method.solve(geometry) / exact - 1.0) <= method.error(geometry)


def test_the_default_is_within_two_parts_in_ten_thousand(case):
    geometry, exact = case
    assert METHODS[0].solve(geometry) == pytest.approx(exact, rel=2.5e-4)


def test_the_yardstick_itself_is_converged():
    layers = coil(4 * MM, 1.5, 100 * UM, 100 * UM, (0.0, -60 * UM), (35 * UM, 18 * UM))
    three, five = (neumann_reference.winding(layers, strips=q) for q in (3, 5))
    limit = neumann_reference.converged(layers)
    assert abs(five - limit) < abs(three - limit) < 3e-4 * limit
    assert neumann_reference.converged(layers, panels=12) == pytest.approx(limit, rel=2e-6)
    assert spiral_inductance_matrix(layers, Resolution(40, 30, 4)).sum() == pytest.approx(limit, rel=2e-6)
