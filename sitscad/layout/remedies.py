"""What would make a board route: one dimension changed, by the least amount with which trying it succeeds.

A closed formula says what one via needs; where leads, vias and other coils share the room only trying is honest. So a
number in a finding is one that was tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations

from sitscad.geometry.spiral import CORNERS
from sitscad.layout.lanes import bus_for
from sitscad.layout.wound_coils import wind_all
from sitscad.spec.presets import connector, names
from sitscad.spec.sensor import SensorSpec

GROWTH, MOST = 1.7, 5
"""What is missing is tried, then so many times as much, at most so often."""

GRAIN = 10e-6
"""Amounts are rounded up to this (m)."""

TURNED = (15.0, 30.0, 45.0, 90.0, 135.0, 180.0, 270.0)
"""Start angles (degrees) that are tried, counted from the spec's."""

Works = Callable[[SensorSpec], bool]


def wider_coil(spec: SensorSpec, by: float) -> SensorSpec:
    """The spec with coils larger by so much (m) across, their gaps kept."""
    grown = replace(spec.coil, size=(spec.coil.size[0] + by, spec.coil.size[1] + by))
    return replace(wider_array(spec, by), coil=grown)


def wider_array(spec: SensorSpec, by: float) -> SensorSpec:
    """The spec with its array enlarged so that the nearest coils stand farther apart by so much (m)."""
    near = nearest_distance(spec)
    if near is None:
        return spec
    scale = 1.0 + by / near
    placements = tuple(replace(p, centre=(p.centre[0] * scale, p.centre[1] * scale)) for p in spec.array.placements)
    pitch = None if spec.array.pitch is None else spec.array.pitch + by
    return replace(spec, array=replace(spec.array, placements=placements, pitch=pitch))


def nearest_distance(spec: SensorSpec) -> float | None:
    """Distance (m) of the centres of the two nearest coils; None for one alone."""
    return min((math.dist(a.centre, b.centre) for a, b in combinations(spec.array.placements, 2)), default=None)


def least(spec: SensorSpec, change: Callable[[SensorSpec, float], SensorSpec], works: Works,
          first: float) -> float | None:  # fmt: skip
    """The least amount (m), as far as a few trials tell, with which the changed spec works; None where none does."""
    failed, amount = 0.0, _rounded(first)
    for _ in range(MOST):
        if works(change(spec, amount)):
            return _between(spec, change, works, failed, amount)
        failed, amount = amount, _rounded(GROWTH * amount)
    return None


def _between(spec: SensorSpec, change: Callable[[SensorSpec, float], SensorSpec], works: Works, low: float,
             high: float) -> float:  # fmt: skip
    for _ in range(2):
        middle = _rounded(0.5 * (low + high))
        if low == 0.0 or middle >= high:
            break
        if works(change(spec, middle)):
            high = middle
        else:
            low = middle
    return high


def _rounded(amount: float) -> float:
    return max(GRAIN, math.ceil(amount / GRAIN - 1e-6) * GRAIN)


def inner_vias_fit(spec: SensorSpec) -> bool:
    """Whether all vias inside the coils find a place."""
    return not any(finding.rule == "SIT112" for finding in wind_all(spec, bus_for(spec))[0].findings)


def start_angle(spec: SensorSpec, works: Works) -> float | None:
    """A start angle (rad) with which the spec works; None where none of those tried does."""
    for turned in _angles(spec):
        angle = (spec.coil.start_angle + turned) % (2.0 * math.pi)
        if works(replace(spec, coil=replace(spec.coil, start_angle=angle))):
            return angle
    return None


def _angles(spec: SensorSpec) -> Iterator[float]:
    # A polygon begins at a corner: any angle between two of them is the same.
    corners = CORNERS.get(spec.coil.shape)
    if corners:
        yield from (2.0 * math.pi * k / corners for k in range(1, corners))
    elif spec.coil.shape == "circle":
        yield from map(math.radians, TURNED)
    else:
        yield math.pi


def other_connector(spec: SensorSpec, works: Works) -> str | None:
    """The connector of the next wider pitch with which the spec works; None where none does, or there is no tail."""
    tail = spec.fpc.tail
    if tail is None:
        return None
    for name in sorted(names("connector"), key=lambda name: connector(name).pitch):
        wider = connector(name)
        changed = replace(spec, fpc=replace(spec.fpc, tail=replace(tail, connector=wider)))
        if wider.pitch > tail.connector.pitch + 1e-9 and works(changed):
            return name
    return None
