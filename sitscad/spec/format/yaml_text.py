"""The text of a spec to plain values, with the line and column of every key and value.

Reads YAML events, not objects: nothing in the text can construct anything, aliases are refused instead of unfolded, and
depth and size are bounded before any work is done.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    DocumentStartEvent,
    Event,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceStartEvent,
)
from ruamel.yaml.reader import ReaderError

MAX_BYTES = 256 * 1024
MAX_VALUES = 4000
MAX_DEPTH = 12
_LONGEST_NUMBER = 64
_LONGEST_KEY = 100

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

    ``keys`` holds where each key or list entry begins, ``values`` where each single value (or bracketed one) begins;
    ``flaws`` are complaints that do not keep the rest from being read.
    """

    data: Any = None
    keys: dict[str, Position] = field(default_factory=dict)
    values: dict[str, Position] = field(default_factory=dict)
    flaws: list[TextError] = field(default_factory=list)


def read_yaml(text: str) -> YamlText:
    """The values of one YAML document; raises `TextError` where there is no such document."""
    if len(text.encode("utf-8", "surrogatepass")) > MAX_BYTES:
        raise TextError("SIT010", f"the spec is larger than {MAX_BYTES // 1024} KiB", "is this the right file?")
    found = YamlText()
    try:
        _read_document(_bounded(YAML(typ="safe", pure=True).parse(text)), found)
    except ReaderError as error:
        raise _reader_error(error, text) from None
    except MarkedYAMLError as error:
        raise _syntax_error(error) from None
    except TextError:
        raise
    except Exception as error:  # the scanner lets OverflowError and others through on hostile escapes
        raise TextError("SIT001", f"not YAML: {_first_line(error)}") from None
    return found


def _place(event: Event) -> Position:
    return event.start_mark.line + 1, event.start_mark.column + 1


def _bounded(events: Iterator[Event]) -> Iterator[Event]:
    """The same events, as long as they stay within the size and the plainness of a spec."""
    documents = depth = count = 0
    for event in events:
        documents += isinstance(event, DocumentStartEvent)
        depth += isinstance(event, (MappingStartEvent, SequenceStartEvent)) - isinstance(event, CollectionEndEvent)
        count += isinstance(event, NodeEvent)
        if documents > 1:
            raise TextError("SIT013", "a second YAML document begins here", "keep one spec in a file", _place(event))
        if depth > MAX_DEPTH:
            raise TextError("SIT010", f"nested deeper than {MAX_DEPTH} levels", "a spec needs five", _place(event))
        if count > MAX_VALUES:
            raise TextError("SIT010", f"more than {MAX_VALUES} values", "is this the right file?", _place(event))
        _refuse_indirection(event)
        yield event


def _refuse_indirection(event: Event) -> None:
    if not isinstance(event, NodeEvent):
        return
    tag = getattr(event, "tag", None)
    if isinstance(event, AliasEvent):
        raise _not_plain(f"the alias *{_printable(event.anchor)}", "write the value out", event)
    if event.anchor is not None:
        raise _not_plain(f"the anchor &{_printable(event.anchor)}", "write the value out", event)
    if tag is not None:
        raise _not_plain(f"the tag {_printable(tag)}", "leave the tag out", event)


def _not_plain(what: str, hint: str, event: Event) -> TextError:
    return TextError("SIT013", f"{what} is not supported", hint, _place(event))


def _read_document(events: Iterator[Event], found: YamlText) -> None:
    has_document = False
    for event in events:
        if isinstance(event, NodeEvent):
            has_document = True
            found.data = _read_node(event, events, "", found)
    if not has_document:
        raise TextError("SIT001", "the file is empty", "a spec begins with `sitscad: 1`")


def _read_node(event: Event, events: Iterator[Event], key: str, found: YamlText) -> Any:
    if isinstance(event, ScalarEvent):
        found.values[key] = _place(event)
        return _plain_value(event.value) if event.implicit[0] and event.style in (None, "") else event.value
    if getattr(event, "flow_style", False):
        found.values[key] = _place(event)
    if isinstance(event, SequenceStartEvent):
        return _read_list(events, key, found, bool(event.flow_style))
    return _read_mapping(events, key, found)


def _read_list(events: Iterator[Event], key: str, found: YamlText, in_brackets: bool) -> list[Any]:
    entries: list[Any] = []
    for event in events:
        if isinstance(event, CollectionEndEvent):
            break
        entry_key = dotted(key, len(entries))
        line, column = _place(event)
        if not in_brackets and isinstance(event, ScalarEvent) and event.start_mark.index == event.end_mark.index:
            column -= 1  # of an entry that holds nothing the reader tells the place behind its dash
        found.keys[entry_key] = line, column
        entries.append(_read_node(event, events, entry_key, found))
    return entries


def _read_mapping(events: Iterator[Event], key: str, found: YamlText) -> dict[str, Any]:
    mapping: dict[str, Any] = {}
    for event in events:
        if isinstance(event, CollectionEndEvent):
            break
        name = _key_name(event)
        entry_key = dotted(key, name)
        place = _place(event)
        if name in mapping:
            first = found.keys[entry_key]
            found.flaws.append(
                TextError("SIT012", f"{name} is given twice, first in line {first[0]}", "keep one", place, entry_key)
            )
            again = YamlText()  # its places are not those of the first
            _read_node(next(events), events, entry_key, again)
            found.flaws += again.flaws
            continue
        found.keys[entry_key] = place
        mapping[name] = _read_node(next(events), events, entry_key, found)
    return mapping


def _key_name(event: Event) -> str:
    if not isinstance(event, ScalarEvent):
        raise TextError("SIT013", "a list or a section cannot be a key", "keys are plain words", _place(event))
    name = str(event.value)
    if not name.isprintable() or len(name) > _LONGEST_KEY:
        raise _not_plain(f"the key {_printable(name)!r}", "keys are plain words", event)
    plain = event.implicit[0] and event.style in (None, "")
    if plain and not isinstance(_plain_value(name), str):
        what = name[:40] or "nothing"
        raise TextError("SIT013", f"the key is {what}, which is not a text", "keys are plain words", _place(event))
    return name


def _plain_value(text: str) -> Any:
    """A plain scalar after YAML 1.2's core schema; absurdly long numbers become infinite instead of costing time."""
    if text in _WORDS:
        return _WORDS[text]
    if _INT.fullmatch(text):
        return int(text) if len(text) <= _LONGEST_NUMBER else float("inf")
    if _OTHER_INT.fullmatch(text):
        return int(text, 0) if len(text) <= _LONGEST_NUMBER else float("inf")
    if _FLOAT.fullmatch(text):
        return float(text) if len(text) <= _LONGEST_NUMBER else float("inf")
    return text


def _reader_error(error: ReaderError, text: str) -> TextError:
    position = int(error.position or 0)
    before = text[:position]
    place = before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1
    code = error.character if isinstance(error.character, int) else ord(str(error.character)[:1] or "\0")
    return TextError("SIT001", f"the character U+{code:04X} is not allowed", "is this a text file?", place)


def _syntax_error(error: MarkedYAMLError) -> TextError:
    mark = error.problem_mark or error.context_mark
    place = (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
    problem = " ".join(str(part).strip() for part in (error.context, error.problem) if part)
    hint = "indent with spaces, not with tabs" if "\\t" in problem else ""
    if "mapping values are not allowed" in problem:
        hint = "is there a colon too many, or a line indented too far?"
    return TextError("SIT001", f"not YAML: {problem[:200] or _first_line(error)}", hint, place)


def _printable(word: object) -> str:
    text = str(word)[:40]
    return text if text.isprintable() else ascii(text)[1:-1]


def _first_line(error: BaseException) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:200]
