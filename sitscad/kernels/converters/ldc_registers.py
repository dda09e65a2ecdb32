"""Registers of LDC1312 to LDC1614, packed bit by bit (data sheets SNOSCY9A and SNOSCZ0A, 7.6 and 8.2.5)."""

from __future__ import annotations

from sitscad.kernels.converters.registers import ChannelSettings, Register

MOST_CHANNELS = 4
"""Largest number of channels of a converter with these registers."""

RCOUNT, OFFSET, SETTLECOUNT, CLOCK_DIVIDERS, DRIVE_CURRENT = 0x08, 0x0C, 0x10, 0x14, 0x1E
STATUS, ERROR_CONFIG, CONFIG, MUX_CONFIG, RESET_DEV = 0x18, 0x19, 0x1A, 0x1B, 0x1C
MANUFACTURER_ID, DEVICE_ID = 0x7E, 0x7F

MANUFACTURER = 0x5449
"""Content of register MANUFACTURER_ID: the letters TI."""

DATA_FLAGS = {
    "ERR_UR": (0x8000, "conversion under-range"),
    "ERR_OR": (0x4000, "conversion over-range"),
    "ERR_WD": (0x2000, "watchdog timeout: the sensor does not oscillate"),
    "ERR_AE": (0x1000, "amplitude outside about 1.2 to 1.8 V"),
}
"""Error flags in the upper or only register of a result, by name: mask and meaning.

The nominal amplitudes are from the description of register STATUS.
"""

WATCHDOG_RECOVERY = 5.2e-3
"""Time (s) after which the watchdog ends a conversion without oscillation (TI SNOSCY9A, 6.5: sensor recovery time)."""

ORDER = "CONFIG comes last and wakes the device"
"""Text on the order of writing in the firmware's header file (data sheet, 8.2.5)."""

ERRORS_REPORTED = 0b11111 << 11 | 1
"""Value of ERROR_CONFIG: report every error in the result, and a finished scan in STATUS and at pin INTB (7.6.27)."""

_DEGLITCH = ((1.0e6, 0b001), (3.3e6, 0b100), (10.0e6, 0b101))
"""Rows (sensor frequency (Hz) below which the input filter is used, code of the field DEGLITCH)."""
_DEGLITCH_WIDEST = 0b111
"""Code of the field DEGLITCH for the widest input filter, 33 MHz."""
_MUX_RESERVED = 0b00_0100_0001 << 3
"""Reserved bits of MUX_CONFIG, which must have this value."""
_CONFIG_FIXED = 1 << 12 | 1 << 10 | 0b00_0001
"""Fixed bits of CONFIG: RP_OVERRIDE_EN and AUTO_AMP_DIS (the drive current is fixed), and reserved bits.

SENSOR_ACTIVATE_SEL stays 0: full current while the sensor starts.
"""


AT_RESET = {
    **{RCOUNT + channel: 0x0080 for channel in range(MOST_CHANNELS)},
    CONFIG: 0x2801, MUX_CONFIG: 0x020F, MANUFACTURER_ID: MANUFACTURER,
}
"""Contents of registers after a reset, if not 0 (7.6.1)."""

SLEEP = 1 << 13
"""Mask of SLEEP_MODE_EN in register CONFIG."""

ACTIVE_CHANNEL = 14
"""Number of the lowest bit of ACTIVE_CHAN in register CONFIG."""

AUTOSCAN = 1 << 15
"""Mask of AUTOSCAN_EN in register MUX_CONFIG."""

SEQUENCE = 13
"""Number of the lowest bit of RR_SEQUENCE in register MUX_CONFIG."""

STATUS_ERRORS = {"ERR_UR": 1 << 13, "ERR_OR": 1 << 12, "ERR_WD": 1 << 11, "ERR_AHE": 1 << 10, "ERR_ALE": 1 << 9}
"""Masks of the errors in register STATUS, by name (7.6.26)."""

ERRORS_TO_RESULTS = {"ERR_UR": 1 << 15, "ERR_OR": 1 << 14, "ERR_WD": 1 << 13, "ERR_AHE": 1 << 12, "ERR_ALE": 1 << 11}
"""Masks of the bits in register ERROR_CONFIG that report an error in results, by name of the error.

The bit eight places lower reports the error in STATUS and at pin INTB. Bit 0 reports a finished scan there (7.6.27).
"""

ERROR_CHANNEL, DATA_READY, UNREAD = 14, 1 << 6, 1 << 3
"""Bits of register STATUS: number of the lowest bit of ERR_CHAN, masks of a finished scan and an unread result.

UNREAD is for channel 0. The bits of channels 1 to 3 are one bit lower each.
"""


def data_addresses(channel: int, count: int) -> tuple[int, ...]:
    """Return the addresses of a channel's result of one or two registers (7.6.2 and following)."""
    return tuple(2 * channel + word for word in range(count))


def results_text(bits: int, names: tuple[str, ...], results_by: str, errors_by: str) -> str:
    """Return the firmware header's text on results: their range, and the flags that ERROR_CONFIG enables.

    The arguments are explained in `RegisterMap.results_text`.
    """
    digits = -(-bits // 4)
    under, over = f"0x{0:0{digits}X}", f"0x{2**bits - 1:0{digits}X}"
    if len(names) > 1:
        ends, place = f"{under} being\nunder-range and {over}", f"in {names[0]}"
    else:
        ends, place = f"{under} being under-range and\n{over}", "above them"
    return (
        f"{ends} over-range ({results_by}). The flags {place} rise only where\n"
        "ERROR_CONFIG lets them (bits 15 to 11: under-range, over-range, watchdog, amplitude high and low; "
        f"{errors_by});\nthe value below lets all."
    )


def deglitch(highest_sensor_frequency: float) -> int:
    """Return the code of the field DEGLITCH: the narrowest input filter above the highest sensor frequency (Hz).

    0b111 is 33 MHz according to the description and the reset value of MUX_CONFIG; 0b011 in the tables of 8.1.7 is a
    misprint.
    """
    return next((bits for edge, bits in _DEGLITCH if highest_sensor_frequency < edge), _DEGLITCH_WIDEST)


def mux_config(channels: int, highest_sensor_frequency: float) -> int:
    """Return the value of MUX_CONFIG: continuous conversion of channel 0, or a scan of channels 0 to 1, 2 or 3.

    `channels` is the number of channels. The highest sensor frequency (Hz) sets the input filter.
    """
    scan = 0 if channels == 1 else 1 << 15 | (channels - 2) << 13
    return scan | _MUX_RESERVED | deglitch(highest_sensor_frequency)


def registers(
    channels: tuple[ChannelSettings, ...],
    highest_sensor_frequency: float,
    external_clock: bool = True,
    high_current: bool = False,
    output_gain: int | None = None,
) -> tuple[Register, ...]:
    """Return every register to write after reset, in the order of writing.

    CONFIG comes last, because it wakes the device (8.2.5).

    Parameters
    ----------
    channels
        Settings of one to four channels, from channel 0.
    highest_sensor_frequency
        Highest frequency (Hz) of all channels in all states.
    external_clock
        Whether the converter uses the clock at pin CLKIN.
    high_current
        Whether to use the high-current drive of a single channel.
    output_gain
        Code of OUTPUT_GAIN. None for a converter without this field.

    Raises
    ------
    ValueError
        if a setting does not fit its field, or for the high-current drive with several channels.
    """
    count = _check_range("channels", len(channels), 1, MOST_CHANNELS)
    if high_current and count > 1:
        raise ValueError("the high-current drive works in single-channel mode only")
    fields = [list(_channel_registers(number, channel)) for number, channel in enumerate(channels)]
    rcounts, offsets, settle_counts, dividers, drives = (list(rows) for rows in zip(*fields, strict=True))
    how = "continuous conversion of channel 0" if count == 1 else f"scan of channels 0 to {count - 1}"
    mux, wakes = f"{how}, input filter above the highest sensor frequency", "wakes the device: fixed drive current"
    wakes += f", full current while starting, {'external' if external_clock else 'internal'} clock"
    gains = []
    if output_gain is not None:
        code = _check_range("OUTPUT_GAIN", output_gain, 0, 3) << 9
        gains = [Register(RESET_DEV, "RESET_DEV", code, f"OUTPUT_GAIN {output_gain}, for the results of all channels")]
    return (
        *rcounts, *offsets, *settle_counts, *dividers,
        Register(ERROR_CONFIG, "ERROR_CONFIG", ERRORS_REPORTED,
                 "results carry flags of range, watchdog and amplitude; INTB falls when a scan is ready"),
        Register(MUX_CONFIG, "MUX_CONFIG", mux_config(count, highest_sensor_frequency), mux),
        *gains, *drives,
        Register(CONFIG, "CONFIG", _CONFIG_FIXED | external_clock << 9 | high_current << 6,
                 wakes + (", high-current drive" if high_current else "")),
    )


def _channel_registers(number: int, channel: ChannelSettings) -> tuple[Register, ...]:
    """Return the registers of a channel: RCOUNT, OFFSET, SETTLECOUNT, CLOCK_DIVIDERS and DRIVE_CURRENT.

    CLOCK_DIVIDERS has FIN_DIVIDER in bits 15:12 and FREF_DIVIDER in 9:0. DRIVE_CURRENT has the code in bits 15:11.
    """
    divider = _check_range("FIN_DIVIDER", channel.input_divider, 1, 15)
    reference = _check_range("FREF_DIVIDER", channel.reference_divider, 1, 1023)
    rows = (
        (RCOUNT, "RCOUNT", _check_range("RCOUNT", channel.rcount, 9, 0xFFFF),
         f"conversion of 16 x {channel.rcount} + 4 reference periods"),
        (OFFSET, "OFFSET", _check_range("OFFSET", channel.offset, 0, 0xFFFF),
         f"{channel.offset} / 2^16 of f_REF taken from every conversion"),
        (SETTLECOUNT, "SETTLECOUNT", _check_range("SETTLECOUNT", channel.settle_count, 4, 0xFFFF),
         f"settling for 16 x {channel.settle_count} reference periods"),
        (CLOCK_DIVIDERS, "CLOCK_DIVIDERS", divider << 12 | reference,
         f"FIN_DIVIDER {divider}, FREF_DIVIDER {reference}"),
        (DRIVE_CURRENT, "DRIVE_CURRENT", _check_range("IDRIVE", channel.drive_code, 0, 31) << 11,
         f"drive current code {channel.drive_code}"),
    )
    return tuple(Register(first + number, f"{name}{number}", value, meaning) for first, name, value, meaning in rows)


def _check_range(name: str, value: int, low: int, high: int) -> int:
    """Return `value`. Raises ValueError if it is not within `low` to `high`."""
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}; it must lie in {low} to {high}")
    return value
