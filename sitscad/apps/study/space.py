"""The possible designs of a study: a base spec, varied keys, and the changes of the spec that make a design.

Each varied key has a list of values, so two designs are either equal or different.
"""

from __future__ import annotations

import hashlib
import json
import math
import pickle
import re
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from functools import cache, cached_property, lru_cache
from itertools import chain, product
from pathlib import Path
from typing import Any

from sitscad.basics.record import record
from sitscad.basics.units import UNITS
from sitscad.basics.version import __version__
from sitscad.checks.judging import all_rules
from sitscad.checks.opening import nearest_policy_of_spec, open_spec
from sitscad.data import PACKAGE
from sitscad.spec.load import is_overlapping, load_text, load_values, put_value, rewritten_spec
from sitscad.spec.profiles import FILES
from sitscad.spec.reading import SpecError, finding_from_text
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import SpecSource, TextError, read_yaml

Changes = tuple[tuple[str, Any], ...]
"""Changes of a spec: (dotted key, value) in order."""

IGNORES = "# sitscad:"


@record(eq=False)
class Base:
    """A base spec by its text and path, with the folder of profiles from its configuration.

    It is small enough to be sent to other processes, which read the spec again.
    """

    text: str
    path: str
    profiles: str | None = None

    @classmethod
    def from_source(cls, source: SpecSource) -> Base:
        """Return the base of a loaded spec, from its source."""
        return cls(source.text, source.path, nearest_policy_of_spec(source.path).profiles)

    @classmethod
    def from_file(cls, path: str) -> Base:
        """Return the base of a spec file. Raises `SpecError` if the file is not a valid spec."""
        policy = nearest_policy_of_spec(path)
        return cls(open_spec(path, policy).source.text, path, policy.profiles)

    def __reduce__(self) -> tuple[Any, ...]:
        return _cached_base, (self.text, self.path, self.profiles)

    @cached_property
    def spec(self) -> SensorSpec:
        """The loaded spec."""
        return load_text(self.text, self.path, self.profiles)

    @cached_property
    def _data(self) -> bytes:  # takes a tenth of the time of a deep copy
        return pickle.dumps(dict(read_yaml(self.text.removeprefix("\ufeff")).data))

    def changed_values(self, changes: Changes) -> dict[str, Any]:
        """Return the spec's values with changes applied. Raises `SpecError` if the spec has no place for a key."""
        data: dict[str, Any] = pickle.loads(self._data)
        try:
            for key, value in changes:
                put_value(data, key, value)
        except TextError as error:
            raise SpecError((finding_from_text(error),)) from None
        return data

    def changed_spec(self, changes: Changes) -> SensorSpec:
        """Return the spec of a design, with this spec's text as its source. Raises `SpecError`."""
        return load_values(self.changed_values(changes), self.spec.source, self.profiles)

    def spec_text(self, changes: Changes) -> str:
        """Return the text of a design's spec, with the base's comments. Raises `SpecError`."""
        return rewritten_spec(self.spec, changes).source.text

    def key(self, changes: Changes, level: str, *parameters: Any) -> str:
        """Return the hash under which a design's evaluation is stored.

        It depends on the design's values, on everything else that affects the evaluation, on sitscad's code, on the
        level, and on `parameters`.
        """
        try:
            values: Any = self.changed_values(changes)
        except SpecError:
            values = [list(change) for change in changes]
        judged_by = [*self._evaluation_inputs, self._named_file_hashes(changes, values)]
        text = json.dumps([judged_by, level, values, *parameters], sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:32]

    @cached_property
    def _evaluation_inputs(self) -> list[Any]:
        """Code version, rules, configuration, comments that suppress rules, and hashes of files that the spec names."""
        files = _hashes(self.spec.source.files)
        comments = [line.strip() for line in self.text.splitlines() if IGNORES in line]
        policy = nearest_policy_of_spec(self.path).as_json()
        return [code_version(), [rule.id for rule in all_rules()], policy, comments, files]

    def _named_file_hashes(self, changes: Changes, values: Any) -> dict[str, str] | list[str]:
        """Return hashes, by path, of a design's files. Empty if the design names no file that the base does not name.

        If the changed design is invalid, return its errors. A changed file may remove them, so the errors are part of
        the key under which the evaluation is stored.
        """
        if self.spec.source.files.keys() >= set(_FILE.findall(json.dumps(values, ensure_ascii=False))):
            return {}
        try:
            return _hashes(self.changed_spec(changes).source.files)
        except SpecError as error:
            return [f"{each.rule} {each.message}" for each in error.findings]


_FILE = re.compile(rf'"([^"]*(?:{"|".join(map(re.escape, chain(*FILES.values())))}))"', re.IGNORECASE)
"""Pattern of texts in JSON values that may be file names."""


def _hashes(files: Mapping[str, bytes]) -> dict[str, str]:
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


@lru_cache(maxsize=4)
def _cached_base(text: str, path: str, profiles: str | None) -> Base:
    """Return the spec that the study varies. A worker process reads it once and keeps it for further designs."""
    return Base(text, path, profiles)


def require_key(base: Base, key: str, values: Sequence[Any]) -> None:
    """Raise `SpecError` if the spec does not have the key, or if a value is invalid for the key by itself.

    A value that conflicts with other keys is accepted. Only the designs with this conflict are then invalid.
    """
    looked_at = values
    if len(values) > MANY_VALUES:
        infinite = (value for value in values[1:-1] if re.search("NaN|Infinity", json.dumps(value)))
        looked_at = (values[0], *infinite, values[-1])
    for value in looked_at:
        try:
            base.changed_spec(((key, value),))
        except SpecError as error:
            if any(each.rule in UNREADABLE_KEY_RULES for each in error.findings):
                raise


MANY_VALUES = 100
"""Number of values above which only some are checked in advance.

These are the first, the last, and values that are not finite numbers.
"""

UNREADABLE_KEY_RULES = ("SIT002", "SIT004", "SIT005", "SIT006", "SIT007")
"""Rules on unknown keys and impossible values. Values of other keys cannot remove their findings."""


@cache
def code_version() -> str:
    """Return the version of sitscad with a hash of its modules and tables.

    Stored evaluations are valid for one such version only.
    """
    root, digest = PACKAGE, hashlib.sha256()
    for path in sorted(_code(root)):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:16]}"


OF_NO_JUDGEMENT = {"apps", "calibration", "cli", "files", "templates"}
"""Folders of the package that do not affect the evaluation of a design.

In this folder, only the modules in `SEARCHING` do not affect it.
"""

SEARCHING = {"answer.py", "answer_text.py", "document.py", "page.py", "running.py", "study.py", "sweeping.py",
             "__init__.py"}
"""Modules of this folder that do not affect the evaluation of a design."""


def _code(root: Path) -> Iterable[Path]:
    for path in root.rglob("*"):
        parts = path.relative_to(root).parts
        judges = parts[0] not in OF_NO_JUDGEMENT or (parts[:2] == ("apps", "study") and parts[-1] not in SEARCHING)
        if path.is_file() and "__pycache__" not in parts and judges:
            yield path


MOST_VALUES = 100_000
"""Largest number of values of one key."""

STEPS = 50
"""Least number of steps of a range without a stated step. The default step is 1, 2 or 5 times a power of ten."""

Point = tuple[int, ...]
"""A design: for each varied key, the number (from 0) of its value in the key's list of values."""

_WRITTEN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*")


class RangeError(ValueError):
    """Raised for a range that cannot be read. The text gives the reason, and `hint` the right form."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@record
class Variable:
    """A varied key of the spec.

    `values` are its possible values, as in a spec. `is_ordered` is True if they are ordered as numbers.
    """

    key: str
    values: tuple[Any, ...]
    is_ordered: bool = True

    def nearest(self, value: Any) -> int:
        """Return the number of the value nearest to a value of a spec. 0 if they cannot be compared."""
        return min(range(len(self.values)), key=lambda k: value_difference(self.values[k], value))


def value_at_key(data: Any, key: str) -> Any:
    """Return the value under a dotted key. Elements of lists have numbers as keys. None if there is none."""
    for name in key.split("."):
        inner = {str(k): entry for k, entry in enumerate(data)} if isinstance(data, list) else data
        data = inner.get(name) if isinstance(inner, dict) else None
    return data


def value_difference(value: Any, other: Any) -> Decimal:
    """Return the difference of two values in any units: 0 if they are equal, infinite if they cannot be compared."""
    if value == other:
        return Decimal(0)
    try:
        return abs(_si_value(value) - _si_value(other))
    except RangeError:
        return Decimal("Infinity")


def comparable_value(value: Any) -> Hashable:
    """Return a hashable value that is the same for equal quantities in different units."""
    if isinstance(value, list):
        return tuple(map(comparable_value, value))
    try:
        return _si_value(value)
    except RangeError:
        return str(value)


def _si_value(value: Any) -> Decimal:
    """Return a quantity in SI units. A number without a unit is in millimetres, because it is compared with lengths."""
    number, unit = _number_and_unit(value)
    return number * (_FACTORS.get(unit, Decimal(1)) if unit else Decimal("0.001"))


_FACTORS = {name: factor for units in UNITS.values() for name, factor in units.items()}


def values_by_step(low: Any, high: Any, step: Any = None) -> tuple[Any, ...]:
    """Return values from `low` to `high` in steps, as in a spec. The default step is a round number.

    The last value is the last step within the range. Without a stated step, the end of the range is added.
    """
    (first, unit), (last, _) = _range_ends(low, high)
    if step is None:
        most = (last - first) / STEPS  # the largest step with the only digit 1, 2 or 5 up to this
        power = Decimal(1).scaleb(most.adjusted())
        by = next(figure * power for figure in (5, 2, 1) if figure * power <= most)
    else:
        by, other = _number_and_unit(step)
        if other != unit:
            raise RangeError(f"the step {step} has another unit than {low}", "write all three with one unit")
        if by <= 0:
            raise RangeError(f"the step {step} is not above nothing")
    count = int((last - first) / by) + 1
    if count > MOST_VALUES:
        raise RangeError(f"{count} values from {low} to {high}; {MOST_VALUES} are the most", "a larger step")
    values = [first + k * by for k in range(count)]
    if step is None and values[-1] != last:
        values.append(last)
    return tuple(_value_in_spec(value, unit) for value in values)


def values_by_count(low: Any, high: Any, count: int) -> tuple[Any, ...]:
    """Return `count` equally spaced values from `low` to `high`, with at most twelve digits."""
    (first, unit), (last, _) = _range_ends(low, high, may_fall=True)
    if not 1 <= count <= MOST_VALUES:
        raise RangeError(f"a count from 1 to {MOST_VALUES} is wanted, not {count}")
    by = (last - first) / max(count - 1, 1)
    return tuple(_value_in_spec(Decimal(f"{first + k * by:.12g}"), unit) for k in range(count))


def _range_ends(low: Any, high: Any, may_fall: bool = False) -> tuple[tuple[Decimal, str], tuple[Decimal, str]]:
    """Return both ends of a range as (number, unit), with equal units."""
    bottom, top = _number_and_unit(low), _number_and_unit(high)
    if bottom[1] != top[1]:
        raise RangeError(f"{low} and {high} have different units", "write both with one unit, like 75 um and 125 um")
    if not may_fall and bottom[0] >= top[0]:
        if bottom[0] == top[0]:
            raise RangeError(f"the range from {low} to {high} is empty",
                             f"two values that differ, or a list of one: [{low}]")
        raise RangeError(f"the range from {low} to {high} is reversed", "write the smaller value first")
    return bottom, top


def _number_and_unit(value: Any) -> tuple[Decimal, str]:
    match = None if isinstance(value, bool) else _WRITTEN.fullmatch(str(value))
    if match is None or not math.isfinite(float(match[1])):
        raise RangeError(f"{value!r} is no number", "a number, with its unit where a spec has one, like 75 um")
    return Decimal(match[1]), match[2]


def _value_in_spec(value: Decimal, unit: str) -> Any:
    """Return a number as in a spec: an integer if it is whole, with its unit if there is one."""
    plain = int(value) if value == value.to_integral_value() else float(value)
    return f"{plain} {unit}" if unit else plain


@record
class Space:
    """The possible designs of a study: all combinations of the values of the varied keys (``variables``).

    ``linked`` maps further keys to the varied key whose value they take. ``implied`` maps a varied key and the text of
    its value to further keys and their values.
    """

    variables: tuple[Variable, ...]
    linked: Mapping[str, str]
    implied: Mapping[str, Mapping[str, Mapping[str, Any]]]

    def is_varied(self, keys: Iterable[str]) -> bool:
        """Whether one of these keys is varied, is inside a varied section, or contains a varied key."""
        moved = [variable.key for variable in self.variables] + list(self.linked)
        moved += [key for choices in self.implied.values() for brings in choices.values() for key in brings]
        return any(is_overlapping(each, key) for each in moved for key in keys)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each varied key."""
        return tuple(len(variable.values) for variable in self.variables)

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)

    def varied_values(self, point: Point) -> dict[str, Any]:
        """Return the values of the varied keys at a point."""
        return {v.key: v.values[k] for v, k in zip(self.variables, point, strict=True)}

    def changes(self, point: Point) -> Changes:
        """Return all changes of the spec at a point, including linked and implied keys."""
        chosen = self.varied_values(point)
        changed = dict(chosen)
        changed |= {key: chosen[other] for key, other in self.linked.items()}
        for key, value in chosen.items():
            changed |= self.implied.get(key, {}).get(str(value), {})
        return tuple(changed.items())

    def nearest(self, values: Mapping[str, Any]) -> Point:
        """Return the point nearest to a spec with these values, key by key."""
        return tuple(variable.nearest(value_at_key(values, variable.key)) for variable in self.variables)

    def points(self) -> Iterator[Point]:
        """Return all points. The number of the last key changes fastest."""
        return product(*(range(count) for count in self.shape))
