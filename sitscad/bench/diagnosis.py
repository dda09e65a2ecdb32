"""What a board on the bench has to do to be the one of the design, and what it probably is where it does not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sitscad.bench.board import WATCHDOG, Board, CoilReading, LineBoard
from sitscad.estimates.circuit.bands import Band
from sitscad.readout import ldc_registers as at
from sitscad.record import record
from sitscad.units import show

MET, NOT_MET, NOT_EVALUATED = "MET", "NOT MET", "NOT EVALUATED"

FEWEST = 12
"""Readings of a coil from which its noise and its rate are judged."""

NOISY, SLOW = 2.0, 0.95
"""By how much more than the design's the noise may be, and by how much less the rate."""

FEW = 10.0
"""Over the square root of the number of results, what the noise found may be above the design's for want of more: seven
standard deviations of it.
"""

JUMP = 12.0
"""Standard deviations of noise from the median of three that no sound result has."""


@record
class Verdict:
    """One thing that a board must do: whether it does, and what was seen, or what a miss probably is."""

    name: str
    verdict: str
    said: str


def diagnosis(board: Board, wrong: Sequence[str], readings: Sequence[Sequence[CoilReading]]) -> tuple[Verdict, ...]:
    """All verdicts of a board that was set up (`wrong` are the registers that did not keep their value), by the results
    of every coil in the order of time. Raises OSError where it does not answer any more.
    """
    found = [_line(board)] if isinstance(board, LineBoard) else [_identity(board), _settings(board, wrong)]
    states = _state(board, readings)
    for k, rows in enumerate(readings):
        found += [_frequency(board, k, rows, states), _amplitude(board, k, rows), _noise(board, k, rows)]
    found += [_rate(board, readings), _order(board)]
    return tuple(found)


def _line(board: LineBoard) -> Verdict:
    """What came over a serial line; identity and settings are looked after by the firmware."""
    is_so = not (board.lost or board.corrupted or board.another or board.starts)
    more = "" if is_so else f": check the cable, the baud rate ({board.serial.baud}) and the speed of this computer"
    return Verdict("lines", MET if is_so else NOT_MET, board.said + more)


def _identity(board: Board) -> Verdict:
    wanted = (at.MANUFACTURER, board.design.converter.device_id)
    found = board.identities()
    words = ", ".join(f"0x{maker:04X} 0x{device:04X}" for maker, device in found)
    is_so = all(one == wanted for one in found)
    return Verdict("identity", MET if is_so else NOT_MET, words + ("" if is_so else ": another part, or a bad bus"))


def _settings(board: Board, wrong: Sequence[str]) -> Verdict:
    lost = sum(not board.is_set(k) for k in range(len(board.chips))) + board.restarts
    if wrong:
        return Verdict("settings", NOT_MET, f"{', '.join(wrong)} did not read back: the bus, or another part")
    if lost:
        times = "once" if lost == 1 else f"{lost} times"
        return Verdict("settings", NOT_MET, f"lost {times}: the supply broke down, or SD went high")
    return Verdict("settings", MET, "every register read back, and kept")


def _state(board: Board, readings: Sequence[Sequence[CoilReading]]) -> str:
    """Whether the coils read as a bare board or as an assembled one, whichever more of them fit."""
    fits = {
        state: sum(
            band.low <= board.frequency(rows[0].counts) <= band.high
            for one, rows in zip(board.bands, readings, strict=True)
            for band in [getattr(one, state)]
            if rows
        )
        for state in ("assembled", "bare")
    }
    return max(fits, key=lambda state: fits[state])


def _frequency(board: Board, coil: int, rows: Sequence[CoilReading], state: str) -> Verdict:
    """Frequency and inductance of a coil against the band of the state that the board is in, or under any load."""
    own = board.bands[coil]
    band: Band = getattr(own, state)
    name = f"{own.coil} frequency"
    if not rows:
        return Verdict(name, NOT_MET, "no result at all: the converter does not convert this channel")
    dead = [row for row in rows if row.status == WATCHDOG]
    if dead:
        when = f", first at {dead[0].time:.3g} s" if len(dead) < len(rows) else ""
        return Verdict(
            name, NOT_MET, f"does not oscillate{when}: open, or shorted from end to end; measure it with an ohmmeter"
        )
    read = np.array([board.frequency(row.counts) for row in rows])
    frequency = float(np.median(read))
    off = (band.design / frequency) ** 2 - 1.0
    seen = f"{show(frequency, 'Hz', 6)}, design {show(band.design, 'Hz', 6)} ({state}), L {100.0 * off:+.1f} %"
    low, high = min(band.low, own.working.low), max(band.high, own.working.high)
    # results that leave the median of themselves and their neighbours by more than noise ever does
    middle = np.median(np.stack([read[:-2], read[1:-1], read[2:]]), axis=0) if len(read) > 2 else read[1:-1]
    jumps = int(np.sum(np.abs(read[1:-1] - middle) > JUMP * board.conversion.noise(band.design)))
    if not low <= frequency <= high:
        more = (
            "a layer is missing or turns are shorted"
            if off < 0.0
            else "another capacitor, more turns or a longer cable"
        )
        return Verdict(name, NOT_MET, f"{seen}: {more}")
    stuck = len(rows) >= FEWEST and len({row.counts for row in rows[-FEWEST:]}) == 1
    if stuck:
        return Verdict(name, NOT_MET, f"{seen}: the last {FEWEST} results are the same to the bit: stuck")
    if jumps:
        return Verdict(name, NOT_MET, f"{seen}: {jumps} of {len(rows)} results far off: disturbed bus or clock")
    return Verdict(name, MET, seen)


def _amplitude(board: Board, coil: int, rows: Sequence[CoilReading]) -> Verdict:
    name, bad = f"{board.bands[coil].coil} amplitude", sum(row.is_off for row in rows)
    if not rows or any(row.status == WATCHDOG for row in rows):
        return Verdict(name, NOT_EVALUATED, "there is no oscillation")
    if bad:
        return Verdict(name, NOT_MET, f"outside of 1.2 to 1.8 V in {bad} of {len(rows)} results: losses or drive code")
    return Verdict(name, MET, "within 1.2 to 1.8 V")


def _noise(board: Board, coil: int, rows: Sequence[CoilReading]) -> Verdict:
    """The noise by second differences, which leave even motion out: by the median of their sizes, safe from jumps."""
    name, good = f"{board.bands[coil].coil} noise", [row.counts for row in rows if row.is_good]
    if len(good) < FEWEST:
        return Verdict(name, NOT_EVALUATED, f"{len(good)} good results, {FEWEST} are wanted")
    second = np.diff(np.array(good, dtype=float), 2)
    found = float(np.median(np.abs(second)) / 0.6745 / np.sqrt(6.0)) * board.frequency(1)
    wanted = board.conversion.noise(board.bands[coil].assembled.design)
    seen = f"{show(found, 'Hz', 3)} (one sigma), design {show(wanted, 'Hz', 3)}"
    if found > max(NOISY, 1.0 + FEW / np.sqrt(len(good))) * wanted:
        return Verdict(name, NOT_MET, f"{seen}: supply, clock or ground; or the target shakes")
    return Verdict(name, MET, seen)


def _rate(board: Board, readings: Sequence[Sequence[CoilReading]]) -> Verdict:
    wanted = board.design.estimates.readout.scan_rate
    if isinstance(board, LineBoard):
        wanted /= board.serial.scans_per_line
    counted = [(len(rows) - 1) / (rows[-1].time - rows[0].time) for rows in readings if len(rows) >= FEWEST]
    if not counted:
        return Verdict("rate", NOT_EVALUATED, f"fewer than {FEWEST} results of every coil")
    seen = f"{min(counted):.1f} a second, design {wanted:.1f}"
    if min(counted) < SLOW * wanted:
        return Verdict(
            "rate", NOT_MET, f"{seen}: a slow bus, a channel that does not oscillate, lost settings, or another clock"
        )
    return Verdict("rate", MET, seen)


def _order(board: Board) -> Verdict:
    """Whether coils are on their own channels: coils that are alike do not show it by themselves."""
    if len(board.bands) == 1:
        return Verdict("order of coils", MET, "there is one")
    return Verdict(
        "order of coils", NOT_EVALUATED, "coils of one design are alike: press over each and see which moves"
    )


def words(verdicts: Sequence[Verdict]) -> Iterator[str]:
    """A line a verdict."""
    width = max(len(one.name) for one in verdicts)
    for one in verdicts:
        yield f"{one.verdict:<14} {one.name:<{width}}  {one.said}"
