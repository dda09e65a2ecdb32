"""A sensor board on the test bench: its converters are set up and read like in the firmware's C driver.

`LineBoard` is a board that is read through a microcontroller. Its readings are lines of text on a serial port, in the
format of ``firmware/sensor_line.h``.
"""

from __future__ import annotations

import binascii
import re
from collections import deque
from collections.abc import Collection, Sequence
from time import monotonic
from typing import Protocol, cast

from sitscad.basics.record import record
from sitscad.calibration.unknowns import usual_value
from sitscad.estimates.circuits.settings import LEAP, STATUS, board_identity, devices, frequency_bands, serial_settings
from sitscad.estimates.design import Design
from sitscad.kernels.converters.registers import DriverRegisters

GOOD, STALE, UNDER_RANGE, OVER_RANGE, WATCHDOG, OUT_OF_BAND, AMPLITUDE = STATUS

NOTHING_NEW = 4
"""Number of polls without a new result after which a converter's registers are checked, as in the C driver."""


class BusConverter(Protocol):
    """Interface of a converter on a bus."""

    def read(self, register: int) -> int:
        """Return the 16 bits of a register. Raises OSError if the converter does not answer."""

    def write(self, register: int, value: int) -> None:
        """Write 16 bits to a register. Raises OSError if the converter does not answer."""


@record
class CoilReading:
    """One result of a coil: the `time` (s) of the reading, the converter's `counts`, and its status.

    ``is_off`` is True if the tank's amplitude was outside 1.2 to 1.8 V. `status` states only the most severe fault.
    """

    time: float
    counts: int
    status: str
    is_off: bool = False

    @property
    def is_good(self) -> bool:
        """Whether the counts can be used."""
        return self.status in (GOOD, AMPLITUDE)


class Board:
    """The converters of a design on a bus. `chips` are in the order of their numbers."""

    def __init__(self, design: Design, chips: Sequence[BusConverter]) -> None:
        self.design, self.chips, self.restarts = design, chips, 0
        self.devices = devices(design.spec.readout, design.estimates.all_coils, design.estimates.readout)
        self.bands = frequency_bands(design.estimates.all_coils, usual_value("coil_inductance"))
        conversion = design.estimates.readout.conversion
        assert conversion is not None
        self.conversion = conversion
        self.at = cast(DriverRegisters, design.spec.readout.device.register_map)
        self.places = design.spec.readout.device.coil_channels(len(self.bands))
        self.idle = [0] * len(chips)
        self.past: dict[int, tuple[int, int, int | None]] = {}

    @property
    def remark(self) -> str:
        """Remark on the readings. Empty if there is none."""
        again = f"a converter lost its settings and was set up again, {self.restarts} times"
        return again if self.restarts else ""

    def identities(self) -> list[tuple[int, int]]:
        """Return (manufacturer identifier, device identifier) of each converter."""
        return [(chip.read(self.at.MANUFACTURER_ID), chip.read(self.at.DEVICE_ID)) for chip in self.chips]

    def set_up(self) -> list[str]:
        """Reset each converter, write all registers, CONFIG last, and read them back.

        Return the names of registers that did not keep their value.
        """
        return [name for number in range(len(self.chips)) for name in self._set_up(number)]

    def _set_up(self, number: int) -> list[str]:
        chip, registers = self.chips[number], self.devices[number].registers
        chip.write(self.at.RESET_DEV, 1 << 15)
        for register in registers:
            chip.write(register.address, register.value)
        return [
            f"{register.name} of converter {number + 1}"
            for register in registers
            for mask in [0xF800 if self.at.DRIVE_CURRENT <= register.address < self.at.DRIVE_CURRENT + 4 else 0xFFFF]
            if (chip.read(register.address) ^ register.value) & mask
        ]

    def restore_lost_settings(self, new: Collection[int]) -> None:
        """Check the registers of idle converters after a poll. `new` holds the coils with a new result in this poll.

        A converter is checked after `NOTHING_NEW` polls without a new result. If it has lost its registers, it is set
        up again, and `restarts` is increased.
        """
        heard = {place.converter for k, place in enumerate(self.places) if k in new}
        for number in range(len(self.chips)):
            self.idle[number] = 0 if number in heard else self.idle[number] % NOTHING_NEW + 1
            if self.idle[number] == NOTHING_NEW and not self.is_configured(number):
                self._set_up(number)
                self.restarts += 1

    def is_configured(self, number: int) -> bool:
        """Whether the CONFIG register of converter `number` (from 0) still has the value of the design."""
        return self.chips[number].read(self.at.CONFIG) == self.devices[number].registers[-1].value

    def poll(self, time: float) -> dict[int, CoilReading]:
        """Return the new results by the coil's index in the design. They are stamped with `time` (s)."""
        results = {}
        for number, chip in enumerate(self.chips):
            status = chip.read(self.at.STATUS)
            for coil, place in enumerate(self.places):
                if place.converter == number and status & self.at.UNREAD >> place.number:
                    flags, counts = self._result(coil, chip)
                    off = bool(flags & self.at.DATA_FLAGS["ERR_AE"][0])
                    status_of_coil = self._status_after_jump_check(coil, counts, self.status(coil, counts, flags))
                    results[coil] = CoilReading(time, counts, status_of_coil, off)
        return results

    def _result(self, coil: int, chip: BusConverter) -> tuple[int, int]:
        """Return (upper register, counts) of a coil's result. The upper register also contains the error flags."""
        device, offsets = self.design.spec.readout.device, self.conversion.offsets
        upper, *lower = (chip.read(address) for address in device.data_addresses(self.places[coil].number))
        result = upper & device.result_mask
        for word in lower:
            result = result << 16 | word
        return upper, result * self.conversion.counts_per_step + (offsets[coil] if offsets else 0)

    def _status_after_jump_check(self, coil: int, counts: int, status: str) -> str:
        """Return the status of a result. A jump gets the status "stale" until the next result confirms it.

        A jump is a change larger than noise and motion explain, as in the C driver. Three values are stored for each
        coil: the last accepted result, its difference from the result before, and an unconfirmed result.
        """
        if status not in (GOOD, AMPLITUDE):
            self.past.pop(coil, None)  # the next result has no valid predecessor
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
        """Discard results that have not been read yet.

        A converter holds only its newest result, so this method does nothing.
        """

    def frequency(self, counts: float) -> float:
        """Return the frequency (Hz) of a coil from its counts."""
        return counts * self.conversion.hertz_per_count

    def status(self, coil: int, counts: int, flags: int) -> str:
        """Return the status of a result: the most severe fault that applies, or `GOOD`.

        Faults follow from the error flags, from counts at an end of their range, and from a frequency outside the
        coil's band.
        """
        flag, (least, most) = self.at.DATA_FLAGS, self.conversion.ends(coil)
        working = self.bands[coil].working
        conditions = (
            (flags & flag["ERR_WD"][0], WATCHDOG), (flags & flag["ERR_UR"][0] or counts == least, UNDER_RANGE),
            (flags & flag["ERR_OR"][0] or counts == most, OVER_RANGE),
            (not working.low <= self.frequency(counts) <= working.high, OUT_OF_BAND),
            (flags & flag["ERR_AE"][0], AMPLITUDE),
        )
        return next((name for is_so, name in conditions if is_so), GOOD)


PATIENCE = 8.0
"""Longest wait (s) for the first reading.

A microcontroller may start with a self-test and a tare when its port opens.
"""

ENOUGH = 3
"""Number of lines from another sensor after which waiting for the first reading ends."""

DRAINED = 100
"""Largest number of read calls to empty a port."""

LONGEST = 4096
"""Largest number of characters in a line. Longer input without a line end is discarded as corrupted."""

_READING = re.compile(rb"([0-9A-F]{8}),(\d{1,10}),(.*)")


class Port(Protocol):
    """Interface of a serial port."""

    in_waiting: int

    def read(self, size: int) -> bytes:
        """Return `size` bytes, or the bytes that arrived within the timeout."""


class LineBoard(Board):
    """A sensor board that is read through a microcontroller on a serial port.

    `lost`, `corrupted` and `another` count unusable lines: missing lines, lines with a wrong checksum, and lines of
    another sensor. `starts` counts restarts of the microcontroller. `comments` holds the last 8 comment lines ("#") of
    the firmware.
    """

    def __init__(self, design: Design, port: Port) -> None:
        super().__init__(design, ())
        self.port, self.rest, self.waiting = port, b"", deque[dict[int, tuple[int, int]]]()
        self.identity = board_identity(design.spec.name, self.devices)
        self.serial = serial_settings(design.spec.all_placements, design.spec.cells,
                                      design.estimates.readout.scan_rate)
        self.sequence: int | None = None
        self.good = self.lost = self.corrupted = self.another = self.starts = 0
        self.comments: deque[str] = deque(maxlen=8)
        self.is_first = True

    def poll(self, time: float) -> dict[int, CoilReading]:
        """Return the results of the next line.

        Empty if no complete line has arrived. Raises OSError if the port has been removed.
        """
        self.process_bytes(self.port.read(self.port.in_waiting or 1))
        if not self.waiting:
            return {}
        return {
            coil: CoilReading(time, counts, STATUS[status], STATUS[status] == STATUS[-1])
            for coil, (counts, status) in self.waiting.popleft().items()
        }

    def skip(self) -> None:
        """Discard unread lines. Lines that did not fit into the port's buffer do not count as lost."""
        for _ in range(DRAINED):
            if not self.port.in_waiting:
                break
            self.port.read(self.port.in_waiting)
        self.waiting.clear()
        self.rest, self.is_first, self.sequence = b"", True, None

    def process_bytes(self, received: bytes) -> None:
        """Add received bytes, and process all complete lines."""
        *lines, self.rest = (self.rest + received).split(b"\n")
        for line in lines:
            self._process_line(line.strip())
            self.is_first = False
        if len(self.rest) > LONGEST:
            self.corrupted, self.rest = self.corrupted + 1, b""

    def _process_line(self, line: bytes) -> None:
        text, star, check = line.rpartition(b"*")
        if line.startswith(b"#"):
            self.comments.append(line[1:].decode("ascii", "replace").strip())
        elif not line:
            return
        elif not star or not re.fullmatch(rb"[0-9A-F]{4}", check) or int(check, 16) != binascii.crc_hqx(text, 0xFFFF):
            self.corrupted += not self.is_first  # the first line may be incomplete
        elif not text.startswith(b"id,"):
            self._process_reading(text)

    def _process_reading(self, text: bytes) -> None:
        match, number = _READING.fullmatch(text), 2 * len(self.bands)
        cells = match[3].split(b",")[:number] if match else []
        if match and int(match[1], 16) != self.identity:
            self.another += 1
        elif match is None or len(cells) < number or not all(cell.isdigit() and len(cell) <= 10 for cell in cells):
            self.corrupted += 1
        else:
            values = [int(cell) for cell in cells]
            self._count_line(int(match[2]))
            self.waiting.append({
                k: (values[2 * k], values[2 * k + 1] if values[2 * k + 1] < len(STATUS) else STATUS.index(STALE))
                for k in range(len(self.bands))
            })

    def _count_line(self, sequence: int) -> None:
        """Count a valid line by its sequence number.

        Skipped numbers count as lost lines. A lower number than before is a restart of the microcontroller.
        """
        self.good += 1
        if self.sequence is not None and sequence > self.sequence:
            self.lost += sequence - self.sequence - 1
        elif self.sequence is not None:
            self.starts += 1
        self.sequence = sequence

    @property
    def remark(self) -> str:
        """Text with the numbers of valid, lost, corrupted and foreign lines."""
        counted = ((self.lost, "lost"), (self.corrupted, "corrupted"), (self.another, "of another sensor"),
                   (self.starts, "starts of the microcontroller"))
        texts = [f"{self.good} lines", *(f"{number} {what}" for number, what in counted if number)]
        return ", ".join(texts if len(texts) > 1 else [*texts, "none lost or corrupted"])

    def wait_for_first_reading(self) -> None:
        """Wait for the first reading. Raises OSError if no reading of this sensor arrives within `PATIENCE`."""
        end = monotonic() + PATIENCE
        while not self.good and monotonic() < end and self.another < ENOUGH:
            self.process_bytes(self.port.read(self.port.in_waiting or 1))
        if self.good:
            return
        last = f"; the firmware said: {self.comments[-1]}" if self.comments else ""
        if self.another:
            raise OSError(f"the lines are of another sensor, or of other settings than {self.identity:08X}{last}")
        raise OSError(f"no readable line arrived, {self.corrupted} lines were corrupted: check the port, the "
                      f"firmware and the baud rate ({self.serial.baud}){last}")
