"""The interface of converters: one that is set turns the frequencies of its coils into readings.

The rest of sitscad asks in these words alone: resolution, noise, times, the highest frequency. How a family converts is
its own module, which the row ``conversion`` of its figures names: `ConversionLaw` says what that has to have.
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
    """A converter as its conversion sees it (`converter.Converter`)."""

    @property
    def name(self) -> str:
        """Name in specs and of files."""

    @property
    def family(self) -> str:
        """Name of its figures."""

    @property
    def part(self) -> str:
        """The name as it is printed on the part."""

    @property
    def bits(self) -> int:
        """Bits of a result."""

    @property
    def result_words(self) -> tuple[str, ...]:
        """Names of the registers of one result."""

    @property
    def register_map(self) -> RegisterMap:
        """The module of its registers."""

    @property
    def law(self) -> ConversionLaw:
        """The module of its conversion."""

    def limit(self, name: str) -> float:
        """One of its figures, in SI units."""

    def source_of(self, name: str) -> str:
        """The source of a figure, or the words of a row."""


@record
class Demand:
    """Needs of a sensor that its converters are set for.

    `clock` (Hz) is the reference clock, `scan_rate` (Hz) the wanted number of complete scans a second. Converters read
    `most` coils each or `fewest`, at the same time. `tanks` are the frequency (Hz) and quality factor of every tank in
    every state.
    """

    clock: float
    scan_rate: float
    most: int
    fewest: int
    tanks: tuple[tuple[float, float], ...]


@record
class Conversion(ABC):
    """A converter that is set, with `channels` coils that it reads in turn.

    Readings are counts, in proportion to the frequency. Times are in seconds, frequencies in hertz.
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
        """Smallest difference (Hz) between two frequencies that counting resolves, before results are rounded."""

    @abstractmethod
    def counting_noise(self, frequency: float) -> float:
        """Standard deviation (Hz) of one conversion, before its result is rounded."""

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
        """Frequency (Hz) that all tanks have to stay below to be counted rightly with these settings."""

    @abstractmethod
    def slowest_clock(self, frequency: float) -> float | None:
        """Slowest reference clock (Hz) at which some setting counts a frequency (Hz). None if no clock limits it."""

    @abstractmethod
    def supply_current(self, drive: float) -> float:
        """Supply current (A) of one converter that converts without pause, with a drive current (A)."""

    @abstractmethod
    def covering(self, bands: Sequence[tuple[float, float]]) -> Conversion:
        """Settings for all frequencies to be expected: `bands` are lowest and highest (Hz) of each coil."""

    # -------------------------------------------------------------------- results that show a part of a conversion

    @property
    def count_bits(self) -> int:
        """Bits of a conversion."""
        return self.device.bits

    @property
    def counts_per_step(self) -> int:
        """Counts between two results that follow each other."""
        return 1

    @property
    def offsets(self) -> tuple[int, ...]:
        """Counts taken from each coil's conversions before the result. Empty if a result shows all of a conversion."""
        return ()

    @property
    def is_partial(self) -> bool:
        """Whether a result can show a part of a conversion only."""
        return False

    @property
    def result_settings(self) -> Mapping[str, Any]:
        """Settings that choose the part of a conversion, by their JSON keys. Empty if results show all."""
        return {}

    @property
    def result_text(self) -> str:
        """Which part of a conversion results show. Empty if they show all."""
        return ""

    def part(self, coils: slice) -> Conversion:
        """The settings as some of the sensor's coils have them."""
        return self

    # ------------------------------------------------------------------------------------------------------ firmware

    def firmware_text(self, clock: float) -> FirmwareText | None:
        """Wording of this conversion for the firmware's header. None for a family without firmware."""
        return None

    def registers(
        self, coils: slice, codes: Sequence[int], highest_frequency: float, high_current: bool
    ) -> tuple[Register, ...]:
        """Registers of the converter that reads `coils` of the sensor, in the order of writing.

        `codes` are their drive codes, `highest_frequency` (Hz) is that of their tanks in all states. Raises ValueError
        if a setting does not fit its field, or if sitscad knows no registers of the family.
        """
        raise ValueError(f"sitscad knows no registers of {self.device.part}, and writes no firmware for it")

    # ------------------------------------------------------------------------------------------ the same for each

    @property
    def dwell_time(self) -> float:
        """Time (s) spent on one channel of a scan: settling, conversion and switching."""
        return self.settle_time + self.conversion_time + self.switch_time

    @property
    def result_step(self) -> float:
        """Step (Hz) of a result."""
        return self.hertz_per_count * self.counts_per_step

    def resolution(self, frequency: float) -> float:
        """Step (Hz) of a reading: the coarser of its result and of counting."""
        return max(self.result_step, self.counting_step(frequency))

    def rounding(self, frequency: float) -> float:
        """Standard deviation (Hz) by the rounding of results, which means of readings keep. Zero if results are finer
        than counting: its noise contains that already.
        """
        is_coarse = self.result_step > self.counting_step(frequency)
        return self.result_step / math.sqrt(12.0) if is_coarse else 0.0

    def noise(self, frequency: float) -> float:
        """Standard deviation (Hz) of a reading."""
        return math.hypot(self.counting_noise(frequency), self.rounding(frequency))

    def steps(self, frequency: float, other: float) -> float:
        """Number of steps by which readings of two frequencies (Hz) differ."""
        return abs(other - frequency) / self.resolution(frequency)

    def inductance_step(self, inductance: float, frequency: float) -> float:
        """Step (H) of an inductance (H) computed from a frequency (Hz) at a fixed capacitor: 2 L / f of its step.
        It matters which inductance that is: the converter's formula makes more of a frequency than the contacts have.
        """
        return 2.0 * inductance * self.resolution(frequency) / frequency

    def counts(self, frequency: Array) -> Array:
        """Counts of frequencies (Hz), not rounded."""
        return frequency / self.hertz_per_count

    def frequencies(self, counts: Array) -> Array:
        """Frequencies (Hz) of counts."""
        return counts * self.hertz_per_count

    def read(self, frequency: Array) -> Array:
        """Counts (n, coils) of frequencies (Hz) as results give them. NaN if a frequency is beyond the result."""
        import numpy as np  # reading a spec loads no numpy

        step = float(self.counts_per_step)
        offsets = np.array(self.offsets or (0,) * np.shape(frequency)[-1], dtype=float)
        result = np.floor((self.counts(frequency) - offsets) / step + 0.5)
        reached = (result > 0.0) & (result < 2.0**self.device.bits - 1.0)
        return np.where(reached, result * step + offsets, np.nan)

    def ends(self, coil: int) -> tuple[int, int]:
        """Counts of a coil's smallest and largest result, which both mean that there is no reading."""
        offset = self.offsets[coil] if self.offsets else 0
        return offset, offset + (2**self.device.bits - 1) * self.counts_per_step


class ConversionLaw(Protocol):
    """Names that a family's module of conversion must have.

    ``ASKED`` are the rows that it asks of the family's figures beside those of every family, ``SETTINGS`` the
    quantities of its `Conversion` that are printed and stand in JSON.
    """

    ASKED: Mapping[str, RowForm]
    SETTINGS: tuple[Quantity, ...]

    def amplitude(self, parallel_resistance: float, current: float) -> float:
        """Peak voltage (V) across a tank of R_P (ohm) by a drive current (A)."""

    def read_back_time(self, device: ConverterPart, channels: int) -> float:
        """Time (s) to read the results of some channels over the bus at its fastest clock."""

    def read_back_time_optimistic(self, device: ConverterPart, channels: int) -> float:
        """The same time (s) by the maker's most hopeful figure."""

    def set_up(self, device: ConverterPart, demand: Demand) -> Conversion:
        """The settings that resolve most at the wanted scan rate, or come nearest to that rate."""


@cache
def conversion_law(name: str) -> ConversionLaw:
    """Return a family's module of conversion. Raises `DataError` if there is none, or if it lacks a name."""
    return cast(ConversionLaw, family_module("conversion", name, names_of(ConversionLaw)))
