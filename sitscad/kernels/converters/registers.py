"""Register settings of converters, and the names that a register module must define.

Register modules are in this folder. The row ``register_map`` in a family's data file names the module.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, cast

from sitscad.basics.record import record
from sitscad.kernels.converters.figures import family_module, required_names


@record
class ChannelSettings:
    """Register settings of one channel of a converter.

    `rcount` sets the conversion time and `settle_count` the settling time. `input_divider` and `reference_divider`
    divide sensor frequency and clock. `drive_code` is the code of the drive current. `offset` is subtracted from
    conversions if a result has only some of their bits, else it is 0.
    """

    rcount: int
    settle_count: int
    input_divider: int
    reference_divider: int
    drive_code: int
    offset: int = 0


@record
class Register:
    """Value to write to one 16-bit register: address, name, value and meaning."""

    address: int
    name: str
    value: int
    meaning: str


@record
class FirmwareText:
    """Texts about a conversion in the header file of the firmware.

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

    ``MANUFACTURER_ID``, ``DEVICE_ID`` and ``STATUS`` are register addresses. ``MANUFACTURER`` is the content of
    register MANUFACTURER_ID. ``DATA_FLAGS`` are the error flags in the upper or only register of a result, by name:
    mask and meaning. ``ORDER`` is the text on the order of writing in the firmware's header file.
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
        """Return every register to write after reset, in the order of writing.

        The frequency is in Hz. `output_gain` is the code of the register field that chooses which bits of a conversion
        the result has. It is None for a converter whose result has all bits (LDC1612, LDC1614). Raises ValueError if a
        setting does not fit its field.
        """

    def results_text(self, bits: int, names: tuple[str, ...], results_by: str, errors_by: str) -> str:
        """Return the firmware header's text on results, in lines: range of results, and conditions of the error flags.

        `bits` is the size of a result. `names` name the registers of a result. `results_by` and `errors_by` cite the
        data sheet on results and on errors.
        """


class DriverRegisters(RegisterMap, Protocol):
    """Further names that a register module needs for the Python version of the driver.

    The Python version is ``apps/hardware/bench_board.py``. RESET_DEV, DRIVE_CURRENT and CONFIG are register addresses,
    UNREAD is the bit of STATUS for an unread result of channel 0.
    """

    RESET_DEV: int
    DRIVE_CURRENT: int
    CONFIG: int
    UNREAD: int


def register_map(name: str) -> RegisterMap:
    """Return the register module with a given name. Raises `DataError` if there is none, or if it lacks a name."""
    return cast(RegisterMap, family_module("register_map", name, required_names(RegisterMap)))
