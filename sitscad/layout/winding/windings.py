"""The windings of one coil: every layer's spiral, so joined that the current circulates one way through all of them."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

from sitscad.geometry.path import Point
from sitscad.geometry.spiral import SpiralDimensions
from sitscad.layout.board import Winding
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.stackup import CopperLayer


def wind_coil(spec: SensorSpec, placement: CoilPlacement) -> tuple[Winding, ...]:
    """The coil's layers in winding order: odd ones walked inwards, even ones mirrored and walked outwards."""
    wound = _wind(spec.coil, tuple(spec.coil_copper), placement.rotation)
    return tuple(replace(winding, path=winding.path.shifted(*placement.centre)) for winding in wound)


@lru_cache(maxsize=16)
def _wind(coil: CoilSpec, layers: tuple[CopperLayer, ...], rotation: float) -> tuple[Winding, ...]:
    """The windings of a coil about the origin: the coils of an array differ in their places alone."""
    sense = -1 if coil.clockwise else 1
    sweeps = [sense * 2.0 * math.pi * turns for turns in coil.layer_turns]
    angle = coil.outline.start(coil.start_angle, sense)
    windings = []
    for index, copper in enumerate(layers):
        inward = index % 2 == 0
        if not inward:
            angle += sweeps[index - 1] + sweeps[index]  # on to the inner end of the layer before, and out as far again
        layer_sense = sense if inward else -sense
        dimensions = SpiralDimensions(coil.size, coil.trace_width, coil.pitch, coil.layer_turns[index])
        path = coil.outline.wind(dimensions, angle, layer_sense, coil.corner_radius)
        path = path if inward else path.reversed()
        path = path.rotated(rotation) if rotation else path
        windings.append(Winding(copper.number, copper.z, copper.thickness, angle + rotation, layer_sense, inward, path))
    return tuple(windings)


def inner_clear_radius(coil: CoilSpec, windings: tuple[Winding, ...], centre: Point) -> float:
    """Radius (m) of the largest circle about the centre that no turn's copper enters."""
    return min(winding.path.distance(centre) for winding in windings) - coil.trace_width / 2
