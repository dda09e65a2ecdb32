"""What a study varies: keys of a spec, each over values that are counted, so that two designs are equal or are not."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from itertools import product
from typing import Any

from sitscad.record import record
from sitscad.study.changes import Changes

MOST_VALUES = 100_000
"""Values of one key at most."""

STEPS = 50
"""Into how many steps at least a range without a step is divided: of one, two or five in their last figure."""

Point = tuple[int, ...]
"""A design by the numbers of its variables' values, from 0."""

_WRITTEN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*")


class RangeError(ValueError):
    """A range that cannot be read; the text says why, and `hint` what to write."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@record
class Variable:
    """One key, the values that it may have as a spec has them, and whether they follow each other as numbers do."""

    key: str
    values: tuple[Any, ...]
    is_ordered: bool = True


def stepped(low: Any, high: Any, step: Any = None) -> tuple[Any, ...]:
    """Values from one to another, both as a spec has them; a step that is not given is a round one. The last value is
    the last step's within the range, and the range's end where no step was given.
    """
    (first, unit), (last, _) = _pair(low, high)
    if step is None:
        by = _round_step((last - first) / STEPS)
    else:
        by, other = _number(step)
        if other != unit:
            raise RangeError(f"the step {step} has another unit than {low}", "write all three with one unit")
        if by <= 0:
            raise RangeError(f"the step {step} is not above nothing")
    count = int((last - first) / by) + 1
    if count > MOST_VALUES:
        raise RangeError(f"{count} values from {low} to {high}; {MOST_VALUES} are the most", "a larger step")
    found = [first + k * by for k in range(count)]
    if step is None and found[-1] != last:
        found.append(last)
    return tuple(_written(value, unit) for value in found)


def counted(low: Any, high: Any, count: int) -> tuple[Any, ...]:
    """So many values from one to another, evenly, written with twelve figures at most."""
    (first, unit), (last, _) = _pair(low, high, may_fall=True)
    if not 1 <= count <= MOST_VALUES:
        raise RangeError(f"a count from 1 to {MOST_VALUES} is wanted, not {count}")
    by = (last - first) / max(count - 1, 1)
    return tuple(_written(Decimal(f"{first + k * by:.12g}"), unit) for k in range(count))


def _pair(low: Any, high: Any, may_fall: bool = False) -> tuple[tuple[Decimal, str], tuple[Decimal, str]]:
    """Both ends of a range, of one unit."""
    one, other = _number(low), _number(high)
    if one[1] != other[1]:
        raise RangeError(f"{low} and {high} have different units", "write both with one unit, like 75 um and 125 um")
    if not may_fall and one[0] >= other[0]:
        word = "is empty" if one[0] == other[0] else "is reversed"
        raise RangeError(f"the range from {low} to {high} {word}", "write the smaller value first")
    return one, other


def _number(value: Any) -> tuple[Decimal, str]:
    found = None if isinstance(value, bool) else _WRITTEN.fullmatch(str(value))
    if found is None or not math.isfinite(float(found[1])):
        raise RangeError(f"{value!r} is no number", "a number, with its unit where a spec has one, like 75 um")
    return Decimal(found[1]), found[2]


def _written(value: Decimal, unit: str) -> Any:
    """A number as a spec has it: whole where it is."""
    plain = int(value) if value == value.to_integral_value() else float(value)
    return f"{plain} {unit}" if unit else plain


def _round_step(least: Decimal) -> Decimal:
    """The largest step of one, two or five in its only figure that is no more than `least`."""
    power = Decimal(1).scaleb(least.adjusted())
    return next(figure * power for figure in (5, 2, 1) if figure * power <= least)


@record
class Space:
    """Variables, keys that always take the value of a variable's key (`same`: key to key), and what a value brings
    along (`brought`: by key, value as text, other keys and values).
    """

    variables: tuple[Variable, ...]
    same: Mapping[str, str]
    brought: Mapping[str, Mapping[str, Mapping[str, Any]]]

    @property
    def shape(self) -> tuple[int, ...]:
        """How many values each variable has."""
        return tuple(len(variable.values) for variable in self.variables)

    @property
    def size(self) -> int:
        """How many designs there are."""
        return math.prod(self.shape)

    def chosen(self, point: Point) -> dict[str, Any]:
        """The values of the variables at a point."""
        return {v.key: v.values[k] for v, k in zip(self.variables, point, strict=True)}

    def changes(self, point: Point) -> Changes:
        """All keys that change with a point, and their values."""
        chosen = self.chosen(point)
        found = dict(chosen)
        found |= {key: chosen[other] for key, other in self.same.items()}
        for key, value in chosen.items():
            found |= self.brought.get(key, {}).get(str(value), {})
        return tuple(found.items())

    def points(self) -> Iterator[Point]:
        """All points, the last variable fastest."""
        return product(*(range(count) for count in self.shape))
