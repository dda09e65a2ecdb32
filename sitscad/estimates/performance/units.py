"""Units of a design that differ as manufacture makes them, read by the map of the design: what each cause costs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.performance import scatter
from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.performance.inverse import WorkingRange
from sitscad.estimates.performance.scatter import COIL, Scatter
from sitscad.estimates.states.pressing import loaded_face
from sitscad.estimates.uncertainty import CAPACITOR
from sitscad.record import record

Array = NDArray[np.float64]

RAISED = {scatter.OFFSET_X: 0, scatter.OFFSET_Y: 1, scatter.GLUE: 2, scatter.TILT_X: 3, scatter.TILT_Y: 4,
          scatter.YAW: 5}  # fmt: skip
"""Which number of the pose at rest a cause moves."""


CANCEL = (CAPACITOR, scatter.CLOCK)
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
        return self._near(self.before[scatter.MODULUS], share, normal)

    def _near(self, error: Array, share: float, normal: float) -> Array:
        near = np.argmin(np.abs(self.loads[:, 0] - share * normal))
        same = np.abs(self.loads[:, 0] - self.loads[near, 0]) < 1e-9
        return np.asarray(np.sqrt(np.mean(error[same] ** 2, axis=0)))


def units_of(working: WorkingRange, causes: tuple[Scatter, ...]) -> Units:
    """One unit for every cause of manufacture that moves what is read after a tare; clocks cancel in it."""
    bench = working.bench
    loads = _loads(bench)
    true = loads[:, bench.columns]
    before: dict[str, Array] = {}
    after: dict[str, Array] = {}
    for cause in causes:
        ways = [[working.map(reading) - true for reading in each] for each in readings_of(bench, cause, loads)]
        if ways:
            before[cause.name] = together(ways)
            after[cause.name] = together(
                [[_calibrated(error, true, bench.full_scales) for error in each] for each in ways]
            )
    return Units(loads, before, after)


def together(ways: Sequence[Sequence[Array]]) -> Array:
    """One sigma of what differs independently (outer), each one way or the other (inner)."""
    return np.asarray(np.sqrt(sum(np.mean(np.square(each), axis=0) for each in ways)))


def _calibrated(error: Array, true: Array, full: Array) -> Array:
    # What is left once the straight part of the errors is taken away.
    scaled = true / full
    return np.asarray(error - scaled @ np.linalg.lstsq(scaled, error, rcond=None)[0])


def _loads(bench: Bench) -> Array:
    # Nothing, half and full on the normal axis, to both sides on the others.
    lines = [(0.0, 0.5, 1.0) if name == "normal" else (-1.0, 1.0) for name in bench.names]
    loads = np.zeros((len(list(product(*lines))), 3))
    loads[:, bench.columns] = list(product(*lines)) * bench.full_scales
    return loads


def readings_of(bench: Bench, cause: Scatter, loads: Array) -> list[list[Array]]:
    """What units read that are off by one sigma of a cause: one, or one for every coil that has it to itself; each one
    way, or both where they are far from alike.
    """
    if cause.name in CANCEL:
        return []
    if cause.per == COIL:  # a winding that is larger by a share changes by that much less of itself
        nominal = bench.readings(bench.poses(loads))
        return [[nominal * (1.0 - cause.sigma * one)] for one in np.eye(nominal.shape[1])]
    if cause.name == scatter.MODULUS:  # a third softer moves the target much farther than a third stiffer
        pads = [replace(bench.pad, shear_modulus=bench.pad.shear_modulus * math.exp(way * cause.sigma))
                for way in (1.0, -1.0)]  # fmt: skip
        return [[bench.readings(bench.poses(loads, each)) for each in pads]]
    moved, pad = np.zeros(6), bench.pad
    if cause.name in RAISED:
        moved[RAISED[cause.name]] = cause.sigma
    elif cause.name == scatter.THICKNESS:
        moved[2], pad = cause.sigma, replace(pad, thickness=pad.thickness + cause.sigma)
    elif cause.name == scatter.SIZE:
        pad = replace(pad, face=loaded_face(bench.spec, cause.sigma)[0])
    else:
        return []
    found = bench.frequencies(np.concatenate([moved[None], bench.poses(loads, pad) + moved]))
    return [[np.log(found[1:] / found[0])]]
