"""By how much a pad of Ogden's rubber of one term differs from a neo-Hookean one of the same modulus at rest.

W = (2 mu / alpha^2) (sum of the stretches to the power alpha - 3) (Ogden 1972); 2 is neo-Hookean. Two terms are
textbook: a bar's -(alpha - 2)/4 of the strain, and (alpha^2 - 4)/24 of the square of a shear. What a flat pad squeezes
out is sheared by three (disc) to six (strip) times strain and place over thickness, whence 13 to 14 times the square of
the shape factor. What they leave open is fitted to our own finite elements of exponents 2 to 4 (tests/validation/
ogden_figures.csv). Strains are of the pad's thickness; nothing here has a unit.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sitscad.record import record

Array = NDArray[np.float64]
Number = TypeVar("Number", float, Array)

NEO_HOOKEAN = 2.0
"""The exponent with which nothing differs."""

MOST_OBLONG = 1.0 / 3.0
"""Oblongness (two to one) up to which the fit was made; held beyond."""


@record
class Ogden:
    """How a pad of an exponent in a film of another differs by strain, from the pad's shape factor, how `round` and how
    oblong (-1 to 1, see `pad_law.Block`) its face is, and how much of a wide rim it has (`rimmed`, 0 to 1).
    """

    exponent: float
    skin_exponent: float
    shape_factor: float
    round: float = 0.0
    oblong: float = 0.0
    rimmed: float = 0.0

    @property
    def hardening(self) -> float:
        """What the square of a shear adds to the force per shear: (alpha^2 - 4)/24."""
        return _hardening(self.exponent)

    @property
    def film_hardening(self) -> float:
        """The same of the film."""
        return _hardening(self.skin_exponent)

    def pressure(self, strain: Number) -> Number:
        """Factor on the pad's pressure."""
        flat = 15.1 * self.shape_factor**2 * (1.0 - 0.215 * self.round + 2.28 * self._oblong**2)
        linear = 0.272 * (1.0 - 0.22 * self.rimmed)
        return 1.0 + self._more(strain, linear, 1.0 + flat + 5.6 * strain)

    def shear(self, strain: Number) -> Number:
        """What is added to the pad's stiffness of shear, in parts of that at rest."""
        flat = 8.7 * self.shape_factor**2 * (1.0 - 2.5 * self._oblong)
        given_way = 1.0 - (strain / 0.43) ** 6
        return self._more(strain, 0.29 * (1.0 - 0.43 * self.rimmed), (5.0 + flat + 3.3 * self.rimmed) * given_way)

    def tilt(self, strain: Number) -> Number:
        """Factor on the pad's stiffness of tilt: that of the slope of the pressure rather than its own."""
        square = self.shape_factor**2
        flat = 29.3 * square * (1.0 - 0.43 * self._oblong - 0.15 * self.round)
        return 1.0 + self._more(strain, 0.465, 4.9 + flat + (15.9 - 30.4 * square) * strain)

    def film_pressure(self, strain: Number) -> Number:
        """Factor on what a film bears."""
        return 1.0 + (2.2 * self.film_hardening + 1.4 * self.hardening) * strain * strain

    def film_shear(self, strain: Number) -> Number:
        """Factor on a film's stiffness of shear."""
        linear = 0.31 * (self.skin_exponent - NEO_HOOKEAN)
        return 1.0 - linear * strain + 11.3 * self.film_hardening * strain * strain

    def film_tilt(self, strain: Number) -> Number:
        """Factor on a film's stiffness of tilt."""
        return 1.0 + (2.8 * self.film_hardening + 5.9 * self.hardening) * strain * strain

    @property
    def _oblong(self) -> float:
        return min(max(self.oblong, -MOST_OBLONG), MOST_OBLONG)

    def _more(self, strain: Number, linear: float, square: Number) -> Number:
        # Softer at first, like a bar, then stiffer; below 2 stiffer, then softer, and never by all that there is.
        more = self.hardening * square * strain * strain
        if self.hardening < 0.0:
            more = more / (1.0 - more)
        return more - (self.exponent - NEO_HOOKEAN) * linear * strain


def _hardening(exponent: float) -> float:
    return (exponent * exponent - 4.0) / 24.0
