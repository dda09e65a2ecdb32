"""What is written into every converter of a sensor, register by register."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from sitscad.estimates.values import CoilEstimate, Estimates, ReadoutEstimate
from sitscad.readout.converter import ChannelSettings, Converter, Register
from sitscad.record import record
from sitscad.spec.sensor import ReadoutSpec


@record
class Device:
    """One converter of the sensor: its I2C bus (from 0) and 7-bit address, the coils on its channels 0 up, and what to
    write in order.
    """

    bus: int
    address: int
    coils: tuple[str, ...]
    registers: tuple[Register, ...]


def devices(asked: ReadoutSpec, estimates: Estimates) -> tuple[Device, ...]:
    """The converters, filled one after the other: of each bus the first at the address with ADDR low, the second with
    ADDR high.

    Raises ValueError where a setting is unknown or does not fit its field, and where the buses have not as many
    addresses.
    """
    converter, coils = asked.device, estimates.coils
    needed, most = converter.needed(len(coils)), asked.buses * len(converter.addresses)
    if needed > most:
        buses = "one I2C bus has" if asked.buses == 1 else f"{asked.buses} I2C buses have"
        raise ValueError(f"{needed} {converter.part} are needed, and {buses} addresses for {most}")
    places = converter.places(len(coils))
    firsts = [k for k, at in enumerate(places) if at.number == 0]
    groups = [coils[first:end] for first, end in pairwise([*firsts, len(coils)])]
    return tuple(
        Device(places[first].bus, places[first].address, tuple(coil.name for coil in group),
               _registers(converter, group, first, estimates.readout))
        for first, group in zip(firsts, groups, strict=True)
    )


def identity(sensor: str, found: Sequence[Device]) -> int:
    """A number of 32 bits by which serial lines of boards tell themselves apart: the same for one name, the same coils
    and settings.
    """
    rows = [(one.coils, [(int(row.address), int(row.value)) for row in one.registers]) for one in found]
    return zlib.crc32(repr((sensor, rows)).encode())


def _registers(
    converter: Converter, coils: Sequence[CoilEstimate], first: int, readout: ReadoutEstimate
) -> tuple[Register, ...]:
    """What to write for the coils of one converter, the first of them being the number `first` of all."""
    channel = ChannelSettings(
        rcount=_known("rcount", readout.rcount),
        settle_count=_known("settle_count", readout.settle_count),
        input_divider=_known("input_divider", readout.input_divider),
        reference_divider=_known("reference_divider", readout.reference_divider),
        drive_code=_known("drive_code", readout.drive_code),
    )
    frequencies = [state.frequency for coil in coils for state in coil.states.values() if state.frequency is not None]
    if not frequencies:
        raise ValueError("no sensor frequency is known: the converter cannot be set up")
    codes = readout.drive_codes[first : first + len(coils)] or (channel.drive_code,) * len(coils)
    offsets = readout.offsets[first : first + len(coils)] or (0,) * len(coils)
    channels = tuple(
        replace(channel, drive_code=code, offset=offset) for code, offset in zip(codes, offsets, strict=True)
    )
    return converter.registers(
        channels, max(frequencies), high_current=readout.high_current, output_gain=readout.output_gain
    )


def _known(name: str, value: int | None) -> int:
    if value is None:
        raise ValueError(f"{name} is unknown: the converter cannot be set up for this sensor")
    return value
