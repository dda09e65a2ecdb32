"""Messages, hints and details of findings, from the templates in `data/messages.csv`.

A template names values in braces. The text after a colon is the value's format: ``{gap:m}`` is a length in a readable
unit, ``{gap:um 3}`` a length in micrometres with three digits. `basics.units.quantity_as` lists the formats.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from string import Formatter
from typing import Any

from sitscad.basics.units import quantity_as
from sitscad.data import rows


class _Template(Formatter):
    """Formatter whose format specifications are units. A value that is a function is called when its text is needed."""

    def get_value(self, key: int | str, args: object, kwargs: Mapping[str, Any]) -> Any:
        """Return a named value. Raises KeyError for a missing value."""
        value = kwargs[str(key)]
        return value() if callable(value) else value

    def format_field(self, value: object, format_spec: str) -> str:
        """Return a value as text. Raises ValueError for an unknown format, or a number without a format."""
        return quantity_as(value, format_spec)


_TEMPLATE = _Template()


@cache
def templates() -> dict[str, dict[str, str]]:
    """Return all rows of ``data/messages.csv`` by case.

    A row has the templates ``message``, ``hint`` and ``detail``, and the rules that use the case.
    """
    return {row["case"]: row for row in rows("messages")}


def text_of(case: str, part: str, values: Mapping[str, object]) -> str:
    """Return the ``message``, ``hint`` or ``detail`` (`part`) of a case, with `values` inserted.

    Raises KeyError for a missing value.
    """
    return _TEMPLATE.vformat(templates()[case][part], (), values)
