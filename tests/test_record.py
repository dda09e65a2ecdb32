"""Records behave as frozen dataclasses do, for a tenth of what those cost to make."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest

from sitscad.basics.record import memo, record, replace


@record
class Track:
    """A stretch."""

    width: float
    layer: int = 1
    notes: Mapping[str, str] = field(default_factory=dict, compare=False)

    @property
    def area(self) -> float:
        return self.width * self.layer


@record
class Wide(Track):
    other: float = 2.0


@record(eq=False)
class Field:
    values: np.ndarray


@dataclass(frozen=True)
class Twin:
    """A stretch."""

    width: float
    layer: int = 1
    notes: Mapping[str, str] = field(default_factory=dict, compare=False)


def test_record_values_are_set_by_position_name_and_default():
    assert Track(0.1) == Track(0.1, 1) == Track(layer=1, width=0.1) == Track(0.1, notes={"not": "compared"})
    assert Track(0.1, 2).area == 0.2
    assert Track(0.1).notes == {} and Track(0.1).notes is not Track(0.1).notes
    assert Wide(0.1, other=3.0) == Wide(0.1, 1, {}, 3.0)


@pytest.mark.parametrize(
    ("values", "named"),
    [((), {}), ((0.1, 1, {}, 4), {}), ((0.1,), {"width": 0.1}), ((0.1,), {"height": 1.0}), ((), {"layer": 1})],
    ids=["none", "too many", "twice", "unknown", "one missing"],
)
def test_wrong_record_arguments_raise_type_error_every_time(values, named):
    @record
    class Fresh:
        width: float
        layer: int = 1
        notes: str = ""

    for _ in range(2):
        with pytest.raises(TypeError):
            Fresh(*values, **named)
    assert Fresh(0.1).layer == 1


def test_record_has_equality_and_hash_of_frozen_dataclass():
    assert Track(0.1) != Track(0.2) and Track(0.1) != Twin(0.1) and Track(0.1) != Wide(0.1)
    assert hash(Track(0.1, 3, {"a": "b"})) == hash(Track(0.1, 3)) == hash(Twin(0.1, 3))
    assert {Track(0.1): "kept"}[Track(0.1)] == "kept"


def test_record_without_eq_compares_by_identity():
    item, other = Field(np.zeros(3)), Field(np.zeros(3))
    assert item == item and item != other and len({item, other}) == 2


def test_record_attributes_cannot_be_set_or_deleted():
    track = Track(0.1)
    with pytest.raises(dataclasses.FrozenInstanceError):
        track.width = 0.2
    with pytest.raises(dataclasses.FrozenInstanceError):
        track.height = 0.2
    with pytest.raises(dataclasses.FrozenInstanceError):
        del track.width


def test_dataclass_functions_accept_records():
    track, twin = Track(0.1, 2), Twin(0.1, 2)
    assert dataclasses.is_dataclass(track)
    assert dataclasses.replace(track, layer=3) == Track(0.1, 3)
    assert [item.name for item in dataclasses.fields(track)] == [item.name for item in dataclasses.fields(twin)]
    assert dataclasses.asdict(track) == dataclasses.asdict(twin)
    assert dataclasses.astuple(track) == dataclasses.astuple(twin)
    assert repr(track) == repr(twin).replace("Twin", "Track")
    assert Track.__doc__ == "A stretch." and Field.__doc__ == "Field"
    assert list(inspect.signature(Track).parameters) == list(inspect.signature(Twin).parameters)
    assert copy.deepcopy(track) == pickle.loads(pickle.dumps(track)) == track
    match track:
        case Track(width, layer):
            assert (width, layer) == (0.1, 2)


def test_fields_of_a_record_without_instances_are_complete():
    """They are found when somebody asks for them: a base's fields come first, with its defaults."""

    @record
    class Base:
        first: float
        second: str = field(default="")

    @record
    class Derived(Base):
        third: int = 3

    assert dataclasses.is_dataclass(Derived)
    assert [item.name for item in dataclasses.fields(Derived)] == ["first", "second", "third"]
    assert Derived.__annotations__ == {"third": "int"} and Derived.__match_args__ == ("first", "second", "third")
    assert Derived(1.0) == Derived(1.0) != Base(1.0) and hash(Base(1.0)) != hash(Base(2.0))


def test_record_keeps_explicit_repr():
    @record
    class Named:
        name: str

        def __repr__(self) -> str:
            return self.name

    assert repr(Named("C1")) == "C1"


def test_record_class_is_created_faster_than_frozen_dataclass():
    def cost(make) -> float:
        start = time.process_time()
        for _ in range(30):
            body = {"__annotations__": dict.fromkeys("abcdef", "float"), "__doc__": "", "__module__": __name__}
            make(type("Values", (), body))
        return time.process_time() - start

    assert min(cost(record) for _ in range(4)) < 0.4 * min(cost(dataclass(frozen=True)) for _ in range(4))


@record
class Named:
    own: int
    cls: int = 2
    fields: int = 3


@record
class Inner:
    """Fields called like the pieces that a constructor is made of."""

    missing: int
    inside: int = 2
    field_0: dict = field(default_factory=dict)


def test_records_sharing_constructor_pattern_have_own_names_and_defaults():
    assert (Inner(1).missing, Inner(1).inside, Inner(1).field_0) == (1, 2, {})
    assert Inner(1, field_0={"a": 1}).field_0 == {"a": 1} and Inner(1).field_0 is not Inner(1).field_0
    with pytest.raises(TypeError, match=r"Inner.__init__\(\) missing 1 required positional argument: 'missing'"):
        Inner()
    assert [item.type for item in dataclasses.fields(Inner)] == ["int", "int", "dict"]


def test_record_field_of_type_named_variable_is_no_class_variable():
    @record
    class Space:
        variables: tuple[Variable, ...]  # noqa: F821 - annotations are texts
        names: ClassVar[int] = 2

    assert Space((1,)) == Space(variables=(1,)) and list(vars(Space((1,)))) == ["variables"]


def test_record_fields_may_have_internal_names():
    assert (Named(1).own, Named(1).cls, Named(1).fields) == (1, 2, 3)
    assert Named(1) == Named(own=1) and Named(1) != Named(4)


def test_replaced_record_has_no_cached_values():
    item = Track(1.0)
    assert memo(item, "_twice", lambda: 2) == memo(item, "_twice", lambda: 3) == 2 and hash(item) == hash(item)
    other = replace(item, layer=3)
    assert other == dataclasses.replace(item, layer=3) and hash(other) != hash(item)
    assert "_twice" not in other.__dict__ and "_hash" not in pickle.loads(pickle.dumps(item)).__dict__
    with pytest.raises(TypeError, match="no field wide"):
        replace(item, wide=1.0)
