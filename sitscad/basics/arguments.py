"""Type check of the arguments of public functions against their annotations.

The decorator adds a wrapper when the function is defined. The annotations are parsed when the function is first called.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])
Test = Callable[[Any], bool]

SOURCES = {
    "SensorSpec": "sitscad.load(path) reads one",
    "Design": "sitscad.Design(spec) makes one",
    "Spiral": "sitscad.coil(...) makes one",
    "DrawnCoil": "sitscad.drawn_coil(path) makes one",
    "Measurement": "sitscad.apps.coil.measurement.read_measurement(path) reads one",
    "Layout": "sitscad.lay_out(spec) makes one",
    "Estimates": "sitscad.estimate(layout) makes one",
    "Calibration": "sitscad.calibrate(design) makes one",
    "Solid": "sitscad.solids(layout) makes them",
    "SpecError": "sitscad.load raises one",
    "Finding": "sitscad.check(spec).findings holds them",
    "Policy": "sitscad.checks.policy reads one",
    "Baseline": "sitscad.checks.policy.read_baseline(path) reads one",
    "SpecSource": "spec.source is one",
    "Adhesive": "sitscad.spec.presets.adhesive('epoxy') reads one",
    "Fault": "sitscad.apps.hardware.converter.Fault.read('open:C2') makes one",
}
"""Text about the call that returns a value of each type of sitscad. A TypeError names this call."""


def _is_iterable(value: Any) -> bool:
    return isinstance(value, Iterable) and not isinstance(value, (str, bytes, bytearray, Mapping))


def _is_number(value: Any) -> bool:
    return hasattr(type(value), "__float__") and not isinstance(value, bool)


TYPES: dict[str, tuple[str, Test]] = {
    "None": ("None", lambda value: value is None),
    "str": ("a text", lambda value: isinstance(value, str)),
    "Path": ("a path", lambda value: isinstance(value, os.PathLike)),
    "os.PathLike": ("a path", lambda value: isinstance(value, os.PathLike)),
    "bool": ("True or False", lambda value: isinstance(value, bool) or type(value).__name__ in ("bool", "bool_")),
    "int": ("a whole number", lambda value: hasattr(type(value), "__index__") and not isinstance(value, bool)),
    "float": ("a number", _is_number),
    "Iterable": ("a list", _is_iterable),
    "Sequence": ("a list", _is_iterable),
    "tuple": ("a list", _is_iterable),
    "ArrayLike": ("an array of numbers", lambda value: _is_iterable(value) or _is_number(value)),
    "Mapping": ("a mapping", lambda value: isinstance(value, Mapping)),
    "Callable": ("a function", callable),
    "Progress": ("a function", callable),
    "Executor": ("an executor", lambda value: hasattr(value, "submit")),
}
"""Description and test of each type in annotations, by the type's name. Types of sitscad are in `SOURCES`."""


def checked_arguments(function: Function) -> Function:
    """Return the function with a type check of its arguments.

    The check raises a TypeError that names the function, the argument, the wanted type and a call that returns it.
    """
    parameters: list[tuple[str, str, tuple[_AnnotatedType, ...]]] = []

    @wraps(function)
    def call(*values: Any, **named: Any) -> Any:
        if not parameters:
            parameters.extend(_parameters_of(function))
        for (name, annotation, kinds), value in zip(parameters, values, strict=False):
            _require(function, name, annotation, kinds, value)
        for name, annotation, kinds in parameters if named else ():
            if name in named:
                _require(function, name, annotation, kinds, named[name])
        return function(*values, **named)

    return cast(Function, call)


class _AnnotatedType:
    """One type of an annotation, such as ``tuple[Solid, ...]``: its name, and the types of its elements."""

    def __init__(self, annotation: str) -> None:
        match = re.fullmatch(r"([\w.]+)(?:\[(.*)\])?", annotation.strip())
        self.name, self.inner = (match[1], match[2] or "") if match else ("Any", "")
        names = [part for part in re.split(r"\s*\|\s*", self.inner.removesuffix(", ...")) if part not in ("", "Any")]
        is_opaque = self.name in ("Mapping", "os.PathLike", "Callable")
        self.parts = [] if is_opaque else [_AnnotatedType(name) for name in names]
        self.is_ours = self.name in SOURCES
        self.test = TYPES[self.name][1] if self.name in TYPES else lambda value: True

    def holds(self, value: Any) -> bool:
        """Whether a value is of this type. The elements of lists and tuples are tested, too."""
        if self.is_ours:
            bases = (base for base in type(value).__mro__ if base.__name__ == self.name)
            return any(base.__module__.startswith("sitscad.") for base in bases)
        if not self.test(value):
            return False
        inside = value if isinstance(value, (list, tuple)) and self.parts else ()
        return all(any(part.holds(each) for part in self.parts) for each in inside)

    @property
    def text(self) -> str:
        """Description of the type, such as "a list of a number"."""
        name = TYPES[self.name][0] if self.name in TYPES else self.name
        return f"{name} of {' or '.join(part.text for part in self.parts)}" if self.parts else name


def _parameters_of(function: Callable[..., Any]) -> Iterable[tuple[str, str, tuple[_AnnotatedType, ...]]]:
    """Yield the name, the annotation and the allowed types of each parameter of a function, in order."""
    code, annotations = function.__code__, function.__annotations__
    for name in code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]:
        annotation = str(annotations.get(name, "Any"))
        parts = re.split(r"\s*\|\s*(?![^\[]*\])", annotation)
        yield name, annotation, tuple(_AnnotatedType(part) for part in parts)


def _require(
    function: Callable[..., Any], name: str, annotation: str, kinds: tuple[_AnnotatedType, ...], value: Any
) -> None:
    if any(kind.holds(value) for kind in kinds):
        return
    types = list(dict.fromkeys(kind.text for kind in kinds))
    sources = [SOURCES[each.name] for kind in kinds for each in (kind, *kind.parts) if each.is_ours]
    shown = repr(value) if isinstance(value, (str, bytes, int, float, type(None))) else f"a {type(value).__name__}"
    called = function.__qualname__.removesuffix(".__init__").removesuffix(".__new__")
    source = f" ({sources[0]})" if sources else ""
    raise TypeError(f"{called}: {name} is {shown[:60]}, and {' or '.join(types)} is wanted{source}")
