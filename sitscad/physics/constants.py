"""The constants of nature that the kernels need (SI, CODATA 2018)."""

from __future__ import annotations

import math

MU0 = 4e-7 * math.pi
"""Vacuum permeability in H/m (its pre-2019 exact value: the difference is 5e-10)."""

EPSILON0 = 8.8541878128e-12
"""Vacuum permittivity in F/m."""
