"""Response of a sensor as a small table, for a web page on which a reader applies loads to the sensor.

For a level target, the table returns frequencies and positions from forces and tilt. For a target that is free to tilt,
it returns frequencies and poses from forces and moments.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from sitscad.assembly.places.state import REST
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.loads.pad import loaded_poses
from sitscad.estimates.loads.working_range import WorkingRange, working_range
from sitscad.estimates.performance_values import MOMENTS
from sitscad.estimates.response.model import ResponseModel
from sitscad.kernels.electromagnetics.polynomials import (
    POINTS_A_TERM,
    Polynomial,
    exponents,
    halton_points,
    least_squares,
)
from sitscad.kernels.mechanics.elastomer import HELD_TILT

FORCE_INPUTS = ("normal_N", "shear_x_N", "shear_y_N")
"""Names of the inputs that are forces (N)."""
INPUTS = {"held": (*FORCE_INPUTS, "rx_rad", "ry_rad"), "free": (*FORCE_INPUTS, "moment_x_Nm", "moment_y_Nm")}
"""Names of the table's inputs in their order, for a target that is kept level ("held") or free to tilt ("free")."""

DEGREE, TILT_DEGREE = 7, 3  # Degrees of the polynomials in a level target's forces, and of the tilt terms
FREE_DEGREE = 5  # Degree of the polynomials in forces and moments of a free target
PRESSES = 20  # Points of a free target under normal force alone, the most common load

TEST_POINTS = 16, 8  # Additional points, level and tilted, on which the table is tested

DOWN = 0.4
"""Largest descent of a target's edge by tilt in the table, divided by the target's height at the largest force."""

STEEPEST = math.radians(3.0)  # The largest tilt (rad)
BEYOND = 1.2  # Extent of the table relative to the working range, so that a reader sees the range's end


@record(eq=False)
class ResponseTable:
    """Response of a sensor as polynomials in five `INPUTS`; each input is scaled to the interval from -1 to 1.

    The outputs are ln(frequency / frequency at rest) of every coil, then the target's travel (m) along x, y and z. If
    the target is free to tilt, its rotations (rad) about x and y follow. `range` is the working range. `through` holds
    the least and the largest value of each input (5; N, then rad or N m), the exponents (terms, 5) and the coefficients
    (terms, outputs). `rest` (coils; Hz) are the frequencies at rest. `error` is the largest error of a frequency at
    solved points, divided by the difference of the coil's highest and lowest frequency.
    """

    coils: tuple[str, ...]
    range: WorkingRange
    through: Polynomial
    rest: Array
    error: float = 0.0

    def __call__(self, loads: Array) -> tuple[Array, Array]:
        """Return frequencies (Hz; n, coils) and travel (m, rad; n, 3 or 5) at inputs (n, 5).

        Inputs beyond the ends of the table are replaced by the ends.
        """
        values = self.through(np.clip(loads, self.through.low, self.through.high))
        return self.rest * np.exp(values[:, : self.rest.size]), values[:, self.rest.size :]

    @property
    def rotation(self) -> str:
        """Rotation of the target: "free" to tilt if moments are measured, otherwise "held" level."""
        return "free" if self.range.has_moments else "held"

    def document(self) -> dict[str, Any]:
        """Return the table as plain values for JSON."""
        arrays = {"low": self.through.low, "high": self.through.high, "rest_Hz": self.rest,
                  "powers": self.through.orders, "coefficients": self.through.coefficients}
        return {
            "rotation": self.rotation, "inputs": list(INPUTS[self.rotation]), "coils": list(self.coils),
            "axes": list(self.range.axes), "full_scale_N": {"normal": self.range.normal, "shear": self.range.shear},
            "full_scale_Nm": dict(zip(MOMENTS, self.range.moments, strict=True)),
            "error": self.error,
            **{name: array.tolist() for name, array in arrays.items()},
        }


def response_table(model: ResponseModel) -> ResponseTable:
    """Return the table of a design over its working range and a little beyond, fitted to responses at many loads.

    If moments are measured, the target is free to tilt. Otherwise forces do not tilt it, and its tilt about the middle
    of the near face is an input of the table. Frequencies at rest are from the state at rest. Raises `NoResponse`
    without a pad.
    """
    scope = working_range(model.spec)
    polynomial, loads, values = (_free_polynomials if scope.has_moments else _level_polynomials)(model, scope)
    states = [coil.states.get(REST) for coil in model.estimates.coils]
    at_rest = model.on_pad(np.zeros((1, 6))).frequency[0]
    rest = np.array([frequency if state is None else state.frequency
                     for frequency, state in zip(at_rest, states, strict=True)])
    table = ResponseTable(tuple(coil.name for coil in model.layout.coils), scope, polynomial, rest)
    solved = np.exp(values[:, : rest.size])
    apart = np.abs(table(loads)[0] / rest - solved)
    return replace(table, error=float((apart / np.ptp(solved, axis=0)).max()))


def _free_polynomials(model: ResponseModel, scope: WorkingRange) -> tuple[Polynomial, Array, Array]:
    """Return polynomials for the response of a free target to forces and moments, and the points of their fit.

    The points are two arrays: inputs (n, 5: normal force, two shear forces, two moments; N, N m) and outputs (n,
    outputs). They include test points that are not fitted.
    """
    moments = np.array([each or max(scope.moments) for each in scope.moments])
    high = BEYOND * np.array([scope.normal, scope.shear, scope.shear, *moments])
    low = np.array([0.0, *-high[1:]])
    terms = exponents((1.0,) * 5, FREE_DEGREE)
    count = round(POINTS_A_TERM * len(terms))
    points = np.sin(0.5 * np.pi * (2.0 * halton_points(count + sum(TEST_POINTS), 5) - 1.0))  # denser at the ends
    presses = np.zeros((PRESSES, 5))
    presses[:, 0] = high[0] * 0.5 * (1.0 - np.cos(np.pi * (np.arange(PRESSES) + 0.5) / PRESSES))
    loads = np.vstack([np.zeros(5), presses, low + 0.5 * (points + 1.0) * (high - low)])
    poses = loaded_poses(model.spec, loads, np.zeros(len(loads), dtype=bool))[0]
    frequency = model.on_pad(poses).frequency
    values = np.hstack([np.log(frequency / frequency[0]), poses[:, :5]])
    fitted = slice(0, 1 + PRESSES + count)
    return least_squares(loads[fitted], values[fitted], terms, low, high), loads, values


def _level_polynomials(model: ResponseModel, scope: WorkingRange) -> tuple[Polynomial, Array, Array]:
    """Return polynomials for the response of a level target to forces and tilt, and the points of their fit.

    The points are two arrays: inputs (n, 5; N, rad) and outputs (n, outputs). They include test points that are not
    fitted. The terms without tilt are fitted to level points, the terms with tilt to the differences of tilted points.
    This takes a tenth of the time of a fit to tilted points alone: the currents of a level target over a plane of metal
    have its symmetries.
    """
    ends = BEYOND * np.array([scope.normal, scope.shear, scope.shear])
    pressed = loaded_poses(model.spec, np.array([[ends[0], 0.0, 0.0]]))[0]
    steepest = np.array([0.0, 0.0, 0.0, HELD_TILT, HELD_TILT, 0.0])
    level, steep = model.lowest(np.vstack([pressed, pressed + steepest]))
    tilt = float(min(STEEPEST, HELD_TILT * DOWN * level / (level - steep)))
    high = np.array([*ends, tilt, tilt])
    low = np.array([0.0, *-high[1:]])
    plain = np.pad(exponents((1.0,) * 3, DEGREE), ((0, 0), (0, 2)))
    tilted = np.array([row for row in exponents((1.0,) * 5, TILT_DEGREE) if row[3:].any()])
    counts = [round(POINTS_A_TERM * len(terms)) for terms in (plain, tilted)]
    rows = [np.sin(0.5 * np.pi * (2.0 * halton_points(count + tilts, 5) - 1.0))  # denser at the ends
            for count, tilts in zip(counts, TEST_POINTS, strict=True)]
    rows[0][:, 3:] = 0.0
    points = np.vstack([2.0 * (np.zeros(5) - low) / (high - low) - 1.0, *rows])
    loads = low + 0.5 * (points + 1.0) * (high - low)
    poses = loaded_poses(model.spec, loads[:, :3])[0]
    poses[:, 3:5] += loads[:, 3:]
    frequency = model.on_pad(poses).frequency
    values = np.hstack([np.log(frequency / frequency[0]), poses[:, :3]])
    parts = [slice(0, 1 + counts[0]), slice(1 + len(rows[0]), 1 + len(rows[0]) + counts[1])]
    base = least_squares(loads[parts[0]], values[parts[0]], plain, low, high)
    tilts = least_squares(loads[parts[1]], values[parts[1]] - base(loads[parts[1]]), tilted, low, high)
    combined = replace(base, orders=np.vstack([plain, tilted]),
                   coefficients=np.vstack([base.coefficients, tilts.coefficients]))
    return combined, loads, values
