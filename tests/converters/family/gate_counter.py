"""Conversion of the XGC4, which nobody makes: it counts the sensor's periods while a gate is open."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from sitscad.basics.quantities import Quantity
from sitscad.basics.record import record, replace
from sitscad.kernels.converters.conversion import Conversion, ConverterPart, Demand
from sitscad.kernels.converters.figures import RowForm

REQUIRED_ROWS: Mapping[str, RowForm] = {
    "gate_min": RowForm("s", 1e-6, 1.0),
    "gate_max": RowForm("s", 1e-6, 10.0),
    "start_time": RowForm("s", 0.0, 1.0),
    "switch_time": RowForm("s", 0.0, 1.0),
    "bits_per_transfer": RowForm("bit", 1, 100, whole=True),
}

SETTINGS = (Quantity("gate_s", "gate"),)


def amplitude(parallel_resistance: float, current: float) -> float:
    """Peak voltage (V) by a sine wave's peak current (A)."""
    return parallel_resistance * current


def read_back_time(device: ConverterPart, channels: int) -> float:
    """Time (s) to read results of some channels."""
    return channels * device.limit("bits_per_transfer") / device.limit("serial_clock_max")


read_back_time_optimistic = read_back_time


@record
class GateCounter(Conversion):
    """A gate (s), open for each channel in turn."""

    gate: float

    @property
    def hertz_per_count(self) -> float:
        """Frequency (Hz) of one period in the gate."""
        return 1.0 / self.gate

    def counting_step(self, frequency: float) -> float:
        """One period in the gate (Hz)."""
        return 1.0 / self.gate

    def counting_noise(self, frequency: float) -> float:
        """Standard deviation (Hz) of +-1 count: both ends of the gate fall anywhere in a period."""
        return 1.0 / (math.sqrt(6.0) * self.gate)

    @property
    def settle_time(self) -> float:
        """Time (s) for the amplitude to settle."""
        return self.device.limit("start_time")

    @property
    def conversion_time(self) -> float:
        """The gate (s)."""
        return self.gate

    @property
    def switch_time(self) -> float:
        """Time (s) to the next channel."""
        return self.device.limit("switch_time")

    @property
    def scan_time(self) -> float:
        """Time (s) of all channels."""
        return self.channels * self.dwell_time

    @property
    def longest_conversion(self) -> float:
        """The longest gate (s)."""
        return self.device.limit("gate_max")

    @property
    def highest_frequency(self) -> float:
        """Frequency (Hz) that fills the result."""
        return (2**self.device.bits - 1) / self.gate

    def slowest_clock(self, frequency: float) -> float | None:
        """None: the clock times the gate and compares no frequencies."""
        return None

    def supply_current(self, drive: float) -> float:
        """Supply (A): all tanks are driven all the time."""
        return self.device.limit("supply_current") + self.channels * drive

    def covering(self, bands: Sequence[tuple[float, float]]) -> GateCounter:
        """A gate that no tank's count overflows."""
        highest = max(high for _, high in bands)
        return replace(self, gate=min(self.gate, (2**self.device.bits - 2) / highest))


def set_up(device: ConverterPart, demand: Demand) -> GateCounter:
    """The longest gate that reaches the wanted scan rate."""
    free = 1.0 / (demand.scan_rate * demand.most) - device.limit("start_time") - device.limit("switch_time")
    return GateCounter(device, demand.most, min(device.limit("gate_max"), max(device.limit("gate_min"), free)))
