"""The coils that wait their turn: grounded through the converter's pins, they act on the one that is read."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from sitscad.spec.readout import ReadoutSpec

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

Circuit = Callable[[Array], tuple[Array, Array]]
"""Inductance (H) and resistance (ohm) at (n,) frequencies (Hz)."""

Mutual = Callable[[int, int, Array], ComplexArray]
"""Mutual inductance (H) of two coils, by their numbers, at (n,) frequencies (Hz)."""


def idle_load(omega: Array, readout: ReadoutSpec) -> ComplexArray:
    """Impedance (ohm) between an idle coil's contacts at (n,) omega (rad/s): the cable, and both pins to ground.

    Each pin is tied to ground by about 10 ohm (`idle_pin_resistance`), so the loop has twice that. Capacitors across
    it are left out: against 20 ohm they carry next to nothing up to 10 MHz.
    """
    pins, cable = 2.0 * readout.device.limit("idle_pin_resistance"), readout.cable
    resistance, inductance = (0.0, 0.0) if cable is None else (cable.resistance, cable.inductance)
    return np.asarray(pins + resistance + 1j * omega * inductance)


def idle_neighbours(active: int, circuits: Sequence[Circuit], mutual: Mutual, readout: ReadoutSpec) -> Circuit:
    """What all other coils, idle, add to the inductance and resistance of the active one.

    `circuits` give each coil's own inductance and resistance, `mutual` the (complex) mutual inductance of two coils.
    Every idle loop has no voltage left: Z = -Z_ai Z_ii^-1 Z_ia.
    """
    others = [i for i in range(len(circuits)) if i != active]

    def added(frequencies: Array) -> tuple[Array, Array]:
        """Inductance (H) and resistance (ohm) that the idle coils add at frequencies (n,): the loops' currents solved
        for.
        """
        omega = 2.0 * math.pi * frequencies
        load = idle_load(omega, readout)
        towards = np.stack([1j * omega * mutual(active, i, frequencies) for i in others], axis=1)
        loops = np.empty((omega.size, len(others), len(others)), dtype=np.complex128)
        for k, i in enumerate(others):
            for n, j in enumerate(others):
                loops[:, k, n] = 1j * omega * mutual(i, j, frequencies) if i != j else 0.0
            inductance, resistance = circuits[i](frequencies)
            loops[:, k, k] = resistance + 1j * omega * inductance + load
        impedance = -np.sum(towards * np.linalg.solve(loops, towards[..., None])[..., 0], axis=1)
        return impedance.imag / omega, impedance.real

    return added
