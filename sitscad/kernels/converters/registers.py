"""What is written into a converter, and what a module of registers must have: it stands in this room, and the row
``register_map`` of a family's figures names it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, cast

from sitscad.basics.record import record
from sitscad.kernels.converters.figures import family_module, names_of


@record
class ChannelSettings:
    """The settings of one channel; `offset` is taken from its conversions where results show a part of them."""

    rcount: int
    settle_count: int
    input_divider: int
    reference_divider: int
    drive_code: int
    offset: int = 0


@record
class Register:
    """One 16-bit write: address, name, value and what it sets."""

    address: int
    name: str
    value: int
    meaning: str


@record
class FirmwareText:
    """Wording of a conversion for the firmware's header.

    `clock` is a sentence about the clock; `frequency` the formula of the sensor's frequency; `constants` the numbers in
    it by name; `keys` the settings that the JSON has. `part` has the sizes of results that show a part of a conversion,
    by their JSON keys, and `part_by` the registers that choose it.
    """

    clock: str
    frequency: str
    constants: tuple[tuple[str, float], ...]
    keys: tuple[str, ...]
    part: Mapping[str, int]
    part_by: str


class RegisterMap(Protocol):
    """A module of registers: every name below is one of its own.

    ``MANUFACTURER_ID``, ``DEVICE_ID`` and ``STATUS`` are addresses, ``MANUFACTURER`` what the first of them holds.
    ``DATA_FLAGS`` are the error flags in the upper or only register of a result by name: mask and meaning.
    ``ORDER`` says in the header of the firmware what is to be known of the order of writing.
    """

    MANUFACTURER_ID: int
    DEVICE_ID: int
    STATUS: int
    MANUFACTURER: int
    DATA_FLAGS: dict[str, tuple[int, str]]
    ORDER: str

    def data_addresses(self, channel: int, words: int) -> tuple[int, ...]:
        """Addresses of a channel's result of so many registers, the upper one first."""

    def registers(
        self,
        channels: tuple[ChannelSettings, ...],
        highest_sensor_frequency: float,
        external_clock: bool = True,
        high_current: bool = False,
        output_gain: int | None = None,
    ) -> tuple[Register, ...]:
        """Every register to write after reset, in order; ValueError where a setting does not fit its field. The
        frequency is in Hz; `output_gain` is None for a converter whose results show all of a conversion.
        """

    def said_of_results(self, bits: int, words: tuple[str, ...], results_by: str, errors_by: str) -> str:
        """What the header says of results beside their bits, in lines: what their ends mean and when flags rise.
        `words` name the registers of a result, and what comes by which part of the data sheet is given.
        """


class DriverRegisters(RegisterMap, Protocol):
    """What the driver's twin in Python (``apps/hardware/bench_board.py``) takes of a module beside: addresses, and the
    bit of STATUS for an unread result of channel 0.
    """

    RESET_DEV: int
    DRIVE_CURRENT: int
    CONFIG: int
    UNREAD: int


def register_map(name: str) -> RegisterMap:
    """A module of registers of this room. Raises `DataError` where there is none, or it lacks a name."""
    return cast(RegisterMap, family_module("register_map", name, names_of(RegisterMap)))
