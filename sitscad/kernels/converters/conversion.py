"""How a converter that is set counts: results from frequencies and back, their step and noise, and the part of a
conversion that a result of few bits shows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.converters.converter import Converter

FREE_PART = 0.5
"""Share of a result's range that the frequencies to be expected may take, in its middle: the rest is for loads beside
those of the states."""


@record
class Conversion:
    """How the converters of a sensor count the frequencies of its coils.

    A count is f / (FIN_DIVIDER f_REF) 2^`count_bits`, so readings of one coil are to each other as their frequencies. A
    result of fewer bits shows some of a conversion's: `gain` is the code of OUTPUT_GAIN, `offsets` by coil what is
    taken off before, both 0 where a result shows all.
    """

    device: Converter
    reference_frequency: float
    input_divider: int
    rcount: int
    gain: int = 0
    offsets: tuple[int, ...] = ()

    @property
    def full_scale(self) -> float:
        """The frequency (Hz) of which all counts are parts: FIN_DIVIDER f_REF."""
        return self.input_divider * self.reference_frequency

    @property
    def shift(self) -> int:
        """Bits at a conversion's end that its result does not show: it is so much coarser than counts."""
        return self.device.count_bits - self.device.bits - self.device.gains[self.gain]

    @property
    def resolution(self) -> float:
        """Step (Hz) of a result."""
        return float(self.full_scale * 2.0 ** (self.shift - self.device.count_bits))

    def quantum(self, frequency: float) -> float:
        """Step (Hz) of a reading: what is coarser, its result or what it counts."""
        return max(self.resolution, self.device.count_step(frequency, self.rcount))

    def steps(self, frequency: float, other: float) -> float:
        """Number of steps by which readings of two frequencies (Hz) differ."""
        return abs(other - frequency) / self.quantum(frequency)

    def inductance_step(self, inductance: float, frequency: float) -> float:
        """Step (H) of an inductance (H) that is told from a frequency (Hz) at a fixed capacitor: 2 L / f of its step.
        Which inductance it is counts: the converter's formula makes more of a frequency than the contacts have.
        """
        return 2.0 * inductance * self.quantum(frequency) / frequency

    def rounding(self, frequency: float) -> float:
        """Standard deviation (Hz) of what the rounding of results takes from readings, also from means of them: nothing
        where results are finer than what is counted, as they were where its noise was measured.
        """
        is_coarse = self.resolution > self.device.count_step(frequency, self.rcount)
        return self.resolution / math.sqrt(12.0) if is_coarse else 0.0

    def noise(self, frequency: float) -> float:
        """Standard deviation (Hz) of a reading."""
        return math.hypot(self.device.count_noise(frequency, self.rcount), self.rounding(frequency))

    def counts(self, frequency: Array) -> Array:
        """Counts of frequencies (Hz), not rounded."""
        return np.asarray(frequency / self.full_scale * 2.0**self.device.count_bits)

    def frequencies(self, counts: Array) -> Array:
        """Frequencies (Hz) of counts."""
        return np.asarray(counts / 2.0**self.device.count_bits * self.full_scale)

    def read(self, frequency: Array) -> Array:
        """Counts (n, coils) as results give them of frequencies (Hz); NaN where a result does not reach."""
        step = 2.0**self.shift
        offsets = np.array(self.offsets or (0,) * np.shape(frequency)[-1], dtype=float)
        result = np.floor((self.counts(frequency) - offsets) / step + 0.5)
        reached = (result > 0.0) & (result < 2.0**self.device.bits - 1.0)
        return np.where(reached, result * step + offsets, np.nan)

    def ends(self, coil: int) -> tuple[int, int]:
        """The counts of a coil's smallest and largest result, which say that it has none."""
        offset = self.offsets[coil] if self.offsets else 0
        return offset, offset + ((2**self.device.bits - 1) << self.shift)


def shown(device: Converter, full_scale: float, bands: Sequence[tuple[float, float]]) -> tuple[int, tuple[int, ...]]:
    """The gain's code and every coil's offset with which the results of the frequencies to be expected, `bands` (Hz;
    lowest and highest by coil), are finest and end nowhere: 0 and none for a converter without gains.

    Of a conversion all upper bits have to be the same that a result does not show (SNOSCZ0A 8.1.3.2): the offset brings
    the middle of a band into the middle of what it shows. As f_IN stays below f_REF/4 all fits without gain.
    """
    if not device.has_gains:
        return 0, ()
    scale = 2.0**device.count_bits / full_scale
    gain = max(
        (code for code, bits in enumerate(device.gains)
         if all((high - low) * scale <= FREE_PART * 2.0 ** (device.count_bits - bits) for low, high in bands)),
        default=0, key=lambda code: device.gains[code],
    )
    if not device.gains[gain]:
        return gain, (0,) * len(bands)
    width, step = 2 ** (device.count_bits - device.gains[gain]), 2 ** (max(device.gains) - device.gains[gain])
    return gain, tuple(max(0, round((0.5 * (low + high) * scale - 0.5 * width) / step) * step) for low, high in bands)
