"""The same at a small part of the cost, for checks: a chart of what the states' own shares of an endless plate say.

Where the states have the target solved, so has the chart, its loss included. Slopes by x, y, z are within a few per
cent of the response's (tests/estimates/test_quick.py). A target that tilts
slightly counts, for every coil, as a level one at the height that it has over the middle of what both share: slopes by
tilt are within a quarter. A tilt that a contact may have is asked of the response's own solution of the target.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates import estimated
from sitscad.estimates.performance.bench import Bench, bench_of, full_scales
from sitscad.estimates.performance.causes import WARMER, Disturbed, by_metal
from sitscad.estimates.performance.inverse import WorkingRange, working_range
from sitscad.estimates.performance.points import disturbed, working_loads
from sitscad.estimates.performance.scatter import manufacturing_scatter
from sitscad.estimates.performance.tank_law import held, pressed_place, tank_law
from sitscad.estimates.performance.tilts import QuickTilts
from sitscad.estimates.performance.units import units_of
from sitscad.estimates.response.pad import soft_pad
from sitscad.estimates.states.assembly import warmed
from sitscad.estimates.states.moved_target import target_effects
from sitscad.estimates.states.pressing import rests_on_pad
from sitscad.estimates.values import Estimates
from sitscad.layout.board import Layout
from sitscad.mechanics.elastomer import VALID_STRAIN
from sitscad.physics.polynomials import chebyshev_points, evaluated
from sitscad.record import record
from sitscad.scene.state import PRESSED, REST
from sitscad.spec.places import shared_middles
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]

HEIGHTS, PLACES, FARTHER = 5, 6, 4
"""Chebyshev points of the chart: heights, places along each axis, and how many more of these a thickness of the pad
farther."""

TRAVEL = 1.0
"""Travel that the chart covers at least, in thicknesses of the pad; beyond the required loads its ends are taken."""

AMPLY, FARTHEST = 1.02, 2.0
"""How much farther than the required loads it goes, and the travel beyond which none is charted."""

LIFTED = 0.1
"""How far above rest the chart reaches, in thicknesses of the pad: for ends that a tilt lifts."""


@record(eq=False)
class Chart:
    """Logarithms of every coil's frequency over that at rest, by the target's place: (x, y, z) at Chebyshev points.
    `shared` (coils, 2; m) are the middles of what every coil shares with the target at rest.
    """

    grid: tuple[Array, ...]
    values: Array
    shared: Array
    rest: Array

    def frequencies(self, poses: Array) -> Array:
        """Frequencies (Hz) of the coils, (n, coils), at (n, 6) poses."""
        found = np.empty((len(poses), len(self.shared)))
        for k, middle in enumerate(self.shared):
            places = poses[:, :3].copy()
            away = middle - places[:, :2]
            places[:, 2] += away[:, 1] * np.tan(poses[:, 3]) - away[:, 0] * np.tan(poses[:, 4])
            inside = [np.clip(places[:, i], points[0], points[-1]) for i, points in enumerate(self.grid)]
            found[:, k] = evaluated(self.values[..., k : k + 1], self.grid, np.stack(inside, axis=1))[:, 0]
        return np.asarray(self.rest * np.exp(found))


def chart(layout: Layout, estimates: Estimates) -> Chart:
    """The chart of a design with a target on its pad and a state at rest of every coil."""
    spec = layout.spec
    pad = spec.elastomer
    assert pad is not None
    reach, depth = _reach(spec)
    heights = chebyshev_points(-depth * pad.thickness, LIFTED * pad.thickness, HEIGHTS)
    places = PLACES + math.ceil(FARTHER * (reach - TRAVEL))
    sides = chebyshev_points(-reach * pad.thickness, reach * pad.thickness, places)
    moves = [(0.0, 0.0), *((float(x), float(y)) for x, y in product(sides, repeat=2))]
    law, pressed = tank_law(spec, estimates), pressed_place(estimates)
    over = [0.0, *([pressed] if estimates.is_solved and pressed is not None else []), *map(float, heights)]
    effect = target_effects(layout, moves, over, float(law.frequency.mean()), estimates.is_solved)
    change = (effect[-HEIGHTS:, 1:] - effect[0, 0]).reshape(HEIGHTS, places, places, -1).transpose(1, 2, 0, 3)
    if estimates.is_solved:
        values = law.logarithms(change * held(estimates, effect[-HEIGHTS - 1, 0] - effect[0, 0]))
    else:
        values = -0.5 * np.log1p(np.maximum(change.real / law.inductance, -0.9)) * _pull(estimates)
    middles = np.array([(at.x, at.y) for at in shared_middles(spec)])
    return Chart((sides, sides, heights), values, middles, law.frequency)


def _reach(spec: SensorSpec) -> tuple[float, float]:
    """How far aside and down the chart goes (in thicknesses of the pad): as far as the required loads move the target,
    where the pad holds it, or every load beyond the chart's end would read like that end.
    """
    normal, shear = full_scales(spec)
    loads = np.array(list(product((0.0, normal), (0.0, shear), (0.0, shear))))
    pad = soft_pad(spec)
    moved = pad.pose(loads, is_held=True)[:, :3] / pad.thickness
    aside, down = np.nan_to_num(np.abs(moved[:, :2])).max(), np.nan_to_num(-moved[:, 2]).max()
    return min(max(TRAVEL, AMPLY * float(aside)), FARTHEST), max(VALID_STRAIN + LIFTED, AMPLY * float(down))


def _pull(estimates: Estimates) -> Array:
    """How much more or less a tank's frequency follows its inductance than a free one's: by the states at rest,
    pressed.
    """
    found = np.ones(len(estimates.coils))
    for k, coil in enumerate(estimates.coils):
        rest, pressed = coil.states[REST], coil.states.get(PRESSED)
        if pressed is not None and pressed.frequency > 0.0 and abs(pressed.inductance / rest.inductance - 1.0) > 1e-6:
            ratio = np.log(pressed.frequency / rest.frequency) / (-0.5 * np.log(pressed.inductance / rest.inductance))
            found[k] = np.clip(ratio, 0.5, 2.0)
    return found


@record(eq=False)
class QuickPerformance:
    """What the rules ask of a sensor; each is worked out when it is asked for."""

    layout: Layout
    estimates: Estimates
    bench: Bench

    @cached_property
    def working(self) -> WorkingRange:
        """The working range and its map."""
        return working_range(self.bench)

    @cached_property
    def points(self) -> tuple[Disturbed, ...]:
        """Rest, half and full load, what metal does left out."""
        return disturbed(self.bench, np.zeros(len(self.bench.rest)))

    @cached_property
    def held(self) -> tuple[bool, ...]:
        """At which of the points the pad holds the target: where it gives way, their figures mean nothing."""
        return tuple(map(bool, self.bench.is_held(working_loads(self.bench))))

    @cached_property
    def is_range_held(self) -> bool:
        """Whether the pad holds the target all over the working range."""
        return bool(np.all(self.bench.is_held(self.working.loads)))

    def friction(self, shear: str) -> dict[str, float]:
        """Errors of shear over normal at full load by cause (`Disturbed.friction`)."""
        units = units_of(self.working, manufacturing_scatter(self.layout.spec, self.estimates))
        full = self.warmed[-1]
        return full.friction(full.errors(units, self.working.map_errors), shear)

    @cached_property
    def warmed(self) -> tuple[Disturbed, ...]:
        """Rest, half and full load with what copper and other metal do."""
        warm = self.estimates.temperature + WARMER
        warmer = estimated(self.layout, temperature=warm, solved=self.estimates.solved)
        return disturbed(self.bench, by_metal(self.estimates, warmer, self.bench.rest))


def quick_performance(layout: Layout, estimates: Estimates) -> QuickPerformance | None:
    """None where target, pad, the state at rest or the tank are missing."""
    if not _can_feel(layout.spec, estimates):
        return None
    spec = warmed(layout.spec, layout.spec.requirements.temperature)
    known = chart(layout, estimates)
    law, pressed = tank_law(spec, estimates), pressed_place(estimates)
    tilts = QuickTilts(layout, estimates, spec, known.frequencies, law, pressed)
    return QuickPerformance(layout, estimates, bench_of(spec, estimates, known.frequencies, tilts.frequencies))


def _can_feel(spec: SensorSpec, estimates: Estimates) -> bool:
    if spec.target is None or spec.elastomer is None or not rests_on_pad(spec) or estimates.readout.rcount is None:
        return False
    return all(coil.states.get(REST) is not None and coil.states[REST].frequency > 0.0 for coil in estimates.coils)
