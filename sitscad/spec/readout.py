"""The converter that reads the coils, which channel of which one a coil is wired to, and the wires to it."""

from __future__ import annotations

import math

from sitscad.record import record
from sitscad.spec.circuit import Chip
from sitscad.spec.kinds import Choice, Either, Number, Preset, Quantity, Rate, Run
from sitscad.spec.section import Part, Section, key


@record
class Converter:
    """A converter that can be bought: its channels, the 7-bit addresses that one bus has for it, and its package.

    ``family`` names the data sheet's figures and registers that it shares with others (`sitscad.readout`).
    """

    name: str
    family: str
    channels: int
    addresses: tuple[int, ...]
    package: str = ""
    source: str = ""

    @property
    def part(self) -> str:
        """The name as it is printed on the part."""
        return self.name.upper()

    @property
    def most_coils(self) -> int:
        """How many coils one bus can read."""
        return self.channels * len(self.addresses)

    def needed(self, coils: int) -> int:
        """How many converters so many coils take."""
        return math.ceil(coils / self.channels)

    def busiest(self, coils: int) -> int:
        """Channels in use on the first converter, which has the most."""
        return min(coils, self.channels)

    def idlest(self, coils: int) -> int:
        """Channels in use on the last converter, which has the fewest: one coil too many is alone on its own."""
        return coils - self.channels * (self.needed(coils) - 1)

    def channel_of(self, order: int) -> Channel:
        """The channel of a coil by its place in the array, from 0."""
        number, channel = divmod(order, self.channels)
        return Channel(number, channel, self.addresses[number] if number < len(self.addresses) else None)


@record
class Channel:
    """Where a coil is wired: the converter and its channel, both from 0, and the converter's 7-bit address on the bus,
    None beyond those that one bus can have.
    """

    converter: int
    number: int
    address: int | None

    @property
    def converter_in_words(self) -> str:
        """The converter, counted from 1, with its address."""
        address = "no address left" if self.address is None else f"0x{self.address:02X}"
        return f"{self.converter + 1} ({address})"

    def pin(self, end: str) -> str:
        """The converter's pin for a coil's end, ``A`` or ``B``."""
        return f"IN{self.number}{end}"


@record
class Cable(Section):
    """The wires between tail and converter, per conductor pair and for the whole length.

    What is left out is None only until it is worked out by the length.
    """

    length: float = key(Run, "of the cable", 300)
    inductance: float = key(
        Quantity("inductance", "0 nH", "1 mH"),
        "of one pair, whole length, like 180 nH; 600 nH a metre if left out: measure yours",
        None,
    )
    capacitance: float = key(
        Quantity("capacitance", "0 pF", "1 uF"),
        "of one pair, whole length, like 30 pF; 100 pF a metre if left out: measure yours",
        None,
    )
    resistance: float = key(
        Quantity("resistance", "0 ohm", "1 kohm"),
        "of one pair, there and back, like 0.3 ohm; 1 ohm a metre if left out: measure yours",
        None,
    )


@record
class ReadoutSpec(Section):
    """The converter that reads the coils.

    ``capacitance`` and ``drive_code`` are None where they are chosen, ``chip`` where the tank capacitors are elsewhere
    than on the tail's stiffener, ``capacitor_at`` only until it is worked out.
    """

    device: Converter = key(Preset("converter", up=True), "the converter", "ldc1614")
    capacitance: float | None = key(
        Either("auto", Quantity("capacitance", "1 pF", "1 uF")),
        "of the tank, like 330 pF; auto: chosen, with reasons",
        "auto",
    )
    capacitor_at: str = key(
        Choice(("coil", "converter")), "where it is soldered: converter, unless capacitors_on_board", None
    )
    chip: Chip | None = key(
        Preset("chip", up=True),
        "places for the capacitors on the tail's stiffener, and of what size",
        None,
        written="capacitors_on_board",
    )
    cable: Cable | None = key(Part(Cable), "none: the tail plugs into the converter's board", None)
    clock: float = key(Quantity("frequency", "100 kHz", "1 GHz"), "reference clock", "40 MHz")
    scan_rate: float = key(Rate, "complete scans of all coils per second", "100 Hz")
    drive_code: int | None = key(
        Either("auto", Number(0, 31, whole=True)),
        "of all channels; auto: the strongest one sigma below 1.8 V",
        "auto",
    )
