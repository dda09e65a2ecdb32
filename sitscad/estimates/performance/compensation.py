"""Drift that remains after temperature compensation: one sigma for every axis and each part of the drift.

The firmware reads the temperature change since the tare. For each cause, it subtracts a coefficient times this change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.spec.presets import compensation_figure
from sitscad.spec.thermistor import CALIBRATED, DESIGN, ThermistorPart

CAPACITORS, EXPANSION, METAL, PAD_MODULUS = (
    "capacitors", "expansion of the pad", "copper and other metal", "modulus of the pad")
"""Names of the causes of drift. The coefficients of all causes except the capacitors are known from the design."""

CALIBRATION = "calibration at two temperatures"
"""Name of the part of the remaining drift by errors of coefficients that were measured on the unit."""

KELVIN, REFERENCE_TEMPERATURE = 273.15, 25.0 + 273.15
"""Absolute temperatures (K) of 0 degrees Celsius, and of a thermistor's nominal resistance (25 degrees Celsius)."""

UNIFORM = math.sqrt(3.0)
"""Largest error divided by the standard deviation, for an error with a uniform distribution."""


@record
class TemperatureReading:
    """Reading of a temperature change since the tare, by a sensor or a reference coil, with its errors (K; one sigma).

    ``by_tolerance`` is the error by the tolerance of the temperature sensor. A calibration at two temperatures removes
    it. ``noise`` is the noise of one reading. ``difference`` is the temperature difference of sensor and pad.
    ``is_by_metal`` is True for a reference coil. Its drift then deviates from nominal in proportion to the other coils'
    drift, unless ``has_own_windings``. ``source`` is the name of the sensor.
    """

    source: str
    by_tolerance: float
    noise: float
    difference: float
    is_by_metal: bool = False
    has_own_windings: bool = False

    @property
    def sigma(self) -> float:
        """Standard deviation (K) of the reading by all errors together."""
        return math.hypot(self.by_tolerance, self.noise, self.difference)


def thermistor_reading(part: ThermistorPart, place: str, difference: float, low: float, high: float
                       ) -> TemperatureReading:
    """Return the reading of a change between two temperatures by a thermistor or a digital sensor.

    `low` and `high` (degrees Celsius) are the two temperatures. `difference` (K) is one sigma
    between the temperature at `place` and the pad's.

    Notes
    -----
    A digital sensor has independent errors at both ends. For a thermistor, 1/T = 1/T25 + ln(R/R25)/B. So a relative
    error r of R25 moves T by -T^2 r/B. A relative error of B moves it by (T - T^2/T25) times this error. The errors of
    both ends are subtracted. Self-heating is neglected: it is equal at both ends.
    """
    if part.resistance is None or part.b is None:
        tolerance = math.sqrt(2.0) * part.error
    else:
        ends = [celsius + KELVIN for celsius in (low, high)]
        by_resistance = (ends[1]**2 - ends[0]**2) * part.resistance_tolerance / part.b
        by_exponent = np.diff([t - t * t / REFERENCE_TEMPERATURE for t in ends])[0] * part.b_tolerance
        tolerance = math.hypot(by_resistance, by_exponent)
    return TemperatureReading(f"{part.product} at the {place}", tolerance / UNIFORM, part.noise, difference)


def reference_reading(
    drift: float, noise: float, capacitor: float, difference: float, change: float, has_own_windings: bool = False
) -> TemperatureReading:
    """Return the reading of a temperature change by a reference coil, which no target covers. `change` is in K.

    `drift` (per K) is the change of the coil's ln(frequency) by copper and other metal. `capacitor` (per K) is one
    sigma of its change by the capacitor. `noise` is one sigma of a reading, ln(frequency). `difference` (K) is one
    sigma between the coil's temperature and the pad's. `has_own_windings` is True if they differ from the windings of
    the other coils.
    """
    drift = abs(drift)
    return TemperatureReading("the reference coil", abs(change) * capacitor / drift, noise / drift, difference, True,
                              has_own_windings)


def pad_lag(thickness: float, density: float | None, metal: float, rate: float) -> float:
    """Return the temperature (K) by which the middle of a pad lags behind the board, if the board warms steadily.

    The pad is `thickness` (m) thick, with a `density` (kg/m3), and a target of thickness `metal` (m) on it. `rate` is
    in K/s.

    Notes
    -----
    All heat flows from the board through pad and target. The flux at height x is q (c rho (t - x) + C). Here q is the
    rate, c rho the heat capacity of the pad per volume, and C the heat capacity of the target per area. The lag at x is
    the integral of flux over conductivity k. Its mean is (q/k) (c rho t^2/3 + C t/2) (Carslaw and Jaeger, Conduction of
    Heat in Solids, 3.8). Tissue at the target also warms it, so this is an upper bound.
    """
    heat = compensation_figure("silicone heat") * (density or compensation_figure("silicone density"))
    target = compensation_figure("metal heat") * metal
    return rate / compensation_figure("silicone conductivity") * (heat * thickness**2 / 3.0 + target * thickness / 2.0)


@record(eq=False)
class DriftCoefficients:
    """Coefficients with which firmware compensates drift.

    * ``at_rest`` and ``loaded`` (coils; per K): changes of ln(frequency) without load, and under the normal force
      ``load`` (N)
    * ``stiffening`` (per K): relative change of the pad's modulus
    * ``warming`` (K): temperature change of the design
    * ``reference`` (per K): drift of a reference coil that measures the temperature. None if there is no such coil.
    * ``thermistor``: the sensor that measures the temperature. None for a reference coil.
    * ``calibrated`` (degrees Celsius): lowest and highest temperature at which the coefficients were measured. None for
      the coefficients of the design.
    """

    at_rest: Array
    loaded: Array
    load: float
    stiffening: float
    warming: float
    reference: float | None = None
    thermistor: ThermistorPart | None = None
    calibrated: tuple[float, float] | None = None

    @property
    def largest_change(self) -> float:
        """Largest temperature change (K) since the tare that is compensated."""
        if self.calibrated is None:
            return DESIGN_MARGIN * self.warming
        low, high = self.calibrated
        return CALIBRATED_MARGIN * (high - low)

    def document(self) -> dict[str, object]:
        """Return the coefficients as plain values for JSON."""
        return {"at_rest": self.at_rest.tolist(), "loaded": self.loaded.tolist(), "load_N": self.load,
                "stiffening": self.stiffening, "warming_K": self.warming, "reference": self.reference,
                "calibrated_degC": None if self.calibrated is None else list(self.calibrated),
                "largest_change_K": self.largest_change}


DESIGN_MARGIN, CALIBRATED_MARGIN = 1.2, 1.05
"""Largest temperature change that is compensated, divided by the design's change or by the calibrated range.

Measured coefficients are not extrapolated. Their margin only covers the errors of the temperature readings.
"""


@record(eq=False)
class Compensation:
    """Compensation of drift after a temperature change `warming` (K), by a `reading` of the temperature.

    `lag` (K) is the temperature by which the pad lags behind the board.
    """

    warming: float
    reading: TemperatureReading
    lag: float

    def document(self) -> dict[str, object]:
        """Return the settings for JSON."""
        return {"by": self.reading.source, "warming_K": self.warming, "tolerance_K": self.reading.by_tolerance,
                "noise_K": self.reading.noise, "difference_K": self.reading.difference, "lag_K": self.lag}

    def parts(self, causes: Mapping[str, Array], noise: Array, carried: Array, unlike_normal: Array
              ) -> dict[str, dict[str, Array]]:
        """Return the remaining drift by parts, for coefficients of the design and for calibrated coefficients.

        See `remaining_drift` for parts and arguments.
        """
        return {source: self.remaining_drift(causes, noise, carried, source == CALIBRATED, unlike_normal)
                for source in (DESIGN, CALIBRATED)}

    def remaining_drift(self, causes: Mapping[str, Array], noise: Array, carried: Array, is_calibrated: bool,
             unlike_normal: Array | None = None) -> dict[str, Array]:
        """Return the standard deviation (N, N m) of the drift that remains on every axis, by each part.

        `causes` (N/K, N m/K) are the drifts by cause, with signs except for the capacitors. `noise` (N, N m) is one
        sigma of a reading, and `carried` (N, N m) the load. `unlike_normal` (N/K, N m/K) are errors under a load on
        each axis by coefficients for the normal force alone. A calibration at both temperatures measures all
        coefficients on the unit, with two readings at rest and two under load. `is_calibrated` selects coefficients
        from such a calibration instead of the design's.
        """
        whole = sum((value for name, value in causes.items() if name != CAPACITORS), np.zeros_like(noise))
        parts: dict[str, Array]
        if is_calibrated:
            repeated = compensation_figure("repeatability") * carried
            parts = {CALIBRATION: math.sqrt(2.0) * np.hypot(noise, repeated)}
        else:
            coefficients = dict(causes)
            if self.reading.is_by_metal:
                # copper that drifts more also makes a reference coil read more: then all other causes are wrong. Other
                # windings scatter by themselves: then the reading is wrong, and the effect of copper, too
                coefficients[METAL] = np.asarray(
                    np.hypot(whole, causes[METAL]) if self.reading.has_own_windings else whole - causes[METAL])
            parts = {name: self.warming * value * (
                1.0 if name == CAPACITORS else compensation_figure(name)) for name, value in coefficients.items()}
            parts["tolerance of the temperature sensor"] = self.reading.by_tolerance * whole
        if unlike_normal is not None and unlike_normal.any():
            parts["coefficients without shear or moment"] = self.warming * unlike_normal
        parts["noise of the temperature"] = math.sqrt(2.0) * self.reading.noise * whole
        parts["difference of temperature to the pad"] = self.reading.difference * whole
        parts["lag of the pad"] = self.lag * (causes[EXPANSION] + causes[PAD_MODULUS])
        return {name: np.abs(part) for name, part in parts.items()}


def root_sum_square(parts: Mapping[str, Array]) -> Array:
    """Return the standard deviation (N, N m) of every axis by all parts together. The parts are independent."""
    return np.asarray(np.sqrt(sum(np.square(part) for part in parts.values())))
