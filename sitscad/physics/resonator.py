"""The tank: frequency, parallel resistance and quality factor of a coil with a capacitor across it."""

from __future__ import annotations

import math


def resonance_frequency(inductance: float, capacitance: float) -> float:
    """1 / (2 pi sqrt(L C)) in hertz."""
    return 1.0 / (2.0 * math.pi * math.sqrt(inductance * capacitance))


def parallel_resistance(inductance: float, resistance: float, frequency: float) -> float:
    """(omega L)^2 / R in ohm, the resistance that the converter's drive sees at resonance (SNOSCY9A 7.3)."""
    return (2.0 * math.pi * frequency * inductance) ** 2 / resistance


def quality_factor(inductance: float, resistance: float, frequency: float) -> float:
    """Omega L / R."""
    return 2.0 * math.pi * frequency * inductance / resistance
