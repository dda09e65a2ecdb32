"""One YAML file to a validated section: text, plain values, the declared keys, and every complaint with its place.

Reads at most `MAX_BYTES`, and constructs nothing from the text but plain values.
"""

from __future__ import annotations

from collections.abc import Hashable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from pydantic_core import SchemaValidator, ValidationError

from sitscad.finding import Finding
from sitscad.spec.format.diagnosis import finding_from_text, findings_from_pydantic
from sitscad.spec.format.section import Section, validator_of
from sitscad.spec.format.yaml.reader import read_yaml
from sitscad.spec.format.yaml.text import MAX_BYTES, TextError, dotted, undotted
from sitscad.spec.rules import SpecError
from sitscad.spec.source import SpecSource

Form = TypeVar("Form", bound=Section)


def read_file(path: Path, called: str | None = None) -> bytes:
    """The bytes of a file; raises `TextError` where it is none, cannot be read, or is too large. The message calls it
    by its path, or as it is `called`.
    """
    name = called or str(path)
    try:
        if path.exists() and not path.is_file():
            raise TextError("SIT011", f"{name} is not a file", "name the YAML file itself")
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise TextError("SIT011", f"cannot read {name}: {reason}", "is the path right?") from None
    if len(content) > MAX_BYTES:
        raise TextError("SIT010", f"{name} is larger than {MAX_BYTES // 1024} KiB", "is this the right file?")
    return content


def decoded(content: bytes) -> str:
    """The text of a file's bytes, lines ended by a line feed; raises `TextError` where it is not UTF-8."""
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        before = content[: error.start]
        line = before.count(b"\n") + 1
        column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8", "replace")) + 1
        message = f"not UTF-8 text: byte 0x{content[error.start]:02X}"
        raise TextError("SIT011", message, "save the file as UTF-8", (line, column)) from None


def read_section(text: str, path: str, form: type[Form], begins: str) -> tuple[Form, SpecSource]:
    """What a text says in the form of a section, and where each key of it stands; `begins` is how such a text begins.

    Raises
    ------
    SpecError
        with everything that is wrong with its keys and values.
    """
    try:
        found = read_yaml(text)
        if not isinstance(found.data, dict):
            raise TextError("SIT001", "the file is not a mapping of keys to values", f"it begins with `{begins}`")
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    source = SpecSource(path, text, found.keys, found.values)
    findings = [finding_from_text(flaw) for flaw in found.flaws]
    data, empty = _without_nulls(found.data, "")
    findings += [_empty(key, source) for key in empty]
    document: Any = None
    try:
        document = _validator(cast(Hashable, form)).validate_python(data)
    except ValidationError as error:
        findings += findings_from_pydantic(error, source, _reported(empty), form)
        findings = [finding for finding in findings if finding.rule == "SIT008"] or findings
    if findings:
        raise SpecError(in_order(findings), source=source)
    return cast(Form, document), source


@cache
def _validator(form: Hashable) -> SchemaValidator:
    return validator_of(cast(type[Section], form))


def _without_nulls(data: Any, key: str) -> tuple[Any, list[str]]:
    """The values without the keys that hold nothing, and the dotted keys of those; entries of lists keep their places,
    and so those that hold nothing stay.
    """
    if not isinstance(data, (dict, list)):
        return data, []
    empty: list[str] = []
    kept: list[tuple[Any, Any]] = []
    for name, value in data.items() if isinstance(data, dict) else enumerate(data):
        inner_key = dotted(key, name)
        inner, inner_empty = _without_nulls(value, inner_key)
        empty += [inner_key] if value is None else inner_empty
        if value is not None or isinstance(data, list):
            kept.append((name, inner))
    return (dict(kept) if isinstance(data, dict) else [value for _, value in kept]), empty


def _reported(empty: list[str]) -> frozenset[str]:
    """The keys of which it was said already that something is missing: those that are empty, and lists with such."""
    parents = (key.rpartition(".") for key in empty)
    return frozenset({*empty, *(parent for parent, _, last in parents if last.isdigit())})


def _empty(key: str, source: SpecSource) -> Finding:
    place = source.keys.get(key, (1, 1))
    return finding_from_text(
        TextError("SIT004", f"{undotted(key)}: has no value", "give it one, or leave the key out", place, key)
    )


def in_order(findings: list[Finding]) -> tuple[Finding, ...]:
    """Findings in the order of the text."""
    return tuple(sorted(findings, key=lambda finding: (finding.line or 0, finding.column or 0, finding.rule)))
