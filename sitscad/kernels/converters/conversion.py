"""Interface of converters: a converter with settings converts the frequencies of its coils to readings.

All other parts of sitscad use only this interface: resolution, noise, times, highest frequency. Each family has a
module for its conversion, named in the row ``conversion`` of its data file. `ConversionLaw` lists the names that it
must define.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol, cast

from sitscad.basics.quantities import Quantity
from sitscad.basics.record import record
from sitscad.kernels.converters.figures import RowForm, family_module, required_names
from sitscad.kernels.converters.registers import FirmwareText, Register, RegisterMap

if TYPE_CHECKING:
    from sitscad.basics.arrays import Array  # reading a spec loads no numpy


class ConverterPart(Protocol):
    """Attributes of a converter that its conversion module uses (`converter.Converter`)."""

    @property
    def name(self) -> str:
        """Name of the converter in specs and in file names."""

    @property
    def family(self) -> str:
        """Name of the converter family, and of its data file in ``data/converters``."""

    @property
    def part(self) -> str:
        """Name as printed on the part."""

    @property
    def bits(self) -> int:
        """Number of bits of a result."""

    @property
    def result_words(self) -> tuple[str, ...]:
        """Names of the registers of one result."""

    @property
    def register_map(self) -> RegisterMap:
        """Module with the family's registers."""

    @property
    def law(self) -> ConversionLaw:
        """Module with the family's conversion."""

    def limit(self, name: str) -> float:
        """Return a number of the family's data file by row name, in SI units."""

    def source_of(self, name: str) -> str:
        """Return the source of a number in the family's data file by row name. For a row with text, return the text."""


@record
class Demand:
    """Requirements of a sensor for the settings of its converters.

    `clock` (Hz) is the reference clock, `scan_rate` (Hz) the required number of complete scans per second. All
    converters work at the same time; `fewest` and `most` are the smallest and largest number of coils on one converter.
    `tanks` are (frequency (Hz), quality factor) of every tank in every state.
    """

    clock: float
    scan_rate: float
    most: int
    fewest: int
    tanks: tuple[tuple[float, float], ...]


@record
class Conversion(ABC):
    """Converter with its settings, which reads `channels` coils in turn.

    `device` is the converter. Readings are counts, proportional to frequency. Times are in seconds, frequencies in
    hertz.
    """

    device: ConverterPart
    channels: int

    # ------------------------------------------------------------------------------------- what each family supplies

    @property
    @abstractmethod
    def hertz_per_count(self) -> float:
        """Frequency (Hz) that one count represents."""

    @abstractmethod
    def counting_step(self, frequency: float) -> float:
        """Return the smallest difference of frequency (Hz) that counting resolves, before results are rounded."""

    @abstractmethod
    def counting_noise(self, frequency: float) -> float:
        """Return the standard deviation (Hz) of one conversion of a frequency (Hz), before its result is rounded."""

    @property
    @abstractmethod
    def settle_time(self) -> float:
        """Time (s) in which a coil's amplitude settles before its conversion."""

    @property
    @abstractmethod
    def conversion_time(self) -> float:
        """Time (s) of one conversion."""

    @property
    @abstractmethod
    def switch_time(self) -> float:
        """Time (s) from the end of the conversion of one coil to the start of the next coil."""

    @property
    @abstractmethod
    def scan_time(self) -> float:
        """Time (s) of one scan of all channels."""

    @property
    @abstractmethod
    def longest_conversion(self) -> float:
        """Longest time (s) of a conversion that can be set at this clock."""

    @property
    @abstractmethod
    def highest_frequency(self) -> float:
        """Frequency (Hz) that all tanks must stay below, so that they are counted correctly with these settings."""

    @abstractmethod
    def slowest_clock(self, frequency: float) -> float | None:
        """Return the slowest reference clock (Hz) at which some setting can count a frequency (Hz).

        Returns None if the clock does not limit the frequency.
        """

    @abstractmethod
    def supply_current(self, drive: float) -> float:
        """Return the supply current (A) of a converter that converts without pause.

        `drive` (A) is the drive current.
        """

    @abstractmethod
    def covering(self, bands: Sequence[tuple[float, float]]) -> Conversion:
        """Return these settings, changed so that all expected frequencies can be counted.

        `bands` are the lowest and highest frequency (Hz) of each coil.
        """

    # -------------------------------------------------------------------- results that show a part of a conversion

    @property
    def count_bits(self) -> int:
        """Number of bits of a conversion."""
        return self.device.bits

    @property
    def counts_per_step(self) -> int:
        """Difference of two successive results in counts."""
        return 1

    @property
    def offsets(self) -> tuple[int, ...]:
        """Counts subtracted from each coil's conversions before the result is stored.

        Empty if a result has all bits of the conversion.
        """
        return ()

    @property
    def is_partial(self) -> bool:
        """Whether a result of this converter has fewer bits than a conversion."""
        return False

    @property
    def result_settings(self) -> Mapping[str, Any]:
        """Settings that choose which bits of a conversion the result has, by JSON key. Empty if it has all bits."""
        return {}

    @property
    def result_text(self) -> str:
        """Text that states which bits of a conversion the result has. Empty if it has all bits."""
        return ""

    def part(self, coils: slice) -> Conversion:
        """Return the settings for a part of the sensor's coils, given as a slice of their numbers."""
        return self

    # ------------------------------------------------------------------------------------------------------ firmware

    def firmware_text(self, clock: float) -> FirmwareText | None:
        """Return the texts on this conversion in the firmware's header file. None for a family without firmware.

        `clock` is the reference clock in Hz.
        """
        return None

    def registers(
        self, coils: slice, codes: Sequence[int], highest_frequency: float, high_current: bool
    ) -> tuple[Register, ...]:
        """Return the registers of the converter that reads the coils `coils` of the sensor, in the order of writing.

        Parameters
        ----------
        coils
            Coils of the sensor that this converter reads.
        codes
            Drive codes of these coils.
        highest_frequency
            Highest frequency (Hz) of their tanks in all states.
        high_current
            Whether to use the high-current drive.

        Raises
        ------
        ValueError
            if a setting does not fit its field, or if sitscad has no registers of the family.
        """
        raise ValueError(f"sitscad knows no registers of {self.device.part}, and writes no firmware for it")

    # ------------------------------------------------------------------------------------------ the same for each

    @property
    def dwell_time(self) -> float:
        """Time (s) for one channel of a scan: settling, conversion and switching."""
        return self.settle_time + self.conversion_time + self.switch_time

    @property
    def result_step(self) -> float:
        """Difference of frequency (Hz) between two successive results."""
        return self.hertz_per_count * self.counts_per_step

    def resolution(self, frequency: float) -> float:
        """Return the smallest difference (Hz) between two readings at a frequency (Hz).

        It is the larger of `result_step` and `counting_step`.
        """
        return max(self.result_step, self.counting_step(frequency))

    def rounding(self, frequency: float) -> float:
        """Return the standard deviation (Hz) that rounding of results causes, which averaging readings does not reduce.

        It is zero if results are finer than counting, because the counting noise then includes the rounding.
        """
        is_coarse = self.result_step > self.counting_step(frequency)
        return self.result_step / math.sqrt(12.0) if is_coarse else 0.0

    def noise(self, frequency: float) -> float:
        """Return the standard deviation (Hz) of a reading of a frequency (Hz): counting noise and rounding."""
        return math.hypot(self.counting_noise(frequency), self.rounding(frequency))

    def steps(self, frequency: float, other: float) -> float:
        """Return the difference of two frequencies (Hz), divided by the resolution at `frequency`."""
        return abs(other - frequency) / self.resolution(frequency)

    def inductance_step(self, inductance: float, frequency: float) -> float:
        """Return the smallest difference (H) of an inductance (H) computed from a frequency (Hz) at a fixed capacitor.

        It is 2 L / f times the resolution, for the given inductance. The inductance that the converter's formula gives
        for a frequency is larger than the inductance between the contacts.
        """
        return 2.0 * inductance * self.resolution(frequency) / frequency

    def counts(self, frequency: Array) -> Array:
        """Return the counts of frequencies (Hz), without rounding."""
        return frequency / self.hertz_per_count

    def frequencies(self, counts: Array) -> Array:
        """Return the frequencies (Hz) of counts."""
        return counts * self.hertz_per_count

    def read(self, frequency: Array) -> Array:
        """Return the counts (n, coils) in the results for frequencies (n, coils; Hz).

        NaN outside the results' range.
        """
        import numpy as np  # reading a spec loads no numpy

        step = float(self.counts_per_step)
        offsets = np.array(self.offsets or (0,) * np.shape(frequency)[-1], dtype=float)
        result = np.floor((self.counts(frequency) - offsets) / step + 0.5)
        reached = (result > 0.0) & (result < 2.0**self.device.bits - 1.0)
        return np.where(reached, result * step + offsets, np.nan)

    def ends(self, coil: int) -> tuple[int, int]:
        """Return the counts of a coil's smallest and largest result. Both mean that there is no valid reading."""
        offset = self.offsets[coil] if self.offsets else 0
        return offset, offset + (2**self.device.bits - 1) * self.counts_per_step


class ConversionLaw(Protocol):
    """Names that a family's conversion module must define.

    ``REQUIRED_ROWS`` are the rows that it needs in the family's data file, in addition to the rows of every family.
    ``SETTINGS`` are the quantities of its `Conversion` that are printed and written to JSON.
    """

    REQUIRED_ROWS: Mapping[str, RowForm]
    SETTINGS: tuple[Quantity, ...]

    def amplitude(self, parallel_resistance: float, current: float) -> float:
        """Return the peak voltage (V) across a tank with a parallel resistance (ohm) at a drive current (A)."""

    def read_back_time(self, device: ConverterPart, channels: int) -> float:
        """Return the time (s) to read the results of some channels over the bus at its fastest clock."""

    def read_back_time_optimistic(self, device: ConverterPart, channels: int) -> float:
        """Return the time (s) to read the results of some channels, from the manufacturer's shortest stated time."""

    def set_up(self, device: ConverterPart, demand: Demand) -> Conversion:
        """Return the settings with the finest resolution at the required scan rate, or at the nearest possible rate."""


@cache
def conversion_law(name: str) -> ConversionLaw:
    """Return the conversion module with a given name. Raises `DataError` if there is none, or if it lacks a name."""
    return cast(ConversionLaw, family_module("conversion", name, required_names(ConversionLaw)))
