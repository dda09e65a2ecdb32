"""Units of a design, each off by one cause of `scatter`: what they read, and what the map of the design makes of it.

This is the quick way, by loads and causes, for checks and working points. What data sheets state of units is simulated:
`calibration.forms.drawn_map` draws all causes at once, what the pad's law and the model are off by among them, as far
as two sigmas. Over one range of loads the root of the sum of squares here is within a quarter of that
(tests/estimates/test_scatter.py).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from sitscad.arrays import Array
from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.performance.inversion import SolvedRange
from sitscad.estimates.scatter import CAPACITOR, CAUSES, CLOCK, COIL, Scatter
from sitscad.estimates.states.pressing import MODULUS, PAD, PAD_SIZE, loaded_face
from sitscad.record import record

MOVED_POSES = {cause.name: cause.pose for cause in CAUSES if cause.pose is not None}
"""Which number of the pose at rest a cause moves."""

CANCEL = (CAPACITOR, CLOCK)
"""Causes that leave the ratio of a frequency to its tare as it was (tests/estimates/test_performance.py)."""


@record(eq=False)
class Units:
    """Errors (N) of one unit a cause that is off by one sigma, (loads, axes) by cause: as the design's map reads it
    after its own tare, and after gains and cross gains were fitted at those `loads` (3; N), too.
    """

    loads: Array
    before: Mapping[str, Array]
    after: Mapping[str, Array]

    def at(self, share: float, normal: float, is_calibrated: bool) -> Array:
        """One sigma (N) of all causes together at a share of full normal force (N), of every axis."""
        found = self.after if is_calibrated else self.before
        each = [self._near(error, share, normal) for error in found.values()]
        return np.asarray(np.sqrt(np.sum(np.square(each), axis=0)))

    def by_modulus(self, share: float, normal: float) -> Array:
        """The part of the pad's modulus in what `at` gives before a calibration (N), of every axis."""
        return self._near(self.before[MODULUS], share, normal)

    def _near(self, error: Array, share: float, normal: float) -> Array:
        near = np.argmin(np.abs(self.loads[:, 0] - share * normal))
        same = np.abs(self.loads[:, 0] - self.loads[near, 0]) < 1e-9
        return np.asarray(np.sqrt(np.mean(error[same] ** 2, axis=0)))


def units_of(working: SolvedRange, causes: tuple[Scatter, ...]) -> Units:
    """One unit for every cause of manufacture that moves what is read after a tare; clocks cancel in it."""
    bench = working.bench
    # nothing, half and full on the normal axis, to both sides on the others
    lines = [(0.0, 0.5, 1.0) if name == "normal" else (-1.0, 1.0) for name in bench.range.axes]
    loads = bench.range.loads(list(product(*lines)))
    true = loads[:, bench.range.columns]
    scaled = true / bench.range.full_scales

    def calibrated(error: Array) -> Array:
        """What is left once the straight part of the errors is taken away."""
        return np.asarray(error - scaled @ np.linalg.lstsq(scaled, error, rcond=None)[0])

    before: dict[str, Array] = {}
    after: dict[str, Array] = {}
    for cause in causes:
        ways = [[working.map(reading) - true for reading in each] for each in readings_of(bench, cause, loads)]
        if ways:
            before[cause.name] = root_sum_of_mean_squares(ways)
            after[cause.name] = root_sum_of_mean_squares([[calibrated(error) for error in each] for each in ways])
    return Units(loads, before, after)


def root_sum_of_mean_squares(ways: Sequence[Sequence[Array]]) -> Array:
    """One sigma of what differs independently (outer), each one way or the other (inner)."""
    return np.asarray(np.sqrt(sum(np.mean(np.square(each), axis=0) for each in ways)))


def readings_of(bench: Bench, cause: Scatter, loads: Array) -> list[list[Array]]:
    """What units read that are off by one sigma of a cause: one, or one for every coil that has it to itself; each one
    way, or both where they are far from alike.
    """
    if cause.name in CANCEL:
        return []
    if cause.per == COIL:  # a winding that is larger by a share changes by that much less of itself
        nominal = bench.readings(bench.poses(loads))
        return [[nominal * (1.0 - cause.sigma * one)] for one in np.eye(nominal.shape[1])]
    if cause.name == MODULUS:  # a third softer moves the target much farther than a third stiffer
        pads = [replace(bench.pad, shear_modulus=bench.pad.shear_modulus * math.exp(way * cause.sigma))
                for way in (1.0, -1.0)]
        return [[bench.readings(bench.poses(loads, each)) for each in pads]]
    moved, pad = np.zeros(6), bench.pad
    if cause.name in MOVED_POSES:
        moved[MOVED_POSES[cause.name]] = cause.sigma
    if cause.name == PAD:
        pad = replace(pad, thickness=pad.thickness + cause.sigma)
    elif cause.name == PAD_SIZE:
        pad = replace(pad, face=loaded_face(bench.spec, cause.sigma)[0])
    found = bench.frequencies(np.concatenate([moved[None], bench.poses(loads, pad) + moved]))
    return [[np.log(found[1:] / found[0])]]
