"""The tank: frequency, parallel resistance and quality factor of a coil and a capacitor, also over a cable."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record


def resonance_frequency(inductance: float, capacitance: float) -> float:
    """1 / (2 pi sqrt(L C)) in hertz (Thomson 1853), of henries and farads."""
    return 1.0 / (2.0 * math.pi * math.sqrt(inductance * capacitance))


def apparent_inductance(inductance: float, resistance: float, capacitance: float, frequency: float) -> float:
    """Return the series inductance (H) that a meter reads for a coil with a capacitance (F) across it.

    It is L / (1 - omega^2 L C) for a coil without loss, and goes through infinity to negative values at self-resonance.
    """
    return apparent_impedance(inductance, resistance, capacitance, frequency).imag / (2.0 * math.pi * frequency)


def apparent_impedance(inductance: float, resistance: float, capacitance: float, frequency: float) -> complex:
    """Return the impedance (ohm) of a coil with a capacitance (F) across it: the inverse sum of both admittances."""
    omega = 2.0 * math.pi * frequency
    return 1.0 / (1.0 / complex(resistance, omega * inductance) + 1j * omega * capacitance)


@record(eq=False)
class Network:
    """What lies between coils' contacts and the converter's pins, in SI units; numbers, or arrays of one a coil.
    `coil_side` is the lossless capacitance at the contacts (the coil's own, half the cable's), `converter_side` that at
    the pins; the tank capacitor stands at one of the two, in series with its own resistance. `inductance` and
    `resistance` are the cable's.
    """

    coil_side: float | Array
    converter_side: float
    capacitor: float | Array
    capacitor_at_coil: bool
    capacitor_resistance: float = 0.0
    inductance: float = 0.0
    resistance: float = 0.0

    def admittance(self, omega: Array, inductance: Array, resistance: Array) -> tuple[ComplexArray, ComplexArray]:
        """Admittance (S) at the pins of coils of (H, ohm) at omega (rad/s), and their voltage over the pins'. By
        Kirchhoff's laws in the chain of coil, cable and converter (textbook).
        """
        around = 1j * omega
        branch = around * self.capacitor / (1.0 + around * (self.capacitor * self.capacitor_resistance))
        far = around * self.coil_side + 1.0 / (resistance + around * inductance)
        near = around * self.converter_side
        far, near = (far + branch, near) if self.capacitor_at_coil else (far, near + branch)
        behind = 1.0 + far * (self.resistance + around * self.inductance)
        return np.asarray(near + far / behind), np.asarray(1.0 / behind)

    def in_tank(self, inductance: Array) -> Array:
        """The inductance (H) that swings with the capacitor: the coils', and the cable's if it lies between the two."""
        return inductance + (0.0 if self.capacitor_at_coil else self.inductance)

    @property
    def capacitance(self) -> float | Array:
        """All capacitance (F) of the tank."""
        return self.coil_side + self.converter_side + self.capacitor

    @np.errstate(divide="ignore", invalid="ignore")  # no tank has an inductance below zero: NaN
    def resonance(self, inductance: Array) -> Array:
        """Angular frequencies (rad/s) of coils of inductances (H), loss and delay left out: 1 / sqrt(L C)."""
        return 1.0 / np.sqrt(self.in_tank(inductance) * self.capacitance)


@record
class Oscillation:
    """Where a tank runs: frequency (Hz), the coil's inductance (H) and resistance (ohm) that it was found with,
    parallel resistance at the pins (ohm), quality factor (no unit). `coil_share` is the amplitude at the coil's
    contacts over that at the pins. An overdamped tank runs nowhere: then `exists` is False, and all is NaN but what the
    coil has and the quality factor (root of L/C over R).
    """

    frequency: float
    inductance: float
    resistance: float
    parallel_resistance: float
    quality_factor: float
    coil_share: float

    @property
    def exists(self) -> bool:
        """Whether the tank oscillates."""
        return math.isfinite(self.frequency)


@record(eq=False)
class Oscillations:
    """Where tanks run: what `Oscillation` says of one, in arrays of one shape."""

    frequency: Array
    inductance: Array
    resistance: Array
    parallel_resistance: Array
    quality_factor: Array
    coil_share: Array

    def one_by_one(self) -> list[Oscillation]:
        """Each tank, in the arrays' order."""
        columns = (self.frequency, self.inductance, self.resistance, self.parallel_resistance, self.quality_factor,
                   self.coil_share)
        return [Oscillation(*row) for row in zip(*(column.ravel().tolist() for column in columns), strict=True)]


Terminals = Callable[[Array], tuple[Array, Array]]
"""Inductances (H) and resistances (ohm) of coils at their contacts at frequencies (Hz), arrays of one shape."""

LOWEST_SHARE = 0.05
"""Of the plain resonance: a phase that is met only below it is that of direct current, where every tank conducts."""

STEPS = 40  # Steps after which a tank is taken to oscillate nowhere: the shortest end below `LOWEST_SHARE`

STRIDE, STRIDE_OVER_CABLE = 0.3, 0.1
"""Longest step, of the frequency; over a cable so short that it passes over no crossing of those that it makes."""

CLOSED = 1e3  # Phase (rad), over the tolerance of the frequency, to which the drive's is met where a tank oscillates

EXACTLY = 1e-9  # Last change of a frequency, of itself; what it is off by then is far less, as of all secants


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # what does not oscillate is NaN, which is said
def oscillate(
    network: Network, terminals: Terminals, delay: float, start: Array, tolerance: float = EXACTLY
) -> Oscillations:
    """Where the drive, `delay` (s) behind the voltage, meets its own phase: arg Y = -omega delay, of coils that have
    the inductances and resistances of `terminals` at that very frequency. Without delay that is where the admittance at
    the pins is real. For a plain tank it is SNOSCY9A's 1/(2 pi sqrt(L C)) sqrt(1 - 1/Q^2 - delay/(Q sqrt(L C))), with 5
    ns there.

    Solved from about `start` (Hz; an array of any shape, which all that is found has), the plain resonance or nearer,
    until the frequency moves by less than a part of `tolerance`; the lowest one where a cable makes several.
    """
    # By secants, for over a cable it has no short derivative; on the part of Y that is out of phase with the drive over
    # omega, which is nearly straight in omega about a resonance, where the phase itself turns the faster the better the
    # coil is. Beyond a sixth of a period's delay that part turns round.
    before = np.minimum(2.0 * math.pi * start, 1.0 / delay if delay else math.inf)
    first = known = terminals(before / (2.0 * math.pi))
    plain = network.resonance(first[0])
    stride = STRIDE_OVER_CABLE if network.inductance else STRIDE

    def apart(omega: Array) -> Array:
        y, _ = network.admittance(omega, *known)
        return (y.imag * np.cos(omega * delay) + y.real * np.sin(omega * delay)) / omega

    low = apart(before)
    # of a plain tank without loss that part grows by 2 C / omega
    step = -0.5 * low * before / network.capacitance
    for _ in range(STEPS):
        after = before + np.clip(step, -stride * before, stride * before)
        still = (np.abs(after - before) > tolerance * after) & (after >= LOWEST_SHARE * plain)
        if not np.any(still):
            break
        known = terminals(after / (2.0 * math.pi))
        high = apart(after)
        # what has arrived stays, for rounding would move it; and where nothing oscillates nothing is asked for
        step = np.where(still & (high != low), high * (before - after) / (high - low), 0.0)
        step[~np.isfinite(step)] = 0.0
        before, low = after, high
    y, share = network.admittance(after, *known)
    beyond, _ = network.admittance(after * (1.0 + 1e-6), *known)
    off = np.remainder(np.angle(y) + after * delay + math.pi, 2.0 * math.pi) - math.pi
    exists = (np.abs(off) <= CLOSED * tolerance) & (after >= LOWEST_SHARE * plain)
    loss = first[1] + (0.0 if network.capacitor_at_coil else network.resistance)
    return Oscillations(
        frequency=np.where(exists, after / (2.0 * math.pi), np.nan), inductance=known[0], resistance=known[1],
        parallel_resistance=np.where(exists, 1.0 / y.real, np.nan),
        quality_factor=np.where(exists, 0.5 * (beyond.imag - y.imag) / (1e-6 * y.real),
                                plain * network.in_tank(first[0]) / loss),
        coil_share=np.where(exists, np.abs(share), np.nan),
    )


def oscillate_alike(network: Network, inductance: Array, resistance: Array, delay: float) -> Oscillations:
    """Where tanks run whose coils have one inductance (H) and resistance (ohm) each at all frequencies."""
    start = network.resonance(inductance) / (2.0 * math.pi)
    return oscillate(network, lambda _: (inductance, resistance), delay, start)
