"""Checks of a spec whose values were set by a program and not read from a text.

Values must have the types of their fields and lie within the ranges of their keys. The turns, size and neighbours of a
coil are checked in the same way as in a text. A spec that was read from a text is valid and skips these checks.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from types import UnionType
from typing import Any, Union, cast, get_args, get_origin, get_type_hints

from sitscad.basics.units import show
from sitscad.spec.design_rules import DesignRules, RulesDocument
from sitscad.spec.format import kinds
from sitscad.spec.format.kinds import (
    Either,
    Kind,
    Layers,
    NumberOrList,
    Pair,
    Refusal,
    Scalar,
    Sourced,
    UnitValue,
    describe,
)
from sitscad.spec.format.section import Key, Section
from sitscad.spec.reading import Flaw, Remarks, SpecError, finding_from_flaw
from sitscad.spec.resolver.coils import (
    MOST_COILS,
    check_cells,
    check_coil,
    check_gaps,
    check_layers,
    check_reference,
    check_total_turns,
    reference_coil_key,
)
from sitscad.spec.sensor import SensorSpec, SpecDocument
from sitscad.spec.yaml.source import Issue, SpecSource, dotted

DOCUMENTS: dict[type, type[Section]] = {SensorSpec: SpecDocument, Issue: SpecDocument, DesignRules: RulesDocument}
"""For a class of resolved values: the section class that declares its YAML keys.

Classes that declare their own keys are not listed.
"""

FARTHEST = 1.0
"""Largest distance (m) of a coil's centre from the origin, along x or y."""


def refuse_unusable(spec: SensorSpec) -> None:
    """Raise `SpecError` with a finding for each invalid value.

    A spec that no program has changed since it was read is accepted without checks.
    """
    if not isinstance(spec, SensorSpec):
        raise TypeError(f"a SensorSpec is wanted, not {describe(spec)}")
    if spec.is_known:
        return
    for look in (lambda each: _type_flaws(each, SensorSpec, ""), _range_flaws, _conflicts):
        flaws = list(look(spec))
        if flaws:
            source = spec.source if isinstance(spec.source, SpecSource) else SpecSource("<values>", "")
            raise SpecError(tuple(finding_from_flaw(flaw, source) for flaw in flaws))


def _type_flaws(value: Any, expected: Any, key: str) -> Iterator[Flaw]:
    """Yield a flaw for each wrong type of `value` or of values inside it.

    `expected` is the type in the annotation of the field, and `key` the dotted key of `value`.
    """
    if is_dataclass(expected) and isinstance(expected, type):
        if type(value) is not expected:
            yield _type_flaw(value, expected, key)
        elif expected is not SpecSource:
            hints = _hints(cast(Hashable, expected))
            for member in fields(expected):
                yield from _type_flaws(getattr(value, member.name), hints[member.name], dotted(key, member.name))
        return
    origin, inner = get_origin(expected), get_args(expected)
    if origin in (Union, UnionType):
        by_type = [list(_type_flaws(value, each, key)) for each in inner]
        if all(by_type):  # report the nearest type: only values inside have the wrong type
            inside = [flaws for flaws in by_type if all(flaw.key != key for flaw in flaws)]
            yield from inside[0] if inside else [_type_flaw(value, expected, key)]
    elif origin is tuple:
        yield from _tuple_type_flaws(value, inner, key)
    elif origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            yield _type_flaw(value, expected, key)
            return
        for name, each in value.items():
            yield from _type_flaws(name, inner[0], key)
            yield from _type_flaws(each, inner[1], dotted(key, name))
    elif not _is_scalar(value, expected):
        yield _type_flaw(value, expected, key)


def _tuple_type_flaws(value: Any, inner: tuple[Any, ...], key: str) -> Iterator[Flaw]:
    many = len(inner) == 2 and inner[1] is Ellipsis
    if not isinstance(value, tuple) or (not many and len(value) != len(inner)):
        yield _type_flaw(value, tuple[inner], key)  # type: ignore[valid-type]
        return
    for index, each in enumerate(value):
        yield from _type_flaws(each, inner[0] if many else inner[index], dotted(key, index))


def _is_scalar(value: Any, expected: Any) -> bool:
    """Whether a single value has the type `expected`.

    An integer counts as a float. A float must be finite, and its magnitude below 1e30.
    """
    if expected is float:  # whole numbers may be too large for a float; comparisons with NaN are False
        return isinstance(value, (int, float)) and not isinstance(value, bool) and -1e30 < value < 1e30
    if expected is int:
        return isinstance(value, int) and not isinstance(value, bool)
    return isinstance(value, expected)


def _type_flaw(value: Any, expected: Any, key: str) -> Flaw:
    name = expected.__name__ if isinstance(expected, type) and get_origin(expected) is None else str(expected)
    name = re.sub(r"\bsitscad\.[a-z_.]+\.", "", name).replace("float", "finite number")
    return Flaw("SIT004", key, f"{describe(value)}, where {name} is wanted", "values are in SI units: metres, radians")


_hints = cache(get_type_hints)


def _range_flaws(spec: SensorSpec) -> Iterator[Flaw]:
    """Yield a flaw for each value outside its allowed range, and for too many or too distant coils.

    The format of the spec declares the ranges. Layers of the stack-up must have a thickness from 1 um to 5 mm.
    """
    yield from _out_of_range_flaws(spec, "")
    for index, layer in enumerate(spec.fpc.stackup.layers):
        yield from _refusal_flaws(layer.thickness, _LAYER, f"fpc.stackup.layers.{index}.thickness")
    if not 1 <= len(spec.array.placements) <= MOST_COILS:
        yield Flaw("SIT006", "array.placements", f"{len(spec.array.placements)} coils, where 1 to {MOST_COILS} can be")
    for index, place in enumerate(spec.array.placements):
        if max(map(abs, place.centre)) > FARTHEST:
            message = f"farther than {show(FARTHEST, 'm')} from the origin"
            yield Flaw("SIT006", f"array.placements.{index}.centre", message)


_LAYER = UnitValue("length", "1 um", "5 mm")


def _out_of_range_flaws(value: Any, key: str) -> Iterator[Flaw]:
    """Yield a flaw if `value`, or a value inside it, is outside the range that its key allows.

    `key` is the dotted key of `value`.
    """
    section = type(value) if isinstance(value, Section) else DOCUMENTS.get(type(value))
    keys: dict[str, Key] = {}
    if section is not None:
        keys = {section.attributes[name]: each for name, each in section.keys.items()}
    for member in fields(value):
        inside, inner = getattr(value, member.name), dotted(key, member.name)
        if inside is None or (isinstance(inside, str) and inside == member.default):
            continue  # a spec without this key has the same value
        if member.name in keys:
            yield from _refusal_flaws(inside, keys[member.name].kind, inner)
        elif is_dataclass(inside) and not isinstance(inside, SpecSource):
            yield from _out_of_range_flaws(inside, inner)


def _refusal_flaws(value: Any, kind: Kind, key: str) -> Iterator[Flaw]:
    if is_dataclass(value):
        yield from _out_of_range_flaws(value, key)
        return
    while isinstance(kind, (Either, Sourced)):
        kind = kind.other if isinstance(kind, Either) else kind.figure
    if isinstance(kind, (Pair, NumberOrList)):
        each = kind.length if isinstance(kind, Pair) else kind.number
        for entry in value if isinstance(value, tuple) else (value,):
            yield from _refusal_flaws(entry, each, key)
    elif isinstance(kind, UnitValue):
        low, high = kind.range
        if not low * (1 - 1e-12) <= value <= high * (1 + 1e-12):
            message = f"{value:g} is out of range: {low:g} to {high:g} ({kind.low} to {kind.high})"
            yield Flaw("SIT006", key, message, "values are in SI units: metres, radians")
    elif isinstance(kind, Scalar) and type(kind) in (kinds.Choice, kinds.Text, kinds.Number, Layers):
        try:
            kind.read(list(value) if isinstance(kind, Layers) else value)
        except Refusal as refusal:
            yield Flaw(refusal.rule, key, refusal.message, refusal.hint)


def _conflicts(spec: SensorSpec) -> Iterator[Flaw]:
    """Yield a flaw for each conflict between coils, stack-up and cells.

    The checks are: copper layers, numbers of turns, sizes, gaps between coils, and equal cells.
    """
    remarks, copper = Remarks(), len(spec.fpc.stackup.copper)
    if spec.coil.has_unequal_turns and len(spec.coil.layer_turns) != len(spec.coil.layers):
        message = f"{len(spec.coil.layer_turns)} numbers of turns for {len(spec.coil.layers)} layers"
        yield Flaw("SIT009", "coil.turns", message, "write one number for each layer, or one for all")
        return
    if max(spec.coil.layers) > copper:
        message = f"the coil uses copper layer {max(spec.coil.layers)}, stack-up {spec.fpc.stackup.name} has {copper}"
        yield Flaw("SIT009", "coil.layers", message, "use fewer layers, or a stack-up with more copper")
    check_coil(spec.coil, remarks)
    own = spec.reference_coil
    if own is not spec.coil:
        inside = Remarks()
        if own.has_unequal_turns and len(own.layer_turns) != len(own.layers):
            message = f"{len(own.layer_turns)} numbers of turns for {len(own.layers)} layers"
            inside.flaw("SIT009", "coil.turns", message, "write one number for each layer, or one for all")
        check_layers(own, copper, inside)
        check_coil(own, inside)
        check_total_turns(own, 1, inside)
        remarks.flaws += [replace(flaw, key=reference_coil_key(flaw.key)) for flaw in inside.flaws]
    check_total_turns(spec.coil, len(spec.all_placements), remarks)
    if spec.cells is not None:
        has_plates = spec.target is not None and spec.elastomer is not None
        check_cells(spec.cells.coils, spec.array.placements, has_plates, remarks)
    if not remarks.flaws:
        check_gaps(spec.array, spec.coil, remarks)
        if spec.array.reference is not None:
            check_reference(spec.all_placements, spec.coil, remarks)
    yield from remarks.flaws
