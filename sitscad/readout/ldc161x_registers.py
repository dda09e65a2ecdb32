"""Registers of LDC1612 and LDC1614, packed bit by bit (data sheet SNOSCY9A, 7.6 and tables 47 and 48)."""

from __future__ import annotations

from collections.abc import Mapping

from sitscad.readout.family import ChannelSettings, Identity, Register

MOST_CHANNELS = 4
"""Channels that the registers have addresses for."""

RCOUNT, SETTLECOUNT, CLOCK_DIVIDERS, DRIVE_CURRENT = 0x08, 0x10, 0x14, 0x1E
ERROR_CONFIG, CONFIG, MUX_CONFIG = 0x19, 0x1A, 0x1B

_DATA_FLAGS = {
    "ERR_UR": (0x8000, "conversion under-range"),
    "ERR_OR": (0x4000, "conversion over-range"),
    "ERR_WD": (0x2000, "watchdog timeout: the sensor does not oscillate"),
    "ERR_AE": (0x1000, "amplitude outside about 1.2 to 1.8 V"),
}
"""Error flags in DATAx_MSB by name: mask and meaning (SNOSCY9A, 7.6.2 to 7.6.9; nominal amplitudes: STATUS, 7.6.26)."""


def identity() -> Identity:
    """Identifiers of the maker and of LDC1612 and LDC1614 (alike), and STATUS (SNOSCY9A, 7.6)."""
    return Identity(0x5449, 0x7E, 0x3055, 0x7F, 0x18)


def data_flags() -> Mapping[str, tuple[int, str]]:
    """Error flags in DATAx_MSB by name: mask and meaning."""
    return _DATA_FLAGS


def data_mask() -> int:
    """Bits 27:16 of the result in DATAx_MSB (SNOSCY9A, 7.6.2)."""
    return 0x0FFF


def data_addresses(channel: int) -> tuple[int, int]:
    """Addresses of DATAx_MSB and DATAx_LSB, to be read in this order (SNOSCY9A, 7.6.2 to 7.6.9)."""
    _within("channel", channel, 0, MOST_CHANNELS - 1)
    return 2 * channel, 2 * channel + 1


_DEGLITCH = ((1.0e6, 0b001), (3.3e6, 0b100), (10.0e6, 0b101))
_DEGLITCH_WIDEST = 0b111
_MUX_RESERVED = 0b00_0100_0001 << 3
_CONFIG_RESERVED = 0b00_0001


def deglitch(highest_sensor_frequency: float) -> int:
    """DEGLITCH field: the narrowest input filter above the highest sensor frequency (Hz).

    0b111 is 33 MHz by table 28 and its reset value; table 45's 0b011 is a misprint.
    """
    return next((bits for edge, bits in _DEGLITCH if highest_sensor_frequency < edge), _DEGLITCH_WIDEST)


def clock_dividers(input_divider: int, reference_divider: int) -> int:
    """CLOCK_DIVIDERSx: FIN_DIVIDER (1 to 15) in bits 15:12, FREF_DIVIDER (1 to 1023) in bits 9:0."""
    _within("FIN_DIVIDER", input_divider, 1, 15)
    _within("FREF_DIVIDER", reference_divider, 1, 1023)
    return input_divider << 12 | reference_divider


def drive_current_field(code: int) -> int:
    """DRIVE_CURRENTx: the code (0 to 31) in bits 15:11, the rest 0."""
    _within("IDRIVE", code, 0, 31)
    return code << 11


def mux_config(channels: int, highest_sensor_frequency: float) -> int:
    """MUX_CONFIG: one channel converts continuously; two, three or four are scanned in turn (channels 0 up)."""
    _within("channels", channels, 1, MOST_CHANNELS)
    scan = 0 if channels == 1 else 1 << 15 | (channels - 2) << 13
    return scan | _MUX_RESERVED | deglitch(highest_sensor_frequency)


def config(
    active_channel: int = 0,
    sleep: bool = False,
    external_clock: bool = True,
    high_current: bool = False,
    interrupt_pin: bool = True,
) -> int:
    """CONFIG: fixed drive current (RP_OVERRIDE_EN, AUTO_AMP_DIS set), full current while the sensor starts."""
    _within("ACTIVE_CHAN", active_channel, 0, MOST_CHANNELS - 1)
    if high_current and active_channel != 0:
        raise ValueError("the high-current drive exists on channel 0 only")
    return (
        active_channel << 14
        | sleep << 13
        | 1 << 12
        | 1 << 10
        | external_clock << 9
        | (not interrupt_pin) << 7
        | high_current << 6
        | _CONFIG_RESERVED
    )


def registers(
    channels: tuple[ChannelSettings, ...],
    highest_sensor_frequency: float,
    external_clock: bool = True,
    high_current: bool = False,
    error_config: int = 0x0000,
) -> tuple[Register, ...]:
    """Every register to write after reset, in order; CONFIG comes last, because it wakes the device (tables 47, 48).

    `channels` are channels 0 up, one to four; `highest_sensor_frequency` is in Hz, over all channels and states.
    Raises ValueError where a setting does not fit its field, or for the high-current drive with several channels.
    """
    count = len(channels)
    _within("channels", count, 1, MOST_CHANNELS)
    if high_current and count > 1:
        raise ValueError("the high-current drive works in single-channel mode only")
    numbered = tuple(enumerate(channels))
    return (
        *(_rcount(n, c) for n, c in numbered),
        *(_settle_count(n, c) for n, c in numbered),
        *(_clock_dividers(n, c) for n, c in numbered),
        Register(ERROR_CONFIG, "ERROR_CONFIG", error_config, "which errors are reported, and where"),
        Register(MUX_CONFIG, "MUX_CONFIG", mux_config(count, highest_sensor_frequency), _mux_meaning(count)),
        *(_drive(n, c) for n, c in numbered),
        Register(
            CONFIG,
            "CONFIG",
            config(external_clock=external_clock, high_current=high_current),
            "wakes the device: fixed drive current, full current while starting, "
            + ("external" if external_clock else "internal")
            + " clock"
            + (", high-current drive" if high_current else ""),
        ),
    )


def _rcount(number: int, channel: ChannelSettings) -> Register:
    _within("RCOUNT", channel.rcount, 9, 0xFFFF)
    meaning = f"conversion of 16 x {channel.rcount} + 4 reference periods"
    return Register(RCOUNT + number, f"RCOUNT{number}", channel.rcount, meaning)


def _settle_count(number: int, channel: ChannelSettings) -> Register:
    _within("SETTLECOUNT", channel.settle_count, 4, 0xFFFF)
    meaning = f"settling for 16 x {channel.settle_count} reference periods"
    return Register(SETTLECOUNT + number, f"SETTLECOUNT{number}", channel.settle_count, meaning)


def _clock_dividers(number: int, channel: ChannelSettings) -> Register:
    value = clock_dividers(channel.input_divider, channel.reference_divider)
    meaning = f"FIN_DIVIDER {channel.input_divider}, FREF_DIVIDER {channel.reference_divider}"
    return Register(CLOCK_DIVIDERS + number, f"CLOCK_DIVIDERS{number}", value, meaning)


def _drive(number: int, channel: ChannelSettings) -> Register:
    value = drive_current_field(channel.drive_code)
    return Register(DRIVE_CURRENT + number, f"DRIVE_CURRENT{number}", value, f"drive current code {channel.drive_code}")


def _mux_meaning(count: int) -> str:
    how = "continuous conversion of channel 0" if count == 1 else f"scan of channels 0 to {count - 1}"
    return f"{how}, input filter above the highest sensor frequency"


def _within(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}; it must lie in {low} to {high}")
