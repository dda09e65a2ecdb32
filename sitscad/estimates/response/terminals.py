"""What the converter sees of every coil at any pose: inductance, resistance, frequency, for many poses at once."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitscad.arrays import Array, ComplexArray
from sitscad.estimates.circuit.neighbours import idle_load
from sitscad.estimates.circuit.tank import Tank
from sitscad.physics.polynomials import Interpolant, chebyshev_points

Impedances = Callable[[Array], ComplexArray]
"""Inductance matrices (H, complex: the imaginary part times -omega is a resistance) of all coils between their
contacts, nothing idle yet, at (n,) frequencies (Hz), one a pose: (n, coils, coils)."""

POINTS = 8  # Chebyshev points in ln f at which what does not depend on the pose is known


def curves(
    low: float, high: float, exact: Callable[[Array], ComplexArray], points: int = POINTS
) -> Callable[[Array], ComplexArray]:
    """`exact`, which takes (m,) frequencies (Hz) and gives (m, ...), through Chebyshev points of ln f between two ends;
    beyond these what it is there.
    """
    values = exact(np.exp(chebyshev_points(math.log(low), math.log(high), points)))
    through = Interpolant(np.log([low]), np.log([high]), values)
    return lambda frequencies: through(np.log(frequencies)[:, None])


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
