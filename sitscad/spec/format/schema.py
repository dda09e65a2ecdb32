"""The JSON Schema of the spec, for editors: made from the same declarations that read it."""

from __future__ import annotations

from typing import Any

from sitscad.spec.format.documents.spec import SpecDocument
from sitscad.spec.format.section import Key, Section, sections_in

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of what may be written, with descriptions and the names of the installed presets."""
    inner = {name: section for name, section in sections_in(SpecDocument).items() if section is not SpecDocument}
    definitions = {name: _object(section) for name, section in sorted(inner.items())}
    return {"$schema": DIALECT, "title": "sitscad spec", **_object(SpecDocument), "$defs": definitions}


def _object(section: type[Section]) -> dict[str, Any]:
    """The JSON Schema of a section."""
    return {
        "type": "object",
        "description": section.__doc__,
        "additionalProperties": False,
        "required": [name for name, key in section.keys.items() if key.is_required],
        "properties": {name: _property(key) for name, key in section.keys.items()},
        **_patterns(section),
    }


def _patterns(section: type[Section]) -> dict[str, Any]:
    found = {
        f"^{like.pattern.pattern}$": {"description": like.about, **like.kind.schema()}
        for like in section.alike.values()
    }
    return {"patternProperties": found} if found else {}


def _property(key: Key) -> dict[str, Any]:
    has_default = not key.is_required and key.default is not None
    return {"description": key.about, **key.kind.schema(), **({"default": key.default} if has_default else {})}
