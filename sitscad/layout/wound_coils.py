"""The coils wound and joined inside, before they are led out; the search for the inner vias is done once for all."""

from __future__ import annotations

from dataclasses import dataclass

from sitscad.finding import Finding
from sitscad.geometry.path import Point
from sitscad.layout import room
from sitscad.layout.board import Winding
from sitscad.layout.clearance import Hole
from sitscad.layout.inner_vias import InnerJoin, Inside, place_inner_vias
from sitscad.layout.lanes import Bus
from sitscad.layout.windings import inner_clear_radius, wind_coil
from sitscad.spec.sensor import SensorSpec


@dataclass(frozen=True)
class WoundCoil:
    """A coil before it is led out: its windings, the joins inside, and what could not be placed."""

    windings: tuple[Winding, ...]
    inner: tuple[InnerJoin, ...]
    way_out_layer: int | None
    findings: tuple[Finding, ...]


def wind_all(spec: SensorSpec, bus: Bus) -> tuple[WoundCoil, ...]:
    """Every coil wound and joined inside; the search for the vias is done once, on the first coil, and shifted."""
    first = spec.array.placements[0]
    windings = wind_coil(spec, first)
    centre = Point(*first.centre)
    spare = _way_out_layer(spec)
    findings: list[Finding] = []
    joins: tuple[InnerJoin, ...] = ()
    if len(windings) % 2 and spare is None:
        findings.append(room.no_way_out(spec))
    if len(windings) > 1 or spare is not None:
        coil = spec.coil
        clear = inner_clear_radius(coil, windings, centre)
        inside = Inside(centre, clear, coil.size[0] - coil.size[1], first.rotation)
        found = place_inner_vias(windings, coil.turns, inside, coil.trace_width, spec.fpc.rules, bus.spacing)
        joins = found or ()
        if found is None:
            findings.append(room.no_inner_room(spec, bus, clear, (len(windings) + 1) // 2))
    model = WoundCoil(windings, joins, spare, tuple(findings))
    return tuple(
        model if placement is first else _moved(model, wind_coil(spec, placement), first.centre, placement.centre)
        for placement in spec.array.placements
    )


def _moved(
    model: WoundCoil, windings: tuple[Winding, ...], origin: tuple[float, float], centre: tuple[float, float]
) -> WoundCoil:
    dx, dy = centre[0] - origin[0], centre[1] - origin[1]
    inner = tuple(
        InnerJoin(
            Hole(join.hole.centre.shifted(dx, dy), join.hole.pad, join.hole.drill),
            tuple((layer, path.shifted(dx, dy)) for layer, path in join.stubs),
        )
        for join in model.inner
    )
    return WoundCoil(windings, inner, model.way_out_layer, model.findings)


def _way_out_layer(spec: SensorSpec) -> int | None:
    """The copper layer on which a coil with an odd number of layers comes out from under its turns."""
    if len(spec.coil.layers) % 2 == 0:
        return None
    free = [layer.number for layer in spec.fpc.stackup.copper if layer.number not in spec.coil.layers]
    return next((number for number in free if number == 2), free[0] if free else None)
