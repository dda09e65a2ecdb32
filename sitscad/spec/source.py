"""The text that a spec was read from, so that every finding can point into it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import field

from sitscad.record import record


@record
class SpecSource:
    """Path as typed, text, and for every dotted key (``fpc.tail.length``) its line and column, counted from 1.

    ``keys`` holds where each key or list entry stands, ``values`` where each value stands that begins beside its key
    (single values and bracketed ones; a section is where its key is); ``defaults`` says what was filled in and why.
    ``files`` holds the bytes of every file that was read for it, the spec itself and the profiles that it names, by
    their paths from the spec's folder; it is empty for a text that came from no file.
    """

    path: str
    text: str
    keys: Mapping[str, tuple[int, int]] = field(default_factory=dict, compare=False, hash=False)
    values: Mapping[str, tuple[int, int]] = field(default_factory=dict, compare=False, hash=False)
    defaults: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict, compare=False, hash=False)

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
        """Line and column of a dotted key's value; of its nearest parent where it is missing;
        (None, None) without any.
        """
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
