"""Simulated sensors of a design: what each, with its own errors, reads under loads and in poses, by a chart of what the
coils read: polynomials through the response at some poses, for the thousands that fits ask.
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
from sitscad.calibration.unknowns import POSE_ERRORS, WIDEST, Unknown, named, units, unknowns, usual
from sitscad.estimates.loads.pad import NoResponse, pushed
from sitscad.estimates.loads.working_range import WorkingRange, working_range
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.tolerances.units_made import with_modulus, with_thickness
from sitscad.kernels.converters.conversion import Conversion
from sitscad.kernels.electromagnetics.polynomials import (
    POINTS_A_TERM,
    Polynomial,
    chebyshev,
    exponents,
    least_squares,
    spread,
)
from sitscad.kernels.electromagnetics.resonator import oscillate_alike
from sitscad.kernels.mechanics.elastomer import HELD_SHEAR, HELD_STRAIN
from sitscad.kernels.mechanics.motion import angles, rotations
from sitscad.spec.sensor import SensorSpec

WEIGHTS, DEGREE = (1.0, 1.0, 1.5, 2.0, 2.0, 3.0), 6.0
"""What a degree costs along each number of a pose, and how much in all: 151 terms."""

CHECKED = 8, 3  # Sensors, and loads of each, at which a chart is held against poses that are solved
FAR = 0.02  # Height (m) from which a target of a few millimetres changes nothing: 1e-6 of its change at rest
LEAST = 1e-7  # Least share of a coil's inductance that a target's change counts as: its logarithm is charted
BOTH_WAYS = 0.01  # Of a coil's largest change, the largest of the other sign with which its logarithm is charted


@record(eq=False)
class Chart:
    """Inductance (H) and resistance (ohm) of every coil at its contacts, at its tank's frequency.

    `lean` (2; rad/m) is how much a target turns about x when it goes along y, and about y along x, as a rule; `through`
    has, by poses (6; m, rad) with so much taken off their turns, ln |1 - L/L0| of all coils and then their resistances;
    `free` (coils) is the inductance L0 without target, of which `sign` (coils) tells whether the target takes off (1)
    or adds (-1). `error` is what the chart is off by, of a sensor's change of L from rest: rms over `CHECKED` poses.
    """

    lean: Array
    through: Polynomial
    free: Array
    sign: Array
    error: float

    def __call__(self, poses: Array) -> tuple[Array, Array]:
        """Inductances (H) and resistances (ohm), (n, coils) each, at (n, 6) poses."""
        change, loss = np.hsplit(self.through(upright(poses, self.lean)), 2)
        return self.free * (1.0 - self.sign * np.exp(change)), loss


def terminals(model: ResponseModel, poses: Array) -> tuple[Array, Array]:
    """Inductances and resistances by the model, each pose solved, the target as for performance."""
    parts = [model.respond(poses[k : k + AT_ONCE], within=model.pad_ends) for k in range(0, len(poses), AT_ONCE)]
    return np.concatenate([part.inductance for part in parts]), np.concatenate([part.resistance for part in parts])


AT_ONCE = 256  # Poses solved at once: so few that none is interpolated


def upright(poses: Array, lean: Array, sign: float = -1.0) -> Array:
    """Poses (n, 6) without the turns that go with their travel; with a positive `sign` it is put on again."""
    found = poses.copy()
    found[:, 3:5] += sign * lean * poses[:, [1, 0]]
    return found


def chart(model: ResponseModel, free: Array, reached: Array, moved: Array, most: float) -> Chart:
    """The chart of a model over the box of all poses (m, rad) that may be reached: `reached` (sensors, n, 6; the first
    of each at rest) by some sensors, of which the first is the one as drawn, and as far from that one's as its errors
    may move it together, each `moved` (ways, unknowns, n, 6) as far as it may by itself; none farther aside than `most`
    (m). Few sensors leave out what a soft and thin one does. `free` (coils; H) is the inductance without target. Raises
    NoResponse where the target takes inductance off in some of those poses and adds some in others.
    """
    # poses that are farther are brought back to `most` aside, with the turns that go with it
    aside, reached = np.hypot(reached[..., 0], reached[..., 1]), reached.copy()
    reached[..., [0, 1, 3, 4]] *= np.minimum(1.0, most / np.maximum(aside, most))[..., None]
    all_reached = reached.reshape(-1, 6)
    lean = np.array([_slope(all_reached[:, 1], all_reached[:, 3]), _slope(all_reached[:, 0], all_reached[:, 4])])
    alone = np.abs(upright(moved.reshape(-1, 6), lean)).reshape(moved.shape).max(axis=0)
    together, drawn = np.sqrt(np.sum(alone**2, axis=0)), upright(reached[0], lean)
    together[:, 3:] = 0.0  # turns beyond those of the sensors drawn hardly count, and a wider chart errs more
    plain = np.vstack([upright(all_reached, lean), drawn - together, drawn + together])
    low, high = plain.min(axis=0), plain.max(axis=0)
    low[:2], high[:2] = np.maximum(low[:2], -most), np.minimum(high[:2], most)
    middle, half = 0.5 * (low + high), np.maximum(WIDER * 0.5 * (high - low), SMALLEST)
    orders = exponents(WEIGHTS, DEGREE)
    count = int(POINTS_A_TERM * len(orders))
    places = middle + half * np.sin(0.5 * np.pi * (2.0 * spread(count, 6) - 1.0))  # denser at the ends
    asked = reached[: CHECKED[0], np.linspace(0, reached.shape[1] - 1, 1 + CHECKED[1]).astype(int)]
    poses = np.vstack([upright(places, lean, 1.0), asked.reshape(-1, 6)])
    inductance, resistance = terminals(model, poses)
    known = len(places)
    taken = 1.0 - inductance[:known] / free
    sign = np.sign(taken.sum(axis=0))
    if np.any((-sign * taken).max(axis=0) > np.maximum(BOTH_WAYS * (sign * taken).max(axis=0), LEAST)):
        raise NoResponse("the target adds inductance in some poses and takes it off in others, as magnetic metal does: "
                         "no map to newtons is made of what passes through nothing; copper or aluminium")
    change = np.log(np.maximum(sign * taken, LEAST))
    through = least_squares(places, np.hstack([change, resistance[:known]]), orders, middle - half, middle + half,
                            chebyshev)
    found = Chart(lean, through, free, sign, 0.0)
    told, true = (part.reshape(*asked.shape[:2], -1) for part in (found(poses[known:])[0], inductance[known:]))
    moves = true[:, 1:] - true[:, :1]
    return replace(found, error=float(np.sqrt(np.mean((told[:, 1:] - told[:, :1] - moves) ** 2) / np.mean(moves**2))))


def _slope(travel: Array, turn: Array) -> float:
    """How much turn goes with travel, by least squares."""
    away = travel - travel.mean()
    size = float(away @ away)
    return float(away @ turn) / size if size > 0.0 else 0.0


WIDER = 1.1  # By how much the box is wider than what is reached
SMALLEST = np.array([1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4])  # Least half widths (m, rad) of a chart

KEPT = 500  # Solutions of the pad that are kept

FARTHEST_SHEAR = 2.0
"""Shear, in halves of the pad's thickness, beyond which what a pad stiffens by grows no more: no law is held there."""

FARTHEST_CHARTED = 1.25
"""Travel aside, in thicknesses of the pad, up to which poses are charted: where the loads are to end for which the pad
is trusted (`VALID_SHEAR`), and a quarter farther. A chart as far as the softest pad is sheared serves none."""

SOLVED_WELL = 0.003
"""What poses that are solved are off by, of a change: the largest of those that were held against another solver
(tests/validation/random_poses.csv)."""

LEAST_SURE, NOT_FITTED = 0.2, 0.1
"""How sure (of prior standard deviations) the errors of a sensor are taken to be at the most when a chart is made about
them; and how far those are moved that no fit looks for."""

DRAWN, SEED = 40, 15  # Sensors by which the box of poses is found, and the seed of their errors


@record(eq=False)
class Sensors:
    """The sensors of a design: its response, and what they may be off by. `is_held`: whether loads leave targets level.

    Errors (unknowns) are those of one sensor, in the order of `known`; all zero is the sensor as it is drawn, `around`
    (None: that one) the one about which the chart is made, as wide as its errors are `sure` (unknowns; of prior
    standard deviations; None: as wide as manufacture scatters).
    """

    model: ResponseModel
    is_held: bool = True
    around: Array | None = None
    sure: Array | None = None
    pushed: dict[tuple[float, float, float, bytes], Array] = field(default_factory=dict)

    @property
    def rotation(self) -> str:
        """Which of `ROTATIONS` the loads are put on with."""
        return "held" if self.is_held else "free"

    @cached_property
    def known(self) -> tuple[Unknown, ...]:
        """What a sensor may be off by."""
        return unknowns(self.model.spec, self.model.estimates)

    @cached_property
    def range(self) -> WorkingRange:
        """The loads that are looked at."""
        return working_range(self.model.spec)

    @property
    def coils(self) -> tuple[str, ...]:
        """The names of the coils."""
        return tuple(coil.name for coil in self.model.layout.coils)

    @cached_property
    def chart(self) -> Chart:
        """The chart of all poses that the working range takes simulated sensors to."""
        drawn = self._middle + np.vstack([np.zeros(len(self.known)), self.wide * units(self.known, DRAWN, SEED)])
        loads, pad = np.vstack([self.range.pressed(0.0), self.range.corners]), self.model.spec.elastomer
        assert pad is not None
        reached = np.stack([self.poses(errors, loads) for errors in drawn])
        most = max(FARTHEST_CHARTED * pad.thickness, 1.1 * float(np.hypot(*reached[0, :, :2].T).max()))
        return chart(self.model, self.alone[0], reached, self._moved(loads), most)

    @cached_property
    def alone(self) -> tuple[Array, Array]:
        """Inductances (H) and resistances (ohm) of the coils as drawn without the target, (coils,) each."""
        inductance, resistance = terminals(self.model, np.array([[0.0] * 6, [0.0, 0.0, FAR, 0.0, 0.0, 0.0]]))
        return inductance[1], resistance[1]

    @property
    def charted(self) -> float:
        """What a charted reading may be off by, of its change from rest."""
        return max(self.chart.error, SOLVED_WELL)

    def about(self, errors: Array, sure: Array) -> Sensors:
        """These sensors, charted about one whose errors were found and are `sure` (of prior standard deviations)."""
        fitted = np.array([one.is_fitted for one in self.known])
        return replace(self, around=errors, sure=np.where(fitted, np.maximum(sure, LEAST_SURE), NOT_FITTED))

    @property
    def wide(self) -> Array:
        """How wide the chart is, (unknowns; prior standard deviations)."""
        return np.ones(len(self.known)) if self.sure is None else self.sure

    @property
    def _middle(self) -> Array:
        """The errors (unknowns) of the sensor about which the chart is made."""
        return np.zeros(len(self.known)) if self.around is None else self.around

    def _moved(self, loads: Array) -> Array:
        """How far each unknown's widest error moves the poses under (n, 3) loads: (ways, unknowns, n, 6)."""
        drawn = self.poses(self._middle, loads)
        alone = WIDEST * np.diag(self.wide * [one.sigma for one in self.known])
        return np.array(
            [[self.poses(self._middle + errors, loads) - drawn for errors in way * alone] for way in (-1.0, 1.0)]
        )

    def poses(self, errors: Array, loads: Array) -> Array:
        """Where loads (n, 3; N: normal, shear along x, y; or n, 5 with moments, N m) take one sensor's target, (n, 6)
        from where it is drawn.
        """
        off = named(self.known, errors)
        # how far (n, 6) loads take the target by the pad's law is kept for a while
        own = self._own(off)
        pad = own.elastomer
        assert pad is not None
        key = (pad.thickness, pad.material.shear_modulus, pad.material.ogden_exponent, loads.tobytes())
        if key not in self.pushed:
            if len(self.pushed) >= KEPT:
                self.pushed.clear()
            self.pushed[key] = pushed(own, loads, np.full(len(loads), self.is_held))[0]
        travel, thickness = self.pushed[key], pad.thickness
        travel = travel * np.exp(off["pad_curve"] * travel[:, 2:3] / (thickness * HELD_STRAIN))
        sheared = np.linalg.norm(travel[:, :2], axis=1, keepdims=True) / (thickness * HELD_SHEAR)
        more = off["softening"] * loads[:, :1] / self.range.normal - off["shear_modulus"]
        more -= off["shear_curve"] * np.minimum(sheared, FARTHEST_SHEAR) ** 2
        travel[:, [0, 1, 3, 4]] *= np.exp(more)
        return self.placed(errors, travel)

    def gives_way(self, errors: Array, loads: Array) -> Flags:
        """Whether one sensor's pad gives way sideways under each of the loads (n, 3; N): its pose is none then."""
        off = named(self.known, errors)
        notes = pushed(self._own(off), loads, np.full(len(loads), self.is_held))[1]
        return np.array([bool(note) for note in notes])

    def _own(self, off: Mapping[str, float]) -> SensorSpec:
        """The spec with the pad of one sensor."""
        spec = with_modulus("elastomer")(with_thickness("elastomer")(self.model.spec, off["gap"]), off["modulus"])
        pad = spec.elastomer
        assert pad is not None
        material = replace(pad.material, ogden_exponent=pad.material.ogden_exponent + off["exponent"])
        return replace(spec, elastomer=replace(pad, material=material))

    def placed(self, errors: Array, travel: Array) -> Array:
        """The poses (n, 6) of one sensor's target that has gone by `travel` (n, 6; m, rad) from where it rests."""
        off = named(self.known, errors)
        gap, glue, *rest = (off[name] for name in POSE_ERRORS)
        place = np.array([*rest[:2], gap + glue])
        turn = rotations(travel[:, 3:]) @ rotations(np.array([rest[2:]]))[0]
        return np.hstack([travel[:, :3] + place, angles(turn)])

    def frequencies(self, errors: Array, poses: Array, exact: bool = False) -> Array:
        """Frequencies (Hz; n, coils) of one sensor with its target in (n, 6) poses: of the chart, or each pose solved.
        Errors of the coils change inductances at the frequency that the coils as drawn have: a per cent of it moves
        them by 1e-5.
        """
        inductance, resistance = terminals(self.model, poses) if exact else self.chart(poses)
        off, free = named(self.known, errors), self.alone[0]
        changed = free + (inductance - free) * math.exp(off["target_change"])
        delay = self.model.tank.converter.limit("drive_delay")
        more = free * (off["inductance"] + np.array([off[f"inductance.{name}"] for name in self.coils]))
        network = self.model.network
        own = replace(network, capacitor=network.capacitor * np.exp([off[f"capacitor.{name}"] for name in self.coils]))
        return oscillate_alike(own, changed + more, resistance, delay).frequency * (1.0 - off["clock"])

    def under(self, errors: Array, loads: Array, exact: bool = False) -> Array:
        """Frequencies (Hz; n, coils) of one sensor under (n, 3) loads (N)."""
        return self.frequencies(errors, self.poses(errors, loads), exact)

    @cached_property
    def free_frequencies(self) -> Array:
        """Frequencies (Hz; coils) of the sensor as drawn without its target, jaw and shield where they are."""
        delay = self.model.tank.converter.limit("drive_delay")
        return oscillate_alike(self.model.network, *self.alone, delay).frequency

    @cached_property
    def conversion(self) -> Conversion:
        """How the converter counts: it is set, else there were no sensors (`sensors_of`)."""
        found = self.model.estimates.readout.conversion
        assert found is not None
        return found

    @property
    def rest_frequencies(self) -> list[float]:
        """Frequencies (Hz) of the coils at rest, at which readings have their noise."""
        states = (coil.states.get(REST) or next(iter(coil.states.values())) for coil in self.model.estimates.coils)
        return [state.frequency for state in states]

    @cached_property
    def rounding(self) -> Array:
        """One sigma of what rounding takes from readings and their means, relative to the frequency (coils)."""
        return np.array([self.conversion.rounding(each) / each for each in self.rest_frequencies])

    @cached_property
    def counting(self) -> Array:
        """One sigma of the noise of counting in one reading, relative to the frequency (coils); means of many have
        less.
        """
        return np.array([self.conversion.counting_noise(each) / each for each in self.rest_frequencies])

    @property
    def noise(self) -> Array:
        """One sigma of one reading, relative to the frequency (coils)."""
        return self.of_mean(1)

    def of_mean(self, readings: int) -> Array:
        """One sigma of the mean of so many readings, relative to the frequency (coils)."""
        return np.asarray(np.hypot(self.counting / math.sqrt(readings), self.rounding))

    def read(self, frequency: Array, generator: np.random.Generator, readings: int | None = None) -> Array:
        """Frequencies (Hz; n, coils) as the converter gives them: with its noise, the mean of so many readings."""
        many = int(usual("readings")) if readings is None else readings
        return frequency * (1.0 + self.of_mean(many) * generator.normal(size=frequency.shape))
