"""How the coils' tanks follow a change of inductance and resistance: in closed form, from the states at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.values import Estimates
from sitscad.record import record
from sitscad.scene.state import PRESSED, REST
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

TURNS, LATEST = 4, 1.3
"""How often the frequency is put in again, and the angle (rad) that it is late by at most."""

SLOWEST = 0.04
"""Least square of a frequency over that at rest: tanks that a chart takes beyond what oscillates stay finite."""

LEAST, MOST = 1e-6, 4.0
"""Change, over the inductance, below which it is not held to that of the states; and by how much more or less it is."""


@record(eq=False)
class TankLaw:
    """Tanks at rest, (coils,): inductance (H), resistance (ohm) and frequency (Hz); and the drive's delay (s).

    The susceptance is minus the conductance times tan(omega delay), as in `physics.resonator.oscillate`:
    (omega L)^2 = (L - R tan(omega delay) / omega) / C - R^2, C being what makes it that at rest. So loss pulls, too: a
    magnetic metal's does as much as its change of inductance.
    """

    inductance: Array
    resistance: Array
    frequency: Array
    delay: float

    def logarithms(self, change: ComplexArray) -> Array:
        """Of frequencies over those at rest, by changes of the inductances since then (H, complex; (..., coils))."""
        start = 2.0 * np.pi * self.frequency
        inductance = np.maximum(self.inductance + change.real, 0.1 * self.inductance)
        resistance = np.maximum(self.resistance - start * change.imag, 0.0)
        behind = np.tan(start * self.delay) / start
        square = self.resistance**2 + (start * self.inductance) ** 2
        capacitance = (self.inductance - self.resistance * behind) / square
        omega = np.broadcast_to(start, inductance.shape)
        for _ in range(TURNS):
            late = np.tan(np.minimum(omega * self.delay, LATEST)) / omega
            square = ((inductance - resistance * late) / capacitance - resistance**2) / inductance**2
            omega = np.sqrt(np.maximum(square, SLOWEST * start**2))
        return np.asarray(np.log(omega / start))


def tank_law(spec: SensorSpec, estimates: Estimates) -> TankLaw:
    """The law of all coils' tanks, which have a state at rest."""
    states = [coil.states[REST] for coil in estimates.coils]
    return TankLaw(
        inductance=np.array([state.inductance for state in states]),
        resistance=np.array([state.resistance for state in states]),
        frequency=np.array([state.frequency for state in states]),
        delay=spec.readout.device.limit("drive_delay"),
    )


def pressed_place(estimates: Estimates) -> float | None:
    """The place along z (m) of the target in the state pressed; None without that state."""
    poses = [state.pose for state in estimates.states if state.name == PRESSED]
    return poses[0].z if poses and poses[0] is not None else None


def held(estimates: Estimates, said: ComplexArray) -> ComplexArray:
    """By what factor (coils,) the coils' inductances (complex) change from the state at rest to that pressed, over what
    is `said` (H): crowding and neighbours are in those. Ones where there is no such state.
    """
    found = np.ones(len(estimates.coils), dtype=complex)
    for k, coil in enumerate(estimates.coils):
        rest, pressed = coil.states[REST], coil.states.get(PRESSED)
        if pressed is None or abs(said[k]) < LEAST * rest.inductance:
            continue
        lost = (pressed.resistance - rest.resistance) / (2.0 * np.pi * rest.frequency)
        factor = complex(pressed.inductance - rest.inductance, -lost) / said[k]
        found[k] = factor * min(1.0, MOST / abs(factor))
    return found
