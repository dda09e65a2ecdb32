"""What the converter sees of every coil at any pose: inductance, resistance, frequency, for many poses at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from sitscad.arrays import Array, ComplexArray
from sitscad.estimates.circuit.neighbours import idle_load
from sitscad.estimates.circuit.tank import Tank
from sitscad.physics.polynomials import chebyshev_points, shares
from sitscad.physics.resonator import Network, tank_frequencies
from sitscad.record import record

Impedances = Callable[[Array], ComplexArray]
"""Inductance matrices (H, complex: the imaginary part times -omega is a resistance) of all coils between their
contacts, nothing idle yet, at (n,) frequencies (Hz), one a pose: (n, coils, coils)."""

POINTS = 8  # Chebyshev points in ln f at which what does not depend on the pose is known
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
