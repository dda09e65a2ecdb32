"""The designs of a study: a base spec, the changes that make a design of it, and the keys that vary, each over values
that are counted, so that two designs are equal or are not.
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
from sitscad.checks.opening import opened, policy_for
from sitscad.data import PACKAGE
from sitscad.spec.load import load_text, load_values, meet, put, rewritten_spec
from sitscad.spec.profiles import FILES
from sitscad.spec.reading import SpecError, finding_from_text
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import TextError, read_yaml

Changes = tuple[tuple[str, Any], ...]
"""Dotted keys of a spec and the plain values that they take, in their order."""

IGNORES = "# sitscad:"


@record(eq=False)
class Base:
    """A spec by its text and path, and the folder of profiles that its configuration names: small enough to be sent to
    other processes, which read it anew.
    """

    text: str
    path: str
    profiles: str | None = None

    @classmethod
    def of(cls, spec: SensorSpec) -> Base:
        """The base of a spec as it was read."""
        return cls(spec.source.text, spec.source.path, policy_for(spec.source.path).profiles)

    @classmethod
    def opened(cls, path: str) -> Base:
        """The base of a file; raises `SpecError` where it is none."""
        policy = policy_for(path)
        return cls(opened(path, policy).source.text, path, policy.profiles)

    def __reduce__(self) -> tuple[Any, ...]:
        return _read_once, (self.text, self.path, self.profiles)

    @cached_property
    def spec(self) -> SensorSpec:
        """The spec as it was read."""
        return load_text(self.text, self.path, self.profiles)

    @cached_property
    def _data(self) -> bytes:  # a tenth of the time of copying it deeply
        return pickle.dumps(dict(read_yaml(self.text.removeprefix("\ufeff")).data))

    def values(self, changes: Changes) -> dict[str, Any]:
        """The plain values of a design; raises `SpecError` where the spec has no place for one."""
        data: dict[str, Any] = pickle.loads(self._data)
        try:
            for key, value in changes:
                put(data, key, value)
        except TextError as error:
            raise SpecError((finding_from_text(error),)) from None
        return data

    def design(self, changes: Changes) -> SensorSpec:
        """The spec of a design: its values, and this spec's text as their source; raises `SpecError`."""
        return load_values(self.values(changes), self.spec.source, self.profiles)

    def written(self, changes: Changes) -> str:
        """The text of a design, comments kept; raises `SpecError`."""
        return rewritten_spec(self.spec, changes).source.text

    def key(self, changes: Changes, level: str, *asked: Any) -> str:
        """The hash that a design's evaluation is kept under: of its values, of all that it is judged by, of the
        program, of the level and of what else was `asked`.
        """
        try:
            values: Any = self.values(changes)
        except SpecError:
            values = [list(change) for change in changes]
        judged_by = [*self._judged_by, self._own_files(changes, values)]
        said = json.dumps([judged_by, level, values, *asked], sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(said.encode("utf-8", "surrogatepass")).hexdigest()[:32]

    @cached_property
    def _judged_by(self) -> list[Any]:
        """Program, rules, configuration, comments that silence rules, and files that the spec names."""
        files = _hashes(self.spec.source.files)
        comments = [line.strip() for line in self.text.splitlines() if IGNORES in line]
        policy = policy_for(self.path).as_json()
        return [code_version(), [rule.id for rule in all_rules()], policy, comments, files]

    def _own_files(self, changes: Changes, values: Any) -> dict[str, str] | list[str]:
        """Files of a design that names others than the spec does; where it is refused, what for: a file that is written
        anew may lift that.
        """
        if self.spec.source.files.keys() >= set(_FILE.findall(json.dumps(values, ensure_ascii=False))):
            return {}
        try:
            return _hashes(self.design(changes).source.files)
        except SpecError as error:
            return [f"{one.rule} {one.message}" for one in error.findings]


_FILE = re.compile(rf'"([^"]*(?:{"|".join(map(re.escape, chain(*FILES.values())))}))"', re.IGNORECASE)
"""What may be a file among values as JSON."""


def _hashes(files: Mapping[str, bytes]) -> dict[str, str]:
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


@lru_cache(maxsize=4)
def _read_once(text: str, path: str, profiles: str | None) -> Base:
    """A base in another process, which keeps what it worked out of it for the next chunk."""
    return Base(text, path, profiles)


def require_key(base: Base, key: str, values: Sequence[Any]) -> None:
    """Raise the `SpecError` of a key that the spec has not, or of a value that can be none of its. Values that do not
    fit others refuse single designs, and not a sweep.
    """
    looked_at = values
    if len(values) > MANY_VALUES:
        infinite = (value for value in values[1:-1] if re.search("NaN|Infinity", json.dumps(value)))
        looked_at = (values[0], *infinite, values[-1])
    for value in looked_at:
        try:
            base.design(((key, value),))
        except SpecError as error:
            if any(one.rule in UNFIT for one in error.findings):
                raise


MANY_VALUES = 100
"""Values of a key from which on only its ends, and what is no number, are read before anything is computed."""

UNFIT = ("SIT002", "SIT004", "SIT005", "SIT006", "SIT007")
"""Rules of the spec that say that a key is none, or that a value can be none of its: no other key changes that."""


@cache
def code_version() -> str:
    """The version of this program, with a hash of its modules and tables: an evaluation is kept for these alone."""
    root, found = PACKAGE, hashlib.sha256()
    for path in sorted(_code(root)):
        found.update(path.relative_to(root).as_posix().encode())
        found.update(path.read_bytes())
    return f"{__version__}+{found.hexdigest()[:16]}"


OF_NO_JUDGEMENT = {"apps", "calibration", "cli", "files", "templates"}
"""Wings that no verdict and no figure of a design comes from, but for this room's modules that are not `SEARCHING`."""

SEARCHING = {"answer.py", "answer_text.py", "document.py", "page.py", "running.py", "study.py", "sweeping.py",
             "__init__.py"}
"""The modules of this room that none comes from, either."""


def _code(root: Path) -> Iterable[Path]:
    for path in root.rglob("*"):
        parts = path.relative_to(root).parts
        judges = parts[0] not in OF_NO_JUDGEMENT or (parts[:2] == ("apps", "study") and parts[-1] not in SEARCHING)
        if path.is_file() and "__pycache__" not in parts and judges:
            yield path


MOST_VALUES = 100_000
"""Values of one key at most."""

STEPS = 50
"""Into how many steps at least a range without a step is divided: of one, two or five in their last figure."""

Point = tuple[int, ...]
"""A design by the numbers of its variables' values, from 0."""

_WRITTEN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*")


class RangeError(ValueError):
    """A range that cannot be read; the text says why, and `hint` what to write."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@record
class Variable:
    """One key, the values that it may have as a spec has them, and whether they follow each other as numbers do."""

    key: str
    values: tuple[Any, ...]
    is_ordered: bool = True

    def nearest(self, value: Any) -> int:
        """The number of the value that lies nearest to one of a spec; 0 where they cannot be compared."""
        return min(range(len(self.values)), key=lambda k: apart(self.values[k], value))


def at_key(data: Any, key: str) -> Any:
    """The plain value under a dotted key, of a list by its entry's number; None where there is none."""
    for name in key.split("."):
        inner = {str(k): entry for k, entry in enumerate(data)} if isinstance(data, list) else data
        data = inner.get(name) if isinstance(inner, dict) else None
    return data


def apart(one: Any, other: Any) -> Decimal:
    """How far two values of a key lie apart, whatever unit each is written in: 0 where they are the same, without end
    where they cannot be compared.
    """
    if one == other:
        return Decimal(0)
    try:
        return abs(_size(one) - _size(other))
    except RangeError:
        return Decimal("Infinity")


def same_value(value: Any) -> Hashable:
    """What values have in common that say the same, whatever unit each is written in."""
    if isinstance(value, list):
        return tuple(map(same_value, value))
    try:
        return _size(value)
    except RangeError:
        return str(value)


def _size(value: Any) -> Decimal:
    """A quantity in SI; a bare number is taken for millimetres, as beside lengths it is."""
    number, unit = _number(value)
    return number * (_FACTORS.get(unit, Decimal(1)) if unit else Decimal("0.001"))


_FACTORS = {name: factor for units in UNITS.values() for name, factor in units.items()}


def stepped(low: Any, high: Any, step: Any = None) -> tuple[Any, ...]:
    """Values from one to another, both as a spec has them; a step that is not given is a round one. The last value is
    the last step's within the range, and the range's end where no step was given.
    """
    (first, unit), (last, _) = _pair(low, high)
    if step is None:
        most = (last - first) / STEPS  # of 1, 2 and 5 in its only figure the largest that is no more
        power = Decimal(1).scaleb(most.adjusted())
        by = next(figure * power for figure in (5, 2, 1) if figure * power <= most)
    else:
        by, other = _number(step)
        if other != unit:
            raise RangeError(f"the step {step} has another unit than {low}", "write all three with one unit")
        if by <= 0:
            raise RangeError(f"the step {step} is not above nothing")
    count = int((last - first) / by) + 1
    if count > MOST_VALUES:
        raise RangeError(f"{count} values from {low} to {high}; {MOST_VALUES} are the most", "a larger step")
    found = [first + k * by for k in range(count)]
    if step is None and found[-1] != last:
        found.append(last)
    return tuple(_written(value, unit) for value in found)


def counted(low: Any, high: Any, count: int) -> tuple[Any, ...]:
    """So many values from one to another, evenly, written with twelve figures at most."""
    (first, unit), (last, _) = _pair(low, high, may_fall=True)
    if not 1 <= count <= MOST_VALUES:
        raise RangeError(f"a count from 1 to {MOST_VALUES} is wanted, not {count}")
    by = (last - first) / max(count - 1, 1)
    return tuple(_written(Decimal(f"{first + k * by:.12g}"), unit) for k in range(count))


def _pair(low: Any, high: Any, may_fall: bool = False) -> tuple[tuple[Decimal, str], tuple[Decimal, str]]:
    """Both ends of a range, of one unit."""
    one, other = _number(low), _number(high)
    if one[1] != other[1]:
        raise RangeError(f"{low} and {high} have different units", "write both with one unit, like 75 um and 125 um")
    if not may_fall and one[0] >= other[0]:
        if one[0] == other[0]:
            raise RangeError(f"the range from {low} to {high} is empty",
                             f"two values that differ, or a list of one: [{low}]")
        raise RangeError(f"the range from {low} to {high} is reversed", "write the smaller value first")
    return one, other


def _number(value: Any) -> tuple[Decimal, str]:
    found = None if isinstance(value, bool) else _WRITTEN.fullmatch(str(value))
    if found is None or not math.isfinite(float(found[1])):
        raise RangeError(f"{value!r} is no number", "a number, with its unit where a spec has one, like 75 um")
    return Decimal(found[1]), found[2]


def _written(value: Decimal, unit: str) -> Any:
    """A number as a spec has it: whole where it is."""
    plain = int(value) if value == value.to_integral_value() else float(value)
    return f"{plain} {unit}" if unit else plain


@record
class Space:
    """Variables, keys that always take the value of a variable's key (`same`: key to key), and what a value brings
    along (`brought`: by key, value as text, other keys and values).
    """

    variables: tuple[Variable, ...]
    same: Mapping[str, str]
    brought: Mapping[str, Mapping[str, Mapping[str, Any]]]

    def moves(self, keys: Iterable[str]) -> bool:
        """Whether any of these keys, or a part of one, is another one in some designs."""
        moved = [variable.key for variable in self.variables] + list(self.same)
        moved += [key for choices in self.brought.values() for brings in choices.values() for key in brings]
        return any(meet(one, key) for one in moved for key in keys)

    @property
    def shape(self) -> tuple[int, ...]:
        """How many values each variable has."""
        return tuple(len(variable.values) for variable in self.variables)

    @property
    def size(self) -> int:
        """How many designs there are."""
        return math.prod(self.shape)

    def chosen(self, point: Point) -> dict[str, Any]:
        """The values of the variables at a point."""
        return {v.key: v.values[k] for v, k in zip(self.variables, point, strict=True)}

    def changes(self, point: Point) -> Changes:
        """All keys that change with a point, and their values."""
        chosen = self.chosen(point)
        found = dict(chosen)
        found |= {key: chosen[other] for key, other in self.same.items()}
        for key, value in chosen.items():
            found |= self.brought.get(key, {}).get(str(value), {})
        return tuple(found.items())

    def nearest(self, values: Mapping[str, Any]) -> Point:
        """The point nearest to a spec of these plain values, key by key."""
        return tuple(variable.nearest(at_key(values, variable.key)) for variable in self.variables)

    def points(self) -> Iterator[Point]:
        """All points, the last variable fastest."""
        return product(*(range(count) for count in self.shape))
