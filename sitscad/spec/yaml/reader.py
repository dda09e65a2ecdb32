"""One YAML text to plain values with their places.

Reads YAML events, not objects: nothing in the text can construct anything, aliases are refused instead of unfolded, and
depth and size are bounded before any work is done.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
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

from sitscad.spec.yaml.source import MAX_BYTES, Position, TextError, YamlText, dotted, plain_value

PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The parser of libyaml, or that in Python where PyYAML was built without libyaml."""

MAX_VALUES = 4000
MAX_DEPTH = 12
_LONGEST_KEY = 100


def read_yaml(text: str) -> YamlText:
    """Return the values of one YAML document. Raises `TextError` if the text is not one YAML document.

    Tabs that indent nothing count as spaces, as in the YAML specification.
    """
    if len(text.encode("utf-8", "surrogatepass")) > MAX_BYTES:
        raise TextError("SIT010", f"the spec is larger than {MAX_BYTES // 1024} KiB", "is this the right file?")
    try:
        return _read(text)
    except TextError as error:
        spaced = _INDENT_AND_REST.sub(_with_spaces, text)
        if error.rule != "SIT001" or spaced == text:
            raise
        return _read(spaced)  # libyaml refuses some of the tabs that the specification allows


_INDENT_AND_REST = re.compile(r"^([ \t]*)(.*)$", re.MULTILINE)


def _with_spaces(line: re.Match[str]) -> str:
    """Return a line with spaces in place of its tabs, but for those that indent something."""
    indent, rest = line.groups()
    indents = rest.strip() and not rest.startswith("#")
    return (indent if indents else indent.replace("\t", " ")) + rest.replace("\t", " ")


def _read(text: str) -> YamlText:
    found = YamlText()
    try:
        events = _bounded(yaml.parse(text, PARSER))
        has_document = False
        for event in events:
            if isinstance(event, NodeEvent):
                has_document = True
                found.data = _read_node(event, events, "", found)
        if not has_document:
            raise TextError("SIT001", "the file is empty", "a spec begins with `sitscad: 1`")
    except (ReaderError, UnicodeEncodeError) as error:
        if isinstance(error, UnicodeEncodeError):
            before, character = text[: error.start], ord(text[error.start])
        else:
            before, character = text.encode()[: error.position].decode(), error.character
        place = before.count("\n") + 1, len(before) - before.rfind("\n")
        message = f"the character U+{character:04X} is not allowed"
        raise TextError("SIT001", message, "is this a text file?", place) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
        problem = " ".join(str(part).strip() for part in (error.context, error.problem) if part)
        is_tab = mark is not None and text[mark.index : mark.index + 1] == "\t"
        hint = "indent with spaces, not with tabs" if is_tab else ""
        if "mapping values are not allowed" in problem:
            hint = "is there a colon too many, or a line indented too far?"
        # What opened and is never closed is met where something else begins, lines later
        opened, kind = error.context_mark, re.search("flow (?:mapping|sequence)|quoted scalar", error.context or "")
        if kind and opened is not None and mark is not None and opened.line < mark.line:
            place = opened.line + 1, opened.column + 1
            what = "quote" if "quoted" in kind[0] else "bracket"
            problem = f"the {what} that opens here is not closed by line {mark.line + 1}"
            hint = "close it on this line"
        raise TextError("SIT001", f"not YAML: {problem[:200]}", hint, place) from None
    return found


def _place(event: Event) -> Position:
    return event.start_mark.line + 1, event.start_mark.column + 1


def _end(event: Event) -> Position:
    return event.end_mark.line + 1, event.end_mark.column + 1


def _bounded(events: Iterator[Event]) -> Iterator[Event]:
    """The events, as long as they stay within the size and the plainness of a spec."""
    documents = depth = count = 0
    for event in events:
        if isinstance(event, DocumentStartEvent):
            documents += 1
            if event.version is not None and tuple(event.version) != (1, 2):
                said = ".".join(map(str, event.version))
                hint = "remove the %YAML line; numbers like 012 mean 12 in YAML 1.2, but 10 in YAML 1.1"
                raise TextError("SIT013", f"YAML {said} is not read here, only YAML 1.2", hint, _place(event))
        depth += isinstance(event, (MappingStartEvent, SequenceStartEvent)) - isinstance(event, CollectionEndEvent)
        count += isinstance(event, NodeEvent)
        if documents > 1:
            raise TextError("SIT013", "a second YAML document begins here", "keep one spec in a file", _place(event))
        if depth > MAX_DEPTH:
            raise TextError("SIT010", f"nested deeper than {MAX_DEPTH} levels", "a spec needs five", _place(event))
        if count > MAX_VALUES:
            raise TextError("SIT010", f"more than {MAX_VALUES} values", "is this the right file?", _place(event))
        if isinstance(event, NodeEvent):
            mark, tag = "alias *" if isinstance(event, AliasEvent) else "anchor &", getattr(event, "tag", None)
            if event.anchor is not None:
                raise _not_plain(f"the {mark}{_printable(event.anchor)}", "write the value out", event)
            if tag is not None:
                raise _not_plain(f"the tag {_printable(tag)}", "leave the tag out", event)
        yield event


def _not_plain(what: str, hint: str, event: Event) -> TextError:
    return TextError("SIT013", f"{what} is not supported", hint, _place(event))


def _read_node(event: Event, events: Iterator[Event], key: str, found: YamlText) -> Any:
    if isinstance(event, ScalarEvent):
        found.values[key] = _place(event)
        if event.style not in ("|", ">") and event.start_mark.index < event.end_mark.index:
            found.ends[key] = _end(event)
        is_plain = event.implicit[0] and event.style in (None, "")
        return plain_value(event.value.replace("\t", " ")) if is_plain else event.value
    if getattr(event, "flow_style", False):
        found.values[key] = _place(event)
    if isinstance(event, SequenceStartEvent):
        return _read_list(events, key, found, bool(event.flow_style))
    return _read_mapping(events, key, found, bool(getattr(event, "flow_style", False)))


def _read_list(events: Iterator[Event], key: str, found: YamlText, in_brackets: bool) -> list[Any]:
    entries: list[Any] = []
    for event in events:
        if isinstance(event, CollectionEndEvent):
            if in_brackets:
                found.ends[key] = _end(event)
            break
        entry_key = dotted(key, len(entries))
        line, column = _place(event)
        if not in_brackets and isinstance(event, ScalarEvent) and event.start_mark.index == event.end_mark.index:
            column -= 1  # of an entry that holds nothing the reader tells the place behind its dash
        found.keys[entry_key] = line, column
        entries.append(_read_node(event, events, entry_key, found))
    return entries


def _read_mapping(events: Iterator[Event], key: str, found: YamlText, in_brackets: bool) -> dict[str, Any]:
    """The section whose keys follow; of a key that is given twice the first counts."""
    mapping: dict[str, Any] = {}
    for event in events:
        if isinstance(event, CollectionEndEvent):
            if in_brackets:
                found.ends[key] = _end(event)
            break
        name = _key_name(event, key.startswith(CHOICES))
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


CHOICES = "with."
"""The section of a study whose keys are values that are chosen among, numbers as well; no spec has such a section."""


def _key_name(event: Event, may_be_number: bool) -> str:
    """The key that an event says; TextError for what is no plain word."""
    if not isinstance(event, ScalarEvent):
        raise TextError("SIT013", "a list or a section cannot be a key", "keys are plain words", _place(event))
    name = str(event.value)
    if not name.isprintable() or len(name) > _LONGEST_KEY:
        raise _not_plain(f"the key {_printable(name)!r}", "keys are plain words", event)
    plain = event.implicit[0] and event.style in (None, "") and not may_be_number
    if plain and not isinstance(plain_value(name), str):
        what = name[:40] or "nothing"
        hint = "keys are plain words"
        if what[0].isdigit():  # {trace_spacing: 0,1} is two entries, the second one with the key 1
            hint += "; if it is the end of a number: decimals take a point, a comma ends what stands before it"
        raise TextError("SIT013", f"the key is {what}, which is not a text", hint, _place(event))
    return name


def _printable(word: object) -> str:
    text = str(word)[:40]
    return text if text.isprintable() else ascii(text)[1:-1]
