"""Sections of the spec: classes whose attributes declare keys, read by pydantic's core.

pydantic's model layer is left out on purpose: it more than doubles the start-up time of `check`, and the core alone
validates, collects every error at once, and says where each one is.
"""

from __future__ import annotations

import re
from typing import Any, ClassVar, NoReturn

from pydantic_core import PydanticCustomError, SchemaValidator, core_schema

from sitscad.record import record
from sitscad.spec.format.kinds.kind import Kind
from sitscad.spec.format.kinds.preset import Preset, ProfileName
from sitscad.spec.format.kinds.word import Choice

NAME = "<name>"
WRITTEN = "<written out>"
GATHERED = "<keys alike>"
REQUIRED: Any = object()

SHOWN_KEYS = 12
"""Optional keys that a hint lists; the others are in docs/spec.md."""


@record
class Key:
    """One key of a section: the kind of its value, its default as a person would write it, and what it is for."""

    kind: Kind
    default: Any
    about: str

    @property
    def is_required(self) -> bool:
        """Whether a spec without the key is refused."""
        return self.default is REQUIRED


def key(kind: Kind, about: str, default: Any = REQUIRED) -> Any:
    """Declare a key. A default of None means that there is no value; any other is read like a written one."""
    return Key(kind, default, about)


@record
class KeysLike:
    """Keys whose names follow a pattern, with values of one kind: an attribute that holds them all by name."""

    pattern: re.Pattern[str]
    example: str
    kind: Kind
    about: str

    def gathered(self, value: Any) -> Any:
        """A section's values with these keys under one."""
        if not isinstance(value, dict):
            return value
        own = {name: each for name, each in value.items() if self.pattern.fullmatch(str(name))}
        return {**{name: each for name, each in value.items() if name not in own}, GATHERED: own} if own else value


def keys_like(pattern: re.Pattern[str], example: str, kind: Kind, about: str) -> Any:
    """Declare keys by a pattern of their names; a section may have one such declaration."""
    return KeysLike(pattern, example, kind, about)


class Section:
    """A section of the spec, read-only: `keys` are those declared in the class, each an attribute of the instance.

    ``alike`` are those that are declared by a pattern: the attribute's name and the declaration.
    """

    keys: ClassVar[dict[str, Key]] = {}
    alike: ClassVar[dict[str, KeysLike]] = {}

    def __init_subclass__(cls) -> None:
        """Collect the keys that the class declares."""
        cls.keys = {name: value for name, value in vars(cls).items() if isinstance(value, Key)}
        cls.alike = {name: value for name, value in vars(cls).items() if isinstance(value, KeysLike)}

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Refuse: a section is what was written."""
        raise AttributeError(f"{type(self).__name__} is read-only")

    def values(self) -> dict[str, Any]:
        """The values of all keys, defaults included."""
        return {name: getattr(self, name) for name in self.keys}


@record
class Part(Kind):
    """A section inside another one."""

    section: type[Section]

    def validator(self) -> core_schema.CoreSchema:
        """An instance of the section; unknown keys are refused."""
        fields = [core_schema.dataclass_field(name, _with_default(k)) for name, k in self.section.keys.items()]
        fields += [_gathering(name, like) for name, like in self.section.alike.items()]
        arguments = core_schema.dataclass_args_schema(self.section.__name__, fields)
        config = core_schema.CoreConfig(extra_fields_behavior="forbid")
        names = [*self.section.keys, *self.section.alike]
        read: core_schema.CoreSchema = core_schema.dataclass_schema(self.section, arguments, names, config=config)
        for like in self.section.alike.values():
            read = core_schema.no_info_before_validator_function(like.gathered, read)
        return read

    def schema(self) -> dict[str, Any]:
        """A reference to the section's own schema."""
        return {"$ref": f"#/$defs/{self.section.__name__}"}


def _with_default(k: Key) -> core_schema.CoreSchema:
    inner = k.kind.validator()
    if k.is_required:
        return inner
    return core_schema.with_default_schema(inner, default=k.default, validate_default=k.default is not None)


def _gathering(name: str, like: KeysLike) -> core_schema.DataclassField:
    inner = core_schema.dict_schema(values_schema=like.kind.validator())
    empty = core_schema.with_default_schema(inner, default_factory=dict)
    return core_schema.dataclass_field(name, empty, validation_alias=GATHERED)


@record
class ListOf(Kind):
    """A list whose entries are all of one kind."""

    entry: Kind

    def validator(self) -> core_schema.CoreSchema:
        """A list, each entry read on its own."""
        return core_schema.list_schema(self.entry.validator(), strict=True)

    def schema(self) -> dict[str, Any]:
        """An array."""
        return {"type": "array", "items": self.entry.schema()}


@record
class NameOr(Kind):
    """The name of a preset (or a word out of a list), or the same thing written out."""

    preset: Preset | Choice | ProfileName
    written: Kind

    def validator(self) -> core_schema.CoreSchema:
        """Decides by what is written, so that complaints are about the form that was meant."""
        form = "a list" if isinstance(self.written, ListOf) else "a section"
        return core_schema.tagged_union_schema(
            {
                NAME: core_schema.no_info_plain_validator_function(self._read_name),
                WRITTEN: self.written.validator(),
            },
            lambda value: NAME if isinstance(value, str) else WRITTEN if isinstance(value, (dict, list)) else None,
            custom_error_type="SIT004",
            custom_error_message=f"neither a preset's name nor {form} that writes it out",
        )

    def _read_name(self, value: str) -> str:
        """The name; where there is none like it, the hint also says how to write the thing out."""
        try:
            return self.preset.read(value)
        except PydanticCustomError as error:
            context = dict(error.context or {})
            context["hint"] = f"{context.get('hint', '')}; or write it out: {self._form()} (examples: docs/spec.md)"
            raise PydanticCustomError(error.type, error.message_template, context) from None

    def _form(self) -> str:
        """The keys of the written form: those that it must have, then those that it may have."""
        section = section_of(self.written)
        keys = section.keys if section else {}
        if isinstance(self.written, ListOf):
            return f"a list of sections with {', '.join(keys)}"
        needed = [name for name, k in keys.items() if k.is_required]
        others = [name for name, k in keys.items() if not k.is_required]
        some = ", ".join(others[:SHOWN_KEYS]) + (", ..." if len(others) > SHOWN_KEYS else "")
        form = f"a section with {', '.join(needed)}" if needed else f"a section with any of {some}"
        return f"{form} and, if wanted, {some}" if needed and others else form

    def schema(self) -> dict[str, Any]:
        """Either form."""
        names = self.preset.schema()
        return {"anyOf": [*names.get("anyOf", [names]), self.written.schema()]}


def validator_of(section: type[Section]) -> SchemaValidator:
    """What reads a whole document; its `validate_python` raises pydantic's ValidationError with all errors."""
    return SchemaValidator(Part(section).validator())


def sections_in(section: type[Section]) -> dict[str, type[Section]]:
    """The section and all that can stand inside it, by class name."""
    found = {section.__name__: section}
    for k in section.keys.values():
        inner = section_of(k.kind)
        if inner is not None and inner.__name__ not in found:
            found |= sections_in(inner)
    return found


def section_of(kind: Kind) -> type[Section] | None:
    """The section that a kind of value is, or may be when written out; None for single values."""
    if isinstance(kind, Part):
        return kind.section
    if isinstance(kind, ListOf):
        return section_of(kind.entry)
    return section_of(kind.written) if isinstance(kind, NameOr) else None
