"""How far a winding's resistance at frequency can be off: shares of the loss that alternating current adds.

Direct resistance is exact but for the copper itself. What is added to it is computed at so many azimuths or cuts of the
sides, with so many modes: each may be too few by a share that was fitted to random designs of every shape, solved
again with more of everything (tests/validation/resistance_designs.py), and is tested on others that no fit saw.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.estimates.circuit.tank import CoilCircuit
from sitscad.estimates.values import StateEstimate
from sitscad.estimates.winding.losses import ALIKE_ROUNDED, POLYGONS_NEAR_METAL
from sitscad.geometry.shapes import nearest_sides
from sitscad.layout.board import Coil
from sitscad.physics.constants import skin_depth
from sitscad.physics.inductance.spirals import SpiralLayer
from sitscad.physics.loss.proximity import missed_crossings, suited_resolution
from sitscad.record import record
from sitscad.spec.coil import CoilSpec

ALONG = 2e-5
"""Of the resistance at any frequency: lengths and corners of the winding's path."""

MODEL = 0.0015
"""Of the added loss: tracks see each other's crowding as straight ones do. Closed rings and open spirals by
converged filaments (tests/validation/test_alternating_current.py)."""

ENDS = 1.2
"""Of the added loss, times a track's width over the winding's length: what cuts miss where a layer begins or ends."""

MODES = {False: 0.011, True: 0.007}
"""Of the added loss, with usual and fine modes: tracks many skin depths wide or thick."""

WIDE, THICK = 12.0, 3.0
"""Skin depths of width and of thickness at which that share is reached."""

ALONE, ROUNDED, RACETRACK, LONG = 0.017, 0.017, 0.003, 0.009
"""Of the added loss of polygons of one layer and with rounded corners; of racetracks, and of those of which one half
stands for both (ALIKE_ROUNDED turns and more)."""

CROSSING = {4: (0.055, 0.02), 6: (0.038, 0.016), 8: (0.036, 0.013)}
"""Of the added loss of polygons of several layers, by their sides, of fewer than FEW turns and of more: near corners,
where the layers' sides do not lie face to face, they are cut at few places. The sharper the corner, the more."""

LEADS = 0.01
"""Of the leads' resistance: 0.02 to 0.6 % against triangles over copper read back (tests/extraction)."""

METAL, NEAR, NEAR_DISTANCE = 0.03, 0.04, 0.2e-3
"""Of the resistance with metal about, and with metal nearer than that (m), from where the one goes over into the other
as distance over NEAR_DISTANCE rises to FADED: round coils over and between copper, steel
and mirrors by filaments (tests/validation/test_near_metal.py); for other shapes POLYGONS_NEAR_METAL comes on top."""

FADED = 1.5
"""Times a distance up to which a share holds: so far it falls to the next one, that a sweep may not make it jump."""

FEW = 4.0
"""Turns of a layer below which corners are a large part of a polygon."""


@record
class ResistanceBound:
    """What a winding's error is made of: `share` of the added loss at any frequency, `modes` of it where the track of
    that width and thickness (m) is many skin depths; conductivity in S/m.
    """

    share: float
    modes: float
    width: float
    thickness: float
    conductivity: float

    def relative(self, ratio: float, frequency: float) -> float:
        """Relative error, at most, of a resistance that is `ratio` times the direct one at a frequency (Hz)."""
        depth = skin_depth(frequency, self.conductivity)
        reached = min(1.0, max(self.width / (WIDE * depth), self.thickness / (THICK * depth)) ** 2)
        return ALONG + (1.0 - 1.0 / ratio) * (self.share + self.modes * reached)


def resistance_bound(spec: CoilSpec, coil: Coil, spirals: Sequence[SpiralLayer], conductivity: float,
                     tolerance: float) -> ResistanceBound:  # fmt: skip
    """The bound of `losses.winding_losses` with that tolerance of R (3e-2 or 1e-2)."""
    fine = tolerance < 0.02
    share = MODEL + (_round(spirals, conductivity, tolerance) if spirals else _bent(spec, len(coil.windings)))
    thickness = max(winding.thickness for winding in coil.windings)
    return ResistanceBound(share, MODES[fine], spec.trace_width, thickness, conductivity)


def state_error(bound: ResistanceBound, circuit: CoilCircuit, state: StateEstimate, metal: float) -> float:
    """Relative error, at most, of the resistance between the contacts in a state: the winding's, a share of the leads',
    and `metal` where there is some (`near_metal_error`).
    """
    frequency = state.frequency
    winding = circuit.winding_resistance(frequency)
    leads = circuit.leads.resistance_at(frequency, circuit.conductivity)
    own = bound.relative(winding / circuit.resistance, frequency)
    return (own * winding + LEADS * leads) / state.resistance + metal


def near_metal_error(spec: CoilSpec, nearest: float) -> float:
    """Relative error, at most, that metal no nearer than `nearest` (m) to the copper's middle adds to a resistance."""
    found = METAL + (NEAR - METAL) * _faded(nearest / NEAR_DISTANCE)
    if not spec.outline.is_round:
        found += max(row[2] * _faded(nearest / (row[0] * spec.trace_width)) for row in POLYGONS_NEAR_METAL)
    return found


def _faded(reach: float) -> float:
    """1 up to a reach of 1, 0 from FADED on, and straight between."""
    return min(1.0, max(0.0, (FADED - reach) / (FADED - 1.0)))


def _round(spirals: Sequence[SpiralLayer], conductivity: float, tolerance: float) -> float:
    length = 2.0 * math.pi * math.fsum(s.turns * (s.radius - 0.5 * s.pitch * s.turns) for s in spirals)
    cuts = suited_resolution(spirals, conductivity, tolerance).cuts
    return missed_crossings(spirals, cuts) + ENDS * spirals[0].width / length


def _bent(spec: CoilSpec, layers: int) -> float:
    """The bound's share for how the tracks bend, relative."""
    if not spec.outline.sides:
        return LONG if min(spec.layer_turns) >= ALIKE_ROUNDED else RACETRACK
    if spec.corner_radius >= 0.5 * spec.trace_width:
        return ROUNDED
    if layers == 1:
        return ALONE
    few, many = CROSSING[nearest_sides(CROSSING, spec.outline.sides)[0]]
    return few if min(spec.layer_turns) < FEW else many
