"""Maps from readings to forces of simulated sensors: of the one as drawn, and of one whose errors were found. All maps
have one form, a polynomial of the highest degree that the samples bear.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.calibration.inverse_map import InverseMap, changes
from sitscad.calibration.model_fit import ModelFit
from sitscad.calibration.points import load_slopes, unknown_slopes
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import stratified
from sitscad.kernels.electromagnetics.polynomials import POINTS_A_TERM, Exponents, exponents, monomials

SMALLEST = 1e-4
"""Share of the largest singular value below which terms of a map count as one: it costs no template accuracy (1e-3
does), and keeps a map bounded whose samples a chart far beyond its poses has bent."""

MAX_DEGREE = 6
"""Largest degree of a map. Of templates the fifth leaves 0.06 to 0.3 % of full scale, the sixth up to a third less, a
seventh hardly less than that."""

SHARE = 0.5
"""Part of a target's change of which the logarithm is taken, over what it is at rest; the rest counts as constant. The
logarithm of all of it has a pole where a target far aside changes nothing: maps near it were half of full scale off."""

LEARNT, ASKED = 240, 80  # Loads that a map is fitted to, and others at which its error is taken

SEED = 7  # Seed of the noise in the readings at those others

SCATTERED, SCATTER_SEED = 64, 8
"""Simulated sensors by which the error of the drawn sensor's map on others is found, and the seed of their errors."""

SOLVED, DEGREE = 40, 3  # Loads that are solved, not charted, for a sensor's own map, and the degree of what that adds

LEAST_LEFT = 0.05  # Least of 1 - leverage that a residual is divided by


@record(eq=False)
class Samples:
    """Readings and forces of one sensor: (n, coils) over their tare (coils), and (n, axes) in full scales."""

    readings: Array
    rest: Array
    forces: Array


def gain(sensors: Sensors) -> Array:
    """`SHARE` of the inductance at rest over what the target takes off it, of the drawn sensor (coils), by
    frequencies.
    """
    rest = sensors.under(np.zeros(len(sensors.known)), np.zeros((1, 3)))[0]
    share = np.square(sensors.free_frequencies / rest)
    return np.asarray(SHARE * share / (1.0 - share))


def samples(sensors: Sensors, errors: Array, loads: Array) -> Samples:
    """Readings of one sensor under loads (n, 3 or 5; N, N m)."""
    frequency = sensors.under(errors, np.vstack([sensors.range.pressed(0.0), loads]))
    return Samples(frequency[1:], frequency[0], loads[:, sensors.range.columns] / sensors.range.full_scales)


def map_terms(axes: int, count: int) -> Exponents:
    """Exponents (terms, axes) of a map that is fitted to `count` samples: all up to the highest degree, `MAX_DEGREE` at
    most, for which there are `POINTS_A_TERM` samples a term.
    """
    found = (exponents([1.0] * axes, degree, 1) for degree in range(MAX_DEGREE, 0, -1))
    return next(each for each in found if count >= POINTS_A_TERM * len(each))


def linear(seen: Array, forces: Array, noise: Array) -> Array:
    """The straight map (axes, coils) from (n, coils) of what coils give, each with so much noise, to forces."""
    square = seen.T @ seen + len(seen) * np.diag(noise**2)
    return np.asarray(np.linalg.solve(square, seen.T @ forces).T)


def fitted_map(sensors: Sensors, learnt: Samples, rest: Array) -> InverseMap:
    """The map of one sensor by least squares of its samples, without its error. `rest` (coils; Hz) is the reading
    without load.
    """
    own, spec, scope = gain(sensors), sensors.model.spec, sensors.range
    seen = changes(learnt.readings, learnt.rest, own)
    mix = linear(seen, learnt.forces, 2.0 * sensors.noise * own)
    mixed = seen @ mix.T
    powers = map_terms(len(mix), len(seen))
    coefficients = np.linalg.lstsq(monomials(mixed, powers), learnt.forces, rcond=SMALLEST)[0]
    return InverseMap(
        sensor=spec.name, revision=spec.issue.revision or "", coils=sensors.coils, axes=scope.axes,
        full_scale=scope.full_scales, error=np.zeros(len(mix)), rest=np.rint(sensors.conversion.counts(rest)),
        gain=own, mix=mix, low=mixed.min(axis=0), high=mixed.max(axis=0), powers=powers,
        coefficients=np.ascontiguousarray(coefficients.T),  # as a document that is read back has them
    )


def error_on_others(sensors: Sensors, found: InverseMap) -> Array:
    """Errors (axes; N), rms, of a map on sensors as they are made, each after its own tare."""
    loads, square = sensors.range.inside(ASKED // 2, LEARNT), []
    for errors in stratified(sensors.known, SCATTERED, SCATTER_SEED):
        other = samples(sensors, errors, loads)
        square.append((found(other.readings, other.rest) / sensors.range.full_scales - other.forces) ** 2)
    return np.asarray(np.sqrt(np.mean(square, axis=(0, 1))) * sensors.range.full_scales)


def own_map(sensors: Sensors, errors: Array) -> InverseMap:
    """The map of one sensor, by its `errors` (zeros: as it is drawn), to a chart that some loads solved for it set
    right; its error is what the form itself leaves of loads that it was not fitted to, the converter's noise in it,
    and what the chart is off by at those loads, each as if it had not set the chart right, where a chart that ends
    before this sensor does shows.
    """
    # loads at the edge of the range among those that are fitted, where a map would else end before the required load
    learnt, asked = np.vstack([sensors.range.inside(LEARNT), sensors.range.rim]), sensors.range.inside(ASKED, LEARNT)
    loads, count = np.vstack([learnt, asked]), len(learnt)
    whole = samples(sensors, errors, loads)
    solved = sensors.under(errors, np.vstack([sensors.range.pressed(0.0), loads[:SOLVED]]), exact=True)
    right, left = _set_right(sensors, errors, loads, solved)
    readings = whole.readings * right
    found = fitted_map(sensors, Samples(readings[:count], whole.rest, whole.forces[:count]), solved[0])
    noisy = sensors.read(readings[count:], np.random.default_rng(SEED), 1)
    by_form = found(noisy, whole.rest) - whole.forces[count:] * sensors.range.full_scales
    by_chart = found(solved[1:] * left, solved[0]) - found(readings[:SOLVED], whole.rest)
    return replace(found, error=np.sqrt(np.mean(by_form**2, axis=0) + np.mean(by_chart**2, axis=0)))


def error_by_unknowns(sensors: Sensors, fit: ModelFit) -> Array:
    """Errors (sensors, axes; N), rms, of the found sensor's map on others from which the readings may come."""
    loads = np.vstack([sensors.range.pressed(0.0), sensors.range.inside(ASKED // 2, LEARNT)])
    slopes = unknown_slopes(sensors, loads, True, fit.errors)
    towards = np.linalg.pinv(load_slopes(sensors, fit.errors, loads[1:]))
    wrong = towards @ (slopes[1:] - slopes[:1])
    square = np.mean((fit.likely @ np.swapaxes(wrong, 1, 2)) ** 2, axis=0)
    return np.asarray(np.sqrt(square) * sensors.range.full_scales)


def _set_right(sensors: Sensors, errors: Array, loads: Array, solved: Array) -> tuple[Array, Array]:
    """What charted readings under loads are multiplied with, (n, coils), so that they agree with `solved` ones: of rest
    and the first of the loads; and what solved ones are, so that they are as far off as had they not been among those
    that it was fitted to: of least squares a residual over 1 - its leverage (Allen, Technometrics 16, 1974).
    """
    tried = np.vstack([sensors.range.pressed(0.0), loads[: len(solved) - 1]])
    off = np.log(solved) - np.log(sensors.under(errors, tried))
    scale, columns = sensors.range.full_scales, sensors.range.columns
    powers = exponents([1.0] * len(columns), DEGREE, 1)
    known, asked = (monomials(part[:, columns] / scale, powers) for part in (tried[1:], loads))
    found = np.linalg.lstsq(known, off[1:] - off[0], rcond=None)[0]
    leverage = np.sum(np.linalg.qr(known)[0] ** 2, axis=1)[:, None]
    more = (off[1:] - off[0] - known @ found) * leverage / np.maximum(1.0 - leverage, LEAST_LEFT)
    return np.exp(asked @ found), np.exp(more)
