"""A spec's text: plain values with the line and column of each, and what was read of it and how."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sitscad.record import record

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


@record
class SpecSource:
    """Path as typed, text, and for every dotted key (``fpc.tail.length``) its line and column, counted from 1.

    ``keys`` holds where each key or list entry stands, ``values`` where each value stands that begins beside its key
    (single values and bracketed ones; a section is where its key is); ``defaults`` says what was filled in and why.
    ``files`` holds the bytes of every file that was read for it, the spec itself and the profiles that it names, by
    their paths from the spec's folder; it is empty for a text that came from no file. ``folder`` is where these files
    lie if that is not the folder of the path: a package's own copies are told by the path of the spec that was built.
    """

    path: str
    text: str
    keys: Mapping[str, tuple[int, int]] = field(default_factory=dict, compare=False, hash=False)
    values: Mapping[str, tuple[int, int]] = field(default_factory=dict, compare=False, hash=False)
    defaults: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict, compare=False, hash=False)
    folder: str | None = field(default=None, compare=False, hash=False)

    @property
    def sha256(self) -> str:
        """Hash of the text, hexadecimal."""
        import hashlib  # loads OpenSSL, which most uses of a spec do not need

        return hashlib.sha256(self.text.encode("utf-8")).hexdigest()

    @property
    def kept(self) -> Mapping[str, bytes]:
        """What builds the same again: `files`, and the text itself where it came from none."""
        own = os.path.basename(self.path)
        return self.files if own in self.files else {own: self.text.encode("utf-8"), **self.files}

    def locate(self, key: str | None) -> tuple[int | None, int | None]:
        """Line and column of a dotted key's value; of its nearest parent where it is missing; (None, None) without."""
        while key:
            if key in self.values or key in self.keys:
                return self.values.get(key) or self.keys[key]
            key = key.rpartition(".")[0]
        return (1, 1) if self.text else (None, None)

    def absent(self, key: str | None) -> str | None:
        """The key of a value, if it is not in the text but could be added to it: not below a preset's name."""
        if not key or "." not in key or not self.keys or key in self.keys:
            return None
        parent = key.rpartition(".")[0]
        while parent and parent not in self.keys:
            parent = parent.rpartition(".")[0]
        is_section = not parent or any(name.startswith(f"{parent}.") for name in self.keys)
        return key if is_section else None

    def line(self, number: int) -> str:
        """One line of the text, counted from 1."""
        lines = self.text.splitlines()
        return lines[number - 1] if 0 < number <= len(lines) else ""


UNNUMBERED = "unnumbered"
"""What formats say that must name a revision, for a design that has none."""


@record
class Issue:
    """The revision, the part number and the date that a spec gives: texts, empty where it does not."""

    revision: str = ""
    part_number: str = ""
    date: str = ""

    @property
    def day(self) -> str:
        """The spec's date; where it gives none, the day of SOURCE_DATE_EPOCH; empty without either."""
        return self.date or (creation_date() or "").partition("T")[0]

    @property
    def rows(self) -> tuple[tuple[str, str], ...]:
        """What is known of it, each with its name."""
        known = (("Part number", self.part_number), ("Revision", self.revision), ("Date", self.day))
        return tuple((name, text) for name, text in known if text)

    @property
    def words(self) -> str:
        """All that is known in one line: ``part number A-17, revision B, 2026-11-22``; empty where nothing is known."""
        return ", ".join(text if name == "Date" else f"{name.lower()} {text}" for name, text in self.rows)

    @property
    def title(self) -> str:
        """The words with a capital first, as a line of its own begins."""
        return f"{self.words[:1].upper()}{self.words[1:]}"


def creation_date() -> str | None:
    """The date of SOURCE_DATE_EPOCH (seconds since 1970) in ISO 8601, UTC; None where it is not set or not a number."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not seconds.isdecimal():
        return None
    from datetime import UTC, datetime  # only papers ask

    return datetime.fromtimestamp(int(seconds), UTC).isoformat()
