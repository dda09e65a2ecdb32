"""Interface of converters: a converter with settings converts the frequencies of its coils to readings.

All other parts of sitscad use this interface alone: resolution, noise, times, highest frequency. Each family has a
module for its conversion, named in the row ``conversion`` of its figures. `ConversionLaw` lists the names that it must
define.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol, cast

from sitscad.basics.quantities import Quantity
from sitscad.basics.record import record
from sitscad.kernels.converters.figures import RowForm, family_module, names_of
from sitscad.kernels.converters.registers import FirmwareText, Register, RegisterMap

if TYPE_CHECKING:
    from sitscad.basics.arrays import Array  # reading a spec loads no numpy


class ConverterPart(Protocol):
    """Properties of a converter that its conversion uses (`converter.Converter`)."""

    @property
    def name(self) -> str:
        """Name in specs and of files."""

    @property
    def family(self) -> str:
        """Name of the family, and of its data file in ``data/converters``."""

    @property
    def part(self) -> str:
        """Name as printed on the part."""

    @property
    def bits(self) -> int:
        """Bits of a result."""

    @property
    def result_words(self) -> tuple[str, ...]:
        """Names of the registers of one result."""

    @property
    def register_map(self) -> RegisterMap:
        """Module of the registers."""

    @property
    def law(self) -> ConversionLaw:
        """Module of the conversion."""

    def limit(self, name: str) -> float:
        """Return the value of a row of the family's data file by name, in SI units."""

    def source_of(self, name: str) -> str:
        """Return the source of a row of the data file by name, or its text if the row has no number."""


@record
class Demand:
    """Requirements of a sensor on the settings of its converters.

    `clock` (Hz) is the reference clock, `scan_rate` (Hz) the required number of complete scans per second. All
    converters work at the same time; `fewest` and `most` are the smallest and largest number of coils on one converter.
    `tanks` are the frequency (Hz) and quality factor of every tank in every state.
    """

    clock: float
    scan_rate: float
    most: int
    fewest: int
    tanks: tuple[tuple[float, float], ...]


@record
class Conversion(ABC):
    """Converter with its settings, which reads `channels` coils in turn.

    Readings are counts, proportional to frequency. Times are in seconds, frequencies in hertz.
    """

    device: ConverterPart
    channels: int

    # ------------------------------------------------------------------------------------- what each family supplies

    @property
    @abstractmethod
    def hertz_per_count(self) -> float:
        """Frequency (Hz) of one count."""

    @abstractmethod
    def counting_step(self, frequency: float) -> float:
        """Return the frequency step (Hz) that counting resolves, before results are rounded."""

    @abstractmethod
    def counting_noise(self, frequency: float) -> float:
        """Return the standard deviation (Hz) of one conversion, before its result is rounded."""

    @property
    @abstractmethod
    def settle_time(self) -> float:
        """Time (s) for a coil's amplitude to settle before its conversion."""

    @property
    @abstractmethod
    def conversion_time(self) -> float:
        """Time (s) of one conversion."""

    @property
    @abstractmethod
    def switch_time(self) -> float:
        """Time (s) from the conversion of one coil to the next coil."""

    @property
    @abstractmethod
    def scan_time(self) -> float:
        """Time (s) of one scan of all channels."""

    @property
    @abstractmethod
    def longest_conversion(self) -> float:
        """Longest conversion (s) that the converter can be set to at this clock."""

    @property
    @abstractmethod
    def highest_frequency(self) -> float:
        """Frequency (Hz) that all tanks must stay below to be counted correctly with these settings."""

    @abstractmethod
    def slowest_clock(self, frequency: float) -> float | None:
        """Return the slowest reference clock (Hz) at which some setting counts a frequency (Hz).

        Returns None if no clock limits it.
        """

    @abstractmethod
    def supply_current(self, drive: float) -> float:
        """Return the supply current (A) of a converter that converts without pause, at a drive current (A)."""

    @abstractmethod
    def covering(self, bands: Sequence[tuple[float, float]]) -> Conversion:
        """Return settings for all expected frequencies. `bands` are the lowest and highest (Hz) of each coil."""

    # -------------------------------------------------------------------- results that show a part of a conversion

    @property
    def count_bits(self) -> int:
        """Bits of a conversion."""
        return self.device.bits

    @property
    def counts_per_step(self) -> int:
        """Counts between two successive results."""
        return 1

    @property
    def offsets(self) -> tuple[int, ...]:
        """Counts subtracted from each coil's conversions before the result. Empty if results show whole conversions."""
        return ()

    @property
    def is_partial(self) -> bool:
        """Whether a result can show only a part of a conversion."""
        return False

    @property
    def result_settings(self) -> Mapping[str, Any]:
        """Settings that choose the part of a conversion, by JSON key. Empty if results show whole conversions."""
        return {}

    @property
    def result_text(self) -> str:
        """Text on the part of a conversion that results show. Empty if they show whole conversions."""
        return ""

    def part(self, coils: slice) -> Conversion:
        """Return the settings for some of the sensor's coils."""
        return self

    # ------------------------------------------------------------------------------------------------------ firmware

    def firmware_text(self, clock: float) -> FirmwareText | None:
        """Return the text on this conversion for the firmware's header. None for a family without firmware."""
        return None

    def registers(
        self, coils: slice, codes: Sequence[int], highest_frequency: float, high_current: bool
    ) -> tuple[Register, ...]:
        """Return the registers of the converter that reads `coils` of the sensor, in the order of writing.

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
        """Time (s) spent on one channel of a scan: settling, conversion and switching."""
        return self.settle_time + self.conversion_time + self.switch_time

    @property
    def result_step(self) -> float:
        """Frequency step (Hz) of a result."""
        return self.hertz_per_count * self.counts_per_step

    def resolution(self, frequency: float) -> float:
        """Return the frequency step (Hz) of a reading: the coarser of its result's step and the counting step."""
        return max(self.result_step, self.counting_step(frequency))

    def rounding(self, frequency: float) -> float:
        """Return the standard deviation (Hz) by the rounding of results, which averaging readings does not reduce.

        Zero if results are finer than counting, because the counting noise then includes the rounding.
        """
        is_coarse = self.result_step > self.counting_step(frequency)
        return self.result_step / math.sqrt(12.0) if is_coarse else 0.0

    def noise(self, frequency: float) -> float:
        """Return the standard deviation (Hz) of a reading."""
        return math.hypot(self.counting_noise(frequency), self.rounding(frequency))

    def steps(self, frequency: float, other: float) -> float:
        """Return the number of steps by which readings of two frequencies (Hz) differ."""
        return abs(other - frequency) / self.resolution(frequency)

    def inductance_step(self, inductance: float, frequency: float) -> float:
        """Return the step (H) of an inductance (H) computed from a frequency (Hz) at a fixed capacitor.

        It is 2 L / f times the frequency step, for the given inductance. The converter's formula gives a larger
        inductance for a frequency than there is between the contacts.
        """
        return 2.0 * inductance * self.resolution(frequency) / frequency

    def counts(self, frequency: Array) -> Array:
        """Return the counts of frequencies (Hz), not rounded."""
        return frequency / self.hertz_per_count

    def frequencies(self, counts: Array) -> Array:
        """Return the frequencies (Hz) of counts."""
        return counts * self.hertz_per_count

    def read(self, frequency: Array) -> Array:
        """Return the counts (n, coils) that results contain for frequencies (n, coils; Hz). NaN outside their range."""
        import numpy as np  # reading a spec loads no numpy

        step = float(self.counts_per_step)
        offsets = np.array(self.offsets or (0,) * np.shape(frequency)[-1], dtype=float)
        result = np.floor((self.counts(frequency) - offsets) / step + 0.5)
        reached = (result > 0.0) & (result < 2.0**self.device.bits - 1.0)
        return np.where(reached, result * step + offsets, np.nan)

    def ends(self, coil: int) -> tuple[int, int]:
        """Return the counts of a coil's smallest and largest result. Both mean that there is no reading."""
        offset = self.offsets[coil] if self.offsets else 0
        return offset, offset + (2**self.device.bits - 1) * self.counts_per_step


class ConversionLaw(Protocol):
    """Names that a family's conversion module must define.

    ``REQUIRED_ROWS`` are the rows that it needs in the family's figures, in addition to the rows of every family.
    ``SETTINGS`` are the quantities of its `Conversion` that are printed and written to JSON.
    """

    REQUIRED_ROWS: Mapping[str, RowForm]
    SETTINGS: tuple[Quantity, ...]

    def amplitude(self, parallel_resistance: float, current: float) -> float:
        """Return the peak voltage (V) across a tank of R_P (ohm) at a drive current (A)."""

    def read_back_time(self, device: ConverterPart, channels: int) -> float:
        """Return the time (s) to read the results of some channels over the bus at its fastest clock."""

    def read_back_time_optimistic(self, device: ConverterPart, channels: int) -> float:
        """Return the time of `read_back_time` (s) by the manufacturer's shortest value."""

    def set_up(self, device: ConverterPart, demand: Demand) -> Conversion:
        """Return the settings with the finest resolution at the wanted scan rate, or nearest to that rate."""


@cache
def conversion_law(name: str) -> ConversionLaw:
    """Return a family's conversion module. Raises `DataError` if there is none, or if it lacks a name."""
    return cast(ConversionLaw, family_module("conversion", name, names_of(ConversionLaw)))
