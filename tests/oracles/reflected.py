"""Change of a coil's impedance by metal, for comparisons with published values."""

from __future__ import annotations

import math

import numpy as np

from sitscad.kernels.electromagnetics.metal.half_spaces import reflected_inductances


def reflected_impedance(spectrum, frequency, above, below):
    """Return the change of inductance (H) and of resistance (ohm) at a frequency (Hz) by reflectors above and below.

    Both act together. Distances count from z = 0 outwards.
    """
    change = complex(reflected_inductances(spectrum, np.array([frequency]), above, below, (0.0,))[0, 0])
    return change.real, -2.0 * math.pi * frequency * change.imag
