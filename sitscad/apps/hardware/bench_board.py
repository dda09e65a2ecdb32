"""A board on the bench: its converters set up and read, as the driver in C does it, over any bus; or a microcontroller
before them, whose readings are lines on a serial port, as ``firmware/sensor_line.h`` makes them.
"""

from __future__ import annotations

import binascii
import re
from collections import deque
from collections.abc import Collection, Sequence
from time import monotonic
from typing import Protocol, cast

from sitscad.basics.record import record
from sitscad.calibration.unknowns import usual
from sitscad.estimates.circuits.bands import LEAP, STATUS, bands
from sitscad.estimates.circuits.settings import devices, identity, serial_settings
from sitscad.estimates.design import Design
from sitscad.kernels.converters.registers import DriverRegisters

GOOD, STALE, UNDER_RANGE, OVER_RANGE, WATCHDOG, OUT_OF_BAND, AMPLITUDE = STATUS

NOTHING_NEW = 4
"""Polls without anything new after which a converter is asked for its settings, as the driver in C does."""


class BusConverter(Protocol):
    """A converter on a bus."""

    def read(self, register: int) -> int:
        """A register's 16 bits; raises OSError without an answer."""

    def write(self, register: int, value: int) -> None:
        """Write 16 bits; raises OSError without an answer."""


@record
class CoilReading:
    """One result of a coil: when it was read (s), its counts, what is said of it, and whether its oscillation was
    outside of 1.2 to 1.8 V, which a fault hides in the status.
    """

    time: float
    counts: int
    status: str
    is_off: bool = False

    @property
    def is_good(self) -> bool:
        """Whether the counts hold."""
        return self.status in (GOOD, AMPLITUDE)


class Board:
    """The converters of a design, by `chips` in the order of their numbers."""

    def __init__(self, design: Design, chips: Sequence[BusConverter]) -> None:
        self.design, self.chips, self.restarts = design, chips, 0
        self.devices = devices(design.spec.readout, design.estimates.coils, design.estimates.readout)
        self.bands = bands(design.estimates.coils, usual("coil_inductance"))
        conversion = design.estimates.readout.conversion
        assert conversion is not None
        self.conversion = conversion
        self.at = cast(DriverRegisters, design.spec.readout.device.register_map)
        self.places = design.spec.readout.device.places(len(self.bands))
        self.idle = [0] * len(chips)
        self.past: dict[int, tuple[int, int, int | None]] = {}

    @property
    def said(self) -> str:
        """How its readings came, in words, where there is something to say."""
        again = f"a converter lost its settings and was set up again, {self.restarts} times"
        return again if self.restarts else ""

    def identities(self) -> list[tuple[int, int]]:
        """What every converter calls its maker and itself."""
        return [(chip.read(self.at.MANUFACTURER_ID), chip.read(self.at.DEVICE_ID)) for chip in self.chips]

    def set_up(self) -> list[str]:
        """Reset, write and read back every register, CONFIG last; the names of those that do not keep their value."""
        return [name for number in range(len(self.chips)) for name in self._set_up(number)]

    def _set_up(self, number: int) -> list[str]:
        chip, registers = self.chips[number], self.devices[number].registers
        chip.write(self.at.RESET_DEV, 1 << 15)
        for register in registers:
            chip.write(register.address, register.value)
        return [
            f"{register.name} of converter {number + 1}"
            for register in registers
            for kept in [0xF800 if self.at.DRIVE_CURRENT <= register.address < self.at.DRIVE_CURRENT + 4 else 0xFFFF]
            if (chip.read(register.address) ^ register.value) & kept
        ]

    def keep_settings(self, new: Collection[int]) -> None:
        """Look after settings once a poll found these coils new: ask a converter that had nothing new for
        `NOTHING_NEW` polls for its settings, set up again one that lost them, and count it.
        """
        heard = {place.converter for k, place in enumerate(self.places) if k in new}
        for number in range(len(self.chips)):
            self.idle[number] = 0 if number in heard else self.idle[number] % NOTHING_NEW + 1
            if self.idle[number] == NOTHING_NEW and not self.is_set(number):
                self._set_up(number)
                self.restarts += 1

    def is_set(self, number: int) -> bool:
        """Whether a converter still has its settings."""
        return self.chips[number].read(self.at.CONFIG) == self.devices[number].registers[-1].value

    def poll(self, time: float) -> dict[int, CoilReading]:
        """The coils that are new, by their place in the design."""
        found = {}
        for number, chip in enumerate(self.chips):
            status = chip.read(self.at.STATUS)
            for coil, place in enumerate(self.places):
                if place.converter == number and status & self.at.UNREAD >> place.number:
                    flags, counts = self._result(coil, chip)
                    off = bool(flags & self.at.DATA_FLAGS["ERR_AE"][0])
                    said = self._believed(coil, counts, self.status(coil, counts, flags))
                    found[coil] = CoilReading(time, counts, said, off)
        return found

    def _result(self, coil: int, chip: BusConverter) -> tuple[int, int]:
        """The upper register of a coil's result, where its flags are, and the counts of the whole."""
        device, offsets = self.design.spec.readout.device, self.conversion.offsets
        upper, *lower = (chip.read(address) for address in device.data_addresses(self.places[coil].number))
        result = upper & device.result_mask
        for word in lower:
            result = result << 16 | word
        return upper, result * self.conversion.counts_per_step + (offsets[coil] if offsets else 0)

    def _believed(self, coil: int, counts: int, status: str) -> str:
        """The status of a result, stale where it leaps by more than noise and motion explain and the next has yet to
        confirm it, as in the driver. Of each coil is kept: the last that was believed, how far that was from the one
        before, and one that is in doubt.
        """
        if status not in (GOOD, AMPLITUDE):
            self.past.pop(coil, None)  # what comes after a fault has nothing to be compared with
            return status
        leap = LEAP * self.conversion.noise(self.bands[coil].assembled.design) / self.frequency(1)
        last, step, doubted = self.past.get(coil, (counts, 0, None))
        is_near = abs(counts - last) <= leap + 2 * step
        if not is_near and (doubted is None or abs(counts - doubted) > leap + abs(doubted - last)):
            self.past[coil] = last, step, counts
            return STALE
        self.past[coil] = counts, abs(counts - (last if doubted is None else doubted)), None
        return status

    def skip(self) -> None:
        """Leave behind what came while nobody read: a converter keeps its newest result alone."""

    def frequency(self, counts: float) -> float:
        """Hz."""
        return counts * self.conversion.hertz_per_count

    def status(self, coil: int, counts: int, flags: int) -> str:
        """What is said of a result with the flags of its upper register."""
        flag, (least, most) = self.at.DATA_FLAGS, self.conversion.ends(coil)
        working = self.bands[coil].working
        said = (
            (flags & flag["ERR_WD"][0], WATCHDOG), (flags & flag["ERR_UR"][0] or counts == least, UNDER_RANGE),
            (flags & flag["ERR_OR"][0] or counts == most, OVER_RANGE),
            (not working.low <= self.frequency(counts) <= working.high, OUT_OF_BAND),
            (flags & flag["ERR_AE"][0], AMPLITUDE),
        )
        return next((name for is_so, name in said if is_so), GOOD)


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
    """The part of a serial port that is asked for."""

    in_waiting: int

    def read(self, size: int) -> bytes:
        """So many bytes, or what came within the timeout."""


class LineBoard(Board):
    """The board of a design that a microcontroller reads. What is on the line but is not to be used is counted by what
    it is: `lost`, `corrupted`, of `another` sensor; `told` is what the firmware says to people, the latest last.
    """

    def __init__(self, design: Design, port: Port) -> None:
        super().__init__(design, ())
        self.port, self.rest, self.waiting = port, b"", deque[dict[int, tuple[int, int]]]()
        self.identity = identity(design.spec.name, self.devices)
        self.serial = serial_settings(design.spec.array.placements, design.spec.cells,
                                      design.estimates.readout.scan_rate)
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
        elif not star or not re.fullmatch(rb"[0-9A-F]{4}", check) or int(check, 16) != binascii.crc_hqx(text, 0xFFFF):
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
        raise OSError(f"no readable line arrived, {self.corrupted} lines were corrupted: check the port, the "
                      f"firmware and the baud rate ({self.serial.baud}){last}")
