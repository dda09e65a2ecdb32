"""Maps from readings to forces of simulated sensors: the sensor as drawn, or a sensor with fitted errors.

All maps are polynomials, of the highest degree that the number of samples allows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.calibration.inverse_map import InverseMap, map_inputs
from sitscad.calibration.model_fit import ModelFit
from sitscad.calibration.points import load_slopes, unknown_slopes
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import draw_stratified_units
from sitscad.kernels.electromagnetics.polynomials import POINTS_A_TERM, Exponents, exponents, monomials

SMALLEST = 1e-4
"""Least ratio of a singular value of a map's terms to the largest singular value. Smaller values are neglected.

This costs no accuracy for templates (1e-3 does). It keeps a map bounded if its samples come from a surrogate far beyond
its poses.
"""

MAX_DEGREE = 6
"""Largest degree of a map.

For templates, degree five leaves 0.06 to 0.3 % of full scale, degree six up to a third less, and degree seven hardly
less than six.
"""

SHARE = 0.5
"""Fraction of the target's change of inductance at rest that enters the logarithm of a map (`map_gain`).

The remaining fraction counts as constant. The logarithm of the whole change has a pole where a distant target has no
effect. Maps near that pole were wrong by half of full scale.
"""

FITTED_LOADS, TEST_LOADS = 240, 80  # Numbers of loads to fit a map to, and of other loads for its error

SEED = 7  # Seed of the noise in the readings at the other loads

TEST_SENSORS = 64
"""Number of simulated sensors, on which the drawn sensor's map is tested for its error on other sensors."""

SCATTER_SEED = 8
"""Seed of these simulated sensors."""

SOLVED_LOADS, DEGREE = 40, 3  # Number of solved loads for a sensor's own map, and degree of the correction from them

LEAST_LEFT = 0.05  # Least divisor 1 - leverage of a residual


@record(eq=False)
class Samples:
    """Readings (n, coils) of one sensor with the tare (coils), and forces (n, axes) in full scales."""

    readings: Array
    rest: Array
    forces: Array


def map_gain(sensors: Sensors) -> Array:
    """Return `SHARE` times L(rest) / (L(without target) - L(rest)) of each coil (coils), for the drawn sensor.

    The inductances L are computed from frequencies. It is the gain of an `InverseMap`.
    """
    rest = sensors.frequencies_under(np.zeros(len(sensors.unknowns)), np.zeros((1, 3)))[0]
    share = np.square(sensors.free_frequencies / rest)
    return np.asarray(SHARE * share / (1.0 - share))


def sensor_samples(sensors: Sensors, errors: Array, loads: Array) -> Samples:
    """Return readings of one sensor under loads (n, 3 or 5; N, N m)."""
    frequency = sensors.frequencies_under(errors, np.vstack([sensors.range.pressed(0.0), loads]))
    return Samples(frequency[1:], frequency[0], loads[:, sensors.range.columns] / sensors.range.full_scales)


def map_terms(axes: int, count: int) -> Exponents:
    """Return the exponents (terms, axes) of a map for `count` samples.

    The degree is the highest, at most `MAX_DEGREE`, with `POINTS_A_TERM` samples per term.
    """
    terms = (exponents([1.0] * axes, degree, 1) for degree in range(MAX_DEGREE, 0, -1))
    return next(each for each in terms if count >= POINTS_A_TERM * len(each))


def fitted_map(sensors: Sensors, learnt: Samples, rest: Array) -> InverseMap:
    """Return the map of one sensor by least squares of its samples, without its error.

    `rest` (coils; Hz) is the reading without load.
    """
    gains, spec, scope = map_gain(sensors), sensors.model.spec, sensors.range
    signals = map_inputs(learnt.readings, learnt.rest, gains)
    # linear map (axes, coils) by least squares; the signals' noise limits its coefficients
    square = signals.T @ signals + len(signals) * np.diag((2.0 * sensors.noise * gains) ** 2)
    mix = np.asarray(np.linalg.solve(square, signals.T @ learnt.forces).T)
    mixed = signals @ mix.T
    powers = map_terms(len(mix), len(signals))
    coefficients = np.linalg.lstsq(monomials(mixed, powers), learnt.forces, rcond=SMALLEST)[0]
    return InverseMap(
        sensor=spec.name, revision=spec.issue.revision or "", coils=sensors.coils, axes=scope.axes,
        full_scale=scope.full_scales, error=np.zeros(len(mix)), rest=np.rint(sensors.conversion.counts(rest)),
        gain=gains, mix=mix, low=mixed.min(axis=0), high=mixed.max(axis=0), powers=powers,
        coefficients=np.ascontiguousarray(coefficients.T),  # memory layout as after reading a document
    )


def error_on_others(sensors: Sensors, fitted: InverseMap) -> Array:
    """Return the rms error (axes; N) of a map for the readings of simulated sensors, each after its own tare."""
    loads, square = sensors.range.inside(TEST_LOADS // 2, FITTED_LOADS), []
    for errors in draw_stratified_units(sensors.unknowns, TEST_SENSORS, SCATTER_SEED):
        other = sensor_samples(sensors, errors, loads)
        square.append((fitted(other.readings, other.rest) / sensors.range.full_scales - other.forces) ** 2)
    return np.asarray(np.sqrt(np.mean(square, axis=(0, 1))) * sensors.range.full_scales)


def fit_unit_map(sensors: Sensors, errors: Array) -> InverseMap:
    """Return the map of one sensor with these `errors` (zeros: as drawn), and its error.

    The samples come from the surrogate, corrected by some solved loads. The error has three parts. The first is the
    error of the polynomial at loads that it was not fitted to, and the second is the converter's noise there. The third
    is the error of the surrogate at the solved loads, each as if it had not been used for the correction. It shows a
    surrogate that does not cover this sensor.
    """
    # the fitted loads include the edge of the range: the map must not end before the required load
    learnt = np.vstack([sensors.range.inside(FITTED_LOADS), sensors.range.rim])
    corrected = sensors.range.inside(TEST_LOADS, FITTED_LOADS)
    loads, count = np.vstack([learnt, corrected]), len(learnt)
    whole = sensor_samples(sensors, errors, loads)
    solved = sensors.frequencies_under(errors, np.vstack([sensors.range.pressed(0.0), loads[:SOLVED_LOADS]]),
                                       exact=True)
    right, remainder = _with_rest_corrected(sensors, errors, loads, solved)
    readings = whole.readings * right
    fitted = fitted_map(sensors, Samples(readings[:count], whole.rest, whole.forces[:count]), solved[0])
    noisy = sensors.read(readings[count:], np.random.default_rng(SEED), 1)
    by_form = fitted(noisy, whole.rest) - whole.forces[count:] * sensors.range.full_scales
    by_chart = fitted(solved[1:] * remainder, solved[0]) - fitted(readings[:SOLVED_LOADS], whole.rest)
    return replace(fitted, error=np.sqrt(np.mean(by_form**2, axis=0) + np.mean(by_chart**2, axis=0)))


def error_by_unknowns(sensors: Sensors, fit: ModelFit) -> Array:
    """Return rms errors (sensors, axes; N) of the fitted sensor's map for the sensors `ModelFit.likely`."""
    loads = np.vstack([sensors.range.pressed(0.0), sensors.range.inside(TEST_LOADS // 2, FITTED_LOADS)])
    slopes = unknown_slopes(sensors, loads, True, fit.errors)
    towards = np.linalg.pinv(load_slopes(sensors, fit.errors, loads[1:]))
    wrong = towards @ (slopes[1:] - slopes[:1])
    square = np.mean((fit.likely @ np.swapaxes(wrong, 1, 2)) ** 2, axis=0)
    return np.asarray(np.sqrt(square) * sensors.range.full_scales)


def _with_rest_corrected(sensors: Sensors, errors: Array, loads: Array, solved: Array) -> tuple[Array, Array]:
    """Return two factors: for readings of the surrogate under loads (n, coils), and for solved readings.

    The first corrects readings of the surrogate to agree with `solved` ones, at rest and under the first loads. The
    second changes each solved reading so that it differs from the correction as if it had not been used for it. In
    least squares this difference is the residual over 1 - its leverage (Allen, Technometrics 16, 1974).
    """
    solved_loads = np.vstack([sensors.range.pressed(0.0), loads[: len(solved) - 1]])
    off = np.log(solved) - np.log(sensors.frequencies_under(errors, solved_loads))
    scale, columns = sensors.range.full_scales, sensors.range.columns
    powers = exponents([1.0] * len(columns), DEGREE, 1)
    solved_terms, target_terms = (monomials(part[:, columns] / scale, powers) for part in (solved_loads[1:], loads))
    coefficients = np.linalg.lstsq(solved_terms, off[1:] - off[0], rcond=None)[0]
    leverage = np.sum(np.linalg.qr(solved_terms)[0] ** 2, axis=1)[:, None]
    more = (off[1:] - off[0] - solved_terms @ coefficients) * leverage / np.maximum(1.0 - leverage, LEAST_LEFT)
    return np.exp(target_terms @ coefficients), np.exp(more)
