"""From a file to the frozen `SensorSpec`: the one way in.

Reads at most `MAX_BYTES`, constructs nothing from the text but plain values, and reports
everything that is wrong at once.
"""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from pydantic_core import SchemaValidator, ValidationError

from sitscad.finding import Finding
from sitscad.spec.diagnosis import finding_from_flaw, finding_from_text, findings_from_pydantic
from sitscad.spec.document import SpecDocument
from sitscad.spec.resolve import resolve
from sitscad.spec.rules import SpecError
from sitscad.spec.section import validator_of
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.source import SpecSource
from sitscad.spec.yaml_text import MAX_BYTES, TextError, YamlText, read_yaml

__all__ = ["SpecError", "load", "load_text"]


def load(path: str | os.PathLike[str]) -> SensorSpec:
    """The sensor that a YAML file describes; raises `SpecError` with every finding where it describes none."""
    try:
        text = _decoded(_read_bytes(Path(path)))
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    return load_text(text, path)


def load_text(text: str, path: str | os.PathLike[str] = "<text>") -> SensorSpec:
    """The sensor that a YAML text describes; `path` is what findings and reports call the text."""
    text = text.removeprefix("\ufeff")
    try:
        found = read_yaml(text)
        source = SpecSource(os.fspath(path), text, found.keys, found.values)
        document = _document(found, source)
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    spec, remarks = resolve(document, source)
    if spec is None:
        raise SpecError(_in_order([finding_from_flaw(flaw, source) for flaw in remarks.flaws]))
    return _with_defaults(spec, remarks.defaults)


def _read_bytes(path: Path) -> bytes:
    try:
        if path.exists() and not path.is_file():
            raise TextError("SIT011", f"{path} is not a file", "name the YAML file itself")
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise TextError("SIT011", f"cannot read {path}: {reason}", "is the path right?") from None
    if len(content) > MAX_BYTES:
        raise TextError("SIT010", f"{path} is larger than {MAX_BYTES // 1024} KiB", "is this the right file?")
    return content


def _decoded(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        before = content[: error.start]
        line = before.count(b"\n") + 1
        column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8", "replace")) + 1
        message = f"not UTF-8 text: byte 0x{content[error.start]:02X}"
        raise TextError("SIT011", message, "save the file as UTF-8", (line, column)) from None


@cache
def _validator() -> SchemaValidator:
    return validator_of(SpecDocument)


def _document(found: YamlText, source: SpecSource) -> SpecDocument:
    """The validated document; raises `SpecError` with what is wrong with its keys and values."""
    if not isinstance(found.data, dict):
        raise TextError("SIT001", "the spec is not a mapping of keys to values", "a spec begins with `sitscad: 1`")
    findings = [finding_from_text(flaw) for flaw in found.flaws]
    data, empty = _without_nulls(found.data, "")
    findings += [_empty(key, source) for key in empty]
    try:
        document = _validator().validate_python(data)
    except ValidationError as error:
        findings += findings_from_pydantic(error, source, frozenset(empty))
        findings = [finding for finding in findings if finding.rule == "SIT008"] or findings
    if findings:
        raise SpecError(_in_order(findings))
    return document


def _without_nulls(data: Any, key: str) -> tuple[Any, list[str]]:
    """The values without the keys that hold nothing, and the dotted keys of those."""
    empty: list[str] = []
    if not isinstance(data, (dict, list)):
        return data, empty
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    kept: list[tuple[Any, Any]] = []
    for name, value in entries:
        inner_key = f"{key}.{name}" if key else str(name)
        if value is None:
            empty.append(inner_key)
            continue
        inner, inner_empty = _without_nulls(value, inner_key)
        empty += inner_empty
        kept.append((name, inner))
    return (dict(kept) if isinstance(data, dict) else [value for _, value in kept]), empty


def _empty(key: str, source: SpecSource) -> Finding:
    place = source.keys.get(key, (1, 1))
    return finding_from_text(
        TextError("SIT004", f"{key}: has no value", "give it one, or leave the key out", place, key)
    )


def _in_order(findings: list[Finding]) -> tuple[Finding, ...]:
    return tuple(sorted(findings, key=lambda finding: (finding.line or 0, finding.column or 0, finding.rule)))


def _with_defaults(spec: SensorSpec, defaults: list[str]) -> SensorSpec:
    return replace(spec, source=replace(spec.source, defaults=tuple(defaults)))
