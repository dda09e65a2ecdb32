"""Which channel of which converter a coil is wired to: the first four coils on one LDC1614, the next on another."""

from __future__ import annotations

from sitscad.record import record

CHANNELS = 4
"""Of one LDC1614."""

ADDRESSES = ("0x2A", "0x2B")
"""Of the converters on one I2C bus, by the level of their ADDR pin."""


@record
class Channel:
    """A converter's number from 1, and the channel from 0."""

    converter: int
    number: int

    @property
    def converter_in_words(self) -> str:
        """The converter with its address; a third one has none on the bus."""
        known = self.converter <= len(ADDRESSES)
        return f"{self.converter} ({ADDRESSES[self.converter - 1]})" if known else f"{self.converter} (no address left)"

    def pin(self, end: str) -> str:
        """The converter's pin for a coil's end, ``A`` or ``B``."""
        return f"IN{self.number}{end}"


def channel_of(order: int) -> Channel:
    """The channel of a coil by its place in the array, from 0."""
    return Channel(order // CHANNELS + 1, order % CHANNELS)
