"""The loads that tell most of a sensor: chosen one after the other by what each adds to what is known."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.arrays import Array
from sitscad.calibration.points import Points, load_slopes, tared, unknown_slopes, whiteners
from sitscad.calibration.sensors import Sensors
from sitscad.estimates.performance.values import AXES
from sitscad.record import record

LEVELS = 4
"""Normal forces, evenly up to full scale, at which loads are offered; so many times more where these are too few."""

SHEARS = (0.5, 1.0)  # Shears of full scale, in every one of `DIRECTIONS`, at which loads are offered
DIRECTIONS = 8  # Directions of shear where the array tells both axes apart
TRIED = 40  # Loads at which errors of the map are foretold


@record(eq=False)
class Plan:
    """The loads (n, 3; N) in the order of what they tell, rest before them left out; `errors` (n + 1, axes; N) is one
    sigma of the forces to be expected after none, one, two, ... of them; `untared` (axes; N) that without even a tare.
    """

    loads: Array
    errors: Array
    untared: Array

    @property
    def rows(self) -> Array:
        """What is put on one after the other, (n + 3, 3; N): the loads, rest before, amid and after them."""
        return np.insert(self.loads, [0, len(self.loads) // 2, len(self.loads)], 0.0, axis=0)


def offered(sensors: Sensors, count: int) -> Array:
    """The loads that a bench can put on and that may be chosen, (n, 3; N), `count` at least."""
    scope = sensors.range
    axes = [k for k in scope.columns if k]
    ways = [np.zeros(2)]
    for share in SHEARS if axes else ():
        for number in range(DIRECTIONS):
            angle = 2.0 * math.pi * number / DIRECTIONS
            way = np.array([math.cos(angle), math.sin(angle)])
            if len(axes) == 2 or abs(way[axes[0] - 1]) > 0.99:
                ways.append(share * way)
    levels = LEVELS * math.ceil(count / (LEVELS * len(ways)))
    found = [(step / levels * scope.normal, *(scope.shear * way)) for step in range(1, levels + 1) for way in ways]
    return np.array([[0.0 if abs(force) < 1e-9 else float(f"{force:.3g}") for force in load] for load in found])


def plan(sensors: Sensors, count: int) -> Plan:
    """So many loads out of those that are offered: each adds most to the determinant of what is known of the unknowns,
    with a tare before (D-optimal; Fedorov, Theory of Optimal Experiments, 1972), then each is exchanged where another
    tells more.
    """
    loads = offered(sensors, count)
    # Information (n, unknowns, unknowns; per prior variance) that a reading under each load gives, rest the first
    none, put_on = np.zeros(len(sensors.known)), np.vstack([np.zeros((1, 3)), loads])
    rest = np.arange(len(put_on)) == 0
    points = Points(put_on, None, sensors.under(none, put_on), rest)
    slopes = whiteners(sensors, none, points) @ tared(unknown_slopes(sensors, put_on), rest)
    facts = np.asarray(np.swapaxes(slopes, 1, 2) @ slopes)
    chosen = _exchanged(facts, _greedy(facts, [0], count))
    order = _greedy(facts, [0], count, among=chosen[1:])
    return Plan(loads[np.array(order[1:], dtype=int) - 1], *_foretold(sensors, facts, order))


def _greedy(facts: Array, start: list[int], count: int, among: list[int] | None = None) -> list[int]:
    """The points `start`, then so many more, each that which adds most."""
    chosen = list(start)
    known = np.eye(facts.shape[1]) + facts[chosen].sum(axis=0)
    for _ in range(count):
        left = [k for k in (range(len(facts)) if among is None else among) if k not in chosen]
        gains = np.linalg.slogdet(known + facts[left])[1]
        chosen.append(left[int(np.argmax(gains))])
        known = known + facts[chosen[-1]]
    return chosen


def _exchanged(facts: Array, chosen: list[int]) -> list[int]:
    """As many points, each exchanged for another while that adds something; the first stays."""
    chosen = list(chosen)
    for _ in range(len(chosen)):
        before = list(chosen)
        for place in range(1, len(chosen)):
            others = chosen[:place] + chosen[place + 1 :]
            chosen[place] = _greedy(facts, others, 1)[-1]
        if chosen == before:
            break
    return chosen


def _foretold(sensors: Sensors, facts: Array, order: list[int]) -> tuple[Array, Array]:
    """One sigma (N) of the forces on every axis, rms over the working range, after the tare and none, one, ... of the
    other points, and without a tare: what is not known of the unknowns, to first order; noise and the map's own error
    are not in it.
    """
    tried = np.vstack([np.zeros((1, 3)), sensors.range.inside(TRIED)])
    none = np.zeros(len(sensors.known))
    slopes = unknown_slopes(sensors, tried)
    towards = np.linalg.pinv(load_slopes(sensors, none, tried[1:]))
    wrong = towards @ (slopes[1:] - slopes[:1])
    known, found = np.eye(facts.shape[1]), []
    for k in order:
        known = known + facts[k]
        square = wrong @ np.linalg.inv(known) @ np.swapaxes(wrong, 1, 2)
        found.append(np.sqrt(np.mean(np.einsum("naa->na", square), axis=0)) * sensors.range.full_scales)
    bare = np.sum((towards @ unknown_slopes(sensors, tried[1:], of_all=True)) ** 2, axis=2)
    return np.array(found), np.sqrt(np.mean(bare, axis=0)) * sensors.range.full_scales


def table_head(sensors: Sensors) -> list[str]:
    """The first lines of a table of points: how the target is loaded, and the columns."""
    loads = [f"{name}_N" for name in AXES if name in sensors.range.axes]
    return [f"# rotation: {sensors.rotation}", ",".join([*loads, *(f"{coil}_counts" for coil in sensors.coils)])]


GRAVITY = 9.80665  # Standard acceleration of free fall (m/s^2), by definition


def load_words(load: Array, axes: Sequence[str], rotation: str) -> str:
    """What is to be done for a load (3; N)."""
    sides = [(k, name) for k, name in ((1, "x"), (2, "y")) if f"shear_{name}" in axes and load[k]]
    if rotation == "held":
        return ", ".join([f"press {load[0]:.3g} N", *(f"push {load[k]:+.3g} N along {name}" for k, name in sides)])
    said = [f"{1e3 * load[0] / GRAVITY:.0f} g on it"]
    said += [f"{1e3 * abs(load[k]) / GRAVITY:.0f} g pull {'+' if load[k] > 0.0 else '-'}{name}" for k, name in sides]
    return ", ".join(said)
