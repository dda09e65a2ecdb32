"""Registers of LDC1312 to LDC1614, packed bit by bit (data sheets SNOSCY9A and SNOSCZ0A, 7.6 and 8.2.5)."""

from __future__ import annotations

from sitscad.kernels.converters.registers import ChannelSettings, Register

MOST_CHANNELS = 4
"""Channels that the registers have addresses for."""

RCOUNT, OFFSET, SETTLECOUNT, CLOCK_DIVIDERS, DRIVE_CURRENT = 0x08, 0x0C, 0x10, 0x14, 0x1E
STATUS, ERROR_CONFIG, CONFIG, MUX_CONFIG, RESET_DEV = 0x18, 0x19, 0x1A, 0x1B, 0x1C
MANUFACTURER_ID, DEVICE_ID = 0x7E, 0x7F

MANUFACTURER = 0x5449
"""What MANUFACTURER_ID holds: the letters TI."""

DATA_FLAGS = {
    "ERR_UR": (0x8000, "conversion under-range"),
    "ERR_OR": (0x4000, "conversion over-range"),
    "ERR_WD": (0x2000, "watchdog timeout: the sensor does not oscillate"),
    "ERR_AE": (0x1000, "amplitude outside about 1.2 to 1.8 V"),
}
"""Error flags in the upper or only register of a result by name: mask and meaning (nominal amplitudes: STATUS)."""

ORDER = "CONFIG comes last and wakes the device"
"""What the header says of the order of writing (8.2.5)."""

ERRORS_REPORTED = 0b11111 << 11 | 1
"""ERROR_CONFIG: every error of a conversion to its result, and a finished scan to STATUS and INTB (7.6.27)."""

_DEGLITCH = ((1.0e6, 0b001), (3.3e6, 0b100), (10.0e6, 0b101))
_DEGLITCH_WIDEST = 0b111
_MUX_RESERVED = 0b00_0100_0001 << 3
_CONFIG_FIXED = 1 << 12 | 1 << 10 | 0b00_0001
"""RP_OVERRIDE_EN and AUTO_AMP_DIS (the drive current is fixed), and what is reserved; SENSOR_ACTIVATE_SEL stays 0: full
current while the sensor starts."""


AT_RESET = {
    **{RCOUNT + channel: 0x0080 for channel in range(MOST_CHANNELS)},
    CONFIG: 0x2801, MUX_CONFIG: 0x020F, MANUFACTURER_ID: MANUFACTURER,
}
"""What registers hold after a reset, where that is not 0 (7.6.1)."""

SLEEP, ACTIVE_CHANNEL, AUTOSCAN, SEQUENCE = 1 << 13, 14, 1 << 15, 13
"""CONFIG: asleep, and where ACTIVE_CHAN begins; MUX_CONFIG: channels in turn, and where RR_SEQUENCE begins."""

STATUS_ERRORS = {"ERR_UR": 1 << 13, "ERR_OR": 1 << 12, "ERR_WD": 1 << 11, "ERR_AHE": 1 << 10, "ERR_ALE": 1 << 9}
"""Errors in STATUS (7.6.26)."""

ERRORS_TO_RESULTS = {"ERR_UR": 1 << 15, "ERR_OR": 1 << 14, "ERR_WD": 1 << 13, "ERR_AHE": 1 << 12, "ERR_ALE": 1 << 11}
"""Bits of ERROR_CONFIG that let them into results; eight bits below each is the one that lets it into STATUS and INTB,
where bit 0 lets the finished scan (7.6.27).
"""

ERROR_CHANNEL, DATA_READY, UNREAD = 14, 1 << 6, 1 << 3
"""STATUS: where ERR_CHAN begins; a finished scan; an unread result of channel 0, those of 1 to 3 one bit below each."""


def data_addresses(channel: int, words: int) -> tuple[int, ...]:
    """Addresses of a channel's result of one or two registers (7.6.2 and on)."""
    return tuple(2 * channel + word for word in range(words))


def said_of_results(bits: int, words: tuple[str, ...], results_by: str, errors_by: str) -> str:
    """What the header says of results: 0 and all ones are their ends, and ERROR_CONFIG lets flags into them."""
    digits = -(-bits // 4)
    under, over = f"0x{0:0{digits}X}", f"0x{2**bits - 1:0{digits}X}"
    if len(words) > 1:
        ends, place = f"{under} being\nunder-range and {over}", f"in {words[0]}"
    else:
        ends, place = f"{under} being under-range and\n{over}", "above them"
    return (
        f"{ends} over-range ({results_by}). The flags {place} rise only where\n"
        "ERROR_CONFIG lets them (bits 15 to 11: under-range, over-range, watchdog, amplitude high and low; "
        f"{errors_by});\nthe value below lets all."
    )


def deglitch(highest_sensor_frequency: float) -> int:
    """DEGLITCH field: the narrowest input filter above the highest sensor frequency (Hz).

    0b111 is 33 MHz by MUX_CONFIG's field and its reset value; 0b011 in the tables of 8.1.7 is a misprint.
    """
    return next((bits for edge, bits in _DEGLITCH if highest_sensor_frequency < edge), _DEGLITCH_WIDEST)


def mux_config(channels: int, highest_sensor_frequency: float) -> int:
    """MUX_CONFIG: one channel converts continuously; two, three or four are scanned in turn (channels 0 up)."""
    scan = 0 if channels == 1 else 1 << 15 | (channels - 2) << 13
    return scan | _MUX_RESERVED | deglitch(highest_sensor_frequency)


def registers(
    channels: tuple[ChannelSettings, ...],
    highest_sensor_frequency: float,
    external_clock: bool = True,
    high_current: bool = False,
    output_gain: int | None = None,
) -> tuple[Register, ...]:
    """Every register to write after reset, in order; CONFIG comes last, because it wakes the device (8.2.5).

    `channels` are channels 0 up, one to four; `highest_sensor_frequency` is in Hz, over all channels and states;
    `output_gain` is the code of OUTPUT_GAIN, None for a converter without. Raises ValueError where a setting does not
    fit its field, or for the high-current drive with several channels.
    """
    count = _within("channels", len(channels), 1, MOST_CHANNELS)
    if high_current and count > 1:
        raise ValueError("the high-current drive works in single-channel mode only")
    fields = [list(_of_channel(number, channel)) for number, channel in enumerate(channels)]
    rcounts, offsets, settle_counts, dividers, drives = (list(rows) for rows in zip(*fields, strict=True))
    how = "continuous conversion of channel 0" if count == 1 else f"scan of channels 0 to {count - 1}"
    mux, wakes = f"{how}, input filter above the highest sensor frequency", "wakes the device: fixed drive current"
    wakes += f", full current while starting, {'external' if external_clock else 'internal'} clock"
    gains = []
    if output_gain is not None:
        code = _within("OUTPUT_GAIN", output_gain, 0, 3) << 9
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


def _of_channel(number: int, channel: ChannelSettings) -> tuple[Register, ...]:
    """RCOUNT, OFFSET, SETTLECOUNT, CLOCK_DIVIDERS (FIN_DIVIDER in bits 15:12, FREF_DIVIDER in 9:0) and DRIVE_CURRENT
    (the code in bits 15:11) of a channel.
    """
    divider = _within("FIN_DIVIDER", channel.input_divider, 1, 15)
    reference = _within("FREF_DIVIDER", channel.reference_divider, 1, 1023)
    rows = (
        (RCOUNT, "RCOUNT", _within("RCOUNT", channel.rcount, 9, 0xFFFF),
         f"conversion of 16 x {channel.rcount} + 4 reference periods"),
        (OFFSET, "OFFSET", _within("OFFSET", channel.offset, 0, 0xFFFF),
         f"{channel.offset} / 2^16 of f_REF taken from every conversion"),
        (SETTLECOUNT, "SETTLECOUNT", _within("SETTLECOUNT", channel.settle_count, 4, 0xFFFF),
         f"settling for 16 x {channel.settle_count} reference periods"),
        (CLOCK_DIVIDERS, "CLOCK_DIVIDERS", divider << 12 | reference,
         f"FIN_DIVIDER {divider}, FREF_DIVIDER {reference}"),
        (DRIVE_CURRENT, "DRIVE_CURRENT", _within("IDRIVE", channel.drive_code, 0, 31) << 11,
         f"drive current code {channel.drive_code}"),
    )
    return tuple(Register(first + number, f"{name}{number}", value, meaning) for first, name, value, meaning in rows)


def _within(name: str, value: int, low: int, high: int) -> int:
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}; it must lie in {low} to {high}")
    return value
