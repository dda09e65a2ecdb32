"""The coils wound and joined inside, before they are led out; the search for the inner vias is done once for all."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from sitscad.finding import Shortfall
from sitscad.geometry.path import Point
from sitscad.layout import shortfalls as room
from sitscad.layout.board import Winding
from sitscad.layout.clearance import Hole
from sitscad.layout.routing.lanes import Bus
from sitscad.layout.winding.inner_vias import InnerJoin, Inside, place_inner_vias
from sitscad.layout.winding.windings import inner_clear_radius, wind_coil
from sitscad.record import record
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.sensor import SensorSpec


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
    joined: dict[float, tuple[tuple[InnerJoin, ...], tuple[Shortfall, ...]]] = {}
    for placement in spec.array.placements:
        if placement.rotation not in joined:
            joined[placement.rotation] = _joined_inside(spec, bus, placement)
        joins, shortfalls = joined[placement.rotation]
        moved = tuple(_moved(join, *placement.centre) for join in joins)
        wound.append(WoundCoil(wind_coil(spec, placement), moved, _way_out_layer(spec), shortfalls))
    return tuple(wound)


def _joined_inside(
    spec: SensorSpec, bus: Bus, placement: CoilPlacement
) -> tuple[tuple[InnerJoin, ...], tuple[Shortfall, ...]]:
    """The joins of a coil's layers inside it, and what found no room."""
    coil, rules, centre = spec.coil, spec.fpc.rules, Point(0.0, 0.0)
    windings = wind_coil(spec, replace(placement, centre=centre))
    if len(windings) % 2 and _way_out_layer(spec) is None:
        return (), (room.no_way_out(spec),)
    clear = inner_clear_radius(coil, windings, centre)
    inside = Inside(centre, clear, coil.size[0] - coil.size[1], placement.rotation)
    widths = coil.trace_width, rules, bus.spacing, coil.trace_spacing
    joins = _inner_joins(windings, coil.layer_turns, inside, *widths)
    if joins is None:
        return (), (room.no_inner_room(spec, bus, clear, (len(windings) + 1) // 2),)
    return joins, ()


_inner_joins = lru_cache(maxsize=64)(place_inner_vias)
# Coils that differ in their place only share it, and so do boards that are tried to find out what helps.


def _moved(join: InnerJoin, dx: float, dy: float) -> InnerJoin:
    return InnerJoin(
        Hole(join.hole.centre.shifted(dx, dy), join.hole.pad, join.hole.drill),
        tuple((layer, path.shifted(dx, dy)) for layer, path in join.stubs),
    )


def _way_out_layer(spec: SensorSpec) -> int | None:
    """The copper layer on which a coil with an odd number of layers comes out from under its turns."""
    if len(spec.coil.layers) % 2 == 0:
        return None
    free = [layer.number for layer in spec.fpc.stackup.copper if layer.number not in spec.coil.layers]
    return next((number for number in free if number == 2), free[0] if free else None)
