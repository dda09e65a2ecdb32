"""How a contact that is tilted is read: the target turned under the same force, at second order, too."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.performance.tank_law import TankLaw, held
from sitscad.estimates.states.solved_target import own_changes
from sitscad.estimates.values import Estimates
from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DEGREE = math.radians(1.0)

WAYS = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
"""The turns that are looked at, in angles of tilt: about x and y, either way."""


@record(eq=False)
class Tilts:
    """Working points of a bench: loads (points, 3; N) and poses (points, 6) of their level target."""

    bench: Bench
    loads: Array
    poses: Array
    kept: dict[float, Array] = field(default_factory=dict)

    def at(self, angle: float) -> Array:
        """Change of the readings by a tilt (rad) in every one of `WAYS`: (points, ways, coils).

        As in the load case `scissor`: a face that sticks turns the target, and presses it with the same force.
        """
        if angle not in self.kept:
            count, ways = len(self.poses), len(WAYS)
            turned = np.log(self.bench.turned(np.concatenate([self.poses, self._tilted(angle)])))
            self.kept[angle] = turned[count:].reshape(count, ways, -1) - turned[:count, None]
        return self.kept[angle]

    def _tilted(self, angle: float) -> Array:
        """Poses (points times ways, 6); those that the pad cannot hold are the level ones, turned."""
        ways = len(WAYS)
        wrenches = np.zeros((len(self.loads) * ways, 6))
        wrenches[:, 2] = -np.repeat(self.loads[:, 0], ways)
        turns = np.tile(angle * WAYS, (len(self.loads), 1))
        found = self.bench.pad.pose(wrenches, turns=turns, is_stuck=True)
        lost = np.isnan(found[:, 0])
        found[lost] = np.repeat(self.poses, ways, axis=0)[lost]
        found[lost, 3:] = turns[lost]
        return found


@record(eq=False)
class QuickTilts:
    """What a turn adds to a quick method's frequencies, by the response's own solution of the target at one frequency.

    `level` gives frequencies (Hz; n, coils) at level poses; `law` how the tanks follow what the target changes of L and
    R, and `pressed` (m) the place along z of the state pressed, if there is one, whose changes it is held to.
    """

    layout: Layout
    estimates: Estimates
    spec: SensorSpec
    level: Callable[[Array], Array]
    law: TankLaw
    pressed: float | None

    def frequencies(self, poses: Array) -> Array:
        """Frequencies (Hz) of the coils, (n, coils), at (n, 6) poses."""
        level, states = poses.copy(), np.zeros((2, 6))
        level[:, 3:] = 0.0
        states[1, 2] = self.pressed or 0.0
        change = self._changes(np.concatenate([states, poses, level]))
        change = change[1:] - change[0]
        said = self.law.logarithms(change[1:] * held(self.estimates, change[0]))
        return np.asarray(self.level(level) * np.exp(said[: len(poses)] - said[len(poses) :]))

    def _changes(self, poses: Array) -> ComplexArray:
        """What the target changes of the coils' inductances (H; n, coils), the crowding of their currents left out."""
        return own_changes(replace(self.layout, spec=self.spec), poses, float(self.law.frequency.mean()))
