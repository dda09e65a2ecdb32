"""What the converter sees of every coil at any pose: inductance, resistance, frequency, for many poses at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

from sitscad.arrays import Array, ComplexArray
from sitscad.estimates.circuit.neighbours import idle_load
from sitscad.estimates.circuit.tank import Tank
from sitscad.physics.polynomials import chebyshev_points, shares
from sitscad.physics.resonator import LOWEST_SHARE, Network, oscillate
from sitscad.record import record

Impedances = Callable[[Array], ComplexArray]
"""Inductance matrices (H, complex: the imaginary part times -omega is a resistance) of all coils between their
contacts, nothing idle yet, at (n,) frequencies (Hz), one a pose: (n, coils, coils)."""

POINTS = 8  # Chebyshev points in ln f at which what does not depend on the pose is known
FEW = 8  # Poses up to which the frequency of a tank is found one by one
MOST_SLOPE = 0.5  # Change of the frequency that is found with the one that was taken, up to which that is believed


def curves(
    low: float, high: float, exact: Callable[[Array], ComplexArray], points: int = POINTS
) -> Callable[[Array], ComplexArray]:
    """`exact`, which takes (m,) frequencies (Hz) and gives (m, ...), through Chebyshev points of ln f between two ends;
    beyond these what it is there.
    """
    places = chebyshev_points(math.log(low), math.log(high), points)
    values = np.asarray(exact(np.exp(places)), dtype=complex)
    return lambda frequencies: np.asarray(
        np.tensordot(shares(places, np.log(np.clip(frequencies, low, high))), values, axes=1))


@record(eq=False)
class Terminals:
    """All coils at some poses as the converter sees them, (poses, coils) each: inductance (H), resistance (ohm) at
    `frequency` (Hz), where the tank runs, its parallel resistance (ohm) at the pins; NaN where no tank oscillates.
    """

    inductance: Array
    resistance: Array
    frequency: Array
    parallel_resistance: Array


def at_contacts(active: int, impedances: ComplexArray, frequencies: Array, load: ComplexArray) -> tuple[Array, Array]:
    """Inductance (H) and resistance (ohm) of one coil of (n, coils, coils) inductance matrices, the others idle, their
    contacts closed by (n,) loads (ohm).
    """
    omega = 2.0 * math.pi * frequencies
    own = impedances[:, active, active]
    others = [i for i in range(impedances.shape[1]) if i != active]
    if others:
        loops = impedances[:, others][:, :, others] + np.eye(len(others)) * (load / (1j * omega))[:, None, None]
        towards = impedances[:, active, others]
        own = own - np.einsum("ni,ni->n", towards, np.linalg.solve(loops, towards[..., None])[..., 0])
    return own.real, -omega * own.imag


def at_frequencies(impedances: Impedances, frequencies: Array, tank: Tank) -> tuple[Array, Array]:
    """Inductance (H) and resistance (ohm) at the contacts, (n, coils), each coil at its own (n, coils) frequency."""
    found = [
        at_contacts(k, impedances(at), at, idle_load(2.0 * math.pi * at, tank.readout))
        for k, at in enumerate(frequencies.T)
    ]
    inductance, resistance = (np.stack(parts, axis=1) for parts in zip(*found, strict=True))
    return inductance, resistance


def oscillating(impedances: Impedances, networks: Sequence[Network], tank: Tank, start: Array) -> Terminals:
    """Every coil in its tank, from about the frequencies `start` (n, coils; Hz)."""
    delay, frequency = tank.converter.limit("drive_delay"), start
    last: tuple[Array, Array] | None = None
    for _ in range(6):
        inductance, resistance = at_frequencies(impedances, frequency, tank)
        found = [
            tank_frequencies(network, own, lost, delay)
            for network, own, lost in zip(networks, inductance.T, resistance.T, strict=True)
        ]
        after, parallel = (np.stack(parts, axis=1) for parts in zip(*found, strict=True))
        moved = np.abs(after / frequency - 1.0)
        if not np.any(moved > 1e-9):
            break
        last, frequency = (frequency, after), _next(frequency, after, last)
    still = ~np.isfinite(after)
    return Terminals(np.where(still, np.nan, inductance), np.where(still, np.nan, resistance), after, parallel)


@np.errstate(divide="ignore", invalid="ignore")
def _next(given: Array, found: Array, last: tuple[Array, Array] | None) -> Array:
    """Frequencies (Hz) to try after those that were given led to those that were found: what is found, by the secant
    rule where the last time tells how it goes with what is given; unchanged where nothing was found.
    """
    ahead = found
    if last is not None:
        slope = (found - last[1]) / (given - last[0])
        ahead = np.where(np.abs(slope) < MOST_SLOPE, given + (found - given) / (1.0 - slope), found)
    return np.where(np.isfinite(ahead), ahead, np.where(np.isfinite(found), found, given))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # what does not oscillate is NaN, which is said
def tank_frequencies(network: Network, inductance: Array, resistance: Array, delay: float) -> tuple[Array, Array]:
    """`physics.resonator.oscillate` for (n,) coils: frequency (Hz) and parallel resistance (ohm), NaN where there is no
    oscillation. The secant rule on arg Y + omega delay, from the plain resonance.
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
