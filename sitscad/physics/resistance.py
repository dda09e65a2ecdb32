"""Direct-current resistance of tracks and plated holes, and the skin depth."""

from __future__ import annotations

import math

from sitscad.physics.constants import MU0

COPPER_CONDUCTIVITY = 58.0e6
"""Annealed copper at 20 C in S/m (NBS Handbook 100: 0.017241 ohm mm2/m)."""


def track_resistance(length: float, width: float, thickness: float, conductivity: float) -> float:
    """Resistance (ohm) of a track with uniform current: length / (conductivity width thickness), lengths in metres."""
    return length / (conductivity * width * thickness)


def via_resistance(length: float, drill: float, plating: float, conductivity: float) -> float:
    """Resistance (ohm) of a plated hole's barrel between two layers: drill is its outer diameter, lengths in metres."""
    plating = min(plating, drill / 2.0)
    return length / (conductivity * math.pi * plating * (drill - plating))


def skin_depth(frequency: float, conductivity: float, permeability: float = 1.0) -> float:
    """Skin depth (m): 1 / sqrt(pi f mu sigma)."""
    return 1.0 / math.sqrt(math.pi * frequency * MU0 * permeability * conductivity)


def strip_resistance_ratio(frequency: float, width: float, thickness: float, conductivity: float) -> float:
    """R(f) / R(0) of a lone flat strip (width, thickness in metres), for leads; never below 1.

    Joins two known ends smoothly: uniform current, and a skin of one depth round the perimeter whose current crowds to
    the edges (factor 1.3). Up to 8 % low for tracks of 80 to 150 um, 15 % for 300 um, at 10 MHz, against a mode solve.
    """
    depth = skin_depth(frequency, conductivity)
    crowded = 1.3 * width * thickness / (2.0 * depth * (width + thickness))
    return (1.0 + crowded**4) ** 0.25
