"""What pydantic and the resolver complain about, as findings with their place in the text and a hint."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from pydantic_core import ValidationError

from sitscad.finding import Edit, Finding, Remedy, Severity
from sitscad.spec.format.documents.spec import SpecDocument
from sitscad.spec.format.kinds.refusal import described, is_like
from sitscad.spec.format.remarks import Flaw
from sitscad.spec.format.section import GATHERED, NAME, WRITTEN, Section, section_of
from sitscad.spec.format.yaml.text import TextError, dotted, undotted
from sitscad.spec.rules import RULE_NAMES
from sitscad.spec.source import SpecSource

_TAGS = (NAME, WRITTEN, GATHERED)

MOST_LISTED = 16
"""Keys of a section that a hint lists."""


def finding_from_text(error: TextError) -> Finding:
    """A complaint about the text itself."""
    line, column = error.place
    return _finding(error.rule, error.message, error.hint, error.key, line, column)


def finding_from_flaw(flaw: Flaw, source: SpecSource) -> Finding:
    """A complaint about values that do not fit each other."""
    line, column = source.locate(flaw.key)
    message = f"{flaw.key}: {flaw.message}"
    facts: dict[str, Any] = {"measured": flaw.measured, "limit": flaw.limit, "unit": flaw.unit}
    facts["fixes"] = (Remedy(flaw.edits),) if flaw.edits else ()
    return _finding(flaw.rule, message, flaw.hint, flaw.key, line, column, **facts)


def findings_from_pydantic(
    error: ValidationError, source: SpecSource, empty: frozenset[str], form: type[Section] = SpecDocument
) -> list[Finding]:
    """The complaints about single values; those about keys in `empty`, which were reported already, are left out.

    `form` is the section that the whole text is.
    """
    errors = error.errors(include_url=False, include_context=True)
    return [_from_error(entry, key, source, form) for entry in errors if (key := _key_of(entry)) not in empty]


def _key_of(error: Mapping[str, Any]) -> str:
    # An unknown key may be called like a tag; nothing else that a person writes stands in a place.
    *section, last = error["loc"] or ("",)
    is_written = error["type"] == "unexpected_keyword_argument"
    return dotted(_key(section), last) if is_written else _key(error["loc"])


def _key(loc: Iterable[Any]) -> str:
    found = ""
    for part in loc:
        found = found if part in _TAGS else dotted(found, part)
    return found


def _from_error(error: Mapping[str, Any], key: str, source: SpecSource, form: type[Section]) -> Finding:
    """The finding that one of pydantic's errors becomes."""
    kind, context = error["type"], error.get("ctx", {})
    if kind == "unexpected_keyword_argument":
        return _unknown_key(error["loc"], key, source, form)
    if kind == "missing":
        return _missing_key(key, source)
    line, column = source.locate(key)
    if kind.startswith("SIT"):
        facts = {name: context.get(name) for name in ("measured", "limit", "unit")}
        if context.get("meant") and not isinstance(error["input"], (list, dict)):  # else it was one value of several
            facts["fixes"] = (Remedy((Edit(key, context["meant"]),), is_sure=context.get("is_sure", True)),)
        message = context.get("message", error["msg"])
        hint = context.get("hint", "write a preset's name, or write it out")
        return _finding(kind, f"{key}: {message}", hint, key, line, column, **facts)
    wanted = "a list" if "list" in kind else "a section of keys and values"
    message = f"{key}: {described(error['input'])}, where {wanted} is wanted"
    return _finding("SIT004", message, "see `sitscad schema` for its form", key, line, column)


def _unknown_key(loc: tuple[Any, ...], key: str, source: SpecSource, form: type[Section]) -> Finding:
    """The finding for a key that there is not, with the one that may be meant."""
    line, column = source.keys.get(key, (1, 1))
    section = _section(loc[:-1], form)
    allowed = tuple(section.keys) if section else ()
    word = str(loc[-1])
    close = difflib.get_close_matches(word[:64].lower().replace("-", "_"), allowed, 1, 0.6)
    elsewhere = _homes().get(word) if not close and form is SpecDocument else None
    hint = f"did you mean {close[0]}? " if close else f"did you mean {elsewhere}? " if elsewhere else ""
    where = f"in {_key(loc[:-1])}" if len(loc) > 1 else "at the top"
    message = f"{described(word)} is no key {where}"
    listed = ", ".join(allowed[:MOST_LISTED]) + (", ... (all: docs/spec.md)" if len(allowed) > MOST_LISTED else "")
    renamed = Remedy((Edit(key, close[0], what="name"),), is_sure=is_like(word, close[0])) if close else None
    is_free = renamed is not None and dotted(_key(loc[:-1]), close[0]) not in source.keys
    fixes = (renamed,) if renamed is not None and is_free else ()
    return _finding("SIT002", message, f"{hint}allowed: {listed}", key, line, column, fixes=fixes)


def _missing_key(key: str, source: SpecSource) -> Finding:
    parent, _, name = key.rpartition(".")
    line, column = source.keys.get(parent, (1, 1)) if parent else (1, 1)
    where = parent or "the spec"
    return _finding("SIT003", f"{where} has no {name}", f"add {name}: to {where}", key, line, column)


def _section(loc: tuple[Any, ...], form: type[Section]) -> type[Section] | None:
    """The section at a place of the document."""
    section: type[Section] | None = form
    for part in loc:
        if not isinstance(part, int) and part not in _TAGS:
            section = section_of(section.keys[part].kind) if section and part in section.keys else None
    return section


@cache
def _homes() -> dict[str, str]:
    """For keys that live in one section only, where that is: for keys written in the wrong section."""
    homes: dict[str, str] = {}
    doubled: set[str] = set()
    for top, key in SpecDocument.keys.items():
        section = section_of(key.kind)
        for name in section.keys if section else ():
            doubled |= {name} & homes.keys()
            homes[name] = f"{top}.{name}"
    return {name: home for name, home in homes.items() if name not in doubled}


def _finding(
    rule: str, message: str, hint: str, key: str | None, line: int | None, column: int | None, **facts: Any
) -> Finding:
    shown = undotted(key) if key else None
    return Finding(rule, RULE_NAMES[rule], Severity.ERROR, message, hint.strip(), shown, line, column, **facts)
