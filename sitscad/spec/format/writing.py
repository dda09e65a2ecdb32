"""Values of a spec as its text has them: the inverse of reading, for `SensorSpec.replace`.

A number is in the SI unit of its attribute and is written with a unit; a record is written as a preset's name or as a
section; a text stays as it is, and a length in it must have its unit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from sitscad.spec.format.kinds import (
    Choice,
    Either,
    Kind,
    Layers,
    NumberOrList,
    Pair,
    Preset,
    ProfileName,
    Quantity,
    Several,
    Sourced,
    Special,
    described,
    names,
)
from sitscad.spec.format.section import ListOf, NameOr, Part, Section
from sitscad.spec.yaml.source import TextError, dotted, undotted
from sitscad.units import SI_UNITS, exact_text

BARE_NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*")
ALTERNATIVE_UNITS = {"length": ("mm", 1e-3), "angle": ("deg", 0.017453292519943295)}
"""The unit that a number which is out of range may have been meant in, and its factor to SI, by dimension."""


def kind_at(section: type[Section], key: str) -> Kind | None:
    """Return the kind of the value at a dotted key of a section. None if there is no such key."""
    kind: Kind | None = Part(section)
    for name in key.split("."):
        kind = _inner(kind, name)
    return kind


def _inner(kind: Kind | None, name: str) -> Kind | None:
    """Return the kind of an entry of a value: a key of a section, or an index of a list."""
    if isinstance(kind, Either):
        return _inner(kind.other, name)
    if isinstance(kind, NameOr):
        return _inner(kind.written, name)
    if isinstance(kind, Sourced) and name in ("value", "source", "status"):
        return kind.figure if name == "value" else None
    if isinstance(kind, Sourced):
        return _inner(kind.figure, name)
    if isinstance(kind, Part):
        found = kind.section.keys.get(name)
        alike = (like.kind for like in kind.section.alike.values() if like.pattern.fullmatch(name))
        return found.kind if found is not None else next(alike, None)
    return _entry(kind) if name.isdecimal() else None


def _entry(kind: Kind | None) -> Kind | None:
    """Return the kind of the entries of a list. None if the value is no list, or a list of plain numbers."""
    if isinstance(kind, Pair):
        return kind.length
    if isinstance(kind, ListOf):
        return kind.entry
    if isinstance(kind, Several):
        return kind.one
    return kind.entry if isinstance(kind, Special) else None


def as_written(value: Any, kind: Kind | None, key: str) -> Any:
    """Return a value as the text of a spec has it; `value` is as attributes of a `SensorSpec` are, in SI units.

    Raises
    ------
    TextError
        if a length as a text has no unit, or if a number is out of range and would not be in another unit.
    """
    if isinstance(kind, Either):
        return kind.word if value is None or value == kind.word else as_written(value, kind.other, key)
    if isinstance(kind, Sourced):
        is_section = isinstance(value, Mapping) and "value" in value
        inner = as_written(value["value"] if is_section else getattr(value, "value", value), kind.figure, key)
        return {**value, "value": inner} if is_section else inner
    if isinstance(kind, NameOr):
        if isinstance(kind.preset, Quantity) and isinstance(value, (int, float, str)):
            return as_written(value, kind.preset, key)
        name, presets = getattr(value, "name", None), "rules" if isinstance(kind.preset, ProfileName) else ""
        presets = kind.preset.kind if isinstance(kind.preset, Preset) else presets
        return name if presets and name in names(presets) else as_written(value, kind.written, key)
    if isinstance(kind, Preset):
        return getattr(value, "name", value)
    if isinstance(kind, Part):
        return _section(value, kind.section, key)
    if isinstance(kind, Quantity):
        return _quantity(value, kind, key)
    if isinstance(value, (list, tuple)) and isinstance(kind, (Pair, ListOf, Several, Special, Layers, NumberOrList)):
        return [as_written(one, _entry(kind), dotted(key, index)) for index, one in enumerate(value)]
    if isinstance(kind, (Pair, Several)):
        return as_written(value, _entry(kind), key)
    is_flag = isinstance(value, bool) and isinstance(kind, Choice) and len(kind.allowed) == 2
    return kind.allowed[value] if is_flag and isinstance(kind, Choice) else value


def _section(value: Any, section: type[Section], key: str) -> Any:
    """Return a section as a mapping of its keys; `value` is a mapping, pairs, or the section's record."""
    if isinstance(value, section):
        inside = {name: getattr(value, attribute) for name, attribute in section.attributes.items()}
        words = {name: one.kind.word for name, one in section.keys.items() if isinstance(one.kind, Either)}
        value = {name: words[name] if one is None else one
                 for name, one in inside.items() if one is not None or name in words}
    elif isinstance(value, tuple) and all(isinstance(one, tuple) and len(one) == 2 for one in value):
        value = dict(value)
    if not isinstance(value, Mapping):
        return value
    return {name: one if one is None else as_written(one, _inner(Part(section), str(name)), dotted(key, name))
            for name, one in value.items()}


def _quantity(value: Any, kind: Quantity, key: str) -> Any:
    """Return a quantity as a text with its unit; `value` is a number in SI units, or a text already."""
    dimension = kind.dimension
    if isinstance(value, str) and dimension == "length" and BARE_NUMBER.fullmatch(value):
        message = f"{undotted(key)}: {described(value)} has no unit, and a length in a text needs one"
        raise TextError("SIT005", message, f"did you mean '{value.strip()} mm'? A number without quotes is in metres",
                        key=key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e30:
        return value
    low, high = kind.range
    unit, factor = ALTERNATIVE_UNITS.get(dimension, ("", 1.0))
    if unit and not low <= value <= high and low <= value * factor <= high:
        message = f"{undotted(key)}: {value:g} {SI_UNITS[dimension]} is out of range: {kind.low} to {kind.high}"
        hint = f"did you mean '{value:g} {unit}'? Numbers are in SI units, as attributes are; a text has its unit"
        raise TextError("SIT006", message, hint, key=key)
    return exact_text(float(value), dimension)

