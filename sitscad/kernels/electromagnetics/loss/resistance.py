"""Resistance of tracks and plated holes for direct current, and of straight tracks and pairs at any frequency."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss, mode_system
from sitscad.kernels.electromagnetics.loss.track_modes import Cut, suited_modes

COPPER_CONDUCTIVITY = 58.0e6
"""Conductivity of annealed copper at 20 C (S/m; NBS Handbook 100: 0.017241 ohm mm2/m)."""

COPPER_TEMPERATURE_COEFFICIENT = 3.93e-3
"""Rise of copper's resistivity per kelvin, divided by the resistivity at 20 C (1/K; NBS Handbook 100)."""


LANCZOS_STEPS = 30
"""Largest number of steps of the Lanczos recursion for the loss of single tracks and pairs."""


def conductivity_at(temperature: float, conductivity: float = COPPER_CONDUCTIVITY,
                    coefficient: float = COPPER_TEMPERATURE_COEFFICIENT) -> float:
    """Return the conductivity (S/m) of a metal at a temperature (degrees Celsius), from `conductivity` at 20 C.

    The resistivity is linear in temperature, with `coefficient` (1/K; NBS Handbook 100). Raises ValueError if the
    resistivity would not be positive.
    """
    factor = 1.0 + coefficient * (temperature - 20.0)
    if not factor > 0.0:
        raise ValueError(f"a temperature of {temperature:g} C is out of range")
    return conductivity / factor


@lru_cache(maxsize=64)
def bend_squares(turn: float) -> float:
    """Return the resistance of a sharp bend minus the resistance of its centre line, in squares (negative).

    A square is a piece of track as long as it is wide.

    Notes
    -----
    Direct current cuts the corner. For a turn (rad) of pi a the result is 2/pi (psi((1 + a)/2) - psi(1/2)) - tan(pi a /
    2), -0.441 for a right angle. Derived here from the conformal map dz/du = tanh^a(u/2) of a straight strip (Hall,
    Thin Solid Films 1, 1967, has bends by such maps).
    """
    a = abs(turn) / math.pi
    u = np.linspace(0.0, 24.0, 4801)[1:]
    # 1 - tanh^a(u / 2), from u = s^4 so that the root at 0 does no harm
    s = u / 24.0
    rest = (1.0 - np.tanh(12.0 * s**4) ** a) * 96.0 * s**3
    kappa = float((np.sum(rest) - 0.5 * rest[-1]) * (s[1] - s[0]))
    return 2.0 * kappa / math.pi - math.tan(0.5 * abs(turn))


def via_resistance(length: float, drill: float, plating: float, conductivity: float) -> float:
    """Return the resistance (ohm) of a plated hole's barrel for direct current.

    It is the length divided by conductivity (S/m) and area of the ring (textbook). `drill` is the outer diameter of the
    barrel, `plating` its wall thickness; lengths are in metres.
    """
    plating = min(plating, drill / 2.0)
    return length / (conductivity * math.pi * plating * (drill - plating))


@lru_cache(maxsize=64)
def lone_track_loss(width: float, thickness: float, conductivity: float) -> ProximityLoss:
    """Return the resistance and inductance per metre (ohm, H) of a single straight track, by frequency.

    R is within 1 % up to 10 MHz. Width and thickness are in metres, the conductivity in S/m. The current density is
    computed by `current_modes`.
    """
    modes = suited_modes(width, thickness, width, skin_depth(10e6, conductivity), True)
    ones = np.ones(1)
    cut = Cut(0.0 * ones, 0.0 * ones, width * ones, thickness * ones, ones, 0.0 * ones)
    return mode_system(cut, None, conductivity, modes).loss(LANCZOS_STEPS)


@lru_cache(maxsize=64)
def pair_loss(width: float, thickness: float, across: float, height: float, conductivity: float) -> ProximityLoss:
    """Return resistance and inductance per metre (ohm, H) of two straight tracks with opposite currents, by frequency.

    `across` and `height` (m) are the distances of the tracks' centres along the width and through the board. The tracks
    are equal. The current density is computed by `current_modes`.
    """
    gap = height if height > 0.0 else max(across - width, 0.1 * width) + 0.25 * width
    modes = suited_modes(width, thickness, gap, skin_depth(10e6, conductivity), True)
    two = np.ones(2)
    cut = Cut(np.array([0.0, across]), np.array([0.0, height]), width * two, thickness * two, two, 0.0 * two)
    return mode_system(cut, None, conductivity, modes, current=np.array([1.0, -1.0])).loss(LANCZOS_STEPS)
