"""What a target that moves sideways, at its height at rest, changes of the coils' inductances: so arrays tell shear."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from sitscad.arrays import ComplexArray
from sitscad.estimates.states.assembly import at_rest, warmed
from sitscad.estimates.states.finite_target import Move, shares_of_change
from sitscad.estimates.states.window import through_window
from sitscad.estimates.winding.methods import reflected_by, winding_geometry
from sitscad.estimates.winding.solved import LEAST_DISTANCE
from sitscad.layout.board import Layout
from sitscad.physics.metal.half_spaces import raised_inductances, reflected_inductances
from sitscad.record import replace
from sitscad.spec.places import gathered


def moved_changes(
    layout: Layout, moves: Sequence[Move], frequency: float, is_solved: bool = False
) -> Mapping[str, tuple[float, ...]]:
    """Changes, by coil, of inductance (H) at a frequency (Hz) for every move (x, y) of the target (m) from rest, by
    `target_effects`; none without a target.
    """
    if at_rest(layout.spec) is None:
        return {}
    still, *found = target_effects(layout, [(0.0, 0.0), *moves], [0.0], frequency, is_solved)[0].real
    return {p.name: tuple(float(one[k] - still[k]) for one in found)
            for k, p in enumerate(layout.spec.array.placements)}


def target_effects(
    layout: Layout, moves: Sequence[Move], heights: Sequence[float], frequency: float, is_solved: bool = False,
    is_rough: bool = False,
) -> ComplexArray:
    """What the target changes of every coil's inductance (H, complex) when it has moved by (x, y) and by a height (m)
    from rest: (heights, moves, coils).

    As in the states themselves (`Estimates.is_solved`) the target is solved, or its effect is that of an endless plate
    times the share that the finite one has at the coil's place (`finite_target`), its loss left out, and so is what
    crowding of the current adds. Every height is solved for all moves at once.
    """
    spec = warmed(layout.spec, layout.spec.requirements.temperature)
    if is_solved:
        from sitscad.estimates.states.solved_target import own_changes  # a solver, loaded for nothing else

        poses = np.zeros((len(heights), len(moves), 6))
        poses[:, :, :2], poses[:, :, 2] = np.array(moves), np.array(heights)[:, None]
        solved = own_changes(replace(layout, spec=spec), poses.reshape(-1, 6), frequency)
        return solved.reshape(len(heights), len(moves), -1)
    spec, rest = gathered(spec), at_rest(spec)
    assert rest is not None
    over = rest.above
    assert over is not None
    layers = [winding.z for winding in layout.coils[0].windings]
    gaps, floor = [over.distance + z for z in heights], -math.inf if rest.below is None else -rest.below.distance
    shares = shares_of_change(spec, layers, gaps, floor, moves, is_rough)
    nearest = over.distance + min(heights) - max(layers)
    if rest.below is not None:
        nearest = min(nearest, rest.below.distance + min(layers))
    spectrum = reflected_by(
        winding_geometry(spec.coil, replace(layout.coils[0], series=())), max(nearest, LEAST_DISTANCE), is_rough
    )
    at = np.array([frequency])
    bare = reflected_inductances(spectrum, at, None, rest.below, (0.0,))[0, 0].real
    whole = raised_inductances(spectrum, frequency, over, rest.below, np.array(heights)).real - bare
    found = (whole[:, None, None] * shares).astype(complex)
    for place, p in enumerate(spec.array.placements):
        found[:, :, place] = through_window(layout, p.name, found[:, :, place].real)
    return found
