"""One YAML text to plain values: read line by line where it is plain, which is nearly always, else as a whole.

A plain text is read at a tenth of the time of a whole YAML reader: sections and lists by indentation, one value a
line: a word or number, a text in quotes without escapes, or brackets that close on their line. Whatever is not surely
that is left to the whole reader (`events`), faults of the text among it; where this one answers, the other would
say the same of values and places.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from sitscad.spec.yaml.source import MAX_BYTES, TextError, YamlText, plain_value

MAX_NODES, MAX_DEPTH = 3000, 10
"""Both stay within what the whole reader takes, so that it alone decides what is too large."""

_OTHER_CHARACTERS = re.compile(r"[^\n -~\u00a1-\u2027\u202a-\ud7ff]")
_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,60}")
_BARE = re.compile(r"(?:[A-Za-z0-9/~]|[-+.](?=[A-Za-z0-9.]))[!-\"$-9;-~]*(?: +[!-\"$-9;-~]+)*")
_BARE_INSIDE = re.compile(r"(?:[A-Za-z0-9/~]|[-+.](?=[A-Za-z0-9.]))[A-Za-z0-9._+/%*()-]*(?: +[A-Za-z0-9._+/%*()-]+)*")
_QUOTED = re.compile(r'"[^"\\\n]*"|\'[^\'\n]*\'')
_END = re.compile(r" *(?: #.*)?$")
_COLON = re.compile(r":(?= |$)")
_SPACES = re.compile(r" *")


class NotPlain(ValueError):
    """The text may be YAML, but it is not plain."""


@dataclass
class _TextLine:
    """What stands on a line: its number from 1, the column from 0 where it begins, and its text from column 0."""

    number: int
    indent: int
    text: str


class PlainReader:
    """Reads one text."""

    def __init__(self, text: str) -> None:
        if _OTHER_CHARACTERS.search(text):
            raise NotPlain
        self.found, self.nodes = YamlText(), 0
        self.lines = [
            _TextLine(number, len(line) - len(line.lstrip(" ")), line)
            for number, line in enumerate(text.split("\n"), 1)
            if (content := line.lstrip(" ")) and not content.startswith("#")
        ]
        self.next = 0

    def read(self) -> YamlText:
        """The values of the text; raises `NotPlain` where it is not surely plain."""
        if not self.lines or self.lines[0].indent:
            raise NotPlain
        self.found.data = self._block("", 0, 1)
        if self.next < len(self.lines):
            raise NotPlain
        return self.found

    def _count(self, depth: int) -> None:
        self.nodes += 1
        if self.nodes > MAX_NODES or depth > MAX_DEPTH:
            raise NotPlain

    def _end(self, line: _TextLine, at: int) -> None:
        if not _END.match(line.text, at):
            raise NotPlain

    def _block(self, key: str, indent: int, depth: int) -> Any:
        """The section or list whose entries begin in a column, from the next line on."""
        self._count(depth)
        is_list = self.lines[self.next].text.startswith("- ", indent)
        found: Any = [] if is_list else {}
        while self.next < len(self.lines) and self.lines[self.next].indent == indent:
            line = self.lines[self.next]
            if line.text.startswith("- ", indent) is not is_list:
                break  # a section goes on after a list that stands in its own column
            if is_list:
                self._entry(line, indent, key, found, depth)
            else:
                self._pair(line, indent, key, found, depth)
        if self.next < len(self.lines) and self.lines[self.next].indent > indent:
            raise NotPlain
        return found

    def _entry(self, line: _TextLine, indent: int, parent: str, found: list[Any], depth: int) -> None:
        key = f"{parent}.{len(found)}" if parent else str(len(found))
        column = _after_blanks(line.text, indent + 1)
        self.found.keys[key] = line.number, column + 1
        name = _KEY.match(line.text, column)
        if name and _COLON.match(line.text, name.end()):  # a section that begins beside its dash
            line.text, line.indent = " " * column + line.text[column:], column
            found.append(self._block(key, column, depth + 1))
            return
        self.next += 1
        value, end = self._value(line, column, key, depth)
        self._end(line, end)
        found.append(value)

    def _pair(self, line: _TextLine, column: int, parent: str, found: dict[str, Any], depth: int) -> None:
        name, key, at = self._name(line, column, parent, found)
        self.next += 1
        self._count(depth)
        if not _END.match(line.text, at):
            found[name], end = self._value(line, _after_blanks(line.text, at), key, depth)
            self._end(line, end)
            return
        below = self.lines[self.next] if self.next < len(self.lines) else None
        is_list = below is not None and below.text.startswith("- ", below.indent)
        if below is None or below.indent < column or (below.indent == column and not is_list):
            raise NotPlain  # a key without a value
        found[name] = self._block(key, below.indent, depth + 1)

    def _name(self, line: _TextLine, column: int, parent: str, found: dict[str, Any]) -> tuple[str, str, int]:
        """A key's name, its dotted key, and where the text goes on after its colon."""
        match = _KEY.match(line.text, column)
        colon = _COLON.match(line.text, match.end()) if match else None
        if match is None or colon is None or match[0] in found or not isinstance(plain_value(match[0]), str):
            raise NotPlain
        key = f"{parent}.{match[0]}" if parent else match[0]
        self.found.keys[key] = line.number, column + 1
        return match[0], key, colon.end()

    def _value(self, line: _TextLine, column: int, key: str, depth: int, is_inside: bool = False) -> tuple[Any, int]:
        """The value that begins in a column, and where it ends; NotPlain for what the whole reader has to read."""
        self._count(depth)
        self.found.values[key] = line.number, column + 1
        if line.text[column : column + 1] in ("[", "{"):
            value, end = self._brackets(line, column, key, depth + 1)
        elif match := _QUOTED.match(line.text, column):
            value, end = match[0][1:-1], match.end()
        elif match := (_BARE_INSIDE if is_inside else _BARE).match(line.text, column):
            value, end = plain_value(match[0]), match.end()
        else:
            raise NotPlain
        self.found.ends[key] = line.number, end + 1
        return value, end

    def _brackets(self, line: _TextLine, column: int, key: str, depth: int) -> tuple[Any, int]:
        """The list or section in brackets that begins at a column, and where it ends."""
        is_list = line.text[column] == "["
        close = "]" if is_list else "}"
        found: list[Any] | dict[str, Any] = [] if is_list else {}
        at = _after_blanks(line.text, column + 1)
        if line.text.startswith(close, at):
            return found, at + 1
        while True:
            at = self._inside(line, at, key, found, depth)
            at = _after_blanks(line.text, at)
            if line.text.startswith(close, at):
                return found, at + 1
            if not line.text.startswith(",", at):
                raise NotPlain
            at = _after_blanks(line.text, at + 1)

    def _inside(self, line: _TextLine, at: int, key: str, found: Any, depth: int) -> int:
        if isinstance(found, list):
            inner = f"{key}.{len(found)}" if key else str(len(found))
            self.found.keys[inner] = line.number, at + 1
            value, end = self._value(line, at, inner, depth, is_inside=True)
            found.append(value)
            return end
        name, inner, at = self._name(line, at, key, found)
        self._count(depth)
        found[name], end = self._value(line, _after_blanks(line.text, at), inner, depth, is_inside=True)
        return end


def _after_blanks(text: str, at: int) -> int:
    match = _SPACES.match(text, at)
    return match.end() if match else at


def read_yaml(text: str) -> YamlText:
    """The values of one YAML document; raises `TextError` where there is no such document."""
    if len(text.encode("utf-8", "surrogatepass")) > MAX_BYTES:
        raise TextError("SIT010", f"the spec is larger than {MAX_BYTES // 1024} KiB", "is this the right file?")
    try:
        return PlainReader(text).read()
    except NotPlain:
        from sitscad.spec.yaml.events import read_events  # its import alone takes longer than a plain text

        return read_events(text)
