"""The text that a spec was read from, so that every finding can point into it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class SpecSource:
    """Path as typed, text, and for every dotted key (``fpc.tail.length``, ``array.centres.0``) its line and column from 1.

    ``values`` holds where each value stands, ``keys`` where each key stands; ``defaults`` says what was filled in and why.
    """

    path: str
    text: str
    keys: Mapping[str, tuple[int, int]] = field(default_factory=dict, compare=False, hash=False)
    values: Mapping[str, tuple[int, int]] = field(default_factory=dict, compare=False, hash=False)
    defaults: tuple[str, ...] = ()

    @property
    def sha256(self) -> str:
        """Hash of the text, hexadecimal."""
        return hashlib.sha256(self.text.encode("utf-8")).hexdigest()

    def locate(self, key: str | None) -> tuple[int | None, int | None]:
        """Line and column of a dotted key; of its nearest parent where it is missing; (None, None) without any."""
        while key:
            if key in self.keys:
                return self.keys[key]
            key = key.rpartition(".")[0]
        return (1, 1) if self.text else (None, None)

    def line(self, number: int) -> str:
        """One line of the text, counted from 1."""
        lines = self.text.splitlines()
        return lines[number - 1] if 0 < number <= len(lines) else ""
