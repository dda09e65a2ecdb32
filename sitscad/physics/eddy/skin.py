"""How far fields enter a metal's faces and edges: the surface impedance of a target, over frequency.

A face's two sides of a plate act together: currents that run alike on both see coth, opposite ones tanh of half the
thickness in skin depths; the field between the two sheets that stand for them is taken off. An edge is a place where
the field enters from two sides: near it the impedance is larger (`EDGE`), and the wall of a plate thinner than the skin
depth carries nothing of its own (`WALL`). Both laws were fitted to discs of finite elements (tests/validation): with
them the change of inductance is right to 0.4 %, the resistance to 2 %, from foils of a third of a skin depth on. Of
magnetic metals the rise at edges is smaller (`EDGE_OF_MAGNETS`), and their change right to 1.5 % of its size.
"""

from __future__ import annotations

import cmath
import math

from sitscad.physics.constants import MU0
from sitscad.record import record

EDGE, EDGE_FROM = 1.4, 1.65
"""Rise of the impedance at an edge, and the thickness in skin depths at which half of it is there."""

EDGE_OF_MAGNETS = 0.95
"""That rise for a metal of high permeability."""

WALL, MOST_WALL = 1.55, 1e3
"""Thickness in skin depths at which a wall has twice a thick plate's impedance; the most that it has."""


@record
class Skin:
    """A metal at one frequency: what sheets on its faces see.

    `even` and `odd` (m, complex: impedance over j omega mu0) are of currents alike and opposite on both faces, `edge`
    is the rise at an edge, which dies away with `decay` (1/m), `wall` the factor on side walls. `inner` is the part of
    the field between the faces that is none of the skin's, 1 of a metal that is not magnetic (`interior`).
    """

    even: complex
    odd: complex
    edge: float
    decay: complex
    wall: float
    permeability: float = 1.0
    inner: float = 1.0

    def face(self, parity: int) -> complex:
        """Depth (m) for a stream function of that parity across the plate: an odd one's currents run alike."""
        return self.odd if parity == 1 else self.even


def skin(frequency: float, conductivity: float, thickness: float, permeability: float = 1.0) -> Skin:
    """The skin of a plate (thickness in m, conductivity in S/m, relative permeability) at a frequency (Hz)."""
    decay = cmath.sqrt(2j * math.pi * frequency * MU0 * permeability * conductivity)
    half = 0.5 * thickness * decay
    tanh = cmath.tanh(half) if abs(half) < 20.0 else 1.0
    inner = 1.0 if permeability == 1.0 else 1.0 / (1.0 + abs(half) ** 2)
    # coth(x) - 1/x cancels for foils
    opposite = decay * (1.0 / tanh - 1.0 / half) if abs(half) > 0.03 else decay * half / 3.0
    opposite = opposite + decay * (1.0 - inner) / half
    depths = thickness * abs(decay) / math.sqrt(2.0)
    most = EDGE_OF_MAGNETS + (EDGE - EDGE_OF_MAGNETS) / permeability
    edge = most * depths**4 / (depths**4 + EDGE_FROM**4)
    wall = min(1.0 + (WALL / depths) ** 3, MOST_WALL)
    return Skin(1.0 / (decay * tanh), 1.0 / opposite, edge, decay, wall, permeability, inner)
