"""A converter as a value: what can be bought, what it can drive, how it times its conversions and counts.

The formulas are those of TI's multi-channel inductance converters (LDC1312 to LDC1614), which differ in their results
and figures (`figures`); a converter of another family has to be timed like them. SI units throughout.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.converters.figures import Limit, cited_alone, figure_source, limits_of, numbers
from sitscad.kernels.converters.registers import ChannelSettings, Register, RegisterMap, register_map

DRIVEN_FAMILY = "ldc161x"
"""The family that the driver in ``data/firmware`` is written for."""


MOST_RCOUNT = 0xFFFF
"""Largest RCOUNT: the register has 16 bits."""


@record
class Converter:
    """A converter that can be bought: its channels, the 7-bit addresses that one bus has for it, and its package.

    ``family`` names the file of figures that it shares with the other parts of its data sheet.
    """

    name: str
    family: str
    channels: int
    addresses: tuple[int, ...]
    package: str = ""
    source: str = ""

    # ------------------------------------------------------------------------------------------ parts and channels

    @property
    def part(self) -> str:
        """The name as it is printed on the part."""
        return self.name.upper()

    @property
    def pins(self) -> tuple[tuple[str, str], ...]:
        """Pins from 1 before those of the coils: names and KiCad's electrical types."""
        return tuple((name, kind) for name, _, kind in (pin.partition(":") for pin in self.source_of("pins").split()))

    @property
    def address_nets(self) -> tuple[str, ...]:
        """What its pin ADDR is tied to for each of its addresses, in their order."""
        return tuple(self.source_of("address_nets").split())

    def address_net(self, address: int) -> str:
        """What its pin ADDR is tied to for an address."""
        return self.address_nets[self.addresses.index(address)]

    @property
    def has_driver(self) -> bool:
        """Whether driver and bench are written for it: results of one word each are another driver."""
        return self.family == DRIVEN_FAMILY

    @property
    def most_coils(self) -> int:
        """How many coils can be read over one bus."""
        return self.channels * len(self.addresses)

    def needed(self, coils: int) -> int:
        """How many converters so many coils take."""
        return math.ceil(coils / self.channels)

    def shares(self, coils: int) -> tuple[int, ...]:
        """Channels in use on each converter, all alike or the first ones one more: they run at the same time, and the
        one with the most coils has the least time for each.
        """
        number = self.needed(coils)
        each, more = divmod(coils, number)
        return (each + 1,) * more + (each,) * (number - more)

    def places(self, coils: int) -> tuple[Channel, ...]:
        """The channel of every coil, in the array's order; a bus that is full is followed by the next."""
        return tuple(
            Channel(number, channel, number // len(self.addresses), self.addresses[number % len(self.addresses)])
            for number, share in enumerate(self.shares(coils))
            for channel in range(share)
        )

    # --------------------------------------------------------------------------------------------- figures and words

    @property
    def limits(self) -> Mapping[str, Limit]:
        """The family's figures by name."""
        return limits_of(self.family)

    def limit(self, name: str) -> float:
        """The value of one figure, in SI units; KeyError for an unknown name."""
        return limits_of(self.family)[name].value

    def source_of(self, name: str) -> str:
        """The source of a figure or an equation; of a row of words these. KeyError for an unknown name."""
        return figure_source(self.family, name)

    def cited_alone(self, text: str) -> str:
        """A text that cites all families (`source_in_all`), with what it says of this one alone."""
        return cited_alone(self.family, text)

    # ------------------------------------------------------------------------------------------- drive and amplitude

    @property
    def drive_currents(self) -> tuple[float, ...]:
        """Sensor drive currents (A, peak of the square wave) by code."""
        return numbers(self.family, "drive_currents")

    def drive_current(self, code: int, high_current: bool = False) -> float:
        """Sensor drive current (A, peak of the square wave) of a code; `high_current`: channel 0 alone, last code.

        TI gives 6 mA, more than 3.5 mA and 3 mA (SNOA950) for the high-current mode: the largest is taken here,
        because too large an amplitude is the worse fault; see `high_current_range`.
        """
        return self.limit("high_current_max") if high_current else self.drive_currents[code]

    @property
    def high_current_range(self) -> tuple[float, float]:
        """Smallest and largest current (A) that TI's texts give for the high-current mode."""
        return self.limit("high_current_typical"), self.limit("high_current_max")

    def amplitude(self, parallel_resistance: float, code: int, high_current: bool = False) -> float:
        """Peak voltage across the tank of R_P (ohm), driven with a code."""
        return self.amplitude_at(parallel_resistance, self.drive_current(code, high_current))

    @staticmethod
    def amplitude_at(parallel_resistance: float, current: float) -> float:
        """Peak voltage across the tank: V_P = 4 R_P I / pi (8.1.5), R_P in ohm, I the drive current (A)."""
        return 4.0 * parallel_resistance * current / math.pi

    def drive_code(self, parallel_resistance: float) -> int:
        """The highest code that keeps the amplitude below the largest (1.8 V of TI's) at `parallel_resistance` (ohm).

        Give the largest R_P of the working range, which is the target at its greatest distance (8.1.5; SNOA950), with
        one sigma of manufacture added where sensors are still to be made. Code 0
        when even that one drives harder; the last when none reaches it: check the amplitude.
        """
        most = self.limit("amplitude_max")
        allowed = [
            code
            for code, current in enumerate(self.drive_currents)
            if self.amplitude_at(parallel_resistance, current) < most
        ]
        return max(allowed, default=0)

    # ------------------------------------------------------------------------------------------------------- clocks

    def reference_divider(self, clock: float, channels: int, external: bool = True) -> int:
        """FREF_DIVIDER for a clock (Hz): the smallest that brings f_REF within its limit for that many active channels.

        For several converters with one divider give the fewest channels of any: a single one is held to less.
        """
        source = "single" if channels == 1 else "multi_external" if external else "multi_internal"
        return max(1, math.ceil(clock / self.limit(f"reference_{source}_max") - 1e-9))

    def input_divider(self, sensor_frequency: float, reference_frequency: float = 40e6) -> int:
        """FIN_DIVIDER: the smallest with f_IN < f_REF/4, at least 2 from 8.75 MHz. In Hz.

        May exceed 15, the largest that the register holds: `is_input_in_range` says so.
        """
        ceiling = self.limit("input_to_reference_max") * reference_frequency
        divider = math.floor(sensor_frequency / ceiling * (1.0 + 1e-12)) + 1
        return max(divider, 2) if sensor_frequency >= self.limit("input_divider_2_from") else divider

    def is_input_in_range(self, sensor_frequency: float, divider: int, reference_frequency: float) -> bool:
        """Whether a sensor frequency (Hz) with a FIN_DIVIDER may be counted at a reference frequency (Hz)."""
        if not 1 <= divider <= 15 or (divider < 2 and sensor_frequency >= self.limit("input_divider_2_from")):
            return False
        return sensor_frequency / divider < self.limit("input_to_reference_max") * reference_frequency

    # ------------------------------------------------------------------------------------------------------- timing

    def settle_count(self, quality_factor: float, reference_frequency: float, sensor_frequency: float) -> int:
        """Smallest SETTLECOUNT: Q f_REF / (16 f_SENSOR) rounded up (8.1.4.1), and above 3."""
        needed = math.ceil(quality_factor * reference_frequency / (16.0 * sensor_frequency) - 1e-9)
        return min(MOST_RCOUNT, max(int(self.limit("settle_count_min")), needed))

    @staticmethod
    def settle_time(count: int, reference_frequency: float) -> float:
        """Time (s) for the amplitude to settle: 16 SETTLECOUNT / f_REF (8.1.4.1); 32 / f_REF for 0 and 1."""
        return max(2, count) * 16.0 / reference_frequency

    @staticmethod
    def conversion_time(rcount: int, reference_frequency: float) -> float:
        """Time (s) of one conversion: (16 RCOUNT + 4) / f_REF (8.1.4)."""
        return (16.0 * rcount + 4.0) / reference_frequency

    def switch_time(self, reference_frequency: float) -> float:
        """Typical time (s) from one channel's conversion to the next channel: 692 ns + 5 / f_REF (8.1.4)."""
        return self.limit("switch_delay") + 5.0 / reference_frequency

    def dwell_time(self, rcount: int, count: int, reference_frequency: float) -> float:
        """Time (s) spent on one channel of a scan: settling, conversion and switch delay (8.1.4.1)."""
        return (
            self.settle_time(count, reference_frequency)
            + self.conversion_time(rcount, reference_frequency)
            + self.switch_time(reference_frequency)
        )

    def scan_time(self, rcount: int, count: int, reference_frequency: float, channels: int) -> float:
        """Time (s) of one scan of `channels` alike channels.

        One channel alone converts without settling again (figure 54); the switch delay stands in for the pause between
        two conversions, which TI does not state.
        """
        if channels == 1:
            return self.conversion_time(rcount, reference_frequency) + self.switch_time(reference_frequency)
        return channels * self.dwell_time(rcount, count, reference_frequency)

    def reference_count(self, scan_rate: float, count: int, reference_frequency: float, channels: int) -> int:
        """Largest RCOUNT whose scans of `channels` channels come at least `scan_rate` (Hz) times a second.

        Kept within its least and 0xFFFF: at the lower end the wanted rate is not reached, at the upper end it is
        exceeded; `scan_time` tells.
        """
        overhead = self.scan_time(0, count, reference_frequency, channels) / channels
        periods = (1.0 / (scan_rate * channels) - overhead) * reference_frequency
        return min(MOST_RCOUNT, max(int(self.limit("rcount_min")), math.floor(periods / 16.0 + 1e-9)))

    @property
    def serial_clock_in_words(self) -> str:
        """Its fastest I2C clock, at which results are taken to be read."""
        return show(self.limit("serial_clock_max"), "Hz")

    def read_back_time(self, channels: int) -> float:
        """Time (s) to read the results of some channels over I2C at its fastest clock.

        A register takes five frames of nine bits each plus start, repeated start, stop and bus-free time: 49 bits,
        which is what the 4.08 kSPS at 400 kHz of a result in two registers come to (SNOSCY9A figure 12, 6.5).
        """
        return channels * len(self.result_words) * 49.0 / self.limit("serial_clock_max")

    def read_back_time_optimistic(self, channels: int) -> float:
        """Time (s) to read some channels at that clock by the maker's more hopeful figure: fewer bits than it shows."""
        return channels * self.limit("read_back_four_channels") / 4.0

    def supply_current(self, drive: float, rcount: int, count: int, reference_frequency: float, channels: int) -> float:
        """Current (A) from VDD while converting without pause: I_DD and the drive current for the time it flows.

        I_DD does not include the sensor's (6.5); a sensor is driven while its channel settles and converts, and
        grounded while the next is switched in (8.1.5.1). TI's typical curves lie about 0.5 mA below such a sum.
        """
        driven = self.settle_time(count, reference_frequency) + self.conversion_time(rcount, reference_frequency)
        duty = 1.0 if channels == 1 else driven / (driven + self.switch_time(reference_frequency))
        return self.limit("supply_current") + duty * drive

    # --------------------------------------------------------------------------------------------- results and noise

    @property
    def bits(self) -> int:
        """Bits of a result."""
        return int(self.limit("result_bits"))

    @property
    def device_id(self) -> int:
        """What the part's register for it holds."""
        return int(self.limit("device_id"))

    @property
    def gains(self) -> tuple[int, ...]:
        """Bits by which a result is shifted to the left before its upper bits are dropped, by the gain's code."""
        return tuple(map(int, numbers(self.family, "output_gains")))

    @property
    def has_gains(self) -> bool:
        """Whether gain and offset choose which part of a conversion is the result."""
        return len(self.gains) > 1

    @property
    def count_bits(self) -> int:
        """Bits of a conversion, of which the result shows all or some: f / (FIN_DIVIDER f_REF) is a count over this
        power of 2.
        """
        return self.bits + max(self.gains)

    @property
    def result_words(self) -> tuple[str, ...]:
        """What distinguishes the registers of one result, the upper one first."""
        return tuple(self.source_of("result_registers").split())

    @staticmethod
    def inductance(frequency: float, capacitance: float) -> float:
        """Inductance (H) of a tank from its frequency (Hz) and whole capacitance (F): 1 / (C (2 pi f)^2) (8.1.2)."""
        return 1.0 / (capacitance * (2.0 * math.pi * frequency) ** 2)

    def count_step(self, frequency: float, rcount: int) -> float:
        """Step (Hz) of a counted frequency: one reference period in 16 RCOUNT of them. Derived here, not TI's."""
        return frequency / (16.0 * rcount)

    def count_noise(self, frequency: float, rcount: int) -> float:
        """Standard deviation (Hz) of a conversion as measured sensors have it: some steps of half a reference period in
        16 RCOUNT of them, so 3.3 ppm at RCOUNT 9471.
        """
        return self.limit("noise_steps") * frequency / (32.0 * rcount)

    # ----------------------------------------------------------------------------------------------------- registers

    @property
    def register_map(self) -> RegisterMap:
        """The module of this room that has addresses, masks and flags, and packs the registers. Raises ValueError
        where it lacks what such a module must have.
        """
        return register_map(self.source_of("register_map"))

    @property
    def result_mask(self) -> int:
        """The result's bits in its upper or only register; the flags stand above them."""
        return (1 << self.bits - 16 * (len(self.result_words) - 1)) - 1

    @property
    def covered_flags(self) -> tuple[str, ...]:
        """Error flags whose bits the results take: none, or the register map is not that of the family."""
        flags = self.register_map.DATA_FLAGS.items()
        return tuple(name for name, (flag, _) in flags if flag & self.result_mask)

    def data_addresses(self, channel: int) -> tuple[int, ...]:
        """Addresses of a channel's result, upper register first and to be read in this order."""
        if not 0 <= channel < self.channels:
            raise ValueError(f"channel is {channel}; it must lie in 0 to {self.channels - 1}")
        return self.register_map.data_addresses(channel, len(self.result_words))

    def registers(
        self,
        channels: tuple[ChannelSettings, ...],
        highest_sensor_frequency: float,
        external_clock: bool = True,
        high_current: bool = False,
        output_gain: int = 0,
    ) -> tuple[Register, ...]:
        """Every register to write after reset, in order; ValueError where a setting does not fit its field."""
        gain = output_gain if self.has_gains else None
        return self.register_map.registers(channels, highest_sensor_frequency, external_clock, high_current, gain)


@record
class Channel:
    """The place where a coil is wired: the converter and its channel, the controller's I2C bus, all from 0, and the
    converter's 7-bit address on it.
    """

    converter: int
    number: int
    bus: int
    address: int

    @property
    def converter_in_words(self) -> str:
        """The converter, counted from 1, with its address, and its bus where that is not the first."""
        bus = f"bus {self.bus + 1}, " if self.bus else ""
        return f"{self.converter + 1} ({bus}0x{self.address:02X})"

    def pin(self, end: str) -> str:
        """The converter's pin for a coil's end, ``A`` or ``B``."""
        return f"IN{self.number}{end}"
