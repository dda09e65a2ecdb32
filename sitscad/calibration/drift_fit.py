"""Fit of the coefficients of drift of one sensor to rows at further temperatures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from statistics import NormalDist

import numpy as np

from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.calibration.inverse_map import InverseMap
from sitscad.calibration.model_fit import leave_one_out_likelihoods
from sitscad.calibration.points import CHANCE, Points, chi_square_chance, load_slopes, unknown_slopes, whiteners
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual_value
from sitscad.estimates.performance.compensation import (
    CALIBRATION,
    CAPACITORS,
    EXPANSION,
    METAL,
    PAD_MODULUS,
    DriftCoefficients,
    root_sum_square,
)
from sitscad.estimates.performance.points import SensingAnalysis
from sitscad.estimates.performance.warming import capacitor_drift, expansion_drift
from sitscad.spec.presets import compensation_figure

MODEL_ERROR = 0.02
"""Assumed relative error of the change of a coil's drift under load, apart from the errors of the fitted unknowns."""

SAME_LOAD = 1e-3
"""Largest relative difference of two loads that count as equal."""


@record(eq=False)
class DriftFit:
    """Coefficients of drift of one sensor, fitted to rows at further temperatures.

    * ``coefficients``: the coefficients for firmware
    * ``moved``: each unknown by name with its value, its sigma, and its sigma before the fit. Unknowns are the causes
      of drift, divided by their values in the design, and the drift of each capacitor (per K).
    * ``chi_square`` and ``free``: sum of squares of residuals and unknowns over their sigmas, and its number of terms
    * ``excess``: ratio of the actual errors to the expected errors; 1 if the difference may be chance
    * ``lines`` (n), ``celsius`` (n) and ``loads`` (n, 3 or 5; N, N m): the used rows
    * ``disagreement`` (n): chi-square of each row in a fit to the other rows, as standard deviations of a normal
      distribution
    * ``without`` and ``compensated`` (n, axes; N): forces of the rows before and after the compensation
    * ``rest_sigma`` and ``full_sigma`` (axes; N/K, N m/K): errors of the drift without load and at full load
    * ``parts`` (axes; N, N m): other parts of the drift that remain at full load
    """

    coefficients: DriftCoefficients
    moved: Mapping[str, tuple[float, float, float]]
    chi_square: float
    free: int
    excess: float
    lines: tuple[int, ...]
    celsius: Array
    loads: Array
    disagreement: Array
    without: Array
    compensated: Array
    rest_sigma: Array
    full_sigma: Array
    parts: Mapping[str, Array]

    @property
    def span(self) -> float:
        """Range (K) of the temperatures of the rows."""
        assert self.coefficients.calibrated is not None
        low, high = self.coefficients.calibrated
        return high - low

    @property
    def worst(self) -> int:
        """Index of the row that disagrees most with the others."""
        return int(np.argmax(self.disagreement))

    def error(self, kelvin: float) -> Array:
        """Return one sigma (axes; N, N m) of the drift that remains at full load after a change by `kelvin` (K)."""
        return root_sum_square({**self.parts, CALIBRATION: abs(kelvin) * self.full_sigma})

    def document(self) -> dict[str, object]:
        """Return the fit as plain values for JSON."""
        return {
            "chi_square": self.chi_square, "degrees_of_freedom": self.free, "errors_larger_than_expected": self.excess,
            "unknowns": {name: {"value": value, "sigma": sigma, "sigma_before": before}
                         for name, (value, sigma, before) in self.moved.items()},
            "rows": [{"line": line, "celsius": celsius, "disagreement_sigmas": sigmas}
                     for line, celsius, sigmas in zip(self.lines, self.celsius.tolist(), self.disagreement.tolist(),
                                                      strict=True)]}


@record(eq=False)
class DriftModel:
    """Drift of the readings of one sensor by each cause, from its fitted errors.

    `errors` (unknowns) are the errors of the sensor in `sensors`, and `sensing` the analysis of its design.
    """

    sensing: SensingAnalysis
    sensors: Sensors
    errors: Array

    @cached_property
    def sigmas(self) -> Array:
        """Standard deviations of the unknowns: metal, expansion, modulus (relative), each capacitor (per K)."""
        causes = [compensation_figure(name) for name in (METAL, EXPANSION, PAD_MODULUS)]
        return np.array([*causes, *[capacitor_drift(self.sensing.bench.spec.readout)] * len(self.sensors.coils)])

    def by_cause(self, loads: Array) -> Array:
        """Return the drift (n, coils, unknowns; per K) of ln f under n `loads` if one unknown is 1 and all others 0."""
        pad, full = self.sensing.bench.spec.elastomer, self.sensing.warmed[-1]
        assert pad is not None
        fitted = [each for each in self.sensors.unknowns if each.is_fitted]
        names = [each.name for each in fitted]
        slopes = unknown_slopes(self.sensors, loads, errors=self.errors) / [each.sigma for each in fitted]
        share = np.clip(loads[:, :1] / full.load[0], 0.0, 1.0)
        metal = full.by_metal + share * (full.by_metal_loaded - full.by_metal)
        # without a tolerance of the pad, its thickness is no unknown
        modulus = slopes[:, :, names.index("modulus")]
        if "gap" in names:  # the warm pad is thicker and has another modulus (`BondedPad.expanded`)
            factor = self.sensing.bench.pad.expansion_factor
            thicker = factor * pad.thickness * slopes[:, :, names.index("gap")]
            expansion = pad.material.expansion * (thicker + (1.0 + factor) * modulus)
        else:
            expansion = expansion_drift(self.sensing.bench, loads, pad.material.expansion)
        causes = [metal, expansion, pad.material.modulus_temperature_coefficient * modulus]
        capacitors = np.broadcast_to(np.eye(metal.shape[1]), (len(loads), *[metal.shape[1]] * 2))
        return np.concatenate([np.stack(causes, axis=2), capacitors], axis=2)

    def coefficients(self, unknowns: Array, calibrated: tuple[float, float], reference: float | None
                     ) -> DriftCoefficients:
        """Return the coefficients for firmware, for values of the unknowns. See `DriftCoefficients`."""
        design, scope = self.sensing.drift_coefficients, self.sensing.bench.range
        assert design is not None
        causes = self.by_cause(np.array([scope.normal_load(0.0), scope.normal_load(design.load)]))
        in_readings = unknowns * (np.arange(len(unknowns)) != 2)  # the modulus is corrected by a factor of the forces
        at_rest, loaded = causes @ in_readings
        return replace(design, at_rest=at_rest, loaded=loaded, stiffening=float(unknowns[2]) * design.stiffening,
                       reference=reference, calibrated=calibrated)

    def force_errors(self, load: Array, covariance: Array) -> Array:
        """Return one sigma (axes; N/K, N m/K) of the drift under a `load` (3 or 5; N, N m).

        `covariance` (unknowns, unknowns) is the covariance of the unknowns.
        """
        inverse = np.linalg.pinv(load_slopes(self.sensors, self.errors, load[None])[0])
        root = inverse @ self.by_cause(load[None])[0]
        scales = self.sensors.range.full_scales
        return np.asarray(np.sqrt(np.einsum("aj,jk,ak->a", root, covariance, root)) * scales)


def fit_drift(
    model: DriftModel, inverse: InverseMap, points: Points, celsius: Array, is_base: Flags,
    lines: tuple[int, ...], reference: float | None,
) -> DriftFit:
    """Fit the coefficients of drift of one sensor to its rows at further temperatures.

    The unknowns are linear, with the scatter of the design as their prior. Each row is compared with the row of equal
    load at the base temperature, or with the map `inverse` if there is no such row.

    Parameters
    ----------
    model, inverse
        Drift of the sensor by cause, and its map.
    points, celsius, lines
        All rows with their temperatures (n; degrees Celsius) and line numbers (n).
    is_base
        Rows (n) at the base temperature, which the map was fitted to.
    reference
        Measured drift (per K) of the reference coil. None if it does not measure the temperature.
    """
    sensors, warm, base = model.sensors, points.part(~is_base), points.part(is_base).without_drift
    assert warm.loads is not None and base.loads is not None
    full = model.sensing.warmed[-1]
    kelvin = celsius[~is_base] - celsius[is_base & points.at_rest].mean()
    causes, sigmas = model.by_cause(np.vstack([warm.loads, sensors.range.normal_load(0.0)])), model.sigmas
    nominal = np.where(np.arange(len(sigmas)) < 3, 1.0, 0.0)
    relative = warm.loads[:, sensors.range.columns] / sensors.range.full_scales
    slopes = load_slopes(sensors, model.errors, warm.loads)
    sizes = compensation_figure("repeatability") * np.linalg.norm(relative, axis=1)
    repeated = sizes[:, None, None] * slopes
    origin, offsets = _base_readings(model, inverse, base, warm.loads, slopes, repeated)
    drift, at_rest, causes = (causes @ nominal)[:-1], causes[-1] @ nominal, causes[:-1]
    off = np.log(warm.frequency) - origin - kelvin[:, None] * drift
    slope = np.concatenate([kelvin[:, None, None] * causes * sigmas, offsets], axis=2)
    noise = 2.0 * np.square(points.noise_ratio * sensors.mean_noise(int(usual_value("readings"))))
    thermal = full.compensation.reading.noise * drift if full.compensation is not None else np.zeros_like(drift)
    by_model = np.square(MODEL_ERROR * kelvin[:, None] * (drift - at_rest))
    covariance = (noise + by_model)[:, :, None] * np.eye(len(noise)) + repeated @ np.swapaxes(repeated, 1, 2)
    covariance += thermal[:, :, None] * thermal[:, None, :]
    white = whiteners(covariance)
    remainder, slope = (white @ off[..., None]).ravel(), white @ slope
    flat = slope.reshape(off.size, -1)
    inverse_normal = np.asarray(np.linalg.inv(np.eye(flat.shape[1]) + flat.T @ flat), dtype=float)
    values = inverse_normal @ flat.T @ remainder
    left = remainder - flat @ values
    square = float(left @ left + values @ values)
    chance = float(chi_square_chance(np.array(square), off.size))
    excess = math.sqrt(max(square / off.size, 1.0)) if chance < CHANCE else 1.0
    odd = np.clip(leave_one_out_likelihoods(white, slope, inverse_normal, left)[1], 1e-300, 1.0 - 1e-12)
    unknowns = nominal + sigmas * values[:len(sigmas)]
    spread = excess**2 * inverse_normal[:len(sigmas), :len(sigmas)] * np.outer(sigmas, sigmas)
    calibrated = float(celsius.min()), float(celsius.max())
    coefficients = model.coefficients(unknowns, calibrated, reference)
    with_drift = replace(inverse, drifts=coefficients)
    scope, noise_force = sensors.range, full.noise
    parts = {} if full.compensation is None else full.compensation.remaining_drift(
        full.by_kelvin, noise_force, full.axis_loads, is_calibrated=True, unlike_normal=full.unlike_normal)
    names = [METAL, EXPANSION, PAD_MODULUS, *(f"{CAPACITORS}, {coil}" for coil in sensors.coils)]
    return DriftFit(
        coefficients, dict(zip(names, zip(unknowns.tolist(), np.sqrt(np.diag(spread)).tolist(), sigmas.tolist(),
                                          strict=True), strict=True)),
        square, off.size, excess, tuple(line for line, at_base in zip(lines, is_base, strict=True) if not at_base),
        celsius[~is_base], warm.loads, -np.vectorize(NormalDist().inv_cdf)(odd),
        inverse(warm.frequency, base.rest),
        np.vstack([with_drift.compensated(row, base.rest, change)
                   for row, change in zip(warm.frequency, kelvin.tolist(), strict=True)]),
        model.force_errors(scope.normal_load(0.0), spread), model.force_errors(scope.normal_load(scope.normal), spread),
        {name: part for name, part in parts.items() if name != CALIBRATION})


def _base_readings(
    model: DriftModel, inverse: InverseMap, base: Points, loads: Array, slopes: Array, repeated: Array
) -> tuple[Array, Array]:
    """Return ln f (n, coils) at the base temperature under `loads` (n, 3 or 5), and its errors (n, coils, errors).

    For a load that a row of `base` has, they are the readings of this row. For other loads, they are computed by the
    fitted model and have the error of the map. Each error is one sigma. `slopes` are the result of `load_slopes`, and
    `repeated` (n, coils, axes) the errors of one row by the repeatability of the pad.
    """
    assert base.loads is not None
    different, number = np.unique(loads, axis=0, return_inverse=True)
    origin, errors = np.empty(repeated.shape[:2]), []
    rest = np.log(base.rest)
    for group, load in enumerate(different):
        rows, equal = number.ravel() == group, np.abs(base.loads - load).max(axis=1) <= SAME_LOAD * np.abs(load).max()
        if equal.any():
            origin[rows] = np.log(base.frequency[equal]).mean(axis=0)
            sizes = repeated / math.sqrt(equal.sum())
        else:
            pair = np.vstack([np.zeros_like(load), load])
            change = np.log(model.sensors.frequencies_under(model.errors, pair))
            origin[rows] = rest + change[1] - change[0]
            sizes = slopes * (inverse.error / inverse.full_scale)
        errors.append(np.where(rows[:, None, None], sizes, 0.0))
    return origin, np.concatenate(errors, axis=2)


def reference_coefficient(reading: Array, celsius: Array, is_base: Flags, at_rest: Flags) -> float:
    """Return the drift (per K) of a reference coil by least squares, from its readings ln f (n).

    Only readings at rest are used: in use, too, the coil measures the temperature without load. `celsius` (n) are
    temperatures. The flags `is_base` and `at_rest` (n) mark rows at the base temperature, and rows without load.
    """
    base = is_base & at_rest
    change, kelvin = (values[~is_base & at_rest] - values[base].mean() for values in (reading, celsius))
    return float(change @ kelvin / (kelvin @ kelvin))
