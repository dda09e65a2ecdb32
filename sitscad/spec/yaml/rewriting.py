"""Edits of a spec's text: a value is written in the place of another, and nothing else in the text changes.

Comments, order, quotes, line ends and the unit that a quantity is written in stay as they are. What was written is read
back, and refused unless exactly the value that was to change has changed.
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
from sitscad.spec.yaml.source import Position, TextError, YamlText, dotted, read_yaml, undotted

BOM = "\ufeff"

USUAL_INDENT = 2
"""Spaces by which a section's keys are indented where the text does not show what is usual in it."""

_LINE_END = re.compile(r"\r\n|\r|\n")
_QUOTES = ("'", '"')
_QUANTITY = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)( *)([^\d\s]?[^\d]*)")


class CannotWriteError(ValueError):
    """An edit that a text has no place for."""


def rewritten(text: str, edits: Iterable[Edit]) -> str:
    """The text of a spec with edits made in it, one after the other; its line ends and byte order mark are kept.

    Raises
    ------
    CannotWriteError
        where the text is no YAML, or an edit finds no place in it (a key below a preset's name).
    """
    for edit in edits:
        text = _edited(_SpecText.read(text), edit)
    return text


def completed(text: str, edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """Edits of a text with what stands there now (``old``), and what will (``new``), as it is written there; those that
    change nothing are left out. Raises as `rewritten`.
    """
    edits = tuple(edits)
    before, after = _SpecText.read(text), _SpecText.read(rewritten(text, edits))
    found = []
    for edit in edits:
        if edit.what == "name":
            found.append(Edit(edit.key, edit.new, undotted(edit.key.rpartition(".")[2]), edit.what))
            continue
        old, new = before.written(edit.key), after.written(edit.key)
        if old != new:
            found.append(Edit(edit.key, edit.new if new is None else new, old))
    return tuple(found)


@record(eq=False)
class _SpecText:
    """A text as it is, with its lines ended by line feeds, and what was read in that."""

    raw: str
    plain: str
    found: YamlText

    @classmethod
    def read(cls, raw: str) -> _SpecText:
        """Read a text; raises `CannotWriteError` where it is no mapping in YAML."""
        plain = _LINE_END.sub("\n", raw.removeprefix(BOM))
        try:
            found = read_yaml(plain)
        except TextError as error:
            raise CannotWriteError(error.message) from None
        if not isinstance(found.data, dict):
            raise CannotWriteError("the text is no mapping")
        return cls(raw, plain, found)

    def replaced(self, start: int, end: int, new: str) -> str:
        """The raw text with something else between two places of the plain one."""
        first = _LINE_END.search(self.raw)
        line_end = first[0] if first else "\n"
        start, end = self._raw_place(start), self._raw_place(end)
        return self.raw[:start] + new.replace("\n", line_end) + self.raw[end:]

    def _raw_place(self, place: int) -> int:
        marks = len(self.raw) - len(self.raw.removeprefix(BOM))
        before = self.plain.count("\n", 0, place)
        longer = sum(len(match[0]) - 1 for _, match in zip(range(before), _LINE_END.finditer(self.raw), strict=False))
        return place + marks + longer

    def place(self, position: Position) -> int:
        """How many characters of the plain text stand before a line and column."""
        line, column = position
        start = 0
        for _ in range(line - 1):
            start = self.plain.index("\n", start) + 1
        return start + column - 1

    def span(self, key: str) -> tuple[int, int] | None:
        """Where a value begins and ends; None for a section, and for what is no value in one piece."""
        if key not in self.found.values or key not in self.found.ends:
            return None
        return self.place(self.found.values[key]), self.place(self.found.ends[key])

    def value(self, key: str) -> Any:
        """What was read at a key; None where there is nothing."""
        value: Any = self.found.data
        for name in key.split(".") if key else ():
            if isinstance(value, list) and name.isdecimal() and int(name) < len(value):
                value = value[int(name)]
            elif isinstance(value, dict):
                value = value.get(undotted(name))
            else:
                return None
        return value

    def written(self, key: str) -> str | None:
        """How a value is written, a section or list in brackets; None where the key is not there."""
        span, value = self.span(key), self.value(key)
        if span is not None:
            return self.plain[slice(*span)]
        if isinstance(value, list):
            return f"[{', '.join(self.written(dotted(key, k)) or '' for k in range(len(value)))}]"
        if isinstance(value, dict):
            entries = (f"{name}: {self.written(dotted(key, name)) or ''}" for name in value)
            return f"{{{', '.join(entries)}}}"
        return None

    def below(self, key: str) -> list[str]:
        """The keys directly in a section or list, in the order of the text."""
        deep = key.count(".") + 1 if key else 0
        mine = (k for k in self.found.keys if (not key or k.startswith(f"{key}.")) and k.count(".") == deep)
        return sorted(mine, key=lambda k: self.found.keys[k])

    def last_place(self, key: str) -> int:
        """Where the last thing that stands in a section ends."""
        inside = [k for k in self.found.keys if not key or k.startswith(f"{key}.")]
        return max(self.place(self.found.ends.get(k, self.found.keys[k])) for k in inside)

    @property
    def indent(self) -> int:
        """The spaces by which the first section of the text is indented."""
        for top in self.below(""):
            inner = self.below(top)
            if inner and top not in self.found.ends and isinstance(self.value(top), dict):
                return self.found.keys[inner[0]][1] - self.found.keys[top][1]
        return USUAL_INDENT


def _edited(text: _SpecText, edit: Edit) -> str:
    """The text with one edit made; CannotWriteError where it would then say something else."""
    changed = text.raw
    if edit.what == "name":
        start = text.place(text.found.keys[edit.key]) if edit.key in text.found.keys else -1
        name = undotted(edit.key.rpartition(".")[2])
        if start < 0 or not text.plain.startswith(name, start):
            raise CannotWriteError(f"{name} is not written plainly")
        changed = text.replaced(start, start + len(name), edit.new)
    elif edit.key in text.found.keys:
        for key, new in reversed(list(_values(text, edit.key, edit.new))):
            changed = _SpecText.read(changed).replaced(*_required(text.span(key), key), new)
    else:
        changed = _added(text, edit.key, edit.new)
    if not _is_as_asked(text.found.data, _SpecText.read(changed).found.data, edit):
        raise CannotWriteError(f"{undotted(edit.key)} cannot be written into this text")
    return changed


def _required(span: tuple[int, int] | None, key: str) -> tuple[int, int]:
    if span is None:
        raise CannotWriteError(f"{undotted(key)} is not written in one piece")
    return span


def _values(text: _SpecText, key: str, new: str) -> Iterator[tuple[str, str]]:
    """The values to write, and where: of a list as long as the one that stands there only those that differ."""
    wanted = _SpecText.read(f"x: {new}")
    before, after = text.value(key), wanted.value("x")
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for k in range(len(before)):
            yield from _values(text, dotted(key, k), wanted.written(f"x.{k}") or "")
        return
    now = text.written(key) or ""
    styled = new if isinstance(after, (list, dict)) else _in_style(new, now)
    if styled != now:
        yield key, styled


def _in_style(new: str, now: str) -> str:
    """A value in the unit, the spacing and the quotes of the one that stands there now, where that is as exact."""
    quote = now[0] if now[:1] in _QUOTES and new[:1] not in _QUOTES else ""
    inner = now[1:-1] if quote else now
    here, there = _QUANTITY.fullmatch(inner), _QUANTITY.fullmatch(new)
    if here and there:
        new = _in_unit(new, there, here)
    return f"{quote}{new}{quote}" if quote and new != inner else new


def _in_unit(new: str, there: re.Match[str], here: re.Match[str]) -> str:
    """A quantity in the unit of another, written with its spacing."""
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
    return styled if len(digits) <= LONGEST_NUMBER and _is_same(styled if now else float(digits), new) else new


LONGEST_NUMBER = 16
"""Characters of a number that is written in another unit; what needs more stays in its own."""


def _added(text: _SpecText, key: str, new: str) -> str:
    """The text with a key that is not there yet, at the end of its section; sections that are not there with it."""
    parent, _, name = key.rpartition(".")
    sections: list[str] = []
    while parent and parent not in text.found.keys:
        parent, _, missing = parent.rpartition(".")
        sections.insert(0, missing)
    if not isinstance(text.value(parent), dict):
        raise CannotWriteError(f"{undotted(parent)} is no section")
    if parent in text.found.ends:  # written in brackets
        entry = f"{name}: {new}"
        for section in reversed(sections):
            entry = f"{section}: {{{entry}}}"
        inside = text.below(parent)
        if not inside:
            start = _required(text.span(parent), parent)[0] + 1
            return text.replaced(start, start, entry)
        end = text.last_place(parent)
        return text.replaced(end, end, f", {entry}")
    column = text.found.keys[text.below(parent)[0]][1] - 1
    lines = [f"{' ' * (column + text.indent * deep)}{section}:" for deep, section in enumerate(sections)]
    lines.append(f"{' ' * (column + text.indent * len(sections))}{name}: {new}")
    end = text.plain.find("\n", text.last_place(parent))
    end = len(text.plain) if end < 0 else end
    return text.replaced(end, end, "".join(f"\n{line}" for line in lines))


def _is_as_asked(before: Any, after: Any, edit: Edit) -> bool:
    """Whether two texts' values differ by an edit, and by nothing else."""
    one, other = copy.deepcopy(before), copy.deepcopy(after)
    *parents, last = (undotted(name) for name in edit.key.split("."))
    if edit.what == "name":
        section = _at(one, parents)
        entries = [(edit.new if name == last else name, value) for name, value in section.items()]
        section.clear()
        section.update(entries)
        return repr(one) == repr(other)
    new = _at(other, [*parents, last])
    for data in (one, other):
        _dropped(data, [*parents, last])
    for deep in range(len(parents), 0, -1):  # sections that came with it
        if _at(other, parents[:deep]) == {} and _at(one, parents[:deep]) is None:
            _dropped(other, parents[:deep])
    return repr(one) == repr(other) and _is_same(new, read_yaml(f"x: {edit.new}").data["x"])


def _at(data: Any, names: list[str]) -> Any:
    for name in names:
        inner = data.get(name) if isinstance(data, dict) else None
        data = data[int(name)] if isinstance(data, list) else inner
    return data


def _dropped(data: Any, names: list[str]) -> None:
    section = _at(data, names[:-1])
    if isinstance(section, dict):
        section.pop(names[-1], None)
    elif isinstance(section, list):
        section[int(names[-1])] = None


def _is_same(one: Any, other: Any) -> bool:
    """Whether two values mean the same: equal, or the same quantity in whatever unit."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(_is_same(*both) for both in zip(one, other, strict=True))
    for dimension in UNITS if one != other else ():
        with suppress(UnitError):
            if parse_quantity(one, dimension) == parse_quantity(other, dimension):
                return True
    return bool(one == other)
