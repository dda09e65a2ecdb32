"""Plain numbers: one, several, those of layers; and what is true or false."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import Any

from sitscad.record import record
from sitscad.spec.format.kinds.kind import Scalar
from sitscad.spec.format.kinds.refusal import described, refuse


@record
class Number(Scalar):
    """A plain number without a unit, within a range."""

    low: float
    high: float
    whole: bool = False

    def read(self, value: Any) -> float:
        """The number."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            quoted = value if isinstance(value, str) and re.fullmatch(r"[-+.\deE]+", value) else ""
            hint = "take the quotes off" if quoted else f"write a number, like {self.low:g}"
            refuse("SIT004", f"{described(value)} is no number", hint, meant=quoted)
        if not math.isfinite(value) or not self.low <= value <= self.high:
            limit = self.low if value < self.low else self.high
            message = f"{described(value)} is out of range: {self.low:g} to {self.high:g}"
            facts = {"measured": float(value)} if abs(value) < 1e30 else {}
            refuse("SIT006", message, "", limit=float(limit), **facts)
        if self.whole and value != int(value):
            refuse("SIT004", f"{described(value)} is no whole number", "")
        return int(value) if self.whole else float(value)

    def schema(self) -> dict[str, Any]:
        """A number or an integer with its bounds."""
        return {"type": "integer" if self.whole else "number", "minimum": self.low, "maximum": self.high}


@record
class NumberOrList(Scalar):
    """A number, or a list of numbers; read as a tuple, of one where it was no list."""

    number: Number
    most: int = 8

    def read(self, value: Any) -> tuple[float, ...]:
        """The numbers."""
        if not isinstance(value, list):
            return (self.number.read(value),)
        if not 1 <= len(value) <= self.most:
            refuse("SIT006", f"{described(value)} is out of range: 1 to {self.most} numbers", "like [8, 7]")
        return tuple(self.number.read(entry) for entry in value)

    def schema(self) -> dict[str, Any]:
        """A number or a list of numbers."""
        one = self.number.schema()
        return {"anyOf": [one, {"type": "array", "items": one, "minItems": 1, "maxItems": self.most}]}


@record
class Several(Scalar):
    """One or several values of a kind, or none of them (an empty list); read as a tuple."""

    one: Scalar
    most: int = 16

    def read(self, value: Any) -> tuple[Any, ...]:
        """The values, each as its kind reads it."""
        written = value if isinstance(value, list) else [value]
        if len(written) > self.most:
            refuse("SIT006", f"{len(written)} are out of range: at most {self.most}", "")
        return tuple(self.one.read(each) for each in written)

    def schema(self) -> dict[str, Any]:
        """One of them, or a list."""
        one = self.one.schema()
        many = {"type": "array", "items": one, "maxItems": self.most}
        return {"anyOf": [*one.get("anyOf", [one]), many]}


@record
class Layers(Scalar):
    """Copper layers: a count from the top, or a list of layer numbers from the top down."""

    most: int = 8

    def read(self, value: Any) -> tuple[int, ...]:
        """The layer numbers from 1."""
        number = Number(1, self.most, whole=True)
        if not isinstance(value, list):
            return tuple(range(1, int(number.read(value)) + 1))
        if not 1 <= len(value) <= self.most:
            refuse(
                "SIT006",
                f"{len(value)} layers are out of range: 1 to {self.most}",
                "write a count or a list like [1, 2]",
            )
        layers = tuple(int(number.read(entry)) for entry in value)
        if any(lower <= upper for upper, lower in pairwise(layers)):
            refuse(
                "SIT009", f"{list(layers)} does not run from the top down", "name each layer once, the top one first"
            )
        return layers

    def schema(self) -> dict[str, Any]:
        """An integer or a list of distinct integers."""
        one = Number(1, self.most, whole=True).schema()
        many = {"type": "array", "items": one, "minItems": 1, "maxItems": self.most, "uniqueItems": True}
        return {"anyOf": [one, many]}


@record
class Truth(Scalar):
    """True or false."""

    def read(self, value: Any) -> bool:
        """The truth."""
        if not isinstance(value, bool):
            refuse("SIT004", f"{described(value)}, where true or false is wanted", "write true or false")
        return bool(value)

    def schema(self) -> dict[str, Any]:
        """A boolean."""
        return {"type": "boolean"}
