"""Sections of the spec: classes whose attributes declare keys, and the code that reads them.

The reader, the JSON Schema, the tables of docs/spec.md and the check of values set by programs all use these
declarations. A section class that is also a dataclass (`record`) is stored in the spec as it is. Other sections are
first converted to another class.

A section reads each key by the kind of its value, and collects all errors. Pydantic is not used, because its import
takes a quarter as long as numpy's.
"""
# ruff: noqa: D102 - `Kind` documents these methods

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import Field, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

from sitscad.basics.record import record
from sitscad.basics.units import SI_UNITS, exact_text
from sitscad.spec.format.kinds import (
    Choice,
    Either,
    InvalidKey,
    Kind,
    Layers,
    NumberOrList,
    Pair,
    Preset,
    ProfileName,
    Refusal,
    Several,
    Sourced,
    Special,
    UnitValue,
    describe,
    names,
)
from sitscad.spec.yaml.source import TextError, dotted, key_text

REQUIRED: Any = object()
WRITTEN_SOURCE = "the spec"
"""Source of a figure that the user wrote."""

SHOWN_KEYS = 12
"""Maximum number of optional keys that a hint lists. The others are in docs/spec.md."""


@record
class Key:
    """One key of a section: kind of value, default in the form that a user would write, and description.

    ``written`` is the key's name in the text if it differs from the attribute's name.
    """

    kind: Kind
    default: Any
    about: str
    written: str = ""

    @property
    def is_required(self) -> bool:
        """Whether a spec without the key is refused."""
        return self.default is REQUIRED

    def usual(self) -> Any:
        """Return the default as the spec stores it, in SI units."""
        return self.kind.read_at("", self.default, [])


def key(kind: Kind, about: str, default: Any = REQUIRED, written: str = "") -> Any:
    """Declare a key: the kind of its value, a text `about` it for users, and its default.

    The default None means that the key has no value. Any other default is in the form that a user would write.
    """
    declaration = Key(kind, default, about, written)
    if default is None:
        return field(default=None, metadata={"key": declaration})
    if default is REQUIRED:
        return field(metadata={"key": declaration})
    return field(default_factory=declaration.usual, metadata={"key": declaration})


@record
class KeysLike:
    """Declaration of keys whose names match a pattern. All their values have the same kind.

    A single attribute of the section holds all these values, by name.
    """

    pattern: re.Pattern[str]
    example: str
    kind: Kind
    about: str


def keys_like(pattern: re.Pattern[str], example: str, kind: Kind, about: str) -> Any:
    """Declare all keys whose names match a pattern. `example` is one such name, for the documentation."""
    return KeysLike(pattern, example, kind, about)


class SpecValue:
    """Base class of all parts of a spec.

    Some keys of the text are not attributes. Access to them raises an AttributeError that names the right attribute.
    """

    read_instead: ClassVar[dict[str, str]] = {}

    if not TYPE_CHECKING:  # else a type checker accepts misspelt attributes

        def __getattr__(self, name: str) -> NoReturn:
            """Raise AttributeError. Python calls this method for missing attributes."""
            where = type(self).read_instead.get(name)
            hint = f": it is a key of the spec's text, read {where}" if where else ""
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}{hint}", name=name, obj=self)


class Section(SpecValue):
    """A read-only section of the spec. Each declared key is an attribute of the instance.

    * ``keys``: declared keys by their names in the text
    * ``attributes``: attribute of each of these keys
    * ``alike``: declarations of keys by a pattern, by the attribute that holds their values
    * ``form``: name of the section in the JSON Schema
    * ``stands_in``: a key, and a group of required keys. The user may write this key instead of one key of the group.
    * ``alone``: first a key that replaces the other keys of the section, then the keys that are allowed beside it

    The first paragraph of a subclass's docstring is printed for users.
    """

    keys: ClassVar[dict[str, Key]] = {}
    attributes: ClassVar[dict[str, str]] = {}
    alike: ClassVar[dict[str, KeysLike]] = {}
    form: ClassVar[str] = ""
    stands_in: ClassVar[tuple[str, tuple[str, ...]]] = ("", ())
    alone: ClassVar[tuple[str, ...]] = ()
    is_whole: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        """Collect the keys that the class declares."""
        declared = ((name, value) for name, value in vars(cls).items() if isinstance(value, Field))
        declarations = {name: value.metadata["key"] for name, value in declared if "key" in value.metadata}
        cls.attributes = {declaration.written or name: name for name, declaration in declarations.items()}
        cls.keys = {declaration.written or name: declaration for name, declaration in declarations.items()}
        renamed = {declaration.written: name for name, declaration in declarations.items() if declaration.written}
        cls.read_instead = {**renamed, **cls.read_instead}
        cls.alike = {name: value for name, value in vars(cls).items() if isinstance(value, KeysLike)}
        cls.form = f"{re.sub('(Document|Spec|Material)$', '', cls.__name__)}Document"

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Raise AttributeError: sections are read-only."""
        raise AttributeError(f"{type(self).__name__} is read-only")

    def values(self) -> dict[str, Any]:
        """Return the values of all keys by attribute, including defaults."""
        return {name: getattr(self, name) for name in self.attributes.values()}

    @classmethod
    def about(cls) -> str:
        """Return the description of the section for users."""
        return (cls.__doc__ or "").partition("\n\n")[0]


def _refuse_form(key: str, value: Any, form: str, invalid_keys: list[InvalidKey]) -> None:
    message = f"{describe(value)}, where {form} is wanted"
    invalid_keys.append(InvalidKey(key, value, Refusal("SIT004", message, "see `sitscad schema` for its form", {})))


@record
class Part(Kind):
    """A section inside a section.

    `convert` converts it to the value that the spec stores; None stores the section itself.
    """

    section: type[Section]
    convert: Callable[[Any], Any] | None = None

    def read_at(self, key: str, value: Any, invalid_keys: list[InvalidKey]) -> Any:
        """Return an instance of the section. Errors are added to `invalid_keys`."""
        if not isinstance(value, dict):
            return _refuse_form(key, value, "a section of keys and values", invalid_keys)
        section, before, values = self.section, len(invalid_keys), dict[str, Any]()
        is_alone = bool(section.alone) and section.alone[0] in value
        for written, name in section.attributes.items():
            declared, inner = section.keys[written], dotted(key, written)
            if section.alone and written in value and is_alone != (written in section.alone):
                message = f"{section.alone[0]} replaces {written}" if is_alone else f"it belongs to {section.alone[0]}"
                refusal = Refusal("SIT009", message, "leave one of them out", {})
                invalid_keys.append(InvalidKey(inner, value[written], refusal))
            elif written not in value and declared.is_required and is_alone:
                values[name] = None
            elif written not in value and declared.is_required:
                invalid_keys.append(InvalidKey(inner))
            elif written in value or declared.default is not None:
                values[name] = declared.kind.read_at(inner, value.get(written, declared.default), invalid_keys)
            else:
                values[name] = None
        matched: set[Any] = set()
        for name, like in section.alike.items():
            matching = {each: value[each] for each in value if like.pattern.fullmatch(str(each))}
            values[name] = {entry_key: like.kind.read_at(dotted(key, entry_key), entry, invalid_keys)
                            for entry_key, entry in matching.items()}
            matched |= matching.keys()
        unknown = [each for each in value if each not in section.keys and each not in matched]
        invalid_keys += [InvalidKey(dotted(key, each), each, section=section) for each in unknown]
        if len(invalid_keys) > before:
            return None
        read = object.__new__(section)
        read.__dict__.update(values)
        return read if self.convert is None else self.convert(read)

    def schema(self) -> dict[str, Any]:
        return {"$ref": f"#/$defs/{self.section.form}"}


@record
class ListOf(Kind):
    """A list with entries of one kind."""

    entry: Kind

    def read_at(self, key: str, value: Any, invalid_keys: list[InvalidKey]) -> Any:
        """Return the list, with each entry read by the kind of the entries."""
        if not isinstance(value, list):
            return _refuse_form(key, value, "a list", invalid_keys)
        return [self.entry.read_at(dotted(key, k), entry, invalid_keys) for k, entry in enumerate(value)]

    def schema(self) -> dict[str, Any]:
        return {"type": "array", "items": self.entry.schema()}


@record
class NameOr(Kind):
    """The name of a preset, a word from a list or a single quantity; or the full value written out."""

    preset: Preset | Choice | ProfileName | UnitValue
    written: Kind

    def read_at(self, key: str, value: Any, invalid_keys: list[InvalidKey]) -> Any:
        """Read the form that was written, so that error messages refer to that form."""
        if isinstance(value, (dict, list)):
            return self.written.read_at(key, value, invalid_keys)
        try:
            if isinstance(value, str) or isinstance(self.preset, UnitValue):
                return self.preset.read(value)
        except Refusal as refusal:
            more = f"; or write it out: {self._form_text()} (examples: docs/spec.md)"
            invalid_keys.append(InvalidKey(key, value, refusal.with_hint(more)))
            return None
        form = "a list" if isinstance(self.written, ListOf) else "a section"
        message = f"neither a preset's name nor {form} that writes it out"
        neither = Refusal("SIT004", message, "write a preset's name, or the full value", {})
        invalid_keys.append(InvalidKey(key, value, neither))
        return None

    def _form_text(self) -> str:
        """Return a description of the form written out: the required keys, then the optional keys."""
        section = section_of(self.written)
        keys = section.keys if section else {}
        if isinstance(self.written, ListOf):
            return f"a list of sections with {', '.join(keys)}"
        needed = [name for name, k in keys.items() if k.is_required]
        optional = [name for name, k in keys.items() if not k.is_required]
        some = ", ".join(optional[:SHOWN_KEYS]) + (", ..." if len(optional) > SHOWN_KEYS else "")
        form = f"a section with {', '.join(needed)}" if needed else f"a section with any of {some}"
        return f"{form} and, if wanted, {some}" if needed and optional else form

    def schema(self) -> dict[str, Any]:
        names = self.preset.schema()
        return {"anyOf": [*names.get("anyOf", [names]), self.written.schema()]}


def preset_or(kind: str, section: type[Section], convert: Callable[[Any], Any] | None = None) -> NameOr:
    """Return the kind of a value that is either a preset's name or a written section.

    `convert` converts the section to the value that the spec stores. By default, it sets "the spec" as its source.
    """
    convert = convert or (lambda value: replace(value, source=WRITTEN_SOURCE))
    return NameOr(Preset(kind, up=True), Part(section, convert))


def section_of(kind: Kind) -> type[Section] | None:
    """Return the section class in a value of this kind. None for single values.

    It is the class of the value, the class of its list entries, or the class that a user may write instead of a name.
    """
    if isinstance(kind, Part):
        return kind.section
    if isinstance(kind, ListOf):
        return section_of(kind.entry)
    return section_of(kind.written) if isinstance(kind, NameOr) else None


def schema_of(section: type[Section], title: str, name: str, files: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a document, with descriptions and names of the installed presets.

    `name` is the schema's own URN. `files` is the pattern of the file names for which editors use the schema.
    """
    sections: dict[str, type[Section]] = {}

    def collect(inner: type[Section]) -> None:
        for k in inner.keys.values():
            each = section_of(k.kind)
            if each is not None and each.form not in sections:
                sections[each.form] = each
                collect(each)

    collect(section)
    definitions = {name: _object(sections[name]) for name in sorted(sections)}
    dialect = "https://json-schema.org/draft/2020-12/schema"
    head = {"$schema": dialect, "$id": name, "title": title, "fileMatch": [files]}
    return {**head, **_object(section), "$defs": definitions}


def _object(section: type[Section]) -> dict[str, Any]:
    properties = {}
    for name, k in section.keys.items():
        default = {} if k.is_required or k.default is None else {"default": k.default}
        properties[name] = {"description": k.about, **k.kind.schema(), **default}
    patterns = {f"^{like.pattern.pattern}$": {"description": like.about, **like.kind.schema()}
                for like in section.alike.values()}
    required = [name for name, k in section.keys.items() if k.is_required]
    always = [] if section.alone else required
    other, replaced = section.stands_in
    variants = [[other if name == omitted else name for name in replaced] for omitted in ("", *replaced)]
    if section.alone:
        variants = [[*required, *variant] for variant in variants] + [[section.alone[0]]]
    return {"type": "object", "description": section.about(), "additionalProperties": False, "required": always,
            "properties": properties, **({"patternProperties": patterns} if patterns else {}),
            **({"oneOf": [{"required": variant} for variant in variants]} if replaced else {})}


BARE_NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*")
"""A number without a unit."""

ALTERNATIVE_UNITS = {"length": ("mm", 1e-3), "angle": ("deg", 0.017453292519943295)}
"""Unit that the user may have meant if a number in SI units is out of range, and its factor to SI, by dimension."""


def kind_at(section: type[Section], key: str) -> Kind | None:
    """Return the kind of the value at a dotted key of a section. None if there is no such key."""
    kind: Kind | None = Part(section)
    for name in key.split("."):
        kind = _kind_of_entry(kind, name)
    return kind


def _kind_of_entry(kind: Kind | None, name: str) -> Kind | None:
    """Return the kind of one entry of a section or list. None if there is no such entry.

    `kind` is the kind of the section or list. `name` is the entry's key or index.
    """
    if isinstance(kind, Either):
        return _kind_of_entry(kind.other, name)
    if isinstance(kind, NameOr):
        return _kind_of_entry(kind.written, name)
    if isinstance(kind, Sourced) and name in ("value", "source", "status"):
        return kind.figure if name == "value" else None
    if isinstance(kind, Sourced):
        return _kind_of_entry(kind.figure, name)
    if isinstance(kind, Part):
        declared = kind.section.keys.get(name)
        matching = (like.kind for like in kind.section.alike.values() if like.pattern.fullmatch(name))
        return declared.kind if declared is not None else next(matching, None)
    return _kind_of_list_entries(kind) if name.isdecimal() else None


def _kind_of_list_entries(kind: Kind | None) -> Kind | None:
    """Return the kind of the entries of a list. None if the value is not a list, or is a list of plain numbers."""
    if isinstance(kind, Pair):
        return kind.length
    if isinstance(kind, ListOf):
        return kind.entry
    if isinstance(kind, Several):
        return kind.one
    return kind.entry if isinstance(kind, Special) else None


def as_written(value: Any, kind: Kind | None, key: str) -> Any:
    """Return a value in the form that it has in the text of a spec. This is the inverse of reading.

    `value` has the form of an attribute of a `SensorSpec`, in SI units. A quantity becomes a text with a unit. An
    object becomes the name of its preset, or a mapping of its keys.

    Raises
    ------
    TextError
        if a length is a text without a unit. Also if a number is out of range, but would be in range as mm or degrees
    """
    if isinstance(kind, Either):
        return kind.word if value is None or value == kind.word else as_written(value, kind.other, key)
    if isinstance(kind, Sourced):
        is_section = isinstance(value, Mapping) and "value" in value
        inner = as_written(value["value"] if is_section else getattr(value, "value", value), kind.figure, key)
        return {**value, "value": inner} if is_section else inner
    if isinstance(kind, NameOr):
        if isinstance(kind.preset, UnitValue) and isinstance(value, (int, float, str)):
            return as_written(value, kind.preset, key)
        name, presets = getattr(value, "name", None), "rules" if isinstance(kind.preset, ProfileName) else ""
        presets = kind.preset.kind if isinstance(kind.preset, Preset) else presets
        return name if presets and name in names(presets) else as_written(value, kind.written, key)
    if isinstance(kind, Preset):
        return getattr(value, "name", value)
    if isinstance(kind, Part):
        return _section(value, kind.section, key)
    if isinstance(kind, UnitValue):
        return _quantity(value, kind, key)
    if isinstance(value, (list, tuple)) and isinstance(kind, (Pair, ListOf, Several, Special, Layers, NumberOrList)):
        return [as_written(entry, _kind_of_list_entries(kind), dotted(key, index)) for index, entry in enumerate(value)]
    if isinstance(kind, (Pair, Several)):
        return as_written(value, _kind_of_list_entries(kind), key)
    is_flag = isinstance(value, bool) and isinstance(kind, Choice) and len(kind.allowed) == 2
    return kind.allowed[value] if is_flag and isinstance(kind, Choice) else value


def _section(value: Any, section: type[Section], key: str) -> Any:
    """Return a section as a mapping of its keys. `value` is a mapping, a tuple of pairs, or an object of the spec."""
    if isinstance(value, section):
        is_alone = bool(section.alone) and getattr(value, section.attributes[section.alone[0]]) is not None
        inside = {name: getattr(value, attribute) for name, attribute in section.attributes.items()
                  if not is_alone or name in section.alone}
        choices = {name: inner.kind.word for name, inner in section.keys.items() if isinstance(inner.kind, Either)}
        value = {name: choices[name] if inner is None else inner
                 for name, inner in inside.items() if inner is not None or name in choices}
    elif isinstance(value, tuple) and all(isinstance(inner, tuple) and len(inner) == 2 for inner in value):
        value = dict(value)
    if not isinstance(value, Mapping):
        return value
    kinds = {name: _kind_of_entry(Part(section), str(name)) for name in value}
    return {name: inner if inner is None else as_written(inner, kinds[name], dotted(key, name))
            for name, inner in value.items()}


def _quantity(value: Any, kind: UnitValue, key: str) -> Any:
    """Return a quantity as text with a unit. `value` is a number in SI units, or a text, which is returned as it is."""
    dimension = kind.dimension
    if isinstance(value, str) and dimension == "length" and BARE_NUMBER.fullmatch(value):
        message = f"{key_text(key)}: {describe(value)} has no unit, and a length in a text needs one"
        raise TextError("SIT005", message, f"did you mean '{value.strip()} mm'? A number without quotes is in metres",
                        key=key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e30:
        return value
    low, high = kind.range
    unit, factor = ALTERNATIVE_UNITS.get(dimension, ("", 1.0))
    if unit and not low <= value <= high and low <= value * factor <= high:
        message = f"{key_text(key)}: {value:g} {SI_UNITS[dimension]} is out of range: {kind.low} to {kind.high}"
        hint = f"did you mean '{value:g} {unit}'? Numbers are in SI units, as attributes are; a text has its unit"
        raise TextError("SIT006", message, hint, key=key)
    return exact_text(float(value), dimension)
