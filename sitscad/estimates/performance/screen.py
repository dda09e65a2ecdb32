"""Performance at the screen level: coil frequencies by a surrogate, from correction ratios of an infinite plate.

Full checks and documents use the response model instead. For every coil, a slightly tilted target counts as a level
target. Its height is taken over the middle of the area that target and coil share. `NEARLY` is the relative error of
the results.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import compress, product

import numpy as np

from sitscad.assembly.places.state import PRESSED, REST
from sitscad.basics.arrays import Array
from sitscad.estimates.circuits.moved_target import target_effects
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.loads.working_range import required_range
from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.targets.assembly import warmed
from sitscad.kernels.electromagnetics.polynomials import Interpolant, chebyshev_points
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.kernels.mechanics.elastomer import VALID_STRAIN
from sitscad.layout.board import Layout
from sitscad.spec.places import shared_middles

NEARLY = 0.08
"""Relative error of noise and drift at the screen level."""

HEIGHTS = 4
"""Number of heights of the target at which the surrogate is computed, down to `DEPTH`."""

PLACES = 3
"""Number of places of the target along x, and along y, at which the surrogate is computed."""

REACH = 0.25
"""Largest lateral displacement of the target from rest in the surrogate, in pad thicknesses."""

DEEPER = 10
"""Additional heights of the surrogate, per pad thickness, below `DEPTH`."""

AMPLY = 1.02
"""Lowest height of the surrogate below rest, over the target's travel under the required force."""

LIFTED = 0.1
"""Highest height of the surrogate above rest, in pad thicknesses, for edges that a tilt lifts."""

DEPTH = VALID_STRAIN + LIFTED
"""Least distance below rest, in pad thicknesses, down to which the surrogate is computed."""


@one_thread
def surrogate(layout: Layout, estimates: Estimates) -> Callable[[Array], Array]:
    """Return a function of poses (n, 6; m, rad) whose values are the coils' frequencies (n, coils; Hz).

    Every coil must have a state at rest. The surrogate interpolates ln(frequency / frequency at rest) between Chebyshev
    points of x, y and z. Only points with x = 0 or y = 0 are computed. At other points, the changes along both axes are
    added.
    """
    spec = layout.spec
    pad = spec.elastomer
    assert pad is not None
    depth = max(DEPTH, AMPLY * -(estimates.pressed_place or 0.0) / pad.thickness)
    count = HEIGHTS + math.ceil(DEEPER * (depth - DEPTH))
    low, high, side = -depth * pad.thickness, LIFTED * pad.thickness, REACH * pad.thickness
    heights, sides = chebyshev_points(low, high, count), chebyshev_points(-side, side, PLACES)
    middle = PLACES // 2
    on_axes = [middle in point for point in product(range(PLACES), repeat=2)]
    moves = [(0.0, 0.0), *compress(product(sides.tolist(), sides.tolist()), on_axes)]
    rest = [coil.states[REST] for coil in estimates.coils]
    inductance, frequency = np.array([(state.inductance, state.frequency) for state in rest]).T
    effect = target_effects(layout, moves, [0.0, *map(float, heights)], float(frequency.mean()))
    since_rest = np.zeros((count, PLACES * PLACES, effect.shape[-1]))
    since_rest[:, on_axes] = effect[1:, 1:] - effect[0, 0]
    change = since_rest.reshape(count, PLACES, PLACES, -1).transpose(1, 2, 0, 3)
    change = change[:, middle, None] + change[None, middle] - change[middle, middle]
    values = -0.5 * np.log1p(np.maximum(change / inductance, -0.9)) * _pull(estimates.coils)
    ends = np.array([-side, -side, low]), np.array([side, side, high])
    through = [Interpolant(*ends, values[..., k]) for k in range(values.shape[-1])]
    middles = np.array([(at.x, at.y) for at in shared_middles(spec)])  # (coils, 2; m), at rest

    def frequencies(poses: Array) -> Array:
        changes = np.empty((len(poses), len(middles)))
        for k, at in enumerate(middles):  # middle of the area that coil and target share at rest
            changes[:, k] = through[k](np.column_stack([poses[:, :2], _height_over(poses, at)]))
        return np.asarray(frequency * np.exp(changes))

    return frequencies


def _height_over(poses: Array, middle: Array) -> Array:
    """Return the heights (n; m), from rest, of a target in poses (n, 6) over a place (2; m)."""
    offset = middle - poses[:, :2]
    return np.asarray(poses[:, 2] + offset[:, 1] * np.tan(poses[:, 3]) - offset[:, 0] * np.tan(poses[:, 4]))


def _pull(coils: tuple[CoilEstimate, ...]) -> Array:
    """Return the factors (coils) on the frequency change of a lossless tank for an inductance change.

    They come from the states at rest and pressed, because correction ratios leave out the target's effect on the loss.
    """
    ratios = np.ones(len(coils))
    for k, coil in enumerate(coils):
        rest, pressed = coil.states[REST], coil.states.get(PRESSED)
        if pressed is not None and pressed.frequency > 0.0 and abs(pressed.inductance / rest.inductance - 1.0) > 1e-6:
            ratio = np.log(pressed.frequency / rest.frequency) / (-0.5 * np.log(pressed.inductance / rest.inductance))
            ratios[k] = np.clip(ratio, 0.5, 2.0)
    return ratios


@one_thread
def screen_bench(layout: Layout, estimates: Estimates) -> Bench:
    """Return the load model of a design by the surrogate. Raises NoResponse if a coil has no state at rest."""
    if not all(coil.states.get(REST) is not None and coil.states[REST].frequency > 0.0 for coil in estimates.coils):
        raise NoResponse("nothing is felt by a coil without a state at rest")
    spec, level = warmed(layout.spec, layout.spec.requirements.temperature), surrogate(layout, estimates)
    return Bench(spec, estimates, required_range(spec, True), level, level)
