"""Registers of the XDC2214, which nobody makes: its data sheet XAC0001 is invented, and unlike TI's."""

from __future__ import annotations

from sitscad.kernels.converters.registers import ChannelSettings, Register

MANUFACTURER_ID, DEVICE_ID = 0x70, 0x71
STATUS = 0x60
MANUFACTURER = 0x5843
ORDER = "RUN comes last: it starts the scan"
DATA_FLAGS = {
    "FAULT_LOW": (0x8000, "too low"),
    "FAULT_HIGH": (0x4000, "too high"),
    "FAULT_STALL": (0x2000, "no oscillation"),
}


def data_addresses(channel: int, words: int) -> tuple[int, ...]:
    """Addresses of a channel's result."""
    return tuple(0x40 + 2 * channel + word for word in range(words))


def results_text(bits: int, words: tuple[str, ...], results_by: str, errors_by: str) -> str:
    """What the header says of results."""
    return f"all of them counts ({results_by}).\nFaults stand in the upper bits of {words[0]} ({errors_by})."


def registers(
    channels: tuple[ChannelSettings, ...],
    highest_sensor_frequency: float,
    external_clock: bool = True,
    high_current: bool = False,
    output_gain: int | None = None,
) -> tuple[Register, ...]:
    """Every register to write after reset."""
    result = []
    for number, channel in enumerate(channels):
        result += [
            Register(0x10 + number, f"WINDOW{number}", channel.rcount, f"window of {channel.rcount}"),
            Register(0x14 + number, f"SETTLE{number}", channel.settle_count, f"settling of {channel.settle_count}"),
            Register(0x18 + number, f"DIVIDE{number}", channel.input_divider << 8 | channel.reference_divider,
                     "dividers"),
            Register(0x1C + number, f"DRIVE{number}", channel.drive_code, f"drive code {channel.drive_code}"),
        ]
    return (*result, Register(0x01, "RUN", 1 | external_clock << 1, "wakes the device"))
