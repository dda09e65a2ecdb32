"""Errors of simulated units that each deviate in one manufacturing cause, after a tare and a fit of gains.

Checks and working points use this quick method, which gives errors for each load and cause. Data sheets state errors of
random units with all causes at once, and with errors of the pad's law and of the model
(`calibration.map_fit.error_for_other_sensors`). Over an equal range of loads, the root sum of squares of the errors
here is within a quarter of the errors of random units (tests/estimates/test_scatter.py).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.loads.pad import soft_pad
from sitscad.estimates.loads.pressing import FILM, FILM_THICKNESS, MODULUS, PAD, PAD_SIZE, TARGET_SIZE, loaded_face
from sitscad.estimates.performance.bench import LoadModel
from sitscad.estimates.performance.inversion import SolvedRange
from sitscad.estimates.tolerances.scatter import (
    BEHIND,
    CAPACITOR,
    CAUSES,
    CLOCK,
    COIL,
    MOVED,
    TARGET,
    Scatter,
    signal_share,
)

MOVED_POSES = {cause.name: cause.pose for cause in CAUSES if cause.pose is not None}
"""Index of the component of the pose at rest (x, y, z, rx, ry, rz) that a cause changes, by the cause's name."""

CANCEL = (CAPACITOR, CLOCK)
"""Causes without effect on the readings, because a reading is the ratio of a frequency to its value at the tare.

This is checked in tests/estimates/test_performance.py.
"""


@record(eq=False)
class UnitErrors:
    """Errors (loads, axes; N, N m) of units that each deviate by one sigma in one cause, by cause.

    `after_tare` holds the errors of the design's map after the unit's own tare. `after_fit` holds the errors after an
    additional fit of gains and cross gains at the `loads` (n, 3 or 5; N, N m).
    """

    loads: Array
    after_tare: Mapping[str, Array]
    after_fit: Mapping[str, Array]

    def at(self, share: float, normal: float, is_calibrated: bool) -> Array:
        """Return the standard deviation (N, N m) of every axis by all causes together, near a normal force.

        This force is the fraction `share` of the full normal force `normal` (N). `is_calibrated` selects the errors
        after the fit of gains.
        """
        errors = self.after_fit if is_calibrated else self.after_tare
        each = [self._near(error, share, normal) for error in errors.values()]
        return np.asarray(np.sqrt(np.sum(np.square(each), axis=0)))

    def by_modulus(self, share: float, normal: float) -> Array:
        """Return the standard deviation (N, N m) of every axis by the pad's modulus alone, before a calibration.

        The normal force is the fraction `share` of the full normal force `normal` (N).
        """
        return self._near(self.after_tare[MODULUS], share, normal)

    def _near(self, error: Array, share: float, normal: float) -> Array:
        near = np.argmin(np.abs(self.loads[:, 0] - share * normal))
        same = np.abs(self.loads[:, 0] - self.loads[near, 0]) < 1e-9
        return np.asarray(np.sqrt(np.mean(error[same] ** 2, axis=0)))


def simulate_unit_errors(working: SolvedRange, causes: tuple[Scatter, ...]) -> UnitErrors:
    """Return the errors of units for each manufacturing cause that changes readings after a tare.

    Errors of clock and capacitors cancel in a tare. `working` holds the design's map and load model. `causes` are the
    manufacturing causes.
    """
    bench = working.bench
    # zero, half and full load on the normal axis, both signs on the others
    lines = [(0.0, 0.5, 1.0) if name == "normal" else (-1.0, 1.0) for name in bench.range.axes]
    loads = bench.range.loads_at(list(product(*lines)))
    true = loads[:, bench.range.columns]
    scaled = true / bench.range.full_scales

    def calibrated(error: Array) -> Array:
        """Return the errors (loads, axes) without the part that is linear in the loads."""
        return np.asarray(error - scaled @ np.linalg.lstsq(scaled, error, rcond=None)[0])

    before: dict[str, Array] = {}
    after: dict[str, Array] = {}
    for cause in causes:
        errors = [[working.map(reading) - true for reading in each] for each in perturbed_readings(bench, cause, loads)]
        if errors:
            before[cause.name] = root_sum_of_mean_squares(errors)
            after[cause.name] = root_sum_of_mean_squares([[calibrated(error) for error in each] for each in errors])
    return UnitErrors(loads, before, after)


def root_sum_of_mean_squares(errors: Sequence[Sequence[Array]]) -> Array:
    """Return the standard deviation of errors by independent causes (outer sequence).

    The inner sequence holds the errors of one cause for alternative signs. Squares are averaged over the signs and
    added over the causes.
    """
    return np.asarray(np.sqrt(sum(np.mean(np.square(each), axis=0) for each in errors)))


def perturbed_readings(bench: LoadModel, cause: Scatter, loads: Array) -> list[list[Array]]:
    """Return readings (loads, coils) of units with an error of one sigma of a cause, as a list of lists.

    The outer list is over units, the inner list over signs of the error. If each coil has the cause independently,
    there is one unit for every coil, otherwise a single unit. Both signs are computed only if their effects differ
    much.
    """
    if cause.name in CANCEL:
        return []
    if cause.per == COIL:  # a relative excess of inductance reduces the relative change by as much
        nominal = bench.readings(bench.poses(loads))
        return [[nominal * (1.0 - cause.sigma * unit_vector)] for unit_vector in np.eye(nominal.shape[1])]
    if cause.name == MODULUS:  # a third softer moves the target much more than a third stiffer
        pads = [replace(bench.pad, shear_modulus=bench.pad.shear_modulus * math.exp(way * cause.sigma))
                for way in (1.0, -1.0)]
        return [[bench.readings(bench.poses(loads, each)) for each in pads]]
    if cause.name in (*BEHIND, TARGET):  # metal scales the target's effect as from rest to pressed
        nominal = bench.readings(bench.poses(loads))
        return [[nominal * (1.0 + np.array([signal_share(coil, cause.name) for coil in bench.estimates.coils]))]]
    moved, pad = np.zeros(6), bench.pad
    if cause.name in (FILM, FILM_THICKNESS, TARGET_SIZE):
        pad = soft_pad(MOVED[cause.name](bench.spec, cause.sigma))
    if cause.name in MOVED_POSES:
        moved[MOVED_POSES[cause.name]] = cause.sigma
    if cause.name == PAD:
        pad = replace(pad, thickness=pad.thickness + cause.sigma)
    elif cause.name == PAD_SIZE:
        pad = replace(pad, face=loaded_face(bench.spec, cause.sigma)[0])
    frequencies = bench.frequencies(np.concatenate([moved[None], bench.poses(loads, pad) + moved]))
    return [[np.log(frequencies[1:] / frequencies[0])]]
