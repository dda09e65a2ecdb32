"""The coils that wait their turn: grounded through the converter's pins, they act on the one that is read."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from sitscad.readout import ldc1614
from sitscad.spec.sensor import Cable

Circuit = Callable[[float], tuple[float, float]]
Mutual = Callable[[int, int, float], complex]


def idle_load(omega: float, cable: Cable | None) -> complex:
    """Impedance (ohm) between an idle coil's contacts at omega (rad/s): the cable, and both pins to ground.

    Each pin is tied to ground by about 10 ohm (SNOSCY9A 8.1.5.1), so the loop has twice that. The capacitors across it
    are left out: against 20 ohm they carry next to nothing up to 10 MHz.
    """
    load = complex(2.0 * ldc1614.limit("idle_pin_resistance"), 0.0)
    return load if cable is None else load + complex(cable.resistance, omega * cable.inductance)


def idle_neighbours(active: int, circuits: Sequence[Circuit], mutual: Mutual, cable: Cable | None) -> Circuit:
    """What all other coils, idle, add to the inductance (H) and resistance (ohm) of the active one, by frequency (Hz).

    `circuits` give each coil's own inductance and resistance, `mutual` the (complex) mutual inductance of two coils.
    Every idle loop has no voltage left: Z = -Z_ai Z_ii^-1 Z_ia.
    """
    others = [i for i in range(len(circuits)) if i != active]

    def added(frequency: float) -> tuple[float, float]:
        omega = 2.0 * math.pi * frequency
        towards = np.array([1j * omega * mutual(active, i, frequency) for i in others])
        loops = np.array([[1j * omega * mutual(i, j, frequency) if i != j else 0j for j in others] for i in others])
        for k, i in enumerate(others):
            inductance, resistance = circuits[i](frequency)
            loops[k, k] = complex(resistance, omega * inductance) + idle_load(omega, cable)
        impedance = -complex(towards @ np.linalg.solve(loops, towards))
        return impedance.imag / omega, impedance.real

    return added
