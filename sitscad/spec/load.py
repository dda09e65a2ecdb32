"""Loader of specs: the only way from a file to the frozen `SensorSpec`. It reports all errors at once.

Sensors described by mappings, and changes of a spec, are written as text and then read.
"""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from pathlib import Path, PurePath
from typing import Any

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Edit
from sitscad.spec.format.kinds import describe, is_profile_file
from sitscad.spec.format.section import Section, as_written, kind_at
from sitscad.spec.reading import (
    ROOM_RULES,
    SpecError,
    decode_text,
    finding_from_flaw,
    finding_from_text,
    in_order,
    read_file,
    read_section,
    section_of_data,
)
from sitscad.spec.resolver.sensor import resolve
from sitscad.spec.sensor import VERSION, SensorSpec, SpecDocument
from sitscad.spec.yaml.rewriting import CannotWriteError, rewritten
from sitscad.spec.yaml.source import MAX_BYTES, SpecSource, TextError, dotted, key_text, plain_value, read_yaml

__all__ = ["SpecError", "load", "load_text"]

NO_FILE = "<text>"
"""Path that stands for a text without a file. Such a spec has no folder, so it cannot name other files."""


@checked_arguments
def load(path: str | os.PathLike[str], profiles: str | os.PathLike[str] | None = None) -> SensorSpec:
    """Return the sensor that a YAML file describes.

    Parameters
    ----------
    path
        The file. Profile files of a fabricator are searched in its folder.
    profiles
        A second folder in which profile files are searched.

    Returns
    -------
    SensorSpec
        The spec in SI units, with presets resolved and defaults filled in.

    Raises
    ------
    SpecError
        With all findings, if the file describes no valid sensor.
    """
    try:
        content = read_file(Path(path))
        text = decode_text(content)
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    spec = load_text(text, path, profiles)
    files = {Path(path).name: content, **spec.source.files}
    return spec.known(replace(spec.source, files=files))


def read_text(path: str) -> str:
    """Return the text of a spec file with its own line ends. If `path` is ``-``, read standard input.

    Raises `SpecError` if it cannot be read or is not text.
    """
    try:
        content = sys.stdin.buffer.read(MAX_BYTES + 1) if path == "-" else read_file(Path(path))
        decode_text(content)
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    return content.decode("utf-8")


@checked_arguments
def load_text(
    text: str, path: str | os.PathLike[str] = NO_FILE, profiles: str | os.PathLike[str] | None = None
) -> SensorSpec:
    """Return the sensor that a YAML text describes.

    Parameters
    ----------
    text
        The text of a spec.
    path
        Name of the text in findings and reports. Profile files of a fabricator are searched in its folder.
    profiles
        A second folder in which profile files are searched.

    Returns
    -------
    SensorSpec
        The spec in SI units, with presets resolved and defaults filled in.

    Raises
    ------
    SpecError
        With all findings, if the text describes no valid sensor.

    Examples
    --------
    >>> import sitscad
    >>> spec = sitscad.load_text('''
    ... sitscad: 1
    ... name: bench
    ... coil: {shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
    ... ''')
    >>> spec.coil.outer_diameter
    0.008
    """
    return _read(text, os.fspath(path), profiles)


def _read(
    text: str, path: str, profiles: str | os.PathLike[str] | None = None, folder: str | None = None
) -> SensorSpec:
    """Return the sensor of a text, as `load_text` does.

    The files that the text names are searched in `folder` if it is set, otherwise in the folder of `path`.
    """
    document, source = read_section(text.removeprefix("\ufeff"), path, SpecDocument, "sitscad: 1")
    return _resolve_document(document, replace(source, folder=folder), profiles)


def load_values(
    data: Mapping[str, Any], source: SpecSource, profiles: str | os.PathLike[str] | None = None
) -> SensorSpec:
    """Return the sensor that plain values describe, without the detour over a text.

    `source` is the text that the values were derived from. It gives the positions for findings, and waivers in its
    comments apply.
    """
    return _resolve_document(section_of_data(data, source, SpecDocument), source, profiles)


def _resolve_document(
    document: SpecDocument, source: SpecSource, profiles: str | os.PathLike[str] | None
) -> SensorSpec:
    rules = document.fpc.values()["rules"]
    folder = None if source.path == NO_FILE else Path(source.folder or Path(source.path).parent)
    if profiles is not None and is_profile_file(rules):
        with suppress(OSError, ValueError):
            is_beside = folder is not None and (folder / rules).exists()
            folder = Path(profiles) if not is_beside and (Path(profiles) / rules).is_file() else folder
    spec, remarks = resolve(document, source, folder)
    if remarks.flaws or remarks.findings:
        findings = [finding_from_flaw(flaw, source) for flaw in remarks.flaws]
        lacks_room = not remarks.findings and all(flaw.rule in ROOM_RULES for flaw in remarks.flaws)
        all_findings = (*in_order(findings), *remarks.findings)
        raise SpecError(all_findings, remarks.texts, spec if lacks_room else None, source)
    return spec.known(replace(spec.source, defaults=tuple(remarks.defaults), files=remarks.files))


MOST_VALUES = 20_000
"""Maximum number of values of a spec, including sections and lists, and of values in an array."""

DEEPEST = 16
"""Largest nesting depth of sections and lists."""

_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._/+-]*(?<! )")
_MOST_BITS = 200


def plain_data(value: Any, key: str = "", budget: Iterator[int] | None = None) -> Any:
    """Return a value as YAML would give it: dict with text keys, list, str, int, float, bool or None.

    Numbers and arrays of numpy and similar libraries become numbers and lists of Python. `key` is the value's dotted
    key.

    Raises
    ------
    TextError
        if there are other objects, too many values, or too deep nesting; the error names the key.
    """
    budget = iter(range(MOST_VALUES)) if budget is None else budget
    if next(budget, None) is None:
        raise TextError("SIT010", f"more than {MOST_VALUES} values", "check that it is a spec", key=key)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, str):
        return _text(str(value), key)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value)
    if key.count(".") >= DEEPEST:
        raise TextError("SIT004", f"{key_text(key)}: sections and lists are nested too deep", key=key)
    if isinstance(value, Mapping):
        return {_name(name, key): plain_data(inner, dotted(key, name), budget) for name, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_data(inner, dotted(key, index), budget) for index, inner in enumerate(value)]
    to_list, size = getattr(value, "tolist", None), getattr(value, "size", 0)
    if callable(to_list) and isinstance(size, int) and size <= MOST_VALUES and not isinstance(value, type):
        converted = to_list()
        if isinstance(converted, (bool, int, float, str, list)):
            return plain_data(converted, key, budget)
    message = f"{key_text(key)}: a spec cannot hold an object of type {type(value).__name__}"
    raise TextError("SIT004", message, "write a number, a text with its unit, a list or a dictionary", key=key)


def _name(name: Any, key: str) -> str:
    if not isinstance(name, str):
        raise TextError("SIT004", f"{key_text(key)}: {describe(name)} is no key", "write keys as texts", key=key)
    return _text(str(name), key)


def _text(text: str, key: str) -> str:
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise TextError("SIT004", f"{key_text(key)}: the text has an incomplete character", key=key)
    return text


def yaml_text(data: Mapping[str, Any]) -> str:
    """Return plain values as the text of a spec: one line for each key of a section, inner values in brackets."""
    lines = []
    for name, value in data.items():
        if isinstance(value, dict) and value:
            entries = (f"  {as_flow_yaml(inner)}: {as_flow_yaml(entry)}" for inner, entry in value.items())
            lines += [f"{as_flow_yaml(name)}:", *entries]
        else:
            lines.append(f"{as_flow_yaml(name)}: {as_flow_yaml(value)}")
    return "".join(f"{line}\n" for line in lines)


def as_flow_yaml(value: Any) -> str:
    """Return a plain value as YAML in one line, with sections in braces and lists in brackets (flow style)."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{as_flow_yaml(name)}: {as_flow_yaml(inner)}' for name, inner in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(as_flow_yaml, value))}]"
    if isinstance(value, str):
        is_plain = _PLAIN.fullmatch(value) and plain_value(value) == value
        return value if is_plain else f'"{"".join(map(_escaped, value))}"'
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, float) and math.isnan(value):
        return ".nan"
    is_huge = math.isinf(value) if isinstance(value, float) else value.bit_length() > _MOST_BITS
    return f"{'-' if value < 0 else ''}.inf" if is_huge else repr(value)


def _escaped(letter: str) -> str:
    if letter in '"\\':
        return f"\\{letter}"
    code = ord(letter)
    if letter.isprintable():
        return letter
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


LONGEST_KEY = 200
"""Maximum number of characters of a dotted key."""


def from_mapping(sections: Mapping[str, Any], named: Mapping[str, Any]) -> SensorSpec:
    """Return the sensor that mappings of keys to values describe; see `SensorSpec.from_mapping`."""
    try:
        if not isinstance(sections, Mapping):
            raise TextError("SIT004", "a spec is a mapping of sections, like {'name': ..., 'coil': {...}}")
        data = plain_data({**sections, **named})
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    return load_text(yaml_text({"sitscad": VERSION, **data}))


def replaced(spec: SensorSpec, changes: Iterable[tuple[Any, Any]]) -> SensorSpec:
    """Return a spec with other values at dotted keys; see `SensorSpec.replace`.

    `changes` are pairs (key, value). Values are in SI units and have the form of the spec's attributes.
    """
    pairs, written = tuple(changes), []
    records: dict[str, Any] = {}
    try:
        for key, value in pairs:
            _require_key(key)
            overlaps = any(isinstance(other, str) and other != key and is_overlapping(key, other) for other, _ in pairs)
            if key in spec.source.keys and not overlaps and _is_attribute(value, spec, key):
                continue  # the text stays as it is
            if is_dataclass(value) and not isinstance(value, type):
                records[key] = value
            written.append((key, written_value(key, value)))
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    changed = rewritten_spec(spec, written)
    for key, value in records.items():
        if not _is_attribute(value, changed, key):
            message = f"{key_text(key)}: {type(value).__name__} {getattr(value, 'name', '')} is more than its name"
            unwritten = TextError("SIT004", message, "write a preset's name, or a mapping of keys to values", key=key)
            raise SpecError((finding_from_text(unwritten),))
    return changed


def written_value(key: str, value: Any) -> Any:
    """Return the form that a value has in a YAML file. `value` is an attribute's value, in SI units.

    Raises `TextError` if the value is not allowed at `key`, or if it is the text of a length without a unit.
    """
    kind = kind_at(SpecDocument, key)
    if callable(getattr(value, "tolist", None)) and not isinstance(value, type):
        value = plain_data(value, key)  # numbers and arrays of numpy
    return None if value is None else plain_data(as_written(value, kind, key), key)


def rewritten_spec(spec: SensorSpec, changes: Iterable[tuple[Any, Any]]) -> SensorSpec:
    """Return a spec with other values at dotted keys: its text is changed and read again.

    `changes` are pairs (key, value). Values have the form that they have in a YAML file: lengths without a unit are in
    millimetres.
    """
    try:
        _require_as_written(spec)
        text = spec.source.text
        for key, value in changes:
            _require_key(key)
            text = _change_text(text, key, plain_data(value, key))
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    changed = _read(text, spec.source.path, folder=spec.source.folder)
    file_name = PurePath(spec.source.path).name
    text_file = {file_name: text.encode("utf-8")} if file_name in spec.source.files else {}
    return changed.known(replace(changed.source, files={**text_file, **changed.source.files}))


def _require_key(key: Any) -> None:
    if not isinstance(key, str) or not 0 < len(key) <= LONGEST_KEY or not key.isprintable():
        raise TextError("SIT002", "a key is a text like coil.turns")


def is_overlapping(key: str, other: str) -> bool:
    """Whether two dotted keys are equal, or one contains the other."""
    return f"{key}.".startswith(f"{other}.") or f"{other}.".startswith(f"{key}.")


def attribute(spec: SensorSpec, key: str) -> Any:
    """Return the value at a dotted key, from the attributes of a spec. Raises LookupError if there is none."""
    value: Any = spec
    for name in key.split("."):
        if name.isdecimal() and isinstance(value, tuple) and int(name) < len(value):
            value = value[int(name)]
            continue
        if isinstance(value, Section) and not hasattr(value, name):
            name = type(value).attributes.get(name, name)
        if not is_dataclass(value) or not hasattr(value, name):
            raise LookupError(key)
        value = getattr(value, name)
    return value


def _is_attribute(value: Any, spec: SensorSpec, key: str) -> bool:
    """Whether `value` equals the spec's value at a dotted key. False for None and for arrays."""
    try:
        current = attribute(spec, key)
    except LookupError:
        return False
    is_number = isinstance(value, float) and isinstance(current, float)
    return value is not None and (is_number or type(value) is type(current)) and bool(value == current)


def _require_as_written(spec: SensorSpec) -> None:
    """Raise `TextError` if a program has set values of the spec that its text does not have.

    A change of the text would then lose these values.
    """
    if not spec.source.text:
        raise TextError("SIT011", "this spec was not read from a text", "create it with SensorSpec.from_mapping")
    if spec.is_known:
        return
    written = load_text(spec.source.text, spec.source.path)
    other = [field.name for field in fields(spec) if getattr(spec, field.name) != getattr(written, field.name)]
    if other:
        message = f"{', '.join(other)} of this spec was changed without its text, and the change would be lost"
        raise TextError("SIT009", message, 'change it by key: spec.replace("coil.turns", 7.5)', key=other[0])


def _change_text(text: str, key: str, value: Any) -> str:
    """Return the text with another value at a key.

    Only this value is replaced if possible, else the whole text is rewritten.
    """
    if value is not None:
        try:
            return rewritten(text, (Edit(key, as_flow_yaml(value)),))
        except CannotWriteError:
            pass  # a section in lines, or a key without a place in the text: rewrite the text
    data = read_yaml(text).data
    put_value(data, key, value)
    return yaml_text(data)


def put_value(data: Any, key: str, value: Any) -> None:
    """Replace a plain value at a dotted key, or remove it if the new value is None. Missing sections are added.

    Raises `TextError` if `data` cannot have such a key.
    """
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
    """Return the entry of a section or list. None if a section lacks it.

    `name` is the entry's name or index, and `key` its dotted key for messages. Raises `TextError` if a list lacks it,
    or if `data` is a single value.
    """
    if isinstance(data, dict):
        return data.get(name)
    if isinstance(data, list):
        if name.isascii() and name.isdecimal() and int(name) < len(data):
            return data[int(name)]
        raise TextError("SIT002", f"{key}: the list has {len(data)} entries, counted from 0", key=key)
    parent = key.rpartition(".")[0]
    hint = f"write {parent} as a section, or choose another value"
    raise TextError("SIT002", f"{key}: {parent} is a single value without keys", hint, key=key)
