"""How a pad's stiffness goes with its compression, tabulated once a pad: a pose costs a look-up then.

Pieces of third degree with the law's own values and slopes at their ends; the slopes that are handed out are those of
the pieces, so that forces keep an energy. Lengths in thicknesses, stresses in shear moduli.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.mechanics import pad_law
from sitscad.mechanics.balance import Law
from sitscad.record import record

Array = NDArray[np.float64]

FIRST, LAST, PIECES = -0.25, 0.45, 560
"""Strains between which a course is tabulated; beyond, it stays as it is (`pad_law.MOST_STRAIN`), its slope nothing."""

STEP = (LAST - FIRST) / PIECES

SMALL = 1e-6
"""By how much a strain is moved for the slope of the pressure, which is not tabulated."""


@record(eq=False)
class Courses:
    """The law of one pad: pressure by strain, and the tabulated courses of shear along x and y, of their cubic term
    (of both directions alike, so that forces have an energy), and of tilt about x and y; with the stiffness of twist.
    """

    squeeze: pad_law.Compression
    pieces: Array
    twist: float

    def at(self, strain: Array) -> tuple[Array, Array]:
        """The five courses (no unit, as `pad_law` has them) and their slopes at strains (n,), (n, 5) each."""
        part, (value, first, second, third) = self._piece(strain)
        return value + part * (first + part * (second + part * third)), (
            first + part * (2.0 * second + 3.0 * part * third)
        ) / STEP

    def law(self, strain: Array) -> Law:
        """The law at strains (n,), its numbers (n,) each."""
        part, (value, first, second, third) = self._piece(strain)
        values = value + part * (first + part * (second + part * third))
        slopes = (first + part * (2.0 * second + 3.0 * part * third)) / STEP
        bends = (2.0 * second + 6.0 * part * third) / STEP**2
        pressed = (self.squeeze(strain + SMALL) - self.squeeze(strain - SMALL)) / (2.0 * SMALL)
        return Law(self.squeeze(strain), pressed, [*values.T], [*slopes.T], [*bends.T], self.twist)

    def law_at(self, strain: float) -> Law:
        """The same at one strain, in floats."""
        place = (min(max(strain, FIRST), LAST) - FIRST) / STEP
        piece = min(int(place), PIECES - 1)
        part, pieces = place - piece, self.pieces[piece].T.tolist()
        values = [v + part * (p + part * (q + part * r)) for v, p, q, r in pieces]
        slopes = [(p + part * (2.0 * q + 3.0 * part * r)) / STEP for _, p, q, r in pieces]
        bends = [(2.0 * q + 6.0 * part * r) / STEP**2 for _, _, q, r in pieces]
        pressed = (self.squeeze.at(strain + SMALL) - self.squeeze.at(strain - SMALL)) / (2.0 * SMALL)
        return Law(self.squeeze.at(strain), pressed, values, slopes, bends, self.twist)

    def _piece(self, strain: Array) -> tuple[Array, tuple[Array, Array, Array, Array]]:
        """How far (n, 1) strains (n,) have gone into their pieces, and the terms of these (n, 5)."""
        place = (np.fmin(np.fmax(strain, FIRST), LAST) - FIRST) / STEP
        piece = np.minimum(place.astype(np.intp), PIECES - 1)
        one = self.pieces[piece]
        return (place - piece)[:, None], (one[:, 0], one[:, 1], one[:, 2], one[:, 3])


@lru_cache(maxsize=64)
def courses(block: pad_law.Block, bulk_modulus: float) -> Courses:
    """The courses of a block, no unit; the bulk modulus is in shear moduli."""
    # a turn about y raises one end of x, one about x an end of y
    across = block.turned
    shears, tilts = (pad_law.shear(block), pad_law.shear(across)), (pad_law.tilt(across), pad_law.tilt(block))

    def exact(strain: Array) -> Array:
        cubic = 0.5 * (shears[0].cubic(strain) + shears[1].cubic(strain))
        return np.stack([shears[0](strain), shears[1](strain), cubic, tilts[0](strain), tilts[1](strain)], axis=1)

    strain = np.linspace(FIRST, LAST, PIECES + 1)
    value, small = exact(strain), 1e-5
    slope = STEP * (exact(strain + small) - exact(strain - small)) / (2.0 * small)
    rise = np.diff(value, axis=0)
    pieces = np.stack(
        [value[:-1], slope[:-1], 3.0 * rise - 2.0 * slope[:-1] - slope[1:], slope[:-1] + slope[1:] - 2.0 * rise], axis=1
    )
    return Courses(pad_law.compression(block, bulk_modulus), pieces, pad_law.twist(block))
