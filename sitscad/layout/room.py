"""What to say when something found no room on the board: the finding, with the missing length."""

from __future__ import annotations

from sitscad.finding import Finding, Severity
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
    have = 2.0 * clear_radius
    vias = "the via" if joins == 1 else f"{joins} vias"
    return Finding(
        rule="SIT112",
        name="inner-via-room",
        severity=Severity.ERROR,
        message=f"no room for {vias} and the stubs to {'it' if joins == 1 else 'them'} inside the innermost turn, "
        f"where {max(0.0, have) * 1e3:.3f} mm are clear",
        hint="take fewer turns, fewer layers or finer rules",
        key="coil.turns",
        measured=have,
        limit=max(have, room_needed(1, spec.fpc.rules, bus.spacing)),
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
    contacts, rules = tail.connector, spec.fpc.rules
    needed = rules.trace_width + rules.trace_spacing
    missing = needed - contacts.pitch
    asks = f": {rules.name} asks {needed * 1e6:g} um from track to track" if missing > 0.0 else ""
    return Finding(
        rule="SIT119",
        name="tail-room",
        severity=Severity.ERROR,
        message=f"the tracks of {len(spec.array.placements)} coils come too near each other on their way to the "
        f"contacts of {contacts.name} (pitch {contacts.pitch * 1e3:g} mm, {(tail.end - tail.start) * 1e3:.1f} mm of "
        f"tail){asks}",
        hint="a connector of wider pitch" + ("" if asks else ", fewer coils on one tail, or a longer tail"),
        key="fpc.tail.connector" if spec.fpc.tail else "fpc",
        measured=contacts.pitch,
        limit=needed if asks else None,
        unit="m",
        source=f"{'trace' if asks else 'via pad'} and spacing of the rules {rules.name}",
    )


def no_way_for_leads(spec: SensorSpec) -> Finding:
    """The leads or the outer vias do not fit beside or between the coils."""
    return Finding(
        rule="SIT113",
        name="lead-room",
        severity=Severity.ERROR,
        message="the coils' leads and outer vias find no way out of the windings",
        hint="change coil.start_angle or the number of turns, so that the layers end at other angles",
        key="coil.start_angle",
        source=f"via pad and spacing of the rules {spec.fpc.rules.name}",
    )
