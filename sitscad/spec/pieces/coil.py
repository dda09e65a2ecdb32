"""The coil, and where the coils stand."""

from __future__ import annotations

import math

from sitscad.geometry.shapes import SHAPES, Outline
from sitscad.record import record


@record
class CoilSpec:
    """One coil: all its copper layers in series, one conductor and one net.

    ``size`` is measured across the outer copper edges (polygons: across flats), equal in x and y except for rectangle
    and racetrack. ``layers`` are copper layer numbers from 1 at the top, in winding order; ``turns`` is one number for
    all of them, or those of each.
    """

    shape: str
    size: tuple[float, float]
    turns: float | tuple[float, ...]
    layers: tuple[int, ...]
    trace_width: float
    trace_spacing: float
    start_angle: float = 0.0
    clockwise: bool = False
    corner_radius: float = 0.0

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return SHAPES[self.shape]

    @property
    def layer_turns(self) -> tuple[float, ...]:
        """The turns of each layer, in winding order."""
        return self.turns if isinstance(self.turns, tuple) else (self.turns,) * len(self.layers)

    @property
    def has_unequal_turns(self) -> bool:
        """Whether its layers' turns are written one by one."""
        return isinstance(self.turns, tuple)

    @property
    def most_turns(self) -> float:
        """Turns of the layer that has most."""
        return max(self.layer_turns)

    @property
    def turns_in_words(self) -> str:
        """The turns for people: one number, or those of every layer."""
        return ", ".join(f"{turns:g}" for turns in (self.layer_turns if self.has_unequal_turns else (self.turns,)))

    @property
    def pitch(self) -> float:
        """Trace width plus spacing, in metres."""
        return self.trace_width + self.trace_spacing

    @property
    def outer_diameter(self) -> float:
        """The smaller outer size in metres (the diameter, for round and regular shapes)."""
        return min(self.size)


@record
class CoilPlacement:
    """Where one coil of the array stands: name, centre (m), rotation (rad, counter-clockwise)."""

    name: str
    centre: tuple[float, float]
    rotation: float = 0.0


@record
class ArraySpec:
    """The coils of the sensor, in the order of the converter's channels, from the far end of the jaw to the tail."""

    pattern: str
    placements: tuple[CoilPlacement, ...]
    pitch: float | None = None

    @property
    def middle(self) -> tuple[float, float]:
        """The mean of the coils' centres (m): target and elastomer stand over it unless they are offset."""
        x, y = (math.fsum(place.centre[axis] for place in self.placements) / len(self.placements) for axis in (0, 1))
        return x, y
