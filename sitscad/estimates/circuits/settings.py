"""Register values for every converter of a sensor."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from itertools import pairwise

from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import CoilEstimate, ReadoutEstimate
from sitscad.kernels.converters.registers import Register
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.materials import CellsSpec
from sitscad.spec.sensor import ReadoutSpec


@record
class Device:
    """One converter of the sensor, with its register values.

    `bus` is the number of its I2C bus (from 0), and `address` its 7-bit address. `coils` are the coils on its channels,
    from channel 0. `registers` are in the order in which the firmware writes them.
    """

    bus: int
    address: int
    coils: tuple[str, ...]
    registers: tuple[Register, ...]


def devices(spec: ReadoutSpec, coils: tuple[CoilEstimate, ...], readout: ReadoutEstimate) -> tuple[Device, ...]:
    """Return the converters, on each bus in the order of their addresses. They share the coils evenly.

    Raises ValueError if a setting is unknown or does not fit its field, or if the buses have too few addresses. Raises
    it also if sitscad has no registers of the family.
    """
    converter = spec.device
    needed, most = converter.needed(len(coils)), spec.buses * len(converter.addresses)
    if needed > most:
        buses = "one I2C bus has" if spec.buses == 1 else f"{spec.buses} I2C buses have"
        raise ValueError(f"{needed} {converter.part} are needed, and {buses} addresses for {most}")
    conversion, code = readout.conversion, readout.drive_code
    if conversion is None or code is None:
        unknown = "conversion" if conversion is None else "drive_code"
        raise ValueError(f"{unknown} is unknown: the converter cannot be set up for this sensor")
    places, programmed = converter.places(len(coils)), []
    firsts = [k for k, at in enumerate(places) if at.number == 0]
    for first, end in pairwise([*firsts, len(coils)]):
        group = coils[first:end]
        frequencies = [state.frequency for coil in group for state in coil.states.values()]
        if not frequencies:
            raise ValueError("no sensor frequency is known: the converter cannot be set up")
        codes = readout.drive_codes[first:end] or (code,) * len(group)
        registers = conversion.registers(slice(first, end), codes, max(frequencies), readout.high_current)
        names = tuple(coil.name for coil in group)
        programmed.append(Device(places[first].bus, places[first].address, names, registers))
    return tuple(programmed)


BAUD_RATES = (115200, 500000, 1000000, 2000000)
"""Baud rates of the firmware's serial port. All are standard on Linux; all except the first divide a 16 MHz clock."""

MAX_LOAD = 0.9
"""Largest fraction of a serial port's capacity that readings may use."""


@record
class SerialSettings:
    """Baud rate of the firmware's serial port, and the number of scans of all coils after which it sends a line."""

    baud: int
    scans_per_line: int


def serial_settings(placements: tuple[CoilPlacement, ...], cells: CellsSpec | None, scan_rate: float) -> SerialSettings:
    """Return the lowest baud rate that carries a line of text for each scan (`scan_rate`, Hz).

    If no rate does, return the highest rate and the number of scans between two lines. A line of
    ``data/firmware/sensor_line.h`` has at most 26 characters, plus 12 for each coil and 11 for each force. A sensor
    without cells has three forces. A cell has at most as many forces as coils. Every hundredth line has a header of the
    same length. A character takes 10 bits.
    """
    coils = len(placements)
    forces = 3 if cells is None else coils // cells.coils * min(3, cells.coils)
    bits = 10.0 * 1.01 * (26 + 12 * coils + 11 * forces)
    needed = bits * scan_rate / MAX_LOAD
    baud = next((rate for rate in BAUD_RATES if rate >= needed), BAUD_RATES[-1])
    return SerialSettings(baud, max(math.ceil(needed / baud), 1))


def identity(sensor: str, programmed: Sequence[Device]) -> int:
    """Return a 32-bit number that identifies a board's serial lines.

    It is equal for equal names, coils and settings.
    """
    rows = [(device.coils, [(int(row.address), int(row.value)) for row in device.registers]) for device in programmed]
    return zlib.crc32(repr((sensor, rows)).encode())
