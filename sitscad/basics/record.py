"""Records: frozen dataclasses that take little time to define.

A spec, a layout and its estimates consist of a hundred and sixty small frozen classes. The standard library writes and
compiles six functions for each class at every start (up to Python 3.12). This took a sixth of the time of `sitscad
check`. The methods here are shared by all classes. Each class only supplies its field names. Functions for dataclasses
accept records: `dataclasses.field`, `replace`, `fields`, `asdict`, and type checkers.
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

    If `eq` is False, two instances are equal only if they are the same object. Classes that hold arrays need this.
    """

    def made(cls: type) -> type:
        """Add the methods of a frozen dataclass to the class.

        ``__init__``, ``__eq__`` and ``__hash__`` are made at first use. One command makes no instance of most classes,
        so this saves start-up time.
        """
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
"""Attribute by which the standard library recognises a dataclass."""


_LOCK = RLock()
"""Lock held while a class is completed, because two threads may read its fields at once."""


class _FieldsOnFirstUse:
    """Fields of a record as a complete dataclass has them.

    They are computed at first access. Most records never need them.
    """

    def __init__(self, cls: type) -> None:
        self._cls = cls

    def __get__(self, instance: object, owner: type) -> dict[str, Field[Any]]:
        """Return the fields by name. The first call completes the class as a dataclass."""
        with _LOCK:
            if self._cls.__dict__[_FIELDS] is self:
                self._complete(self._cls)
        completed: dict[str, Field[Any]] = self._cls.__dict__[_FIELDS]
        return completed

    @staticmethod
    def _complete(cls: type) -> None:
        annotations = get_annotations(cls)
        # A text may stand for a ClassVar. A dataclass searches texts with patterns, a fifth of its time
        cls.__annotations__ = {n: kind if "ClassVar" in str(kind) else object for n, kind in annotations.items()}
        dataclass(init=False, repr=False, eq=False)(cls)
        cls.__annotations__ = annotations
        for each in fields(cls):
            each.type = annotations.get(each.name, each.type)


_WITHOUT_DEFAULT: Field[Any] = field()


@cache
def _own_fields(cls: type) -> dict[str, Field[Any]]:
    """Return the fields of a record by name, with the fields of its base classes first.

    The fields contain only defaults and flags. Constructors, equality and copies need no more, and complete fields take
    ten times as long.
    """
    by_name: dict[str, Field[Any]] = {}
    for base in reversed(cls.__mro__):
        declared = base.__dict__.get(_FIELDS)
        if isinstance(declared, dict):
            by_name |= {each.name: each for each in fields(base)}
        elif declared is not None:
            for name, kind in get_annotations(base).items():
                if "ClassVar" not in str(kind):
                    default = base.__dict__.get(name, _WITHOUT_DEFAULT)
                    by_name[name] = default if isinstance(default, Field) else field(default=default)
    return by_name


def _init_on_first_use(cls: type) -> Callable[..., None]:
    """Return a constructor that compiles the real constructor at its first call, and replaces itself with it."""

    def __init__(self: Any, /, *values: Any, **named: Any) -> None:
        compiled = _compiled_init(cls)
        setattr(cls, "__init__", compiled)  # noqa: B010 - a type checker would refuse an assignment
        compiled(self, *values, **named)

    return __init__


def _compiled_init(cls: type) -> Callable[..., None]:
    """Return the constructor of a record, equal to the constructor of a dataclass."""
    names, own_fields = _own_fields(cls).keys(), _own_fields(cls).values()
    if "__match_args__" not in cls.__dict__:
        setattr(cls, "__match_args__", tuple(names))  # noqa: B010 - a type checker would refuse an assignment
    factories = {k: each.default_factory for k, each in enumerate(own_fields) if each.default_factory is not MISSING}
    pattern = _init_pattern(len(own_fields), tuple(factories))
    called = dict(zip(_numbered(len(own_fields)), names, strict=True))
    code = pattern.replace(
        co_varnames=tuple(called.get(name, name) for name in pattern.co_varnames),
        co_consts=tuple(called.get(value, value) if isinstance(value, str) else value for value in pattern.co_consts),
        co_qualname=f"{cls.__qualname__}.__init__",
    )
    scope = {"missing": MISSING} | {f"new_{k}": make for k, make in factories.items()}
    defaults: tuple[Any, ...] = ()
    for each in own_fields:  # a default before a field without one cannot be used
        has_none = each.default is MISSING and each.default_factory is MISSING
        defaults = () if has_none else (*defaults, each.default)
    return FunctionType(code, scope, "__init__", defaults)


@cache
def _init_pattern(count: int, with_factory: tuple[int, ...]) -> CodeType:
    """Return the code of a constructor with `count` numbered fields.

    `with_factory` holds the numbers of the fields with default factories. A class's constructor is this code with other
    names. Renaming takes a tenth of the time of compiling.
    """
    names = _numbered(count)
    values = [f"new_{k}() if {name} is missing else {name}" if k in with_factory else name
              for k, name in enumerate(names)]
    lines = ["inside = self.__dict__", *(f"inside[{n!r}] = {v}" for n, v in zip(names, values, strict=True))]
    scope: dict[str, Any] = {}
    exec(f"def __init__({', '.join(['self', *names])}):\n " + "\n ".join(lines), scope)
    return cast(CodeType, scope["__init__"].__code__)


def _numbered(count: int) -> list[str]:
    return [f"field_{k}" for k in range(count)]


def _comparing_on_first_use(cls: type) -> dict[str, Callable[..., Any]]:
    """Return the methods ``__eq__`` and ``__hash__`` of a record. Both are created when either is first used."""

    def real(name: str) -> Callable[..., Any]:
        for key, method in _comparing(_own_fields(cls)).items():
            if cls.__dict__[key] is early[key]:
                setattr(cls, key, method)
        return cast(Callable[..., Any], cls.__dict__[name])

    early: dict[str, Callable[..., Any]] = {
        "__eq__": lambda self, other: real("__eq__")(self, other), "__hash__": lambda self: real("__hash__")(self),
    }
    return early


def _comparing(fields_by_name: dict[str, Field[Any]]) -> dict[str, Callable[..., Any]]:
    """Return the methods ``__eq__`` and ``__hash__`` that compare the given fields of a record."""
    compared = _values_of([name for name, each in fields_by_name.items() if each.compare])
    hashed = _values_of([name for name, each in fields_by_name.items()
                         if (each.compare if each.hash is None else each.hash)])

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
"""Attribute in which a record stores its hash after the first computation."""


def _without_hash(self: Any) -> dict[str, Any]:
    """Return the attributes to copy or pickle, without the hash. Hashes of texts differ between processes."""
    return {name: value for name, value in self.__dict__.items() if name != HASH}


def replace(value: Made, /, **changes: Any) -> Made:
    """Return a copy of a record with other values of some fields. `dataclasses.replace` takes four times as long."""
    inside, names = cast(Any, value).__dict__, _own_fields(cast(type, type(value)))
    changed = object.__new__(type(value))
    values = changed.__dict__
    for name in names:
        values[name] = inside[name]
    if not changes.keys() <= values.keys():
        raise TypeError(f"{type(value).__name__} has no field {', '.join(changes.keys() - values.keys())}")
    values.update(changes)
    return changed


class FrozenDict(dict[Any, Any]):
    """A mapping that cannot be changed. It may be shared, copied, pickled and written as JSON."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("this mapping is part of a frozen value and cannot be changed: change a copy, dict(...)")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return FrozenDict, (dict(self),)

    def __copy__(self) -> FrozenDict:
        return self


def with_frozen_mappings(value: Made) -> Made:
    """Return the record with each of its dictionaries as a `FrozenDict`."""
    inside = cast(Any, value).__dict__
    names = _own_fields(cast(type, type(value)))
    changes = {name: FrozenDict(inside[name]) for name in names if type(inside[name]) is dict}
    return replace(value, **changes) if changes else value


def memo(by: Any, name: str, make: Callable[[], Made]) -> Made:
    """Return the result of `make()`, and store it in the record `by` under `name`.

    Later calls return the stored result. A copy with other values (`replace`) does not have it.
    """
    inside = by.__dict__
    if name not in inside:
        inside[name] = make()
    return cast(Made, inside[name])


def _values_of(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda record_value: tuple(getattr(record_value, name) for name in names)


def _repr(self: Any) -> str:
    shown = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{self.__class__.__qualname__}({shown})"


def _refuse_to_set(self: Any, name: str, value: Any) -> NoReturn:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(self: Any, name: str) -> NoReturn:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


_SHARED = {"__repr__": _repr, "__getstate__": _without_hash, "__setattr__": _refuse_to_set,
           "__delattr__": _refuse_to_delete}
