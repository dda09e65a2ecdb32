"""How a pad's stiffness goes with its compression, tabulated once a pad: a pose costs a look-up then.

Pieces of third degree with the law's own values and slopes at their ends; the slopes that are handed out are those of
the pieces, so that forces keep an energy. Lengths in thicknesses, stresses in shear moduli.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sitscad.mechanics import pad_law
from sitscad.record import record

Array = NDArray[np.float64]

FIRST, LAST, PIECES = -0.25, 0.45, 560
"""Strains between which a course is tabulated; beyond, it stays as it is (`pad_law.MOST_STRAIN`), its slope nothing."""


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
        step = (LAST - FIRST) / PIECES
        place = (np.fmin(np.fmax(strain, FIRST), LAST) - FIRST) / step
        piece = np.minimum(place.astype(np.intp), PIECES - 1)
        part = (place - piece)[:, None]
        one = self.pieces[piece]
        first, second, third = one[:, 1], one[:, 2], one[:, 3]
        return one[:, 0] + part * (first + part * (second + part * third)), (
            first + part * (2.0 * second + 3.0 * part * third)
        ) / step


@lru_cache(maxsize=64)
def courses(block: pad_law.Block, bulk_modulus: float) -> Courses:
    """The courses of a block, no unit; the bulk modulus is in shear moduli."""
    # a turn about y raises one end of x, one about x an end of y
    across = block.turned
    shears, tilts = (pad_law.shear(block), pad_law.shear(across)), (pad_law.tilt(across), pad_law.tilt(block))

    def exact(strain: Array) -> Array:
        cubic = 0.5 * (shears[0].cubic(strain) + shears[1].cubic(strain))
        return np.stack([shears[0](strain), shears[1](strain), cubic, tilts[0](strain), tilts[1](strain)], axis=1)

    strain, step = np.linspace(FIRST, LAST, PIECES + 1), (LAST - FIRST) / PIECES
    value, small = exact(strain), 1e-5
    slope = step * (exact(strain + small) - exact(strain - small)) / (2.0 * small)
    rise = np.diff(value, axis=0)
    pieces = np.stack(
        [value[:-1], slope[:-1], 3.0 * rise - 2.0 * slope[:-1] - slope[1:], slope[:-1] + slope[1:] - 2.0 * rise], axis=1
    )
    return Courses(pad_law.compression(block, bulk_modulus), pieces, pad_law.twist(block))
