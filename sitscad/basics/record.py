"""Records: frozen dataclasses that cost next to nothing to make.

A spec, a layout and its estimates are made of a hundred and sixty small frozen classes. The standard library writes and
compiles six functions of its own for each of them at every start (up to Python 3.12), which was a sixth of the time of
`sitscad check`. The methods here are made once for all classes; what a class contributes are its names. Everything that
takes a dataclass takes a record: `dataclasses.field`, `replace`, `fields`, `asdict`, and type checkers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields
from functools import cache
from inspect import get_annotations
from operator import attrgetter
from threading import RLock
from types import CodeType, FunctionType
from typing import Any, NoReturn, TypeVar, cast, dataclass_transform, overload

Class = TypeVar("Class", bound=type)
Made = TypeVar("Made")


@overload
def record(cls: Class, /) -> Class: ...


@overload
def record(*, eq: bool) -> Callable[[Class], Class]: ...


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def record(cls: Any = None, /, *, eq: bool = True) -> Any:
    """Make a class of annotated fields a frozen dataclass, as ``@dataclass(frozen=True)`` does.

    Without `eq` every instance is equal to itself alone: for classes that hold arrays.
    """

    def made(cls: type) -> type:
        """The class as a record, made with as little as that takes: most classes of a command have no instance."""
        methods: dict[str, Any] = {**_SHARED, "__init__": _init_on_first_use(cls), _FIELDS: _FieldsOnFirstUse(cls)}
        if eq:
            methods |= _comparing_on_first_use(cls)
        for name, method in methods.items():
            if name not in cls.__dict__ or cls.__dict__[name] is None:
                setattr(cls, name, method)
        cls.__doc__ = cls.__doc__ or cls.__name__
        return cls

    return made if cls is None else made(cls)


_FIELDS = "__dataclass_fields__"
"""The attribute by which the standard library knows a dataclass."""


_LOCK = RLock()
"""Held while a class is completed, for two threads may ask for its fields at once."""


class _FieldsOnFirstUse:
    """The fields of a record as a dataclass has them, found when they are first asked for: most records never are."""

    def __init__(self, cls: type) -> None:
        self._cls = cls

    def __get__(self, instance: object, owner: type) -> dict[str, Field[Any]]:
        """The fields by name. The class is a dataclass from then on."""
        with _LOCK:
            if self._cls.__dict__[_FIELDS] is self:
                self._complete(self._cls)
        found: dict[str, Field[Any]] = self._cls.__dict__[_FIELDS]
        return found

    @staticmethod
    def _complete(cls: type) -> None:
        stated = get_annotations(cls)
        # A text may stand for a ClassVar, which a dataclass looks for with patterns: a fifth of its time
        cls.__annotations__ = {n: kind if "ClassVar" in str(kind) else object for n, kind in stated.items()}
        dataclass(init=False, repr=False, eq=False)(cls)
        cls.__annotations__ = stated
        for one in fields(cls):
            one.type = stated.get(one.name, one.type)


_WITHOUT_DEFAULT: Field[Any] = field()


@cache
def _own_fields(cls: type) -> dict[str, Field[Any]]:
    """Fields of a record by name, those of its bases first. Only their defaults and flags are set: to complete them as
    the standard library does takes ten times as long, and constructors, equality and copies need no more.
    """
    found: dict[str, Field[Any]] = {}
    for base in reversed(cls.__mro__):
        stated = base.__dict__.get(_FIELDS)
        if isinstance(stated, dict):
            found |= {one.name: one for one in fields(base)}
        elif stated is not None:
            for name, kind in get_annotations(base).items():
                if "ClassVar" not in str(kind):
                    given = base.__dict__.get(name, _WITHOUT_DEFAULT)
                    found[name] = given if isinstance(given, Field) else field(default=given)
    return found


def _init_on_first_use(cls: type) -> Callable[..., None]:
    """A constructor that makes the real one when it is first called."""

    def __init__(self: Any, /, *values: Any, **named: Any) -> None:
        compiled = _compiled_init(cls)
        setattr(cls, "__init__", compiled)  # noqa: B010 - an assignment is no business of a type checker
        compiled(self, *values, **named)

    return __init__


def _compiled_init(cls: type) -> Callable[..., None]:
    """The constructor of a record, as a dataclass would write it."""
    names, own = _own_fields(cls).keys(), _own_fields(cls).values()
    if "__match_args__" not in cls.__dict__:
        setattr(cls, "__match_args__", tuple(names))  # noqa: B010 - an assignment is no business of a type checker
    factories = {k: one.default_factory for k, one in enumerate(own) if one.default_factory is not MISSING}
    pattern = _init_pattern(len(own), tuple(factories))
    called = dict(zip(_numbered(len(own)), names, strict=True))
    code = pattern.replace(
        co_varnames=tuple(called.get(name, name) for name in pattern.co_varnames),
        co_consts=tuple(called.get(value, value) if isinstance(value, str) else value for value in pattern.co_consts),
        co_qualname=f"{cls.__qualname__}.__init__",
    )
    scope = {"missing": MISSING} | {f"new_{k}": make for k, make in factories.items()}
    defaults: tuple[Any, ...] = ()
    for one in own:  # a default before a field without one cannot be used
        has_none = one.default is MISSING and one.default_factory is MISSING
        defaults = () if has_none else (*defaults, one.default)
    return FunctionType(code, scope, "__init__", defaults)


@cache
def _init_pattern(count: int, made: tuple[int, ...]) -> CodeType:
    """The code of a constructor of so many fields, numbered; those `made` have factories of defaults. A class's own is
    this one with other names, which takes a tenth of the time of compiling it.
    """
    names = _numbered(count)
    values = [f"new_{k}() if {name} is missing else {name}" if k in made else name for k, name in enumerate(names)]
    lines = ["inside = self.__dict__", *(f"inside[{n!r}] = {v}" for n, v in zip(names, values, strict=True))]
    scope: dict[str, Any] = {}
    exec(f"def __init__({', '.join(['self', *names])}):\n " + "\n ".join(lines), scope)
    return cast(CodeType, scope["__init__"].__code__)


def _numbered(count: int) -> list[str]:
    return [f"field_{k}" for k in range(count)]


def _comparing_on_first_use(cls: type) -> dict[str, Callable[..., Any]]:
    """Equality and hash of a record, made when one of both is first asked for."""

    def real(name: str) -> Callable[..., Any]:
        for key, method in _comparing(_own_fields(cls)).items():
            if cls.__dict__[key] is early[key]:
                setattr(cls, key, method)
        return cast(Callable[..., Any], cls.__dict__[name])

    early: dict[str, Callable[..., Any]] = {
        "__eq__": lambda self, other: real("__eq__")(self, other), "__hash__": lambda self: real("__hash__")(self),
    }
    return early


def _comparing(own: dict[str, Field[Any]]) -> dict[str, Callable[..., Any]]:
    """Equality and hash of a record by its fields."""
    compared = _values_of([name for name, one in own.items() if one.compare])
    hashed = _values_of([name for name, one in own.items() if (one.compare if one.hash is None else one.hash)])

    def __eq__(self: Any, other: Any) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return bool(self is other or compared(self) == compared(other))

    def __hash__(self: Any) -> int:
        inside = self.__dict__
        if HASH not in inside:
            inside[HASH] = hash(hashed(self))
        return int(inside[HASH])

    return {"__eq__": __eq__, "__hash__": __hash__}


HASH = "_hash"
"""The name that a record's hash is kept under, once it was asked for."""


def _without_hash(self: Any) -> dict[str, Any]:
    """What is copied and pickled: in another process texts have other hashes."""
    return {name: value for name, value in self.__dict__.items() if name != HASH}


def replace(one: Made, /, **changes: Any) -> Made:
    """The record with other values of some fields, as `dataclasses.replace` makes it at four times the cost."""
    inside, names = cast(Any, one).__dict__, _own_fields(cast(type, type(one)))
    found = object.__new__(type(one))
    own = found.__dict__
    for name in names:
        own[name] = inside[name]
    if not changes.keys() <= own.keys():
        raise TypeError(f"{type(one).__name__} has no field {', '.join(changes.keys() - own.keys())}")
    own.update(changes)
    return found


class FrozenDict(dict[Any, Any]):
    """A mapping that cannot be changed: it may be shared, copied, pickled and written as JSON."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("this mapping is part of a frozen value and cannot be changed: change a copy, dict(...)")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return FrozenDict, (dict(self),)

    def __copy__(self) -> FrozenDict:
        return self


def with_frozen_mappings(one: Made) -> Made:
    """Return the record with each of its mappings as a `FrozenDict`."""
    inside = cast(Any, one).__dict__
    names = _own_fields(cast(type, type(one)))
    changes = {name: FrozenDict(inside[name]) for name in names if type(inside[name]) is dict}
    return replace(one, **changes) if changes else one


def kept(by: Any, name: str, make: Callable[[], Made]) -> Made:
    """What `make` gives, made once and kept with a record under a name; what is replaced has it to make anew."""
    inside = by.__dict__
    if name not in inside:
        inside[name] = make()
    return cast(Made, inside[name])


def _values_of(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


def _repr(self: Any) -> str:
    shown = ", ".join(f"{one.name}={getattr(self, one.name)!r}" for one in fields(self) if one.repr)
    return f"{self.__class__.__qualname__}({shown})"


def _refuse_to_set(self: Any, name: str, value: Any) -> NoReturn:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(self: Any, name: str) -> NoReturn:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


_SHARED = {"__repr__": _repr, "__getstate__": _without_hash, "__setattr__": _refuse_to_set,
           "__delattr__": _refuse_to_delete}
