"""Conversion of TI's multi-channel inductance converters (LDC1312 to LDC1614).

The converter compares a tank's frequency with a reference clock over 16 RCOUNT periods of this clock. Section numbers
refer to data sheet SNOSCY9A if no other is named. SI units throughout.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from sitscad.basics.quantities import Quantity
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.kernels.converters.conversion import Conversion, ConverterPart, Demand
from sitscad.kernels.converters.figures import FREQUENCY, SHARE, WORDS, RowForm, numbers
from sitscad.kernels.converters.registers import ChannelSettings, FirmwareText, Register

REQUIRED_ROWS: Mapping[str, RowForm] = {
    "output_gains": RowForm("bit", 0, 16, whole=True, several=True),
    "result_registers": RowForm(WORDS),
    "reference_multi_external_max": FREQUENCY,
    "reference_multi_internal_max": FREQUENCY,
    "reference_single_max": FREQUENCY,
    "input_to_reference_max": SHARE,
    "input_divider_2_from": FREQUENCY,
    "rcount_min": RowForm("1", 1, 0xFFFF, whole=True),
    "settle_count_min": RowForm("1", 0, 0xFFFF, whole=True),
    "switch_delay": RowForm("s", 0.0, 1e-3),
    "single_channel_rate_max": RowForm("Hz", 1.0, 1e7),
    "read_back_four_channels": RowForm("s", 1e-7, 1.0),
    "noise_steps": RowForm("1", 0.0, 1e3),
}
"""Rows that a family of these converters must have in its data file, by name, with unit and range."""

SETTINGS = (
    Quantity("reference_frequency_Hz", "reference frequency f_REF"),
    Quantity("reference_divider", "its divider, of the clock f_CLK"),
    Quantity("input_divider", "input divider"),
    Quantity("rcount", "RCOUNT"),
    Quantity("settle_count", "SETTLECOUNT"),
)
"""Settings of these converters in printed results and in JSON."""

MAX_COUNT = 0xFFFF
"""Largest RCOUNT and SETTLECOUNT: the registers have 16 bits."""

MAX_INPUT_DIVIDER = 15
"""Largest FIN_DIVIDER: its field has 4 bits."""

REGISTER_BITS = 49.0
"""Number of bit times to read a register over I2C.

Five frames of nine bits each, plus start, repeated start, stop and bus-free time. With this number, a result in two
registers is read 4080 times per second at 400 kHz, as in the data sheet (figure 12, 6.5).
"""

FREE_PART = 0.5
"""Largest width of the range of expected frequencies, divided by the width of the range that a result can show.

The expected range is in the middle. The rest is for loads that exceed the loads in the spec's states.
"""


# --------------------------------------------------------------------------------------------------------------- clocks


def reference_divider(device: ConverterPart, clock: float, channels: int, external: bool = True) -> int:
    """Return FREF_DIVIDER: the smallest with which the reference frequency f_REF is within its limit.

    `clock` is in Hz. The limit depends on the number of active `channels` and is lowest for a single channel. For
    several converters with one divider, give the smallest number of channels.
    """
    source = "single" if channels == 1 else "multi_external" if external else "multi_internal"
    return max(1, math.ceil(clock / device.limit(f"reference_{source}_max") - 1e-9))


def input_divider(device: ConverterPart, sensor_frequency: float, reference_frequency: float = 40e6) -> int:
    """Return FIN_DIVIDER: the smallest with f_IN < f_REF/4, and at least 2 from 8.75 MHz. Frequencies are in Hz.

    f_IN is the sensor frequency divided by FIN_DIVIDER. The result may exceed `MAX_INPUT_DIVIDER`: then no setting
    counts the frequency (`ReferenceCounter.highest_frequency`).
    """
    ceiling = device.limit("input_to_reference_max") * reference_frequency
    divider = math.floor(sensor_frequency / ceiling * (1.0 + 1e-12)) + 1
    return max(divider, 2) if sensor_frequency >= device.limit("input_divider_2_from") else divider


# --------------------------------------------------------------------------------------------------------------- timing


def settle_count(
    device: ConverterPart, quality_factor: float, reference_frequency: float, sensor_frequency: float
) -> int:
    """Return the smallest SETTLECOUNT: Q f_REF / (16 f_SENSOR) rounded up (8.1.4.1), and above 3.

    Q is the quality factor, f_REF the reference frequency and f_SENSOR the sensor frequency (Hz).
    """
    needed = math.ceil(quality_factor * reference_frequency / (16.0 * sensor_frequency) - 1e-9)
    return min(MAX_COUNT, max(int(device.limit("settle_count_min")), needed))


def settle_periods(count: int) -> float:
    """Return the number of reference periods for the amplitude to settle: 16 SETTLECOUNT (8.1.4.1); 32 for 0 and 1."""
    return max(2, count) * 16.0


def conversion_periods(rcount: int) -> float:
    """Return the number of reference periods of one conversion: 16 RCOUNT + 4 (8.1.4)."""
    return 16.0 * rcount + 4.0


def switch_time(device: ConverterPart, reference_frequency: float) -> float:
    """Return the typical time (s) from a channel's conversion to the next channel: 692 ns + 5 / f_REF (8.1.4).

    f_REF is the reference frequency in Hz.
    """
    return device.limit("switch_delay") + 5.0 / reference_frequency


def scan_time(device: ConverterPart, rcount: int, count: int, reference_frequency: float, channels: int) -> float:
    """Return the time (s) of one scan of `channels` channels with equal settings.

    `count` is SETTLECOUNT, the reference frequency is in Hz. A single channel converts without settling again (figure
    54). TI does not state the pause between two conversions, and the switch delay is used for it.
    """
    conversion = conversion_periods(rcount) / reference_frequency
    if channels == 1:
        return conversion + switch_time(device, reference_frequency)
    settling = settle_periods(count) / reference_frequency
    return channels * (settling + conversion + switch_time(device, reference_frequency))


def reference_count(
    device: ConverterPart, scan_rate: float, count: int, reference_frequency: float, channels: int
) -> int:
    """Return the largest RCOUNT with at least `scan_rate` (Hz) scans of `channels` channels per second.

    `count` is SETTLECOUNT, the reference frequency is in Hz. RCOUNT is limited to its smallest value and 0xFFFF. At the
    lower limit the wanted rate is not reached, at the upper limit it is exceeded: see `scan_time`.
    """
    overhead = scan_time(device, 0, count, reference_frequency, channels) / channels
    periods = (1.0 / (scan_rate * channels) - overhead) * reference_frequency
    return min(MAX_COUNT, max(int(device.limit("rcount_min")), math.floor(periods / 16.0 + 1e-9)))


def read_back_time(device: ConverterPart, channels: int) -> float:
    """Return the time (s) to read the results of some channels over I2C at its fastest clock."""
    return channels * len(device.result_words) * REGISTER_BITS / device.limit("serial_clock_max")


def read_back_time_optimistic(device: ConverterPart, channels: int) -> float:
    """Return the time (s) to read the results of some channels, from the manufacturer's stated time for four channels.

    This value implies fewer bits than the manufacturer's timing diagrams show.
    """
    return channels * device.limit("read_back_four_channels") / 4.0


# ---------------------------------------------------------------------------------------------- amplitude, noise, gains


def amplitude(parallel_resistance: float, current: float) -> float:
    """Return the peak voltage (V) across the tank: V_P = 4 R_P I / pi (8.1.5).

    R_P is the parallel resistance in ohm. I is the peak (A) of a square-wave current.
    """
    return 4.0 * parallel_resistance * current / math.pi


def counting_noise(noise_steps: float, frequency: float, rcount: int) -> float:
    """Return the standard deviation (Hz) of one conversion of a frequency (Hz), from the noise of measured sensors.

    It is `noise_steps` times half a reference period in the 16 RCOUNT periods of a conversion. Half a period is 3.3 ppm
    at RCOUNT 9471.
    """
    return noise_steps * frequency / (32.0 * rcount)


def gains(device: ConverterPart) -> tuple[int, ...]:
    """Return, for each code of OUTPUT_GAIN, the number of upper bits of a conversion that a result omits."""
    return tuple(map(int, numbers(device.family, "output_gains")))


def count_bits(device: ConverterPart) -> int:
    """Return the number of bits of a conversion. A result shows all or some of these bits."""
    return device.bits + max(gains(device))


def choose_gain(
    device: ConverterPart, full_scale: float, bands: Sequence[tuple[float, float]]
) -> tuple[int, tuple[int, ...]]:
    """Return the code of OUTPUT_GAIN and the offset of each coil with the finest results that cover all `bands`.

    `bands` (Hz) are the lowest and highest expected frequency of each coil. `full_scale` (Hz) is the frequency of the
    largest count. Returns 0 and no offsets for a converter without gains.

    The upper bits of a conversion that a result does not show have to be equal for all frequencies (SNOSCZ0A 8.1.3.2).
    The offset therefore moves the middle of a band to the middle of the result's range. Without gain every frequency
    fits, because f_IN stays below f_REF/4.
    """
    bits = gains(device)
    if len(bits) == 1:
        return 0, ()
    scale = 2.0 ** count_bits(device) / full_scale
    gain = max(
        (code for code, more in enumerate(bits)
         if all((high - low) * scale <= FREE_PART * 2.0 ** (count_bits(device) - more) for low, high in bands)),
        default=0, key=lambda code: bits[code],
    )
    if not bits[gain]:
        return gain, (0,) * len(bands)
    width, step = 2 ** (count_bits(device) - bits[gain]), 2 ** (max(bits) - bits[gain])
    return gain, tuple(max(0, round((0.5 * (low + high) * scale - 0.5 * width) / step) * step) for low, high in bands)


# ------------------------------------------------------------------------------------------------------------- settings


@record
class ReferenceCounter(Conversion):
    """Settings of a converter that counts against a reference clock (LDC1312 to LDC1614).

    `reference_frequency` (f_REF; Hz) is the clock divided by `reference_divider` (FREF_DIVIDER). `input_divider`
    (FIN_DIVIDER) divides the sensor frequency. `rcount` and `settle_count` set the times of conversion and settling.

    A count is f / (FIN_DIVIDER f_REF) 2^`count_bits`. If a result has fewer bits than the count, `gain` is the code of
    OUTPUT_GAIN, and `coil_offsets`, one per coil, are subtracted first. Otherwise they are 0 and empty.
    """

    reference_frequency: float
    reference_divider: int
    input_divider: int
    rcount: int
    settle_count: int
    gain: int = 0
    coil_offsets: tuple[int, ...] = ()

    @property
    def full_scale(self) -> float:
        """Frequency (Hz) that the largest count represents: FIN_DIVIDER f_REF."""
        return self.input_divider * self.reference_frequency

    @property
    def hertz_per_count(self) -> float:
        """Frequency (Hz) that one count represents."""
        return float(self.full_scale / 2.0**self.count_bits)

    def counting_step(self, frequency: float) -> float:
        """Return the smallest difference (Hz) of counted frequencies: one reference period in 16 RCOUNT.

        Derived here, not TI's.
        """
        return frequency / (16.0 * self.rcount)

    def counting_noise(self, frequency: float) -> float:
        """Return the standard deviation (Hz) of one conversion of a frequency (Hz)."""
        return counting_noise(self.device.limit("noise_steps"), frequency, self.rcount)

    @property
    def settle_time(self) -> float:
        """Time (s) in which the amplitude settles: 16 SETTLECOUNT / f_REF."""
        return settle_periods(self.settle_count) / self.reference_frequency

    @property
    def conversion_time(self) -> float:
        """Time (s) of one conversion: (16 RCOUNT + 4) / f_REF."""
        return conversion_periods(self.rcount) / self.reference_frequency

    @property
    def switch_time(self) -> float:
        """Typical time (s) from one channel's conversion to the next channel."""
        return switch_time(self.device, self.reference_frequency)

    @property
    def scan_time(self) -> float:
        """Time (s) of one scan of all channels."""
        return scan_time(self.device, self.rcount, self.settle_count, self.reference_frequency, self.channels)

    @property
    def longest_conversion(self) -> float:
        """Time (s) of a conversion with the largest RCOUNT."""
        return conversion_periods(MAX_COUNT) / self.reference_frequency

    @property
    def highest_frequency(self) -> float:
        """Frequency (Hz) up to which f_IN is below f_REF/4 and no larger FIN_DIVIDER is needed (table 43)."""
        ceiling = self.device.limit("input_to_reference_max") * self.reference_frequency
        if self.input_divider < 2:
            return min(ceiling, self.device.limit("input_divider_2_from"))
        return ceiling * min(self.input_divider, MAX_INPUT_DIVIDER)

    def slowest_clock(self, frequency: float) -> float | None:
        """Return the slowest reference clock (Hz) for a frequency (Hz), with the largest FIN_DIVIDER."""
        return frequency / (self.device.limit("input_to_reference_max") * MAX_INPUT_DIVIDER)

    def supply_current(self, drive: float) -> float:
        """Return the current (A) from VDD without pause: I_DD, plus the drive current (A) while a sensor is driven.

        I_DD does not include the sensor's current (6.5). A sensor is driven while its channel settles and converts, and
        grounded while the next channel is switched in (8.1.5.1). TI's typical curves lie about 0.5 mA below this sum.
        """
        driven = self.settle_time + self.conversion_time
        duty = 1.0 if self.channels == 1 else driven / (driven + self.switch_time)
        return self.device.limit("supply_current") + duty * drive

    def covering(self, bands: Sequence[tuple[float, float]]) -> ReferenceCounter:
        """Return these settings with the input divider, gain and offsets that the expected frequencies need.

        `bands` are the lowest and highest frequency (Hz) of each coil.
        """
        highest = (input_divider(self.device, high, self.reference_frequency) for _, high in bands)
        divider = max(self.input_divider, *highest)
        gain, offsets = choose_gain(self.device, divider * self.reference_frequency, bands)
        return replace(self, input_divider=divider, gain=gain, coil_offsets=offsets)

    # -------------------------------------------------------------------- results that show a part of a conversion

    @property
    def count_bits(self) -> int:
        """Number of bits of a conversion."""
        return count_bits(self.device)

    @property
    def omitted_low_bits(self) -> int:
        """Number of the lowest bits of a conversion that its result omits."""
        return self.count_bits - self.device.bits - gains(self.device)[self.gain]

    @property
    def counts_per_step(self) -> int:
        """Difference of two successive results in counts."""
        return 1 << self.omitted_low_bits

    @property
    def offsets(self) -> tuple[int, ...]:
        """Counts subtracted from each coil's conversions before the result is stored."""
        return self.coil_offsets

    @property
    def is_partial(self) -> bool:
        """Whether a result has fewer bits than a conversion, so that gain and offset select the bits."""
        return len(gains(self.device)) > 1

    @property
    def result_settings(self) -> Mapping[str, Any]:
        """Code of OUTPUT_GAIN and the offsets. Empty if a result has all bits of the conversion."""
        return {"output_gain": self.gain, "offsets": list(self.offsets)} if self.is_partial else {}

    @property
    def result_text(self) -> str:
        """Text that states which bits of a conversion the result has. Empty if it has all bits."""
        if not self.is_partial:
            return ""
        step, gain = show(self.result_step, "Hz", 3), 2 ** gains(self.device)[self.gain]
        return f"{self.device.bits} of {self.count_bits} bits, a step of {step} (gain {gain})"

    def part(self, coils: slice) -> ReferenceCounter:
        """Return the settings for a part of the sensor's coils, given as a slice of their numbers."""
        return replace(self, coil_offsets=self.coil_offsets[coils])

    # ------------------------------------------------------------------------------------------------------ firmware

    def firmware_text(self, clock: float) -> FirmwareText:
        """Return the texts on this conversion in the firmware's header file, with the reference clock (Hz)."""
        result = "COUNTS" if self.is_partial else "DATA"
        return FirmwareText(
            clock=f"Clock f_CLK {show(clock, 'Hz')} at CLKIN; FREF_DIVIDER {self.reference_divider} makes of it f_REF "
            f"{show(self.reference_frequency, 'Hz', 4)}.",
            frequency=f"FIN_DIVIDER * f_REF * {result} / 2^{self.count_bits} "
            f"({self.device.source_of('cite_frequency')}), where f_REF = f_CLK / FREF_DIVIDER",
            constants=(("FREF_DIVIDER", self.reference_divider), ("F_REF_HZ", self.reference_frequency),
                       ("FIN_DIVIDER", self.input_divider)),
            keys=("reference_frequency_Hz", "reference_divider", "input_divider"),
            part={
                "result_bits": self.device.bits, "count_bits": self.count_bits, "output_gain": self.gain,
                "result_shift": self.omitted_low_bits,
            } if self.is_partial else {},
            part_by="OUTPUT_GAIN and OFFSETx",
        )

    def registers(
        self, coils: slice, codes: Sequence[int], highest_frequency: float, high_current: bool
    ) -> tuple[Register, ...]:
        """Return the registers of the converter that reads the coils `coils` of the sensor, in the order of writing."""
        channels = tuple(
            ChannelSettings(self.rcount, self.settle_count, self.input_divider, self.reference_divider, code, offset)
            for code, offset in zip(codes, self.offsets[coils] or (0,) * len(codes), strict=True)
        )
        gain = self.gain if self.is_partial else None
        return self.device.register_map.registers(
            channels, highest_frequency, high_current=high_current, output_gain=gain)


def set_up(device: ConverterPart, demand: Demand) -> ReferenceCounter:
    """Return dividers and counts for all tanks: the longest conversions that reach the required scan rate."""
    divider = reference_divider(device, demand.clock, demand.fewest)
    reference = demand.clock / divider
    settling = max(settle_count(device, quality, reference, frequency) for frequency, quality in demand.tanks)
    return ReferenceCounter(
        device, demand.most, reference, divider,
        max(input_divider(device, frequency, reference) for frequency, _ in demand.tanks),
        reference_count(device, demand.scan_rate, settling, reference, demand.most), settling,
    )
