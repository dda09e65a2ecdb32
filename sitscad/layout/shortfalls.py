"""What found no room on the board, each with how much is there and how much it takes."""

from __future__ import annotations

from sitscad.finding import Missing, Shortfall
from sitscad.layout.routing.lanes import Bus
from sitscad.layout.tail.frame import TailFrame
from sitscad.layout.winding.inner_vias import room_needed
from sitscad.spec.sensor import SensorSpec


def no_way_out(spec: SensorSpec) -> Shortfall:
    """An odd number of layers ends inside, and no copper layer is left to come out on."""
    layers = len(spec.coil.layers)
    return Shortfall(
        Missing.WAY_OUT,
        f"a coil of {layers} layer{'s' if layers > 1 else ''} ends inside its turns, and the stack-up "
        f"{spec.fpc.stackup.name} has no copper layer left on which it could come out",
        float(len(spec.fpc.stackup.copper)),
        float(layers + 1),
        "copper layers",
    )


def no_inner_room(spec: SensorSpec, bus: Bus, clear_radius: float, joins: int) -> Shortfall:
    """The centre is too small for the vias that join the layers there."""
    have = 2.0 * clear_radius
    vias = "the via" if joins == 1 else f"{joins} vias"
    return Shortfall(
        Missing.INNER_ROOM,
        f"no room for {vias} and the stubs to {'it' if joins == 1 else 'them'} inside the innermost turn, "
        f"where {max(0.0, have) * 1e3:.3f} mm are clear",
        have,
        max(have, room_needed(1, spec.fpc.rules, bus.spacing)),
        "m",
    )


def not_in_line(spec: SensorSpec) -> Shortfall:
    """Side by side on one layer, pairs are led along the jaw only."""
    return Shortfall(
        Missing.TAIL_LAYERS,
        f"the pairs of a {spec.array.pattern} array are led out above each other on two copper layers, and "
        "here the tail has only one: the coils are drawn and estimated, but not led out",
    )


def no_tail_room(spec: SensorSpec, tail: TailFrame) -> Shortfall:
    """The tracks to the contacts come too near each other; what they take is known where it is more than the pitch."""
    contacts, rules = tail.connector, spec.fpc.rules
    needed = rules.trace_width + rules.trace_spacing
    is_known = needed > contacts.pitch
    asks = f": {rules.name} asks {needed * 1e6:g} um from track to track" if is_known else ""
    return Shortfall(
        Missing.TAIL_ROOM,
        f"the tracks of {len(spec.array.placements)} coils come too near each other on their way to the "
        f"contacts of {contacts.name} (pitch {contacts.pitch * 1e3:g} mm, {(tail.end - tail.start) * 1e3:.1f} mm of "
        f"tail){asks}",
        contacts.pitch,
        needed if is_known else None,
        "m",
    )


def no_way_for_leads() -> Shortfall:
    """The leads or the outer vias do not fit beside or between the coils; how much they take only trying tells."""
    return Shortfall(Missing.LEAD_ROOM, "the coils' leads and outer vias find no way out of the windings")
