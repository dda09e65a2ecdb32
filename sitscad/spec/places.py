"""Where elastomer and target lie from above: over the mean of the coils' centres, or offset from it."""

from __future__ import annotations

import math

from sitscad.geometry.footprint import Footprint
from sitscad.geometry.path import Point
from sitscad.spec.sensor import ElastomerPad, SensorSpec, Target


def footprint(spec: SensorSpec, plate: Target | ElastomerPad) -> Footprint:
    """The place of a plate, the target at rest."""
    (x, y), (dx, dy) = spec.array.middle, plate.offset
    is_round = plate.outline.is_round
    rotation = plate.rotation if isinstance(plate, Target) and not is_round else 0.0
    return Footprint(is_round, plate.size, Point(x + dx, y + dy), rotation)


def shared_middles(spec: SensorSpec) -> tuple[Point, ...]:
    """By coil, the middle of the box that it has in common with the target at rest, from the mean of the coils'
    centres; of a coil beside the target the nearest place of it.
    """
    target, (mx, my) = spec.target, spec.array.middle
    assert target is not None
    found = []
    for placement in spec.array.placements:
        sides = zip(placement.centre, (mx, my), spec.coil.size, target.offset, target.size, strict=True)
        found.append(Point(*(_shared(c - m, size, offset, across) for c, m, size, offset, across in sides)))
    return tuple(found)


def _shared(centre: float, size: float, offset: float, across: float) -> float:
    """The middle of what a coil's side and a target's side have in common along one axis (m)."""
    low, high = (min(max(centre + 0.5 * way * size, offset - 0.5 * across), offset + 0.5 * across) for way in (-1, 1))
    return 0.5 * (low + high)


def place_in_words(plate: Target | ElastomerPad) -> str:
    """Where a plate is offset and turned to, for those who mount it; nothing where it stands straight over the mean."""
    words = []
    if any(plate.offset):
        x, y = (f"{length * 1e3:.6g}" for length in plate.offset)
        words.append(f"centre [{x}, {y}] mm from the coils' mean")
    if isinstance(plate, Target) and plate.rotation and not plate.outline.is_round:
        words.append(f"turned by {math.degrees(plate.rotation):.6g} deg")
    return ", ".join(words)
