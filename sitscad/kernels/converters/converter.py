"""A converter as a value: what can be bought, its channels, its limits and what it can drive. SI units throughout.

How it times its conversions and counts is a module of its family (`conversion.ConversionLaw`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.converters.conversion import Conversion, ConversionLaw, Demand, conversion_law
from sitscad.kernels.converters.figures import Limit, cited_alone, figure_source, limits_of, numbers, rows_of
from sitscad.kernels.converters.registers import RegisterMap, register_map

DRIVEN_FAMILY = "ldc161x"
"""The family that the driver in ``data/firmware`` is written for."""

CIRCUIT_PINS = frozenset(("SCL", "SDA", "CLKIN", "ADDR", "INTB", "SD", "VDD", "GND"))
"""Pins of the circuit that sitscad draws around a converter, with its clock, pull-ups and capacitors."""

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
    def has_circuit(self) -> bool:
        """Whether sitscad draws its circuit: its pins are those of `CIRCUIT_PINS`."""
        return {name for name, _ in self.pins} == CIRCUIT_PINS

    def coil_pins(self, channel: int | str = "x") -> tuple[str, str]:
        """Pins of the two ends of a channel's coil. Without a number, the names that the data sheet gives all."""
        first, second = self.source_of("coil_pins").replace("x", str(channel)).split()
        return first, second

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
            Channel(number, channel, number // len(self.addresses), self.addresses[number % len(self.addresses)],
                    self.coil_pins(channel))
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
        """Sensor drive currents (A) by code."""
        return numbers(self.family, "drive_currents")

    def drive_current(self, code: int, high_current: bool = False) -> float:
        """Sensor drive current (A) of a code, or of the stronger drive of a single channel (`has_high_current`).

        TI gives 6 mA, more than 3.5 mA and 3 mA (SNOA950) for the high-current mode: the largest is taken here,
        because too large an amplitude is the worse fault; see `high_current_range`.
        """
        return self.limit("high_current_max") if high_current else self.drive_currents[code]

    @property
    def has_high_current(self) -> bool:
        """Whether there is a stronger drive for a single channel."""
        return "high_current_max" in self.limits

    @property
    def high_current_range(self) -> tuple[float, float]:
        """Smallest and largest current (A) that TI's texts give for the high-current mode."""
        return self.limit("high_current_typical"), self.limit("high_current_max")

    def amplitude(self, parallel_resistance: float, code: int, high_current: bool = False) -> float:
        """Peak voltage across the tank of R_P (ohm), driven with a code."""
        return self.amplitude_at(parallel_resistance, self.drive_current(code, high_current))

    def amplitude_at(self, parallel_resistance: float, current: float) -> float:
        """Peak voltage across the tank of R_P (ohm), driven with a current (A)."""
        return self.law.amplitude(parallel_resistance, current)

    def drive_code(self, parallel_resistance: float) -> int:
        """The highest code that keeps the amplitude below the largest (1.8 V of TI's) at `parallel_resistance` (ohm).

        Give the largest R_P of the working range, which is the target at its greatest distance (8.1.5; SNOA950), with
        one sigma of manufacture added where sensors are still to be made. Code 0
        when even that one drives harder; the last when none reaches it: check the amplitude.
        """
        most, law = self.limit("amplitude_max"), self.law
        allowed = [
            code
            for code, current in enumerate(self.drive_currents)
            if law.amplitude(parallel_resistance, current) < most
        ]
        return max(allowed, default=0)

    # ------------------------------------------------------------------------------------------ conversion, results

    @property
    def serial_clock_in_words(self) -> str:
        """Its fastest I2C clock, at which results are taken to be read."""
        return show(self.limit("serial_clock_max"), "Hz")

    @property
    def law(self) -> ConversionLaw:
        """The module that has the family's conversion: its settings, times, resolution and noise."""
        return conversion_law(self.source_of("conversion"))

    def set_up(self, demand: Demand) -> Conversion:
        """The settings that suit a sensor's needs."""
        return self.law.set_up(self, demand)

    def read_back_time(self, channels: int) -> float:
        """Time (s) to read the results of some channels over the bus at its fastest clock."""
        return self.law.read_back_time(self, channels)

    def read_back_time_optimistic(self, channels: int) -> float:
        """Time (s) to read some channels at that clock by the maker's most hopeful figure."""
        return self.law.read_back_time_optimistic(self, channels)

    @property
    def bits(self) -> int:
        """Bits of a result."""
        return int(self.limit("result_bits"))

    @staticmethod
    def inductance(frequency: float, capacitance: float) -> float:
        """Inductance (H) of a tank from its frequency (Hz) and whole capacitance (F): 1 / (C (2 pi f)^2)."""
        return 1.0 / (capacitance * (2.0 * math.pi * frequency) ** 2)

    # ----------------------------------------------------------------------------------------------------- registers

    @property
    def has_registers(self) -> bool:
        """Whether the family states the registers that sitscad writes."""
        return "register_map" in rows_of(self.family)

    @property
    def register_map(self) -> RegisterMap:
        """The module that has addresses, masks and flags, and packs the registers. Raises ValueError if the family has
        none, or if it lacks a name that such a module must have.
        """
        if not self.has_registers:
            raise ValueError(f"sitscad knows no registers of {self.part}, and writes no firmware for it")
        return register_map(self.source_of("register_map"))

    @property
    def device_id(self) -> int:
        """What the part's register for it holds."""
        return int(self.limit("device_id"))

    @property
    def result_words(self) -> tuple[str, ...]:
        """What distinguishes the registers of one result, the upper one first."""
        return tuple(self.source_of("result_registers").split())

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


@record
class Channel:
    """The place where a coil is wired: the converter and its channel, the controller's I2C bus, all from 0, the
    converter's 7-bit address on it, and the pins of the coil's ends.
    """

    converter: int
    number: int
    bus: int
    address: int
    pins: tuple[str, str]

    @property
    def converter_in_words(self) -> str:
        """The converter, counted from 1, with its address, and its bus where that is not the first."""
        bus = f"bus {self.bus + 1}, " if self.bus else ""
        return f"{self.converter + 1} ({bus}0x{self.address:02X})"

    def pin(self, end: str) -> str:
        """The converter's pin for a coil's end, ``A`` or ``B``."""
        return self.pins["AB".index(end)]
