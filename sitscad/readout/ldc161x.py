"""TI LDC1612 and LDC1614: what they can drive, how they time their conversions, and what to write into their registers.

Formulas and table numbers are those of their common data sheet SNOSCY9A (December 2014, revised March 2018). SI units
throughout; every limit stands with its source in ``data/ldc161x_limits.csv``.
"""

from __future__ import annotations

import math
from functools import cache

from sitscad.data import rows
from sitscad.readout.family import DriveCurrent, Limit
from sitscad.readout.ldc161x_registers import data_addresses as data_addresses
from sitscad.readout.ldc161x_registers import data_flags as data_flags
from sitscad.readout.ldc161x_registers import data_mask as data_mask
from sitscad.readout.ldc161x_registers import identity as identity
from sitscad.readout.ldc161x_registers import registers as registers


@cache
def limits() -> dict[str, Limit]:
    """The family's limits by name (``sensor_frequency_max``, ``amplitude_max``, ...)."""
    return {
        row["name"]: Limit(float(row["value"]), row["unit"], row["source"], row["verified"] == "yes")
        for row in rows("ldc161x_limits")
    }


def limit(name: str) -> float:
    """The value of one limit, in SI units; KeyError for an unknown name."""
    return limits()[name].value


@cache
def drive_currents() -> tuple[DriveCurrent, ...]:
    """The drive-current table, code 0 to 31 (data sheet table 42)."""
    return tuple(
        DriveCurrent(
            int(row["code"]),
            float(row["current_A"]),
            float(row["parallel_resistance_min_ohm"]),
            float(row["parallel_resistance_max_ohm"]),
        )
        for row in rows("ldc161x_drive_current")
    )


# ---------------------------------------------------------------------------------------------- drive and amplitude


def drive_current(code: int, high_current: bool = False) -> float:
    """Sensor drive current (A, peak of the square wave) of a code; `high_current` is channel 0 alone at code 31.

    TI gives 6 mA (6.5), more than 3.5 mA (8.1.5.5) and 3 mA (SNOA950) for the high-current mode: the largest is taken
    here, because an amplitude above 1.8 V is the worse fault; see `high_current_range`.
    """
    return limit("high_current_max") if high_current else drive_currents()[code].current


def high_current_range() -> tuple[float, float]:
    """Smallest and largest current (A) that TI's texts give for the high-current mode."""
    return limit("high_current_typical"), limit("high_current_max")


def amplitude(parallel_resistance: float, code: int, high_current: bool = False) -> float:
    """Peak voltage across the tank of R_P (ohm), driven with a code."""
    return amplitude_at(parallel_resistance, drive_current(code, high_current))


def amplitude_at(parallel_resistance: float, current: float) -> float:
    """Peak voltage across the tank: V_P = 4 R_P I / pi (equation 12), R_P in ohm, I the drive current (A)."""
    return 4.0 * parallel_resistance * current / math.pi


def drive_code(parallel_resistance: float) -> int:
    """The highest code that keeps the amplitude below 1.8 V at `parallel_resistance` (ohm).

    Give the largest R_P of the working range, which is the target at its greatest distance (8.1.5; SNOA950), with one
    sigma of manufacture added where sensors are still to be made. Code 0
    when even that one drives harder; code 31 when none reaches 1.8 V: check the amplitude.
    """
    allowed = [
        row.code for row in drive_currents() if amplitude(parallel_resistance, row.code) < limit("amplitude_max")
    ]
    return max(allowed, default=0)


# ---------------------------------------------------------------------------------------------------------- clocks


def reference_divider(clock: float, channels: int, external: bool = True) -> int:
    """FREF_DIVIDER for a clock (Hz): the smallest that brings f_REF within table 43 for that many active channels.

    For several converters with one divider give the fewest channels of any: a single one is held to less.
    """
    if channels == 1:
        ceiling = limit("reference_single_max")
    else:
        ceiling = limit("reference_multi_external_max" if external else "reference_multi_internal_max")
    return max(1, math.ceil(clock / ceiling - 1e-9))


def input_divider(sensor_frequency: float, reference_frequency: float = 40e6) -> int:
    """FIN_DIVIDER: the smallest with f_IN < f_REF/4, at least 2 from 8.75 MHz (table 43, note 2). In Hz.

    May exceed 15, the largest that the register holds: `is_input_in_range` says so.
    """
    ceiling = limit("input_to_reference_max") * reference_frequency
    divider = math.floor(sensor_frequency / ceiling * (1.0 + 1e-12)) + 1
    return max(divider, 2) if sensor_frequency >= limit("input_divider_2_from") else divider


def is_input_in_range(sensor_frequency: float, divider: int, reference_frequency: float) -> bool:
    """Whether a sensor frequency (Hz) with a FIN_DIVIDER obeys table 43 at a reference frequency (Hz)."""
    if not 1 <= divider <= 15 or (divider < 2 and sensor_frequency >= limit("input_divider_2_from")):
        return False
    return sensor_frequency / divider < limit("input_to_reference_max") * reference_frequency


# ---------------------------------------------------------------------------------------------------------- timing


def settle_count(quality_factor: float, reference_frequency: float, sensor_frequency: float) -> int:
    """Smallest SETTLECOUNT: Q f_REF / (16 f_SENSOR) rounded up (equation 10), and above 3 (table 43)."""
    needed = math.ceil(quality_factor * reference_frequency / (16.0 * sensor_frequency) - 1e-9)
    return min(0xFFFF, max(int(limit("settle_count_min")), needed))


def settle_time(count: int, reference_frequency: float) -> float:
    """Time (s) for the amplitude to settle: 16 SETTLECOUNT / f_REF (equation 9); 32 / f_REF for 0 and 1."""
    return max(2, count) * 16.0 / reference_frequency


def conversion_time(rcount: int, reference_frequency: float) -> float:
    """Time (s) of one conversion: (16 RCOUNT + 4) / f_REF (equation 7)."""
    return (16.0 * rcount + 4.0) / reference_frequency


def switch_time(reference_frequency: float) -> float:
    """Typical time (s) from one channel's conversion to the next channel: 692 ns + 5 / f_REF (equation 8)."""
    return 692e-9 + 5.0 / reference_frequency


def dwell_time(rcount: int, count: int, reference_frequency: float) -> float:
    """Time (s) spent on one channel of a scan: settling, conversion and switch delay (8.1.4.1)."""
    return (
        settle_time(count, reference_frequency)
        + conversion_time(rcount, reference_frequency)
        + switch_time(reference_frequency)
    )


def scan_time(rcount: int, count: int, reference_frequency: float, channels: int) -> float:
    """Time (s) of one scan of `channels` alike channels.

    One channel alone converts without settling again (figure 54); the switch delay stands in for the pause between
    two conversions, which TI does not state.
    """
    if channels == 1:
        return conversion_time(rcount, reference_frequency) + switch_time(reference_frequency)
    return channels * dwell_time(rcount, count, reference_frequency)


def reference_count(scan_rate: float, count: int, reference_frequency: float, channels: int) -> int:
    """Largest RCOUNT whose scans of `channels` channels come at least `scan_rate` (Hz) times a second.

    Kept within 9 (table 43: above 8) and 0xFFFF: at the lower end the wanted rate is not reached, at the upper end it
    is exceeded; `scan_time` tells.
    """
    overhead = scan_time(0, count, reference_frequency, channels) / channels
    periods = (1.0 / (scan_rate * channels) - overhead) * reference_frequency
    return min(0xFFFF, max(int(limit("rcount_min")), math.floor(periods / 16.0 + 1e-9)))


def read_back_time(channels: int, serial_clock: float = 400e3) -> float:
    """Time (s) to read the results of some channels over I2C at `serial_clock` (Hz).

    Two registers a channel, five frames of nine bits each plus start, repeated start, stop and bus-free time: 49 bits,
    which is what the data sheet's 4.08 kSPS at 400 kHz comes to (figure 12, 6.5).
    """
    return channels * 2.0 * 49.0 / serial_clock


def read_back_time_optimistic(channels: int) -> float:
    """Time (s) to read some channels at 400 kHz by SNOA949 (0.688 ms for four): fewer bits than figure 12 shows."""
    return channels * limit("read_back_four_channels") / 4.0


def supply_current(drive: float, rcount: int, count: int, reference_frequency: float, channels: int) -> float:
    """Current (A) from VDD while converting without pause: I_DD and the drive current for the time it flows.

    I_DD does not include the sensor's (6.5); a sensor is driven while its channel settles and converts, and grounded
    while the next is switched in (8.1.5.1). TI's typical curves lie about 0.5 mA below such a sum.
    """
    driven = settle_time(count, reference_frequency) + conversion_time(rcount, reference_frequency)
    duty = 1.0 if channels == 1 else driven / (driven + switch_time(reference_frequency))
    return limit("supply_current") + duty * drive


# ------------------------------------------------------------------------------------------------ results and noise


def sensor_frequency(data: int, reference_frequency: float, divider: int = 1, offset: int = 0) -> float:
    """Sensor frequency (Hz) from a 28-bit result: FIN_DIVIDER f_REF (DATA/2^28 + OFFSET/2^16) (equation 6)."""
    return divider * reference_frequency * (data / 2.0**28 + offset / 2.0**16)


def inductance(frequency: float, capacitance: float) -> float:
    """Inductance (H) of a tank from its frequency (Hz) and whole capacitance (F): 1 / (C (2 pi f)^2) (equation 3)."""
    return 1.0 / (capacitance * (2.0 * math.pi * frequency) ** 2)


def frequency_quantum(frequency: float, rcount: int) -> float:
    """Step (Hz) of the measured frequency: one reference period in 16 RCOUNT of them. Derived here, not TI's."""
    return frequency / (16.0 * rcount)


def frequency_noise(frequency: float, rcount: int) -> float:
    """Standard deviation (Hz) of a result by quantisation alone, quantum / sqrt(12); real systems are noisier.

    Derived here: 35 Hz at 4 MHz and RCOUNT 0x800, against 32 Hz by the 8e-7 of f_REF that Duet3D's firmware quotes.
    """
    return frequency_quantum(frequency, rcount) / math.sqrt(12.0)


def measured_noise(frequency: float, rcount: int) -> float:
    """Standard deviation (Hz) of a result as measured sensors have it: some steps of half a reference period in 16
    RCOUNT of them, so 3.3 ppm at RCOUNT 9471.
    """
    return limit("noise_steps") * frequency / (32.0 * rcount)


def inductance_noise(value: float, frequency: float, rcount: int) -> float:
    """Standard deviation (H) of an inductance by quantisation alone, at a fixed capacitor: 2 L sigma_f / f."""
    return 2.0 * value * frequency_noise(frequency, rcount) / frequency
