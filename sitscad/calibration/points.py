"""Points of a calibration: loads or poses with the readings of the coils, their expected errors, and the planned loads.

The most informative loads are planned, one after the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Array, Flags
from sitscad.basics.record import record
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual_value
from sitscad.estimates.performance_values import AXES, MOMENTS

AT_REST = 1e-4  # Relative error of a frequency at rest; all others are relative to it
"""Assumed relative error of a frequency at rest. All other frequencies are compared with the frequency at rest."""
LEAST_LOAD = 1e-3  # Least error of a load (full scales)
"""Least error of an applied load (full scales)."""

CHANCE = 1e-4  # Probability below which the scatter of rows without load is not by chance
"""Least probability that the converter's noise alone causes the scatter of rows without load.

If the probability is lower, more noise than the converter's is assumed.
"""

STEP = 1e-3  # Step (full scales) of the differences for derivatives by loads
"""Step (full scales) of the finite differences for derivatives with respect to loads."""
MOVE = 0.02  # Step (prior standard deviations) of the differences for derivatives by unknowns
"""Step (prior standard deviations) of the finite differences for derivatives with respect to unknowns."""


@record(eq=False)
class Points:
    """Measured points (n) of a calibration.

    Either `loads` or `poses` are given. `loads` (n, 3; N) are normal force and shear along x and y, or (n, 5) with
    moments about x and y (N m). `poses` (n, 6; m, rad) are relative to the pose at rest. `frequency` (n, coils; Hz) are
    the readings. `at_rest` (n) is True for rows without load, the tares. `noise_ratio` is the noise of the readings
    divided by the converter's noise; 1 unless the tares scatter more.
    """

    loads: Array | None
    poses: Array | None
    frequency: Array
    at_rest: Flags
    noise_ratio: float = 1.0

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def rest(self) -> Array:
        """Mean of all readings at rest (coils; Hz)."""
        return np.asarray(self.frequency[self.at_rest].mean(axis=0))

    @property
    def without_drift(self) -> Points:
        """Points with drift removed from their frequencies.

        A tare is a row without load. Each frequency is divided by the frequency of the last tare up to its row, and
        multiplied by the mean of all tares. Rows before the first tare are divided by the first tare.
        """
        tares = self.frequency[self.at_rest]
        number = np.maximum(np.cumsum(self.at_rest) - 1, 0)
        return replace(self, frequency=self.frequency * self.rest / tares[number])

    def part(self, chosen: Flags | Array) -> Points:
        """Return some of the points, chosen by flags (n) or indices."""
        loads = None if self.loads is None else self.loads[chosen]
        poses = None if self.poses is None else self.poses[chosen]
        return Points(loads, poses, self.frequency[chosen], self.at_rest[chosen], self.noise_ratio)

    @property
    def rest_noise(self) -> Array:
        """Noise of ln f at rest (tares, coils): residuals from a straight line over the row number.

        Empty for fewer than three tares.
        """
        rows, read = np.flatnonzero(self.at_rest), np.log(self.frequency[self.at_rest])
        if len(rows) < 3:
            return np.zeros((0, read.shape[1]))
        line = np.vander(rows - rows.mean(), 2)
        return np.asarray(read - line @ np.linalg.lstsq(line, read, rcond=None)[0])


def predicted_frequencies(sensors: Sensors, errors: Array, points: Points, exact: bool = False) -> Array:
    """Return the frequencies (n, coils; Hz) at the points for a sensor with these errors (unknowns).

    They come from the surrogate, or with `exact` from the field solution of each pose.
    """
    if points.loads is not None:
        return sensors.frequencies_under(errors, points.loads, exact)
    assert points.poses is not None
    return sensors.frequencies(errors, sensors.poses_after_travel(errors, points.poses), exact)


def load_slopes(sensors: Sensors, errors: Array, loads: Array) -> Array:
    """Return the derivatives (n, coils, axes) of ln f with respect to each force, per full scale of the force.

    They are one-sided differences. Loads above half of full scale are reduced by the step, others are increased. The
    step is reversed if the pad fails under the changed load.
    """
    scale, slopes = sensors.range.full_scales, []
    here = np.log(sensors.frequencies_under(errors, loads))
    for column, size in zip(sensors.range.columns, scale, strict=True):
        step = np.where(loads[:, column] > 0.5 * size, -STEP, STEP)
        back = np.where((column > 0) | (loads[:, column] > STEP * size), -step, step)
        for way in (step, back):
            moved = loads.copy()
            moved[:, column] += way * size
            slope = (np.log(sensors.frequencies_under(errors, moved)) - here) / way[:, None]
            if np.all(np.isfinite(slope)):
                break
        slopes.append(slope)
    return np.stack(slopes, axis=2)


def unknown_slopes(sensors: Sensors, loads: Array, of_all: bool = False, errors: Array | None = None) -> Array:
    """Return the derivatives (n, coils, unknowns) of ln f under loads with respect to the fitted unknowns.

    If `of_all`, unknowns that are not fitted are included. The derivatives are per prior standard deviation of the
    unknown. They are for a sensor with these `errors` (unknowns); None: the nominal sensor.
    """
    slopes, here = [], np.zeros(len(sensors.unknowns)) if errors is None else errors
    for k, each in enumerate(sensors.unknowns):
        if each.is_fitted or of_all:
            moved = np.zeros(len(sensors.unknowns))
            moved[k] = MOVE * each.sigma
            above, below = (np.log(sensors.frequencies_under(here + way, loads)) for way in (moved, -moved))
            slopes.append((above - below) / (2.0 * MOVE))
    return np.stack(slopes, axis=2)


def covariances(sensors: Sensors, errors: Array, points: Points) -> tuple[Array, Array]:
    """Return two covariances (n, coils, coils) of the errors of ln(f / f at the tare).

    The first is for the expected errors: noise of the converter, errors of the surrogate and errors of loads. The
    second is for additional errors with a standard deviation (scatter) of 1. For loads, the unit of the scatter is full
    scale on each axis. For poses, it is the change of ln f from rest.
    """
    here = np.log(predicted_frequencies(sensors, errors, points))
    rest = np.log(
        sensors.frequencies(errors, sensors.poses_after_travel(errors, np.zeros((1, 6))))
        if points.loads is None else sensors.frequencies_under(errors, np.zeros((1, 3)))
    )
    read = np.square(points.noise_ratio * sensors.mean_noise(int(usual_value("readings"))))
    noise = np.where(points.at_rest[:, None], AT_REST**2, 2.0 * read)
    expected, scatter = np.zeros((2, len(points), noise.shape[1], noise.shape[1]))
    diagonal = np.arange(noise.shape[1])
    expected[:, diagonal, diagonal] = noise + np.square(sensors.surrogate_error * (here - rest))
    if points.loads is None:
        scatter[:, diagonal, diagonal] = np.square(here - rest)
    else:
        slopes = load_slopes(sensors, errors, points.loads)
        scatter = slopes @ np.swapaxes(slopes, 1, 2) * ~points.at_rest[:, None, None]
        expected += scatter * np.square(load_errors(sensors, points.loads))[:, None, None]
        shifts = place_changes(sensors, errors, points.loads)
        expected += shifts @ np.swapaxes(shifts, 1, 2)
    return expected, scatter


def place_changes(sensors: Sensors, errors: Array, loads: Array) -> Array:
    """Return the changes (n, coils, 2) of ln f if the load acts one standard deviation farther along x, and along y.

    The standard deviation is `usual("place")`. The changes are 0 for targets that are kept level.
    """
    if sensors.is_held or not len(loads):
        return np.zeros((len(loads), len(sensors.coils), 2))
    moved = np.hstack([loads, np.zeros((len(loads), len(AXES) - loads.shape[1]))])
    here, changes = np.log(sensors.frequencies_under(errors, moved)), []
    for moment, way in (("moment_y", 1.0), ("moment_x", -1.0)):  # a load at x has a moment about y, at y about -x
        column = AXES.index(moment)
        inwards = np.where(moved[:, column] > 0.0, -1.0, 1.0)  # the pad may fail outwards
        put = moved.copy()
        put[:, column] += inwards * usual_value("place") * moved[:, 0]
        changes.append(way * inwards[:, None] * (np.log(sensors.frequencies_under(errors, put)) - here))
    return np.stack(changes, axis=2)


def whiteners(covariance: Array) -> Array:
    """Return matrices (n, coils, coils) that convert errors with these covariances to independent unit errors."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def noise_ratio(points: Points, expected: Array) -> float:
    """Return the noise of the readings at rest, divided by the `expected` noise of the converter.

    `expected` (coils) is the standard deviation of ln f in one row. The result is 1 if the difference may be chance.
    """
    residuals = points.rest_noise / expected
    free = residuals.size - 2 * residuals.shape[1] * bool(residuals.size)
    square = float(np.sum(residuals**2))
    return math.sqrt(square / free) if free and chi_square_chance(np.array(square), free) < CHANCE else 1.0


def chi_square_chance(square: Array, free: int) -> Array:
    """Return the probability that a chi-square variable with `free` degrees of freedom exceeds `square`.

    Source: Abramowitz and Stegun 26.4.4 and 26.4.5.
    """
    half, power = 0.5 * square, 0.5 * (2 - free % 2)
    chance = np.exp(-half) if power == 1.0 else np.vectorize(math.erfc)(np.sqrt(half))
    while power < 0.5 * free:
        chance = chance + half**power * np.exp(-half) / math.gamma(power + 1.0)
        power += 1.0
    return np.asarray(chance)


def load_errors(sensors: Sensors, loads: Array) -> Array:
    """Return the standard deviation (n; full scales) of the error of each applied load.

    `loads` has the columns of `Points.loads`.
    """
    size = np.linalg.norm(loads[:, sensors.range.columns] / sensors.range.full_scales, axis=1)
    return np.asarray(np.hypot(usual_value("force") * size, LEAST_LOAD))


def subtract_tare(values: Array, at_rest: Flags) -> Array:
    """Return values (n, ...) minus their mean at rest. Rows with a flag in `at_rest` (n) hold this mean instead."""
    rest = values[at_rest].mean(axis=0)
    changes = values - rest
    changes[at_rest] = rest
    return np.asarray(changes)


LEVELS = 4
"""Number of different normal forces among the loads that may be planned, in equal steps up to full scale.

It is multiplied by a whole number if more loads are planned.
"""

SHEARS = (0.5, 1.0)  # Shears of the offered loads (full scales), in each of `DIRECTIONS`
"""Shear forces of the loads that may be planned (full scales), in each of `DIRECTIONS` directions."""
DIRECTIONS = 8  # Number of directions of shear, for arrays that separate both axes
"""Number of shear directions of the loads that may be planned, for sensors that measure shear along both axes."""
EXPECTED_ERROR_LOADS = 40  # Number of loads for the expected error of the map
"""Number of loads over which the expected error of the map is averaged."""


@record(eq=False)
class Plan:
    """Planned loads of a calibration, with the expected errors.

    `loads` (n, 3; N, or n, 5 with moments, N m) begin with the most informative load, without rows at rest. `errors` (n
    + 1, axes; N) are the standard deviations of forces after a tare and the first 0, 1, ..., n loads.
    `errors_without_tare` (axes; N) are the standard deviations without a tare. `errors_of_offset` (axes; N) are
    additional errors if all loads act one standard deviation beside their intended position. The worse of the
    directions x and y counts.
    """

    loads: Array
    errors: Array
    errors_without_tare: Array
    errors_of_offset: Array

    @property
    def rows(self) -> Array:
        """Loads to apply in turn (n + 3, 3 or 5; N, N m). Rows without load are first, in the middle and last."""
        return np.insert(self.loads, [0, len(self.loads) // 2, len(self.loads)], 0.0, axis=0)


def candidate_loads(sensors: Sensors, count: int) -> Array:
    """Return the loads (n, 3 or 5; N, N m) from which the plan chooses: at least `count`, rounded to three digits."""
    scope = sensors.range
    axes = [k for k in scope.columns if k]
    directions = [np.zeros(len(axes))]
    for share in SHEARS if axes else ():
        for number in range(DIRECTIONS):
            angle = 2.0 * math.pi * number / DIRECTIONS
            way = np.array([math.cos(angle), math.sin(angle)])
            if len(axes) == 2 or abs(way[0]) > 0.99:
                directions.append(share * way[: len(axes)])
    levels = LEVELS * math.ceil(count / (LEVELS * len(directions)))
    loads = scope.loads_at([(step / levels, *way) for step in range(1, levels + 1) for way in directions])
    return np.array([[0.0 if abs(part) < 1e-9 else float(f"{part:.3g}") for part in load] for load in loads])


def plan_loads(sensors: Sensors, count: int) -> Plan:
    """Return a plan with `count` loads.

    Loads are chosen one after the other from `candidate_loads`. Each choice is the candidate that most increases the
    determinant of the unknowns' information matrix after a tare (D-optimal; Fedorov, Theory of Optimal Experiments,
    1972). Then each load is replaced if another candidate increases the determinant more.
    """
    loads = candidate_loads(sensors, count)
    # Information (n, unknowns, unknowns; per prior variance) by a reading under each load; the first is at rest
    none, put_on = np.zeros(len(sensors.unknowns)), np.vstack([sensors.range.normal_load(0.0), loads])
    rest = np.arange(len(put_on)) == 0
    points = Points(put_on, None, sensors.frequencies_under(none, put_on), rest)
    white = whiteners(covariances(sensors, none, points)[0])
    slopes = white @ subtract_tare(unknown_slopes(sensors, put_on), rest)
    facts = np.asarray(np.swapaxes(slopes, 1, 2) @ slopes)
    pulls = np.asarray(np.swapaxes(slopes, 1, 2) @ white @ subtract_tare(place_changes(sensors, none, put_on), rest))
    chosen = _exchange_points(facts, _choose_greedily(facts, [0], count))
    order = _choose_greedily(facts, [0], count, among=chosen[1:])
    return Plan(loads[np.array(order[1:], dtype=int) - 1], *_predicted_errors(sensors, facts, pulls, order))


def _choose_greedily(facts: Array, start: list[int], count: int, among: list[int] | None = None) -> list[int]:
    """Return the point numbers in `start` and `count` further numbers, each with the largest gain of information.

    `facts` (n, unknowns, unknowns) is the information matrix of each point. Candidates are the numbers `among`; all
    points if it is None.
    """
    chosen = list(start)
    information = np.eye(facts.shape[1]) + facts[chosen].sum(axis=0)
    for _ in range(count):
        candidates = [k for k in (range(len(facts)) if among is None else among) if k not in chosen]
        gains = np.linalg.slogdet(information + facts[candidates])[1]
        chosen.append(candidates[int(np.argmax(gains))])
        information = information + facts[chosen[-1]]
    return chosen


def _exchange_points(facts: Array, chosen: list[int]) -> list[int]:
    """Return the `chosen` point numbers after exchanges: each is replaced by another point if this adds information.

    The first point, at rest, is never replaced. `facts` (n, unknowns, unknowns) is the information matrix of each
    point.
    """
    chosen = list(chosen)
    for _ in range(len(chosen)):
        before = list(chosen)
        for place in range(1, len(chosen)):
            remaining = chosen[:place] + chosen[place + 1 :]
            chosen[place] = _choose_greedily(facts, remaining, 1)[-1]
        if chosen == before:
            break
    return chosen


def _predicted_errors(sensors: Sensors, facts: Array, pulls: Array, order: list[int]) -> tuple[Array, Array, Array]:
    """Return three force errors by axis (N), rms over the working range: after the tare, without a tare, off centre.

    * (points, axes): one sigma. Row k is for a fit to the tare and to the first k of the other points in `order`.
    * (axes): one sigma without a tare
    * (axes): the error if all loads are applied off centre in the same direction

    `facts` (n, unknowns, unknowns) is the information matrix of each point. `pulls` (n, unknowns, 2) is the effect of
    loads off centre on the unknowns, along x and y, which a fit attributes to the sensor. All errors follow from the
    uncertainty of the unknowns, linearised. Noise and the map's own error are not included.
    """
    test_loads = np.vstack([sensors.range.normal_load(0.0), sensors.range.evenly_spread_loads(EXPECTED_ERROR_LOADS)])
    none = np.zeros(len(sensors.unknowns))
    slopes = unknown_slopes(sensors, test_loads)
    towards = np.linalg.pinv(load_slopes(sensors, none, test_loads[1:]))
    wrong = towards @ (slopes[1:] - slopes[:1])
    information, pull, errors = np.eye(facts.shape[1]), np.zeros((facts.shape[1], 2)), []
    shifted = np.zeros((len(sensors.range.full_scales), 2))
    for k in order:
        information, pull = information + facts[k], pull + pulls[k]
        covariance = np.linalg.inv(information)
        square = wrong @ covariance @ np.swapaxes(wrong, 1, 2)
        shifted = np.mean((wrong @ covariance @ pull) ** 2, axis=0)
        errors.append(np.sqrt(np.mean(np.einsum("naa->na", square), axis=0) + shifted.sum(axis=1)))
    untold = np.sum((towards @ unknown_slopes(sensors, test_loads[1:], of_all=True)) ** 2, axis=2)
    scale = sensors.range.full_scales
    return np.array(errors) * scale, np.sqrt(np.mean(untold, axis=0)) * scale, np.sqrt(shifted.max(axis=1)) * scale


def table_head(sensors: Sensors, coils: Sequence[str], has_temperatures: bool = False) -> list[str]:
    """Return the first two lines of a table of points: the rotation of the target, and the column titles.

    The table has the readings of `coils`, and with `has_temperatures` a column of temperatures.
    """
    loads = [f"{name}_{'Nmm' if name in MOMENTS else 'N'}" for name in AXES if name in sensors.range.axes]
    return [f"# rotation: {sensors.rotation}", ",".join([*loads, *["temperature_degC"] * has_temperatures, *(
        f"{coil}_counts" for coil in coils)])]


GRAVITY = 9.80665  # Standard acceleration of free fall (m/s^2), by definition


def load_place(load: Array) -> tuple[float, float]:
    """Return the position of a load (3 or 5; N, N m): x and y (m) from the middle of the outermost face."""
    if len(load) <= AXES.index("moment_x") or not load[0]:
        return 0.0, 0.0
    x, y = load[AXES.index("moment_y")] / load[0], -load[AXES.index("moment_x")] / load[0]
    return round(float(x), 6), round(float(y), 6)


def load_instruction(load: Array, axes: Sequence[str], rotation: str) -> str:
    """Return the instruction for applying a load (3 or 5; N, N m).

    A moment is applied as a press beside the middle of the outermost face.
    """
    if len(load) > len(AXES) - len(MOMENTS) and load[0]:
        beside = [f"{name} {1e3 * part:+.2f} mm" for part, name in zip(load_place(load), "xy", strict=True) if part]
        put = [f"{1e3 * load[0] / GRAVITY:.0f} g {'at ' + ' '.join(beside) if beside else 'on it'}"]
        pulls = [(load[k], name) for k, name in ((1, "x"), (2, "y")) if f"shear_{name}" in axes and load[k]]
        return ", ".join([*put, *(f"{1e3 * abs(force) / GRAVITY:.0f} g pull {'+' if force > 0.0 else '-'}{name}"
                                  for force, name in pulls)])
    sides = [(k, name) for k, name in ((1, "x"), (2, "y")) if f"shear_{name}" in axes and load[k]]
    if rotation == "held":
        return ", ".join([f"press {load[0]:.3g} N", *(f"push {load[k]:+.3g} N along {name}" for k, name in sides)])
    parts = [f"{1e3 * load[0] / GRAVITY:.0f} g on it"]
    parts += [f"{1e3 * abs(load[k]) / GRAVITY:.0f} g pull {'+' if load[k] > 0.0 else '-'}{name}" for k, name in sides]
    return ", ".join(parts)
