"""Spirals that begin in the middle of a side: the stated bound of the inductance against the volume integral."""

from __future__ import annotations

from dataclasses import replace

import designs
import pytest

from sitscad.estimates.windings.methods import METHODS, WindingGeometry
from sitscad.kernels.geometry.shapes import SHAPES

# number 18 is the half turn that exceeds the bound of spirals from corner to corner
CASES = [("square", 4), ("square", 18), ("square", 70), ("rectangle", 2), ("rectangle", 4), ("rectangle", 226)]


@pytest.mark.parametrize(("family", "number"), CASES)
def test_inductance_of_mid_side_spiral_is_within_error_bound(family, number):
    corner = designs.design(family, number)
    heights = tuple(conductor.z for conductor in corner.conductors)
    coil = designs.built(replace(corner.spec, is_mid_side=True), heights, corner.conductors[0].thickness)
    exact, geometry = designs.exact(coil), WindingGeometry(coil.spec, coil.spirals, coil.drawn)
    compared = 0
    for method in METHODS:
        if method.serves(SHAPES[coil.spec.shape]) and not method.is_cross_check and method.is_valid(geometry):
            assert abs(method.solve(geometry) / exact - 1.0) <= method.error(geometry)
            compared += 1
    assert compared
    assert abs(designs.exact(corner) / exact - 1.0) > 1e-3  # it is another coil than that from corner to corner
