"""The coverlay's openings: over the contacts, and over the capacitors' pads."""

from __future__ import annotations

from sitscad.geometry.path import rectangle
from sitscad.geometry.region import Region
from sitscad.layout.board import Pad
from sitscad.layout.tail import CHIP_OPENING, TailFrame
from sitscad.spec.sensor import SensorSpec


def opening(spec: SensorSpec, tail: TailFrame) -> Region:
    """The coverlay's opening over all contacts, out to the end of the board.

    Beside it the coverlay keeps the fabricator's web, as far as the contacts leave room for that.
    """
    contacts = tail.outer_contact + tail.connector.contact_width / 2
    half = max(tail.plug_half_width - spec.fpc.rules.coverlay_web, contacts)
    return Region(rectangle(tail.pad_start, -half, tail.end, half))


def chip_openings(pads: tuple[Pad, ...]) -> tuple[Region, ...]:
    """The coverlay's openings over capacitors' pads: a little larger, so that the whole pad is bare."""
    found = []
    for pad in pads:
        (w, h), (x, y) = (side / 2 + CHIP_OPENING for side in pad.size), pad.centre
        found.append(Region(rectangle(x - w, y - h, x + w, y + h)))
    return tuple(found)
