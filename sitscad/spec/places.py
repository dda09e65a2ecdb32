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


def place_in_words(plate: Target | ElastomerPad) -> str:
    """Where a plate is offset and turned to, for those who mount it; nothing where it stands straight over the mean."""
    words = []
    if any(plate.offset):
        x, y = (f"{length * 1e3:.6g}" for length in plate.offset)
        words.append(f"centre [{x}, {y}] mm from the coils' mean")
    if isinstance(plate, Target) and plate.rotation and not plate.outline.is_round:
        words.append(f"turned by {math.degrees(plate.rotation):.6g} deg")
    return ", ".join(words)
