"""Whether a spec that was not read from a text can be worked with: values that programs put together in Python.

Types are those of the fields, ranges and words those of the keys that the format has for them, and a coil's turns, size
and neighbours are held against each other as when a text is resolved. What was read is right, and not looked at.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import UnionType
from typing import Any, Union, cast, get_args, get_origin, get_type_hints

from pydantic_core import PydanticCustomError

from sitscad.spec.design_rules import DesignRules
from sitscad.spec.format.diagnosis import finding_from_flaw
from sitscad.spec.format.documents import circuit
from sitscad.spec.format.documents import spec as form
from sitscad.spec.format.documents.fabricator import RulesDocument
from sitscad.spec.format.documents.materials import ConductorDocument, ElastomerDocument
from sitscad.spec.format.documents.mount import FingerDocument, JawDocument, MountDocument, RetentionDocument
from sitscad.spec.format.kinds.figure import Sourced
from sitscad.spec.format.kinds.kind import Either, Kind
from sitscad.spec.format.kinds.number import Layers, Number, NumberOrList
from sitscad.spec.format.kinds.quantity import Pair, Quantity
from sitscad.spec.format.kinds.refusal import described
from sitscad.spec.format.kinds.word import Choice, Text
from sitscad.spec.format.remarks import Flaw, Remarks
from sitscad.spec.format.section import Section
from sitscad.spec.issue import Issue
from sitscad.spec.materials import Conductor, ElastomerMaterial
from sitscad.spec.pieces.mounting import Finger, Jaw, Mount, Retention
from sitscad.spec.resolver.array import MOST_COILS, check_gaps
from sitscad.spec.resolver.coil import check_amount, check_coil
from sitscad.spec.rules import SpecError
from sitscad.spec.sensor import (
    Cable,
    CoilSpec,
    ElastomerPad,
    Encapsulation,
    FpcSpec,
    PanelSpec,
    ReadoutSpec,
    Requirements,
    SensorSpec,
    Shield,
    Tail,
    Target,
)
from sitscad.spec.source import SpecSource
from sitscad.units import parse_quantity, show

SECTIONS: dict[type, type[Section]] = {
    SensorSpec: form.SpecDocument,
    Issue: form.SpecDocument,
    CoilSpec: form.CoilDocument,
    FpcSpec: circuit.FpcDocument,
    DesignRules: RulesDocument,
    PanelSpec: circuit.PanelDocument,
    Tail: circuit.TailDocument,
    Target: form.TargetDocument,
    ElastomerPad: form.ElastomerPadDocument,
    Encapsulation: form.EncapsulationDocument,
    Mount: MountDocument,
    Jaw: JawDocument,
    Retention: RetentionDocument,
    Finger: FingerDocument,
    Shield: form.ShieldDocument,
    Cable: form.CableDocument,
    ReadoutSpec: form.ReadoutDocument,
    Requirements: form.RequirementsDocument,
    Conductor: ConductorDocument,
    ElastomerMaterial: ElastomerDocument,
}
"""The section of the format that has the keys of a value's fields."""

WRITTEN_AS = {(CoilSpec, "size"): "outer_diameter"}
"""Fields that the format calls otherwise."""

FARTHEST = 1.0
"""Of a coil's centre from the origin (m)."""


def refuse_unusable(spec: SensorSpec) -> None:
    """Raise `SpecError`, with a finding for each value, where a spec is none that could have been read.

    A spec just as it was read costs nothing here; of any other all values are looked at.
    """
    if not isinstance(spec, SensorSpec):
        raise TypeError(f"a SensorSpec is wanted, not {described(spec)}")
    if spec.is_known:
        return
    for look in (_types, _ranges, _fits):
        flaws = list(look(spec))
        if flaws:
            source = spec.source if isinstance(spec.source, SpecSource) else SpecSource("<values>", "")
            raise SpecError(tuple(finding_from_flaw(flaw, source) for flaw in flaws))


def _types(spec: SensorSpec) -> Iterator[Flaw]:
    yield from _misfits(spec, SensorSpec, "")


def _misfits(value: Any, wanted: Any, key: str) -> Iterator[Flaw]:
    """What within a value is not of the type that its field wants."""
    if is_dataclass(wanted) and isinstance(wanted, type):
        if type(value) is not wanted:
            yield _mistyped(value, wanted, key)
        elif wanted is not SpecSource:
            for one in fields(wanted):
                yield from _misfits(
                    getattr(value, one.name), _hints(cast(Hashable, wanted))[one.name], _inner(key, one.name)
                )
        return
    origin, inner = get_origin(wanted), get_args(wanted)
    if origin in (Union, UnionType):
        found = [list(_misfits(value, each, key)) for each in inner]
        if all(found):  # the complaint of the one that came nearest: about what is inside of the value
            inside = [flaws for flaws in found if all(flaw.key != key for flaw in flaws)]
            yield from inside[0] if inside else [_mistyped(value, wanted, key)]
    elif origin is tuple:
        yield from _tuple_misfits(value, inner, key)
    elif origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            yield _mistyped(value, wanted, key)
            return
        for name, each in value.items():
            yield from _misfits(name, inner[0], key)
            yield from _misfits(each, inner[1], _inner(key, str(name)))
    elif not _is_scalar(value, wanted):
        yield _mistyped(value, wanted, key)


def _tuple_misfits(value: Any, inner: tuple[Any, ...], key: str) -> Iterator[Flaw]:
    """What of a tuple is not of its type."""
    many = len(inner) == 2 and inner[1] is Ellipsis
    if not isinstance(value, tuple) or (not many and len(value) != len(inner)):
        yield _mistyped(value, tuple[inner], key)  # type: ignore[valid-type]
        return
    for index, each in enumerate(value):
        yield from _misfits(each, inner[0] if many else inner[index], _inner(key, str(index)))


def _is_scalar(value: Any, wanted: Any) -> bool:
    """Whether a value is of a plain type, numbers finite."""
    if wanted is type(None):
        return value is None
    if wanted is float:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and _is_finite(value)
    if wanted is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if isinstance(wanted, type) and issubclass(wanted, Enum):
        return isinstance(value, wanted)
    return isinstance(value, wanted)


def _is_finite(value: float) -> bool:
    return -1e30 < value < 1e30  # whole numbers may be too large for a float; false for what is no number


def _mistyped(value: Any, wanted: Any, key: str) -> Flaw:
    name = wanted.__name__ if isinstance(wanted, type) and get_origin(wanted) is None else str(wanted)
    name = name.replace("sitscad.spec.", "").replace("float", "finite number")
    return Flaw("SIT004", key, f"{described(value)}, where {name} is wanted", "values are in SI units: metres, radians")


def _inner(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


@cache
def _hints(of: Hashable) -> dict[str, Any]:
    hints = get_type_hints(of)
    return {one.name: hints[one.name] for one in fields(cast(Any, of))}


def _ranges(spec: SensorSpec) -> Iterator[Flaw]:
    """Values that no text could have, out of their kinds' ranges."""
    yield from _out_of_range(spec, "")
    for index, layer in enumerate(spec.fpc.stackup.layers):
        yield from _refused(layer.thickness, _LAYER, f"fpc.stackup.layers.{index}.thickness")
    if not 1 <= len(spec.array.placements) <= MOST_COILS:
        yield Flaw("SIT006", "array.placements", f"{len(spec.array.placements)} coils, where 1 to {MOST_COILS} can be")
    for index, place in enumerate(spec.array.placements):
        if max(map(abs, place.centre)) > FARTHEST:
            yield Flaw(
                "SIT006", f"array.placements.{index}.centre", f"farther than {show(FARTHEST, 'm')} from the origin"
            )


_LAYER = Quantity("length", "1 um", "5 mm")


def _out_of_range(value: Any, key: str) -> Iterator[Flaw]:
    """What within a value the keys of the format do not take."""
    keys = SECTIONS[type(value)].keys if type(value) in SECTIONS else {}
    for one in fields(value):
        inside, inner = getattr(value, one.name), _inner(key, one.name)
        written = WRITTEN_AS.get((type(value), one.name), one.name)
        if written in keys and inside is not None:
            yield from _refused(inside, keys[written].kind, inner)
        elif is_dataclass(inside) and not isinstance(inside, SpecSource):
            yield from _out_of_range(inside, inner)


def _refused(value: Any, kind: Kind, key: str) -> Iterator[Flaw]:
    """What a kind of value refuses of a value in SI."""
    if is_dataclass(value):
        yield from _out_of_range(value, key)
        return
    while isinstance(kind, (Either, Sourced)):
        kind = kind.other if isinstance(kind, Either) else kind.figure
    if isinstance(kind, (Pair, NumberOrList)):
        each = kind.length if isinstance(kind, Pair) else kind.number
        for one in value if isinstance(value, tuple) else (value,):
            yield from _refused(one, each, key)
    elif isinstance(kind, Quantity):
        low, high = parse_quantity(kind.low, kind.dimension), parse_quantity(kind.high, kind.dimension)
        if not low * (1 - 1e-12) <= value <= high * (1 + 1e-12):
            yield Flaw("SIT006", key, f"{value:g} is out of range: {low:g} to {high:g} ({kind.low} to {kind.high})",
                       "values are in SI units: metres, radians")  # fmt: skip
    elif isinstance(kind, (Choice, Text, Number, Layers)):
        try:
            kind.read(list(value) if isinstance(kind, Layers) else value)
        except PydanticCustomError as error:
            context = dict(error.context or {})
            yield Flaw(error.type, key, context.get("message", ""), context.get("hint", ""))


def _fits(spec: SensorSpec) -> Iterator[Flaw]:
    """What the coils, their layers and places have against each other."""
    remarks, copper = Remarks(), len(spec.fpc.stackup.copper)
    if spec.coil.has_unequal_turns and len(spec.coil.layer_turns) != len(spec.coil.layers):
        message = f"{len(spec.coil.layer_turns)} numbers of turns for {len(spec.coil.layers)} layers"
        yield Flaw("SIT009", "coil.turns", message, "one number for each layer, or one for all")
        return
    if max(spec.coil.layers) > copper:
        message = f"the coil uses copper layer {max(spec.coil.layers)}, stack-up {spec.fpc.stackup.name} has {copper}"
        yield Flaw("SIT009", "coil.layers", message, "use fewer layers, or a stack-up with more copper")
    check_coil(spec.coil, remarks)
    check_amount(spec.coil, len(spec.array.placements), remarks)
    if not remarks.flaws:
        check_gaps(spec.array, spec.coil, remarks)
    yield from remarks.flaws
