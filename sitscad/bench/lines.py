"""A board behind a microcontroller: readings as lines on a serial port, as ``firmware/sensor_line.h`` makes them."""

from __future__ import annotations

import binascii
import re
from collections import deque
from time import monotonic
from typing import Protocol

from sitscad.bench.board import STALE, Board, CoilReading
from sitscad.design import Design
from sitscad.estimates.circuit.bands import STATUS
from sitscad.estimates.circuit.settings import identity

BAUD = 115_200
"""What the sketch sets, where the port does not say."""

PATIENCE = 8.0
"""Seconds until the first reading: a board that starts as its port is opened, its self-test and its tare."""

ENOUGH = 3
"""Lines of another sensor after which none of this one is waited for."""

DRAINED = 100
"""Times at most that a port is asked for what is left on it."""

LONGEST = 4096
"""Characters after which what has no end of line is no line."""

_READING = re.compile(rb"([0-9A-F]{8}),(\d{1,10}),(.*)")


class Port(Protocol):
    """As much of a serial port as is asked for."""

    in_waiting: int

    def read(self, size: int) -> bytes:
        """So many bytes, or what came within the timeout."""


def checksum(text: bytes) -> int:
    """CRC-16 CCITT from 0xFFFF."""
    return binascii.crc_hqx(text, 0xFFFF)


class LineBoard(Board):
    """The board of a design that a microcontroller reads. What is on the line but is not to be used is counted by what
    it is: `lost`, `corrupted`, of `another` sensor; `told` is what the firmware says to people, the latest last.
    """

    def __init__(self, design: Design, port: Port) -> None:
        super().__init__(design, ())
        self.port, self.rest, self.waiting = port, b"", deque[dict[int, tuple[int, int]]]()
        self.identity = identity(design.spec.name, self.devices)
        self.sequence: int | None = None
        self.good = self.lost = self.corrupted = self.another = self.starts = 0
        self.told: deque[str] = deque(maxlen=8)
        self.is_first = True

    def poll(self, time: float) -> dict[int, CoilReading]:
        """The coils of the next line; none where no whole one has come. Raises OSError where the port is gone."""
        self.take(self.port.read(self.port.in_waiting or 1))
        if not self.waiting:
            return {}
        return {
            coil: CoilReading(time, counts, STATUS[status], STATUS[status] == STATUS[-1])
            for coil, (counts, status) in self.waiting.popleft().items()
        }

    def skip(self) -> None:
        """Leave behind the lines that came while nobody read; what the port's buffer did not hold is not lost."""
        for _ in range(DRAINED):
            if not self.port.in_waiting:
                break
            self.port.read(self.port.in_waiting)
        self.waiting.clear()
        self.rest, self.is_first, self.sequence = b"", True, None

    def take(self, received: bytes) -> None:
        """Take up what came from the port."""
        *lines, self.rest = (self.rest + received).split(b"\n")
        for line in lines:
            self._take(line.strip())
            self.is_first = False
        if len(self.rest) > LONGEST:
            self.corrupted, self.rest = self.corrupted + 1, b""

    def _take(self, line: bytes) -> None:
        text, star, check = line.rpartition(b"*")
        if line.startswith(b"#"):
            self.told.append(line[1:].decode("ascii", "replace").strip())
        elif not line:
            return
        elif not star or not re.fullmatch(rb"[0-9A-F]{4}", check) or int(check, 16) != checksum(text):
            self.corrupted += not self.is_first  # the first is what was left of one that began before
        elif not text.startswith(b"id,"):
            self._reading(text)

    def _reading(self, text: bytes) -> None:
        found, number = _READING.fullmatch(text), 2 * len(self.bands)
        cells = found[3].split(b",")[:number] if found else []
        if found and int(found[1], 16) != self.identity:
            self.another += 1
        elif found is None or len(cells) < number or not all(cell.isdigit() and len(cell) <= 10 for cell in cells):
            self.corrupted += 1
        else:
            values = [int(cell) for cell in cells]
            self._count(int(found[2]))
            self.waiting.append({
                k: (values[2 * k], values[2 * k + 1] if values[2 * k + 1] < len(STATUS) else STATUS.index(STALE))
                for k in range(len(self.bands))
            })

    def _count(self, sequence: int) -> None:
        """Lines between the last and this one are lost; one that goes back is a start of the microcontroller."""
        self.good += 1
        if self.sequence is not None and sequence > self.sequence:
            self.lost += sequence - self.sequence - 1
        elif self.sequence is not None:
            self.starts += 1
        self.sequence = sequence

    @property
    def said(self) -> str:
        """What came over the line, in words."""
        counted = ((self.lost, "lost"), (self.corrupted, "corrupted"), (self.another, "of another sensor"),
                   (self.starts, "starts of the microcontroller"))
        words = [f"{self.good} lines", *(f"{number} {what}" for number, what in counted if number)]
        return ", ".join(words if len(words) > 1 else [*words, "none lost or corrupted"])

    def begin(self) -> None:
        """Wait for the first line of a reading. Raises OSError where none of this sensor's comes within `PATIENCE`."""
        end = monotonic() + PATIENCE
        while not self.good and monotonic() < end and self.another < ENOUGH:
            self.take(self.port.read(self.port.in_waiting or 1))
        if self.good:
            return
        last = f"; the firmware said: {self.told[-1]}" if self.told else ""
        if self.another:
            raise OSError(f"the lines are of another sensor, or of other settings than {self.identity:08X}{last}")
        raise OSError(f"no line of a reading came, {self.corrupted} were no such: port, baud, firmware{last}")
