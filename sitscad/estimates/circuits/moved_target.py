"""Inductance changes by a moving target, for screening.

Each change is the change by an infinite plate times the ratio of the finite target to this plate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import replace
from sitscad.estimates.circuits.solved_winding import LEAST_DISTANCE, shared_spectrum
from sitscad.estimates.targets.assembly import at_rest, warmed
from sitscad.estimates.targets.finite_target import Move, shares_of_change
from sitscad.estimates.targets.window import through_window
from sitscad.estimates.windings.methods import reflected_by, winding_geometry
from sitscad.kernels.electromagnetics.metal.half_spaces import raised_inductances, reflected_inductances
from sitscad.layout.board import Layout


def target_effects(layout: Layout, moves: Sequence[Move], heights: Sequence[float], frequency: float) -> Array:
    """Return changes of every coil's inductance (heights, moves, coils; H) by a moved target.

    The target has moved by (x, y) and by a height (m) from rest; the frequency is in Hz. The change is an infinite
    plate's times the finite target's ratio at the coil's place (`finite_target`). Loss and the addition of current
    crowding are left out. Each height is solved for all moves at once.
    """
    spec = warmed(layout.spec, layout.spec.requirements.temperature)
    rest = at_rest(spec)
    assert rest is not None
    over = rest.above
    assert over is not None
    layers = [winding.z for winding in layout.coils[0].windings]
    gaps, floor = [over.distance + z for z in heights], -math.inf if rest.below is None else -rest.below.distance
    ratios = shares_of_change(spec, layers, gaps, floor, moves)
    distances = [over.distance + min(heights) - max(layers)]
    if rest.below is not None:
        distances.append(rest.below.distance + min(layers))
    nearest = max(min(distances), LEAST_DISTANCE)
    geometry = winding_geometry(spec.coil, replace(layout.coils[0], series=()))
    spectrum = reflected_by(geometry, nearest, True) if geometry.spirals else shared_spectrum(geometry, nearest)
    at = np.array([frequency])
    metal_change = reflected_inductances(spectrum, at, None, rest.below, (0.0,))[0, 0].real
    whole = raised_inductances(spectrum, frequency, over, rest.below, np.array(heights)).real - metal_change
    effects = np.asarray(whole[:, None, None] * ratios)
    for place, p in enumerate(spec.array.placements):
        effects[:, :, place] = through_window(layout, p.name, effects[:, :, place])
    return effects
