"""Conversion of quantities as people write them ("0.15 mm", "4 mil", "330 pF") to SI floats, and back.

Units are converted here only. All other code uses metres, henries, farads, ohms, hertz, newtons and pascals.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from collections.abc import Iterable, Sequence
from decimal import Decimal


def _prefixed(unit: str, prefixes: str) -> dict[str, Decimal]:
    exponents = {"p": -12, "n": -9, "u": -6, "m": -3, "k": 3, "M": 6, "G": 9, "1": 0}
    factors = {("" if p == "1" else p) + unit: Decimal(1).scaleb(exponents[p]) for p in prefixes}
    if "u" in prefixes:
        factors |= {sign + unit: Decimal(1).scaleb(-6) for sign in ("\N{MICRO SIGN}", "\N{GREEK SMALL LETTER MU}")}
    return factors


_MIL = Decimal("25.4e-6")

UNITS: dict[str, dict[str, Decimal]] = {
    "length": _prefixed("m", "num1") | {"cm": Decimal("0.01"), "mil": _MIL, "thou": _MIL, "in": Decimal("0.0254")},
    "inductance": _prefixed("H", "pnum1"),
    "capacitance": _prefixed("F", "pnum1"),
    "resistance": _prefixed("ohm", "um1kM") | _prefixed("\N{GREEK CAPITAL LETTER OMEGA}", "um1kM"),
    "frequency": _prefixed("Hz", "m1kMG"),
    "force": _prefixed("N", "um1k"),
    "moment": {f"{prefix}N{space}{length}": factor * metres for space in (" ", "")
               for prefix, factor in (("u", Decimal("1e-6")), ("m", Decimal("1e-3")), ("", Decimal(1)))
               for length, metres in (("mm", Decimal("1e-3")), ("m", Decimal(1)))},
    "pressure": _prefixed("Pa", "m1kMG"),
    "conductivity": _prefixed("S/m", "m1kM"),
    "angle": {"deg": Decimal(repr(math.pi / 180)), "\N{DEGREE SIGN}": Decimal(repr(math.pi / 180)), "rad": Decimal(1)},
    "temperature": {"degC": Decimal(1), "C": Decimal(1), "\N{DEGREE SIGN}C": Decimal(1)},
    "temperature coefficient": {"1/K": Decimal(1), "/K": Decimal(1), "ppm/K": Decimal("1e-6")},
    "temperature difference": _prefixed("K", "m1"),
    "temperature rate": {"K/s": Decimal(1), "K/min": Decimal(1) / 60},
}
"""Accepted units of each dimension with their factors to SI."""

EXAMPLES = {
    "length": "0.1 mm, 100 um or 4 mil",
    "inductance": "180 nH",
    "capacitance": "330 pF",
    "resistance": "0.3 ohm",
    "frequency": "40 MHz",
    "force": "4.8 N",
    "moment": "5 N mm",
    "pressure": "300 kPa",
    "conductivity": "58 MS/m",
    "angle": "90 deg",
    "temperature": "37 degC",
    "temperature coefficient": "3930 ppm/K",
    "temperature difference": "0.5 K",
    "temperature rate": "1.7 K/min",
}

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,4})?")
_LONGEST = 64


class UnitError(ValueError):
    """Raised for a quantity that cannot be read. The message contains the input, and `hint` the allowed form.

    ``reason`` is ``"unit"`` (missing, unknown or of another dimension), ``"number"`` (no number), ``"range"`` (not
    finite or absurdly large) or ``"type"`` (neither a text nor a number). ``candidates`` are corrections that the user
    may have meant, as text. ``is_sure`` is True if the only candidate is the only possible reading.
    """

    def __init__(
        self, message: str, reason: str, advice: str = "", candidates: tuple[str, ...] = (), is_sure: bool = True
    ) -> None:
        super().__init__(message)
        self.reason, self.advice, self.candidates, self.is_sure = reason, advice, candidates, is_sure

    @property
    def hint(self) -> str:
        """Text with the candidates ("did you mean 3 mm?") and the allowed form."""
        return f"did you mean {' or '.join(self.candidates)}? {self.advice}" if self.candidates else self.advice

    @property
    def meant(self) -> str:
        """The only candidate. Empty if there is none, or more than one."""
        return self.candidates[0] if len(self.candidates) == 1 else ""

    def in_range(self, dimension: str, low: float, high: float) -> UnitError:
        """Return this error with only those candidates that lie from `low` to `high` (SI units of `dimension`).

        If the range removes a candidate, ``is_sure`` becomes False.
        """
        remaining = tuple(text for text in self.candidates if _is_within(text, dimension, low, high))
        is_sure = self.is_sure and remaining == self.candidates
        return UnitError(str(self), self.reason, self.advice, remaining, is_sure)


def _is_within(text: str, dimension: str, low: float, high: float) -> bool:
    try:
        return low <= parse_quantity(text, dimension) <= high
    except UnitError:
        return False


def parse_quantity(value: str | int | float, dimension: str) -> float:
    """Return a quantity in SI units.

    A length without a unit is in millimetres. In every other dimension, a unit is required, except for an angle of
    zero. The result is the double nearest to the written number, so that ``100 um``, ``0.1 mm`` and ``0.1`` agree.

    Raises
    ------
    UnitError
        if there is no finite number, or its unit is missing or of another dimension
    """
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise UnitError(f"{_shortened(value)} is no {dimension}", "type", f"write it like {EXAMPLES[dimension]}")
    number, unit = _number_and_unit(value, dimension)
    if unit:
        factor = UNITS[dimension].get(unit)
        if factor is None:
            raise _unit_error(number, unit, dimension)
    elif dimension == "length":
        factor = Decimal("1e-3")
    elif dimension == "angle" and number == 0:
        factor = Decimal(1)
    else:
        needs = f"{'an' if dimension[0] in 'aeiou' else 'a'} {dimension} needs one"
        raise UnitError(f"{number} has no unit, and {needs}", "unit", f"write it like {EXAMPLES[dimension]}")
    result = float(number * factor)
    if not math.isfinite(result):
        raise UnitError(f"{_shortened(value)} is not a usable number", "range", "it is too large for any sensor")
    return result


def _number_and_unit(value: str | int | float, dimension: str) -> tuple[Decimal, str]:
    """Return the number and the unit of a written quantity. Raises UnitError if there is no number."""
    if not isinstance(value, str):
        if (isinstance(value, int) and abs(value) >= 10**30) or not math.isfinite(value):
            raise UnitError(
                f"{_shortened(value)} is not a usable number", "range", f"write it like {EXAMPLES[dimension]}"
            )
        return Decimal(value if isinstance(value, int) else repr(float(value))), ""
    text = value.strip()
    match = _NUMBER.match(text[:_LONGEST])
    if match is None or len(text) > _LONGEST:
        raise UnitError(f"{_shortened(value)} is no {dimension}", "number", f"write it like {EXAMPLES[dimension]}")
    unit = text[match.end() :].strip()
    if re.match(r",\d", unit):
        suggestion, is_thousand = text.replace(",", "."), re.match(r",\d{3}(?!\d)", unit) is not None
        message = f"{_shortened(value)} has a decimal comma"
        raise UnitError(message, "number", "write a point before decimals", (suggestion,), not is_thousand)
    return Decimal(match.group()), unit


_SCALES: dict[str, tuple[Decimal, Decimal]] = {
    **dict.fromkeys(("degF", "F", "\N{DEGREE SIGN}F"), (Decimal(-32), Decimal(5) / 9)),
    **dict.fromkeys(("K", "degK"), (Decimal("-273.15"), Decimal(1))),
}
"""Temperature scales besides Celsius, by unit. (value + first number) times the second number is in Celsius."""


_SI_PREFIXES = frozenset("YZEPTGMkhdcmunpfa")


def _unit_error(number: Decimal, unit: str, dimension: str) -> UnitError:
    """Return the error for an unknown unit. Its candidates have similar units of the dimension."""
    allowed = f"allowed: {', '.join(name for name in UNITS[dimension] if name.isascii())}"
    if dimension == "temperature" and unit in _SCALES:
        offset, factor = _SCALES[unit]
        celsius = f"{float((number + offset) * factor):.12g} degC"
        return UnitError(f"{unit!r} is not a unit that is read here", "unit", allowed, (celsius,))
    other = next((name for name, units in UNITS.items() if unit in units), None)
    if other:
        return UnitError(f"{unit[:24]} is a unit of {other}, not of {dimension}", "unit", allowed)
    close = [name for name in UNITS[dimension] if name.casefold() == unit.casefold() and name.isascii()]
    if unit[:1].isupper():  # a small m for mega is a common slip, a capital M for milli is not
        close = [name for name in close if name[0] == unit[0]] or close
    # Units that differ by their SI prefix, such as MN and mN, are a factor of 1e9 apart
    is_sure = len(close) == 1 and not (unit[0] != close[0][0] and unit[0] in _SI_PREFIXES)
    close = close or difflib.get_close_matches(unit[:12], [n for n in UNITS[dimension] if n.isascii()], 1, 0.6)
    candidates = tuple(f"{number} {name}" for name in close)
    return UnitError(f"{unit[:24]!r} is no unit of {dimension}", "unit", allowed, candidates, is_sure)


def _shortened(value: object) -> str:
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**30:
        return "a number of more than thirty digits"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


SI_UNITS = {
    "length": "m", "inductance": "H", "capacitance": "F", "resistance": "ohm", "frequency": "Hz", "force": "N",
    "moment": "N m", "pressure": "Pa", "conductivity": "S/m", "angle": "rad", "temperature": "degC",
    "temperature coefficient": "1/K", "temperature difference": "K", "temperature rate": "K/s",
}
"""SI unit of each dimension, in which values are stored."""

_WRITTEN = {
    dimension: tuple(f"{prefix}{unit}" for prefix in ("n", "u", "m", "", "k", "M", "G")
                     if f"{prefix}{unit}" in UNITS[dimension] and (dimension, prefix) != ("length", ""))
    for dimension, unit in SI_UNITS.items() if dimension != "angle"
}
"""Units that `exact_text` writes, by dimension, the smallest first. Lengths are at most millimetres."""


def exact_text(value: float, dimension: str) -> str:
    """Return a quantity (SI) as a text that `parse_quantity` reads back as exactly `value`."""
    number = Decimal(repr(float(value)))
    if dimension == "angle":
        degrees = f"{math.degrees(value):.12g} deg"
        return degrees if parse_quantity(degrees, dimension) == value else f"{value!r} rad"
    units, factors = _WRITTEN[dimension], UNITS[dimension]
    usual = "mm" if dimension == "length" else SI_UNITS[dimension]
    unit = next((name for name in reversed(units) if number and abs(number) >= factors[name]), usual)
    scaled = (number / factors[unit]).normalize()
    return f"{scaled:f} {unit}" if abs(scaled.adjusted()) < 20 else f"{scaled} {unit}"


_SHOWN = {
    "": ((1.0, ""),),
    "m": ((1e-9, "nm"), (1e-6, "um"), (1e-3, "mm"), (10.0, "m")),
    "m2": ((1e-6, "mm2"),),
    "m3": ((1e-9, "mm3"),),
    "H": ((1e-12, "pH"), (1e-9, "nH"), (1e-6, "uH"), (1e-3, "mH"), (1.0, "H")),
    "F": ((1e-12, "pF"), (1e-9, "nF"), (1e-6, "uF"), (1e-3, "mF"), (1.0, "F")),
    "ohm": ((1e-6, "uohm"), (1e-3, "mohm"), (1.0, "ohm"), (1e3, "kohm"), (1e6, "Mohm")),
    "Hz": ((1e-3, "mHz"), (1.0, "Hz"), (1e3, "kHz"), (1e6, "MHz"), (1e9, "GHz")),
    "N": ((1e-3, "mN"), (1.0, "N"), (1e3, "kN")),
    "N m": ((1e-6, "mN mm"), (1e-3, "N mm"), (1.0, "N m")),
    "Pa": ((1.0, "Pa"), (1e3, "kPa"), (1e6, "MPa"), (1e9, "GPa")),
    "V": ((1e-3, "mV"), (1.0, "V")),
    "A": ((1e-6, "uA"), (1e-3, "mA"), (1.0, "A")),
    "s": ((1e-9, "ns"), (1e-6, "us"), (1e-3, "ms"), (1.0, "s")),
    "S/m": ((1.0, "S/m"), (1e3, "kS/m"), (1e6, "MS/m")),
}


def show(value: float, unit: str, digits: int = 4) -> str:
    """Return a quantity (SI) as text for people: ``show(2.523424e-6, "H")`` is ``"2.523 uH"``.

    `unit` is the name of the SI unit (``m``, ``H``, ``F``, ``ohm``, ``Hz``, ``N``, ``N m``, ``Pa``, ``V``, ``A``,
    ``s``, ``S/m``). Any other unit is written without a prefix. `digits` are significant digits, and trailing zeros are
    dropped. Lengths up to 10 m are in millimetres or smaller units. The text does not depend on the locale.
    """
    if not math.isfinite(value):
        return f"{value} {unit}".strip()
    rounded = float(f"{value:.{max(1, digits) - 1}e}")
    factor, name = 1.0, unit
    for threshold, candidate in _SHOWN.get(unit, ()):
        if abs(rounded) >= threshold or (candidate == _SHOWN[unit][0][1] and rounded != 0):
            factor, name = (1.0 if candidate == unit else threshold), candidate
    if value == 0:
        factor, name = (1e-3, "mm") if unit == "m" else (1.0, unit)
    return f"{_plain(rounded / factor, digits)} {name}".strip()


def quantity_as(value: object, form: str) -> str:
    """Return a value as text in the form of a template.

    Parameters
    ----------
    value
        Quantity in SI units (a fraction for ``%``), a text, a count, or a sequence of these.
    form : str
        A unit, optionally with significant digits. An SI unit (``m``, ``ohm``, ``N m 3``) gets a readable prefix, as in
        `show`. Any other unit of `UNITS` (``um``, ``MHz``, ``deg``) is written as it is. Further forms are ``%``,
        ``number``, ``count NOUN`` (``2 coils``), and for sequences a form with ``and``, ``or``, ``x`` or ``list`` at
        its end. Texts and whole numbers need no form.

    Raises
    ------
    ValueError
        If the form is unknown, or missing for a number that is not whole.

    Examples
    --------
    >>> quantity_as(1.5e-4, "m"), quantity_as(2, "count coil"), quantity_as(("a", "b"), "or")
    ('0.15 mm', '2 coils', 'a or b')
    """
    words = form.split()
    if words and words[-1] in _JOINING:
        if not isinstance(value, Sequence):
            raise ValueError(f"{value!r} is no sequence, but its form is {form!r}")
        *texts, last = [quantity_as(each, " ".join(words[:-1])) for each in value] or ["none"]
        before, joint = _JOINING[words[-1]]
        return f"{before.join(texts)}{joint}{last}" if texts else last
    if not words and isinstance(value, (str, int)):
        return str(value)
    if words[:1] == ["count"] and isinstance(value, (int, float)):
        return count_text(int(value), " ".join(words[1:]))
    digits = int(words.pop()) if words and words[-1].isdigit() else 4
    unit = " ".join(words)
    if not unit or not isinstance(value, (int, float)):
        raise ValueError(f"{value!r} cannot be written in the form {form!r}")
    if unit in ("%", "number"):
        return f"{_plain(100.0 * value, digits)} %" if unit == "%" else _plain(value, digits)
    if unit in _SHOWN:
        return show(value, unit, digits)
    factor = next((float(units[unit]) for units in UNITS.values() if unit in units), None)
    if factor is None:
        raise ValueError(f"{unit!r} is no unit")
    return f"{_plain(value / factor, digits)} {unit}"


_JOINING = {"and": (", ", " and "), "or": (", ", " or "), "list": (", ", ", "), "x": (" x ", " x ")}
"""Separators by the last word of a form: between the texts of a sequence, and before its last text."""


DASH = "-"
"""Text for a value that is absent or not finite."""


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """Return a number with its unit as text, as `show` does. A dash if it is absent or not finite."""
    return show(value, unit, digits) if value is not None and math.isfinite(value) else DASH


def fixed_decimals(value: float, most: int = 4, least: int = 0) -> str:
    """Return a number as text with `least` to `most` decimals, equal on every machine and never "-0".

    All files and drawings write their coordinates with this function.
    """
    whole, _, decimals = f"{value:.{most}f}".partition(".")
    decimals = decimals.rstrip("0").ljust(least, "0")
    text = f"{whole}.{decimals}" if decimals else whole
    return text.removeprefix("-") if not text.strip("-0.") else text


def in_mm(metres: float, most: int = 4, least: int = 0) -> str:
    """Return a length (m) in millimetres without its unit, as `fixed_decimals` writes it."""
    return fixed_decimals(metres * 1e3, most, least)


def _plain(number: float, digits: int) -> str:
    """Return a number as text with significant digits and without trailing zeros.

    From 1e-6 to 1e9, the text has no exponent.
    """
    text = f"{number:.{max(1, digits)}g}"
    if "e" in text and 1e-6 <= abs(number) < 1e9:
        places = max(0, digits - 1 - math.floor(math.log10(abs(number))))
        text = f"{number:.{places}f}"
    if "." in text and "e" not in text:
        text = text.rstrip("0").rstrip(".")
    return text


def count_text(count: int, what: str) -> str:
    """Return a count with its noun `what`, in the plural unless the count is one."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def number_cell(value: float) -> str:
    """Return a number as text with ten digits, for a table that programs read. Empty if it is not finite."""
    return f"{value + 0.0:.10g}" if math.isfinite(value) else ""


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Return rows as comma-separated values, one line per row. The first row is the head."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def aligned_lines(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table for people, with aligned columns and two spaces between them."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def escape_controls(text: str) -> str:
    """Return `text` with spaces for tabs, and with control characters escaped."""
    return "".join(" " if c == "\t" else c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
