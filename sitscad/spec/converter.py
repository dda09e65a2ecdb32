"""Which converter reads the coils, and which channel of which one a coil is wired to."""

from __future__ import annotations

import math

from sitscad.record import record


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
