"""The text of a spec as plain values, with the line and column of every key and value."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

MAX_BYTES = 256 * 1024
_LONGEST_NUMBER = 64

_INT = re.compile(r"[-+]?[0-9]+")
_OTHER_INT = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_WORDS: dict[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), float("-inf")),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}

Position = tuple[int, int]

DOT = "\0"
"""Stands for a dot within a key's name in dotted keys, so that ``coil.turns: 3`` is not taken for coil: {turns: 3}."""


def dotted(parent: str, name: object) -> str:
    """The dotted key of an entry of a section or list."""
    own = str(name).replace(".", DOT)
    return f"{parent}.{own}" if parent else own


def undotted(key: str) -> str:
    """A dotted key as a person reads it."""
    return key.replace(DOT, ".")


class TextError(ValueError):
    """The text is not a spec at all: rule, message, hint and the place (line and column from 1)."""

    def __init__(
        self, rule: str, message: str, hint: str = "", place: Position = (1, 1), key: str | None = None
    ) -> None:
        super().__init__(message)
        self.rule, self.message, self.hint, self.place, self.key = rule, message, hint, place, key


@dataclass
class YamlText:
    """Plain values (dict, list, str, int, float, bool, None) and where they stand, under dotted keys.

    ``keys`` holds where each key or list entry begins, ``values`` where each single value (or bracketed one) begins,
    ``ends`` where each of those ends that is not empty and no block of lines; ``flaws`` are complaints that do not keep
    the rest from being read.
    """

    data: Any = None
    keys: dict[str, Position] = field(default_factory=dict)
    values: dict[str, Position] = field(default_factory=dict)
    ends: dict[str, Position] = field(default_factory=dict)
    flaws: list[TextError] = field(default_factory=list)


def plain_value(text: str) -> Any:
    """A plain scalar after YAML 1.2's core schema; absurdly long integers become infinite and cost no time."""
    if text in _WORDS:
        return _WORDS[text]
    if _INT.fullmatch(text):
        return int(text) if len(text) <= _LONGEST_NUMBER else float("inf")
    if _OTHER_INT.fullmatch(text):
        return int(text, 0) if len(text) <= _LONGEST_NUMBER else float("inf")
    if _FLOAT.fullmatch(text):
        return float(text)  # costs no more than reading it
    return text
