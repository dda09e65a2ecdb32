"""What the rest of sitscad asks of a family of converters: parts of one data sheet that differ in their channels alone.

A module of this room is a family: its functions are these, with the data sheet's equations in their texts. SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from sitscad.record import record


@record
class Limit:
    """One figure of the family: value in SI units, where it comes from, and whether that source was seen."""

    value: float
    unit: str
    source: str
    verified: bool


@record
class DriveCurrent:
    """One row of the drive-current table: 5-bit code, peak current (A) and the window of R_P (ohm) it is meant for."""

    code: int
    current: float
    parallel_resistance_min: float
    parallel_resistance_max: float


@record
class ChannelSettings:
    """The settings of one channel."""

    rcount: int
    settle_count: int
    input_divider: int
    reference_divider: int
    drive_code: int


@record
class Register:
    """One 16-bit write: address, name, value and what it sets."""

    address: int
    name: str
    value: int
    meaning: str


@record
class Identity:
    """What a program reads to know the part: addresses and values of the two identifiers, the status register's
    address.
    """

    manufacturer: int
    manufacturer_address: int
    device: int
    device_address: int
    status_address: int


class Family(Protocol):
    """A family of converters: limits, drive, clocks, timing, results, registers."""

    def limits(self) -> dict[str, Limit]:
        """The family's limits by name."""

    def limit(self, name: str) -> float:
        """The value of one limit; KeyError for an unknown name."""

    def drive_current(self, code: int, high_current: bool = False) -> float:
        """Sensor drive current (A) of a code."""

    def high_current_range(self) -> tuple[float, float]:
        """Smallest and largest current (A) of the high-current mode."""

    def amplitude(self, parallel_resistance: float, code: int, high_current: bool = False) -> float:
        """Peak voltage across a tank of R_P (ohm) driven with a code."""

    def amplitude_at(self, parallel_resistance: float, current: float) -> float:
        """Peak voltage across a tank of R_P (ohm) driven with a current (A)."""

    def drive_code(self, parallel_resistance: float) -> int:
        """The strongest code that keeps a tank of R_P (ohm) below the largest amplitude."""

    def reference_divider(self, clock: float, channels: int, external: bool = True) -> int:
        """The smallest divider of a clock (Hz) that some active channels allow."""

    def input_divider(self, sensor_frequency: float, reference_frequency: float = 40e6) -> int:
        """The smallest divider of a sensor frequency (Hz)."""

    def is_input_in_range(self, sensor_frequency: float, divider: int, reference_frequency: float) -> bool:
        """Whether a sensor frequency (Hz) with a divider can be counted."""

    def settle_count(self, quality_factor: float, reference_frequency: float, sensor_frequency: float) -> int:
        """The least setting for the amplitude to settle."""

    def settle_time(self, count: int, reference_frequency: float) -> float:
        """Time (s) for the amplitude to settle."""

    def conversion_time(self, rcount: int, reference_frequency: float) -> float:
        """Time (s) of one conversion."""

    def switch_time(self, reference_frequency: float) -> float:
        """Time (s) from one channel to the next."""

    def dwell_time(self, rcount: int, count: int, reference_frequency: float) -> float:
        """Time (s) spent on one channel of a scan."""

    def scan_time(self, rcount: int, count: int, reference_frequency: float, channels: int) -> float:
        """Time (s) of one scan of some channels."""

    def reference_count(self, scan_rate: float, count: int, reference_frequency: float, channels: int) -> int:
        """The longest conversion with which scans come as often as wanted (Hz)."""

    def read_back_time(self, channels: int, serial_clock: float = 400e3) -> float:
        """Time (s) to read some channels' results."""

    def read_back_time_optimistic(self, channels: int) -> float:
        """The same by the maker's more hopeful figure."""

    def supply_current(self, drive: float, rcount: int, count: int, reference_frequency: float, channels: int) -> float:
        """Current (A) from the supply while converting without pause."""

    def inductance(self, frequency: float, capacitance: float) -> float:
        """Inductance (H) that the maker's formula makes of a frequency (Hz) and a capacitance (F)."""

    def frequency_quantum(self, frequency: float, rcount: int) -> float:
        """Step (Hz) of a measured frequency."""

    def measured_noise(self, frequency: float, rcount: int) -> float:
        """Standard deviation (Hz) of a result as measured sensors have it."""

    def inductance_noise(self, value: float, frequency: float, rcount: int) -> float:
        """Standard deviation (H) of a measured inductance."""

    def registers(
        self,
        channels: tuple[ChannelSettings, ...],
        highest_sensor_frequency: float,
        external_clock: bool = True,
        high_current: bool = False,
    ) -> tuple[Register, ...]:
        """Every register to write after reset, in order; ValueError where a setting does not fit its field."""

    def identity(self) -> Identity:
        """What tells the part."""

    def data_addresses(self, channel: int) -> tuple[int, int]:
        """Addresses of the upper and the lower half of a channel's result, to be read in this order."""

    def data_mask(self) -> int:
        """The result's bits in its upper half."""

    def data_flags(self) -> Mapping[str, tuple[int, str]]:
        """Error flags in the upper half by name: mask and meaning."""
