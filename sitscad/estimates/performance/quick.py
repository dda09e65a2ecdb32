"""Performance at a small part of the cost, for checks: a chart of what the states' own shares of an endless plate say.

Where the states have the target solved, so has the chart, its loss included. Slopes by x, y, z are within a few per
cent of the response's (tests/estimates/test_quick.py). A target that tilts
slightly counts, for every coil, as a level one at the height that it has over the middle of what both share: slopes by
tilt are within a quarter. A tilt that a contact may have is asked of the response's own solution of the target.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import compress, product

import numpy as np

from sitscad.arrays import Array, ComplexArray
from sitscad.estimates.circuit.tank import Tank
from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.response.pad import NoResponse, soft_pad
from sitscad.estimates.response.working_range import required_range
from sitscad.estimates.states.assembly import warmed
from sitscad.estimates.states.moved_target import target_effects
from sitscad.estimates.states.solved_target import own_changes
from sitscad.estimates.values import Estimates
from sitscad.layout.board import Layout
from sitscad.mechanics.elastomer import VALID_STRAIN
from sitscad.physics.polynomials import Interpolant, chebyshev_points
from sitscad.physics.resonator import Network, oscillate_alike
from sitscad.physics.threads import one_thread
from sitscad.record import record
from sitscad.scene.state import PRESSED, REST
from sitscad.spec.places import shared_middles
from sitscad.spec.sensor import ReadoutSpec, SensorSpec

LEAST_INDUCTANCE, SLOWEST = 0.1, 0.2
"""Least inductance and frequency, over those at rest: tanks that a chart takes beyond what oscillates stay finite."""

LEAST, MOST = 1e-6, 4.0
"""Change, over the inductance, below which it is not held to that of the states; and by how much more or less it is."""


@record(eq=False)
class RestingTanks:
    """The tanks of all coils at rest, (coils,): their network, inductance (H), resistance (ohm) and frequency (Hz); and
    the drive's delay (s).
    """

    network: Network
    inductance: Array
    resistance: Array
    frequency: Array
    delay: float

    def logarithms(self, change: ComplexArray) -> Array:
        """Logarithms of frequencies over those at rest, by changes of the inductances since then (H, complex; (...,
        coils)): loss pulls, too, a magnetic metal's as much as its change of inductance. Loss and inductance are those
        at the frequency at rest.
        """
        inductance = np.maximum(self.inductance + change.real, LEAST_INDUCTANCE * self.inductance)
        resistance = np.maximum(self.resistance - 2.0 * np.pi * self.frequency * change.imag, 0.0)
        found = oscillate_alike(self.network, inductance, resistance, self.delay).frequency
        return np.asarray(np.log(np.fmax(found / self.frequency, SLOWEST)))


def resting_tanks(spec: ReadoutSpec, estimates: Estimates) -> RestingTanks:
    """The tanks of all coils, which have a state at rest."""
    states = [coil.states[REST] for coil in estimates.coils]
    inductance, resistance, frequency = np.array([(s.inductance, s.resistance, s.frequency) for s in states]).T
    network = Tank(estimates.readout.capacitance, spec).network(np.array([c.self_capacitance for c in estimates.coils]))
    return RestingTanks(network, inductance, resistance, frequency, spec.device.limit("drive_delay"))


def held(estimates: Estimates, said: ComplexArray) -> ComplexArray:
    """Factor (coils,) by which the coils' inductances (complex) change from the state at rest to that pressed, over
    what is `said` (H): crowding and neighbours are in those. Ones where there is no such state.
    """
    found = np.ones(len(estimates.coils), dtype=complex)
    for k, coil in enumerate(estimates.coils):
        rest, pressed = coil.states[REST], coil.states.get(PRESSED)
        if pressed is None or abs(said[k]) < LEAST * rest.inductance:
            continue
        lost = (pressed.resistance - rest.resistance) / (2.0 * np.pi * rest.frequency)
        factor = complex(pressed.inductance - rest.inductance, -lost) / said[k]
        found[k] = factor * min(1.0, MOST / abs(factor))
    return found


HEIGHTS, DEEPER, PLACES, FARTHER = 5, 10, 7, 2
"""Chebyshev points of the chart: heights, and how many more a thickness of the pad deeper; places along each axis, one
of them in the middle (where six of them missed a small target by 7 %), and how many more a thickness farther either
way."""

ROUGH, ROUGH_REACH = (4, 3), 0.25
"""Heights and places of a chart for screening, and how far aside it goes (in thicknesses of the pad)."""

TRAVEL = 1.0
"""Travel that the chart covers at least, in thicknesses of the pad; beyond the required loads its ends are taken."""

AMPLY, FARTHEST = 1.02, 2.0
"""How much farther than the required loads it goes, and the travel beyond which none is charted."""

LIFTED = 0.1  # How far above rest the chart reaches, in thicknesses of the pad: for ends that a tilt lifts

DEPTH = VALID_STRAIN + LIFTED  # How far below rest it reaches at least, in thicknesses of the pad


@one_thread
def chart(layout: Layout, estimates: Estimates) -> Callable[[Array], Array]:
    """Frequencies (Hz) of the coils, (n, coils), at (n, 6) poses, of a design with a target on its pad and a state at
    rest of every coil: logarithms of them over those at rest by the target's place, at Chebyshev points of x, y and z.
    """
    spec = layout.spec
    pad = spec.elastomer
    assert pad is not None
    if estimates.is_rough:  # slopes on the axis alone are asked for
        depth, lifted = max(DEPTH, AMPLY * -(estimates.pressed_place or 0.0) / pad.thickness), LIFTED
        reach, (count, places) = ROUGH_REACH, ROUGH
    else:
        (reach, depth, lifted), count = _reach(spec), HEIGHTS
        places = PLACES + 2 * math.ceil(FARTHER * (reach - TRAVEL))
    count += math.ceil(DEEPER * (depth - DEPTH + lifted - LIFTED))
    low, high, aside = -depth * pad.thickness, lifted * pad.thickness, reach * pad.thickness
    heights, sides = chebyshev_points(low, high, count), chebyshev_points(-aside, aside, places)
    # of a rough chart nothing is asked that lies aside of both axes: what both make is added there
    middle, rough = places // 2, estimates.is_rough
    asked = [not rough or middle in point for point in product(range(places), repeat=2)]
    moves = [(0.0, 0.0), *compress(product(sides.tolist(), sides.tolist()), asked)]
    tanks, pressed = resting_tanks(spec.readout, estimates), estimates.pressed_place
    over = [0.0, *([pressed] if estimates.is_solved and pressed is not None else []), *map(float, heights)]
    effect = target_effects(layout, moves, over, float(tanks.frequency.mean()), estimates.is_solved, rough)
    since_rest = np.zeros((count, places * places, effect.shape[-1]), dtype=complex)
    since_rest[:, asked] = effect[-count:, 1:] - effect[0, 0]
    change = since_rest.reshape(count, places, places, -1).transpose(1, 2, 0, 3)
    if rough:
        along, across = change[:, middle, None], change[None, middle]
        change = along + across - change[middle, middle]
    if estimates.is_solved:
        values = tanks.logarithms(change * held(estimates, effect[-count - 1, 0] - effect[0, 0]))
    else:
        values = -0.5 * np.log1p(np.maximum(change.real / tanks.inductance, -0.9)) * _pull(estimates)
    ends = np.array([-aside, -aside, low]), np.array([aside, aside, high])
    charts = [Interpolant(*ends, values[..., k]) for k in range(values.shape[-1])]
    middles = _middles(spec)

    def frequencies(poses: Array) -> Array:
        found = np.empty((len(poses), len(middles)))
        for k, middle in enumerate(middles):  # of what the coil shares with the target at rest
            found[:, k] = charts[k](np.column_stack([poses[:, :2], _height_over(poses, middle)]))
        return np.asarray(tanks.frequency * np.exp(found))

    return frequencies


def _reach(spec: SensorSpec) -> tuple[float, float, float]:
    """How far aside, down and up the chart goes (in thicknesses of the pad): as far as the required loads move the
    target, where the pad holds it, or every load beyond the chart's end would read like that end.
    """
    most = required_range(spec)
    sides: list[tuple[float, ...]] = [(0.0, most.normal), (0.0, most.shear), (0.0, most.shear)]
    if most.has_moments:
        sides += [(-size, 0.0, size) for size in most.moments]
    pad = soft_pad(spec)
    poses = np.nan_to_num(pad.pose(np.array(list(product(*sides))), is_held=not most.has_moments))
    aside, heights = np.abs(poses[:, :2]).max() / pad.thickness, poses[:, 2]
    if most.has_moments:  # over the middles of what coils share with the target
        heights = np.stack([_height_over(poses, at) for at in _middles(spec)])
        heights = np.maximum(heights, -DEEPEST * pad.thickness)
    down, up = -heights.min() / pad.thickness, heights.max() / pad.thickness
    return (min(max(TRAVEL, AMPLY * float(aside)), FARTHEST), max(DEPTH, AMPLY * float(down)),
            max(LIFTED, AMPLY * float(up)))


DEEPEST = 0.9
"""How far below rest, in thicknesses of the pad, a chart of tilted targets goes at most."""


def _middles(spec: SensorSpec) -> Array:
    """The middles (coils, 2; m) of what the coils share with the target at rest."""
    return np.array([(at.x, at.y) for at in shared_middles(spec)])


def _height_over(poses: Array, middle: Array) -> Array:
    """The heights (n; m), from rest, of a target in poses (n, 6) over a place (2; m)."""
    away = middle - poses[:, :2]
    return np.asarray(poses[:, 2] + away[:, 1] * np.tan(poses[:, 3]) - away[:, 0] * np.tan(poses[:, 4]))


def _pull(estimates: Estimates) -> Array:
    """How much more or less a tank's frequency follows its inductance than a free one's: by the states at rest,
    pressed.

    This is no second law of the tank beside `RestingTanks`, which asks for the loss that the target changes: shares of
    an endless target leave it out, so what loss and delay pull is taken in proportion, as the states have it.
    """
    found = np.ones(len(estimates.coils))
    for k, coil in enumerate(estimates.coils):
        rest, pressed = coil.states[REST], coil.states.get(PRESSED)
        if pressed is not None and pressed.frequency > 0.0 and abs(pressed.inductance / rest.inductance - 1.0) > 1e-6:
            ratio = np.log(pressed.frequency / rest.frequency) / (-0.5 * np.log(pressed.inductance / rest.inductance))
            found[k] = np.clip(ratio, 0.5, 2.0)
    return found


@one_thread
def quick_bench(layout: Layout, estimates: Estimates) -> Bench:
    """A design with a target on its pad, by the chart. Raises NoResponse where a coil has no state at rest."""
    if not all(coil.states.get(REST) is not None and coil.states[REST].frequency > 0.0 for coil in estimates.coils):
        raise NoResponse("nothing is felt by a coil without a state at rest")
    spec = warmed(layout.spec, layout.spec.requirements.temperature)
    level = chart(layout, estimates)
    if estimates.is_rough:
        return Bench(spec, estimates, required_range(spec, True), level, level)
    tanks, pressed = resting_tanks(spec.readout, estimates), estimates.pressed_place
    warm = replace(layout, spec=spec)

    def tilted(poses: Array) -> Array:
        """What a turn adds, by the response's own solution of the target at one frequency, crowding left out; held to
        the change of the state pressed.
        """
        flat, states = poses.copy(), np.zeros((2, 6))
        flat[:, 3:], states[1, 2] = 0.0, pressed or 0.0
        change = own_changes(warm, np.concatenate([states, poses, flat]), float(tanks.frequency.mean()))
        change = change[1:] - change[0]
        said = tanks.logarithms(change[1:] * held(estimates, change[0]))
        return np.asarray(level(flat) * np.exp(said[: len(poses)] - said[len(poses) :]))

    return Bench(spec, estimates, required_range(spec), level, tilted)
