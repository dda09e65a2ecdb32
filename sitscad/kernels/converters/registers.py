"""Register settings of converters, and the names that a register module must define.

Register modules are in this folder. The row ``register_map`` of a family's figures names the module.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, cast

from sitscad.basics.record import record
from sitscad.kernels.converters.figures import family_module, names_of


@record
class ChannelSettings:
    """Settings of one channel.

    `offset` is subtracted from its conversions if results show only a part of a conversion.
    """

    rcount: int
    settle_count: int
    input_divider: int
    reference_divider: int
    drive_code: int
    offset: int = 0


@record
class Register:
    """Write of one 16-bit register: address, name, value and meaning."""

    address: int
    name: str
    value: int
    meaning: str


@record
class FirmwareText:
    """Text on a conversion for the firmware's header.

    Attributes
    ----------
    clock
        Sentence about the clock.
    frequency
        Formula of the sensor's frequency.
    constants
        Names and values of the numbers in the formula.
    keys
        JSON keys of the settings to state.
    part
        Sizes of results that show a part of a conversion, by JSON key.
    part_by
        Names of the registers that choose this part.
    """

    clock: str
    frequency: str
    constants: tuple[tuple[str, float], ...]
    keys: tuple[str, ...]
    part: Mapping[str, int]
    part_by: str


class RegisterMap(Protocol):
    """Names that a register module must define.

    ``MANUFACTURER_ID``, ``DEVICE_ID`` and ``STATUS`` are addresses. ``MANUFACTURER`` is the content of register
    MANUFACTURER_ID. ``DATA_FLAGS`` are the error flags in the upper or only register of a result, by name: mask and
    meaning. ``ORDER`` is the firmware header's text on the order of writing.
    """

    MANUFACTURER_ID: int
    DEVICE_ID: int
    STATUS: int
    MANUFACTURER: int
    DATA_FLAGS: dict[str, tuple[int, str]]
    ORDER: str

    def data_addresses(self, channel: int, count: int) -> tuple[int, ...]:
        """Return the addresses of a channel's result of `count` registers, the upper register first."""

    def registers(
        self,
        channels: tuple[ChannelSettings, ...],
        highest_sensor_frequency: float,
        external_clock: bool = True,
        high_current: bool = False,
        output_gain: int | None = None,
    ) -> tuple[Register, ...]:
        """Return every register to write after reset, in order.

        The frequency is in Hz. `output_gain` is None for a converter whose results show whole conversions. Raises
        ValueError if a setting does not fit its field.
        """

    def results_text(self, bits: int, names: tuple[str, ...], results_by: str, errors_by: str) -> str:
        """Return the header's text on results, in lines: their range, and the conditions of the flags.

        `bits` is the size of a result. `names` name the registers of a result. `results_by` and `errors_by` cite the
        data sheet on results and on errors.
        """


class DriverRegisters(RegisterMap, Protocol):
    """Further names that the driver's Python counterpart (``apps/hardware/bench_board.py``) needs of a module.

    They are addresses, and the bit of STATUS for an unread result of channel 0.
    """

    RESET_DEV: int
    DRIVE_CURRENT: int
    CONFIG: int
    UNREAD: int


def register_map(name: str) -> RegisterMap:
    """Return a register module of this folder. Raises `DataError` if there is none, or if it lacks a name."""
    return cast(RegisterMap, family_module("register_map", name, names_of(RegisterMap)))
