"""What to say when something found no room on the board: the finding, with the missing length."""

from __future__ import annotations

from itertools import combinations

from sitscad.finding import Finding, Severity
from sitscad.geometry.path import Point
from sitscad.layout.clearance import Hole, hole_keep_out
from sitscad.layout.inner_vias import room_needed
from sitscad.layout.lanes import Bus
from sitscad.layout.tail import TailFrame
from sitscad.spec.sensor import SensorSpec


def no_way_out(spec: SensorSpec) -> Finding:
    """An odd number of layers ends inside, and no copper layer is left to come out on."""
    layers = len(spec.coil.layers)
    return Finding(
        rule="SIT111",
        name="no-way-out",
        severity=Severity.ERROR,
        message=f"a coil of {layers} layer{'s' if layers > 1 else ''} ends inside its turns, and the stack-up "
        f"{spec.fpc.stackup.name} has no copper layer left on which it could come out",
        hint=f"take {layers + 1} layers, or a stack-up with one more copper layer",
        key="coil.layers",
        measured=float(len(spec.fpc.stackup.copper)),
        limit=float(layers + 1),
        unit="copper layers",
    )


def no_inner_room(spec: SensorSpec, bus: Bus, clear_radius: float, joins: int) -> Finding:
    """The centre is too small for the vias that join the layers there."""
    needed, have = room_needed(joins, spec.fpc.rules, bus.spacing), 2.0 * clear_radius
    missing = needed - have
    fewer = missing / (2.0 * spec.coil.pitch)
    vias = "via" if joins == 1 else f"{joins} vias"
    if missing <= 0.0:
        return Finding(
            rule="SIT112",
            name="inner-via-room",
            severity=Severity.ERROR,
            message=f"no place was found for {vias} and the stubs to them inside the innermost turn, although "
            f"{have * 1e3:.3f} mm are clear there and {needed * 1e3:.3f} mm can do",
            hint="change coil.start_angle or the turns by a fraction, so that the layers' inner ends stand apart; or "
            "take a turn less",
            key="coil.turns",
            measured=have,
            limit=needed,
            unit="m",
        )
    return Finding(
        rule="SIT112",
        name="inner-via-room",
        severity=Severity.ERROR,
        message=f"no room for {vias} inside the innermost turn: {have * 1e3:.3f} mm are clear, "
        f"{needed * 1e3:.3f} mm are needed, {missing * 1e6:.0f} um are missing",
        hint=f"take {fewer:.2f} turns less on every layer, an outer diameter larger by {missing * 1e6:.0f} um, "
        "or finer rules",
        key="coil.turns",
        measured=have,
        limit=needed,
        unit="m",
        source=f"via pad and spacing of the rules {spec.fpc.rules.name}",
    )


def not_in_line(spec: SensorSpec) -> Finding:
    """Side by side on one layer, pairs are led along the jaw only."""
    return Finding(
        rule="SIT118",
        name="array-not-routed",
        severity=Severity.ERROR,
        message=f"the pairs of a {spec.array.pattern} array are led out above each other on two copper layers, and "
        "here the tail has only one: the coils are drawn and estimated, but not led out",
        hint="give the tail two layers (fpc.tail.layers: 2), or take pattern line",
        key="fpc.tail.layers",
    )


def no_tail_room(spec: SensorSpec, tail: TailFrame) -> Finding:
    """The tracks to the contacts come too near each other."""
    connector = tail.connector
    return Finding(
        rule="SIT119",
        name="tail-room",
        severity=Severity.ERROR,
        message=f"the tracks of {len(spec.array.placements)} coils come too near each other on their way to the "
        f"contacts of {connector.name} (pitch {connector.pitch * 1e3:g} mm, {(tail.end - tail.start) * 1e3:.1f} mm of "
        "tail)",
        hint="a connector of wider pitch, fewer coils on one tail, or a longer tail",
        key="fpc.tail.connector" if spec.fpc.tail else "fpc",
        measured=connector.pitch,
        unit="m",
        source=f"via pad and spacing of the rules {spec.fpc.rules.name}",
    )


def no_way_for_leads(spec: SensorSpec, bus: Bus) -> Finding:
    """The leads or the outer vias do not fit beside or between the coils."""
    rules = spec.fpc.rules
    hole = Hole(Point(0.0, 0.0), rules.via_pad, rules.via_drill)
    needed = 2.0 * hole_keep_out(hole, rules, bus.spacing) + bus.pitch
    centres = [Point(*p.centre) for p in spec.array.placements]
    pitch = min((a.distance(b) for a, b in combinations(centres, 2)), default=None)
    if pitch is None or pitch - spec.coil.size[0] >= needed:
        return Finding(
            rule="SIT113",
            name="lead-room",
            severity=Severity.ERROR,
            message="the coils' leads and outer vias find no way out of the windings",
            hint="change coil.start_angle or the number of turns, so that the layers end at other angles",
            key="coil.start_angle",
        )
    have = pitch - spec.coil.size[0]
    missing = max(needed - have, bus.pitch)
    return Finding(
        rule="SIT113",
        name="lead-room",
        severity=Severity.ERROR,
        message=f"leads and outer vias find no room between the coils: the gap is {have * 1e3:.3f} mm, "
        f"{needed * 1e3:.3f} mm let a via and a lead pass, {missing * 1e6:.0f} um are missing",
        hint=f"a pitch larger by {missing * 1e6:.0f} um, or another coil.start_angle so that layers end in the corners "
        "between the coils",
        key="array.pitch",
        measured=have,
        limit=needed,
        unit="m",
        source=f"via pad and spacing of the rules {rules.name}",
    )
