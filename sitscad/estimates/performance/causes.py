"""Errors in newtons by their cause.

Readings of simulated units are converted to forces by the nonlinear map (`unit_errors`). This gives the errors by
manufacture. Other disturbances of the readings, such as noise and drift, are converted by the linear map.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property

import numpy as np

from sitscad.assembly.places.bodies import film_thickness
from sitscad.assembly.places.state import WORKING_POINTS
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.data import rows
from sitscad.estimates.circuits.uncertainty import tolerance_sigmas
from sitscad.estimates.performance.bench import LoadModel
from sitscad.estimates.performance.compensation import (
    CAPACITORS,
    EXPANSION,
    METAL,
    PAD_MODULUS,
    Compensation,
    root_sum_square,
)
from sitscad.estimates.performance.unit_errors import UnitErrors
from sitscad.estimates.performance.warming import (
    capacitor_drift,
    choose_compensation,
    expansion_drift,
    metal_drift,
    warming,
)
from sitscad.estimates.performance_values import FORCES, MOMENTS, TILTED, UNCOMPENSATED, UNMEASURED, loads_on_axis
from sitscad.estimates.tolerances.scatter import CAPACITOR, CLOCK
from sitscad.kernels.mechanics.motion import rotations
from sitscad.spec.materials import ElastomerMaterial

TARED_DRIFT = "drift with a tare before each grasp"
"""Name of the error by a temperature change if the sensor is tared before each grasp."""

AVERAGED = 1.0  # Time (s) over which the temperature of a reference coil is averaged

FORCE_STEP = 0.1e-3  # Distance (m) of the force from the middle for numerical slopes

MAX_UNIT_LOAD_ERROR = 0.01
"""Largest error of the force that the linear map computes for a load of 1 N (or 1 N m) on an axis.

If the error is larger, the sensor cannot measure this axis, and `noise` is infinite for this axis.
"""

BRANCH = 0.5  # Distance of either branch from the middle of a hysteresis loop, over the loop's width

DEGREE = math.radians(1.0)
"""Tilt (rad) of the contact in the combined errors if the spec requires no tilt."""



SMALL_TILT = 1e-3
"""Step of the tilt (rad) in the numerical derivative of the moment with respect to the tilt."""

WAYS = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
"""Directions of tilts (rx, ry, rz): about x and about y, each with both signs.

They are multiplied by the tilt angle.
"""


@record(eq=False)
class TiltEffects:
    """Effects of a tilted contact on readings at the working points of a load model.

    `loads` (points, 3 or 5; N, N m) are the loads, and `poses` (points, 6; m, rad) the target's poses, without a tilt
    by moments. `cache` holds results by angle (rad).
    """

    bench: LoadModel
    """Load model from which readings and poses are computed."""
    loads: Array
    poses: Array
    cache: dict[float, tuple[Array, Array]] = field(default_factory=dict)

    def at(self, angle: float) -> Array:
        """Return changes of the readings by a tilt (rad) in every direction of `WAYS`: (points, ways, coils).

        The target sticks to a face that is tilted and presses with the working point's force, as in the load case
        `scissor`. If the pad has no equilibrium in this case, the pose is the level pose with the tilt added.
        """
        return self._at(angle)[0]

    def moments(self, angle: float) -> Array:
        """Return moments (points, ways, 2; N m) about x and y that a tilted face exerts on the target.

        They act on the middle of the outermost face. `angle` is the tilt (rad).
        """
        return self._at(angle)[1]

    def _at(self, angle: float) -> tuple[Array, Array]:
        if angle not in self.cache:
            count, directions = len(self.poses), len(WAYS)
            wrenches = np.zeros((count * directions, 6))
            wrenches[:, 2] = -np.repeat(self.loads[:, 0], directions)
            turns = np.tile(angle * WAYS, (count, 1))
            tilted = self.bench.pad.pose(wrenches, turns=turns, is_stuck=True)
            lost = np.isnan(tilted[:, 0])
            tilted[lost] = np.repeat(self.poses, directions, axis=0)[lost]
            tilted[lost, 3:] = turns[lost]
            turned = np.log(self.bench.frequencies_at_any_tilt(np.concatenate([self.poses, tilted])))
            wrench, over = self.bench.pad.force(tilted), rotations(tilted[:, 3:])[:, :, 2] * self.bench.pad.height
            moments = wrench[:, 3:5] - np.cross(over, wrench[:, :3])[:, :2]
            changes = turned[count:].reshape(count, directions, -1) - turned[:count, None]
            self.cache[angle] = changes, moments.reshape(count, directions, 2)
        return self.cache[angle]


@record(eq=False)
class PointErrors:
    """Working point of a load model, with the errors by each cause.

    `load` (3 or 5; N, N m) is the load, `share` its fraction of full scale, and `pose` (6; m, rad) the target's pose.
    `by_pose` (coils, 6) and `by_load` (coils, axes) are derivatives of the readings with respect to the pose and to the
    measured loads. `inverse` (axes, coils; N per reading) is the linear map from readings to loads. Warmer copper and
    other metal change the readings by `by_metal` (coils; per K) at rest, and by `by_metal_loaded` (coils; per K) under
    full normal load. `all_tilts` holds the tilts of all working points; this point's index is `number`.
    """

    bench: LoadModel
    load: Array
    share: float
    pose: Array
    by_pose: Array
    by_load: Array
    inverse: Array
    by_metal: Array
    all_tilts: TiltEffects
    number: int
    by_metal_loaded: Array

    @cached_property
    def axis_loads(self) -> Array:
        """Load (N, N m) on every measured axis if all axes have this point's fraction of full scale."""
        return np.asarray(self.share * self.bench.range.full_scales)

    @property
    def tilt(self) -> float:
        """Tilt (rad) of the contact in the combined errors: the required tilt, or one degree if no tilt is required."""
        required = self.bench.spec.requirements.tilt
        return DEGREE if required is None else required

    @property
    def tilt_slopes(self) -> Array:
        """Derivatives (axes, 3; N/rad) of the measured load on every axis with respect to rx, ry, rz at zero tilt.

        For a single coil they are almost 0, but finite tilts still have an effect. For moment axes, the moment of the
        tilted face itself is subtracted.
        """
        slopes = self.inverse @ self.by_pose[:, 3:]
        if any(name in MOMENTS for name in self.bench.range.axes):
            moments = (self.all_tilts.moments(SMALL_TILT)[self.number] / SMALL_TILT).reshape(2, 2, 2)
            slopes[:, :2] -= self._as_axis_loads(0.5 * (moments[:, 0] - moments[:, 1])).T
        return np.asarray(slopes)

    def _as_axis_loads(self, moments: Array) -> Array:
        """Return moments (..., 2; N m) about x and y as loads (..., axes) on the measured axes. Force axes have 0."""
        loads = np.zeros((*moments.shape[:-1], len(self.bench.range.axes)))
        for k, name in enumerate(self.bench.range.axes):
            if name in MOMENTS:
                loads[..., k] = moments[..., MOMENTS.index(name)]
        return loads

    def by_tilt(self, angle: float) -> Array:
        """Return errors (2, 2, axes; N, N m) of every axis by a tilt (rad).

        The first index is the axis of the tilt (x, y), the second its sign (+, -). For moment axes, the moment of the
        tilted face itself is subtracted.
        """
        read = self.all_tilts.at(angle)[self.number] @ self.inverse.T
        return np.asarray(read - self._as_axis_loads(self.all_tilts.moments(angle)[self.number])).reshape(2, 2, -1)

    def tilt_errors(self, angle: float) -> Array:
        """Return the magnitudes of errors (axes, 2; N, N m) by tilts (rad) about x and y, the larger of both signs."""
        return np.asarray(np.abs(self.by_tilt(angle)).max(axis=1).T)

    @cached_property
    def contact_errors(self) -> Array:
        """Errors (axes, 2; N/mm) by a normal force beside the target's middle, for each mm of distance along x and y.

        The target is free to tilt. NaN if the pad buckles. For moment axes, the moment of the force itself is
        subtracted.
        """
        force = float(self.load[0])
        wrench = np.tile([0.0, 0.0, -force, 0.0, 0.0, 0.0], (3, 1))
        wrench[1, 4], wrench[2, 3] = FORCE_STEP * force, -FORCE_STEP * force
        poses = self.bench.pad.pose(wrench)
        read = self.inverse @ self.by_pose @ (poses[1:] - poses[0]).T
        return np.asarray((read - self._as_axis_loads(wrench[1:, 3:5]).T) / (1e3 * FORCE_STEP))

    @cached_property
    def axis_drifts(self) -> tuple[Array, Mapping[str, Array]]:
        """Linear maps (axes, coils; N per reading), and drifts (axes, coils; per K) of the readings by cause.

        Each row is computed for a separate load: the working point's normal force together with a load on the row's
        axis. Maps differ between these loads because readings are not linear in the load. In screening, all rows of the
        maps are for the normal force alone.
        """
        bench, names = self.bench, self.bench.range.axes
        maps = self.inverse.copy()
        drifts = {cause: np.tile(drift, (len(names), 1)) for cause, drift in self.reading_drift.items()}
        if len(names) > 1 and self.share > 0.0:
            loads = np.vstack([loads_on_axis(self.load, name, self.axis_loads[[k]])
                               for k, name in enumerate(names[1:], 1)])
            poses = bench.poses(loads)
            drifts[EXPANSION][1:] = expansion_drift(bench, loads, self._material.expansion)
            if not bench.estimates.is_rough:
                reading, *others = bench.readings(np.vstack([self.pose, poses]))
                drifts[METAL][1:] = metal_drift(drifts[METAL][0], self.by_metal, reading, np.array(others))
                slopes = bench.slopes(poses) @ bench.compliance(loads, poses)
                for k, by_load in enumerate(slopes, 1):
                    if np.all(np.isfinite(by_load)):
                        maps[k] = bench.linear_map(by_load)[k]
        return maps, drifts

    @cached_property
    def by_kelvin(self) -> Mapping[str, Array]:
        """Errors (N/K, N m/K) of every axis by temperature, by the part that becomes warmer after the tare.

        The value for the capacitors is one sigma, because each capacitor drifts independently. Other values have signs.
        A compensation subtracts all errors except the error by the capacitors.
        """
        drift, (maps, drifts) = capacitor_drift(self.bench.spec.readout), self.axis_drifts
        return {
            METAL: np.sum(maps * drifts[METAL], axis=1),
            CAPACITORS: drift * np.sqrt(np.sum(maps**2, axis=1)),
            EXPANSION: np.sum(maps * drifts[EXPANSION], axis=1),
            PAD_MODULUS: -self._material.modulus_temperature_coefficient * self.axis_loads,
        }

    @cached_property
    def tared_by_kelvin(self) -> Mapping[str, Array]:
        """Errors (N/K, N m/K) of every axis by temperature if the sensor is tared before each grasp, by cause.

        The tare removes the change of the readings at rest. The error by the capacitors is left out.
        """
        maps = self.axis_drifts[0]
        return {cause: value - np.sum(maps * self.rest_drift.get(cause, np.zeros(len(self.by_metal))), axis=1)
                for cause, value in self.by_kelvin.items() if cause != CAPACITORS}

    @cached_property
    def unlike_normal(self) -> Array:
        """Errors (N/K, N m/K) that a compensation leaves because its coefficients hold for the normal force alone.

        The error of an axis is for the normal force together with a load on this axis (`axis_drifts`).
        """
        maps, drifts = self.axis_drifts
        return np.asarray(sum(np.sum(maps * (drift - self.reading_drift[cause]), axis=1)
                              for cause, drift in drifts.items()))

    @property
    def warming(self) -> float:
        """Temperature change (K) after the tare for which the errors by temperature are computed."""
        return warming(self.bench.spec.requirements)

    @property
    def drift_name(self) -> str:
        """Name of the error `drift` in tables: it contains the working point and the temperature change."""
        drift = f"drift {WORKING_POINTS[self.number].text}" if self.number else "zero drift"
        return f"{drift}, {self.warming:.3g} K"

    @cached_property
    def compensation(self) -> Compensation | None:
        """Compensation of drift for the temperature change `warming`. None if nothing measures the temperature."""
        spec, estimates = self.bench.spec, self.bench.estimates
        noise = float(self.bench.noise.max()) / math.sqrt(max(estimates.readout.scan_rate * AVERAGED, 1.0))
        return choose_compensation(spec.readout, spec.requirements, spec.elastomer, spec.target,
                               estimates.reference_drift, noise, estimates.has_own_windings)

    @cached_property
    def drift_left(self) -> Mapping[str, Mapping[str, Array]]:
        """Parts (N, N m) of the drift that remain after compensation, by the source of its coefficients.

        Empty if the spec has no temperature sensor.
        """
        return {} if self.compensation is None else self.compensation.parts(
            self.by_kelvin, self.noise, self.axis_loads, self.unlike_normal)

    @cached_property
    def tared_drift_left(self) -> Mapping[str, Mapping[str, Array]]:
        """Parts (N, N m) of `tared_drift` that remain after compensation, by the source of its coefficients.

        Empty if the spec has no temperature sensor.
        """
        return {} if self.compensation is None else self.compensation.parts(
            self.tared_by_kelvin, np.zeros_like(self.noise), self.axis_loads, self.unlike_normal)

    @cached_property
    def reading_drift(self) -> Mapping[str, Array]:
        """Changes (coils; per K) of the readings at this load by temperature, by cause: metal, and the pad's expansion.

        The compensation subtracts them from the readings. For the change of the modulus, it multiplies the forces by a
        factor. The effect of metal is interpolated linearly between rest and full normal load.
        """
        metal = self.by_metal + self.share * (self.by_metal_loaded - self.by_metal)
        return {METAL: metal, EXPANSION: expansion_drift(self.bench, self.load[None], self._material.expansion)[0]}

    @cached_property
    def rest_drift(self) -> Mapping[str, Array]:
        """Changes (coils; per K) of the readings at rest by temperature, by cause: metal, and the pad's expansion."""
        unloaded = np.zeros((1, len(self.load)))
        return {METAL: self.by_metal, EXPANSION: expansion_drift(self.bench, unloaded, self._material.expansion)[0]}

    @property
    def _material(self) -> ElastomerMaterial:
        assert self.bench.spec.elastomer is not None
        return self.bench.spec.elastomer.material

    @property
    def drift_causes(self) -> Mapping[str, Array]:
        """Parts (N, N m) of `drift` if there is a compensation, otherwise the drifts (N/K, N m/K) by cause."""
        settings = self.bench.spec.readout.compensation
        return self.drift_left[settings.coefficients] if self.drift_left and settings is not None else self.by_kelvin

    def _compensated(self, left: Mapping[str, Mapping[str, Array]]) -> Array | None:
        """Return the drift (N, N m) after compensation with the spec's coefficients, as one sigma.

        `left` holds the remaining parts. None if the spec has no temperature sensor.
        """
        settings = self.bench.spec.readout.compensation
        return root_sum_square(left[settings.coefficients]) if left and settings is not None else None

    @property
    def drift(self) -> Array:
        """Standard deviation (N, N m) of every axis at this load after the temperature has changed by `warming`.

        The change is since the tare. If the spec has a temperature sensor, it is the drift after compensation.
        """
        compensated = self._compensated(self.drift_left)
        return self.uncompensated_drift if compensated is None else compensated

    @property
    def uncompensated_drift(self) -> Array:
        """Standard deviation `drift` (N, N m) that the sensor would have without compensation."""
        return np.asarray(self.warming * self.temperature)

    @property
    def temperature(self) -> Array:
        """Standard deviation (N/K, N m/K) of every axis by temperature.

        Errors with known signs are summed. The error by the capacitors is added by root sum of squares.
        """
        signed = sum(value for name, value in self.by_kelvin.items() if name != CAPACITORS)
        return np.asarray(np.hypot(signed, self.by_kelvin[CAPACITORS]))

    @property
    def tared_drift(self) -> Array:
        """Error (N, N m) of every axis by the temperature change `warming`, with a tare before each grasp.

        If the spec has a temperature sensor, it is the error after compensation.
        """
        compensated = self._compensated(self.tared_drift_left)
        return self.uncompensated_tared_drift if compensated is None else compensated

    @property
    def uncompensated_tared_drift(self) -> Array:
        """Error `tared_drift` (N, N m) that the sensor would have without compensation.

        The tare follows the temperature change and removes its effect at rest. Three effects under load remain: the
        changed effect of metal, the changed effect of the pad's expansion, and the modulus.
        """
        return np.asarray(np.abs(self.warming * sum(self.tared_by_kelvin.values())))

    @property
    def noise(self) -> Array:
        """Standard deviation (N, N m) of every axis by the converter's noise.

        It is infinite for an axis that does not change the readings, or changes them only in the pattern of another
        axis.
        """
        sigma = np.sqrt(np.sum((self.inverse * self.bench.noise) ** 2, axis=1))
        return np.asarray(np.where(np.abs(np.diag(self.inverse @ self.by_load) - 1.0) < MAX_UNIT_LOAD_ERROR, sigma,
                                   np.inf))

    @property
    def hysteresis(self) -> Array:
        """Error (N, N m) of every axis by hysteresis: half the width of the pad's loop of force over compression.

        The material data state the width as a fraction of full scale.
        """
        pad = self.bench.spec.elastomer
        assert pad is not None
        material, names = pad.material, self.bench.range.axes
        # a tilt presses one half of the pad and pulls the other: its loop is that of a press
        widths = [material.hysteresis_shear if name in FORCES[1:] else material.hysteresis_normal for name in names]
        return BRANCH * np.array(widths) * self.bench.range.full_scales

    def unmeasured_load_errors(self) -> dict[str, Array]:
        """Return the false readings (N, N m) of every axis by full-scale forces along axes that are not measured.

        The keys are the names of the axes of these forces, which the coils cannot measure.
        """
        errors = {}
        for name in (axis for axis in FORCES if axis not in self.bench.range.axes):
            ends = self.bench.full_scales[name] * np.array([1.0, -1.0])
            readings = self.bench.readings(self.bench.poses(np.vstack([self.load,
                                                                       loads_on_axis(self.load, name, ends)])))
            errors[name] = np.abs(
                (readings[1:] - readings[0]) @ self.inverse.T).max(axis=0)
        return errors

    def errors_of_any_unit(self, map_errors: Array) -> dict[str, Array]:
        """Return the standard deviations (N, N m) of every axis by the causes that do not differ between units.

        The error by a tilt is for the required angle, or one degree, and for the worse of both signs. Errors by twists
        are for one degree. All values are infinite on an axis without a signal. `map_errors` (axes; N, N m) are the
        errors of the nonlinear map.
        """
        pad = self.bench.spec.elastomer
        assert pad is not None
        material, degrees = pad.material, f"{math.degrees(self.tilt):.3g}"
        return self._infinite_if_unmeasurable({
            "noise": self.noise,
            "hysteresis": self.hysteresis,
            "creep": material.creep * self.axis_loads,
            "curved map": map_errors,
            **self._drifts(),
            f"{TILTED}{degrees} degree{'s' * (degrees != '1')}": np.hypot(*self.tilt_errors(self.tilt).T),
            "twist of 1 degree": DEGREE * np.abs(self.tilt_slopes[:, 2]),
            "contact 0.1 mm beside the middle": 0.1 * np.hypot(*self.contact_errors.T),
            **{f"{name} {UNMEASURED}": error for name, error in self.unmeasured_load_errors().items()},
        })

    def _drifts(self) -> dict[str, Array]:
        """Return the standard deviations (N, N m) of every axis by drift.

        The drift is computed with one tare, and with a tare before each grasp. If the spec has a temperature sensor,
        both are given without and with compensation.
        """
        tared = f"{TARED_DRIFT}, {self.warming:.3g} K"
        if self.compensation is None:
            return {self.drift_name: self.drift, tared: self.tared_drift}
        return {f"{self.drift_name}, {UNCOMPENSATED}": self.uncompensated_drift,
                f"{self.drift_name}, compensated": self.drift,
                f"{tared}, {UNCOMPENSATED}": self.uncompensated_tared_drift, f"{tared}, compensated": self.tared_drift}

    def errors(self, units: UnitErrors, map_errors: Array) -> dict[str, Array]:
        """Return the standard deviations (N, N m) of every axis by all causes, by cause.

        They include causes that differ between units. `units` are errors of simulated units, `map_errors` (axes; N, N
        m) the errors of the nonlinear map.
        """
        normal, scattered = self.bench.full_scales["normal"], tolerance_sigmas(self.bench.spec)
        return self.errors_of_any_unit(map_errors) | self._infinite_if_unmeasurable({
            "modulus, before calibration": units.by_modulus(self.share, normal),
            "manufacture, before calibration": units.at(self.share, normal, False),
            "manufacture, after calibration": units.at(self.share, normal, True),
            # the error of a map in hertz
            "clock, without a tare": scattered[CLOCK] * np.abs(self.inverse.sum(axis=1)),
            "capacitors, without a tare": 0.5 * scattered[CAPACITOR] * np.sqrt(np.sum(self.inverse**2, axis=1)),
        })

    def _infinite_if_unmeasurable(self, errors: Mapping[str, Array]) -> dict[str, Array]:
        """Return errors (axes; N, N m) by cause, replaced by infinity on axes without a signal."""
        untold = np.isinf(self.noise)
        return {name: np.where(untold, np.inf, np.nan_to_num(error, posinf=np.inf)) for name, error in errors.items()}

    def friction(self, errors: Mapping[str, Array], shear: str) -> dict[str, float]:
        """Return errors of the ratio of shear to normal force by cause, at the working point's fraction of full scale.

        `errors` are by cause (axes; N, N m), and `shear` is the name of the shear axis. Modulus and its temperature
        dependence do not change the ratio. The error by a tilt is included if the spec requires a tilt.
        """
        names = self.bench.range.axes
        k, n = names.index(shear), names.index("normal")
        force, ratio = self.axis_loads[n], self.axis_loads[k] / self.axis_loads[n]

        def of(vector: Array) -> float:
            return float(abs(vector[k] - ratio * vector[n]) / force)

        def apart(vector: Array) -> float:
            return float(math.hypot(vector[k], ratio * vector[n]) / force)

        causes = ("noise", "hysteresis", "curved map", "manufacture, after calibration")
        by_cause = {name: apart(errors[name]) for name in causes}
        warmed = self.by_kelvin
        by_cause[self.drift_name] = apart(self.drift) if self.compensation is not None else self.warming * math.hypot(
            of(warmed[METAL] + warmed[EXPANSION]), apart(warmed[CAPACITORS]))
        tilt = self.bench.spec.requirements.tilt
        if tilt is not None:
            by_cause["required tilt"] = math.hypot(*(max(map(of, directions)) for directions in self.by_tilt(tilt)))
        return by_cause


MOVING = 1.0 / 3.0  # Fraction of the pad's mass that moves with the target: its lower face is at rest (Rayleigh)


def resonances(bench: LoadModel, pose: Array) -> dict[str, float]:
    """Return the natural frequency (Hz) without damping of target and pad along every measured force axis.

    It is sqrt(k / m) / (2 pi) at a `pose` (6; m, rad) of a level target without an object on it. The mass m is the mass
    of the target, of the film over the target, and of a third of the pad under it. Empty if a density is unknown.
    """
    target, pad, skin = bench.spec.target, bench.spec.elastomer, bench.spec.encapsulation
    assert target is not None and pad is not None
    metal = {row["material"]: float(row["density"]) for row in rows("densities")}.get(target.material.name)
    if metal is None or pad.material.density is None:
        return {}
    area = math.prod(target.size) * target.outline.area
    mass = area * (metal * target.thickness + MOVING * pad.material.density * pad.thickness)
    if skin is not None and skin.material.density is not None:
        mass += area * skin.material.density * film_thickness(skin)
    stiffness = np.diag(bench.pad.stiffness(pose[None])[0])[[2, 0, 1]]
    return {name: math.sqrt(max(float(stiffness[FORCES.index(name)]), 0.0) / mass) / (2.0 * math.pi)
            for name in bench.range.axes if name in FORCES}
