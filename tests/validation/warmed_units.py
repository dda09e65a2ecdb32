"""Drift of simulated units from 20 to 37 degC after a tare at 20 degC, each warmed and solved anew, by brute force.

    python tests/validation/warmed_units.py [--units 200] [CASE ...]

Every unit has errors of its own: the effect of temperature on copper and other metal, expansion and modulus of the pad,
the capacitor of each coil, the clock of the converter, the temperature sensor, its distance to the pad in kelvins, and
noise. Metal is solved at the unit's temperature, with the target at the place that the warm pad gives it. Forces are
those of the design's map: without a compensation, with coefficients of the design, and with coefficients of a
calibration at two temperatures, whose forces are repeated to 1 % of full scale. The table compares root mean squares
and 95 % of the magnitudes (mN) with the stated standard deviations (mN).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from statistics import NormalDist

import numpy as np

import sitscad
from sitscad import Design
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.performance.compensation import EXPANSION, METAL, PAD_MODULUS, root_sum_square
from sitscad.estimates.performance.warming import capacitor_drift, warm_poses
from sitscad.estimates.performance_values import loads_on_axis
from sitscad.spec.presets import compensation_figure
from sitscad.spec.thermistor import CALIBRATED, DESIGN

COLD, WARM = 20.0, 37.0
TEMPLATES = Path(__file__).parents[2] / "templates"
CASES = {
    "grasper_4layer": {"readout.thermistor.part": "tmp117"},
    "grasper_steady": {},
    "bench_7mm": {"readout.thermistor.part": "tmp117", "readout.capacitance": "100 pF"},
}
"""Changes of each template. A fixed capacitance keeps the tank when the temperature changes."""

CLOCK = 50e-6 / 62.5
"""Largest drift of the converter's clock (per K): 50 ppm at the ends of -40 to 85 degC, taken as linear from 22.5."""

MODELLED = 20.0, 28.5, 37.0, 45.5
"""Temperatures (degC) at which metal is solved. Between them, ln(frequency) at each unit's poses is interpolated by a
cubic: within 1e-10 of a solution at the unit's temperature."""

PLAIN = "without"
KINDS = (PLAIN, DESIGN, CALIBRATED)
NORMAL_DRAWS = (METAL, EXPANSION, PAD_MODULUS, "difference", "tolerance", "noise", "calibration noise", "repeatability")


def case(name: str) -> Design:
    """The design of a case, with its requirements from 20 to 37 degC."""
    spec = sitscad.load(TEMPLATES / f"{name}.yaml")
    return Design(spec.replace({"requirements.temperature": f"{COLD} degC",
                                "requirements.temperature_range": [COLD, WARM], **CASES[name]}))


def draws(count: int, coils: int, seed: int = 47) -> Iterator[tuple[dict[str, float], Array, float]]:
    """Deviations of each unit: standard normal ones by name, even ones (-1 to 1) of the tanks, and of the clock."""
    generator = np.random.default_rng(seed)
    quantiles = np.array([NormalDist().inv_cdf((k + 0.5) / count) for k in range(count)])
    normal = np.transpose([generator.permutation(quantiles) for _ in NORMAL_DRAWS])
    even = generator.uniform(-1.0, 1.0, (count, coils + 2))
    for row, tanks in zip(normal, even, strict=True):
        yield dict(zip(NORMAL_DRAWS, map(float, row), strict=True)), tanks[:-1], float(tanks[-1])


def lagrange_weights(nodes: tuple[float, ...], at: float) -> Array:
    """Weights (n) of values at `nodes` in the polynomial through them, at a place."""
    return np.array([math.prod((at - other) / (node - other) for other in nodes if other != node) for node in nodes])


@record(eq=False)
class WarmedDesign:
    """A design that is warmed. `loads` (3, axes of load; N) are rest, full normal force, and this force with shear."""

    design: Design

    @property
    def bench(self):
        """Load model of the design."""
        return self.design.sensing.solved.bench

    @property
    def full(self):
        """Working point at full load."""
        return self.design.sensing.solved.warmed[-1]

    @property
    def loads(self) -> Array:
        """Loads (3, 3; N): rest, full normal force, and this force with the full shear along x."""
        rest, full = self.design.sensing.solved.warmed[0].load, self.full.load
        return np.vstack([rest, loads_on_axis(full, "shear_x", np.array([0.0, self.bench.full_scales["shear_x"]]))])

    def readings(self, celsius: float, warmer: float, expansion: float, stiffening: float, loads: Array) -> Array:
        """Readings (n, coils) under loads, with metal at `celsius` and a pad that is `warmer` by kelvins.

        `expansion` and `stiffening` multiply the material's coefficients.
        """
        poses = warm_poses(self.bench, loads, warmer, expansion, stiffening)
        frequencies = [np.log(model.on_pad(poses).frequency / self.bench.rest) for model in self.models]
        weights = lagrange_weights(MODELLED, celsius)
        return np.tensordot(weights, np.array(frequencies), 1)

    @cached_property
    def models(self) -> list:
        """Response models with metal at the temperatures `MODELLED`."""
        return [Design(self.design.spec.replace("requirements.temperature", f"{celsius} degC")).response
                for celsius in MODELLED]

    def reference(self) -> np.polynomial.Polynomial | None:
        """ln(frequency) of the reference coil since the tare, by the warming of its metal (K). None without it."""
        if not self.full.compensation.reading.is_by_metal:
            return None
        warmings = np.array([0.0, 12.0, 24.0])
        frequencies = [sitscad.estimate(self.design.layout, temperature=COLD + each).reference.states["rest"].frequency
                       for each in warmings]
        return np.polynomial.Polynomial.fit(warmings, np.log(np.array(frequencies) / frequencies[0]), 2)


def unit_errors(warmed: WarmedDesign, count: int) -> dict[str, Array]:
    """Errors (units, 3, axes; N) of the forces under the three loads, by kind of compensation."""
    design, bench, full, loads = warmed.design, warmed.bench, warmed.full, warmed.loads
    to_newtons, compensation, warming = design.sensing.solved.working.map, full.compensation, WARM - COLD
    reading, material, thermometer = compensation.reading, design.spec.elastomer.material, warmed.reference()
    capacitors = math.sqrt(3.0) * capacitor_drift(design.spec.readout) * warming
    reference_drift = design.cells.reference_drift
    at_rest = sum(design.sensing.solved.warmed[0].reading_drift.values())
    coefficients = np.array([at_rest, *2 * [sum(full.reading_drift.values())]])
    cold = to_newtons(bench.readings(bench.poses(loads)))
    errors = {kind: [] for kind in KINDS}
    for normal, tanks, clock in draws(count, len(bench.rest)):
        scales = [1.0 + normal[name] * compensation_figure(name) for name in (METAL, EXPANSION, PAD_MODULUS)]
        common = warming * clock * CLOCK
        drift = capacitors * tanks[:-1] - common

        def read(warmer, lag, at, scales=scales, drift=drift):
            metal, expansion, stiffening = scales
            return warmed.readings(COLD + warmer * metal, warmer - lag, expansion, stiffening, at) + drift

        used = read(warming + normal["difference"] * reading.difference, compensation.lag, loads)
        if thermometer is None:
            constant = normal["tolerance"] * reading.by_tolerance + warming
        else:
            shift = thermometer(warming * scales[0]) + capacitors * tanks[-1] - common
            constant = shift / reference_drift
        sensed = constant + normal["noise"] * math.sqrt(2.0) * reading.noise

        # the calibration meets the unit without lag or difference, with forces and readings that do not repeat exactly
        repeated = 1.0 + math.sqrt(2.0) * compensation_figure("repeatability") * normal["repeatability"]
        softer = 1.0 + material.modulus_temperature_coefficient * constant  # by which the forces are then multiplied
        aims = bench.readings(bench.poses(loads / softer))
        met = read(warming, 0.0, loads * repeated) + math.sqrt(2.0) * normal["calibration noise"] * bench.noise
        measured = ((met - aims) / constant)[[0, 1, 1]]  # without shear
        for kind, coefficient, change in ((PLAIN, 0.0, 0.0), (DESIGN, coefficients, sensed),
                                          (CALIBRATED, measured, sensed)):
            forces = to_newtons(used - coefficient * change)
            errors[kind].append(forces * (1.0 + material.modulus_temperature_coefficient * change) - cold)
    return {kind: np.array(each) for kind, each in errors.items()}


def stated(warmed: WarmedDesign) -> dict[str, Array]:
    """Standard deviations (2, axes; N) that the design states at rest and at full load, by kind of compensation."""
    points = [warmed.design.sensing.solved.warmed[place] for place in (0, -1)]
    result = {kind: np.array([root_sum_square(point.drift_left[kind]) for point in points])
              for kind in (DESIGN, CALIBRATED)}
    return {PLAIN: np.array([point.uncompensated_drift for point in points]), **result}


def main() -> None:
    """A table for each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", default=list(CASES))
    parser.add_argument("--units", type=int, default=200)
    request = parser.parse_args()
    for name in request.cases:
        warmed = WarmedDesign(case(name))
        results, statement = unit_errors(warmed, request.units), stated(warmed)
        print(f"{name}, {request.units} units, {warmed.full.compensation.reading.source}")
        for kind in KINDS:
            for place, load in enumerate(("rest", "full", "full and shear")):
                for k, axis in enumerate(warmed.bench.range.axes):
                    errors = 1e3 * results[kind][:, place, k]
                    figures = {
                        "rms": math.sqrt(np.mean(errors**2)), "mean": errors.mean(),
                        "95 %": np.quantile(np.abs(errors), 0.95), "largest": np.abs(errors).max(),
                        "stated": 1e3 * statement[kind][min(place, 1), k]}
                    row = "".join(f"  {label} {value:7.1f}" for label, value in figures.items())
                    print(f"{kind:11}{load:15}{axis:8}{row}", flush=True)


if __name__ == "__main__":
    main()
