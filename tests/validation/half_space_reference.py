"""Coaxial rings of rectangular section over a conducting half-space, by filaments: no modes, no spectra of coils.

Every ring is cut into filaments, each with its own current, as in `filament_reference`; each filament sees the images
of all the others. Over a perfect conductor those are rings again, closed elliptic integrals; over a real one Dodd and
Deeds's integral between every two filaments (J. Appl. Phys. 39, 1968) with Bessel functions of scipy on an even grid.
"""

from __future__ import annotations

import math

import numpy as np
from filament_reference import _mean_squares, cosine_cells, series_impedance

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings


class RingFilaments:
    """Rings at radii and heights (n,) in metres, all of one width and thickness, cut into graded filaments."""

    def __init__(self, radius, height, width, thickness, conductivity, across, through):
        (cx, sx), (cz, sz) = cosine_cells(across), cosine_cells(through)
        x, z = np.repeat(cx, through), np.tile(cz, across)
        self.dx, self.dz = np.repeat(sx, through) * width, np.tile(sz, across) * thickness
        self.r = (radius[:, None] + width * x).ravel()
        self.h = (height[:, None] + thickness * z).ravel()
        self.group, self.count = np.repeat(np.arange(radius.size), x.size), radius.size
        area = np.tile(self.dx * self.dz, radius.size)
        self.resistance = 2.0 * math.pi * self.r / (conductivity * area)
        squared = (self.r[:, None] - self.r) ** 2 + (self.h[:, None] - self.h) ** 2
        own = _mean_squares(x * width, z * thickness, self.dx, self.dz)
        for g in range(radius.size):
            rows = slice(g * x.size, (g + 1) * x.size)
            squared[rows, rows] = own
        self.inductance = coaxial_rings(self.r[:, None], self.r, squared)

    def mirrored(self, wall):
        """Inductances (H) with a perfect conductor at the height `wall` (m), on either side."""
        squared = (self.r[:, None] - self.r) ** 2 + (self.h[:, None] + self.h - 2.0 * wall) ** 2
        return self.inductance - coaxial_rings(self.r[:, None], self.r, squared)

    def over_metal(self, wall, frequency, conductivity, permeability=1.0):
        """Inductances (H, complex) with a half-space of metal that begins at the height `wall` (m) above all rings."""
        from scipy.special import j1

        nearest = wall - self.h.max()
        top = 9.0 / nearest
        count = 2 * math.ceil(top * self.r.max() / math.pi * 2.0) + 200
        k = top * (np.arange(count) + 0.5) / count
        alpha = np.sqrt(k**2 + 2j * math.pi * frequency * MU0 * permeability * conductivity)
        factor = (permeability * k - alpha) / (permeability * k + alpha)
        waves = self.r[:, None] * j1(self.r[:, None] * k) * np.exp(-k * (wall - self.h)[:, None])
        return self.inductance + MU0 * math.pi * (waves * (factor * top / count)) @ waves.T

    def between_metals(self, roof, floor, frequency):
        """Inductances (H, complex) between half-spaces, each a height (m) and a conductivity, with all echoes."""
        from scipy.special import j1

        (top, item), (bottom, other) = roof, floor
        end = 9.0 / min(top - self.h.max(), self.h.min() - bottom)
        count = 2 * math.ceil(end * self.r.max() / math.pi * 2.0) + 200
        k = end * (np.arange(count) + 0.5) / count
        above, below = (
            (k - alpha) / (k + alpha)
            for alpha in (np.sqrt(k**2 + 2j * math.pi * frequency * MU0 * sigma) for sigma in (item, other))
        )
        rings = self.r[:, None] * j1(self.r[:, None] * k)
        up, down = rings * np.exp(-k * (top - self.h)[:, None]), rings * np.exp(-k * (self.h - bottom)[:, None])
        once = np.exp(-k * (top - bottom))
        share = MU0 * math.pi * end / count / (1.0 - above * below * once**2)
        echo = share * above * below * once
        result = (up * (share * above)) @ up.T + (down * (share * below)) @ down.T
        return self.inductance + result + (up * echo) @ down.T + (down * echo) @ up.T

    def impedance(self, inductance, frequency):
        """Impedance (ohm) of all rings in series at a frequency (Hz)."""
        return complex(series_impedance(self.resistance, inductance, self.group, self.count, [frequency])[0])
