"""Edits of a spec's text. An edit replaces the text of one value and leaves all other text unchanged.

Comments, order, quotes, line ends and the unit of a quantity are preserved. The edited text is read again. An edit is
an error unless exactly the intended value has changed.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from decimal import Decimal, localcontext
from typing import Any

from sitscad.basics.finding import Edit
from sitscad.basics.record import record
from sitscad.basics.units import UNITS, UnitError, parse_quantity
from sitscad.spec.yaml.source import Position, TextError, YamlText, dotted, key_text, read_yaml

BOM = "\ufeff"

USUAL_INDENT = 2
"""Number of spaces by which a section's keys are indented if the text has no indented section to copy from."""

_LINE_END = re.compile(r"\r\n|\r|\n")
_QUOTES = ("'", '"')
_QUANTITY = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)( *)([^\d\s]?[^\d]*)")


class CannotWriteError(ValueError):
    """An edit cannot be written into a text."""


def rewritten(text: str, edits: Iterable[Edit]) -> str:
    """Return the text of a spec after some edits, applied in order. Line ends and byte order mark are preserved.

    Raises
    ------
    CannotWriteError
        if the text is not a mapping in YAML. Also if an edit has no place in the text, such as below a preset's name.
    """
    for edit in edits:
        text = _apply_edit(_SpecText.read(text), edit)
    return text


def complete_edits(text: str, edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """Return the edits with the current text (``old``) and the new text (``new``) of each value filled in.

    Edits that change nothing are left out. Raises `CannotWriteError` as `rewritten` does.
    """
    edits = tuple(edits)
    before, after = _SpecText.read(text), _SpecText.read(rewritten(text, edits))
    changes = []
    for edit in edits:
        if edit.what == "name":
            changes.append(Edit(edit.key, edit.new, key_text(edit.key.rpartition(".")[2]), edit.what))
            continue
        old, new = before.value_text(edit.key), after.value_text(edit.key)
        if old != new:
            changes.append(Edit(edit.key, edit.new if new is None else new, old))
    return tuple(changes)


@record(eq=False)
class _SpecText:
    """The text of a spec as stored (``raw``), with line feeds as line ends (``plain``), and its values (``found``)."""

    raw: str
    plain: str
    found: YamlText

    @classmethod
    def read(cls, raw: str) -> _SpecText:
        """Read a text. Raises `CannotWriteError` if it is not a mapping in YAML."""
        plain = _LINE_END.sub("\n", raw.removeprefix(BOM))
        try:
            yaml_text = read_yaml(plain)
        except TextError as error:
            raise CannotWriteError(error.message) from None
        if not isinstance(yaml_text.data, dict):
            raise CannotWriteError("the text is no mapping")
        return cls(raw, plain, yaml_text)

    def replace_span(self, start: int, end: int, new: str) -> str:
        """Return the raw text with `new` in place of the characters from `start` to `end` (exclusive).

        The offsets count in the plain text, whose line ends are line feeds.
        """
        first = _LINE_END.search(self.raw)
        line_end = first[0] if first else "\n"
        start, end = self._raw_offset(start), self._raw_offset(end)
        return self.raw[:start] + new.replace("\n", line_end) + self.raw[end:]

    def _raw_offset(self, place: int) -> int:
        marks = len(self.raw) - len(self.raw.removeprefix(BOM))
        before = self.plain.count("\n", 0, place)
        longer = sum(len(match[0]) - 1 for _, match in zip(range(before), _LINE_END.finditer(self.raw), strict=False))
        return place + marks + longer

    def offset(self, position: Position) -> int:
        """Return the offset in the plain text of a position (line and column, from 1)."""
        line, column = position
        start = 0
        for _ in range(line - 1):
            start = self.plain.index("\n", start) + 1
        return start + column - 1

    def span(self, key: str) -> tuple[int, int] | None:
        """Return the offsets in the plain text at which the value of a dotted key begins and ends.

        None for empty values, and for sections and texts that extend over several lines.
        """
        if key not in self.found.values or key not in self.found.ends:
            return None
        return self.offset(self.found.values[key]), self.offset(self.found.ends[key])

    def value(self, key: str) -> Any:
        """Return the value at a dotted key. None if there is no value."""
        value: Any = self.found.data
        for name in key.split(".") if key else ():
            if isinstance(value, list) and name.isdecimal() and int(name) < len(value):
                value = value[int(name)]
            elif isinstance(value, dict):
                value = value.get(key_text(name))
            else:
                return None
        return value

    def value_text(self, key: str) -> str | None:
        """Return the text of a value. Sections and lists are returned in brackets. None if the key is missing."""
        span, value = self.span(key), self.value(key)
        if span is not None:
            return self.plain[slice(*span)]
        if isinstance(value, list):
            return f"[{', '.join(self.value_text(dotted(key, k)) or '' for k in range(len(value)))}]"
        if isinstance(value, dict):
            entries = (f"{name}: {self.value_text(dotted(key, name)) or ''}" for name in value)
            return f"{{{', '.join(entries)}}}"
        return None

    def keys_below(self, key: str) -> list[str]:
        """Return the keys directly inside a section or list, in the order of the text."""
        deep = key.count(".") + 1 if key else 0
        mine = (k for k in self.found.keys if (not key or k.startswith(f"{key}.")) and k.count(".") == deep)
        return sorted(mine, key=lambda k: self.found.keys[k])

    def end_offset(self, key: str) -> int:
        """Return the offset in the plain text at which the last entry of a section ends."""
        inside = [k for k in self.found.keys if not key or k.startswith(f"{key}.")]
        return max(self.offset(self.found.ends.get(k, self.found.keys[k])) for k in inside)

    @property
    def indent(self) -> int:
        """Number of spaces by which the first section of the text is indented."""
        for top in self.keys_below(""):
            inner = self.keys_below(top)
            if inner and top not in self.found.ends and isinstance(self.value(top), dict):
                return self.found.keys[inner[0]][1] - self.found.keys[top][1]
        return USUAL_INDENT


def _apply_edit(text: _SpecText, edit: Edit) -> str:
    """Return the text after one edit. Raises `CannotWriteError` if any other value would change."""
    changed = text.raw
    if edit.what == "name":
        start = text.offset(text.found.keys[edit.key]) if edit.key in text.found.keys else -1
        name = key_text(edit.key.rpartition(".")[2])
        if start < 0 or not text.plain.startswith(name, start):
            raise CannotWriteError(f"{name} is not written plainly")
        changed = text.replace_span(start, start + len(name), edit.new)
    elif edit.key in text.found.keys:
        for key, new in reversed(list(_changed_values(text, edit.key, edit.new))):
            changed = _SpecText.read(changed).replace_span(*_require_span(text.span(key), key), new)
    else:
        changed = _add_key(text, edit.key, edit.new)
    if not _has_only_intended_change(text.found.data, _SpecText.read(changed).found.data, edit):
        raise CannotWriteError(f"{key_text(edit.key)} cannot be written into this text")
    return changed


def _require_span(span: tuple[int, int] | None, key: str) -> tuple[int, int]:
    if span is None:
        raise CannotWriteError(f"{key_text(key)} is not written in one piece")
    return span


def _changed_values(text: _SpecText, key: str, new: str) -> Iterator[tuple[str, str]]:
    """Yield (key, new text) for each value that changes if the value at `key` becomes `new`.

    If a list keeps its length, only the entries that change are yielded, each with its own key.
    """
    new_text = _SpecText.read(f"x: {new}")
    before, after = text.value(key), new_text.value("x")
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for k in range(len(before)):
            yield from _changed_values(text, dotted(key, k), new_text.value_text(f"x.{k}") or "")
        return
    now = text.value_text(key) or ""
    styled = new if isinstance(after, (list, dict)) else _in_style(new, now)
    if styled != now:
        yield key, styled


def _in_style(new: str, now: str) -> str:
    """Return the value `new` with the unit, spacing and quotes of the current text `now`.

    If the conversion to this unit is not exact, `new` is returned in its own unit.
    """
    quote = now[0] if now[:1] in _QUOTES and new[:1] not in _QUOTES else ""
    inner = now[1:-1] if quote else now
    here, there = _QUANTITY.fullmatch(inner), _QUANTITY.fullmatch(new)
    if here and there:
        new = _in_unit(new, there, here)
    return f"{quote}{new}{quote}" if quote and new != inner else new


def _in_unit(new: str, there: re.Match[str], here: re.Match[str]) -> str:
    """Return the new quantity in the unit and spacing of the current quantity.

    `there` and `here` are the regular-expression matches of the new and the current quantity: number, space, unit.
    `new` is the text of the new quantity. It is returned unchanged if no exact conversion exists.
    """
    unit, now = there[3], here[3]
    dimension = next((d for d, units in UNITS.items() if {unit, now} - {""} and {unit, now} <= {*units, ""}), None)
    if dimension is None or dimension == "temperature" or ("" in (unit, now) and dimension != "length"):
        return new
    with localcontext() as exact:
        exact.prec = 40
        factors = UNITS[dimension]
        number = Decimal(there[1]) * factors[unit or "mm"] / factors[now or "mm"]
        digits = f"{number.normalize():f}"
    styled = f"{digits}{here[2]}{now}"
    return styled if len(digits) <= LONGEST_NUMBER and _is_equal_value(styled if now else float(digits), new) else new


LONGEST_NUMBER = 16
"""Maximum number of characters of a converted number. A quantity that needs more keeps its own unit."""


def _add_key(text: _SpecText, key: str, new: str) -> str:
    """Return the text after `key` and its value `new` are added at the end of the key's section.

    Missing sections are added as well.
    """
    parent, _, name = key.rpartition(".")
    sections: list[str] = []
    while parent and parent not in text.found.keys:
        parent, _, missing = parent.rpartition(".")
        sections.insert(0, missing)
    if not isinstance(text.value(parent), dict):
        raise CannotWriteError(f"{key_text(parent)} is no section")
    if parent in text.found.ends:  # written in brackets
        entry = f"{name}: {new}"
        for section in reversed(sections):
            entry = f"{section}: {{{entry}}}"
        inside = text.keys_below(parent)
        if not inside:
            start = _require_span(text.span(parent), parent)[0] + 1
            return text.replace_span(start, start, entry)
        end = text.end_offset(parent)
        return text.replace_span(end, end, f", {entry}")
    column = text.found.keys[text.keys_below(parent)[0]][1] - 1
    lines = [f"{' ' * (column + text.indent * deep)}{section}:" for deep, section in enumerate(sections)]
    lines.append(f"{' ' * (column + text.indent * len(sections))}{name}: {new}")
    end = text.plain.find("\n", text.end_offset(parent))
    end = len(text.plain) if end < 0 else end
    return text.replace_span(end, end, "".join(f"\n{line}" for line in lines))


def _has_only_intended_change(before: Any, after: Any, edit: Edit) -> bool:
    """Whether the edit made exactly the intended change. `before` and `after` are the values before and after it."""
    expected, actual = copy.deepcopy(before), copy.deepcopy(after)
    *parents, last = (key_text(name) for name in edit.key.split("."))
    if edit.what == "name":
        section = _value_at(expected, parents)
        entries = [(edit.new if name == last else name, value) for name, value in section.items()]
        section.clear()
        section.update(entries)
        return repr(expected) == repr(actual)
    new = _value_at(actual, [*parents, last])
    for data in (expected, actual):
        _drop_value(data, [*parents, last])
    for depth in range(len(parents), 0, -1):  # sections that were added with the key
        if _value_at(actual, parents[:depth]) == {} and _value_at(expected, parents[:depth]) is None:
            _drop_value(actual, parents[:depth])
    return repr(expected) == repr(actual) and _is_equal_value(new, read_yaml(f"x: {edit.new}").data["x"])


def _value_at(data: Any, names: list[str]) -> Any:
    for name in names:
        inner = data.get(name) if isinstance(data, dict) else None
        data = data[int(name)] if isinstance(data, list) else inner
    return data


def _drop_value(data: Any, names: list[str]) -> None:
    section = _value_at(data, names[:-1])
    if isinstance(section, dict):
        section.pop(names[-1], None)
    elif isinstance(section, list):
        section[int(names[-1])] = None


def _is_equal_value(value: Any, second: Any) -> bool:
    """Whether two values are equal, or are equal quantities in different units."""
    if isinstance(value, list) and isinstance(second, list):
        return len(value) == len(second) and all(_is_equal_value(*pair) for pair in zip(value, second, strict=True))
    for dimension in UNITS if value != second else ():
        with suppress(UnitError):
            if parse_quantity(value, dimension) == parse_quantity(second, dimension):
                return True
    return bool(value == second)
