"""The coils wound and joined inside, before they are led out.

Every layer's spiral is joined to the next, so that the current circulates one way through all of them; the search for
the inner vias is done once for all coils of a rotation.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

from sitscad.finding import Missing, Shortfall
from sitscad.geometry.path import Point
from sitscad.geometry.shapes import CHORD_TOLERANCE, SpiralDimensions
from sitscad.layout.board import Winding
from sitscad.layout.inner_vias import InnerJoin, Inside, place_inner_vias, room_needed
from sitscad.layout.lanes import Bus
from sitscad.record import record
from sitscad.spec.circuit import CopperLayer
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.sensor import SensorSpec


def wind_coil(spec: SensorSpec, placement: CoilPlacement, tolerance: float = CHORD_TOLERANCE) -> tuple[Winding, ...]:
    """The coil's layers in winding order: odd ones walked inwards, even ones mirrored and walked outwards; curves drawn
    within a tolerance (m).
    """
    wound = _wind(spec.coil, tuple(spec.coil_copper), placement.rotation, tolerance)
    if placement.centre == (0.0, 0.0):
        return wound
    return tuple(replace(winding, path=winding.path.shifted(*placement.centre)) for winding in wound)


@lru_cache(maxsize=16)
def _wind(coil: CoilSpec, layers: tuple[CopperLayer, ...], rotation: float, tolerance: float) -> tuple[Winding, ...]:
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
        dimensions = SpiralDimensions(coil.size, coil.trace_width, coil.pitch, coil.layer_turns[index], tolerance)
        path = coil.outline.wind(dimensions, angle, layer_sense, coil.corner_radius)
        path = path if inward else path.reversed()
        path = path.rotated(rotation) if rotation else path
        windings.append(Winding(copper.number, copper.z, copper.thickness, angle + rotation, layer_sense, inward, path))
    return tuple(windings)


@record
class WoundCoil:
    """A coil before it is led out: its windings, the joins inside, and what could not be placed."""

    windings: tuple[Winding, ...]
    inner: tuple[InnerJoin, ...]
    way_out_layer: int | None
    shortfalls: tuple[Shortfall, ...]


def wind_all(spec: SensorSpec, bus: Bus) -> tuple[WoundCoil, ...]:
    """Every coil wound and joined inside; the search for the vias is done once a rotation, about the origin."""
    wound = []
    # the copper layer on which a coil with an odd number of layers comes out from under its turns: the second if free
    free = [layer.number for layer in spec.fpc.stackup.copper if layer.number not in spec.coil.layers]
    out = next((number for number in free if number == 2), free[0] if free else None)
    way_out = out if len(spec.coil.layers) % 2 else None
    joined: dict[float, tuple[tuple[InnerJoin, ...], tuple[Shortfall, ...]]] = {}
    for placement in spec.array.placements:
        if placement.rotation not in joined:
            joined[placement.rotation] = _joined_inside(spec, bus, placement, way_out)
        joins, shortfalls = joined[placement.rotation]
        moved = tuple(join.shifted(*placement.centre) for join in joins)
        wound.append(WoundCoil(wind_coil(spec, placement), moved, way_out, shortfalls))
    return tuple(wound)


def _joined_inside(
    spec: SensorSpec, bus: Bus, placement: CoilPlacement, way_out: int | None
) -> tuple[tuple[InnerJoin, ...], tuple[Shortfall, ...]]:
    """The joins of a coil's layers inside it, and what found no room."""
    coil, stackup, rules, centre = spec.coil, spec.fpc.stackup, spec.fpc.rules, Point(0.0, 0.0)
    windings = wind_coil(spec, replace(placement, centre=centre))
    if len(windings) % 2 and way_out is None:  # it ends inside, and no copper layer is left to come out on
        layers = len(coil.layers)
        have, named = float(len(stackup.copper)), (("count", layers), ("stackup", stackup.name))
        return (), (Shortfall(Missing.WAY_OUT, have, float(layers + 1), "copper layers", facts=named),)
    clear = min(winding.path.distance(centre) for winding in windings) - coil.trace_width / 2  # no turn's copper enters
    inside = Inside(centre, clear, coil.size[0] - coil.size[1], placement.rotation)
    widths = coil.trace_width, rules, bus.spacing, coil.trace_spacing
    joins = _inner_joins(windings, coil.layer_turns, inside, *widths)
    if joins is not None:
        return joins, ()
    need = max(2.0 * clear, room_needed(1, rules, bus.spacing))
    facts = (("count", (len(windings) + 1) // 2), ("clear", max(0.0, 2.0 * clear) * 1e3))
    return (), (Shortfall(Missing.INNER_ROOM, 2.0 * clear, need, "m", facts=facts),)


_inner_joins = lru_cache(maxsize=64)(place_inner_vias)
# Coils that differ in their place only share it, and so do boards that are tried to find out what helps.
