"""Signal of a coil: change of its inductance, frequency and counts from rest to the required force."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sitscad.assembly.places.state import PRESSED, REST
from sitscad.basics.check_results import Signal

if TYPE_CHECKING:
    from sitscad.estimates.coil_estimates import CoilEstimate, Estimates, ReadoutEstimate


def signals(estimates: Estimates) -> tuple[Signal, ...]:
    """Return the signal of each coil that has a rest and a pressed state.

    Empty if the spec has no required force, no target or no elastomer.
    """
    by_coil = (_coil_signal(coil, estimates.normal_force, estimates.readout) for coil in estimates.coils)
    return tuple(signal for signal in by_coil if signal is not None)


def _coil_signal(coil: CoilEstimate, force: float | None, readout: ReadoutEstimate) -> Signal | None:
    """Return the signal of a coil under a normal force (N). None if a state (rest, pressed) or the force is missing."""
    change = coil.sensitivity(force)
    if change is None or not force or not all(map(math.isfinite, change)):
        return None
    rest, pressed = coil.states[REST], coil.states[PRESSED]
    sigma = coil.sensitivity_sigma(force) or (None, None)
    ratio, conversion = coil.press_share, readout.conversion
    before, after = rest.converter_inductance, pressed.converter_inductance
    if before is None or after is None:
        before, after = rest.inductance, pressed.inductance
    return Signal(
        coil.name, force, rest.inductance, change[0], sigma[0], change[1], sigma[1],
        share=ratio * (after / before - 1.0),
        frequency_share=ratio * (pressed.frequency / rest.frequency - 1.0),
        steps=ratio * conversion.steps(rest.frequency, pressed.frequency) if conversion else None,
    )
