"""Points of a calibration: loads or poses with what the coils read there, and how sure each reading is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sitscad.arrays import Array, Flags
from sitscad.calibration.sensors import Sensors
from sitscad.calibration.unknowns import usual
from sitscad.record import record

AT_REST = 1e-4  # What a frequency at rest may be off by, by itself; all others are taken over it
LEAST_LOAD = 1e-3  # What a load (of full scale) may be off by, however small it is

CHANCE = 3.7
"""Standard deviations (one-sided odds of 10,000 to 1) beyond which rows without load do not scatter so by chance."""

STEP = 1e-3  # Step (of full scale) of the differences by which slopes over loads are taken
MOVE = 0.02  # Step (prior standard deviations) of the differences by which slopes over unknowns are taken


@record(eq=False)
class Points:
    """Points (n): `loads` (n, 3; N) or else `poses` (n, 6; m, rad, from rest), and `frequency` (n, coils; Hz);
    `at_rest` (n) says which are tares; readings are so many times `noisier` than the converter (1: nothing says so).
    """

    loads: Array | None
    poses: Array | None
    frequency: Array
    at_rest: Flags
    noisier: float = 1.0

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def rest(self) -> Array:
        """The mean of all tares (coils; Hz)."""
        return np.asarray(self.frequency[self.at_rest].mean(axis=0))

    @property
    def settled(self) -> Points:
        """The points with drift taken out: every point goes with the tare before it, the first ones with the first."""
        tares = self.frequency[self.at_rest]
        number = np.maximum(np.cumsum(self.at_rest) - 1, 0)
        return replace(self, frequency=self.frequency * self.rest / tares[number])

    def part(self, chosen: Flags | Array) -> Points:
        """Some of the points."""
        loads = None if self.loads is None else self.loads[chosen]
        poses = None if self.poses is None else self.poses[chosen]
        return Points(loads, poses, self.frequency[chosen], self.at_rest[chosen], self.noisier)

    @property
    def restless(self) -> Array:
        """What ln f of the tares (tares, coils) is off their line along the rows: drift; empty for under three."""
        rows, read = np.flatnonzero(self.at_rest), np.log(self.frequency[self.at_rest])
        if len(rows) < 3:
            return np.zeros((0, read.shape[1]))
        line = np.vander(rows - rows.mean(), 2)
        return np.asarray(read - line @ np.linalg.lstsq(line, read, rcond=None)[0])


def foretold(sensors: Sensors, errors: Array, points: Points, exact: bool = False) -> Array:
    """The frequencies (n, coils; Hz) of one sensor at the points."""
    if points.loads is not None:
        return sensors.under(errors, points.loads, exact)
    assert points.poses is not None
    return sensors.frequencies(errors, sensors.placed(errors, points.poses), exact)


def load_slopes(sensors: Sensors, errors: Array, loads: Array) -> Array:
    """Change of ln f with the force on every axis, in full scales: (n, coils, axes). Differences go inwards."""
    scale, found = sensors.range.full_scales, []
    here = np.log(sensors.under(errors, loads))
    for column, size in zip(sensors.range.columns, scale, strict=True):
        step = np.where(loads[:, column] > 0.5 * size, -STEP, STEP)
        moved = loads.copy()
        moved[:, column] += step * size
        found.append((np.log(sensors.under(errors, moved)) - here) / step[:, None])
    return np.stack(found, axis=2)


def unknown_slopes(sensors: Sensors, loads: Array, of_all: bool = False, errors: Array | None = None) -> Array:
    """Change of ln f with every unknown that is fitted (or `of_all`), in prior standard deviations: (n, coils,
    unknowns); of the sensor as drawn, or with these `errors` (unknowns).
    """
    found, here = [], np.zeros(len(sensors.known)) if errors is None else errors
    for k, one in enumerate(sensors.known):
        if one.is_fitted or of_all:
            moved = np.zeros(len(sensors.known))
            moved[k] = MOVE * one.sigma
            above, below = (np.log(sensors.under(here + way, loads)) for way in (moved, -moved))
            found.append((above - below) / (2.0 * MOVE))
    return np.stack(found, axis=2)


def whiteners(sensors: Sensors, errors: Array, points: Points, more: float = 1.0) -> Array:
    """Matrices (n, coils, coils) that turn errors of `tared` ln f into independent ones of unit size: noise of the
    converter, what the chart may be off by, and what loads are off by; those last two `more` times as large.
    """
    here = np.log(foretold(sensors, errors, points))
    rest = np.log(
        sensors.frequencies(errors, sensors.placed(errors, np.zeros((1, 6))))
        if points.loads is None else sensors.under(errors, np.zeros((1, 3)))
    )
    read = np.square(points.noisier * sensors.of_mean(int(usual("readings"))))
    noise = np.where(points.at_rest[:, None], AT_REST**2, 2.0 * read)
    charted = np.square(more * sensors.charted * (here - rest))
    square = np.zeros((len(points), noise.shape[1], noise.shape[1]))
    diagonal = np.arange(noise.shape[1])
    square[:, diagonal, diagonal] = noise + charted
    if points.loads is not None:
        sigma = more * np.where(points.at_rest, 0.0, load_errors(sensors, points.loads))
        slopes = load_slopes(sensors, errors, points.loads) * sigma[:, None, None]
        square += slopes @ np.swapaxes(slopes, 1, 2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(square)))


def noisier(points: Points, expected: Array) -> float:
    """How many times larger than `expected` (coils; one sigma of a row's ln f) the readings' noise is by what is left
    of the tares; 1 where that may be chance. The limit of chi-square is that of Wilson and Hilferty (PNAS 17, 1931).
    """
    left = points.restless / expected
    free = left.size - 2 * left.shape[1] * bool(left.size)
    if not free:
        return 1.0
    square, part = float(np.sum(left**2)) / free, 2.0 / (9.0 * free)
    return float(np.sqrt(square)) if square > (1.0 - part + CHANCE * np.sqrt(part)) ** 3 else 1.0


def load_errors(sensors: Sensors, loads: Array) -> Array:
    """One sigma (n; of full scale) of loads (n, 3; N) as they are put on."""
    size = np.linalg.norm(loads[:, sensors.range.columns] / sensors.range.full_scales, axis=1)
    return np.asarray(np.hypot(usual("force") * size, LEAST_LOAD))


def tared(values: Array, at_rest: Flags) -> Array:
    """Values (n, ...) less their mean at rest, but for those at rest, which are that mean."""
    rest = values[at_rest].mean(axis=0)
    found = values - rest
    found[at_rest] = rest
    return np.asarray(found)
