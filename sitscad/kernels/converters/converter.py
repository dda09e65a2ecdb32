"""Converters (parts that measure the coils' frequencies): channels, addresses, limits and drive. SI units throughout.

Timing and counting are in a separate module for each family (`conversion.ConversionLaw`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.converters.conversion import Conversion, ConversionLaw, Demand, conversion_law
from sitscad.kernels.converters.figures import Limit, family_limits, family_rows, limit_with_source, numbers, row_source
from sitscad.kernels.converters.registers import RegisterMap, register_map

DRIVEN_FAMILY = "ldc161x"
"""Family that the driver in ``data/firmware`` supports."""

CIRCUIT_PINS = frozenset(("SCL", "SDA", "CLKIN", "ADDR", "INTB", "SD", "VDD", "GND"))
"""Pins of a converter for which sitscad draws the circuit, with clock, pull-ups and capacitors."""

@record
class Converter:
    """Commercial converter: number of channels, possible 7-bit addresses on one bus, and package.

    ``family`` is the name of the data file in ``data/converters``. All parts in one data sheet have one file.
    ``source`` cites the data sheet.
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
        """Name as printed on the part."""
        return self.name.upper()

    @property
    def pins(self) -> tuple[tuple[str, str], ...]:
        """Name and KiCad's electrical type of each pin, from pin 1, without the pins of the coils."""
        return tuple((name, kind) for name, _, kind in (pin.partition(":") for pin in self.source_of("pins").split()))

    @property
    def has_circuit(self) -> bool:
        """Whether sitscad draws a circuit for the converter, which requires exactly the pins `CIRCUIT_PINS`."""
        return {name for name, _ in self.pins} == CIRCUIT_PINS

    def coil_pins(self, channel: int | str = "x") -> tuple[str, str]:
        """Return the names of the two pins for the ends of a channel's coil.

        Without a number, the names contain an x for the channel, as in the data sheet.
        """
        first, second = self.source_of("coil_pins").replace("x", str(channel)).split()
        return first, second

    @property
    def address_nets(self) -> tuple[str, ...]:
        """Nets to which pin ADDR can be connected, in the order of `addresses`."""
        return tuple(self.source_of("address_nets").split())

    def address_net(self, address: int) -> str:
        """Return the net to which pin ADDR must be connected for an address."""
        return self.address_nets[self.addresses.index(address)]

    @property
    def has_driver(self) -> bool:
        """Whether driver and bench support the converter. Families with other result registers need another driver."""
        return self.family == DRIVEN_FAMILY

    @property
    def most_coils(self) -> int:
        """Largest number of coils that the converters on one bus can read."""
        return self.channels * len(self.addresses)

    def converter_count(self, coils: int) -> int:
        """Return the number of converters needed for `coils` coils."""
        return math.ceil(coils / self.channels)

    def coils_per_converter(self, coils: int) -> tuple[int, ...]:
        """Return the number of coils on each converter if `coils` coils are divided as equally as possible.

        The first converters may have one coil more. Converters run at the same time, and the converter with the most
        coils has the least time for each.
        """
        number = self.converter_count(coils)
        each, more = divmod(coils, number)
        return (each + 1,) * more + (each,) * (number - more)

    def coil_channels(self, coils: int) -> tuple[Channel, ...]:
        """Return the converter channel of every coil, in the order of the sensor's coils.

        After a full bus, the next bus is used.
        """
        return tuple(
            Channel(number, channel, number // len(self.addresses), self.addresses[number % len(self.addresses)],
                    self.coil_pins(channel))
            for number, share in enumerate(self.coils_per_converter(coils))
            for channel in range(share)
        )

    # --------------------------------------------------------------------------------------------- figures and words

    @property
    def limits(self) -> Mapping[str, Limit]:
        """Numbers in the family's data file with units and sources, by row name."""
        return family_limits(self.family)

    def limit(self, name: str) -> float:
        """Return a number of the family's data file by row name, in SI units. Raises KeyError for an unknown name."""
        return family_limits(self.family)[name].value

    def source_of(self, name: str) -> str:
        """Return the source of a number, or the text of a row with text. Raises KeyError for an unknown row name."""
        return row_source(self.family, name)

    def text_with_own_sources(self, text: str) -> str:
        """Return the text with this family's sources only. `text` cites all families' sources (`source_in_all`)."""
        return limit_with_source(self.family, text)

    # ------------------------------------------------------------------------------------------- drive and amplitude

    @property
    def drive_currents(self) -> tuple[float, ...]:
        """Sensor drive currents (A), in the order of the drive codes from 0."""
        return numbers(self.family, "drive_currents")

    def drive_current(self, code: int, high_current: bool = False) -> float:
        """Return the sensor drive current (A) of a drive code, or of the high-current drive of a single channel.

        For the high-current mode, TI gives 6 mA, more than 3.5 mA, and 3 mA (SNOA950). The largest is used here,
        because too large an amplitude is the worse fault. See `high_current_range`.
        """
        return self.limit("high_current_max") if high_current else self.drive_currents[code]

    @property
    def has_high_current(self) -> bool:
        """Whether the converter has a high-current drive for a single channel."""
        return "high_current_max" in self.limits

    @property
    def high_current_range(self) -> tuple[float, float]:
        """Smallest and largest current (A) that TI's texts give for the high-current mode."""
        return self.limit("high_current_typical"), self.limit("high_current_max")

    def amplitude(self, parallel_resistance: float, code: int, high_current: bool = False) -> float:
        """Return the peak voltage (V) across a tank with a parallel resistance (ohm), driven with a drive code."""
        return self.amplitude_at(parallel_resistance, self.drive_current(code, high_current))

    def amplitude_at(self, parallel_resistance: float, current: float) -> float:
        """Return the peak voltage (V) across a tank with a parallel resistance (ohm), driven with a current (A)."""
        return self.law.amplitude(parallel_resistance, current)

    def drive_code(self, parallel_resistance: float) -> int:
        """Return the highest drive code with an amplitude below the maximum (TI: 1.8 V) at a parallel resistance (ohm).

        Give the largest R_P of the working range, with the target at its greatest distance (8.1.5; SNOA950). For
        sensors that are not yet made, add one manufacturing standard deviation. Returns 0 if even code 0 exceeds the
        maximum, and the last code if no code reaches it: check the amplitude.
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
    def serial_clock_text(self) -> str:
        """Fastest I2C clock as text. All read times assume this clock."""
        return show(self.limit("serial_clock_max"), "Hz")

    @property
    def law(self) -> ConversionLaw:
        """Module with the family's conversion: settings, times, resolution and noise."""
        return conversion_law(self.source_of("conversion"))

    def set_up(self, demand: Demand) -> Conversion:
        """Return the settings of the converter for a sensor's requirements."""
        return self.law.set_up(self, demand)

    def read_back_time(self, channels: int) -> float:
        """Return the time (s) to read the results of some channels over the bus at its fastest clock."""
        return self.law.read_back_time(self, channels)

    def read_back_time_optimistic(self, channels: int) -> float:
        """Return the time (s) to read the results of some channels, from the manufacturer's shortest stated time."""
        return self.law.read_back_time_optimistic(self, channels)

    @property
    def bits(self) -> int:
        """Number of bits of a result."""
        return int(self.limit("result_bits"))

    @staticmethod
    def inductance(frequency: float, capacitance: float) -> float:
        """Return the inductance (H) of a tank from its frequency (Hz) and total capacitance (F): 1 / (C (2 pi f)^2)."""
        return 1.0 / (capacitance * (2.0 * math.pi * frequency) ** 2)

    # ----------------------------------------------------------------------------------------------------- registers

    @property
    def has_registers(self) -> bool:
        """Whether the family's data file names a register module."""
        return "register_map" in family_rows(self.family)

    @property
    def register_map(self) -> RegisterMap:
        """Module with the family's register addresses, masks, flags and values.

        Raises ValueError if the family has none, and `DataError` if the module is missing or lacks a name.
        """
        if not self.has_registers:
            raise ValueError(f"sitscad knows no registers of {self.part}, and writes no firmware for it")
        return register_map(self.source_of("register_map"))

    @property
    def device_id(self) -> int:
        """Content of the part's DEVICE_ID register."""
        return int(self.limit("device_id"))

    @property
    def result_words(self) -> tuple[str, ...]:
        """Names of the registers of one result, the upper register first."""
        return tuple(self.source_of("result_registers").split())

    @property
    def result_mask(self) -> int:
        """Mask of the result's bits in its upper or only register. The error flags are in the bits above."""
        return (1 << self.bits - 16 * (len(self.result_words) - 1)) - 1

    @property
    def covered_flags(self) -> tuple[str, ...]:
        """Error flags that overlap the result's bits. Empty unless the register module belongs to another family."""
        flags = self.register_map.DATA_FLAGS.items()
        return tuple(name for name, (flag, _) in flags if flag & self.result_mask)

    def data_addresses(self, channel: int) -> tuple[int, ...]:
        """Return the addresses of a channel's result registers in the order of reading, upper register first.

        Raises ValueError for a channel that the converter does not have.
        """
        if not 0 <= channel < self.channels:
            raise ValueError(f"channel is {channel}; it must lie in 0 to {self.channels - 1}")
        return self.register_map.data_addresses(channel, len(self.result_words))


@record
class Channel:
    """Connection of a coil to a converter.

    `converter`, `number` (the converter's channel) and `bus` (the controller's I2C bus) count from 0. `address` is the
    converter's 7-bit address on the bus. `pins` are the pins for the coil's two ends.
    """

    converter: int
    number: int
    bus: int
    address: int
    pins: tuple[str, str]

    @property
    def converter_text(self) -> str:
        """Text with the converter's number, counted from 1, and its address.

        The bus is added unless it is the first.
        """
        bus = f"bus {self.bus + 1}, " if self.bus else ""
        return f"{self.converter + 1} ({bus}0x{self.address:02X})"

    def pin(self, end: str) -> str:
        """Return the converter's pin for a coil's end, ``A`` or ``B``."""
        return self.pins["AB".index(end)]
