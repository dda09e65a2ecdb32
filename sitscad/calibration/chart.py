"""A chart of what the coils read: polynomials through the response at some poses, for the thousands that fits ask."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.calibration.maps.basis import Exponents, chebyshev, exponents, spread
from sitscad.estimates.response.model import ResponseModel
from sitscad.record import record

Array = NDArray[np.float64]

WEIGHTS, DEGREE = (1.0, 1.0, 1.5, 2.0, 2.0, 3.0), 6.0
"""What a degree costs along each number of a pose, and how much in all: 151 terms, 0.2 to 0.6 % of the readings'
changes (rms; simulated sensors of the templates grasper_4layer and three_axis_triangle)."""

POINTS_A_TERM = 2
"""Poses solved for every term."""

FAR = 0.02
"""Height (m) from which a target of a few millimetres changes nothing: 1e-6 of its change at rest."""

LEAST = 1e-7
"""Least share of a coil's inductance that a target's change counts as: its logarithm is charted."""


@record(eq=False)
class Chart:
    """Inductance (H) and resistance (ohm) of every coil at its contacts, at its tank's frequency.

    `lean` (2; rad/m) is how much a target turns about x when it goes along y, and about y along x, as a rule; `middle`
    and `half` (6; m, rad) are the box of poses with so much taken off their turns; `free` and `lost` (coils) what the
    coils have without target; `change` and `loss` (terms, coils) are the coefficients of ln(1 - L/L0) and of the
    resistance.
    """

    lean: Array
    middle: Array
    half: Array
    orders: Exponents
    free: Array
    lost: Array
    change: Array
    loss: Array

    def __call__(self, poses: Array) -> tuple[Array, Array]:
        """Inductances (H) and resistances (ohm), (n, coils) each, at (n, 6) poses."""
        values = chebyshev((upright(poses, self.lean) - self.middle) / self.half, self.orders)
        return self.free * (1.0 - np.exp(values @ self.change)), values @ self.loss


def terminals(model: ResponseModel, poses: Array, free: bool = False) -> tuple[Array, Array]:
    """The same as the model has it, each pose solved; with `free`, a last row without the target."""
    rows = np.vstack([poses, [[0.0, 0.0, FAR, 0.0, 0.0, 0.0]]]) if free else poses
    parts = [model.respond(rows[k : k + AT_ONCE]) for k in range(0, len(rows), AT_ONCE)]
    return np.concatenate([part.inductance for part in parts]), np.concatenate([part.resistance for part in parts])


AT_ONCE = 256
"""Poses solved at once: so few that none is interpolated."""


def upright(poses: Array, lean: Array, sign: float = -1.0) -> Array:
    """Poses (n, 6) without the turns that go with their travel; with a positive `sign` it is put on again."""
    found = poses.copy()
    found[:, 3:5] += sign * lean * poses[:, [1, 0]]
    return found


def chart(model: ResponseModel, reached: Array, moved: Array) -> Chart:
    """The chart of a model over the box of all poses (m, rad) that may be reached: `reached` (sensors, n, 6) by some
    sensors, of which the first is the one as drawn, and as far from that one's as its errors may move it together,
    each `moved` (ways, unknowns, n, 6) as far as it may by itself. Few sensors leave out what a soft and thin one does.
    """
    all_reached = reached.reshape(-1, 6)
    lean = np.array([_slope(all_reached[:, 1], all_reached[:, 3]), _slope(all_reached[:, 0], all_reached[:, 4])])
    alone = np.abs(upright(moved.reshape(-1, 6), lean)).reshape(moved.shape).max(axis=0)
    together, drawn = np.sqrt(np.sum(alone**2, axis=0)), upright(reached[0], lean)
    together[:, 3:] = 0.0  # turns beyond those of the sensors drawn hardly count, and a wider chart errs more
    plain = np.vstack([upright(all_reached, lean), drawn - together, drawn + together])
    low, high = plain.min(axis=0), plain.max(axis=0)
    middle, half = 0.5 * (low + high), np.maximum(WIDER * 0.5 * (high - low), SMALLEST)
    orders = exponents(WEIGHTS, DEGREE)
    inside = np.sin(0.5 * np.pi * (2.0 * spread(POINTS_A_TERM * len(orders), 6) - 1.0))  # denser at the ends
    inductance, resistance = terminals(model, upright(middle + half * inside, lean, 1.0), free=True)
    free, lost = inductance[-1], resistance[-1]
    change = np.log(np.maximum(1.0 - inductance[:-1] / free, LEAST))
    columns = chebyshev(inside, orders)
    coefficients = np.linalg.lstsq(columns, np.hstack([change, resistance[:-1]]), rcond=None)[0]
    return Chart(lean, middle, half, orders, free, lost, coefficients[:, : free.size], coefficients[:, free.size :])


def _slope(travel: Array, turn: Array) -> float:
    """How much turn goes with travel, by least squares."""
    away = travel - travel.mean()
    size = float(away @ away)
    return float(away @ turn) / size if size > 0.0 else 0.0


WIDER = 1.1
"""By how much the box is wider than what is reached."""

SMALLEST = np.array([1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4])
"""Least half widths (m, rad) of a chart."""
