"""Ambient temperature over time, and the frequencies of a warmed sensor on a simulated board.

Coils, reference coil and temperature sensor are on the board, whose temperature is the ambient temperature. The pad
lags behind the board.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from sitscad.assembly.places.state import FREE, REST
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.design import Cells, Design
from sitscad.estimates.performance.compensation import pad_lag
from sitscad.estimates.performance.warming import warm_poses
from sitscad.spec.materials import ElastomerPad, Target

COLDEST, HOTTEST = -55.0, 150.0
"""Range of ambient temperatures (degrees Celsius). It is the range of the temperature sensors."""

MOST_ROWS = 2000
"""Largest number of rows in a table of temperatures."""

COLUMNS = ("time_s", "celsius")
"""Columns of a table of temperatures: time (s) and temperature (degrees Celsius)."""


WANTED = (f"sim: temperature is DEGREES, FIRST:LAST ({COLDEST:g} to {HOTTEST:g} degC) or a CSV table with "
          f"{','.join(COLUMNS)}")
"""Text of the accepted temperatures."""


@record(eq=False)
class Ambient:
    """Ambient temperature over time, interpolated linearly.

    `celsius` (n; degrees Celsius) are the temperatures at `times` (n; s).
    """

    times: Array
    celsius: Array

    def board(self, times: Array) -> Array:
        """Return the temperatures (degrees Celsius) of the board at times (s)."""
        return np.interp(times, self.times, self.celsius)

    def pad(self, times: Array, constant: float) -> Array:
        """Return the temperatures (degrees Celsius) of the pad at increasing times (s).

        `constant` (s) is the time constant with which the pad follows the board. At the beginning, both have equal
        temperatures.
        """
        knots = np.unique(np.concatenate([self.times, times, [0.0]]))
        board = self.board(knots)
        pad = [board[0]]
        for step, before, after in zip(np.diff(knots), board[:-1], board[1:], strict=True):
            lag = constant * (after - before) / step  # the response of a first-order lag to a ramp
            pad.append(after - lag + (pad[-1] - before + lag) * math.exp(-step / constant))
        return np.interp(times, knots, pad)


def parse_ambient(text: str, seconds: float) -> Ambient:
    """Return the ambient temperature that a text describes.

    The text is a temperature (degrees Celsius), or FIRST:LAST for a linear change in `seconds`. Otherwise it is the
    path of a CSV table with `COLUMNS`. Raises ValueError for other texts and tables.
    """
    try:
        ends = [float(each) for each in text.split(":")]
    except ValueError:
        return _read_ambient_table(text)
    if len(ends) > 2 or not all(COLDEST <= each <= HOTTEST for each in ends):
        raise ValueError(f"{WANTED}, not {text!r}")
    return Ambient(np.array([0.0, seconds]), np.array([ends[0], ends[-1]]))


def _read_ambient_table(path: str) -> Ambient:
    """Return the ambient temperature of a CSV table. Raises ValueError if the table is wrong or cannot be read."""
    try:
        with Path(path).open(encoding="utf-8", newline="") as lines:
            rows = list(csv.DictReader(lines))
    except OSError as error:
        raise ValueError(f"{WANTED}; {path}: {error.strerror}") from error
    try:
        times, celsius = (np.array([float(row[name]) for row in rows]) for name in COLUMNS)
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path}: the columns are {','.join(COLUMNS)}, with a number in every row") from error
    if not 0 < len(rows) <= MOST_ROWS or not np.all(np.diff(times) > 0.0) or not np.all(
            (celsius >= COLDEST) & (celsius <= HOTTEST)):
        raise ValueError(f"{path}: 1 to {MOST_ROWS} rows with increasing times and {COLDEST:g} to {HOTTEST:g} degC")
    return Ambient(times, celsius)


def pad_time_constant(pad: ElastomerPad | None, target: Target | None) -> float:
    """Return the time constant (s) with which the pad follows the board's temperature.

    It is the pad's lag (K) behind a steadily warming board, divided by the board's rate (K/s). Raises ValueError
    without a pad or without a target.
    """
    if pad is None or target is None:
        raise ValueError("sim: temperature moves a target on an elastomer, and the design has none")
    return pad_lag(pad.thickness, pad.material.density, target.thickness, 1.0)


def warmed_frequencies(
    cells: Cells, frequencies: Array, loads: Array, times: Array, course: Ambient, loaded: int,
) -> Array:
    """Return frequencies (n, coils; Hz) of all coils at increasing `times` (n; s), with the effects of the temperature.

    `frequencies` (n, coils; Hz) of all sensing coils belong to the temperature of the requirements. `loads` (n, 3 or 5;
    N, N m) act on the cell number `loaded` (from 1). `course` is the ambient temperature. The last column of the result
    is the reference coil, if any.
    """
    board, parts = course.board(times), list[Array]()
    for number, cell in enumerate(cells, 1):
        on_this = loads if number == loaded else np.zeros_like(loads)
        constant = pad_time_constant(cell.spec.elastomer, cell.spec.target)
        parts.append(_drift(cell, on_this, board, course.pad(times, constant)))
    result = frequencies * np.exp(np.concatenate(parts, axis=1))
    reference, drift = cells.whole.estimates.reference, cells.reference_drift
    if reference is None or drift is None:
        return result
    rest = (reference.states.get(REST) or reference.states[FREE]).frequency
    return np.column_stack([result, rest * np.exp(drift * (board - cells.whole.estimates.temperature))])


def _drift(cell: Design, loads: Array, board: Array, pad: Array) -> Array:
    """Return the changes of ln(frequency) (n, coils) that temperature causes in a cell's coils under `loads`.

    Copper and other metal have the temperatures `board` (n; degrees Celsius), the pad has the temperatures `pad` (n).
    The pad's expansion and its modulus are solved for every row.
    """
    assert cell.spec.elastomer is not None
    solved = cell.sensing.solved
    bench, warmed_point, cold = solved.bench, solved.warmed[-1], cell.estimates.temperature
    loads = np.pad(loads, [(0, 0), (0, 2)])[:, : 5 if bench.range.has_moments else 3]
    poses = [warm_poses(bench, load[None], kelvin)[0] for load, kelvin in zip(loads, pad - cold, strict=True)]
    by_pad = np.log(cell.response.on_pad(np.array(poses)).frequency
                    / cell.response.on_pad(bench.poses(loads)).frequency)
    share = np.clip(loads[:, :1] / float(warmed_point.load[0]), 0.0, 1.0)
    by_metal = warmed_point.by_metal + share * (warmed_point.by_metal_loaded - warmed_point.by_metal)
    return np.asarray(by_pad + (board - cold)[:, None] * by_metal)
