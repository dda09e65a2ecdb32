"""Simulated sensors of a design: the readings of a sensor with given manufacturing errors, under loads or in poses.

Fits need thousands of readings. They come from a surrogate: polynomials fitted to the computed response at some poses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from sitscad.assembly.places.state import REST
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.calibration.unknowns import POSE_ERRORS, WIDEST, Unknown, draw_units, errors_by_name, unknowns, usual_value
from sitscad.estimates.loads.pad import NoResponse, loaded_poses
from sitscad.estimates.loads.working_range import WorkingRange, working_range
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.tolerances.units_made import with_modulus, with_thickness
from sitscad.kernels.converters.conversion import Conversion
from sitscad.kernels.electromagnetics.polynomials import (
    POINTS_A_TERM,
    Polynomial,
    chebyshev,
    exponents,
    halton_points,
    least_squares,
)
from sitscad.kernels.electromagnetics.resonator import oscillate_at_fixed_inductance
from sitscad.kernels.mechanics.elastomer import HELD_SHEAR, HELD_STRAIN
from sitscad.kernels.mechanics.motion import angles, rotations
from sitscad.spec.sensor import SensorSpec

WEIGHTS = (1.0, 1.0, 1.5, 2.0, 2.0, 3.0)
"""Weights of the exponents of x, y, z, rx, ry and rz in the weighted degree of a term of the surrogate."""

DEGREE = 6.0
"""Largest weighted degree of a term of the surrogate: sum of exponents times `WEIGHTS`. It allows 151 terms."""

CHECKED = 8, 3  # Numbers of sensors, and of loads of each, to compare a surrogate with solved poses
"""Number of sensors, and number of loads of each sensor, for which a surrogate is compared with the field solution."""
FAR = 0.02  # Height (m) at which a target of a few millimetres has no effect: 1e-6 of its change at rest
"""Height (m) at which a target of a few millimetres changes the inductance by 1e-6 of its change at rest."""
LEAST = 1e-7  # Least relative change by a target, for its logarithm in the surrogate
"""Least relative inductance change by a target that enters the surrogate's logarithm."""
BOTH_WAYS = 0.01  # Largest change of the other sign that a surrogate allows, relative to a coil's largest change
"""Largest inductance change with the opposite sign that a surrogate accepts, divided by the coil's largest change."""


@record(eq=False)
class Surrogate:
    """Surrogate for the inductance (H) and resistance (ohm) of each coil at its contacts, at its tank's frequency.

    `mean_rotation` (2; rad/m) is the mean rotation of a target about x per travel along y, and about y per travel along
    x. `through` is a polynomial in poses (6; m, rad) minus these rotations. It returns ln |1 - L/L0| of all coils, then
    their resistances. `free_inductance` (coils) is the inductance L0 without target. `sign` (coils) is 1 if the target
    reduces the inductance, and -1 if it increases it. `error` is the error of the inductance divided by its change from
    rest, rms over `CHECKED` poses.
    """

    mean_rotation: Array
    through: Polynomial
    free_inductance: Array
    sign: Array
    error: float

    def __call__(self, poses: Array) -> tuple[Array, Array]:
        """Return the inductances (H) and resistances (ohm), (n, coils) each, at poses (n, 6; m, rad)."""
        change, loss = np.hsplit(self.through(minus_mean_rotation(poses, self.mean_rotation)), 2)
        return self.free_inductance * (1.0 - self.sign * np.exp(change)), loss


def solve_terminal_impedance(model: ResponseModel, poses: Array) -> tuple[Array, Array]:
    """Return the coils' inductances (H) and resistances (ohm) at poses (n, 6), each from its own field solution."""
    parts = [model.respond(poses[k : k + AT_ONCE], within=model.pad_ends) for k in range(0, len(poses), AT_ONCE)]
    return np.concatenate([part.inductance for part in parts]), np.concatenate([part.resistance for part in parts])


AT_ONCE = 256  # Number of poses solved at once: few enough that none is interpolated
"""Number of poses for which fields are solved at once.

With more poses, the solution would interpolate between poses.
"""


def minus_mean_rotation(poses: Array, lean: Array, sign: float = -1.0) -> Array:
    """Return poses (n, 6; m, rad) minus the rotations `lean` (rad/m) times the lateral travel (see `Surrogate`).

    If `sign` is 1, these rotations are added instead.
    """
    plain = poses.copy()
    plain[:, 3:5] += sign * lean * poses[:, [1, 0]]
    return plain


def fit_surrogate(model: ResponseModel, free: Array, reached: Array, moved: Array, most: float) -> Surrogate:
    """Return the surrogate of a model over the box of reachable poses (m, rad).

    Parameters
    ----------
    model
        response model of the design
    free
        inductance (coils; H) without target
    reached
        poses (sensors, n, 6) of some sensors; the first sensor is as drawn, and the first pose of each is at rest
    moved
        largest changes of pose (ways, unknowns, n, 6) by each unknown alone
    most
        largest lateral travel (m) in the box

    Raises
    ------
    NoResponse
        if the target reduces the inductance in some poses and increases it in others

    Notes
    -----
    The box also covers the first sensor's poses, changed by all unknowns together. Few sensors do not show the range of
    a soft and thin pad.
    """
    # poses with more lateral travel are moved back to `most`, with the rotations that go with it
    shear, reached = np.hypot(reached[..., 0], reached[..., 1]), reached.copy()
    reached[..., [0, 1, 3, 4]] *= np.minimum(1.0, most / np.maximum(shear, most))[..., None]
    all_reached = reached.reshape(-1, 6)
    lean = np.array([_slope(all_reached[:, 1], all_reached[:, 3]), _slope(all_reached[:, 0], all_reached[:, 4])])
    alone = np.abs(minus_mean_rotation(moved.reshape(-1, 6), lean)).reshape(moved.shape).max(axis=0)
    together, upright_poses = np.sqrt(np.sum(alone**2, axis=0)), minus_mean_rotation(reached[0], lean)
    together[:, 3:] = 0.0  # larger rotations hardly matter, and a wider surrogate is less accurate
    plain = np.vstack([minus_mean_rotation(all_reached, lean), upright_poses - together, upright_poses + together])
    low, high = plain.min(axis=0), plain.max(axis=0)
    low[:2], high[:2] = np.maximum(low[:2], -most), np.minimum(high[:2], most)
    middle, half = 0.5 * (low + high), np.maximum(WIDER * 0.5 * (high - low), SMALLEST)
    orders = exponents(WEIGHTS, DEGREE)
    count = int(POINTS_A_TERM * len(orders))
    places = middle + half * np.sin(0.5 * np.pi * (2.0 * halton_points(count, 6) - 1.0))  # denser at the ends
    checked = reached[: CHECKED[0], np.linspace(0, reached.shape[1] - 1, 1 + CHECKED[1]).astype(int)]
    poses = np.vstack([minus_mean_rotation(places, lean, 1.0), checked.reshape(-1, 6)])
    inductance, resistance = solve_terminal_impedance(model, poses)
    count = len(places)
    relative = 1.0 - inductance[:count] / free
    sign = np.sign(relative.sum(axis=0))
    if np.any((-sign * relative).max(axis=0) > np.maximum(BOTH_WAYS * (sign * relative).max(axis=0), LEAST)):
        raise NoResponse("the target adds inductance in some poses and takes it off in others, as magnetic metal does: "
                         "no map to newtons is made of what passes through nothing; copper or aluminium")
    change = np.log(np.maximum(sign * relative, LEAST))
    through = least_squares(places, np.hstack([change, resistance[:count]]), orders, middle - half, middle + half,
                            chebyshev)
    fitted = Surrogate(lean, through, free, sign, 0.0)
    predicted, true = (part.reshape(*checked.shape[:2], -1) for part in (fitted(poses[count:])[0], inductance[count:]))
    moves = true[:, 1:] - true[:, :1]
    off = predicted[:, 1:] - predicted[:, :1] - moves
    return replace(fitted, error=float(np.sqrt(np.mean(off**2) / np.mean(moves**2))))


def _slope(travel: Array, turn: Array) -> float:
    """Return the slope (rad/m) of rotations `turn` (n) over `travel` (n; m), by least squares; 0 without travel."""
    centred = travel - travel.mean()
    size = float(centred @ centred)
    return float(centred @ turn) / size if size > 0.0 else 0.0


WIDER = 1.1  # Width of the box relative to the reached poses
"""Width of the surrogate's range of poses, divided by the width of the poses that sensors reach."""
SMALLEST = np.array([1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4])  # Least half widths (m, rad) of a surrogate
"""Least half widths of the surrogate's range for x, y, z (m) and the rotations about x, y, z (rad)."""

MAX_CACHED_POSES = 500  # Number of cached solutions of the pad
"""Largest number of cached sets of poses under loads."""

FARTHEST_SHEAR = 2.0
"""Shear strain divided by `HELD_SHEAR` above which the error `shear_curve` no longer increases.

No pad law is valid there.
"""

FARTHEST_CHARTED = 1.25
"""Largest lateral travel in the surrogate's range, in pad thicknesses.

It exceeds the valid range of the pad's law (`VALID_SHEAR`) by a quarter. A surrogate up to the shear of the softest pad
would be inaccurate for all sensors.
"""

SOLVED_WELL = 0.003
"""Relative error of an inductance change from rest that is computed by the field solution.

It is the largest difference from another field solver (tests/validation/random_poses.csv).
"""

LEAST_SURE = 0.2
"""Least width of a surrogate about a fitted sensor, in prior standard deviations of the fitted unknowns."""

NOT_FITTED = 0.1
"""Width of a surrogate about a fitted sensor for unknowns that are not fitted, in prior standard deviations."""

DRAWN, SEED = 40, 15  # Number of simulated sensors for the box of poses, and their seed
"""Number of simulated sensors that determine the surrogate's range of poses, and seed of their random errors."""


@record(eq=False)
class Sensors:
    """Simulated sensors of a design: its response model with possible manufacturing errors.

    `is_held` is True if loads keep the target level, and False if the target may tilt. `loaded_poses` caches target
    poses under loads. Errors (unknowns) of a sensor are in the order of `unknowns`, and all 0 for the nominal sensor.
    The surrogate is made about the sensor with the errors `around` (None: nominal). Its width is `width` (unknowns;
    prior standard deviations; None: the whole manufacturing scatter).
    """

    model: ResponseModel
    is_held: bool = True
    around: Array | None = None
    width: Array | None = None
    loaded_poses: dict[tuple[float, float, float, bytes], Array] = field(default_factory=dict)

    @property
    def rotation(self) -> str:
        """Rotation of the target under loads: "held" or "free", a key of `ROTATIONS`."""
        return "held" if self.is_held else "free"

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Possible manufacturing errors of a sensor, with their standard deviations."""
        return unknowns(self.model.spec, self.model.estimates.coils)

    @cached_property
    def range(self) -> WorkingRange:
        """Range of loads that the requirements specify."""
        return working_range(self.model.spec)

    @property
    def coils(self) -> tuple[str, ...]:
        """Names of the coils."""
        return tuple(coil.name for coil in self.model.layout.coils)

    @cached_property
    def surrogate(self) -> Surrogate:
        """Surrogate over all poses that simulated sensors reach in the working range."""
        errors_drawn = self._centre_errors + np.vstack([np.zeros(len(self.unknowns)),
                                                 self.surrogate_width * draw_units(self.unknowns, DRAWN, SEED)])
        loads, pad = np.vstack([self.range.normal_load(0.0), self.range.corners]), self.model.spec.elastomer
        assert pad is not None
        reached = np.stack([self.poses(errors, loads) for errors in errors_drawn])
        most = max(FARTHEST_CHARTED * pad.thickness, 1.1 * float(np.hypot(*reached[0, :, :2].T).max()))
        return fit_surrogate(self.model, self.impedances_without_target[0], reached, self._pose_changes(loads), most)

    @cached_property
    def impedances_without_target(self) -> tuple[Array, Array]:
        """Inductances (H) and resistances (ohm) of the nominal coils without the target, (coils,) each."""
        inductance, resistance = solve_terminal_impedance(self.model,
                                                          np.array([[0.0] * 6, [0.0, 0.0, FAR, 0.0, 0.0, 0.0]]))
        return inductance[1], resistance[1]

    @property
    def surrogate_error(self) -> float:
        """Relative error of a reading's change from rest if it comes from the surrogate: at least `SOLVED_WELL`."""
        return max(self.surrogate.error, SOLVED_WELL)

    def with_centre(self, errors: Array, sure: Array) -> Sensors:
        """Return these sensors with a surrogate about the sensor with the fitted `errors` (unknowns).

        `sure` (unknowns; prior standard deviations) is the uncertainty of the errors. It becomes the width of the
        surrogate, but at least `LEAST_SURE`.
        """
        fitted = np.array([each.is_fitted for each in self.unknowns])
        return replace(self, around=errors, width=np.where(fitted, np.maximum(sure, LEAST_SURE), NOT_FITTED))

    @property
    def surrogate_width(self) -> Array:
        """Width of the surrogate (unknowns; prior standard deviations)."""
        return np.ones(len(self.unknowns)) if self.width is None else self.width

    @property
    def _centre_errors(self) -> Array:
        """Errors (unknowns) of the sensor about which the surrogate is made."""
        return np.zeros(len(self.unknowns)) if self.around is None else self.around

    def _pose_changes(self, loads: Array) -> Array:
        """Return pose changes (2 signs, unknowns, n, 6) under loads (n, 3) by the largest error of each unknown."""
        nominal = self.poses(self._centre_errors, loads)
        alone = WIDEST * np.diag(self.surrogate_width * [each.sigma for each in self.unknowns])
        return np.array([[self.poses(self._centre_errors + errors, loads) - nominal for errors in way * alone]
                         for way in (-1.0, 1.0)])

    def poses(self, errors: Array, loads: Array) -> Array:
        """Return the target's poses (n, 6) of one sensor under loads, relative to the nominal pose at rest.

        Loads are (n, 3; N: normal, shear along x and y), or (n, 5) with moments (N m).
        """
        off = errors_by_name(self.unknowns, errors)
        # travel (n, 6) of the target by the pad's law is cached for a while
        spec = self._with_pad_errors(off)
        pad = spec.elastomer
        assert pad is not None
        key = (pad.thickness, pad.material.shear_modulus, pad.material.ogden_exponent, loads.tobytes())
        if key not in self.loaded_poses:
            if len(self.loaded_poses) >= MAX_CACHED_POSES:
                self.loaded_poses.clear()
            self.loaded_poses[key] = loaded_poses(spec, loads, np.full(len(loads), self.is_held))[0]
        travel, thickness = self.loaded_poses[key], pad.thickness
        travel = travel * np.exp(off["pad_curve"] * travel[:, 2:3] / (thickness * HELD_STRAIN))
        sheared = np.linalg.norm(travel[:, :2], axis=1, keepdims=True) / (thickness * HELD_SHEAR)
        more = off["softening"] * loads[:, :1] / self.range.normal - off["shear_modulus"]
        more -= off["shear_curve"] * np.minimum(sheared, FARTHEST_SHEAR) ** 2
        travel[:, [0, 1, 3, 4]] *= np.exp(more)
        return self.poses_after_travel(errors, travel)

    def pad_failures(self, errors: Array, loads: Array) -> Flags:
        """Return, for each load (n, 3; N), whether the pad of one sensor fails sideways, so that no pose exists."""
        off = errors_by_name(self.unknowns, errors)
        notes = loaded_poses(self._with_pad_errors(off), loads, np.full(len(loads), self.is_held))[1]
        return np.array([bool(note) for note in notes])

    def _with_pad_errors(self, off: Mapping[str, float]) -> SensorSpec:
        """Return the spec with the pad thickness, modulus and Ogden exponent of one sensor.

        `off` are its errors by name.
        """
        spec = with_modulus("elastomer")(with_thickness("elastomer")(self.model.spec, off["gap"]), off["modulus"])
        pad = spec.elastomer
        assert pad is not None
        material = replace(pad.material, ogden_exponent=pad.material.ogden_exponent + off["exponent"])
        return replace(spec, elastomer=replace(pad, material=material))

    def poses_after_travel(self, errors: Array, travel: Array) -> Array:
        """Return the target's poses (n, 6) of one sensor after the displacement `travel` (n, 6; m, rad) from rest."""
        off = errors_by_name(self.unknowns, errors)
        gap, glue, *rest = (off[name] for name in POSE_ERRORS)
        place = np.array([*rest[:2], gap + glue])
        turn = rotations(travel[:, 3:]) @ rotations(np.array([rest[2:]]))[0]
        return np.hstack([travel[:, :3] + place, angles(turn)])

    def frequencies(self, errors: Array, poses: Array, exact: bool = False) -> Array:
        """Return the frequencies (Hz; n, coils) of one sensor with its target in poses (n, 6).

        Inductances come from the surrogate, or with `exact` from the field solution. They are computed at the frequency
        of the nominal coils, although errors of the coils shift it. A shift of 1 % changes the inductances by 1e-5.
        """
        inductance, resistance = solve_terminal_impedance(self.model, poses) if exact else self.surrogate(poses)
        off, free = errors_by_name(self.unknowns, errors), self.impedances_without_target[0]
        changed = free + (inductance - free) * math.exp(off["target_change"])
        delay = self.model.tank.converter.limit("drive_delay")
        more = free * (off["inductance"] + np.array([off[f"inductance.{name}"] for name in self.coils]))
        network = self.model.network
        unit = replace(network, capacitor=network.capacitor * np.exp([off[f"capacitor.{name}"] for name in self.coils]))
        return oscillate_at_fixed_inductance(unit, changed + more, resistance, delay).frequency * (1.0 - off["clock"])

    def frequencies_under(self, errors: Array, loads: Array, exact: bool = False) -> Array:
        """Return the frequencies (Hz; n, coils) of one sensor under loads (n, 3; N)."""
        return self.frequencies(errors, self.poses(errors, loads), exact)

    @cached_property
    def free_frequencies(self) -> Array:
        """Frequencies (Hz; coils) of the nominal sensor without its target. Jaw and shield stay in place."""
        delay = self.model.tank.converter.limit("drive_delay")
        return oscillate_at_fixed_inductance(self.model.network, *self.impedances_without_target, delay).frequency

    @cached_property
    def conversion(self) -> Conversion:
        """Conversion from frequencies to counts by the converter. `simulated_sensors` refuses designs without it."""
        conversion = self.model.estimates.readout.conversion
        assert conversion is not None
        return conversion

    @property
    def rest_frequencies(self) -> list[float]:
        """Frequencies (Hz) of the coils at rest, at which the noise of readings is computed."""
        states = (coil.states.get(REST) or next(iter(coil.states.values())) for coil in self.model.estimates.coils)
        return [state.frequency for state in states]

    @cached_property
    def rounding_noise(self) -> Array:
        """Relative standard deviation of frequency by rounding to counts (coils).

        Averaging readings does not reduce it.
        """
        return np.array([self.conversion.rounding(each) / each for each in self.rest_frequencies])

    @cached_property
    def counting_noise(self) -> Array:
        """Relative standard deviation of frequency by the counting noise of one reading (coils).

        Averaging several readings reduces it.
        """
        return np.array([self.conversion.counting_noise(each) / each for each in self.rest_frequencies])

    @property
    def noise(self) -> Array:
        """Relative standard deviation of the frequency of one reading (coils), by counting noise and rounding."""
        return self.mean_noise(1)

    def mean_noise(self, readings: int) -> Array:
        """Return the relative standard deviation of frequency for the mean of `readings` readings (coils)."""
        return np.asarray(np.hypot(self.counting_noise / math.sqrt(readings), self.rounding_noise))

    def noisy_frequencies(self, frequency: Array, generator: np.random.Generator, readings: int | None = None) -> Array:
        """Return frequencies (Hz; n, coils) with random noise, each as the mean of `readings` readings.

        The default number of readings is `usual("readings")`.
        """
        many = int(usual_value("readings")) if readings is None else readings
        return frequency * (1.0 + self.mean_noise(many) * generator.normal(size=frequency.shape))
