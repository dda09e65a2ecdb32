"""Performance at the screening level: inductance changes by a moving target, and coil frequencies by a surrogate.

The inductance change of a coil is the change by an infinite plate, multiplied by a correction ratio for the finite
target. Full checks and documents use the response model instead.

For each coil, a slightly tilted target is replaced by a level target. It has the height of the tilted target over the
middle of the area that target and coil share. `NEARLY` is the relative error of the results.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import compress, product

import numpy as np

from sitscad.assembly.places.state import PRESSED, REST
from sitscad.basics.arrays import Array
from sitscad.basics.record import replace
from sitscad.estimates.circuits.solved_winding import LEAST_DISTANCE, shared_spectrum
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.loads.working_range import required_range
from sitscad.estimates.performance.bench import LoadModel
from sitscad.estimates.targets.assembly import spec_at_temperature, surroundings_at_rest
from sitscad.estimates.targets.finite_target import Move, change_ratios
from sitscad.estimates.targets.window import window_effects
from sitscad.estimates.windings.methods import metal_spectrum, winding_geometry
from sitscad.kernels.electromagnetics.metal.half_spaces import raised_inductances, reflected_inductances
from sitscad.kernels.electromagnetics.polynomials import Interpolant, chebyshev_points
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.kernels.mechanics.elastomer import VALID_STRAIN
from sitscad.layout.board import Layout
from sitscad.spec.places import overlap_centres


def target_effects(layout: Layout, moves: Sequence[Move], heights: Sequence[float], frequency: float) -> Array:
    """Return changes of every coil's inductance (heights, moves, coils; H) by a target that moves from rest.

    `moves` are displacements (x, y; m) and `heights` displacements along z (m). The frequency is in Hz. The change by
    an infinite plate is multiplied by the finite target's ratio at the coil's place (`finite_target`). Loss and the
    addition of current crowding are left out. Each height is solved for all moves at once.
    """
    spec = spec_at_temperature(layout.spec, layout.spec.requirements.temperature)
    rest = surroundings_at_rest(spec)
    assert rest is not None
    over = rest.above
    assert over is not None
    layers = [winding.z for winding in layout.coils[0].windings]
    gaps, floor = [over.distance + z for z in heights], -math.inf if rest.below is None else -rest.below.distance
    ratios = change_ratios(spec, layers, gaps, floor, moves)
    distances = [over.distance + min(heights) - max(layers)]
    if rest.below is not None:
        distances.append(rest.below.distance + min(layers))
    nearest = max(min(distances), LEAST_DISTANCE)
    geometry = winding_geometry(spec.coil, replace(layout.coils[0], series=()))
    spectrum = metal_spectrum(geometry, nearest, True) if geometry.spirals else shared_spectrum(geometry, nearest)
    at = np.array([frequency])
    metal_change = reflected_inductances(spectrum, at, None, rest.below, (0.0,))[0, 0].real
    whole = raised_inductances(spectrum, frequency, over, rest.below, np.array(heights)).real - metal_change
    effects, parts = np.asarray(whole[:, None, None] * ratios), window_effects(layout)
    for place, p in enumerate(spec.array.placements):
        if p.name in parts:
            effects[:, :, place] *= parts[p.name].target_factor(effects[:, :, place])
    return effects


NEARLY = 0.08
"""Relative error of noise and drift at the screening level."""

HEIGHTS = 4
"""Number of heights of the target at which the surrogate is computed, from above rest down to `DEPTH` below."""

PLACES = 3
"""Number of places of the target along x, and along y, at which the surrogate is computed."""

REACH = 0.25
"""Largest displacement of the target along x or y for which the surrogate is computed, in pad thicknesses."""

DEEPER = 10
"""Number of additional heights of the surrogate below `DEPTH`, for each pad thickness of additional depth."""

AMPLY = 1.02
"""Largest depth of the target below rest in the surrogate, divided by its travel under the required force."""

LIFTED = 0.1
"""Height above rest to which the surrogate reaches, in pad thicknesses, for edges that a tilt lifts."""

DEPTH = VALID_STRAIN + LIFTED
"""Least depth below rest, in pad thicknesses, to which the surrogate is computed."""


@one_thread
def surrogate(
    layout: Layout, coils: tuple[CoilEstimate, ...], pressed_place: float | None
) -> Callable[[Array], Array]:
    """Return a function of poses (n, 6; m, rad) that approximates the coils' frequencies (n, coils; Hz).

    Every coil must have a state at rest. The function, called surrogate, interpolates ln(frequency / frequency at rest)
    between Chebyshev points of x, y and z. Only points with x = 0 or y = 0 are computed. At other points, the changes
    along both axes are added. `pressed_place` (m) is the target's place along z under the required force; None if
    unknown.
    """
    spec = layout.spec
    pad = spec.elastomer
    assert pad is not None
    depth = max(DEPTH, AMPLY * -(pressed_place or 0.0) / pad.thickness)
    count = HEIGHTS + math.ceil(DEEPER * (depth - DEPTH))
    low, high, side = -depth * pad.thickness, LIFTED * pad.thickness, REACH * pad.thickness
    heights, sides = chebyshev_points(low, high, count), chebyshev_points(-side, side, PLACES)
    middle = PLACES // 2
    on_axes = [middle in point for point in product(range(PLACES), repeat=2)]
    moves = [(0.0, 0.0), *compress(product(sides.tolist(), sides.tolist()), on_axes)]
    rest = [coil.states[REST] for coil in coils]
    inductance, frequency = np.array([(state.inductance, state.frequency) for state in rest]).T
    effect = target_effects(layout, moves, [0.0, *map(float, heights)], float(frequency.mean()))
    since_rest = np.zeros((count, PLACES * PLACES, effect.shape[-1]))
    since_rest[:, on_axes] = effect[1:, 1:] - effect[0, 0]
    change = since_rest.reshape(count, PLACES, PLACES, -1).transpose(1, 2, 0, 3)
    change = change[:, middle, None] + change[None, middle] - change[middle, middle]
    values = -0.5 * np.log1p(np.maximum(change / inductance, -0.9)) * _resonance_factors(coils)
    ends = np.array([-side, -side, low]), np.array([side, side, high])
    through = [Interpolant(*ends, values[..., k]) for k in range(values.shape[-1])]
    middles = np.array([(at.x, at.y) for at in overlap_centres(spec)])  # (coils, 2; m), at rest

    def frequencies(poses: Array) -> Array:
        changes = np.empty((len(poses), len(middles)))
        for k, at in enumerate(middles):
            # height from rest over the middle of the area that coil and target share at rest
            x, y = (at - poses[:, :2]).T
            height = poses[:, 2] + y * np.tan(poses[:, 3]) - x * np.tan(poses[:, 4])
            changes[:, k] = through[k](np.column_stack([poses[:, :2], height]))
        return np.asarray(frequency * np.exp(changes))

    return frequencies


def _resonance_factors(coils: tuple[CoilEstimate, ...]) -> Array:
    """Return factors (coils) on the frequency change that an inductance change causes in a lossless tank.

    They follow from the frequencies of the states at rest and pressed. The surrogate itself has only the target's
    effect on the inductance, not on the loss.
    """
    ratios = np.ones(len(coils))
    for k, coil in enumerate(coils):
        rest, pressed = coil.states[REST], coil.states.get(PRESSED)
        if pressed is not None and pressed.frequency > 0.0 and abs(pressed.inductance / rest.inductance - 1.0) > 1e-6:
            ratio = np.log(pressed.frequency / rest.frequency) / (-0.5 * np.log(pressed.inductance / rest.inductance))
            ratios[k] = np.clip(ratio, 0.5, 2.0)
    return ratios


@one_thread
def screening_load_model(layout: Layout, estimates: Estimates) -> LoadModel:
    """Return the load model of a design with frequencies by the surrogate.

    Raises NoResponse if a coil has no state at rest.
    """
    if not all(coil.states.get(REST) is not None and coil.states[REST].frequency > 0.0 for coil in estimates.coils):
        raise NoResponse("nothing is felt by a coil without a state at rest")
    spec = spec_at_temperature(layout.spec, layout.spec.requirements.temperature)
    level = surrogate(layout, estimates.coils, estimates.pressed_place)
    return LoadModel(spec, estimates, required_range(spec, True), level, level)
