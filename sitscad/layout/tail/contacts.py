"""The contacts as a table: what a person who wires the sensor to its converter looks up."""

from __future__ import annotations

from sitscad.layout.board import Layout
from sitscad.record import record


def head(converter: str) -> tuple[str, ...]:
    """The heads of the table's columns, by the converter's name."""
    return "contact", "pin", "net", "coil", converter, "channel", "its pin"


@record
class Contact:
    """One contact: its number, the pin (``C1.A``), the net, the coil, the converter, its channel and that one's pin."""

    number: int
    pin: str
    net: str
    coil: str
    converter: str
    channel: str
    converter_pin: str

    @property
    def cells(self) -> tuple[str, ...]:
        """The row of a table under `head`."""
        return (
            str(self.number), self.pin, self.net, self.coil, self.converter, self.channel, self.converter_pin,
        )  # fmt: skip


def contacts(layout: Layout) -> tuple[Contact, ...]:
    """All contacts of the tail in the order of their numbers; none where the coils found no way to them."""
    orders = {coil.net: (order, coil.name) for order, coil in enumerate(layout.coils)}
    found = []
    for pad in sorted(layout.pads, key=lambda pad: pad.number):
        if pad.is_unused:
            found.append(Contact(pad.number, "unused", "-", "-", "-", "-", "-"))
            continue
        order, name = orders[pad.net]
        channel = layout.spec.readout.device.channel_of(order)
        end = pad.pin.rpartition(".")[2]
        number = str(channel.number)
        found.append(Contact(pad.number, pad.pin, pad.net, name, channel.converter_in_words, number, channel.pin(end)))
    return tuple(found)
