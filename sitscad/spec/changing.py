"""Specs made and changed by programs: as a file is, through the text, so that each value is read and refused alike.

`SensorSpec.from_mapping` and `SensorSpec.replace` are these. A change is an edit of the text that the spec was read
from, made with what writes a finding's fixes into a file (`sitscad.spec.format.rewriting`): comments stay.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from pathlib import PurePath
from typing import Any

from sitscad.finding import Edit
from sitscad.spec.format.diagnosis import finding_from_text
from sitscad.spec.format.documents.spec import VERSION
from sitscad.spec.format.rewriting import CannotWriteError, rewritten
from sitscad.spec.format.writing import flow, plain, yaml_text
from sitscad.spec.format.yaml.reader import read_yaml
from sitscad.spec.format.yaml.text import TextError
from sitscad.spec.load import load_text
from sitscad.spec.rules import SpecError
from sitscad.spec.sensor import SensorSpec

LONGEST_KEY = 200
"""Characters of a dotted key."""


def from_mapping(sections: Mapping[str, Any], named: Mapping[str, Any]) -> SensorSpec:
    """The sensor that sections say in dictionaries, with keys and values as in YAML, and others by their names; see
    `SensorSpec.from_mapping`.
    """
    try:
        if not isinstance(sections, Mapping):
            raise TextError("SIT004", "a spec is a mapping of sections, like {'name': ..., 'coil': {...}}")
        data = plain({**sections, **named})
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    return load_text(yaml_text({"sitscad": VERSION, **data}))


def replaced(spec: SensorSpec, changes: Iterable[tuple[Any, Any]]) -> SensorSpec:
    """A spec with other values at dotted keys, of which anybody may have written anything; see `SensorSpec.replace`."""
    try:
        _is_as_written(spec)
        text = spec.source.text
        for key, value in changes:
            text = _changed(text, _checked(key), plain(value, key))
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    found = load_text(text, spec.source.path)
    own = PurePath(spec.source.path).name
    files = {own: text.encode("utf-8"), **found.source.files} if own in spec.source.files else found.source.files
    return found.known(replace(found.source, files=files))


def _is_as_written(spec: SensorSpec) -> None:
    """Refuse a spec whose values were changed past its text: a change of the text would undo them."""
    if not spec.source.text:
        raise TextError("SIT011", "this spec was not read from a text", "make it by SensorSpec.from_mapping")
    if spec.is_known:
        return
    written = load_text(spec.source.text, spec.source.path)
    other = [one.name for one in fields(spec) if getattr(spec, one.name) != getattr(written, one.name)]
    if other:
        message = f"{', '.join(other)} of this spec was changed past its text, and would be as written again"
        raise TextError("SIT009", message, 'change it by key: spec.replace("coil.turns", 7.5)', key=other[0])


def _checked(key: Any) -> str:
    if not isinstance(key, str) or not 0 < len(key) <= LONGEST_KEY or not key.isprintable():
        raise TextError("SIT002", "a key is a text like coil.turns")
    return key


def _changed(text: str, key: str, value: Any) -> str:
    """The text with another value at a key: the place alone where it can, else written anew."""
    if value is not None:
        try:
            return rewritten(text, (Edit(key, flow(value)),))
        except CannotWriteError:
            pass  # a section in lines, or what the text has no place for: it is written anew
    data = read_yaml(text).data
    _put(data, key, value)
    return yaml_text(data)


def _put(data: Any, key: str, value: Any) -> None:
    """A value in the place of another, or taken out where it is None; sections that are not there are made."""
    *parents, last = key.split(".")
    for deep, name in enumerate(parents, 1):
        inner = _entry(data, name, ".".join(parents[:deep]))
        if inner is None:
            inner = data[name] = {}
        data = inner
    _entry(data, last, key)
    if isinstance(data, list):
        data[int(last)] = value
    elif value is None:
        data.pop(last, None)
    else:
        data[last] = value


def _entry(data: Any, name: str, key: str) -> Any:
    """What stands in a section or list under a name; None where a section has it not."""
    if isinstance(data, dict):
        return data.get(name)
    if isinstance(data, list):
        if name.isascii() and name.isdecimal() and int(name) < len(data):
            return data[int(name)]
        raise TextError("SIT002", f"{key}: the list has {len(data)} entries, counted from 0", key=key)
    parent = key.rpartition(".")[0]
    hint = f"write {parent} out, or choose another value of it"
    raise TextError("SIT002", f"{key}: {parent} has no keys in it, it is one value", hint, key=key)
