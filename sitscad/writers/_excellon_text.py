"""Excellon drill files in the XNC manner: metric, explicit decimal points, drilling only, X2 attributes in comments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

UNIT = 1e-9
"""The coordinates' unit in metres."""


class DrilledHole(NamedTuple):
    """A hole on the grid of 1 nm: its place and its finished diameter."""

    x: int
    y: int
    diameter: int


def drill_text(
    title: str, function: str, attributes: Iterable[tuple[str, ...]], holes: Sequence[DrilledHole], use: str
) -> bytes:
    """A drill file: ``function`` is its X2 file function, ``use`` what the holes are for (``ViaDrill``)."""
    return ("\n".join(_lines(title, function, attributes, holes, use)) + "\n").encode("ascii")


def _lines(
    title: str, function: str, attributes: Iterable[tuple[str, ...]], holes: Sequence[DrilledHole], use: str
) -> Iterator[str]:
    plating, *_, kind = function.split(",")
    tools = tools_of(holes)
    yield from ("M48", f"; {title}, tool sizes are finished holes")
    for attribute in (*attributes, (".FileFunction", function)):
        yield f"; #@! TF{','.join(attribute)}"
    yield from ("METRIC", ";TYPE=PLATED" if plating == "Plated" else ";TYPE=NON_PLATED")
    for code, (diameter, _) in enumerate(tools, 1):
        yield from (f"; #@! TA.AperFunction,{plating},{kind},{use}", f"T{code}C{millimetres(diameter, 3)}")
    yield from ("%", "G05")
    for code, (_, drilled) in enumerate(tools, 1):
        yield f"T{code}"
        yield from (f"X{millimetres(hole.x)}Y{millimetres(hole.y)}" for hole in drilled)
    yield "M30"


def tools_of(holes: Iterable[DrilledHole]) -> list[tuple[int, list[DrilledHole]]]:
    """The holes grouped by finished diameter (nm), small ones first, in the given order within a tool."""
    ordered = sorted(holes, key=lambda hole: hole.diameter)
    return [(diameter, list(group)) for diameter, group in groupby(ordered, key=lambda hole: hole.diameter)]


def on_grid(length: float) -> int:
    """A length (m) in whole nanometres."""
    return round(length / UNIT)


def millimetres(nanometres: int, least: int = 1) -> str:
    """A length in millimetres, to the nanometre as the Gerber files have it, with `least` decimals kept."""
    whole, _, decimals = f"{nanometres / 1e6:.6f}".partition(".")
    return f"{'0' if whole == '-0' and not decimals.strip('0') else whole}.{decimals.rstrip('0').ljust(least, '0')}"
