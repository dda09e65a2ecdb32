"""A sensor's response as one table: frequencies and poses over forces and tilt, small enough for a page that lets a
reader push the sensor.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from sitscad.arrays import Array
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.pad import pushed
from sitscad.estimates.response.working_range import WorkingRange, working_range
from sitscad.mechanics.pad import HELD_TILT
from sitscad.physics.polynomials import POINTS_A_TERM, Polynomial, exponents, least_squares, spread
from sitscad.record import record
from sitscad.scene.state import REST

INPUTS = ("normal_N", "shear_x_N", "shear_y_N", "rx_rad", "ry_rad")  # What the table is asked for, in its order
DEGREE, TILT_DEGREE = 7, 3  # Of the polynomials in the forces of a level target, and in all inputs of what a tilt adds

ASKED = 16, 8  # Points, level and tilted, beside those it is fitted to, on which the table is tried

DOWN = 0.4
"""Share of the height left under a level target's edge, by the table's largest force, by which a tilt may lower it."""

STEEPEST = math.radians(3.0)  # The largest tilt (rad)
BEYOND = 1.2  # How far beyond the working range the table goes, for a reader to see that it ends


@record(eq=False)
class ResponseTable:
    """Polynomials in the `INPUTS`, each brought to -1 to 1: of ln of every coil's frequency over that at `rest` (Hz),
    and of the target's travel (m) along x, y and z.

    `through` has the inputs' ends (5; N, rad), exponents (terms, 5) and coefficients (terms, coils + 3); `error` is the
    largest of what the frequencies are off by at points that are solved, of the span of all.
    """

    coils: tuple[str, ...]
    range: WorkingRange
    through: Polynomial
    rest: Array
    error: float = 0.0

    def __call__(self, asked: Array) -> tuple[Array, Array]:
        """Frequencies (Hz; n, coils) and travel (m; n, 3) at inputs (n, 5), beyond its ends those of the ends."""
        values = self.through(np.clip(asked, self.through.low, self.through.high))
        return self.rest * np.exp(values[:, : self.rest.size]), values[:, self.rest.size :]

    def document(self) -> dict[str, Any]:
        """The table as plain values for JSON."""
        arrays = {"low": self.through.low, "high": self.through.high, "rest_Hz": self.rest,
                  "powers": self.through.orders, "coefficients": self.through.coefficients}
        return {
            "inputs": list(INPUTS), "coils": list(self.coils), "axes": list(self.range.axes),
            "full_scale_N": {"normal": self.range.normal, "shear": self.range.shear},
            "error": self.error,
            **{name: array.tolist() for name, array in arrays.items()},
        }


def response_table(model: ResponseModel) -> ResponseTable:
    """The table of a design over its working range and a little beyond, the target kept level but for the tilt that is
    asked for (about the middle of its near face). Every point is solved. Frequencies at rest are those of
    the state. Raises `NoResponse` without a pad.

    What a tilt adds has terms of its own, fitted to what tilted points differ by from level ones: these take a tenth of
    the time, because over a mirror the currents of a level target keep its symmetries.
    """
    found = working_range(model.spec)
    ends = BEYOND * np.array([found.normal, found.shear, found.shear])
    pressed = pushed(model.spec, np.array([[ends[0], 0.0, 0.0]]))[0]
    steepest = np.array([0.0, 0.0, 0.0, HELD_TILT, HELD_TILT, 0.0])
    level, steep = model.lowest(np.vstack([pressed, pressed + steepest]))
    tilt = float(min(STEEPEST, HELD_TILT * DOWN * level / (level - steep)))
    high = np.array([*ends, tilt, tilt])
    low = np.array([0.0, *-high[1:]])
    plain = np.pad(exponents((1.0,) * 3, DEGREE), ((0, 0), (0, 2)))
    tilted = np.array([row for row in exponents((1.0,) * 5, TILT_DEGREE) if row[3:].any()])
    counts = [round(POINTS_A_TERM * len(terms)) for terms in (plain, tilted)]
    rows = [np.sin(0.5 * np.pi * (2.0 * spread(count + more, 5) - 1.0))  # denser at the ends
            for count, more in zip(counts, ASKED, strict=True)]
    rows[0][:, 3:] = 0.0
    points = np.vstack([2.0 * (np.zeros(5) - low) / (high - low) - 1.0, *rows])
    asked = low + 0.5 * (points + 1.0) * (high - low)
    poses = pushed(model.spec, asked[:, :3])[0]
    poses[:, 3:5] += asked[:, 3:]
    frequency = model.on_pad(poses).frequency
    values = np.hstack([np.log(frequency / frequency[0]), poses[:, :3]])
    parts = [slice(0, 1 + counts[0]), slice(1 + len(rows[0]), 1 + len(rows[0]) + counts[1])]
    own = least_squares(asked[parts[0]], values[parts[0]], plain, low, high)
    more = least_squares(asked[parts[1]], values[parts[1]] - own(asked[parts[1]]), tilted, low, high)
    both = replace(own, orders=np.vstack([plain, tilted]),
                   coefficients=np.vstack([own.coefficients, more.coefficients]))
    states = [coil.states.get(REST) for coil in model.estimates.coils]
    rest = np.array([own if state is None else state.frequency
                     for own, state in zip(frequency[0], states, strict=True)])
    table = ResponseTable(tuple(coil.name for coil in model.layout.coils), found, both, rest)
    apart = np.abs(table(asked)[0] / rest - frequency / frequency[0]) * rest
    return replace(table, error=float((apart / np.ptp(frequency, axis=0)).max()))
