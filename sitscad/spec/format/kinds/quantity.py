"""Lengths and other quantities, with their unit and range; two lengths."""

from __future__ import annotations

import re
from typing import Any

from sitscad.record import record
from sitscad.spec.format.kinds.kind import Scalar
from sitscad.spec.format.kinds.refusal import described, refuse
from sitscad.units import EXAMPLES, UNITS, UnitError, parse_quantity, show

_UNIT_RULES = {"unit": "SIT005", "number": "SIT004", "range": "SIT006", "type": "SIT004"}
_SI = {
    "length": "m",
    "inductance": "H",
    "capacitance": "F",
    "resistance": "ohm",
    "frequency": "Hz",
    "force": "N",
    "pressure": "Pa",
    "conductivity": "S/m",
    "angle": "rad",
    "temperature": "degC",
    "temperature coefficient": "1/K",
}


@record
class Quantity(Scalar):
    """A dimensional value within a range that is itself written with units; the result is SI."""

    dimension: str
    low: str
    high: str

    def read(self, value: Any) -> float:
        """The value in SI units."""
        try:
            found = parse_quantity(value, self.dimension)
        except UnitError as error:
            refuse(_UNIT_RULES[error.reason], str(error), error.hint, meant=error.meant, is_sure=error.is_sure)
        self._check_range(found, value)
        return found

    def _check_range(self, found: float, value: Any) -> None:
        """Refuse a value (SI) out of range."""
        low, high = parse_quantity(self.low, self.dimension), parse_quantity(self.high, self.dimension)
        if low <= found <= high:
            return
        limit, word = (low, "at least") if found < low else (high, "at most")
        bound = self.low if found < low else self.high
        unit = _SI[self.dimension]
        written = f"{described(value)} ({show(found, unit)})" if self.dimension == "length" else described(value)
        message = f"{written} is out of range: {word} {bound}"
        refuse("SIT006", message, "check the unit and the sign", measured=found, limit=limit, unit=unit)

    def schema(self) -> dict[str, Any]:
        """A number of millimetres (lengths only) or a text with a unit."""
        units = "|".join(re.escape(unit) for unit in UNITS[self.dimension])
        pattern = rf"^\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*({units})\s*$"
        text = {"type": "string", "pattern": pattern, "examples": [EXAMPLES[self.dimension]]}
        if self.dimension != "length":
            return text if self.dimension != "angle" else {"anyOf": [{"const": 0}, text]}
        low, high = (float(show(parse_quantity(b, "length") * 1e3, "")) for b in (self.low, self.high))
        return {"anyOf": [{"type": "number", "minimum": low, "maximum": high, "description": "millimetres"}, text]}


@record
class Pair(Scalar):
    """Two lengths [x, y]; with `single`, one length stands for both."""

    length: Quantity
    single: bool = False

    def read(self, value: Any) -> tuple[float, float]:
        """The two lengths in metres."""
        if isinstance(value, list):
            if len(value) != 2:
                refuse("SIT004", f"{described(value)}, where [x, y] is wanted", "write two lengths, like [4, 8]")
            return self.length.read(value[0]), self.length.read(value[1])
        if not self.single:
            refuse("SIT004", f"{described(value)}, where [x, y] is wanted", "write two lengths, like [-2, 0]")
        side = self.length.read(value)
        return side, side

    def schema(self) -> dict[str, Any]:
        """A list of two lengths, or one length."""
        one = self.length.schema()
        two = {"type": "array", "items": one, "minItems": 2, "maxItems": 2}
        return {"anyOf": [*one["anyOf"], two]} if self.single else two
