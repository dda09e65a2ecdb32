"""The constants of nature that the kernels need (SI, CODATA 2018), and the length that they make of a metal."""

from __future__ import annotations

import math

MU0 = 4e-7 * math.pi
"""Vacuum permeability in H/m (its pre-2019 exact value: the difference is 5e-10)."""

EPSILON0 = 8.8541878128e-12
"""Vacuum permittivity in F/m."""


def skin_depth(frequency: float, conductivity: float, permeability: float = 1.0) -> float:
    """Depth (m) at which a field has fallen to 1/e: 1 / sqrt(pi f mu sigma) (Jackson, Classical Electrodynamics,
    section 5.18), frequency in Hz, conductivity in S/m, permeability relative; endless in what does not conduct.
    """
    if conductivity <= 0.0:
        return math.inf
    return 1.0 / math.sqrt(math.pi * frequency * MU0 * permeability * conductivity)

SPEED_OF_LIGHT = 299792458.0
"""Speed of light in vacuum (m/s), exact by the definition of the metre (SI)."""
