"""A calibration led point by point: what to put on, readings taken once they are at rest, and the table of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from sitscad.arrays import Array
from sitscad.bench.board import OUT_OF_BAND, Board
from sitscad.bench.diagnosis import JUMP
from sitscad.bench.readings import Scan, scans
from sitscad.bench.source import Simulation, Source
from sitscad.calibration.calibration import Calibration
from sitscad.calibration.plan import load_words, table_head
from sitscad.calibration.unknowns import usual
from sitscad.estimates.circuit.settings import identity

WINDOW = 1.0
"""Seconds over which readings are averaged, and from which to which they may not move."""

MOVED = 4.0
"""Standard deviations of the difference of two such means from which on readings move."""

PATIENCE = 60.0
"""Seconds after which readings that still move are given up."""

SOUND = 0.9
"""Share of a coil's results that have to be good, and near their median."""


class NotTaken(ValueError):
    """A point that cannot be taken, in words."""


def head(board: Board, found: Calibration) -> str:
    """The first lines of the table: by them a table is known that belongs to this sensor and plan."""
    assert found.plan is not None
    design, points = board.design, len(found.plan.loads)
    of = f"# {design.spec.name}, settings {identity(design.spec.name, board.devices):08X}, {points} points"
    return "\n".join([of, *table_head(found.sensors)]) + "\n"


def led(
    board: Board, source: Source, found: Calibration, before: str,
    ask: Callable[[str], str], tell: Callable[[str], None],
) -> Iterator[str]:
    """The table after every point that is taken, from where `before`, the table as far as it is, ends. `ask` shows what
    to put on and gives back what was typed: nothing once it is on, or the forces that are (N). A simulated board is
    loaded as the plan says. Raises ValueError for tables and boards of another sensor, NotTaken for points that cannot
    be taken, OSError without an answer.
    """
    assert found.plan is not None
    text, rows, scope = head(board, found), found.plan.rows, found.sensors.range
    if isinstance(source, Simulation) and identity(source.design.spec.name, board.devices) != identity(
        board.design.spec.name, Board(source.design, ()).devices
    ):
        raise ValueError(f"the simulated board is {source.design.spec.name}, not {board.design.spec.name}")
    if before and not (before.startswith(text) and before.endswith("\n")):
        raise ValueError("the table that is there is of another sensor, of other settings or of another plan: move it")
    text = before or text
    done = text.count("\n") - head(board, found).count("\n")
    for number, load in enumerate(rows[done:], done + 1):
        words = load_words(load, scope.axes, found.sensors.rotation) if load.any() else "nothing on it"
        forces = _put_on(source, load, scope.columns, found.sensors.is_held, f"{number} of {len(rows)}: {words}", ask)
        counts = taken(board, source, tell)
        text += ",".join([*(f"{force:.6g}" for force in forces), *(f"{count:.1f}" for count in counts)]) + "\n"
        tell(f"{number} of {len(rows)} taken")
        yield text


def _put_on(
    source: Source, load: Array, columns: list[int], is_held: bool, words: str, ask: Callable[[str], str]
) -> Array:
    """The forces (axes; N) that were put on: those asked for, or what was typed."""
    if isinstance(source, Simulation):
        source.put_on(load, is_held)
        return np.asarray(load[columns])
    while typed := ask(words).replace(",", " ").split():
        try:
            forces = np.array([float(word) for word in typed])
        except ValueError:
            continue
        if len(forces) == len(columns) and np.all(np.isfinite(forces)) and forces.any() == load.any():
            return forces
    return np.asarray(load[columns])


def taken(board: Board, source: Source, tell: Callable[[str], None]) -> Array:
    """The mean counts (coils) once they are at rest: two windows in a row that differ by no more than noise. Raises
    NotTaken where a coil has no good readings, or where they still move after `PATIENCE`.
    """
    if source.creep:
        tell(f"waiting {source.creep:.0f} s for the pad to come to rest")
        source.wait(source.creep)
    board.skip()
    last, end = None, source.now() + PATIENCE
    while source.now() < end:
        mean, sigma = window(board, list(scans(board, source, source.now() + _long(board))))
        if last is not None:
            moves = np.abs(mean - last[0]) / np.hypot(sigma, last[1])
            if np.all(moves <= MOVED):
                return mean
            tell(f"{board.bands[int(np.argmax(moves))].coil} still moves")
        last = mean, sigma
    raise NotTaken(f"readings still move after {PATIENCE:.0f} s: the load, its guide or the temperature")


def _long(board: Board) -> float:
    """Seconds of a window."""
    rate = board.design.estimates.readout.scan_rate
    assert rate is not None
    return float(max(WINDOW, (usual("readings") + 2) / rate))


def window(board: Board, rows: list[Scan]) -> tuple[Array, Array]:
    """Mean counts (coils), and one sigma of that mean by the design's noise; single results far off are left out, and
    where they are many there is no mean. Raises NotTaken where a coil has no good readings.
    """
    means, sigmas = [], []
    for coil, own in enumerate(board.bands):
        read = [row[coil] for row in rows if coil in row]
        good = np.array([one.counts for one in read if one.is_good], dtype=float)
        noise = board.conversion.noise(own.assembled.design) / board.frequency(1)
        said = sorted({one.status for one in read if not one.is_good})
        if len(good) < max(SOUND * len(read), usual("readings")) or np.ptp(good) == 0.0:
            more = ": another sensor, or a fault" if OUT_OF_BAND in said else ""
            why = ", ".join(said) or ("stuck" if len(good) else "no reading")
            raise NotTaken(f"{own.coil}: {why}{more}; `sitscad read --diagnose` says more")
        near = good[np.abs(good - np.median(good)) <= JUMP * noise]
        means.append(near.mean() if len(near) >= SOUND * len(good) else np.nan)
        sigmas.append(noise / np.sqrt(len(near)))
    return np.array(means), np.array(sigmas)
