"""What found no room on the board, each with how much is there and how much it takes; its words are `finding`'s."""

from __future__ import annotations

from sitscad.finding import Missing, Shortfall
from sitscad.layout.routing.lanes import Bus
from sitscad.layout.tail.frame import TailFrame
from sitscad.layout.winding.inner_vias import room_needed
from sitscad.spec.sensor import SensorSpec


def no_way_out(spec: SensorSpec) -> Shortfall:
    """An odd number of layers ends inside, and no copper layer is left to come out on."""
    layers, stackup = len(spec.coil.layers), spec.fpc.stackup
    facts = (("count", layers), ("stackup", stackup.name))
    return Shortfall(Missing.WAY_OUT, float(len(stackup.copper)), float(layers + 1), "copper layers", facts=facts)


def no_inner_room(spec: SensorSpec, bus: Bus, clear_radius: float, joins: int) -> Shortfall:
    """The centre is too small for the vias that join the layers there."""
    have = 2.0 * clear_radius
    need = max(have, room_needed(1, spec.fpc.rules, bus.spacing))
    return Shortfall(Missing.INNER_ROOM, have, need, "m", facts=(("count", joins), ("clear", max(0.0, have) * 1e3)))


def not_in_line(spec: SensorSpec) -> Shortfall:
    """Side by side on one layer, pairs are led along the jaw only."""
    return Shortfall(Missing.TAIL_LAYERS, facts=(("pattern", spec.array.pattern),))


def no_tail_room(spec: SensorSpec, tail: TailFrame) -> Shortfall:
    """The tracks to the contacts come too near each other; what they take is known where it is more than the pitch."""
    contacts, rules = tail.connector, spec.fpc.rules
    needed = rules.trace_width + rules.trace_spacing
    facts = (
        ("coils", len(spec.array.placements)),
        ("connector", contacts.name),
        ("pitch", contacts.pitch * 1e3),
        ("tail", (tail.end - tail.start) * 1e3),
        ("rules", rules.name),
        ("track", needed * 1e6),
    )
    return Shortfall(Missing.TAIL_ROOM, contacts.pitch, needed if needed > contacts.pitch else None, "m", facts=facts)


def no_way_for_leads() -> Shortfall:
    """The leads or the outer vias do not fit beside or between the coils; how much they take only trying tells."""
    return Shortfall(Missing.LEAD_ROOM)
