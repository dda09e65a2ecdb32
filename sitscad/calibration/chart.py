"""A chart of what the coils read: polynomials through the response at some poses, for the thousands that fits ask."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.response.model import ResponseModel
from sitscad.physics.polynomials import Exponents, chebyshev, exponents, spread
from sitscad.record import record

Array = NDArray[np.float64]

WEIGHTS, DEGREE = (1.0, 1.0, 1.5, 2.0, 2.0, 3.0), 6.0
"""What a degree costs along each number of a pose, and how much in all: 151 terms."""

POINTS_A_TERM = 1.5
"""Poses solved for every term."""

CHECKED = 8, 3
"""Sensors, and loads of each, at which a chart is held against poses that are solved."""

FAR = 0.02
"""Height (m) from which a target of a few millimetres changes nothing: 1e-6 of its change at rest."""

LEAST = 1e-7
"""Least share of a coil's inductance that a target's change counts as: its logarithm is charted."""


@record(eq=False)
class Chart:
    """Inductance (H) and resistance (ohm) of every coil at its contacts, at its tank's frequency.

    `lean` (2; rad/m) is how much a target turns about x when it goes along y, and about y along x, as a rule; `middle`
    and `half` (6; m, rad) are the box of poses with so much taken off their turns; `free` (coils) is the inductance
    without target; `change` and `loss` (terms, coils) are the coefficients of ln(1 - L/L0) and of the resistance.
    `error` is what the chart is off by, of a sensor's change of L from rest: rms over `CHECKED` poses.
    """

    lean: Array
    middle: Array
    half: Array
    orders: Exponents
    free: Array
    change: Array
    loss: Array
    error: float

    def __call__(self, poses: Array) -> tuple[Array, Array]:
        """Inductances (H) and resistances (ohm), (n, coils) each, at (n, 6) poses."""
        values = chebyshev((upright(poses, self.lean) - self.middle) / self.half, self.orders)
        return self.free * (1.0 - np.exp(values @ self.change)), values @ self.loss


def terminals(model: ResponseModel, poses: Array) -> tuple[Array, Array]:
    """The same as the model has it, each pose solved, the target as for performance."""
    parts = [model.respond(poses[k : k + AT_ONCE], within=model.pad_ends) for k in range(0, len(poses), AT_ONCE)]
    return np.concatenate([part.inductance for part in parts]), np.concatenate([part.resistance for part in parts])


def without_target(model: ResponseModel) -> tuple[Array, Array]:
    """Inductance (H) and resistance (ohm) of every coil at its contacts without the target, (coils,) each."""
    inductance, resistance = terminals(model, np.array([[0.0] * 6, [0.0, 0.0, FAR, 0.0, 0.0, 0.0]]))
    return inductance[1], resistance[1]


AT_ONCE = 256
"""Poses solved at once: so few that none is interpolated."""


def upright(poses: Array, lean: Array, sign: float = -1.0) -> Array:
    """Poses (n, 6) without the turns that go with their travel; with a positive `sign` it is put on again."""
    found = poses.copy()
    found[:, 3:5] += sign * lean * poses[:, [1, 0]]
    return found


def chart(model: ResponseModel, free: Array, reached: Array, moved: Array, most: float) -> Chart:
    """The chart of a model over the box of all poses (m, rad) that may be reached: `reached` (sensors, n, 6; the first
    of each at rest) by some sensors, of which the first is the one as drawn, and as far from that one's as its errors
    may move it together, each `moved` (ways, unknowns, n, 6) as far as it may by itself; none farther aside than `most`
    (m). Few sensors leave out what a soft and thin one does. `free` (coils; H) is the inductance without target.
    """
    reached = _nearer(reached, most)
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
    inside = np.sin(0.5 * np.pi * (2.0 * spread(int(POINTS_A_TERM * len(orders)), 6) - 1.0))  # denser at the ends
    asked = reached[: CHECKED[0], np.linspace(0, reached.shape[1] - 1, 1 + CHECKED[1]).astype(int)]
    poses = np.vstack([upright(middle + half * inside, lean, 1.0), asked.reshape(-1, 6)])
    inductance, resistance = terminals(model, poses)
    known = len(inside)
    change = np.log(np.maximum(1.0 - inductance[:known] / free, LEAST))
    coefficients = np.linalg.lstsq(chebyshev(inside, orders), np.hstack([change, resistance[:known]]), rcond=None)[0]
    change, loss = coefficients[:, : free.size], coefficients[:, free.size :]
    found = Chart(lean, middle, half, orders, free, change, loss, 0.0)
    told, true = (part.reshape(*asked.shape[:2], -1) for part in (found(poses[known:])[0], inductance[known:]))
    moves = true[:, 1:] - true[:, :1]
    return replace(found, error=float(np.sqrt(np.mean((told[:, 1:] - told[:, :1] - moves) ** 2) / np.mean(moves**2))))


def _nearer(poses: Array, most: float) -> Array:
    """Poses (..., 6) brought back to `most` (m) aside, with the turns that go with it, where they are farther."""
    found, aside = poses.copy(), np.hypot(poses[..., 0], poses[..., 1])
    found[..., [0, 1, 3, 4]] *= np.minimum(1.0, most / np.maximum(aside, most))[..., None]
    return found


def _slope(travel: Array, turn: Array) -> float:
    """How much turn goes with travel, by least squares."""
    away = travel - travel.mean()
    size = float(away @ away)
    return float(away @ turn) / size if size > 0.0 else 0.0


WIDER = 1.1
"""By how much the box is wider than what is reached."""

SMALLEST = np.array([1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4])
"""Least half widths (m, rad) of a chart."""
