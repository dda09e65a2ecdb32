"""Data-sheet values of converters from ``data/converters``: one file per family, ``bench.csv`` for common values.

`REQUIRED_ROWS` has the rows that every family needs, with unit and range. The module of a family's conversion requires
further rows. A family with registers also needs `REGISTER_ROWS`. A family may have more rows.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from types import ModuleType

from sitscad.basics.record import record
from sitscad.data import DataError, Row, rows

WORDS = "words"
"""Unit of rows that contain text or citations instead of numbers."""


@record
class Limit:
    """Data-sheet value of a converter family in SI units, with its source.

    `verified` is True if the source was read for this value.
    """

    value: float
    unit: str
    source: str
    verified: bool


@record
class RowForm:
    """Required form of a row in a data file: its unit, and the plausible range of its value, `least` to `most`.

    If `whole`, values must be whole numbers. If `several`, a row may have several numbers.
    """

    unit: str
    least: float = -math.inf
    most: float = math.inf
    whole: bool = False
    several: bool = False


_TEXT = RowForm(WORDS)
"""Form of a row with text."""
FREQUENCY, SHARE = RowForm("Hz", 1.0, 1e10), RowForm("1", 0.01, 1.0)
"""Forms of rows with a frequency (Hz), and with a ratio from 0.01 to 1."""
_CURRENT, _VOLTAGE, _RESISTANCE = RowForm("A", 1e-6, 1.0), RowForm("V", 0.01, 20.0), RowForm("ohm", 1.0, 1e7)
"""Forms of rows with a current (A), a voltage (V) and a resistance (ohm)."""

REQUIRED_ROWS: dict[str, RowForm] = {
    **dict.fromkeys(("conversion", "pins", "coil_pins", "address_nets", "cite_drive", "scan_timing", "idle_channels",
                     "noise_law"), _TEXT),
    "result_bits": RowForm("bit", 8, 32, whole=True),
    "drive_currents": RowForm("A", 1e-7, 0.1, several=True),
    "sensor_frequency_min": FREQUENCY,
    "sensor_frequency_max": FREQUENCY,
    "parallel_resistance_min": _RESISTANCE,
    "parallel_resistance_max": _RESISTANCE,
    "parallel_resistance_driveable": _RESISTANCE,
    "amplitude_max": _VOLTAGE,
    "amplitude_optimum_min": _VOLTAGE,
    "amplitude_stable_min": _VOLTAGE,
    "clock_min": FREQUENCY,
    "clock_max": FREQUENCY,
    "pin_capacitance": RowForm("F", 0.0, 1e-9),
    "serial_clock_max": RowForm("Hz", 1e3, 1e8),
    "self_resonance_fraction": SHARE,
    "supply_current": _CURRENT,
    "idle_pin_resistance": RowForm("ohm", 0.0, 1e4),
    "drive_delay": RowForm("s", 0.0, 1e-6),
    "self_resonance_fraction_strict": SHARE,
    "quality_factor_min": RowForm("1", 0.0, 1e3),
    "inductance_min": RowForm("H", 1e-9, 1e-3),
    "capacitor_min": RowForm("F", 1e-13, 1e-6),
    "capacitor_max": RowForm("F", 1e-13, 1e-6),
    "capacitor_resistance": RowForm("ohm", 0.0, 10.0),
    "capacitor_tolerance": RowForm("1", 0.0, 0.5),
    "clock_tolerance": RowForm("1", 0.0, 0.1),
    "capacitor_temperature": RowForm("1/K", 0.0, 1e-2),
}
"""Rows that every family must have, in its own data file or in ``bench.csv``, by name."""

REGISTER_ROWS: dict[str, RowForm] = {
    **dict.fromkeys(("register_map", "result_registers", "cite_address", "cite_frequency", "cite_inductance",
                     "cite_pins", "cite_results", "cite_errors"), _TEXT),
    "device_id": RowForm("1", 0, 0xFFFF, whole=True),
    "wake_time": RowForm("s", 0.0, 1.0),
}
"""Rows of a family whose registers sitscad writes. Families without a row ``register_map`` do not need them."""

HIGH_CURRENT: dict[str, RowForm] = {
    "parallel_resistance_high_current": _RESISTANCE,
    "high_current_max": _CURRENT,
    "high_current_typical": _CURRENT,
}
"""Rows of a family with a high-current drive for a single channel. A family has all these rows or none."""

_RISING = (
    ("sensor_frequency_min", "sensor_frequency_max"), ("clock_min", "clock_max"), ("capacitor_min", "capacitor_max"),
    ("parallel_resistance_min", "parallel_resistance_max"), ("high_current_typical", "high_current_max"),
    ("amplitude_stable_min", "amplitude_optimum_min"), ("amplitude_optimum_min", "amplitude_max"),
)
"""Pairs of row names. The value of the first row must not exceed the value of the second row."""


@cache
def family_rows(family: str) -> dict[str, Row]:
    """Return the rows of a family's data file and of ``bench.csv``, by name.

    Raises `DataError`, with file and row, if a row is missing or malformed.
    """
    tables = {table: rows(f"converters/{table}") for table in ("bench", family)}
    named = {row["name"]: row for table_rows in tables.values() for row in table_rows}
    forms = _required_rows(family, named)
    for table, table_rows in tables.items():
        times = Counter(row["name"] for row in table_rows)
        for row in table_rows:
            if times[row["name"]] > 1:
                raise _error(table, row["name"], "it stands there twice")
            if flaws := list(_row_flaws(row, forms)):
                raise _error(table, row["name"], flaws[0])
    if lacking := [name for name in forms if name not in named]:
        raise _error(family, ", ".join(lacking), "no such row, and it is asked of this family")
    for low, high in _RISING:
        if low in named and float(named[low]["value"]) > float(named[high]["value"]):
            raise _error(family, low, f"{named[low]['value']} is more than {high}, {named[high]['value']}")
    currents = [float(each) for each in named["drive_currents"]["value"].split()]
    if currents != sorted(currents):
        raise _error(family, "drive_currents", "a larger code has to be a stronger drive")
    return named


def _required_rows(family: str, named: Mapping[str, Row]) -> dict[str, RowForm]:
    """Return the rows that a family must have. Raises `DataError` if it names no conversion module."""
    if "conversion" not in named:
        raise _error(family, "conversion", "no such row, and it is asked of every family")
    module = family_module("conversion", named["conversion"]["value"], ("REQUIRED_ROWS",))
    law: dict[str, RowForm] = module.REQUIRED_ROWS
    registers = REGISTER_ROWS if "register_map" in named else {}
    high_current = HIGH_CURRENT if HIGH_CURRENT.keys() & named else {}
    return {**REQUIRED_ROWS, **law, **registers, **high_current}


def family_module(row: str, name: str, required: tuple[str, ...]) -> ModuleType:
    """Return the module of this folder with the name that the row `row` of a family contains.

    Raises `DataError` if there is none, or if it lacks a required name.
    """
    place = f"sitscad.kernels.converters.{name}"
    try:
        module = import_module(place)
    except ModuleNotFoundError as error:
        if error.name != place:
            raise
        raise DataError(f"there is no module {place}, which {row} names") from error
    if lacking := [attribute for attribute in required if not hasattr(module, attribute)]:
        raise DataError(f"{place} lacks {', '.join(lacking)}, which a module of {row} has to have")
    return module


def required_names(protocol: type) -> tuple[str, ...]:
    """Return the names that a module must define to satisfy a protocol."""
    return *protocol.__annotations__, *(name for name in vars(protocol) if not name.startswith("_"))


def _error(table: str, name: str, flaw: str) -> DataError:
    """Return the error about a row of a data file."""
    return DataError(f"data/converters/{table}.csv, {name}: {flaw}")


def _row_flaws(row: Row, asked_of: Mapping[str, RowForm]) -> Iterator[str]:
    """Yield the faults of a row of a data file, the most important first.

    `asked_of` maps the name of each required row to its required form.
    """
    if None in row or None in row.values():
        yield "it has more or fewer columns than name, value, unit, status, source"
        return
    if row["status"] not in ("verified", "unverified"):
        yield f"its status is {row['status']!r}, neither verified nor unverified"
    if not row["value"].strip() or not row["source"].strip():
        yield "value or source is empty"
    form = asked_of.get(row["name"], RowForm(row["unit"], several=True))
    if row["unit"] != form.unit:
        yield f"its unit is {row['unit']!r}, and {form.unit!r} is asked"
        return
    if form.unit == WORDS:
        return
    texts = row["value"].split()
    if len(texts) > 1 and not form.several:
        yield f"{row['value']!r} is not one number"
    for text in texts:
        yield from _number_flaws(text, form)


def _number_flaws(text: str, form: RowForm) -> Iterator[str]:
    """Yield the faults of one number of a row: not a number, out of range, or not whole."""
    try:
        value = float(text)
    except ValueError:
        yield f"{text!r} is not a number"
        return
    if not math.isfinite(value) or not form.least <= value <= form.most:
        unit = "" if form.unit == "1" else f" {form.unit}"
        yield f"{text}{unit} is not within {form.least:g} to {form.most:g}{unit}"
    if form.whole and not value.is_integer():
        yield f"{text} is not a whole number"


@cache
def numbers(family: str, name: str) -> tuple[float, ...]:
    """Return the values of a row with several numbers, in SI units."""
    return tuple(map(float, family_rows(family)[name]["value"].split()))


@cache
def family_limits(family: str) -> Mapping[str, Limit]:
    """Return the rows of a family's data file that hold one number, by row name (``clock_max``, ``amplitude_max``)."""
    return {
        name: Limit(float(row["value"]), row["unit"], row["source"], row["status"] == "verified")
        for name, row in family_rows(family).items()
        if row["unit"] != WORDS and " " not in row["value"]
    }


def row_source(family: str, name: str) -> str:
    """Return the source of a number, or the text of a row with text. Raises KeyError for an unknown row name."""
    row = family_rows(family)[name]
    return row["value"] if row["unit"] == WORDS else row["source"]


@cache
def source_in_all(name: str) -> str:
    """Return one text with the sources of a row in all families that have the row."""
    families = (family for family in _family_names() if name in family_rows(family))
    return "; ".join(dict.fromkeys(row_source(family, name) for family in families))


@cache
def _family_names() -> tuple[str, ...]:
    """Return the names of all converter families. The table is read once."""
    return tuple(dict.fromkeys(row["family"] for row in rows("converters")))


@cache
def limit_with_source(family: str, text: str) -> str:
    """Return the text with the sources of one family only. `text` cites the sources of all families (`source_in_all`).

    If no cited row belongs to the family, the result is the source of the family's conversion.
    """
    families = dict.fromkeys(row["family"] for row in rows("converters"))
    own_rows = family_rows(family)
    other_names = dict.fromkeys(name for other in families for name in family_rows(other) if name not in own_rows)
    for name in own_rows:
        text = text.replace(source_in_all(name), row_source(family, name))
    for name in other_names:
        text = text.replace(source_in_all(name), "")
    return "; ".join(filter(None, text.split("; "))) or family_rows(family)["conversion"]["source"]
