"""Constants of nature for the kernels (SI, CODATA 2018), and the skin depth of a metal."""

from __future__ import annotations

import math

MU0 = 4e-7 * math.pi
"""Vacuum permeability in H/m: the value before 2019, which differs from the present value by 5e-10 (ratio)."""

EPSILON0 = 8.8541878128e-12
"""Vacuum permittivity in F/m."""


def skin_depth(frequency: float, conductivity: float, permeability: float = 1.0) -> float:
    """Return the depth (m) at which a field in metal has fallen to 1/e. Infinite if the material does not conduct.

    Parameters
    ----------
    frequency : float
        in hertz
    conductivity : float
        in S/m
    permeability : float, optional
        relative to vacuum

    Notes
    -----
    1 / sqrt(pi f mu sigma) (Jackson, Classical Electrodynamics, section 5.18).
    """
    if conductivity <= 0.0:
        return math.inf
    return 1.0 / math.sqrt(math.pi * frequency * MU0 * permeability * conductivity)

SPEED_OF_LIGHT = 299792458.0
"""Speed of light in vacuum (m/s), exact by the definition of the metre (SI)."""
