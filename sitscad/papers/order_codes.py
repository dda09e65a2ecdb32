"""What parts are ordered by: maker and order code of the data, for those that have one."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from sitscad.data import cited, rows
from sitscad.record import record
from sitscad.units import parse_quantity


@record
class Order:
    """Maker, order code, what the code means in words, and where it comes from."""

    maker: str
    code: str
    words: str
    source: str


def order_of(kind: str, name: str, **values: Any) -> Order | None:
    """The order of a connector, capacitor, converter or elastomer by the name that the spec calls it; `values` fill the
    code, and of connectors `contacts` decide the make. None where the data have none.
    """
    contacts = values.get("contacts")
    row = next(
        (row for row in _table().get((kind, name), ())
         if contacts is None or not row["least"] or int(row["least"]) <= contacts <= int(row["most"])), None,
    )
    if row is None:
        return None
    return Order(row["maker"], row["code"].format(**values), row["words"], cited(row))


def capacitor(package: str, capacitance: float) -> Order | None:
    """The C0G capacitor of a package (``chip-0603``) and a capacitance (F); None outside what the series is made in."""
    row, *_ = _table().get(("capacitor", package), [None])
    if row is None:
        return None
    low, high = (parse_quantity(row[end], "capacitance") for end in ("least", "most"))
    if not low * (1 - 1e-9) <= capacitance <= high * (1 + 1e-9):
        return None
    return order_of("capacitor", package, value=three_digits(capacitance))


def three_digits(capacitance: float) -> str:
    """A capacitance (F) as makers code it (IEC 60062): two digits of picofarads and the number of zeros. 220 pF are
    ``221``; ``R`` is the decimal point below 10 pF.
    """
    value = capacitance * 1e12
    if value < 9.95:
        return f"{value:.1f}".replace(".", "R")
    zeros = math.floor(math.log10(value * (1 + 1e-9))) - 1
    digits = round(value / 10.0**zeros)
    return f"{digits}{zeros}" if digits < 100 else f"10{zeros + 1}"


@cache
def _table() -> dict[tuple[str, str], list[dict[str, str]]]:
    found: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in rows("order_codes"):
        found.setdefault((row["kind"], row["name"]), []).append(row)
    return found
