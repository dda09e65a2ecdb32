"""Tank circuits: frequency, parallel resistance and quality factor of a coil and a capacitor, also over a cable."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record


def resonance_frequency(inductance: float, capacitance: float) -> float:
    """Return the resonance frequency (Hz) of an inductance (H) and a capacitance (F): 1 / (2 pi sqrt(L C)).

    Source: Thomson 1853.
    """
    return 1.0 / (2.0 * math.pi * math.sqrt(inductance * capacitance))


def apparent_inductance(inductance: float, resistance: float, capacitance: float, frequency: float) -> float:
    """Return the series inductance (H) that a meter shows for a coil with a capacitance (F) in parallel.

    `inductance` (H) and `resistance` (ohm) are the coil's, `frequency` (Hz) is the meter's. For a coil without loss the
    result is L / (1 - omega^2 L C). At self-resonance it passes through infinity to negative values.
    """
    return apparent_impedance(inductance, resistance, capacitance, frequency).imag / (2.0 * math.pi * frequency)


def apparent_impedance(inductance: float, resistance: float, capacitance: float, frequency: float) -> complex:
    """Return the impedance (ohm) of a coil with a capacitance (F) in parallel, at a frequency (Hz).

    It is the inverse of the sum of both admittances. `inductance` (H) and `resistance` (ohm) are the coil's.
    """
    omega = 2.0 * math.pi * frequency
    return 1.0 / (1.0 / complex(resistance, omega * inductance) + 1j * omega * capacitance)


@record(eq=False)
class Network:
    """Circuit between coils' contacts and the converter's pins, in SI units.

    Fields are numbers, or arrays with a value per coil. `coil_side` is the lossless capacitance at the contacts: the
    coil's own and half the cable's. `converter_side` is the capacitance at the pins. The tank capacitor `capacitor` is
    at the coil if `capacitor_at_coil`, otherwise at the converter, in series with `capacitor_resistance`. `inductance`
    and `resistance` belong to the cable.
    """

    coil_side: float | Array
    converter_side: float
    capacitor: float | Array
    capacitor_at_coil: bool
    capacitor_resistance: float = 0.0
    inductance: float = 0.0
    resistance: float = 0.0

    def admittance(self, omega: Array, inductance: Array, resistance: Array) -> tuple[ComplexArray, ComplexArray]:
        """Return the admittance (S) at the pins, and the coil's voltage divided by the voltage at the pins.

        `inductance` (H) and `resistance` (ohm) of the coils are at the angular frequency `omega` (rad/s). Kirchhoff's
        laws for the chain of coil, cable and converter (textbook).
        """
        around = 1j * omega
        branch = around * self.capacitor / (1.0 + around * (self.capacitor * self.capacitor_resistance))
        coil_end = around * self.coil_side + 1.0 / (resistance + around * inductance)
        pin_end = around * self.converter_side
        coil_end, pin_end = (coil_end + branch, pin_end) if self.capacitor_at_coil else (coil_end, pin_end + branch)
        behind = 1.0 + coil_end * (self.resistance + around * self.inductance)
        return np.asarray(pin_end + coil_end / behind), np.asarray(1.0 / behind)

    def tank_inductance(self, inductance: Array) -> Array:
        """Return the inductance (H) that oscillates with the tank capacitor.

        It is the coil's inductance. If the cable lies between coil and capacitor, the cable's inductance is added.
        """
        return inductance + (0.0 if self.capacitor_at_coil else self.inductance)

    @property
    def capacitance(self) -> float | Array:
        """Capacitance (F) of the whole tank: tank capacitor, coil side and converter side."""
        return self.coil_side + self.converter_side + self.capacitor

    @np.errstate(divide="ignore", invalid="ignore")  # NaN for a negative inductance
    def resonance(self, inductance: Array) -> Array:
        """Return the angular resonance frequencies (rad/s) of coils with inductances (H): 1 / sqrt(L C).

        Losses and the converter's delay are neglected. NaN for a negative inductance.
        """
        return 1.0 / np.sqrt(self.tank_inductance(inductance) * self.capacitance)


@record
class Oscillation:
    """Operating point of a tank.

    `frequency` is in Hz; `inductance` (H) and `resistance` (ohm) are the coil's at this frequency.
    `parallel_resistance` (ohm) is at the pins; `quality_factor` has no unit. `coil_share` is the voltage amplitude at
    the coil's contacts divided by the amplitude at the pins. An overdamped tank does not oscillate: `exists` is False,
    and all fields are NaN except the coil's and the quality factor (sqrt(L/C) / R).
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
    """Operating points of tanks as arrays of one shape. The fields are explained at `Oscillation`."""

    frequency: Array
    inductance: Array
    resistance: Array
    parallel_resistance: Array
    quality_factor: Array
    coil_share: Array

    def as_list(self) -> list[Oscillation]:
        """Return each tank as an `Oscillation`, in the order of the arrays."""
        columns = (self.frequency, self.inductance, self.resistance, self.parallel_resistance, self.quality_factor,
                   self.coil_share)
        return [Oscillation(*row) for row in zip(*(column.ravel().tolist() for column in columns), strict=True)]


Terminals = Callable[[Array], tuple[Array, Array]]
"""Function of frequencies (Hz) that returns inductances (H) and resistances (ohm) of coils at their contacts, all of
one shape.
"""

LOWEST_SHARE = 0.05
"""Lowest frequency of an oscillation, divided by the resonance frequency without loss and delay (`Network.resonance`).

If the phase condition is met only at lower frequencies, the tank does not oscillate. Near direct current, every tank
meets the condition.
"""

STEPS = 40  # Steps after which a tank counts as not oscillating: the shortest end below `LOWEST_SHARE`

STRIDE, STRIDE_OVER_CABLE = 0.3, 0.1
"""Largest change of the frequency in one step of `oscillate`, divided by the frequency: without and with a cable.

With a cable the step is shorter, so that no zero of the phase condition is skipped.
"""

CLOSED = 1e3  # Largest phase error (rad), over the tolerance of the frequency, of a tank that oscillates

EXACTLY = 1e-9  # Last relative change of a frequency; the error is far less, as for all secant methods


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # tanks that do not oscillate are NaN
def oscillate(
    network: Network, terminals: Terminals, delay: float, start: Array, tolerance: float = EXACTLY
) -> Oscillations:
    """Solve the frequencies at which the phase of the tank matches the drive: arg Y = -omega delay.

    Y is the admittance at the converter's pins. If a cable causes several such frequencies, the lowest is returned.

    Parameters
    ----------
    network : Network
        circuit between coils and converter
    terminals : Terminals
        inductances and resistances of the coils at each frequency
    delay : float
        delay of the drive after the voltage (s)
    start : array
        estimate of the frequency (Hz), such as the resonance without loss. All results have its shape.
    tolerance : float, optional
        relative change of the frequency at which the iteration ends

    Notes
    -----
    Without delay, the admittance at the pins is real at this frequency. For a tank without cable the frequency is
    SNOSCY9A's 1/(2 pi sqrt(L C)) sqrt(1 - 1/Q^2 - delay/(Q sqrt(L C))), with a delay of 5 ns.
    """
    # Secant method, because the derivative's formula is long with a cable. It acts on the part of Y that is out of
    # phase with the drive, over omega. That part is nearly linear in omega about a resonance, while the phase turns
    # faster the better the coil is. Beyond a delay of a sixth of a period its slope reverses.
    before = np.minimum(2.0 * math.pi * start, 1.0 / delay if delay else math.inf)
    first = terminal = terminals(before / (2.0 * math.pi))
    plain = network.resonance(first[0])
    stride = STRIDE_OVER_CABLE if network.inductance else STRIDE

    def apart(omega: Array) -> Array:
        y, _ = network.admittance(omega, *terminal)
        return (y.imag * np.cos(omega * delay) + y.real * np.sin(omega * delay)) / omega

    low = apart(before)
    # in a plain tank without loss that part grows by 2 C / omega
    step = -0.5 * low * before / network.capacitance
    for _ in range(STEPS):
        after = before + np.clip(step, -stride * before, stride * before)
        still = (np.abs(after - before) > tolerance * after) & (after >= LOWEST_SHARE * plain)
        if not np.any(still):
            break
        terminal = terminals(after / (2.0 * math.pi))
        high = apart(after)
        # converged values stay, because rounding would move them, and so do tanks that do not oscillate
        step = np.where(still & (high != low), high * (before - after) / (high - low), 0.0)
        step[~np.isfinite(step)] = 0.0
        before, low = after, high
    y, share = network.admittance(after, *terminal)
    beyond, _ = network.admittance(after * (1.0 + 1e-6), *terminal)
    off = np.remainder(np.angle(y) + after * delay + math.pi, 2.0 * math.pi) - math.pi
    exists = (np.abs(off) <= CLOSED * tolerance) & (after >= LOWEST_SHARE * plain)
    loss = first[1] + (0.0 if network.capacitor_at_coil else network.resistance)
    return Oscillations(
        frequency=np.where(exists, after / (2.0 * math.pi), np.nan), inductance=terminal[0], resistance=terminal[1],
        parallel_resistance=np.where(exists, 1.0 / y.real, np.nan),
        quality_factor=np.where(exists, 0.5 * (beyond.imag - y.imag) / (1e-6 * y.real),
                                plain * network.tank_inductance(first[0]) / loss),
        coil_share=np.where(exists, np.abs(share), np.nan),
    )


def oscillate_at_fixed_inductance(network: Network, inductance: Array, resistance: Array, delay: float) -> Oscillations:
    """Solve operating points of tanks whose coils have a fixed inductance (H) and resistance (ohm) at all frequencies.

    `delay` (s) is the delay of the drive after the voltage.
    """
    start = network.resonance(inductance) / (2.0 * math.pi)
    return oscillate(network, lambda _: (inductance, resistance), delay, start)
