"""Steps of the assembly at the bench: the bare board is tested, the tail plugged in, the finished sensor measured."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.data import is_unverified
from sitscad.estimates.circuit.drive import bare_board_code
from sitscad.estimates.uncertainty import direct_resistance_sigma
from sitscad.estimates.values import METER_FREQUENCY, CoilEstimate, Estimates
from sitscad.layout.board import Layout
from sitscad.papers.order.codes import order_of
from sitscad.scene.state import FREE, REST
from sitscad.units import show

UNKNOWN = "nothing estimated"

READ = "inductance (in brackets what a meter at the tank's frequency reads, the coil's own capacitance across it)"
"""What the first figure of each coil's line is."""


def bare_board(layout: Layout, estimates: Estimates, bench: Estimates) -> str:
    """What a bare board shows at the contacts at 20 degrees Celsius (``bench``), a line a coil, and its drive code."""
    relative = direct_resistance_sigma(layout.spec)
    lines = []
    for coil in bench.coils:
        direct = _with_sigma(coil.terminal_resistance_dc, relative * coil.terminal_resistance_dc, "ohm")
        inductance, frequency = _readings(coil, FREE)
        figures = [inductance, direct, frequency, *_metered(bench, coil.name)]
        lines.append(f"{coil.name} ({_contacts(layout, coil.name)}): {', '.join(figures)}")
    said = (
        f"Test the bare board before any glue, at 20 degC, far from metal. Between the contacts of each coil: {READ}, "
        f"resistance to direct current, frequency with the tank's capacitor of {show(bench.readout.capacitance, 'F')}, "
        f"and what a meter of {show(METER_FREQUENCY, 'Hz')} reads, inductance and resistance in series; "
        "+- is one sigma of manufacture: a coil "
        f"three and more off is not worth gluing.{_drive(layout, estimates, bench)}"
    )
    return "\n".join([said, *lines])


def _metered(bench: Estimates, coil: str) -> list[str]:
    """What a usual meter reads of a coil of the bare board, with one sigma."""
    return [
        f"at {show(read.frequency, 'Hz')} {_with_sigma(read.inductance, read.inductance_sigma, 'H')} and "
        f"{_with_sigma(read.resistance, read.resistance_sigma, 'ohm')}"
        for read in bench.metered
        if read.coil == coil
    ]


def assembled(bench: Estimates, closes: str, unseen: Sequence[str] = ()) -> str:
    """What the finished sensor shows at rest at 20 degrees Celsius, a line a coil; with the names of the metals about
    it whose figures are unverified.
    """
    lines = [f"{coil.name}: {', '.join(_readings(coil, REST))}" for coil in bench.coils if REST in coil.states]
    if not lines:
        return f"{closes}Measure each coil again."
    said = (
        f"{closes}Measure each coil again at 20 degC, with nothing on it. At rest: {READ}, frequency with the tank's "
        f"capacitor; +- is one sigma of manufacture.{_leaning(unseen)}"
    )
    return "\n".join([said, *lines])


def _leaning(unseen: Sequence[str]) -> str:
    """That the figures at rest lean on metals that nobody has verified; empty where they do not."""
    if not unseen:
        return ""
    return f" They lean on unverified figures of metals near the coils: {', '.join(unseen)}."


def plugged(layout: Layout) -> str:
    """Which face the contacts are on, where contact 1 is, and what the tail goes into; empty without contacts."""
    if not layout.pads:
        return ""
    first = min(layout.pads, key=lambda pad: pad.number)
    name = "unused" if first.is_unused else first.pin
    where = (
        "The contacts are on the face with the coils. Seen on that face, along the tail to its end, contact 1 "
        f"({name}) is at the left edge; which contact goes to which pin of the converter is in fpc/readme.txt."
    )
    return f"{_into(layout)} {where}"


def _into(layout: Layout) -> str:
    """What the tail is put into, by its connector."""
    tail = layout.spec.fpc.tail
    if tail is None or tail.connector.insertion_thickness == 0.0:
        return "Solder wires to the contacts."
    order = order_of("connector", tail.connector.name, contacts=len(layout.pads))
    doubt = ", code unverified" if order is not None and is_unverified(order.source) else ""
    code = f"; {order.maker} {order.code}{doubt}" if order is not None else ""
    return (
        f"Plug the tail into its connector ({tail.connector.name}, {len(layout.pads)} contacts{code}): open the latch, "
        "push the tail in straight, close the latch. The connector's springs have to be on the contacts' side."
    )


def _contacts(layout: Layout, coil: str) -> str:
    """The numbers of a coil's contacts, in words."""
    nets = {each.net for each in layout.coils if each.name == coil}
    numbers = sorted(pad.number for pad in layout.pads if pad.net in nets)
    return f"contacts {', '.join(map(str, numbers))}" if numbers else "no contacts"


def _readings(coil: CoilEstimate, state: str) -> tuple[str, str]:
    """Inductance at the contacts, with what a meter there reads, and the tank's frequency, each with one sigma."""
    found = coil.states.get(state)
    if found is None:
        return UNKNOWN, UNKNOWN
    spread, meter = found.spread, found.apparent_inductance
    inductance = _with_sigma(found.inductance, None if spread is None else spread.inductance, "H")
    read = f" ({show(meter, 'H', 4)})" if meter is not None and math.isfinite(meter) else ""
    return inductance + read, _with_sigma(found.frequency, None if spread is None else spread.frequency, "Hz")


def _with_sigma(value: float, sigma: float | None, unit: str) -> str:
    if not math.isfinite(value):
        return UNKNOWN
    scatter = f" +- {show(sigma, unit, 2)}" if sigma is not None and math.isfinite(sigma) else ""
    return f"{show(value, unit, 4)}{scatter}"


def _drive(layout: Layout, estimates: Estimates, bench: Estimates) -> str:
    """With which drive code the converter reads a bare board; empty where no code is chosen."""
    device, used = layout.spec.readout.device, _code_in_use(estimates)
    code = bare_board_code(bench)
    if code is None or not used:
        return ""
    if used == str(code):
        return f" With {device.part} use drive code {code} for the bare board as for the assembled sensor."
    return f" With {device.part} use drive code {code} for the bare board; the assembled sensor has {used}."


def _code_in_use(estimates: Estimates) -> str:
    """The drive code of the assembled sensor, or the codes of its channels; empty where there is none."""
    readout = estimates.readout
    if readout.high_current or readout.drive_code is None:
        return ""
    return ", ".join(map(str, readout.drive_codes or (readout.drive_code,)))
