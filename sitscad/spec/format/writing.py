"""Plain values as the text of a spec: what a program says in dictionaries, as a person would write it in YAML."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

from sitscad.spec.format.kinds.refusal import described
from sitscad.spec.format.yaml.text import TextError, dotted, plain_value, undotted

MOST_VALUES = 20_000
"""Values of a spec, sections and lists among them; and of an array that one of them is."""

DEEPEST = 16
"""Sections and lists inside each other."""

_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._/+-]*(?<! )")
_MOST_BITS = 200


def plain(value: Any, key: str = "") -> Any:
    """A value in dictionaries with texts as keys, lists, texts, numbers, truth values and None, as YAML gives them;
    numbers and arrays of numpy and the like become numbers and lists of Python.

    Raises
    ------
    TextError
        where it holds anything else, too much of it, or itself; the key is named, `key` being that of the value.
    """
    return _plain(value, key, iter(range(MOST_VALUES)))


def _plain(value: Any, key: str, left: Iterator[int]) -> Any:
    """The value in YAML's own types; TextError for what no spec can hold."""
    if next(left, None) is None:
        raise TextError("SIT010", f"more than {MOST_VALUES} values", "is this a spec?", key=key)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, str):
        return _text(str(value), key)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value)
    if key.count(".") >= DEEPEST:
        raise TextError("SIT004", f"{undotted(key)}: sections and lists are nested too deep", key=key)
    if isinstance(value, Mapping):
        return {_name(name, key): _plain(inner, dotted(key, name), left) for name, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner, dotted(key, index), left) for index, inner in enumerate(value)]
    to_list, size = getattr(value, "tolist", None), getattr(value, "size", 0)
    if callable(to_list) and isinstance(size, int) and size <= MOST_VALUES and not isinstance(value, type):
        found = to_list()
        if isinstance(found, (bool, int, float, str, list)):
            return _plain(found, key, left)
    message = f"{undotted(key)}: an object of type {type(value).__name__} is nothing that a spec can hold"
    raise TextError("SIT004", message, "a number, a text with its unit, a list or a dictionary", key=key)


def _name(name: Any, key: str) -> str:
    if not isinstance(name, str):
        raise TextError("SIT004", f"{undotted(key)}: {described(name)} is no key", "keys are texts", key=key)
    return _text(str(name), key)


def _text(text: str, key: str) -> str:
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise TextError("SIT004", f"{undotted(key)}: the text holds half of a character", key=key)
    return text


def yaml_text(data: Mapping[str, Any]) -> str:
    """Plain values as the text of a spec: sections in lines, what stands in them in brackets."""
    return "".join(f"{line}\n" for name, value in data.items() for line in _lines(name, value))


def _lines(name: str, value: Any) -> Iterator[str]:
    if not isinstance(value, dict) or not value:
        yield f"{flow(name)}: {flow(value)}"
        return
    yield f"{flow(name)}:"
    yield from (f"  {flow(inner)}: {flow(entry)}" for inner, entry in value.items())


def flow(value: Any) -> str:
    """One plain value as it is written in a line of YAML."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{flow(name)}: {flow(inner)}' for name, inner in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(flow, value))}]"
    if isinstance(value, str):
        return value if _PLAIN.fullmatch(value) and plain_value(value) == value else _quoted(value)
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, float) and math.isnan(value):
        return ".nan"
    is_huge = math.isinf(value) if isinstance(value, float) else value.bit_length() > _MOST_BITS
    return f"{'-' if value < 0 else ''}.inf" if is_huge else repr(value)


def _quoted(text: str) -> str:
    return f'"{"".join(map(_escaped, text))}"'


def _escaped(letter: str) -> str:
    """A letter as it stands in double quotes."""
    if letter in '"\\':
        return f"\\{letter}"
    code = ord(letter)
    if letter.isprintable():
        return letter
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
