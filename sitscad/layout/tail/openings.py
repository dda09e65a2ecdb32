"""The coverlay's openings: over the contacts, and over the capacitors' pads."""

from __future__ import annotations

from sitscad.geometry.path import rectangle
from sitscad.geometry.region import Region
from sitscad.layout.pieces import Pad
from sitscad.layout.tail.frame import CHIP_OPENING, TailFrame
from sitscad.spec.sensor import SensorSpec


def contact_openings(spec: SensorSpec, tail: TailFrame, pads: tuple[Pad, ...]) -> tuple[Region, ...]:
    """The openings over the contacts: one over a plug, one over each pad for solder."""
    if tail.connector.kind == "pads":
        return tuple(_grown(pad, -_rim(spec, pad)) for pad in pads)
    return (_plug_opening(spec, tail),)


def _plug_opening(spec: SensorSpec, tail: TailFrame) -> Region:
    """Over the whole width of what is plugged in and past its end, so that no strip of coverlay makes it thicker there;
    and so far back that the contacts are bare over their length with the coverlay out of register.

    Past the edges it reaches as far as outline and coverlay may be off together.
    """
    rules = spec.fpc.rules
    past = rules.outline_tolerance + rules.registration
    half = tail.plug_half_width + past
    begin = tail.end - tail.end_gap - tail.connector.contact_length - rules.registration
    return Region(rectangle(begin, -half, tail.end + past, half))


def _rim(spec: SensorSpec, pad: Pad) -> float:
    """How far (m) the coverlay covers the rims of a pad for solder; half of it stays bare."""
    return min(spec.fpc.rules.pad_lap, min(pad.size) / 4)


def chip_openings(pads: tuple[Pad, ...]) -> tuple[Region, ...]:
    """The coverlay's openings over capacitors' pads: a little larger, so that the whole pad is bare."""
    return tuple(_grown(pad, CHIP_OPENING) for pad in pads)


def _grown(pad: Pad, by: float) -> Region:
    (w, h), (x, y) = (side / 2 + by for side in pad.size), pad.centre
    return Region(rectangle(x - w, y - h, x + w, y + h))
