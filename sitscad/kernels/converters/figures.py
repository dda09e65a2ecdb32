"""The figures of converters, read from ``data/converters``: a file a family, and ``bench.csv`` for what is none's own.
What a family has to state, in which unit and within what a figure can be stands in `ASKED`; it may state more.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache

from sitscad.basics.record import record
from sitscad.data import DataError, Row, rows

WORDS = "words"
"""What stands in the place of a unit in a row that says or cites something."""


@record
class Limit:
    """One figure of the family: value in SI units, where it comes from, and whether that source was seen."""

    value: float
    unit: str
    source: str
    verified: bool


@record
class RowForm:
    """What a row has to be: its unit, the least and the most that can be meant, whether it is a whole number, and
    whether it is several.
    """

    unit: str
    least: float = -math.inf
    most: float = math.inf
    whole: bool = False
    several: bool = False


_SAYING = RowForm(WORDS)
_FREQUENCY, _CURRENT, _VOLTAGE = RowForm("Hz", 1.0, 1e10), RowForm("A", 1e-6, 1.0), RowForm("V", 0.01, 20.0)
_RESISTANCE, _SHARE = RowForm("ohm", 1.0, 1e7), RowForm("1", 0.01, 1.0)

ASKED: dict[str, RowForm] = {
    "result_bits": RowForm("bit", 8, 32, whole=True),
    "output_gains": RowForm("bit", 0, 16, whole=True, several=True),
    "result_registers": _SAYING,
    "register_map": _SAYING,
    "pins": _SAYING,
    "address_nets": _SAYING,
    "device_id": RowForm("1", 0, 0xFFFF, whole=True),
    "drive_currents": RowForm("A", 1e-7, 0.1, several=True),
    **dict.fromkeys(("cite_address", "cite_frequency", "cite_inductance", "cite_pins", "cite_drive", "cite_results",
                     "cite_errors", "scan_timing", "idle_channels", "noise_law"), _SAYING),
    "sensor_frequency_min": _FREQUENCY,
    "sensor_frequency_max": _FREQUENCY,
    "parallel_resistance_min": _RESISTANCE,
    "parallel_resistance_max": _RESISTANCE,
    "parallel_resistance_driveable": _RESISTANCE,
    "parallel_resistance_high_current": _RESISTANCE,
    "high_current_max": _CURRENT,
    "high_current_typical": _CURRENT,
    "amplitude_max": _VOLTAGE,
    "amplitude_optimum_min": _VOLTAGE,
    "amplitude_stable_min": _VOLTAGE,
    "reference_multi_external_max": _FREQUENCY,
    "reference_multi_internal_max": _FREQUENCY,
    "reference_single_max": _FREQUENCY,
    "clock_min": _FREQUENCY,
    "clock_max": _FREQUENCY,
    "input_to_reference_max": _SHARE,
    "input_divider_2_from": _FREQUENCY,
    "rcount_min": RowForm("1", 1, 0xFFFF, whole=True),
    "settle_count_min": RowForm("1", 0, 0xFFFF, whole=True),
    "switch_delay": RowForm("s", 0.0, 1e-3),
    "wake_time": RowForm("s", 0.0, 1.0),
    "pin_capacitance": RowForm("F", 0.0, 1e-9),
    "serial_clock_max": RowForm("Hz", 1e3, 1e8),
    "single_channel_rate_max": RowForm("Hz", 1.0, 1e7),
    "read_back_four_channels": RowForm("s", 1e-7, 1.0),
    "self_resonance_fraction": _SHARE,
    "supply_current": _CURRENT,
    "idle_pin_resistance": RowForm("ohm", 0.0, 1e4),
    "drive_delay": RowForm("s", 0.0, 1e-6),
    "noise_steps": RowForm("1", 0.0, 1e3),
    "self_resonance_fraction_strict": _SHARE,
    "quality_factor_min": RowForm("1", 0.0, 1e3),
    "inductance_min": RowForm("H", 1e-9, 1e-3),
    "capacitor_min": RowForm("F", 1e-13, 1e-6),
    "capacitor_max": RowForm("F", 1e-13, 1e-6),
    "capacitor_resistance": RowForm("ohm", 0.0, 10.0),
    "capacitor_tolerance": RowForm("1", 0.0, 0.5),
    "clock_tolerance": RowForm("1", 0.0, 0.1),
    "capacitor_temperature": RowForm("1/K", 0.0, 1e-2),
}
"""Every figure that is asked of a family, the bench's own among them."""

_RISING = (
    ("sensor_frequency_min", "sensor_frequency_max"), ("clock_min", "clock_max"), ("capacitor_min", "capacitor_max"),
    ("parallel_resistance_min", "parallel_resistance_max"), ("high_current_typical", "high_current_max"),
    ("amplitude_stable_min", "amplitude_optimum_min"), ("amplitude_optimum_min", "amplitude_max"),
)
"""Figures of which the first is at most the second."""


@cache
def rows_of(family: str) -> dict[str, Row]:
    """The rows of a family's figures by name, the bench's own among them. Raises `DataError`, which names file and row,
    where one is missing or is not what it has to be.
    """
    found: dict[str, Row] = {}
    for table in ("bench", family):
        own: dict[str, Row] = {}
        for row in rows(f"converters/{table}"):
            flaws = list(_flaws(row))
            if row["name"] in own:
                flaws = ["it stands there twice"]
            if flaws:
                raise _error(table, row["name"], flaws[0])
            own[row["name"]] = row
        found |= own
    if lacking := [name for name in ASKED if name not in found]:
        raise _error(family, ", ".join(lacking), "no such row, and it is asked of every family")
    for low, high in _RISING:
        if float(found[low]["value"]) > float(found[high]["value"]):
            raise _error(family, low, f"{found[low]['value']} is more than {high}, {found[high]['value']}")
    currents = [float(each) for each in found["drive_currents"]["value"].split()]
    if currents != sorted(currents):
        raise _error(family, "drive_currents", "a larger code has to be a stronger drive")
    return found


def _error(table: str, name: str, flaw: str) -> DataError:
    return DataError(f"data/converters/{table}.csv, {name}: {flaw}")


def _flaws(row: Row) -> Iterator[str]:
    """What is wrong with a row, the first of it foremost."""
    if None in row or None in row.values():
        yield "it has more or fewer columns than name, value, unit, status, source"
        return
    if row["status"] not in ("verified", "unverified"):
        yield f"its status is {row['status']!r}, neither verified nor unverified"
    if not row["value"].strip() or not row["source"].strip():
        yield "value or source is empty"
    asked = ASKED.get(row["name"], RowForm(row["unit"], several=True))
    if row["unit"] != asked.unit:
        yield f"its unit is {row['unit']!r}, and {asked.unit!r} is asked"
        return
    if asked.unit == WORDS:
        return
    texts = row["value"].split()
    if len(texts) > 1 and not asked.several:
        yield f"{row['value']!r} is not one number"
    for text in texts:
        yield from _flaws_of_number(text, asked)


def _flaws_of_number(text: str, asked: RowForm) -> Iterator[str]:
    try:
        value = float(text)
    except ValueError:
        yield f"{text!r} is not a number"
        return
    if not math.isfinite(value) or not asked.least <= value <= asked.most:
        unit = "" if asked.unit == "1" else f" {asked.unit}"
        yield f"{text}{unit} is not within {asked.least:g} to {asked.most:g}{unit}"
    if asked.whole and not value.is_integer():
        yield f"{text} is not a whole number"


@cache
def numbers(family: str, name: str) -> tuple[float, ...]:
    """The values of a row of several."""
    return tuple(map(float, rows_of(family)[name]["value"].split()))


@cache
def limits_of(family: str) -> Mapping[str, Limit]:
    """A family's figures by name (``sensor_frequency_max``, ``amplitude_max``, ...)."""
    return {
        name: Limit(float(row["value"]), row["unit"], row["source"], row["status"] == "verified")
        for name, row in rows_of(family).items()
        if row["unit"] != WORDS and " " not in row["value"]
    }


def figure_source(family: str, name: str) -> str:
    """The source of a figure; of a row of words these. KeyError for an unknown name."""
    row = rows_of(family)[name]
    return row["value"] if row["unit"] == WORDS else row["source"]


@cache
def source_in_all(name: str) -> str:
    """The sources of a figure of one name in all families that have it, as one text."""
    return "; ".join(dict.fromkeys(figure_source(family, name) for family in _families() if name in rows_of(family)))


@cache
def _families() -> tuple[str, ...]:
    """Return the families of all converters. The table is read once."""
    return tuple(dict.fromkeys(row["family"] for row in rows("converters")))


@cache
def cited_alone(family: str, text: str) -> str:
    """A text that cites all families (`source_in_all`), with what it says of one alone."""
    for name in rows_of(family):
        text = text.replace(source_in_all(name), figure_source(family, name))
    return text
