"""Scans of a board, one after the other; as lines, and as a table with what its numbers need."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence

import numpy as np

from sitscad.arrays import Array
from sitscad.bench.board import STALE, Board, CoilReading
from sitscad.bench.source import Source
from sitscad.calibration.inverse_map import InverseMap
from sitscad.estimates.performance.values import shown_scales
from sitscad.spec.places import map_columns
from sitscad.units import csv_text
from sitscad.version import __version__

Scan = dict[int, CoilReading]
"""The newest result of every coil, by its place in the design."""

LATE = 3.0
"""Times as long as a scan takes after which nobody waits for a coil any more."""


def scans(board: Board, source: Source, seconds: float) -> Iterator[Scan]:
    """Scans until the time of the source is over: whole ones; a result that comes again before its scan is whole is the
    next scan's, and of a converter with fewer coils than another, which is faster, older ones are left out. A scan that
    lacks a coil for `LATE` times as long as it ought to take comes without it. Converters that lost their settings are
    set up again. Raises OSError where one does not answer.
    """
    scan, ahead, rate, began = Scan(), Scan(), board.design.estimates.readout.scan_rate, 0.0
    while source.now() < seconds:
        new = board.poll(source.now())
        board.keep_settings(new)
        began = began if scan else source.now()
        for coil, reading in new.items():
            if coil in scan:
                scan[coil], ahead[coil] = ahead.get(coil, scan[coil]), reading
            else:
                scan[coil] = reading
        if len(scan) == len(board.bands) or (scan and source.now() - began > LATE / rate):
            yield scan
            scan, ahead, began = ahead, Scan(), source.now()
        source.wait(0.25 / rate)


TARES = 16
"""Whole scans whose mean is the tare, as in the examples of the driver in C and in live.html."""


class Forces:
    """Newtons of scans by maps and their tare, or the mean of the first `TARES` whole scans that it takes where
    `tared`; none without a map. Of cells each has a map that reads its own coils: axes then have these before them.
    """

    def __init__(self, maps: Sequence[InverseMap] = (), tared: bool = False) -> None:
        self.maps, self.tared = maps, tared
        self.mean: Array | None = None
        self.taken: list[Array] = []

    def take(self, board: Board, scan: Scan) -> None:
        """Take a scan for the tare, as long as one is wanted."""
        counts = _good(board, scan)
        if self.maps and self.tared and self.mean is None and counts is not None:
            self.taken.append(counts)
            self.mean = np.mean(self.taken, axis=0) if len(self.taken) == TARES else None

    def tare(self, board: Board) -> list[float | None] | None:
        """The counts of every coil with nothing on it, None where no map reads it; None before a tare, without maps."""
        if not self.maps or (self.tared and self.mean is None):
            return None
        if self.mean is not None:
            return list(map(float, self.mean))
        known = {name: float(rest) for one in self.maps for name, rest in zip(one.coils, one.rest, strict=True)}
        return [known.get(band.coil) for band in board.bands]

    def _read(self, board: Board, scan: Scan) -> Iterator[tuple[InverseMap, str, Array, Array]]:
        """Every map with what stands before its axes, the counts of its coils (1, coils), and those at rest."""
        counts = _good(board, scan)
        if counts is None or (self.tared and self.mean is None):
            return
        for one in self.maps:
            own, prefix = map_columns(board.design.spec, one.coils)
            yield one, prefix, counts[None, own], one.rest if self.mean is None else self.mean[own]

    def __call__(self, board: Board, scan: Scan) -> dict[str, float]:
        """Forces (N) by their axes; nothing where a coil has no good reading, or before the tare."""
        return {f"{prefix}{axis}": force for one, prefix, counts, rest in self._read(board, scan)
                for axis, force in zip(one.axes, one(counts, rest)[0].tolist(), strict=True)}

    def is_beyond(self, board: Board, scan: Scan) -> bool:
        """Whether a scan lies beyond what a map was made for: its forces are those where the map ends."""
        return not all(one.holds(counts, rest)[0] for one, _, counts, rest in self._read(board, scan))


def _good(board: Board, scan: Scan) -> Array | None:
    """The counts (coils) of a scan; none where a coil has no good reading."""
    if len(scan) < len(board.bands) or not all(one.is_good for one in scan.values()):
        return None
    return np.array([float(scan[k].counts) for k in range(len(board.bands))])


def _when(scan: Scan) -> float:
    """The time (s) of a scan: that of its last result."""
    return max(one.time for one in scan.values())


def lines(board: Board, rows: Sequence[Scan], newtons: Forces) -> Iterator[str]:
    """A line a scan."""
    for scan in rows:
        told = [f"{_when(scan):8.4f} s"]
        told += [
            f"{board.bands[k].coil} {board.frequency(one.counts) / 1e6:.6f} MHz {one.status}"
            for k, one in sorted(scan.items())
        ]
        found = newtons(board, scan)
        told += [f"{axis} {scale * force:+.4f} N{' mm' * bool(scale > 1.0)}"
                 for (axis, force), scale in zip(found.items(), shown_scales(tuple(found)), strict=True)]
        told += ["beyond the map: the force where it ends"] if newtons.is_beyond(board, scan) else []
        yield "  ".join(told)


def table(board: Board, rows: Sequence[Scan]) -> bytes:
    """A CSV file: time (s), and of every coil counts, frequency (Hz) and what is said of them; empty where a scan has
    no result of a coil.
    """
    names = [one.coil for one in board.bands]
    lines: list[list[object]] = [
        ["time_s", *(f"{name}_{what}" for name in names for what in ("counts", "Hz", "status"))]
    ]
    for scan in rows:
        row: list[object] = [f"{_when(scan):.6f}"]
        for k in range(len(names)):
            one = scan.get(k)
            row += ["", "", STALE] if one is None else [one.counts, f"{board.frequency(one.counts):.1f}", one.status]
        lines.append(row)
    return csv_text(lines).encode("utf-8")


def document(board: Board, source: str) -> bytes:
    """What the numbers of the table need: how counts become frequencies, and frequencies inductances."""
    conversion, readout = board.conversion, board.design.estimates.readout
    value = {
        "sitscad": __version__, "source": source, "sensor": board.design.spec.name,
        "coils": [one.coil for one in board.bands], "full_scale_Hz": conversion.full_scale,
        "count_bits": conversion.device.count_bits, "rcount": conversion.rcount, "scan_rate_Hz": readout.scan_rate,
        "conversion_capacitance_F": readout.conversion_capacitance,
    }
    return (json.dumps(value, indent=2) + "\n").encode("utf-8")
