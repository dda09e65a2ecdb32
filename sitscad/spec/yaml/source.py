"""Reader of a spec's text. It returns plain values with their line and column, and stores the text.

The reader uses only the events of the YAML parser, so that the text cannot construct objects. Aliases are errors. Size
and nesting depth are limited during reading.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import yaml
from yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    DocumentStartEvent,
    Event,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceStartEvent,
)
from yaml.reader import ReaderError

from sitscad.basics.digest import sha256
from sitscad.basics.record import record

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
"""Character that replaces a dot inside a key's name in dotted keys.

The key ``coil.turns`` of a text thus differs from the key ``turns`` in section ``coil``.
"""


def dotted(parent: str, name: object) -> str:
    """Return the dotted key of an entry. `parent` is the dotted key of its section or list, `name` its key or index."""
    entry = str(name).replace(".", DOT)
    return f"{parent}.{entry}" if parent else entry


def key_text(key: str) -> str:
    """Return a dotted key as text for messages. Dots inside names are restored."""
    return key.replace(DOT, ".")


class TextError(ValueError):
    """The text is not a valid spec. Fields: rule, message, hint, dotted key, and position (line and column from 1)."""

    def __init__(
        self, rule: str, message: str, hint: str = "", place: Position = (1, 1), key: str | None = None
    ) -> None:
        super().__init__(message)
        self.rule, self.message, self.hint, self.place, self.key = rule, message, hint, place, key


@dataclass
class YamlText:
    """Plain values (dict, list, str, int, float, bool, None) of a text, and their positions by dotted key.

    * ``keys``: start of each key or list entry
    * ``values``: start of each single value, and of each section or list in brackets
    * ``ends``: end of each of these values. Empty values and blocks of lines have no entry.
    * ``flaws``: errors after which the reader continued
    """

    data: Any = None
    keys: dict[str, Position] = field(default_factory=dict)
    values: dict[str, Position] = field(default_factory=dict)
    ends: dict[str, Position] = field(default_factory=dict)
    flaws: list[TextError] = field(default_factory=list)


def plain_value(text: str) -> Any:
    """Return the value that YAML 1.2 (core schema) gives to a scalar without quotes.

    Integers of more than 64 characters become infinite.
    """
    if text in _WORDS:
        return _WORDS[text]
    if _INT.fullmatch(text):
        return int(text) if len(text) <= _LONGEST_NUMBER else float("inf")
    if _OTHER_INT.fullmatch(text):
        return int(text, 0) if len(text) <= _LONGEST_NUMBER else float("inf")
    if _FLOAT.fullmatch(text):
        return float(text)  # fast for any length
    return text


@record
class SpecSource:
    """The text of a spec: path as the user typed it, text, and positions by dotted key.

    A position is (line, column), both counted from 1.

    * ``keys``: position of each key (``fpc.tail.length``) and of each list entry
    * ``values``: position of each single value, and of each section or list in brackets
    * ``defaults``: values that were filled in, each with its reason
    * ``files``: bytes of the spec and of all files that it names, by path relative to the spec's folder. Empty if the
      text did not come from a file.
    * ``folder``: folder of these files. None if it is the folder of the path. In a package, the path is the original
      spec's path, but the files are copies in the package's folder.
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
        """SHA-256 of the text, hexadecimal."""
        return sha256(self.text.encode("utf-8")).hexdigest()

    @property
    def files_to_store(self) -> Mapping[str, bytes]:
        """Bytes of all files that are needed to build the sensor again, by name.

        If the spec did not come from a file, its text is stored under the name in its path.
        """
        file_name = os.path.basename(self.path)
        return self.files if file_name in self.files else {file_name: self.text.encode("utf-8"), **self.files}

    def locate(self, key: str | None) -> tuple[int | None, int | None]:
        """Return line and column (from 1) of the value at a dotted key.

        If the text lacks the key, return the position of the nearest section that contains it. (None, None) if there is
        no text.
        """
        while key:
            if key in self.values or key in self.keys:
                return self.values.get(key) or self.keys[key]
            key = key.rpartition(".")[0]
        return (1, 1) if self.text else (None, None)

    def addable_key(self, key: str | None) -> str | None:
        """Return the key itself if the text lacks it and can take it.

        None if the text has the key, or cannot take it. A key cannot be added to a preset's name, for example.
        """
        if not key or "." not in key or not self.keys or key in self.keys:
            return None
        parent = key.rpartition(".")[0]
        while parent and parent not in self.keys:
            parent = parent.rpartition(".")[0]
        is_section = not parent or any(name.startswith(f"{parent}.") for name in self.keys)
        return key if is_section else None

    def line(self, number: int) -> str:
        """Return one line of the text, counted from 1. Empty if there is no such line."""
        lines = self.text.splitlines()
        return lines[number - 1] if 0 < number <= len(lines) else ""


UNNUMBERED = "unnumbered"
"""Text in place of the revision, for designs without a revision in file formats that require one."""


@record
class Issue:
    """Revision, part number and date of a spec. Each is empty if the spec does not state it."""

    revision: str = ""
    part_number: str = ""
    date: str = ""

    @property
    def day(self) -> str:
        """Date in the spec, or else the date of SOURCE_DATE_EPOCH (environment variable). Empty if neither is set."""
        return self.date or (creation_date() or "").partition("T")[0]

    @property
    def rows(self) -> tuple[tuple[str, str], ...]:
        """Pairs (name, text) of part number, revision and date. Empty values are left out."""
        entries = (("Part number", self.part_number), ("Revision", self.revision), ("Date", self.day))
        return tuple((name, text) for name, text in entries if text)

    @property
    def words(self) -> str:
        """Part number, revision and date in one line, like ``part number A-17, revision B, 2026-11-22``.

        Empty if none is set.
        """
        return ", ".join(text if name == "Date" else f"{name.lower()} {text}" for name, text in self.rows)

    @property
    def title(self) -> str:
        """`words` with a capital first letter."""
        return f"{self.words[:1].upper()}{self.words[1:]}"


def creation_date() -> str | None:
    """Return the time of the environment variable SOURCE_DATE_EPOCH as ISO 8601 text in UTC. None if it is not set.

    Raises ValueError if it is invalid.
    """
    seconds = creation_second()
    if seconds is None:
        return None
    return datetime.fromtimestamp(seconds, UTC).isoformat()


def creation_second() -> int | None:
    """Return SOURCE_DATE_EPOCH (seconds since 1970). None if it is not set. Raises ValueError if it is invalid."""
    written = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not written:
        return None
    if not written.isdecimal() or int(written) > LAST_SECOND:
        raise ValueError(f"SOURCE_DATE_EPOCH is {written[:40]!r}, not a number of seconds from 1970 to the year 9999")
    return int(written)


LAST_SECOND = 253_402_300_799
"""Last second of the year 9999, the latest that `datetime` can represent."""


PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""Parser of libyaml, or the Python parser if PyYAML was built without libyaml."""

MAX_VALUES = 4000
MAX_DEPTH = 12
_LONGEST_KEY = 100


def read_yaml(text: str) -> YamlText:
    """Return the values of one YAML document. Raises `TextError` if the text is not one YAML document.

    Tabs that indent nothing count as spaces, as in the YAML specification.
    """
    if len(text.encode("utf-8", "surrogatepass")) > MAX_BYTES:
        raise TextError("SIT010", f"the spec is larger than {MAX_BYTES // 1024} KiB", "check that it is the right file")
    try:
        return _read(text)
    except TextError as error:
        spaced = _INDENT_AND_REST.sub(_replace_tabs, text)
        if error.rule != "SIT001" or spaced == text:
            raise
        return _read(spaced)  # libyaml refuses some tabs that the YAML specification allows


_INDENT_AND_REST = re.compile(r"^([ \t]*)(.*)$", re.MULTILINE)


def _replace_tabs(line: re.Match[str]) -> str:
    """Return a line with spaces in place of its tabs. Tabs that indent text are left, because YAML refuses them."""
    indent, rest = line.groups()
    indents = rest.strip() and not rest.startswith("#")
    return (indent if indents else indent.replace("\t", " ")) + rest.replace("\t", " ")


def _read(text: str) -> YamlText:
    result = YamlText()
    try:
        events = _limited_events(yaml.parse(text, PARSER))
        has_document = False
        for event in events:
            if isinstance(event, NodeEvent):
                has_document = True
                result.data = _read_node(event, events, "", result)
        if not has_document:
            raise TextError("SIT001", "the file is empty", "begin it with `sitscad: 1`")
    except (ReaderError, UnicodeEncodeError) as error:
        if isinstance(error, UnicodeEncodeError):
            before, character = text[: error.start], ord(text[error.start])
        else:
            before, character = text.encode()[: error.position].decode(), error.character
        place = before.count("\n") + 1, len(before) - before.rfind("\n")
        message = f"the character U+{character:04X} is not allowed"
        raise TextError("SIT001", message, "save the file as plain text", place) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
        problem = " ".join(str(part).strip() for part in (error.context, error.problem) if part)
        is_tab = mark is not None and text[mark.index : mark.index + 1] == "\t"
        hint = "indent with spaces, not with tabs" if is_tab else ""
        if "mapping values are not allowed" in problem:
            hint = "remove a surplus colon, or indent the line less"
        # The parser reports an unclosed bracket or quote only at a later token, lines below.
        opened, kind = error.context_mark, re.search("flow (?:mapping|sequence)|quoted scalar", error.context or "")
        if kind and opened is not None and mark is not None and opened.line < mark.line:
            place = opened.line + 1, opened.column + 1
            what = "quote" if "quoted" in kind[0] else "bracket"
            problem = f"the {what} that opens here is not closed by line {mark.line + 1}"
            hint = "close it on this line"
        raise TextError("SIT001", f"not YAML: {problem[:200]}", hint, place) from None
    return result


def _start(event: Event) -> Position:
    return event.start_mark.line + 1, event.start_mark.column + 1


def _end(event: Event) -> Position:
    return event.end_mark.line + 1, event.end_mark.column + 1


def _limited_events(events: Iterator[Event]) -> Iterator[Event]:
    """Yield the events. Raise `TextError` at an event that exceeds a limit of size or depth, or is not plain YAML."""
    documents = depth = count = 0
    for event in events:
        if isinstance(event, DocumentStartEvent):
            documents += 1
            if event.version is not None and tuple(event.version) != (1, 2):
                version = ".".join(map(str, event.version))
                hint = "remove the %YAML line; numbers like 012 mean 12 in YAML 1.2, but 10 in YAML 1.1"
                raise TextError("SIT013", f"YAML {version} is not supported, only YAML 1.2", hint, _start(event))
        depth += isinstance(event, (MappingStartEvent, SequenceStartEvent)) - isinstance(event, CollectionEndEvent)
        count += isinstance(event, NodeEvent)
        if documents > 1:
            raise TextError("SIT013", "a second YAML document begins here", "keep one spec in a file", _start(event))
        if depth > MAX_DEPTH:
            raise TextError("SIT010", f"nested deeper than {MAX_DEPTH} levels", "use fewer levels", _start(event))
        if count > MAX_VALUES:
            raise TextError("SIT010", f"more than {MAX_VALUES} values", "shorten the file", _start(event))
        if isinstance(event, NodeEvent):
            mark, tag = "alias *" if isinstance(event, AliasEvent) else "anchor &", getattr(event, "tag", None)
            if event.anchor is not None:
                raise _not_plain_error(f"the {mark}{_printable_text(event.anchor)}", "write the value out", event)
            if tag is not None:
                raise _not_plain_error(f"the tag {_printable_text(tag)}", "leave the tag out", event)
        yield event


def _not_plain_error(what: str, hint: str, event: Event) -> TextError:
    return TextError("SIT013", f"{what} is not supported", hint, _start(event))


def _read_node(event: Event, events: Iterator[Event], key: str, result: YamlText) -> Any:
    if isinstance(event, ScalarEvent):
        result.values[key] = _start(event)
        if event.style not in ("|", ">") and event.start_mark.index < event.end_mark.index:
            result.ends[key] = _end(event)
        is_plain = event.implicit[0] and event.style in (None, "")
        return plain_value(event.value.replace("\t", " ")) if is_plain else event.value
    if getattr(event, "flow_style", False):
        result.values[key] = _start(event)
    if isinstance(event, SequenceStartEvent):
        return _read_list(events, key, result, bool(event.flow_style))
    return _read_mapping(events, key, result, bool(getattr(event, "flow_style", False)))


def _read_list(events: Iterator[Event], key: str, result: YamlText, in_brackets: bool) -> list[Any]:
    entries: list[Any] = []
    for event in events:
        if isinstance(event, CollectionEndEvent):
            if in_brackets:
                result.ends[key] = _end(event)
            break
        entry_key = dotted(key, len(entries))
        line, column = _start(event)
        if not in_brackets and isinstance(event, ScalarEvent) and event.start_mark.index == event.end_mark.index:
            column -= 1  # the parser places an empty entry behind its dash
        result.keys[entry_key] = line, column
        entries.append(_read_node(event, events, entry_key, result))
    return entries


def _read_mapping(events: Iterator[Event], key: str, result: YamlText, in_brackets: bool) -> dict[str, Any]:
    """Read the entries of a mapping. If a key is repeated, the first entry counts and a flaw is added."""
    mapping: dict[str, Any] = {}
    for event in events:
        if isinstance(event, CollectionEndEvent):
            if in_brackets:
                result.ends[key] = _end(event)
            break
        name = _key_name(event, key.startswith(CHOICES))
        entry_key = dotted(key, name)
        place = _start(event)
        if name in mapping:
            first = result.keys[entry_key]
            result.flaws.append(
                TextError("SIT012", f"{name} is given twice, first in line {first[0]}", "keep one", place, entry_key)
            )
            again = YamlText()  # discarded, so that positions of the first entry stay
            _read_node(next(events), events, entry_key, again)
            result.flaws += again.flaws
            continue
        result.keys[entry_key] = place
        mapping[name] = _read_node(next(events), events, entry_key, result)
    return mapping


CHOICES = "with."
"""Beginning of the dotted keys in section ``with`` of a study. Specs do not have this section.

The key names in this section are values of the keys that the study varies. They may therefore be numbers.
"""


def _key_name(event: Event, may_be_number: bool) -> str:
    """Return the key in an event. Raises `TextError` if it is not plain text."""
    if not isinstance(event, ScalarEvent):
        raise TextError("SIT013", "a list or a section cannot be a key", "write keys as plain words", _start(event))
    name = str(event.value)
    if not name.isprintable() or len(name) > _LONGEST_KEY:
        raise _not_plain_error(f"the key {_printable_text(name)!r}", "write keys as plain words", event)
    plain = event.implicit[0] and event.style in (None, "") and not may_be_number
    if plain and not isinstance(plain_value(name), str):
        what = name[:40] or "nothing"
        hint = "write keys as plain words"
        if what[0].isdigit():  # {trace_spacing: 0,1} is two entries, the second one with the key 1
            hint += "; for a decimal number, write a point and not a comma"
        raise TextError("SIT013", f"the key is {what}, which is not a text", hint, _start(event))
    return name


def _printable_text(word: object) -> str:
    text = str(word)[:40]
    return text if text.isprintable() else ascii(text)[1:-1]
