"""What a process can make: least walls, holes and clearances of printed and milled pieces, as data with sources."""

from __future__ import annotations

from functools import cache

from sitscad.data import cited, rows
from sitscad.record import record
from sitscad.units import parse_quantity


@record
class PrintLimit:
    """The least that a process makes of something (m), and where the figure comes from."""

    value: float
    source: str


@cache
def print_limit(process: str, figure: str) -> PrintLimit:
    """A process's limit: `figure` is wall, free_wall, hole, clearance, pin, groove or escape; raises KeyError where
    there is no such row.
    """
    for row in rows("print_limits"):
        if (row["process"], row["figure"]) == (process, figure):
            source = cited(row)
            return PrintLimit(parse_quantity(row["value"], "length"), source)
    raise KeyError((process, figure))
