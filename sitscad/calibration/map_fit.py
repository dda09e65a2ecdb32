"""Fit of maps from readings to forces: for the nominal sensor, or for a sensor with fitted errors.

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
"""Least singular value of a map's terms that is used, divided by the largest singular value.

Omitting smaller values costs no accuracy for templates (a limit of 1e-3 does). It keeps a map bounded if the surrogate
is extrapolated far beyond its poses.
"""

MAX_DEGREE = 6
"""Largest degree of a map's polynomial.

For templates, degree five leaves errors of 0.06 to 0.3 % of full scale. Degree six leaves up to a third less, and
degree seven hardly less than degree six.
"""

SHARE = 0.5
"""Factor in the gain of a map's logarithm (`map_gain`).

With a factor of 1, the logarithm is infinite at the readings without a target. Maps then had errors of half of full
scale near these readings.
"""

FITTED_LOADS, TEST_LOADS = 240, 80  # Numbers of loads to fit a map to, and of other loads for its error
"""Number of loads to which a map is fitted, and number of other loads at which its error is computed."""

SEED = 7  # Seed of the noise in the readings at the other loads
"""Seed of the random noise in the readings at the test loads."""

TEST_SENSORS = 64
"""Number of simulated sensors for which the error of the nominal sensor's map is computed."""

SCATTER_SEED = 8
"""Seed of the `TEST_SENSORS` simulated sensors."""

SOLVED_LOADS, DEGREE = 40, 3  # Number of solved loads for a sensor's own map, and degree of the correction from them
"""Number of loads with a field solution for one sensor's map, and degree of the polynomial for their corrections.

A correction is the difference of a reading between field solution and surrogate.
"""

LEAST_LEFT = 0.05  # Least divisor 1 - leverage of a residual
"""Least value of 1 - leverage, by which a residual is divided."""


@record(eq=False)
class Samples:
    """Samples from which a map is fitted.

    `readings` (n, coils) belong to the forces `forces` (n, axes), which are divided by full scale. `rest` (coils) is
    the reading at rest.
    """

    readings: Array
    rest: Array
    forces: Array


def map_gain(sensors: Sensors) -> Array:
    """Return the gain of each coil in an `InverseMap` (coils), for the nominal sensor with all unknowns zero.

    The gain is `SHARE` L(rest) / (L(without target) - L(rest)). The ratio of inductances is the inverse squared ratio
    of frequencies.
    """
    rest = sensors.frequencies_under(np.zeros(len(sensors.unknowns)), np.zeros((1, 3)))[0]
    share = np.square(sensors.free_frequencies / rest)
    return np.asarray(SHARE * share / (1.0 - share))


def sensor_samples(sensors: Sensors, errors: Array, loads: Array) -> Samples:
    """Return the samples of one sensor with these `errors` under loads (n, 3 or 5; N, N m), from the surrogate."""
    frequency = sensors.frequencies_under(errors, np.vstack([sensors.range.normal_load(0.0), loads]))
    return Samples(frequency[1:], frequency[0], loads[:, sensors.range.columns] / sensors.range.full_scales)


def map_exponents(axes: int, count: int) -> Exponents:
    """Return the exponents (terms, axes) of a map's polynomial for `count` samples.

    The degree is the highest, up to `MAX_DEGREE`, for which each term has `POINTS_A_TERM` samples.
    """
    terms = (exponents([1.0] * axes, degree, 1) for degree in range(MAX_DEGREE, 0, -1))
    return next(each for each in terms if count >= POINTS_A_TERM * len(each))


def fit_map(sensors: Sensors, learnt: Samples, rest: Array) -> InverseMap:
    """Return the map of one sensor by least squares from samples. Its stated error is left at 0.

    `rest` (coils; Hz) are the frequencies without load.
    """
    gains, spec, scope = map_gain(sensors), sensors.model.spec, sensors.range
    signals = map_inputs(learnt.readings, learnt.rest, gains)
    # linear map (axes, coils) by least squares; the signals' noise limits its coefficients
    square = signals.T @ signals + len(signals) * np.diag((2.0 * sensors.noise * gains) ** 2)
    mix = np.asarray(np.linalg.solve(square, signals.T @ learnt.forces).T)
    mixed = signals @ mix.T
    powers = map_exponents(len(mix), len(signals))
    coefficients = np.linalg.lstsq(monomials(mixed, powers), learnt.forces, rcond=SMALLEST)[0]
    return InverseMap(
        sensor=spec.name, revision=spec.issue.revision or "", coils=sensors.coils, axes=scope.axes,
        full_scale=scope.full_scales, error=np.zeros(len(mix)), rest=np.rint(sensors.conversion.counts(rest)),
        gain=gains, mix=mix, low=mixed.min(axis=0), high=mixed.max(axis=0), powers=powers,
        coefficients=np.ascontiguousarray(coefficients.T),  # memory layout as after reading a document
    )


def error_for_other_sensors(sensors: Sensors, fitted: InverseMap) -> Array:
    """Return the rms force error (axes; N) of a map for simulated sensors. Each sensor has its own tare."""
    loads, square = sensors.range.evenly_spread_loads(TEST_LOADS // 2, FITTED_LOADS), []
    for errors in draw_stratified_units(sensors.unknowns, TEST_SENSORS, SCATTER_SEED):
        other = sensor_samples(sensors, errors, loads)
        square.append((fitted(other.readings, other.rest) / sensors.range.full_scales - other.forces) ** 2)
    return np.asarray(np.sqrt(np.mean(square, axis=(0, 1))) * sensors.range.full_scales)


def fit_unit_map(sensors: Sensors, errors: Array) -> InverseMap:
    """Return the map of one sensor with these `errors` (all zero for the nominal sensor), with its stated error.

    The samples come from the surrogate and are corrected by field solutions at some loads. The stated error has three
    parts: the polynomial's error at test loads, the converter's noise there, and the surrogate's error at the loads
    with a field solution. For the third part, each of these loads is left out of the correction in turn. This part is
    large if the surrogate does not cover the sensor.
    """
    # the fitted loads include the edge of the range: the map must not end before the required load
    learnt = np.vstack([sensors.range.evenly_spread_loads(FITTED_LOADS), sensors.range.edge_loads])
    corrected = sensors.range.evenly_spread_loads(TEST_LOADS, FITTED_LOADS)
    loads, count = np.vstack([learnt, corrected]), len(learnt)
    whole = sensor_samples(sensors, errors, loads)
    solved = sensors.frequencies_under(errors, np.vstack([sensors.range.normal_load(0.0), loads[:SOLVED_LOADS]]),
                                       exact=True)
    right, remainder = _correction_factors(sensors, errors, loads, solved)
    readings = whole.readings * right
    fitted = fit_map(sensors, Samples(readings[:count], whole.rest, whole.forces[:count]), solved[0])
    noisy = sensors.noisy_frequencies(readings[count:], np.random.default_rng(SEED), 1)
    by_form = fitted(noisy, whole.rest) - whole.forces[count:] * sensors.range.full_scales
    by_chart = fitted(solved[1:] * remainder, solved[0]) - fitted(readings[:SOLVED_LOADS], whole.rest)
    return replace(fitted, error=np.sqrt(np.mean(by_form**2, axis=0) + np.mean(by_chart**2, axis=0)))


def error_by_unknowns(sensors: Sensors, fit: ModelFit) -> Array:
    """Return the rms force errors (sensors, axes; N) of the fitted sensor's map if it is used for other sensors.

    The other sensors are `ModelFit.likely`: random sensors that agree with the measured points.
    """
    scope = sensors.range
    loads = np.vstack([scope.normal_load(0.0), scope.evenly_spread_loads(TEST_LOADS // 2, FITTED_LOADS)])
    slopes = unknown_slopes(sensors, loads, True, fit.errors)
    towards = np.linalg.pinv(load_slopes(sensors, fit.errors, loads[1:]))
    wrong = towards @ (slopes[1:] - slopes[:1])
    square = np.mean((fit.likely @ np.swapaxes(wrong, 1, 2)) ** 2, axis=0)
    return np.asarray(np.sqrt(square) * sensors.range.full_scales)


def _correction_factors(sensors: Sensors, errors: Array, loads: Array, solved: Array) -> tuple[Array, Array]:
    """Return factors for the surrogate's readings under `loads` (n, coils), and factors for the `solved` readings.

    The first factors correct the surrogate by a polynomial, fitted to the `solved` readings at rest and under the first
    loads. The second factors serve to compute the error of this correction at each solved load, as if the load had not
    been fitted. In least squares, this leave-one-out difference is the residual divided by 1 - leverage (Allen,
    Technometrics 16, 1974).
    """
    solved_loads = np.vstack([sensors.range.normal_load(0.0), loads[: len(solved) - 1]])
    off = np.log(solved) - np.log(sensors.frequencies_under(errors, solved_loads))
    scale, columns = sensors.range.full_scales, sensors.range.columns
    powers = exponents([1.0] * len(columns), DEGREE, 1)
    solved_terms, target_terms = (monomials(part[:, columns] / scale, powers) for part in (solved_loads[1:], loads))
    coefficients = np.linalg.lstsq(solved_terms, off[1:] - off[0], rcond=None)[0]
    leverage = np.sum(np.linalg.qr(solved_terms)[0] ** 2, axis=1)[:, None]
    more = (off[1:] - off[0] - solved_terms @ coefficients) * leverage / np.maximum(1.0 - leverage, LEAST_LEFT)
    return np.exp(target_terms @ coefficients), np.exp(more)
