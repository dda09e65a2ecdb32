"""Every public name, given what it is not meant for, says what is wanted and where that comes from."""

from __future__ import annotations

import copy
import inspect
import json
import pickle
import re
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

import sitscad
from sitscad import SpecError
from sitscad.basics.arguments import SOURCES
from sitscad.basics.record import FrozenDict

TEXT = """\
sitscad: 1
name: small
coil: {shape: circle, outer_diameter: 7, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
"""


@cache
def _spec() -> sitscad.SensorSpec:
    return sitscad.load_text(TEXT)


FUNCTIONS = {
    **{name: getattr(sitscad, name) for name in sitscad.__all__ if isinstance(getattr(sitscad, name), FunctionType)},
    "Design": sitscad.Design,
    "SimulatedConverter": sitscad.SimulatedConverter,
    "PackageError": sitscad.PackageError,
    "SpecError": sitscad.SpecError,
    "Study.load": sitscad.Study.load,
    "Study.from_mapping": sitscad.Study.from_mapping,
}

RESULTS = {
    "Area", "BenchError", "BuildResult", "Calibration", "CentreLine", "CheckResult", "CurrentPath", "DrawnCoil",
    "Estimates", "Finding", "InverseMap", "Layout", "MissingExtra", "NoResponse", "NotChecked", "PartsError",
    "Performance", "PluginError", "Response", "Rule", "SensorSpec", "Severity", "Solid", "Spiral", "Study",
    "Undecided", "Violation", "Writer",
}
"""Classes that functions return, raise or look at: nobody makes one to begin with. A spec and a rule that somebody does
make are looked at where they are used."""

OTHERS = {"RULES", "__version__"}


def test_argument_tests_cover_every_public_name():
    assert {*sitscad.__all__} == {*(name for name in FUNCTIONS if "." not in name), *RESULTS, *OTHERS}


def _parameters(function: Any) -> dict[str, inspect.Parameter]:
    result = inspect.signature(function.__new__ if function is sitscad.Design else function).parameters
    variadic = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD
    return {name: each for name, each in result.items() if each.kind not in variadic and name != "cls"}


WRONG = {
    "None": None, "a number": 5, "a fraction": 2.5, "truth": True, "bytes": b"", "text": "no such thing", "a list": [],
    "a list of objects": [object()], "a mapping": {}, "an object": object(), "a type": int, "a function": print,
}
"""Values of types that few parameters take."""


def _is_meant(annotation: str, what: str) -> bool:
    """Whether an annotation takes a wrong value after all, by the name of its type."""
    words = {
        "None": r"\bNone\b", "a number": r"\b(int|float|ArrayLike)\b", "a fraction": r"\b(float|ArrayLike)\b",
        "truth": r"\bbool\b", "text": r"(^|\| )str\b", "a list": r"\b(Iterable|Sequence|tuple|ArrayLike)\b",
        "a list of objects": r"\bArrayLike\b", "a mapping": r"\bMapping\b", "a function": r"\b(Progress|Callable)\b",
        "a type": r"\b(Progress|Callable)\b",
    }
    return what in words and re.search(words[what], annotation) is not None


CASES = [
    (name, parameter, what)
    for name, function in FUNCTIONS.items()
    for parameter, each in _parameters(function).items()
    for what in WRONG
    if not _is_meant(str(each.annotation), what)
]


@pytest.mark.parametrize("name", sorted({name for name, _, _ in CASES}))
def test_wrong_argument_type_raises_type_error_with_expected_type(name):
    for parameter, what in ((parameter, what) for other, parameter, what in CASES if other == name):
        with pytest.raises(TypeError) as caught:
            FUNCTIONS[name](**{parameter: WRONG[what]})
        message = str(caught.value)
        assert f"{parameter} is " in message and " is wanted" in message, (parameter, what, message)
        annotation = str(_parameters(FUNCTIONS[name])[parameter].annotation)
        if source := next((SOURCES[kind] for kind in SOURCES if re.search(rf"\b{kind}\b", annotation)), ""):
            assert any(each in message for each in SOURCES.values()), (source, message)


@pytest.mark.parametrize(("name", "given", "wanted"), [
    ("estimate", "spec", "lay_out"), ("areas", "spec", "lay_out"), ("solids", "spec", "lay_out"),
    ("lay_out", "layout", "load"), ("check", "layout", "load"), ("build", "layout", "load"),
    ("calibrate", "spec", "Design"), ("measure", "layout", "load"), ("pad_mesh", "spec", "lay_out"),
])
def test_spec_instead_of_layout_raises_type_error_naming_lay_out(name, given, wanted):
    value = _spec() if given == "spec" else sitscad.lay_out(_spec())
    with pytest.raises(TypeError, match=wanted):
        getattr(sitscad, name)(value)


@pytest.mark.parametrize("made", [b"", b"sitscad: 1", Path("sensor.yaml"), None])
def test_wrong_type_for_text_raises_type_error(made):
    with pytest.raises(TypeError, match="text is "):
        sitscad.load_text(made)


def test_correct_arguments_are_accepted_by_position_and_name():
    spec, layout = _spec(), sitscad.lay_out(spec=_spec())
    assert sitscad.check(spec, layout, estimates=sitscad.estimate(layout=layout, tolerance=None), hints="none").findings
    assert sitscad.Design(spec, given_layout=layout).layout is layout
    assert sitscad.load_text(TEXT, Path("sensor.yaml")).coil == spec.coil
    with pytest.raises(SpecError):
        sitscad.load(Path("there/is/none.yaml"))


def test_type_checked_function_keeps_signature_name_and_docstring():
    assert next(iter(inspect.signature(sitscad.estimate).parameters)) == "layout"
    assert sitscad.estimate.__name__ == "estimate" and sitscad.estimate.__doc__


def _mutable(value: Any, path: str = "spec") -> list[str]:
    """Places in a frozen value where something can be changed."""
    if is_dataclass(value):
        return [result for one in fields(value) for result in _mutable(getattr(value, one.name), f"{path}.{one.name}")]
    if isinstance(value, tuple):
        return [result for each in value for result in _mutable(each, f"{path}[]")]
    is_open = isinstance(value, (dict, list, set, bytearray)) and not isinstance(value, FrozenDict)
    return [path] if is_open else []


@pytest.mark.parametrize("make", [
    lambda path: sitscad.load(path), lambda path: sitscad.load_text(TEXT),
    lambda path: sitscad.load(path).replace("coil.turns", 11),
    lambda path: pickle.loads(pickle.dumps(sitscad.load(path))), lambda path: copy.deepcopy(sitscad.load(path)),
])
def test_spec_is_deeply_immutable(make, tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(TEXT)
    spec = make(path)
    assert _mutable(spec) == []
    for mapping in (spec.source.files, spec.source.keys, spec.fpc.rules.sources):
        before = dict(mapping)
        for change in (lambda m=mapping: m.update(x=1), lambda m=mapping: m.clear(), lambda m=mapping: m.pop("x", 0),
                       lambda m=mapping: m.setdefault("x", 1), lambda m=mapping: m.__setitem__("x", 1)):
            with pytest.raises(TypeError):
                change()
        assert mapping == before and json.loads(json.dumps(dict.fromkeys(mapping, 1))) == dict.fromkeys(mapping, 1)


def test_design_is_copied_and_pickled_with_equal_spec():
    design = sitscad.Design(_spec())
    assert copy.copy(design).spec == pickle.loads(pickle.dumps(design)).spec == _spec()
