"""The holes of a layout as its drill files, drill maps and tables group them: by the layers that they go through."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import NamedTuple

from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.units import decimal

UNIT = 1e-9
"""The coordinates' unit in metres."""


class DrilledHole(NamedTuple):
    """A hole on the grid of 1 nm: its place and its finished diameter."""

    x: int
    y: int
    diameter: int


@record
class Tool:
    """Holes of one finished diameter (nm) and one kind: in words, and in the fewest, for a table and for a map."""

    diameter: int
    holes: tuple[DrilledHole, ...]
    words: str


def drilled_to(layout: Layout, lowest: int | None, dx: int = 0, dy: int = 0) -> list[DrilledHole]:
    """The holes from the first copper layer to the `lowest`, moved by (dx, dy) nanometres."""
    return [
        DrilledHole(on_grid(via.centre.x) + dx, on_grid(via.centre.y) + dy, on_grid(via.drill))
        for via in layout.vias
        if layout.lowest_layer(via) == lowest
    ]


def tools(holes: Sequence[DrilledHole], words: str) -> list[Tool]:
    """The tools of one kind of hole, small ones first."""
    return [Tool(diameter, tuple(drilled), words) for diameter, drilled in tools_of(holes)]


def plated_words(layout: Layout, lowest: int) -> str:
    """What a table says of plated holes: through which copper layers they go, where they differ."""
    return "plated" if len(layout.spans) < 2 else f"plated, copper 1 to {lowest}"


def plated_tools(layout: Layout) -> list[Tool]:
    """All tools of a layout, those through the whole board first."""
    return [tool for lowest in layout.spans for tool in tools(drilled_to(layout, lowest), plated_words(layout, lowest))]


def tools_of(holes: Iterable[DrilledHole]) -> list[tuple[int, list[DrilledHole]]]:
    """The holes grouped by finished diameter (nm), small ones first, in the given order within a tool."""
    ordered = sorted(holes, key=lambda hole: hole.diameter)
    return [(diameter, list(group)) for diameter, group in groupby(ordered, key=lambda hole: hole.diameter)]


def on_grid(length: float) -> int:
    """A length (m) in whole nanometres."""
    return round(length / UNIT)


def millimetres(nanometres: int, least: int = 1) -> str:
    """A length in millimetres, to the nanometre as the Gerber files have it, with `least` decimals kept."""
    return decimal(nanometres / 1e6, 6, least)
