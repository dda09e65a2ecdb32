"""Temperature change in the error budget, its effect on metal and pad, and the temperature compensation of a spec."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sitscad.assembly.places.state import FREE, REST
from sitscad.basics.arrays import Array
from sitscad.estimates import estimate_layout
from sitscad.estimates.coil_estimates import CoilEstimate
from sitscad.estimates.loads.pad import linear_poses
from sitscad.estimates.performance.bench import LoadModel
from sitscad.estimates.performance.compensation import (
    UNIFORM,
    Compensation,
    pad_lag,
    reference_reading,
    thermistor_reading,
)
from sitscad.estimates.windings.losses import SCREENING
from sitscad.layout.board import Layout
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.sensor import ReadoutSpec, Requirements

WARMER = 10.0  # Warming (K) for the effect of copper and other metal


def farthest_temperature(needs: Requirements) -> float:
    """Return the temperature (degrees Celsius) of the required range that differs most from the tare's temperature.

    If no range is required, the temperature is `WARMER` above the tare's.
    """
    ends = needs.temperature_range or (needs.temperature + WARMER,)
    return max(ends, key=lambda end: abs(end - needs.temperature))


def warming(needs: Requirements) -> float:
    """Return the largest temperature change (K) after the tare, for the error budget and for checks."""
    return abs(farthest_temperature(needs) - needs.temperature)


def capacitor_drift(readout: ReadoutSpec) -> float:
    """Return the standard deviation (per K) of the change of ln(frequency) by a capacitor's temperature coefficient."""
    return 0.5 * readout.device.limit("capacitor_temperature") / UNIFORM


def choose_compensation(
    readout: ReadoutSpec, needs: Requirements, pad: ElastomerPad | None, target: Target | None,
    drift: float | None, noise: float, has_own_windings: bool = False,
) -> Compensation | None:
    """Return the compensation of drift over the required temperature change, by the sensor with the least error.

    The sensor is a thermistor or a reference coil. `drift` (per K) is the change of ln(frequency) of a reference coil;
    None if there is no such coil. `has_own_windings` is True if its windings differ from the windings of the other
    coils. `noise` is one sigma of its reading. The result is None if nothing measures the
    temperature, or if there is no pad or no target. `needs` are the spec's requirements.
    """
    sensor, settings = readout.thermistor, readout.compensation
    if settings is None or settings.difference is None or pad is None or target is None:
        return None
    low, high = sorted((needs.temperature, farthest_temperature(needs)))
    readings = []
    if sensor is not None:
        readings.append(thermistor_reading(sensor.part, sensor.at, settings.difference, low, high))
    if drift:
        readings.append(reference_reading(drift, noise, capacitor_drift(readout), settings.difference, high - low,
                                          has_own_windings))
    if not readings:
        return None
    lag = pad_lag(pad.thickness, pad.material.density, target.thickness, settings.rate)
    return Compensation(warming(needs), min(readings, key=lambda reading: reading.sigma), min(lag, warming(needs)))


def reference_drift(alone: Layout, capacitance: float | None, temperature: float, is_rough: bool = False) -> float:
    """Return the drift (per K) of ln(frequency) of a reference coil by warming of copper and other metal.

    `alone` is the board with this coil only, `capacitance` (F) the capacitor of its tank, and `temperature` (degrees
    Celsius) the temperature of the tare. `is_rough` is for screening. The result is 0 if the tank does not oscillate.
    """
    spec = replace(alone.spec, readout=replace(alone.spec.readout, capacitance=capacitance))
    tolerance = SCREENING if is_rough else None
    cold, warm = (estimate_layout(replace(alone, spec=spec), tolerance=tolerance, temperature=each).coils
                  for each in (temperature, temperature + WARMER))
    state = REST if REST in cold[0].states else FREE  # without metal nearby, the coil is free in use
    return float(by_metal(cold, warm, WARMER, np.zeros(1), state)[0])


def warm_poses(bench: LoadModel, loads: Array, warming: float, expansion: float = 1.0, modulus: float = 1.0) -> Array:
    """Return poses (n, 6; m, rad) of the target under loads (n, 3 or 5; N, N m) on a pad that is warmer.

    `warming` is in K. `expansion` and `modulus` multiply the coefficients of its material.
    """
    assert bench.spec.elastomer is not None
    material = bench.spec.elastomer.material
    pad = bench.pad.expanded(material.expansion * expansion * warming)
    stiffness = 1.0 + material.modulus_temperature_coefficient * modulus * warming
    poses = bench.poses(loads, replace(pad, shear_modulus=pad.shear_modulus * stiffness))
    poses[:, 2] += pad.thickness - bench.pad.thickness
    return poses


def expansion_drift(bench: LoadModel, loads: Array, expansion: float) -> Array:
    """Return changes (n, coils; per K) of the readings under loads (n, 3 or 5; N, N m) by expansion of the pad.

    `expansion` (per K) is the linear expansion of its material. A thicker pad lifts the target, and it is also softer.
    """
    thicker = bench.pad.expanded(WARMER * expansion)
    cold, warm = bench.poses(loads), thicker.pose(loads, is_held=not bench.range.has_moments)
    lost = np.isnan(warm[:, 0])  # near the force at which the pad buckles, both poses are linear estimates
    cold[lost], warm[lost] = (linear_poses(pad, loads[lost]) for pad in (bench.pad, thicker))
    warm[:, 2] += thicker.thickness - bench.pad.thickness
    readings = bench.readings(np.concatenate([cold, warm]))
    return np.asarray((readings[len(loads):] - readings[: len(loads)]) / WARMER)


def metal_drift(metal: Array, at_rest: Array, reading: Array, others: Array) -> Array:
    """Return the drifts (n, coils; per K) by warmer metal under n loads with the readings `others` (n, coils).

    Two drifts are known: `at_rest` (coils; per K), and `metal` (coils; per K) under a normal force with the readings
    `reading` (coils). A target that comes nearer, or covers more of a coil, changes reading and drift together. The
    result is therefore linear in the readings, with one slope for all coils.
    """
    slope = reading @ (metal - at_rest) / max(float(reading @ reading), 1e-300)
    return np.asarray(metal + slope * (others - reading))


def by_metal(
    coils: Sequence[CoilEstimate], warm_coils: Sequence[CoilEstimate], warming: float, rest: Array, state: str = REST
) -> Array:
    """Return the changes (coils; per K) of the readings in a `state` if copper and other metal become warmer.

    `coils` and `warm_coils` are estimates at two temperatures, `warming` (K) apart. All changes are 0 if the number of
    coils differs from the number of readings at rest, `rest`.
    """
    derivatives = []
    for coil, warm in zip(coils, warm_coils, strict=True):
        if state in coil.states and state in warm.states:
            derivatives.append(math.log(warm.states[state].frequency / coil.states[state].frequency) / warming)
        else:
            derivatives.append(math.nan)
    return np.nan_to_num(np.array(derivatives)) if len(derivatives) == len(rest) else np.zeros_like(rest)
