"""Kinds of value in a spec, such as numbers, lengths, choices and names of presets.

Each kind reads a plain YAML value. If the value is invalid, it raises a `Refusal` with the rule, the value and the
allowed values. Each kind also provides its JSON Schema.
"""
# ruff: noqa: D102 - `Kind` and `Scalar` document these methods

from __future__ import annotations

import difflib
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Any, NoReturn

from sitscad.basics.record import record
from sitscad.basics.units import EXAMPLES, SI_UNITS, UNITS, UnitError, parse_quantity, show
from sitscad.data import FOLDER, rows


class Refusal(ValueError):
    """A value is invalid: it breaks a rule of the spec's format.

    `facts` has these entries, if known:

    * ``measured``, ``limit`` and ``unit``: the value, the limit that it exceeds, and their unit
    * ``meant``: text of the value that the user probably meant
    * ``is_sure``: True if the user cannot have meant any other value
    """

    def __init__(self, rule: str, message: str, hint: str, facts: Mapping[str, Any]) -> None:
        super().__init__(message)
        self.rule, self.message, self.hint, self.facts = rule, message, hint, facts

    def with_hint(self, more: str) -> Refusal:
        """Return a copy with the text `more` appended to the hint."""
        return Refusal(self.rule, self.message, self.hint + more, self.facts)


def refuse(rule: str, message: str, hint: str = "", **facts: Any) -> NoReturn:
    """Raise a `Refusal` by the rule with number `rule`. `facts` are its entries."""
    raise Refusal(rule, message, hint, facts)


@record(eq=False)
class InvalidKey:
    """An error at a key of the spec: dotted key, value, and the refusal of the value.

    `refusal` is None if the key is missing or unknown. `section` is None unless the key is unknown; it is then the
    section class that lacks the key.
    """

    key: str
    value: Any = None
    refusal: Refusal | None = None
    section: type | None = None


def describe(value: Any) -> str:
    """Return a short text that describes a value in a message."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a section"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if isinstance(value, int) and abs(value) >= 10**30:
        return "a number of more than thirty digits"
    text = repr(value)
    return text if len(text) <= 44 else text[:41] + "..."


MISSPELLING_SIMILARITY = 0.8
"""Minimum similarity ratio (`difflib`, 0 to 1) at which a word counts as a misspelling of another."""


def is_misspelling(word: Any, allowed: str) -> bool:
    """Whether a word is so similar to `allowed` that it counts as a misspelling.

    Digits must be equal: ``ecoflex-00-40`` is no misspelling of ``ecoflex-00-30``.
    """
    written, expected = (text.replace("_", "-") for text in (str(word)[:64].lower(), allowed))
    if re.findall(r"\d", written) != re.findall(r"\d", expected):
        return False
    return difflib.SequenceMatcher(None, written, expected).ratio() >= MISSPELLING_SIMILARITY


class Kind(ABC):
    """Base class of all kinds of value. A kind reads values and provides their JSON Schema."""

    @abstractmethod
    def schema(self) -> dict[str, Any]:
        """Return the JSON Schema of the allowed values."""

    @abstractmethod
    def read_at(self, key: str, value: Any, invalid_keys: list[InvalidKey]) -> Any:
        """Return the value written at a dotted key, as the spec stores it. Errors are added to `invalid_keys`."""


class Scalar(Kind):
    """Base class of kinds that read a value in one step, with `read`."""

    @abstractmethod
    def read(self, value: Any) -> Any:
        """Return the value as the spec stores it. Raises `Refusal` if it is invalid."""

    def read_at(self, key: str, value: Any, invalid_keys: list[InvalidKey]) -> Any:
        try:
            return self.read(value)
        except Refusal as refusal:
            invalid_keys.append(InvalidKey(key, value, refusal))
            return None


@record
class Either(Scalar):
    """One special word, which is read as None, or a value of the kind `other`."""

    word: str
    other: Scalar

    def read(self, value: Any) -> Any:
        return None if value == self.word else self.other.read(value)

    def schema(self) -> dict[str, Any]:
        return {"anyOf": [{"const": self.word}, self.other.schema()]}


@record(eq=False)
class Special(Scalar):
    """A value that the function `reader` reads. `described_as` is its JSON Schema.

    For lists, ``entry`` is the kind of the entries.
    """

    reader: Callable[[Any], Any]
    described_as: Mapping[str, Any]
    entry: Scalar | None = None

    def read(self, value: Any) -> Any:
        return self.reader(value)

    def schema(self) -> dict[str, Any]:
        return dict(self.described_as)


@record
class Number(Scalar):
    """A number without a unit, within a range."""

    low: float
    high: float
    whole: bool = False

    def read(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            suggestion, is_sure = self._probable_number(value)
            hint = f"did you mean {suggestion}? " if suggestion else ""
            hint += f"write a number without quotes, like {self.low:g}"
            refuse("SIT004", f"{describe(value)} is no number", hint, meant=suggestion, is_sure=is_sure)
        if not math.isfinite(value) or not self.low <= value <= self.high:
            limit = self.low if value < self.low else self.high
            message = f"{describe(value)} is out of range: {self.low:g} to {self.high:g}"
            facts = {"measured": float(value)} if abs(value) < 1e30 else {}
            refuse("SIT006", message, "", limit=float(limit), **facts)
        if self.whole and value != int(value):
            refuse("SIT004", f"{describe(value)} is no whole number", "")
        return int(value) if self.whole else float(value)

    def _probable_number(self, value: Any) -> tuple[str, bool]:
        """Return the number that the user probably meant, as text, and whether no other number is possible.

        The text is empty if `value` does not suggest a number.
        """
        text = value.strip() if isinstance(value, str) and len(value) <= 40 else ""
        plain = re.sub(r"(?<=[0-9])_(?=[0-9])", "", text)  # digits in groups, as YAML 1.1 has them
        is_sure = True
        if re.fullmatch(r"[-+]?[0-9]+,[0-9]+", plain) and not self.whole:
            plain, is_sure = plain.replace(",", "."), re.search(r",[0-9]{3}$", plain) is None
        if not re.fullmatch(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?", plain):
            return "", False
        return (plain, is_sure) if self.low <= float(plain) <= self.high else ("", False)

    def schema(self) -> dict[str, Any]:
        return {"type": "integer" if self.whole else "number", "minimum": self.low, "maximum": self.high}


def _list_text(value: Any) -> str:
    """Return the YAML list ``[8, 7]`` for a text like ``8, 7``. Empty for anything but numbers and commas."""
    numbers = [part.strip() for part in value.split(",")] if isinstance(value, str) and len(value) <= 80 else []
    if len(numbers) < 2 or not all(re.fullmatch(r"[0-9]{1,9}(\.[0-9]{1,9})?", number) for number in numbers):
        return ""
    return f"[{', '.join(numbers)}]"


@record
class NumberOrList(Scalar):
    """A number, or a list of numbers. Read as a tuple; a single number becomes a tuple of length 1."""

    number: Number
    most: int = 8

    def read(self, value: Any) -> tuple[float, ...]:
        if not isinstance(value, list):
            if suggestion := _list_text(value):
                refuse("SIT004", f"{describe(value)} is no number", f"write the list as {suggestion}")
            return (self.number.read(value),)
        if not 1 <= len(value) <= self.most:
            refuse("SIT006", f"{describe(value)} is out of range: 1 to {self.most} numbers", "write it like [8, 7]")
        return tuple(self.number.read(entry) for entry in value)

    def schema(self) -> dict[str, Any]:
        number = self.number.schema()
        return {"anyOf": [number, {"type": "array", "items": number, "minItems": 1, "maxItems": self.most}]}


@record
class Several(Scalar):
    """A value of a kind, or a list of such values. Read as a tuple, which is empty for an empty list."""

    one: Scalar
    most: int = 16

    def read(self, value: Any) -> tuple[Any, ...]:
        written = value if isinstance(value, list) else [value]
        if len(written) > self.most:
            refuse("SIT006", f"{len(written)} entries are out of range: at most {self.most}", "")
        return tuple(self.one.read(each) for each in written)

    def schema(self) -> dict[str, Any]:
        single = self.one.schema()
        many = {"type": "array", "items": single, "maxItems": self.most}
        return {"anyOf": [*single.get("anyOf", [single]), many]}


@record
class Layers(Scalar):
    """Copper layers: a number of layers counted from the top, or a list of layer numbers from the top down."""

    most: int = 8

    def read(self, value: Any) -> tuple[int, ...]:
        number = Number(1, self.most, whole=True)
        if likely := _list_text(value) or self._list_text_of_range(value):
            refuse("SIT004", f"{describe(value)} is no list of layers", f"did you mean {likely}?", meant=likely,
                   is_sure=False)
        if not isinstance(value, list):
            return tuple(range(1, int(number.read(value)) + 1))
        if not 1 <= len(value) <= self.most:
            message = f"{len(value)} layers are out of range: 1 to {self.most}"
            refuse("SIT006", message, "write a count or a list like [1, 2]")
        layers = tuple(int(number.read(entry)) for entry in value)
        if any(lower <= upper for upper, lower in pairwise(layers)):
            message = f"{list(layers)} does not run from the top down"
            refuse("SIT009", message, "name each layer once, the top one first")
        return layers

    def _list_text_of_range(self, value: Any) -> str:
        """Return the YAML list ``[1, 2]`` for a range like ``1-2``. Empty if the value is not a range of layers."""
        text = value if isinstance(value, str) else ""
        ends = re.fullmatch(r"\s*([0-9]{1,2})\s*(?:-|\u2013|\.\.+|:|to)\s*([0-9]{1,2})\s*", text)
        if ends is None or not 1 <= int(ends[1]) < int(ends[2]) <= self.most:
            return ""
        return str(list(range(int(ends[1]), int(ends[2]) + 1)))

    def schema(self) -> dict[str, Any]:
        number = Number(1, self.most, whole=True).schema()
        many = {"type": "array", "items": number, "minItems": 1, "maxItems": self.most, "uniqueItems": True}
        return {"anyOf": [number, many]}


_TRUTHS = {"yes": "true", "on": "true", "true": "true", "no": "false", "off": "false", "false": "false"}
"""Words for true and false, as in YAML 1.1 or in quotes, with their spelling in YAML 1.2."""


@record
class Boolean(Scalar):
    """True or false."""

    def read(self, value: Any) -> bool:
        if not isinstance(value, bool):
            suggestion = _TRUTHS.get(value.lower(), "") if isinstance(value, str) else ""
            message = f"{describe(value)}, where true or false is wanted"
            refuse("SIT004", message, "write true or false", meant=suggestion)
        return bool(value)

    def schema(self) -> dict[str, Any]:
        return {"type": "boolean"}


_UNIT_RULES = {"unit": "SIT005", "number": "SIT004", "range": "SIT006", "type": "SIT004"}


@record
class UnitValue(Scalar):
    """A quantity with a unit, within a range. Read as a float in SI units. The range's limits are texts with units."""

    dimension: str
    low: str
    high: str

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest allowed value (SI)."""
        return parse_quantity(self.low, self.dimension), parse_quantity(self.high, self.dimension)

    def read(self, value: Any) -> float:
        low, high = self.range
        try:
            quantity = parse_quantity(value, self.dimension)
        except UnitError as unread:
            error = unread.in_range(self.dimension, low, high)
            refuse(_UNIT_RULES[error.reason], str(error), error.hint, meant=error.meant, is_sure=error.is_sure)
        if not low <= quantity <= high:
            limit, bound, word = (low, self.low, "at least") if quantity < low else (high, self.high, "at most")
            unit = SI_UNITS[self.dimension]
            written = f"{describe(value)} ({show(quantity, unit)})" if self.dimension == "length" else describe(value)
            message = f"{written} is out of range: {word} {bound}"
            refuse("SIT006", message, "check the unit and the sign", measured=quantity, limit=limit, unit=unit)
        return quantity

    def schema(self) -> dict[str, Any]:
        units = "|".join(re.escape(unit) for unit in UNITS[self.dimension])
        pattern = rf"^\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*({units})\s*$"
        text = {"type": "string", "pattern": pattern, "examples": [EXAMPLES[self.dimension]]}
        if self.dimension != "length":
            return text if self.dimension != "angle" else {"anyOf": [{"const": 0}, text]}
        low, high = (float(show(bound * 1e3, "")) for bound in self.range)
        return {"anyOf": [{"type": "number", "minimum": low, "maximum": high, "description": "millimetres"}, text]}


@record
class Pair(Scalar):
    """Two lengths [x, y]. If `single` is True, a single length stands for both."""

    length: UnitValue
    single: bool = False

    def read(self, value: Any) -> tuple[float, float]:
        if isinstance(value, list):
            if len(value) != 2:
                refuse("SIT004", f"{describe(value)}, where [x, y] is wanted", "write two lengths, like [4, 8]")
            return self.length.read(value[0]), self.length.read(value[1])
        if not self.single:
            refuse("SIT004", f"{describe(value)}, where [x, y] is wanted", "write two lengths, like [-2, 0]")
        side = self.length.read(value)
        return side, side

    def schema(self) -> dict[str, Any]:
        length = self.length.schema()
        two = {"type": "array", "items": length, "minItems": 2, "maxItems": 2}
        return {"anyOf": [*length["anyOf"], two]} if self.single else two


@record
class Text(Scalar):
    """A text of limited length. It must match a pattern if there is one."""

    longest: int = 200
    pattern: str = ""
    like: str = ""

    def read(self, value: Any) -> str:
        if not isinstance(value, str):
            refuse("SIT004", f"{describe(value)} is no text", "put quotes around it" if self._fits(str(value)) else "")
        if len(value) > self.longest:
            message = f"{len(value)} characters are too many: at most {self.longest}"
            refuse("SIT006", message, "", measured=float(len(value)), limit=float(self.longest))
        if not self._fits(value):
            refuse("SIT006", f"{describe(value)} does not have the required form", self.like)
        return value

    def _fits(self, text: str) -> bool:
        return re.fullmatch(self.pattern, text) is not None if self.pattern else text.isprintable()

    def schema(self) -> dict[str, Any]:
        pattern = {"pattern": f"^{self.pattern}$"} if self.pattern else {}
        return {"type": "string", "maxLength": self.longest, **pattern}


@record
class FileName(Scalar):
    """The name of a file in the spec's folder, which must match the regular expression `ending`.

    For messages, `what` states the kind of file, and `like` is an example of its name.
    """

    what: str
    ending: str
    like: str

    def read(self, value: Any) -> str:
        name = Text(200).read(value)
        if not re.search(self.ending, name):
            hint = f"write the name of a file beside the spec, like {self.like}"
            refuse("SIT006", f"{describe(value)} is no name of a {self.what} file", hint)
        return name

    def schema(self) -> dict[str, Any]:
        return {"type": "string", "maxLength": 200, "pattern": self.ending, "examples": [self.like]}


@record
class Choice(Scalar):
    """One of several allowed words."""

    allowed: tuple[str, ...]

    def read(self, value: Any) -> str:
        if not isinstance(value, str):
            refuse("SIT004", f"{describe(value)} is no name", f"allowed: {', '.join(self.allowed)}")
        if value not in self.allowed:
            near = most_similar(value, self.allowed)
            facts = {"meant": near, "is_sure": is_misspelling(value, near)} if near else {}
            refuse("SIT007", f"{describe(value)} is not known here", did_you_mean_hint(value, self.allowed), **facts)
        return value

    def schema(self) -> dict[str, Any]:
        return {"type": "string", "enum": list(self.allowed)}


def did_you_mean_hint(word: Any, allowed: tuple[str, ...]) -> str:
    """Return the hint for a word that is not allowed.

    If the word is the start of several allowed words, such as ``ecoflex``, the hint lists these. Otherwise it suggests
    the nearest allowed word. All allowed words follow.
    """
    family = _family(word, allowed)
    if family:
        return f"{word} is a family: choose one of {', '.join(family)}; allowed: {', '.join(allowed)}"
    near = most_similar(word, allowed)
    suggestion = f"did you mean {near}? " if near else ""
    return f"{suggestion}allowed: {', '.join(allowed)}"


def most_similar(word: Any, allowed: tuple[str, ...]) -> str:
    """Return the allowed word that is most similar to a word, without regard to upper or lower case.

    Empty if no word is similar enough, or if the word is the start of several allowed words.
    """
    names = {name.lower(): name for name in allowed}
    close = [] if _family(word, allowed) else difflib.get_close_matches(str(word)[:64].lower(), names, 1, 0.5)
    return names[close[0]] if close else ""


def _family(word: Any, allowed: tuple[str, ...]) -> list[str]:
    members = [name for name in allowed if name.lower().startswith(f"{str(word)[:64].lower().rstrip('- ')}-")]
    return members if len(members) > 1 else []  # a family such as ``ecoflex``, which has several hardnesses


FOLDERS = {"stackup": "stackups", "rules": "fabricators", "connector": "connectors", "jaw": "jaws",
           "hole pattern": "hole_patterns"}
TABLES = {kind: f"{kind}s" for kind in ("conductor", "dielectric", "elastomer", "chip", "converter", "adhesive",
                                         "thermistor")}


@cache
def names(kind: str) -> tuple[str, ...]:
    """Return the names of all presets of a kind, sorted.

    The kinds are the keys of `FOLDERS` and `TABLES`, and ``file naming``.
    """
    if kind == "file naming":
        return tuple(sorted({row["naming"] for row in rows("archive_names")}))
    if kind in FOLDERS:
        ending = ".yaml" if kind == "rules" else ".csv"
        return tuple(sorted(path.stem for path in (FOLDER / FOLDERS[kind]).glob(f"*{ending}")))
    return tuple(sorted(row["name"] for row in rows(TABLES[kind])))


@record
class Preset(Scalar):
    """Name of a preset of one kind, one of `names(kind)`.

    If ``up`` (look up) is True, the value is the preset itself instead of its name.
    """

    kind: str
    up: bool = False

    def read(self, value: Any) -> Any:
        name = Choice(names(self.kind)).read(value)
        return getattr(import_module("sitscad.spec.presets"), self.kind.replace(" ", "_"))(name) if self.up else name

    def schema(self) -> dict[str, Any]:
        return Choice(names(self.kind)).schema()


def is_profile_file(name: Any) -> bool:
    """Whether the value of ``fpc.rules`` names a YAML file instead of a preset."""
    return isinstance(name, str) and name.lower().endswith((".yaml", ".yml"))


@record
class ProfileName(Scalar):
    """The name of a fabricator's design rules: a preset, or a file beside the spec, recognised by its ending.

    If `or_none` is True, the word none is allowed as well.
    """

    or_none: bool = False

    def read(self, value: Any) -> str:
        if is_profile_file(value):
            return str(Text(200).read(value))
        try:
            return self._choice.read(value)
        except Refusal as refusal:
            word = value if isinstance(value, str) and value.isidentifier() else "ourshop"
            hint = f"; or for your own profile, write the name of its file beside the spec, like {word}.yaml"
            raise refusal.with_hint(hint) from None

    def schema(self) -> dict[str, Any]:
        file = {"type": "string", "maxLength": 200, "pattern": r"\.[yY][aA]?[mM][lL]$", "examples": ["ourshop.yaml"]}
        return {"anyOf": [self._choice.schema(), file]}

    @property
    def _choice(self) -> Choice:
        return Choice((*names("rules"), "none") if self.or_none else names("rules"))


@record
class Figure:
    """A value of a profile, its source, and whether somebody has seen the source.

    An empty source stands for the source of the whole profile.
    """

    value: Any
    source: str = ""
    is_verified: bool = True


_SOURCE, _STATUS = Text(500), Choice(("verified", "unverified"))


@record
class Sourced(Scalar):
    """A value, or a section with value, source and status (verified or unverified). Read as a `Figure`."""

    figure: Scalar

    def read(self, value: Any) -> Figure:
        if not isinstance(value, dict):
            return Figure(self.figure.read(value))
        keys = ("value", "source", "status")
        unknown = [name for name in value if name not in keys]
        if unknown:
            refuse("SIT002", f"{describe(unknown[0])} is no key of a figure", did_you_mean_hint(unknown[0], keys))
        if "value" not in value:
            refuse("SIT003", "the figure has no value", "write {value: 80 um, source: their page}")
        status = _STATUS.read(value.get("status", "verified"))
        return Figure(self.figure.read(value["value"]), _SOURCE.read(value.get("source", "")), status == "verified")

    def schema(self) -> dict[str, Any]:
        inner = self.figure.schema()
        named = {"type": "object", "additionalProperties": False, "required": ["value"],
                 "properties": {"value": inner, "source": _SOURCE.schema(), "status": _STATUS.schema()}}
        return {"anyOf": [*inner.get("anyOf", [inner]), named]}


# Kinds that several sections share.
Label = Text(64)
Size = UnitValue("length", "0.1 mm", "500 mm")
Thickness = UnitValue("length", "1 um", "100 mm")
Gap = UnitValue("length", "0 mm", "100 mm")
Kerf = UnitValue("length", "0 mm", "2 mm")
RunLength = UnitValue("length", "1 mm", "5000 mm")
Offset = UnitValue("length", "-500 mm", "500 mm")
Angle = UnitValue("angle", "-360 deg", "360 deg")
Rate = UnitValue("frequency", "0.01 Hz", "1 MHz")
InRow = Number(1, 64, whole=True)
PAIR_OF_COUNTS = {"type": "array", "items": InRow.schema(), "minItems": 2, "maxItems": 2}
