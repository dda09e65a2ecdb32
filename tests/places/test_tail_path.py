"""The tail's middle line: how far a point is from it, against many places on it."""

from __future__ import annotations

import math

import pytest
from tolerance import approx

from sitscad.assembly.places.tail_path import BentStretch, Station, TailPath

WAY = TailPath(
    Station(0.0, 0.0, 0.0),
    (BentStretch(3e-3), BentStretch(1.2e-3, -1.5), BentStretch(2e-3), BentStretch(2e-3, 2.4), BentStretch(1.5e-3, 4.0),
     BentStretch(1e-3)),
)


@pytest.mark.parametrize("turned", [0.0, 2.5])
@pytest.mark.parametrize("x", [-1e-3, 1e-3, 3.5e-3, 4.5e-3, 7e-3])
@pytest.mark.parametrize("z", [-4e-3, -1e-3, 0.0, 0.8e-3])
def test_distance_from_tail_path_is_least_sampled_distance(turned, x, z):
    way = TailPath(Station(0.3e-3, 0.2e-3, turned), WAY.stretches)
    places = (way.at(way.length * i / 5000) for i in range(5001))
    nearest = min(math.hypot(place.x - x, place.z - z) for place in places)
    assert way.distance(x, z) <= nearest + 1e-12
    assert way.distance(x, z) == approx(nearest, abs=2e-6)
