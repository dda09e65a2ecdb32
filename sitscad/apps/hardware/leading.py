"""Guided calibration, point by point: it shows the load to apply, waits for stable readings, and writes the table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from sitscad.apps.hardware.ambient import Ambient
from sitscad.apps.hardware.bench_board import OUT_OF_BAND, Board
from sitscad.apps.hardware.diagnosis import JUMP, Scan, read_scans
from sitscad.apps.hardware.source import Simulation, Source
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.calibration.calibration import Calibration
from sitscad.calibration.points import load_instruction, table_head
from sitscad.calibration.unknowns import usual_value
from sitscad.estimates.circuits.settings import board_identity
from sitscad.estimates.performance_values import amount_text, display_factors
from sitscad.spec.places import map_columns

WINDOW = 1.0
"""Time (s) over which readings are averaged. Two successive means are compared to detect motion."""

STABLE_SIGMAS = 4.0
"""Largest difference of two successive means of stable readings, in standard deviations of this difference."""

PATIENCE = 60.0
"""Longest wait (s) for stable readings."""

REPEAT_INPUT = "back"
"""Input by which the user requests to repeat the point before."""

LOAD_INPUTS = f"; then Enter, or the newtons that are on, or {REPEAT_INPUT}"
"""End of the prompt for a load: the possible inputs."""

PLAUSIBLE_RATIOS = 0.1, 4.0
"""Smallest and largest plausible force by the map of the nominal sensor, divided by the applied force.

400 simulated sensors of four templates gave ratios of 0.23 to 2.4.
"""

MAX_REST_READING = 0.1
"""Largest accepted force without load after the first tare, by the map of the nominal sensor (full scales).

A larger value means that a load is still applied.
"""

LEAST_GOOD_FRACTION = 0.9
"""Least fraction of a coil's results that must be good, and of its good results that must not be outliers."""


class PointRefused(ValueError):
    """Raised for a point whose readings cannot be used. The text gives the reason."""


def head_lines(board: Board, calibration: Calibration) -> str:
    """Return the first lines of the table. They identify the sensor and the planned loads."""
    assert calibration.plan is not None
    design, points = board.design, len(calibration.plan.loads)
    of = f"# {design.spec.name}, settings {board_identity(design.spec.name, board.devices):08X}, {points} points"
    return "\n".join([of, *table_head(calibration.sensors, calibration.table_coils,
                                      calibration.temperatures is not None)]) + "\n"


@record(eq=False)
class GuidedCalibration:
    """A calibration of a board, point by point.

    `prompt` shows the load to apply and returns the user's input. `report` shows progress. On a simulated board, the
    planned loads are applied automatically. If the board has cells, only the coils of the map are read.
    """

    board: Board
    source: Source
    calibration: Calibration
    prompt: Callable[[str], str]
    report: Callable[[str], None]

    def table(self, before: str = "") -> Iterator[str]:
        """Yield the text of the table after each point. `before` is a table to continue.

        If a user's point cannot be used, the reason is shown and the point is requested again.

        Raises
        ------
        ValueError
            if the table or the board belongs to another sensor
        PointRefused
            if a simulated point cannot be used
        OSError
            if the board does not answer
        """
        assert self.calibration.plan is not None
        first, (rows, celsius) = self._head_text(before), self.calibration.planned_rows
        text = before or first
        while (done := text.count("\n") - first.count("\n")) < len(rows):
            try:
                row = self._point_line(rows[done], None if celsius is None else float(celsius[done]),
                                  f"{done + 1} of {len(rows)}", text[len(first) :].partition("\n")[0])
            except PointRefused as error:
                if isinstance(self.source, Simulation):
                    raise
                self.report(f"{error}. Once more")
                continue
            text = text + row if row else text[: text.rindex("\n", 0, -1) + 1]
            self.report(f"{done + 1} of {len(rows)} taken" if row else f"{done} of {len(rows)} is taken again")
            yield text

    def _head_text(self, before: str) -> str:
        """Return the first lines of the table.

        `before` is a table to continue, or empty. Raises ValueError if the board or this table belongs to another
        sensor.
        """
        board, source, first = self.board, self.source, head_lines(self.board, self.calibration)
        ours = board_identity(board.design.spec.name, board.devices)
        if isinstance(source, Simulation) and ours != board_identity(
            source.design.spec.name, Board(source.design, ()).devices
        ):
            raise ValueError(f"the simulated board is {source.design.spec.name}, not {board.design.spec.name}")
        if before and not (before.startswith(first) and before.endswith("\n")):
            raise ValueError(
                "the table that is there is of another sensor, of other settings or of another plan: move it"
            )
        return first

    def _point_line(self, load: Array, celsius: float | None, number: str, rest: str) -> str:
        """Return the table's line for one point. Empty if the user wants to repeat the point before.

        `load` is the planned load, and `number` the point's number for the prompt. `celsius` (degrees Celsius) is the
        planned temperature; None if the plan has no temperatures. `rest` is the line of the first point, which is at
        rest. Raises PointRefused if the readings cannot be used. Also raises it if they do not fit the planned load,
        and the user did not type another load.
        """
        scope, is_typed, planned = self.calibration.sensors.range, False, self.calibration.temperatures
        forces: Array | None = load[scope.columns]
        if isinstance(self.source, Simulation):
            if celsius is not None:
                self.source.course = Ambient(np.zeros(1), np.full(1, celsius))
            self.source.apply_load(load, self.calibration.sensors.is_held, self.calibration.cell or 1)
        else:
            instruction = load_instruction(load, scope.axes,
                                     self.calibration.sensors.rotation) if load.any() else "nothing on it"
            warmth = "" if celsius is None else f" at {celsius:.4g} degC"
            forces, is_typed = self._request_load(load, f"{number}: {instruction}{warmth}", not rest)
        if forces is None:
            return ""
        sensors = self.calibration.sensors
        columns, _ = map_columns(self.board.design.spec, sensors.coils)
        reference = [len(self.board.bands) - 1] * (len(self.calibration.table_coils) - len(columns))
        counts = stable_counts(self.board, self.source, self.report, [*columns, *reference])
        is_base = planned is None or celsius == planned.base  # the drift at other temperatures reads as a force
        if rest and is_base and not is_typed and not isinstance(self.source, Simulation):
            tare = np.array([float(cell) for cell in rest.split(",")[-len(counts):]])
            self._require_plausible(forces, counts[: len(columns)], tare[: len(columns)])
        shown = [f"{force:.6g}" for force in forces * display_factors(scope.axes)]
        if celsius is not None:
            shown.append(f"{self._point_celsius(celsius):.6g}")
        return ",".join([*shown, *(f"{count:.1f}" for count in counts)]) + "\n"

    def _point_celsius(self, planned: float) -> float:
        """Return the temperature (degrees Celsius) of a point, measured by the sensor or typed by the user.

        An empty input stands for the planned temperature. A simulated board without a sensor has the planned one.
        """
        celsius = self.source.celsius(self.source.now())
        while not math.isfinite(celsius):
            prompt = f"temperature in degC; Enter for {planned:.4g}"
            typed = "" if isinstance(self.source, Simulation) else self.prompt(prompt)
            try:
                celsius = float(typed.replace(",", ".") or planned)
            except ValueError:
                self.report(f"{typed!r} is not a temperature in degrees Celsius")
        return celsius

    def _request_load(self, load: Array, prompt: str, is_first: bool) -> tuple[Array | None, bool]:
        """Return the applied forces (axes; N), and whether the user typed them.

        `load` is the planned load, and `prompt` the text that requests it. The forces are None if the user wants to
        repeat the point before. The first point (`is_first`) has none before it.
        """
        scope = self.calibration.sensors.range
        while typed := self.prompt(f"{prompt}{LOAD_INPUTS}").replace(",", " ").split():
            if typed == [REPEAT_INPUT] and not is_first:
                return None, False
            with suppress(ValueError):
                forces = np.array([float(word) for word in typed])
                if len(forces) == len(scope.columns):
                    forces = forces / display_factors(scope.axes)
                if len(forces) == len(scope.columns) and np.all(np.isfinite(forces)) and forces.any() == load.any():
                    return forces, True
            form = "0 for every axis: this is the tare"
            if load.any():
                form = f"{', '.join(scope.axes)} in newtons{MOMENTS_TOO * scope.has_moments}"
            self.report(f"{' '.join(typed)!r} is not {form}; nothing and Enter: as asked for; {REPEAT_INPUT}: the one "
                        f"before")
        return np.asarray(load[scope.columns]), False

    def _require_plausible(self, forces: Array, counts: Array, rest: Array) -> None:
        """Raise PointRefused if the readings do not fit the applied forces (axes; N).

        `counts` and `rest` are the counts (coils) under load and without load. The map of the nominal sensor converts
        them to forces. The limits are far wider than the differences between sensors.
        """
        inverse_map = self.calibration.map
        read, size = inverse_map(counts, rest)[0], np.abs(forces)
        low, high = (share * size for share in PLAUSIBLE_RATIOS)
        signed, loaded = read * np.sign(forces), size > 0.0
        is_off = np.any(((signed < low) | (signed > high)) & loaded)
        if is_off if loaded.any() else np.linalg.norm(read / inverse_map.full_scale) > MAX_REST_READING:
            text = ", ".join(f"{amount_text(force, axis, 2)} {axis}"
                             for axis, force in zip(inverse_map.axes, read, strict=True))
            raise PointRefused(f"that reads as about {text}; put it right, or type the newtons that are on to keep it")


MOMENTS_TOO = ", moments in newton millimetres"


def stable_counts(board: Board, source: Source, tell: Callable[[str], None], coils: Sequence[int]) -> Array:
    """Return the mean counts of the coils with numbers `coils` (from 0), once the readings are stable.

    Readings are stable if the means over two successive windows differ by no more than noise. Raises PointRefused if a
    coil has no good readings, or if readings are still unstable after `PATIENCE`.
    """
    if source.creep:
        tell(f"waiting {source.creep:.0f} s for the pad to come to rest")
        source.wait(source.creep)
    board.skip()
    rate = board.design.estimates.readout.scan_rate
    assert rate is not None
    last, end, long = None, source.now() + PATIENCE, max(WINDOW, (usual_value("readings") + 2) / rate)
    while source.now() < end:
        mean, sigma = mean_counts(board, list(read_scans(board, source, source.now() + long)), coils)
        if last is not None:
            moves = np.abs(mean - last[0]) / np.hypot(sigma, last[1])
            if np.all(moves <= STABLE_SIGMAS):
                return mean
            tell(f"{board.bands[coils[int(np.argmax(moves))]].coil} still moves")
        last = mean, sigma
    raise PointRefused(f"readings still move after {PATIENCE:.0f} s: the load, its guide or the temperature")


def mean_counts(board: Board, rows: list[Scan], coils: Sequence[int]) -> tuple[Array, Array]:
    """Return the mean counts (coils) of the coils `coils` over scans (`rows`), and the standard deviation of each mean.

    The standard deviations follow from the design's noise. Outliers (see `JUMP`) are left out. The mean is NaN if less
    than the fraction `LEAST_GOOD_FRACTION` of the good results remains. Raises PointRefused if a coil has no good
    readings.
    """
    means, sigmas = [], []
    for coil in coils:
        band = board.bands[coil]
        read = [row[coil] for row in rows if coil in row]
        good = np.array([reading.counts for reading in read if reading.is_good], dtype=float)
        noise = board.conversion.noise(band.assembled.design) / board.frequency(1)
        statuses = sorted({reading.status for reading in read if not reading.is_good})
        if len(good) < max(LEAST_GOOD_FRACTION * len(read), usual_value("readings")) or np.ptp(good) == 0.0:
            more = ": another sensor, or a fault" if OUT_OF_BAND in statuses else ""
            why = ", ".join(statuses) or ("stuck" if len(good) else "no reading")
            raise PointRefused(f"{band.coil}: {why}{more}; `sitscad read --diagnose` says more")
        near = good[np.abs(good - np.median(good)) <= JUMP * noise]
        means.append(near.mean() if len(near) >= LEAST_GOOD_FRACTION * len(good) else np.nan)
        sigmas.append(noise / np.sqrt(len(near)))
    return np.array(means), np.array(sigmas)
