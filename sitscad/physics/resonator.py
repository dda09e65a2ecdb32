"""The tank: frequency, parallel resistance and quality factor of a coil and a capacitor, also over a cable."""

from __future__ import annotations

import cmath
import math
from contextlib import suppress

import numpy as np

from sitscad.arrays import Array
from sitscad.record import record


def resonance_frequency(inductance: float, capacitance: float) -> float:
    """1 / (2 pi sqrt(L C)) in hertz (Thomson 1853), of henries and farads."""
    return 1.0 / (2.0 * math.pi * math.sqrt(inductance * capacitance))


def parallel_resistance(inductance: float, resistance: float, frequency: float) -> float:
    """(omega L)^2 / R in ohm of a coil (H, ohm) at a frequency (Hz): the resistance that the converter's drive sees at
    resonance (SNOSCY9A 7.3).
    """
    return (2.0 * math.pi * frequency * inductance) ** 2 / resistance


def quality_factor(inductance: float, resistance: float, frequency: float) -> float:
    """Quality factor omega L / R of a coil (H, ohm) at a frequency (Hz), by its definition; without a unit."""
    return 2.0 * math.pi * frequency * inductance / resistance


def apparent_inductance(inductance: float, resistance: float, capacitance: float, frequency: float) -> float:
    """What a meter reads (H) where a capacitance (F) lies across the coil: the series inductance of the pair, from the
    sum of both admittances (textbook). L / (1 - omega^2 L C) for a coil without loss; infinite and then negative about
    its own resonance.
    """
    omega = 2.0 * math.pi * frequency
    admittance = 1.0 / complex(resistance, omega * inductance) + 1j * omega * capacitance
    return (1.0 / admittance).imag / omega


@record
class Network:
    """What lies between a coil's contacts and the converter's pins, in SI units. `coil_side` is the lossless
    capacitance at the contacts (the coil's own, half the cable's), `converter_side` that at the pins; the tank
    capacitor stands at one of the two, in series with its own resistance. `inductance` and `resistance` are the
    cable's.
    """

    coil_side: float
    converter_side: float
    capacitor: float
    capacitor_at_coil: bool
    capacitor_resistance: float = 0.0
    inductance: float = 0.0
    resistance: float = 0.0

    def admittance(self, omega: float, inductance: float, resistance: float) -> tuple[complex, complex]:
        """Admittance (S) at the pins of a coil of (H, ohm) at omega (rad/s), and the coil's voltage over the pins'; of
        arrays, too. By Kirchhoff's laws in the chain of coil, cable and converter (textbook).
        """
        branch = 1j * omega * self.capacitor / (1.0 + 1j * omega * self.capacitor * self.capacitor_resistance)
        far = 1j * omega * self.coil_side + 1.0 / (resistance + 1j * omega * inductance)
        near = 1j * omega * self.converter_side
        far, near = (far + branch, near) if self.capacitor_at_coil else (far, near + branch)
        behind = 1.0 + far * (self.resistance + 1j * omega * self.inductance)
        return near + far / behind, 1.0 / behind


@record
class Oscillation:
    """Where a tank runs: frequency (Hz), parallel resistance at the pins (ohm), quality factor (no unit). `coil_share`
    is the amplitude at the coil's contacts over that at the pins. An overdamped tank runs nowhere: then `exists` is
    False and all but the quality factor (root of L/C over R) is NaN.
    """

    frequency: float
    parallel_resistance: float
    quality_factor: float
    coil_share: float
    exists: bool = True


LOWEST_SHARE = 0.05
"""Of the plain resonance: a phase that is met only below it is that of direct current, where every tank conducts."""


def oscillate(
    network: Network, inductance: float, resistance: float, delay: float = 0.0, start: float | None = None
) -> Oscillation:
    """The frequency at which the drive, `delay` (s) behind the voltage, meets its own phase: arg Y = -omega delay.
    Without delay that is where the admittance at the pins is real. For a plain tank it is SNOSCY9A's 1/(2 pi sqrt(L C))
    sqrt(1 - 1/Q^2 - delay/(Q sqrt(L C))), with 5 ns there. Solved by the secant rule from the plain resonance (or from
    `start`, Hz), the lowest one where a cable makes several.
    """
    whole = network.coil_side + network.converter_side + network.capacitor
    in_tank = inductance + (0.0 if network.capacitor_at_coil else network.inductance)
    plain = resonance_frequency(in_tank, whole)
    omega = 2.0 * math.pi * (plain if start is None else start)

    # On the phase, which is what the drive's delay is compared with; by secants, for over a cable it has no short
    # derivative; by steps of a tenth at most, so that they pass over no crossing of the several that a cable makes.
    def phase(at: float) -> float:
        found, _ = network.admittance(at, inductance, resistance)
        if not delay:
            return math.atan(found.imag / found.real)
        return math.remainder(cmath.phase(found) + at * delay, 2.0 * math.pi)

    before, after = omega, omega * (1.0 - 1e-4)
    low, high = phase(before), phase(after)
    for _ in range(30):
        if high == low or abs(after - before) <= 1e-13 * after:
            break
        step = -high * (after - before) / (high - low)
        before, low = after, high
        after += max(-0.1 * after, min(0.1 * after, step))
        high = phase(after)
    if abs(high) > 1e-6 or after < LOWEST_SHARE * 2.0 * math.pi * plain:
        loss = resistance + (0.0 if network.capacitor_at_coil else network.resistance)
        return Oscillation(math.nan, math.nan, quality_factor(in_tank, loss, plain), math.nan, False)
    found, share = network.admittance(after, inductance, resistance)
    beyond, _ = network.admittance(after * (1.0 + 1e-6), inductance, resistance)
    quality = 0.5 * (beyond.imag - found.imag) / (1e-6 * found.real)
    return Oscillation(after / (2.0 * math.pi), 1.0 / found.real, quality, abs(share))


FEW = 8  # Coils up to which the frequency of a tank is found one by one


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # what does not oscillate is NaN, which is said
def tank_frequencies(network: Network, inductance: Array, resistance: Array, delay: float) -> tuple[Array, Array]:
    """Frequency (Hz) and parallel resistance (ohm) of (n,) coils, by the steps of `oscillate` from the plain resonance;
    NaN where there is no oscillation.
    """
    if len(inductance) <= FEW:  # each by itself: arrays of so few numbers cost more
        found = np.full((2, len(inductance)), np.nan)
        for k, (own, lost) in enumerate(zip(inductance.tolist(), resistance.tolist(), strict=True)):
            with suppress(ValueError, ZeroDivisionError, OverflowError):  # no tank has such numbers
                tank = oscillate(network, own, lost, delay)
                found[:, k] = tank.frequency, tank.parallel_resistance
        return found[0], found[1]
    whole = network.coil_side + network.converter_side + network.capacitor
    in_tank = inductance + (0.0 if network.capacitor_at_coil else network.inductance)
    plain = 1.0 / np.sqrt(in_tank * whole)

    def phase(omega: Array) -> Array:
        y, _ = network.admittance(omega, inductance, resistance)  # type: ignore[arg-type]
        if not delay:
            return np.asarray(np.arctan(y.imag / y.real))
        return np.asarray(np.remainder(np.angle(y) + omega * delay + math.pi, 2.0 * math.pi) - math.pi)

    before, after = plain, plain * (1.0 - 1e-4)
    low, high = phase(before), phase(after)
    for _ in range(30):
        still = (high != low) & (np.abs(after - before) > 1e-13 * after)
        if not np.any(still):
            break
        step = np.where(still, -high * (after - before) / np.where(high == low, 1.0, high - low), 0.0)
        before, low = after, high
        after = after + np.clip(step, -0.1 * after, 0.1 * after)
        high = phase(after)
    y, _ = network.admittance(after, inductance, resistance)  # type: ignore[arg-type]
    exists = (np.abs(high) <= 1e-6) & (after >= LOWEST_SHARE * plain)
    return np.where(exists, after / (2.0 * math.pi), np.nan), np.where(exists, 1.0 / y.real, np.nan)
